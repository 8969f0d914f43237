//! The pages of a TIFF: where their directories are, and the values in them that the decoder does not give.

use super::super::ReadError;
use crate::Progress;
use std::collections::HashSet;
use std::io::{self, Read, Seek, SeekFrom};

/// The directories of a file.
#[derive(Debug)]
pub struct Directories {
    /// Most significant byte first.
    pub big_endian: bool,
    is_big: bool,
    /// One for each page; at least one.
    pub pages: Vec<Directory>,
}

/// A page.
#[derive(Clone, Copy, Debug, Default)]
pub struct Directory {
    /// Its first byte.
    pub at: u64,
    /// Place and length of its description, a text of any bytes.
    description: Option<(u64, u64)>,
    /// Place of its palette, and number of values in it.
    palette: Option<(u64, u64)>,
    /// Place of the number that says what its samples mean, where that is a palette.
    paletted: Option<u64>,
}

/// Tags that are looked at here.
const PHOTOMETRIC: u64 = 262;
const DESCRIPTION: u64 = 270;
const PALETTE: u64 = 320;
/// Samples are places in a palette.
const PALETTED: u64 = 3;
/// A description that is longer holds no spacing.
const MOST_DESCRIPTION: u64 = 1 << 24;

fn broken() -> ReadError {
    ReadError::Damaged("as TIFF, a directory breaks off".into())
}

fn number(bytes: &[u8], big_endian: bool) -> u64 {
    let add = |n: u64, b: &u8| n << 8 | u64::from(*b);
    if big_endian { bytes.iter().fold(0, add) } else { bytes.iter().rev().fold(0, add) }
}

impl Directories {
    /// The places of all pages. Every directory is walked before the decoder sees it, as that reserves what a count asks for: no value may be
    /// longer than the file.
    pub fn of<R: Read + Seek>(source: &mut R) -> Result<Self, ReadError> {
        let length = source.seek(SeekFrom::End(0))?;
        let mut read = |at: u64, n: usize| -> Result<Vec<u8>, ReadError> {
            // A directory has at most 65,536 entries, or in BigTIFF as many as the file has room for.
            let fits = at.checked_add(n as u64).is_some_and(|end| end <= length);
            let mut bytes = vec![0; if fits { n } else { return Err(broken()) }];
            source.seek(SeekFrom::Start(at))?;
            source.read_exact(&mut bytes)?;
            Ok(bytes)
        };
        let head = read(0, 8)?;
        let big_endian = head[0] == b'M';
        let number = |bytes: &[u8]| number(bytes, big_endian);
        let is_big = number(&head[2..4]) == 43;
        // Bytes of a count of entries, of an entry, and of an offset.
        let (count_bytes, entry_bytes, offset_bytes) = if is_big { (8, 20, 8) } else { (2, 12, 4) };
        let mut next = if is_big { number(&read(8, 8)?) } else { number(&head[4..8]) };
        let (mut pages, mut seen, mut left) = (vec![], HashSet::new(), length);
        while next != 0 {
            if !seen.insert(next) {
                return Err(ReadError::Damaged("as TIFF, its pages lead in a circle".into()));
            }
            let mut page = Directory { at: next, ..Directory::default() };
            let count = number(&read(next, count_bytes)?);
            let all = usize::try_from(count).ok().and_then(|n| n.checked_mul(entry_bytes)?.checked_add(offset_bytes)).ok_or_else(broken)?;
            // Directories beside each other fit into the file together.
            left = left.checked_sub(all as u64).ok_or_else(|| ReadError::Damaged("as TIFF, its directories lie over each other".into()))?;
            let begin = next + count_bytes as u64;
            let entries = read(begin, all)?;
            for (n, entry) in entries[..all - offset_bytes].chunks(entry_bytes).enumerate() {
                let size = match number(&entry[2..4]) {
                    3 | 8 => 2,
                    4 | 9 | 11 | 13 => 4,
                    5 | 10 | 12 | 16..=18 => 8,
                    _ => 1,
                };
                let values = number(&entry[4..4 + offset_bytes]);
                let bytes = values.checked_mul(size).filter(|&bytes| bytes <= length);
                let bytes = bytes.ok_or_else(|| ReadError::Damaged("as TIFF, a value is longer than the file".into()))?;
                // What fits into the place of an offset stands there itself.
                let here = begin + (n * entry_bytes + 4 + offset_bytes) as u64;
                let value = &entry[4 + offset_bytes..];
                let place = if bytes <= offset_bytes as u64 { here } else { number(value) };
                match number(&entry[..2]) {
                    PHOTOMETRIC if number(&value[..2]) == PALETTED => page.paletted = Some(here),
                    DESCRIPTION => page.description = Some((place, bytes)),
                    PALETTE if size == 2 => page.palette = Some((place, values)),
                    _ => {}
                }
            }
            pages.push(page);
            next = number(&entries[all - offset_bytes..]);
        }
        if pages.is_empty() { Err(ReadError::NoImages) } else { Ok(Self { big_endian, is_big, pages }) }
    }

