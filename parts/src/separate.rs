//! Bones that hang together by necks, apart: what is left of bone where a ball passes falls into cores, and each sample of bone goes to the core that
//! is nearest through bone, so that a jaw comes off the skull that it hangs on and nothing of either is lost.

use crate::distances::squared_distances;
use crate::error::PartsError;
use crate::growth::Growth;
use crate::islands::{Islands, runs_of};
use crate::labels::{Labels, Part};
use bregma_field::{Cancelled, Progress, Samples, Surface};
use glam::DVec3;
use rayon::prelude::*;

/// What is taken apart.
#[derive(Clone, Copy, Debug)]
pub struct Neck {
    /// Necks not thicker than this are cut, mm. Thickness is twice the distance from the nearest sample outside, so that a neck is cut from what it is
    /// to what it is less a voxel.
    pub mm: f64,
    /// What is smaller goes with its neighbour, and is no part where it has none, mm³; a hundredth of all bone when absent.
    pub least_mm3: Option<f64>,
}

/// The bone of a surface in parts, the largest first; see the module. It needs 10 bytes for each sample of the scan.
pub fn separate(surface: &Surface, neck: Neck, progress: &Progress) -> Result<Labels, PartsError> {
    if !(neck.mm.is_finite() && neck.mm > 0.0) {
        return Err(PartsError::Neck(neck.mm));
    }
    let grid = surface.volume.grid();
    let bone = Islands::of_bone(surface, progress)?;
    let voxel_mm3 = grid.index_to_world().matrix3.determinant().abs();
    let least = neck.least_mm3.map_or(bone.sizes().iter().sum::<u64>() as f64 / 100.0, |mm3| mm3 / voxel_mm3);
    let squares = squared_distances(&bone, grid.spacing_mm(), progress)?;
    let apart = Apart::at(&bone, &squares, neck.mm / 2.0, grid.spacing_mm(), least, progress)?;
    drop(squares);
    let parts: Vec<Part> = (1..=apart.sizes.len() as u16).map(|n| Part::new(n, format!("Part {n}"))).collect();
    if parts.is_empty() {
        return Err(PartsError::AllSmaller { scan: surface.volume.name().to_owned(), least_mm3: least * voxel_mm3 });
    }
    let samples = if parts.len() <= usize::from(u8::MAX) {
        Samples::U8(apart.owner.par_iter().map(|&n| n as u8).collect())
    } else {
        Samples::U16(apart.owner)
    };
    Labels::new(grid.clone(), samples, parts)
}

/// Bone, taken apart.
pub(crate) struct Apart {
    /// For each sample the number of its part, the largest 1; 0 where it has none.
    pub owner: Vec<u16>,
    /// Samples of each part, the largest first.
    pub sizes: Vec<u64>,
}

impl Apart {
    /// Where a ball of a radius passes are cores; `least` is the samples that a part has at least.
    pub fn at(
        bone: &Islands,
        squares_mm2: &[f32],
        radius_mm: f64,
        spacing_mm: DVec3,
        least: f64,
        progress: &Progress,
    ) -> Result<Self, Cancelled> {
        let nx = bone.dims()[0];
        let square = (radius_mm * radius_mm) as f32;
        let cores = Islands::find(bone.dims(), |row, out| runs_of(&squares_mm2[row * nx..][..nx], |s| s > square, out), progress)?;
        // What is not among the largest has its turn as somebody's bone.
        let most = cores.sizes().len().min(usize::from(u16::MAX));
        let mut growth = begun(bone, &cores, most, spacing_mm);
        growth.grow(progress)?;
        let sizes = counted(&growth.owner, most);
        let large: Vec<usize> = (0..most).filter(|&n| sizes[n] as f64 >= least).collect();
        if large.len() < most {
            let mut number = vec![0; most + 1];
            large.iter().zip(1..).for_each(|(&core, n)| number[core + 1] = n);
            let all = growth.owner.par_iter_mut().zip(growth.way_mm.par_iter_mut());
            all.filter(|(owner, _)| **owner > 0).for_each(|(owner, way_mm)| {
                *owner = number[usize::from(*owner)];
                // Ways to other cores are what they were.
                *way_mm = if *owner == 0 { f32::INFINITY } else { *way_mm };
            });
            growth.grow(progress)?;
        }
        let mut apart = Self { sizes: counted(&growth.owner, large.len()), owner: growth.owner };
        apart.add_islands_alone(bone, least);
        apart.by_size();
        Ok(apart)
    }

    /// What no ball reaches is a part where it is large enough.
    fn add_islands_alone(&mut self, bone: &Islands, least: f64) {
        let [nx, ny, nz] = bone.dims();
        let count = bone.at_least(least);
        let mut alone = vec![true; count];
        let each = |row: usize| bone.row(row).filter(move |(_, island)| *island < count);
        (0..ny * nz).for_each(|row| each(row).for_each(|(run, island)| alone[island] &= self.owner[row * nx + run.first as usize] == 0));
        let mut number = vec![0; count];
        for island in (0..count).filter(|&n| alone[n]) {
            if let Ok(next) = u16::try_from(self.sizes.len() + 1) {
                number[island] = next;
                self.sizes.push(bone.sizes()[island]);
            }
        }
        self.owner.par_chunks_mut(nx).enumerate().for_each(|(row, owner)| {
            each(row).filter(|(_, island)| number[*island] > 0).for_each(|(run, island)| owner[run.range()].fill(number[island]));
        });
    }

    fn by_size(&mut self) {
        let mut order: Vec<usize> = (0..self.sizes.len()).collect();
        order.sort_by_key(|&n| std::cmp::Reverse(self.sizes[n]));
        let mut place = vec![0; self.sizes.len() + 1];
        order.iter().zip(1..).for_each(|(&n, at)| place[n + 1] = at);
        self.owner.par_iter_mut().for_each(|n| *n = place[usize::from(*n)]);
        self.sizes.sort_by_key(|&size| std::cmp::Reverse(size));
    }
}

/// Bone from which the first `most` cores grow.
fn begun(bone: &Islands, cores: &Islands, most: usize, spacing_mm: DVec3) -> Growth {
    let dims = bone.dims();
    let count = dims.iter().product();
    let mut growth = Growth { dims, spacing_mm, owner: vec![0; count], way_mm: vec![-1.0; count] };
    let rows = growth.owner.par_chunks_mut(dims[0]).zip(growth.way_mm.par_chunks_mut(dims[0])).enumerate();
    rows.for_each(|(row, (owner, way_mm))| {
        bone.row(row).for_each(|(run, _)| way_mm[run.range()].fill(f32::INFINITY));
        for (run, core) in cores.row(row).filter(|(_, core)| *core < most) {
            owner[run.range()].fill(core as u16 + 1);
            way_mm[run.range()].fill(0.0);
        }
    });
    growth
}

/// Samples of the parts 1 to `count`.
fn counted(owner: &[u16], count: usize) -> Vec<u64> {
    let add = |mut a: Vec<u64>, b: Vec<u64>| {
        a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        a
    };
    let chunk = |owner: &[u16]| {
        let mut counts = vec![0; count + 1];
        owner.iter().for_each(|&n| counts[usize::from(n)] += 1);
        counts
    };
    // Few pieces, as each has a count of its own for every part.
    let piece = owner.len().div_ceil(16).max(1);
    owner.par_chunks(piece).map(chunk).reduce(|| vec![0; count + 1], add).split_off(1)
}

#[cfg(test)]
mod tests;
