//! The pass that goes on behind the first surface, through all volumes at once; and projections, a pass for each volume.

use super::blocks::{BLOCK_PIXELS, pixel_in_block};
use super::buffers::{HIT_BYTES, bound, bound_textures, compile, entry, filled_buffer, hit_buffer, part, storage, texture_entries};
use super::device::{Gpu, GpuError};
use super::layout::{Block, UNFINISHED};
use super::plan::{Plan, VolumeOnGpu};
use super::shader::{Reads, link};
use super::{GpuRenderer, Parts, bindings};
use crate::InstructionSet;
use crate::cpu::{dvr_exact, dvr_steps, transparent};
use crate::frame::Frame;
use crate::picture::Picture;
use crate::roots::{Method, Solver};
use crate::scene::{Integrator, Scene};
use crate::slice::{self, NO_CROSSING, NodeBand, Nodes};
use wgpu::{BindGroupEntry, BindingType, BufferUsages, SamplerBindingType};

/// What is done along the way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Integrate {
    Transparent { shadows: bool },
    Steps,
    Exact,
}

impl Integrate {
    /// Of the density.
    pub fn density(integrator: Integrator) -> Self {
        match integrator {
            Integrator::Steps { .. } => Self::Steps,
            Integrator::Exact => Self::Exact,
        }
    }
}

