//! Camera moves: what the mouse and the keys do to the view. Distances on the screen are in pixels, x right, y down.

use bregma_renderer::{Bounds, Camera, FOV_DEG, Projection};
use bregma_session::Opened;
use bregma_session::views::View;
use glam::{DQuat, DVec3};

/// The turntable stops here, short of the pole, where "up in the picture" would flip.
const STEEPEST: f64 = 89.9_f64 / 180.0 * std::f64::consts::PI;

/// Turns the view about its target like a turntable whose axis is the camera's up: to the right and down by these angles in
/// radians, so that the near side of the skull follows the mouse.
pub fn rotate(camera: &mut Camera, right_rad: f64, down_rad: f64) {
    let basis = camera.basis();
    let distance = camera.eye_mm.distance(camera.target_mm);
    let axis = camera.up.try_normalize().unwrap_or(basis.up);
    let elevation = (-basis.forward.dot(axis)).clamp(-1.0, 1.0).asin();
    // Straight above or below, the horizontal direction of the view is what the picture shows as up or down.
    let level = if elevation.abs() < STEEPEST { basis.forward.reject_from(axis) } else { basis.up * elevation.signum() };
    let level = level.reject_from(axis).normalize_or(basis.forward);
    let turned = DQuat::from_axis_angle(axis, -right_rad) * level;
    let (sin, cos) = (elevation + down_rad).clamp(-STEEPEST, STEEPEST).sin_cos();
    camera.eye_mm = camera.target_mm - distance * (cos * turned - sin * axis);
}

/// Turns the picture clockwise about its centre.
pub fn roll(camera: &mut Camera, clockwise_rad: f64) {
    let basis = camera.basis();
    camera.up = DQuat::from_axis_angle(basis.forward, -clockwise_rad) * basis.up;
}

/// Moves the view so that the target's surroundings follow the mouse.
pub fn pan(camera: &mut Camera, dx: f64, dy: f64, height_px: f64) {
    let basis = camera.basis();
    let shift = (dy * basis.up - dx * basis.right) * mm_per_pixel(camera, height_px);
    camera.eye_mm += shift;
    camera.target_mm += shift;
}

/// Nearer than this nothing of a scan is seen, and farther nothing of it is left.
const REACH_MM: [f64; 2] = [0.1, 1e5];

/// Makes what lies around the target `factor` times larger.
pub fn zoom(camera: &mut Camera, factor: f64) {
    zoom_at(camera, camera.target_mm, factor);
}

/// Makes what lies around the point `at_mm` `factor` times larger, and keeps that where it is in the picture, with all that lies before and behind
/// it: the eye comes nearer along the ray to it, or the view along parallel rays becomes lower around it.
pub fn zoom_at(camera: &mut Camera, at_mm: DVec3, factor: f64) {
    let within = |length_mm: f64| length_mm / (length_mm / factor).clamp(REACH_MM[0], REACH_MM[1]);
    let forward = camera.basis().forward;
    match &mut camera.projection {
        Projection::Perspective { .. } => {
            let factor = within(camera.eye_mm.distance(camera.target_mm));
            (camera.eye_mm, camera.target_mm) = (at_mm + (camera.eye_mm - at_mm) / factor, at_mm + (camera.target_mm - at_mm) / factor);
        }
        Projection::Orthographic { height_mm } => {
            let factor = within(*height_mm);
            *height_mm /= factor;
            let shift = (at_mm - camera.target_mm).reject_from_normalized(forward) * (1.0 - 1.0 / factor);
            camera.eye_mm += shift;
            camera.target_mm += shift;
        }
    }
}

/// Millimetres that one pixel covers at the depth of a point.
pub fn mm_per_pixel_at(camera: &Camera, at_mm: DVec3, height_px: f64) -> f64 {
    let nearer = match camera.projection {
        Projection::Perspective { .. } => (at_mm - camera.eye_mm).dot(camera.basis().forward) / camera.eye_mm.distance(camera.target_mm),
        Projection::Orthographic { .. } => 1.0,
    };
    // From within a scan the point may lie behind the eye, where nothing follows a mouse.
    mm_per_pixel(camera, height_px) * if nearer > 0.0 { nearer } else { 1.0 }
}

