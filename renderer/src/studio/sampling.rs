//! The numbers that paths are drawn by, and what is made of them: points of pixels, discs, and directions.
//!
//! A pair of numbers is a point of Sobol's (0,2)-sequence, its index shuffled and each coordinate scrambled after Owen by the hash of Laine and
//! Karras with the constants of Vegdahl (2021), as Burley (2020) pads them to any number of dimensions. All steps are of unsigned
//! integers of 32 bits that wrap around, so that the twin, `shaders/sampling.wgsl`, has the same bits:
//!
//! ```text
//! mix(x)       x ^= x >> 16;  x *= 0x7feb352d;  x ^= x >> 15;  x *= 0x846ca68b;  x ^= x >> 16
//! owen(x, s)   x ^= x * 0x3d20adea;  x += s;  x *= (s >> 16) | 1;  x ^= x * 0x05526c56;  x ^= x * 0x53a22864    (x, bits reversed)
//! key          mix(pixel ^ mix(2 seed + half)),  pixel = row · width + column
//! seeds        a = mix(key + 0x9e3779b9 · (dimension + 1));  b = a · 747796405 + 2891336453;  c = b · 747796405 + 2891336453
//! point n      r = reverse(owen(reverse(n), a));   p = r ^ r >> 16;  p ^= p >> 8 & 0x00ff00ff;  …  p ^= p >> 1 & 0x55555555
//!              x = reverse(owen(r, b)) >> 8,  y = reverse(owen(p, c)) >> 8,  both · 2⁻²⁴
//! ```

use crate::cpu::dvr_steps::PCG;
use crate::lanes::{Floats, Vecs, axes, dot};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, u32x16};
use glam::Vec3;

pub(crate) type Words<S> = u32x16<S>;

/// The factors of `mix` (Wellons' lowbias32) and of `owen`, and what keys of two dimensions are apart by.
pub(crate) const MIX: [u32; 2] = [0x7feb_352d, 0x846c_a68b];
pub(crate) const OWEN: [u32; 3] = [0x3d20_adea, 0x0552_6c56, 0x53a2_2864];
pub(crate) const APART: u32 = 0x9e37_79b9;

/// What all words of a hash depend on alike.
#[inline(always)]
fn mix<S: Simd>(mut x: Words<S>) -> Words<S> {
    x ^= x >> 16;
    x *= MIX[0];
    x ^= x >> 15;
    x *= MIX[1];
    x ^ (x >> 16)
}

/// The same of one number.
pub(super) fn mixed(mut x: u32) -> u32 {
    x = (x ^ x >> 16).wrapping_mul(MIX[0]);
    x = (x ^ x >> 15).wrapping_mul(MIX[1]);
    x ^ x >> 16
}

/// The key of a pixel's numbers in one of the two halves.
pub(crate) fn key(pixel: u32, seed: u32, half: u32) -> u32 {
    mixed(pixel ^ mixed(seed.wrapping_mul(2).wrapping_add(half)))
}

