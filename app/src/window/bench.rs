//! What the picture, the panels and the menus work on.

use super::files::{Dialog, Pick};
use super::history::History;
use super::loading::Loading;
use super::measured::{Measured, Work};
use super::notices::Notices;
use super::picture::cast::Found;
use super::picture::painter::Painter;
use super::picture::view::View;
use bregma_measure::DifferenceRay;
use bregma_session::save::SaveError;
use bregma_session::{Opened, Source};
use egui::Context;
use std::path::{Path, PathBuf};

/// What is done with the files that a person chose.
type Then = Box<dyn FnOnce(&mut Bench, &Context, Vec<PathBuf>)>;

/// The workbench of the window.
pub struct Bench {
    /// Scans, layers, view, rays and landmarks.
    pub work: Work,
    /// Its earlier and later states.
    pub history: History,
    /// What its rays meet.
    pub found: Vec<Found>,
    /// Where the mouse is along the selected ray, mm.
    pub hovered_mm: Option<f64>,
    /// The picture on the screen.
    pub view: View,
    /// What draws it.
    pub painter: Painter,
    /// Scans on their way in.
    pub loading: Option<Loading>,
    /// What the person should know.
    pub notices: Notices,
    dialog: Option<Dialog<Then>>,
}

impl Bench {
    /// With nothing open yet but what is `loading`.
    pub fn new(ctx: &Context, loading: Option<Loading>) -> Self {
        let work = Work { opened: Opened::new(vec![], vec![]), measured: Measured::default() };
        Self {
            history: History::new(&work),
            work,
            found: vec![],
            hovered_mm: None,
            view: View::default(),
            painter: Painter::new(ctx),
            loading,
            notices: Notices::default(),
            dialog: None,
        }
    }

    /// No scan is open.
    pub fn is_empty(&self) -> bool {
        self.work.opened.volumes.is_empty()
    }

    /// Nobody is asked for a file.
    pub fn can_ask(&self) -> bool {
        self.dialog.is_none()
    }

    /// The difference rays that were found.
    pub fn rays(&self) -> Vec<DifferenceRay> {
        self.found.iter().map(|found| found.ray.clone()).collect()
    }

    /// Asks for files, unless something is asked already; then does `then` with them.
    pub fn ask(&mut self, ctx: &Context, pick: Pick, then: impl FnOnce(&mut Self, &Context, Vec<PathBuf>) + 'static) {
        if self.can_ask() {
            self.dialog = Some(Dialog::open(ctx, pick, Box::new(then)));
        }
    }

    /// Asks where to save, then has it written there and says so.
    pub fn save(&mut self, ctx: &Context, pick: Pick, write: impl FnOnce(&Self, &Path) -> Result<(), SaveError> + 'static) {
        self.ask(ctx, pick, |bench, _, files| match write(bench, &files[0]) {
            Ok(()) => bench.notices.note(format!("Saved {}", files[0].display())),
            Err(error) => bench.notices.error(error.to_string()),
        });
    }

    /// Begins to read scans, which take the place of what is open unless they are added.
    pub fn load(&mut self, ctx: &Context, paths: Vec<PathBuf>, adds: bool) {
        if self.loading.is_some() {
            self.notices.error("Other scans are still loading: wait for them or cancel, then open these again.");
            return;
        }
        let sources = paths.into_iter().map(|file| Source { file, ..Source::default() }).collect();
        self.loading = Some(Loading::files(ctx, sources, adds));
    }

    /// Takes what the threads brought.
    pub fn collect(&mut self, ctx: &Context) {
        let loaded = self.loading.as_mut().and_then(|l| l.poll().map(|result| (result, l.adds)));
        if let Some((result, adds)) = loaded {
            self.loading = None;
            match result {
                Ok(opened) => self.receive(opened, adds),
                Err(text) => self.notices.error(text),
            }
        }
        match self.dialog.take().map(Dialog::poll) {
            Some(Ok(Ok((then, paths)))) if !paths.is_empty() => then(self, ctx, paths),
            Some(Ok(Ok(_))) | None => {}
            Some(Ok(Err(text))) => self.notices.error(text),
            Some(Err(open)) => self.dialog = Some(open),
        }
        match self.painter.poll() {
            Some(Ok(painted)) => self.view.take(ctx, painted),
            Some(Err(text)) => self.notices.error(text),
            None => {}
        }
        if let Some(text) = self.painter.notice() {
            self.notices.error(text);
        }
        let dropped = ctx.input(|i| i.raw.dropped_files.iter().map(|f| f.path().to_owned()).collect::<Vec<_>>());
        if !dropped.is_empty() {
            self.load(ctx, dropped, true);
        }
    }

    fn receive(&mut self, mut opened: Opened, adds: bool) {
        if adds && !self.is_empty() {
            self.work.measured.landmarks.append(&mut opened.landmarks);
            self.work.opened.add(opened);
            return;
        }
        let measured = Measured::of(&mut opened);
        self.work = Work { opened, measured };
        // What was found in other scans is not found in these.
        self.found.clear();
        self.view.forget_first_point();
        // Undo does not lead back into scans that were closed, so that their memory is free.
        self.history = History::new(&self.work);
    }

    /// Measures again along rays for which something changed that they depend on.
    pub fn measure(&mut self) {
        match Found::refresh(std::mem::take(&mut self.found), &self.work) {
            Ok(found) => self.found = found,
            Err(text) => self.notices.error(text),
        }
        self.hovered_mm = None;
    }
}
