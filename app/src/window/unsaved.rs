//! Unsaved work: how it is saved, and what is asked before something else takes its place.

use super::ask::{Ask, Kind};
use super::bench::Bench;
use super::document::{Document, Next, session};
use bregma_field::Progress;
use egui::{Context, Id, Modal, ViewportCommand};
use std::path::{Path, PathBuf};

/// Where a session is saved.
const SAVE: Ask = Ask { title: "Save the session", kind: Kind::Save, forms: &[("Bregma session", &["json"])], name: "session.json" };

impl Bench {
    /// Puts `next` in the place of the work, once the person agrees to lose what is unsaved.
    pub fn replace(&mut self, ctx: &Context, next: Next) {
        if self.document.is_saved(&self.work) {
            self.go_on(ctx, next);
        } else {
            self.question = Some(next);
        }
    }

    fn go_on(&mut self, ctx: &Context, next: Next) {
        match next {
            Next::Files(paths) => self.load(ctx, paths),
            Next::Demo => self.load_demo(ctx),
            Next::Quit => {
                self.may_close = true;
                ctx.send_viewport_cmd(ViewportCommand::Close);
            }
        }
    }

    /// Keeps the window open where closing it would lose work, and asks.
    pub fn guard_closing(&mut self, ctx: &Context) {
        if ctx.input(|i| i.viewport().close_requested()) && !self.may_close && !self.document.is_saved(&self.work) {
            ctx.send_viewport_cmd(ViewportCommand::CancelClose);
            self.question = Some(Next::Quit);
        }
    }

    /// Shows the question about unsaved work, where it is asked.
    pub fn ask_about_unsaved(&mut self, ctx: &Context) {
        let Some(next) = self.question.take() else { return };
        let mut answer = None;
        let shown = Modal::new(Id::unique("unsaved")).show(ctx, |ui| {
            ui.set_max_width(380.0);
            ui.heading("Save the work?");
            ui.label(format!("{} has changes that are not saved.", self.document.name(&self.work)));
            ui.horizontal(|ui| {
                for (n, text) in ["Save", "Don't save", "Cancel"].into_iter().enumerate() {
                    if ui.button(text).clicked() {
                        answer = Some(n);
                    }
                }
            });
        });
        match answer {
            Some(0) => self.save_session_then(ctx, false, Some(next)),
            Some(1) => self.go_on(ctx, next),
            Some(_) => {}
            None if shown.should_close() => {}
            None => self.question = Some(next),
        }
    }

    /// Writes the session to its file, or asks for one where it has none, or `elsewhere` is wanted.
    pub fn save_session(&mut self, ctx: &Context, elsewhere: bool) {
        self.save_session_then(ctx, elsewhere, None);
    }

    fn save_session_then(&mut self, ctx: &Context, elsewhere: bool, next: Option<Next>) {
        match self.document.file.clone().filter(|_| !elsewhere) {
            Some(file) => self.write_session(ctx, file, next),
            None => {
                self.ask(ctx, SAVE, move |bench, ctx, files| bench.write_session(ctx, files[0].clone(), next));
            }
        }
    }

    fn write_session(&mut self, ctx: &Context, file: PathBuf, next: Option<Next>) {
        let mut written = vec![];
        if let Err(error) = self.work.opened.write_labels(&file, &mut written, &Progress::default()) {
            self.messages.error(error.to_string());
            return;
        }
        // What undo brings back is in the same files.
        self.work.opened.name_labels(&written);
        self.history.change_all(|work| work.opened.name_labels(&written));
        let folder = file.parent().unwrap_or(Path::new(""));
        match session(&self.work, folder, self.records()).write(&file) {
            Ok(()) => {
                self.messages.note(format!("Saved {}", file.display()));
                self.remembered.opened(std::slice::from_ref(&file));
                self.document = Document::new(Some(file), &self.work);
                next.into_iter().for_each(|next| self.go_on(ctx, next));
            }
            Err(error) => self.messages.error(error.to_string()),
        }
    }
}
