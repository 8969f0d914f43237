//! The chart of speed and accuracy, measured on the scans and the view that are open: points to click, and a picture of each one's errors.

use super::super::bench::Bench;
use super::super::job::Job;
use super::super::measured::Work;
use bregma_field::Volume;
use bregma_renderer::{Backend, Reconstruction, Solver};
use bregma_session::chart::{Chart, Measure, Plan, Point, errors, plot};
use bregma_session::{Machine, same_scans};
use egui::{
    Align, Align2, Color32, ColorImage, Context, Image, Layout, RichText, ScrollArea, Sense, TextureHandle, TextureOptions, Ui, Window,
};
use egui_plot::{GridInput, GridMark, HoverPosition, Line, MarkerShape, Plot, PlotPoint, Points, Text};
use std::sync::Arc;

/// The chart's window.
#[derive(Default)]
pub struct ChartPanel {
    /// On the screen.
    pub open: bool,
    job: Option<Job<Chart>>,
    chart: Option<Chart>,
    measure: Measure,
    /// Number of the point whose errors are shown, and they.
    selected: Option<(usize, TextureHandle)>,
    /// The scans that all this is of.
    volumes: Vec<Arc<Volume>>,
}

/// Most pixels across or down: enough to see errors, few enough to wait for.
const MOST_PIXELS: u32 = 512;
/// Times that each solver is timed.
const ROUNDS: u32 = 3;

impl ChartPanel {
    /// The measurement, when there is one.
    pub fn chart(&self) -> Option<&Chart> {
        self.chart.as_ref()
    }

    /// The point whose errors are shown.
    pub fn selected(&self) -> Option<&Point> {
        self.chart.as_ref()?.points.get(self.selected.as_ref()?.0)
    }

    /// Takes what the thread brought, and forgets what is of other scans than `volumes`; `Err` is a sentence for the person.
    pub fn poll(&mut self, volumes: &[Arc<Volume>]) -> Result<(), String> {
        if !same_scans(&self.volumes, volumes) {
            (self.job, self.chart, self.selected, self.volumes) = (None, None, None, volumes.to_vec());
        }
        let Some(result) = self.job.as_ref().and_then(Job::poll) else { return Ok(()) };
        self.job = None;
        self.chart = Some(result.map_err(|e| format!("The solvers were not measured: {e}"))?);
        self.selected = None;
        Ok(())
    }

    /// Shows the window, if it is open. A clicked point switches the picture to its solver, if what draws the picture has that.
    pub fn show(&mut self, ctx: &Context, bench: &mut Bench) {
        if !self.open {
            return;
        }
        let painted = bench.view.painted.as_ref();
        let size = painted.map(|p| [p.picture.width, p.picture.height].map(|n| n * p.reduction));
        let on_gpu = painted.is_some_and(|p| p.backend == Backend::Gpu);
        let (mut open, work) = (self.open, &mut bench.work);
        let window = Window::new("Speed and accuracy").open(&mut open).default_size([860.0, 560.0]).default_pos([400.0, 200.0]);
        window.show(ctx, |ui| self.contents(ui, work, size, on_gpu));
        self.open = open;
    }

    fn contents(&mut self, ui: &mut Ui, work: &mut Work, size: Option<[u32; 2]>, on_gpu: bool) {
        if let Some(job) = &self.job {
            if job.ui(ui) {
                self.job = None;
            }
        } else {
            ui.horizontal(|ui| {
                let can = size.is_some() && !work.opened.volumes.is_empty();
                let button = ui.add_enabled(can, egui::Button::new("Measure this view"));
                if let (true, Some(size)) =
                    (button.on_hover_text("Time every solver on the scans and the view that are open").clicked(), size)
                {
                    self.job = Some(start(ui.ctx(), work, size));
                }
                ui.weak("every solver, timed and held to the float64 reference; a click draws by it and shows its errors");
            });
        }
        let Some(chart) = self.chart.take() else { return };
        let mut clicked = None;
        ui.horizontal(|ui| {
            ui.radio_value(&mut self.measure, Measure::Depth, "Depth error");
            ui.radio_value(&mut self.measure, Measure::Wrong, "Wrong rays")
                .on_hover_text("Missed, false, or more than a ten-thousandth of a voxel off");
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let [w, h] = chart.size;
                ui.weak(format!("{}, {w}×{h} pixels", chart.scans));
            });
        });
        let (measure, selected) = (self.measure, self.selected.as_ref().map(|s| s.0));
        ui.horizontal_top(|ui| {
            let errors_width = if self.selected.is_some() { 330.0 } else { 0.0 };
            let plot_size = egui::vec2((ui.available_width() - errors_width).max(240.0), (ui.available_height() * 0.6).max(220.0));
            ui.allocate_ui(plot_size, |ui| clicked = draw(ui, &chart, measure, selected));
            if let (Some((n, texture)), Some(point)) = (&self.selected, selected.and_then(|n| chart.points.get(n))) {
                ui.push_id(n, |ui| ui.vertical(|ui| error_picture(ui, texture, point)));
            }
        });
        ui.separator();
        clicked = rows(ui, &chart, selected).or(clicked);
        if let Some(n) = clicked {
            let point = &chart.points[n];
            if on_gpu || point.solver.on_cpu() {
                (work.opened.scene.solver, work.opened.scene.reconstruction) = (point.solver, Reconstruction::Trilinear);
            }
            let [width, height] = chart.size.map(|n| n as usize);
            let pixels = point.errors.iter().map(|&[r, g, b]| Color32::from_rgb(r, g, b)).collect();
            let texture = ui.ctx().load_texture("errors", ColorImage::new([width, height], pixels), TextureOptions::NEAREST);
            self.selected = Some((n, texture));
        }
        self.chart = Some(chart);
    }
}

