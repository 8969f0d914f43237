//! What lies between the samples of a scan, and the only package beside `bregma-volume` that reads them.
//!
//! **The rule**: reading a volume's samples is a trait of `bregma-volume`, [`ReadSamples`](bregma_volume::ReadSamples), which this package
//! does not pass on. Packages above know `bregma-volume` only by what is passed on below, so they cannot name the trait, and the compiler
//! refuses them the array. They ask a [`Store`] for a [`Block`], or for what is worked out here: the [`interpolant`], its [`crossings`]
//! with rays, the coefficients of its [`spline`]. (Who makes volumes, as phantoms and tests do, depends on `bregma-volume`.)

mod bounds;
pub mod clip;
pub mod crossings;
pub mod interpolant;
mod ray;
pub mod spline;
mod store;
mod surface;

pub use bounds::Bounds;
pub use bregma_volume::{
    BRICK, Cancelled, Grid, GridError, Histogram, IndexPoint, Metadata, Progress, RangeBricks, Raster, Sample, Samples, TransformError,
    Unit, Volume, VolumeError, WorldPoint, formats, read_transform, replace_file,
};
pub use clip::{Clip, Region, Shape};
pub use ray::Ray;
pub use store::{AnyBlock, Block, Store};
pub use surface::{Measured, Surface};
