//! The workstation: a window and a command line over the workbench of `bregma-session`.

pub mod cli;
pub mod window;
