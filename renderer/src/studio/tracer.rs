//! A scene under its studio's light, ready to be drawn on the CPU or on the GPU.

use super::accumulate::{BlockSums, Exposed};
use super::bone::{Bone, NEVER, Rays};
use super::bsdf::Coat;
use super::denoise::denoised;
use super::ground::Floor;
use super::lamps::{Disc, Dome};
use super::path::{AT_ONCE, PIXELS, Room, Stage, Ways};
use super::settings::{Ground, Studio, StudioError};
use super::tone::Toned;
#[cfg(feature = "gpu")]
use crate::gpu::{GpuRenderer, PathsOnGpu};
use crate::lanes::{Doubles, Floats, LANES, Mask, axes};
use crate::scene::Scene;
use crate::skip::MapCache;
use crate::{Backend, InstructionSet, RenderError};
use bregma_field::{Cancelled, Progress, Volume, smoothed};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, dispatch};
use glam::{DVec3, Vec3, Vec4};
use rayon::prelude::*;
use std::sync::Arc;
use thiserror::Error;

/// What is drawn, for as many samples as are asked for.
#[derive(Debug)]
pub struct Tracer {
    level: InstructionSet,
    /// What draws instead of the CPU.
    #[cfg(feature = "gpu")]
    gpu: Option<PathsOnGpu>,
    pub(super) stage: Stage,
    toned: Toned,
    /// Linear; where the picture is clear what its noise is judged on.
    background: Vec3,
}

/// What pictures of the same scans share, which takes longer than their first samples: smoothed scans, and where their surfaces can be.
#[derive(Debug)]
pub struct TracerCache {
    level: InstructionSet,
    maps: MapCache,
    /// A scan, the width of the Gaussian, and what came of it.
    smoothed: Vec<(Arc<Volume>, f64, Arc<Volume>)>,
}

/// Why samples are missing.
#[derive(Debug, Error)]
pub enum NotDrawn {
    /// Stopped by request.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// What draws failed.
    #[error(transparent)]
    Failed(#[from] RenderError),
}

impl Default for TracerCache {
    fn default() -> Self {
        Self::with_instructions(InstructionSet::new())
    }
}

impl TracerCache {
    /// With nothing known yet, for tracers by a set of vector instructions.
    pub fn with_instructions(level: InstructionSet) -> Self {
        Self { level, maps: MapCache::new(level), smoothed: vec![] }
    }

    /// Memory kept for surfaces, beside smoothed scans.
    pub(crate) fn bytes(&self) -> usize {
        self.maps.bytes()
    }

    /// The volumes as a studio shows them. Forgets what is not of these.
    fn shown(&mut self, volumes: &[Arc<Volume>], scene: &Scene, smooth_voxel: f64) -> Vec<Arc<Volume>> {
        self.smoothed.retain(|(of, sigma, _)| *sigma == smooth_voxel && volumes.iter().any(|volume| Arc::ptr_eq(volume, of)));
        let shown = volumes.iter().zip(&scene.layers).map(|(volume, layer)| {
            if smooth_voxel <= 0.0 || !layer.visible {
                return Arc::clone(volume);
            }
            if let Some((.., known)) = self.smoothed.iter().find(|(of, ..)| Arc::ptr_eq(of, volume)) {
                return Arc::clone(known);
            }
            let made = Arc::new(smoothed(volume, smooth_voxel));
            self.smoothed.push((Arc::clone(volume), smooth_voxel, Arc::clone(&made)));
            made
        });
        shown.collect()
    }
}

/// Samples that a pixel has at least before its block may rest: fewer do not tell their noise.
pub const LEAST_SAMPLES: u32 = 16;

impl Tracer {
    /// Of a scene that has a studio, in a picture of a size, on the CPU; other seeds have other noise. A picture is the same for a seed, to the bit, by any
    /// number of threads and any set of vector instructions.
    pub fn new(volumes: &[Arc<Volume>], scene: &Scene, [width, height]: [u32; 2], seed: u32) -> Result<Self, RenderError> {
        Self::with_instructions(InstructionSet::new(), volumes, scene, [width, height], seed)
    }

    /// The same by a set of vector instructions.
    pub fn with_instructions(
        level: InstructionSet,
        volumes: &[Arc<Volume>],
        scene: &Scene,
        size: [u32; 2],
        seed: u32,
    ) -> Result<Self, RenderError> {
        Self::reusing(&mut TracerCache::with_instructions(level), volumes, scene, size, seed)
    }

