//! Samples added up, in two halves whose difference tells the noise.

use super::batch::{CHANNELS, GUIDES};
use super::path::PIXELS;
use super::tone::Toned;
use crate::skip::BLOCK;
use glam::Vec3;
use std::io::{self, Read, Write};

/// Numbers of one half of the sums of a block, where what is seen first begins behind both, and all: as `shaders/path.wgsl` has them.
#[cfg(feature = "gpu")]
pub(crate) const HALF_OF_BLOCK: usize = PIXELS * CHANNELS;
#[cfg(feature = "gpu")]
pub(crate) const GUIDES_OF_BLOCK: usize = 2 * HALF_OF_BLOCK;
#[cfg(feature = "gpu")]
pub(crate) const SUMS_OF_BLOCK: usize = GUIDES_OF_BLOCK + PIXELS * GUIDES;
// A pixel's place in both is the same multiple.
const _: () = assert!(CHANNELS == GUIDES);

/// Of one block of pixels.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct BlockSums {
    /// Of even and of odd samples.
    pub halves: [[[f32; CHANNELS]; PIXELS]; 2],
    pub guides: [[f32; GUIDES]; PIXELS],
    /// Samples of each pixel.
    pub samples: u32,
}

impl BlockSums {
    fn new() -> Self {
        Self { halves: [[[0.0; CHANNELS]; PIXELS]; 2], guides: [[0.0; GUIDES]; PIXELS], samples: 0 }
    }

    /// How many samples the two halves have.
    pub fn of_halves(&self) -> [u32; 2] {
        [self.samples.div_ceil(2), self.samples / 2]
    }

    /// Both halves of a pixel.
    pub fn sum(&self, pixel: usize) -> [f32; CHANNELS] {
        let [a, b] = [&self.halves[0][pixel], &self.halves[1][pixel]];
        std::array::from_fn(|n| a[n] + b[n])
    }

    /// The sum of the squares of what its pixels' halves differ by as they are shown, in 255ths.
    fn squares(&self, toned: &Toned, background: Vec3, is_pixel: impl Fn(usize) -> bool) -> f64 {
        let [even, odd] = self.of_halves();
        let square = |n: usize| {
            let [a, b] = [(&self.halves[0][n], even), (&self.halves[1][n], odd)].map(|(sums, count)| toned.shown(sums, count, background));
            f64::from((255.0 * (a - b)).length_squared())
        };
        (0..PIXELS).filter(|n| is_pixel(*n)).map(square).sum()
    }
}

/// Samples of a picture so far.
#[derive(Clone, Debug, PartialEq)]
pub struct Exposed {
    pub(super) size: [u32; 2],
    pub(super) blocks: Vec<BlockSums>,
    /// Of each block, as far as its samples go: 255ths; infinite below two samples.
    pub(super) noise: Vec<f32>,
}

/// A file that does not hold what was kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("it does not hold the samples of a picture of this size")]
pub struct NotExposed;

impl Exposed {
    /// Of no sample yet.
    pub fn new([width, height]: [u32; 2]) -> Self {
        let count = width.div_ceil(BLOCK) as usize * height.div_ceil(BLOCK) as usize;
        Self { size: [width, height], blocks: vec![BlockSums::new(); count], noise: vec![f32::INFINITY; count] }
    }

    /// Pixels across and down.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Samples of the pixels that have most.
    pub fn samples(&self) -> u32 {
        self.blocks.iter().map(|block| block.samples).max().unwrap_or(0)
    }

    /// Samples of all pixels together.
    pub fn count(&self) -> u64 {
        (0..self.blocks.len()).map(|n| u64::from(self.blocks[n].samples) * self.pixels_of(n)).sum()
    }

    /// The root mean square noise of the picture, 255ths of what a display shows: half of what its two halves differ by.
    pub fn noise(&self) -> f64 {
        let squares = self.noise.iter().zip(0..).map(|(noise, n)| f64::from(*noise).powi(2) * self.pixels_of(n) as f64);
        (squares.sum::<f64>() / (f64::from(self.size[0]) * f64::from(self.size[1]))).sqrt()
    }

    /// The same of each block of 8 × 8 pixels, row by row; infinite below two samples.
    pub fn noise_of_blocks(&self) -> &[f32] {
        &self.noise
    }

    /// The corner of block number `n` in the picture.
    pub(super) fn corner(&self, n: usize) -> [u32; 2] {
        let across = self.size[0].div_ceil(BLOCK);
        [n as u32 % across * BLOCK, n as u32 / across * BLOCK]
    }

    fn pixels_of(&self, n: usize) -> u64 {
        let [x, y] = self.corner(n);
        u64::from((self.size[0] - x).min(BLOCK)) * u64::from((self.size[1] - y).min(BLOCK))
    }

    /// Whether pixel number `pixel` of a block lies in the picture.
    pub(super) fn has([width, height]: [u32; 2], [x0, y0]: [u32; 2], pixel: usize) -> bool {
        x0 + pixel as u32 % BLOCK < width && y0 + pixel as u32 / BLOCK < height
    }

    /// The noise of a block: its halves' difference over two, root mean square over pixels and channels.
    pub(super) fn noise_of(size: [u32; 2], corner: [u32; 2], block: &BlockSums, toned: &Toned, background: Vec3) -> f32 {
        if block.samples < 2 {
            return f32::INFINITY;
        }
        let is_pixel = |n: usize| Self::has(size, corner, n);
        let values = 3 * (0..PIXELS).filter(|n| is_pixel(*n)).count();
        ((block.squares(toned, background, is_pixel) / values as f64).sqrt() / 2.0) as f32
    }

    /// The block and the number in it of a pixel.
    pub(super) fn at(&self, x: u32, y: u32) -> (&BlockSums, usize) {
        let across = self.size[0].div_ceil(BLOCK);
        (&self.blocks[(y / BLOCK * across + x / BLOCK) as usize], (y % BLOCK * BLOCK + x % BLOCK) as usize)
    }

    /// Writes all of it; [`Exposed::read`] reads that.
    pub fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        let mut word = |bits: u32| out.write_all(&bits.to_le_bytes());
        self.size.iter().try_for_each(|n| word(*n))?;
        self.noise.iter().try_for_each(|v| word(v.to_bits()))?;
        for block in &self.blocks {
            word(block.samples)?;
            let sums = block.halves.as_flattened().as_flattened().iter().chain(block.guides.as_flattened());
            sums.into_iter().try_for_each(|v| word(v.to_bits()))?;
        }
        Ok(())
    }

    /// What [`Exposed::write`] wrote of a picture of such a size, to the end of what is read.
    pub fn read(size: [u32; 2], from: &mut dyn Read) -> Result<Self, NotExposed> {
        let mut exposed = Self::new(size);
        let mut word = || {
            let mut bytes = [0; 4];
            from.read_exact(&mut bytes).map_err(|_| NotExposed).map(|()| u32::from_le_bytes(bytes))
        };
        if [word()?, word()?] != size {
            return Err(NotExposed);
        }
        for v in &mut exposed.noise {
            *v = f32::from_bits(word()?);
        }
        for block in &mut exposed.blocks {
            block.samples = word()?;
            for v in block.halves.as_flattened_mut().as_flattened_mut().iter_mut().chain(block.guides.as_flattened_mut()) {
                *v = f32::from_bits(word()?);
            }
        }
        if word().is_ok() { Err(NotExposed) } else { Ok(exposed) }
    }
}
