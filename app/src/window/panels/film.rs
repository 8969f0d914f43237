//! A film of what is shown: a turntable, or what goes from key to key; played in the picture, told before it is saved, drawn beside the window.

use super::super::ask::{Ask, Kind};
use super::super::bench::Bench;
use super::super::job::Job;
use super::super::measured::Work;
use super::super::words::in_the_window;
use super::Painting;
use bregma_renderer::{Color, Projection, Shape};
use bregma_session::film::{Film, Key, QUALITY, Reel, reel, write};
use bregma_session::print::{Bar, Panel, Print, prepare};
use bregma_session::{Compare, Machine};
use egui::{Button, Context, DragValue, Grid, Ui, Window};
use std::cell::RefCell;
use std::path::PathBuf;
use std::rc::Rc;

/// The window that makes films.
pub struct FilmPanel {
    is_open: bool,
    by_keys: bool,
    seconds: f64,
    turns: f64,
    keys: Vec<Key>,
    fps: f64,
    size_px: [u32; 2],
    samples: u32,
    white: bool,
    bar: bool,
    letters: bool,
    /// When playing began, and what was seen before.
    played: Option<(f64, bregma_renderer::Camera)>,
    /// Where to, once the person has said so.
    chosen: Rc<RefCell<Option<PathBuf>>>,
    job: Option<Job<PathBuf>>,
}

impl Default for FilmPanel {
    fn default() -> Self {
        Self {
            is_open: false,
            by_keys: false,
            seconds: 12.0,
            turns: 1.0,
            keys: vec![],
            fps: 30.0,
            size_px: [1280, 720],
            samples: 4,
            white: false,
            bar: false,
            letters: false,
            played: None,
            chosen: Rc::default(),
            job: None,
        }
    }
}

/// From key to key where nobody says how long, seconds.
const BETWEEN_S: f64 = 3.0;

impl FilmPanel {
    /// Opens it, or closes it.
    pub fn toggle(&mut self) {
        self.is_open = !self.is_open;
    }

    /// Takes what the thread brought; `Err` is a sentence for the person.
    pub fn poll(&mut self, bench: &mut Bench) -> Result<(), String> {
        let Some(result) = self.job.as_ref().and_then(Job::poll) else { return Ok(()) };
        self.job = None;
        let file = result.map_err(|e| in_the_window(&e))?;
        bench.messages.note(format!("Saved {}", file.display()));
        Ok(())
    }

    /// Shows it while it is open; `painting` is what the surface wears.
    pub fn show(&mut self, ctx: &Context, bench: &mut Bench, painting: Option<Painting>) {
        let to = self.chosen.borrow_mut().take();
        if let Some(to) = to {
            let (panel, print) = self.ordered(bench, painting);
            self.job = Some(start(ctx, self.film(), panel, print, to));
        }
        self.play(ctx, &mut bench.work);
        if !self.is_open || bench.is_empty() {
            return;
        }
        let mut open = true;
        Window::new("Film").open(&mut open).default_pos([400.0, 90.0]).resizable(false).show(ctx, |ui| self.contents(ui, bench));
        self.is_open = open;
    }

    fn film(&self) -> Film {
        let last_s = self.keys.last().map_or(0.0, |key| key.at_s);
        if self.by_keys {
            return Film { seconds: last_s, fps: self.fps, turns: None, keys: self.keys.clone() };
        }
        Film { seconds: self.seconds, fps: self.fps, turns: Some(self.turns), keys: vec![] }
    }

    fn contents(&mut self, ui: &mut Ui, bench: &mut Bench) {
        ui.horizontal(|ui| {
            ui.radio_value(&mut self.by_keys, false, "Turntable").on_hover_text("Around the vertical of the view");
            ui.radio_value(&mut self.by_keys, true, "Keys").on_hover_text("From one view to the next: camera, isovalues, opacities, cuts");
        });
        if self.by_keys {
            self.key_list(ui, &mut bench.work);
        } else {
            ui.horizontal(|ui| {
                ui.add(DragValue::new(&mut self.seconds).range(0.5..=600.0).speed(0.1).max_decimals(1).suffix(" s"))
                    .accessible_name("Seconds of the film");
                ui.add(DragValue::new(&mut self.turns).range(-20.0..=20.0).speed(0.05).max_decimals(2).suffix(" turns"))
                    .accessible_name("Turns of the film");
            });
        }
        ui.separator();
        Grid::new("film").num_columns(2).spacing([16.0, 8.0]).show(ui, |ui| self.rows(ui));
        ui.separator();
        let film = self.film();
        let flaw = film.check(&bench.work.opened).err();
        let millis = bench.view.painted.as_ref().map_or(0.0, |p| p.millis);
        ui.weak(told(&film, self.size_px, self.samples, millis));
        if let Some(flaw) = &flaw {
            ui.colored_label(ui.visuals().warn_fg_color, in_the_window(&flaw.to_string()));
        }
        match &self.job {
            Some(job) if job.ui(ui) => self.job = None,
            Some(_) => {}
            None => self.buttons(ui, bench, flaw.is_none()),
        }
    }

