//! Jaws: the arch that teeth and bone follow, and plates bent along it.

use crate::curves::{around, catmull_rom};
use glam::{DVec2, DVec3};

/// A line in the horizontal plane, left half: a part of a circle from the midline, and on along its tangent.
#[derive(Clone, Copy, Debug)]
pub struct Arch {
    centre_y: f64,
    radius_mm: f64,
    turn: f64,
    /// Direction of the straight part.
    along: DVec2,
}

impl Arch {
    /// From (0, `front_y`) on a circle of `radius_mm` until the line has turned by `turn_deg` from +x to +y.
    pub fn new(front_y: f64, radius_mm: f64, turn_deg: f64) -> Self {
        let turn = turn_deg.to_radians();
        Self { centre_y: front_y + radius_mm, radius_mm, turn, along: DVec2::from_angle(turn) }
    }

    /// Length along the line from the midline to what is nearest to (x ≥ 0, y), and how far outside of it that is.
    pub fn unroll(&self, x: f64, y: f64) -> DVec2 {
        let v = DVec2::new(x, y - self.centre_y);
        let ahead = v.dot(self.along);
        if ahead >= 0.0 {
            DVec2::new(self.radius_mm * self.turn + ahead, v.perp_dot(self.along) - self.radius_mm)
        } else {
            DVec2::new(self.radius_mm * v.x.atan2(-v.y), v.length() - self.radius_mm)
        }
    }

    /// The point at `s_mm` along the line, and its unit tangent.
    pub fn at(&self, s_mm: f64) -> (DVec2, DVec2) {
        let angle = (s_mm / self.radius_mm).min(self.turn);
        let tangent = DVec2::from_angle(angle);
        let straight = s_mm - self.radius_mm * angle;
        (DVec2::new(0.0, self.centre_y) - self.radius_mm * tangent.perp() + straight * tangent, tangent)
    }
}

/// A plate with round edges that stands upright along an arch, thinner toward the back.
#[derive(Clone, Debug)]
pub struct Bent {
    arch: Arch,
    /// The edges of its closed outline: along the arch, and up.
    outline: Vec<[DVec2; 2]>,
    /// Half its thickness in front and in the back, and the places along the arch between which the one becomes the other.
    half_mm: [f64; 2],
    thins_mm: [f64; 2],
}

/// Edges between two corners that an outline is drawn through.
const SPAN: usize = 3;
/// Inside the arch, where its radii meet, and along its thinning, distances would grow by up to this much per mm.
const STEEPEST: f64 = 1.06;

impl Bent {
    /// The plate within the smooth closed line through `corners` (along the arch, world z).
    pub fn new(arch: Arch, corners: &[[f64; 2]], half_mm: [f64; 2], thins_mm: [f64; 2]) -> Self {
        let n = corners.len();
        let at = |i: usize| DVec2::from(corners[i % n]);
        let span = |i: usize| {
            let four = [at(i + n - 1), at(i), at(i + 1), at(i + 2)];
            (0..SPAN).map(move |step| catmull_rom(four, step as f64 / SPAN as f64))
        };
        let line: Vec<_> = (0..n).flat_map(span).collect();
        let outline = line.iter().zip(line.iter().cycle().skip(1)).map(|(a, b)| [*a, *b]).collect();
        Self { arch, outline, half_mm, thins_mm }
    }

    fn half_mm(&self, along: f64) -> f64 {
        let t = ((along - self.thins_mm[0]) / (self.thins_mm[1] - self.thins_mm[0])).clamp(0.0, 1.0);
        self.half_mm[0] + (self.half_mm[1] - self.half_mm[0]) * t * t * (3.0 - 2.0 * t)
    }

    /// Signed distance of `p` (x ≥ 0), a lower bound of it off the arch's straight part.
    pub fn distance(&self, p: DVec3) -> f64 {
        let [along, outward] = self.arch.unroll(p.x, p.y).to_array();
        let half = self.half_mm(along);
        let q = DVec2::new(polygon(DVec2::new(along, p.z), &self.outline) + half, outward.abs());
        (q.max(DVec2::ZERO).length() + q.max_element().min(0.0) - half) / STEEPEST
    }

