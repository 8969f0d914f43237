//! GIPL, the Guy's Image Processing Lab format: 256 bytes of header, big-endian. Places of fields as in ITK's itkGiplImageIO.

use super::decode::{Encoding, SampleType};
use super::packing::Packing;
use super::part::{Part, head_of};
use super::{Format, Hints, NO_DIRECTIONS, NO_SPACING, ReadError, Scan, Storage, bad};
use crate::{Grid, Progress};
use glam::{DMat3, DVec3};
use std::path::Path;

/// The row of the formats.
pub const FORMAT: Format = Format { name: "GIPL", sniff, scan, write: None };

const SIZE: usize = 256;
/// The last number of the header, in files of either kind.
const MAGIC: [[u8; 4]; 2] = [0xefff_e9b0_u32.to_be_bytes(), 719_555_000_u32.to_be_bytes()];

fn sniff(path: &Path, head: &[u8], _progress: &Progress) -> bool {
    let named = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gipl"));
    !head.is_empty() && (named || head.get(SIZE - 4..SIZE).is_some_and(|m| MAGIC.iter().any(|magic| magic == m)))
}

fn scan(path: &Path, hints: &Hints, _progress: &Progress) -> Result<Scan, ReadError> {
    let (head, there) = head_of(path, SIZE as u64)?;
    let header: [u8; SIZE] = head.try_into().map_err(|_| ReadError::NoHeader("a GIPL header has 256 bytes"))?;
    if !MAGIC.iter().any(|magic| header[SIZE - 4..] == *magic) {
        return Err(ReadError::NoHeader("its last number is not GIPL's magic"));
    }
    let short = |at: usize| u16::from_be_bytes([header[at], header[at + 1]]);
    let float = |at: usize| f32::from_be_bytes([header[at], header[at + 1], header[at + 2], header[at + 3]]);
    let double = |at: usize| f64::from_be_bytes(std::array::from_fn(|n| header[at + n]));
    if short(6) > 1 {
        return Err(ReadError::Unsupported(format!("it has {} volumes in a row; only one can be read", short(6))));
    }
    let sample = match short(8) {
        7 => SampleType::I8,
        8 => SampleType::U8,
        15 => SampleType::I16,
        16 => SampleType::U16,
        31 => SampleType::U32,
        32 => SampleType::I32,
        64 => SampleType::F32,
        65 => SampleType::F64,
        code => return Err(bad("image type", code, "it is none of GIPL's types of one number")),
    };
    let dims = [0, 2, 4].map(|at| usize::from(short(at)));
    // Zeros stand for a spacing that nobody knew.
    let stated_mm = Some(DVec3::from([10, 14, 18].map(|at| f64::from(float(at))))).filter(|mm| *mm != DVec3::ZERO);
    let spacing_mm = stated_mm.or(hints.spacing_mm);
    let origin_mm = DVec3::from([204, 212, 220].map(double));
    let origin_mm = if origin_mm.is_finite() { origin_mm } else { DVec3::ZERO };
    let grid = Grid::new(dims, spacing_mm.unwrap_or(DVec3::ONE), origin_mm, DMat3::IDENTITY)?;
    let wanted = grid.len() as u128 * sample.bytes() as u128;
    let part = Part::checked(path, Packing::Plain, SIZE as u64, 0, wanted, there)?;
    let scan = Scan::new(grid, Encoding { sample, big_endian: true }, there, Storage::Parts(vec![part]));
    let warnings = spacing_mm.is_none().then_some(NO_SPACING).into_iter().chain([NO_DIRECTIONS]).map(str::to_owned).collect();
    Ok(Scan { spacing_is_stated: spacing_mm.is_some(), warnings, ..scan })
}
