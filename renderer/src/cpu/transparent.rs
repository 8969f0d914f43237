//! Transparent isosurfaces: every crossing of every level of every volume, from front to back.
//!
//! The twin of `shaders/transparent.wgsl`. There a ray goes from stretch to stretch (`march`), and within one from crossing to crossing; here each
//! volume is taken to its next crossing whatever the others do, so that most of a packet's rays have one to shade when any has.

use super::brick::FAR;
use super::intervals::{Pending, count_levels, next_crossing, paint_at};
use super::let_through::share_of_light;
use super::light::known_normal;
use super::ray::{Gathered, View, put_behind};
use super::traveller::Traveller;
use crate::lanes::{Floats, Ints, Mask, axes, dot};
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// From here on what lies behind is not looked at, and what is gathered counts as opaque.
pub(crate) const ENOUGH: f32 = 0.95;

/// Gathers what is crossed on the whole way.
#[inline(always)]
pub(super) fn gather<S: Simd>(simd: S, view: &View<'_, S>, travellers: &mut [Traveller<'_, S>], all: &mut Gathered<S>) {
    let mut pending = vec![Pending::none(simd); travellers.len()];
    loop {
        let asked = all.color[3].simd_lt(ENOUGH);
        for (t, p) in travellers.iter_mut().zip(&mut pending) {
            seek(simd, t, p, asked);
        }
        let Some(whose) = compare_next(simd, travellers, &pending, asked) else { return };
        for (n, (t, p)) in travellers.iter_mut().zip(&mut pending).enumerate() {
            let now = asked & p.there & whose.simd_eq(n as f32);
            if now.any_true() {
                pass_next(simd, view, t, p, now, all);
            }
        }
    }
}

/// Takes a volume's rays of `asked` that have no crossing ahead on to their next ones.
#[inline(always)]
fn seek<S: Simd>(simd: S, t: &mut Traveller<'_, S>, p: &mut Pending<S>, asked: Mask<S>) {
    let asked = asked & !p.there;
    loop {
        t.has &= !asked | p.there;
        if !(t.open & asked & !p.there).any_true() {
            return;
        }
        t.go_on(simd, asked & !p.there);
        let new = t.fresh;
        if new.any_true() {
            let next = crossing_from(simd, t, Floats::splat(simd, 0.0), may_cross(simd, t, new), new);
            p.take(&next, new);
        }
        t.fresh &= !new;
    }
}

/// Which of some cells have coefficients on both sides of a level, or are entered on another side than the one before was left: in others nothing is
/// crossed.
#[inline(always)]
fn may_cross<S: Simd>(simd: S, t: &Traveller<'_, S>, of: Mask<S>) -> Mask<S> {
    let b = &t.cubic;
    let least = b[0].min(b[1]).min(b[2].min(b[3]));
    let most = b[0].max(b[1]).max(b[2].max(b[3]));
    let levels = &t.layer.appearance.levels;
    let (low, high) = (count_levels(simd, levels, least), count_levels(simd, levels, most));
    of & (low.simd_ne(t.above) | high.simd_ne(t.above))
}

#[inline(always)]
fn crossing_from<S: Simd>(simd: S, t: &Traveller<'_, S>, u: Floats<S>, of: Mask<S>, fresh: Mask<S>) -> Pending<S> {
    next_crossing(simd, &t.layer.appearance.levels, &t.cubic, t.above, [u, Floats::splat(simd, 1.0)], of, fresh)
}

/// Whose crossing is the nearest of each ray of `asked`, of equal ones the first volume's; none where no volume has any.
#[inline(always)]
fn compare_next<S: Simd>(simd: S, travellers: &[Traveller<'_, S>], pending: &[Pending<S>], asked: Mask<S>) -> Option<Floats<S>> {
    let (mut s, mut whose) = (Floats::splat(simd, FAR), Floats::splat(simd, -1.0));
    let mut any = Mask::splat(simd, false);
    for (n, (t, p)) in travellers.iter().zip(pending).enumerate() {
        let at = t.depth_at(p.u);
        let nearer = asked & p.there & (!any | at.simd_lt(s));
        s = nearer.select(at, s);
        whose = nearer.select(Floats::splat(simd, n as f32), whose);
        any |= nearer;
    }
    any.any_true().then_some(whose)
}

/// Takes what a volume shows where it is crossed next in the lanes of `now`, and finds what follows in the same cells.
#[inline(always)]
fn pass_next<S: Simd>(simd: S, view: &View<'_, S>, t: &mut Traveller<'_, S>, p: &mut Pending<S>, now: Mask<S>, all: &mut Gathered<S>) {
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
    let following = crossing_from(simd, t, p.u, now & !full, p.at_entry);
    p.take(&following, now);
}
