//! What is read off scans: the difference ray, its lengths and their errors.

mod edge;
pub mod export;
pub mod landmarks;
pub mod mesh;
pub mod numbers;
mod probe;
pub mod thickness;
mod uncertainty;

pub use bregma_field::interpolant::profile;
pub use edge::Edge;
pub use probe::{CrossingRecord, DifferenceRay, LedgerEntry, RayRecord, Segment, VolumeRecord, iso_tolerance, probe, probe_cut};
pub use uncertainty::Uncertainty;
