//! `bregma render`: one picture.

use super::{CommandError, open, renderer, set_each, warn};
use crate::args::{Backend, CameraArgs, RenderArgs};
use crate::input::Opened;
use crate::output::{write_depth, write_png, write_volume_id};
use bregma_renderer::{Camera, FOV_DEG, Projection};
use glam::DVec3;

/// Draws the picture and writes it.
pub fn render(args: &RenderArgs, backend: Backend) -> Result<(), CommandError> {
    let mut opened = open(&args.sources.0, &args.isovalues)?;
    set_each(&mut opened.scene.layers, &args.opacity, "--opacity", |layer, v| layer.opacity = *v as f32)?;
    set_each(&mut opened.scene.layers, &args.color, "--color", |layer, c| layer.color = *c)?;
    opened.scene.mode = args.mode.map_or(opened.scene.mode, Into::into);
    opened.scene.solver = args.solver.unwrap_or(opened.scene.solver);
    opened.scene.background = args.background.map_or(opened.scene.background, |b| b.0);
    if let Some(camera) = camera(&args.camera, &opened) {
        opened.scene.camera = camera;
    }
    let (width, height) = args.size;
    let picture = renderer(backend)?.render(&opened.volumes, &opened.scene, width, height)?;
    if picture.volume_id.iter().all(|&id| id == 0) {
        warn(&[format!("{}: the picture shows no surface from this view", args.out.display())]);
    }
    if let Some(file) = &args.depth {
        write_depth(file, &picture)?;
    }
    if let Some(file) = &args.volume_id {
        write_volume_id(file, &picture)?;
    }
    write_png(&args.out, &picture)?;
    Ok(())
}

/// The camera that the arguments ask for; `None` when they leave it to the scene.
fn camera(args: &CameraArgs, opened: &Opened) -> Option<Camera> {
    let asked = args.eye.is_some() || args.orbit.is_some() || args.fov.is_some() || args.ortho.is_some() || args.up.is_some();
    if !asked {
        return None;
    }
    let bounds = opened.bounds();
    let fov_deg = args.fov.unwrap_or(FOV_DEG);
    let (azimuth, elevation) = args.orbit.unwrap_or((0.0, 0.0));
    let mut camera = Camera::orbit_with_fov(&bounds, azimuth, elevation, fov_deg);
    if let Some(eye_mm) = args.eye {
        camera = Camera { eye_mm, target_mm: args.target.unwrap_or(bounds.centre_mm), up: DVec3::Z, ..camera };
    }
    camera.up = args.up.unwrap_or(camera.up);
    if let Some(height_mm) = args.ortho {
        camera.projection = Projection::Orthographic { height_mm };
    }
    Some(camera)
}
