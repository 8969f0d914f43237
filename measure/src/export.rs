//! Measurements as files: difference rays as a table to read, CSV for statistics, 3D Slicer markups; maps as CSV and PLY.

use crate::mesh::Mesh;
use crate::probe::{DifferenceRay, Segment, VolumeRecord};
use bregma_field::Unit;
use serde_json::{Value, json};
use std::fmt::Write;

/// What stands behind a number of this unit.
pub fn suffix(unit: Unit) -> &'static str {
    match unit {
        Unit::Hounsfield => " HU",
        Unit::Value => "",
    }
}

/// A table for people: for each volume its crossings and segments, then the ledger.
pub fn table(d: &DifferenceRay) -> String {
    let [ox, oy, oz] = d.ray.origin_mm;
    let [dx, dy, dz] = d.ray.direction;
    let mut out = format!("ray from {ox:.3}, {oy:.3}, {oz:.3} mm along {dx:.6}, {dy:.6}, {dz:.6} (LPS)\n");
    // Writing to a String cannot fail.
    let mut line = |text: std::fmt::Arguments<'_>| out.write_fmt(text).and_then(|()| out.write_char('\n')).unwrap_or_default();
    for v in &d.volumes {
        let unit = suffix(v.unit);
        line(format_args!("\n{}, isovalue {} ± {:.1}{unit}; 95 % of lengths lie within their ± mm", v.name, v.iso, v.iso_tolerance));
        let Some([first, last]) = v.box_mm else {
            line(format_args!("  the ray misses this scan"));
            continue;
        };
        line(format_args!("  in the scan from {first:.3} to {last:.3} mm"));
        if v.segments.is_empty() {
            line(format_args!("  no bone"));
        } else {
            line(format_args!("  {HEAD}"));
        }
        for (n, s) in v.segments.iter().enumerate() {
            line(format_args!("  {}", row(n, s)));
        }
    }
    line(format_args!("\n{:>10} {:>10} {:>10}  inside", "from mm", "to mm", "length mm"));
    for e in &d.ledger {
        let inside = if e.inside.is_empty() { "–".to_owned() } else { e.inside.join(" + ") };
        line(format_args!("{:>10.3} {:>10.3} {:>10.3}  {inside}", e.from_mm, e.to_mm, e.length_mm));
    }
    out
}

/// A table for people of the bone segments of many rays, numbered from 1 in their order.
pub fn table_of_rays(rays: &[DifferenceRay]) -> String {
    let mut out = format!("{:>6} {:<24} {HEAD}\n", "ray", "volume");
    for (r, d) in rays.iter().enumerate() {
        for v in &d.volumes {
            for (n, s) in v.segments.iter().enumerate() {
                let row = format!("{:>6} {:<24} {}\n", r + 1, v.name, row(n, s));
                out.push_str(&row);
            }
        }
    }
    out
}

/// The columns of [`row`].
const HEAD: &str = "bone    from mm      to mm  length mm      ± mm  half-max mm  oblique °";

/// Segment `n`, counted from 0.
fn row(n: usize, s: &Segment) -> String {
    let half_maximum = s.half_maximum_mm.map_or("–".to_owned(), |mm| format!("{mm:.3}"));
    let oblique_deg = s.obliquity_deg[0].max(s.obliquity_deg[1]);
    let numbers = format!("{:>4} {:>10.3} {:>10.3} {:>10.3} {:>9.3}", n + 1, s.from_mm, s.to_mm, s.length_mm, s.uncertainty.error_mm);
    format!("{numbers} {half_maximum:>12} {oblique_deg:>10.0}{}", flags(s))
}

/// What a reader must know about a segment before using its length.
pub fn flags(s: &Segment) -> String {
    let clipped = if s.clipped { "  cut by the scan's edge" } else { "" };
    let thin = if s.below_resolution { "  thinner than the scan resolves" } else { "" };
    let inside = if s.from_origin { "  begins inside bone" } else { "" };
    format!("{clipped}{inside}{thin}")
}

/// Generates the columns of difference rays as CSV from one list of names and values: the header, and the row of one segment.
macro_rules! columns {
    (($ray:ident, $volume:ident, $n:ident, $segment:ident) $first:literal: $value:expr, $($name:literal: $other:expr,)*) => {
        /// The columns of [`csv_rows`].
        pub const CSV_HEADER: &str = concat!($first, $(",", $name),*);

        /// Segment `n`, counted from 0, of what the ray with number `ray` found in a volume.
        fn csv_row($ray: usize, $volume: &VolumeRecord, $n: usize, $segment: &Segment) -> String {
            [$value.to_string(), $($other.to_string()),*].join(",") + "\n"
        }
    };
}

columns! {
    (ray, v, n, s)
    "ray": ray,
    "volume": quoted(&v.name),
    "segment": n + 1,
    "iso": v.iso,
    "from_mm": s.from_mm,
    "to_mm": s.to_mm,
    "length_mm": s.length_mm,
    "error_mm": s.uncertainty.error_mm,
    "root_error_mm": s.uncertainty.root_error_mm,
    "threshold_error_mm": s.uncertainty.threshold_error_mm,
    "noise_error_mm": s.uncertainty.noise_error_mm,
    "sampling_error_mm": s.uncertainty.sampling_error_mm,
    "blur_error_mm": s.uncertainty.blur_error_mm,
    "registration_error_mm": known(s.uncertainty.registration_error_mm),
    "obliquity_from_deg": s.obliquity_deg[0],
    "obliquity_to_deg": s.obliquity_deg[1],
    "half_maximum_mm": known(s.half_maximum_mm),
    "resolution_mm": s.resolution_mm,
    "iso_tolerance": v.iso_tolerance,
    "clipped": s.clipped,
    "from_origin": s.from_origin,
    "below_resolution": s.below_resolution,
}

