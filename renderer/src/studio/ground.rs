//! What the bone stands on: a plane, which as a sweep curves up behind and becomes a wall.
//!
//! ```text
//!   height                    │ wall
//!     ▲                       │ behind = corner + radius
//!     │         bone         ╱
//!     └──────────────────__-'    radius
//!     floor, height 0   corner ──► behind
//! ```
//! All that is in front of it is convex: it keeps no light from itself, and rays from there meet it once.
//!
//! The twin of `shaders/ground.wgsl`.

use super::lamps::GRAZING;
use super::settings::{Ground, light_of};
use crate::lanes::{Floats, Mask, Vecs, axes, dot};
use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::{DVec3, Vec3};

/// The ground in its place. Points are relative to the bone's middle, mm.
#[derive(Clone, Debug)]
pub(crate) struct Floor {
    pub up: Vec3,
    pub behind: Vec3,
    /// Of the floor, along `up`.
    pub height: f32,
    /// Where the floor begins to rise, along `behind`, and how it is rounded; far away where there is no wall.
    pub corner: f32,
    pub radius: f32,
    /// Linear.
    pub color: Vec3,
    pub is_catcher: bool,
}

/// Where rays meet it.
pub(super) struct Met<S: Simd> {
    pub found: Mask<S>,
    pub far: Floats<S>,
}

/// The wall stands so many times as far behind the middle as the farthest lamp, or the bone's radius, reaches.
const WALL: f64 = 1.3;
/// And at least at so many radii of the bone.
const LEAST_WALL: f64 = 7.0;
/// Part of the wall's distance that is rounded.
const ROUNDED: f64 = 0.6;

impl Floor {
    /// Of a bone of such a radius whose lowest point is at `height_mm` along `up`, and whose farthest lamp lies at `lamps_mm`; `behind` is where
    /// the camera looks, across `up`.
    pub fn of(ground: &Ground, [up, behind]: [DVec3; 2], height_mm: f64, radius_mm: f64, lamps_mm: f64) -> Option<Self> {
        let wall_mm = (WALL * lamps_mm).max(LEAST_WALL * radius_mm);
        let (color, is_catcher) = match ground {
            Ground::None => return None,
            Ground::Sweep { color } => (light_of(*color, 1.0), false),
            Ground::Catcher => (Vec3::ONE, true),
        };
        // So far away that the plane has no end in float32's digits that a picture shows.
        let corner = if is_catcher { 1e6 * radius_mm } else { (1.0 - ROUNDED) * wall_mm };
        Some(Self {
            up: up.as_vec3(),
            behind: behind.as_vec3(),
            height: height_mm as f32,
            corner: corner as f32,
            radius: (ROUNDED * wall_mm) as f32,
            color,
            is_catcher,
        })
    }

    #[inline(always)]
    fn splat<S: Simd>(simd: S, v: Vec3) -> Vecs<S> {
        axes!(a => Floats::splat(simd, v[a]))
    }

    /// The height of points above the floor, and how far behind the corner they lie.
    #[inline(always)]
    fn place<S: Simd>(&self, simd: S, p: &Vecs<S>) -> [Floats<S>; 2] {
        [dot(p, &Self::splat(simd, self.up)) - self.height, dot(p, &Self::splat(simd, self.behind)) - self.corner]
    }

    /// Which points lie before it.
    #[inline(always)]
    pub fn before<S: Simd>(&self, simd: S, p: &Vecs<S>) -> Mask<S> {
        let [h, b] = self.place(simd, p);
        let (low, deep) = ((self.radius - h).max(0.0), b.max(0.0));
        h.simd_gt(0.0) & (low * low + deep * deep).simd_lt(self.radius * self.radius)
    }

    /// Where rays from points leave what lies before it.
    #[inline(always)]
    pub(super) fn hit<S: Simd>(&self, simd: S, p: &Vecs<S>, direction: &Vecs<S>) -> Met<S> {
        let ([h, b], zero) = (self.place(simd, p), Floats::splat(simd, 0.0));
        let [rise, deepen] = [dot(direction, &Self::splat(simd, self.up)), dot(direction, &Self::splat(simd, self.behind))];
        let floor_far = -h / rise.min(-GRAZING);
        let on_floor = rise.simd_lt(-GRAZING) & floor_far.simd_gt(0.0) & (b + floor_far * deepen).simd_le(0.0);
        let wall_far = (self.radius - b) / deepen.max(GRAZING);
        let on_wall = deepen.simd_gt(GRAZING) & wall_far.simd_gt(0.0) & (h + wall_far * rise).simd_ge(self.radius);
        // The rounded corner: from within a cylinder the later of its two crossings.
        let low = h - self.radius;
        let (square, half) = (rise * rise + deepen * deepen, low * rise + b * deepen);
        let discriminant = half * half - square * (low * low + b * b - self.radius * self.radius);
        let round_far = (discriminant.max(0.0).sqrt() - half) / square.max(GRAZING);
        let is_round = discriminant.simd_gt(0.0)
            & square.simd_gt(GRAZING)
            & round_far.simd_gt(0.0)
            & (b + round_far * deepen).simd_gt(0.0)
            & (low + round_far * rise).simd_lt(0.0);
        let round_far = is_round.select(round_far, zero);
        let far = on_floor.select(floor_far, on_wall.select(wall_far, round_far));
        Met { found: on_floor | on_wall | is_round, far }
    }

    /// The normals at points of it.
    #[inline(always)]
    pub fn normal<S: Simd>(&self, simd: S, p: &Vecs<S>) -> Vecs<S> {
        let [h, b] = self.place(simd, p);
        let (low, deep) = ((self.radius - h).max(0.0), b.max(0.0));
        let length = (low * low + deep * deep).sqrt();
        // A point of the floor, by rounding a little before or behind it.
        let flat = b.simd_le(0.0);
        let (rise, back) = (flat.select(Floats::splat(simd, 1.0), low / length), flat.select(Floats::splat(simd, 0.0), deep / length));
        axes!(a => rise * self.up[a] - back * self.behind[a])
    }
}
