//! The solver `marmitt`, as published: the cubic's extrema split the segment into monotonic parts, and linear interpolation is
//! repeated in the first part that changes sides (Marmitt, Kleer, Wald, Friedrich and Slusallek 2004).
//!
//! The twin of `shaders/marmitt.wgsl`.

use super::{Entry, inside};
use crate::lanes::{Floats, Mask, Vecs, axes};
use fearless_simd::Simd;
use fearless_simd::prelude::*;

#[inline(always)]
pub(super) fn first_entry<S: Simd>(simd: S, steps: u32, f: &[Floats<S>; 8], p: &Vecs<S>, q: &Vecs<S>, asked: Mask<S>) -> Entry<S> {
    let (zero, one) = (Floats::splat(simd, 0.0), Floats::splat(simd, 1.0));
    let k = power_basis(simd, f, p, q);
    let (mut u0, mut u1) = (zero, one);
    let (mut f0, mut f1) = (k[3], horner(&k, one));
    let at_start = inside(f0);
    for extremum in extrema(simd, &k) {
        let value = horner(&k, extremum);
        let within = extremum.simd_ge(u0) & extremum.simd_le(u1);
        let (up, down) = (within & inside(value), within & !inside(value));
        (u1, f1) = (up.select(extremum, u1), up.select(value, f1));
        (u0, f0) = (down.select(extremum, u0), down.select(value, f0));
    }
    let found = asked & (at_start | inside(f1));
    for _ in 0..steps {
        let u = u0 + (u1 - u0) * (f0 / (f0 - f1));
        let value = horner(&k, u);
        let is_inside = inside(value);
        (u1, f1) = (is_inside.select(u, u1), is_inside.select(value, f1));
        (u0, f0) = (is_inside.select(u0, u), is_inside.select(f0, value));
    }
    Entry { found, u: at_start.select(zero, u0 + (u1 - u0) * (f0 / (f0 - f1))) }
}

/// Coefficients A, B, C, D of A·u³ + B·u² + C·u + D: the interpolant with each coordinate written as a + u·b, multiplied out.
#[inline(always)]
fn power_basis<S: Simd>(simd: S, f: &[Floats<S>; 8], p: &Vecs<S>, q: &Vecs<S>) -> [Floats<S>; 4] {
    // Of the upper corners and of the lower ones.
    let a = [axes!(i => 1.0 - p[i]), *p];
    let b = [axes!(i => p[i] - q[i]), axes!(i => q[i] - p[i])];
    let mut k = [Floats::splat(simd, 0.0); 4];
    for c in 0..8 {
        let [x, y, z] = [c & 1, c >> 1 & 1, c >> 2];
        let ((xa, xb), (ya, yb), (za, zb)) = ((a[x][0], b[x][0]), (a[y][1], b[y][1]), (a[z][2], b[z][2]));
        k[0] += xb * yb * zb * f[c];
        k[1] += (xa * yb * zb + xb * ya * zb + xb * yb * za) * f[c];
        k[2] += (xb * ya * za + xa * yb * za + xa * ya * zb) * f[c];
        k[3] += xa * ya * za * f[c];
    }
    k
}

#[inline(always)]
fn horner<S: Simd>(k: &[Floats<S>; 4], u: Floats<S>) -> Floats<S> {
    ((k[0] * u + k[1]) * u + k[2]) * u + k[3]
}

/// Roots of 3A·u² + 2B·u + C by the schoolbook formula, ascending; 2 (never in the segment) where there is none.
#[inline(always)]
fn extrema<S: Simd>(simd: S, k: &[Floats<S>; 4]) -> [Floats<S>; 2] {
    let discriminant = k[1] * k[1] - 3.0 * k[0] * k[2];
    let none = discriminant.simd_lt(0.0) | k[0].simd_eq(0.0);
    let root = discriminant.max(0.0).sqrt();
    let (e0, e1) = ((-k[1] - root) / (3.0 * k[0]), (-k[1] + root) / (3.0 * k[0]));
    let outside = Floats::splat(simd, 2.0);
    [none.select(outside, e0.min(e1)), none.select(outside, e0.max(e1))]
}
