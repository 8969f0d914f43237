//! Where light comes from: discs, and the sky.
//!
//! The twin of `shaders/lamps.wgsl`.

use super::sampling::{combined, disc, frame_of};
use super::settings::{Lamp, Sky, light_of};
use crate::lanes::{Floats, Mask, Vecs, axes, dot};
use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::{DVec3, Vec3};

/// A lamp in its place. Points are relative to the bone's middle.
#[derive(Clone, Debug)]
pub(crate) struct Disc {
    pub centre: Vec3,
    /// From the lamp to the bone, unit.
    pub normal: Vec3,
    pub across: [Vec3; 2],
    pub radius: f32,
    /// Linear.
    pub radiance: Vec3,
}

/// Cosines below it are of rays that never come to a plane: their way there would be longer than float32 tells from others.
pub(crate) const GRAZING: f32 = 1e-12;

/// What comes from a lamp to points: along which directions, from how far, how much, and how densely these directions are sampled.
pub(super) struct FromLamp<S: Simd> {
    pub toward: Vecs<S>,
    pub far: Floats<S>,
    pub density: Floats<S>,
    /// Those that the lamp does not turn its back on.
    pub is_lit: Mask<S>,
}

impl Disc {
    /// Of a lamp toward a unit direction from a bone of such a radius. Its radiance gives at the bone's middle what a white sheet that faces it
    /// must have to look as bright as the lamp's strength: E = π · strength, where a disc gives E = π · radiance · r² / (r² + d²).
    pub fn of(lamp: &Lamp, toward: DVec3, radius_mm: f64) -> Self {
        let distance = lamp.distance * radius_mm;
        let radius = distance * (lamp.size_deg / 2.0).to_radians().tan();
        let per_strength = (radius * radius + distance * distance) / (radius * radius);
        let normal = (-toward).as_vec3();
        Self {
            centre: (toward * distance).as_vec3(),
            normal,
            across: frame_of(normal),
            radius: radius as f32,
            radiance: light_of(lamp.color, lamp.strength) * per_strength as f32,
        }
    }

    /// How far its farthest point lies from the bone's middle.
    pub fn reach_mm(&self) -> f64 {
        f64::from(self.centre.length() + self.radius)
    }

    /// Density of directions from as far as `far` that meet the disc under this cosine, where its points are sampled evenly.
    #[inline(always)]
    fn density<S: Simd>(&self, far_squared: Floats<S>, cosine: Floats<S>) -> Floats<S> {
        far_squared / (cosine * (std::f32::consts::PI * self.radius * self.radius))
    }

    /// From points to one of its own.
    #[inline(always)]
    pub(super) fn sample<S: Simd>(&self, simd: S, p: &Vecs<S>, numbers: [Floats<S>; 2]) -> FromLamp<S> {
        let splat = |v: Vec3| axes!(a => Floats::splat(simd, v[a]));
        let [x, y] = disc(numbers);
        let centre = splat(self.centre);
        let offset = combined(&self.across.map(splat), &centre, [x * self.radius, y * self.radius, Floats::splat(simd, 1.0)]);
        let way = axes!(a => offset[a] - p[a]);
        let far_squared = dot(&way, &way);
        let far = far_squared.sqrt();
        let toward = axes!(a => way[a] / far);
        let cosine = -dot(&toward, &splat(self.normal));
        FromLamp { toward, far, density: self.density(far_squared, cosine.max(GRAZING)), is_lit: cosine.simd_gt(0.0) }
    }

    /// Which rays from points meet its face nearer than `far`, where, and how densely that direction is sampled.
    #[inline(always)]
    pub fn met<S: Simd>(&self, simd: S, p: &Vecs<S>, direction: &Vecs<S>, far: Floats<S>) -> (Mask<S>, Floats<S>, Floats<S>) {
        let splat = |v: Vec3| axes!(a => Floats::splat(simd, v[a]));
        let (centre, normal) = (splat(self.centre), splat(self.normal));
        let from = axes!(a => p[a] - centre[a]);
        let cosine = -dot(direction, &normal);
        let t = dot(&from, &normal) / cosine.max(GRAZING);
        let at = axes!(a => from[a] + t * direction[a]);
        let within = dot(&at, &at).simd_le(self.radius * self.radius);
        let met = cosine.simd_gt(GRAZING) & t.simd_gt(0.0) & t.simd_lt(far) & within;
        (met, t, self.density(t * t, cosine.max(GRAZING)))
    }
}

/// The sky in its place.
#[derive(Clone, Debug)]
pub(crate) struct Dome {
    pub up: Vec3,
    /// Half the sum and half the difference of its ends' light.
    pub middle: Vec3,
    pub half: Vec3,
}

impl Dome {
    pub fn of(sky: &Sky, up: DVec3) -> Self {
        let [above, below] = [sky.above, sky.below].map(|color| light_of(color, sky.strength));
        Self { up: up.as_vec3(), middle: (above + below) / 2.0, half: (above - below) / 2.0 }
    }

    /// Its radiance along directions.
    #[inline(always)]
    pub fn light<S: Simd>(&self, direction: &Vecs<S>) -> Vecs<S> {
        let height = direction[0] * self.up.x + direction[1] * self.up.y + direction[2] * self.up.z;
        axes!(a => height * self.half[a] + self.middle[a])
    }
}
