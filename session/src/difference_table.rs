//! Many scans against one, or all pairs of them: one table, one sheet of pictures at one range of colours, and what of it stands already.

use crate::chart::fonts::{FONT, fonts};
use crate::coat::Figure;
use crate::difference_order::{Order, RecordedHalf};
use crate::difference_picture::Scale;
use crate::measurement::{MeasuredScan, Origin, RecordedDifference};
use crate::shelf::safe_name;
use bregma_measure::csv::line;
use bregma_measure::numbers::{fixed, signed, significant};
use bregma_renderer::Named;
use plotters::prelude::{BitMapBackend, IntoDrawingArea, IntoFont, RGBColor, Rectangle, Text};
use plotters::style::Color;
use serde_json::Value;
use std::error::Error;
use std::path::{Path, PathBuf};

/// A pair, and what came of it.
#[derive(Clone, Debug)]
pub struct Row {
    /// Names of the first and the second scan.
    pub names: [String; 2],
    /// Where its files are, beside the table.
    pub folder: PathBuf,
    /// Its difference, or why there is none.
    pub found: Result<RecordedDifference, String>,
}

/// Numbers of the scans of each pair: each other one against the first, or all pairs.
pub fn pairs(count: usize, all: bool) -> Vec<[usize; 2]> {
    (0..count).flat_map(|a| (a + 1..count).map(move |b| [a, b])).filter(|[a, _]| all || *a == 0).collect()
}

/// The name of a pair's folder: of the second scan where the first is the same for all. `taken` are those of other pairs.
pub fn folder_name([first, second]: [&str; 2], all: bool, taken: &[PathBuf]) -> PathBuf {
    let name = if all { format!("{first} to {second}") } else { second.to_owned() };
    let safe = safe_name(&name);
    // A name of points is a folder of its own meaning.
    let safe = if safe.trim_matches(['.', ' ']).is_empty() { "scan".to_owned() } else { safe };
    let numbered = (2..).map(|n| PathBuf::from(format!("{safe} {n}")));
    // There is always a number that nothing has.
    std::iter::once(PathBuf::from(&safe)).chain(numbered).find(|name| !taken.contains(name)).unwrap_or_default()
}

/// What a record says if it is of this order and these scans, with the isovalues and where they are, whenever it was measured and by whatever
/// version: what was measured is not measured again.
pub fn standing(text: &str, order: &Order, origin: Option<&Origin>) -> Option<RecordedDifference> {
    let record: RecordedDifference = serde_json::from_str(text).ok()?;
    let (then, now) = (record.made_by.as_ref()?, origin?);
    let same = |a: &MeasuredScan, b: &MeasuredScan| {
        let placed = |scan: &MeasuredScan| (scan.layer.iso, scan.layer.transform, scan.layer.residual_mm, scan.layer.covariance.clone());
        a.content == b.content && placed(a) == placed(b)
    };
    let scans = then.scans.len() == now.scans.len() && then.scans.iter().zip(&now.scans).all(|(a, b)| same(a, b));
    (scans && record.difference.order == *order && then.program == now.program).then_some(record)
}

/// Columns of the table with where each stands among a half's statistics.
const COLUMNS: [(&str, &str); 18] = [
    ("area_mm2", "/area_mm2"),
    ("without_mm2", "/without_mm2"),
    ("mean_mm", "/mean_mm"),
    ("mean_error_mm", "/mean_uncertainty/error_mm"),
    ("mean_magnitude_mm", "/mean_magnitude_mm"),
    ("rms_mm", "/rms_mm"),
    ("deviation_mm", "/deviation_mm"),
    ("quantile_2_5_mm", "/quantiles_mm/0"),
    ("quantile_5_mm", "/quantiles_mm/1"),
    ("quantile_25_mm", "/quantiles_mm/2"),
    ("median_mm", "/quantiles_mm/3"),
    ("quantile_75_mm", "/quantiles_mm/4"),
    ("quantile_95_mm", "/quantiles_mm/5"),
    ("quantile_97_5_mm", "/quantiles_mm/6"),
    ("largest_mm", "/largest/difference_mm"),
    ("largest_error_mm", "/largest/error_mm"),
    ("beyond_error", "/sure"),
    ("beyond_error_positive", "/sure_positive"),
];

/// All pairs as CSV, a row for each of both surfaces; one that has no difference says why.
pub fn table(rows: &[Row]) -> String {
    let columns: Vec<&str> =
        ["first", "second", "on", "by", "within_mm"].into_iter().chain(COLUMNS.map(|(name, _)| name)).chain(["folder", "failed"]).collect();
    let mut out = columns.join(",") + "\n";
    for Row { names: [first, second], folder, found } in rows {
        let pair = [("first", first.clone()), ("second", second.clone()), ("folder", folder.display().to_string())];
        match found {
            Ok(RecordedDifference { difference, .. }) => {
                let asked = [("by", difference.order.by.name().to_owned()), ("within_mm", significant(difference.reach_mm, 9))];
                for RecordedHalf { on, statistics } in &difference.halves {
                    let number = |(name, place)| {
                        let value = statistics.as_ref().and_then(|s: &Value| s.pointer(place)).and_then(Value::as_f64);
                        (name, value.map_or(String::new(), |value| significant(value, 9)))
                    };
                    let cells = pair.iter().cloned().chain(asked.clone()).chain([("on", on.clone())]).chain(COLUMNS.map(number));
                    out += &line(&columns, &cells.collect::<Vec<_>>());
                }
            }
            Err(reason) => {
                out += &line(&columns, &pair.into_iter().chain([("failed", reason.clone())]).collect::<Vec<_>>());
            }
        }
    }
    out
}

