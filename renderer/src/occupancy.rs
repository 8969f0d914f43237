//! Which bricks can hold the surface, and how far a ray may leap from those that cannot.

use bregma_volume::RangeBricks;

/// For each brick the Chebyshev distance, in bricks, to the nearest brick that can hold the surface: 0 there, and from a
/// brick at distance k every brick within k − 1 is empty. Capped at 255.
#[derive(Clone, Debug, PartialEq)]
pub struct DistanceMap {
    dims: [usize; 3],
    distances: Vec<u8>,
    exposed: Vec<u32>,
}

impl DistanceMap {
    /// The map for the surface at `level` (sample units) where samples of `sign` ≥ `sign`·`level` are inside. A brick that
    /// lies wholly inside counts as occupied: a ray may enter it through the box's face, where the surface is closed.
    pub fn build(bricks: &RangeBricks, level: f32, sign: f32) -> Self {
        let reaches = |range: &[f32; 2]| sign * (range[usize::from(sign > 0.0)] - level) >= 0.0;
        let distances = bricks.ranges().iter().map(|range| if reaches(range) { 0 } else { u8::MAX }).collect();
        let mut map = Self { dims: bricks.dims(), distances, exposed: vec![] };
        map.sweep(1);
        map.sweep(-1);
        map.exposed = map.occupied().into_iter().filter(|&brick| map.is_exposed(brick as usize)).collect();
        map
    }

    /// Whether a brick lies at the border or next to an empty one, across a face.
    fn is_exposed(&self, brick: usize) -> bool {
        let strides = [1, self.dims[0], self.dims[0] * self.dims[1]];
        (0..3).any(|a| {
            let at = brick / strides[a] % self.dims[a];
            at == 0 || at + 1 == self.dims[a] || self.distances[brick - strides[a]] > 0 || self.distances[brick + strides[a]] > 0
        })
    }

    /// The bricks that can hold the surface or lie inside, by number, i fastest.
    pub fn occupied(&self) -> Vec<u32> {
        self.distances.iter().enumerate().filter(|(_, d)| **d == 0).map(|(n, _)| n as u32).collect()
    }

    /// Those of them that a ray from outside can meet first: at the border or next to an empty brick.
    pub fn exposed(&self) -> &[u32] {
        &self.exposed
    }

    /// One of the two passes of the chessboard distance transform (Rosenfeld and Pfaltz 1968): each brick takes the least of
    /// the 13 neighbours already passed, plus one.
    fn sweep(&mut self, way: isize) {
        let dims = self.dims.map(|n| n as isize);
        let [nx, ny, nz] = dims;
        let behind: Vec<[isize; 3]> =
            (0..13).map(|n| [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1]).map(|o: [isize; 3]| o.map(|c| c * way)).collect();
        let count = nx * ny * nz;
        for n in 0..count {
            let at = if way > 0 { n } else { count - 1 - n };
            let p = [at % nx, at / nx % ny, at / (nx * ny)];
            let mut best = self.distances[at as usize];
            for o in &behind {
                let q = [p[0] + o[0], p[1] + o[1], p[2] + o[2]];
                if best > 1 && (0..3).all(|a| (0..dims[a]).contains(&q[a])) {
                    best = best.min(self.distances[((q[2] * ny + q[1]) * nx + q[0]) as usize].saturating_add(1));
                }
            }
            self.distances[at as usize] = best;
        }
    }

    /// Bricks along i, j and k.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// Memory that it takes.
    pub(crate) fn bytes(&self) -> usize {
        self.distances.len() + size_of_val(self.exposed.as_slice())
    }

    /// The distances, i fastest.
    pub fn distances(&self) -> &[u8] {
        &self.distances
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_the_true_chessboard_distances() {
        // Fails if a sweep misses a neighbour: a ray would leap over bone.
        let dims = [7 * 8 + 1, 5 * 8 + 1, 4 * 8 + 1];
        let mut samples = vec![0_i16; dims.iter().product()];
        for (x, y, z) in [(3, 3, 3), (52, 20, 12), (30, 36, 28)] {
            samples[(z * dims[1] + y) * dims[0] + x] = 100;
        }
        for (level, sign) in [(50.0, 1.0), (-50.0, -1.0)] {
            let sampled: Vec<i16> = samples.iter().map(|s| s * sign as i16).collect();
            let map = DistanceMap::build(&RangeBricks::build(&sampled, dims), level, sign);
            let bricks: [[i32; 3]; 3] = [[0, 0, 0], [6, 2, 1], [3, 4, 3]];
            for (n, &d) in map.distances().iter().enumerate() {
                let p = [n % 7, n / 7 % 5, n / 35].map(|c| c as i32);
                let nearest = bricks.iter().map(|b| (0..3).map(|a| (b[a] - p[a]).abs()).max().unwrap()).min();
                assert_eq!(Some(i32::from(d)), nearest, "{p:?}");
            }
        }
    }
}
