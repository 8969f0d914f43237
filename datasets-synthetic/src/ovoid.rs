//! A convex solid of revolution, smooth everywhere, whose nearest points are known to the last digits.

use glam::DVec3;

/// All balls whose centres lie on a segment and whose radii are a concave parabola along it.
#[derive(Clone, Copy, Debug)]
pub struct Ovoid {
    start: DVec3,
    axis: DVec3,
    length_mm: f64,
    /// Radius at s: `radius[0] + radius[1]·s − radius[2]·s²`.
    radius: [f64; 3],
}

/// What an ovoid knows of a point: the ball that is nearest to it.
#[derive(Clone, Copy, Debug)]
pub struct Foot {
    /// Signed distance to the surface.
    pub distance_mm: f64,
    /// Unit outer normal at the nearest point of the surface; constant along the normal line.
    pub normal: DVec3,
    /// That nearest point.
    pub point: DVec3,
}

/// Newton's steps that are enough: each doubles the digits, and where one leaves the bracket, halving it takes 50.
const STEPS: usize = 60;
/// After a step as short as this, what Newton's next would add is its square: less than float64 resolves.
const STILL_MM: f64 = 1e-7;

impl Ovoid {
    /// Between balls of `radii_mm` around `start` and `end`; halfway the radius is `bulge_mm` above the mean of the two.
    pub fn new(start: DVec3, end: DVec3, radii_mm: [f64; 2], bulge_mm: f64) -> Self {
        let length_mm = start.distance(end);
        let slope = (radii_mm[1] - radii_mm[0] + 4.0 * bulge_mm) / length_mm;
        let radius = [radii_mm[0], slope, 4.0 * bulge_mm / (length_mm * length_mm)];
        assert!(bulge_mm > 0.0 && slope.abs() < 1.0, "one ball of an ovoid holds the others");
        Self { start, axis: (end - start) / length_mm, length_mm, radius }
    }

    fn ball(&self, s: f64) -> (DVec3, f64) {
        (self.start + s * self.axis, self.radius[0] + s * (self.radius[1] - s * self.radius[2]))
    }

    /// Signed distance with the nearest point. On the axis, where every direction is as near, the normal is +z.
    pub fn foot(&self, p: DVec3) -> Foot {
        let v = p - self.start;
        let u = v.dot(self.axis);
        let rho_squared = (v.length_squared() - u * u).max(0.0);
        // The distance to the ball at s, √(ρ² + (u−s)²) − r(s), is convex in s: its slope grows, and is 0 at one place at most.
        let [_, b, c] = self.radius;
        let slope = |s: f64| {
            let far = (rho_squared + (u - s) * (u - s)).sqrt().max(f64::MIN_POSITIVE);
            ((s - u) / far - b + 2.0 * c * s, rho_squared / (far * far * far) + 2.0 * c)
        };
        let (mut low, mut high) = (0.0, self.length_mm);
        // Where the slope would be 0 if it were far from the axis.
        let mut s = (u + rho_squared.sqrt() * (b - 2.0 * c * u.clamp(low, high))).clamp(low, high);
        for _ in 0..STEPS {
            let (rise, curvature) = slope(s);
            (low, high) = if rise < 0.0 { (s, high) } else { (low, s) };
            let next = s - rise / curvature;
            // An end is the answer where the slope leads out of it.
            let next = if (low..=high).contains(&next) { next } else { beyond(next, low, high, self.length_mm) };
            let step = (next - s).abs();
            s = next;
            if step < STILL_MM {
                break;
            }
        }
        let (centre, radius) = self.ball(s);
        let normal = (p - centre).try_normalize().unwrap_or(DVec3::Z);
        Foot { distance_mm: p.distance(centre) - radius, normal, point: centre + radius * normal }
    }

    /// The point of the surface whose outer normal is `normal` (unit).
    pub fn point(&self, normal: DVec3) -> DVec3 {
        // Where n·axis = −dr/ds.
        let [_, b, c] = self.radius;
        let (centre, radius) = self.ball(((b + normal.dot(self.axis)) / (2.0 * c)).clamp(0.0, self.length_mm));
        centre + radius * normal
    }
}

/// In the place of a step to `next`, which leaves the bracket: the segment's end if that is what it leaves, else the middle.
fn beyond(next: f64, low: f64, high: f64, length_mm: f64) -> f64 {
    if next < low && low == 0.0 {
        0.0
    } else if next > high && high == length_mm {
        length_mm
    } else {
        0.5 * (low + high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn feet_lie_on_the_surface_along_the_normal() {
        // Fails if the nearest ball is chosen wrongly: on the side, at the ends, inside or outside; or a normal has another point.
        let ovoid = Ovoid::new(DVec3::new(0.0, -35.0, 18.0), DVec3::new(0.0, 22.0, 2.0), [52.0, 66.0], 8.0);
        for i in 0..1000 {
            let p = DVec3::new((i as f64).sin(), (1.7 * i as f64).sin(), (2.9 * i as f64).cos()) * 100.0;
            let foot = ovoid.foot(p);
            assert!(ovoid.foot(foot.point).distance_mm.abs() < 1e-12 && (foot.point + foot.distance_mm * foot.normal - p).length() < 1e-10);
            let inner = ovoid.foot(foot.point - 20.0 * foot.normal);
            assert!((inner.distance_mm + 20.0).abs() < 1e-12 && inner.normal.distance(foot.normal) < 1e-10, "{p}");
            assert!(ovoid.point(foot.normal).distance(foot.point) < 1e-9);
            // No ball is nearer.
            let nearest = (0..=1000).map(|n| ovoid.ball(ovoid.length_mm * f64::from(n) / 1000.0)).map(|(c, r)| p.distance(c) - r);
            assert!(nearest.fold(f64::INFINITY, f64::min) > foot.distance_mm - 1e-12);
        }
    }
}
