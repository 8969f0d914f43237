//! The picture: what is drawn, over it, and what the mouse does there.

mod arcball;
pub mod by_hand;
pub mod cast;
pub mod compare_bar;
mod cut_handles;
pub mod desk;
mod drawing;
mod exposer;
mod frames;
mod legend;
pub mod marks;
mod mouse;
pub mod navigate;
mod outlines;
pub mod painter;
pub mod part_hand;
pub mod section_curve;
pub mod slice_views;
pub mod solid_handles;
mod threshold_curve;
mod tint;
pub mod tools;
pub mod view;
