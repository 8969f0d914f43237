//! How thick bone is, three ways that answer different questions:
//! * **along a ray**: what a probe passes, see [`crate::probe`];
//! * **along the inward normal** of a surface: what a section across the wall shows. Where the two sides are not parallel it depends on the side
//!   that it is measured from, so both are told;
//! * **the largest inscribed sphere** that holds a point: the local thickness of Hildebrand and Rüegsegger (1997, Journal of Microscopy 185,
//!   67–75), the same from all sides.

use crate::mesh::Mesh;
use bregma_field::crossings::{self, Crossing};
use bregma_field::interpolant::smooth_normal;
use bregma_field::{Cancelled, IndexPoint, Progress, Ray, Sample, Store, Surface, WorldPoint, with_block};
use glam::DVec3;
use rayon::prelude::*;
use rstar::RTree;
use rstar::primitives::GeomWithData;
use serde::Serialize;

/// A wall measured across, from a point of one side.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Across {
    /// Along the inward normal of the side that it was measured from.
    pub there_mm: f64,
    /// From where that ends, along the inward normal of that side.
    pub back_mm: f64,
    /// Between the two normals, degrees: 0 where the sides are parallel.
    pub angle_deg: f64,
    /// A side is cut by the scan's edge: the bone may go on.
    pub clipped: bool,
}

/// Rays begin so far outside the surface that they see it, in voxels.
const START_VOXEL: f64 = 0.01;

/// The wall behind a point of the surface with outward unit `normal`; `None` where there is no bone behind it.
pub fn across(surface: &Surface, point: DVec3, normal: DVec3) -> Option<Across> {
    let (there, end) = inward(surface, point, normal)?;
    let exit_normal = smooth_normal(surface, end.point).unwrap_or(end.normal);
    // Where the scan cuts the bone there is no way back.
    let back = if end.clipped { None } else { inward(surface, crossings::world(surface, &end).0, exit_normal) };
    Some(Across {
        there_mm: there,
        back_mm: back.map_or(there, |(back, _)| back),
        angle_deg: exit_normal.dot(-normal).clamp(-1.0, 1.0).acos().to_degrees(),
        clipped: end.clipped || back.is_some_and(|(_, end)| end.clipped),
    })
}

/// The length of the wall behind a point against its outward normal, and where that ends.
pub(crate) fn inward(surface: &Surface, point: DVec3, normal: DVec3) -> Option<(f64, Crossing)> {
    let start_mm = START_VOXEL * crate::edge::spacing_along_mm(surface, normal);
    let ray = Ray::new(WorldPoint(point + start_mm * normal), -normal)?;
    let [enter, exit] = crossings::first_wall(surface, &ray)?;
    // Another wall, farther on, is not the one that the point lies on: the surface there only touches the ray.
    (enter.t_mm <= 3.0 * start_mm).then_some((exit.t_mm - enter.t_mm, exit))
}

/// The spheres that fit into bone: a ball about each sample inside, up to the surface. Only those are kept that no other one about a
/// neighbouring sample contains.
#[derive(Clone, Debug)]
pub struct InscribedSpheres {
    /// Centres (LPS mm) and radii (mm), the largest first.
    pub spheres: Vec<(DVec3, f64)>,
    /// As far as the largest sphere that touches a point may lie beside the nearest one that is known, mm.
    pub tolerance_mm: f64,
}

type Point = [f64; 3];

impl InscribedSpheres {
    /// Of the bone of `surface`. `progress` counts layers of samples.
    pub fn of(surface: &Surface, progress: &Progress) -> Result<Self, Cancelled> {
        let [nx, ny, nz] = surface.grid.dims();
        progress.begin(3 * nz as u64);
        let map = surface.grid.index_to_world();
        let steps = surface.grid.spacing_mm();
        let tolerance_mm = BETWEEN_SPHERES * steps.length();
        let layer = |k: usize| -> Result<_, Cancelled> {
            progress.advance(1)?;
            Ok(layer_of(surface, k))
        };
        let layers = (0..nz).into_par_iter().map(layer).collect::<Result<Vec<_>, _>>()?;
        let world = |index: DVec3| map.transform_point3(index).to_array();
        let seeds: Vec<Point> = layers.iter().flat_map(|(_, crossings)| crossings.iter().map(|c| world(*c))).collect();
        if seeds.is_empty() {
            return Ok(Self { spheres: vec![], tolerance_mm });
        }
        let seeds = RTree::bulk_load(seeds);
        // The radius about each sample inside, by its number.
        let radii = |(k, (inside, _)): (usize, &(Vec<u32>, Vec<DVec3>))| -> Result<Vec<f32>, Cancelled> {
            progress.advance(1)?;
            let radius = |n: &u32| {
                let index = DVec3::new((*n as usize % nx) as f64, (*n as usize / nx) as f64, k as f64);
                let centre = world(index);
                // There are seeds.
                seeds.nearest_neighbor(centre).map_or(0.0, |seed| DVec3::from(*seed).distance(centre.into())) as f32
            };
            Ok(inside.iter().map(radius).collect())
        };
        let radii = layers.par_iter().enumerate().map(radii).collect::<Result<Vec<_>, _>>()?;
        let radius_at = |[i, j, k]: [usize; 3]| {
            let n = layers[k].0.binary_search(&((j * nx + i) as u32)).ok()?;
            Some(radii[k][n])
        };
        let kept = |(k, (inside, _)): (usize, &(Vec<u32>, Vec<DVec3>))| -> Result<Vec<(DVec3, f64)>, Cancelled> {
            progress.advance(1)?;
            let is_kept = |(n, radius): &(&u32, &f32)| {
                let at = [**n as usize % nx, **n as usize / nx, k];
                !neighbours(at, [nx, ny, nz]).any(|(other, step)| {
                    let away = map.transform_vector3(step).length() as f32;
                    // A tenth of the step is no reason to keep a sphere: its neighbour holds all but that rim of it.
                    radius_at(other).is_some_and(|r| r >= **radius + 0.9 * away)
                })
            };
            let sphere = |(n, radius): (&u32, &f32)| {
                (map.transform_point3(DVec3::new((*n as usize % nx) as f64, (*n as usize / nx) as f64, k as f64)), f64::from(*radius))
            };
            let refined = |sphere| grown(&seeds, sphere, 0.5 * steps.min_element());
            Ok(inside.iter().zip(&radii[k]).filter(is_kept).map(sphere).map(refined).collect())
        };
        let kept = layers.par_iter().enumerate().map(kept).collect::<Result<Vec<_>, _>>()?;
        let mut spheres: Vec<(DVec3, f64)> = kept.into_iter().flatten().collect();
        spheres.par_sort_by(|a, b| b.1.total_cmp(&a.1));
        Ok(Self { spheres, tolerance_mm })
    }

