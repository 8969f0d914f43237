//! The section: thickness along a curve through landmarks, of one scan or of two, as a chart whose stations are marked in the picture.

use super::super::ask::{Ask, Kind};
use super::super::bench::Bench;
use super::super::job::{Job, is_at_work};
use super::super::measured::Work;
use super::super::picture::section_curve::SectionCurve;
use super::super::widgets::{choose_scans, color};
use bregma_field::Progress;
use bregma_measure::numbers::{fixed, signed};
use bregma_measure::section::{Named, Path, Station};
use bregma_session::chart::section::{COLORS, runs, sides};
use bregma_session::record::made;
use bregma_session::section::{Measured, SectionError, measure, plane_of};
use bregma_session::{Column, Landmark, Measurement, Opened, Origin, SectionOrder as Order, save};
use egui::{Align2, Button, Color32, DragValue, Id, ScrollArea, Ui, Vec2b};
use egui_plot::{FilledArea, Line, Plot, PlotPoint, Points, Text, VLine};
use std::sync::Arc;

/// The panel.
#[derive(Default)]
pub struct SectionPanel {
    by: By,
    pair: Option<[usize; 2]>,
    /// Landmarks in the order in which the curve goes through them.
    stops: Vec<Stop>,
    step_mm: Option<f64>,
    /// The section, and what it is measured on, which may change meanwhile.
    job: Option<Job<(Measured, Option<Origin>)>>,
    /// What the finished section was measured on.
    origin: Option<Origin>,
    measured: Option<Arc<Measured>>,
    /// Number of the station that the mouse is on.
    hovered: Option<usize>,
    /// The curve is not drawn though there is one.
    hidden: bool,
}

/// Which curve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum By {
    #[default]
    Profile,
    OnePlane,
    Whole,
}

/// Each curve, its name, and what it is.
const KINDS: [(By, &str, &str); 3] = [
    (
        By::Profile,
        "From landmark to landmark",
        "Between two of them in the plane of both and of the mean of the surface's normals there, the shorter way",
    ),
    (By::OnePlane, "In their one plane", "From landmark to landmark in the plane of three, or of least squares through more"),
    (By::Whole, "All around in their plane", "The longest curve of that plane that no other goes round, from the first landmark on it"),
];

/// A landmark that the curve may go through.
#[derive(Clone, Debug, PartialEq)]
struct Stop {
    name: String,
    scan: Option<String>,
    is_in: bool,
}

/// From station to station where nobody says otherwise, mm.
const STEP_MM: f64 = 1.0;
/// What the chart of differences has upward.
const DIFFERENCE: &str = "difference, mm";
/// Height of the charts of thicknesses and of differences, points.
const HEIGHTS: [f32; 2] = [190.0, 120.0];

impl SectionPanel {
    /// The finished section.
    pub fn measured(&self) -> Option<&Arc<Measured>> {
        self.measured.as_ref()
    }

    /// Takes what the thread brought, and gives the picture its curve while that is `seen` and of what is open; `Err` is a sentence for the
    /// person.
    pub fn poll(&mut self, bench: &mut Bench, seen: bool) -> Result<(), String> {
        let found = self.job.as_ref().and_then(Job::poll);
        let mut told = Ok(());
        if let Some(result) = found {
            self.job = None;
            match result {
                Ok((measured, origin)) => {
                    let record = measured.record(origin.as_ref());
                    bench.work.opened.measurements.push(Measurement::Section(Box::new(record)));
                    (self.measured, self.origin, self.hidden, self.hovered) = (Some(Arc::new(measured)), origin, false, None);
                }
                Err(e) => told = Err(format!("The section was not measured: {e}")),
            }
        }
        let shown = self.measured.as_ref().filter(|measured| seen && !self.hidden && measured.is_of(&bench.work.opened));
        bench.view.section = shown.map(|measured| SectionCurve { measured: Arc::clone(measured), hovered: self.hovered });
        told
    }

