//! A scan as the person names it.

use bregma_field::Progress;
use bregma_field::formats::{self, Hints, OpenError, RawLayout, RawLayoutError, Reduce, Scan, Uneven};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::str::FromStr;

/// A scan as the person names it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Source {
    /// The file; in a session relative to the session's folder.
    pub file: PathBuf,
    /// Its spacing, where the file does not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spacing_mm: Option<DVec3>,
    /// Its layout, where it has no header.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub raw: Option<Raw>,
    /// Only every 2nd or 4th sample along each axis is read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reduce: Option<Reduce>,
    /// What is done with slices that are not evenly spaced.
    #[serde(default, skip_serializing_if = "Uneven::is_default")]
    pub uneven: Uneven,
    /// A registration file that moves it; a session holds the matrix in its scene instead.
    #[serde(skip)]
    pub transform: Option<PathBuf>,
}

impl Source {
    /// What it is called: its file's name.
    pub fn name(&self) -> String {
        self.file.file_name().unwrap_or(self.file.as_os_str()).to_string_lossy().into_owned()
    }

    /// Reads the headers of the scan.
    pub fn scan(&self, progress: &Progress) -> Result<Scan, OpenError> {
        let raw = self.raw.as_ref().map(|raw| raw.layout);
        let hints = Hints { spacing_mm: self.spacing_mm, raw, reduce: self.reduce, uneven: self.uneven, series: None };
        formats::scan(&self.file, &hints, progress)
    }
}

/// The layout of a headerless file; files keep it in the words of `--raw` that the person wrote.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Raw {
    words: String,
    layout: RawLayout,
}

impl FromStr for Raw {
    type Err = RawLayoutError;

    fn from_str(words: &str) -> Result<Self, RawLayoutError> {
        Ok(Self { words: words.to_owned(), layout: words.parse()? })
    }
}

impl TryFrom<String> for Raw {
    type Error = RawLayoutError;

    fn try_from(words: String) -> Result<Self, RawLayoutError> {
        words.parse()
    }
}

impl From<Raw> for String {
    fn from(raw: Raw) -> Self {
        raw.words
    }
}
