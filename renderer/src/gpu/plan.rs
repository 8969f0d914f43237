//! What one picture asks of the GPU: textures, blocks, and the parameters of every pass.

use super::blocks::{self, BLOCK_PIXELS};
use super::buffers::{HIT_BYTES, Pixel, filled_buffer};
use super::layout::{
    AffinePairs, Block, NO_SOLID, Pair, Part, PixelAffinePairs, ShadeLayer, ShadeParams, TraceParams, padded, padded_matrix,
};
use super::shader::{Component, Reads};
use super::solids::Solids;
use super::{BATCH, GpuError, GpuRenderer, upload};
use crate::frame::{Frame, FrameLayer};
use crate::layer::AGREED;
use crate::picture::MOST_VOLUMES;
use crate::roots::{Method, Solver};
use crate::scene::{Normals, Scene};
use crate::skip::BLOCK;
use bregma_field::clip::Half;
use bregma_field::{Region, Solid, Surface};
use std::ops::Range;
use std::sync::Arc;

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
    /// For each of these a [`Block`] for each volume, side by side.
    pub spans: wgpu::Buffer,
    /// Cuts, levels with their paints, tables of steps, gradients with their factors, and colours of faces, of all volumes: `extras` of
    /// `shaders/volume.wgsl`.
    pub extras: wgpu::Buffer,
    /// What volumes are cut by.
    pub solids: Option<wgpu::Buffer>,
    /// Blocks in one dispatch.
    pub batch: usize,
}

/// Numbers of pixels have 16 bits (`at_pixel` of `shaders/line.wgsl`).
const MOST_PIXELS_ACROSS: u32 = 1 << 16;
/// The number of blocks in a batch is a multiple of this: then every batch begins at a multiple of 256 bytes of the buffer of blocks, as the part of
/// a buffer that a pass sees must (WebGPU, "minStorageBufferOffsetAlignment").
const ALIGNED_BLOCKS: usize = 256 / size_of::<Block>();

impl Plan {
    /// Pixels of a batch.
    pub fn pixels(&self) -> usize {
        self.batch * BLOCK_PIXELS
    }

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
    /// How far the light sees, in a scene with shadows.
    pub light_spans: Option<wgpu::Buffer>,
}

impl VolumeOnGpu {
    /// What is bound of its textures.
    pub fn views(&self) -> [wgpu::TextureView; 3] {
        // Of a single layer the default is no array.
        let dimension = self.reads.in_layers.then_some(wgpu::TextureViewDimension::D2Array);
        let samples = self.samples.create_view(&wgpu::TextureViewDescriptor { dimension, ..Default::default() });
        [samples, self.map.create_view(&Default::default()), self.masks.create_view(&Default::default())]
    }
}

/// What volumes have any number of, one behind the other.
#[derive(Default)]
pub(super) struct Extras(pub Vec<[f32; 4]>);

impl Extras {
    /// Adds things of `size` records each.
    pub fn add(&mut self, size: usize, records: impl Iterator<Item = [f32; 4]>) -> Part {
        let first = self.0.len();
        self.0.extend(records);
        Part { first: first as u32, count: ((self.0.len() - first) / size) as u32 }
    }

    /// Adds the cuts of a volume.
    pub fn add_cuts(&mut self, region: &Region) -> Part {
        let planes = region.halves.iter().flat_map(|half| cut_records(half, -1.0));
        let rounds = region.rounds.iter().flat_map(|round| round.across.iter().flat_map(|half| cut_records(half, round.radius_mm as f32)));
        self.add(2, planes.chain(rounds))
    }
}

/// A cut as `cut_at` and `rest_of_cut` of `shaders/cuts.wgsl` read it; of a plane the radius is −1.
fn cut_records(half: &Half, radius: f32) -> [[f32; 4]; 2] {
    let normal = half.normal.as_vec3();
    // The offset as a pair: its digits beyond float32 would move the cut by less than a pixel shows, but not alike on both renderers.
    let rest = (half.offset_mm - f64::from(half.offset_mm as f32)) as f32;
    [normal.extend(half.offset_mm as f32).to_array(), [radius, rest, 0.0, 0.0]]
}

