//! What both renderers work out for a picture before its first ray.

use crate::RenderError;
use crate::appearance::Appearance;
use crate::camera::PixelRays;
use crate::modes::{Gather, Setting};
use crate::scene::{Integrator, Scene, Window};
use crate::skip::{MapCache, Skip};
use bregma_field::{Surface, Unit, Volume, spline};
use glam::{DVec3, Mat3, Vec3, Vec4};
use std::sync::Arc;

/// Shadow rays begin so far toward the light from where the pixel's ray hit: a hundred times farther than float32 is off there, so that no
/// surface casts a shadow on itself at its own hit; and far below what a pixel shows.
pub const SHADOW_START_VOXEL: f64 = 0.01;

/// One visible layer of a frame.
#[derive(Debug)]
pub(crate) struct FrameLayer {
    /// Where it is.
    pub placement: Placement,
    /// What need not be walked of it.
    pub skip: Skip,
    /// What it looks like.
    pub appearance: Appearance,
}

/// Where a layer is, as its rays see it.
#[derive(Debug)]
pub(crate) struct Placement {
    /// Its number in the scene.
    pub index: usize,
    pub surface: Surface,
    /// The surface's level as float32.
    pub level: f32,
    /// The pixel rays in the volume's index space, s = 0 at the base plane.
    pub rays: PixelRays,
    /// Change in index space per mm toward the light.
    pub to_light: DVec3,
    /// Index-space normals to world: inverse transpose, scaled so that float32 holds it.
    pub normal_to_world: Mat3,
    /// Gradients in index space to the world, in sample units per mm.
    pub gradient_to_world: Mat3,
}

impl Placement {
    /// Of layer `index`, which `rays` of the world look at.
    fn of(index: usize, surface: Surface, rays: &PixelRays, toward_light: DVec3) -> Self {
        let to_index = surface.grid.world_to_index();
        let normals = to_index.matrix3.transpose();
        let largest = normals.to_cols_array().iter().fold(0.0_f64, |m, c| m.max(c.abs()));
        Self {
            index,
            level: surface.level as f32,
            rays: rays.mapped(&to_index),
            to_light: to_index.matrix3 * toward_light,
            normal_to_world: (normals * (1.0 / largest)).as_mat3(),
            gradient_to_world: normals.as_mat3(),
            surface,
        }
    }
}

/// A scene worked out for one picture.
#[derive(Debug)]
pub(crate) struct Frame {
    pub layers: Vec<FrameLayer>,
    /// The pixel rays in the world, s = 0 at the eye.
    pub world_rays: PixelRays,
    /// The same, with s = 0 at the base plane.
    pub based_rays: PixelRays,
    /// Depth of the base plane before the eye: just before the nearest box, so that s stays small where surfaces are.
    pub base_mm: f64,
    /// Unit, in the world.
    pub toward_light: Vec3,
    /// How far before a surface its shadow rays begin, mm.
    pub shadow_start_mm: f64,
    /// Linear and premultiplied.
    pub background: Vec4,
    /// Whether hits are found by the solver that the scene names.
    pub has_solver: bool,
    /// The nearest hit is drawn over the next one's.
    pub overlays: bool,
    /// Only the nearest hit of all layers is drawn.
    pub only_nearest: bool,
    /// What the depth cue takes from a colour for each mm of depth behind the base plane.
    pub cue_per_mm: f32,
    /// Length of a step of direct volume rendering.
    pub step_mm: f32,
    /// So deep behind a cut its own normal shades: the finest spacing.
    pub skin_mm: f32,
}

/// How far a scene reaches before the eye.
///
/// ```text
///   eye ─────────── base plane ┆┌───────── boxes ─────────┐
///    │◄── base_mm ───►│◄margin─►┆◄───────────────────────►│
///                     s = 0                        s = depth_mm
/// ```
struct Reach {
    /// Of the base plane.
    base_mm: f64,
    /// From there to the farthest corner.
    depth_mm: f64,
    /// From the base plane to the nearest corner, by more than rounding, so that a box is entered through its face and not at the base plane.
    margin_mm: f64,
    /// The finest spacing; none where nothing is seen.
    finest_mm: Option<f64>,
}

impl Reach {
    fn of(scene: &Scene, surfaces: &[(usize, Surface)]) -> Self {
        let forward = scene.camera.basis().forward;
        let depths = surfaces.iter().flat_map(|(_, s)| s.grid.corners_mm()).map(|c| (c - scene.camera.eye_mm).dot(forward));
        let (near, far) = depths.fold((f64::INFINITY, 0.0_f64), |(near, far), d| (near.min(d), far.max(d)));
        let margin_mm = 1e-3 * (far - near);
        let base_mm = if near.is_finite() { (near - margin_mm).max(0.0) } else { 0.0 };
        let finest_mm = surfaces.iter().map(|(_, s)| s.grid.spacing_mm().min_element()).fold(f64::INFINITY, f64::min);
        Self { base_mm, depth_mm: far - base_mm, margin_mm, finest_mm: Some(finest_mm).filter(|mm| mm.is_finite()) }
    }

