//! The first entry of a cubic in Bernstein form, to what float32 resolves.
//!
//! Coefficients whose signs never change prove that there is no root, and those that change once that there is exactly one (Descartes'
//! rule in the Bernstein basis; Lane and Riesenfeld 1981). Else the segment is split where the derivative vanishes. The root is found by
//! Newton's method guarded by bisection.
//!
//! The twin of `shaders/cubic.wgsl`.

use super::inside;

/// The cubic at u.
pub(super) fn value(b: &[f32; 4], u: f32) -> f32 {
    let m = 1.0 - u;
    (b[0] * m + 3.0 * b[1] * u) * m * m + (3.0 * b[2] * m + b[3] * u) * u * u
}

/// Its first derivative at u.
fn slope(b: &[f32; 4], u: f32) -> f32 {
    let m = 1.0 - u;
    3.0 * ((b[1] - b[0]) * m * m + 2.0 * (b[2] - b[1]) * m * u + (b[3] - b[2]) * u * u)
}

/// Its second derivative at 0 and 1; between them it is linear.
fn bends(b: &[f32; 4]) -> [f32; 2] {
    [6.0 * (b[0] - 2.0 * b[1] + b[2]), 6.0 * (b[1] - 2.0 * b[2] + b[3])]
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

/// Four suffice but beside a double root, where Newton's method only halves the distance each time: after ten steps it was 5e-4 voxel off
/// where values between two roots rise by 1e-6 of the largest. Of 30 million cubics with coefficients from 1e-12 to 1 none took more
/// than 26.
const MAX_STEPS: u32 = 40;
/// Of the segment, which is at most √3 voxels: an answer this near is beyond what float32 positions resolve.
const STEP_TOLERANCE: f32 = 1e-6;
/// What a step of Newton's method may leave to the root: a unit in the last place of u.
const REST_TOLERANCE: f32 = 1e-7;

/// The only entry in (low, high), from outside to inside; `f_low` and `f_high` are the values there.
fn refine(b: &[f32; 4], mut low: f32, f_low: f32, mut high: f32, f_high: f32) -> f32 {
    // Regula falsi for the start: f_low is below 0 and f_high is not.
    let mut u = (low - f_low * ((high - low) / (f_high - f_low))).clamp(low, high);
    let [bend_0, bend_1] = bends(b);
    for _ in 0..MAX_STEPS {
        let (f, d) = (value(b, u), slope(b, u));
        if inside(f) {
            high = u;
        } else {
            low = u;
        }
        // f/d would leave the bracket exactly when |f| is at least |d| times the room that is left.
        let room = if (f < 0.0) == (d < 0.0) { u - low } else { high - u };
        let newton = f.abs() < d.abs() * room;
        let next = if newton { u - f / d } else { 0.5 * (low + high) };
        let step = (next - u).abs();
        // By Taylor's theorem |f(next)| is at most bend·step²/2, and where that is so small, the slope is still within a fifth of d.
        let bend = (bend_0 * (1.0 - u) + bend_1 * u).abs() + (bend_1 - bend_0).abs() * step;
        let is_there = newton && bend * step * step <= 2.0 * REST_TOLERANCE * d.abs();
        u = next;
        if is_there || step <= STEP_TOLERANCE {
            break;
        }
    }
    u
}

/// The first u in [0, 1] where the cubic with Bernstein coefficients `b` enters the inside; `None` when it stays outside.
pub(super) fn cubic_entry(b: &[f32; 4]) -> Option<f32> {
    if inside(b[0]) {
        return Some(0.0);
    }
    if !b.iter().any(|&c| inside(c)) {
        return None;
    }
    let (mut low, mut f_low, mut high, mut f_high) = (0.0, b[0], 1.0, b[3]);
    let changes_once = inside(b[3]) && (!inside(b[1]) || inside(b[2]));
    if !changes_once {
        for turn in turning_points(b) {
            if turn < high {
                let f = value(b, turn);
                (low, f_low, high, f_high) = if inside(f) { (low, f_low, turn, f) } else { (turn, f, high, f_high) };
            }
        }
        if !inside(f_high) {
            return None;
        }
    }
    Some(refine(b, low, f_low, high, f_high))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_of_three_roots_is_found() {
        // (u − 0.2)(u − 0.5)(u − 0.7), from below: enters at 0.2.
        let power = [-0.07, 0.59, -1.4, 1.0];
        let b = [power[0], power[0] + power[1] / 3.0, power[0] + 2.0 * power[1] / 3.0 + power[2] / 3.0, power.iter().sum()];
        assert!((cubic_entry(&b).unwrap() - 0.2).abs() < 1e-6);
    }
}
