//! Where samples lie: by brick, each a window onto an array.

use bregma_volume::{BRICK, ReadSamples, Sample, Samples, Volume};

/// The samples of a scan, asked for by brick. All of a scan in memory are here; those of one that is read as it is needed come later.
#[derive(Clone, Copy, Debug)]
pub struct Store<'a> {
    samples: &'a Samples,
    dims: [usize; 3],
}

impl<'a> Store<'a> {
    /// Of a volume.
    pub fn of(volume: &'a Volume) -> Self {
        Self::new(volume.samples(), volume.grid().dims())
    }

    /// Of samples that were made, i fastest, for a grid of `dims`.
    pub fn new(samples: &'a Samples, dims: [usize; 3]) -> Self {
        Self { samples, dims }
    }

    /// Samples along i, j and k.
    pub fn dims(self) -> [usize; 3] {
        self.dims
    }

    /// The samples at the corners of the 8³ cells of a range brick and, where the grid has them, those beside: from one before its first to
    /// one behind its last, as far as gradients at its cells reach. `None`: not here yet. Who draws goes on without them and asks again;
    /// who measures waits, since a length must not depend on what is loaded. A scan in memory has them all, and nothing is copied.
    pub fn block(self, brick: [usize; 3]) -> Option<AnyBlock<'a>> {
        let first: [usize; 3] = std::array::from_fn(|a| (brick[a] * BRICK).saturating_sub(1));
        let last: [usize; 3] = std::array::from_fn(|a| (brick[a] * BRICK + BRICK + 1).min(self.dims[a] - 1));
        Some(self.window(first, last))
    }

    /// All samples as one block, which only a scan in memory has: for what takes it as a whole, as a texture or a filter along its axes does,
    /// or asks for it sample by sample in loops that have no time to ask for bricks.
    pub fn whole(self) -> AnyBlock<'a> {
        self.window([0; 3], self.dims.map(|n| n - 1))
    }

    fn window(self, first: [usize; 3], last: [usize; 3]) -> AnyBlock<'a> {
        let strides = [self.dims[0], self.dims[0] * self.dims[1]];
        let number = |[i, j, k]: [usize; 3]| i + strides[0] * j + strides[1] * k;
        let (first, end) = (number(first), number(last) + 1);
        match self.samples {
            Samples::U8(s) => AnyBlock::U8(Block { samples: &s[first..end], first, strides }),
            Samples::I16(s) => AnyBlock::I16(Block { samples: &s[first..end], first, strides }),
            Samples::U16(s) => AnyBlock::U16(Block { samples: &s[first..end], first, strides }),
            Samples::F32(s) => AnyBlock::F32(Block { samples: &s[first..end], first, strides }),
        }
    }
}

/// A block in the type of its scan's samples; [`with_block`](crate::with_block) takes it as what it is.
#[derive(Clone, Copy, Debug)]
pub enum AnyBlock<'a> {
    /// Unsigned bytes.
    U8(Block<'a, u8>),
    /// Signed 16-bit integers.
    I16(Block<'a, i16>),
    /// Unsigned 16-bit integers.
    U16(Block<'a, u16>),
    /// Float32.
    F32(Block<'a, f32>),
}

/// Runs `$body` with `$b` bound to the typed block inside an [`AnyBlock`], compiled once for each type.
#[macro_export]
macro_rules! with_block {
    ($block:expr, $b:ident => $body:expr) => {
        match $block {
            $crate::AnyBlock::U8($b) => $body,
            $crate::AnyBlock::I16($b) => $body,
            $crate::AnyBlock::U16($b) => $body,
            $crate::AnyBlock::F32($b) => $body,
        }
    };
}

/// A box of samples as a slice with strides: sample (i, j, k) of the grid is number `i + strides[0]·j + strides[1]·k − first` of the slice.
/// One that lies outside the box is another one, or a panic.
#[derive(Clone, Copy, Debug)]
pub struct Block<'a, T> {
    samples: &'a [T],
    first: usize,
    strides: [usize; 2],
}

impl<'a, T: Sample> Block<'a, T> {
    #[inline(always)]
    fn number(&self, [i, j, k]: [usize; 3]) -> usize {
        i + self.strides[0] * j + self.strides[1] * k - self.first
    }

    /// Sample (i, j, k) of the grid.
    #[inline(always)]
    pub fn at(&self, index: [usize; 3]) -> T {
        self.samples[self.number(index)]
    }

    /// The samples from one on: first those behind it along i, then what lies behind these in the slice.
    #[inline(always)]
    pub fn onward(&self, index: [usize; 3]) -> &'a [T] {
        &self.samples[self.number(index)..]
    }

    /// How many samples lie between one and its neighbour along j and along k.
    #[inline(always)]
    pub fn strides(&self) -> [usize; 2] {
        self.strides
    }

    /// The samples at the corners of a cell, by its lowest; corner x + 2y + 4z is at (x, y, z).
    #[inline(always)]
    pub fn corners(&self, cell: [usize; 3]) -> [T; 8] {
        let (base, [row, layer]) = (self.number(cell), self.strides);
        let pair = |n: usize| [self.samples[n], self.samples[n + 1]];
        let [[a, b], [c, d], [e, f], [g, h]] = [pair(base), pair(base + row), pair(base + layer), pair(base + layer + row)];
        [a, b, c, d, e, f, g, h]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_has_what_its_cells_and_their_gradients_need() {
        // Fails if a block ends before the sample beside its last, begins behind the one before its first, or a stride is another's.
        for dims in [[18, 9, 2], [8, 26, 17], [1, 5, 30]] {
            let samples = Samples::U16((0..dims.iter().product::<usize>() as u16).collect());
            let store = Store::new(&samples, dims);
            let number = |[i, j, k]: [usize; 3]| ((k * dims[1] + j) * dims[0] + i) as u16;
            let AnyBlock::U16(whole) = store.whole() else { panic!("the samples are u16") };
            let bricks = dims.map(|n: usize| (n - 1).div_ceil(BRICK).max(1));
            for n in 0..bricks.iter().product() {
                let brick = [n % bricks[0], n / bricks[0] % bricks[1], n / (bricks[0] * bricks[1])];
                let Some(AnyBlock::U16(block)) = store.block(brick) else { panic!("a scan in memory has all its bricks") };
                let reach = |a: usize| (brick[a] * BRICK).saturating_sub(1)..(brick[a] * BRICK + BRICK + 2).min(dims[a]);
                for (k, j, i) in reach(2).flat_map(|k| reach(1).flat_map(move |j| reach(0).map(move |i| (k, j, i)))) {
                    assert_eq!([block.at([i, j, k]), whole.at([i, j, k])], [number([i, j, k]); 2], "{dims:?} {brick:?}");
                    assert_eq!(block.onward([i, j, k])[0], number([i, j, k]));
                    if i + 1 < reach(0).end && j + 1 < reach(1).end && k + 1 < reach(2).end {
                        let corner = |c: usize| number([i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)]);
                        assert_eq!(block.corners([i, j, k]), std::array::from_fn(corner));
                    }
                }
            }
        }
    }
}
