//! What the person measures: named rays, and landmarks on the surface; and the tool that a click is.

use bregma_field::{Registration, WorldPoint, crossings, interpolant};
use bregma_measure::mesh::onto_surface;
use bregma_measure::thickness::across;
use bregma_measure::{DifferenceRay, Edge};
use bregma_renderer::{Color, Ray, Scene, Surface};
use bregma_session::{InputError, Landmark, Measurement, Opened, Origin, same_scans};
use glam::{DAffine3, DVec3};
use std::path::Path;

/// A difference ray with its name.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedRay {
    /// What the person calls it.
    pub name: String,
    /// Its colour in the picture and the list.
    pub color: Color,
    /// Where it lies.
    pub ray: Ray,
    /// Only what cuts leave is measured; else the whole bone.
    pub as_cut: bool,
}

/// Everything that was measured.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measured {
    /// Difference rays.
    pub rays: Vec<NamedRay>,
    /// Number of the ray whose numbers are shown.
    pub selected: usize,
    /// Landmarks.
    pub landmarks: Vec<Landmark>,
    /// Number of the landmark from which on the next click looks for a missing one.
    pub wanted: Option<usize>,
}

/// What the person works on.
#[derive(Clone, Debug)]
pub struct Work {
    /// Scans, layers and view.
    pub opened: Opened,
    /// Rays and landmarks.
    pub measured: Measured,
}

impl Work {
    /// Equal but for which ray is selected, which is no work.
    pub fn same(&self, other: &Self) -> bool {
        let (a, b) = (&self.opened, &other.opened);
        let same_look =
            a.scene.camera == b.scene.camera && a.compare == b.compare && a.pair == b.pair && a.slices == b.slices && a.boxes == b.boxes;
        same_look && self.same_work(other)
    }

    /// Equal but for where it is looked from, how scans are compared, and which ray is selected.
    pub fn same_work(&self, other: &Self) -> bool {
        let (a, b) = (&self.opened, &other.opened);
        let same_scene = || Scene { camera: a.scene.camera, ..b.scene.clone() } == a.scene;
        same_scans(&a.volumes, &b.volumes)
            && a.sources.iter().map(|source| &source.labels).eq(b.sources.iter().map(|source| &source.labels))
            && same_scene()
            && a.poses == b.poses
            && a.film == b.film
            && a.measurements == b.measurements
            && self.measured.same(&other.measured)
    }

    /// Puts a scan where a registration has it, and with it the landmarks that are its own.
    pub fn place(&mut self, n: usize, registration: Registration) {
        let layer = &mut self.opened.scene.layers[n];
        let motion = registration.transform * layer.transform.inverse();
        let Registration { transform, residual_mm, covariance } = registration;
        (layer.transform, layer.residual_mm, layer.covariance) = (transform, residual_mm, covariance);
        self.measured.move_landmarks(self.opened.volumes[n].name(), &motion);
    }

    /// Puts a scan where a file of a registration has it, and gives its name.
    pub fn move_by(&mut self, file: &Path) -> Result<String, InputError> {
        let before: Vec<DAffine3> = self.opened.scene.layers.iter().map(|layer| layer.transform).collect();
        let n = self.opened.register(file)?;
        let name = self.opened.volumes[n].name().to_owned();
        self.measured.move_landmarks(&name, &(self.opened.scene.layers[n].transform * before[n].inverse()));
        Ok(name)
    }

    /// What was measured, with what it was measured on, where that is given; `rays` are what its rays found.
    pub fn records<'a>(&self, rays: impl Iterator<Item = &'a DifferenceRay>, origin: Option<&Origin>) -> Vec<Measurement> {
        let named = self.measured.rays.iter().zip(rays);
        named.map(|(named, ray)| Measurement::of_ray(ray, Some((&named.name, Some(named.color))), origin)).collect()
    }
}

/// What a click on bone does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tool {
    /// Casts a ray along the view.
    #[default]
    View,
    /// Casts a ray along the surface's inward normal.
    Normal,
    /// Casts a ray from the first to the second of two clicks.
    Points,
    /// Sets a landmark.
    Landmark,
}

