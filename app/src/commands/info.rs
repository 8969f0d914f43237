//! `bregma info`: what a scan is.

use super::{CommandError, print, warn, with_progress};
use crate::args::InfoArgs;
use crate::input::Opened;
use bregma_volume::{Unit, Volume};
use glam::{DMat3, DVec3};
use serde::Serialize;

/// One scan as JSON.
#[derive(Serialize)]
struct Record<'a> {
    file: &'a str,
    format: &'a str,
    dims: [usize; 3],
    spacing_mm: [f64; 3],
    origin_mm: [f64; 3],
    /// Rows x, y, z; columns i, j, k.
    direction: [[f64; 3]; 3],
    /// Index to LPS mm, rows.
    to_world: [[f64; 4]; 4],
    r#type: &'a str,
    slope: f64,
    intercept: f64,
    unit: Unit,
    range: [f64; 2],
    otsu: Option<f64>,
    bytes: usize,
    warnings: &'a [String],
}

/// Says what each scan is.
pub fn info(args: &InfoArgs) -> Result<(), CommandError> {
    for source in &args.sources.0 {
        let opened = with_progress("reading", |progress| Opened::read(std::slice::from_ref(source), progress))?;
        for volume in &opened.volumes {
            if args.json {
                let line = serde_json::to_string(&record(volume)).expect("the record has only numbers, texts and lists");
                print(&(line + "\n"))?;
            } else {
                print(&text(volume))?;
                warn(&volume.warnings().iter().map(|w| format!("{}: {w}", volume.name())).collect::<Vec<_>>());
            }
        }
    }
    Ok(())
}

fn record(volume: &Volume) -> Record<'_> {
    let grid = volume.grid();
    let (m, o) = (grid.index_to_world().matrix3, grid.origin_mm());
    let row = |m: DMat3, r: usize| m.row(r).to_array();
    let world_row = |r: usize| [m.row(r).x, m.row(r).y, m.row(r).z, o[r]];
    Record {
        file: volume.name(),
        format: volume.format(),
        dims: grid.dims(),
        spacing_mm: grid.spacing_mm().to_array(),
        origin_mm: o.to_array(),
        direction: [0, 1, 2].map(|r| row(grid.direction(), r)),
        to_world: [world_row(0), world_row(1), world_row(2), [0.0, 0.0, 0.0, 1.0]],
        r#type: volume.samples().type_name(),
        slope: volume.slope(),
        intercept: volume.intercept(),
        unit: volume.unit(),
        range: volume.range(),
        otsu: volume.otsu(),
        bytes: volume.samples().bytes(),
        warnings: volume.warnings(),
    }
}

fn text(volume: &Volume) -> String {
    let grid = volume.grid();
    let [nx, ny, nz] = grid.dims();
    let list = |v: DVec3| v.to_array().map(short).join(", ");
    let d = grid.direction();
    let unit = match volume.unit() {
        Unit::Hounsfield => " HU",
        Unit::Value => "",
    };
    let [low, high] = volume.range();
    let (iso, why) = volume.default_isovalue();
    format!(
        "{}\n  format     {}\n  samples    {nx} × {ny} × {nz} {}, {:.1} MiB\n  spacing    {} mm\n  origin     {} mm (LPS)\n  directions i ({}), j ({}), k ({})\n  values     {low} to {high}{unit}; slope {}, intercept {}\n  isovalue   {}{unit} ({why})\n",
        volume.name(),
        volume.format(),
        volume.samples().type_name(),
        volume.samples().bytes() as f64 / f64::from(1 << 20),
        list(grid.spacing_mm()),
        list(grid.origin_mm()),
        list(d.x_axis),
        list(d.y_axis),
        list(d.z_axis),
        volume.slope(),
        volume.intercept(),
        short(iso),
    )
}

/// Six digits after the point at most.
fn short(v: f64) -> String {
    let text = format!("{v:.6}");
    let trimmed = text.trim_end_matches('0').trim_end_matches('.');
    if trimmed == "-0" { "0".into() } else { trimmed.into() }
}
