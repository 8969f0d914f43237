//! The files of a folder, or of an archive: what series and slices are made of.

use super::entry::{Entry, MOST_FILES, beyond, is_apples, natural};
use super::stretch::disk_file;
use super::{ReadError, archive};
use crate::Progress;
use std::path::Path;

/// Folders in folders that are looked into.
const MOST_DEPTH: usize = 8;
/// A file by itself, or inside of an archive.
pub fn entry_at(file: &Path, progress: &Progress) -> Result<Entry, ReadError> {
    match archive::member(file, progress)? {
        Some(entry) => Ok(entry),
        None => Ok(Entry::on_disk(file, disk_file(file)?)),
    }
}

/// The files in `folder`, which may be an archive or in one, and, when `deep`, in its folders, sorted by name with numbers in their order.
pub fn in_folder(folder: &Path, deep: bool, progress: &Progress, warnings: &mut Vec<String>) -> Result<Vec<Entry>, ReadError> {
    if !folder.is_dir() {
        let (archive, name) = match archive::open(folder, progress)? {
            Some(archive) => (archive, String::new()),
            None => archive::within(folder, progress)?.ok_or(ReadError::NotFound)?,
        };
        warnings.extend(archive.warnings.iter().cloned());
        return Ok(archive.in_folder(&name, deep).collect());
    }
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
                found.push(Entry::on_disk(&path, metadata.len()));
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

#[cfg(test)]
mod tests {
    use super::in_folder_within;
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
}
