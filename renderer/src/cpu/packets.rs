//! The pixels of a picture, sixteen that lie together at a time.

use crate::camera::PixelAffine;
use crate::lanes::{Doubles, Floats, LANES, Mask, axes};
use crate::skip::BLOCK;
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// Pixels across and down a packet.
const SIDE: u32 = 4;
const _: () = assert!((SIDE * SIDE) as usize == LANES);

/// Sixteen pixels of a band that lie together; some may lie outside.
#[derive(Clone, Copy)]
pub(super) struct Packet {
    pub x0: u32,
    /// In the band.
    y0: u32,
    width: u32,
    height: u32,
}

/// The packets of a band, block by block.
pub(super) fn packets(width: u32, height: u32) -> impl Iterator<Item = Packet> {
    let block = |x: u32| (0..BLOCK * BLOCK / LANES as u32).map(move |n| [x + n % 2 * SIDE, n / 2 * SIDE]);
    let corners = (0..width).step_by(BLOCK as usize).flat_map(block).filter(move |[x, y]| *x < width && *y < height);
    corners.map(move |[x0, y0]| Packet { x0, y0, width: SIDE.min(width - x0), height: SIDE.min(height - y0) })
}

impl Packet {
    /// Its pixels, where the band begins at row `y0` of the picture.
    #[inline(always)]
    pub fn pixels<S: Simd>(&self, simd: S, y0: u32) -> Pixels<S> {
        let (mut x, mut y, mut bits) = ([0.0; LANES], [0.0; LANES], 0);
        for lane in 0..LANES as u32 {
            let [dx, dy] = [lane % SIDE, lane / SIDE];
            (x[lane as usize], y[lane as usize]) = ((self.x0 + dx) as f32, (y0 + self.y0 + dy) as f32);
            bits |= u64::from(dx < self.width && dy < self.height) << lane;
        }
        let doubles = |v| Doubles::of(Floats::load_array(simd, v));
        Pixels { x: doubles(x), y: doubles(y), inside: Mask::from_bitmask(simd, bits) }
    }

    /// The pixel of a lane in the band.
    pub fn index(&self, lane: usize, width: u32) -> usize {
        let lane = lane as u32;
        ((self.y0 + lane / SIDE) * width + self.x0 + lane % SIDE) as usize
    }
}

/// The pixels of a packet.
pub(super) struct Pixels<S: Simd> {
    /// Columns and rows of the picture.
    pub x: Doubles<S>,
    pub y: Doubles<S>,
    /// Which lie in the picture.
    pub inside: Mask<S>,
}

impl<S: Simd> Pixels<S> {
    /// A number from 0 to 1 for each that looks like chance.
    #[inline(always)]
    pub fn noise(&self, simd: S) -> Floats<S> {
        let (x, y) = (self.x.to_floats().to_array(), self.y.to_floats().to_array());
        Floats::load_array(simd, std::array::from_fn(|lane| noise_at(x[lane] as u32, y[lane] as u32)))
    }

    /// What moves with the pixel, at each.
    #[inline(always)]
    pub fn at(&self, simd: S, of: &PixelAffine) -> [Doubles<S>; 3] {
        let splat = |v| Doubles::splat(simd, v);
        axes!(a => splat(of.base[a]) + self.x * splat(of.per_x[a]) + self.y * splat(of.per_y[a]))
    }
}

/// The factors and the sum of a permuted congruential generator (O'Neill 2014, PCG RXS M XS 32).
pub(crate) const PCG: [u32; 3] = [747_796_405, 2_891_336_453, 277_803_737];

/// A number from 0 to 1 that looks like chance, for each pixel the same in every frame (O'Neill 2014, PCG).
fn noise_at(x: u32, y: u32) -> f32 {
    let state = (y << 16 | x).wrapping_mul(PCG[0]).wrapping_add(PCG[1]);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(PCG[2]);
    // 24 bits, which float32 holds.
    ((word >> 22 ^ word) >> 8) as f32 / 16_777_216.0
}
