//! What the picture, the panels and the menus work on.

use super::ask::Ask;
use super::document::{Document, Next};
use super::files::Asking;
use super::history::History;
use super::loading::Loading;
use super::measured::{Measured, Work};
use super::messages::Messages;
use super::picture::cast::Found;
use super::picture::painter::Painter;
use super::picture::slice_views::SliceViews;
use super::picture::view::View;
use super::playing::{Playing, Taking};
use super::recovery::{Kept, Recovery};
use super::remembered::Remembered;
use super::stage::Stage;
use super::words::in_the_window;
use bregma_session::register::apart;
use bregma_session::{Compare, Kind, Measurement, Opened, Origin, Source};
use egui::{Context, Id, Modal};
use glam::DVec3;
use std::fmt::Display;
use std::path::{Path, PathBuf};

/// What is done with the files that a person chose.
type Then = Box<dyn FnOnce(&mut Bench, &Context, Vec<PathBuf>)>;

/// The command that registers scans that lie apart.
pub const BRING_TOGETHER: &str = "Bring scans together";

/// From this width of the window on, in points, two scans open beside each other.
const WIDE: f32 = 2000.0;

/// The workbench of the window.
pub struct Bench {
    /// Scans, layers, view, rays and landmarks.
    pub work: Work,
    /// Its earlier and later states.
    pub history: History,
    /// The session that it belongs to.
    pub document: Document,
    /// What it would be recovered from.
    pub recovery: Recovery,
    /// What earlier runs left behind, while it is offered.
    pub left_behind: Vec<Kept>,
    /// What the window remembers from one run to the next.
    pub remembered: Remembered,
    /// What its rays meet.
    pub found: Vec<Found>,
    /// Where the mouse is along the selected ray, mm.
    pub hovered_mm: Option<f64>,
    /// The picture on the screen.
    pub view: View,
    /// What draws it.
    pub painter: Painter,
    /// The slices on the screen.
    pub slices: SliceViews,
    /// What is on the whole screen.
    pub stage: Stage,
    /// The film that plays in the view.
    pub playing: Option<Playing>,
    /// What is recorded.
    pub taking: Option<Taking>,
    /// The point of the world under the mouse, in any view.
    pub under_mm: Option<DVec3>,
    /// Scans on their way in.
    pub loading: Option<Loading>,
    /// What is open was made coarse, and is made finer once it is seen.
    pub is_coarse: bool,
    /// What the person should know.
    pub messages: Messages,
    /// What would take the place of unsaved work, while the person is asked.
    pub question: Option<Next>,
    /// The person agreed to close the window.
    pub may_close: bool,
    asking: Option<Asking<Then>>,
}

impl Bench {
    /// With nothing open yet but what is `loading`; `state` is the folder that is written to between runs.
    pub fn new(ctx: &Context, loading: Option<Loading>, state: Option<PathBuf>) -> Self {
        let work = Work { opened: Opened::new(vec![], vec![]), measured: Measured::default() };
        let (remembered, recovery) = (Remembered::read(state.as_deref()), Recovery::new(state));
        Self {
            history: History::new(&work),
            document: Document::new(None, &work),
            left_behind: recovery.left_behind(),
            recovery,
            remembered,
            work,
            found: vec![],
            hovered_mm: None,
            view: View::default(),
            painter: Painter::new(ctx),
            slices: SliceViews::default(),
            stage: Stage::default(),
            playing: None,
            taking: None,
            under_mm: None,
            loading,
            is_coarse: false,
            messages: Messages::default(),
            question: None,
            may_close: false,
            asking: None,
        }
    }

    /// No scan is open.
    pub fn is_empty(&self) -> bool {
        self.work.opened.volumes.is_empty()
    }

    /// Scans are on their way that others would be in the way of.
    pub fn is_busy(&self) -> bool {
        self.loading.as_ref().is_some_and(|loading| !loading.refines)
    }

    /// Nobody is asked for a file.
    pub fn can_ask(&self) -> bool {
        self.asking.is_none()
    }

    /// What was measured, with what it was measured on.
    pub fn records(&self) -> Vec<Measurement> {
        self.work.records(self.found.iter().map(|found| &found.ray), Origin::of(&self.work.opened).as_ref())
    }

    /// Asks for files, unless something is asked already; then does `then` with them.
    pub fn ask(&mut self, ctx: &Context, ask: Ask, then: impl FnOnce(&mut Self, &Context, Vec<PathBuf>) + 'static) {
        if self.can_ask() {
            self.asking = Some(Asking::open(ctx, ask, Box::new(then)));
        }
    }

