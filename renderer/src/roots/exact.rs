//! The solver `exact`: where a ray first crosses the isosurface within one cell.
//!
//! The cubic's Bernstein coefficients reject most cells by their signs; else the segment is split where the derivative vanishes, and
//! the first part whose ends lie on different sides is searched by Newton's method guarded by bisection.
//!
//! The twin of `shaders/exact.wgsl`.

use super::bernstein::bernstein;
use super::{FirstEntry, inside};
use glam::Vec3;

pub(crate) struct Exact;

impl FirstEntry for Exact {
    fn first_entry(f: &[f32; 8], p: Vec3, q: Vec3) -> Option<f32> {
        first_entry(&bernstein(f, p, q))
    }
}

/// The cubic at u.
pub(super) fn value(b: &[f32; 4], u: f32) -> f32 {
    let m = 1.0 - u;
    (b[0] * m + 3.0 * b[1] * u) * m * m + (3.0 * b[2] * m + b[3] * u) * u * u
}

/// Its derivative at u.
fn slope(b: &[f32; 4], u: f32) -> f32 {
    let m = 1.0 - u;
    3.0 * ((b[1] - b[0]) * m * m + 2.0 * (b[2] - b[1]) * m * u + (b[3] - b[2]) * u * u)
}

/// Where the derivative vanishes, ascending; 1 stands for none. All divisors are guarded before they divide.
fn turning_points(b: &[f32; 4]) -> [f32; 2] {
    let differences = [b[1] - b[0], b[2] - b[1], b[3] - b[2]];
    // Scaled to 1: their squares would vanish for values of 1e-20, and overflow for 1e20.
    let largest = differences.iter().fold(0.0_f32, |m, d| m.max(d.abs()));
    if largest == 0.0 {
        return [1.0, 1.0];
    }
    let [q0, q1, q2] = differences.map(|d| d / largest);
    // a·u² − 2w·u + q0 with the stable pair of roots k/a and q0/k (Numerical Recipes, 5.6).
    let (a, w) = (q0 - 2.0 * q1 + q2, q0 - q1);
    let discriminant = q1 * q1 - q0 * q2;
    if discriminant < 0.0 {
        return [1.0, 1.0];
    }
    let root = discriminant.sqrt();
    let k = if w < 0.0 { w - root } else { w + root };
    // |k| bounds both divisors' use: a root in (0, 1) needs 0 < numerator/divisor < 1.
    let ratio = |n: f32, d: f32| if n.abs() < d.abs() && n * d.signum() > 0.0 { n / d } else { 1.0 };
    let (e, f) = (ratio(k, a), ratio(q0, k));
    [e.min(f), e.max(f)]
}

/// A few suffice, but beside a double root Newton's method only halves the distance each time: after ten steps it was 5e-4 voxel off
/// where values between two roots rise by 1e-6 of the largest; twenty leave 1e-5.
const MAX_STEPS: u32 = 20;
/// Of the segment, which is at most √3 voxels: an answer this near is beyond what float32 positions resolve.
const STEP_TOLERANCE: f32 = 1e-6;

/// The crossing in (low, high), where the cubic is monotonic and the ends lie on different sides.
fn refine(b: &[f32; 4], mut low: f32, mut high: f32) -> f32 {
    let (f_low, f_high) = (value(b, low), value(b, high));
    let from_inside = inside(f_low);
    // Regula falsi for the start; the ends differ in side, but after rounding they may still be equal.
    let span = f_high - f_low;
    let mut u = if span != 0.0 { (low - f_low * ((high - low) / span)).clamp(low, high) } else { low };
    for _ in 0..MAX_STEPS {
        let (f, d) = (value(b, u), slope(b, u));
        if inside(f) == from_inside {
            low = u;
        } else {
            high = u;
        }
        // f/d would leave the bracket exactly when |f| is at least |d| times the room that is left.
        let room = if (f < 0.0) == (d < 0.0) { u - low } else { high - u };
        let newton = f.abs() < d.abs() * room;
        let next = if newton { u - f / d } else { 0.5 * (low + high) };
        let step = (next - u).abs();
        u = next;
        if step <= STEP_TOLERANCE {
            break;
        }
    }
    u
}

