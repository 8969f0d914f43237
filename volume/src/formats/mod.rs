//! File formats. A format is one file here with a `sniff`, a `scan` and, if it is written too, a `write`, and one row of [`FORMATS`].
//!
//! A format reads headers only and says where the samples are; [`Scan`] streams them: into memory, into a range and a histogram,
//! or into every n-th of them. What a reader is given was made by a stranger: sizes are checked against the file's own length
//! before anything is reserved, and whatever is wrong becomes a sentence, never a panic.

mod ahead;
mod amira;
mod archive;
mod decode;
mod dicom;
mod drishti;
mod entries;
mod entry;
mod error;
mod fill;
mod gipl;
mod inside;
mod invesalius;
mod isq;
mod jpeg_2000;
mod memory;
mod metaimage;
mod mgh;
mod nifti;
mod npy;
pub mod nrrd;
mod packing;
mod part;
mod pictures;
mod raw;
mod scan;
mod stack;
mod stretch;
mod text;
mod tiff;
mod units;
mod vh;
mod vol;
mod vti;
mod vtk;
mod write;
pub mod zarr;

pub use dicom::series::Series;
pub use error::{OpenError, ReadError};
pub use raw::guess::guesses as raw_guesses;
pub use raw::{RawLayout, RawLayoutError};
pub use scan::{Scan, Survey};
pub use write::WriteError;

use crate::{Progress, Turn, Volume};
use glam::DVec3;
use scan::{Sink, Storage};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A file format.
pub struct Format {
    /// What people call it.
    pub name: &'static str,
    /// Whether a path is of this format, told from its name and first bytes (none for a folder).
    pub sniff: fn(path: &Path, head: &[u8], progress: &Progress) -> bool,
    /// Reads its headers.
    pub scan: fn(&Path, &Hints, &Progress) -> Result<Scan, ReadError>,
    /// How scans are written in it, if they are.
    pub write: Option<Writer>,
}

/// How a format is written.
pub struct Writer {
    /// What names of such files end in, in lower case.
    pub endings: &'static [&'static str],
    /// Writes a volume with its type, geometry and metadata; gives a sentence for each thing that the format cannot hold.
    pub write: fn(&Path, &Volume, &Progress) -> Result<Vec<String>, WriteError>,
}

/// All formats; the first that claims a file reads it.
pub static FORMATS: &[Format] = &[
    nrrd::FORMAT,
    nifti::FORMAT,
    // Before those that look into every file of a folder.
    zarr::FORMAT,
    dicom::FORMAT,
    metaimage::FORMAT,
    tiff::FORMAT,
    npy::FORMAT,
    vti::FORMAT,
    gipl::FORMAT,
    invesalius::FORMAT,
    amira::FORMAT,
    isq::FORMAT,
    mgh::FORMAT,
    vtk::FORMAT,
    vol::FORMAT,
    drishti::FORMAT,
    pictures::FORMAT,
    vh::FORMAT,
    raw::FORMAT,
];

/// What the person says about a file that the file does not.
#[derive(Clone, Debug, Default)]
pub struct Hints {
    /// Sample spacing in mm, where the file states none, or instead of what it states.
    pub spacing_mm: Option<DVec3>,
    /// How the scan is turned.
    pub turn: Turn,
    /// The file is headerless and laid out like this.
    pub raw: Option<RawLayout>,
    /// Only every 2nd or 4th sample along each axis is kept.
    pub reduce: Option<Reduce>,
    /// What is done with slices that are not evenly spaced.
    pub uneven: Uneven,
    /// Key of the series, where there are several (see [`Series`]); also given as `FOLDER#KEY`.
    pub series: Option<String>,
    /// Number of the layer, from 0, of a file that may hold several label maps, as 3D Slicer's segmentations do; `None` for a scan.
    pub layer: Option<usize>,
}

/// A reduced preview; written `2` or `4`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Reduce {
    /// Every 2nd sample along each axis.
    #[serde(rename = "2")]
    Half,
    /// Every 4th sample along each axis.
    #[serde(rename = "4")]
    Quarter,
}

impl Reduce {
    /// The preview of every `step`-th sample; `None` for other steps.
    pub fn every(step: usize) -> Option<Self> {
        match step {
            2 => Some(Self::Half),
            4 => Some(Self::Quarter),
            _ => None,
        }
    }

