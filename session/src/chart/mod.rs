//! Speed against accuracy: every solver on every backend, timed on the same views of the same scan and judged by the float64 reference.
//!
//! The chart is a value: the command line writes it ([`table`], [`plot`]), the window shows it and lets points be clicked.

pub mod errors;
pub(crate) mod fonts;
pub mod integrals;
pub mod normals;
pub mod plot;
pub mod scatter;
pub mod section;
pub mod table;

use bregma_field::{Cancelled, Progress, Volume};
use bregma_renderer::accuracy::{Counts, Quantiles, Tally, Truth, TruthError};
use bregma_renderer::{Backend, Bounds, Camera, Mode, Picture, Reconstruction, RenderError, Renderer, Scene, Solver, Split};
use std::sync::Arc;
use std::time::Instant;
use thiserror::Error;

/// What is measured.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The views.
    pub cameras: Vec<Camera>,
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Times that each view is drawn; a solver's time is the median over all.
    pub rounds: u32,
}

/// Degrees above the horizon that the orbit looks from.
pub const ORBIT_ELEVATION_DEG: f64 = 15.0;

/// The views of the orbit: `frames` of them all around.
pub fn orbit(bounds: &Bounds, frames: u32) -> Vec<Camera> {
    (0..frames).map(|f| Camera::orbit(bounds, 360.0 * f64::from(f) / f64::from(frames), ORBIT_ELEVATION_DEG)).collect()
}

/// One solver on one backend.
#[derive(Clone, Debug)]
pub struct Point {
    /// The solver.
    pub solver: Solver,
    /// What drew.
    pub backend: Backend,
    /// Adapter, or number of threads.
    pub adapter: String,
    /// Median time of a frame, from the request to the pixels in memory.
    pub ms_per_frame: f64,
    /// The same for each ray.
    pub ns_per_ray: f64,
    /// Where the time goes.
    pub split: Split,
    /// What the reference says of all frames.
    pub counts: Counts,
    /// Hits that are more than [`WRONG_VOXEL`] off.
    pub off: u64,
    /// Depth errors; `None` where nothing was hit.
    pub depth_voxel: Option<Quantiles>,
    /// The same in mm.
    pub depth_mm: Option<Quantiles>,
    /// What they do to normals, degrees.
    pub normal_deg: Option<Quantiles>,
    /// The errors of the first view in false colours, sRGB.
    pub errors: Vec<[u8; 3]>,
}

impl Point {
    /// Missed surfaces, % of the rays that meet one.
    pub fn missed_percent(&self) -> f64 {
        percent(self.counts.missed, self.counts.hits)
    }

    /// Surfaces found where none is, % of the rays that meet none.
    pub fn false_percent(&self) -> f64 {
        percent(self.counts.false_hits, self.counts.rays - self.counts.hits - self.counts.tangent)
    }

    /// Missed, false, or off by more than [`WRONG_VOXEL`]: % of all rays.
    pub fn wrong_percent(&self) -> f64 {
        percent(self.counts.missed + self.counts.false_hits + self.off, self.counts.rays)
    }
}

fn percent(part: u64, whole: u64) -> f64 {
    100.0 * part as f64 / whole.max(1) as f64
}

/// A depth that is more voxels off than this is wrong. Of `exact` 99.9 % are nearer than a tenth of it, and rays that graze the surface come
/// up to it (0.94e-4 on CThead): it is what float32 leaves.
pub const WRONG_VOXEL: f64 = 1e-4;

/// What a point is charted by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Measure {
    /// [`Point::wrong_percent`].
    Wrong,
    /// 99.9th percentile of the depth error, voxels.
    #[default]
    Depth,
}

impl Measure {
    /// Both, in the order of the chart's panels.
    pub const ALL: [Self; 2] = [Self::Wrong, Self::Depth];

    /// The measure of `point`; infinite where nothing was hit.
    pub fn of(self, point: &Point) -> f64 {
        match self {
            Self::Wrong => point.wrong_percent(),
            Self::Depth => point.depth_voxel.map_or(f64::INFINITY, |q| q.p999),
        }
    }

    /// For an axis.
    pub fn label(self) -> &'static str {
        match self {
            Self::Wrong => "missed, false, or over 1e-4 voxel off: % of rays",
            Self::Depth => "depth error, 99.9th percentile, voxels",
        }
    }
}

/// All that was measured.
#[derive(Clone, Debug)]
pub struct Chart {
    /// Names of the scans.
    pub scans: String,
    /// Isovalues in the scans' values.
    pub isovalues: Vec<f64>,
    /// Views.
    pub frames: usize,
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Solver after solver, backend by backend.
    pub points: Vec<Point>,
}

