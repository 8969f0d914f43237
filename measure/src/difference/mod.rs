//! How far two surfaces are from each other, over all of both: each point of one with what belongs to it on the other, the difference, and how
//! sure that is.
//!
//! One pair has several differences, and each is a fair answer to another question; see [`By`].

mod displacement;
mod errors;
mod statistics;

use crate::mesh::Mesh;
use crate::partner::{Partner, Partners};
use crate::thickness::inward;
use crate::uncertainty::{EndError, Ends, Registered, of_difference};
use bregma_field::crossings::{self, Kind};
use bregma_field::interpolant::smooth_normal;
use bregma_field::{Cancelled, Progress, Ray, Surface, WorldPoint};
pub use displacement::displaced;
pub use errors::{PointErrors, end_at};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
pub use statistics::{Extreme, Statistics};

/// Which difference.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum By {
    /// The signed distance to the nearest place of the other surface that faces the same way: [`Partners::facing`].
    Partner,
    /// The signed distance to the nearest place of the other surface, of either side of a wall: what CloudCompare calls cloud-to-mesh distance and
    /// VTK the distance of polydata.
    Closest,
    /// Along the normal, to the first place of the other surface that faces the same way.
    Normal,
    /// The other's thickness at the partner less this one's, each along its own inward normal.
    Thickness,
}

/// One of two surfaces.
#[derive(Clone, Copy, Debug)]
pub struct Side<'a> {
    /// Its bone.
    pub surface: &'a Surface,
    /// Its points.
    pub mesh: &'a Mesh,
    /// Ready to be asked for points that belong to others'.
    pub partners: &'a Partners<'a>,
    /// How far its points may be off.
    pub errors: &'a PointErrors<'a>,
    /// What is known of its registration.
    pub registered: Registered<'a>,
}

/// The difference at each vertex of one surface.
#[derive(Clone, Debug, Default)]
pub struct Map {
    /// Second scan against first, mm: positive where the second's bone stands out, or is thicker. NaN where there is none.
    pub values_mm: Vec<f32>,
    /// Half the width of the interval that holds it in 95 of 100 cases, mm.
    pub errors_mm: Vec<f32>,
    /// What belongs to the vertex, LPS mm.
    pub partners_mm: Vec<Vec3>,
    /// What the ends that they are between have in common, by area: the first scan's, then the second's.
    common: [EndError; 2],
}

/// One point's.
pub(crate) struct Found {
    /// Of the other against the own surface.
    pub mm: f64,
    /// What belongs to the point.
    pub partner: DVec3,
    /// Of the own, then of the other surface.
    pub ends: [Vec<EndError>; 2],
}

/// Vertices that are looked at one after the other, each with its neighbour's partner as a hint.
const CHUNK: usize = 1024;

/// What is asked for.
#[derive(Clone, Copy, Debug)]
pub struct Asked<'a> {
    /// Which difference.
    pub by: By,
    /// What belongs to a vertex is looked for so far, mm.
    pub reach_mm: f64,
    /// At which vertices, a word for each.
    pub at: &'a [bool],
}

/// The difference of the second surface against the first at the vertices of one, which is the first's where `on_first`. A vertex that is not asked
/// for, or lies outside the other's scan, where nothing is known of it, has none. `progress` counts vertices.
pub fn map(first: Side<'_>, second: Side<'_>, on_first: bool, asked: Asked<'_>, progress: &Progress) -> Result<Map, Cancelled> {
    let (own, other) = if on_first { (first, second) } else { (second, first) };
    let count = own.mesh.vertices.len();
    progress.begin(count as u64);
    let registered = [first.registered, second.registered];
    let areas = own.mesh.areas_mm2();
    let chunk = |from: usize| -> Result<(Map, f64), Cancelled> {
        let to = (from + CHUNK).min(count);
        progress.advance((to - from) as u64)?;
        let (mut map, mut hint, mut ends, mut area_mm2) = (Map::default(), None, [vec![], vec![]], 0.0);
        for n in from..to {
            let place = [own.mesh.vertices[n], own.mesh.normals[n]];
            let found = if asked.at[n] { at(own, other, place, asked.by, asked.reach_mm, &mut hint) } else { None };
            // From here on the first scan's come first.
            let found = found.map(|f| if on_first { f } else { f.turned() });
            if let Some(found) = &found {
                area_mm2 += areas[n];
                (0..2).for_each(|scan| ends[scan].extend(found.ends[scan].iter().map(|end| (*end, areas[n]))));
            }
            map.push(found, registered);
        }
        map.common = ends.map(|ends| EndError::common(ends.into_iter()));
        Ok((map, area_mm2))
    };
    let parts = (0..count.div_ceil(CHUNK)).into_par_iter().map(|n| chunk(n * CHUNK)).collect::<Result<Vec<_>, _>>()?;
    let area_mm2: f64 = parts.iter().map(|(_, area)| area).sum();
    let common = [0, 1].map(|scan| EndError::common(parts.iter().map(|(part, _)| (part.common[scan], 1.0 / area_mm2))));
    let mut all = Map { common, ..Map::default() };
    for (part, _) in parts {
        all.values_mm.extend(part.values_mm);
        all.errors_mm.extend(part.errors_mm);
        all.partners_mm.extend(part.partners_mm);
    }
    Ok(all)
}

