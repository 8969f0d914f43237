//! `bregma parts`: the parts of a scan, as a table and a label map.

use crate::cli::args::PartsArgs;
use crate::cli::error::CommandError;
use crate::cli::opening::{open, require_spacing};
use crate::cli::terminal::{print, warn, with_progress};
use bregma_field::{Surface, WorldPoint, read_mesh};
use bregma_measure::numbers::{fixed, significant, suffix};
use bregma_parts::{ClosedSurface, Islands, Labels, Neck, Part, PartsError, Statistics, keep_the_skull, read, separate, write};
use bregma_session::Opened;
use glam::DAffine3;
use serde::Serialize;
use std::path::PathBuf;

/// What is printed with --json.
#[derive(Serialize)]
struct Record<'a> {
    scan: &'a str,
    iso: f64,
    /// Samples that are bone at this isovalue.
    bone_samples: u64,
    parts: Vec<Row<'a>>,
}

#[derive(Serialize)]
struct Row<'a> {
    #[serde(flatten)]
    part: &'a Part,
    #[serde(flatten)]
    statistics: Statistics,
}

/// Finds parts, tells of them, and writes them.
pub fn parts(args: &PartsArgs) -> Result<(), CommandError> {
    let opened = open(&args.sources.0, &args.isovalues)?;
    if opened.volumes.len() != 1 {
        return Err(CommandError::Usage(format!("{} scans are named; the parts of one are found", opened.volumes.len())));
    }
    require_spacing(&opened)?;
    let (volume, iso) = (&opened.volumes[0], opened.scene.layers[0].iso);
    let surface = Surface::new(volume, iso, DAffine3::IDENTITY)?;
    let (mut labels, notes) = found(args, &opened, &surface)?;
    if let Some(mm) = args.smooth {
        labels = with_progress("smoothing", |progress| labels.smoothed(&surface, mm, progress))?;
    }
    let bone = with_progress("counting", |progress| Islands::of_bone(&surface, progress));
    // A label map may be of what is no bone.
    let bone_samples = bone.map_or(0, |bone| bone.sizes().iter().sum());
    let rows: Vec<Row<'_>> =
        labels.parts().iter().zip(labels.statistics(volume)).map(|(part, statistics)| Row { part, statistics }).collect();
    let record = Record { scan: volume.name(), iso, bone_samples, parts: rows };
    if let Some(file) = &args.out {
        let lost = with_progress("writing", |progress| write(file, &labels, progress))?;
        warn(&lost.iter().map(|w| format!("{}: {w}", file.display())).collect::<Vec<_>>());
    }
    if args.json {
        let line = serde_json::to_string(&record).expect("the record has only numbers, texts and lists");
        return print(&(line + "\n"));
    }
    print(&(told(&record, suffix(volume.unit())) + &notes))
}

/// The parts that are asked for, and what is to be said of them.
fn found(args: &PartsArgs, opened: &Opened, surface: &Surface) -> Result<(Labels, String), CommandError> {
    let volume = &opened.volumes[0];
    if let Some(file) = &args.labels {
        let (labels, warnings) = with_progress("reading", |progress| read(file, volume, progress))?;
        warn(&warnings);
        return Ok((labels, String::new()));
    }
    if let Some(file) = &args.seeds {
        let (seeds, warnings) = with_progress("reading", |progress| read(file, volume, progress))?;
        warn(&warnings);
        return Ok((with_progress("growing", |progress| seeds.grown_from_seeds(surface, progress))?, String::new()));
    }
    if !args.surface.is_empty() {
        let read = |file: &PathBuf| read_mesh(file).map(|mesh| ClosedSurface { file: file.clone(), mesh }).map_err(PartsError::from);
        let surfaces = args.surface.iter().map(read).collect::<Result<Vec<_>, _>>()?;
        return Ok((with_progress("filling", |progress| Labels::of_surfaces(volume, &surfaces, progress))?, String::new()));
    }
    if let Some(mm) = args.separate {
        let neck = Neck { mm, least_mm3: args.larger_than };
        return Ok((with_progress("separating", |progress| separate(surface, neck, progress))?, String::new()));
    }
    if args.keep_the_skull {
        let skull = with_progress("looking for the skull", |progress| keep_the_skull(surface, progress))?;
        let note = match skull.left_out {
            0 => "  nothing hangs on it that the scan's box cuts\n".to_owned(),
            n => format!("  {n} samples came off, and are left out, where a ball of {} mm passes\n", fixed(skull.radius_mm, 2)),
        };
        return Ok((skull.labels, note));
    }
    let islands = with_progress("looking for islands", |progress| Islands::of_bone(surface, progress))?;
    let chosen = chosen(args, &islands, surface)?;
    Ok((islands.labels(volume.grid(), &chosen)?, String::new()))
}

