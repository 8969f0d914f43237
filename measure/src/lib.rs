//! What is read off scans: the difference ray, its lengths and their errors.

mod edge;
pub mod export;
pub mod mesh;
mod probe;
pub mod thickness;

mod uncertainty;

pub use edge::Edge;
pub use probe::{CrossingRecord, DifferenceRay, LedgerEntry, RayRecord, Segment, VolumeRecord, iso_tolerance, probe};
pub use uncertainty::Uncertainty;