fn start(ctx: &Context, work: &Work, [width, height]: [u32; 2]) -> Job<Chart> {
    let shrink = (f64::from(MOST_PIXELS) / f64::from(width.max(height))).min(1.0);
    let size = [width, height].map(|n| ((f64::from(n) * shrink).round() as u32).max(1));
    let (volumes, scene) = (work.opened.volumes.clone(), work.opened.scene.clone());
    let plan = Plan { cameras: vec![scene.camera], size, rounds: ROUNDS };
    Job::start(ctx, "Measuring".into(), move |progress| {
        let mut machines = Machine::Auto.renderers(false)?;
        Chart::measure(&volumes, &scene, &plan, &mut machines, progress)
    })
}

fn color(solver: Solver) -> Color32 {
    let [r, g, b] = plot::color(solver);
    // The black of print is the white of a dark window.
    if solver == Solver::Exact { Color32::WHITE } else { Color32::from_rgb(r, g, b) }
}

/// The ticks of the figure on an axis of logarithms, decades stronger.
fn marks(input: GridInput) -> Vec<GridMark> {
    let mark = |tick: f64| {
        let value = tick.log10();
        // A decade's logarithm is whole but for rounding.
        GridMark { value, step_size: if (value - value.round()).abs() < 1e-9 { 1.0 } else { 0.3 } }
    };
    plot::ticks(10f64.powf(input.bounds.0), 10f64.powf(input.bounds.1)).into_iter().map(mark).collect()
}

fn power(log10: f64) -> String {
    let value = 10f64.powf(log10);
    if (0.01..10_000.0).contains(&value) { format!("{}", (value * 1000.0).round() / 1000.0) } else { format!("{value:.0e}") }
}

/// The plot. Gives the point that is clicked.
fn draw(ui: &mut Ui, chart: &Chart, measure: Measure, selected: Option<usize>) -> Option<usize> {
    let (low, high) = plot::axis(chart, measure);
    let place = |p: &Point| [p.ns_per_ray.log10(), measure.of(p).clamp(low, high).log10()];
    let zero = chart.points.iter().any(|p| measure.of(p) == 0.0);
    let shown = Plot::new("chart")
        .x_axis_label("time, ns per ray")
        .y_axis_label(measure.label())
        .x_grid_spacer(marks)
        .y_grid_spacer(|input| marks(input).into_iter().filter(|mark| mark.step_size == 1.0).collect())
        .x_axis_formatter(|mark, _| power(mark.value))
        .y_axis_formatter(move |mark, _| if zero && mark.value < low.log10() + 0.5 { "0".into() } else { power(mark.value) })
        .label_formatter(|hover| match hover {
            HoverPosition::NearDataPoint { plot_name, .. } => Some((*plot_name).to_owned()),
            HoverPosition::Elsewhere { .. } => None,
        })
        .allow_scroll(false)
        .grid_color(Color32::from_gray(70))
        .set_margin_fraction(egui::vec2(0.1, 0.1))
        .show(ui, |ui| {
            let fronts: Vec<Vec<&Point>> = chart.backends().into_iter().map(|b| chart.front(b, measure)).collect();
            for front in &fronts {
                let places: Vec<[f64; 2]> = front.iter().map(|p| place(p)).collect();
                ui.line(Line::new("", places).color(Color32::from_gray(120)).allow_hover(false));
            }
            for (n, p) in chart.points.iter().enumerate() {
                let shape = if p.backend == Backend::Cpu { MarkerShape::Circle } else { MarkerShape::Square };
                let radius = if selected == Some(n) { 7.0 } else { 4.5 };
                ui.points(Points::new(name(p), place(p)).shape(shape).color(color(p.solver)).radius(radius).id(n));
                let on_front = fronts.iter().flatten().any(|q| std::ptr::eq(*q, p));
                if on_front || selected == Some(n) {
                    let [x, y] = place(p);
                    let text = RichText::new(format!("  {}", p.solver)).size(12.0);
                    ui.text(Text::new("", PlotPoint::new(x, y), text).anchor(Align2::LEFT_BOTTOM).allow_hover(false));
                }
            }
        });
    let at = shown.response.interact_pointer_pos().filter(|_| shown.response.clicked())?;
    let away = |p: &Point| {
        let [x, y] = place(p);
        shown.transform.position_from_point(&PlotPoint::new(x, y)).distance(at)
    };
    let nearest = chart.points.iter().map(away).enumerate().min_by(|a, b| a.1.total_cmp(&b.1))?;
    // As near as a finger's width of pixels: the marker and a little beside it.
    (nearest.1 < 14.0).then_some(nearest.0)
}

