//! The point of a trilinear surface in one cell that is nearest to a given one, with a proof that no other is nearer.
//!
//! In a box of a cell it is the u that makes d²/2 = ½(u − t)ᵀG(u − t) least where f(u) = 0; G is the grid's metric and t the given point. The
//! Lagrangian L(u) = d²/2 + λf(u) has the Hessian G + λH(u). Where L grows from u on in the whole box, no other v of the surface there is nearer,
//! since d²(v)/2 = L(v) ≥ L(u) = d²(u)/2 (Nocedal and Wright 2006, "Numerical Optimization", 2nd ed., 12.9: weak duality). Where that cannot be
//! shown, the box is halved.

use glam::{DMat3, DVec3};

/// A function that is linear along each axis, f = a₀ + a₁x + a₂y + a₃z + a₄xy + a₅yz + a₆zx + a₇xyz.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trilinear([f64; 8]);

impl Trilinear {
    /// By its values at the corners of a cell, corner x + 2y + 4z at (x, y, z).
    pub fn of(f: &[f64; 8]) -> Self {
        let [x, y, z] = [f[1] - f[0], f[2] - f[0], f[4] - f[0]];
        let [xy, yz, zx] = [f[3] - f[1] - f[2] + f[0], f[6] - f[2] - f[4] + f[0], f[5] - f[1] - f[4] + f[0]];
        Self([f[0], x, y, z, xy, yz, zx, f[7] - f[0] - x - y - z - xy - yz - zx])
    }

    pub fn value(&self, u: DVec3) -> f64 {
        let a = &self.0;
        a[0] + u.x * (a[1] + a[4] * u.y) + u.y * (a[2] + a[5] * u.z) + u.z * (a[3] + a[6] * u.x) + a[7] * u.x * u.y * u.z
    }

    pub fn gradient(&self, u: DVec3) -> DVec3 {
        let a = &self.0;
        DVec3::new(
            a[1] + a[4] * u.y + a[6] * u.z + a[7] * u.y * u.z,
            a[2] + a[4] * u.x + a[5] * u.z + a[7] * u.z * u.x,
            a[3] + a[5] * u.y + a[6] * u.x + a[7] * u.x * u.y,
        )
    }

    /// How it changes along `step`, which is linear along each axis, too.
    pub fn along(&self, step: DVec3) -> Self {
        let [_, x, y, z, xy, yz, zx, xyz] = self.0;
        Self([
            step.dot(DVec3::new(x, y, z)),
            step.y * xy + step.z * zx,
            step.x * xy + step.z * yz,
            step.x * zx + step.y * yz,
            step.z * xyz,
            step.x * xyz,
            step.y * xyz,
            0.0,
        ])
    }

    /// Its values at the corners of a part of the cell.
    fn corners(&self, part: Part) -> [f64; 8] {
        let a = &self.0;
        let mut values = [0.0; 8];
        for n in 0..4 {
            let (y, z) = (if n & 1 == 1 { part.high.y } else { part.low.y }, if n & 2 == 2 { part.high.z } else { part.low.z });
            let at = a[0] + a[2] * y + a[3] * z + a[5] * y * z;
            let per_x = a[1] + a[4] * y + a[6] * z + a[7] * y * z;
            (values[2 * n], values[2 * n + 1]) = (at + per_x * part.low.x, at + per_x * part.high.x);
        }
        values
    }

    /// Its least and its greatest value in a part of the cell: those at its corners.
    pub fn ends(&self, part: Part) -> [f64; 2] {
        let values = self.corners(part);
        let (mut low, mut high) = (values[0], values[0]);
        for v in values {
            (low, high) = (low.min(v), high.max(v));
        }
        [low, high]
    }

