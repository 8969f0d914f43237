//! What the tests that cross crates share: real scans, volumes made to be hard, and the comparison of a picture with the truth.

use bregma_renderer::{Picture, Scene, Surface, reference};
use bregma_volume::{Grid, Raster, Samples, Unit, Volume, WorldPoint};
use std::path::PathBuf;
use std::sync::Arc;

/// The folder of real scans, `$BREGMA_DATA`. Without it the calling test says that it is skipped; `.ci/run` counts those.
pub fn data(test: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("BREGMA_DATA").map(PathBuf::from);
    if folder.is_none() {
        println!("skipped: {test} wants real scans, and BREGMA_DATA is not set");
    }
    folder
}

/// A small deterministic generator (PCG, O'Neill 2014).
pub struct Random(pub u64);

impl Random {
    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let x = (((self.0 >> 18) ^ self.0) >> 27) as u32;
        f64::from(x.rotate_right((self.0 >> 59) as u32)) / 4_294_967_296.0
    }
}

/// A volume of the given samples.
pub fn volume(name: &str, grid: Grid, samples: Samples) -> Arc<Volume> {
    let raster = Raster { grid, samples, slope: 1.0, intercept: 0.0, unit: Unit::Value, warnings: vec![] };
    Arc::new(Volume::new(name.into(), "test", raster).expect("test volumes are whole"))
}

/// How far a picture is from the reference, over any number of pictures.
#[derive(Debug, Default)]
pub struct Exactness {
    /// Rays compared.
    pub rays: u64,
    /// Rays of the reference that hit.
    pub hits: u64,
    /// Rays where hit or miss differ, or the depth by more than 1e-3 voxel: tangent ones.
    pub tangent: u64,
    /// The same, but not tangent: each is a defect.
    pub wrong: Vec<String>,
    /// Largest |Δt| in voxels of all rays that are not tangent.
    pub worst_voxel: f64,
}

/// Depths may differ by this, in voxels along the ray, and by the rounding of the distance in mm to the float32 that a depth
/// image holds (which matters only for eyes more than 10,000 voxels away).
pub const DEPTH_TOLERANCE_VOXEL: f64 = 1e-3;

/// A ray is tangent when moving it sideways by this, in voxels, changes what the reference itself answers: hit or miss, or the
/// depth by more than the tolerance. It is what float32 positions in a brick of 8 voxels resolve (half a unit: 5e-7), ten times
/// over for the sum of roundings on the way.
pub const TANGENT_VOXEL: f64 = 1e-5;

impl Exactness {
    /// Compares the depths of `picture` with the reference, for the nearest surface of all visible layers.
    pub fn compare(&mut self, volumes: &[Arc<Volume>], scene: &Scene, picture: &Picture) {
        let surfaces: Vec<Surface> = scene.surfaces(volumes).expect("test transforms are invertible").into_iter().map(|(_, s)| s).collect();
        let (w, h) = (picture.width, picture.height);
        let rows: Vec<u32> = (0..h).collect();
        let threads = std::thread::available_parallelism().map_or(1, |n| n.get());
        let parts: Vec<Exactness> = std::thread::scope(|scope| {
            let chunks: Vec<_> = (0..threads)
                .map(|n| rows.iter().copied().skip(n).step_by(threads))
                .map(|rows| scope.spawn(|| compare_rows(&surfaces, scene, picture, rows, w)))
                .collect();
            chunks.into_iter().map(|c| c.join().expect("no comparison panics")).collect()
        });
        for part in parts {
            self.rays += part.rays;
            self.hits += part.hits;
            self.tangent += part.tangent;
            self.wrong.extend(part.wrong);
            self.worst_voxel = self.worst_voxel.max(part.worst_voxel);
        }
    }

    /// Panics unless every ray is right but for at most one tangent ray in 100,000.
    pub fn assert(&self, what: &str) {
        println!(
            "{what}: {} rays, {} hits, {} tangent, worst |dt| {:.1e} voxel, {} wrong",
            self.rays,
            self.hits,
            self.tangent,
            self.worst_voxel,
            self.wrong.len()
        );
        assert!(
            self.wrong.is_empty(),
            "{what}: {} rays are wrong, such as {:#?}",
            self.wrong.len(),
            &self.wrong[..self.wrong.len().min(5)]
        );
        assert!(self.tangent * 100_000 <= self.rays.max(100_000), "{what}: {} of {} rays are tangent", self.tangent, self.rays);
    }
}

fn compare_rows(surfaces: &[Surface], scene: &Scene, picture: &Picture, rows: impl Iterator<Item = u32>, w: u32) -> Exactness {
    let mut part = Exactness::default();
    let basis = scene.camera.basis();
    let voxel_mm = surfaces.iter().map(|s| s.grid.spacing_mm().min_element()).fold(f64::INFINITY, f64::min);
    for y in rows {
        for x in 0..w {
            let ray = scene.camera.ray(f64::from(x), f64::from(y), w, picture.height);
            let found = f64::from(picture.depth_mm[(y * w + x) as usize]);
            let nearest = |ray: &bregma_renderer::Ray| {
                let entries = surfaces.iter().filter_map(|s| reference::first_entry(s, ray));
                entries.map(|c| c.t_mm).fold(f64::NAN, f64::min)
            };
            let truth = nearest(&ray);
            part.rays += 1;
            part.hits += u64::from(!truth.is_nan());
            // Voxels per mm along the ray, of the finest volume.
            let density = surfaces.iter().map(|s| s.grid.world_to_index().transform_vector3(ray.direction).length()).fold(0.0, f64::max);
            let rounding_mm = f64::from(f32::EPSILON) / 2.0 * truth.abs();
            let off = ((found - truth).abs() - rounding_mm) * density;
            if off <= DEPTH_TOLERANCE_VOXEL || (found.is_nan() && truth.is_nan()) {
                part.worst_voxel = part.worst_voxel.max(off);
                continue;
            }
            let around: Vec<f64> = (0..8)
                .map(|n| {
                    let (sin, cos) = (f64::from(n) * std::f64::consts::FRAC_PI_4).sin_cos();
                    let aside = TANGENT_VOXEL * voxel_mm * (cos * basis.right + sin * basis.up);
                    nearest(&bregma_renderer::Ray { origin: WorldPoint(ray.origin.0 + aside), ..ray })
                })
                .collect();
            let agrees = |t: f64| (t.is_nan() && found.is_nan()) || ((t - found).abs() - rounding_mm) * density <= DEPTH_TOLERANCE_VOXEL;
            let low = around.iter().copied().fold(truth, f64::min);
            let high = around.iter().copied().fold(truth, f64::max);
            let between = (low..=high).contains(&found) && around.iter().any(|t| !t.is_nan());
            if around.iter().any(|&t| agrees(t)) || between {
                part.tangent += 1;
            } else {
                part.wrong.push(format!("pixel ({x}, {y}): depth {found} mm, reference {truth} mm, beside it {around:?}"));
            }
        }
    }
    part
}

/// Largest difference of two colours, in 1/255.
pub fn color_difference(a: [u8; 4], b: [u8; 4]) -> u8 {
    (0..4).map(|c| a[c].abs_diff(b[c])).max().unwrap_or(0)
}
