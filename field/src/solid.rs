//! A region of space on the samples of a scan's grid, whose surface is trilinear as the scan's is: the bone that is meant.
//!
//! How far within it each sample lies is kept on blocks of samples near its surface; the others keep one side for all. So memory grows with its
//! area, and in each cell its surface along a ray is one more cubic. (Narrow bands of level sets on blocks: Houston and others, "Hierarchical
//! RLE level set", ACM TOG 25 (2006); Museth, "VDB", ACM TOG 32 (2013).)

use crate::trilinear::{gradient, value};
use bregma_volume::{BRICK, Cancelled, Grid, IndexPoint, Progress};
use glam::{DVec3, USizeVec3};
use rayon::prelude::*;
use std::fmt;

/// Samples of a block.
const SAMPLES: usize = BRICK * BRICK * BRICK;

/// A block of samples with distances, i fastest, in units of [`Solid::unit_mm`]; positive inside.
type Block = [i16; SAMPLES];

/// A sample nearer than this to the surface has its distance kept, in diagonals of a cell: a corner of a cell that the surface passes is no farther
/// than one.
const BAND_DIAGONALS: f64 = 1.25;

/// Distances are cut off here, in diagonals of a cell: 16 bits resolve then a five-thousandth of a voxel that is a cube.
const FARTHEST_DIAGONALS: f64 = 4.0;

/// What stands for a block of samples without distances of its own, all outside.
const OUTSIDE: u32 = 0;
/// All inside.
pub const INSIDE: u32 = 1;
/// Numbers from here on count blocks with distances.
pub const FIRST: u32 = 2;

/// Samples along each side of what a solid is made of at a time.
pub const TILE: usize = 4 * BRICK;

/// What is known of a tile of samples.
#[derive(Clone, Debug)]
pub enum Tile {
    /// All of them lie inside, or outside, and farther from the surface than the band.
    Side(bool),
    /// How far within each sample is, i fastest, mm, positive inside.
    Distances(Vec<f32>),
}

/// A block with distances, or the side that all of it is on.
type Kept = Result<Box<Block>, bool>;

/// A region of space, on the samples of a grid.
#[derive(Clone, PartialEq)]
pub struct Solid {
    dims: [usize; 3],
    unit_mm: f64,
    /// For each block, i fastest, [`OUTSIDE`], [`INSIDE`] or [`FIRST`] and the block's number.
    slots: Vec<u32>,
    blocks: Vec<Block>,
    /// Of the cells of each brick of the grid, i fastest.
    sides: Vec<Side>,
}

/// Which side of a solid cells lie on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// All outside.
    Outside,
    /// All inside.
    Inside,
    /// Its surface may pass between them.
    Both,
}

// Its unit is a number.
impl Eq for Solid {}

impl fmt::Debug for Solid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Solid({:?}, {} blocks)", self.dims, self.blocks.len())
    }
}

impl Solid {
    /// Of how far within it points of index space are, mm, positive inside.
    pub fn of(grid: &Grid, distance_mm: impl Fn(IndexPoint) -> f64 + Sync) -> Self {
        let tile = |first: USizeVec3, size: USizeVec3| {
            let at = |n: usize| first + USizeVec3::from(place_of(n, size.to_array()));
            Tile::Distances((0..size.element_product()).map(|n| distance_mm(IndexPoint(at(n).as_dvec3())) as f32).collect())
        };
        Self::of_tiles(grid, &Progress::default(), tile).expect("nobody cancels it")
    }

    /// Tile by tile, of each of which `tile` is told the first sample and how many samples it has along each axis: [`TILE`], or what the grid has left.
    /// `progress` counts tiles.
    ///
    /// # Panics
    /// Where there are not as many distances as samples.
    pub fn of_tiles(grid: &Grid, progress: &Progress, tile: impl Fn(USizeVec3, USizeVec3) -> Tile + Sync) -> Result<Self, Cancelled> {
        Self::made(grid, progress, |first, size| Err(tile(first, size)))
    }

    /// The same solid where only some tiles differ: `tile` says of those how far within it their samples are, and `None` of the others.
    pub fn with_tiles(
        &self,
        grid: &Grid,
        progress: &Progress,
        tile: impl Fn(USizeVec3, USizeVec3) -> Option<Tile> + Sync,
    ) -> Result<Self, Cancelled> {
        Self::made(grid, progress, |first, size| tile(first, size).ok_or(self).map_or_else(Ok, Err))
    }

