//! Signed distances (mm, negative inside) of the solids that phantoms are made of.
//!
//! All of them change by at most 1 mm per mm, so that a distance is a radius that holds no surface. Formulas after
//! I. Quilez, "distance functions" (iquilezles.org), where not derived beside them.

use glam::{DMat3, DVec2, DVec3};

/// A solid in world mm.
#[derive(Clone, Copy, Debug)]
pub enum Shape {
    /// Ellipsoid along the axes. A ball's distance is exact; otherwise it is a lower bound with the exact zero.
    Ellipsoid {
        /// Its centre.
        centre: DVec3,
        /// Its half axes.
        radii_mm: DVec3,
    },
    /// All balls between two balls (a capsule where the radii agree). Exact.
    RoundCone(RoundCone),
    /// All points within `radius_mm` of a triangle: a plate with round edges. Exact outside the triangle itself.
    Plate {
        /// The triangle's corners.
        corners: [DVec3; 3],
        /// Half the plate's thickness.
        radius_mm: f64,
    },
    /// A box with round edges. Exact.
    RoundBox {
        /// Its centre.
        centre: DVec3,
        /// Its axes as columns, orthonormal.
        axes: DMat3,
        /// Its half sides, rounding included.
        half_mm: DVec3,
        /// Radius of its edges.
        edge_mm: f64,
    },
}

/// All balls whose centres lie on a segment and whose radii change linearly along it.
#[derive(Clone, Copy, Debug)]
pub struct RoundCone {
    start: DVec3,
    axis: DVec3,
    length_mm: f64,
    radii_mm: [f64; 2],
    /// Cosine and sine of the angle between the normals of the cone's side and the plane across its axis.
    tilt: [f64; 2],
}

/// What a round cone knows of a point: the ball that is nearest to it.
#[derive(Clone, Copy, Debug)]
pub struct Foot {
    /// Signed distance to the cone's surface.
    pub distance_mm: f64,
    /// Unit outer normal at the nearest point of the surface; constant along the normal line.
    pub normal: DVec3,
    /// That nearest point.
    pub point: DVec3,
}

impl RoundCone {
    /// The cone between the balls of `radii_mm` around `start` and `end`; neither ball may hold the other.
    pub fn new(start: DVec3, end: DVec3, radii_mm: [f64; 2]) -> Self {
        let length_mm = start.distance(end);
        let sine = (radii_mm[0] - radii_mm[1]) / length_mm;
        assert!(sine.abs() < 1.0, "one ball of a round cone holds the other");
        Self { start, axis: (end - start) / length_mm, length_mm, radii_mm, tilt: [(1.0 - sine * sine).sqrt(), sine] }
    }

    /// The nearest ball: its centre and radius. The distance to the ball at s along the axis, √(ρ² + (u−s)²) − r(s), is
    /// convex in s and least where (u−s)/√(ρ² + (u−s)²) = −dr/ds, or at the end that is nearer to it.
    fn ball(&self, p: DVec3) -> (DVec3, f64) {
        let v = p - self.start;
        let u = v.dot(self.axis);
        let rho = (v.length_squared() - u * u).max(0.0).sqrt();
        let s = (u - rho * self.tilt[1] / self.tilt[0]).clamp(0.0, self.length_mm);
        (self.start + s * self.axis, self.radii_mm[0] - s * self.tilt[1])
    }

    /// Signed distance.
    pub fn distance(&self, p: DVec3) -> f64 {
        let (centre, radius) = self.ball(p);
        p.distance(centre) - radius
    }

    /// Signed distance with the nearest point. On the axis, where every direction is as near, the normal is +z.
    pub fn foot(&self, p: DVec3) -> Foot {
        let (centre, radius) = self.ball(p);
        let normal = (p - centre).try_normalize().unwrap_or(DVec3::Z);
        Foot { distance_mm: p.distance(centre) - radius, normal, point: centre + radius * normal }
    }
}

