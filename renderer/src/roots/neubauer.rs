//! The solver `neubauer`: linear interpolation, repeated (Neubauer, Mroz, Hauser and Wegenkittl 2002). As blind as `linear` to what
//! enters and leaves within a cell, and of three roots it may return the last.
//!
//! The twin of `shaders/neubauer.wgsl`.

use super::{Entry, inside, trilinear};
use crate::lanes::{Floats, Mask, Vecs, lerp};
use fearless_simd::Simd;
use fearless_simd::prelude::*;

#[inline(always)]
pub(super) fn first_entry<S: Simd>(simd: S, steps: u32, f: &[Floats<S>; 8], p: &Vecs<S>, q: &Vecs<S>, asked: Mask<S>) -> Entry<S> {
    let (mut f0, mut f1) = (trilinear(f, p), trilinear(f, q));
    let (zero, at_start) = (Floats::splat(simd, 0.0), inside(f0));
    let found = asked & (at_start | inside(f1));
    let (mut u0, mut u1) = (zero, Floats::splat(simd, 1.0));
    for _ in 0..steps {
        let u = u0 + (u1 - u0) * (f0 / (f0 - f1));
        let value = trilinear(f, &lerp(p, q, u));
        let is_inside = inside(value);
        (u1, f1) = (is_inside.select(u, u1), is_inside.select(value, f1));
        (u0, f0) = (is_inside.select(u0, u), is_inside.select(f0, value));
    }
    Entry { found, u: at_start.select(zero, u0 + (u1 - u0) * (f0 / (f0 - f1))) }
}
