//! The difference ray of a click, and what rays find in the scans as they stand.

use super::super::measured::{NamedRay, Work};
use super::super::widgets::color;
use super::threshold_curve::curve;
use bregma_field::Volume;
use bregma_measure::{DifferenceRay, Meets, Segment, VolumeRecord, profile};
use bregma_renderer::{Clip, Layer, Ray, Scene, Surface};
use bregma_session::{record, same_scans};
use egui::Color32;
use std::sync::Arc;

/// What a ray meets in the visible volumes.
#[derive(Clone, Debug)]
pub struct Found {
    /// The measurement.
    pub ray: DifferenceRay,
    /// Colour of each of its volumes.
    pub colors: Vec<Color32>,
    /// The density along it in each of them: mm and value.
    pub profiles: Vec<Vec<[f64; 2]>>,
    surfaces: Vec<Surface>,
    /// For a bone by its number, from 0, how its length depends on the isovalue in each of them.
    curves: Option<(usize, Vec<Vec<[f64; 2]>>)>,
    of: (Vec<Layer>, Vec<Clip>, Ray),
    volumes: Vec<Arc<Volume>>,
}

impl Found {
    /// Measures along all rays of the work; reuses what is `known` of those for which nothing that it depends on changed.
    pub fn refresh(mut known: Vec<Self>, work: &Work) -> Result<Vec<Self>, String> {
        let scene = &work.opened.scene;
        let same = |k: &Self, named: &NamedRay| {
            let same_scans = same_scans(&k.volumes, &work.opened.volumes) && k.of.0 == scene.layers;
            same_scans && k.of.2 == named.ray && k.ray.as_cut == named.as_cut && k.of.1 == clips_of(scene, named)
        };
        let found = |named: &NamedRay| match known.iter().position(|k| same(k, named)) {
            Some(n) => Ok(known.swap_remove(n)),
            None => Self::of(work, named),
        };
        work.measured.rays.iter().map(found).collect()
    }

    fn of(work: &Work, named: &NamedRay) -> Result<Self, String> {
        let scene = Scene { clips: clips_of(&work.opened.scene, named), ..work.opened.scene.clone() };
        let (ray, layers) = (named.ray, scene.layers.clone());
        let colors = layers.iter().filter(|l| l.visible).map(|l| color(l.color)).collect();
        let mut found = Self {
            ray: measure(work, &ray, named.as_cut)?,
            colors,
            profiles: vec![],
            surfaces: vec![],
            curves: None,
            of: (layers, scene.clips.clone(), ray),
            volumes: work.opened.volumes.clone(),
        };
        if let Some(extent) = found.shown_mm() {
            let surfaces = scene.surfaces(&work.opened.volumes).map_err(|e| e.to_string())?;
            found.profiles = surfaces.iter().map(|(_, s)| profile(s, &ray, extent, PROFILE_POINTS)).collect();
            found.surfaces = surfaces.into_iter().map(|(_, s)| s).collect();
        }
        Ok(found)
    }

    /// How the length of bone number `bone`, from 0, depends on the isovalue, in each volume; computed when it is first asked for.
    pub fn curves(&mut self, bone: usize) -> &[Vec<[f64; 2]>] {
        let known = self.curves.take().filter(|(n, _)| *n == bone);
        let computed = known.unwrap_or_else(|| {
            let of = |(surface, volume): (&Surface, &VolumeRecord)| {
                let segment = volume.segments.get(bone);
                segment.map_or(vec![], |s| curve(surface, &self.of.2, volume.iso, [s.from_mm, s.to_mm]))
            };
            (bone, self.surfaces.iter().zip(&self.ray.volumes).map(of).collect())
        });
        &self.curves.insert(computed).1
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

    /// The stretch that bars and profile show: all bone, and a little beside it.
    pub fn shown_mm(&self) -> Option<[f64; 2]> {
        let [first, last] = self.extent_mm()?;
        let margin = (last - first).max(1e-6) * 0.04;
        Some([first - margin, last + margin])
    }

    /// The point at `t_mm`.
    pub fn at(&self, t_mm: f64) -> bregma_field::WorldPoint {
        self.of.2.at(t_mm)
    }
}

/// Points of a density profile: more than a wide screen has pixels for.
const PROFILE_POINTS: usize = 1000;

/// The cuts that a ray's measurement depends on.
fn clips_of(scene: &Scene, named: &NamedRay) -> Vec<Clip> {
    if named.as_cut { scene.clips.clone() } else { vec![] }
}

/// The ray of pixel (x, y), begun where it enters the first scan, so that its millimetres count from there; `None` where it
/// meets no bone that is seen. What is measured along it is the whole bone, also what was cut away before what is seen.
pub fn cast(work: &Work, x: f64, y: f64, [width, height]: [u32; 2]) -> Result<Option<Ray>, String> {
    let ray = work.opened.scene.camera.ray(x, y, width, height);
    let meets_bone = measure(work, &ray, true)?.volumes.iter().any(|v| v.meets == Meets::Bone);
    let whole = measure(work, &ray, false)?;
    let Some(entry) = whole.ledger.first().filter(|_| meets_bone) else { return Ok(None) };
    if !whole.volumes.iter().flat_map(|v| &v.segments).any(|s| s.from_origin) {
        return Ok(Some(Ray { origin: ray.at(entry.from_mm), ..ray }));
    }
    // The eye is in bone that was cut away: the ray begins before that, where the line comes into the scans.
    let back = measure(work, &Ray { direction: -ray.direction, ..ray }, false)?;
    let entry_mm = back.ledger.last().map_or(0.0, |last| last.to_mm);
    Ok(Some(Ray { origin: ray.at(-entry_mm), ..ray }))
}

fn measure(work: &Work, ray: &Ray, as_cut: bool) -> Result<DifferenceRay, String> {
    record::measure(&work.opened, ray, as_cut).map_err(|e| format!("The ray cannot be cast: {e}"))
}
