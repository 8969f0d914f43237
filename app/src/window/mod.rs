//! The window: what there is on the left, the picture in the middle, what was found on the right.
//!
//! Reading (`loading`) and drawing (`picture::painter`) have threads of their own; the window only shows what they bring. This file is
//! the frame; `panels` has a row for each panel, and `bench` is what all of them work on.

mod ask;
mod bench;
mod commands;
mod dock;
mod document;
mod files;
mod headerless;
mod help;
mod history;
mod job;
mod letters;
mod loading;
mod measured;
mod menu;
mod messages;
mod palette;
mod panels;
mod path_prompt;
mod picture;
mod playing;
mod preferences;
mod recovery;
mod remembered;
mod series;
mod stage;
mod theme;
mod under;
mod unsaved;
mod widgets;
mod words;

use bench::Bench;
use bregma_field::Volume;
use bregma_measure::DifferenceRay;
use bregma_renderer::{Backend, BodyPlane, Integrator, Picture, Reconstruction, Scene, Setting, Solver};
use bregma_session::coat::Coat;
use bregma_session::studio::{Told, so_far};
use bregma_session::{Compare, Source};
use commands::COMMANDS;
use egui::{Align, CentralPanel, Context, Frame, Label, Layout, Panel, Rect, RichText, Ui, ViewportCommand};
use letters::Letters;
use loading::Loading;
use measured::Tool;
use panels::{Command, Panels};
use picture::desk::Painted;
use picture::{compare_bar, slice_views, tools};
pub use preferences::{Preferences, ThemeChoice};
use remembered::Remembered;
use std::path::PathBuf;
use std::sync::Arc;

/// What the window begins with.
#[derive(Clone, Debug, PartialEq)]
pub enum Start {
    /// The built-in demo pair.
    Demo,
    /// Scans, or one session; nothing when empty.
    Files(Vec<Source>),
}

/// How long a kiosk waits until it turns, seconds; as a person chose when absent.
pub type Kiosk = Option<f64>;

/// Opens the window, as a kiosk if that is asked for, and stays until it is closed.
pub fn run(start: Start, kiosk: Option<Kiosk>) -> Result<(), eframe::Error> {
    let state = remembered::state_folder();
    let viewport = egui::ViewportBuilder::default().with_title("Bregma").with_app_id("bregma").with_icon(theme::icon());
    let viewport = Remembered::read(state.as_deref()).place(viewport, [720.0, 480.0], [1280.0, 800.0]);
    let options = eframe::NativeOptions { viewport, renderer: eframe::Renderer::Wgpu, system_font_fallback: false, ..Default::default() };
    let begin = |cc: &eframe::CreationContext<'_>| -> Box<dyn eframe::App> {
        letters::draw_with_system_fonts(&cc.egui_ctx);
        let mut workstation = Workstation::new(cc, start, state);
        if let Some(after_s) = kiosk {
            workstation.begin_kiosk(&cc.egui_ctx, after_s);
        }
        Box::new(workstation)
    };
    eframe::run_native("Bregma", options, Box::new(|cc| Ok(begin(cc))))
}

/// The window's state.
pub struct Workstation {
    bench: Bench,
    panels: Panels,
    letters: Letters,
    title: String,
}

impl Workstation {
    /// The window that begins with `start`. What outlives it is written to the folder `state`, if there is one: unsaved work, and what was
    /// opened.
    pub fn new(cc: &eframe::CreationContext<'_>, start: Start, state: Option<PathBuf>) -> Self {
        let loading = match start {
            Start::Demo => Some(Loading::demo(&cc.egui_ctx)),
            Start::Files(sources) if sources.is_empty() => None,
            Start::Files(sources) => Some(Loading::files(&cc.egui_ctx, sources, false)),
        };
        let letters = Letters::watch(&cc.egui_ctx);
        let bench = Bench::new(&cc.egui_ctx, loading, state);
        theme::apply(&cc.egui_ctx);
        Self { bench, panels: Panels::default(), letters, title: String::new() }
    }

    /// With other preferences from now on.
    pub fn preferring(mut self, preferences: Preferences) -> Self {
        self.bench.remembered.preferences = preferences;
        self
    }

