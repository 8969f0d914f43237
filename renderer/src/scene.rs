//! What is drawn and how: one plain value that the window, the command line, sessions and tests share.

use crate::camera::{Camera, Projection};
use crate::color::Color;
use crate::layer::Layer;
use crate::modes::{Gather, Mode, Setting};
use crate::named;
use crate::roots::{Method, Solver};
use crate::slice::{Slice, WIDEST_CONTOUR_PX};
use crate::studio::Studio;
use crate::transfer::lowest_visible;
use bregma_field::{Bounds, Clip, Surface, SurfaceError, Unit, Volume};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use thiserror::Error;

/// How direct volume rendering integrates along a ray.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Integrator {
    /// At points that lie evenly apart, each as if it were the middle of a layer of one colour and opacity.
    Steps {
        /// Points in a voxel's length, of the finest scan.
        per_voxel: f32,
        /// Whether the first point of each pixel lies somewhere within the first step: noise instead of rings.
        jitter: bool,
    },
    /// Piece by piece between where the interpolant passes the transfer function's points and where it turns, to what float32 resolves
    /// (Weiss and Westermann 2021).
    Exact,
}

/// Points in a voxel's length that can be asked for.
pub const PER_VOXEL: std::ops::RangeInclusive<f32> = 0.01..=1000.0;

impl Default for Integrator {
    fn default() -> Self {
        Self::Steps { per_voxel: 2.0, jitter: true }
    }
}

named! {
    /// Which gradient of the samples stands for the surface's normal where it is shaded.
    #[derive(Default)]
    pub enum Normals {
        /// Central differences at the samples, interpolated between them: no edges between cells (Levoy 1988).
        #[default]
        Smooth = "smooth",
        /// Of the interpolant itself: what the surface has, with an edge at each cell's face.
        Analytic = "analytic",
    }
}

named! {
    /// What lies between the samples, where opaque surfaces are drawn. The spline's crossings are found to 1e-3 voxel; two that lie nearer to
    /// each other than 1/512 of the way through a cell may be missed (Sigg and Hadwiger 2005).
    #[derive(Default)]
    pub enum Reconstruction {
        /// The trilinear interpolant: what everything is measured on.
        #[default]
        Trilinear = "trilinear",
        /// The tricubic B-spline through the samples: smooth and slow, for stills, and another surface.
        Spline = "spline",
        /// The sample that is nearest: boxes of a voxel's size, for looking at samples as they are. At the faces of the scan's box they are halves.
        Nearest = "nearest",
    }
}

named! {
    /// What a cut shows where it goes through a volume.
    #[derive(Default)]
    pub enum CutFace {
        /// The bone's section in its colour; nothing of what is not bone.
        #[default]
        Bone = "bone",
        /// All values as grey, by the window and level.
        Density = "density",
        /// Those of all volumes, each in its colour, added: white where cyan and magenta agree.
        Blend = "blend",
        /// The first volume's values less the second's, where both are: red where the first is denser, blue where the second is.
        Difference = "difference",
        /// The values of the nearest volume in the colours of its transfer function, on black as far as that is clear.
        Transfer = "transfer",
    }
}

/// Which values are black and which are white.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Window {
    /// From black to white, in values.
    pub width: f64,
    /// The middle of it.
    pub level: f64,
}

impl Window {
    /// That a scan's values open with: of Hounsfield units a bone window, of others all that it holds.
    pub fn of(volume: &Volume) -> Self {
        if volume.unit() == Unit::Hounsfield { Self { width: 1000.0, level: 400.0 } } else { Self::between(volume.range()) }
    }

    /// From black to white.
    pub fn between([low, high]: [f64; 2]) -> Self {
        Self { width: high - low, level: (low + high) / 2.0 }
    }

    /// The brightness of a value, 0 to 1.
    pub fn brightness(self, value: f64) -> f64 {
        // A window without width is a threshold.
        if self.width > 0.0 { ((value - self.level) / self.width + 0.5).clamp(0.0, 1.0) } else { f64::from(u8::from(value >= self.level)) }
    }
}

