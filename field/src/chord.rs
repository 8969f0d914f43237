//! How much of a piece of a line within one cell is inside: what volumes are added up from.
//!
//! Quick where [`crossings`](crate::crossings) certifies: plain float64, no brackets.

use crate::crossings::bernstein;
use glam::DVec3;

/// Halvings before what is left of a piece counts as a straight line: 2⁻²⁰ of a cell, below 1e-12 of its volume where two roots lie so near.
const MOST_HALVINGS: u32 = 20;
/// Steps to a root; Newton's need about five.
const MOST_STEPS: usize = 60;

/// The part, 0 to 1, of the way from `from` to `to` in a cell (both in [0, 1]³) along which its interpolant with the corner values `f` is not
/// below 0.
pub fn part_inside(f: &[f64; 8], from: DVec3, to: DVec3) -> f64 {
    part(bernstein(f, from, to), MOST_HALVINGS)
}

/// Of the cubic with the Bernstein coefficients `b`: no variation of sign, no root; one, one root (Descartes); else halves.
fn part(b: [f64; 4], halvings: u32) -> f64 {
    let variations = b.windows(2).filter(|w| (w[0] >= 0.0) != (w[1] >= 0.0)).count();
    match variations {
        0 => f64::from(b[0] >= 0.0),
        1 if b[0] >= 0.0 => root(b),
        1 => 1.0 - root(b),
        _ if halvings == 0 => f64::from(b[0] + b[3] >= 0.0),
        _ => {
            let mid = |x: f64, y: f64| 0.5 * (x + y);
            let (c0, c1, c2) = (mid(b[0], b[1]), mid(b[1], b[2]), mid(b[2], b[3]));
            let (d0, d1) = (mid(c0, c1), mid(c1, c2));
            let e = mid(d0, d1);
            0.5 * (part([b[0], c0, d0, e], halvings - 1) + part([e, d1, c2, b[3]], halvings - 1))
        }
    }
}

/// The only root in [0, 1], by Newton's steps that are kept within their bracket.
fn root(b: [f64; 4]) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    // A chord's root to begin with; where both ends are 0, any point does.
    let chord = b[0] / (b[0] - b[3]);
    let mut u: f64 = if chord.is_finite() { chord.clamp(0.0, 1.0) } else { 0.5 };
    for _ in 0..MOST_STEPS {
        let m = 1.0 - u;
        let value = m * m * (m * b[0] + 3.0 * u * b[1]) + u * u * (3.0 * m * b[2] + u * b[3]);
        let slope = 3.0 * (m * m * (b[1] - b[0]) + 2.0 * m * u * (b[2] - b[1]) + u * u * (b[3] - b[2]));
        if (value >= 0.0) == (b[0] >= 0.0) {
            low = u;
        } else {
            high = u;
        }
        let newton = u - value / slope;
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        // What is not moved by more than this any more is known to all digits that an interpolated value has.
        if (next - u).abs() <= 1e-14 {
            return next;
        }
        u = next;
    }
    u
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::crossings::segment_crossings;
    use bregma_synthetic::Random;

    #[test]
    fn the_part_inside_is_what_the_certified_crossings_leave() {
        // Fails if a root is the wrong one, a side is turned round, or halves are put together wrongly.
        let mut random = Random(11);
        let mut several = 0;
        for _ in 0..20_000 {
            let f: [f64; 8] = std::array::from_fn(|_| random.unit() - 0.5);
            let mut point = || DVec3::new(random.unit(), random.unit(), random.unit());
            let (from, to) = (point(), point());
            let crossings = segment_crossings(&f, from, to);
            several += usize::from(crossings.len() > 2);
            let mut truth = 0.0;
            let mut since = None;
            for (u, enters) in crossings {
                if enters {
                    since = Some(u);
                } else {
                    truth += u - since.take().unwrap_or(u);
                }
            }
            truth += since.map_or(0.0, |u| 1.0 - u);
            assert!((part_inside(&f, from, to) - truth).abs() < 1e-9, "{f:?} {from} {to}: {truth}");
        }
        assert!(several > 100, "only {several} lines crossed more than twice");
        assert_eq!(part_inside(&[0.0; 8], DVec3::ZERO, DVec3::ONE), 1.0);
        assert_eq!(part_inside(&[-1.0; 8], DVec3::ZERO, DVec3::ONE), 0.0);
    }
}
