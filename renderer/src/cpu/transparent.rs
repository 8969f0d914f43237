//! Transparent isosurfaces: every crossing of every level of every volume, from front to back.
//!
//! The twin of `shaders/transparent.wgsl`.

use super::brick::FAR;
use super::intervals::{Pending, next_crossing, paint_at};
use super::let_through::share_of_light;
use super::light::known_normal;
use super::ray::{Gathered, View, put_behind};
use super::traveller::{Stretch, Traveller};
use crate::lanes::{Floats, Ints, Mask, axes, dot};
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// From here on what lies behind is not looked at, and what is gathered counts as opaque.
pub(crate) const ENOUGH: f32 = 0.95;

/// Gathers what is crossed along a stretch; says which rays need no more.
#[inline(always)]
pub(super) fn gather<S: Simd>(
    simd: S,
    view: &View<'_, S>,
    travellers: &mut [Traveller<'_, S>],
    stretch: &Stretch<S>,
    all: &mut Gathered<S>,
) -> Mask<S> {
    let none = Mask::splat(simd, false);
    let mut pending: Vec<Pending<S>> = travellers
        .iter()
        .map(
            #[inline(always)]
            |t| {
                let (of, ends) = (t.covers(stretch), [t.share_at(stretch.from), t.share_at(stretch.to)]);
                next_crossing(simd, &t.layer.appearance.levels, &t.cubic, t.above, ends, of, of & t.fresh)
            },
        )
        .collect();
    loop {
        let Some(whose) = compare_next(simd, travellers, &pending) else { return none };
        for (n, (t, p)) in travellers.iter_mut().zip(&mut pending).enumerate() {
            let now = p.there & whose.simd_eq(n as f32);
            if now.any_true() {
                pass_next(simd, view, t, p, stretch.to, now, all);
            }
        }
        let full = all.color[3].simd_ge(ENOUGH);
        if full.any_true() {
            pending.iter_mut().for_each(|p| p.there &= !full);
        }
        if pending.iter().all(|p| !p.there.any_true()) {
            return full & stretch.of;
        }
    }
}

/// Whose crossing is the nearest of each ray, of equal ones the first volume's; none where no volume has any.
#[inline(always)]
fn compare_next<S: Simd>(simd: S, travellers: &[Traveller<'_, S>], pending: &[Pending<S>]) -> Option<Floats<S>> {
    let (mut s, mut whose) = (Floats::splat(simd, FAR), Floats::splat(simd, -1.0));
    let mut any = Mask::splat(simd, false);
    for (n, (t, p)) in travellers.iter().zip(pending).enumerate() {
        let at = t.depth_at(p.u);
        let nearer = p.there & (!any | at.simd_lt(s));
        s = nearer.select(at, s);
        whose = nearer.select(Floats::splat(simd, n as f32), whose);
        any |= p.there;
    }
    any.any_true().then_some(whose)
}

/// Takes what a volume shows where it is crossed next in the lanes of `now`, and finds what follows up to the depths `until`.
#[inline(always)]
fn pass_next<S: Simd>(
    simd: S,
    view: &View<'_, S>,
    t: &mut Traveller<'_, S>,
    p: &mut Pending<S>,
    until: Floats<S>,
    now: Mask<S>,
    all: &mut Gathered<S>,
) {
    let level = p.rises.select(t.above, t.above - 1);
    let paint = paint_at(simd, &t.layer.appearance.paints, level, now);
    let mut base = axes!(a => paint[a]);
    if let Some(inner) = t.layer.appearance.inner {
        base = axes!(a => p.rises.select(base[a], Floats::splat(simd, inner[a])));
    }
    let surface = t.normal_at(simd, view, p.u, now);
    let (closed, closing) = t.closing_normal(simd, now & p.at_entry);
    let normal = axes!(a => closed.select(closing[a], surface[a]));
    let at = t.depth_at(p.u);
    let mut share = Floats::splat(simd, 1.0);
    if view.scene.shadows {
        let normal = known_normal(&normal, &view.direction);
        let toward = axes!(a => Floats::splat(simd, view.frame.toward_light[a]));
        let lit = now & dot(&normal, &toward).simd_gt(0.0);
        if lit.any_true() {
            share = share_of_light(simd, view, at, lit);
        }
    }
    let color = view.lit(simd, &base, &normal, share, at);
    let is_first = now & all.id.simd_eq(0.0) & paint[3].simd_gt(0.0);
    all.s = is_first.select(at, all.s);
    all.id = is_first.select(Floats::splat(simd, (t.layer.placement.index + 1) as f32), all.id);
    put_behind(&mut all.color, &color, paint[3], now);
    let one = Ints::splat(simd, 1);
    t.above = now.select(p.rises.select(t.above + one, t.above - one), t.above);
    let full = all.color[3].simd_ge(ENOUGH);
    let ends = [p.u, t.share_at(until)];
    let following = next_crossing(simd, &t.layer.appearance.levels, &t.cubic, t.above, ends, now & !full, now & p.at_entry);
    p.u = now.select(following.u, p.u);
    p.there = (p.there & !now) | following.there;
    p.rises = (p.rises & !now) | following.rises;
    p.at_entry = (p.at_entry & !now) | following.at_entry;
}
