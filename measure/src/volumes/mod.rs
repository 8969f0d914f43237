//! Volumes of bone and of cavities, exactly on the solid that the trilinear interpolant bounds.
//!
//! [`bone()`] measures one scan, or two and what they share; [`cavity`] what lies within bone. `pass.rs` adds up, `sureness.rs` says how far the
//! truth may be.

mod bone;
pub mod cavity;
mod error;
mod other;
mod pass;
mod room;
mod sums;
mod sureness;
#[cfg(test)]
mod tests;

pub use bone::{Limits, MeasuredBone, Volumes, bone};
pub use error::VolumesError;
pub use room::WayOut;
pub use sureness::{Measure, Sharpness, VolumeUncertainty};
