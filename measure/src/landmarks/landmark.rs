//! A landmark.

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A named point of a specimen, set or missing.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Landmark {
    /// What the person calls it.
    pub name: String,
    /// LPS mm; on the interpolant's surface to float64 precision where it was picked. `None`: the specimen lacks it, or it was not set yet; it
    /// has its place in lists all the same.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point_mm: Option<DVec3>,
    /// The scan that it belongs to, by its name; `None`: no one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scan: Option<String>,
}

impl Landmark {
    /// A point of no scan in particular.
    pub fn at(name: impl Into<String>, point_mm: DVec3) -> Self {
        Self { name: name.into(), point_mm: Some(point_mm), scan: None }
    }

    /// One whose point is missing.
    pub fn missing(name: impl Into<String>) -> Self {
        Self { name: name.into(), ..Self::default() }
    }
}
