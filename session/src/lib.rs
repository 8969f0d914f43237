//! The workbench without a face: what is opened, what is measured on it, how it is looked at and compared, and what of that is written.
//! The window and the command line are faces of it.
//!
//! A [`Source`] names a scan; [`Opened`] is scans in memory with their scene; a [`Session`] is what a file keeps of them, and a [`Measurement`]
//! what it keeps of a ray.

mod arrange;
pub mod chart;
pub mod coat;
mod compare;
mod date;
pub mod difference;
mod difference_order;
pub mod difference_picture;
pub mod difference_report;
pub mod difference_table;
mod displacement;
pub mod film;
mod frame_rate;
mod keeping;
mod kind;
mod labelled;
pub mod looks;
mod machine;
mod meant;
mod measurement;
mod opened;
pub mod output;
mod parts;
mod poses;
pub mod presets;
pub mod print;
pub mod record;
pub mod register;
pub mod save;
pub mod section;
mod section_order;
mod session_file;
mod shelf;
mod slices;
mod source;
pub mod studio;
pub mod thickness;
pub mod thickness_picture;
mod under;
pub mod views;
pub mod volumes;
mod volumes_order;

pub use bregma_measure::landmarks::{CRANIOMETRIC, Landmark, Template};
pub use compare::{Compare, Part, compared};
pub use difference_order::{By as DifferenceBy, Order as DifferenceOrder};
pub use displacement::{Moved, PartError};
pub use frame_rate::{FrameRate, FrameRateError};
pub use keeping::Made;
pub use kind::Kind;
pub use labelled::{How, Labelled, Listed, PartOfError};
pub use machine::Machine;
pub use meant::Written;
pub use measurement::{MeasuredScan, Measurement, Origin, RecordedDifference, RecordedRay, RecordedSection};
pub use opened::{DEMO_SIZE, InputError, Opened, same_scans, scans, without_spacing};
pub use parts::PartOf;
pub use poses::KeptPose;
pub use section_order::{Column, Order as SectionOrder, Told as ToldSection};
pub use session_file::{Session, SessionError};
pub use shelf::{Shelf, ShelfError};
pub use slices::{Frame, Layout, Slices, step_along_mm};
pub use source::{Raw, Source};
pub use under::Held;
