//! Parts of space that a registration is made on, or without.

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A part of the fixed scan's world, LPS mm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Part {
    /// Around a point.
    Ball {
        /// The point.
        centre_mm: DVec3,
        /// As far as this.
        radius_mm: f64,
    },
    /// Along the axes of the world.
    Box {
        /// Lowest corner.
        low_mm: DVec3,
        /// Highest.
        high_mm: DVec3,
    },
}

impl Part {
    /// With all that lies so near to it; a box grows along its own axes.
    pub fn grown(self, mm: f64) -> Self {
        match self {
            Self::Ball { centre_mm, radius_mm } => Self::Ball { centre_mm, radius_mm: radius_mm + mm },
            Self::Box { low_mm, high_mm } => Self::Box { low_mm: low_mm - mm, high_mm: high_mm + mm },
        }
    }

    /// Whether a point lies in it.
    pub fn holds(&self, p: DVec3) -> bool {
        match self {
            Self::Ball { centre_mm, radius_mm } => p.distance_squared(*centre_mm) <= radius_mm * radius_mm,
            Self::Box { low_mm, high_mm } => p.cmpge(*low_mm).all() && p.cmple(*high_mm).all(),
        }
    }
}

/// What a registration is made on: what lies in any of `only`, or everything where that is empty, without what lies in any of `but`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Parts {
    /// Parts that it is made on.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub only: Vec<Part>,
    /// Parts that it is made without.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub but: Vec<Part>,
}

impl Parts {
    /// Whether a point takes part.
    pub fn hold(&self, p: DVec3) -> bool {
        (self.only.is_empty() || self.only.iter().any(|part| part.holds(p))) && !self.but.iter().any(|part| part.holds(p))
    }

    /// Everything takes part.
    pub fn is_all(&self) -> bool {
        self.only.is_empty() && self.but.is_empty()
    }
}
