//! Leaving out of a stream of samples what is not to be kept: all but what surfaces between two isovalues need, or more than an error of each.
//!
//! Surfaces between two isovalues lo and hi stay the same to the bit, normals too, where each of these samples does:
//!
//! ```text
//!     i−1   i  ┃ i+1  i+2        a cell ┃ between i and i+1 can hold such a surface where its corners' values are not all
//!      •    •──╂──•    •         below lo and not all above hi; its corners make the surface, and those beside them its normal
//! ```
//! The others become one sample below lo, or one above hi, whichever they lie on the side of. A cell that cannot hold a surface has all corners on
//! one side, so it cannot afterwards, either.
//!
//! An error of D rounds samples to multiples of 2D + 1 (of 2D where they are floats), so that none is farther off than D, and neither is a
//! value between samples, which is a mean of theirs: the surface of an isovalue v lies between those of v − D and v + D of the scan.

use super::voxel::Voxel;
use crate::{Keep, Samples};
use rayon::prelude::*;
use std::collections::VecDeque;

/// What is kept, in sample units.
#[derive(Clone, Copy)]
pub struct Kept<T> {
    /// Surfaces from and to, and what stands for samples below and above.
    surfaces: Option<([f64; 2], [T; 2])>,
    /// Samples are multiples of it; 0: as they are.
    step: f64,
}

/// Types of samples and what lies beside a value.
pub trait Near: Voxel {
    /// The highest below `low` and the lowest above `high`; any where the type has none, as then no sample lies there.
    fn below_and_above(low: f64, high: f64) -> [Self; 2];
    /// The steps of samples none of which is farther than `error` from one of its multiples.
    fn step(error: f64) -> f64;
    /// The nearest multiple of `step`, as far as the type goes.
    fn rounded(self, step: f64) -> Self;
    /// Samples that are of the type.
    fn among(samples: &Samples) -> &[Self];
}

macro_rules! whole {
    ($($t:ty: $kind:ident),*) => {$(
        impl Near for $t {
            fn below_and_above(low: f64, high: f64) -> [Self; 2] {
                // Beyond the type's ends a float becomes these.
                [low.ceil() - 1.0, high.floor() + 1.0].map(|v| v as Self)
            }
            fn step(error: f64) -> f64 {
                2.0 * error.floor() + 1.0
            }
            #[inline(always)]
            fn rounded(self, step: f64) -> Self {
                // A float becomes the nearest number of the type, which is nearer than the multiple beyond it.
                ((f64::from(self) / step).round() * step) as Self
            }
            fn among(samples: &Samples) -> &[Self] {
                if let Samples::$kind(samples) = samples { samples } else { &[] }
            }
        }
    )*};
}
whole!(u8: U8, i16: I16, u16: U16);

impl Near for f32 {
    fn below_and_above(low: f64, high: f64) -> [Self; 2] {
        [(low as Self).next_down(), (high as Self).next_up()]
    }
    fn step(error: f64) -> f64 {
        2.0 * error
    }
    #[inline(always)]
    fn rounded(self, step: f64) -> Self {
        // A little less than half a step off, as the result is rounded once more.
        let near = ((f64::from(self) / step).round() * step) as Self;
        if (f64::from(near) - f64::from(self)).abs() <= step / 2.0 { near } else { self }
    }
    fn among(samples: &Samples) -> &[Self] {
        if let Samples::F32(samples) = samples { samples } else { &[] }
    }
}

impl<T: Near> Kept<T> {
    /// Of a scan whose samples mean what `slope` and `intercept` say; `None` where all is kept.
    pub fn of(keep: Keep, [slope, intercept]: [f64; 2]) -> Option<Self> {
        let error = keep.error / slope.abs();
        let step = T::step(error);
        let step = if step > 1.0 || T::step(0.0) == 0.0 && step > 0.0 { step } else { 0.0 };
        let surfaces = keep.surfaces.map(|ends| {
            let ends = ends.map(|v| (v - intercept) / slope);
            let [low, high] = [ends[0].min(ends[1]) - error, ends[0].max(ends[1]) + error];
            ([low, high], T::below_and_above(low, high))
        });
        (surfaces.is_some() || step > 0.0).then_some(Self { surfaces, step })
    }

    /// Whether many bits of all samples are alike: they are rounded, and not most of them one sample, which packs better by bytes.
    pub fn has_few_bits(&self) -> bool {
        self.step > 0.0 && self.surfaces.is_none()
    }
}

/// How far from its lowest corner a cell needs samples: two to the upper side, for the normal at its upper corners, and one to the lower.
const REACH: usize = 2;
/// Slices that are passed on together: enough for all cores, few enough to need little memory.
const TOGETHER: usize = 8;

/// Passes on of a stream of slices what is kept of it.
pub struct Filter<T> {
    kept: Kept<T>,
    dims: [usize; 3],
    /// Slices from number `first` on, the last of them perhaps not whole.
    held: Vec<T>,
    first: usize,
    /// Slices that were passed on.
    done: usize,
    /// Of the layers of cells from number `layers_from` on, which samples' columns need them.
    layers: VecDeque<Vec<bool>>,
    layers_from: usize,
}

