//! Numbers at the samples of a grid, in tiles that are shared: a copy holds what the original holds, and of one that is changed only the tiles
//! that differ are its own. So what is painted costs what it touches, and a step of undo what it changed.

use bregma_field::Samples;
use glam::USizeVec3;
use rayon::prelude::*;
use std::sync::Arc;

/// Samples along each side of a tile.
pub(crate) const SIDE: usize = 16;
const COUNT: usize = SIDE * SIDE * SIDE;

/// The numbers of a tile, i fastest; those beyond the grid are 0 and nobody's.
#[derive(Clone, Debug, PartialEq)]
enum Tile {
    All(u16),
    Bytes(Arc<Vec<u8>>),
    Words(Arc<Vec<u16>>),
}

impl Tile {
    fn at(&self, n: usize) -> u16 {
        match self {
            Self::All(number) => *number,
            Self::Bytes(numbers) => numbers[n].into(),
            Self::Words(numbers) => numbers[n],
        }
    }

    fn set(&mut self, n: usize, number: u16) {
        if self.at(n) == number {
            return;
        }
        match (&mut *self, u8::try_from(number)) {
            (Self::Bytes(numbers), Ok(byte)) => Arc::make_mut(numbers)[n] = byte,
            (Self::Words(numbers), _) => Arc::make_mut(numbers)[n] = number,
            _ => {
                let mut all: Vec<u16> = (0..COUNT).map(|n| self.at(n)).collect();
                all[n] = number;
                *self = Self::of(&all);
            }
        }
    }

    fn of(numbers: &[u16]) -> Self {
        if numbers.iter().all(|n| *n == numbers[0]) {
            return Self::All(numbers[0]);
        }
        match numbers.iter().map(|&n| u8::try_from(n).ok()).collect::<Option<Vec<u8>>>() {
            Some(bytes) => Self::Bytes(Arc::new(bytes)),
            None => Self::Words(Arc::new(numbers.to_vec())),
        }
    }
}

/// Numbers at the samples of a grid.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Numbers {
    dims: USizeVec3,
    tiles: Vec<Tile>,
}

impl Numbers {
    /// Of as many as a grid of `dims` has, i fastest.
    pub fn of<N: Copy + Into<u16> + Sync>(dims: [usize; 3], numbers: &[N]) -> Self {
        let dims = USizeVec3::from(dims);
        let count = tiles_of(dims);
        let tile = |n: usize| {
            let first = place_of(n, count) * SIDE;
            let size = (dims - first).min(USizeVec3::splat(SIDE));
            let begin = |y: usize, z: usize| ((first.z + z) * dims.y + first.y + y) * dims.x + first.x;
            let one: u16 = numbers[begin(0, 0)].into();
            let rows = || (0..size.z).flat_map(|z| (0..size.y).map(move |y| (y, z)));
            if rows().all(|(y, z)| numbers[begin(y, z)..][..size.x].iter().all(|&n| n.into() == one)) {
                return Tile::All(one);
            }
            let mut all = vec![0_u16; COUNT];
            for (y, z) in rows() {
                let to = &mut all[(z * SIDE + y) * SIDE..][..size.x];
                to.iter_mut().zip(&numbers[begin(y, z)..]).for_each(|(to, &n)| *to = n.into());
            }
            Tile::of(&all)
        };
        Self { dims, tiles: (0..count.element_product()).into_par_iter().map(tile).collect() }
    }

    /// The same number everywhere.
    pub fn all(dims: [usize; 3], number: u16) -> Self {
        let dims = USizeVec3::from(dims);
        Self { dims, tiles: vec![Tile::All(number); tiles_of(dims).element_product()] }
    }

    fn tile(&self, at: USizeVec3) -> (usize, usize) {
        let (tile, within, count) = (at / SIDE, at % SIDE, tiles_of(self.dims));
        ((tile.z * count.y + tile.y) * count.x + tile.x, (within.z * SIDE + within.y) * SIDE + within.x)
    }

    /// That of a sample.
    pub fn at(&self, at: USizeVec3) -> u16 {
        let (tile, n) = self.tile(at);
        self.tiles[tile].at(n)
    }

    /// Gives a sample another one.
    pub fn set(&mut self, at: USizeVec3, number: u16) {
        let (tile, n) = self.tile(at);
        self.tiles[tile].set(n, number);
    }

    /// Those of a sample and as many behind it along i as there is room for.
    pub fn read(&self, mut from: USizeVec3, mut out: &mut [u16]) {
        while !out.is_empty() {
            let (tile, n) = self.tile(from);
            let (now, rest) = out.split_at_mut((SIDE - from.x % SIDE).min(out.len()));
            match &self.tiles[tile] {
                Tile::All(number) => now.fill(*number),
                Tile::Bytes(numbers) => now.iter_mut().zip(&numbers[n..]).for_each(|(to, n)| *to = u16::from(*n)),
                Tile::Words(numbers) => now.copy_from_slice(&numbers[n..][..now.len()]),
            }
            from.x += now.len();
            out = rest;
        }
    }

