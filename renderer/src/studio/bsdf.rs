//! How surfaces answer light: Lambert's law (1760), under a coat of varnish where there is gloss.
//!
//! The coat is a rough dielectric (Walter et al. 2007, GGX). What it reflects is taken from what is below by the coupling of Kelemen and
//! Szirmay-Kalos (2001): `diffuse = albedo/π · (1 − E(out)) · (1 − E(in)) / (1 − mean E)`, E the coat's albedo, so that white stays white.
//!
//! The twin of `shaders/bsdf.wgsl`.

use super::sampling::{above_disc, combined, frame, normalized};
use crate::lanes::{Floats, LANES, Mask, Vecs, axes, dot};
use fearless_simd::Simd;
use fearless_simd::prelude::*;
use std::f32::consts::FRAC_1_PI;

/// Refractive index of the coat, that of resins and of bone's own collagen.
pub(crate) const ETA: f32 = 1.5;
/// Its roughness (GGX's alpha): a sheen without mirror images.
pub(crate) const ALPHA: f32 = 0.5;
/// Entries of the table of its albedo.
const ENTRIES: usize = 32;
/// And as many numbers as these are between.
pub(crate) const ALBEDOS: usize = ENTRIES + 1;
/// Cosines of the way out are no smaller: smooth normals may turn away from the viewer.
pub(crate) const LEAST_COSINE: f32 = 1e-4;
/// Nor are those that something is divided by, of half vectors and of the way in: far below any that matters.
pub(crate) const LEAST_HALF: f32 = 1e-6;

/// Share that a dielectric mirrors at a cosine (Fresnel).
#[inline(always)]
fn fresnel<S: Simd>(cosine: Floats<S>) -> Floats<S> {
    let g = (ETA * ETA - 1.0 + cosine * cosine).sqrt();
    let (sum, less) = (g + cosine, g - cosine);
    let a = less / sum;
    let b = (cosine * sum - 1.0) / (cosine * less + 1.0);
    0.5 * a * a * (1.0 + b * b)
}

/// GGX's density of half vectors at the square of their cosine.
#[inline(always)]
fn density<S: Simd>(cosine_squared: Floats<S>) -> Floats<S> {
    let k = 1.0 + cosine_squared * (ALPHA * ALPHA - 1.0);
    ALPHA * ALPHA * FRAC_1_PI / (k * k)
}

/// Smith's masking of both directions together, over four times the product of their cosines.
#[inline(always)]
fn visible<S: Simd>(out: Floats<S>, into: Floats<S>) -> Floats<S> {
    let way = |c: Floats<S>, d: Floats<S>| d * (ALPHA * ALPHA + (1.0 - ALPHA * ALPHA) * c * c).sqrt();
    0.5 / (way(out, into) + way(into, out))
}

/// The coat: how glossy, and its albedo by the cosine.
#[derive(Clone, Debug)]
pub(crate) struct Coat {
    pub gloss: f32,
    pub albedo: [f32; ALBEDOS],
    pub mean: f32,
}

/// Surfaces at points.
pub(super) struct Face<S: Simd> {
    pub albedo: Vecs<S>,
    /// That shades, and the way to the viewer; unit.
    pub normal: Vecs<S>,
    pub out: Vecs<S>,
    /// 0 where it has no coat.
    pub gloss: Floats<S>,
}

/// What a surface answers at a point.
pub(super) struct Answer<S: Simd> {
    /// Reflected radiance of a light from there of 1 a steradian: BSDF · cosine.
    pub light: Vecs<S>,
    /// Density of sampling that direction.
    pub density: Floats<S>,
}

impl Coat {
    /// Of a gloss from 0 to 1. The albedo is summed up over half vectors in float64, the same on all machines but for the last place.
    pub fn of(gloss: f32) -> Self {
        let mut albedo = [0.0; ALBEDOS];
        for (n, entry) in albedo.iter_mut().enumerate() {
            *entry = albedo_at((n as f64 / ENTRIES as f64).max(1e-3)) as f32;
        }
        // 2 ∫ E(µ) µ dµ, by trapezia.
        let part = |n: usize| albedo[n] * n as f32 / ENTRIES as f32;
        let mean = (0..ENTRIES).map(|n| (part(n) + part(n + 1)) / ENTRIES as f32).sum();
        Self { gloss, albedo, mean }
    }

