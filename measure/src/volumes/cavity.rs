//! Volumes of cavities in bone, as of the brain's: what is reached from a point inside through empty space.
//!
//! Openings are closed by discs that nothing passes, or by a ball that must fit through: what the middle of a ball of radius r reaches, grown
//! back by r (the opening of the empty space by a ball, of which only the part around the seed is taken: Serra 1982, "Image analysis and
//! mathematical morphology", II). Where the cavity meets bone it ends at the interpolant's surface; at a disc, at its plane; at an opening that
//! the ball does not pass, where the ball's own surface comes to, half a voxel farther out so that bone and not the ball bounds it everywhere
//! else.

use super::bone::{Limits, MeasuredBone, known, measured_bone};
pub use super::error::CavityError;
use super::error::{VolumesError, told};
use super::other::Side;
use super::pass::{Bound, pass, rows_of};
pub use super::room::Disc;
use super::room::{Nearest, Reached, Room};
use super::sureness::{Bounding, Measure};
use bregma_field::{IndexPoint, Measured, Progress, Surface, Volume, WorldPoint};
use glam::{DVec3, USizeVec3};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A cavity that is to be measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cavity {
    /// A point in it, LPS mm.
    pub seed_mm: DVec3,
    /// Lids over its openings.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub discs: Vec<Disc>,
    /// It goes as far as a ball of this radius does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ball_mm: Option<f64>,
}

/// A measured cavity.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeasuredCavity {
    /// The scan.
    pub scan: MeasuredBone,
    /// Which cavity.
    pub cavity: Cavity,
    /// How large it is.
    pub measure: Measure,
}

/// The volume of a cavity in the bone of `volume`. `progress` counts layers of samples and rows of bricks.
pub fn cavity(
    volume: &Arc<Volume>,
    measured: &Measured,
    cavity: &Cavity,
    limits: &Limits,
    index: usize,
    progress: &Progress,
) -> Result<MeasuredCavity, VolumesError> {
    let surface = Surface::new(volume, measured.iso, measured.transform)?.cut(&limits.clips, index);
    let room = Room::of(&surface, &cavity.discs);
    progress.begin(surface.grid.dims()[2] as u64 + rows_of(&surface));
    let filled = Filled { depth: fill(&room, cavity, limits.open, progress)?, room: &room, discs: &cavity.discs };
    let sums = pass(&surface, None, &filled, progress)?;
    let known = known(&surface, measured, &sums);
    // Lids and cuts stay where they are when the scan moves.
    let moves = !(surface.region.is_all() && cavity.discs.is_empty());
    let bounds = [Bounding { known: &known, skin: sums.skin, sign: 1.0, moves }];
    let measure = Measure::of(format!("{}, cavity at {}", volume.name(), told(cavity.seed_mm)), &[sums.own], &bounds);
    Ok(MeasuredCavity { scan: measured_bone(&known, volume.name()), cavity: cavity.clone(), measure })
}

/// For each sample, how far within the cavity it is: negative or NaN where it is not.
fn fill(room: &Room<'_>, cavity: &Cavity, open: bool, progress: &Progress) -> Result<Vec<f32>, VolumesError> {
    let seed = seed(room, cavity.seed_mm)?;
    let nearest = if cavity.ball_mm.is_some() { Some(room.surface_points(progress)?) } else { None };
    let ball = cavity.ball_mm.zip(nearest.as_ref());
    if let Some((ball_mm, nearest)) = ball {
        let room_mm = nearest.distance_mm(room.point_mm(seed));
        if room_mm < ball_mm {
            return Err(CavityError::NoRoom { seed_mm: cavity.seed_mm, ball_mm, room_mm }.into());
        }
    }
    let Some(Reached { is_reached: core, rim }) = room.reached(seed, ball, open, progress)? else {
        let nearest = nearest.map_or_else(|| room.surface_points(progress), Ok)?;
        let way = room.way_out(seed, &nearest, progress)?;
        // The fill has just gone out, so there is a way.
        return Err(way.map_or(CavityError::Outside(cavity.seed_mm), |way| CavityError::Leak { seed_mm: cavity.seed_mm, way }).into());
    };
    let Some(ball_mm) = cavity.ball_mm else {
        return Ok(core.into_iter().map(|is_in| if is_in { f32::INFINITY } else { f32::NAN }).collect());
    };
    let half_voxel_mm = 0.5 * room.surface.grid.index_to_world().matrix3.determinant().abs().cbrt();
    Ok(room.grown(&core, &Nearest::of(rim), ball_mm + half_voxel_mm, progress)?)
}