impl Shape {
    /// A ball.
    pub fn ball(centre: DVec3, radius_mm: f64) -> Self {
        Self::Ellipsoid { centre, radii_mm: DVec3::splat(radius_mm) }
    }

    /// Signed distance of `p`.
    pub fn distance(&self, p: DVec3) -> f64 {
        match self {
            // |∇|p/r|| ≤ 1/min r, so the factor makes it 1-Lipschitz.
            Self::Ellipsoid { centre, radii_mm } => (((p - centre) / radii_mm).length() - 1.0) * radii_mm.min_element(),
            Self::RoundCone(cone) => cone.distance(p),
            Self::Plate { corners, radius_mm } => triangle(p, corners) - radius_mm,
            Self::RoundBox { centre, axes, half_mm, edge_mm } => {
                let q = (axes.transpose() * (p - centre)).abs() - half_mm + edge_mm;
                q.max(DVec3::ZERO).length() + q.max_element().min(0.0) - edge_mm
            }
        }
    }

    /// A ball that holds the solid: centre and radius.
    pub fn bounds(&self) -> (DVec3, f64) {
        match self {
            Self::Ellipsoid { centre, radii_mm } => (*centre, radii_mm.max_element()),
            Self::RoundCone(c) => {
                let middle = c.start + 0.5 * c.length_mm * c.axis;
                (middle, 0.5 * c.length_mm + c.radii_mm[0].max(c.radii_mm[1]))
            }
            Self::Plate { corners: [a, b, c], radius_mm } => {
                let middle = (a + b + c) / 3.0;
                (middle, a.distance(middle).max(b.distance(middle)).max(c.distance(middle)) + radius_mm)
            }
            Self::RoundBox { centre, half_mm, .. } => (*centre, half_mm.length()),
        }
    }
}

fn triangle(p: DVec3, &[a, b, c]: &[DVec3; 3]) -> f64 {
    let normal = (b - a).cross(c - a);
    let above = |from: DVec3, to: DVec3| normal.cross(to - from).dot(p - from) >= 0.0;
    if above(a, b) && above(b, c) && above(c, a) {
        (p - a).dot(normal).abs() / normal.length()
    } else {
        segment(p, a, b).min(segment(p, b, c)).min(segment(p, c, a))
    }
}

fn segment(p: DVec3, a: DVec3, b: DVec3) -> f64 {
    let (v, w) = (p - a, b - a);
    (v - w * (v.dot(w) / w.length_squared()).clamp(0.0, 1.0)).length()
}

/// Union whose seam is a fillet where the two distances differ by less than `blend_mm`; elsewhere the plain minimum.
pub fn smooth_union(a: f64, b: f64, blend_mm: f64) -> f64 {
    let h = (1.0 - (a - b).abs() / blend_mm).max(0.0);
    a.min(b) - 0.25 * blend_mm * h * h
}

/// `a` without `b`, its edge rounded where the two distances are within `blend_mm` of each other.
pub fn smooth_subtraction(a: f64, b: f64, blend_mm: f64) -> f64 {
    -smooth_union(-a, b, blend_mm)
}

/// Distance of a point (along, across) to the zigzag line through (0, −amplitude) and (period/2, amplitude). Exact: the
/// line is symmetric about each of its corners, so that folding there keeps the nearest point.
pub fn zigzag(p: DVec2, period_mm: f64, amplitude_mm: f64) -> f64 {
    let half = 0.5 * period_mm;
    let phase = p.x.rem_euclid(period_mm);
    let q = DVec2::new(phase.min(period_mm - phase), p.y + amplitude_mm);
    let side = DVec2::new(half, 2.0 * amplitude_mm);
    (q - side * (q.dot(side) / side.length_squared()).clamp(0.0, 1.0)).length()
}

/// Solids joined with fillets, mirrored in x: only the half x ≥ 0 is stated.
#[derive(Clone, Debug)]
pub struct Group {
    parts: Vec<(Shape, DVec3, f64)>,
    blend_mm: f64,
    centre: DVec3,
    radius_mm: f64,
}

