//! Volumes of bone, of what two scans share, and of cavities, whose openings are closed where they leak.

use super::super::ask::{Ask, Kind};
use super::super::bench::Bench;
use super::super::job::{Job, is_at_work};
use super::super::measured::Work;
use super::super::under::place;
use super::super::widgets::choose_scans;
use super::super::words::in_the_window;
use bregma_field::Progress;
use bregma_measure::csv::Made;
use bregma_measure::numbers::fixed;
use bregma_measure::table_style::styled;
use bregma_measure::volumes::cavity::{Cavity, CavityError, Disc};
use bregma_measure::volumes::{Measure, VolumesError, WayOut};
use bregma_session::output::write_whole;
use bregma_session::record::made;
use bregma_session::volumes::{Found, Order, csv, measure, record};
use bregma_session::{Measurement, Opened, Origin};
use egui::{Button, Checkbox, ComboBox, DragValue, Grid, ScrollArea, Ui};

/// The panel.
#[derive(Default)]
pub struct VolumesPanel {
    of_cavity: bool,
    pair: Option<[usize; 2]>,
    as_cut: bool,
    open: bool,
    /// The landmark that lies in the cavity.
    seed: Option<String>,
    ball_mm: Option<f64>,
    discs: Vec<Disc>,
    job: Option<Job<Outcome>>,
    found: Option<Answer>,
    /// Where the cavity leaks.
    leak: Option<WayOut>,
}

/// What came of it: volumes, or the way out of a cavity that leaks.
type Outcome = Result<Answer, WayOut>;

/// Volumes, with what they were measured of.
struct Answer {
    found: Found,
    order: Order,
    made_by: Option<Origin>,
    made: Made,
}

/// The least and the greatest radius of a ball or a lid, mm.
const RADII_MM: std::ops::RangeInclusive<f64> = 0.1..=100.0;
/// A lid is so much wider than the ball that just fits through the opening, which is seldom round.
const LID: f64 = 2.0;

impl VolumesPanel {
    /// Takes what the thread brought; `Err` is a sentence for the person.
    pub fn poll(&mut self, bench: &mut Bench) -> Result<(), String> {
        let Some(result) = self.job.as_ref().and_then(Job::poll) else { return Ok(()) };
        self.job = None;
        match result.map_err(|e| format!("The volume was not measured: {}", in_the_window(&e)))? {
            Ok(answer) => {
                bench.work.opened.measurements.push(answer.measurement());
                (self.found, self.leak) = (Some(answer), None);
            }
            Err(way) => self.leak = Some(way),
        }
        Ok(())
    }

