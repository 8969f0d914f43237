//! One scan held upright: in the Frankfurt horizontal, or about the plane that makes it most like its mirror image.

use super::super::bench::Bench;
use super::super::job::Job;
use super::super::measured::Work;
use super::super::widgets::elided;
use super::register::sentence;
use bregma_field::{Progress, Registration, Surface, Volume};
use bregma_measure::landmarks::Landmark;
use bregma_measure::numbers::fixed;
use bregma_register::orient::{self, OrientError, Plane};
use bregma_register::{Parts, sureness};
use bregma_session::Opened;
use egui::{Button, ComboBox, Context, DragValue, Grid, Ui, Window};
use glam::{DAffine3, DQuat};
use std::sync::Arc;

/// The panel.
pub struct UprightPanel {
    is_open: bool,
    /// Number of the scan.
    n: usize,
    by_symmetry: bool,
    /// Standard deviation of each coordinate of a landmark, mm.
    pick_mm: f64,
    job: Option<Job<Held>>,
    /// The plane that was found.
    found: Option<Held>,
}

impl Default for UprightPanel {
    fn default() -> Self {
        // Points of the cranium are picked to about 1 mm (Sholts et al. 2011).
        Self { is_open: false, n: 0, by_symmetry: false, pick_mm: 1.0, job: None, found: None }
    }
}

/// How a scan would be held.
#[derive(Debug)]
struct Held {
    /// Of which scan, where that lies, and its isovalue.
    of: (Arc<Volume>, DAffine3, f64),
    /// Moves it from there.
    motion: DAffine3,
    /// What is known of it: names, texts and what they mean.
    facts: Vec<[String; 3]>,
}

/// Width of the contents, in points.
const WIDTH: f32 = 330.0;

impl UprightPanel {
    /// Opens it.
    pub fn open(&mut self) {
        self.is_open = true;
    }

    /// Takes what the thread brought; `Err` is a sentence for the person.
    pub fn poll(&mut self) -> Result<(), String> {
        let Some(result) = self.job.as_ref().and_then(Job::poll) else { return Ok(()) };
        self.job = None;
        self.found = Some(result.map_err(|e| format!("No plane of symmetry was found: {e}"))?);
        Ok(())
    }

    /// Shows the panel, where it is open.
    pub fn show(&mut self, ctx: &Context, bench: &mut Bench) {
        let mut open = self.is_open && !bench.is_empty();
        let window = Window::new("Hold upright").open(&mut open).default_pos([60.0, 60.0]).default_width(WIDTH).resizable(false);
        window.show(ctx, |ui| self.contents(ui, bench));
        self.is_open = open;
    }

    fn contents(&mut self, ui: &mut Ui, bench: &mut Bench) {
        ui.set_width(WIDTH);
        if let Some(job) = &self.job {
            if job.ui(ui) {
                self.job = None;
            }
            return;
        }
        self.which(ui, &bench.work.opened);
        ui.horizontal(|ui| {
            let frankfurt = "The plane through both poria and the left orbitale becomes level, and the face looks forward";
            ui.radio_value(&mut self.by_symmetry, false, "Frankfurt horizontal").on_hover_text(frankfurt);
            let symmetry = "The plane about which the surface is most like its mirror image becomes upright, from front to back";
            ui.radio_value(&mut self.by_symmetry, true, "By symmetry").on_hover_text(symmetry);
        });
        let work = &bench.work;
        let motion = if self.by_symmetry { self.symmetry(ui, &work.opened) } else { self.frankfurt(ui, work) };
        let hold = ui.add_enabled(motion.is_some(), Button::new("Hold it so"));
        let hold =
            hold.on_hover_text("The scan and its landmarks are turned; undo takes it back").on_disabled_hover_text("Nothing is found yet");
        if let (true, Some(motion)) = (hold.clicked(), motion) {
            let transform = motion * bench.work.opened.scene.layers[self.n].transform;
            bench.work.place(self.n, Registration::of(transform));
        }
        if bench.work.opened.volumes.len() > 1 {
            ui.weak("Only this scan is turned: bring the others onto it afterwards, by Register.");
        }
    }

    /// Shows the plane that was found. Gives what would hold the scan about it.
    fn symmetry(&mut self, ui: &mut Ui, opened: &Opened) -> Option<DAffine3> {
        if ui.button("Find the plane").clicked() {
            let (opened, n) = (opened.clone(), self.n);
            self.job = Some(Job::start(ui.ctx(), "Mirroring".into(), move |progress| by_symmetry(&opened, n, progress)));
        }
        self.found.take_if(|held| !held.is_of(opened, self.n));
        self.found.as_ref().map(|held| held.show(ui))
    }

    /// Shows how the landmarks would hold the scan, and gives it.
    fn frankfurt(&mut self, ui: &mut Ui, work: &Work) -> Option<DAffine3> {
        ui.horizontal(|ui| {
            ui.weak("Picks are good to");
            let pick = DragValue::new(&mut self.pick_mm).range(0.01..=20.0).speed(0.02).max_decimals(2).suffix(" mm");
            ui.add(pick).on_hover_text("Standard deviation of each coordinate of a landmark").accessible_name("Error of picks");
        });
        match by_points(&work.opened, &work.measured.landmarks, self.n, self.pick_mm) {
            Ok(held) => Some(held.show(ui)),
            Err(error) => {
                ui.colored_label(ui.visuals().warn_fg_color, sentence(&error));
                None
            }
        }
    }

