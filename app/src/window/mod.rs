//! The window: scans on the left, the picture in the middle, the difference ray below.
//!
//! Reading ([`loading`]) and drawing ([`painter`]) have threads of their own; the window only shows what they bring.

mod bars;
mod cast;
mod chart_panel;
mod compare_bar;
mod cut_handles;
mod cuts;
mod files;
mod histogram;
mod history;
mod job;
mod layers;
mod loading;
mod marks;
mod measured;
mod menu;
mod modes;
mod navigate;
mod notices;
mod painter;
mod probe_panel;
mod ray_form;
mod series;
mod shells;
mod theme;
mod thickness_panel;
mod threshold_curve;
mod transfer_editor;
mod view;

use crate::compare::Compare;
use crate::input::{Opened, Source};
use bregma_field::Volume;
use bregma_measure::DifferenceRay;
use bregma_renderer::{Integrator, Mode, Picture, Scene, Solver};
use cast::Found;
use chart_panel::ChartPanel;
use egui::{Align, CentralPanel, Context, Frame, Layout, Panel, Rect, Ui, ViewportCommand};
use files::{Ask, Dialog};
use history::{History, Work};
use loading::Loading;
use measured::{Measured, Tool};
use menu::Command;
use notices::Notices;
use painter::Painter;
use ray_form::RayForm;
use std::path::PathBuf;
use std::sync::Arc;
use thickness_panel::ThicknessPanel;
use view::View;

/// What the window begins with.
#[derive(Clone, Debug, PartialEq)]
pub enum Start {
    /// The built-in demo pair.
    Demo,
    /// Scans, or one session; nothing when empty.
    Files(Vec<Source>),
}

/// Whether two lists hold the same scans, not merely equal ones.
fn same_scans(a: &[Arc<Volume>], b: &[Arc<Volume>]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| Arc::ptr_eq(a, b))
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
    work: Work,
    history: History,
    found: Vec<Found>,
    /// Where the mouse is along the selected ray, mm.
    hovered_mm: Option<f64>,
    view: View,
    painter: Painter,
    loading: Option<Loading>,
    dialog: Option<Dialog>,
    notices: Notices,
    chart: ChartPanel,
    thickness: ThicknessPanel,
    form: RayForm,
}

impl Workstation {
    /// The window that begins with `start`.
    pub fn new(cc: &eframe::CreationContext<'_>, start: Start) -> Self {
        theme::apply(&cc.egui_ctx);
        let work = Work { opened: Opened::new(vec![], vec![]), measured: Measured::default() };
        let loading = match start {
            Start::Demo => Some(Loading::demo(&cc.egui_ctx)),
            Start::Files(sources) if sources.is_empty() => None,
            Start::Files(sources) => Some(Loading::files(&cc.egui_ctx, sources, false)),
        };
        let history = History::new(&work);
        let painter = Painter::new(&cc.egui_ctx);
        let (view, notices, chart) = (View::default(), Notices::default(), ChartPanel::default());
        let thickness = ThicknessPanel::default();
        Self {
            work,
            history,
            found: vec![],
            hovered_mm: None,
            view,
            painter,
            loading,
            dialog: None,
            notices,
            chart,
            thickness,
            form: RayForm::default(),
        }
    }

    /// Scans are on their way in.
    pub fn is_loading(&self) -> bool {
        self.loading.is_some()
    }

    /// The picture on the screen is the exact one of what is open.
    pub fn is_settled(&self) -> bool {
        self.loading.is_none() && self.painter.is_settled()
    }

    /// What is drawn.
    pub fn scene(&self) -> &Scene {
        &self.work.opened.scene
    }

    /// The newest picture.
    pub fn picture(&self) -> Option<&Picture> {
        self.view.painted.as_ref().map(|p| &p.picture)
    }

    /// Where the picture lies in the window, in points.
    pub fn picture_rect(&self) -> Option<Rect> {
        self.view.rect
    }

    /// The chart of speed and accuracy.
    pub fn chart(&self) -> Option<&crate::chart::Chart> {
        self.chart.chart()
    }

    /// The point of the chart whose errors are shown.
    pub fn charted(&self) -> Option<&crate::chart::Point> {
        self.chart.selected()
    }

    /// What the difference ray found.
    pub fn difference_ray(&self) -> Option<&DifferenceRay> {
        self.found.get(self.work.measured.selected).map(|f| &f.ray)
    }

    /// How scans are compared.
    pub fn compare(&self) -> Compare {
        self.work.opened.compare
    }

