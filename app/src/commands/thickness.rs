//! `bregma thickness`: how thick the bone is, over the whole surface.

use super::render::camera;
use super::{CommandError, make_folder, open, print, renderer, require_spacing, with_progress};
use crate::args::{Backend, ThicknessArgs, ThicknessMethod};
use crate::output::{write_figure, write_whole};
use crate::thickness::{Scale, figure, paint, white};
use bregma_measure::export;
use bregma_measure::mesh::Mesh;
use bregma_measure::thickness::{self, Method, Statistics};
use serde::Serialize;

#[derive(Serialize)]
struct Record<'a> {
    volume: &'a str,
    iso: f64,
    method: &'a str,
    statistics: &'a Statistics,
}

/// Maps the thickness of one scan and writes it.
pub fn thickness(args: &ThicknessArgs, backend: Backend) -> Result<(), CommandError> {
    let mut opened = open(&args.sources.0, &args.isovalues)?;
    if opened.volumes.len() != 1 {
        return Err(CommandError::Usage(format!("{} scans are named; a map is made of one", opened.volumes.len())));
    }
    require_spacing(&opened)?;
    opened.scene.layers[0].visible = true;
    let (volume, layer) = (&opened.volumes[0], &opened.scene.layers[0]);
    let surface = bregma_renderer::Surface::new(volume, layer.iso, layer.transform)?;
    let (method, name) = match (args.method, args.direction) {
        (ThicknessMethod::Normal, _) => (Method::Normal, "along the inward normal"),
        (ThicknessMethod::Sphere, _) => (Method::Sphere, "largest inscribed sphere"),
        // A ray has a direction: the command line requires it.
        (ThicknessMethod::Ray, direction) => {
            let direction = direction.and_then(|d| d.try_normalize());
            (Method::Ray(direction.ok_or_else(|| CommandError::Usage("--direction 0,0,0 is none".into()))?), "along a ray")
        }
    };
    make_folder(&args.out)?;
    let never = "nobody cancels a command";
    let mesh = with_progress("finding the surface", |progress| Mesh::of(&surface, progress)).expect(never);
    let mut values = with_progress("measuring", |progress| thickness::map(&surface, &mesh, method, progress)).expect(never);
    if let Some((centre, radius_mm)) = args.patch {
        mesh.vertices.iter().zip(&mut values).filter(|(p, _)| p.distance(centre) > radius_mm).for_each(|(_, value)| *value = f32::NAN);
    }
    let Some(statistics) = Statistics::of(&mesh, &values) else {
        let text = format!("{}: no thickness is known anywhere at this isovalue; choose another, or another patch", volume.name());
        return Err(CommandError::File(text));
    };
    let [.., p95] = statistics.quantiles_mm;
    let ends_mm = args.range.map_or([0.0, p95], |(low, high)| [low, high]);
    if ends_mm[0] >= ends_mm[1] {
        return Err(CommandError::Usage("--range has its low end above its high end".into()));
    }
    let scale = Scale { colors: args.colors, ends_mm };
    let mut scene = white(opened.scene.clone());
    scene.camera = camera(&args.camera, &opened);
    let (width, height) = args.size;
    let mut picture = renderer(backend)?.render(&opened.volumes, &scene, width, height)?;
    paint(&mut picture, &scene, &surface, &mesh, &values, &scale);
    let drawn =
        figure(&picture, name, &scale, &statistics).map_err(|e| CommandError::File(format!("the picture cannot be drawn ({e})")))?;
    let record = Record { volume: volume.name(), iso: layer.iso, method: name, statistics: &statistics };
    let json = serde_json::to_string_pretty(&record).expect("the record has only numbers, texts and lists");
    write_whole(&args.out.join("thickness.csv"), export::map_csv(&mesh, &values).as_bytes())?;
    write_whole(&args.out.join("thickness.ply"), &export::map_ply(&mesh, &values, |mm| scale.color(mm)))?;
    write_whole(&args.out.join("thickness.json"), json.as_bytes())?;
    write_figure(&args.out.join("thickness.png"), drawn)?;
    let [least, greatest, p5, p25, median, p75, p95] = statistics.quantiles_mm;
    print(&format!(
        "{}, isovalue {}, thickness {name}\n  surface   {:.1} mm², {} points, {} more without a value\n  mean      {:.3} ± {:.3} mm (standard deviation)\n  median    {median:.3} mm; half of the surface from {p25:.3} to {p75:.3}, 90 % from {p5:.3} to {p95:.3}, all from {least:.3} to {greatest:.3}\n{}: thickness.csv, thickness.ply, thickness.json, thickness.png\n",
        volume.name(),
        layer.iso,
        statistics.area_mm2,
        statistics.count,
        statistics.unknown,
        statistics.mean_mm,
        statistics.deviation_mm,
        args.out.display(),
    ))
}
