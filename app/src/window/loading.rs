//! Scans on their way in, and what has to be asked before they can be read.

use super::headerless::Headerless;
use super::job::Job;
use super::recovery::Kept;
use super::series::Choice;
use super::widgets::line;
use super::words::in_the_window;
use bregma_field::Progress;
use bregma_field::formats::{OpenError, ReadError, Reduce, Uneven};
use bregma_session::{DEMO_SIZE, InputError, Kind, Opened, Source, without_spacing};
use egui::{Align2, Area, Context, DragValue, Frame, Id, Order, Rect, Ui, vec2};
use glam::DVec3;
use std::path::PathBuf;

/// Scans on their way in. Dropping it stops the reading.
#[derive(Debug)]
pub struct Loading {
    state: State,
    /// The scans join those that are open, instead of taking their place.
    pub adds: bool,
    /// What is made is coarse, and is made again finer.
    pub then_finer: bool,
    /// The scans are finer ones of those that are open, and take their places.
    pub refines: bool,
    /// What the person named, to be named again by a click.
    pub named: Vec<PathBuf>,
    /// The session that is read.
    pub session: Option<PathBuf>,
    /// What an earlier run left behind, which is read.
    pub recovered: Option<Kept>,
}

#[derive(Debug)]
enum State {
    Reading(Job<Read>),
    Asking(Question),
}

/// What a reading ends in.
#[derive(Debug)]
enum Read {
    /// With sentences about what did not open.
    Opened(Box<Opened>, Vec<String>),
    Ask(Question),
}

/// Something that only the person knows about scan number `of`.
#[derive(Debug)]
struct Question {
    sources: Vec<Source>,
    of: usize,
    about: About,
}

#[derive(Debug)]
enum About {
    /// Its samples' distances, mm; 0 until they are given.
    Spacing(DVec3),
    /// How its samples lie: nothing says so.
    Headerless(Headerless),
    /// It does not fit; this preview would.
    Preview(Reduce, String),
    /// Which of its series is read.
    Series(Choice),
    /// Its slices are not even; the sentence lists the gaps.
    Uneven(String),
}

/// Samples along the longest side of the pair that is shown first: made in a third of a second, and fine enough for the first view to fit the
/// bone, whose place is known by blocks of eight samples.
const COARSE_SIZE: usize = 96;

impl Loading {
    /// Makes the built-in pair, coarse, so that there is something to see at once.
    pub fn demo(ctx: &Context) -> Self {
        Self { then_finer: true, ..Self::making(ctx, COARSE_SIZE, 0) }
    }

    /// Makes it as fine as it is, on half of the cores: the others go on drawing the coarse one.
    pub fn finer_demo(ctx: &Context) -> Self {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        Self { refines: true, ..Self::making(ctx, DEMO_SIZE, cores.div_ceil(2)) }
    }

    /// On so many cores; all of them with 0.
    fn making(ctx: &Context, size: usize, cores: usize) -> Self {
        let make = move |progress: &_| -> Result<Read, InputError> {
            // A pool that cannot be had is no reason to show nothing.
            let opened = match rayon::ThreadPoolBuilder::new().num_threads(cores).build() {
                Ok(pool) => pool.install(|| Opened::demo(size, progress))?,
                Err(_) => Opened::demo(size, progress)?,
            };
            Ok(Read::Opened(Box::new(opened), vec![]))
        };
        Self::of(State::Reading(Job::start(ctx, "Making the demo pair".into(), make)))
    }

    fn of(state: State) -> Self {
        Self { state, adds: false, then_finer: false, refines: false, named: vec![], session: None, recovered: None }
    }

    /// Reads scans or a session.
    pub fn files(ctx: &Context, sources: Vec<Source>, adds: bool) -> Self {
        let named = sources.iter().map(|source| source.file.clone()).collect();
        // A session brings its own scene, which replaces what is open.
        let session = match &sources[..] {
            [only] if Kind::of(only) == Kind::Session => Some(only.file.clone()),
            _ => None,
        };
        Self { adds: adds && session.is_none(), named, session, ..Self::of(State::reading(ctx, sources)) }
    }