impl Tool {
    /// All, in the order of the tool bar.
    pub const ALL: [Self; 4] = [Self::View, Self::Normal, Self::Points, Self::Landmark];

    /// Its name, and what it does.
    pub fn text(self) -> [&'static str; 2] {
        match self {
            Self::View => ["Ray along the view", "A click casts the difference ray along the view"],
            Self::Normal => ["Ray along the normal", "A click casts the difference ray straight into the surface, along its normal"],
            Self::Points => ["Ray through two points", "Two clicks on bone cast the difference ray through both points"],
            Self::Landmark => ["Landmark", "A click sets a landmark on the surface"],
        }
    }
}

/// Okabe and Ito's colours (2008), which the colour-blind tell apart, without those of the scans.
const COLORS: [[f32; 3]; 5] = [[1.0, 0.84, 0.31], [0.9, 0.62, 0.0], [0.34, 0.71, 0.91], [0.0, 0.62, 0.45], [0.84, 0.37, 0.0]];

impl Measured {
    /// Equal but for which ray is selected, which is no work.
    pub fn same(&self, other: &Self) -> bool {
        self.rays == other.rays && self.landmarks == other.landmarks
    }

    /// The rays and landmarks that a session brought, taken out of it; what else was measured stays there.
    pub fn of(opened: &mut Opened) -> Self {
        let mut measured = Self { landmarks: std::mem::take(&mut opened.landmarks), ..Self::default() };
        opened.measurements.retain(|measurement| {
            let Measurement::Ray(recorded) = measurement else { return true };
            let Some(ray) = recorded.ray() else { return true };
            measured.add_ray(ray);
            if let Some(last) = measured.rays.last_mut() {
                last.name = recorded.name.clone().unwrap_or(last.name.clone());
                last.color = recorded.color.unwrap_or(last.color);
                last.as_cut = recorded.is_as_cut();
            }
            false
        });
        measured
    }

    /// Moves the landmarks of a scan.
    pub fn move_landmarks(&mut self, scan: &str, motion: &DAffine3) {
        let own = self.landmarks.iter_mut().filter(|l| l.scan.as_deref() == Some(scan));
        own.filter_map(|l| l.point_mm.as_mut()).for_each(|point| *point = motion.transform_point3(*point));
    }

    /// The selected ray.
    pub fn ray(&self) -> Option<&Ray> {
        self.rays.get(self.selected).map(|named| &named.ray)
    }

    /// Adds a ray under the next free name, and selects it.
    pub fn add_ray(&mut self, ray: Ray) {
        let free = |n: &usize| !self.rays.iter().any(|r| r.name == format!("Ray {n}"));
        let n = (1..).find(free).unwrap_or(1);
        self.rays.push(NamedRay { name: format!("Ray {n}"), color: Color(COLORS[(n - 1) % COLORS.len()]), ray, as_cut: false });
        self.selected = self.rays.len() - 1;
    }

    /// Removes the selected ray.
    pub fn remove_ray(&mut self) {
        if self.selected < self.rays.len() {
            self.rays.remove(self.selected);
            self.selected = self.selected.min(self.rays.len().saturating_sub(1));
        }
    }

    /// Number of the missing landmark that a click on `scan` sets: the wanted one, or else the first that may be of that scan.
    pub fn next_landmark(&self, scan: &str) -> Option<usize> {
        let is_missing =
            |n: usize| self.landmarks.get(n).is_some_and(|l| l.point_mm.is_none() && l.scan.as_ref().is_none_or(|s| s == scan));
        let from = self.wanted.unwrap_or(0);
        (from..self.landmarks.len()).chain(0..from).find(|n| is_missing(*n))
    }

