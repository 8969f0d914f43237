//! Writing: one little-endian file, header and samples, in LPS and mm. It holds all that a volume has.

use super::super::write::{Packed, WriteError, header_and_samples, lines, whole};
use super::{KNOWN, UNIT};
use crate::{Progress, ReadSamples, Unit, Volume};
use std::path::Path;

/// Writes `volume` to `path`; there is nothing that MetaImage has no place for.
pub fn write(path: &Path, volume: &Volume, progress: &Progress) -> Result<Vec<String>, WriteError> {
    let header = header(volume);
    whole(path, volume, progress, |out| header_and_samples(out, header.as_bytes(), Packed::Nothing, volume.samples(), progress))?;
    Ok(vec![])
}

fn header(volume: &Volume) -> String {
    let kind = match volume.samples().type_name() {
        "u8" => "MET_UCHAR",
        "i16" => "MET_SHORT",
        "u16" => "MET_USHORT",
        _ => "MET_FLOAT",
    };
    let grid = volume.grid();
    let list = |numbers: &[f64]| numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
    let [nx, ny, nz] = grid.dims();
    let unit = if volume.unit() == Unit::Hounsfield { "HU" } else { "value" };
    let scale = match (volume.slope(), volume.intercept()) {
        (1.0, 0.0) => String::new(),
        (slope, intercept) => {
            format!("ElementToIntensityFunctionSlope = {slope}\nElementToIntensityFunctionOffset = {intercept}\n")
        }
    };
    let metadata = lines(volume, " = ", |key| KNOWN.contains(&key) || key == UNIT);
    format!(
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n\
         TransformMatrix = {}\nOffset = {}\nCenterOfRotation = 0 0 0\nAnatomicalOrientation = RAI\nElementSpacing = {}\n\
         DimSize = {nx} {ny} {nz}\n{UNIT} = {unit}\n{scale}{metadata}ElementType = {kind}\nElementDataFile = LOCAL\n",
        list(&grid.direction().to_cols_array()),
        list(&grid.origin_mm().to_array()),
        list(&grid.spacing_mm().to_array()),
    )
}
