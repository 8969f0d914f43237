//! VTK's old files, `.vtk`, of image data: `STRUCTURED_POINTS` with one number a point, as text or big-endian, as
//! <https://docs.vtk.org/en/latest/vtk_file_formats/vtk_legacy_file_format.html> has it.

use super::decode::{Encoding, SampleType};
use super::packing::{Packing, counted};
use super::part::{Part, head_of, open_file};
use super::text::{decimals, numbers, sizes};
use super::{Format, Hints, NO_DIRECTIONS, NO_SPACING, ReadError, Scan, Storage, bad};
use crate::{Grid, Progress};
use glam::{DMat3, DVec3};
use std::io::{Seek, SeekFrom};
use std::path::Path;

/// The row of the formats.
pub const FORMAT: Format = Format { name: "VTK", sniff, scan, write: None };

/// A header of ten lines; some programs put lists of fields before the samples.
const MOST_HEAD: u64 = 1 << 16;

fn sniff(_path: &Path, head: &[u8], _progress: &Progress) -> bool {
    head.starts_with(b"# vtk DataFile")
}

/// What the lines before the samples say.
#[derive(Default)]
struct Header {
    is_text: bool,
    dims: Option<[usize; 3]>,
    spacing_mm: Option<DVec3>,
    origin_mm: DVec3,
    points: Option<usize>,
    sample: Option<SampleType>,
    /// The samples begin at this byte.
    start: u64,
}

fn scan(path: &Path, hints: &Hints, _progress: &Progress) -> Result<Scan, ReadError> {
    let (head, there) = head_of(path, MOST_HEAD)?;
    let header = Header::parse(&head)?;
    let (Some(dims), Some(sample)) = (header.dims, header.sample) else {
        return Err(ReadError::MissingField(if header.dims.is_none() { "DIMENSIONS" } else { "SCALARS" }));
    };
    let spacing_mm = header.spacing_mm.or(hints.spacing_mm);
    let grid = Grid::new(dims, spacing_mm.unwrap_or(DVec3::ONE), header.origin_mm, DMat3::IDENTITY)?;
    if header.points.is_some_and(|n| n != grid.len()) {
        let text = format!("its DIMENSIONS make {} points, its POINT_DATA says {}", grid.len(), header.points.unwrap_or(0));
        return Err(ReadError::Contradiction(text));
    }
    let wanted = grid.len() as u128 * sample.bytes() as u128;
    let left = there.saturating_sub(header.start);
    let storage = if header.is_text {
        // A number and a space.
        if grid.len() as u128 * 2 > u128::from(left) + 1 {
            return Err(ReadError::Truncated { wanted, there: left });
        }
        let (path, count) = (path.to_owned(), grid.len() as u64);
        Storage::Stream(Box::new(move |progress, take| {
            let mut file = open_file(&path)?.0;
            file.seek(SeekFrom::Start(header.start))?;
            numbers(counted(file, progress), sample, count, "SCALARS", progress, take)?;
            Ok(vec![])
        }))
    } else {
        Storage::Parts(vec![Part::checked(path, Packing::Plain, header.start, 0, wanted, there)?])
    };
    let mut warnings = vec![NO_DIRECTIONS.to_owned()];
    if spacing_mm.is_none() {
        warnings.push(NO_SPACING.into());
    }
    let scan = Scan::new(grid, Encoding { sample, big_endian: !header.is_text }, there, storage);
    Ok(Scan { spacing_is_stated: spacing_mm.is_some(), warnings, ..scan })
}

impl Header {
    fn parse(head: &[u8]) -> Result<Self, ReadError> {
        let mut header = Self::default();
        let mut at = 0;
        for (number, line) in head.split_inclusive(|b| *b == b'\n').enumerate() {
            at += line.len() as u64;
            let text = String::from_utf8_lossy(line);
            let (word, rest) = text.trim().split_once(char::is_whitespace).unwrap_or((text.trim(), ""));
            let word = word.to_uppercase();
            let wrong = |what: &str| bad(&word, rest, what);
            // The second line is a title, whatever it says.
            match word.as_str() {
                _ if number < 2 => {}
                "ASCII" => header.is_text = true,
                "DATASET" if !rest.trim().eq_ignore_ascii_case("STRUCTURED_POINTS") => {
                    return Err(ReadError::Unsupported(format!("it is a data set of {}; only STRUCTURED_POINTS are a scan", rest.trim())));
                }
                "DIMENSIONS" => header.dims = Some(decimals(rest).and_then(sizes).ok_or_else(|| wrong("it must be three whole numbers"))?),
                "SPACING" | "ASPECT_RATIO" => {
                    header.spacing_mm = Some(decimals(rest).map(DVec3::from_array).ok_or_else(|| wrong("it must be three numbers"))?);
                }
                "ORIGIN" => header.origin_mm = decimals(rest).map(DVec3::from_array).ok_or_else(|| wrong("it must be three numbers"))?,
                "POINT_DATA" => header.points = Some(rest.trim().parse().map_err(|_| wrong("it must be a whole number"))?),
                "CELL_DATA" => {
                    let text = "its numbers are those of cells, not of points; turn them with ParaView's Cell Data to Point Data";
                    return Err(ReadError::Unsupported(text.into()));
                }
                "SCALARS" => {
                    let words: Vec<&str> = rest.split_whitespace().collect();
                    if words.get(2).is_some_and(|n| *n != "1") {
                        return Err(ReadError::Unsupported(format!(
                            "its samples have {} parts; only one number a sample can be read",
                            words[2]
                        )));
                    }
                    header.sample =
                        Some(sample_type(words.get(1).copied().unwrap_or_default()).ok_or_else(|| wrong("it is no type of VTK's"))?);
                    header.start = at;
                }
                // It may be left out.
                "LOOKUP_TABLE" if header.sample.is_some() => {
                    header.start = at;
                    break;
                }
                _ if header.sample.is_some() => break,
                "COLOR_SCALARS" | "VECTORS" | "TENSORS" | "NORMALS" | "FIELD" if header.points.is_some() => {
                    return Err(ReadError::Unsupported(format!("its first numbers are {word}; only SCALARS can be read")));
                }
                _ => {}
            }
        }
        Ok(header)
    }
}

fn sample_type(name: &str) -> Option<SampleType> {
    Some(match name.to_lowercase().as_str() {
        "unsigned_char" => SampleType::U8,
        "char" | "signed_char" => SampleType::I8,
        "unsigned_short" => SampleType::U16,
        "short" => SampleType::I16,
        "unsigned_int" => SampleType::U32,
        "int" => SampleType::I32,
        "unsigned_long" | "vtktypeuint64" => SampleType::U64,
        "long" | "vtktypeint64" | "vtkidtype" => SampleType::I64,
        "float" => SampleType::F32,
        "double" => SampleType::F64,
        _ => return None,
    })
}
