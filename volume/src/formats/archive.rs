//! Files that lie inside a file: the members of a zip or a tar, packed by gzip or not, and the one that a gzip is of. None is written to disk.
//!
//! A member's path is that of its archive and its own, `scans.zip/skull/a.nrrd`, so that a header finds the files beside it as in a folder. What
//! lies in a row is read where it lies; what is packed is unpacked into memory when it must be reached in any order.

use super::ReadError;
use super::entry::{Entry, MOST_FILES, beyond, is_apples, natural};
use super::packing::{Packing, check_expansion};
use super::stretch::{Stretch, disk_file};
use crate::Progress;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::SystemTime;
use zip::{CompressionMethod, ZipArchive};

/// The files in an archive.
#[derive(Debug)]
pub struct Archive {
    /// What they are called by people and files: the paths of its members begin with it.
    path: PathBuf,
    /// Its files, sorted by name with numbers in their order.
    pub entries: Vec<Entry>,
    /// What is not looked at.
    pub warnings: Vec<String>,
    /// It is a gzip of one file.
    pub is_single: bool,
    /// The file on the disk that all of it is in, its length and when it was written.
    stamp: (PathBuf, u64, Option<SystemTime>),
    /// The archive that it is in, which is not unpacked again as long as this one is used.
    _outer: Option<Arc<Self>>,
}

/// Archives that are in use. What they unpacked is there for all who read them, and gone with the last of those.
static IN_USE: Mutex<Vec<Weak<Archive>>> = Mutex::new(vec![]);

/// Archives in archives that are looked into.
const MOST_DEPTH: usize = 4;

/// The archive that the file at `path` is, which may itself be inside of another; `None` for other files.
pub fn open(path: &Path, progress: &Progress) -> Result<Option<Arc<Archive>>, ReadError> {
    match within(path, progress)? {
        None if path.is_file() => of(path, &Stretch::file(path, disk_file(path)?), None, progress),
        None => Ok(None),
        Some((archive, name)) => match archive.entry(&name) {
            Some(entry) => of(path, &entry.unpacked(progress)?, Some(archive), progress),
            None => Ok(None),
        },
    }
}

/// The innermost archive that `path` leads into, and the rest of it; `None` where it leads into none.
pub fn within(path: &Path, progress: &Progress) -> Result<Option<(Arc<Archive>, String)>, ReadError> {
    // No file on the disk lies below another.
    let Some(file) = path.ancestors().skip(1).find(|p| p.is_file()) else { return Ok(None) };
    let Some(mut archive) = of(file, &Stretch::file(file, disk_file(file)?), None, progress)? else { return Ok(None) };
    let mut rest = plain(path.strip_prefix(file).unwrap_or(path));
    for _ in 0..MOST_DEPTH {
        if archive.entry(&rest).is_some() {
            return Ok(Some((archive, rest)));
        }
        let outer = archive.entries.iter().find(|e| rest.strip_prefix(e.name.as_str()).is_some_and(|r| r.starts_with('/')));
        let Some(entry) = outer else { return Ok(Some((archive, rest))) };
        let inner = of(&entry.file, &entry.unpacked(progress)?, Some(archive.clone()), progress)?;
        let Some(inner) = inner else { return Ok(Some((archive, rest))) };
        rest = rest[entry.name.len() + 1..].to_owned();
        archive = inner;
    }
    Err(ReadError::Unsupported(format!("its archives lie in each other more than {MOST_DEPTH} deep; unpack it")))
}

/// A file inside of an archive; `None` where `path` leads into none.
pub fn member(path: &Path, progress: &Progress) -> Result<Option<Entry>, ReadError> {
    let Some((archive, name)) = within(path, progress)? else { return Ok(None) };
    archive.entry(&name).cloned().map(Some).ok_or(ReadError::NotFound)
}

/// Whether there is a file at `path`, on the disk or inside of an archive.
pub fn is_file(path: &Path) -> bool {
    path.is_file() || member(path, &Progress::default()).is_ok_and(|entry| entry.is_some())
}

