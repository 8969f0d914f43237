//! The workstation: a window and a command line over the libraries of this workspace.

pub mod input;
pub mod window;
