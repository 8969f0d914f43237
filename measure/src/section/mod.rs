//! The thickness of bone along a curve of its surface, and of another scan's beside it, with how far the two surfaces are from each other.
//!
//! The curve is that in which a plane meets the interpolant's surface, traced from cell to cell; nothing of it is a mesh's. Its stations
//! are as far apart along it as is asked. At each of them what is measured is what maps of thickness and of differences measure at a point:
//! walls along their own inward normals, the second scan's at the station's partner, and the signed distance to that.
//!
//! ```text
//!     along ├─ step ─┤
//!     ━━━━━━•━━━━━━━━•━━━━ curve on A     at each • : A's wall along its inward normal, the partner on B,
//!           ↓ A                           B's wall there along its own, B − A, and how far B stands out
//!     ───────────────────
//! ```

mod cells;
mod curve;
mod path;
mod plane;
mod table;
#[cfg(test)]
mod tests;
mod trace;

use crate::difference::{By, Side, at, wall};
use crate::edge::spacing_along_mm;
use crate::partner::Partner;
use crate::uncertainty::{EndError, Ends, Registered, of_difference, of_length};
use bregma_field::interpolant::{depth_at, smooth_normal};
use bregma_field::{Cancelled, Progress, Surface, WorldPoint};
use glam::DVec3;
pub use path::{LANDMARK_MM, Line, Named, Path};
pub use plane::Plane;
use rayon::prelude::*;
use serde::{Deserialize, Deserializer, Serialize};
pub use table::csv;
use thiserror::Error;

/// Why there is no section.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum SectionError {
    /// Too few landmarks.
    #[error("a section goes from landmark to landmark, and {0} are named; name two or more")]
    Few(usize),
    /// A landmark that is not of this surface.
    #[error("{name} lies {} mm from the surface there; a landmark of a section lies within {LANDMARK_MM} mm: set it on the surface, or choose another isovalue", crate::numbers::fixed(*off_mm, 1))]
    Far {
        /// The landmark.
        name: String,
        /// How far it is away.
        off_mm: f64,
    },
    /// Points or normals that span no plane.
    #[error("{0} span no plane with the surface there; choose other landmarks, or say the plane")]
    NoPlane(String),
    /// Two landmarks on two curves.
    #[error(
        "{from} and {to} do not lie on one curve of the surface in their plane, as where one lies on the inner side of the bone or a gap is between them; choose a landmark between them, or another isovalue"
    )]
    Apart {
        /// The first landmark.
        from: String,
        /// The second.
        to: String,
    },
    /// A plane beside the bone.
    #[error("the surface does not pass there; choose another plane or another isovalue")]
    Nothing,
    /// More stations than any table holds.
    #[error("{} mm are too many steps of {} mm; choose a longer step", crate::numbers::fixed(*length_mm, 1), crate::numbers::significant(*step_mm, 3))]
    Steps {
        /// The curve's length.
        length_mm: f64,
        /// The step.
        step_mm: f64,
    },
    /// Stopped by request.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// A landmark on the curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mark {
    /// What it is called.
    pub name: String,
    /// Where it is, mm along the curve.
    pub along_mm: f64,
    /// How far it lies from there, mm.
    pub off_mm: f64,
}

/// A length or a difference with its ±.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Length {
    /// The number.
    pub mm: f64,
    /// Half the width of the interval that holds it in 95 of 100 cases; infinite (null in JSON) where nothing bounds it.
    #[serde(deserialize_with = "unbounded")]
    pub error_mm: f64,
}

/// JSON has no infinity.
fn unbounded<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::INFINITY))
}

/// A place of the curve with what was measured there. What is not known, is not there: a wall that the scan's box cuts, one
/// at a crease that the inward normal only grazes, or a point without a partner.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Station {
    /// How far along the curve, mm.
    pub along_mm: f64,
    /// Where, LPS mm.
    pub point_mm: DVec3,
    /// Outward unit normal there.
    pub normal: DVec3,
    /// Thickness of the scan on whose surface the curve runs.
    pub thickness: Option<Length>,
    /// Thickness of the second scan at the partner.
    pub second_thickness: Option<Length>,
    /// That less the first: positive where the second's bone is thicker.
    pub thickness_difference: Option<Length>,
    /// How far the second's surface stands out over the first's.
    pub surface_difference: Option<Length>,
    /// The partner, LPS mm.
    pub partner_mm: Option<DVec3>,
}

