//! What pipelines are made of and bound to: layouts, buffers, and views of textures.

use super::bindings;
use super::device::Gpu;
use super::shader::{Component, Reads};
use std::ops::Range;
use wgpu::{
    BindGroupEntry, BindGroupLayoutEntry, BindingType, BufferBindingType, BufferUsages, StorageTextureAccess, TextureFormat,
    TextureSampleType, TextureViewDimension,
};

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

/// Bytes of the hit of a pixel.
pub(super) const HIT_BYTES: u64 = 16;

/// Colour and volume, and the depth: `pixels` of `shaders/shade.wgsl`.
pub(super) type Pixel = [u32; 2];

/// Room for the hits of so many pixels.
pub(super) fn hit_buffer(gpu: &Gpu, pixels: usize) -> wgpu::Buffer {
    storage_buffer(gpu, pixels as u64 * HIT_BYTES)
}

pub(super) fn storage_buffer(gpu: &Gpu, size: u64) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("hits"),
        size,
        usage: BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST,
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