    fn buttons(&mut self, ui: &mut Ui, bench: &mut Bench, can: bool) {
        ui.horizontal(|ui| {
            let play = ui.add_enabled(can, Button::new("Play")).on_hover_text("The way of the camera, in the picture");
            if play.clicked() {
                self.played = Some((ui.ctx().time(), bench.work.opened.scene.camera));
            }
            let hint = "A film that was cancelled goes on where it was when it is saved under the same name";
            if ui.add_enabled(can && bench.can_ask(), Button::new("Save film…")).on_hover_text(hint).clicked() {
                let chosen = Rc::clone(&self.chosen);
                let ask = Ask { title: "Save the film", kind: Kind::Save, forms: FORMS, name: "film.mp4" };
                bench.ask(ui.ctx(), ask, move |bench, _, files| match files.first().map(|file| (file, reel::Form::of(file))) {
                    Some((file, Ok(_))) => *chosen.borrow_mut() = Some(file.clone()),
                    Some((_, Err(error))) => bench.messages.error(error.to_string()),
                    None => {}
                });
            }
        });
    }

    /// The keys, in order of time.
    fn key_list(&mut self, ui: &mut Ui, work: &mut Work) {
        let mut gone = None;
        for (n, key) in self.keys.iter_mut().enumerate() {
            ui.horizontal(|ui| {
                let time = DragValue::new(&mut key.at_s).range(0.0..=3600.0).speed(0.05).max_decimals(2).suffix(" s");
                ui.add(time).accessible_name(format!("Time of key {}", n + 1));
                if ui.button("Look").on_hover_text("Shows what the key shows").accessible_name(format!("Look at key {}", n + 1)).clicked() {
                    apply(key, work);
                }
                if ui.button("×").on_hover_text("Takes the key away").accessible_name(format!("Take key {} away", n + 1)).clicked() {
                    gone = Some(n);
                }
            });
        }
        gone.map(|n| self.keys.remove(n));
        self.keys.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
        if ui.button("Add what is seen as a key").clicked() {
            let at_s = self.keys.last().map_or(0.0, |key| key.at_s + BETWEEN_S);
            self.keys.push(key_of(work, at_s));
        }
    }

    fn rows(&mut self, ui: &mut Ui) {
        ui.label("Pixels");
        ui.horizontal(|ui| {
            for (px, name) in self.size_px.iter_mut().zip(["Width of the film", "Height of the film"]) {
                // MP4 has an even number.
                let mut half = *px / 2;
                let number = DragValue::new(&mut half).range(8..=2048).custom_formatter(|v, _| format!("{}", 2.0 * v));
                ui.add(number.custom_parser(|text| text.parse::<f64>().ok().map(|v| v / 2.0))).accessible_name(name);
                *px = 2 * half;
            }
            ui.add(DragValue::new(&mut self.fps).range(1.0..=120.0).max_decimals(0).suffix(" a second"))
                .accessible_name("Frames in a second");
        });
        ui.end_row();
        ui.label("Smooth");
        ui.horizontal(|ui| {
            for (samples, name) in [(1, "Quick"), (4, "4 points"), (16, "16 points")] {
                ui.radio_value(&mut self.samples, samples, name).on_hover_text("Of each pixel");
            }
        });
        ui.end_row();
        ui.label("Over it");
        ui.horizontal(|ui| {
            ui.checkbox(&mut self.bar, "Scale bar");
            ui.checkbox(&mut self.letters, "Letters of the sides");
            ui.checkbox(&mut self.white, "White ground");
        });
        ui.end_row();
    }

