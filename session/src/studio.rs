//! Pictures under studio light: drawn until they are good enough, kept on the way, and gone on with where they were left.

use crate::output::{OutputError, write_by};
use bregma_field::{Cancelled, Progress, Volume};
use bregma_renderer::studio::{Exposed, LEAST_SAMPLES, NotDrawn, Preset, Studio, StudioError, Tracer};
use bregma_renderer::{Backend, Color, Named, Picture, RenderError, Renderer, Scene};
use glam::Vec4;
use serde::{Deserialize, Serialize};
use std::ffi::OsString;
use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};
use thiserror::Error;

/// When a picture is good enough; at the first of these.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Stop {
    /// Samples of a pixel.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub samples: Option<u32>,
    /// Noise of each block of 8 × 8 pixels, or with `even` of the whole picture, root mean square, in 255ths.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<f64>,
    /// Wall clock.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub minutes: Option<f64>,
    /// Blocks that are good enough get as many samples as others.
    #[serde(default)]
    pub even: bool,
}

/// How a picture under studio light is made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Exposure {
    /// Until then.
    #[serde(flatten)]
    pub stop: Stop,
    /// Of its noise.
    #[serde(default)]
    pub seed: u32,
    /// What noise is left is taken away by a filter.
    #[serde(default)]
    pub denoise: bool,
}

impl Exposure {
    /// The same by the samples that it came to, where the clock had a say: for it to be made again.
    pub fn timeless(self, samples: u32) -> Self {
        let by_clock = self.stop.minutes.is_some();
        let stop = Stop { samples: if by_clock { Some(samples) } else { self.stop.samples }, minutes: None, ..self.stop };
        Self { stop, ..self }
    }
}

/// What is drawn.
#[derive(Clone, Copy, Debug)]
pub struct Order<'a> {
    /// The scans.
    pub volumes: &'a [Arc<Volume>],
    /// With a studio.
    pub scene: &'a Scene,
    /// Pixels across and down.
    pub size: [u32; 2],
    /// How.
    pub exposure: Exposure,
    /// Where what is drawn so far is kept; nowhere where absent.
    pub part: Option<&'a Path>,
    /// Not before so long has passed since the last time.
    pub keep_every: Duration,
}

/// How far a picture is.
#[derive(Clone, Copy, Debug)]
pub struct Told {
    /// Samples of the pixels that have most.
    pub samples: u32,
    /// Root mean square over the picture, 255ths.
    pub noise: f64,
    /// About how long the rest takes, if that is known.
    pub left: Option<Duration>,
    /// How long one sample of one pixel took, seconds.
    pub sample_s: f64,
}

/// A studio that cannot be found.
#[derive(Debug, Error)]
pub enum StudioFileError {
    /// No such name, and no such file.
    #[error("{0}: no studio light of that name, nor a file; there are {all}", all = names())]
    Unknown(String),
    /// Not a studio.
    #[error("{}: it holds no studio light ({reason}); write one from the example in docs/studio.md", file.display())]
    Form {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        reason: serde_json::Error,
    },
    /// One that cannot be.
    #[error("{}: {reason}", file.display())]
    Studio {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        reason: StudioError,
    },
}

fn names() -> String {
    Preset::ALL.iter().map(|preset| preset.name()).collect::<Vec<_>>().join(", ")
}

/// A ready-made studio as files write it, whose colours have 8 bits, so that what is drawn of one is drawn again.
pub fn ready_made(preset: Preset) -> Studio {
    let written = serde_json::json!(preset.studio());
    serde_json::from_value(written).expect("a studio reads what it writes")
}

/// A studio by the name of a preset, or from a JSON file.
pub fn find(name: &str) -> Result<Studio, StudioFileError> {
    if let Some(preset) = Preset::named(name) {
        return Ok(ready_made(preset));
    }
    let text = std::fs::read_to_string(name).map_err(|_| StudioFileError::Unknown(name.to_owned()))?;
    let studio: Studio = serde_json::from_str(&text).map_err(|reason| StudioFileError::Form { file: name.into(), reason })?;
    studio.check().map_err(|reason| StudioFileError::Studio { file: name.into(), reason })?;
    Ok(studio)
}

