//! Islands of bone: samples that hang together by their faces.
//!
//! Two neighbours along an axis that are both inside are joined by the trilinear surface, always: between them the interpolant is linear, and both
//! its ends are inside. Two that meet only across a face's diagonal, the other two of that face being outside, are joined by it just where the
//! product of the inner two's distances from the level is at least that of the outer two (the asymptotic decider of Nielson and Hamann 1991), and
//! then by a bridge that is thinner than a voxel. Such bridges come and go with noise, so they hold nothing together here: samples belong to one
//! island by the 6 neighbours that share a face, which is certain, and what `scipy.ndimage.label` and ITK's connected components do by default.
//!
//! Rows are taken apart into runs; runs that touch are united (a union–find, its roots the first runs), slabs of slices side by side, and then
//! slabs with each other (He, Chao and Suzuki 2008, doi:10.1109/TIP.2007.914212, in three dimensions).

use crate::error::PartsError;
use crate::labels::{Labels, Part};
use bregma_field::{Block, Cancelled, Grid, Progress, Sample, Samples, Store, Surface, with_block};
use rayon::prelude::*;
use std::ops::Range;

/// Samples of a row, from `first` to the one before `end`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Run {
    /// The first.
    pub first: u32,
    /// The one behind the last.
    pub end: u32,
}

impl Run {
    pub(crate) fn range(self) -> Range<usize> {
        self.first as usize..self.end as usize
    }
}

/// All islands of a grid, the largest first; of two as large, the one whose first sample comes first.
#[derive(Debug)]
pub struct Islands {
    dims: [usize; 3],
    runs: Runs,
    /// For each run the number of its island, from 0.
    island: Vec<u32>,
    sizes: Vec<u64>,
}

/// Runs by rows; row j + ny·k has those from `starts[row]` to `starts[row + 1]`.
#[derive(Debug, Default)]
struct Runs {
    starts: Vec<usize>,
    runs: Vec<Run>,
}

impl Runs {
    fn of(&self, row: usize) -> Range<usize> {
        self.starts[row]..self.starts[row + 1]
    }
}

/// Slabs of slices that are worked on side by side: enough for threads to stay busy, and few enough for borders not to count.
const SLABS: usize = 32;

impl Islands {
    /// Of bone: samples at or beyond the surface's isovalue, whatever cuts leave of it. `progress` counts slices.
    pub fn of_bone(surface: &Surface, progress: &Progress) -> Result<Self, PartsError> {
        let store = Store::of(&surface.volume);
        let edge = edge(surface);
        let islands = with_block!(store.whole(), b => {
            if surface.sign > 0.0 {
                Self::find(store.dims(), |row, out| runs_of(row_of(&b, store.dims(), row), |v| v.to_f32() >= edge, out), progress)?
            } else {
                Self::find(store.dims(), |row, out| runs_of(row_of(&b, store.dims(), row), |v| v.to_f32() <= edge, out), progress)?
            }
        });
        if islands.sizes.is_empty() {
            return Err(PartsError::NoBone { scan: surface.volume.name().to_owned() });
        }
        Ok(islands)
    }

    /// Of what `row` says of each row j + ny·k: its runs, ascending and apart, pushed behind those that are there.
    pub(crate) fn find(dims: [usize; 3], row: impl Fn(usize, &mut Vec<Run>) + Sync, progress: &Progress) -> Result<Self, Cancelled> {
        let [_, ny, nz] = dims;
        progress.begin(nz as u64);
        let thick = nz.div_ceil(SLABS);
        let slab = |s: usize| {
            let slices = s * thick..((s + 1) * thick).min(nz);
            let found = slab(slices.clone(), ny, &row);
            progress.advance(slices.len() as u64).map(|()| found)
        };
        let slabs = (0..nz.div_ceil(thick)).into_par_iter().map(slab).collect::<Result<Vec<_>, _>>()?;
        let (mut runs, mut parents, mut borders) = (Runs { starts: vec![0], runs: vec![] }, vec![], vec![]);
        for (part, joined) in slabs {
            borders.push(runs.starts.len() - 1);
            let offset = runs.runs.len();
            runs.starts.extend(part.starts[1..].iter().map(|n| n + offset));
            runs.runs.extend(part.runs);
            parents.extend(joined.into_iter().map(|n| n + offset as u32));
        }
        for first in borders.into_iter().skip(1) {
            (first..first + ny).for_each(|row| unite(&runs, &mut parents, row - ny, row));
        }
        let (island, sizes) = numbered(&runs, parents);
        Ok(Self { dims, runs, island, sizes })
    }

