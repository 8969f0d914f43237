//! The label map of a scan that is open: its parts, how they are found, which of them are kept, and what that is written as.

use bregma_field::{Progress, Sample, Samples, Solid, Store, Surface, Volume, read_mesh, with_block};
use bregma_parts::{ClosedSurface, Islands, Labels, Meant, Neck, Part, PartsError, Span, keep_the_skull, read, separate, write};
use bregma_renderer::{Color, Layer, Within};
use glam::DAffine3;
use rayon::prelude::*;
use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use thiserror::Error;

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

/// A part as a person sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct Listed {
    /// The number of its samples.
    pub number: u16,
    /// What the person calls it.
    pub name: String,
    /// Its colour.
    pub color: Color,
    /// Its samples times the volume of a voxel.
    pub volume_mm3: f64,
}

/// A label map, which of its parts are kept, and the isovalue that it is of. Two are equal if they are the same one, with the same kept.
#[derive(Clone, Debug)]
pub struct Labelled {
    labels: Arc<Labels>,
    /// The largest first, by the names that they have now.
    parts: Arc<Vec<Listed>>,
    iso: f64,
    left_out: Arc<BTreeSet<u16>>,
}

impl PartialEq for Labelled {
    fn eq(&self, other: &Self) -> bool {
        self.is_same_map(other) && self.left_out == other.left_out && self.iso == other.iso
    }
}

/// How parts are found.
#[derive(Clone, Debug)]
pub enum How {
    /// Bone that hangs together.
    Islands,
    /// Bones apart at necks that are not thicker, mm.
    Separate {
        /// The thickness.
        neck_mm: f64,
    },
    /// The skull, and all other bone as a part that is left out.
    Skull,
    /// As a label map has them.
    File(PathBuf),
    /// What lies within a closed surface.
    Surface(PathBuf),
}

/// So many names are said one by one.
const FEW: usize = 8;

impl Labelled {
    /// A label map of a scan at an isovalue, all of whose parts are kept.
    pub fn new(labels: Labels, volume: &Volume, iso: f64) -> Self {
        let listed = |(part, found): (&Part, bregma_parts::Statistics)| Listed {
            number: part.number,
            name: part.name.clone(),
            color: Color(part.color),
            volume_mm3: found.volume_mm3,
        };
        let mut parts: Vec<Listed> = labels.parts().iter().zip(labels.statistics(volume)).map(listed).collect();
        parts.sort_by(|a, b| b.volume_mm3.total_cmp(&a.volume_mm3));
        Self { labels: Arc::new(labels), parts: Arc::new(parts), iso, left_out: Arc::default() }
    }

    /// Finds the parts of the scan of a layer, with a sentence for each thing that is not as in a file.
    pub fn find(how: &How, (volume, layer): (&Arc<Volume>, &Layer), progress: &Progress) -> Result<(Self, Vec<String>), PartOfError> {
        // Where a scan lies by itself is a grid.
        let surface =
            Surface::new(volume, layer.iso, DAffine3::IDENTITY).map_err(|_| PartsError::NoBone { scan: volume.name().to_owned() })?;
        let (labels, notes) = match how {
            How::Islands => (islands(&surface, progress)?, vec![]),
            How::Separate { neck_mm } => (separate(&surface, Neck { mm: *neck_mm, least_mm3: None }, progress)?, vec![]),
            How::Skull => (skull_and_rest(&surface, progress)?, vec![]),
            How::Surface(file) => {
                let mesh = read_mesh(file).map_err(PartsError::from)?;
                (Labels::of_surfaces(volume, &[ClosedSurface { file: file.clone(), mesh }], progress)?, vec![])
            }
            How::File(file) => {
                let (labels, notes) = read(file, volume, progress)?;
                if labels.parts().is_empty() {
                    return Err(PartOfError::Empty(file.clone()));
                }
                (labels, notes)
            }
        };
        let left_out = labels.parts().iter().filter(|part| matches!(how, How::Skull) && part.name == REST).map(|part| part.number);
        let left_out = left_out.collect();
        Ok((Self::new(labels, volume, layer.iso).without(left_out), notes))
    }