    /// For each tile its first sample, how many it has along each axis, and its number where that is the same for all of them.
    pub fn tiles(&self) -> impl IndexedParallelIterator<Item = (USizeVec3, USizeVec3, Option<u16>)> + '_ {
        let count = tiles_of(self.dims);
        self.tiles.par_iter().enumerate().map(move |(n, tile)| {
            let first = place_of(n, count) * SIDE;
            (first, (self.dims - first).min(USizeVec3::splat(SIDE)), if let Tile::All(number) = tile { Some(*number) } else { None })
        })
    }

    /// For each number whether some sample has it; 0 may seem to be there.
    pub fn seen(&self) -> Vec<bool> {
        let mut seen = vec![false; 1 << 16];
        for tile in &self.tiles {
            match tile {
                Tile::All(number) => seen[usize::from(*number)] = true,
                Tile::Bytes(numbers) => numbers.iter().for_each(|n| seen[usize::from(*n)] = true),
                Tile::Words(numbers) => numbers.iter().for_each(|n| seen[usize::from(*n)] = true),
            }
        }
        seen
    }

    /// All of them one behind the other, i fastest: bytes up to number 255, else words.
    pub fn samples(&self) -> Samples {
        let mut all = vec![0_u16; self.dims.element_product()];
        all.par_chunks_mut(self.dims.x).enumerate().for_each(|(row, out)| {
            self.read(USizeVec3::new(0, row % self.dims.y, row / self.dims.y), out);
        });
        match all.par_iter().all(|n| *n <= u16::from(u8::MAX)) {
            true => Samples::U8(all.par_iter().map(|&n| n as u8).collect()),
            false => Samples::U16(all),
        }
    }

    /// Memory that is its own and not `other`'s, in bytes: what a step of undo holds.
    pub fn bytes_beside(&self, other: &Self) -> usize {
        let is_shared = |a: &Tile, b: &Tile| match (a, b) {
            (Tile::Bytes(a), Tile::Bytes(b)) => Arc::ptr_eq(a, b),
            (Tile::Words(a), Tile::Words(b)) => Arc::ptr_eq(a, b),
            _ => false,
        };
        let bytes = |tile: &Tile| match tile {
            Tile::All(_) => 0,
            Tile::Bytes(numbers) => numbers.len(),
            Tile::Words(numbers) => 2 * numbers.len(),
        };
        self.tiles.iter().zip(&other.tiles).filter(|(a, b)| !is_shared(a, b)).map(|(a, _)| bytes(a)).sum()
    }
}

fn tiles_of(dims: USizeVec3) -> USizeVec3 {
    (dims + SIDE - 1) / SIDE
}

fn place_of(n: usize, count: USizeVec3) -> USizeVec3 {
    USizeVec3::new(n % count.x, n / count.x % count.y, n / (count.x * count.y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_synthetic::Random;

    #[test]
    fn numbers_are_what_was_put_there_and_copies_stay_what_they_were() {
        // Fails if a tile at the grid's end holds another's samples, a number above 255 loses its high bits, or a copy changes with its original.
        let mut random = Random(11);
        for dims in [[40, 17, 33], [16, 16, 16], [1, 50, 3], [130, 2, 1]] {
            let count: usize = dims.iter().product();
            let mut plain: Vec<u16> = (0..count).map(|n| if n % 7 < 5 { 3 } else { (4.0 * random.unit()) as u16 }).collect();
            let mut numbers = Numbers::of(dims, &plain);
            let place = |n: usize| USizeVec3::new(n % dims[0], n / dims[0] % dims[1], n / (dims[0] * dims[1]));
            let (before, was) = (numbers.clone(), plain.clone());
            for _ in 0..300 {
                let (n, number) = ((random.unit() * count as f64) as usize, (random.unit() * 600.0) as u16);
                plain[n] = number;
                numbers.set(place(n), number);
            }
            assert!((0..count).all(|n| numbers.at(place(n)) == plain[n] && before.at(place(n)) == was[n]), "{dims:?}");
            let samples = |numbers: &Numbers| match numbers.samples() {
                Samples::U16(all) => all,
                Samples::U8(all) => all.into_iter().map(u16::from).collect(),
                other => panic!("{}", other.type_name()),
            };
            assert!(samples(&numbers) == plain && samples(&before) == was);
            let seen = numbers.seen();
            assert!((1..=u16::MAX).all(|n| seen[usize::from(n)] == plain.contains(&n)));
        }
    }
}