/// Whether `path` is a folder, an archive of several files, or a folder inside of one.
pub fn is_folder(path: &Path, progress: &Progress) -> Result<bool, ReadError> {
    if path.is_dir() {
        return Ok(true);
    }
    Ok(is_folder_inside(path, progress)? || open(path, progress)?.is_some_and(|archive| !archive.is_single))
}

/// Whether `path` is a folder inside of an archive.
pub fn is_folder_inside(path: &Path, progress: &Progress) -> Result<bool, ReadError> {
    Ok(within(path, progress)?.is_some_and(|(archive, name)| archive.in_folder(&name, true).next().is_some()))
}

/// A path in an archive: names with `/` between them, `..` gone up.
fn plain(path: &Path) -> String {
    let mut names: Vec<String> = vec![];
    for part in path.components() {
        match part {
            std::path::Component::ParentDir => drop(names.pop()),
            std::path::Component::Normal(name) => names.push(name.to_string_lossy().into_owned()),
            _ => {}
        }
    }
    names.join("/")
}

impl Archive {
    fn entry(&self, name: &str) -> Option<&Entry> {
        self.entries.iter().find(|e| e.name == name)
    }

    /// The files in a folder of it, all for an empty name, and when `deep`, in its folders; what follows the folder's name is theirs.
    pub fn in_folder<'a>(&'a self, folder: &'a str, deep: bool) -> impl Iterator<Item = Entry> + 'a {
        self.entries.iter().filter_map(move |entry| {
            let rest = entry.name.strip_prefix(folder)?;
            let name = if folder.is_empty() { rest } else { rest.strip_prefix('/')? };
            (deep || !name.contains('/')).then(|| entry.named(name))
        })
    }

    fn is_fresh(&self) -> bool {
        stamp(&self.stamp.0).is_ok_and(|stamp| stamp == self.stamp)
    }
}

fn stamp(file: &Path) -> Result<(PathBuf, u64, Option<SystemTime>), ReadError> {
    let metadata = file.metadata()?;
    Ok((file.to_owned(), metadata.len(), metadata.modified().ok()))
}

/// The archive of `path`, whose bytes are `stretch`; `None` where they are no archive.
fn of(path: &Path, stretch: &Stretch, outer: Option<Arc<Archive>>, progress: &Progress) -> Result<Option<Arc<Archive>>, ReadError> {
    let in_use = || IN_USE.lock().unwrap_or_else(PoisonError::into_inner);
    let known = in_use().iter().filter_map(Weak::upgrade).find(|archive| archive.path == path && archive.is_fresh());
    if known.is_some() {
        return Ok(known);
    }
    let mut warnings = vec![];
    let (mut entries, is_single) = match Kind::of_stretch(stretch)? {
        None => return Ok(None),
        Some(Kind::Zip) => (in_zip(path, stretch, progress, &mut warnings)?, false),
        Some(Kind::Tar) => (in_tar(path, stretch, progress, &mut warnings)?, false),
        Some(Kind::Gzip) => {
            let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let unpacked = Entry::gzip(&name, path, stretch.clone()).unpacked(progress)?;
            match Kind::of_stretch(&unpacked)? {
                Some(Kind::Tar) => (in_tar(path, &unpacked, progress, &mut warnings)?, false),
                _ => (vec![Entry::plain(&name, &path.join(&name), unpacked)], true),
            }
        }
    };
    entries.sort_by_cached_key(|e| natural(&e.name));
    let stamp = match &outer {
        Some(outer) => outer.stamp.clone(),
        None => stamp(path)?,
    };
    let archive = Arc::new(Archive { path: path.to_owned(), entries, warnings, is_single, stamp, _outer: outer });
    let mut in_use = in_use();
    in_use.retain(|archive| archive.strong_count() > 0);
    in_use.push(Arc::downgrade(&archive));
    Ok(Some(archive))
}

/// How files are put into one.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Zip,
    Tar,
    Gzip,
}

