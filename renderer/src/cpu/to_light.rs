//! Line toward the light.
//!
//! The twin of `shaders/to_light.wgsl`.

use super::cuts::{Kept, kept};
use super::line::Line;
use super::ray::View;
use super::volume::{line_of, world_line_of};
use crate::frame::FrameLayer;
use crate::lanes::{Doubles, Floats, Ints, LANES, Mask, Vecs, axes, numbers};
use crate::skip::LightSpans;
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// Line from what pixels show toward the light, through a layer.
pub(super) struct ToLight<S: Simd> {
    pub lines: Line<S>,
    pub kept: Kept<S>,
    /// Behind here no surface can be.
    pub s_max: Floats<S>,
}

/// From what a packet shows at depths `s`, and a little nearer to the light.
#[inline(always)]
pub(super) fn to_light<S: Simd>(simd: S, view: &View<'_, S>, layer: &FrameLayer, s: Floats<S>, asked: Mask<S>) -> ToLight<S> {
    let (frame, pixels) = (view.frame, view.pixels);
    let splat = |v| Doubles::splat(simd, v);
    let (toward, start_mm) = (frame.toward_light.as_dvec3(), frame.shadow_start_mm);
    let seen = world_line_of(simd, frame, pixels).at(s);
    let in_world = Line { origin: axes!(a => seen[a] + splat(start_mm * toward[a])), direction: axes!(a => splat(toward[a])) };
    let kept = kept(simd, &layer.placement.surface.region, &in_world);
    let to_light = layer.placement.to_light;
    let seen = line_of(simd, layer, pixels).at(s);
    let lines = Line { origin: axes!(a => seen[a] + splat(start_mm * to_light[a])), direction: axes!(a => splat(to_light[a])) };
    let s_max = until_light(simd, &layer.skip.light_spans, &axes!(a => seen[a].to_floats()), asked).min(kept.end);
    ToLight { lines, kept, s_max }
}

/// How far from points in index space toward the light a surface can lie, mm.
#[inline(always)]
fn until_light<S: Simd>(simd: S, spans: &LightSpans, p: &Vecs<S>, of: Mask<S>) -> Floats<S> {
    let m = spans.from_index.as_affine3();
    let seen = axes!(a => p[0] * m.matrix3.x_axis[a] + p[1] * m.matrix3.y_axis[a] + p[2] * m.matrix3.z_axis[a] + m.translation[a]);
    let block = |a: usize| seen[a].floor().max(0.0).min((spans.size[a] - 1) as f32).to_int::<Ints<S>>();
    let number = (block(1) * spans.size[0] as i32 + block(0)).to_array();
    let mut near = [0.0; LANES];
    numbers(of).for_each(|lane| near[lane] = spans.near[number[lane] as usize]);
    seen[2] - Floats::load_array(simd, near)
}
