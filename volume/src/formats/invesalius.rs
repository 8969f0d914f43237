//! InVesalius projects, `.inv3`: a tar, gzipped or not, of `main.plist` and the samples in `matrix.dat`, little-endian.
//!
//! InVesalius turns the rows of a picture upside down on import (`[::-1]` in its dcm2memmap) and keeps no position: j grows to the front.

use super::decode::{Encoding, SampleType};
use super::packing::{Counted, Packing, check_expansion, counted};
use super::part::{open_file, pass};
use super::{Format, Hints, ReadError, Scan, Storage, bad};
use crate::{Grid, Progress};
use flate2::bufread::MultiGzDecoder;
use glam::{DMat3, DVec3};
use quick_xml::Reader;
use quick_xml::events::Event;
use std::collections::HashMap;
use std::io::{BufReader, Read};
use std::path::Path;
use tar::Archive;

/// The row of the formats.
pub const FORMAT: Format = Format { name: "InVesalius", sniff, scan, write: None };

fn sniff(path: &Path, head: &[u8], _progress: &Progress) -> bool {
    !head.is_empty() && path.extension().is_some_and(|e| e.eq_ignore_ascii_case("inv3"))
}

/// A project's list is a few kilobytes; masks and surfaces add some for each.
const MOST_PLIST: u64 = 4 << 20;

fn scan(path: &Path, _hints: &Hints, progress: &Progress) -> Result<Scan, ReadError> {
    let (mut file, there) = open_file(path)?;
    let mut magic = [0; 2];
    file.read_exact(&mut magic)?;
    let packing = if magic == [0x1f, 0x8b] { Packing::Gzip } else { Packing::Plain };
    let mut text = String::new();
    in_tar(path, packing, progress, "main.plist", &mut |_, entry| Ok(entry.take(MOST_PLIST).read_to_string(&mut text).map(drop)?))?;
    let values = plist(&text)?;
    let numbers = |key: &str| -> Result<[f64; 3], ReadError> {
        let found = values.get(key).ok_or_else(|| bad("main.plist", key, "it is not there"))?;
        let numbers: Option<Vec<f64>> = found.iter().map(|n| n.parse().ok()).collect();
        numbers.and_then(|n| n.try_into().ok()).ok_or_else(|| bad(key, format!("{found:?}"), "it must be three numbers"))
    };
    let sample = match values.get("matrix/dtype").and_then(|d| d.first()).map(String::as_str) {
        Some("int8") => SampleType::I8,
        Some("uint8") => SampleType::U8,
        Some("int16") | None => SampleType::I16,
        Some("uint16") => SampleType::U16,
        Some("int32") => SampleType::I32,
        Some("float32") => SampleType::F32,
        Some("float64") => SampleType::F64,
        Some(other) => return Err(bad("matrix/dtype", other, "it is no type that can be read")),
    };
    let [nz, ny, nx] = numbers("matrix/shape")?.map(|n| n as usize);
    let direction = DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0));
    let grid = Grid::new([nx, ny, nz], numbers("spacing")?.into(), DVec3::ZERO, direction)?;
    let wanted = grid.len() as u128 * sample.bytes() as u128;
    match packing {
        Packing::Plain if wanted > u128::from(there) => return Err(ReadError::Truncated { wanted, there }),
        _ => check_expansion(wanted, there)?,
    }
    let name = values.get("matrix/filename").and_then(|n| n.first()).cloned().unwrap_or("matrix.dat".into());
    let metadata = values.get("modality").and_then(|m| m.first()).map(|m| ("Modality".to_owned(), m.clone())).into_iter().collect();
    let warnings = vec!["InVesalius keeps no position in the patient; its axes are taken as left, anterior, superior".into()];
    let (path, bytes) = (path.to_owned(), wanted as u64);
    let storage = Storage::Stream(Box::new(move |progress, take| {
        in_tar(&path, packing, progress, &name, &mut |progress, mut entry| pass(&mut entry, bytes, progress, take))?;
        Ok(vec![])
    }));
    Ok(Scan { warnings, metadata, ..Scan::new(grid, Encoding { sample, big_endian: false }, there, storage) })
}

/// Gives the file `name` of the archive, in whatever folder, to `take`.
fn in_tar(
    path: &Path,
    packing: Packing,
    progress: &Progress,
    name: &str,
    take: &mut dyn FnMut(&Progress, &mut dyn Read) -> Result<(), ReadError>,
) -> Result<(), ReadError> {
    let source: BufReader<Counted<'_>> = counted(open_file(path)?.0, progress);
    let source: Box<dyn Read + '_> = if packing == Packing::Gzip { Box::new(MultiGzDecoder::new(source)) } else { Box::new(source) };
    let mut archive = Archive::new(source);
    for entry in archive.entries()? {
        progress.advance(0)?;
        let mut entry = entry?;
        let is_it = entry.path().is_ok_and(|p| p.file_name().is_some_and(|n| n == name));
        if is_it {
            return take(progress, &mut entry);
        }
    }
    Err(ReadError::Damaged(format!("as an InVesalius project, it holds no {name}")))
}

/// Dictionaries in dictionaries; InVesalius writes three.
const DEEPEST: usize = 16;

/// Texts and numbers by key, nested ones as `outer/inner`, those of a list in turn.
fn plist(text: &str) -> Result<HashMap<String, Vec<String>>, ReadError> {
    let damaged = |e: &dyn std::fmt::Display| ReadError::Damaged(format!("its main.plist is no property list ({e})"));
    let mut reader = Reader::from_str(text);
    let (mut values, mut outer, mut key, mut element) = (HashMap::<String, Vec<String>>::new(), vec![], String::new(), vec![]);
    loop {
        match reader.read_event().map_err(|e| damaged(&e))? {
            Event::Eof => return Ok(values),
            Event::Start(start) => {
                element = start.name().as_ref().to_vec();
                if element == b"dict" {
                    if outer.len() == DEEPEST {
                        return Err(damaged(&"its dictionaries lie in each other without end"));
                    }
                    outer.push(std::mem::take(&mut key));
                }
            }
            Event::End(end) if end.name().as_ref() == b"dict" => key = outer.pop().unwrap_or_default(),
            Event::End(_) => element.clear(),
            Event::Text(value) => {
                let value = value.decode().map_err(|e| damaged(&e))?.into_owned();
                match element.as_slice() {
                    b"key" => key = value,
                    b"string" | b"integer" | b"real" => {
                        let path = outer.iter().chain([&key]).filter(|k| !k.is_empty()).cloned().collect::<Vec<_>>().join("/");
                        values.entry(path).or_default().push(value);
                    }
                    _ => {}
                }
            }
            _ => {}
        }
    }
}
