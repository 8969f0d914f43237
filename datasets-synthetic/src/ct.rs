//! The scanner: partial volume, point spread, noise and rounding to whole HU.

use bregma_volume::{Cancelled, Grid, Progress};
use glam::DVec3;
use rayon::prelude::*;

/// Air.
pub const AIR_HU: f64 = -1000.0;

/// What is at a point.
#[derive(Clone, Copy, Debug)]
pub struct Material {
    /// Signed distance to the surface, negative inside.
    pub distance_mm: f64,
    /// HU of the material that is inside; only read near and inside the surface.
    pub inside_hu: f64,
}

/// An object in air, known at every point of the world.
pub trait Field: Sync {
    /// `distance_mm` changes by at most this much per mm.
    const LIPSCHITZ: f64;

    /// What is at `p` (LPS, mm).
    fn material(&self, p: DVec3) -> Material;
}

/// A CT scanner. Its noise is white, as no reconstruction's is, so that its mean and deviation are all there is to know.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scanner {
    /// Standard deviation of the Gaussian point spread, applied along each grid axis: isotropic where those are orthogonal.
    pub psf_sigma_mm: f64,
    /// Standard deviation of the noise, white and Gaussian.
    pub noise_hu: f64,
    /// The noise is a function of this and of the sample's index alone.
    pub seed: u64,
}

/// Samples along a side of the blocks that are skipped as a whole, and slices in a slab of work.
const BLOCK: usize = 8;
/// Sub-samples along a side of a voxel that the surface may pass: eight of them, one at each corner of a cube.
const SUB: usize = 2;

impl Scanner {
    /// Scans `field` on `grid`: HU, i fastest. Samples are averages over the cell of one spacing around them.
    /// The same arguments give the same bytes, whatever the number of threads.
    pub fn scan<F: Field>(&self, field: &F, grid: &Grid, progress: &Progress) -> Result<Vec<i16>, Cancelled> {
        let [nx, ny, nz] = grid.dims();
        let plane = nx * ny;
        progress.begin(2 * nz.div_ceil(BLOCK) as u64);
        let kernels = grid.spacing_mm().to_array().map(|spacing| gaussian(self.psf_sigma_mm / spacing));
        let mut sharp = vec![AIR_HU as f32; grid.len()];
        sharp.par_chunks_mut(BLOCK * plane).enumerate().try_for_each(|(slab, values)| {
            fill(field, grid, slab * BLOCK, values);
            let (mut source, mut line) = (Vec::new(), Vec::new());
            for values in values.chunks_mut(plane) {
                source.clear();
                source.extend_from_slice(values);
                // Air is most of a scan, and a constant stays itself.
                if source.iter().all(|v| *v == source[0]) {
                    continue;
                }
                for (j, row) in values.chunks_mut(nx).enumerate() {
                    blur_across(row, &source, j, &kernels[1]);
                    blur_along(row, &kernels[0], &mut line);
                }
            }
            progress.advance(1)
        })?;
        let mut hu = vec![0_i16; grid.len()];
        hu.par_chunks_mut(BLOCK * plane).enumerate().try_for_each(|(slab, out)| {
            let mut sums = vec![0.0_f32; plane];
            for (k, out) in out.chunks_mut(plane).enumerate() {
                let k = slab * BLOCK + k;
                blur_across(&mut sums, &sharp, k, &kernels[2]);
                for (i, (out, sum)) in out.iter_mut().zip(&sums).enumerate() {
                    let noise = if self.noise_hu > 0.0 { self.noise_hu * normal(self.seed, (k * plane + i) as u64) } else { 0.0 };
                    // The cast saturates: HU beyond 16 bits do not occur in scans.
                    *out = (f64::from(*sum) + noise).round() as i16;
                }
            }
            progress.advance(1)
        })?;
        Ok(hu)
    }
}

/// The unblurred slab that starts at slice `first`, block by block.
fn fill<F: Field>(field: &F, grid: &Grid, first: usize, values: &mut [f32]) {
    let [nx, ny, _] = grid.dims();
    let slices = values.len() / (nx * ny);
    let map = grid.index_to_world();
    let world = |x: f64, y: f64, z: f64| map.transform_point3(DVec3::new(x, y, z));
    // A voxel holds no surface if its centre is farther from it than its corners; a block, if its outermost voxels hold none.
    let voxel_reach = F::LIPSCHITZ * 0.5 * diagonal(grid, DVec3::ONE);
    let block_reach = F::LIPSCHITZ * 0.5 * diagonal(grid, DVec3::splat((BLOCK - 1) as f64)) + voxel_reach;
    // Where sub-samples lie on both sides of a thin wall their differences cancel: the ramp is never steeper than twice that
    // across the narrowest sub-voxel.
    let least_mm = 0.5 * grid.spacing_mm().min_element() / SUB as f64;
    let mid_block = 0.5 * (BLOCK - 1) as f64;
    for j0 in (0..ny).step_by(BLOCK) {
        for i0 in (0..nx).step_by(BLOCK) {
            let centre = world(i0 as f64 + mid_block, j0 as f64 + mid_block, first as f64 + mid_block);
            if field.material(centre).distance_mm > block_reach {
                continue; // All air, as the slab was made.
            }
            for k in 0..slices {
                for j in j0..(j0 + BLOCK).min(ny) {
                    for i in i0..(i0 + BLOCK).min(nx) {
                        let (x, y, z) = (i as f64, j as f64, (first + k) as f64);
                        let whole = field.material(world(x, y, z));
                        let hu = if whole.distance_mm.abs() > voxel_reach {
                            if whole.distance_mm < 0.0 { whole.inside_hu } else { AIR_HU }
                        } else {
                            average(|a, b, c| field.material(world(x + a, y + b, z + c)), least_mm)
                        };
                        values[(k * ny + j) * nx + i] = hu as f32;
                    }
                }
            }
        }
    }
}

