//! Points of a scan's surface with the way that it faces there, and the nearest of them that faces the same way.

use crate::part::Parts;
use bregma_field::interpolant::{depth_at, smooth_normal};
use bregma_field::{Cancelled, IndexPoint, Progress, Surface, WorldPoint};
use bregma_measure::mesh;
use glam::{DAffine3, DVec3};
use rayon::prelude::*;
use rstar::primitives::GeomWithData;
use rstar::{PointDistance, RTree};

/// A point of a surface and its outward unit normal, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Oriented {
    /// Where it is.
    pub point: DVec3,
    /// Outward.
    pub normal: DVec3,
}

impl Oriented {
    /// Moved by a rigid transform, or by one that is nearly so.
    pub fn moved(self, pose: &DAffine3) -> Self {
        Self { point: pose.transform_point3(self.point), normal: pose.transform_vector3(self.normal).normalize_or(self.normal) }
    }
}

/// Points of a surface: more do not bring a pose nearer.
pub const POINTS: usize = 60_000;

/// Fewer points are no surface but noise.
pub const LEAST_POINTS: usize = 100;

/// A surface as points that lie evenly on it, in random order.
#[derive(Debug)]
pub struct Cloud<'a> {
    /// The surface, where its scan's own grid puts it.
    pub surface: &'a Surface,
    /// Its points; the first n of them lie as evenly as all.
    pub points: Vec<Oriented>,
    /// The mean step between samples, mm.
    pub voxel_mm: f64,
    /// The mean of its points, mm.
    pub middle: DVec3,
    /// Root mean square distance of its points from there, mm.
    pub radius_mm: f64,
    tree: RTree<GeomWithData<[f64; 3], u32>>,
}

impl<'a> Cloud<'a> {
    /// At most about `most` points of `surface`, drawn evenly from the cells that it passes. `progress` counts its layers.
    pub fn of(surface: &'a Surface, most: usize, progress: &Progress) -> Result<Self, Cancelled> {
        Self::of_parts(surface, &Parts::default(), most, progress)
    }

    /// The same of what of it lies in `parts` of the world.
    pub fn of_parts(surface: &'a Surface, parts: &Parts, most: usize, progress: &Progress) -> Result<Self, Cancelled> {
        let map = surface.grid.index_to_world();
        let layers = surface.grid.dims()[2].saturating_sub(1);
        let all = if surface.grid.is_flat() { 0 } else { layers };
        let found = |k: usize| -> Result<_, Cancelled> {
            progress.advance(1)?;
            let mut cells = mesh::passed(surface, k);
            if !parts.is_all() {
                cells.retain(|cell| parts.hold(map.transform_point3(DVec3::from(cell.map(|n| n as f64 + 0.5)))));
            }
            Ok(cells)
        };
        let cells = (0..all).into_par_iter().map(found).collect::<Result<Vec<_>, _>>()?.concat();
        let mut drawn: Vec<(u64, [usize; 3])> = cells.into_iter().map(|cell| (lot(cell), cell)).collect();
        drawn.sort_unstable();
        drawn.truncate(most);
        let at = |(_, cell): &(u64, [usize; 3])| {
            let point = mesh::point_in(surface, *cell);
            let normal = smooth_normal(surface, IndexPoint(point))?;
            Some(Oriented { point: map.transform_point3(point), normal })
        };
        let points: Vec<Oriented> = drawn.par_iter().filter_map(at).collect();
        let entries = points.iter().enumerate().map(|(n, p)| GeomWithData::new(p.point.to_array(), n as u32)).collect();
        let (middle, radius_mm) = extent(&points);
        let voxel_mm = surface.grid.spacing_mm().element_sum() / 3.0;
        Ok(Self { surface, points, voxel_mm, middle, radius_mm, tree: RTree::bulk_load(entries) })
    }

    /// The nearest point within `reach_mm` whose normal agrees with that of `of` to this cosine.
    pub fn nearest(&self, of: Oriented, reach_mm: f64, cosine: f64) -> Option<Oriented> {
        let within = |e: &&GeomWithData<[f64; 3], u32>| e.distance_2(&of.point.to_array()) <= reach_mm * reach_mm;
        let ordered = self.tree.nearest_neighbor_iter(of.point.to_array()).take_while(within);
        ordered.map(|e| self.points[e.data as usize]).find(|p| p.normal.dot(of.normal) >= cosine)
    }

    /// Where the line through a point along its normal meets the interpolant's surface within `reach_mm`, where the normals agree to
    /// this cosine.
    pub fn root(&self, of: Oriented, reach_mm: f64, cosine: f64) -> Option<Oriented> {
        let mut t = 0.0;
        for _ in 0..NEWTON_STEPS {
            let at = of.point + t * of.normal;
            let (depth, rise) = depth_at(self.surface, WorldPoint(at))?;
            let slope = rise.dot(of.normal);
            if slope >= 0.0 {
                return None;
            }
            let step = -depth / slope;
            t += step;
            if t.abs() > reach_mm {
                return None;
            }
            if step.abs() <= NEWTON_VOXEL * self.voxel_mm {
                let point = of.point + t * of.normal;
                let normal = smooth_normal(self.surface, self.surface.grid.index(WorldPoint(point)))?;
                return (normal.dot(of.normal) >= cosine).then_some(Oriented { point, normal });
            }
        }
        None
    }
}

/// The mean of points, and their root mean square distance from it, mm.
fn extent(points: &[Oriented]) -> (DVec3, f64) {
    let count = points.len().max(1) as f64;
    let middle = points.iter().map(|p| p.point).sum::<DVec3>() / count;
    let square = points.iter().map(|p| p.point.distance_squared(middle)).sum::<f64>() / count;
    (middle, square.sqrt())
}

/// Newton's method doubles its digits with each step: from a tenth of a voxel off, five are enough; what takes more has no root near.
const NEWTON_STEPS: usize = 6;

/// A thousandth of what a registration is good to.
const NEWTON_VOXEL: f64 = 1e-5;

/// A number that is as good as random, and the same wherever the cell is asked for (the finaliser of MurmurHash3, Appleby 2011).
fn lot([i, j, k]: [usize; 3]) -> u64 {
    let mut h = (i as u64) | (j as u64) << 21 | (k as u64) << 42;
    h = (h ^ h >> 33).wrapping_mul(0xff51_afd7_ed55_8ccd);
    h = (h ^ h >> 33).wrapping_mul(0xc4ce_b9fe_1a85_ec53);
    h ^ h >> 33
}
