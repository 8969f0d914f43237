//! What is asked about a file without a header: how its samples lie, with a guess, and a picture of its middle slice that follows the answers.

use super::words::{in_the_window, type_words};
use bregma_field::Progress;
use bregma_field::formats::{RawLayout, raw_guesses};
use bregma_session::{Raw, Source};
use egui::{Color32, ColorImage, Context, DragValue, Grid, Image, RichText, TextureHandle, TextureOptions, Ui};
use std::fmt;

/// The answers so far.
pub struct Headerless {
    guesses: Vec<RawLayout>,
    layout: RawLayout,
    /// What the layout before was, and what came of it.
    shown: Option<(RawLayout, Shown)>,
}

/// The middle slice, and in a sentence why the file cannot be read so.
struct Shown {
    slice: Option<TextureHandle>,
    problem: Option<String>,
}

impl fmt::Debug for Headerless {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Headerless({})", self.layout)
    }
}

/// Each type.
const TYPES: [&str; 4] = ["u8", "u16", "i16", "f32"];
/// Guesses that are shown: the form fits into the lowest window.
const SHOWN: usize = 3;
/// Points along each side of the picture, and samples that it has at most.
const SIDE: f32 = 170.0;
const MOST_SAMPLES: usize = 340;

impl Headerless {
    /// With what is guessed of the file.
    pub fn guess(source: &Source, progress: &Progress) -> Option<Self> {
        let guesses = raw_guesses(&source.file, progress).ok()?;
        let layout = match guesses.first() {
            Some(first) => *first,
            None => "1x1x1,u8".parse().ok()?,
        };
        Some(Self { guesses, layout, shown: None })
    }

    /// How the samples lie, as the person says.
    pub fn raw(&self) -> Raw {
        self.layout.into()
    }

    /// Shows what is asked. True while the file can be read so.
    pub fn ui(&mut self, ui: &mut Ui, source: &Source) -> bool {
        if self.shown.as_ref().is_none_or(|(layout, _)| *layout != self.layout) {
            self.shown = Some((self.layout, Shown::of(ui.ctx(), source, self.layout)));
        }
        if self.guesses.len() > 1 {
            ui.horizontal_wrapped(|ui| {
                ui.weak("Likely:");
                for guess in self.guesses.iter().take(SHOWN) {
                    ui.selectable_value(&mut self.layout, *guess, told(guess));
                }
            });
        }
        ui.horizontal_top(|ui| {
            ui.vertical(|ui| self.fields(ui));
            let Some((_, Shown { slice: Some(slice), .. })) = &self.shown else { return };
            let size = slice.size_vec2();
            let picture = Image::new((slice.id(), size * (SIDE / size.max_elem())));
            ui.add(picture).on_hover_text("The middle slice. Straight edges and smooth bone: the numbers are right");
        });
        let problem = self.shown.as_ref().and_then(|(_, shown)| shown.problem.as_deref());
        match problem {
            Some(text) => ui.label(RichText::new(text).color(ui.visuals().warn_fg_color)),
            None => ui.weak("The size, type and skip use every byte of the file."),
        };
        problem.is_none()
    }

    fn fields(&mut self, ui: &mut Ui) {
        let (mut dims, mut name) = (self.layout.dims(), self.layout.type_name());
        let (mut big_endian, mut skip) = (self.layout.is_big_endian(), self.layout.skip());
        Grid::new("layout").spacing([8.0, 4.0]).show(ui, |ui| {
            for (side, text) in dims.iter_mut().zip(["Width", "Height", "Slices"]) {
                let label = ui.weak(text).id;
                ui.add(DragValue::new(side).range(1..=65_536).update_while_editing(false)).labelled_by(label).accessible_name(text);
                ui.end_row();
            }
            ui.weak("Skip");
            let number = DragValue::new(&mut skip).range(0..=u64::MAX).suffix(" bytes").update_while_editing(false);
            ui.add(number).on_hover_text("What lies before the samples").accessible_name("Bytes to skip");
            ui.end_row();
        });
        for kind in TYPES {
            ui.radio_value(&mut name, kind, type_words(kind));
        }
        // Of one byte there is no order.
        ui.add_enabled(name != "u8", egui::Checkbox::new(&mut big_endian, "Most significant byte first"));
        self.layout = RawLayout::new(dims, name, big_endian && name != "u8", skip).unwrap_or(self.layout);
    }
}

/// A layout in a few words; the rest is seen when it is chosen.
fn told(layout: &RawLayout) -> String {
    let [nx, ny, nz] = layout.dims();
    let bits = type_words(layout.type_name()).split(',').next().unwrap_or_default();
    let skip = if layout.skip() > 0 { format!(" behind {} bytes", layout.skip()) } else { String::new() };
    format!("{nx} × {ny} × {nz}, {bits}{skip}")
}

impl Shown {
    fn of(ctx: &Context, source: &Source, layout: RawLayout) -> Self {
        let as_said = Source { raw: Some(layout.into()), ..source.clone() };
        let problem = as_said.scan(&Progress::default()).err().map(|error| in_the_window(&error.reason.to_string()));
        let slice = layout.middle_slice(&source.file, MOST_SAMPLES).ok().map(|(size, values)| {
            let ends = values.iter().filter(|v| v.is_finite()).fold([f32::MAX, f32::MIN], |[low, high], v| [low.min(*v), high.max(*v)]);
            let grey = |v: &f32| Color32::from_gray((255.0 * (v - ends[0]) / (ends[1] - ends[0]).max(f32::MIN_POSITIVE)) as u8);
            ctx.load_texture("middle slice", ColorImage::new(size, values.iter().map(grey).collect()), TextureOptions::LINEAR)
        });
        Self { slice, problem }
    }
}
