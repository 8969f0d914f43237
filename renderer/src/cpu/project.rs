//! Maximum, mean and integral of the interpolant along rays, or of its gradient's magnitude: cell by cell, and exact for the values.
//!
//! The twin of `shaders/project.wgsl`.

use super::cells::{self, Crossing};
use super::gauss::{NODES, WEIGHTS};
use super::walk::{Field, Lines, Part};
use crate::frame::FrameLayer;
use crate::lanes::{Doubles, Floats, Mask, Vecs, axes, dot, lerp, mix};
use crate::modes::RayValue;
use crate::roots::bernstein::bernstein;
use crate::roots::cubic::{turning_points, value};
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// What a ray gathers of one volume, relative to the level and in sample units, or in these per mm.
#[derive(Clone, Copy)]
pub(super) struct Gathered<S: Simd> {
    /// Which rays have met the volume.
    pub found: Mask<S>,
    /// The largest value, or the integral over depth.
    pub value: Floats<S>,
    /// Depth over which it was integrated, mm.
    pub depth: Floats<S>,
}

#[inline(always)]
pub(super) fn project<S: Simd>(
    simd: S,
    (sought, of_gradient): (RayValue, bool),
    layer: &FrameLayer,
    field: &Field<'_>,
    lines: &Lines<S>,
    part: &Part<S>,
    asked: Mask<S>,
) -> Gathered<S> {
    let zero = Floats::splat(simd, 0.0);
    let mut all = Gathered { found: Mask::splat(simd, false), value: zero, depth: zero };
    let (mut walk, mut walking) = field.begin(simd, lines, part, asked);
    // Sums of thousands of cells.
    let (mut value, mut depth) = (Doubles::splat(simd, 0.0), Doubles::splat(simd, 0.0));
    while walking.any_true() {
        let (arrived, crossing) = cells::next_cell(simd, field, &mut walk, walking);
        walking = arrived;
        if !walking.any_true() {
            break;
        }
        let crossing = crossing.until(part.s_max);
        let length = crossing.s[1] - crossing.s[0];
        let of = if of_gradient { of_gradients(sought, layer, &crossing) } else { of_values(simd, sought, &crossing, all.value, walking) };
        if sought == RayValue::Max {
            let is_larger = walking & (!all.found | of.simd_gt(all.value));
            all.value = is_larger.select(of, all.value);
        } else {
            value = value + Doubles::of(walking.select(of * length, zero));
            depth = depth + Doubles::of(walking.select(length, zero));
        }
        all.found |= walking;
    }
    if sought != RayValue::Max {
        (all.value, all.depth) = (value.to_floats(), depth.to_floats());
    }
    all
}

/// The largest or the mean of the values in the cells; a largest that is not above `known` may be any that is not.
#[inline(always)]
fn of_values<S: Simd>(simd: S, sought: RayValue, crossing: &Crossing<S>, known: Floats<S>, of: Mask<S>) -> Floats<S> {
    let b = bernstein(&crossing.f, &crossing.start, &crossing.end);
    if sought != RayValue::Max {
        return (b[0] + b[1] + b[2] + b[3]) * 0.25;
    }
    let ends = b[0].max(b[3]);
    // The curve stays below its coefficients.
    if !(of & b[1].max(b[2]).simd_gt(ends.max(known))).any_true() {
        return ends;
    }
    let [first, second] = turning_points(simd, &b);
    ends.max(value(&b, first)).max(value(&b, second))
}

/// Intervals of a cell whose ends are looked at for the largest gradient; between three the parabola through them is followed.
pub(crate) const INTERVALS: usize = 8;

/// The largest or the mean of the gradient's magnitude in the cells, in sample units per mm.
#[inline(always)]
fn of_gradients<S: Simd>(sought: RayValue, layer: &FrameLayer, crossing: &Crossing<S>) -> Floats<S> {
    let simd = crossing.f[0].token();
    let splat = |v: f32| Floats::splat(simd, v);
    if sought != RayValue::Max {
        let mut mean = splat(0.0);
        for n in 0..4 {
            mean += magnitude(layer, crossing, splat(NODES[n])) * WEIGHTS[n];
        }
        return mean;
    }
    let step = 1.0 / INTERVALS as f32;
    let (mut before, mut here) = (magnitude(layer, crossing, splat(0.0)), magnitude(layer, crossing, splat(step)));
    let mut largest = before.max(here);
    for n in 1..INTERVALS {
        let after = magnitude(layer, crossing, splat((n + 1) as f32 * step));
        // Where the parabola through the three has its top.
        let bend = before - 2.0 * here + after;
        let top = bend.simd_lt(0.0).select(0.5 * (before - after) / bend, splat(0.0)).max(-1.0).min(1.0);
        largest = largest.max(after).max(magnitude(layer, crossing, (top + n as f32) * step));
        (before, here) = (here, after);
    }
    largest
}

