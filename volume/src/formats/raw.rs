//! Headerless files: samples and nothing else, i fastest. Their layout comes from `--raw` or from their name.

use super::decode::{Encoding, SampleType};
use super::packing::Packing;
use super::part::{Part, open_file};
use super::{Format, Hints, NO_SPACING, ReadError, Scan, Storage};
use crate::{Grid, Progress, Unit};
use glam::{DMat3, DVec3};
use std::path::Path;
use std::str::FromStr;
use thiserror::Error;

/// The row of the formats.
pub const FORMAT: Format = Format { name: "raw", sniff, scan, write: None };

/// How the samples lie in a headerless file; written `WxHxD,u8|u16|i16|f32[,be][,skip=N]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RawLayout {
    dims: [usize; 3],
    sample: SampleType,
    big_endian: bool,
    skip: u64,
}

/// Why a text is no [`RawLayout`].
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{part:?} in {text:?} is {problem}; write it like 256x256x110,u8 or 512x512x300,i16,be,skip=128")]
pub struct RawLayoutError {
    text: String,
    part: String,
    problem: &'static str,
}

impl FromStr for RawLayout {
    type Err = RawLayoutError;

    fn from_str(text: &str) -> Result<Self, RawLayoutError> {
        let bad = |part: &str, problem| RawLayoutError { text: text.into(), part: part.into(), problem };
        let mut parts = text.split(',').map(str::trim);
        let size = parts.next().unwrap_or_default();
        let dims = dims(size).ok_or_else(|| bad(size, "not a size of three positive numbers"))?;
        let kind = parts.next().unwrap_or_default();
        let sample = sample_type(kind).ok_or_else(|| bad(kind, "none of the types u8, u16, i16, f32"))?;
        let mut layout = Self { dims, sample, big_endian: false, skip: 0 };
        for part in parts {
            match part.strip_prefix("skip=") {
                Some(n) => layout.skip = n.parse().map_err(|_| bad(part, "not a number of bytes"))?,
                None if part == "be" => layout.big_endian = true,
                None => return Err(bad(part, "neither `be` nor `skip=N`")),
            }
        }
        Ok(layout)
    }
}

fn dims(text: &str) -> Option<[usize; 3]> {
    let numbers: Vec<usize> = text.split('x').map(|n| n.parse().ok().filter(|&n| n > 0)).collect::<Option<_>>()?;
    numbers.try_into().ok()
}

fn sample_type(text: &str) -> Option<SampleType> {
    Some(match text {
        "u8" | "uint8" => SampleType::U8,
        "u16" | "uint16" => SampleType::U16,
        "i16" | "int16" => SampleType::I16,
        "f32" | "float32" => SampleType::F32,
        _ => return None,
    })
}

/// The layout that a name like `engine_256x256x110_uint8.raw` states.
fn layout_in_name(path: &Path) -> Option<RawLayout> {
    let name = path.file_name()?.to_str()?.to_lowercase();
    let words = || name.split(['_', '-', '.', ' ']);
    let (dims, sample) = (words().find_map(dims)?, words().find_map(sample_type)?);
    Some(RawLayout { dims, sample, big_endian: false, skip: 0 })
}

fn sniff(path: &Path, _head: &[u8], _progress: &Progress) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("raw")) && !path.is_dir()
}

fn scan(path: &Path, hints: &Hints, _progress: &Progress) -> Result<Scan, ReadError> {
    let (_, there) = open_file(path)?;
    let mut warnings = vec![];
    let layout = match hints.raw {
        Some(layout) => layout,
        None => {
            let layout = layout_in_name(path).ok_or(ReadError::NoLayout)?;
            let [nx, ny, nz] = layout.dims;
            let order = if layout.sample.bytes() > 1 { ", little-endian" } else { "" };
            let kind = format!("{:?}", layout.sample).to_lowercase();
            warnings.push(format!("the file has no header; its name says {nx}×{ny}×{nz} {kind}{order}; pass --raw if that is wrong"));
            layout
        }
    };
    if hints.spacing_mm.is_none() {
        warnings.push(NO_SPACING.into());
    }
    let grid = Grid::new(layout.dims, hints.spacing_mm.unwrap_or(DVec3::ONE), DVec3::ZERO, DMat3::IDENTITY)?;
    let encoding = Encoding { sample: layout.sample, big_endian: layout.big_endian };
    let wanted = grid.len() as u128 * layout.sample.bytes() as u128;
    let part = Part::checked(path, Packing::Plain, 0, layout.skip, wanted, there)?;
    let extra = there - layout.skip - part.bytes;
    if extra > 0 {
        return Err(ReadError::TooLong(extra));
    }
    let scan = Scan::new(grid, encoding, there, Storage::Parts(vec![part]));
    Ok(Scan { unit: Some(Unit::Value), spacing_is_stated: hints.spacing_mm.is_some(), warnings, ..scan })
}
