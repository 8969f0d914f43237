//! Volumes as textures in the type of their samples: shaders read exactly what the file holds. An array of 2D textures, one for each k,
//! gives four samples in one fetch; a 3D texture takes what such an array does not. Hardware filters no integers, so the solver `filter`
//! takes them as float32. What is not sampled but looked up, a number at a time, are storage textures: llvmpipe reads these where it is,
//! and calls a function for the others.

use super::device::{Gpu, GpuError};
use super::layout::MASKS_ACROSS;
use super::shader::Component;
use crate::skip::{CellMasks, DistanceMap, WORDS};
use bregma_field::{AnyBlock, Sample, Store, Volume, with_block};
use wgpu::{TextureDimension, TextureFormat, TextureUsages};

/// How samples are stored on the GPU: the texture's format and its component type in WGSL.
pub(super) fn kind_of(volume: &Volume) -> (TextureFormat, Component) {
    match Store::of(volume).whole() {
        AnyBlock::U8(_) => (TextureFormat::R8Uint, Component::U32),
        AnyBlock::U16(_) => (TextureFormat::R16Uint, Component::U32),
        AnyBlock::I16(_) => (TextureFormat::R16Sint, Component::I32),
        AnyBlock::F32(_) => (TextureFormat::R32Float, Component::F32),
    }
}

/// Uploads the samples of `volume`.
pub(super) fn upload_samples(gpu: &Gpu, volume: &Volume) -> Result<wgpu::Texture, GpuError> {
    let bytes: &[u8] = match Store::of(volume).whole() {
        AnyBlock::U8(b) => b.onward([0; 3]),
        AnyBlock::U16(b) => bytemuck::cast_slice(b.onward([0; 3])),
        AnyBlock::I16(b) => bytemuck::cast_slice(b.onward([0; 3])),
        AnyBlock::F32(b) => bytemuck::cast_slice(b.onward([0; 3])),
    };
    let dimension = if has_layers(gpu, volume) { TextureDimension::D2 } else { TextureDimension::D3 };
    let shape = Shape { dims: volume.grid().dims(), dimension, format: kind_of(volume).0, usage: TextureUsages::TEXTURE_BINDING };
    upload(gpu, &shape, bytes)
}

/// Whether the samples of `volume` are an array of 2D textures, and not a 3D texture.
pub(super) fn has_layers(gpu: &Gpu, volume: &Volume) -> bool {
    let [nx, ny, nz] = volume.grid().dims();
    let limits = gpu.device.limits();
    nx.max(ny) <= limits.max_texture_dimension_2d as usize && nz <= limits.max_texture_array_layers as usize
}

/// Uploads the samples of `volume` as float32, which holds those of every type.
pub(super) fn upload_as_f32(gpu: &Gpu, volume: &Volume) -> Result<wgpu::Texture, GpuError> {
    let samples: Vec<f32> = with_block!(Store::of(volume).whole(), b => b.onward([0; 3]).iter().map(|s| s.to_f32()).collect());
    upload(gpu, &Shape::of_f32(volume.grid().dims()), bytemuck::cast_slice(&samples))
}

/// Uploads a distance map with the numbers of the masks above its 8 bits, and the boxes of these.
pub(super) fn upload_map(gpu: &Gpu, map: &DistanceMap, masks: &CellMasks) -> Result<wgpu::Texture, GpuError> {
    // Where no brick has a mask there is no box either.
    let cells = |slot: u32| masks.boxes().get(slot as usize).copied().unwrap_or(0);
    let texel = |(&distance, &slot): (&u8, &u32)| [u32::from(distance) | slot << 8, cells(slot)];
    let texels: Vec<[u32; 2]> = map.distances().iter().zip(masks.slots()).map(texel).collect();
    let shape = Shape::of_numbers(map.dims(), TextureDimension::D3, TextureFormat::Rg32Uint);
    upload(gpu, &shape, bytemuck::cast_slice(&texels))
}

/// Uploads the masks, row after row, the numbers of each side by side.
pub(super) fn upload_masks(gpu: &Gpu, masks: &CellMasks) -> Result<wgpu::Texture, GpuError> {
    let words = masks.words();
    // A texture has at least one row, even where nothing can be met.
    let across = MASKS_ACROSS * WORDS;
    let rows = words.len().div_ceil(across).max(1);
    if rows > gpu.device.limits().max_texture_dimension_2d as usize {
        return Err(GpuError::Memory { mib: size_of_val(words) >> 20, adapter: gpu.info.name.clone() });
    }
    let mut numbers = vec![0_u32; rows * across];
    numbers[..words.len()].copy_from_slice(words);
    upload(gpu, &Shape::of_numbers([across, rows, 1], TextureDimension::D2, TextureFormat::R32Uint), bytemuck::cast_slice(&numbers))
}

/// What a texture is like; one of two dimensions has a layer for each k.
pub(super) struct Shape {
    dims: [usize; 3],
    dimension: TextureDimension,
    format: TextureFormat,
    usage: TextureUsages,
}

impl Shape {
    /// Of what hardware filters.
    pub fn of_f32(dims: [usize; 3]) -> Self {
        Self { dims, dimension: TextureDimension::D3, format: TextureFormat::R32Float, usage: TextureUsages::TEXTURE_BINDING }
    }

    fn of_numbers(dims: [usize; 3], dimension: TextureDimension, format: TextureFormat) -> Self {
        Self { dims, dimension, format, usage: TextureUsages::STORAGE_BINDING }
    }
}

/// Bytes on their way at once: the driver keeps a copy of what is not yet on the card.
const SLAB_BYTES: usize = 64 << 20;

/// Uploads the texels of a texture, i fastest.
pub(super) fn upload(gpu: &Gpu, shape: &Shape, bytes: &[u8]) -> Result<wgpu::Texture, GpuError> {
    let Shape { dims, dimension, format, usage } = *shape;
    let limit = gpu.device.limits().max_texture_dimension_3d;
    if dimension == TextureDimension::D3 && dims.iter().any(|&n| n > limit as usize) {
        return Err(GpuError::TooLarge { dims, limit, adapter: gpu.info.name.clone() });
    }
    let [width, height, depth] = dims.map(|n| n as u32);
    let scope = gpu.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("volume"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: depth },
        mip_level_count: 1,
        sample_count: 1,
        dimension,
        format,
        usage: usage | TextureUsages::COPY_DST,
        view_formats: &[],
    });
    if pollster::block_on(scope.pop()).is_some() {
        return Err(GpuError::Memory { mib: bytes.len() >> 20, adapter: gpu.info.name.clone() });
    }
    let layer_bytes = bytes.len() / depth as usize;
    let layers = (SLAB_BYTES / layer_bytes).max(1);
    for (n, slab) in bytes.chunks(layers * layer_bytes).enumerate() {
        let mut target = texture.as_image_copy();
        target.origin.z = (n * layers) as u32;
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some((layer_bytes / height as usize) as u32),
            rows_per_image: Some(height),
        };
        let size = wgpu::Extent3d { width, height, depth_or_array_layers: (slab.len() / layer_bytes) as u32 };
        gpu.queue.write_texture(target, slab, layout, size);
        gpu.queue.submit([]);
        gpu.wait()?;
    }
    Ok(texture)
}
