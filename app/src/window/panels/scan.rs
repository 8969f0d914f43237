//! What is known of a scan, and what is seldom changed of it: its name and place in the list, its spacing, how it lies. A copy of it is saved here.

use super::super::ask::{Ask, Kind};
use super::super::bench::Bench;
use super::super::measured::Work;
use super::super::words::{in_the_window, type_words};
use super::saving::Saving;
use bregma_field::formats;
use bregma_field::{Correction, Turn, Volume};
use bregma_measure::export::suffix;
use bregma_session::{Opened, Source};
use egui::{Context, DragValue, Grid, Label, RichText, ScrollArea, TextEdit, Ui, Window};
use glam::DVec3;
use std::path::Path;
use std::sync::Arc;

/// The panel, which shows one scan.
#[derive(Default)]
pub struct ScanPanel {
    of: Option<Arc<Volume>>,
    /// What is being typed.
    name: String,
    spacing_mm: DVec3,
    /// A mirror image was asked for.
    asked: Asked,
    saving: Saving,
}

/// How often the person was asked whether a mirror image is meant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Asked {
    #[default]
    Never,
    Once,
    Twice,
}

/// Turns by the hand that they are made with: the axis that they go about, its name, and what a quarter one way and the other is called.
const TURNS: [(DVec3, &str, [&str; 2]); 3] = [
    (DVec3::X, "left–right", ["Nod forward", "Nod back"]),
    (DVec3::Y, "front–back", ["Tilt to the left", "Tilt to the right"]),
    (DVec3::Z, "up–down", ["Face to the left", "Face to the right"]),
];

impl ScanPanel {
    /// Shows that scan from now on.
    pub fn open(&mut self, opened: &Opened, n: usize) {
        let volume = &opened.volumes[n];
        self.name = opened.sources[n].name();
        self.spacing_mm = volume.placing().spacing_mm();
        (self.of, self.asked) = (Some(Arc::clone(volume)), Asked::Never);
    }

    /// Shows the panel, if it is open and its scan is.
    pub fn show(&mut self, ctx: &Context, bench: &mut Bench) {
        if let Err(error) = self.saving.poll(bench) {
            bench.messages.error(error);
        }
        let Some(shown) = &self.of else { return };
        let volumes = &bench.work.opened.volumes;
        let same = |v: &Arc<Volume>| Arc::ptr_eq(v, shown);
        // Undo brings back another state of the same scan.
        let like = |v: &Arc<Volume>| v.samples_id() == shown.samples_id();
        let Some(n) = volumes.iter().position(same).or_else(|| volumes.iter().position(like)) else {
            self.of = None;
            return;
        };
        if !same(&volumes[n]) {
            self.open(&bench.work.opened, n);
        }
        let mut open = true;
        // The scroll area has what the title and the margins leave of a low window.
        let height = (ctx.content_rect().height() - 150.0).clamp(160.0, 620.0);
        let window = Window::new("Scan").open(&mut open).default_pos([6.0, 34.0]).default_width(WIDTH).resizable([true, false]);
        window.show(ctx, |ui| {
            ScrollArea::vertical().max_height(height).min_scrolled_height(height).show(ui, |ui| self.contents(ui, bench, n));
        });
        if !open {
            self.of = None;
        }
    }

    fn contents(&mut self, ui: &mut Ui, bench: &mut Bench, n: usize) {
        ui.set_width(WIDTH);
        self.name_and_place(ui, &mut bench.work, n);
        // It may have changed its place, and is another one where it was renamed.
        let Some(shown) = &self.of else { return };
        let Some(n) = bench.work.opened.volumes.iter().position(|v| Arc::ptr_eq(v, shown)) else { return };
        facts(ui, &bench.work.opened.sources[n], &bench.work.opened.volumes[n]);
        self.save(ui, bench, n);
        ui.separator();
        let spaced = self.spacing(ui, &bench.work.opened.volumes[n]);
        ui.separator();
        let turned = self.turns(ui, &bench.work, n);
        said(ui, &bench.work.opened.volumes[n]);
        if let Some(correction) = spaced.or(turned) {
            match correct(&mut bench.work, n, correction) {
                Ok(()) => self.open(&bench.work.opened, n),
                Err(error) => bench.messages.error(format!("{}: {error}", bench.work.opened.volumes[n].name())),
            }
        }
    }

