//! Where slices go through the scans: three planes through one point, how they are turned, and how much of each is seen.

use bregma_field::Grid;
use bregma_renderer::{BodyPlane, Bounds, Camera, Named, Projection, Scene, Slice, named, view_of_plane};
use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

named! {
    /// Which views stand beside each other.
    #[derive(Default)]
    pub enum Layout {
        /// The picture alone.
        #[default]
        Picture = "picture",
        /// The picture and the three slices.
        All = "all",
        /// The three slices.
        Slices = "slices",
        /// The axial slice alone.
        Axial = "axial",
        /// The coronal slice alone.
        Coronal = "coronal",
        /// The sagittal slice alone.
        Sagittal = "sagittal",
    }
}

impl Layout {
    /// Whether the picture is among the views.
    pub fn has_picture(self) -> bool {
        matches!(self, Self::Picture | Self::All)
    }

    /// The slices among the views.
    pub fn planes(self) -> &'static [BodyPlane] {
        match self {
            Self::Picture => &[],
            Self::All | Self::Slices => BodyPlane::ALL,
            Self::Axial => &[BodyPlane::Axial],
            Self::Coronal => &[BodyPlane::Coronal],
            Self::Sagittal => &[BodyPlane::Sagittal],
        }
    }
}

/// Which part of a plane is seen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// What lies in the middle; as it is seen along the plane's normal.
    pub centre_mm: DVec3,
    /// Height of the view.
    pub height_mm: f64,
}

/// How slices are looked at.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Slices {
    /// Which views are seen.
    #[serde(default)]
    pub layout: Layout,
    /// The point that all three planes go through, LPS mm.
    pub at_mm: DVec3,
    /// How the planes are turned together out of those of the body.
    #[serde(default)]
    pub turn: DQuat,
    /// Of the axial, the coronal and the sagittal plane; all of the scans when absent.
    #[serde(default)]
    pub frames: [Option<Frame>; 3],
    /// How they are drawn.
    #[serde(default)]
    pub look: Slice,
}

/// The eye stands so far before a slice: before all that lies beside it and is drawn over it.
const EYE_MM: f64 = 4000.0;

impl Slices {
    /// Through the middle of scans.
    pub fn of(grids: &[Grid]) -> Self {
        let at_mm = Bounds::of(grids).centre_mm;
        Self { layout: Layout::Picture, at_mm, turn: DQuat::IDENTITY, frames: [None; 3], look: Slice::default() }
    }

    /// Whether its numbers are such.
    pub fn is_sound(&self) -> bool {
        let frames = self.frames.iter().flatten().all(|frame| frame.centre_mm.is_finite() && frame.height_mm > 0.0);
        self.at_mm.is_finite() && self.turn.is_normalized() && frames
    }

    /// Into a plane's view, and up in it.
    pub fn axes(&self, plane: BodyPlane) -> [DVec3; 2] {
        plane.axes().map(|axis| self.turn * axis)
    }

    /// The view onto a plane in a picture `aspect` times as wide as high.
    pub fn camera(&self, plane: BodyPlane, grids: &[Grid], aspect: f64) -> Camera {
        let axes = self.axes(plane);
        let whole = || {
            let middle_mm = Bounds::of(grids).centre_mm;
            let view = view_of_plane(axes, middle_mm, grids, aspect);
            let Projection::Orthographic { height_mm } = view.projection else { unreachable!("a plane is seen along parallel rays") };
            Frame { centre_mm: middle_mm, height_mm }
        };
        let frame = self.frames[plane as usize].unwrap_or_else(whole);
        let target_mm = frame.centre_mm + (self.at_mm - frame.centre_mm).dot(axes[0]) * axes[0];
        let projection = Projection::Orthographic { height_mm: frame.height_mm };
        Camera { eye_mm: target_mm - EYE_MM * axes[0], target_mm, up: axes[1], projection }
    }

    /// What is drawn of a scene on a plane: whole, as cuts are of the picture.
    pub fn scene(&self, scene: &Scene, camera: Camera) -> Scene {
        Scene { mode: bregma_renderer::Mode::Slice, camera, slice: self.look, clips: vec![], shadows: false, ..scene.clone() }
    }

    /// Makes what lies at a point of a plane `factor` times larger, and keeps the point where it is.
    pub fn zoom(&mut self, plane: BodyPlane, camera: &Camera, at_mm: DVec3, factor: f64) {
        let Projection::Orthographic { height_mm } = camera.projection else { return };
        let height_mm_then = (height_mm / factor).clamp(LEAST_MM, MOST_MM);
        let centre_mm = at_mm + (camera.target_mm - at_mm) * (height_mm_then / height_mm);
        self.frames[plane as usize] = Some(Frame { centre_mm, height_mm: height_mm_then });
    }

