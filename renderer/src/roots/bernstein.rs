//! The cubic of the interpolant along a segment of a cell, in Bernstein form.
//!
//! Its coefficients are the blossom of the interpolant at the segment's two ends (Ramshaw 1989), that is averages of trilinear
//! interpolations with weights in [0, 1]. So they need no powers and lose no digits; coefficients of one sign prove that there is no
//! crossing; and the first and last one *are* the interpolant at the entry and exit points, the same numbers in the two cells that
//! share a face: nothing falls between.
//!
//! The twin of `shaders/bernstein.wgsl`.

use crate::lanes::{Floats, Vecs, mix};
use fearless_simd::Simd;

/// Bernstein coefficients, over the segment from `p` to `q` (local coordinates in [0, 1]³), of the trilinear interpolant of
/// the corner values `f`, where corner x + 2y + 4z is at (x, y, z).
#[inline(always)]
pub(crate) fn bernstein<S: Simd>(f: &[Floats<S>; 8], p: &Vecs<S>, q: &Vecs<S>) -> [Floats<S>; 4] {
    // px_y0z0 reads: x at p, on the edge y = 0, z = 0.
    let (px_y0z0, px_y1z0) = (mix(f[0], f[1], p[0]), mix(f[2], f[3], p[0]));
    let (px_y0z1, px_y1z1) = (mix(f[4], f[5], p[0]), mix(f[6], f[7], p[0]));
    let (qx_y0z0, qx_y1z0) = (mix(f[0], f[1], q[0]), mix(f[2], f[3], q[0]));
    let (qx_y0z1, qx_y1z1) = (mix(f[4], f[5], q[0]), mix(f[6], f[7], q[0]));
    let (pp_z0, pp_z1) = (mix(px_y0z0, px_y1z0, p[1]), mix(px_y0z1, px_y1z1, p[1]));
    let (pq_z0, pq_z1) = (mix(px_y0z0, px_y1z0, q[1]), mix(px_y0z1, px_y1z1, q[1]));
    let (qp_z0, qp_z1) = (mix(qx_y0z0, qx_y1z0, p[1]), mix(qx_y0z1, qx_y1z1, p[1]));
    let (qq_z0, qq_z1) = (mix(qx_y0z0, qx_y1z0, q[1]), mix(qx_y0z1, qx_y1z1, q[1]));
    [
        mix(pp_z0, pp_z1, p[2]),
        (mix(qp_z0, qp_z1, p[2]) + mix(pq_z0, pq_z1, p[2]) + mix(pp_z0, pp_z1, q[2])) / 3.0,
        (mix(qq_z0, qq_z1, p[2]) + mix(qp_z0, qp_z1, q[2]) + mix(pq_z0, pq_z1, q[2])) / 3.0,
        mix(qq_z0, qq_z1, q[2]),
    ]
}

#[cfg(test)]
mod tests {
    use super::super::tests::{bernstein_of, trilinear_f64};
    use crate::stability::Random;
    use glam::Vec3;

    fn value(b: &[f32; 4], u: f32) -> f32 {
        let m = 1.0 - u;
        b[0] * m * m * m + 3.0 * b[1] * m * m * u + 3.0 * b[2] * m * u * u + b[3] * u * u * u
    }

    #[test]
    fn the_blossom_is_the_interpolant_along_the_segment() {
        // Fails if a corner, an average or an end point is taken wrongly.
        let mut random = Random(1);
        for _ in 0..10_000 {
            let f: [f32; 8] = std::array::from_fn(|_| random.unit() * 2000.0 - 1000.0);
            let (p, q) = (random.point(), random.point());
            let b = bernstein_of(&f, p, q);
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
                std::array::from_fn::<_, 3, _>(|_| std::array::from_fn(|_| (random.unit() * 5.0).floor() - 2.0)).into();
            let face = Vec3::new(1.0, random.unit(), random.unit());
            let cell = |l: &[f32; 4], r: &[f32; 4]| std::array::from_fn(|c| if c & 1 == 0 { l[c / 2] } else { r[c / 2] });
            let exit = bernstein_of(&cell(&left, &middle), random.point().with_x(0.0), face)[3];
            let entry = bernstein_of(&cell(&middle, &right), face.with_x(0.0), random.point().with_x(1.0))[0];
            assert_eq!(exit.to_bits() & 0x7fff_ffff, entry.to_bits() & 0x7fff_ffff);
            assert_eq!(exit >= 0.0, entry >= 0.0);
        }
    }

    #[test]
    fn corners_on_one_side_keep_every_coefficient_there() {
        // Fails if interpolation may round across zero: a false hit in empty space.
        let mut random = Random(3);
        for _ in 0..100_000 {
            let tiny = |r: &mut Random| -(10.0_f32).powf(r.unit() * 14.0 - 9.0);
            let f: [f32; 8] = std::array::from_fn(|_| tiny(&mut random));
            let b = bernstein_of(&f, random.point(), random.point());
            assert!(b.iter().all(|&c| c < 0.0), "{f:?} {b:?}");
        }
    }
}