/// Width of a picture on the sheet, pixels, how many stand beside each other, and what is left around each and for its two lines.
const TILE: u32 = 320;
const ACROSS: u32 = 4;
const GAP: u32 = 12;
const LINES: u32 = 40;
/// Height of the legend at the foot.
const FOOT: u32 = 60;

/// The pictures of all pairs on one sheet, each with its names and numbers, and their colours. `pictures` are rows of the table with RGB pixels,
/// width and height.
pub fn sheet(pictures: &[(&Row, Figure)], scale: &Scale, legend: &str) -> Result<Figure, Box<dyn Error>> {
    fonts();
    let tiles: Vec<Figure> = pictures.iter().map(|(_, figure)| narrowed(figure, TILE)).collect();
    let tall = tiles.iter().map(|(_, _, height)| *height).max().unwrap_or(TILE) + LINES;
    let across = ACROSS.min(tiles.len().max(1) as u32);
    let down = (tiles.len() as u32).div_ceil(across);
    let (width, height) = ((across * (TILE + GAP) + GAP).max(2 * TILE), down * (tall + GAP) + GAP + FOOT);
    let mut rgb = vec![255; (width * height * 3) as usize];
    let at = |n: usize| {
        let n = n as u32;
        (GAP + n % across * (TILE + GAP), GAP + n / across * (tall + GAP))
    };
    for (n, (pixels, wide, high)) in tiles.iter().enumerate() {
        let (x, y) = at(n);
        for row in 0..*high {
            let (to, from) = (((y + row) * width + x) as usize * 3, (row * wide) as usize * 3);
            rgb[to..to + *wide as usize * 3].copy_from_slice(&pixels[from..from + *wide as usize * 3]);
        }
    }
    {
        let area = BitMapBackend::with_buffer(&mut rgb, (width, height)).into_drawing_area();
        let text = |text: String, x: u32, y: u32| Text::new(text, (x as i32, y as i32), (FONT, 13).into_font());
        for (n, (row, _)) in pictures.iter().enumerate() {
            let (x, y) = at(n);
            let below = y + tall - LINES;
            let Ok(found) = &row.found else { continue };
            area.draw(&text(short(&between(&row.names)), x, below + 2))?;
            area.draw(&text(short(&numbers(found)), x, below + 18))?;
        }
        let (top, bar) = (height - FOOT, 240);
        for x in 0..bar {
            let mm = scale.range_mm * (2.0 * f64::from(x) / f64::from(bar - 1) - 1.0);
            let [r, g, b] = scale.color(mm as f32, 0.0);
            let (left, above) = ((GAP + x) as i32, top as i32);
            area.draw(&Rectangle::new([(left, above), (left + 1, above + 14)], RGBColor(r, g, b).filled()))?;
        }
        let end = |mm: f64| format!("{} mm", signed(mm, scale.decimals()));
        area.draw(&text(end(-scale.range_mm), GAP, top + 16))?;
        area.draw(&text(end(scale.range_mm), GAP + bar - 60, top + 16))?;
        area.draw(&text(legend.to_owned(), GAP, top + 36))?;
        area.present()?;
    }
    Ok((rgb, width, height))
}

/// A pair in one line.
pub fn said(names: &[String; 2], found: &RecordedDifference) -> String {
    format!("{}: {}", between(names), numbers(found))
}

fn between([first, second]: &[String; 2]) -> String {
    format!("{second} − {first}")
}

/// Of the first surface that has numbers.
fn numbers(found: &RecordedDifference) -> String {
    let Some(s) = found.difference.halves.iter().find_map(|half| half.statistics.as_ref()) else { return "no difference is known".into() };
    let number = |place: &str| s.pointer(place).and_then(Value::as_f64).unwrap_or(f64::NAN);
    format!(
        "mean {} ± {} mm, {} % beyond its ±",
        signed(number("/mean_mm"), 3),
        fixed(number("/mean_uncertainty/error_mm"), 3),
        fixed(100.0 * number("/sure"), 1)
    )
}

/// So much of a line as fits below a picture.
fn short(text: &str) -> String {
    const MOST: usize = 48;
    if text.chars().count() <= MOST { text.to_owned() } else { text.chars().take(MOST - 1).chain(['…']).collect() }
}

/// A figure of such a width, each pixel the mean of those that it stands for.
fn narrowed((rgb, width, height): &Figure, to: u32) -> Figure {
    let high = (u64::from(*height) * u64::from(to) / u64::from((*width).max(1))).max(1) as u32;
    let span = |n: u32, of: u32, all: u32| {
        let start = u64::from(n) * u64::from(all) / u64::from(of);
        let end = (u64::from(n + 1) * u64::from(all)).div_ceil(u64::from(of));
        start as usize..end as usize
    };
    let mut out = Vec::with_capacity((to * high * 3) as usize);
    for y in 0..high {
        for x in 0..to {
            let (rows, columns) = (span(y, high, *height), span(x, to, *width));
            let count = (rows.len() * columns.len()).max(1);
            for c in 0..3 {
                let sum: usize = rows
                    .clone()
                    .flat_map(|r| columns.clone().map(move |k| (r, k)))
                    .map(|(r, k)| usize::from(rgb[(r * *width as usize + k) * 3 + c]))
                    .sum();
                out.push(((sum + count / 2) / count) as u8);
            }
        }
    }
    (out, to, high)
}

/// Where a pair's record stands in its folder.
pub fn record_file(folder: &Path) -> PathBuf {
    folder.join("difference.json")
}
