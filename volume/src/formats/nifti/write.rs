//! Writing: one little-endian file in RAS and mm, NIfTI-1 where its float32 and 16 bits hold the geometry, else NIfTI-2.

use super::super::write::{Packed, WriteError, header_and_samples, whole};
use crate::{Progress, Unit, Volume};
use glam::DVec3;
use std::path::Path;

/// Geometry is kept to a nanometre.
const EXACT_MM: f64 = 1e-6;
/// Bytes of the description.
const DESCRIPTION: usize = 80;

/// Writes `volume` to `path`, header and all by gzip if `gzip`. Gives sentences about what NIfTI has no place for.
pub fn write(path: &Path, volume: &Volume, gzip: bool, progress: &Progress) -> Result<Vec<String>, WriteError> {
    let packed = if gzip { Packed::All } else { Packed::Nothing };
    let header = header(volume);
    whole(path, volume, progress, |out| header_and_samples(out, &header, packed, volume.samples(), progress))?;
    let lost: Vec<&str> = volume.metadata().keys().map(String::as_str).filter(|k| *k != "description").collect();
    Ok(if lost.is_empty() { vec![] } else { vec![format!("NIfTI has no place for {}", lost.join(", "))] })
}

fn header(volume: &Volume) -> Vec<u8> {
    let grid = volume.grid();
    let dims = grid.dims();
    let map = grid.index_to_world();
    let rows: Vec<f64> = (0..3)
        .flat_map(|r| {
            // LPS to RAS.
            let sign = if r < 2 { -1.0 } else { 1.0 };
            (0..4).map(move |c| sign * if c < 3 { map.matrix3.col(c)[r] } else { map.translation[r] })
        })
        .collect();
    let spacing = grid.spacing_mm();
    let scale = [volume.slope(), volume.intercept()];
    let far = (DVec3::from(dims.map(|n| n as f64))).max_element();
    // An error of a step adds up along an axis.
    let exact = rows.iter().all(|v| (f64::from(*v as f32) - v).abs() * far <= EXACT_MM) || rows.iter().all(|v| f64::from(*v as f32) == *v);
    let is_wide = !exact || scale.iter().any(|v| f64::from(*v as f32) != *v) || dims.iter().any(|&n| n > i16::MAX as usize);
    let (code, bits) = match volume.samples().type_name() {
        "u8" => (2_i16, 8_i16),
        "i16" => (4, 16),
        "u16" => (512, 16),
        _ => (16, 32),
    };
    let mut bytes = vec![0; if is_wide { 544 } else { 352 }];
    let mut put = |at: usize, field: &[u8]| bytes[at..at + field.len()].copy_from_slice(field);
    let sizes: Vec<i64> = [3].into_iter().chain(dims.map(|n| n as i64)).chain([1; 4]).collect();
    let pixdim = [1.0, spacing.x, spacing.y, spacing.z];
    // The unit of values has no field; the name of what they mean is the nearest.
    let unit: &[u8] = if volume.unit() == Unit::Hounsfield { b"HU" } else { b"value" };
    let description = volume.metadata().get("description").map_or("", String::as_str).as_bytes();
    let description = &description[..description.len().min(DESCRIPTION - 1)];
    if is_wide {
        put(0, &540_i32.to_le_bytes());
        put(4, b"n+2\0\r\n\x1a\n");
        put(12, &code.to_le_bytes());
        put(14, &bits.to_le_bytes());
        sizes.iter().enumerate().for_each(|(n, v)| put(16 + 8 * n, &v.to_le_bytes()));
        pixdim.iter().enumerate().for_each(|(n, v)| put(104 + 8 * n, &v.to_le_bytes()));
        put(168, &544_i64.to_le_bytes());
        scale.iter().enumerate().for_each(|(n, v)| put(176 + 8 * n, &v.to_le_bytes()));
        put(240, description);
        put(348, &1_i32.to_le_bytes());
        rows.iter().enumerate().for_each(|(n, v)| put(400 + 8 * n, &v.to_le_bytes()));
        put(500, &2_i32.to_le_bytes());
        put(508, unit);
    } else {
        put(0, &348_i32.to_le_bytes());
        sizes.iter().enumerate().for_each(|(n, v)| put(40 + 2 * n, &(*v as i16).to_le_bytes()));
        put(70, &code.to_le_bytes());
        put(72, &bits.to_le_bytes());
        pixdim.iter().enumerate().for_each(|(n, v)| put(76 + 4 * n, &(*v as f32).to_le_bytes()));
        put(108, &352_f32.to_le_bytes());
        scale.iter().enumerate().for_each(|(n, v)| put(112 + 4 * n, &(*v as f32).to_le_bytes()));
        put(123, &[2]);
        put(148, description);
        put(254, &1_i16.to_le_bytes());
        rows.iter().enumerate().for_each(|(n, v)| put(280 + 4 * n, &(*v as f32).to_le_bytes()));
        put(328, unit);
        put(344, b"n+1\0");
    }
    bytes
}