/// The light and how surfaces answer it (Phong 1975).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Light {
    /// Toward the light, in the camera's right, up and backward directions; need not be unit.
    pub toward: Vec3,
    /// Part of the colour that shows without light.
    pub ambient: f32,
    /// Part that shows by Lambert's law.
    pub diffuse: f32,
    /// White highlight.
    pub specular: f32,
    /// Phong's exponent.
    pub shininess: f32,
    /// How much of Lambert's part what lies in shadow loses, 0 to 1: less than all, and shadows keep relief (the shadowing factor of the thesis of 2008,
    /// 3.3, is 1 less this; the ambient part stays, so that shadows are no darker than what is turned away from the light).
    #[serde(default = "shadow")]
    pub shadow: f32,
}

/// Dark enough to be seen as a shadow in any colour, and light enough for relief.
fn shadow() -> f32 {
    0.7
}

impl Light {
    fn is_sound(&self) -> bool {
        let parts = [self.ambient, self.diffuse, self.specular, self.shadow];
        let is_toward = self.toward.is_finite() && self.toward.length_squared() > 0.0;
        is_toward && parts.iter().all(|part| (0.0..=1.0).contains(part)) && (0.0..=1e4).contains(&self.shininess)
    }
}

impl Default for Light {
    /// A lamp over the viewer's left shoulder.
    fn default() -> Self {
        Self { toward: Vec3::new(-0.4, 0.5, 1.0), ambient: 0.08, diffuse: 0.85, specular: 0.12, shininess: 24.0, shadow: shadow() }
    }
}

/// Everything that decides a picture besides the samples and the size.
///
/// ```
/// use bregma_renderer::{Camera, Mode, Scene, SceneError};
/// use bregma_synthetic::{Which, skull};
/// use std::sync::Arc;
///
/// let volumes = [Arc::new(skull(Which::A, 16, &Default::default())?), Arc::new(skull(Which::B, 16, &Default::default())?)];
/// let mut scene = Scene::of(&volumes);
/// scene.mode = Mode::Overlay;
/// scene.layers[0].iso = 300.0;
/// assert_eq!(scene.check(), Ok(()));
/// scene.depth_cue = 2.0;
/// assert_eq!(scene.check(), Err(SceneError::Opacity));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// One for each volume, in order.
    pub layers: Vec<Layer>,
    /// Where it is seen from.
    pub camera: Camera,
    /// How a picture is made of them.
    pub mode: Mode,
    /// How roots are found.
    #[serde(default)]
    pub solver: Solver,
    /// What lies between the samples, where opaque surfaces are drawn; other modes take the trilinear interpolant.
    #[serde(default)]
    pub reconstruction: Reconstruction,
    /// The light.
    pub light: Light,
    /// How near to each other the surfaces that [`Mode::Overlay`] shows count as one, mm: drawn once, in bone's colour; what
    /// [`Scene::agreement_mm`] says when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub agree_within_mm: Option<f64>,
    /// How far apart along the ray surfaces lie at the ends of the colours of [`Mode::Depths`], mm; what [`Scene::depth_range_mm`] says when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depths_within_mm: Option<f64>,
    /// Whether visible surfaces, of any layer, keep the light from others: hard shadows.
    #[serde(default)]
    pub shadows: bool,
    /// How much of the background's colour what lies farthest away takes on, 0 to 1.
    #[serde(default)]
    pub depth_cue: f32,
    /// What is cut away.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub clips: Vec<Clip>,
    /// What cuts show.
    #[serde(default)]
    pub cut_face: CutFace,
    /// How [`Mode::Slice`] draws.
    #[serde(default)]
    pub slice: Slice,
    /// Which values are black and white; what a picture holds when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub window: Option<Window>,
    /// Whether modes that gather numbers take the magnitude of the interpolant's gradient, per mm, for the values.
    #[serde(default)]
    pub of_gradient: bool,
    /// Only where the scan has values between these two do modes that gather numbers look; everywhere when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value_range: Option<[f64; 2]>,
    /// How [`Mode::Dvr`] integrates.
    #[serde(default)]
    pub integrator: Integrator,
    /// Which gradient shades.
    #[serde(default)]
    pub normals: Normals,
    /// Behind everything; `None` is transparent.
    pub background: Option<Color>,
    /// How it is lit where it is path-traced; [`Renderer`](crate::Renderer)s, which are for looking around, leave it out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub studio: Option<Studio>,
}

