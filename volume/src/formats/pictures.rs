//! A folder or an archive of pictures, one for each slice, in the order of the numbers in their names: TIFF, PNG, BMP, JPEG or
//! JPEG 2000.

mod beside;
pub mod names;

use super::decode::{Encoding, SampleType};
use super::dicom::blend;
use super::entries::in_folder;
use super::entry::Entry;
use super::packing::{MOST_BLANK, MOST_EXPANSION, check_expansion_to};
use super::part::in_file;
use super::stack::Mix;
use super::{Format, Hints, NO_DIRECTIONS, NO_SPACING, ReadError, Scan, Storage, Uneven, archive, jpeg_2000, tiff};
use crate::{Grid, Progress};
use glam::{DMat3, DVec3};
use image::{ColorType, DynamicImage, ImageDecoder, ImageFormat, ImageReader};
use rayon::prelude::*;
use std::io::Cursor;
use std::path::Path;

/// The row of the formats.
pub const FORMAT: Format = Format { name: "pictures (a folder or zip of TIFF, PNG, BMP, JPEG or JPEG 2000)", sniff, scan, write: None };

/// How a picture is packed.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Tiff,
    Jpeg2000,
    Other(ImageFormat),
}

const KINDS: [(&str, Kind); 11] = [
    ("tif", Kind::Tiff),
    ("tiff", Kind::Tiff),
    ("png", Kind::Other(ImageFormat::Png)),
    ("bmp", Kind::Other(ImageFormat::Bmp)),
    ("jpg", Kind::Other(ImageFormat::Jpeg)),
    ("jpeg", Kind::Other(ImageFormat::Jpeg)),
    ("jpe", Kind::Other(ImageFormat::Jpeg)),
    ("jp2", Kind::Jpeg2000),
    ("j2k", Kind::Jpeg2000),
    ("j2c", Kind::Jpeg2000),
    ("jpx", Kind::Jpeg2000),
];

fn kind(name: &str) -> Option<Kind> {
    let ext = Path::new(name).extension()?.to_str()?;
    KINDS.iter().find(|(e, _)| ext.eq_ignore_ascii_case(e)).map(|(_, kind)| *kind)
}

/// Whether a file is a picture, by its name.
pub fn is_picture(entry: &Entry) -> bool {
    kind(&entry.name).is_some()
}

fn sniff(path: &Path, _head: &[u8], progress: &Progress) -> bool {
    if path.is_dir() {
        return in_folder(path, false, progress, &mut vec![]).is_ok_and(|entries| entries.iter().any(is_picture));
    }
    // One picture by itself is claimed, so that it can be said what to do with it.
    kind(&path.to_string_lossy()).is_some_and(|k| k != Kind::Tiff)
}

