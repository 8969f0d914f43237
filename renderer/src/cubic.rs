//! The solver `exact`: where a ray first crosses the isosurface within one cell.
//!
//! Along a segment the trilinear interpolant is a cubic. Its Bernstein coefficients are the blossom of the interpolant at
//! the segment's two ends (Ramshaw 1989), that is averages of trilinear interpolations with weights in [0, 1]. So they need
//! no powers and lose no digits; coefficients of one sign prove that there is no crossing; and the first and last one *are*
//! the interpolant at the entry and exit points, the same numbers in the two cells that share a face: nothing falls between.
//!
//! The twin of `shaders/cubic.wgsl`.

use glam::Vec3;

/// Inside bone: ties included, everywhere.
pub(crate) fn inside(v: f32) -> bool {
    v >= 0.0
}

/// a at w = 0 to b at w = 1. This form keeps the sign that a and b share, whatever is rounded; a + (b − a)·w does not.
fn mix(a: f32, b: f32, w: f32) -> f32 {
    a * (1.0 - w) + b * w
}

/// Bernstein coefficients, over the segment from `p` to `q` (local coordinates in [0, 1]³), of the trilinear interpolant of
/// the corner values `f`, where corner x + 2y + 4z is at (x, y, z).
pub(crate) fn bernstein(f: &[f32; 8], p: Vec3, q: Vec3) -> [f32; 4] {
    // px_y0z0 reads: x at p, on the edge y = 0, z = 0.
    let [px_y0z0, px_y1z0, px_y0z1, px_y1z1] = [0, 2, 4, 6].map(|c| mix(f[c], f[c + 1], p.x));
    let [qx_y0z0, qx_y1z0, qx_y0z1, qx_y1z1] = [0, 2, 4, 6].map(|c| mix(f[c], f[c + 1], q.x));
    let [pp_z0, pp_z1] = [mix(px_y0z0, px_y1z0, p.y), mix(px_y0z1, px_y1z1, p.y)];
    let [pq_z0, pq_z1] = [mix(px_y0z0, px_y1z0, q.y), mix(px_y0z1, px_y1z1, q.y)];
    let [qp_z0, qp_z1] = [mix(qx_y0z0, qx_y1z0, p.y), mix(qx_y0z1, qx_y1z1, p.y)];
    let [qq_z0, qq_z1] = [mix(qx_y0z0, qx_y1z0, q.y), mix(qx_y0z1, qx_y1z1, q.y)];
    [
        mix(pp_z0, pp_z1, p.z),
        (mix(qp_z0, qp_z1, p.z) + mix(pq_z0, pq_z1, p.z) + mix(pp_z0, pp_z1, q.z)) / 3.0,
        (mix(qq_z0, qq_z1, p.z) + mix(qp_z0, qp_z1, q.z) + mix(pq_z0, pq_z1, q.z)) / 3.0,
        mix(qq_z0, qq_z1, q.z),
    ]
}

/// The cubic at u.
fn value(b: &[f32; 4], u: f32) -> f32 {
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
    let (q0, q1, q2) = (b[1] - b[0], b[2] - b[1], b[3] - b[2]);
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

/// Newton steps that leave a bracket or fail to converge become bisections; ten always suffice for float32 (see the tests).
const MAX_STEPS: u32 = 10;
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
pub(crate) fn first_entry(b: &[f32; 4]) -> Option<f32> {
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
    use super::*;

    /// A small deterministic generator (PCG, O'Neill 2014), uniform in [0, 1).
    pub(crate) struct Random(pub u64);
    impl Random {
        pub fn next(&mut self) -> f32 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let x = (((self.0 >> 18) ^ self.0) >> 27) as u32;
            (x.rotate_right((self.0 >> 59) as u32) >> 8) as f32 / 16_777_216.0
        }
        fn point(&mut self) -> Vec3 {
            Vec3::new(self.next(), self.next(), self.next())
        }
    }

    fn trilinear_f64(f: &[f32; 8], p: glam::DVec3) -> f64 {
        (0..8).map(|c| f64::from(f[c]) * (0..3).map(|a| if c >> a & 1 == 1 { p[a] } else { 1.0 - p[a] }).product::<f64>()).sum()
    }

    #[test]
    fn the_blossom_is_the_interpolant_along_the_segment() {
        // Fails if a corner, an average or an end point is taken wrongly.
        let mut random = Random(1);
        for _ in 0..10_000 {
            let f: [f32; 8] = std::array::from_fn(|_| random.next() * 2000.0 - 1000.0);
            let (p, q) = (random.point(), random.point());
            let b = bernstein(&f, p, q);
            for i in 0..=8 {
                let u = i as f32 / 8.0;
                let expected = trilinear_f64(&f, p.as_dvec3().lerp(q.as_dvec3(), f64::from(u)));
                assert!((f64::from(value(&b, u)) - expected).abs() < 1e-3, "{u}: {} {expected}", value(&b, u));
            }
        }
    }

    #[test]
    fn two_cells_agree_to_the_bit_about_their_shared_face() {
        // Fails if the value at the exit of one cell and the entry of the next can differ: that is a crack.
        let mut random = Random(2);
        for _ in 0..100_000 {
            let (left, middle, right): ([f32; 4], [f32; 4], [f32; 4]) =
                std::array::from_fn::<_, 3, _>(|_| std::array::from_fn(|_| (random.next() * 5.0).floor() - 2.0)).into();
            let face = Vec3::new(1.0, random.next(), random.next());
            let cell = |l: &[f32; 4], r: &[f32; 4]| std::array::from_fn(|c| if c & 1 == 0 { l[c / 2] } else { r[c / 2] });
            let exit = bernstein(&cell(&left, &middle), random.point().with_x(0.0), face)[3];
            let entry = bernstein(&cell(&middle, &right), face.with_x(0.0), random.point().with_x(1.0))[0];
            assert_eq!(exit.to_bits() & 0x7fff_ffff, entry.to_bits() & 0x7fff_ffff);
            assert_eq!(inside(exit), inside(entry));
        }
    }

    #[test]
    fn corners_on_one_side_keep_every_coefficient_there() {
        // Fails if interpolation may round across zero: a false hit in empty space.
        let mut random = Random(3);
        for _ in 0..100_000 {
            let tiny = |r: &mut Random| -(10.0_f32).powf(r.next() * 14.0 - 9.0);
            let f: [f32; 8] = std::array::from_fn(|_| tiny(&mut random));
            let b = bernstein(&f, random.point(), random.point());
            assert!(b.iter().all(|&c| c < 0.0), "{f:?} {b:?}");
        }
    }

    #[test]
    fn first_entries_match_dense_sampling_in_float64() {
        // Fails if a turning point is missed, brackets are taken in the wrong order, or Newton escapes. Three kinds of cell:
        // rough, corner values in {−1, 0, 1}, and two almost equal roots.
        let mut random = Random(4);
        let (mut tested, mut worst) = (0, 0.0_f64);
        for n in 0..60_000 {
            let f: [f32; 8] = match n % 2 {
                0 => std::array::from_fn(|_| random.next() - 0.6),
                _ => std::array::from_fn(|_| (random.next() * 3.0).floor() - 1.0),
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
