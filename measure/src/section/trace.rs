//! A curve's way through one cell: steps along its tangent, each brought back onto the surface within the plane.

use super::plane::InPlane;
use bregma_field::interpolant::{corners, gradient, value};
use glam::{DVec2, DVec3, USizeVec3};

/// A cell with the interpolant in it.
pub(super) struct InCell<'a> {
    plane: &'a InPlane<'a>,
    cell: USizeVec3,
    f: [f64; 8],
}

/// A point of a curve, and its unit tangent there.
pub(super) type Point = (DVec2, DVec2);

/// Steps along a curve, voxels: between two points the curve is a circle's arc but for about a millionth of its length.
const STEP_VOXEL: f64 = 1.0 / 16.0;
/// Steps of which a point beyond hardly turns the tangent are made; others are halved. The cosine of the turn.
const HARDLY_TURNED: f64 = 0.98;
/// Shorter steps lead nowhere: there the surface has no normal in the plane.
const LEAST_STEP_VOXEL: f64 = 1e-6;
/// A way that is longer than so many steps goes round within the cell.
const MOST_STEPS: usize = 2000;
/// Steps of Newton's method: five are the rule, as it doubles the digits.
const NEWTON: usize = 12;
/// A step that is shorter is rounding, voxels: values of thousands that change by one per voxel are good to that.
const SETTLED_VOXEL: f64 = 1e-11;
/// So far outside a cell is rounding, voxels.
const OUTSIDE_VOXEL: f64 = 1e-12;

impl<'a> InCell<'a> {
    pub fn of(plane: &'a InPlane<'a>, cell: USizeVec3) -> Self {
        Self { plane, cell, f: corners(plane.surface, cell) }
    }

    fn local(&self, at: DVec2) -> DVec3 {
        self.plane.index(at) - self.cell.as_dvec3()
    }

    /// How the interpolant changes in the plane, per mm.
    fn slope(&self, at: DVec2) -> DVec2 {
        self.plane.along(gradient(&self.f, self.local(at)))
    }

    /// The tangent with the bone at its left.
    fn tangent(&self, at: DVec2) -> Option<DVec2> {
        let slope = self.slope(at);
        DVec2::new(slope.y, -slope.x).try_normalize()
    }

    /// The point of the surface that is near a point of the plane.
    pub fn settled(&self, mut at: DVec2) -> Option<DVec2> {
        for _ in 0..NEWTON {
            let slope = self.slope(at);
            let step = slope * (value(&self.f, self.local(at)) / slope.length_squared());
            at -= step;
            if step.length() < SETTLED_VOXEL * self.plane.voxel_mm() {
                return Some(at);
            }
        }
        None
    }

    /// Goes on from a point of the curve until that leaves the cell: the points within, and the first one beyond.
    fn walk(&self, from: DVec2) -> (Vec<Point>, Option<DVec2>) {
        let voxel_mm = self.plane.voxel_mm();
        let mut points = vec![];
        let (mut at, mut step) = (from, STEP_VOXEL * voxel_mm);
        let Some(mut tangent) = self.tangent(from) else { return (points, None) };
        for _ in 0..MOST_STEPS {
            let guess = at + step * tangent;
            let next = self.settled(guess).filter(|next| next.distance(guess) < 0.5 * step);
            let next = next.and_then(|next| Some((next, self.tangent(next)?))).filter(|(_, turned)| turned.dot(tangent) > HARDLY_TURNED);
            let Some((next, turned)) = next else {
                step *= 0.5;
                if step < LEAST_STEP_VOXEL * voxel_mm {
                    break;
                }
                continue;
            };
            let local = self.local(next);
            if (local - local.clamp(DVec3::ZERO, DVec3::ONE)).abs().max_element() > OUTSIDE_VOXEL {
                return (points, Some(next));
            }
            points.push((next, turned));
            (at, tangent, step) = (next, turned, (2.0 * step).min(STEP_VOXEL * voxel_mm));
        }
        (points, None)
    }

    /// By which of `exits` a curve leaves that enters the cell at a point.
    pub fn exit_of(&self, at: DVec2, exits: &[DVec2]) -> Option<usize> {
        if exits.len() < 2 {
            return (!exits.is_empty()).then_some(0);
        }
        let (points, beyond) = self.walk(at);
        let last = points.last().map_or(at, |(last, _)| *last);
        let beyond = beyond.unwrap_or(last);
        let away = |exit: &usize| from_segment(exits[*exit], [last, beyond]).0;
        (0..exits.len()).min_by(|a, b| away(a).total_cmp(&away(b)))
    }

    /// The points of the way through the cell from where it enters to where it leaves, both among them.
    pub fn way(&self, [from, to]: [DVec2; 2]) -> Vec<Point> {
        let straight = (to - from).normalize_or_zero();
        let end = |at: DVec2| (at, self.tangent(at).unwrap_or(straight));
        let (points, beyond) = self.walk(from);
        // Where it came to no end of the cell nothing is known of the way but its ends.
        let within = if beyond.is_some() { points } else { vec![] };
        std::iter::once(end(from)).chain(within).chain([end(to)]).collect()
    }
}

/// How far a point is from a stretch, and at which part of that its foot is.
pub(super) fn from_segment(point: DVec2, [a, b]: [DVec2; 2]) -> (f64, f64) {
    let along = b - a;
    let part = ((point - a).dot(along) / along.length_squared()).clamp(0.0, 1.0);
    let part = if part.is_nan() { 0.0 } else { part };
    (point.distance(a + part * along), part)
}

/// The length of a circle's arc between two points with these tangents.
pub(super) fn arc_mm([(a, t), (b, u)]: [Point; 2]) -> f64 {
    let half = 0.5 * t.perp_dot(u).atan2(t.dot(u)).abs();
    let chord = a.distance(b);
    if half < 1e-8 { chord } else { chord * half / half.sin() }
}
