//! Direct volume rendering: light that volumes send and keep, by their transfer functions (Max 1995), in steps, or exactly.
//!
//! The twin of `shaders/dvr_steps.wgsl` and `shaders/dvr_exact.wgsl`.

use super::View;
use super::gauss::{NODES, UNTIL, WEIGHTS};
use super::march::{Stretch, Traveller};
use super::pieces::{count, next, paint_between};
use super::project::world_gradient;
use super::shells::Gathered;
use crate::frame::FrameLayer;
use crate::lanes::{Floats, Ints, LANES, Mask, Vecs, axes, dot, lerp, numbers};
use crate::roots::cubic::value;
use crate::roots::trilinear;
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// From here on steps do not look at what lies behind, and what they have gathered counts as opaque. At 0.95 that alone made a difference of
/// 1/255 on average where steps are short, more than they did (docs/modes.md).
pub(crate) const ENOUGH_IN_STEPS: f32 = 0.99;
/// The same for the exact integral: a tenth of what a display shows.
pub(crate) const ENOUGH_EXACTLY: f32 = 0.9999;
/// A picture's depth and volume are those at which half of the light behind is kept.
pub(crate) const SEEN: f32 = 0.5;

/// Rays in steps.
pub(super) struct Steps<S: Simd> {
    /// Depth between points, and depth of the first.
    pub length: Floats<S>,
    pub first: Floats<S>,
    /// Number of the next.
    pub next: Floats<S>,
}

