//! The compute pipelines, what is bound to them, and the picture they leave.

use super::blocks::{BLOCK_PIXELS, pixel_in_block};
use super::buffers::{
    Pixel, bound, bound_textures, compile, entry, filled_buffer, hit_buffer, part, storage, storage_buffer, texture_entries,
};
use super::device::{Gpu, GpuError};
use super::layout::{Block, TraceParams};
use super::march::March;
use super::paths::Pass;
use super::plan::Plan;
use super::shader::{Reads, link};
use super::stamps::Stamps;
use super::{Parts, bindings, trace_shader};
use crate::frame::Frame;
use crate::picture::Picture;
use crate::roots::{Method, Solver};
use crate::scene::Scene;
use crate::skip::BLOCK;
use rayon::prelude::*;
use std::ops::Range;
use std::time::Instant;
use wgpu::{BindGroupEntry, BindingType, BufferUsages, SamplerBindingType};

/// A pass over volumes of one component type, with one method.
#[derive(Debug)]
pub(super) struct Trace {
    reads: Reads,
    method: Method,
    parts: Parts,
    layout: wgpu::BindGroupLayout,
    pub pipeline: wgpu::ComputePipeline,
}

/// All pipelines, each compiled when it is first used.
#[derive(Debug)]
pub(super) struct Pipelines {
    pub trace: Vec<Trace>,
    shade_layout: wgpu::BindGroupLayout,
    shade: wgpu::ComputePipeline,
    /// The hardware's trilinear filter, for the solver `filter`.
    pub filter: wgpu::Sampler,
    /// For fetches of four texels.
    pub nearest: wgpu::Sampler,
    /// Passes through all volumes at once.
    pub march: Vec<March>,
    /// Passes of paths of light.
    pub paths: Vec<Pass>,
}

impl Pipelines {
    pub fn new(gpu: &Gpu) -> Self {
        use bindings::{BLOCKS, FACE_COLORS_OF_LAYERS, HITS, LAYERS, PIXELS, SHADE_PARAMS, SHADOWS};
        let read = [SHADE_PARAMS, LAYERS, BLOCKS, SHADOWS, FACE_COLORS_OF_LAYERS].map(|binding| entry(binding, storage(true)));
        let written = [HITS, PIXELS].map(|binding| entry(binding, storage(false)));
        let (shade_layout, shade) = compile(gpu, "shade", &link("shade", &[], &[]), &[], &[read.as_slice(), &written].concat());
        let linear = wgpu::FilterMode::Linear;
        let descriptor = wgpu::SamplerDescriptor { label: Some("filter"), mag_filter: linear, min_filter: linear, ..Default::default() };
        let filter = gpu.device.create_sampler(&descriptor);
        let nearest = gpu.device.create_sampler(&Default::default());
        Self { trace: vec![], shade_layout, shade, filter, nearest, march: vec![], paths: vec![] }
    }

    /// Compiles the pass for `reads`, `method` and `parts`, if it is not yet; its number.
    pub fn trace(&mut self, gpu: &Gpu, reads: Reads, method: Method, parts: Parts) -> usize {
        if let Some(known) = self.trace.iter().position(|t| t.reads == reads && t.method == method && t.parts == parts) {
            return known;
        }
        let is_filter = method == Method::Solver(Solver::Filter);
        let mut entries = texture_entries(0, reads, is_filter).to_vec();
        entries.extend([bindings::TRACE_PARAMS, bindings::BLOCKS, bindings::EXTRAS].map(|binding| entry(binding, storage(true))));
        entries.push(entry(bindings::HITS, storage(false)));
        if is_filter {
            entries.push(entry(bindings::SAMPLER, BindingType::Sampler(SamplerBindingType::Filtering)));
        } else if reads.in_layers {
            entries.push(entry(bindings::SAMPLER, BindingType::Sampler(SamplerBindingType::NonFiltering)));
        }
        if reads.is_cut {
            entries.push(entry(bindings::SOLIDS, storage(true)));
        }
        if parts == Parts::Shadow {
            entries.extend([entry(bindings::SHADOWS, storage(false)), entry(bindings::LIGHT_SPANS, storage(true))]);
        }
        let (source, name, numbers) = trace_shader(reads, method, parts);
        let (layout, pipeline) = compile(gpu, name, &source, &numbers, &entries);
        self.trace.push(Trace { reads, method, parts, layout, pipeline });
        self.trace.len() - 1
    }