/// A name that cannot break a field.
fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n']) { format!("\"{}\"", name.replace('"', "\"\"")) } else { name.to_owned() }
}

/// A number, or nothing where there is none.
fn known(number: Option<f64>) -> String {
    number.map_or(String::new(), |number| number.to_string())
}

/// One row for each bone segment of the ray with number `ray`.
pub fn csv_rows(ray: usize, d: &DifferenceRay) -> String {
    let rows = |v: &VolumeRecord| v.segments.iter().enumerate().map(|(n, s)| csv_row(ray, v, n, s)).collect::<String>();
    d.volumes.iter().map(rows).collect()
}

/// Difference rays as CSV, numbered from 1 in their order: the columns, and a row for each bone segment.
pub fn csv(rays: &[DifferenceRay]) -> String {
    let rows: String = rays.iter().enumerate().map(|(n, ray)| csv_rows(n + 1, ray)).collect();
    format!("{CSV_HEADER}\n{rows}")
}

/// What 3D Slicer's markups JSON v1.0.3 follows.
pub(crate) const MARKUPS_SCHEMA: &str =
    "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/Schema/markups-schema-v1.0.3.json#";

/// A control point of that form, with number `n` from 1.
pub(crate) fn control_point(n: usize, label: &str, description: &str, position_mm: [f64; 3]) -> Value {
    json!({
        "id": n.to_string(),
        "label": label,
        "description": description,
        "associatedNodeID": "",
        "position": position_mm,
        "orientation": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        "selected": true,
        "locked": true,
        "visibility": true,
        "positionStatus": "defined",
    })
}

/// 3D Slicer's markups JSON v1.0.3, LPS: one Line for each segment of all `rays`.
pub fn markups(rays: &[DifferenceRay]) -> Value {
    let mut lines = Vec::new();
    for (n, d) in rays.iter().enumerate() {
        for v in &d.volumes {
            for (k, s) in v.segments.iter().enumerate() {
                lines.push(markup_line(d, &format!("ray {} {} bone {}", n + 1, v.name, k + 1), s));
            }
        }
    }
    json!({
        "@schema": MARKUPS_SCHEMA,
        "markups": lines,
    })
}

fn markup_line(d: &DifferenceRay, label: &str, s: &Segment) -> Value {
    let at = |t_mm: f64| -> [f64; 3] { std::array::from_fn(|a| d.ray.origin_mm[a] + t_mm * d.ray.direction[a]) };
    let point = |n: usize, t_mm: f64| control_point(n, &format!("{label}-{n}"), &format!("{t_mm} mm along the ray"), at(t_mm));
    json!({
        "type": "Line",
        "coordinateSystem": "LPS",
        "coordinateUnits": "mm",
        "locked": true,
        "labelFormat": "%N-%d",
        "lastUsedControlPointNumber": 2,
        "controlPoints": [point(1, s.from_mm), point(2, s.to_mm)],
        "measurements": [
            { "name": "length", "enabled": true, "value": s.length_mm, "units": "mm", "printFormat": "%-#4.4g%s" },
            { "name": "length error (95 %)", "enabled": true, "value": s.uncertainty.error_mm, "units": "mm", "printFormat": "%-#4.4g%s" },
        ],
    })
}

/// A map as CSV: a row for each vertex that has a value; LPS mm, with the outward normal.
pub fn map_csv(mesh: &Mesh, values: &[f32]) -> String {
    let mut out = "x_mm,y_mm,z_mm,nx,ny,nz,thickness_mm\n".to_owned();
    for ((p, n), value) in mesh.vertices.iter().zip(&mesh.normals).zip(values).filter(|(_, value)| !value.is_nan()) {
        // Writing to a String cannot fail.
        writeln!(out, "{:.4},{:.4},{:.4},{:.4},{:.4},{:.4},{value:.4}", p.x, p.y, p.z, n.x, n.y, n.z).unwrap_or_default();
    }
    out
}

/// A map as PLY 1.0, binary, little-endian (Turk 1994): vertices with normals, colours and `thickness_mm`, NaN where there is none; triangles.
pub fn map_ply(mesh: &Mesh, values: &[f32], color: impl Fn(f32) -> [u8; 3]) -> Vec<u8> {
    let header = format!(
        "ply\nformat binary_little_endian 1.0\ncomment LPS, mm\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\nproperty float ny\nproperty float nz\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty float thickness_mm\nelement face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        mesh.vertices.len(),
        mesh.triangles.len()
    );
    let mut out = header.into_bytes();
    for ((p, n), value) in mesh.vertices.iter().zip(&mesh.normals).zip(values) {
        for v in p.as_vec3().to_array().into_iter().chain(n.as_vec3().to_array()) {
            out.extend(v.to_le_bytes());
        }
        out.extend(color(*value));
        out.extend(value.to_le_bytes());
    }
    for triangle in &mesh.triangles {
        out.push(3);
        triangle.iter().for_each(|n| out.extend(n.to_le_bytes()));
    }
    out
}
