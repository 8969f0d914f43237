//! The first entry of a cubic in Bernstein form, to what float32 resolves.
//!
//! Coefficients whose signs never change prove that there is no root, and those that change once that there is exactly one (Descartes'
//! rule in the Bernstein basis; Lane and Riesenfeld 1981). Else the segment is split where the derivative vanishes. The root is found by
//! Newton's method guarded by bisection.
//!
//! The twin of `shaders/cubic.wgsl`.

use super::{Entry, inside};
use crate::lanes::{Floats, Mask};
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// The cubic at u.
#[inline(always)]
pub(crate) fn value<S: Simd>(b: &[Floats<S>; 4], u: Floats<S>) -> Floats<S> {
    let m = 1.0 - u;
    (b[0] * m + 3.0 * b[1] * u) * m * m + (3.0 * b[2] * m + b[3] * u) * u * u
}

/// Its first derivative at u.
#[inline(always)]
fn slope<S: Simd>(b: &[Floats<S>; 4], u: Floats<S>) -> Floats<S> {
    let m = 1.0 - u;
    3.0 * ((b[1] - b[0]) * m * m + 2.0 * (b[2] - b[1]) * m * u + (b[3] - b[2]) * u * u)
}

/// Its second derivative at 0 and 1; between them it is linear.
#[inline(always)]
fn bends<S: Simd>(b: &[Floats<S>; 4]) -> [Floats<S>; 2] {
    [6.0 * (b[0] - 2.0 * b[1] + b[2]), 6.0 * (b[1] - 2.0 * b[2] + b[3])]
}

/// Where the derivative vanishes, ascending; 1 stands for none.
#[inline(always)]
pub(crate) fn turning_points<S: Simd>(simd: S, b: &[Floats<S>; 4]) -> [Floats<S>; 2] {
    let (d0, d1, d2) = (b[1] - b[0], b[2] - b[1], b[3] - b[2]);
    // Scaled to 1: their squares would vanish for values of 1e-20, and overflow for 1e20.
    let largest = d0.abs().max(d1.abs()).max(d2.abs());
    let (q0, q1, q2) = (d0 / largest, d1 / largest, d2 / largest);
    // a·u² − 2w·u + q0 with the stable pair of roots k/a and q0/k (Numerical Recipes, 5.6).
    let (a, w) = (q0 - 2.0 * q1 + q2, q0 - q1);
    let discriminant = q1 * q1 - q0 * q2;
    let root = discriminant.max(0.0).sqrt();
    let k = w.simd_lt(0.0).select(w - root, w + root);
    let (zero, one) = (Floats::splat(simd, 0.0), Floats::splat(simd, 1.0));
    let none = largest.simd_eq(zero) | discriminant.simd_lt(zero);
    // A root in (0, 1) needs 0 < numerator/divisor < 1; what is divided in other lanes is not looked at.
    let (e_inside, f_inside) = (is_fraction(k, a), is_fraction(q0, k));
    let (e, f) = ((e_inside & !none).select(k / a, one), (f_inside & !none).select(q0 / k, one));
    [e.min(f), e.max(f)]
}

/// Whether 0 < n/d < 1.
#[inline(always)]
fn is_fraction<S: Simd>(n: Floats<S>, d: Floats<S>) -> Mask<S> {
    n.abs().simd_lt(d.abs()) & (d.simd_lt(0.0).select(-n, n)).simd_gt(0.0)
}

/// Four suffice but beside a double root, where Newton's method only halves the distance each time: after ten steps it was 5e-4 voxel off
/// where values between two roots rise by 1e-6 of the largest. Of 30 million cubics with coefficients from 1e-12 to 1 none took more
/// than 26.
pub(crate) const MAX_STEPS: u32 = 40;
/// Of the segment, which is at most √3 voxels: an answer this near is beyond what float32 positions resolve.
pub(crate) const STEP_TOLERANCE: f32 = 1e-6;
/// What a step of Newton's method may leave to the root: a unit in the last place of u.
pub(crate) const REST_TOLERANCE: f32 = 1e-7;

