//! The picture as a file: its size on paper, what stands over it, and its form, told before it is saved and drawn beside the window.

use super::super::ask::{Ask, Kind};
use super::super::bench::Bench;
use super::super::widgets;
use super::super::words::in_the_window;
use super::Painting;
use super::saving::Saving;
use super::studio;
use bregma_field::Progress;
use bregma_renderer::studio::can_light;
use bregma_renderer::{Color, Projection, Scene};
use bregma_session::print::record::Record;
use bregma_session::print::{AUTO, Bar, ENDING_LIST, Encoding, Form, Panel, Print, draw, prepare, ratio, scale_of, write};
use bregma_session::studio::{Exposure, Stop, Told};
use bregma_session::{Compare, Machine};
use egui::{Context, DragValue, Grid, TextEdit, Ui, Window};
use std::path::Path;

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
    /// Under studio light no block of pixels has more noise, 255ths.
    noise: f64,
}

impl Default for Wishes {
    fn default() -> Self {
        // A column of most journals.
        let (size_mm, dpi) = ([85.0, 100.0], 300.0);
        let (on_paper, bar, letters, marks, legend, caption) = (true, true, true, true, None, false);
        Self {
            on_paper,
            size_mm,
            dpi,
            ground: Ground::White,
            bar,
            letters,
            marks,
            legend,
            caption,
            label: String::new(),
            is_deep: false,
            noise: 1.0,
        }
    }
}

/// The window that saves pictures.
#[derive(Default)]
pub struct PicturePanel {
    is_open: bool,
    wishes: Wishes,
    saving: Saving,
}

impl PicturePanel {
    /// Opens it, or closes it.
    pub fn toggle(&mut self) {
        self.is_open = !self.is_open;
    }

    /// Takes what the thread brought; `Err` is a sentence for the person.
    pub fn poll(&mut self, bench: &mut Bench) -> Result<(), String> {
        self.saving.poll(bench)
    }

    /// Shows it while it is open; `painting` is what the surface wears.
    pub fn show(&mut self, ctx: &Context, bench: &mut Bench, painting: Option<Painting>) {
        if let Some(to) = self.saving.chosen() {
            let ((panel, print), encoding) = (self.ordered(bench, painting.clone()), self.encoding());
            self.saving.start(ctx, "Drawing the picture", to, move |file, progress| saved(panel, print, &encoding, file, progress));
        }
        if !self.is_open || bench.is_empty() {
            return;
        }
        let mut open = true;
        widgets::beside_view(ctx, Window::new("Picture"))
            .open(&mut open)
            .resizable(false)
            .show(ctx, |ui| self.contents(ui, bench, painting));
        self.is_open = open;
    }

    fn contents(&mut self, ui: &mut Ui, bench: &mut Bench, painting: Option<Painting>) {
        // Maps have no studio light.
        if painting.is_none() {
            studio::show(ui, &mut bench.work.opened);
            ui.separator();
        }
        let tells = tells(&bench.work.opened.scene, painting.as_ref());
        let is_lit = painting.is_none() && bench.work.opened.scene.studio.is_some();
        Grid::new("picture").num_columns(2).spacing([16.0, 8.0]).show(ui, |ui| self.rows(ui, tells, is_lit));
        ui.separator();
        let (panel, mut print) = self.ordered(bench, painting);
        let exposed = bench.view.painted.as_ref().and_then(|painted| painted.exposed).map(|(told, _)| told);
        ui.weak(told(&panel, &print, self.encoding(), exposed));
        // Only what can be drawn is asked a name for.
        let flaw = flaw(panel, &mut print);
        if let Some(flaw) = &flaw {
            ui.colored_label(ui.visuals().warn_fg_color, in_the_window(flaw));
        }
        if !self.saving.is_at_work(ui) {
            let ask = Ask { title: "Save the picture", kind: Kind::Save, forms: FORMS, name: "picture.png" };
            let check = |file: &Path| Form::of(file).map(|_| ()).map_err(|e| e.to_string());
            self.saving.button(ui, bench, flaw.is_none(), ("Save…", "The ending of the name decides the form"), ask, check);
        }
    }

    fn rows(&mut self, ui: &mut Ui, tells: bool, is_lit: bool) {
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
        ui.horizontal(|ui| {
            ui.checkbox(&mut wishes.is_deep, "16 bits").on_hover_text("Of PNG and TIFF");
            if is_lit {
                ui.add_space(12.0);
                ui.add(DragValue::new(&mut wishes.noise).range(0.3..=16.0).speed(0.02).max_decimals(1).prefix("noise ").suffix(" of 255"))
                    .on_hover_text("Studio light is drawn until no 8 × 8 pixels have more: below 1 it is not seen")
                    .accessible_name("Noise that is left");
            }
        });
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
        let stop = Stop { noise: Some(wishes.noise), ..Stop::default() };
        let print = Print {
            exposure: opened.scene.studio.is_some().then_some(Exposure { stop, ..Exposure::default() }),
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

/// Why the sheet cannot be drawn.
fn flaw(panel: Panel, print: &mut Print) -> Option<String> {
    let scene = &panel.opened.scene;
    let unlit = scene.studio.as_ref().and_then(|_| can_light(scene).err()).map(|e| e.to_string());
    unlit.or_else(|| prepare(&mut [panel], print).err().map(|e| e.to_string()))
}

/// Pixels, bytes and scale, before anything is drawn; and how long studio light takes, by what the view says of it.
fn told(panel: &Panel, print: &Print, encoding: Encoding, exposed: Option<Told>) -> String {
    let [width, height] = print.size_px;
    let channels = if panel.opened.scene.background.is_none() { 4 } else { 3 };
    let pixels = f64::from(width) * f64::from(height);
    let bytes = pixels * f64::from(channels) * if encoding.is_deep { 2.0 } else { 1.0 };
    let scale = match scale_of(panel, print) {
        Some(scale) if print.dpi.is_some() => format!("scale {}", ratio(scale)),
        Some(_) => "parallel rays".into(),
        None => "in perspective: no one scale (5: orthographic)".into(),
    };
    let noise = print.exposure.and_then(|exposure| exposure.stop.noise);
    // Noise falls with the root of the samples; a single sample does not tell it.
    let time = noise.zip(exposed.filter(|told| told.noise.is_finite())).map_or(String::new(), |(noise, told)| {
        let seconds = pixels * f64::from(told.samples) * (told.noise / noise).powi(2) * told.sample_s;
        format!(", drawn in about {:.0} s", seconds.max(1.0))
    });
    format!("{width} × {height} pixels, {:.1} MB before they are compressed, {scale}{time}", bytes / 1e6)
}

/// Draws and writes it.
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
