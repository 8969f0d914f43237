//! The compute pipelines, what is bound to them, and the picture they leave.

use super::device::{Gpu, GpuError};
use super::layout::{ShadeLayer, TraceParams};
use super::plan::{Plan, VolumeOnGpu};
use super::{Parts, SHADE, TILE, trace_source};
use crate::frame::Frame;
use crate::roots::Solver;
use crate::scene::Picture;
use std::time::Instant;
use wgpu::{
    BindGroupEntry, BindGroupLayoutEntry, BindingType, BufferBindingType, BufferUsages, SamplerBindingType, TextureFormat,
    TextureSampleType,
};

/// A pass over volumes of one component type, with one solver.
#[derive(Debug)]
struct Trace {
    component: &'static str,
    solver: Solver,
    parts: Parts,
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
}

/// All pipelines, each compiled when it is first used.
#[derive(Debug)]
pub(super) struct Pipelines {
    trace: Vec<Trace>,
    shade_layout: wgpu::BindGroupLayout,
    shade: wgpu::ComputePipeline,
    /// The hardware's trilinear filter, for the solver `filter`.
    pub filter: wgpu::Sampler,
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

pub(super) fn volume_texture(sample_type: TextureSampleType) -> BindingType {
    BindingType::Texture { sample_type, view_dimension: wgpu::TextureViewDimension::D3, multisampled: false }
}

fn picture_texture(format: TextureFormat) -> BindingType {
    let access = wgpu::StorageTextureAccess::WriteOnly;
    BindingType::StorageTexture { access, format, view_dimension: wgpu::TextureViewDimension::D2 }
}

const COLOR: TextureFormat = TextureFormat::Rgba8Unorm;
const DEPTH: TextureFormat = TextureFormat::R32Float;
const ID: TextureFormat = TextureFormat::R32Uint;

pub(super) fn compile(
    gpu: &Gpu,
    name: &str,
    source: &str,
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
        compilation_options: Default::default(),
        cache: None,
    });
    (layout, pipeline)
}

impl Pipelines {
    pub fn new(gpu: &Gpu) -> Self {
        let entries = [
            entry(0, storage(true)),
            entry(1, storage(true)),
            entry(2, storage(true)),
            entry(3, picture_texture(COLOR)),
            entry(4, picture_texture(DEPTH)),
            entry(5, picture_texture(ID)),
        ];
        let (shade_layout, shade) = compile(gpu, "shade", SHADE, &entries);
        let linear = wgpu::FilterMode::Linear;
        let descriptor = wgpu::SamplerDescriptor { label: Some("filter"), mag_filter: linear, min_filter: linear, ..Default::default() };
        let filter = gpu.device.create_sampler(&descriptor);
        Self { trace: vec![], shade_layout, shade, filter }
    }

    /// Compiles the pass for `component`, `solver` and `parts`, if it is not yet; its number.
    fn trace(&mut self, gpu: &Gpu, component: &'static str, solver: Solver, parts: Parts) -> usize {
        if let Some(known) = self.trace.iter().position(|t| t.component == component && t.solver == solver && t.parts == parts) {
            return known;
        }
        let sample_type = match component {
            "u32" => TextureSampleType::Uint,
            "i32" => TextureSampleType::Sint,
            _ => TextureSampleType::Float { filterable: solver == Solver::Filter },
        };
        let mut entries = vec![
            entry(0, storage(true)),
            entry(1, volume_texture(sample_type)),
            entry(2, volume_texture(TextureSampleType::Uint)),
            entry(3, storage(false)),
            entry(5, storage(true)),
            entry(6, storage(true)),
        ];
        if solver == Solver::Filter {
            entries.push(entry(4, BindingType::Sampler(SamplerBindingType::Filtering)));
        }
        let (layout, pipeline) = compile(gpu, "trace", &trace_source(component, solver, parts), &entries);
        self.trace.push(Trace { component, solver, parts, layout, pipeline });
        self.trace.len() - 1
    }

