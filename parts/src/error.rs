//! Why there are no parts, each a sentence for the person.

use bregma_field::formats::{OpenError, WriteError};
use bregma_field::{Cancelled, VolumeError};
use std::path::PathBuf;
use thiserror::Error;

/// Why there are no parts.
#[derive(Debug, Error)]
pub enum PartsError {
    /// Nothing is inside.
    #[error("{scan}: none of its samples is bone at this isovalue; choose another")]
    NoBone {
        /// The scan.
        scan: String,
    },
    /// All parts are smaller than what was asked for.
    #[error("{scan}: none of its parts is larger than {least_mm3} mm³; ask for smaller ones")]
    AllSmaller {
        /// The scan.
        scan: String,
        /// What was asked for.
        least_mm3: f64,
    },
    /// A neck that is no length.
    #[error("a neck of {0} mm is none; it must be a positive number of millimetres")]
    Neck(f64),
    /// Fewer than two parts to grow from.
    #[error("{scan}: parts grow from two or more that are painted on bone; paint another one")]
    Seeds {
        /// The scan.
        scan: String,
    },
    /// A surface that closes nothing.
    #[error("{}: its surface is open: {edges} of its edges have no second triangle; close it in the program that it is from", file.display())]
    OpenSurface {
        /// The surface.
        file: PathBuf,
        /// Edges with an odd number of triangles.
        edges: usize,
    },
    /// A length that smooths nothing.
    #[error("smoothing by {0} mm is none; it must be a positive number of millimetres")]
    Smooth(f64),
    /// A label map that cannot be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// A label map that cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// Samples that number no parts.
    #[error("{}: its samples are not all whole numbers from 0 to 65535, so that it is no label map; name one", .0.display())]
    NotNumbers(PathBuf),
    /// A segment that says something else than is possible.
    #[error("{}: its segment {segment} has {field} {value:?}, which {problem}; correct the header", file.display())]
    Segment {
        /// The label map.
        file: PathBuf,
        /// The segment, as its header counts.
        segment: usize,
        /// The field.
        field: &'static str,
        /// What stands there.
        value: String,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// A label map of another place.
    #[error("{}: it labels nothing within {scan}; name the label map of this scan", file.display())]
    Elsewhere {
        /// The label map.
        file: PathBuf,
        /// The scan.
        scan: String,
    },
    /// More parts than numbers.
    #[error("there are more than 65535 parts; leave small ones out")]
    TooMany,
    /// A grid and its labels do not belong together.
    #[error(transparent)]
    Volume(#[from] VolumeError),
    /// Stopped by request.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