    /// What is to be drawn, and on what sheet.
    fn ordered(&self, bench: &Bench, painting: Option<Painting>) -> (Panel, Print) {
        let mut opened = bench.work.opened.clone();
        let mut coat = None;
        if let Some((scene, painted)) = painting {
            (opened.scene, opened.compare, coat) = (scene, Compare::Off, Some(painted));
        }
        // Films have no clear ground.
        let ground = if self.white { Some(Color([1.0; 3])) } else { opened.scene.background };
        opened.scene.background = Some(ground.unwrap_or(Color([0.0; 3])));
        let at_target = matches!(opened.scene.viewed_from().projection, Projection::Perspective { .. });
        let bar = self.bar.then_some(Bar { length_mm: None, at_target });
        let print = Print { size_px: self.size_px, samples: self.samples, bar, letters: self.letters, ..Print::default() };
        (Panel { opened, aim: None, coat }, print)
    }

    /// Lets the camera go its way in the picture, and back when it is through.
    fn play(&mut self, ctx: &Context, work: &mut Work) {
        let Some((since, before)) = self.played else { return };
        let (film, at_s) = (self.film(), ctx.time() - since);
        let ends = at_s >= film.seconds || film.check(&work.opened).is_err();
        let mut from = work.opened.clone();
        from.scene.camera = before;
        work.opened.scene.camera = if ends { before } else { film.opened_at(&from, (at_s * film.fps) as u32).scene.camera };
        if ends {
            self.played = None;
        }
        ctx.request_repaint();
    }
}

const FORMS: &[(&str, &[&str])] = &[("Film", &["mp4"]), ("Animated picture", &["apng", "gif"])];

/// What is seen now.
fn key_of(work: &Work, at_s: f64) -> Key {
    let scene = &work.opened.scene;
    let offset = |shape: &Shape| if let Shape::Plane { offset_mm, .. } = shape { *offset_mm } else { 0.0 };
    let cuts: Vec<f64> = scene.clips.iter().map(|clip| offset(&clip.shape)).collect();
    Key {
        at_s,
        camera: Some(scene.camera),
        iso: Some(scene.layers.iter().map(|layer| layer.iso).collect()),
        opacity: Some(scene.layers.iter().map(|layer| f64::from(layer.opacity)).collect()),
        cut_offsets_mm: Some(cuts).filter(|cuts| !cuts.is_empty()),
        ..Key::default()
    }
}

/// Shows what a key shows.
fn apply(key: &Key, work: &mut Work) {
    let film = Film { seconds: 1.0, fps: 1.0, turns: None, keys: vec![Key { at_s: 0.0, ..key.clone() }] };
    if film.check(&work.opened).is_ok() {
        work.opened = film.opened_at(&work.opened, 0);
    }
}

/// Frames, time and bytes, before anything is drawn.
fn told(film: &Film, [width, height]: [u32; 2], samples: u32, millis: f64) -> String {
    // About 0.22 bits a pixel at the quality of MP4 that is taken here (docs/film.md).
    let megabytes = f64::from(film.frames()) * f64::from(width) * f64::from(height) * 0.22 / 8e6;
    let seconds = f64::from(film.frames()) * millis * f64::from(samples) / 1e3;
    let time = if seconds < 90.0 { format!("{seconds:.0} s") } else { format!("{:.0} min", seconds / 60.0) };
    format!("{} frames, {} s; drawn in about {time}, about {megabytes:.1} MB as MP4", film.frames(), film.seconds)
}

/// Draws and writes it on a thread of its own.
fn start(ctx: &Context, film: Film, panel: Panel, mut print: Print, file: PathBuf) -> Job<PathBuf> {
    Job::start(ctx, "Filming".into(), move |progress| -> Result<PathBuf, String> {
        let mut panels = [panel];
        prepare(&mut panels, &mut print).map_err(|e| e.to_string())?;
        let mut renderer = Machine::Auto.renderer().map_err(|e| e.to_string())?;
        let drawn_by = renderer.name();
        let reel = Reel::begin(&file, &film, &panels[0], &print, &drawn_by).map_err(|e| e.to_string())?;
        write(&reel, &panels[0], QUALITY, renderer.as_mut(), progress).map_err(|e| e.to_string())?;
        Ok(file)
    })
}
