//! A person's own looks: small files by name in a folder beside the program's settings.

use crate::output::{FolderError, OutputError, make_folder, write_whole};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Why something could not be put on a shelf, or taken from it.
#[derive(Debug, Error)]
pub enum ShelfError {
    /// There is no folder for settings.
    #[error("there is no folder for settings: set HOME or XDG_CONFIG_HOME")]
    NoPlace,
    /// A name that no file can have.
    #[error("a look needs a name with letters or digits")]
    NoName,
    /// A name that is taken.
    #[error("{0}: there is a look of that name; choose another one")]
    Taken(String),
    /// The folder cannot be made.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// The file cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The file cannot be moved or removed.
    #[error("{}: cannot be changed ({reason}); check the folder and its permissions", file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// Why.
        reason: io::Error,
    },
}

/// A folder of files that a person names.
#[derive(Clone, Debug)]
pub struct Shelf(PathBuf);

impl Shelf {
    /// The shelf of a kind of things: `bregma/KIND` in the folder for settings; none where there is no such folder.
    pub fn of(kind: &str) -> Option<Self> {
        let set = |name: &str| std::env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
        let settings = set("XDG_CONFIG_HOME").or_else(|| set("APPDATA")).or_else(|| set("HOME").map(|home| home.join(".config")));
        settings.map(|folder| Self(folder.join("bregma").join(kind)))
    }

    /// A shelf in any folder.
    pub fn at(folder: &Path) -> Self {
        Self(folder.to_owned())
    }

    /// What stands there, by the names of the files.
    pub fn files(&self) -> Vec<PathBuf> {
        // What file managers leave there is nothing of ours, and neither is a folder.
        let is_own = |file: &PathBuf| file.is_file() && !file.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(b"."));
        let mut files: Vec<PathBuf> = fs::read_dir(&self.0).into_iter().flatten().flatten().map(|e| e.path()).filter(is_own).collect();
        files.sort();
        files
    }

    /// The file of what is called `name`.
    fn file_of(&self, name: &str) -> Result<PathBuf, ShelfError> {
        let safe = safe_name(name);
        let safe = safe.trim_start_matches('.');
        if safe.chars().any(char::is_alphanumeric) { Ok(self.0.join(format!("{safe}.json"))) } else { Err(ShelfError::NoName) }
    }

    /// Puts `text` there under a name; what had that name gives way to it.
    pub fn save(&self, name: &str, text: &str) -> Result<PathBuf, ShelfError> {
        let file = self.file_of(name)?;
        make_folder(&self.0)?;
        write_whole(&file, text.as_bytes())?;
        Ok(file)
    }

    /// Puts `text` in the place of `file` under another name, which nothing else has.
    pub fn rename(&self, file: &Path, name: &str, text: &str) -> Result<PathBuf, ShelfError> {
        let to = self.file_of(name)?;
        if to != file && to.exists() {
            return Err(ShelfError::Taken(name.into()));
        }
        write_whole(&to, text.as_bytes())?;
        if to != file {
            self.delete(file)?;
        }
        Ok(to)
    }

    /// Takes `file` away.
    pub fn delete(&self, file: &Path) -> Result<(), ShelfError> {
        fs::remove_file(file).map_err(|reason| ShelfError::File { file: file.to_owned(), reason })
    }
}

/// A name as that of a file: letters and digits of any script, and what is safe between them.
pub(crate) fn safe_name(name: &str) -> String {
    name.trim().chars().map(|c| if c.is_alphanumeric() || " -_+.".contains(c) { c } else { '_' }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_put_on_a_shelf_is_found_renamed_and_taken_away() {
        // Fails if a name leads out of the folder, two names meet in one file unseen, or renaming loses what another name has.
        let folder = std::env::temp_dir().join(format!("bregma-shelf-{}", std::process::id()));
        let shelf = Shelf::at(&folder);
        let file = shelf.save("Süd / 3", "one").unwrap();
        assert_eq!(file, folder.join("Süd _ 3.json"));
        let other = shelf.save("../../etc/x", "two").unwrap();
        assert!(other.parent() == Some(&folder) && shelf.files().len() == 2);
        assert!(matches!(shelf.save(" /. ", "none"), Err(ShelfError::NoName)));
        assert!(matches!(shelf.rename(&file, "../../etc/x", "lost"), Err(ShelfError::Taken(_))));
        assert_eq!((fs::read_to_string(&file).unwrap(), fs::read_to_string(&other).unwrap()), ("one".into(), "two".into()));
        let renamed = shelf.rename(&file, "north", "one").unwrap();
        assert_eq!(shelf.files().len(), 2);
        shelf.delete(&renamed).unwrap();
        assert!(shelf.delete(&renamed).unwrap_err().to_string().contains("north.json"));
        fs::remove_dir_all(folder).unwrap();
    }
}