    /// Whether no point of {f = 0} in a part of the cell is nearer to `target` than the root of `square`, by a bound that costs little; `steps` are
    /// the squares of the grid's steps, whose axes are at right angles.
    ///
    /// Weak duality again, with one multiplier for the whole part. About its middle m f differs from its tangent plane by no more than r in the
    /// part, so that for each λ and each v of the surface there
    /// ```text
    ///   d²(v)/2 ≥ Σₐ min over the part's vₐ of ½Gₐ(vₐ − tₐ)² + λgₐ(vₐ − mₐ),  + λf(m) − |λ|r         g = ∇f(m)
    /// ```
    /// in which each axis stands alone. The best λ is gone to by Newton's method from that of the plane without ends.
    pub fn is_farther(&self, part: Part, target: DVec3, steps: DVec3, square: f64) -> bool {
        let (m, half) = (0.5 * (part.low + part.high), 0.5 * (part.high - part.low));
        let (gradient, mixed, at) = (self.gradient(m), self.mixed(m).abs(), self.value(m));
        let apart = mixed.x * half.x * half.y + mixed.y * half.y * half.z + mixed.z * half.z * half.x;
        let apart = apart + self.0[7].abs() * half.x * half.y * half.z;
        let per_step = gradient / steps;
        let mut multiplier = (at - gradient.dot(m - target)) / gradient.dot(per_step);
        for _ in 0..BOUNDS {
            let free = target - multiplier * per_step;
            let v = free.clamp(part.low, part.high);
            let off_plane = at + gradient.dot(v - m);
            let away = v - target;
            if away.dot(steps * away) + 2.0 * (multiplier * off_plane - multiplier.abs() * apart) >= square {
                return true;
            }
            let steepness = DVec3::select(free.cmpeq(v), gradient * per_step, DVec3::ZERO).element_sum();
            if steepness <= 0.0 {
                return false;
            }
            multiplier += off_plane / steepness;
        }
        false
    }

    /// Its second derivatives by x and y, y and z, z and x; those by one axis alone are 0.
    fn mixed(&self, u: DVec3) -> DVec3 {
        let a = &self.0;
        DVec3::new(a[4] + a[7] * u.z, a[5] + a[7] * u.x, a[6] + a[7] * u.y)
    }
}

/// A box within a cell, from 0 to 1 along each axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    pub low: DVec3,
    pub high: DVec3,
}

impl Part {
    /// All of a cell.
    pub const CELL: Self = Self { low: DVec3::ZERO, high: DVec3::ONE };

    /// What of it lies within `reach` (along each axis) of `middle`; `None` where nothing does.
    pub fn within(self, middle: DVec3, reach: DVec3) -> Option<Self> {
        let part = Self { low: self.low.max(middle - reach), high: self.high.min(middle + reach) };
        part.low.cmple(part.high).all().then_some(part)
    }

    /// The faces of a cell, each with its axis: parts without depth.
    pub fn faces() -> [(usize, Self); 6] {
        std::array::from_fn(|n| {
            let (axis, at) = (n / 2, (n % 2) as f64);
            let mut face = Self::CELL;
            (face.low[axis], face.high[axis]) = (at, at);
            (axis, face)
        })
    }

    /// Its two halves across the axis of which it holds most, by the metric; the one nearer to `target` first.
    pub fn halves(self, metric: &DMat3, target: DVec3) -> [Self; 2] {
        let size = (self.high - self.low) * DVec3::new(metric.x_axis.x, metric.y_axis.y, metric.z_axis.z).map(f64::sqrt);
        let axis = size.max_position();
        let middle = 0.5 * (self.low[axis] + self.high[axis]);
        let (mut below, mut above) = (self, self);
        (below.high[axis], above.low[axis]) = (middle, middle);
        if target[axis] < middle { [below, above] } else { [above, below] }
    }
}

/// Along which axes (G(u − t)) × ∇f is 0 nowhere in a part of a cell, by interval arithmetic. Where a perpendicular meets the surface all three are 0;
/// on a face of the cell, where it meets the surface's curve there, the one along the face's normal.
pub(super) fn is_turned(f: &Trilinear, part: Part, target: DVec3, metric: &DMat3) -> [bool; 3] {
    let away = [0, 1, 2].map(|a| {
        let (middle, half) = (0.5 * (part.low + part.high), 0.5 * (part.high - part.low));
        let (at, around) = (metric.col(a).dot(middle - target), metric.col(a).abs().dot(half));
        [at - around, at + around]
    });
    let slope = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| f.along(axis).ends(part));
    [0, 1, 2].map(|a| {
        let (b, c) = ((a + 1) % 3, (a + 2) % 3);
        let ([low, high], [less, more]) = (product(away[b], slope[c]), product(away[c], slope[b]));
        low > more || high < less
    })
}

