//! How two scans differ over their whole surfaces: what is asked for, and what is told of it.

use crate::displacement::Moved;
use bregma_measure::difference;
use bregma_register::Parts;
use bregma_renderer::{Clip, named};
use serde::{Deserialize, Serialize};

named! {
    /// Which difference of two surfaces.
    #[derive(Default)]
    pub enum By {
        /// To the nearest place that faces the same way.
        #[default]
        Partner = "partner",
        /// To the nearest place of either side of a wall.
        Closest = "closest",
        /// Along the normal.
        Normal = "normal",
        /// Of the thickness at partners.
        Thickness = "thickness",
        /// Of a part that moved as a whole.
        Displacement = "displacement",
        /// To the scan's own mirror image, by partners.
        Asymmetry = "asymmetry",
    }
}

impl By {
    /// What + means, in words, for scans of these names.
    pub fn legend(self, [first, second]: [&str; 2]) -> String {
        match self {
            Self::Partner => format!("+ : {second} stands out over {first}, to the nearest place that faces the same way"),
            Self::Closest => format!("+ : {second} stands out over {first}, to the nearest place of any sheet"),
            Self::Normal => format!("+ : {second} stands out over {first}, along the normal"),
            Self::Thickness => format!("+ : the bone of {second} is thicker than that of {first}"),
            Self::Displacement => {
                format!("how far the part lies from where {second} has it: {first}'s part moved as a whole, without a sign")
            }
            Self::Asymmetry => format!("+ : the other side of {first}, mirrored, stands out over this one"),
        }
    }

    /// How each point finds what belongs to it; `None` where the points move together.
    pub(crate) fn of_points(self) -> Option<difference::By> {
        match self {
            Self::Partner | Self::Asymmetry => Some(difference::By::Partner),
            Self::Closest => Some(difference::By::Closest),
            Self::Normal => Some(difference::By::Normal),
            Self::Thickness => Some(difference::By::Thickness),
            Self::Displacement => None,
        }
    }
}

/// A difference to be measured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Order {
    /// Which.
    pub by: By,
    /// Numbers of the first and the second of the open scans; of an asymmetry the first counts.
    #[serde(default)]
    pub pair: [usize; 2],
    /// What belongs to a point is looked for so far, mm; a twentieth of the smaller scan's radius, rounded up, where absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reach_mm: Option<f64>,
    /// Where.
    #[serde(default, skip_serializing_if = "Parts::is_all")]
    pub parts: Parts,
    /// Only what cuts leave of the surfaces.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub clips: Vec<Clip>,
}

/// What was asked for and found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Told {
    /// What was asked for.
    #[serde(flatten)]
    pub order: Order,
    /// As far as was looked, mm.
    #[serde(rename = "looked_within_mm")]
    pub reach_mm: f64,
    /// What + means.
    pub legend: String,
    /// The largest magnitude on either, mm.
    pub largest_mm: f64,
    /// How the part moved, where that was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub moved: Option<Moved>,
    /// On the first and on the second surface.
    pub halves: Vec<RecordedHalf>,
    /// What the person should know.
    pub notes: Vec<String>,
}

impl Told {
    /// The end of a symmetric range of colours, mm: what 95 % of both areas stay below.
    pub fn range_mm(&self) -> f64 {
        let of = |half: &RecordedHalf| half.statistics.as_ref()?["magnitude_95_mm"].as_f64();
        self.halves.iter().filter_map(of).fold(0.0, f64::max)
    }
}

/// The differences on one surface in short.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordedHalf {
    /// Of which scan.
    pub on: String,
    /// See [`Statistics`].
    pub statistics: Option<serde_json::Value>,
}
