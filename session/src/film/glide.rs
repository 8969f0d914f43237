//! A camera that glides through given ones: its target and its distance's logarithm each by a number's way, its turn by a curve on the sphere of
//! rotations.

use super::track;
use bregma_renderer::{Camera, Projection};
use glam::{DMat3, DQuat, DVec3};

/// The camera at a time, of cameras in order of time; none of none.
pub fn camera(keys: &[(f64, Camera)], t: f64) -> Option<Camera> {
    let (first, last) = (keys.first()?, keys.last()?);
    if t <= first.0 || keys.len() == 1 {
        return Some(first.1);
    }
    if t >= last.0 {
        return Some(last.1);
    }
    let along = |keys: &[(f64, Camera)], of: &dyn Fn(&Camera) -> f64| {
        track::at(&keys.iter().map(|(at, camera)| (*at, of(camera))).collect::<Vec<_>>(), t).unwrap_or(0.0)
    };
    let number = |of: &dyn Fn(&Camera) -> f64| along(keys, of);
    let target_mm = DVec3::new(number(&|c| c.target_mm.x), number(&|c| c.target_mm.y), number(&|c| c.target_mm.z));
    // Looking from where it looks at has no distance: a nanometre is as near.
    let distance_mm = number(&|c| (c.eye_mm - c.target_mm).length().max(1e-6).ln()).exp();
    let turn = turn(keys, t);
    let n = keys.partition_point(|(at, _)| *at <= t) - 1;
    let size = |projection: Projection| match projection {
        Projection::Perspective { fov_deg } => fov_deg,
        Projection::Orthographic { height_mm } => height_mm.ln(),
    };
    // From one kind of projection to the other there is no way between: each goes by its own neighbours.
    let is_alike = |key: &&(f64, Camera)| std::mem::discriminant(&key.1.projection) == std::mem::discriminant(&keys[n].1.projection);
    let before = keys[..n].iter().rev().take_while(is_alike).count();
    let after = keys[n + 1..].iter().take_while(is_alike).count();
    let alike = &keys[n - before..=n + after];
    let projection = match keys[n].1.projection {
        Projection::Perspective { .. } => Projection::Perspective { fov_deg: along(alike, &|c| size(c.projection)) },
        Projection::Orthographic { .. } => Projection::Orthographic { height_mm: along(alike, &|c| size(c.projection)).exp() },
    };
    Some(Camera { eye_mm: target_mm + distance_mm * (turn * DVec3::Z), target_mm, up: turn * DVec3::Y, projection })
}

/// How a camera is turned: x to its right, y up, z backward.
fn of(camera: &Camera) -> DQuat {
    let basis = camera.basis();
    DQuat::from_mat3(&DMat3::from_cols(basis.right, basis.up, -basis.forward)).normalize()
}

/// Goes from turn to turn along cumulative cubics (Kim, Kim and Shin 1995, "A general construction scheme for unit quaternion curves", SIGGRAPH),
/// with the velocity at each key that its neighbours have on average, and none at the ends.
fn turn(keys: &[(f64, Camera)], t: f64) -> DQuat {
    // Neighbours are taken on the same side of the sphere, so that each way is the shorter one.
    let mut turns: Vec<DQuat> = keys.iter().map(|(_, camera)| of(camera)).collect();
    for n in 1..turns.len() {
        if turns[n].dot(turns[n - 1]) < 0.0 {
            turns[n] = -turns[n];
        }
    }
    let n = keys.partition_point(|(at, _)| *at <= t) - 1;
    let width = keys[n + 1].0 - keys[n].0;
    let u = (t - keys[n].0) / width;
    let velocity = |k: usize| {
        if k == 0 || k + 1 == turns.len() {
            return DVec3::ZERO;
        }
        let way = turns[k + 1] * turns[k - 1].inverse();
        way.to_scaled_axis() / (keys[k + 1].0 - keys[k - 1].0)
    };
    let control = |k: usize, by: f64| DQuat::from_scaled_axis(velocity(k) * width * by / 3.0) * turns[k];
    let (a, b, c, d) = (turns[n], control(n, 1.0), control(n + 1, -1.0), turns[n + 1]);
    let part = |from: DQuat, to: DQuat, share: f64| DQuat::from_scaled_axis((to * from.inverse()).to_scaled_axis() * share);
    let rest = 1.0 - u;
    let shares = [1.0 - rest * rest * rest, u * u * (3.0 - 2.0 * u), u * u * u];
    (part(c, d, shares[2]) * part(b, c, shares[1]) * part(a, b, shares[0]) * a).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_renderer::Bounds;

    #[test]
    fn a_camera_goes_through_its_keys_smoothly() {
        // Fails if a key is missed, the picture jumps or turns over between keys, or the distance overshoots.
        let bounds = Bounds { centre_mm: DVec3::new(3.0, -4.0, 5.0), radius_mm: 100.0 };
        let mut keys: Vec<(f64, Camera)> = [(0.0, 0.0, 0.0), (1.0, 170.0, 20.0), (1.4, 200.0, 80.0), (4.0, 350.0, -30.0)]
            .map(|(t, azimuth, elevation)| (t, Camera::orbit(&bounds, azimuth, elevation)))
            .to_vec();
        let near = keys[2].1;
        keys[2].1.eye_mm = near.target_mm + 0.25 * (near.eye_mm - near.target_mm);
        for (t, key) in &keys {
            let there = camera(&keys, *t).unwrap();
            assert!(there.eye_mm.distance(key.eye_mm) < 1e-9 && there.basis().up.distance(key.basis().up) < 1e-9, "{there:?}");
        }
        let mut last = keys[0].1;
        for n in 0..=4000 {
            let now = camera(&keys, f64::from(n) / 1000.0).unwrap();
            let turned = now.basis().forward.angle_between(last.basis().forward).max(now.basis().up.angle_between(last.basis().up));
            assert!(turned < 0.02, "{turned} at {n}");
            let distance = now.eye_mm.distance(now.target_mm);
            assert!(
                distance <= near.eye_mm.distance(near.target_mm) + 1e-6 && distance >= 0.25 * near.eye_mm.distance(near.target_mm) - 1e-6
            );
            last = now;
        }
    }

    #[test]
    fn each_kind_of_projection_glides_by_its_own_keys() {
        // Fails if one key along parallel rays stops the others' fields of view from changing, or its height is taken for an angle.
        let bounds = Bounds { centre_mm: DVec3::ZERO, radius_mm: 100.0 };
        let of = |projection| Camera { projection, ..Camera::orbit(&bounds, 0.0, 0.0) };
        let [wide, narrow] = [40.0, 20.0].map(|fov_deg| of(Projection::Perspective { fov_deg }));
        let flat = of(Projection::Orthographic { height_mm: 200.0 });
        let keys = [(0.0, wide), (1.0, narrow), (2.0, flat), (3.0, flat)];
        let at = |t: f64| camera(&keys, t).unwrap().projection;
        assert_eq!((at(0.5), at(1.5)), (Projection::Perspective { fov_deg: 30.0 }, narrow.projection));
        let Projection::Orthographic { height_mm } = at(2.5) else { panic!("{:?}", at(2.5)) };
        assert!((height_mm - 200.0).abs() < 1e-9);
    }
}
