//! One scan moved onto another: what is asked for, what came of it, and the file that keeps both.

use crate::measurement::{MeasuredScan, Origin};
use crate::opened::Opened;
use crate::record::{VerifyError, open as open_again};
use bregma_field::{Cancelled, Covariance, Progress, Registration, Surface, SurfaceError, TransformError, write_transform};
use bregma_measure::landmarks::Landmark;
use bregma_measure::numbers::{fixed, significant};
use bregma_register::anywhere::{self, Found, LIKELY};
use bregma_register::cloud::{Cloud, LEAST_POINTS, POINTS};
use bregma_register::landmarks::{self, Freedom, LandmarkFitError, Paired};
use bregma_register::surfaces::Pair;
use bregma_register::{Parts, intensities, sureness};
use bregma_renderer::{Layer, named};
use glam::{DAffine3, DVec3};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use std::path::Path;
use thiserror::Error;

named! {
    /// By what two scans are brought together.
    #[derive(Default)]
    pub enum By {
        /// Points of the same names.
        Landmarks = "landmarks",
        /// Their surfaces.
        #[default]
        Surfaces = "surfaces",
        /// Their values around the surfaces, of one object scanned twice.
        Intensities = "intensities",
    }
}

/// A registration to be made of two scans that are open.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Order {
    /// By what.
    pub by: By,
    /// What landmarks may do beside turning and shifting.
    #[serde(default)]
    pub freedom: Freedom,
    /// Landmarks that take no part.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<String>,
    /// What of the fixed scan's surface takes part.
    #[serde(default, skip_serializing_if = "Parts::is_all")]
    pub parts: Parts,
    /// Where surfaces are looked for first, moving scan to fixed scan; anywhere where absent, or where that does not lead to agreement.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start: Option<DAffine3>,
}

/// What came of it.
#[derive(Clone, Debug)]
pub struct Registered {
    /// Moves the moving scan's own world onto the fixed scan's.
    pub registration: Registration,
    /// How well they lie on each other.
    pub report: Report,
}

impl Registered {
    /// The same where the scene has the fixed scan as `fixed`: what the moving scan's layer takes. It errs as the fixed scan's own registration
    /// does, too; where nothing is known of that, as this does. How sure it is is known only where the fixed scan is not stretched.
    pub fn in_scene(&self, fixed: &Layer) -> Registration {
        let Registration { transform, residual_mm, covariance } = &self.registration;
        let moved = covariance.as_ref().and_then(|covariance| covariance.moved(&fixed.transform));
        let covariance = moved.map(|own| fixed.covariance.as_ref().map_or(own.clone(), |of_fixed| own.and(of_fixed)));
        Registration { transform: fixed.transform * *transform, residual_mm: *residual_mm, covariance }
    }
}

/// The first two visible scans whose boxes lie wholly beside each other, where there are two.
pub fn apart(opened: &Opened) -> Option<[usize; 2]> {
    let boxes: Vec<(usize, [DVec3; 2])> = (0..opened.volumes.len())
        .filter(|n| opened.scene.layers[*n].visible)
        .map(|n| {
            let corners = opened.volumes[n].grid().corners_mm().map(|p| opened.scene.layers[n].transform.transform_point3(p));
            (n, [corners.into_iter().fold(DVec3::INFINITY, DVec3::min), corners.into_iter().fold(DVec3::NEG_INFINITY, DVec3::max)])
        })
        .collect();
    let lie_apart = |[low, high]: &[DVec3; 2], other: &[DVec3; 2]| high.cmplt(other[0]).any() || other[1].cmplt(*low).any();
    boxes.iter().enumerate().find_map(|(n, (a, of_a))| boxes[n + 1..].iter().find(|(_, of_b)| lie_apart(of_a, of_b)).map(|(b, _)| [*a, *b]))
}

/// How well two scans lie on each other.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Report {
    /// Pairs of landmarks, with what is left of each.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub landmarks: Vec<Paired>,
    /// Of surfaces.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub surfaces: Option<SurfaceReport>,
    /// Of values, which began where surfaces led.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub intensities: Option<IntensityReport>,
    /// What the person should know.
    pub notes: Vec<String>,
}

/// How well the values of two scans lie on each other.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct IntensityReport {
    /// Correlation of the values around the surfaces that count, −1 to 1.
    pub correlation: f64,
    /// Part of the values that count.
    pub matched: f64,
    /// As far as they moved the middle of the scan from where surfaces led, mm.
    pub moved_mm: f64,
}