    /// Fills the screen; left alone, the picture turns by itself.
    pub fn begin_kiosk(&mut self, ctx: &Context, after_s: Kiosk) {
        let bench = &mut self.bench;
        bench.stage.fill(ctx, Some(after_s.unwrap_or(bench.remembered.preferences.kiosk_after_s)));
    }

    /// Scans are on their way in.
    pub fn is_loading(&self) -> bool {
        self.bench.loading.is_some() || self.bench.is_coarse
    }

    /// The picture on the screen is the exact one of what is open.
    pub fn is_settled(&self) -> bool {
        let bench = &self.bench;
        let is_drawn = !bench.work.opened.slices.layout.has_picture() || bench.painter.is_settled();
        !self.is_loading() && is_drawn && bench.slices.are_settled(&bench.work)
    }

    /// The picture on the screen has as much studio light as it gets.
    pub fn is_exposed(&self) -> bool {
        self.is_settled() && self.bench.painter.is_exposed()
    }

    /// How far the picture on the screen is under studio light: samples of each pixel, and noise in 255ths; `None` where it is the ordinary one.
    pub fn exposed(&self) -> Option<(u32, f64)> {
        let (told, _) = self.bench.view.painted.as_ref()?.exposed?;
        Some((told.samples, told.noise))
    }

    /// What the picture is asked to show: that of the work, or of a film that plays.
    pub fn shown(&self) -> Option<&Scene> {
        self.bench.painter.wished()
    }

