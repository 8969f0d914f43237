//! What the command line does, a file for each command.

mod bench;
mod chart;
mod convert;
mod demo;
mod difference;
mod differences;
mod info;
mod orient;
mod probe;
mod register;
mod render;
mod stability;
mod studio;
mod thickness;
mod verify;
mod volume;

pub use bench::bench;
pub use chart::chart;
pub use convert::convert;
pub use demo::{demo, write_demo};
pub use difference::difference;
pub use differences::differences;
pub use info::info;
pub use orient::orient;
pub use probe::probe;
pub use register::register;
pub use render::render;
pub use stability::stability;
pub use thickness::thickness;
pub use verify::verify;
pub use volume::volume;
