//! A volume's transfer function over its histogram: points to drag, add and remove.

use super::super::widgets::{self, color, color_button};
use super::histogram;
use bregma_field::Volume;
use bregma_measure::export::suffix;
use bregma_renderer::{Color, GradientPoint, Layer, OVERALL, Point, TransferFunction, Values, classify};
use bregma_session::presets::{self, Preset, PresetError};
use egui::{Button, Color32, DragValue, PointerButton, Pos2, Rect, Role, Sense, Stroke, Ui, Vec2, WidgetInfo, pos2, vec2};
use std::sync::Arc;

const HEIGHT: f32 = 110.0;
/// Points keep this share of the scan's range between them: a hand can still take hold of each.
const CLOSEST: f64 = 1e-3;

/// The menu of ready-made looks, which are transfer functions with further isosurfaces, under the title `title`.
pub fn presets_menu(ui: &mut Ui, title: &str, volume: &Volume, layer: &mut Layer) {
    // They are read from their files when the menu opens, and kept while it is open.
    let id = ui.scope_id().with("presets");
    let button = ui.menu_button(format!("{title} ⏷"), |ui| {
        let read: Arc<(Vec<Preset>, Vec<PresetError>)> =
            ui.data_mut(|d| d.get_temp_mut_or_insert_with(id, || Arc::new(presets::all())).clone());
        let (presets, errors) = &*read;
        for preset in presets {
            let [low, high] = volume.range();
            let in_range = preset.surfaces.iter().all(|s| (low..=high).contains(&s.value));
            let fits = preset.transfer.values == Values::Isovalue || in_range;
            let button = ui.add_enabled(fits, Button::new(&preset.transfer.name));
            if button.on_disabled_hover_text("For scans of other values, such as HU").clicked() {
                preset.apply(layer, volume);
                ui.close();
            }
        }
        for error in errors {
            ui.colored_label(ui.visuals().error_fg_color, error.to_string());
        }
    });
    if button.inner.is_none() {
        ui.data_mut(|d| d.remove_temp::<Arc<(Vec<Preset>, Vec<PresetError>)>>(id));
    }
    let hint =
        "Ready-made colours, opacities and further surfaces; the isovalue that is measured stays. Your own are kept by View › Looks…";
    button.response.on_hover_text(hint).accessible_name(format!("Look of {}", volume.name()));
}

/// Shows the histogram with the function's colours and points, and the numbers of the selected point.
pub fn show(ui: &mut Ui, volume: &Volume, layer: &mut Layer) {
    let id = ui.scope_id().with("transfer");
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), HEIGHT), Sense::click());
    let name = volume.name();
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, format!("Transfer function of {name}")));
    let field = Field { rect: rect.shrink2(vec2(6.0, 7.0)), range: volume.range() };
    let mut function = of_scan(volume, layer);
    let before = function.clone();
    let mut selected: usize = ui.data(|d| d.get_temp(id)).unwrap_or(0);
    selected = selected.min(function.points.len().saturating_sub(1));

    backdrop(ui, &field, volume, layer);
    let hint = "Right is dense, up is opaque. Drag the points; double-click adds one, a right click removes one.";
    let response = response.on_hover_text(hint);
    if let Some(at) = response.interact_pointer_pos().filter(|_| response.double_clicked()) {
        selected = add(&mut function, field.value(at), field.opacity(at));
    }
    let mut removed = None;
    for n in 0..function.points.len() {
        let place = field.place(&function.points[n]);
        let point = ui.interact(Rect::from_center_size(place, Vec2::splat(14.0)), id.with(n), Sense::click_and_drag());
        point.widget_info(|| WidgetInfo::labeled(Role::Button, true, format!("Point {} of {name}", n + 1)));
        if point.drag_started() || point.clicked() {
            selected = n;
        }
        if let Some(at) = point.interact_pointer_pos().filter(|_| point.dragged_by(PointerButton::Primary)) {
            (function.points[n].value, function.points[n].opacity) = (between(&function, n, field.value(at), &field), field.opacity(at));
        }
        if point.secondary_clicked() {
            removed = Some(n);
        }
        let ring = if n == selected { Color32::WHITE } else { Color32::from_gray(150) };
        let place = field.place(&function.points[n]);
        ui.painter().circle(place, if n == selected { 6.0 } else { 4.5 }, color(function.points[n].color), Stroke::new(1.5, ring));
        let text = format!("{:.4}{}, opacity {:.2}", function.points[n].value, suffix(volume.unit()), function.points[n].opacity);
        point.on_hover_text(text.replace(".0000", ""));
    }
    // A function without points is none.
    if let Some(n) = removed.filter(|_| function.points.len() > 1) {
        function.points.remove(n);
        selected = selected.min(function.points.len() - 1);
    }
    numbers(ui, volume, &mut function, selected, &field);
    overall(ui, name, &mut function);
    gradient(ui, volume, &mut function);
    ui.data_mut(|d| d.insert_temp::<usize>(id, selected));
    if function != before {
        if !function.name.ends_with(CHANGED) {
            function.name += CHANGED;
        }
        layer.transfer = Some(function);
    }
}

