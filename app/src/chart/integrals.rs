//! Speed against accuracy of direct volume rendering: steps of several lengths against the exact integral.

use super::Plan;
use super::plot::{FONT, PNG_SCALE, fonts};
use bregma_renderer::{Integrator, Mode, Picture, Renderer, Scene};
use bregma_volume::{Progress, Volume};
use plotters::prelude::*;
use std::error::Error;
use std::sync::Arc;
use std::time::Instant;

/// One integrator on one backend.
#[derive(Clone, Debug)]
pub struct Point {
    /// `exact`, or steps and how many points a voxel's length has.
    pub name: String,
    /// `cpu` or `gpu`.
    pub backend: &'static str,
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
            let scene = Scene { mode: Mode::Dvr, integrator: *integrator, transparent: false, ..scene.clone() };
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

/// Width and height of the figure, in its own units.
const SIZE: (u32, u32) = (760, 560);

/// The figure as SVG.
pub fn svg(points: &[Point]) -> Result<String, Box<dyn Error>> {
    fonts();
    let mut text = String::new();
    draw(&SVGBackend::with_string(&mut text, SIZE).into_drawing_area(), points, 1)?;
    Ok(text)
}

/// The figure as RGB pixels, row by row, with its width and height.
pub fn pixels(points: &[Point]) -> Result<(Vec<u8>, u32, u32), Box<dyn Error>> {
    fonts();
    let (width, height) = (SIZE.0 * PNG_SCALE, SIZE.1 * PNG_SCALE);
    let mut rgb = vec![0; (width * height * 3) as usize];
    draw(&BitMapBackend::with_buffer(&mut rgb, (width, height)).into_drawing_area(), points, PNG_SCALE as i32)?;
    Ok((rgb, width, height))
}

/// Where a difference of nothing stands: a tenth of what one pixel of a million would make of one step.
const NOTHING: f64 = 1e-3;

fn draw<DB: DrawingBackend>(root: &DrawingArea<DB, plotters::coord::Shift>, points: &[Point], scale: i32) -> Result<(), Box<dyn Error>>
where
    DB::ErrorType: 'static,
{
    root.fill(&WHITE)?;
    let font = |size: i32| (FONT, size * scale).into_font();
    let times = || points.iter().map(|p| p.ms_per_frame);
    let (fast, slow) = (times().fold(f64::INFINITY, f64::min) / 1.4, times().fold(0.0, f64::max) * 1.6);
    let most = points.iter().map(|p| p.mean_off).fold(1.0, f64::max) * 1.6;
    let mut chart = ChartBuilder::on(root)
        .caption("Direct volume rendering: steps against the exact integral", font(20))
        .margin(14 * scale)
        .x_label_area_size(44 * scale)
        .y_label_area_size(64 * scale)
        .build_cartesian_2d((fast..slow).log_scale(), (NOTHING / 1.5..most).log_scale())?;
    chart
        .configure_mesh()
        .x_labels(6)
        .x_desc("ms a frame")
        .y_desc("mean difference from exact, of 255")
        .label_style(font(15))
        .axis_desc_style(font(16))
        .light_line_style(TRANSPARENT)
        .draw()?;
    for (backend, color) in [("cpu", RGBColor(0, 114, 178)), ("gpu", RGBColor(213, 94, 0))] {
        let own: Vec<&Point> = points.iter().filter(|p| p.backend == backend).collect();
        if own.is_empty() {
            continue;
        }
        let place = |p: &Point| (p.ms_per_frame, p.mean_off.max(NOTHING));
        let is_steps = |p: &&&Point| p.name != "exact";
        chart.draw_series(LineSeries::new(own.iter().filter(is_steps).map(|p| place(p)), color.stroke_width(scale as u32)))?;
        let named = own.iter().map(|p| {
            let text = Text::new(p.name.replace("steps:", ""), (8 * scale, -6 * scale), font(14));
            EmptyElement::at(place(p)) + Circle::new((0, 0), 4 * scale, color.filled()) + text
        });
        chart
            .draw_series(named)?
            .label(format!("{backend}; points in a voxel's length, or exact"))
            .legend(move |(x, y)| Circle::new((x + 10 * scale, y), 4 * scale, color.filled()));
    }
    chart.configure_series_labels().label_font(font(15)).background_style(WHITE.mix(0.8)).draw()?;
    root.present()?;
    Ok(())
}
