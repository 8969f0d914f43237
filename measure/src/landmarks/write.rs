//! Landmarks as files that other programs read; LPS mm throughout. Text has six decimals of a millimetre, see [`crate::numbers`]; JSON has all.

use super::landmark::Landmark;
use crate::csv::{Made, line, mm};
use crate::numbers::at_most;
use glam::DVec3;
use serde_json::{Value, json};

/// Names cannot break a line or a field.
fn plain(name: &str) -> String {
    name.chars().map(|c| if c == ',' || c == '"' || c.is_control() { '_' } else { c }).collect()
}

/// The three numbers with something between them.
fn numbers(p: DVec3, between: &str) -> String {
    p.to_array().map(mm).join(between)
}

/// The columns of [`csv`].
const COLUMNS: [&str; 13] =
    ["kind", "name", "second", "third", "x_mm", "y_mm", "z_mm", "distance_mm", "angle_deg", "scan", "program", "date", "note"];

/// More landmarks than this have distances but no angles in their table: 20 have 3,420 of them, and 100 would have half a million.
const MOST_WITH_ANGLES: usize = 20;

/// A tidy CSV table, as [`crate::csv`] writes it: a row for each landmark, with empty coordinates where it is missing; one for the distance of
/// each two from each other; and one for each angle, at `name` between `second` and `third`.
pub fn csv(landmarks: &[Landmark], made: &Made) -> String {
    let shared = |scan: &Option<String>| {
        let note = ("note", made.notes.join("; "));
        [("scan", scan.clone().unwrap_or_default()), ("program", made.program.clone()), ("date", made.date.clone()), note]
    };
    let row = |own: &[(&'static str, String)], scan: &Option<String>| line(&COLUMNS, &[own, &shared(scan)].concat());
    let mut out = line(&COLUMNS, &COLUMNS.map(|name| (name, name.to_owned())));
    for l in landmarks {
        let [x, y, z] = l.point_mm.map_or_else(Default::default, |p| p.to_array().map(mm));
        out += &row(&[("kind", "landmark".into()), ("name", l.name.clone()), ("x_mm", x), ("y_mm", y), ("z_mm", z)], &l.scan);
    }
    let set: Vec<(&Landmark, DVec3)> = landmarks.iter().filter_map(|l| Some((l, l.point_mm?))).collect();
    let names = |a: &Landmark, b: &Landmark| [("name", a.name.clone()), ("second", b.name.clone())];
    // What is between landmarks of two scans belongs to neither.
    let of = |all: &[&Landmark]| all[0].scan.clone().filter(|scan| all.iter().all(|l| l.scan.as_ref() == Some(scan)));
    for (n, (a, p)) in set.iter().enumerate() {
        for (b, q) in &set[n + 1..] {
            let own = [&[("kind", "distance".into()), ("distance_mm", mm(p.distance(*q)))][..], &names(a, b)].concat();
            out += &row(&own, &of(&[a, b]));
        }
    }
    for (at, (a, p)) in set.iter().enumerate().filter(|_| set.len() <= MOST_WITH_ANGLES) {
        let others: Vec<_> = set.iter().enumerate().filter(|(n, _)| *n != at).map(|(_, other)| other).collect();
        for (n, (b, q)) in others.iter().enumerate() {
            for (c, r) in &others[n + 1..] {
                let Some(degrees) = angle_deg(*q - *p, *r - *p) else { continue };
                let own = [&[("kind", "angle".into()), ("third", c.name.clone()), ("angle_deg", at_most(degrees, 6))][..], &names(a, b)];
                out += &row(&own.concat(), &of(&[a, b, c]));
            }
        }
    }
    out
}

/// The angle between two directions, degrees; `None` where one has no length.
fn angle_deg(a: DVec3, b: DVec3) -> Option<f64> {
    let is_some = a.length() > 0.0 && b.length() > 0.0;
    // Precise near 0 and 180 degrees too, where the cosine is not.
    is_some.then(|| a.cross(b).length().atan2(a.dot(b)).to_degrees())
}

/// 3D Slicer's fiducial list, version 4.11, with `notes` as what is said of each point. It has no way to say that a point is missing: those are
/// left out.
pub fn fcsv(landmarks: &[Landmark], notes: &[String]) -> String {
    let head = "# Markups fiducial file version = 4.11\n# CoordinateSystem = LPS\n# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n";
    let set = landmarks.iter().filter_map(|l| Some((&l.name, l.point_mm?)));
    let notes = plain(&notes.join("; "));
    let rows = set.enumerate().map(|(n, (name, p))| format!("{},{},0,0,0,1,1,1,0,{},{notes},\n", n + 1, numbers(p, ","), plain(name)));
    head.to_owned() + &rows.collect::<String>()
}

/// The names of landmarks in a TPS file's comment stand behind this, with a semicolon between them.
pub(super) const TPS_NAMES: &str = "landmarks: ";

/// Rohlf's TPS, three-dimensional: coordinates in order, then the specimen. What is missing is `NA`, as geomorph's `readland.tps` reads it. The
/// form has no place for names, nor for `notes`; each stands in a comment, which other programs skip.
pub fn tps(landmarks: &[Landmark], specimen: &str, notes: &[String]) -> String {
    let points: String = landmarks.iter().map(|l| point_or(l, "NA NA NA") + "\n").collect();
    let names: Vec<String> = landmarks.iter().map(|l| plain(&l.name).replace(';', "_")).collect();
    let notes: String = notes.join("; ").chars().map(|c| if c.is_control() { '_' } else { c }).collect();
    let notes = if notes.is_empty() { notes } else { format!("COMMENT=notes: {notes}\n") };
    format!("LM3={}\n{points}ID={}\nCOMMENT={TPS_NAMES}{}\n{notes}", landmarks.len(), plain(specimen), names.join("; "))
}

fn point_or(landmark: &Landmark, missing: &str) -> String {
    landmark.point_mm.map_or(missing.to_owned(), |p| numbers(p, " "))
}

/// Morphologika: one individual. What is missing is `NA`, as in TPS. Names of landmarks have no place in it.
pub fn morphologika(landmarks: &[Landmark], specimen: &str) -> String {
    let head = format!(
        "[individuals]\n1\n[landmarks]\n{}\n[dimensions]\n3\n[names]\n{}\n[rawpoints]\n'#1\n",
        landmarks.len(),
        plain(specimen).replace(' ', "_")
    );
    head + &landmarks.iter().map(|l| point_or(l, "NA NA NA") + "\n").collect::<String>()
}

/// 3D Slicer's markups JSON v1.0.3: a list of fiducials for each scan, which it is named after. A missing point is `undefined`, without a
/// position: that is what the schema has for it, and Slicer lists it as one to be placed. `notes` are in what is said of each point.
pub fn markups(landmarks: &[Landmark], notes: &[String]) -> Value {
    let mut scans: Vec<&Option<String>> = vec![];
    for l in landmarks {
        if !scans.contains(&&l.scan) {
            scans.push(&l.scan);
        }
    }
    let lists = scans.iter().map(|scan| list(scan.as_deref(), &landmarks.iter().filter(|l| l.scan == **scan).collect::<Vec<_>>(), notes));
    json!({ "@schema": crate::export::MARKUPS_SCHEMA, "markups": lists.collect::<Vec<_>>() })
}

fn list(scan: Option<&str>, landmarks: &[&Landmark], notes: &[String]) -> Value {
    let told = |what: &str| [what.to_owned()].iter().chain(notes).cloned().collect::<Vec<_>>().join("; ");
    let point = |(n, l): (usize, &&Landmark)| match l.point_mm {
        Some(p) => crate::export::control_point(n + 1, &l.name, &told("on the isosurface"), (p + DVec3::ZERO).to_array()),
        None => {
            let mut point = crate::export::control_point(n + 1, &l.name, &told("missing"), [0.0; 3]);
            point["positionStatus"] = "undefined".into();
            if let Some(fields) = point.as_object_mut() {
                fields.remove("position");
            }
            point
        }
    };
    let mut list = json!({
        "type": "Fiducial",
        "coordinateSystem": "LPS",
        "coordinateUnits": "mm",
        "locked": false,
        "labelFormat": "%N-%d",
        "lastUsedControlPointNumber": landmarks.len(),
        "controlPoints": landmarks.iter().enumerate().map(point).collect::<Vec<_>>(),
        "measurements": [],
    });
    if let Some(scan) = scan {
        list["name"] = scan.into();
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points() -> [Landmark; 3] {
        let of_a = |l: Landmark| Landmark { scan: Some("skull A".into()), ..l };
        [
            of_a(Landmark::at("nasion", DVec3::new(0.1, -80.123_456_789_012_34, 1.0 / 3.0))),
            of_a(Landmark::missing("opisthion")),
            Landmark::at("a,\"b\nc", DVec3::new(-1e-9, 2.0, 3.0)),
        ]
    }

    #[test]
    fn every_form_has_every_point_and_says_what_is_missing() {
        // Fails if a coordinate is swapped or lost or a negative zero, a name breaks a line, or a missing point gets coordinates.
        let (points, notes) = (points(), ["a is turned".to_owned()]);
        let table = csv(&points, &Made { program: "bregma 0".into(), notes: notes.clone().into(), ..Made::default() });
        let lines: Vec<&str> = table.lines().collect();
        assert_eq!(lines[1], "landmark,nasion,,,0.1,-80.123457,0.333333,,,skull A,bregma 0,,a is turned");
        assert_eq!(lines[2], "landmark,opisthion,,,,,,,,skull A,bregma 0,,a is turned");
        assert_eq!(lines[3], "landmark,\"a,\"\"b c\",,,0,2,3,,,,bregma 0,,a is turned");
        assert!(lines[4].starts_with("distance,nasion,\"a,\"\"b c\",,,,,82.166801,") && lines.len() == 5, "{table}");
        let text = fcsv(&points, &[]);
        assert_eq!(
            text.lines().skip(3).collect::<Vec<_>>(),
            ["1,0.1,-80.123457,0.333333,0,0,0,1,1,1,0,nasion,,", "2,0,2,3,0,0,0,1,1,1,0,a__b_c,,"]
        );
        let plain = "LM3=3\n0.1 -80.123457 0.333333\nNA NA NA\n0 2 3\nID=skull A\nCOMMENT=landmarks: nasion; opisthion; a__b_c\n";
        assert_eq!(tps(&points, "skull A", &[]), plain);
        assert_eq!(tps(&points, "skull A", &["a is\nturned".into()]), format!("{plain}COMMENT=notes: a is_turned\n"));
        assert!(morphologika(&points, "skull A").contains("[names]\nskull_A\n") && morphologika(&points, "x").contains("\nNA NA NA\n"));
        let lists = &markups(&points, &[])["markups"];
        let first = &lists[0]["controlPoints"];
        // What was corrected of the scans goes along where there is a place for it.
        assert!(fcsv(&points, &notes).contains(",nasion,a is turned,\n"));
        assert_eq!(markups(&points, &notes)["markups"][0]["controlPoints"][0]["description"], "on the isosurface; a is turned");
        assert_eq!((lists[0]["name"].as_str(), lists[1].get("name")), (Some("skull A"), None));
        assert_eq!(first[0]["position"], json!([0.1, -80.123_456_789_012_34, 1.0 / 3.0]));
        assert_eq!((first[1]["positionStatus"].as_str(), first[1].get("position")), (Some("undefined"), None));
        assert_eq!(lists[1]["controlPoints"][0]["label"], "a,\"b\nc");
    }

    #[test]
    fn distances_and_angles_are_those_of_a_triangle() {
        // Fails if an angle is at another point than its row says, or one is left out.
        let corners = [("a", DVec3::ZERO), ("b", DVec3::X * 3.0), ("c", DVec3::Y * 4.0)].map(|(name, p)| Landmark::at(name, p));
        let table = csv(&corners, &Made::default());
        for row in [
            "distance,a,b,,,,,3,,,,,",
            "distance,a,c,,,,,4,,,,,",
            "distance,b,c,,,,,5,,,,,",
            "angle,a,b,c,,,,,90,,,,",
            "angle,b,a,c,,,,,53.130102,,,,",
            "angle,c,a,b,,,,,36.869898,,,,",
        ] {
            assert!(table.lines().any(|line| line == row), "{row} is missing in {table}");
        }
        assert_eq!(table.lines().count(), 1 + 3 + 3 + 3);
    }
}
