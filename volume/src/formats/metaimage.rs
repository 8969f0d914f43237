//! MetaImage: `.mha` with its samples inside, `.mhd` with them in one file or many, raw or zlib.
//!
//! Fields as in <https://itk.org/Wiki/MetaIO/Documentation>; its world is LPS.

pub mod write;

use super::decode::{Encoding, SampleType};
use super::packing::Packing;
use super::part::{Part, in_file, open_file};
use super::{Format, Hints, NO_SPACING, ReadError, Scan, Storage, Writer, bad};
use crate::{Grid, GridError, Progress, Unit};
use glam::{DMat3, DVec3};
use std::collections::HashMap;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::str::FromStr;

/// The row of the formats.
pub const FORMAT: Format = Format { name: "MetaImage", sniff, scan, write: Some(Writer { endings: &[".mha"], write: write::write }) };

fn sniff(path: &Path, head: &[u8], _progress: &Progress) -> bool {
    let named = path.extension().is_some_and(|e| ["mha", "mhd"].iter().any(|n| e.eq_ignore_ascii_case(n)));
    !head.is_empty() && (named || head.starts_with(b"ObjectType"))
}

/// Room for the names of 100,000 data files; a header that is longer is none.
const MOST_BYTES: u64 = 16 << 20;

/// More slices than the largest scanners make.
const MOST_FILES: usize = 100_000;

/// Names of one field in files of different age.
type Names = &'static [&'static str];

/// The field by which a file of this program keeps the unit of its values.
const UNIT: &str = "Unit";

const SPACING: Names = &["ElementSpacing", "ElementSize"];
const ORIGIN: Names = &["Offset", "Position", "Origin"];
const DIRECTION: Names = &["TransformMatrix", "Rotation", "Orientation"];
const BIG_ENDIAN: Names = &["BinaryDataByteOrderMSB", "ElementByteOrderMSB"];
/// Fields that are read or that only describe the file; all others are kept as they are.
const KNOWN: [&str; 26] = [
    "ObjectType",
    "ObjectSubType",
    "NDims",
    "BinaryData",
    "BinaryDataByteOrderMSB",
    "ElementByteOrderMSB",
    "CompressedData",
    "CompressedDataSize",
    "TransformMatrix",
    "Rotation",
    "Orientation",
    "Offset",
    "Position",
    "Origin",
    "CenterOfRotation",
    "AnatomicalOrientation",
    "ElementSpacing",
    "ElementSize",
    "DimSize",
    "HeaderSize",
    "ElementType",
    "ElementNumberOfChannels",
    "ElementDataFile",
    "ElementToIntensityFunctionSlope",
    "ElementToIntensityFunctionOffset",
    "CompressionLevel",
];

struct Header {
    fields: HashMap<String, String>,
    /// The names after `ElementDataFile = LIST`.
    list: Vec<String>,
    /// Its length, when samples follow it.
    bytes: u64,
}

impl Header {
    /// Reads the header, up to the samples where they follow.
    fn read(source: impl BufRead) -> Result<Self, ReadError> {
        let mut source = source.take(MOST_BYTES);
        let mut header = Self { fields: HashMap::new(), list: vec![], bytes: 0 };
        let mut line = || -> Result<Option<(String, u64)>, ReadError> {
            let mut line = vec![];
            let n = source.read_until(b'\n', &mut line)?;
            Ok((n > 0).then(|| (String::from_utf8_lossy(&line).trim().to_owned(), n as u64)))
        };
        while let Some((text, n)) = line()? {
            header.bytes += n;
            if text.is_empty() {
                continue;
            }
            let short = || text.chars().take(80).collect::<String>();
            let (key, value) = text.split_once('=').ok_or_else(|| bad("line", short(), "it is no `field = value`"))?;
            let (key, value) = (key.trim().to_owned(), value.trim().to_owned());
            let is_last = key == "ElementDataFile";
            let is_list = value.split_whitespace().next() == Some("LIST");
            header.fields.insert(key, value);
            if is_last {
                while is_list && let Some((name, _)) = line()? {
                    header.list.extend(Some(name).filter(|n| !n.is_empty()));
                }
                return Ok(header);
            }
        }
        Err(ReadError::MissingField("ElementDataFile"))
    }

