//! Difference rays as one tidy CSV table: a row for each observation, of the kind that its first column says.
//!
//! Written as R's `read.csv` and pandas' `read_csv` read by default (RFC 4180): UTF-8, a header, commas, as many fields in every row, quotes
//! only where a field needs them, empty fields for what is not there. Numbers are rounded as [`crate::numbers`] says.

use crate::export::Named;
use crate::numbers::{at_most, significant};
use crate::record::{Difference, DifferenceRay, Pair, VolumeRecord};
use crate::uncertainty::Uncertainty;
use bregma_field::Unit;

/// What stands in every row: what was measured by, and when.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Made {
    /// Program and version.
    pub program: String,
    /// RFC 3339, UTC.
    pub date: String,
    /// The file of each scan, by its number among all volumes; empty for scans without files.
    pub files: Vec<String>,
    /// What was corrected of where the scans lie, in sentences; rays have these among their own notes.
    pub notes: Vec<String>,
}

/// The columns.
pub const COLUMNS: [&str; 49] = [
    "kind",
    "ray",
    "name",
    "volume",
    "segment",
    "against",
    "against_segment",
    "from_mm",
    "to_mm",
    "length_mm",
    "difference_mm",
    "error_mm",
    "root_error_mm",
    "threshold_error_mm",
    "noise_error_mm",
    "sampling_error_mm",
    "slice_error_mm",
    "blur_error_mm",
    "registration_error_mm",
    "error_without",
    "from_shift_mm",
    "from_shift_error_mm",
    "to_shift_mm",
    "to_shift_error_mm",
    "obliquity_from_deg",
    "obliquity_to_deg",
    "half_maximum_mm",
    "resolution_mm",
    "clipped",
    "cut",
    "from_origin",
    "below_resolution",
    "united",
    "partial",
    "inside",
    "isovalue",
    "isovalue_tolerance",
    "isovalue_unit",
    "file",
    "as_cut",
    "note",
    "origin_x_mm",
    "origin_y_mm",
    "origin_z_mm",
    "direction_x",
    "direction_y",
    "direction_z",
    "program",
    "date",
];

