//! The parts of a scan: how they are found, which of them are kept, and the label map that they are written as.

use super::super::ask::{Ask, Kind};
use super::super::bench::Bench;
use super::super::job::{Job, is_at_work};
use super::super::widgets::{choose_scans, color, line};
use super::super::words::in_the_window;
use bregma_field::{Progress, Volume};
use bregma_measure::numbers::{fixed, significant, suffix};
use bregma_renderer::{Layer, Within};
use bregma_session::{How, Labelled, Listed, PartOf, PartOfError};
use egui::{Align, Button, Checkbox, Context, DragValue, Key, Label, Layout, RichText, ScrollArea, Sense, TextEdit, Ui, vec2};
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Where the person's answer comes from, and what is saved there; none where it is opened.
type Asked = (Receiver<(Context, PathBuf)>, Option<Labelled>);

/// The panel.
pub struct PartsPanel {
    /// Number of the scan.
    index: usize,
    neck_mm: f64,
    job: Option<Job<Outcome>>,
    /// The parts that are to be left out, while what is kept is worked out; and since when.
    wanted: Option<(BTreeSet<u16>, Instant)>,
    /// A file that was asked for, and what is written to it; else it is read.
    asked: Option<Asked>,
    /// The part whose name is being typed.
    naming: Option<(u16, String)>,
    /// Only what is seen is of the parts that are kept.
    only_seen: bool,
}

impl Default for PartsPanel {
    fn default() -> Self {
        Self { index: 0, neck_mm: 4.0, job: None, wanted: None, asked: None, naming: None, only_seen: false }
    }
}

enum Outcome {
    Parted(Box<Parted>),
    Saved(PathBuf, Vec<String>),
}

/// Parts of a scan.
struct Parted {
    volume: Arc<Volume>,
    labelled: Labelled,
    within: Option<Within>,
    /// The file that the map is in.
    file: Option<PathBuf>,
    notes: Vec<String>,
}

/// Parts that have a row of their own.
const MOST_ROWS: usize = 50;
/// What takes no longer than this needs no bar.
const SOON: Duration = Duration::from_millis(200);
/// Thicknesses of necks, mm.
const NECKS_MM: std::ops::RangeInclusive<f64> = 0.01..=100.0;

impl PartsPanel {
    /// Takes what the thread brought; `Err` is a sentence for the person.
    pub fn poll(&mut self, bench: &mut Bench) -> Result<(), String> {
        if let Some((ctx, file)) = self.asked.as_ref().and_then(|(asked, _)| asked.try_recv().ok()) {
            match self.asked.take().and_then(|(_, labelled)| labelled) {
                Some(labelled) => self.save(&ctx, labelled, file),
                None => self.find(&ctx, bench, How::File(file)),
            }
        }
        let Some(result) = self.job.as_ref().and_then(Job::poll) else { return Ok(()) };
        (self.job, self.wanted) = (None, None);
        match result.map_err(|e| format!("No parts: {}", in_the_window(&e)))? {
            Outcome::Parted(parted) => take(bench, *parted)?,
            Outcome::Saved(file, notes) => {
                bench.messages.note(format!("Saved {}", file.display()));
                notes.into_iter().for_each(|note| bench.messages.note(note));
            }
        }
        Ok(())
    }

