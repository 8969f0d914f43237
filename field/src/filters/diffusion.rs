//! Diffusion that stops at edges, as ITK's `GradientNDAnisotropicDiffusionFunction` has it: what flows between two neighbours is their difference
//! times exp(−|∇|²/(2·g²·c²)), g² the mean of |∇|² over the scan before each step and c the conductance. What flows out of one flows into the other,
//! so each flow is worked out once.

use bregma_volume::{Cancelled, Progress, Sample};
use glam::DVec3;
use rayon::prelude::*;

/// How samples diffuse.
pub struct Diffusion {
    /// Samples along each axis.
    pub dims: [usize; 3],
    /// Their distances.
    pub spacing_mm: DVec3,
    /// Edges steeper than so many times the mean stay.
    pub conductance: f64,
    /// Length of a step.
    pub time_step: f64,
}

/// Slices that a thread takes at once; it keeps old copies of two, and of those beside them.
const THICK: usize = 8;

/// Slices as they were: the one before, the one at hand and the one behind; at the grid's ends the one at hand stands for others.
#[derive(Clone, Copy)]
struct Around<'a> {
    before: &'a [f32],
    here: &'a [f32],
    behind: &'a [f32],
}

impl Diffusion {
    /// The samples after so many steps.
    pub fn run<T: Sample>(&self, samples: &[T], iterations: usize, progress: &Progress) -> Result<Vec<f32>, Cancelled> {
        progress.begin((iterations * self.dims[2]) as u64);
        let mut values: Vec<f32> = samples.par_iter().map(|s| s.to_f32()).collect();
        for _ in 0..iterations {
            self.step(&mut values, progress)?;
        }
        Ok(values)
    }

    fn step(&self, values: &mut [f32], progress: &Progress) -> Result<(), Cancelled> {
        let slice = self.dims[0] * self.dims[1];
        let steep = self.conductance.powi(2) * self.mean_square_gradient(values);
        // Where nothing is steep, nothing flows.
        if steep == 0.0 {
            return progress.advance(self.dims[2] as u64);
        }
        let rate = (-0.5 / steep) as f32;
        let slab = slice * THICK;
        let firsts: Vec<Vec<f32>> = values.chunks(slab).map(|slab| slab[..slice].to_vec()).collect();
        let lasts: Vec<Vec<f32>> = values.chunks(slab).map(|slab| slab[slab.len() - slice..].to_vec()).collect();
        values.par_chunks_mut(slab).enumerate().try_for_each(|(n, slab)| {
            let before = if n == 0 { &firsts[0] } else { &lasts[n - 1] };
            self.slab(slab, before, firsts.get(n + 1).map(Vec::as_slice), rate);
            progress.advance((slab.len() / slice) as u64)
        })
    }

    /// The mean over all samples of the squared gradient by central differences, in sample units² per mm².
    fn mean_square_gradient(&self, values: &[f32]) -> f64 {
        let [nx, ny, nz] = self.dims;
        let slice = nx * ny;
        let half = (0.5 / self.spacing_mm).as_vec3();
        let of_slice = |k: usize| -> f64 {
            let [before, behind] = [k.saturating_sub(1), (k + 1).min(nz - 1)].map(|k| &values[k * slice..][..slice]);
            let here = &values[k * slice..][..slice];
            let row = |j: usize| {
                let [above, below] = [j.saturating_sub(1), (j + 1).min(ny - 1)].map(|j| &here[j * nx..][..nx]);
                let at = j * nx;
                let square = |i: usize| {
                    let x = half.x * (here[at + (i + 1).min(nx - 1)] - here[at + i.saturating_sub(1)]);
                    let y = half.y * (below[i] - above[i]);
                    let z = half.z * (behind[at + i] - before[at + i]);
                    x * x + y * y + z * z
                };
                (0..nx).map(|i| f64::from(square(i))).sum::<f64>()
            };
            (0..ny).map(row).sum()
        };
        // Sums of slices are added in their order, whoever made them.
        let sums: Vec<f64> = (0..nz).into_par_iter().map(of_slice).collect();
        sums.iter().sum::<f64>() / values.len() as f64
    }

