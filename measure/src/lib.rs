//! What is read off scans: the difference ray, its lengths and their errors.

pub mod export;
mod probe;

pub use probe::{CrossingRecord, DifferenceRay, LedgerEntry, RayRecord, Segment, VolumeRecord, iso_tolerance, probe};
