//! The rays of a packet in the world, and what they have gathered on their way.
//!
//! The twin of `shaders/ray.wgsl`.

use super::light::{cued, known_normal, phong};
use super::nearest::Drawn;
use super::packets::Pixels;
use crate::frame::Frame;
use crate::lanes::{Doubles, Floats, Mask, Vecs, axes, dot};
use crate::scene::Scene;
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// How a packet's pixels look into the world.
pub(super) struct View<'a, S: Simd> {
    pub frame: &'a Frame,
    pub scene: &'a Scene,
    pub pixels: &'a Pixels<S>,
    /// Unit.
    pub direction: Vecs<S>,
    /// Length of a ray for each mm of depth.
    pub length: Doubles<S>,
    pub mm_per_depth: Floats<S>,
}

impl<'a, S: Simd> View<'a, S> {
    /// Of the pixels of a packet.
    #[inline(always)]
    pub fn of(simd: S, frame: &'a Frame, scene: &'a Scene, pixels: &'a Pixels<S>) -> Self {
        let world = pixels.at(simd, &frame.world_rays.direction);
        let length = (world[0] * world[0] + world[1] * world[1] + world[2] * world[2]).sqrt();
        Self { frame, scene, pixels, direction: normalized(&axes!(a => world[a].to_floats())), length, mm_per_depth: length.to_floats() }
    }

    /// The colours of what has a colour (linear) and a normal at depth s, where a share of the light comes.
    #[inline(always)]
    pub fn lit(&self, simd: S, color: &Vecs<S>, normal: &Vecs<S>, share: Floats<S>, s: Floats<S>) -> Vecs<S> {
        simd.vectorize(
            #[inline(always)]
            || {
                let normal = known_normal(normal, &self.direction);
                let toward = axes!(a => Floats::splat(simd, self.frame.toward_light[a]));
                let color = phong(simd, &self.scene.light, color, &normal, &self.direction, &toward, share);
                cued(simd, self.frame, &color, s)
            },
        )
    }
}

#[inline(always)]
fn normalized<S: Simd>(v: &Vecs<S>) -> Vecs<S> {
    let length = dot(v, v).sqrt();
    axes!(a => v[a] / length)
}

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