/// What of a scene no renderer could draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum SceneError {
    /// A plane, box or cylinder that is none.
    #[error("one of its cuts has a direction without length, or no size")]
    Cut,
    /// A cut of a layer that is not there.
    #[error("one of its cuts is of a scan that it has not")]
    CutOfNone,
    /// Shares beyond their ends.
    #[error("one of its opacities, or its depth cue, is not between 0 and 1")]
    Opacity,
    /// Beyond [`PER_VOXEL`].
    #[error("its steps in a voxel's length are not between 0.01 and 1000")]
    Steps,
    /// No perspective.
    #[error("its field of view is not between 0 and 180 degrees")]
    FieldOfView,
    /// A range whose ends are no numbers, or the wrong way round.
    #[error("its range of values does not go from a number to a larger one")]
    Range,
    /// No window of values.
    #[error("its window has a width below 0, or no numbers")]
    Window,
    /// A light from nowhere, or parts of it beyond what there is.
    #[error("its light comes from nowhere, or one of its parts is below 0 or beyond what there is")]
    Light,
    /// Surfaces that are nearer than nothing.
    #[error("its surfaces agree within no length that there is")]
    Agreement,
    /// Colours from nothing to nothing.
    #[error("the depths between its surfaces have no range, or one that does not end")]
    Depths,
    /// A part of which nothing is known.
    #[error("the space of one of its parts has not been found")]
    Part,
    /// What fetches filtered samples reads no cells.
    #[error("the solver filter draws whole scans only, and no part of one")]
    FilteredPart,
    /// A slice of no thickness that there is, or contours wider than pictures.
    #[error("its slice is thinner than nothing, or its contours are not between 0 and 64 pixels wide")]
    Slice,
}

/// Dark blue-grey: bone stands out on it, and it prints.
pub const BACKGROUND: Color = Color([0.07, 0.08, 0.1]);

impl Scene {
    /// The background as sRGB bytes with alpha; clear where there is none.
    pub(crate) fn background_bytes(&self) -> [u8; 4] {
        self.background.map_or([0; 4], |color| {
            let [r, g, b] = color.bytes();
            [r, g, b, 255]
        })
    }

    /// The scene that `volumes` open with, from anterior and slightly above.
    pub fn of(volumes: &[Arc<Volume>]) -> Self {
        let layers: Vec<Layer> = volumes.iter().enumerate().map(|(i, v)| Layer::new(v, i, volumes.len())).collect();
        let camera = Camera::orbit(&Bounds::of(volumes.iter().map(|v| v.grid())), 0.0, 0.0);
        Self {
            layers,
            camera,
            mode: Mode::Iso,
            solver: Solver::Exact,
            reconstruction: Reconstruction::Trilinear,
            light: Light::default(),
            agree_within_mm: None,
            depths_within_mm: None,
            shadows: false,
            depth_cue: 0.0,
            clips: vec![],
            cut_face: CutFace::Bone,
            slice: Slice::default(),
            window: None,
            of_gradient: false,
            value_range: None,
            integrator: Integrator::default(),
            normals: Normals::Smooth,
            background: Some(BACKGROUND),
            studio: None,
        }
    }

