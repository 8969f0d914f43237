//! TIFF and BigTIFF: a page for each slice, unpacked side by side; also ImageJ's one page with all slices behind it.
//!
//! Spacing is in ImageJ's description (<https://imagej.net/formats/tiff>) or OME's; a resolution alone says nothing of the slices.

pub mod write;

use super::decode::{Encoding, SampleType};
use super::entries::Entry;
use super::part::{MOST_EXPANSION, Packing, Part, open_file};
use super::{Format, Hints, NO_DIRECTIONS, NO_SPACING, ReadError, Scan, Storage, Writer};
use crate::{Grid, Metadata, Progress, Unit};
use glam::{DAffine3, DMat3, DVec3};
use std::collections::{HashMap, HashSet};
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::Path;
use tiff::ColorType;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::{CompressionMethod, PhotometricInterpretation, Tag};

/// The row of the formats.
pub const FORMAT: Format = Format { name: "TIFF", sniff, scan, write: Some(Writer { endings: &[".tif", ".tiff"], write: write::write }) };

fn sniff(path: &Path, head: &[u8], _progress: &Progress) -> bool {
    let named = path.extension().is_some_and(|e| ["tif", "tiff", "btf", "tf8"].iter().any(|n| e.eq_ignore_ascii_case(n)));
    !head.is_empty() && (named || is_tiff(head))
}

/// Whether a file begins as TIFF or BigTIFF does.
pub fn is_tiff(head: &[u8]) -> bool {
    [b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"].iter().any(|magic| head.starts_with(*magic))
}

fn damaged(error: tiff::TiffError) -> ReadError {
    match error {
        tiff::TiffError::IoError(e) if e.kind() == io::ErrorKind::UnexpectedEof => ReadError::Damaged("as TIFF, it breaks off".into()),
        tiff::TiffError::IoError(e) => e.into(),
        e => ReadError::Damaged(format!("as TIFF, {e}")),
    }
}

/// What a page holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Page {
    /// Samples along i and j.
    pub dims: [usize; 2],
    /// Their type.
    pub sample: SampleType,
    /// Low numbers are white.
    pub white_is_zero: bool,
}

impl Page {
    fn bytes(&self) -> u64 {
        self.dims.iter().map(|&n| n as u64).product::<u64>().saturating_mul(self.sample.bytes() as u64)
    }

    /// What the lowest number is turned into where low numbers are white, as the decoder does; `None` for types that it does not turn.
    fn white(&self) -> Option<f64> {
        match self.sample {
            SampleType::U8 => Some(u8::MAX.into()),
            SampleType::U16 => Some(u16::MAX.into()),
            SampleType::U32 => Some(u32::MAX.into()),
            SampleType::U64 => Some(u64::MAX as f64),
            SampleType::F32 | SampleType::F64 => Some(1.0),
            SampleType::I8 | SampleType::I16 | SampleType::I32 | SampleType::I64 => None,
        }
    }
}

/// The sentence about pages whose low numbers are white.
pub const WHITE_IS_ZERO: &str = "its low numbers are shown white; they are read as the high ones";

/// LZW's longest string has 3838 bytes and takes 12 bits, a ratio of 2559.
const MOST_LZW: u64 = 2600;

/// Bytes that a byte of the page that the decoder is at unpacks to, at most.
fn most_expansion<R: Read + Seek>(decoder: &mut Decoder<R>) -> Result<u64, ReadError> {
    let compression = decoder.find_tag_unsigned::<u16>(Tag::Compression).map_err(damaged)?;
    Ok(if compression == Some(CompressionMethod::LZW.to_u16()) { MOST_LZW } else { MOST_EXPANSION })
}

