//! `bregma thickness`: how thick the bone is, over the whole surface.

use super::view::camera;
use crate::cli::args::ThicknessArgs;
use crate::cli::error::CommandError;
use crate::cli::opening::{open, require_spacing};
use crate::cli::terminal::{print, with_progress};
use bregma_measure::corrections;
use bregma_measure::export;
use bregma_measure::numbers::{fixed, significant};
use bregma_measure::thickness::Statistics;
use bregma_session::Machine;
use bregma_session::coat::white;
use bregma_session::output::{make_folder, write_whole};
use bregma_session::print::write_figure;
use bregma_session::thickness::{Map, MapError, Order, ThicknessMethod};
use bregma_session::thickness_picture::{Scale, figure};
use glam::DVec3;
use serde::Serialize;
use std::path::Path;

#[derive(Serialize)]
struct Record<'a> {
    volume: &'a str,
    iso: f64,
    method: &'a str,
    as_cut: bool,
    notes: &'a [String],
    statistics: &'a Statistics,
}

/// Maps the thickness of one scan and writes it.
pub fn thickness(args: &ThicknessArgs, machine: Machine) -> Result<(), CommandError> {
    let mut opened = open(&args.sources.0, &args.isovalues)?;
    if opened.volumes.len() != 1 {
        return Err(CommandError::Usage(format!("{} scans are named; a map is made of one", opened.volumes.len())));
    }
    require_spacing(&opened)?;
    opened.scene.layers[0].visible = true;
    let measured = opened.measured();
    let (volume, layer) = (&measured.volumes[0], &opened.scene.layers[0]);
    let name = match args.method {
        ThicknessMethod::Normal => "along the inward normal",
        ThicknessMethod::Sphere => "largest inscribed sphere",
        ThicknessMethod::Ray => "along a ray",
    };
    // A ray has a direction: the command line requires it.
    let direction = args.direction.and_then(DVec3::try_normalize);
    if args.method == ThicknessMethod::Ray && direction.is_none() {
        return Err(CommandError::Usage("--direction 0,0,0 is none".into()));
    }
    make_folder(&args.out)?;
    let mut order = Order::new(volume, layer, 0, args.method.along(direction.unwrap_or(DVec3::Z)), name.into());
    order.patch = args.patch;
    if args.as_cut {
        order.clips.clone_from(&opened.scene.clips);
    }
    let map = with_progress("measuring", |progress| order.measure(progress)).map_err(|e| match e {
        MapError::Surface(e) => CommandError::Surface(e),
        MapError::Nothing | MapError::Cancelled(_) => CommandError::NoThickness(volume.name().to_owned()),
    })?;
    let ends_mm = args.range.map_or(map.ends_mm(), |(low, high)| [low, high]);
    if ends_mm[0] >= ends_mm[1] {
        return Err(CommandError::Usage("--range has its low end above its high end".into()));
    }
    let Map { mesh, values, statistics, .. } = &map;
    let scale = Scale { colors: args.colors, ends_mm };
    let mut scene = white(opened.scene.clone());
    scene.camera = camera(&args.camera, &opened, args.size);
    let (width, height) = args.size;
    let mut picture = machine.renderer()?.render(&opened.volumes, &scene, width, height)?;
    map.paint(&scale, &mut picture, &scene, [0.0; 2]);
    let unplotted = |reason| CommandError::Figure { what: "the picture".into(), reason };
    let drawn = figure(&picture, name, &scale, statistics).map_err(unplotted)?;
    let notes = corrections(volume);
    let record = Record { volume: volume.name(), iso: layer.iso, method: name, as_cut: args.as_cut, notes: &notes, statistics };
    let json = serde_json::to_string_pretty(&record).expect("the record has only numbers, texts and lists");
    write_whole(&args.out.join("thickness.csv"), export::map_csv(mesh, values).as_bytes())?;
    write_whole(&args.out.join("thickness.ply"), &export::map_ply(mesh, values, &notes, |mm| scale.color(mm)))?;
    write_whole(&args.out.join("thickness.json"), json.as_bytes())?;
    write_figure(&args.out.join("thickness.png"), &drawn)?;
    print(&told(volume.name(), layer.iso, name, statistics, &args.out))
}

/// The map in short.
fn told(volume: &str, iso: f64, name: &str, statistics: &Statistics, folder: &Path) -> String {
    let mm = |value: f64| fixed(value, 3);
    let [least, greatest, p5, p25, median, p75, p95] = statistics.quantiles_mm.map(mm);
    format!(
        "{volume}, isovalue {}, thickness {name}\n  surface   {} mm², {} points, {} more without a value\n  mean      {} ± {} mm (standard deviation)\n  median    {median} mm; half of the surface from {p25} to {p75}, 90 % from {p5} to {p95}, all from {least} to {greatest}\n{}: thickness.csv, thickness.ply, thickness.json, thickness.png\n",
        significant(iso, 6),
        fixed(statistics.area_mm2, 1),
        statistics.count,
        statistics.unknown,
        mm(statistics.mean_mm),
        mm(statistics.deviation_mm),
        folder.display(),
    )
}
