//! The workstation: a window and a command line over the libraries of this workspace.

pub mod args;
pub mod chart;
pub mod commands;
pub mod compare;
pub mod input;
pub mod look;
pub mod output;
pub mod presets;
pub mod record;
pub mod thickness;
pub mod window;
