//! A second solid as the cells of a first one's grid meet it.

use bregma_field::chord::part_inside;
use bregma_field::interpolant::{corners, gradient, value};
use bregma_field::{IndexPoint, Sample, Store, Surface, WorldPoint, with_block};
use glam::{DAffine3, DVec3, USizeVec3};

/// Where a cell lies to a solid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// All of it is in it.
    In,
    /// Nothing of it is.
    Out,
    /// The surface, or what closes the solid, may pass it.
    Between,
}

/// A solid in the index space of another's grid.
#[derive(Debug)]
pub struct Other<'a> {
    surface: &'a Surface,
    /// From the first one's index space to its own.
    map: DAffine3,
    /// Half the extent in its index space of a cell of the first, and half that cell's diagonal in the world.
    half: DVec3,
    half_mm: f64,
}

impl<'a> Other<'a> {
    /// `surface` as the grid of `first` meets it; `None` where it has no cells.
    pub fn of(surface: &'a Surface, first: &Surface) -> Option<Self> {
        let to_world = first.grid.index_to_world();
        let map = surface.grid.world_to_index() * to_world;
        let m = map.matrix3;
        let half = 0.5 * (m.x_axis.abs() + m.y_axis.abs() + m.z_axis.abs());
        (!surface.grid.is_flat()).then_some(Self { surface, map, half, half_mm: half_diagonal_mm(first) })
    }

    /// Where the cell of the first grid lies to it, which has its middle at `middle` (index space of the first) and `middle_mm`.
    pub fn side(&self, middle: DVec3, middle_mm: DVec3) -> Side {
        let region = if self.surface.region.is_all() { Side::In } else { side_of(self.surface.region.depth_mm(middle_mm), self.half_mm) };
        let at = self.map.transform_point3(middle);
        let last = USizeVec3::from(self.surface.grid.cells()).as_dvec3();
        let (low, high) = (at - self.half, at + self.half);
        if region == Side::Out || high.cmplt(DVec3::ZERO).any() || low.cmpgt(last).any() {
            return Side::Out;
        }
        let is_within = low.cmpge(DVec3::ZERO).all() && high.cmple(last).all();
        let first = low.floor().max(DVec3::ZERO).as_usizevec3();
        let end = (high.ceil().min(last)).as_usizevec3();
        let (mut some_in, mut some_out) = (false, false);
        let (level, sign) = (self.surface.level, f64::from(self.surface.sign));
        with_block!(Store::of(&self.surface.volume).whole(), block => {
            for k in first.z..=end.z {
                for j in first.y..=end.y {
                    for i in first.x..=end.x {
                        let is_in = sign * (block.at([i, j, k]).to_f64() - level) >= 0.0;
                        some_in |= is_in;
                        some_out |= !is_in;
                    }
                }
            }
        });
        match (some_in, some_out) {
            (false, _) => Side::Out,
            (true, false) if is_within && region == Side::In => Side::In,
            _ => Side::Between,
        }
    }

    /// Across its surface near a point of the first's index space, in that space.
    pub fn across(&self, point: DVec3) -> DVec3 {
        let at = self.map.transform_point3(point);
        let last = USizeVec3::from(self.surface.grid.cells()).as_dvec3();
        let cell = at.floor().clamp(DVec3::ZERO, last - 1.0);
        let local = (at - cell).clamp(DVec3::ZERO, DVec3::ONE);
        self.map.matrix3.transpose() * gradient(&corners(self.surface, cell.as_usizevec3()), local)
    }

    /// Whether a point of the first's index space is in it.
    pub fn has(&self, point: DVec3, point_mm: DVec3) -> bool {
        let at = self.map.transform_point3(point);
        let last = USizeVec3::from(self.surface.grid.cells()).as_dvec3();
        if at.cmplt(DVec3::ZERO).any() || at.cmpgt(last).any() || self.surface.region.depth_mm(point_mm) < 0.0 {
            return false;
        }
        let cell = at.floor().min(last - 1.0);
        value(&corners(self.surface, cell.as_usizevec3()), at - cell) >= 0.0
    }

    /// How much of the stretch of the line `from + t·along` of the first's index space, t in `span`, is in it, in t. `cuts` is kept between
    /// calls so that it need not be made anew.
    pub fn chord(&self, from: DVec3, along: DVec3, span: [f64; 2], cuts: &mut Vec<f64>) -> f64 {
        let (o, d) = (self.map.transform_point3(from), self.map.transform_vector3(along));
        let last = USizeVec3::from(self.surface.grid.cells()).as_dvec3();
        let [mut start, mut end] = span;
        if !self.surface.region.is_all() {
            let to_world = self.surface.grid.index_to_world();
            let ends = self.surface.region.interval(to_world.transform_point3(o), to_world.transform_vector3(d), span);
            [start, end] = [ends[0].s, ends[1].s];
        }
        for a in 0..3 {
            let ends = [-o[a] / d[a], (last[a] - o[a]) / d[a]];
            if d[a] != 0.0 {
                start = start.max(ends[0].min(ends[1]));
                end = end.min(ends[0].max(ends[1]));
            } else if !(0.0..=last[a]).contains(&o[a]) {
                return 0.0;
            }
        }
        // Empty, or no number.
        if end.partial_cmp(&start) != Some(std::cmp::Ordering::Greater) {
            return 0.0;
        }
        cuts.clear();
        cuts.extend([start, end]);
        for a in 0..3 {
            let [p, q] = [o[a] + start * d[a], o[a] + end * d[a]];
            let faces = (p.min(q).floor() as i64 + 1)..=(p.max(q).ceil() as i64 - 1);
            cuts.extend(faces.map(|face| (face as f64 - o[a]) / d[a]).filter(|t| start < *t && *t < end));
        }
        cuts.sort_unstable_by(f64::total_cmp);
        let piece = |w: &[f64]| {
            // The middle of a piece tells its cell whatever rounding does to its ends.
            let cell = (o + 0.5 * (w[0] + w[1]) * d).floor().clamp(DVec3::ZERO, last - 1.0);
            let local = |t: f64| (o + t * d - cell).clamp(DVec3::ZERO, DVec3::ONE);
            (w[1] - w[0]) * part_inside(&corners(self.surface, cell.as_usizevec3()), local(w[0]), local(w[1]))
        };
        cuts.windows(2).map(piece).sum()
    }
}

/// Where what lies within `half_mm` of a point lies to what has the point at a depth.
pub fn side_of(depth_mm: f64, half_mm: f64) -> Side {
    if depth_mm >= half_mm {
        Side::In
    } else if depth_mm < -half_mm {
        Side::Out
    } else {
        Side::Between
    }
}

/// Half the longest diagonal of a cell, mm.
pub fn half_diagonal_mm(surface: &Surface) -> f64 {
    let m = surface.grid.index_to_world().matrix3;
    let signs = [DVec3::new(1.0, 1.0, 1.0), DVec3::new(-1.0, 1.0, 1.0), DVec3::new(1.0, -1.0, 1.0), DVec3::new(1.0, 1.0, -1.0)];
    signs.map(|s| 0.5 * (m * s).length()).into_iter().fold(0.0, f64::max)
}

/// The point of the world that a point of index space is.
pub fn world(surface: &Surface, point: DVec3) -> DVec3 {
    let WorldPoint(point) = surface.grid.world(IndexPoint(point));
    point
}

/// Where a sample lies, LPS mm.
pub fn point_of(surface: &Surface, at: [usize; 3]) -> DVec3 {
    world(surface, DVec3::from(at.map(|n| n as f64)))
}
