//! The solver `marmitt`, as published: the cubic's extrema split the segment into monotonic parts, and linear interpolation is
//! repeated in the first part that changes sides (Marmitt, Kleer, Wald, Friedrich and Slusallek 2004).
//!
//! The twin of `shaders/marmitt.wgsl`.

use super::{FirstEntry, inside};
use glam::Vec3;

pub(crate) struct Marmitt<const STEPS: u32>;

impl<const STEPS: u32> FirstEntry for Marmitt<STEPS> {
    fn first_entry(f: &[f32; 8], p: Vec3, q: Vec3) -> Option<f32> {
        let k = power_basis(f, p, q);
        let (mut u0, mut u1) = (0.0, 1.0);
        let (mut f0, mut f1) = (k[3], horner(&k, 1.0));
        if inside(f0) {
            return Some(0.0);
        }
        for extremum in extrema(&k) {
            if extremum >= u0 && extremum <= u1 {
                let value = horner(&k, extremum);
                if inside(value) {
                    (u1, f1) = (extremum, value);
                } else {
                    (u0, f0) = (extremum, value);
                }
            }
        }
        if !inside(f1) {
            return None;
        }
        for _ in 0..STEPS {
            let u = u0 + (u1 - u0) * (f0 / (f0 - f1));
            let value = horner(&k, u);
            if inside(value) {
                (u1, f1) = (u, value);
            } else {
                (u0, f0) = (u, value);
            }
        }
        Some(u0 + (u1 - u0) * (f0 / (f0 - f1)))
    }
}

/// Coefficients A, B, C, D of A·u³ + B·u² + C·u + D: the interpolant with each coordinate written as a + u·b, multiplied out.
fn power_basis(f: &[f32; 8], p: Vec3, q: Vec3) -> [f32; 4] {
    let (upper_a, upper_b) = (p, q - p);
    let (lower_a, lower_b) = (1.0 - p, p - q);
    let mut k = [0.0; 4];
    for (c, value) in f.iter().enumerate() {
        let pick = |axis: usize| {
            let upper = c >> axis & 1 == 1;
            if upper { (upper_a[axis], upper_b[axis]) } else { (lower_a[axis], lower_b[axis]) }
        };
        let ((xa, xb), (ya, yb), (za, zb)) = (pick(0), pick(1), pick(2));
        k[0] += xb * yb * zb * value;
        k[1] += (xa * yb * zb + xb * ya * zb + xb * yb * za) * value;
        k[2] += (xb * ya * za + xa * yb * za + xa * ya * zb) * value;
        k[3] += xa * ya * za * value;
    }
    k
}

fn horner(k: &[f32; 4], u: f32) -> f32 {
    ((k[0] * u + k[1]) * u + k[2]) * u + k[3]
}

/// Roots of 3A·u² + 2B·u + C by the schoolbook formula, ascending; 2 (never in the segment) where there is none.
fn extrema(k: &[f32; 4]) -> [f32; 2] {
    let discriminant = k[1] * k[1] - 3.0 * k[0] * k[2];
    if discriminant < 0.0 || k[0] == 0.0 {
        return [2.0, 2.0];
    }
    let root = discriminant.sqrt();
    let (e0, e1) = ((-k[1] - root) / (3.0 * k[0]), (-k[1] + root) / (3.0 * k[0]));
    [e0.min(e1), e0.max(e1)]
}
