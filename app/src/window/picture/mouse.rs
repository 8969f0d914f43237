//! What the mouse and the keys do to the view.

use super::arcball;
use super::marks::Screen;
use super::navigate;
use bregma_renderer::Camera;
use egui::{Event, Key, Modifiers, PointerButton, Pos2, Rect, Response, Ui};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;

/// What a press of an arrow turns the view by, degrees.
const KEY_DEG: f64 = 5.0;
/// What a press of + makes larger by.
const KEY_FACTOR: f64 = 1.1;
/// The part of the picture's height that a press of an arrow moves it by.
const KEY_PART: f64 = 0.05;

/// How the mouse lies on the view.
#[derive(Clone, Copy, Debug)]
pub struct Mouse {
    /// Drags turn the view as a ball, and not as a turntable.
    pub turns_freely: bool,
    /// The left button is another's, but with Shift or Alt.
    pub is_taken: bool,
    /// The picture that the mouse is on, and its pixels: one of two that lie side by side.
    pub pane: (Rect, [u32; 2]),
    /// The point of what is drawn that lies under the mouse.
    pub under_mm: Option<DVec3>,
}

impl Mouse {
    /// As in 3D Slicer: left rotates, middle or Shift+left pans, right or the wheel zooms, Ctrl+left rolls. While the left button is another's,
    /// Alt+left rotates.
    pub fn navigate(&self, ui: &Ui, response: &Response, camera: &mut Camera) {
        let (middle, height) = (response.rect.center(), f64::from(self.pane.0.height()));
        let modifiers = ui.input(|i| i.modifiers);
        let delta = response.drag_delta();
        let (dx, dy) = (f64::from(delta.x), f64::from(delta.y));
        let left = response.dragged_by(PointerButton::Primary) && (!self.is_taken || modifiers.shift || modifiers.alt);
        if response.dragged_by(PointerButton::Middle) || left && modifiers.shift {
            navigate::pan(camera, dx, dy, height);
        } else if left && modifiers.command {
            if let Some(to) = response.interact_pointer_pos() {
                let angle = (to - delta - middle).angle() - (to - middle).angle();
                navigate::roll(camera, -f64::from(angle));
            }
        } else if left && self.turns_freely {
            self.drag_ball(ui, response, camera);
        } else if left {
            // The height of the view turns the skull by half a turn.
            navigate::rotate(camera, dx * PI / height, dy * PI / height);
        } else if response.dragged_by(PointerButton::Secondary) {
            // Pulling the mouse toward oneself brings the skull nearer.
            navigate::zoom(camera, (dy * 4.0 / height).exp());
        }
        self.wheel(ui, response, camera);
    }

    fn drag_ball(&self, ui: &Ui, response: &Response, camera: &mut Camera) {
        let Some(to) = response.interact_pointer_pos() else { return };
        // The first frame of a drag has all of the way since the button went down.
        let begun = response.drag_started().then(|| ui.input(|i| i.pointer.press_origin())).flatten();
        let from = begun.unwrap_or(to - response.drag_delta());
        let (middle, radius) = (response.rect.center(), response.rect.size().min_elem() / 2.0);
        let on_ball = |at: Pos2| DVec2::new(f64::from(at.x - middle.x), f64::from(middle.y - at.y)) / f64::from(radius);
        arcball::drag(camera, on_ball(from), on_ball(to));
    }

    /// The wheel and two fingers zoom at the mouse.
    fn wheel(&self, ui: &Ui, response: &Response, camera: &mut Camera) {
        let (wheel, pinch) = ui.input(|i| (i.smooth_scroll_delta().y, i.zoom_delta()));
        let Some(at) = response.hover_pos().filter(|_| wheel != 0.0 || pinch != 1.0) else { return };
        let screen = Screen { camera, rect: self.pane.0, size: self.pane.1 };
        let at_mm = self.under_mm.unwrap_or_else(|| at_depth_of_target(&screen, at));
        navigate::zoom_at(camera, at_mm, (f64::from(wheel) * 0.004).exp() * f64::from(pinch));
    }

    /// Arrows turn, with Shift they move; + and − zoom.
    pub fn keys(&self, ui: &Ui, camera: &mut Camera) {
        if ui.ctx().memory(|memory| memory.focused().is_some()) {
            return;
        }
        for (key, modifiers) in pressed(ui) {
            let (x, y) = match key {
                Key::ArrowLeft => (-1.0, 0.0),
                Key::ArrowRight => (1.0, 0.0),
                Key::ArrowUp => (0.0, -1.0),
                Key::ArrowDown => (0.0, 1.0),
                // Where + is on the key of =, it is meant without Shift, too.
                Key::Plus | Key::Equals => {
                    navigate::zoom(camera, KEY_FACTOR);
                    continue;
                }
                Key::Minus => {
                    navigate::zoom(camera, 1.0 / KEY_FACTOR);
                    continue;
                }
                _ => continue,
            };
            let turn = KEY_DEG.to_radians();
            if modifiers.shift {
                navigate::pan(camera, x * KEY_PART, y * KEY_PART, 1.0);
            } else if self.turns_freely {
                arcball::rotate(camera, x * turn, y * turn);
            } else {
                navigate::rotate(camera, x * turn, y * turn);
            }
        }
    }
}

/// The keys that went down without Ctrl and Alt, held ones again and again.
fn pressed(ui: &Ui) -> Vec<(Key, Modifiers)> {
    let key = |event: &Event| match event {
        Event::Key { key, pressed: true, modifiers, .. } if !modifiers.command && !modifiers.alt => Some((*key, *modifiers)),
        _ => None,
    };
    ui.input(|i| i.events.iter().filter_map(key).collect())
}

/// The point under the mouse that is as far away as what the view turns about.
fn at_depth_of_target(screen: &Screen<'_>, at: Pos2) -> DVec3 {
    let (x, y) = screen.pixel(at);
    let (camera, forward) = (screen.camera, screen.camera.basis().forward);
    let ray = camera.ray(x, y, screen.size[0], screen.size[1]);
    ray.at((camera.target_mm - ray.origin.0).dot(forward) / ray.direction.dot(forward)).0
}
