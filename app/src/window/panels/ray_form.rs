//! A difference ray by numbers: where it begins, and its direction or a point that it goes through.

use super::super::widgets::vector;
use bregma_field::WorldPoint;
use bregma_renderer::{Camera, Ray};
use egui::Ui;
use glam::DVec3;

/// The numbers that are being typed.
#[derive(Clone, Copy, Debug, Default)]
pub struct RayForm {
    /// On the screen.
    pub open: bool,
    origin_mm: DVec3,
    /// Whether `second` is a point of the ray, and not its direction.
    is_toward: bool,
    second: DVec3,
}

impl RayForm {
    /// Opens with the numbers of `ray`, or else of the view.
    pub fn begin(&mut self, ray: Option<&Ray>, camera: &Camera) {
        *self = match ray {
            Some(ray) => Self { open: true, origin_mm: ray.origin.0, is_toward: false, second: ray.direction },
            None => Self { open: true, origin_mm: camera.eye_mm, is_toward: true, second: camera.target_mm },
        };
    }

    /// Shows the form. Gives the ray that is to be cast.
    pub fn show(&mut self, ui: &mut Ui) -> Option<Ray> {
        ui.strong("Ray by numbers");
        ui.weak("From, mm (LPS)");
        vector(ui, "", "origin of the ray", &mut self.origin_mm, 0.05);
        ui.horizontal(|ui| {
            ui.radio_value(&mut self.is_toward, false, "along");
            ui.radio_value(&mut self.is_toward, true, "toward the point");
        });
        let name = if self.is_toward { "point that the ray goes toward" } else { "direction of the ray" };
        vector(ui, "", name, &mut self.second, if self.is_toward { 0.05 } else { 0.01 });
        let direction = if self.is_toward { self.second - self.origin_mm } else { self.second };
        let ray = Ray::new(WorldPoint(self.origin_mm), direction);
        let mut cast = None;
        ui.horizontal(|ui| {
            let button = ui.add_enabled(ray.is_some(), egui::Button::new("Cast"));
            if button.on_disabled_hover_text("It has no direction: change one of the numbers").clicked() {
                cast = ray;
            }
            if ui.button("Close").clicked() {
                self.open = false;
            }
        });
        cast
    }
}
