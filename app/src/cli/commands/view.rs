//! What a picture shows: the scans that are named, with the look and the camera that options ask for.

use crate::cli::args::RenderArgs;
use crate::cli::camera_args::CameraArgs;
use crate::cli::error::CommandError;
use crate::cli::look::no_volume;
use crate::cli::opening::{open, require_spacing};
use crate::cli::parsers::Plane;
use crate::cli::terminal::warn;
use bregma_renderer::{Camera, FOV_DEG, Projection, view_of_plane};
use bregma_session::{Compare, Opened};

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
    opened.scene.studio = args.studio.studio()?.or(opened.scene.studio);
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
