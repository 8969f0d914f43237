//! `bregma volume`: volumes of bone and of cavities.

use crate::cli::args::VolumeArgs;
use crate::cli::error::CommandError;
use crate::cli::opening::{open, require_spacing};
use crate::cli::parsers::Seed;
use crate::cli::terminal::{print, warn, with_progress};
use bregma_field::{Clip, Shape};
use bregma_measure::numbers::{fixed, significant, suffix};
use bregma_measure::volumes::Measure;
use bregma_measure::volumes::cavity::Cavity;
use bregma_session::output::write_whole;
use bregma_session::record::made;
use bregma_session::volumes::{Found, Order, csv, measure, record};
use bregma_session::{Measurement, Opened, Origin};
use glam::DVec3;

/// Measures volumes, and prints or writes them.
pub fn volume(args: &VolumeArgs) -> Result<(), CommandError> {
    let opened = open(&args.sources.0, &args.isovalues)?;
    require_spacing(&opened)?;
    if opened.scene.clips.iter().any(|clip| clip.enabled) {
        warn(&["the session's cuts are ways of looking: the whole bone is measured; pass --box or --sphere to measure a part".into()]);
    }
    let order = order(&opened, args)?;
    let found = with_progress("measuring", |progress| measure(&opened, &order, progress))?;
    warn(found.notes());
    let record = || Measurement::Volumes(Box::new(record(Origin::of(&opened), &order, &found))).to_string() + "\n";
    if let Some(file) = &args.out {
        let text = if file.is_json { record() } else { csv(&made(&opened), &found) };
        write_whole(&file.path, text.as_bytes())?;
    }
    print(&if args.json { record() } else { told(&found) })
}

fn order(opened: &Opened, args: &VolumeArgs) -> Result<Order, CommandError> {
    let of_box = |[low_mm, high_mm]: &[DVec3; 2]| Shape::Box { low_mm: *low_mm, high_mm: *high_mm };
    let of_ball = |(centre_mm, radius_mm): &(DVec3, f64)| Shape::Sphere { centre_mm: *centre_mm, radius_mm: *radius_mm };
    let clips = args.boxes.iter().map(of_box).chain(args.spheres.iter().map(of_ball)).map(Clip::all).collect();
    let cavity = |seed: &Seed| {
        let seed_mm = match seed {
            Seed::Point(point) => *point,
            Seed::Landmark(name) => landmark(opened, name)?,
        };
        Ok(Cavity { seed_mm, discs: args.close.clone(), ball_mm: args.sphere_passes })
    };
    let cavities = args.cavities.iter().map(cavity).collect::<Result<_, CommandError>>()?;
    Ok(Order { clips, open: args.open, cavities })
}

fn landmark(opened: &Opened, name: &str) -> Result<DVec3, CommandError> {
    let found = opened.landmarks.iter().find(|landmark| landmark.name == name).and_then(|landmark| landmark.point_mm);
    found.ok_or_else(|| CommandError::Usage(format!("--cavity {name}: is neither a point X,Y,Z nor a landmark of the files named")))
}

/// The volumes as a table, and what they are of.
fn told(found: &Found) -> String {
    let mm3 = |v: f64| fixed(v, 1);
    let measures = found.measures();
    let mut text = String::new();
    let mut named: Vec<&str> = vec![];
    for scan in measures.iter().flat_map(|(_, scans)| scans) {
        if !named.contains(&scan.name.as_str()) {
            named.push(&scan.name);
            let blur = scan.sharpness.map_or("no edge that blur could be seen at".into(), |s| {
                format!("blur of edges {} mm (standard deviation)", fixed(s.blur_mm2.sqrt(), 2))
            });
            let unit = suffix(scan.unit);
            text +=
                &format!("{}, isovalue {}{unit} ± {}; {blur}\n", scan.name, significant(scan.iso, 6), significant(scan.iso_tolerance, 3));
        }
    }
    let width = measures.iter().map(|(measure, _)| measure.what.chars().count()).max().unwrap_or(0);
    text += &format!(
        "  {:<width$} {:>14} {:>11} {:>11} {:>14} {:>11} {:>11}\n",
        "mm³", "volume", "±", "isovalue ±", "without blur", "±", "surface mm²"
    );
    let line = |measure: &Measure| {
        format!(
            "  {:<width$} {:>14} {:>11} {:>11} {:>14} {:>11} {:>11}\n",
            measure.what,
            mm3(measure.volume_mm3),
            mm3(measure.uncertainty.error_mm3),
            mm3(measure.uncertainty.threshold_error_mm3),
            mm3(measure.unblurred_mm3),
            mm3(measure.unblurred_error_mm3),
            mm3(measure.area_mm2),
        )
    };
    measures.iter().for_each(|(measure, _)| text += &line(measure));
    for (measure, scans) in &measures {
        let unit = scans.first().map_or("", |scan| suffix(scan.unit));
        text += &format!(
            "  {}: {} mm³ for each{} of the isovalue\n",
            measure.what,
            significant(measure.per_isovalue_mm3, 4),
            if unit.is_empty() { " unit" } else { unit }
        );
    }
    text
}
