//! The map of differences: which, of which scans, where; how it is coloured, what it says in numbers, and where the largest lie.

use super::super::ask::{Ask, Kind};
use super::super::bench::Bench;
use super::super::job::{Job, is_at_work};
use super::super::measured::Work;
use super::super::under::place;
use super::super::widgets::{choose_scans, named_radio};
use super::maps::{self, Legend};
use bregma_field::{Progress, Ray, WorldPoint};
use bregma_measure::difference::{Extreme, Statistics};
use bregma_measure::numbers::{fixed, signed};
use bregma_register::{Part, Parts};
use bregma_renderer::Scene;
use bregma_session::coat::{Coat, share};
use bregma_session::difference::{Measured, measure, reach_mm};
use bregma_session::difference_picture::{DifferenceCoat, LEAST_RANGE_MM, Scale};
use bregma_session::print::figure_png;
use bregma_session::{DifferenceBy as By, DifferenceOrder as Order, Measurement, Origin, save};
use egui::{Button, Checkbox, DragValue, Grid, ScrollArea, Ui};
use std::sync::Arc;

/// The panel.
#[derive(Default)]
pub struct DifferencesPanel {
    by: By,
    pair: Option<[usize; 2]>,
    /// As far as partners are looked for, where a person says so.
    reach_mm: Option<f64>,
    /// How far around the last landmark; everywhere when absent.
    patch_mm: Option<f64>,
    /// Only what cuts leave of the surfaces.
    as_cut: bool,
    /// The end of the colours where a person says so.
    range_mm: Option<f64>,
    isolines_mm: Option<f64>,
    all_colors: bool,
    /// The difference, and what it is measured on, which may change meanwhile.
    job: Option<Job<(Measured, Option<Origin>)>>,
    /// What the finished map was measured on.
    origin: Option<Origin>,
    coat: Option<Arc<DifferenceCoat>>,
    /// The surface keeps its own colour though there is a map of it.
    hidden: bool,
}

/// Each difference, its name, and what it answers.
const KINDS: [(By, &str, &str); 6] = [
    (
        By::Partner,
        "Partners",
        "To the nearest place of the other surface that faces the same way, so that no wall is taken for its other side",
    ),
    (By::Closest, "Closest points", "To the nearest place of any sheet, as CloudCompare and VTK have it"),
    (By::Normal, "Along the normal", "To the first place along the normal that faces the same way"),
    (By::Thickness, "Thickness", "How much thicker the bone is at the partner, each along its own normal"),
    (By::Displacement, "Displacement", "How far a part, as a jaw or a tooth, moved as a whole: around a landmark on it"),
    (By::Asymmetry, "Asymmetry", "To the first scan's own mirror image"),
];

impl DifferencesPanel {
    /// The finished map with its colours.
    pub fn coat(&self) -> Option<&Arc<DifferenceCoat>> {
        self.coat.as_ref()
    }

    /// Takes what the thread brought; `Err` is a sentence for the person.
    pub fn poll(&mut self, bench: &mut Bench) -> Result<(), String> {
        let Some(result) = self.job.as_ref().and_then(Job::poll) else { return Ok(()) };
        self.job = None;
        let (measured, origin) = result.map_err(|e| format!("The difference was not measured: {e}"))?;
        let measured = Arc::new(measured);
        bench.work.opened.measurements.push(Measurement::Difference(Box::new(measured.record(origin.as_ref()))));
        self.origin = origin;
        self.hidden = false;
        self.coat = Some(Arc::new(DifferenceCoat { scale: self.scale(&measured), measured, on: 0 }));
        Ok(())
    }

    fn scale(&self, measured: &Measured) -> Scale {
        let range_mm = self.range_mm.unwrap_or_else(|| measured.range_mm()).max(LEAST_RANGE_MM);
        Scale { range_mm, grey_within_error: !self.all_colors, isolines_mm: self.isolines_mm }
    }