impl Group {
    /// A group of at least one shape; seams are filleted over `blend_mm`.
    pub fn new(blend_mm: f64, shapes: impl IntoIterator<Item = Shape>) -> Self {
        let parts: Vec<_> = shapes.into_iter().map(|s| (s, s.bounds().0, s.bounds().1)).collect();
        let centre = parts.iter().map(|p| p.1).sum::<DVec3>() / parts.len() as f64;
        let radius_mm = parts.iter().map(|p| p.1.distance(centre) + p.2).fold(0.0, f64::max);
        Self { parts, blend_mm, centre, radius_mm }
    }

    /// No part of the group is nearer to `mirrored` (a point with x ≥ 0) than this.
    pub fn at_least(&self, mirrored: DVec3) -> f64 {
        mirrored.distance(self.centre) - self.radius_mm
    }

    /// `distance` (of all else at this point) united with the group. What cannot change the result is not evaluated.
    pub fn unite(&self, distance: f64, p: DVec3) -> f64 {
        let p = DVec3::new(p.x.abs(), p.y, p.z);
        if self.at_least(p) >= distance + self.blend_mm {
            return distance;
        }
        self.parts.iter().fold(distance, |best, (shape, centre, radius)| {
            let reach = best + self.blend_mm + radius;
            if reach <= 0.0 || p.distance_squared(*centre) >= reach * reach {
                best
            } else {
                smooth_union(best, shape.distance(p), self.blend_mm)
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn feet_lie_on_the_surface_along_the_normal() {
        // Fails if the nearest ball is chosen wrongly: on the side, at the ends, inside or outside.
        let cone = RoundCone::new(DVec3::new(0.0, -35.0, 18.0), DVec3::new(0.0, 22.0, 2.0), [52.0, 70.0]);
        for i in 0..1000 {
            let n = DVec3::new((i as f64).sin(), (1.7 * i as f64).sin(), (2.9 * i as f64).cos()) * 100.0;
            let foot = cone.foot(n);
            assert!(cone.distance(foot.point).abs() < 1e-12 && (foot.point + foot.distance_mm * foot.normal - n).length() < 1e-10);
            let inner = cone.foot(foot.point - 20.0 * foot.normal);
            assert!((inner.distance_mm + 20.0).abs() < 1e-12 && inner.normal.distance(foot.normal) < 1e-12);
        }
    }

    #[test]
    fn plates_boxes_and_zigzags_have_their_distances() {
        // Fails if an edge, a corner or a folded period is measured to the wrong piece.
        let plate = Shape::Plate { corners: [DVec3::ZERO, 4.0 * DVec3::X, 4.0 * DVec3::Y], radius_mm: 1.0 };
        let at = |x, y, z| plate.distance(DVec3::new(x, y, z));
        assert!((at(1.0, 1.0, 3.0) - 2.0).abs() < 1e-12 && (at(-3.0, -4.0, 0.0) - 4.0).abs() < 1e-12);
        assert!((at(4.0, 4.0, 0.0) - (8.0_f64.sqrt() - 1.0)).abs() < 1e-12);
        let cube = Shape::RoundBox { centre: DVec3::ONE, axes: DMat3::IDENTITY, half_mm: DVec3::splat(2.0), edge_mm: 0.5 };
        assert!((cube.distance(DVec3::new(5.0, 1.0, 1.0)) - 2.0).abs() < 1e-12);
        assert!((cube.distance(DVec3::ONE) + 2.0).abs() < 1e-12);
        let z = |x, y| zigzag(DVec2::new(x, y), 8.0, 2.0);
        assert!(z(0.0, -2.0) < 1e-12 && z(-4.0, 2.0) < 1e-12 && z(9.0, -1.0) < 1e-12);
        assert!((z(8.0, -3.0) - 1.0).abs() < 1e-12 && (z(1.0, 0.0) - 0.5_f64.sqrt()).abs() < 1e-12);
    }
}
