//! Measurements as files: difference rays as a table to read and as 3D Slicer markups; maps as CSV and PLY. Their CSV is [`crate::csv`].

use crate::difference::Map;
use crate::mesh::Mesh;
use crate::numbers::{fixed, signed, significant};
use crate::record::{Difference, DifferenceRay, Pair, Segment};
use serde_json::{Value, json};
use std::fmt::Write;

pub use crate::numbers::suffix;

/// A table for people: how the volumes differ, for each its crossings and segments, then the ledger.
pub fn table(d: &DifferenceRay) -> String {
    let [ox, oy, oz] = d.ray.origin_mm.map(|mm| fixed(mm, 3));
    let [dx, dy, dz] = d.ray.direction.map(|part| fixed(part, 6));
    let mut out = format!("ray from {ox}, {oy}, {oz} mm along {dx}, {dy}, {dz} (LPS){}\n", extent(d));
    out += &d.notes.iter().map(|note| format!("note: {note}\n")).collect::<String>();
    out += &d.pairs.iter().map(|pair| format!("\n{}", pair_lines(pair))).collect::<String>();
    // Writing to a String cannot fail.
    let mut line = |text: std::fmt::Arguments<'_>| out.write_fmt(text).and_then(|()| out.write_char('\n')).unwrap_or_default();
    for v in &d.volumes {
        let unit = suffix(v.unit);
        let (iso, tolerance) = (significant(v.iso, 6), significant(v.iso_tolerance, 3));
        line(format_args!("\n{}, isovalue {iso} ± {tolerance}{unit}; 95 % of lengths lie within their ± mm", v.name));
        if let Some([first, last]) = v.box_mm {
            line(format_args!("  in the scan from {} to {} mm", fixed(first, 3), fixed(last, 3)));
        }
        match v.meets.absence() {
            Some(why) => line(format_args!("  {why}")),
            None => line(format_args!("  {HEAD}")),
        }
        for (n, s) in v.segments.iter().enumerate() {
            line(format_args!("  {}", row(n, s)));
        }
    }
    line(format_args!("\n{:>10} {:>10} {:>10}  inside", "from mm", "to mm", "length mm"));
    for e in &d.ledger {
        let inside = if e.inside.is_empty() { "–".to_owned() } else { e.inside.join(" + ") };
        let [from, to, length] = [e.from_mm, e.to_mm, e.length_mm].map(|mm| fixed(mm, 3));
        line(format_args!("{from:>10} {to:>10} {length:>10}  {inside}"));
    }
    out
}

/// What of the bone was measured, where that is not all of it.
fn extent(d: &DifferenceRay) -> &'static str {
    if d.as_cut { ", as cut: only what the cuts leave is measured" } else { "" }
}

/// What the ± of a pair's differences is, in words.
pub fn of_their_errors(pair: &Pair) -> String {
    let without = pair.without.map_or(String::new(), |what| format!(", without {what}"));
    format!("95 % of differences lie within their ±{without}")
}

/// A difference in words: `bone 1 − bone 1: +3.214 ± 0.210 mm`.
pub fn difference(d: &Difference) -> String {
    let bones = |numbers: &[usize]| numbers.iter().map(|n| format!("bone {n}")).collect::<Vec<_>>().join(" + ");
    let (mm, error) = (signed(d.difference_mm, 3), fixed(d.uncertainty.error_mm, 3));
    let united = if d.united { "  several stretches in one" } else { "" };
    let partial = if d.partial { "  a part of the bone only" } else { "" };
    let thin = if d.below_resolution { "  thinner than a scan resolves" } else { "" };
    format!("{} − {}: {mm} ± {error} mm{united}{partial}{thin}", bones(&d.b), bones(&d.a))
}

/// A sentence for each stretch that has no partner.
pub fn alone(pair: &Pair) -> Vec<String> {
    let of = |own: &str, other: &str, n: &usize| format!("bone {n} of {own} has no partner in {other}");
    let of_a = pair.only_a.iter().map(|n| of(&pair.a, &pair.b, n));
    of_a.chain(pair.only_b.iter().map(|n| of(&pair.b, &pair.a, n))).collect()
}

