//! Asking for files: by the system's dialog, which runs beside the window, or where the system has none, by a line to type into.

use super::ask::{Ask, Kind};
use super::path_prompt::PathPrompt;
use egui::Context;
use rfd::FileDialog;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::{Duration, Instant};

/// The system's dialog; nothing where it was cancelled, or there is none.
fn by_dialog(ask: &Ask) -> Option<Vec<PathBuf>> {
    let dialog = FileDialog::new().set_title(ask.title);
    let dialog = ask.forms.iter().fold(dialog, |dialog, (form, endings)| dialog.add_filter(*form, endings));
    match ask.kind {
        Kind::Files => dialog.pick_files(),
        Kind::Folders => dialog.pick_folders(),
        Kind::Save => dialog.set_file_name(ask.name).save_file().map(|file| vec![file]),
    }
}

/// A question for files on the screen, and what shall be done with what is chosen.
pub struct Asking<T> {
    then: T,
    by: By,
}

enum By {
    Dialog(Box<Dialog>),
    Prompt(Box<PathPrompt>),
}

struct Dialog {
    ask: Ask,
    since: Instant,
    answer: Receiver<Option<Vec<PathBuf>>>,
    /// The window had the keyboard when it was opened, and has had it ever since.
    was_focused: bool,
    stayed_focused: bool,
}

/// No person cancels a dialog so fast: it never appeared.
const TOO_FAST: Duration = Duration::from_millis(1500);

impl<T> Asking<T> {
    /// Opens the dialog.
    pub fn open(ctx: &Context, ask: Ask, then: T) -> Self {
        let (send, answer) = channel();
        let (theirs, asked) = (ctx.clone(), ask.clone());
        std::thread::spawn(move || {
            // The window may have closed meanwhile.
            let _ = send.send(by_dialog(&asked));
            theirs.request_repaint();
        });
        let focused = ctx.input(|i| i.focused);
        let dialog = Dialog { ask, since: Instant::now(), answer, was_focused: focused, stayed_focused: focused };
        Self { then, by: By::Dialog(Box::new(dialog)) }
    }

    /// What was chosen, none when it was cancelled, with what shall be done with it; or the question, which is open still. Shows the line to
    /// type into where no dialog could be shown.
    pub fn poll(mut self, ctx: &Context) -> Result<(T, Vec<PathBuf>), Self> {
        match &mut self.by {
            By::Prompt(prompt) => match prompt.show(ctx) {
                Some(paths) => Ok((self.then, paths)),
                None => Err(self),
            },
            By::Dialog(dialog) => {
                dialog.stayed_focused &= ctx.input(|i| i.focused);
                let answer = match dialog.answer.try_recv() {
                    Ok(answer) => answer,
                    Err(TryRecvError::Empty) => return Err(self),
                    Err(TryRecvError::Disconnected) => None,
                };
                if answer.is_none() && !dialog.appeared() {
                    self.by = By::Prompt(Box::new(PathPrompt::new(dialog.ask.clone())));
                    return Err(self);
                }
                Ok((self.then, answer.unwrap_or_default()))
            }
        }
    }
}

impl Dialog {
    /// A dialog takes the keyboard from the window; where nothing says who has it, only time tells.
    fn appeared(&self) -> bool {
        if self.was_focused { !self.stayed_focused } else { self.since.elapsed() >= TOO_FAST }
    }
}
