//! Smooth curves through points, and balls around what lies along them.

use glam::DVec3;

/// The point at `t` in 0..1 of the curve from the second of four points to the third.
pub fn catmull_rom<V>([a, b, c, d]: [V; 4], t: f64) -> V
where
    V: Copy + std::ops::Add<Output = V> + std::ops::Mul<f64, Output = V>,
{
    let [t2, t3] = [t * t, t * t * t];
    (a * (2.0 * t2 - t - t3) + b * (2.0 - 5.0 * t2 + 3.0 * t3) + c * (t + 4.0 * t2 - 3.0 * t3) + d * (t3 - t2)) * 0.5
}

/// A ball that holds all of `balls`.
pub fn around(balls: impl Iterator<Item = (DVec3, f64)> + Clone) -> (DVec3, f64) {
    let (low, high) = balls.clone().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), (c, r)| (low.min(c - r), high.max(c + r)));
    let middle = 0.5 * (low + high);
    (middle, balls.map(|(c, r)| c.distance(middle) + r).fold(0.0, f64::max))
}
