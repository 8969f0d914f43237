//! The nearest point of a surface to anywhere around it, to about a fiftieth of its size: a map for looks without a search.

use crate::cloud::{Cloud, Oriented};
use bregma_field::{Cancelled, Progress};
use glam::{DVec3, IVec3};

/// The nearest point to the middle of each cell of a coarse grid, by propagation (Danielsson 1980).
#[derive(Debug)]
pub struct Coarse<'a> {
    cloud: &'a Cloud<'a>,
    low: DVec3,
    /// Side of a cell, mm.
    pub step_mm: f64,
    dims: IVec3,
    /// Number of the point, for each cell.
    nearest: Vec<u32>,
}

/// Cells along the longest side.
const CELLS: f64 = 48.0;

/// Cells around, for what lies beside.
const ROOM: f64 = 4.0;

const NONE: u32 = u32::MAX;

impl<'a> Coarse<'a> {
    /// The map of a cloud with points.
    pub fn of(cloud: &'a Cloud<'a>, progress: &Progress) -> Result<Self, Cancelled> {
        let ends = cloud.points.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(p.point), h.max(p.point)));
        let step_mm = ((ends.1 - ends.0).max_element() / CELLS).max(f64::MIN_POSITIVE);
        let low = ends.0 - ROOM * step_mm;
        let dims = ((ends.1 - low) / step_mm + ROOM).ceil().as_ivec3() + 1;
        let mut map = Self { cloud, low, step_mm, dims, nearest: vec![NONE; (dims.x * dims.y * dims.z) as usize] };
        for (n, p) in cloud.points.iter().enumerate() {
            map.offer(((p.point - low) / step_mm).as_ivec3(), n as u32);
        }
        // There and back, three times: what is wrong then is far from any point.
        for _ in 0..3 {
            map.sweep(1);
            map.sweep(-1);
            progress.advance(0)?;
        }
        Ok(map)
    }

    fn number(&self, c: IVec3) -> usize {
        (c.x + self.dims.x * (c.y + self.dims.y * c.z)) as usize
    }

    fn holds(&self, cell: IVec3) -> bool {
        cell.cmpge(IVec3::ZERO).all() && cell.cmplt(self.dims).all()
    }

    fn offer(&mut self, cell: IVec3, n: u32) {
        let (at, middle) = (self.number(cell), self.low + (cell.as_dvec3() + 0.5) * self.step_mm);
        let away = |n: u32| self.cloud.points[n as usize].point.distance_squared(middle);
        if n != NONE && (self.nearest[at] == NONE || away(n) < away(self.nearest[at])) {
            self.nearest[at] = n;
        }
    }

    /// Each cell is offered what those before it have; `step` is 1 or −1.
    fn sweep(&mut self, step: i32) {
        let count = self.nearest.len() as i32;
        for n in 0..count {
            let n = if step > 0 { n } else { count - 1 - n };
            let cell = IVec3::new(n % self.dims.x, n / self.dims.x % self.dims.y, n / (self.dims.x * self.dims.y));
            for axis in [IVec3::X, IVec3::Y, IVec3::Z] {
                let before = cell - step * axis;
                if self.holds(before) {
                    self.offer(cell, self.nearest[self.number(before)]);
                }
            }
        }
    }

    /// About the nearest point; none far beside the surface.
    pub fn at(&self, p: DVec3) -> Option<Oriented> {
        let cell = ((p - self.low) / self.step_mm).floor().as_ivec3();
        if self.holds(cell) { self.cloud.points.get(self.nearest[self.number(cell)] as usize).copied() } else { None }
    }
}
