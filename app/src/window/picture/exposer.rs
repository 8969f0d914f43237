//! Studio light in the view: what rests is exposed on a thread of its own, better from round to round, until the next change stops it at once.

use super::desk::Wish;
use bregma_field::{Cancelled, Progress};
use bregma_renderer::studio::{Exposed, Tracer, TracerCache, can_light};
use bregma_session::print::Canvas;
use bregma_session::studio::{Exposing, Stop, Told, on_ground};
use egui::Context;
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
#[derive(Debug, Default)]
pub struct Exposer {
    /// What the next picture of the same scans needs, too; nothing while no studio lights them.
    cache: Option<Arc<Mutex<TracerCache>>>,
    at_work: Option<AtWork>,
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
    /// Stops what is under way.
    pub fn stop(&mut self) {
        self.at_work = None;
    }

    /// Stops, and gives back the memory.
    pub fn forget(&mut self) {
        (self.at_work, self.cache) = (None, None);
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
        let cache = Arc::clone(self.cache.get_or_insert_default());
        let (progress, (send, rounds)) = (Arc::new(Progress::default()), channel());
        let (shared, ctx, wish) = (Arc::clone(&progress), ctx.clone(), wish.clone());
        std::thread::spawn(move || {
            // Nobody waits for what was stopped.
            let _ = exposed(&cache, &wish, &shared, &send, &ctx);
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

/// Sends round after round, as long as the picture is not good enough.
fn exposed(
    cache: &Mutex<TracerCache>,
    wish: &Wish,
    progress: &Progress,
    send: &Sender<Result<Round, String>>,
    ctx: &Context,
) -> Result<(), Cancelled> {
    let tracer = {
        // A cache is in order whatever became of the thread that had it: it is filled entry by entry.
        let mut cache = cache.lock().unwrap_or_else(PoisonError::into_inner);
        progress.advance(0)?;
        Tracer::reusing(&mut cache, &wish.volumes, &wish.scene, wish.size, 0)
    };
    let mut exposing = match tracer {
        Ok(tracer) => Exposing::of(tracer, Exposed::new(wish.size), stop()),
        Err(error) => {
            drop(send.send(Err(error.to_string())));
            return Ok(());
        }
    };
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
