//! Films in the view: one that is played, by hand or in a kiosk, and what a person does as it is recorded. Neither changes the work: what plays is seen in
//! its place, and a recording becomes a film once it ends.

use super::bench::Bench;
use bregma_session::Opened;
use bregma_session::film::{EVERY_S, Film, Recording};
use egui::{Context, Key, Order};
use std::sync::Arc;

/// A film that plays.
#[derive(Clone, Debug)]
pub struct Playing {
    film: Arc<Film>,
    /// Since when, in the window's seconds.
    since_s: f64,
    /// It begins anew where it ends, until somebody touches anything.
    goes_round: bool,
}

/// What is recorded.
#[derive(Debug)]
pub struct Taking {
    recording: Recording,
    /// Since when, in the window's seconds.
    since_s: f64,
}

impl Bench {
    /// Plays a film in the view, once or until somebody touches anything. Whether it can be played with what is open.
    pub fn play(&mut self, ctx: &Context, film: Arc<Film>, goes_round: bool) -> bool {
        self.playing = film.check(&self.work.opened).is_ok().then(|| Playing { film, since_s: ctx.time(), goes_round });
        self.plays()
    }

    /// A film plays.
    pub fn plays(&self) -> bool {
        self.playing.is_some()
    }

    /// Ends a film that went round by itself; the view stays where it is.
    pub fn stop_playing_round(&mut self, ctx: &Context) {
        if let Some(Playing { film, since_s, .. }) = self.playing.take_if(|playing| playing.goes_round) {
            let at_s = (ctx.time() - since_s).rem_euclid(film.seconds);
            self.work.opened.scene.camera = film.at(&self.work.opened, at_s).scene.camera;
            self.history.look_along(&self.work);
        }
    }

    /// What the film shows now, in the place of the work; ends it where it is through, or touched.
    pub fn shown_by_film(&mut self, ctx: &Context) -> Option<Opened> {
        let Playing { film, since_s, goes_round } = self.playing.as_ref()?;
        let at_s = ctx.time() - since_s;
        let is_over = !goes_round && (at_s >= film.seconds || is_touched(ctx));
        if is_over || film.check(&self.work.opened).is_err() {
            self.playing = None;
            return None;
        }
        let at_s = if *goes_round { at_s.rem_euclid(film.seconds) } else { at_s };
        let shown = film.at(&self.work.opened, at_s);
        // As what moves: in as many pixels as are drawn at once.
        self.view.moved(ctx.time());
        ctx.request_repaint();
        Some(shown)
    }

    /// Begins to record what is looked at, or ends that: what was recorded is the film then.
    pub fn toggle_recording(&mut self, ctx: &Context) {
        self.playing = None;
        match self.taking.take() {
            None => self.taking = Some(Taking { recording: Recording::default(), since_s: ctx.time() }),
            Some(Taking { recording, since_s }) => {
                let before = self.work.opened.film.take();
                let fps = before.as_ref().map_or(Film::default().fps, |film| film.fps);
                self.work.opened.film = recording.film(&self.work.opened, ctx.time() - since_s, fps).map(Arc::new).or(before);
            }
        }
    }

    /// For how long it is recorded what is looked at, seconds.
    pub fn recorded_s(&self, ctx: &Context) -> Option<f64> {
        self.taking.as_ref().map(|taking| ctx.time() - taking.since_s)
    }

    /// Takes note of what is looked at, where that is recorded.
    pub fn note_recording(&mut self, ctx: &Context) {
        let Some(Taking { recording, since_s }) = &mut self.taking else { return };
        ctx.request_repaint_after_secs(EVERY_S as f32);
        if !recording.note(&self.work.opened, ctx.time() - *since_s) {
            self.toggle_recording(ctx);
            self.messages.note("The recording is as long as one can be, and has ended");
        }
    }
}

/// The picture itself was pressed on, or Escape pressed.
fn is_touched(ctx: &Context) -> bool {
    let pressed = ctx.input(|i| if i.pointer.any_pressed() { i.pointer.interact_pos() } else { None });
    let is_free = |at| ctx.layer_id_at(at).is_none_or(|layer| layer.order == Order::Background);
    ctx.input(|i| i.key_pressed(Key::Escape)) || pressed.is_some_and(is_free)
}