    /// Shows how parts are found, and those that were.
    pub fn show(&mut self, ui: &mut Ui, bench: &mut Bench) {
        self.index = self.index.min(bench.work.opened.volumes.len().saturating_sub(1));
        if bench.work.opened.volumes.len() > 1 {
            choose_scans(ui, &bench.work.opened, std::slice::from_mut(&mut self.index), &[("Of", "Scan to part")]);
        }
        if self.wanted.as_ref().is_some_and(|(_, since)| since.elapsed() < SOON) {
            ui.ctx().request_repaint_after(SOON);
            self.deeds(ui, bench);
        } else if !is_at_work(&mut self.job, ui) {
            self.wanted = None;
            self.deeds(ui, bench);
        }
        let Some(labelled) = bench.work.opened.sources.get(self.index).and_then(|source| source.labels.clone()) else {
            ui.weak("Keep the skull leaves the head rest, the table, the paw out. Find islands lists all bone that hangs together.");
            return;
        };
        ui.separator();
        self.above_list(ui, bench, &labelled);
        // What is looked for takes the place of the list.
        let is_free = self.job.is_none() || self.wanted.is_some();
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            ui.add_enabled_ui(is_free, |ui| self.list(ui, bench, &labelled));
        });
    }

    /// What finds parts, reads and writes them.
    fn deeds(&mut self, ui: &mut Ui, bench: &mut Bench) {
        let ctx = ui.ctx().clone();
        let hint = "The skull without head rest, table, paw and crumbs; Undo brings them back";
        if ui.button("Keep the skull").on_hover_text(hint).clicked() {
            self.find(&ctx, bench, How::Skull);
        }
        if ui.button("Find islands").on_hover_text("All bone that hangs together is a part").clicked() {
            self.find(&ctx, bench, How::Islands);
        }
        ui.horizontal(|ui| {
            let hint = "Bones apart where what joins them is not thicker, as a jaw from its skull";
            let separates = ui.button("Separate at necks").on_hover_text(hint).clicked();
            let number = DragValue::new(&mut self.neck_mm).range(NECKS_MM).speed(0.05).max_decimals(2).suffix(" mm");
            ui.add(number.update_while_editing(false)).on_hover_text("How thick a neck is at most").accessible_name("Thickness of necks");
            if separates {
                self.find(&ctx, bench, How::Separate { neck_mm: self.neck_mm });
            }
        });
        ui.horizontal(|ui| {
            let opens =
                ui.button("Open label map…").on_hover_text("The parts as 3D Slicer or another program has them: .seg.nrrd, NIfTI, …");
            if opens.clicked() {
                self.ask(&ctx, bench, Ask::open("Open a label map", Kind::Files), None);
            }
            let labelled = bench.work.opened.sources.get(self.index).and_then(|source| source.labels.clone());
            let saves =
                ui.add_enabled(labelled.is_some(), Button::new("Save label map…")).on_disabled_hover_text("No parts were found yet");
            let saves = saves.on_hover_text("The parts with their names and colours, for 3D Slicer and others");
            if saves.clicked() {
                self.ask(&ctx, bench, SAVE, labelled);
            }
        });
    }

    /// Asks for a file to read, or to write parts to.
    fn ask(&mut self, ctx: &Context, bench: &mut Bench, ask: Ask, writes: Option<Labelled>) {
        let (send, asked) = channel();
        self.asked = Some((asked, writes));
        bench.ask(ctx, ask, move |_, ctx, files| {
            // The panel may ask for another one by now.
            let _ = send.send((ctx.clone(), files[0].clone()));
        });
    }

    fn save(&mut self, ctx: &Context, labelled: Labelled, file: PathBuf) {
        let work = move |progress: &Progress| labelled.write(&file, progress).map(|notes| Outcome::Saved(file, notes));
        self.job = Some(Job::start(ctx, "Writing the label map".into(), work));
    }

    /// Finds the parts of the scan that is chosen.
    fn find(&mut self, ctx: &Context, bench: &Bench, how: How) {
        let opened = &bench.work.opened;
        let Some((volume, layer)) = opened.volumes.get(self.index).cloned().zip(opened.scene.layers.get(self.index).cloned()) else {
            return;
        };
        let measures = !self.only_seen;
        let what = match how {
            How::Islands => "Looking for islands",
            How::Separate { .. } => "Separating",
            How::Skull => "Looking for the skull",
            How::File(_) => "Reading the label map",
        };
        let work = move |progress: &Progress| -> Result<Outcome, PartOfError> {
            let (labelled, notes) = Labelled::find(&how, (&volume, &layer), progress)?;
            let within = labelled.within(&volume, None, progress)?.map(|within| Within { measures, ..within });
            let file = if let How::File(file) = how { Some(file) } else { None };
            Ok(Outcome::Parted(Box::new(Parted { volume, labelled, within, file, notes })))
        };
        (self.wanted, self.naming) = (None, None);
        self.job = Some(Job::start(ctx, what.into(), work));
    }

    /// Leaves parts out.
    fn leave_out(&mut self, ctx: &Context, bench: &Bench, labelled: &Labelled, left_out: BTreeSet<u16>) {
        let opened = &bench.work.opened;
        let Some((volume, layer)) = opened.volumes.get(self.index).cloned().zip(opened.scene.layers.get(self.index)) else { return };
        let file = opened.sources[self.index].within.as_ref().map(|within| within.file.clone());
        let known = layer.within.as_ref().map(|within| Within { solid: None, ..within.clone() });
        let (labelled, measures) = (labelled.clone().without(left_out.clone()), !self.only_seen);
        let work = move |progress: &Progress| -> Result<Outcome, PartOfError> {
            let within = labelled.within(&volume, known.as_ref(), progress)?.map(|within| Within { measures, ..within });
            Ok(Outcome::Parted(Box::new(Parted { volume, labelled, within, file, notes: vec![] })))
        };
        self.wanted = Some((left_out, Instant::now()));
        self.job = Some(Job::start(ctx, "Cutting".into(), work));
    }

    /// What is said of all parts, and what is done with them.
    fn above_list(&mut self, ui: &mut Ui, bench: &mut Bench, labelled: &Labelled) {
        let (volume, layer) = (&bench.work.opened.volumes[self.index], &bench.work.opened.scene.layers[self.index]);
        if layer.iso != labelled.iso() {
            let was = format!("{}{}", significant(labelled.iso(), 6), suffix(volume.unit()));
            ui.colored_label(ui.visuals().warn_fg_color, format!("These are the parts at {was}; at another isovalue find them again."));
        }
        ui.horizontal_wrapped(|ui| {
            let can = !labelled.left_out().is_empty();
            if ui.add_enabled(can, Button::new("Show all")).on_disabled_hover_text("All parts are shown").clicked() {
                self.leave_out(ui.ctx(), bench, labelled, BTreeSet::new());
            }
            self.measures(ui, &mut bench.work.opened.scene.layers[self.index]);
        });
    }

    /// Whether what is measured is of what is kept.
    fn measures(&mut self, ui: &mut Ui, layer: &mut Layer) {
        if let Some(within) = &layer.within {
            self.only_seen = !within.measures;
        }
        let mut measures = !self.only_seen;
        let hint = "Rays, volumes, thickness and differences are of what is ticked, too; else of all the bone";
        if ui.checkbox(&mut measures, "Also for what is measured").on_hover_text(hint).changed() {
            self.only_seen = !measures;
            layer.within.iter_mut().for_each(|within| within.measures = measures);
        }
    }

    /// The parts, the largest first.
    fn list(&mut self, ui: &mut Ui, bench: &mut Bench, labelled: &Labelled) {
        let before = self.wanted.as_ref().map_or(labelled.left_out(), |(wanted, _)| wanted).clone();
        let mut left_out = before.clone();
        let all_mm3: f64 = labelled.parts().iter().map(|part| part.volume_mm3).sum();
        let (rows, rest) = labelled.parts().split_at(labelled.parts().len().min(MOST_ROWS));
        for part in rows {
            ui.push_id(part.number, |ui| self.row(ui, bench, labelled, (part, all_mm3), &mut left_out));
        }
        if !rest.is_empty() {
            let mut kept = rest.iter().any(|part| !left_out.contains(&part.number));
            let text = format!("{} smaller ones", rest.len());
            line(ui, |ui| {
                ui.label(size(rest.iter().map(|part| part.volume_mm3).sum(), all_mm3));
                ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                    if ui.checkbox(&mut kept, &text).on_hover_text("Keep them").changed() {
                        rest.iter().for_each(|part| _ = if kept { left_out.remove(&part.number) } else { left_out.insert(part.number) });
                    }
                });
            });
        }
        if left_out != before && left_out.len() < labelled.parts().len() {
            self.leave_out(ui.ctx(), bench, labelled, left_out);
        }
    }

    /// A part: whether it is kept, its colour, name and size.
    fn row(&mut self, ui: &mut Ui, bench: &mut Bench, labelled: &Labelled, (part, all_mm3): (&Listed, f64), left_out: &mut BTreeSet<u16>) {
        line(ui, |ui| {
            ui.label(size(part.volume_mm3, all_mm3));
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                let mut kept = !left_out.contains(&part.number);
                let is_last = kept && left_out.len() + 1 == labelled.parts().len();
                let tick = ui.add_enabled(!is_last, Checkbox::without_text(&mut kept)).accessible_name(format!("Keep {}", part.name));
                let tick = tick.on_disabled_hover_text("The last one stays; hide the scan on the left instead");
                if tick.on_hover_text("Keep it").changed() {
                    _ = if kept { left_out.remove(&part.number) } else { left_out.insert(part.number) };
                }
                let (rect, _) = ui.allocate_exact_size(vec2(10.0, 10.0), Sense::hover());
                ui.painter().rect_filled(rect, 2.0, color(part.color));
                self.name(ui, bench, labelled, part);
            });
        });
    }

    /// The name of a part, which a double click changes.
    fn name(&mut self, ui: &mut Ui, bench: &mut Bench, labelled: &Labelled, part: &Listed) {
        if let Some((number, typed)) = &mut self.naming
            && *number == part.number
        {
            let edit = ui.add(TextEdit::singleline(typed).desired_width(ui.available_width()));
            let edit = edit.accessible_name(format!("Name of {}", part.name));
            if !edit.lost_focus() {
                edit.request_focus();
                return;
            }
            let typed = std::mem::take(typed);
            self.naming = None;
            let source = &mut bench.work.opened.sources[self.index];
            if !ui.input(|i| i.key_pressed(Key::Escape)) && !typed.trim().is_empty() && typed.trim() != part.name {
                // The file that the map is in has the old name.
                (source.labels, source.within) = (Some(labelled.renamed(part.number, &typed)), None);
            }
            return;
        }
        let text = if labelled.left_out().contains(&part.number) { RichText::new(&part.name).weak() } else { RichText::new(&part.name) };
        let label = ui.add(Label::new(text).truncate().selectable(false).sense(Sense::click()));
        if label.on_hover_text("Double click to rename").double_clicked() {
            self.naming = Some((part.number, part.name.clone()));
        }
    }
}

