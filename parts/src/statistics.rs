//! What parts are: how large, where, of what values.

use crate::labels::Labels;
use bregma_field::{Sample, Store, Volume, with_block};
use glam::USizeVec3;
use rayon::prelude::*;
use serde::Serialize;

/// What a part is, by its samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Statistics {
    /// Samples that it has.
    pub samples: u64,
    /// Their number times the volume of a voxel. How much bone there is between surfaces is another question, which `bregma-measure` answers.
    pub volume_mm3: f64,
    /// Mean of the scan's values at them; `None` where there are none.
    pub mean: Option<f64>,
    /// The first and the last sample along i, j and k; `None` where there are none.
    pub extent: Option<[[usize; 3]; 2]>,
}

/// What is counted of a part.
#[derive(Clone, Copy)]
struct Count {
    samples: u64,
    sum: f64,
    low: [usize; 3],
    high: [usize; 3],
}

impl Count {
    const NONE: Self = Self { samples: 0, sum: 0.0, low: [usize::MAX; 3], high: [0; 3] };

    fn add(&mut self, other: &Self) {
        self.samples += other.samples;
        self.sum += other.sum;
        self.low = std::array::from_fn(|a| self.low[a].min(other.low[a]));
        self.high = std::array::from_fn(|a| self.high[a].max(other.high[a]));
    }
}

/// Stretches of slices that are counted side by side: always as many, so that sums are the same whatever threads there are.
const SLABS: usize = 16;

impl Labels {
    /// What each of the parts is, in their order. `volume` is the scan that they are labels of, on the same grid of samples.
    pub fn statistics(&self, volume: &Volume) -> Vec<Statistics> {
        assert_eq!(self.grid().dims(), volume.grid().dims(), "labels are those of their scan");
        let counts = with_block!(Store::of(volume).whole(), b => self.counts(b.onward([0; 3])));
        let voxel_mm3 = volume.grid().index_to_world().matrix3.determinant().abs();
        let of = |count: Count| {
            let is_there = count.samples > 0;
            Statistics {
                samples: count.samples,
                volume_mm3: count.samples as f64 * voxel_mm3,
                mean: is_there.then(|| volume.value_of(count.sum / count.samples as f64)),
                extent: is_there.then_some([count.low, count.high]),
            }
        };
        self.parts().iter().map(|part| of(counts[usize::from(part.number)])).collect()
    }

    /// Of each number from 0 on.
    fn counts<T: Sample>(&self, samples: &[T]) -> Vec<Count> {
        let [nx, ny, nz] = self.grid().dims();
        let most = self.parts().last().map_or(0, |part| usize::from(part.number));
        let thick = nz.div_ceil(SLABS);
        let slab = |first: usize| {
            let (mut counts, mut numbers) = (vec![Count::NONE; most + 1], vec![0; nx]);
            for row in first * ny..(first + thick).min(nz) * ny {
                self.numbers().read(USizeVec3::new(0, row % ny, row / ny), &mut numbers);
                for (i, (&number, sample)) in numbers.iter().zip(&samples[row * nx..]).enumerate() {
                    if number > 0 {
                        let at = [i, row % ny, row / ny];
                        counts[usize::from(number)].add(&Count { samples: 1, sum: sample.to_f64(), low: at, high: at });
                    }
                }
            }
            counts
        };
        let firsts: Vec<usize> = (0..nz).step_by(thick).collect();
        let slabs: Vec<Vec<Count>> = firsts.into_par_iter().map(slab).collect();
        let mut all = vec![Count::NONE; most + 1];
        slabs.iter().for_each(|slab| all.iter_mut().zip(slab).for_each(|(all, count)| all.add(count)));
        all
    }
}