/// Why there is no picture.
#[derive(Debug, Error)]
pub enum ExposeError {
    /// It cannot be drawn.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// What is drawn so far cannot be kept.
    #[error(transparent)]
    Part(#[from] OutputError),
    /// Stopped by request.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl From<NotDrawn> for ExposeError {
    fn from(reason: NotDrawn) -> Self {
        match reason {
            NotDrawn::Cancelled(reason) => reason.into(),
            NotDrawn::Failed(reason) => reason.into(),
        }
    }
}

/// A picture that is good enough, and how it became so.
#[derive(Debug)]
pub struct Drawn {
    /// What is known of the pixels beside their light.
    pub middles: Picture,
    /// Linear, premultiplied with the opacity, after tone.
    pub light: Vec<Vec4>,
    /// Samples of the pixels that have most.
    pub samples: u32,
    /// Root mean square over the picture, 255ths.
    pub noise: f64,
    /// Samples that another run had kept.
    pub resumed: u32,
    /// What a reader of the picture must know, in a sentence.
    pub description: String,
}

fn description(order: &Order<'_>, samples: u32, noise: f64) -> String {
    let smoothed = order.scene.studio.as_ref().map_or(0.0, |studio| studio.smooth_voxel);
    let of = if smoothed > 0.0 {
        format!("samples smoothed by {smoothed} voxel, not the measured surface")
    } else {
        "the measured surface".into()
    };
    let denoised = if order.exposure.denoise { ", then denoised" } else { "" };
    format!("studio light on {of}: {}{denoised}", so_far(samples, noise))
}

/// How far a picture is, for people.
pub fn so_far(samples: u32, noise: f64) -> String {
    // One sample does not tell its noise.
    let noise = if noise.is_finite() { format!("{noise:.1} of 255") } else { "not known".into() };
    format!("{samples} samples, noise {noise}")
}

/// Where what is drawn so far of picture number `n` of a file is kept beside it.
pub fn part_of(out: &Path, n: usize) -> PathBuf {
    let mut name = OsString::from(out);
    name.push(if n == 0 { ".part".into() } else { format!(".{}.part", n + 1) });
    name.into()
}

/// What a file of kept samples begins with.
const MAGIC: &[u8] = b"bregma studio 1\n";

/// Draws a picture by a renderer until it is good enough, and tells how far it is after each round.
pub fn draw(order: &Order<'_>, renderer: &mut dyn Renderer, progress: &Progress, mut told: impl FnMut(Told)) -> Result<Drawn, ExposeError> {
    let tracer = renderer.tracer(order.volumes, order.scene, order.size, order.exposure.seed)?;
    let header = header(order, tracer.backend());
    let exposed = resumed(order, &header).unwrap_or_else(|| Exposed::new(order.size));
    let resumed = exposed.samples();
    let mut exposing = Exposing::of(tracer, exposed, order.exposure.stop);
    let mut kept = Instant::now();
    while let Some(round) = exposing.go_on(progress)? {
        told(round);
        if let Some(part) = order.part.filter(|_| kept.elapsed() >= order.keep_every) {
            keep(part, &header, &exposing.exposed)?;
            kept = Instant::now();
        }
    }
    let [width, height] = order.size;
    let middles = renderer.render(order.volumes, order.scene, width, height)?;
    let (samples, noise) = (exposing.exposed.samples(), exposing.exposed.noise());
    let description = description(order, samples, noise);
    Ok(Drawn { middles, light: exposing.light(order.exposure.denoise), samples, noise, resumed, description })
}

/// A picture that gets samples round by round until it is good enough. All that a file keeps is between two rounds, so that it does not matter how
/// often it was gone on with.
#[derive(Debug)]
pub struct Exposing {
    tracer: Tracer,
    exposed: Exposed,
    stop: Stop,
    begun: Instant,
    /// What rounds took, without what is done between them.
    spent: Duration,
    /// Samples of all pixels that it began with.
    before: u64,
}

impl Exposing {
    /// Goes on from what is exposed.
    pub fn of(tracer: Tracer, exposed: Exposed, stop: Stop) -> Self {
        let before = exposed.count();
        Self { tracer, exposed, stop, begun: Instant::now(), spent: Duration::ZERO, before }
    }

