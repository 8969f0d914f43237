//! What need not be walked: claims about where a surface cannot be, each tested against walking everything.
//!
//! From coarse to fine: blocks of pixels and of the light's view (`spans`, `light_spans`), range bricks (`occupancy`), cells (`cell_masks`).

mod cell_masks;
mod light_spans;
mod maps;
mod occupancy;
mod spans;

pub(crate) use cell_masks::{CellMasks, WORDS};
pub(crate) use light_spans::LightSpans;
pub(crate) use maps::MapCache;
pub use occupancy::DistanceMap;
pub(crate) use spans::{BLOCK, Spans};
