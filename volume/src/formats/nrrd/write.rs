//! Writing: one attached little-endian file, in LPS and mm. It holds all that a volume has.

use super::super::write::{Packed, WriteError, header_and_samples, lines, whole};
use crate::{Progress, ReadSamples, Unit, Volume};
use std::path::Path;

/// How the samples are packed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compression {
    /// As they are: fast, and readable by everything.
    #[default]
    Raw,
    /// By gzip: slow, smaller.
    Gzip,
}

/// Writes `volume` to `path` with its samples as they are; NRRD holds all that a volume has.
pub fn write_plain(path: &Path, volume: &Volume, progress: &Progress) -> Result<Vec<String>, WriteError> {
    write(path, volume, Compression::Raw, progress).map(|()| vec![])
}

/// Writes `volume` to `path` as NRRD, in LPS and mm. It is written beside and then renamed, so that a file that was there is
/// replaced whole or not at all. `progress` counts bytes of samples.
pub fn write(path: &Path, volume: &Volume, compression: Compression, progress: &Progress) -> Result<(), WriteError> {
    let packed = if compression == Compression::Gzip { Packed::Samples } else { Packed::Nothing };
    let header = header(volume, compression);
    whole(path, volume, progress, |out| header_and_samples(out, header.as_bytes(), packed, volume.samples(), progress))
}

fn header(volume: &Volume, compression: Compression) -> String {
    let kind = match volume.samples().type_name() {
        "u8" => "uint8",
        "i16" => "int16",
        "u16" => "uint16",
        _ => "float",
    };
    let encoding = if compression == Compression::Gzip { "gzip" } else { "raw" };
    let grid = volume.grid();
    let [nx, ny, nz] = grid.dims();
    let m = grid.index_to_world().matrix3;
    let [i, j, k, o] = [m.x_axis, m.y_axis, m.z_axis, grid.origin_mm()].map(|v| format!("({},{},{})", v.x, v.y, v.z));
    let unit = if volume.unit() == Unit::Hounsfield { "HU" } else { "value" };
    let scale = match (volume.slope(), volume.intercept()) {
        (1.0, 0.0) => String::new(),
        (slope, intercept) => format!("slope:={slope}\nintercept:={intercept}\n"),
    };
    let metadata = lines(volume, ":=", |key| ["unit", "slope", "intercept"].contains(&key));
    format!(
        "NRRD0004\ntype: {kind}\ndimension: 3\nspace: left-posterior-superior\nsizes: {nx} {ny} {nz}\n\
         space directions: {i} {j} {k}\nkinds: domain domain domain\nendian: little\nencoding: {encoding}\n\
         space origin: {o}\nunit:={unit}\n{scale}{metadata}\n"
    )
}
