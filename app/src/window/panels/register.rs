//! One scan brought onto another: which and by what, the fit, and what came of it.

use super::super::bench::Bench;
use super::super::job::Job;
use super::super::measured::Work;
use super::super::widgets::elided;
use super::super::words::in_the_window;
use super::registered::{Fitted, mm3};
use bregma_field::Progress;
use bregma_measure::landmarks::Landmark;
use bregma_register::landmarks::Paired;
use bregma_session::Opened;
use bregma_session::register::{By, Order, RegisterError, register};
use egui::{Button, ComboBox, Grid, ScrollArea, Ui};
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
    job: Option<Job<Fitted>>,
    fitted: Option<Arc<Fitted>>,
}

impl Default for RegisterPanel {
    fn default() -> Self {
        // The second scan onto the first.
        Self { numbers: [1, 0], by: By::default(), left_out: vec![], anywhere: false, job: None, fitted: None }
    }
}

/// Points that a scroll bar takes.
const SCROLL_BAR: f32 = 10.0;
/// Width of a landmark's name, in points: three numbers stand beside it.
const NAME: f32 = 110.0;

impl RegisterPanel {
    /// Takes what the thread brought, and puts the scan there; `Err` is a sentence for the person.
    pub fn poll(&mut self, work: &mut Work) -> Result<(), String> {
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
            self.question(ui, &bench.work);
            if let Some(fitted) = self.fitted.clone().filter(|fitted| fitted.stands(&bench.work)) {
                ui.separator();
                fitted.show(ui, bench);
            }
        });
    }

    /// Which scans, and by what.
    fn question(&mut self, ui: &mut Ui, work: &Work) {
        self.which(ui, &work.opened);
        ui.horizontal(|ui| {
            ui.radio_value(&mut self.by, By::Surfaces, "By surfaces")
                .on_hover_text("The bone of the one is laid onto the bone of the other");
            ui.radio_value(&mut self.by, By::Landmarks, "By landmarks").on_hover_text("Points of the same names are laid onto each other");
        });
        let opened = Opened { landmarks: work.measured.landmarks.clone(), ..work.opened.clone() };
        let cannot = match self.by {
            By::Surfaces | By::Intensities => {
                self.start(ui);
                None
            }
            By::Landmarks => self.pairs(ui, &opened),
        };
        if let Some(reason) = &cannot {
            ui.colored_label(ui.visuals().warn_fg_color, reason);
        }
        let fit = ui.add_enabled(cannot.is_none(), Button::new("Fit")).on_hover_text("Undo takes it back");
        if fit.clicked() {
            let (numbers, order) = (self.numbers, self.order(&opened));
            self.job = Some(Job::start(ui.ctx(), "Registering".into(), move |progress| Fitted::new(opened, numbers, order, progress)));
        }
    }

    /// Which scan moves, and which stays.
    fn which(&mut self, ui: &mut Ui, opened: &Opened) {
        let last = opened.volumes.len() - 1;
        let [moving, fixed] = self.numbers.map(|n| n.min(last));
        // Scans may have been closed.
        self.numbers = if moving == fixed { [1, 0] } else { [moving, fixed] };
        let before = self.numbers;
        Grid::new("which").num_columns(2).show(ui, |ui| {
            for (role, (word, name)) in [("Move", "Scan that moves"), ("onto", "Scan that stays")].into_iter().enumerate() {
                ui.weak(word);
                let width = ui.available_width() - 20.0;
                let shown = elided(ui, opened.volumes[self.numbers[role]].name(), width - 40.0);
                let combo = ComboBox::from_id_salt(name).selected_text(shown).width(width).show_ui(ui, |ui| {
                    for (n, volume) in opened.volumes.iter().enumerate() {
                        let text = elided(ui, volume.name(), width - 40.0);
                        ui.selectable_value(&mut self.numbers[role], n, text).accessible_name(volume.name());
                    }
                });
                combo.response.on_hover_text(name).accessible_name(name);
                ui.end_row();
            }
        });
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
        let fit = register(opened, self.numbers, &self.order(opened), &Progress::default());
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

    fn order(&self, opened: &Opened) -> Order {
        let [moving, fixed] = self.numbers.map(|n| opened.scene.layers[n].transform);
        let start = (self.by != By::Landmarks && !self.anywhere).then(|| fixed.inverse() * moving);
        let left_out = if self.by == By::Landmarks { self.left_out.clone() } else { vec![] };
        Order { by: self.by, left_out, start, ..Order::default() }
    }
}

/// Columns beside the name, in mm, and what they say.
const TITLES: [(&str, &str); 3] = [
    ("residual", "From the one to the other after the fit, mm"),
    ("left out", "The same where this pair takes no part, mm: how far off the others have it"),
    ("shift", "How far the fit moves the middle of the landmarks where this pair takes no part, mm"),
];

/// An error as a sentence of its own.
fn sentence(error: &RegisterError) -> String {
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
