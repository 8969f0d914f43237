//! VTK's image data, `.vti`: samples as text, base64 or appended bytes, raw or packed by zlib in blocks that are unpacked side by side.
//!
//! The form of the data is that of vtkXMLDataParser; VTK does not say what its axes are in the patient.

use super::decode::{Encoding, SampleType};
use super::packing::{check_expansion, counted};
use super::part::{open_file, pass, read_all};
use super::{Format, Hints, NO_DIRECTIONS, NO_SPACING, ReadError, Scan, Sink, Storage, bad, text};
use crate::{Grid, Progress};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use base64::read::DecoderReader;
use flate2::read::ZlibDecoder;
use glam::{DMat3, DVec3};
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use rayon::prelude::*;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// The row of the formats.
pub const FORMAT: Format = Format { name: "VTI", sniff, scan, write: None };

fn sniff(path: &Path, head: &[u8], _progress: &Progress) -> bool {
    let named = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("vti"));
    let text = String::from_utf8_lossy(&head[..head.len().min(1024)]);
    !head.is_empty() && (named || (text.contains("<VTKFile") && text.contains("ImageData")))
}

/// How the data is written.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Form {
    Text,
    Base64,
    Raw,
}

/// Where the data is.
#[derive(Clone, Debug)]
struct Data {
    file: PathBuf,
    start: u64,
    form: Form,
    packed: bool,
    /// Bytes of the numbers in front of the data.
    word: usize,
    encoding: Encoding,
    bytes: u64,
    /// Bytes of the file from `start` on.
    left: u64,
}

fn damaged(error: &dyn std::fmt::Display) -> ReadError {
    ReadError::Damaged(format!("as XML, {error}"))
}

fn attribute(element: &BytesStart<'_>, name: &str) -> Option<String> {
    Some(String::from_utf8_lossy(&element.try_get_attribute(name).ok()??.value).into_owned())
}

fn numbers<T: FromStr, const N: usize>(element: &BytesStart<'_>, name: &str) -> Result<Option<[T; N]>, ReadError> {
    let Some(text) = attribute(element, name) else { return Ok(None) };
    let numbers: Option<Vec<T>> = text.split_whitespace().map(|n| n.parse().ok()).collect();
    let numbers = numbers.and_then(|n| n.try_into().ok());
    numbers.map(Some).ok_or_else(|| bad(name, text, &format!("it must be {N} numbers")))
}

