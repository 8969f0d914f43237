//! Rays through all volumes at once, from cell to cell of any of them: what goes on behind the first surface needs all that is there at a
//! depth before what is deeper.
//!
//! The twin of `shaders/march.wgsl`.

use super::cells::CellPass;
use super::cuts::kept;
use super::gradient::Around;
use super::line::{Line, Part};
use super::packets::Pixels;
use super::traveller::{Stretch, Traveller};
use super::volume::{Field, world_line_of};
use crate::frame::Frame;
use crate::lanes::{Floats, Ints, Mask};
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// Goes through all volumes, and lets `integrate` take stretch by stretch, which says which rays need no more.
#[inline(always)]
pub(super) fn march<'a, S: Simd>(
    simd: S,
    travellers: &mut [Traveller<'a, S>],
    mut integrate: impl FnMut(&mut [Traveller<'a, S>], &Stretch<S>) -> Mask<S>,
) {
    let none = Mask::splat(simd, false);
    let mut done = none;
    let mut here = Floats::splat(simd, 0.0);
    loop {
        let mut any = none;
        for traveller in &mut *travellers {
            traveller.go_on(simd, !done);
            any |= traveller.has;
        }
        let of = any & !done;
        if !of.any_true() {
            return;
        }
        let stretch = Stretch::of(simd, travellers, here, of);
        done |= integrate(travellers, &stretch);
        here = of.select(stretch.to, here);
        for t in &mut *travellers {
            t.fresh &= !t.covers(&stretch);
            t.has &= t.cell.s[1].simd_gt(stretch.to);
        }
    }
}

/// The volumes that a block of pixels may see, each where the rays enter it, up to the depths `until`.
#[inline(always)]
pub(super) fn set_out<'a, S: Simd>(
    simd: S,
    frame: &'a Frame,
    pixels: &Pixels<S>,
    [x, y]: [u32; 2],
    lines: &'a [Line<S>],
    until: Floats<S>,
) -> Vec<Traveller<'a, S>> {
    let splat = |v| Floats::splat(simd, v);
    let none = Mask::splat(simd, false);
    let world = world_line_of(simd, frame, pixels);
    let mut travellers = Vec::with_capacity(frame.layers.len());
    for (layer, lines) in frame.layers.iter().zip(lines) {
        let [s_min, s_max] = layer.skip.spans.at(x, y);
        if s_min > s_max {
            continue;
        }
        let field = Field::of(layer);
        let kept = kept(simd, &layer.placement.surface.region, &world);
        let s_max = splat(s_max).min(kept.end).min(until);
        let part = Part { begin: kept.begin, s_min: splat(s_min), s_max };
        let (walk, open) = field.begin(simd, lines, &part, pixels.inside & kept.begin.simd_lt(until));
        let (cell, cubic, above) = (CellPass::nowhere(simd), [splat(0.0); 4], Ints::splat(simd, 0));
        travellers.push(Traveller {
            layer,
            field,
            kept,
            walk,
            s_max,
            open,
            has: none,
            fresh: none,
            cell,
            cubic,
            above,
            around: Around::unknown(simd),
        });
    }
    travellers
}