    /// Samples along i, j and k.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// Samples of each island, the largest first.
    pub fn sizes(&self) -> &[u64] {
        &self.sizes
    }

    /// How many have at least so many samples: the first of them.
    pub fn at_least(&self, samples: f64) -> usize {
        self.sizes.partition_point(|&size| size as f64 >= samples)
    }

    /// The number, from 0, of the island that a sample belongs to, such as the one that was clicked on; `None` outside of all.
    pub fn at(&self, [i, j, k]: [usize; 3]) -> Option<usize> {
        let [nx, ny, nz] = self.dims;
        if i >= nx || j >= ny || k >= nz {
            return None;
        }
        self.row(j + ny * k).find(|(run, _)| run.range().contains(&i)).map(|(_, island)| island)
    }

    /// One of them alone.
    pub(crate) fn only(&self, number: usize) -> Self {
        let mut only =
            Self { dims: self.dims, runs: Runs { starts: vec![0], runs: vec![] }, island: vec![], sizes: vec![self.sizes[number]] };
        for row in 0..self.dims[1] * self.dims[2] {
            only.runs.runs.extend(self.row(row).filter(|(_, island)| *island == number).map(|(run, _)| run));
            only.runs.starts.push(only.runs.runs.len());
        }
        only.island = vec![0; only.runs.runs.len()];
        only
    }

    /// For each sample whether it belongs to any.
    pub(crate) fn mask(&self) -> Vec<bool> {
        self.filled(&vec![true; self.sizes.len()])
    }

    /// The runs of a row, each with the number of its island.
    pub(crate) fn row(&self, row: usize) -> impl Iterator<Item = (Run, usize)> + '_ {
        self.runs.of(row).map(|n| (self.runs.runs[n], self.island[n] as usize))
    }

    /// The labels of chosen islands: number n + 1 is what `chosen[n]` counts from 0, under the name beside it.
    pub fn labels(&self, grid: &Grid, chosen: &[(usize, String)]) -> Result<Labels, PartsError> {
        if chosen.len() > usize::from(u16::MAX) {
            return Err(PartsError::TooMany);
        }
        let mut numbers = vec![0_u16; self.sizes.len()];
        chosen.iter().zip(1..).for_each(|((island, _), number)| numbers[*island] = number);
        let samples = if chosen.len() <= usize::from(u8::MAX) {
            let bytes: Vec<u8> = numbers.iter().map(|&n| n as u8).collect();
            Samples::U8(self.filled(&bytes))
        } else {
            Samples::U16(self.filled(&numbers))
        };
        let parts = chosen.iter().zip(1..).map(|((_, name), number)| Part::new(number, name.clone())).collect();
        Labels::new(grid.clone(), samples, parts)
    }

    fn filled<T: Copy + Default + Send + Sync>(&self, numbers: &[T]) -> Vec<T> {
        let mut samples = vec![T::default(); self.dims.iter().product()];
        samples.par_chunks_mut(self.dims[0]).enumerate().for_each(|(row, samples)| {
            self.row(row).for_each(|(run, island)| samples[run.range()].fill(numbers[island]));
        });
        samples
    }
}

