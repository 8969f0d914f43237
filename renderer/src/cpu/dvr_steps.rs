//! Direct volume rendering at points that lie evenly apart.
//!
//! The twin of `shaders/dvr_steps.wgsl`.

use super::dvr::{add, gradient_factor};
use super::ray::{Gathered, View};
use super::traveller::{Stretch, Traveller};
use crate::frame::FrameLayer;
use crate::lanes::{Floats, Ints, LANES, Mask, axes, lerp, numbers};
use crate::roots::trilinear;
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// From here on steps do not look at what lies behind, and what they have gathered counts as opaque. At 0.95 that alone made a difference of
/// 1/255 on average where steps are short, more than they did (docs/modes.md).
pub(crate) const ENOUGH: f32 = 0.99;

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
pub(super) fn gather<S: Simd>(
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
            let u = t.share_at(s);
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
        full |= here & all.color[3].simd_ge(ENOUGH);
    }
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

/// What an opaque step lets through here: 0 to the power of 0 is anything on a GPU.
pub(crate) const CLEAREST: f32 = 1e-7;

/// The opacity of a step whose extinction is multiplied.
#[inline(always)]
fn opacity_of<S: Simd>(opacity: Floats<S>, factor: Floats<S>, of: Mask<S>) -> Floats<S> {
    let (opacity, factor, mut result) = (opacity.to_array(), factor.to_array(), [0.0; LANES]);
    numbers(of).for_each(|lane| result[lane] = 1.0 - (1.0 - opacity[lane]).max(CLEAREST).powf(factor[lane]));
    Floats::load_array(of.token(), result)
}
