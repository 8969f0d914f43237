//! Weighted means by the discrete Gaussian, one axis after the other.

use bregma_volume::{Cancelled, Progress, Sample};
use rayon::prelude::*;

/// Weights that are left out at the ends of a kernel sum up to less than this: as much of the scan's range as a value may be off for that.
const MAXIMUM_ERROR: f64 = 1e-5;

/// The weights of the middle and of those beside it to either side: e⁻ᵗ·Iₙ(t), t the variance in samples², I the modified Bessel function
/// (Lindeberg 1990, equation 32). They are found from far out inward (Miller's recurrence, Abramowitz and Stegun 9.12), and sum up to 1.
pub fn kernel(variance: f64) -> Vec<f32> {
    if variance <= 0.0 {
        return vec![1.0];
    }
    // Beyond 8 standard deviations and 20 samples weights are below 1e-14 of the middle's, whatever the variance.
    let far = (8.0 * variance.sqrt()) as usize + 20;
    let (mut outer, mut here) = (0.0, 1e-300_f64);
    let mut weights = vec![0.0; far];
    for n in (0..far).rev() {
        weights[n] = here;
        (outer, here) = (here, outer + 2.0 * n as f64 / variance * here);
        // Small variances let it grow without end; only ratios count.
        if here > 1e200 {
            weights[n..].iter_mut().for_each(|w| *w *= 1e-200);
            (outer, here) = (outer * 1e-200, here * 1e-200);
        }
    }
    let all = weights[0] + 2.0 * weights[1..].iter().sum::<f64>();
    let mut sum = weights[0] / all;
    let mut used = 1;
    while sum < 1.0 - MAXIMUM_ERROR && used < far {
        sum += 2.0 * weights[used] / all;
        used += 1;
    }
    weights[..used].iter().map(|w| (w / all / sum) as f32).collect()
}

/// Means of samples, for a variance along each axis in samples².
pub fn smoothed<T: Sample>(samples: &[T], dims: [usize; 3], variances: [f64; 3], progress: &Progress) -> Result<Vec<f32>, Cancelled> {
    let [nx, ny, nz] = dims;
    let [along, across, through] = variances.map(kernel);
    progress.begin((nz + ny) as u64);
    let mut means = vec![0.0_f32; samples.len()];
    let slices = means.par_chunks_mut(nx * ny).zip(samples.par_chunks(nx * ny));
    slices.try_for_each_init(
        || (vec![0.0_f32; nx * ny], vec![]),
        |(rows, padded), (out, samples)| {
            for (row, samples) in rows.chunks_mut(nx).zip(samples.chunks(nx)) {
                along_row(samples, &along, padded, row);
            }
            let read: Vec<&[f32]> = rows.chunks(nx).collect();
            out.chunks_mut(nx).enumerate().for_each(|(j, out)| across_rows(&read, j, &across, out));
            progress.advance(1)
        },
    )?;
    // Rows of one j lie far from each other: each thread gets those of one j at a time.
    let mut by_j: Vec<Vec<&mut [f32]>> = (0..ny).map(|_| Vec::with_capacity(nz)).collect();
    means.chunks_mut(nx).enumerate().for_each(|(row, values)| by_j[row % ny].push(values));
    by_j.par_iter_mut().try_for_each_init(
        || vec![0.0_f32; nx * nz],
        |copy, rows| {
            copy.chunks_mut(nx).zip(rows.iter()).for_each(|(copy, row)| copy.copy_from_slice(row));
            let read: Vec<&[f32]> = copy.chunks(nx).collect();
            rows.iter_mut().enumerate().for_each(|(k, out)| across_rows(&read, k, &through, out));
            progress.advance(1)
        },
    )?;
    Ok(means)
}

fn along_row<T: Sample>(samples: &[T], weights: &[f32], padded: &mut Vec<f32>, out: &mut [f32]) {
    let reach = weights.len() - 1;
    let [first, last] = [samples[0].to_f32(), samples[samples.len() - 1].to_f32()];
    padded.clear();
    padded.resize(reach, first);
    padded.extend(samples.iter().map(|s| s.to_f32()));
    padded.resize(samples.len() + 2 * reach, last);
    out.iter_mut().zip(&padded[reach..]).for_each(|(mean, v)| *mean = weights[0] * v);
    for (away, weight) in weights.iter().enumerate().skip(1) {
        let beside = padded[reach - away..].iter().zip(&padded[reach + away..]);
        out.iter_mut().zip(beside).for_each(|(mean, (a, b))| *mean += weight * (a + b));
    }
}

fn across_rows(rows: &[&[f32]], n: usize, weights: &[f32], out: &mut [f32]) {
    let last = rows.len() - 1;
    out.iter_mut().zip(rows[n]).for_each(|(mean, v)| *mean = weights[0] * v);
    for (away, weight) in weights.iter().enumerate().skip(1) {
        let (before, behind) = (rows[n.saturating_sub(away)], rows[(n + away).min(last)]);
        out.iter_mut().zip(before).zip(behind).for_each(|((mean, a), b)| *mean += weight * (a + b));
    }
}
