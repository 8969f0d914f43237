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
    // The eye may be in bone that was cut away.
    out_of_bone(work, Ray { origin: ray.at(entry.from_mm), ..ray }).map(Some)
}

/// So far beyond the end of a bone one is outside it, mm: far more than the rounding of where it ends.
const BEYOND_MM: f64 = 1e-6;

/// The ray begun before all bone that it would begin in, cut away or not: a length that begins where a ray does is not that of the bone.
pub fn out_of_bone(work: &Work, mut ray: Ray) -> Result<Ray, String> {
    loop {
        let back = measure(work, &Ray { direction: -ray.direction, ..ray }, false)?;
        let begun_in = back.volumes.iter().filter_map(|v| v.segments.first().filter(|s| s.from_origin));
        let inside_mm = begun_in.map(|s| s.to_mm).fold(0.0, f64::max);
        if inside_mm <= BEYOND_MM {
            return Ok(ray);
        }
        ray.origin = ray.at(-(inside_mm + BEYOND_MM));
    }
}

fn measure(work: &Work, ray: &Ray, as_cut: bool) -> Result<DifferenceRay, String> {
    record::measure(&work.opened, ray, as_cut).map_err(|e| format!("The ray cannot be cast: {e}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_renderer::Shape;
    use bregma_session::Opened;
    use glam::DVec3;

    #[test]
    fn a_click_behind_a_cut_measures_the_whole_bone_from_before_it() {
        // Fails if a ray begins at what a cut leaves, so that bone that is cut away is missing or counted from the middle on.
        let mut opened = Opened::demo(48, &Default::default()).unwrap();
        opened.scene.camera = bregma_renderer::Camera::orbit(&opened.bounds(), 0.0, 0.0);
        let mut work = Work { opened, measured: Default::default() };
        let size = [100, 100];
        let lengths = |work: &Work, ray: &Ray| {
            let found = measure(work, ray, false).unwrap();
            assert!(found.volumes.iter().flat_map(|v| &v.segments).all(|s| !s.from_origin), "{found:?}");
            found.volumes.iter().map(|v| v.segments.iter().map(|s| s.length_mm).collect::<Vec<_>>()).collect::<Vec<_>>()
        };
        let whole = lengths(&work, &cast(&work, 50.0, 40.0, size).unwrap().unwrap());
        assert!(whole.iter().all(|bones| bones.len() >= 2), "{whole:?}");
        // The front half is cut away: the occipital is seen from within.
        work.opened.scene.clips = vec![Clip::all(Shape::Plane { normal: DVec3::NEG_Y, offset_mm: 0.0 })];
        let behind = cast(&work, 50.0, 40.0, size).unwrap().unwrap();
        let same = |a: &[Vec<f64>], b: &[Vec<f64>]| a.iter().flatten().zip(b.iter().flatten()).all(|(a, b)| (a - b).abs() < 1e-6);
        let found = lengths(&work, &behind);
        assert!(same(&found, &whole) && found[0].len() == whole[0].len(), "{found:?} {whole:?}");
        // Begun in the middle of the first bone, as at a point on the face of a cut.
        let first = measure(&work, &behind, false).unwrap().volumes[0].segments[0];
        let inside = Ray { origin: behind.at(0.5 * (first.from_mm + first.to_mm)), ..behind };
        let out = out_of_bone(&work, inside).unwrap();
        assert!(same(&lengths(&work, &out), &whole));
    }
}
