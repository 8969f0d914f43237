//! *Keep the skull*: the skull without the head rest, the table or the arm that hangs on it.
//!
//! The skull is the largest island that is neither plate nor tube. What hangs on it and does not belong to it goes on beyond the scan, so that the
//! scan's box cuts it, and touches it in a small place. So the island is opened by ever larger balls, until the skull itself falls apart: what comes off
//! as one large piece that the box cuts, and hung on the rest by little for its size, is left out. A jaw within the scan, and a face that the box cuts
//! but that is grown to its skull, stay. What is grown together with the skull by as much bone as holds the skull itself cannot be told from it.

use crate::distances::squared_distances;
use crate::error::PartsError;
use crate::islands::Islands;
use crate::labels::{Labels, Part};
use crate::separate::Apart;
use bregma_field::{Grid, Progress, Samples, Surface};
use glam::{DMat3, DVec3};
use rayon::prelude::*;

/// A skull and what it was found by.
#[derive(Clone, Debug)]
pub struct WholeSkull {
    /// One part, the skull.
    pub labels: Labels,
    /// Radius of the largest ball at which something that hung on it came off, mm; 0 where nothing did.
    pub radius_mm: f64,
    /// Samples of its island that were left out.
    pub left_out: u64,
}

/// Radii that are tried, in units of the shortest spacing.
const RADII: [f64; 8] = [1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0];
/// A piece counts from this part of the island on; smaller ones go with their neighbour.
const PIECE: f64 = 0.02;
/// A piece hangs on the skull if it shares fewer faces of voxels with others than this times the two-thirds power of its voxels. A cube that lies on
/// something with one side has as many faces there as that power; the upper jaw of Cranium, at the first radius at which it comes off, 0.8 of it (638
/// faces, 22,740 voxels); a table that stands on a post, hardly any.
const HANGS: f64 = 0.1;
/// A skull whose largest piece holds less than this part of it has fallen apart.
const WHOLE: f64 = 0.5;
/// Islands smaller than this part of the largest are not looked at as skulls.
const RIVAL: f64 = 0.1;

/// The skull of a surface; see the module.
pub fn keep_the_skull(surface: &Surface, progress: &Progress) -> Result<WholeSkull, PartsError> {
    let grid = surface.volume.grid();
    let all = Islands::of_bone(surface, progress)?;
    let island = all.only(skull(&all, grid));
    let whole = island.sizes()[0];
    let cut = opened(&island, grid, progress)?;
    let numbers = match &cut {
        Some((_, off)) => off.par_iter().zip(island.mask()).map(|(&off, bone)| u8::from(bone && !off)).collect(),
        None => island.mask().into_par_iter().map(u8::from).collect::<Vec<u8>>(),
    };
    let left_out = whole - numbers.par_iter().map(|&n| u64::from(n)).sum::<u64>();
    let labels = Labels::new(grid.clone(), Samples::U8(numbers), vec![Part::new(1, "Skull".to_owned())])?;
    Ok(WholeSkull { labels, radius_mm: cut.map_or(0.0, |(radius_mm, _)| radius_mm), left_out })
}

/// The island that is largest when those that are flat or long count less.
fn skull(islands: &Islands, grid: &Grid) -> usize {
    let rivals = islands.at_least(islands.sizes()[0] as f64 * RIVAL);
    let weight = |n: usize| islands.sizes()[n] as f64 * roundness(islands, n, grid);
    (0..rivals).fold((0, f64::NEG_INFINITY), |best, n| if weight(n) > best.1 { (n, weight(n)) } else { best }).0
}

/// How near an island's samples come to lying as a ball's do: the geometric mean of their three principal variances over the arithmetic one, 1 for a
/// ball, 0 for a plane or a line. It needs no axes, as these are the third root of the determinant and a third of the trace.
fn roundness(islands: &Islands, number: usize, grid: &Grid) -> f64 {
    let [_, ny, nz] = islands.dims();
    let (mut count, mut sum, mut products) = (0.0, DVec3::ZERO, DMat3::ZERO);
    for row in 0..ny * nz {
        for (run, _) in islands.row(row).filter(|(_, island)| *island == number) {
            let [first, last, n] = [f64::from(run.first), f64::from(run.end - 1), f64::from(run.end - run.first)];
            let middle = DVec3::new(0.5 * (first + last), (row % ny) as f64, (row / ny) as f64);
            count += n;
            sum += n * middle;
            products += n * outer(middle);
            // Of whole numbers about their mean.
            products.x_axis.x += n * (n * n - 1.0) / 12.0;
        }
    }
    let middle = sum / count;
    let matrix = grid.index_to_world().matrix3;
    let variance = matrix * (products * (1.0 / count) - outer(middle)) * matrix.transpose();
    let trace = variance.x_axis.x + variance.y_axis.y + variance.z_axis.z;
    if trace > 0.0 { variance.determinant().max(0.0).cbrt() / (trace / 3.0) } else { 0.0 }
}