    /// Reads what an earlier run left behind.
    pub fn recovery(ctx: &Context, kept: Kept) -> Self {
        let source = Source { file: kept.file.clone(), ..Source::default() };
        Self { recovered: Some(kept), ..Self::of(State::reading(ctx, vec![source])) }
    }

    /// What opened, with a sentence about each file that did not, or one about why nothing did; `None` while at work or waiting for an answer.
    pub fn poll(&mut self) -> Option<Result<(Opened, Vec<String>), String>> {
        let State::Reading(job) = &self.state else { return None };
        match job.poll()? {
            Ok(Read::Opened(opened, errors)) => Some(Ok((*opened, errors))),
            Ok(Read::Ask(question)) => {
                self.state = State::Asking(question);
                None
            }
            Err(text) => Some(Err(text)),
        }
    }

    /// Shows how far it is over the lower left of the picture at `place`, or what it has to know in its middle. True when the person cancels.
    pub fn show(&mut self, ctx: &Context, place: Rect) -> bool {
        let asks = matches!(self.state, State::Asking(_));
        let (pivot, at) =
            if asks { (Align2::CENTER_CENTER, place.center()) } else { (Align2::LEFT_BOTTOM, place.left_bottom() + vec2(10.0, -10.0)) };
        let area = Area::new(Id::unique(("loading", asks))).order(Order::Foreground).pivot(pivot).fixed_pos(at);
        let shown = area.show(ctx, |ui| {
            Frame::popup(ui.style()).show(ui, |ui| {
                ui.set_width((place.width() - 40.0).clamp(160.0, 440.0));
                self.ui(ui)
            })
        });
        shown.inner.inner
    }

    fn ui(&mut self, ui: &mut Ui) -> bool {
        match &mut self.state {
            State::Reading(job) => job.ui(ui),
            State::Asking(question) => match question.ui(ui) {
                Answer::None => false,
                Answer::Cancel => true,
                Answer::Read => {
                    let sources = std::mem::take(&mut question.sources);
                    self.state = State::reading(ui.ctx(), sources);
                    false
                }
            },
        }
    }
}

impl State {
    fn reading(ctx: &Context, sources: Vec<Source>) -> Self {
        let names: Vec<_> = sources.iter().map(|s| s.file.file_name().unwrap_or(s.file.as_os_str()).to_string_lossy()).collect();
        let what = match &names[..] {
            [first, _, _, ..] => format!("Reading {first} and {} more", names.len() - 1),
            few => format!("Reading {}", few.join(" and ")),
        };
        Self::Reading(Job::start(ctx, what, move |progress| read(sources, progress)))
    }
}

/// Reads scans, unless something has to be asked first.
fn read(sources: Vec<Source>, progress: &Progress) -> Result<Read, InputError> {
    if let Some((of, choice)) = Choice::among(&sources, progress) {
        return Ok(Read::Ask(Question { sources, of, about: About::Series(choice) }));
    }
    if let Some(of) = without_spacing(&sources, progress)? {
        return Ok(Read::Ask(Question { sources, of, about: About::Spacing(DVec3::ZERO) }));
    }
    let (opened, errors) = match Opened::read_what_opens(&sources, progress) {
        Ok((opened, errors)) => (Some(opened), errors),
        Err(error) => (None, vec![error]),
    };
    let asked = errors.iter().find_map(|error| {
        let InputError::Scan(error) = error else { return None };
        let of = sources.iter().position(|source| source.file == error.file)?;
        Some((of, question(error, &sources[of], sources.len() == 1, progress)?))
    });
    match (asked, opened) {
        (Some((of, about)), _) => Ok(Read::Ask(Question { sources, of, about })),
        (None, Some(opened)) => Ok(Read::Opened(Box::new(opened), errors.iter().map(InputError::to_string).collect())),
        (None, None) => Err(errors.into_iter().next().unwrap_or(InputError::NoScan(PathBuf::new()))),
    }
}

