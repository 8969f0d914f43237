//! The map of thickness: what is measured, how it is coloured, and what it says in numbers.

use super::super::ask::{Ask, Kind};
use super::super::bench::Bench;
use super::super::job::{Job, is_at_work};
use super::super::measured::Work;
use super::super::widgets::named_radio;
use super::maps::{self, Legend};
use bregma_measure::thickness::Statistics;
use bregma_renderer::{Mode, Scene};
use bregma_session::coat::{Coat, share, white};
use bregma_session::save;
use bregma_session::thickness::{Map, Order, ThicknessCoat, ThicknessMethod};
use bregma_session::thickness_picture::{Colors, Scale};
use egui::{DragValue, Grid, ScrollArea, Ui};
use std::sync::Arc;

/// The panel.
#[derive(Default)]
pub struct ThicknessPanel {
    method: ThicknessMethod,
    /// Number of the scan.
    index: usize,
    /// How far around the last landmark; everywhere when absent.
    patch_mm: Option<f64>,
    colors: Colors,
    /// Ends of the colours where they are not those of the values.
    ends_mm: Option<[f64; 2]>,
    job: Option<Job<Map>>,
    coat: Option<Arc<ThicknessCoat>>,
    /// The surface keeps its own colour though there is a map of it.
    hidden: bool,
}

/// Each method, its name, and what it answers.
const METHODS: [(ThicknessMethod, &str, &str); 3] = [
    (ThicknessMethod::Normal, "Along the normal", "Straight through the wall, as a section across it shows"),
    (
        ThicknessMethod::Sphere,
        "Inscribed sphere",
        "The diameter of the largest sphere in the bone that holds the point: the same from both sides",
    ),
    (ThicknessMethod::Ray, "Along the view", "Along the direction of the view when it is measured"),
];

impl ThicknessPanel {
    /// The finished map with its colours.
    pub fn coat(&self) -> Option<&Arc<ThicknessCoat>> {
        self.coat.as_ref()
    }

    /// Takes what the thread brought; `Err` is a sentence for the person.
    pub fn poll(&mut self) -> Result<(), String> {
        let Some(result) = self.job.as_ref().and_then(Job::poll) else { return Ok(()) };
        self.job = None;
        let map = Arc::new(result.map_err(|e| format!("The thickness was not measured: {e}"))?);
        (self.hidden, self.ends_mm) = (false, None);
        self.coat = Some(Arc::new(ThicknessCoat { scale: self.scale(&map), map }));
        Ok(())
    }

    fn scale(&self, map: &Map) -> Scale {
        Scale { colors: self.colors, ends_mm: self.ends_mm.unwrap_or(map.ends_mm()) }
    }

    /// The scene to paint on and the coat, while the map is shown and is of what is open.
    pub fn painting(&self, work: &Work) -> Option<(Scene, Arc<dyn Coat>)> {
        let coat = self.coat.as_ref().filter(|_| !self.hidden)?;
        let index = coat.map.index_in(&work.opened)?;
        let mut scene = white(work.opened.scene.clone());
        scene.mode = Mode::Iso;
        scene.layers.iter_mut().enumerate().for_each(|(n, layer)| layer.visible = n == index);
        Some((scene, Arc::<ThicknessCoat>::clone(coat)))
    }

