//! Which bricks can hold the surface, and how far a ray may leap from those that cannot.

use super::Walked;
use bregma_field::RangeBricks;
use rayon::prelude::*;

/// For each brick the Chebyshev distance, in bricks, to the nearest brick that can hold the surface: 0 there, and from a
/// brick at distance k every brick within k − 1 is empty. Capped at 255.
#[derive(Clone, Debug, PartialEq)]
pub struct DistanceMap {
    dims: [usize; 3],
    distances: Vec<u8>,
}

impl DistanceMap {
    /// The map for the surface at `level` (sample units) where samples of `sign` ≥ `sign`·`level` are inside. A brick that
    /// lies wholly inside counts as occupied: a ray may enter it through the box's face, where the surface is closed.
    pub fn build(bricks: &RangeBricks, level: f32, sign: f32) -> Self {
        Self::of(&Occupancy::of(bricks, level, sign, &Walked::Inside))
    }

    /// The map of what is walked to.
    pub(crate) fn of(occupancy: &Occupancy) -> Self {
        Self { dims: occupancy.dims, distances: distances(occupancy.dims, &occupancy.is) }
    }

    /// The bricks that can hold the surface or lie inside, by number, i fastest.
    pub fn occupied(&self) -> Vec<u32> {
        self.distances.iter().enumerate().filter(|(_, d)| **d == 0).map(|(n, _)| n as u32).collect()
    }

    /// Bricks along i, j and k.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// Memory that it takes.
    pub(crate) fn bytes(&self) -> usize {
        self.distances.len()
    }

    /// The distances, i fastest.
    pub fn distances(&self) -> &[u8] {
        &self.distances
    }
}

/// Which bricks can hold what is walked to.
#[derive(Debug)]
pub(crate) struct Occupancy {
    /// Bricks along i, j and k.
    pub dims: [usize; 3],
    /// Of each brick, i fastest.
    pub is: Vec<bool>,
}

impl Occupancy {
    /// Of the surface at `level`, and of the others that `what` asks for.
    pub fn of(bricks: &RangeBricks, level: f32, sign: f32, what: &Walked) -> Self {
        let (dims, ranges) = (bricks.dims(), bricks.ranges().par_iter());
        let is = match what {
            Walked::Inside => ranges.map(|range| sign * (range[usize::from(sign > 0.0)] - level) >= 0.0).collect(),
            Walked::Crossings(bands) => {
                let passes = |(n, range): (usize, &[f32; 2])| {
                    let [low, high] = if sign > 0.0 { *range } else { [range[1], range[0]] }.map(|v| sign * (v - level));
                    let at = [n % dims[0], n / dims[0] % dims[1], n / (dims[0] * dims[1])];
                    let at_border = (0..3).any(|a| at[a] == 0 || at[a] + 1 == dims[a]);
                    bands.iter().any(|band| low <= band[1] && high >= band[0]) || at_border && high >= 0.0
                };
                ranges.enumerate().map(passes).collect()
            }
        };
        Self { dims, is }
    }

    /// Their numbers.
    pub fn bricks(&self) -> Vec<u32> {
        (0..).zip(&self.is).filter(|(_, is)| **is).map(|(n, _)| n).collect()
    }
}

