//! Drishti volumes, `.pvl.nc`: a header in XML, and the samples beside it in slabs, `.pvl.nc.001` and so on, little-endian. The name is left over
//! from NetCDF, which they no longer are. Layout as Drishti's own `VolumeFileManager` writes and reads it
//! (<https://github.com/nci/drishti>): slices along depth, in them rows along width, in those samples along height.

use super::decode::{Encoding, SampleType};
use super::packing::Packing;
use super::part::{Part, head_of, in_file, open_file};
use super::text::{decimals, sizes};
use super::units::unit_mm;
use super::{Format, Hints, NO_DIRECTIONS, NO_SPACING, ReadError, Scan, Storage, bad};
use crate::{Grid, Progress};
use glam::{DMat3, DVec3};
use quick_xml::Reader;
use quick_xml::events::Event;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// The row of the formats.
pub const FORMAT: Format = Format { name: "Drishti", sniff, scan, write: None };

/// Such headers have some kilobytes.
const MOST_BYTES: u64 = 1 << 20;
/// Before the samples of a slab: their type, and three sizes.
const SLAB_HEADER: u64 = 13;
/// Slabs have a gigabyte each, unless a program writes smaller ones.
const MOST_SLABS: usize = 999;

fn sniff(_path: &Path, head: &[u8], _progress: &Progress) -> bool {
    head.trim_ascii_start().starts_with(b"<") && head.windows(20).take(1024).any(|w| w == b"<PvlDotNcFileHeader>")
}

fn scan(path: &Path, hints: &Hints, _progress: &Progress) -> Result<Scan, ReadError> {
    let text: String = head_of(path, MOST_BYTES)?.0.iter().map(|&b| char::from(b)).collect();
    let fields = fields(&text)?;
    let of = |name: &str| fields.get(name).map(|text| text.trim()).filter(|text| !text.is_empty());
    let size = of("gridsize").ok_or(ReadError::MissingField("gridsize"))?;
    let [nz, ny, nx] = decimals(size).and_then(sizes).ok_or_else(|| bad("gridsize", size, "it must be three whole numbers"))?;
    let kind = of("pvlvoxeltype").or(of("voxeltype")).unwrap_or("unsigned char");
    let sample = match kind {
        "unsigned char" => SampleType::U8,
        "char" => SampleType::I8,
        "unsigned short" => SampleType::U16,
        "short" => SampleType::I16,
        "int" => SampleType::I32,
        "float" => SampleType::F32,
        _ => return Err(bad("pvlvoxeltype", kind, "it is none of Drishti's types of one number")),
    };
    let stated_mm = of("voxelsize").and_then(decimals::<3>).zip(of("voxelunit").and_then(unit_mm)).map(|(s, mm)| DVec3::from(s) * mm);
    let spacing_mm = stated_mm.filter(|mm| mm.min_element() > 0.0).or(hints.spacing_mm);
    let grid = Grid::new([nx, ny, nz], spacing_mm.unwrap_or(DVec3::ONE), DVec3::ZERO, DMat3::IDENTITY)?;
    let in_slab = of("slabsize").and_then(|n| n.parse().ok()).filter(|n| *n > 0).unwrap_or(nz);
    let (mut parts, mut total) = (vec![], 0_u64);
    for (n, file) in files(path, of("pvlnames"), nz.div_ceil(in_slab))?.into_iter().enumerate() {
        let slices = in_slab.min(nz - n * in_slab);
        let wanted = slices as u128 * nx as u128 * ny as u128 * sample.bytes() as u128;
        let part = open_file(&file).and_then(|(_, there)| {
            total = total.saturating_add(there);
            // Other programs leave the header of a slab away.
            let start = if u128::from(there) == wanted { 0 } else { SLAB_HEADER };
            Part::checked(&file, Packing::Plain, start, 0, wanted, there)
        });
        parts.push(Part { beside: true, ..part.map_err(|e| in_file(&file, e))? });
    }
    let mut warnings = vec![NO_DIRECTIONS.to_owned()];
    if spacing_mm.is_none() {
        warnings.push(NO_SPACING.into());
    }
    if of("voxeltype").is_some_and(|raw| raw != kind) {
        warnings.push("its samples are those that Drishti draws, mapped from the scanner's (rawmap, pvlmap); its .raw has those".into());
    }
    let kept = ["description", "rawmap", "pvlmap"].iter().filter_map(|name| Some(((*name).to_owned(), of(name)?.to_owned())));
    let metadata = kept.collect();
    let scan = Scan::new(grid, Encoding { sample, big_endian: false }, total, Storage::Parts(parts));
    Ok(Scan { spacing_is_stated: spacing_mm.is_some(), warnings, metadata, ..scan })
}

/// The files of `count` slabs: those that are named, else numbered from 1.
fn files(path: &Path, names: Option<&str>, count: usize) -> Result<Vec<PathBuf>, ReadError> {
    if count > MOST_SLABS {
        return Err(bad("slabsize", count, "it makes more slabs than their numbers count"));
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    let named: Vec<&str> = names.unwrap_or_default().split_whitespace().collect();
    let numbered = |n: usize| PathBuf::from(format!("{}.{:03}", path.display(), n + 1));
    Ok((0..count).map(|n| named.get(n).map_or_else(|| numbered(n), |name| folder.join(name))).collect())
}

/// The texts of the elements, by name.
fn fields(text: &str) -> Result<HashMap<String, String>, ReadError> {
    let damaged = |e: &dyn std::fmt::Display| ReadError::Damaged(format!("as XML, {e}"));
    let mut reader = Reader::from_str(text);
    let (mut fields, mut name) = (HashMap::<String, String>::new(), String::new());
    loop {
        match reader.read_event().map_err(|e| damaged(&e))? {
            Event::Eof => return Ok(fields),
            Event::Start(start) => name = String::from_utf8_lossy(start.name().as_ref()).into_owned(),
            Event::End(_) => name.clear(),
            Event::Text(value) if !name.is_empty() => {
                fields.entry(name.clone()).or_default().push_str(&value.decode().map_err(|e| damaged(&e))?);
            }
            _ => {}
        }
    }
}