impl<T: Near> Filter<T> {
    /// Of a scan of `dims` samples.
    pub fn new(kept: Kept<T>, dims: [usize; 3]) -> Self {
        Self { kept, dims, held: vec![], first: 0, done: 0, layers: VecDeque::new(), layers_from: 0 }
    }

    /// Takes the next samples; gives those that are ready.
    pub fn push(&mut self, samples: &[T]) -> Vec<T> {
        if self.kept.surfaces.is_none() {
            return samples.par_iter().map(|s| s.rounded(self.kept.step)).collect();
        }
        self.held.extend_from_slice(samples);
        let slice = self.dims[0] * self.dims[1];
        let there = self.first + self.held.len() / slice;
        let is_all = there == self.dims[2];
        let ready = if is_all { there } else { there.saturating_sub(REACH) };
        if !is_all && ready < self.done + TOGETHER {
            return vec![];
        }
        self.pass(ready, there)
    }

    /// The slices up to number `until`, of those up to number `there`.
    fn pass(&mut self, until: usize, there: usize) -> Vec<T> {
        let [nx, ny, nz] = self.dims;
        let Some(([low, high], beside)) = self.kept.surfaces else { return vec![] };
        let slice = nx * ny;
        // Layers of cells c whose corners are in slices c and c + 1.
        let from = self.layers_from + self.layers.len();
        let until_layer = (until + REACH - 1).min(there.saturating_sub(1));
        for c in from..until_layer {
            let two = &self.held[(c - self.first) * slice..][..2 * slice];
            self.layers.push_back(needed(two, [nx, ny], [low, high]));
        }
        let mut out = vec![T::zeroed(); (until - self.done) * slice];
        let (layers, layers_from, held, first, done) = (&self.layers, self.layers_from, &self.held, self.first, self.done);
        out.par_chunks_mut(nx).enumerate().for_each(|(row, to)| {
            let (k, y) = (done + row / ny, row % ny);
            let from = &held[((k - first) * ny + y) * nx..][..nx];
            // Slice k is needed by layers k − 2 to k + 1.
            let near = k.saturating_sub(REACH)..(k + REACH).min(nz.saturating_sub(1));
            let near: Vec<&[bool]> = near.map(|c| &layers[c - layers_from][y * nx..][..nx]).collect();
            for (x, to) in to.iter_mut().enumerate() {
                let (s, v) = (from[x], from[x].to_f64());
                let is_needed = near.iter().any(|layer| layer[x]);
                *to = match () {
                    () if !is_needed && v < low => beside[0],
                    () if !is_needed && v > high => beside[1],
                    () if self.kept.step > 0.0 => s.rounded(self.kept.step),
                    () => s,
                };
            }
        });
        self.done = until;
        let drop = until.saturating_sub(REACH).saturating_sub(self.layers_from).min(self.layers.len());
        self.layers.drain(..drop);
        self.layers_from += drop;
        self.held.drain(..(until - self.first) * slice);
        self.first = until;
        out
    }
}

/// Which samples' columns the cells between two slices need: those of cells that can hold a surface, grown by what these reach.
fn needed<T: Near>(two: &[T], [nx, ny]: [usize; 2], [low, high]: [f64; 2]) -> Vec<bool> {
    let slice = nx * ny;
    // Which of the two sides each pair of samples, one above the other, has: bit 0 not above the interval, bit 1 not below it.
    let mut sides = vec![0_u8; slice];
    sides.par_chunks_mut(nx).enumerate().for_each(|(y, sides)| {
        let (a, b) = (&two[y * nx..][..nx], &two[slice + y * nx..][..nx]);
        for (x, side) in sides.iter_mut().enumerate() {
            let [a, b] = [a[x], b[x]].map(T::to_f64);
            *side = u8::from(a <= high || b <= high) | u8::from(a >= low || b >= low) << 1;
        }
    });
    // Along x: cell x has the corners x and x + 1, and needs samples x − 1 to x + 2.
    let mut wide = vec![false; slice];
    wide.par_chunks_mut(nx).enumerate().take(ny - 1).for_each(|(y, wide)| {
        let (a, b) = (&sides[y * nx..][..nx], &sides[(y + 1) * nx..][..nx]);
        for x in (0..nx - 1).filter(|x| a[*x] | a[x + 1] | b[*x] | b[x + 1] == 3) {
            wide[x.saturating_sub(1)..(x + 3).min(nx)].fill(true);
        }
    });
    let mut all = vec![false; slice];
    all.par_chunks_mut(nx).enumerate().for_each(|(y, all)| {
        for row in y.saturating_sub(REACH)..(y + REACH).min(ny) {
            all.iter_mut().zip(&wide[row * nx..][..nx]).for_each(|(to, of)| *to |= of);
        }
    });
    all
}
