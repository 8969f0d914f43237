//! The part of a scan that is meant: found in a label map, looked at, and measured.

use crate::labelled::Labelled;
use crate::opened::Opened;
use bregma_field::{Progress, Sample, Samples, Solid, Store, Surface, Volume, with_block, within};
use bregma_parts::{Labels, Meant, PartsError};
use bregma_renderer::{Layer, Within};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::convert::Infallible;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::{Arc, Mutex, PoisonError, Weak};
use thiserror::Error;

/// Parts of a scan as a person names them: `FILE#NAME`, of several `FILE#NAME,NAME`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PartOf {
    /// The label map; in a session relative to the session's folder.
    pub file: PathBuf,
    /// Names of parts in it, or their numbers, with commas between; all of them where it is empty.
    pub names: String,
    /// Whether they are kept, and not all that lies beside them.
    pub keeps: bool,
    /// All of the scan is meant: the label map only says what its parts are.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub whole: bool,
    /// The isovalue at which bone without a label is another part's; that of the scan's layer when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub iso: Option<f64>,
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
        Ok(Self { file: file.into(), names: names.into(), keeps: true, whole: false, iso: None })
    }
}

impl PartOf {
    /// The label map, what of the scan of a layer is meant, looked at as the layer says if it does, and what there is to say of the map.
    pub(crate) fn find(&self, volume: &Arc<Volume>, layer: &Layer, progress: &Progress) -> Result<Found, PartOfError> {
        let iso = self.iso.unwrap_or(layer.iso);
        let (labels, notes) = bregma_parts::read(&self.file, volume, progress)?;
        if self.whole {
            return Ok((Labelled::new(labels, volume, iso), None, notes));
        }
        let numbers = self.numbers(&labels)?;
        let known = layer.within.clone().unwrap_or_else(|| Within {
            part: if self.names.is_empty() { "all parts".into() } else { self.names.clone() },
            keeps: self.keeps,
            grow_mm: 0.0,
            rim_mm: 0.0,
            measures: true,
            solid: None,
        });
        let solid = space(&labels, &numbers, known.grow_mm, (volume, iso), progress)?;
        let solid = if known.keeps { solid } else { solid.inverse() };
        let named: HashSet<u16> = numbers.into_iter().collect();
        let is_left_out = |number: &u16| named.contains(number) != known.keeps;
        let left_out = labels.parts().iter().map(|part| part.number).filter(is_left_out).collect();
        Ok((Labelled::new(labels, volume, iso).without(left_out), Some(Within { solid: Some(Arc::new(solid)), ..known }), notes))
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
        // Of two parts of one name the first has it.
        let by_name: HashMap<&str, u16> = parts.iter().rev().map(|part| (part.name.as_str(), part.number)).collect();
        let by_number = |name: &str| name.parse().ok().filter(|number| parts.iter().any(|part| part.number == *number));
        let find = |name: &str| {
            let number = by_name.get(name).copied().or_else(|| by_number(name));
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

/// A label map, what of its scan is kept, and what there is to say of the map.
type Found = (Labelled, Option<Within>, Vec<String>);

/// More numbers than these are told apart by a map of two parts: each sample's number is looked for among them.
const MOST_NUMBERS: usize = 16;

/// The space that belongs to some parts of a scan: bone at the isovalue that has no label is another's.
pub(crate) fn space(
    labels: &Labels,
    numbers: &[u16],
    grow_mm: f64,
    (volume, iso): (&Arc<Volume>, f64),
    progress: &Progress,
) -> Result<Solid, PartsError> {
    let bone = Surface::new(volume, iso, glam::DAffine3::IDENTITY).ok();
    if numbers.len() <= MOST_NUMBERS {
        return Ok(labels.space_of(Meant { numbers, grow_mm, bone: bone.as_ref() }, progress)?);
    }
    let mut number_of = vec![2_u8; 1 << 16];
    number_of[0] = 0;
    numbers.iter().for_each(|&number| number_of[usize::from(number)] = 1);
    let theirs = with_block!(Store::of(labels.volume()).whole(), b => {
        b.onward([0; 3]).par_iter().map(|number| number_of[number.to_f64() as usize]).collect()
    });
    let labels = Labels::new(labels.grid().clone(), Samples::U8(theirs), vec![])?;
    Ok(labels.space_of(Meant { numbers: &[1], grow_mm, bone: bone.as_ref() }, progress)?)
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