    /// Sets the next missing landmark of `scan`, or adds one under the next free name where none is missing.
    pub fn set_landmark(&mut self, point_mm: DVec3, scan: &str) {
        if let Some(n) = self.next_landmark(scan) {
            self.landmarks[n].point_mm = Some(point_mm);
            self.wanted = Some(n + 1);
            return;
        }
        let free = |n: &usize| !self.landmarks.iter().any(|l| l.name == format!("L{n}"));
        let n = (1..).find(free).unwrap_or(1);
        self.landmarks.push(Landmark { scan: Some(scan.to_owned()), ..Landmark::at(format!("L{n}"), point_mm) });
    }
}

/// The point of the nearest visible surface on a ray, or of that of the layer `only`, with that surface.
pub fn picked(work: &Work, only: Option<usize>, ray: &Ray) -> Result<Option<(Surface, WorldPoint)>, String> {
    let surfaces = work.opened.scene.surfaces(&work.opened.volumes).map_err(|e| e.to_string())?;
    let hits = surfaces
        .into_iter()
        .filter(|(n, _)| only.is_none_or(|only| only == *n))
        .filter_map(|(_, s)| crossings::first_entry(&s, ray).map(|c| (c.t_mm, s)));
    let nearest = hits.min_by(|a, b| a.0.total_cmp(&b.0));
    Ok(nearest.map(|(t_mm, surface)| (surface, ray.at(t_mm))))
}

/// A normal ray begins so far before the surface, mm, or halfway to the bone before it: its first bone is the one that was clicked.
const BEFORE_MM: f64 = 2.0;
/// What lies before a surface is looked for from so far outside, in voxels: not at the surface itself.
const START_VOXEL: f64 = 0.1;

/// The ray straight into a surface at a point of it, whatever of the bone there is cut away.
pub fn normal_ray(surface: &Surface, point: WorldPoint) -> Option<Ray> {
    let surface = &surface.clone().cut(&[], 0);
    let smooth = interpolant::smooth_normal(surface, surface.grid.index(point))?;
    // Where samples are coarse for the edge, central differences are off by degrees, and the fitted edge is not.
    let half_wall_mm = across(surface, point.0, smooth).map_or(f64::INFINITY, |wall| 0.5 * wall.there_mm);
    let edge = Edge::at(surface, point.0, smooth, half_wall_mm, f64::INFINITY);
    let normal = edge.map_or(smooth, |edge| edge.normal);
    // What lies before the surface, and is nearer than that, is not in the ray.
    let before_mm = crossings::first_entry(
        surface,
        &Ray::new(WorldPoint(point.0 + START_VOXEL * surface.grid.spacing_mm().min_element() * normal), normal)?,
    )
    .map_or(BEFORE_MM, |other| BEFORE_MM.min(0.5 * other.t_mm));
    Ray::new(WorldPoint(point.0 + before_mm * normal), -normal)
}

/// A picked point brought onto the surface to float64 precision, whatever the way it was picked.
pub fn landmark_at(surface: &Surface, point: WorldPoint) -> DVec3 {
    // Half a voxel: the point lies on the surface but for rounding.
    let reach_mm = 0.5 * surface.grid.spacing_mm().min_element();
    onto_surface(surface, point, reach_mm).map_or(point.0, |c| surface.grid.world(c.point).0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_this_version_does_not_know_stays_in_the_session() {
        // Fails if saving a session loses what another version measured, or a ray loses its name or colour.
        let ray = r#"{"color":"102030","name":"mine","ray":{"direction":[0.0,1.0,0.0],"origin_mm":[1.0,2.0,3.0]}}"#;
        let unknown = r#"{"area_mm2":1.25,"kind":"islands"}"#;
        let mut opened = Opened::new(vec![], vec![]);
        opened.measurements = [ray, unknown].map(|text| serde_json::from_str(text).unwrap()).into();
        let measured = Measured::of(&mut opened);
        assert_eq!((measured.rays[0].name.as_str(), measured.rays[0].color.bytes()), ("mine", [16, 32, 48]));
        assert_eq!(opened.measurements.iter().map(Measurement::to_string).collect::<Vec<_>>(), [unknown]);
    }
}