    /// The parameters, textures and hits of a pass over one volume.
    fn trace_group(&self, gpu: &Gpu, number: usize, volume: &VolumeOnGpu, params: &[TraceParams], hits: &wgpu::Buffer) -> wgpu::BindGroup {
        let trace = &self.trace[number];
        let params = filled_buffer(gpu, bytemuck::cast_slice(params), BufferUsages::STORAGE);
        let [samples, map] = [&volume.samples, &volume.map].map(|t| t.create_view(&Default::default()));
        let texture = wgpu::BindingResource::TextureView;
        let mut entries = vec![
            bound(0, params.as_entire_binding()),
            bound(1, texture(&samples)),
            bound(2, texture(&map)),
            bound(3, hits.as_entire_binding()),
            bound(5, volume.masks.as_entire_binding()),
            bound(6, volume.spans.as_entire_binding()),
        ];
        if trace.solver == Solver::Filter {
            entries.push(bound(4, wgpu::BindingResource::Sampler(&self.filter)));
        }
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("tiles"), layout: &trace.layout, entries: &entries })
    }

    /// Runs one pass over some tiles of the plan's volume `pass` and waits for it; seconds.
    pub fn time(
        &mut self,
        gpu: &Gpu,
        plan: &Plan,
        pass: usize,
        parts: Parts,
        params: &[TraceParams],
        hits: &wgpu::Buffer,
    ) -> Result<f64, GpuError> {
        let volume = &plan.volumes[pass];
        let number = self.trace(gpu, volume.component, plan.solver, parts);
        let group = self.trace_group(gpu, number, volume, params, hits);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut compute = encoder.begin_compute_pass(&Default::default());
        compute.set_pipeline(&self.trace[number].pipeline);
        compute.set_bind_group(0, &group, &[]);
        compute.dispatch_workgroups(TILE / 8, TILE / 8, params.len() as u32);
        drop(compute);
        gpu.wait()?;
        let begun = Instant::now();
        gpu.queue.submit([encoder.finish()]);
        gpu.wait()?;
        Ok(begun.elapsed().as_secs_f64())
    }

    /// Runs all passes over all tiles.
    pub fn run(&mut self, gpu: &Gpu, plan: &Plan, target: &Target) {
        let Plan { solver, volumes, trace, shade, colors, batch } = plan;
        let hits = hit_buffer(gpu, *batch, volumes.len());
        let unused = [ShadeLayer { color: [0.0; 4], id: 0, padding: [0; 3] }];
        let colors = bytemuck::cast_slice(if colors.is_empty() { &unused } else { colors });
        let colors = filled_buffer(gpu, colors, BufferUsages::STORAGE);
        let numbers: Vec<usize> = volumes.iter().map(|v| self.trace(gpu, v.component, *solver, Parts::Solve)).collect();
        let view = |t: &wgpu::Texture| t.create_view(&Default::default());
        let [color, depth, id] = [&target.color, &target.depth, &target.id].map(view);
        let texture = wgpu::BindingResource::TextureView;
        for first in (0..shade.len()).step_by(*batch) {
            let tiles = first..(first + batch).min(shade.len());
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let mut pass = encoder.begin_compute_pass(&Default::default());
            let mut dispatch = |pipeline: &wgpu::ComputePipeline, group: wgpu::BindGroup| {
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, &group, &[]);
                pass.dispatch_workgroups(TILE / 8, TILE / 8, tiles.len() as u32);
            };
            for ((&number, volume), params) in numbers.iter().zip(volumes).zip(trace) {
                dispatch(&self.trace[number].pipeline, self.trace_group(gpu, number, volume, &params[tiles.clone()], &hits));
            }
            let params = filled_buffer(gpu, bytemuck::cast_slice(&shade[tiles.clone()]), BufferUsages::STORAGE);
            let entries = [
                bound(0, params.as_entire_binding()),
                bound(1, hits.as_entire_binding()),
                bound(2, colors.as_entire_binding()),
                bound(3, texture(&color)),
                bound(4, texture(&depth)),
                bound(5, texture(&id)),
            ];
            let layout = &self.shade_layout;
            let descriptor = wgpu::BindGroupDescriptor { label: Some("tiles"), layout, entries: &entries };
            dispatch(&self.shade, gpu.device.create_bind_group(&descriptor));
            drop(pass);
            gpu.queue.submit([encoder.finish()]);
        }
    }
}

