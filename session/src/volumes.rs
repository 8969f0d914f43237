//! Volumes of bone and of cavities of what is open, their tables, and their records that can be made again.

use crate::measurement::Origin;
use crate::opened::Opened;
use crate::record::{VerifyError, made, open};
use bregma_field::{Clip, Measured, Progress};
use bregma_measure::csv::Made;
use bregma_measure::numbers::{at_most, significant};
use bregma_measure::volumes::cavity::{Cavity, MeasuredCavity, cavity};
use bregma_measure::volumes::{Limits, Measure, MeasuredBone, Volumes, VolumesError, bone};
use serde::{Deserialize, Serialize};
use std::path::Path;
use thiserror::Error;

/// What is to be measured: cavities of each scan where some are named, else the bone of one scan, or of two.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Order {
    /// Only what these leave.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub clips: Vec<Clip>,
    /// Bone and cavities are closed at the scan's box, where that cuts them.
    #[serde(default)]
    pub open: bool,
    /// The cavities.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cavities: Vec<Cavity>,
}

/// What was measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Found {
    /// Bone.
    Bone(Volumes),
    /// Cavities, by scans and then in order.
    Cavities {
        /// Each.
        cavities: Vec<MeasuredCavity>,
    },
}

/// Measures the volumes that `order` asks of what is open.
pub fn measure(opened: &Opened, order: &Order, progress: &Progress) -> Result<Found, VolumesError> {
    let measured: Vec<Measured> = opened.scene.layers.iter().map(Measured::from).collect();
    let limits = Limits { clips: order.clips.clone(), open: order.open };
    if order.cavities.is_empty() {
        return Ok(Found::Bone(bone(&opened.volumes, &measured, &limits, progress)?));
    }
    let of_scan = |n: usize| {
        let measured = &measured[n];
        let limits = &limits;
        order.cavities.iter().map(move |one| cavity(&opened.volumes[n], measured, one, limits, n, progress))
    };
    let cavities = (0..opened.volumes.len()).flat_map(of_scan).collect::<Result<_, _>>()?;
    Ok(Found::Cavities { cavities })
}

impl Found {
    /// Each volume, with the scans that it is of.
    pub fn measures(&self) -> Vec<(&Measure, Vec<&MeasuredBone>)> {
        match self {
            Self::Bone(found) => {
                let scans = |n: usize| if n < 2 { vec![&found.scans[n]] } else { found.scans.iter().collect() };
                found.measures.iter().enumerate().map(|(n, measure)| (measure, scans(n))).collect()
            }
            Self::Cavities { cavities } => cavities.iter().map(|found| (&found.measure, vec![&found.scan])).collect(),
        }
    }

    /// What is unusual.
    pub fn notes(&self) -> &[String] {
        match self {
            Self::Bone(found) => &found.notes,
            Self::Cavities { .. } => &[],
        }
    }
}

/// A record of volumes, one line of JSON: what was measured, on what, and what was found.
pub fn record(opened: &Opened, order: &Order, found: &Found) -> String {
    let record = Record { volumes_of: order, made_by: Origin::of(opened), found };
    serde_json::to_string(&record).expect("a record has only numbers, texts and lists") + "\n"
}

#[derive(Serialize)]
struct Record<'a> {
    volumes_of: &'a Order,
    #[serde(skip_serializing_if = "Option::is_none")]
    made_by: Option<Origin>,
    #[serde(flatten)]
    found: &'a Found,
}

/// What of a record volumes are measured again from.
#[derive(Debug, Deserialize)]
pub struct Recorded {
    volumes_of: Order,
    made_by: Option<Origin>,
    #[serde(default)]
    measures: Vec<RecordedMeasure>,
    #[serde(default)]
    cavities: Vec<RecordedCavity>,
}

#[derive(Clone, Debug, Deserialize)]
struct RecordedMeasure {
    what: String,
    volume_mm3: f64,
}

#[derive(Clone, Debug, Deserialize)]
struct RecordedCavity {
    measure: RecordedMeasure,
}

/// The record of volumes that a file is; none where it is something else.
pub fn recorded(file: &Path) -> Option<Recorded> {
    let text = std::fs::read_to_string(file).ok()?;
    serde_json::from_str(&text).ok()
}

/// Volumes are the same to this part of themselves: the last digits depend on how a compiler orders sums.
const SAME: f64 = 1e-9;