    /// Shows what can be measured, and what was.
    pub fn show(&mut self, ui: &mut Ui, bench: &mut Bench) {
        if is_at_work(&mut self.job, ui) {
            return;
        }
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            self.question(ui, &bench.work);
            self.leak(ui);
            if let Some(answer) = &self.found {
                ui.separator();
                measured(ui, answer);
                if ui.button("Save volumes…").on_hover_text("A table, or a record that can be verified").clicked() {
                    self.save(ui, bench);
                }
            }
        });
    }

    /// What is to be measured.
    fn question(&mut self, ui: &mut Ui, work: &Work) {
        let opened = &work.opened;
        ui.horizontal(|ui| {
            ui.radio_value(&mut self.of_cavity, false, "Bone").on_hover_text("Of two scans also what both share, and what each has alone");
            ui.radio_value(&mut self.of_cavity, true, "Cavity").on_hover_text("What is reached from a point through empty space");
        });
        let count = if self.of_cavity { 1 } else { opened.volumes.len().min(2) };
        let is_pair = |pair: &[usize; 2]| pair.iter().all(|n| *n < opened.volumes.len());
        let mut pair = self.pair.filter(is_pair).unwrap_or([0, opened.volumes.len().min(2) - 1]);
        if opened.volumes.len() > 1 {
            choose_scans(ui, opened, &mut pair[..count], &[("Of", "Scan to measure"), ("and", "Scan beside it")]);
            self.pair = Some(pair);
        }
        let cuts = opened.scene.clips.iter().any(|clip| clip.enabled);
        let hint = "Boxes, spheres and planes say where (Cuts)";
        ui.add_enabled(cuts, Checkbox::new(&mut self.as_cut, "Only what cuts leave")).on_hover_text(hint).on_disabled_hover_text(hint);
        let hint = "Where the box cuts bone its volume is not known; this counts what is there";
        ui.checkbox(&mut self.open, "Close at the scan's box").on_hover_text(hint);
        let seed_mm = if self.of_cavity { self.cavity(ui, work) } else { None };
        let lacks = self.of_cavity && seed_mm.is_none();
        let measures = ui.add_enabled(!lacks, Button::new("Measure the volume"));
        if measures.on_disabled_hover_text("Set a landmark in the cavity, in a slice").clicked() {
            let mut scans = pair[..count].to_vec();
            scans.dedup();
            self.measure(ui, opened.only(&scans), seed_mm);
        }
    }

    /// Where the cavity is and what closes it. Gives a point in it.
    fn cavity(&mut self, ui: &mut Ui, work: &Work) -> Option<glam::DVec3> {
        let set: Vec<_> = work.measured.landmarks.iter().filter_map(|l| Some((&l.name, l.point_mm?))).collect();
        let chosen = set.iter().find(|(name, _)| Some(*name) == self.seed.as_ref()).or(set.last());
        ui.horizontal(|ui| {
            ui.weak("around");
            let shown = chosen.map_or("a landmark in it", |(name, _)| name.as_str());
            let combo = ComboBox::from_id_salt("seed").selected_text(shown).show_ui(ui, |ui| {
                for (name, _) in &set {
                    ui.selectable_value(&mut self.seed, Some((*name).clone()), *name);
                }
            });
            combo.response.accessible_name("Landmark in the cavity");
        });
        ui.horizontal(|ui| {
            let mut limited = self.ball_mm.is_some();
            let hint = "It goes as far as a ball of this radius does, so that small openings need no lid";
            if ui.checkbox(&mut limited, "As far as a ball goes").on_hover_text(hint).changed() {
                self.ball_mm = limited.then_some(3.0);
            }
            if let Some(mm) = &mut self.ball_mm {
                ui.add(DragValue::new(mm).range(RADII_MM).speed(0.05).max_decimals(2).suffix(" mm")).accessible_name("Radius of the ball");
            }
        });
        let mut gone = None;
        for (n, disc) in self.discs.iter_mut().enumerate() {
            ui.horizontal(|ui| {
                ui.label(format!("Lid at {}", place(disc.centre_mm)));
                let radius = DragValue::new(&mut disc.radius_mm).range(RADII_MM).speed(0.1).max_decimals(1).prefix("r ").suffix(" mm");
                ui.add(radius).accessible_name(format!("Radius of lid {}", n + 1));
                if ui.button("×").on_hover_text("Take the lid away").accessible_name(format!("Take lid {} away", n + 1)).clicked() {
                    gone = Some(n);
                }
            });
        }
        gone.map(|n| self.discs.remove(n));
        chosen.map(|(_, point_mm)| *point_mm)
    }

    fn measure(&mut self, ui: &Ui, opened: Opened, seed_mm: Option<glam::DVec3>) {
        let clips = if self.as_cut { opened.scene.clips.clone() } else { vec![] };
        let cavity = |seed_mm| Cavity { seed_mm, discs: self.discs.clone(), ball_mm: self.ball_mm };
        let order = Order { clips, open: self.open, cavities: seed_mm.map(cavity).into_iter().collect() };
        let work = move |progress: &Progress| match measure(&opened, &order, progress) {
            Ok(found) => Ok(Ok(Answer { found, made_by: Origin::of(&opened), made: made(&opened), order })),
            Err(VolumesError::Cavity(CavityError::Leak { way, .. })) => Ok(Err(way)),
            Err(error) => Err(error),
        };
        self.job = Some(Job::start(ui.ctx(), "Measuring".into(), work));
    }

    /// Where the cavity leaks, and what closes it.
    fn leak(&mut self, ui: &mut Ui) {
        let Some(way) = self.leak.clone().filter(|_| self.of_cavity) else { return };
        let text =
            format!("The cavity leaks: its widest way out is narrowest at {}, {} mm from bone.", place(way.at_mm), fixed(way.radius_mm, 1));
        ui.colored_label(ui.visuals().warn_fg_color, text);
        if ui.button("Put a lid there").on_hover_text("Across the way; then measure again, until nothing leaks").clicked() {
            self.discs.push(Disc { centre_mm: way.at_mm, normal: way.along, radius_mm: LID * way.radius_mm });
            self.leak = None;
        }
    }

    fn save(&self, ui: &Ui, bench: &mut Bench) {
        let Some(answer) = &self.found else { return };
        let (record, table) = (answer.measurement().to_string() + "\n", csv(&answer.made, &answer.found));
        bench.save(ui.ctx(), SAVE, move |bench, file| {
            let is_json = file.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
            let text = if is_json { record } else { styled(&table, bench.remembered.preferences.tables) };
            write_whole(file, text.as_bytes())
        });
    }
}

impl Answer {
    fn measurement(&self) -> Measurement {
        Measurement::Volumes(Box::new(record(self.made_by.clone(), &self.order, &self.found)))
    }
}

/// Where volumes are saved, and as what.
const SAVE: Ask = Ask {
    title: "Save volumes",
    kind: Kind::Save,
    forms: &[("CSV table", &["csv"]), ("Record, for verifying", &["json"])],
    name: "volumes.csv",
};

/// Each volume with its ±.
fn measured(ui: &mut Ui, answer: &Answer) {
    let row = |ui: &mut Ui, name: &str, mm3: f64, error_mm3: f64| {
        ui.weak(name);
        ui.label(format!("{} ± {} mm³", fixed(mm3, 0), fixed(error_mm3, 0)));
        ui.end_row();
    };
    for (measure, _) in answer.found.measures() {
        let Measure { what, volume_mm3, uncertainty, unblurred_mm3, unblurred_error_mm3, area_mm2, .. } = measure;
        ui.strong(what);
        Grid::new(("volume", what)).spacing([14.0, 2.0]).show(ui, |ui| {
            row(ui, "volume", *volume_mm3, uncertainty.error_mm3);
            row(ui, "without blur", *unblurred_mm3, *unblurred_error_mm3);
            ui.weak("surface");
            ui.label(format!("{} mm²", fixed(*area_mm2, 0)));
            ui.end_row();
        });
    }
    answer.found.notes().iter().for_each(|note| {
        ui.weak(note);
    });
}
