//! The view turned freely, as a ball in the picture: over the poles, and without a horizon.
//!
//! Shoemake, "ARCBALL: a user interface for specifying three-dimensional orientation using a mouse", Graphics Interface 1992: two points a
//! and b of the ball, as quaternions, give the turn b·a⁻¹, by twice the angle between them. Turns that follow each other from point to point are
//! one turn from the first to the last, so that the mouse brings the view back where it comes back itself, whatever its way.
//!
//! Around its middle the ball is a ball; farther out Holroyd's surface goes on as a hyperbola, without the edge at the rim that Shoemake's has
//! (Henriksen, Sporring, Hornbæk, "Virtual trackballs revisited", IEEE Transactions on Visualization and Computer Graphics 10, 2004).

use bregma_renderer::Camera;
use glam::{DQuat, DVec2, DVec3};

/// Turns the view about its target as the ball turns that the mouse drags from one point to another: in radii of the ball from its middle,
/// x right, y up.
pub fn drag(camera: &mut Camera, from: DVec2, to: DVec2) {
    let [a, b] = [from, to].map(on_ball);
    turn(camera, a.cross(b), a.dot(b));
}

/// Turns the view about the picture's own axes: the near side to the right and down by these angles in radians.
pub fn rotate(camera: &mut Camera, right_rad: f64, down_rad: f64) {
    for (axis, angle) in [(DVec3::Y, right_rad), (DVec3::X, down_rad)] {
        let (sin, cos) = (angle / 2.0).sin_cos();
        turn(camera, sin * axis, cos);
    }
}

/// Turns what is seen by a quaternion in the picture's axes: x right, y up, z toward the viewer.
fn turn(camera: &mut Camera, xyz: DVec3, w: f64) {
    let basis = camera.basis();
    let axis = xyz.x * basis.right + xyz.y * basis.up - xyz.z * basis.forward;
    // The eye goes the other way.
    let back = DQuat::from_xyzw(-axis.x, -axis.y, -axis.z, w).normalize();
    camera.eye_mm = camera.target_mm + back * (camera.eye_mm - camera.target_mm);
    camera.up = back * basis.up;
}

/// The point of the ball under the mouse, from its middle, unit.
fn on_ball(at: DVec2) -> DVec3 {
    let square = at.length_squared();
    // The two meet at half the square of the radius, in one direction.
    let z = if square <= 0.5 { (1.0 - square).sqrt() } else { 0.5 / square.sqrt() };
    at.extend(z).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_renderer::Bounds;

    fn camera() -> Camera {
        Camera::orbit(&Bounds { centre_mm: DVec3::new(5.0, -3.0, 20.0), radius_mm: 100.0 }, 25.0, 10.0)
    }

    /// The angle that the view was turned by, degrees.
    fn angle_deg(a: &Camera, b: &Camera) -> f64 {
        let [a, b] = [a, b].map(|camera| {
            let basis = camera.basis();
            glam::DMat3::from_cols(basis.right, basis.up, -basis.forward)
        });
        DQuat::from_mat3(&(b * a.transpose())).to_axis_angle().1.to_degrees()
    }

    #[test]
    fn the_mouse_brings_the_view_back_wherever_it_went() {
        // Fails if the turn depends on the way of the mouse, the eye comes nearer, or the picture is mirrored.
        let (first, mut view) = (camera(), camera());
        let start = DVec2::new(0.3, -0.2);
        let mut at = start;
        for n in (0..500).map(f64::from) {
            let to = 2.0 * DVec2::new((3.7 * n).sin(), (5.3 * n).cos());
            drag(&mut view, at, to);
            at = to;
            assert!((view.eye_mm.distance(view.target_mm) - first.eye_mm.distance(first.target_mm)).abs() < 1e-6);
        }
        drag(&mut view, at, start);
        assert!((view.eye_mm - first.eye_mm).length() < 1e-6 && (view.basis().up - first.basis().up).length() < 1e-9, "{view:?}");
    }

    #[test]
    fn a_drag_across_the_ball_turns_by_twice_its_arc() {
        // Fails if the turn is that of another ball, or is held up at a pole as a turntable is.
        let rim = 0.5_f64.sqrt();
        for direction in [DVec2::X, DVec2::Y, DVec2::new(0.6, -0.8)] {
            // From 45° to 45° beyond the middle; on a hyperbola from the ball's rim to its other: atan 2 on each side.
            for (reach, arc_deg) in [(rim, 90.0), (0.5, 60.0), (1.0, 2.0 * 2_f64.atan().to_degrees())] {
                let mut view = camera();
                drag(&mut view, -reach * direction, reach * direction);
                let expected = if arc_deg > 90.0 { 360.0 - 2.0 * arc_deg } else { 2.0 * arc_deg };
                let turned = angle_deg(&camera(), &view);
                assert!((turned - expected).abs() < 1e-6 || (360.0 - turned - expected).abs() < 1e-6, "{turned} for {expected}");
            }
        }
    }

    #[test]
    fn nothing_limits_a_turn_and_the_near_side_follows() {
        // Fails if 36 keys of 10° do not go all around over both poles, or the near side goes another way than the mouse.
        let mut view = camera();
        let near = view.target_mm - 50.0 * view.basis().forward;
        let at = |view: &Camera| view.project(bregma_field::WorldPoint(near), 800, 600).unwrap();
        let before = at(&view);
        let mut moved = view;
        drag(&mut moved, DVec2::ZERO, DVec2::new(0.1, -0.05));
        assert!(at(&moved).0 > before.0 + 5.0 && at(&moved).1 > before.1 + 2.0);
        for n in 1..=36 {
            rotate(&mut view, 0.0, 10_f64.to_radians());
            let turned = angle_deg(&camera(), &view);
            let expected = f64::from(10 * n);
            assert!((turned - expected).abs() < 1e-6 || (360.0 - turned - expected).abs() < 1e-5, "{turned} for {expected}");
            assert!(n != 1 || at(&view).1 > before.1 + 2.0);
        }
    }
}