/// A recorded volume, measured again.
#[derive(Clone, Debug, PartialEq)]
pub struct Again {
    /// Of what.
    pub what: String,
    /// As recorded, mm³.
    pub was_mm3: f64,
    /// Now, mm³; none where there is no such volume any more.
    pub is_mm3: Option<f64>,
}

impl Again {
    /// Whether it is the same.
    pub fn holds(&self) -> bool {
        // A volume of nothing is rounding: the cubic micrometre is far below what any scan shows.
        self.is_mm3.is_some_and(|is| (is - self.was_mm3).abs() <= SAME * self.was_mm3.abs().max(1.0))
    }
}

/// Why volumes cannot be measured again.
#[derive(Debug, Error)]
pub enum AgainError {
    /// What they were made from.
    #[error(transparent)]
    Made(#[from] VerifyError),
    /// They are not known now.
    #[error(transparent)]
    Volumes(#[from] VolumesError),
}

/// Measures the volumes of a record again, from the scans that it names; those beside it in `folder` count, too.
pub fn again(recorded: &Recorded, folder: &Path, progress: &Progress) -> Result<Vec<Again>, AgainError> {
    let origin = recorded.made_by.as_ref().ok_or_else(|| VerifyError::NoOrigin("the record of volumes".into()))?;
    let mut opened = open(origin, folder)?;
    opened.scene.layers = origin.scans.iter().map(|scan| scan.layer.clone()).collect();
    let found = measure(&opened, &recorded.volumes_of, progress)?;
    let now = found.measures();
    let was = recorded.measures.iter().chain(recorded.cavities.iter().map(|cavity| &cavity.measure));
    let judged = was.enumerate().map(|(n, was)| {
        let is_mm3 = now.get(n).map(|(measure, _)| measure.volume_mm3);
        Again { what: was.what.clone(), was_mm3: was.volume_mm3, is_mm3 }
    });
    Ok(judged.collect())
}

/// The columns of a table of volumes.
const COLUMNS: [&str; 18] = [
    "kind",
    "volume",
    "volume_mm3",
    "error_mm3",
    "sum_error_mm3",
    "threshold_error_mm3",
    "noise_error_mm3",
    "registration_error_mm3",
    "blur_error_mm3",
    "unblurred_mm3",
    "unblurred_error_mm3",
    "area_mm2",
    "per_isovalue_mm3",
    "isovalue",
    "isovalue_tolerance",
    "note",
    "program",
    "date",
];

/// Volumes as CSV, in the style of [`bregma_measure::csv`]: a row for each.
pub fn csv(opened: &Opened, found: &Found) -> String {
    let made = made(opened);
    let kind = if matches!(found, Found::Bone(_)) { "bone" } else { "cavity" };
    let rows = found.measures().into_iter().map(|(measure, scans)| row(kind, measure, &scans, &made, found.notes()));
    std::iter::once(COLUMNS.join(",") + "\n").chain(rows).collect()
}

fn row(kind: &str, measure: &Measure, scans: &[&MeasuredBone], made: &Made, notes: &[String]) -> String {
    // Six decimals of a cubic millimetre are the volume of a cell of a hundredth of one.
    let mm3 = |v: f64| at_most(v, 6);
    let each = |value: &dyn Fn(&MeasuredBone) -> f64| scans.iter().map(|scan| significant(value(scan), 9)).collect::<Vec<_>>().join(" + ");
    let u = &measure.uncertainty;
    let fields = [
        kind.to_owned(),
        measure.what.clone(),
        mm3(measure.volume_mm3),
        mm3(u.error_mm3),
        mm3(u.sum_error_mm3),
        mm3(u.threshold_error_mm3),
        mm3(u.noise_error_mm3),
        u.registration_error_mm3.map(mm3).unwrap_or_default(),
        mm3(u.blur_error_mm3),
        mm3(measure.unblurred_mm3),
        mm3(measure.unblurred_error_mm3),
        mm3(measure.area_mm2),
        mm3(measure.per_isovalue_mm3),
        each(&|scan| scan.iso),
        each(&|scan| scan.iso_tolerance),
        notes.join("; "),
        made.program.clone(),
        made.date.clone(),
    ];
    let quoted = |field: &String| {
        let breaks = field.contains([',', '"', '\n']);
        if breaks { format!("\"{}\"", field.replace('"', "\"\"")) } else { field.clone() }
    };
    fields.iter().map(quoted).collect::<Vec<_>>().join(",") + "\n"
}
