//! NRRD, attached (`.nrrd`) and detached (`.nhdr`), as <https://teem.sourceforge.net/nrrd/format.html> defines it:
//! three axes, raw or gzip data in one file or many.

mod header;
mod space;
mod write;

use write::write_plain;
pub use write::{Compression, write};

use super::decode::{Encoding, SampleType};
use super::packing::{Packing, counted};
use super::part::{Part, in_file, open_file, stream_all};
use super::{Format, Hints, ReadError, Scan, Storage, Writer, bad};
use crate::{Metadata, Progress, Unit};
use header::Header;
use std::path::{Path, PathBuf};

/// The row of the formats.
pub const FORMAT: Format = Format { name: "NRRD", sniff, scan, write: Some(Writer { endings: &[".nrrd"], write: write_plain }) };

/// Under this name metadata says how many label maps a file lists, where one of them was asked for (see [`Hints::layer`]).
pub const LAYERS: &str = "layers";

fn sniff(_path: &Path, head: &[u8], _progress: &Progress) -> bool {
    head.starts_with(b"NRRD")
}

fn scan(path: &Path, hints: &Hints, progress: &Progress) -> Result<Scan, ReadError> {
    let (file, length) = open_file(path)?;
    let header = Header::read(&mut counted(file, progress))?;
    let (encoding, packing) = encoding(&header)?;
    let sizes = space::sizes(&header)?;
    let mut warnings = vec![];
    let (grid, spacing_is_stated) = space::grid(&header, &sizes, hints, &mut warnings)?;
    let byte_skip = header.number::<i64>("byte skip")?.unwrap_or(0);
    if byte_skip < -1 || (byte_skip == -1 && packing != Packing::Plain) {
        return Err(header.bad("byte skip", "it must be a number of bytes, or -1 for raw data"));
    }
    let layers = Layers::of(&header, &sizes, hints)?;
    let wanted = (grid.len() * layers.count) as u128 * encoding.sample.bytes() as u128;
    // Lines come before packed data, bytes are skipped once unpacked; data at the end of the file (byte skip -1) has no lines to skip.
    let lines = if byte_skip < 0 { 0 } else { header.number("line skip")?.unwrap_or(0) };
    let part = |file: &Path, start: u64, there: u64, wanted: u128| {
        let skip = u64::try_from(byte_skip).unwrap_or(u128::from(there - start).saturating_sub(wanted) as u64);
        Part::checked(file, packing, start, skip, wanted, there).map(|part| Part { lines, ..part })
    };
    let (parts, file_bytes) = match data_files(&header, &sizes)? {
        None if !header.ended => return Err(ReadError::NoHeader("it has no empty line before the samples and names no data file")),
        None => (vec![part(path, header.bytes, length, wanted)?], length - header.bytes),
        Some(files) => {
            let folder = path.parent().unwrap_or(Path::new(""));
            let (mut parts, mut total) = (vec![], 0_u64);
            for n in 0..files.count {
                let file = folder.join(files.name(n));
                let one = open_file(&file).and_then(|(_, there)| {
                    total = total.saturating_add(there);
                    part(&file, 0, there, wanted / files.count as u128)
                });
                parts.push(Part { beside: true, ..one.map_err(|e| in_file(&file, e))? });
                progress.advance(0)?;
            }
            (parts, total)
        }
    };
    let scale = |key: &'static str, default| match header.keys.get(key) {
        Some(text) => text.trim().parse::<f64>().map_err(|_| bad(key, text, "it is no number")),
        None => Ok(default),
    };
    let (slope, intercept) = (scale("slope", 1.0)?, scale("intercept", 0.0)?);
    let unit = match header.keys.get("unit").map(String::as_str) {
        Some("HU") => Some(Unit::Hounsfield),
        Some("value") => Some(Unit::Value),
        _ => None,
    };
    let mut metadata: Metadata =
        header.keys.into_iter().filter(|(key, _)| !["slope", "intercept", "unit"].contains(&key.as_str())).collect();
    if hints.layer.is_some() {
        metadata.insert(LAYERS.to_owned(), layers.count.to_string());
    }
    let scan = Scan::new(grid, encoding, file_bytes, layers.storage(parts, encoding.sample.bytes()));
    Ok(Scan { slope, intercept, unit, spacing_is_stated, warnings, metadata, ..scan })
}

