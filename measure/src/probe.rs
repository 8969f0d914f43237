//! Casting the difference ray: one ray through every volume, its crossings, its bone segments with their lengths and errors, their differences,
//! and the ledger of who is inside where.

use crate::edge::{Edge, spacing_along_mm};
use crate::record::{CrossingRecord, DifferenceRay, LedgerEntry, Meets, RayRecord, Segment, VolumeRecord};
use crate::stretches::pairs;
use crate::threshold::unlike_thresholds;
use crate::uncertainty::{self, End, Ends, Registered};
use bregma_field::crossings::{self, Crossing, Kind};
use bregma_field::{Clip, Measured, Ray, Surface, SurfaceError, Unit, Volume};
use glam::DAffine3;
use std::sync::Arc;

/// The tolerance where values are HU: about what another kernel, or another scanner's calibration, moves a bone's edge by.
const ISO_TOLERANCE_HU: f64 = 50.0;
/// Elsewhere: this part of the step from air to bone, taken as the step between Otsu's two classes.
const ISO_TOLERANCE_OF_STEP: f64 = 0.05;

/// The change of isovalue that a threshold error stands for: 50 HU, or 5 % of the bone–air step; and as much more as values are off by in a scan
/// that was saved so: no value between samples is farther off than these, so that its surface lies between those of the isovalues as far away.
pub fn iso_tolerance(volume: &Volume) -> f64 {
    let of_scanner = match volume.unit() {
        Unit::Hounsfield => ISO_TOLERANCE_HU,
        Unit::Value => ISO_TOLERANCE_OF_STEP * volume.otsu_step().unwrap_or(0.0),
    };
    of_scanner + volume.kept().error
}

/// Casts the difference ray through the whole bone of the visible ones of `volumes`, as `measured` has one for each, in float64.
///
/// ```
/// use bregma_field::{Measured, Ray, WorldPoint};
/// use bregma_synthetic::{Which, skull};
/// use glam::{DAffine3, DVec3};
/// use std::sync::Arc;
///
/// let volumes = [Arc::new(skull(Which::A, 48, &Default::default())?)];
/// let bone = Measured { iso: 226.0, transform: DAffine3::IDENTITY, residual_mm: None, covariance: None, visible: true, solid: None };
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
) -> Result<DifferenceRay, SurfaceError> {
    cast(volumes, measured, None, ray)
}

/// The same through what `clips` leave of them. Bone that a cut goes through is closed there, and clipped.
pub fn probe_cut(
    volumes: &[Arc<Volume>],
    measured: impl IntoIterator<Item = impl Into<Measured>>,
    clips: &[Clip],
    ray: &Ray,
) -> Result<DifferenceRay, SurfaceError> {
    cast(volumes, measured, Some(clips), ray)
}

/// What was corrected of where a scan lies, each a sentence that names it.
pub fn corrections(volume: &Volume) -> Vec<String> {
    volume.placing().notes().into_iter().map(|note| format!("{}: {note}", volume.name())).collect()
}

/// That a scan is shown as its mirror image, where what moves it mirrors it.
pub fn mirrored(name: &str, transform: &DAffine3) -> Option<String> {
    let is_mirrored = transform.matrix3.determinant() < 0.0;
    is_mirrored.then(|| format!("{name}: is a mirror image by its registration: its left side lies on the right"))
}

