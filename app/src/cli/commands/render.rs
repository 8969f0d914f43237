//! `bregma render`: one picture, or several on a sheet.

use super::plate;
use crate::cli::args::{CameraArgs, RenderArgs};
use crate::cli::error::CommandError;
use crate::cli::look::no_volume;
use crate::cli::opening::{open, require_spacing};
use crate::cli::parsers::Plane;
use crate::cli::terminal::{warn, with_progress};
use bregma_renderer::{Camera, FOV_DEG, Named, Projection, view_of_plane};
use bregma_session::output::{write_depth, write_values, write_volume_id, write_whole};
use bregma_session::print::record::Record;
use bregma_session::print::{Canvas, Encoding, FileError, Form, Panel, Print, draw, prepare};
use bregma_session::{Compare, Machine, Opened};
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
    let canvas = with_progress("drawing", |progress| draw(&panels, &print, renderer.as_mut(), progress))?;
    let shows_nothing = canvas.middles.as_ref().is_none_or(|middles| middles.volume_id.iter().all(|id| *id == 0));
    if shows_nothing && canvas.light.iter().all(|light| *light == canvas.light[0]) {
        warn(&[format!("{}: the picture shows nothing from this view", args.out.display())]);
    }
    beside(args, &canvas)?;
    write(args, (form, &encoding), &panels, &print, &renderer.name(), &canvas)
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

/// Opens the scans of a picture, with the look and the camera that are asked for, in a picture of such a size.
pub(super) fn opened(args: &RenderArgs, size: (u32, u32)) -> Result<Opened, CommandError> {
    let mut opened = open(&args.sources.0, &args.isovalues)?;
    if args.depth.is_some() || args.print.scale.is_some() || args.print.bar.is_some() {
        require_spacing(&opened)?;
    }
    args.look.apply(&mut opened, args.mode)?;
    warn(&args.look.idle(&opened.scene));
    opened.scene.solver = args.solver.unwrap_or(opened.scene.solver);
    opened.scene.background = args.background.map_or(args.print.ground(opened.scene.background), |b| b.0);
    opened.scene.camera = camera(&args.camera, &opened, size);
    if args.values.is_some() && !opened.scene.gives_values() {
        return Err(CommandError::Usage("--values are those of --mode max, min, mean, xray or slice: ask for one of these".into()));
    }
    // Of what changes in time a still has nothing to show.
    let of_session = if matches!(opened.compare, Compare::Flicker { .. }) { Compare::Off } else { opened.compare };
    opened.compare = args.compare.unwrap_or(of_session);
    let visible = opened.scene.layers.iter().filter(|layer| layer.visible).count();
    if let Some(pair) = args.pair {
        let count = opened.volumes.len();
        if let Some(n) = pair.iter().find(|n| **n > count) {
            return Err(no_volume(*n, count));
        }
        opened.pair = Some(pair.map(|n| n - 1));
    }
    if args.compare.is_some_and(|compare| compare != Compare::Off) && opened.compared().is_none() {
        return Err(CommandError::Usage(format!("--compare is of two scans; {visible} is visible: name another one")));
    }
    Ok(opened)
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

/// The camera that the arguments ask for, of a picture of such a size; what they leave open is the session's, or the orbit's.
pub(super) fn camera(args: &CameraArgs, opened: &Opened, (width, height): (u32, u32)) -> Camera {
    let bounds = opened.bounds();
    let mut camera = opened.scene.camera;
    let is_new_slice = opened.scene.is_slice() && args.orbit.is_none() && args.eye.is_none() && !opened.from_session;
    if let Some(plane) = args.plane.or_else(|| is_new_slice.then(Plane::default)) {
        let (axes, through_mm) = plane.through(bounds.centre_mm);
        camera = view_of_plane(axes, through_mm, &opened.grids(), f64::from(width) / f64::from(height));
        camera.up = args.up.unwrap_or(camera.up);
        if let Some(Some(height_mm)) = args.ortho {
            camera.projection = Projection::Orthographic { height_mm };
        }
        return camera;
    }
    if args.orbit.is_some() || args.eye.is_some() || !opened.from_session {
        let (azimuth, elevation) = args.orbit.unwrap_or((0.0, 0.0));
        camera = Camera::orbit_with_fov(&bounds, azimuth, elevation, args.fov.unwrap_or(FOV_DEG));
    }
    if let Some(eye_mm) = args.eye {
        camera = Camera { eye_mm, target_mm: args.target.unwrap_or(bounds.centre_mm), ..camera };
    }
    camera.up = args.up.unwrap_or(camera.up);
    camera.projection = match (args.fov, args.ortho) {
        (Some(fov_deg), _) => Projection::Perspective { fov_deg },
        (_, Some(Some(height_mm))) => Projection::Orthographic { height_mm },
        (_, Some(None)) => camera.parallel().projection,
        _ => camera.projection,
    };
    camera
}
