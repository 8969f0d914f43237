//! A plane that a surface is cut by, with coordinates of its own, mm.

use bregma_field::{IndexPoint, Surface, WorldPoint};
use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

/// A plane.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plane {
    /// A point of it, LPS mm.
    pub point_mm: DVec3,
    /// Unit.
    pub normal: DVec3,
}

/// The sine of the least angle between a line and a normal that span a plane: no one picks points so that it is less.
const ON_A_LINE: f64 = 1e-3;

impl Plane {
    /// Through a point, square to a direction; `None` where that is none.
    pub fn new(point_mm: DVec3, normal: DVec3) -> Option<Self> {
        let normal = normal.try_normalize().filter(|_| point_mm.is_finite())?;
        Some(Self { point_mm, normal })
    }

    /// The profile plane of two points of a surface: it holds both and the mean of the outward unit normals there. `None` where that mean
    /// lies along their line, or is nothing.
    pub fn profile(points: [DVec3; 2], normals: [DVec3; 2]) -> Option<Self> {
        let along = (points[1] - points[0]).try_normalize()?;
        let across = along.cross(0.5 * (normals[0] + normals[1]));
        if across.length() > ON_A_LINE { Self::new(points[0], across) } else { None }
    }
}

/// A plane in the index space of a surface's scan.
#[derive(Clone, Copy, Debug)]
pub struct InPlane<'a> {
    pub surface: &'a Surface,
    pub plane: Plane,
    /// The plane's own axes in the world: with its normal they are right-handed.
    axes: [DVec3; 2],
    /// The plane's point in index space, and what a mm along each axis is there.
    origin: DVec3,
    pub steps: [DVec3; 2],
    /// The plane is where `covector`·u = `offset`, in voxels about.
    covector: DVec3,
    offset: f64,
}

impl<'a> InPlane<'a> {
    pub fn new(surface: &'a Surface, plane: Plane) -> Self {
        let (first, second) = plane.normal.any_orthonormal_pair();
        // Whichever way round that pair is.
        let axes = if first.cross(second).dot(plane.normal) > 0.0 { [first, second] } else { [second, first] };
        let origin = surface.grid.index(WorldPoint(plane.point_mm)).0;
        let steps = axes.map(|axis| surface.grid.world_to_index().matrix3 * axis);
        let covector = (surface.grid.index_to_world().matrix3.transpose() * plane.normal).normalize_or_zero();
        Self { surface, plane, axes, origin, steps, covector, offset: covector.dot(origin) }
    }

    /// How far a point of index space lies on the normal's side, voxels.
    pub fn side(&self, index: DVec3) -> f64 {
        self.covector.dot(index) - self.offset
    }

    /// Along which axis of the grid the plane is met most squarely.
    pub fn steepest(&self) -> usize {
        self.covector.abs().max_position()
    }

    /// Where the plane has the other two coordinates of `index`, along `axis`.
    pub fn height(&self, index: DVec3, axis: usize) -> f64 {
        index[axis] - self.side(index) / self.covector[axis]
    }

    pub fn index(&self, at: DVec2) -> DVec3 {
        self.origin + at.x * self.steps[0] + at.y * self.steps[1]
    }

    pub fn world(&self, at: DVec2) -> DVec3 {
        self.plane.point_mm + at.x * self.axes[0] + at.y * self.axes[1]
    }

    /// The foot of a point of the world.
    pub fn foot(&self, point_mm: DVec3) -> DVec2 {
        let away = point_mm - self.plane.point_mm;
        DVec2::new(away.dot(self.axes[0]), away.dot(self.axes[1]))
    }

    pub fn foot_of_index(&self, index: DVec3) -> DVec2 {
        self.foot(self.surface.grid.world(IndexPoint(index)).0)
    }

    /// How a function of this gradient in index space changes per mm along the plane's axes.
    pub fn along(&self, gradient: DVec3) -> DVec2 {
        DVec2::new(gradient.dot(self.steps[0]), gradient.dot(self.steps[1]))
    }

    /// A direction of the world, from the plane's own coordinates.
    pub fn direction(&self, d: DVec3) -> DVec2 {
        DVec2::new(d.dot(self.axes[0]), d.dot(self.axes[1]))
    }

    /// As long as a voxel is along the plane's axes where it is shortest, mm.
    pub fn voxel_mm(&self) -> f64 {
        1.0 / self.steps[0].length().max(self.steps[1].length())
    }
}