/// Looks at the page that the decoder is at. Grey pages of whole bytes only.
fn page<R: Read + Seek>(decoder: &mut Decoder<R>) -> Result<Page, ReadError> {
    let (width, height) = decoder.dimensions().map_err(damaged)?;
    let color = decoder.colortype().map_err(damaged)?;
    let format = decoder.find_tag_unsigned_vec::<u16>(Tag::SampleFormat).map_err(damaged)?;
    let format = format.and_then(|f| f.first().copied()).unwrap_or(1);
    let sample = match (color, format) {
        (ColorType::Gray(8), 1 | 4) => SampleType::U8,
        (ColorType::Gray(8), 2) => SampleType::I8,
        (ColorType::Gray(16), 1 | 4) => SampleType::U16,
        (ColorType::Gray(16), 2) => SampleType::I16,
        (ColorType::Gray(32), 1 | 4) => SampleType::U32,
        (ColorType::Gray(32), 2) => SampleType::I32,
        (ColorType::Gray(32), 3) => SampleType::F32,
        (ColorType::Gray(64), 1 | 4) => SampleType::U64,
        (ColorType::Gray(64), 2) => SampleType::I64,
        (ColorType::Gray(64), 3) => SampleType::F64,
        (color, format) => {
            let text = format!("its pixels are {color:?} of sample format {format}; only grey values of 8, 16, 32 or 64 bits can be read");
            return Err(ReadError::Unsupported(text));
        }
    };
    let photometric = decoder.find_tag_unsigned::<u16>(Tag::PhotometricInterpretation).map_err(damaged)?;
    let white_is_zero = photometric == Some(PhotometricInterpretation::WhiteIsZero.to_u16());
    Ok(Page { dims: [width as usize, height as usize], sample, white_is_zero })
}

/// Limits for pages of at most `bytes` bytes.
fn limits(bytes: u64) -> Limits {
    let mut limits = Limits::default();
    // One more than a page, since the decoder's own buffers are a little larger than what is asked for.
    let most = usize::try_from(bytes).unwrap_or(usize::MAX).saturating_add(1 << 16);
    (limits.decoding_buffer_size, limits.intermediate_buffer_size) = (most, most);
    limits
}

/// Unpacks the page that the decoder is at: little-endian samples.
fn unpack<R: Read + Seek>(decoder: &mut Decoder<R>) -> Result<Vec<u8>, ReadError> {
    fn bytes<T, const N: usize>(samples: Vec<T>, to_bytes: impl Fn(T) -> [u8; N]) -> Vec<u8> {
        samples.into_iter().flat_map(to_bytes).collect()
    }
    Ok(match decoder.read_image().map_err(damaged)? {
        DecodingResult::U8(s) => s,
        DecodingResult::I8(s) => bytes(s, i8::to_le_bytes),
        DecodingResult::U16(s) => bytes(s, u16::to_le_bytes),
        DecodingResult::I16(s) => bytes(s, i16::to_le_bytes),
        DecodingResult::U32(s) => bytes(s, u32::to_le_bytes),
        DecodingResult::I32(s) => bytes(s, i32::to_le_bytes),
        DecodingResult::U64(s) => bytes(s, u64::to_le_bytes),
        DecodingResult::I64(s) => bytes(s, i64::to_le_bytes),
        DecodingResult::F32(s) => bytes(s, f32::to_le_bytes),
        DecodingResult::F64(s) => bytes(s, f64::to_le_bytes),
        DecodingResult::F16(_) => return Err(ReadError::Unsupported("its samples are floats of 16 bits".into())),
    })
}

