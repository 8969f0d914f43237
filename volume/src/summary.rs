//! What the numbers of a scan mean and how they are spread: all that can be said without keeping the samples.

use crate::histogram::{Histogram, Otsu};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// What a value is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Unit {
    /// Hounsfield units: air −1000, water 0.
    #[serde(rename = "HU")]
    Hounsfield,
    /// A number whose scale the file does not state.
    #[serde(rename = "value")]
    Value,
}

/// A scale that maps all samples to one value, or to none.
#[derive(Debug, Error, PartialEq)]
#[error("the value scale (slope {slope}, intercept {intercept}) is not usable; both must be finite and the slope not zero")]
pub struct ScaleError {
    /// Value per sample unit.
    pub slope: f64,
    /// Value of sample 0.
    pub intercept: f64,
}

/// `value = slope·sample + intercept`, and how often each occurs.
#[derive(Clone, Debug)]
pub struct Summary {
    /// Value per sample unit.
    pub slope: f64,
    /// Value of sample 0.
    pub intercept: f64,
    /// What a value is.
    pub unit: Unit,
    /// The histogram in sample units.
    pub histogram: Histogram,
    otsu: Option<Otsu>,
}

impl Summary {
    /// Refuses a scale that maps all samples to one value, or to none.
    pub fn check_scale(slope: f64, intercept: f64) -> Result<(), ScaleError> {
        let usable = slope.is_finite() && intercept.is_finite() && slope != 0.0;
        if usable { Ok(()) } else { Err(ScaleError { slope, intercept }) }
    }

    /// Finds Otsu's threshold in `histogram`.
    pub fn new(slope: f64, intercept: f64, unit: Unit, histogram: Histogram) -> Self {
        let otsu = histogram.otsu();
        Self { slope, intercept, unit, histogram, otsu }
    }

    /// The value of a sample.
    pub fn value_of(&self, sample: f64) -> f64 {
        self.slope * sample + self.intercept
    }

    /// Lowest and highest value.
    pub fn range(&self) -> [f64; 2] {
        let [a, b] = self.histogram.range.map(|s| self.value_of(s));
        [a.min(b), a.max(b)]
    }

    /// Otsu's threshold as a value; `None` when all samples are equal.
    pub fn otsu(&self) -> Option<f64> {
        self.otsu.map(|o| self.value_of(o.threshold))
    }

    /// The step between Otsu's two classes (for a skull: bone minus air), in values.
    pub fn otsu_step(&self) -> Option<f64> {
        self.otsu.map(|o| ((o.mean_above - o.mean_below) * self.slope).abs())
    }

    /// The isovalue to open with, and why: 226 HU, InVesalius's threshold for bone, where values are HU and reach it;
    /// otherwise Otsu's; the middle of the range when there is nothing to split.
    pub fn default_isovalue(&self) -> (f64, &'static str) {
        const BONE_HU: f64 = 226.0;
        let [low, high] = self.range();
        match self.otsu() {
            _ if self.unit == Unit::Hounsfield && low < BONE_HU && BONE_HU <= high => (BONE_HU, "bone, 226 HU"),
            Some(otsu) => (otsu, "Otsu's threshold"),
            None => ((low + high) / 2.0, "middle of the range"),
        }
    }
}
