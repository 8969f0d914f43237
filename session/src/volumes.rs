//! Volumes of bone and of cavities of what is open, their tables, and their records that can be made again.

use crate::measurement::{Origin, RecordedVolumes};
use crate::opened::Opened;
pub use crate::volumes_order::Order;
use bregma_field::{Measured, Progress};
use bregma_measure::csv::Made;
use bregma_measure::numbers::{at_most, significant};
use bregma_measure::volumes::cavity::{MeasuredCavity, cavity};
use bregma_measure::volumes::{Limits, Measure, MeasuredBone, Volumes, VolumesError, bone};
use serde::Serialize;

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
    let opened = &opened.measured();
    let measured: Vec<Measured> = opened.scene.layers.iter().map(Measured::from).collect();
    let limits = Limits { clips: order.clips.clone(), open: order.open };
    if order.cavities.is_empty() {
        return Ok(Found::Bone(bone(&opened.volumes, &measured, &limits, progress)?));
    }
    let of_scan = |n: usize| {
        let (measured, limits) = (&measured[n], &limits);
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

/// What is kept of volumes: what was measured, on what, and what was found.
pub fn record(made_by: Option<Origin>, order: &Order, found: &Found) -> RecordedVolumes {
    let found = serde_json::to_value(found).expect("volumes have only numbers, texts and lists");
    let serde_json::Value::Object(found) = found else { unreachable!("volumes have names") };
    RecordedVolumes { volumes_of: order.clone(), made_by, found }
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
pub fn csv(made: &Made, found: &Found) -> String {
    let kind = if matches!(found, Found::Bone(_)) { "bone" } else { "cavity" };
    let rows = found.measures().into_iter().map(|(measure, scans)| row(kind, measure, &scans, made, found.notes()));
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
