//! Bytes that lie in a row, in a file or in memory: all of a file, or what an archive holds of one.

use super::ReadError;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Bytes that lie in a row.
#[derive(Clone, Debug)]
pub struct Stretch {
    holder: Holder,
    start: u64,
    /// How many they are.
    pub bytes: u64,
}

#[derive(Clone, Debug)]
enum Holder {
    File(PathBuf),
    Memory(Arc<Vec<u8>>),
}

impl Stretch {
    /// All `bytes` bytes of a file.
    pub fn file(path: &Path, bytes: u64) -> Self {
        Self { holder: Holder::File(path.to_owned()), start: 0, bytes }
    }

    /// Bytes that were unpacked.
    pub fn memory(bytes: Vec<u8>) -> Self {
        Self { start: 0, bytes: bytes.len() as u64, holder: Holder::Memory(Arc::new(bytes)) }
    }

    /// `bytes` of its bytes from number `start` on; `None` where it has not so many.
    pub fn part(&self, start: u64, bytes: u64) -> Option<Self> {
        let is_within = start.checked_add(bytes).is_some_and(|end| end <= self.bytes);
        is_within.then(|| Self { holder: self.holder.clone(), start: self.start + start, bytes })
    }

    /// A reader of them.
    pub fn open(&self) -> Result<Source, ReadError> {
        let inner = match &self.holder {
            Holder::File(path) => {
                let mut file = File::open(path)?;
                if self.start > 0 {
                    file.seek(SeekFrom::Start(self.start))?;
                }
                Inner::File(file)
            }
            Holder::Memory(bytes) => Inner::Memory(bytes.clone()),
        };
        Ok(Source { inner, start: self.start, bytes: self.bytes, at: 0 })
    }
}

/// A reader of a stretch.
pub struct Source {
    inner: Inner,
    start: u64,
    bytes: u64,
    at: u64,
}

enum Inner {
    File(File),
    Memory(Arc<Vec<u8>>),
}

impl Read for Source {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let left = self.bytes.saturating_sub(self.at);
        let most = usize::try_from(left).map_or(buffer.len(), |left| left.min(buffer.len()));
        let buffer = &mut buffer[..most];
        let n = match &mut self.inner {
            Inner::File(file) => file.read(buffer)?,
            // A stretch lies within its memory, which fits `usize`.
            Inner::Memory(bytes) => (&bytes[(self.start + self.at.min(self.bytes)) as usize..]).read(buffer)?,
        };
        self.at += n as u64;
        Ok(n)
    }
}

impl Seek for Source {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let at = match to {
            SeekFrom::Start(n) => Some(n),
            SeekFrom::End(n) => self.bytes.checked_add_signed(n),
            SeekFrom::Current(n) => self.at.checked_add_signed(n),
        };
        self.at = at.ok_or(io::ErrorKind::InvalidInput)?;
        if let Inner::File(file) = &mut self.inner {
            let place = self.start.checked_add(self.at).ok_or(io::ErrorKind::InvalidInput)?;
            file.seek(SeekFrom::Start(place))?;
        }
        Ok(self.at)
    }
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
