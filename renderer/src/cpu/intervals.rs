//! The interpolant along a ray through a cell, interval by interval: between where it turns, and where it passes one of some ascending levels.
//! How many of these lie at or below the value says which interval it is in; that number is carried along, so that rounding never makes a
//! crossing of none, or none of a crossing.
//!
//! ```text
//!   level 1 ─────────────●──turn───●────────     ● where an interval ends: at a level, or where the cubic turns
//!   level 0 ────●───────────────────────●───
//!   above     0 │   1    │     2    │ 1 │ 0
//! ```
//!
//! The twin of `shaders/intervals.wgsl`.

use crate::lanes::{Floats, Ints, LANES, Mask, numbers};
use crate::roots::cubic::{refine, turning_points, value};
use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::Vec4;

/// The next end of an interval.
#[derive(Clone, Copy)]
pub(super) struct Next<S: Simd> {
    /// Where, in [0, 1] of the way through the cell.
    pub u: Floats<S>,
    /// Whether a level is passed there, and not only a turn or the end of what is asked for.
    pub passes: Mask<S>,
    /// Whether values rise there.
    pub rises: Mask<S>,
}

/// How many of the levels lie at or below values.
#[inline(always)]
pub(super) fn count_levels<S: Simd>(simd: S, levels: &[f32], v: Floats<S>) -> Ints<S> {
    let (zero, one) = (Ints::splat(simd, 0), Ints::splat(simd, 1));
    levels.iter().fold(
        zero,
        #[inline(always)]
        |count, level| count + v.simd_ge(*level).select(one, zero),
    )
}

/// The next end of an interval of cubics with the Bernstein coefficients `b` on the way from u to u_end, where `above` levels lie at or below the
/// value at u.
#[inline(always)]
pub(super) fn next_end<S: Simd>(
    simd: S,
    b: &[Floats<S>; 4],
    levels: &[f32],
    u: Floats<S>,
    u_end: Floats<S>,
    above: Ints<S>,
    of: Mask<S>,
) -> Next<S> {
    simd.vectorize(
        #[inline(always)]
        || end_of_interval(simd, b, levels, u, u_end, above, of),
    )
}

#[inline(always)]
fn end_of_interval<S: Simd>(
    simd: S,
    b: &[Floats<S>; 4],
    levels: &[f32],
    u: Floats<S>,
    u_end: Floats<S>,
    above: Ints<S>,
    of: Mask<S>,
) -> Next<S> {
    let one = Floats::splat(simd, 1.0);
    let [first, second] = turning_points(simd, b);
    let turn = first.simd_gt(u).select(first, second.simd_gt(u).select(second, one));
    let end = turn.min(u_end);
    let there = count_levels(simd, levels, value(b, end));
    let (rises, falls) = (of & there.simd_gt(above), of & there.simd_lt(above));
    let passes = rises | falls;
    if !passes.any_true() {
        return Next { u: end, passes, rises };
    }
    let level = level_at(simd, levels, rises.select(above, above - 1), passes);
    let sign = rises.select(one, -one);
    let g: [Floats<S>; 4] = std::array::from_fn(
        #[inline(always)]
        |n| sign * (b[n] - level),
    );
    let (g_low, g_high) = (value(&g, u), value(&g, end));
    // At the start already, but for rounding.
    let begun = g_low.simd_ge(0.0);
    let root = refine(&g, u, g_low, end, g_high, passes & !begun);
    Next { u: passes.select(begun.select(u, root), end), passes, rises }
}

/// The levels of some numbers.
#[inline(always)]
fn level_at<S: Simd>(simd: S, levels: &[f32], number: Ints<S>, of: Mask<S>) -> Floats<S> {
    let (number, mut level) = (number.to_array(), [0.0; LANES]);
    numbers(of).for_each(|lane| level[lane] = levels[number[lane] as usize]);
    Floats::load_array(simd, level)
}

/// What belongs to some numbers: red, green, blue and opacity or extinction.
#[inline(always)]
pub(super) fn paint_at<S: Simd>(simd: S, paints: &[Vec4], number: Ints<S>, of: Mask<S>) -> [Floats<S>; 4] {
    let (number, mut paint) = (number.to_array(), [[0.0; LANES]; 4]);
    for lane in numbers(of) {
        let one = paints[number[lane] as usize].to_array();
        (0..4).for_each(|part| paint[part][lane] = one[part]);
    }
    paint.map(
        #[inline(always)]
        |part| Floats::load_array(simd, part),
    )
}

/// What lies, at value `v` in the interval of number `above`, between what belongs to the levels on either side of it.
#[inline(always)]
pub(super) fn paint_between<S: Simd>(
    simd: S,
    levels: &[f32],
    paints: &[Vec4],
    above: Ints<S>,
    v: Floats<S>,
    of: Mask<S>,
) -> [Floats<S>; 4] {
    let last = paints.len() as i32 - 1;
    let (low, high) = ((above - 1).max(0), above.min(last));
    let (from, to) = (level_at(simd, levels, low, of), level_at(simd, levels, high, of));
    // Before the first and behind the last level nothing changes.
    let apart = to.simd_gt(from);
    let w = apart.select((v - from) / (to - from), Floats::splat(simd, 0.0)).max(0.0).min(1.0);
    let (a, b) = (paint_at(simd, paints, low, of), paint_at(simd, paints, high, of));
    std::array::from_fn(
        #[inline(always)]
        |part| a[part] + (b[part] - a[part]) * w,
    )
}

/// A crossing that is the next of its volume.
pub(super) struct Pending<S: Simd> {
    /// Of the way through the cell.
    pub u: Floats<S>,
    pub there: Mask<S>,
    pub rises: Mask<S>,
    /// At the entry of the cell.
    pub at_entry: Mask<S>,
}

/// The first crossing of a cell's cubic from `u` to `end`, in the lanes of `of`, where `above` levels lie at or below the value; some of these
/// are at the entry of their cells.
#[inline(always)]
pub(super) fn next_crossing<S: Simd>(
    simd: S,
    levels: &[f32],
    cubic: &[Floats<S>; 4],
    above: Ints<S>,
    [mut u, end]: [Floats<S>; 2],
    of: Mask<S>,
    fresh: Mask<S>,
) -> Pending<S> {
    // Where a cell is entered on the other side of a level than the one before was left: at the box's face, a cut, or by rounding.
    let at_start = count_levels(simd, levels, cubic[0]);
    let (mut there, mut rises) = (of & fresh & at_start.simd_ne(above), of & fresh & at_start.simd_gt(above));
    let at_entry = there;
    let mut sought = of & !there & u.simd_lt(end);
    while sought.any_true() {
        let Next { u: at, passes, rises: up } = next_end(simd, cubic, levels, u, end, above, sought);
        u = sought.select(at, u);
        there |= passes & sought;
        rises |= up & passes & sought;
        sought &= !passes & u.simd_lt(end);
    }
    Pending { u, there, rises, at_entry }
}
