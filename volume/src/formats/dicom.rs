//! DICOM: a series of files in a folder or an archive, named by the folder, the archive or any one of its files; single- or multi-frame.
//!
//! Attributes and their meaning are those of DICOM part 3; the geometry is that of the slices' own positions (see `stack`).

mod apart;
mod dataset;
mod header;
mod jpeg_lossless;
mod left_out;
mod lent;
mod padding;
mod pixels;
mod placeless;
pub mod series;

use super::decode::{Encoding, SampleType, f16s, f32s, f64s};
use super::entries::{entry_at, in_folder};
use super::entry::Entry;
use super::stack::{self, Mix, Slice};
use super::{Format, Hints, NO_SPACING, ReadError, Scan, Storage};
use crate::volume::{Metadata, slices_off};
use crate::{Progress, Unit};
use dicom_dictionary_std::tags;
use glam::DVec3;
use half::f16;
use header::Header;
use padding::Padding;
use pixels::Storing;
use std::path::Path;

/// The row of the formats.
pub const FORMAT: Format = Format { name: "DICOM", sniff, scan, write: None };

/// Bytes that DICOM is told by.
const HEAD: u64 = 132;

fn sniff(path: &Path, head: &[u8], progress: &Progress) -> bool {
    if path.is_dir() {
        return in_folder(path, true, progress, &mut vec![]).is_ok_and(|entries| entries.iter().any(|entry| is_dicom(entry, progress)));
    }
    // The name covers files that are damaged too, so that what is wrong with them can be said.
    let named = path.extension().is_some_and(|e| ["dcm", "dicom", "ima"].iter().any(|n| e.eq_ignore_ascii_case(n)));
    let is_gzip = || head.starts_with(&[0x1f, 0x8b]) && entry_at(path, progress).is_ok_and(|entry| is_dicom(&entry, progress));
    !head.is_empty() && (named || header::is_dicom(head) || is_gzip())
}

/// Whether a file begins as DICOM does.
pub fn is_dicom(entry: &Entry, progress: &Progress) -> bool {
    entry.gunzipped().head(HEAD, progress).is_ok_and(|head| header::is_dicom(&head))
}

/// One image: a frame of a file.
#[derive(Clone, Copy, Debug)]
struct Image {
    file: usize,
    frame: usize,
}

