//! Rays through all volumes at once, from cell to cell of any of them: what goes on behind the first surface needs all that is there at a
//! depth before what is deeper.
//!
//! The twin of `shaders/march.wgsl`.

use super::cells::{self, Crossing};
use super::cuts::{Kept, kept};
use super::fetch::Around;
use super::walk::{Field, Lines, Part, Walk};
use super::{Pixels, View, field_of};
use crate::frame::{Frame, FrameLayer};
use crate::lanes::{Floats, Ints, Mask, Vecs, axes, lerp};
use crate::roots::bernstein::bernstein;
use crate::scene::{Normals, Scene};
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// One volume on the way of a packet.
pub(super) struct Traveller<'a, S: Simd> {
    pub layer: &'a FrameLayer,
    pub field: Field<'a>,
    pub kept: Kept<S>,
    walk: Walk<'a, S>,
    s_max: Floats<S>,
    /// Which rays are on their way, and which of them are in a cell.
    open: Mask<S>,
    pub has: Mask<S>,
    /// Which have just come to it.
    pub fresh: Mask<S>,
    /// The cell, and the interpolant on the way through it.
    pub cell: Crossing<S>,
    /// Where the layer needs it.
    pub cubic: [Floats<S>; 4],
    /// How many of the layer's levels lie at or below the value here: what is kept from cell to cell, so that no crossing falls between.
    pub above: Ints<S>,
    /// What lies around the cell.
    around: Around<S>,
}

/// Depths between which the cells stay the same.
pub(super) struct Stretch<S: Simd> {
    pub from: Floats<S>,
    pub to: Floats<S>,
    /// Which rays are still on their way.
    pub of: Mask<S>,
}

/// The lines of a packet through a layer.
#[inline(always)]
pub(super) fn lines_of<S: Simd>(simd: S, layer: &FrameLayer, pixels: &Pixels<S>) -> Lines<S> {
    Lines { origin: pixels.at(simd, &layer.rays.origin), direction: pixels.at(simd, &layer.rays.direction) }
}

/// The lines of a packet in the world.
#[inline(always)]
pub(super) fn world_lines<S: Simd>(simd: S, frame: &Frame, pixels: &Pixels<S>) -> Lines<S> {
    Lines { origin: pixels.at(simd, &frame.based_rays.origin), direction: pixels.at(simd, &frame.based_rays.direction) }
}

