//! The scanner: partial volume, point spread, noise and rounding to whole HU.

use bregma_volume::{Cancelled, Grid, Progress};
use glam::{DAffine3, DVec3};
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

    /// The same within `radius_mm` of `p`, without what does not count there; `None` where that is no less work.
    fn near(&self, _p: DVec3, _radius_mm: f64) -> Option<Self>
    where
        Self: Sized,
    {
        None
    }
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
/// For single voxels, finding what of a field counts costs more than it spares.
const LEAST_NEAR: usize = 2;
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
                self.add_noise(&mut sums, k * plane);
                // The cast saturates: HU beyond 16 bits do not occur in scans.
                out.iter_mut().zip(&sums).for_each(|(out, sum)| *out = sum.round_ties_even() as i16);
            }
            progress.advance(1)
        })?;
        Ok(hu)
    }

    /// Adds the noise of the samples from `first` on.
    fn add_noise(&self, hu: &mut [f32], first: usize) {
        if self.noise_hu == 0.0 {
            return;
        }
        let seed = mix(self.seed);
        // Numbers come in pairs; a plane may begin with the second of one.
        let (head, rest) = hu.split_at_mut(first % 2);
        let add = |hu: &mut f32, noise: f64| *hu += (self.noise_hu * noise) as f32;
        head.iter_mut().for_each(|hu| add(hu, normals(seed, first as u64 / 2)[1]));
        for (n, pair) in rest.chunks_mut(2).enumerate() {
            pair.iter_mut().zip(normals(seed, first.div_ceil(2) as u64 + n as u64)).for_each(|(hu, noise)| add(hu, noise));
        }
    }
}

/// The unblurred slab that starts at slice `first`, block by block.
fn fill<F: Field>(field: &F, grid: &Grid, first: usize, values: &mut [f32]) {
    let [nx, ny, _] = grid.dims();
    let slices = values.len() / (nx * ny);
    let mut slab = Slab { sampling: Sampling::new::<F>(grid), size: [nx, ny, slices], first, values };
    for j in (0..ny).step_by(BLOCK) {
        for i in (0..nx).step_by(BLOCK) {
            slab.cube(field, [i, j, 0], BLOCK);
        }
    }
}

/// How a grid's points lie, and how far surfaces reach.
struct Sampling {
    map: DAffine3,
    /// A voxel holds no surface if its centre is farther from it than its corners.
    voxel_reach: f64,
    /// Half the diagonal of a block of one step.
    half_diagonal: f64,
    /// Where sub-samples lie on both sides of a thin wall their differences cancel: the ramp is never steeper than twice that
    /// across the narrowest sub-voxel.
    least_mm: f64,
}

impl Sampling {
    fn new<F: Field>(grid: &Grid) -> Self {
        let half_diagonal = 0.5 * diagonal(grid);
        let least_mm = 0.5 * grid.spacing_mm().min_element() / SUB as f64;
        Self { map: grid.index_to_world(), voxel_reach: F::LIPSCHITZ * half_diagonal, half_diagonal, least_mm }
    }

    fn world(&self, x: f64, y: f64, z: f64) -> DVec3 {
        self.map.transform_point3(DVec3::new(x, y, z))
    }

    /// From the middle of a cube of `side` voxels to its outermost voxels' centres.
    fn radius_mm(&self, side: usize) -> f64 {
        (side - 1) as f64 * self.half_diagonal
    }
}

/// Slices from `first` on.
struct Slab<'a> {
    sampling: Sampling,
    size: [usize; 3],
    first: usize,
    values: &'a mut [f32],
}

impl Slab<'_> {
    /// Fills the cube of `side` voxels whose least corner is `at`, each by its eight halves, down to voxels.
    fn cube<F: Field>(&mut self, field: &F, at: [usize; 3], side: usize) {
        if (0..3).any(|axis| at[axis] >= self.size[axis]) {
            return;
        }
        if side == 1 {
            return self.voxel(field, at);
        }
        let middle = self.middle(at, side);
        if self.is_air(field, middle, side) {
            return;
        }
        // Sub-samples lie in the middle of an eighth of their voxel.
        let reach_mm = self.sampling.radius_mm(side) + 0.5 * self.sampling.half_diagonal;
        let near = if side >= LEAST_NEAR { field.near(middle, reach_mm) } else { None };
        let half = side / 2;
        for n in 0..8 {
            self.cube(near.as_ref().unwrap_or(field), [at[0] + (n & 1) * half, at[1] + (n >> 1 & 1) * half, at[2] + (n >> 2) * half], half);
        }
    }

    fn middle(&self, [i, j, k]: [usize; 3], side: usize) -> DVec3 {
        let half = 0.5 * (side - 1) as f64;
        self.sampling.world(i as f64 + half, j as f64 + half, (self.first + k) as f64 + half)
    }

    /// No voxel of a cube holds surface or what is inside; the slab was made of air.
    fn is_air<F: Field>(&self, field: &F, middle: DVec3, side: usize) -> bool {
        field.material(middle).distance_mm > F::LIPSCHITZ * self.sampling.radius_mm(side) + self.sampling.voxel_reach
    }

    fn voxel<F: Field>(&mut self, field: &F, at: [usize; 3]) {
        let [x, y, z] = [at[0], at[1], self.first + at[2]].map(|n| n as f64);
        let sampling = &self.sampling;
        let whole = field.material(sampling.world(x, y, z));
        let hu = if whole.distance_mm > sampling.voxel_reach {
            AIR_HU
        } else if whole.distance_mm < -sampling.voxel_reach {
            whole.inside_hu
        } else {
            average(|a, b, c| field.material(sampling.world(x + a, y + b, z + c)), sampling.least_mm)
        };
        self.values[(at[2] * self.size[1] + at[1]) * self.size[0] + at[0]] = hu as f32;
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

/// The longest diagonal of the parallelepiped of one index step: its corners are that far apart at most.
fn diagonal(grid: &Grid) -> f64 {
    let m = grid.index_to_world().matrix3;
    let along = |sx: f64, sy: f64| (m * DVec3::new(sx, sy, 1.0)).length();
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
    row.iter_mut().zip(&line[radius..]).for_each(|(sum, value)| *sum = kernel[0] * value);
    for (r, weight) in kernel.iter().enumerate().skip(1) {
        let sides = line[radius - r..].iter().zip(&line[radius + r..]);
        row.iter_mut().zip(sides).for_each(|(sum, (a, b))| *sum += weight * (a + b));
    }
}

/// Two standard normal numbers that depend on (seed, pair) only: SplitMix64 (Steele et al. 2014) as a counter-based hash, then
/// Box and Muller (1958). Seeds are hashed first, so that neighbouring seeds do not share shifted noise.
fn normals(hashed_seed: u64, pair: u64) -> [f64; 2] {
    let bits = |n: u64| mix(hashed_seed.wrapping_add((2 * pair + n + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15)));
    // 53 bits, moved by half a step off zero, whose logarithm is not finite.
    let unit = |n: u64| ((bits(n) >> 11) as f64 + 0.5) * (-53.0_f64).exp2();
    let (radius, (sine, cosine)) = ((-2.0 * unit(0).ln()).sqrt(), (std::f64::consts::TAU * unit(1)).sin_cos());
    [radius * cosine, radius * sine]
}

fn mix(x: u64) -> u64 {
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}
