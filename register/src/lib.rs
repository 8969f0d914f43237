//! How one scan is moved onto another, and how sure that is. The only package that changes a pose.
//!
//! By [`landmarks`], or by [`surfaces`] from a pose that is near or from [`anywhere`], and from there by [`intensities`]; on all of the scans or on [`Parts`] of them. [`sureness`] says
//! how sure the pose of surfaces is; [`orient`] holds one scan by its points or its symmetry.

pub mod anywhere;
pub mod cloud;
mod coarse;
pub mod intensities;
pub mod landmarks;
mod motion;
pub mod orient;
mod part;
mod sides;
mod statistics;
pub mod sureness;
pub mod surfaces;
mod symmetric;

pub use part::{Part, Parts};