impl GpuRenderer {
    /// The passes of a picture, where each pixel has room for the hits of `slots` passes.
    pub(super) fn plan(&mut self, frame: &Frame, scene: &Scene, width: u32, height: u32, slots: usize) -> Result<Plan, GpuError> {
        self.check_size(scene, width, height)?;
        // A volume without cells has nothing to walk, and a texture needs at least one brick.
        let layers: Vec<_> = frame.layers.iter().filter(|l| !l.placement.surface.grid.is_flat()).collect();
        let volumes = layers.iter().map(|layer| self.volume(layer, scene, frame.has_solver)).collect::<Result<Vec<_>, _>>()?;
        let blocks = blocks::seen(&layers);
        let spans = blocks::spans(&layers, &blocks);
        let pixels_at_once = self.gpu.device.limits().max_storage_buffer_binding_size / (HIT_BYTES * slots.max(1) as u64);
        let most = (pixels_at_once as usize / BLOCK_PIXELS).min(BATCH);
        let all = (width.div_ceil(BLOCK) * height.div_ceil(BLOCK)) as usize;
        let batch = all.next_multiple_of(ALIGNED_BLOCKS).min(most / ALIGNED_BLOCKS * ALIGNED_BLOCKS);
        let stride = (batch * BLOCK_PIXELS) as u32;
        let solids = self.solids(layers.iter().map(|layer| layer.placement.surface.solid.clone()).collect())?;
        let (mut extras, mut trace) = (Extras::default(), vec![]);
        for (number, layer) in layers.iter().enumerate() {
            let solid = solids.map_or([NO_SOLID, 0, 0], |solids| solids.places[number]);
            trace.push(TraceParams { solid, ..trace_params(frame, scene, layer, [number, layers.len()], stride, &mut extras) });
        }
        let solids = solids.map(|solids| solids.buffer.clone());
        let color = |l: &&FrameLayer| ShadeLayer {
            color: l.appearance.color.extend(l.appearance.opacity).to_array(),
            id: l.placement.index as u32 + 1,
            padding: [0; 3],
        };
        let mut face_colors: Vec<[f32; 4]> = layers.iter().flat_map(|l| &l.appearance.face_colors).map(|c| c.to_array()).collect();
        // A buffer has at least one.
        [&mut face_colors, &mut extras.0].into_iter().filter(|records| records.is_empty()).for_each(|records| records.push([0.0; 4]));
        let storage = |bytes: &[u8]| filled_buffer(&self.gpu, bytes, wgpu::BufferUsages::STORAGE);
        Ok(Plan {
            method: scene.method(),
            volumes,
            trace,
            shade: shade_params(frame, scene, layers.len(), stride),
            colors: layers.iter().map(color).collect(),
            face_colors,
            spans: storage(bytemuck::cast_slice(&spans)),
            blocks,
            extras: storage(bytemuck::cast_slice(&extras.0)),
            solids,
            batch,
        })
    }

    /// Whether a picture of that size has room on the adapter, and its pixels for the numbers of all volumes.
    fn check_size(&self, scene: &Scene, width: u32, height: u32) -> Result<(), GpuError> {
        // A picture is stored in whole blocks.
        let in_blocks = |n: u32| u64::from(n.div_ceil(BLOCK) * BLOCK);
        let most_pixels = self.gpu.device.limits().max_buffer_size / size_of::<Pixel>() as u64;
        if width.max(height) > MOST_PIXELS_ACROSS || in_blocks(width) * in_blocks(height) > most_pixels {
            let limit = (most_pixels.isqrt() as u32 / BLOCK * BLOCK).min(MOST_PIXELS_ACROSS);
            return Err(GpuError::PictureTooLarge { width, height, limit, adapter: self.gpu.info.name.clone() });
        }
        if scene.layers.len() > MOST_VOLUMES {
            return Err(GpuError::TooManyVolumes { count: scene.layers.len(), most: MOST_VOLUMES });
        }
        Ok(())
    }

    /// Brings what volumes are cut by to the GPU; none where there is nothing.
    pub(super) fn solids(&mut self, of: Vec<Option<Arc<Solid>>>) -> Result<Option<&Solids>, GpuError> {
        if of.iter().all(Option::is_none) {
            self.solids = None;
        } else if !self.solids.as_ref().is_some_and(|known| known.are_of(&of)) {
            self.solids = Some(Solids::new(&self.gpu, of)?);
        }
        Ok(self.solids.as_ref())
    }

    /// Brings a surface's samples to the GPU, and says how they are read.
    pub(super) fn samples_of(&mut self, surface: &Surface) -> Result<(wgpu::Texture, Reads), GpuError> {
        let (component, in_layers) = (upload::kind_of(&surface.volume).1, upload::has_layers(&self.gpu, &surface.volume));
        Ok((self.sample_texture(&surface.volume)?, Reads { component, in_layers, is_cut: surface.solid.is_some() }))
    }