/// Mean HU of a voxel, from `at` offsets from its centre in voxels.
///
/// In each sub-voxel the surface is taken as a plane, and the part of a box that lies behind a plane as a linear ramp of the
/// distance, with the standard deviation of the box's extent along the normal: exact for planes along the grid.
fn average(at: impl Fn(f64, f64, f64) -> Material, least_mm: f64) -> f64 {
    let sub: [Material; 8] = std::array::from_fn(|s| {
        let [a, b, c] = [s & 1, s >> 1 & 1, s >> 2].map(|n| (n as f64 + 0.5) / SUB as f64 - 0.5);
        at(a, b, c)
    });
    // Rise of the distance across one sub-voxel along each axis.
    let rise = [1, 2, 4].map(|bit| (0..8).map(|s| if s & bit == 0 { -sub[s].distance_mm } else { sub[s].distance_mm }).sum::<f64>() / 4.0);
    let width_mm = DVec3::from(rise).length().max(least_mm);
    let share = |m: &Material| (m.inside_hu - AIR_HU) * (0.5 - m.distance_mm / width_mm).clamp(0.0, 1.0);
    AIR_HU + sub.iter().map(share).sum::<f64>() / 8.0
}

/// The longest diagonal of the parallelepiped of `sides` index steps: its corners are that far apart at most.
fn diagonal(grid: &Grid, sides: DVec3) -> f64 {
    let m = grid.index_to_world().matrix3;
    let along = |sx: f64, sy: f64| (m * (sides * DVec3::new(sx, sy, 1.0))).length();
    along(1.0, 1.0).max(along(-1.0, 1.0)).max(along(1.0, -1.0)).max(along(-1.0, -1.0))
}

/// One half of a Gaussian's weights, centre first; all of them sum to 1. Cut at 4 σ, beyond which lie 6e-5 of it: 0.15 HU of
/// a step from air to bone.
fn gaussian(sigma: f64) -> Vec<f32> {
    let radius = (4.0 * sigma).ceil() as usize;
    if radius == 0 {
        return vec![1.0];
    }
    let weights: Vec<f64> = (0..=radius).map(|i| (-0.5 * (i as f64 / sigma).powi(2)).exp()).collect();
    let total = 2.0 * weights.iter().sum::<f64>() - weights[0];
    weights.iter().map(|w| (w / total) as f32).collect()
}

/// Row (or slice) `n` of `source`, whose rows are as long as `out`, convolved across rows; the ends are continued.
fn blur_across(out: &mut [f32], source: &[f32], n: usize, kernel: &[f32]) {
    let last = source.len() / out.len() - 1;
    let length = out.len();
    let row = |n: usize| &source[n * length..][..length];
    out.fill(0.0);
    for (offset, weight) in kernel.iter().enumerate() {
        let (before, after) = (row(n.saturating_sub(offset)), row((n + offset).min(last)));
        // The centre is one tap, and counted twice here.
        let weight = if offset == 0 { 0.5 * weight } else { *weight };
        out.iter_mut().zip(before.iter().zip(after)).for_each(|(sum, (a, b))| *sum += weight * (a + b));
    }
}

/// Convolves a row in place; the ends are continued.
fn blur_along(row: &mut [f32], kernel: &[f32], line: &mut Vec<f32>) {
    let (radius, last) = (kernel.len() - 1, row.len() - 1);
    line.clear();
    line.extend((0..row.len() + 2 * radius).map(|n| row[n.saturating_sub(radius).min(last)]));
    for (n, value) in row.iter_mut().enumerate() {
        let centre = n + radius;
        let sides = (1..=radius).map(|r| kernel[r] * (line[centre - r] + line[centre + r]));
        *value = kernel[0] * line[centre] + sides.sum::<f32>();
    }
}

/// A standard normal number that depends on (seed, index) only: SplitMix64 (Steele et al. 2014) as a counter-based hash, then
/// Box and Muller (1958).
fn normal(seed: u64, index: u64) -> f64 {
    let mix = |x: u64| {
        let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    };
    // Seeds are hashed first, so that neighbouring seeds do not share shifted noise.
    let bits = |n: u64| mix(mix(seed).wrapping_add((2 * index + n + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15)));
    // 53 bits, moved by half a step off zero, whose logarithm is not finite.
    let unit = |n: u64| ((bits(n) >> 11) as f64 + 0.5) * (-53.0_f64).exp2();
    (-2.0 * unit(0).ln()).sqrt() * (std::f64::consts::TAU * unit(1)).cos()
}
