//! Studio light: path tracing of a scene's surfaces, found as its pictures find them.
//!
//! A [`Studio`] of a [`Scene`](crate::Scene) says how it is lit, a [`Tracer`] draws samples of it, and [`Exposed`] adds them up and tells their noise.

pub(crate) mod accumulate;
pub(crate) mod batch;
pub(crate) mod bone;
pub(crate) mod bsdf;
mod denoise;
pub(crate) mod ground;
pub(crate) mod lamps;
pub(crate) mod path;
pub(crate) mod sampling;
mod settings;
#[cfg(test)]
mod tests;
mod tone;
mod tracer;

pub use accumulate::{Exposed, NotExposed};
pub use bone::can_light;
pub use settings::{Follows, Ground, Lamp, MOST_LAMPS, MOST_SMOOTH_VOXEL, Preset, Sky, Studio, StudioError, Tone};
pub use tracer::{LEAST_SAMPLES, NotDrawn, Tracer, TracerCache};
