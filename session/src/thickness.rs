//! How thick the bone of a scan is, over its whole surface or a patch of it.

use crate::coat::{self, Coat};
use crate::opened::Opened;
use crate::print::Legend;
use crate::thickness_picture::Scale;
use bregma_field::{Cancelled, Progress, Region, SurfaceError, Volume, WorldPoint};
use bregma_measure::mesh::Mesh;
use bregma_measure::numbers::fixed;
use bregma_measure::thickness::{self, Method, Statistics, cell_at};
use bregma_renderer::{Clip, Layer, Picture, Scene, Surface, named};
use glam::{DAffine3, DVec3};
use std::sync::Arc;
use thiserror::Error;

named! {
    /// Which thickness is mapped; a direction belongs to the first.
    #[derive(Default)]
    pub enum ThicknessMethod {
        /// Along rays of one direction.
        Ray = "ray",
        /// Along the inward normal.
        #[default]
        Normal = "normal",
        /// Of the largest inscribed sphere.
        Sphere = "sphere",
    }
}

impl ThicknessMethod {
    /// The method, along the unit vector `direction` where it needs one.
    pub fn along(self, direction: DVec3) -> Method {
        match self {
            Self::Ray => Method::Ray(direction),
            Self::Normal => Method::Normal,
            Self::Sphere => Method::Sphere,
        }
    }
}

/// A map to be made of scan number `index`.
#[derive(Clone, Debug)]
pub struct Order {
    volume: Arc<Volume>,
    iso: f64,
    transform: DAffine3,
    index: usize,
    /// Only what these leave of the surface.
    pub clips: Vec<Clip>,
    /// Which thickness.
    pub method: Method,
    /// Only so many mm around a point.
    pub patch: Option<(DVec3, f64)>,
    /// What the map is called.
    pub title: String,
}

/// Why there is no map.
#[derive(Debug, Error)]
pub enum MapError {
    /// A registration that flattens the scan.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// Stopped by request.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// No wall, or none where it was asked for.
    #[error("no thickness is known anywhere there; choose another isovalue or place")]
    Nothing,
}

/// A finished map.
#[derive(Debug)]
pub struct Map {
    /// What was measured.
    pub surface: Surface,
    /// Its points.
    pub mesh: Mesh,
    /// Thickness at each of them, mm; NaN where it is not known or not asked for.
    pub values: Vec<f32>,
    /// They in short.
    pub statistics: Statistics,
    /// Which thickness it is.
    pub title: String,
    iso: f64,
    transform: DAffine3,
}

/// A map with its colours, for the picture.
#[derive(Debug)]
pub struct ThicknessCoat {
    /// The map.
    pub map: Arc<Map>,
    /// Its colours.
    pub scale: Scale,
}

impl Coat for ThicknessCoat {
    /// Each pixel is in the colour of the cell that it shows.
    fn paint(&self, picture: &mut Picture, scene: &Scene, through: [f64; 2]) {
        self.map.paint(&self.scale, picture, scene, through);
    }

    fn color_at(&self, point: WorldPoint) -> Option<[u8; 3]> {
        let mm = self.map.value_at(point);
        (!mm.is_nan()).then(|| self.scale.color(mm))
    }

    fn told_at(&self, point: WorldPoint) -> Option<String> {
        let mm = self.map.value_at(point);
        (!mm.is_nan()).then(|| format!("thickness {} mm", fixed(f64::from(mm), 2)))
    }

    fn legend(&self) -> Legend {
        Legend::between(format!("{}, mm", self.map.title), self.scale.ends_mm, |mm| self.scale.color(mm as f32))
    }
}

impl Order {
    /// Of the whole surface of scan number `index`, which has this layer.
    pub fn new(volume: &Arc<Volume>, layer: &Layer, index: usize, method: Method, title: String) -> Self {
        let (volume, iso, transform) = (Arc::clone(volume), layer.iso, layer.transform);
        Self { volume, iso, transform, index, clips: vec![], method, patch: None, title }
    }