    /// Moves what is seen of a plane.
    pub fn pan(&mut self, plane: BodyPlane, camera: &Camera, by_mm: DVec3) {
        let Projection::Orthographic { height_mm } = camera.projection else { return };
        self.frames[plane as usize] = Some(Frame { centre_mm: camera.target_mm + by_mm, height_mm });
    }

    /// How far the next slice is: from sample to sample of the finest of the scans along the axis that goes through the plane.
    pub fn step_mm(&self, plane: BodyPlane, grids: &[Grid]) -> f64 {
        let [normal, _] = self.axes(plane);
        step_along_mm(normal, grids)
    }
}

/// How far it is along a unit direction from sample to sample of the finest of the scans, along that of their axes which leads there most.
pub fn step_along_mm(direction: DVec3, grids: &[Grid]) -> f64 {
    let through = |grid: &Grid| {
        let steps = grid.index_to_world().matrix3;
        [steps.x_axis, steps.y_axis, steps.z_axis].into_iter().map(|step| step.dot(direction).abs()).fold(0.0, f64::max)
    };
    grids.iter().map(through).filter(|mm| *mm > 0.0).fold(f64::INFINITY, f64::min).min(MOST_STEP_MM)
}

/// A view shows no less than a sample, and no more than a person.
const LEAST_MM: f64 = 0.05;
const MOST_MM: f64 = 1e4;
/// Where there are no scans any step will do.
const MOST_STEP_MM: f64 = 10.0;

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat3;

    fn grids() -> [Grid; 1] {
        [Grid::new([100, 120, 80], DVec3::new(0.5, 0.5, 1.25), DVec3::new(-20.0, -30.0, 10.0), DMat3::IDENTITY).unwrap()]
    }

    #[test]
    fn all_planes_go_through_the_point_and_show_all_of_the_scans() {
        // Fails if a plane misses the point, a corner lies outside of a view, or left and right are changed.
        let grids = grids();
        let mut slices = Slices::of(&grids);
        slices.at_mm += DVec3::new(3.0, -7.0, 11.0);
        for turn in [DQuat::IDENTITY, DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7)] {
            slices.turn = turn;
            for &plane in BodyPlane::ALL {
                for aspect in [0.5, 1.0, 2.0] {
                    let camera = slices.camera(plane, &grids, aspect);
                    assert!((slices.at_mm - camera.target_mm).dot(camera.basis().forward).abs() < 1e-9);
                    let [w, h] = [(400.0 * aspect) as u32, 400];
                    for corner in grids[0].corners_mm() {
                        let (x, y) = camera.project(bregma_field::WorldPoint(corner), w, h).unwrap();
                        assert!((0.0..f64::from(w)).contains(&x) && (0.0..f64::from(h)).contains(&y), "{plane:?} {aspect}: {x} {y}");
                    }
                }
            }
        }
        slices.turn = DQuat::IDENTITY;
        let right = |plane| slices.camera(plane, &grids, 1.0).basis().right;
        assert_eq!(BodyPlane::ALL.iter().map(|plane| right(*plane).round()).collect::<Vec<_>>(), [DVec3::X, DVec3::X, DVec3::Y]);
    }

    #[test]
    fn zooming_keeps_the_point_under_the_hand_and_steps_are_those_of_samples() {
        // Fails if the view jumps, or a step skips or repeats samples.
        let grids = grids();
        let mut slices = Slices::of(&grids);
        let at = |slices: &Slices, p: DVec3| {
            slices.camera(BodyPlane::Coronal, &grids, 1.0).project(bregma_field::WorldPoint(p), 300, 300).unwrap()
        };
        let point = slices.at_mm + DVec3::new(5.0, 0.0, -8.0);
        let before = at(&slices, point);
        let camera = slices.camera(BodyPlane::Coronal, &grids, 1.0);
        slices.zoom(BodyPlane::Coronal, &camera, point, 3.0);
        let after = at(&slices, point);
        assert!((before.0 - after.0).abs() < 1e-9 && (before.1 - after.1).abs() < 1e-9, "{before:?} {after:?}");
        assert_eq!(BodyPlane::ALL.iter().map(|plane| slices.step_mm(*plane, &grids)).collect::<Vec<_>>(), [1.25, 0.5, 0.5]);
        assert!(slices.is_sound() && !Slices { at_mm: DVec3::NAN, ..slices }.is_sound());
    }
}
