//! Exact isosurfaces of scans by ray casting, on the CPU and on the GPU.
//!
//! A [`Scene`] says what is drawn; a [`Renderer`] turns it and its volumes into a [`Picture`]. [`reference`] is the truth
//! that both renderers are held to, and what measurements are taken from.

mod camera;
mod cpu;
mod frame;
#[cfg(feature = "gpu")]
mod gpu;
mod occupancy;
pub mod reference;
mod roots;
mod scene;
pub mod stability;

pub use camera::{Basis, Bounds, Camera, FOV_DEG, PixelAffine, PixelRays, Projection, Ray};
pub use cpu::CpuRenderer;
#[cfg(feature = "gpu")]
pub use gpu::{GpuError, GpuRenderer};
pub use occupancy::DistanceMap;
pub use roots::{PerVoxel, Solver, Steps};
pub use scene::{BACKGROUND, Color, Layer, Light, Mode, Picture, Scene, Surface};

use bregma_volume::{GridError, Volume};
use std::sync::Arc;
use thiserror::Error;

/// Turns scenes into pictures.
pub trait Renderer: Send {
    /// What draws: backend and adapter or threads.
    fn name(&self) -> String;

    /// The picture of `scene` (one layer for each of `volumes`, in order) with `width`×`height` pixels.
    fn render(&mut self, volumes: &[Arc<Volume>], scene: &Scene, width: u32, height: u32) -> Result<Picture, RenderError>;
}

/// Why there is no picture.
#[derive(Debug, Error)]
pub enum RenderError {
    /// A registration that flattens a volume.
    #[error("the transform of a volume cannot be used: {0}")]
    Transform(#[from] GridError),
    /// Something about the graphics card or its driver.
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Gpu(#[from] GpuError),
}
