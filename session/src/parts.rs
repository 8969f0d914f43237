//! The part of a scan that is meant: found in a label map, looked at, and measured.

use crate::opened::Opened;
use bregma_field::{Progress, Solid, Surface, Volume, within};
use bregma_parts::{Labels, Meant, PartsError};
use bregma_renderer::{Layer, Within};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::convert::Infallible;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::{Arc, Mutex, PoisonError, Weak};
use thiserror::Error;

/// Parts of a scan as a person names them: `FILE#NAME`, of several `FILE#NAME,NAME`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PartOf {
    /// The label map; in a session relative to the session's folder.
    pub file: PathBuf,
    /// Names of parts in it, or their numbers, with commas between; all of them where it is empty.
    pub names: String,
    /// Whether they are kept, and not all that lies beside them.
    pub keeps: bool,
}

/// Why a part of a scan was not found.
#[derive(Debug, Error)]
pub enum PartOfError {
    /// The label map.
    #[error(transparent)]
    Parts(#[from] PartsError),
    /// It has no such part.
    #[error("{}: has no part called {name}; it has {there}", file.display())]
    NoPart {
        /// The label map.
        file: PathBuf,
        /// What was asked for.
        name: String,
        /// What it has.
        there: String,
    },
    /// It has no parts at all.
    #[error("{}: has no parts: no sample of it has a number above 0", .0.display())]
    Empty(PathBuf),
}

impl FromStr for PartOf {
    type Err = Infallible;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let (file, names) = text.rsplit_once('#').unwrap_or((text, ""));
        Ok(Self { file: file.into(), names: names.into(), keeps: true })
    }
}

impl PartOf {
    /// What of the scan of a layer is meant, looked at as the layer says if it does, and what there is to say of the label map.
    pub(crate) fn find(&self, volume: &Arc<Volume>, layer: &Layer, progress: &Progress) -> Result<(Within, Vec<String>), PartOfError> {
        let (labels, notes) = bregma_parts::read(&self.file, volume, progress)?;
        let numbers = self.numbers(&labels)?;
        let known = layer.within.clone().unwrap_or_else(|| Within {
            part: if self.names.is_empty() { "all parts".into() } else { self.names.clone() },
            keeps: self.keeps,
            grow_mm: 0.0,
            rim_mm: 0.0,
            measures: true,
            solid: None,
        });
        let solid = space(&labels, &numbers, known.grow_mm, (volume, layer), progress)?;
        let solid = if known.keeps { solid } else { solid.inverse() };
        Ok((Within { solid: Some(Arc::new(solid)), ..known }, notes))
    }

    fn numbers(&self, labels: &Labels) -> Result<Vec<u16>, PartOfError> {
        let parts = labels.parts();
        if parts.is_empty() {
            return Err(PartOfError::Empty(self.file.clone()));
        }
        if self.names.is_empty() {
            return Ok(parts.iter().map(|part| part.number).collect());
        }
        // A name may have a comma itself.
        let whole: Vec<u16> = parts.iter().filter(|part| part.name == self.names).map(|part| part.number).collect();
        if !whole.is_empty() {
            return Ok(whole);
        }
        let find = |name: &str| {
            let named = parts.iter().find(|part| part.name == name);
            let number = named.or_else(|| parts.iter().find(|part| part.number.to_string() == name)).map(|part| part.number);
            number.ok_or_else(|| {
                let there = parts.iter().map(|part| part.name.as_str()).collect::<Vec<_>>().join(", ");
                PartOfError::NoPart { file: self.file.clone(), name: name.to_owned(), there }
            })
        };
        self.names.split(',').map(|name| find(name.trim())).collect()
    }

    /// The same named from the root on.
    pub fn absolute(&self) -> Self {
        Self { file: std::path::absolute(&self.file).unwrap_or_else(|_| self.file.clone()), ..self.clone() }
    }

    /// The same named relative to `folder` where it lies below it.
    pub fn below(&self, folder: &Path) -> Self {
        let whole = self.absolute();
        Self { file: whole.file.strip_prefix(folder).map(Path::to_owned).unwrap_or(whole.file.clone()), ..whole }
    }
}

/// The space that belongs to some parts of the scan of a layer: bone at its isovalue that has no label is another's.
pub fn space(
    labels: &Labels,
    numbers: &[u16],
    grow_mm: f64,
    (volume, layer): (&Arc<Volume>, &Layer),
    progress: &Progress,
) -> Result<Solid, PartsError> {
    let bone = Surface::new(volume, layer.iso, glam::DAffine3::IDENTITY).ok();
    Ok(labels.space_of(Meant { numbers, grow_mm, bone: bone.as_ref() }, progress)?)
}

/// A scan, a solid on its samples, and what that leaves of it; each as long as somebody has it.
type Left = (Weak<Volume>, Weak<Solid>, Weak<Volume>);

/// What solids left of scans: measurements know scans by where they are in memory, so the same must be the same.
static LEFT: Mutex<Vec<Left>> = Mutex::new(vec![]);

fn left_of(volume: &Arc<Volume>, solid: &Arc<Solid>) -> Arc<Volume> {
    let mut known = LEFT.lock().unwrap_or_else(PoisonError::into_inner);
    known.retain(|(volume, solid, left)| [volume.strong_count(), solid.strong_count(), left.strong_count()].iter().all(|n| *n > 0));
    let is_same = |(v, s, _): &&Left| v.as_ptr() == Arc::as_ptr(volume) && s.as_ptr() == Arc::as_ptr(solid);
    if let Some(left) = known.iter().find(is_same).and_then(|(.., left)| left.upgrade()) {
        return left;
    }
    let left = Arc::new(within(volume, solid));
    known.push((Arc::downgrade(volume), Arc::downgrade(solid), Arc::downgrade(&left)));
    left
}

impl Opened {
    /// What is measured: of scans of which a part is meant, what lies in it, as scans of their own.
    pub fn measured(&self) -> Cow<'_, Self> {
        let solid_of = |layer: &Layer| layer.within.as_ref().filter(|within| within.measures).and_then(|within| within.solid.clone());
        if self.scene.layers.iter().all(|layer| solid_of(layer).is_none()) {
            return Cow::Borrowed(self);
        }
        let mut measured = self.clone();
        for (volume, layer) in measured.volumes.iter_mut().zip(&mut measured.scene.layers) {
            if let Some(solid) = solid_of(layer) {
                *volume = left_of(volume, &solid);
                layer.within = None;
            }
        }
        Cow::Owned(measured)
    }
}
