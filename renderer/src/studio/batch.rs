//! Paths side by side in memory: what is left of them is kept together, so that packets of sixteen stay full.

use super::bone::Rays;
use super::sampling::Words;
use crate::lanes::{Doubles, Floats, LANES, Mask, Vecs, axes, numbers};
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// Numbers of a picture's pixel in one sample, or their sum over samples: red, green, blue and coverage of what is drawn, premultiplied; of a
/// ground that only catches shadows the light that comes and that would come without bone, and in how many samples it is seen.
pub(crate) const CHANNELS: usize = 7;
/// Of what is seen first: colour, normal, and depth in mm; for the denoiser.
pub(crate) const GUIDES: usize = 7;

/// Where in [`CHANNELS`].
pub(crate) const COVERAGE: usize = 3;
pub(crate) const LIT: usize = 4;
pub(crate) const UNLIT: usize = 5;
pub(crate) const CAUGHT: usize = 6;

/// Rays that go on, in order.
pub(super) struct Paths {
    pub count: usize,
    /// Of which sample in the batch.
    pub slot: Vec<u32>,
    key: Vec<u32>,
    index: Vec<u32>,
    origin: [Vec<f64>; 3],
    direction: [Vec<f32>; 3],
    /// Share of the light that comes along the ray which reaches the eye.
    throughput: [Vec<f32>; 3],
    /// How densely the direction was sampled.
    density: Vec<f32>,
}

/// Sixteen of them.
pub(super) struct Packet<S: Simd> {
    pub is: Mask<S>,
    pub slot: [u32; LANES],
    pub key: Words<S>,
    pub index: Words<S>,
    pub rays: Rays<S>,
    pub throughput: Vecs<S>,
    pub density: Floats<S>,
}

impl Paths {
    /// Room for so many, and for a packet of others behind the last.
    pub fn of(most: usize) -> Self {
        let most = most + LANES;
        let floats = || vec![0.0; most];
        let words = || vec![0; most];
        Self {
            count: 0,
            slot: words(),
            key: words(),
            index: words(),
            origin: [vec![0.0; most], vec![0.0; most], vec![0.0; most]],
            direction: [floats(), floats(), floats()],
            throughput: [floats(), floats(), floats()],
            density: floats(),
        }
    }

    /// The packet that begins at number `from`.
    #[inline(always)]
    pub fn packet<S: Simd>(&self, simd: S, from: usize) -> Packet<S> {
        let bits = (1_u64 << (self.count - from).min(LANES)) - 1;
        let floats = |v: &Vec<f32>| Floats::from_slice(simd, &v[from..from + LANES]);
        let words = |v: &Vec<u32>| Words::from_slice(simd, &v[from..from + LANES]);
        let rays = Rays {
            origin: axes!(a => Doubles::from_slice(simd, &self.origin[a][from..from + LANES])),
            direction: axes!(a => floats(&self.direction[a])),
        };
        Packet {
            is: Mask::from_bitmask(simd, bits),
            slot: *self.slot[from..].first_chunk().expect("there is room for a packet behind the last path"),
            key: words(&self.key),
            index: words(&self.index),
            rays,
            throughput: axes!(a => floats(&self.throughput[a])),
            density: floats(&self.density),
        }
    }

    /// Adds those of a packet that are in `of`.
    #[inline(always)]
    pub fn push<S: Simd>(&mut self, packet: &Packet<S>, of: Mask<S>) {
        let (key, index) = (packet.key.to_array(), packet.index.to_array());
        let origin = axes!(a => packet.rays.origin[a].to_array());
        let direction = axes!(a => packet.rays.direction[a].to_array());
        let throughput = axes!(a => packet.throughput[a].to_array());
        let density = packet.density.to_array();
        for lane in numbers(of) {
            let n = self.count;
            (self.slot[n], self.key[n], self.index[n]) = (packet.slot[lane], key[lane], index[lane]);
            for a in 0..3 {
                self.origin[a][n] = origin[a][lane];
                self.direction[a][n] = direction[a][lane];
                self.throughput[a][n] = throughput[a][lane];
            }
            self.density[n] = density[lane];
            self.count += 1;
        }
    }
}

