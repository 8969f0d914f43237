//! Which cells of a brick can hold the surface: one bit for each, so that a ray passes the others without reading a sample.

use super::occupancy::Occupancy;
use super::{DistanceMap, Walked};
use crate::InstructionSet;
use crate::lanes::{Floats, LANES, Mask as LaneMask};
use crate::roots::inside;
use bregma_field::solid::Side;
use bregma_field::{BRICK, Block, RangeBricks, Sample, Solid, Store, with_block};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, dispatch};
use rayon::prelude::*;

/// Numbers of a mask.
pub(crate) const WORDS: usize = 2 * BRICK;

/// Cells of a brick, two numbers for each layer: bit 64z + 8y + x of all is cell (x, y, z).
type Mask = [u32; WORDS];

/// Masks of all bricks that can hold the surface.
#[derive(Debug)]
pub(crate) struct CellMasks {
    /// For each brick, i fastest, the number of its mask.
    slots: Vec<u32>,
    masks: Vec<Mask>,
    /// For each mask the box of its cells, see [`box_of`].
    boxes: Vec<u32>,
    exposed: Vec<u32>,
}

impl CellMasks {
    /// The masks of what is walked to of the surface at `level` of the samples of `store`, whose ranges are `bricks`, for those that can hold it.
    pub fn build(
        instructions: InstructionSet,
        (store, bricks): (Store<'_>, &RangeBricks),
        occupancy: &Occupancy,
        [level, sign]: [f32; 2],
        what: &Walked,
    ) -> Self {
        let (occupied, dims) = (occupancy.bricks(), store.dims());
        let mut slots = vec![0; occupancy.is.len()];
        occupied.iter().zip(0..).for_each(|(&brick, slot)| slots[brick as usize] = slot);
        // What lies wholly inside need not be read.
        let is_inside =
            |brick: u32| *what == Walked::Inside && sign * (bricks.ranges()[brick as usize][usize::from(sign < 0.0)] - level) >= 0.0;
        let fill = |(masks, bricks): (&mut [Mask], &[u32])| {
            dispatch!(instructions, simd => for (mask, &brick) in masks.iter_mut().zip(bricks) {
                let corner = corner_of(occupancy.dims, brick);
                if is_inside(brick) {
                    *mask = grid_of(dims, corner);
                    continue;
                }
                let block = store.block(corner.map(|n| n / BRICK)).expect("a scan in memory has all its bricks");
                *mask = with_block!(block, block => match what {
                    Walked::Inside => cells_with(simd, &block, dims, corner, |v| inside(sign * (v - level))),
                    Walked::Crossings(bands) => crossed(simd, &block, dims, corner, [level, sign], bands),
                });
            });
        };
        let mut masks = vec![[0; WORDS]; occupied.len()];
        masks.par_chunks_mut(CHUNK).zip(occupied.par_chunks(CHUNK)).for_each(fill);
        Self::of(occupancy, dims, slots, masks)
    }

    /// With what these masks of bricks say.
    fn of(occupancy: &Occupancy, dims: [usize; 3], slots: Vec<u32>, masks: Vec<Mask>) -> Self {
        let boxes = masks.par_iter().map(box_of).collect();
        let mut all = Self { slots, masks, boxes, exposed: vec![] };
        all.exposed = occupancy.bricks().into_par_iter().filter(|&brick| all.is_exposed(occupancy, dims, brick as usize)).collect();
        all
    }

    /// Of cells that can hold the surface those with a corner within a solid; `map` is that of all of them.
    pub fn within(&self, map: &DistanceMap, solid: &Solid, dims: [usize; 3]) -> (DistanceMap, Self) {
        let (of, sides) = (map.dims(), solid.sides());
        let is = map.distances().par_iter().zip(sides).map(|(distance, side)| *distance == 0 && *side != Side::Outside).collect();
        let occupancy = Occupancy { dims: of, is };
        let bricks = occupancy.bricks();
        let mut slots = vec![0; sides.len()];
        bricks.iter().zip(0..).for_each(|(&brick, slot)| slots[brick as usize] = slot);
        let mask = |&brick: &u32| {
            let n = brick as usize;
            let mask = self.masks[self.slots[n] as usize];
            if sides[n] == Side::Inside {
                return mask;
            }
            let kept = solid.cells_with_inside([n % of[0], n / of[0] % of[1], n / (of[0] * of[1])]);
            std::array::from_fn(|word| mask[word] & (kept[word / 2] >> (word % 2 * 32)) as u32)
        };
        let (map, masks) = rayon::join(|| DistanceMap::of(&occupancy), || bricks.par_iter().map(mask).collect());
        (map, Self::of(&occupancy, dims, slots, masks))
    }

    /// Whether a brick lies at the border, or next to one, across a face, whose box of cells does not fill it.
    fn is_exposed(&self, occupancy: &Occupancy, dims: [usize; 3], brick: usize) -> bool {
        let [bx, by, bz] = occupancy.dims;
        let at = [brick % bx, brick / bx % by, brick / (bx * by)];
        let is_filled = |brick: usize, at: [usize; 3]| {
            let size: [usize; 3] = std::array::from_fn(|a| (dims[a] - 1 - at[a] * BRICK).min(BRICK));
            occupancy.is[brick] && self.cells(brick as u32) == [[0; 3], size.map(|n| n as u8)]
        };
        (0..3).any(|a| {
            let stride = [1, bx, bx * by][a];
            let beside = |step: usize| std::array::from_fn(|b| if a == b { at[b] + step - 1 } else { at[b] });
            at[a] == 0 || at[a] + 1 == [bx, by, bz][a] || !is_filled(brick - stride, beside(0)) || !is_filled(brick + stride, beside(2))
        })
    }

    /// The numbers of the bricks whose boxes of cells are not closed in by full ones on all six sides. A ray from outside that enters another
    /// brick's box has entered one of these before, and enters one again on its way out.
    pub fn exposed(&self) -> &[u32] {
        &self.exposed
    }

    /// The box that the cells of an occupied brick lie in: the lowest of them, and where they end.
    pub fn cells(&self, brick: u32) -> [[u8; 3]; 2] {
        let packed = self.boxes[self.slots[brick as usize] as usize];
        [0, 12].map(|shift| [0, 4, 8].map(|axis| (packed >> (shift + axis) & 15) as u8))
    }

    /// For each brick, i fastest, the number of its mask; 0 where it has none.
    pub fn slots(&self) -> &[u32] {
        &self.slots
    }

    /// All masks, one behind the other.
    pub fn words(&self) -> &[u32] {
        self.masks.as_flattened()
    }

    /// For each mask the box that its cells lie in: 4 bits each for the lowest x, y and z and, above these, for the ends.
    pub fn boxes(&self) -> &[u32] {
        &self.boxes
    }

    /// Memory that they take.
    pub fn bytes(&self) -> usize {
        size_of_val(self.slots.as_slice())
            + size_of_val(self.masks.as_slice())
            + size_of_val(self.boxes.as_slice())
            + size_of_val(self.exposed.as_slice())
    }
}

/// Bricks that a thread takes at once: some hundredths of a millisecond's work.
const CHUNK: usize = 64;

/// The first sample of a brick of a grid of so many.
fn corner_of([bx, by, _]: [usize; 3], brick: u32) -> [usize; 3] {
    let n = brick as usize;
    [n % bx, n / bx % by, n / (bx * by)].map(|b| b * BRICK)
}

/// All cells of a brick that lie in the grid.
fn grid_of(dims: [usize; 3], corner: [usize; 3]) -> Mask {
    let [cx, cy, cz] = std::array::from_fn(|a| (dims[a] - 1 - corner[a]).min(BRICK));
    let layer = (0..cy).map(|y| ((1_u64 << cx) - 1) << (BRICK * y)).sum::<u64>();
    std::array::from_fn(|word| if word / 2 < cz { (layer >> (word % 2 * 32)) as u32 } else { 0 })
}

/// The cells with a sample in each of these at their corners, of the brick with its first sample at `corner`: at or above a band's lower end and
/// at or below its higher one; and cells at the grid's border, where surfaces are closed, with one that is inside.
#[inline(always)]
fn crossed<S: Simd, T: Sample>(
    simd: S,
    block: &Block<'_, T>,
    dims: [usize; 3],
    corner: [usize; 3],
    [level, sign]: [f32; 2],
    bands: &[[f32; 2]],
) -> Mask {
    let border = border_of(dims, corner);
    let mut all = [0; WORDS];
    if border != all {
        let inside = cells_with(simd, block, dims, corner, |v| inside(sign * (v - level)));
        all = std::array::from_fn(|word| inside[word] & border[word]);
    }
    for [low, high] in bands {
        let above = cells_with(simd, block, dims, corner, |v| (sign * (v - level)).simd_ge(*low));
        let below = cells_with(simd, block, dims, corner, |v| (sign * (v - level)).simd_le(*high));
        (0..WORDS).for_each(|word| all[word] |= above[word] & below[word]);
    }
    all
}

/// The cells of a brick that lie at the grid's border.
fn border_of(dims: [usize; 3], corner: [usize; 3]) -> Mask {
    let outermost = |a: usize| (0..BRICK).filter(|n| corner[a] + n == 0 || corner[a] + n + 2 == dims[a]).map(|n| 1_u64 << n).sum::<u64>();
    let [x, y, z] = [outermost(0), outermost(1), outermost(2)];
    let rows = |y: u64| (0..BRICK).map(|n| if y >> n & 1 == 1 { 0xff } else { x } << (BRICK * n)).sum::<u64>();
    std::array::from_fn(|word| ((if z >> (word / 2) & 1 == 1 { u64::MAX } else { rows(y) }) >> (word % 2 * 32)) as u32)
}

/// The cells with a corner that `is` says yes to, of the brick with its first sample at `corner`.
#[inline(always)]
fn cells_with<S: Simd, T: Sample>(
    simd: S,
    block: &Block<'_, T>,
    dims: [usize; 3],
    corner: [usize; 3],
    is: impl Fn(Floats<S>) -> LaneMask<S>,
) -> Mask {
    // 8 cells along each side, less at the grid's far border, and a sample more.
    let [cx, cy, cz] = std::array::from_fn(|a| (dims[a] - 1 - corner[a]).min(BRICK));
    let mut mask = [0_u64; BRICK];
    for k in 0..=cz {
        let mut layer = 0_u64;
        for j in 0..=cy {
            let row = block.onward([corner[0], corner[1] + j, corner[2] + k]);
            let bits = is(first_of(simd, row)).to_bitmask() & ((2 << cx) - 1);
            // A sample is a corner of the cells on either side of it, along each axis.
            let row = (bits | bits >> 1) & ((1 << cx) - 1);
            if j < cy {
                layer |= row << (8 * j);
            }
            if j > 0 {
                layer |= row << (8 * (j - 1));
            }
        }
        if k < cz {
            mask[k] |= layer;
        }
        if k > 0 {
            mask[k - 1] |= layer;
        }
    }
    std::array::from_fn(|word| (mask[word / 2] >> (word % 2 * 32)) as u32)
}

/// The box of a mask's cells; an empty one has no cells at all.
fn box_of(mask: &Mask) -> u32 {
    let layers: [u64; BRICK] = std::array::from_fn(|z| u64::from(mask[2 * z]) | u64::from(mask[2 * z + 1]) << 32);
    let all = layers.iter().fold(0, |all, layer| all | layer);
    let rows = |y: usize| all >> (BRICK * y) & 0xff;
    let columns = (0..BRICK).fold(0, |columns, y| columns | rows(y));
    let ends = |is_there: &dyn Fn(usize) -> bool| {
        let first = (0..BRICK).find(|n| is_there(*n)).unwrap_or(0);
        let end = (0..BRICK).rfind(|n| is_there(*n)).map_or(0, |n| n + 1);
        (first as u32, end as u32)
    };
    let [x, y, z] = [ends(&|x| columns >> x & 1 == 1), ends(&|y| rows(y) != 0), ends(&|z| layers[z] != 0)];
    x.0 | y.0 << 4 | z.0 << 8 | x.1 << 12 | y.1 << 16 | z.1 << 20
}

/// As many samples as there are lanes, or those that there are.
#[inline(always)]
fn first_of<S: Simd, T: Sample>(simd: S, samples: &[T]) -> Floats<S> {
    let mut values = [0.0; LANES];
    match samples.first_chunk::<LANES>() {
        Some(all) => all.iter().zip(&mut values).for_each(|(s, v)| *v = s.to_f32()),
        None => samples.iter().zip(&mut values).for_each(|(s, v)| *v = s.to_f32()),
    }
    Floats::load_array(simd, values)
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::DistanceMap;
    use super::*;
    use crate::stability::Random;
    use bregma_field::Samples;

    /// Of the surface at 0.5.
    pub fn maps_of(samples: Vec<u8>, dims: [usize; 3]) -> (DistanceMap, CellMasks) {
        let bricks = RangeBricks::build(&samples, dims);
        let occupancy = Occupancy::of(&bricks, 0.5, 1.0, &Walked::Inside);
        let store = Samples::U8(samples);
        let of = (Store::new(&store, dims), &bricks);
        (DistanceMap::of(&occupancy), CellMasks::build(InstructionSet::new(), of, &occupancy, [0.5, 1.0], &Walked::Inside))
    }

    #[test]
    fn a_cell_is_marked_when_a_corner_is_inside() {
        // Fails if a bit stands for another cell, a shared layer is forgotten, or the grid's border is read past: a hole in the surface.
        let mut random = Random(3);
        for dims in [[9, 9, 9], [10, 17, 8], [2, 2, 25], [20, 11, 14], [65, 9, 5], [150, 6, 9]] {
            for (level, sign) in [(0.5, 1.0), (100.0, 1.0), (100.0, -1.0)] {
                // A part is solid: its bricks are not read.
                let solid = dims.iter().product::<usize>() / 3;
                let samples: Vec<u8> =
                    (0..dims.iter().product()).map(|n| (random.unit().powi(if n < solid { 0 } else { 8 }) * 255.0) as u8).collect();
                let bricks = RangeBricks::build(&samples, dims);
                let map = DistanceMap::build(&bricks, level, sign);
                let masks = CellMasks::build(
                    InstructionSet::new(),
                    (Store::new(&Samples::U8(samples.clone()), dims), &bricks),
                    &Occupancy::of(&bricks, level, sign, &Walked::Inside),
                    [level, sign],
                    &Walked::Inside,
                );
                let [bx, by, _] = map.dims();
                for n in 0..(dims[0] - 1) * (dims[1] - 1) * (dims[2] - 1) {
                    let cell = [n % (dims[0] - 1), n / (dims[0] - 1) % (dims[1] - 1), n / ((dims[0] - 1) * (dims[1] - 1))];
                    let corners = (0..8).map(|c| [0, 1, 2].map(|a| cell[a] + (c >> a & 1)));
                    let any =
                        corners.into_iter().any(|[x, y, z]| sign * (f32::from(samples[(z * dims[1] + y) * dims[0] + x]) - level) >= 0.0);
                    let b = cell.map(|c| c / 8);
                    let brick = (b[2] * by + b[1]) * bx + b[0];
                    let bit = map.distances()[brick] == 0 && {
                        let bit = (cell[2] % 8 * 8 + cell[1] % 8) * 8 + cell[0] % 8;
                        masks.words()[masks.slots()[brick] as usize * WORDS + bit / 32] >> (bit % 32) & 1 == 1
                    };
                    assert_eq!(bit, any, "{dims:?} {cell:?}");
                }
                // No cell lies beyond the grid, and boxes hold just the cells that are marked.
                for brick in map.occupied() {
                    let b = brick as usize;
                    let corner = [b % bx, b / bx % by, b / (bx * by)].map(|n| n * BRICK);
                    let words = &masks.words()[masks.slots()[b] as usize * WORDS..][..WORDS];
                    let marked = (0..512_usize).filter(|n| words[n / 32] >> (n % 32) & 1 == 1).map(|n| [n % 8, n / 8 % 8, n / 64]);
                    let (mut first, mut end) = ([8; 3], [0; 3]);
                    for cell in marked {
                        for a in 0..3 {
                            assert!(corner[a] + cell[a] + 1 < dims[a], "{dims:?}: {cell:?} of the brick at {corner:?} is no cell");
                            first[a] = first[a].min(cell[a] as u8);
                            end[a] = end[a].max(cell[a] as u8 + 1);
                        }
                    }
                    assert_eq!(masks.cells(brick), [first, end]);
                }
            }
        }
    }

    #[test]
    fn a_cell_is_walked_to_when_it_has_corners_on_both_sides_of_a_level_or_closes_a_surface() {
        // Fails if a level, a side, a tie or the grid's border is forgotten: a crossing would be drawn late, or not at all.
        let mut random = Random(4);
        for dims in [[9, 9, 9], [10, 17, 8], [2, 2, 25], [20, 11, 14], [65, 9, 5], [150, 6, 9]] {
            for sign in [1.0, -1.0] {
                let samples: Vec<u8> = (0..dims.iter().product()).map(|_| (random.unit().powi(3) * 8.0) as u8).collect();
                let level = if sign > 0.0 { 2.0 } else { 5.0 };
                let bands = vec![[0.0, 0.0], [2.5, 2.5]];
                let what = Walked::Crossings(bands.clone());
                let bricks = RangeBricks::build(&samples, dims);
                let occupancy = Occupancy::of(&bricks, level, sign, &what);
                let map = DistanceMap::of(&occupancy);
                let store = Samples::U8(samples.clone());
                let masks = CellMasks::build(InstructionSet::new(), (Store::new(&store, dims), &bricks), &occupancy, [level, sign], &what);
                let [bx, by, _] = map.dims();
                for n in 0..(dims[0] - 1) * (dims[1] - 1) * (dims[2] - 1) {
                    let cell = [n % (dims[0] - 1), n / (dims[0] - 1) % (dims[1] - 1), n / ((dims[0] - 1) * (dims[1] - 1))];
                    let value = |c: usize| {
                        let [x, y, z] = [0, 1, 2].map(|a| cell[a] + (c >> a & 1));
                        sign * (f32::from(samples[(z * dims[1] + y) * dims[0] + x]) - level)
                    };
                    let passes = bands.iter().any(|[low, high]| (0..8).any(|c| value(c) >= *low) && (0..8).any(|c| value(c) <= *high));
                    let closes = (0..3).any(|a| cell[a] == 0 || cell[a] + 2 == dims[a]) && (0..8).any(|c| value(c) >= 0.0);
                    let b = cell.map(|c| c / 8);
                    let brick = (b[2] * by + b[1]) * bx + b[0];
                    let bit = map.distances()[brick] == 0 && {
                        let bit = (cell[2] % 8 * 8 + cell[1] % 8) * 8 + cell[0] % 8;
                        masks.words()[masks.slots()[brick] as usize * WORDS + bit / 32] >> (bit % 32) & 1 == 1
                    };
                    assert_eq!(bit, passes || closes, "{dims:?} {sign} {cell:?}");
                }
            }
        }
    }
}