    /// Whether a renderer can draw it.
    pub fn check(&self) -> Result<(), SceneError> {
        let share = |v: f32| (0.0..=1.0).contains(&v);
        let mut opacities = self.layers.iter().flat_map(|l| l.shells.iter().map(|s| s.opacity).chain([l.opacity]));
        let fov_deg = if let Projection::Perspective { fov_deg } = self.camera.projection { fov_deg } else { 30.0 };
        let per_voxel = if let Integrator::Steps { per_voxel, .. } = self.integrator { per_voxel } else { 1.0 };
        let of_none = self.clips.iter().flat_map(|clip| clip.layers.iter().flatten()).any(|n| *n >= self.layers.len());
        let parts = self.layers.iter().filter_map(|l| l.within.as_ref());
        let filters_part = self.method() == Method::Solver(Solver::Filter) && parts.count() > 0;
        let flaws = [
            (filters_part, SceneError::FilteredPart),
            (!self.clips.iter().all(Clip::is_sound), SceneError::Cut),
            (of_none, SceneError::CutOfNone),
            (!opacities.all(share) || !share(self.depth_cue), SceneError::Opacity),
            (!PER_VOXEL.contains(&per_voxel), SceneError::Steps),
            (!(fov_deg > 0.0 && fov_deg < 180.0), SceneError::FieldOfView),
            // One without width is a threshold.
            (self.value_range.is_some_and(|[low, high]| !(low.is_finite() && high.is_finite() && low < high)), SceneError::Range),
            (self.window.is_some_and(|w| !(w.width >= 0.0 && w.level.is_finite())), SceneError::Window),
            (!self.light.is_sound(), SceneError::Light),
            (self.agree_within_mm.is_some_and(|mm| !(mm >= 0.0 && mm.is_finite())), SceneError::Agreement),
            (self.depths_within_mm.is_some_and(|mm| !(mm > 0.0 && mm.is_finite())), SceneError::Depths),
            (!(self.slice.thickness_mm >= 0.0 && self.slice.thickness_mm.is_finite()), SceneError::Slice),
            (self.slice.window.is_some_and(|w| !(w.width >= 0.0 && w.level.is_finite())), SceneError::Window),
            (!(0.0..=WIDEST_CONTOUR_PX).contains(&self.slice.contour_px), SceneError::Slice),
        ];
        flaws.into_iter().find(|(is_flawed, _)| *is_flawed).map_or(Ok(()), |(_, flaw)| Err(flaw))
    }

    /// Whether the space of every part that it draws has been found.
    pub(crate) fn check_parts(&self) -> Result<(), SceneError> {
        let is_lost = |layer: &Layer| layer.visible && layer.within.is_some() && layer.solid().is_none();
        if self.layers.iter().any(is_lost) { Err(SceneError::Part) } else { Ok(()) }
    }

    /// The surfaces of the visible layers with their layer numbers.
    pub fn surfaces(&self, volumes: &[Arc<Volume>]) -> Result<Vec<(usize, Surface)>, SurfaceError> {
        self.surfaces_at(volumes, |layer, _| layer.iso)
    }

    /// For each visible layer the isosurface that holds all that its mode draws of it.
    pub(crate) fn hulls(&self, volumes: &[Arc<Volume>]) -> Result<Vec<(usize, Surface)>, SurfaceError> {
        self.surfaces_at(volumes, |layer, volume| match self.mode.gather() {
            Gather::Nearest | Gather::FirstOfEach => layer.iso,
            Gather::Crossings => layer.shells.iter().map(|s| s.iso).fold(layer.iso, f64::min),
            Gather::Density => lowest_visible(&layer.controls(volume)).unwrap_or(f64::INFINITY),
            // No lower than the scan's values: what is relative to it keeps their digits.
            Gather::Number(_) => self.value_range.map_or(volume.range()[0], |[low, _]| low),
            Gather::Plane => volume.range()[0],
        })
    }

    fn surfaces_at(&self, volumes: &[Arc<Volume>], iso: impl Fn(&Layer, &Volume) -> f64) -> Result<Vec<(usize, Surface)>, SurfaceError> {
        let visible = self.layers.iter().zip(volumes).enumerate().filter(|(_, (layer, _))| layer.visible);
        visible
            .map(|(i, (layer, volume))| {
                Ok((i, Surface::new(volume, iso(layer, volume), layer.transform)?.cut(&self.clips, i).within(layer.solid())))
            })
            .collect()
    }

    /// Whether its pictures have values: one number for each pixel.
    pub fn gives_values(&self) -> bool {
        self.mode.uses(Setting::Numbers) || self.is_slice()
    }

    /// Whether it is a plane through the scans.
    pub fn is_slice(&self) -> bool {
        self.mode.uses(Setting::Slice)
    }

    /// The camera that it is drawn by: a slice is seen along parallel rays.
    pub fn viewed_from(&self) -> Camera {
        if self.is_slice() { self.camera.parallel() } else { self.camera }
    }

    /// What shows values instead of bone where it is cut through, in all modes.
    pub(crate) fn face(&self) -> CutFace {
        if self.is_slice() { self.slice.face } else { self.cut_face }
    }

    /// Whether something is cut away and the faces of the cuts can show.
    pub fn has_cut_faces(&self) -> bool {
        !self.clips.is_empty() && self.mode.uses(Setting::Shading)
    }

