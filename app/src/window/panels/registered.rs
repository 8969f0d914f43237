//! A registration that was made: how well the scans lie on each other, and the ways on from there.

use super::super::ask::{Ask, Kind};
use super::super::bench::Bench;
use super::super::measured::Work;
use super::super::words::in_the_window;
use bregma_field::{Progress, Registration};
use bregma_measure::numbers::fixed;
use bregma_renderer::Layer;
use bregma_session::register::{Order, RegisterError, Registered, SurfaceReport, register, write};
use bregma_session::{Made, Opened};
use egui::{Align2, Color32, FontId, Grid, Rect, Role, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};
use glam::DVec3;
use std::sync::Arc;

/// A registration, and what it was made of.
pub struct Fitted {
    /// As it was before, with the landmarks.
    before: Opened,
    /// The scan that moved, and the one that stayed.
    numbers: [usize; 2],
    order: Order,
    registered: Registered,
}

impl Fitted {
    /// Makes the registration.
    pub fn new(before: Opened, numbers: [usize; 2], order: Order, progress: &Progress) -> Result<Self, RegisterError> {
        let registered = register(&before, numbers, &order, progress)?;
        Ok(Self { before, numbers, order, registered })
    }

    /// What the moved scan's layer has of it.
    fn registration(&self) -> Registration {
        self.registered.in_scene(&self.before.scene.layers[self.numbers[1]])
    }

    /// The numbers that its scans have now, if they are open.
    fn numbers_in(&self, opened: &Opened) -> Option<[usize; 2]> {
        let number = |n: usize| opened.volumes.iter().position(|volume| Arc::ptr_eq(volume, &self.before.volumes[n]));
        Some([number(self.numbers[0])?, number(self.numbers[1])?])
    }

    /// The number of the moved scan, where the other one lies as it did.
    fn moved_in(&self, opened: &Opened) -> Option<usize> {
        let [moved, stays] = self.numbers_in(opened)?;
        (opened.scene.layers[stays].transform == self.layer(1).transform).then_some(moved)
    }

    fn layer(&self, role: usize) -> &Layer {
        &self.before.scene.layers[self.numbers[role]]
    }

    /// Puts the scan there, unless what it was made of has changed. Whether it did.
    pub fn place(&self, work: &mut Work) -> bool {
        let at = self.moved_in(&work.opened).filter(|n| work.opened.scene.layers[*n].transform == self.layer(0).transform);
        at.map(|n| work.place(n, self.registration())).is_some()
    }

    /// The scans lie as it put them.
    pub fn stands(&self, work: &Work) -> bool {
        self.moved_in(&work.opened).is_some_and(|n| work.opened.scene.layers[n].transform == self.registration().transform)
    }

    /// How it came about, for the list of those that are kept.
    pub fn made(&self) -> Made {
        Made::Fit(Box::new((self.order.clone(), self.registered.clone())))
    }

    /// It is of these scans, by their numbers.
    pub fn is_of(&self, numbers: [usize; 2], opened: &Opened) -> bool {
        self.numbers_in(opened) == Some(numbers)
    }

    /// Shows how well the scans lie on each other, and what can be done with it.
    pub fn show(self: &Arc<Self>, ui: &mut Ui, bench: &mut Bench) {
        let [moved, stays] = self.numbers.map(|n| self.before.volumes[n].name());
        ui.strong(format!("{moved} onto {stays}"));
        self.figures(ui);
        if let Some(surfaces) = &self.registered.report.surfaces {
            histogram(ui, surfaces);
        }
        for note in &self.registered.report.notes {
            ui.colored_label(ui.visuals().warn_fg_color, in_the_window(note));
        }
        if self.registered.registration.covariance.is_some() && self.registration().covariance.is_none() {
            let text = format!("{stays} is stretched by its own registration: how sure this one is does not reach the ± of lengths.");
            ui.colored_label(ui.visuals().warn_fg_color, text);
        }
        ui.horizontal_wrapped(|ui| {
            let hint = "As JSON with how it was made, or as an ITK transform for other programs";
            if ui.button("Save registration…").on_hover_text(hint).clicked() {
                let fitted = Arc::clone(self);
                bench.save(ui.ctx(), SAVE, move |_, file| write(file, &fitted.before, fitted.numbers, &fitted.order, &fitted.registered));
            }
            let back = ui.button("Back to where it was").on_hover_text("The scan and its landmarks, as before the fit");
            if let (true, Some(n)) = (back.clicked(), self.moved_in(&bench.work.opened)) {
                let Layer { transform, residual_mm, covariance, .. } = self.layer(0).clone();
                bench.work.place(n, Registration { transform, residual_mm, covariance });
            }
        });
    }

