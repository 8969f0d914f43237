//! The difference ray: one ray through every volume, its crossings, its bone segments with their lengths and errors, and the
//! ledger of who is inside where.

use crate::edge::{Edge, spacing_along_mm};
use crate::uncertainty::{self, End, Uncertainty};
use bregma_field::crossings::{self, Crossing, Kind};
use bregma_field::{Clip, GridError, Measured, Ray, Surface, Unit, Volume};
use serde::Serialize;
use std::sync::Arc;

/// The whole answer. Serialises to the agreed JSON (see the guide).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DifferenceRay {
    /// The ray that was cast.
    pub ray: RayRecord,
    /// One for each volume, in order.
    pub volumes: Vec<VolumeRecord>,
    /// Who is inside where, over the union of the boxes, without gaps or overlaps.
    pub ledger: Vec<LedgerEntry>,
}

/// A ray as it is written down.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RayRecord {
    /// LPS mm.
    pub origin_mm: [f64; 3],
    /// Unit.
    pub direction: [f64; 3],
}

/// What the ray meets in one volume.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VolumeRecord {
    /// Its name.
    pub name: String,
    /// Isovalue, in the volume's values.
    pub iso: f64,
    /// HU or value.
    pub unit: Unit,
    /// Change of the isovalue that the threshold error stands for, in values.
    pub iso_tolerance: f64,
    /// First and last t within the box of the scan, or what cuts leave of it; `None` where the ray misses that.
    pub box_mm: Option<[f64; 2]>,
    /// In order.
    pub crossings: Vec<CrossingRecord>,
    /// Stretches of bone, in order.
    pub segments: Vec<Segment>,
}

/// One crossing of the isosurface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CrossingRecord {
    /// Distance from the ray's origin.
    pub t_mm: f64,
    /// Enter, exit or touch.
    pub kind: Kind,
    /// Lowest sample of its cell.
    pub cell: [usize; 3],
    /// LPS mm.
    pub point_mm: [f64; 3],
    /// Outward unit normal, LPS.
    pub normal: [f64; 3],
    /// Bracket of the root.
    pub error_mm: f64,
    /// How far the crossing moves when the isovalue changes by the tolerance: δiso / |∂f/∂t|; 0 where bone is cut rather than
    /// bounded, infinite (null in JSON) where the value does not change along the ray.
    pub threshold_error_mm: f64,
    /// At a face of the volume rather than on the isosurface.
    pub clipped: bool,
    /// At the ray's origin, which lies in bone.
    pub at_origin: bool,
}

/// One stretch of bone.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Segment {
    /// Where it begins.
    pub from_mm: f64,
    /// Where it ends.
    pub to_mm: f64,
    /// Its length.
    pub length_mm: f64,
    /// How far that may be from the truth.
    #[serde(flatten)]
    pub uncertainty: Uncertainty,
    /// Angle between the ray and the normal at each end, degrees: at 60 a wall is measured at twice its thickness.
    pub obliquity_deg: [f64; 2],
    /// Its length between the places where the value is halfway between the plateaus beside each end; null where the scan shows none.
    pub half_maximum_mm: Option<f64>,
    /// The thinnest wall that this scan can show here, along the ray.
    pub resolution_mm: f64,
    /// It begins or ends at a face of the volume.
    pub clipped: bool,
    /// It begins at the ray's origin, which lies in bone.
    pub from_origin: bool,
    /// Thinner than the resolution: a threshold cannot measure it.
    pub below_resolution: bool,
}

/// A stretch of the ray and the volumes whose bone it is in.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LedgerEntry {
    /// Where it begins.
    pub from_mm: f64,
    /// Where it ends.
    pub to_mm: f64,
    /// Its length.
    pub length_mm: f64,
    /// Names of the volumes; empty in a gap.
    pub inside: Vec<String>,
}

/// The tolerance where values are HU: about what another kernel, or another scanner's calibration, moves a bone's edge by.
const ISO_TOLERANCE_HU: f64 = 50.0;
/// Elsewhere: this part of the step from air to bone, taken as the step between Otsu's two classes.
const ISO_TOLERANCE_OF_STEP: f64 = 0.05;

/// The change of isovalue that a threshold error stands for: 50 HU, or 5 % of the bone–air step.
pub fn iso_tolerance(volume: &Volume) -> f64 {
    match volume.unit() {
        Unit::Hounsfield => ISO_TOLERANCE_HU,
        Unit::Value => ISO_TOLERANCE_OF_STEP * volume.otsu_step().unwrap_or(0.0),
    }
}

