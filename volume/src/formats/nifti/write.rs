//! Writing: one little-endian NIfTI-1 file in RAS and mm, or NIfTI-2 where a side is longer than 16 bits hold. Float32 rounds geometry, and
//! there is no place for metadata: both are whole in a comment (NIfTI's extension of code 6), which other programs pass over.

use super::super::write::{Packed, WriteError, header_and_samples, lines, whole};
use super::{COMMENT, INTERCEPT, SLOPE, TO_WORLD};
use crate::{Progress, ReadSamples, Unit, Volume};
use std::path::Path;

/// Bytes of the description.
const DESCRIPTION: usize = 80;

/// Writes `volume` to `path`, header and all by gzip if its name ends so. Gives sentences about what NIfTI has no place for.
pub fn write(path: &Path, volume: &Volume, progress: &Progress) -> Result<Vec<String>, WriteError> {
    let packed = if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz")) { Packed::All } else { Packed::Nothing };
    let is_wide = volume.grid().dims().iter().any(|&n| n > i16::MAX as usize);
    let header = header(volume, is_wide);
    whole(path, volume, progress, |out| header_and_samples(out, &header, packed, volume.samples(), progress))?;
    let rounded = !is_wide && rows(volume).iter().any(|v| f64::from(*v as f32) != *v);
    let mut said = vec![];
    if rounded {
        said.push("NIfTI rounds the geometry to float32; it is exact in a comment that only this program reads".into());
    }
    let lost: Vec<&str> = volume.metadata().keys().map(String::as_str).filter(|k| *k != "description").collect();
    if !lost.is_empty() {
        said.push(format!("NIfTI has no place for {}; they are in a comment that only this program reads", lost.join(", ")));
    }
    Ok(said)
}

/// Index to RAS mm, three rows of four.
fn rows(volume: &Volume) -> [f64; 12] {
    let map = volume.grid().index_to_world();
    std::array::from_fn(|n| {
        let (r, c) = (n / 4, n % 4);
        let sign = if r < 2 { -1.0 } else { 1.0 };
        sign * if c < 3 { map.matrix3.col(c)[r] } else { map.translation[r] }
    })
}

fn comment(volume: &Volume) -> Vec<u8> {
    let map = volume.grid().index_to_world().to_cols_array().map(|v| v.to_string()).join(" ");
    let metadata = lines(volume, "=", |key| [TO_WORLD, SLOPE, INTERCEPT, "description"].contains(&key));
    let (slope, intercept) = (volume.slope(), volume.intercept());
    let text = format!("{COMMENT}\n{TO_WORLD}={map}\n{SLOPE}={slope}\n{INTERCEPT}={intercept}\n{metadata}");
    // Size and code, then the text, to a multiple of 16.
    let size = (8 + text.len()).next_multiple_of(16);
    let mut bytes = [(size as i32).to_le_bytes(), 6_i32.to_le_bytes()].concat();
    bytes.extend(text.bytes());
    bytes.resize(size, 0);
    bytes
}

fn header(volume: &Volume, is_wide: bool) -> Vec<u8> {
    let spacing = volume.grid().spacing_mm();
    let (rows, comment) = (rows(volume), comment(volume));
    let scale = [volume.slope(), volume.intercept()];
    let (code, bits) = match volume.samples().type_name() {
        "u8" => (2_i16, 8_i16),
        "i16" => (4, 16),
        "u16" => (512, 16),
        _ => (16, 32),
    };
    let size = if is_wide { 540 } else { 348 };
    let mut bytes = vec![0; size + 4];
    let mut put = |at: usize, field: &[u8]| bytes[at..at + field.len()].copy_from_slice(field);
    let sizes: Vec<i64> = [3].into_iter().chain(volume.grid().dims().map(|n| n as i64)).chain([1; 4]).collect();
    let pixdim = [1.0, spacing.x, spacing.y, spacing.z];
    let offset = size + 4 + comment.len();
    // The unit of values has no field; the name of what they mean is the nearest.
    let unit: &[u8] = if volume.unit() == Unit::Hounsfield { b"HU" } else { b"value" };
    let description = volume.metadata().get("description").map_or("", String::as_str).as_bytes();
    let description = &description[..description.len().min(DESCRIPTION - 1)];
    put(0, &(size as i32).to_le_bytes());
    // Extensions follow.
    put(size, &[1]);
    if is_wide {
        put(4, b"n+2\0\r\n\x1a\n");
        put(12, &code.to_le_bytes());
        put(14, &bits.to_le_bytes());
        sizes.iter().enumerate().for_each(|(n, v)| put(16 + 8 * n, &v.to_le_bytes()));
        pixdim.iter().enumerate().for_each(|(n, v)| put(104 + 8 * n, &v.to_le_bytes()));
        put(168, &(offset as i64).to_le_bytes());
        scale.iter().enumerate().for_each(|(n, v)| put(176 + 8 * n, &v.to_le_bytes()));
        put(240, description);
        put(348, &1_i32.to_le_bytes());
        rows.iter().enumerate().for_each(|(n, v)| put(400 + 8 * n, &v.to_le_bytes()));
        put(500, &2_i32.to_le_bytes());
        put(508, unit);
    } else {
        sizes.iter().enumerate().for_each(|(n, v)| put(40 + 2 * n, &(*v as i16).to_le_bytes()));
        put(70, &code.to_le_bytes());
        put(72, &bits.to_le_bytes());
        pixdim.iter().enumerate().for_each(|(n, v)| put(76 + 4 * n, &(*v as f32).to_le_bytes()));
        put(108, &(offset as f32).to_le_bytes());
        scale.iter().enumerate().for_each(|(n, v)| put(112 + 4 * n, &(*v as f32).to_le_bytes()));
        put(123, &[2]);
        put(148, description);
        put(254, &1_i16.to_le_bytes());
        rows.iter().enumerate().for_each(|(n, v)| put(280 + 4 * n, &(*v as f32).to_le_bytes()));
        put(328, unit);
        put(344, b"n+1\0");
    }
    [bytes, comment].concat()
}