type Cells = Vec<(&'static str, String)>;

/// One line of a table with such columns; a cell that is not given is empty.
pub fn line(columns: &[&str], cells: &[(&str, String)]) -> String {
    let cell = |column: &&str| cells.iter().find(|(name, _)| name == column).map_or(String::new(), |(_, value)| field(value));
    columns.iter().map(cell).collect::<Vec<_>>().join(",") + "\n"
}

/// A text as a field: on one line, without spaces around it, and in quotes where it would else break the row.
fn field(text: &str) -> String {
    let plain: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    let plain = plain.trim();
    if plain.contains([',', '"']) { format!("\"{}\"", plain.replace('"', "\"\"")) } else { plain.to_owned() }
}

/// Nanometres: see [`crate::numbers`].
pub(crate) fn mm(value: f64) -> String {
    at_most(value, 6)
}

fn known(value: Option<f64>) -> String {
    value.map_or(String::new(), mm)
}

/// Difference rays, numbered from 1 in their order: for each ray its differences, what has no partner, its stretches and its ledger.
pub fn rays(rays: &[Named<'_>], made: &Made) -> String {
    let rows = rays.iter().enumerate().flat_map(|(n, ray)| {
        let shared = of_ray(n + 1, ray, made);
        rows(ray.found, made).map(move |own| line(&COLUMNS, &[own, shared.clone()].concat()))
    });
    line(&COLUMNS, &COLUMNS.map(|name| (name, name.to_owned()))) + &rows.collect::<String>()
}

/// What each row of a ray has.
fn of_ray(number: usize, Named { name, found }: &Named<'_>, made: &Made) -> Cells {
    let [ox, oy, oz] = found.ray.origin_mm.map(mm);
    // Nine decimals of a direction are less than a nanometre a metre away.
    let [dx, dy, dz] = found.ray.direction.map(|part| at_most(part, 9));
    vec![
        ("ray", number.to_string()),
        ("name", (*name).to_owned()),
        ("as_cut", found.as_cut.to_string()),
        ("note", found.notes.join("; ")),
        ("origin_x_mm", ox),
        ("origin_y_mm", oy),
        ("origin_z_mm", oz),
        ("direction_x", dx),
        ("direction_y", dy),
        ("direction_z", dz),
        ("program", made.program.clone()),
        ("date", made.date.clone()),
    ]
}

fn rows<'a>(d: &'a DifferenceRay, made: &'a Made) -> impl Iterator<Item = Cells> + 'a {
    let differences = d.pairs.iter().flat_map(|pair| pair.differences.iter().map(|d| of_difference(pair, d)).chain(alone(pair)));
    let stretches = d.volumes.iter().flat_map(|v| (0..v.segments.len()).map(|n| of_stretch(v, n, made)));
    let ledger = d.ledger.iter().map(|e| {
        vec![
            ("kind", "ledger".into()),
            ("from_mm", mm(e.from_mm)),
            ("to_mm", mm(e.to_mm)),
            ("length_mm", mm(e.length_mm)),
            ("inside", e.inside.join(" + ")),
        ]
    });
    differences.chain(stretches).chain(ledger)
}

/// A length's or a difference's ± and its parts.
fn errors(u: &Uncertainty) -> Cells {
    vec![
        ("error_mm", mm(u.error_mm)),
        ("root_error_mm", mm(u.root_error_mm)),
        ("threshold_error_mm", mm(u.threshold_error_mm)),
        ("noise_error_mm", mm(u.noise_error_mm)),
        ("sampling_error_mm", mm(u.sampling_error_mm)),
        ("slice_error_mm", mm(u.slice_error_mm)),
        ("blur_error_mm", mm(u.blur_error_mm)),
        ("registration_error_mm", known(u.registration_error_mm)),
    ]
}

/// A pair's difference: of what stands in `volume` less what stands in `against`.
fn of_difference(pair: &Pair, d: &Difference) -> Cells {
    let numbers = |list: &[usize]| list.iter().map(usize::to_string).collect::<Vec<_>>().join("+");
    let cells = vec![
        ("kind", "difference".into()),
        ("volume", pair.b.clone()),
        ("segment", numbers(&d.b)),
        ("against", pair.a.clone()),
        ("against_segment", numbers(&d.a)),
        ("difference_mm", mm(d.difference_mm)),
        ("error_without", pair.without.unwrap_or_default().into()),
        ("from_shift_mm", known(d.from_shift.map(|s| s.shift_mm))),
        ("from_shift_error_mm", known(d.from_shift.map(|s| s.error_mm))),
        ("to_shift_mm", known(d.to_shift.map(|s| s.shift_mm))),
        ("to_shift_error_mm", known(d.to_shift.map(|s| s.error_mm))),
        ("partial", d.partial.to_string()),
        ("below_resolution", d.below_resolution.to_string()),
        ("united", d.united.to_string()),
    ];
    cells.into_iter().chain(errors(&d.uncertainty)).collect()
}

fn alone(pair: &Pair) -> impl Iterator<Item = Cells> {
    let of = |own: &str, other: &str, n: usize| {
        vec![("kind", "alone".into()), ("volume", own.into()), ("segment", n.to_string()), ("against", other.into())]
    };
    let of_a = pair.only_a.iter().map(move |n| of(&pair.a, &pair.b, *n));
    of_a.chain(pair.only_b.iter().map(move |n| of(&pair.b, &pair.a, *n)))
}

fn of_stretch(v: &VolumeRecord, n: usize, made: &Made) -> Cells {
    let s = &v.segments[n];
    let cells = vec![
        ("kind", "stretch".into()),
        ("volume", v.name.clone()),
        ("segment", (n + 1).to_string()),
        ("from_mm", mm(s.from_mm)),
        ("to_mm", mm(s.to_mm)),
        ("length_mm", mm(s.length_mm)),
        ("obliquity_from_deg", mm(s.obliquity_deg[0])),
        ("obliquity_to_deg", mm(s.obliquity_deg[1])),
        ("half_maximum_mm", known(s.half_maximum_mm)),
        ("resolution_mm", mm(s.resolution_mm)),
        ("clipped", s.clipped.to_string()),
        ("cut", s.cut.to_string()),
        ("from_origin", s.from_origin.to_string()),
        ("below_resolution", s.below_resolution.to_string()),
        ("isovalue", significant(v.iso, 9)),
        ("isovalue_tolerance", significant(v.iso_tolerance, 9)),
        ("isovalue_unit", if v.unit == Unit::Hounsfield { "HU" } else { "value" }.into()),
        ("file", made.files.get(v.index).cloned().unwrap_or_default()),
    ];
    cells.into_iter().chain(errors(&s.uncertainty)).collect()
}
