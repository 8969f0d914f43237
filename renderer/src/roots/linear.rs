//! The solver `linear`: one interpolation between the values at entry and exit. Misses what enters and leaves within a cell.
//!
//! The twin of `shaders/linear.wgsl`.

use super::{Entry, inside, trilinear};
use crate::lanes::{Floats, Mask, Vecs};
use fearless_simd::Simd;
use fearless_simd::prelude::*;

#[inline(always)]
pub(super) fn first_entry<S: Simd>(simd: S, f: &[Floats<S>; 8], p: &Vecs<S>, q: &Vecs<S>, asked: Mask<S>) -> Entry<S> {
    let (f0, f1) = (trilinear(f, p), trilinear(f, q));
    Entry { found: asked & (inside(f0) | inside(f1)), u: inside(f0).select(Floats::splat(simd, 0.0), f0 / (f0 - f1)) }
}