/// Gathers points that lie evenly apart along a stretch; says which rays need no more.
#[inline(always)]
pub(super) fn gather_steps<S: Simd>(
    simd: S,
    view: &View<'_, S>,
    travellers: &mut [Traveller<'_, S>],
    stretch: &Stretch<S>,
    steps: &mut Steps<S>,
    all: &mut Gathered<S>,
) -> Mask<S> {
    let zero = Floats::splat(simd, 0.0);
    // Those that lie before are in what is empty.
    let number = ((stretch.from - steps.first) / steps.length).ceil();
    steps.next = stretch.of.select(steps.next.max(number), steps.next);
    let mut full = Mask::splat(simd, false);
    loop {
        let s = steps.first + steps.next * steps.length;
        let here = stretch.of & !full & s.simd_lt(stretch.to);
        if !here.any_true() {
            return full;
        }
        let (mut color, mut clear, mut weight) = ([zero; 3], Floats::splat(simd, 1.0), zero);
        let mut id = zero;
        for t in travellers.iter_mut() {
            let of = t.covers(stretch) & here;
            if !of.any_true() {
                continue;
            }
            let u = t.part(s);
            let v = trilinear(&t.cell.f, &lerp(&t.cell.start, &t.cell.end, u));
            let mut paint = looked_up(simd, t.layer, v, of);
            let visible = of & paint[3].simd_gt(zero);
            if !visible.any_true() {
                continue;
            }
            if !t.layer.gradient_factors.is_empty() {
                let factor = gradient_factor(simd, t, u, visible);
                paint[3] = opacity_of(paint[3], factor, visible);
            }
            let normal = t.normal_behind_cut(simd, view, u, s, visible);
            let lit = view.lit(simd, &axes!(a => paint[a]), &normal, Floats::splat(simd, 1.0), s);
            let opacity = visible.select(paint[3], zero);
            // Of several volumes at one place each shows by its share of the opacity.
            color = axes!(a => color[a] + visible.select(lit[a], zero) * opacity);
            clear *= 1.0 - opacity;
            weight += opacity;
            id = (visible & id.simd_eq(zero)).select(Floats::splat(simd, (t.layer.index + 1) as f32), id);
        }
        let visible = here & weight.simd_gt(zero);
        let opacity = visible.select(1.0 - clear, zero);
        add(all, &axes!(a => visible.select(color[a] * (opacity / weight), zero)), opacity, s, id, visible);
        steps.next = here.select(steps.next + 1.0, steps.next);
        full |= here & all.color[3].simd_ge(ENOUGH_IN_STEPS);
    }
}

/// Adds light that is sent here, and the share of that from behind that is kept.
#[inline(always)]
fn add<S: Simd>(all: &mut Gathered<S>, sent: &Vecs<S>, opacity: Floats<S>, s: Floats<S>, id: Floats<S>, of: Mask<S>) {
    let clear = 1.0 - all.color[3];
    let before = all.color[3];
    for a in 0..3 {
        all.color[a] = of.select(all.color[a] + clear * sent[a], all.color[a]);
    }
    all.color[3] = of.select(all.color[3] + clear * opacity, all.color[3]);
    let seen = of & before.simd_lt(SEEN) & all.color[3].simd_ge(SEEN);
    all.s = seen.select(s, all.s);
    all.id = seen.select(id, all.id);
}

/// Linear colour, and opacity of a step, of values.
#[inline(always)]
fn looked_up<S: Simd>(simd: S, layer: &FrameLayer, v: Floats<S>, of: Mask<S>) -> [Floats<S>; 4] {
    let table = &layer.steps;
    let last = table.entries.len() as i32 - 1;
    let number = (v * table.per_unit + 0.5).floor().to_int::<Ints<S>>().max(0).min(last).to_array();
    let mut paint = [[0.0; LANES]; 4];
    for lane in numbers(of) {
        let one = table.entries[number[lane] as usize].to_array();
        (0..4).for_each(|part| paint[part][lane] = one[part]);
    }
    paint.map(
        #[inline(always)]
        |part| Floats::load_array(simd, part),
    )
}

/// The factor of the extinction by the gradient's magnitude.
#[inline(always)]
fn gradient_factor<S: Simd>(simd: S, t: &Traveller<'_, S>, u: Floats<S>, of: Mask<S>) -> Floats<S> {
    let g = world_gradient(t.layer, &t.cell, u);
    let magnitude = dot(&g, &g).sqrt().to_array();
    let mut factor = [0.0; LANES];
    for lane in numbers(of) {
        factor[lane] = factor_at(&t.layer.gradient_factors, magnitude[lane]);
    }
    Floats::load_array(simd, factor)
}

fn factor_at(factors: &[[f32; 2]], magnitude: f32) -> f32 {
    let above = factors.partition_point(|f| f[0] <= magnitude);
    match (above.checked_sub(1), factors.get(above)) {
        (Some(a), Some([to, high])) => {
            let [from, low] = factors[a];
            low + (high - low) * ((magnitude - from) / (to - from))
        }
        (Some(a), None) => factors[a][1],
        (None, _) => factors[0][1],
    }
}

/// What an opaque step lets through here: 0 to the power of 0 is anything on a GPU.
pub(crate) const CLEAREST: f32 = 1e-7;

/// The opacity of a step whose extinction is multiplied.
#[inline(always)]
fn opacity_of<S: Simd>(opacity: Floats<S>, factor: Floats<S>, of: Mask<S>) -> Floats<S> {
    let (opacity, factor, mut result) = (opacity.to_array(), factor.to_array(), [0.0; LANES]);
    numbers(of).for_each(|lane| result[lane] = 1.0 - (1.0 - opacity[lane]).max(CLEAREST).powf(factor[lane]));
    Floats::load_array(of.token(), result)
}

/// Of a depth: what float32 tells apart there, twice over.
pub(crate) const LEAST: f32 = 2.4e-7;
/// A piece is halved until its optical depth is at most this: then four nodes leave an error below 1e-6.
pub(crate) const THIN: f32 = 0.5;

/// Gathers the integral along a stretch; says which rays need no more.
#[inline(always)]
pub(super) fn gather_exactly<S: Simd>(
    simd: S,
    view: &View<'_, S>,
    travellers: &mut [Traveller<'_, S>],
    stretch: &Stretch<S>,
    all: &mut Gathered<S>,
) -> Mask<S> {
    for t in travellers.iter_mut() {
        let of = t.covers(stretch);
        t.above = of.select(count(simd, &t.layer.levels, value(&t.cubic, t.part(stretch.from))), t.above);
    }
    let mut s = stretch.from;
    let mut full = Mask::splat(simd, false);
    loop {
        let here = stretch.of & !full & s.simd_lt(stretch.to);
        if !here.any_true() {
            return full;
        }
        // The piece ends where the first of the volumes comes to the end of one of its own.
        let mut end = stretch.to;
        let mut ends = Vec::with_capacity(travellers.len());
        for t in travellers.iter() {
            let of = t.covers(stretch) & here;
            let ahead = next(simd, &t.cubic, &t.layer.levels, t.part(s), t.part(stretch.to), t.above, of);
            let at = t.cell.s[0] + ahead.u * (t.cell.s[1] - t.cell.s[0]);
            // The end of the stretch is the stretch's, whatever rounding says of the cell's. A piece that rounding makes nothing of is
            // joined to the next; a level that is passed meanwhile is passed at that one's start.
            let at = ahead.passes.select(at, at.max(s + s.abs() * LEAST));
            let at = (ahead.passes | ahead.u.simd_lt(t.part(stretch.to))).select(at, stretch.to).min(stretch.to);
            end = of.select(end.min(at), end);
            ends.push((at, ahead.passes & of, ahead.rises));
        }
        end = end.max(s);
        let whole = end;
        let mut halving = here;
        let (mut sent, mut depth, mut id);
        loop {
            (sent, depth, id) = piece(simd, view, travellers, stretch, [s, end], here);
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
        full |= here & all.color[3].simd_ge(ENOUGH_EXACTLY);
    }
}

/// Light that comes out of the front of pieces, their optical depths, and the volumes that keep most.
#[inline(always)]
fn piece<S: Simd>(
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
            let u = t.part(s);
            let paint = paint_between(simd, &t.layer.levels, &t.layer.paints, t.above, value(&t.cubic, u), of);
            let mut own = of.select(paint[3], zero);
            let visible = of & own.simd_gt(zero);
            if !visible.any_true() {
                continue;
            }
            if !t.layer.gradient_factors.is_empty() {
                own *= gradient_factor(simd, t, u, visible);
            }
            let normal = t.normal_behind_cut(simd, view, u, s, visible);
            let lit = view.lit(simd, &axes!(a => paint[a]), &normal, Floats::splat(simd, 1.0), s);
            light[n] = axes!(a => light[n][a] + visible.select(own * lit[a], zero));
            extinction[n] += own;
            kept += own;
        }
        let more = kept.simd_gt(most);
        id = more.select(Floats::splat(simd, (t.layer.index + 1) as f32), id);
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