    /// Shows what can be measured, and what was.
    pub fn show(&mut self, ui: &mut Ui, bench: &mut Bench) {
        let work = &bench.work;
        if is_at_work(&mut self.job, ui) {
            return;
        }
        self.question(ui, work);
        let Some(coat) = self.coat.clone() else { return };
        ui.separator();
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| self.measured(ui, bench, coat));
    }

    /// What was measured.
    fn measured(&mut self, ui: &mut Ui, bench: &mut Bench, coat: Arc<ThicknessCoat>) {
        let work = &bench.work;
        if coat.map.index_in(&work.opened).is_none() {
            ui.colored_label(ui.visuals().warn_fg_color, "The scan, its isovalue or its place has changed: measure again.");
        }
        ui.strong(&coat.map.title);
        if let Some([low, high]) = legend(ui, &coat) {
            let low = low.max(0.0);
            self.ends_mm = Some([low, high.max(low + 0.01)]);
        }
        statistics(ui, &coat.map.statistics);
        let mut shown = !self.hidden;
        ui.checkbox(&mut shown, "Show on the surface");
        self.hidden = !shown;
        self.colors(ui, &coat);
        let save = ui.button("Save map…").on_hover_text("The points as CSV, or the coloured surface as PLY");
        if let (true, Some(coat)) = (save.clicked(), self.coat.clone()) {
            bench.save(ui.ctx(), SAVE, move |bench, file| save::map(file, &coat, bench.remembered.preferences.tables));
        }
    }

    /// The colours and their ends.
    fn colors(&mut self, ui: &mut Ui, coat: &ThicknessCoat) {
        ui.horizontal(|ui| {
            ui.radio_value(&mut self.colors, Colors::Viridis, "Viridis");
            ui.radio_value(&mut self.colors, Colors::Cividis, "Cividis").on_hover_text("The same for people who confuse red and green");
        });
        ui.horizontal(|ui| {
            let mut automatic = self.ends_mm.is_none();
            let hint = "From 0 to what 95 % of the surface is below; fixed ends make maps of several skulls comparable";
            if ui.checkbox(&mut automatic, "Automatic range").on_hover_text(hint).changed() {
                self.ends_mm = if automatic { None } else { Some(coat.scale.ends_mm) };
            }
            if let Some([low, high]) = &mut self.ends_mm {
                let number = |value, range| DragValue::new(value).range(range).speed(0.05).max_decimals(2).suffix(" mm");
                let (least, greatest) = (*high - 0.01, *low + 0.01);
                ui.add(number(low, 0.0..=least)).accessible_name("Least thickness of the colours");
                ui.add(number(high, greatest..=1000.0)).accessible_name("Greatest thickness of the colours");
            }
        });
        let scale = self.scale(&coat.map);
        if scale != coat.scale {
            self.coat = Some(Arc::new(ThicknessCoat { scale, map: Arc::clone(&coat.map) }));
        }
    }

    /// What is to be measured.
    fn question(&mut self, ui: &mut Ui, work: &Work) {
        let opened = &work.opened;
        self.index = self.index.min(opened.volumes.len().saturating_sub(1));
        if opened.volumes.len() > 1 {
            ui.vertical(|ui| {
                for (n, volume) in opened.volumes.iter().enumerate() {
                    ui.push_id(n, |ui| named_radio(ui, &mut self.index, n, volume.name()));
                }
            });
        }
        for (method, name, what) in METHODS {
            ui.radio_value(&mut self.method, method, name).on_hover_text(what);
        }
        maps::place(ui, &mut self.patch_mm, work.measured.landmarks.iter().rfind(|l| l.point_mm.is_some()));
        if ui.button("Measure the thickness").clicked()
            && let Some(order) = self.order(work)
        {
            self.job = Some(Job::start(ui.ctx(), "Measuring".into(), move |progress| order.measure(progress)));
        }
    }

    /// What is asked for, if there is a scan.
    fn order(&self, work: &Work) -> Option<Order> {
        let (opened, last) = (&work.opened, work.measured.landmarks.iter().rfind(|l| l.point_mm.is_some()));
        let measured = opened.measured();
        let (volume, layer) = (measured.volumes.get(self.index)?, opened.scene.layers.get(self.index)?);
        let name = METHODS.iter().find(|(m, ..)| *m == self.method).map_or("", |(_, name, _)| name).to_lowercase();
        let patch = self.patch_mm.and_then(|mm| Some((last?, mm)));
        let place = patch.map(|(landmark, mm)| format!(", within {mm} mm of {}", landmark.name)).unwrap_or_default();
        let title = format!("{}, thickness {name}{place}", volume.name());
        let mut order = Order::new(volume, layer, self.index, self.method.along(opened.scene.camera.basis().forward), title);
        order.patch = patch.and_then(|(landmark, mm)| Some((landmark.point_mm?, mm)));
        Some(order)
    }
}

/// Where the map is saved, and as what.
const SAVE: Ask = Ask {
    title: "Save the map of thickness",
    kind: Kind::Save,
    forms: &[("CSV table", &["csv"]), ("PLY surface", &["ply"])],
    name: "thickness.csv",
};

fn legend(ui: &mut Ui, coat: &ThicknessCoat) -> Option<[f64; 2]> {
    let statistics = &coat.map.statistics;
    let legend = Legend {
        name: "Legend of the thickness",
        hint: "Above the colours: how much of the surface is that thick. Grey on the surface: not known, or not asked for. Drag an end to move it.",
        ends_mm: coat.scale.ends_mm,
        color: &|mm| coat.scale.color(mm as f32),
        share: &|mm| share(statistics.bin_ends_mm, &statistics.bins_mm2, mm),
        text: &|mm| format!("{mm:.1}"),
        texts: 5,
    };
    legend.show(ui)
}

fn statistics(ui: &mut Ui, statistics: &Statistics) {
    let [least, greatest, p5, p25, median, p75, p95] = statistics.quantiles_mm;
    Grid::new("statistics").spacing([14.0, 2.0]).show(ui, |ui| {
        for (name, text) in [
            ("mean ± deviation", format!("{:.2} ± {:.2} mm", statistics.mean_mm, statistics.deviation_mm)),
            ("median", format!("{median:.2} mm")),
            ("half of the surface", format!("{p25:.2} to {p75:.2} mm")),
            ("90 % of it", format!("{p5:.2} to {p95:.2} mm")),
            ("all", format!("{least:.2} to {greatest:.2} mm")),
            ("area", format!("{:.0} mm²", statistics.area_mm2)),
        ] {
            ui.weak(name);
            ui.label(text);
            ui.end_row();
        }
    });
}