/// The places of all pages. Every directory is walked before the decoder sees it, as that reserves what a count asks for: no value may be
/// longer than the file.
fn directories<R: Read + Seek>(source: &mut R) -> Result<Vec<u64>, ReadError> {
    let broken = || ReadError::Damaged("as TIFF, a directory breaks off".into());
    let length = source.seek(SeekFrom::End(0))?;
    let mut read = |at: u64, n: usize| -> Result<Vec<u8>, ReadError> {
        // A directory has at most 65,536 entries, or in BigTIFF as many as the file has room for.
        let fits = at.checked_add(n as u64).is_some_and(|end| end <= length);
        let mut bytes = vec![0; if fits { n } else { return Err(broken()) }];
        source.seek(SeekFrom::Start(at))?;
        source.read_exact(&mut bytes)?;
        Ok(bytes)
    };
    let head = read(0, 8)?;
    let big_endian = head[0] == b'M';
    let number = |bytes: &[u8]| -> u64 {
        let add = |n: u64, b: &u8| n << 8 | u64::from(*b);
        if big_endian { bytes.iter().fold(0, add) } else { bytes.iter().rev().fold(0, add) }
    };
    let is_big = number(&head[2..4]) == 43;
    // Bytes of a count of entries, of an entry, and of an offset.
    let (count_bytes, entry_bytes, offset_bytes) = if is_big { (8, 20, 8) } else { (2, 12, 4) };
    let mut next = if is_big { number(&read(8, 8)?) } else { number(&head[4..8]) };
    let (mut found, mut seen, mut left) = (vec![], HashSet::new(), length);
    while next != 0 {
        if !seen.insert(next) {
            return Err(ReadError::Damaged("as TIFF, its pages lead in a circle".into()));
        }
        found.push(next);
        let count = number(&read(next, count_bytes)?);
        let all = usize::try_from(count).ok().and_then(|n| n.checked_mul(entry_bytes)?.checked_add(offset_bytes)).ok_or_else(broken)?;
        // Directories beside each other fit into the file together.
        left = left.checked_sub(all as u64).ok_or_else(|| ReadError::Damaged("as TIFF, its directories lie over each other".into()))?;
        let entries = read(next + count_bytes as u64, all)?;
        for entry in entries[..all - offset_bytes].chunks(entry_bytes) {
            let size = match number(&entry[2..4]) {
                3 | 8 => 2,
                4 | 9 | 11 | 13 => 4,
                5 | 10 | 12 | 16..=18 => 8,
                _ => 1,
            };
            if number(&entry[4..4 + offset_bytes]).checked_mul(size).is_none_or(|bytes| bytes > length) {
                return Err(ReadError::Damaged("as TIFF, a value is longer than the file".into()));
            }
        }
        next = number(&entries[all - offset_bytes..]);
    }
    if found.is_empty() { Err(ReadError::NoImages) } else { Ok(found) }
}

/// A decoder at the first page of a file that is one slice of many.
fn first_of(entry: &Entry, progress: &Progress) -> Result<Decoder<impl Read + Seek>, ReadError> {
    let mut source = entry.seekable(progress)?;
    directories(&mut source)?;
    source.rewind()?;
    Decoder::new(source).map_err(damaged)
}

/// Looks at the first page of a file that is one slice of many; also, bytes that one of its bytes unpacks to at most.
pub fn first_page(entry: &Entry, progress: &Progress) -> Result<(Page, u64), ReadError> {
    let mut decoder = first_of(entry, progress)?;
    Ok((page(&mut decoder)?, most_expansion(&mut decoder)?))
}

/// Unpacks the first page of a file that is one slice of many.
pub fn read_first_page(entry: &Entry, progress: &Progress) -> Result<Vec<u8>, ReadError> {
    let mut decoder = first_of(entry, progress)?;
    let bytes = page(&mut decoder)?.bytes();
    unpack(&mut decoder.with_limits(limits(bytes)))
}

/// A TIFF file whose header points at another page than its own does: each page is read by itself.
struct At<'a> {
    file: BufReader<File>,
    head: Vec<u8>,
    at: u64,
    progress: &'a Progress,
}

impl<'a> At<'a> {
    fn new(path: &Path, offset: u64, progress: &'a Progress) -> Result<Self, ReadError> {
        let mut file = BufReader::new(open_file(path)?.0);
        let mut head = vec![0; 16];
        file.read_exact(&mut head)?;
        let (is_big, is_little) = (head[2] == b'+' || head[3] == b'+', head[0] == b'I');
        let (place, mut pointer) = if is_big { (8, offset.to_le_bytes().to_vec()) } else { (4, (offset as u32).to_le_bytes().to_vec()) };
        if !is_little {
            pointer.reverse();
        }
        head[place..place + pointer.len()].copy_from_slice(&pointer);
        head.truncate(place + pointer.len());
        file.rewind()?;
        Ok(Self { file, head, at: 0, progress })
    }
}

