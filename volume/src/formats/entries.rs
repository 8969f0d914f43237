//! The files of a folder, or of a zip: what series and slices are made of.

use super::ReadError;
use super::part::{check_expansion, counted, open_file};
use crate::Progress;
use flate2::read::DeflateDecoder;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Cursor, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use zip::{CompressionMethod, ZipArchive};

/// Folders in folders that are looked into.
const MOST_DEPTH: usize = 8;
/// Files that are looked at; the largest studies have some ten thousand.
const MOST_FILES: usize = 200_000;

/// A file, or a file in a zip.
#[derive(Clone, Debug)]
pub struct Entry {
    /// What people call it: its name, with its folder in the zip.
    pub name: String,
    /// The file that its bytes are in.
    pub file: PathBuf,
    /// Its bytes once unpacked.
    pub bytes: u64,
    /// Where they are in a zip: first byte, packed bytes and whether they are deflated.
    zipped: Option<(u64, u64, bool)>,
}

impl Entry {
    /// A file by itself.
    pub fn of(file: &Path) -> Result<Self, ReadError> {
        let bytes = open_file(file)?.1;
        let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy().into_owned();
        Ok(Self { name, file: file.to_owned(), bytes, zipped: None })
    }

    /// Bytes that reading it passes.
    pub fn packed_bytes(&self) -> u64 {
        self.zipped.map_or(self.bytes, |(_, packed, _)| packed)
    }

    /// Whether one of its bytes can be reached without reading those before it.
    pub fn can_seek(&self) -> bool {
        !matches!(self.zipped, Some((.., true)))
    }

    /// Its bytes from number `from` on.
    pub fn open<'a>(&self, from: u64, progress: &'a Progress) -> Result<Box<dyn Read + 'a>, ReadError> {
        let mut file = File::open(&self.file)?;
        Ok(match self.zipped {
            None => {
                file.seek(SeekFrom::Start(from))?;
                Box::new(counted(file, progress))
            }
            Some((start, packed, false)) => {
                file.seek(SeekFrom::Start(start + from))?;
                Box::new(counted(file, progress).take(packed.saturating_sub(from)))
            }
            Some((start, packed, true)) => {
                file.seek(SeekFrom::Start(start))?;
                let mut unpacked = DeflateDecoder::new(counted(file, progress).take(packed));
                skip(&mut unpacked, from)?;
                Box::new(unpacked)
            }
        })
    }

    /// Its bytes in any order: of a file as it lies, of a zip unpacked.
    pub fn seekable(&self, progress: &Progress) -> Result<Box<dyn BufReadSeek>, ReadError> {
        Ok(match self.zipped {
            None => Box::new(BufReader::new(File::open(&self.file)?)),
            Some(_) => Box::new(Cursor::new(self.read(progress)?)),
        })
    }

    /// All its bytes, which are known to be few enough to hold.
    pub fn read(&self, progress: &Progress) -> Result<Vec<u8>, ReadError> {
        let mut bytes = vec![];
        // What a zip says about the size of a file was checked against what it holds.
        self.open(0, progress)?.take(self.bytes).read_to_end(&mut bytes)?;
        Ok(bytes)
    }
}

/// What decoders of pictures want.
pub trait BufReadSeek: BufRead + Seek {}
impl<T: BufRead + Seek> BufReadSeek for T {}

/// Reads past `count` bytes; a source that ends earlier is found out by whoever reads on.
pub fn skip(source: &mut impl Read, count: u64) -> io::Result<()> {
    io::copy(&mut source.take(count), &mut io::sink()).map(drop)
}

/// The files in `folder` and, when `deep`, in its folders, sorted by name with numbers in their order.
pub fn in_folder(folder: &Path, deep: bool, progress: &Progress, warnings: &mut Vec<String>) -> Result<Vec<Entry>, ReadError> {
    in_folder_within(folder, deep, MOST_FILES, progress, warnings)
}

fn in_folder_within(
    folder: &Path,
    deep: bool,
    most: usize,
    progress: &Progress,
    warnings: &mut Vec<String>,
) -> Result<Vec<Entry>, ReadError> {
    let (mut found, mut too_deep, mut too_many) = (vec![], 0, 0);
    let mut folders = vec![(folder.to_owned(), 0)];
    while let Some((folder, depth)) = folders.pop() {
        for entry in std::fs::read_dir(&folder)? {
            progress.advance(0)?;
            let path = entry?.path();
            if is_apples(&path.file_name().unwrap_or_default().to_string_lossy()) {
                continue;
            }
            // What cannot be looked at, and what is no regular file, is no slice. A link to a folder may lead in circles.
            let Ok(metadata) = path.metadata() else { continue };
            if metadata.is_dir() && deep && !path.is_symlink() {
                match depth < MOST_DEPTH {
                    true => folders.push((path, depth + 1)),
                    false => too_deep += 1,
                }
            } else if metadata.is_file() && metadata.len() > 0 {
                if found.len() == most {
                    too_many += 1;
                    continue;
                }
                let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
                found.push(Entry { name, file: path, bytes: metadata.len(), zipped: None });
            }
        }
    }
    if too_deep > 0 {
        warnings.push(format!("{too_deep} folders lie more than {MOST_DEPTH} deep and are not looked into; name one of them"));
    }
    warnings.extend(beyond(too_many, most));
    found.sort_by_cached_key(|e| natural(&e.file.to_string_lossy()));
    Ok(found)
}

