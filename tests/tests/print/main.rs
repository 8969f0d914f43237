//! Pictures on paper: lengths on it, marks where they belong, and files that other programs read.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod again;
mod files;
mod inks;
mod lengths;
mod placing;

use bregma_renderer::{Color, CpuRenderer, Scene};
use bregma_session::Opened;
use bregma_session::print::{Aim, Canvas, Panel, Print, PrintError, draw, prepare};
use bregma_session::views::View;
use bregma_synthetic::analytic::Sphere;
use bregma_volume::Grid;
use glam::{DMat3, DVec3};
use std::path::PathBuf;
use std::sync::{Arc, LazyLock};

const WHITE: Color = Color([1.0; 3]);

/// The demo pair in few samples.
static DEMO: LazyLock<Opened> = LazyLock::new(|| Opened::demo(40, &Default::default()).unwrap());

/// A ball of 20 mm radius around (3, −2, 5), in samples 0.8 mm apart.
fn ball() -> Opened {
    let grid = Grid::new([64; 3], DVec3::splat(0.8), DVec3::new(3.0, -2.0, 5.0) - 25.2, DMat3::IDENTITY).unwrap();
    let ball = Sphere { centre: DVec3::new(3.0, -2.0, 5.0), radius_mm: 20.0 };
    let mut opened = Opened::new(vec![], vec![Arc::new(ball.volume(&grid))]);
    opened.scene.layers[0].iso = 0.0;
    opened.scene.background = Some(WHITE);
    opened
}

/// A picture of `opened` in a view, as large as its room.
fn seen(opened: Opened, view: View) -> Panel {
    Panel { opened, aim: Some(Aim { view, frankfurt: None, fov_deg: None }), coat: None }
}

/// Prepared and drawn on the CPU.
fn drawn(panels: &mut [Panel], print: &mut Print) -> Result<Canvas, PrintError> {
    prepare(panels, print)?;
    draw(panels, print, &mut CpuRenderer::default(), &Default::default())
}

/// A sheet of a size in mm.
fn sheet(size_mm: [f64; 2], dpi: f64) -> Print {
    Print { size_px: Print::pixels(size_mm, dpi), dpi: Some(dpi), ..Print::default() }
}

/// A folder of its own for each test.
fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("bregma-print-{}-{name}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn with_background(opened: &Opened, background: Option<Color>) -> Opened {
    Opened { scene: Scene { background, ..opened.scene.clone() }, ..opened.clone() }
}
