//! Where the light comes from, and how surfaces answer it.

use super::super::widgets::percent;
use super::ball;
use bregma_renderer::{Light, Scene};
use egui::{DragValue, Ui, vec2};

/// Shows a ball that the light falls on, which is turned by hand, and the parts of Phong's model.
pub fn show(ui: &mut Ui, scene: &mut Scene) {
    ui.horizontal(|ui| {
        if let Some(toward) = ball::turned(ui, scene.light.toward, "Direction of the light") {
            scene.light.toward = toward;
        }
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
