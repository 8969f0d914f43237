//! Films: what changes from frame to frame, frames that are kept until the film is whole, and the files that hold it.
//!
//! [`Film`] says what each frame shows ([`Film::opened_at`]), [`reel`] draws frames into a folder beside the film, where they stay if it is stopped,
//! and [`write()`] makes the file that its name asks for: MP4 (H.264 by rusty_h264, in a container of our own), APNG, GIF, or the folder itself.

mod animation;
mod coded;
mod glide;
mod keys;
mod mp4;
mod recording;
pub mod reel;
mod track;

use crate::opened::Opened;
use crate::output::OutputError;
use crate::print::PrintError;
use bregma_field::Cancelled;
use bregma_renderer::{Camera, Shape};
pub use coded::{QUALITY, frame_yuv};
use glam::{DQuat, DVec3};
pub use keys::{Film, Key};
pub use recording::{EVERY_S, Recording};
pub use reel::{Reel, write};
use std::path::PathBuf;
use thiserror::Error;

/// Why there is no film.
#[derive(Debug, Error)]
pub enum FilmError {
    /// Times that are none.
    #[error("a film runs for a time above 0, at most {MOST_FRAMES} frames, of 1 to 240 in a second; this one is of {seconds} s at {fps}")]
    Times {
        /// Seconds.
        seconds: f64,
        /// Frames in each.
        fps: f64,
    },
    /// Keys that are none.
    #[error("key {number}: {reason}")]
    Key {
        /// From 1.
        number: usize,
        /// What is wrong with it, and what to do.
        reason: String,
    },
    /// Nothing that moves.
    #[error("nothing moves: ask for a turntable, or give keys")]
    Still,
    /// An ending that is no film's.
    #[error("{}: end the name in .mp4, .apng or .gif, or name a folder for the frames", .0.display())]
    Ending(PathBuf),
    /// Pixels that MP4 cannot have.
    #[error("{width}×{height}: MP4 has an even number of pixels along each side, at most 4096; choose another size")]
    Size {
        /// Across.
        width: u32,
        /// Down.
        height: u32,
    },
    /// Frames of something else.
    #[error(
        "{}: holds frames of another film, or of the same one drawn otherwise; take the folder away, or name the film differently",
        .0.display()
    )]
    OtherFrames(PathBuf),
    /// A frame that cannot be read.
    #[error("{}: is no frame ({reason}); take it away, and it is drawn again", file.display())]
    Frame {
        /// The frame.
        file: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// The encoder.
    #[error("the film cannot be encoded ({0}); choose another size, or .apng")]
    Encode(String),
    /// A picture.
    #[error(transparent)]
    Print(#[from] PrintError),
    /// A file.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// Stopped by request; what is drawn stays.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// An hour at 30 frames.
pub const MOST_FRAMES: u32 = 108_000;

impl Film {
    /// How many frames it has.
    pub fn frames(&self) -> u32 {
        (self.seconds * self.fps).round().clamp(0.0, f64::from(u32::MAX)) as u32
    }

    /// Whether its numbers can be used with what is open.
    pub fn check(&self, opened: &Opened) -> Result<(), FilmError> {
        let is_time = self.seconds > 0.0 && (1.0..=240.0).contains(&self.fps) && (1..=MOST_FRAMES).contains(&self.frames());
        if !is_time {
            return Err(FilmError::Times { seconds: self.seconds, fps: self.fps });
        }
        if self.turns.is_none() && self.keys.is_empty() {
            return Err(FilmError::Still);
        }
        let (layers, clips) = (opened.scene.layers.len(), opened.scene.clips.len());
        let mut before = f64::NEG_INFINITY;
        for (n, key) in self.keys.iter().enumerate() {
            let fail = |reason: String| Err(FilmError::Key { number: n + 1, reason });
            if !key.at_s.is_finite() || key.at_s <= before {
                return fail("its time is none, or not after that of the key before it; order keys by at_s".into());
            }
            before = key.at_s;
            for (what, list, count) in
                [("isovalue", &key.iso, layers), ("opacity", &key.opacity, layers), ("cut's offset", &key.cut_offsets_mm, clips)]
            {
                let Some(list) = list else { continue };
                if list.len() != count || list.iter().any(|v| !v.is_finite()) {
                    return fail(format!("has {} numbers for the {what} of {count}; give one for each", list.len()));
                }
            }
            if key.camera.is_some() && key.orbit.is_some() {
                return fail("says twice from where it is seen; leave camera or orbit out".into());
            }
        }
        Ok(())
    }

    /// What is open as frame number `n` shows it.
    pub fn opened_at(&self, opened: &Opened, n: u32) -> Opened {
        self.shown(opened, f64::from(n) / self.fps, f64::from(n))
    }

    /// What is open as the film shows it at a time, seconds.
    pub fn at(&self, opened: &Opened, at_s: f64) -> Opened {
        self.shown(opened, at_s, at_s * self.fps)
    }

    /// At a time, which is that of a frame or between two.
    fn shown(&self, opened: &Opened, at_s: f64, frame: f64) -> Opened {
        let mut shown = opened.clone();
        self.scene_at(&mut shown, at_s);
        if let Some(turns) = self.turns {
            let share = frame / f64::from(self.frames().max(1));
            shown.scene.camera = turned(&shown.scene.camera, share * turns * std::f64::consts::TAU);
        }
        shown
    }

    fn scene_at(&self, shown: &mut Opened, at_s: f64) {
        let bounds = shown.bounds();
        let fov_deg = match shown.scene.camera.projection {
            bregma_renderer::Projection::Perspective { fov_deg } => fov_deg,
            bregma_renderer::Projection::Orthographic { .. } => bregma_renderer::FOV_DEG,
        };
        let camera = |key: &Key| key.camera.or_else(|| key.orbit.map(|[a, e]| Camera::orbit_with_fov(&bounds, a, e, fov_deg)));
        let cameras: Vec<(f64, Camera)> = self.keys.iter().filter_map(|key| Some((key.at_s, camera(key)?))).collect();
        let scene = &mut shown.scene;
        if let Some(camera) = glide::camera(&cameras, at_s) {
            scene.camera = camera;
        }
        let track = |number: &dyn Fn(&Key) -> Option<f64>| {
            let points: Vec<(f64, f64)> = self.keys.iter().filter_map(|key| Some((key.at_s, number(key)?))).collect();
            track::at(&points, at_s)
        };
        for (n, layer) in scene.layers.iter_mut().enumerate() {
            layer.iso = track(&|key| key.iso.as_ref()?.get(n).copied()).unwrap_or(layer.iso);
            layer.opacity = track(&|key| key.opacity.as_ref()?.get(n).copied()).map_or(layer.opacity, |v| v.clamp(0.0, 1.0) as f32);
        }
        for (n, clip) in scene.clips.iter_mut().enumerate() {
            if let Shape::Plane { offset_mm, .. } = &mut clip.shape {
                *offset_mm = track(&|key| key.cut_offsets_mm.as_ref()?.get(n).copied()).unwrap_or(*offset_mm);
            }
        }
        for axis in 0..3 {
            let toward = &mut scene.light.toward[axis];
            *toward = track(&|key| Some(key.light?[axis])).map_or(*toward, |v| v as f32);
        }
        if let crate::Compare::Swipe { part } = &mut shown.compare {
            *part = track(&|key| key.swipe).map_or(*part, |v| v.clamp(0.0, 1.0));
        }
    }
}

impl Key {
    /// All that a key can say of what is seen now.
    pub fn of(opened: &Opened, at_s: f64) -> Self {
        let scene = &opened.scene;
        let offset = |shape: &Shape| if let Shape::Plane { offset_mm, .. } = shape { *offset_mm } else { 0.0 };
        let cuts: Vec<f64> = scene.clips.iter().map(|clip| offset(&clip.shape)).collect();
        Self {
            at_s,
            camera: Some(scene.camera),
            orbit: None,
            iso: Some(scene.layers.iter().map(|layer| layer.iso).collect()),
            opacity: Some(scene.layers.iter().map(|layer| f64::from(layer.opacity)).collect()),
            cut_offsets_mm: Some(cuts).filter(|cuts| !cuts.is_empty()),
            light: Some(scene.light.toward.as_dvec3()),
            swipe: if let crate::Compare::Swipe { part } = opened.compare { Some(part) } else { None },
        }
    }
}

/// The camera carried about the vertical of its view through its target.
fn turned(camera: &Camera, angle_rad: f64) -> Camera {
    let up = camera.up.normalize_or(DVec3::Z);
    let turn = DQuat::from_axis_angle(up, angle_rad);
    Camera { eye_mm: camera.target_mm + turn * (camera.eye_mm - camera.target_mm), ..*camera }
}