    /// For each of `points` the diameter of the largest sphere that holds it, or comes as near as the tolerance; mm. `None` where none does.
    /// `progress` counts points.
    pub fn thickness_at(&self, points: &[DVec3], progress: &Progress) -> Result<Vec<Option<f64>>, Cancelled> {
        progress.begin(points.len() as u64);
        let mut thickness = vec![None; points.len()];
        let mut left = RTree::bulk_load(points.iter().zip(0_u32..).map(|(p, n)| GeomWithData::new(p.to_array(), n)).collect());
        for (centre, radius) in &self.spheres {
            // The largest come first: what a sphere holds needs no other.
            let reach = radius + self.tolerance_mm;
            let mut held = 0;
            for point in left.drain_within_distance(centre.to_array(), reach * reach) {
                thickness[point.data as usize] = Some(2.0 * radius);
                held += 1;
            }
            progress.advance(held)?;
            if left.size() == 0 {
                break;
            }
        }
        Ok(thickness)
    }
}

/// Spheres are about as far apart as samples: two that touch a wall leave a gap of h²/(4r) between them where they meet, a quarter of a
/// sample's distance h in the thinnest walls. So much, of a voxel's diagonal, and a little for walls that turn.
const BETWEEN_SPHERES: f64 = 0.3;
/// Halvings of the step by which spheres grow: to a thirtieth of a voxel.
const GROWTHS: usize = 5;

/// A sphere about a sample grown to the largest one near it: its centre moves away from what it touches as long as that gives it room.
fn grown(seeds: &RTree<Point>, (mut centre, mut radius): (DVec3, f64), first_step_mm: f64) -> (DVec3, f64) {
    let mut step = first_step_mm;
    for _ in 0..GROWTHS {
        let touched = seeds.nearest_neighbor(centre.to_array()).map(|seed| DVec3::from(*seed));
        let Some(away) = touched.and_then(|seed| (centre - seed).try_normalize()) else { break };
        let moved = centre + step * away;
        let room = seeds.nearest_neighbor(moved.to_array()).map_or(0.0, |seed| DVec3::from(*seed).distance(moved));
        // A step through the wall's other side would find room in the air: it is shorter than what it would have to pass.
        if room > radius && step < radius {
            (centre, radius) = (moved, room);
        }
        step *= 0.5;
    }
    (centre, radius)
}

/// The samples of layer k that are inside, by number in the layer, and where the surface crosses the grid edges that begin there.
fn layer_of(surface: &Surface, k: usize) -> (Vec<u32>, Vec<DVec3>) {
    let dims = surface.grid.dims();
    let (mut inside, mut crossings) = (vec![], vec![]);
    with_block!(Store::of(&surface.volume).whole(), block => {
        let value = |at: [usize; 3]| f64::from(surface.sign) * (block.at(at).to_f64() - surface.level);
        for j in 0..dims[1] {
            for i in 0..dims[0] {
                let at = [i, j, k];
                let here = value(at);
                if here >= 0.0 {
                    inside.push((j * dims[0] + i) as u32);
                }
                for axis in 0..3 {
                    let mut next = at;
                    next[axis] += 1;
                    if next[axis] == dims[axis] {
                        continue;
                    }
                    let there = value(next);
                    if (here >= 0.0) != (there >= 0.0) {
                        crossings.push(DVec3::from(at.map(|n| n as f64)) + here / (here - there) * DVec3::AXES[axis]);
                    }
                }
            }
        }
    });
    (inside, crossings)
}

