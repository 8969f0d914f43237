//! Long work on a thread of its own, so that the window never waits.

use super::widgets::line;
use bregma_field::Progress;
use egui::{Align, Context, Layout, ProgressBar, Ui};
use std::fmt::Display;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::{Duration, Instant};

/// Work under way that ends in a `T`. Dropping it stops the work.
#[derive(Debug)]
pub struct Job<T> {
    /// For the person: what is being done.
    what: String,
    since: Instant,
    progress: Arc<Progress>,
    result: Receiver<Result<T, String>>,
}

/// A rate is known once so much of the time and of the work has gone.
const KNOWN: (Duration, f32) = (Duration::from_secs(1), 0.05);

impl<T: Send + 'static> Job<T> {
    /// Starts `work`.
    pub fn start<E: Display>(ctx: &Context, what: String, work: impl FnOnce(&Progress) -> Result<T, E> + Send + 'static) -> Self {
        let progress = Arc::new(Progress::default());
        let (send, result) = channel();
        let (shared, ctx) = (Arc::clone(&progress), ctx.clone());
        std::thread::spawn(move || {
            // Nobody listens any more when the person cancelled.
            let _ = send.send(work(&shared).map_err(|e| e.to_string()));
            ctx.request_repaint();
        });
        Self { what, since: Instant::now(), progress, result }
    }

    /// The result or one sentence about what went wrong; `None` while at work.
    pub fn poll(&self) -> Option<Result<T, String>> {
        match self.result.try_recv() {
            Ok(result) => Some(result),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => {
                Some(Err(format!("{} stopped inside the program; the same command on a terminal says more", self.what)))
            }
        }
    }

    /// Shows how far it is. True when the person cancels.
    pub fn ui(&self, ui: &mut Ui) -> bool {
        // The work runs elsewhere: look at it a few times a second.
        ui.ctx().request_repaint_after(Duration::from_millis(100));
        line(ui, |ui| {
            let cancelled = ui.button("Cancel").on_hover_text("Stop; what is open stays").clicked();
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                let fraction = self.progress.fraction();
                ui.label(&self.what);
                // What is still to do must show on the empty window, too.
                ui.visuals_mut().extreme_bg_color = ui.visuals().widgets.inactive.weak_bg_fill;
                let bar = ProgressBar::new(fraction).text(self.progress.text() + &left(self.since.elapsed(), fraction));
                ui.add(bar).accessible_name("Progress");
            });
            cancelled
        })
    }
}

/// Shows work that is under way, and drops it where the person cancels; whether there is any.
pub fn is_at_work<T: Send + 'static>(job: &mut Option<Job<T>>, ui: &mut Ui) -> bool {
    let Some(at_work) = job else { return false };
    if at_work.ui(ui) {
        *job = None;
    }
    true
}

/// How long the rest takes if it goes on as before; nothing while that is a guess.
fn left(elapsed: Duration, fraction: f32) -> String {
    if elapsed < KNOWN.0 || fraction < KNOWN.1 {
        return String::new();
    }
    let seconds = (elapsed.as_secs_f32() * (1.0 / fraction.min(1.0) - 1.0)).ceil();
    if seconds < 100.0 { format!(", {seconds:.0} s left") } else { format!(", {:.0} min left", (seconds / 60.0).ceil()) }
}

impl<T> Drop for Job<T> {
    fn drop(&mut self) {
        self.progress.cancel();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rest_is_told_once_it_is_known() {
        // Fails if a bar promises a time that is a guess, or counts seconds where minutes are meant.
        let of = |seconds: u64, fraction: f32| left(Duration::from_secs(seconds), fraction);
        assert_eq!([of(0, 0.5), of(9, 0.01)], ["", ""]);
        assert_eq!([of(10, 0.5), of(10, 0.05), of(10, 1.0)], [", 10 s left", ", 4 min left", ", 0 s left"]);
    }
}