    /// The statistics of the finished map of thickness.
    pub fn thickness(&self) -> Option<&bregma_measure::thickness::Statistics> {
        self.thickness.coat().map(|coat| &coat.map.statistics)
    }

    /// The landmarks that were set.
    pub fn landmarks(&self) -> &[crate::input::Landmark] {
        &self.work.measured.landmarks
    }

    fn is_empty(&self) -> bool {
        self.work.opened.volumes.is_empty()
    }

    /// Takes what the threads brought.
    fn collect(&mut self, ctx: &Context) {
        let loaded = self.loading.as_mut().and_then(|l| l.poll().map(|result| (result, l.adds)));
        if let Some((result, adds)) = loaded {
            self.loading = None;
            match result {
                Ok(opened) => self.receive(opened, adds),
                Err(text) => self.notices.error(text),
            }
        }
        if let Some(result) = self.dialog.as_ref().and_then(Dialog::poll) {
            self.dialog = None;
            match result {
                Ok((ask, paths)) if !paths.is_empty() => self.answer(ctx, ask, paths),
                Ok(_) => {}
                Err(text) => self.notices.error(text),
            }
        }
        match self.painter.poll() {
            Some(Ok(painted)) => self.view.take(ctx, painted),
            Some(Err(text)) => self.notices.error(text),
            None => {}
        }
        if let Err(text) = self.chart.poll(&self.work.opened.volumes) {
            self.notices.error(text);
        }
        if let Err(text) = self.thickness.poll() {
            self.notices.error(text);
        }
        if let Some(text) = self.painter.notice() {
            self.notices.error(text);
        }
        let dropped = ctx.input(|i| i.raw.dropped_files.iter().map(|f| f.path().to_owned()).collect::<Vec<_>>());
        if !dropped.is_empty() {
            self.load(ctx, dropped, true);
        }
    }

    fn receive(&mut self, opened: Opened, adds: bool) {
        if adds && !self.is_empty() {
            self.work.opened.add(opened);
            return;
        }
        let mut opened = opened;
        let measured = Measured::of(&mut opened);
        self.work = Work { opened, measured };
        // What was found in other scans is not found in these.
        self.found.clear();
        self.view.forget_first_point();
        // Undo does not lead back into scans that were closed, so that their memory is free.
        self.history = History::new(&self.work);
    }

    fn load(&mut self, ctx: &Context, paths: Vec<PathBuf>, adds: bool) {
        if self.loading.is_some() {
            self.notices.error("Other scans are still loading: wait for them or cancel, then open these again.");
            return;
        }
        let sources = paths.into_iter().map(|file| Source { file, ..Source::default() }).collect();
        self.loading = Some(Loading::files(ctx, sources, adds));
    }

    fn answer(&mut self, ctx: &Context, ask: Ask, paths: Vec<PathBuf>) {
        let gone = |what| format!("The {what} went away while the dialog was open: nothing was saved.");
        let result = match ask {
            Ask::Open | Ask::OpenFolder => return self.load(ctx, paths, false),
            Ask::Add | Ask::AddFolder => return self.load(ctx, paths, true),
            Ask::Session => files::save_session(&paths[0], &self.work, &self.found),
            Ask::Picture => self.picture().map_or(Err(gone("picture")), |picture| {
                let painting = self.thickness.painting(&self.work);
                files::save_picture(&paths[0], picture, painting.as_ref().map(|(_, coat)| coat.as_ref()))
            }),
            Ask::Map => self.thickness.coat().map_or(Err(gone("map")), |coat| files::save_map(&paths[0], coat)),
            Ask::Rays => files::save_rays(&paths[0], &self.work, &self.found),
            Ask::Landmarks => files::save_landmarks(&paths[0], &self.work),
        };
        match result {
            Ok(text) => self.notices.note(text),
            Err(text) => self.notices.error(text),
        }
    }

    /// Which commands make sense now.
    fn allows(&self, command: Command) -> bool {
        let opened = &self.work.opened;
        match command {
            Command::Open | Command::Add | Command::OpenFolder | Command::AddFolder => self.loading.is_none() && self.dialog.is_none(),
            Command::Demo => self.loading.is_none(),
            // The built-in pair has no files that a session could name.
            Command::SaveSession => !self.is_empty() && opened.sources.len() == opened.volumes.len() && self.dialog.is_none(),
            Command::SavePicture => !self.is_empty() && self.painter.is_settled() && self.dialog.is_none(),
            Command::Undo => self.history.can_undo(),
            Command::Redo => self.history.can_redo(),
            Command::ClearRay => !self.work.measured.rays.is_empty(),
            Command::Take(_) => !self.is_empty(),
            Command::Look(_) | Command::Projection | Command::Fit => !self.is_empty(),
            Command::Chart | Command::Thickness | Command::Numbers => !self.is_empty(),
            Command::Exact => self.work.opened.scene.solver != Solver::Exact,
            Command::Quit => true,
        }
    }

