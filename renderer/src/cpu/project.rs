//! Maximum, minimum, mean and integral of the interpolant along rays, or of its gradient's magnitude: cell by cell, and exact for the values.
//!
//! The twin of `shaders/project.wgsl`, which takes all values from cell to cell: here, where a packet waits for the slowest of its rays, means and
//! integrals of all values have a walk of their own (`integral`), and extremes of all values look into bricks one after the other.

use super::brick::FAR;
use super::cells::{CellPass, cross_cell};
use super::gauss::{NODES, WEIGHTS};
use super::gradient::world_gradient;
use super::intervals::{count_levels, next_end};
use super::line::{Line, Part};
use super::volume::Field;
use super::walk::next_cell;
use crate::frame::FrameLayer;
use crate::lanes::{Doubles, Floats, Ints, LANES, Mask, dot, numbers};
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

/// What is sought along rays.
#[derive(Clone, Copy)]
pub(super) struct Sought {
    pub of: RayValue,
    /// Of the gradient's magnitude and not of the value.
    pub by_gradient: bool,
    /// Only of what has values between the two levels.
    pub in_range: bool,
}

impl Sought {
    /// Whether it is the sum of all values.
    pub fn is_sum(self) -> bool {
        self.of.extreme().is_none() && !self.by_gradient && !self.in_range
    }
}

/// A packet's way through a volume.
pub(super) struct Way<S: Simd> {
    pub lines: Line<S>,
    /// Of the lines, what is asked for, and of which.
    pub part: Part<S>,
    pub asked: Mask<S>,
}

/// What the rays of some packets gather that lie together.
#[inline(always)]
pub(super) fn project<S: Simd>(simd: S, sought: Sought, layer: &FrameLayer, field: &Field<'_>, packets: &[Way<S>]) -> Vec<Projected<S>> {
    // No iterators: what these call is not compiled for the machine's vector instructions.
    let mut all = Vec::with_capacity(packets.len());
    for way in packets {
        all.push(match sought.of.extreme() {
            Some(side) if !sought.by_gradient && !sought.in_range && field.solid.is_none() => extreme(simd, side, layer, field, way),
            _ => of_cells(simd, sought, layer, field, way),
        });
    }
    all
}

/// Cell by cell.
#[inline(always)]
fn of_cells<S: Simd>(
    simd: S,
    Sought { of: sought, by_gradient, in_range }: Sought,
    layer: &FrameLayer,
    field: &Field<'_>,
    Way { lines, part, asked }: &Way<S>,
) -> Projected<S> {
    let zero = Floats::splat(simd, 0.0);
    let mut all = Projected { found: Mask::splat(simd, false), value: zero, depth: zero };
    let (mut walk, mut walking) = field.begin(simd, lines, part, *asked);
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
        let cell = if !in_range {
            let whole = [zero, Floats::splat(simd, 1.0)];
            let known = all.found.select(all.value, Floats::splat(simd, -FAR));
            let of = if by_gradient { of_gradient(sought, layer, &pass, whole) } else { of_values(simd, sought, &pass, known, walking) };
            Projected { found: walking, value: of, depth: whole[1] }
        } else {
            within_range(simd, (sought, by_gradient), layer, &pass, walking)
        };
        if sought.extreme().is_some() {
            let is_larger = cell.found & (!all.found | cell.value.simd_gt(all.value));
            all.value = is_larger.select(cell.value, all.value);
        } else {
            value = value + Doubles::of(cell.found.select(cell.value * length, zero));
            depth = depth + Doubles::of(cell.found.select(cell.depth * length, zero));
        }
        all.found |= cell.found;
    }
    match sought.extreme() {
        Some(side) => all.value *= side,
        None => (all.value, all.depth) = (value.to_floats(), depth.to_floats()),
    }
    all
}

/// The largest value, times its side: of bricks that have a larger one than what is known, all cells.
#[inline(always)]
fn extreme<S: Simd>(simd: S, side: f32, layer: &FrameLayer, field: &Field<'_>, Way { lines, part, asked }: &Way<S>) -> Projected<S> {
    let sought = if side > 0.0 { RayValue::Max } else { RayValue::Min };
    let (mut found, mut known) = (Mask::splat(simd, false), Floats::splat(simd, -FAR));
    let (mut walk, mut walking) = field.begin(simd, lines, part, *asked);
    while walking.any_true() {
        walking = field.arrive(
            simd,
            &mut walk,
            walking,
            #[inline(always)]
            |rays, of| of & may_exceed(simd, layer, field, (rays.number, side), known, of),
            #[inline(always)]
            |_, within| within,
        );
        let mut within = walking & walk.place.t.simd_lt(walk.at.t_end);
        found |= within;
        while within.any_true() {
            let pass = cross_cell(simd, field, &walk.rays.pace, &walk.at, &mut walk.place, within).until(part.s_max);
            let of = of_values(simd, sought, &pass, known, within);
            known = (within & of.simd_gt(known)).select(of, known);
            within &= walk.place.t.simd_lt(walk.at.t_end);
        }
        walk.at.rays &= !walking;
        walking &= field.leave(&mut walk.rays, walking);
    }
    Projected { found, value: known * side, depth: Floats::splat(simd, 0.0) }
}

