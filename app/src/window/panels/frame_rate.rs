//! The frame rate: how many pictures of one turn around what is seen come in a second.

use super::super::bench::Bench;
use super::super::job::Job;
use super::Painting;
use bregma_renderer::Named;
use bregma_session::{FrameRate, FrameRateError, Machine};
use egui::{Context, Grid, Ui, Window};

/// The panel.
#[derive(Default)]
pub struct FrameRatePanel {
    /// On the screen.
    pub is_open: bool,
    job: Option<Job<Measured>>,
    measured: Option<Measured>,
}

/// What was found, and of what.
#[derive(Clone, Debug)]
struct Measured {
    rate: FrameRate,
    adapter: String,
    /// The mode, and what of it is slow.
    look: String,
    size: [u32; 2],
}

/// Pictures of a turn: one each 5°.
const FRAMES: u32 = 72;
/// Width of the contents, in points.
const WIDTH: f32 = 340.0;

impl Measured {
    fn lines(&self) -> [[String; 2]; 3] {
        let per_s = |rate: f64| format!("{} a second", bregma_measure::numbers::significant(rate, 3));
        let FrameRate { min_per_s, mean_per_s, max_per_s } = self.rate;
        [["Slowest", &per_s(min_per_s)], ["Mean", &per_s(mean_per_s)], ["Fastest", &per_s(max_per_s)]].map(|line| line.map(str::to_owned))
    }

    fn what(&self) -> String {
        let [width, height] = self.size;
        format!("{FRAMES} pictures of {width} × {height} pixels, one each {}°, {}", 360 / FRAMES, self.look)
    }

    /// All of it, to be pasted.
    fn text(&self) -> String {
        let lines = self.lines().map(|[name, value]| format!("{name}\t{value}\n")).concat();
        format!("{lines}{}\n{}\n", self.what(), self.adapter)
    }
}

impl FrameRatePanel {
    /// Takes what the thread brought; `Err` is a sentence for the person.
    pub fn poll(&mut self) -> Result<(), String> {
        let Some(result) = self.job.as_ref().and_then(Job::poll) else { return Ok(()) };
        self.job = None;
        self.measured = Some(result.map_err(|e| format!("The frame rate was not measured: {e}"))?);
        Ok(())
    }

    /// Shows the panel, where it is open; `painting` is what is seen instead of the scene.
    pub fn show(&mut self, ctx: &Context, bench: &Bench, painting: Option<Painting>) {
        let mut open = self.is_open && !bench.is_empty();
        let window = Window::new("Frame rate").open(&mut open).default_pos([400.0, 120.0]).default_width(WIDTH).resizable(false);
        window.show(ctx, |ui| self.contents(ui, bench, painting));
        self.is_open = open;
    }

    fn contents(&mut self, ui: &mut Ui, bench: &Bench, painting: Option<Painting>) {
        ui.set_width(WIDTH);
        if let Some(job) = &self.job {
            if job.ui(ui) {
                self.job = None;
            }
            return;
        }
        ui.label("Draws one turn around what is seen now.");
        let size = bench.view.painted.as_ref().map(|p| [p.picture.width, p.picture.height].map(|n| n * p.reduction));
        if let (true, Some(size)) = (ui.add_enabled(size.is_some(), egui::Button::new("Measure one turn")).clicked(), size) {
            self.job = Some(start(ui.ctx(), bench, painting, size));
        }
        let Some(measured) = &self.measured else { return };
        Grid::new("frame rate").spacing([16.0, 4.0]).show(ui, |ui| {
            for [name, value] in measured.lines() {
                ui.label(name);
                ui.strong(value);
                ui.end_row();
            }
        });
        ui.weak(measured.what());
        ui.weak(&measured.adapter);
        if ui.button("Copy as text").clicked() {
            ui.ctx().copy_text(measured.text());
        }
    }
}

fn start(ctx: &Context, bench: &Bench, painting: Option<Painting>, size: [u32; 2]) -> Job<Measured> {
    let opened = &bench.work.opened;
    let (volumes, scene) = (opened.volumes.clone(), painting.map_or_else(|| opened.scene.clone(), |(scene, _)| scene));
    let parts = opened.compare.parts(&scene, opened.compared(), size);
    Job::start(ctx, "Turning".into(), move |progress| -> Result<Measured, FrameRateError> {
        let (mut renderer, _) = Machine::auto();
        let rate = FrameRate::of_turn(renderer.as_mut(), &volumes, &parts, FRAMES, progress)?;
        let rate = rate.expect("a turn has more than no picture");
        let look = format!("{}{}", scene.mode.name(), if scene.shadows { " with shadows" } else { "" });
        Ok(Measured { rate, adapter: renderer.name(), look, size })
    })
}
