//! What is drawn and how: one plain value that the window, the command line, sessions and tests share.

use crate::camera::Camera;
use crate::roots::Solver;
use bregma_volume::{Grid, GridError, Volume};
use glam::{DAffine3, DVec3, Vec3};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// How the surfaces of several volumes are put together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// The nearest surface.
    #[default]
    Iso,
    /// The nearest first hit transparent, the next volume's first hit opaque behind it; a lone hit is opaque.
    Overlay,
}

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
        self.0.map(|c| format!("{:02x}", (255.0 * c.clamp(0.0, 1.0)).round() as u8)).concat()
    }

    /// As light (linear RGB).
    pub(crate) fn linear(self) -> Vec3 {
        Vec3::from(self.0.map(|c| if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }))
    }
}

/// How one volume is shown.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Layer {
    /// The isovalue, in the volume's values (HU where the file says so).
    pub iso: f64,
    /// Colour of its surface.
    pub color: Color,
    /// Opacity where [`Mode::Overlay`] draws it transparent.
    pub opacity: f32,
    /// Drawn or not.
    pub visible: bool,
    /// Registration: moves the volume in the world (mm to mm), after its own grid.
    pub transform: DAffine3,
    /// Root mean square distance that the registration leaves between landmarks, mm, where it is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residual_mm: Option<f64>,
}

/// Bone ivory, then cyan and magenta, so that the first two volumes of a comparison are told apart by anyone.
const COLORS: [[f32; 3]; 4] = [[0.93, 0.88, 0.77], [0.25, 0.75, 0.85], [0.85, 0.35, 0.75], [0.95, 0.75, 0.3]];

impl Layer {
    /// The layer that the volume opens with as number `index` of `count`.
    pub fn new(volume: &Volume, index: usize, count: usize) -> Self {
        // One skull looks best as bone; in company A is cyan and B is magenta.
        let color = if count == 1 { 0 } else { 1 + index % (COLORS.len() - 1) };
        Self {
            iso: volume.default_isovalue().0,
            color: Color(COLORS[color]),
            opacity: 0.45,
            visible: true,
            transform: DAffine3::IDENTITY,
            residual_mm: None,
        }
    }
}

/// The light and how surfaces answer it (Phong 1975).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Light {
    /// Toward the light, in the camera's right, up and backward directions; need not be unit.
    pub toward: Vec3,
    /// Part of the colour that shows without light.
    pub ambient: f32,
    /// Part that shows by Lambert's law.
    pub diffuse: f32,
    /// White highlight.
    pub specular: f32,
    /// Phong's exponent.
    pub shininess: f32,
}

impl Default for Light {
    /// A lamp over the viewer's left shoulder.
    fn default() -> Self {
        Self { toward: Vec3::new(-0.4, 0.5, 1.0), ambient: 0.08, diffuse: 0.85, specular: 0.12, shininess: 24.0 }
    }
}

/// Everything that decides a picture besides the samples and the size.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// One for each volume, in order.
    pub layers: Vec<Layer>,
    /// Where it is seen from.
    pub camera: Camera,
    /// How surfaces are put together.
    pub mode: Mode,
    /// How roots are found.
    #[serde(default)]
    pub solver: Solver,
    /// The light.
    pub light: Light,
    /// Whether visible surfaces, of any layer, keep the light from others: hard shadows.
    #[serde(default)]
    pub shadows: bool,
    /// Behind everything; `None` is transparent.
    pub background: Option<Color>,
}

/// Dark blue-grey: bone stands out on it, and it prints.
pub const BACKGROUND: Color = Color([0.07, 0.08, 0.1]);

/// A volume and where the scene puts it: what every tracer takes.
#[derive(Clone, Debug)]
pub struct Surface {
    /// The scan.
    pub volume: Arc<Volume>,
    /// Its grid, moved by the layer's transform.
    pub grid: Grid,
    /// The isovalue in sample units. Pictures subtract it as float32, measurements as it is. A level outside the samples' range stays
    /// within a range's width of it, since where it lies there makes no difference, and numbers stay finite.
    pub level: f64,
    /// 1 when larger samples are inside the bone, −1 when a negative slope turns that round.
    pub sign: f32,
}

impl Surface {
    /// The isosurface of `volume` at the value `iso`, moved by `transform`.
    pub fn new(volume: &Arc<Volume>, iso: f64, transform: DAffine3) -> Result<Self, GridError> {
        let grid = volume.grid().moved(transform)?;
        let sign = if volume.slope() < 0.0 { -1.0 } else { 1.0 };
        let [low, high] = volume.histogram().range;
        let beyond = high - low + 1.0;
        let level = volume.sample_of(iso).clamp(low - beyond, high + beyond);
        Ok(Self { grid, level, sign, volume: Arc::clone(volume) })
    }
}

impl Scene {
    /// The scene that `volumes` open with, from anterior and slightly above.
    pub fn of(volumes: &[Arc<Volume>]) -> Self {
        let layers: Vec<Layer> = volumes.iter().enumerate().map(|(i, v)| Layer::new(v, i, volumes.len())).collect();
        let camera = Camera::orbit(&crate::Bounds::of(volumes.iter().map(|v| v.grid())), 0.0, 0.0);
        Self {
            layers,
            camera,
            mode: Mode::Iso,
            solver: Solver::Exact,
            light: Light::default(),
            shadows: false,
            background: Some(BACKGROUND),
        }
    }

    /// The surfaces of the visible layers with their layer numbers.
    pub fn surfaces(&self, volumes: &[Arc<Volume>]) -> Result<Vec<(usize, Surface)>, GridError> {
        let visible = self.layers.iter().zip(volumes).enumerate().filter(|(_, (layer, _))| layer.visible);
        visible.map(|(i, (layer, volume))| Ok((i, Surface::new(volume, layer.iso, layer.transform)?))).collect()
    }

    /// The direction toward the light in the world, unit.
    pub(crate) fn toward_light(&self) -> DVec3 {
        let basis = self.camera.basis();
        let l = self.light.toward.as_dvec3();
        (l.x * basis.right + l.y * basis.up - l.z * basis.forward).try_normalize().unwrap_or(-basis.forward)
    }
}

/// A picture in memory, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// sRGB with straight alpha.
    pub rgba: Vec<[u8; 4]>,
    /// Distance along the unit pixel ray to the first surface drawn, mm; NaN where none.
    pub depth_mm: Vec<f32>,
    /// 1-based layer of that surface; 0 where none.
    pub volume_id: Vec<u8>,
}