/// In one piece, though long: each arm of the loop is an element of the format, and what one says decides how the next is read.
fn scan(path: &Path, hints: &Hints, progress: &Progress) -> Result<Scan, ReadError> {
    let (file, there) = open_file(path)?;
    let mut reader = Reader::from_reader(BufReader::new(file));
    let (mut big_endian, mut word, mut packed) = (false, 4, false);
    let mut grid = None;
    let (mut wanted_name, mut array) = (None, None);
    // Whether the numbers at hand are those of cells, and whether any are.
    let (mut in_cells, mut has_cells) = (false, false);
    let mut pieces = 0;
    let mut buffer = vec![];
    let (encoding, form, start) = loop {
        progress.advance(0)?;
        buffer.clear();
        let event = reader.read_event_into(&mut buffer).map_err(|e| damaged(&e))?;
        let at = reader.buffer_position();
        let element = match &event {
            Event::Start(element) | Event::Empty(element) => element,
            Event::End(end) => {
                in_cells &= end.name().as_ref() != b"CellData";
                continue;
            }
            Event::Eof => return Err(nothing(has_cells)),
            _ => continue,
        };
        match element.name().as_ref() {
            b"VTKFile" => {
                big_endian = attribute(element, "byte_order").as_deref() == Some("BigEndian");
                word = if attribute(element, "header_type").as_deref() == Some("UInt64") { 8 } else { 4 };
                packed = match attribute(element, "compressor").as_deref() {
                    None => false,
                    Some("vtkZLibDataCompressor") => true,
                    Some(other) => {
                        let text = format!("its samples are packed by {other}; only vtkZLibDataCompressor is read");
                        return Err(ReadError::Unsupported(text));
                    }
                };
            }
            b"ImageData" => grid = Some(image_grid(element, hints)?),
            b"Piece" => {
                pieces += 1;
                let whole = grid.as_ref().map(|(grid, _)| Grid::dims(grid));
                if pieces > 1 || numbers::<i64, 6>(element, "Extent")?.is_some_and(|e| dims(e).ok() != whole) {
                    return Err(ReadError::Unsupported("it is written in several pieces; write it as one".into()));
                }
            }
            b"PointData" => wanted_name = attribute(element, "Scalars"),
            b"CellData" => in_cells = matches!(event, Event::Start(_)),
            b"DataArray" if in_cells => has_cells = true,
            b"DataArray" if array.is_none() => {
                if pieces == 0 || wanted_name.is_some() && attribute(element, "Name") != wanted_name {
                    continue;
                }
                if let Some(n) = attribute(element, "NumberOfComponents").filter(|n| n != "1") {
                    return Err(ReadError::Unsupported(format!("its samples have {n} parts; only one number a sample can be read")));
                }
                let encoding = Encoding { sample: sample_type(element)?, big_endian };
                match attribute(element, "format").as_deref() {
                    Some("ascii") => break (Encoding { big_endian: false, ..encoding }, Form::Text, at),
                    Some("appended") => {
                        let offset = numbers::<u64, 1>(element, "offset")?.ok_or(ReadError::MissingField("offset"))?;
                        array = Some((encoding, offset[0]));
                    }
                    _ => break (encoding, Form::Base64, at),
                }
            }
            b"AppendedData" => {
                let (encoding, offset) = array.ok_or_else(|| nothing(has_cells))?;
                let form = if attribute(element, "encoding").as_deref() == Some("base64") { Form::Base64 } else { Form::Raw };
                let mut file = reader.into_inner();
                // Offsets count from behind the underscore that follows.
                file.seek(SeekFrom::Start(at))?;
                let mut gap = vec![];
                file.take(256).read_until(b'_', &mut gap)?;
                let start = (at + gap.len() as u64).checked_add(offset).filter(|s| *s < there);
                break (encoding, form, start.ok_or(ReadError::Damaged("its appended data begins behind its end".into()))?);
            }
            _ => {}
        }
    };
    let (grid, spacing_is_stated) = grid.ok_or(ReadError::MissingField("ImageData"))?;
    let wanted = grid.len() as u128 * encoding.sample.bytes() as u128;
    let left = there.saturating_sub(start);
    match (packed, form) {
        (true, _) => check_expansion(wanted, left)?,
        // A number as text takes two bytes at least, and eight bytes as base64 are more than ten.
        (false, Form::Text) if grid.len() as u128 * 2 > u128::from(left) + 1 => {
            return Err(ReadError::Truncated { wanted, there: left });
        }
        (false, Form::Base64 | Form::Raw) if wanted > u128::from(left) => return Err(ReadError::Truncated { wanted, there: left }),
        _ => {}
    }
    let data = Data { file: path.to_owned(), start, form, packed, word, encoding, bytes: wanted as u64, left };
    let storage = Storage::Stream(Box::new(move |progress, take| data.stream(progress, take).map(|()| vec![])));
    let warnings = (!spacing_is_stated).then_some(NO_SPACING).into_iter().chain([NO_DIRECTIONS]).map(str::to_owned).collect();
    Ok(Scan { spacing_is_stated, warnings, ..Scan::new(grid, encoding, there, storage) })
}

/// Samples along each axis of an extent of first and last indices.
fn dims(extent: [i64; 6]) -> Result<[usize; 3], ReadError> {
    let size = |first: i64, last: i64| last.checked_sub(first)?.checked_add(1).and_then(|n| usize::try_from(n).ok());
    let [a, b, c] = [0, 2, 4].map(|n| size(extent[n], extent[n + 1]));
    a.zip(b).zip(c).map(|((a, b), c)| [a, b, c]).ok_or_else(|| bad("WholeExtent", format!("{extent:?}"), "it is no range of indices"))
}