    /// Samples from one that is kept to the next.
    pub(super) fn step(self) -> usize {
        match self {
            Self::Half => 2,
            Self::Quarter => 4,
        }
    }
}

/// What is done with slices that are not evenly spaced; written `even`, `refuse` or `resample`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Uneven {
    /// Those that jitter are taken as even, with a warning that says by how much they are off; the others are refused with a list of the gaps.
    #[default]
    Even,
    /// They are refused with a list of the gaps.
    Refuse,
    /// They are interpolated linearly to even spacing, with a warning.
    Resample,
}

impl Uneven {
    /// Nothing else was asked for.
    pub fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

/// Bytes that formats are told by. A gzipped NIfTI header shows within them.
const HEAD_BYTES: u64 = 4096;

/// Reads the headers of a scan in any of the [`FORMATS`]; its name is its file's.
pub fn scan(path: &Path, hints: &Hints, progress: &Progress) -> Result<Scan, OpenError> {
    let named = path;
    let (path, hints) = chosen(path, hints);
    let (path, hints) = (path.as_path(), &hints);
    let scan = || -> Result<Scan, ReadError> {
        let found = if hints.raw.is_some() { Ok((&raw::FORMAT, path.to_owned())) } else { find(path, progress) };
        let (format, path) = match found {
            Err(ReadError::Directory) => folder_within(path, progress)?,
            found => found?,
        };
        let path = path.as_path();
        // What is unpacked in memory stays there until the scan is read.
        let archive = match archive::within(path, progress)? {
            Some((archive, _)) => Some(archive),
            None if format.name == dicom::FORMAT.name || format.name == pictures::FORMAT.name => archive::open(path, progress)?,
            None => None,
        };
        if let Some(series) = hints.series.as_ref().filter(|_| format.name != dicom::FORMAT.name) {
            return Err(ReadError::Unsupported(format!(
                "it has no series {series}: only DICOM has series; leave the # and what follows away"
            )));
        }
        // The path within what was named, if an archive was.
        let inside = path.strip_prefix(named).ok().filter(|inside| !inside.as_os_str().is_empty() && !named.is_dir());
        // What the file says by itself is to be known. Some say too little to be read without help.
        let read = match (format.scan)(path, &Hints { spacing_mm: None, ..hints.clone() }, progress) {
            Err(_) if hints.spacing_mm.is_some() => {
                (format.scan)(path, hints, progress).map(|scan| Scan { spacing_is_stated: false, ..scan })
            }
            read => read,
        };
        let mut scan = read.map_err(|e| match inside {
            Some(inside) => part::in_file(inside, e),
            None => e,
        })?;
        scan.name = named.file_name().unwrap_or(named.as_os_str()).to_string_lossy().into_owned();
        scan.format = format.name;
        scan.file = named.to_owned();
        scan.archive = archive;
        scan.warnings.splice(0..0, inside.map(|inside| format!("{} in it is read", inside.display())));
        Ok(scan.placed(hints)?)
    };
    scan().map_err(|reason| OpenError { file: named.to_owned(), reason })
}

/// `FOLDER#SERIES` is the folder and the series, unless something has that very name.
fn chosen(path: &Path, hints: &Hints) -> (PathBuf, Hints) {
    let is_there = path.exists() || archive::is_folder(path, &Progress::default()).is_ok_and(|is| is) || archive::is_file(path);
    let split = path.to_str().filter(|_| !is_there).and_then(|text| text.rsplit_once('#'));
    match split {
        Some((folder, series)) => (folder.into(), Hints { series: Some(series.to_owned()), ..hints.clone() }),
        None => (path.to_owned(), hints.clone()),
    }
}

/// The DICOM series that the folder or archive at `path` holds, the largest first; none where there is nothing to choose.
pub fn series(path: &Path, progress: &Progress) -> Result<Vec<Series>, OpenError> {
    let list = || -> Result<Vec<Series>, ReadError> {
        if !archive::is_folder(path, progress)? {
            return Ok(vec![]);
        }
        let (format, path) = find(path, progress)?;
        if format.name == dicom::FORMAT.name { dicom::series::list(&path, progress) } else { Ok(vec![]) }
    };
    list().map_err(|reason| OpenError { file: path.to_owned(), reason })
}

/// Opens a scan of any of the [`FORMATS`]; its name is its file's. `progress` counts bytes of its files.
///
/// ```
/// use bregma_volume::Progress;
/// use bregma_volume::formats::{Hints, open};
///
/// let file = std::env::temp_dir().join(format!("bregma-open-{}.nrrd", std::process::id()));
/// std::fs::write(&file, "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nspacings: 1 1 3\nencoding: raw\n\n01234567")?;
/// let volume = open(&file, &Hints::default(), &Progress::default())?;
/// assert_eq!((volume.format(), volume.grid().dims()), ("NRRD", [2, 2, 2]));
/// assert_eq!(volume.grid().spacing_mm().z, 3.0);
/// # std::fs::remove_file(&file)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn open(path: &Path, hints: &Hints, progress: &Progress) -> Result<Volume, OpenError> {
    scan(path, hints, progress)?.load(progress)
}