    /// Asks where to save, then has it written there and says so.
    pub fn save<E: Display>(&mut self, ctx: &Context, ask: Ask, write: impl FnOnce(&Self, &Path) -> Result<(), E> + 'static) {
        self.ask(ctx, ask, |bench, _, files| match write(bench, &files[0]) {
            Ok(()) => bench.messages.note(format!("Saved {}", files[0].display())),
            Err(error) => bench.messages.error(error.to_string()),
        });
    }

    /// Begins to read scans and landmarks that join what is open, and moves scans as registrations among the files say.
    pub fn add(&mut self, ctx: &Context, paths: Vec<PathBuf>) {
        let is_registration = |source: &Source| !self.is_empty() && Kind::of(source) == Kind::Registration;
        let (registrations, others): (Vec<_>, Vec<_>) = sources(paths).into_iter().partition(is_registration);
        for registration in registrations {
            match self.work.move_by(&registration.file) {
                Ok(scan) => self.messages.note(format!("{scan} was moved as {} says", registration.name())),
                Err(error) => self.messages.error(error.to_string()),
            }
        }
        if !others.is_empty() {
            self.read(|ctx| Loading::files(ctx, others, true), ctx);
        }
    }

    /// Begins to read scans or a session that take the place of what is open.
    pub fn load(&mut self, ctx: &Context, paths: Vec<PathBuf>) {
        self.read(|ctx| Loading::files(ctx, sources(paths), false), ctx);
    }

    /// Begins to make the built-in pair.
    pub fn load_demo(&mut self, ctx: &Context) {
        self.read(Loading::demo, ctx);
    }

    /// Begins to read what an earlier run left behind.
    pub fn recover(&mut self, ctx: &Context, kept: Kept) {
        self.read(|ctx| Loading::recovery(ctx, kept), ctx);
    }

    fn read(&mut self, begin: impl FnOnce(&Context) -> Loading, ctx: &Context) {
        if self.is_busy() {
            self.messages.error("Other scans are still loading: wait for them or cancel, then open these again.");
        } else {
            self.loading = Some(begin(ctx));
        }
    }

    /// Takes what the threads brought.
    pub fn collect(&mut self, ctx: &Context) {
        if let Some(result) = self.loading.as_mut().and_then(Loading::poll) {
            match result {
                Ok((opened, errors)) => {
                    errors.into_iter().for_each(|text| self.messages.error(text));
                    self.receive(ctx, opened);
                }
                Err(text) => {
                    self.loading = None;
                    self.messages.error(text);
                }
            }
        }
        if self.is_coarse && self.loading.is_none() && self.painter.is_settled() {
            self.is_coarse = false;
            self.loading = Some(Loading::finer_demo(ctx));
        }
        match self.asking.take().map(|asking| asking.poll(ctx)) {
            Some(Ok((then, paths))) if !paths.is_empty() => then(self, ctx, paths),
            Some(Ok(_)) | None => {}
            Some(Err(open)) => self.asking = Some(open),
        }
        match self.painter.poll() {
            Some(Ok(painted)) => self.view.take(ctx, painted).into_iter().for_each(|old| self.painter.give_back(old)),
            Some(Err(text)) => self.messages.error(text),
            None => {}
        }
        match self.painter.poll_light() {
            Some(Ok(round)) => self.view.light(ctx, round),
            Some(Err(text)) => self.messages.error(in_the_window(&text)),
            None => {}
        }
        self.slices.poll(ctx).into_iter().for_each(|text| self.messages.error(text));
        if let Some(text) = self.painter.notice() {
            self.messages.error(text);
        }
        let dropped = ctx.input(|i| i.raw.dropped_files.iter().map(|f| f.path().to_owned()).collect::<Vec<_>>());
        if !dropped.is_empty() {
            self.add(ctx, dropped);
        }
    }

