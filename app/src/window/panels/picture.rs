//! The picture as a file: its size on paper, what stands over it, and its form, told before it is saved and drawn beside the window.

use super::super::ask::{Ask, Kind};
use super::super::bench::Bench;
use super::super::job::Job;
use super::super::words::in_the_window;
use super::Painting;
use bregma_field::Progress;
use bregma_renderer::{Color, Projection, Scene};
use bregma_session::print::record::Record;
use bregma_session::print::{AUTO, Bar, ENDING_LIST, Encoding, Form, Panel, Print, draw, prepare, ratio, scale_of, write};
use bregma_session::{Compare, Machine};
use egui::{Button, Context, DragValue, Grid, TextEdit, Ui, Window};
use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// What is behind the bone.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Ground {
    AsShown,
    White,
    Clear,
}

/// What a person asks of the file.
#[derive(Clone, Debug)]
struct Wishes {
    on_paper: bool,
    size_mm: [f64; 2],
    dpi: f64,
    ground: Ground,
    bar: bool,
    letters: bool,
    marks: bool,
    /// Where nobody says, where colours tell numbers.
    legend: Option<bool>,
    caption: bool,
    label: String,
    is_deep: bool,
}

impl Default for Wishes {
    fn default() -> Self {
        // A column of most journals.
        let (size_mm, dpi) = ([85.0, 100.0], 300.0);
        let (on_paper, bar, letters, marks, legend, caption) = (true, true, true, true, None, false);
        Self { on_paper, size_mm, dpi, ground: Ground::White, bar, letters, marks, legend, caption, label: String::new(), is_deep: false }
    }
}

/// The window that saves pictures.
#[derive(Default)]
pub struct PicturePanel {
    is_open: bool,
    wishes: Wishes,
    /// Where to, once the person has said so.
    chosen: Rc<RefCell<Option<PathBuf>>>,
    job: Option<Job<PathBuf>>,
}

impl PicturePanel {
    /// Opens it, or closes it.
    pub fn toggle(&mut self) {
        self.is_open = !self.is_open;
    }

    /// Takes what the thread brought; `Err` is a sentence for the person.
    pub fn poll(&mut self, bench: &mut Bench) -> Result<(), String> {
        let Some(result) = self.job.as_ref().and_then(Job::poll) else { return Ok(()) };
        self.job = None;
        let file = result.map_err(|e| in_the_window(&e))?;
        bench.messages.note(format!("Saved {}", file.display()));
        Ok(())
    }

    /// Shows it while it is open; `painting` is what the surface wears.
    pub fn show(&mut self, ctx: &Context, bench: &mut Bench, painting: Option<Painting>) {
        let to = self.chosen.borrow_mut().take();
        if let Some(to) = to {
            let (panel, print) = self.ordered(bench, painting.clone());
            self.job = Some(start(ctx, panel, print, self.encoding(), to));
        }
        if !self.is_open || bench.is_empty() {
            return;
        }
        let mut open = true;
        Window::new("Picture")
            .open(&mut open)
            .default_pos([400.0, 90.0])
            .resizable(false)
            .show(ctx, |ui| self.contents(ui, bench, painting));
        self.is_open = open;
    }

    fn contents(&mut self, ui: &mut Ui, bench: &mut Bench, painting: Option<Painting>) {
        let tells = tells(&bench.work.opened.scene, painting.as_ref());
        Grid::new("picture").num_columns(2).spacing([16.0, 8.0]).show(ui, |ui| self.rows(ui, tells));
        ui.separator();
        let (panel, mut print) = self.ordered(bench, painting);
        let told = told(&panel, &print, self.encoding());
        // Only what can be drawn is asked a name for.
        let flaw = prepare(&mut [panel], &mut print).err();
        ui.weak(told);
        if let Some(flaw) = &flaw {
            ui.colored_label(ui.visuals().warn_fg_color, in_the_window(&flaw.to_string()));
        }
        match &self.job {
            Some(job) if job.ui(ui) => self.job = None,
            Some(_) => {}
            None => {
                let can = flaw.is_none() && bench.can_ask();
                if ui.add_enabled(can, Button::new("Save…")).on_hover_text("The ending of the name decides the form").clicked() {
                    let chosen = Rc::clone(&self.chosen);
                    let ask = Ask { title: "Save the picture", kind: Kind::Save, forms: FORMS, name: "picture.png" };
                    bench.ask(ui.ctx(), ask, move |bench, _, files| match files.first().map(|file| (file, Form::of(file))) {
                        Some((file, Ok(_))) => *chosen.borrow_mut() = Some(file.clone()),
                        Some((_, Err(error))) => bench.messages.error(error.to_string()),
                        None => {}
                    });
                }
            }
        }
    }