    /// The scene to paint on and the coat, while the map is shown and is of what is open.
    pub fn painting(&self, work: &Work) -> Option<(Scene, Arc<dyn Coat>)> {
        let coat = self.coat.as_ref().filter(|coat| !self.hidden && coat.measured.is_of(&work.opened))?;
        Some((coat.scene(&work.opened.scene), Arc::<DifferenceCoat>::clone(coat)))
    }

    /// Shows what can be measured, and what was.
    pub fn show(&mut self, ui: &mut Ui, bench: &mut Bench) {
        if is_at_work(&mut self.job, ui) {
            return;
        }
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            self.question(ui, &bench.work);
            let Some(coat) = self.coat.clone() else { return };
            ui.separator();
            self.measured(ui, bench, &coat);
        });
    }

    /// What is to be measured.
    fn question(&mut self, ui: &mut Ui, work: &Work) {
        let opened = &work.opened;
        let needed = if self.by == By::Asymmetry { 1 } else { 2 };
        for (by, name, what) in KINDS {
            ui.radio_value(&mut self.by, by, name).on_hover_text(what);
        }
        if opened.volumes.len() < needed {
            ui.weak(if needed == 2 { "Two scans are needed: open another, and register them." } else { "Open a scan." });
            return;
        }
        let is_pair = |pair: &[usize; 2]| pair.iter().all(|n| *n < opened.volumes.len());
        let mut pair = self.pair.filter(is_pair).unwrap_or([0, opened.volumes.len().min(2) - 1]);
        if opened.volumes.len() > 1 {
            let roles = [("From", "First scan"), ("to", "Second scan")];
            choose_scans(ui, opened, &mut pair[..needed], &roles);
            self.pair = Some(pair);
        }
        if self.by == By::Asymmetry {
            pair[1] = pair[0];
        }
        self.reach(ui, work, pair);
        maps::place(ui, &mut self.patch_mm, work.measured.landmarks.iter().rfind(|l| l.point_mm.is_some()));
        let cuts = opened.scene.clips.iter().any(|clip| clip.enabled);
        let hint = "A box, a sphere or planes say where (Cuts): distances are those of the whole bone all the same";
        ui.add_enabled(cuts, Checkbox::new(&mut self.as_cut, "Only what cuts leave")).on_hover_text(hint).on_disabled_hover_text(hint);
        let order = self.order(work, pair);
        let lacks = if self.by != By::Asymmetry && pair[0] == pair[1] {
            Some("Choose two scans")
        } else if self.by == By::Displacement && order.parts.is_all() {
            Some("Say which part: set a landmark on it, and choose how far around")
        } else {
            None
        };
        let measures = ui.add_enabled(lacks.is_none(), Button::new("Measure the difference"));
        let measures = measures.on_disabled_hover_text(lacks.unwrap_or_default());
        if measures.clicked() {
            let opened = opened.clone();
            let work = move |progress: &Progress| measure(&opened, &order, progress).map(|measured| (measured, Origin::of(&opened)));
            self.job = Some(Job::start(ui.ctx(), "Measuring".into(), work));
        }
    }

    /// How far partners are looked for.
    fn reach(&mut self, ui: &mut Ui, work: &Work, pair: [usize; 2]) {
        let own_mm = reach_mm(pair.map(|n| &*work.opened.volumes[n]));
        ui.horizontal(|ui| {
            ui.weak("within");
            let mut mm = self.reach_mm.unwrap_or(own_mm);
            let hint = "What has no partner so near has no number, and is hatched";
            let number = DragValue::new(&mut mm).range(0.01..=1000.0).speed(0.05).max_decimals(2).suffix(" mm");
            if ui.add(number).on_hover_text(hint).accessible_name("Reach of partners").changed() {
                self.reach_mm = Some(mm);
            }
        });
    }

    fn order(&self, work: &Work, pair: [usize; 2]) -> Order {
        let last = work.measured.landmarks.iter().rev().find_map(|l| l.point_mm);
        let only = self.patch_mm.zip(last).map(|(radius_mm, centre_mm)| Part::Ball { centre_mm, radius_mm });
        let clips = if self.as_cut { work.opened.scene.clips.clone() } else { vec![] };
        let parts = Parts { only: only.into_iter().collect(), but: vec![] };
        Order { by: self.by, pair, reach_mm: self.reach_mm, parts, clips }
    }

    /// What was measured.
    fn measured(&mut self, ui: &mut Ui, bench: &mut Bench, coat: &Arc<DifferenceCoat>) {
        if !coat.measured.is_of(&bench.work.opened) {
            ui.colored_label(ui.visuals().warn_fg_color, "A scan, its isovalue or its place has changed: measure again.");
        }
        ui.strong(coat.measured.legend());
        let mut on = coat.on;
        for (n, half) in coat.measured.halves.iter().enumerate() {
            named_radio(ui, &mut on, n, &format!("on {}", half.name));
        }
        if let Some(statistics) = &coat.half().statistics {
            if let Some([low, high]) = legend(ui, coat, statistics) {
                // The ends are as far from 0 as that which was drawn.
                let range_mm = coat.scale.range_mm;
                self.range_mm = Some((range_mm + (high - range_mm) - (low + range_mm)).max(LEAST_RANGE_MM));
            }
            numbers(ui, statistics);
        }
        along_the_ray(ui, bench, coat);
        let mut shown = !self.hidden;
        ui.checkbox(&mut shown, "Show on the surface");
        self.hidden = !shown;
        self.colors(ui, &coat.scale);
        let scale = self.scale(&coat.measured);
        if (scale, on) != (coat.scale, coat.on) {
            self.coat = Some(Arc::new(DifferenceCoat { scale, on, measured: Arc::clone(&coat.measured) }));
        }
        if ui.button("Save map…").on_hover_text("The points as CSV, the coloured surface as PLY, or a report as HTML").clicked() {
            let (coat, figures) = (Arc::clone(coat), self.figures(bench, coat));
            let origin = self.origin.clone();
            bench.save(ui.ctx(), SAVE, move |bench, file| {
                save::difference(file, &coat, &figures, origin.as_ref(), bench.remembered.preferences.tables)
            });
        }
        if let Some(statistics) = &coat.half().statistics {
            largest(ui, bench, &statistics.extremes);
        }
        coat.measured.notes.iter().for_each(|note| {
            ui.weak(note);
        });
    }

    /// The picture with its legend, for a report, where it shows the map.
    fn figures(&self, bench: &Bench, coat: &DifferenceCoat) -> Vec<(String, Vec<u8>)> {
        let shown = bench.view.painted.as_ref().filter(|painted| !self.hidden && painted.reduction == 1);
        let png = shown.and_then(|painted| figure_png(&coat.figure(&painted.picture).ok()?).ok());
        png.map(|png| (format!("On {}. {}.", coat.half().name, coat.measured.legend()), png)).into_iter().collect()
    }

    /// The colours and their end.
    fn colors(&mut self, ui: &mut Ui, scale: &Scale) {
        ui.horizontal(|ui| {
            let mut automatic = self.range_mm.is_none();
            let hint = "What 95 % of the surface stays below; a fixed end makes maps of several pairs comparable";
            if ui.checkbox(&mut automatic, "Automatic range").on_hover_text(hint).changed() {
                self.range_mm = if automatic { None } else { Some(scale.range_mm) };
            }
            if let Some(mm) = &mut self.range_mm {
                let number = DragValue::new(mm).range(LEAST_RANGE_MM..=1000.0).speed(0.02).max_decimals(3).prefix("± ").suffix(" mm");
                ui.add(number).accessible_name("End of the colours");
            }
        });
        ui.horizontal(|ui| {
            let mut lines = self.isolines_mm.is_some();
            if ui.checkbox(&mut lines, "Lines").on_hover_text("Of equal difference").changed() {
                self.isolines_mm = lines.then_some(scale.range_mm / 4.0);
            }
            if let Some(mm) = &mut self.isolines_mm {
                let number = DragValue::new(mm).range(0.01..=1000.0).speed(0.01).max_decimals(3).prefix("every ").suffix(" mm");
                ui.add(number).accessible_name("Step of the lines");
            }
        });
        let mut grey = !self.all_colors;
        ui.checkbox(&mut grey, "Grey within ±").on_hover_text("What scanning, isovalues and registration may have done is no difference");
        self.all_colors = !grey;
    }
}

