//! How pictures are encoded, and what that can fail by.

use crate::output::OutputError;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use thiserror::Error;

/// All endings, for sentences.
pub const ENDINGS: &str = ".png, .tif, .exr, .jpg, .pdf or .svg";

/// Why a picture was not written; nothing is there then that was not before.
#[derive(Debug, Error)]
pub enum FileError {
    /// Its name says no form.
    #[error("{}: is no picture by its name; end it in {ENDINGS}", .0.display())]
    Ending(PathBuf),
    /// The form cannot hold what was asked for.
    #[error("{}: {what}", file.display())]
    Cannot {
        /// The file.
        file: PathBuf,
        /// What it cannot, and what to do.
        what: String,
    },
    /// Encoding it failed.
    #[error("{}: the picture cannot be encoded ({reason})", file.display())]
    Encode {
        /// The file.
        file: PathBuf,
        /// Why.
        reason: Box<dyn std::error::Error + Send + Sync>,
    },
    /// A file of a colour profile.
    #[error("{}: {what}", file.display())]
    Profile {
        /// The file.
        file: PathBuf,
        /// What is wrong with it.
        what: String,
    },
    /// The file cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// How a picture is encoded.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Encoding {
    /// 16 bits a channel instead of 8, in PNG and TIFF.
    #[serde(default)]
    pub is_deep: bool,
    /// The profile of a printer, CMYK, by its file: TIFF in its inks.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub icc: Option<PathBuf>,
}

/// What encoding can fail by.
pub type Failure = Box<dyn std::error::Error + Send + Sync>;
