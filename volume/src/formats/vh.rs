//! `.vh`, the text headers of the 2008 volume renderer: the size, the extent of a voxel and the bits of a number, with the samples beside.
//!
//! Its thesis says what is in them but not how they are written, so the numbers are taken in that order, whatever stands between them,
//! and checked against the length of the samples.

use super::decode::{Encoding, SampleType};
use super::packing::Packing;
use super::part::{Part, head_of, in_file, open_file};
use super::{Format, Hints, NO_DIRECTIONS, ReadError, Scan, Storage, archive, bad};
use crate::{Grid, Progress};
use glam::{DMat3, DVec3};
use std::path::Path;

/// The row of the formats.
pub const FORMAT: Format = Format { name: "VH", sniff, scan, write: None };

/// A few lines.
const MOST_BYTES: u64 = 1 << 14;

fn sniff(path: &Path, head: &[u8], _progress: &Progress) -> bool {
    !head.is_empty() && path.extension().is_some_and(|e| e.eq_ignore_ascii_case("vh"))
}

/// The numbers in `text`, sizes first. Commas stand between numbers, or in them where that makes six or seven; bits may stand first.
fn numbers(text: &str) -> Vec<f64> {
    let split = |marks: &'static str| text.split(move |c: char| c.is_whitespace() || marks.contains(c));
    let between: Vec<f64> = split(",;:=()[]{}\"").filter_map(|w| w.parse().ok()).collect();
    let within: Vec<f64> = split(";:=()[]{}\"").filter_map(|w| super::text::decimal(w.trim_matches(','))).collect();
    let is_whole = |numbers: &[f64]| (6..=7).contains(&numbers.len());
    let mut numbers = if !is_whole(&between) && is_whole(&within) { within } else { between };
    let are_bits = |n: &f64| [8.0, 12.0, 16.0].contains(n);
    if numbers.len() == 7 && are_bits(&numbers[0]) && !are_bits(&numbers[6]) {
        numbers.rotate_left(1);
    }
    numbers
}

fn scan(path: &Path, _hints: &Hints, _progress: &Progress) -> Result<Scan, ReadError> {
    let text = String::from_utf8_lossy(&head_of(path, MOST_BYTES)?.0).into_owned();
    let words = || text.split(|c: char| c.is_whitespace() || ",;:=()[]{}\"".contains(c)).filter(|w| !w.is_empty());
    let numbers = numbers(&text);
    let wrong = |problem: &str| bad("text", text.trim().chars().take(200).collect::<String>(), problem);
    let [nx, ny, nz, dx, dy, dz, rest @ ..] = numbers.as_slice() else {
        return Err(wrong("it must hold three sizes, three extents of a voxel in mm and the bits of a sample"));
    };
    let sizes = [*nx, *ny, *nz];
    if sizes.iter().any(|n| n.fract() != 0.0 || *n < 1.0 || *n > 1e6) {
        return Err(wrong("its first three numbers must be whole sizes"));
    }
    let grid = Grid::new(sizes.map(|n| n as usize), DVec3::new(*dx, *dy, *dz), DVec3::ZERO, DMat3::IDENTITY)?;
    // The file that the header names, or one of the same name.
    let folder = path.parent().unwrap_or(Path::new(""));
    let same = ["raw", "vol", "dat", "bin", "RAW"].map(|ext| path.with_extension(ext));
    let named = words().map(|w| folder.join(w)).find(|p| archive::is_file(p) && p != path);
    let file = named.or_else(|| same.into_iter().find(|p| archive::is_file(p))).unwrap_or(path.with_extension("raw"));
    let there = open_file(&file).map_err(|e| in_file(&file, e))?.1;
    let count = grid.len() as u64;
    let sample = match rest.first().map(|bits| *bits as i64) {
        Some(8) => SampleType::U8,
        Some(16 | 12) => SampleType::U16,
        None if there == count => SampleType::U8,
        None if there == 2 * count => SampleType::U16,
        _ => return Err(wrong("its seventh number must be the bits of a sample, 8 or 16")),
    };
    let part =
        Part::checked(&file, Packing::Plain, 0, 0, u128::from(count) * sample.bytes() as u128, there).map_err(|e| in_file(&file, e))?;
    let [i, j, k] = grid.dims();
    let kind = format!("{sample:?}").to_lowercase();
    let warnings = vec![format!("its header is taken to say {i}×{j}×{k} {kind}, {dx} × {dy} × {dz} mm a voxel"), NO_DIRECTIONS.into()];
    let scan = Scan::new(grid, Encoding { sample, big_endian: false }, there, Storage::Parts(vec![Part { beside: true, ..part }]));
    Ok(Scan { warnings, ..scan })
}

#[cfg(test)]
mod tests {
    use super::numbers;

    #[test]
    fn numbers_are_found_however_they_stand() {
        // Fails if a decimal comma splits an extent, or if bits that stand first are taken for a size.
        let want = [8.0, 6.0, 4.0, 0.5, 0.75, 2.0, 16.0];
        for text in [
            "size 8 6 4\nextent 0.5 0.75 2\nbits 16\n",
            "8,6,4,0.5,0.75,2,16",
            "8 6 4 0,5 0,75 2 16",
            "bits=16 size=(8, 6, 4) 0,5; 0,75; 2,0",
            "16 8 6 4 0.5 0.75 2",
        ] {
            assert_eq!(numbers(text), want, "{text}");
        }
    }
}
