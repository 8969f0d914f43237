//! The trilinear interpolant of a scan's samples, in float64: what surfaces, crossings and lengths are of.
//!
//! In a cell it is known by its values f at the corners, corner x + 2y + 4z at (x, y, z), and taken at a point p of [0, 1]³.

pub use crate::trilinear::{gradient, value, weighted};

use crate::ray::Ray;
use crate::store::{AnyBlock, Store};
use crate::surface::Surface;
use crate::trilinear::weight;
use crate::with_block;
use bregma_volume::{BRICK, IndexPoint, Sample, WorldPoint};
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

/// How far inside a surface a point of the world is, in sample units (negative outside), and how that changes per mm there; `None` outside the
/// scan's box.
pub fn depth_at(surface: &Surface, point: WorldPoint) -> Option<(f64, DVec3)> {
    let IndexPoint(p) = surface.grid.index(point);
    let cell = cell_of(surface, p)?;
    let f = corners(surface, cell);
    let local = p - cell.as_dvec3();
    Some((value(&f, local), surface.grid.world_to_index().matrix3.transpose() * gradient(&f, local)))
}

/// The cell that a point of index space lies in; `None` outside the box.
fn cell_of(surface: &Surface, p: DVec3) -> Option<USizeVec3> {
    let last = USizeVec3::from(surface.grid.dims()).as_dvec3() - 1.0;
    let is_outside = surface.grid.is_flat() || p.cmplt(DVec3::ZERO).any() || p.cmpgt(last).any();
    (!is_outside).then(|| p.floor().min(last - 1.0).as_usizevec3())
}

/// The scan's value at `count` points of `ray` from `from_mm` to `to_mm`, both ends among them: pairs of mm and value. Points outside the scan
/// are left out.
pub fn profile(surface: &Surface, ray: &Ray, [from_mm, to_mm]: [f64; 2], count: usize) -> Vec<[f64; 2]> {
    let at = |n: usize| from_mm + (to_mm - from_mm) * n as f64 / (count.max(2) - 1) as f64;
    (0..count).map(at).filter_map(|t_mm| Some([t_mm, value_at(surface, surface.grid.index(ray.at(t_mm)))?])).collect()
}

/// The scan's value at a point of index space; `None` outside.
fn value_at(surface: &Surface, IndexPoint(p): IndexPoint) -> Option<f64> {
    let cell = cell_of(surface, p)?;
    Some(surface.volume.value_of(weighted(&samples(surface, cell), p - cell.as_dvec3())))
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_synthetic::Random;
    use bregma_volume::{Grid, Raster, Samples, Unit, Volume};
    use glam::{DAffine3, DMat3};
    use std::sync::Arc;

    #[test]
    fn it_has_the_corners_values_and_its_gradient_is_how_it_changes() {
        // Fails if a corner is taken for another, or an axis for another.
        let mut random = Random(5);
        for _ in 0..1000 {
            let f: [f64; 8] = std::array::from_fn(|_| random.unit() - 0.5);
            for (c, v) in f.iter().enumerate() {
                let corner = DVec3::new((c & 1) as f64, (c >> 1 & 1) as f64, (c >> 2) as f64);
                assert_eq!([value(&f, corner), weighted(&f, corner)], [*v; 2]);
            }
            let p = DVec3::from_array(std::array::from_fn(|_| random.unit()));
            assert!((value(&f, p) - weighted(&f, p)).abs() < 1e-15);
            // Along an axis it is linear.
            for axis in 0..3 {
                let mut q = p;
                q[axis] = random.unit();
                assert!((value(&f, q) - value(&f, p) - gradient(&f, p)[axis] * (q[axis] - p[axis])).abs() < 2e-15);
            }
        }
    }

    #[test]
    fn of_a_linear_field_all_is_exact_everywhere() {
        // Fails if a brick's block lacks a sample that a gradient at its border needs, or the grid's border is not one-sided.
        let (dims, slope) = ([19, 10, 9], DVec3::new(3.0, -2.0, 7.0));
        let at = |n: usize| DVec3::new((n % 19) as f64, (n / 19 % 10) as f64, (n / 190) as f64);
        let grid = Grid::new(dims, DVec3::ONE, DVec3::ZERO, DMat3::IDENTITY).unwrap();
        let samples = Samples::I16((0..grid.len()).map(|n| slope.dot(at(n)) as i16).collect());
        let raster = Raster { grid, samples, slope: 1.0, intercept: 0.0, unit: Unit::Value, warnings: vec![] };
        let volume = Arc::new(Volume::new("ramp".into(), "test", raster).unwrap());
        let surface = Surface::new(&volume, 20.0, DAffine3::IDENTITY).unwrap();
        let mut random = Random(6);
        for n in 0..dims.iter().product() {
            for p in [at(n), (at(n) + DVec3::from_array(std::array::from_fn(|_| random.unit()))).min(DVec3::new(18.0, 9.0, 8.0))] {
                let normal = smooth_normal(&surface, IndexPoint(p)).unwrap();
                assert!(normal.distance(-slope.normalize()) < 1e-14, "{p}: {normal}");
                assert!((value_at(&surface, IndexPoint(p)).unwrap() - slope.dot(p)).abs() < 1e-12, "{p}");
                let (depth, rise) = depth_at(&surface, WorldPoint(p)).unwrap();
                assert!((depth - (slope.dot(p) - 20.0)).abs() < 1e-12 && rise.distance(slope) < 1e-12, "{p}: {depth}, {rise}");
            }
        }
        assert_eq!(value_at(&surface, IndexPoint(DVec3::new(18.1, 2.0, 2.0))), None);
    }
}
