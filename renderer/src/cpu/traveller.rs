//! One volume on the way of a packet through all.
//!
//! The twin of `shaders/traveller.wgsl`.

use super::brick::FAR;
use super::cells::CellPass;
use super::cuts::Kept;
use super::gradient::{Around, gradient};
use super::ray::View;
use super::rim::rim;
use super::volume::{Field, toward_viewer};
use super::walk::{Walk, next_cell};
use crate::frame::FrameLayer;
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
    pub walk: Walk<'a, S>,
    pub s_max: Floats<S>,
    /// Which rays are on their way, and which of them are in a cell.
    pub open: Mask<S>,
    pub has: Mask<S>,
    /// Which have just come to it.
    pub fresh: Mask<S>,
    /// The cell, and the interpolant on the way through it.
    pub cell: CellPass<S>,
    /// Where the layer needs it.
    pub cubic: [Floats<S>; 4],
    /// How many of the layer's levels lie at or below the value here: what is kept from cell to cell, so that no crossing falls between.
    pub above: Ints<S>,
    /// What lies around the cell.
    pub around: Around<S>,
}

/// Depths between which the cells stay the same.
pub(super) struct Stretch<S: Simd> {
    pub from: Floats<S>,
    pub to: Floats<S>,
    /// Which rays are still on their way.
    pub of: Mask<S>,
}

impl<S: Simd> Stretch<S> {
    /// The next one of the rays of `of`, which have come to `here`.
    ///
    /// ```text
    ///   volume A  ├──────cell──────┤
    ///   volume B         ├───────cell───────┤
    ///             ├ one ─┼─ next ──┼─ third ┤     each begins where the last one ends, or the nearest cell begins
    /// ```
    #[inline(always)]
    pub fn of(simd: S, travellers: &[Traveller<'_, S>], here: Floats<S>, of: Mask<S>) -> Self {
        let far = Floats::splat(simd, FAR);
        let (mut from, mut to) = (far, far);
        for t in travellers {
            from = t.has.select(from.min(t.cell.s[0]), from);
        }
        let from = from.max(here);
        for t in travellers {
            // A cell that is still ahead ends the stretch where it begins.
            let end = t.cell.s[0].simd_gt(from).select(t.cell.s[0], t.cell.s[1]);
            to = t.has.select(to.min(end), to);
        }
        Self { from, to, of }
    }
}

impl<S: Simd> Traveller<'_, S> {
    /// Goes on to the next cell where there is none at hand.
    #[inline(always)]
    pub fn go_on(&mut self, simd: S, asked: Mask<S>) {
        let seeking = self.open & asked & !self.has;
        if !seeking.any_true() {
            return;
        }
        let (arrived, cell) = next_cell(simd, &self.field, &mut self.walk, seeking);
        self.open &= !seeking | arrived;
        if arrived.any_true() {
            let new = cell.until(self.s_max);
            self.cell.take(&new, arrived);
            if self.layer.appearance.needs_cubic {
                let cubic = bernstein(&new.f, &new.start, &new.end);
                self.cubic = std::array::from_fn(
                    #[inline(always)]
                    |n| arrived.select(cubic[n], self.cubic[n]),
                );
            }
            // Behind a gap that the solid leaves nothing is known of the side before.
            self.above = (arrived & new.at_face).select(Ints::splat(simd, 0), self.above);
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
    pub fn share_at(&self, s: Floats<S>) -> Floats<S> {
        let length = self.cell.s[1] - self.cell.s[0];
        let u = ((s - self.cell.s[0]) / length).max(0.0).min(1.0);
        length.simd_gt(0.0).select(u, Floats::splat(s.token(), 0.0))
    }

    /// The depth where so much of the way through a cell is behind.
    #[inline(always)]
    pub fn depth_at(&self, u: Floats<S>) -> Floats<S> {
        self.cell.s[0] + u * (self.cell.s[1] - self.cell.s[0])
    }

    /// Normals in the world at u, toward the viewer, unit; zero where there is no gradient.
    #[inline(always)]
    pub fn normal_at(&mut self, simd: S, view: &View<'_, S>, u: Floats<S>, of: Mask<S>) -> Vecs<S> {
        simd.vectorize(
            #[inline(always)]
            || self.shading_normal(simd, view.scene, u, of),
        )
    }

    /// The same, but a cut's own within a voxel behind it: there noise would be all that a gradient shows.
    #[inline(always)]
    pub fn normal_behind_cut(&mut self, simd: S, view: &View<'_, S>, u: Floats<S>, s: Floats<S>, of: Mask<S>) -> Vecs<S> {
        let normal = self.normal_at(simd, view, u, of);
        let skin = view.frame.skin_mm / view.mm_per_depth;
        let cut = self.kept.is_cut & (s - self.kept.begin).simd_lt(skin);
        axes!(a => cut.select(self.kept.normal[a], normal[a]))
    }

    #[inline(always)]
    fn shading_normal(&mut self, simd: S, scene: &Scene, u: Floats<S>, of: Mask<S>) -> Vecs<S> {
        let local = lerp(&self.cell.start, &self.cell.end, u);
        let index = match scene.normals {
            Normals::Smooth => self.field.source.smooth_gradient(simd, self.field.dims, &self.cell.cell, &local, of, &mut self.around),
            Normals::Analytic => gradient(&self.cell.f, &local),
        };
        let direction = self.walk.rays.pace.direction;
        let index = match self.field.solid {
            Some(solid) => {
                let at_face = self.cell.at_face & u.simd_eq(0.0);
                let rim_units = self.layer.placement.rim_units;
                rim(simd, (solid, rim_units), (&self.cell.cell, &local), &index, (&direction, at_face), of)
            }
            None => index,
        };
        toward_viewer(simd, self.layer, &index, &direction)
    }

    /// Which of the rays of `of`, where they enter their cells, come through the box's face or a cut, where surfaces are closed, and the
    /// normals of these.
    #[inline(always)]
    pub fn closing_normal(&self, simd: S, of: Mask<S>) -> (Mask<S>, Vecs<S>) {
        let (zero, one) = (Floats::splat(simd, 0.0), Floats::splat(simd, 1.0));
        let of = of & self.cell.is_first & !self.cell.at_face;
        let met = self.field.met_at_entry(simd, &self.walk.rays.pace, &self.walk.at).only(of);
        let direction = self.walk.rays.pace.direction;
        let face = axes!(a => met.face[a].select(one.copysign(-direction[a]), zero));
        let face = toward_viewer(simd, self.layer, &face, &direction);
        let cut = met.start & self.kept.is_cut;
        (met.face[0] | met.face[1] | met.face[2] | met.start, axes!(a => cut.select(self.kept.normal[a], face[a])))
    }
}
