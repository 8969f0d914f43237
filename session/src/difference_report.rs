//! A difference as a page that stands in a supplement: one HTML file with its pictures, tables and what it was made from.

use crate::difference::{Half, Measured};
use crate::measurement::Origin;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use bregma_measure::difference::{Extreme, Statistics};
use bregma_measure::numbers::{fixed, signed};
use bregma_register::{Part, Parts};
use glam::DVec3;

/// The page. `figures` are PNGs, each with its caption.
pub fn html(measured: &Measured, figures: &[(String, Vec<u8>)], made_by: Option<&Origin>) -> String {
    let [first, second] = [&measured.halves[0].name, &measured.halves[1].name].map(|name| plain(name));
    let pictures: String = figures
        .iter()
        .map(|(caption, png)| {
            format!(
                "<figure><img alt=\"{0}\" src=\"data:image/png;base64,{1}\"><figcaption>{0}</figcaption></figure>\n",
                plain(caption),
                STANDARD.encode(png)
            )
        })
        .collect();
    let notes: String = measured.notes.iter().map(|note| format!("<li>{}</li>\n", plain(note))).collect();
    format!(
        "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>{second} − {first}</title>\n<style>{STYLE}</style>\n<h1>{second} − {first}</h1>\n\
         <p>{}. Partners are looked for within {} mm, {}. ± is half the width of the interval that holds a difference in 95 of 100 cases.</p>\n\
         {pictures}<h2>By area</h2>\n{}\n<h2>Largest differences beyond their ±</h2>\n{}\n<h2>Made from</h2>\n{}<ul>\n{notes}</ul>\n</html>\n",
        plain(&measured.legend()),
        fixed(measured.reach_mm, 2),
        plain(&place_of(measured)),
        table(&measured.halves),
        measured.halves.iter().map(extremes).collect::<String>(),
        made_by.map_or(String::new(), origin),
    )
}

/// Where it was measured, in words.
fn place_of(measured: &Measured) -> String {
    let part = |part: &Part| match part {
        Part::Ball { centre_mm, radius_mm } => format!("within {} mm of {}", fixed(*radius_mm, 2), place(*centre_mm)),
        Part::Box { low_mm, high_mm } => format!("between {} and {}", place(*low_mm), place(*high_mm)),
    };
    let list = |parts: &[Part]| parts.iter().map(part).collect::<Vec<_>>().join(" or ");
    let Parts { only, but } = &measured.order.parts;
    let mut words = if only.is_empty() { "everywhere".to_owned() } else { list(only) };
    if !but.is_empty() {
        words += &format!(", but not {}", list(but));
    }
    if !measured.order.clips.is_empty() {
        words += ", of what the cuts leave";
    }
    words
}

const STYLE: &str = "body{font:15px/1.45 sans-serif;max-width:70em;margin:2em auto;padding:0 1em;color:#222}table{border-collapse:collapse;margin:1em 0}\
                     td,th{padding:.2em .8em;text-align:right;border-bottom:1px solid #ddd}th:first-child,td:first-child{text-align:left}\
                     img{max-width:100%}figure{margin:1em 0}figcaption{color:#555}";

fn plain(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A table of rows, of which the first is its head.
fn rows(rows: &[Vec<String>]) -> String {
    let row = |n: usize, cells: &Vec<String>| {
        let tag = if n == 0 { "th" } else { "td" };
        format!("<tr>{}</tr>\n", cells.iter().map(|cell| format!("<{tag}>{}</{tag}>", plain(cell))).collect::<String>())
    };
    format!("<table>\n{}</table>\n", rows.iter().enumerate().map(|(n, cells)| row(n, cells)).collect::<String>())
}

/// The numbers of both surfaces beside each other.
fn table(halves: &[Half; 2]) -> String {
    type Line = (&'static str, fn(&Statistics) -> String);
    const LINES: [Line; 12] = [
        ("area with a difference, mm²", |s| fixed(s.area_mm2, 1)),
        ("area without, mm²", |s| fixed(s.without_mm2, 1)),
        ("mean, mm", |s| format!("{} ± {}", signed(s.mean_mm, 4), fixed(s.mean_uncertainty.error_mm, 4))),
        ("mean of magnitudes, mm", |s| fixed(s.mean_magnitude_mm, 4)),
        ("root mean square, mm", |s| fixed(s.rms_mm, 4)),
        ("standard deviation, mm", |s| fixed(s.deviation_mm, 4)),
        ("2.5, 5, 25 % below, mm", |s| s.quantiles_mm[..3].iter().map(|q| signed(*q, 3)).collect::<Vec<_>>().join(", ")),
        ("median, mm", |s| signed(s.quantiles_mm[3], 3)),
        ("75, 95, 97.5 % below, mm", |s| s.quantiles_mm[4..].iter().map(|q| signed(*q, 3)).collect::<Vec<_>>().join(", ")),
        ("largest magnitude, mm", |s| fixed(s.largest.difference_mm.abs(), 4)),
        ("area beyond its ±, %", |s| fixed(100.0 * s.sure, 2)),
        ("area beyond its ± and positive, %", |s| fixed(100.0 * s.sure_positive, 2)),
    ];
    let mut all = vec![vec!["".to_owned(), format!("on {}", halves[0].name), format!("on {}", halves[1].name)]];
    all.extend(LINES.iter().map(|(name, cell)| {
        let of = |half: &Half| half.statistics.as_ref().map_or("–".to_owned(), cell);
        vec![(*name).to_owned(), of(&halves[0]), of(&halves[1])]
    }));
    rows(&all)
}

fn place(p: DVec3) -> String {
    p.to_array().map(|mm| fixed(mm, 2)).join(", ")
}

/// The largest differences on one surface.
fn extremes(half: &Half) -> String {
    let Some(statistics) = half.statistics.as_ref().filter(|s| !s.extremes.is_empty()) else {
        return format!("<p>None on {}.</p>\n", plain(&half.name));
    };
    let mut all = vec![[format!("on {}", half.name), "difference, mm".into(), "at L, P, S, mm".into(), "partner at".into()].to_vec()];
    all.extend(statistics.extremes.iter().enumerate().map(|(n, e): (usize, &Extreme)| {
        let difference = format!("{} ± {}", signed(e.difference_mm, 3), fixed(e.error_mm, 3));
        vec![(n + 1).to_string(), difference, place(e.at_mm), place(e.partner_mm)]
    }));
    rows(&all)
}

/// What it was made from; the record beside the page has all that makes it again.
fn origin(origin: &Origin) -> String {
    let mut all = vec![["scan".to_owned(), "isovalue".into(), "content, SHA-256".into(), "moved by (rows, mm)".into()].to_vec()];
    all.extend(origin.scans.iter().map(|scan| {
        let columns = scan.layer.transform.to_cols_array_2d();
        let row = |n: usize| columns.map(|column| fixed(column[n], 6)).join(" ");
        let moved = [0, 1, 2].map(row).join("; ");
        vec![scan.source.file.display().to_string(), fixed(scan.layer.iso, 3), scan.content.clone(), moved]
    }));
    let date = origin.date.as_deref().unwrap_or("");
    format!("<p>{} {}</p>\n{}", plain(&origin.program), plain(date), rows(&all))
}
