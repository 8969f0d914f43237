//! Parts that several panels have.

use bregma_renderer::Color;
use bregma_session::Opened;
use egui::emath::format_with_decimals_in_range;
use egui::{
    Align, Align2, Color32, ComboBox, Context, DragValue, Galley, Grid, Layout, Slider, TextStyle, TextWrapMode, Ui, WidgetText, Window,
    vec2,
};
use glam::DVec3;
use std::ops::RangeInclusive;
use std::sync::Arc;

/// A line of its own height that is filled from the right.
pub fn line<R>(ui: &mut Ui, add: impl FnOnce(&mut Ui) -> R) -> R {
    ui.horizontal(|ui| ui.with_layout(Layout::right_to_left(Align::Center), add).inner).inner
}

/// A window over the picture that leaves most of the view to be seen: at the right, over what was found.
pub fn beside_view<'a>(ctx: &Context, window: Window<'a>) -> Window<'a> {
    window.pivot(Align2::RIGHT_TOP).default_pos(ctx.content_rect().right_top() + vec2(-10.0, 60.0))
}

/// A slider from 0 to 100 %, as wide as there is room.
pub fn percent(ui: &mut Ui, share: &mut f32, name: &str) {
    // Room for "100 %": a row wider than the panel would widen it.
    ui.spacing_mut().slider_width = ui.available_width() - 75.0;
    let percent = |value: f64, _: RangeInclusive<usize>| format!("{:.0} %", 100.0 * value);
    let slider = Slider::new(share, 0.0..=1.0).custom_formatter(percent).custom_parser(parse_percent).update_while_editing(false);
    ui.add(slider).accessible_name(name);
}

fn parse_percent(text: &str) -> Option<f64> {
    text.trim_end_matches(['%', ' ']).trim().parse::<f64>().ok().map(|p| p / 100.0)
}

/// A number as the widgets show it, but for a negative zero.
pub fn number(value: f64, decimals: RangeInclusive<usize>) -> String {
    let text = format_with_decimals_in_range(value, decimals);
    match text.strip_prefix(['-', '−']) {
        Some(digits) if !digits.contains(|c: char| ('1'..='9').contains(&c)) => digits.to_owned(),
        _ => text,
    }
}

/// Three numbers in a line.
pub fn vector(ui: &mut Ui, label: &str, name: &str, value: &mut DVec3, speed: f64) {
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        ui.weak(label);
        for (axis, coordinate) in ["x", "y", "z"].into_iter().zip(value.as_mut()) {
            let drag = DragValue::new(coordinate)
                .speed(speed)
                .range(-1e5..=1e5)
                .max_decimals(if speed < 0.1 { 3 } else { 1 })
                .custom_formatter(number)
                .update_while_editing(false);
            ui.add(drag).accessible_name(format!("{axis} of the {name}"));
        }
    });
}

/// A colour that can be changed; whether it was.
pub fn color_button(ui: &mut Ui, color: &mut Color, name: &str) -> bool {
    let mut srgb = color.bytes();
    let changed = ui.color_edit_button_srgb(&mut srgb).on_hover_text(name).accessible_name(name).changed();
    if changed {
        *color = Color(srgb.map(|c| f32::from(c) / 255.0));
    }
    changed
}

/// A colour on the screen.
pub fn color(color: Color) -> Color32 {
    let [r, g, b] = color.bytes();
    Color32::from_rgb(r, g, b)
}

/// A text that is no wider than that, with an ellipsis where it is longer.
pub fn elided(ui: &Ui, text: &str, width: f32) -> Arc<Galley> {
    WidgetText::from(text).into_galley(ui, Some(TextWrapMode::Truncate), width, TextStyle::Button)
}

/// Chooses scans, each for a role: a word before it, and what it is called.
pub fn choose_scans(ui: &mut Ui, opened: &Opened, chosen: &mut [usize], roles: &[(&str, &str)]) {
    Grid::new("which").num_columns(2).show(ui, |ui| {
        for (number, (word, name)) in chosen.iter_mut().zip(roles) {
            ui.weak(*word);
            let width = ui.available_width() - 20.0;
            let shown = elided(ui, opened.volumes[*number].name(), width - 40.0);
            let combo = ComboBox::from_id_salt(name).selected_text(shown).width(width).show_ui(ui, |ui| {
                for (n, volume) in opened.volumes.iter().enumerate() {
                    let text = elided(ui, volume.name(), width - 40.0);
                    ui.selectable_value(number, n, text).accessible_name(volume.name());
                }
            });
            combo.response.on_hover_text(*name).accessible_name(*name);
            ui.end_row();
        }
    });
}

/// A radio button with a name that may be long.
pub fn named_radio(ui: &mut Ui, chosen: &mut usize, n: usize, name: &str) {
    let text = elided(ui, name, ui.available_width() - 30.0);
    ui.radio_value(chosen, n, text).on_hover_text(name).accessible_name(name);
}

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn no_number_is_a_negative_zero() {
        // Fails if a cut through the origin lies at "-0 mm", or a number loses its sign.
        assert_eq!([-0.0, -0.001, 0.0].map(|value| number(value, 0..=2)), ["0", "0.00", "0"]);
        let minus = number(-1.0, 0..=0);
        assert!(minus.ends_with('1') && minus.chars().count() == 2, "{minus}");
    }
}
