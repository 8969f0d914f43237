//! *Keep the skull*: the skull without the head rest, the table or the arm that hangs on it.
//!
//! The skull is the largest island that is neither plate nor tube. What hangs on it and does not belong to it goes on beyond the scan, so that the
//! scan's box cuts it; a jaw or a tooth lies within. So the island is opened by ever larger balls: at the smallest radius at which a large piece comes
//! off that the box cuts, and from which on nothing more comes off for the next two radii, that piece is left out. Where no radius does so, or the
//! skull itself falls apart before, all of the island is kept: what hangs on it by as much bone as holds itself together cannot be told from it.

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
    /// Radius of the ball at which what hung on it came off, mm; 0 where nothing did.
    pub radius_mm: f64,
    /// Samples of its island that were left out.
    pub left_out: u64,
}

/// Radii that are tried, in units of the shortest spacing.
const RADII: [f64; 8] = [1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0];
/// What comes off counts from this part of the island on: less is a process of the skull that the box cuts, or noise.
const STEP: f64 = 0.05;
/// What still comes off at the next two radii is less than this part, if it is a step and not a skull that wears away.
const STAYS: f64 = 0.02;
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

/// The radius at which a piece comes off, with the samples that do.
fn opened(island: &Islands, grid: &Grid, progress: &Progress) -> Result<Option<(f64, Vec<bool>)>, PartsError> {
    let whole = island.sizes()[0] as f64;
    let spacing_mm = grid.spacing_mm();
    let squares = squared_distances(island, spacing_mm, progress)?;
    let mut came_off: Option<(f64, Vec<bool>, f64, usize)> = None;
    for radius_mm in RADII.map(|n| n * spacing_mm.min_element()) {
        let apart = Apart::at(island, &squares, radius_mm, spacing_mm, whole * STAYS, progress)?;
        if apart.sizes.first().is_none_or(|&size| (size as f64) < WHOLE * whole) {
            break;
        }
        let cut = cut_by_the_box(&apart, island.dims());
        // The first is the skull, which may be cut itself.
        let is_off = |n: usize| n > 1 && cut[n];
        let part: f64 = (2..=apart.sizes.len()).filter(|&n| is_off(n)).map(|n| apart.sizes[n - 1] as f64).sum::<f64>() / whole;
        let stays = came_off.as_ref().is_some_and(|(_, _, before, _)| (part - before).abs() < STAYS);
        came_off = match came_off {
            Some((radius, off, _, 1)) if stays => return Ok(Some((radius, off))),
            Some((radius, off, before, steps)) if stays => Some((radius, off, before, steps + 1)),
            _ if part >= STEP => Some((radius_mm, apart.owner.par_iter().map(|&n| is_off(usize::from(n))).collect(), part, 0)),
            _ => None,
        };
    }
    Ok(None)
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