    /// Brings a layer's volume, and where its surface can be, to the GPU.
    fn volume(&mut self, layer: &FrameLayer, scene: &Scene, has_solver: bool) -> Result<VolumeOnGpu, GpuError> {
        let volume = &layer.placement.surface.volume;
        let (samples, reads) = match scene.method() {
            Method::Solver(Solver::Filter) if has_solver => {
                (self.filtered_texture(volume)?, Reads { component: Component::F32, in_layers: false, is_cut: false })
            }
            _ => self.samples_of(&layer.placement.surface)?,
        };
        let map = self.map_texture(&layer.skip.map, &layer.skip.masks)?;
        let masks = self.mask_texture(&layer.skip.masks)?;
        let near = &layer.skip.light_spans.near;
        let light_spans = scene.shadows.then(|| filled_buffer(&self.gpu, bytemuck::cast_slice(near), wgpu::BufferUsages::STORAGE));
        Ok(VolumeOnGpu { samples, reads, map, masks, light_spans })
    }
}

/// What passes know of a layer that is number `number` of `passes`.
fn trace_params(
    frame: &Frame,
    scene: &Scene,
    layer: &FrameLayer,
    [number, passes]: [usize; 2],
    stride: u32,
    extras: &mut Extras,
) -> TraceParams {
    let FrameLayer { placement, skip, appearance } = layer;
    let levels = appearance.levels.iter().zip(&appearance.paints).flat_map(|(&level, paint)| [[level, 0.0, 0.0, 0.0], paint.to_array()]);
    let gradients = appearance.gradient_factors.iter().map(|&[magnitude, factor]| [magnitude, factor, 0.0, 0.0]);
    TraceParams {
        world_origin: PixelAffinePairs::new(&frame.based_rays.origin),
        world_direction: PixelAffinePairs::new(&frame.based_rays.direction),
        toward_light: frame.toward_light.to_array(),
        shadow_start: frame.shadow_start_mm as f32,
        pass_number: number as u32,
        passes: passes as u32,
        stride,
        only_nearest: u32::from(frame.only_nearest),
        zero: 0,
        analytic_normals: u32::from(scene.normals == Normals::Analytic),
        number: number as u32,
        id: placement.index as u32 + 1,
        origin: PixelAffinePairs::new(&placement.rays.origin),
        direction: PixelAffinePairs::new(&placement.rays.direction),
        to_index: AffinePairs::new(&placement.surface.grid.world_to_index()),
        to_world: AffinePairs::new(&placement.surface.grid.index_to_world()),
        dims: placement.surface.grid.dims().map(|n| n as i32),
        level: placement.level,
        to_light: Pair::new(placement.to_light),
        normal_to_world: padded_matrix(placement.normal_to_world),
        gradient_to_world: padded_matrix(placement.gradient_to_world),
        bricks: skip.map.dims().map(|n| n as i32),
        sign: placement.surface.sign,
        to_light_spans: padded_matrix(skip.light_spans.from_index.matrix3.as_mat3()),
        light_spans_origin: padded(skip.light_spans.from_index.translation.as_vec3()),
        light_blocks: skip.light_spans.size,
        cuts: extras.add_cuts(&placement.surface.region),
        levels: extras.add(2, levels),
        table: extras.add(1, appearance.steps.entries.iter().map(|entry| entry.to_array())),
        gradients: extras.add(1, gradients),
        face_colors: extras.add(1, appearance.face_colors.iter().map(|color| color.to_array())),
        brightness: appearance.brightness,
        table_per_unit: appearance.steps.per_unit,
        shows_faces: u32::from(appearance.shows_faces),
        inner: appearance.inner.unwrap_or_default().to_array(),
        has_inner: u32::from(appearance.inner.is_some()),
        color: appearance.color.to_array(),
        contour: appearance.contour,
        solid: [NO_SOLID, 0, 0],
        rim_units: placement.rim_units,
    }
}

/// What shading knows of a scene.
fn shade_params(frame: &Frame, scene: &Scene, passes: usize, stride: u32) -> ShadeParams {
    let view = frame.world_rays.direction;
    ShadeParams {
        view_base: view.base.as_vec3().to_array(),
        shadow: scene.light.shadow,
        view_per_x: padded(view.per_x.as_vec3()),
        view_per_y: padded(view.per_y.as_vec3()),
        toward_light: frame.toward_light.to_array(),
        ambient: scene.light.ambient,
        diffuse: scene.light.diffuse,
        specular: scene.light.specular,
        shininess: scene.light.shininess,
        stride,
        passes: passes as u32,
        overlay: u32::from(frame.overlays),
        shadows: u32::from(scene.shadows),
        cue_per_mm: frame.cue_per_mm,
        background: frame.background.to_array(),
        step_mm: frame.step_mm,
        jitter: frame.jitter,
        cut_face: scene.cut_face as u32,
        skin_mm: frame.skin_mm,
        agreed: AGREED.linear().to_array(),
        agreement_mm: frame.agreement_mm,
        depth_range_mm: frame.depth_range_mm,
        padding: [0; 3],
    }
}
