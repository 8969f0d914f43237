//! Fixed steps along a segment of one cell: samples at multiples of the step from where the segment begins, and at its end, with one
//! linear interpolation where two lie on different sides. Pictures are drawn by `cpu/steps.rs`, which knows no cells; this is for the
//! stability table, and judges the method as if sampling began anew in each cell.
//!
//! The twin of `shaders/segment_steps.wgsl`.

use super::{Entry, inside, trilinear};
use crate::lanes::{Floats, Mask, Vecs, axes, dot, lerp};
use fearless_simd::Simd;
use fearless_simd::prelude::*;

#[inline(always)]
pub(super) fn first_entry<S: Simd>(simd: S, per_voxel: u32, f: &[Floats<S>; 8], p: &Vecs<S>, q: &Vecs<S>, asked: Mask<S>) -> Entry<S> {
    let along = axes!(a => q[a] - p[a]);
    let steps = per_voxel as f32 * dot(&along, &along).sqrt();
    let (zero, one) = (Floats::splat(simd, 0.0), Floats::splat(simd, 1.0));
    let (mut n, mut u0, mut f0, mut u) = (0.0, zero, trilinear(f, p), zero);
    let mut found = asked & inside(f0);
    let mut sought = asked & !found;
    while (sought & steps.simd_gt(n)).any_true() {
        sought &= steps.simd_gt(n);
        n += 1.0;
        let u1 = steps.simd_gt(n).select(n / steps, one);
        let f1 = trilinear(f, &lerp(p, q, u1));
        let met = sought & inside(f1);
        u = met.select(u0 + (u1 - u0) * (f0 / (f0 - f1)), u);
        (found, sought) = (found | met, sought & !met);
        (u0, f0) = (u1, f1);
    }
    Entry { found, u }
}