/// Which of the bricks of the rays of `of`, by their numbers, have a sample whose value, times a side, is larger than what is known: all that lies
/// between samples is less.
#[inline(always)]
fn may_exceed<S: Simd>(
    simd: S,
    layer: &FrameLayer,
    field: &Field<'_>,
    (brick, side): (Ints<S>, f32),
    known: Floats<S>,
    of: Mask<S>,
) -> Mask<S> {
    let ranges = layer.placement.surface.volume.bricks().ranges();
    let end = usize::from(side * field.sign > 0.0);
    let (brick, mut most) = (brick.to_array(), [0.0; LANES]);
    for lane in numbers(of) {
        most[lane] = ranges[brick[lane] as usize][end];
    }
    (side * (field.sign * (Floats::load_array(simd, most) - field.level))).simd_gt(known)
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

/// What of the cells has values in the range, interval by interval: the extreme, times its side, or the mean times the part of the way that it
/// is of, which stands as the depth.
#[inline(always)]
fn within_range<S: Simd>(
    simd: S,
    (sought, by_gradient): (RayValue, bool),
    layer: &FrameLayer,
    pass: &CellPass<S>,
    of: Mask<S>,
) -> Projected<S> {
    let (zero, one) = (Floats::splat(simd, 0.0), Floats::splat(simd, 1.0));
    let levels = &layer.appearance.levels;
    let b = bernstein(&pass.f, &pass.start, &pass.end);
    let mut all = Projected { found: Mask::splat(simd, false), value: zero, depth: zero };
    let (mut u, mut above, mut left) = (zero, count_levels(simd, levels, b[0]), of);
    let mut from = b[0];
    while left.any_true() {
        let end = next_end(simd, &b, levels, u, one, above, left);
        let (there, width) = (left & above.simd_eq(1), end.u - u);
        // Where an end of the range is passed the value is that end, whatever the root is off by: of two volumes that go beyond it neither is
        // ahead.
        let is_low = end.rises.select(above, above - 1).simd_eq(0);
        let passed = is_low.select(Floats::splat(simd, levels[0]), Floats::splat(simd, levels[1]));
        let to = end.passes.select(passed, value(&b, end.u));
        let here = match sought.extreme() {
            _ if by_gradient => of_gradient(sought, layer, pass, [u, width]),
            Some(side) => (from * side).max(to * side),
            // Of a cubic two points are enough (Gauss and Legendre).
            None => (value(&b, u + width * (0.5 - TWO_POINTS)) + value(&b, u + width * (0.5 + TWO_POINTS))) * 0.5,
        };
        if sought.extreme().is_some() {
            all.value = (there & (!all.found | here.simd_gt(all.value))).select(here, all.value);
        } else {
            all.value += there.select(here * width, zero);
            all.depth += there.select(width, zero);
        }
        all.found |= there;
        let step = end.rises.select(Ints::splat(simd, 1), Ints::splat(simd, -1));
        above = (left & end.passes).select(above + step, above);
        (u, from) = (left.select(end.u, u), left.select(to, from));
        left &= u.simd_lt(one);
    }
    all
}

/// How far the points of Gauss and Legendre's quadrature with two lie from the middle of [0, 1]: 1/√12.
pub(crate) const TWO_POINTS: f32 = 0.288_675_13;

/// Intervals of a cell whose ends are looked at for the largest gradient; between three the parabola through them is followed.
pub(crate) const INTERVALS: usize = 8;

/// The extreme, times its side, or the mean of the gradient's magnitude in a part of the ways through the cells, given by where it begins and how
/// wide it is; in sample units per mm.
#[inline(always)]
fn of_gradient<S: Simd>(sought: RayValue, layer: &FrameLayer, pass: &CellPass<S>, [u, width]: [Floats<S>; 2]) -> Floats<S> {
    let simd = pass.f[0].token();
    let splat = |v: f32| Floats::splat(simd, v);
    let Some(side) = sought.extreme() else {
        let mut mean = splat(0.0);
        for n in 0..4 {
            mean += magnitude(layer, pass, u + width * NODES[n]) * WEIGHTS[n];
        }
        return mean;
    };
    let step = 1.0 / INTERVALS as f32;
    let (mut before, mut here) = (magnitude(layer, pass, u) * side, magnitude(layer, pass, u + width * step) * side);
    let mut largest = before.max(here);
    for n in 1..INTERVALS {
        let after = magnitude(layer, pass, u + width * ((n + 1) as f32 * step)) * side;
        // Where the parabola through the three has its top.
        let bend = before - 2.0 * here + after;
        let top = bend.simd_lt(0.0).select(0.5 * (before - after) / bend, splat(0.0)).max(-1.0).min(1.0);
        largest = largest.max(after).max(magnitude(layer, pass, u + width * ((top + n as f32) * step)) * side);
        (before, here) = (here, after);
    }
    largest
}

#[inline(always)]
fn magnitude<S: Simd>(layer: &FrameLayer, pass: &CellPass<S>, u: Floats<S>) -> Floats<S> {
    let g = world_gradient(layer, pass, u);
    dot(&g, &g).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
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

    fn pass<S: Simd>(simd: S, (f, from, to): &Cell) -> CellPass<S> {
        let splat = |v: f32| Floats::splat(simd, v);
        CellPass { f: f.map(splat), start: from.map(splat), end: to.map(splat), ..CellPass::nowhere(simd) }
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
                let (pass, all) = (pass(simd, &cell), Mask::splat(simd, true));
                let of = |sought, known| of_values(simd, sought, &pass, Floats::splat(simd, known), all)[LANES - 1];
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
}
