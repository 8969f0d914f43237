//! Phantoms whose answers are known: a pair of CT skulls and a few analytic solids.

pub mod analytic;
mod arch;
mod bones;
pub mod ct;
mod curves;
mod ovoid;
mod procedural;
mod random;
mod sdf;
pub mod skull;

use bregma_volume::{Cancelled, Grid, Progress, Raster, Samples, Unit, Volume};
use ct::Scanner;
use glam::{DMat3, DVec3, dvec3};
pub use ovoid::Foot;
pub use procedural::Procedural;
pub use random::Random;
pub use skull::{Skull, Which};

/// The scanner of the demo pair's skull `which`: a point spread about as wide as a voxel at 256 samples, since samples of a narrower one
/// show a smooth wall as rings.
pub fn scanner(which: Which) -> Scanner {
    Scanner { psf_sigma_mm: if which == Which::A { 0.8 } else { 1.0 }, noise_hu: 25.0, seed: which as u64 }
}

/// The grid of skull `which` with `size` samples along its longest side: A's is aligned with the world and isotropic; B's
/// has 7/8 as many samples, is turned by 4° and has thicker slices. Both hold the whole skull, in the same world.
pub fn skull_grid(which: Which, size: usize) -> Grid {
    // The skulls lie within x ±71, y −98…93, z −123…73.
    let (samples, extent_mm, flatten, direction) = match which {
        Which::A => (size, dvec3(154.0, 206.0, 206.0), DVec3::ONE, DMat3::IDENTITY),
        Which::B => {
            let turn = DMat3::from_axis_angle(dvec3(0.6, -0.5, 0.62).normalize(), 4.0_f64.to_radians());
            (size * 7 / 8, dvec3(166.0, 214.0, 214.0), dvec3(1.0, 1.0, 1.1), turn)
        }
    };
    // Two samples are the fewest that span a length.
    let spacing_mm = extent_mm.y / (samples.max(2) - 1) as f64 * flatten;
    let dims = (extent_mm / spacing_mm).to_array().map(|n| n.round() as usize + 1);
    let middle = dvec3(0.0, -4.0, -26.0);
    let last = DVec3::from(dims.map(|n| (n - 1) as f64));
    let origin = middle - direction * (0.5 * last * spacing_mm);
    Grid::new(dims, spacing_mm, origin, direction).expect("a rotated grid with positive spacing")
}

/// The scan of skull `which`, `size` samples along its longest side (B: 7/8 of that). Int16 HU.
pub fn skull(which: Which, size: usize, progress: &Progress) -> Result<Volume, Cancelled> {
    let grid = skull_grid(which, size);
    let hu = scanner(which).scan(&Skull::new(which), &grid, progress)?;
    let name = match which {
        Which::A => "skull A",
        Which::B => "skull B",
    };
    Ok(volume(name, grid, Samples::I16(hu), Unit::Hounsfield))
}

fn volume(name: &str, grid: Grid, samples: Samples, unit: Unit) -> Volume {
    let raster = Raster { grid, samples, slope: 1.0, intercept: 0.0, unit, warnings: Vec::new() };
    Volume::new(name.into(), "synthetic", raster).expect("one finite sample for each point of the grid")
}
