//! `bregma render`: one picture.

use super::studio::draw_studio;
use crate::cli::args::{CameraArgs, RenderArgs};
use crate::cli::error::CommandError;
use crate::cli::look::no_volume;
use crate::cli::opening::{open, require_spacing};
use crate::cli::parsers::Plane;
use crate::cli::terminal::warn;
use bregma_renderer::{Camera, FOV_DEG, Projection, view_of_plane};
use bregma_session::output::{write_depth, write_described, write_values, write_volume_id};
use bregma_session::studio::part_of;
use bregma_session::{Compare, Machine, Opened};
use std::path::{Path, PathBuf};

/// Draws the picture and writes it.
pub fn render(args: &RenderArgs, machine: Machine) -> Result<(), CommandError> {
    keep_apart(args)?;
    let mut opened = open(&args.sources.0, &args.isovalues)?;
    if args.depth.is_some() {
        require_spacing(&opened)?;
    }
    args.look.apply(&mut opened, args.mode)?;
    warn(&args.look.idle(&opened.scene));
    opened.scene.solver = args.solver.unwrap_or(opened.scene.solver);
    opened.scene.background = args.background.map_or(opened.scene.background, |b| b.0);
    opened.scene.camera = camera(&args.camera, &opened, args.size);
    opened.scene.studio = args.studio.studio()?.or(opened.scene.studio);
    if args.values.is_some() && !opened.scene.gives_values() {
        return Err(CommandError::Usage("--values are those of --mode max, min, mean, xray or slice: ask for one of these".into()));
    }
    let (width, height) = args.size;
    // Of what changes in time a still has nothing to show.
    let of_session = if matches!(opened.compare, Compare::Flicker { .. }) { Compare::Off } else { opened.compare };
    let compare = args.compare.unwrap_or(of_session);
    let visible = opened.scene.layers.iter().filter(|layer| layer.visible).count();
    if let Some(pair) = args.pair {
        let count = opened.volumes.len();
        if let Some(n) = pair.iter().find(|n| **n > count) {
            return Err(no_volume(*n, count));
        }
        opened.pair = Some(pair.map(|n| n - 1));
    }
    let pair = opened.compared();
    if args.compare.is_some_and(|compare| compare != Compare::Off) && pair.is_none() {
        return Err(CommandError::Usage(format!("--compare is of two scans; {visible} is visible: name another one")));
    }
    let (picture, description) = if opened.scene.studio.is_some() {
        let (picture, description) = draw_studio(args, &opened)?;
        (picture, Some(description))
    } else {
        let samples = args.samples.unwrap_or(1);
        let picture = compare.draw(machine.renderer()?.as_mut(), &opened.volumes, &opened.scene, pair, [width, height], samples)?;
        (picture, None)
    };
    let nothing = picture.rgba.iter().all(|c| *c == picture.rgba[0]);
    if nothing && picture.volume_id.iter().all(|&id| id == 0) {
        warn(&[format!("{}: the picture shows nothing from this view", args.out.display())]);
    }
    if let Some(file) = &args.depth {
        write_depth(file, &picture)?;
    }
    if let Some(file) = &args.volume_id {
        write_volume_id(file, &picture)?;
    }
    if let Some(file) = &args.values {
        write_values(file, &picture)?;
    }
    write_described(&args.out, &picture, description.as_deref())?;
    if description.is_some() {
        // Nothing needs it any more; where it cannot be removed, the same command goes on from it.
        drop(std::fs::remove_file(part_of(&args.out)));
    }
    Ok(())
}

/// Refuses to write one file twice, or over a scan that is read.
fn keep_apart(args: &RenderArgs) -> Result<(), CommandError> {
    let place = |file: &Path| std::fs::canonicalize(file).unwrap_or_else(|_| file.to_owned());
    let mut taken: Vec<PathBuf> = args.sources.0.iter().map(|s| place(&s.file)).collect();
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
        camera.projection = args.ortho.map_or(camera.projection, |height_mm| Projection::Orthographic { height_mm });
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
        (_, Some(height_mm)) => Projection::Orthographic { height_mm },
        _ => camera.projection,
    };
    camera
}