/// The ends of all products of numbers between two pairs of ends.
fn product([a, b]: [f64; 2], [c, d]: [f64; 2]) -> [f64; 2] {
    let all = [a * c, a * d, b * c, b * d];
    [all.into_iter().fold(f64::INFINITY, f64::min), all.into_iter().fold(f64::NEG_INFINITY, f64::max)]
}

/// A point of the surface in a part of a cell at which nothing beside it in the part is nearer to the target.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stationary {
    pub point: DVec3,
    /// The multiplier λ.
    multiplier: f64,
    /// By what L would change per step along each axis; 0 along those that no end of the part holds.
    pub pull: DVec3,
}

/// Steps until none is longer than [`SETTLED`]: five are the rule, as Newton's method doubles the digits.
const MOST_STEPS: usize = 40;
/// In voxels. The next step's length is about its square, below what float64 tells apart.
const SETTLED: f64 = 1e-8;
/// Multipliers that are tried for a bound: each end that comes to hold takes one.
const BOUNDS: usize = 3;
/// A pull that is this part of all of it is rounding.
const AS_NEAR: f64 = 1e-9;
/// A step of this many voxels that leads no nearer is rounding: it would change the distance by its square.
const NO_NEARER: f64 = 1e-6;
/// Halvings of a step that leads no nearer, until what is left of it is nothing.
const MOST_HALVINGS: usize = 30;

/// A point of {f = 0} in `part` that none beside it is nearer to `target` than, by Newton's method along the surface: from where it crosses an edge
/// of the part, always on it and always nearer, with the part's ends as bounds (Nocedal and Wright, 16.5 and 18.1). Of the edges the one that is
/// crossed nearest. `None` where the surface crosses no edge, or that does not settle.
pub(super) fn stationary(f: &Trilinear, part: Part, target: DVec3, metric: &DMat3) -> Option<Stationary> {
    let nearest = OnSurface::at_edges(f, part, target, metric).min_by(|a, b| a.square.total_cmp(&b.square))?;
    downhill(nearest, f, part, target, metric)
}

/// The same from a point of the surface in `part`, the nearest where it crosses the edges of `around`.
pub(super) fn stationary_from(f: &Trilinear, around: Part, part: Part, target: DVec3, metric: &DMat3) -> Option<Stationary> {
    let nearest = OnSurface::at_edges(f, around, target, metric).min_by(|a, b| a.square.total_cmp(&b.square))?;
    // Only ends of the larger part hold it.
    let side = |a: usize| i8::from(nearest.u[a] >= part.high[a]) - i8::from(nearest.u[a] <= part.low[a]);
    downhill(OnSurface { held: [0, 1, 2].map(side), ..nearest }, f, part, target, metric)
}

/// Where the surface crosses a cell's edges, and no way into the cell from there leads nearer.
pub(super) fn at_edges<'a>(f: &'a Trilinear, target: DVec3, metric: &'a DMat3) -> impl Iterator<Item = DVec3> + 'a {
    let edges = OnSurface::at_edges(f, Part::CELL, target, metric);
    edges.filter(move |at| !leads_nearer(f, at.u, at.held, target, metric)).map(|start| start.u)
}

/// Whether a way along the surface leads from a point of it at the cell's ends that hold it (−1 the low, 1 the high, 0 none) into the cell and
/// nearer, as far as slopes tell.
pub(super) fn leads_nearer(f: &Trilinear, u: DVec3, held: [i8; 3], target: DVec3, metric: &DMat3) -> bool {
    let (gradient, pull) = (f.gradient(u), *metric * (u - target));
    let at = OnSurface { u, square: 0.0, held };
    at.multiplier(gradient, pull).is_some_and(|multiplier| at.inward(pull + multiplier * gradient).max_element() > AS_NEAR * pull.length())
}

