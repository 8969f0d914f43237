//! The tricubic B-spline through a scan's samples, by its coefficients: another reconstruction than the trilinear interpolant, smooth to its
//! second derivatives (Sigg and Hadwiger 2005; the filter of Unser 1999).

use crate::store::Store;
use crate::with_block;
use bregma_volume::{Sample, Samples, Volume};
use rayon::prelude::*;

/// The pole of the filter that turns samples into coefficients of cubic B-splines: √3 − 2.
const POLE: f64 = -0.267_949_192_431_122_7;
/// Samples farther from 0 have no spline in float32: its coefficients are up to 27 times as large, which a volume takes for no numbers.
pub const MOST_SAMPLE: f64 = 1e35;
/// Samples that a filter's first value still depends on: the pole to this power is below float32's last place.
const REACH: usize = 16;

/// The coefficients of the cubic B-spline that passes through all samples of a volume, as a volume of the same grid and units. Beyond the
/// grid samples are taken to repeat in reverse, beginning with the last one, and so do coefficients: the nearest one stands for the one
/// beyond, which is what a renderer reads there.
pub fn coefficients(volume: &Volume) -> Volume {
    let dims = volume.grid().dims();
    let mut values: Vec<f32> = with_block!(Store::of(volume).whole(), b => b.onward([0; 3]).par_iter().map(|s| s.to_f32()).collect());
    let [nx, ny, nz] = dims;
    values.par_chunks_mut(nx).for_each(|row| filter(row, nx, 1));
    values.par_chunks_mut(nx * ny).for_each(|slice| filter(slice, ny, nx));
    filter(&mut values, nz, nx * ny);
    with_values(volume, values)
}

/// A volume of other samples in the place of a volume's: weighted sums of them.
pub(crate) fn with_values(volume: &Volume, values: Vec<f32>) -> Volume {
    // The samples were checked.
    volume.with_samples(Samples::F32(values)).expect("sums of a volume's samples are a volume")
}

/// Filters `count` rows of `stride` values, each column of them as a signal.
fn filter(rows: &mut [f32], count: usize, stride: usize) {
    // What repeats in reverse has a period of twice its length.
    let mirrored = |n: usize| (n % (2 * count)).min(2 * count - 1 - n % (2 * count));
    let begin = |m: usize| {
        let before = (1..=REACH).map(|n| POLE.powi(n as i32) * f64::from(rows[mirrored(n - 1) * stride + m]));
        (f64::from(rows[m]) + before.sum::<f64>()) as f32
    };
    let first: Vec<f32> = (0..stride).into_par_iter().with_min_len(PIECE).map(begin).collect();
    rows[..stride].copy_from_slice(&first);
    let pole = POLE as f32;
    for n in 1..count {
        let (before, from) = rows.split_at_mut(n * stride);
        in_pieces(&mut from[..stride], &before[(n - 1) * stride..], |here, before| *here += pole * before);
    }
    let (last, gain) = ((POLE / (POLE - 1.0)) as f32, ((1.0 - POLE) * (1.0 - 1.0 / POLE)) as f32);
    let from = (count - 1) * stride;
    rows[from..].iter_mut().for_each(|v| *v *= gain * last);
    for n in (0..count - 1).rev() {
        let (before, behind) = rows.split_at_mut((n + 1) * stride);
        in_pieces(&mut before[n * stride..], &behind[..stride], |here, behind| *here = pole * (behind - gain * *here));
    }
}

/// Values of a row that a thread takes at once.
const PIECE: usize = 1 << 14;

/// Does something with each value of a row and the one beside it.
fn in_pieces(row: &mut [f32], beside: &[f32], each: impl Fn(&mut f32, f32) + Sync) {
    let piece = |(row, beside): (&mut [f32], &[f32])| row.iter_mut().zip(beside).for_each(|(v, b)| each(v, *b));
    // A short row is not worth asking for help.
    if row.len() <= PIECE {
        piece((row, beside));
    } else {
        row.par_chunks_mut(PIECE).zip(beside.par_chunks(PIECE)).for_each(piece);
    }
}