/// Stations that are measured one after the other, each with its neighbour's partner as a hint.
const CHUNK: usize = 32;
/// A curve of a metre in hundredths of a millimetre.
const MOST_STATIONS: f64 = 100_000.0;
/// What is no thicker, voxels, is no wall: there the normal grazes a crease of the surface, and the ray along it begins on its other side
/// (a hundredth of a voxel off).
const NO_WALL_VOXEL: f64 = 0.02;
/// Lengths along a curve are added up to that part of a step.
const SAME_STEP: f64 = 1e-9;

/// Measures along `line`, which lies on the first surface, every `step_mm` from its beginning on; `second` is another scan with how far its
/// partners are looked for, mm. `progress` counts stations.
pub fn stations(
    line: &Line<'_>,
    step_mm: f64,
    first: Side<'_>,
    second: Option<(Side<'_>, f64)>,
    progress: &Progress,
) -> Result<Vec<Station>, SectionError> {
    let length_mm = line.length_mm();
    let steps = (length_mm / step_mm + SAME_STEP).floor();
    if !(0.0..MOST_STATIONS).contains(&steps) {
        return Err(SectionError::Steps { length_mm, step_mm });
    }
    // The end of a closed curve is its beginning.
    let is_twice = line.is_closed && steps > 0.0 && length_mm - steps * step_mm <= SAME_STEP * step_mm;
    let count = steps as usize + usize::from(!is_twice);
    progress.begin(count as u64);
    let chunk = |from: usize| -> Result<Vec<Station>, Cancelled> {
        let mut hint = None;
        let mut found = vec![];
        for n in from..(from + CHUNK).min(count) {
            progress.advance(1)?;
            found.extend(station(line, n as f64 * step_mm, first, second, &mut hint));
        }
        Ok(found)
    };
    let chunks = (0..count.div_ceil(CHUNK)).into_par_iter().map(|n| chunk(n * CHUNK)).collect::<Result<Vec<_>, _>>()?;
    Ok(chunks.into_iter().flatten().collect())
}

fn station(
    line: &Line<'_>,
    along_mm: f64,
    first: Side<'_>,
    second: Option<(Side<'_>, f64)>,
    hint: &mut Option<Partner>,
) -> Option<Station> {
    let (point_mm, _) = line.at(along_mm)?;
    let normal = normal_at(first.surface, point_mm);
    let thick = |side: Side<'_>, point: DVec3, normal: DVec3| {
        let least_mm = NO_WALL_VOXEL * spacing_along_mm(side.surface, normal);
        wall(side, point, normal).filter(|(mm, _)| *mm > least_mm)
    };
    let own = thick(first, point_mm, normal);
    let partner = second.and_then(|(side, reach_mm)| Some((side, at(first, side, [point_mm, normal], By::Partner, reach_mm, hint)?)));
    let other = partner.as_ref().and_then(|(side, found)| thick(*side, found.partner, normal_at(side.surface, found.partner)));
    let registered = [first.registered, second.map_or(Registered::default(), |(side, _)| side.registered)];
    let of_both = |mm: f64, ends: [&[EndError]; 2]| {
        let error = of_difference([0, 1].map(|n| Ends { of: ends[n], registered: registered[n] }));
        Length { mm, error_mm: error.error_mm }
    };
    // A wall moves with its scan and with the station on it, wherever that is registered to.
    let of_own = |(mm, ends): &(f64, Vec<EndError>)| {
        let error = of_length(Ends { of: ends, registered: Registered::default() });
        Length { mm: *mm, error_mm: error.error_mm }
    };
    let of_second = |(mm, ends): &(f64, Vec<EndError>)| {
        let error = of_length(Ends { of: ends, registered: registered[1] });
        Length { mm: *mm, error_mm: error.error_mm }
    };
    Some(Station {
        along_mm,
        point_mm,
        normal,
        thickness: own.as_ref().map(of_own),
        second_thickness: other.as_ref().map(of_second),
        thickness_difference: own.as_ref().zip(other.as_ref()).map(|((a, of_a), (b, of_b))| of_both(b - a, [of_a, of_b])),
        surface_difference: partner.as_ref().map(|(_, found)| of_both(found.mm, [&found.ends[0], &found.ends[1]])),
        partner_mm: partner.as_ref().map(|(_, found)| found.partner),
    })
}

/// The outward unit normal that pictures are shaded by, or the interpolant's own where that is none or looks the other way, as it may at a
/// ridge.
fn normal_at(surface: &Surface, point_mm: DVec3) -> DVec3 {
    let own = depth_at(surface, WorldPoint(point_mm)).and_then(|(_, rise)| (-rise).try_normalize());
    let smooth = smooth_normal(surface, surface.grid.index(WorldPoint(point_mm)));
    smooth.filter(|smooth| own.is_none_or(|own| own.dot(*smooth) > 0.0)).or(own).unwrap_or(DVec3::Z)
}