/// The last float32 that counts as the level: samples are float32 or widen to it exactly, so that comparing with this one is comparing with the level.
fn edge(surface: &Surface) -> f32 {
    let near = surface.level as f32;
    let is_outside = f64::from(surface.sign) * (f64::from(near) - surface.level) < 0.0;
    match is_outside {
        false => near,
        true if surface.sign > 0.0 => near.next_up(),
        true => near.next_down(),
    }
}

fn row_of<'a, T: Sample>(block: &Block<'a, T>, [nx, ny, _]: [usize; 3], row: usize) -> &'a [T] {
    &block.onward([0, row % ny, row / ny])[..nx]
}

/// The runs of what is inside.
pub(crate) fn runs_of<T: Copy>(row: &[T], is_inside: impl Fn(T) -> bool, out: &mut Vec<Run>) {
    let mut from = 0;
    while let Some(n) = row[from..].iter().position(|&v| is_inside(v)) {
        let first = from + n;
        let end = row[first..].iter().position(|&v| !is_inside(v)).map_or(row.len(), |n| first + n);
        // A row of more samples than 32 bits count fits no memory.
        out.push(Run { first: first as u32, end: end as u32 });
        from = end;
    }
}

/// The runs of a slab, and the parents of their union.
fn slab(slices: Range<usize>, ny: usize, row: &impl Fn(usize, &mut Vec<Run>)) -> (Runs, Vec<u32>) {
    let (mut runs, mut parents) = (Runs { starts: vec![0], runs: vec![] }, vec![]);
    for n in slices.start * ny..slices.end * ny {
        row(n, &mut runs.runs);
        runs.starts.push(runs.runs.len());
        parents.extend(parents.len() as u32..runs.runs.len() as u32);
        let own = runs.starts.len() - 2;
        if !own.is_multiple_of(ny) {
            unite(&runs, &mut parents, own - 1, own);
        }
        if own >= ny {
            unite(&runs, &mut parents, own - ny, own);
        }
    }
    (runs, parents)
}

/// Unites the runs of two rows that touch.
fn unite(runs: &Runs, parents: &mut [u32], a: usize, b: usize) {
    let (mut a, mut b) = (runs.of(a), runs.of(b));
    while !a.is_empty() && !b.is_empty() {
        let (one, other) = (runs.runs[a.start], runs.runs[b.start]);
        if one.first < other.end && other.first < one.end {
            let (one, other) = (root(parents, a.start as u32), root(parents, b.start as u32));
            parents[one.max(other) as usize] = one.min(other);
        }
        if one.end <= other.end { a.start += 1 } else { b.start += 1 }
    }
}

/// The root of a run; those on the way come nearer to it.
fn root(parents: &mut [u32], mut run: u32) -> u32 {
    while parents[run as usize] != run {
        let above = parents[parents[run as usize] as usize];
        parents[run as usize] = above;
        run = above;
    }
    run
}

/// For each run the number of its island by size, and the sizes.
fn numbered(runs: &Runs, mut parents: Vec<u32>) -> (Vec<u32>, Vec<u64>) {
    let mut sizes = vec![];
    // A root comes before all others, so that a parent has its number when it is asked for.
    for n in 0..parents.len() {
        let parent = parents[n] as usize;
        if parent == n {
            parents[n] = sizes.len() as u32;
            sizes.push(0);
        } else {
            parents[n] = parents[parent];
        }
        sizes[parents[n] as usize] += u64::from(runs.runs[n].end - runs.runs[n].first);
    }
    let mut order: Vec<u32> = (0..sizes.len() as u32).collect();
    order.sort_by_key(|&n| std::cmp::Reverse(sizes[n as usize]));
    let mut place = vec![0; sizes.len()];
    order.iter().zip(0..).for_each(|(&n, at)| place[n as usize] = at);
    parents.par_iter_mut().for_each(|n| *n = place[*n as usize]);
    (parents, order.iter().map(|&n| sizes[n as usize]).collect())
}

#[cfg(test)]
mod tests;
