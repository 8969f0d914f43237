//! From what the person names to what is drawn: files with their registration, a session, or the built-in pair.

use bregma_renderer::{Layer, Scene};
use bregma_synthetic::Which;
use bregma_volume::formats::{self, Hints, OpenError};
use bregma_volume::{Cancelled, Progress, TransformError, Volume, read_transform};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use thiserror::Error;

/// A scan as the person names it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Source {
    /// The file; in a session relative to the session's folder.
    pub file: PathBuf,
    /// Its spacing, where the file does not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spacing_mm: Option<DVec3>,
    /// Its layout, where it has no header, in the words of `--raw`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub raw: Option<String>,
    /// A registration file that moves it; a session holds the matrix in its scene instead.
    #[serde(skip)]
    pub transform: Option<PathBuf>,
}

/// What a session file holds: scans and the scene they were left in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Session {
    /// Version of the form; 1.
    pub bregma_session: u32,
    /// The scans.
    pub volumes: Vec<Source>,
    /// One layer for each, and the view.
    pub scene: Scene,
}

/// Volumes in memory and the scene to begin with.
#[derive(Clone, Debug)]
pub struct Opened {
    /// Where they came from; empty for the built-in pair.
    pub sources: Vec<Source>,
    /// The scans.
    pub volumes: Vec<Arc<Volume>>,
    /// One layer for each of them.
    pub scene: Scene,
}

/// Why nothing was opened. Each sentence names the file.
#[derive(Debug, Error)]
pub enum InputError {
    /// A scan.
    #[error(transparent)]
    Scan(#[from] OpenError),
    /// A registration.
    #[error(transparent)]
    Transform(#[from] TransformError),
    /// A session.
    #[error("{file}: is not a session that this version reads ({reason}); open the scans themselves")]
    Session {
        /// The session file.
        file: String,
        /// What is wrong with it.
        reason: String,
    },
    /// Stopped by request.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Samples along the longest side of the built-in pair.
pub const DEMO_SIZE: usize = 256;

impl Opened {
    /// `volumes` in the scene that they open with.
    pub fn new(sources: Vec<Source>, volumes: Vec<Arc<Volume>>) -> Self {
        let scene = Scene::of(&volumes);
        Self { sources, volumes, scene }
    }

    /// The built-in demo pair.
    pub fn demo(size: usize, progress: &Progress) -> Result<Self, InputError> {
        let pair = [Which::A, Which::B].map(|which| bregma_synthetic::skull(which, size, progress).map(Arc::new));
        let [a, b] = pair;
        Ok(Self::new(vec![], vec![a?, b?]))
    }

    /// Reads scans, each with its registration, or one session.
    pub fn read(sources: &[Source], progress: &Progress) -> Result<Self, InputError> {
        if let [only] = sources
            && let Some(session) = Session::read(&only.file)?
        {
            let volumes = read_volumes(&session.volumes, progress)?;
            return Ok(Self { sources: session.volumes, volumes, scene: session.scene });
        }
        let volumes = read_volumes(sources, progress)?;
        let mut opened = Self::new(sources.to_vec(), volumes);
        for (n, source) in sources.iter().enumerate() {
            if let Some(file) = &source.transform {
                let names = opened.volumes.iter().enumerate().filter(|(m, _)| *m != n).map(|(_, v)| v.name());
                opened.scene.layers[n].transform = read_transform(file, opened.volumes[n].name(), &names.collect::<Vec<_>>())?;
            }
        }
        opened.look_from_the_front();
        Ok(opened)
    }

    /// Adds what another reading brought, as layers of this scene; the view stays.
    pub fn add(&mut self, other: Self) {
        let count = self.volumes.len() + other.volumes.len();
        for (n, (volume, layer)) in other.volumes.iter().zip(other.scene.layers).enumerate() {
            let fresh = Layer::new(volume, self.volumes.len() + n, count);
            self.scene.layers.push(Layer { color: fresh.color, ..layer });
        }
        self.sources.extend(other.sources);
        self.volumes.extend(other.volumes);
    }

    /// The sphere around all visible volumes where the scene puts them.
    pub fn bounds(&self) -> bregma_renderer::Bounds {
        let surfaces = self.scene.surfaces(&self.volumes).unwrap_or_default();
        bregma_renderer::Bounds::of(surfaces.iter().map(|(_, s)| &s.grid))
    }

    fn look_from_the_front(&mut self) {
        self.scene.camera = bregma_renderer::Camera::orbit(&self.bounds(), 0.0, 0.0);
    }

    /// What people should know about the scans and their isovalues before they trust a picture or a number.
    pub fn warnings(&self) -> Vec<String> {
        let of_files = self.volumes.iter().flat_map(|v| v.warnings().iter().map(move |w| format!("{}: {w}", v.name())));
        let outside = self.volumes.iter().zip(&self.scene.layers).filter_map(|(v, layer)| {
            let [low, high] = v.range();
            let text = format!("{}: the isovalue {} lies outside its range, {low} to {high}: nothing of it is drawn", v.name(), layer.iso);
            (!(low..=high).contains(&layer.iso)).then_some(text)
        });
        of_files.chain(outside).collect()
    }
}

fn read_volumes(sources: &[Source], progress: &Progress) -> Result<Vec<Arc<Volume>>, InputError> {
    let read = |source: &Source| {
        let raw = source.raw.as_ref().map(|text| text.parse()).transpose();
        let raw = raw
            .map_err(|e: formats::RawLayoutError| InputError::Session { file: source.file.display().to_string(), reason: e.to_string() })?;
        let hints = Hints { spacing_mm: source.spacing_mm, raw };
        Ok(Arc::new(formats::open(&source.file, &hints, progress)?))
    };
    sources.iter().map(read).collect()
}

/// A file larger than this is no session, so its text is not read.
const SESSION_BYTES: u64 = 64 << 20;

impl Session {
    /// The session in `file`; `None` when it is something else.
    fn read(file: &Path) -> Result<Option<Self>, InputError> {
        let small = std::fs::metadata(file).is_ok_and(|m| m.is_file() && m.len() <= SESSION_BYTES);
        let is_json = file.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
        let Some(text) = (small && is_json).then(|| std::fs::read_to_string(file).ok()).flatten() else { return Ok(None) };
        let fail = |reason: String| InputError::Session { file: file.display().to_string(), reason };
        let mut session: Self = serde_json::from_str(&text).map_err(|e| fail(e.to_string()))?;
        if session.bregma_session != 1 {
            return Err(fail(format!("its version is {}", session.bregma_session)));
        }
        if session.volumes.len() != session.scene.layers.len() {
            return Err(fail(format!("it has {} volumes but {} layers", session.volumes.len(), session.scene.layers.len())));
        }
        let folder = file.parent().unwrap_or(Path::new(""));
        for source in &mut session.volumes {
            source.file = folder.join(&source.file);
        }
        Ok(Some(session))
    }

    /// The session of `opened`, with files named relative to `folder` where they lie below it.
    pub fn of(opened: &Opened, folder: &Path) -> Self {
        let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
        let name = |file: &Path| {
            let file = std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
            file.strip_prefix(&folder).map(Path::to_owned).unwrap_or(file)
        };
        let volumes = opened.sources.iter().map(|s| Source { file: name(&s.file), ..s.clone() }).collect();
        Self { bregma_session: 1, volumes, scene: opened.scene.clone() }
    }
}