    fn obey(&mut self, ctx: &Context, command: Command) {
        let bounds = self.work.opened.bounds();
        let camera = &mut self.work.opened.scene.camera;
        let ask = |ask| Some(Dialog::open(ctx, ask));
        match command {
            Command::Open => self.dialog = ask(Ask::Open),
            Command::Add => self.dialog = ask(Ask::Add),
            Command::OpenFolder => self.dialog = ask(Ask::OpenFolder),
            Command::AddFolder => self.dialog = ask(Ask::AddFolder),
            Command::SaveSession => self.dialog = ask(Ask::Session),
            Command::SavePicture => self.dialog = ask(Ask::Picture),
            Command::Demo => self.loading = Some(Loading::demo(ctx)),
            Command::Quit => ctx.send_viewport_cmd(ViewportCommand::Close),
            Command::Undo => self.history.undo(&mut self.work),
            Command::Redo => self.history.redo(&mut self.work),
            Command::ClearRay => self.work.measured.remove_ray(),
            Command::Take(tool) => self.view.take_tool(tool),
            Command::Chart => self.chart.open = !self.chart.open,
            Command::Numbers => {
                let measured = &self.work.measured;
                self.form.begin(measured.rays.get(measured.selected).map(|named| &named.ray), camera);
            }
            Command::Thickness => self.thickness.open = !self.thickness.open,
            Command::Exact => self.work.opened.scene.solver = Solver::Exact,
            Command::Look(side) => navigate::look_from(camera, &bounds, side),
            Command::Projection => navigate::toggle_projection(camera, &bounds),
            Command::Fit => navigate::look_from(camera, &bounds, navigate::Side::Anterior),
        }
    }

    fn status_ui(&self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            let Some(p) = self.view.painted.as_ref().filter(|_| !self.is_empty()) else {
                ui.weak(if self.is_loading() { "Loading" } else { "Nothing is open" });
                return;
            };
            let solver = self.work.opened.scene.solver;
            let scene = &self.work.opened.scene;
            let quality = match (p.reduction, solver) {
                (1, _) if scene.mode == Mode::Dvr && scene.integrator != Integrator::Exact => "in steps".to_owned(),
                (1, _) if scene.draws_spline() => "B-spline, not the measured surface".to_owned(),
                (1, Solver::Exact) => "exact".to_owned(),
                (1, _) => format!("by {solver}, which is not exact"),
                (n, _) => format!("preview, 1/{n} across"),
            };
            let backend = p.backend.replacen("cpu", "CPU", 1);
            ui.weak(format!("{backend}  ·  {:.0} ms  ·  {quality}", p.millis));
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                ui.weak("Left-drag rotates  ·  middle-drag moves  ·  wheel zooms  ·  click on bone measures");
            });
        });
    }

    /// The picture, or what to do while there is none.
    fn central_ui(&mut self, ui: &mut Ui) -> Option<Command> {
        if !self.is_empty() {
            let before = self.work.measured.clone();
            match self.view.show(ui, &mut self.work, &self.found, self.hovered_mm) {
                Ok(size) => {
                    let resting = self.view.is_resting(ui.ctx());
                    let (parts, coat) = match self.thickness.painting(&self.work) {
                        Some((scene, coat)) => (vec![(scene, size)], Some(coat)),
                        None => (self.work.opened.compare.parts(&self.work.opened.scene, size), None),
                    };
                    self.painter.want(&self.work.opened.volumes, parts, self.work.opened.compare, coat, resting);
                }
                Err(text) => self.notices.note(text),
            }
            if self.work.measured != before {
                self.notices.forget_notes();
            }
            return None;
        }
        let middle = Rect::from_center_size(ui.max_rect().center(), egui::vec2(420.0, 100.0));
        let middle = egui::UiBuilder::new().max_rect(middle);
        if let Some(loading) = &mut self.loading {
            if ui.scope_builder(middle, |ui| loading.ui(ui)).inner {
                self.loading = None;
            }
            return None;
        }
        let welcome = |ui: &mut Ui| {
            ui.heading("Drop scans here, or File › Open…");
            ui.weak("DICOM, NRRD, NIfTI, MetaImage, TIFF, a folder of slices, or a session; two scans are compared");
            ui.add_space(10.0);
            ui.button("Open the demo pair").clicked().then_some(Command::Demo)
        };
        ui.scope_builder(middle, |ui| ui.vertical_centered(welcome).inner).inner
    }
}

