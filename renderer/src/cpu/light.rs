//! Phong's reflection (Phong 1975) in linear light, and what becomes of colours on their way.
//!
//! The twin of `shaders/light.wgsl`.

use crate::frame::Frame;
use crate::lanes::{Floats, LANES, Mask, Vecs, axes, dot, numbers};
use crate::scene::{Color, CutFace, Light};
use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::{Vec3, Vec4};

/// The linear colours of surfaces of `color` (linear) with a `normal` toward the viewer, seen along `view` and lit from `toward`, all unit
/// vectors in the world, by a `share` of the light.
#[inline(always)]
pub(super) fn phong<S: Simd>(
    simd: S,
    light: &Light,
    color: &Vecs<S>,
    normal: &Vecs<S>,
    view: &Vecs<S>,
    toward: &Vecs<S>,
    share: Floats<S>,
) -> Vecs<S> {
    let zero = Floats::splat(simd, 0.0);
    let cosine = dot(normal, toward);
    let lambert = cosine.max(zero) * share;
    let mirrored = axes!(a => 2.0 * cosine * normal[a] - toward[a]);
    let reflected = (-dot(&mirrored, view)).max(zero);
    let shines = lambert.simd_gt(zero) & reflected.simd_gt(zero);
    let highlight = light.specular * share * shines.select(power(simd, reflected, light.shininess, shines), zero);
    axes!(a => color[a] * (light.ambient + light.diffuse * lambert) + highlight)
}

/// Numbers to the power of `exponent`, in the lanes of `of`.
#[inline(always)]
fn power<S: Simd>(simd: S, base: Floats<S>, exponent: f32, of: Mask<S>) -> Floats<S> {
    if exponent.fract() == 0.0 && (0.0..=MOST_MULTIPLIED).contains(&exponent) {
        // By squares, for all lanes at once.
        let (mut rest, mut square, mut product) = (exponent as u32, base, Floats::splat(simd, 1.0));
        while rest > 0 {
            if rest & 1 == 1 {
                product *= square;
            }
            square *= square;
            rest >>= 1;
        }
        return product;
    }
    let (base, mut power) = (base.to_array(), [0.0; LANES]);
    numbers(of).for_each(|lane| power[lane] = base[lane].powf(exponent));
    Floats::load_array(simd, power)
}

/// Up to here multiplying is faster, and less than 1e-4 off.
const MOST_MULTIPLIED: f32 = 1024.0;

/// Normals, where there are any; elsewhere what is seen along `view` is seen from the front.
#[inline(always)]
pub(super) fn known_normal<S: Simd>(normal: &Vecs<S>, view: &Vecs<S>) -> Vecs<S> {
    let unknown = dot(normal, normal).simd_eq(0.0);
    axes!(a => unknown.select(-view[a], normal[a]))
}

/// Colours at depth s on their way to the background's.
#[inline(always)]
pub(super) fn cued<S: Simd>(simd: S, frame: &Frame, color: &Vecs<S>, s: Floats<S>) -> Vecs<S> {
    if frame.cue_per_mm == 0.0 {
        return *color;
    }
    let share = (s * frame.cue_per_mm).max(0.0).min(1.0);
    axes!(a => color[a] * (1.0 - share) + Floats::splat(simd, frame.background[a]) * share)
}

/// A premultiplied linear colour over the background, as sRGB bytes with straight alpha.
pub(super) fn encode(color: Vec4, background: Vec4) -> [u8; 4] {
    let c = color + background * (1.0 - color.w);
    let straight = if c.w > 0.0 { c.truncate() / c.w } else { Vec3::ZERO };
    let [r, g, b] = straight.to_array().map(fast_srgb8::f32_to_srgb8);
    [r, g, b, (c.w.clamp(0.0, 1.0) * 255.0).round() as u8]
}

/// The light of a brightness, kept between 0 and 1.
pub(super) fn grey(brightness: f32) -> Vec3 {
    Color([brightness.clamp(0.0, 1.0); 3]).linear()
}

/// The linear colour of the face of a cut that shows values, of the brightnesses of the volumes that it cuts there, with their colours; `own`
/// where it shows only those of the nearest.
pub(super) fn color_of_faces(how: CutFace, own: Vec3, cut: &[(f32, Vec3)]) -> Vec3 {
    match (how, cut) {
        (CutFace::Blend, [_, _, ..]) => cut.iter().map(|(b, color)| *color * grey(*b)).sum::<Vec3>().min(Vec3::ONE),
        (CutFace::Difference, [(a, _), (b, _), ..]) => {
            let difference = (a - b).clamp(-1.0, 1.0);
            let end = if difference > 0.0 { FIRST_IS_MORE } else { SECOND_IS_MORE };
            Color(std::array::from_fn(|n| EQUAL[n] + (end[n] - EQUAL[n]) * difference.abs())).linear()
        }
        _ => own,
    }
}

/// The ends and the middle of the diverging map RdBu (Brewer 2003), sRGB.
pub(crate) const FIRST_IS_MORE: [f32; 3] = [0.698, 0.094, 0.169];
pub(crate) const SECOND_IS_MORE: [f32; 3] = [0.129, 0.400, 0.674];
pub(crate) const EQUAL: [f32; 3] = [0.969, 0.969, 0.969];
