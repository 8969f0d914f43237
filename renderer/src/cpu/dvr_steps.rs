//! Direct volume rendering at points that lie evenly apart.
//!
//! The twin of `shaders/dvr_steps.wgsl`.

use super::dvr::{add, gradient_factor};
use super::packets::Pixels;
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
    pub depth: Floats<S>,
    pub first: Floats<S>,
    /// Number of the next.
    pub number: Floats<S>,
}

impl<S: Simd> Steps<S> {
    /// At the first point of each ray: without jitter in the middle of the first step.
    #[inline(always)]
    pub fn begin(simd: S, view: &View<'_, S>) -> Self {
        let depth = view.frame.step_mm / view.mm_per_depth;
        let jitter = view.frame.jitter;
        let start = if jitter < 0.0 { Floats::splat(simd, 0.5) } else { noise(simd, view.pixels, jitter) };
        Self { depth, first: start * depth, number: Floats::splat(simd, 0.0) }
    }
}

/// A number from 0 to 1 for each that looks like chance, `turned` on and round at 1.
#[inline(always)]
fn noise<S: Simd>(simd: S, pixels: &Pixels<S>, turned: f32) -> Floats<S> {
    let (x, y) = (pixels.x.to_floats().to_array(), pixels.y.to_floats().to_array());
    Floats::load_array(simd, std::array::from_fn(|lane| (noise_at(x[lane] as u32, y[lane] as u32) + turned).fract()))
}

/// The factors and the sum of a permuted congruential generator (O'Neill 2014, PCG RXS M XS 32).
pub(crate) const PCG: [u32; 3] = [747_796_405, 2_891_336_453, 277_803_737];

/// A number from 0 to 1 that looks like chance, for each pixel the same in every frame (O'Neill 2014, PCG).
fn noise_at(x: u32, y: u32) -> f32 {
    let state = (y << 16 | x).wrapping_mul(PCG[0]).wrapping_add(PCG[1]);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(PCG[2]);
    // 24 bits, which float32 holds.
    ((word >> 22 ^ word) >> 8) as f32 / 16_777_216.0
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
    let nearest = ((stretch.from - steps.first) / steps.depth).ceil();
    steps.number = stretch.of.select(steps.number.max(nearest), steps.number);
    let mut full = Mask::splat(simd, false);
    loop {
        let s = steps.first + steps.number * steps.depth;
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
            if !t.layer.appearance.gradient_factors.is_empty() {
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
            id = (visible & id.simd_eq(zero)).select(Floats::splat(simd, (t.layer.placement.index + 1) as f32), id);
        }
        let visible = here & weight.simd_gt(zero);
        let opacity = visible.select(1.0 - clear, zero);
        add(all, &axes!(a => visible.select(color[a] * (opacity / weight), zero)), opacity, s, id, visible);
        steps.number = here.select(steps.number + 1.0, steps.number);
        full |= here & all.color[3].simd_ge(ENOUGH);
    }
}

/// Linear colour, and opacity of a step, of values.
#[inline(always)]
fn looked_up<S: Simd>(simd: S, layer: &FrameLayer, v: Floats<S>, of: Mask<S>) -> [Floats<S>; 4] {
    let table = &layer.appearance.steps;
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
