//! The tricubic B-spline along a segment of a cell, and where it first enters the inside.
//!
//! Along a line each axis's weights are cubics, so that the spline is a polynomial of degree 9. Its Bernstein coefficients are sums of the 64
//! coefficients around the cell with weights that are never negative: where all of these are outside, so is the spline; and nothing cancels.
//! Parts of the segment whose coefficients change their sign more than once are halved (Lane and Riesenfeld 1981) down to [`LEAST`]: two
//! crossings that lie nearer to each other may be missed. What is found is refined by Newton's method guarded by bisection.
//!
//! The twin of `shaders/spline.wgsl`.

use super::{Entry, inside};
use crate::lanes::{Floats, LANES, Mask, Vecs, axes, mix};
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// The coefficients around cells, 4 along each axis, x fastest, from the one before the cell to the one behind it.
pub(crate) type Taps = [[f32; LANES]; 64];

pub(crate) const DEGREE: usize = 9;
/// Bernstein coefficients over a segment.
type Bernstein<S> = [Floats<S>; DEGREE + 1];

/// Parts of a segment are not halved below this: 2 thousandths of a voxel along an axis, 3.4 along a cell's diagonal.
pub(crate) const LEAST: f32 = 1.0 / 512.0;
/// Of a part: beyond what float32 positions resolve.
pub(crate) const STEP_TOLERANCE: f32 = 1e-6;
/// Bisection alone needs 20.
pub(crate) const MAX_STEPS: u32 = 40;

/// The weights of the four coefficients along an axis, six times the Bernstein coefficients of each over the cell.
pub(crate) const WEIGHTS: [[f32; 4]; 4] = [[1.0, 0.0, 0.0, 0.0], [4.0, 4.0, 2.0, 1.0], [1.0, 2.0, 4.0, 4.0], [0.0, 0.0, 0.0, 1.0]];
/// Binomial coefficients: products of polynomials whose coefficients are scaled by them are plain convolutions.
pub(crate) const OF_3: [f32; 4] = [1.0, 3.0, 3.0, 1.0];
pub(crate) const OF_9: [f32; DEGREE + 1] = [1.0, 9.0, 36.0, 84.0, 126.0, 126.0, 84.0, 36.0, 9.0, 1.0];

/// The four weights along an axis as polynomials over the segment from p to q: their blossoms (Ramshaw 1989) there, scaled.
#[inline(always)]
fn weights_along<S: Simd>(simd: S, p: Floats<S>, q: Floats<S>) -> [[Floats<S>; 4]; 4] {
    WEIGHTS.map(
        #[inline(always)]
        |w| {
            let c = w.map(|w| Floats::splat(simd, w / 6.0));
            let step = |c: &[Floats<S>], t| [mix(c[0], c[1], t), mix(c[1], c[2], t), mix(c[2], c[3], t)];
            let (at_p, at_q) = (step(&c, p), step(&c, q));
            let (pp, pq) = ([mix(at_p[0], at_p[1], p), mix(at_p[1], at_p[2], p)], [mix(at_p[0], at_p[1], q), mix(at_p[1], at_p[2], q)]);
            let qq = [mix(at_q[0], at_q[1], q), mix(at_q[1], at_q[2], q)];
            let b = [mix(pp[0], pp[1], p), mix(pp[0], pp[1], q), mix(pq[0], pq[1], q), mix(qq[0], qq[1], q)];
            [b[0] * OF_3[0], b[1] * OF_3[1], b[2] * OF_3[2], b[3] * OF_3[3]]
        },
    )
}