/// The label maps of a file that lie along an axis which is none of space, and which of them is read.
#[derive(Clone, Copy)]
struct Layers {
    count: usize,
    /// Samples from one to the next.
    stride: usize,
    read: usize,
}

impl Layers {
    fn of(header: &Header, sizes: &[usize], hints: &Hints) -> Result<Self, ReadError> {
        let axis = if hints.layer.is_some() { space::list_axis(header, sizes)? } else { None };
        let (count, stride) = axis.map_or((1, 1), |axis| (sizes[axis], sizes[..axis].iter().product()));
        let read = hints.layer.unwrap_or(0);
        if read < count {
            return Ok(Self { count, stride, read });
        }
        let text = format!("a segment of it is in layer {read}, but it has {count}, counted from 0");
        Err(ReadError::Contradiction(text))
    }

    /// The samples of the layer that is read, of `bytes` bytes each.
    fn storage(self, parts: Vec<Part>, bytes: usize) -> Storage {
        if self.count == 1 {
            return Storage::Parts(parts);
        }
        Storage::Stream(Box::new(move |progress, take| {
            let (mut passed, mut picked) = (0, vec![]);
            stream_all(&parts, progress, &mut |samples| {
                picked.clear();
                for (n, sample) in samples.chunks_exact(bytes).enumerate() {
                    if (passed + n) / self.stride % self.count == self.read {
                        picked.extend_from_slice(sample);
                    }
                }
                passed += samples.len() / bytes;
                take(&picked)
            })
        }))
    }
}

fn encoding(header: &Header) -> Result<(Encoding, Packing), ReadError> {
    let sample = match header.required("type")?.to_lowercase().as_str() {
        "signed char" | "int8" | "int8_t" => SampleType::I8,
        "uchar" | "unsigned char" | "uint8" | "uint8_t" => SampleType::U8,
        "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => SampleType::I16,
        "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => SampleType::U16,
        "int" | "signed int" | "int32" | "int32_t" => SampleType::I32,
        "uint" | "unsigned int" | "uint32" | "uint32_t" => SampleType::U32,
        "longlong" | "long long" | "long long int" | "signed long long" | "signed long long int" | "int64" | "int64_t" => SampleType::I64,
        "ulonglong" | "unsigned long long" | "unsigned long long int" | "uint64" | "uint64_t" => SampleType::U64,
        "float" => SampleType::F32,
        "double" => SampleType::F64,
        "block" => return Err(ReadError::Unsupported("its samples are of NRRD type `block`; only numbers can be read".into())),
        _ => return Err(header.bad("type", "it is none of NRRD's sample types")),
    };
    let packing = match header.required("encoding")?.to_lowercase().as_str() {
        "raw" => Packing::Plain,
        "gz" | "gzip" => Packing::Gzip,
        other => {
            let text =
                format!("its samples are in NRRD encoding {other:?}; only raw and gzip are read; convert it with `unu save -e gzip`");
            return Err(ReadError::Unsupported(text));
        }
    };
    let big_endian = match header.value("endian").map(str::to_lowercase).as_deref() {
        Some("little") => false,
        Some("big") => true,
        None if sample.bytes() == 1 => false,
        None => return Err(ReadError::MissingField("endian")),
        Some(_) => return Err(header.bad("endian", "it must be `little` or `big`")),
    };
    Ok((Encoding { sample, big_endian }, packing))
}

/// The data files beside a header.
struct DataFiles<'a> {
    count: usize,
    names: Names<'a>,
}