    fn rows(&mut self, ui: &mut Ui, tells: bool) {
        let wishes = &mut self.wishes;
        ui.label("Size");
        ui.horizontal(|ui| {
            ui.radio_value(&mut wishes.on_paper, true, "On paper");
            ui.radio_value(&mut wishes.on_paper, false, "As on the screen");
        });
        ui.end_row();
        if wishes.on_paper {
            ui.label("");
            ui.horizontal(|ui| {
                for (mm, name) in wishes.size_mm.iter_mut().zip(["Width on paper", "Height on paper"]) {
                    ui.add(DragValue::new(mm).range(10.0..=1000.0).max_decimals(1).suffix(" mm")).accessible_name(name);
                }
                ui.add(DragValue::new(&mut wishes.dpi).range(72.0..=1200.0).max_decimals(0).suffix(" dpi"))
                    .accessible_name("Dots in an inch");
            });
            ui.end_row();
        }
        ui.label("Ground");
        ui.horizontal(|ui| {
            for (ground, name) in [(Ground::White, "White"), (Ground::Clear, "Clear"), (Ground::AsShown, "As shown")] {
                ui.radio_value(&mut wishes.ground, ground, name);
            }
        });
        ui.end_row();
        ui.label("Over it");
        ui.horizontal(|ui| {
            ui.checkbox(&mut wishes.bar, "Scale bar");
            ui.checkbox(&mut wishes.letters, "Letters of the sides");
            ui.checkbox(&mut wishes.marks, "Rays and landmarks").on_hover_text("Dashed, or empty circles, where bone hides them");
        });
        ui.end_row();
        ui.label("Below it");
        ui.horizontal(|ui| {
            ui.checkbox(&mut wishes.caption, "Caption").on_hover_text("What is shown, at which isovalue, and how");
            let mut legend = wishes.legend.unwrap_or(tells);
            if ui.checkbox(&mut legend, "What colours mean").changed() {
                wishes.legend = Some(legend);
            }
        });
        ui.end_row();
        ui.label("Figure's letter");
        ui.add(TextEdit::singleline(&mut wishes.label).desired_width(60.0)).accessible_name("Figure's letter");
        ui.end_row();
        ui.label("Depth");
        ui.checkbox(&mut wishes.is_deep, "16 bits").on_hover_text("Of PNG and TIFF");
        ui.end_row();
    }

    fn encoding(&self) -> Encoding {
        Encoding { is_deep: self.wishes.is_deep, icc: None }
    }

    /// What is to be drawn, and on what sheet.
    fn ordered(&self, bench: &Bench, painting: Option<Painting>) -> (Panel, Print) {
        let (wishes, work) = (&self.wishes, &bench.work);
        let mut opened = work.opened.clone();
        opened.measurements = work.records(bench.found.iter().map(|found| &found.ray), None);
        opened.landmarks.clone_from(&work.measured.landmarks);
        let (tells, mut coat) = (tells(&opened.scene, painting.as_ref()), None);
        if let Some((scene, painted)) = painting {
            (opened.scene, opened.compare, coat) = (scene, Compare::Off, Some(painted));
        }
        opened.scene.background = match wishes.ground {
            Ground::AsShown => opened.scene.background,
            Ground::White => Some(Color([1.0; 3])),
            Ground::Clear => None,
        };
        let on_screen = bench.view.painted.as_ref().map_or([800, 600], |p| [p.picture.width, p.picture.height].map(|n| n * p.reduction));
        let at_target = matches!(opened.scene.viewed_from().projection, Projection::Perspective { .. });
        let print = Print {
            size_px: if wishes.on_paper { Print::pixels(wishes.size_mm, wishes.dpi) } else { on_screen },
            dpi: wishes.on_paper.then_some(wishes.dpi),
            samples: bregma_session::print::PRINT_SAMPLES,
            bar: wishes.bar.then_some(Bar { length_mm: None, at_target }),
            letters: wishes.letters,
            label: Some(wishes.label.trim().to_owned()).filter(|label| !label.is_empty()),
            caption: wishes.caption.then(|| AUTO.to_owned()),
            legend: wishes.legend.unwrap_or(tells),
            marks: wishes.marks,
            ..Print::default()
        };
        (Panel { opened, aim: None, coat }, print)
    }
}

const FORMS: &[(&str, &[&str])] = &[("Picture", ENDING_LIST)];

/// Whether colours stand for numbers.
fn tells(scene: &Scene, painting: Option<&Painting>) -> bool {
    painting.is_some() || scene.tells_depths()
}

/// Pixels, bytes and scale, before anything is drawn.
fn told(panel: &Panel, print: &Print, encoding: Encoding) -> String {
    let [width, height] = print.size_px;
    let channels = if panel.opened.scene.background.is_none() { 4 } else { 3 };
    let bytes = f64::from(width) * f64::from(height) * f64::from(channels) * if encoding.is_deep { 2.0 } else { 1.0 };
    let scale = match scale_of(panel, print) {
        Some(scale) if print.dpi.is_some() => format!("scale {}", ratio(scale)),
        Some(_) => "parallel rays".into(),
        None => "in perspective: no one scale (5: orthographic)".into(),
    };
    format!("{width} × {height} pixels, {:.1} MB before they are compressed, {scale}", bytes / 1e6)
}

/// Draws and writes it on a thread of its own.
fn start(ctx: &Context, panel: Panel, print: Print, encoding: Encoding, file: PathBuf) -> Job<PathBuf> {
    Job::start(ctx, "Drawing the picture".into(), move |progress| saved(panel, print, &encoding, &file, progress).map(|()| file))
}

fn saved(panel: Panel, mut print: Print, encoding: &Encoding, file: &Path, progress: &Progress) -> Result<(), String> {
    let form = Form::of(file).map_err(|e| e.to_string())?;
    form.check(file, encoding, panel.opened.scene.background.is_none()).map_err(|e| e.to_string())?;
    let mut panels = [panel];
    prepare(&mut panels, &mut print).map_err(|e| e.to_string())?;
    let mut renderer = Machine::Auto.renderer().map_err(|e| e.to_string())?;
    let canvas = draw(&panels, &print, renderer.as_mut(), progress).map_err(|e| e.to_string())?;
    let record = Record::of(&panels, &print, encoding, &renderer.name(), file.parent().unwrap_or(Path::new("")));
    write(file, &canvas, encoding, record.map(|record| record.to_string()).as_deref()).map_err(|e| e.to_string())
}
