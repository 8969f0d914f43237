//! A scan and its halvings, each an array in chunks of 32³ samples, written in one pass as slices come.
//!
//! ```text
//! slices ──► level 0: 32 at a time ──► its shards
//!                └─ means of 2³ ──► level 1: 32 at a time ──► its shards
//!                                       └─ means of 2³ ──► … until no side has more than 64
//! ```
//! Memory is that of 32 slices and their halvings, however many come.

use super::array::{Array, New};
use super::ranges::Ranges;
use super::voxel::{CHUNK, Voxel};
use rayon::prelude::*;
use std::io;
use std::path::Path;

/// Samples along x and y of a shard, which is a file; along z it has one chunk, so that each is written once, in order.
const SHARD: usize = 1024;
/// A level whose sides have at most so many samples is the last.
const LAST: usize = 64;

/// How many samples each level has along x, y and z, the scan's own first.
pub fn levels(dims: [usize; 3]) -> Vec<[usize; 3]> {
    let mut all = vec![dims];
    while let Some(last) = all.last().filter(|last| last.iter().any(|n| *n > LAST)) {
        all.push(last.map(|n| n.div_ceil(2)));
    }
    all
}

/// A pyramid that is being written.
pub struct Pyramid<T> {
    levels: Vec<Level<T>>,
}

struct Level<T> {
    array: Array,
    dims: [usize; 3],
    /// Samples of slices that came and are not written, fewer than [`CHUNK`] slices.
    slab: Vec<T>,
    /// Slabs that are written.
    written: usize,
    ranges: Ranges<T>,
}

impl<T: Voxel> Pyramid<T> {
    /// Of a scan of `dims` samples, in `folder`; with `few_bits` where samples are rounded.
    pub fn begin(folder: &Path, dims: [usize; 3], few_bits: bool) -> io::Result<Self> {
        let level = |(n, dims): (usize, [usize; 3])| {
            let [x, y, z] = dims.map(|n| n as u64);
            let side = |n: u64| n.next_multiple_of(CHUNK as u64).min(SHARD as u64);
            let chunk = [CHUNK as u64; 3];
            let (shape, shard) = ([z, y, x], [chunk[0], side(y), side(x)]);
            let about = New { shape: &shape, shard: &shard, chunk: &chunk, kind: T::KIND, names: &["z", "y", "x"], few_bits };
            let array = Array::create(&folder.join(n.to_string()), &about)?;
            Ok(Level { array, dims, slab: vec![], written: 0, ranges: Ranges::of(dims) })
        };
        Ok(Self { levels: levels(dims).into_iter().enumerate().map(level).collect::<io::Result<_>>()? })
    }

    /// Takes the next samples, i fastest.
    pub fn push(&mut self, samples: &[T]) -> io::Result<()> {
        push(&mut self.levels, samples)
    }

    /// Writes what is left, and the ranges of all chunks into `folder`.
    pub fn finish(mut self, folder: &Path) -> io::Result<()> {
        let mut beneath: Option<Ranges<T>> = None;
        for n in 0..self.levels.len() {
            // What is left of this level completes the next.
            flush(&mut self.levels[n..])?;
            let ranges = &self.levels[n].ranges;
            ranges.write(&folder.join("ranges").join(n.to_string()))?;
            let reach = beneath.map(|finer| finer.halved(ranges.count()));
            if let Some(reach) = &reach {
                reach.write(&folder.join("reach").join(n.to_string()))?;
            }
            beneath = Some(reach.unwrap_or_else(|| ranges.clone()));
        }
        Ok(())
    }
}

fn push<T: Voxel>(levels: &mut [Level<T>], mut samples: &[T]) -> io::Result<()> {
    let Some(level) = levels.first() else { return Ok(()) };
    let full = level.dims[0] * level.dims[1] * CHUNK;
    while !samples.is_empty() {
        let level = &mut levels[0];
        let (now, later) = samples.split_at(samples.len().min(full - level.slab.len()));
        // As much as the scan has: a small one fills no slab.
        level.slab.reserve_exact((full - level.slab.len()).min(level.dims.iter().product()));
        level.slab.extend_from_slice(now);
        samples = later;
        if level.slab.len() == full {
            flush(levels)?;
        }
    }
    Ok(())
}

/// Writes the slab of the first of `levels`, and passes its halving on to the others.
fn flush<T: Voxel>(levels: &mut [Level<T>]) -> io::Result<()> {
    let Some((level, coarser)) = levels.split_first_mut() else { return Ok(()) };
    if level.slab.is_empty() {
        return Ok(());
    }
    let slab = std::mem::take(&mut level.slab);
    level.ranges.add(level.written, &slab, level.dims);
    level.write(&slab)?;
    level.written += 1;
    if let Some(next) = coarser.first() {
        let halved = halve(&slab, level.dims, next.dims);
        push(coarser, &halved)?;
    }
    level.slab = slab;
    level.slab.clear();
    Ok(())
}

impl<T: Voxel> Level<T> {
    /// Writes a slab's shards.
    fn write(&self, slab: &[T]) -> io::Result<()> {
        let [nx, ny, _] = self.dims;
        let depth = slab.len() / (nx * ny);
        let [wide, high] = [nx, ny].map(|n| n.next_multiple_of(CHUNK).min(SHARD));
        let mut shard = vec![T::zeroed(); wide * high * CHUNK];
        for (sy, y0) in (0..ny).step_by(high).enumerate() {
            for (sx, x0) in (0..nx).step_by(wide).enumerate() {
                // Beyond the scan its last samples are repeated, which packs best.
                shard.par_chunks_mut(wide).enumerate().for_each(|(row, to)| {
                    let (z, y) = ((row / high).min(depth - 1), (y0 + row % high).min(ny - 1));
                    let from = &slab[(z * ny + y) * nx..][x0..nx.min(x0 + wide)];
                    to[..from.len()].copy_from_slice(from);
                    to[from.len()..].fill(from[from.len() - 1]);
                });
                self.array.write(&[self.written as u64, sy as u64, sx as u64], bytemuck::cast_slice(&shard))?;
            }
        }
        Ok(())
    }
}

/// Means of 2³ samples of a slab; the last ones along an odd side are repeated.
fn halve<T: Voxel>(slab: &[T], [nx, ny, _]: [usize; 3], [hx, hy, _]: [usize; 3]) -> Vec<T> {
    let depth = slab.len() / (nx * ny);
    let mut halved = vec![T::zeroed(); hx * hy * depth.div_ceil(2)];
    halved.par_chunks_mut(hx).enumerate().for_each(|(row, to)| {
        let (z, y) = (row / hy * 2, row % hy * 2);
        let line = |z: usize, y: usize| &slab[(z.min(depth - 1) * ny + y.min(ny - 1)) * nx..][..nx];
        let [a, b, c, d] = [line(z, y), line(z, y + 1), line(z + 1, y), line(z + 1, y + 1)];
        let pairs = [a, b, c, d].map(|line| line.as_chunks::<2>().0);
        let eight = pairs[0].iter().zip(pairs[1]).zip(pairs[2]).zip(pairs[3]);
        for (to, (((a, b), c), d)) in to.iter_mut().zip(eight) {
            *to = T::mean([a[0], a[1], b[0], b[1], c[0], c[1], d[0], d[1]]);
        }
        if nx % 2 == 1 {
            to[hx - 1] = [a, b, c, d].map(|line| [line[nx - 1]; 2]).as_flattened().try_into().map_or(T::zeroed(), T::mean);
        }
    });
    halved
}
