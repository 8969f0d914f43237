//! What of the light comes to surfaces: none where an opaque one lies between, hard; behind transparent ones what these let through.
//!
//! The twin of `shaders/shadows.wgsl`.

use super::cells::next_cell;
use super::cuts::{Kept, kept};
use super::march::world_lines;
use super::pieces::{count, paint_of};
use super::shells::{Pending, first};
use super::walk::{Lines, Part};
use super::{View, field_of};
use crate::frame::FrameLayer;
use crate::lanes::{Doubles, Floats, Ints, LANES, Mask, Vecs, axes, numbers};
use crate::roots::bernstein::bernstein;
use crate::skip::LightSpans;
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// Lines from what pixels show toward the light, through a layer.
struct ToLight<S: Simd> {
    lines: Lines<S>,
    kept: Kept<S>,
    /// Behind here no surface can be.
    s_max: Floats<S>,
}

/// From what a packet shows at depths `s`, and a little nearer to the light.
#[inline(always)]
fn to_light<S: Simd>(simd: S, view: &View<'_, S>, layer: &FrameLayer, s: Floats<S>, asked: Mask<S>) -> ToLight<S> {
    let (frame, pixels) = (view.frame, view.pixels);
    let splat = |v| Doubles::splat(simd, v);
    let (toward, start_mm) = (frame.toward_light.as_dvec3(), frame.shadow_start_mm);
    let seen = world_lines(simd, frame, pixels).at(s);
    let in_world = Lines { origin: axes!(a => seen[a] + splat(start_mm * toward[a])), direction: axes!(a => splat(toward[a])) };
    let kept = kept(simd, &layer.surface.region, &in_world);
    let to_light = layer.to_light;
    let seen = Lines { origin: pixels.at(simd, &layer.rays.origin), direction: pixels.at(simd, &layer.rays.direction) }.at(s);
    let lines = Lines { origin: axes!(a => seen[a] + splat(start_mm * to_light[a])), direction: axes!(a => splat(to_light[a])) };
    let s_max = until_light(simd, &layer.light_spans, &axes!(a => seen[a].to_floats()), asked).min(kept.end);
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

/// Which of the hits of `asked`, at depths `s`, have bone of any layer between them and the light.
#[inline(always)]
pub(super) fn shadowed<S: Simd>(simd: S, view: &View<'_, S>, s: Floats<S>, asked: Mask<S>) -> Mask<S> {
    let mut dark = Mask::splat(simd, false);
    for layer in &view.frame.layers {
        let ToLight { lines, kept, s_max } = to_light(simd, view, layer, s, asked);
        let asked = asked & !dark & s_max.simd_gt(kept.begin);
        if asked.any_true() {
            let part = Part { begin: kept.begin, s_min: Floats::splat(simd, 0.0), s_max };
            let field = field_of(layer);
            dark |= field.first_hits(simd, Some(view.scene.method()), &lines, &part, asked).found;
        }
    }
    dark
}

/// Less of the light than this is none: half of what a display shows of the darkest colours.
pub(crate) const DARK: f32 = 1.5e-4;

/// The share of the light that comes to the crossings of `asked`, at depths `s`: each surface on the way keeps of it what it keeps of all that
/// lies behind it.
#[inline(always)]
pub(super) fn share_of_light<S: Simd>(simd: S, view: &View<'_, S>, s: Floats<S>, asked: Mask<S>) -> Floats<S> {
    simd.vectorize(
        #[inline(always)]
        || let_through(simd, view, s, asked),
    )
}

#[inline(always)]
fn let_through<S: Simd>(simd: S, view: &View<'_, S>, s: Floats<S>, asked: Mask<S>) -> Floats<S> {
    let (zero, one, up) = (Floats::splat(simd, 0.0), Floats::splat(simd, 1.0), Ints::splat(simd, 1));
    let mut share = one;
    for layer in &view.frame.layers {
        let ToLight { lines, kept, s_max } = to_light(simd, view, layer, s, asked);
        let part = Part { begin: kept.begin, s_min: zero, s_max };
        let field = field_of(layer);
        let (mut walk, mut walking) = field.begin(simd, &lines, &part, asked & s_max.simd_gt(kept.begin));
        let mut above = Ints::splat(simd, 0);
        loop {
            let (arrived, cell) = next_cell(simd, &field, &mut walk, walking & share.simd_gt(DARK));
            walking &= arrived;
            if !walking.any_true() {
                break;
            }
            let cell = cell.until(s_max);
            let cubic = bernstein(&cell.f, &cell.start, &cell.end);
            // What the light is on its way in from the start on it has not come into.
            let starts = cell.is_first & cell.s[0].simd_eq(kept.begin) & !kept.is_cut;
            above = starts.select(count(simd, &layer.levels, cubic[0]), above);
            let mut next = first(simd, &layer.levels, &cubic, above, [zero, one], walking, walking);
            while next.there.any_true() {
                let Pending { u, there, rises, at_entry } = next;
                let paint = paint_of(simd, &layer.paints, rises.select(above, above - up), there);
                share = there.select(share * (1.0 - paint[3]), share);
                above = there.select(rises.select(above + up, above - up), above);
                next = first(simd, &layer.levels, &cubic, above, [u, one], there, at_entry);
            }
        }
    }
    share.simd_gt(DARK).select(share, zero)
}