/// Room for the hits of `passes` over a batch of tiles.
pub(super) fn hit_buffer(gpu: &Gpu, batch: usize, passes: usize) -> wgpu::Buffer {
    let size = batch as u64 * hit_bytes(passes);
    gpu.device.create_buffer(&wgpu::BufferDescriptor { label: Some("hits"), size, usage: BufferUsages::STORAGE, mapped_at_creation: false })
}

/// Bytes of the hits of a tile: 16 for each pixel and pass, and never none.
pub(super) fn hit_bytes(passes: usize) -> u64 {
    u64::from(TILE * TILE) * 16 * passes.max(1) as u64
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

/// The picture on the GPU, and the way back.
#[derive(Debug)]
pub(super) struct Target {
    pub width: u32,
    pub height: u32,
    color: wgpu::Texture,
    depth: wgpu::Texture,
    id: wgpu::Texture,
    /// All three, one after the other.
    readback: wgpu::Buffer,
}

/// Each of the three formats has 4 bytes a pixel.
const PIXEL_BYTES: u32 = 4;

impl Target {
    pub fn new(gpu: &Gpu, width: u32, height: u32) -> Self {
        let texture = |format| {
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some("picture"),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_SRC,
                view_formats: &[],
            })
        };
        let readback = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("picture"),
            size: 3 * u64::from(row_bytes(width)) * u64::from(height),
            usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self { width, height, color: texture(COLOR), depth: texture(DEPTH), id: texture(ID), readback }
    }

    /// Waits for the picture and copies it to memory.
    pub fn read(&self, gpu: &Gpu, frame: &Frame) -> Result<Picture, GpuError> {
        let (row, plane) = (row_bytes(self.width), u64::from(row_bytes(self.width)) * u64::from(self.height));
        let size = wgpu::Extent3d { width: self.width, height: self.height, depth_or_array_layers: 1 };
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        for (n, texture) in [&self.color, &self.depth, &self.id].into_iter().enumerate() {
            let layout = wgpu::TexelCopyBufferLayout { offset: n as u64 * plane, bytes_per_row: Some(row), rows_per_image: None };
            encoder.copy_texture_to_buffer(texture.as_image_copy(), wgpu::TexelCopyBufferInfo { buffer: &self.readback, layout }, size);
        }
        gpu.queue.submit([encoder.finish()]);
        gpu.read_buffer(&self.readback, |bytes| {
            let used = (self.width * PIXEL_BYTES) as usize;
            let pixels = |n: u64| {
                let plane = &bytes[(n * plane) as usize..((n + 1) * plane) as usize];
                plane.chunks(row as usize).flat_map(move |r| r[..used].chunks_exact(4)).map(|p| [p[0], p[1], p[2], p[3]])
            };
            let depth_mm = |(n, p): (usize, [u8; 4])| {
                let (x, y) = (n as u32 % self.width, n as u32 / self.width);
                Some(f32::from_le_bytes(p)).filter(|s| *s >= 0.0).map_or(f32::NAN, |s| frame.depth_mm(x, y, s))
            };
            Picture {
                width: self.width,
                height: self.height,
                rgba: pixels(0).collect(),
                depth_mm: pixels(1).enumerate().map(depth_mm).collect(),
                volume_id: pixels(2).map(|p| p[0]).collect(),
            }
        })
    }
}

/// Rows in a buffer start at multiples of 256 bytes (WebGPU, "bytesPerRow").
fn row_bytes(width: u32) -> u32 {
    (width * PIXEL_BYTES).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)
}
