//! What both renderers work out for a picture before its first ray.

use crate::RenderError;
use crate::appearance::Appearance;
use crate::camera::{PixelRays, Raster, point_in_pixel};
use crate::modes::{Gather, Setting};
use crate::roots::Method;
use crate::scene::{Integrator, Scene, Window};
use crate::skip::{MapCache, Skip};
use crate::slice::nodes_per_pixel;
use bregma_field::{Surface, Volume, spline};
use glam::{DVec3, Mat3, Vec3, Vec4};
use std::sync::Arc;

/// Shadow rays begin so far toward the light from where the pixel's ray hit: a hundred times farther than float32 is off there, so that no
/// surface casts a shadow on itself at its own hit; and far below what a pixel shows.
pub const SHADOW_START_VOXEL: f64 = 0.01;

/// Where two surfaces count as one, neither casts a shadow on the other: shadow rays begin beyond both, also where the light comes in at 30°.
pub const SHADOW_START_AGREEMENTS: f64 = 2.0;

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
    /// How far behind the face of its solid normals are blended, in the solid's units.
    pub rim_units: f32,
}

impl Placement {
    /// Of layer `index`, which `rays` of the world look at.
    fn of(index: usize, surface: Surface, rays: &PixelRays, toward_light: DVec3, rim_mm: f64) -> Self {
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
            rim_units: surface.solid.as_ref().map_or(0.0, |solid| (rim_mm / solid.unit_mm()) as f32),
            surface,
        }
    }
}

/// A scene worked out for one picture.
#[derive(Debug)]
pub(crate) struct Frame {
    pub layers: Vec<FrameLayer>,
    /// Rays along the side of a pixel: more than one where a slice's pixel is larger than a voxel.
    pub nodes_per_pixel: u32,
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
    /// How surfaces are found within cells; asked for by every packet of rays.
    pub method: Method,
    /// Whether hits are found by the solver that the scene names.
    pub has_solver: bool,
    /// The nearest hit is drawn over the next one's.
    pub overlays: bool,
    /// But where the two are no farther from each other they are one.
    pub agreement_mm: f32,
    /// Instead, the nearest hit is in a colour for how far behind it the next one lies: up to so many mm; 0 where it is not.
    pub depth_range_mm: f32,
    /// Only the nearest hit of all layers is drawn.
    pub only_nearest: bool,
    /// What the depth cue takes from a colour for each mm of depth behind the base plane.
    pub cue_per_mm: f32,
    /// Length of a step of direct volume rendering.
    pub step_mm: f32,
    /// What is added to a pixel's own part of its first step, turned round at 1; −1 where first steps begin in their middle.
    pub jitter: f32,
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
        let finest_mm = surfaces.iter().map(|(_, s)| s.grid.spacing_mm().min_element()).fold(f64::INFINITY, f64::min);
        let finest_mm = Some(finest_mm).filter(|mm| mm.is_finite());
        if scene.is_slice() {
            // From the slice's near side to its far one.
            let depth_mm = scene.slice.thickness_mm;
            let base_mm = (scene.camera.target_mm - scene.camera.eye_mm).dot(forward) - depth_mm / 2.0;
            return Self { base_mm, depth_mm, margin_mm: 0.0, finest_mm };
        }
        let depths = surfaces.iter().flat_map(|(_, s)| s.grid.corners_mm()).map(|c| (c - scene.camera.eye_mm).dot(forward));
        let (near, far) = depths.fold((f64::INFINITY, 0.0_f64), |(near, far), d| (near.min(d), far.max(d)));
        let margin_mm = 1e-3 * (far - near);
        let base_mm = if near.is_finite() { (near - margin_mm).max(0.0) } else { 0.0 };
        Self { base_mm, depth_mm: far - base_mm, margin_mm, finest_mm }
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
    /// Of a picture of `width`×`height` pixels through point number `sample` of each.
    pub fn new(
        maps: &mut MapCache,
        volumes: &[Arc<Volume>],
        scene: &Scene,
        [width, height]: [u32; 2],
        sample: u32,
    ) -> Result<Self, RenderError> {
        if width == 0 || height == 0 {
            return Err(RenderError::NoPixels { width, height });
        }
        scene.check()?;
        scene.check_parts()?;
        let surfaces = scene.hulls(volumes)?;
        let reach = Reach::of(scene, &surfaces);
        // The same for all volumes, so that their faces can be compared.
        let chosen = if scene.is_slice() { scene.slice.window } else { scene.window };
        let window = chosen.or_else(|| surfaces.first().map(|(_, s)| Window::of(&s.volume))).unwrap_or(Window::between([0.0, 1.0]));
        let agreement_mm = if scene.mode.uses(Setting::Agreement) && surfaces.len() > 1 { scene.agreement_mm(volumes) } else { 0.0 };
        let depth_range_mm = if scene.tells_depths() { scene.depth_range_mm(volumes) as f32 } else { 0.0 };
        let surfaces = if scene.draws_spline() { splines(maps, surfaces)? } else { surfaces };
        maps.keep_only(&surfaces, if scene.draws_spline() { volumes } else { &[] });
        let nodes = if scene.is_slice() { nodes_per_pixel(scene, &surfaces, [width, height]) } else { 1 };
        // A slice has the values at its nodes.
        let point_px = if scene.is_slice() { [0.0; 2] } else { point_in_pixel(sample) };
        let raster = Raster { size: [width, height].map(|n| n * nodes), point_px };
        let base = Self::without_layers(scene, &reach, raster, sample);
        let shadow_start_mm = base.shadow_start_mm.max(SHADOW_START_AGREEMENTS * agreement_mm);
        let mut frame = Self { nodes_per_pixel: nodes, agreement_mm: agreement_mm as f32, depth_range_mm, shadow_start_mm, ..base };
        let depths = [reach.base_mm, reach.depth_mm + reach.margin_mm];
        let layer = |(index, surface): (usize, Surface)| {
            let appearance = Appearance::of(scene, index, &surface, &volumes[index], frame.step_mm, window);
            let sees_everywhere = frame.has_solver && appearance.shows_faces || scene.is_slice();
            let skip = Skip::of(maps, scene, (&surface, &appearance.levels), sees_everywhere, depths, raster);
            FrameLayer {
                placement: Placement::of(index, surface, &frame.based_rays, scene.toward_light(), scene.layers[index].rim_mm()),
                skip,
                appearance,
            }
        };
        frame.layers = surfaces.into_iter().map(layer).collect();
        Ok(frame)
    }

