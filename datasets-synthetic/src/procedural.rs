//! Scans of any size that are in no file and never whole in memory: their slices are worked out as they are read.

use crate::{Which, skull};
use bregma_volume::formats::Scan;
use bregma_volume::{Grid, Progress, ReadSamples, Samples, Unit};
use glam::{DMat3, DVec3};
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::str::FromStr;
use std::sync::OnceLock;

/// What such a scan shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// A tube with marbles about it along a helix, each smaller than the one below, as in the 2024 thesis's second group (its figure 4.1): how many
    /// are seen tells what a picture resolves.
    Marbles,
    /// Menger's sponge: holes of every size down to a sample, and no place without surface.
    Menger,
    /// The skull A at 96 samples, side by side with its mirror images until the grid is full.
    Skulls,
}

/// A scan by its name: `marbles:3072x3072x3328`, `menger:729`, `skulls:2048`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Procedural {
    kind: Kind,
    dims: [usize; 3],
}

const NAMES: [(&str, Kind); 3] = [("marbles", Kind::Marbles), ("menger", Kind::Menger), ("skulls", Kind::Skulls)];
/// More along a side are not scanned by anyone.
const MOST: usize = 1 << 14;

impl FromStr for Procedural {
    type Err = String;

    fn from_str(words: &str) -> Result<Self, String> {
        let known = || {
            let (name, size) = words.split_once(':')?;
            let kind = NAMES.iter().find(|(known, _)| *known == name)?.1;
            let sides: Vec<usize> = size.split('x').map(|n| n.parse().ok().filter(|n| (2..=MOST).contains(n))).collect::<Option<_>>()?;
            let dims = if let [side] = sides[..] { [side; 3] } else { sides.try_into().ok()? };
            Some(Self { kind, dims })
        };
        known().ok_or_else(|| format!("there is no built-in scan {words}: marbles:N, menger:N and skulls:N are, with N or NxMxL samples"))
    }
}

impl Procedural {
    /// The scan. HU of about bone and air, 0.1 mm between samples.
    pub fn scan(self) -> Scan {
        let Self { kind, dims } = self;
        let name = NAMES.iter().find(|(_, known)| *known == kind).map_or("", |(name, _)| name);
        let grid = Grid::new(dims, DVec3::splat(0.1), DVec3::ZERO, DMat3::IDENTITY).expect("a few samples at even distances");
        match kind {
            Kind::Marbles => Scan::made(name, grid, Unit::Hounsfield, move |k| marbles(dims, k)),
            Kind::Menger => Scan::made(name, grid, Unit::Hounsfield, move |k| menger(dims, k)),
            Kind::Skulls => {
                let tile = OnceLock::new();
                Scan::made(name, grid, Unit::Hounsfield, move |k| skulls(tile.get_or_init(Tile::new), dims, k))
            }
        }
    }
}

const AIR_HU: f64 = -1000.0;
const BONE_HU: f64 = 1200.0;
/// Either way of what a sample would be: a CT's noise is as wide, if not as evenly spread.
const NOISE_HU: i16 = 24;