impl Read for At<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = match self.head.get(self.at as usize..).filter(|rest| !rest.is_empty()) {
            Some(mut rest) => {
                let n = rest.read(buffer)?;
                self.file.seek_relative(n as i64)?;
                n
            }
            None => self.file.read(buffer)?,
        };
        self.at += n as u64;
        self.progress.advance(n as u64).map_err(io::Error::other)?;
        Ok(n)
    }
}

impl Seek for At<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.at = self.file.seek(to)?;
        Ok(self.at)
    }
}

fn scan(path: &Path, hints: &Hints, progress: &Progress) -> Result<Scan, ReadError> {
    let (mut file, there) = open_file(path)?;
    let directories = directories(&mut file)?;
    let open = |offset, progress| Decoder::new(At::new(path, offset, progress)?).map_err(damaged);
    let unseen = Progress::default();
    let mut decoder = open(directories[0], &unseen)?;
    let first = page(&mut decoder)?;
    let description = decoder.find_tag(Tag::ImageDescription).map_err(damaged)?;
    let about = About::of(&description.and_then(|d| d.into_string().ok()).unwrap_or_default(), &mut decoder)?;
    let contiguous = if directories.len() == 1 { contiguous(&mut decoder, &about, first, there)? } else { None };
    let page_bytes = first.bytes();
    let mut warnings = vec![];
    let mut pages = vec![];
    for &offset in &directories {
        progress.advance(0)?;
        // A page that is not like the first, such as a thumbnail, is no slice.
        if open(offset, &unseen).and_then(|mut d| page(&mut d)).is_ok_and(|p| p == first) {
            pages.push(offset);
        }
    }
    if pages.len() < directories.len() {
        let (others, all) = (directories.len() - pages.len(), directories.len());
        warnings.push(format!("{others} of {all} pages are not like the first and are left out"));
    }
    let slices = contiguous.map_or(pages.len(), |(_, slices)| slices);
    super::part::check_expansion_to(u128::from(page_bytes) * slices as u128, there, most_expansion(&mut decoder)?)?;
    let (mut slope, mut intercept) = about.scale;
    if first.white_is_zero {
        warnings.push(WHITE_IS_ZERO.into());
        // The decoder turns pages round; what lies behind a page is turned by its scale.
        if contiguous.is_some() {
            let white = first.white().ok_or_else(|| {
                ReadError::Unsupported("its low numbers are shown white, but have signs; save it with black as low".into())
            })?;
            (slope, intercept) = (-slope, intercept + slope * white);
        }
    }
    let [nx, ny] = first.dims;
    let (grid, spacing_is_stated) = about.grid([nx, ny, slices], hints, &mut warnings)?;
    let big_endian = contiguous.is_some() && decoder.byte_order() == tiff::tags::ByteOrder::BigEndian;
    let encoding = Encoding { sample: first.sample, big_endian };
    let storage = match contiguous {
        Some((start, slices)) => {
            let wanted = u128::from(page_bytes) * slices as u128;
            Storage::parts(vec![Part::checked(path, Packing::Plain, start, 0, wanted, there)?])
        }
        None => {
            let path = path.to_owned();
            Storage::Slices(Box::new(move |k, _, progress| {
                let decoder = Decoder::new(At::new(&path, pages[k], progress)?).map_err(damaged)?;
                unpack(&mut decoder.with_limits(limits(page_bytes)))
            }))
        }
    };
    let scan = Scan::new(grid, encoding, there, storage);
    Ok(Scan { slope, intercept, unit: about.unit, spacing_is_stated, warnings, metadata: about.rest, ..scan })
}

