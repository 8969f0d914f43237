//! Signed distances (mm, negative inside) of the solids that phantoms are made of, and their smooth union.
//!
//! All of them change by at most 1 mm per mm, so that a distance is a radius that holds no surface. Formulas after
//! I. Quilez, "distance functions" (iquilezles.org), where not derived beside them.

use crate::arch::Bent;
use crate::curves::{around, catmull_rom};
use glam::{DMat3, DVec2, DVec3};

/// A solid in world mm.
#[derive(Clone, Debug)]
pub enum Shape {
    /// All balls that roll along a line of round cones, without fillets between these. Exact.
    Tube(Vec<RoundCone>),
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
    /// A plate bent along an arch.
    Bent(Bent),
}

/// All balls whose centres lie on a segment and whose radii change linearly along it.
#[derive(Clone, Copy, Debug)]
pub struct RoundCone {
    start: DVec3,
    axis: DVec3,
    length_mm: f64,
    radii_mm: [f64; 2],
    /// Radius lost per mm of the axis, and the tangent of the angle between the side's normals and the plane across the axis.
    slope: f64,
    tangent: f64,
}

impl RoundCone {
    /// The cone between the balls of `radii_mm` around `start` and `end`; neither ball may hold the other.
    pub fn new(start: DVec3, end: DVec3, radii_mm: [f64; 2]) -> Self {
        let length_mm = start.distance(end);
        let slope = (radii_mm[0] - radii_mm[1]) / length_mm;
        assert!(slope.abs() < 1.0, "one ball of a round cone holds the other");
        Self { start, axis: (end - start) / length_mm, length_mm, radii_mm, slope, tangent: slope / (1.0 - slope * slope).sqrt() }
    }

    /// Signed distance. That of the ball at s along the axis, √(ρ² + (u−s)²) − r(s), is convex in s and least where
    /// (u−s)/√(ρ² + (u−s)²) = −dr/ds, or at the end that is nearer to it.
    #[inline]
    pub fn distance(&self, p: DVec3) -> f64 {
        let v = p - self.start;
        let u = v.dot(self.axis);
        let rho_squared = (v.length_squared() - u * u).max(0.0);
        let s = (u - rho_squared.sqrt() * self.tangent).clamp(0.0, self.length_mm);
        (rho_squared + (u - s) * (u - s)).sqrt() - (self.radii_mm[0] - s * self.slope)
    }

    fn bounds(&self) -> (DVec3, f64) {
        (self.start + 0.5 * self.length_mm * self.axis, 0.5 * self.length_mm + self.radii_mm[0].max(self.radii_mm[1]))
    }
}

/// Twice what a field may change per mm: a union may fall while a part rises.
const GROWTH: f64 = 2.2;

/// A tube's round cones are about as long as this: bends between them are smaller than a scan shows.
const CONE_MM: f64 = 5.0;

impl Shape {
    /// A tube along the smooth line (Catmull and Rom 1974) through balls x, y, z, radius.
    pub fn tube(balls: &[[f64; 4]]) -> Self {
        let at = |n: isize| glam::DVec4::from(balls[n.clamp(0, balls.len() as isize - 1) as usize]);
        let span = |n: isize| {
            let cones = (at(n).truncate().distance(at(n + 1).truncate()) / CONE_MM).ceil() as usize;
            (0..cones).map(move |step| catmull_rom([at(n - 1), at(n), at(n + 1), at(n + 2)], step as f64 / cones as f64))
        };
        let mut line: Vec<_> = (0..balls.len() as isize - 1).flat_map(span).collect();
        line.push(at(balls.len() as isize));
        Self::Tube(line.windows(2).map(|w| RoundCone::new(w[0].truncate(), w[1].truncate(), [w[0].w, w[1].w])).collect())
    }

