//! Transparent isosurfaces: every crossing of every level of every volume, from front to back.
//!
//! The twin of `shaders/shells.wgsl`.

use super::View;
use super::march::{Stretch, Traveller, put_behind};
use super::pieces::{Next, count, next, paint_of};
use super::shade::Drawn;
use super::shadows::share_of_light;
use crate::lanes::{Floats, Ints, Mask, Vecs, axes, dot};
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// From here on what lies behind is not looked at, and what is gathered counts as opaque.
pub(crate) const ENOUGH: f32 = 0.95;

/// What rays have gathered.
pub(super) struct Gathered<S: Simd> {
    /// Premultiplied linear colour and opacity.
    pub color: [Floats<S>; 4],
    /// Depth behind the base plane and 1-based layer of what is drawn first; 0 where nothing is.
    pub s: Floats<S>,
    pub id: Floats<S>,
}

impl<S: Simd> Gathered<S> {
    #[inline(always)]
    pub fn nothing(simd: S) -> Self {
        let zero = Floats::splat(simd, 0.0);
        Self { color: [zero; 4], s: zero, id: zero }
    }

    /// The face of a cut, opaque, behind all that is gathered.
    #[inline(always)]
    pub fn put_face(&mut self, simd: S, color: &Vecs<S>, face: &Drawn<S>) {
        let is_first = face.found & self.id.simd_eq(0.0);
        self.s = is_first.select(face.s, self.s);
        self.id = is_first.select(face.id, self.id);
        put_behind(&mut self.color, color, Floats::splat(simd, 1.0), face.found);
    }

    /// What is opaque enough is opaque.
    #[inline(always)]
    pub fn filled(mut self, enough: f32) -> Self {
        let full = self.color[3].simd_ge(enough);
        let scale = full.select(1.0 / self.color[3], Floats::splat(self.s.token(), 1.0));
        self.color = self.color.map(
            #[inline(always)]
            |c| c * scale,
        );
        self
    }
}

/// A crossing that is the next of its volume.
pub(super) struct Pending<S: Simd> {
    /// Of the way through the cell.
    pub u: Floats<S>,
    pub there: Mask<S>,
    pub rises: Mask<S>,
    /// At the entry of the cell.
    pub at_entry: Mask<S>,
}

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
    let far = Floats::splat(simd, super::walk::FAR);
    let mut pending: Vec<Pending<S>> = travellers
        .iter()
        .map(
            #[inline(always)]
            |t| {
                let (of, ends) = (t.covers(stretch), [t.part(stretch.from), t.part(stretch.to)]);
                first(simd, &t.layer.levels, &t.cubic, t.above, ends, of, of & t.fresh)
            },
        )
        .collect();
    loop {
        // The nearest of each ray; of equal ones the first volume's.
        let (mut s, mut whose) = (far, Floats::splat(simd, -1.0));
        let mut any = none;
        for (n, (t, p)) in travellers.iter().zip(&pending).enumerate() {
            let at = t.depth(p.u);
            let nearer = p.there & (!any | at.simd_lt(s));
            s = nearer.select(at, s);
            whose = nearer.select(Floats::splat(simd, n as f32), whose);
            any |= p.there;
        }
        if !any.any_true() {
            return none;
        }
        for (n, (t, p)) in travellers.iter_mut().zip(&mut pending).enumerate() {
            let now = p.there & whose.simd_eq(n as f32);
            if !now.any_true() {
                continue;
            }
            let level = p.rises.select(t.above, t.above - 1);
            let paint = paint_of(simd, &t.layer.paints, level, now);
            let mut base = axes!(a => paint[a]);
            if let Some(inner) = t.layer.inner {
                base = axes!(a => p.rises.select(base[a], Floats::splat(simd, inner[a])));
            }
            let surface = t.normal(simd, view, p.u, now);
            let (closed, closing) = t.closing(simd, now & p.at_entry);
            let normal = axes!(a => closed.select(closing[a], surface[a]));
            let at = t.depth(p.u);
            let mut share = Floats::splat(simd, 1.0);
            if view.scene.shadows {
                let normal = view.known(simd, &normal);
                let toward = axes!(a => Floats::splat(simd, view.frame.toward_light[a]));
                let lit = now & dot(&normal, &toward).simd_gt(0.0);
                if lit.any_true() {
                    share = share_of_light(simd, view, at, lit);
                }
            }
            let color = view.lit(simd, &base, &normal, share, at);
            let is_first = now & all.id.simd_eq(0.0) & paint[3].simd_gt(0.0);
            all.s = is_first.select(at, all.s);
            all.id = is_first.select(Floats::splat(simd, (t.layer.index + 1) as f32), all.id);
            put_behind(&mut all.color, &color, paint[3], now);
            let one = Ints::splat(simd, 1);
            t.above = now.select(p.rises.select(t.above + one, t.above - one), t.above);
            let full = all.color[3].simd_ge(ENOUGH);
            let ends = [p.u, t.part(stretch.to)];
            let following = first(simd, &t.layer.levels, &t.cubic, t.above, ends, now & !full, now & p.at_entry);
            p.u = now.select(following.u, p.u);
            p.there = (p.there & !now) | following.there;
            p.rises = (p.rises & !now) | following.rises;
            p.at_entry = (p.at_entry & !now) | following.at_entry;
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

/// The first crossing of a cell's cubic from `u` to `end`, in the lanes of `of`, where `above` levels lie at or below the value; some of these
/// are at the entry of their cells.
#[inline(always)]
pub(super) fn first<S: Simd>(
    simd: S,
    levels: &[f32],
    cubic: &[Floats<S>; 4],
    above: Ints<S>,
    [mut u, end]: [Floats<S>; 2],
    of: Mask<S>,
    fresh: Mask<S>,
) -> Pending<S> {
    // Where a cell is entered on the other side of a level than the one before was left: at the box's face, a cut, or by rounding.
    let at_start = count(simd, levels, cubic[0]);
    let (mut there, mut rises) = (of & fresh & at_start.simd_ne(above), of & fresh & at_start.simd_gt(above));
    let at_entry = there;
    let mut sought = of & !there & u.simd_lt(end);
    while sought.any_true() {
        let Next { u: at, passes, rises: up } = next(simd, cubic, levels, u, end, above, sought);
        u = sought.select(at, u);
        there |= passes & sought;
        rises |= up & passes & sought;
        sought &= !passes & u.simd_lt(end);
    }
    Pending { u, there, rises, at_entry }
}
