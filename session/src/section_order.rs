//! A section along a curve: what is asked for, and what is told of it.

use bregma_measure::section::{Length, Mark, Path, Station};
use serde::{Deserialize, Serialize};

/// A section to be measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Order {
    /// The curve.
    pub path: Path,
    /// From station to station, mm.
    pub step_mm: f64,
    /// Number of the scan on whose surface the curve runs.
    #[serde(default)]
    pub on: usize,
    /// Number of the scan that it is compared with.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub against: Option<usize>,
    /// Partners are looked for so far, mm; a twentieth of the smaller scan's radius, rounded up, where absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reach_mm: Option<f64>,
}

/// What was asked for and found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Told {
    /// What was asked for.
    #[serde(flatten)]
    pub order: Order,
    /// As far as was looked, mm, where there are two scans.
    #[serde(rename = "looked_within_mm", default, skip_serializing_if = "Option::is_none")]
    pub looked_mm: Option<f64>,
    /// The scan that it is on, and the one that it is compared with.
    pub scans: Vec<String>,
    /// Length of the curve, mm.
    pub length_mm: f64,
    /// Its end is its beginning.
    pub is_closed: bool,
    /// Landmarks on it.
    pub marks: Vec<Mark>,
    /// Its places with what was measured there.
    pub stations: Vec<Station>,
    /// What the person should know.
    pub notes: Vec<String>,
}

/// A column of a section: what it is called, and what a station has of it.
pub type Column = (String, fn(&Station) -> Option<Length>);

impl Told {
    /// The thickness of each scan.
    pub fn thicknesses(&self) -> Vec<Column> {
        let of: [fn(&Station) -> Option<Length>; 2] = [|station| station.thickness, |station| station.second_thickness];
        self.scans.iter().cloned().zip(of).collect()
    }

    /// How the second scan differs from the first; none of a single scan.
    pub fn differences(&self) -> Vec<Column> {
        let [Some(first), Some(second)] = [self.scans.first(), self.scans.get(1)] else { return vec![] };
        vec![
            (format!("thickness, {second} − {first}"), |station| station.thickness_difference),
            (format!("how far {second} stands out"), |station| station.surface_difference),
        ]
    }

    /// What a section is compared with another by: a name and millimetres.
    pub(crate) fn numbers(&self) -> Vec<(String, f64)> {
        let columns: Vec<Column> = self.thicknesses().into_iter().chain(self.differences()).collect();
        let of = |station: &Station| {
            let found = columns.iter().filter_map(|(name, of)| Some((format!("{name}, {} mm along", station.along_mm), of(station)?.mm)));
            found.collect::<Vec<_>>()
        };
        std::iter::once(("length".to_owned(), self.length_mm)).chain(self.stations.iter().flat_map(of)).collect()
    }
}