fn name(p: &Point) -> String {
    format!("{} on {}", p.solver, p.backend.name().to_uppercase())
}

/// All points in numbers. Gives the one that is clicked.
fn rows(ui: &mut Ui, chart: &Chart, selected: Option<usize>) -> Option<usize> {
    let mut clicked = None;
    ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
        egui::Grid::new("points").striped(true).spacing([16.0, 2.0]).show(ui, |ui| {
            for head in [
                "solver",
                "ns per ray",
                "walk / fetch / solve / shade ms",
                "missed %",
                "false %",
                "median",
                "99.9 %",
                "largest voxel",
                "normal °",
            ] {
                ui.weak(head);
            }
            ui.end_row();
            for (n, p) in chart.points.iter().enumerate() {
                let text = RichText::new(name(p));
                let is_selected = selected == Some(n);
                if ui.selectable_label(is_selected, if is_selected { text } else { text.color(color(p.solver)) }).clicked() {
                    clicked = Some(n);
                }
                let (s, d) = (&p.split, p.depth_voxel);
                ui.label(format!("{:.1}", p.ns_per_ray));
                ui.label(format!("{:.1} / {:.1} / {:.1} / {:.1}", s.walking_ms, s.fetching_ms, s.solving_ms, s.shading_ms));
                ui.label(format!("{:.4}", p.missed_percent()));
                ui.label(format!("{:.4}", p.false_percent()));
                for voxel in d.map_or([f64::NAN; 3], |d| [d.p50, d.p999, d.max]) {
                    ui.label(if voxel == 0.0 { "0".into() } else { format!("{voxel:.0e}") });
                }
                ui.label(p.normal_deg.map_or(String::new(), |q| format!("{:.2}", q.p999)));
                ui.end_row();
            }
        });
    });
    clicked
}

fn error_picture(ui: &mut Ui, texture: &TextureHandle, point: &Point) {
    ui.label(RichText::new(format!("Errors of {}", name(point))).strong());
    let size = texture.size_vec2();
    let shown = size * (310.0 / size.x).min(260.0 / size.y);
    ui.add(Image::new((texture.id(), shown)).sense(Sense::hover()).alt_text("Error picture"));
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 0.0;
        let [low, high] = errors::SCALE_VOXEL.map(f64::log10);
        ui.weak(format!("{} ", power(low)));
        for n in 0..60 {
            let [r, g, b] = errors::color(10f64.powf(low + (high - low) * f64::from(n) / 59.0));
            let (rect, _) = ui.allocate_exact_size(egui::vec2(3.0, 12.0), Sense::hover());
            ui.painter().rect_filled(rect, 0.0, Color32::from_rgb(r, g, b));
        }
        ui.weak(format!(" {} voxel", power(high)));
    });
    ui.horizontal(|ui| {
        for ([r, g, b], text) in errors::MARKS {
            let (rect, _) = ui.allocate_exact_size(egui::vec2(12.0, 12.0), Sense::hover());
            ui.painter().rect_filled(rect, 2.0, Color32::from_rgb(r, g, b));
            ui.weak(text);
        }
    });
}
