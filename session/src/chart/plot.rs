//! The chart as a figure for print: log–log, fronts drawn, every point named; colours by Okabe and Ito (2008), which the colour-blind
//! tell apart, and never colour alone.

use super::fonts::{FONT, PNG_SCALE, fonts};
use super::{Chart, Measure, Point};
use bregma_measure::numbers::at_most;
use bregma_renderer::{Backend, Solver};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::RGBColor;
use std::error::Error;

/// Width and height of the figure, in its own units.
pub const SIZE: (u32, u32) = (1500, 720);

/// The figure as SVG.
pub fn svg(chart: &Chart) -> Result<String, Box<dyn Error>> {
    fonts();
    let mut text = String::new();
    draw(&SVGBackend::with_string(&mut text, SIZE).into_drawing_area(), chart, 1)?;
    Ok(text)
}

/// The figure as RGB pixels, row by row, with its width and height.
pub fn pixels(chart: &Chart) -> Result<(Vec<u8>, u32, u32), Box<dyn Error>> {
    fonts();
    let (width, height) = (SIZE.0 * PNG_SCALE, SIZE.1 * PNG_SCALE);
    let mut rgb = vec![0; (width * height * 3) as usize];
    draw(&BitMapBackend::with_buffer(&mut rgb, (width, height)).into_drawing_area(), chart, PNG_SCALE as i32)?;
    Ok((rgb, width, height))
}

/// The colour of a family of solvers (Okabe and Ito 2008).
pub fn color(solver: Solver) -> [u8; 3] {
    match solver {
        Solver::Exact => [0, 0, 0],
        Solver::Linear => [230, 159, 0],
        Solver::Neubauer(_) => [86, 180, 233],
        Solver::Marmitt(_) => [0, 158, 115],
        Solver::Analytic => [204, 121, 167],
        Solver::Step(_) => [213, 94, 0],
        Solver::Filter => [0, 114, 178],
    }
}

fn rgb(solver: Solver) -> RGBColor {
    let [r, g, b] = color(solver);
    RGBColor(r, g, b)
}

type Area<DB> = DrawingArea<DB, Shift>;

fn draw<DB: DrawingBackend>(root: &Area<DB>, chart: &Chart, scale: i32) -> Result<(), Box<dyn Error>>
where
    DB::ErrorType: 'static,
{
    root.fill(&WHITE)?;
    let [w, h] = chart.size;
    // Enough digits to find the surface again by eye; the table's command has all.
    let isovalues = chart.isovalues.iter().map(|v| at_most(*v, 3)).collect::<Vec<_>>().join(", ");
    let scans: String = chart.scans.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    let views = if chart.frames == 1 { "1 view".into() } else { format!("{} views", chart.frames) };
    let title = format!("{scans}, isovalue {isovalues}: {views} of {w}×{h} pixels");
    let font = |size: i32| (FONT, size * scale).into_font();
    root.draw(&Text::new(title, (24 * scale, 14 * scale), font(22)))?;
    for (n, backend) in chart.backends().into_iter().enumerate() {
        let adapter = &chart.points.iter().find(|p| p.backend == backend).map_or("", |p| &p.adapter);
        let (x, y) = (30 * scale + n as i32 * 740 * scale, 58 * scale);
        marker(root, (x, y), backend, BLACK, scale)?;
        root.draw(&Text::new(adapter.to_string(), (x + 14 * scale, y - 10 * scale), font(16)))?;
    }
    let (_, panels) = root.split_vertically(74 * scale);
    let (left, right) = panels.split_horizontally(SIZE.0 as i32 / 2 * scale);
    for (area, measure) in [left, right].iter().zip(Measure::ALL) {
        panel(root, area, chart, measure, scale)?;
    }
    root.present()?;
    Ok(())
}

/// The powers of ten around `values` that are above 0.
fn decades(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let (low, high) =
        values.filter(|v| *v > 0.0 && v.is_finite()).fold((f64::INFINITY, 0.0_f64), |(low, high), v| (low.min(v), high.max(v)));
    (high > 0.0).then(|| (10f64.powf(low.log10().floor()), 10f64.powf(high.log10().ceil())))
}

/// The axis of a measure: its ends, of which the lower one stands for 0.
pub fn axis(chart: &Chart, measure: Measure) -> (f64, f64) {
    let values = || chart.points.iter().map(|p| measure.of(p));
    let (low, high) = decades(values()).unwrap_or((1e-3, 1.0));
    // Nothing smaller than one ray can be wrong; 0 stands a decade below what was seen.
    if values().any(|v| v == 0.0) { (low / 10.0, high.max(low * 10.0)) } else { (low, high.max(low * 10.0)) }
}