/// The writer of the form that the name of `path` asks for.
pub fn writer(path: &Path) -> Result<&'static Writer, WriteError> {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    let writers = || FORMATS.iter().filter_map(|format| format.write.as_ref());
    writers().find(|writer| writer.endings.iter().any(|end| name.ends_with(end))).ok_or_else(|| {
        let forms = writers().flat_map(|writer| writer.endings).copied().collect::<Vec<_>>().join(", ");
        WriteError::UnknownForm { file: path.to_owned(), forms }
    })
}

/// Writes `volume` in the form that the name of `path` asks for, with its type, geometry and metadata. Gives a sentence for each thing
/// that the form cannot hold. `progress` counts bytes of samples.
pub fn write(path: &Path, volume: &Volume, progress: &Progress) -> Result<Vec<String>, WriteError> {
    (writer(path)?.write)(path, volume, progress)
}

/// The only folder that holds a scan in a folder that itself holds none, as archives are unpacked into one.
fn folder_within(path: &Path, progress: &Progress) -> Result<(&'static Format, PathBuf), ReadError> {
    let mut found = vec![];
    for entry in std::fs::read_dir(path)? {
        let folder = entry?.path();
        if folder.is_dir() && !folder.is_symlink() {
            found.extend(find(&folder, progress).ok());
        }
    }
    progress.advance(0)?;
    found.sort_by(|(_, a), (_, b)| a.cmp(b));
    let name = |n: usize| found[n].1.file_name().unwrap_or_default().to_string_lossy().into_owned();
    match found.len() {
        0 => Err(ReadError::Directory),
        1 => Ok(found.swap_remove(0)),
        n => Err(ReadError::Unsupported(format!("{n} of its folders hold scans, from {} to {}; name one of them", name(0), name(n - 1)))),
    }
}

/// The format that the scan at `path` is in, and the path to read: its own, or that of a file inside of an archive.
fn find(path: &Path, progress: &Progress) -> Result<(&'static Format, PathBuf), ReadError> {
    let mut head = vec![];
    let is_folder = path.is_dir();
    if !is_folder {
        if !path.exists() && archive::is_folder_inside(path, progress)? {
            return inside::find(path, progress);
        }
        head = part::head_of(path, HEAD_BYTES)?.0;
    }
    let found = FORMATS.iter().find(|f| (f.sniff)(path, &head, progress));
    // What was looked at while the person cancelled was not recognized for that reason.
    progress.advance(0)?;
    match found {
        Some(format) => Ok((format, path.to_owned())),
        None if is_folder => Err(ReadError::Directory),
        None if archive::is_archive(&head) => inside::find(path, progress),
        None => Err(unknown()),
    }
}

/// The error that no format claims a file.
fn unknown() -> ReadError {
    ReadError::UnknownFormat(FORMATS.iter().map(|f| f.name).collect::<Vec<_>>().join(", "))
}

/// The sentence about a spacing that nobody states.
const NO_SPACING: &str = "the file states no spacing; 1 mm is assumed; pass --spacing X,Y,Z";

/// The sentence about directions that nobody states.
const NO_DIRECTIONS: &str = "the file does not state how it lies in the patient; its axes are taken as left, posterior, superior";

/// The error that a header's `field` is bad.
fn bad(field: &str, content: impl ToString, problem: &str) -> ReadError {
    ReadError::BadField { field: field.into(), content: content.to_string(), problem: problem.into() }
}

#[cfg(test)]
mod tests;
