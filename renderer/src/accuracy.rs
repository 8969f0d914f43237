//! How right a picture is: the depth of every pixel against the float64 reference.
//!
//! The truth about a view is worked out once and judges any number of pictures of it.

use crate::picture::Picture;
use crate::scene::Scene;
use bregma_field::{Cancelled, Progress, Ray, Surface, SurfaceError, Volume, WorldPoint, crossings, interpolant};
use glam::DVec3;
use rayon::prelude::*;
use std::sync::{Arc, OnceLock};

/// Depths may differ by this, in voxels along the ray, before a pixel is looked at for tangency.
pub const DEPTH_TOLERANCE_VOXEL: f64 = 1e-3;

/// A ray is tangent when moving it sideways by this, in voxels, changes what the reference itself answers: hit or miss, or the
/// depth by more than the tolerance. It is what float32 positions in a brick of 8 voxels resolve (half a unit: 5e-7), ten times
/// over for the sum of roundings on the way.
pub const TANGENT_VOXEL: f64 = 1e-5;

/// Pixels beside a ray that are asked when it may be tangent.
const ASIDE: usize = 8;

/// What a picture says of one pixel, judged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// Nothing is there, and nothing was found.
    Nothing,
    /// A surface is there and one was found.
    Hit(Off),
    /// A surface is there, and nothing was found.
    Missed,
    /// Nothing is there, but something was found.
    False,
    /// The answer differs, but so does the reference's own beside the ray: no float32 method can be held to it.
    Tangent,
}

/// How far a hit is from the true one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Off {
    /// Along the ray, beyond the rounding of a depth image's float32; mm, negative where found too near.
    pub mm: f32,
    /// The same in voxels of the finest volume.
    pub voxel: f32,
    /// What it does to the smooth normal, the angle between the normals at both points; `None` where the surface is a cut of the box or
    /// holds the eye.
    pub normal_deg: Option<f32>,
}

/// The surface that is nearest along a pixel's ray.
#[derive(Clone, Copy, Debug)]
struct Nearest {
    t_mm: f64,
    /// Number among the surfaces.
    surface: usize,
    /// `None` where the surface is cut there.
    normal: Option<DVec3>,
}

/// What the reference sees in every pixel of a view.
#[derive(Debug)]
pub struct Truth {
    surfaces: Vec<Surface>,
    scene: Scene,
    width: u32,
    height: u32,
    nearest: Vec<Option<Nearest>>,
    /// Depths beside a ray in mm, NaN where nothing is there; asked for when the first picture needs them.
    aside: Vec<OnceLock<Box<[f64; ASIDE]>>>,
    /// Millimetres of the smallest spacing.
    voxel_mm: f64,
}

/// Why there is no truth.
#[derive(Debug, thiserror::Error)]
pub enum TruthError {
    /// Stopped by request.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// A registration that flattens a volume, or an isovalue whose surface it has not.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
}

impl Truth {
    /// The nearest surface of all visible layers in each of `width`×`height` pixels. Progress counts rows from where it stands.
    pub fn of(volumes: &[Arc<Volume>], scene: &Scene, width: u32, height: u32, progress: &Progress) -> Result<Self, TruthError> {
        let surfaces: Vec<Surface> = scene.surfaces(volumes)?.into_iter().map(|(_, surface)| surface).collect();
        let row = |y: u32| {
            let nearest = |x: u32| nearest(&surfaces, &scene.camera.ray(f64::from(x), f64::from(y), width, height));
            let row: Vec<Option<Nearest>> = (0..width).map(nearest).collect();
            progress.advance(1).map(|()| row)
        };
        let rows: Vec<Vec<Option<Nearest>>> = (0..height).into_par_iter().map(row).collect::<Result<_, _>>()?;
        let nearest = rows.concat();
        let aside = nearest.iter().map(|_| OnceLock::new()).collect();
        let voxel_mm = surfaces.iter().map(|s| s.grid.spacing_mm().min_element()).fold(f64::INFINITY, f64::min);
        Ok(Self { surfaces, scene: scene.clone(), width, height, nearest, aside, voxel_mm })
    }

