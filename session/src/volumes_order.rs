//! Volumes of bone and of cavities: what is asked for, as it is kept.

use bregma_field::Clip;
use bregma_measure::volumes::cavity::Cavity;
use serde::{Deserialize, Serialize};

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