/// The empty sample of the seed's cell that is nearest to it.
fn seed(room: &Room<'_>, seed_mm: DVec3) -> Result<usize, CavityError> {
    let surface = room.surface;
    let IndexPoint(p) = surface.grid.index(WorldPoint(seed_mm));
    let last = USizeVec3::from(surface.grid.cells()).as_dvec3();
    let is_outside = !p.is_finite() || surface.grid.is_flat() || p.cmplt(DVec3::ZERO).any() || p.cmpgt(last).any();
    if is_outside || surface.region.depth_mm(seed_mm) < 0.0 {
        return Err(CavityError::Outside(seed_mm));
    }
    let is_bone = bregma_field::interpolant::depth_at(surface, WorldPoint(seed_mm)).is_some_and(|(depth, _)| depth >= 0.0);
    let cell = p.floor().min(last - 1.0).as_usizevec3();
    let corner = |c: usize| room.number([cell.x + (c & 1), cell.y + (c >> 1 & 1), cell.z + (c >> 2)]);
    let away = |n: &usize| room.point_mm(*n).distance(seed_mm);
    let empty = (0..8).map(corner).filter(|n| room.is_empty(*n)).min_by(|a, b| away(a).total_cmp(&away(b)));
    empty.filter(|_| !is_bone).ok_or(CavityError::InBone(seed_mm))
}

/// Which cells belong to the cavity.
struct Filled<'a> {
    depth: Vec<f32>,
    room: &'a Room<'a>,
    discs: &'a [Disc],
}

impl Filled<'_> {
    fn corners(&self, [i, j, k]: [usize; 3]) -> [usize; 8] {
        std::array::from_fn(|c| self.room.number([i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)]))
    }

    /// Which side of the disc that parts the cell's corners they lie on, mm, positive where the cavity is.
    fn beyond_disc(&self, corners: &[usize; 8], is_in: &[Option<bool>; 8]) -> Option<[f64; 8]> {
        let points = corners.map(|n| self.room.point_mm(n));
        let size = points[0].distance(points[7]);
        let middle = (points[0] + points[7]) / 2.0;
        self.discs.iter().find_map(|disc| {
            let sides = points.map(|p| (p - disc.centre_mm).dot(disc.normal));
            let passes = sides.iter().any(|s| *s >= 0.0) && sides.iter().any(|s| *s < 0.0);
            if !passes || middle.distance(disc.centre_mm) > disc.radius_mm + size {
                return None;
            }
            let toward: f64 = sides.iter().zip(is_in).filter_map(|(s, is_in)| is_in.map(|is_in| if is_in { *s } else { -s })).sum();
            Some(sides.map(|s| s * toward.signum()))
        })
    }
}

impl Bound for Filled<'_> {
    const INSIDE_OUT: bool = true;

    fn side(&self, cell: [usize; 3], f: &[f64; 8]) -> Side {
        let (mut some_in, mut some_out) = (false, false);
        for (n, f) in self.corners(cell).into_iter().zip(f) {
            if *f >= 0.0 {
                let is_in = self.depth[n] >= 0.0;
                some_in |= is_in;
                some_out |= !is_in;
            }
        }
        match (some_in, some_out) {
            (false, _) => Side::Out,
            (true, false) => Side::In,
            _ => Side::Between,
        }
    }

    fn values(&self, cell: [usize; 3], f: &[f64; 8]) -> [f64; 8] {
        let corners = self.corners(cell);
        let is_in: [Option<bool>; 8] = std::array::from_fn(|c| (f[c] >= 0.0).then(|| self.depth[corners[c]] >= 0.0));
        if let Some(beyond) = self.beyond_disc(&corners, &is_in) {
            return beyond;
        }
        // The ball's surface lies where its depth is 0; where that is not known, halfway between what is in and what is not.
        let step = self.room.surface.grid.spacing_mm().max_element();
        let depth = |c: usize| match (f64::from(self.depth[corners[c]]), is_in[c]) {
            (_, None) => None,
            (depth, _) if depth.is_nan() => Some(-step),
            (depth, _) => Some(depth.clamp(-step, step)),
        };
        let depths: [Option<f64>; 8] = std::array::from_fn(depth);
        let known: Vec<f64> = depths.into_iter().flatten().collect();
        // Bone has no depth of its own: it takes no side.
        let mean = known.iter().sum::<f64>() / known.len().max(1) as f64;
        depths.map(|depth| depth.unwrap_or(mean))
    }
}