/// In one piece, though long: what a series states is gone through once, in the order in which warnings are shown, and all of it is moved into
/// what reads its slices later.
fn scan(path: &Path, hints: &Hints, progress: &Progress) -> Result<Scan, ReadError> {
    let mut warnings = vec![];
    let headers = series::read(path, hints, progress, &mut warnings)?;
    let images = images(&headers, &mut warnings)?;
    let images = readable(&headers, images, &mut warnings, progress)?;

    let mut spacings: Vec<Option<[f64; 2]>> = images.iter().map(|(i, _)| spacing_mm(&headers[i.file], i.frame)).collect();
    warnings.extend(left_out::warning(left_out::fill_in(&mut spacings), "its spacing"));
    let mut scales: Vec<Option<[f64; 2]>> = images.iter().map(|(i, _)| stated_scale(&headers[i.file], i.frame)).collect();
    warnings.extend(left_out::warning(left_out::fill_in(&mut scales), "how its numbers become values"));
    let spacing_is_stated = hints.spacing_mm.is_some() || spacings.iter().all(Option::is_some);
    let slices: Vec<Slice> =
        images.iter().zip(spacings).map(|((i, storing), mm)| slice(&headers[i.file], i.frame, storing.dims, mm, hints)).collect();
    if !spacing_is_stated {
        warnings.push(NO_SPACING.into());
    }
    let first = &headers[images[0].0.file];
    let frame = images[0].0.frame;
    let apart = [tags::SPACING_BETWEEN_SLICES, tags::SLICE_THICKNESS].iter().find_map(|&t| first.number(t, frame));
    let stack = stack::build(&slices, hints.uneven, apart.or(hints.spacing_mm.map(|s| s.z)), progress)?;
    warnings.extend(stack.warnings);

    let unit = unit(first, frame);
    let is_turned = first.text(tags::PHOTOMETRIC_INTERPRETATION, 0) == Some("MONOCHROME1") && unit == Unit::Value;
    let used = |n: usize| {
        let (Image { file, frame }, storing) = images[n];
        let scale = scales[n].unwrap_or([1.0, 0.0]);
        let scale = if is_turned { scale.map(|n| 0.0 - n) } else { scale };
        Used { file, frame, storing, scale, padding: Padding::of(&headers[file], frame, &storing, scale, unit) }
    };
    let mixes: Vec<(Mix, Used, Used)> = stack.mixes.iter().map(|&m| (m, used(m.of), used(m.and))).collect();
    let all = || mixes.iter().flat_map(|(_, of, and)| [of, and]);
    let [mut slope, mut intercept] = mixes[0].1.scale;
    let same_scale = all().all(|u| u.scale == [slope, intercept]);
    // Values that a slice scales by itself are kept as values, since a scan has one scale.
    let first_sample = mixes[0].1.storing.sample;
    let sample = match all().all(|u| u.storing.sample == first_sample) {
        _ if !same_scale => SampleType::F32,
        true => first_sample,
        // Numbers of different types become the narrowest that holds all of them.
        false => SampleType::I64,
    };
    if !same_scale {
        (slope, intercept) = (1.0, 0.0);
        warnings.push("its slices have scales of their own; their values are kept as float32".into());
    }
    if is_turned {
        warnings
            .push("its low numbers are shown white (MONOCHROME1), so they are taken as the dense ones: the scale is turned round".into());
    }
    let states = |tag| images.iter().any(|(i, _)| headers[i.file].number(tag, i.frame).is_some());
    if unit == Unit::Hounsfield && !(states(tags::RESCALE_SLOPE) && states(tags::RESCALE_INTERCEPT) && scales[0].is_some()) {
        warnings.push("it does not state how its numbers become HU (RescaleSlope, RescaleIntercept); they are taken as HU".into());
    }
    if first.text(tags::LOSSY_IMAGE_COMPRESSION, 0) == Some("01") {
        warnings.push("its pixels have been compressed with loss: they are not what the scanner measured".into());
    }
    warnings.extend(all().find_map(|u| u.padding.as_ref()).map(Padding::warning));

    let mut metadata = metadata(first, frame);
    metadata.extend(slices_off(stack.off_mm));
    let mut files: Vec<usize> = all().map(|u| u.file).collect();
    files.dedup();
    let file_bytes = files.iter().map(|&f| headers[f].entry.packed_bytes()).sum();
    let series = headers.iter().map(|header| header.entry.file.clone()).collect();
    let encoding = Encoding { sample, big_endian: false };
    let storage = Storage::Slices(Box::new(move |k, buffer, progress| {
        let read = |used: &Used, buffer: Vec<u8>| -> Result<Vec<u8>, ReadError> {
            let header = &headers[used.file];
            let named = |e| super::part::in_file(Path::new(&header.entry.name), e);
            let own = used.storing.sample;
            let mut bytes = used.storing.read(header, used.frame, buffer, progress).map_err(named)?;
            if let Some(padding) = &used.padding {
                padding.replace(&mut bytes, own);
            }
            Ok(match sample {
                _ if sample == own && same_scale => bytes,
                SampleType::I64 => bytes.chunks_exact(own.bytes()).flat_map(|b| whole(b, own).to_le_bytes()).collect(),
                _ => scaled(&bytes, own, used.scale),
            })
        };
        let (mix, of, and) = &mixes[k];
        let bytes = read(of, buffer)?;
        if mix.part == 0.0 { Ok(bytes) } else { Ok(blend(&bytes, &read(and, vec![])?, mix.part, sample)) }
    }));
    let scan = Scan::new(stack.grid, encoding, file_bytes, storage);
    Ok(Scan { slope, intercept, unit: Some(unit), spacing_is_stated, warnings, metadata, series, ..scan })
}

/// An image that is read, and what makes values of its samples.
struct Used {
    file: usize,
    frame: usize,
    storing: Storing,
    scale: [f64; 2],
    padding: Option<Padding>,
}

