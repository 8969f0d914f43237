//! From what the person names to what is drawn: files with their registration, a session, or the built-in pair.

use crate::compare::Compare;
use crate::look::PER_VOXEL;
use bregma_field::formats::{self, Hints, OpenError, Reduce, Scan, Uneven};
use bregma_field::{Cancelled, Progress, TransformError, Volume, read_transform};
use bregma_renderer::{Clip, Integrator, Layer, Projection, Scene};
use bregma_synthetic::Which;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::collections::HashSet;
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
    /// Only every 2nd or 4th sample along each axis is read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reduce: Option<Reduce>,
    /// What is done with slices that are not evenly spaced.
    #[serde(default, skip_serializing_if = "Uneven::is_default")]
    pub uneven: Uneven,
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
    /// Difference rays with what they were measured on, see [`crate::record`].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub measurements: Vec<serde_json::Value>,
    /// Landmarks.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub landmarks: Vec<Landmark>,
    /// How the scans are compared.
    #[serde(default, skip_serializing_if = "Compare::is_off")]
    pub compare: Compare,
}

/// A point on a surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Landmark {
    /// What the person calls it.
    pub name: String,
    /// LPS mm; on the interpolant's surface to float64 precision.
    pub point_mm: DVec3,
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
    /// The view is a session's, not the one that scans open with.
    pub from_session: bool,
    /// Difference rays of a session.
    pub measurements: Vec<serde_json::Value>,
    /// Landmarks of a session.
    pub landmarks: Vec<Landmark>,
    /// How the scans are compared.
    pub compare: Compare,
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
    /// More scans than a picture can number.
    #[error("{0} scans are named; at most {MOST_VOLUMES} can be opened together")]
    TooMany(usize),
    /// Stopped by request.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Volumes are numbered by a byte in pictures, 0 standing for none.
const MOST_VOLUMES: usize = 255;

/// Samples along the longest side of the built-in pair.
pub const DEMO_SIZE: usize = 256;

impl Opened {
    /// `volumes` in the scene that they open with.
    pub fn new(sources: Vec<Source>, volumes: Vec<Arc<Volume>>) -> Self {
        let scene = Scene::of(&volumes);
        Self { sources, volumes, scene, from_session: false, measurements: vec![], landmarks: vec![], compare: Compare::Off }
    }

    /// The built-in demo pair.
    pub fn demo(size: usize, progress: &Progress) -> Result<Self, InputError> {
        let pair = [Which::A, Which::B].map(|which| bregma_synthetic::skull(which, size, progress).map(Arc::new));
        let [a, b] = pair;
        Ok(Self::new(vec![], vec![a?, b?]))
    }

    /// Reads scans, each with its registration, and sessions with theirs. The view is that of a session that is alone.
    pub fn read(sources: &[Source], progress: &Progress) -> Result<Self, InputError> {
        let (expanded, mut sessions) = expand(sources, progress)?;
        let (sources, layers): (Vec<Source>, Vec<Option<Layer>>) = expanded.into_iter().unzip();
        let volumes: Result<Vec<_>, InputError> =
            sources.iter().map(|source| Ok(Arc::new(source.scan(progress)?.load(progress)?))).collect();
        let volumes = volumes?;
        let mut opened = Self::new(sources, volumes);
        for (n, layer) in layers.into_iter().enumerate() {
            if let Some(layer) = layer {
                opened.scene.layers[n] = layer;
            } else if let Some(file) = &opened.sources[n].transform {
                let names = opened.volumes.iter().enumerate().filter(|(m, _)| *m != n).map(|(_, v)| v.name());
                let registration = read_transform(file, opened.volumes[n].name(), &names.collect::<Vec<_>>())?;
                (opened.scene.layers[n].transform, opened.scene.layers[n].residual_mm) = (registration.transform, registration.residual_mm);
            }
        }
        match sessions.pop() {
            Some((_, only)) if only.volumes.len() == opened.volumes.len() => {
                (opened.scene, opened.from_session) = (only.scene, true);
                (opened.measurements, opened.landmarks, opened.compare) = (only.measurements, only.landmarks, only.compare);
            }
            last => {
                // Each cuts its own scans as before.
                for (first, session) in sessions.iter().chain(&last) {
                    opened.scene.clips.extend(session.scene.clips.iter().map(|clip| clip.moved(*first, session.volumes.len())));
                }
                opened.look_from_the_front();
            }
        }
        Ok(opened)
    }

