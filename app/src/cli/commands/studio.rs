//! `bregma render --studio`: one picture, until it is good enough.

use crate::cli::args::RenderArgs;
use crate::cli::error::CommandError;
use crate::cli::terminal::tell;
use bregma_renderer::Picture;
use bregma_session::Opened;
use bregma_session::studio::{Order, Told, draw, part_of, so_far};
use std::io::{self, IsTerminal, Write};
use std::time::Duration;

/// Draws the picture of a scene that has a studio, and says how it was made. What is drawn so far lies beside it until it is written: the same command goes on from there.
pub fn draw_studio(args: &RenderArgs, opened: &Opened) -> Result<(Picture, String), CommandError> {
    let stop = args.studio.stop(args.samples);
    let (part, size) = (part_of(&args.out), args.size.into());
    let keep_every = Duration::try_from_secs_f64(args.studio.keep).unwrap_or(Duration::MAX);
    let order = Order { volumes: &opened.volumes, scene: &opened.scene, size, seed: args.studio.seed, stop, part: &part, keep_every };
    let is_watched = io::stderr().is_terminal();
    let drawn = draw(&order, args.studio.denoise, |told| {
        if is_watched {
            // Where that cannot be written, nobody watches.
            drop(write!(io::stderr(), "\r\x1b[2K{}", line(&told, stop.noise)));
        }
    })?;
    if is_watched {
        drop(write!(io::stderr(), "\r\x1b[2K"));
    }
    if drawn.resumed > 0 {
        tell("note", &format!("went on from {} samples that {} had kept", drawn.resumed, part.display()));
    }
    tell("note", &drawn.description);
    Ok((drawn.picture, drawn.description))
}

/// How far it is, for people.
fn line(told: &Told, noise: Option<f64>) -> String {
    let left = told.left.map_or(String::new(), |left| format!(", about {} s", left.as_secs_f64().ceil()));
    let to = noise.filter(|_| !left.is_empty()).map_or(String::new(), |noise| format!(" to {noise:.1}"));
    format!("{}{left}{to}", so_far(told.samples, told.noise))
}