    /// What moves.
    pub fn film(&self) -> Option<&bregma_session::film::Film> {
        self.bench.work.opened.film.as_deref()
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

    /// How slices are looked at.
    pub fn slices(&self) -> &bregma_session::Slices {
        &self.bench.work.opened.slices
    }

    /// The newest picture of a slice, and where it lies in the window, in points.
    pub fn slice(&self, plane: BodyPlane) -> Option<(&Picture, Rect)> {
        self.bench.slices.seen(plane)
    }

    /// What the status line says of the point under the mouse.
    pub fn under(&self) -> String {
        under::text(&self.bench, self.panels.painting(&self.bench.work).map(|(_, coat)| coat).as_deref())
    }

    /// The chart of speed and accuracy.
    pub fn chart(&self) -> Option<&bregma_session::chart::Chart> {
        self.panels.chart.chart()
    }

    /// The point of the chart whose errors are shown.
    pub fn charted(&self) -> Option<&bregma_session::chart::Point> {
        self.panels.chart.selected()
    }

    /// The scans that are open.
    pub fn volumes(&self) -> &[Arc<Volume>] {
        &self.bench.work.opened.volumes
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

    /// The finished map of differences.
    pub fn differences(&self) -> Option<&bregma_session::difference::Measured> {
        self.panels.differences.coat().map(|coat| &*coat.measured)
    }

    /// The finished section.
    pub fn section(&self) -> Option<&bregma_session::section::Measured> {
        self.panels.section.measured().map(|measured| &**measured)
    }

    /// The registrations that are kept.
    pub fn poses(&self) -> &[bregma_session::KeptPose] {
        &self.bench.work.opened.poses
    }

    /// What was measured beside rays, as it is kept.
    pub fn measurements(&self) -> &[bregma_session::Measurement] {
        &self.bench.work.opened.measurements
    }

    /// The landmarks that were set.
    pub fn landmarks(&self) -> &[bregma_session::Landmark] {
        &self.bench.work.measured.landmarks
    }

    /// Menus, and how scans are compared. Gives the command that is asked for, by a key or here.
    fn top_ui(&mut self, ui: &mut Ui) -> Option<&'static Command> {
        let Self { bench, panels, .. } = self;
        let commands: Vec<&'static Command> = COMMANDS.iter().chain(Panels::commands()).collect();
        let pressed = menu::pressed(ui.ctx(), &commands, panels, bench);
        let painted = panels.painting(&bench.work).is_some();
        // It is taken out while it asks the panels what can be done.
        let mut palette = std::mem::take(&mut panels.palette);
        let typed = palette.show(ui.ctx(), &commands, panels, bench);
        panels.palette = palette;
        panels.help.show(ui.ctx(), &commands);
        if bench.stage.is_full() {
            return pressed.or(typed);
        }
        let top = Panel::top("menu").show(ui, |ui| menu::show(ui, &commands, panels, bench, |ui, bench| beside_menus(ui, bench, painted)));
        top.inner.or(pressed).or(typed)
    }

    fn status_ui(&self, ui: &mut Ui) {
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let Some(p) = self.bench.view.painted.as_ref().filter(|_| !self.bench.is_empty()) else {
                ui.weak(if self.is_loading() { "Loading" } else { "Nothing is open" });
                return;
            };
            match self.bench.recorded_s(ui.ctx()) {
                Some(seconds) => ui.colored_label(ui.visuals().warn_fg_color, format!("Recording, {seconds:.0} s")),
                None => ui.weak(self.bench.view.hint()),
            };
            let quality = self.quality(p);
            let adapter = if p.backend == Backend::Cpu { p.adapter.replacen("cpu", "CPU", 1) } else { p.adapter.clone() };
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                let painting = self.panels.painting(&self.bench.work);
                under::show(ui, &self.bench, painting.map(|(_, coat)| coat).as_deref());
                if ui.available_width() < QUALITY {
                    return;
                }
                // Studio light is the processor's, whatever drew the picture before.
                let text = if p.exposed.is_some() { quality } else { format!("{quality}  ·  {:.0} ms  ·  {adapter}", p.millis) };
                if ui.available_width() > LEAST_TEXT {
                    ui.add(Label::new(RichText::new(text).weak()).truncate());
                }
            });
        });
    }

    /// How exactly the picture is drawn, or how far it is under studio light.
    fn quality(&self, p: &Painted) -> String {
        let scene = self.scene();
        if let Some((told, is_filtered)) = p.exposed {
            return lit(scene, &told, is_filtered);
        }
        let samples = if p.samples > 1 { format!(", {} samples", p.samples) } else { String::new() };
        let quality = match (p.reduction, scene.solver) {
            (1, _) if scene.mode.uses(Setting::Transfer) && scene.integrator != Integrator::Exact => "in steps".to_owned(),
            (1, _) if scene.draws_spline() => "B-spline, not the measured surface".to_owned(),
            (1, _) if scene.reconstructs() == Reconstruction::Nearest => "samples as boxes, not the measured surface".to_owned(),
            (1, Solver::Exact) => "exact".to_owned(),
            (1, solver) => format!("by {solver}, which is not exact"),
            (n, _) => format!("preview, 1/{n} across"),
        };
        let light = if self.bench.painter.is_lit() { ", studio light comes at rest" } else { "" };
        format!("{quality}{samples}{light}")
    }

    /// The tools beside the picture.
    fn tools_ui(&mut self, ui: &mut Ui) -> Option<&'static Command> {
        let command = |tool: Tool| Panels::commands().find(|command| command.name() == tool.text()[0]);
        let ctx = ui.ctx().clone();
        let key = |tool| command(tool).map_or(String::new(), |command| command.keys_text(&ctx));
        tools::show(ui, self.bench.view.tool(), key).and_then(command)
    }

    /// The picture, or what to do while there is none.
    fn central_ui(&mut self, ui: &mut Ui) {
        if !self.bench.is_empty() {
            self.picture_ui(ui);
            return;
        }
        let bench = &mut self.bench;
        if bench.loading.is_some() {
            return;
        }
        let middle = Rect::from_center_size(ui.max_rect().center(), egui::vec2(420.0_f32.min(ui.max_rect().width()), 100.0));
        let welcome = |ui: &mut Ui| {
            ui.heading("Drop scans here, or File › Open…");
            ui.weak("DICOM, NRRD, NIfTI, MetaImage, TIFF, a folder of slices, or a session; two scans are compared");
            ui.add_space(10.0);
            if ui.button("Open the demo pair").clicked() {
                bench.load_demo(ui.ctx());
            }
        };
        ui.scope_builder(egui::UiBuilder::new().max_rect(middle), |ui| ui.vertical_centered(welcome));
    }

    /// The picture; while a film plays, of what that shows, and not of the work, which stays as it is.
    fn picture_ui(&mut self, ui: &mut Ui) {
        let shown = self.bench.shown_by_film(ui.ctx());
        let work = shown.map(|shown| std::mem::replace(&mut self.bench.work.opened, shown));
        self.views_ui(ui);
        if let Some(opened) = work {
            self.bench.work.opened = opened;
        }
    }

    fn views_ui(&mut self, ui: &mut Ui) {
        let Self { bench, panels, .. } = self;
        bench.under_mm = None;
        bench.view.let_go(ui.ctx(), &bench.work);
        let (picture, planes) = slice_views::divide(bench.work.opened.slices.layout, ui.available_rect_before_wrap());
        let painting = panels.painting(&bench.work).and_then(|(scene, coat)| {
            let on = scene.layers.iter().position(|layer| layer.visible)?;
            Some((scene, (on, coat)))
        });
        // A mirror image lies elsewhere than the scan that slices show.
        let is_there = |(scene, (on, _)): &&(Scene, (usize, Arc<dyn Coat>))| {
            bench.work.opened.scene.layers.get(*on).is_some_and(|layer| layer.transform == scene.layers[*on].transform)
        };
        let worn = painting.as_ref().filter(is_there).map(|(_, worn)| worn.clone());
        for (plane, rect) in planes {
            let shown = bench.slices.of(plane).show(ui, (plane, rect), &mut bench.work, &mut bench.view, &bench.found, worn.clone());
            match shown {
                Ok(under_mm) => bench.under_mm = bench.under_mm.or(under_mm),
                Err(text) => bench.messages.note(text),
            }
        }
        let Some(rect) = picture else { return };
        let ui = &mut ui.new_child(egui::UiBuilder::new().max_rect(rect));
        bench.under_mm = bench.under_mm.or_else(|| bench.view.under(ui, &bench.work));
        match bench.view.show(ui, &mut bench.work, &bench.found, bench.hovered_mm, bench.remembered.preferences.turns_freely) {
            Ok(size) => {
                let resting = bench.view.is_resting(ui.ctx());
                let opened = &bench.work.opened;
                bench.painter.samples_at_rest = bench.remembered.preferences.samples_at_rest;
                match painting {
                    Some((scene, worn)) => bench.painter.want(&opened.volumes, &scene, size, (Compare::Off, None), Some(worn), resting),
                    None => bench.painter.want(&opened.volumes, &opened.scene, size, (opened.compare, opened.compared()), None, resting),
                }
                bench.painter.expose(ui.ctx(), resting);
            }
            Err(text) => bench.messages.note(text),
        }
    }

    /// What lies around the picture. Gives the command of the tool that is taken.
    fn around_ui(&mut self, ui: &mut Ui) -> Option<&'static Command> {
        Panel::bottom("status").exact_size(STATUS).show(ui, |ui| self.status_ui(ui));
        if self.bench.is_empty() {
            return None;
        }
        self.panels.show_left(ui, &mut self.bench);
        self.bench.measure();
        let taken = Panel::left("tools").exact_size(TOOLS).resizable(false).show(ui, |ui| self.tools_ui(ui)).inner;
        self.panels.show_right(ui, &mut self.bench);
        taken
    }

    /// What lies over the picture, which is at `place`: drawers, what is loading, questions and messages. Gives the command that one of these
    /// offers and that is asked for.
    fn over_ui(&mut self, ui: &mut Ui, place: Rect) -> Option<&'static Command> {
        let ctx = ui.ctx().clone();
        if !self.bench.stage.is_full() {
            self.panels.show_over(ui, &mut self.bench, place);
        }
        let bench = &mut self.bench;
        if let Some(loading) = &mut bench.loading
            && loading.show(&ctx, place)
        {
            bench.loading = None;
        }
        bench.offer_left_behind(&ctx);
        bench.ask_about_unsaved(&ctx);
        self.letters.notice().into_iter().for_each(|text| bench.messages.note(text));
        let help = bench.messages.show(&ctx, place);
        if ctx.input(|i| !i.raw.hovered_files.is_empty()) {
            drop_hint(&ctx);
        }
        let named = |name| Panels::commands().find(|command| command.name() == name);
        help.and_then(named).filter(|command| command.allowed(&self.panels, &self.bench).is_ok())
    }
}

