//! `bregma demo`: the synthetic pair as files, with a session, pictures and a probe.

use crate::cli::args::DemoArgs;
use crate::cli::error::CommandError;
use crate::cli::terminal::{print, with_progress};
use bregma_field::WorldPoint;
use bregma_field::formats::nrrd::{self, Compression};
use bregma_measure::csv;
use bregma_measure::export::{self, Named};
use bregma_renderer::{Camera, Mode, Ray};
use bregma_session::output::{make_folder, write_whole};
use bregma_session::print::write_picture;
use bregma_session::record::made;
use bregma_session::{Machine, Opened, Session, Source};
use glam::DVec3;
use std::path::Path;

/// Writes the demo and says what is where.
pub fn demo(args: &DemoArgs, machine: Machine) -> Result<(), CommandError> {
    write_demo(&args.out, usize::from(args.size), machine)
}

/// Pixels along each side of the demo's pictures.
const PICTURE: u32 = 800;

/// Writes the demo pair of `size` samples into `folder`.
pub fn write_demo(folder: &Path, size: usize, machine: Machine) -> Result<(), CommandError> {
    make_folder(folder)?;
    let mut opened = with_progress("scanning", |progress| Opened::demo(size, progress))?;
    let names = ["a.nrrd", "b.nrrd"];
    for (volume, name) in opened.volumes.iter().zip(names) {
        with_progress("writing", |progress| nrrd::write(&folder.join(name), volume, Compression::Gzip, progress))?;
    }
    opened.sources = names.map(|name| Source { file: folder.join(name), ..Source::default() }).into();
    opened.scene.camera = Camera::orbit(&opened.bounds(), 35.0, 12.0);
    let mut renderer = machine.renderer()?;
    let mut picture = |name: &str, opened: &Opened| -> Result<(), CommandError> {
        let picture = renderer.render(&opened.volumes, &opened.scene, PICTURE, PICTURE)?;
        Ok(write_picture(&folder.join(name), &picture)?)
    };
    picture("iso.png", &opened)?;
    opened.scene.mode = Mode::Overlay;
    picture("overlay.png", &opened)?;
    Session::of(&opened, folder).write(&folder.join("session.json"))?;
    // From the front through the frontal bone, where B's is thicker, and out through the occipital.
    let ray = Ray::new(WorldPoint(DVec3::new(0.0, -150.0, 40.0)), DVec3::Y).expect("the y axis is a direction");
    let found = bregma_measure::probe(&opened.volumes, &opened.scene.layers, &ray)?;
    write_whole(&folder.join("probe.csv"), csv::rays(&[Named { name: "ray 1", found: &found }], &made(&opened)).as_bytes())?;
    print(&format!(
        "{}: a.nrrd and b.nrrd (a pair of synthetic skulls), session.json (opens both), iso.png, overlay.png, probe.csv\n\n{}",
        folder.display(),
        export::table(&found)
    ))
}
