//! Minimum and maximum of every brick of 8³ cells, so that rays and transfer functions skip what cannot matter.

use crate::samples::Sample;
use rayon::prelude::*;

/// Cells along one side of a range brick.
pub const BRICK: usize = 8;

/// The range of each brick of 8³ cells. A brick's range covers its 9³ samples: the layer it shares with the next brick
/// counts for both, as the interpolant of its last cells uses it.
#[derive(Clone, Debug, PartialEq)]
pub struct RangeBricks {
    dims: [usize; 3],
    ranges: Vec<[f32; 2]>,
}

impl RangeBricks {
    /// Ranges over `samples` of a grid of `dims`, i fastest. A grid without cells has no bricks.
    pub fn build<T: Sample>(samples: &[T], dims: [usize; 3]) -> Self {
        let bricks = dims.map(|n| (n - 1).div_ceil(BRICK));
        let [bx, by, _] = bricks;
        let mut ranges = vec![[0.0; 2]; bricks.iter().product()];
        if !ranges.is_empty() {
            ranges.par_chunks_mut(bx * by).enumerate().for_each(|(z, layer)| fill_layer(samples, dims, z, bx, layer));
        }
        Self { dims: bricks, ranges }
    }

    /// Bricks along i, j and k.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// The ranges `[min, max]` in sample units, i fastest.
    pub fn ranges(&self) -> &[[f32; 2]] {
        &self.ranges
    }

    /// Memory that the ranges take.
    pub fn bytes(&self) -> usize {
        size_of_val(self.ranges.as_slice())
    }
}

fn fill_layer<T: Sample>(samples: &[T], dims: [usize; 3], z: usize, bx: usize, layer: &mut [[f32; 2]]) {
    let [nx, ny, nz] = dims;
    let last = |brick: usize, n: usize| (brick * BRICK + BRICK).min(n - 1);
    let lower = |a: T, b: T| if b < a { b } else { a };
    let higher = |a: T, b: T| if b > a { b } else { a };
    for (y, bricks) in layer.chunks_mut(bx).enumerate() {
        // First all rows into one, side by side, then along it.
        let first = (z * BRICK * ny + y * BRICK) * nx;
        let mut lows = samples[first..first + nx].to_vec();
        let mut highs = lows.clone();
        for k in z * BRICK..=last(z, nz) {
            for j in y * BRICK..=last(y, ny) {
                let row = &samples[(k * ny + j) * nx..][..nx];
                lows.iter_mut().zip(row).for_each(|(low, &s)| *low = lower(*low, s));
                highs.iter_mut().zip(row).for_each(|(high, &s)| *high = higher(*high, s));
            }
        }
        for (x, range) in bricks.iter_mut().enumerate() {
            let reach = x * BRICK..=last(x, nx);
            let low = lows[reach.clone()].iter().copied().reduce(lower);
            let high = highs[reach].iter().copied().reduce(higher);
            *range = [low, high].map(|v| v.expect("a brick has samples").to_f32());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shared_layer_counts_for_both_bricks() {
        // Fails if a brick forgets its ninth layer, or a short last brick reads past the end.
        let dims = [18, 9, 2];
        let mut samples = vec![0_i16; 18 * 9 * 2];
        samples[8] = 7; // (8, 0, 0) lies on the face between bricks 0 and 1
        samples[17] = -3; // (17, 0, 0): last sample
        let bricks = RangeBricks::build(&samples, dims);
        assert_eq!(bricks.dims(), [3, 1, 1]);
        assert_eq!(bricks.ranges(), [[0.0, 7.0], [0.0, 7.0], [-3.0, 0.0]]);
    }

    #[test]
    fn a_flat_grid_has_no_bricks() {
        assert_eq!(RangeBricks::build(&[1_u8, 2], [2, 1, 1]).ranges(), &[] as &[[f32; 2]]);
    }
}
