//! Rays in the world.

use bregma_volume::WorldPoint;
use glam::DVec3;

/// A ray in the world. Points on it are `origin + t·direction`, t in mm.
///
/// ```
/// use bregma_field::{Ray, WorldPoint};
/// use glam::DVec3;
///
/// let ray = Ray::new(WorldPoint(DVec3::ZERO), DVec3::new(0.0, 3.0, 4.0)).expect("that is a direction");
/// assert!(ray.at(10.0).0.distance(DVec3::new(0.0, 6.0, 8.0)) < 1e-12);
/// assert!(Ray::new(WorldPoint(DVec3::ZERO), DVec3::ZERO).is_none());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where t is 0.
    pub origin: WorldPoint,
    /// Unit vector.
    pub direction: DVec3,
}

impl Ray {
    /// A ray from `origin` along `direction`, which is normalised; `None` when it has no direction or is not finite.
    pub fn new(origin: WorldPoint, direction: DVec3) -> Option<Self> {
        let direction = direction.try_normalize()?;
        (origin.0.is_finite() && direction.is_finite()).then_some(Self { origin, direction })
    }

    /// The point at `t_mm`.
    pub fn at(&self, t_mm: f64) -> WorldPoint {
        WorldPoint(self.origin.0 + t_mm * self.direction)
    }
}
