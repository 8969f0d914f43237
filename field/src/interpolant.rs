//! The trilinear interpolant of a scan's samples, in float64: what surfaces, crossings and lengths are of.
//!
//! In a cell it is known by its values f at the corners, corner x + 2y + 4z at (x, y, z), and taken at a point p of [0, 1]³.

use crate::ray::Ray;
use crate::store::{AnyBlock, Store};
use crate::surface::Surface;
use crate::with_block;
use bregma_volume::{BRICK, IndexPoint, Sample};
use glam::{DVec3, IVec3, USizeVec3};

/// The samples around a cell. What is measured waits for them; those of a scan in memory are there.
fn block_of(surface: &Surface, cell: USizeVec3) -> AnyBlock<'_> {
    Store::of(&surface.volume).block((cell / BRICK).to_array()).expect("a scan in memory has all its bricks")
}

fn samples(surface: &Surface, cell: USizeVec3) -> [f64; 8] {
    with_block!(block_of(surface, cell), block => block.corners(cell.to_array()).map(Sample::to_f64))
}

/// At the corners of a cell, given by its lowest sample: how far samples are inside the surface, in sample units; negative outside.
pub fn corners(surface: &Surface, cell: USizeVec3) -> [f64; 8] {
    samples(surface, cell).map(|sample| f64::from(surface.sign) * (sample - surface.level))
}

fn mix(a: f64, b: f64, w: f64) -> f64 {
    a * (1.0 - w) + b * w
}

/// Its value, mixed along one axis after the other: at a corner exactly what the corner has.
pub fn value(f: &[f64; 8], p: DVec3) -> f64 {
    let x = [0, 2, 4, 6].map(|c| mix(f[c], f[c + 1], p.x));
    mix(mix(x[0], x[1], p.y), mix(x[2], x[3], p.y), p.z)
}

/// What a corner counts at a point.
fn weight(corner: usize, p: DVec3) -> f64 {
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

/// Central differences at the samples, interpolated between them: the gradient of the samples, per voxel, that does not jump between cells.
fn smooth_gradient(surface: &Surface, p: DVec3) -> DVec3 {
    let last = IVec3::from_array(surface.grid.dims().map(|n| n as i32 - 1));
    let cell = p.floor().as_ivec3().clamp(IVec3::ZERO, last - 1);
    let local = (p - cell.as_dvec3()).clamp(DVec3::ZERO, DVec3::ONE);
    with_block!(block_of(surface, cell.as_usizevec3()), block => {
        let sample = |at: IVec3| block.at(at.as_usizevec3().to_array()).to_f64();
        let mut sum = DVec3::ZERO;
        for corner in 0..8 {
            let at = cell + IVec3::new(corner & 1, corner >> 1 & 1, corner >> 2);
            for axis in 0..3 {
                let (mut down, mut up) = (at, at);
                down[axis] = (at[axis] - 1).max(0);
                up[axis] = (at[axis] + 1).min(last[axis]);
                sum[axis] += weight(corner as usize, local) * (sample(up) - sample(down)) / f64::from(up[axis] - down[axis]);
            }
        }
        sum
    })
}

/// The outward normal of a surface at a point of index space that pictures are shaded by, in the world, unit: central differences at the
/// samples, interpolated, so that it does not jump between cells. `None` where all samples around are equal.
pub fn smooth_normal(surface: &Surface, point: IndexPoint) -> Option<DVec3> {
    let gradient = smooth_gradient(surface, point.0);
    (surface.grid.world_to_index().matrix3.transpose() * (gradient * -f64::from(surface.sign))).try_normalize()
}

/// The scan's value at `count` points of `ray` from `from_mm` to `to_mm`, both ends among them: pairs of mm and value. Points outside the scan
/// are left out.
pub fn profile(surface: &Surface, ray: &Ray, [from_mm, to_mm]: [f64; 2], count: usize) -> Vec<[f64; 2]> {
    let at = |n: usize| from_mm + (to_mm - from_mm) * n as f64 / (count.max(2) - 1) as f64;
    (0..count).map(at).filter_map(|t_mm| Some([t_mm, value_at(surface, surface.grid.index(ray.at(t_mm)))?])).collect()
}

/// The scan's value at a point of index space; `None` outside.
fn value_at(surface: &Surface, IndexPoint(p): IndexPoint) -> Option<f64> {
    let last = USizeVec3::from(surface.grid.dims()).as_dvec3() - 1.0;
    if surface.grid.is_flat() || p.cmplt(DVec3::ZERO).any() || p.cmpgt(last).any() {
        return None;
    }
    let cell = p.floor().min(last - 1.0);
    Some(surface.volume.value_of(weighted(&samples(surface, cell.as_usizevec3()), p - cell)))
}