/// Puts parts in the place of those that a scan had.
fn take(bench: &mut Bench, parted: Parted) -> Result<(), String> {
    let opened = &mut bench.work.opened;
    let Some(n) = opened.volumes.iter().position(|volume| Arc::ptr_eq(volume, &parted.volume)) else {
        return Err("The scan whose parts were looked for was changed or closed meanwhile: look for them again.".into());
    };
    let (source, layer) = (&mut opened.sources[n], &mut opened.scene.layers[n]);
    source.within = parted.file.map(|file| PartOf::kept_of(&parted.labelled, file));
    (source.labels, layer.within) = (Some(parted.labelled), parted.within);
    parted.notes.into_iter().for_each(|note| bench.messages.note(note));
    Ok(())
}

/// A size and its share of all.
fn size(mm3: f64, all_mm3: f64) -> String {
    format!("{} mm³, {} %", fixed(mm3, 0), fixed(100.0 * mm3 / all_mm3.max(f64::MIN_POSITIVE), 1))
}

/// Where a label map is saved, and as what.
const SAVE: Ask = Ask {
    title: "Save the label map",
    kind: Kind::Save,
    forms: &[
        ("3D Slicer segmentation, NRRD", &["seg.nrrd", "nrrd"]),
        ("NIfTI, numbers alone", &["nii.gz", "nii"]),
        ("MetaImage, numbers alone", &["mha"]),
    ],
    name: "parts.seg.nrrd",
};
