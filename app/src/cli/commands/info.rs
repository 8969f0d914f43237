//! `bregma info`: what a scan is.

use crate::cli::args::InfoArgs;
use crate::cli::error::CommandError;
use crate::cli::terminal::{print, warn, with_progress};
use bregma_field::formats::{Scan, Survey};
use bregma_field::{Metadata, Turn, Unit};
use bregma_measure::numbers::{at_most, significant, suffix};
use bregma_session::{InputError, scans};
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
    /// Of the samples.
    bytes: u64,
    /// That opening it needs.
    memory_bytes: u64,
    spacing_is_stated: bool,
    /// What the file states where another was put in its place.
    #[serde(skip_serializing_if = "Option::is_none")]
    stated_spacing_mm: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Turn::is_none")]
    turn: Turn,
    metadata: &'a Metadata,
    warnings: &'a [String],
}

/// Says what each scan is. Its samples stream by; they are not kept.
pub fn info(args: &InfoArgs) -> Result<(), CommandError> {
    for source in &args.sources.0 {
        for scan in with_progress("reading", |progress| scans(std::slice::from_ref(source), progress))? {
            let survey = with_progress("reading", |progress| scan.survey(progress)).map_err(InputError::from)?;
            if args.json {
                let name = scan.name();
                let line = serde_json::to_string(&record(&name, &scan, &survey)).expect("the record has only numbers, texts and lists");
                print(&(line + "\n"))?;
            } else {
                print(&text(&scan, &survey))?;
                warn(&survey.warnings.iter().map(|w| format!("{}: {w}", scan.name())).collect::<Vec<_>>());
            }
        }
    }
    Ok(())
}

fn record<'a>(name: &'a str, scan: &'a Scan, survey: &'a Survey) -> Record<'a> {
    let grid = scan.grid();
    let (m, o) = (grid.index_to_world().matrix3, grid.origin_mm());
    let row = |m: DMat3, r: usize| m.row(r).to_array();
    let world_row = |r: usize| [m.row(r).x, m.row(r).y, m.row(r).z, o[r]];
    Record {
        file: name,
        format: scan.format(),
        dims: grid.dims(),
        spacing_mm: grid.spacing_mm().to_array(),
        origin_mm: o.to_array(),
        direction: [0, 1, 2].map(|r| row(grid.direction(), r)),
        to_world: [world_row(0), world_row(1), world_row(2), [0.0, 0.0, 0.0, 1.0]],
        r#type: survey.type_name,
        slope: survey.summary.slope,
        intercept: survey.summary.intercept,
        unit: survey.summary.unit,
        range: survey.summary.range(),
        otsu: survey.summary.otsu(),
        bytes: survey.sample_bytes,
        memory_bytes: survey.memory_bytes,
        spacing_is_stated: scan.spacing_is_stated(),
        stated_spacing_mm: scan.placing().overridden_mm().map(|mm| mm.to_array()),
        turn: scan.placing().correction().turn,
        metadata: scan.metadata(),
        warnings: &survey.warnings,
    }
}

fn text(scan: &Scan, survey: &Survey) -> String {
    let (grid, summary) = (scan.grid(), &survey.summary);
    let [nx, ny, nz] = grid.dims();
    let list = |v: DVec3| v.to_array().map(|v| at_most(v, 6)).join(", ");
    let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
    let d = grid.direction();
    let unit = suffix(summary.unit);
    let [low, high] = summary.range().map(|v| significant(v, 9));
    let (iso, why) = summary.default_isovalue();
    let stated = scan.placing().overridden_mm().map_or(String::new(), |mm| format!(" instead of {} mm", list(mm)));
    let turn = scan.placing().correction().turn;
    let turned =
        if turn.is_none() { String::new() } else { format!("  turned     {turn}: left, posterior, superior are {}\n", turn.words()) };
    let metadata: String = scan.metadata().iter().map(|(key, value)| format!("  {key}: {value}\n")).collect();
    format!(
        "{}\n  format     {}\n  samples    {nx} × {ny} × {nz} {}, {:.1} MiB; opening needs {:.1} MiB\n  spacing    {} mm{stated}\n{turned}  origin     {} mm (LPS)\n  directions i ({}), j ({}), k ({})\n  values     {low} to {high}{unit}; slope {}, intercept {}\n  isovalue   {}{unit} ({why})\n{metadata}",
        scan.name(),
        scan.format(),
        survey.type_name,
        mib(survey.sample_bytes),
        mib(survey.memory_bytes),
        list(grid.spacing_mm()),
        list(grid.origin_mm()),
        list(d.x_axis),
        list(d.y_axis),
        list(d.z_axis),
        significant(summary.slope, 9),
        significant(summary.intercept, 9),
        at_most(iso, 6),
    )
}
