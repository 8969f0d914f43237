//! Amira's and Avizo's `.am`: a lattice of uniform coordinates, as text or binary, plain, by zlib (`HxZip`) or in runs (`HxByteRLE`, labels), as the
//! AmiraMesh chapter of Amira's user guide has it.

use super::decode::{Encoding, SampleType};
use super::packing::{MOST_EXPANSION, Packing, check_expansion_to, counted};
use super::part::{Part, head_of, open_file, read_all};
use super::text::{decimals, numbers, sizes};
use super::units::unit_mm;
use super::{Format, Hints, NO_DIRECTIONS, NO_SPACING, ReadError, Scan, Sink, Storage, bad};
use crate::{Grid, Progress};
use glam::{DMat3, DVec3};
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

/// The row of the formats.
pub const FORMAT: Format = Format { name: "Amira", sniff, scan, write: None };

/// Headers of labels list materials; histories of programs can be long.
const MOST_HEAD: u64 = 1 << 20;
/// A run of 127 is two bytes.
const MOST_RUN: u64 = 64;

fn sniff(_path: &Path, head: &[u8], _progress: &Progress) -> bool {
    head.starts_with(b"# AmiraMesh") || head.starts_with(b"# Avizo")
}

/// How the samples are packed.
#[derive(Clone, Copy)]
enum Form {
    Text,
    Plain,
    Zip,
    Runs,
}

/// What the lines before the samples say.
struct Header {
    dims: [usize; 3],
    encoding: Encoding,
    form: Form,
    /// Bytes of packed samples.
    packed: u64,
    /// The samples begin at this byte.
    start: u64,
    grid: Grid,
    spacing_is_stated: bool,
}

impl Header {
    fn parse(head: &[u8], hints: &Hints) -> Result<Self, ReadError> {
        // The samples of the first array; behind the header a line names it by the same sign. Bytes are counted, whatever letters they are.
        let find = |mark: &[u8]| head.windows(mark.len()).position(|w| w == mark).map(|n| (n, n + mark.len()));
        let (end, start) = find(b"\n@1\n").or_else(|| find(b"\n@1\r\n")).ok_or(ReadError::NoHeader("its samples (@1) do not begin"))?;
        let header = String::from_utf8_lossy(&head[..end]);
        let after = |word: &str| header.find(word).map(|n| header[n + word.len()..].lines().next().unwrap_or_default().trim());
        let lattice = after("define Lattice");
        let lattice = lattice.ok_or_else(|| ReadError::Unsupported("it is no lattice of samples; only those can be read".into()))?;
        let dims = decimals(lattice).and_then(sizes).ok_or_else(|| bad("define Lattice", lattice, "it must be three whole numbers"))?;
        let coordinates = after("CoordType").unwrap_or_default().trim_matches(['"', ',', ' ']);
        if !["", "uniform"].contains(&coordinates) {
            let text = format!("its coordinates are {coordinates:?}; only uniform ones can be read; resample it there");
            return Err(ReadError::Unsupported(text));
        }
        let array = header.lines().find(|line| line.trim_start().starts_with("Lattice") && line.contains("@1"));
        let array = array.ok_or(ReadError::MissingField("Lattice { … } @1"))?.trim();
        let sample = sample_type(array)?;
        let first = header.lines().next().unwrap_or_default();
        let (form, packed) = if first.contains("ASCII") { (Form::Text, 0) } else { packing(array, sample)? };
        let big_endian = !first.contains("LITTLE-ENDIAN") && !matches!(form, Form::Text);
        let place = BoxOf { text: after("BoundingBox"), unit: after("Coordinates \"") };
        let spacing_is_stated = place.text.is_some() || hints.spacing_mm.is_some();
        let grid = place.grid(dims, hints)?;
        Ok(Self { dims, encoding: Encoding { sample, big_endian }, form, packed, start: start as u64, grid, spacing_is_stated })
    }

    fn count(&self) -> u64 {
        self.dims.iter().map(|&n| n as u64).product()
    }
}

fn sample_type(array: &str) -> Result<SampleType, ReadError> {
    let kind = array.split(['{', '}']).nth(1).and_then(|inner| inner.split_whitespace().next()).unwrap_or_default();
    Ok(match kind {
        "byte" => SampleType::U8,
        "short" => SampleType::I16,
        "ushort" => SampleType::U16,
        "int" | "int32" => SampleType::I32,
        "float" => SampleType::F32,
        "double" => SampleType::F64,
        _ => return Err(bad("Lattice", array, "it is no type of one number that can be read")),
    })
}

/// How binary samples are packed, and into how many bytes, from `@1(HxZip,12589)`.
fn packing(array: &str, sample: SampleType) -> Result<(Form, u64), ReadError> {
    let stated = array.split_once('(').and_then(|(_, inner)| inner.split_once(')'));
    let Some((stated, _)) = stated else { return Ok((Form::Plain, 0)) };
    let (name, bytes) = stated.split_once(',').unwrap_or((stated, ""));
    let form = match name.trim() {
        "HxZip" => Form::Zip,
        "HxByteRLE" if sample == SampleType::U8 => Form::Runs,
        other => return Err(ReadError::Unsupported(format!("its samples are packed by {other}, which is not read; save it unpacked"))),
    };
    Ok((form, bytes.trim().parse().map_err(|_| bad("Lattice", array, "the packed bytes must be a whole number"))?))
}

