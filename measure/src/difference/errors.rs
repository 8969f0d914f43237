//! How far points of a surface may be off: what the scan's edge shows at one point of each block of cells, and the place of each point itself.

use crate::edge::{Edge, spacing_along_mm};
use crate::mesh::Mesh;
use crate::thickness::cell_at;
use crate::uncertainty::{End, EndError, of_end};
use bregma_field::crossings::{Crossing, Kind, crossings};
use bregma_field::interpolant::depth_at;
use bregma_field::{Cancelled, Progress, Ray, Surface, WorldPoint};
use glam::{DVec3, USizeVec3};
use rayon::prelude::*;
use std::collections::HashMap;

/// Cells of a block along each axis: about as far as the samples reach of which one edge is fitted, so that a finer choice would fit the same ones
/// again.
const BLOCK: usize = 4;
/// As far outside as the ray against a normal begins, voxels: as far as samples of an edge are looked at.
const OUTSIDE_VOXEL: f64 = 3.0;
/// Samples beyond the middle of a wall, or of a gap, belong to the next boundary; but those of this voxel always belong to this one.
const LEAST_REACH_VOXEL: f64 = 0.75;

/// See the module.
#[derive(Debug)]
pub struct PointErrors<'a> {
    surface: &'a Surface,
    iso: f64,
    tolerance: f64,
    by_block: HashMap<[usize; 3], EndError>,
}

impl<'a> PointErrors<'a> {
    /// Of `surface` at the isovalue `iso` with its `tolerance` (values), whose mesh is `mesh`. `progress` counts blocks.
    pub fn of(surface: &'a Surface, mesh: &Mesh, iso: f64, tolerance: f64, progress: &Progress) -> Result<Self, Cancelled> {
        // The first vertex of each block.
        let mut firsts: HashMap<[usize; 3], usize> = HashMap::new();
        for (n, point) in mesh.vertices.iter().enumerate() {
            firsts.entry(block_at(surface, *point)).or_insert(n);
        }
        let firsts: Vec<([usize; 3], usize)> = firsts.into_iter().collect();
        progress.begin(firsts.len() as u64);
        let at = |(block, n): &([usize; 3], usize)| -> Result<_, Cancelled> {
            progress.advance(1)?;
            Ok((*block, end_at(surface, mesh.vertices[*n], mesh.normals[*n], iso, tolerance)))
        };
        let by_block = firsts.par_iter().map(at).collect::<Result<HashMap<_, _>, _>>()?;
        Ok(Self { surface, iso, tolerance, by_block })
    }

    /// Of a point of the surface with its outward unit `normal` (world), along a ray of `direction` that goes `into` the bone there (1) or out of
    /// it (−1). Where its block has no vertex, its own edge is read.
    pub fn at(&self, point: DVec3, normal: DVec3, direction: DVec3, into: f64) -> EndError {
        let known = self.by_block.get(&block_at(self.surface, point)).copied();
        let template = known.unwrap_or_else(|| end_at(self.surface, point, normal, self.iso, self.tolerance));
        template.nearby(self.surface, point, normal, direction, into)
    }
}

fn block_at(surface: &Surface, point: DVec3) -> [usize; 3] {
    cell_at(surface, WorldPoint(point)).map(|n| n / BLOCK)
}

/// What is known of a point of `surface` with its outward unit `normal`, along the ray against that, at the isovalue `iso` with its `tolerance`
/// (values).
pub fn end_at(surface: &Surface, point: DVec3, normal: DVec3, iso: f64, tolerance: f64) -> EndError {
    let voxel_mm = spacing_along_mm(surface, normal);
    let outside_mm = OUTSIDE_VOXEL * voxel_mm;
    // A mesh's normals are of length 1 but for rounding.
    let ray = Ray { origin: WorldPoint(point + outside_mm * normal), direction: -normal };
    let ends: Vec<Crossing> = crossings(surface, &ray).into_iter().filter(|c| c.kind != Kind::Touch).collect();
    let own = ends.iter().position(|c| c.kind == Kind::Enter && !c.clipped && (c.t_mm - outside_mm).abs() < LEAST_REACH_VOXEL * voxel_mm);
    let Some(n) = own else { return without_edge(surface, point, normal, iso, tolerance) };
    let least_mm = LEAST_REACH_VOXEL * voxel_mm;
    let half_mm = |other: Option<&Crossing>| other.map_or(f64::INFINITY, |other| 0.5 * (other.t_mm - ends[n].t_mm).abs());
    let (wall_mm, gap_mm) = (half_mm(ends.get(n + 1)), half_mm(n.checked_sub(1).map(|before| &ends[before])));
    let edge = Edge::at(surface, point, normal, wall_mm.max(least_mm), gap_mm.max(least_mm));
    let end = End { crossing: &ends[n], edge, reach_mm: wall_mm.min(gap_mm) };
    of_end(surface, iso, tolerance, &ray, 2.0 * wall_mm, &end, 1.0)
}

/// Where no ray against the normal enters the bone at the point, as at a ridge thinner than a voxel: only the interpolant's own slope is known.
fn without_edge(surface: &Surface, point: DVec3, normal: DVec3, iso: f64, tolerance: f64) -> EndError {
    let ray = Ray { origin: WorldPoint(point), direction: -normal };
    let slope_per_mm = depth_at(surface, WorldPoint(point)).map_or(0.0, |(_, rise)| rise.length());
    let crossing = Crossing {
        t_mm: 0.0,
        kind: Kind::Enter,
        error_mm: 0.0,
        cell: USizeVec3::from(cell_at(surface, WorldPoint(point))),
        point: surface.grid.index(WorldPoint(point)),
        normal,
        slope_per_mm,
        clipped: false,
        at_origin: false,
    };
    of_end(surface, iso, tolerance, &ray, f64::INFINITY, &End { crossing: &crossing, edge: None, reach_mm: f64::INFINITY }, 1.0)
}