const CHANGED: &str = ", changed";

/// The layer's function with points in the scan's own values, as they are shown.
fn of_scan(volume: &Volume, layer: &Layer) -> TransferFunction {
    let mut function = layer.transfer_function();
    let controls = function.controls(volume, layer.iso);
    if function.values == Values::Isovalue {
        function
            .points
            .sort_by(|a, b| if layer.iso < volume.range()[0] { b.value.total_cmp(&a.value) } else { a.value.total_cmp(&b.value) });
        function.points.iter_mut().zip(&controls).for_each(|(point, control)| point.value = control.value);
        function.values = Values::Scan;
    }
    function
}

/// Where values and opacities lie on the screen.
struct Field {
    rect: Rect,
    range: [f64; 2],
}

impl Field {
    fn width(&self) -> f64 {
        let [low, high] = self.range;
        if high > low { high - low } else { 1.0 }
    }

    fn value(&self, at: Pos2) -> f64 {
        let share = f64::from((at.x - self.rect.left()) / self.rect.width()).clamp(0.0, 1.0);
        histogram::round_to(self.range[0] + share * self.width(), self.width() / f64::from(self.rect.width()))
    }

    fn opacity(&self, at: Pos2) -> f64 {
        let share = f64::from((self.rect.bottom() - at.y) / self.rect.height()).clamp(0.0, 1.0);
        (share * 100.0).round() / 100.0
    }

    /// A point beyond the scan's range stands at its edge.
    fn place(&self, point: &Point) -> Pos2 {
        let share = ((point.value - self.range[0]) / self.width()).clamp(0.0, 1.0);
        pos2(self.rect.left() + share as f32 * self.rect.width(), self.rect.bottom() - point.opacity as f32 * self.rect.height())
    }
}

/// The value kept between those of the points before and after.
fn between(function: &TransferFunction, n: usize, value: f64, field: &Field) -> f64 {
    let gap = CLOSEST * field.width();
    let low = n.checked_sub(1).map_or(f64::NEG_INFINITY, |m| function.points[m].value + gap);
    let high = function.points.get(n + 1).map_or(f64::INFINITY, |p| p.value - gap);
    // Neighbours of a preset may lie closer than a hand would put them.
    if low > high { function.points[n].value } else { value.clamp(low, high) }
}

/// Adds a point in the colour that its value has; gives its number.
fn add(function: &mut TransferFunction, value: f64, opacity: f64) -> usize {
    let n = function.points.partition_point(|p| p.value < value);
    let color = match (n.checked_sub(1).map(|m| function.points[m]), function.points.get(n)) {
        (Some(a), Some(b)) => {
            let part = ((value - a.value) / (b.value - a.value)) as f32;
            Color(std::array::from_fn(|c| a.color.0[c] + part * (b.color.0[c] - a.color.0[c])))
        }
        (Some(p), None) => p.color,
        (None, Some(p)) => p.color,
        (None, None) => Color([1.0; 3]),
    };
    // A point that is there already stays the only one of its value.
    if function.points.get(n).is_none_or(|p| p.value > value) {
        function.points.insert(n, Point { value, color, opacity });
    }
    n
}

