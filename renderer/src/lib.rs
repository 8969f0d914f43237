//! Exact isosurfaces of scans by ray casting, on the CPU and on the GPU.
//!
//! A [`Scene`] says what is drawn; a [`Renderer`] turns it and its volumes into a [`Picture`]. [`bregma_field::crossings`] is the truth
//! that both renderers are held to, and what measurements are taken from.

pub mod accuracy;
mod appearance;
mod camera;
mod color;
mod comparing;
mod cpu;
mod frame;
#[cfg(feature = "gpu")]
mod gpu;
mod lanes;
mod layer;
mod modes;
mod named;
mod picture;
mod roots;
mod scene;
mod skip;
mod slice;
pub mod stability;
mod still;
pub mod studio;
mod tone;
mod transfer;

pub use bregma_field::{Bounds, Clip, Ray, Region, Shape, Surface};
pub use camera::{Basis, Camera, FOV_DEG, PixelAffine, PixelRays, Projection, point_in_pixel};
pub use color::Color;
pub use cpu::CpuRenderer;
pub use fearless_simd::Level as InstructionSet;
#[cfg(feature = "gpu")]
pub use gpu::{GpuError, GpuRenderer};
pub use layer::{Layer, Shell, Within};
pub use modes::{Gather, Mode, RayValue, Setting};
pub use named::Named;
pub use picture::{MOST_VOLUMES, Picture};
pub use roots::{PerVoxel, Solver, Steps};
pub use scene::{BACKGROUND, CutFace, Integrator, Light, Normals, PER_VOXEL, Reconstruction, Scene, SceneError, Window};
pub use skip::DistanceMap;
pub use slice::{BodyPlane, Contour, Slab, Slice, WIDEST_CONTOUR_PX, stroke, view_of_plane};
pub use still::{MOST_SAMPLES, Still};
pub use transfer::{Control, GradientPoint, OVERALL, Point, TransferFunction, Values, classify};

use bregma_field::{SurfaceError, Volume};
use serde::Serialize;
use std::fmt;
use std::sync::Arc;
use studio::Tracer;
use thiserror::Error;

/// A kind of machine that draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Backend {
    /// The CPU.
    Cpu,
    /// A GPU, or a software driver that stands for one.
    Gpu,
}

impl Backend {
    /// `cpu` or `gpu`, as files and options name it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cpu => "cpu",
            Self::Gpu => "gpu",
        }
    }
}

impl fmt::Display for Backend {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// Turns scenes into pictures.
///
/// ```
/// use bregma_renderer::{CpuRenderer, Renderer, Scene};
/// use bregma_synthetic::{Which, skull};
/// use std::sync::Arc;
///
/// let volumes = [Arc::new(skull(Which::A, 16, &Default::default())?)];
/// let picture = CpuRenderer::default().render(&volumes, &Scene::of(&volumes), 64, 48)?;
/// let nearest_mm = picture.depth_mm.iter().copied().fold(f32::INFINITY, f32::min);
/// assert!(picture.rgba.len() == 64 * 48 && picture.volume_id.contains(&1));
/// println!("the face is {nearest_mm} mm away");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait Renderer: Send {
    /// What draws: backend, and adapter or threads and vector instructions.
    fn name(&self) -> String;

    /// What kind of machine draws.
    fn backend(&self) -> Backend;

    /// Whether it can draw by `solver`.
    fn has(&self, solver: Solver) -> bool;

    /// The picture of `scene` (one layer for each of `volumes`, in order) with `width`×`height` pixels, each seen through its middle.
    fn render(&mut self, volumes: &[Arc<Volume>], scene: &Scene, width: u32, height: u32) -> Result<Picture, RenderError> {
        self.sample(volumes, scene, [width, height], 0)
    }

    /// The same, each pixel seen through its [`point_in_pixel`] number `sample`.
    fn sample(&mut self, volumes: &[Arc<Volume>], scene: &Scene, size: [u32; 2], sample: u32) -> Result<Picture, RenderError>;

