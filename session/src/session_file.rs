//! The session file: scans, the scene they were left in, and what was measured on them.

use crate::compare::Compare;
use crate::film::Film;
use crate::measurement::Measurement;
use crate::output::{OutputError, write_whole};
use crate::poses::KeptPose;
use crate::slices::Slices;
use crate::source::Source;
use bregma_measure::landmarks::Landmark;
use bregma_renderer::{Clip, Scene};
use serde::{Deserialize, Serialize};
use std::path::Path;
use thiserror::Error;

/// What a session file holds: scans and the scene they were left in.
///
/// ```
/// use bregma_session::{Opened, Session};
/// use std::path::Path;
///
/// let mut opened = Opened::demo(16, &Default::default())?;
/// opened.scene.layers[0].iso = 300.0;
/// let session = Session::of(&opened, Path::new("."));
/// let text = serde_json::to_string(&session)?;
/// let again: Session = serde_json::from_str(&text)?;
/// assert_eq!(again, session);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Session {
    /// Version of the form; 1.
    pub bregma_session: u32,
    /// The scans.
    pub volumes: Vec<Source>,
    /// One layer for each, and the view.
    pub scene: Scene,
    /// What was measured, with what it was measured on.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub measurements: Vec<Measurement>,
    /// Landmarks.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub landmarks: Vec<Landmark>,
    /// How the scans are compared.
    #[serde(default, skip_serializing_if = "Compare::is_off")]
    pub compare: Compare,
    /// Which two are, by their numbers from 0, instead of the first two visible ones.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pair: Option<[usize; 2]>,
    /// How slices are looked at.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slices: Option<Slices>,
    /// The box of each scan is drawn.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub boxes: bool,
    /// Registrations that are kept beside those that stand.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub poses: Vec<KeptPose>,
    /// What moves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub film: Option<Film>,
}

/// Why a session was not opened.
#[derive(Debug, Error)]
#[error("{file}: is not a session that this version reads ({reason}); open the scans themselves")]
pub struct SessionError {
    file: String,
    reason: String,
}

/// A file larger than this is no session, so its text is not read.
const SESSION_BYTES: u64 = 64 << 20;

impl Session {
    /// The session in a source; `None` when it is something else.
    pub(crate) fn read(source: &Source) -> Result<Option<Self>, SessionError> {
        let file = source.file.as_path();
        let small = std::fs::metadata(file).is_ok_and(|m| m.is_file() && m.len() <= SESSION_BYTES);
        let is_json = file.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
        if !(small && is_json) || source.raw.is_some() {
            return Ok(None);
        }
        let fail = |reason: String| SessionError { file: file.display().to_string(), reason };
        let text = std::fs::read_to_string(file).map_err(|e| fail(e.to_string()))?;
        let session: Self =
            serde_json::from_str(&text).and_then(|json| serde_json::from_value(renewed(json))).map_err(|e| fail(e.to_string()))?;
        if source.transform.is_some() || source.spacing_mm.is_some() || !source.turn.is_none() {
            let text = "a session has transforms, spacings and turns of its own: --transform, --spacing and --turn are for scans";
            return Err(fail(text.into()));
        }
        let mut session = session.checked().map_err(fail)?;
        let folder = file.parent().unwrap_or(Path::new(""));
        for volume in session.volumes.iter_mut().filter(|volume| volume.built_in.is_none()) {
            volume.file = folder.join(&volume.file);
        }
        for within in session.volumes.iter_mut().filter_map(|volume| volume.within.as_mut()) {
            within.file = folder.join(&within.file);
        }
        Ok(Some(session))
    }

    /// It, if nothing in it is what no session can hold; else what is.
    pub(crate) fn checked(mut self) -> Result<Self, String> {
        if self.bregma_session != 1 {
            return Err(format!("its version is {}", self.bregma_session));
        }
        if self.volumes.is_empty() {
            return Err("it holds no scans".into());
        }
        if self.volumes.len() != self.scene.layers.len() {
            return Err(format!("it has {} volumes but {} layers", self.volumes.len(), self.scene.layers.len()));
        }
        if self.scene.layers.iter().any(|l| !l.transform.is_finite() || l.transform.matrix3.determinant() == 0.0) {
            return Err("one of its transforms cannot be inverted".into());
        }
        for transfer in self.scene.layers.iter_mut().filter_map(|l| l.transfer.as_mut()) {
            let mut own = transfer.clone();
            // Of points at one value, as an isovalue at the end of the range makes them, one is enough.
            own.points.dedup_by(|b, a| a.value == b.value);
            let name = own.name.clone();
            *transfer = own.checked().map_err(|e| format!("its transfer function {name} {e}"))?;
        }
        self.scene.clips.iter_mut().for_each(Clip::normalize);
        self.scene.check().map_err(|e| e.to_string())?;
        if !self.compare.is_sound() {
            return Err("how it compares scans has a number that cannot be".into());
        }
        if self.slices.is_some_and(|slices| !slices.is_sound()) {
            return Err("its slices go through no point, or are turned by nothing".into());
        }
        if let Some(pose) = self.poses.iter().find(|pose| !pose.is_sound()) {
            return Err(format!("its kept registration {} cannot be inverted", pose.name));
        }
        Ok(self)
    }

    /// Writes it to `file`.
    pub fn write(&self, file: &Path) -> Result<(), OutputError> {
        let text = serde_json::to_string_pretty(self).expect("a session has only numbers, texts and lists");
        write_whole(file, text.as_bytes())
    }
}

/// A session as this version writes it: before transparent surfaces were a mode of their own, the scene said of isosurfaces whether they are.
fn renewed(mut session: serde_json::Value) -> serde_json::Value {
    if let Some(scene) = session.get_mut("scene")
        && scene["mode"] == "iso"
        && scene["transparent"] == true
    {
        scene["mode"] = "transparent".into();
    }
    session
}