/// The chessboard distance of each brick from those that are `occupied`: layer by layer around them, 64 bricks of a row at a time.
fn distances(dims: [usize; 3], occupied: &[bool]) -> Vec<u8> {
    let [nx, ny, nz] = dims;
    let words = nx.div_ceil(64);
    let mut distances = vec![u8::MAX; occupied.len()];
    // A bit for each brick that is nearer than the next distance; each row begins with a number of its own.
    let mut reached = vec![0_u64; words * ny * nz];
    for (row, reached) in occupied.chunks(nx.max(1)).zip(reached.chunks_mut(words.max(1))) {
        row.iter().enumerate().for_each(|(x, occupied)| reached[x / 64] |= u64::from(*occupied) << (x % 64));
    }
    let mut last = vec![0_u64; reached.len()];
    for distance in 0..u8::MAX {
        let mut changed = false;
        for (row, (now, before)) in reached.chunks(words.max(1)).zip(last.chunks(words.max(1))).enumerate() {
            for (word, (now, before)) in now.iter().zip(before).enumerate() {
                let mut new: u64 = now & !before;
                changed |= new != 0;
                while new != 0 {
                    distances[row * nx + word * 64 + new.trailing_zeros() as usize] = distance;
                    new &= new - 1;
                }
            }
        }
        if !changed {
            break;
        }
        last.copy_from_slice(&reached);
        grow_along_rows(&mut reached, words, nx);
        grow_across(&mut reached, words, ny);
        grow_across(&mut reached, words * ny, nz);
    }
    distances
}

/// Adds to each row's bricks the ones on either side.
fn grow_along_rows(bricks: &mut [u64], words: usize, nx: usize) {
    for row in bricks.chunks_mut(words.max(1)) {
        let mut before = 0;
        for word in 0..row.len() {
            let (here, behind) = (row[word], row.get(word + 1).copied().unwrap_or(0));
            row[word] = here | here << 1 | here >> 1 | before >> 63 | behind << 63;
            before = here;
        }
        if let (Some(last), 1..) = (row.last_mut(), nx % 64) {
            *last &= (1 << (nx % 64)) - 1;
        }
    }
}

/// Adds to each of the `count` slices of some words, that follow each other, the ones on either side.
fn grow_across(bricks: &mut [u64], slice: usize, count: usize) {
    let mut before = vec![0; slice];
    for block in bricks.chunks_mut((slice * count).max(1)) {
        before.fill(0);
        for n in 0..count {
            for word in n * slice..(n + 1) * slice {
                let (here, behind) = (block[word], block.get(word + slice).copied().unwrap_or(0));
                block[word] = here | before[word % slice] | behind;
                before[word % slice] = here;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_the_true_chessboard_distances() {
        // Fails if a neighbour is missed, or a row's end reaches into the next row: a ray would leap over bone.
        for (dims, some) in [([7, 5, 4], 47), ([64, 3, 2], 171), ([65, 2, 3], 171), ([131, 1, 4], 401), ([1, 1, 1], 2), ([300, 1, 1], 400)]
        {
            let place = |n: usize| [n % dims[0], n / dims[0] % dims[1], n / (dims[0] * dims[1])];
            let all = 0..dims.iter().product::<usize>();
            let occupied: Vec<bool> = all.clone().map(|n| (n * n + 1) % some == 1).collect();
            let distances = distances(dims, &occupied);
            for n in all.clone() {
                let to = |o: usize| (0..3).map(|a| place(o)[a].abs_diff(place(n)[a])).max();
                let nearest = all.clone().filter(|o| occupied[*o]).filter_map(to).min();
                assert_eq!(usize::from(distances[n]), nearest.unwrap_or(255).min(255), "{dims:?} {n}");
            }
        }
        assert_eq!(distances([2, 1, 1], &[false, false]), [255, 255]);
        assert!(distances([0, 0, 0], &[]).is_empty());
    }

    #[test]
    fn a_brick_is_occupied_when_a_sample_of_it_is_inside() {
        // Fails if the wrong end of a brick's range is compared, or ties are taken to be outside: a hole in the surface.
        let dims = [17, 9, 9];
        for (level, sign) in [(50.0, 1.0), (-50.0, -1.0)] {
            let mut samples = vec![0_i16; dims.iter().product()];
            samples[4 * 9 * 17 + 4 * 17 + 12] = level as i16;
            let map = DistanceMap::build(&RangeBricks::build(&samples, dims), level, sign);
            assert_eq!((map.dims(), map.distances()), ([2, 1, 1], &[1, 0][..]));
        }
    }
}