/// Where the map is saved, and as what.
const SAVE: Ask = Ask {
    title: "Save the map of differences",
    kind: Kind::Save,
    forms: &[("CSV table", &["csv"]), ("PLY surface", &["ply"]), ("HTML report", &["html"]), ("Record, for verifying", &["json"])],
    name: "difference.csv",
};

fn legend(ui: &mut Ui, coat: &DifferenceCoat, statistics: &Statistics) -> Option<[f64; 2]> {
    let range_mm = coat.scale.range_mm;
    let legend = Legend {
        name: "Legend of the difference",
        hint: "Above the colours: how much of the surface differs by that. Grey: within its ±. Hatched: no number. Drag outward for a wider range of colours.",
        ends_mm: [-range_mm, range_mm],
        color: &|mm| coat.scale.color(mm as f32, 0.0),
        share: &|mm| share(statistics.bin_ends_mm, &statistics.bins_mm2, mm),
        text: &|mm| signed(mm, coat.scale.decimals()),
        texts: 3,
    };
    legend.show(ui)
}

fn numbers(ui: &mut Ui, s: &Statistics) {
    Grid::new("differences").spacing([14.0, 2.0]).show(ui, |ui| {
        for (name, text) in [
            ("mean", format!("{} ± {} mm", signed(s.mean_mm, 3), fixed(s.mean_uncertainty.error_mm, 3))),
            ("root mean square", format!("{} mm", fixed(s.rms_mm, 3))),
            ("median", format!("{} mm", signed(s.quantiles_mm[3], 3))),
            ("90 % of it", format!("{} to {} mm", signed(s.quantiles_mm[1], 2), signed(s.quantiles_mm[5], 2))),
            ("beyond its ±", format!("{} % of {} mm²", fixed(100.0 * s.sure, 1), fixed(s.area_mm2, 0))),
            ("no number", format!("{} %", fixed(100.0 * s.without(), 1))),
        ] {
            ui.weak(name);
            ui.label(text);
            ui.end_row();
        }
    });
}