    /// Adds what another reading brought, as layers of this scene; the view stays.
    pub fn add(&mut self, other: Self) {
        let count = self.volumes.len() + other.volumes.len();
        let cuts = other.scene.clips.iter().map(|clip| clip.moved(self.volumes.len(), other.volumes.len()));
        self.scene.clips.extend(cuts);
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
        let outside = self.volumes.iter().zip(&self.scene.layers).filter(|(_, layer)| layer.visible).filter_map(|(v, layer)| {
            let [low, high] = v.range();
            let what = if layer.iso < low { "all of its box is bone" } else { "nothing of it is" };
            let text = format!("{}: the isovalue {} lies outside its range, {low} to {high}: {what}", v.name(), layer.iso);
            (!(low..=high).contains(&layer.iso)).then_some(text)
        });
        of_files.chain(outside).collect()
    }
}

impl Source {
    /// Reads the headers of the scan.
    pub fn scan(&self, progress: &Progress) -> Result<Scan, OpenError> {
        // `--raw` and sessions were checked when they were read.
        let raw = self.raw.as_ref().and_then(|text| text.parse().ok());
        let hints = Hints { spacing_mm: self.spacing_mm, raw, reduce: self.reduce, uneven: self.uneven, series: None };
        formats::scan(&self.file, &hints, progress)
    }
}

/// A scan, and the layer that a session has for it.
type Expanded = (Source, Option<Layer>);
/// The number of a session's first scan, and the session.
type Placed = (usize, Session);

/// The scans that are named, those of sessions among them, and the sessions. Files of one series name one scan.
fn expand(sources: &[Source], progress: &Progress) -> Result<(Vec<Expanded>, Vec<Placed>), InputError> {
    let (mut expanded, mut sessions) = (vec![], vec![]);
    let mut named = HashSet::new();
    let place = |file: &Path| std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
    for source in sources {
        match Session::read(source)? {
            None if named.contains(&place(&source.file)) => {}
            None => {
                // One file needs no looking into; what cannot be read is told when its turn comes.
                if sources.len() > 1
                    && let Ok(scan) = source.scan(progress)
                {
                    named.extend(scan.series().iter().filter(|file| **file != source.file).map(|file| place(file)));
                }
                expanded.push((source.clone(), None));
            }
            Some(session) => {
                let first = expanded.len();
                expanded.extend(session.volumes.iter().cloned().zip(session.scene.layers.iter().cloned().map(Some)));
                sessions.push((first, session));
            }
        }
    }
    if expanded.len() > MOST_VOLUMES {
        return Err(InputError::TooMany(expanded.len()));
    }
    Ok((expanded, sessions))
}

/// The first scan whose file does not say how far its samples are apart, when the person does not say either.
pub fn without_spacing(sources: &[Source], progress: &Progress) -> Result<Option<usize>, InputError> {
    for (source, layer) in expand(sources, progress)?.0 {
        if layer.is_none() && source.spacing_mm.is_none() && !source.scan(progress)?.spacing_is_stated() {
            return Ok(sources.iter().position(|s| *s == source));
        }
    }
    Ok(None)
}

/// The headers of the scans that are named, those of sessions among them.
pub fn scans(sources: &[Source], progress: &Progress) -> Result<Vec<Scan>, InputError> {
    expand(sources, progress)?.0.iter().map(|(source, _)| Ok(source.scan(progress)?)).collect()
}

/// A file larger than this is no session, so its text is not read.
const SESSION_BYTES: u64 = 64 << 20;

