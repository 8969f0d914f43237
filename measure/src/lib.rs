//! What is read off scans: the difference ray, its lengths and their errors.

pub mod csv;
pub mod difference;
mod edge;
pub mod export;
pub mod landmarks;
pub mod mesh;
pub mod numbers;
pub mod partner;
mod probe;
mod record;
pub mod section;
mod stretches;
pub mod table_style;
pub mod thickness;
mod threshold;
mod uncertainty;
pub mod volumes;

pub use bregma_field::interpolant::profile;
pub use edge::Edge;
pub use probe::{corrections, iso_tolerance, mirrored, probe, probe_cut};
pub use record::{CrossingRecord, Difference, DifferenceRay, LedgerEntry, Meets, Pair, RayRecord, Segment, Shift, VolumeRecord};
pub use threshold::unlike_thresholds;
pub use uncertainty::{IN_95_OF_100, Registered, Uncertainty};