/// Millimetres that one pixel covers at the depth of the target.
pub fn mm_per_pixel(camera: &Camera, height_px: f64) -> f64 {
    height_mm(camera) / height_px
}

/// Height of the view at the depth of the target.
fn height_mm(camera: &Camera) -> f64 {
    match camera.projection {
        Projection::Perspective { fov_deg } => 2.0 * (fov_deg.to_radians() / 2.0).tan() * camera.eye_mm.distance(camera.target_mm),
        Projection::Orthographic { height_mm } => height_mm,
    }
}

/// Changes between perspective and orthographic; what lies at the target keeps its size.
pub fn toggle_projection(camera: &mut Camera, bounds: &Bounds) {
    let (height_mm, forward) = (height_mm(camera), camera.basis().forward);
    let distance = match camera.projection {
        Projection::Perspective { .. } => {
            camera.projection = Projection::Orthographic { height_mm };
            // Parallel rays start at the eye's plane: outside the scans, so that it cuts nothing off.
            camera.eye_mm.distance(camera.target_mm).max(camera.target_mm.distance(bounds.centre_mm) + 2.0 * bounds.radius_mm)
        }
        Projection::Orthographic { .. } => {
            camera.projection = Projection::Perspective { fov_deg: FOV_DEG };
            height_mm / (2.0 * (FOV_DEG.to_radians() / 2.0).tan())
        }
    };
    camera.eye_mm = camera.target_mm - distance * forward;
}

/// All of what is open in a view, in a picture that is `aspect` times as wide as high.
pub fn look_at(opened: &mut Opened, view: View, aspect: f64) {
    let (points, bounds) = (opened.bone_points_mm(), opened.bounds());
    look_from(&mut opened.scene.camera, &points, &bounds, view, aspect);
}

