//! Samples that lie in one stream of bytes: a stretch of a file, or stretches of several files in turn, packed or not.

use super::stretch::{Source, Stretch};
use super::{ReadError, Sink, archive};
use crate::Progress;
use flate2::bufread::{DeflateDecoder, GzDecoder, ZlibDecoder};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// How the bytes of samples are packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Packing {
    /// As they are.
    Plain,
    /// By gzip.
    Gzip,
    /// By zlib.
    Zlib,
    /// By deflate, without a frame.
    Deflate,
}

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

/// Deflate's longest match spends 2 bits on 258 bytes, a ratio of 1032; the rest is for headers. What claims more is no such data.
pub const MOST_EXPANSION: u64 = 1100;

/// What a byte of JPEG 2000 or JPEG-LS unpacks to, at most: OpenJPEG packs 4096² blank samples of 16 bits into 280 bytes, CharLS into 636.
pub const MOST_BLANK: u64 = 1 << 17;

/// Refuses `wanted` bytes that `packed` deflated bytes cannot unpack to.
pub fn check_expansion(wanted: u128, packed: u64) -> Result<(), ReadError> {
    check_expansion_to(wanted, packed, MOST_EXPANSION)
}

/// Refuses `wanted` bytes that `packed` bytes, each unpacked to `most` at most, cannot hold.
pub fn check_expansion_to(wanted: u128, packed: u64, most: u64) -> Result<(), ReadError> {
    if wanted > u128::from(packed) * u128::from(most) {
        return Err(ReadError::CannotHold { wanted, compressed: packed });
    }
    Ok(())
}

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

/// The bytes that are packed in `source`.
pub fn unpacking<'a>(packing: Packing, source: impl BufRead + 'a) -> Box<dyn Read + 'a> {
    match packing {
        Packing::Plain => Box::new(source),
        Packing::Gzip => Box::new(Gzip::new(source)),
        Packing::Zlib => Box::new(ZlibDecoder::new(source)),
        Packing::Deflate => Box::new(DeflateDecoder::new(source)),
    }
}

/// The members of a gzip, one after the other. What follows them and is none, such as zeros up to the end of a tape's block, is no part of it.
struct Gzip<R>(Option<GzDecoder<R>>);

impl<R: BufRead> Gzip<R> {
    fn new(source: R) -> Self {
        Self(Some(GzDecoder::new(source)))
    }
}

impl<R: BufRead> Read for Gzip<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while let Some(member) = &mut self.0 {
            let n = member.read(buffer)?;
            if n > 0 || buffer.is_empty() {
                return Ok(n);
            }
            let mut rest = self.0.take().map(GzDecoder::into_inner);
            // The first byte of gzip's magic.
            let is_more = rest.as_mut().map_or(Ok(false), |rest| Ok::<_, io::Error>(rest.fill_buf()?.first() == Some(&0x1f)))?;
            self.0 = rest.filter(|_| is_more).map(GzDecoder::new);
        }
        Ok(0)
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

/// The length of a regular, not empty file on the disk.
pub fn disk_file(path: &Path) -> Result<u64, ReadError> {
    let metadata = path.metadata()?;
    if metadata.is_dir() {
        return Err(ReadError::Directory);
    }
    if !metadata.is_file() {
        return Err(ReadError::NotRegular);
    }
    if metadata.len() == 0 {
        return Err(ReadError::Empty);
    }
    Ok(metadata.len())
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

/// A source whose bytes count as progress; reading fails when the work should stop.
pub struct Counted<'a> {
    source: Source,
    progress: &'a Progress,
}

/// A buffered reader that counts the bytes of `source`.
pub fn counted(source: Source, progress: &Progress) -> BufReader<Counted<'_>> {
    BufReader::with_capacity(1 << 16, Counted { source, progress })
}

impl Read for Counted<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.source.read(buffer)?;
        self.progress.advance(n as u64).map_err(io::Error::other)?;
        Ok(n)
    }
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
