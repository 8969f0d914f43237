//! The GPU renderer: one compute pass for each volume and one for shading, a batch of tiles at a time, so that no dispatch comes near
//! the time after which operating systems kill it.

mod device;
mod layout;
mod pipelines;
mod segments;
mod upload;

use device::Gpu;
pub use device::GpuError;
use layout::{PixelAffinePairs, ShadeLayer, ShadeParams, TraceParams, padded, padded_matrix};
use pipelines::{Pipelines, Target};

use crate::frame::{Frame, FrameLayer, MapCache};
use crate::occupancy::DistanceMap;
use crate::roots::{PerVoxel, Solver, Steps};
use crate::scene::{Mode, Picture, Scene};
use crate::{RenderError, Renderer};
use bregma_volume::Volume;
use std::sync::{Arc, Weak};

/// Side of a tile in pixels; below 256 pixel numbers have 8 bits, which keeps ray set-up exact (see `line.wgsl`).
const TILE: u32 = 256;
/// Tiles in one dispatch: about 0.2 s of a software driver, a few ms of a graphics card.
const BATCH: u64 = 8;

macro_rules! wgsl {
    ($name:literal) => {
        include_str!(concat!("../../../shaders/", $name, ".wgsl"))
    };
}

/// The WGSL of a solver that works within a cell; `None` for fixed steps.
fn solver_source(solver: Solver) -> Option<String> {
    let count = |steps: Steps| match steps {
        Steps::Two => "2u",
        Steps::Three => "3u",
        Steps::Four => "4u",
    };
    let source = match solver {
        Solver::Exact => wgsl!("exact").to_owned(),
        Solver::Linear => wgsl!("linear").to_owned(),
        Solver::Neubauer(steps) => wgsl!("neubauer").replace("STEP_COUNT", count(steps)),
        Solver::Marmitt(steps) => wgsl!("marmitt").replace("STEP_COUNT", count(steps)),
        Solver::Analytic => wgsl!("analytic").to_owned(),
        Solver::Step(_) => return None,
    };
    Some([wgsl!("interpolant"), wgsl!("bernstein"), &source].join("\n"))
}

/// The WGSL of the pass over a volume whose texture has components of type `component`, with one solver compiled in.
fn trace_source(component: &str, solver: Solver) -> String {
    let per_voxel = |steps: PerVoxel| match steps {
        PerVoxel::One => "1.0",
        PerVoxel::Two => "2.0",
        PerVoxel::Four => "4.0",
        PerVoxel::Eight => "8.0",
    };
    let in_brick = match (solver, solver_source(solver)) {
        (Solver::Step(steps), _) => [wgsl!("interpolant"), &wgsl!("steps").replace("PER_VOXEL", per_voxel(steps))].join("\n"),
        (_, source) => [source.as_deref().unwrap_or_default(), wgsl!("cells")].join("\n"),
    };
    let walk = wgsl!("walk").replace("SAMPLE", component);
    [wgsl!("line"), &in_brick, &walk, wgsl!("trace")].join("\n")
}

/// The WGSL of the shading pass.
const SHADE: &str = wgsl!("shade");

/// Draws on the GPU. Keeps volumes, distance maps and pictures there between frames.
#[derive(Debug)]
pub struct GpuRenderer {
    gpu: Gpu,
    pipelines: Pipelines,
    maps: MapCache,
    volumes: Vec<(Weak<Volume>, wgpu::Texture)>,
    map_textures: Vec<(Weak<DistanceMap>, wgpu::Texture)>,
    target: Option<Target>,
}

impl GpuRenderer {
    /// On the fastest adapter; a software driver only if `software` allows it.
    pub fn new(software: bool) -> Result<Self, GpuError> {
        let gpu = Gpu::open(software)?;
        let pipelines = Pipelines::new(&gpu);
        Ok(Self { gpu, pipelines, maps: MapCache::default(), volumes: vec![], map_textures: vec![], target: None })
    }

    fn sample_texture(&mut self, volume: &Arc<Volume>) -> Result<wgpu::Texture, GpuError> {
        cached(&mut self.volumes, volume, || upload::upload_samples(&self.gpu, volume))
    }

    fn map_texture(&mut self, map: &Arc<DistanceMap>) -> Result<wgpu::Texture, GpuError> {
        cached(&mut self.map_textures, map, || upload::upload_map(&self.gpu, map))
    }

    fn draw(&mut self, frame: &Frame, scene: &Scene, width: u32, height: u32) -> Result<Picture, GpuError> {
        let limit = self.gpu.device.limits().max_texture_dimension_2d;
        if width > limit || height > limit {
            return Err(GpuError::PictureTooLarge { width, height, limit, adapter: self.gpu.info.name.clone() });
        }
        let mut volumes = Vec::new();
        // A volume without cells has nothing to walk, and a texture needs at least one brick.
        let layers: Vec<_> = frame.layers.iter().filter(|l| !l.surface.grid.is_flat()).collect();
        for layer in &layers {
            let samples = self.sample_texture(&layer.surface.volume)?;
            let map = self.map_texture(&layer.map)?;
            volumes.push((samples, map, upload::kind_of(layer.surface.volume.samples()).1));
        }
        let limit = self.gpu.device.limits().max_storage_buffer_binding_size;
        let batch = (limit / pipelines::hit_bytes(layers.len())).min(BATCH);
        if batch == 0 {
            return Err(GpuError::TooManyVolumes { count: layers.len(), most: (limit / pipelines::hit_bytes(1)) as usize });
        }
        let target = match self.target.take() {
            Some(t) if t.width == width && t.height == height => t,
            _ => Target::new(&self.gpu, width, height),
        };
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
                s_max: frame.s_max,
                only_nearest: u32::from(frame.only_nearest),
                zero: 0,
                padding: 0,
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
        self.pipelines.run(&self.gpu, scene.solver, &volumes, &trace, &shade, &colors, &target, batch as usize);
        let picture = target.read(&self.gpu, frame)?;
        self.target = Some(target);
        Ok(picture)
    }
}

impl Renderer for GpuRenderer {
    fn name(&self) -> String {
        self.gpu.name()
    }

    fn render(&mut self, volumes: &[Arc<Volume>], scene: &Scene, width: u32, height: u32) -> Result<Picture, RenderError> {
        let frame = Frame::new(&mut self.maps, volumes, scene, width, height)?;
        Ok(self.draw(&frame, scene, width, height)?)
    }
}

/// The texture of `of`, made when it is new; those whose source is gone are dropped.
fn cached<T>(
    cache: &mut Vec<(Weak<T>, wgpu::Texture)>,
    of: &Arc<T>,
    make: impl FnOnce() -> Result<wgpu::Texture, GpuError>,
) -> Result<wgpu::Texture, GpuError> {
    cache.retain(|(source, _)| source.strong_count() > 0);
    if let Some((_, texture)) = cache.iter().find(|(source, _)| std::ptr::eq(source.as_ptr(), Arc::as_ptr(of))) {
        return Ok(texture.clone());
    }
    let texture = make()?;
    cache.push((Arc::downgrade(of), texture.clone()));
    Ok(texture)
}