    /// The surfaces, in the order of the visible layers.
    pub fn surfaces(&self) -> &[Surface] {
        &self.surfaces
    }

    /// The ray of pixel `n`, counted row by row.
    pub fn ray(&self, n: usize) -> Ray {
        let (x, y) = (n as u32 % self.width, n as u32 / self.width);
        self.scene.camera.ray(f64::from(x), f64::from(y), self.width, self.height)
    }

    /// Depth of pixel `n` in mm along its ray; NaN where nothing is there.
    pub fn depth_mm(&self, n: usize) -> f64 {
        self.nearest[n].map_or(f64::NAN, |hit| hit.t_mm)
    }

    /// Judges a picture of the same view: a verdict for each pixel, row by row.
    ///
    /// # Panics
    /// When the picture has another size.
    pub fn judge(&self, picture: &Picture) -> Vec<Verdict> {
        assert_eq!((picture.width, picture.height), (self.width, self.height), "a picture is judged by the truth about its own view");
        (0..self.nearest.len()).into_par_iter().map(|n| self.verdict(n, f64::from(picture.depth_mm[n]))).collect()
    }

    fn verdict(&self, n: usize, found_mm: f64) -> Verdict {
        let verdict = match (self.nearest[n], found_mm.is_nan()) {
            (None, true) => return Verdict::Nothing,
            (None, false) => Verdict::False,
            (Some(_), true) => Verdict::Missed,
            (Some(hit), false) => Verdict::Hit(self.off(n, &hit, found_mm)),
        };
        let fits = matches!(verdict, Verdict::Hit(off) if f64::from(off.voxel.abs()) <= DEPTH_TOLERANCE_VOXEL);
        if !fits && self.is_tangent(n, found_mm) { Verdict::Tangent } else { verdict }
    }

    /// Voxels of the finest volume in a mm of the ray.
    fn voxels_per_mm(&self, ray: &Ray) -> f64 {
        self.surfaces.iter().map(|s| s.grid.world_to_index().transform_vector3(ray.direction).length()).fold(0.0, f64::max)
    }

    fn off(&self, n: usize, hit: &Nearest, found_mm: f64) -> Off {
        let ray = self.ray(n);
        let mm = beyond_rounding(found_mm, hit.t_mm);
        let surface = &self.surfaces[hit.surface];
        let normal_deg = hit.normal.map(|true_normal| {
            let found = interpolant::smooth_normal(surface, surface.grid.index(ray.at(found_mm))).unwrap_or(-ray.direction);
            true_normal.cross(found).length().atan2(true_normal.dot(found)).to_degrees() as f32
        });
        Off { mm: mm as f32, voxel: (mm * self.voxels_per_mm(&ray)) as f32, normal_deg }
    }

    /// Whether the reference's own answer changes beside the ray, and what was found is one of its answers there, or between two that
    /// are neighbours.
    fn is_tangent(&self, n: usize, found_mm: f64) -> bool {
        let ray = self.ray(n);
        let density = self.voxels_per_mm(&ray);
        let around = self.aside[n].get_or_init(|| Box::new(self.depths_aside(&ray)));
        let same = |a: f64, b: f64| (a.is_nan() && b.is_nan()) || (beyond_rounding(a, b) * density).abs() <= DEPTH_TOLERANCE_VOXEL;
        let truth = self.depth_mm(n);
        let mut answers: Vec<f64> = around.iter().copied().chain([truth]).filter(|t| !t.is_nan()).collect();
        answers.sort_by(f64::total_cmp);
        // Between two answers that lie on one sheet, as nearer than a voxel, there may be any other; between two sheets there is none.
        let between = |w: &[f64]| (w[0]..=w[1]).contains(&found_mm) && (w[1] - w[0]) * density <= 1.0;
        let changes = around.iter().any(|&t| !same(t, truth));
        changes && (answers.windows(2).any(between) || around.iter().any(|&t| same(found_mm, t)))
    }

