//! Bytes of a file into typed samples, a mebibyte at a time.

use super::ReadError;
use crate::{Progress, Sample, Samples};
use flate2::bufread::MultiGzDecoder;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

/// The type of a sample as the file stores it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum SampleType {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl SampleType {
    /// Bytes of one sample.
    pub fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }
}

/// How the samples lie in a file.
#[derive(Clone, Copy, Debug)]
pub struct Encoding {
    /// Type of a sample.
    pub sample: SampleType,
    /// Most significant byte first.
    pub big_endian: bool,
    /// Compressed by gzip.
    pub gzip: bool,
}

impl Encoding {
    /// Refuses at once what `there` bytes of a file cannot hold: `skip` bytes, then `count` samples.
    pub fn check(&self, count: usize, skip: u64, there: u64) -> Result<(), ReadError> {
        // Deflate's longest match spends 2 bits on 258 bytes, a ratio of 1032; the rest is for headers.
        const MOST_EXPANSION: u128 = 1100;
        let wanted = count as u128 * self.sample.bytes() as u128;
        let all = wanted + u128::from(skip);
        if self.gzip && all > u128::from(there) * MOST_EXPANSION {
            return Err(ReadError::CannotHold { wanted: all, compressed: there });
        }
        if !self.gzip && all > u128::from(there) {
            return Err(ReadError::Truncated { wanted, there: there.saturating_sub(skip) });
        }
        Ok(())
    }
}

/// A regular, not empty file and its length in bytes. Folders, pipes and devices are refused without opening them.
pub fn open_file(path: &Path) -> Result<(File, u64), ReadError> {
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
    Ok((File::open(path)?, metadata.len()))
}

/// A file whose bytes count as progress; reading fails when the work should stop.
pub struct Counted<'a> {
    file: File,
    progress: &'a Progress,
}

/// A buffered reader that counts the bytes of `file`.
pub fn counted(file: File, progress: &Progress) -> BufReader<Counted<'_>> {
    BufReader::with_capacity(1 << 16, Counted { file, progress })
}

impl Read for Counted<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.file.read(buffer)?;
        self.progress.advance(n as u64).map_err(io::Error::other)?;
        Ok(n)
    }
}

/// Collects samples from one or more files.
///
/// u8, i16, u16 and f32 are kept and i8 becomes i16. Wider integers become i16 or u16 when all of them fit; otherwise they,
/// and f64, become f32, and [`Decoder::finish`] says what that rounded.
pub struct Decoder<'a> {
    encoding: Encoding,
    total: usize,
    samples: Samples,
    rounded: usize,
    worst: f64,
    progress: &'a Progress,
}

impl<'a> Decoder<'a> {
    /// Will collect `total` samples from files of `file_bytes` bytes together. Memory is reserved for what these bytes vouch
    /// for, which is everything where nothing is compressed, and grows as samples arrive.
    pub fn new(encoding: Encoding, total: usize, file_bytes: u64, progress: &'a Progress) -> Result<Self, ReadError> {
        let samples = match encoding.sample {
            SampleType::U8 => Samples::U8(vec![]),
            SampleType::U16 => Samples::U16(vec![]),
            SampleType::F32 | SampleType::F64 => Samples::F32(vec![]),
            _ => Samples::I16(vec![]),
        };
        let mut decoder = Self { encoding, total, samples, rounded: 0, worst: 0.0, progress };
        let vouched = file_bytes / encoding.sample.bytes() as u64;
        decoder.reserve(usize::try_from(vouched).map_or(total, |n| n.min(total)))?;
        Ok(decoder)
    }

    /// Skips `skip` bytes of `source` (after decompression) and takes the next `count` samples. True when more bytes follow.
    pub fn fill(&mut self, source: impl BufRead, skip: u64, count: usize) -> Result<bool, ReadError> {
        if self.encoding.gzip { self.fill_plain(MultiGzDecoder::new(source), skip, count) } else { self.fill_plain(source, skip, count) }
    }

    fn fill_plain(&mut self, mut source: impl Read, skip: u64, count: usize) -> Result<bool, ReadError> {
        const CHUNK: usize = 1 << 20;
        let size = self.encoding.sample.bytes();
        let mut buffer = vec![0_u8; CHUNK];
        let wanted = count as u128 * size as u128;
        let mut skipped = 0;
        while skipped < skip {
            let part = usize::try_from(skip - skipped).map_or(CHUNK, |n| n.min(CHUNK));
            let n = read_all(&mut source, &mut buffer[..part])?;
            if n < part {
                return Err(ReadError::Truncated { wanted, there: 0 });
            }
            skipped += n as u64;
            self.progress.advance(0)?;
        }
        let mut left = count;
        while left > 0 {
            let part = left.min(CHUNK / size);
            let n = read_all(&mut source, &mut buffer[..part * size])?;
            if n < part * size {
                let there = ((count - left) * size + n) as u64;
                return Err(ReadError::Truncated { wanted, there });
            }
            self.push(&buffer[..n])?;
            left -= part;
            self.progress.advance(0)?;
        }
        // At the end of gzip data this also compares its checksum.
        Ok(source.read(&mut [0])? > 0)
    }

