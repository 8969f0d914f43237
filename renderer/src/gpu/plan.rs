//! What one picture asks of the GPU: textures, blocks, and the parameters of every pass.

use super::blocks::{self, BLOCK_PIXELS};
use super::layout::{Block, Pair, PixelAffinePairs, ShadeLayer, ShadeParams, TraceParams, padded, padded_matrix};
use super::pipelines::{HIT_BYTES, Pixel, filled_buffer};
use super::{BATCH, GpuError, GpuRenderer, Reads, upload};
use crate::clip::Half;
use crate::frame::{Frame, FrameLayer};
use crate::roots::{Method, Solver};
use crate::scene::{Integrator, MOST_VOLUMES, Mode, Normals, Scene};
use crate::spans::BLOCK;
use std::ops::Range;

/// The passes of a picture.
#[derive(Debug)]
pub(super) struct Plan {
    pub method: Method,
    /// What passes over each volume read.
    pub volumes: Vec<VolumeOnGpu>,
    /// For each volume.
    pub trace: Vec<TraceParams>,
    pub shade: ShadeParams,
    /// For each volume.
    pub colors: Vec<ShadeLayer>,
    /// One behind the other of all volumes, where cuts show them.
    pub face_colors: Vec<[f32; 4]>,
    /// First pixels of the blocks that are drawn, in rows.
    pub blocks: Vec<[u32; 2]>,
    /// Blocks in one dispatch.
    pub batch: usize,
}

/// Numbers of pixels have 16 bits (`at_pixel` of `shaders/line.wgsl`).
const MOST_PIXELS_ACROSS: u32 = 1 << 16;
/// A batch has a multiple of as many blocks, whose records take 256 bytes: where the part of a buffer that a pass sees may begin (WebGPU,
/// "minStorageBufferOffsetAlignment").
const ALIGNED_BLOCKS: usize = 256 / size_of::<Block>();

impl Plan {
    /// The numbers of blocks in each dispatch.
    pub fn batches(&self) -> impl Iterator<Item = Range<usize>> {
        let (count, batch) = (self.blocks.len(), self.batch);
        (0..count).step_by(batch).map(move |first| first..(first + batch).min(count))
    }
}

/// A volume as a pass sees it.
#[derive(Debug)]
pub(super) struct VolumeOnGpu {
    pub samples: wgpu::Texture,
    /// How they are read.
    pub reads: Reads,
    /// Distances of bricks and numbers of their masks.
    pub map: wgpu::Texture,
    pub masks: wgpu::Texture,
    /// The blocks that are drawn, with their spans.
    pub blocks: wgpu::Buffer,
    /// How far the light sees, in a scene with shadows.
    pub light_spans: Option<wgpu::Buffer>,
    /// Cuts, levels with their paints, the table of steps, gradients with their factors, and colours of faces: `extras` of
    /// `shaders/cuts.wgsl`.
    pub extras: wgpu::Buffer,
}

/// What passes over a layer read one by one, see [`VolumeOnGpu::extras`].
fn extras_of(layer: &FrameLayer) -> Vec<[f32; 4]> {
    let cut = |half: &Half, radius: f32| {
        let normal = half.normal.as_vec3();
        // The offset as a pair: its digits beyond float32 would move the cut by less than a pixel shows, but not alike on both renderers.
        let rest = (half.offset_mm - f64::from(half.offset_mm as f32)) as f32;
        [normal.extend(half.offset_mm as f32).to_array(), [radius, rest, 0.0, 0.0]]
    };
    let planes = layer.surface.region.halves.iter().flat_map(|half| cut(half, -1.0));
    let tubes = layer.surface.region.tubes.iter().flat_map(|tube| tube.across.iter().flat_map(|half| cut(half, tube.radius_mm as f32)));
    let levels = layer.levels.iter().zip(&layer.paints).flat_map(|(&level, paint)| [[level, 0.0, 0.0, 0.0], paint.to_array()]);
    let table = layer.steps.entries.iter().map(|entry| entry.to_array());
    let gradients = layer.gradient_factors.iter().map(|&[magnitude, factor]| [magnitude, factor, 0.0, 0.0]);
    let faces = layer.face_colors.iter().map(|color| color.to_array());
    let mut extras: Vec<[f32; 4]> = planes.chain(tubes).chain(levels).chain(table).chain(gradients).chain(faces).collect();
    // A buffer has at least one.
    if extras.is_empty() {
        extras.push([0.0; 4]);
    }
    extras
}