#[inline(always)]
fn magnitude<S: Simd>(layer: &FrameLayer, crossing: &Crossing<S>, u: Floats<S>) -> Floats<S> {
    let g = world_gradient(layer, crossing, u);
    dot(&g, &g).sqrt()
}

/// The interpolant's gradient at u of the way through cells, in the world, in sample units per mm.
#[inline(always)]
pub(super) fn world_gradient<S: Simd>(layer: &FrameLayer, crossing: &Crossing<S>, u: Floats<S>) -> Vecs<S> {
    let g = gradient(&crossing.f, &lerp(&crossing.start, &crossing.end, u));
    let m = layer.gradient_to_world.to_cols_array_2d();
    axes!(a => g[0] * m[0][a] + g[1] * m[1][a] + g[2] * m[2][a])
}

/// The gradient of the trilinear interpolant of corner values, in index space.
#[inline(always)]
pub(super) fn gradient<S: Simd>(f: &[Floats<S>; 8], p: &Vecs<S>) -> Vecs<S> {
    let [x, y, z] = *p;
    [
        mix(mix(f[1] - f[0], f[3] - f[2], y), mix(f[5] - f[4], f[7] - f[6], y), z),
        mix(mix(f[2] - f[0], f[3] - f[1], x), mix(f[6] - f[4], f[7] - f[5], x), z),
        mix(mix(f[4] - f[0], f[5] - f[1], x), mix(f[6] - f[2], f[7] - f[3], x), y),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::LANES;
    use crate::roots::tests::trilinear_f64;
    use bregma_synthetic::Random;
    use fearless_simd::{Level, dispatch};
    use glam::DVec3;

    /// Corners of a cell, and where rays enter and leave it.
    type Cell = ([f32; 8], [f32; 3], [f32; 3]);

    fn cell(r: &mut Random) -> Cell {
        let mut place = || std::array::from_fn(|_| r.unit() as f32);
        let (from, to) = (place(), place());
        (std::array::from_fn(|_| (2.0 * r.unit() - 1.0) as f32), from, to)
    }

    fn crossing<S: Simd>(simd: S, (f, from, to): &Cell) -> Crossing<S> {
        let splat = |v: f32| Floats::splat(simd, v);
        Crossing { f: f.map(splat), start: from.map(splat), end: to.map(splat), ..Crossing::nowhere(simd) }
    }

    fn point(p: [f32; 3]) -> DVec3 {
        DVec3::from_array(p.map(f64::from))
    }

    #[test]
    fn the_largest_is_reached_by_no_value_on_the_way_and_the_mean_is_their_integral() {
        // Fails if a turn within the cell is missed, a largest is none of the values, or the mean is not that of the cubic.
        let mut r = Random(1);
        for _ in 0..2000 {
            let cell = cell(&mut r);
            let known = (4.0 * r.unit() - 2.0) as f32;
            let [largest, beside, mean] = dispatch!(Level::new(), simd => {
                let (crossing, all) = (crossing(simd, &cell), Mask::splat(simd, true));
                let of = |sought, known| of_values(simd, sought, &crossing, Floats::splat(simd, known), all)[LANES - 1];
                [of(RayValue::Max, -1e30), of(RayValue::Max, known), of(RayValue::Mean, 0.0)]
            });
            let at = |u: f64| trilinear_f64(&cell.0, point(cell.1).lerp(point(cell.2), u));
            let sampled = (0..=200).map(|n| at(f64::from(n) / 200.0)).fold(f64::NEG_INFINITY, f64::max);
            let largest = f64::from(largest);
            // Between two samples the curve rises by less than its second derivative allows.
            assert!(largest > sampled - 1e-6 && largest < sampled + 1e-3, "{cell:?}: {largest}, sampled {sampled}");
            // Above what is known it is found all the same.
            assert!((f64::from(beside) - largest).abs() < 1e-6 || largest <= f64::from(known) + 1e-6, "{cell:?} above {known}: {beside}");
            // Simpson's rule is exact for cubics.
            let integral = (at(0.0) + 4.0 * at(0.5) + at(1.0)) / 6.0;
            assert!((f64::from(mean) - integral).abs() < 1e-6, "{cell:?}: {mean} is not {integral}");
        }
    }

    #[test]
    fn a_gradient_is_what_the_interpolant_changes_by() {
        // Fails if a corner stands at another's place, or an axis is interpolated along itself.
        let mut r = Random(2);
        for _ in 0..500 {
            let (f, p, _) = cell(&mut r);
            let found = dispatch!(Level::new(), simd => {
                let splat = |v: f32| Floats::splat(simd, v);
                gradient(&f.map(splat), &p.map(splat)).map(|g| g[0])
            });
            for (axis, found) in DVec3::AXES.into_iter().zip(found) {
                // Along an axis the interpolant is linear.
                let change = trilinear_f64(&f, point(p) + 0.5 * axis) - trilinear_f64(&f, point(p) - 0.5 * axis);
                assert!((f64::from(found) - change).abs() < 1e-5, "{f:?} at {p:?}: {found} is not {change}");
            }
        }
    }
}
