//! Light of a photographer's studio: lamps, sky, ground, and how bright and smooth the picture is.

use crate::camera::Camera;
use crate::color::Color;
use crate::named;
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

named! {
    /// What a lamp's direction is told from.
    #[derive(Default)]
    pub enum Follows {
        /// The camera: azimuth 0 is over the viewer's shoulder, −90 from the left of the picture, elevation 90 from its top.
        #[default]
        Camera = "camera",
        /// The skull: azimuth 0 is before the face, 90 at its left side, elevation 90 over the head, as of an orbit.
        Skull = "skull",
    }
}

/// A bright disc that faces the bone. It keeps no light from anything, and the camera does not see it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lamp {
    /// Around the bone, degrees.
    pub azimuth_deg: f64,
    /// Above it, degrees.
    pub elevation_deg: f64,
    /// What that is told from.
    #[serde(default)]
    pub follows: Follows,
    /// From the bone's middle, in radii of the bone.
    pub distance: f64,
    /// The angle that its diameter is seen under from the bone's middle, degrees: small for sharp shadows.
    pub size_deg: f64,
    /// Its colour.
    #[serde(with = "crate::color::hex")]
    pub color: Color,
    /// White paper at the bone's middle that faces it would be so bright: 1 is white.
    pub strength: f32,
}

/// Light from everywhere, that nothing but bone and ground keeps away; from `below` at the nadir to `above` at the zenith.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sky {
    /// Colour of the zenith.
    #[serde(with = "crate::color::hex")]
    pub above: Color,
    /// Colour of the nadir.
    #[serde(with = "crate::color::hex")]
    pub below: Color,
    /// Brightness: under a white sky of 1 white paper is white.
    pub strength: f32,
}

/// What the bone stands on, at its lowest crossing along the camera's up.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum Ground {
    /// Nothing.
    None,
    /// A plane that curves up behind into a wall: all of the picture.
    Sweep {
        /// Its colour.
        #[serde(with = "crate::color::hex")]
        color: Color,
    },
    /// A plane that is seen only where light is kept from it: a shadow on any background.
    Catcher,
}

named! {
    /// How light becomes the colours of a display.
    #[derive(Default)]
    pub enum Tone {
        /// Khronos PBR Neutral: colours as they are up to 0.8, brighter ones pressed together and paler.
        #[default]
        Neutral = "neutral",
        /// As they are; what is brighter than white is white.
        Linear = "linear",
    }
}

/// How a scene is lit where it is path-traced.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Studio {
    /// Each adds its light.
    pub lamps: Vec<Lamp>,
    /// Light from everywhere.
    pub sky: Sky,
    /// What the bone stands on.
    pub ground: Ground,
    /// Of all surfaces of bone: 0 dry, 1 varnished.
    #[serde(default)]
    pub gloss: f32,
    /// Brighter by so many powers of two.
    #[serde(default)]
    pub exposure_ev: f32,
    /// How light becomes colours.
    #[serde(default)]
    pub tone: Tone,
    /// Width (standard deviation) of the Gaussian that samples are smoothed by for this picture alone, voxels: 0 is the measured surface.
    #[serde(default)]
    pub smooth_voxel: f64,
    /// How many surfaces light comes over to the one that is seen, at most.
    #[serde(default = "all_bounces")]
    pub bounces: u32,
}

/// So many that chance ends every path before.
fn all_bounces() -> u32 {
    1000
}

/// The widest smoothing: more would be another bone.
pub const MOST_SMOOTH_VOXEL: f64 = 1.0;
/// Lamps that a scene may have.
pub const MOST_LAMPS: usize = 16;

/// What of a studio no renderer could draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum StudioError {
    /// A lamp that is none.
    #[error(
        "a lamp of the studio light is nowhere, has a size that is not between 0 and 120 degrees or a strength that is not between 0 and 1e6"
    )]
    Lamp,
    /// Too many.
    #[error("the studio light has more than 16 lamps")]
    Lamps,
    /// Other numbers beyond what they can be.
    #[error("of the studio light sky and exposure must be numbers, gloss 0 to 1, smooth_voxel 0 to 1")]
    Numbers,
    /// A scene without.
    #[error("the scene has no studio light; give it one by --studio")]
    Absent,
    /// A way of drawing that has no surface to light.
    #[error(
        "studio light is for opaque surfaces: use --mode iso or overlay, without --reconstruction and --solver, and cuts that show bone"
    )]
    Mode,
}

impl Studio {
    /// Whether it can be drawn.
    pub fn check(&self) -> Result<(), StudioError> {
        let strength = |v: f32| (0.0..=1e6).contains(&v);
        let is_lamp = |lamp: &Lamp| {
            let angles = [lamp.azimuth_deg, lamp.elevation_deg].iter().all(|angle| angle.is_finite());
            let place = (1e-3..=1e6).contains(&lamp.distance) && lamp.size_deg > 0.0 && lamp.size_deg <= 120.0;
            angles && place && strength(lamp.strength)
        };
        let share = |v: f32| (0.0..=1.0).contains(&v);
        let smooth = (0.0..=MOST_SMOOTH_VOXEL).contains(&self.smooth_voxel);
        let numbers = strength(self.sky.strength) && share(self.gloss) && smooth && self.exposure_ev.abs() <= 32.0;
        let flaws = [
            (!self.lamps.iter().all(is_lamp), StudioError::Lamp),
            (self.lamps.len() > MOST_LAMPS, StudioError::Lamps),
            (!numbers, StudioError::Numbers),
        ];
        flaws.into_iter().find(|(is_flawed, _)| *is_flawed).map_or(Ok(()), |(_, flaw)| Err(flaw))
    }
}

