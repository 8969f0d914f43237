//! One scan brought onto another: which and by what, the fit, and what came of it.

use super::super::bench::Bench;
use super::super::job::Job;
use super::super::measured::Work;
use super::super::widgets::{choose_scans, elided};
use super::super::words::in_the_window;
use super::hand::{self, Steps};
use super::poses;
use super::regions::Regions;
use super::registered::{Fitted, mm3};
use super::two_poses::TwoPoses;
use bregma_field::Progress;
use bregma_measure::landmarks::Landmark;
use bregma_register::Parts;
use bregma_register::landmarks::{Freedom, Paired};
use bregma_session::register::{By, Order, apart, register};
use bregma_session::{Made, Opened};
use egui::{Button, Context, Grid, ScrollArea, Ui};
use glam::DAffine3;
use std::sync::Arc;

/// The panel.
pub struct RegisterPanel {
    /// Numbers of the scan that moves and of the one that stays.
    numbers: [usize; 2],
    by: By,
    /// Names of the landmarks that take no part.
    left_out: Vec<String>,
    /// The surfaces are looked for anywhere, not from where the scan lies.
    anywhere: bool,
    /// What of the surfaces takes part.
    regions: Regions,
    /// What landmarks may do beside turning and shifting.
    freedom: Freedom,
    /// How far clicks move by hand, and where the hand last left the scan.
    steps: Steps,
    left_by_hand: Option<DAffine3>,
    two: TwoPoses,
    job: Option<Job<Fitted>>,
    fitted: Option<Arc<Fitted>>,
}

impl Default for RegisterPanel {
    fn default() -> Self {
        // The second scan onto the first.
        Self {
            numbers: [1, 0],
            by: By::default(),
            left_out: vec![],
            anywhere: false,
            regions: Regions::default(),
            freedom: Freedom::default(),
            steps: Steps::default(),
            left_by_hand: None,
            two: TwoPoses::default(),
            job: None,
            fitted: None,
        }
    }
}

/// Points that a scroll bar takes.
const SCROLL_BAR: f32 = 10.0;
/// Width of a landmark's name, in points: three numbers stand beside it.
const NAME: f32 = 110.0;

impl RegisterPanel {
    /// Takes what the thread brought, and puts the scan there; `Err` is a sentence for the person.
    pub fn poll(&mut self, bench: &mut Bench) -> Result<(), String> {
        let left = bench.view.hand.as_ref().and_then(|hand| hand.left_at(&bench.work.opened));
        self.left_by_hand = left.or(self.left_by_hand);
        let work = &mut bench.work;
        let Some(result) = self.job.as_ref().and_then(Job::poll) else { return Ok(()) };
        self.job = None;
        let fitted = result.map_err(|e| format!("The scans were not registered: {e}"))?;
        if !fitted.place(work) {
            return Err("A scan was closed, changed or moved while it was registered: fit again".into());
        }
        self.fitted = Some(Arc::new(fitted));
        Ok(())
    }

