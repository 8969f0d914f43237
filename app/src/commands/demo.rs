//! `bregma demo`: the synthetic pair as files, with a session, pictures and a probe.

use super::{CommandError, make_folder, print, renderer, with_progress};
use crate::args::{Backend, DemoArgs};
use crate::input::{Opened, Session, Source};
use crate::output::{write_png, write_whole};
use bregma_field::WorldPoint;
use bregma_field::formats::nrrd::{self, Compression};
use bregma_measure::export;
use bregma_renderer::{Camera, Mode, Ray};
use glam::DVec3;
use std::path::Path;

/// Writes the demo and says what is where.
pub fn demo(args: &DemoArgs, backend: Backend) -> Result<(), CommandError> {
    write_demo(&args.out, usize::from(args.size), backend)
}

/// Pixels along each side of the demo's pictures.
const PICTURE: u32 = 800;

/// Writes the demo pair of `size` samples into `folder`.
pub fn write_demo(folder: &Path, size: usize, backend: Backend) -> Result<(), CommandError> {
    make_folder(folder)?;
    let mut opened = with_progress("scanning", |progress| Opened::demo(size, progress))?;
    let names = ["a.nrrd", "b.nrrd"];
    for (volume, name) in opened.volumes.iter().zip(names) {
        with_progress("writing", |progress| nrrd::write(&folder.join(name), volume, Compression::Gzip, progress))?;
    }
    opened.sources = names.map(|name| Source { file: folder.join(name), ..Source::default() }).into();
    opened.scene.camera = Camera::orbit(&opened.bounds(), 35.0, 12.0);
    let mut renderer = renderer(backend)?;
    let mut picture = |name: &str, opened: &Opened| -> Result<(), CommandError> {
        let picture = renderer.render(&opened.volumes, &opened.scene, PICTURE, PICTURE)?;
        Ok(write_png(&folder.join(name), &picture)?)
    };
    picture("iso.png", &opened)?;
    opened.scene.mode = Mode::Overlay;
    picture("overlay.png", &opened)?;
    let session = serde_json::to_string_pretty(&Session::of(&opened, folder)).expect("a session has only numbers, texts and lists");
    write_whole(&folder.join("session.json"), session.as_bytes())?;
    // From the front through the frontal bone, where B's is thicker, and out through the occipital.
    let ray = Ray::new(WorldPoint(DVec3::new(0.0, -150.0, 40.0)), DVec3::Y).expect("the y axis is a direction");
    let found = bregma_measure::probe(&opened.volumes, &opened.scene.layers, &ray)?;
    write_whole(&folder.join("probe.csv"), format!("{}\n{}", export::CSV_HEADER, export::csv_rows(1, &found)).as_bytes())?;
    print(&format!(
        "{}: a.nrrd and b.nrrd (a pair of synthetic skulls), session.json (opens both), iso.png, overlay.png, probe.csv\n\n{}",
        folder.display(),
        export::table(&found)
    ))
}
