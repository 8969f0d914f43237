//! Draws scans as the window opens them, on the CPU, and writes a PNG.
//!
//!     cargo run --release --example draw_a_picture -- OUT.png [SCAN…]

use bregma_field::Progress;
use bregma_renderer::{Camera, CpuRenderer, Mode, Renderer};
use bregma_session::print::write_picture;
use bregma_session::{Opened, Source};
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let out = arguments.next().unwrap_or("picture.png".into());
    let scans: Vec<Source> = arguments.map(|file| Source { file: file.into(), ..Source::default() }).collect();
    let progress = Progress::default();
    let mut opened = if scans.is_empty() { Opened::demo(64, &progress)? } else { Opened::read(&scans, &progress)? };

    opened.scene.mode = Mode::Overlay;
    opened.scene.camera = Camera::orbit(&opened.bounds(), 35.0, 12.0);
    let picture = CpuRenderer::default().render(&opened.volumes, &opened.scene, 640, 480)?;
    write_picture(Path::new(&out), &picture)?;
    let hit = picture.volume_id.iter().filter(|id| **id > 0).count();
    println!("{out}: {hit} of {} pixels show bone", picture.rgba.len());
    Ok(())
}
