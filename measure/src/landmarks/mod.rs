//! Landmarks: points that a person sets on bone, the files that hold them, and the names that the field has for them.

mod landmark;
mod read;
mod templates;
mod write;

pub use landmark::Landmark;
pub use read::{LandmarkError, read};
pub use templates::{CRANIOMETRIC, Definition, Template, TemplateError};
pub use write::{csv, fcsv, markups, morphologika, tps};
