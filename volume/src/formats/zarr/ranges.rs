//! The lowest and the highest sample of what is drawn of each chunk: of the 32³ cells from its first sample on, whose last corners lie in its
//! neighbours. Where an isovalue is not between them, the chunk shows nothing.

use super::array::{Array, New};
use super::voxel::{CHUNK, Voxel};
use rayon::prelude::*;
use std::io;
use std::path::Path;

/// Ranges of all chunks of a level, those along x fastest.
#[derive(Clone)]
pub struct Ranges<T> {
    count: [usize; 3],
    /// `None` where no sample came yet.
    ends: Vec<Option<[T; 2]>>,
}

fn wider<T: PartialOrd + Copy>(a: Option<[T; 2]>, b: Option<[T; 2]>) -> Option<[T; 2]> {
    match (a, b) {
        (Some(a), Some(b)) => Some([if b[0] < a[0] { b[0] } else { a[0] }, if b[1] > a[1] { b[1] } else { a[1] }]),
        (a, b) => a.or(b),
    }
}

impl<T: Voxel> Ranges<T> {
    /// Of a level of `dims` samples, none of which came.
    pub fn of(dims: [usize; 3]) -> Self {
        let count = dims.map(|n| n.div_ceil(CHUNK));
        Self { count, ends: vec![None; count.iter().product()] }
    }

    /// Chunks along x, y and z.
    pub fn count(&self) -> [usize; 3] {
        self.count
    }

    /// Adds slab number `n`. Its first slice belongs to the chunks before it, too.
    pub fn add(&mut self, n: usize, slab: &[T], dims: [usize; 3]) {
        let layer = self.count[0] * self.count[1];
        self.widen(n * layer, slab, dims);
        if n > 0 {
            self.widen((n - 1) * layer, &slab[..dims[0] * dims[1]], dims);
        }
    }

    fn widen(&mut self, from: usize, slices: &[T], [nx, ny, _]: [usize; 3]) {
        let [cx, cy, _] = self.count;
        self.ends[from..from + cx * cy].par_iter_mut().enumerate().for_each(|(chunk, ends)| {
            let (x0, y0) = (chunk % cx * CHUNK, chunk / cx * CHUNK);
            let (x1, y1) = ((x0 + CHUNK + 1).min(nx), (y0 + CHUNK + 1).min(ny));
            // Column by column, so that vectors of samples are compared at once.
            let first = slices[y0 * nx + x0];
            let (mut lowest, mut highest) = ([first; CHUNK + 1], [first; CHUNK + 1]);
            for slice in slices.chunks(nx * ny) {
                for row in slice.chunks(nx).take(y1).skip(y0) {
                    for ((low, high), &s) in lowest.iter_mut().zip(&mut highest).zip(&row[x0..x1]) {
                        *low = if s < *low { s } else { *low };
                        *high = if s > *high { s } else { *high };
                    }
                }
            }
            let columns = lowest.into_iter().zip(highest).map(|(low, high)| Some([low, high]));
            *ends = columns.fold(*ends, wider);
        });
    }

    /// Of chunks of the next level, `count` of them: what 2³ of these reach.
    pub fn halved(&self, count: [usize; 3]) -> Self {
        let [nx, ny, nz] = self.count;
        let at = |n: usize| {
            let [x, y, z] = [n % count[0], n / count[0] % count[1], n / (count[0] * count[1])].map(|c| 2 * c);
            let near = |n: usize, of: usize| n.min(of - 1)..(n + 2).min(of);
            let children = near(z, nz).flat_map(|z| near(y, ny).flat_map(move |y| near(x, nx).map(move |x| (z * ny + y) * nx + x)));
            children.map(|n| self.ends[n]).fold(None, wider)
        };
        Self { count, ends: (0..count.iter().product()).map(at).collect() }
    }

    /// Writes them as an array \[2, z, y, x\]: all lowest, then all highest.
    pub fn write(&self, folder: &Path) -> io::Result<()> {
        let [x, y, z] = self.count.map(|n| n as u64);
        let (shape, chunk) = ([2, z, y, x], [1, z, y, x]);
        let about = New { shape: &shape, shard: &shape, chunk: &chunk, kind: T::KIND, names: &["end", "z", "y", "x"], few_bits: false };
        let array = Array::create(folder, &about)?;
        // All slices have come.
        let ends = |end: usize| self.ends.iter().map(move |ends| ends.map_or(T::zeroed(), |ends| ends[end]));
        let all: Vec<T> = ends(0).chain(ends(1)).collect();
        array.write(&[0; 4], bytemuck::cast_slice(&all))
    }
}