    /// The same by what is known of the scans from other pictures.
    pub fn reusing(
        cache: &mut TracerCache,
        volumes: &[Arc<Volume>],
        scene: &Scene,
        size: [u32; 2],
        seed: u32,
    ) -> Result<Self, RenderError> {
        let [width, height] = size;
        if width == 0 || height == 0 {
            return Err(RenderError::NoPixels { width, height });
        }
        scene.check()?;
        scene.check_parts()?;
        let studio = scene.studio.clone().ok_or(StudioError::Absent)?;
        studio.check()?;
        let volumes = cache.shown(volumes, scene, studio.smooth_voxel);
        cache.maps.keep_only(&scene.surfaces(&volumes)?, &[]);
        let bone = Bone::of(&mut cache.maps, &volumes, scene)?;
        let stage = Self::stage(cache.level, bone, scene, &studio, size, seed);
        let toned = Toned { tone: studio.tone, exposure: studio.exposure_ev.exp2() };
        let background = scene.background.map_or(Vec3::ONE, |color| color.linear());
        Ok(Self {
            level: cache.level,
            #[cfg(feature = "gpu")]
            gpu: None,
            stage,
            toned,
            background,
        })
    }

    /// The same, drawn on a GPU: by the same numbers, but that rounds as it likes, so that its pictures are like the CPU's and not the same.
    #[cfg(feature = "gpu")]
    pub(crate) fn on_gpu(self, gpu: &mut GpuRenderer) -> Result<Self, RenderError> {
        Ok(Self { gpu: PathsOnGpu::new(gpu, &self.stage)?, ..self })
    }

    /// What kind of machine draws.
    pub fn backend(&self) -> Backend {
        #[cfg(feature = "gpu")]
        if self.gpu.is_some() {
            return Backend::Gpu;
        }
        Backend::Cpu
    }

    fn stage(level: InstructionSet, bone: Bone, scene: &Scene, studio: &Studio, [width, height]: [u32; 2], seed: u32) -> Stage {
        let basis = scene.camera.basis();
        let toward = [basis.right, basis.up, -basis.forward];
        let lamps: Vec<Disc> = studio.lamps.iter().map(|lamp| Disc::of(lamp, lamp.toward(toward), bone.radius_mm)).collect();
        let up = scene.camera.up.try_normalize().unwrap_or(basis.up);
        // Seen along its up, the wall stands at the top of the picture.
        let level_with = |v: DVec3| (v - v.dot(up) * up).try_normalize();
        let behind = level_with(basis.forward).filter(|_| basis.forward.dot(up).abs() < 0.999).or_else(|| level_with(basis.up));
        let lamps_mm = lamps.iter().map(Disc::reach_mm).fold(0.0, f64::max);
        let floor = if studio.ground == Ground::None {
            None
        } else {
            let height_mm = lowest(level, &bone, up);
            Floor::of(&studio.ground, [up, behind.unwrap_or(basis.up)], height_mm, bone.radius_mm, lamps_mm)
        };
        let rays = scene.camera.pixel_rays(width, height);
        let (dome, coat) = (Dome::of(&studio.sky, up), Coat::of(studio.gloss));
        Stage { bone, lamps, dome, floor, coat, bounces: studio.bounces, rays, size: [width, height], seed, ways: Ways::Both }
    }

    /// Adds samples up to number `until` to each pixel; with a `noise` (255ths) only to those of blocks that have more of it.
    /// Stopped by request, blocks have what they had got: the same call goes on from there.
    pub fn expose(&self, exposed: &mut Exposed, until: u32, noise: Option<f32>, progress: &Progress) -> Result<(), NotDrawn> {
        let size = exposed.size();
        let corners: Vec<[u32; 2]> = (0..exposed.blocks.len()).map(|n| exposed.corner(n)).collect();
        let is_due = |block: &BlockSums, told: f32| {
            let rests = noise.is_some_and(|noise| told <= noise && block.samples >= LEAST_SAMPLES);
            !rests && block.samples < until
        };
        let blocks = exposed.blocks.iter_mut().zip(&mut exposed.noise).zip(corners);
        let due = blocks.filter(|((block, told), _)| is_due(block, **told));
        let (mut blocks, mut told): (Vec<_>, Vec<_>) = due.map(|((block, told), corner)| ((corner, block), told)).unzip();
        let drawn = self.draw(&mut blocks, until, progress);
        blocks.par_iter().zip(&mut told).for_each(|((corner, block), told)| {
            **told = Exposed::noise_of(size, *corner, block, &self.toned, self.background);
        });
        drawn
    }