    /// Shows what can be registered, and what was.
    pub fn show(&mut self, ui: &mut Ui, bench: &mut Bench) {
        if bench.work.opened.volumes.len() < 2 {
            ui.weak("Registration brings one scan onto another: open a second one, by File › Add…");
            return;
        }
        if let Some(job) = &self.job {
            if job.ui(ui) {
                self.job = None;
            }
            return;
        }
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            ui.set_max_width(ui.available_width() - SCROLL_BAR);
            self.question(ui, bench);
            hand::numbers(ui, bench, &mut self.steps);
            if let Some(fitted) = self.fitted.clone().filter(|fitted| fitted.stands(&bench.work)) {
                ui.separator();
                fitted.show(ui, bench);
            }
            ui.separator();
            poses::show(ui, bench, self.numbers, |bench| self.made(&bench.work));
            self.two.show(ui, bench, self.numbers);
        });
    }

    /// Looks for one of two scans that lie apart around the other, from anywhere.
    pub fn bring_together(&mut self, bench: &Bench, ctx: &Context) {
        if let Some([stays, moves]) = apart(&bench.work.opened).filter(|_| self.job.is_none()) {
            (self.numbers, self.by, self.anywhere, self.regions) = ([moves, stays], By::Surfaces, true, Regions::default());
            let opened = bench.work.opened.clone();
            let order = self.order(&opened, Parts::default());
            self.fit(ctx, opened, order);
        }
    }

    /// Gives the scan that moves to the hand, or takes it away.
    pub fn toggle_hand(&mut self, bench: &mut Bench) {
        self.numbers = those_open(self.numbers, &bench.work.opened);
        hand::toggle(bench, self.numbers[0]);
    }

    fn fit(&mut self, ctx: &Context, opened: Opened, order: Order) {
        let numbers = self.numbers;
        self.job = Some(Job::start(ctx, "Registering".into(), move |progress| Fitted::new(opened, numbers, order, progress)));
    }

    /// How the registration that stands came about.
    fn made(&self, work: &Work) -> Made {
        let stands = |fitted: &&Arc<Fitted>| fitted.is_of(self.numbers, &work.opened) && fitted.stands(work);
        match self.fitted.as_ref().filter(stands) {
            Some(fitted) => fitted.made(),
            None if self.left_by_hand == Some(work.opened.scene.layers[self.numbers[0]].transform) => Made::ByHand,
            None => Made::Given,
        }
    }

    /// Which scans, and by what.
    fn question(&mut self, ui: &mut Ui, bench: &mut Bench) {
        let work = &bench.work;
        self.which(ui, &work.opened);
        ui.horizontal_wrapped(|ui| {
            ui.radio_value(&mut self.by, By::Surfaces, "By surfaces")
                .on_hover_text("The bone of the one is laid onto the bone of the other");
            let hint = "The values around the surface are laid onto each other: of one object scanned twice, at whatever kernel and scale";
            ui.radio_value(&mut self.by, By::Intensities, "By values").on_hover_text(hint);
            ui.radio_value(&mut self.by, By::Landmarks, "By landmarks").on_hover_text("Points of the same names are laid onto each other");
        });
        let opened = Opened { landmarks: work.measured.landmarks.clone(), ..work.opened.clone() };
        let parts = self.regions.parts(&opened, self.numbers[1]);
        let cannot = match self.by {
            By::Landmarks => self.pairs(ui, &opened),
            _ => {
                self.start(ui);
                self.regions.show(ui, &opened);
                parts.as_ref().err().cloned()
            }
        };
        if let Some(reason) = &cannot {
            ui.colored_label(ui.visuals().warn_fg_color, reason);
        }
        ui.horizontal(|ui| {
            let fit = ui.add_enabled(cannot.is_none(), Button::new("Fit")).on_hover_text("Undo takes it back");
            if fit.clicked() {
                let order = self.order(&opened, parts.unwrap_or_default());
                self.fit(ui.ctx(), opened, order);
            }
            hand::switch(ui, bench, self.numbers[0]);
        });
    }

    /// Which scan moves, and which stays.
    fn which(&mut self, ui: &mut Ui, opened: &Opened) {
        self.numbers = those_open(self.numbers, opened);
        let before = self.numbers;
        choose_scans(ui, opened, &mut self.numbers, &[("Move", "Scan that moves"), ("onto", "Scan that stays")]);
        if self.numbers[0] == self.numbers[1] {
            // The other takes the place that this one left.
            self.numbers = [before[1], before[0]];
        }
    }

    /// Where the surfaces are looked for.
    fn start(&mut self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            let near = "For scans that lie nearly right: quick, and anywhere only where that leads to no agreement";
            ui.radio_value(&mut self.anywhere, false, "From where it lies").on_hover_text(near);
            ui.radio_value(&mut self.anywhere, true, "Anywhere").on_hover_text("However it lies and is turned: this takes longer");
        });
    }

    /// The pairs of landmarks, each with what a fit leaves of it. Gives why there is no fit.
    fn pairs(&mut self, ui: &mut Ui, opened: &Opened) -> Option<String> {
        ui.horizontal(|ui| {
            for (freedom, name, what) in FREEDOMS {
                ui.radio_value(&mut self.freedom, freedom, name).on_hover_text(what);
            }
        });
        let fit = register(opened, self.numbers, &self.order(opened, Parts::default()), &Progress::default());
        let (found, cannot) = match fit {
            Ok(registered) => (registered.report.landmarks, None),
            Err(error) => (vec![], Some(sentence(&error))),
        };
        let names = common(opened, self.numbers);
        if !names.is_empty() {
            Grid::new("pairs").num_columns(4).spacing([10.0, 2.0]).striped(true).show(ui, |ui| {
                ui.weak("landmark, mm");
                for (title, hint) in TITLES {
                    ui.weak(title).on_hover_text(hint);
                }
                ui.end_row();
                names.iter().for_each(|name| self.pair(ui, name, found.iter().find(|pair| pair.name == *name)));
            });
        }
        cannot
    }

    /// A line of the table.
    fn pair(&mut self, ui: &mut Ui, name: &str, pair: Option<&Paired>) {
        let mut used = !self.left_out.iter().any(|out| out == name);
        let is_outlier = used && pair.is_some_and(|pair| pair.is_outlier);
        let (color, spoken, hint) = match (used, is_outlier) {
            (_, true) => {
                let hint = "Farther off than the others explain: look at it, or leave it out";
                (ui.visuals().warn_fg_color, format!("Use {name}, which is far off"), hint)
            }
            (true, _) => (ui.visuals().text_color(), format!("Use {name}"), "Takes part"),
            _ => (ui.visuals().weak_text_color(), format!("Use {name}"), "Takes no part"),
        };
        let tick = ui.scope(|ui| {
            ui.visuals_mut().override_text_color = Some(color);
            let text = elided(ui, name, NAME);
            ui.checkbox(&mut used, text).on_hover_text(format!("{name}: {hint}")).accessible_name(spoken)
        });
        if tick.inner.changed() {
            self.left_out.retain(|out| out != name);
            if !used {
                self.left_out.push(name.to_owned());
            }
        }
        let numbers = pair.map_or([None; 3], |pair| [Some(pair.residual_mm), pair.left_out_mm, pair.shift_mm]);
        numbers.iter().for_each(|v| _ = ui.colored_label(color, v.map_or("–".to_owned(), mm3)));
        ui.end_row();
    }

    fn order(&self, opened: &Opened, parts: Parts) -> Order {
        let [moving, fixed] = self.numbers.map(|n| opened.scene.layers[n].transform);
        if self.by == By::Landmarks {
            return Order { by: self.by, left_out: self.left_out.clone(), freedom: self.freedom, ..Order::default() };
        }
        let start = (!self.anywhere).then(|| fixed.inverse() * moving);
        Order { by: self.by, parts, start, ..Order::default() }
    }
}