    /// The length of a step of direct volume rendering.
    fn step_mm(&self, scene: &Scene) -> f64 {
        let per_voxel = if let Integrator::Steps { per_voxel, .. } = scene.integrator { f64::from(per_voxel) } else { 1.0 };
        // Float32 counts no farther than 2^24.
        let least_mm = (self.depth_mm / MOST_STEPS).max(f64::MIN_POSITIVE);
        self.finest_mm.filter(|_| per_voxel > 0.0).map_or(1.0, |finest_mm| (finest_mm / per_voxel).max(least_mm))
    }
}

impl Frame {
    pub fn new(maps: &mut MapCache, volumes: &[Arc<Volume>], scene: &Scene, width: u32, height: u32) -> Result<Self, RenderError> {
        if width == 0 || height == 0 {
            return Err(RenderError::NoPixels { width, height });
        }
        scene.check()?;
        let surfaces = scene.hulls(volumes)?;
        let reach = Reach::of(scene, &surfaces);
        // The same for all volumes, so that their faces can be compared.
        let window =
            scene.window.or_else(|| surfaces.first().map(|(_, s)| default_window(&s.volume))).unwrap_or(Window::between([0.0, 1.0]));
        let surfaces = if scene.draws_spline() { splines(maps, surfaces)? } else { surfaces };
        maps.keep_only(&surfaces, if scene.draws_spline() { volumes } else { &[] });
        let mut frame = Self::without_layers(scene, &reach, [width, height]);
        let depths = [reach.base_mm, reach.depth_mm + reach.margin_mm];
        let layer = |(index, surface): (usize, Surface)| {
            let appearance = Appearance::of(scene, index, &surface, &volumes[index], frame.step_mm, window);
            let skip = Skip::of(maps, scene, &surface, frame.has_solver && appearance.shows_faces, depths, [width, height]);
            FrameLayer { placement: Placement::of(index, surface, &frame.based_rays, scene.toward_light()), skip, appearance }
        };
        frame.layers = surfaces.into_iter().map(layer).collect();
        Ok(frame)
    }

    fn without_layers(scene: &Scene, reach: &Reach, [width, height]: [u32; 2]) -> Self {
        let world_rays = scene.camera.pixel_rays(width, height);
        let depth_mm = reach.depth_mm;
        let cue_per_mm = if depth_mm > 0.0 { f64::from(scene.depth_cue.clamp(0.0, 1.0)) / depth_mm } else { 0.0 };
        Self {
            layers: vec![],
            world_rays,
            based_rays: world_rays.rebased(reach.base_mm),
            base_mm: reach.base_mm,
            toward_light: scene.toward_light().as_vec3(),
            shadow_start_mm: reach.finest_mm.map_or(0.0, |mm| SHADOW_START_VOXEL * mm),
            background: scene.background.map_or(Vec4::ZERO, |c| c.linear().extend(1.0)),
            has_solver: scene.mode.uses(Setting::Solver),
            overlays: scene.mode.gather() == Gather::FirstOfEach,
            only_nearest: scene.mode.gather() == Gather::Nearest,
            cue_per_mm: cue_per_mm as f32,
            step_mm: reach.step_mm(scene) as f32,
            skin_mm: reach.finest_mm.map_or(0.0, |mm| mm as f32),
        }
    }

    /// Distance along the unit ray of pixel (x, y) of the depth `s` behind the base plane.
    #[cfg(feature = "gpu")]
    pub fn depth_mm(&self, x: u32, y: u32, s: f32) -> f32 {
        ((self.base_mm + f64::from(s)) * self.world_rays.direction.at(x, y).length()) as f32
    }
}

/// Surfaces of splines: from here on each is one of its coefficients.
fn splines(maps: &mut MapCache, surfaces: Vec<(usize, Surface)>) -> Result<Vec<(usize, Surface)>, RenderError> {
    for (_, Surface { volume, .. }) in &surfaces {
        let largest = volume.histogram().range.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        if largest > spline::MOST_SAMPLE {
            return Err(RenderError::NoSpline { name: volume.name().to_owned(), largest });
        }
    }
    let of_spline = |(index, surface): (usize, Surface)| (index, Surface { volume: maps.spline(&surface.volume), ..surface });
    Ok(surfaces.into_iter().map(of_spline).collect())
}

/// Steps of direct volume rendering along a ray, at most.
const MOST_STEPS: f64 = 4_194_304.0;

/// Hospital scans open at a bone window; others at all they hold.
fn default_window(volume: &Volume) -> Window {
    if volume.unit() == Unit::Hounsfield { Window { width: 1000.0, level: 400.0 } } else { Window::between(volume.range()) }
}