/// First byte and number of the slices that ImageJ wrote behind one page, as it does beyond 4 GiB.
fn contiguous<R: Read + Seek>(decoder: &mut Decoder<R>, about: &About, page: Page, there: u64) -> Result<Option<(u64, usize)>, ReadError> {
    let is_plain = matches!(decoder.find_tag_unsigned::<u16>(Tag::Compression).map_err(damaged)?, None | Some(1));
    let Some(images) = about.images.filter(|&n| n > 1 && is_plain) else { return Ok(None) };
    let offsets = decoder.find_tag_unsigned_vec::<u64>(Tag::StripOffsets).map_err(damaged)?;
    let Some(start) = offsets.and_then(|o| o.first().copied()) else { return Ok(None) };
    let bytes = page.dims.iter().map(|&n| n as u128).product::<u128>() * page.sample.bytes() as u128 * images as u128;
    let there = there.saturating_sub(start);
    if bytes > u128::from(there) {
        return Err(ReadError::Truncated { wanted: bytes, there });
    }
    Ok(Some((start, images)))
}

/// What a description says beside the page.
#[derive(Default)]
struct About {
    spacing_mm: Option<DVec3>,
    to_world: Option<DAffine3>,
    images: Option<usize>,
    scale: (f64, f64),
    unit: Option<Unit>,
    rest: Metadata,
}

/// The line by which a file of this program keeps its whole geometry: 12 numbers, columns of index to LPS mm.
const TO_WORLD: &str = "index_to_lps_mm";
/// The lines of ImageJ that are about the page itself.
const IMAGEJ: [&str; 17] = [
    "ImageJ",
    "images",
    "slices",
    "channels",
    "frames",
    "hyperstack",
    "mode",
    "unit",
    "spacing",
    "loop",
    "min",
    "max",
    "c0",
    "c1",
    "cf",
    "vunit",
    "finterval",
];

impl About {
    fn of<R: Read + Seek>(description: &str, decoder: &mut Decoder<R>) -> Result<Self, ReadError> {
        let mut about = Self { scale: (1.0, 0.0), ..Self::default() };
        if description.contains("<OME") {
            for many in ["SizeC", "SizeT"] {
                let stated = description.split_once(&format!("{many}=\"")).and_then(|(_, rest)| rest.split('"').next());
                one_scan(many, stated.and_then(|n| n.trim().parse().ok()))?;
            }
            about.spacing_mm = ome_spacing_mm(description);
            return Ok(about);
        }
        if !description.starts_with("ImageJ=") {
            return Ok(about);
        }
        let fields: HashMap<&str, &str> = description.lines().filter_map(|l| l.split_once('=')).collect();
        let number = |name: &str| fields.get(name).and_then(|v| v.trim().parse::<f64>().ok()).filter(|v| v.is_finite());
        for many in ["channels", "frames"] {
            one_scan(many, number(many))?;
        }
        let mut per_unit = |tag| {
            let value = decoder.find_tag(tag).ok().flatten()?;
            let value = match value {
                tiff::decoder::ifd::Value::Rational(n, d) => f64::from(n) / f64::from(d),
                value => value.into_f64().ok()?,
            };
            (value.is_finite() && value > 0.0).then_some(value)
        };
        let unit_mm = fields.get("unit").and_then(|u| unit_mm(u.trim()));
        if let (Some(mm), Some(x), Some(y), Some(z)) = (unit_mm, per_unit(Tag::XResolution), per_unit(Tag::YResolution), number("spacing"))
        {
            about.spacing_mm = Some(DVec3::new(1.0 / x, 1.0 / y, z.abs()) * mm);
        }
        // A straight line of calibration: value = c0 + c1·sample.
        if let (Some(c0), Some(c1), None | Some(0.0)) = (number("c0"), number("c1"), number("cf")) {
            about.scale = (c1, c0);
        }
        about.unit = match fields.get("vunit").map(|u| u.trim()) {
            Some("HU") => Some(Unit::Hounsfield),
            Some("value") => Some(Unit::Value),
            _ => None,
        };
        about.images = number("images").filter(|n| *n >= 1.0 && *n < 1e9).map(|n| n as usize);
        let numbers = fields.get(TO_WORLD).map(|t| t.split_whitespace().filter_map(|n| n.parse().ok()).collect::<Vec<f64>>());
        about.to_world = numbers.and_then(|n| n.try_into().ok()).map(|n: [f64; 12]| DAffine3::from_cols_array(&n));
        let own = |key: &str| IMAGEJ.contains(&key) || key == TO_WORLD;
        about.rest = fields.iter().filter(|(k, _)| !own(k)).map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
        Ok(about)
    }