impl Session {
    /// The session in a source; `None` when it is something else.
    fn read(source: &Source) -> Result<Option<Self>, InputError> {
        let file = source.file.as_path();
        let small = std::fs::metadata(file).is_ok_and(|m| m.is_file() && m.len() <= SESSION_BYTES);
        let is_json = file.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
        if !(small && is_json) || source.raw.is_some() {
            return Ok(None);
        }
        let fail = |reason: String| InputError::Session { file: file.display().to_string(), reason };
        let text = std::fs::read_to_string(file).map_err(|e| fail(e.to_string()))?;
        let mut session: Self = serde_json::from_str(&text).map_err(|e| fail(e.to_string()))?;
        if session.bregma_session != 1 {
            return Err(fail(format!("its version is {}", session.bregma_session)));
        }
        if session.volumes.is_empty() {
            return Err(fail("it holds no scans".into()));
        }
        if session.volumes.len() != session.scene.layers.len() {
            return Err(fail(format!("it has {} volumes but {} layers", session.volumes.len(), session.scene.layers.len())));
        }
        if source.transform.is_some() || source.spacing_mm.is_some() {
            return Err(fail("a session has transforms and spacings of its own: --transform and --spacing are for scans".into()));
        }
        if session.scene.layers.iter().any(|l| !l.transform.is_finite() || l.transform.matrix3.determinant() == 0.0) {
            return Err(fail("one of its transforms cannot be inverted".into()));
        }
        for transfer in session.scene.layers.iter_mut().filter_map(|l| l.transfer.as_mut()) {
            let mut own = transfer.clone();
            // Of points at one value, as an isovalue at the end of the range makes them, one is enough.
            own.points.dedup_by(|b, a| a.value == b.value);
            let name = own.name.clone();
            *transfer = own.checked().map_err(|e| fail(format!("its transfer function {name} {e}")))?;
        }
        session.scene.clips.iter_mut().for_each(Clip::normalize);
        if let Some(flaw) = session.flaw() {
            return Err(fail(flaw.into()));
        }
        let folder = file.parent().unwrap_or(Path::new(""));
        for volume in &mut session.volumes {
            if let Some(Err(e)) = volume.raw.as_ref().map(|text| text.parse::<formats::RawLayout>()) {
                return Err(fail(e.to_string()));
            }
            volume.file = folder.join(&volume.file);
        }
        Ok(Some(session))
    }

    /// What of the scene no renderer could draw, if anything.
    fn flaw(&self) -> Option<&'static str> {
        let scene = &self.scene;
        let share = |v: f32| (0.0..=1.0).contains(&v);
        let opacities = scene.layers.iter().flat_map(|l| l.shells.iter().map(|s| s.opacity).chain([l.opacity]));
        let fov_deg = if let Projection::Perspective { fov_deg } = scene.camera.projection { fov_deg } else { 30.0 };
        let per_voxel = if let Integrator::Steps { per_voxel, .. } = scene.integrator { per_voxel } else { 1.0 };
        let count = scene.layers.len();
        let of_none = scene.clips.iter().flat_map(|clip| clip.layers.iter().flatten()).any(|n| *n >= count);
        [
            (!scene.clips.iter().all(Clip::is_sound), "one of its cuts has a direction without length, or no size"),
            (of_none, "one of its cuts is of a scan that it has not"),
            (
                !opacities.into_iter().all(share) || !share(scene.depth_cue),
                "one of its opacities, or its depth cue, is not between 0 and 1",
            ),
            (!(PER_VOXEL.contains(&per_voxel)), "its steps in a voxel's length are not between 0.01 and 1000"),
            (!(fov_deg > 0.0 && fov_deg < 180.0), "its field of view is not between 0 and 180 degrees"),
            (scene.window.is_some_and(|w| w.width <= 0.0), "its window has no width"),
            (!self.compare.is_sound(), "how it compares scans has a number that cannot be"),
        ]
        .into_iter()
        .find_map(|(is_flawed, flaw)| is_flawed.then_some(flaw))
    }

    /// The session of `opened`, with files named relative to `folder` where they lie below it.
    pub fn of(opened: &Opened, folder: &Path) -> Self {
        let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
        let name = |file: &Path| {
            let file = std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
            file.strip_prefix(&folder).map(Path::to_owned).unwrap_or(file)
        };
        let volumes = opened.sources.iter().map(|s| Source { file: name(&s.file), ..s.clone() }).collect();
        Self {
            bregma_session: 1,
            volumes,
            scene: opened.scene.clone(),
            measurements: opened.measurements.clone(),
            landmarks: opened.landmarks.clone(),
            compare: opened.compare,
        }
    }
}