fn downhill(start: OnSurface, f: &Trilinear, part: Part, target: DVec3, metric: &DMat3) -> Option<Stationary> {
    let mut at = start;
    for _ in 0..MOST_STEPS {
        let (gradient, pull) = (f.gradient(at.u), *metric * (at.u - target));
        let multiplier = at.multiplier(gradient, pull)?;
        let mixed = multiplier * f.mixed(at.u);
        let hessian = *metric
            + DMat3::from_cols(DVec3::new(0.0, mixed.x, mixed.z), DVec3::new(mixed.x, 0.0, mixed.y), DVec3::new(mixed.z, mixed.y, 0.0));
        // Where the surface curves so that Newton's step would lead away, the one without that curvature leads nearer.
        let step = at.step(&hessian, gradient, pull).filter(|step| step.dot(pull) < 0.0).or_else(|| at.step(metric, gradient, pull));
        let step = step.unwrap_or(DVec3::ZERO);
        let size = step.abs().max_element();
        if size < SETTLED || !at.go(f, part, target, metric, step) {
            if size > NO_NEARER {
                return None;
            }
            let pull = pull + multiplier * gradient;
            if !at.let_go(pull) {
                let pull = DVec3::from([0, 1, 2].map(|a| if at.held[a] == 0 { 0.0 } else { pull[a] }));
                return Some(Stationary { point: at.u, multiplier, pull });
            }
        }
    }
    None
}

/// A point on the surface, and which ends of a part hold it: −1 the low, 1 the high, 0 none.
struct OnSurface {
    u: DVec3,
    square: f64,
    held: [i8; 3],
}

