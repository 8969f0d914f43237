//! The views alone on the whole screen, and how the picture turns by itself there, or a film plays, while nobody touches it.

use super::bench::Bench;
use super::picture::navigate;
use egui::{Context, CursorIcon, Event, Key, ViewportCommand};
use std::f64::consts::TAU;

/// One turn of the picture takes so long, seconds.
const TURN_S: f64 = 24.0;

/// What is on the whole screen.
#[derive(Clone, Copy, Debug, Default)]
pub struct Stage {
    /// Nothing but the views is shown.
    is_full: bool,
    /// Left alone for so long, seconds, the picture turns by itself.
    turns_after_s: Option<f64>,
    /// When somebody last touched anything, in the window's seconds.
    touched_at: f64,
    /// When it turned last, while it turns.
    turned_at: Option<f64>,
}

impl Stage {
    /// Nothing but the views is shown.
    pub fn is_full(&self) -> bool {
        self.is_full
    }

    /// The picture turns by itself.
    pub fn turns(&self) -> bool {
        self.turned_at.is_some()
    }

    /// Fills the screen; left alone for `turns_after_s` seconds, if that is given, the picture turns.
    pub fn fill(&mut self, ctx: &Context, turns_after_s: Option<f64>) {
        *self = Self { is_full: true, turns_after_s, touched_at: ctx.time(), turned_at: None };
        ctx.send_viewport_cmd(ViewportCommand::Fullscreen(true));
    }

    /// Shows the window again.
    pub fn leave(&mut self, ctx: &Context) {
        *self = Self::default();
        ctx.send_viewport_cmd(ViewportCommand::Fullscreen(false));
    }

    /// Takes note of what a person touches in this frame, and leaves by Escape.
    pub fn look(&mut self, ctx: &Context) {
        let is_touch = |event: &Event| {
            matches!(
                event,
                Event::PointerMoved(_)
                    | Event::PointerButton { .. }
                    | Event::Key { .. }
                    | Event::Text(_)
                    | Event::MouseWheel { .. }
                    | Event::Zoom(_)
                    | Event::Touch { .. }
            )
        };
        if ctx.input(|i| i.events.iter().any(is_touch)) {
            (self.touched_at, self.turned_at) = (ctx.time(), None);
        }
        if self.is_full && ctx.input(|i| i.key_pressed(Key::Escape)) {
            self.leave(ctx);
        }
    }
}

impl Bench {
    /// Turns the picture a little further, or plays the session's film, if it was left alone for long enough. That is no step: undo leads to what a
    /// person did.
    pub fn turn_by_itself(&mut self, ctx: &Context) {
        if self.stage.turned_at.is_none() {
            self.stop_playing_round(ctx);
        }
        let Some(after_s) = self.stage.turns_after_s.filter(|_| !self.is_empty()) else { return };
        let now = ctx.time();
        let waits_s = self.stage.touched_at + after_s - now;
        if waits_s > 0.0 {
            ctx.request_repaint_after_secs(waits_s as f32);
            return;
        }
        let since_s = now - self.stage.turned_at.unwrap_or(now);
        self.stage.turned_at = Some(now);
        if self.plays() || self.work.opened.film.clone().is_some_and(|film| self.play(ctx, film, true)) {
            ctx.set_cursor_icon(CursorIcon::None);
            return;
        }
        navigate::rotate(&mut self.work.opened.scene.camera, TAU * since_s / TURN_S, 0.0);
        self.history.look_along(&self.work);
        self.view.moved(now);
        ctx.set_cursor_icon(CursorIcon::None);
        ctx.request_repaint();
    }
}