    /// The samples; a sentence is added to `warnings` when some had to be rounded.
    pub fn finish(self, warnings: &mut Vec<String>) -> Samples {
        if self.rounded > 0 {
            let (n, worst) = (self.rounded, self.worst);
            warnings.push(format!("{n} samples do not fit float32 exactly and are rounded, by at most {worst:.1e}"));
        }
        self.samples
    }

    /// Makes room for `extra` samples; at least doubles what there was, but never beyond the total.
    fn reserve(&mut self, extra: usize) -> Result<(), ReadError> {
        crate::with_samples!(&mut self.samples, s => {
            if s.capacity() - s.len() < extra {
                let grown = extra.max(s.len()).min(self.total.saturating_sub(s.len()).max(extra));
                s.try_reserve_exact(grown)?;
            }
        });
        Ok(())
    }

    fn push(&mut self, bytes: &[u8]) -> Result<(), ReadError> {
        self.reserve(bytes.len() / self.encoding.sample.bytes())?;
        let big = self.encoding.big_endian;
        match (self.encoding.sample, &mut self.samples) {
            (SampleType::U8, Samples::U8(s)) => s.extend_from_slice(bytes),
            (SampleType::I8, Samples::I16(s)) => s.extend(bytes.iter().map(|&b| i16::from(b as i8))),
            (SampleType::I16, Samples::I16(s)) => s.extend(i16s(bytes, big)),
            (SampleType::U16, Samples::U16(s)) => s.extend(u16s(bytes, big)),
            (SampleType::F32, Samples::F32(s)) => s.extend(f32s(bytes, big)),
            (SampleType::F64, _) => f64s(bytes, big).for_each(|v| self.push_float(v as f32, f64::from(v as f32) - v)),
            (SampleType::I32, _) => i32s(bytes, big).for_each(|v| self.push_wide(v.into())),
            (SampleType::U32, _) => u32s(bytes, big).for_each(|v| self.push_wide(v.into())),
            (SampleType::I64, _) => i64s(bytes, big).for_each(|v| self.push_wide(v.into())),
            (SampleType::U64, _) => u64s(bytes, big).for_each(|v| self.push_wide(v.into())),
            _ => unreachable!("`new` chose the samples for this type"),
        }
        Ok(())
    }

    /// Adds an integer in the narrowest of i16, u16 and f32 that has held all so far.
    fn push_wide(&mut self, value: i128) {
        let fits = match &mut self.samples {
            Samples::I16(s) => i16::try_from(value).map(|v| s.push(v)).is_ok(),
            Samples::U16(s) => u16::try_from(value).map(|v| s.push(v)).is_ok(),
            _ => return self.push_float(value as f32, ((value as f32) as i128 - value) as f64),
        };
        if !fits {
            self.samples = match &self.samples {
                Samples::I16(s) if u16::try_from(value).is_ok() && s.iter().all(|&v| v >= 0) => {
                    Samples::U16(s.iter().map(|&v| v as u16).collect())
                }
                samples => crate::with_samples!(samples, s => Samples::F32(s.iter().map(|&v| v.to_f32()).collect())),
            };
            self.push_wide(value);
        }
    }

    /// Adds `kept`, which is `error` away from the number in the file (NaN for what is no number anyway).
    fn push_float(&mut self, kept: f32, error: f64) {
        if let Samples::F32(s) = &mut self.samples {
            s.push(kept);
        }
        if error.abs() > 0.0 {
            self.rounded += 1;
            self.worst = self.worst.max(error.abs());
        }
    }
}

/// Reads until `buffer` is full or the source ends; how many bytes there were.
fn read_all(source: &mut impl Read, buffer: &mut [u8]) -> Result<usize, ReadError> {
    let mut n = 0;
    while n < buffer.len() {
        match source.read(&mut buffer[n..]) {
            Ok(0) => break,
            Ok(more) => n += more,
            Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
            // Gzip data that breaks off.
            Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => break,
            Err(e) => return Err(e.into()),
        }
    }
    Ok(n)
}

macro_rules! numbers {
    ($($name:ident: $t:ty),*) => {$(
        fn $name(bytes: &[u8], big_endian: bool) -> impl Iterator<Item = $t> + '_ {
            bytes.as_chunks().0.iter().map(move |&b| if big_endian { <$t>::from_be_bytes(b) } else { <$t>::from_le_bytes(b) })
        }
    )*};
}
numbers!(i16s: i16, u16s: u16, i32s: i32, u32s: u32, i64s: i64, u64s: u64, f32s: f32, f64s: f64);