    /// Tile by tile, each as another solid has it or as it is said to be.
    fn made<'a>(
        grid: &Grid,
        progress: &Progress,
        tile: impl Fn(USizeVec3, USizeVec3) -> Result<&'a Self, Tile> + Sync,
    ) -> Result<Self, Cancelled> {
        let dims = USizeVec3::from(grid.dims());
        let (band_mm, unit_mm) = (Self::band_mm(grid), FARTHEST_DIAGONALS * diagonal_mm(grid) / f64::from(i16::MAX));
        let tiles = grid.dims().map(|n| n.div_ceil(TILE));
        progress.begin(tiles.iter().product::<usize>() as u64);
        let one = |n: usize| {
            progress.advance(1)?;
            let first = USizeVec3::from(place_of(n, tiles)) * TILE;
            let size = (dims - first).min(USizeVec3::splat(TILE));
            let tile = tile(first, size);
            let count = blocks_of(size.to_array());
            let kept = |block: usize| {
                let corner = USizeVec3::from(place_of(block, count));
                let kept = match &tile {
                    Ok(known) => known.kept_at(first / BRICK + corner),
                    Err(Tile::Side(inside)) => Err(*inside),
                    Err(Tile::Distances(mm)) => kept(mm, size, corner * BRICK, [band_mm, unit_mm]),
                };
                (first / BRICK + corner, kept)
            };
            Ok((0..count.iter().product()).map(kept).collect::<Vec<_>>())
        };
        let all: Vec<Vec<(USizeVec3, Kept)>> = (0..tiles.iter().product()).into_par_iter().map(one).collect::<Result<_, Cancelled>>()?;
        let count = blocks_of(grid.dims());
        let mut solid = Self { dims: grid.dims(), unit_mm, slots: vec![OUTSIDE; count.iter().product()], blocks: vec![], sides: vec![] };
        for (at, kept) in all.into_iter().flatten() {
            solid.slots[(at.z * count[1] + at.y) * count[0] + at.x] = match kept {
                Err(inside) => {
                    if inside {
                        INSIDE
                    } else {
                        OUTSIDE
                    }
                }
                Ok(block) => {
                    solid.blocks.push(*block);
                    FIRST + (solid.blocks.len() - 1) as u32
                }
            };
        }
        Ok(solid.finished())
    }

    fn kept_at(&self, block: USizeVec3) -> Kept {
        let count = blocks_of(self.dims);
        match self.slots[(block.z * count[1] + block.y) * count[0] + block.x] {
            OUTSIDE => Err(false),
            INSIDE => Err(true),
            slot => Ok(Box::new(self.blocks[(slot - FIRST) as usize])),
        }
    }

    /// With what its blocks say of bricks of cells.
    fn finished(mut self) -> Self {
        let bricks = self.dims.map(|n| n.saturating_sub(1).div_ceil(BRICK));
        self.sides = (0..bricks.iter().product()).into_par_iter().map(|n| self.side_of(place_of(n, bricks))).collect();
        self
    }

    /// How far from its surface, at least, distances are kept on a grid.
    pub fn band_mm(grid: &Grid) -> f64 {
        BAND_DIAGONALS * diagonal_mm(grid)
    }

    /// Samples along i, j and k: those of the grid that it was made for.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// What a unit of the kept distances is, mm.
    pub fn unit_mm(&self) -> f64 {
        self.unit_mm
    }

    /// Memory that it takes.
    pub fn bytes(&self) -> usize {
        size_of_val(self.slots.as_slice()) + size_of_val(self.blocks.as_slice()) + size_of_val(self.sides.as_slice())
    }

    /// For each block of 8 × 8 × 8 samples, i fastest: 0 where it is outside, 1 inside, and else 2 and the number of its distances.
    pub fn slots(&self) -> &[u32] {
        &self.slots
    }

    /// The distances of all blocks that have their own, positive inside, in units.
    pub fn distances(&self) -> &[i16] {
        self.blocks.as_flattened()
    }

    /// How far within it a sample is, in units: as far as these are kept.
    #[inline]
    pub fn units_at(&self, [x, y, z]: [usize; 3]) -> i16 {
        let [bx, by, _] = blocks_of(self.dims);
        match self.slots[(z / BRICK * by + y / BRICK) * bx + x / BRICK] {
            OUTSIDE => -i16::MAX,
            INSIDE => i16::MAX,
            slot => self.blocks[(slot - FIRST) as usize][(z % BRICK * BRICK + y % BRICK) * BRICK + x % BRICK],
        }
    }

    /// How far within it the corners of a cell are, given by its lowest sample, in units.
    #[inline]
    pub fn corners(&self, [x, y, z]: [usize; 3]) -> [f32; 8] {
        std::array::from_fn(|c| f32::from(self.units_at([x + (c & 1), y + (c >> 1 & 1), z + (c >> 2)])))
    }

    /// How far within it a point is, mm, and how that changes per voxel; as far as distances are kept.
    pub fn distance_and_gradient(&self, IndexPoint(p): IndexPoint) -> (f64, DVec3) {
        let last = USizeVec3::from(self.dims.map(|n| n.max(2) - 2));
        let cell = p.max(DVec3::ZERO).as_usizevec3().min(last);
        let f = self.corners(cell.to_array()).map(|units| f64::from(units) * self.unit_mm);
        let local = (p - cell.as_dvec3()).clamp(DVec3::ZERO, DVec3::ONE);
        (value(&f, local), gradient(&f, local))
    }

    /// On which side the cells of that brick of the grid lie which a cell is of, given by its lowest sample.
    #[inline]
    pub fn side_at(&self, [x, y, z]: [usize; 3]) -> Side {
        let [bx, by, _] = self.dims.map(|n| n.saturating_sub(1).div_ceil(BRICK));
        self.sides[(z / BRICK * by + y / BRICK) * bx + x / BRICK]
    }

    /// The same of each brick, i fastest.
    pub fn sides(&self) -> &[Side] {
        &self.sides
    }

    fn side_of(&self, brick: [usize; 3]) -> Side {
        let count = blocks_of(self.dims);
        let mut sides = [false; 2];
        for c in 0..8 {
            let at: [usize; 3] = std::array::from_fn(|a| (brick[a] + (c >> a & 1)).min(count[a] - 1));
            match self.slots[(at[2] * count[1] + at[1]) * count[0] + at[0]] {
                OUTSIDE => sides[0] = true,
                INSIDE => sides[1] = true,
                _ => return Side::Both,
            }
        }
        match sides {
            [true, true] => Side::Both,
            [_, true] => Side::Inside,
            _ => Side::Outside,
        }
    }

    /// The cells of a brick of the grid with a corner inside, a number for each layer: bit 8y + x of number z is cell (x, y, z).
    pub fn cells_with_inside(&self, brick: [usize; 3]) -> [u64; BRICK] {
        let corner = brick.map(|b| b * BRICK);
        let cells: [usize; 3] = std::array::from_fn(|a| (self.dims[a] - 1).saturating_sub(corner[a]).min(BRICK));
        let mut layers = [0; BRICK];
        for z in 0..=cells[2] {
            let mut layer = 0_u64;
            for y in 0..=cells[1] {
                let bits: u64 =
                    (0..=cells[0]).map(|x| u64::from(self.units_at([corner[0] + x, corner[1] + y, corner[2] + z]) >= 0) << x).sum();
                let row = (bits | bits >> 1) & ((1 << cells[0]) - 1);
                for y in [y.wrapping_sub(1), y].into_iter().filter(|y| *y < cells[1]) {
                    layer |= row << (BRICK * y);
                }
            }
            for z in [z.wrapping_sub(1), z].into_iter().filter(|z| *z < cells[2]) {
                layers[z] |= layer;
            }
        }
        layers
    }

    /// All that is not within it.
    pub fn inverse(&self) -> Self {
        let other = |slot: &u32| match *slot {
            OUTSIDE => INSIDE,
            INSIDE => OUTSIDE,
            slot => slot,
        };
        // A sample on the surface is inside of both: a unit is less than what distances are good for.
        let blocks = self.blocks.par_iter().map(|block| block.map(|d| -d)).collect();
        Self { slots: self.slots.iter().map(other).collect(), blocks, sides: vec![], ..*self }.finished()
    }
}

