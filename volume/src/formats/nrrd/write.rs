//! Writing: one attached little-endian file, whole or not at all.

use crate::{Cancelled, Progress, Samples, Unit, Volume, replace_file};
use flate2::write::GzEncoder;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// How the samples are packed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compression {
    /// As they are: fast, and readable by everything.
    #[default]
    Raw,
    /// By gzip: slow, smaller.
    Gzip,
}

/// A file that could not be written, and why.
#[derive(Debug, Error)]
pub enum WriteError {
    /// The operating system refused.
    #[error("{}: it cannot be written: {error}; check the folder, its rights and the free space", file.display())]
    Io {
        /// The file as it was named.
        file: PathBuf,
        /// What the operating system says.
        error: io::Error,
    },
    /// Stopped by request; nothing was written.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Writes `volume` to `path` as NRRD, in LPS and mm. It is written beside and then renamed, so that a file that was there is
/// replaced whole or not at all. `progress` counts bytes of samples.
pub fn write(path: &Path, volume: &Volume, compression: Compression, progress: &Progress) -> Result<(), WriteError> {
    progress.begin(volume.samples().bytes() as u64);
    let written = replace_file(path, |beside| write_to(beside, volume, compression, progress));
    written.map_err(|error| match error.get_ref().is_some_and(|e| e.is::<Cancelled>()) {
        true => WriteError::Cancelled(Cancelled),
        false => WriteError::Io { file: path.to_owned(), error },
    })
}

fn write_to(path: &Path, volume: &Volume, compression: Compression, progress: &Progress) -> io::Result<()> {
    let file = File::create(path)?;
    let mut out = BufWriter::with_capacity(1 << 20, file);
    out.write_all(header(volume, compression).as_bytes())?;
    let mut out = match compression {
        Compression::Raw => {
            write_samples(&mut out, volume.samples(), progress)?;
            out
        }
        Compression::Gzip => {
            let mut gzip = GzEncoder::new(out, flate2::Compression::default());
            write_samples(&mut gzip, volume.samples(), progress)?;
            gzip.finish()?
        }
    };
    out.flush()?;
    out.get_ref().sync_all()
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
    format!(
        "NRRD0004\ntype: {kind}\ndimension: 3\nspace: left-posterior-superior\nsizes: {nx} {ny} {nz}\n\
         space directions: {i} {j} {k}\nkinds: domain domain domain\nendian: little\nencoding: {encoding}\n\
         space origin: {o}\nunit:={unit}\n{scale}\n"
    )
}

fn write_samples(out: &mut impl Write, samples: &Samples, progress: &Progress) -> io::Result<()> {
    match samples {
        Samples::U8(s) => write_chunks(out, s, u8::to_le_bytes, progress),
        Samples::I16(s) => write_chunks(out, s, i16::to_le_bytes, progress),
        Samples::U16(s) => write_chunks(out, s, u16::to_le_bytes, progress),
        Samples::F32(s) => write_chunks(out, s, f32::to_le_bytes, progress),
    }
}

fn write_chunks<T: Copy, const N: usize>(
    out: &mut impl Write,
    samples: &[T],
    to_bytes: impl Fn(T) -> [u8; N],
    progress: &Progress,
) -> io::Result<()> {
    let mut bytes = vec![];
    for part in samples.chunks(1 << 18) {
        bytes.clear();
        bytes.extend(part.iter().flat_map(|&s| to_bytes(s)));
        out.write_all(&bytes)?;
        progress.advance(bytes.len() as u64).map_err(io::Error::other)?;
    }
    Ok(())
}
