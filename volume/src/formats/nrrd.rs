//! NRRD, attached (`.nrrd`) and detached (`.nhdr`), as <https://teem.sourceforge.net/nrrd/format.html> defines it:
//! three axes, raw or gzip data in one file or many.

mod header;
mod space;
mod write;

pub use write::{Compression, WriteError, write};

use super::decode::{Decoder, Encoding, SampleType, counted, open_file};
use super::{Format, Hints, MORE_BYTES, ReadError, guess_unit};
use crate::{Progress, Raster, Unit};
use header::Header;
use std::io::BufRead;
use std::path::{Path, PathBuf};

/// The row of the formats.
pub const FORMAT: Format = Format { name: "NRRD", sniff, read };

fn sniff(_path: &Path, head: &[u8]) -> bool {
    head.starts_with(b"NRRD")
}

fn read(path: &Path, hints: &Hints, progress: &Progress) -> Result<Raster, ReadError> {
    let (file, length) = open_file(path)?;
    let mut reader = counted(file, progress);
    let header = Header::read(&mut reader)?;
    let encoding = encoding(&header)?;
    let sizes = space::sizes(&header)?;
    let mut warnings = vec![];
    let grid = space::grid(&header, &sizes, hints, &mut warnings)?;
    let byte_skip = header.number::<i64>("byte skip")?.unwrap_or(0);
    if byte_skip < -1 || (byte_skip == -1 && encoding.gzip) {
        return Err(header.bad("byte skip", "it must be a number of bytes, or -1 for raw data"));
    }
    let part = Part { encoding, byte_skip, line_skip: header.number("line skip")?.unwrap_or(0), count: grid.len() };

    let samples = match data_files(&header, &sizes)? {
        None if !header.ended => return Err(ReadError::NoHeader("it has no empty line before the samples and names no data file")),
        None => {
            let there = length - header.bytes;
            progress.begin(length);
            let skip = part.skip(there)?;
            let mut decoder = Decoder::new(encoding, grid.len(), there, progress)?;
            if part.fill(&mut decoder, &mut reader, there, skip)? {
                warnings.push(MORE_BYTES.into());
            }
            decoder.finish(&mut warnings)
        }
        Some(files) => {
            let part = Part { count: grid.len() / files.count, ..part };
            let folder = path.parent().unwrap_or(Path::new(""));
            // All sizes are known before the first sample is asked for.
            let mut total = 0_u64;
            for n in 0..files.count {
                let file = folder.join(files.name(n));
                let length = open_file(&file).and_then(|(_, there)| part.skip(there).map(|_| there));
                total = total.saturating_add(length.map_err(|e| in_file(&file, e))?);
                progress.advance(0)?;
            }
            progress.begin(total);
            let mut decoder = Decoder::new(encoding, grid.len(), total, progress)?;
            let mut more = false;
            for n in 0..files.count {
                let path = folder.join(files.name(n));
                let filled =
                    open_file(&path).and_then(|(file, there)| part.fill(&mut decoder, counted(file, progress), there, part.skip(there)?));
                more |= filled.map_err(|e| in_file(&path, e))?;
            }
            if more {
                warnings.push(MORE_BYTES.into());
            }
            decoder.finish(&mut warnings)
        }
    };

    let scale = |key: &'static str, default| match header.keys.get(key) {
        Some(text) => text.trim().parse::<f64>().map_err(|_| bad_key(key, text, "it is no number")),
        None => Ok(default),
    };
    let (slope, intercept) = (scale("slope", 1.0)?, scale("intercept", 0.0)?);
    let unit = match header.keys.get("unit").map(String::as_str) {
        Some("HU") => Unit::Hounsfield,
        Some("value") => Unit::Value,
        _ => guess_unit(&samples, slope, intercept),
    };
    Ok(Raster { grid, samples, slope, intercept, unit, warnings })
}

fn in_file(file: &Path, reason: ReadError) -> ReadError {
    match reason {
        ReadError::Cancelled(c) => ReadError::Cancelled(c),
        reason => ReadError::DataFile { file: file.to_owned(), reason: Box::new(reason) },
    }
}

fn bad_key(key: &str, content: &str, problem: &str) -> ReadError {
    ReadError::BadField { field: key.into(), content: content.into(), problem: problem.into() }
}

fn encoding(header: &Header) -> Result<Encoding, ReadError> {
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
    let gzip = match header.required("encoding")?.to_lowercase().as_str() {
        "raw" => false,
        "gz" | "gzip" => true,
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
    Ok(Encoding { sample, big_endian, gzip })
}

/// What every data file holds.
#[derive(Clone, Copy)]
struct Part {
    encoding: Encoding,
    byte_skip: i64,
    line_skip: u64,
    count: usize,
}

impl Part {
    /// Bytes before the samples of a file with `there` bytes; refuses a file that is too short.
    fn skip(&self, there: u64) -> Result<u64, ReadError> {
        let samples = (self.count * self.encoding.sample.bytes()) as u64;
        let skip = u64::try_from(self.byte_skip).unwrap_or(there.saturating_sub(samples));
        self.encoding.check(self.count, skip, there)?;
        Ok(skip)
    }

    /// Takes this part's samples. Lines come before the compressed data, bytes are skipped after decompression; data at the
    /// end of the file (byte skip −1) has no lines to skip. True when more bytes follow.
    fn fill(&self, decoder: &mut Decoder<'_>, mut source: impl BufRead, there: u64, skip: u64) -> Result<bool, ReadError> {
        let mut skipped = 0;
        let lines = if self.byte_skip < 0 { 0 } else { self.line_skip };
        for _ in 0..lines {
            match source.skip_until(b'\n')? {
                0 => break,
                n => skipped += n as u64,
            }
        }
        self.encoding.check(self.count, skip, there.saturating_sub(skipped))?;
        decoder.fill(source, skip, self.count)
    }
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
