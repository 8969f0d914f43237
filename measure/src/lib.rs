//! What is read off scans: the difference ray, its lengths and their errors.

mod edge;
pub mod export;
mod probe;

mod uncertainty;

pub use edge::Edge;
pub use probe::{CrossingRecord, DifferenceRay, LedgerEntry, RayRecord, Segment, VolumeRecord, iso_tolerance, probe};
pub use uncertainty::Uncertainty;
