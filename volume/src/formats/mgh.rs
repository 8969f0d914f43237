//! FreeSurfer's `.mgh` and, by gzip, `.mgz`: 284 bytes of header, big-endian, as
//! <https://surfer.nmr.mgh.harvard.edu/fswiki/FsTutorial/MghFormat> has it; its world is RAS, ours LPS.

use super::decode::{Encoding, SampleType};
use super::packing::Packing;
use super::part::{Part, head_of};
use super::{Format, Hints, NO_DIRECTIONS, NO_SPACING, ReadError, Scan, Storage, bad};
use crate::{Grid, Progress};
use flate2::bufread::GzDecoder;
use glam::{DAffine3, DMat3, DVec3};
use std::io::Read;
use std::path::Path;

/// The row of the formats.
pub const FORMAT: Format = Format { name: "MGH", sniff, scan, write: None };

const SIZE: usize = 284;
/// Packed bytes that the header is looked for in.
const MOST_HEAD: u64 = 1 << 14;

fn sniff(path: &Path, head: &[u8], _progress: &Progress) -> bool {
    !head.is_empty() && path.extension().is_some_and(|e| ["mgh", "mgz"].iter().any(|n| e.eq_ignore_ascii_case(n)))
}

fn scan(path: &Path, hints: &Hints, _progress: &Progress) -> Result<Scan, ReadError> {
    let (head, there) = head_of(path, MOST_HEAD)?;
    let packing = if head.starts_with(&[0x1f, 0x8b]) { Packing::Gzip } else { Packing::Plain };
    let mut header = [0; SIZE];
    let read = match packing {
        Packing::Gzip => GzDecoder::new(head.as_slice()).read_exact(&mut header),
        _ => head.as_slice().read_exact(&mut header),
    };
    read.map_err(|_| ReadError::NoHeader("a header of MGH has 284 bytes"))?;
    let int = |at: usize| i32::from_be_bytes([header[at], header[at + 1], header[at + 2], header[at + 3]]);
    let float = |at: usize| f64::from(f32::from_be_bytes([header[at], header[at + 1], header[at + 2], header[at + 3]]));
    let vector = |at: usize| DVec3::new(float(at), float(at + 4), float(at + 8));
    if int(0) != 1 {
        return Err(bad("version", int(0), "it must be 1"));
    }
    if int(16) > 1 {
        return Err(ReadError::Unsupported(format!(
            "it has {} frames; only images of three axes can be read; split off one of them",
            int(16)
        )));
    }
    let sample = match int(20) {
        0 => SampleType::U8,
        1 => SampleType::I32,
        3 => SampleType::F32,
        4 => SampleType::I16,
        10 => SampleType::U16,
        code => return Err(bad("type", code, "it is none of MGH's types of one number")),
    };
    // Negative counts are as wrong as none.
    let dims = [4, 8, 12].map(|at| usize::try_from(int(at)).unwrap_or(0));
    let is_placed = i16::from_be_bytes([header[28], header[29]]) == 1;
    let mut warnings = vec![];
    let grid = if is_placed {
        let lps = DMat3::from_diagonal(DVec3::new(-1.0, -1.0, 1.0));
        let matrix = DMat3::from_cols(vector(42), vector(54), vector(66)) * DMat3::from_diagonal(vector(30));
        // The position is that of the middle, counted from the first sample by whole halves of the sizes.
        let origin = vector(78) - matrix * (DVec3::from(dims.map(|n| n as f64)) / 2.0);
        Grid::from_affine(dims, DAffine3::from_mat3_translation(lps * matrix, lps * origin))?
    } else {
        warnings.push(NO_DIRECTIONS.to_owned());
        if hints.spacing_mm.is_none() {
            warnings.push(NO_SPACING.to_owned());
        }
        Grid::new(dims, hints.spacing_mm.unwrap_or(DVec3::ONE), DVec3::ZERO, DMat3::IDENTITY)?
    };
    let part = Part::checked(path, packing, 0, SIZE as u64, grid.len() as u128 * sample.bytes() as u128, there)?;
    // What may follow are settings of the scanner, and names of files.
    let storage = Storage::Stream(Box::new(move |progress, take| {
        super::part::stream_all(std::slice::from_ref(&part), progress, take).map(|_| vec![])
    }));
    let scan = Scan::new(grid, Encoding { sample, big_endian: true }, there, storage);
    Ok(Scan { spacing_is_stated: is_placed || hints.spacing_mm.is_some(), warnings, ..scan })
}