    /// The same, through `samples` points of each pixel; of a slice, which has values at its nodes alone, through one.
    fn still(&mut self, volumes: &[Arc<Volume>], scene: &Scene, size: [u32; 2], samples: u32) -> Result<Picture, RenderError> {
        let mut still = Still::of(self.sample(volumes, scene, size, 0)?);
        while still.samples() < samples && !scene.is_slice() {
            still.add(&self.sample(volumes, scene, size, still.samples())?);
        }
        Ok(still.picture())
    }

    /// A scene that has a studio, ready to be drawn under its light in a picture of a size; other seeds have other noise. What takes long to know of
    /// the scans is kept for the next one.
    fn tracer(&mut self, volumes: &[Arc<Volume>], scene: &Scene, size: [u32; 2], seed: u32) -> Result<Tracer, RenderError>;

    /// Takes back a picture that nobody needs: the next one of its size has its memory, which else takes up to a quarter of a frame's time to come.
    fn reuse(&mut self, picture: Picture) {
        drop(picture);
    }

    /// Memory kept for the surfaces drawn last, beside their volumes.
    fn bytes(&self) -> usize;

    /// Where the time of such a picture goes.
    fn split(&mut self, volumes: &[Arc<Volume>], scene: &Scene, width: u32, height: u32) -> Result<Split, RenderError>;
}

/// Where the time of a frame goes, ms of wall clock. Measured by leaving parts out: what a part costs is the difference that it makes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Split {
    /// From brick to brick and cell to cell, to hits that are known; with fixed steps also interpolating.
    pub walking_ms: f64,
    /// Reading samples.
    pub fetching_ms: f64,
    /// Finding roots.
    pub solving_ms: f64,
    /// Normals, colours, and the way of the picture to memory.
    pub shading_ms: f64,
}

/// Times that each part of a frame is timed; the fastest counts, as nothing makes a computer faster than it is.
const SPLIT_ROUNDS: usize = 3;

impl Split {
    /// From the times of a walk, of one that also fetches, of one that also solves, and of the whole frame. Noise may make a longer work
    /// look shorter: no part takes less than nothing.
    pub(crate) fn between(walked_ms: f64, fetched_ms: f64, solved_ms: f64, whole_ms: f64) -> Self {
        let part = |from: f64, to: f64| (to - from).max(0.0);
        Self {
            walking_ms: walked_ms,
            fetching_ms: part(walked_ms, fetched_ms),
            solving_ms: part(fetched_ms, solved_ms),
            shading_ms: part(solved_ms, whole_ms),
        }
    }
}

impl RenderError {
    /// Whether the graphics card itself failed: what it holds is gone, and it may be back later.
    pub fn is_lost_device(&self) -> bool {
        match self {
            #[cfg(feature = "gpu")]
            Self::Gpu(GpuError::Failed { .. }) => true,
            _ => false,
        }
    }

    /// Whether another solver would be drawn.
    pub fn is_solver(&self) -> bool {
        match self {
            Self::NeedsGpu(_) => true,
            #[cfg(feature = "gpu")]
            Self::Gpu(GpuError::NoFilter { .. }) => true,
            _ => false,
        }
    }
}

/// Why there is no picture.
#[derive(Debug, Error)]
pub enum RenderError {
    /// A picture without pixels.
    #[error("a picture of {width}×{height} pixels has none; ask for at least 1×1")]
    NoPixels {
        /// Pixels across.
        width: u32,
        /// Pixels down.
        height: u32,
    },
    /// A scene that no renderer could draw.
    #[error("the scene cannot be drawn: {0}")]
    Scene(#[from] SceneError),
    /// A studio that no renderer could light, or a way of drawing that has none.
    #[error(transparent)]
    Studio(#[from] studio::StudioError),
    /// A registration that flattens a volume, or an isovalue whose surface it has not.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// A spline of samples that are too large for it.
    #[error(
        "{name}: its samples reach {largest:e}, and beyond 1e35 float32 holds no spline of them; draw it without --reconstruction spline"
    )]
    NoSpline {
        /// The scan.
        name: String,
        /// Its largest sample, without sign.
        largest: f64,
    },
    /// A solver that only graphics cards have.
    #[error("the solver {0} needs a graphics card; use --backend gpu or another --solver")]
    NeedsGpu(Solver),
    /// Something about the graphics card or its driver.
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Gpu(#[from] GpuError),
}