/// All `points` in a view, in a picture that is `aspect` times as wide as high; the kind of projection stays.
fn look_from(camera: &mut Camera, points: &[DVec3], bounds: &Bounds, view: View, aspect: f64) {
    let (azimuth, elevation) = view.orbit_deg();
    let orthographic = matches!(camera.projection, Projection::Orthographic { .. });
    *camera = Camera::framing(points, azimuth, elevation, aspect);
    if orthographic {
        toggle_projection(camera, bounds);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_field::WorldPoint;

    const BOUNDS: Bounds = Bounds { centre_mm: DVec3::new(5.0, -3.0, 20.0), radius_mm: 100.0 };

    fn at(camera: &Camera, p: DVec3) -> (f64, f64) {
        camera.project(WorldPoint(p), 800, 600).unwrap()
    }

    #[test]
    fn the_near_side_follows_the_mouse() {
        for elevation in [-60.0, 0.0, 30.0] {
            let mut camera = Camera::orbit(&BOUNDS, 25.0, elevation);
            let near = BOUNDS.centre_mm - 50.0 * camera.basis().forward;
            let before = at(&camera, near);
            rotate(&mut camera, 0.1, 0.05);
            let after = at(&camera, near);
            assert!(after.0 > before.0 + 5.0 && after.1 > before.1 + 2.0, "{before:?} {after:?}");
        }
    }

    #[test]
    fn rotation_keeps_the_distance_and_the_horizon() {
        let mut camera = Camera::orbit(&BOUNDS, 0.0, 0.0);
        let distance = camera.eye_mm.distance(camera.target_mm);
        for n in 0..200 {
            rotate(&mut camera, 0.3, if n < 100 { 0.05 } else { -0.07 });
            assert!((camera.eye_mm.distance(camera.target_mm) - distance).abs() < 1e-9);
            let basis = camera.basis();
            assert!(basis.right.z.abs() < 1e-9 && basis.up.z > 0.0, "step {n}: {basis:?}");
        }
    }

    #[test]
    fn leaving_the_view_from_above_does_not_flip_the_picture() {
        for (side, sign) in [(View::Verticalis, 1.0), (View::Basilaris, -1.0)] {
            let mut camera = Camera::orbit(&BOUNDS, 0.0, 0.0);
            look_from(&mut camera, &[DVec3::ZERO, DVec3::splat(50.0)], &BOUNDS, side, 1.0);
            for (right, down) in [(0.02, 0.0), (0.0, -0.02 * sign), (0.01, -0.01 * sign)] {
                let mut moved = camera;
                rotate(&mut moved, right, down);
                assert!(moved.basis().up.dot(camera.basis().up) > 0.99, "{side:?} {right} {down}");
            }
        }
    }

    #[test]
    fn panning_moves_the_target_with_the_mouse() {
        for orthographic in [false, true] {
            let mut camera = Camera::orbit(&BOUNDS, 40.0, 10.0);
            if orthographic {
                toggle_projection(&mut camera, &BOUNDS);
            }
            let before = at(&camera, BOUNDS.centre_mm);
            pan(&mut camera, 30.0, -12.0, 600.0);
            let after = at(&camera, BOUNDS.centre_mm);
            assert!((after.0 - before.0 - 30.0).abs() < 1e-6 && (after.1 - before.1 + 12.0).abs() < 1e-6);
        }
    }

    #[test]
    fn both_projections_show_the_target_in_one_size() {
        let camera = Camera::orbit(&BOUNDS, 30.0, 10.0);
        let tip = BOUNDS.centre_mm + 20.0 * camera.basis().up;
        let size = |camera: &Camera| at(camera, BOUNDS.centre_mm).1 - at(camera, tip).1;
        let mut other = camera;
        toggle_projection(&mut other, &BOUNDS);
        assert!((size(&other) - size(&camera)).abs() < 1e-6);
        zoom(&mut other, 2.0);
        assert!((size(&other) - 2.0 * size(&camera)).abs() < 1e-6);
        toggle_projection(&mut other, &BOUNDS);
        assert!((size(&other) - 2.0 * size(&camera)).abs() < 1e-6);
        assert!((20.0 / mm_per_pixel(&camera, 600.0) - size(&camera)).abs() < 1e-6);
    }

    #[test]
    fn what_is_zoomed_at_stays_and_becomes_larger() {
        // Fails if the point under the mouse moves, what lies around it does not grow by the factor, or the view turns.
        for orthographic in [false, true] {
            for point in [BOUNDS.centre_mm + DVec3::new(30.0, -70.0, 25.0), BOUNDS.centre_mm] {
                let mut camera = Camera::orbit(&BOUNDS, 40.0, 10.0);
                if orthographic {
                    toggle_projection(&mut camera, &BOUNDS);
                }
                let beside = point + 0.5 * camera.basis().up;
                let (before, up, forward) = (at(&camera, point), at(&camera, beside), camera.basis().forward);
                zoom_at(&mut camera, point, 2.5);
                let (after, up_then) = (at(&camera, point), at(&camera, beside));
                assert!((after.0 - before.0).abs() < 1e-6 && (after.1 - before.1).abs() < 1e-6, "{orthographic} {before:?} {after:?}");
                assert!(((after.1 - up_then.1) / (before.1 - up.1) - 2.5).abs() < 1e-6);
                assert!((camera.basis().forward - forward).length() < 1e-12);
                // As near as one comes, and back: nothing is lost.
                let near = camera;
                zoom_at(&mut camera, point, 1e9);
                assert!(mm_per_pixel(&camera, 600.0) > 1e-5);
                let back = mm_per_pixel(&camera, 600.0) / mm_per_pixel(&near, 600.0);
                zoom_at(&mut camera, point, back);
                assert!((camera.eye_mm - near.eye_mm).length() < 1e-6, "{camera:?} {near:?}");
            }
        }
    }

    #[test]
    fn rolling_turns_the_picture_clockwise() {
        let mut camera = Camera::orbit(&BOUNDS, 0.0, 0.0);
        let top = BOUNDS.centre_mm + 20.0 * camera.basis().up;
        roll(&mut camera, 0.5);
        assert!(at(&camera, top).0 > at(&camera, BOUNDS.centre_mm).0 + 1.0);
    }
}