    /// What it reflects at a cosine, of surfaces with a gloss.
    #[inline(always)]
    fn at<S: Simd>(&self, gloss: Floats<S>, cosine: Floats<S>) -> Floats<S> {
        let place = cosine.max(0.0).min(1.0) * ENTRIES as f32;
        let first = place.floor().min((ENTRIES - 1) as f32);
        let (numbers, mut low, mut high) = (first.to_array(), [0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            let n = numbers[lane] as usize;
            (low[lane], high[lane]) = (self.albedo[n], self.albedo[n + 1]);
        }
        let (low, high) = (Floats::load_array(cosine.token(), low), Floats::load_array(cosine.token(), high));
        gloss * (low + (high - low) * (place - first))
    }

    /// The answer of surfaces to light from `into`; none from behind.
    #[inline(always)]
    pub(super) fn answer<S: Simd>(&self, surface: &Face<S>, into: &Vecs<S>) -> Answer<S> {
        let Face { albedo, normal, out, gloss } = surface;
        let gloss = *gloss;
        let zero = Floats::splat(normal[0].token(), 0.0);
        let cosine = dot(normal, into).max(zero);
        if self.gloss == 0.0 {
            let share = cosine * FRAC_1_PI;
            return Answer { light: axes!(a => albedo[a] * share), density: share };
        }
        let out_cosine = dot(normal, out).max(LEAST_COSINE);
        let kept = self.at(gloss, out_cosine);
        let half = normalized(&axes!(a => out[a] + into[a]));
        let (n_h, o_h) = (dot(normal, &half).max(zero), dot(out, &half).max(LEAST_HALF));
        let d = density(n_h * n_h);
        let mirrored = cosine.simd_gt(zero).select(gloss * fresnel(o_h) * d * visible(out_cosine, cosine.max(LEAST_HALF)) * cosine, zero);
        let below = (1.0 - kept) * (1.0 - self.at(gloss, cosine)) / (1.0 - gloss * self.mean) * cosine * FRAC_1_PI;
        let density = kept * d * n_h / (4.0 * o_h) + (1.0 - kept) * cosine * FRAC_1_PI;
        Answer { light: axes!(a => albedo[a] * below + mirrored), density: cosine.simd_gt(zero).select(density, zero) }
    }

    /// A direction to follow, of a point on the disc and a number that chooses between coat and what is below.
    #[inline(always)]
    pub(super) fn sample<S: Simd>(&self, surface: &Face<S>, [x, y]: [Floats<S>; 2], choice: Floats<S>) -> Vecs<S> {
        let Face { normal, out, gloss, .. } = surface;
        let across = frame(normal);
        let below = combined(&across, normal, [x, y, above_disc([x, y])]);
        if self.gloss == 0.0 {
            return below;
        }
        // GGX's half vectors: their cosine by the disc's radius, their way round by its angle.
        let r_squared = (x * x + y * y).min(1.0);
        let n_h = ((1.0 - r_squared) / (1.0 + r_squared * (ALPHA * ALPHA - 1.0))).max(0.0).sqrt();
        let scale = r_squared.simd_gt(0.0).select(((1.0 - n_h * n_h).max(0.0) / r_squared).sqrt(), Floats::splat(x.token(), 0.0));
        let half = combined(&across, normal, [x * scale, y * scale, n_h]);
        let o_h = dot(out, &half);
        let coat: Mask<S> = choice.simd_lt(self.at(*gloss, dot(normal, out).max(LEAST_COSINE)));
        axes!(a => coat.select(2.0 * o_h * half[a] - out[a], below[a]))
    }
}

/// Albedo of the whole coat at a cosine: the mean over GGX's half vectors of what each mirrors.
fn albedo_at(out: f64) -> f64 {
    const STEPS: usize = 128;
    let (alpha, eta) = (f64::from(ALPHA), f64::from(ETA));
    let sine = (1.0 - out * out).max(0.0).sqrt();
    let lambda = |c: f64| ((alpha * alpha + (1.0 - alpha * alpha) * c * c).sqrt() / c + 1.0) / 2.0;
    let mut sum = 0.0;
    for i in 0..STEPS {
        let u = (i as f64 + 0.5) / STEPS as f64;
        let n_h = ((1.0 - u) / (1.0 + (alpha * alpha - 1.0) * u)).sqrt();
        for j in 0..STEPS {
            let turn = (j as f64 + 0.5) / STEPS as f64 * std::f64::consts::PI;
            let o_h = out * n_h + sine * (1.0 - n_h * n_h).max(0.0).sqrt() * turn.cos();
            let into = 2.0 * o_h * n_h - out;
            if o_h <= 0.0 || into <= 0.0 {
                continue;
            }
            let g = (eta * eta - 1.0 + o_h * o_h).sqrt();
            let f = 0.5 * ((g - o_h) / (g + o_h)).powi(2) * (1.0 + ((o_h * (g + o_h) - 1.0) / (o_h * (g - o_h) + 1.0)).powi(2));
            // The masking of both directions (Smith, correlated by height), G = 1/(Λ(out) + Λ(in) − 1) with these Λ.
            sum += f * o_h / (n_h * out) / (lambda(out) + lambda(into) - 1.0);
        }
    }
    sum / (STEPS * STEPS) as f64
}

/// The power heuristic (Veach 1997): the share of a way of sampling of density `a` beside one of density `b`.
#[inline(always)]
pub(super) fn power<S: Simd>(a: Floats<S>, b: Floats<S>) -> Floats<S> {
    let (a, b) = (a * a, b * b);
    let sum = a + b;
    sum.simd_gt(0.0).select(a / sum, Floats::splat(sum.token(), 0.0))
}
