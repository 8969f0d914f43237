//! The solver `analytic`: a closed form for the cubic's roots, the one of Blinn ("How to solve a cubic equation, part 5", IEEE CG&A
//! 27(3), 2007), which is homogeneous and so needs no leading coefficient: taken over the Bernstein form, u : 1 − u are its two unknowns.
//!
//! Cosines and powers come from the standard library, a lane at a time.
//!
//! The twin of `shaders/analytic.wgsl`.

use super::bernstein::bernstein;
use super::{Entry, inside};
use crate::lanes::{Floats, Mask, Vecs, numbers};
use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::Vec2;

#[inline(always)]
pub(super) fn first_entry<S: Simd>(simd: S, f: &[Floats<S>; 8], p: &Vecs<S>, q: &Vecs<S>, asked: Mask<S>) -> Entry<S> {
    let b = bernstein(f, p, q);
    let at_start = inside(b[0]);
    let found = asked & (at_start | inside(b[1]) | inside(b[2]) | inside(b[3]));
    // Scaled to 1: products of four coefficients would vanish for values of 1e-10, and overflow for 1e10.
    let largest = b[0].abs().max(b[1].abs()).max(b[2].abs()).max(b[3].abs());
    let scaled = b.map(|c| (c / largest).to_array());
    let mut u = [0.0; _];
    for lane in numbers(found & !at_start) {
        u[lane] = roots(scaled.map(|c| c[lane])).into_iter().map(parameter).fold(NO_ROOT, f32::min);
    }
    let u = Floats::load_array(simd, u);
    Entry { found: found & u.simd_le(1.0), u }
}

/// Larger than any parameter of the segment.
pub(crate) const NO_ROOT: f32 = 2.0;

/// u of the root x : w, where it lies in the segment.
fn parameter(root: Vec2) -> f32 {
    let sum = root.x + root.y;
    if root.x * root.y >= 0.0 && sum != 0.0 { root.x / sum } else { NO_ROOT }
}

/// The real roots x : w of A·x³ + 3B·x²w + 3C·xw² + D·w³; unused places hold a root outside every segment.
fn roots([d, c, b, a]: [f32; 4]) -> [Vec2; 3] {
    let outside = Vec2::new(1.0, -1.0);
    let (d1, d2, d3) = (a * c - b * b, a * d - b * c, b * d - c * c);
    let discriminant = 4.0 * d1 * d3 - d2 * d2;
    if discriminant <= 0.0 {
        let from_a = b * b * b * d >= a * c * c * c;
        let (lead, c_bar, d_bar) = if from_a { (a, d1, -2.0 * b * d1 + a * d2) } else { (d, d3, -d * d2 + 2.0 * c * d3) };
        let t0 = -d_bar.signum() * lead.abs() * (-discriminant).sqrt();
        let t1 = t0 - d_bar;
        let p = cube_root(0.5 * t1);
        let q = if t1 == t0 || p == 0.0 { -p } else { -c_bar / p };
        let divisor = p * p + q * q + c_bar;
        let x = if c_bar <= 0.0 || divisor == 0.0 { p + q } else { -d_bar / divisor };
        return [if from_a { Vec2::new(x - b, a) } else { Vec2::new(-d, x + c) }, outside, outside];
    }
    let root = discriminant.sqrt();
    // The largest and the smallest root, each from the end of the polynomial where it is well determined.
    let depressed = |lead: f32, c_bar: f32, d_bar: f32| {
        let angle = (lead * root).atan2(-d_bar).abs() / 3.0;
        let size = 2.0 * (-c_bar).max(0.0).sqrt();
        (size * angle.cos(), size * (-0.5 * angle.cos() - 0.5 * 3.0_f32.sqrt() * angle.sin()))
    };
    let (x1, x3) = depressed(a, d1, -2.0 * b * d1 + a * d2);
    let large = Vec2::new(if x1 + x3 > 2.0 * b { x1 } else { x3 } - b, a);
    let (x1, x3) = depressed(d, d3, -d * d2 + 2.0 * c * d3);
    let small = Vec2::new(-d, if x1 + x3 < 2.0 * c { x1 } else { x3 } + c);
    let (e, f, g) = (large.y * small.y, -large.x * small.y - large.y * small.x, large.x * small.x);
    [large, small, Vec2::new(c * f - b * g, c * e - b * f)]
}

/// With the power function that shaders have.
fn cube_root(v: f32) -> f32 {
    v.signum() * v.abs().powf(1.0 / 3.0)
}