fn outer(v: DVec3) -> DMat3 {
    DMat3::from_cols(v * v.x, v * v.y, v * v.z)
}

/// The last radius at which a piece comes off, with the samples of all that do.
fn opened(island: &Islands, grid: &Grid, progress: &Progress) -> Result<Option<(f64, Vec<bool>)>, PartsError> {
    let whole = island.sizes()[0] as f64;
    let spacing_mm = grid.spacing_mm();
    let squares = squared_distances(island, spacing_mm, progress)?;
    let mut came_off: Option<(f64, Vec<bool>)> = None;
    for radius_mm in RADII.map(|n| n * spacing_mm.min_element()) {
        let apart = Apart::at(island, &squares, radius_mm, spacing_mm, whole * PIECE, progress)?;
        if apart.sizes.first().is_none_or(|&size| (size as f64) < WHOLE * whole) {
            break;
        }
        let (cut, shared) = (cut_by_the_box(&apart, island.dims()), shared_faces(&apart, island.dims()));
        let hangs = |n: usize| (shared[n] as f64) < HANGS * (apart.sizes[n - 1] as f64).powf(2.0 / 3.0);
        // The first is the skull, which may be cut itself.
        let is_off: Vec<bool> = (0..=apart.sizes.len()).map(|n| n > 1 && cut[n] && hangs(n)).collect();
        if is_off.contains(&true) {
            let off = came_off.map_or_else(|| vec![false; apart.owner.len()], |(_, off)| off);
            let both = off.into_par_iter().zip(&apart.owner).map(|(off, &n)| off || is_off[usize::from(n)]);
            came_off = Some((radius_mm, both.collect()));
        }
    }
    Ok(came_off)
}

/// For each number from 0 how many faces its part shares with others.
fn shared_faces(apart: &Apart, [nx, ny, nz]: [usize; 3]) -> Vec<u64> {
    let owner = &apart.owner;
    let count = apart.sizes.len() + 1;
    let slice = |k: usize| {
        let mut shared = vec![0; count];
        let mut add = |a: u16, b: u16| {
            if a != b && a > 0 && b > 0 {
                shared[usize::from(a)] += 1;
                shared[usize::from(b)] += 1;
            }
        };
        for n in k * nx * ny..(k + 1) * nx * ny {
            if owner[n] > 0 {
                let (i, j) = (n % nx, n / nx % ny);
                [(i + 1 < nx, 1), (j + 1 < ny, nx), (k + 1 < nz, nx * ny)]
                    .iter()
                    .filter(|(is_in, _)| *is_in)
                    .for_each(|(_, by)| add(owner[n], owner[n + by]));
            }
        }
        shared
    };
    (0..nz).into_par_iter().map(slice).reduce(|| vec![0; count], |a, b| a.iter().zip(b).map(|(a, b)| a + b).collect())
}

/// For each number from 0 whether a sample of its part lies in a face of the grid.
fn cut_by_the_box(apart: &Apart, [nx, ny, nz]: [usize; 3]) -> Vec<bool> {
    let mut cut = vec![false; apart.sizes.len() + 1];
    for (row, owner) in apart.owner.chunks(nx).enumerate() {
        let is_face = [0, ny - 1].contains(&(row % ny)) || [0, nz - 1].contains(&(row / ny));
        if is_face {
            owner.iter().for_each(|&n| cut[usize::from(n)] = true);
        } else {
            [owner[0], owner[nx - 1]].into_iter().for_each(|n| cut[usize::from(n)] = true);
        }
    }
    cut
}

#[cfg(test)]
mod tests;