/// The frames that are slices of the patient, in the order in which they were taken.
fn images(headers: &[Header], warnings: &mut Vec<String>) -> Result<Vec<Image>, ReadError> {
    let (mut images, mut localizers, mut placeless, mut imageless) = (vec![], 0, 0_usize, 0);
    for (file, header) in headers.iter().enumerate() {
        if header.pixels.is_none() {
            imageless += 1;
            continue;
        }
        placeless = placeless.saturating_add(header.frames() - header.images());
        for frame in 0..header.images() {
            let kind = header.text(tags::FRAME_TYPE, frame).or_else(|| header.text(tags::IMAGE_TYPE, frame)).unwrap_or_default();
            match (kind.split('\\').any(|k| k == "LOCALIZER"), header.place(frame).is_some()) {
                (true, _) => localizers += 1,
                (false, false) => placeless += 1,
                (false, true) => images.push(Image { file, frame }),
            }
        }
    }
    let mut left_out = |n: usize, what: &str| {
        if n > 0 {
            warnings.push(format!("{n} {what} left out"));
        }
    };
    left_out(localizers, "of its images are localizers and");
    left_out(imageless, "of its files hold no image (reports) and");
    if images.is_empty() {
        let text = "its images do not state where they lie (ImagePositionPatient, ImageOrientationPatient), so they make no volume";
        return Err(if placeless > 0 { ReadError::Unsupported(text.into()) } else { ReadError::NoImages });
    }
    left_out(placeless, "of its images do not state where they lie and are");
    warnings.extend(headers.iter().find_map(assumed));
    warnings.extend(headers.iter().find_map(|header| header.lent).map(lent::Lent::warning));
    let key = |i: &Image| {
        let header = &headers[i.file];
        let number = |tag| header.number(tag, i.frame).unwrap_or(0.0);
        [number(tags::TEMPORAL_POSITION_INDEX), number(tags::ACQUISITION_NUMBER), number(tags::INSTANCE_NUMBER)]
    };
    images.sort_by(|a, b| {
        let (a, b) = (key(a), key(b));
        a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])).then(a[2].total_cmp(&b[2]))
    });
    Ok(images)
}

/// The sentence about frames whose places are not stated one by one.
fn assumed(header: &Header) -> Option<String> {
    let (mm, by) = header.assumed()?;
    let placed = if header.is_placed(0) { "one position" } else { "no position" };
    Some(format!("its {} frames have {placed}; they are taken to be {mm} mm apart, which is its {by}", header.frames()))
}

/// The images whose samples can be read, and how they are stored, which may differ from slice to slice.
fn readable(
    headers: &[Header],
    images: Vec<Image>,
    warnings: &mut Vec<String>,
    progress: &Progress,
) -> Result<Vec<(Image, Storing)>, ReadError> {
    let mut why = None;
    let storings: Vec<Option<Storing>> = headers
        .iter()
        .map(|header| {
            let checked = Storing::of(header).and_then(|storing| {
                storing.check(header)?;
                if header.frames() > 1 && header.is_deflated() {
                    return Err(ReadError::Unsupported("its many frames are packed into one file; unpack it first".into()));
                }
                // Frames of a packed file are asked for in any order.
                if header.frames() > 1 {
                    header.entry.unpacked(progress)?;
                }
                Ok(storing)
            });
            checked.map_err(|e| why = why.take().or(Some((header.entry.name.clone(), e)))).ok()
        })
        .collect();
    let all = images.len();
    let images: Vec<(Image, Storing)> = images.into_iter().filter_map(|i| Some((i, storings[i.file]?))).collect();
    match why {
        Some((name, error)) if images.is_empty() => Err(super::part::in_file(Path::new(&name), error)),
        Some((name, error)) if images.len() < all => {
            warnings.push(format!("{} of {all} images are left out: {name}: {error}", all - images.len()));
            Ok(images)
        }
        _ => Ok(images),
    }
}

fn slice(header: &Header, frame: usize, dims: [usize; 2], stated: Option<[f64; 2]>, hints: &Hints) -> Slice {
    // `images` has seen that these are there.
    let (position, [a, b, c, d, e, f]) = header.place(frame).unwrap_or_default();
    let spacing_mm = stated.or(hints.spacing_mm.map(|mm| [mm.x, mm.y])).unwrap_or([1.0, 1.0]);
    Slice { position_mm: position.into(), along: [DVec3::new(a, b, c), DVec3::new(d, e, f)], spacing_mm, dims }
}

