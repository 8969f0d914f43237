//! Colours as people and files name them, and as light.

use glam::Vec3;
use serde::{Deserialize, Serialize};

/// An sRGB colour, 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Color(pub [f32; 3]);

impl Color {
    /// From `RRGGBB`, with or without `#`.
    pub fn from_hex(text: &str) -> Option<Self> {
        let digits = text.strip_prefix('#').unwrap_or(text);
        let number = u32::from_str_radix(digits, 16).ok().filter(|_| digits.len() == 6)?;
        Some(Self([16, 8, 0].map(|shift| (number >> shift & 255) as f32 / 255.0)))
    }

    /// As `rrggbb`.
    pub fn hex(self) -> String {
        self.bytes().map(|byte| format!("{byte:02x}")).concat()
    }

    /// Red, green and blue from 0 to 255.
    pub fn bytes(self) -> [u8; 3] {
        self.0.map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8)
    }

    /// The colour of light (linear RGB).
    pub fn of_light(light: Vec3) -> Self {
        let encoded = |c: f32| if c <= srgb::LINEAR_LIGHT { srgb::SLOPE * c } else { srgb::SCALE * c.powf(srgb::ROOT) - srgb::OFFSET };
        Self(light.to_array().map(|c| encoded(c.clamp(0.0, 1.0))))
    }

    /// What stands for a difference from −1 to 1: bone's colour in the middle, where there is none.
    pub fn diverging(difference: f32) -> Self {
        let [low, middle, high] = DIVERGING;
        let end = if difference > 0.0 { high } else { low };
        let share = difference.abs().min(1.0);
        Self([0, 1, 2].map(|n| middle[n] + (end[n] - middle[n]) * share))
    }

    /// As light (linear RGB).
    pub fn linear(self) -> Vec3 {
        Vec3::from(self.0.map(|c| if c <= srgb::LINEAR { c / srgb::SLOPE } else { ((c + srgb::OFFSET) / srgb::SCALE).powf(srgb::POWER) }))
    }
}

/// Bone ivory.
pub(crate) const BONE: [f32; 3] = [0.93, 0.88, 0.77];

/// The ends of the diverging map RdBu (Brewer 2003) about bone's colour, sRGB: told apart by people who lack a kind of cones, and both darker than it.
pub(crate) const DIVERGING: [[f32; 3]; 3] = [[0.129, 0.400, 0.674], BONE, [0.698, 0.094, 0.169]];

/// The numbers of sRGB's curve (IEC 61966-2-1): straight up to a limit, and a power behind it.
pub(crate) mod srgb {
    /// Where the straight part ends, as it is encoded and as light.
    pub const LINEAR: f32 = 0.040_45;
    pub const LINEAR_LIGHT: f32 = 0.003_130_8;
    /// How steep that is.
    pub const SLOPE: f32 = 12.92;
    /// Of the power: c = ((e + OFFSET) / SCALE) ^ POWER.
    pub const SCALE: f32 = 1.055;
    pub const OFFSET: f32 = 0.055;
    pub const POWER: f32 = 2.4;
    pub const ROOT: f32 = 1.0 / 2.4;
}

/// Colours as `rrggbb` in files.
pub(crate) mod hex {
    use super::Color;
    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    pub fn serialize<S: Serializer>(color: &Color, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&color.hex())
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Color, D::Error> {
        let text = String::deserialize(deserializer)?;
        Color::from_hex(&text).ok_or_else(|| D::Error::custom(format!("no colour RRGGBB: {text}")))
    }
}
