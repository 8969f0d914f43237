//! ISQ, the files of Scanco's scanners: blocks of 512 bytes, little-endian, samples of 16 bits. Places of fields as in itk-ioscanco
//! (<https://github.com/KitwareMedical/ITKIOScanco>) and Scanco's own notes to users.

use super::decode::{Encoding, SampleType};
use super::packing::Packing;
use super::part::{Part, head_of};
use super::{Format, Hints, NO_DIRECTIONS, NO_SPACING, ReadError, Scan, Storage};
use crate::{Grid, Progress};
use glam::{DMat3, DVec3};
use std::path::Path;

/// The row of the formats.
pub const FORMAT: Format = Format { name: "ISQ", sniff, scan, write: None };

const MAGIC: &[u8] = b"CTDATA-HEADER_V1";
const BLOCK: usize = 512;

fn sniff(_path: &Path, head: &[u8], _progress: &Progress) -> bool {
    head.starts_with(MAGIC)
}

fn scan(path: &Path, hints: &Hints, _progress: &Progress) -> Result<Scan, ReadError> {
    let (head, there) = head_of(path, BLOCK as u64)?;
    let header: [u8; BLOCK] = head.try_into().map_err(|_| ReadError::NoHeader("an ISQ header has 512 bytes"))?;
    let number = |at: usize| i32::from_le_bytes([header[at], header[at + 1], header[at + 2], header[at + 3]]);
    // Negative counts are as wrong as none.
    let dims = [44, 48, 52].map(|at| usize::try_from(number(at)).unwrap_or(0));
    // Extents in micrometres; zeros stand for a spacing that nobody knew.
    let extent_um = [56, 60, 64].map(|at| f64::from(number(at)));
    let is_stated = !dims.contains(&0) && extent_um.iter().all(|um| *um > 0.0);
    let stated_mm = is_stated.then(|| DVec3::from_array(std::array::from_fn(|n| extent_um[n] / dims[n] as f64 * 1e-3)));
    let spacing_mm = stated_mm.or(hints.spacing_mm);
    let grid = Grid::new(dims, spacing_mm.unwrap_or(DVec3::ONE), DVec3::ZERO, DMat3::IDENTITY)?;
    // The samples begin behind so many more blocks.
    let start = u64::from(number(508).unsigned_abs()).saturating_add(1) * BLOCK as u64;
    let part = Part::checked(path, Packing::Plain, start, 0, grid.len() as u128 * 2, there)?;
    let mut warnings = vec![NO_DIRECTIONS.to_owned()];
    if spacing_mm.is_none() {
        warnings.push(NO_SPACING.into());
    }
    let scan = Scan::new(grid, Encoding { sample: SampleType::I16, big_endian: false }, there, Storage::Parts(vec![part]));
    // A sample by this number is the linear attenuation in 1/cm. Density needs the phantom's line, which the first block does not hold.
    let mu = number(88);
    let metadata = (mu > 0).then(|| ("MuScaling".to_owned(), format!("{mu} (sample / {mu} is the linear attenuation, 1/cm)")));
    Ok(Scan { spacing_is_stated: spacing_mm.is_some(), warnings, metadata: metadata.into_iter().collect(), ..scan })
}
