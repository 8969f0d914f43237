//! Planes moved and turned by hand: an arrow on each, in the picture, and the mouse beside it.

use super::marks::{self, Screen};
use super::navigate::mm_per_pixel;
use bregma_field::Grid;
use bregma_renderer::{Basis, Bounds, Clip, Scene, Shape};
use bregma_session::step_along_mm;
use egui::{Color32, CursorIcon, PointerButton, Rect, Response, Role, Sense, Ui, Vec2, WidgetInfo};
use glam::{DQuat, DVec3};
use std::f64::consts::PI;

/// Length of an arrow where it is seen from the side, in points.
const ARROW: f32 = 60.0;
/// A shorter arrow points along the view: the mouse cannot follow it.
const SHORTEST: f32 = 12.0;
/// Of all that belongs to cuts.
pub const COLOR: Color32 = Color32::from_rgb(255, 215, 80);

/// What the mouse has of the planes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Held {
    /// The plane that it holds: its number, and where its arrow begins.
    plane: Option<(usize, DVec3)>,
    /// The plane that it held last, among how many cuts.
    last: Option<(usize, usize)>,
    /// When the wheel moved one, in the window's seconds.
    wheel_at: Option<f64>,
}

/// What is left of the wheel's way comes within so many seconds, whether Ctrl is still held or not.
const WHEEL_S: f64 = 0.3;

impl Held {
    /// The plane that Ctrl is for: the one that was held last, else the last that cuts; none where there is none.
    pub fn active(&self, clips: &[Clip]) -> Option<usize> {
        let cuts = |n: &usize| clips.get(*n).is_some_and(|clip| clip.enabled && matches!(clip.shape, Shape::Plane { .. }));
        // Of others that came or went, the last one is the newest.
        let last = self.last.filter(|(_, count)| *count == clips.len()).map(|(n, _)| n);
        last.filter(cuts).or_else(|| (0..clips.len()).rev().find(cuts))
    }

    /// The wheel moves a plane, at this time of the window, seconds: until it rests, that is one step.
    pub fn is_wheeled(&self, now_s: f64) -> bool {
        self.wheel_at.is_some_and(|at| now_s - at < WHEEL_S)
    }

    fn hold(&mut self, n: usize, foot: DVec3, count: usize) {
        (self.plane, self.last) = (Some((n, foot)), Some((n, count)));
    }
}

/// The wheel's way from sample to sample, in points: about a notch.
const NOTCH: f64 = 40.0;

/// Ctrl + wheel moves the active plane along its normal, up deeper, from sample to sample, with Shift ten at once; Ctrl + drag turns it about its point
/// that lies nearest to the middle of what is shown. With Alt it does not. Whether the mouse did so.
pub fn by_mouse(ui: &Ui, response: &Response, scene: &mut Scene, grids: &[Grid], height: f64, held: &mut Held) -> bool {
    let (modifiers, pinch) = ui.input(|i| (i.modifiers, i.zoom_delta()));
    let now = ui.input(|i| i.time);
    let goes_on = pinch != 1.0 && held.is_wheeled(now);
    let is_meant = modifiers.command && !modifiers.alt || goes_on;
    let Some(n) = held.active(&scene.clips).filter(|_| is_meant) else { return false };
    let (camera, count) = (scene.camera, scene.clips.len());
    let Shape::Plane { normal, offset_mm } = &mut scene.clips[n].shape else { return false };
    if response.hovered() && pinch != 1.0 {
        // egui makes a factor of the points that the wheel went.
        let points = f64::from(pinch.ln() / ui.options(|o| o.input_options.scroll_zoom_speed));
        let samples = points / NOTCH * if modifiers.shift { 10.0 } else { 1.0 };
        *offset_mm -= samples * step_along_mm(*normal, grids);
        held.wheel_at = Some(now);
        ui.ctx().request_repaint_after_secs(WHEEL_S as f32);
        return true;
    }
    if response.dragged_by(PointerButton::Primary) {
        let foot = held.plane.map_or_else(|| nearest(*normal, *offset_mm, Bounds::of(grids).centre_mm), |(_, foot)| foot);
        *normal = turned(*normal, response.drag_delta(), &camera.basis(), height);
        *offset_mm = normal.dot(foot);
        held.hold(n, foot, count);
        return true;
    }
    false
}

/// The point of a plane that lies nearest to another.
fn nearest(normal: DVec3, offset_mm: f64, to_mm: DVec3) -> DVec3 {
    to_mm + (offset_mm - normal.dot(to_mm)) * normal
}

/// Shows the arrows of the enabled planes: a drag moves a plane along its normal, with Shift it turns it.
pub fn show(ui: &Ui, scene: &mut Scene, bounds: &Bounds, rect: Rect, size: [u32; 2], held: &mut Held) {
    let camera = scene.camera;
    let screen = Screen { camera: &camera, rect, size };
    let mm_per_point = mm_per_pixel(&camera, f64::from(rect.height()));
    let (painter, count) = (ui.painter_at(rect), scene.clips.len());
    if !ui.input(|i| i.pointer.any_down()) {
        held.plane = None;
    }
    for (n, clip) in scene.clips.iter_mut().enumerate().filter(|(_, clip)| clip.enabled) {
        let Shape::Plane { normal, offset_mm } = &mut clip.shape else { continue };
        let held_foot = held.plane.filter(|(held, _)| *held == n).map(|(_, foot)| foot);
        let foot = held_foot.unwrap_or_else(|| nearest(*normal, *offset_mm, bounds.centre_mm));
        let (Some(from), Some(arrow)) = (screen.point(foot), arrow(&screen, foot, *normal, mm_per_point)) else { continue };
        let to = from + arrow;
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
            held.hold(n, foot, count);
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

/// A normal on the screen, from its foot on.
pub fn arrow(screen: &Screen<'_>, foot: DVec3, normal: DVec3, mm_per_point: f64) -> Option<Vec2> {
    Some(screen.point(foot + f64::from(ARROW) * mm_per_point * normal)? - screen.point(foot)?)
}

/// How far a plane goes along its normal when the mouse goes by `delta`, mm; `arrow` is the normal on the screen, and `away` how much of it
/// leads into the picture.
pub fn along(delta: Vec2, arrow: Vec2, away: f64, mm_per_point: f64) -> f64 {
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
