//! Volumes as textures in the type of their samples: shaders read exactly what the file holds. An array of 2D textures, one for each k,
//! gives four samples in one fetch; a 3D texture takes what such an array does not. Hardware filters no integers, so the solver `filter`
//! takes them as float32.

use super::device::{Gpu, GpuError};
use super::pipelines::filled_buffer;
use crate::cell_masks::{CellMasks, Mask};
use crate::occupancy::DistanceMap;
use bregma_volume::{BRICK, Sample, Samples, Volume, with_samples};

/// How samples are stored on the GPU: the texture's format and its component type in WGSL.
pub(super) fn kind_of(samples: &Samples) -> (wgpu::TextureFormat, &'static str) {
    match samples {
        Samples::U8(_) => (wgpu::TextureFormat::R8Uint, "u32"),
        Samples::U16(_) => (wgpu::TextureFormat::R16Uint, "u32"),
        Samples::I16(_) => (wgpu::TextureFormat::R16Sint, "i32"),
        Samples::F32(_) => (wgpu::TextureFormat::R32Float, "f32"),
    }
}

/// Uploads the samples of `volume`.
pub(super) fn upload_samples(gpu: &Gpu, volume: &Volume) -> Result<wgpu::Texture, GpuError> {
    let bytes: &[u8] = match volume.samples() {
        Samples::U8(s) => s,
        Samples::U16(s) => bytemuck::cast_slice(s),
        Samples::I16(s) => bytemuck::cast_slice(s),
        Samples::F32(s) => bytemuck::cast_slice(s),
    };
    upload(gpu, volume.grid().dims(), kind_of(volume.samples()).0, bytes, has_layers(gpu, volume))
}

/// Whether the samples of `volume` are an array of 2D textures, and not a 3D texture.
pub(super) fn has_layers(gpu: &Gpu, volume: &Volume) -> bool {
    let [nx, ny, nz] = volume.grid().dims();
    let limits = gpu.device.limits();
    nx.max(ny) <= limits.max_texture_dimension_2d as usize && nz <= limits.max_texture_array_layers as usize
}

/// Uploads the samples of `volume` as float32, which holds those of every type.
pub(super) fn upload_as_f32(gpu: &Gpu, volume: &Volume) -> Result<wgpu::Texture, GpuError> {
    let samples: Vec<f32> = with_samples!(volume.samples(), s => s.iter().map(|s| s.to_f32()).collect());
    upload(gpu, volume.grid().dims(), wgpu::TextureFormat::R32Float, bytemuck::cast_slice(&samples), false)
}

/// Uploads a distance map with the numbers of the masks above its 8 bits.
pub(super) fn upload_map(gpu: &Gpu, map: &DistanceMap, masks: &CellMasks) -> Result<wgpu::Texture, GpuError> {
    let texels: Vec<u32> = map.distances().iter().zip(masks.slots()).map(|(&distance, slot)| u32::from(distance) | slot << 8).collect();
    upload(gpu, map.dims(), wgpu::TextureFormat::R32Uint, bytemuck::cast_slice(&texels), false)
}

/// Uploads the masks.
pub(super) fn upload_masks(gpu: &Gpu, masks: &CellMasks) -> Result<wgpu::Buffer, GpuError> {
    // A buffer holds at least one mask, even where nothing can be met.
    let none = [[0; BRICK]];
    let bytes: &[u8] = bytemuck::cast_slice(if masks.masks().is_empty() { &none } else { masks.masks() });
    // The number of a mask has 24 bits beside a distance; a buffer as large would be 1 GiB.
    let most = gpu.device.limits().max_storage_buffer_binding_size.min((size_of::<Mask>() as u64) << 24);
    if bytes.len() as u64 > most {
        return Err(GpuError::Memory { mib: bytes.len() >> 20, adapter: gpu.info.name.clone() });
    }
    Ok(filled_buffer(gpu, bytes, wgpu::BufferUsages::STORAGE))
}

/// Bytes on their way at once: the driver keeps a copy of what is not yet on the card.
const SLAB_BYTES: usize = 64 << 20;

/// Uploads `dims` texels as an array of 2D textures with a layer for each k, which the limits allow, or as a 3D texture.
pub(super) fn upload(
    gpu: &Gpu,
    dims: [usize; 3],
    format: wgpu::TextureFormat,
    bytes: &[u8],
    in_layers: bool,
) -> Result<wgpu::Texture, GpuError> {
    let limit = gpu.device.limits().max_texture_dimension_3d;
    if !in_layers && dims.iter().any(|&n| n > limit as usize) {
        return Err(GpuError::TooLarge { dims, limit, adapter: gpu.info.name.clone() });
    }
    let [width, height, depth] = dims.map(|n| n as u32);
    let scope = gpu.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("volume"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: depth },
        mip_level_count: 1,
        sample_count: 1,
        dimension: if in_layers { wgpu::TextureDimension::D2 } else { wgpu::TextureDimension::D3 },
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
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