    /// Makes the map.
    pub fn measure(self, progress: &Progress) -> Result<Map, MapError> {
        let surface = Surface::new(&self.volume, self.iso, self.transform)?;
        let mesh = Mesh::of(&surface, progress)?;
        let mut values = thickness::map(&surface, &mesh, self.method, progress)?;
        let left = Region::of(&self.clips, self.index);
        let is_asked = |point: &DVec3| left.depth_mm(*point) >= 0.0 && self.patch.is_none_or(|(centre, mm)| point.distance(centre) <= mm);
        mesh.vertices.iter().zip(&mut values).filter(|(point, _)| !is_asked(point)).for_each(|(_, value)| *value = f32::NAN);
        let statistics = Statistics::of(&mesh, &values).ok_or(MapError::Nothing)?;
        Ok(Map { surface, mesh, values, statistics, title: self.title, iso: self.iso, transform: self.transform })
    }
}

impl Map {
    /// Number of the scan that the map is of, if that is open and its surface as it was.
    pub fn index_in(&self, opened: &Opened) -> Option<usize> {
        let index = (0..opened.volumes.len()).find(|n| opened.is_measured(*n, &self.surface.volume))?;
        let layer = opened.scene.layers.get(index)?;
        (layer.iso == self.iso && layer.transform == self.transform).then_some(index)
    }

    /// The thickness at the cell that a point lies in, mm; NaN where none is known.
    pub fn value_at(&self, point: WorldPoint) -> f32 {
        self.mesh.vertex_of(cell_at(&self.surface, point)).map_or(f32::NAN, |vertex| self.values[vertex as usize])
    }

    /// Paints a picture in the colours of the map; see [`Coat`].
    pub fn paint(&self, scale: &Scale, picture: &mut Picture, scene: &Scene, through: [f64; 2]) {
        let seen = coat::seen(picture, scene, through, |point| self.value_at(point));
        for (pixel, value) in picture.rgba.iter_mut().zip(seen) {
            if let Some(value) = value {
                coat::dye(pixel, scale.color(value));
            }
        }
    }

    /// From no thickness to what 95 % of the surface is below, mm.
    pub fn ends_mm(&self) -> [f64; 2] {
        let [.., p95] = self.statistics.quantiles_mm;
        [0.0, p95]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_field::{Grid, Raster, Samples, Unit};
    use bregma_renderer::Shape;
    use glam::DMat3;

    /// A ball of radius 8 mm about (10, 10, 10).
    fn ball() -> Arc<Volume> {
        let grid = Grid::new([21, 21, 21], DVec3::ONE, DVec3::ZERO, DMat3::IDENTITY).unwrap();
        let away = |n: usize| DVec3::new((n % 21) as f64, (n / 21 % 21) as f64, (n / 441) as f64).distance(DVec3::splat(10.0));
        let samples = Samples::F32((0..9261).map(|n| 8.0 - away(n) as f32).collect());
        let raster = Raster { grid, samples, slope: 1.0, intercept: 0.0, unit: Unit::Value, warnings: vec![] };
        Arc::new(Volume::new("ball".into(), "test", raster).unwrap())
    }

    #[test]
    fn a_map_is_of_what_is_asked() {
        // Fails if the patch or the cut is ignored or turned round.
        let order = |clips: Vec<Clip>, patch: Option<(DVec3, f64)>| {
            let volume = ball();
            let layer = Layer { iso: 0.0, ..Layer::new(&volume, 0, 1) };
            let order = Order::new(&volume, &layer, 0, Method::Normal, String::new());
            Order { clips, patch, ..order }.measure(&Progress::default())
        };
        let whole = order(vec![], None).unwrap();
        let statistics = &whole.statistics;
        assert!((statistics.mean_mm - 16.0).abs() < 0.1 && (statistics.area_mm2 / 804.0 - 1.0).abs() < 0.03, "{statistics:?}");
        // A cap of a sphere: 2πrh, where h = d²/(2r).
        let patch = order(vec![], Some((DVec3::new(10.0, 10.0, 18.0), 5.0))).unwrap().statistics.area_mm2;
        assert!((patch / 78.5 - 1.0).abs() < 0.1, "{patch}");
        let above = Shape::Plane { normal: DVec3::Z, offset_mm: 14.0 };
        let kept = order(vec![Clip::all(above)], None).unwrap().statistics.area_mm2;
        assert!((kept / 603.0 - 1.0).abs() < 0.05, "{kept}");
        assert!(order(vec![], Some((DVec3::ZERO, 1.0))).unwrap_err().to_string().contains("no thickness"));
    }
}