/// The 26 samples around one, with the steps to them.
fn neighbours(at: [usize; 3], dims: [usize; 3]) -> impl Iterator<Item = ([usize; 3], DVec3)> {
    let step = |n: usize| [n % 3, n / 3 % 3, n / 9].map(|s| s as isize - 1);
    (0..27).filter(|n| *n != 13).filter_map(move |n| {
        let step = step(n);
        let mut other = at;
        for a in 0..3 {
            other[a] = at[a].checked_add_signed(step[a]).filter(|m| *m < dims[a])?;
        }
        Some((other, DVec3::from(step.map(|s| s as f64))))
    })
}

/// Which thickness is mapped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// Along rays of this direction (unit, world), as they enter.
    Ray(DVec3),
    /// Along the inward normal.
    Normal,
    /// The largest inscribed sphere.
    Sphere,
}

/// The thickness at each vertex of the mesh of `surface`, mm; NaN where it is not known: where a ray does not enter the bone, or the scan cuts
/// the wall. `progress` counts what is measured.
pub fn map(surface: &Surface, mesh: &Mesh, method: Method, progress: &Progress) -> Result<Vec<f32>, Cancelled> {
    if method == Method::Sphere {
        let spheres = InscribedSpheres::of(surface, progress)?;
        let found = spheres.thickness_at(&mesh.vertices, progress)?;
        return Ok(found.into_iter().map(|t| t.map_or(f32::NAN, |t| t as f32)).collect());
    }
    progress.begin(mesh.vertices.len() as u64);
    let at = |(point, normal): (&DVec3, &DVec3)| -> Result<f32, Cancelled> {
        progress.advance(1)?;
        let outward = match method {
            Method::Ray(direction) => -direction,
            _ => *normal,
        };
        let wall = if outward.dot(*normal) > 0.0 { inward(surface, *point, outward) } else { None };
        Ok(wall.filter(|(_, end)| !end.clipped).map_or(f32::NAN, |(mm, _)| mm as f32))
    };
    mesh.vertices.par_iter().zip(&mesh.normals).map(at).collect()
}

/// What the values of a map are like, by the area of the surface that has them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Statistics {
    /// Vertices with a value.
    pub count: usize,
    /// Vertices without.
    pub unknown: usize,
    /// Area of the surface with values, mm².
    pub area_mm2: f64,
    /// Mean.
    pub mean_mm: f64,
    /// Standard deviation.
    pub deviation_mm: f64,
    /// The least, the greatest, and what 5, 25, 50, 75 and 95 % of the area are below.
    pub quantiles_mm: [f64; 7],
    /// Ends of the histogram's bins, all equally wide: from the least to what 99 % of the area is below; few places are much thicker.
    pub bin_ends_mm: [f64; 2],
    /// Area in each bin, mm².
    pub bins_mm2: Vec<f64>,
}

/// Bins of a map's histogram.
const BINS: usize = 64;

impl Statistics {
    /// Of the values at the vertices of `mesh`; `None` where there are none.
    pub fn of(mesh: &Mesh, values: &[f32]) -> Option<Self> {
        let areas = mesh.areas_mm2();
        let mut known: Vec<(f64, f64)> = values.iter().map(|v| f64::from(*v)).zip(areas).filter(|(v, _)| !v.is_nan()).collect();
        known.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (least, greatest) = (known.first()?.0, known.last()?.0);
        let area_mm2: f64 = known.iter().map(|(_, area)| area).sum();
        let mean_mm = known.iter().map(|(v, area)| v * area).sum::<f64>() / area_mm2;
        let variance = known.iter().map(|(v, area)| (v - mean_mm).powi(2) * area).sum::<f64>() / area_mm2;
        let mut below = 0.0;
        let cumulated: Vec<f64> = known
            .iter()
            .map(|(_, area)| {
                below += area;
                below
            })
            .collect();
        let quantile = |part: f64| known[cumulated.partition_point(|sum| *sum < part * area_mm2).min(known.len() - 1)].0;
        let mut bins_mm2 = vec![0.0; BINS];
        let end = quantile(0.99);
        let width = (end - least).max(f64::MIN_POSITIVE);
        for (v, area) in known.iter().filter(|(v, _)| *v <= end) {
            bins_mm2[(((v - least) / width * BINS as f64) as usize).min(BINS - 1)] += area;
        }
        Some(Self {
            count: known.len(),
            unknown: values.len() - known.len(),
            area_mm2,
            mean_mm,
            deviation_mm: variance.sqrt(),
            quantiles_mm: [least, greatest, quantile(0.05), quantile(0.25), quantile(0.5), quantile(0.75), quantile(0.95)],
            bin_ends_mm: [least, end],
            bins_mm2,
        })
    }
}

/// The cell that a point of the world lies in, by its lowest sample.
pub fn cell_at(surface: &Surface, point: WorldPoint) -> [usize; 3] {
    let IndexPoint(p) = surface.grid.index(point);
    let dims = surface.grid.dims();
    std::array::from_fn(|a| (p[a].max(0.0) as usize).min(dims[a].saturating_sub(2)))
}
