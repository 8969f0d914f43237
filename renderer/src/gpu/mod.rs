//! The GPU renderer: one compute pass for each volume and one for shading, a batch of blocks at a time, so that no dispatch comes near
//! the time after which operating systems kill it.

mod blocks;
mod device;
mod layout;
mod march;
mod pipelines;
mod plan;
mod segments;
mod split;
mod stamps;
mod upload;

use device::Gpu;
pub use device::GpuError;
use pipelines::{Pipelines, Target};

use crate::cell_masks::CellMasks;
use crate::frame::{Frame, MapCache};
use crate::occupancy::DistanceMap;
use crate::roots::{Method, PerVoxel, Solver, Steps};
use crate::scene::{Mode, Picture, Scene};
use crate::tone::colored;
use crate::{Backend, InstructionSet, RenderError, Renderer, Split};
use bregma_volume::Volume;
use std::sync::{Arc, Weak};

/// Blocks in one dispatch: about 0.1 s of a software driver, a few ms of a graphics card.
const BATCH: usize = 8192;

macro_rules! wgsl {
    ($name:literal) => {
        include_str!(concat!("../../../shaders/", $name, ".wgsl"))
    };
}

use wgsl;

/// The WGSL of a solver's `first_entry` in a segment of a cell; of `filter` the part that does not depend on where samples lie.
fn solver_source(solver: Solver) -> String {
    let count = |steps: Steps| match steps {
        Steps::Two => "2u",
        Steps::Three => "3u",
        Steps::Four => "4u",
    };
    let source = match solver {
        Solver::Exact => [wgsl!("cubic"), wgsl!("exact")].join("\n"),
        Solver::Linear => wgsl!("linear").to_owned(),
        Solver::Neubauer(steps) => wgsl!("neubauer").replace("STEP_COUNT", count(steps)),
        Solver::Marmitt(steps) => wgsl!("marmitt").replace("STEP_COUNT", count(steps)),
        Solver::Analytic => wgsl!("analytic").to_owned(),
        Solver::Step(steps) => wgsl!("segment_steps").replace("PER_VOXEL", per_voxel(steps)),
        Solver::Filter => [wgsl!("cubic"), wgsl!("filter")].join("\n"),
    };
    [wgsl!("interpolant"), wgsl!("bernstein"), &source].join("\n")
}

fn per_voxel(steps: PerVoxel) -> &'static str {
    match steps {
        PerVoxel::One => "1.0",
        PerVoxel::Two => "2.0",
        PerVoxel::Four => "4.0",
        PerVoxel::Eight => "8.0",
    }
}

/// How much of a pass is compiled in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Parts {
    /// Only walking; for timing.
    Walk,
    /// Walking and fetching samples; for timing.
    Fetch,
    /// Everything.
    Solve,
    /// Everything, for rays to the light.
    Shadow,
    /// Through the whole volume, to one number.
    Project(Projection),
}

/// What is gathered of a volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Projection {
    /// The largest value, and not the integral.
    is_max: bool,
    /// Of the gradient's magnitude, and not of the value.
    of_gradient: bool,
}

/// How a pass reads samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Reads {
    /// Component type of their texture.
    component: &'static str,
    /// From an array of 2D textures, not from a 3D texture.
    in_layers: bool,
}

