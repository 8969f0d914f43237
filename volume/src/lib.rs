//! What a scan is: samples on a grid in the world, what their numbers mean, and how files become that.
//!
//! Data flows one way: one of the [`formats`] turns a file's headers into a [`formats::Scan`]; its samples stream into a [`Raster`], which
//! [`Volume::new`] checks and indexes. Who depends on this package can read them again, by [`ReadSamples`]; the others ask `bregma-field`.

mod content;
pub mod formats;
mod grid;
mod histogram;
mod keep;
mod mesh;
mod placing;
mod progress;
mod ranges;
mod registration;
mod replace;
mod samples;
mod summary;
mod turn;
mod volume;

pub use grid::{Grid, GridError, IndexPoint, WorldPoint};
pub use histogram::{Histogram, Otsu};
pub use keep::{Keep, KeepError};
pub use mesh::{Mesh, read_mesh};
pub use placing::{Correction, Placing};
pub use progress::{Cancelled, Progress};
pub use ranges::{BRICK, RangeBricks};
pub use registration::{Covariance, Registration, TransformError, TransformForm, read_transform, write_transform};
pub use replace::replace_file;
pub use samples::{Sample, Samples};
pub use summary::{ScaleError, Summary, Unit};
pub use turn::{Turn, TurnError};
pub use volume::{Metadata, Raster, ReadSamples, Volume, VolumeError};