/// Casts the difference ray through the visible ones of `volumes`, as `measured` has one for each, in float64.
///
/// ```
/// use bregma_field::{Measured, Ray, WorldPoint};
/// use bregma_synthetic::{Which, skull};
/// use glam::{DAffine3, DVec3};
/// use std::sync::Arc;
///
/// let volumes = [Arc::new(skull(Which::A, 48, &Default::default())?)];
/// let bone = Measured { iso: 226.0, transform: DAffine3::IDENTITY, residual_mm: None, visible: true };
/// // From anterior through the frontal bone.
/// let ray = Ray::new(WorldPoint(DVec3::new(0.0, -150.0, 40.0)), DVec3::Y).expect("that is a direction");
/// let found = bregma_measure::probe(&volumes, [bone], &ray)?;
/// let frontal = &found.volumes[0].segments[0];
/// println!("{:.1} ± {:.1} mm", frontal.length_mm, frontal.uncertainty.error_mm);
/// assert!(frontal.length_mm > 3.0 && frontal.length_mm < 15.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn probe(
    volumes: &[Arc<Volume>],
    measured: impl IntoIterator<Item = impl Into<Measured>>,
    ray: &Ray,
) -> Result<DifferenceRay, GridError> {
    probe_cut(volumes, measured, &[], ray)
}

/// The same through what `clips` leave of them. Bone that a cut goes through is closed there, and clipped.
pub fn probe_cut(
    volumes: &[Arc<Volume>],
    measured: impl IntoIterator<Item = impl Into<Measured>>,
    clips: &[Clip],
    ray: &Ray,
) -> Result<DifferenceRay, GridError> {
    let visible = volumes.iter().zip(measured.into_iter().map(Into::into)).enumerate().filter(|(_, (_, measured))| measured.visible);
    let records = visible.map(|(n, (volume, measured))| {
        let surface = Surface::new(volume, measured.iso, measured.transform)?.cut(clips, n);
        Ok(record(&surface, &measured, ray))
    });
    let volumes = unique_names(records.collect::<Result<Vec<_>, GridError>>()?);
    let ledger = ledger(&volumes);
    let ray = RayRecord { origin_mm: ray.origin.0.to_array(), direction: ray.direction.to_array() };
    Ok(DifferenceRay { ray, volumes, ledger })
}

/// The ledger tells volumes apart by name: the second of two equal names gets its number.
fn unique_names(mut volumes: Vec<VolumeRecord>) -> Vec<VolumeRecord> {
    for n in 1..volumes.len() {
        if volumes[..n].iter().any(|v| v.name == volumes[n].name) {
            volumes[n].name = format!("{} ({})", volumes[n].name, n + 1);
        }
    }
    volumes
}

fn record(surface: &Surface, measured: &Measured, ray: &Ray) -> VolumeRecord {
    let volume = &surface.volume;
    let iso_tolerance = iso_tolerance(volume);
    let crossings = crossings::crossings(surface, ray);
    VolumeRecord {
        name: volume.name().to_owned(),
        iso: measured.iso,
        unit: volume.unit(),
        iso_tolerance,
        box_mm: crossings::box_span(surface, ray).map(|s| s.t_mm),
        segments: segments(surface, measured, ray, &crossings, iso_tolerance),
        crossings: crossings.iter().map(|c| crossing_record(surface, iso_tolerance, c)).collect(),
    }
}

fn crossing_record(surface: &Surface, iso_tolerance: f64, crossing: &Crossing) -> CrossingRecord {
    let value_per_mm = (crossing.slope_per_mm * surface.volume.slope()).abs();
    CrossingRecord {
        t_mm: crossing.t_mm,
        kind: crossing.kind,
        cell: crossing.cell.to_array(),
        point_mm: crossings::world(surface, crossing).0.to_array(),
        normal: crossing.normal.to_array(),
        error_mm: crossing.error_mm,
        threshold_error_mm: if crossing.clipped || crossing.at_origin { 0.0 } else { iso_tolerance / value_per_mm },
        clipped: crossing.clipped,
        at_origin: crossing.at_origin,
    }
}

/// Samples beyond the middle of a wall, or of a gap, belong to the next boundary; but those of this voxel always belong to this one.
const LEAST_REACH_VOXEL: f64 = 0.75;

