//! `bregma film`: a turntable, or what goes from key to key.

use super::plate;
use crate::cli::args::FilmArgs;
use crate::cli::error::CommandError;
use crate::cli::terminal::{print, warn, with_progress};
use bregma_session::Machine;
use bregma_session::film::{Film, Key, Reel, write};
use bregma_session::print::prepare;
use serde::Deserialize;
use std::path::Path;

/// A film as its file lists it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    keys: Vec<Key>,
}

/// Draws the film and writes it.
pub fn film(args: &FilmArgs, machine: Machine) -> Result<(), CommandError> {
    let sheet = &args.picture;
    let one = || CommandError::Usage("a film is of one picture: leave --plate, --depth, --volume-id, --values and --for out".into());
    if sheet.print.plate.is_some()
        || sheet.depth.is_some()
        || sheet.volume_id.is_some()
        || sheet.values.is_some()
        || sheet.print.journal.is_some()
    {
        return Err(one());
    }
    let mut sheet_of = sheet.print.sheet(sheet.size.or(Some((1280, 720))), sheet.samples);
    let mut panels = plate::panels(sheet, &mut sheet_of)?;
    let film = asked(args, panels.first().and_then(|panel| panel.opened.film.as_deref()))?;
    warn(&prepare(&mut panels, &mut sheet_of)?);
    if sheet.studio.minutes.is_some() {
        return Err(CommandError::Usage(
            "frames of a film are alike however fast they are drawn: give --samples or --noise, not --minutes".into(),
        ));
    }
    sheet_of.exposure = panels.iter().any(|panel| panel.opened.scene.studio.is_some()).then(|| sheet.studio.exposure(sheet.samples));
    // There is one picture.
    let Some(panel) = panels.first() else { return Err(one()) };
    let mut renderer = machine.renderer()?;
    let drawn_by = renderer.name();
    let reel = Reel::begin(&sheet.out, &film, panel, &sheet_of, &drawn_by)?;
    with_progress("filming", |progress| write(&reel, panel, args.quantiser, renderer.as_mut(), progress))?;
    print(&format!("{}: {} frames, {} s\n", sheet.out.display(), film.frames(), film.seconds))
}

/// The film that is asked for: a turntable, a file's keys, or else that of the session.
fn asked(args: &FilmArgs, of_session: Option<&Film>) -> Result<Film, CommandError> {
    if args.turntable.is_none()
        && args.keys.is_none()
        && let Some(film) = of_session
    {
        return Ok(Film { seconds: args.seconds.unwrap_or(film.seconds), fps: args.fps.unwrap_or(film.fps), ..film.clone() });
    }
    let keys = args.keys.as_deref().map(read).transpose()?.unwrap_or_default();
    let seconds = args.turntable.or(args.seconds).or(keys.last().map(|key| key.at_s));
    let seconds = seconds.ok_or_else(|| CommandError::Usage("how long does it run? Give --turntable SECONDS, or --keys FILE".into()))?;
    Ok(Film { seconds, fps: args.fps.unwrap_or(Film::default().fps), turns: args.turntable.map(|_| args.turns), keys })
}

fn read(file: &Path) -> Result<Vec<Key>, CommandError> {
    let fail = |reason: String| CommandError::Keys { file: file.to_owned(), reason };
    let text = std::fs::read_to_string(file).map_err(|e| fail(format!("cannot be read ({e}); check its name and permissions")))?;
    let keys: Keys = serde_json::from_str(&text).map_err(|e| fail(format!("is no list of keys ({e})")))?;
    Ok(keys.keys)
}
