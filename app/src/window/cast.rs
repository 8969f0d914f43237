//! The difference ray of a click, and what it finds in the scans as they stand.

use super::history::Work;
use bregma_measure::{DifferenceRay, Segment, VolumeRecord, probe};
use bregma_renderer::{Layer, Ray};
use egui::Color32;

/// What the ray meets in the visible volumes.
#[derive(Clone, Debug)]
pub struct Found {
    /// The measurement.
    pub ray: DifferenceRay,
    /// Colour of each of its volumes.
    pub colors: Vec<Color32>,
    of: (Vec<Layer>, Ray),
}

impl Found {
    /// Measures along the work's ray; reuses `known` while nothing that it depends on changed.
    pub fn refresh(known: Option<Self>, work: &Work) -> Result<Option<Self>, String> {
        let Some(ray) = work.ray else { return Ok(None) };
        let of = (work.opened.scene.layers.clone(), ray);
        if let Some(known) = known.filter(|k| k.of == of) {
            return Ok(Some(known));
        }
        let colors = of.0.iter().filter(|l| l.visible).map(color).collect();
        Ok(Some(Self { ray: measure(work, &ray)?, colors, of }))
    }

    /// Each volume with its colour.
    pub fn volumes(&self) -> impl Iterator<Item = (&VolumeRecord, Color32)> {
        self.ray.volumes.iter().zip(self.colors.iter().copied())
    }

    /// All stretches of bone.
    pub fn segments(&self) -> impl Iterator<Item = &Segment> {
        self.ray.volumes.iter().flat_map(|v| &v.segments)
    }

    /// First and last millimetre with bone.
    pub fn extent_mm(&self) -> Option<[f64; 2]> {
        self.segments().map(|s| [s.from_mm, s.to_mm]).reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
    }

    /// The point at `t_mm`.
    pub fn at(&self, t_mm: f64) -> bregma_volume::WorldPoint {
        self.of.1.at(t_mm)
    }
}

/// The ray of pixel (x, y), begun where it enters the first scan, so that its millimetres count from there; `None` where it
/// meets no bone.
pub fn cast(work: &Work, x: f64, y: f64, [width, height]: [u32; 2]) -> Result<Option<Ray>, String> {
    let ray = work.opened.scene.camera.ray(x, y, width, height);
    let found = measure(work, &ray)?;
    let meets_bone = found.volumes.iter().any(|v| !v.segments.is_empty());
    let entry = found.ledger.first().filter(|_| meets_bone);
    Ok(entry.map(|entry| Ray { origin: ray.at(entry.from_mm), ..ray }))
}

fn measure(work: &Work, ray: &Ray) -> Result<DifferenceRay, String> {
    let shown = work.opened.volumes.iter().zip(&work.opened.scene.layers).filter(|(_, l)| l.visible);
    let (volumes, layers): (Vec<_>, Vec<_>) = shown.map(|(v, l)| (v.clone(), l.clone())).unzip();
    probe(&volumes, &layers, ray).map_err(|e| format!("The ray cannot be cast: {e}"))
}

/// The layer's colour on the screen.
pub fn color(layer: &Layer) -> Color32 {
    let [r, g, b] = bytes(layer.color);
    Color32::from_rgb(r, g, b)
}

/// An sRGB colour in bytes.
pub fn bytes(color: bregma_renderer::Color) -> [u8; 3] {
    color.0.map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8)
}
