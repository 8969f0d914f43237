//! Writing: one file, whole or not at all, in the form that its name asks for.

use crate::{Cancelled, Progress, Samples, Volume, replace_file};
use flate2::write::GzEncoder;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use thiserror::Error;

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
    /// A name that says nothing of the form.
    #[error("{}: end the name in one of {forms}, so that its form is known", file.display())]
    UnknownForm {
        /// The file as it was named.
        file: PathBuf,
        /// The endings that are known.
        forms: String,
    },
    /// Stopped by request; nothing was written.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Writes a file beside its place and then moves it there. `progress` counts bytes of samples.
pub fn whole(
    path: &Path,
    volume: &Volume,
    progress: &Progress,
    fill: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<(), WriteError> {
    progress.begin(volume.sample_bytes() as u64);
    let written = replace_file(path, |beside| {
        let mut out = BufWriter::with_capacity(1 << 20, File::create(beside)?);
        fill(&mut out)?;
        out.flush()?;
        out.get_ref().sync_all()
    });
    written.map_err(|error| match error.get_ref().is_some_and(|e| e.is::<Cancelled>()) {
        true => WriteError::Cancelled(Cancelled),
        false => WriteError::Io { file: path.to_owned(), error },
    })
}

/// Writes a header, and the samples after it, the latter or `all` of them by gzip.
pub fn header_and_samples(out: &mut impl Write, header: &[u8], packed: Packed, samples: &Samples, progress: &Progress) -> io::Result<()> {
    if packed != Packed::All {
        out.write_all(header)?;
    }
    if packed == Packed::Nothing {
        return write_samples(out, samples, progress);
    }
    let mut gzip = GzEncoder::new(out, flate2::Compression::default());
    if packed == Packed::All {
        gzip.write_all(header)?;
    }
    write_samples(&mut gzip, samples, progress)?;
    gzip.finish().map(drop)
}

/// What gzip packs.
#[derive(Clone, Copy, PartialEq)]
pub enum Packed {
    /// Nothing.
    Nothing,
    /// The samples behind the header.
    Samples,
    /// Header and samples.
    All,
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

/// Metadata as lines of a text header: a key that could be taken for something else is no key, and no value has a second line.
pub fn lines(volume: &Volume, between: &str, is_taken: impl Fn(&str) -> bool) -> String {
    let usable = |key: &str| !key.is_empty() && !key.contains(['=', ':', '#', '\n', '\r']) && !is_taken(key);
    let one_line = |text: &str| text.replace(['\n', '\r'], " ");
    volume.metadata().iter().filter(|(k, _)| usable(k)).map(|(k, v)| format!("{k}{between}{}\n", one_line(v))).collect()
}
