//! What a volume's isosurfaces are where they are transparent: their opacity, their inside, and further ones.

use super::super::widgets::{self, color_button, line, percent};
use bregma_field::Volume;
use bregma_measure::export::suffix;
use bregma_renderer::{Color, Layer, Shell};
use egui::{Align, DragValue, Layout, Ui};

/// Colours of further surfaces: skin first.
const COLORS: [[f32; 3]; 4] = [[0.85, 0.63, 0.52], [0.35, 0.7, 0.9], [0.9, 0.6, 0.0], [0.0, 0.62, 0.45]];

/// The inside's colour and the further isosurfaces.
pub fn show(ui: &mut Ui, volume: &Volume, layer: &mut Layer) {
    let name = volume.name();
    ui.horizontal(|ui| {
        let mut differs = layer.inner_color.is_some();
        let hint = "Seen from within the bone the surface has a colour of its own: it tells the inner table from the outer";
        if ui.checkbox(&mut differs, "Inside in another colour").on_hover_text(hint).changed() {
            layer.inner_color = differs.then_some(Color([0.8, 0.25, 0.2]));
        }
        if let Some(color) = &mut layer.inner_color {
            color_button(ui, color, &format!("Colour of the inside of {name}"));
        }
    });
    let [low, high] = volume.range();
    let mut removed = None;
    for (n, shell) in layer.shells.iter_mut().enumerate() {
        ui.push_id(n, |ui| {
            line(ui, |ui| {
                let which = format!("surface {} of {name}", n + 2);
                if ui.small_button("×").on_hover_text("Remove").accessible_name(format!("Remove {which}")).clicked() {
                    removed = Some(n);
                }
                ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                    color_button(ui, &mut shell.color, &format!("Colour of {which}"));
                    let number = DragValue::new(&mut shell.iso)
                        .custom_formatter(widgets::number)
                        .range(low..=high)
                        .clamp_existing_to_range(false)
                        .max_decimals(3);
                    let number = number.update_while_editing(false).speed((high - low) / 1000.0).suffix(suffix(volume.unit()));
                    ui.add(number).on_hover_text("Its isovalue").accessible_name(format!("Isovalue of {which}"));
                    percent(ui, &mut shell.opacity, &format!("Opacity of {which}"));
                });
            });
        });
    }
    if let Some(n) = removed {
        layer.shells.remove(n);
    }
    let add = ui.button("Add an isosurface").on_hover_text("At another value, such as the skin's");
    if add.accessible_name(format!("Add an isosurface to {name}")).clicked() {
        let color = Color(COLORS[layer.shells.len() % COLORS.len()]);
        // Between air and bone lies skin.
        let iso = ((low + layer.iso) / 2.0).round().clamp(low, high);
        layer.shells.push(Shell { iso, color, opacity: 0.25 });
    }
}