    /// Its parts, the largest first.
    pub fn parts(&self) -> &[Listed] {
        &self.parts
    }

    /// The isovalue that it is of: bone at it that has no label belongs to no part.
    pub fn iso(&self) -> f64 {
        self.iso
    }

    /// The numbers of the parts that are left out.
    pub fn left_out(&self) -> &BTreeSet<u16> {
        &self.left_out
    }

    /// The numbers of its samples.
    pub fn labels(&self) -> &Arc<Labels> {
        &self.labels
    }

    /// The same, with the parts of these numbers left out.
    pub fn without(self, left_out: BTreeSet<u16>) -> Self {
        Self { left_out: Arc::new(left_out), ..self }
    }

    /// The same with another name for a part.
    pub fn renamed(&self, number: u16, name: &str) -> Self {
        let name: String = name.chars().filter(|c| !c.is_control()).collect();
        let mut parts = self.parts.as_ref().clone();
        parts.iter_mut().filter(|part| part.number == number).for_each(|part| part.name = name.trim().to_owned());
        Self { parts: Arc::new(parts), ..self.clone() }
    }

    /// The same with other numbers at its samples, which may have new parts.
    pub fn changed(&self, labels: &Labels, volume: &Volume) -> Self {
        let names: HashMap<u16, &str> = self.parts.iter().map(|part| (part.number, part.name.as_str())).collect();
        let named =
            |part: &Part| Part { name: names.get(&part.number).map_or(part.name.clone(), |name| (*name).to_owned()), ..part.clone() };
        let parts = labels.parts().iter().map(named).collect();
        Self::new(labels.with(volume.grid().clone(), parts), volume, self.iso).without(self.left_out.as_ref().clone())
    }

    /// What is kept of it, where it came of changes within a span of samples alone from what `known` was kept of.
    pub fn within_again(
        &self,
        volume: &Arc<Volume>,
        known: Option<&Within>,
        changed: Span,
        progress: &Progress,
    ) -> Result<Option<Within>, PartsError> {
        let Some((known, solid)) = known.filter(|known| known.keeps).and_then(|known| Some((known, known.solid.as_ref()?))) else {
            return self.within(volume, known, progress);
        };
        let numbers: Vec<u16> = self.kept().map(|part| part.number).collect();
        let bone = Surface::new(volume, self.iso, DAffine3::IDENTITY).ok();
        let meant = Meant { numbers: &numbers, grow_mm: known.grow_mm, bone: bone.as_ref() };
        let solid = self.labels.space_again(meant, solid, changed, progress)?;
        Ok(Some(Within { part: self.kept_names(), solid: Some(Arc::new(solid)), ..known.clone() }))
    }

    /// Memory of its numbers that another one does not share, bytes: what a step of undo holds.
    pub fn bytes_beside(&self, other: &Self) -> usize {
        if Arc::ptr_eq(&self.labels, &other.labels) { 0 } else { self.labels.bytes_beside(&other.labels) }
    }

    /// The same on a scan whose samples lie elsewhere now.
    pub(crate) fn on(&self, volume: &Volume) -> Self {
        let labels = self.labels.with(volume.grid().clone(), self.named());
        Self::new(labels, volume, self.iso).without(self.left_out.as_ref().clone())
    }

