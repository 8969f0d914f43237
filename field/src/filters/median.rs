//! Medians of windows, many samples at once: bit by bit, from the highest on, each is the largest number that at most half of its window is below.
//! That asks for comparisons alone, which processors make of many samples in one step.

use bregma_volume::{Cancelled, Progress, Sample, Samples};
use rayon::prelude::*;

/// Medians of all samples within `radius` along each axis.
pub fn medians<T: Sample>(samples: &[T], dims: [usize; 3], radius: usize, progress: &Progress) -> Result<Samples, Cancelled> {
    /// All samples by keys in their order, and back.
    macro_rules! by_keys {
        ($select:ident, $to:expr, $from:expr, $kind:ident) => {
            Samples::$kind(windows(samples, dims, radius, progress, $to, $from, $select)?)
        };
    }
    Ok(match T::NAME {
        "u8" => by_keys!(select_16, |v: T| v.to_i32() as i16, |key: i16| key as u8, U8),
        "i16" => by_keys!(select_16, |v: T| v.to_i32() as i16, |key: i16| key, I16),
        "u16" => by_keys!(select_16, |v: T| (v.to_i32() - 0x8000) as i16, |key: i16| (i32::from(key) + 0x8000) as u16, U16),
        _ => by_keys!(select_32, |v: T| float_key(v.to_f32()), |key: i32| f32::from_bits(float_bits(key)), F32),
    })
}

/// A whole number in the order of floats: those below 0 have their bits turned round.
fn float_key(value: f32) -> i32 {
    let bits = value.to_bits() as i32;
    if bits < 0 { bits ^ i32::MAX } else { bits }
}

fn float_bits(key: i32) -> u32 {
    (if key < 0 { key ^ i32::MAX } else { key }) as u32
}

fn windows<T: Sample, K: Copy + Default + Send, O: Copy + Default + Send>(
    samples: &[T],
    dims: [usize; 3],
    radius: usize,
    progress: &Progress,
    to_key: impl Fn(T) -> K + Sync,
    from_key: impl Fn(K) -> O + Sync,
    select: impl Fn(&[Vec<K>], usize, &mut [K]) + Sync,
) -> Result<Vec<O>, Cancelled> {
    let [nx, ny, nz] = dims;
    progress.begin((ny * nz) as u64);
    let near = |n: usize, count: usize| (0..=2 * radius).map(move |m| (n + m).saturating_sub(radius).min(count - 1));
    let mut out = vec![O::default(); samples.len()];
    out.par_chunks_mut(nx).enumerate().try_for_each_init(
        || (vec![vec![]; (2 * radius + 1).pow(2)], vec![K::default(); nx]),
        |(window, medians): &mut (Vec<Vec<K>>, Vec<K>), (row, out)| {
            let rows = near(row / ny, nz).flat_map(|k| near(row % ny, ny).map(move |j| j + ny * k));
            for (keys, row) in window.iter_mut().zip(rows) {
                let row = &samples[row * nx..][..nx];
                keys.clear();
                keys.resize(radius, to_key(row[0]));
                keys.extend(row.iter().map(|&v| to_key(v)));
                keys.resize(nx + 2 * radius, to_key(row[nx - 1]));
            }
            select(window, radius, medians);
            out.iter_mut().zip(medians.iter()).for_each(|(v, key)| *v = from_key(*key));
            progress.advance(1)
        },
    )?;
    Ok(out)
}

macro_rules! select {
    ($name:ident, $key:ty) => {
        /// For each sample of a row the median of its window, whose padded rows are `window`.
        fn $name(window: &[Vec<$key>], radius: usize, medians: &mut [$key]) {
            let half = (window.len() * (2 * radius + 1) / 2) as $key;
            let count = medians.len();
            let mut below = vec![0 as $key; count];
            let mut tried = vec![0 as $key; count];
            medians.fill(<$key>::MIN);
            for bit in (0..<$key>::BITS).rev() {
                let more = (1 as $key) << bit;
                tried.iter_mut().zip(medians.iter()).for_each(|(tried, median)| *tried = median.wrapping_add(more));
                below.fill(0);
                for row in window {
                    for away in 0..=2 * radius {
                        let keys = &row[away..][..count];
                        below.iter_mut().zip(keys).zip(&tried).for_each(|((below, key), tried)| *below += <$key>::from(key < tried));
                    }
                }
                medians.iter_mut().zip(&tried).zip(&below).for_each(|((median, tried), below)| {
                    *median = if *below <= half { *tried } else { *median };
                });
            }
        }
    };
}
select!(select_16, i16);
select!(select_32, i32);
