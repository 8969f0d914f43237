//! What a film is: how long it runs, and what is to be seen when. Plain values that sessions keep.

use bregma_renderer::Camera;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// What changes from frame to frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Film {
    /// How long it runs.
    pub seconds: f64,
    /// Frames in a second.
    pub fps: f64,
    /// Turns about the vertical of the view; none where absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub turns: Option<f64>,
    /// What is to be seen when, in order of time; what a key does not say goes on from the one before it to the next.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub keys: Vec<Key>,
}

/// What is to be seen at a time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Key {
    /// When.
    pub at_s: f64,
    /// From where.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<Camera>,
    /// From where, as azimuth and elevation about the scans, degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orbit: Option<[f64; 2]>,
    /// The isovalue of each scan.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub iso: Option<Vec<f64>>,
    /// The opacity of each scan, 0 to 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub opacity: Option<Vec<f64>>,
    /// Where each cut lies along its normal, mm, of planes; others keep their place, whatever stands here.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cut_offsets_mm: Option<Vec<f64>>,
    /// Toward the light, in the camera's right, up and backward directions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light: Option<DVec3>,
    /// Where the line of a swipe stands, of the picture's width.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub swipe: Option<f64>,
}

impl Default for Film {
    /// Once around what is seen.
    fn default() -> Self {
        Self { seconds: 12.0, fps: 30.0, turns: Some(1.0), keys: vec![] }
    }
}