impl OnSurface {
    /// Where the surface crosses the part's edges.
    fn at_edges<'a>(f: &Trilinear, part: Part, target: DVec3, metric: &'a DMat3) -> impl Iterator<Item = Self> + 'a {
        let corner = move |c: usize| DVec3::select(glam::BVec3::new(c & 1 == 1, c & 2 == 2, c & 4 == 4), part.high, part.low);
        let values = f.corners(part);
        let edges = (0..8_usize).flat_map(|c| (0..3).filter(move |axis| c >> axis & 1 == 0).map(move |axis| (c, axis)));
        edges.filter_map(move |(c, axis)| {
            let other = c | 1 << axis;
            if (values[c] >= 0.0) == (values[other] >= 0.0) {
                return None;
            }
            let u = corner(c).lerp(corner(other), values[c] / (values[c] - values[other]));
            let square = (u - target).dot(*metric * (u - target));
            Some(Self { u, square, held: [0, 1, 2].map(|a| if a == axis { 0 } else { ((c >> a & 1) * 2) as i8 - 1 }) })
        })
    }

    /// The multiplier that leaves the least pull along the axes that nothing holds.
    fn multiplier(&self, gradient: DVec3, pull: DVec3) -> Option<f64> {
        let free = DVec3::from(self.held.map(|side| if side == 0 { 1.0 } else { 0.0 }));
        let multiplier = -(free * gradient).dot(pull) / (free * gradient).length_squared();
        multiplier.is_finite().then_some(multiplier)
    }

    /// The step along the tangent, of what is not held, to the least of the quadratic; `None` where there is no way to go.
    fn step(&self, hessian: &DMat3, gradient: DVec3, pull: DVec3) -> Option<DVec3> {
        let free: Vec3Of<usize> = Vec3Of::of((0..3).filter(|a| self.held[*a] == 0));
        // Directions along the tangent: of the free axes, the one with the steepest gradient follows the others.
        let last = *free.as_slice().iter().max_by(|a, b| gradient[**a].abs().total_cmp(&gradient[**b].abs()))?;
        let tangents: Vec3Of<DVec3> = Vec3Of::of(free.as_slice().iter().filter(|a| **a != last).map(|a| {
            let mut along = DVec3::ZERO;
            (along[*a], along[last]) = (1.0, -gradient[*a] / gradient[last]);
            along
        }));
        match *tangents.as_slice() {
            [t] => {
                let bend = t.dot(*hessian * t);
                (bend > 0.0).then(|| -t.dot(pull) / bend * t)
            }
            [s, t] => {
                let (hs, ht) = (*hessian * s, *hessian * t);
                let (a, b, c) = (s.dot(hs), s.dot(ht), t.dot(ht));
                let (p, q) = (-s.dot(pull), -t.dot(pull));
                let bend = a * c - b * b;
                (a > 0.0 && bend > 0.0).then(|| ((p * c - q * b) * s + (q * a - p * b) * t) / bend)
            }
            _ => None,
        }
    }

    /// Goes along `step` and back to the surface along an axis, along which f is linear, as far as that is in the part and nearer; whether it
    /// went at all.
    fn go(&mut self, f: &Trilinear, part: Part, target: DVec3, metric: &DMat3, step: DVec3) -> bool {
        // An end that the step would leave at once holds it.
        let is_out =
            |a: usize| self.held[a] == 0 && (step[a] > 0.0 && self.u[a] >= part.high[a] || step[a] < 0.0 && self.u[a] <= part.low[a]);
        if let Some(axis) = (0..3).find(|a| is_out(*a)) {
            self.held[axis] = if step[axis] > 0.0 { 1 } else { -1 };
            return true;
        }
        let mut length = 1.0;
        for _ in 0..MOST_HALVINGS {
            if let Some((u, held)) = self.along(f, part, length * step) {
                let square = (u - target).dot(*metric * (u - target));
                if square < self.square {
                    *self = Self { u, square, held };
                    return true;
                }
            }
            length *= 0.5;
        }
        false
    }

    /// Where a step leads, and what holds it there.
    fn along(&self, f: &Trilinear, part: Part, step: DVec3) -> Option<(DVec3, [i8; 3])> {
        // Up to the first end that it meets.
        let room = |a: usize| if step[a] > 0.0 { (part.high[a] - self.u[a]) / step[a] } else { (part.low[a] - self.u[a]) / step[a] };
        let first = (0..3).filter(|a| self.held[*a] == 0 && step[*a] != 0.0).min_by(|a, b| room(*a).total_cmp(&room(*b)))?;
        let (mut u, mut held) = (self.u + room(first).min(1.0) * step, self.held);
        if room(first) <= 1.0 {
            held[first] = if step[first] > 0.0 { 1 } else { -1 };
            u[first] = if step[first] > 0.0 { part.high[first] } else { part.low[first] };
        }
        // Back to the surface; where that leads out of the part, along another axis from the end that it meets.
        for _ in 0..3 {
            let gradient = f.gradient(u);
            let axis = (0..3).filter(|a| held[*a] == 0).max_by(|a, b| gradient[*a].abs().total_cmp(&gradient[*b].abs()))?;
            u[axis] -= f.value(u) / gradient[axis];
            if u[axis].is_nan() {
                return None;
            }
            if (part.low[axis]..=part.high[axis]).contains(&u[axis]) {
                return Some((u, held));
            }
            held[axis] = if u[axis] > part.high[axis] { 1 } else { -1 };
            u[axis] = u[axis].clamp(part.low[axis], part.high[axis]);
        }
        None
    }

    /// The pull away from each end that holds it, into the part.
    fn inward(&self, pull: DVec3) -> DVec3 {
        DVec3::from([0, 1, 2].map(|a| f64::from(self.held[a]) * pull[a]))
    }

    /// Lets go of the end that holds it against the strongest pull inward; whether there is one.
    fn let_go(&mut self, pull: DVec3) -> bool {
        let inward = self.inward(pull);
        let is_held_in_vain = inward.max_element() > 0.0;
        if is_held_in_vain {
            self.held[inward.max_position()] = 0;
        }
        is_held_in_vain
    }
}

/// Up to three of something.
struct Vec3Of<T>([T; 3], usize);

impl<T: Copy + Default> Vec3Of<T> {
    fn of(all: impl Iterator<Item = T>) -> Self {
        let mut list = Self([T::default(); 3], 0);
        for one in all {
            list.0[list.1] = one;
            list.1 += 1;
        }
        list
    }

    fn as_slice(&self) -> &[T] {
        &self.0[..self.1]
    }
}

impl Stationary {
    /// A point that is taken for one, as where the surface crosses an edge.
    pub fn at(point: DVec3) -> Self {
        Self { point, multiplier: 0.0, pull: DVec3::ZERO }
    }

