//! What options say of studio light.

use super::parsers::{numbers, positive};
use bregma_renderer::Color;
use bregma_renderer::studio::{Follows, Lamp, Studio};
use bregma_session::studio::{Exposure, Stop, StudioFileError, find};
use clap::Args;
use std::time::Duration;

/// Studio light.
#[derive(Debug, Args)]
pub struct StudioArgs {
    /// Light the surfaces as in a studio, by path tracing: journal, museum, relief, sky, or a JSON file (docs/studio.md)
    #[arg(long, value_name = "NAME|FILE", conflicts_with_all = ["shadows", "light", "phong", "shadow", "compare", "values"])]
    pub studio: Option<String>,
    /// A further white lamp: azimuth (0 from the viewer, −90 from the left) and elevation in the picture, degrees, and strength (1: white
    /// paper is white); may be given again
    #[arg(long, value_name = "AZ,EL,STRENGTH", value_parser = lamp, allow_hyphen_values = true, requires = "studio")]
    pub lamp: Vec<Lamp>,
    /// Until no 8 × 8 pixels have more noise, 255ths
    #[arg(long, value_name = "N", value_parser = positive, requires = "studio")]
    pub noise: Option<f64>,
    /// Until so long has passed
    #[arg(long, value_name = "M", value_parser = positive, requires = "studio")]
    pub minutes: Option<f64>,
    /// All pixels get as many samples, and --noise is of the whole picture
    #[arg(long, requires = "studio")]
    pub even: bool,
    /// How often what is drawn so far is kept beside the picture, in P.png.part, where the same command goes on from if it was stopped; seconds
    #[arg(long, value_name = "S", value_parser = positive, default_value_t = 30.0, requires = "studio")]
    pub keep: f64,
    /// Of the noise
    #[arg(long, value_name = "N", default_value_t = 0, requires = "studio")]
    pub seed: u32,
    /// Take away what noise is left by a filter, which invents what lies between samples; the file says so
    #[arg(long, requires = "studio")]
    pub denoise: bool,
}

/// Samples of a pixel where nothing says when a picture is good enough.
const SAMPLES: u32 = 64;

impl StudioArgs {
    /// The light that is asked for.
    pub fn studio(&self) -> Result<Option<Studio>, StudioFileError> {
        let Some(name) = &self.studio else { return Ok(None) };
        let mut studio = find(name)?;
        studio.lamps.extend(&self.lamp);
        Ok(Some(studio))
    }

    /// How often what is drawn so far is kept.
    pub fn keep_every(&self) -> Duration {
        Duration::try_from_secs_f64(self.keep).unwrap_or(Duration::MAX)
    }

    /// When the picture is good enough, and what is done with what noise is left.
    pub fn exposure(&self, samples: Option<u32>) -> Exposure {
        let nothing_said = samples.is_none() && self.noise.is_none() && self.minutes.is_none();
        let samples = samples.or(nothing_said.then_some(SAMPLES));
        let stop = Stop { samples, noise: self.noise, minutes: self.minutes, even: self.even };
        Exposure { stop, seed: self.seed, denoise: self.denoise }
    }
}

fn lamp(text: &str) -> Result<Lamp, String> {
    let is_sound = |[_, elevation, strength]: &[f64; 3]| elevation.abs() <= 90.0 && (0.0..=1e6).contains(strength);
    let [azimuth_deg, elevation_deg, strength] =
        numbers::<3>(text).ok().filter(is_sound).ok_or("not an azimuth, an elevation from -90 to 90 and a strength such as -45,45,0.8")?;
    let (follows, color) = (Follows::Camera, Color([1.0; 3]));
    Ok(Lamp { azimuth_deg, elevation_deg, follows, distance: 5.0, size_deg: 16.0, color, strength: strength as f32 })
}
