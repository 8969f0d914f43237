//! Normals where a solid cuts bone.
//!
//! Its part of `shaders/within.wgsl`.

use super::gradient::gradient;
use super::within::corners;
use crate::lanes::{Floats, Ints, Mask, Vecs, axes, dot};
use crate::roots::trilinear;
use bregma_field::Solid;
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// Normals where a solid cuts bone: its own at its face, and within `rim_units` behind it a blend with the surface's, both in index space and toward
/// the viewer, who looks along `direction`. (The 2006 thesis, section 5.3, blends as far.)
#[inline(always)]
pub(crate) fn rim<S: Simd>(
    simd: S,
    (solid, rim_units): (&Solid, f32),
    (cell, local): (&[Ints<S>; 3], &Vecs<S>),
    surface: &Vecs<S>,
    (direction, at_face): (&Vecs<S>, Mask<S>),
    of: Mask<S>,
) -> Vecs<S> {
    let (near, f) = corners(simd, solid, cell, of);
    let (distance, gradient) = (trilinear(&f, local), gradient(&f, local));
    let share = at_face.select(Floats::splat(simd, 0.0), (distance / rim_units.max(f32::MIN_POSITIVE)).max(0.0).min(1.0));
    let unit = |v: &Vecs<S>| {
        let length = dot(v, v).sqrt();
        let away = dot(v, direction).simd_gt(0.0);
        let factor = length.simd_gt(0.0).select(away.select(-1.0 / length, 1.0 / length), Floats::splat(simd, 0.0));
        axes!(a => v[a] * factor)
    };
    let (own, bone) = (unit(&gradient), unit(surface));
    let blends = near & (at_face | share.simd_lt(1.0));
    axes!(a => blends.select(own[a] * (1.0 - share) + bone[a] * share, surface[a]))
}
