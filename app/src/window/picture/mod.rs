//! The picture: what is drawn, over it, and what the mouse does there.

pub mod by_hand;
pub mod cast;
pub mod compare_bar;
mod cut_handles;
mod drawing;
mod legend;
pub mod marks;
pub mod navigate;
pub mod painter;
pub mod slice_views;
mod threshold_curve;
pub mod tools;
pub mod view;
