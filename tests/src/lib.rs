//! What the tests that cross crates share: real scans, volumes made to be hard, and the comparison of a picture with the truth.

pub mod looks;

pub use bregma_synthetic::Random;

use bregma_renderer::accuracy::{DEPTH_TOLERANCE_VOXEL, Tally, Truth, Verdict};
use bregma_renderer::{Picture, Scene};
use bregma_volume::{Grid, IndexPoint, Progress, Raster, Samples, Unit, Volume};
use glam::DVec3;
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

/// A volume of the given samples.
pub fn volume(name: &str, grid: Grid, samples: Samples) -> Arc<Volume> {
    let raster = Raster { grid, samples, slope: 1.0, intercept: 0.0, unit: Unit::Value, warnings: vec![] };
    Arc::new(Volume::new(name.into(), "test", raster).expect("test volumes are whole"))
}

/// A blurred solid with noise, sampled on a grid: bone 1000, air 0, its 50 % level at the boundary.
pub fn scanned(name: &str, grid: &Grid, seed: u64, noise: f64, distance: impl Fn(DVec3) -> f64 + Sync) -> Arc<Volume> {
    let blur_mm = 0.7 * grid.spacing_mm().max_element();
    let dims = grid.dims();
    let mut random = Random(seed);
    let gauss = |random: &mut Random| (0..12).map(|_| random.unit()).sum::<f64>() - 6.0;
    let sample = |n: usize| {
        let at = DVec3::new((n % dims[0]) as f64, (n / dims[0] % dims[1]) as f64, (n / (dims[0] * dims[1])) as f64);
        let d = distance(grid.world(IndexPoint(at)).0);
        (500.0 * erfc(d / (blur_mm * 2.0_f64.sqrt())) + noise * gauss(&mut random)) as f32
    };
    volume(name, grid.clone(), Samples::F32((0..grid.len()).map(sample).collect()))
}

/// The complementary error function by its continued series; good to 1e-7 (Numerical Recipes, erfcc), far below the noise here.
fn erfc(x: f64) -> f64 {
    let z = x.abs();
    let t = 1.0 / (1.0 + 0.5 * z);
    let poly =
        [0.170_872_77, -0.822_152_23, 1.488_515_87, -1.135_203_98, 0.278_868_07, -0.186_288_06, 0.096_784_18, 0.374_091_96, 1.000_023_68];
    let sum = poly.iter().fold(0.0, |sum, c| sum * t + c);
    let answer = t * (-z * z - 1.265_512_23 + t * sum).exp();
    if x >= 0.0 { answer } else { 2.0 - answer }
}

/// How far pictures are from the reference, over any number of them.
#[derive(Debug, Default)]
pub struct Exactness {
    /// What was compared.
    pub tally: Tally,
    /// Rays that are wrong and not tangent: each is a defect.
    pub wrong: Vec<String>,
}

impl Exactness {
    /// Compares the depths of `picture` with the reference, for the nearest surface of all visible layers.
    pub fn compare(&mut self, volumes: &[Arc<Volume>], scene: &Scene, picture: &Picture) {
        let truth = Truth::of(volumes, scene, picture.width, picture.height, &Progress::default()).expect("test transforms are invertible");
        self.judge(&truth, picture);
    }

    /// Compares the depths of `picture` with the truth about its view.
    pub fn judge(&mut self, truth: &Truth, picture: &Picture) {
        let verdicts = truth.judge(picture);
        self.tally.add(&verdicts);
        for (n, verdict) in verdicts.iter().enumerate() {
            let is_wrong = match verdict {
                Verdict::Nothing | Verdict::Tangent => false,
                Verdict::Hit(off) => f64::from(off.voxel.abs()) > DEPTH_TOLERANCE_VOXEL,
                Verdict::Missed | Verdict::False => true,
            };
            if is_wrong {
                let (x, y) = (n as u32 % picture.width, n as u32 / picture.width);
                self.wrong.push(format!("pixel ({x}, {y}): depth {} mm, reference {} mm", picture.depth_mm[n], truth.depth_mm(n)));
            }
        }
    }

    /// Panics unless every ray is right but for at most one tangent ray in 100,000.
    pub fn assert(&self, what: &str) {
        let t = &self.tally.counts;
        let (worst, wrong) = (self.tally.depth_voxel().map_or(0.0, |q| q.max), self.wrong.len());
        println!("{what}: {} rays, {} hits, {} tangent, worst |dt| {worst:.1e} voxel, {wrong} wrong", t.rays, t.hits, t.tangent);
        assert!(wrong == 0, "{what}: {wrong} rays are wrong, such as {:#?}", &self.wrong[..wrong.min(5)]);
        assert!(t.tangent * 100_000 <= t.rays.max(100_000), "{what}: {} of {} rays are tangent", t.tangent, t.rays);
    }
}

/// Largest difference of two colours, in 1/255.
pub fn color_difference(a: [u8; 4], b: [u8; 4]) -> u8 {
    (0..4).map(|c| a[c].abs_diff(b[c])).max().unwrap_or(0)
}