    /// Whether what is drawn are surfaces of the spline.
    pub fn draws_spline(&self) -> bool {
        self.reconstructs() == Reconstruction::Spline
    }

    /// Whether what is drawn are opaque surfaces in their own colours, which a studio can light; those of an overlay are taken as opaque.
    pub(crate) fn draws_opaque(&self) -> bool {
        self.mode.uses(Setting::Solver) && !self.tells_depths()
    }

    /// Whether colours tell how far apart surfaces lie along rays.
    pub fn tells_depths(&self) -> bool {
        self.mode.uses(Setting::Depths)
    }

    /// Whether surfaces that agree are drawn as one.
    pub fn tells_agreement(&self) -> bool {
        self.mode.uses(Setting::Agreement)
    }

    /// Whether rays go on from crossing to crossing.
    pub(crate) fn goes_through_surfaces(&self) -> bool {
        self.mode.gather() == Gather::Crossings
    }

    /// What lies between the samples of what is drawn.
    pub fn reconstructs(&self) -> Reconstruction {
        if self.mode.uses(Setting::Solver) { self.reconstruction } else { Reconstruction::Trilinear }
    }

    /// How surfaces are found within cells.
    pub(crate) fn method(&self) -> Method {
        match self.reconstructs() {
            Reconstruction::Trilinear => Method::Solver(self.solver),
            Reconstruction::Spline => Method::Spline,
            Reconstruction::Nearest => Method::Voxels,
        }
    }

    /// The direction toward the light in the world, unit.
    pub(crate) fn toward_light(&self) -> DVec3 {
        let basis = self.camera.basis();
        let l = self.light.toward.as_dvec3();
        (l.x * basis.right + l.y * basis.up - l.z * basis.forward).try_normalize().unwrap_or(-basis.forward)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Named, Shell, TransferFunction};
    use bregma_field::{Progress, Shape};
    use bregma_synthetic::{Random, Which, skull};

    fn volumes() -> [Arc<Volume>; 2] {
        [Which::A, Which::B].map(|which| Arc::new(skull(which, 12, &Progress::default()).unwrap()))
    }

    #[test]
    fn colours_come_back_from_text_and_from_light() {
        // Fails if a byte is rounded away in hex or on the way to light and back, or a brighter byte is not more light.
        let mut r = Random(1);
        let mut before = -1.0;
        for byte in 0..=255 {
            let color = Color([byte as f32 / 255.0, r.unit() as f32, r.unit() as f32]);
            assert_eq!(Color::from_hex(&color.hex()).unwrap().bytes(), color.bytes());
            assert_eq!(Color::from_hex(&format!("#{}", color.hex())), Color::from_hex(&color.hex()));
            assert_eq!(Color::of_light(color.linear()).bytes(), color.bytes());
            let light = color.linear().x;
            assert!(light > before && light <= 1.0);
            before = light;
        }
        assert_eq!(["12345", "1234567", "xyzxyz", "", "##1234"].map(Color::from_hex), [None; 5]);
    }

    #[test]
    fn a_window_is_black_at_its_lower_end_white_at_its_upper_one_and_rises_between() {
        // Fails if level and width are taken for the ends, or a window without width is no threshold.
        let mut r = Random(2);
        for _ in 0..1000 {
            let low = 4000.0 * r.unit() - 2000.0;
            let window = Window::between([low, low + 1.0 + 1000.0 * r.unit()]);
            let at = |part: f64| window.brightness(low + part * window.width);
            assert!(
                at(0.0).abs() < 1e-9 && (at(0.5) - 0.5).abs() < 1e-9 && (at(1.0) - 1.0).abs() < 1e-9 && at(-1.0) == 0.0 && at(2.0) == 1.0
            );
            let (a, b) = (3.0 * r.unit() - 1.0, 3.0 * r.unit() - 1.0);
            assert!(at(a.min(b)) <= at(a.max(b)));
            let threshold = Window { width: 0.0, level: low };
            assert!(threshold.brightness(low) == 1.0 && threshold.brightness(low - 1e-6) == 0.0);
        }
    }