    /// Whether no point of the surface in `part` is nearer.
    ///
    /// For a point u + Δ of the surface in the part, Taylor's series of the Lagrangian is d²/2 there:
    /// ```text
    ///   L(u + Δ) = L(u) + pull·Δ + ½ΔᵀKΔ            K = G + λH, somewhere in the part
    ///   pull·Δ   ≥ ½ΔᵀPΔ                            P diagonal, 2·|pullₐ| over the part's size behind the end that holds it
    ///   0        ≥ ½ρ(∇f·Δ)² − ½ρ(h|Δ|²/2)²         since f(u + Δ) = 0: |∇f·Δ| ≤ h|Δ|²/2, h ≥ |H| in the part
    /// ```
    /// so that it is where K + P + ρ(∇f∇fᵀ − (hw/2)²) is positive definite, w being as far as the part reaches. K is linear in three numbers that
    /// each depend on one axis alone: it is enough to look at the eight corners.
    pub fn is_nearest_in(&self, f: &Trilinear, part: Part, metric: &DMat3) -> bool {
        let ends = [part.low, part.high].map(|u| f.mixed(u));
        let size = (self.point - part.low).max(part.high - self.point);
        let held = DVec3::from([0, 1, 2].map(|a| if self.pull[a] == 0.0 { 0.0 } else { 2.0 * self.pull[a].abs() / size[a] }));
        let gradient = f.gradient(self.point);
        let bound = 2.0 * ends[0].abs().max(ends[1].abs()).length_squared();
        // Without the third line first, which costs where it is not needed; then with as much of it as makes up for what λH takes away.
        let most = 2.0 * (metric.x_axis.x + metric.y_axis.y + metric.z_axis.z + self.multiplier.abs() * bound.sqrt());
        [0.0, most / gradient.length_squared()].into_iter().any(|weight| {
            let taken = weight * bound * size.length_squared() / 4.0;
            let base = *metric
                + DMat3::from_diagonal(held - taken)
                + weight * DMat3::from_cols(gradient.x * gradient, gradient.y * gradient, gradient.z * gradient);
            (0..8).all(|c| {
                let mixed = self.multiplier * DVec3::from([0, 1, 2].map(|a| ends[c >> a & 1][a]));
                is_positive(&base, mixed)
            })
        })
    }
}

