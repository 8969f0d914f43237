//! Speed against accuracy: every solver on every backend, timed on the same views of the same scan and judged by the float64 reference.
//!
//! The chart is a value: the command line writes it ([`table`], [`plot`]), the window shows it and lets points be clicked.

pub mod errors;
pub mod plot;
pub mod table;

use bregma_renderer::accuracy::{Quantiles, Tally, Truth, TruthError, Verdict};
use bregma_renderer::{Bounds, Camera, GpuError, Mode, Picture, RenderError, Renderer, Scene, Solver, Split};
use bregma_volume::{Cancelled, Progress, Volume};
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

/// A renderer that takes part.
pub struct Machine {
    /// `cpu` or `gpu`.
    pub backend: &'static str,
    /// What draws.
    pub renderer: Box<dyn Renderer>,
}

/// One solver on one backend.
#[derive(Clone, Debug)]
pub struct Point {
    /// The solver.
    pub solver: Solver,
    /// `cpu` or `gpu`.
    pub backend: &'static str,
    /// Adapter, or number of threads.
    pub adapter: String,
    /// Median time of a frame, from the request to the pixels in memory.
    pub ms_per_frame: f64,
    /// The same for each ray.
    pub ns_per_ray: f64,
    /// Where the time goes.
    pub split: Split,
    /// What the reference says of all frames.
    pub tally: Tally,
    /// Depth errors.
    pub depth_voxel: Quantiles,
    /// The same in mm.
    pub depth_mm: Quantiles,
    /// Errors of normals, degrees.
    pub normal_deg: Quantiles,
    /// Verdicts on the first view.
    pub verdicts: Vec<Verdict>,
}

impl Point {
    /// Missed surfaces, % of the rays that meet one.
    pub fn missed_percent(&self) -> f64 {
        percent(self.tally.missed, self.tally.hits)
    }

    /// Surfaces found where none is, % of the rays that meet none.
    pub fn false_percent(&self) -> f64 {
        percent(self.tally.false_hits, self.tally.rays - self.tally.hits - self.tally.tangent)
    }

    /// Missed, false, or off by more than [`WRONG_VOXEL`]: % of all rays.
    pub fn wrong_percent(&self) -> f64 {
        percent(self.tally.missed + self.tally.false_hits + self.tally.off_by(WRONG_VOXEL), self.tally.rays)
    }
}

fn percent(part: u64, whole: u64) -> f64 {
    100.0 * part as f64 / whole.max(1) as f64
}

/// A depth that is more voxels off than this is wrong. The roundings of float32 on the way to a hit add up to a tenth of it.
pub const WRONG_VOXEL: f64 = 1e-4;

/// What a point is charted by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// [`Point::wrong_percent`].
    Wrong,
    /// 99.9th percentile of the depth error, voxels.
    Depth,
}

impl Measure {
    /// Both, in the order of the chart's panels.
    pub const ALL: [Self; 2] = [Self::Wrong, Self::Depth];