fn panel<DB: DrawingBackend>(root: &Area<DB>, area: &Area<DB>, chart: &Chart, measure: Measure, scale: i32) -> Result<(), Box<dyn Error>>
where
    DB::ErrorType: 'static,
{
    let times = chart.points.iter().map(|p| p.ns_per_ray);
    let (fast, slow) = times.fold((f64::INFINITY, 0.0_f64), |(low, high), v| (low.min(v), high.max(v)));
    let (low, high) = axis(chart, measure);
    let mut plot = ChartBuilder::on(area)
        .margin(16 * scale)
        .x_label_area_size(52 * scale)
        .y_label_area_size(84 * scale)
        // Room for names beyond the outermost points.
        .build_cartesian_2d((fast * 0.8..slow * 1.6).log_scale(), (low * 0.6..high * 1.2).log_scale())?;
    let zero = chart.points.iter().any(|p| measure.of(p) == 0.0);
    let power = |v: &f64| {
        if zero && *v < low * 1.5 {
            return "0".into();
        }
        let exponent = v.log10().round() as i32;
        if (-3..=3).contains(&exponent) { format!("{}", 10f64.powi(exponent)) } else { format!("1e{exponent}") }
    };
    plot.configure_mesh()
        .x_desc("time, ns per ray")
        .y_desc(measure.label())
        .x_label_formatter(&|_| String::new())
        .y_label_formatter(&power)
        .axis_desc_style((FONT, 18 * scale))
        .label_style((FONT, 15 * scale))
        .bold_line_style(BLACK.mix(0.18))
        .light_line_style(BLACK.mix(0.05))
        .draw()?;
    for time in ticks(fast * 0.8, slow * 1.6) {
        let (top, bottom) = (plot.backend_coord(&(time, high * 1.2)), plot.backend_coord(&(time, low * 0.6)));
        root.draw(&PathElement::new(vec![top, bottom], BLACK.mix(0.18)))?;
        let text = if time < 1.0 { format!("{time:.1}") } else { format!("{time:.0}") };
        // Middle of the number under its line.
        let half = text.len() as i32 * 4 * scale;
        root.draw(&Text::new(text, (bottom.0 - half, bottom.1 + 6 * scale), (FONT, 15 * scale).into_font()))?;
    }
    let at = |p: &Point| (p.ns_per_ray, measure.of(p).clamp(low, high));
    let mut places = Vec::new();
    for backend in chart.backends() {
        let front: Vec<(f64, f64)> = chart.front(backend, measure).into_iter().map(at).collect();
        plot.draw_series(LineSeries::new(front, BLACK.mix(0.55).stroke_width(2 * scale as u32)))?;
        places.extend(chart.points.iter().filter(|p| p.backend == backend).map(|p| (p, plot.backend_coord(&at(p)))));
    }
    for &(p, place) in &places {
        marker(root, place, p.backend, rgb(p.solver), scale)?;
    }
    let corners: Vec<(i32, i32)> = places.iter().map(|p| p.1).collect();
    let texts: Vec<String> = places.iter().map(|p| p.0.solver.to_string()).collect();
    let (left_top, right_bottom) = (plot.backend_coord(&(fast * 0.8, high * 1.2)), plot.backend_coord(&(slow * 1.6, low * 0.6)));
    for ((text, &at), label) in texts.iter().zip(&corners).zip(labels(&texts, &corners, [left_top, right_bottom], scale)) {
        if (label.0 - at.0).abs() > 30 * scale || (label.1 - at.1).abs() > 24 * scale {
            root.draw(&PathElement::new(vec![at, (label.0, label.1 + 8 * scale)], BLACK.mix(0.3)))?;
        }
        root.draw(&Text::new(text.clone(), label, (FONT, 15 * scale).into_font()))?;
    }
    Ok(())
}

/// 1, 2 and 5 times the powers of ten between two values: decades alone are too few on an axis of times.
pub fn ticks(low: f64, high: f64) -> Vec<f64> {
    let decades = low.log10().floor() as i32..=high.log10().ceil() as i32;
    decades.flat_map(|n| [1.0, 2.0, 5.0].map(|m| m * 10f64.powi(n))).filter(|t| (low..=high).contains(t)).collect()
}

/// A filled circle for the CPU, an open square for the GPU.
fn marker<DB: DrawingBackend>(
    root: &Area<DB>,
    (x, y): (i32, i32),
    backend: Backend,
    color: RGBColor,
    scale: i32,
) -> Result<(), DrawingAreaErrorKind<DB::ErrorType>> {
    let r = 5 * scale;
    if backend == Backend::Cpu {
        return root.draw(&Circle::new((x, y), r, color.filled()));
    }
    root.draw(&Rectangle::new([(x - r, y - r), (x + r, y + r)], WHITE.filled()))?;
    root.draw(&Rectangle::new([(x - r, y - r), (x + r, y + r)], color.stroke_width(2 * scale as u32)))
}

/// Upper left corners of the names of points, so that no name covers another one or a point, and none leaves the panel: the nearest free
/// place of a few around each point.
fn labels(texts: &[String], points: &[(i32, i32)], [(left, top), (right, bottom)]: [(i32, i32); 2], scale: i32) -> Vec<(i32, i32)> {
    let (height, r) = (16 * scale, 7 * scale);
    // Boxes are x, y, width, height.
    let mut taken: Vec<(i32, i32, i32, i32)> = points.iter().map(|&(x, y)| (x - r, y - r, 2 * r, 2 * r)).collect();
    let meet =
        |a: &(i32, i32, i32, i32), b: &(i32, i32, i32, i32)| a.0 < b.0 + b.2 && b.0 < a.0 + a.2 && a.1 < b.1 + b.3 && b.1 < a.1 + a.3;
    let mut placed = Vec::new();
    for (text, &(x, y)) in texts.iter().zip(points) {
        // Letters of this font are about 0.52 of their height wide.
        let width = (text.len() as f64 * 0.52 * f64::from(15 * scale)) as i32;
        let ring = |n: i32| {
            let (dx, dy) = (9 * scale + 4 * n * scale, 13 * n * scale);
            let sides = [(x + dx, y - height / 2 - dy), (x + dx, y - height / 2 + dy), (x - dx - width, y - height / 2 - dy)];
            sides.into_iter().chain([
                (x - dx - width, y - height / 2 + dy),
                (x - width / 2, y - r - height - dy),
                (x - width / 2, y + r + dy),
            ])
        };
        let free = |&(x, y): &(i32, i32)| {
            x > left && x + width < right && y > top && y + height < bottom && !taken.iter().any(|t| meet(t, &(x, y, width, height)))
        };
        let place = (0..14).flat_map(ring).find(free).unwrap_or((x + 9 * scale, y - height / 2));
        taken.push((place.0, place.1, width, height));
        placed.push(place);
    }
    placed
}
