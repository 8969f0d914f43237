//! The parts of a scan: islands of bone, bones that hang together by necks, the skull without what it lies on, and label maps of all these.
//!
//! A part is a number at samples ([`Labels`]). [`Islands`] are found at an isovalue; [`separate()`] and [`keep_the_skull`] take islands apart by the
//! distance of samples from the nearest outside. [`read()`] and [`write()`] are label maps as files, 3D Slicer's among them.

mod distances;
mod envelope;
mod error;
mod growth;
mod islands;
mod labels;
mod segmentation;
mod separate;
mod space;
mod statistics;
mod whole_skull;

pub use error::PartsError;
pub use islands::{Islands, Run};
pub use labels::{Labels, Part};
pub use segmentation::{read, write};
pub use separate::{Neck, separate};
pub use space::Meant;
pub use statistics::Statistics;
pub use whole_skull::{WholeSkull, keep_the_skull};
