//! The numbers that paths are drawn by, and what is made of them: points of pixels, discs, and directions.
//!
//! A pair of numbers is a point of Sobol's (0,2)-sequence, its index shuffled and each coordinate scrambled after Owen by the hash of Laine and
//! Karras with the constants of Vegdahl (2021), as Burley (2020) pads them to any number of dimensions. All steps are of unsigned
//! integers of 32 bits that wrap around, so that a GPU has the same bits:
//!
//! ```text
//! mix(x)       x ^= x >> 16;  x *= 0x7feb352d;  x ^= x >> 15;  x *= 0x846ca68b;  x ^= x >> 16
//! owen(x, s)   x ^= x * 0x3d20adea;  x += s;  x *= (s >> 16) | 1;  x ^= x * 0x05526c56;  x ^= x * 0x53a22864    (x, bits reversed)
//! key          mix(pixel ^ mix(2 seed + half)),  pixel = row · width + column
//! seeds        a = mix(key + 0x9e3779b9 · (dimension + 1));  b = a · 747796405 + 2891336453;  c = b · 747796405 + 2891336453
//! point n      r = reverse(owen(reverse(n), a));   p = r ^ r >> 16;  p ^= p >> 8 & 0x00ff00ff;  …  p ^= p >> 1 & 0x55555555
//!              x = reverse(owen(r, b)) >> 8,  y = reverse(owen(p, c)) >> 8,  both · 2⁻²⁴
//! ```

use crate::lanes::{Floats, Vecs, axes, dot};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, u32x16};
use glam::Vec3;

pub(super) type Words<S> = u32x16<S>;

/// What all words of a hash depend on alike (Wellons' lowbias32).
#[inline(always)]
fn mix<S: Simd>(mut x: Words<S>) -> Words<S> {
    x ^= x >> 16;
    x *= 0x7feb_352d;
    x ^= x >> 15;
    x *= 0x846c_a68b;
    x ^ (x >> 16)
}

/// The same of one number.
pub(super) fn mixed(mut x: u32) -> u32 {
    x = (x ^ x >> 16).wrapping_mul(0x7feb_352d);
    x = (x ^ x >> 15).wrapping_mul(0x846c_a68b);
    x ^ x >> 16
}

/// The key of a pixel's numbers in one of the two halves.
pub(super) fn key(pixel: u32, seed: u32, half: u32) -> u32 {
    mixed(pixel ^ mixed(seed.wrapping_mul(2).wrapping_add(half)))
}

/// Each bit turned by a hash of those below it.
#[inline(always)]
fn owen<S: Simd>(mut x: Words<S>, seed: Words<S>) -> Words<S> {
    x ^= x * 0x3d20_adea;
    x += seed;
    x *= (seed >> 16) | 1;
    x ^= x * 0x0552_6c56;
    x ^ (x * 0x53a2_2864)
}

#[inline(always)]
fn reversed<S: Simd>(mut x: Words<S>) -> Words<S> {
    x = (x >> 16) | (x << 16);
    x = ((x >> 8) & 0x00ff_00ff) | ((x & 0x00ff_00ff) << 8);
    x = ((x >> 4) & 0x0f0f_0f0f) | ((x & 0x0f0f_0f0f) << 4);
    x = ((x >> 2) & 0x3333_3333) | ((x & 0x3333_3333) << 2);
    ((x >> 1) & 0x5555_5555) | ((x & 0x5555_5555) << 1)
}

/// Pascal's triangle modulo 2 times a number: the second coordinate of Sobol's sequence, bits reversed.
#[inline(always)]
fn pascal<S: Simd>(mut x: Words<S>) -> Words<S> {
    x ^= x >> 16;
    x ^= (x >> 8) & 0x00ff_00ff;
    x ^= (x >> 4) & 0x0f0f_0f0f;
    x ^= (x >> 2) & 0x3333_3333;
    x ^ ((x >> 1) & 0x5555_5555)
}

