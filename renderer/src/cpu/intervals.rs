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
#[derive(Clone, Copy)]
pub(super) struct Pending<S: Simd> {
    /// Of the way through the cell.
    pub u: Floats<S>,
    pub there: Mask<S>,
    pub rises: Mask<S>,
    /// At the entry of the cell.
    pub at_entry: Mask<S>,
}

impl<S: Simd> Pending<S> {
    #[inline(always)]
    pub fn none(simd: S) -> Self {
        let none = Mask::splat(simd, false);
        Self { u: Floats::splat(simd, 0.0), there: none, rises: none, at_entry: none }
    }

    /// Takes over those of `next` in the lanes of `of`.
    #[inline(always)]
    pub fn take(&mut self, next: &Self, of: Mask<S>) {
        self.u = of.select(next.u, self.u);
        self.there = (self.there & !of) | (next.there & of);
        self.rises = (self.rises & !of) | (next.rises & of);
        self.at_entry = (self.at_entry & !of) | (next.at_entry & of);
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::roots::cubic::value as value_of;
    use bregma_synthetic::Random;
    use fearless_simd::{Level, dispatch};

    /// More than the pieces of a cubic with so few levels: two turns, and each level passed three times.
    const ENOUGH: usize = 2 + 3 * 4 + 2;

    fn numbers(r: &mut Random) -> [f32; LANES] {
        std::array::from_fn(|_| (2.0 * r.unit() - 1.0) as f32)
    }

    #[test]
    fn pieces_tile_the_way_and_between_their_ends_no_level_is_passed() {
        // Fails if a piece ends before it begins, is passed over, holds a turn, or the count of levels is not that of its values.
        let mut r = Random(1);
        for _ in 0..300 {
            let (b, mut levels) = (std::array::from_fn(|_| numbers(&mut r)), [0.0; 4].map(|_| (1.6 * r.unit() - 0.8) as f32));
            levels.sort_by(f32::total_cmp);
            let pieces: Vec<([f32; LANES], [i32; LANES])> = dispatch!(Level::new(), simd => {
                let b: [Floats<_>; 4] = b.map(|b| Floats::load_array(simd, b));
                let (one, zero, all) = (Floats::splat(simd, 1.0), Floats::splat(simd, 0.0), Mask::splat(simd, true));
                let (mut u, mut above) = (zero, count_levels(simd, &levels, value_of(&b, zero)));
                let mut pieces = vec![];
                for _ in 0..ENOUGH {
                    let end = next_end(simd, &b, &levels, u, one, above, all);
                    pieces.push((end.u.to_array(), above.to_array()));
                    above = end.passes.select(end.rises.select(above + 1, above - 1), above);
                    u = end.u;
                }
                pieces
            });
            for lane in 0..LANES {
                let b = b.map(|b| f64::from(b[lane]));
                let cubic = |u: f64| {
                    let v = 1.0 - u;
                    b[0] * v * v * v + 3.0 * b[1] * v * v * u + 3.0 * b[2] * v * u * u + b[3] * u * u * u
                };
                let mut u = 0.0;
                for (ends, above) in &pieces {
                    let (end, above) = (f64::from(ends[lane]), above[lane] as usize);
                    assert!(end >= u && end <= 1.0, "{b:?} {levels:?}: from {u} to {end}");
                    let inner: Vec<f64> = (0..=8).map(|n| cubic(u + (end - u) * f64::from(n) / 8.0)).collect();
                    let rises = inner[8] > inner[0];
                    let is_monotonous = inner.windows(2).all(|pair| (pair[1] - pair[0]) * if rises { 1.0 } else { -1.0 } > -1e-6);
                    assert!(is_monotonous, "{b:?} {levels:?}: turns between {u} and {end}");
                    let (low, high) = (above.checked_sub(1).map(|n| levels[n]), levels.get(above));
                    let is_within = |v: f64| low.is_none_or(|l| v > f64::from(l) - 1e-5) && high.is_none_or(|h| v < f64::from(*h) + 1e-5);
                    assert!(inner.iter().all(|v| is_within(*v)), "{b:?} {levels:?}: {inner:?} between {u} and {end} with {above} below");
                    u = end;
                }
                assert_eq!(u, 1.0, "{b:?} {levels:?}: the way ends early");
            }
        }
    }

    #[test]
    fn what_lies_between_two_levels_is_a_mixture_of_theirs() {
        // Fails if a value takes the paint of other levels than those beside it, or something changes before the first or behind the last.
        let mut r = Random(2);
        for _ in 0..300 {
            let mut levels = [0.0; 4].map(|_| (2.0 * r.unit() - 1.0) as f32);
            levels.sort_by(f32::total_cmp);
            let paints = [0.0; 4].map(|_| Vec4::from_array(std::array::from_fn(|_| r.unit() as f32)));
            let values = numbers(&mut r);
            let found = dispatch!(Level::new(), simd => {
                let v = Floats::load_array(simd, values);
                let all = Mask::splat(simd, true);
                paint_between(simd, &levels, &paints, count_levels(simd, &levels, v), v, all).map(|part| part.to_array())
            });
            for (lane, value) in values.into_iter().enumerate() {
                let above = levels.iter().filter(|level| **level <= value).count();
                let (a, b) = (above.saturating_sub(1), above.min(3));
                let w = if a == b { 0.0 } else { (value - levels[a]) / (levels[b] - levels[a]) };
                let found = Vec4::from_array(found.map(|part| part[lane]));
                assert!((found - paints[a].lerp(paints[b], w)).length() < 1e-5, "{value} in {levels:?}: {found}");
            }
        }
    }
}