    /// Everything that pass `pass` of the plan reads and writes for some blocks, with `params` instead of its own.
    pub fn trace_group(
        &self,
        gpu: &Gpu,
        number: usize,
        plan: &Plan,
        (pass, params): (usize, &TraceParams),
        blocks: &Range<usize>,
        (hits, shadows): (&wgpu::Buffer, Option<&wgpu::Buffer>),
    ) -> wgpu::BindGroup {
        let (trace, volume) = (&self.trace[number], &plan.volumes[pass]);
        let params = filled_buffer(gpu, bytemuck::bytes_of(params), BufferUsages::STORAGE);
        let views = volume.views();
        let mut entries: Vec<BindGroupEntry<'_>> = bound_textures(0, &views).collect();
        entries.extend([
            bound(bindings::TRACE_PARAMS, params.as_entire_binding()),
            bound(bindings::HITS, hits.as_entire_binding()),
            bound(bindings::BLOCKS, part(&plan.spans, blocks, plan.volumes.len() * size_of::<Block>())),
            bound(bindings::EXTRAS, plan.extras.as_entire_binding()),
        ]);
        if trace.method == Method::Solver(Solver::Filter) {
            entries.push(bound(bindings::SAMPLER, wgpu::BindingResource::Sampler(&self.filter)));
        } else if volume.reads.in_layers {
            entries.push(bound(bindings::SAMPLER, wgpu::BindingResource::Sampler(&self.nearest)));
        }
        if let (Some(solids), true) = (&plan.solids, volume.reads.is_cut) {
            entries.push(bound(bindings::SOLIDS, solids.as_entire_binding()));
        }
        if let (Some(shadows), Some(light_spans)) = (shadows, &volume.light_spans) {
            entries.extend([
                bound(bindings::SHADOWS, shadows.as_entire_binding()),
                bound(bindings::LIGHT_SPANS, light_spans.as_entire_binding()),
            ]);
        }
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("trace"), layout: &trace.layout, entries: &entries })
    }

    /// Runs pass `pass` of the plan, with `params` instead of its own, over some blocks and waits for it; seconds by the card's own clock, or
    /// by ours where it has none.
    pub fn time(
        &mut self,
        gpu: &Gpu,
        plan: &Plan,
        (pass, params): (usize, &TraceParams),
        parts: Parts,
        blocks: &Range<usize>,
        hits: &wgpu::Buffer,
    ) -> Result<f64, GpuError> {
        let number = self.trace(gpu, plan.volumes[pass].reads, plan.method, parts);
        let group = self.trace_group(gpu, number, plan, (pass, params), blocks, (hits, None));
        let stamps = Stamps::new(gpu);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let timestamp_writes = stamps.as_ref().map(Stamps::writes);
        let mut compute = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("timed"), timestamp_writes });
        compute.set_pipeline(&self.trace[number].pipeline);
        compute.set_bind_group(0, &group, &[]);
        compute.dispatch_workgroups(blocks.len() as u32, 1, 1);
        drop(compute);
        if let Some(stamps) = &stamps {
            stamps.resolve(&mut encoder);
        }
        gpu.wait()?;
        let begun = Instant::now();
        gpu.queue.submit([encoder.finish()]);
        gpu.wait()?;
        let by_our_clock = begun.elapsed().as_secs_f64();
        stamps.map_or(Ok(by_our_clock), |stamps| stamps.seconds(gpu))
    }

    /// Runs all passes over all blocks.
    pub fn run(&mut self, gpu: &Gpu, plan: &Plan, target: &Target) -> Result<(), GpuError> {
        // No volume has no blocks.
        if plan.volumes.is_empty() {
            return Ok(());
        }
        let mut compiled = |parts| -> Vec<usize> { plan.volumes.iter().map(|v| self.trace(gpu, v.reads, plan.method, parts)).collect() };
        let numbers = compiled(Parts::Solve);
        let shadow_numbers = if plan.shade.shadows == 1 { compiled(Parts::Shadow) } else { vec![] };
        let colors = filled_buffer(gpu, bytemuck::cast_slice(&plan.colors), BufferUsages::STORAGE);
        let params = filled_buffer(gpu, bytemuck::bytes_of(&plan.shade), BufferUsages::STORAGE);
        let face_colors = filled_buffer(gpu, bytemuck::cast_slice(&plan.face_colors), BufferUsages::STORAGE);
        for blocks in plan.batches() {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let mut pass = encoder.begin_compute_pass(&Default::default());
            let mut dispatch = |pipeline: &wgpu::ComputePipeline, group: wgpu::BindGroup| {
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, &group, &[]);
                pass.dispatch_workgroups(blocks.len() as u32, 1, 1);
            };
            for (&number, own) in numbers.iter().zip(plan.trace.iter().enumerate()) {
                dispatch(&self.trace[number].pipeline, self.trace_group(gpu, number, plan, own, &blocks, (&target.hits, None)));
            }
            for (&number, own) in shadow_numbers.iter().zip(plan.trace.iter().enumerate()) {
                let buffers = (&target.hits, Some(&target.shadows));
                dispatch(&self.trace[number].pipeline, self.trace_group(gpu, number, plan, own, &blocks, buffers));
            }
            let entries = [
                bound(bindings::SHADE_PARAMS, params.as_entire_binding()),
                bound(bindings::HITS, target.hits.as_entire_binding()),
                bound(bindings::LAYERS, colors.as_entire_binding()),
                bound(bindings::BLOCKS, part(&plan.spans, &blocks, plan.volumes.len() * size_of::<Block>())),
                bound(bindings::PIXELS, part(&target.pixels, &blocks, BLOCK_PIXELS * size_of::<Pixel>())),
                bound(bindings::SHADOWS, target.shadows.as_entire_binding()),
                bound(bindings::FACE_COLORS_OF_LAYERS, face_colors.as_entire_binding()),
            ];
            let layout = &self.shade_layout;
            dispatch(
                &self.shade,
                gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("shade"), layout, entries: &entries }),
            );
            drop(pass);
            gpu.queue.submit([encoder.finish()]);
            // Each batch has its own time: a large picture on a slow driver is not a hung driver.
            if blocks.end < plan.blocks.len() {
                gpu.wait()?;
            }
        }
        Ok(())
    }
}

