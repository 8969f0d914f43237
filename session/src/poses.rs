//! A registration that is kept by name, so that another can take its place and it can come back.

use bregma_field::{Covariance, Registration};
use glam::DAffine3;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

/// A registration of a scan that is kept.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KeptPose {
    /// What the person calls it.
    pub name: String,
    /// The scan that it moves, by its name.
    pub scan: String,
    /// The scan that stays.
    pub onto: String,
    /// Moves the scan's own world onto the other's, mm.
    pub transform: DAffine3,
    /// Root mean square distance that it leaves between landmarks, mm, where it is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residual_mm: Option<f64>,
    /// How sure it is, in the world of the scan that stays, where it is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance: Option<Covariance>,
    /// How it was made, as a file of a registration says it.
    #[serde(default, skip_serializing_if = "Map::is_empty")]
    pub record: Map<String, Value>,
}

impl KeptPose {
    /// The registration of the one scan's world onto the other's.
    pub fn registration(&self) -> Registration {
        Registration { transform: self.transform, residual_mm: self.residual_mm, covariance: self.covariance.clone() }
    }

    /// It can be undone: all of its numbers are some, and it flattens nothing.
    pub(crate) fn is_sound(&self) -> bool {
        self.transform.is_finite() && self.transform.matrix3.determinant() != 0.0
    }
}
