//! The window: scans on the left, the picture in the middle, what was measured below.
//!
//! Reading (`loading`) and drawing (`picture::painter`) have threads of their own; the window only shows what they bring. This file is
//! the frame; `panels` has a row for each panel, and `bench` is what all of them work on.

mod bench;
mod commands;
mod files;
mod history;
mod job;
mod loading;
mod measured;
mod menu;
mod notices;
mod panels;
mod picture;
mod series;
mod theme;
mod widgets;

use bench::Bench;
use bregma_measure::DifferenceRay;
use bregma_renderer::{Backend, Integrator, Picture, Scene, Setting, Solver};
use bregma_session::{Compare, Source};
use commands::COMMANDS;
use egui::{Align, CentralPanel, Context, Frame, Layout, Panel, Rect, Ui};
use loading::Loading;
use measured::Tool;
use panels::{Command, Panels, Place};
use picture::compare_bar;

/// What the window begins with.
#[derive(Clone, Debug, PartialEq)]
pub enum Start {
    /// The built-in demo pair.
    Demo,
    /// Scans, or one session; nothing when empty.
    Files(Vec<Source>),
}

/// Opens the window and stays until it is closed.
pub fn run(start: Start) -> Result<(), eframe::Error> {
    let viewport = egui::ViewportBuilder::default()
        .with_title("Bregma")
        .with_app_id("bregma")
        .with_icon(theme::icon())
        .with_inner_size([1280.0, 800.0])
        .with_min_inner_size([720.0, 480.0]);
    let options = eframe::NativeOptions { viewport, renderer: eframe::Renderer::Wgpu, ..Default::default() };
    eframe::run_native("Bregma", options, Box::new(|cc| Ok(Box::new(Workstation::new(cc, start)))))
}

/// The window's state.
pub struct Workstation {
    bench: Bench,
    panels: Panels,
}

impl Workstation {
    /// The window that begins with `start`.
    pub fn new(cc: &eframe::CreationContext<'_>, start: Start) -> Self {
        theme::apply(&cc.egui_ctx);
        let loading = match start {
            Start::Demo => Some(Loading::demo(&cc.egui_ctx)),
            Start::Files(sources) if sources.is_empty() => None,
            Start::Files(sources) => Some(Loading::files(&cc.egui_ctx, sources, false)),
        };
        Self { bench: Bench::new(&cc.egui_ctx, loading), panels: Panels::default() }
    }

    /// Scans are on their way in.
    pub fn is_loading(&self) -> bool {
        self.bench.loading.is_some()
    }

    /// The picture on the screen is the exact one of what is open.
    pub fn is_settled(&self) -> bool {
        self.bench.loading.is_none() && self.bench.painter.is_settled()
    }

    /// What is drawn.
    pub fn scene(&self) -> &Scene {
        &self.bench.work.opened.scene
    }

    /// The newest picture.
    pub fn picture(&self) -> Option<&Picture> {
        self.bench.view.painted.as_ref().map(|p| &p.picture)
    }

    /// Where the picture lies in the window, in points.
    pub fn picture_rect(&self) -> Option<Rect> {
        self.bench.view.rect
    }

    /// The chart of speed and accuracy.
    pub fn chart(&self) -> Option<&bregma_session::chart::Chart> {
        self.panels.chart.chart()
    }

    /// The point of the chart whose errors are shown.
    pub fn charted(&self) -> Option<&bregma_session::chart::Point> {
        self.panels.chart.selected()
    }

    /// What the difference ray found.
    pub fn difference_ray(&self) -> Option<&DifferenceRay> {
        self.bench.found.get(self.bench.work.measured.selected).map(|f| &f.ray)
    }

    /// How scans are compared.
    pub fn compare(&self) -> Compare {
        self.bench.work.opened.compare
    }

    /// The statistics of the finished map of thickness.
    pub fn thickness(&self) -> Option<&bregma_measure::thickness::Statistics> {
        self.panels.thickness.coat().map(|coat| &coat.map.statistics)
    }

    /// The landmarks that were set.
    pub fn landmarks(&self) -> &[bregma_session::Landmark] {
        &self.bench.work.measured.landmarks
    }

