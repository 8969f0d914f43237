//! A film of what is shown: a turntable, or what goes from key to key, put together by hand or recorded; played in the picture, told before it is saved,
//! drawn beside the window. What moves belongs to the work; how its file is drawn to this panel.

use super::super::ask::{Ask, Kind};
use super::super::bench::Bench;
use super::super::widgets::{self, number};
use super::super::words::in_the_window;
use super::Painting;
use super::saving::Saving;
use bregma_field::Progress;
use bregma_renderer::{Color, Projection};
use bregma_session::film::{Film, Key, QUALITY, Reel, reel, write};
use bregma_session::print::{Bar, Panel, Print, prepare};
use bregma_session::studio::Told;
use bregma_session::{Compare, Machine, Opened};
use egui::{Button, Context, DragValue, Grid, ScrollArea, Ui, Window};
use std::path::Path;
use std::sync::Arc;

/// The window that makes films.
pub struct FilmPanel {
    is_open: bool,
    /// Keys of a film that is a turntable meanwhile.
    put_by: Vec<Key>,
    size_px: [u32; 2],
    /// Points of each pixel, and under studio light.
    samples: u32,
    lit_samples: u32,
    white: bool,
    bar: bool,
    letters: bool,
    saving: Saving,
}

impl Default for FilmPanel {
    fn default() -> Self {
        let (is_open, put_by, white, bar, letters) = (false, vec![], false, false, false);
        Self { is_open, put_by, size_px: [1280, 720], samples: 4, lit_samples: 64, white, bar, letters, saving: Saving::default() }
    }
}

/// From key to key where nobody says how long, seconds.
const BETWEEN_S: f64 = 3.0;
/// Across a key of the strip, in points.
const KEY: f32 = 86.0;

impl FilmPanel {
    /// Opens it, or closes it.
    pub fn toggle(&mut self) {
        self.is_open = !self.is_open;
    }

    /// Takes what the thread brought; `Err` is a sentence for the person.
    pub fn poll(&mut self, bench: &mut Bench) -> Result<(), String> {
        self.saving.poll(bench)
    }

    /// Shows it while it is open; `painting` is what the surface wears.
    pub fn show(&mut self, ctx: &Context, bench: &mut Bench, painting: Option<Painting>) {
        if let Some(to) = self.saving.chosen() {
            let (panel, print) = self.ordered(bench, painting);
            let film = bench.work.opened.film.as_deref().cloned().unwrap_or_default();
            self.saving.start(ctx, "Filming", to, move |file, progress| saved(&film, panel, print, file, progress));
        }
        if !self.is_open || bench.is_empty() {
            return;
        }
        let mut open = true;
        widgets::beside_view(ctx, Window::new("Film")).open(&mut open).resizable(false).show(ctx, |ui| self.contents(ui, bench));
        self.is_open = open;
    }

    fn contents(&mut self, ui: &mut Ui, bench: &mut Bench) {
        let mut film = bench.work.opened.film.as_deref().cloned().unwrap_or_default();
        let before = film.clone();
        self.kind(ui, &mut film);
        if film.turns.is_none() {
            keys(ui, &mut film.keys, &mut bench.work.opened);
        }
        ui.separator();
        let is_lit = bench.work.opened.scene.studio.is_some();
        Grid::new("film").num_columns(2).spacing([16.0, 8.0]).show(ui, |ui| self.rows(ui, &mut film.fps, is_lit));
        ui.separator();
        if film.keys != before.keys && film.turns.is_none() {
            film.seconds = film.keys.last().map_or(0.0, |key| key.at_s);
        }
        let flaw = film.check(&bench.work.opened).err();
        let painted = bench.view.painted.as_ref();
        let frame_s = if is_lit {
            painted.and_then(|p| p.exposed).map(|(told, _)| self.lit_frame_s(&told))
        } else {
            painted.map(|p| p.millis * f64::from(self.samples) / 1e3)
        };
        ui.weak(told(&film, self.size_px, frame_s));
        if let Some(flaw) = &flaw {
            ui.colored_label(ui.visuals().warn_fg_color, in_the_window(&flaw.to_string()));
        }
        // A film that nobody made is none, and no change of the work.
        if film != before {
            bench.work.opened.film = Some(Arc::new(film.clone()));
        }
        if !self.saving.is_at_work(ui) {
            self.buttons(ui, bench, &film, flaw.is_none());
        }
    }

