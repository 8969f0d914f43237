//! Phong's reflection (Phong 1975) in linear light, and what becomes of colours on their way.
//!
//! The twin of `shaders/light.wgsl`.

use crate::color::Color;
use crate::frame::Frame;
use crate::lanes::{Floats, LANES, Mask, Vecs, axes, dot, numbers};
use crate::scene::{CutFace, Light};
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
    let lambert = cosine.max(zero);
    let kept = 1.0 - (1.0 - share) * light.shadow;
    let mirrored = axes!(a => 2.0 * cosine * normal[a] - toward[a]);
    let reflected = (-dot(&mirrored, view)).max(zero);
    let shines = (lambert * share).simd_gt(zero) & reflected.simd_gt(zero);
    let highlight = light.specular * share * shines.select(power(simd, reflected, light.shininess, shines), zero);
    axes!(a => color[a] * (light.ambient + light.diffuse * lambert * kept) + highlight)
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
pub(crate) fn encode(color: Vec4, background: Vec4) -> [u8; 4] {
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
        (CutFace::Difference, [(a, _), (b, _), ..]) => Color::diverging(a - b).linear(),
        _ => own,
    }
}

#[cfg(test)]
mod tests {
    use super::super::faces::face_color_at;
    use super::*;
    use crate::color::BONE;
    use bregma_synthetic::Random;
    use fearless_simd::{Level, dispatch};

    fn number(r: &mut Random) -> f32 {
        r.unit() as f32
    }

    fn unit(r: &mut Random) -> Vec3 {
        Vec3::from_array(std::array::from_fn(|_| 2.0 * number(r) - 1.0)).normalize()
    }

    #[test]
    fn more_light_is_never_darker_and_shadows_keep_relief() {
        // Fails if a share of the light is not one, the side away from it is lit, or squares are not the power that they stand for.
        let mut r = Random(2);
        for _ in 0..1000 {
            let light = Light { shininess: (40.0 * number(&mut r)).floor(), ..Light::default() };
            let (color, [normal, view, toward]) = (Vec3::splat(number(&mut r)), [0; 3].map(|_| unit(&mut r)));
            let shares = [0.0, number(&mut r), 1.0];
            let lit = shares.map(|share| {
                dispatch!(Level::new(), simd => {
                    let splat = |v: Vec3| axes!(a => Floats::splat(simd, v[a]));
                    let found = phong(simd, &light, &splat(color), &splat(normal), &splat(view), &splat(toward), Floats::splat(simd, share));
                    [found[0][0], found[1][0], found[2][0]]
                })
            });
            let in_shadow = light.ambient + light.diffuse * (1.0 - light.shadow) * normal.dot(toward).max(0.0);
            assert!((lit[0][0] - in_shadow * color.x).abs() < 1e-6, "{lit:?}");
            assert!(
                lit[0][0] <= lit[1][0] && lit[1][0] <= lit[2][0] && lit[2][0] <= light.ambient + light.diffuse + light.specular + 1e-5,
                "{lit:?}"
            );
            if normal.dot(toward) <= 0.0 {
                assert_eq!(lit[0], lit[2], "lit from behind");
            }
            let (base, exponent) = (number(&mut r), (MOST_MULTIPLIED * number(&mut r)).floor());
            let power = dispatch!(Level::new(), simd => power(simd, Floats::splat(simd, base), exponent, Mask::splat(simd, true))[0]);
            assert!((f64::from(power) - f64::from(base).powf(f64::from(exponent))).abs() < 1e-4, "{base} to {exponent}: {power}");
        }
    }

    #[test]
    fn colours_over_a_background_and_in_tables_lie_between_what_they_are_of() {
        // Fails if alpha is applied twice or not at all, a table is read beyond its end, or a difference is not the other way round backwards.
        let mut r = Random(3);
        for _ in 0..1000 {
            let [color, background] = [0; 2].map(|_| Vec3::from_array(std::array::from_fn(|_| number(&mut r))));
            let opaque = encode(color.extend(1.0), background.extend(1.0));
            assert_eq!(opaque, encode(color.extend(1.0), Vec4::ZERO));
            let behind = encode(Vec4::ZERO, background.extend(1.0));
            assert_eq!((behind, encode(Vec4::ZERO, Vec4::ZERO)), (encode(background.extend(1.0), Vec4::ZERO), [0; 4]));
            let alpha = number(&mut r);
            let over = encode((color * alpha).extend(alpha), background.extend(1.0));
            assert!((0..3).all(|a| over[a] >= opaque[a].min(behind[a]) && over[a] <= opaque[a].max(behind[a])) && over[3] == 255);
            let clear = encode((color * alpha).extend(alpha), Vec4::ZERO);
            assert!(
                (0..3).all(|a| clear[a].abs_diff(opaque[a]) <= 1) && clear[3] == (alpha * 255.0).round() as u8,
                "{clear:?} of {opaque:?}"
            );

            let table: Vec<Vec4> = (0..5).map(|n| Vec4::splat(n as f32)).collect();
            let place = 3.0 * number(&mut r) - 1.0;
            assert!((face_color_at(&table, place).x - 4.0 * place.clamp(0.0, 1.0)).abs() < 1e-5);
            let [a, b] = [(number(&mut r), color), (number(&mut r), background)];
            let difference = |cut: &[(f32, Vec3)]| color_of_faces(CutFace::Difference, color, cut);
            assert_eq!(difference(&[a, a]), Color(BONE).linear());
            assert!(if a.0 > b.0 {
                difference(&[a, b]).x >= difference(&[b, a]).x
            } else {
                difference(&[a, b]).x <= difference(&[b, a]).x
            });
            // One volume alone has its own.
            assert_eq!([CutFace::Difference, CutFace::Blend].map(|how| color_of_faces(how, color, &[a])), [color; 2]);
            let blend = color_of_faces(CutFace::Blend, color, &[a, b]);
            assert!(blend.cmpge((color * grey(a.0)).min(Vec3::ONE) - 1e-6).all() && blend.max_element() <= 1.0);
        }
    }
}