/// (coefficients c) → (for each sample the largest sign·c within one sample along each axis, as c). A cell's spline is an average of
/// the 4 × 4 × 4 coefficients around it, and each of these is next to a corner: where the hull is outside at all corners, so is the spline.
pub fn hull(coefficients: &[f32], dims: [usize; 3], sign: f32) -> Vec<f32> {
    let [nx, ny, nz] = dims;
    let nearer = |a: f32, b: f32| if sign * b > sign * a { b } else { a };
    let around = |n: usize, count: usize| n.saturating_sub(1)..(n + 2).min(count);
    let mut hull = vec![0.0; coefficients.len()];
    hull.par_chunks_mut(nx).enumerate().for_each_init(
        || vec![0.0; nx],
        |across, (row, hull)| {
            let (j, k) = (row % ny, row / ny);
            across.copy_from_slice(&coefficients[row * nx..][..nx]);
            for (k, j) in around(k, nz).flat_map(|k| around(j, ny).map(move |j| (k, j))) {
                let beside = &coefficients[(k * ny + j) * nx..][..nx];
                across.iter_mut().zip(beside).for_each(|(v, b)| *v = nearer(*v, *b));
            }
            for (n, v) in hull.iter_mut().enumerate() {
                *v = across[around(n, nx)].iter().copied().fold(across[n], nearer);
            }
        },
    );
    hull
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_synthetic::Random;
    use bregma_volume::{Grid, Raster, ReadSamples, Unit};

    fn volume(dims: [usize; 3], samples: Samples) -> Volume {
        let grid = Grid::new(dims, glam::DVec3::ONE, glam::DVec3::ZERO, glam::DMat3::IDENTITY).unwrap();
        Volume::new("test".into(), "test", Raster { grid, samples, slope: 1.0, intercept: 0.0, unit: Unit::Value, warnings: vec![] })
            .unwrap()
    }

    #[test]
    fn the_spline_passes_through_all_samples() {
        // Fails if the filter's first or last value is not that of its border, an axis is forgotten, or the gain is wrong.
        let mut random = Random(11);
        for dims in [[2, 3, 4], [5, 40, 9], [130, 129, 3], [33, 2, 2]] {
            let samples: Vec<i16> = (0..dims.iter().product()).map(|_| (random.unit() * 4000.0 - 1000.0) as i16).collect();
            let spline = coefficients(&volume(dims, Samples::I16(samples.clone())));
            let Samples::F32(c) = spline.samples() else { panic!() };
            let at = |p: [i32; 3]| {
                let [x, y, z] = std::array::from_fn(|a| p[a].clamp(0, dims[a] as i32 - 1) as usize);
                f64::from(c[(z * dims[1] + y) * dims[0] + x])
            };
            for (n, sample) in samples.iter().enumerate() {
                let p = [n % dims[0], n / dims[0] % dims[1], n / (dims[0] * dims[1])].map(|p| p as i32);
                let weight = |o: i32| if o == 0 { 4.0 } else { 1.0 };
                let offsets = (0..27).map(|m| [m % 3 - 1, m / 3 % 3 - 1, m / 9 - 1]);
                let sum: f64 = offsets.map(|o| weight(o[0]) * weight(o[1]) * weight(o[2]) * at([0, 1, 2].map(|a| p[a] + o[a]))).sum();
                assert!((sum / 216.0 - f64::from(*sample)).abs() < 5e-3, "{dims:?} {p:?}: {} {sample}", sum / 216.0);
            }
        }
    }

    #[test]
    fn the_hull_holds_every_coefficient_of_a_cell() {
        // Fails if a neighbour or a border is left out: a hole in the surface.
        let mut random = Random(13);
        let dims = [6, 5, 4];
        let c: Vec<f32> = (0..120).map(|_| random.unit() as f32).collect();
        for sign in [1.0, -1.0] {
            let hull = hull(&c, dims, sign);
            for (n, found) in hull.iter().enumerate() {
                let p = [n % 6, n / 6 % 5, n / 30];
                let near = (0..120_usize).filter(|m| [m % 6, m / 6 % 5, m / 30].iter().zip(p).all(|(a, b)| a.abs_diff(b) <= 1));
                let expected = near.map(|m| sign * c[m]).fold(f32::NEG_INFINITY, f32::max);
                assert_eq!(sign * found, expected, "{p:?}");
            }
        }
    }
}