fn scan(path: &Path, hints: &Hints, progress: &Progress) -> Result<Scan, ReadError> {
    let is_folder = archive::is_folder(path, progress)?;
    if !is_folder && kind(&path.to_string_lossy()).is_some() {
        return Err(ReadError::Unsupported("it is one picture; name its folder to read the pictures there as slices".into()));
    }
    let mut warnings = vec![];
    // The folders of an archive are part of what was sent.
    let all = in_folder(path, !path.is_dir(), progress, &mut warnings)?;
    let mut slices: Vec<(Entry, Kind)> = all.iter().filter_map(|e| kind(&e.name).map(|k| (e.clone(), k))).collect();
    // Of several kinds the most common is meant; a logo or a preview is no slice.
    let usual = most_common(slices.iter().map(|(_, kind)| *kind)).ok_or(ReadError::NoImages)?;
    keep(&mut slices, &mut warnings, "of another kind than the others", |(_, kind)| *kind == usual);
    let mut numbers = one_stack(&mut slices, &mut warnings)?;
    let looked = look_at_all(&slices, progress)?;
    if let Some((n, many)) = looked.iter().enumerate().find(|(_, look)| look.pages > 1) {
        let (file, pages) = (&slices[n].0, many.pages);
        if slices.len() == 1 {
            return (tiff::FORMAT.scan)(&file.file, hints, progress);
        }
        return Err(ReadError::Unsupported(format!("its file {} has {pages} pages, which is a scan by itself; name that file", file.name)));
    }
    let kinds = || looked.iter().map(|l| (l.dims, l.sample));
    let most = most_common(kinds()).ok_or(ReadError::NoImages)?;
    let like: Vec<bool> = kinds().map(|l| l == most).collect();
    let mut own = like.iter();
    keep(&mut slices, &mut warnings, "of another size or type than the others", |_| own.next() == Some(&true));
    let mut own = like.iter();
    numbers.retain(|_| own.next() == Some(&true));
    let ([nx, ny], sample) = most;
    if looked.iter().any(|l| (l.dims, l.sample) == most && l.white_is_zero) {
        warnings.push(tiff::WHITE_IS_ZERO.into());
    }
    let mixes = mixes(&slices, &numbers, hints, &mut warnings)?;

    let in_picture = looked.iter().filter(|l| (l.dims, l.sample) == most).find_map(|l| l.spacing_mm);
    let stated = in_picture.or_else(|| beside_them(&all, &slices[0].0.name, progress, &mut warnings));
    let spacing_mm = stated.or(hints.spacing_mm);
    if spacing_mm.is_none() {
        warnings.push(NO_SPACING.into());
    }
    warnings.push(NO_DIRECTIONS.into());
    let grid = Grid::new([nx, ny, mixes.len()], spacing_mm.unwrap_or(DVec3::ONE), DVec3::ZERO, DMat3::IDENTITY)?;
    let file_bytes: u64 = slices.iter().map(|(e, _)| e.packed_bytes()).sum();
    let most_expansion = if usual == Kind::Jpeg2000 { MOST_STACK } else { u64::MAX };
    check_expansion_to(slices.len() as u128 * (nx * ny * sample.bytes()) as u128, file_bytes, most_expansion)?;
    let storage = Storage::Slices(Box::new(move |k, _, progress| {
        let read = |n: usize| {
            let (entry, kind) = &slices[n];
            read(entry, *kind, progress).map_err(|e| in_file(Path::new(&entry.name), e))
        };
        let Mix { of, and, part } = mixes[k];
        let bytes = read(of)?;
        if part == 0.0 { Ok(bytes) } else { Ok(blend(&bytes, &read(and)?, part, sample)) }
    }));
    let scan = Scan::new(grid, Encoding { sample, big_endian: false }, file_bytes, storage);
    Ok(Scan { spacing_is_stated: spacing_mm.is_some(), warnings, ..scan })
}

/// The spacing that the scanner wrote beside pictures, aloud.
fn beside_them(entries: &[Entry], picture: &str, progress: &Progress, warnings: &mut Vec<String>) -> Option<DVec3> {
    let (mm, name) = beside::spacing_mm(entries, picture, progress)?;
    warnings.push(format!("its spacing is that of {name}"));
    Some(mm)
}

/// What a byte of a whole stack by JPEG 2000 unpacks to, at most: blank pictures may be packed much smaller, but not all of a scan.
const MOST_STACK: u64 = 1 << 12;

/// Looks at each by itself first, so that of several faults the first is told.
fn look_at_all(slices: &[(Entry, Kind)], progress: &Progress) -> Result<Vec<Look>, ReadError> {
    progress.begin(slices.len() as u64);
    let looked: Vec<Result<Look, ReadError>> = slices
        .par_iter()
        .map(|(entry, kind)| {
            progress.advance(1)?;
            look(entry, *kind).map_err(|e| in_file(Path::new(&entry.name), e))
        })
        .collect();
    looked.into_iter().collect()
}

