//! A scan that is moved and turned by hand: by the mouse in the picture and in slices, and by numbers.

use super::super::measured::Work;
use super::marks::Screen;
use super::navigate::mm_per_pixel_at;
use bregma_field::{Grid, Registration, Volume};
use bregma_session::Opened;
use egui::{PointerButton, Pos2, Response, Ui};
use glam::{DAffine3, DMat3, DQuat, DVec3};
use std::sync::Arc;

/// The scan that the hand has.
#[derive(Clone, Debug)]
pub struct ByHand {
    scan: Arc<Volume>,
    /// Where it lay when the hand took it.
    start: DAffine3,
}

/// How far a scan lies from where the hand took it: turned about the middle of its box, which is then shifted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moved {
    /// Of the middle of its box, LPS mm.
    pub shift_mm: DVec3,
    /// About that.
    pub turn: DQuat,
}

/// What the mouse does in a frame while it has the scan: from one point of the screen to another.
#[derive(Clone, Copy, Debug)]
pub struct Drag {
    from: Pos2,
    to: Pos2,
    /// It turns the scan; else it moves it.
    turns: bool,
}

impl Drag {
    /// The left button without Shift and Alt, which are the view's.
    pub fn of(ui: &Ui, response: &Response) -> Option<Self> {
        let modifiers = ui.input(|i| i.modifiers);
        let is_hands = response.dragged_by(PointerButton::Primary) && !modifiers.shift && !modifiers.alt;
        let to = response.interact_pointer_pos().filter(|_| is_hands)?;
        // The first of its frames has all of the way since the button went down.
        let begun = response.drag_started().then(|| ui.input(|i| i.pointer.press_origin())).flatten();
        let from = begun.unwrap_or(to - response.drag_delta());
        // A hand that rests changes nothing, not even by rounding.
        (from != to).then_some(Self { from, to, turns: modifiers.command })
    }
}

impl ByHand {
    /// Takes scan number `n`.
    pub fn take(opened: &Opened, n: usize) -> Self {
        Self { scan: Arc::clone(&opened.volumes[n]), start: opened.scene.layers[n].transform }
    }

    /// The number of the scan, if it is open.
    pub fn number(&self, opened: &Opened) -> Option<usize> {
        opened.volumes.iter().position(|volume| Arc::ptr_eq(volume, &self.scan))
    }

    /// Where the hand has put it, if it has.
    pub fn left_at(&self, opened: &Opened) -> Option<DAffine3> {
        self.number(opened).map(|n| opened.scene.layers[n].transform).filter(|transform| *transform != self.start)
    }

    /// Where the middle of its box was.
    fn start_mm(&self) -> DVec3 {
        self.start.transform_point3(self.scan.grid().corners_mm().into_iter().sum::<DVec3>() / 8.0)
    }

    /// The grids of what is visible, with this scan where the hand took it: a view of all scans stays while one is moved.
    pub fn grids(&self, opened: &Opened) -> Vec<Grid> {
        let mut scene = opened.scene.clone();
        if let Some(n) = self.number(opened) {
            scene.layers[n].transform = self.start;
        }
        scene.surfaces(&opened.volumes).unwrap_or_default().into_iter().map(|(_, surface)| surface.grid).collect()
    }

    /// Where the middle of its box is.
    pub fn middle_mm(&self, opened: &Opened) -> Option<DVec3> {
        self.moved(opened).map(|moved| self.start_mm() + moved.shift_mm)
    }

    /// How far it lies from where the hand took it.
    pub fn moved(&self, opened: &Opened) -> Option<Moved> {
        let motion = opened.scene.layers[self.number(opened)?].transform * self.start.inverse();
        let turn = DQuat::from_mat3(&motion.matrix3).normalize();
        Some(Moved { shift_mm: motion.transform_point3(self.start_mm()) - self.start_mm(), turn })
    }

    /// Puts it there, and its landmarks with it. How sure a registration was says nothing of where a hand puts a scan.
    pub fn place(&self, work: &mut Work, Moved { shift_mm, turn }: Moved) {
        let Some(n) = self.number(&work.opened) else { return };
        let (turn, middle) = (DMat3::from_quat(turn.normalize()), self.start_mm());
        let motion = DAffine3::from_mat3_translation(turn, middle + shift_mm - turn * middle);
        work.place(n, Registration::of(motion * self.start));
    }

    /// Turns it about an axis through the point `about_mm`.
    fn turn(&self, work: &mut Work, turn: DQuat, about_mm: DVec3) {
        let (Some(moved), Some(middle_mm)) = (self.moved(&work.opened), self.middle_mm(&work.opened)) else { return };
        let shift_mm = moved.shift_mm + about_mm + turn * (middle_mm - about_mm) - middle_mm;
        self.place(work, Moved { shift_mm, turn: turn * moved.turn });
    }

    /// Lets it follow the mouse in a view: in the view's plane at the depth of its middle, or turned about the view's axis through `about_mm`;
    /// through its middle where that is not given.
    pub fn follow(&self, work: &mut Work, screen: &Screen<'_>, drag: Drag, about_mm: Option<DVec3>) {
        let Some(middle_mm) = self.middle_mm(&work.opened) else { return };
        let (basis, camera) = (screen.camera.basis(), screen.camera);
        if drag.turns {
            let about_mm = about_mm.unwrap_or(middle_mm);
            let Some(foot) = screen.point(about_mm) else { return };
            // Clockwise on the screen is clockwise along the view.
            let angle = f64::from((drag.to - foot).angle() - (drag.from - foot).angle());
            self.turn(work, DQuat::from_axis_angle(basis.forward, angle), about_mm);
            return;
        }
        let by = (drag.to - drag.from) * mm_per_pixel_at(camera, middle_mm, f64::from(screen.rect.height())) as f32;
        let shift_mm = f64::from(by.x) * basis.right - f64::from(by.y) * basis.up;
        if let Some(moved) = self.moved(&work.opened) {
            self.place(work, Moved { shift_mm: moved.shift_mm + shift_mm, ..moved });
        }
    }
}
