//! A file that is read as one of many: on the disk, or a member of an archive, packed or not.

use super::packing::{MOST_EXPANSION, Packing, counted, skip, unpacking};
use super::stretch::Stretch;
use super::{ReadError, memory};
use crate::Progress;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

/// Files that are looked at; the largest studies have some ten thousand.
pub const MOST_FILES: usize = 200_000;

/// A file, or a file in an archive.
#[derive(Clone, Debug)]
pub struct Entry {
    /// What people call it: its name, with its folder in the archive.
    pub name: String,
    /// Its path; in an archive that of the archive, then its own.
    pub file: PathBuf,
    /// Its bytes once unpacked; of a gzip, which does not say, the most that they can be.
    pub bytes: u64,
    /// Where they are, packed or not.
    stretch: Stretch,
    packing: Packing,
    /// All of them in memory, where they had to be reached in any order.
    unpacked: Arc<OnceLock<Stretch>>,
}

impl Entry {
    /// A file of `bytes` bytes on the disk. What gzip packs is read as it was before.
    pub fn on_disk(file: &Path, bytes: u64) -> Self {
        let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy().into_owned();
        let stretch = Stretch::file(file, bytes);
        let is_gzip = file.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz"));
        if is_gzip { Self::gzip(&name, file, stretch) } else { Self::plain(&name, file, stretch) }
    }

    /// A file whose bytes are `stretch`.
    pub fn plain(name: &str, file: &Path, stretch: Stretch) -> Self {
        let bytes = stretch.bytes;
        Self::packed(name, file, stretch, Packing::Plain, bytes)
    }

    /// A file that gzip has packed into `stretch`.
    pub fn gzip(name: &str, file: &Path, stretch: Stretch) -> Self {
        let most = stretch.bytes.saturating_mul(MOST_EXPANSION);
        Self::packed(name, file, stretch, Packing::Gzip, most)
    }

    /// A file of `bytes` bytes that is packed into `stretch`.
    pub fn packed(name: &str, file: &Path, stretch: Stretch, packing: Packing, bytes: u64) -> Self {
        Self { name: name.to_owned(), file: file.to_owned(), bytes, stretch, packing, unpacked: Arc::default() }
    }

    /// The same with the layer of gzip taken off that its name says it has.
    pub fn gunzipped(&self) -> Self {
        let is_gzip = self.file.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz"));
        let packing = match self.packing {
            Packing::Plain if is_gzip => Packing::Gzip,
            Packing::Deflate if is_gzip => Packing::GzipInDeflate,
            _ => return self.clone(),
        };
        Self::packed(&self.name, &self.file, self.stretch.clone(), packing, self.bytes.saturating_mul(MOST_EXPANSION))
    }

    /// The same by another name.
    pub fn named(&self, name: &str) -> Self {
        Self { name: name.to_owned(), ..self.clone() }
    }

    /// Bytes that reading it passes.
    pub fn packed_bytes(&self) -> u64 {
        self.stretch.bytes
    }