    #[test]
    fn a_scene_is_read_as_it_was_written_and_each_flaw_is_found() {
        // Fails if a field is left out of the file, or a number that no renderer can draw passes the check or is called by another's name.
        let mut r = Random(3);
        let mut scene = Scene::of(&volumes());
        scene.clips = vec![Clip::all(Shape::Plane { normal: DVec3::X, offset_mm: r.unit() })];
        scene.window = Some(Window { width: 100.0 * r.unit(), level: r.unit() });
        scene.layers[0].shells = vec![Shell { iso: 1000.0 * r.unit(), color: BACKGROUND, opacity: r.unit() as f32 }];
        let mut bone = TransferFunction::bone();
        // Files have colours of eight bits.
        bone.points.iter_mut().for_each(|p| p.color = Color::from_hex(&p.color.hex()).unwrap());
        scene.layers[1].transfer = Some(bone);
        for &mode in Mode::ALL {
            scene.mode = mode;
            let read: Scene = serde_json::from_str(&serde_json::to_string(&scene).unwrap()).unwrap();
            assert_eq!(read, scene);
            assert_eq!(scene.check(), Ok(()));
        }
        let beyond = 1.0 + r.unit() as f32;
        type Flaw<'a> = (SceneError, &'a dyn Fn(&mut Scene));
        let flaws: [Flaw<'_>; 8] = [
            (SceneError::Cut, &|s| s.clips.push(Clip::all(Shape::Plane { normal: DVec3::ZERO, offset_mm: 0.0 }))),
            (SceneError::CutOfNone, &|s| s.clips[0].layers = Some(vec![1, 2])),
            (SceneError::Opacity, &|s| s.layers[1].opacity = beyond),
            (SceneError::Opacity, &|s| s.layers[0].shells[0].opacity = -beyond),
            (SceneError::Opacity, &|s| s.depth_cue = f32::NAN),
            (SceneError::Steps, &|s| s.integrator = Integrator::Steps { per_voxel: 0.0, jitter: false }),
            (SceneError::FieldOfView, &|s| s.camera.projection = Projection::Perspective { fov_deg: 180.0 }),
            (SceneError::Window, &|s| s.window = Some(Window { width: -1.0, level: 0.0 })),
        ];
        for (flaw, make) in flaws {
            let mut broken = scene.clone();
            make(&mut broken);
            assert_eq!(broken.check(), Err(flaw));
        }
    }

    #[test]
    fn a_hull_holds_all_that_its_mode_draws_and_the_light_goes_with_the_camera() {
        // Fails if a mode draws a value outside the surface that is walked to, or the light stands still while the camera turns.
        let volumes = volumes();
        let mut r = Random(4);
        for _ in 0..200 {
            let mut scene = Scene::of(&volumes);
            let iso = |r: &mut Random| 2000.0 * r.unit() - 500.0;
            for layer in &mut scene.layers {
                layer.iso = iso(&mut r);
                layer.shells = (0..3).map(|_| Shell { iso: iso(&mut r), color: BACKGROUND, opacity: 0.5 }).collect();
            }
            for &mode in Mode::ALL {
                scene.mode = mode;
                for (n, hull) in scene.hulls(&volumes).unwrap() {
                    let layer = &scene.layers[n];
                    let lowest = match mode.gather() {
                        Gather::Nearest | Gather::FirstOfEach => layer.iso,
                        Gather::Crossings => layer.shells.iter().fold(layer.iso, |low, shell| low.min(shell.iso)),
                        Gather::Density => layer.controls(&volumes[n]).iter().find(|c| c.extinction_per_mm > 0.0).unwrap().value,
                        Gather::Number(_) | Gather::Plane => volumes[n].range()[0],
                    };
                    assert!(hull.level <= volumes[n].sample_of(lowest) + 1e-9, "{mode:?}: {} leaves out {lowest}", hull.level);
                }
            }
            scene.camera = Camera::orbit(&Bounds::of(volumes.iter().map(|v| v.grid())), 360.0 * r.unit(), 80.0 * r.unit());
            let (toward, basis) = (scene.toward_light(), scene.camera.basis());
            let seen = DVec3::new(toward.dot(basis.right), toward.dot(basis.up), -toward.dot(basis.forward));
            assert!((seen - scene.light.toward.as_dvec3().normalize()).length() < 1e-6);
        }
    }
}
