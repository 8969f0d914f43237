//! Scans on their way in.

use super::job::Job;
use crate::input::{DEMO_SIZE, InputError, Opened, Source};
use bregma_renderer::Mode;
use egui::Context;

/// Scans on their way in. Dropping it stops the reading.
#[derive(Debug)]
pub struct Loading {
    /// The reading.
    pub job: Job<Opened>,
    /// The scans join those that are open, instead of taking their place.
    pub adds: bool,
}

impl Loading {
    /// Computes the built-in pair.
    pub fn demo(ctx: &Context) -> Self {
        let make = |progress: &_| -> Result<Opened, InputError> {
            let mut opened = Opened::demo(DEMO_SIZE, progress)?;
            // The two differ in few places: over most of the bone their surfaces coincide, and neither is the nearer one.
            opened.scene.mode = Mode::Overlay;
            Ok(opened)
        };
        Self { job: Job::start(ctx, "Making the demo pair".into(), make), adds: false }
    }

    /// Reads scans or a session.
    pub fn files(ctx: &Context, sources: Vec<Source>, adds: bool) -> Self {
        let names: Vec<_> = sources.iter().map(|s| s.file.file_name().unwrap_or(s.file.as_os_str()).to_string_lossy()).collect();
        let what = match &names[..] {
            [first, _, _, ..] => format!("Reading {first} and {} more", names.len() - 1),
            few => format!("Reading {}", few.join(" and ")),
        };
        // A session brings its own scene, which replaces what is open.
        let is_session = matches!(&sources[..], [only] if only.file.extension().is_some_and(|e| e.eq_ignore_ascii_case("json")));
        Self { job: Job::start(ctx, what, move |progress| Opened::read(&sources, progress)), adds: adds && !is_session }
    }
}
