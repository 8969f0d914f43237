//! Samples smoothed for pictures: another volume, and not what is measured.

use crate::spline::with_values;
use crate::store::Store;
use crate::with_block;
use bregma_volume::{Sample, Volume};
use rayon::prelude::*;

/// Standard deviations that the kernel reaches: what is beyond is a quarter of a percent.
const REACH: f64 = 3.0;

/// A volume whose samples are those of `volume` under a Gaussian of a standard deviation in voxels; beyond the grid the nearest sample stands for others.
pub fn smoothed(volume: &Volume, sigma_voxel: f64) -> Volume {
    let dims = volume.grid().dims();
    let mut values: Vec<f32> = with_block!(Store::of(volume).whole(), b => b.onward([0; 3]).par_iter().map(|s| s.to_f32()).collect());
    let reach = (REACH * sigma_voxel).ceil().max(0.0) as usize;
    let weight = |n: usize| (-0.5 * (n as f64 / sigma_voxel).powi(2)).exp();
    let sum: f64 = 1.0 + 2.0 * (1..=reach).map(weight).sum::<f64>();
    let weights: Vec<f32> = (0..=reach).map(|n| if n == 0 { 1.0 / sum } else { weight(n) / sum }).map(|w| w as f32).collect();
    let [nx, ny, _] = dims;
    for (axis, stride) in [1, nx, nx * ny].into_iter().enumerate() {
        values = along(&values, dims[axis], stride, &weights);
    }
    with_values(volume, values)
}

/// The weighted means along an axis of `count` samples that lie `stride` apart.
fn along(values: &[f32], count: usize, stride: usize, weights: &[f32]) -> Vec<f32> {
    let mut means = vec![0.0; values.len()];
    means.par_chunks_mut(stride).enumerate().for_each(|(row, means)| {
        let (n, first) = (row % count, (row - row % count) * stride);
        let row_of = |n: usize| &values[first + n * stride..][..stride];
        means.iter_mut().zip(row_of(n)).for_each(|(mean, v)| *mean = weights[0] * v);
        for (away, weight) in weights.iter().enumerate().skip(1) {
            let (before, behind) = (row_of(n.saturating_sub(away)), row_of((n + away).min(count - 1)));
            means.iter_mut().zip(before).zip(behind).for_each(|((mean, a), b)| *mean += weight * (a + b));
        }
    });
    means
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_volume::{Grid, Raster, ReadSamples, Samples, Unit};
    use glam::{DMat3, DVec3};

    fn volume(dims: [usize; 3], samples: Samples) -> Volume {
        let grid = Grid::new(dims, DVec3::ONE, DVec3::ZERO, DMat3::IDENTITY).unwrap();
        Volume::new("test".into(), "test", Raster { grid, samples, slope: 1.0, intercept: 0.0, unit: Unit::Value, warnings: vec![] })
            .unwrap()
    }

    #[test]
    fn a_point_becomes_a_gaussian_and_planes_stay_planes() {
        // Fails if an axis is left out or strides are another's, weights do not add up to 1, or the kernel is not of the width that is asked for.
        let (dims, sigma) = ([15, 13, 17], 0.8);
        let middle = [7, 6, 8];
        let mut point = vec![0.0; dims.iter().product()];
        point[(middle[2] * dims[1] + middle[1]) * dims[0] + middle[0]] = 1.0;
        let found = smoothed(&volume(dims, Samples::F32(point)), sigma);
        let Samples::F32(found) = found.samples() else { panic!() };
        let (mut sum, mut squares) = (0.0, [0.0; 3]);
        for (n, v) in found.iter().enumerate() {
            let at = [n % dims[0], n / dims[0] % dims[1], n / (dims[0] * dims[1])];
            sum += f64::from(*v);
            (0..3).for_each(|a| squares[a] += f64::from(*v) * (at[a] as f64 - middle[a] as f64).powi(2));
        }
        assert!((sum - 1.0).abs() < 1e-5, "{sum}");
        // Cut off at three deviations the variance is up to 3 % less.
        squares.iter().for_each(|s| assert!((s / (sigma * sigma) - 1.0).abs() < 0.03, "{squares:?}"));
        let plane: Vec<i16> =
            (0..dims.iter().product::<usize>()).map(|n| (100 * (n % dims[0]) + 7 * (n / (dims[0] * dims[1]))) as i16).collect();
        let flat = smoothed(&volume(dims, Samples::I16(plane.clone())), sigma);
        let Samples::F32(flat) = flat.samples() else { panic!() };
        for n in 0..plane.len() {
            let at = [n % dims[0], n / (dims[0] * dims[1])];
            if (3..dims[0] - 3).contains(&at[0]) && (3..dims[2] - 3).contains(&at[1]) {
                assert!((flat[n] - f32::from(plane[n])).abs() < 1e-2, "{} is not {}", flat[n], plane[n]);
            }
        }
    }
}