/// Why there is no chart.
#[derive(Debug, Error)]
pub enum ChartError {
    /// Stopped by request.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// No reference.
    #[error(transparent)]
    Truth(#[from] TruthError),
    /// No picture.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// Nothing to judge.
    #[error("no ray meets a surface, so there is nothing to measure; choose another isovalue or view")]
    Empty,
}

/// What is less than this part of another value is clearly less: times vary by up to a tenth from one measurement to the next.
const CLEARLY: f64 = 0.9;

/// A solver on a machine while it is measured.
struct Run {
    machine: usize,
    solver: Solver,
    millis: Vec<f64>,
    tally: Tally,
    errors: Vec<[u8; 3]>,
}

/// One frame of each run: judged where there is a `truth`, else timed.
fn draw_in_turn(
    runs: &mut [Run],
    volumes: &[Arc<Volume>],
    scene: &mut Scene,
    [width, height]: [u32; 2],
    machines: &mut [Box<dyn Renderer>],
    truth: Option<&Truth>,
    progress: &Progress,
) -> Result<(), ChartError> {
    let mut last_machine = None;
    for run in runs {
        let renderer = &mut machines[run.machine];
        scene.solver = run.solver;
        // Whose turn comes after another machine's finds caches and threads cold: a frame that is not timed warms them.
        if last_machine.replace(run.machine) != Some(run.machine) {
            renderer.render(volumes, scene, width, height)?;
        }
        let begun = Instant::now();
        let picture = renderer.render(volumes, scene, width, height)?;
        let millis = begun.elapsed().as_secs_f64() * 1e3;
        match truth {
            Some(truth) => run.judge(truth, &picture),
            None => run.millis.push(millis),
        }
        progress.advance(PICTURE_ROWS)?;
    }
    Ok(())
}

/// Rows of truth that take about as long as a picture and its judgement.
const PICTURE_ROWS: u64 = 64;

impl Chart {
    /// Measures every solver on every machine. Solvers take turns within each view, so that what else the computer does falls on all.
    pub fn measure(
        volumes: &[Arc<Volume>],
        scene: &Scene,
        plan: &Plan,
        machines: &mut [Box<dyn Renderer>],
        progress: &Progress,
    ) -> Result<Self, ChartError> {
        let [width, height] = plan.size;
        let mut runs: Vec<Run> = Vec::new();
        for (machine, renderer) in machines.iter().enumerate() {
            let solvers = Solver::ALL.into_iter().filter(|solver| renderer.has(*solver));
            runs.extend(solvers.map(|solver| Run { machine, solver, millis: vec![], tally: Tally::default(), errors: vec![] }));
        }
        let pictures = plan.cameras.len() as u64 * u64::from(plan.rounds + 1) + 1;
        progress.begin(plan.cameras.len() as u64 * u64::from(height) + PICTURE_ROWS * pictures * runs.len() as u64);
        // What is judged is the nearest surface, however surfaces are put together.
        let mut scene = Scene { mode: Mode::Iso, reconstruction: Reconstruction::Trilinear, ..scene.clone() };
        for camera in &plan.cameras {
            scene.camera = *camera;
            let truth = Truth::of(volumes, &scene, width, height, progress)?;
            // The first round compiles, uploads and is judged; it is not timed.
            for round in 0..=plan.rounds {
                let truth = (round == 0).then_some(&truth);
                draw_in_turn(&mut runs, volumes, &mut scene, plan.size, machines, truth, progress)?;
            }
        }
        if runs.iter().all(|run| run.tally.counts.hits == 0) {
            return Err(ChartError::Empty);
        }
        scene.camera = plan.cameras[0];
        let mut points = Vec::new();
        for run in runs {
            let renderer = &mut machines[run.machine];
            scene.solver = run.solver;
            let split = renderer.split(volumes, &scene, width, height)?;
            points.push(run.point(renderer.as_ref(), split, plan.size));
            progress.advance(PICTURE_ROWS)?;
        }
        Ok(Self {
            scans: volumes.iter().map(|v| v.name()).collect::<Vec<_>>().join(" and "),
            isovalues: scene.layers.iter().map(|layer| layer.iso).collect(),
            frames: plan.cameras.len(),
            size: plan.size,
            points,
        })
    }

    /// The points that no other of the same backend beats: none is at most as slow and at most as far off, and clearly better in one of the
    /// two. Fastest first.
    pub fn front(&self, backend: Backend, measure: Measure) -> Vec<&Point> {
        let of_backend: Vec<&Point> = self.points.iter().filter(|p| p.backend == backend).collect();
        let key = |p: &Point| (p.ms_per_frame, measure.of(p));
        let beats = |a: (f64, f64), b: (f64, f64)| a.0 <= b.0 && a.1 <= b.1 && (a.0 < CLEARLY * b.0 || a.1 < CLEARLY * b.1);
        let mut front: Vec<&Point> = of_backend.iter().copied().filter(|p| !of_backend.iter().any(|q| beats(key(q), key(p)))).collect();
        front.sort_by(|a, b| a.ms_per_frame.total_cmp(&b.ms_per_frame));
        front
    }

    /// The backends that were measured, in order.
    pub fn backends(&self) -> Vec<Backend> {
        let mut backends: Vec<Backend> = self.points.iter().map(|p| p.backend).collect();
        backends.dedup();
        backends
    }
}

impl Run {
    fn judge(&mut self, truth: &Truth, picture: &Picture) {
        let verdicts = truth.judge(picture);
        self.tally.add(&verdicts);
        if self.errors.is_empty() {
            self.errors = errors::pixels(&verdicts);
        }
    }

    fn point(self, renderer: &dyn Renderer, split: Split, [width, height]: [u32; 2]) -> Point {
        let ms_per_frame = Quantiles::of(self.millis).map_or(f64::NAN, |q| q.p50);
        Point {
            solver: self.solver,
            backend: renderer.backend(),
            adapter: renderer.name(),
            ms_per_frame,
            ns_per_ray: ms_per_frame * 1e6 / (f64::from(width) * f64::from(height)),
            split,
            counts: self.tally.counts,
            off: self.tally.off_by(WRONG_VOXEL),
            depth_voxel: self.tally.depth_voxel(),
            depth_mm: self.tally.depth_mm(),
            normal_deg: self.tally.normal_deg(),
            errors: self.errors,
        }
    }
}