    /// Shows what can be measured, and what was.
    pub fn show(&mut self, ui: &mut Ui, bench: &mut Bench) {
        if is_at_work(&mut self.job, ui) {
            return;
        }
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            self.question(ui, &bench.work);
            let Some(measured) = self.measured.clone() else { return };
            ui.separator();
            self.found(ui, bench, &measured);
        });
    }

    /// What is to be measured.
    fn question(&mut self, ui: &mut Ui, work: &Work) {
        let opened = &work.opened;
        if opened.volumes.is_empty() {
            ui.weak("Open a scan.");
            return;
        }
        let is_pair = |pair: &[usize; 2]| pair.iter().all(|n| *n < opened.volumes.len());
        let mut pair = self.pair.filter(is_pair).unwrap_or([0, opened.volumes.len().min(2) - 1]);
        if opened.volumes.len() > 1 {
            choose_scans(ui, opened, &mut pair, &[("On", "Scan of the curve"), ("and", "Scan beside it")]);
            self.pair = Some(pair);
        }
        for (by, name, what) in KINDS {
            ui.radio_value(&mut self.by, by, name).on_hover_text(what);
        }
        self.keep_up(&work.measured.landmarks, opened.volumes[pair[0]].name());
        if self.stops.is_empty() {
            ui.weak("Set landmarks (Measure › Landmark): the curve goes through them.");
        }
        self.stops(ui);
        let mut step_mm = self.step_mm.unwrap_or(STEP_MM);
        ui.horizontal(|ui| {
            ui.weak("a station every");
            let number = DragValue::new(&mut step_mm).range(0.01..=100.0).speed(0.05).max_decimals(2).suffix(" mm");
            if ui.add(number).accessible_name("Step of the section").changed() {
                self.step_mm = Some(step_mm);
            }
        });
        let landmarks = self.landmarks(&work.measured.landmarks);
        let needed = if self.by == By::Profile { 2 } else { 3 };
        let hint = format!("{needed} landmarks or more are needed");
        let measures = ui.add_enabled(landmarks.len() >= needed, Button::new("Measure the section")).on_disabled_hover_text(hint);
        if measures.clicked() {
            let (opened, by) = (opened.clone(), self.by);
            let against = (pair[1] != pair[0]).then_some(pair[1]);
            let work = move |progress: &Progress| -> Result<_, SectionError> {
                let order = Order { path: path(by, landmarks)?, step_mm, on: pair[0], against, reach_mm: None };
                Ok((measure(&opened, &order, progress)?, Origin::of(&opened)))
            };
            self.job = Some(Job::start(ui.ctx(), "Measuring".into(), work));
        }
    }

    /// Lists the landmarks that are set; new ones last, and in the curve unless they belong to another scan than that of the curve.
    fn keep_up(&mut self, landmarks: &[Landmark], scan: &str) {
        let is = |stop: &Stop, landmark: &Landmark| (&stop.name, &stop.scan) == (&landmark.name, &landmark.scan);
        let set = || landmarks.iter().filter(|l| l.point_mm.is_some());
        self.stops.retain(|stop| set().any(|landmark| is(stop, landmark)));
        for landmark in set() {
            if !self.stops.iter().any(|stop| is(stop, landmark)) {
                let is_in = landmark.scan.as_deref().is_none_or(|own| own == scan);
                self.stops.push(Stop { name: landmark.name.clone(), scan: landmark.scan.clone(), is_in });
            }
        }
    }

    /// The landmarks, each with a box and its way up.
    fn stops(&mut self, ui: &mut Ui) {
        let mut raised = None;
        for (n, stop) in self.stops.iter_mut().enumerate() {
            ui.push_id(("stop", n), |ui| {
                ui.horizontal(|ui| {
                    let up = ui.add_enabled(n > 0, Button::new("⏶").small()).on_hover_text("Earlier along the curve");
                    if up.accessible_name(format!("{} earlier", stop.name)).clicked() {
                        raised = Some(n);
                    }
                    let hint = stop.scan.as_ref().map_or("A landmark".to_owned(), |scan| format!("A landmark of {scan}"));
                    ui.checkbox(&mut stop.is_in, stop.name.as_str()).on_hover_text(hint);
                });
            });
        }
        if let Some(n) = raised {
            self.stops.swap(n - 1, n);
        }
    }

    /// Those that the curve goes through, in order.
    fn landmarks(&self, landmarks: &[Landmark]) -> Vec<Named> {
        let point = |stop: &Stop| landmarks.iter().find(|l| (&l.name, &l.scan) == (&stop.name, &stop.scan))?.point_mm;
        let named = |stop: &Stop| Some(Named { name: stop.name.clone(), point_mm: point(stop)? });
        self.stops.iter().filter(|stop| stop.is_in).filter_map(named).collect()
    }

    /// What was measured.
    fn found(&mut self, ui: &mut Ui, bench: &mut Bench, measured: &Arc<Measured>) {
        if !measured.is_of(&bench.work.opened) {
            ui.colored_label(ui.visuals().warn_fg_color, "A scan, its isovalue or its place has changed: measure again.");
        }
        let told = &measured.told;
        ui.strong(format!("{} mm along the curve", fixed(told.length_mm, 1)));
        let (thicknesses, differences) = (told.thicknesses(), told.differences());
        let colors = colors(measured, &bench.work.opened, ui.visuals().dark_mode);
        let above = self.chart(ui, measured, "thickness, mm", &thicknesses, &colors);
        let below = if differences.is_empty() { None } else { self.chart(ui, measured, DIFFERENCE, &differences, &colors[2..]) };
        self.hovered = above.or(below);
        // As many lines without a station, so that nothing below moves when the mouse comes.
        let none = vec![" ".to_owned(); 1 + thicknesses.len() + differences.len()];
        let of = |s: &Station| {
            let place = vec![format!("at {} mm", fixed(s.along_mm, 2))];
            [place, words(s, &thicknesses, fixed), words(s, &differences, signed)].concat()
        };
        self.hovered.and_then(|n| told.stations.get(n)).map_or(none, of).into_iter().for_each(|line| {
            ui.weak(line);
        });
        let mut shown = !self.hidden;
        ui.checkbox(&mut shown, "Show the curve");
        self.hidden = !shown;
        if ui.button("Save section…").on_hover_text("The chart as PNG or SVG, the table as CSV, or a record for verifying").clicked() {
            let (measured, origin) = (Arc::clone(measured), self.origin.clone());
            bench.save(ui.ctx(), SAVE, move |bench, file| {
                save::section(file, &measured, &made(&bench.work.opened), origin.as_ref(), bench.remembered.preferences.tables)
            });
        }
        told.notes.iter().for_each(|note| {
            ui.weak(note);
        });
    }

    /// A chart of some columns with their bands; the station that the mouse is on in it.
    fn chart(&self, ui: &mut Ui, measured: &Measured, what: &'static str, columns: &[Column], colors: &[Color32]) -> Option<usize> {
        let (told, is_signed) = (&measured.told, what == DIFFERENCE);
        for ((name, _), color) in columns.iter().zip(colors) {
            ui.horizontal(|ui| {
                ui.spacing_mut().item_spacing.x = 4.0;
                ui.colored_label(*color, "■");
                ui.weak(name.as_str());
            });
        }
        let all = columns.iter().flat_map(|column| runs(&told.stations, column));
        // Above everything there is room for the names of landmarks.
        let top = 1.15 * all.flat_map(|run| sides(&run, !is_signed)).flatten().fold(0.0, f64::max);
        let plot = Plot::new(what)
            .height(HEIGHTS[usize::from(is_signed)])
            .link_axis(Id::unique("section"), Vec2b::new(true, false))
            .x_axis_label("mm along the curve")
            .y_axis_label(what)
            .label_formatter(|_| None)
            .allow_scroll(false)
            .include_y(0.0)
            .include_y(top);
        let shown = plot.show(ui, |plot| {
            for mark in &told.marks {
                plot.vline(VLine::new(mark.name.as_str(), mark.along_mm).color(Color32::from_gray(130)).width(1.0).allow_hover(false));
            }
            for mark in told.marks.iter().filter(|_| !is_signed) {
                let text = Text::new("", PlotPoint::new(mark.along_mm, top), mark.name.as_str());
                plot.text(text.anchor(Align2::CENTER_TOP).allow_hover(false).id(("name", &mark.name)));
            }
            for (n, (column, color)) in columns.iter().zip(colors).enumerate() {
                for (k, run) in runs(&told.stations, column).iter().enumerate() {
                    let along: Vec<f64> = run.iter().map(|[x, ..]| *x).collect();
                    let [low, high] = sides(run, !is_signed);
                    let band = FilledArea::new("", &along, &low, &high).fill_color(color.gamma_multiply(0.25)).allow_hover(false);
                    plot.add(band.id(("band", n, k)));
                    let points: Vec<[f64; 2]> = run.iter().map(|[x, y, _]| [*x, *y]).collect();
                    if run.len() == 1 {
                        plot.points(Points::new("", points).color(*color).radius(2.0).allow_hover(false).id(("point", n, k)));
                    } else {
                        plot.line(Line::new("", points).color(*color).width(1.5).allow_hover(false).id(("line", n, k)));
                    }
                }
            }
            if let Some(station) = self.hovered.and_then(|n| told.stations.get(n)) {
                plot.vline(VLine::new("here", station.along_mm).color(Color32::from_gray(220)).width(1.0).allow_hover(false));
            }
            plot.pointer_coordinate()
        });
        let at_mm = shown.inner.filter(|_| shown.response.hovered())?.x;
        let away = |station: &Station| (station.along_mm - at_mm).abs();
        let nearest = told.stations.iter().enumerate().min_by(|a, b| away(a.1).total_cmp(&away(b.1)))?;
        (away(nearest.1) <= told.order.step_mm).then_some(nearest.0)
    }
}

