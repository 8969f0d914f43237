//! The pictures of a sheet: one, several views of the same scans, or those that a file lists.

use super::view::opened;
use crate::cli::args::{Cli, Command, RenderArgs};
use crate::cli::error::CommandError;
use bregma_session::print::{Panel, Print};
use clap::Parser;
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// A plate as its file lists it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Plate {
    /// Pictures beside each other.
    #[serde(default)]
    columns: Option<u32>,
    /// Each by its scans and options, as `bregma render` takes them.
    pictures: Vec<Vec<String>>,
}

/// The pictures that are asked for.
pub(super) fn panels(args: &RenderArgs, print: &mut Print) -> Result<Vec<Panel>, CommandError> {
    let size = (print.size_px[0], print.size_px[1]);
    if let Some(file) = args.print.plate.as_ref().filter(|plate| plate.ends_with(".json")) {
        if !args.sources.0.is_empty() {
            return Err(CommandError::Usage(format!("{file} lists its scans; name none beside it")));
        }
        return listed(Path::new(file), args, print);
    }
    if args.sources.0.is_empty() {
        return Err(CommandError::Usage("no scan is named; name one, or a list of pictures by --plate".into()));
    }
    let opened = opened(args, size)?;
    let panel = |view| Ok(Panel { aim: args.print.aim(view, &args.camera, &opened)?, opened: opened.clone(), coat: None });
    match args.print.plate_views()? {
        Some(views) => views.into_iter().map(|view| panel(Some(view))).collect(),
        None => Ok(vec![panel(args.print.view)?]),
    }
}

fn listed(file: &Path, sheet: &RenderArgs, print: &mut Print) -> Result<Vec<Panel>, CommandError> {
    let fail = |reason: String| CommandError::Plate { file: file.to_owned(), reason };
    let text = std::fs::read_to_string(file).map_err(|e| fail(format!("cannot be read ({e}); check its name and permissions")))?;
    let plate: Plate = serde_json::from_str(&text).map_err(|e| fail(format!("is no list of pictures ({e})")))?;
    if plate.pictures.is_empty() {
        return Err(fail("lists no pictures; give each its scans and options".into()));
    }
    print.columns = print.columns.or(plate.columns);
    let mut panels = vec![];
    for (n, words) in plate.pictures.iter().enumerate() {
        let wrong = |what: &str| fail(format!("picture {}: {what}", n + 1));
        let line = ["bregma", "render"].into_iter().map(str::to_owned).chain(words.iter().cloned());
        let line = line.chain(["--out".to_owned(), sheet.out.display().to_string()]);
        let cli =
            Cli::try_parse_from(line).map_err(|e| wrong(e.to_string().lines().next().unwrap_or_default().trim_start_matches("error: ")))?;
        let Some(Command::Render(mut args)) = cli.command else {
            return Err(wrong("has no scans and options as bregma render takes them"));
        };
        if args.print.plate.is_some() || args.print.print.is_some() {
            return Err(wrong("has a size or a plate of its own; these are the sheet's"));
        }
        if args.sources.0.is_empty() {
            return Err(wrong("names no scan"));
        }
        args.background = sheet.background;
        args.print.print = sheet.print.print;
        args.print.plate.clone_from(&sheet.print.plate);
        let opened = opened(&args, (print.size_px[0], print.size_px[1]))?;
        let aim = args.print.aim(args.print.view, &args.camera, &opened)?;
        panels.push(Panel { opened, aim, coat: None });
    }
    Ok(panels)
}

/// What a list names, so that nothing of it is written over.
pub(super) fn files(args: &RenderArgs) -> Vec<PathBuf> {
    args.print.plate.iter().filter(|plate| plate.ends_with(".json")).map(PathBuf::from).collect()
}