fn scan(path: &Path, hints: &Hints, _progress: &Progress) -> Result<Scan, ReadError> {
    let (head, there) = head_of(path, MOST_HEAD)?;
    let header = Header::parse(&head, hints)?;
    let Header { encoding, form, packed, start, .. } = header;
    let count = header.count();
    let wanted = u128::from(count) * encoding.sample.bytes() as u128;
    let left = there - start;
    match form {
        Form::Plain if wanted > u128::from(left) => return Err(ReadError::Truncated { wanted, there: left }),
        // A number and a space.
        Form::Text if u128::from(count) * 2 > u128::from(left) + 1 => return Err(ReadError::Truncated { wanted, there: left }),
        Form::Zip => check_expansion_to(wanted, packed.min(left), MOST_EXPANSION)?,
        Form::Runs => check_expansion_to(wanted, packed.min(left), MOST_RUN)?,
        Form::Plain | Form::Text => {}
    }
    let file = path.to_owned();
    let packing = if matches!(form, Form::Zip) { Packing::Zlib } else { Packing::Plain };
    let part = Part { file: path.to_owned(), beside: false, start, lines: 0, packing, skip: 0, bytes: wanted as u64 };
    let storage = Storage::Stream(Box::new(move |progress, take| {
        let open = || -> Result<_, ReadError> {
            let mut source = open_file(&file)?.0;
            source.seek(SeekFrom::Start(start))?;
            Ok(counted(source, progress))
        };
        match form {
            Form::Text => numbers(open()?, encoding.sample, count, "Lattice", progress, take)?,
            Form::Runs => runs(open()?.take(packed), count, progress, take)?,
            // Other arrays may follow, of which nothing is said.
            Form::Plain | Form::Zip => drop(super::part::stream_all(std::slice::from_ref(&part), progress, take)?),
        }
        Ok(vec![])
    }));
    let mut warnings = vec![NO_DIRECTIONS.to_owned()];
    if !header.spacing_is_stated {
        warnings.push(NO_SPACING.into());
    }
    let spacing_is_stated = header.spacing_is_stated;
    Ok(Scan { spacing_is_stated, warnings, ..Scan::new(header.grid, encoding, there, storage) })
}

/// What the header says about where the samples lie.
struct BoxOf<'a> {
    /// First and last sample along each axis.
    text: Option<&'a str>,
    unit: Option<&'a str>,
}

impl BoxOf<'_> {
    fn grid(&self, dims: [usize; 3], hints: &Hints) -> Result<Grid, ReadError> {
        let Some(text) = self.text else {
            return Ok(Grid::new(dims, hints.spacing_mm.unwrap_or(DVec3::ONE), DVec3::ZERO, DMat3::IDENTITY)?);
        };
        let ends: [f64; 6] = decimals(text.trim_end_matches(',')).ok_or_else(|| bad("BoundingBox", text, "it must be six numbers"))?;
        // Amira's own unit is none; mm are usual.
        let mm = self.unit.and_then(|unit| unit_mm(unit.split('"').next()?)).unwrap_or(1.0);
        // Of one sample only, the box is its thickness.
        let spacing = |axis: usize| (ends[2 * axis + 1] - ends[2 * axis]) / (dims[axis].max(2) - 1) as f64 * mm;
        let origin_mm = DVec3::new(ends[0], ends[2], ends[4]) * mm;
        Ok(Grid::new(dims, DVec3::new(spacing(0), spacing(1), spacing(2)), origin_mm, DMat3::IDENTITY)?)
    }
}

/// Bytes in runs: up to 127 times the byte that follows, or, above 128, so many bytes less 128 as they are.
fn runs(mut source: impl Read, count: u64, progress: &Progress, take: &mut Sink<'_>) -> Result<(), ReadError> {
    let mut left = count;
    let mut out = vec![];
    while left > 0 {
        let mut control = [0; 1];
        let mut bytes = [0; 127];
        let used = match read_all(&mut source, &mut control)? {
            0 => 0,
            _ if control[0] < 128 => read_all(&mut source, &mut bytes[..1])?,
            _ => read_all(&mut source, &mut bytes[..usize::from(control[0] - 128)])?,
        };
        let n = u64::from(control[0] & 127).min(left) as usize;
        if used == 0 && n > 0 || control[0] > 128 && used < n {
            return Err(ReadError::Truncated { wanted: count.into(), there: count - left });
        }
        match control[0] {
            0 => return Err(ReadError::Truncated { wanted: count.into(), there: count - left }),
            1..=127 => out.extend(std::iter::repeat_n(bytes[0], n)),
            _ => out.extend_from_slice(&bytes[..n]),
        }
        left -= n as u64;
        if out.len() >= 1 << 16 || left == 0 {
            take(&out)?;
            out.clear();
            progress.advance(0)?;
        }
    }
    Ok(())
}