fn chosen(args: &PartsArgs, islands: &Islands, surface: &Surface) -> Result<Vec<(usize, String)>, CommandError> {
    let volume = &surface.volume;
    if args.largest {
        return Ok(vec![(0, "Largest island".to_owned())]);
    }
    if let Some(point) = args.at {
        let near = volume.grid().index(WorldPoint(point)).0.round();
        let at = (near.min_element() >= 0.0).then(|| islands.at(near.to_array().map(|x| x as usize))).flatten();
        let at = at.ok_or_else(|| CommandError::Usage(format!("--at: there is no bone at ({}, {}, {})", point.x, point.y, point.z)))?;
        return Ok(vec![(at, format!("Island {}", at + 1))]);
    }
    let voxel_mm3 = volume.grid().index_to_world().matrix3.determinant().abs();
    let least_mm3 = args.larger_than.unwrap_or(0.0);
    let count = islands.at_least(least_mm3 / voxel_mm3);
    if count == 0 {
        return Err(PartsError::AllSmaller { scan: volume.name().to_owned(), least_mm3 }.into());
    }
    if count > usize::from(u16::MAX) {
        return Err(CommandError::Usage(format!("there are {count} islands, more than 65535; leave small ones out by --larger-than")));
    }
    Ok((0..count).map(|n| (n, format!("Island {}", n + 1))).collect())
}

/// Rows that a person reads; the others are told as one.
const MOST_ROWS: usize = 40;

fn told(record: &Record<'_>, unit: &str) -> String {
    let Record { scan, iso, bone_samples, parts } = record;
    let share = |samples: u64| fixed(100.0 * samples as f64 / (*bone_samples).max(1) as f64, 2);
    let width = parts.iter().take(MOST_ROWS).map(|row| row.part.name.chars().count()).max().unwrap_or(0).max(4);
    let mut text = format!(
        "{scan}, isovalue {}{unit}: {bone_samples} samples of bone\n  {:<width$} {:>14} {:>12} {:>10} {:>10}  samples from–to along i, j, k\n",
        significant(*iso, 6),
        "part",
        "volume mm³",
        "samples",
        "% of bone",
        "mean",
    );
    for Row { part, statistics } in parts.iter().take(MOST_ROWS) {
        let extent = statistics
            .extent
            .map_or("none".to_owned(), |[low, high]| (0..3).map(|a| format!("{}–{}", low[a], high[a])).collect::<Vec<_>>().join(", "));
        text += &format!(
            "  {:<width$} {:>14} {:>12} {:>10} {:>10}  {extent}\n",
            part.name,
            fixed(statistics.volume_mm3, 1),
            statistics.samples,
            share(statistics.samples),
            statistics.mean.map_or("–".to_owned(), |mean| significant(mean, 5)),
        );
    }
    if let Some(rest) = parts.get(MOST_ROWS..).filter(|rest| !rest.is_empty()) {
        let samples: u64 = rest.iter().map(|row| row.statistics.samples).sum();
        text += &format!("  and {} more of {samples} samples, {} % of the bone\n", rest.len(), share(samples));
    }
    text
}