/// What macOS leaves beside files on other disks, and in zips: no file of the person's.
fn is_apples(name: &str) -> bool {
    name.split('/').any(|part| part.starts_with("._") || part == "__MACOSX" || part == ".DS_Store")
}

/// The sentence about files that are not looked at.
fn beyond(too_many: usize, most: usize) -> Option<String> {
    (too_many > 0)
        .then(|| format!("{too_many} files beyond the first {most} are not looked at, whatever they hold; name a folder with fewer"))
}

/// The files in a zip, sorted by name with numbers in their order.
pub fn in_zip(file: &Path, progress: &Progress, warnings: &mut Vec<String>) -> Result<Vec<Entry>, ReadError> {
    let mut archive = ZipArchive::new(BufReader::new(open_file(file)?.0)).map_err(broken)?;
    let mut found = vec![];
    warnings.extend(beyond(archive.len().saturating_sub(MOST_FILES), MOST_FILES));
    for n in 0..archive.len().min(MOST_FILES) {
        progress.advance(0)?;
        let entry = archive.by_index_raw(n).map_err(broken)?;
        if !entry.is_file() || entry.size() == 0 {
            continue;
        }
        let name = entry.name().map_err(broken)?.into_owned();
        if is_apples(&name) {
            continue;
        }
        if entry.encrypted() {
            return Err(ReadError::Unsupported(format!("its file {name:?} is encrypted; unpack it with its password first")));
        }
        let deflated = match entry.compression() {
            CompressionMethod::Stored => false,
            CompressionMethod::Deflated => true,
            other => {
                let text = format!("its file {name:?} is packed by {other}, which is not read; unpack it first");
                return Err(ReadError::Unsupported(text));
            }
        };
        let (packed, bytes) = (entry.compressed_size(), entry.size());
        check_expansion(bytes.into(), packed)?;
        let start = entry.data_start().ok_or(ReadError::NoHeader("a file in it has no place"))?;
        found.push(Entry { name, file: file.to_owned(), bytes, zipped: Some((start, packed, deflated)) });
    }
    found.sort_by_cached_key(|e| natural(&e.name));
    Ok(found)
}

fn broken(error: zip::result::ZipError) -> ReadError {
    match error {
        zip::result::ZipError::Io(error) => error.into(),
        error => ReadError::Damaged(format!("as a zip, {error}")),
    }
}

/// A key by which slice2 comes before slice10: numbers count as such, other text as it is, capitals as small letters.
fn natural(name: &str) -> Vec<(String, u128)> {
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
    use super::{in_folder_within, natural};
    use crate::Progress;

    #[test]
    fn what_is_not_looked_at_is_said() {
        // Fails if files beyond the most that are looked at, or folders too deep, are passed over in silence.
        let top = std::env::temp_dir().join(format!("bregma-entries-{}", std::process::id()));
        let deep = (0..10).fold(top.clone(), |folder, _| folder.join("d"));
        std::fs::create_dir_all(&deep).unwrap();
        (0..5).for_each(|n| std::fs::write(top.join(format!("f{n}")), "x").unwrap());
        let look = |most| {
            let mut warnings = vec![];
            let found = in_folder_within(&top, true, most, &Progress::default(), &mut warnings).unwrap();
            (found.len(), warnings.join("; "))
        };
        let (few, all) = (look(3), look(5));
        std::fs::remove_dir_all(&top).unwrap();
        assert!(few.0 == 3 && few.1.contains("2 files beyond the first 3"), "{few:?}");
        assert!(all.0 == 5 && !all.1.contains("beyond") && all.1.contains("1 folders lie more than 8 deep"), "{all:?}");
    }

    #[test]
    fn numbers_count() {
        // Fails if slice10 comes before slice2, which shuffles a scan.
        let mut names = ["s10.png", "S2.png", "s1.png", "s2b1.png", "s2b10.png", "s2b9.png", "a"];
        names.sort_by_cached_key(|n| natural(n));
        assert_eq!(names, ["a", "s1.png", "S2.png", "s2b1.png", "s2b9.png", "s2b10.png", "s10.png"]);
    }
}
