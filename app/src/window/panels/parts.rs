//! The parts of a scan: how they are found, which of them are kept, and the label map that they are written as.

use super::super::ask::{Ask, Kind};
use super::super::bench::Bench;
use super::super::job::{Job, is_at_work};
use super::super::picture::part_hand::{Deed, PartHand};
use super::super::widgets::{choose_scans, color, line};
use super::super::words::in_the_window;
use super::part_tools;
use bregma_field::{Progress, Surface, Volume, read_mesh};
use bregma_measure::numbers::{fixed, significant, suffix};
use bregma_parts::{ClosedSurface, Labels, PartsError};
use bregma_renderer::{Layer, Within};
use bregma_session::{How, Labelled, Listed, PartOf, PartOfError};
use egui::{Align, Button, Checkbox, Context, DragValue, Key, Label, Layout, RichText, ScrollArea, Sense, TextEdit, Ui};
use glam::DAffine3;
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Where the person's answer comes from, and what is done with the file.
type Asked = (Receiver<(Context, PathBuf)>, For);

/// What a file is asked for.
enum For {
    /// A label map is written to it.
    Writing(Labelled),
    /// A label map is read from it.
    Map,
    /// It is a surface that parts lie within.
    Surface,
}

/// The panel.
pub struct PartsPanel {
    /// Number of the scan.
    index: usize,
    neck_mm: f64,
    smooth_mm: f64,
    job: Option<Job<Outcome>>,
    /// The parts that are to be left out, while what is kept is worked out; and since when.
    wanted: Option<(BTreeSet<u16>, Instant)>,
    /// A file that was asked for, and what is written to it; else it is read.
    asked: Option<Asked>,
    /// The part whose name is being typed.
    naming: Option<(u16, String)>,
    /// Only what is seen is of the parts that are kept.
    only_seen: bool,
    /// What the hand has made is being worked out: until then its parts are ahead of those in the list.
    follows: bool,
    /// How far what is kept is being dragged to grow, mm.
    growing_mm: Option<f64>,
}

impl Default for PartsPanel {
    fn default() -> Self {
        Self {
            index: 0,
            neck_mm: 4.0,
            smooth_mm: 2.0,
            job: None,
            wanted: None,
            asked: None,
            naming: None,
            only_seen: false,
            follows: false,
            growing_mm: None,
        }
    }
}

