//! A scan as the person names it.

use crate::labelled::Labelled;
use crate::parts::PartOf;
use bregma_field::formats::{self, Hints, OpenError, RawLayout, RawLayoutError, Reduce, Scan, Uneven};
use bregma_field::{Cancelled, Correction, Progress, Turn, Volume};
use bregma_synthetic::{Procedural, Which};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::str::FromStr;

/// A scan as the person names it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Source {
    /// The file; in a session relative to the session's folder.
    pub file: PathBuf,
    /// What the person calls it, where that is not its file's name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub called: Option<String>,
    /// Its spacing, where the file does not say, or instead of what it says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spacing_mm: Option<DVec3>,
    /// How it is turned.
    #[serde(default, skip_serializing_if = "Turn::is_none")]
    pub turn: Turn,
    /// Its layout, where it has no header.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub raw: Option<Raw>,
    /// Only every 2nd or 4th sample along each axis is read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reduce: Option<Reduce>,
    /// What is done with slices that are not evenly spaced.
    #[serde(default, skip_serializing_if = "Uneven::is_default")]
    pub uneven: Uneven,
    /// The part of it that is meant.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub within: Option<PartOf>,
    /// Its parts, where they are known; they are in no file yet where `within` names none.
    #[serde(skip)]
    pub labels: Option<Labelled>,
    /// The skull of the built-in pair that it is, instead of a file; `file` is its name then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub built_in: Option<BuiltIn>,
    /// A registration file that moves it; a session holds the matrix in its scene instead.
    #[serde(skip)]
    pub transform: Option<PathBuf>,
}

impl Source {
    /// What it is called: as the person says, else its file's name.
    pub fn name(&self) -> String {
        self.called.clone().unwrap_or_else(|| self.file_name())
    }

    /// The name of its file.
    pub fn file_name(&self) -> String {
        self.file.file_name().unwrap_or(self.file.as_os_str()).to_string_lossy().into_owned()
    }

    /// A skull of the built-in pair.
    pub fn built_in(which: Which, samples: usize) -> Self {
        let built_in = BuiltIn { which, samples };
        Self { file: built_in.name().into(), built_in: Some(built_in), ..Self::default() }
    }

    /// The same with its file named from the root on; what is built in has no place. A label map that is in a file is left to that.
    pub fn absolute(&self) -> Self {
        let has_no_file = self.built_in.is_some() || self.procedural().is_some();
        let file = if has_no_file { Ok(self.file.clone()) } else { std::path::absolute(&self.file) };
        let within = self.within.as_ref().map(PartOf::absolute);
        let labels = self.labels.clone().filter(|_| within.is_none());
        Self { file: file.unwrap_or_else(|_| self.file.clone()), within, labels, ..self.clone() }
    }

    /// The scan in no file that it names, such as `menger:729`, where no file has that name.
    fn procedural(&self) -> Option<Procedural> {
        self.file.to_str()?.parse().ok().filter(|_| !self.file.exists())
    }

    /// Reads the headers of the scan.
    pub fn scan(&self, progress: &Progress) -> Result<Scan, OpenError> {
        let raw = self.raw.as_ref().map(|raw| raw.layout);
        let hints =
            Hints { spacing_mm: self.spacing_mm, turn: self.turn, raw, reduce: self.reduce, uneven: self.uneven, ..Hints::default() };
        let scan = match self.procedural() {
            Some(procedural) => {
                let placed = procedural.scan().placed(&hints);
                placed.map_err(|e| OpenError { file: self.file.clone(), reason: e.into() })?
            }
            None => formats::scan(&self.file, &hints, progress)?,
        };
        Ok(if let Some(name) = &self.called { scan.renamed(name) } else { scan })
    }

    /// What the person corrected of where it lies.
    pub fn correction(&self) -> Correction {
        Correction { spacing_mm: self.spacing_mm, turn: self.turn }
    }
}

/// One of the two built-in skulls, with so many samples along its longest side; files keep it as its letter and that number.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct BuiltIn {
    which: Which,
    samples: usize,
}

/// More would not be a demonstration, and a damaged session asks for no more memory than this takes.
const MOST_SAMPLES: usize = 512;

impl BuiltIn {
    /// What it is called.
    pub fn name(self) -> &'static str {
        if self.which == Which::A { "skull A" } else { "skull B" }
    }

    /// Makes its scan.
    pub fn scan(self, progress: &Progress) -> Result<Volume, Cancelled> {
        bregma_synthetic::skull(self.which, self.samples, progress)
    }
}

impl TryFrom<String> for BuiltIn {
    type Error = String;

    fn try_from(words: String) -> Result<Self, String> {
        let which = [("A", Which::A), ("B", Which::B)].into_iter().find_map(|(letter, which)| Some((which, words.strip_prefix(letter)?)));
        let known = which.and_then(|(which, samples)| Some(Self { which, samples: samples.trim().parse().ok()? }));
        known.filter(|known| (2..=MOST_SAMPLES).contains(&known.samples)).ok_or_else(|| format!("there is no built-in skull {words}"))
    }
}

impl From<BuiltIn> for String {
    fn from(BuiltIn { which, samples }: BuiltIn) -> Self {
        format!("{} {samples}", if which == Which::A { "A" } else { "B" })
    }
}

/// The layout of a headerless file; files keep it in the words of `--raw` that the person wrote.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Raw {
    words: String,
    layout: RawLayout,
}

impl From<RawLayout> for Raw {
    fn from(layout: RawLayout) -> Self {
        Self { words: layout.to_string(), layout }
    }
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