/// A slice of `dims` samples whose row j `row` fills with HU, and to which noise is added that depends on the place alone.
fn slice([nx, ny, _]: [usize; 3], k: usize, row: impl Fn(usize, &mut [f64]) + Sync) -> Vec<i16> {
    let mut samples = vec![0_i16; nx * ny];
    samples.par_chunks_mut(nx).enumerate().for_each_init(
        || vec![0.0; nx],
        |hu, (j, samples)| {
            row(j, hu);
            let mut random = ((k * ny + j) as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
            for (sample, hu) in samples.iter_mut().zip(hu) {
                // Xorshift (Marsaglia 2003).
                random ^= random << 13;
                random ^= random >> 7;
                random ^= random << 17;
                let noise = ((random >> 32) % (2 * NOISE_HU as u64 + 1)) as i16;
                *sample = hu.round() as i16 + noise - NOISE_HU;
            }
        },
    );
    samples
}

/// Bone where `depth` is positive, with an edge two samples wide as a scanner's blur makes it.
fn edge(depth: f64) -> f64 {
    AIR_HU + (BONE_HU - AIR_HU) * (0.5 + 0.5 * depth).clamp(0.0, 1.0)
}

const MARBLES: usize = 60;

fn marbles(dims: [usize; 3], k: usize) -> Vec<i16> {
    let side = dims[0].min(dims[1]) as f64;
    let middle = [dims[0], dims[1]].map(|n| (n - 1) as f64 / 2.0);
    // Six turns upward, each marble smaller by as much, the last two samples wide at 512.
    let marble = |n: usize| {
        let part = (n as f64 + 0.5) / MARBLES as f64;
        let [sin, cos] = [(6.0 * TAU * part).sin(), (6.0 * TAU * part).cos()];
        let radius = side * (0.05 * (1.0 - part) + 0.0015);
        ([middle[0] + 0.38 * side * cos, middle[1] + 0.38 * side * sin, part * dims[2] as f64], radius)
    };
    let near: Vec<([f64; 3], f64)> = (0..MARBLES).map(marble).filter(|(at, radius)| (at[2] - k as f64).abs() < radius + 2.0).collect();
    slice(dims, k, |j, row| {
        let y = j as f64 - middle[1];
        for (i, hu) in row.iter_mut().enumerate() {
            let x = i as f64 - middle[0];
            let from_wall = (x.hypot(y) - 0.27 * side).abs();
            *hu = edge(0.02 * side - from_wall);
        }
        for (at, radius) in &near {
            let (dy, dz) = (j as f64 - at[1], k as f64 - at[2]);
            let reach = ((radius + 2.0).powi(2) - dy * dy - dz * dz).max(0.0).sqrt();
            let first = (at[0] - reach).ceil().max(0.0) as usize;
            for i in first..((at[0] + reach).floor() as usize + 1).min(row.len()).max(first) {
                let distance = (i as f64 - at[0]).hypot(dy).hypot(dz);
                row[i] = row[i].max(edge(radius - distance));
            }
        }
    })
}

fn menger(dims: [usize; 3], k: usize) -> Vec<i16> {
    let side = dims.into_iter().max().unwrap_or(1);
    let levels = (0..).take_while(|n| 3_usize.pow(*n) < side).count() as u32;
    // A place is a hole where, at some level, at least two of its three digits to the base 3 are 1.
    slice(dims, k, |j, row| {
        for (i, hu) in row.iter_mut().enumerate() {
            let (mut at, mut is_bone) = ([i, j, k], true);
            for _ in 0..levels {
                is_bone &= at.iter().filter(|n| **n % 3 == 1).count() < 2;
                at = at.map(|n| n / 3);
            }
            *hu = if is_bone { BONE_HU } else { AIR_HU };
        }
    })
}

/// The samples that are repeated.
struct Tile {
    dims: [usize; 3],
    samples: Vec<i16>,
}

/// Samples along the longest side of a tile.
const TILE: usize = 96;

impl Tile {
    fn new() -> Self {
        let volume = skull(Which::A, TILE, &Progress::default()).expect("nobody stops it");
        let Samples::I16(samples) = volume.samples().clone() else { unreachable!("the skulls are whole HU") };
        Self { dims: volume.grid().dims(), samples }
    }

    /// Sample number n along a side, there and back.
    fn folded(&self, n: usize, axis: usize) -> usize {
        let period = 2 * (self.dims[axis] - 1);
        let at = n % period;
        at.min(period - at)
    }
}

fn skulls(tile: &Tile, dims: [usize; 3], k: usize) -> Vec<i16> {
    let z = tile.folded(k, 2);
    let mut samples = vec![0; dims[0] * dims[1]];
    samples.par_chunks_mut(dims[0]).enumerate().for_each(|(j, row)| {
        let from = &tile.samples[(z * tile.dims[1] + tile.folded(j, 1)) * tile.dims[0]..][..tile.dims[0]];
        row.iter_mut().enumerate().for_each(|(i, sample)| *sample = from[tile.folded(i, 0)]);
    });
    samples
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Random;

    fn opened(name: &str) -> bregma_volume::Volume {
        name.parse::<Procedural>().unwrap().scan().load(&Progress::default()).unwrap()
    }

    #[test]
    fn scans_are_what_their_names_say_whatever_part_is_looked_at() {
        // Fails if a size is read wrong, a slice depends on those before it, or a sponge's solid part is not (20/27)^levels.
        let sponge = opened("menger:27");
        let Samples::I16(samples) = sponge.samples() else { panic!("the samples are i16") };
        assert_eq!(samples.iter().filter(|s| **s > 0).count(), 20_usize.pow(3));
        let Samples::I16(samples) = opened("menger:9").samples().clone() else { panic!("the samples are i16") };
        let off = samples.iter().map(|s| (f64::from(*s) - if *s > 0 { BONE_HU } else { AIR_HU }) as i16);
        assert_eq!((off.clone().min(), off.max()), (Some(-NOISE_HU), Some(NOISE_HU)));
        let marbles = opened("marbles:40x48x60");
        assert_eq!(marbles.grid().dims(), [40, 48, 60]);
        assert_eq!(marbles.content(), opened("marbles:40x48x60").content());
        let skulls = opened("skulls:200x100x210");
        let Samples::I16(samples) = skulls.samples() else { panic!("the samples are i16") };
        let tile = Tile::new();
        let mut random = Random(3);
        for _ in 0..1000 {
            let at = [200, 100, 210].map(|n| (random.unit() * f64::from(n)) as usize);
            let folded: [usize; 3] = std::array::from_fn(|a| tile.folded(at[a], a));
            let number = |[i, j, k]: [usize; 3], [nx, ny, _]: [usize; 3]| (k * ny + j) * nx + i;
            assert_eq!(samples[number(at, [200, 100, 210])], tile.samples[number(folded, tile.dims)]);
        }
        for wrong in ["menger", "menger:", "menger:1", "menger:4x4", "sponge:9", "menger:99999", "C:scan.nrrd"] {
            assert!(wrong.parse::<Procedural>().is_err(), "{wrong}");
        }
    }
}