fn cast(
    volumes: &[Arc<Volume>],
    measured: impl IntoIterator<Item = impl Into<Measured>>,
    clips: Option<&[Clip]>,
    ray: &Ray,
) -> Result<DifferenceRay, SurfaceError> {
    let visible: Vec<(usize, (&Arc<Volume>, Measured))> =
        volumes.iter().zip(measured.into_iter().map(Into::into)).enumerate().filter(|(_, (_, measured))| measured.visible).collect();
    let of_scan = |(volume, measured): &(&Arc<Volume>, Measured)| {
        corrections(volume).into_iter().chain(mirrored(volume.name(), &measured.transform)).collect::<Vec<_>>()
    };
    let corrections: Vec<String> = visible.iter().flat_map(|(_, scan)| of_scan(scan)).collect();
    let records = visible.into_iter().map(|(index, (volume, measured))| {
        let whole = Surface::new(volume, measured.iso, measured.transform)?.within(measured.solid.clone());
        let left = clips.map(|clips| whole.clone().cut(clips, index)).filter(|left| !left.region.is_all());
        Ok(VolumeRecord { index, ..record(&whole, left.as_ref(), &measured, ray) })
    });
    let volumes = unique_names(records.collect::<Result<Vec<_>, SurfaceError>>()?);
    let thresholds: Vec<(&str, f64, Unit)> = volumes.iter().map(|v| (v.name.as_str(), v.iso, v.unit)).collect();
    Ok(DifferenceRay {
        ray: RayRecord { origin_mm: ray.origin.0.to_array(), direction: ray.direction.to_array() },
        as_cut: clips.is_some(),
        notes: unlike_thresholds(&thresholds).into_iter().chain(corrections).collect(),
        pairs: pairs(&volumes),
        ledger: ledger(&volumes),
        volumes,
    })
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

/// What the ray meets in the `whole` surface, or in what cuts `left` of it.
fn record(whole: &Surface, left: Option<&Surface>, measured: &Measured, ray: &Ray) -> VolumeRecord {
    let volume = &whole.volume;
    let surface = left.unwrap_or(whole);
    let iso_tolerance = iso_tolerance(volume);
    let crossings = crossings::crossings(surface, ray);
    let whole_box_mm = crossings::box_span(whole, ray).map(|span| span.t_mm);
    let mut segments = segments(surface, measured, ray, &crossings, iso_tolerance);
    if left.is_some() || whole.solid.is_some() {
        // A cut, or the face of a part, moves an end away from the scan's own.
        let is_cut = |t_mm: f64| whole_box_mm.is_some_and(|ends| !ends.contains(&t_mm));
        let clipped = |t_mm: f64| crossings.iter().any(|c| c.clipped && c.t_mm == t_mm);
        segments.iter_mut().for_each(|s| s.cut = [s.from_mm, s.to_mm].into_iter().any(|t| clipped(t) && is_cut(t)));
    }
    let bone_is_cut_away = || left.is_some() && crossings::first_wall(whole, ray).is_some();
    let meets = match segments[..] {
        [_, ..] => Meets::Bone,
        [] if whole_box_mm.is_none() => Meets::Nothing,
        [] if bone_is_cut_away() => Meets::CutAway,
        [] => Meets::NoBone,
    };
    VolumeRecord {
        name: volume.name().to_owned(),
        spacing_mm: volume.grid().spacing_mm().to_array(),
        stated_spacing_mm: volume.placing().overridden_mm().map(|mm| mm.to_array()),
        turn: Some(volume.placing().correction().turn).filter(|turn| !turn.is_none()),
        iso: measured.iso,
        unit: volume.unit(),
        iso_tolerance,
        box_mm: crossings::box_span(surface, ray).map(|s| s.t_mm),
        meets,
        segments,
        crossings: crossings.iter().map(|c| crossing_record(surface, iso_tolerance, c)).collect(),
        index: 0,
        residual_mm: measured.residual_mm,
        covariance: measured.covariance.clone(),
        is_moved: measured.transform != DAffine3::IDENTITY,
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
    // Bone beside a part is none of its own, and bounds the gap all the same.
    let of_all = surface.solid.as_ref().map(|_| crossings::crossings(&surface.clone().within(None), ray));
    let all: Vec<&Crossing> = of_all.as_deref().unwrap_or(crossings).iter().filter(|c| c.kind != Kind::Touch).collect();
    let end = |n: usize| {
        let crossing = ends[n];
        let cut = crossing.clipped || crossing.at_origin;
        let cosine = crossing.normal.dot(ray.direction).abs();
        let half_mm = |other: Option<&&Crossing>| other.map_or(f64::INFINITY, |other| 0.5 * (other.t_mm - crossing.t_mm).abs());
        let beside =
            |other: Option<&&Crossing>| (cosine * half_mm(other)).max(LEAST_REACH_VOXEL * spacing_along_mm(surface, crossing.normal));
        // The bone lies behind an entry, and before an exit.
        let (wall, gap) = if n.is_multiple_of(2) {
            (ends.get(n + 1), all.iter().rfind(|c| c.t_mm < crossing.t_mm))
        } else {
            (ends.get(n - 1), all.iter().find(|c| c.t_mm > crossing.t_mm))
        };
        let edge = || Edge::at(surface, crossings::world(surface, crossing).0, crossing.normal, beside(wall), beside(gap));
        End { crossing, edge: if cut { None } else { edge() }, reach_mm: half_mm(wall).min(half_mm(gap)) }
    };
    let registered = Registered { residual_mm: measured.residual_mm, covariance: measured.covariance.as_ref() };
    let segment = |n: usize| {
        let [enter, exit] = [end(2 * n), end(2 * n + 1)];
        let length_mm = exit.crossing.t_mm - enter.crossing.t_mm;
        let obliquity_deg = [enter, exit].map(|end| end.obliquity_deg(ray));
        let along_ray_mm = |end: End<'_>| end.resolution_mm(surface) / end.cosine(ray).max(f64::EPSILON);
        let resolution_mm = [enter, exit].into_iter().filter(End::is_boundary).map(along_ray_mm).fold(0.0, f64::max);
        let ends = uncertainty::of_ends(surface, measured.iso, tolerance, ray, [enter, exit]);
        Segment {
            from_mm: enter.crossing.t_mm,
            to_mm: exit.crossing.t_mm,
            length_mm,
            uncertainty: uncertainty::of_length(Ends { of: &ends, registered }),
            obliquity_deg,
            half_maximum_mm: half_maximum_mm(surface, ray, [enter, exit]),
            resolution_mm,
            clipped: enter.crossing.clipped || exit.crossing.clipped,
            from_origin: enter.crossing.at_origin,
            below_resolution: length_mm < resolution_mm,
            cut: false,
            ends,
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
