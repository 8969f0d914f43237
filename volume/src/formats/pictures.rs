//! A folder or a zip of pictures, one for each slice, in the order of the numbers in their names: TIFF, PNG, BMP or JPEG.

use super::decode::{Encoding, SampleType};
use super::entries::{Entry, in_folder, in_zip};
use super::part::{MOST_EXPANSION, check_expansion_to, in_file};
use super::{Format, Hints, NO_DIRECTIONS, NO_SPACING, ReadError, Scan, Storage, tiff};
use crate::{Grid, Progress};
use glam::{DMat3, DVec3};
use image::{ColorType, DynamicImage, ImageDecoder, ImageFormat, ImageReader};
use rayon::prelude::*;
use std::io::Cursor;
use std::path::Path;

/// The row of the formats.
pub const FORMAT: Format = Format { name: "pictures (a folder or zip of TIFF, PNG, BMP or JPEG)", sniff, scan, write: None };

/// How a picture is packed.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Tiff,
    Other(ImageFormat),
}

const KINDS: [(&str, Kind); 7] = [
    ("tif", Kind::Tiff),
    ("tiff", Kind::Tiff),
    ("png", Kind::Other(ImageFormat::Png)),
    ("bmp", Kind::Other(ImageFormat::Bmp)),
    ("jpg", Kind::Other(ImageFormat::Jpeg)),
    ("jpeg", Kind::Other(ImageFormat::Jpeg)),
    ("jpe", Kind::Other(ImageFormat::Jpeg)),
];

fn kind(name: &str) -> Option<Kind> {
    let ext = Path::new(name).extension()?.to_str()?;
    KINDS.iter().find(|(e, _)| ext.eq_ignore_ascii_case(e)).map(|(_, kind)| *kind)
}

fn entries(path: &Path, progress: &Progress, warnings: &mut Vec<String>) -> Result<Vec<Entry>, ReadError> {
    if path.is_dir() { in_folder(path, false, progress, warnings) } else { in_zip(path, progress, warnings) }
}

fn sniff(path: &Path, head: &[u8], progress: &Progress) -> bool {
    if path.is_dir() {
        return entries(path, progress, &mut vec![]).is_ok_and(|entries| entries.iter().any(|e| kind(&e.name).is_some()));
    }
    // A zip that is no DICOM is claimed, too.
    if super::is_zip(head) {
        return true;
    }
    // One picture by itself is claimed, so that it can be said what to do with it.
    kind(&path.to_string_lossy()).is_some_and(|k| k != Kind::Tiff)
}

fn scan(path: &Path, hints: &Hints, progress: &Progress) -> Result<Scan, ReadError> {
    if !path.is_dir() && kind(&path.to_string_lossy()).is_some() {
        return Err(ReadError::Unsupported("it is one picture; name its folder to read the pictures there as slices".into()));
    }
    let mut warnings = vec![];
    let all = entries(path, progress, &mut warnings)?;
    let mut slices: Vec<(Entry, Kind)> = all.into_iter().filter_map(|e| kind(&e.name).map(|k| (e, k))).collect();
    // Of several kinds the most common is meant; a logo or a preview is no slice.
    let usual = most_common(slices.iter().map(|(_, kind)| *kind)).ok_or(ReadError::NoImages)?;
    keep(&mut slices, &mut warnings, "of another kind than the others", |(_, kind)| *kind == usual);
    progress.begin(slices.len() as u64);
    // Each by itself first, so that of several faults the first is told.
    let looked: Vec<Result<Look, ReadError>> = slices
        .par_iter()
        .map(|(entry, kind)| {
            progress.advance(1)?;
            look(entry, *kind).map_err(|e| in_file(Path::new(&entry.name), e))
        })
        .collect();
    let looked = looked.into_iter().collect::<Result<Vec<_>, ReadError>>()?;
    let kinds = || looked.iter().map(|l| (l.dims, l.sample));
    let most = most_common(kinds()).ok_or(ReadError::NoImages)?;
    let mut like = kinds().map(|l| l == most);
    keep(&mut slices, &mut warnings, "of another size or type than the others", |_| like.next() == Some(true));
    let ([nx, ny], sample) = most;
    if looked.iter().any(|l| (l.dims, l.sample) == most && l.white_is_zero) {
        warnings.push(tiff::WHITE_IS_ZERO.into());
    }

    if hints.spacing_mm.is_none() {
        warnings.push(NO_SPACING.into());
    }
    warnings.push(NO_DIRECTIONS.into());
    let grid = Grid::new([nx, ny, slices.len()], hints.spacing_mm.unwrap_or(DVec3::ONE), DVec3::ZERO, DMat3::IDENTITY)?;
    let file_bytes = slices.iter().map(|(e, _)| e.packed_bytes()).sum();
    let storage = Storage::Slices(Box::new(move |k, _, progress| {
        let (entry, kind) = &slices[k];
        read(entry, *kind, progress).map_err(|e| in_file(Path::new(&entry.name), e))
    }));
    let scan = Scan::new(grid, Encoding { sample, big_endian: false }, file_bytes, storage);
    Ok(Scan { spacing_is_stated: hints.spacing_mm.is_some(), warnings, ..scan })
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
}

fn look(entry: &Entry, kind: Kind) -> Result<Look, ReadError> {
    // The bytes of headers are few; the work is counted in files.
    let progress = Progress::default();
    let (look, most) = match kind {
        Kind::Tiff => {
            let (page, most) = tiff::first_page(entry, &progress)?;
            (Look { dims: page.dims, sample: page.sample, white_is_zero: page.white_is_zero }, most)
        }
        Kind::Other(format) => {
            let decoder = ImageReader::with_format(entry.seekable(&progress)?, format).into_decoder().map_err(|e| damaged(&e))?;
            let (width, height) = decoder.dimensions();
            let sample = match decoder.color_type() {
                ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8 => SampleType::U8,
                ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16 => SampleType::U16,
                other => return Err(ReadError::Unsupported(format!("its pixels are {other:?}; only grey values can be read"))),
            };
            (Look { dims: [width as usize, height as usize], sample, white_is_zero: false }, MOST_EXPANSION)
        }
    };
    let wanted = look.dims.iter().map(|&n| n as u128).product::<u128>() * look.sample.bytes() as u128;
    check_expansion_to(wanted, entry.bytes, most)?;
    Ok(look)
}

/// The samples of a picture, little-endian. Colours are refused, unless all three are the same, as grey pictures are often saved.
fn read(entry: &Entry, kind: Kind, progress: &Progress) -> Result<Vec<u8>, ReadError> {
    let Kind::Other(format) = kind else { return tiff::read_first_page(entry, progress) };
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
