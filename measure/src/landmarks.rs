//! Landmarks as files that other programs read; LPS mm throughout.

use glam::DVec3;
use serde_json::{Value, json};
use std::fmt::Write;

/// A named point.
pub type Named<'a> = (&'a str, DVec3);

/// Names cannot break a line or a field.
fn plain(name: &str) -> String {
    name.chars().map(|c| if c == ',' || c == '"' || c.is_control() { '_' } else { c }).collect()
}

/// CSV: name and coordinates.
pub fn csv(landmarks: &[Named<'_>]) -> String {
    lines("name,x_mm,y_mm,z_mm\n".into(), landmarks, |out, _, (name, p)| writeln!(out, "{},{},{},{}", plain(name), p.x, p.y, p.z))
}

/// 3D Slicer's fiducial list, version 4.11.
pub fn fcsv(landmarks: &[Named<'_>]) -> String {
    let head = "# Markups fiducial file version = 4.11\n# CoordinateSystem = LPS\n# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n";
    lines(head.into(), landmarks, |out, n, (name, p)| writeln!(out, "{n},{},{},{},0,0,0,1,1,1,0,{},,", p.x, p.y, p.z, plain(name)))
}

/// Rohlf's TPS, three-dimensional: coordinates in order, then the specimen. Names have no place in it.
pub fn tps(landmarks: &[Named<'_>], specimen: &str) -> String {
    let text = lines(format!("LM3={}\n", landmarks.len()), landmarks, |out, _, (_, p)| writeln!(out, "{} {} {}", p.x, p.y, p.z));
    format!("{text}ID={}\n", plain(specimen))
}

/// Morphologika: one individual.
pub fn morphologika(landmarks: &[Named<'_>], specimen: &str) -> String {
    let head = format!(
        "[individuals]\n1\n[landmarks]\n{}\n[dimensions]\n3\n[names]\n{}\n[rawpoints]\n'#1\n",
        landmarks.len(),
        plain(specimen).replace(' ', "_")
    );
    lines(head, landmarks, |out, _, (_, p)| writeln!(out, "{} {} {}", p.x, p.y, p.z))
}

fn lines(mut out: String, landmarks: &[Named<'_>], line: impl Fn(&mut String, usize, &Named<'_>) -> std::fmt::Result) -> String {
    for (n, landmark) in landmarks.iter().enumerate() {
        // Writing to a String cannot fail.
        line(&mut out, n + 1, landmark).unwrap_or_default();
    }
    out
}

/// 3D Slicer's markups JSON v1.0.3: one list of fiducials.
pub fn markups(landmarks: &[Named<'_>]) -> Value {
    let point = |(n, (name, p)): (usize, &Named<'_>)| crate::export::control_point(n + 1, name, "on the isosurface", p.to_array());
    json!({
        "@schema": crate::export::MARKUPS_SCHEMA,
        "markups": [{
            "type": "Fiducial",
            "coordinateSystem": "LPS",
            "coordinateUnits": "mm",
            "locked": false,
            "labelFormat": "%N-%d",
            "lastUsedControlPointNumber": landmarks.len(),
            "controlPoints": landmarks.iter().enumerate().map(point).collect::<Vec<_>>(),
            "measurements": [],
        }],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_has_every_point_to_the_last_digit() {
        // Fails if a coordinate is rounded, swapped or lost, or a name breaks a line.
        let points = [("nasion", DVec3::new(0.1, -80.123_456_789_012_34, 1.0 / 3.0)), ("a,\"b\nc", DVec3::new(-1e-9, 2.0, 3.0))];
        let numbers = |line: &str, separator: char, skip: usize| -> Vec<f64> {
            line.split(separator).skip(skip).take(3).map(|t| t.parse().unwrap()).collect()
        };
        let check = |text: String, head: usize, separator: char, skip: usize| {
            for (line, (_, p)) in text.lines().skip(head).zip(&points) {
                assert_eq!(numbers(line, separator, skip), p.to_array(), "{line}");
            }
            text
        };
        assert!(check(csv(&points), 1, ',', 1).ends_with("a__b_c,-0.000000001,2,3\n"));
        assert_eq!(check(fcsv(&points), 3, ',', 1).lines().last().unwrap().split(',').count(), 14);
        assert!(check(tps(&points, "skull A"), 1, ' ', 0).starts_with("LM3=2\n"));
        assert!(check(morphologika(&points, "skull A"), 10, ' ', 0).contains("[names]\nskull_A\n"));
        let list = &markups(&points)["markups"][0]["controlPoints"];
        for (n, (name, p)) in points.iter().enumerate() {
            assert_eq!(list[n]["position"], json!(p.to_array()));
            assert_eq!((list[n]["label"].as_str(), list[n]["positionStatus"].as_str()), (Some(*name), Some("defined")));
            assert!(list[n]["description"].is_string());
        }
    }
}
