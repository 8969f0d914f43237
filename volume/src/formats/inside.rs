//! Which of the files in an archive is the scan.

use super::entries::in_folder;
use super::entry::Entry;
use super::{FORMATS, Format, HEAD_BYTES, ReadError, archive, dicom, pictures, raw, tiff};
use crate::Progress;
use std::path::{Path, PathBuf};

/// The scan in the archive, or the folder of one, at `path`: DICOM, else the only volume in it, else pictures, else the only archive in it.
pub fn find(path: &Path, progress: &Progress) -> Result<(&'static Format, PathBuf), ReadError> {
    let entries = in_folder(path, true, progress, &mut vec![])?;
    if entries.iter().any(|entry| dicom::is_dicom(entry, progress)) {
        return Ok((&dicom::FORMAT, path.to_owned()));
    }
    // A TIFF may be one slice of many, and data without a header of anything.
    let is_volume = |format: &&Format| ![&tiff::FORMAT, &pictures::FORMAT, &raw::FORMAT].iter().any(|other| other.name == format.name);
    let mut volumes = vec![];
    for entry in &entries {
        let head = entry.head(HEAD_BYTES, progress)?;
        let format = FORMATS.iter().filter(is_volume).find(|format| (format.sniff)(&entry.file, &head, progress));
        volumes.extend(format.map(|format| (format, entry.file.clone())));
        progress.advance(0)?;
    }
    // Of a header with its samples beside it, both are known.
    let headers: Vec<PathBuf> = volumes.iter().map(|(_, file)| file.clone()).collect();
    volumes.retain(|(_, file)| file.extension().is_none_or(|e| e != "img") || !headers.contains(&file.with_extension("hdr")));
    let has_end = |entry: &&Entry, ends: &[&str]| ends.iter().any(|end| entry.name.to_lowercase().ends_with(end));
    let archives = || entries.iter().filter(|entry| has_end(entry, &[".zip", ".tar", ".tgz", ".gz"]));
    let mut samples = entries.iter().filter(|entry| has_end(entry, &[".raw"]));
    let list = |n: usize, what: &str, [a, b]: [&Path; 2]| {
        let [a, b] = [a, b].map(|file| file.strip_prefix(path).unwrap_or(file).display());
        ReadError::Unsupported(format!("it holds {n} {what}, from {a} to {b}; name one, as ARCHIVE/{a}"))
    };
    match &volumes[..] {
        [(format, file)] => return Ok((format, file.clone())),
        [(_, first), .., (_, last)] => return Err(list(volumes.len(), "scans", [first, last])),
        [] => {}
    }
    match &entries.iter().filter(|entry| pictures::is_picture(entry)).collect::<Vec<_>>()[..] {
        [] => {}
        [only] if tiff::is_tiff(&only.head(HEAD_BYTES, progress)?) => return Ok((&tiff::FORMAT, only.file.clone())),
        _ => return Ok((&pictures::FORMAT, path.to_owned())),
    }
    match (samples.next(), samples.next(), &archives().collect::<Vec<_>>()[..]) {
        (Some(only), None, _) => Ok((&raw::FORMAT, only.file.clone())),
        (.., []) if archive::open(path, progress)?.is_some_and(|archive| archive.is_single) => {
            Err(ReadError::Unsupported("it is packed by gzip, and what it packs is no scan that is known here; unpack it and look".into()))
        }
        (.., []) => Err(ReadError::NoImages),
        (.., [only]) => super::find(&only.file, progress),
        (.., all @ [first, .., last]) => Err(list(all.len(), "archives", [&first.file, &last.file])),
    }
}