    fn depths_aside(&self, ray: &Ray) -> [f64; ASIDE] {
        let basis = self.scene.camera.basis();
        std::array::from_fn(|i| {
            let (sin, cos) = (i as f64 * std::f64::consts::TAU / ASIDE as f64).sin_cos();
            let step = TANGENT_VOXEL * self.voxel_mm * (cos * basis.right + sin * basis.up);
            let aside = Ray { origin: WorldPoint(ray.origin.0 + step), ..*ray };
            nearest(&self.surfaces, &aside).map_or(f64::NAN, |hit| hit.t_mm)
        })
    }
}

/// Found minus true depth, less what float32 cannot hold: half the distance to the next number (which matters for eyes thousands of voxels
/// away).
fn beyond_rounding(found_mm: f64, true_mm: f64) -> f64 {
    let nearest = true_mm.abs() as f32;
    let (off, rounding) = (found_mm - true_mm, f64::from(nearest.next_up() - nearest) / 2.0);
    off.signum() * (off.abs() - rounding).max(0.0)
}

fn nearest(surfaces: &[Surface], ray: &Ray) -> Option<Nearest> {
    let mut nearest: Option<Nearest> = None;
    for (number, surface) in surfaces.iter().enumerate() {
        let Some(entry) = crossings::first_entry(surface, ray) else { continue };
        if nearest.is_none_or(|n| entry.t_mm < n.t_mm) {
            let is_cut = entry.clipped || entry.at_origin;
            let normal = (!is_cut).then(|| interpolant::smooth_normal(surface, entry.point).unwrap_or(-ray.direction));
            nearest = Some(Nearest { t_mm: entry.t_mm, surface: number, normal });
        }
    }
    nearest
}

/// Verdicts of any number of pictures, counted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counts {
    /// Rays judged.
    pub rays: u64,
    /// Rays that meet a surface, tangent ones aside.
    pub hits: u64,
    /// Surfaces not found.
    pub missed: u64,
    /// Surfaces found where none is.
    pub false_hits: u64,
    /// Tangent rays whose answers differ.
    pub tangent: u64,
}

/// Quantiles of errors.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Quantiles {
    /// Median.
    pub p50: f64,
    /// 99.9th percentile.
    pub p999: f64,
    /// Largest.
    pub max: f64,
}

impl Quantiles {
    /// Of `values`, in any order; `None` where there are none.
    pub fn of(mut values: Vec<f64>) -> Option<Self> {
        values.sort_by(f64::total_cmp);
        let last = values.len().checked_sub(1)?;
        let at = |part: f64| values[(last as f64 * part).round() as usize];
        Some(Self { p50: at(0.5), p999: at(0.999), max: at(1.0) })
    }
}

/// Verdicts of any number of pictures.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    /// How many there are of each.
    pub counts: Counts,
    offs: Vec<Off>,
}

impl Tally {
    /// Counts the verdicts of one more picture.
    pub fn add(&mut self, verdicts: &[Verdict]) {
        let counts = &mut self.counts;
        counts.rays += verdicts.len() as u64;
        for verdict in verdicts {
            match verdict {
                Verdict::Nothing => {}
                Verdict::Hit(off) => self.offs.push(*off),
                Verdict::Missed => counts.missed += 1,
                Verdict::False => counts.false_hits += 1,
                Verdict::Tangent => counts.tangent += 1,
            }
        }
        counts.hits = self.offs.len() as u64 + counts.missed;
    }

    /// Hits that are more than `voxel` off.
    pub fn off_by(&self, voxel: f64) -> u64 {
        self.offs.iter().filter(|off| f64::from(off.voxel.abs()) > voxel).count() as u64
    }

    /// Depth errors in mm.
    pub fn depth_mm(&self) -> Option<Quantiles> {
        Quantiles::of(self.offs.iter().map(|off| f64::from(off.mm.abs())).collect())
    }

    /// Depth errors in voxels.
    pub fn depth_voxel(&self) -> Option<Quantiles> {
        Quantiles::of(self.offs.iter().map(|off| f64::from(off.voxel.abs())).collect())
    }

    /// What depth errors alone do to normals, degrees.
    pub fn normal_deg(&self) -> Option<Quantiles> {
        Quantiles::of(self.offs.iter().filter_map(|off| off.normal_deg).map(f64::from).collect())
    }
}