impl Paths {
    /// Puts those that go the same way side by side: by the octant of their direction, in `sorted`. They pass the same bricks, or at least step alike.
    pub fn sort_into(&self, sorted: &mut Self) {
        let octant = |n: usize| (0..3).map(|a| usize::from(self.direction[a][n] < 0.0) << a).sum::<usize>();
        let mut next = [0; 9];
        (0..self.count).for_each(|n| next[octant(n) + 1] += 1);
        (0..8).for_each(|n| next[n + 1] += next[n]);
        for n in 0..self.count {
            let to = next[octant(n)];
            next[octant(n)] += 1;
            (sorted.slot[to], sorted.key[to], sorted.index[to]) = (self.slot[n], self.key[n], self.index[n]);
            for a in 0..3 {
                sorted.origin[a][to] = self.origin[a][n];
                sorted.direction[a][to] = self.direction[a][n];
                sorted.throughput[a][to] = self.throughput[a][n];
            }
            sorted.density[to] = self.density[n];
        }
        sorted.count = self.count;
    }
}

/// Light on its way from lamps, and what it adds to if nothing is between.
pub(super) struct Shadows {
    pub count: usize,
    pub slot: Vec<u32>,
    origin: [Vec<f64>; 3],
    direction: [Vec<f32>; 3],
    far: Vec<f32>,
    light: [Vec<f32>; 3],
}

impl Shadows {
    pub fn of(most: usize) -> Self {
        let most = most + LANES;
        let floats = || vec![0.0; most];
        Self {
            count: 0,
            slot: vec![0; most],
            origin: [vec![0.0; most], vec![0.0; most], vec![0.0; most]],
            direction: [floats(), floats(), floats()],
            far: floats(),
            light: [floats(), floats(), floats()],
        }
    }

    /// Which of a packet there are, its rays, how far these go, and what they bring.
    #[inline(always)]
    pub fn packet<S: Simd>(&self, simd: S, from: usize) -> (Mask<S>, Rays<S>, Floats<S>) {
        let bits = (1_u64 << (self.count - from).min(LANES)) - 1;
        let floats = |v: &Vec<f32>| Floats::from_slice(simd, &v[from..from + LANES]);
        let rays = Rays {
            origin: axes!(a => Doubles::from_slice(simd, &self.origin[a][from..from + LANES])),
            direction: axes!(a => floats(&self.direction[a])),
        };
        (Mask::from_bitmask(simd, bits), rays, floats(&self.far))
    }

    /// What number `n` brings.
    pub fn light(&self, n: usize) -> [f32; 3] {
        [self.light[0][n], self.light[1][n], self.light[2][n]]
    }

    #[inline(always)]
    pub fn push<S: Simd>(&mut self, slot: &[u32; LANES], rays: &Rays<S>, far: Floats<S>, light: &Vecs<S>, of: Mask<S>) {
        let origin = axes!(a => rays.origin[a].to_array());
        let direction = axes!(a => rays.direction[a].to_array());
        let (far, light) = (far.to_array(), axes!(a => light[a].to_array()));
        for lane in numbers(of) {
            let n = self.count;
            (self.slot[n], self.far[n]) = (slot[lane], far[lane]);
            for a in 0..3 {
                self.origin[a][n] = origin[a][lane];
                self.direction[a][n] = direction[a][lane];
                self.light[a][n] = light[a][lane];
            }
            self.count += 1;
        }
    }
}

/// What the samples of a batch see.
pub(super) struct Found {
    pub light: Vec<[f32; CHANNELS]>,
    pub guides: Vec<[f32; GUIDES]>,
}

impl Found {
    pub fn of(most: usize) -> Self {
        Self { light: vec![[0.0; CHANNELS]; most], guides: vec![[0.0; GUIDES]; most] }
    }

    /// Adds light to samples.
    #[inline(always)]
    pub fn add<S: Simd>(&mut self, slot: &[u32; LANES], light: &Vecs<S>, of: Mask<S>) {
        let light = axes!(a => light[a].to_array());
        for lane in numbers(of) {
            let sum = &mut self.light[slot[lane] as usize];
            (0..3).for_each(|a| sum[a] += light[a][lane]);
        }
    }

    /// Adds light that would come without bone.
    #[inline(always)]
    pub fn add_unlit<S: Simd>(&mut self, slot: &[u32; LANES], light: &Vecs<S>, of: Mask<S>) {
        let light = axes!(a => light[a].to_array());
        for lane in numbers(of) {
            self.light[slot[lane] as usize][UNLIT] += light[0][lane] + light[1][lane] + light[2][lane];
        }
    }
}