/// A number from 0 to 1, less than 1.
#[inline(always)]
fn unit<S: Simd>(x: Words<S>) -> Floats<S> {
    (x >> 8).to_float::<Floats<S>>() * (1.0 / 16_777_216.0)
}

/// Pair number `dimension` of the samples number `index` of pixels with such keys.
#[inline(always)]
pub(super) fn pair<S: Simd>(key: Words<S>, index: Words<S>, dimension: u32) -> [Floats<S>; 2] {
    let a = mix(key + 0x9e37_79b9_u32.wrapping_mul(dimension + 1));
    let b = a * 747_796_405 + 2_891_336_453;
    let c = b * 747_796_405 + 2_891_336_453;
    let r = reversed(owen(reversed(index), a));
    [unit(reversed(owen(r, b))), unit(reversed(owen(pascal(r), c)))]
}

/// From the middle of a pixel, by the tent that falls from there to the next pixels' middles.
#[inline(always)]
pub(super) fn tent<S: Simd>(u: Floats<S>) -> Floats<S> {
    let one = Floats::splat(u.token(), 1.0);
    let low = (2.0 * u).sqrt() - 1.0;
    let high = 1.0 - (one + one - 2.0 * u).max(0.0).sqrt();
    u.simd_lt(0.5).select(low, high)
}

/// Evenly on the unit disc (Shirley and Chiu 1997). Sine and cosine are polynomials, so that all machines have the same.
#[inline(always)]
pub(super) fn disc<S: Simd>([u, v]: [Floats<S>; 2]) -> [Floats<S>; 2] {
    let zero = Floats::splat(u.token(), 0.0);
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    let first = a.abs().simd_gt(b.abs());
    let (r, other) = (first.select(a, b), first.select(b, a));
    let angle = r.simd_ne(0.0).select(other / r, zero) * std::f32::consts::FRAC_PI_4;
    let t = angle * angle;
    // Taylor's up to t⁴: within an eighth of a turn below float32's last place.
    let sine = angle * (1.0 - t * (1.0 / 6.0) * (1.0 - t * (1.0 / 20.0) * (1.0 - t * (1.0 / 42.0) * (1.0 - t * (1.0 / 72.0)))));
    let cosine = 1.0 - t * 0.5 * (1.0 - t * (1.0 / 12.0) * (1.0 - t * (1.0 / 30.0) * (1.0 - t * (1.0 / 56.0) * (1.0 - t * (1.0 / 90.0)))));
    let (along, across) = (r * cosine, r * sine);
    [first.select(along, across), first.select(across, along)]
}

/// Two unit vectors across a unit one (Duff et al. 2017).
#[inline(always)]
pub(super) fn frame<S: Simd>(n: &Vecs<S>) -> [Vecs<S>; 2] {
    let sign = Floats::splat(n[0].token(), 1.0).copysign(n[2]);
    let a = -1.0 / (sign + n[2]);
    let b = n[0] * n[1] * a;
    [[1.0 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]], [b, sign + n[1] * n[1] * a, -n[1]]]
}

/// What has these coordinates along two vectors and a third.
#[inline(always)]
pub(super) fn combined<S: Simd>([u, v]: &[Vecs<S>; 2], w: &Vecs<S>, [x, y, z]: [Floats<S>; 3]) -> Vecs<S> {
    axes!(a => x * u[a] + y * v[a] + z * w[a])
}

/// About a normal, by the cosine: straight up from the disc.
#[inline(always)]
pub(super) fn above_disc<S: Simd>([x, y]: [Floats<S>; 2]) -> Floats<S> {
    (1.0 - x * x - y * y).max(0.0).sqrt()
}

#[inline(always)]
pub(super) fn normalized<S: Simd>(v: &Vecs<S>) -> Vecs<S> {
    let length = dot(v, v).sqrt();
    axes!(a => v[a] / length)
}

/// Two unit vectors across a unit one, as [`frame`] has them.
pub(super) fn frame_of(n: Vec3) -> [Vec3; 2] {
    let sign = 1.0_f32.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    [Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), Vec3::new(b, sign + n.y * n.y * a, -n.y)]
}