    /// Signed distance of `p`.
    pub fn distance(&self, p: DVec3) -> f64 {
        match self {
            Self::Tube(cones) => cones.iter().map(|cone| cone.distance(p)).fold(f64::INFINITY, f64::min),
            Self::Plate { corners, radius_mm } => triangle(p, corners) - radius_mm,
            Self::RoundBox { centre, axes, half_mm, edge_mm } => {
                let q = (axes.transpose() * (p - centre)).abs() - half_mm + edge_mm;
                q.max(DVec3::ZERO).length() + q.max_element().min(0.0) - edge_mm
            }
            Self::Bent(bent) => bent.distance(p),
        }
    }

    /// A ball that holds the solid: centre and radius.
    pub fn bounds(&self) -> (DVec3, f64) {
        match self {
            Self::Tube(cones) => around(cones.iter().map(RoundCone::bounds)),
            Self::Plate { corners, radius_mm } => around(corners.iter().map(|c| (*c, *radius_mm))),
            Self::RoundBox { centre, half_mm, .. } => (*centre, half_mm.length()),
            Self::Bent(bent) => bent.bounds(),
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

/// Union of two whose seam is a fillet where the distances differ by less than `blend_mm`; elsewhere the plain minimum.
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

/// Union of many with fillets: the level F at which the solids' shares, (1 − (dᵢ − F)/blend)² where dᵢ < F + blend, sum to 1.
///
/// Its gradient is a weighted mean of theirs, so that it changes by at most 1 mm per mm; it does not depend on their order; and
/// what is farther than F by `blend_mm` has no part in it at all.
fn fillet(distances: &mut [f64], blend_mm: f64) -> f64 {
    distances.sort_unstable_by(f64::total_cmp);
    let nearest = distances[0];
    // With g = (nearest − F)/blend and a = 1 − (d − nearest)/blend: Σ(a − g)² = 1 over all a > g, nearest first.
    let (mut n, mut sum, mut squares, mut g) = (0.0, 0.0, 0.0, 0.0);
    for distance in distances {
        let a = 1.0 - (*distance - nearest) / blend_mm;
        if a <= g {
            break;
        }
        (n, sum, squares) = (n + 1.0, sum + a, squares + a * a);
        g = (sum - (sum * sum - n * (squares - 1.0)).max(0.0).sqrt()) / n;
    }
    nearest - g * blend_mm
}

/// Solids joined with fillets, mirrored in x: only the half x ≥ 0 is stated.
#[derive(Clone, Debug)]
pub struct Group {
    parts: Vec<Part>,
    blend_mm: f64,
    centre: DVec3,
    radius_mm: f64,
}

/// A solid in its bounding ball.
#[derive(Clone, Debug)]
struct Part {
    shape: Shape,
    centre: DVec3,
    radius_mm: f64,
}

impl Part {
    /// What of the solid, which is at `distance_mm` from `p`, has the distance of all of it within `radius_mm` of `p`.
    fn near(&self, distance_mm: f64, p: DVec3, radius_mm: f64) -> Self {
        match &self.shape {
            Shape::Tube(cones) => {
                let near = cones.iter().filter(|cone| cone.distance(p) <= distance_mm + 2.0 * radius_mm);
                let shape = Shape::Tube(near.copied().collect());
                let (centre, radius_mm) = shape.bounds();
                Self { shape, centre, radius_mm }
            }
            Shape::Bent(bent) => Self { shape: Shape::Bent(bent.near(p, radius_mm)), ..*self },
            other => Self { shape: other.clone(), ..*self },
        }
    }
}

/// Most solids of a group.
const MOST_PARTS: usize = 31;

impl Group {
    /// A group of `shapes`; seams are filleted over `blend_mm`.
    pub fn new(blend_mm: f64, shapes: impl IntoIterator<Item = Shape>) -> Self {
        let part = |shape: Shape| {
            let (centre, radius_mm) = shape.bounds();
            Part { shape, centre, radius_mm }
        };
        let parts: Vec<_> = shapes.into_iter().map(part).collect();
        assert!(parts.len() <= MOST_PARTS, "a group has too many solids");
        let (centre, radius_mm) = around(parts.iter().map(|p| (p.centre, p.radius_mm)));
        Self { parts, blend_mm, centre, radius_mm }
    }

    /// No part of the group is nearer to `mirrored` (a point with x ≥ 0) than this.
    pub fn at_least(&self, mirrored: DVec3) -> f64 {
        if self.parts.is_empty() { f64::INFINITY } else { mirrored.distance(self.centre) - self.radius_mm }
    }

    /// `distance` (of all else at this point) united with the group. What cannot change the result is not evaluated.
    pub fn unite(&self, distance: f64, p: DVec3) -> f64 {
        let p = DVec3::new(p.x.abs(), p.y, p.z);
        if self.at_least(p) >= distance + self.blend_mm {
            return distance;
        }
        let (mut distances, mut n, mut nearest) = ([distance; MOST_PARTS + 1], usize::from(distance < f64::INFINITY), distance);
        for part in &self.parts {
            let reach = nearest + self.blend_mm + part.radius_mm;
            if reach > 0.0 && p.distance_squared(part.centre) < reach * reach {
                distances[n] = part.shape.distance(p);
                nearest = nearest.min(distances[n]);
                n += 1;
            }
        }
        if n == 1 { nearest } else { fillet(&mut distances[..n], self.blend_mm) }
    }

    /// What of the group matters within `radius_mm` of `p`, where all of it, united with all else, is at `united_mm` at most.
    pub fn near(&self, united_mm: f64, p: DVec3, radius_mm: f64) -> Self {
        let p = DVec3::new(p.x.abs(), p.y, p.z);
        // The union falls, and the part rises, by what a field may change.
        let reach = united_mm + self.blend_mm + GROWTH * radius_mm;
        if self.at_least(p) >= reach {
            return Self { parts: vec![], ..*self };
        }
        let near = |part: &Part| {
            if p.distance(part.centre) - part.radius_mm >= reach {
                return None;
            }
            let distance_mm = part.shape.distance(p);
            (distance_mm < reach).then(|| (distance_mm, part.near(distance_mm, p, radius_mm)))
        };
        let mut parts: Vec<_> = self.parts.iter().filter_map(near).collect();
        // What the nearest leave no share is passed over soonest.
        parts.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        Self { parts: parts.into_iter().map(|(_, part)| part).collect(), ..*self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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

    #[test]
    fn a_tube_passes_through_its_balls() {
        // Fails if the curve leaves out an end, or a radius does not follow its ball.
        let balls = [[0.0, 0.0, 0.0, 2.0], [10.0, 3.0, 1.0, 3.0], [18.0, 9.0, -2.0, 1.0]];
        let tube = Shape::tube(&balls);
        for [x, y, z, r] in balls {
            assert!((tube.distance(DVec3::new(x, y, z)) + r).abs() < 0.05 * r, "{x}");
        }
        assert!((tube.distance(DVec3::new(-7.0, 0.0, 0.0)) - 5.0).abs() < 0.2);
    }

    #[test]
    fn fillets_have_shares_that_sum_to_one_in_any_order() {
        // Fails if the level is not the root, a solid out of reach counts, or the order matters.
        let mut random = crate::Random(5);
        for _ in 0..1000 {
            let mut distances: Vec<f64> = (0..6).map(|_| 9.0 * random.unit() - 3.0).collect();
            let level = fillet(&mut distances.clone(), 4.0);
            let shares: f64 = distances.iter().map(|d| (1.0 - (d - level) / 4.0).max(0.0).powi(2)).sum();
            assert!((shares - 1.0).abs() < 1e-12, "{shares}");
            distances.reverse();
            assert_eq!(fillet(&mut distances, 4.0), level);
        }
        assert_eq!(fillet(&mut [3.0, -1.0], 4.0), -1.0);
    }
}