    fn without_layers(scene: &Scene, reach: &Reach, raster: Raster, sample: u32) -> Self {
        let [width, height] = raster.size;
        let world_rays = scene.viewed_from().pixel_rays(width, height).through(raster.point_px);
        let depth_mm = reach.depth_mm;
        let cue_per_mm = if depth_mm > 0.0 { f64::from(scene.depth_cue.clamp(0.0, 1.0)) / depth_mm } else { 0.0 };
        Self {
            layers: vec![],
            nodes_per_pixel: 1,
            world_rays,
            based_rays: world_rays.rebased(reach.base_mm),
            base_mm: reach.base_mm,
            toward_light: scene.toward_light().as_vec3(),
            shadow_start_mm: reach.finest_mm.map_or(0.0, |mm| SHADOW_START_VOXEL * mm),
            background: scene.background.map_or(Vec4::ZERO, |c| c.linear().extend(1.0)),
            method: scene.method(),
            has_solver: scene.mode.uses(Setting::Solver),
            overlays: scene.mode.gather() == Gather::FirstOfEach,
            agreement_mm: 0.0,
            depth_range_mm: 0.0,
            only_nearest: scene.mode.gather() == Gather::Nearest,
            cue_per_mm: cue_per_mm as f32,
            step_mm: reach.step_mm(scene) as f32,
            jitter: jitter(scene.integrator, sample),
            skin_mm: reach.finest_mm.map_or(0.0, |mm| mm as f32),
        }
    }

    /// Distance along the unit ray of pixel (x, y) of the depth `s` behind the base plane.
    #[cfg(feature = "gpu")]
    pub fn depth_mm(&self, x: u32, y: u32, s: f32) -> f32 {
        ((self.base_mm + f64::from(s)) * self.world_rays.direction.at(x, y).length()) as f32
    }
}