/// The WGSL of the pass over a volume, with one method compiled in.
fn trace_source(reads: Reads, method: Method, parts: Parts) -> String {
    let samples = if reads.in_layers { wgsl!("samples") } else { wgsl!("samples_3d") };
    let samples = if parts == Parts::Walk { wgsl!("unread").to_owned() } else { samples.replace("SAMPLE", reads.component) };
    let filtered = if parts == Parts::Walk { "" } else { wgsl!("filtered") };
    let unsolved = [wgsl!("unsolved"), wgsl!("filter")].join("\n");
    let is_timed = matches!(parts, Parts::Walk | Parts::Fetch);
    let solve = |solver| if is_timed { unsolved.clone() } else { solver_source(solver) };
    let in_brick = match method {
        Method::Solver(Solver::Step(steps)) => [wgsl!("interpolant"), &wgsl!("steps").replace("PER_VOXEL", per_voxel(steps))].join("\n"),
        Method::Solver(Solver::Filter) => [&solve(Solver::Filter), filtered, wgsl!("filter_cells")].join("\n"),
        Method::Solver(solver) => [&solve(solver), wgsl!("corner_cells"), wgsl!("cells")].join("\n"),
        Method::Spline if is_timed => [&unsolved, wgsl!("corner_cells"), wgsl!("cells")].join("\n"),
        Method::Spline => [wgsl!("interpolant"), wgsl!("cells"), wgsl!("spline")].join("\n"),
    };
    let interpolant = if in_brick.contains("fn blend(") { "" } else { wgsl!("interpolant") };
    let gradient = if in_brick.contains("fn gradient_at(") { "" } else { wgsl!("gradient") };
    let project = match parts {
        Parts::Project(Projection { is_max, of_gradient }) => {
            wgsl!("project").replace("IS_MAX", &is_max.to_string()).replace("OF_GRADIENT", &of_gradient.to_string())
        }
        _ => String::new(),
    };
    let parts = [
        wgsl!("line"),
        &samples,
        &in_brick,
        interpolant,
        gradient,
        wgsl!("walk"),
        wgsl!("cuts"),
        wgsl!("blocks"),
        wgsl!("nearest"),
        wgsl!("trace"),
        wgsl!("shadows"),
        &project,
    ];
    parts.join("\n")
}

/// The WGSL of the shading pass.
fn shade_source() -> String {
    [wgsl!("blocks"), wgsl!("nearest"), wgsl!("light"), wgsl!("shade")].join("\n")
}

/// Draws on the GPU. Keeps volumes, distance maps and pictures there between frames.
#[derive(Debug)]
pub struct GpuRenderer {
    gpu: Gpu,
    pipelines: Pipelines,
    maps: MapCache,
    volumes: Vec<(Weak<Volume>, wgpu::Texture)>,
    /// As float32, for the solver `filter`.
    filtered: Vec<(Weak<Volume>, wgpu::Texture)>,
    map_textures: Vec<(Weak<DistanceMap>, wgpu::Texture)>,
    mask_textures: Vec<(Weak<CellMasks>, wgpu::Texture)>,
    target: Option<Target>,
}

impl GpuRenderer {
    /// On the fastest adapter; a software driver only if `software` allows it.
    pub fn new(software: bool) -> Result<Self, GpuError> {
        let gpu = Gpu::open(software)?;
        let pipelines = Pipelines::new(&gpu);
        let (volumes, filtered, map_textures, mask_textures) = (vec![], vec![], vec![], vec![]);
        Ok(Self {
            gpu,
            pipelines,
            maps: MapCache::new(InstructionSet::new()),
            volumes,
            filtered,
            map_textures,
            mask_textures,
            target: None,
        })
    }

    fn sample_texture(&mut self, volume: &Arc<Volume>) -> Result<wgpu::Texture, GpuError> {
        cached(&mut self.volumes, volume, || upload::upload_samples(&self.gpu, volume))
    }

    /// The samples as what hardware filters.
    fn filtered_texture(&mut self, volume: &Arc<Volume>) -> Result<wgpu::Texture, GpuError> {
        if !self.gpu.filters_f32() {
            return Err(GpuError::NoFilter { adapter: self.gpu.info.name.clone() });
        }
        cached(&mut self.filtered, volume, || upload::upload_as_f32(&self.gpu, volume))
    }

    fn map_texture(&mut self, map: &Arc<DistanceMap>, masks: &CellMasks) -> Result<wgpu::Texture, GpuError> {
        cached(&mut self.map_textures, map, || upload::upload_map(&self.gpu, map, masks))
    }

    fn mask_texture(&mut self, masks: &Arc<CellMasks>) -> Result<wgpu::Texture, GpuError> {
        cached(&mut self.mask_textures, masks, || upload::upload_masks(&self.gpu, masks))
    }

    fn draw(&mut self, frame: &Frame, scene: &Scene, width: u32, height: u32) -> Result<Picture, GpuError> {
        if scene.mode.is_projection() {
            let gathered = self.project(frame, scene, width, height)?;
            return Ok(colored(frame, scene, width, height, &gathered));
        }
        if scene.mode == Mode::Dvr || scene.is_transparent() {
            return self.march(frame, scene, width, height);
        }
        let plan = self.plan(frame, scene, width, height, frame.layers.len())?;
        let target = match self.target.take() {
            Some(t) if t.fits(&plan, width, height) => t,
            _ => Target::new(&self.gpu, &plan, width, height),
        };
        self.pipelines.run(&self.gpu, &plan, &target)?;
        let picture = target.read(&self.gpu, &plan, frame, scene)?;
        self.target = Some(target);
        Ok(picture)
    }
}

