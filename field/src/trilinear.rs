//! Interpolation of the eight corners of a cell, in float64: f at corner x + 2y + 4z, which is at (x, y, z), taken at a point p of [0, 1]³.

use glam::DVec3;

fn mix(a: f64, b: f64, w: f64) -> f64 {
    a * (1.0 - w) + b * w
}

/// Its value, mixed along one axis after the other: at a corner exactly what the corner has.
pub fn value(f: &[f64; 8], p: DVec3) -> f64 {
    let x = [0, 2, 4, 6].map(|c| mix(f[c], f[c + 1], p.x));
    mix(mix(x[0], x[1], p.y), mix(x[2], x[3], p.y), p.z)
}

/// What a corner counts at a point.
pub(crate) fn weight(corner: usize, p: DVec3) -> f64 {
    (0..3).map(|a| if corner >> a & 1 == 1 { p[a] } else { 1.0 - p[a] }).product()
}

/// Its value as the sum of what the corners count. It differs from [`value`] in its last digits only; meshes and uncertainties are made with
/// it, and keep theirs.
pub fn weighted(f: &[f64; 8], p: DVec3) -> f64 {
    (0..8).map(|c| f[c] * weight(c, p)).sum()
}

/// Its own gradient, per voxel.
pub fn gradient(f: &[f64; 8], p: DVec3) -> DVec3 {
    let along = |axis: usize| {
        // The difference across the axis at the four edges, interpolated in the other two.
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let edge = |a: usize, b: usize| f[a << u | b << v | 1 << axis] - f[a << u | b << v];
        mix(mix(edge(0, 0), edge(1, 0), p[u]), mix(edge(0, 1), edge(1, 1), p[u]), p[v])
    };
    DVec3::new(along(0), along(1), along(2))
}
