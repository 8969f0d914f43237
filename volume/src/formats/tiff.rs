//! TIFF and BigTIFF: a page for each slice, unpacked side by side; also ImageJ's one page with all slices behind it.
//!
//! Spacing is in ImageJ's description (<https://imagej.net/formats/tiff>) or OME's; a resolution alone says nothing of the slices.

mod about;
mod directory;
pub mod write;

use super::decode::{Encoding, SampleType};
use super::entry::Entry;
use super::packing::{MOST_EXPANSION, Packing};
use super::part::{Part, open_file};
use super::{Format, Hints, ReadError, Scan, Storage, Writer};
use crate::Progress;
use about::About;
use directory::{Directories, Directory};
use glam::DVec3;
use half::f16;
use std::io::{self, BufReader, Read, Seek};
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
        tiff::TiffError::UnsupportedError(e) => ReadError::Unsupported(format!(
            "its pages are kept in a way that is not read ({e}); save it anew, uncompressed and in grey values"
        )),
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
    /// Numbers of a pixel: 1, or more where grey was saved as colour.
    channels: usize,
}

impl Page {
    /// Its bytes as it is unpacked, all channels.
    fn packed_bytes(&self) -> u64 {
        self.bytes().saturating_mul(self.channels as u64)
    }

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
            SampleType::F16 | SampleType::F32 | SampleType::F64 => Some(1.0),
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
    let planes = decoder.find_tag_unsigned::<u16>(Tag::PlanarConfiguration).map_err(damaged)?;
    let is_interleaved = planes.is_none_or(|planes| planes == 1);
    let format = decoder.find_tag_unsigned_vec::<u16>(Tag::SampleFormat).map_err(damaged)?;
    let format = format.and_then(|f| f.first().copied()).unwrap_or(1);
    let channels = color.num_samples().into();
    // Colours are compared once they are unpacked: of grey, all three are the same.
    let bits = match color {
        ColorType::Gray(bits) => bits,
        ColorType::GrayA(bits @ (8 | 16)) | ColorType::RGB(bits @ (8 | 16)) | ColorType::RGBA(bits @ (8 | 16)) if is_interleaved => bits,
        _ => 0,
    };
    let sample = match (bits, format) {
        (8, 1 | 4) => SampleType::U8,
        (8, 2) => SampleType::I8,
        (16, 1 | 4) => SampleType::U16,
        (16, 2) => SampleType::I16,
        (16, 3) => SampleType::F16,
        (32, 1 | 4) => SampleType::U32,
        (32, 2) => SampleType::I32,
        (32, 3) => SampleType::F32,
        (64, 1 | 4) => SampleType::U64,
        (64, 2) => SampleType::I64,
        (64, 3) => SampleType::F64,
        _ => {
            let text = format!("its pixels are {color:?} of sample format {format}; only grey values of 8, 16, 32 or 64 bits can be read");
            return Err(ReadError::Unsupported(text));
        }
    };
    let photometric = decoder.find_tag_unsigned::<u16>(Tag::PhotometricInterpretation).map_err(damaged)?;
    let white_is_zero = photometric == Some(PhotometricInterpretation::WhiteIsZero.to_u16());
    Ok(Page { dims: [width as usize, height as usize], sample, white_is_zero, channels })
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
        DecodingResult::F16(s) => bytes(s, f16::to_le_bytes),
        DecodingResult::F32(s) => bytes(s, f32::to_le_bytes),
        DecodingResult::F64(s) => bytes(s, f64::to_le_bytes),
    })
}

/// The page of a file that is one slice of many: the one that most are like, of as many the largest, as a preview is not.
fn slice_of(entry: &Entry, progress: &Progress) -> Result<(Decoder<impl Read + Seek>, Pages), ReadError> {
    let mut source = entry.seekable(progress)?;
    let directories = Directories::of(&mut source)?;
    let pages = Pages::of(&directories, &mut source, progress)?;
    source.rewind()?;
    Ok((Decoder::new(directories.at(&pages.first, source, None)).map_err(damaged)?, pages))
}

/// What the page of a file that is one slice of many says.
pub struct Slice {
    /// What it holds.
    pub page: Page,
    /// Bytes that one of its bytes unpacks to, at most.
    pub most_expansion: u64,
    /// How many pages of the file are like it.
    pub pages: usize,
    /// Sample spacing in mm, where it states one.
    pub spacing_mm: Option<DVec3>,
}

/// Looks at a file that is one slice of many.
pub fn slice(entry: &Entry, progress: &Progress) -> Result<Slice, ReadError> {
    let (mut decoder, pages) = slice_of(entry, progress)?;
    let about = About::of(&pages.description, &mut decoder)?;
    let count = pages.like.len().max(about.images.unwrap_or(1));
    Ok(Slice { page: pages.page, most_expansion: most_expansion(&mut decoder)?, pages: count, spacing_mm: about.spacing_mm })
}

