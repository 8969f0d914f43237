//! A file that a panel makes: where to is asked for, then it is made beside the window.

use super::super::ask::Ask;
use super::super::bench::Bench;
use super::super::job::{Job, is_at_work};
use super::super::words::in_the_window;
use bregma_field::Progress;
use egui::{Button, Context, Ui};
use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// A file on its way.
#[derive(Default)]
pub struct Saving {
    /// Where to, once the person has said so.
    chosen: Rc<RefCell<Option<PathBuf>>>,
    job: Option<Job<PathBuf>>,
}

impl Saving {
    /// Takes what the thread brought; `Err` is a sentence for the person.
    pub fn poll(&mut self, bench: &mut Bench) -> Result<(), String> {
        let Some(result) = self.job.as_ref().and_then(Job::poll) else { return Ok(()) };
        self.job = None;
        let file = result.map_err(|e| in_the_window(&e))?;
        bench.messages.note(format!("Saved {}", file.display()));
        Ok(())
    }

    /// Where to, in the frame in which the person has said so.
    pub fn chosen(&self) -> Option<PathBuf> {
        self.chosen.borrow_mut().take()
    }

    /// Makes the file on a thread of its own.
    pub fn start(
        &mut self,
        ctx: &Context,
        what: &str,
        file: PathBuf,
        make: impl FnOnce(&Path, &Progress) -> Result<(), String> + Send + 'static,
    ) {
        self.job = Some(Job::start(ctx, what.into(), move |progress| make(&file, progress).map(|()| file)));
    }

    /// Shows how far the file is, where one is made; whether one is.
    pub fn is_at_work(&mut self, ui: &mut Ui) -> bool {
        is_at_work(&mut self.job, ui)
    }

    /// The button that asks where to, in a form that `check` knows by the name.
    pub fn button(
        &self,
        ui: &mut Ui,
        bench: &mut Bench,
        can: bool,
        (name, hint): (&str, &str),
        ask: Ask,
        check: fn(&Path) -> Result<(), String>,
    ) {
        if !ui.add_enabled(can && bench.can_ask(), Button::new(name)).on_hover_text(hint).clicked() {
            return;
        }
        let chosen = Rc::clone(&self.chosen);
        bench.ask(ui.ctx(), ask, move |bench, _, files| match files.first().map(|file| (file, check(file))) {
            Some((file, Ok(()))) => *chosen.borrow_mut() = Some(file.clone()),
            Some((_, Err(error))) => bench.messages.error(error),
            None => {}
        });
    }
}
