//! What both renderers work out for a picture before its first ray.

use crate::camera::PixelRays;
use crate::cell_masks::CellMasks;
use crate::light_spans::LightSpans;
use crate::occupancy::DistanceMap;
use crate::scene::{Mode, Scene, Surface};
use crate::spans::Spans;
use crate::{InstructionSet, RenderError};
use bregma_volume::Volume;
use glam::{DVec3, Mat3, Vec3, Vec4};
use std::sync::Arc;

/// Shadow rays begin so far toward the light from where the pixel's ray hit: a hundred times farther than float32 is off there, so that no
/// surface casts a shadow on itself at its own hit; and far below what a pixel shows.
pub const SHADOW_START_VOXEL: f64 = 0.01;

/// One visible layer of a frame.
#[derive(Debug)]
pub(crate) struct FrameLayer {
    /// Its number in the scene.
    pub index: usize,
    pub surface: Surface,
    /// The surface's level as float32.
    pub level: f32,
    pub map: Arc<DistanceMap>,
    pub masks: Arc<CellMasks>,
    /// Which depths of each block of pixels can hold its surface.
    pub spans: Spans,
    /// The pixel rays in the volume's index space, s = 0 at the base plane.
    pub rays: PixelRays,
    /// Index-space normals to world: inverse transpose, scaled so that float32 holds it.
    pub normal_to_world: Mat3,
    /// Linear colour.
    pub color: Vec3,
    pub opacity: f32,
    /// Change in index space per mm toward the light.
    pub to_light: DVec3,
    /// Where it can cast shadows from; of nothing in a scene without.
    pub light_spans: LightSpans,
}

/// A scene worked out for one picture.
#[derive(Debug)]
pub(crate) struct Frame {
    pub layers: Vec<FrameLayer>,
    /// The pixel rays in the world, s = 0 at the eye.
    pub world_rays: PixelRays,
    /// Depth of the base plane before the eye: just before the nearest box, so that s stays small where surfaces are.
    pub base_mm: f64,
    /// Unit, in the world.
    pub toward_light: Vec3,
    /// How far before a surface its shadow rays begin, mm.
    pub shadow_start_mm: f64,
    /// Linear and premultiplied.
    pub background: Vec4,
    /// Only the nearest hit of all layers is drawn.
    pub only_nearest: bool,
}

impl Frame {
    pub fn new(maps: &mut MapCache, volumes: &[Arc<Volume>], scene: &Scene, width: u32, height: u32) -> Result<Self, RenderError> {
        if width == 0 || height == 0 {
            return Err(RenderError::NoPixels { width, height });
        }
        let world_rays = scene.camera.pixel_rays(width, height);
        let surfaces = scene.surfaces(volumes)?;
        let forward = scene.camera.basis().forward;
        let depths = surfaces.iter().flat_map(|(_, s)| s.grid.corners_mm()).map(|c| (c - scene.camera.eye_mm).dot(forward));
        let (near, far) = depths.fold((f64::INFINITY, 0.0_f64), |(near, far), d| (near.min(d), far.max(d)));
        // Before the nearest corner by more than rounding, so that a box is entered through its face and not at the base plane.
        let margin = 1e-3 * (far - near);
        let base_mm = if near.is_finite() { (near - margin).max(0.0) } else { 0.0 };
        let based = world_rays.rebased(base_mm);
        maps.keep_only(&surfaces);
        let toward_light = scene.toward_light();
        let finest_mm = surfaces.iter().map(|(_, s)| s.grid.spacing_mm().min_element()).fold(f64::INFINITY, f64::min);
        let layer = |(index, surface): (usize, Surface)| {
            let to_index = surface.grid.world_to_index();
            let normals = to_index.matrix3.transpose();
            let largest = normals.to_cols_array().iter().fold(0.0_f64, |m, c| m.max(c.abs()));
            let (map, masks) = maps.get(&surface);
            FrameLayer {
                index,
                level: surface.level as f32,
                spans: Spans::of(&map, &masks, &surface.grid, &scene.camera, base_mm, width, height),
                light_spans: if scene.shadows { LightSpans::of(&map, &masks, &surface.grid, toward_light) } else { LightSpans::default() },
                map,
                masks,
                rays: based.mapped(&to_index),
                normal_to_world: (normals * (1.0 / largest)).as_mat3(),
                color: scene.layers[index].color.linear(),
                opacity: scene.layers[index].opacity.clamp(0.0, 1.0),
                to_light: to_index.matrix3 * toward_light,
                surface,
            }
        };
        Ok(Self {
            layers: surfaces.into_iter().map(layer).collect(),
            world_rays,
            base_mm,
            toward_light: toward_light.as_vec3(),
            shadow_start_mm: if finest_mm.is_finite() { SHADOW_START_VOXEL * finest_mm } else { 0.0 },
            background: scene.background.map_or(Vec4::ZERO, |c| c.linear().extend(1.0)),
            only_nearest: scene.mode == Mode::Iso,
        })
    }
}

#[cfg(feature = "gpu")]
impl Frame {
    /// Distance along the unit ray of pixel (x, y) of the depth `s` behind the base plane.
    pub fn depth_mm(&self, x: u32, y: u32, s: f32) -> f32 {
        ((self.base_mm + f64::from(s)) * self.world_rays.direction.at(x, y).length()) as f32
    }
}

/// What is known of the surfaces drawn last: where they can be.
#[derive(Debug)]
pub(crate) struct MapCache {
    /// What they are made with.
    instructions: InstructionSet,
    known: Vec<(Arc<Volume>, f64, Maps)>,
}

type Maps = (Arc<DistanceMap>, Arc<CellMasks>);

impl MapCache {
    pub fn new(instructions: InstructionSet) -> Self {
        Self { instructions, known: vec![] }
    }

    fn get(&mut self, surface: &Surface) -> Maps {
        let known = self.known.iter().find(|(v, level, _)| is_of(surface, v, *level));
        if let Some((.., maps)) = known {
            return maps.clone();
        }
        let (volume, level, sign) = (&surface.volume, surface.level as f32, surface.sign);
        let map = DistanceMap::build(volume.bricks(), level, sign);
        let masks = CellMasks::build(self.instructions, volume.samples(), volume.grid().dims(), &map, level, sign);
        let maps = (Arc::new(map), Arc::new(masks));
        self.known.push((Arc::clone(volume), surface.level, maps.clone()));
        maps
    }

    /// Memory that they take.
    pub fn bytes(&self) -> usize {
        self.known.iter().map(|(.., (map, masks))| map.bytes() + masks.bytes()).sum()
    }

    fn keep_only(&mut self, surfaces: &[(usize, Surface)]) {
        self.known.retain(|(v, level, _)| surfaces.iter().any(|(_, s)| is_of(s, v, *level)));
    }
}

fn is_of(surface: &Surface, volume: &Arc<Volume>, level: f64) -> bool {
    Arc::ptr_eq(&surface.volume, volume) && surface.level == level
}