/// The numbers where two scans of that number are open, which may have been closed.
fn those_open(numbers: [usize; 2], opened: &Opened) -> [usize; 2] {
    let [moving, fixed] = numbers.map(|n| n.min(opened.volumes.len() - 1));
    if moving == fixed { [1, 0] } else { [moving, fixed] }
}

/// What landmarks may do, its name, and what that means.
const FREEDOMS: [(Freedom, &str, &str); 3] = [
    (Freedom::Rigid, "Rigid", "Turned and shifted: sizes stay"),
    (Freedom::Similarity, "Similarity", "Also made larger or smaller: lengths on the scan are not its own any more"),
    (Freedom::Affine, "Affine", "Also stretched and sheared: lengths on the scan are not its own any more"),
];

/// Columns beside the name, in mm, and what they say.
const TITLES: [(&str, &str); 3] = [
    ("residual", "From the one to the other after the fit, mm"),
    ("left out", "The same where this pair takes no part, mm: how far off the others have it"),
    ("shift", "How far the fit moves the middle of the landmarks where this pair takes no part, mm"),
];

/// An error as a sentence of its own.
pub fn sentence(error: &impl std::fmt::Display) -> String {
    let text = in_the_window(&error.to_string());
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// Names of landmarks that are set in both scans, in the order of the moving scan's.
fn common(opened: &Opened, numbers: [usize; 2]) -> Vec<String> {
    let [moving, fixed] = numbers.map(|n| opened.volumes[n].name());
    let is_set = |l: &&Landmark, scan: &str| l.point_mm.is_some() && l.scan.as_deref() == Some(scan);
    let other = |name: &str| opened.landmarks.iter().filter(|l| is_set(l, fixed)).any(|l| l.name == name);
    opened.landmarks.iter().filter(|l| is_set(l, moving) && other(&l.name)).map(|l| l.name.clone()).collect()
}