    /// The measure of `point`.
    pub fn of(self, point: &Point) -> f64 {
        match self {
            Self::Wrong => point.wrong_percent(),
            Self::Depth => point.depth_voxel.p999,
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
    /// Solvers that a machine could not run, with its reason.
    pub left_out: Vec<String>,
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
}

/// What is less than this part of another value is clearly less: times vary by up to a tenth from one measurement to the next.
const CLEARLY: f64 = 0.9;

/// A solver on a machine while it is measured.
struct Run {
    machine: usize,
    solver: Solver,
    millis: Vec<f64>,
    tally: Tally,
    verdicts: Vec<Verdict>,
    failure: Option<String>,
}

/// Rows of truth that take about as long as a picture and its judgement.
const PICTURE_ROWS: u64 = 64;

impl Chart {
    /// Measures every solver on every machine. Solvers take turns within each view, so that what else the computer does falls on all.
    pub fn measure(
        volumes: &[Arc<Volume>],
        scene: &Scene,
        plan: &Plan,
        machines: &mut [Machine],
        progress: &Progress,
    ) -> Result<Self, ChartError> {
        let [width, height] = plan.size;
        let machine_solvers = |(machine, m): (usize, &Machine)| {
            let run = move |solver| Run { machine, solver, millis: vec![], tally: Tally::default(), verdicts: vec![], failure: None };
            Solver::ALL.into_iter().filter(|solver| m.backend != "cpu" || solver.on_cpu()).map(run).collect::<Vec<_>>()
        };
        let mut runs: Vec<Run> = machines.iter().enumerate().flat_map(machine_solvers).collect();
        let pictures = runs.len() as u64 * u64::from(plan.rounds + 2);
        progress.begin(plan.cameras.len() as u64 * (u64::from(height) + PICTURE_ROWS * pictures));
        // What is judged is the nearest surface, however surfaces are put together.
        let mut scene = Scene { mode: Mode::Iso, ..scene.clone() };
        for (frame, camera) in plan.cameras.iter().enumerate() {
            scene.camera = *camera;
            let truth = Truth::of(volumes, &scene, width, height, progress)?;
            // The first round compiles, uploads and is judged; it is not timed.
            for round in 0..=plan.rounds {
                for run in runs.iter_mut().filter(|run| run.failure.is_none()) {
                    scene.solver = run.solver;
                    let begun = Instant::now();
                    let drawn = machines[run.machine].renderer.render(volumes, &scene, width, height);
                    let millis = begun.elapsed().as_secs_f64() * 1e3;
                    match drawn {
                        Ok(_) if round > 0 => run.millis.push(millis),
                        Ok(picture) => run.judge(&truth, &picture, frame == 0),
                        Err(e @ RenderError::Gpu(GpuError::NoFilter { .. })) => run.failure = Some(e.to_string()),
                        Err(e) => return Err(e.into()),
                    }
                    progress.advance(PICTURE_ROWS)?;
                }
            }
        }
        scene.camera = plan.cameras[0];
        let mut chart = Self {
            scans: volumes.iter().map(|v| v.name()).collect::<Vec<_>>().join(" and "),
            isovalues: scene.layers.iter().map(|layer| layer.iso).collect(),
            frames: plan.cameras.len(),
            size: plan.size,
            points: vec![],
            left_out: vec![],
        };
        for run in runs {
            let machine = &mut machines[run.machine];
            match &run.failure {
                Some(reason) => chart.left_out.push(reason.clone()),
                None => {
                    scene.solver = run.solver;
                    let split = machine.renderer.split(volumes, &scene, width, height)?;
                    chart.points.push(run.point(machine, split, plan.size));
                    progress.advance(PICTURE_ROWS)?;
                }
            }
        }
        Ok(chart)
    }

    /// The points that no other of the same backend beats: none is at most as slow and at most as far off, and clearly better in one of the
    /// two. Fastest first.
    pub fn front(&self, backend: &str, measure: Measure) -> Vec<&Point> {
        let of_backend: Vec<&Point> = self.points.iter().filter(|p| p.backend == backend).collect();
        let key = |p: &Point| (p.ms_per_frame, measure.of(p));
        let beats = |a: (f64, f64), b: (f64, f64)| a.0 <= b.0 && a.1 <= b.1 && (a.0 < CLEARLY * b.0 || a.1 < CLEARLY * b.1);
        let mut front: Vec<&Point> = of_backend.iter().copied().filter(|p| !of_backend.iter().any(|q| beats(key(q), key(p)))).collect();
        front.sort_by(|a, b| a.ms_per_frame.total_cmp(&b.ms_per_frame));
        front
    }

    /// The backends that were measured, in order.
    pub fn backends(&self) -> Vec<&'static str> {
        let mut backends: Vec<&'static str> = self.points.iter().map(|p| p.backend).collect();
        backends.dedup();
        backends
    }
}

impl Run {
    fn judge(&mut self, truth: &Truth, picture: &Picture, keep: bool) {
        let verdicts = truth.judge(picture);
        self.tally.add(&verdicts);
        if keep {
            self.verdicts = verdicts;
        }
    }

    fn point(self, machine: &Machine, split: Split, [width, height]: [u32; 2]) -> Point {
        let ms_per_frame = Quantiles::of(self.millis).p50;
        Point {
            solver: self.solver,
            backend: machine.backend,
            adapter: machine.renderer.name(),
            ms_per_frame,
            ns_per_ray: ms_per_frame * 1e6 / (f64::from(width) * f64::from(height)),
            split,
            depth_voxel: self.tally.depth_voxel(),
            depth_mm: self.tally.depth_mm(),
            normal_deg: self.tally.normal_deg(),
            tally: self.tally,
            verdicts: self.verdicts,
        }
    }
}
