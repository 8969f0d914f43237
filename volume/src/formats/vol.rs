//! Scanners' `.vol` files and the headers beside them: `.vgi` of Nikon and VGStudio, `.pcr` of GE phoenix. Settings in sections, samples
//! little-endian. Neither maker publishes them; names are those of files, and of SlicerMorph's GEVolImport for `.pcr`
//! (<https://github.com/SlicerMorph/SlicerMorph>).

use super::decode::{Encoding, SampleType};
use super::packing::Packing;
use super::part::{Part, head_of, in_file, open_file};
use super::text::{decimal, decimals, settings, sizes};
use super::units::unit_mm;
use super::{Format, Hints, NO_DIRECTIONS, NO_SPACING, ReadError, Scan, Storage, bad};
use crate::{Grid, Progress};
use glam::{DMat3, DVec3};
use std::path::Path;

/// The row of the formats.
pub const FORMAT: Format = Format { name: "VGI or PCR with VOL", sniff, scan, write: None };

/// Such headers have some kilobytes.
const MOST_BYTES: u64 = 1 << 20;

fn is(path: &Path, ext: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ext))
}

fn sniff(path: &Path, head: &[u8], _progress: &Progress) -> bool {
    !head.is_empty() && (is(path, "vgi") || is(path, "pcr"))
}

/// What a header says.
struct Header {
    dims: [usize; 3],
    sample: SampleType,
    spacing_mm: Option<DVec3>,
    /// The files of samples, in order, and bytes before them in each.
    files: Vec<(String, u64)>,
}

fn scan(path: &Path, hints: &Hints, _progress: &Progress) -> Result<Scan, ReadError> {
    let text: String = head_of(path, MOST_BYTES)?.0.iter().map(|&b| char::from(b)).collect();
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let header = if is(path, "vgi") { vgi(&text)? } else { pcr(&text, &stem)? };
    let spacing_mm = header.spacing_mm.or(hints.spacing_mm);
    let grid = Grid::new(header.dims, spacing_mm.unwrap_or(DVec3::ONE), DVec3::ZERO, DMat3::IDENTITY)?;
    let wanted = grid.len() as u128 * header.sample.bytes() as u128;
    let folder = path.parent().unwrap_or(Path::new(""));
    let count = header.files.len() as u128;
    if !wanted.is_multiple_of(count) {
        return Err(ReadError::Contradiction(format!("it names {count} files for {wanted} bytes of samples")));
    }
    let (mut parts, mut total) = (vec![], 0_u64);
    for (name, skip) in &header.files {
        // Where it lay on the scanner's disk is gone.
        let file = folder.join(name.rsplit(['/', '\\']).next().unwrap_or(name));
        let part = open_file(&file).and_then(|(_, there)| {
            total = total.saturating_add(there);
            Part::checked(&file, Packing::Plain, 0, *skip, wanted / count, there)
        });
        parts.push(Part { beside: true, ..part.map_err(|e| in_file(&file, e))? });
    }
    let scan = Scan::new(grid, Encoding { sample: header.sample, big_endian: false }, total, Storage::Parts(parts));
    let warnings = spacing_mm.is_none().then_some(NO_SPACING).into_iter().chain([NO_DIRECTIONS]).map(str::to_owned).collect();
    Ok(Scan { spacing_is_stated: spacing_mm.is_some(), warnings, ..scan })
}

/// `[fileN]` has the samples, `[geometry]` their distance.
fn vgi(text: &str) -> Result<Header, ReadError> {
    let all: Vec<(String, String, &str)> = settings(text).collect();
    let of = |section: &str, key: &str| all.iter().find(|(s, k, _)| s == section && k == key).map(|(.., value)| *value);
    let mut sections: Vec<&str> =
        all.iter().map(|(s, ..)| s.as_str()).filter(|s| s.strip_prefix("file").is_some_and(|n| n.parse::<u32>().is_ok())).collect();
    sections.dedup();
    let first = *sections.first().ok_or(ReadError::MissingField("[file1]"))?;
    let files: Option<Vec<(String, u64)>> =
        sections.iter().map(|s| Some((of(s, "name")?.to_owned(), of(s, "skipheader").map_or(Some(0), |n| n.parse().ok())?))).collect();
    let format = of(first, "fileformat").unwrap_or("raw");
    if !format.eq_ignore_ascii_case("raw") {
        return Err(ReadError::Unsupported(format!("its samples are of file format {format:?}; only raw is read; export it anew as raw")));
    }
    let size = of("representation", "size").or(of(first, "size")).ok_or(ReadError::MissingField("size"))?;
    let dims = decimals(size).and_then(sizes).ok_or_else(|| bad("size", size, "it must be three whole numbers"))?;
    let either = |key| of(first, key).or(of("representation", key));
    let (kind, bits) = (either("datatype").unwrap_or_default().to_lowercase(), either("bitsperelement").unwrap_or_default());
    let sample = match (kind.as_str(), bits) {
        ("float", "32") => SampleType::F32,
        ("unsigned integer" | "", "8") => SampleType::U8,
        ("unsigned integer" | "", "16") => SampleType::U16,
        ("unsigned integer", "32") => SampleType::U32,
        ("signed integer" | "integer", "8") => SampleType::I8,
        ("signed integer" | "integer", "16") => SampleType::I16,
        ("signed integer" | "integer", "32") => SampleType::I32,
        _ => return Err(bad("datatype", format!("{kind}, {bits} bits"), "it is no type that can be read")),
    };
    let resolution = of("geometry", "resolution").and_then(decimals::<3>);
    let unit = of("geometry", "unit").map_or(Some(1.0), unit_mm);
    let spacing_mm = resolution.zip(unit).map(|(r, mm)| DVec3::from(r) * mm).filter(|mm| mm.min_element() > 0.0);
    Ok(Header { dims, sample, spacing_mm, files: files.ok_or(ReadError::MissingField("name"))? })
}

/// `[VolumeData]` has it all; cubes, in mm. The samples are in the `.vol` of the same name.
fn pcr(text: &str, stem: &str) -> Result<Header, ReadError> {
    let of = |key: &str| settings(text).find(|(section, k, _)| section == "volumedata" && k == key).map(|(.., value)| value);
    let size = |key, name| of(key).and_then(decimal).ok_or(ReadError::MissingField(name));
    let stated = [size("volume_sizex", "Volume_SizeX")?, size("volume_sizey", "Volume_SizeY")?, size("volume_sizez", "Volume_SizeZ")?];
    let dims = sizes(stated).ok_or_else(|| bad("Volume_Size", format!("{stated:?}"), "it must be three whole numbers"))?;
    let format = of("format").ok_or(ReadError::MissingField("Format"))?;
    let sample = match format {
        "1" => SampleType::U8,
        "5" => SampleType::U16,
        "10" => SampleType::F32,
        _ => return Err(bad("Format", format, "it is none of 1, 5 and 10 (8 and 16 bits, float32)")),
    };
    let spacing_mm = of("voxelsizerec").and_then(decimal).filter(|mm| *mm > 0.0).map(DVec3::splat);
    Ok(Header { dims, sample, spacing_mm, files: vec![(format!("{stem}.vol"), 0)] })
}