enum Names<'a> {
    One(&'a str),
    List(&'a [String]),
    Pattern { before: &'a str, digits: usize, after: &'a str, first: i64, step: i64 },
}

impl DataFiles<'_> {
    fn name(&self, n: usize) -> PathBuf {
        match &self.names {
            Names::One(name) => PathBuf::from(name),
            Names::List(names) => PathBuf::from(&names[n]),
            Names::Pattern { before, digits, after, first, step } => {
                // 128 bits, as first and step may be anything.
                let number = i128::from(*first) + i128::from(*step) * n as i128;
                PathBuf::from(format!("{before}{number:0digits$}{after}"))
            }
        }
    }
}

fn data_files<'a>(header: &'a Header, sizes: &[usize]) -> Result<Option<DataFiles<'a>>, ReadError> {
    let Some(text) = header.value("data file") else { return Ok(None) };
    let words: Vec<&str> = text.split_whitespace().collect();
    let (files, axes) = match words.as_slice() {
        ["LIST"] => (DataFiles { count: header.list.len(), names: Names::List(&header.list) }, None),
        ["LIST", axes] => (DataFiles { count: header.list.len(), names: Names::List(&header.list) }, Some(*axes)),
        [pattern, range @ .., last] if pattern.contains('%') && (2..=3).contains(&range.len()) => {
            let axes = (range.len() == 3).then_some(*last);
            (numbered(header, pattern, &words[1..4])?, axes)
        }
        _ => return Ok(Some(DataFiles { count: 1, names: Names::One(text) })),
    };
    let axes = match axes.map(str::parse) {
        None => sizes.len() - 1,
        Some(Ok(axes)) if (1..=sizes.len()).contains(&axes) => axes,
        Some(_) => return Err(header.bad("data file", "the number of axes of one file must be from 1 to the dimension")),
    };
    // Files either hold the first `axes` axes, one for each index of the others, or share the slowest axis between them.
    let wanted: usize = sizes[axes..].iter().product();
    let slowest = sizes[sizes.len() - 1];
    let fits = if axes < sizes.len() { files.count == wanted } else { files.count > 0 && slowest.is_multiple_of(files.count) };
    if !fits {
        let text = format!("it names {} data files for an image of sizes {sizes:?}, {axes} axes in each", files.count);
        return Err(ReadError::Contradiction(text));
    }
    Ok(Some(files))
}

/// Files named by a printf pattern such as `slices/%03d.raw` and `range`: first, last and step.
fn numbered<'a>(header: &Header, pattern: &'a str, range: &[&str]) -> Result<DataFiles<'a>, ReadError> {
    let bad = |problem| header.bad("data file", problem);
    let numbers: Option<Vec<i64>> = range.iter().map(|n| n.parse().ok()).collect();
    let Some(&[first, last, step]) = numbers.as_deref() else { return Err(bad("minimum, maximum and step must be whole numbers")) };
    let (before, rest) = pattern.split_once('%').unwrap_or((pattern, ""));
    let width = rest.len() - rest.trim_start_matches(|c: char| c.is_ascii_digit()).len();
    let (digits, after) = (&rest[..width], rest[width..].strip_prefix(['d', 'i', 'u']));
    let (Some(after), true) = (after, digits.is_empty() || digits.starts_with('0')) else {
        return Err(bad("the pattern must hold one number like %d or %03d"));
    };
    // A path component is at most 255 bytes on all common file systems, so more digits name no file.
    let digits = if digits.is_empty() { Some(0) } else { digits.parse().ok().filter(|&n| n <= 255) };
    let (Some(digits), false) = (digits, after.contains('%')) else { return Err(bad("the pattern must hold one number like %d or %03d")) };
    // 128 bits, as the ends may be those of i64.
    let (span, step_wide) = (i128::from(last) - i128::from(first), i128::from(step));
    let count = if step == 0 || span.signum() * step_wide.signum() < 0 { 0 } else { span / step_wide + 1 };
    match usize::try_from(count) {
        Ok(count) if count > 0 => Ok(DataFiles { count, names: Names::Pattern { before, digits, after, first, step } }),
        _ => Err(bad("minimum, maximum and step name no file")),
    }
}
