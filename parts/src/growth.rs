//! Each sample of bone goes to the core that is nearest through bone: Dijkstra's shortest ways from all cores at once.

use bregma_field::{Cancelled, Progress};
use glam::DVec3;
use rayon::prelude::*;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Samples with what is known of each.
pub(crate) struct Growth {
    /// Samples along each axis.
    pub dims: [usize; 3],
    /// Distance between neighbours.
    pub spacing_mm: DVec3,
    /// Whose it is, 0 where nobody's yet.
    pub owner: Vec<u16>,
    /// The way through bone to the nearest core, mm: 0 at cores, infinite where it is to be found, negative outside of bone.
    pub way_mm: Vec<f32>,
}

/// A step along an axis, or along the diagonal of a face: ways along these are at most 13 % longer than the shortest on a cubic grid (Borgefors 1986).
struct Step {
    by: [isize; 3],
    mm: f32,
}

/// What waits: the length of its way (a float that is not negative, whose bits are in the same order), whose it would be, and the sample.
type Waiting = Reverse<(u32, u16, usize)>;

impl Growth {
    /// Finds owners and ways where ways are infinite, from where they are known; what no core reaches stays nobody's. Of two as near, the one of the lower number has it.
    /// It is one thread's work, in the order of ways, and visits only bone that is no core. `progress` counts samples.
    pub fn grow(&mut self, progress: &Progress) -> Result<(), Cancelled> {
        let steps = self.steps();
        let open = self.way_mm.par_iter().filter(|way| **way == f32::INFINITY).count();
        progress.begin(open as u64);
        let border = (0..self.owner.len()).into_par_iter().filter(|&n| self.owner[n] > 0 && self.is_border(&steps, n));
        let border: Vec<usize> = border.collect();
        let mut waiting: BinaryHeap<Waiting> = border.into_iter().map(|n| Reverse((self.way_mm[n].to_bits(), self.owner[n], n))).collect();
        let mut settled = 0;
        while let Some(Reverse((bits, owner, n))) = waiting.pop() {
            // It was reached on a shorter way since.
            if (self.way_mm[n].to_bits(), self.owner[n]) != (bits, owner) {
                continue;
            }
            settled += 1;
            if settled % (1 << 16) == 0 {
                progress.advance(1 << 16)?;
            }
            for step in &steps {
                let Some(to) = self.beside(n, step.by).filter(|&to| self.way_mm[to] > 0.0 && self.is_within(n, step.by)) else { continue };
                let way = self.way_mm[n] + step.mm;
                if way < self.way_mm[to] || (way == self.way_mm[to] && owner < self.owner[to]) {
                    self.way_mm[to] = way;
                    self.owner[to] = owner;
                    waiting.push(Reverse((way.to_bits(), owner, to)));
                }
            }
        }
        progress.advance(0)
    }

    fn steps(&self) -> Vec<Step> {
        let offsets = (0..27).map(|n| [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1]);
        let is_step = |by: &[isize; 3]| matches!(by.iter().map(|b| b.abs()).sum::<isize>(), 1 | 2);
        let length = |by: [isize; 3]| (DVec3::from(by.map(|b| b as f64)) * self.spacing_mm).length() as f32;
        offsets.filter(is_step).map(|by| Step { by, mm: length(by) }).collect()
    }

    fn beside(&self, n: usize, by: [isize; 3]) -> Option<usize> {
        let [nx, ny, _] = self.dims;
        let at = [n % nx, n / nx % ny, n / (nx * ny)];
        let mut to = [0; 3];
        for a in 0..3 {
            to[a] = at[a].checked_add_signed(by[a]).filter(|&x| x < self.dims[a])?;
        }
        Some(to[0] + nx * (to[1] + ny * to[2]))
    }

    /// Whether a step stays in bone: one along a diagonal has bone at one of the two samples beside it.
    fn is_within(&self, n: usize, by: [isize; 3]) -> bool {
        let mut alone = (0..3).filter(|&a| by[a] != 0).map(|a| {
            let mut part = [0; 3];
            part[a] = by[a];
            part
        });
        by.iter().filter(|b| **b != 0).count() == 1 || alone.any(|part| self.beside(n, part).is_some_and(|m| self.way_mm[m] >= 0.0))
    }

    fn is_border(&self, steps: &[Step], n: usize) -> bool {
        steps.iter().any(|step| self.beside(n, step.by).is_some_and(|to| self.way_mm[to] == f32::INFINITY))
    }
}