    fn text(&self, names: Names) -> Option<(&'static str, &str)> {
        names.iter().find_map(|&n| Some((n, self.fields.get(n)?.as_str())))
    }

    fn numbers<T: FromStr, const N: usize>(&self, names: Names) -> Result<Option<[T; N]>, ReadError> {
        let Some((name, text)) = self.text(names) else { return Ok(None) };
        let numbers: Option<Vec<T>> = text.split_whitespace().map(|n| n.parse().ok()).collect();
        let numbers = numbers.and_then(|n| n.try_into().ok());
        numbers.map(Some).ok_or_else(|| bad(name, text, &format!("it must be {N} numbers")))
    }

    fn flag(&self, names: Names) -> Option<bool> {
        self.text(names).map(|(_, text)| text.eq_ignore_ascii_case("true") || text == "1")
    }
}

fn scan(path: &Path, hints: &Hints, progress: &Progress) -> Result<Scan, ReadError> {
    let (file, there) = open_file(path)?;
    let header = Header::read(BufReader::new(file))?;
    if let Some((name, text)) = header.text(&["NDims"]).filter(|(_, n)| *n != "3") {
        return Err(bad(name, text, "only images of three axes can be read"));
    }
    if let Some((_, n)) = header.text(&["ElementNumberOfChannels"]).filter(|(_, n)| *n != "1") {
        return Err(ReadError::Unsupported(format!("its samples have {n} channels; only one number a sample can be read")));
    }
    if header.flag(&["BinaryData"]) == Some(false) {
        return Err(ReadError::Unsupported("its samples are written as text; save it with binary data".into()));
    }
    let dims = header.numbers::<usize, 3>(&["DimSize"])?.ok_or(ReadError::MissingField("DimSize"))?;
    let encoding = encoding(&header)?;
    let mut warnings = vec![];
    let (grid, spacing_is_stated) = grid(&header, dims, hints, &mut warnings)?;
    let packing = if header.flag(&["CompressedData"]) == Some(true) { Packing::Zlib } else { Packing::Plain };
    let header_size = header.numbers::<i64, 1>(&["HeaderSize"])?.map_or(0, |[n]| n);
    if header_size < -1 || (header_size == -1 && packing != Packing::Plain) {
        return Err(bad("HeaderSize", header_size, "it must be a number of bytes, or -1 for raw data"));
    }
    let wanted = grid.len() as u128 * encoding.sample.bytes() as u128;
    let names = names(&header, dims[2])?;
    let (mut parts, mut file_bytes) = (vec![], 0_u64);
    if let [only] = &names[..]
        && ["local", "LOCAL", "Local"].contains(&only.as_str())
    {
        file_bytes = there;
        parts.push(Part::checked(path, packing, header.bytes, 0, wanted, there)?);
    } else {
        let folder = path.parent().unwrap_or(Path::new(""));
        let each = wanted / names.len() as u128;
        for name in &names {
            let file = folder.join(name);
            let part = open_file(&file).and_then(|(_, there)| {
                file_bytes = file_bytes.saturating_add(there);
                let start = u64::try_from(header_size).unwrap_or(u128::from(there).saturating_sub(each) as u64);
                Part::checked(&file, packing, start, 0, each, there)
            });
            parts.push(Part { beside: true, ..part.map_err(|e| in_file(&file, e))? });
            progress.advance(0)?;
        }
    }
    let number = |names, default| header.numbers::<f64, 1>(names).map(|n| n.map_or(default, |[n]| n));
    let slope = number(&["ElementToIntensityFunctionSlope"], 1.0)?;
    let intercept = number(&["ElementToIntensityFunctionOffset"], 0.0)?;
    let unit = match header.text(&[UNIT]) {
        Some((_, "HU")) => Some(Unit::Hounsfield),
        Some((_, "value")) => Some(Unit::Value),
        _ => None,
    };
    let metadata = header.fields.into_iter().filter(|(key, _)| !KNOWN.contains(&key.as_str()) && key != UNIT).collect();
    let scan = Scan::new(grid, encoding, file_bytes, Storage::Parts(parts));
    Ok(Scan { slope, intercept, unit, spacing_is_stated, warnings, metadata, ..scan })
}