    /// What is filmed: once around, or from key to key.
    fn kind(&mut self, ui: &mut Ui, film: &mut Film) {
        let mut by_keys = film.turns.is_none();
        ui.horizontal(|ui| {
            ui.radio_value(&mut by_keys, false, "Turntable").on_hover_text("Around the vertical of the view");
            ui.radio_value(&mut by_keys, true, "Keys").on_hover_text("From one view to the next: camera, isovalues, opacities, cuts");
        });
        if by_keys && film.turns.is_some() {
            *film = Film { turns: None, keys: std::mem::take(&mut self.put_by), ..film.clone() };
            film.seconds = film.keys.last().map_or(0.0, |key| key.at_s);
        } else if !by_keys && film.turns.is_none() {
            self.put_by = std::mem::take(&mut film.keys);
            *film = Film { fps: film.fps, ..Film::default() };
        }
        let Some(turns) = &mut film.turns else { return };
        ui.horizontal(|ui| {
            ui.add(DragValue::new(&mut film.seconds).range(0.5..=600.0).speed(0.1).max_decimals(1).suffix(" s"))
                .accessible_name("Seconds of the film");
            ui.add(DragValue::new(turns).range(-20.0..=20.0).speed(0.05).max_decimals(2).suffix(" turns"))
                .accessible_name("Turns of the film");
        });
    }

    fn buttons(&mut self, ui: &mut Ui, bench: &mut Bench, film: &Film, can: bool) {
        ui.horizontal(|ui| {
            let ctx = ui.ctx().clone();
            let is_taken = bench.recorded_s(&ctx).is_some();
            if bench.plays() {
                if ui.button("Stop").clicked() {
                    bench.playing = None;
                }
            } else if ui.add_enabled(can && !is_taken, Button::new("Preview")).on_hover_text("Plays it in the picture, coarsely").clicked()
            {
                bench.play(&ctx, Arc::new(film.clone()), false);
            }
            let hint = "What you do in the view until you stop becomes the film: turning, isovalues, opacities, cuts";
            if ui.button(if is_taken { "Stop recording" } else { "Record" }).on_hover_text(hint).clicked() {
                bench.toggle_recording(&ctx);
            }
            let ask = Ask { title: "Save the film", kind: Kind::Save, forms: FORMS, name: "film.mp4" };
            let hint = "A film that was cancelled goes on where it was when it is saved under the same name";
            let check = |file: &Path| reel::Form::of(file).map(|_| ()).map_err(|e| e.to_string());
            self.saving.button(ui, bench, can && !is_taken, ("Save film…", hint), ask, check);
        });
    }

