//! The GPU renderer: one compute pass for each volume and one for shading, a batch of blocks at a time, so that no dispatch comes near
//! the time after which operating systems kill it.

mod bindings;
mod blocks;
mod buffers;
mod constants;
mod device;
mod layout;
mod march;
mod paths;
mod pipelines;
mod plan;
mod segments;
mod shader;
mod solids;
mod split;
mod stage;
mod stamps;
mod upload;

use device::Gpu;
pub use device::GpuError;
use march::Integrate;
pub(crate) use paths::PathsOnGpu;
use pipelines::{Pipelines, Target};
use shader::{Reads, link};
use solids::Solids;

use crate::frame::Frame;
use crate::modes::{Gather, RayValue};
use crate::picture::Picture;
use crate::roots::{Method, Solver, Steps};
use crate::scene::Scene;
use crate::skip::{CellMasks, DistanceMap, MapCache};
use crate::studio::{Tracer, TracerCache};
use crate::tone::colored;
use crate::{Backend, InstructionSet, RenderError, Renderer, Split};
use bregma_field::Volume;
use std::sync::{Arc, Weak};

/// Blocks in one dispatch: about 0.1 s of a software driver, a few ms of a graphics card.
const BATCH: usize = 8192;

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
    Project { of: RayValue, by_gradient: bool, in_range: bool },
    /// On a plane.
    Slice,
}

/// The file that has a solver's `first_entry` in a segment of a cell, and the numbers that it is compiled with.
fn solver_module(solver: Solver) -> (&'static str, Vec<(&'static str, f64)>) {
    let count = |steps: Steps| vec![("STEP_COUNT", f64::from(steps.number()))];
    match solver {
        Solver::Exact => ("exact", vec![]),
        Solver::Linear => ("linear", vec![]),
        Solver::Neubauer(steps) => ("neubauer", count(steps)),
        Solver::Marmitt(steps) => ("marmitt", count(steps)),
        Solver::Analytic => ("analytic", vec![]),
        Solver::Step(steps) => ("segment_steps", vec![("PER_VOXEL", f64::from(steps.number()))]),
        Solver::Filter => ("cubic", vec![]),
    }
}

/// The WGSL of the pass over a volume with one method compiled in, its entry point, and the numbers that it is compiled with.
fn trace_shader(reads: Reads, method: Method, parts: Parts) -> (String, &'static str, Vec<(&'static str, f64)>) {
    let is_timed = matches!(parts, Parts::Walk | Parts::Fetch);
    let mut numbers = vec![];
    let mut filled = match method {
        Method::Solver(Solver::Step(steps)) => {
            numbers.push(("PER_VOXEL", f64::from(steps.number())));
            vec![("in_brick", "steps")]
        }
        Method::Solver(Solver::Filter) => vec![("in_brick", "filter_cells")],
        Method::Spline if !is_timed => vec![("cell_entry", "spline"), ("field_at", "spline")],
        Method::Voxels if !is_timed => vec![("cell_entry", "voxels"), ("field_at", "voxels")],
        Method::Spline | Method::Voxels => vec![],
        Method::Solver(solver) => {
            let (file, own) = solver_module(solver);
            if !is_timed {
                numbers.extend(own);
            }
            vec![("solver", file)]
        }
    };
    if is_timed {
        filled.retain(|(slot, _)| *slot != "solver");
        // What a solid leaves is found by a solver, too.
        filled.extend([("solver", "unsolved"), ("cubic_entry", "unsolved"), ("part_within", "whole")]);
    }
    if parts == Parts::Walk {
        filled.extend([("samples", "unread"), ("filtered", "unread")]);
    }
    let (module, entry) = match parts {
        Parts::Shadow => ("shadows", "shadow"),
        Parts::Project { of, by_gradient, in_range } => {
            let number = |is: bool| f64::from(u8::from(is));
            numbers = vec![
                ("EXTREME", f64::from(of.extreme().unwrap_or(0.0))),
                ("OF_GRADIENT", number(by_gradient)),
                ("IN_RANGE", number(in_range)),
            ];
            ("project", "project")
        }
        Parts::Slice => ("slice", "slice"),
        _ => ("trace", "trace"),
    };
    (link(module, &filled, &[reads]), entry, numbers)
}

/// Draws on the GPU. Keeps volumes, distance maps and pictures there between frames.
#[derive(Debug)]
pub struct GpuRenderer {
    gpu: Gpu,
    pipelines: Pipelines,
    maps: MapCache,
    studio: TracerCache,
    volumes: Vec<(Weak<Volume>, wgpu::Texture)>,
    /// As float32, for the solver `filter`.
    filtered: Vec<(Weak<Volume>, wgpu::Texture)>,
    map_textures: Vec<(Weak<DistanceMap>, wgpu::Texture)>,
    mask_textures: Vec<(Weak<CellMasks>, wgpu::Texture)>,
    /// What the volumes of the last picture were cut by.
    solids: Option<Solids>,
    target: Option<Target>,
}

impl GpuRenderer {
    /// Destroys the device, as a reset of the driver does: all that is drawn with it after that fails.
    pub fn lose_device(&self) {
        self.gpu.device.destroy();
    }