    /// Draws samples up to number `until` of each pixel of blocks, which begin at these pixels.
    fn draw(&self, blocks: &mut [([u32; 2], &mut BlockSums)], until: u32, progress: &Progress) -> Result<(), NotDrawn> {
        #[cfg(feature = "gpu")]
        if let Some(gpu) = &self.gpu {
            return gpu.draw(self.stage.size, blocks, until, progress);
        }
        blocks.par_iter_mut().for_each_init(
            || Room::of(&self.stage),
            |room, (corner, block)| {
                while block.samples < until && progress.advance(0).is_ok() {
                    let count = (until - block.samples).min(AT_ONCE);
                    dispatch!(self.level, simd => self.stage.draw(simd, room, *corner, block.samples, count));
                    add(block, room, count);
                }
            },
        );
        Ok(progress.advance(0)?)
    }

    /// The picture so far as linear light, premultiplied, with its opacity; rows from the top.
    pub fn light(&self, exposed: &Exposed, denoise: bool) -> Vec<Vec4> {
        if denoise {
            return denoised(exposed, &self.toned);
        }
        let [width, height] = exposed.size();
        let pixel = |n: u32| {
            let (block, at) = exposed.at(n % width, n / width);
            self.toned.color(&block.sum(at), block.samples)
        };
        (0..width * height).into_par_iter().map(pixel).collect()
    }
}

/// Adds what a room holds of `count` samples to the sums of a block, in the order of their numbers.
fn add(block: &mut BlockSums, room: &Room, count: u32) {
    for n in 0..count {
        let half = ((block.samples + n) & 1) as usize;
        for pixel in 0..PIXELS {
            let sums = &mut block.halves[half][pixel];
            sums.iter_mut().zip(room.light(n, pixel)).for_each(|(sum, v)| *sum += v);
            block.guides[pixel].iter_mut().zip(room.guide(n, pixel)).for_each(|(sum, v)| *sum += v);
        }
    }
    block.samples += count;
}

/// Rays along a side of the square that looks for the lowest crossing, at most.
const MOST_ACROSS: f64 = 1024.0;

/// The height along `up` of the bone's lowest crossing relative to its middle, of upright rays a voxel apart; the bottom of its bounds where it has
/// none.
fn lowest(level: InstructionSet, bone: &Bone, up: DVec3) -> f64 {
    let (x, y) = up.any_orthonormal_pair();
    let across = (2.0 * bone.radius_mm / bone.voxel_mm()).ceil().clamp(16.0, MOST_ACROSS) as usize;
    let step = 2.0 * bone.radius_mm / across as f64;
    let row = |row: usize| dispatch!(level, simd => lowest_of_row(simd, bone, [x, y, up], [row, across], step));
    let far = (0..across).into_par_iter().map(row).reduce(|| f64::INFINITY, f64::min);
    if far.is_finite() { far - 2.0 * bone.radius_mm } else { -bone.radius_mm }
}

/// How far the first crossing of a row's rays lies above where they begin, two radii below the middle.
#[inline(always)]
fn lowest_of_row<S: Simd>(simd: S, bone: &Bone, [x, y, up]: [DVec3; 3], [row, across]: [usize; 2], step: f64) -> f64 {
    let mut least = f64::INFINITY;
    let place = |n: usize| (n as f64 + 0.5) * step - bone.radius_mm;
    for first in (0..across).step_by(LANES) {
        let starts: [DVec3; LANES] =
            std::array::from_fn(|lane| bone.middle_mm + place(first + lane) * x + place(row) * y - 2.0 * bone.radius_mm * up);
        let origin = axes!(a => Doubles::from_slice(simd, &starts.map(|start| start[a])));
        let rays = Rays { origin, direction: axes!(a => Floats::splat(simd, up[a] as f32)) };
        let seen = bone.first(simd, &rays, Floats::splat(simd, NEVER), Mask::splat(simd, true));
        for lane in crate::lanes::numbers(seen.found) {
            least = least.min(f64::from(seen.far[lane]));
        }
    }
    least
}