    fn figures(&self, ui: &mut Ui) {
        let Registered { registration, report } = &self.registered;
        Grid::new("registered").num_columns(2).spacing([14.0, 2.0]).show(ui, |ui| {
            let mut row = |name: &str, text: String, hint: &str| {
                ui.weak(name).on_hover_text(hint);
                ui.label(text).on_hover_text(hint);
                ui.end_row();
            };
            if let Some(rms_mm) = registration.residual_mm {
                row("residual", format!("{} mm", mm3(rms_mm)), "Root mean square of what the fit leaves between landmarks");
            }
            let surfaces = report.surfaces.as_ref();
            if let Some(s) = surfaces {
                row(
                    "distance",
                    format!("{} mm", mm3(s.median_mm)),
                    "Median distance of the surfaces along normals, where they have partners",
                );
                row("spread", format!("{} mm", mm3(s.spread_mm)), "Standard deviation of that distance, but for what is far off");
                row(
                    "with partners",
                    format!("{} %", fixed(100.0 * s.matched, 0)),
                    "How much of the moved surface has a like one beside it",
                );
                row(
                    "offset",
                    format!("{} mm", mm3(s.offset_mm)),
                    "How far the moved surface stands out everywhere, as by another isovalue",
                );
            }
            if let Some(c) = &registration.covariance {
                let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|along| c.variance_at(c.centre_mm, along).sqrt());
                let is_of_two = surfaces.is_some_and(|s| s.is_of_two);
                let (name, hint) = if is_of_two {
                    ("spread of the choice", "How far the middle moves by which parts of the surface are chosen: along x, y and z")
                } else {
                    ("± of the middle", "Standard deviation, along x, y and z, of where the middle of the moved scan lies")
                };
                row(name, format!("{}, {}, {} mm", mm3(x), mm3(y), mm3(z)), hint);
            }
        });
    }
}

/// Where the registration is saved, and as what.
const SAVE: Ask = Ask { title: "Save the registration", kind: Kind::Save, forms: FORMS, name: "registration.json" };

/// The forms of registrations.
pub const FORMS: &[(&str, &[&str])] = &[("Registration", &["json"]), ("ITK transform", &["tfm", "txt"])];

/// Thousandths of a millimetre: surfaces are brought together finer than a voxel.
pub fn mm3(value: f64) -> String {
    fixed(value, 3)
}

const HEIGHT: f32 = 56.0;
const AXIS: f32 = 16.0;

/// How often the surfaces are how far from each other; the middle is no distance.
fn histogram(ui: &mut Ui, surfaces: &SurfaceReport) {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), HEIGHT + AXIS), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "Histogram of distances between the surfaces"));
    let (painter, bins) = (ui.painter_at(rect), &surfaces.histogram);
    let bars = Rect::from_min_size(rect.min, vec2(rect.width(), HEIGHT));
    painter.rect_filled(bars, 3.0, ui.visuals().extreme_bg_color);
    let most = bins.iter().fold(1, |most, (_, count)| most.max(*count)) as f32;
    let width = bars.width() / bins.len().max(1) as f32;
    for (n, (_, count)) in bins.iter().enumerate() {
        let (x, height) = (bars.left() + n as f32 * width, *count as f32 / most * (HEIGHT - 4.0));
        let bar = Rect::from_min_max(pos2(x, bars.bottom() - height), pos2(x + width - 1.0, bars.bottom()));
        painter.rect_filled(bar, 0.0, Color32::from_gray(150));
    }
    painter.vline(bars.center().x, bars.y_range(), Stroke::new(1.0, ui.visuals().strong_text_color()));
    let end_mm = 6.0 * surfaces.spread_mm;
    let ends = [(bars.left(), Align2::LEFT_TOP, format!("−{}", mm3(end_mm))), (bars.center().x, Align2::CENTER_TOP, "0".into())];
    let ends = ends.into_iter().chain([(bars.right(), Align2::RIGHT_TOP, format!("{} mm", mm3(end_mm)))]);
    for (x, align, text) in ends {
        painter.text(pos2(x, bars.bottom() + 2.0), align, text, FontId::proportional(12.0), ui.visuals().text_color());
    }
    response.on_hover_text("How many points of the moved surface lie how far inside or outside the other one");
}