/// Unpacks a file that is one slice of many.
pub fn read_slice(entry: &Entry, progress: &Progress) -> Result<Vec<u8>, ReadError> {
    let (decoder, pages) = slice_of(entry, progress)?;
    pages.unpack(decoder)
}

/// The pages of a file that are slices.
struct Pages {
    /// The first of them.
    first: Directory,
    /// What each holds.
    page: Page,
    /// All of them.
    like: Vec<Directory>,
    /// Grey values of a palette.
    palette: Option<Vec<u8>>,
    description: String,
}

impl Pages {
    fn of<R: Read + Seek>(directories: &Directories, source: &mut R, progress: &Progress) -> Result<Self, ReadError> {
        let mut kinds: Vec<(Page, Vec<Directory>)> = vec![];
        let mut why = None;
        for directory in &directories.pages {
            progress.advance(0)?;
            source.rewind()?;
            let read = Decoder::new(directories.at(directory, &mut *source, None)).map_err(damaged).and_then(|mut d| page(&mut d));
            match read {
                Ok(page) => match kinds.iter().position(|(kind, _)| *kind == page) {
                    Some(n) => kinds[n].1.push(*directory),
                    // What is like none of the first kinds is no slice.
                    None if kinds.len() < MOST_KINDS => kinds.push((page, vec![*directory])),
                    None => {}
                },
                Err(error) => why = why.or(Some(error)),
            }
        }
        let Some((page, like)) = kinds.into_iter().rev().max_by_key(|(page, like)| (like.len(), page.bytes())) else {
            return Err(why.unwrap_or(ReadError::NoImages));
        };
        let first = like[0];
        let palette = first.palette(source, directories.big_endian)?;
        // A preview may stand first, and the description with it.
        let own = first.description(source)?;
        let description = if own.is_empty() { directories.pages[0].description(source)? } else { own };
        Ok(Self { first, page, like, palette, description })
    }

    /// Unpacks one of them: little-endian samples.
    fn unpack<R: Read + Seek>(&self, decoder: Decoder<R>) -> Result<Vec<u8>, ReadError> {
        let page = &self.page;
        let bytes = unpack(&mut decoder.with_limits(limits(page.packed_bytes())))?;
        if let Some(palette) = &self.palette {
            return Ok(bytes.into_iter().map(|n| palette[usize::from(n)]).collect());
        }
        let (channels, n) = (page.channels, page.sample.bytes());
        if channels == 1 {
            return Ok(bytes);
        }
        let pixels = || bytes.chunks_exact(channels * n);
        if channels > 2 && pixels().any(|p| p[..n] != p[n..2 * n] || p[..n] != p[2 * n..3 * n]) {
            return Err(ReadError::Unsupported("it has colours; only grey values can be read".into()));
        }
        Ok(pixels().flat_map(|p| &p[..n]).copied().collect())
    }
}

/// Kinds of pages that slices are found among.
const MOST_KINDS: usize = 64;

fn scan(path: &Path, hints: &Hints, progress: &Progress) -> Result<Scan, ReadError> {
    let (file, there) = open_file(path)?;
    let mut file = BufReader::new(file);
    let directories = Directories::of(&mut file)?;
    let pages = Pages::of(&directories, &mut file, progress)?;
    let first = pages.page;
    file.rewind()?;
    let mut decoder = Decoder::new(directories.at(&pages.first, file, None)).map_err(damaged)?;
    let about = About::of(&pages.description, &mut decoder)?;
    let is_plain = directories.pages.len() == 1 && first.channels == 1 && pages.palette.is_none();
    let contiguous = if is_plain { contiguous(&mut decoder, &about, first, there)? } else { None };
    let page_bytes = first.bytes();
    let mut warnings = vec![];
    let (found, all) = (pages.like.len(), directories.pages.len());
    if found < all {
        warnings.push(format!("{} of {all} pages are not like the others and are left out", all - found));
    }
    if found == 1 && contiguous.is_none() && super::pictures::names::is_one_of_many(path, progress)? {
        let text = "it is one picture of a stack; name its folder to read the pictures there as slices";
        return Err(ReadError::Unsupported(text.into()));
    }
    let slices = contiguous.map_or(found, |(_, slices)| slices);
    super::packing::check_expansion_to(u128::from(first.packed_bytes()) * slices as u128, there, most_expansion(&mut decoder)?)?;
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
    let big_endian = contiguous.is_some() && directories.big_endian;
    let encoding = Encoding { sample: first.sample, big_endian };
    let storage = match contiguous {
        Some((start, slices)) => {
            let wanted = u128::from(page_bytes) * slices as u128;
            Storage::Parts(vec![Part::checked(path, Packing::Plain, start, 0, wanted, there)?])
        }
        None => {
            let path = path.to_owned();
            Storage::Slices(Box::new(move |k, _, progress| {
                let file = BufReader::new(open_file(&path)?.0);
                pages.unpack(Decoder::new(directories.at(&pages.like[k], file, Some(progress))).map_err(damaged)?)
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
