//! What the colours of a picture mean, at its right edge.

use super::marks::text;
use bregma_renderer::{Color, Scene};
use bregma_session::Opened;
use egui::{Align2, Color32, Mesh, Painter, Rect, Shape, Stroke, pos2, vec2};

/// Length and width of the bar, in points.
const BAR: [f32; 2] = [132.0, 12.0];
/// From the right edge: room for its numbers.
const INSET: f32 = 64.0;
/// Pieces of equal colour: more than are told apart.
const PIECES: u32 = 64;

/// Shows what the colours of the mode mean, if they mean something.
pub fn show(painter: &Painter, rect: Rect, opened: &Opened) {
    if opened.scene.tells_depths() && rect.height() > 3.0 * BAR[0] {
        depths(painter, rect, opened, &opened.scene);
    }
}

fn depths(painter: &Painter, rect: Rect, opened: &Opened, scene: &Scene) {
    let range_mm = scene.depth_range_mm(&opened.volumes);
    let top = rect.center().y + 0.12 * rect.height();
    let bar = Rect::from_min_size(pos2(rect.right() - INSET - BAR[1], top), vec2(BAR[1], BAR[0]));
    gradient(painter, bar, |part| Color::diverging(2.0 * part - 1.0));
    for part in [-1.0, -0.5, 0.0, 0.5, 1.0_f64] {
        let at = pos2(bar.right() + 4.0, bar.center().y - part as f32 * BAR[0] / 2.0);
        let sign = if part > 0.0 { "+" } else { "" };
        text(painter, at, Align2::LEFT_CENTER, &format!("{sign}{} mm", part * range_mm).replace('-', "−"), 12.0);
    }
    if let Some([first, second]) = opened.compared().map(|pair| pair.map(|n| opened.volumes[n].name())) {
        let at = |y: f32| pos2(rect.right() - 8.0, y);
        text(painter, at(bar.top() - 18.0), Align2::RIGHT_CENTER, &format!("{second} stands out"), 12.0);
        text(painter, at(bar.bottom() + 18.0), Align2::RIGHT_CENTER, &format!("{first} stands out"), 12.0);
    }
}

/// A bar of colours from its foot, part 0, to its head, part 1.
fn gradient(painter: &Painter, bar: Rect, color: impl Fn(f32) -> Color) {
    let mut mesh = Mesh::default();
    for n in 0..PIECES {
        let [low, high] = [n, n + 1].map(|n| n as f32 / PIECES as f32);
        let y = |part: f32| bar.bottom() - part * bar.height();
        let [r, g, b] = color((low + high) / 2.0).bytes();
        mesh.add_colored_rect(Rect::from_x_y_ranges(bar.x_range(), y(high)..=y(low)), Color32::from_rgb(r, g, b));
    }
    painter.rect_stroke(bar, 0.0, Stroke::new(2.0, Color32::from_black_alpha(150)), egui::StrokeKind::Outside);
    painter.add(Shape::mesh(mesh));
}