/// The picture on the GPU, and the way back.
#[derive(Debug)]
pub(super) struct Target {
    width: u32,
    height: u32,
    passes: usize,
    hits: wgpu::Buffer,
    shadows: wgpu::Buffer,
    /// Block by block of those that are drawn.
    pixels: wgpu::Buffer,
    readback: wgpu::Buffer,
}

impl Target {
    pub fn new(gpu: &Gpu, plan: &Plan, width: u32, height: u32) -> Self {
        let blocks = (width.div_ceil(BLOCK) * height.div_ceil(BLOCK)) as usize;
        let buffer = |usage| {
            let size = (blocks * BLOCK_PIXELS * size_of::<Pixel>()) as u64;
            gpu.device.create_buffer(&wgpu::BufferDescriptor { label: Some("picture"), size, usage, mapped_at_creation: false })
        };
        let passes = plan.volumes.len();
        Self {
            width,
            height,
            passes,
            hits: hit_buffer(gpu, plan.pixels() * passes),
            shadows: storage_buffer(gpu, (plan.batch * BLOCK_PIXELS * size_of::<u32>()) as u64),
            pixels: buffer(BufferUsages::STORAGE | BufferUsages::COPY_SRC),
            readback: buffer(BufferUsages::MAP_READ | BufferUsages::COPY_DST),
        }
    }

    /// Whether a picture of that size has room here.
    pub fn fits(&self, plan: &Plan, width: u32, height: u32) -> bool {
        self.width == width && self.height == height && self.passes == plan.volumes.len()
    }

    /// Waits for the picture and copies it to memory.
    pub fn read(&self, gpu: &Gpu, plan: &Plan, frame: &Frame, scene: &Scene) -> Result<Picture, GpuError> {
        let (width, height) = (self.width, self.height);
        let mut picture = Picture::of(scene.background_bytes(), width, height);
        if plan.blocks.is_empty() {
            return Ok(picture);
        }
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let used = (plan.blocks.len() * BLOCK_PIXELS * size_of::<Pixel>()) as u64;
        encoder.copy_buffer_to_buffer(&self.pixels, 0, &self.readback, 0, used);
        gpu.queue.submit([encoder.finish()]);
        gpu.read_buffer(&self.readback, |bytes| {
            let pixels: &[Pixel] = bytemuck::cast_slice(&bytes[..used as usize]);
            let blocks: Vec<_> = plan.blocks.iter().zip(pixels.chunks_exact(BLOCK_PIXELS)).collect();
            let mut of_row = vec![&[][..]; height.div_ceil(BLOCK) as usize];
            for row in blocks.chunk_by(|(a, _), (b, _)| a[1] == b[1]) {
                of_row[(row[0].0[1] / BLOCK) as usize] = row;
            }
            let rows = (BLOCK * width) as usize;
            let parts = picture.rgba.par_chunks_mut(rows).zip(picture.depth_mm.par_chunks_mut(rows));
            parts.zip(picture.volume_id.par_chunks_mut(rows)).zip(of_row).for_each(|(((rgba, depth_mm), volume_id), row)| {
                for ([x0, y0], pixels) in row {
                    for (n, [color, depth]) in (0..).zip(*pixels) {
                        let [dx, dy] = pixel_in_block(n);
                        let (x, at) = (x0 + dx, (dy * width + x0 + dx) as usize);
                        let [r, g, b, id] = color.to_le_bytes();
                        if id != 0 && x < width && at < rgba.len() {
                            (rgba[at], volume_id[at]) = ([r, g, b, 255], id);
                            depth_mm[at] = frame.depth_mm(x, y0 + dy, f32::from_bits(*depth));
                        }
                    }
                }
            });
            picture
        })
    }
}