impl eframe::App for Workstation {
    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        self.collect(&ctx);
        let mut command = menu::pressed(&ctx, |c| self.allows(c));
        Panel::top("menu").show(ui, |ui| {
            command = menu::show(ui, |c| self.allows(c)).or(command);
            if !self.is_empty() {
                ui.horizontal(|ui| {
                    ui.weak("A click:");
                    for tool in Tool::ALL {
                        let [name, what] = tool.text();
                        if ui.selectable_label(self.view.tool() == tool, name).on_hover_text(what).clicked() {
                            self.view.take_tool(tool);
                        }
                    }
                    if self.thickness.painting(&self.work).is_some() {
                        // The map is of one scan.
                        self.work.opened.compare = Compare::Off;
                    } else if self.work.opened.scene.layers.iter().filter(|l| l.visible).count() > 1 {
                        ui.separator();
                        compare_bar::show(ui, &mut self.work.opened.compare);
                    }
                });
            }
        });
        if let Some(command) = command {
            self.obey(&ctx, command);
        }
        if !self.notices.is_empty() {
            Panel::top("notices").frame(Frame::NONE).show(ui, |ui| self.notices.show(ui));
        }
        let is_empty = self.is_empty();
        if let Some(loading) = self.loading.as_mut().filter(|_| !is_empty)
            && Panel::top("loading").show(ui, |ui| loading.ui(ui)).inner
        {
            self.loading = None;
        }
        Panel::bottom("status").show(ui, |ui| self.status_ui(ui));
        if !self.is_empty() {
            Panel::left("layers").default_size(320.0).size_range(290.0..=520.0).show(ui, |ui| {
                ui.add_space(4.0);
                layers::show(ui, &mut self.work, self.view.painted.as_ref().map(|p| &p.picture));
            });
        }
        match Found::refresh(std::mem::take(&mut self.found), &self.work) {
            Ok(found) => self.found = found,
            Err(text) => self.notices.error(text),
        }
        self.hovered_mm = None;
        let measured = &mut self.work.measured;
        if !(measured.rays.is_empty() && measured.landmarks.is_empty()) || self.form.open {
            let wish = Panel::bottom("ray").resizable(true).default_size(260.0).size_range(110.0..=640.0).show(ui, |ui| {
                ui.add_space(4.0);
                probe_panel::show(ui, measured, &mut self.form, &mut self.found, &mut self.hovered_mm)
            });
            if let Some(wish) = wish.inner.filter(|_| self.dialog.is_none()) {
                let ask = if wish == probe_panel::Wish::SaveRays { Ask::Rays } else { Ask::Landmarks };
                self.dialog = Some(Dialog::open(&ctx, ask));
            }
        }
        let frame = Frame::NONE.fill(ui.visuals().extreme_bg_color);
        if let Some(command) = CentralPanel::default().frame(frame).show(ui, |ui| self.central_ui(ui)).inner {
            self.obey(&ctx, command);
        }
        if self.chart.open {
            let painted = self.view.painted.as_ref();
            let size = painted.map(|p| [p.picture.width, p.picture.height].map(|n| n * p.reduction));
            let on_gpu = painted.is_some_and(|p| !p.backend.starts_with("cpu"));
            self.chart.show(&ctx, &mut self.work, size, on_gpu);
        }
        if self.thickness.open {
            let wish = self.thickness.show(&ctx, &self.work);
            if let Some(thickness_panel::Wish::Save) = wish.filter(|_| self.dialog.is_none()) {
                self.dialog = Some(Dialog::open(&ctx, Ask::Map));
            }
        }
        if ctx.input(|i| !i.raw.hovered_files.is_empty()) {
            drop_hint(&ctx);
        }
        // A drag is one step, however many values it passes.
        if !ctx.input(|i| i.pointer.any_down()) {
            self.history.record(&self.work);
        }
    }
}

fn drop_hint(ctx: &Context) {
    let layer = egui::LayerId::new(egui::Order::Foreground, egui::Id::unique("drop"));
    let (painter, screen) = (ctx.layer_painter(layer), ctx.content_rect());
    painter.rect_filled(screen, 0.0, egui::Color32::from_black_alpha(170));
    painter.text(screen.center(), egui::Align2::CENTER_CENTER, "Drop to add", egui::FontId::proportional(28.0), egui::Color32::WHITE);
}