fn segments(surface: &Surface, measured: &Measured, ray: &Ray, crossings: &[Crossing], tolerance: f64) -> Vec<Segment> {
    // Entries and exits alternate, beginning with an entry (`crossings::crossings`).
    let ends: Vec<&Crossing> = crossings.iter().filter(|c| c.kind != Kind::Touch).collect();
    let end = |n: usize| {
        let crossing = ends[n];
        let cut = crossing.clipped || crossing.at_origin;
        let cosine = crossing.normal.dot(ray.direction).abs();
        let half_mm = |other: Option<&&Crossing>| other.map_or(f64::INFINITY, |other| 0.5 * (other.t_mm - crossing.t_mm).abs());
        let beside =
            |other: Option<&&Crossing>| (cosine * half_mm(other)).max(LEAST_REACH_VOXEL * spacing_along_mm(surface, crossing.normal));
        // The bone lies behind an entry, and before an exit.
        let (wall, gap) = if n.is_multiple_of(2) {
            (ends.get(n + 1), n.checked_sub(1).and_then(|n| ends.get(n)))
        } else {
            (ends.get(n - 1), ends.get(n + 1))
        };
        let edge = || Edge::at(surface, crossings::world(surface, crossing).0, crossing.normal, beside(wall), beside(gap));
        End { crossing, edge: if cut { None } else { edge() }, reach_mm: half_mm(wall).min(half_mm(gap)) }
    };
    let segment = |n: usize| {
        let [enter, exit] = [end(2 * n), end(2 * n + 1)];
        let length_mm = exit.crossing.t_mm - enter.crossing.t_mm;
        let obliquity_deg = [enter, exit].map(|end| end.obliquity_deg(ray));
        let along_ray_mm = |end: End<'_>| end.resolution_mm(surface) / end.cosine(ray).max(f64::EPSILON);
        let resolution_mm = [enter, exit].into_iter().filter(End::is_boundary).map(along_ray_mm).fold(0.0, f64::max);
        Segment {
            from_mm: enter.crossing.t_mm,
            to_mm: exit.crossing.t_mm,
            length_mm,
            uncertainty: uncertainty::of_length(surface, measured.iso, tolerance, ray, [enter, exit], measured.residual_mm),
            obliquity_deg,
            half_maximum_mm: half_maximum_mm(surface, ray, [enter, exit]),
            resolution_mm,
            clipped: enter.crossing.clipped || exit.crossing.clipped,
            from_origin: enter.crossing.at_origin,
            below_resolution: length_mm < resolution_mm,
        }
    };
    (0..ends.len() / 2).map(segment).collect()
}

/// The length between the half-maximum boundaries: at each end the crossing of that end's own middle that is nearest to it, if there is one
/// before the middle of the wall, or of the gap, behind which lie others'.
fn half_maximum_mm(surface: &Surface, ray: &Ray, ends: [End<'_>; 2]) -> Option<f64> {
    let at = |end: &End<'_>| {
        let level = surface.volume.sample_of(end.edge?.middle());
        let crossings = crossings::crossings(&Surface { level, ..surface.clone() }, ray);
        let same = crossings.iter().filter(|c| c.kind == end.crossing.kind && !c.clipped && !c.at_origin);
        let away = |t_mm: f64| (t_mm - end.crossing.t_mm).abs();
        same.map(|c| c.t_mm).filter(|t| away(*t) < end.reach_mm).min_by(|a, b| away(*a).total_cmp(&away(*b)))
    };
    Some(at(&ends[1])? - at(&ends[0])?)
}

/// Cuts the union of the boxes wherever a box or a segment begins or ends.
fn ledger(volumes: &[VolumeRecord]) -> Vec<LedgerEntry> {
    let boxes = volumes.iter().filter_map(|v| v.box_mm);
    let Some((first, last)) = boxes.map(|[a, b]| (a, b)).reduce(|x, y| (x.0.min(y.0), x.1.max(y.1))) else { return vec![] };
    let mut cuts = vec![first, last];
    cuts.extend(volumes.iter().flat_map(|v| &v.segments).flat_map(|s| [s.from_mm, s.to_mm]));
    cuts.sort_by(f64::total_cmp);
    cuts.dedup();
    let mut ledger: Vec<LedgerEntry> = Vec::new();
    for pair in cuts.windows(2) {
        let (from_mm, to_mm) = (pair[0], pair[1]);
        let is_in = |v: &&VolumeRecord| v.segments.iter().any(|s| s.from_mm <= from_mm && to_mm <= s.to_mm);
        let inside = volumes.iter().filter(is_in).map(|v| v.name.clone()).collect();
        ledger.push(LedgerEntry { from_mm, to_mm, length_mm: to_mm - from_mm, inside });
    }
    ledger
}
