//! What a person prefers, of all sessions.

use serde::{Deserialize, Serialize};

/// What a person prefers; it is kept from one run of the program to the next.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Preferences {
    /// Points of each pixel of a picture at rest; edges are smooth from a few on.
    pub samples_at_rest: u32,
    /// A drag turns the view as a ball, and not as a turntable.
    pub turns_freely: bool,
    /// A kiosk that is left alone for so long turns by itself, seconds.
    pub kiosk_after_s: f64,
}

impl Default for Preferences {
    fn default() -> Self {
        Self { samples_at_rest: 16, turns_freely: false, kiosk_after_s: 30.0 }
    }
}
