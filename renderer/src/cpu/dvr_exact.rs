//! Direct volume rendering as the integral along a stretch, interval by interval.
//!
//! The twin of `shaders/dvr_exact.wgsl`.

use super::dvr::{add, gradient_factor};
use super::gauss::{NODES, UNTIL, WEIGHTS};
use super::intervals::{count_levels, next_end, paint_between};
use super::ray::{Gathered, View};
use super::traveller::{Stretch, Traveller};
use crate::lanes::{Floats, LANES, Mask, Vecs, axes, numbers};
use crate::roots::cubic::value;
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// From here on the exact integral does not look at what lies behind, and what it has gathered counts as opaque: a tenth of what a display
/// shows.
pub(crate) const ENOUGH: f32 = 0.9999;

/// Of a depth: what float32 tells apart there, twice over.
pub(crate) const LEAST: f32 = 2.4e-7;

/// An interval is halved until its optical depth is at most this: then four nodes leave an error below 1e-6.
pub(crate) const THIN: f32 = 0.5;

/// Gathers the integral along a stretch; says which rays need no more.
#[inline(always)]
pub(super) fn gather<S: Simd>(
    simd: S,
    view: &View<'_, S>,
    travellers: &mut [Traveller<'_, S>],
    stretch: &Stretch<S>,
    all: &mut Gathered<S>,
) -> Mask<S> {
    for t in travellers.iter_mut() {
        let of = t.covers(stretch);
        t.above = of.select(count_levels(simd, &t.layer.appearance.levels, value(&t.cubic, t.share_at(stretch.from))), t.above);
    }
    let mut s = stretch.from;
    let mut full = Mask::splat(simd, false);
    loop {
        let here = stretch.of & !full & s.simd_lt(stretch.to);
        if !here.any_true() {
            return full;
        }
        // The interval ends where the first of the volumes comes to the end of one of its own.
        let mut end = stretch.to;
        let mut ends = Vec::with_capacity(travellers.len());
        for t in travellers.iter() {
            let of = t.covers(stretch) & here;
            let ahead = next_end(simd, &t.cubic, &t.layer.appearance.levels, t.share_at(s), t.share_at(stretch.to), t.above, of);
            let at = t.cell.s[0] + ahead.u * (t.cell.s[1] - t.cell.s[0]);
            // s < at ≤ stretch.to, unless a level is passed right at s: where rounding leaves an interval no length, the next one's is added, and
            // the level is passed where that one starts. Where no more ends in the cell it is exactly the stretch's end.
            let at = ahead.passes.select(at, at.max(s + s.abs() * LEAST));
            let at = (ahead.passes | ahead.u.simd_lt(t.share_at(stretch.to))).select(at, stretch.to).min(stretch.to);
            end = of.select(end.min(at), end);
            ends.push((at, ahead.passes & of, ahead.rises));
        }
        end = end.max(s);
        let whole = end;
        let mut halving = here;
        let (mut sent, mut depth, mut id);
        loop {
            (sent, depth, id) = interval(simd, view, travellers, stretch, [s, end], here);
            halving &= depth.simd_gt(THIN) & (0.5 * (s + end)).simd_gt(s);
            if !halving.any_true() {
                break;
            }
            end = halving.select(0.5 * (s + end), end);
        }
        let opacity = depth_to_opacity(depth, here);
        add(all, &sent, opacity, end, id, here);
        for (t, (at, passes, rises)) in travellers.iter_mut().zip(ends) {
            let passed = passes & here & at.simd_le(end) & end.simd_eq(whole);
            t.above = passed.select(rises.select(t.above + 1, t.above - 1), t.above);
        }
        s = here.select(end, s);
        full |= here & all.color[3].simd_ge(ENOUGH);
    }
}

/// Light that comes out of the front of intervals, their optical depths, and the volumes that keep most.
#[inline(always)]
fn interval<S: Simd>(
    simd: S,
    view: &View<'_, S>,
    travellers: &mut [Traveller<'_, S>],
    stretch: &Stretch<S>,
    [from, to]: [Floats<S>; 2],
    here: Mask<S>,
) -> (Vecs<S>, Floats<S>, Floats<S>) {
    simd.vectorize(
        #[inline(always)]
        || integrated(simd, view, travellers, stretch, [from, to], here),
    )
}

#[inline(always)]
fn integrated<S: Simd>(
    simd: S,
    view: &View<'_, S>,
    travellers: &mut [Traveller<'_, S>],
    stretch: &Stretch<S>,
    [from, to]: [Floats<S>; 2],
    here: Mask<S>,
) -> (Vecs<S>, Floats<S>, Floats<S>) {
    let zero = Floats::splat(simd, 0.0);
    let length_mm = (to - from) * view.mm_per_depth;
    // For each node the extinction, and the light that is sent.
    let (mut extinction, mut light) = ([zero; 4], [[zero; 3]; 4]);
    let (mut most, mut id) = (zero, zero);
    for t in travellers.iter_mut() {
        let of = t.covers(stretch) & here;
        if !of.any_true() {
            continue;
        }
        let mut kept = zero;
        for n in 0..4 {
            let s = from + (to - from) * NODES[n];
            let u = t.share_at(s);
            let paint = paint_between(simd, &t.layer.appearance.levels, &t.layer.appearance.paints, t.above, value(&t.cubic, u), of);
            let mut own = of.select(paint[3], zero);
            let visible = of & own.simd_gt(zero);
            if !visible.any_true() {
                continue;
            }
            if !t.layer.appearance.gradient_factors.is_empty() {
                own *= gradient_factor(simd, t, u, visible);
            }
            let normal = t.normal_behind_cut(simd, view, u, s, visible);
            let lit = view.lit(simd, &axes!(a => paint[a]), &normal, Floats::splat(simd, 1.0), s);
            light[n] = axes!(a => light[n][a] + visible.select(own * lit[a], zero));
            extinction[n] += own;
            kept += own;
        }
        let more = kept.simd_gt(most);
        id = more.select(Floats::splat(simd, (t.layer.placement.index + 1) as f32), id);
        most = most.max(kept);
    }
    let mut sent = [zero; 3];
    for n in 0..4 {
        let share = (1.0 - depth_to_opacity(weighted(simd, &extinction, &UNTIL[n]) * length_mm, here)) * WEIGHTS[n] * length_mm;
        sent = axes!(a => sent[a] + share * light[n][a]);
    }
    let depth = weighted(simd, &extinction, &WEIGHTS) * length_mm;
    (sent, depth, id)
}

#[inline(always)]
fn weighted<S: Simd>(simd: S, values: &[Floats<S>; 4], weights: &[f32; 4]) -> Floats<S> {
    let mut sum = Floats::splat(simd, 0.0);
    for n in 0..4 {
        sum += values[n] * weights[n];
    }
    sum
}

/// What of the light is kept by an optical depth: 1 − exp(−depth).
#[inline(always)]
fn depth_to_opacity<S: Simd>(depth: Floats<S>, of: Mask<S>) -> Floats<S> {
    let (depth, mut opacity) = (depth.to_array(), [0.0; LANES]);
    numbers(of).for_each(|lane| opacity[lane] = -(-depth[lane]).exp_m1());
    Floats::load_array(of.token(), opacity)
}