/// Bernstein coefficients, over the segments from `p` to `q` (local coordinates in [0, 1]³), of the spline of `taps` relative to `level`,
/// positive inside.
#[inline(always)]
fn bernstein<S: Simd>(simd: S, taps: &Taps, [level, sign]: [f32; 2], p: &Vecs<S>, q: &Vecs<S>) -> Bernstein<S> {
    let zero = Floats::splat(simd, 0.0);
    let [along_x, along_y, along_z] = axes!(a => weights_along(simd, p[a], q[a]));
    let mut b = [zero; DEGREE + 1];
    for z in 0..4 {
        let mut plane = [zero; 7];
        for y in 0..4 {
            let mut row = [zero; 4];
            for x in 0..4 {
                let c = sign * (Floats::load_array_ref(simd, &taps[(z * 4 + y) * 4 + x]) - level);
                for n in 0..4 {
                    row[n] += c * along_x[x][n];
                }
            }
            for n in 0..4 {
                for m in 0..4 {
                    plane[n + m] += row[n] * along_y[y][m];
                }
            }
        }
        for n in 0..7 {
            for m in 0..4 {
                b[n + m] += plane[n] * along_z[z][m];
            }
        }
    }
    for n in 0..=DEGREE {
        b[n] /= OF_9[n];
    }
    b
}

/// The coefficients over the part from `low` on that is `length` long (de Casteljau).
#[inline(always)]
fn part_of<S: Simd>(b: &Bernstein<S>, low: Floats<S>, length: Floats<S>) -> Bernstein<S> {
    let mut c = *b;
    let high = low + length;
    for r in 1..=DEGREE {
        for n in (r..=DEGREE).rev() {
            c[n] = mix(c[n - 1], c[n], high);
        }
    }
    let low = low / high;
    for r in 1..=DEGREE {
        for n in 0..=DEGREE - r {
            c[n] = mix(c[n], c[n + 1], low);
        }
    }
    c
}

/// The value and the derivative at u (de Casteljau).
#[inline(always)]
fn value_and_slope<S: Simd>(b: &Bernstein<S>, u: Floats<S>) -> [Floats<S>; 2] {
    let mut c = *b;
    for r in 1..DEGREE {
        for n in 0..=DEGREE - r {
            c[n] = mix(c[n], c[n + 1], u);
        }
    }
    [mix(c[0], c[1], u), DEGREE as f32 * (c[1] - c[0])]
}

/// The only entry in (0, 1), from outside at 0 to inside at 1.
#[inline(always)]
fn refine<S: Simd>(simd: S, b: &Bernstein<S>, mut sought: Mask<S>) -> Floats<S> {
    let (mut low, mut high) = (Floats::splat(simd, 0.0), Floats::splat(simd, 1.0));
    // Regula falsi for the start.
    let mut u = (b[0] / (b[0] - b[DEGREE])).max(low).min(high);
    for _ in 0..MAX_STEPS {
        let [f, d] = value_and_slope(b, u);
        let is_inside = inside(f);
        high = is_inside.select(u, high);
        low = is_inside.select(low, u);
        // f/d would leave the bracket exactly when |f| is at least |d| times the room that is left.
        let room = (f.simd_lt(0.0) ^ d.simd_lt(0.0)).select(high - u, u - low);
        let next = f.abs().simd_lt(d.abs() * room).select(u - f / d, 0.5 * (low + high));
        let step = (next - u).abs();
        u = sought.select(next, u);
        sought &= step.simd_gt(STEP_TOLERANCE);
        if !sought.any_true() {
            break;
        }
    }
    u
}

/// The first entries of the segments from `p` to `q` into the inside of the spline of `taps`, for the lanes of `asked`.
#[inline(always)]
pub(crate) fn first_entry<S: Simd>(simd: S, taps: &Taps, level: [f32; 2], p: &Vecs<S>, q: &Vecs<S>, asked: Mask<S>) -> Entry<S> {
    // Compiled by itself and called, for rays from the eye and for those to the light.
    simd.vectorize(
        #[inline(always)]
        || entry_of(simd, &bernstein(simd, taps, level, p, q), asked),
    )
}

