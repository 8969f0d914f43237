//! Where the light comes from, and how surfaces answer it.

use super::super::widgets::percent;
use bregma_renderer::{Light, Scene};
use egui::{Color32, DragValue, Role, Sense, Stroke, Ui, WidgetInfo, vec2};
use glam::Vec3;

/// Across the small sphere, in points.
const SPHERE: f32 = 64.0;

/// Shows a sphere that the light falls on, which is turned by hand, and the parts of Phong's model.
pub fn show(ui: &mut Ui, scene: &mut Scene) {
    ui.horizontal(|ui| {
        sphere(ui, &mut scene.light);
        ui.vertical(|ui| {
            let Light { ambient, diffuse, specular, shininess, shadow, .. } = &mut scene.light;
            for (name, part) in [("Ambient", ambient), ("Diffuse", diffuse), ("Highlight", specular)] {
                share(ui, name, part);
            }
            ui.horizontal(|ui| {
                let number = DragValue::new(shininess).range(1.0..=1000.0).speed(0.3).max_decimals(0);
                ui.add(number).on_hover_text("Phong's exponent: the larger, the smaller the highlight").accessible_name("Shininess");
                ui.weak("Shininess");
            });
            if scene.shadows {
                share(ui, "Shadow", shadow);
            }
        });
    });
    if scene.light != Light::default() && ui.button("Light as at first").clicked() {
        scene.light = Light::default();
    }
}

fn share(ui: &mut Ui, name: &str, part: &mut f32) {
    ui.horizontal(|ui| {
        ui.add_sized(vec2(58.0, ui.spacing().interact_size.y), egui::Label::new(egui::RichText::new(name).weak()));
        percent(ui, part, name);
    });
}

/// A ball as the light falls on it; a click or a drag puts the light over that point of its near half.
fn sphere(ui: &mut Ui, light: &mut Light) {
    let (rect, response) = ui.allocate_exact_size(vec2(SPHERE, SPHERE), Sense::click_and_drag());
    response.widget_info(|| WidgetInfo::labeled(Role::Slider, true, "Direction of the light"));
    let radius = rect.width() / 2.0 - 2.0;
    if let Some(at) = response.interact_pointer_pos() {
        let from = (at - rect.center()) / radius;
        // Beside the ball the light comes from the side.
        let [x, y] = if from.length() > 1.0 { [from.x / from.length(), -from.y / from.length()] } else { [from.x, -from.y] };
        light.toward = Vec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt());
    }
    let painter = ui.painter_at(rect);
    let toward = light.toward.normalize_or(Vec3::Z);
    // Rings of light around the point that faces it, from the dark rim inward.
    painter.circle_filled(rect.center(), radius, Color32::from_gray(40));
    for n in 1..=12_u8 {
        let part = f32::from(n) / 12.0;
        let middle = rect.center() + vec2(toward.x, -toward.y) * radius * part * 0.5;
        painter.circle_filled(middle, radius * (1.0 - part * 0.5 - 0.45 * part * part), Color32::from_gray(40 + n * 14));
    }
    let dot = rect.center() + vec2(toward.x, -toward.y) * radius;
    painter.circle(dot, 4.0, Color32::from_rgb(255, 215, 80), Stroke::new(1.0, Color32::BLACK));
    response.on_hover_text("Drag: where the light comes from, as seen from here");
}