    fn rows(&mut self, ui: &mut Ui, fps: &mut f64, is_lit: bool) {
        ui.label("Pixels");
        ui.horizontal(|ui| {
            for (px, name) in self.size_px.iter_mut().zip(["Width of the film", "Height of the film"]) {
                // MP4 has an even number.
                let mut half = *px / 2;
                let number = DragValue::new(&mut half).range(8..=2048).custom_formatter(|v, _| format!("{}", 2.0 * v));
                ui.add(number.custom_parser(|text| text.parse::<f64>().ok().map(|v| v / 2.0))).accessible_name(name);
                *px = 2 * half;
            }
            ui.add(DragValue::new(fps).range(1.0..=120.0).max_decimals(0).suffix(" a second")).accessible_name("Frames in a second");
        });
        ui.end_row();
        let (label, samples, choices) = if is_lit {
            ("Studio light", &mut self.lit_samples, [(16, "16 samples"), (64, "64 samples"), (256, "256 samples")])
        } else {
            ("Smooth", &mut self.samples, [(1, "Quick"), (4, "4 points"), (16, "16 points")])
        };
        ui.label(label);
        ui.horizontal(|ui| {
            for (count, name) in choices {
                ui.radio_value(samples, count, name).on_hover_text("Of each pixel");
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
        let samples = if opened.scene.studio.is_some() { self.lit_samples } else { self.samples };
        let print = Print { size_px: self.size_px, samples, bar, letters: self.letters, ..Print::default() };
        (Panel { opened, aim: None, coat }, print)
    }

    /// About how long a frame under studio light takes, by what a sample in the view takes, seconds.
    fn lit_frame_s(&self, told: &Told) -> f64 {
        let pixels = f64::from(self.size_px[0]) * f64::from(self.size_px[1]);
        pixels * f64::from(self.lit_samples) * told.sample_s
    }
}

const FORMS: &[(&str, &[&str])] = &[("Film", &["mp4"]), ("Animated picture", &["apng", "gif"])];

/// The keys, in order of time, as a strip.
fn keys(ui: &mut Ui, keys: &mut Vec<Key>, opened: &mut Opened) {
    let (mut gone, mut swapped) = (None, None);
    let count = keys.len();
    ScrollArea::horizontal().max_width(5.0 * KEY).show(ui, |ui| {
        ui.horizontal(|ui| {
            for (n, key) in keys.iter_mut().enumerate() {
                ui.vertical(|ui| {
                    ui.set_width(KEY - ui.spacing().item_spacing.x);
                    let number = Button::new(format!("{}", n + 1)).min_size([ui.available_width(), 30.0].into());
                    if ui.add(number).on_hover_text("Shows what the key shows").accessible_name(format!("Look at key {}", n + 1)).clicked()
                    {
                        apply(key, opened);
                    }
                    let time = DragValue::new(&mut key.at_s).range(0.0..=3600.0).speed(0.05).max_decimals(2).suffix(" s");
                    ui.add(time).accessible_name(format!("Time of key {}", n + 1));
                    ui.horizontal(|ui| {
                        ui.spacing_mut().item_spacing.x = 2.0;
                        let small = |ui: &mut Ui, can: bool, text: &str, name: String| {
                            ui.add_enabled(can, Button::new(text).small()).on_hover_text(&name).accessible_name(name).clicked()
                        };
                        if small(ui, n > 0, "◀", format!("Bring key {} forward", n + 1)) {
                            swapped = Some([n - 1, n]);
                        }
                        if small(ui, n + 1 < count, "▶", format!("Put key {} back", n + 1)) {
                            swapped = Some([n, n + 1]);
                        }
                        if small(ui, true, "×", format!("Take key {} away", n + 1)) {
                            gone = Some(n);
                        }
                    });
                });
            }
        });
    });
    if let Some([a, b]) = swapped {
        // What they show changes places; the times stay.
        let at_s = [keys[a].at_s, keys[b].at_s];
        keys.swap(a, b);
        [keys[a].at_s, keys[b].at_s] = at_s;
    }
    gone.map(|n| keys.remove(n));
    keys.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
    if ui.button("Add what is seen as a key").clicked() {
        let at_s = keys.last().map_or(0.0, |key| key.at_s + BETWEEN_S);
        keys.push(Key::of(opened, at_s));
    }
}

/// Shows what a key shows.
fn apply(key: &Key, opened: &mut Opened) {
    let film = Film { seconds: 1.0, fps: 1.0, turns: None, keys: vec![Key { at_s: 0.0, ..key.clone() }] };
    if film.check(opened).is_ok() {
        *opened = film.opened_at(opened, 0);
    }
}

/// Frames, time and bytes, before anything is drawn; `frame_s` is how long a frame takes, where that is known.
fn told(film: &Film, [width, height]: [u32; 2], frame_s: Option<f64>) -> String {
    // About 0.22 bits a pixel at the quality of MP4 that is taken here (docs/film.md).
    let megabytes = f64::from(film.frames()) * f64::from(width) * f64::from(height) * 0.22 / 8e6;
    let time = match frame_s.map(|frame_s| f64::from(film.frames()) * frame_s) {
        None => "how long it takes is told once the view was lit".into(),
        Some(seconds) if seconds < 90.0 => format!("drawn in about {seconds:.0} s"),
        Some(seconds) => format!("drawn in about {:.0} min", seconds / 60.0),
    };
    let seconds = number(film.seconds, 0..=2);
    format!("{} frames, {seconds} s; {time}, about {megabytes:.1} MB as MP4", film.frames())
}

/// Draws and writes it.
fn saved(film: &Film, panel: Panel, mut print: Print, file: &Path, progress: &Progress) -> Result<(), String> {
    let mut panels = [panel];
    prepare(&mut panels, &mut print).map_err(|e| e.to_string())?;
    let mut renderer = Machine::Auto.renderer().map_err(|e| e.to_string())?;
    let drawn_by = renderer.name();
    let reel = Reel::begin(file, film, &panels[0], &print, &drawn_by).map_err(|e| e.to_string())?;
    write(&reel, &panels[0], QUALITY, renderer.as_mut(), progress).map_err(|e| e.to_string())
}