/// The first u in [0, 1] where the cubic enters the inside; `None` when it stays outside.
fn first_entry(b: &[f32; 4]) -> Option<f32> {
    if inside(b[0]) {
        return Some(0.0);
    }
    if !b.iter().any(|&c| inside(c)) {
        return None;
    }
    let mut low = 0.0;
    for high in turning_points(b) {
        if high < 1.0 && inside(value(b, high)) {
            return Some(refine(b, low, high));
        }
        low = if high < 1.0 { high } else { low };
    }
    inside(b[3]).then(|| refine(b, low, 1.0))
}

#[cfg(test)]
mod tests {
    use super::super::tests::trilinear_f64;
    use super::*;
    use crate::stability::Random;

    #[test]
    fn first_entries_match_dense_sampling_in_float64() {
        // Fails if a turning point is missed, brackets are taken in the wrong order, or Newton escapes. Three kinds of cell:
        // rough, corner values in {−1, 0, 1}, and two almost equal roots.
        let mut random = Random(4);
        let (mut tested, mut worst) = (0, 0.0_f64);
        for n in 0..60_000 {
            let f: [f32; 8] = match n % 2 {
                0 => std::array::from_fn(|_| random.unit() - 0.6),
                _ => std::array::from_fn(|_| (random.unit() * 3.0).floor() - 1.0),
            };
            let (p, q) = (random.point(), random.point());
            let b = bernstein(&f, p, q);
            let exact = |u: f64| trilinear_f64(&f, p.as_dvec3().lerp(q.as_dvec3(), u));
            if b[0].abs() < 1e-5 || exact(1.0).abs() < 1e-5 {
                continue;
            }
            // The certain part: a bracket of 1/4096 with a clear sign change, or clearly none at all.
            let grid: Vec<f64> = (0..=4096).map(|i| exact(f64::from(i) / 4096.0)).collect();
            let first = if grid[0] >= 0.0 { Some(0) } else { grid.iter().position(|&v| v >= 0.0) };
            match (first_entry(&b), first) {
                (Some(u), Some(i)) => {
                    let mut bracket = ((i as f64 - 1.0).max(0.0) / 4096.0, i as f64 / 4096.0);
                    for _ in 0..40 {
                        let middle = (bracket.0 + bracket.1) / 2.0;
                        if exact(middle) >= 0.0 { bracket.1 = middle } else { bracket.0 = middle }
                    }
                    let root = if grid[0] >= 0.0 { 0.0 } else { bracket.1 };
                    // Near a turning point a root moves by √(rounding/curvature): only clearly crossed ones are judged.
                    let steep = ((exact(root + 1e-4) - exact(root - 1e-4)) / 2e-4).abs();
                    if steep > 0.05 {
                        worst = worst.max((f64::from(u) - root).abs());
                        tested += 1;
                    }
                }
                (None, None) => tested += 1,
                (found, first) => {
                    let top = grid.iter().copied().fold(f64::MIN, f64::max);
                    assert!(top.abs() < 1e-5, "{found:?} {first:?} with a highest value of {top}: {b:?}");
                }
            }
        }
        println!("{tested} cells, worst |Δu| {worst:e}");
        assert!(tested > 50_000 && worst < 2e-5, "{tested} {worst}");
    }

    #[test]
    fn the_first_of_three_roots_is_found() {
        // (u − 0.2)(u − 0.5)(u − 0.7), from below: enters at 0.2.
        let power = [-0.07, 0.59, -1.4, 1.0];
        let b = [power[0], power[0] + power[1] / 3.0, power[0] + 2.0 * power[1] / 3.0 + power[2] / 3.0, power.iter().sum()];
        assert!((first_entry(&b).unwrap() - 0.2).abs() < 1e-6);
    }
}