    fn name_and_place(&mut self, ui: &mut Ui, work: &mut Work, n: usize) {
        let last = work.opened.volumes.len() - 1;
        let (mut to, mut is_done) = (None, false);
        ui.horizontal_top(|ui| {
            let width = if last > 0 { WIDTH - 150.0 } else { WIDTH };
            // In as many lines as it takes to be read; Enter ends it.
            let edit = TextEdit::multiline(&mut self.name).desired_rows(1).desired_width(width - 8.0).char_limit(MOST_LETTERS);
            let edit = ui.add(edit.hint_text(work.opened.sources[n].file_name()));
            let edit = edit.on_hover_text("The name of the scan, here and in all tables; without one it is its file's");
            let edit = edit.accessible_name("Name of the scan");
            is_done = edit.lost_focus() || self.name.contains('\n');
            if is_done {
                edit.surrender_focus();
            }
            if last > 0 {
                let moves = |ui: &mut Ui, text, hint, can| ui.add_enabled(can, egui::Button::new(text)).on_hover_text(hint).clicked();
                if moves(ui, "Earlier", "Up in the list; the first is A", n > 0) {
                    to = Some(n - 1);
                }
                if moves(ui, "Later", "Down in the list", n < last) {
                    to = Some(n + 1);
                }
            }
        });
        if is_done {
            self.name.retain(|c| c != '\n');
            rename(work, n, &self.name);
        }
        if let Some(to) = to {
            work.opened.swap(n, to);
        }
        if !work.opened.volumes.iter().any(|v| self.of.as_ref().is_some_and(|of| Arc::ptr_eq(v, of))) {
            self.open(&work.opened, to.unwrap_or(n));
        }
    }

    /// Saves the scan as it lies now in a form that holds all of it.
    fn save(&mut self, ui: &mut Ui, bench: &mut Bench, n: usize) {
        if let Some(file) = self.saving.chosen() {
            let volume = Arc::clone(&bench.work.opened.volumes[n]);
            self.saving.start(ui.ctx(), "Saving the scan", file, move |file, progress| {
                formats::write(file, &volume, progress).map(drop).map_err(|e| e.to_string())
            });
        }
        if !self.saving.is_at_work(ui) {
            let hint = "As it lies now, in a form that holds all of it; OME-Zarr is in chunks that napari and neuroglancer read, too";
            let check = |file: &Path| formats::writer(file).map(drop).map_err(|e| e.to_string());
            self.saving.button(ui, bench, true, ("Save a copy…", hint), SAVE, check);
        }
    }

    /// Gives the correction that is asked for.
    fn spacing(&mut self, ui: &mut Ui, volume: &Volume) -> Option<Correction> {
        let (placing, mut asked) = (volume.placing(), None);
        ui.strong("Spacing");
        ui.horizontal(|ui| {
            for (axis, name) in ["i", "j", "k"].into_iter().enumerate() {
                let value = DragValue::new(&mut self.spacing_mm[axis]).range(1e-6..=1000.0).speed(0.01).max_decimals(6);
                let label = ui.weak(name).id;
                ui.add(value.update_while_editing(false)).labelled_by(label).accessible_name(format!("Spacing along {name}"));
            }
            ui.weak("mm");
        });
        let correction = placing.correction();
        let is_new = self.spacing_mm != placing.spacing_mm();
        ui.horizontal(|ui| {
            let button = ui.add_enabled(is_new, egui::Button::new("Correct the spacing"));
            if button.on_disabled_hover_text("Change a number that is wrong first").clicked() {
                asked = Some(Correction { spacing_mm: Some(self.spacing_mm), ..correction });
            }
            if placing.overridden_mm().is_some() && ui.button("As the file states").on_hover_text("Take the file's spacing again").clicked()
            {
                asked = Some(Correction { spacing_mm: None, ..correction });
            }
        });
        asked
    }

    /// Gives the correction that is asked for.
    fn turns(&mut self, ui: &mut Ui, work: &Work, n: usize) -> Option<Correction> {
        let correction = work.opened.volumes[n].placing().correction();
        let mut next = None;
        ui.strong("How it lies");
        if work.opened.scene.layers[n].transform != glam::DAffine3::IDENTITY {
            ui.colored_label(ui.visuals().warn_fg_color, "It is registered as it lies now: turn it only if that was wrong, too.");
        }
        Grid::new("turns").spacing([6.0, 4.0]).show(ui, |ui| {
            for (axis, name, quarters) in TURNS {
                for (degrees, text) in [(90, quarters[0]), (-90, quarters[1])] {
                    if ui.button(text).on_hover_text(format!("By 90° about the axis {name}")).clicked() {
                        next = Some(Turn::about(axis, degrees));
                    }
                }
                let half = ui.button("180°").on_hover_text(format!("Half a turn about the axis {name}"));
                if half.accessible_name(format!("180° about {name}")).clicked() {
                    next = Some(Turn::about(axis, 180));
                }
                ui.end_row();
            }
        });
        let mut turn = next.map(|next| correction.turn.then(next));
        ui.horizontal(|ui| {
            if correction.turn.is_mirror() {
                // Its mirror image is what the file states, but for a turn.
                if ui.button("No mirror image").clicked() {
                    turn = Some(correction.turn.then(Turn::mirror()));
                }
            } else if ui.button("Mirror…").on_hover_text("Left and right change places").clicked() {
                self.asked = Asked::Once;
            }
            if !correction.turn.is_none() && ui.button("As the file lies").on_hover_text("Take all turns back").clicked() {
                turn = Some(Turn::default());
            }
        });
        if self.mirrors(ui) {
            turn = Some(correction.turn.then(Turn::mirror()));
        }
        turn.map(|turn| Correction { turn, ..correction })
    }