impl Renderer for GpuRenderer {
    fn name(&self) -> String {
        self.gpu.name()
    }

    fn backend(&self) -> Backend {
        Backend::Gpu
    }

    fn has(&self, solver: Solver) -> bool {
        solver != Solver::Filter || self.gpu.filters_f32()
    }

    fn render(&mut self, volumes: &[Arc<Volume>], scene: &Scene, width: u32, height: u32) -> Result<Picture, RenderError> {
        let frame = Frame::new(&mut self.maps, volumes, scene, width, height)?;
        Ok(self.draw(&frame, scene, width, height)?)
    }

    fn bytes(&self) -> usize {
        self.maps.bytes()
    }

    fn split(&mut self, volumes: &[Arc<Volume>], scene: &Scene, width: u32, height: u32) -> Result<Split, RenderError> {
        let frame = Frame::new(&mut self.maps, volumes, scene, width, height)?;
        Ok(self.split_frame(&frame, scene, width, height)?)
    }
}

/// What stands for `of` on the GPU, made when it is new; what stands for something that is gone is dropped.
fn cached<T, R: Clone>(cache: &mut Vec<(Weak<T>, R)>, of: &Arc<T>, make: impl FnOnce() -> Result<R, GpuError>) -> Result<R, GpuError> {
    cache.retain(|(source, _)| source.strong_count() > 0);
    if let Some((_, known)) = cache.iter().find(|(source, _)| std::ptr::eq(source.as_ptr(), Arc::as_ptr(of))) {
        return Ok(known.clone());
    }
    let made = make()?;
    cache.push((Arc::downgrade(of), made.clone()));
    Ok(made)
}

#[cfg(test)]
mod tests {
    use super::*;
    use naga::valid::{Capabilities, ValidationFlags, Validator};

    #[test]
    fn every_pass_is_valid() {
        // Fails when a part that no picture of the other tests needs no longer fits the rest: scans of more layers than a texture array
        // has, the passes that are only timed.
        for method in Solver::ALL.map(Method::Solver).into_iter().chain([Method::Spline]) {
            let projections = [(true, true), (true, false), (false, true), (false, false)];
            let projections = projections.map(|(is_max, of_gradient)| Parts::Project(Projection { is_max, of_gradient }));
            for parts in [Parts::Walk, Parts::Fetch, Parts::Solve, Parts::Shadow].into_iter().chain(projections) {
                // Projections have no solver.
                if matches!(parts, Parts::Project(_)) && method != Method::Solver(Solver::Exact) {
                    continue;
                }
                for component in ["u32", "i32", "f32"] {
                    for in_layers in [false, true] {
                        // What hardware filters is float32, in a 3D texture.
                        if method == Method::Solver(Solver::Filter) && (in_layers || component != "f32") {
                            continue;
                        }
                        let source = trace_source(Reads { component, in_layers }, method, parts);
                        let module = naga::front::wgsl::parse_str(&source).unwrap_or_else(|e| panic!("{}", e.emit_to_string(&source)));
                        let valid = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module);
                        assert!(valid.is_ok(), "{method:?} {parts:?} {component} {in_layers}: {valid:?}");
                    }
                }
            }
        }
        let reads = |component, in_layers| Reads { component, in_layers };
        for gather in
            [march::Gather::Shells { shadows: false }, march::Gather::Shells { shadows: true }, march::Gather::Steps, march::Gather::Exact]
        {
            for volumes in [vec![reads("i32", true)], vec![reads("f32", false), reads("u32", true), reads("u32", true)]] {
                let source = march::source(&volumes, gather);
                let module = naga::front::wgsl::parse_str(&source).unwrap_or_else(|e| panic!("{}", e.emit_to_string(&source)));
                let valid = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module);
                assert!(valid.is_ok(), "{gather:?} of {}: {valid:?}", volumes.len());
            }
        }
    }
}
