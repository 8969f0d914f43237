//! What lies between the samples of a scan, and the only package beside `bregma-volume` that reads them.
//!
//! **The rule**: reading a volume's samples is a trait of `bregma-volume`, [`ReadSamples`](bregma_volume::ReadSamples), which this package
//! does not pass on. Packages above know `bregma-volume` only by what is passed on below, so they cannot name the trait, and the compiler
//! refuses them the array. They ask a [`Store`] for a [`Block`], or for what is worked out here: the [`interpolant`], its [`crossings`]
//! with rays, the coefficients of its [`spline`]. (Who makes volumes, as phantoms and tests do, depends on `bregma-volume`.)

mod bounds;
pub mod chord;
pub mod clip;
pub mod crossings;
pub mod filters;
mod flow;
pub mod interpolant;
mod ray;
mod smooth;
pub mod solid;
pub mod spline;
mod store;
mod surface;
mod trilinear;
mod within;

pub use bounds::Bounds;
pub use bregma_volume::{
    BRICK, Cancelled, Correction, Covariance, Grid, GridError, Histogram, IndexPoint, Keep, KeepError, Mesh, Metadata, Otsu, Placing,
    Progress, RangeBricks, Raster, Registration, Sample, Samples, Summary, TransformError, TransformForm, Turn, TurnError, Unit, Volume,
    VolumeError, WorldPoint, formats, read_mesh, read_transform, replace_file, write_transform,
};
pub use clip::{Clip, Region, Shape};
pub use ray::Ray;
pub use smooth::smoothed;
pub use solid::Solid;
pub use store::{AnyBlock, Block, Store};
pub use surface::{Measured, Surface, SurfaceError};
pub use within::within;

#[cfg(test)]
mod tests {
    use std::fs;

    #[test]
    fn only_who_makes_volumes_depends_on_their_package_beside_this_one() {
        // Fails if a package takes the way round the rule.
        let root = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
        let folders = fs::read_dir(root).unwrap().map(|entry| entry.unwrap().path());
        let depends = |manifest: String| manifest.lines().any(|line| line.starts_with("bregma-volume"));
        let mut found: Vec<String> = folders
            .filter(|folder| fs::read_to_string(folder.join("Cargo.toml")).is_ok_and(depends))
            .map(|folder| folder.file_name().unwrap().to_string_lossy().into_owned())
            .collect();
        found.sort();
        assert_eq!(found, ["datasets-synthetic", "field", "tests"]);
    }
}
