//! The cells that a surface passes as a tree of boxes, so that those near a point are found without looking at the others.

use crate::mesh::passed;
use bregma_field::interpolant::corners;
use bregma_field::{Cancelled, Progress, Surface};
use glam::{DMat3, DVec3, USizeVec3};
use rayon::prelude::*;

/// A cell that the surface passes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Passed {
    /// By its lowest sample.
    pub cell: USizeVec3,
    /// How far its corners are inside the surface, in sample units.
    pub f: [f64; 8],
}

/// Cells in a leaf: as few as are tried together in the time that descending one level more takes.
const LEAF: usize = 4;

/// See the module. Boxes lie in a frame of the grid's own: its axis i, the plane of i and j, and what is left, so that the cells of any grid that
/// is not sheared are boxes there.
#[derive(Debug)]
pub(super) struct Tree {
    /// In the order of the leaves.
    cells: Vec<Passed>,
    /// A full binary tree, the root first, the children of node n at 2n + 1 and 2n + 2; low and high corner of each node's box, mm.
    nodes: Vec<[DVec3; 2]>,
    leaves: usize,
    /// From index space to the frame: upper triangular, mm per voxel.
    steps: DMat3,
}

impl Tree {
    /// Of the cells of `surface`. `progress` counts layers of cells.
    pub fn of(surface: &Surface, progress: &Progress) -> Result<Self, Cancelled> {
        let layers = surface.grid.cells()[2];
        let layer = |k: usize| -> Result<_, Cancelled> {
            progress.advance(1)?;
            let with_corners = |cell: [usize; 3]| Passed { cell: cell.into(), f: corners(surface, cell.into()) };
            Ok(passed(surface, k).into_iter().map(with_corners).collect::<Vec<_>>())
        };
        let found = if surface.grid.is_flat() { vec![] } else { (0..layers).into_par_iter().map(layer).collect::<Result<Vec<_>, _>>()? };
        let mut cells = found.concat();
        cells.par_sort_by_cached_key(|passed| along_curve(passed.cell));
        let leaves = cells.len().div_ceil(LEAF).next_power_of_two();
        let steps = frame(&surface.grid.index_to_world().matrix3);
        let mut tree = Self { nodes: vec![[DVec3::INFINITY, DVec3::NEG_INFINITY]; 2 * leaves - 1], cells, leaves, steps };
        for n in 0..tree.cells.len().div_ceil(LEAF) {
            tree.nodes[leaves - 1 + n] = tree.leaf(n).iter().map(|passed| tree.span(passed.cell)).reduce(joined).unwrap_or_default();
        }
        for n in (0..leaves - 1).rev() {
            tree.nodes[n] = joined(tree.nodes[2 * n + 1], tree.nodes[2 * n + 2]);
        }
        Ok(tree)
    }

    fn leaf(&self, n: usize) -> &[Passed] {
        &self.cells[n * LEAF..(n * LEAF + LEAF).min(self.cells.len())]
    }

    /// The box of a cell in the frame.
    fn span(&self, cell: USizeVec3) -> [DVec3; 2] {
        let origin = self.steps * cell.as_dvec3();
        let (mut low, mut high) = (origin, origin);
        for axis in [self.steps.x_axis, self.steps.y_axis, self.steps.z_axis] {
            (low, high) = (low + axis.min(DVec3::ZERO), high + axis.max(DVec3::ZERO));
        }
        [low, high]
    }

    /// Calls `meet` for cells that lie within `reach_mm` of a point of index space, nearer boxes first; what it answers is the reach from then on.
    pub fn near(&self, point: DVec3, mut reach_mm: f64, mut meet: impl FnMut(&Passed) -> f64) {
        if self.cells.is_empty() {
            return;
        }
        let at = self.steps * point;
        let square = |[low, high]: [DVec3; 2]| (at - at.clamp(low, high)).length_squared();
        // Depth first holds one node a level.
        let mut waiting = [(0, 0.0); 64];
        let mut count = 1;
        waiting[0] = (0, square(self.nodes[0]));
        while count > 0 {
            count -= 1;
            let (node, distance) = waiting[count];
            if distance > reach_mm * reach_mm {
                continue;
            }
            if node + 1 >= self.leaves {
                for passed in self.leaf(node + 1 - self.leaves) {
                    if square(self.span(passed.cell)) <= reach_mm * reach_mm {
                        reach_mm = meet(passed);
                    }
                }
                continue;
            }
            let [a, b] = [2 * node + 1, 2 * node + 2]
                .map(|n| (n, if self.nodes[n][0].x.is_finite() { square(self.nodes[n]) } else { f64::INFINITY }));
            let [near, far] = if a.1 <= b.1 { [a, b] } else { [b, a] };
            for child in [far, near] {
                waiting[count] = child;
                count += usize::from(child.1 <= reach_mm * reach_mm);
            }
        }
    }
}

fn joined(a: [DVec3; 2], b: [DVec3; 2]) -> [DVec3; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

/// The upper triangle U of a grid's steps M = QU, Q a rotation or a mirror image: distances in it are those of the world (Gram and Schmidt).
fn frame(steps: &DMat3) -> DMat3 {
    let x = steps.x_axis.normalize();
    let y = (steps.y_axis - steps.y_axis.dot(x) * x).normalize();
    let z = steps.z_axis - steps.z_axis.dot(x) * x - steps.z_axis.dot(y) * y;
    let in_frame = |v: DVec3| DVec3::new(v.dot(x), v.dot(y), v.dot(z.normalize()));
    DMat3::from_cols(in_frame(steps.x_axis), in_frame(steps.y_axis), in_frame(steps.z_axis))
}

/// The number of a cell along Morton's curve, on which neighbours stay together (Morton 1966, "A computer oriented geodetic data base", IBM).
fn along_curve(cell: USizeVec3) -> u64 {
    let spread = |n: usize| (0..21).fold(0, |sum, bit| sum | (n as u64 >> bit & 1) << (3 * bit));
    spread(cell.x) | spread(cell.y) << 1 | spread(cell.z) << 2
}
