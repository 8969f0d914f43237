//! NumPy's `.npy`, versions 1 to 3: an array of three axes, `[k, j, i]` in C order or `[i, j, k]` in Fortran's.
//! <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>

use super::decode::{Encoding, SampleType};
use super::packing::Packing;
use super::part::{Part, head_of};
use super::{Format, Hints, NO_DIRECTIONS, NO_SPACING, ReadError, Scan, Storage, bad};
use crate::{Grid, Progress};
use glam::{DMat3, DVec3};
use std::path::Path;

/// The row of the formats.
pub const FORMAT: Format = Format { name: "NumPy", sniff, scan, write: None };

const MAGIC: &[u8] = b"\x93NUMPY";
/// An array of three axes says all in a few hundred bytes.
const MOST_BYTES: u64 = 1 << 16;

fn sniff(path: &Path, head: &[u8], _progress: &Progress) -> bool {
    let named = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("npy"));
    !head.is_empty() && (named || head.starts_with(MAGIC))
}

fn scan(path: &Path, hints: &Hints, _progress: &Progress) -> Result<Scan, ReadError> {
    let (head, there) = head_of(path, MOST_BYTES)?;
    let none = || ReadError::NoHeader("a NumPy file begins with its magic, version and header length");
    let (version, after) = head.strip_prefix(MAGIC).and_then(|h| h.split_first_chunk::<2>()).ok_or_else(none)?;
    let (length, start) = match (version[0], after) {
        (1, [a, b, ..]) => (u32::from_le_bytes([*a, *b, 0, 0]), 10),
        (2 | 3, [a, b, c, d, ..]) => (u32::from_le_bytes([*a, *b, *c, *d]), 12),
        _ => return Err(none()),
    };
    let begin = start + length as usize;
    let text = String::from_utf8_lossy(head.get(start..begin).ok_or_else(none)?).into_owned();
    let field = |name: &str| text.split_once(&format!("'{name}':")).map(|(_, after)| after.trim_start());
    let wrong = |problem: &str| bad("text", text.trim(), problem);
    let (descr, fortran) = (field("descr"), field("fortran_order"));
    let quoted = descr.and_then(|d| d.strip_prefix('\'')?.split_once('\'')).ok_or_else(|| wrong("it names no type of one number"))?.0;
    let (order, kind) = quoted.split_at_checked(1).ok_or_else(|| wrong("it names no type"))?;
    let sample = match kind {
        "i1" => SampleType::I8,
        "u1" => SampleType::U8,
        "i2" => SampleType::I16,
        "u2" => SampleType::U16,
        "i4" => SampleType::I32,
        "u4" => SampleType::U32,
        "i8" => SampleType::I64,
        "u8" => SampleType::U64,
        "f2" => SampleType::F16,
        "f4" => SampleType::F32,
        "f8" => SampleType::F64,
        _ => return Err(wrong("its type is no number of 8 to 64 bits")),
    };
    let fortran = fortran.ok_or_else(|| wrong("it has no order"))?.starts_with("True");
    let shape = field("shape").and_then(|s| s.strip_prefix('(')?.split_once(')')).ok_or_else(|| wrong("it has no shape"))?.0;
    let sizes: Option<Vec<usize>> = shape.split(',').map(str::trim).filter(|n| !n.is_empty()).map(|n| n.parse().ok()).collect();
    let mut dims: [usize; 3] = sizes.and_then(|s| s.try_into().ok()).ok_or_else(|| wrong("only arrays of three axes can be read"))?;
    if !fortran {
        dims.reverse();
    }
    let grid = Grid::new(dims, hints.spacing_mm.unwrap_or(DVec3::ONE), DVec3::ZERO, DMat3::IDENTITY)?;
    let wanted = grid.len() as u128 * sample.bytes() as u128;
    let part = Part::checked(path, Packing::Plain, begin as u64, 0, wanted, there)?;
    let mut warnings = vec![NO_DIRECTIONS.into()];
    if hints.spacing_mm.is_none() {
        warnings.push(NO_SPACING.into());
    }
    let scan = Scan::new(grid, Encoding { sample, big_endian: order == ">" }, there, Storage::Parts(vec![part]));
    Ok(Scan { spacing_is_stated: hints.spacing_mm.is_some(), warnings, ..scan })
}
