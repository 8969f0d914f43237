//! What a person prefers, of all sessions.

use bregma_field::{Unit, Volume};
use bregma_measure::table_style::TableStyle;
use bregma_renderer::{Color, Scene};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// How the window looks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ThemeChoice {
    /// Dark: the eye stays with the picture.
    #[default]
    Dark,
    /// Light: for bright rooms, and for print.
    Light,
    /// As other windows.
    System,
}

/// What a person prefers; it is kept from one run of the program to the next.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Preferences {
    /// How the window looks.
    pub theme: ThemeChoice,
    /// Behind new pictures; the program's own when absent.
    pub background: Option<Color>,
    /// That new scans in Hounsfield units open with; what is found in them when absent.
    pub iso_hu: Option<f64>,
    /// How tables are saved.
    pub tables: TableStyle,
    /// Points of each pixel of a picture at rest; edges are smooth from a few on.
    pub samples_at_rest: u32,
    /// A drag turns the view as a ball, and not as a turntable.
    pub turns_freely: bool,
    /// A kiosk that is left alone for so long turns by itself, seconds.
    pub kiosk_after_s: f64,
}

impl Default for Preferences {
    fn default() -> Self {
        Self {
            theme: ThemeChoice::Dark,
            background: None,
            iso_hu: None,
            tables: TableStyle::default(),
            samples_at_rest: 16,
            turns_freely: false,
            kiosk_after_s: 30.0,
        }
    }
}

impl Preferences {
    /// Gives the scene of scans that were just opened what the person prefers.
    pub fn apply(&self, scene: &mut Scene, volumes: &[Arc<Volume>]) {
        scene.background = self.background.or(scene.background);
        for (layer, _) in scene.layers.iter_mut().zip(volumes).filter(|(_, volume)| volume.unit() == Unit::Hounsfield) {
            layer.iso = self.iso_hu.unwrap_or(layer.iso);
        }
    }
}