    /// Whether samples and names are the same, whatever is kept.
    pub fn is_same_map(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.labels, &other.labels) && Arc::ptr_eq(&self.parts, &other.parts)
    }

    /// The parts that are kept.
    pub(crate) fn kept(&self) -> impl Iterator<Item = &Listed> {
        self.parts.iter().filter(|part| !self.left_out.contains(&part.number))
    }

    /// What of the scan is kept, looked at and measured as `known` is; none where all of it is.
    pub fn within(&self, volume: &Arc<Volume>, known: Option<&Within>, progress: &Progress) -> Result<Option<Within>, PartsError> {
        if self.left_out.is_empty() {
            return Ok(None);
        }
        let (grow_mm, rim_mm) = known.map_or((0.0, 0.0), |within| (within.grow_mm, within.rim_mm));
        let numbers: Vec<u16> = self.kept().map(|part| part.number).collect();
        let solid = space(&self.labels, &numbers, grow_mm, (volume, self.iso), progress)?;
        let part = self.kept_names();
        let measures = known.is_none_or(|within| within.measures);
        Ok(Some(Within { part, keeps: true, grow_mm, rim_mm, measures, solid: Some(Arc::new(solid)) }))
    }

    fn kept_names(&self) -> String {
        match self.kept().count() {
            count if count <= FEW => self.kept().map(|part| part.name.as_str()).collect::<Vec<_>>().join(", "),
            count => format!("{count} of {} parts", self.parts.len()),
        }
    }

    /// Writes it; gives a sentence for each thing that the form of the file cannot hold.
    pub fn write(&self, file: &Path, progress: &Progress) -> Result<Vec<String>, PartsError> {
        let is_as_found = self.labels.parts().iter().all(|part| self.parts.iter().any(|p| p.number == part.number && p.name == part.name));
        if is_as_found {
            return write(file, &self.labels, progress);
        }
        write(file, &self.labels.with(self.labels.grid().clone(), self.named()), progress)
    }

    /// The parts by the names that they have now.
    fn named(&self) -> Vec<Part> {
        let names: HashMap<u16, &str> = self.parts.iter().map(|part| (part.number, part.name.as_str())).collect();
        self.labels.parts().iter().map(|part| Part { name: names[&part.number].to_owned(), ..part.clone() }).collect()
    }
}

/// All islands, or as many of the largest as there are numbers.
fn islands(surface: &Surface, progress: &Progress) -> Result<Labels, PartsError> {
    let islands = Islands::of_bone(surface, progress)?;
    let count = islands.sizes().len().min(usize::from(u16::MAX));
    let chosen: Vec<_> = (0..count).map(|n| (n, format!("Island {}", n + 1))).collect();
    islands.labels(surface.volume.grid(), &chosen)
}

/// What is no skull.
const REST: &str = "All else";

/// The skull, and all other bone as one part.
fn skull_and_rest(surface: &Surface, progress: &Progress) -> Result<Labels, PartsError> {
    const SKULL: u8 = 1;
    const OTHER: u8 = 2;
    let skull = keep_the_skull(surface, progress)?.labels;
    let is_bone = |value: f64| f64::from(surface.sign) * (value - surface.level) >= 0.0;
    let number = |label: f64, value: f64| match (label > 0.0, is_bone(value)) {
        (true, _) => SKULL,
        (false, true) => OTHER,
        (false, false) => 0,
    };
    let samples: Vec<u8> = with_block!(Store::of(&skull.volume()).whole(), labels => with_block!(Store::of(&surface.volume).whole(), values => {
        let both = labels.onward([0; 3]).par_iter().zip(values.onward([0; 3]));
        both.map(|(label, value)| number(label.to_f64(), value.to_f64())).collect()
    }));
    let has_other = samples.par_iter().any(|n| *n == OTHER);
    let other = has_other.then(|| Part::new(OTHER.into(), REST.to_owned()));
    let parts = skull.parts().iter().cloned().chain(other).collect();
    Labels::new(skull.grid().clone(), Samples::U8(samples), parts)
}

/// The space that belongs to some parts of a scan: bone at the isovalue that has no label is another's.
pub(crate) fn space(
    labels: &Labels,
    numbers: &[u16],
    grow_mm: f64,
    (volume, iso): (&Arc<Volume>, f64),
    progress: &Progress,
) -> Result<Solid, PartsError> {
    let bone = Surface::new(volume, iso, DAffine3::IDENTITY).ok();
    Ok(labels.space_of(Meant { numbers, grow_mm, bone: bone.as_ref() }, progress)?)
}
