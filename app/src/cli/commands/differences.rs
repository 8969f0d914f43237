//! `bregma difference --each` and `--all-pairs`: many scans against one, or all against all.

use super::difference::{measured_into, order};
use crate::cli::args::{DifferenceArgs, Isovalues};
use crate::cli::error::CommandError;
use crate::cli::opening::{open, require_spacing};
use crate::cli::terminal::{print, tell, warn};
use bregma_session::difference_picture::{LEAST_RANGE_MM, Scale, without_legend};
use bregma_session::difference_table::{Row, folder_name, pairs, record_file, said, sheet, standing, table};
use bregma_session::output::{make_folder, read_figure, write_whole};
use bregma_session::print::write_figure;
use bregma_session::{Machine, Opened, Origin, RecordedDifference};
use std::path::{Path, PathBuf};

/// Measures all pairs, each into a folder of its own; what stands there already, of these scans and this order, stays.
pub fn differences(args: &DifferenceArgs, machine: Machine) -> Result<(), CommandError> {
    make_folder(&args.out)?;
    let pairs = pairs(args.sources.0.len(), args.all_pairs);
    let mut range_mm = args.range;
    let mut rows: Vec<Row> = vec![];
    for (n, pair) in pairs.iter().enumerate() {
        tell("pair", &format!("{} of {}", n + 1, pairs.len()));
        let row = one(args, machine, *pair, &rows, &mut range_mm)?;
        if let Err(reason) = &row.found {
            tell("failed", reason);
        }
        rows.push(row);
        // After each pair, so that a stop loses nothing.
        write_whole(&args.out.join("table.csv"), table(&rows).as_bytes())?;
    }
    let scale = Scale { range_mm: range_mm.unwrap_or(LEAST_RANGE_MM), grey_within_error: !args.all_colors, isolines_mm: args.isolines };
    draw_sheet(&args.out, &rows, &scale)?;
    let failed = rows.iter().filter(|row| row.found.is_err()).count();
    print(&format!("{}: table.csv, sheet.png, and a folder for each of {} pairs\n", args.out.display(), rows.len() - failed))?;
    if failed > 0 { Err(CommandError::SomePairs { failed, all: rows.len() }) } else { Ok(()) }
}

/// Measures one pair, or finds it measured. What it fails by belongs to the pair, but for what no pair can be written with.
fn one(args: &DifferenceArgs, machine: Machine, pair: [usize; 2], before: &[Row], range_mm: &mut Option<f64>) -> Result<Row, CommandError> {
    let taken: Vec<PathBuf> = before.iter().map(|row| row.folder.clone()).collect();
    let mut opened = match opened(args, pair) {
        Ok(opened) => opened,
        Err(usage @ CommandError::Usage(_)) => return Err(usage),
        Err(reason) => {
            let names = pair.map(|n| args.sources.0[n].file.display().to_string());
            let folder = folder_name([&names[0], &names[1]], args.all_pairs, &taken);
            return Ok(Row { names, folder, found: Err(reason.to_string()) });
        }
    };
    let names = [0, 1].map(|n| opened.volumes[n].name().to_owned());
    let folder = folder_name([&names[0], &names[1]], args.all_pairs, &taken);
    let whole = args.out.join(&folder);
    let found = match stands(args, &opened, &whole) {
        Some(record) => Ok(record),
        None => measured_beside(args, machine, &mut opened, &whole, *range_mm).map_err(|e| e.to_string()),
    };
    if let Ok(found) = &found {
        // Pictures of all pairs have one range: that of the first, where nobody says another.
        range_mm.get_or_insert_with(|| found.difference.range_mm().max(LEAST_RANGE_MM));
        print(&format!("{}\n", said(&names, found)))?;
    }
    Ok(Row { names, folder, found })
}

/// The two scans of a pair.
fn opened(args: &DifferenceArgs, pair: [usize; 2]) -> Result<Opened, CommandError> {
    let all = args.sources.0.len();
    let iso = match args.isovalues.iso.len() {
        0 | 1 => args.isovalues.iso.clone(),
        count if count == all => pair.map(|n| args.isovalues.iso[n]).to_vec(),
        count => {
            return Err(CommandError::Usage(format!("{count} isovalues are given for {all} scans; give one for all, or one for each")));
        }
    };
    let opened = open(&pair.map(|n| args.sources.0[n].clone()), &Isovalues { iso })?;
    require_spacing(&opened)?;
    let files = pair.map(|n| args.sources.0[n].file.display());
    if opened.volumes.len() != 2 {
        return Err(CommandError::Usage(format!("{} and {} are not one scan each; name scans", files[0], files[1])));
    }
    Ok(opened)
}

/// What stands in a pair's folder, if it is of these scans and this order.
fn stands(args: &DifferenceArgs, opened: &Opened, folder: &Path) -> Option<RecordedDifference> {
    let text = std::fs::read_to_string(record_file(folder)).ok()?;
    standing(&text, &order(args, opened), Origin::of(opened).as_ref())
}

/// Measures a pair into a folder that gets its name once all is in it.
fn measured_beside(
    args: &DifferenceArgs,
    machine: Machine,
    opened: &mut Opened,
    folder: &Path,
    range_mm: Option<f64>,
) -> Result<RecordedDifference, CommandError> {
    let part = folder.with_added_extension("part");
    let measured = measured_into(args, machine, opened, &part, range_mm)?;
    let moved = |reason| CommandError::Move { from: part.clone(), to: folder.to_owned(), reason };
    if folder.exists() {
        warn(&[format!("{}: was of other scans or another order, and is measured anew", folder.display())]);
        std::fs::remove_dir_all(folder).map_err(moved)?;
    }
    std::fs::rename(&part, folder).map_err(moved)?;
    Ok(measured.record(Origin::of(opened).as_ref()))
}

/// The sheet of all pictures.
fn draw_sheet(folder: &Path, rows: &[Row], scale: &Scale) -> Result<(), CommandError> {
    let found = || rows.iter().filter_map(|row| row.found.as_ref().ok().map(|found| (row, found)));
    let Some((_, first)) = found().next() else { return Ok(()) };
    let mut pictures = vec![];
    for (row, _) in found() {
        let file = folder.join(&row.folder).join("first.png");
        let unread = |e| CommandError::Figure { what: format!("the sheet, with {} on it,", file.display()), reason: Box::new(e) };
        pictures.push((row, without_legend(read_figure(&file).map_err(unread)?)));
    }
    let legend = first.difference.order.by.legend(["the first of a pair", "the second"]);
    let figure = sheet(&pictures, scale, &legend).map_err(|reason| CommandError::Figure { what: "the sheet".into(), reason })?;
    Ok(write_figure(&folder.join("sheet.png"), &figure)?)
}