/// The WGSL of a pass over volumes that are read so, and the numbers that it is compiled with.
pub(super) fn shader(volumes: &[Reads], integrate: Integrate) -> (String, Vec<(&'static str, f64)>) {
    let (file, enough) = match integrate {
        Integrate::Transparent { .. } => ("transparent", transparent::ENOUGH),
        Integrate::Steps => ("dvr_steps", dvr_steps::ENOUGH),
        Integrate::Exact => ("dvr_exact", dvr_exact::ENOUGH),
    };
    let mut numbers = vec![("ENOUGH", f64::from(enough))];
    if let Integrate::Transparent { shadows } = integrate {
        numbers.push(("HAS_SHADOWS", f64::from(u8::from(shadows))));
    }
    (link("march", &[("integrate", file)], volumes), numbers)
}

/// A pass through volumes that are read so.
#[derive(Debug)]
pub(super) struct March {
    reads: Vec<Reads>,
    integrate: Integrate,
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
}

impl March {
    fn new(gpu: &Gpu, reads: Vec<Reads>, integrate: Integrate) -> Self {
        use bindings::{BLOCKS, EXTRAS, RECORDS, SAMPLER, SHADE_PARAMS, TRACE_PARAMS};
        let mut entries = [TRACE_PARAMS, SHADE_PARAMS, BLOCKS, EXTRAS].map(|binding| entry(binding, storage(true))).to_vec();
        entries.push(entry(RECORDS, storage(false)));
        entries.extend(reads.iter().enumerate().flat_map(|(n, reads)| texture_entries(n, *reads, false)));
        if reads.iter().any(|reads| reads.is_cut) {
            entries.push(entry(bindings::SOLIDS, storage(true)));
        }
        if reads.iter().any(|reads| reads.in_layers) {
            entries.push(entry(SAMPLER, BindingType::Sampler(SamplerBindingType::NonFiltering)));
        }
        let (source, numbers) = shader(&reads, integrate);
        let (layout, pipeline) = compile(gpu, "march", &source, &numbers, &entries);
        Self { reads, integrate, layout, pipeline }
    }
}

/// What a pixel is read as: of a march its colour, depth, volume and whether there is anything; of a projection what is gathered.
type PixelRecord = [u32; 4];
const _: () = assert!(size_of::<PixelRecord>() as u64 == HIT_BYTES);

/// Where a pixel of a picture is.
struct PixelAt {
    x: u32,
    y: u32,
    at: usize,
}

/// Calls `put` for each pixel of some blocks that lies in a picture.
fn for_pixels(blocks: &[[u32; 2]], records: &[PixelRecord], width: u32, height: u32, mut put: impl FnMut(PixelAt, &PixelRecord)) {
    for ([x0, y0], records) in blocks.iter().zip(records.chunks_exact(BLOCK_PIXELS)) {
        for (n, record) in (0..).zip(records) {
            let [dx, dy] = pixel_in_block(n);
            let (x, y) = (x0 + dx, y0 + dy);
            if x < width && y < height {
                put(PixelAt { x, y, at: (y * width + x) as usize }, record);
            }
        }
    }
}

impl GpuRenderer {
    /// Calls `put` with the pixel, the layer and what it has found there, for each pixel and layer where `parts` find anything.
    pub(super) fn numbers(
        &mut self,
        frame: &Frame,
        scene: &Scene,
        parts: Parts,
        [width, height]: [u32; 2],
        mut put: impl FnMut(usize, usize, [f32; 3]),
    ) -> Result<(), GpuError> {
        let count = frame.layers.len();
        let passes: Vec<usize> = (0..count).filter(|&n| !frame.layers[n].placement.surface.grid.is_flat()).collect();
        let plan = self.plan(frame, scene, width, height, count)?;
        let (hits, back) = (hit_buffer(&self.gpu, plan.pixels() * count), readback(&self.gpu, &plan));
        for blocks in plan.batches() {
            for (own, &layer) in plan.trace.iter().enumerate().zip(&passes) {
                let number = self.pipelines.trace(&self.gpu, plan.volumes[own.0].reads, Method::Solver(Solver::Exact), parts);
                let group = self.pipelines.trace_group(&self.gpu, number, &plan, own, &blocks, (&hits, None));
                let pipeline = &self.pipelines.trace[number].pipeline;
                let first = u64::from(plan.shade.stride) * own.0 as u64 * HIT_BYTES;
                read_records(&self.gpu, pipeline, &group, blocks.len(), (&hits, first), &back, |records| {
                    for_pixels(&plan.blocks[blocks.clone()], records, width, height, |place, record| {
                        let [a, b, c, found] = record.map(f32::from_bits);
                        if found > 0.0 {
                            put(place.at, layer, [a, b, c]);
                        }
                    });
                })?;
            }
        }
        Ok(())
    }

    /// The picture of a slice.
    pub(super) fn slice(&mut self, frame: &Frame, scene: &Scene, [width, height]: [u32; 2]) -> Result<Picture, GpuError> {
        let [across, down] = [width, height].map(|n| n * frame.nodes_per_pixel);
        let count = across as usize * down as usize;
        let mut values = vec![vec![f32::NAN; count]; frame.layers.len()];
        let mut crossings = vec![vec![[NO_CROSSING; 2]; count]; frame.layers.len()];
        self.numbers(frame, scene, Parts::Slice, [across, down], |node, layer, [value, right, lower]| {
            (values[layer][node], crossings[layer][node]) = (value, [right, lower]);
        })?;
        if let Some(of) = scene.slice.sought() {
            values.iter_mut().for_each(|values| values.fill(f32::NAN));
            let parts = Parts::Project { of, by_gradient: false, in_range: false };
            self.numbers(frame, scene, parts, [across, down], |node, layer, [value, depth, _]| {
                values[layer][node] = of.shown([value, depth]);
            })?;
        }
        Ok(slice::draw(
            InstructionSet::new(),
            frame,
            scene,
            Picture::blank(None, [width, height], true),
            || (),
            |(), first, rows, paint| {
                let band = first * across as usize..(first + rows) * across as usize;
                let layers = values.iter().zip(&crossings);
                let layers: Vec<_> = layers.map(|(values, crossings)| (&values[band.clone()], &crossings[band.clone()])).collect();
                let is_crossed = |crossings: &[f32; 2]| crossings.iter().any(|share| *share >= 0.0);
                let crossed = layers.iter().map(|(_, crossings)| (0..crossings.len()).filter(|&n| is_crossed(&crossings[n])).collect());
                let crossed: Vec<Vec<usize>> = crossed.collect();
                let layers = layers.into_iter().zip(&crossed).map(|((values, crossings), crossed)| Nodes { values, crossings, crossed });
                paint(&NodeBand { width: across as usize, layers: layers.collect() });
            },
        ))
    }

    /// Whether a pass can see so many volumes at once.
    pub(super) fn check_volumes(&self, count: usize) -> Result<(), GpuError> {
        // For each volume a texture of samples, and two of numbers.
        let limits = self.gpu.device.limits();
        let most = limits.max_sampled_textures_per_shader_stage.min(limits.max_storage_textures_per_shader_stage / 2) as usize;
        if count > most { Err(GpuError::TooManyVolumes { count, most }) } else { Ok(()) }
    }

    /// Compiles the pass through volumes that are read so, if it is not yet; its number.
    fn march_pass(&mut self, reads: Vec<Reads>, integrate: Integrate) -> Result<usize, GpuError> {
        self.check_volumes(reads.len())?;
        let known = self.pipelines.march.iter().position(|m| m.reads == reads && m.integrate == integrate);
        Ok(known.unwrap_or_else(|| {
            self.pipelines.march.push(March::new(&self.gpu, reads, integrate));
            self.pipelines.march.len() - 1
        }))
    }

    /// The picture of a mode that goes on behind the first surface.
    pub(super) fn march(
        &mut self,
        frame: &Frame,
        scene: &Scene,
        integrate: Integrate,
        [width, height]: [u32; 2],
    ) -> Result<Picture, GpuError> {
        let mut picture = Picture::of(scene.background_bytes(), width, height);
        let plan = self.plan(frame, scene, width, height, 1)?;
        if plan.volumes.is_empty() {
            return Ok(picture);
        }
        let reads: Vec<Reads> = plan.volumes.iter().map(|v| v.reads).collect();
        let number = self.march_pass(reads, integrate)?;
        let (gpu, march) = (&self.gpu, &self.pipelines.march[number]);
        let shade = filled_buffer(gpu, bytemuck::bytes_of(&plan.shade), BufferUsages::STORAGE);
        let params = filled_buffer(gpu, bytemuck::cast_slice(&plan.trace), BufferUsages::STORAGE);
        let (records, back) = (hit_buffer(gpu, plan.pixels()), readback(gpu, &plan));
        let views: Vec<_> = plan.volumes.iter().map(VolumeOnGpu::views).collect();
        for blocks in plan.batches() {
            let mut entries: Vec<BindGroupEntry<'_>> = views.iter().enumerate().flat_map(|(n, views)| bound_textures(n, views)).collect();
            entries.extend([
                bound(bindings::TRACE_PARAMS, params.as_entire_binding()),
                bound(bindings::SHADE_PARAMS, shade.as_entire_binding()),
                bound(bindings::BLOCKS, part(&plan.spans, &blocks, plan.volumes.len() * size_of::<Block>())),
                bound(bindings::EXTRAS, plan.extras.as_entire_binding()),
                bound(bindings::RECORDS, records.as_entire_binding()),
            ]);
            if let Some(solids) = &plan.solids {
                entries.push(bound(bindings::SOLIDS, solids.as_entire_binding()));
            }
            if plan.volumes.iter().any(|volume| volume.reads.in_layers) {
                entries.push(bound(bindings::SAMPLER, wgpu::BindingResource::Sampler(&self.pipelines.nearest)));
            }
            let group =
                gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("march"), layout: &march.layout, entries: &entries });
            let mut is_done = true;
            read_records(gpu, &march.pipeline, &group, blocks.len(), (&records, 0), &back, |records| {
                for_pixels(&plan.blocks[blocks.clone()], records, width, height, |place, &[color, s, id, is_there]| {
                    is_done &= is_there != UNFINISHED;
                    if is_there == 0 {
                        return;
                    }
                    picture.rgba[place.at] = color.to_le_bytes();
                    if id != 0 {
                        picture.depth_mm[place.at] = frame.depth_mm(place.x, place.y, f32::from_bits(s));
                        picture.volume_id[place.at] = id as u8;
                    }
                });
            })?;
            if !is_done {
                return Err(GpuError::Unfinished { adapter: gpu.info.name.clone() });
            }
        }
        Ok(picture)
    }
}

/// Room in memory for what a batch of blocks of `plan` gives.
fn readback(gpu: &Gpu, plan: &Plan) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("read back"),
        size: plan.pixels() as u64 * HIT_BYTES,
        usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// Runs a pass over `count` blocks, and reads what it has left from `first` on.
fn read_records(
    gpu: &Gpu,
    pipeline: &wgpu::ComputePipeline,
    group: &wgpu::BindGroup,
    count: usize,
    (records, first): (&wgpu::Buffer, u64),
    back: &wgpu::Buffer,
    read: impl FnOnce(&[PixelRecord]),
) -> Result<(), GpuError> {
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, group, &[]);
    pass.dispatch_workgroups(count as u32, 1, 1);
    drop(pass);
    let bytes = (count * BLOCK_PIXELS) as u64 * HIT_BYTES;
    encoder.copy_buffer_to_buffer(records, first, back, 0, bytes);
    gpu.queue.submit([encoder.finish()]);
    gpu.read_buffer(back, |all| read(bytemuck::cast_slice(&all[..bytes as usize])))
}