/// [`Frame::jitter`]: the golden ratio's multiples lie evenly, however many there are.
fn jitter(integrator: Integrator, sample: u32) -> f32 {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    match integrator {
        Integrator::Steps { jitter: true, .. } => (f64::from(sample) * GOLDEN).fract() as f32,
        Integrator::Steps { jitter: false, .. } | Integrator::Exact => -1.0,
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::appearance::paint_at;
    use crate::camera::Camera;
    use crate::{Mode, Named};
    use bregma_field::{Bounds, IndexPoint, Progress};
    use bregma_synthetic::{Random, Which, skull};
    use glam::DAffine3;

    fn frames(count: u64, mut check: impl FnMut(&mut Random, &[Arc<Volume>], &Scene, &Frame)) {
        let volumes = [Which::A, Which::B].map(|which| Arc::new(skull(which, 10, &Progress::default()).unwrap()));
        let mut maps = MapCache::new(crate::InstructionSet::new());
        for seed in 0..count {
            let mut r = Random(seed);
            // The first numbers of neighbouring seeds are alike.
            r.unit();
            let mut scene = Scene::of(&volumes);
            let mut vector = |size: f64| DVec3::from_array(std::array::from_fn(|_| size * (2.0 * r.unit() - 1.0)));
            let bounds = Bounds::of(volumes.iter().map(|v| v.grid()));
            scene.camera = Camera { eye_mm: vector(400.0), target_mm: vector(50.0), ..Camera::orbit(&bounds, 0.0, 0.0) };
            scene.layers[1].transform = DAffine3::from_axis_angle(vector(1.0).normalize(), 0.3);
            scene.mode = Mode::ALL[seed as usize % Mode::ALL.len()];
            let frame = Frame::new(&mut maps, &volumes, &scene, [24, 16], seed as u32 % 3).unwrap();
            check(&mut r, &volumes, &scene, &frame);
        }
    }

    #[test]
    fn the_base_plane_lies_before_all_boxes_and_rays_are_the_same_in_every_space() {
        // Fails if a corner of a box lies before the base plane, or a layer's rays are not those of the picture in its index space.
        frames(40, |r, _, scene, frame| {
            let forward = scene.camera.basis().forward;
            for layer in &frame.layers {
                let depths = layer.placement.surface.grid.corners_mm().map(|c| (c - scene.camera.eye_mm).dot(forward));
                // That of a slice lies in the middle of the boxes.
                let is_before = scene.is_slice() || frame.base_mm == 0.0 || depths.iter().all(|d| *d > frame.base_mm);
                assert!(is_before, "{} is behind one of {depths:?}", frame.base_mm);
                let (x, y, s) = ((24.0 * r.unit()) as u32, (16.0 * r.unit()) as u32, 300.0 * r.unit());
                let at = |rays: &PixelRays, s: f64| rays.origin.at(x, y) + s * rays.direction.at(x, y);
                let there = layer.placement.surface.grid.world(IndexPoint(at(&layer.placement.rays, s))).0;
                assert!((there - at(&frame.world_rays, frame.base_mm + s)).length() < 1e-8);
                assert!((there - at(&frame.based_rays, s)).length() < 1e-8);
            }
        });
    }

    #[test]
    fn levels_ascend_with_a_paint_each_and_steps_are_as_opaque_as_their_paints() {
        // Fails if levels and paints are told apart, a level is out of order, or a step's opacity is not that of its length.
        frames(42, |r, _, scene, frame| {
            for layer in &frame.layers {
                assert!(
                    layer.appearance.levels.is_sorted() && layer.appearance.levels.len() == layer.appearance.paints.len(),
                    "{:?}: {:?}",
                    scene.mode,
                    layer.appearance.levels
                );
                for n in (0..20)
                    .map(|_| (layer.appearance.steps.entries.len() as f64 * r.unit()) as usize)
                    .filter(|_| !layer.appearance.steps.entries.is_empty())
                {
                    let (entry, value) = (layer.appearance.steps.entries[n], n as f32 / layer.appearance.steps.per_unit);
                    let paint = paint_at(&layer.appearance.levels, &layer.appearance.paints, value);
                    let opacity = 1.0 - f64::exp(-f64::from(paint.w) * f64::from(frame.step_mm));
                    assert!((f64::from(entry.w) - opacity).abs() < 1e-6 && entry.truncate() == paint.truncate(), "{entry} at {value}");
                }
                let (levels, paints) = (&layer.appearance.levels, &layer.appearance.paints);
                for (level, paint) in levels.iter().zip(paints).filter(|_| levels.is_sorted_by(|a, b| a < b)) {
                    assert!((paint_at(levels, paints, *level) - *paint).length() < 1e-6);
                }
            }
        });
    }

    #[test]
    fn maps_are_made_once_for_a_surface_and_forgotten_with_it() {
        // Fails if a picture makes again what is known, or what is drawn no more stays in memory.
        let volumes = [Arc::new(skull(Which::A, 10, &Progress::default()).unwrap())];
        let (mut maps, mut scene) = (MapCache::new(crate::InstructionSet::new()), Scene::of(&volumes));
        let mut draw = |scene: &Scene| {
            let frame = Frame::new(&mut maps, &volumes, scene, [8, 8], 0).unwrap();
            Arc::clone(&frame.layers[0].skip.map)
        };
        let first = draw(&scene);
        assert!(Arc::ptr_eq(&first, &draw(&scene)));
        scene.layers[0].iso += 100.0;
        assert!(!Arc::ptr_eq(&first, &draw(&scene)) && Arc::strong_count(&first) == 1);
    }
}