/// Distance of samples along i and j, where it is stated.
fn spacing_mm(header: &Header, frame: usize) -> Option<[f64; 2]> {
    let spacing = |tag| header.numbers::<2>(tag, frame).filter(|s| s.iter().all(|mm| *mm > 0.0));
    // Between rows (along j) first.
    spacing(tags::PIXEL_SPACING).or_else(|| spacing(tags::NOMINAL_SCANNED_PIXEL_SPACING)).map(|[j, i]| [i, j])
}

/// Slope and intercept, where one of them is stated.
fn stated_scale(header: &Header, frame: usize) -> Option<[f64; 2]> {
    let [slope, intercept] = [tags::RESCALE_SLOPE, tags::RESCALE_INTERCEPT].map(|tag| header.number(tag, frame));
    (slope.is_some() || intercept.is_some()).then(|| [slope.unwrap_or(1.0), intercept.unwrap_or(0.0)])
}

/// Hounsfield units where the file says so, or is a CT that says nothing else.
fn unit(header: &Header, frame: usize) -> Unit {
    match (header.text(tags::RESCALE_TYPE, frame), header.text(tags::MODALITY, 0)) {
        (Some("HU"), _) | (None, Some("CT")) => Unit::Hounsfield,
        _ => Unit::Value,
    }
}

/// A whole number as DICOM stores it, little-endian.
fn whole(bytes: &[u8], sample: SampleType) -> i64 {
    let mut wide = [0; 8];
    wide[..bytes.len()].copy_from_slice(bytes);
    let spare = 64 - 8 * bytes.len() as u32;
    let value = i64::from_le_bytes(wide) << spare;
    match sample {
        SampleType::I8 | SampleType::I16 | SampleType::I32 => value >> spare,
        _ => (value as u64 >> spare) as i64,
    }
}

/// Samples as float32 values.
fn scaled(bytes: &[u8], sample: SampleType, [slope, intercept]: [f64; 2]) -> Vec<u8> {
    bytes.chunks_exact(sample.bytes()).flat_map(|b| ((whole(b, sample) as f64 * slope + intercept) as f32).to_le_bytes()).collect()
}

/// Samples `part` of the way from one slice to the next, whole numbers rounded.
pub fn blend(of: &[u8], and: &[u8], part: f64, sample: SampleType) -> Vec<u8> {
    let mix = |a: f64, b: f64| a + (b - a) * part;
    match sample {
        SampleType::F16 => {
            let pairs = f16s(of, false).zip(f16s(and, false));
            pairs.flat_map(|(a, b)| f16::from_f64(mix(a.into(), b.into())).to_le_bytes()).collect()
        }
        SampleType::F32 => {
            let pairs = f32s(of, false).zip(f32s(and, false));
            pairs.flat_map(|(a, b)| (mix(a.into(), b.into()) as f32).to_le_bytes()).collect()
        }
        SampleType::F64 => f64s(of, false).zip(f64s(and, false)).flat_map(|(a, b)| mix(a, b).to_le_bytes()).collect(),
        _ => {
            let n = sample.bytes();
            let pairs = of.chunks_exact(n).zip(and.chunks_exact(n));
            let mixed = |(a, b)| mix(whole(a, sample) as f64, whole(b, sample) as f64).round() as i64;
            pairs.flat_map(|pair| mixed(pair).to_le_bytes().into_iter().take(n)).collect()
        }
    }
}

/// What is kept beside the samples: of the scan and the scanner, nothing of the person.
fn metadata(header: &Header, frame: usize) -> Metadata {
    let kept = [
        ("Modality", tags::MODALITY),
        ("SeriesNumber", tags::SERIES_NUMBER),
        ("SeriesDescription", tags::SERIES_DESCRIPTION),
        ("Manufacturer", tags::MANUFACTURER),
        ("ManufacturerModelName", tags::MANUFACTURER_MODEL_NAME),
        ("KVP", tags::KVP),
        ("ConvolutionKernel", tags::CONVOLUTION_KERNEL),
        ("GantryDetectorTilt", tags::GANTRY_DETECTOR_TILT),
        ("SliceThickness", tags::SLICE_THICKNESS),
        ("FrameOfReferenceUID", tags::FRAME_OF_REFERENCE_UID),
    ];
    kept.iter().filter_map(|&(name, tag)| Some((name.to_owned(), header.text(tag, frame)?.to_owned()))).collect()
}
