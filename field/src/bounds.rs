//! How much of the world scans take.

use bregma_volume::Grid;
use glam::DVec3;

/// A sphere around everything that is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Its centre.
    pub centre_mm: DVec3,
    /// Its radius.
    pub radius_mm: f64,
}

impl Bounds {
    /// The sphere around the boxes of `grids`: for one, box centre and half its diagonal; for more, the centre of their
    /// common axis-aligned box and the farthest corner from it. A unit sphere at the origin for none.
    pub fn of<'a>(grids: impl IntoIterator<Item = &'a Grid>) -> Self {
        let corners: Vec<DVec3> = grids.into_iter().flat_map(Grid::corners_mm).collect();
        let Some(&first) = corners.first() else { return Self { centre_mm: DVec3::ZERO, radius_mm: 1.0 } };
        let (low, high) = corners.iter().fold((first, first), |(low, high), &c| (low.min(c), high.max(c)));
        let centre_mm = (low + high) / 2.0;
        let radius_mm = corners.iter().map(|c| c.distance(centre_mm)).fold(0.0, f64::max);
        // A single sample has no extent: any positive radius lets the camera stand somewhere.
        Self { centre_mm, radius_mm: if radius_mm > 0.0 { radius_mm } else { 1.0 } }
    }
}