impl Kind {
    fn of(head: &[u8]) -> Option<Self> {
        match head {
            [b'P', b'K', 3, 4, ..] => Some(Self::Zip),
            [0x1f, 0x8b, ..] => Some(Self::Gzip),
            // POSIX.1-1988 and GNU; older ones say nothing.
            _ if head.get(257..262) == Some(b"ustar") => Some(Self::Tar),
            _ => None,
        }
    }

    fn of_stretch(stretch: &Stretch) -> Result<Option<Self>, ReadError> {
        let mut head = vec![];
        stretch.open()?.take(512).read_to_end(&mut head)?;
        Ok(Self::of(&head))
    }
}

fn in_zip(path: &Path, stretch: &Stretch, progress: &Progress, warnings: &mut Vec<String>) -> Result<Vec<Entry>, ReadError> {
    let mut archive = ZipArchive::new(BufReader::new(stretch.open()?)).map_err(broken)?;
    let mut found = vec![];
    warnings.extend(beyond(archive.len().saturating_sub(MOST_FILES), MOST_FILES));
    for n in 0..archive.len().min(MOST_FILES) {
        progress.advance(0)?;
        let entry = archive.by_index_raw(n).map_err(broken)?;
        if !entry.is_file() || entry.size() == 0 {
            continue;
        }
        // Some programs of Windows write its own separator.
        let name = plain(Path::new(&entry.name().map_err(broken)?.replace('\\', "/")));
        if is_apples(&name) {
            continue;
        }
        if entry.encrypted() {
            return Err(ReadError::Unsupported(format!("its file {name:?} is encrypted; unpack it with its password first")));
        }
        let packing = match entry.compression() {
            CompressionMethod::Stored => Packing::Plain,
            CompressionMethod::Deflated => Packing::Deflate,
            other => {
                let text = format!("its file {name:?} is packed by {other}, which is not read; unpack it first");
                return Err(ReadError::Unsupported(text));
            }
        };
        let (packed, bytes) = (entry.compressed_size(), entry.size());
        check_expansion(bytes.into(), packed)?;
        let start = entry.data_start().ok_or(ReadError::NoHeader("a file in it has no place"))?;
        let own = stretch.part(start, packed).ok_or(ReadError::NoHeader("a file in it has no place"))?;
        found.push(Entry::packed(&name, &path.join(&name), own, packing, bytes));
    }
    Ok(found)
}

fn broken(error: zip::result::ZipError) -> ReadError {
    match error {
        zip::result::ZipError::Io(error) => error.into(),
        error => ReadError::Damaged(format!("as a zip, {error}")),
    }
}

fn in_tar(path: &Path, stretch: &Stretch, progress: &Progress, warnings: &mut Vec<String>) -> Result<Vec<Entry>, ReadError> {
    let broken = |e: std::io::Error| match ReadError::from(e) {
        ReadError::Io(e) => ReadError::Damaged(format!("as a tar, {e}")),
        e => e,
    };
    let mut archive = tar::Archive::new(BufReader::new(stretch.open()?));
    let (mut found, mut too_many) = (vec![], 0);
    for entry in archive.entries_with_seek().map_err(broken)? {
        progress.advance(0)?;
        let entry = entry.map_err(broken)?;
        let name = plain(&entry.path().map_err(broken)?);
        if !entry.header().entry_type().is_file() || entry.size() == 0 || is_apples(&name) {
            continue;
        }
        if found.len() == MOST_FILES {
            too_many += 1;
            continue;
        }
        let own = stretch.part(entry.raw_file_position(), entry.size());
        let own = own.ok_or_else(|| ReadError::Damaged("as a tar, its last file breaks off".into()))?;
        found.push(Entry::plain(&name, &path.join(&name), own));
    }
    warnings.extend(beyond(too_many, MOST_FILES));
    Ok(found)
}

/// Whether a file that begins so may be an archive.
pub fn is_archive(head: &[u8]) -> bool {
    Kind::of(head).is_some()
}