/// The distances of the block that begins at `corner` of a tile of so many samples, in units; of one that is all farther from the surface than the
/// band which side it is on.
fn kept(mm: &[f32], size: USizeVec3, corner: USizeVec3, [band_mm, unit_mm]: [f64; 2]) -> Kept {
    let (mut block, mut nearest_mm) = (Box::new([0; SAMPLES]), f64::INFINITY);
    for (n, units) in block.iter_mut().enumerate() {
        // Beyond the grid as at its border, where the last tile ends.
        let at = (corner + USizeVec3::from(place_of(n, [BRICK; 3]))).min(size - 1);
        let mm = f64::from(mm[(at.z * size.y + at.y) * size.x + at.x]);
        let rounded = (mm / unit_mm).round().clamp(-f64::from(i16::MAX), f64::from(i16::MAX)) as i16;
        // A sample on the surface is inside; one that is not stays on its side.
        *units = if rounded == 0 && mm < 0.0 { -1 } else { rounded };
        nearest_mm = nearest_mm.min(mm.abs());
    }
    let inside = block[0] >= 0;
    let is_far = nearest_mm > band_mm && block.iter().all(|units| (*units >= 0) == inside);
    if is_far { Err(inside) } else { Ok(block) }
}

/// The longest diagonal of a cell.
fn diagonal_mm(grid: &Grid) -> f64 {
    let [x, y, z] = grid.index_to_world().matrix3.to_cols_array_2d().map(DVec3::from);
    [x + y + z, x + y - z, x - y + z, x - y - z].map(DVec3::length).into_iter().fold(0.0, f64::max)
}

