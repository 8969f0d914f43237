//! File formats. A format is one file here with a `sniff` and a `read`, and one row of [`FORMATS`].
//!
//! What a reader is given was made by a stranger: sizes are checked against the file's own length before anything is reserved,
//! and whatever is wrong becomes a sentence, never a panic.

mod decode;
mod error;
mod nifti;
pub mod nrrd;
mod raw;

pub use error::{OpenError, ReadError};
pub use raw::{RawLayout, RawLayoutError};

use crate::{Progress, Raster, Samples, Unit, Volume};
use glam::DVec3;
use std::io::Read;
use std::path::Path;

/// A file format.
pub struct Format {
    /// What people call it.
    pub name: &'static str,
    /// Whether a path is of this format, told from its name and first bytes (none for a folder).
    pub sniff: fn(path: &Path, head: &[u8]) -> bool,
    /// Reads it.
    pub read: fn(&Path, &Hints, &Progress) -> Result<Raster, ReadError>,
}

/// All formats; the first that claims a file reads it.
pub static FORMATS: &[Format] = &[nrrd::FORMAT, nifti::FORMAT, raw::FORMAT];

/// What the person says about a file that the file does not.
#[derive(Clone, Copy, Debug, Default)]
pub struct Hints {
    /// Sample spacing in mm, where the file states none.
    pub spacing_mm: Option<DVec3>,
    /// The file is headerless and laid out like this.
    pub raw: Option<RawLayout>,
}

/// Bytes that formats are told by. A gzipped NIfTI header shows within them.
const HEAD_BYTES: u64 = 4096;

/// Opens a scan of any of the [`FORMATS`]; its name is its file's. `progress` counts bytes of its files.
pub fn open(path: &Path, hints: &Hints, progress: &Progress) -> Result<Volume, OpenError> {
    let volume = || -> Result<Volume, ReadError> {
        let format = if hints.raw.is_some() { &raw::FORMAT } else { find(path)? };
        let raster = (format.read)(path, hints, progress)?;
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
        Ok(Volume::new(name.into_owned(), format.name, raster)?)
    };
    volume().map_err(|reason| OpenError { file: path.to_owned(), reason })
}

fn find(path: &Path) -> Result<&'static Format, ReadError> {
    let mut head = vec![];
    let folder = path.metadata()?.is_dir();
    if !folder {
        decode::open_file(path)?.0.take(HEAD_BYTES).read_to_end(&mut head)?;
    }
    let found = FORMATS.iter().find(|f| (f.sniff)(path, &head));
    found.ok_or_else(|| match folder {
        true => ReadError::Directory,
        false => ReadError::UnknownFormat(FORMATS.iter().map(|f| f.name).collect::<Vec<_>>().join(", ")),
    })
}

/// What values mean in a format that does not say.
///
/// Values from between −1100 and −900, or exactly −2000, −2048 or −3024 (what scanners write outside their field of view), up
/// to between 200 and 32767 are taken as Hounsfield units, as that is what CT exports look like; anything else as plain values.
fn guess_unit(samples: &Samples, slope: f64, intercept: f64) -> Unit {
    fn ends<T: crate::Sample>(samples: &[T]) -> Option<[f64; 2]> {
        let first = *samples.first()?;
        let widen = |[low, high]: [T; 2], &s: &T| [if s < low { s } else { low }, if s > high { s } else { high }];
        Some(samples.iter().fold([first; 2], widen).map(T::to_f64))
    }
    let Some(ends) = crate::with_samples!(samples, s => ends(s)) else { return Unit::Value };
    let [a, b] = ends.map(|s| slope * s + intercept);
    let (low, high) = (a.min(b), a.max(b));
    let air = (-1100.0..=-900.0).contains(&low) || [-2000.0, -2048.0, -3024.0].contains(&low);
    if air && (200.0..=32767.0).contains(&high) { Unit::Hounsfield } else { Unit::Value }
}

/// The sentence about bytes that follow the samples.
const MORE_BYTES: &str = "the file goes on after the samples that its header asks for; the rest is ignored";

#[cfg(test)]
mod tests;
