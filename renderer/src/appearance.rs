//! What a layer of a picture looks like.

use crate::color::Color;
use crate::layer::{Layer, Shell};
use crate::modes::Gather;
use crate::scene::{CutFace, Integrator, Scene, Window};
use crate::transfer::classify;
use bregma_field::{Surface, Unit, Volume};
use glam::{Vec3, Vec4};

/// What a layer looks like.
#[derive(Debug)]
pub(crate) struct Appearance {
    /// Where something changes as values grow: its isovalues, or its transfer function's points; ascending, relative to `level` and
    /// positive inside. None where the mode takes only one surface, or a projection of all values; of a range its ends.
    pub levels: Vec<f32>,
    /// For each level the linear colour, and the opacity of an isosurface or a transfer function's extinction per mm.
    pub paints: Vec<Vec4>,
    /// For direct volume rendering in steps.
    pub steps: StepTable,
    /// The factor of opacities at magnitudes of the gradient, in sample units per mm; empty where there is none.
    pub gradient_factors: Vec<[f32; 2]>,
    /// Linear colours of brightnesses from 0 to 1, where cuts show the transfer function: [`FACE_COLORS`]; else none.
    pub face_colors: Vec<Vec4>,
    /// What turns a value relative to the level into a brightness, by the window: a factor, and what is added.
    pub brightness: [f32; 2],
    /// Whether cuts show its values where there is no bone, too.
    pub shows_faces: bool,
    /// The isovalue, where a slice shows its contour; relative to the level.
    pub contour: f32,
    /// Whether more is asked of the interpolant along a ray than its values at some points.
    pub needs_cubic: bool,
    /// Linear colour of surfaces seen from within.
    pub inner: Option<Vec3>,
    /// Linear colour.
    pub color: Vec3,
    pub opacity: f32,
    /// The value of air, which an X-ray does not show.
    pub air: f64,
    /// What a sample unit is in values, and the value at `level`; what is relative to the level grows with the value.
    pub value_scale: f64,
    pub value_at_level: f64,
}

impl Appearance {
    /// Of layer `index`, whose own volume is `volume`, with steps of `step_mm` and a window for cuts.
    pub fn of(scene: &Scene, index: usize, surface: &Surface, volume: &Volume, step_mm: f32, window: Window) -> Self {
        let layer = &scene.layers[index];
        let is_slice = scene.is_slice();
        let shows_faces = !is_slice && !surface.region.is_all() && scene.cut_face != CutFace::Bone;
        let by_transfer = (is_slice || shows_faces) && scene.face() == CutFace::Transfer;
        let window = if by_transfer { Window::between(volume.range()) } else { window };
        // A window without width is a threshold.
        let width_of_window = window.width.max(f64::from(f32::MIN_POSITIVE) * 1e6);
        let slope = surface.volume.slope().abs();
        let value_at_level = surface.volume.value_of(f64::from(surface.level as f32));
        let Shown { levels, paints, steps, gradient_factors } = Shown::of(scene, index, surface, step_mm);
        Self {
            levels,
            paints,
            steps,
            gradient_factors,
            face_colors: if by_transfer { face_colors(layer, volume) } else { vec![] },
            brightness: [slope / width_of_window, (value_at_level - window.level) / width_of_window + 0.5].map(|v| v as f32),
            shows_faces,
            contour: relative(surface, surface.volume.sample_of(layer.iso)),
            needs_cubic: scene.integrator == Integrator::Exact || scene.mode.gather() == Gather::Crossings,
            inner: layer.inner_color.map(Color::linear),
            color: layer.color.linear(),
            opacity: layer.opacity.clamp(0.0, 1.0),
            air: if surface.volume.unit() == Unit::Hounsfield { AIR_HU } else { surface.volume.range()[0] },
            value_scale: slope,
            value_at_level,
        }
    }
}

/// By the definition of the unit.
const AIR_HU: f64 = -1000.0;

/// A sample against the level as the rays know it, positive inside.
fn relative(surface: &Surface, sample: f64) -> f32 {
    (f64::from(surface.sign) * (sample - f64::from(surface.level as f32))) as f32
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
    fn of(scene: &Scene, index: usize, surface: &Surface, step_mm: f32) -> Self {
        let (layer, volume) = (&scene.layers[index], &surface.volume);
        let relative = |value: f64| relative(surface, volume.sample_of(value));
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
            let steps = StepTable::new(&levels, &paints, highest, step_mm);
            let per_sample = 1.0 / volume.slope().abs();
            let gradient = layer.transfer.iter().flat_map(|t| &t.gradient);
            let gradient_factors = gradient.map(|g| [(g.per_mm * per_sample) as f32, g.factor as f32]).collect();
            Self { levels, paints, steps, gradient_factors }
        } else if let (Gather::Number(_), Some(range)) = (gather, scene.value_range) {
            Self { levels: range.map(relative).to_vec(), paints: vec![Vec4::ZERO; 2], ..Self::default() }
        } else {
            Self::default()
        }
    }
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
pub(crate) fn paint_at(levels: &[f32], paints: &[Vec4], value: f32) -> Vec4 {
    let above = levels.partition_point(|l| *l <= value);
    match (above.checked_sub(1), levels.get(above)) {
        (Some(a), Some(b)) => paints[a].lerp(paints[above], (value - levels[a]) / (b - levels[a])),
        (Some(a), None) => paints[a],
        (None, _) => paints.first().copied().unwrap_or_default(),
    }
}

/// Entries of a layer's colours of faces: one for each value of a hospital scan, so that no point of a transfer function is blurred.
pub(crate) const FACE_COLORS: usize = 4096;

/// The colours of a layer's transfer function over its volume's range, on black.
fn face_colors(layer: &Layer, volume: &Volume) -> Vec<Vec4> {
    let (controls, [low, high]) = (layer.controls(volume), volume.range());
    let over_mm = layer.transfer_function().thickness_mm(volume) as f32;
    let color = |n: usize| {
        let paint = classify(&controls, low + (high - low) * n as f64 / (FACE_COLORS - 1) as f64);
        (paint.truncate() * -(-paint.w * over_mm).exp_m1()).extend(1.0)
    };
    (0..FACE_COLORS).map(color).collect()
}