/// Those of both scans in the picture, and of the differences as in print, whose black is the white of a dark window.
fn colors(measured: &Measured, opened: &Opened, dark: bool) -> Vec<Color32> {
    let order = &measured.told.order;
    let of_scan = |n: Option<usize>, own: [u8; 3]| {
        let layer = n.and_then(|n| opened.scene.layers.get(n));
        layer.map_or(Color32::from_rgb(own[0], own[1], own[2]), |layer| color(layer.color))
    };
    let [first, second, thickness, surface] = COLORS;
    let thickness = if dark { [255; 3] } else { thickness };
    vec![of_scan(Some(order.on), first), of_scan(order.against, second), of_scan(None, thickness), of_scan(None, surface)]
}

/// A station in words, a line for each column.
fn words(station: &Station, columns: &[Column], number: fn(f64, usize) -> String) -> Vec<String> {
    let of = |(name, of): &Column| {
        of(station).map_or(format!("{name}: no number"), |l| format!("{name}: {} ± {} mm", number(l.mm, 2), fixed(l.error_mm, 2)))
    };
    columns.iter().map(of).collect()
}

/// The curve through landmarks.
fn path(by: By, landmarks: Vec<Named>) -> Result<Path, SectionError> {
    Ok(match by {
        By::Profile => Path::Profile { landmarks },
        By::OnePlane => Path::InPlane { plane: plane_of(&landmarks)?, landmarks },
        By::Whole => Path::Whole { plane: plane_of(&landmarks)?, seed: None, landmarks },
    })
}

/// Where the section is saved, and as what.
const SAVE: Ask = Ask {
    title: "Save the section",
    kind: Kind::Save,
    forms: &[("Chart, PNG", &["png"]), ("Chart, SVG", &["svg"]), ("CSV table", &["csv"]), ("Record, for verifying", &["json"])],
    name: "section.png",
};
