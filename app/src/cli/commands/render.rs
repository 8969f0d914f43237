//! `bregma render`: one picture, or several on a sheet.

use super::plate;
use super::studio::{draw_studio, forget};
use crate::cli::args::RenderArgs;
use crate::cli::error::CommandError;
use crate::cli::terminal::{warn, with_progress};
use bregma_renderer::Named;
use bregma_session::Machine;
use bregma_session::output::{write_depth, write_values, write_volume_id, write_whole};
use bregma_session::print::record::Record;
use bregma_session::print::{Canvas, Encoding, FileError, Form, Panel, Print, draw, prepare};
use std::path::{Path, PathBuf};

/// Draws the picture and writes it.
pub fn render(args: &RenderArgs, machine: Machine) -> Result<(), CommandError> {
    keep_apart(args)?;
    let form = Form::of(&args.out)?;
    let (mut print, encoding) = (args.print.sheet(args.size, args.samples), args.print.encoding());
    let mut panels = plate::panels(args, &mut print)?;
    let is_clear = panels.first().is_some_and(|panel| panel.opened.scene.background.is_none());
    form.check(&args.out, &encoding, is_clear)?;
    if let Some(journal) = args.print.journal {
        let faults = journal.faults(&print, form, &encoding, is_clear);
        if !faults.is_empty() {
            return Err(CommandError::Journal { journal: journal.name(), faults });
        }
        warn(&journal.note().map(str::to_owned).into_iter().collect::<Vec<_>>());
    }
    warn(&prepare(&mut panels, &mut print)?);
    let mut renderer = machine.renderer()?;
    let in_studio = panels.iter().any(|panel| panel.opened.scene.studio.is_some());
    let canvas = if in_studio {
        print.exposure = Some(args.studio.exposure(args.samples));
        draw_studio(&panels, &mut print, renderer.as_mut(), (&args.out, args.studio.keep_every()))?
    } else {
        with_progress("drawing", |progress| draw(&panels, &print, renderer.as_mut(), progress))?
    };
    let shows_nothing = canvas.middles.as_ref().is_none_or(|middles| middles.volume_id.iter().all(|id| *id == 0));
    if shows_nothing && canvas.light.iter().all(|light| *light == canvas.light[0]) {
        warn(&[format!("{}: the picture shows nothing from this view", args.out.display())]);
    }
    beside(args, &canvas)?;
    write(args, (form, &encoding), &panels, &print, &renderer.name(), &canvas)?;
    if in_studio {
        forget(&args.out, panels.len());
    }
    Ok(())
}

/// Writes the sheet, with what it was drawn of in it.
fn write(
    args: &RenderArgs,
    (form, encoding): (Form, &Encoding),
    panels: &[Panel],
    print: &Print,
    drawn_by: &str,
    canvas: &Canvas,
) -> Result<(), CommandError> {
    let record = Record::of(panels, print, encoding, drawn_by, args.out.parent().unwrap_or(Path::new(""))).map(|record| record.to_string());
    let bytes = form.encode(canvas, encoding, record.as_deref());
    let bytes = bytes.map_err(|reason| FileError::Encode { file: args.out.clone(), reason })?;
    if let Some(journal) = args.print.journal
        && let Some(fault) = journal.too_large(bytes.len())
    {
        return Err(CommandError::Journal { journal: journal.name(), faults: vec![fault] });
    }
    Ok(write_whole(&args.out, &bytes)?)
}

/// Writes the numbers of the pixels that are asked for beside the picture.
fn beside(args: &RenderArgs, canvas: &Canvas) -> Result<(), CommandError> {
    let Some(picture) = &canvas.middles else { return Ok(()) };
    if let Some(file) = &args.depth {
        write_depth(file, picture)?;
    }
    if let Some(file) = &args.volume_id {
        write_volume_id(file, picture)?;
    }
    if let Some(file) = &args.values {
        write_values(file, picture)?;
    }
    Ok(())
}

/// Refuses to write one file twice, or over a scan that is read.
fn keep_apart(args: &RenderArgs) -> Result<(), CommandError> {
    let place = |file: &Path| std::fs::canonicalize(file).unwrap_or_else(|_| file.to_owned());
    let mut taken: Vec<PathBuf> =
        args.sources.0.iter().map(|s| place(&s.file)).chain(plate::files(args).iter().map(|file| place(file))).collect();
    for file in [Some(&args.out), args.depth.as_ref(), args.volume_id.as_ref(), args.values.as_ref()].into_iter().flatten() {
        let is_file = file.metadata().is_ok_and(|m| m.is_file());
        if taken.contains(&place(file)) && (is_file || !file.exists()) {
            let text = format!("{} is named twice; it would be overwritten: give each output a file of its own", file.display());
            return Err(CommandError::Usage(text));
        }
        taken.push(place(file));
    }
    Ok(())
}
