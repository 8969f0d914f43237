//! Samples as they are: each stands for the box of a voxel's size around it (nearest-neighbour reconstruction), along a ray's way through a cell.
//!
//! ```text
//!   ●───────┊───────●      a cell's corners are samples; its middle planes, where a coordinate is ½, part their boxes:
//!   │       ┊  ╱    │      a ray passes at most three of these, and between two of them it is in one sample's box
//!   ┊┄┄┄┄┄┄┄╱┄┄┄┄┄┄┄┊
//!   │     ╱ ┊       │
//!   ●───────┊───────●
//! ```
//!
//! The twin of `shaders/voxels.wgsl`.

use super::{Entry, inside};
use crate::lanes::{Floats, Mask, Vecs, axes};
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// Where the boxes of neighbouring samples meet.
pub(crate) const MIDDLE: f32 = 0.5;

/// Beyond the end of every segment.
pub(crate) const NEVER: f32 = 2.0;

/// The corner value in whose box a segment is, where `high` says of each axis whether it is on the far side of the middle.
#[inline(always)]
fn corner<S: Simd>(f: &[Floats<S>; 8], high: &[Mask<S>; 3]) -> Floats<S> {
    let along_x: [Floats<S>; 4] = std::array::from_fn(
        #[inline(always)]
        |n| high[0].select(f[2 * n + 1], f[2 * n]),
    );
    let [low, far] = [0, 1].map(
        #[inline(always)]
        |n| high[1].select(along_x[2 * n + 1], along_x[2 * n]),
    );
    high[2].select(far, low)
}

/// The first entries of segments into the boxes of samples that are inside.
#[inline(always)]
pub(crate) fn first_entry<S: Simd>(simd: S, f: &[Floats<S>; 8], p: &Vecs<S>, q: &Vecs<S>, asked: Mask<S>) -> Entry<S> {
    let (zero, never) = (Floats::splat(simd, 0.0), Floats::splat(simd, NEVER));
    let mut found = Mask::splat(simd, false);
    let mut entry = zero;
    // Where each middle plane is passed.
    let passed = axes!(a => {
        let u = (MIDDLE - p[a]) / (q[a] - p[a]);
        (u.simd_ge(0.0) & u.simd_le(1.0)).select(u, never)
    });
    // The side on which the segment begins: that which it comes from where it passes, and else that on which it is.
    let begins_high = axes!(a => (passed[a].simd_lt(never) & q[a].simd_lt(p[a])) | (passed[a].simd_eq(never) & p[a].simd_gt(MIDDLE)));
    let sorted = sort(&passed);
    for u in [zero, sorted[0], sorted[1], sorted[2]] {
        let high = axes!(a => begins_high[a] ^ passed[a].simd_le(u));
        let enters = asked & !found & u.simd_le(1.0) & inside(corner(f, &high));
        entry = enters.select(u, entry);
        found |= enters;
    }
    Entry { found, u: entry }
}

#[inline(always)]
fn sort<S: Simd>(v: &Vecs<S>) -> Vecs<S> {
    let (low, high) = (v[0].min(v[1]), v[0].max(v[1]));
    [low.min(v[2]), low.max(v[2]).min(high), high.max(v[2])]
}

/// The value at a point of a cell.
#[inline(always)]
pub(crate) fn value<S: Simd>(f: &[Floats<S>; 8], p: &Vecs<S>) -> Floats<S> {
    corner(f, &axes!(a => p[a].simd_gt(MIDDLE)))
}

/// The axis across which a hit lies on a box: that whose middle plane is nearest.
#[inline(always)]
pub(crate) fn normal<S: Simd>(simd: S, p: &Vecs<S>) -> Vecs<S> {
    let away = axes!(a => (p[a] - MIDDLE).abs());
    let x = away[0].simd_le(away[1]) & away[0].simd_le(away[2]);
    let y = !x & away[1].simd_le(away[2]);
    let (zero, one) = (Floats::splat(simd, 0.0), Floats::splat(simd, 1.0));
    [x.select(one, zero), y.select(one, zero), (x | y).select(zero, one)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_synthetic::Random;
    use fearless_simd::{Level, dispatch};
    use glam::Vec3;

    #[test]
    fn the_first_sample_inside_whose_box_a_segment_comes_to_is_found() {
        // Fails if a middle plane is passed in the wrong order, a corner is taken for another, or a tie on a middle plane is missed. The truth walks
        // along the segment in steps of a thousandth.
        let mut r = Random(5);
        let mut number = || r.unit() as f32;
        let mut found = 0;
        for n in 0..20_000 {
            let f: [f32; 8] = std::array::from_fn(|_| if number() < 0.2 { 1.0 } else { -1.0 });
            let mut point = || Vec3::from_array(std::array::from_fn(|_| if number() < 0.1 { 0.5 } else { number() }));
            let (p, q) = (point(), point());
            let entry = dispatch!(Level::new(), simd => {
                let (f, p, q) = (f.map(|v| Floats::splat(simd, v)), axes!(a => Floats::splat(simd, p[a])), axes!(a => Floats::splat(simd, q[a])));
                let entry = first_entry(simd, &f, &p, &q, Mask::splat(simd, true));
                entry.found.test(0).then(|| entry.u[0])
            });
            let is_inside = |u: f32| {
                let at = p.lerp(q, u);
                f[(0..3).map(|a| usize::from(at[a] > 0.5) << a).sum::<usize>()] > 0.0
            };
            // Points on a middle plane belong to whichever box the segment is in beside it.
            let is_clear = |u: f32| p.lerp(q, u).to_array().iter().all(|v| (v - 0.5).abs() > 1e-5);
            let walked = (0..=1000).map(|k| k as f32 / 1000.0).find(|u| is_clear(*u) && is_inside(*u));
            let in_plane = (0..3).any(|a| p[a] == 0.5 && q[a] == 0.5);
            let is_right = match (entry, walked) {
                (Some(u), Some(walked)) => u <= walked + 1e-5 && (walked <= u + 2.1e-3 || !is_clear(u + 1e-3)),
                // A corner that is passed within a step, or at the very end, or where a segment lies in a middle plane.
                (Some(u), None) => in_plane || !is_clear(u) || u > 0.998,
                (None, Some(_)) => in_plane,
                (None, None) => true,
            };
            assert!(is_right, "{n}: {entry:?} for {walked:?}: {f:?} {p} {q}");
            found += usize::from(entry.is_some());
        }
        println!("{found} of 20000 segments enter");
        assert!(found > 5000);
    }
}
