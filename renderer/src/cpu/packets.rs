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
pub(crate) struct Pixels<S: Simd> {
    /// Columns and rows of the picture.
    pub x: Doubles<S>,
    pub y: Doubles<S>,
    /// Which lie in the picture.
    pub inside: Mask<S>,
}

impl<S: Simd> Pixels<S> {
    /// So many of a row, from column `x0` on.
    #[inline(always)]
    pub fn in_row(simd: S, x0: usize, y: u32, count: usize) -> Self {
        let x = std::array::from_fn(|lane| (x0 + lane) as f32);
        let inside = Mask::from_bitmask(simd, (1 << count) - 1);
        Self { x: Doubles::of(Floats::load_array(simd, x)), y: Doubles::splat(simd, f64::from(y)), inside }
    }

    /// What moves with the pixel, at each.
    #[inline(always)]
    pub fn at(&self, simd: S, of: &PixelAffine) -> [Doubles<S>; 3] {
        let splat = |v| Doubles::splat(simd, v);
        axes!(a => splat(of.base[a]) + self.x * splat(of.per_x[a]) + self.y * splat(of.per_y[a]))
    }
}