/// Whether a symmetric matrix, with `mixed` added beside its diagonal at x and y, y and z, z and x, is positive definite: its leading minors are
/// positive (Sylvester).
fn is_positive(base: &DMat3, mixed: DVec3) -> bool {
    let (xx, yy, zz) = (base.x_axis.x, base.y_axis.y, base.z_axis.z);
    let (xy, yz, zx) = (base.x_axis.y + mixed.x, base.y_axis.z + mixed.y, base.z_axis.x + mixed.z);
    let minor = xx * yy - xy * xy;
    xx > 0.0 && minor > 0.0 && zz * minor - yz * (xx * yz - xy * zx) + zx * (xy * yz - yy * zx) > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_field::interpolant;
    use bregma_synthetic::Random;

    #[test]
    fn a_function_has_its_corners_values_and_gradient() {
        // Fails if a coefficient is another's.
        let mut random = Random(3);
        for _ in 0..1000 {
            let f: [f64; 8] = std::array::from_fn(|_| random.unit() - 0.5);
            let u = DVec3::from_array(std::array::from_fn(|_| random.unit()));
            let trilinear = Trilinear::of(&f);
            assert!((trilinear.value(u) - interpolant::value(&f, u)).abs() < 1e-14);
            assert!(trilinear.gradient(u).distance(interpolant::gradient(&f, u)) < 1e-14);
            let step = DVec3::from_array(std::array::from_fn(|_| random.unit()));
            assert!((trilinear.along(step).value(u) - trilinear.gradient(u).dot(step)).abs() < 1e-14);
            let ends = trilinear.ends(Part { low: u, high: DVec3::ONE });
            assert!((0..20).all(|_| {
                let v = u.lerp(DVec3::ONE, random.unit());
                (ends[0] - 1e-14..=ends[1] + 1e-14).contains(&trilinear.value(v))
            }));
        }
    }

    /// A metric of a grid that is anisotropic and sheared.
    fn metric(random: &mut Random) -> DMat3 {
        let steps = DMat3::from_cols(
            DVec3::new(0.5 + random.unit(), 0.0, 0.0),
            DVec3::new(0.4 * (random.unit() - 0.5), 0.5 + random.unit(), 0.0),
            DVec3::new(0.4 * (random.unit() - 0.5), 0.4 * (random.unit() - 0.5), 0.5 + 2.0 * random.unit()),
        );
        steps.transpose() * steps
    }

    #[test]
    fn no_point_of_the_patch_is_nearer_than_what_is_proved_nearest() {
        // Fails if the step, the ends that hold it, or the proof is wrong: points of the surface along lines through the cell are tried.
        let mut random = Random(11);
        let (mut proved, mut tried) = (0, 0);
        for _ in 0..20_000 {
            let corners: [f64; 8] = std::array::from_fn(|_| random.unit() - 0.5);
            let f = Trilinear::of(&corners);
            let metric = metric(&mut random);
            let target = DVec3::from_array(std::array::from_fn(|_| 3.0 * random.unit() - 1.0));
            let Some(found) = stationary(&f, Part::CELL, target, &metric) else { continue };
            let square = |u: DVec3| (u - target).dot(metric * (u - target));
            assert!(f.value(found.point).abs() < 1e-12, "{corners:?} {target}");
            tried += 1;
            if !found.is_nearest_in(&f, Part::CELL, &metric) {
                continue;
            }
            proved += 1;
            for _ in 0..60 {
                let (a, b) =
                    (DVec3::from_array(std::array::from_fn(|_| random.unit())), DVec3::from_array(std::array::from_fn(|_| random.unit())));
                if (f.value(a) < 0.0) == (f.value(b) < 0.0) {
                    continue;
                }
                let (mut inside, mut outside) = if f.value(a) < 0.0 { (b, a) } else { (a, b) };
                for _ in 0..60 {
                    let middle = 0.5 * (inside + outside);
                    if f.value(middle) < 0.0 { outside = middle } else { inside = middle }
                }
                assert!(square(inside) >= square(found.point) - 1e-12, "{corners:?} {target}: {inside} is nearer than {found:?}");
            }
        }
        println!("{proved} of {tried} proved");
        assert!(proved > 5_000);
    }

    #[test]
    fn what_is_called_farther_is_farther() {
        // Fails if the bound is none: points of the surface in a part are tried against what it says of all of them.
        let mut random = Random(23);
        let (mut said, mut true_of) = (0, 0);
        for _ in 0..20_000 {
            let corners: [f64; 8] = std::array::from_fn(|_| random.unit() - 0.5);
            let f = Trilinear::of(&corners);
            let steps = DVec3::from_array(std::array::from_fn(|_| (0.5 + random.unit()).powi(2)));
            let [a, b]: [DVec3; 2] = std::array::from_fn(|_| DVec3::from_array(std::array::from_fn(|_| random.unit())));
            let part = Part { low: a.min(b), high: a.max(b) };
            let target = DVec3::from_array(std::array::from_fn(|_| 5.0 * random.unit() - 2.0));
            // Along lines of the part, the nearest of many points of the surface.
            let mut least = f64::INFINITY;
            for n in 0..3 * 64 {
                let place = |axis: usize| part.low[axis] + (part.high[axis] - part.low[axis]) * random.unit();
                let mut p = DVec3::from([0, 1, 2].map(place));
                let axis = n % 3;
                p[axis] = 0.0;
                let (at, slope) = (f.value(p), f.gradient(p)[axis]);
                p[axis] = -at / slope;
                if (part.low[axis]..=part.high[axis]).contains(&p[axis]) {
                    least = least.min((p - target).dot(steps * (p - target)));
                }
            }
            if least.is_infinite() {
                continue;
            }
            let square = least * (0.5 + random.unit());
            let farther = f.is_farther(part, target, steps, square);
            assert!(!farther || least >= square * (1.0 - 1e-12), "{corners:?} {part:?} {target}: {least} is nearer than {square}");
            said += usize::from(farther);
            true_of += usize::from(least >= square);
        }
        println!("said of {said} of {true_of} parts");
        // What is never said would be right, too.
        assert!(said as f64 > 0.5 * true_of as f64);
    }
}