/// Why there is nothing to read.
fn nothing(has_cells: bool) -> ReadError {
    match has_cells {
        true => ReadError::Unsupported(
            "its numbers are those of cells, not of points; turn them with ParaView's Cell Data to Point Data".into(),
        ),
        false => ReadError::NoHeader("it holds no array of numbers at its points"),
    }
}

/// The grid, and whether its spacing is known.
fn image_grid(element: &BytesStart<'_>, hints: &Hints) -> Result<(Grid, bool), ReadError> {
    let extent = numbers::<i64, 6>(element, "WholeExtent")?.ok_or(ReadError::MissingField("WholeExtent"))?;
    let stated_mm = numbers::<f64, 3>(element, "Spacing")?.map(DVec3::from).or(hints.spacing_mm);
    let spacing_mm = stated_mm.unwrap_or(DVec3::ONE);
    // Rows of a matrix whose columns are the directions of the axes.
    let direction =
        DMat3::from_cols_array(&numbers::<f64, 9>(element, "Direction")?.unwrap_or(DMat3::IDENTITY.to_cols_array())).transpose();
    let first = DVec3::new(extent[0] as f64, extent[2] as f64, extent[4] as f64);
    let origin_mm = DVec3::from(numbers::<f64, 3>(element, "Origin")?.unwrap_or_default()) + direction * (spacing_mm * first);
    Ok((Grid::new(dims(extent)?, spacing_mm, origin_mm, direction)?, stated_mm.is_some()))
}

fn sample_type(element: &BytesStart<'_>) -> Result<SampleType, ReadError> {
    let name = attribute(element, "type").ok_or(ReadError::MissingField("type"))?;
    Ok(match name.as_str() {
        "Int8" => SampleType::I8,
        "UInt8" => SampleType::U8,
        "Int16" => SampleType::I16,
        "UInt16" => SampleType::U16,
        "Int32" => SampleType::I32,
        "UInt32" => SampleType::U32,
        "Int64" => SampleType::I64,
        "UInt64" => SampleType::U64,
        "Float32" => SampleType::F32,
        "Float64" => SampleType::F64,
        _ => return Err(bad("type", name, "it is none of VTK's numbers")),
    })
}

/// Text without the white space in it, up to the next element.
struct Letters<R>(R);

impl<R: BufRead> Read for Letters<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            let text = self.0.fill_buf()?;
            if text.is_empty() || text[0] == b'<' {
                return Ok(0);
            }
            let (mut used, mut n) = (0, 0);
            while used < text.len() && n < buffer.len() && text[used] != b'<' {
                if !text[used].is_ascii_whitespace() {
                    buffer[n] = text[used];
                    n += 1;
                }
                used += 1;
            }
            self.0.consume(used);
            if n > 0 || buffer.is_empty() {
                return Ok(n);
            }
        }
    }
}

