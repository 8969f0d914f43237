//! Where cuts let rays begin and end.
//!
//! The twin of `shaders/cuts.wgsl`.

use super::brick::FAR;
use super::line::Line;
use crate::lanes::{Doubles, Floats, Mask, Vecs, axes};
use bregma_field::Region;
use bregma_field::clip::Half;
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// The part of rays that cuts leave.
///
/// ```text
///   eye ──────┊cut away┊▓▓▓▓▓ kept ▓▓▓▓▓┊cut away┊──►
///           s = 0    begin             end            is_cut: begin > 0
/// ```
#[derive(Clone, Copy)]
pub(super) struct Kept<S: Simd> {
    /// Where it begins, and where it ends; the first is the larger where nothing is left.
    pub begin: Floats<S>,
    pub end: Floats<S>,
    /// Which begin at a cut, and not at the eye.
    pub is_cut: Mask<S>,
    /// Of that cut, outward, unit, in the world.
    pub normal: Vecs<S>,
}

/// What `region` leaves of `lines` of the world from s = 0 on.
#[inline(always)]
pub(super) fn kept<S: Simd>(simd: S, region: &Region, lines: &Line<S>) -> Kept<S> {
    let zero = Floats::splat(simd, 0.0);
    let all = Kept { begin: zero, end: Floats::splat(simd, FAR), is_cut: Mask::splat(simd, false), normal: [zero; 3] };
    if region.is_all() {
        return all;
    }
    simd.vectorize(
        #[inline(always)]
        || kept_of(simd, all, region, lines),
    )
}

#[inline(always)]
fn kept_of<S: Simd>(simd: S, mut kept: Kept<S>, region: &Region, lines: &Line<S>) -> Kept<S> {
    let splat = |v| Floats::splat(simd, v);
    let zero = splat(0.0);
    for half in &region.halves {
        let (room, rate) = along_cut(simd, half, lines);
        let s = -room / rate;
        let (enters, leaves) = (rate.simd_lt(zero), rate.simd_gt(zero));
        let normal = half.normal.as_vec3();
        enter(&mut kept, s, &axes!(a => splat(normal[a])), enters);
        kept.end = leaves.select(kept.end.min(s), kept.end);
        // Along the plane: all or nothing.
        kept.end = (rate.simd_eq(zero) & room.simd_gt(zero)).select(splat(-FAR), kept.end);
    }
    for tube in &region.tubes {
        let [(x, x_rate), (y, y_rate)] = [along_cut(simd, &tube.across[0], lines), along_cut(simd, &tube.across[1], lines)];
        let radius = tube.radius_mm as f32;
        let a = x_rate * x_rate + y_rate * y_rate;
        let b = x * x_rate + y * y_rate;
        let c = x * x + y * y - radius * radius;
        let discriminant = b * b - a * c;
        // Both roots without cancellation (Numerical Recipes, 5.6).
        let k = -(b + discriminant.max(zero).sqrt().copysign(b));
        let moves = a.simd_gt(zero) & discriminant.simd_gt(zero);
        let (first, second) = (k / a, c / k);
        let (first, second) = (first.min(second), first.max(second));
        let [u, v] = tube.across.map(|half| half.normal.as_vec3());
        let (x, y) = ((x + first * x_rate) / radius, (y + first * y_rate) / radius);
        enter(&mut kept, first, &axes!(a => x * u[a] + y * v[a]), moves);
        kept.end = moves.select(kept.end.min(second), kept.end);
        kept.end = (!moves & c.simd_gt(zero)).select(splat(-FAR), kept.end);
    }
    kept
}

/// How far beyond a plane lines begin, and by how much farther they get with s.
#[inline(always)]
fn along_cut<S: Simd>(simd: S, half: &Half, lines: &Line<S>) -> (Floats<S>, Floats<S>) {
    let [x, y, z] = axes!(a => Doubles::splat(simd, half.normal[a]));
    let (o, d) = (&lines.origin, &lines.direction);
    let room = o[0] * x + o[1] * y + o[2] * z - Doubles::splat(simd, half.offset_mm);
    (room.to_floats(), (d[0] * x + d[1] * y + d[2] * z).to_floats())
}

#[inline(always)]
fn enter<S: Simd>(kept: &mut Kept<S>, s: Floats<S>, normal: &Vecs<S>, of: Mask<S>) {
    let later = of & s.simd_gt(kept.begin);
    kept.begin = later.select(s, kept.begin);
    kept.is_cut |= later;
    kept.normal = axes!(a => later.select(normal[a], kept.normal[a]));
}