/// Keeps the pictures of one stack; the number of each. What is by itself, or few beside many, is no stack: an overview, a logo.
fn one_stack(slices: &mut Vec<(Entry, Kind)>, warnings: &mut Vec<String>) -> Result<Vec<u128>, ReadError> {
    let mut stacks = names::stacks(&slices.iter().map(|(e, _)| e.name.as_str()).collect::<Vec<_>>());
    // The first of the largest first. Names that have nothing in common are taken in their order.
    stacks.sort_by_key(|s| (std::cmp::Reverse(s.members.len()), s.members[0]));
    if stacks[0].members.len() == 1 {
        return Ok(vec![]);
    }
    /// Part of a stack below which others are no stacks.
    const FEW: usize = 10;
    let largest = stacks.swap_remove(0);
    let others = stacks.iter().filter(|s| s.members.len() > 1 && s.members.len() * FEW >= largest.members.len());
    let name = |s: &names::Stack| {
        let (first, last) = (s.members[0], s.members[s.members.len() - 1]);
        format!("{} to {} ({})", slices[first].0.name, slices[last].0.name, s.members.len())
    };
    let list: Vec<String> = [&largest].into_iter().chain(others).map(name).collect();
    if list.len() > 1 {
        let (n, list) = (list.len(), list.iter().take(MOST_LISTED).cloned().collect::<Vec<_>>().join(", "));
        let text = format!("it holds {n} stacks of pictures, {list}; put each into a folder of its own and name that");
        return Err(ReadError::Unsupported(text));
    }
    let mut own = vec![false; slices.len()];
    largest.members.iter().for_each(|&n| own[n] = true);
    let mut own = own.into_iter();
    keep(slices, warnings, "named otherwise than the others (overviews, previews)", |_| own.next() == Some(true));
    Ok(largest.numbers)
}

/// Stacks that are listed in a message.
const MOST_LISTED: usize = 5;

/// Each slice by itself, or, where numbers are missing and the person wants it, slices between their neighbours.
fn mixes(slices: &[(Entry, Kind)], numbers: &[u128], hints: &Hints, warnings: &mut Vec<String>) -> Result<Vec<Mix>, ReadError> {
    let own = |of: usize| Mix { of, and: of, part: 0.0 };
    let Some((steps, list)) = names::gaps(numbers) else { return Ok((0..slices.len()).map(own).collect()) };
    let count = steps.iter().fold(1, |n: u128, step| n.saturating_add(*step));
    // As for DICOM: no gap asks for more than is there.
    if hints.uneven != Uneven::Resample || count > 16 * slices.len() as u128 {
        return Err(ReadError::Numbering(list));
    }
    let mut order: Vec<usize> = (0..slices.len()).collect();
    order.sort_by_key(|&n| numbers[n]);
    let mut mixes = vec![own(order[0])];
    for (pair, &step) in order.windows(2).zip(&steps) {
        mixes.extend((1..step).map(|n| Mix { of: pair[0], and: pair[1], part: n as f64 / step as f64 }));
        mixes.push(own(pair[1]));
    }
    warnings.push(format!("some of its numbers are missing ({list}); they are interpolated linearly to {count} slices"));
    Ok(mixes)
}

/// Of items that are of few sorts, the sort that most are of; the first of them where there are as many of another.
fn most_common<T: PartialEq + Copy>(items: impl Iterator<Item = T>) -> Option<T> {
    let mut sorts: Vec<(T, usize)> = vec![];
    for item in items {
        match sorts.iter_mut().find(|(sort, _)| *sort == item) {
            Some((_, n)) => *n += 1,
            None => sorts.push((item, 1)),
        }
    }
    sorts.into_iter().rev().max_by_key(|(_, n)| *n).map(|(sort, _)| sort)
}

/// Keeps the slices that are `like` the others, and says how many are not.
fn keep(slices: &mut Vec<(Entry, Kind)>, warnings: &mut Vec<String>, what: &str, like: impl FnMut(&(Entry, Kind)) -> bool) {
    let all = slices.len();
    slices.retain(like);
    if slices.len() < all {
        warnings.push(format!("{} of {all} pictures are {what} and are left out", all - slices.len()));
    }
}

fn damaged(error: &dyn std::fmt::Display) -> ReadError {
    ReadError::Damaged(format!("as a picture, {error}"))
}

/// What a picture's header says.
#[derive(Clone, Copy)]
struct Look {
    dims: [usize; 2],
    sample: SampleType,
    white_is_zero: bool,
    /// Pages like it in its file.
    pages: usize,
    spacing_mm: Option<DVec3>,
}

