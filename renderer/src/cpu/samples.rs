//! Reading samples for sixteen rays: the corners of their cells, and what lies around them.
//!
//! The twin of `shaders/samples.wgsl`.

use crate::lanes::{Floats, Ints, LANES, Mask, numbers};
use crate::roots::spline::Taps;
use bregma_field::{AnyBlock, Block, Sample, Store, Surface, with_block};
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// Where samples come from.
#[derive(Clone, Copy)]
pub(crate) enum Source<'a> {
    Samples(AnyBlock<'a>),
    /// From nowhere, to time a walk that fetches nothing.
    Nothing,
}

impl<'a> Source<'a> {
    /// The samples of a surface, all of them.
    pub fn of(surface: &'a Surface) -> Self {
        Self::Samples(Store::of(&surface.volume).whole())
    }

    /// Samples at the corners of a cell, by its lowest, in the lanes of `of`; corner x + 2y + 4z is at (x, y, z).
    #[inline(always)]
    pub fn corners<S: Simd>(self, simd: S, cell: &[Ints<S>; 3], of: Mask<S>) -> [Floats<S>; 8] {
        match self {
            Self::Samples(samples) => with_block!(samples, block => corners(simd, &block, cell, of)),
            Self::Nothing => [Floats::splat(simd, 0.0); 8],
        }
    }

    /// Samples from the one before cells to the one behind them, in the lanes of `of`; at the grid's border the nearest.
    #[inline(always)]
    pub fn taps<S: Simd>(self, dims: [i32; 3], cell: &[Ints<S>; 3], of: Mask<S>) -> Taps {
        let mut taps = [[0.0; LANES]; 64];
        if let Self::Samples(samples) = self {
            let cell = cell.map(Ints::to_array);
            with_block!(samples, block => {
                for lane in numbers(of) {
                    let [xs, ys, zs] = around(dims, [cell[0][lane], cell[1][lane], cell[2][lane]]);
                    for (n, tap) in taps.iter_mut().enumerate() {
                        tap[lane] = block.at([xs[n % 4], ys[n / 4 % 4], zs[n / 16]]).to_f32();
                    }
                }
            });
        }
        taps
    }
}

/// Samples that are read two at a time, side by side as bits, and told apart for all lanes at once.
pub(super) trait Pairs: Sample {
    /// The two ends of four edges of cells in all lanes.
    type Edges: Copy + Default;

    /// Reads those of a lane, where an edge begins at number `n` of each of four rows of samples.
    fn read(edges: &mut Self::Edges, lane: usize, rows: &[&[Self]; 4], n: usize);

    /// Corner x + 2y + 4z is at (x, y, z).
    fn corners<S: Simd>(simd: S, edges: &Self::Edges) -> [Floats<S>; 8];
}

macro_rules! pairs_of_bits {
    ($sample:ty, $unsigned:ty, $first:expr, $second:expr) => {
        impl Pairs for $sample {
            type Edges = [[i32; LANES]; 4];

            #[inline(always)]
            fn read(edges: &mut Self::Edges, lane: usize, rows: &[&[Self]; 4], n: usize) {
                for (edge, row) in edges.iter_mut().zip(rows) {
                    edge[lane] = i32::from(row[n] as $unsigned) | i32::from(row[n + 1] as $unsigned) << <$unsigned>::BITS;
                }
            }

            #[inline(always)]
            fn corners<S: Simd>(simd: S, [a, b, c, d]: &Self::Edges) -> [Floats<S>; 8] {
                let (first, second): (fn(Ints<S>) -> Ints<S>, fn(Ints<S>) -> Ints<S>) = ($first, $second);
                let [a, b] = [Ints::load_array_ref(simd, a), Ints::load_array_ref(simd, b)];
                let [c, d] = [Ints::load_array_ref(simd, c), Ints::load_array_ref(simd, d)];
                let [f0, f1, f2, f3] = [first(a).to_float(), second(a).to_float(), first(b).to_float(), second(b).to_float()];
                let [f4, f5, f6, f7] = [first(c).to_float(), second(c).to_float(), first(d).to_float(), second(d).to_float()];
                [f0, f1, f2, f3, f4, f5, f6, f7]
            }
        }
    };
}
pairs_of_bits!(u8, u8, |pair| pair & 0xff, |pair| pair >> 8);
pairs_of_bits!(u16, u16, |pair| pair & 0xffff, |pair| (pair >> 16) & 0xffff);
pairs_of_bits!(i16, u16, |pair| (pair << 16) >> 16, |pair| pair >> 16);

impl Pairs for f32 {
    type Edges = [[f32; LANES]; 8];

    #[inline(always)]
    fn read(edges: &mut Self::Edges, lane: usize, rows: &[&[Self]; 4], n: usize) {
        for (ends, row) in edges.chunks_mut(2).zip(rows) {
            (ends[0][lane], ends[1][lane]) = (row[n], row[n + 1]);
        }
    }

    #[inline(always)]
    fn corners<S: Simd>(simd: S, edges: &Self::Edges) -> [Floats<S>; 8] {
        let at = |c: usize| Floats::load_array_ref(simd, &edges[c]);
        [at(0), at(1), at(2), at(3), at(4), at(5), at(6), at(7)]
    }
}

/// The rows of samples that edges of cells along x begin in, equally long: one check is enough for all of them.
#[inline(always)]
pub(super) fn rows_of_edges<'a, T: Sample>(block: &Block<'a, T>) -> [&'a [T]; 4] {
    let (all, [row, layer]) = (block.onward([0; 3]), block.strides());
    // A flat grid has no cells.
    let length = all.len().saturating_sub(row + layer);
    let behind = |first: usize| &all[first.min(all.len() - length)..][..length];
    [&all[..length], behind(row), behind(layer), behind(layer + row)]
}

#[inline(always)]
fn corners<S: Simd, T: Pairs>(simd: S, block: &Block<'_, T>, cell: &[Ints<S>; 3], of: Mask<S>) -> [Floats<S>; 8] {
    let (rows, [row, layer]) = (rows_of_edges(block), block.strides());
    let mut edges = T::Edges::default();
    if rows[0].len() <= i32::MAX as usize {
        let number = (cell[0] + cell[1] * row as i32 + cell[2] * layer as i32).to_array();
        for lane in numbers(of) {
            T::read(&mut edges, lane, &rows, number[lane] as usize);
        }
    } else {
        let cell = cell.map(Ints::to_array);
        for lane in numbers(of) {
            let [x, y, z] = [cell[0][lane], cell[1][lane], cell[2][lane]].map(|n| n as usize);
            T::read(&mut edges, lane, &rows, x + row * y + layer * z);
        }
    }
    T::corners(simd, &edges)
}

/// Along each axis from the one before a cell to the one behind it; at the grid's border the nearest.
#[inline(always)]
pub(super) fn around(dims: [i32; 3], cell: [i32; 3]) -> [[usize; 4]; 3] {
    let along = |a: usize| [-1, 0, 1, 2].map(|o| (cell[a] + o).clamp(0, dims[a] - 1) as usize);
    [along(0), along(1), along(2)]
}