    fn receive(&mut self, ctx: &Context, mut opened: Opened) {
        let Some(loading) = self.loading.take() else { return };
        if loading.refines {
            self.refine(&opened);
            return;
        }
        self.remembered.opened(&loading.named);
        if loading.adds && !self.is_empty() {
            self.work.measured.landmarks.append(&mut opened.landmarks);
            self.work.opened.add(opened);
            self.tell_apart();
            return;
        }
        if opened.volumes.is_empty() {
            self.messages.error("There is no scan among these files: open the scan that they belong to first.");
            return;
        }
        if !opened.from_session {
            self.remembered.preferences.apply(&mut opened.scene, &opened.volumes);
        }
        opened.first_look(self.view.aspect());
        // A wide screen has room for two views.
        if !opened.from_session && opened.volumes.len() == 2 && ctx.content_rect().width() > WIDE {
            opened.compare = Compare::SideBySide;
        }
        let (measured, is_new) = (Measured::of(&mut opened), !opened.from_session);
        if let Some(kept) = &loading.recovered {
            kept.release(&mut opened);
        }
        self.work = Work { opened, measured };
        if is_new {
            self.tell_apart();
        }
        self.view.forget_first_point();
        self.document = Document::new(loading.session, &self.work);
        if let Some(kept) = loading.recovered {
            // It is as unsaved as it was.
            let nothing = Work { opened: Opened::new(vec![], vec![]), measured: Measured::default() };
            self.document = Document::new(kept.belongs_to(), &nothing);
            self.recovery.go_on_from(kept);
        }
        self.is_coarse = loading.then_finer;
    }

    /// Says where scans lie so far apart that they cannot be compared.
    fn tell_apart(&mut self) {
        if let Some([a, b]) = apart(&self.work.opened).map(|pair| pair.map(|n| self.work.opened.volumes[n].name())) {
            self.messages.offer(format!("{a} and {b} lie apart from each other: so they cannot be compared."), BRING_TOGETHER);
        }
    }

    /// Puts finer scans in the places of the coarse ones, now and wherever undo leads.
    fn refine(&mut self, finer: &Opened) {
        let refine = |work: &mut Work| {
            let opened = &mut work.opened;
            for ((source, volume), layer) in opened.sources.iter_mut().zip(&mut opened.volumes).zip(&mut opened.scene.layers) {
                let same = |fine: &Source| fine.built_in.is_some() && source.built_in.is_some() && fine.file == source.file;
                if let Some(n) = finer.sources.iter().position(same) {
                    // It stays as it is called and turned.
                    let finer_source = Source { called: source.called.clone(), turn: source.turn, ..finer.sources[n].clone() };
                    (*volume, *source) = (finer_source.dress(&finer.volumes[n]), finer_source);
                    // Its parts were those of the coarse samples.
                    layer.within = None;
                }
            }
        };
        refine(&mut self.work);
        self.history.change_all(refine);
        self.document.change(refine);
    }

    /// Offers what earlier runs left behind, one after the other.
    pub fn offer_left_behind(&mut self, ctx: &Context) {
        let Some(first) = self.left_behind.first() else { return };
        let mut answer = None;
        Modal::new(Id::unique("left behind")).show(ctx, |ui| {
            ui.set_max_width(420.0);
            ui.heading("Work that was not saved");
            ui.label(first.what());
            ui.label("The program ended before it was saved.");
            ui.horizontal(|ui| {
                for (n, text) in ["Open it", "Ask again later", "Discard it"].into_iter().enumerate() {
                    if ui.button(text).clicked() {
                        answer = Some(n);
                    }
                }
            });
        });
        let Some(answer) = answer else { return };
        let first = self.left_behind.remove(0);
        match answer {
            0 => {
                self.loading = None;
                self.recover(ctx, first);
            }
            1 => {}
            _ => first.discard(),
        }
    }

    /// Keeps the work for the case that the program ends.
    pub fn keep(&mut self, ctx: &Context) {
        if self.found.len() != self.work.measured.rays.len() {
            // What was cast in this frame.
            self.measure();
        }
        if self.found.len() != self.work.measured.rays.len() {
            // What cannot be measured was said, and what is kept stays.
            return;
        }
        let is_saved = self.document.is_saved(&self.work);
        let (work, found, file) = (&self.work, &self.found, self.document.file.as_deref());
        // What it was measured on is left out: all samples would be read through for it.
        let records = || work.records(found.iter().map(|found| &found.ray), None);
        self.recovery.keep(ctx, work, is_saved, file, records);
    }

    /// Measures again along rays for which something changed that they depend on.
    pub fn measure(&mut self) {
        match Found::refresh(std::mem::take(&mut self.found), &self.work) {
            Ok(found) => self.found = found,
            Err(text) => self.messages.error(text),
        }
        self.hovered_mm = None;
    }
}

fn sources(paths: Vec<PathBuf>) -> Vec<Source> {
    paths.into_iter().map(|file| Source { file, ..Source::default() }).collect()
}
