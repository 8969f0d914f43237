//! `bregma difference`: how two scans differ over their whole surfaces.

use super::view::camera;
use crate::cli::args::DifferenceArgs;
use crate::cli::error::CommandError;
use crate::cli::opening::{open, require_spacing};
use crate::cli::terminal::{print, warn, with_progress};
use bregma_measure::numbers::{fixed, signed};
use bregma_measure::table_style::TableStyle;
use bregma_register::Parts;
use bregma_renderer::Color;
use bregma_session::coat::Coat;
use bregma_session::difference::{Measured, measure};
use bregma_session::difference_picture::{DifferenceCoat, LEAST_RANGE_MM, Scale};
use bregma_session::difference_report::html;
use bregma_session::difference_table::record_file;
use bregma_session::output::{make_folder, write_whole};
use bregma_session::print::figure_png;
use bregma_session::{DifferenceBy, DifferenceOrder, Machine, Opened, Origin, save};
use std::path::Path;
use std::sync::Arc;

/// Measures how the second scan differs from the first, and writes it.
pub fn difference(args: &DifferenceArgs, machine: Machine) -> Result<(), CommandError> {
    let mut opened = open(&args.sources.0, &args.isovalues)?;
    let wanted = if args.by == DifferenceBy::Asymmetry { 1 } else { 2 };
    if opened.volumes.len() != wanted {
        let count = opened.volumes.len();
        let many =
            if count > 2 && wanted == 2 { ": --each measures each other one against the first, --all-pairs all of them" } else { "" };
        return Err(CommandError::Usage(format!("{count} scans are named; such a difference is of {wanted}{many}")));
    }
    require_spacing(&opened)?;
    let measured = measured_into(args, machine, &mut opened, &args.out, args.range)?;
    print(&told(&measured, &args.out))
}

/// What is asked for of such scans.
pub(super) fn order(args: &DifferenceArgs, opened: &Opened) -> DifferenceOrder {
    DifferenceOrder {
        by: args.by,
        pair: [0, opened.volumes.len() - 1],
        reach_mm: args.reach,
        parts: Parts { only: args.only.clone(), but: args.but.clone() },
        clips: if args.as_cut { opened.scene.clips.clone() } else { vec![] },
    }
}

/// Measures, and writes all of it into a folder, the record last. The colours end at `range_mm`, or where 95 % of both surfaces stay below.
pub(super) fn measured_into(
    args: &DifferenceArgs,
    machine: Machine,
    opened: &mut Opened,
    folder: &Path,
    range_mm: Option<f64>,
) -> Result<Arc<Measured>, CommandError> {
    let order = order(args, opened);
    let measured = Arc::new(with_progress("measuring", |progress| measure(opened, &order, progress))?);
    warn(&measured.notes);
    make_folder(folder)?;
    let origin = Origin::of(opened);
    let range_mm = range_mm.unwrap_or_else(|| measured.range_mm()).max(LEAST_RANGE_MM);
    let scale = Scale { range_mm, grey_within_error: !args.all_colors, isolines_mm: args.isolines };
    let coats = [0, 1].map(|on| DifferenceCoat { measured: Arc::clone(&measured), on, scale });
    let mut figures = vec![];
    for (coat, name) in coats.iter().zip(["first", "second"]) {
        let figure = drawn(opened, coat, args, machine)?;
        write_whole(&folder.join(format!("{name}.png")), &figure)?;
        figures.push((format!("On {}. {}.", coat.half().name, measured.legend()), figure));
        for ending in ["csv", "ply"] {
            save::difference(&folder.join(format!("{name}.{ending}")), coat, &[], None, TableStyle::default())?;
        }
    }
    write_whole(&folder.join("report.html"), html(&measured, &figures, origin.as_ref()).as_bytes())?;
    let record = serde_json::to_string_pretty(&measured.record(origin.as_ref())).expect("a record has only numbers, texts and lists");
    write_whole(&record_file(folder), record.as_bytes())?;
    Ok(measured)
}

/// The picture of one surface with its legend, as PNG.
fn drawn(opened: &mut Opened, coat: &DifferenceCoat, args: &DifferenceArgs, machine: Machine) -> Result<Vec<u8>, CommandError> {
    let mut scene = coat.scene(&opened.scene);
    scene.background = Some(Color([1.0; 3]));
    scene.camera = camera(&args.camera, opened, args.size);
    let (width, height) = args.size;
    let mut picture = machine.renderer()?.render(&opened.volumes, &scene, width, height)?;
    coat.paint(&mut picture, &scene, [0.0; 2]);
    let unplotted = |reason| CommandError::Figure { what: "the picture".into(), reason };
    let figure = coat.figure(&picture).map_err(unplotted)?;
    figure_png(&figure).map_err(|reason| CommandError::Figure { what: "the picture".into(), reason })
}

/// The difference in short.
fn told(measured: &Measured, folder: &Path) -> String {
    let mut text = format!("{}\npartners within {} mm\n", measured.legend(), fixed(measured.reach_mm, 2));
    for half in &measured.halves {
        let Some(s) = &half.statistics else {
            text += &format!("on {}: no difference is known there\n", half.name);
            continue;
        };
        text += &format!(
            "on {}\n  mean      {} ± {} mm; of magnitudes {}, root mean square {}, standard deviation {}\n  median    {} mm; 90 % of the area from {} to {}, largest {}\n  sure      {} % of {} mm² differ by more than their ±, {} % have no number\n",
            half.name,
            signed(s.mean_mm, 4),
            fixed(s.mean_uncertainty.error_mm, 4),
            fixed(s.mean_magnitude_mm, 4),
            fixed(s.rms_mm, 4),
            fixed(s.deviation_mm, 4),
            signed(s.quantiles_mm[3], 3),
            signed(s.quantiles_mm[1], 3),
            signed(s.quantiles_mm[5], 3),
            signed(s.largest.difference_mm, 3),
            fixed(100.0 * s.sure, 1),
            fixed(s.area_mm2, 1),
            fixed(100.0 * s.without(), 1),
        );
        for e in s.extremes.iter().take(3) {
            text += &format!(
                "  {} ± {} mm at {}\n",
                signed(e.difference_mm, 3),
                fixed(e.error_mm, 3),
                e.at_mm.to_array().map(|mm| fixed(mm, 1)).join(", ")
            );
        }
    }
    format!("{text}{}: report.html, difference.json, first and second .png, .csv, .ply\n", folder.display())
}