/// What stands beside the menus: what the work is called, and how scans are compared.
fn beside_menus(ui: &mut Ui, bench: &mut Bench, is_painted: bool) {
    ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
        let opened = &mut bench.work.opened;
        if is_painted {
            // The map is of one scan.
            opened.compare = Compare::Off;
        } else if opened.scene.layers.iter().filter(|l| l.visible).count() > 1 {
            compare_bar::show(ui, opened);
        }
        ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
            if !bench.is_empty() {
                ui.add(Label::new(RichText::new(bench.document.title(&bench.work)).weak()).truncate());
            }
        });
    });
}

impl eframe::App for Workstation {
    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        theme::choose(&ctx, self.bench.remembered.preferences.theme);
        self.bench.collect(&ctx);
        self.panels.poll(&mut self.bench);
        let chosen = self.top_ui(ui);
        self.bench.stage.look(&ctx);
        self.bench.turn_by_itself(&ctx);
        let taken = if self.bench.stage.is_full() {
            self.bench.measure();
            None
        } else {
            self.around_ui(ui)
        };
        let frame = Frame::NONE.fill(ui.visuals().extreme_bg_color);
        let place = CentralPanel::default().frame(frame).show(ui, |ui| {
            let place = ui.max_rect();
            self.central_ui(ui);
            place
        });
        let offered = self.over_ui(ui, place.inner);
        if let Some(command) = chosen.or(taken).or(offered) {
            command.run(&mut self.panels, &mut self.bench, &ctx);
        }
        self.bench.note_recording(&ctx);
        // A drag is one step, however many values it passes.
        if !self.bench.view.is_held(&ctx) {
            self.bench.history.record(&self.bench.work);
        }
        if !self.bench.stage.turns() {
            self.bench.keep(&ctx);
        }
        self.bench.guard_closing(&ctx);
        self.tell_title(&ctx);
        self.bench.remembered.look(&ctx);
    }

    fn on_exit(&mut self) {
        self.bench.remembered.write();
        // Whoever closed the window was asked; a display that goes away ends the program, too, and asks nobody.
        if self.bench.may_close || self.bench.document.is_saved(&self.bench.work) {
            self.bench.recovery.forget();
        }
    }
}