    /// Adds the samples of one round, and tells how far the picture is; `None` once it is good enough.
    pub fn go_on(&mut self, progress: &Progress) -> Result<Option<Told>, NotDrawn> {
        let Stop { samples, noise, minutes, even } = self.stop;
        let is_late = minutes.is_some_and(|minutes| self.begun.elapsed().as_secs_f64() >= 60.0 * minutes);
        if is_late || is_enough(&self.exposed, &self.stop) {
            return Ok(None);
        }
        let done = self.exposed.samples();
        let until = (done + round_at(done)).min(samples.unwrap_or(u32::MAX));
        let round = Instant::now();
        self.tracer.expose(&mut self.exposed, until, noise.filter(|_| !even).map(|noise| noise as f32), progress)?;
        self.spent += round.elapsed();
        let sample_s = self.spent.as_secs_f64() / (self.exposed.count() - self.before).max(1) as f64;
        let left = left(&self.exposed, &self.stop, sample_s);
        Ok(Some(Told { samples: self.exposed.samples(), noise: self.exposed.noise(), left, sample_s }))
    }

    /// The picture so far as linear light, premultiplied with its opacity; with what noise is left taken away by a filter, if that is asked for.
    pub fn light(&self, denoise: bool) -> Vec<Vec4> {
        self.tracer.light(&self.exposed, denoise)
    }
}

/// Light on what is behind it; as it is where that is clear.
pub fn on_ground(mut light: Vec<Vec4>, ground: Option<Color>) -> Vec<Vec4> {
    let ground = ground.map_or(Vec4::ZERO, |color| color.linear().extend(1.0));
    light.iter_mut().for_each(|over| *over += (1.0 - over.w) * ground);
    light
}

/// Samples of the round after so many: few at first, so that there soon is something to see.
fn round_at(samples: u32) -> u32 {
    samples.clamp(1, 16)
}

fn is_enough(exposed: &Exposed, stop: &Stop) -> bool {
    let blocks = |noise: f64| exposed.noise_of_blocks().iter().all(|told| f64::from(*told) <= noise);
    let is_quiet = |noise: f64| exposed.samples() >= LEAST_SAMPLES && if stop.even { exposed.noise() <= noise } else { blocks(noise) };
    stop.samples.is_some_and(|samples| exposed.samples() >= samples) || stop.noise.is_some_and(is_quiet)
}

/// How long the rest takes at so many seconds a sample: noise falls with the root of the samples.
fn left(exposed: &Exposed, stop: &Stop, seconds: f64) -> Option<Duration> {
    let (done, pixels) = (f64::from(exposed.samples()), f64::from(exposed.size()[0]) * f64::from(exposed.size()[1]));
    let by_samples = stop.samples.map(|samples| (f64::from(samples) - done) * pixels);
    let more = |told: f64, noise: f64| ((told / noise).powi(2) - 1.0).max(0.0) * done;
    let by_noise = stop.noise.map(|noise| match stop.even {
        true => more(exposed.noise(), noise) * pixels,
        false => exposed.noise_of_blocks().iter().map(|told| more(f64::from(*told), noise) * 64.0).sum(),
    });
    let count = by_samples.into_iter().chain(by_noise).fold(f64::INFINITY, f64::min);
    Duration::try_from_secs_f64(count * seconds).ok()
}

/// What a picture's kept samples are of: all that decides them.
fn header(order: &Order<'_>, backend: Backend) -> Vec<u8> {
    let scans: Vec<String> = order.volumes.iter().map(|volume| volume.content()).collect();
    let of =
        serde_json::json!({ "scene": order.scene, "scans": scans, "backend": backend, "seed": order.exposure.seed, "size": order.size });
    let text = of.to_string();
    [MAGIC, &(text.len() as u64).to_le_bytes(), text.as_bytes()].concat()
}

/// Keeps what is drawn so far: whole, or what was kept before.
fn keep(part: &Path, header: &[u8], exposed: &Exposed) -> Result<(), OutputError> {
    write_by(part, |beside| {
        let mut file = BufWriter::new(File::create(beside)?);
        file.write_all(header)?;
        exposed.write(&mut file)?;
        file.into_inner()?.sync_all()
    })
}

/// What another run kept of the same picture.
fn resumed(order: &Order<'_>, header: &[u8]) -> Option<Exposed> {
    let mut file = BufReader::new(File::open(order.part?).ok()?);
    let mut found = vec![0; header.len()];
    file.read_exact(&mut found).ok().filter(|()| found == header)?;
    Exposed::read(order.size, &mut file).ok()
}
