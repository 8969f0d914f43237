//! From light to the colours of a display.

use super::batch::{CAUGHT, CHANNELS, COVERAGE, LIT, UNLIT};
use super::settings::Tone;
use crate::color::Color;
use glam::{Vec3, Vec4};

/// How sums of light become colours.
#[derive(Clone, Debug)]
pub(crate) struct Toned {
    pub tone: Tone,
    /// What light is multiplied with.
    pub exposure: f32,
}

/// Where Khronos PBR Neutral begins to press bright light together, and how pale the brightest becomes.
const START: f32 = 0.8 - 0.04;
const PALER: f32 = 0.15;

/// Khronos PBR Neutral (2024): the identity for colours of bone under the light of a studio, and a soft shoulder above.
fn neutral(light: Vec3) -> Vec3 {
    let least = light.min_element();
    // What a dielectric mirrors of a white surrounding, 4 %, is taken away.
    let offset = if least < 0.08 { least - 6.25 * least * least } else { 0.04 };
    let color = light - offset;
    let peak = color.max_element();
    if peak < START {
        return color;
    }
    let room = 1.0 - START;
    let pressed = 1.0 - room * room / (peak + room - START);
    let pale = 1.0 - 1.0 / (PALER * (peak - pressed) + 1.0);
    (color * (pressed / peak)).lerp(Vec3::splat(pressed), pale)
}

impl Toned {
    /// The linear colour of a pixel, premultiplied, and its opacity, of its sums over so many samples.
    pub fn color(&self, sums: &[f32; CHANNELS], samples: u32) -> Vec4 {
        if samples == 0 {
            return Vec4::ZERO;
        }
        let part = 1.0 / samples as f32;
        let coverage = (sums[COVERAGE] * part).min(1.0);
        let kept_away = if sums[UNLIT] > 0.0 { (1.0 - sums[LIT] / sums[UNLIT]).clamp(0.0, 1.0) } else { 0.0 };
        let alpha = (coverage + sums[CAUGHT] * part * kept_away).min(1.0);
        if coverage == 0.0 {
            return Vec4::new(0.0, 0.0, 0.0, alpha);
        }
        // A pixel that is covered in part has the colour of that part.
        let light = Vec3::new(sums[0], sums[1], sums[2]) * (part * self.exposure / coverage);
        let color = match self.tone {
            Tone::Neutral => neutral(light),
            Tone::Linear => light,
        };
        (color.clamp(Vec3::ZERO, Vec3::ONE) * coverage).extend(alpha)
    }

    /// The sRGB of a pixel on a background, 0 to 1.
    pub fn shown(&self, sums: &[f32; CHANNELS], samples: u32, background: Vec3) -> Vec3 {
        let color = self.color(sums, samples);
        Vec3::from(Color::of_light(color.truncate() + background * (1.0 - color.w)).0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_synthetic::Random;

    #[test]
    fn neutral_is_the_published_curve() {
        // Fails if a constant is another's: values of the reference implementation (Khronos ToneMapping, pbrNeutral.glsl) worked out by hand.
        assert!((neutral(Vec3::splat(0.5)) - Vec3::splat(0.46)).length() < 1e-6);
        assert!((neutral(Vec3::splat(0.04)) - Vec3::splat(6.25 * 0.04 * 0.04)).length() < 1e-6);
        // Peak 0.96: 1 − 0.24² / (0.96 + 0.24 − 0.76).
        let white = neutral(Vec3::ONE);
        assert!((white - Vec3::splat(1.0 - 0.24 * 0.24 / 0.44)).length() < 1e-6, "{white}");
        let mut r = Random(1);
        for _ in 0..1000 {
            let light = Vec3::from_array(std::array::from_fn(|_| 4.0 * r.unit() as f32));
            let (color, more) = (neutral(light), neutral(light * 1.01));
            assert!(color.cmpge(Vec3::ZERO - 1e-6).all() && color.cmplt(Vec3::ONE).all(), "{light}: {color}");
            assert!(more.max_element() >= color.max_element() - 1e-6, "more light is darker: {light}");
        }
    }

    #[test]
    fn shadows_on_a_clear_ground_are_what_light_is_missing_there() {
        // Fails if a catcher hides what covers it, or its opacity is not 1 less the share of the light that comes.
        let toned = Toned { tone: Tone::Linear, exposure: 2.0 };
        let quarter = toned.color(&[0.0, 0.0, 0.0, 0.0, 3.0, 4.0, 8.0], 8);
        assert_eq!(quarter, Vec4::new(0.0, 0.0, 0.0, 0.25));
        let half_covered = toned.color(&[0.5, 0.25, 0.0, 4.0, 2.0, 4.0, 4.0], 8);
        assert!((half_covered - Vec4::new(0.125, 0.0625, 0.0, 0.75)).length() < 1e-6, "{half_covered}");
        assert_eq!(toned.color(&[0.0; CHANNELS], 4), Vec4::ZERO);
    }
}
