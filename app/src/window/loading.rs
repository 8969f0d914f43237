//! Reading on a thread of its own, so that the window never waits for a file.

use super::layers::line;
use crate::input::{DEMO_SIZE, InputError, Opened, Source};
use bregma_renderer::Mode;
use bregma_volume::Progress;
use egui::{Align, Context, Layout, ProgressBar, Ui};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::Duration;

/// Scans on their way in. Dropping it stops the reading.
#[derive(Debug)]
pub struct Loading {
    what: String,
    /// The scans join those that are open, instead of taking their place.
    pub adds: bool,
    progress: Arc<Progress>,
    result: Receiver<Result<Opened, InputError>>,
}

impl Loading {
    /// Computes the built-in pair.
    pub fn demo(ctx: &Context) -> Self {
        Self::start(ctx, "Making the demo pair".into(), false, |progress| {
            let mut opened = Opened::demo(DEMO_SIZE, progress)?;
            // The two differ in few places: over most of the bone their surfaces coincide, and neither is the nearer one.
            opened.scene.mode = Mode::Overlay;
            Ok(opened)
        })
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
        Self::start(ctx, what, adds && !is_session, move |progress| Opened::read(&sources, progress))
    }

    fn start(ctx: &Context, what: String, adds: bool, work: impl FnOnce(&Progress) -> Result<Opened, InputError> + Send + 'static) -> Self {
        let progress = Arc::new(Progress::default());
        let (send, result) = channel();
        let (shared, ctx) = (Arc::clone(&progress), ctx.clone());
        std::thread::spawn(move || {
            // Nobody listens any more when the person cancelled.
            let _ = send.send(work(&shared));
            ctx.request_repaint();
        });
        Self { what, adds, progress, result }
    }

    /// The scans or one sentence about what went wrong; `None` while reading.
    pub fn poll(&self) -> Option<Result<Opened, String>> {
        match self.result.try_recv() {
            Ok(result) => Some(result.map_err(|e| e.to_string())),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => {
                Some(Err(format!("{} stopped inside the program; `bregma info FILE` on a terminal says more", self.what)))
            }
        }
    }

    /// Shows how far it is. True when the person cancels.
    pub fn ui(&self, ui: &mut Ui) -> bool {
        // The work runs elsewhere: look at it a few times a second.
        ui.ctx().request_repaint_after(Duration::from_millis(100));
        line(ui, |ui| {
            let cancelled = ui.button("Cancel").on_hover_text("Stop loading; what is open stays").clicked();
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                let fraction = self.progress.fraction();
                ui.label(&self.what);
                // What is still to do must show on the empty window, too.
                ui.visuals_mut().extreme_bg_color = ui.visuals().widgets.inactive.weak_bg_fill;
                let bar = ProgressBar::new(fraction).text(format!("{:.0} %", 100.0 * fraction));
                ui.add(bar).accessible_name("Loading");
            });
            cancelled
        })
    }
}

impl Drop for Loading {
    fn drop(&mut self) {
        self.progress.cancel();
    }
}