impl Sky {
    /// The same from everywhere.
    pub fn even(color: Color, strength: f32) -> Self {
        Self { above: color, below: color, strength }
    }
}

impl Lamp {
    /// The unit direction from the bone toward it, where the camera looks along these axes.
    pub(crate) fn toward(&self, axes: [DVec3; 3]) -> DVec3 {
        let [right, up, back] = self.follows.axes(axes);
        let ((sin_az, cos_az), (sin_el, cos_el)) = (self.azimuth_deg.to_radians().sin_cos(), self.elevation_deg.to_radians().sin_cos());
        cos_el * (sin_az * right + cos_az * back) + sin_el * up
    }

    /// The unit direction toward it as a camera sees it: its parts to the right, up and toward the viewer.
    pub fn seen_from(&self, camera: &Camera) -> DVec3 {
        let toward = self.toward(axes_of(camera));
        DVec3::from(axes_of(camera).map(|axis| toward.dot(axis)))
    }

    /// Puts it where a camera sees it so; it goes on following what it follows.
    pub fn put(&mut self, seen: DVec3, camera: &Camera) {
        let [x, y, z] = axes_of(camera);
        let toward = (seen.x * x + seen.y * y + seen.z * z).normalize_or(z);
        let [right, up, back] = self.follows.axes([x, y, z]);
        self.azimuth_deg = toward.dot(right).atan2(toward.dot(back)).to_degrees();
        self.elevation_deg = toward.dot(up).clamp(-1.0, 1.0).asin().to_degrees();
    }
}

impl Follows {
    /// To the right, up and toward the viewer of what it is, where the camera's are these.
    fn axes(self, camera: [DVec3; 3]) -> [DVec3; 3] {
        match self {
            Self::Camera => camera,
            Self::Skull => [DVec3::X, DVec3::Z, DVec3::NEG_Y],
        }
    }
}

/// To the right, up and toward the viewer.
fn axes_of(camera: &Camera) -> [DVec3; 3] {
    let basis = camera.basis();
    [basis.right, basis.up, -basis.forward]
}

named! {
    /// Ready-made studios.
    pub enum Preset {
        /// For a journal: one lamp from the upper left, a sky that fills, light reflected from below, no ground.
        Journal = "journal",
        /// For a wall: a dark sweep, a warm key light from the upper left, a cool rim from behind.
        Museum = "museum",
        /// A small lamp that rakes the surface at 15 degrees: the most of relief, and of the sampling's steps.
        Relief = "relief",
        /// The sky alone: bright where much of it is seen, dark in what is deep.
        Sky = "sky",
    }
}

impl Preset {
    /// What it stands for.
    pub fn studio(self) -> Studio {
        let lamp = |azimuth_deg, elevation_deg, size_deg, color: [f32; 3], strength| Lamp {
            azimuth_deg,
            elevation_deg,
            follows: Follows::Camera,
            distance: 5.0,
            size_deg,
            color: Color(color),
            strength,
        };
        let white = Color([1.0; 3]);
        let base = Studio {
            lamps: vec![],
            sky: Sky::even(white, 1.0),
            ground: Ground::None,
            gloss: 0.0,
            exposure_ev: 0.0,
            tone: Tone::Neutral,
            smooth_voxel: 0.0,
            bounces: all_bounces(),
        };
        match self {
            Self::Journal => Studio {
                lamps: vec![lamp(-45.0, 45.0, 16.0, [1.0; 3], 0.86)],
                sky: Sky { above: white, below: Color([0.88, 0.87, 0.86]), strength: 0.36 },
                ..base
            },
            Self::Museum => Studio {
                lamps: vec![lamp(-50.0, 44.0, 26.0, [1.0, 0.975, 0.94], 1.3), lamp(128.0, 22.0, 20.0, [0.8, 0.9, 1.0], 1.1)],
                sky: Sky::even(Color([0.78, 0.89, 1.0]), 0.15),
                ground: Ground::Sweep { color: Color([0.265, 0.255, 0.245]) },
                smooth_voxel: 0.6,
                ..base
            },
            Self::Relief => Studio {
                lamps: vec![lamp(-62.0, 15.0, 3.0, [1.0, 0.98, 0.95], 1.1)],
                sky: Sky::even(white, 0.14),
                smooth_voxel: 0.6,
                ..base
            },
            Self::Sky => Studio { sky: Sky::even(white, 1.0), bounces: 0, ..base },
        }
    }
}

/// The linear colour of light.
pub(crate) fn light_of(color: Color, strength: f32) -> Vec3 {
    color.linear() * strength
}