fn pair_lines(pair: &Pair) -> String {
    let head = format!("{} − {}: {}\n", pair.b, pair.a, of_their_errors(pair));
    let lines = pair.differences.iter().map(difference).chain(alone(pair));
    head + &lines.map(|line| format!("  {line}\n")).collect::<String>()
}

/// A table for people of many rays, each by its name: how the volumes differ, then the bone segments.
pub fn table_of_rays(rays: &[Named<'_>]) -> String {
    let mut notes: Vec<String> = rays.iter().flat_map(|r| &r.found.notes).map(|note| format!("note: {note}\n")).collect();
    notes.dedup();
    let mut out = notes.concat();
    for r in rays {
        out += &r.found.pairs.iter().map(|pair| format!("{}, {}", r.name, pair_lines(pair))).collect::<String>();
    }
    out += &format!("{}{:<12} {:<24} {HEAD}\n", if out.is_empty() { "" } else { "\n" }, "ray", "volume");
    for r in rays {
        for v in &r.found.volumes {
            let rows = v.segments.iter().enumerate().map(|(n, s)| row(n, s)).chain(v.meets.absence().map(str::to_owned));
            out += &rows.map(|row| format!("{:<12} {:<24} {row}{}\n", r.name, v.name, extent(r.found))).collect::<String>();
        }
    }
    out
}

/// A difference ray by its name.
#[derive(Clone, Copy, Debug)]
pub struct Named<'a> {
    /// What the person calls it.
    pub name: &'a str,
    /// What it found.
    pub found: &'a DifferenceRay,
}

/// The columns of [`row`].
const HEAD: &str = "bone    from mm      to mm  length mm      ± mm  half-max mm  oblique °";

/// Segment `n`, counted from 0.
fn row(n: usize, s: &Segment) -> String {
    let half_maximum = s.half_maximum_mm.map_or("–".to_owned(), |mm| fixed(mm, 3));
    let oblique_deg = fixed(s.obliquity_deg[0].max(s.obliquity_deg[1]), 0);
    let [from, to, length, error] = [s.from_mm, s.to_mm, s.length_mm, s.uncertainty.error_mm].map(|mm| fixed(mm, 3));
    format!("{:>4} {from:>10} {to:>10} {length:>10} {error:>9} {half_maximum:>12} {oblique_deg:>10}{}", n + 1, flags(s))
}