/// The histogram, and over it each value's colour as high as it is opaque.
fn backdrop(ui: &Ui, field: &Field, volume: &Volume, layer: &Layer) {
    let painter = ui.painter();
    painter.rect_filled(field.rect.expand2(vec2(6.0, 7.0)), 3.0, ui.visuals().extreme_bg_color);
    let width = field.rect.width() as usize;
    let columns = histogram::columns(volume, width);
    let top = columns.iter().fold(1.0_f32, |a, &b| a.max(b));
    let controls = layer.controls(volume);
    let function = layer.transfer_function();
    let over_mm = function.thickness_mm(volume);
    for (n, count) in columns.iter().enumerate() {
        let x = field.rect.left() + n as f32;
        let bar = |height: f32| {
            Rect::from_min_max(pos2(x, field.rect.bottom() - height * field.rect.height()), pos2(x + 1.0, field.rect.bottom()))
        };
        painter.rect_filled(bar(count / top), 0.0, Color32::from_gray(85));
        let value = field.range[0] + (n as f64 + 0.5) / width as f64 * field.width();
        let at = classify(&controls, value);
        let opacity = 1.0 - (-at.w * over_mm as f32).exp();
        let [r, g, b] = Color::of_light(at.truncate()).bytes();
        painter.rect_filled(bar(opacity), 0.0, Color32::from_rgba_unmultiplied(r, g, b, 150));
        painter.rect_filled(bar(opacity).intersect(Rect::everything_above(bar(opacity).top() + 1.5)), 0.0, Color32::from_rgb(r, g, b));
    }
}

/// The selected point by numbers.
fn numbers(ui: &mut Ui, volume: &Volume, function: &mut TransferFunction, selected: usize, field: &Field) {
    let name = volume.name();
    ui.horizontal(|ui| {
        let Some(mut point) = function.points.get(selected).copied() else { return };
        color_button(ui, &mut point.color, &format!("Colour of the point of {name}"));
        let speed = field.width() / 1000.0;
        let number = DragValue::new(&mut point.value)
            .custom_formatter(widgets::number)
            .speed(speed)
            .max_decimals(3)
            .suffix(suffix(volume.unit()))
            .update_while_editing(false);
        ui.add(number).on_hover_text("The selected point's value").accessible_name(format!("Value of the point of {name}"));
        let number = DragValue::new(&mut point.opacity)
            .custom_formatter(widgets::number)
            .speed(0.005)
            .range(0.0..=1.0)
            .max_decimals(3)
            .prefix("opacity ");
        ui.add(number.update_while_editing(false))
            .on_hover_text("What a voxel's thickness of it keeps of the light, or the thickness that the look says")
            .accessible_name(format!("Opacity of the point of {name}"));
        if point.value != function.points[selected].value {
            point.value = between(function, selected, point.value, field);
        }
        function.points[selected] = point;
    });
}

/// How dense the whole is.
fn overall(ui: &mut Ui, name: &str, function: &mut TransferFunction) {
    ui.horizontal(|ui| {
        ui.weak("All opacities");
        let speed = 0.01 * function.overall;
        let number = DragValue::new(&mut function.overall)
            .custom_formatter(widgets::number)
            .speed(speed)
            .range(OVERALL)
            .max_decimals(3)
            .prefix("× ");
        ui.add(number.update_while_editing(false))
            .on_hover_text("What the light loses along each mm is multiplied with: the whole is so much denser")
            .accessible_name(format!("All opacities of {name}"));
    });
}