enum Outcome {
    Parted(Box<Parted>),
    /// A line that cut nothing.
    Nothing,
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
    /// The parts that they came from, where they came from those.
    from: Option<Option<Labelled>>,
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
            match self.asked.take() {
                Some((_, For::Writing(labelled))) => self.save(&ctx, labelled, file),
                Some((_, For::Surface)) => self.fill(&ctx, bench, file),
                _ => self.find(&ctx, bench, How::File(file)),
            }
        }
        let Some(result) = self.job.as_ref().and_then(Job::poll) else { return Ok(()) };
        (self.job, self.wanted, self.follows) = (None, None, false);
        let result = result.inspect_err(|_| fall_back(bench));
        match result.map_err(|e| format!("No parts: {}", in_the_window(&e)))? {
            Outcome::Parted(parted) => take(bench, *parted)?,
            Outcome::Nothing => {}
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
        let was_at_work = self.job.is_some();
        if self.wanted.as_ref().is_some_and(|(_, since)| since.elapsed() < SOON) {
            ui.ctx().request_repaint_after(SOON);
            ui.add_enabled_ui(!self.follows, |ui| self.deeds(ui, bench));
        } else if !is_at_work(&mut self.job, ui) {
            self.wanted = None;
            self.deeds(ui, bench);
        } else if was_at_work && self.job.is_none() {
            // What the person stopped has become nothing.
            fall_back(bench);
        }
        let Some(labelled) = bench.work.opened.sources.get(self.index).and_then(|source| source.labels.clone()) else {
            ui.weak("Keep the skull leaves the head rest, the table, the paw out. Find islands lists all bone that hangs together.");
            return;
        };
        ui.separator();
        ui.add_enabled_ui(!self.follows, |ui| self.above_list(ui, bench, &labelled));
        // What is looked for takes the place of the list.
        let is_free = self.job.is_none() || self.wanted.is_some() && !self.follows;
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
                self.ask(&ctx, bench, Ask::open("Open a label map", Kind::Files), For::Map);
            }
            let labelled = bench.work.opened.sources.get(self.index).and_then(|source| source.labels.clone());
            let saves =
                ui.add_enabled(labelled.is_some(), Button::new("Save label map…")).on_disabled_hover_text("No parts were found yet");
            let saves = saves.on_hover_text("The parts with their names and colours, for 3D Slicer and others");
            if let Some(labelled) = labelled.filter(|_| saves.clicked()) {
                self.ask(&ctx, bench, SAVE, For::Writing(labelled));
            }
        });
        self.by_hand(ui, bench);
    }

    /// What makes parts by hand, and what is made of painted ones.
    fn by_hand(&mut self, ui: &mut Ui, bench: &mut Bench) {
        let ctx = ui.ctx().clone();
        ui.separator();
        part_tools::show(ui, bench, self.index);
        let labelled = bench.work.opened.sources.get(self.index).and_then(|source| source.labels.clone());
        let has_parts = labelled.is_some();
        ui.horizontal_wrapped(|ui| {
            let hint = "Two or more parts that were painted on bone grow through it until they meet";
            let grows = ui.add_enabled(has_parts, Button::new("Grow from painted parts")).on_disabled_hover_text("Paint two parts first");
            if grows.on_hover_text(hint).clicked() {
                self.change(&ctx, bench, "Growing", |labels, bone, progress| labels.grown_from_seeds(bone, progress));
            }
            let hint = "What lies within a closed surface, PLY or STL, becomes a part";
            if ui.button("From a surface…").on_hover_text(hint).clicked() {
                self.ask(&ctx, bench, Ask::open("Open a closed surface", Kind::Files), For::Surface);
            }
        });
        ui.horizontal(|ui| {
            let hint = "Borders between parts that touch become smooth; bone stays bone";
            let smooths = ui.add_enabled(has_parts, Button::new("Smooth borders")).on_disabled_hover_text("No parts were found yet");
            let smooths = smooths.on_hover_text(hint).clicked();
            let number = DragValue::new(&mut self.smooth_mm).range(NECKS_MM).speed(0.05).max_decimals(2).suffix(" mm");
            let number = ui.add(number.update_while_editing(false));
            number.on_hover_text("What reaches so far into another part is taken back").accessible_name("Radius of smoothing");
            if smooths {
                let mm = self.smooth_mm;
                self.change(&ctx, bench, "Smoothing", move |labels, bone, progress| labels.smoothed(bone, mm, progress));
            }
        });
    }

    /// Asks for a file to read, or to write parts to.
    fn ask(&mut self, ctx: &Context, bench: &mut Bench, ask: Ask, what_for: For) {
        let (send, asked) = channel();
        self.asked = Some((asked, what_for));
        bench.ask(ctx, ask, move |_, ctx, files| {
            // The panel may ask for another one by now.
            let _ = send.send((ctx.clone(), files[0].clone()));
        });
    }

    fn save(&mut self, ctx: &Context, labelled: Labelled, file: PathBuf) {
        let work = move |progress: &Progress| labelled.write(&file, progress).map(|notes| Outcome::Saved(file, notes));
        self.job = Some(Job::start(ctx, "Writing the label map".into(), work));
    }

    /// Makes a part of what lies within a closed surface, beside those that there are.
    fn fill(&mut self, ctx: &Context, bench: &Bench, file: PathBuf) {
        if bench.work.opened.sources.get(self.index).is_none_or(|source| source.labels.is_none()) {
            return self.find(ctx, bench, How::Surface(file));
        }
        self.change(ctx, bench, "Filling the surface", move |labels, bone, progress| {
            let mesh = read_mesh(&file)?;
            labels.clone().with_surface(&bone.volume, &ClosedSurface { file, mesh }, progress)
        });
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
            How::Surface(_) => "Filling the surface",
        };
        let work = move |progress: &Progress| -> Result<Outcome, PartOfError> {
            let (labelled, notes) = Labelled::find(&how, (&volume, &layer), progress)?;
            let within = labelled.within(&volume, None, progress)?.map(|within| Within { measures, ..within });
            let file = if let How::File(file) = how { Some(file) } else { None };
            Ok(Outcome::Parted(Box::new(Parted { volume, labelled, within, file, notes, from: None })))
        };
        (self.wanted, self.naming) = (None, None);
        self.job = Some(Job::start(ctx, what.into(), work));
    }

    /// Makes other parts of those that there are.
    fn change(
        &mut self,
        ctx: &Context,
        bench: &Bench,
        what: &str,
        made: impl FnOnce(&Labels, &Surface, &Progress) -> Result<Labels, PartsError> + Send + 'static,
    ) {
        let opened = &bench.work.opened;
        let Some(from) = opened.sources.get(self.index).and_then(|source| source.labels.clone()) else { return };
        let (volume, layer) = (Arc::clone(&opened.volumes[self.index]), opened.scene.layers[self.index].clone());
        let work = move |progress: &Progress| -> Result<Outcome, PartOfError> {
            let no_bone = |_| PartsError::NoBone { scan: volume.name().to_owned() };
            let bone = Surface::new(&volume, layer.iso, DAffine3::IDENTITY).map_err(no_bone)?;
            let labelled = from.changed(&made(from.labels(), &bone, progress)?, &volume);
            let within = labelled.within(&volume, layer.within.as_ref(), progress)?;
            Ok(Outcome::Parted(Box::new(Parted { volume, labelled, within, file: None, notes: vec![], from: Some(Some(from)) })))
        };
        (self.wanted, self.naming) = (None, None);
        self.job = Some(Job::start(ctx, what.to_owned(), work));
    }

    /// Makes a step of what the hand has painted or cut.
    pub fn follow_hand(&mut self, ctx: &Context, bench: &mut Bench) {
        if bench.view.part_hand.as_mut().is_some_and(PartHand::was_refused) {
            bench
                .messages
                .note("Nothing is cut: how deep bone lies is told by the picture alone, at rest, where it has the view for itself.");
        }
        let opened = &bench.work.opened;
        let Some(hand) = bench.view.part_hand.as_mut().filter(|_| self.job.is_none()) else { return };
        let Some((n, (deed, mut labels, from, mut changed))) = hand.scan(opened).and_then(|n| Some((n, hand.deed()?))) else { return };
        let (volume, layer) = (Arc::clone(&opened.volumes[n]), opened.scene.layers[n].clone());
        self.wanted = Some((from.as_ref().map(|from| from.left_out().clone()).unwrap_or_default(), Instant::now()));
        let work = move |progress: &Progress| -> Result<Outcome, PartOfError> {
            if let Deed::Cut(cut) = deed {
                let cut = cut.apply(&mut labels, from.as_ref(), (&volume, layer.iso, layer.transform), progress)?;
                changed = [changed, cut].into_iter().flatten().reduce(|a, b| a.with(b));
                if changed.is_none() {
                    return Ok(Outcome::Nothing);
                }
            }
            let labelled = match &from {
                Some(from) => from.changed(&labels, &volume),
                None => Labelled::new(labels, &volume, layer.iso),
            };
            let within = match changed {
                Some(changed) => labelled.within_again(&volume, layer.within.as_ref(), changed, progress)?,
                None => layer.within,
            };
            Ok(Outcome::Parted(Box::new(Parted { volume, labelled, within, file: None, notes: vec![], from: Some(from) })))
        };
        self.follows = true;
        self.job = Some(Job::start(ctx, "Painting".into(), work));
    }

    /// How far what is kept is grown, and how its rim is shaded.
    fn grows(&mut self, ui: &mut Ui, bench: &mut Bench, labelled: &Labelled) {
        let Some(within) = &mut bench.work.opened.scene.layers[self.index].within else { return };
        let mut grow_mm = self.growing_mm.take().unwrap_or(within.grow_mm);
        let dragged = ui.horizontal(|ui| {
            let number = |mm, range| DragValue::new(mm).range(range).speed(0.02).max_decimals(2).suffix(" mm").update_while_editing(false);
            ui.weak("grown by");
            let hint = "What is kept reaches so much farther; less far where it is negative";
            let grown = ui.add(number(&mut grow_mm, -50.0..=50.0)).on_hover_text(hint).accessible_name("Grow what is kept");
            ui.weak("rim");
            let hint = "So far behind its face bone is shaded as the face and the bone together";
            ui.add(number(&mut within.rim_mm, 0.0..=50.0)).on_hover_text(hint).accessible_name("Width of the rim");
            grown.dragged()
        });
        // While it is dragged it is only seen how far.
        self.growing_mm = dragged.inner.then_some(grow_mm);
        if !dragged.inner && grow_mm != within.grow_mm && self.wanted.is_none() {
            let known = Within { grow_mm, solid: None, ..within.clone() };
            self.cut_anew(ui.ctx(), bench, labelled.clone(), Some(known));
        }
    }

    /// Leaves parts out.
    fn leave_out(&mut self, ctx: &Context, bench: &Bench, labelled: &Labelled, left_out: BTreeSet<u16>) {
        let known = bench.work.opened.scene.layers.get(self.index).and_then(|layer| layer.within.as_ref());
        let known = known.map(|within| Within { solid: None, ..within.clone() });
        self.cut_anew(ctx, bench, labelled.clone().without(left_out), known);
    }

    /// Finds what is kept of parts, looked at as `known` is.
    fn cut_anew(&mut self, ctx: &Context, bench: &Bench, labelled: Labelled, known: Option<Within>) {
        let opened = &bench.work.opened;
        let Some(volume) = opened.volumes.get(self.index).cloned() else { return };
        let file = opened.sources[self.index].within.as_ref().map(|within| within.file.clone());
        let measures = !self.only_seen;
        self.wanted = Some((labelled.left_out().clone(), Instant::now()));
        let work = move |progress: &Progress| -> Result<Outcome, PartOfError> {
            let within = labelled.within(&volume, known.as_ref(), progress)?.map(|within| Within { measures, ..within });
            Ok(Outcome::Parted(Box::new(Parted { volume, labelled, within, file, notes: vec![], from: None })))
        };
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
        self.grows(ui, bench, labelled);
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
                part_tools::square(ui, color(part.color));
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
    // Undo took them back meanwhile, or other parts were found.
    let is_same = |from: &Option<Labelled>| match (from, &source.labels) {
        (Some(from), Some(now)) => from.is_same_map(now),
        (from, now) => from.is_none() && now.is_none(),
    };
    if parted.from.as_ref().is_some_and(|from| !is_same(from)) {
        fall_back(bench);
        return Ok(());
    }
    if let Some(hand) = bench.view.part_hand.as_mut().filter(|hand| Arc::ptr_eq(hand.its_scan(), &parted.volume) && parted.from.is_some()) {
        hand.became(&parted.labelled);
    }
    source.within = parted.file.map(|file| PartOf::kept_of(&parted.labelled, file));
    (source.labels, layer.within) = (Some(parted.labelled), parted.within);
    parted.notes.into_iter().for_each(|note| bench.messages.note(note));
    Ok(())
}

/// Lets the hand begin again from the parts that there are.
fn fall_back(bench: &mut Bench) {
    if let Some(hand) = &mut bench.view.part_hand {
        hand.fall_back(&bench.work.opened);
    }
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