#[inline(always)]
fn entry_of<S: Simd>(simd: S, b: &Bernstein<S>, asked: Mask<S>) -> Entry<S> {
    let (zero, one) = (Floats::splat(simd, 0.0), Floats::splat(simd, 1.0));
    let (mut low, mut length, mut u) = (zero, one, zero);
    let mut found = Mask::splat(simd, false);
    let mut seeking = asked & inside(most(b));
    while seeking.any_true() {
        let part = part_of(b, low, length);
        let at_start = seeking & inside(part[0]);
        u = at_start.select(low, u);
        let mut changes = zero;
        for n in 0..DEGREE {
            changes = (inside(part[n]) ^ inside(part[n + 1])).select(changes + 1.0, changes);
        }
        let (least, ends_inside) = (length.simd_le(LEAST), inside(part[DEGREE]));
        let holds = seeking & !at_start & ends_inside & (changes.simd_eq(1.0) | least);
        if holds.any_true() {
            u = holds.select(low + length * refine(simd, &part, holds), u);
        }
        found |= at_start | holds;
        seeking &= !found;
        let passed = !inside(most(&part)) | (least & !ends_inside);
        low = passed.select(low + length, low);
        // Multiples of powers of two: no rounding, and the last part ends at 1.
        length = passed.select((2.0 * length).min(one - low), 0.5 * length);
        seeking &= low.simd_lt(1.0);
    }
    Entry { found, u }
}

/// The largest coefficient.
#[inline(always)]
fn most<S: Simd>(b: &Bernstein<S>) -> Floats<S> {
    let mut most = b[0];
    for c in &b[1..] {
        most = most.max(*c);
    }
    most
}

/// The weights of the four coefficients along an axis at x, and their derivatives.
#[inline(always)]
fn weights_at<S: Simd>(x: Floats<S>) -> [[Floats<S>; 4]; 2] {
    let (y, sixth) = (1.0 - x, 1.0 / 6.0);
    let weights = [y * y * y * sixth, ((3.0 * x - 6.0) * x * x + 4.0) * sixth, ((3.0 * y - 6.0) * y * y + 4.0) * sixth, x * x * x * sixth];
    [weights, [-0.5 * y * y, (1.5 * x - 2.0) * x, (2.0 - 1.5 * y) * y, 0.5 * x * x]]
}