    /// Menus, tools, and how scans are compared. Gives the command that is asked for, by a key or here.
    fn top_ui(&mut self, ui: &mut Ui) -> Option<&'static Command> {
        let Self { bench, panels } = self;
        let commands: Vec<&'static Command> = COMMANDS.iter().chain(Panels::commands()).collect();
        let pressed = menu::pressed(ui.ctx(), &commands, panels, bench);
        let top = Panel::top("menu").show(ui, |ui| {
            let chosen = menu::show(ui, &commands, panels, bench);
            if !bench.is_empty() {
                ui.horizontal(|ui| tools_ui(ui, bench, panels));
            }
            chosen
        });
        top.inner.or(pressed)
    }

    /// What the person should know, and what the window is busy with.
    fn notices_ui(&mut self, ui: &mut Ui) {
        let bench = &mut self.bench;
        if !bench.notices.is_empty() {
            Panel::top("notices").frame(Frame::NONE).show(ui, |ui| bench.notices.show(ui));
        }
        let is_empty = bench.is_empty();
        if let Some(loading) = bench.loading.as_mut().filter(|_| !is_empty)
            && Panel::top("loading").show(ui, |ui| loading.ui(ui)).inner
        {
            bench.loading = None;
        }
        Panel::bottom("status").show(ui, |ui| self.status_ui(ui));
    }

    fn status_ui(&self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            let Some(p) = self.bench.view.painted.as_ref().filter(|_| !self.bench.is_empty()) else {
                ui.weak(if self.is_loading() { "Loading" } else { "Nothing is open" });
                return;
            };
            let scene = self.scene();
            let quality = match (p.reduction, scene.solver) {
                (1, _) if scene.mode.uses(Setting::Transfer) && scene.integrator != Integrator::Exact => "in steps".to_owned(),
                (1, _) if scene.draws_spline() => "B-spline, not the measured surface".to_owned(),
                (1, Solver::Exact) => "exact".to_owned(),
                (1, solver) => format!("by {solver}, which is not exact"),
                (n, _) => format!("preview, 1/{n} across"),
            };
            let adapter = if p.backend == Backend::Cpu { p.adapter.replacen("cpu", "CPU", 1) } else { p.adapter.clone() };
            ui.weak(format!("{adapter}  ·  {:.0} ms  ·  {quality}", p.millis));
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                ui.weak("Left-drag rotates  ·  middle-drag moves  ·  wheel zooms  ·  click on bone measures");
            });
        });
    }

    /// The picture, or what to do while there is none.
    fn central_ui(&mut self, ui: &mut Ui) {
        if !self.bench.is_empty() {
            self.picture_ui(ui);
            return;
        }
        let bench = &mut self.bench;
        let middle = Rect::from_center_size(ui.max_rect().center(), egui::vec2(420.0, 100.0));
        let middle = egui::UiBuilder::new().max_rect(middle);
        if let Some(loading) = &mut bench.loading {
            if ui.scope_builder(middle, |ui| loading.ui(ui)).inner {
                bench.loading = None;
            }
            return;
        }
        let welcome = |ui: &mut Ui| {
            ui.heading("Drop scans here, or File › Open…");
            ui.weak("DICOM, NRRD, NIfTI, MetaImage, TIFF, a folder of slices, or a session; two scans are compared");
            ui.add_space(10.0);
            if ui.button("Open the demo pair").clicked() {
                commands::open_demo(bench, ui.ctx());
            }
        };
        ui.scope_builder(middle, |ui| ui.vertical_centered(welcome));
    }

    fn picture_ui(&mut self, ui: &mut Ui) {
        let Self { bench, panels } = self;
        let count = bench.work.measured.count();
        match bench.view.show(ui, &mut bench.work, &bench.found, bench.hovered_mm) {
            Ok(size) => {
                let resting = bench.view.is_resting(ui.ctx());
                let opened = &bench.work.opened;
                match panels.painting(&bench.work) {
                    Some((scene, coat)) => bench.painter.want(&opened.volumes, &scene, size, Compare::Off, Some(coat), resting),
                    None => bench.painter.want(&opened.volumes, &opened.scene, size, opened.compare, None, resting),
                }
            }
            Err(text) => bench.notices.note(text),
        }
        if bench.work.measured.count() != count {
            bench.notices.forget_notes();
        }
    }
}

/// What a click does, and how scans are compared.
fn tools_ui(ui: &mut Ui, bench: &mut Bench, panels: &Panels) {
    ui.weak("A click:");
    for tool in Tool::ALL {
        let [name, what] = tool.text();
        if ui.selectable_label(bench.view.tool() == tool, name).on_hover_text(what).clicked() {
            bench.view.take_tool(tool);
        }
    }
    if panels.painting(&bench.work).is_some() {
        // The map is of one scan.
        bench.work.opened.compare = Compare::Off;
    } else if bench.work.opened.scene.layers.iter().filter(|l| l.visible).count() > 1 {
        ui.separator();
        compare_bar::show(ui, &mut bench.work.opened.compare);
    }
}

impl eframe::App for Workstation {
    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        self.bench.collect(&ctx);
        self.panels.poll(&mut self.bench);
        if let Some(command) = self.top_ui(ui) {
            command.run(&mut self.panels, &mut self.bench, &ctx);
        }
        self.notices_ui(ui);
        self.panels.show(ui, &mut self.bench, Place::Left);
        self.bench.measure();
        self.panels.show(ui, &mut self.bench, Place::Bottom);
        let frame = Frame::NONE.fill(ui.visuals().extreme_bg_color);
        CentralPanel::default().frame(frame).show(ui, |ui| self.central_ui(ui));
        self.panels.show(ui, &mut self.bench, Place::Over);
        if ctx.input(|i| !i.raw.hovered_files.is_empty()) {
            drop_hint(&ctx);
        }
        // A drag is one step, however many values it passes.
        if !ctx.input(|i| i.pointer.any_down()) {
            self.bench.history.record(&self.bench.work);
        }
    }
}

fn drop_hint(ctx: &Context) {
    let layer = egui::LayerId::new(egui::Order::Foreground, egui::Id::unique("drop"));
    let (painter, screen) = (ctx.layer_painter(layer), ctx.content_rect());
    painter.rect_filled(screen, 0.0, egui::Color32::from_black_alpha(170));
    painter.text(screen.center(), egui::Align2::CENTER_CENTER, "Drop to add", egui::FontId::proportional(28.0), egui::Color32::WHITE);
}