fn look(entry: &Entry, kind: Kind) -> Result<Look, ReadError> {
    // The bytes of headers are few; the work is counted in files.
    let progress = Progress::default();
    let (look, most) = match kind {
        Kind::Tiff => {
            let tiff::Slice { page, most_expansion, pages, spacing_mm } = tiff::slice(entry, &progress)?;
            (Look { dims: page.dims, sample: page.sample, white_is_zero: page.white_is_zero, pages, spacing_mm }, most_expansion)
        }
        Kind::Jpeg2000 => {
            let head = jpeg_2000::look(&entry.read(&progress)?)?;
            let sample = match (head.bits, head.signed) {
                (..=8, false) => SampleType::U8,
                (..=8, true) => SampleType::I8,
                (..=16, false) => SampleType::U16,
                (..=16, true) => SampleType::I16,
                (bits, _) => return Err(ReadError::Unsupported(format!("its samples have {bits} bits; only up to 16 can be read"))),
            };
            (Look { dims: head.dims, sample, white_is_zero: false, pages: 1, spacing_mm: None }, MOST_BLANK)
        }
        Kind::Other(format) => {
            let decoder = ImageReader::with_format(entry.seekable(&progress)?, format).into_decoder().map_err(|e| damaged(&e))?;
            let (width, height) = decoder.dimensions();
            let sample = match decoder.color_type() {
                ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8 => SampleType::U8,
                ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16 => SampleType::U16,
                other => return Err(ReadError::Unsupported(format!("its pixels are {other:?}; only grey values can be read"))),
            };
            (Look { dims: [width as usize, height as usize], sample, white_is_zero: false, pages: 1, spacing_mm: None }, MOST_EXPANSION)
        }
    };
    let wanted = look.dims.iter().map(|&n| n as u128).product::<u128>() * look.sample.bytes() as u128;
    check_expansion_to(wanted, entry.bytes, most)?;
    Ok(look)
}

/// The samples of a picture, little-endian. Colours are refused, unless all three are the same, as grey pictures are often saved.
fn read(entry: &Entry, kind: Kind, progress: &Progress) -> Result<Vec<u8>, ReadError> {
    let format = match kind {
        Kind::Tiff => return tiff::read_slice(entry, progress),
        Kind::Jpeg2000 => {
            let packed = entry.read(progress)?;
            // As it was looked at: no more bytes than it was checked for.
            let n = if jpeg_2000::look(&packed)?.bits > 8 { 2 } else { 1 };
            return jpeg_2000::decode(&packed, n, |_| None, |_| Ok(()));
        }
        Kind::Other(format) => format,
    };
    let bytes = entry.read(progress)?;
    let image = ImageReader::with_format(Cursor::new(&bytes), format).decode().map_err(|e| damaged(&e))?;
    fn grey<T: Copy + PartialEq, const N: usize>(samples: &[T]) -> Result<Vec<T>, ReadError> {
        let pixels = samples.as_chunks::<N>().0;
        match N < 3 || pixels.iter().all(|p| p[0] == p[1] && p[1] == p[2]) {
            true => Ok(pixels.iter().map(|p| p[0]).collect()),
            false => Err(ReadError::Unsupported("it has colours; only grey values can be read".into())),
        }
    }
    let wide = |samples: Result<Vec<u16>, ReadError>| Ok(samples?.into_iter().flat_map(u16::to_le_bytes).collect());
    match image {
        DynamicImage::ImageLuma8(i) => Ok(i.into_raw()),
        DynamicImage::ImageLumaA8(i) => grey::<_, 2>(&i),
        DynamicImage::ImageRgb8(i) => grey::<_, 3>(&i),
        DynamicImage::ImageRgba8(i) => grey::<_, 4>(&i),
        DynamicImage::ImageLuma16(i) => wide(Ok(i.into_raw())),
        DynamicImage::ImageLumaA16(i) => wide(grey::<_, 2>(&i)),
        DynamicImage::ImageRgb16(i) => wide(grey::<_, 3>(&i)),
        DynamicImage::ImageRgba16(i) => wide(grey::<_, 4>(&i)),
        _ => Err(ReadError::Unsupported("its pixels are floats; only whole grey values can be read".into())),
    }
}
