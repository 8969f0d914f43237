//! What both renderers work out for a picture before its first ray.

use crate::camera::PixelRays;
use crate::cell_masks::CellMasks;
use crate::light_spans::LightSpans;
use crate::modes::{Gather, Setting};
use crate::occupancy::DistanceMap;
use crate::scene::{Color, CutFace, Integrator, Layer, Scene, Shell, Window};
use crate::spans::Spans;
use crate::transfer::{TransferFunction, classify};
use crate::{InstructionSet, RenderError};
use bregma_field::{AnyBlock, RangeBricks, Samples, Store, Surface, Unit, Volume, spline};
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
    /// Gradients in index space to the world, in sample units per mm.
    pub gradient_to_world: Mat3,
    /// Linear colour.
    pub color: Vec3,
    pub opacity: f32,
    /// Change in index space per mm toward the light.
    pub to_light: DVec3,
    /// Where it can cast shadows from; of nothing in a scene without.
    pub light_spans: LightSpans,
    /// Where something changes as values grow: its isovalues, or its transfer function's points; ascending, relative to `level` and
    /// positive inside. None where the mode takes only one surface, or a projection.
    pub levels: Vec<f32>,
    /// For each level the linear colour, and the opacity of an isosurface or a transfer function's extinction per mm.
    pub paints: Vec<Vec4>,
    /// Linear colour of surfaces seen from within.
    pub inner: Option<Vec3>,
    /// For direct volume rendering in steps.
    pub steps: StepTable,
    /// The factor of opacities at magnitudes of the gradient, in sample units per mm; empty where there is none.
    pub gradient_factors: Vec<[f32; 2]>,
    /// Whether cuts show its values where there is no bone, too.
    pub shows_faces: bool,
    /// Whether more is asked of the interpolant along a ray than its values at some points.
    pub needs_cubic: bool,
    /// What turns a value relative to the level into a brightness, by the window: a factor, and what is added.
    pub brightness: [f32; 2],
    /// Linear colours of brightnesses from 0 to 1, where cuts show the transfer function: [`FACE_COLORS`]; else none.
    pub face_colors: Vec<Vec4>,
    /// The value of air, which an X-ray does not show.
    pub air: f64,
    /// What a sample unit is in values, and the value at `level`; what is relative to the level grows with the value.
    pub value_scale: f64,
    pub value_at_level: f64,
}

/// Linear colours, and opacities of a step, for evenly spaced values.
#[derive(Debug, Default)]
pub(crate) struct StepTable {
    /// From the level on.
    pub entries: Vec<Vec4>,
    /// Entries for a sample unit.
    pub per_unit: f32,
}

/// Entries of a step table: more than a display's brightnesses for each of a hospital scan's values where bone begins.
const STEP_TABLE: usize = 4096;

impl StepTable {
    /// Of control points at `levels` with `paints`, up to a value `highest`, for steps of `step_mm`.
    fn new(levels: &[f32], paints: &[Vec4], highest: f32, step_mm: f32) -> Self {
        let per_unit = (STEP_TABLE - 1) as f32 / highest.max(f32::MIN_POSITIVE);
        let entry = |n: usize| {
            let paint = paint_at(levels, paints, n as f32 / per_unit);
            paint.truncate().extend(-(-paint.w * step_mm).exp_m1())
        };
        Self { entries: (0..STEP_TABLE).map(entry).collect(), per_unit }
    }
}

