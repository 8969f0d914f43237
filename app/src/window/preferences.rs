//! What a person prefers, of all sessions.

use serde::{Deserialize, Serialize};

/// What a person prefers; it is kept from one run of the program to the next.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Preferences {
    /// Points of each pixel of a picture at rest; edges are smooth from a few on.
    pub samples_at_rest: u32,
}

impl Default for Preferences {
    fn default() -> Self {
        Self { samples_at_rest: 16 }
    }
}
