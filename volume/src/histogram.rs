//! How often each value occurs, and the threshold that separates two classes of them.

use crate::samples::{Sample, Samples};
use crate::with_samples;
use rayon::prelude::*;

/// Counts over equal bins of the sample range.
#[derive(Clone, Debug, PartialEq)]
pub struct Histogram {
    /// Smallest and largest sample.
    pub range: [f64; 2],
    /// Counts; bin b covers `range[0] + (b .. b+1)/bins·(range[1] − range[0])`, the last one closed.
    pub counts: Vec<u64>,
}

/// Otsu's split of a histogram into two classes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Otsu {
    /// The threshold, in the histogram's units.
    pub threshold: f64,
    /// Mean of the class below it.
    pub mean_below: f64,
    /// Mean of the class above it.
    pub mean_above: f64,
}

impl Histogram {
    /// The histogram of `samples` over their own `range`, in sample units.
    pub fn build(samples: &Samples, range: [f64; 2], bins: usize) -> Self {
        let counts = with_samples!(samples, s => count(s, range, bins));
        Self { range, counts }
    }

    /// Counts `sample`, which lies within the range, `count` times more.
    pub fn add(&mut self, sample: f64, count: u64) {
        let bin = bin(sample, self.range, self.counts.len());
        self.counts[bin] += count;
    }

    /// Value at the middle of bin `b`.
    pub fn centre(&self, b: usize) -> f64 {
        self.range[0] + (b as f64 + 0.5) / self.counts.len() as f64 * (self.range[1] - self.range[0])
    }

    /// The split that maximises the variance between its two classes (Otsu 1979, eq. 18); `None` when all samples are equal.
    /// A run of empty bins scores the same all along: its middle is taken.
    pub fn otsu(&self) -> Option<Otsu> {
        let total: u64 = self.counts.iter().sum();
        let sum: f64 = self.counts.iter().enumerate().map(|(b, &c)| c as f64 * self.centre(b)).sum();
        let (mut below, mut sum_below) = (0_u64, 0.0);
        let mut best: Option<(f64, usize, usize, Otsu)> = None;
        for (b, &count) in self.counts.iter().enumerate().take(self.counts.len().saturating_sub(1)) {
            below += count;
            sum_below += count as f64 * self.centre(b);
            let above = total - below;
            if below == 0 || above == 0 {
                continue;
            }
            let (mean_below, mean_above) = (sum_below / below as f64, (sum - sum_below) / above as f64);
            let variance = below as f64 * above as f64 * (mean_above - mean_below).powi(2);
            let edge = |b: usize| self.range[0] + (b + 1) as f64 / self.counts.len() as f64 * (self.range[1] - self.range[0]);
            match &mut best {
                Some((top, first, last, otsu)) if count == 0 && *last + 1 == b && variance >= *top => {
                    *last = b;
                    otsu.threshold = (edge(*first) + edge(b)) / 2.0;
                }
                Some((top, ..)) if variance <= *top => {}
                _ => best = Some((variance, b, b, Otsu { threshold: edge(b), mean_below, mean_above })),
            }
        }
        best.map(|(.., otsu)| otsu)
    }
}

fn bin(sample: f64, range: [f64; 2], bins: usize) -> usize {
    let width = range[1] - range[0];
    let scale = if width > 0.0 { bins as f64 / width } else { 0.0 };
    (((sample - range[0]) * scale) as usize).min(bins - 1)
}

fn count<T: Sample>(samples: &[T], range: [f64; 2], bins: usize) -> Vec<u64> {
    let chunk = |part: &[T]| if T::NAME == f32::NAME { count_floats(part, range, bins) } else { count_whole(part, range, bins) };
    let add = |mut a: Vec<u64>, b: Vec<u64>| {
        a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        a
    };
    samples.par_chunks(CHUNK).map(chunk).reduce(|| vec![0; bins], add)
}

/// Samples that are counted at a time: few enough that 32 bits count them.
const CHUNK: usize = 1 << 20;

fn count_floats<T: Sample>(part: &[T], range: [f64; 2], bins: usize) -> Vec<u64> {
    let mut binned = vec![0; bins];
    part.iter().for_each(|s| binned[bin(s.to_f64(), range, bins)] += 1);
    binned
}

/// Whole numbers have few values, which are counted first and put into bins then.
fn count_whole<T: Sample>(part: &[T], range: [f64; 2], bins: usize) -> Vec<u64> {
    const LANES: usize = 4;
    let (low, cells) = (range[0] as i32, (range[1] - range[0]) as usize + 1);
    let mut counts = vec![0_u32; LANES * cells];
    let (a, rest) = counts.split_at_mut(cells);
    let (b, rest) = rest.split_at_mut(cells);
    let (c, d) = rest.split_at_mut(cells);
    // Samples lie within the range, and a chunk is too short for 32 bits to overflow: nothing here wraps.
    let add = |counts: &mut [u32], s: T| {
        let count = &mut counts[s.to_i32().wrapping_sub(low) as usize];
        *count = count.wrapping_add(1);
    };
    // Neighbours are often equal; counted in turn by several counters they do not wait for each other. Counters of many values leave the
    // cache, and their neighbours differ.
    let (fours, rest) = if cells <= 1 << 13 { part.as_chunks::<LANES>() } else { (&[][..], part) };
    for &[s, t, u, v] in fours {
        add(a, s);
        add(b, t);
        add(c, u);
        add(d, v);
    }
    rest.iter().for_each(|&s| add(a, s));
    let mut binned = vec![0; bins];
    for cell in 0..cells {
        let count = [&*a, b, c, d].iter().map(|lane| u64::from(lane[cell])).sum::<u64>();
        if count > 0 {
            binned[bin(range[0] + cell as f64, range, bins)] += count;
        }
    }
    binned
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn otsu_splits_two_heaps_between_them() {
        // Fails if a class mean or the empty stretch between the heaps is mishandled.
        let samples = Samples::I16([vec![-1000; 300], vec![-990; 100], vec![1000; 50]].concat());
        let otsu = Histogram::build(&samples, [-1000.0, 1000.0], 1024).otsu().unwrap();
        assert!((otsu.threshold - 5.0).abs() < 4.0, "{otsu:?}");
        assert!((otsu.mean_below + 997.5).abs() < 2.0 && (otsu.mean_above - 1000.0).abs() < 2.0, "{otsu:?}");
    }

    #[test]
    fn every_sample_is_counted_once() {
        // Fails if a lane, the last few samples of a chunk or an end of the range is lost, whatever the type.
        let n = CHUNK + 7;
        let of = |wide: bool| move |n: usize| (n.wrapping_mul(2_654_435_761) >> 7) % if wide { 60_000 } else { 200 };
        for wide in [false, true] {
            let range = [0.0, if wide { 59_999.0 } else { 199.0 }];
            let mut expected = vec![0_u64; 64];
            (0..n).map(of(wide)).for_each(|v| expected[bin(v as f64, range, 64)] += 1);
            let whole = Samples::U16((0..n).map(|n| of(wide)(n) as u16).collect());
            let floats = Samples::F32((0..n).map(|n| of(wide)(n) as f32).collect());
            for samples in [whole, floats] {
                assert_eq!(Histogram::build(&samples, range, 64).counts, expected);
            }
        }
    }

    #[test]
    fn equal_samples_have_no_split() {
        let samples = Samples::U8(vec![3; 10]);
        assert_eq!(Histogram::build(&samples, [3.0, 3.0], 16).otsu(), None);
    }
}