/// What a reader must know about a segment before using its length.
pub fn flags(s: &Segment) -> String {
    let clipped = match (s.cut, s.clipped) {
        (true, _) => "  cut",
        (false, true) => "  cut by the scan's edge",
        (false, false) => "",
    };
    let thin = if s.below_resolution { "  thinner than the scan resolves" } else { "" };
    let inside = if s.from_origin { "  begins inside bone" } else { "" };
    format!("{clipped}{inside}{thin}")
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

/// 3D Slicer's markups JSON v1.0.3, LPS: one Line for each segment of all `rays`. What a segment differs from its partner by is told by its
/// points.
pub fn markups(rays: &[Named<'_>]) -> Value {
    let mut lines = Vec::new();
    for Named { name, found } in rays {
        for (n, v) in found.volumes.iter().enumerate() {
            for (k, s) in v.segments.iter().enumerate() {
                lines.push(markup_line(found, &format!("{name} {} bone {}", v.name, k + 1), s, &differences_of(found, n, k + 1)));
            }
        }
    }
    json!({
        "@schema": MARKUPS_SCHEMA,
        "markups": lines,
    })
}

/// In words, the differences that bone number `bone` (from 1) of a volume, by its number from 0, has a part in.
fn differences_of(d: &DifferenceRay, volume: usize, bone: usize) -> String {
    let has = |numbers: &[usize], of: usize| of == volume && numbers.contains(&bone);
    let of_pair = |pair: &Pair| {
        let its = pair.differences.iter().filter(|d| has(&d.a, pair.volumes[0]) || has(&d.b, pair.volumes[1]));
        its.map(|d| format!("; {} − {}, {} ({})", pair.b, pair.a, difference(d), of_their_errors(pair))).collect::<String>()
    };
    d.pairs.iter().map(of_pair).collect()
}

fn markup_line(d: &DifferenceRay, label: &str, s: &Segment, differences: &str) -> Value {
    let at = |t_mm: f64| -> [f64; 3] { std::array::from_fn(|a| d.ray.origin_mm[a] + t_mm * d.ray.direction[a]) };
    let notes: String = d.notes.iter().map(|note| format!("; {note}")).collect();
    let told = |t_mm: f64| format!("{} mm along the ray{}{differences}{notes}", fixed(t_mm, 3), extent(d));
    let point = |n: usize, t_mm: f64| control_point(n, &format!("{label}-{n}"), &told(t_mm), at(t_mm));
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
        let numbers = [p.x, p.y, p.z, n.x, n.y, n.z, f64::from(*value)].map(|number| fixed(number, 4));
        out += &(numbers.join(",") + "\n");
    }
    out
}

/// A map of differences as CSV: a row for each vertex that is asked for; LPS mm, with the outward normal, the difference with its ±, and what the
/// vertex is compared with. Without a partner the last five are empty.
pub fn difference_csv(mesh: &Mesh, map: &Map, asked: &[bool]) -> String {
    let mut out = "x_mm,y_mm,z_mm,nx,ny,nz,difference_mm,error_mm,partner_x_mm,partner_y_mm,partner_z_mm\n".to_owned();
    let five = |numbers: &[f64]| numbers.iter().map(|number| fixed(*number, 5)).collect::<Vec<_>>().join(",");
    for n in (0..mesh.vertices.len()).filter(|n| asked[*n]) {
        let (p, normal, partner) = (mesh.vertices[n], mesh.normals[n], map.partners_mm[n].as_dvec3());
        let found = [f64::from(map.values_mm[n]), f64::from(map.errors_mm[n]), partner.x, partner.y, partner.z];
        let found = if found[0].is_nan() { ",,,,".to_owned() } else { five(&found) };
        out += &format!("{},{found}\n", five(&[p.x, p.y, p.z, normal.x, normal.y, normal.z]));
    }
    out
}

/// A map of thickness as PLY, with `thickness_mm`, NaN where there is none. `notes` are comments.
pub fn map_ply(mesh: &Mesh, values: &[f32], notes: &[String], color: impl Fn(f32) -> [u8; 3]) -> Vec<u8> {
    ply(mesh, notes, |vertex| color(values[vertex]), &[("thickness_mm", values)])
}

/// A surface as PLY 1.0, binary, little-endian (Turk 1994): vertices with normals, colours and the named `properties`; triangles. `notes` are
/// comments.
pub fn ply(mesh: &Mesh, notes: &[String], color: impl Fn(usize) -> [u8; 3], properties: &[(&str, &[f32])]) -> Vec<u8> {
    let plain = |note: &String| {
        note.chars()
            .map(|c| {
                if c == '×' {
                    'x'
                } else if c.is_ascii() && !c.is_control() {
                    c
                } else {
                    '_'
                }
            })
            .collect::<String>()
    };
    let notes: String = notes.iter().map(|note| format!("comment {}\n", plain(note))).collect();
    let named: String = properties.iter().map(|(name, _)| format!("property float {name}\n")).collect();
    let header = format!(
        "ply\nformat binary_little_endian 1.0\ncomment LPS, mm\n{notes}element vertex {}\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\nproperty float ny\nproperty float nz\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n{named}element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        mesh.vertices.len(),
        mesh.triangles.len()
    );
    let mut out = header.into_bytes();
    for (vertex, (p, n)) in mesh.vertices.iter().zip(&mesh.normals).enumerate() {
        for v in p.as_vec3().to_array().into_iter().chain(n.as_vec3().to_array()) {
            out.extend(v.to_le_bytes());
        }
        out.extend(color(vertex));
        properties.iter().for_each(|(_, values)| out.extend(values[vertex].to_le_bytes()));
    }
    for triangle in &mesh.triangles {
        out.push(3);
        triangle.iter().for_each(|n| out.extend(n.to_le_bytes()));
    }
    out
}
