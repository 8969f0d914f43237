//! `bregma section`: thickness along a curve of the surface.

use crate::cli::args::SectionArgs;
use crate::cli::error::CommandError;
use crate::cli::opening::{open, require_spacing};
use crate::cli::terminal::{print, warn, with_progress};
use bregma_measure::numbers::{fixed, signed};
use bregma_measure::section::{Length, Named, Path, Plane, Station};
use bregma_measure::table_style::TableStyle;
use bregma_session::record::made;
use bregma_session::section::{landmark, measure, plane_of};
use bregma_session::{Opened, Origin, SectionOrder, ToldSection, save};

/// Measures along the curve and writes what is asked for.
pub fn section(args: &SectionArgs) -> Result<(), CommandError> {
    let mut opened = open(&args.sources.0, &args.isovalues)?;
    args.landmarks.iter().try_for_each(|file| opened.take_landmarks(file))?;
    let count = opened.volumes.len();
    if count > 2 {
        return Err(CommandError::Usage(format!("{count} scans are named; a section is of one, or of two")));
    }
    require_spacing(&opened)?;
    let order =
        SectionOrder { path: path(&opened, args)?, step_mm: args.step, on: 0, against: (count > 1).then_some(1), reach_mm: args.reach };
    let measured = with_progress("measuring", |progress| measure(&opened, &order, progress))?;
    warn(&measured.told.notes);
    let (made, origin) = (made(&opened), Origin::of(&opened));
    for file in &args.out {
        save::section(file, &measured, &made, origin.as_ref(), TableStyle::default())?;
    }
    let files: Vec<String> = args.out.iter().map(|file| file.display().to_string()).collect();
    print(&format!("{}{}\n", told(&measured.told), files.join(", ")))
}

/// The curve that is asked for.
fn path(opened: &Opened, args: &SectionArgs) -> Result<Path, CommandError> {
    let named =
        |names: &[String]| names.iter().map(|name| Ok(landmark(opened, 0, name.trim())?)).collect::<Result<Vec<Named>, CommandError>>();
    if !args.through.is_empty() {
        let landmarks = named(&args.through)?;
        if args.one_plane {
            return Ok(Path::InPlane { plane: plane_of(&landmarks)?, landmarks });
        }
        return Ok(Path::Profile { landmarks });
    }
    let seed = args.seed.as_ref().map(|name| landmark(opened, 0, name)).transpose()?;
    let landmarks = named(&args.plane)?;
    let plane = match args.plane_at.zip(args.normal) {
        Some((point_mm, normal)) => {
            Plane::new(point_mm, normal).ok_or_else(|| CommandError::Usage("--normal 0,0,0 is no direction".into()))?
        }
        None => plane_of(&landmarks)?,
    };
    Ok(Path::Whole { plane, seed, landmarks })
}

/// The section in short.
fn told(told: &ToldSection) -> String {
    let closed = if told.is_closed { ", closed" } else { "" };
    let mut text = format!(
        "on {}: {} mm{closed}, {} stations every {} mm\n",
        told.scans[0],
        fixed(told.length_mm, 2),
        told.stations.len(),
        fixed(told.order.step_mm, 2)
    );
    for mark in &told.marks {
        text += &format!("  {:<12} at {} mm\n", mark.name, fixed(mark.along_mm, 2));
    }
    for (name, of) in told.thicknesses() {
        text += &format!("thickness of {name}: {}\n", in_short(&told.stations, of, fixed));
    }
    for (name, of) in told.differences() {
        text += &format!("{name}: {}\n", in_short(&told.stations, of, signed));
    }
    text
}

/// A column's mean, ends and gaps, and how much of it is beyond its ±.
fn in_short(stations: &[Station], of: fn(&Station) -> Option<Length>, number: fn(f64, usize) -> String) -> String {
    let found: Vec<Length> = stations.iter().filter_map(of).collect();
    if found.is_empty() {
        return "no number".into();
    }
    let count = found.len() as f64;
    let ends = found.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), l| (low.min(l.mm), high.max(l.mm)));
    format!(
        "mean {} mm, from {} to {}, ± {} on average; {} of {} stations have none",
        number(found.iter().map(|l| l.mm).sum::<f64>() / count, 2),
        number(ends.0, 2),
        number(ends.1, 2),
        fixed(found.iter().map(|l| l.error_mm).sum::<f64>() / count, 2),
        stations.len() - found.len(),
        stations.len()
    )
}
