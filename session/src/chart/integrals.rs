//! Speed against accuracy of direct volume rendering: steps of several lengths against the exact integral.

use super::Plan;
use super::scatter::{Figure, Mark};
use bregma_field::{Progress, Volume};
use bregma_renderer::{Backend, Integrator, Mode, Picture, Renderer, Scene};
use std::sync::Arc;
use std::time::Instant;

/// One integrator on one backend.
#[derive(Clone, Debug)]
pub struct Point {
    /// `exact`, or steps and how many points a voxel's length has.
    pub name: String,
    /// What drew.
    pub backend: Backend,
    /// Median time of a frame.
    pub ms_per_frame: f64,
    /// Difference from the exact integral on the first backend, over the pixels that show anything, in 1/255: the mean, and the largest.
    pub mean_off: f64,
    /// The largest.
    pub max_off: u8,
}

/// Points in a voxel's length that are charted.
const PER_VOXEL: [f32; 6] = [0.5, 1.0, 2.0, 4.0, 8.0, 16.0];

/// Measures all integrators on all machines over the plan's views.
pub fn measure(
    volumes: &[Arc<Volume>],
    scene: &Scene,
    plan: &Plan,
    machines: &mut [Box<dyn Renderer>],
    progress: &Progress,
) -> Result<Vec<Point>, super::ChartError> {
    let [width, height] = plan.size;
    let steps = PER_VOXEL.map(|per_voxel| (format!("steps:{per_voxel}"), Integrator::Steps { per_voxel, jitter: true }));
    let integrators: Vec<(String, Integrator)> = std::iter::once(("exact".into(), Integrator::Exact)).chain(steps).collect();
    let mut truth: Vec<Picture> = vec![];
    let mut points = vec![];
    progress.begin((machines.len() * integrators.len()) as u64);
    for machine in machines {
        for (name, integrator) in &integrators {
            let scene = Scene { mode: Mode::Dvr, integrator: *integrator, ..scene.clone() };
            let mut times = vec![];
            let (mut sum, mut count, mut max_off) = (0.0, 0_u64, 0);
            for (view, camera) in plan.cameras.iter().enumerate() {
                let scene = Scene { camera: *camera, ..scene.clone() };
                // Not counted: compiles what is compiled once.
                if view == 0 {
                    machine.render(volumes, &scene, width, height)?;
                }
                let begun = Instant::now();
                let picture = machine.render(volumes, &scene, width, height)?;
                times.push(begun.elapsed().as_secs_f64() * 1e3);
                if truth.len() == view {
                    truth.push(picture.clone());
                }
                // Backends may round the background's colour differently.
                let (own, exact) = (picture.rgba[0], truth[view].rgba[0]);
                for (a, b) in picture.rgba.iter().zip(&truth[view].rgba).filter(|(a, b)| **a != own || **b != exact) {
                    let off = (0..4).map(|c| a[c].abs_diff(b[c])).max().unwrap_or(0);
                    (sum, count, max_off) = (sum + f64::from(off), count + 1, max_off.max(off));
                }
            }
            times.sort_by(f64::total_cmp);
            let ms_per_frame = times[times.len() / 2];
            points.push(Point {
                name: name.clone(),
                backend: machine.backend(),
                ms_per_frame,
                mean_off: sum / count.max(1) as f64,
                max_off,
            });
            progress.advance(1)?;
        }
    }
    Ok(points)
}

/// The numbers.
pub fn csv(points: &[Point]) -> String {
    let row = |p: &Point| format!("{},{},{:.3},{:.4},{}\n", p.name, p.backend, p.ms_per_frame, p.mean_off, p.max_off);
    let rows: String = points.iter().map(row).collect();
    format!("integrator,backend,ms_per_frame,mean_difference_of_255,largest_difference_of_255\n{rows}")
}

/// The figure.
pub fn figure(points: &[Point]) -> Figure {
    let mark = |p: &Point| Mark {
        name: p.name.replace("steps:", ""),
        backend: p.backend,
        ms_per_frame: p.ms_per_frame,
        off: p.mean_off.max(NOTHING),
        is_joined: p.name != "exact",
    };
    Figure {
        caption: "Direct volume rendering: steps against the exact integral",
        off: "mean difference from exact, of 255",
        legend: "points in a voxel's length, or exact",
        marks: points.iter().map(mark).collect(),
    }
}

/// Where a difference of nothing stands: a tenth of what one pixel of a million would make of one step.
const NOTHING: f64 = 1e-3;
