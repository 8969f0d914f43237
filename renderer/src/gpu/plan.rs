//! What one picture asks of the GPU: textures, and the parameters of every pass over every tile.

use super::layout::{PixelAffinePairs, ShadeLayer, ShadeParams, TraceParams, padded, padded_matrix};
use super::pipelines::{filled_buffer, hit_bytes};
use super::{BATCH, GpuError, GpuRenderer, TILE, upload};
use crate::frame::{Frame, FrameLayer};
use crate::roots::Solver;
use crate::scene::{Mode, Scene};
use crate::spans::BLOCK;

/// The passes of a picture.
#[derive(Debug)]
pub(super) struct Plan {
    pub solver: Solver,
    /// What passes over each volume read.
    pub volumes: Vec<VolumeOnGpu>,
    /// For each volume, the parameters of each tile.
    pub trace: Vec<Vec<TraceParams>>,
    /// The parameters of each tile.
    pub shade: Vec<ShadeParams>,
    /// For each volume.
    pub colors: Vec<ShadeLayer>,
    /// Tiles in one dispatch.
    pub batch: usize,
}

/// A volume as a pass sees it.
#[derive(Debug)]
pub(super) struct VolumeOnGpu {
    pub samples: wgpu::Texture,
    /// Component type of the samples.
    pub component: &'static str,
    /// Distances of bricks and numbers of their masks.
    pub map: wgpu::Texture,
    pub masks: wgpu::Buffer,
    pub spans: wgpu::Buffer,
}

impl GpuRenderer {
    /// The passes of a picture, where each pixel has room for the hits of `slots` passes.
    pub(super) fn plan(&mut self, frame: &Frame, scene: &Scene, width: u32, height: u32, slots: usize) -> Result<Plan, GpuError> {
        let limit = self.gpu.device.limits().max_texture_dimension_2d;
        if width > limit || height > limit {
            return Err(GpuError::PictureTooLarge { width, height, limit, adapter: self.gpu.info.name.clone() });
        }
        let mut volumes = Vec::new();
        // A volume without cells has nothing to walk, and a texture needs at least one brick.
        let layers: Vec<_> = frame.layers.iter().filter(|l| !l.surface.grid.is_flat()).collect();
        for layer in &layers {
            let volume = &layer.surface.volume;
            let (samples, component) = match scene.solver {
                Solver::Filter => (self.filtered_texture(volume)?, "f32"),
                _ => (self.sample_texture(volume)?, upload::kind_of(volume.samples()).1),
            };
            let map = self.map_texture(&layer.map, &layer.masks)?;
            let masks = self.mask_buffer(&layer.masks)?;
            let spans = filled_buffer(&self.gpu, bytemuck::cast_slice(&layer.spans.blocks), wgpu::BufferUsages::STORAGE);
            volumes.push(VolumeOnGpu { samples, component, map, masks, spans });
        }
        let limit = self.gpu.device.limits().max_storage_buffer_binding_size;
        let batch = (limit / hit_bytes(slots)).min(BATCH);
        if batch == 0 {
            return Err(GpuError::TooManyVolumes { count: layers.len(), most: (limit / hit_bytes(1)) as usize });
        }
        let stride = TILE * TILE * batch as u32;
        let tiles: Vec<[u32; 4]> = (0..height)
            .step_by(TILE as usize)
            .flat_map(|y| (0..width).step_by(TILE as usize).map(move |x| [x, y, TILE.min(width - x), TILE.min(height - y)]))
            .collect();
        let trace_tile = |layer: &FrameLayer, pass: usize, [x, y, w, h]: [u32; 4]| {
            let rays = layer.rays.from_pixel(x, y);
            TraceParams {
                origin: PixelAffinePairs::new(&rays.origin),
                direction: PixelAffinePairs::new(&rays.direction),
                normal_to_world: padded_matrix(layer.normal_to_world),
                dims: layer.surface.grid.dims().map(|n| n as i32),
                level: layer.level,
                bricks: layer.map.dims().map(|n| n as i32),
                sign: layer.surface.sign,
                tile: [w, h],
                pass_number: pass as u32,
                stride,
                only_nearest: u32::from(frame.only_nearest),
                zero: 0,
                blocks_across: layer.spans.across,
                padding: 0,
                block: [x / BLOCK, y / BLOCK],
                more_padding: [0; 2],
            }
        };
        let trace: Vec<Vec<TraceParams>> =
            layers.iter().enumerate().map(|(pass, layer)| tiles.iter().map(|&tile| trace_tile(layer, pass, tile)).collect()).collect();
        let shade: Vec<ShadeParams> = tiles
            .iter()
            .map(|&[x, y, w, h]| {
                let view = frame.world_rays.from_pixel(x, y).direction;
                ShadeParams {
                    view_base: padded(view.base.as_vec3()),
                    view_per_x: padded(view.per_x.as_vec3()),
                    view_per_y: padded(view.per_y.as_vec3()),
                    toward_light: frame.toward_light.to_array(),
                    ambient: scene.light.ambient,
                    background: frame.background.to_array(),
                    diffuse: scene.light.diffuse,
                    specular: scene.light.specular,
                    shininess: scene.light.shininess,
                    stride,
                    corner: [x, y],
                    tile: [w, h],
                    passes: layers.len() as u32,
                    overlay: u32::from(scene.mode == Mode::Overlay),
                    padding: [0; 2],
                }
            })
            .collect();
        let colors: Vec<ShadeLayer> = layers
            .iter()
            .map(|l| ShadeLayer { color: l.color.extend(l.opacity).to_array(), id: l.index as u32 + 1, padding: [0; 3] })
            .collect();
        Ok(Plan { solver: scene.solver, volumes, trace, shade, colors, batch: batch as usize })
    }
}
