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
