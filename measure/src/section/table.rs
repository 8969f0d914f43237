//! A section as one tidy CSV table: a row for each landmark on the curve, and then for each station.

use super::{Length, Mark, Station};
use crate::csv::{Made, line, mm};
use crate::numbers::at_most;
use glam::DVec3;

/// The columns.
const COLUMNS: [&str; 26] = [
    "kind",
    "landmark",
    "along_mm",
    "off_mm",
    "x_mm",
    "y_mm",
    "z_mm",
    "normal_x",
    "normal_y",
    "normal_z",
    "first",
    "second",
    "first_thickness_mm",
    "first_thickness_error_mm",
    "second_thickness_mm",
    "second_thickness_error_mm",
    "thickness_difference_mm",
    "thickness_difference_error_mm",
    "surface_difference_mm",
    "surface_difference_error_mm",
    "partner_x_mm",
    "partner_y_mm",
    "partner_z_mm",
    "note",
    "program",
    "date",
];

type Cells = Vec<(&'static str, String)>;

/// Stations and landmarks of a section of one or two scans by their `names`. What is not known is empty.
pub fn csv(stations: &[Station], marks: &[Mark], names: &[String], notes: &[String], made: &Made) -> String {
    let name = |n: usize| names.get(n).cloned().unwrap_or_default();
    let shared: Cells = vec![
        ("first", name(0)),
        ("second", name(1)),
        ("note", notes.join("; ")),
        ("program", made.program.clone()),
        ("date", made.date.clone()),
    ];
    let of_mark = |mark: &Mark| {
        vec![("kind", "landmark".to_owned()), ("landmark", mark.name.clone()), ("along_mm", mm(mark.along_mm)), ("off_mm", mm(mark.off_mm))]
    };
    let rows = marks.iter().map(of_mark).chain(stations.iter().map(of_station));
    let head = line(&COLUMNS, &COLUMNS.map(|column| (column, column.to_owned())));
    head + &rows.map(|own| line(&COLUMNS, &[own, shared.clone()].concat())).collect::<String>()
}

fn of_station(station: &Station) -> Cells {
    let mut cells: Cells = vec![("kind", "station".into()), ("along_mm", mm(station.along_mm))];
    let mut point = |columns: [&'static str; 3], point: DVec3| cells.extend(columns.into_iter().zip(point.to_array().map(mm)));
    point(["x_mm", "y_mm", "z_mm"], station.point_mm);
    if let Some(partner_mm) = station.partner_mm {
        point(["partner_x_mm", "partner_y_mm", "partner_z_mm"], partner_mm);
    }
    // Nine decimals of a direction are less than a nanometre a metre away.
    cells.extend(["normal_x", "normal_y", "normal_z"].into_iter().zip(station.normal.to_array().map(|part| at_most(part, 9))));
    let mut length = |columns: [&'static str; 2], found: Option<Length>| {
        cells.extend(found.map(|length| columns.into_iter().zip([mm(length.mm), mm(length.error_mm)])).into_iter().flatten());
    };
    length(["first_thickness_mm", "first_thickness_error_mm"], station.thickness);
    length(["second_thickness_mm", "second_thickness_error_mm"], station.second_thickness);
    length(["thickness_difference_mm", "thickness_difference_error_mm"], station.thickness_difference);
    length(["surface_difference_mm", "surface_difference_error_mm"], station.surface_difference);
    cells
}
