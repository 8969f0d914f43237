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
pub(crate) struct Kept<S: Simd> {
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
pub(crate) fn kept<S: Simd>(simd: S, region: &Region, lines: &Line<S>) -> Kept<S> {
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
    for round in &region.rounds {
        let [(x, x_rate), (y, y_rate), (z, z_rate)] = axes!(a => along_cut(simd, &round.across[a], lines));
        let radius = round.radius_mm as f32;
        let a = x_rate * x_rate + y_rate * y_rate + z_rate * z_rate;
        let b = x * x_rate + y * y_rate + z * z_rate;
        let c = x * x + y * y + z * z - radius * radius;
        let discriminant = b * b - a * c;
        // Both roots without cancellation (Numerical Recipes, 5.6).
        let k = -(b + discriminant.max(zero).sqrt().copysign(b));
        let moves = a.simd_gt(zero) & discriminant.simd_gt(zero);
        let (first, second) = (k / a, c / k);
        let (first, second) = (first.min(second), first.max(second));
        let [u, v, w] = round.across.map(|half| half.normal.as_vec3());
        let [x, y, z] = [(x + first * x_rate) / radius, (y + first * y_rate) / radius, (z + first * z_rate) / radius];
        enter(&mut kept, first, &axes!(a => x * u[a] + y * v[a] + z * w[a]), moves);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::LANES;
    use bregma_field::{Clip, Shape};
    use bregma_synthetic::Random;
    use fearless_simd::{Level, dispatch};
    use glam::DVec3;

    fn number(r: &mut Random, size: f64) -> f64 {
        // A float32, so that both get the same.
        f64::from((size * (2.0 * r.unit() - 1.0)) as f32)
    }

    fn vector(r: &mut Random, size: f64) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| number(r, size)))
    }

    fn lines<S: Simd>(simd: S, origins: &[DVec3; LANES], directions: &[DVec3; LANES]) -> Line<S> {
        let doubles = |v: &[DVec3; LANES], a: usize| Doubles::of(Floats::load_array(simd, v.map(|v| v[a] as f32)));
        Line { origin: axes!(a => doubles(origins, a)), direction: axes!(a => doubles(directions, a)) }
    }

    #[test]
    fn what_is_kept_of_a_ray_is_what_measurements_keep() {
        // Fails if pictures are cut elsewhere than difference rays, a begin at a cut is taken for the eye's, or a normal is another shape's.
        let mut r = Random(1);
        let mut compared = 0;
        for _ in 0..300 {
            let shapes = (0..1 + (3.0 * r.unit()) as usize).map(|_| match (4.0 * r.unit()) as usize {
                0 => Shape::Plane { normal: vector(&mut r, 1.0).normalize(), offset_mm: number(&mut r, 20.0) },
                2 => Shape::Sphere { centre_mm: vector(&mut r, 20.0), radius_mm: 40.0 + number(&mut r, 20.0) },
                1 => Shape::Box { low_mm: vector(&mut r, 20.0) - 40.0, high_mm: vector(&mut r, 20.0) + 40.0 },
                _ => Shape::Cylinder {
                    centre_mm: vector(&mut r, 20.0),
                    axis: vector(&mut r, 1.0).normalize(),
                    radius_mm: 30.0 + number(&mut r, 20.0),
                },
            });
            let clips: Vec<Clip> = shapes.collect::<Vec<_>>().into_iter().map(Clip::all).collect();
            let region = Region::of(&clips, 0);
            let (origins, directions) = (std::array::from_fn(|_| vector(&mut r, 100.0)), std::array::from_fn(|_| vector(&mut r, 1.0)));
            let (begins, ends, is_cut, normals) = dispatch!(Level::new(), simd => {
                let kept = kept(simd, &region, &lines(simd, &origins, &directions));
                (kept.begin.to_array(), kept.end.to_array(), kept.is_cut.to_bitmask(), kept.normal.map(|n| n.to_array()))
            });
            for lane in 0..LANES {
                let [begin, end] = region.interval(origins[lane], directions[lane], [0.0, f64::from(FAR)]);
                let length = f64::from(ends[lane]) - f64::from(begins[lane]);
                // Where a line grazes a shape, rounding decides whether it meets it.
                let tolerance = 1e-3 * (1.0 + begin.s.abs().min(1e4));
                if (end.s - begin.s).abs() < 100.0 * tolerance {
                    continue;
                }
                assert_eq!(length > 0.0, end.s > begin.s, "{clips:?} {} {}", origins[lane], directions[lane]);
                if length > 0.0 {
                    compared += 1;
                    let off = (f64::from(begins[lane]) - begin.s).abs();
                    assert!(off < tolerance, "{clips:?}: begins at {}, not {}", begins[lane], begin.s);
                    assert!((f64::from(ends[lane]) / end.s - 1.0).abs() < 1e-3, "{clips:?}: ends at {}, not {}", ends[lane], end.s);
                    assert_eq!(is_cut >> lane & 1 == 1, begin.normal.is_some(), "{clips:?}: {begin:?}");
                    let normal = DVec3::from_array(normals.map(|n| f64::from(n[lane])));
                    assert!((normal - begin.normal.unwrap_or_default()).length() < 1e-2, "{clips:?}: {normal} is not {begin:?}");
                }
            }
        }
        assert!(compared > 500, "only {compared} rays met what is kept");
    }

    #[test]
    fn nothing_is_cut_where_there_is_no_cut() {
        // Fails if an empty region begins rays anywhere else than at the eye.
        let [begin, end, cut] = dispatch!(Level::new(), simd => {
            let lines = lines(simd, &[DVec3::ONE; LANES], &[DVec3::X; LANES]);
            let kept = kept(simd, &Region::default(), &lines);
            [kept.begin[0], kept.end[0], f32::from(u8::from(kept.is_cut.any_true()))]
        });
        assert_eq!([begin, end, cut], [0.0, FAR, 0.0]);
    }
}
