//! The empty space between bone as the samples of a scan show it: which empty samples are reached from which, how far each is from bone, and
//! the widest way out.
//!
//! Two empty samples beside each other along an axis are joined: the interpolant is linear between them, so that no bone lies there. Distances
//! are those to the nearest point where the bone's surface crosses a line between two samples: never too short, and at most about h²/4d longer
//! than that to the surface itself (voxel h, distance d).

use super::other::point_of;
use bregma_field::{Cancelled, Progress, Sample, Store, Surface, with_block};
use glam::DVec3;
use rayon::prelude::*;
use rstar::RTree;
use serde::{Deserialize, Serialize};
use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};

/// What closes an opening: a flat round lid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Disc {
    /// Its middle, LPS mm.
    pub centre_mm: DVec3,
    /// Across it; unit.
    pub normal: DVec3,
    /// Its radius.
    pub radius_mm: f64,
}

impl Disc {
    /// Whether the way from one point straight to another goes through it.
    pub fn parts(&self, from: DVec3, to: DVec3) -> bool {
        let [a, b] = [from, to].map(|p| (p - self.centre_mm).dot(self.normal));
        (a >= 0.0) != (b >= 0.0) && from.lerp(to, a / (a - b)).distance(self.centre_mm) <= self.radius_mm
    }
}

/// Empty space within a scan's box.
pub struct Room<'a> {
    pub surface: &'a Surface,
    discs: &'a [Disc],
    is_empty: Vec<bool>,
    dims: [usize; 3],
}

/// The widest way from a sample to the scan's box.
#[derive(Clone, Debug, PartialEq)]
pub struct WayOut {
    /// Its narrowest place, LPS mm.
    pub at_mm: DVec3,
    /// How far bone is there, mm.
    pub radius_mm: f64,
    /// Where the way goes there; unit.
    pub along: DVec3,
}

/// What a ball's middle reaches.
pub struct Reached {
    /// For each sample, whether it is.
    pub is_reached: Vec<bool>,
    /// Where ways end since bone is just as near as it may be, LPS mm.
    pub rim: Vec<[f64; 3]>,
}

/// Nearest points.
pub struct Nearest(RTree<[f64; 3]>);

impl Nearest {
    pub fn of(points: Vec<[f64; 3]>) -> Self {
        Self(RTree::bulk_load(points))
    }

    /// Infinite where there are none.
    pub fn distance_mm(&self, p: DVec3) -> f64 {
        self.0.nearest_neighbor(p.to_array()).map_or(f64::INFINITY, |q| DVec3::from(*q).distance(p))
    }
}

impl<'a> Room<'a> {
    /// What is empty around the bone of `surface`, and kept by its cuts.
    pub fn of(surface: &'a Surface, discs: &'a [Disc]) -> Self {
        let dims = surface.grid.dims();
        let level = surface.level;
        let is_cut = !surface.region.is_all();
        let is_empty = with_block!(Store::of(&surface.volume).whole(), block => {
            let number = |n: usize| {
                let at = [n % dims[0], n / dims[0] % dims[1], n / (dims[0] * dims[1])];
                let is_bone = f64::from(surface.sign) * (block.at(at).to_f64() - level) >= 0.0;
                !(is_bone || is_cut && surface.region.depth_mm(point_of(surface, at)) < 0.0)
            };
            (0..surface.grid.len()).into_par_iter().map(number).collect()
        });
        Self { surface, discs, is_empty, dims }
    }

    pub fn index(&self, n: usize) -> [usize; 3] {
        [n % self.dims[0], n / self.dims[0] % self.dims[1], n / (self.dims[0] * self.dims[1])]
    }

    pub fn number(&self, [i, j, k]: [usize; 3]) -> usize {
        i + self.dims[0] * (j + self.dims[1] * k)
    }

    pub fn is_empty(&self, n: usize) -> bool {
        self.is_empty[n]
    }

    pub fn len(&self) -> usize {
        self.is_empty.len()
    }

    pub fn point_mm(&self, n: usize) -> DVec3 {
        point_of(self.surface, self.index(n))
    }

    /// Steps to the nearest side of the scan's box.
    fn to_box(&self, n: usize) -> usize {
        self.index(n).into_iter().zip(self.dims).map(|(i, n)| i.min(n - 1 - i)).fold(usize::MAX, usize::min)
    }