impl Data {
    fn open<'a>(&self, progress: &'a Progress) -> Result<impl BufRead + 'a, ReadError> {
        let mut file = open_file(&self.file)?.0;
        file.seek(SeekFrom::Start(self.start))?;
        Ok(counted(file, progress))
    }

    fn stream(&self, progress: &Progress, take: &mut Sink<'_>) -> Result<(), ReadError> {
        let source = self.open(progress)?;
        match (self.form, self.packed) {
            (Form::Text, _) => {
                let sample = self.encoding.sample;
                text::numbers(source, sample, self.bytes / sample.bytes() as u64, "DataArray", progress, take)
            }
            (Form::Raw, false) => self.plain(source, progress, take),
            (Form::Base64, false) => self.plain(DecoderReader::new(Letters(source), &STANDARD), progress, take),
            (Form::Raw, true) => self.blocks(source, progress, take),
            (Form::Base64, true) => {
                // The numbers in front are a base64 text of their own.
                let mut letters = Letters(source);
                let head = |letters: &mut Letters<_>, bytes: usize| -> Result<Vec<u8>, ReadError> {
                    let mut text = vec![0; bytes.div_ceil(3) * 4];
                    let n = read_all(letters, &mut text)?;
                    STANDARD.decode(&text[..n]).map_err(|e| ReadError::Damaged(format!("as base64, {e}")))
                };
                let first = head(&mut letters, self.word)?;
                let count = self.number(&first);
                let all = self.header_bytes(count)?;
                let mut letters = Letters(self.open(progress)?);
                let header = head(&mut letters, all)?;
                self.blocks(header.as_slice().chain(DecoderReader::new(letters, &STANDARD)), progress, take)
            }
        }
    }

    /// A number in front of the data.
    fn number(&self, bytes: &[u8]) -> u64 {
        let byte = |n: usize| u64::from(bytes.get(n).copied().unwrap_or(0));
        (0..self.word).fold(0, |value, n| if self.encoding.big_endian { value << 8 | byte(n) } else { value | byte(n) << (8 * n) })
    }

    /// Bytes of the numbers in front of `count` blocks.
    fn header_bytes(&self, count: u64) -> Result<usize, ReadError> {
        // They are in the file.
        let fits = usize::try_from(count).ok().filter(|_| count <= self.left / self.word as u64);
        fits.map(|n| (3 + n) * self.word).ok_or_else(|| ReadError::Damaged(format!("it claims {count} blocks")))
    }

    fn plain(&self, mut source: impl Read, progress: &Progress, take: &mut Sink<'_>) -> Result<(), ReadError> {
        let mut header = vec![0; self.word];
        read_all(&mut source, &mut header)?;
        let there = self.number(&header);
        if there < self.bytes {
            return Err(ReadError::Truncated { wanted: self.bytes.into(), there });
        }
        pass(&mut source, self.bytes, progress, take)
    }

    /// Blocks packed by zlib: their number, their size, the last one's size and what each is packed to come before them.
    fn blocks(&self, mut source: impl Read, progress: &Progress, take: &mut Sink<'_>) -> Result<(), ReadError> {
        let mut next = |bytes: usize| -> Result<Vec<u8>, ReadError> {
            let mut read = vec![];
            (&mut source).take(bytes as u64).read_to_end(&mut read)?;
            if read.len() < bytes { Err(ReadError::Damaged("its blocks break off".into())) } else { Ok(read) }
        };
        let count = self.number(&next(self.word)?);
        let header = next(self.header_bytes(count)? - self.word)?;
        let numbers: Vec<u64> = header.chunks(self.word).map(|b| self.number(b)).collect();
        let [size, last, packed @ ..] = numbers.as_slice() else { return Err(ReadError::Damaged("its blocks have no sizes".into())) };
        let bytes = |n: usize| if n + 1 == packed.len() && *last > 0 { *last } else { *size };
        let all: u128 = (0..packed.len()).map(|n| u128::from(bytes(n))).sum();
        if all != u128::from(self.bytes) || !size.is_multiple_of(self.encoding.sample.bytes() as u64) {
            let text = format!("its blocks hold {all} bytes, its samples are {}", self.bytes);
            return Err(ReadError::Contradiction(text));
        }
        let numbers: Vec<usize> = (0..packed.len()).collect();
        for batch in numbers.chunks(2 * rayon::current_num_threads()) {
            let read: Result<Vec<(usize, Vec<u8>)>, ReadError> = batch.iter().map(|&n| Ok((n, next(packed[n] as usize)?))).collect();
            let unpacked: Vec<Result<Vec<u8>, ReadError>> = read?
                .par_iter()
                .map(|(n, block)| {
                    check_expansion(bytes(*n).into(), block.len() as u64)?;
                    let mut out = vec![];
                    ZlibDecoder::new(block.as_slice()).take(bytes(*n)).read_to_end(&mut out)?;
                    let there = out.len() as u64;
                    if there < bytes(*n) { Err(ReadError::Truncated { wanted: bytes(*n).into(), there }) } else { Ok(out) }
                })
                .collect();
            for block in unpacked {
                take(&block?)?;
            }
            progress.advance(0)?;
        }
        Ok(())
    }
}
