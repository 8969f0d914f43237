//! A small ball as a light falls on it: it shows where the light comes from, and may be turned by hand.

use egui::{Color32, Painter, Rect, Role, Sense, Stroke, Ui, WidgetInfo, vec2};
use glam::Vec3;

/// Across the ball, in points.
const ACROSS: f32 = 64.0;

/// A ball; a click or a drag puts the light, which comes from `toward` as seen from here (right, up, toward the viewer), over that point of its near
/// half. The new direction, where there is one.
pub fn turned(ui: &mut Ui, toward: Vec3, name: &str) -> Option<Vec3> {
    let (rect, response) = ui.allocate_exact_size(vec2(ACROSS, ACROSS), Sense::click_and_drag());
    response.widget_info(|| WidgetInfo::labeled(Role::Slider, true, name));
    let radius = rect.width() / 2.0 - 2.0;
    let put = response.interact_pointer_pos().map(|at| {
        let from = (at - rect.center()) / radius;
        // Beside the ball the light comes from the side.
        let [x, y] = if from.length() > 1.0 { [from.x / from.length(), -from.y / from.length()] } else { [from.x, -from.y] };
        Vec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt())
    });
    let toward = put.unwrap_or(toward).normalize_or(Vec3::Z);
    let painter = ui.painter_at(rect);
    draw(&painter, rect.shrink(2.0), toward, 40);
    let dot = rect.center() + vec2(toward.x, -toward.y) * radius;
    painter.circle(dot, 4.0, Color32::from_rgb(255, 215, 80), Stroke::new(1.0, Color32::BLACK));
    response.on_hover_text("Drag: where the light comes from, as seen from here");
    put
}

/// Rings of light around the point that faces it, from the rim inward, which is as dark as `shade`.
pub fn draw(painter: &Painter, rect: Rect, toward: Vec3, shade: u8) {
    const RINGS: u8 = 12;
    let radius = rect.width() / 2.0;
    painter.circle_filled(rect.center(), radius, Color32::from_gray(shade));
    for n in 1..=RINGS {
        let part = f32::from(n) / f32::from(RINGS);
        let middle = rect.center() + vec2(toward.x, -toward.y) * radius * part * 0.5;
        painter.circle_filled(
            middle,
            radius * (1.0 - part * 0.5 - 0.45 * part * part),
            Color32::from_gray(shade + n * ((208 - shade) / RINGS)),
        );
    }
}