fn encoding(header: &Header) -> Result<Encoding, ReadError> {
    let (name, text) = header.text(&["ElementType"]).ok_or(ReadError::MissingField("ElementType"))?;
    let sample = match text {
        "MET_CHAR" => SampleType::I8,
        "MET_UCHAR" => SampleType::U8,
        "MET_SHORT" => SampleType::I16,
        "MET_USHORT" => SampleType::U16,
        "MET_INT" | "MET_LONG" => SampleType::I32,
        "MET_UINT" | "MET_ULONG" => SampleType::U32,
        "MET_LONG_LONG" => SampleType::I64,
        "MET_ULONG_LONG" => SampleType::U64,
        "MET_FLOAT" => SampleType::F32,
        "MET_DOUBLE" => SampleType::F64,
        _ => return Err(bad(name, text, "it is none of MetaImage's types of one number")),
    };
    Ok(Encoding { sample, big_endian: header.flag(BIG_ENDIAN).unwrap_or(false) })
}

fn grid(header: &Header, dims: [usize; 3], hints: &Hints, warnings: &mut Vec<String>) -> Result<(Grid, bool), ReadError> {
    let spacing_mm = header.numbers::<f64, 3>(SPACING)?.map(DVec3::from).or(hints.spacing_mm);
    if spacing_mm.is_none() {
        warnings.push(NO_SPACING.into());
    }
    let origin_mm = header.numbers::<f64, 3>(ORIGIN)?.map_or(DVec3::ZERO, DVec3::from);
    // Three directions one after the other, each that of an axis.
    let direction = header.numbers::<f64, 9>(DIRECTION)?.map_or(DMat3::IDENTITY, |m| DMat3::from_cols_array(&m));
    let grid = Grid::new(dims, spacing_mm.unwrap_or(DVec3::ONE), origin_mm, direction).map_err(|e| match e {
        GridError::Spacing { .. } => bad(SPACING[0], header.text(SPACING).map_or("", |(_, text)| text), &e.to_string()),
        e => e.into(),
    })?;
    Ok((grid, spacing_mm.is_some()))
}

/// The data files: `LOCAL`, one name, a list, or a pattern with minimum, maximum and step.
fn names(header: &Header, slices: usize) -> Result<Vec<String>, ReadError> {
    let text = &header.fields["ElementDataFile"];
    let wrong = |problem: &str| bad("ElementDataFile", text, problem);
    let words: Vec<&str> = text.split_whitespace().collect();
    let names = match words.as_slice() {
        ["LIST"] | ["LIST", _] => header.list.clone(),
        [pattern, first, last, rest @ ..] if pattern.contains('%') && rest.len() < 2 => {
            let whole = |n: &str| n.parse::<u32>().map_err(|_| wrong("minimum, maximum and step must be whole numbers"));
            let (first, last, step) = (whole(first)?, whole(last)?, rest.first().map_or(Ok(1), |n| whole(n))?);
            let (before, after) = pattern.split_once('%').unwrap_or((pattern, ""));
            let (digits, after) = after.split_once('d').ok_or_else(|| wrong("the pattern must hold one number like %d or %03d"))?;
            let width: usize = if digits.is_empty() { 0 } else { digits.parse().map_err(|_| wrong("its number is no %03d"))? };
            // More digits than a file name can have name no file; more files than slices hold none.
            let count = if step == 0 || first > last { 0 } else { ((last - first) / step) as usize + 1 };
            if width > 255 || count == 0 || count > slices.min(MOST_FILES) {
                return Err(wrong("the pattern names no files, or more than there are slices"));
            }
            (first..=last).step_by(step as usize).map(|n| format!("{before}{n:0width$}{after}")).collect()
        }
        [] => return Err(wrong("it names no file")),
        _ => vec![text.clone()],
    };
    if names.is_empty() || !slices.is_multiple_of(names.len()) {
        let text = format!("it names {} data files for {slices} slices", names.len());
        return Err(ReadError::Contradiction(text));
    }
    Ok(names)
}
