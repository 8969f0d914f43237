//! From what the person names to what is drawn: files with their registrations and landmarks, a session, or the built-in pair.

use crate::compare::Compare;
use crate::film::Film;
use crate::kind::Kind;
use crate::labelled::PartOfError;
use crate::measurement::Measurement;
use crate::poses::KeptPose;
use crate::session_file::{Session, SessionError};
use crate::slices::Slices;
use crate::source::Source;
use bregma_field::formats::{OpenError, Scan};
use bregma_field::solid::Side;
use bregma_field::{BRICK, Cancelled, Grid, IndexPoint, Progress, Registration, Surface, TransformError, Volume, read_transform};
use bregma_measure::landmarks::{Landmark, LandmarkError};
use bregma_measure::numbers::significant;
use bregma_renderer::{Layer, MOST_VOLUMES, Mode, Scene};
use bregma_synthetic::Which;
use glam::DVec3;
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use thiserror::Error;

/// Volumes in memory and the scene to begin with.
///
/// ```
/// use bregma_session::Opened;
///
/// // The built-in pair; `Opened::read` takes files.
/// let opened = Opened::demo(16, &Default::default())?;
/// assert_eq!((opened.volumes.len(), opened.scene.layers.len()), (2, 2));
/// assert!(opened.warnings().is_empty());
/// # Ok::<(), bregma_session::InputError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Opened {
    /// Where they came from.
    pub sources: Vec<Source>,
    /// The scans.
    pub volumes: Vec<Arc<Volume>>,
    /// One layer for each of them.
    pub scene: Scene,
    /// The view is a session's, not the one that scans open with.
    pub from_session: bool,
    /// What was measured in a session.
    pub measurements: Vec<Measurement>,
    /// Landmarks of a session.
    pub landmarks: Vec<Landmark>,
    /// How the scans are compared.
    pub compare: Compare,
    /// Which two are, instead of the first two visible ones.
    pub pair: Option<[usize; 2]>,
    /// How slices are looked at.
    pub slices: Slices,
    /// The box of each scan is drawn.
    pub boxes: bool,
    /// Registrations that are kept beside those that stand.
    pub poses: Vec<KeptPose>,
    /// What there is to say of label maps.
    pub notes: Vec<String>,
    /// What moves, once somebody has said so. Shared: a recording has thousands of keys, and undo many states.
    pub film: Option<Arc<Film>>,
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
    #[error(transparent)]
    Session(#[from] SessionError),
    /// More scans than a picture can number.
    #[error("{0} scans are named; at most {MOST_VOLUMES} can be opened together")]
    TooMany(usize),
    /// Landmarks.
    #[error(transparent)]
    Landmarks(#[from] LandmarkError),
    /// A registration that may be of several scans.
    #[error("{}: does not say which of the scans it moves; pass it as --transform behind that scan", .0.display())]
    Unplaced(PathBuf),
    /// Nothing to look at.
    #[error("{}: belongs to a scan; name the scan, too", .0.display())]
    NoScan(PathBuf),
    /// A part of a scan.
    #[error(transparent)]
    Part(#[from] Box<PartOfError>),
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
        let slices = Slices::of(&volumes.iter().map(|volume| volume.grid().clone()).collect::<Vec<_>>());
        let (measurements, landmarks, poses) = (vec![], vec![], vec![]);
        let (from_session, compare, boxes) = (false, Compare::Off, false);
        let (pair, notes, film) = (None, vec![], None);
        Self { sources, volumes, scene, from_session, measurements, landmarks, compare, pair, slices, boxes, poses, notes, film }
    }

    /// The built-in demo pair.
    pub fn demo(size: usize, progress: &Progress) -> Result<Self, InputError> {
        let sources = [Which::A, Which::B].map(|which| Source::built_in(which, size));
        let volumes = sources.iter().map(|source| load(source, progress)).collect::<Result<_, _>>()?;
        Ok(Self::new(sources.into(), volumes))
    }

    /// Reads scans, each with its registration, and sessions with theirs, as well as landmarks and registrations in files of their own. The
    /// view is that of a session that is alone. Fails by the first file that cannot be used.
    pub fn read(sources: &[Source], progress: &Progress) -> Result<Self, InputError> {
        let mut opened = Self::read_whole(sources, progress)?;
        opened.find_parts(progress)?;
        Ok(opened)
    }

    /// The same for who changes isovalues before parts are found, by [`Self::find_parts`].
    pub fn read_whole(sources: &[Source], progress: &Progress) -> Result<Self, InputError> {
        let opened = Self::gather(sources, progress, &mut Err)?;
        match sources.first() {
            Some(first) if opened.volumes.is_empty() => Err(InputError::NoScan(first.file.clone())),
            _ => Ok(opened),
        }
    }

    /// The same of what can be used, and why the rest cannot. Landmarks may come without a scan. Fails if nothing can be used, or by request.
    pub fn read_what_opens(sources: &[Source], progress: &Progress) -> Result<(Self, Vec<InputError>), InputError> {
        let mut errors = vec![];
        let mut put_by = |error| match error {
            InputError::TooMany(_) => Err(error),
            // By request.
            error if progress.advance(0).is_err() => Err(error),
            error => {
                errors.push(error);
                Ok(())
            }
        };
        let mut opened = Self::gather(sources, progress, &mut put_by)?;
        opened.find_parts(progress).or_else(&mut put_by)?;
        let is_empty = opened.volumes.is_empty() && opened.landmarks.is_empty();
        if is_empty && !errors.is_empty() { Err(errors.remove(0)) } else { Ok((opened, errors)) }
    }

    fn gather(sources: &[Source], progress: &Progress, on_error: OnError<'_>) -> Result<Self, InputError> {
        let (expanded, mut sessions) = expand(sources, progress, on_error)?;
        let mut read = vec![];
        for (source, layer) in expanded {
            match load(&source, progress) {
                Ok(volume) => read.push((source, volume, layer)),
                Err(error) => {
                    on_error(error)?;
                    // A session without one of its scans is no session: what opens of it are scans.
                    sessions.clear();
                }
            }
        }
        let (sources_read, volumes) = read.iter().map(|(source, volume, _)| (source.clone(), Arc::clone(volume))).unzip();
        let mut opened = Self::new(sources_read, volumes);
        for (n, (_, _, layer)) in read.into_iter().enumerate() {
            if let Some(layer) = layer {
                opened.scene.layers[n] = layer;
            } else if let Some(file) = opened.sources[n].transform.clone() {
                opened.registered(n, &file).or_else(&mut *on_error)?;
                if opened.scene.layers[n].transform.matrix3.determinant() < 0.0 {
                    let name = opened.sources[n].name();
                    opened.rename(n, &format!("mirror image of {name}"));
                }
            }
        }
        opened.take_sessions(sessions);
        for source in sources {
            let taken = match Kind::of(source) {
                Kind::Landmarks => opened.take_landmarks(&source.file),
                Kind::Registration => opened.register(&source.file).map(|_| ()),
                Kind::Scan | Kind::Session => Ok(()),
            };
            taken.or_else(&mut *on_error)?;
        }
        Ok(opened)
    }

    /// Finds what of each scan is meant. Of a part that is not found nothing stays: the scan is whole.
    pub fn find_parts(&mut self, progress: &Progress) -> Result<(), InputError> {
        let mut found = Ok(());
        self.notes.clear();
        for (n, source) in self.sources.iter_mut().enumerate() {
            let (volume, layer) = (&self.volumes[n], &mut self.scene.layers[n]);
            let Some(part) = source.within.as_ref() else { continue };
            match part.find(volume, layer, progress) {
                Ok((labelled, within, notes)) => {
                    layer.within = within;
                    self.notes.extend(notes.into_iter().map(|note| format!("{}: {note}", part.file.display())));
                    source.labels = Some(labelled);
                }
                Err(error) => found = Err(Box::new(error).into()),
            }
        }
        self.scene.layers.iter_mut().filter(|layer| layer.solid().is_none()).for_each(|layer| layer.within = None);
        found
    }

    /// Takes from sessions all but their scans: everything of one that is alone, else cuts, landmarks and kept registrations.
    fn take_sessions(&mut self, mut sessions: Vec<Placed>) {
        match sessions.pop() {
            Some((_, only)) if only.volumes.len() == self.volumes.len() => {
                (self.scene, self.from_session) = (only.scene, true);
                (self.measurements, self.landmarks) = (only.measurements, only.landmarks);
                (self.compare, self.pair) = (only.compare, only.pair);
                self.slices = only.slices.unwrap_or(self.slices);
                (self.boxes, self.poses, self.film) = (only.boxes, only.poses, only.film.map(Arc::new));
            }
            last => {
                // Each cuts its own scans as before.
                for (first, session) in sessions.iter().chain(&last) {
                    self.scene.clips.extend(session.scene.clips.iter().map(|clip| clip.moved(*first, session.volumes.len())));
                    self.landmarks.extend(session.landmarks.iter().cloned());
                    self.poses.extend(session.poses.iter().cloned());
                }
                self.look_from_the_front();
            }
        }
    }

    /// Adds the landmarks of a file. One that belongs to a scan that is not open belongs to none.
    pub fn take_landmarks(&mut self, file: &Path) -> Result<(), InputError> {
        // They know their scan by the name that it has here, or by its file's.
        let by_name = |scan: &str| self.volumes.iter().position(|v| v.name() == scan);
        let by_file = |scan: &str| self.sources.iter().position(|source| source.file_name() == scan);
        let open = |scan: String| Some(self.volumes[by_name(&scan).or_else(|| by_file(&scan))?].name().to_owned());
        let mut landmarks = bregma_measure::landmarks::read(file)?;
        landmarks.iter_mut().for_each(|l| l.scan = l.scan.take().and_then(open));
        self.landmarks.extend(landmarks);
        Ok(())
    }

    /// Moves a scan as a file of a registration says, and returns its number: the one that the file names, else the only one, or the second of two.
    pub fn register(&mut self, file: &Path) -> Result<usize, InputError> {
        let count = self.volumes.len();
        let read = |n: usize| self.registration(n, file);
        let moved = match (0..count).filter(|n| read(*n).is_ok()).collect::<Vec<_>>()[..] {
            [] if count == 0 => return Err(InputError::NoScan(file.to_owned())),
            // What is wrong with it is wrong for all.
            [] => return read(count - 1).and(Err(InputError::Unplaced(file.to_owned()))),
            [only] => only,
            [_, second] if count == 2 => second,
            _ => return Err(InputError::Unplaced(file.to_owned())),
        };
        self.registered(moved, file).map(|()| moved)
    }

    fn registration(&self, n: usize, file: &Path) -> Result<Registration, InputError> {
        let by = |names: &[String]| {
            let others: Vec<&str> = names.iter().enumerate().filter(|(m, _)| *m != n).map(|(_, name)| name.as_str()).collect();
            read_transform(file, &names[n], &others)
        };
        // It knows scans by the names that they have here, or by their files'. Scans made in the program have no sources.
        let names: Vec<String> = self.volumes.iter().map(|v| v.name().to_owned()).collect();
        let files: Vec<String> = self.sources.iter().map(Source::file_name).collect();
        Ok(by(&names).or_else(|error| if files.len() == names.len() { by(&files).map_err(|_| error) } else { Err(error) })?)
    }

    fn registered(&mut self, n: usize, file: &Path) -> Result<(), InputError> {
        let Registration { transform, residual_mm, covariance } = self.registration(n, file)?;
        let layer = &mut self.scene.layers[n];
        (layer.transform, layer.residual_mm, layer.covariance) = (transform, residual_mm, covariance);
        Ok(())
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
        self.landmarks.extend(other.landmarks);
        self.poses.extend(other.poses);
    }

    /// The sphere around all visible volumes where the scene puts them.
    pub fn bounds(&self) -> bregma_renderer::Bounds {
        bregma_renderer::Bounds::of(&self.grids())
    }

    /// The grids of all visible volumes where the scene puts them.
    pub fn grids(&self) -> Vec<Grid> {
        self.scene.surfaces(&self.volumes).unwrap_or_default().into_iter().map(|(_, surface)| surface.grid).collect()
    }

    /// Points around all that is seen of the visible volumes' surfaces where the scene puts them: corners of the blocks that they pass.
    pub fn bone_points_mm(&self) -> Vec<DVec3> {
        self.scene.surfaces(&self.volumes).unwrap_or_default().iter().flat_map(|(_, surface)| bone_points(surface)).collect()
    }

    /// The look that scans open with: two or more laid over each other, seen from before and the left, as large as a picture that is `aspect`
    /// times as wide as high holds them. A session keeps its own.
    pub fn first_look(&mut self, aspect: f64) {
        if self.from_session {
            return;
        }
        if self.volumes.len() > 1 {
            self.scene.mode = Mode::Overlay;
        }
        let mut points = self.bone_points_mm();
        if points.is_empty() {
            points = self.volumes.iter().flat_map(|v| v.grid().corners_mm()).collect();
        }
        self.scene.camera = bregma_renderer::Camera::framing(&points, 35.0, 10.0, aspect);
    }

    fn look_from_the_front(&mut self) {
        self.scene.camera = bregma_renderer::Camera::orbit(&self.bounds(), 0.0, 0.0);
    }

    /// In one sentence, what is unlike about the thresholds or units that the visible scans are measured at; `None` where nothing is. Rays have
    /// it among their notes.
    pub fn unlike_thresholds(&self) -> Option<String> {
        let visible = self.volumes.iter().zip(&self.scene.layers).filter(|(_, layer)| layer.visible);
        bregma_measure::unlike_thresholds(&visible.map(|(volume, layer)| (volume.name(), layer.iso, volume.unit())).collect::<Vec<_>>())
    }

    /// What was corrected of where the scans lie, and which are mirrored, each a sentence that names its scan. All that is measured on them has these
    /// beside it.
    pub fn corrections(&self) -> Vec<String> {
        self.volumes.iter().flat_map(|v| bregma_measure::corrections(v)).chain(self.mirrored()).collect()
    }

    fn mirrored(&self) -> impl Iterator<Item = String> {
        let scans = self.volumes.iter().zip(&self.scene.layers);
        scans.filter_map(|(v, layer)| bregma_measure::mirrored(v.name(), &layer.transform))
    }

    /// What people should know about the scans and their isovalues before they trust a picture or a number.
    pub fn warnings(&self) -> Vec<String> {
        let of_files = self.volumes.iter().flat_map(|v| v.warnings().iter().map(move |w| format!("{}: {w}", v.name())));
        let outside = self.volumes.iter().zip(&self.scene.layers).filter(|(_, layer)| layer.visible).filter_map(|(v, layer)| {
            let [low, high] = v.range();
            let what = if layer.iso < low { "all of its box is bone" } else { "nothing of it is" };
            let [iso, first, last] = [layer.iso, low, high].map(|value| significant(value, 6));
            let text = format!("{}: the isovalue {iso} lies outside its range, {first} to {last}: {what}", v.name());
            (!(low..=high).contains(&layer.iso)).then_some(text)
        });
        of_files.chain(outside).chain(self.notes.iter().cloned()).chain(self.mirrored()).collect()
    }
}

/// Corners of the first and the last block of each row that the surface passes.
fn bone_points(surface: &Surface) -> Vec<DVec3> {
    let bricks = surface.volume.bricks();
    let ([nx, ny, _], last) = (bricks.dims(), surface.grid.dims().map(|n| n - 1));
    let is_left = |brick: usize| surface.solid.as_ref().is_none_or(|solid| solid.sides()[brick] != Side::Outside);
    let passes = |[low, high]: &[f32; 2]| (f64::from(*low)..=f64::from(*high)).contains(&surface.level);
    let rows = bricks.ranges().chunks(nx.max(1)).enumerate();
    let ends = rows.filter_map(|(row, ranges)| {
        let is_seen = |n: &usize| passes(&ranges[*n]) && is_left(row * nx + n);
        let (first, last) = ((0..ranges.len()).find(is_seen)?, (0..ranges.len()).rfind(is_seen)?);
        Some([[first, row % ny, row / ny], [last, row % ny, row / ny]])
    });
    let corners = |brick: [usize; 3]| {
        (0..8).map(move |n| {
            let corner: [f64; 3] = std::array::from_fn(|axis| ((brick[axis] + (n >> axis & 1)) * BRICK).min(last[axis]) as f64);
            surface.grid.world(IndexPoint(corner.into())).0
        })
    };
    ends.flatten().flat_map(corners).collect()
}

/// The scan of a source in memory.
fn load(source: &Source, progress: &Progress) -> Result<Arc<Volume>, InputError> {
    Ok(Arc::new(match source.built_in {
        Some(skull) => {
            let made = skull.scan(progress)?.corrected(source.correction());
            made.map_err(|reason| OpenError { file: source.file.clone(), reason: reason.into() })?.renamed(&source.name())
        }
        None => source.scan(progress)?.load(progress)?,
    }))
}

/// A scan, and the layer that a session has for it.
type Expanded = (Source, Option<Layer>);
/// The number of a session's first scan, and the session.
type Placed = (usize, Session);

/// What is done with an error: it ends the reading, or is put by.
type OnError<'a> = &'a mut dyn FnMut(InputError) -> Result<(), InputError>;

/// The scans that are named, those of sessions among them, and the sessions. Files of one series name one scan.
fn expand(sources: &[Source], progress: &Progress, on_error: OnError<'_>) -> Result<(Vec<Expanded>, Vec<Placed>), InputError> {
    let (mut expanded, mut sessions) = (vec![], vec![]);
    let mut named = HashSet::new();
    let place = |file: &Path| std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
    for source in sources.iter().filter(|source| matches!(Kind::of(source), Kind::Scan | Kind::Session)) {
        let session = match Session::read(source) {
            Ok(session) => session,
            Err(error) => {
                on_error(error.into())?;
                continue;
            }
        };
        match session {
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

/// Whether two lists hold the same scans, not merely equal ones.
pub fn same_scans(a: &[Arc<Volume>], b: &[Arc<Volume>]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| Arc::ptr_eq(a, b))
}

/// The first scan whose file does not say how far its samples are apart, when the person does not say either.
pub fn without_spacing(sources: &[Source], progress: &Progress) -> Result<Option<usize>, InputError> {
    // What cannot be read is told when it is read.
    for (source, layer) in expand(sources, progress, &mut |_| Ok(()))?.0 {
        let asks = || source.built_in.is_none() && source.scan(progress).is_ok_and(|scan| !scan.spacing_is_stated());
        if layer.is_none() && source.spacing_mm.is_none() && asks() {
            return Ok(sources.iter().position(|s| *s == source));
        }
    }
    Ok(None)
}

/// The headers of the scans that are named, those of sessions among them.
pub fn scans(sources: &[Source], progress: &Progress) -> Result<Vec<Scan>, InputError> {
    expand(sources, progress, &mut Err)?.0.iter().map(|(source, _)| Ok(source.scan(progress)?)).collect()
}

impl Session {
    /// The session of `opened`, with files named relative to `folder` where they lie below it.
    pub fn of(opened: &Opened, folder: &Path) -> Self {
        let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
        let named = |source: &Source| {
            let source = source.absolute();
            let within = source.within.as_ref().map(|within| within.below(&folder));
            Source { within, file: source.file.strip_prefix(&folder).map(Path::to_owned).unwrap_or(source.file.clone()), ..source }
        };
        let volumes = opened.sources.iter().map(named).collect();
        Self {
            bregma_session: 1,
            volumes,
            scene: opened.scene.clone(),
            measurements: opened.measurements.clone(),
            landmarks: opened.landmarks.clone(),
            compare: opened.compare,
            pair: opened.pair,
            slices: Some(opened.slices),
            boxes: opened.boxes,
            poses: opened.poses.clone(),
            film: opened.film.as_deref().cloned(),
        }
    }
}
