//! Why a file could not be read, each a sentence for the person.

use crate::grid::GridError;
use crate::progress::Cancelled;
use crate::volume::VolumeError;
use std::collections::TryReserveError;
use std::io;
use std::path::PathBuf;
use thiserror::Error;

/// A file that could not be opened, and why.
#[derive(Debug, Error)]
#[error("{}: {reason}", file.display())]
pub struct OpenError {
    /// The file as it was named.
    pub file: PathBuf,
    /// What is wrong, and what to do.
    pub reason: ReadError,
}

/// Bytes for people.
fn size(bytes: u64) -> String {
    let mib = bytes as f64 / f64::from(1 << 20);
    if mib < 1024.0 { format!("{mib:.1} MiB") } else { format!("{:.1} GiB", mib / 1024.0) }
}

fn offer(smaller: &[usize]) -> String {
    match smaller {
        [] => "use a machine with more, or cut the scan to what is needed".into(),
        [most, ..] => format!("close other programs, or open a preview with --reduce {most}"),
    }
}

/// What is wrong with a file, and what to do. The sentences continue "`file`: …".
#[derive(Debug, Error)]
pub enum ReadError {
    /// The operating system has no such file.
    #[error("there is no such file; check its name and folder")]
    NotFound,
    /// The operating system could not read it, or its compressed data is damaged.
    #[error("it cannot be read ({0}); check its rights, or copy it again from where it came")]
    Io(io::Error),
    /// A folder where a file is needed.
    #[error("it is a folder that no format here reads; name a file in it")]
    Directory,
    /// A pipe, socket or device.
    #[error("it is not a regular file; save it to disk first")]
    NotRegular,
    /// Nothing in a folder, a zip or a file that is an image.
    #[error("there is no image in it that could be a slice of a scan; name the folder or file that has the scan")]
    NoImages,
    /// Slices that are not evenly spaced.
    #[error(
        "its slices are not even: most are {usual_mm} mm apart, but {gaps}; find the missing ones, or pass --uneven resample to have them interpolated"
    )]
    Uneven {
        /// The usual distance of slices.
        usual_mm: f64,
        /// The odd ones, listed.
        gaps: String,
    },
    /// Pictures whose numbers have gaps.
    #[error("some of its pictures are missing: in their numbers, {0}; find them, or pass --uneven resample to have them interpolated")]
    Numbering(String),
    /// Data that cannot be unpacked or taken apart.
    #[error("it is damaged: {0}; copy it again from where it came")]
    Damaged(String),
    /// No bytes.
    #[error("it is empty; copy it again from where it came")]
    Empty,
    /// No format claims it.
    #[error("it is in none of the formats known here ({0}); convert it to one of them, or describe a headerless file with --raw")]
    UnknownFormat(String),
    /// A headerless file of unknown layout.
    #[error("it has no header and its name does not state its layout; pass --raw WxHxD,u8|u16|i16|f32[,be][,skip=N]")]
    NoLayout,
    /// Fewer bytes than its header, or `--raw`, asks for.
    #[error("it ends too early: {wanted} bytes of samples are needed, {there} are there; copy it again, or check its stated size")]
    Truncated {
        /// Bytes of samples, decompressed, that are needed.
        wanted: u128,
        /// Bytes of samples, decompressed, that are there.
        there: u64,
    },
    /// A compressed file too small for what its header promises.
    #[error("its header asks for {wanted} bytes of samples, more than its {compressed} compressed bytes can hold; copy it again")]
    CannotHold {
        /// Bytes of samples that the header asks for.
        wanted: u128,
        /// Length of the compressed data.
        compressed: u64,
    },
    /// A headerless file larger than its layout.
    #[error("it has {0} bytes more than the stated size, type and skip ask for; check --raw")]
    TooLong(u64),
    /// A header that breaks off.
    #[error("its header is not complete ({0}); copy it again from where it came")]
    NoHeader(&'static str),
    /// A line or field of the header that cannot be understood.
    #[error("the header's {field} is bad: {content:?}: {problem}; correct the header")]
    BadField {
        /// The field's name.
        field: String,
        /// The line or number as it stands in the file.
        content: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A field that has to be there.
    #[error("the header has no {0:?}, which is needed; add it")]
    MissingField(&'static str),
    /// Something that the format allows but this reader does not.
    #[error("{0}")]
    Unsupported(String),
    /// Two statements of the header that cannot both be true.
    #[error("its header contradicts itself: {0}; correct the header")]
    Contradiction(String),
    /// A data file beside the header, or one of many slices.
    #[error("its file {}: {reason}", file.display())]
    DataFile {
        /// The data file.
        file: PathBuf,
        /// What is wrong with it.
        reason: Box<ReadError>,
    },
    /// More samples than there is memory for, known beforehand.
    #[error("opening it needs {} of memory, {} are free; {}", size(*needed), size(*free), offer(smaller))]
    TooLarge {
        /// Bytes that it needs.
        needed: u64,
        /// Bytes that are free.
        free: u64,
        /// Which previews fit: every 2nd, every 4th sample.
        smaller: Vec<usize>,
    },
    /// More samples than there is memory for.
    #[error("its samples do not fit into memory: {0}; close other programs or reduce the scan")]
    Memory(#[from] TryReserveError),
    /// The grid cannot be used.
    #[error("{0}; correct the header")]
    Grid(#[from] GridError),
    /// The samples cannot be used.
    #[error(transparent)]
    Volume(#[from] VolumeError),
    /// Stopped by request.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl From<io::Error> for ReadError {
    /// A [`Cancelled`] that travelled through a reader becomes itself again.
    fn from(error: io::Error) -> Self {
        match error.kind() {
            _ if error.get_ref().is_some_and(|e| e.is::<Cancelled>()) => Self::Cancelled(Cancelled),
            io::ErrorKind::NotFound => Self::NotFound,
            _ => Self::Io(error),
        }
    }
}
