//! Samples that lie in one stream of bytes: a stretch of a file, or stretches of several files in turn, packed or not.

use super::packing::{Packing, check_expansion, counted, unpacking};
use super::stretch::{Source, Stretch, disk_file};
use super::{ReadError, Sink, archive};
use crate::Progress;
use std::io::{self, BufRead, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// A stretch of samples in a file.
#[derive(Clone, Debug)]
pub struct Part {
    /// The file.
    pub file: PathBuf,
    /// It lies beside the file that was opened, so messages name it.
    pub beside: bool,
    /// Bytes before anything.
    pub start: u64,
    /// Lines after that.
    pub lines: u64,
    /// How the rest is packed.
    pub packing: Packing,
    /// Bytes to skip once unpacked.
    pub skip: u64,
    /// Bytes of samples.
    pub bytes: u64,
}

/// The sentence about bytes that follow the samples.
pub const MORE_BYTES: &str = "the file goes on after the samples that its header asks for; the rest is ignored";

/// Refuses at once what `there` bytes cannot hold: `skip` bytes, then `wanted`.
pub fn check_length(packing: Packing, wanted: u128, skip: u64, there: u64) -> Result<(), ReadError> {
    let all = wanted + u128::from(skip);
    match packing {
        Packing::Plain if all > u128::from(there) => Err(ReadError::Truncated { wanted, there: there.saturating_sub(skip) }),
        Packing::Plain => Ok(()),
        _ => check_expansion(all, there),
    }
}

impl Part {
    /// The whole of `file` from `start` on, `there` bytes long; refused when it cannot hold `wanted` bytes of samples.
    pub fn checked(file: &Path, packing: Packing, start: u64, skip: u64, wanted: u128, there: u64) -> Result<Self, ReadError> {
        check_length(packing, wanted, skip, there.saturating_sub(start))?;
        // What a file on a disk can hold fits 64 bits.
        let bytes = wanted as u64;
        Ok(Self { file: file.to_owned(), beside: false, start, lines: 0, packing, skip, bytes })
    }

    /// Passes the samples on. True when more bytes follow them.
    fn stream(&self, progress: &Progress, take: &mut Sink<'_>) -> Result<bool, ReadError> {
        let (mut file, there) = open_file(&self.file)?;
        file.seek(SeekFrom::Start(self.start))?;
        let mut source = counted(file, progress);
        let mut before = self.start;
        for _ in 0..self.lines {
            match source.skip_until(b'\n')? {
                0 => break,
                n => before += n as u64,
            }
        }
        check_length(self.packing, self.bytes.into(), self.skip, there.saturating_sub(before))?;
        match self.packing {
            Packing::Plain => self.pass(source, progress, take),
            packing => self.pass(unpacking(packing, source), progress, take),
        }
    }

    fn pass(&self, mut source: impl Read, progress: &Progress, take: &mut Sink<'_>) -> Result<bool, ReadError> {
        pass(&mut source, self.skip, progress, &mut |_| Ok(())).map_err(|e| match e {
            ReadError::Truncated { .. } => ReadError::Truncated { wanted: self.bytes.into(), there: 0 },
            e => e,
        })?;
        pass(&mut source, self.bytes, progress, take)?;
        // At the end of packed data this also compares its checksum.
        Ok(source.read(&mut [0])? > 0)
    }
}

/// Passes `bytes` bytes of `source` on, in pieces of at most a mebibyte that hold whole samples.
pub fn pass(source: &mut impl Read, bytes: u64, progress: &Progress, take: &mut Sink<'_>) -> Result<(), ReadError> {
    const CHUNK: u64 = 1 << 20;
    let mut buffer = vec![0_u8; bytes.min(CHUNK) as usize];
    let mut done = 0;
    while done < bytes {
        let part = &mut buffer[..(bytes - done).min(CHUNK) as usize];
        let n = read_all(source, part)?;
        if n < part.len() {
            return Err(ReadError::Truncated { wanted: bytes.into(), there: done + n as u64 });
        }
        take(part)?;
        done += n as u64;
        progress.advance(0)?;
    }
    Ok(())
}

/// Passes the samples of all parts on; gives warnings.
pub fn stream_all(parts: &[Part], progress: &Progress, take: &mut Sink<'_>) -> Result<Vec<String>, ReadError> {
    let mut more = false;
    for part in parts {
        let streamed = part.stream(progress, take);
        more |= if part.beside { streamed.map_err(|e| in_file(&part.file, e))? } else { streamed? };
    }
    Ok(if more { vec![MORE_BYTES.into()] } else { vec![] })
}

/// The error `reason` of a file beside the one that was opened.
pub fn in_file(file: &Path, reason: ReadError) -> ReadError {
    match reason {
        ReadError::Cancelled(c) => ReadError::Cancelled(c),
        reason => ReadError::DataFile { file: file.to_owned(), reason: Box::new(reason) },
    }
}

/// A regular, not empty file, on the disk or inside of an archive, and its length in bytes. Folders, pipes and devices are refused without
/// opening them.
pub fn open_file(path: &Path) -> Result<(Source, u64), ReadError> {
    let progress = Progress::default();
    let stretch = match if path.exists() { None } else { archive::member(path, &progress)? } {
        Some(entry) => entry.unpacked(&progress)?,
        None => Stretch::file(path, disk_file(path)?),
    };
    Ok((stretch.open()?, stretch.bytes))
}

/// The first bytes of a file, on the disk or inside of an archive, at most `most` of them, and its length.
pub fn head_of(path: &Path, most: u64) -> Result<(Vec<u8>, u64), ReadError> {
    let progress = Progress::default();
    // What is packed need not be unpacked as a whole for that.
    if let Some(entry) = if path.exists() { None } else { archive::member(path, &progress)? } {
        return Ok((entry.head(most, &progress)?, entry.bytes));
    }
    let (file, there) = open_file(path)?;
    let mut head = vec![];
    file.take(most).read_to_end(&mut head)?;
    Ok((head, there))
}

/// Reads until `buffer` is full or the source ends; how many bytes there were.
pub fn read_all(source: &mut impl Read, buffer: &mut [u8]) -> Result<usize, ReadError> {
    let mut n = 0;
    while n < buffer.len() {
        match source.read(&mut buffer[n..]) {
            Ok(0) => break,
            Ok(more) => n += more,
            Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
            // Packed data that breaks off.
            Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => break,
            Err(e) => return Err(e.into()),
        }
    }
    Ok(n)
}
