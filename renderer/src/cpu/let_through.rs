//! What transparent surfaces let through of the light on its way to others.
//!
//! The twin of `shaders/let_through.wgsl`.

use super::intervals::{Pending, count_levels, next_crossing, paint_at};
use super::line::Part;
use super::ray::View;
use super::to_light::{ToLight, to_light};
use super::volume::Field;
use super::walk::next_cell;
use crate::lanes::{Floats, Ints, Mask};
use crate::roots::bernstein::bernstein;
use fearless_simd::Simd;
use fearless_simd::prelude::*;

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
        let field = Field::of(layer);
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
            above = starts.select(count_levels(simd, &layer.appearance.levels, cubic[0]), above);
            // Behind a gap that the solid leaves nothing is known of the side before.
            above = (walking & cell.at_face).select(Ints::splat(simd, 0), above);
            let mut next = next_crossing(simd, &layer.appearance.levels, &cubic, above, [zero, one], walking, walking);
            while next.there.any_true() {
                let Pending { u, there, rises, at_entry } = next;
                let paint = paint_at(simd, &layer.appearance.paints, rises.select(above, above - up), there);
                share = there.select(share * (1.0 - paint[3]), share);
                above = there.select(rises.select(above + up, above - up), above);
                next = next_crossing(simd, &layer.appearance.levels, &cubic, above, [u, one], there, at_entry);
            }
        }
    }
    share.simd_gt(DARK).select(share, zero)
}
