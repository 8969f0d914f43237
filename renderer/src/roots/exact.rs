//! The solver `exact`: where a ray first crosses the isosurface within one cell.
//!
//! The cubic's Bernstein coefficients are taken from the corner values (`bernstein.rs`), its first entry is found in `cubic.rs`.
//!
//! The twin of `shaders/exact.wgsl`.

use super::Entry;
use super::bernstein::bernstein;
use super::cubic::cubic_entry;
use crate::lanes::{Floats, Mask, Vecs};
use fearless_simd::Simd;

#[inline(always)]
pub(super) fn first_entry<S: Simd>(simd: S, f: &[Floats<S>; 8], p: &Vecs<S>, q: &Vecs<S>, asked: Mask<S>) -> Entry<S> {
    cubic_entry(simd, &bernstein(f, p, q), asked)
}

#[cfg(test)]
mod tests {
    use super::super::Solver;
    use super::super::tests::{bernstein_of, first_entry_of, trilinear_f64};
    use crate::stability::Random;

    #[test]
    fn first_entries_match_dense_sampling_in_float64() {
        // Fails if a turning point is missed, brackets are taken in the wrong order, or Newton escapes. Three kinds of cell:
        // rough, corner values in {−1, 0, 1}, and two almost equal roots.
        let mut random = Random(4);
        let (mut tested, mut worst) = (0, 0.0_f64);
        for n in 0..60_000 {
            let f: [f32; 8] = match n % 2 {
                0 => std::array::from_fn(|_| random.unit() - 0.6),
                _ => std::array::from_fn(|_| (random.unit() * 3.0).floor() - 1.0),
            };
            let (p, q) = (random.point(), random.point());
            let b = bernstein_of(&f, p, q);
            let exact = |u: f64| trilinear_f64(&f, p.as_dvec3().lerp(q.as_dvec3(), u));
            if b[0].abs() < 1e-5 || exact(1.0).abs() < 1e-5 {
                continue;
            }
            // The certain part: a bracket of 1/4096 with a clear sign change, or clearly none at all.
            let grid: Vec<f64> = (0..=4096).map(|i| exact(f64::from(i) / 4096.0)).collect();
            let first = if grid[0] >= 0.0 { Some(0) } else { grid.iter().position(|&v| v >= 0.0) };
            match (first_entry_of(Solver::Exact, &f, p, q), first) {
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
}