/// The spline's value at points of cells, and its gradient in index space.
#[inline(always)]
pub(crate) fn value_and_gradient<S: Simd>(simd: S, taps: &Taps, p: &Vecs<S>) -> (Floats<S>, Vecs<S>) {
    simd.vectorize(
        #[inline(always)]
        || {
            let zero = Floats::splat(simd, 0.0);
            let [[wx, dx], [wy, dy], [wz, dz]] = axes!(a => weights_at(p[a]));
            let (mut value, mut gradient) = (zero, [zero; 3]);
            for z in 0..4 {
                for y in 0..4 {
                    let (mut row, mut slope) = (zero, zero);
                    for x in 0..4 {
                        let c = Floats::load_array_ref(simd, &taps[(z * 4 + y) * 4 + x]);
                        row += c * wx[x];
                        slope += c * dx[x];
                    }
                    value += row * wy[y] * wz[z];
                    gradient[0] += slope * wy[y] * wz[z];
                    gradient[1] += row * dy[y] * wz[z];
                    gradient[2] += row * wy[y] * dz[z];
                }
            }
            (value, gradient)
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stability::Random;
    use fearless_simd::{Level, dispatch};
    use glam::{DVec3, Vec3};

    fn weights(x: f64) -> [f64; 4] {
        let cube = |x: f64| x * x * x;
        [cube(1.0 - x) / 6.0, (3.0 * cube(x) - 6.0 * x * x + 4.0) / 6.0, (3.0 * x * (1.0 + x - x * x) + 1.0) / 6.0, cube(x) / 6.0]
    }

    fn value(taps: &[f32; 64], p: DVec3) -> f64 {
        let [x, y, z] = p.to_array().map(weights);
        (0..64).map(|n| f64::from(taps[n]) * x[n % 4] * y[n / 4 % 4] * z[n / 16]).sum()
    }

    fn in_lanes<S: Simd>(simd: S, p: Vec3) -> Vecs<S> {
        axes!(a => Floats::splat(simd, p[a]))
    }

    #[test]
    fn the_polynomial_along_a_segment_is_the_spline_there() {
        // Fails if a weight, a coefficient's place, an end point or a binomial factor is wrong.
        let mut random = Random(5);
        for _ in 0..2000 {
            let taps: [f32; 64] = std::array::from_fn(|_| random.unit() * 2000.0 - 1000.0);
            let (p, q) = (random.point(), random.point());
            let (along, at_q) = dispatch!(Level::new(), simd => {
                let taps: Taps = taps.map(|v| [v; LANES]);
                let b = bernstein(simd, &taps, [0.0, 1.0], &in_lanes(simd, p), &in_lanes(simd, q));
                let along = [0.0, 0.125, 0.5, 0.8125, 1.0].map(|u| (u, value_and_slope(&b, Floats::splat(simd, u as f32))[0][3]));
                let (value, gradient) = value_and_gradient(simd, &taps, &in_lanes(simd, q));
                (along, (value[2], Vec3::from_array(axes!(a => gradient[a][2]))))
            });
            for (u, found) in along {
                let expected = value(&taps, p.as_dvec3().lerp(q.as_dvec3(), u));
                assert!((f64::from(found) - expected).abs() < 2e-3, "{u}: {found} {expected}");
            }
            assert!((f64::from(at_q.0) - value(&taps, q.as_dvec3())).abs() < 2e-3);
            let step = 1e-4;
            let difference = |axis| (value(&taps, q.as_dvec3() + step * axis) - value(&taps, q.as_dvec3() - step * axis)) / (2.0 * step);
            let slopes = DVec3::AXES.map(difference);
            assert!((at_q.1.as_dvec3() - DVec3::from(slopes)).length() < 2e-2, "{} {slopes:?}", at_q.1);
        }
    }

    #[test]
    fn the_first_crossing_is_found_wherever_it_lies() {
        // Polynomials with three known roots, and two more crossings that only the first may hide: fails if a part is skipped, or a later root
        // is taken for the first.
        let mut random = Random(7);
        let mut cases = 0;
        while cases < 20_000 {
            let mut roots: [f64; 3] = std::array::from_fn(|_| f64::from(random.unit()));
            roots.sort_by(f64::total_cmp);
            if roots[1] - roots[0] < 1.5 / 512.0 || roots[2] - roots[1] < 1.5 / 512.0 {
                continue;
            }
            // (u − a)(u − b)(u − c)·(1 + u)⁶, negative before the first root, in Bernstein form of degree 9.
            let mut scaled = vec![1.0];
            let times = |scaled: &[f64], [at_0, at_1]: [f64; 2]| -> Vec<f64> {
                (0..=scaled.len())
                    .map(|n| scaled.get(n).map_or(0.0, |c| c * at_0) + if n > 0 { scaled[n - 1] * at_1 } else { 0.0 })
                    .collect()
            };
            roots.iter().for_each(|r| scaled = times(&scaled, [-r, 1.0 - r]));
            (0..6).for_each(|_| scaled = times(&scaled, [1.0, 2.0]));
            let u = dispatch!(Level::new(), simd => {
                let b = std::array::from_fn(|n| Floats::splat(simd, (scaled[n] / f64::from(OF_9[n])) as f32));
                let entry = entry_of(simd, &b, Mask::splat(simd, true));
                entry.found.test(9).then(|| entry.u[9])
            });
            // Between roots as near as that float32 coefficients are not worth more.
            let u = f64::from(u.unwrap_or_else(|| panic!("none of {roots:?}")));
            assert!((u - roots[0]).abs() < 1e-3, "{u} of {roots:?}");
            cases += 1;
        }
    }

    #[test]
    fn coefficients_on_one_side_have_no_crossing() {
        // Fails if rounding could make a surface where none can be.
        let mut random = Random(9);
        for _ in 0..5000 {
            let taps: Taps = std::array::from_fn(|_| std::array::from_fn(|_| -(10.0_f32).powf(random.unit() * 14.0 - 9.0)));
            let (p, q) = (random.point(), random.point());
            let none = dispatch!(Level::new(), simd => {
                !first_entry(simd, &taps, [0.0, 1.0], &in_lanes(simd, p), &in_lanes(simd, q), Mask::splat(simd, true)).found.any_true()
            });
            assert!(none);
        }
    }
}