/// The only entry in (low, high), from outside to inside; `f_low` and `f_high` are the values there. Only for the lanes of `sought`.
#[inline(always)]
pub(crate) fn refine<S: Simd>(
    b: &[Floats<S>; 4],
    mut low: Floats<S>,
    f_low: Floats<S>,
    mut high: Floats<S>,
    f_high: Floats<S>,
    mut sought: Mask<S>,
) -> Floats<S> {
    // Regula falsi for the start: f_low is below 0 and f_high is not.
    let mut u = (low - f_low * ((high - low) / (f_high - f_low))).max(low).min(high);
    let [bend_0, bend_1] = bends(b);
    for _ in 0..MAX_STEPS {
        let (f, d) = (value(b, u), slope(b, u));
        let is_inside = inside(f);
        high = is_inside.select(u, high);
        low = is_inside.select(low, u);
        // f/d would leave the bracket exactly when |f| is at least |d| times the room that is left.
        let room = (f.simd_lt(0.0) ^ d.simd_lt(0.0)).select(high - u, u - low);
        let newton = f.abs().simd_lt(d.abs() * room);
        let next = newton.select(u - f / d, 0.5 * (low + high));
        let step = (next - u).abs();
        // By Taylor's theorem |f(next)| is at most bend·step²/2, and where that is so small, the slope is still within a fifth of d.
        let bend = (bend_0 * (1.0 - u) + bend_1 * u).abs() + (bend_1 - bend_0).abs() * step;
        let is_there = newton & (bend * step * step).simd_le(2.0 * REST_TOLERANCE * d.abs());
        u = sought.select(next, u);
        sought &= !(is_there | step.simd_le(STEP_TOLERANCE));
        if !sought.any_true() {
            break;
        }
    }
    u
}

/// The first u in [0, 1] where the cubic with Bernstein coefficients `b` enters the inside, in the lanes of `asked`; none where it stays
/// outside.
#[inline(always)]
pub(super) fn cubic_entry<S: Simd>(simd: S, b: &[Floats<S>; 4], asked: Mask<S>) -> Entry<S> {
    let (zero, one) = (Floats::splat(simd, 0.0), Floats::splat(simd, 1.0));
    let at_start = inside(b[0]);
    let mut found = asked & (at_start | inside(b[1]) | inside(b[2]) | inside(b[3]));
    let mut sought = found & !at_start;
    if !sought.any_true() {
        return Entry { found, u: zero };
    }
    let (mut low, mut f_low, mut high, mut f_high) = (zero, b[0], one, b[3]);
    let changes_once = inside(b[3]) & (!inside(b[1]) | inside(b[2]));
    let changes_more = sought & !changes_once;
    if changes_more.any_true() {
        for turn in turning_points(simd, b) {
            let f = value(b, turn);
            let within = changes_more & turn.simd_lt(high);
            let (up, down) = (within & inside(f), within & !inside(f));
            (high, f_high) = (up.select(turn, high), up.select(f, f_high));
            (low, f_low) = (down.select(turn, low), down.select(f, f_low));
        }
        sought &= inside(f_high);
        found = (found & at_start) | sought;
    }
    let u = refine(b, low, f_low, high, f_high, sought);
    Entry { found, u: sought.select(u, zero) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fearless_simd::{Level, dispatch};

    #[test]
    fn the_first_of_three_roots_is_found() {
        // (u − 0.2)(u − 0.5)(u − 0.7), from below: enters at 0.2.
        let power: [f32; 4] = [-0.07, 0.59, -1.4, 1.0];
        let b = [power[0], power[0] + power[1] / 3.0, power[0] + 2.0 * power[1] / 3.0 + power[2] / 3.0, power.iter().sum()];
        let (found, u) = dispatch!(Level::new(), simd => {
            let entry = cubic_entry(simd, &b.map(|c| Floats::splat(simd, c)), Mask::splat(simd, true));
            (entry.found.all_true(), entry.u[7])
        });
        assert!(found && (u - 0.2_f32).abs() < 1e-6);
    }
}