impl GpuRenderer {
    /// The passes of a picture, where each pixel has room for the hits of `slots` passes.
    pub(super) fn plan(&mut self, frame: &Frame, scene: &Scene, width: u32, height: u32, slots: usize) -> Result<Plan, GpuError> {
        let limits = self.gpu.device.limits();
        // A picture is stored in whole blocks.
        let in_blocks = |n: u32| u64::from(n.div_ceil(BLOCK) * BLOCK);
        let most_pixels = limits.max_buffer_size / size_of::<Pixel>() as u64;
        if width.max(height) > MOST_PIXELS_ACROSS || in_blocks(width) * in_blocks(height) > most_pixels {
            let limit = (most_pixels.isqrt() as u32 / BLOCK * BLOCK).min(MOST_PIXELS_ACROSS);
            return Err(GpuError::PictureTooLarge { width, height, limit, adapter: self.gpu.info.name.clone() });
        }
        if scene.layers.len() > MOST_VOLUMES {
            return Err(GpuError::TooManyVolumes { count: scene.layers.len(), most: MOST_VOLUMES });
        }
        let mut volumes = Vec::new();
        // A volume without cells has nothing to walk, and a texture needs at least one brick.
        let layers: Vec<_> = frame.layers.iter().filter(|l| !l.surface.grid.is_flat()).collect();
        let pixels = blocks::seen(&layers);
        for layer in &layers {
            let volume = &layer.surface.volume;
            let (samples, reads) = match scene.method() {
                Method::Solver(Solver::Filter) if scene.is_opaque() => {
                    (self.filtered_texture(volume)?, Reads { component: "f32", in_layers: false })
                }
                _ => {
                    let (component, in_layers) = (upload::kind_of(volume.samples()).1, upload::has_layers(&self.gpu, volume));
                    (self.sample_texture(volume)?, Reads { component, in_layers })
                }
            };
            let map = self.map_texture(&layer.map, &layer.masks)?;
            let masks = self.mask_texture(&layer.masks)?;
            let blocks = blocks::of_layer(layer, &pixels);
            let blocks = filled_buffer(&self.gpu, bytemuck::cast_slice(&blocks), wgpu::BufferUsages::STORAGE);
            let near = &layer.light_spans.near;
            let light_spans = scene.shadows.then(|| filled_buffer(&self.gpu, bytemuck::cast_slice(near), wgpu::BufferUsages::STORAGE));
            let extras = filled_buffer(&self.gpu, bytemuck::cast_slice(&extras_of(layer)), wgpu::BufferUsages::STORAGE);
            volumes.push(VolumeOnGpu { samples, reads, map, masks, blocks, light_spans, extras });
        }
        let pixels_at_once = limits.max_storage_buffer_binding_size / (HIT_BYTES * slots.max(1) as u64);
        let most = (pixels_at_once as usize / BLOCK_PIXELS).min(BATCH);
        let all = (width.div_ceil(BLOCK) * height.div_ceil(BLOCK)) as usize;
        let batch = all.next_multiple_of(ALIGNED_BLOCKS).min(most / ALIGNED_BLOCKS * ALIGNED_BLOCKS);
        let stride = (batch * BLOCK_PIXELS) as u32;
        let trace = |(pass, layer): (usize, &&FrameLayer)| TraceParams {
            origin: PixelAffinePairs::new(&layer.rays.origin),
            direction: PixelAffinePairs::new(&layer.rays.direction),
            world_origin: PixelAffinePairs::new(&frame.based_rays.origin),
            world_direction: PixelAffinePairs::new(&frame.based_rays.direction),
            normal_to_world: padded_matrix(layer.normal_to_world),
            dims: layer.surface.grid.dims().map(|n| n as i32),
            level: layer.level,
            bricks: layer.map.dims().map(|n| n as i32),
            sign: layer.surface.sign,
            pass_number: pass as u32,
            stride,
            only_nearest: u32::from(frame.only_nearest),
            zero: 0,
            to_light: Pair::new(layer.to_light),
            toward_light: frame.toward_light.to_array(),
            shadow_start: frame.shadow_start_mm as f32,
            to_light_spans: padded_matrix(layer.light_spans.from_index.matrix3.as_mat3()),
            light_spans_origin: layer.light_spans.from_index.translation.as_vec3().to_array(),
            passes: layers.len() as u32,
            light_blocks: layer.light_spans.size,
            cuts: (layer.surface.region.halves.len() + 2 * layer.surface.region.tubes.len()) as u32,
            analytic_normals: u32::from(scene.normals == Normals::Analytic),
            levels: layer.levels.len() as u32,
            table: layer.steps.entries.len() as u32,
            gradients: layer.gradient_factors.len() as u32,
            table_per_unit: layer.steps.per_unit,
            id: layer.index as u32 + 1,
            has_inner: u32::from(layer.inner.is_some()),
            shows_faces: u32::from(layer.shows_faces),
            padding: 0,
            brightness: layer.brightness,
            padding_after: [0; 2],
            inner: padded(layer.inner.unwrap_or_default()),
            color: padded(layer.color),
            gradient_to_world: padded_matrix(layer.gradient_to_world),
        };
        let view = frame.world_rays.direction;
        let shade = ShadeParams {
            view_base: padded(view.base.as_vec3()),
            view_per_x: padded(view.per_x.as_vec3()),
            view_per_y: padded(view.per_y.as_vec3()),
            toward_light: frame.toward_light.to_array(),
            ambient: scene.light.ambient,
            diffuse: scene.light.diffuse,
            specular: scene.light.specular,
            shininess: scene.light.shininess,
            stride,
            passes: layers.len() as u32,
            overlay: u32::from(scene.mode == Mode::Overlay),
            shadows: u32::from(scene.shadows),
            cue_per_mm: frame.cue_per_mm,
            background: frame.background.to_array(),
            step_mm: frame.step_mm,
            jitter: u32::from(matches!(scene.integrator, Integrator::Steps { jitter: true, .. })),
            cut_face: scene.cut_face as u32,
            skin_mm: frame.skin_mm,
        };
        let color = |l: &&FrameLayer| ShadeLayer { color: l.color.extend(l.opacity).to_array(), id: l.index as u32 + 1, padding: [0; 3] };
        let trace = layers.iter().enumerate().map(trace).collect();
        let colors = layers.iter().map(color).collect();
        let mut face_colors: Vec<[f32; 4]> = layers.iter().flat_map(|l| &l.face_colors).map(|c| c.to_array()).collect();
        // A buffer has at least one.
        if face_colors.is_empty() {
            face_colors.push([0.0; 4]);
        }
        Ok(Plan { method: scene.method(), volumes, trace, shade, colors, face_colors, blocks: pixels, batch })
    }
}