impl Workstation {
    /// Names the window after the work.
    fn tell_title(&mut self, ctx: &Context) {
        let bench = &self.bench;
        let title = if bench.is_empty() { "Bregma".to_owned() } else { format!("{} – Bregma", bench.document.title(&bench.work)) };
        if title != self.title {
            ctx.send_viewport_cmd(ViewportCommand::Title(title.clone()));
            self.title = title;
        }
    }
}

/// How far a picture is under studio light.
fn lit(scene: &Scene, told: &Told, is_filtered: bool) -> String {
    let left = told.left.map_or(0.0, |left| left.as_secs_f64().ceil());
    let left = if left > 0.0 { format!(", about {left:.0} s left") } else { String::new() };
    let smoothed = scene.studio.as_ref().is_some_and(|studio| studio.smooth_voxel > 0.0);
    let smoothed = if smoothed { ", smoothed, not the measured surface" } else { "" };
    let filtered = if is_filtered { ", filtered" } else { "" };
    format!("studio light: {}{filtered}{left}{smoothed}", so_far(told.samples, told.noise))
}

/// What is less room than this, in points, says nothing of how the picture is drawn.
const QUALITY: f32 = 60.0;
/// Height of the line at the bottom, and width of the strip of tools, in points.
const STATUS: f32 = 26.0;
const TOOLS: f32 = 46.0;
/// Room that holds no word, in points.
const LEAST_TEXT: f32 = 40.0;

fn drop_hint(ctx: &Context) {
    let layer = egui::LayerId::new(egui::Order::Foreground, egui::Id::unique("drop"));
    let (painter, screen) = (ctx.layer_painter(layer), ctx.content_rect());
    painter.rect_filled(screen, 0.0, egui::Color32::from_black_alpha(170));
    painter.text(screen.center(), egui::Align2::CENTER_CENTER, "Drop to add", egui::FontId::proportional(28.0), egui::Color32::WHITE);
}