    fn slab(&self, slab: &mut [f32], before: &[f32], behind: Option<&[f32]>, rate: f32) {
        let slice = self.dims[0] * self.dims[1];
        let count = slab.len() / slice;
        let (mut before, mut here) = (before.to_vec(), slab[..slice].to_vec());
        // What flows into the first slice through its face, as the one before it would have it.
        let mut entering = vec![0.0; slice];
        self.through(&before, &here, rate, &mut entering);
        for k in 0..count {
            let (out, rest) = slab[k * slice..].split_at_mut(slice);
            let next = rest.get(..slice).or(behind).unwrap_or(&here).to_vec();
            self.slice(out, Around { before: &before, here: &here, behind: &next }, rate, &mut entering);
            (before, here) = (here, next);
        }
    }

    /// Flows from each sample of a slice to the one behind it.
    fn through(&self, here: &[f32], behind: &[f32], rate: f32, flows: &mut [f32]) {
        let [nx, ny, _] = self.dims;
        let [x, y, z] = (1.0 / self.spacing_mm).as_vec3().to_array();
        for (j, flows) in flows.chunks_mut(nx).enumerate() {
            let ([a, b, c], [d, e, f]) = (rows(here, j, [nx, ny]), rows(behind, j, [nx, ny]));
            for (i, flow) in flows.iter_mut().enumerate() {
                let (left, right) = (i.saturating_sub(1), (i + 1).min(nx - 1));
                let across = 0.25 * x * (b[right] - b[left] + e[right] - e[left]);
                let down = 0.25 * y * (c[i] - a[i] + f[i] - d[i]);
                *flow = flow_of(z * (e[i] - b[i]), across, down, rate);
            }
        }
    }

    /// A slice after a step. `entering` is what flows into it from the one before, and then from it to the one behind.
    fn slice(&self, out: &mut [f32], around: Around<'_>, rate: f32, entering: &mut [f32]) {
        let [nx, ny, _] = self.dims;
        let Around { before, here, behind } = around;
        let mut leaving = vec![0.0; entering.len()];
        self.through(here, behind, rate, &mut leaving);
        let dt = self.time_step as f32;
        let [x, y, z] = (1.0 / self.spacing_mm).as_vec3().to_array();
        let mut above = vec![0.0; nx];
        for (j, out) in out.chunks_mut(nx).enumerate() {
            let own = j * nx..(j + 1) * nx;
            let down = if j + 1 < ny { own.end..own.end + nx } else { own.clone() };
            let up = if j > 0 { own.start - nx..own.start } else { own.clone() };
            let (row, next, last) = (&here[own.clone()], &here[down.clone()], &here[up]);
            let (zb, zh) = (&before[own.clone()], &behind[own.clone()]);
            let (nb, nh) = (&before[down.clone()], &behind[down]);
            let mut left = 0.0;
            for i in 0..nx {
                let (west, east) = (i.saturating_sub(1), (i + 1).min(nx - 1));
                // To the next along i.
                let side = 0.25 * y * (next[i] - last[i] + next[east] - last[east]);
                let deep = 0.25 * z * (zh[i] - zb[i] + zh[east] - zb[east]);
                let right = flow_of(x * (row[east] - row[i]), side, deep, rate);
                // To the next along j.
                let side = 0.25 * x * (row[east] - row[west] + next[east] - next[west]);
                let deep = 0.25 * z * (zh[i] - zb[i] + nh[i] - nb[i]);
                let below = flow_of(y * (next[i] - row[i]), side, deep, rate);
                let flows = right - left + below - above[i] + leaving[own.start + i] - entering[own.start + i];
                out[i] = row[i] + dt * flows;
                (left, above[i]) = (right, below);
            }
        }
        entering.copy_from_slice(&leaving);
    }
}

/// The row before one of a slice, it, and the one behind.
fn rows(slice: &[f32], j: usize, [nx, ny]: [usize; 2]) -> [&[f32]; 3] {
    [j.saturating_sub(1), j, (j + 1).min(ny - 1)].map(|j| &slice[j * nx..][..nx])
}

/// What flows along a difference, with the gradient across it.
fn flow_of(along: f32, across: f32, down: f32, rate: f32) -> f32 {
    along * (rate * (along * along + across * across + down * down)).exp()
}