impl Found {
    /// The same where the surfaces change places.
    fn turned(self) -> Self {
        let [a, b] = self.ends;
        Self { mm: 0.0 - self.mm, ends: [b, a], ..self }
    }
}

impl Map {
    fn push(&mut self, found: Option<Found>, registered: [Registered<'_>; 2]) {
        let Some(Found { mm, partner, ends }) = found else {
            self.values_mm.push(f32::NAN);
            self.errors_mm.push(f32::NAN);
            self.partners_mm.push(Vec3::NAN);
            return;
        };
        let error = of_difference([0, 1].map(|n| Ends { of: &ends[n], registered: registered[n] }));
        self.values_mm.push(mm as f32);
        self.errors_mm.push(error.error_mm as f32);
        self.partners_mm.push(partner.as_vec3());
    }

    /// Whether the difference at a vertex is larger than all that scanning, thresholds and registration may have done; not where there is none.
    pub fn is_sure(&self, vertex: usize) -> bool {
        self.values_mm[vertex].abs() > self.errors_mm[vertex]
    }
}

/// What `other` has to a point of `own` with its outward unit normal: positive where `other` stands out. `hint` is the last partner.
pub(crate) fn at(
    own: Side<'_>,
    other: Side<'_>,
    [point, normal]: [DVec3; 2],
    by: By,
    reach_mm: f64,
    hint: &mut Option<Partner>,
) -> Option<Found> {
    let is_in_other = other.partners.holds(WorldPoint(point))?;
    let partner = match by {
        By::Partner | By::Thickness => other.partners.facing(WorldPoint(point), normal, reach_mm, hint.as_ref())?,
        By::Closest => other.partners.closest(WorldPoint(point), reach_mm, hint.as_ref())?,
        By::Normal => other.partners.here(WorldPoint(point)).or_else(|| along_normal(other.surface, point, normal, reach_mm))?,
    };
    *hint = Some(partner);
    let WorldPoint(there) = partner.point;
    let there_normal = smooth_normal(other.surface, other.surface.grid.index(partner.point)).unwrap_or(partner.normal);
    let end_of = |side: Side<'_>, point: DVec3, normal: DVec3| side.errors.at(point, normal, -normal, 1.0);
    if by == By::Thickness {
        let [(own_mm, own_ends), (other_mm, other_ends)] = [wall(own, point, normal)?, wall(other, there, there_normal)?];
        return Some(Found { mm: other_mm - own_mm, partner: there, ends: [own_ends, other_ends] });
    }
    let mm = if partner.distance_mm == 0.0 {
        0.0
    } else if is_in_other {
        partner.distance_mm
    } else {
        -partner.distance_mm
    };
    let ends = [end_of(own, point, normal), end_of(other, there, there_normal)].map(|end| vec![end]);
    Some(Found { mm, partner: there, ends })
}

/// The thickness of the wall behind a point, mm, and what is known of its two ends; `None` where the scan's box cuts it.
pub(crate) fn wall(side: Side<'_>, point: DVec3, normal: DVec3) -> Option<(f64, Vec<EndError>)> {
    let (mm, end) = inward(side.surface, point, normal)?;
    if end.clipped {
        return None;
    }
    let exit = crossings::world(side.surface, &end).0;
    let enter = side.errors.at(point, normal, -normal, 1.0);
    let leave = side.errors.at(exit, end.normal, -normal, -1.0);
    Some((mm, vec![enter, leave]))
}

/// The first place along the normal, out or in, that faces the same way.
fn along_normal(surface: &Surface, point: DVec3, normal: DVec3, reach_mm: f64) -> Option<Partner> {
    let ray = Ray { origin: WorldPoint(point + reach_mm * normal), direction: -normal };
    // A ray against the normal enters what faces the same way.
    let entries = crossings::crossings(surface, &ray).into_iter().filter(|c| c.kind == Kind::Enter && !c.clipped && !c.at_origin);
    let nearest = entries.min_by(|a, b| (a.t_mm - reach_mm).abs().total_cmp(&(b.t_mm - reach_mm).abs()))?;
    let distance_mm = (nearest.t_mm - reach_mm).abs();
    let point = crossings::world(surface, &nearest);
    (distance_mm <= reach_mm).then_some(Partner { point, normal: nearest.normal, distance_mm, cell: nearest.cell })
}