    /// Asks twice whether a mirror image is meant. True when it is.
    fn mirrors(&mut self, ui: &mut Ui) -> bool {
        let (question, yes) = match self.asked {
            Asked::Never => return false,
            Asked::Once => (
                "Right becomes left: a mirror image cannot be told from another skull. To stand a scan up or to turn it to the front, turn it.",
                "Mirror it all the same",
            ),
            Asked::Twice => {
                ("Is its file known to be a mirror image? All that is measured on it will say that it was mirrored.", "It is: mirror it")
            }
        };
        ui.colored_label(ui.visuals().warn_fg_color, question);
        let mut is_meant = false;
        ui.horizontal(|ui| {
            if ui.button(yes).clicked() {
                is_meant = self.asked == Asked::Twice;
                self.asked = if is_meant { Asked::Never } else { Asked::Twice };
            }
            if ui.button("Leave it").clicked() {
                self.asked = Asked::Never;
            }
        });
        is_meant
    }
}

/// Where a copy is saved, and as what.
const SAVE: Ask = Ask {
    title: "Save a copy of the scan",
    kind: Kind::Save,
    forms: &[("NRRD", &["nrrd"]), ("OME-Zarr, in chunks", &["ome.zarr", "zarr"]), ("MetaImage", &["mha"])],
    name: "scan.nrrd",
};

/// Width of the contents, in points: the panel lies over the cards, so that the picture is seen beside it.
const WIDTH: f32 = 350.0;
/// A longer name is no name.
const MOST_LETTERS: usize = 120;

/// Puts a scan where `correction` has it, and with it the landmarks that are its own.
fn correct(work: &mut Work, n: usize, correction: Correction) -> Result<(), bregma_field::GridError> {
    let moved = work.opened.correct(n, correction)?;
    work.measured.move_landmarks(work.opened.volumes[n].name(), &moved);
    Ok(())
}

/// Gives a scan another name, by which its landmarks know it, too.
fn rename(work: &mut Work, n: usize, name: &str) {
    if name == work.opened.sources[n].name() {
        return;
    }
    let before = work.opened.volumes[n].name().to_owned();
    work.opened.rename(n, name);
    let after = work.opened.volumes[n].name();
    let own = work.measured.landmarks.iter_mut().filter(|l| l.scan.as_ref() == Some(&before));
    own.for_each(|l| l.scan = Some(after.to_owned()));
}

/// What the scan is.
fn facts(ui: &mut Ui, source: &Source, volume: &Volume) {
    let [nx, ny, nz] = volume.grid().dims();
    let [low, high] = volume.range();
    let place = if source.built_in.is_some() { "made by this program".to_owned() } else { source.absolute().file.display().to_string() };
    let mib = volume.sample_bytes() as f64 / f64::from(1 << 20);
    let round = |value: f64| (value * 1e3).round() / 1e3;
    Grid::new("facts").spacing([10.0, 3.0]).num_columns(2).show(ui, |ui| {
        let mut fact = |name: &str, text: String| {
            ui.weak(name);
            // What is longer than its line is there to be pointed at.
            ui.add(Label::new(&text).truncate()).on_hover_text(text);
            ui.end_row();
        };
        fact("File", place);
        fact("Form", volume.format().to_owned());
        fact("Samples", format!("{nx} × {ny} × {nz} of {}; {mib:.1} MiB", type_words(volume.type_name())));
        fact("Values", format!("{} to {}{}", round(low), round(high), suffix(volume.unit())));
    });
}

/// What its header says, and what is unusual about it.
fn said(ui: &mut Ui, volume: &Volume) {
    if !volume.warnings().is_empty() {
        ui.separator();
        ui.strong("Warnings");
        for warning in volume.warnings() {
            ui.label(RichText::new(in_the_window(warning)).color(ui.visuals().warn_fg_color));
        }
    }
    if volume.metadata().is_empty() {
        return;
    }
    ui.separator();
    ui.strong("The header says");
    Grid::new("header").spacing([10.0, 3.0]).num_columns(2).show(ui, |ui| {
        for (name, text) in volume.metadata() {
            ui.add(Label::new(RichText::new(name).weak()).truncate());
            ui.add(Label::new(text).truncate()).on_hover_text(text);
            ui.end_row();
        }
    });
}