/// Blocks along i, j and k.
fn blocks_of(dims: [usize; 3]) -> [usize; 3] {
    dims.map(|n| n.div_ceil(BRICK))
}

/// The place of number n of `dims`, i fastest.
fn place_of(n: usize, [nx, ny, _]: [usize; 3]) -> [usize; 3] {
    [n % nx, n / nx % ny, n / (nx * ny)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat3;

    fn grid(dims: [usize; 3]) -> Grid {
        Grid::new(dims, DVec3::new(0.5, 0.7, 0.6), DVec3::ZERO, DMat3::IDENTITY).unwrap()
    }

    fn ball(grid: &Grid, centre: DVec3, radius_mm: f64) -> Solid {
        Solid::of(grid, |p| radius_mm - grid.world(p).0.distance(centre))
    }

    fn places(dims: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
        (0..dims.iter().product()).map(move |n| place_of(n, dims))
    }

    #[test]
    fn bricks_are_told_apart_and_their_cells_marked_by_their_corners() {
        // Fails if a brick is called one-sided that is not, a mark stands for another cell, or a shared corner is forgotten: bone would be lost.
        for dims in [[40, 33, 26], [9, 9, 9], [17, 2, 8], [2, 2, 2]] {
            let grid = grid(dims);
            let centre = grid.world(IndexPoint(DVec3::from(dims.map(|n| n as f64 / 3.0)))).0;
            for solid in
                [ball(&grid, centre, 6.0), ball(&grid, centre, 1.0), ball(&grid, centre, 100.0), ball(&grid, centre, 6.0).inverse()]
            {
                for cell in places(dims.map(|n| n - 1)) {
                    let corners = solid.corners(cell);
                    let side = solid.side_at(cell);
                    assert!(side != Side::Inside || corners.iter().all(|d| *d >= 0.0), "{dims:?} {cell:?} is not inside");
                    assert!(side != Side::Outside || corners.iter().all(|d| *d < 0.0), "{dims:?} {cell:?} is not outside");
                    let layers = solid.cells_with_inside(cell.map(|n| n / BRICK));
                    let [x, y, z] = cell.map(|n| n % BRICK);
                    let is_marked = layers[z] >> (BRICK * y + x) & 1 == 1;
                    assert_eq!(is_marked, corners.iter().any(|d| *d >= 0.0), "{dims:?} {cell:?}");
                }
            }
        }
    }

    #[test]
    fn a_solid_turned_round_holds_what_it_did_not() {
        // Fails if a block without distances stays on its side.
        let grid = grid([30, 25, 21]);
        let solid = ball(&grid, DVec3::new(7.0, 8.0, 6.0), 5.0);
        let beside = solid.inverse();
        for at in places(grid.dims()) {
            // On the surface itself a sample is inside of both.
            assert!(solid.units_at(at) == 0 || (beside.units_at(at) >= 0) != (solid.units_at(at) >= 0), "{at:?}");
        }
        assert!(beside.inverse() == solid);
    }
}