/// What lies between the paints of the levels around a value.
fn paint_at(levels: &[f32], paints: &[Vec4], value: f32) -> Vec4 {
    let above = levels.partition_point(|l| *l <= value);
    match (above.checked_sub(1), levels.get(above)) {
        (Some(a), Some(b)) => paints[a].lerp(paints[above], (value - levels[a]) / (b - levels[a])),
        (Some(a), None) => paints[a],
        (None, _) => paints.first().copied().unwrap_or_default(),
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
    /// Only the nearest hit of all layers is drawn.
    pub only_nearest: bool,
    /// What the depth cue takes from a colour for each mm of depth behind the base plane.
    pub cue_per_mm: f32,
    /// Length of a step of direct volume rendering.
    pub step_mm: f32,
    /// So deep behind a cut its own normal shades: the finest spacing.
    pub skin_mm: f32,
}

impl Frame {
    pub fn new(maps: &mut MapCache, volumes: &[Arc<Volume>], scene: &Scene, width: u32, height: u32) -> Result<Self, RenderError> {
        if width == 0 || height == 0 {
            return Err(RenderError::NoPixels { width, height });
        }
        scene.check()?;
        let gather = scene.mode.gather();
        let world_rays = scene.camera.pixel_rays(width, height);
        let surfaces = scene.hulls(volumes)?;
        let forward = scene.camera.basis().forward;
        let depths = surfaces.iter().flat_map(|(_, s)| s.grid.corners_mm()).map(|c| (c - scene.camera.eye_mm).dot(forward));
        let (near, far) = depths.fold((f64::INFINITY, 0.0_f64), |(near, far), d| (near.min(d), far.max(d)));
        // Before the nearest corner by more than rounding, so that a box is entered through its face and not at the base plane.
        let margin = 1e-3 * (far - near);
        let base_mm = if near.is_finite() { (near - margin).max(0.0) } else { 0.0 };
        let based = world_rays.rebased(base_mm);
        let toward_light = scene.toward_light();
        let depth_mm = far - base_mm;
        let cue_per_mm = if depth_mm > 0.0 { f64::from(scene.depth_cue.clamp(0.0, 1.0)) / depth_mm } else { 0.0 };
        let finest_mm = surfaces.iter().map(|(_, s)| s.grid.spacing_mm().min_element()).fold(f64::INFINITY, f64::min);
        // The same for all volumes, so that their faces can be compared.
        let window =
            scene.window.or_else(|| surfaces.first().map(|(_, s)| default_window(&s.volume))).unwrap_or(Window::between([0.0, 1.0]));
        let per_voxel = if let Integrator::Steps { per_voxel, .. } = scene.integrator { f64::from(per_voxel) } else { 1.0 };
        // Float32 counts no farther than 2^24.
        let least_mm = (depth_mm / MOST_STEPS).max(f64::MIN_POSITIVE);
        let step_mm = if finest_mm.is_finite() && per_voxel > 0.0 { (finest_mm / per_voxel).max(least_mm) } else { 1.0 };
        // From here on a surface of the spline is one of its coefficients.
        let surfaces: Vec<_> = if scene.draws_spline() {
            for (_, Surface { volume, .. }) in &surfaces {
                let largest = volume.histogram().range.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
                if largest > spline::MOST_SAMPLE {
                    return Err(RenderError::NoSpline { name: volume.name().to_owned(), largest });
                }
            }
            let of_spline = |(index, surface): (usize, Surface)| (index, Surface { volume: maps.spline(&surface.volume), ..surface });
            surfaces.into_iter().map(of_spline).collect()
        } else {
            surfaces
        };
        maps.keep_only(&surfaces, if scene.draws_spline() { volumes } else { &[] });
        let layer = |(index, surface): (usize, Surface)| {
            let to_index = surface.grid.world_to_index();
            let normals = to_index.matrix3.transpose();
            let largest = normals.to_cols_array().iter().fold(0.0_f64, |m, c| m.max(c.abs()));
            let (map, masks) = maps.get(&surface);
            let begins_inside = !surface.region.is_all();
            let shows_faces = begins_inside && scene.cut_face != CutFace::Bone;
            let value_at_level = surface.volume.value_of(f64::from(surface.level as f32));
            let shown = Shown::of(scene, index, &surface, step_mm);
            let slope = surface.volume.slope().abs();
            let by_transfer = shows_faces && scene.cut_face == CutFace::Transfer;
            let window = if by_transfer { Window::between(volumes[index].range()) } else { window };
            // A window without width is a threshold.
            let width_of_window = window.width.max(f64::from(f32::MIN_POSITIVE) * 1e6);
            FrameLayer {
                index,
                level: surface.level as f32,
                spans: if shows_faces && scene.mode.uses(Setting::Solver) {
                    Spans::everywhere(far - base_mm + margin, [width, height])
                } else {
                    Spans::of(&map, &masks, &surface.grid, &scene.camera, base_mm, [width, height], begins_inside)
                },
                levels: shown.levels,
                paints: shown.paints,
                steps: shown.steps,
                gradient_factors: shown.gradient_factors,
                inner: scene.layers[index].inner_color.map(Color::linear),
                shows_faces,
                needs_cubic: scene.integrator == Integrator::Exact || gather == Gather::Crossings,
                face_colors: if by_transfer { face_colors(&scene.layers[index], &volumes[index]) } else { vec![] },
                brightness: [slope / width_of_window, (value_at_level - window.level) / width_of_window + 0.5].map(|v| v as f32),
                air: if surface.volume.unit() == Unit::Hounsfield { AIR_HU } else { surface.volume.range()[0] },
                value_scale: slope,
                value_at_level,
                light_spans: if scene.shadows { LightSpans::of(&map, &masks, &surface.grid, toward_light) } else { LightSpans::default() },
                map,
                masks,
                rays: based.mapped(&to_index),
                gradient_to_world: normals.as_mat3(),
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
            based_rays: based,
            base_mm,
            toward_light: toward_light.as_vec3(),
            shadow_start_mm: if finest_mm.is_finite() { SHADOW_START_VOXEL * finest_mm } else { 0.0 },
            background: scene.background.map_or(Vec4::ZERO, |c| c.linear().extend(1.0)),
            only_nearest: gather == Gather::Nearest,
            cue_per_mm: cue_per_mm as f32,
            step_mm: step_mm as f32,
            skin_mm: if finest_mm.is_finite() { finest_mm as f32 } else { 0.0 },
        })
    }
}

/// Entries of a layer's colours of faces: one for each value of a hospital scan, so that no point of a transfer function is blurred.
pub(crate) const FACE_COLORS: usize = 4096;

/// The colours of a layer's transfer function over its volume's range, on black.
fn face_colors(layer: &Layer, volume: &Volume) -> Vec<Vec4> {
    let (controls, [low, high]) = (layer.controls(volume), volume.range());
    let over_mm = layer.transfer.as_ref().unwrap_or(&TransferFunction::bone()).thickness_mm(volume) as f32;
    let color = |n: usize| {
        let paint = classify(&controls, low + (high - low) * n as f64 / (FACE_COLORS - 1) as f64);
        (paint.truncate() * -(-paint.w * over_mm).exp_m1()).extend(1.0)
    };
    (0..FACE_COLORS).map(color).collect()
}

/// By the definition of the unit.
const AIR_HU: f64 = -1000.0;

/// Steps of direct volume rendering along a ray, at most.
const MOST_STEPS: f64 = 4_194_304.0;

/// Hospital scans open at a bone window; others at all they hold.
fn default_window(volume: &Volume) -> Window {
    if volume.unit() == Unit::Hounsfield { Window { width: 1000.0, level: 400.0 } } else { Window::between(volume.range()) }
}

/// How a mode that goes on behind the first surface shows a layer.
#[derive(Default)]
struct Shown {
    levels: Vec<f32>,
    paints: Vec<Vec4>,
    steps: StepTable,
    gradient_factors: Vec<[f32; 2]>,
}

impl Shown {
    fn of(scene: &Scene, index: usize, surface: &Surface, step_mm: f64) -> Self {
        let (layer, volume) = (&scene.layers[index], &surface.volume);
        // Against the level as the rays know it.
        let relative = |value: f64| (f64::from(surface.sign) * (volume.sample_of(value) - f64::from(surface.level as f32))) as f32;
        let gather = scene.mode.gather();
        if gather == Gather::Crossings {
            let main = Shell { iso: layer.iso, color: layer.color, opacity: layer.opacity };
            let mut shells: Vec<Shell> = layer.shells.iter().copied().chain([main]).collect();
            shells.sort_by(|a, b| a.iso.total_cmp(&b.iso));
            let paint = |s: &Shell| s.color.linear().extend(s.opacity.clamp(0.0, 1.0));
            Self { levels: shells.iter().map(|s| relative(s.iso)).collect(), paints: shells.iter().map(paint).collect(), ..Self::default() }
        } else if gather == Gather::Density {
            let controls = layer.controls(volume);
            let levels: Vec<f32> = controls.iter().map(|c| relative(c.value)).collect();
            let paints: Vec<Vec4> = controls.iter().map(|c| c.color.extend(c.extinction_per_mm as f32)).collect();
            // Behind the last point nothing changes.
            let highest = levels.last().copied().unwrap_or(0.0).max(0.0);
            let steps = StepTable::new(&levels, &paints, highest, step_mm as f32);
            let per_sample = 1.0 / volume.slope().abs();
            let gradient = layer.transfer.iter().flat_map(|t| &t.gradient);
            let gradient_factors = gradient.map(|g| [(g.per_mm * per_sample) as f32, g.factor as f32]).collect();
            Self { levels, paints, steps, gradient_factors }
        } else {
            Self::default()
        }
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
    /// Of the volumes that are drawn as splines the coefficients.
    splines: Vec<(Arc<Volume>, Arc<Volume>)>,
}

type Maps = (Arc<DistanceMap>, Arc<CellMasks>);

impl MapCache {
    pub fn new(instructions: InstructionSet) -> Self {
        Self { instructions, known: vec![], splines: vec![] }
    }

    /// The coefficients of the spline through a volume's samples.
    fn spline(&mut self, volume: &Arc<Volume>) -> Arc<Volume> {
        if let Some((_, known)) = self.splines.iter().find(|(of, _)| Arc::ptr_eq(of, volume)) {
            return Arc::clone(known);
        }
        let coefficients = Arc::new(spline::coefficients(volume));
        self.splines.push((Arc::clone(volume), Arc::clone(&coefficients)));
        coefficients
    }

    fn get(&mut self, surface: &Surface) -> Maps {
        let known = self.known.iter().find(|(v, level, _)| is_of(surface, v, *level));
        if let Some((.., maps)) = known {
            return maps.clone();
        }
        let (volume, level, sign) = (&surface.volume, surface.level as f32, surface.sign);
        let dims = volume.grid().dims();
        let of = |bricks: &RangeBricks, store: Store<'_>| {
            let map = DistanceMap::build(bricks, level, sign);
            let masks = CellMasks::build(self.instructions, store, &map, level, sign);
            (Arc::new(map), Arc::new(masks))
        };
        let store = Store::of(volume);
        let maps = match store.whole() {
            // A spline reaches beyond the corners of its cells.
            AnyBlock::F32(coefficients) if self.splines.iter().any(|(_, spline)| Arc::ptr_eq(spline, volume)) => {
                let hull = spline::hull(coefficients.onward([0; 3]), dims, sign);
                of(&RangeBricks::build(&hull, dims), Store::new(&Samples::F32(hull), dims))
            }
            _ => of(volume.bricks(), store),
        };
        self.known.push((Arc::clone(volume), surface.level, maps.clone()));
        maps
    }

    /// Memory that they take.
    pub fn bytes(&self) -> usize {
        let maps = self.known.iter().map(|(.., (map, masks))| map.bytes() + masks.bytes());
        let splines = self.splines.iter().map(|(_, spline)| spline.sample_bytes() + spline.index_bytes());
        maps.sum::<usize>() + splines.sum::<usize>()
    }

    /// Forgets all but what is known of some surfaces, and of splines through some volumes, which others may draw by turns.
    fn keep_only(&mut self, surfaces: &[(usize, Surface)], splines: &[Arc<Volume>]) {
        self.splines.retain(|(of, _)| splines.iter().any(|volume| Arc::ptr_eq(of, volume)));
        let is_spline = |volume: &Arc<Volume>| self.splines.iter().any(|(_, spline)| Arc::ptr_eq(spline, volume));
        let is_drawn = |volume: &Arc<Volume>, level| surfaces.iter().any(|(_, s)| is_of(s, volume, level));
        let has_newer = |volume: &Arc<Volume>| surfaces.iter().any(|(_, s)| Arc::ptr_eq(&s.volume, volume));
        self.known.retain(|(v, level, _)| is_drawn(v, *level) || is_spline(v) && !has_newer(v));
    }
}

fn is_of(surface: &Surface, volume: &Arc<Volume>, level: f64) -> bool {
    Arc::ptr_eq(&surface.volume, volume) && surface.level == level
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::{Mode, Named};
    use bregma_field::{Bounds, IndexPoint, Progress};
    use bregma_synthetic::{Random, Which, skull};
    use glam::DAffine3;

    fn frames(count: u64, mut check: impl FnMut(&mut Random, &[Arc<Volume>], &Scene, &Frame)) {
        let volumes = [Which::A, Which::B].map(|which| Arc::new(skull(which, 10, &Progress::default()).unwrap()));
        let mut maps = MapCache::new(InstructionSet::new());
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
            let frame = Frame::new(&mut maps, &volumes, &scene, 24, 16).unwrap();
            check(&mut r, &volumes, &scene, &frame);
        }
    }

    #[test]
    fn the_base_plane_lies_before_all_boxes_and_rays_are_the_same_in_every_space() {
        // Fails if a corner of a box lies before the base plane, or a layer's rays are not those of the picture in its index space.
        frames(40, |r, _, scene, frame| {
            let forward = scene.camera.basis().forward;
            for layer in &frame.layers {
                let depths = layer.surface.grid.corners_mm().map(|c| (c - scene.camera.eye_mm).dot(forward));
                assert!(frame.base_mm == 0.0 || depths.iter().all(|d| *d > frame.base_mm), "{} is behind one of {depths:?}", frame.base_mm);
                let (x, y, s) = ((24.0 * r.unit()) as u32, (16.0 * r.unit()) as u32, 300.0 * r.unit());
                let at = |rays: &PixelRays, s: f64| rays.origin.at(x, y) + s * rays.direction.at(x, y);
                let there = layer.surface.grid.world(IndexPoint(at(&layer.rays, s))).0;
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
                assert!(layer.levels.is_sorted() && layer.levels.len() == layer.paints.len(), "{:?}: {:?}", scene.mode, layer.levels);
                for n in (0..20).map(|_| (layer.steps.entries.len() as f64 * r.unit()) as usize).filter(|_| !layer.steps.entries.is_empty())
                {
                    let (entry, value) = (layer.steps.entries[n], n as f32 / layer.steps.per_unit);
                    let paint = paint_at(&layer.levels, &layer.paints, value);
                    let opacity = 1.0 - f64::exp(-f64::from(paint.w) * f64::from(frame.step_mm));
                    assert!((f64::from(entry.w) - opacity).abs() < 1e-6 && entry.truncate() == paint.truncate(), "{entry} at {value}");
                }
                for (level, paint) in layer.levels.iter().zip(&layer.paints).filter(|_| layer.levels.is_sorted_by(|a, b| a < b)) {
                    assert!((paint_at(&layer.levels, &layer.paints, *level) - *paint).length() < 1e-6);
                }
            }
        });
    }

    #[test]
    fn maps_are_made_once_for_a_surface_and_forgotten_with_it() {
        // Fails if a picture makes again what is known, or what is drawn no more stays in memory.
        let volumes = [Arc::new(skull(Which::A, 10, &Progress::default()).unwrap())];
        let (mut maps, mut scene) = (MapCache::new(InstructionSet::new()), Scene::of(&volumes));
        let mut draw = |scene: &Scene| {
            let frame = Frame::new(&mut maps, &volumes, scene, 8, 8).unwrap();
            (Arc::clone(&frame.layers[0].map), maps.known.len())
        };
        let (first, _) = draw(&scene);
        assert!(Arc::ptr_eq(&first, &draw(&scene).0));
        scene.layers[0].iso += 100.0;
        let (second, known) = draw(&scene);
        assert!(!Arc::ptr_eq(&first, &second) && known == 1);
    }
}
