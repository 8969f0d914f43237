//! The compute pipelines, what is bound to them, and the picture they leave.

use super::blocks::{BLOCK_PIXELS, pixel_in_block};
use super::device::{Gpu, GpuError};
use super::layout::{Block, TraceParams};
use super::march::March;
use super::plan::{Plan, VolumeOnGpu};
use super::shader::{Component, Reads, link};
use super::stamps::Stamps;
use super::{Parts, bindings, trace_shader};
use crate::frame::Frame;
use crate::roots::{Method, Solver};
use crate::scene::{Picture, Scene};
use crate::skip::BLOCK;
use rayon::prelude::*;
use std::ops::Range;
use std::time::Instant;
use wgpu::{
    BindGroupEntry, BindGroupLayoutEntry, BindingType, BufferBindingType, BufferUsages, SamplerBindingType, StorageTextureAccess,
    TextureFormat, TextureSampleType, TextureViewDimension,
};

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
}

pub(super) fn entry(binding: u32, ty: BindingType) -> BindGroupLayoutEntry {
    BindGroupLayoutEntry { binding, visibility: wgpu::ShaderStages::COMPUTE, ty, count: None }
}

pub(super) fn storage(read_only: bool) -> BindingType {
    BindingType::Buffer { ty: BufferBindingType::Storage { read_only }, has_dynamic_offset: false, min_binding_size: None }
}

pub(super) fn bound(binding: u32, resource: wgpu::BindingResource<'_>) -> BindGroupEntry<'_> {
    BindGroupEntry { binding, resource }
}

/// The samples of a volume.
fn samples_binding(reads: Reads, is_filtered: bool) -> BindingType {
    let sample_type = match reads.component {
        Component::U32 => TextureSampleType::Uint,
        Component::I32 => TextureSampleType::Sint,
        Component::F32 => TextureSampleType::Float { filterable: is_filtered },
    };
    volume_texture(sample_type, if reads.in_layers { TextureViewDimension::D2Array } else { TextureViewDimension::D3 })
}

/// The textures of volume `n` of a pass.
pub(super) fn texture_entries(n: usize, reads: Reads, is_filtered: bool) -> [BindGroupLayoutEntry; 3] {
    let [samples, map, masks] = bindings::textures(n);
    [
        entry(samples, samples_binding(reads, is_filtered)),
        entry(map, numbers(TextureFormat::Rg32Uint, TextureViewDimension::D3)),
        entry(masks, numbers(TextureFormat::R32Uint, TextureViewDimension::D2)),
    ]
}

/// What is bound there.
pub(super) fn texture_views(volume: &VolumeOnGpu) -> [wgpu::TextureView; 3] {
    // Of a single layer the default is no array.
    let dimension = volume.reads.in_layers.then_some(TextureViewDimension::D2Array);
    let samples = volume.samples.create_view(&wgpu::TextureViewDescriptor { dimension, ..Default::default() });
    [samples, volume.map.create_view(&Default::default()), volume.masks.create_view(&Default::default())]
}

pub(super) fn bound_textures(n: usize, views: &[wgpu::TextureView; 3]) -> impl Iterator<Item = BindGroupEntry<'_>> {
    bindings::textures(n).into_iter().zip(views).map(|(binding, view)| bound(binding, wgpu::BindingResource::TextureView(view)))
}

/// A texture whose numbers are read one by one.
fn numbers(format: TextureFormat, view_dimension: TextureViewDimension) -> BindingType {
    BindingType::StorageTexture { access: StorageTextureAccess::ReadOnly, format, view_dimension }
}

pub(super) fn volume_texture(sample_type: TextureSampleType, view_dimension: TextureViewDimension) -> BindingType {
    BindingType::Texture { sample_type, view_dimension, multisampled: false }
}

/// The records of `size` bytes of some blocks in a buffer.
pub(super) fn part<'a>(buffer: &'a wgpu::Buffer, blocks: &Range<usize>, size: usize) -> wgpu::BindingResource<'a> {
    let (offset, bytes) = ((blocks.start * size) as u64, (blocks.len() * size) as u64);
    wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer, offset, size: wgpu::BufferSize::new(bytes) })
}

pub(super) fn compile(
    gpu: &Gpu,
    name: &str,
    source: &str,
    numbers: &[(&str, f64)],
    entries: &[BindGroupLayoutEntry],
) -> (wgpu::BindGroupLayout, wgpu::ComputePipeline) {
    let device = &gpu.device;
    let source = wgpu::ShaderSource::Wgsl(source.into());
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some(name), source });
    let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(name), entries });
    let bind_group_layouts = &[Some(&layout)];
    let pipeline_layout =
        device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor { label: Some(name), bind_group_layouts, immediate_size: 0 });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(name),
        layout: Some(&pipeline_layout),
        module: &module,
        entry_point: Some(name),
        compilation_options: wgpu::PipelineCompilationOptions { constants: numbers, ..Default::default() },
        cache: None,
    });
    (layout, pipeline)
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
        Self { trace: vec![], shade_layout, shade, filter, nearest, march: vec![] }
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
        let views = texture_views(volume);
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

/// Bytes of the hit of a pixel.
pub(super) const HIT_BYTES: u64 = 16;

/// Room for the hits of `passes` over a batch of blocks of `plan`.
pub(super) fn hit_buffer(gpu: &Gpu, plan: &Plan, passes: usize) -> wgpu::Buffer {
    storage_buffer(gpu, (plan.batch * BLOCK_PIXELS * passes) as u64 * HIT_BYTES)
}

fn storage_buffer(gpu: &Gpu, size: u64) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("hits"),
        size,
        usage: BufferUsages::STORAGE | BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    })
}

pub(super) fn filled_buffer(gpu: &Gpu, bytes: &[u8], usage: BufferUsages) -> wgpu::Buffer {
    let descriptor = wgpu::BufferDescriptor {
        label: Some("parameters"),
        size: bytes.len() as u64,
        usage: usage | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    };
    let buffer = gpu.device.create_buffer(&descriptor);
    gpu.queue.write_buffer(&buffer, 0, bytes);
    buffer
}

/// Colour and volume, and the depth: `pixels` of `shaders/shade.wgsl`.
pub(super) type Pixel = [u32; 2];

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
            hits: hit_buffer(gpu, plan, passes),
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
