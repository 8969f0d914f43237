//! The system's file dialogs, which run beside the window.

use egui::Context;
use rfd::FileDialog;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::{Duration, Instant};

/// Shows a dialog and waits for what is chosen; `None` where it was cancelled.
pub type Pick = fn(FileDialog) -> Option<Vec<PathBuf>>;

/// A dialog on the screen, and what shall be done with what is chosen.
#[derive(Debug)]
pub struct Dialog<T> {
    then: T,
    since: Instant,
    answer: Receiver<Option<Vec<PathBuf>>>,
}

/// No person cancels a dialog so fast: it never appeared.
const TOO_FAST: Duration = Duration::from_millis(300);

impl<T> Dialog<T> {
    /// Opens it.
    pub fn open(ctx: &Context, pick: Pick, then: T) -> Self {
        let (send, answer) = channel();
        let ctx = ctx.clone();
        std::thread::spawn(move || {
            // The window may have closed meanwhile.
            let _ = send.send(pick(FileDialog::new()));
            ctx.request_repaint();
        });
        Self { then, since: Instant::now(), answer }
    }

    /// What was chosen and what shall be done with it, no paths when it was cancelled; or why it could not be shown; or the dialog, which is
    /// open still.
    pub fn poll(self) -> Result<Result<(T, Vec<PathBuf>), &'static str>, Self> {
        let answer = match self.answer.try_recv() {
            Ok(answer) => answer,
            Err(TryRecvError::Empty) => return Err(self),
            Err(TryRecvError::Disconnected) => None,
        };
        Ok(match answer {
            None if self.since.elapsed() < TOO_FAST => Err(
                "This desktop shows no file dialog (it has no portal and no zenity): drop files on the window, or name them on the command line.",
            ),
            picked => Ok((self.then, picked.unwrap_or_default())),
        })
    }
}
