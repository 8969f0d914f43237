//! Nearest points by trying: the surface of every cell around is laid bare along lines through it, and looked at ever closer where it is near.
//! It shares nothing with the program's own search but the trilinear function.

use bregma_field::interpolant::{corners, gradient, value};
use bregma_field::{Surface, WorldPoint};
use glam::{DVec3, USizeVec3};

/// A point of the surface: in index space, and the square of its distance, mm².
#[derive(Clone, Copy, Debug)]
pub struct Tried {
    pub point: DVec3,
    pub square: f64,
}

pub struct Brute<'a> {
    pub surface: &'a Surface,
    /// In index space.
    target: DVec3,
    to_world: glam::DMat3,
}

/// Lines through a cell along each axis, across each of the other two.
const LINES: usize = 6;

impl<'a> Brute<'a> {
    pub fn new(surface: &'a Surface, point: WorldPoint) -> Self {
        Self { surface, target: surface.grid.index(point).0, to_world: surface.grid.index_to_world().matrix3 }
    }

    pub fn tried(&self, point: DVec3) -> Tried {
        Tried { point, square: (self.to_world * (point - self.target)).length_squared() }
    }

    /// Where the surface crosses lines in the box about `middle` that reaches `half` along each axis, within one cell.
    fn along_lines(&self, cell: USizeVec3, low: DVec3, high: DVec3, found: &mut Vec<Tried>) {
        let f = corners(self.surface, cell);
        let origin = cell.as_dvec3();
        let (low, high) = ((low - origin).max(DVec3::ZERO), (high - origin).min(DVec3::ONE));
        if low.cmpgt(high).any() {
            return;
        }
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for n in 0..=LINES {
                for m in 0..=LINES {
                    let at = |t: f64| {
                        let mut p = DVec3::ZERO;
                        p[axis] = t;
                        p[u] = low[u] + (high[u] - low[u]) * n as f64 / LINES as f64;
                        p[v] = low[v] + (high[v] - low[v]) * m as f64 / LINES as f64;
                        p
                    };
                    // Along an axis it is linear: one division finds the root.
                    let [a, b] = [low[axis], high[axis]].map(|t| value(&f, at(t)));
                    if (a >= 0.0) != (b >= 0.0) {
                        found.push(self.tried(origin + at(low[axis] + (high[axis] - low[axis]) * a / (a - b))));
                    }
                }
            }
        }
    }

    fn around(&self, middle: DVec3, half: f64) -> Vec<Tried> {
        let mut found = vec![];
        let cells = USizeVec3::from(self.surface.grid.cells());
        let (low, high) = (middle - half, middle + half);
        let first = low.floor().max(DVec3::ZERO).as_usizevec3();
        let last = high.floor().max(DVec3::ZERO).as_usizevec3().min(cells - 1);
        for k in first.z..=last.z {
            for j in first.y..=last.y {
                for i in first.x..=last.x {
                    self.along_lines(USizeVec3::new(i, j, k), low, high, &mut found);
                }
            }
        }
        found
    }

    /// All points on lines through cells within `reach_mm` of the point, by their distance.
    pub fn all_within(&self, reach_mm: f64) -> Vec<Tried> {
        let rows = self.surface.grid.world_to_index().matrix3.transpose();
        let reach = reach_mm * DVec3::new(rows.x_axis.length(), rows.y_axis.length(), rows.z_axis.length());
        let cells = USizeVec3::from(self.surface.grid.cells());
        let mut found = vec![];
        let first = (self.target - reach).floor().max(DVec3::ZERO).as_usizevec3();
        let last = (self.target + reach).floor().max(DVec3::ZERO).as_usizevec3().min(cells - 1);
        for k in first.z..=last.z {
            for j in first.y..=last.y {
                for i in first.x..=last.x {
                    self.along_lines(USizeVec3::new(i, j, k), DVec3::NEG_INFINITY, DVec3::INFINITY, &mut found);
                }
            }
        }
        found.retain(|tried| tried.square <= reach_mm * reach_mm);
        found.sort_by(|a, b| a.square.total_cmp(&b.square));
        found
    }

    /// The nearest place that is reached from `from` by going nearer, in steps of up to `half` a voxel: larger ones leap to other sheets.
    pub fn descended(&self, from: Tried, mut half: f64) -> Tried {
        let mut best = from;
        while half > 1e-10 {
            let nearest = self.around(best.point, half).into_iter().min_by(|a, b| a.square.total_cmp(&b.square));
            match nearest {
                // Still going: the box moves along and keeps its size while it leads far.
                Some(near) if near.square < best.square => {
                    let went = (near.point - best.point).abs().max_element();
                    best = near;
                    if went < 0.5 * half {
                        half *= 0.5;
                    }
                }
                _ => half *= 0.5,
            }
        }
        best
    }

    /// Whether the surface faces `normal` at a point: in any of the cells that meet there.
    pub fn faces(&self, point: DVec3, normal: DVec3) -> bool {
        let facing = -(self.surface.grid.world_to_index().matrix3 * normal);
        let cells = USizeVec3::from(self.surface.grid.cells());
        let near = 1e-6;
        let first = (point - near).floor().max(DVec3::ZERO).as_usizevec3();
        let last = (point + near).floor().max(DVec3::ZERO).as_usizevec3().min(cells - 1);
        for k in first.z..=last.z {
            for j in first.y..=last.y {
                for i in first.x..=last.x {
                    let cell = USizeVec3::new(i, j, k);
                    let f = corners(self.surface, cell);
                    if gradient(&f, point - cell.as_dvec3()).dot(facing) > 0.0 {
                        return true;
                    }
                }
            }
        }
        false
    }

    /// Whether only the scan's box ends the surface at a point.
    pub fn is_at_edge(&self, point: DVec3) -> bool {
        let last = USizeVec3::from(self.surface.grid.cells()).as_dvec3();
        point.cmplt(DVec3::splat(1e-6)).any() || point.cmpgt(last - 1e-6).any()
    }

    /// The nearest foot that faces `normal`: from every point on a line that no other within a third of a voxel undercuts, downhill.
    pub fn partner(&self, normal: DVec3, reach_mm: f64) -> Option<Tried> {
        let all = self.all_within(reach_mm);
        let mut best: Option<Tried> = None;
        for (n, from) in all.iter().enumerate() {
            // A foot is below where its descent began by less than a step between lines lets it.
            if best.is_some_and(|b| from.square.sqrt() > b.square.sqrt() + 0.5 * self.surface.grid.spacing_mm().max_element()) {
                break;
            }
            if all[..n].iter().rev().take(4000).any(|other| (other.point - from.point).abs().max_element() < 0.25) {
                continue;
            }
            let foot = self.descended(*from, 0.25);
            let is_better = best.is_none_or(|b| foot.square < b.square);
            if is_better && self.faces(foot.point, normal) && !self.is_at_edge(foot.point) {
                best = Some(foot);
            }
        }
        best
    }
}
