//! Headerless files: samples and nothing else, i fastest. Their layout comes from `--raw` or from their name.

pub mod guess;

use super::decode::{Encoding, SampleType};
use super::packing::Packing;
use super::part::{Part, open_file};
use super::{Format, Hints, NO_SPACING, ReadError, Scan, Storage};
use crate::{Grid, Progress, Unit};
use glam::{DMat3, DVec3};
use std::fmt;
use std::io::{Read, Seek, SeekFrom};
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

impl RawLayout {
    /// Of `dims` samples, none 0, of the type `u8`, `u16`, `i16` or `f32`, behind `skip` bytes; `None` where they are not.
    pub fn new(dims: [usize; 3], type_name: &str, big_endian: bool, skip: u64) -> Option<Self> {
        let sample = sample_type(type_name)?;
        (!dims.contains(&0)).then_some(Self { dims, sample, big_endian, skip })
    }

    /// Samples along i, j and k.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// `u8`, `u16`, `i16` or `f32`.
    pub fn type_name(&self) -> &'static str {
        match self.sample {
            SampleType::U8 => "u8",
            SampleType::U16 => "u16",
            SampleType::I16 => "i16",
            _ => "f32",
        }
    }

    /// Whether the most significant byte of a sample comes first.
    pub fn is_big_endian(&self) -> bool {
        self.big_endian
    }

    /// Bytes before the first sample.
    pub fn skip(&self) -> u64 {
        self.skip
    }

    /// The middle slice of a file that lies so, thinned to at most `most` samples along each side: how many these are, and they, row by row.
    /// It may be there though the file is too short or too long for the layout.
    pub fn middle_slice(&self, path: &Path, most: usize) -> Result<([usize; 2], Vec<f32>), ReadError> {
        let ([nx, ny, nz], size) = (self.dims, self.sample.bytes() as u64);
        let (mut file, there) = open_file(path)?;
        let slice_bytes = (nx as u128 * ny as u128).saturating_mul(size.into());
        let begin = slice_bytes.saturating_mul(nz as u128 / 2).saturating_add(self.skip.into());
        let end = begin.saturating_add(slice_bytes);
        if end > u128::from(there) {
            return Err(ReadError::Truncated { wanted: end, there });
        }
        let row_bytes = nx as u64 * size;
        let step = nx.max(ny).div_ceil(most.max(1));
        let (mut row, mut values) = (vec![0; row_bytes as usize], vec![]);
        for j in (0..ny).step_by(step) {
            // It fits: the end does.
            file.seek(SeekFrom::Start(begin as u64 + j as u64 * row_bytes))?;
            file.read_exact(&mut row)?;
            values.extend(row.chunks_exact(size as usize).step_by(step).map(|sample| self.value(sample)));
        }
        Ok(([nx.div_ceil(step), ny.div_ceil(step)], values))
    }

    /// The value of a sample's bytes.
    fn value(&self, sample: &[u8]) -> f32 {
        let mut own = [0; 4];
        own[..sample.len()].copy_from_slice(sample);
        if self.big_endian {
            own[..sample.len()].reverse();
        }
        match self.sample {
            SampleType::U8 => own[0].into(),
            SampleType::U16 => u16::from_le_bytes([own[0], own[1]]).into(),
            SampleType::I16 => i16::from_le_bytes([own[0], own[1]]).into(),
            _ => f32::from_le_bytes(own),
        }
    }
}

impl fmt::Display for RawLayout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([nx, ny, nz], order) = (self.dims, if self.big_endian { ",be" } else { "" });
        let skip = if self.skip > 0 { format!(",skip={}", self.skip) } else { String::new() };
        write!(f, "{nx}x{ny}x{nz},{}{order}{skip}", self.type_name())
    }
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