    fn which(&mut self, ui: &mut Ui, opened: &Opened) {
        self.n = self.n.min(opened.volumes.len() - 1);
        let name = opened.volumes[self.n].name();
        let combo = ComboBox::from_id_salt("upright").width(WIDTH - 10.0).selected_text(elided(ui, name, WIDTH - 50.0));
        let combo = combo.show_ui(ui, |ui| {
            for (n, volume) in opened.volumes.iter().enumerate() {
                let text = elided(ui, volume.name(), WIDTH - 50.0);
                ui.selectable_value(&mut self.n, n, text).accessible_name(volume.name());
            }
        });
        combo.response.on_hover_text(name).accessible_name("Scan to hold");
    }
}

impl Held {
    fn new(opened: &Opened, n: usize, motion: DAffine3, mut facts: Vec<[String; 3]>) -> Self {
        let (_, angle) = DQuat::from_mat3(&motion.matrix3).to_axis_angle();
        let turned = fact("turned by", format!("{}°", fixed(angle.to_degrees(), 2)), "From how it lies now");
        facts.insert(0, turned);
        let layer = &opened.scene.layers[n];
        Self { of: (Arc::clone(&opened.volumes[n]), layer.transform, layer.iso), motion, facts }
    }

    fn is_of(&self, opened: &Opened, n: usize) -> bool {
        let layer = &opened.scene.layers[n];
        Arc::ptr_eq(&opened.volumes[n], &self.of.0) && (layer.transform, layer.iso) == (self.of.1, self.of.2)
    }

    /// Shows what is known of it, and gives how it moves the scan.
    fn show(&self, ui: &mut Ui) -> DAffine3 {
        Grid::new("held").num_columns(2).spacing([14.0, 2.0]).show(ui, |ui| {
            for [name, text, what] in &self.facts {
                ui.weak(name).on_hover_text(what);
                ui.label(text).on_hover_text(what);
                ui.end_row();
            }
        });
        self.motion
    }
}

fn fact(name: &str, text: String, what: &str) -> [String; 3] {
    [name.to_owned(), text, what.to_owned()]
}

fn by_points(opened: &Opened, landmarks: &[Landmark], n: usize, pick_mm: f64) -> Result<Held, OrientError> {
    let name = opened.volumes[n].name();
    let own: Vec<Landmark> = landmarks.iter().filter(|l| l.scan.as_deref() == Some(name)).cloned().collect();
    let held = orient::frankfurt(&own, pick_mm)?;
    let [pitch, roll, yaw] = held.deviation_deg.to_array().map(|deg| fixed(deg, 2));
    let mut facts = vec![
        fact("± of the pitch", format!("{pitch}°"), "Standard deviation of the turn about the line of the poria, by the picks"),
        fact("± of roll and yaw", format!("{roll}°, {yaw}°"), "Of the turns about the axes to the front and upward"),
    ];
    if let Some(mm) = held.right_orbitale_mm {
        facts.push(fact("right orbitale", format!("{} mm above", fixed(mm, 2)), "Where it lies against the plane; it takes no part"));
    }
    Ok(Held::new(opened, n, held.pose, facts))
}

fn by_symmetry(opened: &Opened, n: usize, progress: &Progress) -> Result<Held, OrientError> {
    let layer = &opened.scene.layers[n];
    let surface = Surface::new(&opened.measured().volumes[n], layer.iso, layer.transform)?;
    let found = orient::symmetry(&surface, &Parts::default(), progress)?;
    let fit = &found.found.fit;
    let facts = vec![
        fact(
            "± of the plane",
            format!("{}°", fixed(plane_deg(&found.plane, fit), 3)),
            "By which parts of the surface are chosen; asymmetry biases it",
        ),
        fact(
            "twist",
            format!("{}°", fixed(found.twist_deg, 2)),
            "What the best mirror image turns beside mirroring: 0 but for what is not symmetric",
        ),
        fact(
            "between the halves",
            format!("{} mm", fixed(fit.median_mm(), 3)),
            "Median distance of one side from the other's mirror image",
        ),
    ];
    Ok(Held::new(opened, n, found.plane.upright(), facts))
}

/// Standard deviation of the direction of a plane of symmetry, degrees, the larger of both ways. A plane that turns by an angle turns its mirror
/// image by twice that.
fn plane_deg(plane: &Plane, fit: &bregma_register::surfaces::Fit) -> f64 {
    let matrix = sureness::covariance(fit).matrix;
    let variance = |axis: glam::DVec3| {
        let a = axis.to_array();
        (0..3).map(|i| (0..3).map(|j| a[i] * matrix[i][j] * a[j]).sum::<f64>()).sum::<f64>()
    };
    let (one, other) = plane.normal.any_orthonormal_pair();
    (0.5 * variance(one).max(variance(other)).sqrt()).to_degrees()
}
