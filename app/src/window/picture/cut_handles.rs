//! Planes moved and turned by hand: an arrow on each, in the picture.

use super::marks::{self, Screen};
use super::navigate::mm_per_pixel;
use bregma_renderer::{Basis, Bounds, Scene, Shape};
use egui::{Color32, CursorIcon, PointerButton, Rect, Role, Sense, Ui, Vec2, WidgetInfo};
use glam::{DQuat, DVec3};
use std::f64::consts::PI;

/// Length of an arrow where it is seen from the side, in points.
const ARROW: f32 = 60.0;
/// A shorter arrow points along the view: the mouse cannot follow it.
const SHORTEST: f32 = 12.0;
const COLOR: Color32 = Color32::from_rgb(255, 215, 80);

/// The plane that the mouse holds: its number, and where its arrow begins.
pub type Held = Option<(usize, DVec3)>;

/// Shows the arrows of the enabled planes: a drag moves a plane along its normal, with Shift it turns it.
pub fn show(ui: &Ui, scene: &mut Scene, bounds: &Bounds, rect: Rect, size: [u32; 2], held: &mut Held) {
    let camera = scene.camera;
    let screen = Screen { camera: &camera, rect, size };
    let mm_per_point = mm_per_pixel(&camera, f64::from(rect.height()));
    let painter = ui.painter_at(rect);
    for (n, clip) in scene.clips.iter_mut().enumerate().filter(|(_, clip)| clip.enabled) {
        let Shape::Plane { normal, offset_mm } = &mut clip.shape else { continue };
        let nearest = bounds.centre_mm + (*offset_mm - normal.dot(bounds.centre_mm)) * *normal;
        let foot = held.filter(|(held, _)| *held == n).map_or(nearest, |(_, foot)| foot);
        let arrow_mm = f64::from(ARROW) * mm_per_point;
        let (Some(from), Some(to)) = (screen.point(foot), screen.point(foot + arrow_mm * *normal)) else { continue };
        if !rect.contains(from) {
            continue;
        }
        let grip = Rect::from_two_pos(from, to).expand(8.0);
        let response = ui.interact(grip.intersect(rect), ui.scope_id().with(("cut", n)), Sense::click_and_drag());
        response.widget_info(|| WidgetInfo::labeled(Role::Button, true, format!("Arrow of cut {}", n + 1)));
        if response.dragged_by(PointerButton::Primary) {
            let mut foot = foot;
            let delta = response.drag_delta();
            if ui.input(|i| i.modifiers.shift) {
                *normal = turned(*normal, delta, &camera.basis(), f64::from(rect.height()));
            } else {
                let moved_mm = along(delta, to - from, normal.dot(camera.basis().forward), mm_per_point);
                foot += moved_mm * *normal;
            }
            *offset_mm = normal.dot(foot);
            *held = Some((n, foot));
        } else if held.is_some_and(|(held, _)| held == n) {
            *held = None;
        }
        let strong = response.hovered() || response.dragged();
        marks::line(&painter, [from, to], if strong { 4.0 } else { 2.5 }, COLOR);
        marks::dot(&painter, from, 5.0, COLOR);
        let tip = (to - from).normalized();
        for side in [tip.rot90(), -tip.rot90()].into_iter().filter(|_| from.distance(to) >= SHORTEST) {
            marks::line(&painter, [to, to - 9.0 * tip + 5.0 * side], 2.5, COLOR);
        }
        let hint = format!("Cut {}: drag to move it, Shift + drag to turn it", n + 1);
        response.on_hover_and_drag_cursor(CursorIcon::Grab).on_hover_text(hint);
    }
}

/// How far a plane goes along its normal when the mouse goes by `delta`, mm; `arrow` is the normal on the screen, and `away` how much of it
/// leads into the picture.
fn along(delta: Vec2, arrow: Vec2, away: f64, mm_per_point: f64) -> f64 {
    if arrow.length() >= SHORTEST {
        f64::from(delta.dot(arrow) / arrow.length_sq()) * f64::from(ARROW) * mm_per_point
    } else {
        // As with zooming, toward oneself is nearer.
        f64::from(delta.y) * mm_per_point * -away.signum()
    }
}

/// The normal when the mouse goes by `delta`: its arrow's tip follows.
fn turned(normal: DVec3, delta: Vec2, basis: &Basis, height: f64) -> DVec3 {
    let toward = if normal.dot(basis.forward) > 0.0 { -1.0 } else { 1.0 };
    let [right, down] = [delta.x, delta.y].map(|d| toward * f64::from(d) * PI / height);
    let turn = DQuat::from_axis_angle(basis.up, right) * DQuat::from_axis_angle(basis.right, down);
    (turn * normal).normalize_or(normal)
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_renderer::Camera;
    use egui::vec2;

    #[test]
    fn the_arrow_follows_the_mouse() {
        // Fails if a drag along the arrow moves the plane by another distance than the mouse's, or a turn leads the tip elsewhere.
        assert_eq!(along(vec2(30.0, 5.0), vec2(60.0, 0.0), 0.0, 0.5), 15.0);
        assert_eq!(along(vec2(0.0, -30.0), vec2(0.0, -30.0), 0.5, 0.5), 30.0);
        assert_eq!(along(vec2(0.0, 10.0), vec2(0.0, 1.0), -1.0, 0.5), 5.0);
        let basis = Camera::orbit(&Bounds { centre_mm: DVec3::ZERO, radius_mm: 100.0 }, 20.0, 10.0).basis();
        for normal in [-basis.forward, (basis.right - 0.8 * basis.forward).normalize(), (0.4 * basis.up + basis.forward).normalize()] {
            let tip = turned(normal, vec2(20.0, 8.0), &basis, 600.0) - normal;
            assert!(tip.dot(basis.right) > 0.0 && tip.dot(basis.up) < 0.0, "{normal}");
        }
    }
}
