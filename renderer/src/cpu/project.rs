//! Maximum, minimum, mean and integral of the interpolant along rays, or of its gradient's magnitude: cell by cell, and exact for the values.
//!
//! The twin of `shaders/project.wgsl`.

use super::cells::CellPass;
use super::gauss::{NODES, WEIGHTS};
use super::gradient::world_gradient;
use super::line::{Line, Part};
use super::volume::Field;
use super::walk::next_cell;
use crate::frame::FrameLayer;
use crate::lanes::{Doubles, Floats, Mask, dot};
use crate::modes::RayValue;
use crate::roots::bernstein::bernstein;
use crate::roots::cubic::{turning_points, value};
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// What a ray gathers of one volume, relative to the level and in sample units, or in these per mm.
#[derive(Clone, Copy)]
pub(super) struct Projected<S: Simd> {
    /// Which rays have met the volume.
    pub found: Mask<S>,
    /// The extreme value, or the integral over depth.
    pub value: Floats<S>,
    /// Depth over which it was integrated, mm.
    pub depth: Floats<S>,
}

#[inline(always)]
pub(super) fn project<S: Simd>(
    simd: S,
    (sought, by_gradient): (RayValue, bool),
    layer: &FrameLayer,
    field: &Field<'_>,
    lines: &Line<S>,
    part: &Part<S>,
    asked: Mask<S>,
) -> Projected<S> {
    let zero = Floats::splat(simd, 0.0);
    let mut all = Projected { found: Mask::splat(simd, false), value: zero, depth: zero };
    let (mut walk, mut walking) = field.begin(simd, lines, part, asked);
    // Sums of thousands of cells.
    let (mut value, mut depth) = (Doubles::splat(simd, 0.0), Doubles::splat(simd, 0.0));
    while walking.any_true() {
        let (arrived, pass) = next_cell(simd, field, &mut walk, walking);
        walking = arrived;
        if !walking.any_true() {
            break;
        }
        let pass = pass.until(part.s_max);
        let length = pass.s[1] - pass.s[0];
        let of = if by_gradient { of_gradient(sought, layer, &pass) } else { of_values(simd, sought, &pass, all.value, walking) };
        if sought.extreme().is_some() {
            let is_larger = walking & (!all.found | of.simd_gt(all.value));
            all.value = is_larger.select(of, all.value);
        } else {
            value = value + Doubles::of(walking.select(of * length, zero));
            depth = depth + Doubles::of(walking.select(length, zero));
        }
        all.found |= walking;
    }
    match sought.extreme() {
        Some(side) => all.value = all.value * side,
        None => (all.value, all.depth) = (value.to_floats(), depth.to_floats()),
    }
    all
}

/// The extreme, times its side, or the mean of the values in the cells; an extreme that is not above `known` may be any that is not.
#[inline(always)]
fn of_values<S: Simd>(simd: S, sought: RayValue, pass: &CellPass<S>, known: Floats<S>, of: Mask<S>) -> Floats<S> {
    let b = bernstein(&pass.f, &pass.start, &pass.end);
    let Some(side) = sought.extreme() else { return (b[0] + b[1] + b[2] + b[3]) * 0.25 };
    let b = b.map(
        #[inline(always)]
        |c| c * side,
    );
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

/// The extreme, times its side, or the mean of the gradient's magnitude in the cells, in sample units per mm.
#[inline(always)]
fn of_gradient<S: Simd>(sought: RayValue, layer: &FrameLayer, pass: &CellPass<S>) -> Floats<S> {
    let simd = pass.f[0].token();
    let splat = |v: f32| Floats::splat(simd, v);
    let Some(side) = sought.extreme() else {
        let mut mean = splat(0.0);
        for n in 0..4 {
            mean += magnitude(layer, pass, splat(NODES[n])) * WEIGHTS[n];
        }
        return mean;
    };
    let step = 1.0 / INTERVALS as f32;
    let (mut before, mut here) = (magnitude(layer, pass, splat(0.0)) * side, magnitude(layer, pass, splat(step)) * side);
    let mut largest = before.max(here);
    for n in 1..INTERVALS {
        let after = magnitude(layer, pass, splat((n + 1) as f32 * step)) * side;
        // Where the parabola through the three has its top.
        let bend = before - 2.0 * here + after;
        let top = bend.simd_lt(0.0).select(0.5 * (before - after) / bend, splat(0.0)).max(-1.0).min(1.0);
        largest = largest.max(after).max(magnitude(layer, pass, (top + n as f32) * step) * side);
        (before, here) = (here, after);
    }
    largest
}

#[inline(always)]
fn magnitude<S: Simd>(layer: &FrameLayer, pass: &CellPass<S>, u: Floats<S>) -> Floats<S> {
    let g = world_gradient(layer, pass, u);
    dot(&g, &g).sqrt()
}