    /// Its bytes from number `from` on.
    pub fn open<'a>(&self, from: u64, progress: &'a Progress) -> Result<Box<dyn Read + 'a>, ReadError> {
        let (stretch, packing) = match self.unpacked.get() {
            Some(unpacked) => (unpacked, Packing::Plain),
            None => (&self.stretch, self.packing),
        };
        let mut source = stretch.open()?;
        if packing == Packing::Plain {
            source.seek(SeekFrom::Start(from))?;
            return Ok(Box::new(counted(source, progress)));
        }
        let mut unpacked = unpacking(packing, counted(source, progress));
        skip(&mut unpacked, from)?;
        Ok(unpacked)
    }

    /// Its first bytes, at most `most` of them.
    pub fn head(&self, most: u64, progress: &Progress) -> Result<Vec<u8>, ReadError> {
        let mut head = vec![];
        self.open(0, progress)?.take(most).read_to_end(&mut head)?;
        Ok(head)
    }

    /// Its bytes in any order, unpacked into memory if they are packed; refused where that has no room for them.
    pub fn unpacked(&self, progress: &Progress) -> Result<Stretch, ReadError> {
        /// Bytes after which is looked again whether there is room for more.
        const STEP: u64 = 64 << 20;
        if self.packing == Packing::Plain {
            return Ok(self.stretch.clone());
        }
        if let Some(unpacked) = self.unpacked.get() {
            return Ok(unpacked.clone());
        }
        let expected = match self.packing {
            Packing::Gzip => self.stated()?.min(self.bytes),
            // Its last bytes are packed, too.
            Packing::GzipInDeflate => 0,
            _ => self.bytes,
        };
        memory::check(1, |_| expected)?;
        let mut bytes = vec![];
        bytes.try_reserve_exact(expected as usize)?;
        let mut source = self.open(0, progress)?;
        loop {
            let step = STEP.min(self.bytes - bytes.len() as u64);
            // What a gzip says of its length is only that of its last member, so that the end is looked for.
            if step == 0 || (&mut source).take(step).read_to_end(&mut bytes)? == 0 {
                break;
            }
            memory::check(1, |_| (bytes.len() as u64).saturating_sub(expected))?;
        }
        Ok(self.unpacked.get_or_init(|| Stretch::memory(bytes)).clone())
    }

    /// What a gzip says of its length, modulo 4 GiB: its last four bytes.
    fn stated(&self) -> Result<u64, ReadError> {
        let mut last = [0; 4];
        let mut source = self.stretch.open()?;
        source.seek(SeekFrom::Start(self.stretch.bytes.saturating_sub(4)))?;
        source.read_exact(&mut last)?;
        Ok(u32::from_le_bytes(last).into())
    }

    /// Its bytes in any order.
    pub fn seekable(&self, progress: &Progress) -> Result<impl BufRead + Seek + use<>, ReadError> {
        Ok(BufReader::new(self.unpacked(progress)?.open()?))
    }

    /// All its bytes, which are known to be few enough to hold.
    pub fn read(&self, progress: &Progress) -> Result<Vec<u8>, ReadError> {
        let mut bytes = vec![];
        // What an archive says about the size of a file was checked against what it holds.
        self.open(0, progress)?.take(self.bytes).read_to_end(&mut bytes)?;
        Ok(bytes)
    }
}

/// What macOS leaves beside files on other disks, and in zips: no file of the person's.
pub fn is_apples(name: &str) -> bool {
    name.split('/').any(|part| part.starts_with("._") || part == "__MACOSX" || part == ".DS_Store")
}

/// The sentence about files that are not looked at.
pub fn beyond(too_many: usize, most: usize) -> Option<String> {
    (too_many > 0)
        .then(|| format!("{too_many} files beyond the first {most} are not looked at, whatever they hold; name a folder with fewer"))
}

/// A key by which slice2 comes before slice10: numbers count as such, other text as it is, capitals as small letters.
pub fn natural(name: &str) -> Vec<(String, u128)> {
    let mut key = vec![(String::new(), 0_u128)];
    let mut in_number = false;
    for c in name.to_lowercase().chars() {
        // A part is a text and the number after it; numbers beyond 128 bits are all the largest.
        let last = key.len() - 1;
        match c.to_digit(10) {
            Some(digit) => key[last].1 = key[last].1.saturating_mul(10).saturating_add(digit.into()),
            None if in_number => key.push((c.to_string(), 0)),
            None => key[last].0.push(c),
        }
        in_number = c.is_ascii_digit();
    }
    key
}

#[cfg(test)]
mod tests {
    use super::natural;

    #[test]
    fn numbers_count() {
        // Fails if slice10 comes before slice2, which shuffles a scan.
        let mut names = ["s10.png", "S2.png", "s1.png", "s2b1.png", "s2b10.png", "s2b9.png", "a"];
        names.sort_by_cached_key(|n| natural(n));
        assert_eq!(names, ["a", "s1.png", "S2.png", "s2b1.png", "s2b9.png", "s2b10.png", "s10.png"]);
    }
}