    /// On the fastest adapter; a software driver only if `software` allows it.
    pub fn new(software: bool) -> Result<Self, GpuError> {
        let gpu = Gpu::open(software)?;
        let pipelines = Pipelines::new(&gpu);
        let (volumes, filtered, map_textures, mask_textures) = (vec![], vec![], vec![], vec![]);
        Ok(Self {
            gpu,
            pipelines,
            maps: MapCache::new(InstructionSet::new()),
            studio: TracerCache::default(),
            volumes,
            filtered,
            map_textures,
            mask_textures,
            solids: None,
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
        match scene.mode.gather() {
            Gather::Number(of) => {
                let parts = Parts::Project { of, by_gradient: scene.of_gradient, in_range: scene.value_range.is_some() };
                let count = frame.layers.len();
                let mut gathered = vec![[f32::NAN; 2]; width as usize * height as usize * count];
                self.numbers(frame, scene, parts, [width, height], |pixel, layer, [value, depth, _]| {
                    gathered[pixel * count + layer] = [value, depth];
                })?;
                return Ok(colored(frame, scene, of, [width, height], &gathered));
            }
            Gather::Crossings => {
                return self.march(frame, scene, Integrate::Transparent { shadows: scene.shadows }, [width, height]);
            }
            Gather::Density => return self.march(frame, scene, Integrate::density(scene.integrator), [width, height]),
            Gather::Plane => return self.slice(frame, scene, [width, height]),
            Gather::Nearest | Gather::FirstOfEach => {}
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

    fn sample(&mut self, volumes: &[Arc<Volume>], scene: &Scene, [width, height]: [u32; 2], sample: u32) -> Result<Picture, RenderError> {
        let frame = Frame::new(&mut self.maps, volumes, scene, [width, height], sample)?;
        Ok(self.draw(&frame, scene, width, height)?)
    }

    fn tracer(&mut self, volumes: &[Arc<Volume>], scene: &Scene, size: [u32; 2], seed: u32) -> Result<Tracer, RenderError> {
        let tracer = Tracer::reusing(&mut self.studio, volumes, scene, size, seed)?;
        // Of more scans than a pass can read the processor draws the same.
        if self.check_volumes(volumes.len()).is_ok() { tracer.on_gpu(self) } else { Ok(tracer) }
    }

    fn bytes(&self) -> usize {
        self.maps.bytes() + self.studio.bytes()
    }

    fn split(&mut self, volumes: &[Arc<Volume>], scene: &Scene, width: u32, height: u32) -> Result<Split, RenderError> {
        let frame = Frame::new(&mut self.maps, volumes, scene, [width, height], 0)?;
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
    use shader::Component;

    #[test]
    fn every_pass_is_valid() {
        // Fails when a part that no picture of the other tests needs no longer fits the rest: scans of more layers than a texture array
        // has, the passes that are only timed.
        let check = |source: &str, what: &str| {
            let module = naga::front::wgsl::parse_str(source).unwrap_or_else(|e| panic!("{what}: {}", e.emit_to_string(source)));
            let valid = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module);
            assert!(valid.is_ok(), "{what}: {valid:?}");
        };
        let all_reads = [Component::U32, Component::I32, Component::F32]
            .map(|component| {
                [[false, false], [true, false], [false, true], [true, true]].map(|[in_layers, is_cut]| Reads {
                    component,
                    in_layers,
                    is_cut,
                })
            })
            .concat();
        let projections = [(RayValue::Max, true), (RayValue::Max, false), (RayValue::Mean, true), (RayValue::Mean, false)];
        let projections = projections.map(|(of, by_gradient)| Parts::Project { of, by_gradient, in_range: by_gradient });
        let projections = [Parts::Slice].into_iter().chain(projections);
        for method in Solver::ALL.map(Method::Solver).into_iter().chain([Method::Spline, Method::Voxels]) {
            for parts in [Parts::Walk, Parts::Fetch, Parts::Solve, Parts::Shadow].into_iter().chain(projections.clone()) {
                // Projections and slices have no solver.
                if matches!(parts, Parts::Project { .. } | Parts::Slice) && method != Method::Solver(Solver::Exact) {
                    continue;
                }
                for reads in &all_reads {
                    // What hardware filters is float32, in a 3D texture.
                    if method == Method::Solver(Solver::Filter) && (reads.in_layers || reads.is_cut || reads.component != Component::F32) {
                        continue;
                    }
                    let (source, entry, _) = trace_shader(*reads, method, parts);
                    assert!(source.contains(&format!("fn {entry}(")), "{parts:?} has no entry {entry}");
                    check(&source, &format!("{method:?} {parts:?} {reads:?}"));
                }
            }
        }
        for gather in
            [Integrate::Transparent { shadows: false }, Integrate::Transparent { shadows: true }, Integrate::Steps, Integrate::Exact]
        {
            for volumes in [&all_reads[..1], &all_reads[2..], &all_reads] {
                check(&march::shader(volumes, gather).0, &format!("{gather:?} of {}", volumes.len()));
            }
        }
        for volumes in [&all_reads[..1], &all_reads[2..], &all_reads] {
            check(&paths::shader(volumes), &format!("paths among {}", volumes.len()));
        }
        check(&link("shade", &[], &all_reads[..1]), "shade");
    }
}