/// Goes through all volumes up to the depths `until`, and lets `integrate` take stretch by stretch, which says which rays need no more.
#[inline(always)]
pub(super) fn march<'a, S: Simd>(
    simd: S,
    frame: &'a Frame,
    pixels: &Pixels<S>,
    [x, y]: [u32; 2],
    lines: &'a [Lines<S>],
    until: Floats<S>,
    mut integrate: impl FnMut(&mut [Traveller<'a, S>], &Stretch<S>) -> Mask<S>,
) {
    let splat = |v| Floats::splat(simd, v);
    let none = Mask::splat(simd, false);
    let world = world_lines(simd, frame, pixels);
    let mut travellers = Vec::with_capacity(frame.layers.len());
    for (layer, lines) in frame.layers.iter().zip(lines) {
        let [s_min, s_max] = layer.spans.at(x, y);
        if s_min > s_max {
            continue;
        }
        let field = field_of(layer);
        let kept = kept(simd, &layer.surface.region, &world);
        let s_max = splat(s_max).min(kept.end).min(until);
        let part = Part { begin: kept.begin, s_min: splat(s_min), s_max };
        let (walk, open) = field.begin(simd, lines, &part, pixels.inside & kept.begin.simd_lt(until));
        let (cell, cubic, above) = (Crossing::nowhere(simd), [splat(0.0); 4], Ints::splat(simd, 0));
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
    let mut done = none;
    let mut here = splat(0.0);
    loop {
        let mut any = none;
        for traveller in &mut travellers {
            traveller.enter(simd, !done);
            any |= traveller.has;
        }
        let of = any & !done;
        if !of.any_true() {
            return;
        }
        let far = splat(super::walk::FAR);
        let (mut from, mut to) = (far, far);
        for t in &travellers {
            from = t.has.select(from.min(t.cell.s[0]), from);
        }
        let from = from.max(here);
        for t in &travellers {
            // A cell that is still ahead ends the stretch where it begins.
            let end = t.cell.s[0].simd_gt(from).select(t.cell.s[0], t.cell.s[1]);
            to = t.has.select(to.min(end), to);
        }
        let stretch = Stretch { from, to, of };
        done |= integrate(&mut travellers, &stretch);
        here = of.select(to, here);
        for t in &mut travellers {
            t.fresh &= !t.covers(&stretch);
            t.has &= t.cell.s[1].simd_gt(to);
        }
    }
}

impl<S: Simd> Traveller<'_, S> {
    /// Goes on to the next cell where there is none at hand.
    #[inline(always)]
    fn enter(&mut self, simd: S, asked: Mask<S>) {
        let seeking = self.open & asked & !self.has;
        if !seeking.any_true() {
            return;
        }
        let (arrived, cell) = cells::next_cell(simd, &self.field, &mut self.walk, seeking);
        self.open &= !seeking | arrived;
        if arrived.any_true() {
            let new = cell.until(self.s_max);
            self.cell.take(&new, arrived);
            if self.layer.needs_cubic {
                let cubic = bernstein(&new.f, &new.start, &new.end);
                self.cubic = std::array::from_fn(
                    #[inline(always)]
                    |n| arrived.select(cubic[n], self.cubic[n]),
                );
            }
            self.around.known &= !arrived;
            self.has |= arrived;
            self.fresh |= arrived;
        }
    }

    /// Which rays are in a cell all along a stretch.
    #[inline(always)]
    pub fn covers(&self, stretch: &Stretch<S>) -> Mask<S> {
        self.has & stretch.of & self.cell.s[0].simd_le(stretch.from)
    }

    /// How far of the way through their cells rays are at depth s, 0 to 1.
    #[inline(always)]
    pub fn part(&self, s: Floats<S>) -> Floats<S> {
        let length = self.cell.s[1] - self.cell.s[0];
        let u = ((s - self.cell.s[0]) / length).max(0.0).min(1.0);
        length.simd_gt(0.0).select(u, Floats::splat(s.token(), 0.0))
    }

    /// The depth where so much of the way through a cell is behind.
    #[inline(always)]
    pub fn depth(&self, u: Floats<S>) -> Floats<S> {
        self.cell.s[0] + u * (self.cell.s[1] - self.cell.s[0])
    }

    /// Normals in the world at u, toward the viewer, unit; zero where there is no gradient.
    #[inline(always)]
    pub fn normal(&mut self, simd: S, view: &View<'_, S>, u: Floats<S>, of: Mask<S>) -> Vecs<S> {
        simd.vectorize(
            #[inline(always)]
            || self.shading_normal(simd, view.scene, u, of),
        )
    }

    /// The same, but a cut's own within a voxel behind it: there noise would be all that a gradient shows.
    #[inline(always)]
    pub fn normal_behind_cut(&mut self, simd: S, view: &View<'_, S>, u: Floats<S>, s: Floats<S>, of: Mask<S>) -> Vecs<S> {
        let normal = self.normal(simd, view, u, of);
        let skin = view.frame.skin_mm / view.mm_per_depth;
        let cut = self.kept.is_cut & (s - self.kept.begin).simd_lt(skin);
        axes!(a => cut.select(self.kept.normal[a], normal[a]))
    }

    #[inline(always)]
    fn shading_normal(&mut self, simd: S, scene: &Scene, u: Floats<S>, of: Mask<S>) -> Vecs<S> {
        let local = lerp(&self.cell.start, &self.cell.end, u);
        let index = match scene.normals {
            Normals::Smooth => self.field.source.smooth_gradient(simd, self.field.dims, &self.cell.cell, &local, of, &mut self.around),
            Normals::Analytic => super::project::gradient(&self.cell.f, &local),
        };
        let direction = self.walk.rays.pace.direction;
        super::toward_viewer(simd, self.layer, &index, &direction)
    }
}

impl<S: Simd> Traveller<'_, S> {
    /// Which of the rays of `of`, where they enter their cells, come through the box's face or a cut, where surfaces are closed, and the
    /// normals of these.
    #[inline(always)]
    pub fn closing(&self, simd: S, of: Mask<S>) -> (Mask<S>, Vecs<S>) {
        let (zero, one) = (Floats::splat(simd, 0.0), Floats::splat(simd, 1.0));
        let of = of & self.cell.is_first;
        let met = self.field.met_at_entry(simd, &self.walk.rays.pace, &self.walk.at).only(of);
        let direction = self.walk.rays.pace.direction;
        let face = axes!(a => met.face[a].select(one.copysign(-direction[a]), zero));
        let face = super::toward_viewer(simd, self.layer, &face, &direction);
        let cut = met.start & self.kept.is_cut;
        (met.face[0] | met.face[1] | met.face[2] | met.start, axes!(a => cut.select(self.kept.normal[a], face[a])))
    }
}

/// `color` over what is behind it, where rays have gathered `all` so far (premultiplied, and its opacity).
#[inline(always)]
pub(super) fn put_behind<S: Simd>(all: &mut [Floats<S>; 4], color: &Vecs<S>, opacity: Floats<S>, of: Mask<S>) {
    let share = (1.0 - all[3]) * opacity;
    let added = axes!(a => all[a] + share * color[a]);
    for a in 0..3 {
        all[a] = of.select(added[a], all[a]);
    }
    all[3] = of.select(all[3] + share, all[3]);
}