    /// The grid, and whether its spacing is known.
    fn grid(&self, dims: [usize; 3], hints: &Hints, warnings: &mut Vec<String>) -> Result<(Grid, bool), ReadError> {
        if let Some(map) = self.to_world {
            return Ok((Grid::from_affine(dims, map)?, true));
        }
        let spacing_mm = self.spacing_mm.or(hints.spacing_mm);
        if spacing_mm.is_none() {
            warnings.push(NO_SPACING.into());
        }
        warnings.push(NO_DIRECTIONS.into());
        let grid = Grid::new(dims, spacing_mm.unwrap_or(DVec3::ONE), DVec3::ZERO, DMat3::IDENTITY)?;
        Ok((grid, spacing_mm.is_some()))
    }
}

/// Refuses what interleaves several scans in one stack of pages.
fn one_scan(what: &str, count: Option<f64>) -> Result<(), ReadError> {
    match count {
        Some(n) if n > 1.0 => {
            Err(ReadError::Unsupported(format!("it holds several scans in one stack ({what} {n}); split it, and open one")))
        }
        _ => Ok(()),
    }
}

/// Millimetres in a unit of length as ImageJ and OME write it.
fn unit_mm(unit: &str) -> Option<f64> {
    Some(match unit {
        "mm" | "millimeter" | "millimetre" => 1.0,
        "um" | "micron" | "microns" | "micrometer" | "µm" | "μm" | "\\u00B5m" => 1e-3,
        "nm" | "nanometer" => 1e-6,
        "cm" => 10.0,
        "m" | "meter" => 1e3,
        "inch" | "in" => 25.4,
        _ => return None,
    })
}

/// `PhysicalSizeX` and its like in the first `Pixels` of OME's XML; micrometres unless they say otherwise.
fn ome_spacing_mm(xml: &str) -> Option<DVec3> {
    let mut reader = quick_xml::Reader::from_str(xml);
    loop {
        let element = match reader.read_event().ok()? {
            quick_xml::events::Event::Eof => return None,
            quick_xml::events::Event::Start(e) | quick_xml::events::Event::Empty(e) => e,
            _ => continue,
        };
        if element.local_name().as_ref() != b"Pixels" {
            continue;
        }
        let text = |name: &str| Some(String::from_utf8_lossy(&element.try_get_attribute(name).ok()??.value).into_owned());
        let mm = |axis: &str| {
            let size: f64 = text(&format!("PhysicalSize{axis}"))?.parse().ok()?;
            let unit = text(&format!("PhysicalSize{axis}Unit")).map_or(Some(1e-3), |u| unit_mm(&u))?;
            (size.is_finite() && size > 0.0).then_some(size * unit)
        };
        return Some(DVec3::new(mm("X")?, mm("Y")?, mm("Z")?));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    #[test]
    fn directories_that_lie_over_each_other_are_refused() {
        // Fails if a file of some megabytes can ask for its directories to be read as often as it has bytes. The second begins in a value
        // of the first, and both together are longer than the file.
        let mut file = vec![0_u8; 600_000];
        file[..8].copy_from_slice(b"II*\0\x08\0\0\0");
        file[8..10].copy_from_slice(&40_000_u16.to_le_bytes());
        file[102..104].copy_from_slice(&30_000_u16.to_le_bytes());
        file[480_010..480_014].copy_from_slice(&102_u32.to_le_bytes());
        let error = directories(&mut Cursor::new(&file)).unwrap_err().to_string();
        assert!(error.contains("lie over each other"), "{error}");
        // One alone is fine.
        file[480_010..480_014].fill(0);
        assert_eq!(directories(&mut Cursor::new(&file)).unwrap(), [8]);
    }
}