    /// The file as if `page` were its first, with samples that are grey values where a palette says what they are.
    pub fn at<'a, R: Read + Seek>(&self, page: &Directory, source: R, progress: Option<&'a Progress>) -> Patched<'a, R> {
        let bytes = |value: u64, n: usize| {
            let little = value.to_le_bytes()[..n].to_vec();
            if self.big_endian { little.into_iter().rev().collect() } else { little }
        };
        let pointer = if self.is_big { (8, bytes(page.at, 8)) } else { (4, bytes(page.at, 4)) };
        // Black is zero.
        let grey = page.paletted.map(|at| (at, bytes(1, 2)));
        Patched { source, patches: [pointer].into_iter().chain(grey).collect(), at: 0, progress }
    }
}

impl Directory {
    /// Its description, letters beyond UTF-8 taken as Latin-1.
    pub fn description(&self, source: &mut (impl Read + Seek)) -> Result<String, ReadError> {
        let Some((at, length)) = self.description.filter(|(_, length)| *length <= MOST_DESCRIPTION) else { return Ok(String::new()) };
        let mut bytes = vec![];
        source.seek(SeekFrom::Start(at))?;
        source.take(length).read_to_end(&mut bytes)?;
        let text = String::from_utf8(bytes).unwrap_or_else(|e| e.into_bytes().into_iter().map(char::from).collect());
        Ok(text.trim_end_matches('\0').to_owned())
    }

    /// The grey value of each place of its palette, if it has one of 8 bits; refused where that holds colours.
    pub fn palette(&self, source: &mut (impl Read + Seek), big_endian: bool) -> Result<Option<Vec<u8>>, ReadError> {
        if self.paletted.is_none() {
            return Ok(None);
        }
        let (at, _) = self.palette.filter(|(_, values)| *values == 3 * 256).ok_or_else(|| {
            ReadError::Unsupported("its samples are places in a palette that has not 256 colours; save it in grey values".into())
        })?;
        let mut bytes = [0; 3 * 512];
        source.seek(SeekFrom::Start(at))?;
        source.read_exact(&mut bytes).map_err(|_| broken())?;
        let value = |n: usize| number(&bytes[2 * n..2 * n + 2], big_endian);
        if (0..256).any(|n| value(n) != value(n + 256) || value(n) != value(n + 512)) {
            return Err(ReadError::Unsupported("its palette has colours; only grey values can be read".into()));
        }
        // Some programs write bytes where 16 bits are meant.
        let shift = if (0..256).any(|n| value(n) > 255) { 8 } else { 0 };
        Ok(Some((0..256).map(|n| (value(n) >> shift) as u8).collect()))
    }
}

/// A file some of whose bytes are others.
pub struct Patched<'a, R> {
    source: R,
    patches: Vec<(u64, Vec<u8>)>,
    at: u64,
    progress: Option<&'a Progress>,
}

impl<R: Read> Read for Patched<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.source.read(buffer)?;
        for (place, bytes) in &self.patches {
            for (byte, at) in bytes.iter().zip(*place..) {
                if let Some(b) = at.checked_sub(self.at).and_then(|m| buffer[..n].get_mut(m as usize)) {
                    *b = *byte;
                }
            }
        }
        self.at += n as u64;
        if let Some(progress) = self.progress {
            progress.advance(n as u64).map_err(io::Error::other)?;
        }
        Ok(n)
    }
}

impl<R: Seek> Seek for Patched<'_, R> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.at = self.source.seek(to)?;
        Ok(self.at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    #[test]
    fn directories_that_lie_over_each_other_are_refused() {
        // Fails if a file of some megabytes can ask for its directories to be read as often as it has bytes. The second begins in a value
        // of the first, and both together are longer than the file.
        let mut file = vec![0_u8; 600_000];
        file[..8].copy_from_slice(b"II*\0\x08\0\0\0");
        file[8..10].copy_from_slice(&40_000_u16.to_le_bytes());
        file[102..104].copy_from_slice(&30_000_u16.to_le_bytes());
        file[480_010..480_014].copy_from_slice(&102_u32.to_le_bytes());
        let error = Directories::of(&mut Cursor::new(&file)).unwrap_err().to_string();
        assert!(error.contains("lie over each other"), "{error}");
        // One alone is fine.
        file[480_010..480_014].fill(0);
        let one = Directories::of(&mut Cursor::new(&file)).unwrap();
        assert_eq!(one.pages.iter().map(|p| p.at).collect::<Vec<_>>(), [8]);
    }
}