/// The gradients that a first choice goes over, as shares of the steepest that there can be, the scan's range within a voxel: flat tissue, and a
/// good edge.
const FLAT: f64 = 0.02;
const STEEP: f64 = 0.2;

/// The factors of the opacity by how fast values change.
fn gradient(ui: &mut Ui, volume: &Volume, function: &mut TransferFunction) {
    let name = volume.name();
    let [low, high] = volume.range();
    let steepest = (high - low).max(f64::MIN_POSITIVE) / volume.grid().spacing_mm().min_element();
    ui.horizontal(|ui| {
        let mut on = !function.gradient.is_empty();
        let text = "Shows edges and hides flat tissue: opacity is multiplied by a factor that grows with how fast the value changes";
        let check = ui.checkbox(&mut on, "By gradient").on_hover_text(text);
        if check.changed() {
            let ramp = [(FLAT, 0.0), (STEEP, 1.0)].map(|(part, factor)| GradientPoint { per_mm: round(part * steepest), factor });
            function.gradient = if on { ramp.to_vec() } else { vec![] };
        }
        if on && ui.small_button("+").on_hover_text("A further point").clicked() {
            let last = function.gradient.last().map_or(0.0, |p| p.per_mm);
            function.gradient.push(GradientPoint { per_mm: round(last + FLAT * steepest), factor: 1.0 });
        }
    });
    // To a thousandth of the steepest.
    let decimals = (3.0 - steepest.log10().floor()).clamp(0.0, 12.0) as usize;
    let mut removed = None;
    for n in 0..function.gradient.len() {
        let gap = 1e-6 * steepest;
        let below = n.checked_sub(1).map_or(0.0, |m| function.gradient[m].per_mm + gap);
        let above = function.gradient.get(n + 1).map_or(100.0 * steepest, |p| p.per_mm - gap);
        let point = &mut function.gradient[n];
        ui.horizontal(|ui| {
            let number = DragValue::new(&mut point.per_mm)
                .custom_formatter(widgets::number)
                .speed(steepest / 1000.0)
                .range(below..=above)
                .max_decimals(decimals);
            ui.add(number.suffix(format!("{} per mm", suffix(volume.unit()))).update_while_editing(false))
                .accessible_name(format!("Gradient {} of {name}", n + 1));
            let factor = DragValue::new(&mut point.factor)
                .custom_formatter(widgets::number)
                .speed(0.005)
                .range(0.0..=1.0)
                .max_decimals(2)
                .prefix("× ");
            ui.add(factor.update_while_editing(false)).accessible_name(format!("Factor {} of {name}", n + 1));
            if ui.small_button("×").on_hover_text("Removes this point").clicked() {
                removed = Some(n);
            }
        });
    }
    if let Some(n) = removed {
        function.gradient.remove(n);
    }
}

/// To three digits.
fn round(value: f64) -> f64 {
    let unit = 10_f64.powf(value.abs().log10().floor() - 2.0);
    if unit > 0.0 { (value / unit).round() * unit } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn function() -> TransferFunction {
        TransferFunction { values: Values::Scan, ..TransferFunction::bone() }
    }

    #[test]
    fn points_stay_in_order_and_apart() {
        // Fails if a dragged point passes its neighbour, or an added one breaks the order that the renderer relies on.
        let mut function = function();
        let field = Field { rect: Rect::from_min_size(Pos2::ZERO, vec2(100.0, 50.0)), range: [0.0, 2.0] };
        assert!((between(&function, 1, 9.0, &field) - 1.398).abs() < 1e-9);
        assert!((between(&function, 1, -9.0, &field) - 0.852).abs() < 1e-9);
        assert_eq!(add(&mut function, 1.2, 0.5), 2);
        assert_eq!(add(&mut function, 1.2, 0.9), 2);
        assert_eq!(function.points.len(), 4);
        assert_eq!(add(&mut function, -1.0, 0.5), 0);
        assert!(function.points.windows(2).all(|p| p[0].value < p[1].value));
    }
}