    /// The samples beside one within the scan, empty or not.
    fn beside(&self, n: usize) -> impl Iterator<Item = usize> {
        let (at, dims) = (self.index(n), self.dims);
        let strides = [1, dims[0], dims[0] * dims[1]];
        (0..3).flat_map(move |a| {
            let down = (at[a] > 0).then(|| n - strides[a]);
            let up = (at[a] + 1 < dims[a]).then(|| n + strides[a]);
            [down, up].into_iter().flatten()
        })
    }

    /// The empty samples beside one that no disc parts from it.
    fn joined(&self, n: usize) -> impl Iterator<Item = usize> {
        let from = if self.discs.is_empty() { DVec3::ZERO } else { self.point_mm(n) };
        self.beside(n).filter(move |m| self.is_empty[*m] && !self.discs.iter().any(|disc| disc.parts(from, self.point_mm(*m))))
    }

    /// Where the bone's surface crosses the lines between samples.
    pub fn surface_points(&self, progress: &Progress) -> Result<Nearest, Cancelled> {
        let (dims, surface) = (self.dims, self.surface);
        let layer = |k: usize| -> Result<Vec<[f64; 3]>, Cancelled> {
            progress.advance(1)?;
            let mut found = vec![];
            with_block!(Store::of(&surface.volume).whole(), block => {
                let depth = |at: [usize; 3]| f64::from(surface.sign) * (block.at(at).to_f64() - surface.level);
                for j in 0..dims[1] {
                    for i in 0..dims[0] {
                        let at = [i, j, k];
                        let here = depth(at);
                        for axis in 0..3 {
                            let mut next = at;
                            next[axis] += 1;
                            if next[axis] >= dims[axis] {
                                continue;
                            }
                            let there = depth(next);
                            if (here >= 0.0) != (there >= 0.0) {
                                found.push(point_of(surface, at).lerp(point_of(surface, next), here / (here - there)).to_array());
                            }
                        }
                    }
                }
            });
            Ok(found)
        };
        let layers = (0..dims[2]).into_par_iter().map(layer).collect::<Result<Vec<_>, _>>()?;
        Ok(Nearest::of(layers.concat()))
    }

    /// The longest step between samples beside each other, mm.
    fn step_mm(&self) -> f64 {
        self.surface.grid.spacing_mm().max_element()
    }

    /// All empty samples that are reached from `from` by ways on which bone is at least `room_mm` away. `None`: the ways lead out of the scan's
    /// box.
    pub fn reached(
        &self,
        from: usize,
        room: Option<(f64, &Nearest)>,
        open: bool,
        progress: &Progress,
    ) -> Result<Option<Reached>, Cancelled> {
        let mut reached = vec![false; self.len()];
        let (mut rim, mut known) = (vec![], VecDeque::new());
        let distance = |n: usize| room.map_or(f64::INFINITY, |(_, nearest)| nearest.distance_mm(self.point_mm(n)));
        let room_mm = room.map_or(0.0, |(mm, _)| mm);
        reached[from] = true;
        known.push_back((from, distance(from)));
        // A lower bound of the distance goes along, so that it is asked for only where that is too little.
        let step = self.step_mm();
        let mut count = 0_u64;
        while let Some((n, least)) = known.pop_front() {
            count += 1;
            if count.is_multiple_of(1 << 16) {
                progress.advance(0)?;
            }
            if !open && self.to_box(n) == 0 {
                return Ok(None);
            }
            for m in self.joined(n) {
                if reached[m] {
                    continue;
                }
                let bound = least - step;
                let there = if bound >= room_mm { bound } else { distance(m) };
                if there >= room_mm {
                    reached[m] = true;
                    known.push_back((m, there));
                } else {
                    let here = distance(n);
                    let part = ((here - room_mm) / (here - there)).clamp(0.0, 1.0);
                    rim.push(self.point_mm(n).lerp(self.point_mm(m), part).to_array());
                }
            }
        }
        Ok(Some(Reached { is_reached: reached, rim }))
    }

