//! Noise taken away by an à-trous filter (Dammertz et al. 2010), guided by what is seen first: it does not blur over edges of depth, of form or of
//! colour, and it does invent what lies between samples.

use super::accumulate::Exposed;
use super::batch::{CAUGHT, CHANNELS, COVERAGE, GUIDES};
use super::tone::Toned;
use glam::{Vec3, Vec4};
use rayon::prelude::*;

/// Passes, each over twice the distance of the one before.
const LEVELS: u32 = 4;
/// Weights of a pixel's neighbours, 0 to 2 away: the cubic B-spline's.
const KERNEL: [f32; 3] = [3.0 / 8.0, 1.0 / 4.0, 1.0 / 16.0];
/// Normals so unlike count for e⁻¹, as the square of their difference; and depths, in parts of the depth; and light, in its own noise.
const NORMALS: f32 = 0.05;
const DEPTHS: f32 = 0.01;
const NOISES: f32 = 3.0;
/// What is so unlike counts for less than float32 resolves beside the pixel itself.
const UNLIKE: f32 = 17.0;

/// A pixel: its light over its first colour, what it is of, and the variance of its brightness.
#[derive(Clone, Copy)]
struct Pixel {
    light: Vec3,
    variance: f32,
    normal: Vec3,
    depth: f32,
}

/// The picture's colours, premultiplied, with its opacity, as [`Toned::color`] has them.
pub(super) fn denoised(exposed: &Exposed, toned: &Toned) -> Vec<Vec4> {
    let [width, height] = exposed.size();
    let all = |n: usize| (n as u32 % width, n as u32 / width);
    let count = width as usize * height as usize;
    let mut pixels: Vec<Pixel> = (0..count).into_par_iter().map(|n| pixel(exposed, all(n))).collect();
    for level in 0..LEVELS {
        pixels = (0..count).into_par_iter().map(|n| smoothed(&pixels, [width, height], all(n), 1 << level)).collect();
    }
    let color = |n: usize| {
        let (x, y) = all(n);
        let (block, at) = exposed.at(x, y);
        let mut sums = block.sum(at);
        let light = pixels[n].light * albedo(&block.guides[at], &sums) * sums[COVERAGE];
        sums[..3].copy_from_slice(&light.to_array());
        toned.color(&sums, block.samples)
    };
    (0..count).into_par_iter().map(color).collect()
}

/// The mean first colour of what covers a pixel; white where nothing does.
fn albedo(guides: &[f32; GUIDES], sums: &[f32; CHANNELS]) -> Vec3 {
    let count = sums[COVERAGE] + sums[CAUGHT];
    if count > 0.0 { (Vec3::new(guides[0], guides[1], guides[2]) / count).max(Vec3::splat(1e-3)) } else { Vec3::ONE }
}

fn pixel(exposed: &Exposed, (x, y): (u32, u32)) -> Pixel {
    let (block, at) = exposed.at(x, y);
    let (sums, guides) = (block.sum(at), &block.guides[at]);
    let seen = (sums[COVERAGE] + sums[CAUGHT]).max(1e-6);
    let albedo = albedo(guides, &sums);
    let mean = |sums: &[f32; CHANNELS]| Vec3::new(sums[0], sums[1], sums[2]) / (sums[COVERAGE].max(1e-6) * albedo);
    let [a, b] = [mean(&block.halves[0][at]), mean(&block.halves[1][at])];
    let variance = ((a - b).element_sum() / 6.0).powi(2);
    Pixel { light: mean(&sums), variance, normal: Vec3::new(guides[3], guides[4], guides[5]) / seen, depth: guides[6] / seen }
}

fn smoothed(pixels: &[Pixel], [width, height]: [u32; 2], (x, y): (u32, u32), step: i64) -> Pixel {
    let own = pixels[(y * width + x) as usize];
    if own.depth == 0.0 {
        // Nothing is seen there.
        return own;
    }
    let [width, height, x, y] = [width, height, x, y].map(i64::from);
    let near = |dx: i64, dy: i64| {
        let (x, y) = (x + dx, y + dy);
        ((0..width).contains(&x) && (0..height).contains(&y)).then(|| &pixels[(y * width + x) as usize])
    };
    // A variance of two halves is itself uncertain: with its neighbours' it is less so.
    let (mut around, mut count) = (0.0, 0.0);
    for other in (-1..=1).flat_map(|dy| (-1..=1).filter_map(move |dx| near(dx, dy))) {
        around += other.variance;
        count += 1.0;
    }
    let per_noise = 1.0 / (9.0 * (NOISES * NOISES * around / count + 1e-8));
    let per_depth = 1.0 / (DEPTHS * own.depth.max(1e-3) * step as f32 * 0.5);
    let (mut light, mut variance, mut weights) = (Vec3::ZERO, 0.0, 0.0);
    for (dx, dy) in (-2..=2_i64).flat_map(|dy| (-2..=2_i64).map(move |dx| (dx, dy))) {
        let Some(other) = near(step * dx, step * dy) else { continue };
        let unlike = (other.normal - own.normal).length_squared() * (1.0 / NORMALS)
            + (other.depth - own.depth).abs() * per_depth
            + (other.light - own.light).element_sum().powi(2) * per_noise;
        if unlike > UNLIKE {
            continue;
        }
        let weight = KERNEL[dx.unsigned_abs() as usize] * KERNEL[dy.unsigned_abs() as usize] * (-unlike).exp();
        light += weight * other.light;
        variance += weight * weight * other.variance;
        weights += weight;
    }
    Pixel { light: light / weights, variance: variance / (weights * weights), ..own }
}