/// Each bit turned by a hash of those below it.
#[inline(always)]
fn owen<S: Simd>(mut x: Words<S>, seed: Words<S>) -> Words<S> {
    x ^= x * OWEN[0];
    x += seed;
    x *= (seed >> 16) | 1;
    x ^= x * OWEN[1];
    x ^ (x * OWEN[2])
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
pub(crate) fn pair<S: Simd>(key: Words<S>, index: Words<S>, dimension: u32) -> [Floats<S>; 2] {
    let a = mix(key + APART.wrapping_mul(dimension + 1));
    let b = a * PCG[0] + PCG[1];
    let c = b * PCG[0] + PCG[1];
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::LANES;
    use fearless_simd::{Level, dispatch};

    fn pairs(key: u32, dimension: u32, count: u32) -> Vec<[f32; 2]> {
        let indices: Vec<u32> = (0..count.next_multiple_of(LANES as u32)).collect();
        let packet = |indices: &[u32]| -> Vec<[f32; 2]> {
            dispatch!(Level::new(), simd => {
                let [x, y] = pair(Words::splat(simd, key), Words::from_slice(simd, indices), dimension);
                (0..LANES).map(|lane| [x[lane], y[lane]]).collect()
            })
        };
        indices.chunks(LANES).flat_map(packet).take(count as usize).collect()
    }

    /// The sequence as the head of this file has it, one number at a time.
    fn plainly(key: u32, index: u32, dimension: u32) -> [u32; 2] {
        let owen = |mut x: u32, seed: u32| {
            x ^= x.wrapping_mul(0x3d20_adea);
            x = x.wrapping_add(seed).wrapping_mul((seed >> 16) | 1);
            x ^= x.wrapping_mul(0x0552_6c56);
            x ^ x.wrapping_mul(0x53a2_2864)
        };
        let a = mixed(key.wrapping_add(0x9e37_79b9_u32.wrapping_mul(dimension + 1)));
        let b = a.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let c = b.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let r = owen(index.reverse_bits(), a).reverse_bits();
        // Sobol's second coordinate, column by column of its matrix.
        let (mut second, mut column) = (0_u32, 1_u32 << 31);
        for bit in 0..32 {
            second ^= if r >> bit & 1 == 1 { column } else { 0 };
            column ^= column >> 1;
        }
        [owen(r, b).reverse_bits() >> 8, owen(second.reverse_bits(), c).reverse_bits() >> 8]
    }

    #[test]
    fn numbers_are_these_on_every_machine() {
        // Fails if a constant, a shift or an order is another: pictures of a seed would be others, and a GPU's unlike the CPU's.
        let found: Vec<[u32; 2]> = pairs(key(7, 1, 0), 3, 4).iter().map(|p| p.map(|v| (v * 16_777_216.0) as u32)).collect();
        assert_eq!(found, PINNED);
        for (n, pixel, dimension) in [(0, 0, 0), (5, 123_456, 1), (1000, 99, 17), (65_535, 4_000_000, 300)] {
            let (key, last) = (key(pixel, 11, 1), n / LANES as u32 * LANES as u32);
            let found = pairs(key, dimension, last + LANES as u32)[n as usize].map(|v| (v * 16_777_216.0) as u32);
            assert_eq!(found, plainly(key, n, dimension));
        }
    }

    const PINNED: [[u32; 2]; 4] = [[4_635_592, 1_841_594], [10_751_622, 16_392_689], [1_640_816, 10_316_373], [14_529_791, 5_251_986]];

    #[test]
    fn every_box_of_a_power_of_two_has_its_point() {
        // Fails if scrambling or shuffling breaks the net: of 2^k points one lies in each box of 2^−i × 2^−(k−i), whatever i.
        for (key, dimension) in [(1, 0), (0xdead_beef, 5), (77, 1000)] {
            for k in [4, 7, 10_u32] {
                let points = pairs(key, dimension, 1 << k);
                for i in 0..=k {
                    let mut seen = vec![false; 1 << k];
                    for [x, y] in &points {
                        let (column, row) = ((x * (1 << i) as f32) as usize, (y * (1 << (k - i)) as f32) as usize);
                        assert!(!std::mem::replace(&mut seen[row << i | column], true), "two of 2^{k} points in a box, i = {i}");
                    }
                }
            }
        }
    }

    #[test]
    fn discs_and_directions_are_even() {
        // Fails if a part of the disc has more than its share, or the polynomials are not sine and cosine.
        let points = pairs(3, 2, 4096);
        let (mut sums, mut most) = ([0.0_f64; 4], 0.0_f64);
        for [u, v] in points {
            let (x, y, z, across) = dispatch!(Level::new(), simd => {
                let splat = |v: f32| Floats::splat(simd, v);
                let [x, y] = disc([splat(u), splat(v)]);
                let n = normalized(&[splat(u - 0.5), splat(v - 0.4), splat(0.3 - u)]);
                let [p, q] = frame(&n);
                let dots = [dot(&p, &n), dot(&q, &n), dot(&p, &q), dot(&p, &p) - 1.0, dot(&q, &q) - 1.0];
                (x[0], y[0], above_disc([x, y])[0], dots.map(|d| d[0]))
            });
            assert!(across.iter().all(|d| d.abs() < 1e-5), "{across:?}");
            // An eighth of a turn lies on either side of the axis of the larger number.
            let (a, b) = (f64::from(2.0 * u - 1.0), f64::from(2.0 * v - 1.0));
            let eighth = std::f64::consts::FRAC_PI_4;
            let expected = if a.abs() > b.abs() {
                [a * (eighth * b / a).cos(), a * (eighth * b / a).sin()]
            } else {
                [b * (eighth * a / b).sin(), b * (eighth * a / b).cos()]
            };
            most = most.max((f64::from(x) - expected[0]).abs()).max((f64::from(y) - expected[1]).abs());
            let (x, y, z) = (f64::from(x), f64::from(y), f64::from(z));
            sums = [sums[0] + x, sums[1] + y, sums[2] + x * x + y * y, sums[3] + z];
        }
        assert!(most < 1e-6, "{most}");
        let means = sums.map(|sum| sum / 4096.0);
        // On a disc r² is ½ on average, above it a cosine's height ⅔.
        for (mean, expected) in means.into_iter().zip([0.0, 0.0, 0.5, 2.0 / 3.0]) {
            assert!((mean - expected).abs() < 2e-3, "{means:?}");
        }
        let tents: Vec<f32> =
            pairs(9, 1, 4096).iter().map(|[u, _]| dispatch!(Level::new(), simd => tent(Floats::splat(simd, *u))[0])).collect();
        let variance = tents.iter().map(|t| f64::from(t * t)).sum::<f64>() / 4096.0;
        assert!(tents.iter().all(|t| t.abs() <= 1.0) && (variance - 1.0 / 6.0).abs() < 2e-3, "a tent's variance is 1/6, not {variance}");
    }
}