    /// What of it counts within `radius_mm` of `p`: of its middle, no outline.
    pub fn near(&self, p: DVec3, radius_mm: f64) -> Self {
        let unrolled = self.arch.unroll(p.x, p.y);
        // Unrolling stretches what lies inside of the circle, without end at its centre.
        let room = self.arch.radius_mm + unrolled.y - radius_mm;
        if room <= 0.0 {
            return self.clone();
        }
        let reach = radius_mm * (self.arch.radius_mm / room).max(1.0);
        let q = DVec2::new(unrolled.x, p.z);
        let distance = polygon(q, &self.outline);
        if distance < -self.half_mm[0].max(self.half_mm[1]) - reach {
            return Self { outline: vec![], ..*self };
        }
        // The nearest edges, and those that tell inside from outside: to the right at the same height.
        let counts = |edge: &&[DVec2; 2]| {
            let (low, high) = (edge[0].min(edge[1]), edge[0].max(edge[1]));
            let is_beside = low.y <= q.y + reach && high.y >= q.y - reach && high.x >= q.x - reach;
            is_beside || to_edge(q, edge) <= distance.abs() + 2.0 * reach
        };
        Self { outline: self.outline.iter().filter(counts).copied().collect(), ..*self }
    }

    /// A ball that holds it: centre and radius.
    pub fn bounds(&self) -> (DVec3, f64) {
        let most = self.half_mm[0].max(self.half_mm[1]);
        around(self.outline.iter().map(|[q, _]| (self.arch.at(q.x).0.extend(q.y), most)))
    }
}

/// Signed distance to the closed polygon of `edges`, negative inside; without edges it is the whole plane.
fn polygon(p: DVec2, edges: &[[DVec2; 2]]) -> f64 {
    let mut nearest = f64::INFINITY;
    let mut is_inside = edges.is_empty();
    for edge in edges {
        nearest = nearest.min(to_edge(p, edge));
        // The line from p to the right passes the edge.
        let [a, b] = *edge;
        if (p.y >= a.y) != (p.y >= b.y) && ((b - a).perp_dot(p - a) > 0.0) == (b.y > a.y) {
            is_inside = !is_inside;
        }
    }
    if is_inside { -nearest } else { nearest }
}

fn to_edge(p: DVec2, &[a, b]: &[DVec2; 2]) -> f64 {
    let (v, edge) = (p - a, b - a);
    (v - edge * (v.dot(edge) / edge.length_squared()).clamp(0.0, 1.0)).length()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arches_unroll_to_where_they_were_rolled() {
        // Fails if the circle and its tangent do not meet, or outward is inward.
        let arch = Arch::new(-82.0, 24.0, 68.0);
        for n in 0..100 {
            let (s, off) = (f64::from(n), f64::from(n % 7) - 3.0);
            let (point, tangent) = arch.at(s);
            let q = point - off * tangent.perp();
            assert!(arch.unroll(q.x, q.y).abs_diff_eq(DVec2::new(s, off), 1e-9), "{s} {off}");
        }
    }

    #[test]
    fn bent_plates_have_their_thickness_and_outline() {
        // Fails if inside and outside are exchanged, or the thickness is taken elsewhere.
        let square = [[10.0, 0.0], [50.0, 0.0], [50.0, 30.0], [10.0, 30.0]];
        let arch = Arch::new(-80.0, 24.0, 70.0);
        let plate = Bent::new(arch, &square, [5.0, 3.0], [30.0, 40.0]);
        let at = |s: f64, off: f64, z: f64| {
            let (point, tangent) = arch.at(s);
            plate.distance((point - off * tangent.perp()).extend(z)) * STEEPEST
        };
        assert!((at(25.0, 0.0, 15.0) + 5.0).abs() < 1e-9 && (at(45.0, 4.0, 15.0) - 1.0).abs() < 1e-9);
        assert!(at(70.0, 0.0, 15.0) > 15.0 && at(30.0, 0.0, 36.0) < 6.0 && at(30.0, 0.0, 36.0) > 0.0);
        assert!(plate.bounds().1 > 20.0);
    }
}