/// How well two surfaces lie on each other.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SurfaceReport {
    /// Median distance along normals of partners that count from the middle of all of them, mm.
    pub median_mm: f64,
    /// Standard deviation of what is left between partners along normals, robust, mm.
    pub spread_mm: f64,
    /// How far the moving surface stands out over the fixed one everywhere, mm.
    pub offset_mm: f64,
    /// Part of the points with a partner that counts.
    pub matched: f64,
    /// How much of the surfaces agrees, 0 to 1.5.
    pub agreement: f64,
    /// The same of the next best pose of a search.
    pub runner_up: Option<f64>,
    /// The scans are of two objects, or of one that changed: what is left is more than scanning leaves.
    pub is_of_two: bool,
    /// Standard deviation of where the middle of the moving scan is, along x, y and z, mm; infinite (null in JSON) where it is not held.
    pub middle_mm: DVec3,
    /// How far what is left between partners reaches, for a histogram: mm and the number of partners, by bin.
    #[serde(skip)]
    pub histogram: Vec<(f64, usize)>,
}

/// Why there is no registration.
#[derive(Debug, Error)]
pub enum RegisterError {
    /// Landmarks that make none.
    #[error(transparent)]
    Landmarks(#[from] LandmarkFitError),
    /// A scan without a surface.
    #[error("{scan}: almost nothing of it has a surface at the isovalue {iso}; choose another isovalue")]
    NoSurface {
        /// The scan.
        scan: String,
        /// Its isovalue.
        iso: String,
    },
    /// No partners.
    #[error("no part of the surfaces lies on each other there; take more of the scans, or begin from another pose")]
    Apart,
    /// A grid that cannot be.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// Stopped by request.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The file.
    #[error(transparent)]
    File(#[from] TransformError),
    /// What it was made from.
    #[error(transparent)]
    Made(#[from] VerifyError),
}

/// What scanning leaves between two scans of one object, in voxels: half of one.
const ONE_OBJECT_VOXEL: f64 = 0.5;

/// A runner-up that agrees so nearly as well may be as right.
const AMBIGUOUS: f64 = 0.9;

/// Brings scan number `moving` of what is open onto number `fixed`. `progress` counts what is tried.
pub fn register(opened: &Opened, [moving, fixed]: [usize; 2], order: &Order, progress: &Progress) -> Result<Registered, RegisterError> {
    let opened = &opened.measured();
    match order.by {
        By::Landmarks => by_landmarks(opened, [moving, fixed], order),
        By::Surfaces | By::Intensities => by_surfaces(opened, [moving, fixed], order, progress),
    }
}

/// The landmarks of a scan that is open.
fn landmarks_of(opened: &Opened, n: usize) -> Vec<Landmark> {
    opened.landmarks.iter().filter(|l| l.scan.as_deref() == Some(opened.volumes[n].name())).cloned().collect()
}

fn by_landmarks(opened: &Opened, numbers: [usize; 2], order: &Order) -> Result<Registered, RegisterError> {
    let [moving, fixed] = numbers.map(|n| own_landmarks(opened, n));
    let names = numbers.map(|n| opened.volumes[n].name());
    let fit = landmarks::fit(&moving, &fixed, names, order.freedom, &order.left_out)?;
    let mut notes = fit.notes;
    if order.freedom == Freedom::Similarity {
        notes.push(format!("{} is made {} times as large: lengths on it are not its own", names[0], significant(fit.scale, 5)));
    }
    if order.freedom == Freedom::Affine {
        notes.push(format!("{} is stretched and sheared: lengths on it are not its own", names[0]));
    }
    let registration = Registration { transform: fit.pose, residual_mm: Some(fit.rms_mm), covariance: fit.covariance };
    Ok(Registered { registration, report: Report { landmarks: fit.pairs, notes, ..Report::default() } })
}

/// The landmarks of a scan in its own world: they are kept where the scene puts it.
fn own_landmarks(opened: &Opened, n: usize) -> Vec<Landmark> {
    let back = opened.scene.layers[n].transform.inverse();
    let own = |l: Landmark| Landmark { point_mm: l.point_mm.map(|p| back.transform_point3(p)), ..l };
    landmarks_of(opened, n).into_iter().map(own).collect()
}

fn by_surfaces(opened: &Opened, numbers: [usize; 2], order: &Order, progress: &Progress) -> Result<Registered, RegisterError> {
    let surface = |n: usize| Surface::new(&opened.volumes[n], opened.scene.layers[n].iso, DAffine3::IDENTITY);
    let [of_moving, of_fixed] = [surface(numbers[0])?, surface(numbers[1])?];
    let clouds = [Cloud::of(&of_moving, POINTS, progress)?, Cloud::of(&of_fixed, POINTS, progress)?];
    for (cloud, n) in clouds.iter().zip(numbers) {
        if cloud.points.len() < LEAST_POINTS {
            let iso = significant(opened.scene.layers[n].iso, 6);
            return Err(RegisterError::NoSurface { scan: opened.volumes[n].name().to_owned(), iso });
        }
    }
    let pair = Pair { moving: &clouds[0], fixed: &clouds[1], parts: &order.parts };
    let middle_mm = opened.volumes[numbers[0]].grid().corners_mm().into_iter().sum::<DVec3>() / 8.0;
    let found = anywhere::from(&pair, order.start.and_then(|start| rigid(&start, middle_mm)), progress)?;
    if found.fit.matched() == 0.0 {
        return Err(RegisterError::Apart);
    }
    let alike = (order.by == By::Intensities).then(|| intensities::refine(&pair, found.fit.pose, progress)).transpose()?;
    let last = alike.as_ref().map_or(&found.fit, |alike| &alike.fit);
    let covariance = if alike.is_some() { sureness::of_values(last) } else { sureness::covariance(last) };
    let mut report = report(&found, &covariance, pair.voxel_mm(), order.freedom);
    report.intensities = alike.as_ref().map(|alike| IntensityReport {
        correlation: alike.correlation,
        matched: last.matched(),
        moved_mm: last.centre.distance(found.fit.centre),
    });
    Ok(Registered { registration: Registration { transform: last.pose, residual_mm: None, covariance: Some(covariance) }, report })
}

/// Digits double with each step: a matrix that is stretched a millionfold is orthogonal after so many.
const POLAR_STEPS: usize = 30;

/// The rigid motion nearest to `start` that moves the point `middle_mm` alike, as surfaces keep their sizes; none where `start` mirrors. By
/// Newton's iteration for the polar decomposition (Higham 1986, SIAM J. Sci. Stat. Comput. 7, 1160–1174).
fn rigid(start: &DAffine3, middle_mm: DVec3) -> Option<DAffine3> {
    let turns = start.matrix3.determinant() > 0.0;
    let turn = (0..POLAR_STEPS).fold(start.matrix3, |m, _| 0.5 * (m + m.inverse().transpose()));
    turns.then(|| DAffine3::from_mat3_translation(turn, start.transform_point3(middle_mm) - turn * middle_mm))
}

fn report(found: &Found, covariance: &Covariance, voxel_mm: f64, freedom: Freedom) -> Report {
    let fit = &found.fit;
    let is_of_two = fit.spread_mm > ONE_OBJECT_VOXEL * voxel_mm;
    let mut notes = vec![];
    if freedom != Freedom::Rigid {
        notes.push("surfaces are brought together rigidly: sizes stay".into());
    }
    if found.agreement < LIKELY {
        notes.push(format!(
            "little of the surfaces agrees ({} of 1.5): they may not overlap, or not be alike; look at the pose before you use it",
            fixed(found.agreement, 2)
        ));
    }
    if let Some((agreement, turned_deg)) = found.runner_up.filter(|(agreement, _)| *agreement > AMBIGUOUS * found.agreement) {
        notes.push(format!(
            "another pose, turned by {}° against this one, agrees about as well ({} and {}): surfaces alone do not tell which is right",
            fixed(turned_deg, 0),
            fixed(agreement, 2),
            fixed(found.agreement, 2)
        ));
    }
    notes.extend(
        covariance
            .undetermined
            .iter()
            .map(|motion| format!("nothing holds {}: lengths that it changes have no bound", motion_in_words(motion))),
    );
    if is_of_two {
        notes.push(
            "two objects, or one that changed: the ± of the pose is the spread of what parts of the surface would choose, not an error"
                .into(),
        );
    }
    let along = |axis: DVec3| covariance.variance_at(covariance.centre_mm, axis).sqrt();
    let surfaces = SurfaceReport {
        median_mm: fit.median_mm(),
        spread_mm: fit.spread_mm,
        offset_mm: fit.next.offset_mm,
        matched: fit.matched(),
        agreement: found.agreement,
        runner_up: found.runner_up.map(|(agreement, _)| agreement),
        is_of_two,
        middle_mm: DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z)),
        histogram: histogram(fit.rows.iter().map(|r| r.off_mm), fit.spread_mm),
    };
    Report { surfaces: Some(surfaces), notes, ..Report::default() }
}

/// Numbers within six spreads of zero, in 48 bins: the middle of each and how many it holds.
fn histogram(numbers: impl Iterator<Item = f64>, spread: f64) -> Vec<(f64, usize)> {
    const BINS: usize = 48;
    let width = 12.0 * spread / BINS as f64;
    let mut bins: Vec<(f64, usize)> = (0..BINS).map(|n| ((n as f64 + 0.5) * width - 6.0 * spread, 0)).collect();
    for n in numbers.map(|v| (v + 6.0 * spread) / width).filter(|n| (0.0..BINS as f64).contains(n)) {
        bins[n as usize].1 += 1;
    }
    bins
}

/// "a turn about (0, 0, 1)", or "a shift along" it.
fn motion_in_words(motion: &[f64; 6]) -> String {
    let (turn, shift) = (DVec3::from_slice(&motion[..3]), DVec3::from_slice(&motion[3..]));
    // Undetermined motions are of length 1, a turn counting as far as it moves the scan's points.
    let is_shift = shift.length_squared() > 0.5;
    let v = if is_shift { shift } else { turn }.normalize_or_zero();
    let words = if is_shift { "a shift along" } else { "a turn about" };
    format!("{words} ({}, {}, {})", fixed(v.x, 2), fixed(v.y, 2), fixed(v.z, 2))
}

/// Writes a registration of two scans that are open, in the form that its name asks for; JSON says by what it was made and from what.
pub fn write(
    file: &Path,
    opened: &Opened,
    [moving, fixed]: [usize; 2],
    order: &Order,
    registered: &Registered,
) -> Result<(), RegisterError> {
    let names = [moving, fixed].map(|n| opened.volumes[n].name());
    Ok(write_transform(file, Some(names), &registered.registration, record(opened, [moving, fixed], order, registered))?)
}

fn record(opened: &Opened, numbers: [usize; 2], order: &Order, registered: &Registered) -> Map<String, Value> {
    let mut record = Map::new();
    record.insert("method".into(), json!(order));
    record.insert("report".into(), json!(registered.report));
    if let Some(origin) = Origin::of(opened) {
        let scan = |n: usize| MeasuredScan { layer: opened.scene.layers[n].clone(), ..origin.scans[n].clone() };
        let scans: Vec<MeasuredScan> = numbers.into_iter().map(scan).collect();
        record.insert("made_by".into(), json!(Origin { scans, clips: vec![], ..origin.clone() }));
    }
    record
}

/// What became of a registration that was made again.
#[derive(Clone, Debug, PartialEq)]
pub struct Again {
    /// The scans, as the file names them.
    pub what: String,
    /// As far as it moves a corner of the moving scan's box otherwise than recorded, mm.
    pub off_mm: f64,
}

/// A record of how a registration was made.
#[derive(Deserialize)]
struct Recorded {
    method: Order,
    made_by: Origin,
    report: RecordedReport,
}

/// What of a report a registration is made again from.
#[derive(Deserialize)]
struct RecordedReport {
    #[serde(default)]
    landmarks: Vec<RecordedPair>,
}

#[derive(Deserialize)]
struct RecordedPair {
    name: String,
    moving_mm: DVec3,
    fixed_mm: DVec3,
}

impl Recorded {
    /// The scans and landmarks as they were, each scan in its own world.
    fn open(&self, folder: &Path) -> Result<Opened, RegisterError> {
        let mut opened = open_again(&self.made_by, folder)?;
        opened.scene.layers.iter_mut().zip(&self.made_by.scans).for_each(|(layer, scan)| layer.iso = scan.layer.iso);
        let names = [0, 1].map(|n: usize| opened.volumes.get(n).map(|v| v.name().to_owned()));
        for pair in &self.report.landmarks {
            for (point, scan) in [pair.moving_mm, pair.fixed_mm].into_iter().zip(&names) {
                opened.landmarks.push(Landmark { scan: scan.clone(), ..Landmark::at(pair.name.clone(), point) });
            }
        }
        Ok(opened)
    }
}

/// Poses are the same to this, mm: the last digits depend on how a compiler orders sums, and a search rests within a thousandth of a voxel.
pub const SAME_POSE_MM: f64 = 1e-6;

/// Makes the registrations of a file again, from the scans that it names; those that do not say how they were made are told by their names.
pub fn again(file: &Path, progress: &Progress) -> Result<(Vec<Again>, Vec<String>), RegisterError> {
    let text = std::fs::read_to_string(file).unwrap_or_default();
    let value: Value = serde_json::from_str(&text).unwrap_or_default();
    let (mut found, mut unknown) = (vec![], vec![]);
    let pairs = value.get("pairs").and_then(Value::as_object).cloned().unwrap_or_default();
    if pairs.is_empty() {
        unknown.push("it".to_owned());
    }
    for (what, pair) in pairs {
        let Ok(recorded) = Recorded::deserialize(&pair) else {
            unknown.push(what);
            continue;
        };
        let opened = recorded.open(file.parent().unwrap_or(Path::new("")))?;
        let now = register(&opened, [0, 1], &recorded.method, progress)?.registration.transform;
        let name = format!("{}#{what}", file.display());
        let was = bregma_field::read_transform(Path::new(&name), "", &[])?.transform;
        let corners = opened.volumes[0].grid().corners_mm();
        let off_mm = corners.map(|p| now.transform_point3(p).distance(was.transform_point3(p))).into_iter().fold(0.0, f64::max);
        found.push(Again { what, off_mm });
    }
    Ok((found, unknown))
}