    /// What is reached from samples that are already, no farther than `far_mm` from the points of their `rim`: `far_mm` less that distance for
    /// each sample that was asked for, NaN for the others; infinite for those that were reached before.
    pub fn grown(&self, core: &[bool], rim: &Nearest, far_mm: f64, progress: &Progress) -> Result<Vec<f32>, Cancelled> {
        let mut depth: Vec<f32> = core.iter().map(|is_in| if *is_in { f32::INFINITY } else { f32::NAN }).collect();
        let mut known: VecDeque<usize> = (0..core.len()).filter(|n| core[*n]).collect();
        let mut count = 0_u64;
        while let Some(n) = known.pop_front() {
            count += 1;
            if count.is_multiple_of(1 << 16) {
                progress.advance(0)?;
            }
            for m in self.joined(n) {
                if depth[m].is_nan() {
                    depth[m] = (far_mm - rim.distance_mm(self.point_mm(m))) as f32;
                    if depth[m] >= 0.0 {
                        known.push_back(m);
                    }
                }
            }
        }
        Ok(depth)
    }

    /// The widest way from `from` to the scan's box: that whose narrowest place is the widest (Pollack 1960, "The maximum capacity through a
    /// network", Operations Research 8, 733–736), by Dijkstra's algorithm. `None` where there is none.
    pub fn way_out(&self, from: usize, nearest: &Nearest, progress: &Progress) -> Result<Option<WayOut>, Cancelled> {
        // Where bone is farther than this no distance is asked for; if all of the way is, it is looked for again with more.
        let mut most_mm = 4.0 * self.step_mm();
        loop {
            let Some(way) = self.way(from, nearest, most_mm, progress)? else { return Ok(None) };
            if way.radius_mm < most_mm || !most_mm.is_finite() {
                return Ok(Some(way));
            }
            most_mm = if most_mm > self.step_mm() * self.dims[0].max(self.dims[1]).max(self.dims[2]) as f64 {
                f64::INFINITY
            } else {
                2.0 * most_mm
            };
        }
    }

    fn way(&self, from: usize, nearest: &Nearest, most_mm: f64, progress: &Progress) -> Result<Option<WayOut>, Cancelled> {
        let step = self.step_mm();
        // Of ways as wide as each other that which is nearest to the box goes on. Floats that are not negative are ordered as their bits are.
        let mut heap = BinaryHeap::new();
        let mut parents = vec![usize::MAX; self.len()];
        parents[from] = from;
        let start = nearest.distance_mm(self.point_mm(from));
        heap.push((start.min(most_mm).to_bits(), Reverse(self.to_box(from)), from, start.to_bits()));
        let mut count = 0_u64;
        while let Some((width, Reverse(to_box), n, least)) = heap.pop() {
            count += 1;
            if count.is_multiple_of(1 << 14) {
                progress.advance(0)?;
            }
            if to_box == 0 {
                return Ok(Some(self.narrowest(&parents, n, nearest)));
            }
            let least = f64::from_bits(least);
            for m in self.joined(n) {
                if parents[m] == usize::MAX {
                    parents[m] = n;
                    let bound = least - step;
                    let there = if bound >= most_mm { bound } else { nearest.distance_mm(self.point_mm(m)) };
                    heap.push((f64::from_bits(width).min(there).to_bits(), Reverse(self.to_box(m)), m, there.to_bits()));
                }
            }
        }
        Ok(None)
    }

    /// The narrowest place of the way that ends at `end`.
    fn narrowest(&self, parents: &[usize], end: usize, nearest: &Nearest) -> WayOut {
        let mut way = vec![end];
        while let Some(parent) = way.last().map(|n| parents[*n]).filter(|parent| Some(parent) != way.last()) {
            way.push(parent);
        }
        way.reverse();
        let points: Vec<DVec3> = way.iter().map(|n| self.point_mm(*n)).collect();
        let widths: Vec<f64> = points.iter().map(|p| nearest.distance_mm(*p)).collect();
        let at = (0..widths.len()).min_by(|a, b| widths[*a].total_cmp(&widths[*b])).unwrap_or(0);
        // Steps go along the grid's axes: over some of them they show where the way goes.
        const STEPS: usize = 8;
        let along = points[(at + STEPS).min(points.len() - 1)] - points[at.saturating_sub(STEPS)];
        WayOut { at_mm: points[at], radius_mm: widths[at], along: along.normalize_or(DVec3::Z) }
    }
}
