//! The parts of a scan: islands of bone, bones that hang together by necks, the skull without what it lies on, and label maps of all these.
//!
//! A part is a number at samples ([`Labels`]). [`Islands`] are found at an isovalue; [`separate()`] and [`keep_the_skull`] take islands apart by the
//! distance of samples from the nearest outside. [`Labels`] are changed by hand with a brush ([`Dab`]) and scissors ([`Lasso`]), grow from what was painted,
//! are smoothed, and come from closed surfaces ([`ClosedSurface`]). [`read()`] and [`write()`] are label maps as files, 3D Slicer's among them.

mod brush;
mod closed_surface;
mod distances;
mod envelope;
mod error;
mod growth;
mod islands;
mod labels;
mod numbers;
mod scissors;
mod seeds;
mod segmentation;
mod separate;
mod smooth;
mod space;
mod statistics;
mod whole_skull;

pub use brush::{Dab, Span};
pub use closed_surface::ClosedSurface;
pub use error::PartsError;
pub use islands::{Islands, Run};
pub use labels::{Labels, Part};
pub use scissors::{Depth, Lasso, Seen};
pub use segmentation::{read, write};
pub use separate::{Neck, separate};
pub use space::Meant;
pub use statistics::Statistics;
pub use whole_skull::{WholeSkull, keep_the_skull};
