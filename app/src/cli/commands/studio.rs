//! What `bregma render --studio` says while it draws, and of what came of it.

use crate::cli::error::CommandError;
use crate::cli::terminal::tell;
use bregma_field::Progress;
use bregma_renderer::Renderer;
use bregma_session::print::{Canvas, Panel, Print, Watch, draw_watched};
use bregma_session::studio::{Drawn, Told, part_of, so_far};
use std::io::{self, IsTerminal, Write};
use std::path::Path;
use std::time::Duration;

/// Draws a sheet under studio light. What is drawn so far lies beside `out`: the same command goes on from there. `print` comes to say how the
/// pictures can be drawn again.
pub fn draw_studio(
    panels: &[Panel],
    print: &mut Print,
    renderer: &mut dyn Renderer,
    (out, keep_every): (&Path, Duration),
) -> Result<Canvas, CommandError> {
    let is_watched = io::stderr().is_terminal();
    let noise = print.exposure.and_then(|exposure| exposure.stop.noise);
    let mut told = |told: &Told| {
        if is_watched {
            // Where that cannot be written, nobody watches.
            drop(write!(io::stderr(), "\r\x1b[2K{}", line(told, noise)));
        }
    };
    let mut most = 0;
    let mut drawn = |drawn: &Drawn| {
        most = most.max(drawn.samples);
        if is_watched {
            drop(write!(io::stderr(), "\r\x1b[2K"));
        }
        if drawn.resumed > 0 {
            tell("note", &format!("went on from {} samples that were kept beside {}", drawn.resumed, out.display()));
        }
        tell("note", &drawn.description);
    };
    let canvas = draw_watched(
        panels,
        print,
        renderer,
        &Progress::default(),
        Watch { out: Some((out, keep_every)), told: &mut told, drawn: &mut drawn },
    )?;
    print.exposure = print.exposure.map(|exposure| exposure.timeless(most));
    Ok(canvas)
}

/// Takes away what was kept of a picture that is written.
pub fn forget(out: &Path, count: usize) {
    // Nothing needs it any more; where it cannot be removed, the same command goes on from it.
    (0..count).for_each(|n| drop(std::fs::remove_file(part_of(out, n))));
}

/// How far it is, for people.
fn line(told: &Told, noise: Option<f64>) -> String {
    let left = told.left.map_or(String::new(), |left| format!(", about {} s", left.as_secs_f64().ceil()));
    let to = noise.filter(|_| !left.is_empty()).map_or(String::new(), |noise| format!(" to {noise:.1}"));
    format!("{}{left}{to}", so_far(told.samples, told.noise))
}