/// What the map says where the selected ray first meets the surface, and what belongs to that place, a click away.
fn along_the_ray(ui: &mut Ui, bench: &mut Bench, coat: &DifferenceCoat) {
    let Some(along) = bench.work.measured.ray().and_then(|ray| coat.along(ray)) else { return };
    ui.label(format!("At the selected ray: {}", along.told));
    let Some(partner_mm) = along.partner_mm else { return };
    let link = ui.link(format!("partner at {}", place(partner_mm))).on_hover_text("Casts the ray through both");
    let way = (partner_mm - along.point_mm).normalize_or_zero();
    if link.clicked()
        && let Some(ray) = Ray::new(WorldPoint(along.point_mm - BEFORE_MM * way), way)
    {
        bench.work.measured.add_ray(ray);
    }
}

/// The largest differences, each with its ray a click away.
fn largest(ui: &mut Ui, bench: &mut Bench, extremes: &[Extreme]) {
    if extremes.is_empty() {
        ui.weak("Nothing differs by more than its ±.");
        return;
    }
    ui.weak("Largest, a click casts the ray:");
    for e in extremes {
        let text = format!("{} ± {} mm at {}", signed(e.difference_mm, 2), fixed(e.error_mm, 2), place(e.at_mm));
        if ui.link(text).clicked()
            && let Some(ray) = through(e)
        {
            bench.work.measured.add_ray(ray);
        }
    }
}

/// How far before a place its ray begins, mm: outside the bone there, as a ray is read from outside.
const BEFORE_MM: f64 = 20.0;

/// The ray into the bone against the normal of a place.
fn through(e: &Extreme) -> Option<Ray> {
    Ray::new(WorldPoint(e.at_mm + BEFORE_MM * e.normal), -e.normal)
}
