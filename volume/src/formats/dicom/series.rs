//! The series of a folder or an archive, and which of them is read.

use super::super::entries::{entry_at, in_folder};
use super::super::entry::Entry;
use super::super::part::in_file;
use super::super::{Hints, ReadError, archive};
use super::apart::{Scan, told_apart};
use super::header::Header;
use super::placeless;
use crate::Progress;
use dicom_dictionary_std::tags;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;

/// One of the series of a folder or an archive.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Series {
    /// What names it behind the `#` of `FOLDER#KEY`: its number, and where several have that number, its place among them (`3.1`, `3.2`).
    pub key: String,
    /// What the scanner's operator called it.
    pub description: Option<String>,
    /// Images in it.
    pub images: u64,
}

impl std::fmt::Display for Series {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} ({}, {} images)", self.key, self.description.as_deref().unwrap_or("without description"), self.images)
    }
}

/// The headers of the series that `path` names, or of the largest in it.
pub fn read(path: &Path, hints: &Hints, progress: &Progress, warnings: &mut Vec<String>) -> Result<Vec<Header>, ReadError> {
    // The list of a disc names its files; they are looked for.
    let named = path;
    let path = match path.parent() {
        Some(folder) if path.file_name().is_some_and(|name| name.eq_ignore_ascii_case("DICOMDIR")) && archive::is_file(path) => {
            if folder == Path::new("") { Path::new(".") } else { folder }
        }
        _ => path,
    };
    if !archive::is_folder(path, progress)? {
        return of_file(path, hints, progress, warnings);
    }
    let mut all = all(path, progress, warnings)?;
    let texts = |all: &[(Series, Vec<Header>)]| all.iter().map(|(s, _)| s.to_string()).collect::<Vec<_>>().join(", ");
    let chosen = match &hints.series {
        None if all.is_empty() && named != path => {
            return Err(ReadError::Unsupported("it lists the files of a disc, and no image lies beside it; copy the whole disc".into()));
        }
        None if all.is_empty() => return Err(ReadError::NoImages),
        None => 0,
        Some(wanted) => {
            let text = || format!("it has no series {wanted}; it has {}", texts(&all));
            all.iter().position(|(s, _)| s.key == *wanted).ok_or_else(|| ReadError::Unsupported(text()))?
        }
    };
    if hints.series.is_none() && all.len() > 1 {
        let how = if path.is_dir() { "FOLDER#NUMBER" } else { "FILE#NUMBER" };
        let (n, largest, others) = (all.len(), &all[0].0.key, texts(&all[1..]));
        warnings.push(format!("it holds {n} series; the largest, {largest}, is read; name another as {how}: {others}"));
    }
    Ok(all.swap_remove(chosen).1)
}

/// The series that hold images in the folder or archive at `path`, the largest first.
pub fn list(path: &Path, progress: &Progress) -> Result<Vec<Series>, ReadError> {
    Ok(all(path, progress, &mut vec![])?.into_iter().map(|(series, _)| series).collect())
}

/// The series that hold images, the largest first.
fn all(path: &Path, progress: &Progress, warnings: &mut Vec<String>) -> Result<Vec<(Series, Vec<Header>)>, ReadError> {
    let entries = in_folder(path, true, progress, warnings)?;
    let images = |scan: &Scan| scan.headers.iter().filter(|h| h.pixels.is_some()).map(|h| h.images() as u64).sum::<u64>();
    let scans = headers(entries, progress, warnings)?.into_values().flat_map(told_apart);
    let mut all: Vec<Scan> = scans.filter(|s| images(s) > 0).collect();
    // Equal sizes keep the order of their identifiers, and of what tells them apart.
    all.sort_by_key(|s| std::cmp::Reverse(images(s)));
    let numbers: Vec<String> = all.iter().map(|s| s.headers[0].text(tags::SERIES_NUMBER, 0).unwrap_or("0").to_owned()).collect();
    let key = |n: usize| {
        let same = |end: usize| numbers[..end].iter().filter(|m| **m == numbers[n]).count();
        if same(numbers.len()) == 1 { numbers[n].clone() } else { format!("{}.{}", numbers[n], same(n + 1)) }
    };
    let named = all.into_iter().enumerate().map(|(n, scan)| {
        let words = scan.headers[0].text(tags::SERIES_DESCRIPTION, 0).map(str::to_owned).into_iter().chain(scan.apart.iter().cloned());
        let description = words.reduce(|a, b| format!("{a}, {b}"));
        (Series { key: key(n), description, images: images(&scan) }, scan.headers)
    });
    Ok(named.collect())
}

/// The series of one file: its own.
fn of_file(path: &Path, hints: &Hints, progress: &Progress, warnings: &mut Vec<String>) -> Result<Vec<Header>, ReadError> {
    let entry = entry_at(path, progress)?.gunzipped();
    let header = Header::read(&entry, progress)?;
    if header.pixels.is_none() {
        return Err(ReadError::NoImages);
    }
    if let Some(number) = &hints.series {
        return Err(ReadError::Unsupported(format!("it is one file, of one series; leave out #{number}, or name its folder")));
    }
    let entries = match path.parent() {
        Some(folder) => in_folder(if folder == Path::new("") { Path::new(".") } else { folder }, false, progress, warnings)?,
        None => vec![entry],
    };
    let series = headers(entries, progress, warnings)?.remove(header.series()).ok_or(ReadError::NoImages)?;
    let scans = told_apart(series);
    if let [_, _, ..] = &scans[..] {
        warnings.push(format!("its series holds {} scans, told apart by what they say; that of this file is read", scans.len()));
    }
    // Files of one folder, so that their names are enough.
    let own = scans.into_iter().find(|scan| scan.headers.iter().any(|h| h.entry.file.file_name() == path.file_name()));
    own.map(|scan| scan.headers).ok_or(ReadError::NoImages)
}

/// The headers of those entries that are DICOM, by series.
fn headers(entries: Vec<Entry>, progress: &Progress, warnings: &mut Vec<String>) -> Result<BTreeMap<String, Vec<Header>>, ReadError> {
    progress.begin(entries.len() as u64);
    let read: Vec<Result<Option<Header>, (String, ReadError)>> = entries
        .par_iter()
        .map(|entry| {
            // The bytes of headers are few; the work is counted in files.
            let header =
                progress.advance(1).map_err(ReadError::from).and_then(|()| Header::read_if_dicom(&entry.gunzipped(), &Progress::default()));
            header.map_err(|e| (entry.name.clone(), e))
        })
        .collect();
    let mut by_series: BTreeMap<String, Vec<Header>> = BTreeMap::new();
    let mut broken = vec![];
    for header in read {
        match header {
            Ok(None) => {}
            Ok(Some(header)) => by_series.entry(header.series().to_owned()).or_default().push(header),
            Err((_, ReadError::Cancelled(c))) => return Err(c.into()),
            Err(error) => broken.push(error),
        }
    }
    if by_series.is_empty() && !broken.is_empty() {
        let (name, error) = broken.swap_remove(0);
        return Err(in_file(Path::new(&name), error));
    }
    if let [(name, error), ..] = &broken[..] {
        let more = if broken.len() > 1 { format!(" ({} such files)", broken.len()) } else { String::new() };
        warnings.push(format!("{name} cannot be read and is left out: {error}{more}"));
    }
    by_series.values_mut().for_each(|headers| placeless::lend(headers));
    Ok(by_series)
}