/// What another reading of the same file could do, where it could do something.
fn question(error: &OpenError, source: &Source, is_alone: bool, progress: &Progress) -> Option<About> {
    let is_raw = source.file.extension().is_some_and(|e| e.eq_ignore_ascii_case("raw"));
    match &error.reason {
        ReadError::NoLayout => Headerless::guess(source, progress).map(About::Headerless),
        // Among scans it is rather something that was dropped with them.
        ReadError::UnknownFormat(_) if is_alone => Headerless::guess(source, progress).map(About::Headerless),
        // Its name says something else than it holds.
        ReadError::Truncated { .. } | ReadError::TooLong(_) if is_raw => Headerless::guess(source, progress).map(About::Headerless),
        ReadError::TooLarge { smaller, .. } => {
            Reduce::every(*smaller.first()?).map(|reduce| About::Preview(reduce, in_the_window(&error.to_string())))
        }
        ReadError::Uneven { usual_mm, gaps } => Some(About::Uneven(format!("Most are {usual_mm} mm apart, but {gaps}."))),
        ReadError::Numbering(gaps) => Some(About::Uneven(format!("Their numbers have gaps: {gaps}."))),
        _ => None,
    }
}

enum Answer {
    None,
    Cancel,
    Read,
}

impl Question {
    fn ui(&mut self, ui: &mut Ui) -> Answer {
        let Self { sources, of, about } = self;
        let source = &mut sources[*of];
        let name = source.file.file_name().unwrap_or(source.file.as_os_str()).to_string_lossy().into_owned();
        match about {
            About::Spacing(mm) => {
                ui.label(format!("{name} does not say how far its samples are apart. Along i, j and k, in mm:"));
                ui.horizontal(|ui| {
                    for (axis, name) in ["i", "j", "k"].into_iter().enumerate() {
                        let value = DragValue::new(&mut mm[axis]).range(0.0..=1000.0).speed(0.01).max_decimals(6);
                        let label = ui.label(name).id;
                        ui.add(value).labelled_by(label);
                    }
                    let is_known = mm.min_element() > 0.0;
                    answer(ui, "Open", is_known, "", || source.spacing_mm = Some(*mm))
                })
                .inner
            }
            About::Headerless(headerless) => {
                ui.label(format!(
                    "{name} is in no form that is known by its header. If it holds samples and nothing else, how do they lie?"
                ));
                let can = headerless.ui(ui, source);
                ui.horizontal(|ui| answer(ui, "Open", can, "", || source.raw = Some(headerless.raw()))).inner
            }
            About::Series(choice) => {
                ui.label(format!("{name} holds several series. Which one is to be read?"));
                choice.ui(ui);
                ui.horizontal(|ui| answer(ui, "Open", true, "", || choice.apply(source))).inner
            }
            About::Uneven(gaps) => {
                ui.label(format!("The slices of {name} are not even. {gaps} What lies between them can be made up from their neighbours."));
                let hint = "Find the missing slices, then open it again";
                ui.horizontal(|ui| answer(ui, "Interpolate", true, hint, || source.uneven = Uneven::Resample)).inner
            }
            About::Preview(reduce, text) => {
                ui.label(text.as_str());
                // Filled from the right.
                line(ui, |ui| {
                    let cancel = ui.button("Cancel").clicked();
                    let read = ui.button("Open a preview").clicked();
                    answered(cancel, read, || source.reduce = Some(*reduce))
                })
            }
        }
    }
}

/// The two buttons that answer: one that reads after `set`, where that `can` be, and one that cancels, as `hint` says.
fn answer(ui: &mut Ui, reads: &str, can: bool, hint: &str, set: impl FnOnce()) -> Answer {
    let read = ui.add_enabled(can, egui::Button::new(reads)).clicked();
    let cancel = ui.button("Cancel");
    let cancel = if hint.is_empty() { cancel } else { cancel.on_hover_text(hint) };
    answered(cancel.clicked(), read, set)
}

fn answered(cancel: bool, read: bool, set: impl FnOnce()) -> Answer {
    if cancel {
        return Answer::Cancel;
    }
    if !read {
        return Answer::None;
    }
    set();
    Answer::Read
}
