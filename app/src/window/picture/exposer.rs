//! Studio light in the view: what rests is exposed on a thread of its own, better from round to round, until the next change stops it at once. It has a
//! renderer of its own, as the view's draws meanwhile.

use super::desk::{Open, Wish};
use bregma_field::{Cancelled, Progress};
use bregma_renderer::studio::{Exposed, NotDrawn, Tracer, can_light};
use bregma_renderer::{Backend, CpuRenderer, RenderError, Renderer};
use bregma_session::print::Canvas;
use bregma_session::studio::{Exposing, Stop, Told, on_ground};
use egui::Context;
use std::fmt;
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::sync::{Arc, Mutex, PoisonError};

/// A view is good enough once no block of 8 × 8 pixels has more noise, 255ths: less is not seen on a display.
const NOISE: f64 = 1.0;
/// Samples that end it in any case: light that comes along rare ways may take for ever.
const MOST_SAMPLES: u32 = 1024;
/// While the picture has more noise than this, 255ths, it is shown filtered: below, the filter takes away as much as it invents.
const FILTERED: f64 = 4.0;

/// The view after a round.
#[derive(Debug)]
pub struct Round {
    /// Pixels as sRGB with opacity, rows from the top.
    pub rgba: Vec<[u8; 4]>,
    /// How far it is.
    pub told: Told,
    /// Its noise was taken away by a filter.
    pub is_filtered: bool,
}

/// The window's side of the thread.
#[derive(Debug)]
pub struct Exposer {
    open: Open,
    /// What draws, and knows what the next picture of the same scans needs, too; nothing while no studio lights them.
    lights: Option<Arc<Lights>>,
    at_work: Option<AtWork>,
}

/// A renderer, once something is lit.
#[derive(Default)]
struct Lights(Mutex<Option<Box<dyn Renderer>>>);

impl fmt::Debug for Lights {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Lights")
    }
}

/// An exposure under way. Dropping it stops it.
#[derive(Debug)]
struct AtWork {
    progress: Arc<Progress>,
    rounds: Receiver<Result<Round, String>>,
    /// The thread is through.
    has_ended: bool,
}

impl Drop for AtWork {
    fn drop(&mut self) {
        self.progress.cancel();
    }
}

/// Whether a studio lights what is wished for: one picture of surfaces in their own colours.
pub(super) fn is_lit(wish: &Wish) -> bool {
    wish.scene.studio.is_some() && wish.sizes.len() == 1 && wish.coat.is_none() && can_light(&wish.scene).is_ok()
}

impl Exposer {
    /// Lights by what `open` opens.
    pub(super) fn new(open: Open) -> Self {
        Self { open, lights: None, at_work: None }
    }

    /// Stops what is under way.
    pub fn stop(&mut self) {
        self.at_work = None;
    }

    /// Stops, and gives back the memory.
    pub fn forget(&mut self) {
        (self.at_work, self.lights) = (None, None);
    }

    /// Something is under way, or has come to its end.
    pub fn has_begun(&self) -> bool {
        self.at_work.is_some()
    }

    /// What was begun has come to its end.
    pub fn has_ended(&self) -> bool {
        self.at_work.as_ref().is_some_and(|at_work| at_work.has_ended)
    }

    /// Begins to expose what is wished for.
    pub(super) fn begin(&mut self, ctx: &Context, wish: &Wish) {
        let (open, lights) = (self.open, Arc::clone(self.lights.get_or_insert_default()));
        let (progress, (send, rounds)) = (Arc::new(Progress::default()), channel());
        let (shared, ctx, wish) = (Arc::clone(&progress), ctx.clone(), wish.clone());
        std::thread::spawn(move || {
            // Nobody waits for what was stopped.
            let _ = lit(&lights, open, &wish, &shared, &send, &ctx);
            drop(send);
            ctx.request_repaint();
        });
        self.at_work = Some(AtWork { progress, rounds, has_ended: false });
    }

    /// The newest round, if there is one since the last call, or one sentence about why there is none.
    pub fn poll(&mut self) -> Option<Result<Round, String>> {
        let at_work = self.at_work.as_mut()?;
        let mut newest = None;
        loop {
            match at_work.rounds.try_recv() {
                // What is said about a round is not lost for the next.
                Ok(Err(text)) => return Some(Err(text)),
                Ok(round) => newest = Some(round),
                Err(TryRecvError::Empty) => return newest,
                Err(TryRecvError::Disconnected) => {
                    at_work.has_ended = true;
                    return newest;
                }
            }
        }
    }
}

/// Lights what is wished for; where a graphics card fails, by the processor.
fn lit(
    lights: &Lights,
    open: Open,
    wish: &Wish,
    progress: &Progress,
    send: &Sender<Result<Round, String>>,
    ctx: &Context,
) -> Result<(), Cancelled> {
    loop {
        let (backend, tracer) = {
            // A renderer is in order whatever became of the thread that had it: what it knows is added entry by entry.
            let mut renderer = lights.0.lock().unwrap_or_else(PoisonError::into_inner);
            progress.advance(0)?;
            let renderer = renderer.get_or_insert_with(|| open().0);
            (renderer.backend(), renderer.tracer(&wish.volumes, &wish.scene, wish.size, 0))
        };
        let error = match tracer.map_err(NotDrawn::from).and_then(|tracer| exposed(tracer, wish, progress, send, ctx)) {
            Ok(()) => return Ok(()),
            Err(NotDrawn::Cancelled(stopped)) => return Err(stopped),
            Err(NotDrawn::Failed(error)) => error,
        };
        if backend == Backend::Cpu || matches!(error, RenderError::Studio(_)) {
            drop(send.send(Err(error.to_string())));
            return Ok(());
        }
        drop(send.send(Err(format!("The graphics card failed: {error}. The processor lights instead."))));
        *lights.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(Box::new(CpuRenderer::default()));
    }
}

/// Sends round after round, as long as the picture is not good enough.
fn exposed(tracer: Tracer, wish: &Wish, progress: &Progress, send: &Sender<Result<Round, String>>, ctx: &Context) -> Result<(), NotDrawn> {
    let mut exposing = Exposing::of(tracer, Exposed::new(wish.size), stop());
    while let Some(told) = exposing.go_on(progress)? {
        // A single sample does not tell its noise: it is infinite.
        let is_filtered = told.noise > FILTERED;
        let light = on_ground(exposing.light(is_filtered), wish.scene.background);
        progress.advance(0)?;
        let canvas = Canvas { size: wish.size, is_clear: true, ..Canvas::default() };
        let rgba = canvas.bytes(&light).as_chunks().0.to_vec();
        if send.send(Ok(Round { rgba, told, is_filtered })).is_err() {
            return Ok(());
        }
        ctx.request_repaint();
    }
    Ok(())
}

fn stop() -> Stop {
    Stop { samples: Some(MOST_SAMPLES), noise: Some(NOISE), ..Stop::default() }
}
