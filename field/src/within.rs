//! A scan of which only a part is left.

use crate::solid::Solid;
use crate::store::{AnyBlock, Store};
use bregma_volume::{Sample, Samples, Volume};
use rayon::prelude::*;

/// `volume` with its lowest value, or the highest where a negative slope turns values round, at all samples outside of a solid on its samples: what
/// lies within is as it was, cells that the solid's surface passes aside.
///
/// Where that surface passes through no cell that bone reaches, as between islands more than two voxels apart, so is the bone's surface to the last bit;
/// where it cuts bone, or passes nearer, surfaces there are off by up to a voxel.
///
/// # Panics
/// Where the solid was made for a grid of another size.
pub fn within(volume: &Volume, solid: &Solid) -> Volume {
    assert_eq!(solid.dims(), volume.grid().dims(), "a solid on the samples of its scan");
    let is_turned = volume.slope() < 0.0;
    let samples = match Store::of(volume).whole() {
        AnyBlock::U8(b) => Samples::U8(kept(b.onward([0; 3]), solid, is_turned)),
        AnyBlock::I16(b) => Samples::I16(kept(b.onward([0; 3]), solid, is_turned)),
        AnyBlock::U16(b) => Samples::U16(kept(b.onward([0; 3]), solid, is_turned)),
        AnyBlock::F32(b) => Samples::F32(kept(b.onward([0; 3]), solid, is_turned)),
    };
    // There is one for each sample, and each is one of the scan's.
    volume.with_samples(samples).expect("a volume's own samples are a volume")
}

fn kept<T: Sample>(samples: &[T], solid: &Solid, is_turned: bool) -> Vec<T> {
    let [nx, ny, _] = solid.dims();
    let lower = |a: T, b: T| if (b < a) != is_turned { b } else { a };
    let mut kept = samples.to_vec();
    // A grid has samples.
    let Some(outside) = samples.par_iter().copied().reduce_with(lower) else { return kept };
    kept.par_chunks_mut(nx).enumerate().for_each(|(row, samples)| {
        for (x, sample) in samples.iter_mut().enumerate() {
            if solid.units_at([x, row % ny, row / ny]) < 0 {
                *sample = outside;
            }
        }
    });
    kept
}
