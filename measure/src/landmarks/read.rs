//! Landmarks from the files that other programs, and this one, write.
//!
//! * 3D Slicer's markups JSON (`.mrk.json`): point lists, LPS or RAS, mm or µm. Points that are `undefined` or `missing`, or have no position,
//!   are missing.
//! * 3D Slicer's fiducial list (`.fcsv`): versions 4 and 5, with `LPS`, `RAS`, `0` (RAS) or `1` (LPS); what does not say, and what has no version,
//!   is RAS, as in Slicer.
//! * Rohlf's TPS (`.tps`): three-dimensional landmarks (`LM3=`), times their `SCALE=`; `NA` is missing. Its axes are taken for LPS, mm.
//! * Morphologika (`.txt`): three-dimensional points of any number of individuals, which are called by numbers; `NA` is missing.
//! * This program's CSV: columns `name`, `x_mm`, `y_mm`, `z_mm`; rows of another `kind` than `landmark` are left out.

use super::landmark::Landmark;
use super::write::TPS_NAMES;
use glam::DVec3;
use serde_json::Value;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Why a file gives no landmarks.
#[derive(Debug, Error)]
#[error("{}: {reason}", file.display())]
pub struct LandmarkError {
    file: PathBuf,
    reason: String,
}

/// A file larger than this is no list of landmarks, so its text is not read.
const MOST_BYTES: u64 = 64 << 20;

/// The landmarks of a file, whose name says its form.
pub fn read(file: &Path) -> Result<Vec<Landmark>, LandmarkError> {
    let fail = |reason: String| LandmarkError { file: file.to_owned(), reason };
    let unreadable = |e: std::io::Error| fail(format!("cannot be read ({e}); check its name and permissions"));
    if std::fs::metadata(file).map_err(unreadable)?.len() > MOST_BYTES {
        return Err(fail("is too large for a list of landmarks; name a smaller one".into()));
    }
    let text = std::fs::read_to_string(file).map_err(unreadable)?;
    let text = text.trim_start_matches('\u{feff}');
    let name = file.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    let landmarks = if name.ends_with(".json") {
        markups(text)
    } else if name.ends_with(".fcsv") {
        fcsv(text)
    } else if name.ends_with(".tps") {
        tps(text)
    } else if name.ends_with(".txt") {
        morphologika(text)
    } else {
        csv(text)
    };
    match landmarks.map_err(fail)? {
        none if none.is_empty() => Err(fail("holds no landmarks; save them again where they were set".into())),
        some => Ok(some),
    }
}

/// A point from RAS or LPS, in LPS.
fn lps(p: [f64; 3], is_ras: bool) -> DVec3 {
    let [x, y, z] = p;
    if is_ras { DVec3::new(-x, -y, z) } else { DVec3::new(x, y, z) }
}

fn markups(text: &str) -> Result<Vec<Landmark>, String> {
    let json: Value = serde_json::from_str(text).map_err(|e| format!("is not JSON ({e}); save the markups again"))?;
    let lists = json["markups"].as_array().ok_or("has no `markups`; save a point list of 3D Slicer as .mrk.json")?;
    let mut landmarks = vec![];
    for list in lists.iter().filter(|list| matches!(list["type"].as_str(), Some("Fiducial" | "PointList"))) {
        let is_ras = match list["coordinateSystem"].as_str() {
            // The schema's default.
            None | Some("LPS") => false,
            Some("RAS") => true,
            Some(other) => return Err(format!("has the coordinate system {other}; save it in LPS or RAS")),
        };
        let unit = &list["coordinateUnits"];
        let in_mm = match unit.as_str().or(unit[0].as_str()) {
            None | Some("mm") => 1.0,
            Some("um") => 1e-3,
            Some(other) => return Err(format!("has coordinates in {other}; save it in mm")),
        };
        let scan = list["name"].as_str().map(str::to_owned);
        for (n, point) in list["controlPoints"].as_array().into_iter().flatten().enumerate() {
            let name = point["label"].as_str().filter(|label| !label.is_empty()).map_or_else(|| (n + 1).to_string(), str::to_owned);
            let is_set = !matches!(point["positionStatus"].as_str(), Some("undefined" | "missing"));
            let point_mm = match &point["position"] {
                position if is_set && !position.is_null() => Some(in_mm * position_of(position, &name, is_ras)?),
                _ => None,
            };
            landmarks.push(Landmark { name, point_mm, scan: scan.clone() });
        }
    }
    Ok(landmarks)
}

fn position_of(position: &Value, name: &str, is_ras: bool) -> Result<DVec3, String> {
    let numbers: Option<Vec<f64>> = position.as_array().and_then(|all| all.iter().map(Value::as_f64).collect());
    let numbers: Option<[f64; 3]> = numbers.and_then(|all| all.try_into().ok());
    numbers.map(|p| lps(p, is_ras)).ok_or_else(|| format!("the position of {name} is not three numbers; correct it"))
}

/// Three fields as a point; `None` where all are empty, or one of the words for what is missing.
fn point(fields: [&str; 3], place: &str) -> Result<Option<[f64; 3]>, String> {
    let is_missing = |field: &&str| matches!(*field, "" | "NA" | "NaN" | "nan");
    if fields.iter().all(is_missing) {
        return Ok(None);
    }
    let numbers = fields.map(|field| field.parse::<f64>().ok().filter(|v| v.is_finite()));
    match numbers {
        [Some(x), Some(y), Some(z)] => Ok(Some([x, y, z])),
        _ => Err(format!("{place} has no three coordinates; correct it")),
    }
}

fn fcsv(text: &str) -> Result<Vec<Landmark>, String> {
    let option = |name: &str| {
        text.lines()
            .filter_map(|l| l.strip_prefix('#'))
            .find_map(|l| l.trim().strip_prefix(name)?.split_once('='))
            .map(|(_, value)| value.trim())
    };
    let is_ras = match option("CoordinateSystem") {
        None | Some("0" | "RAS") => true,
        Some("1" | "LPS") => false,
        Some(other) => return Err(format!("has the coordinate system {other}; save it in LPS or RAS")),
    };
    let columns: Vec<&str> = match (option("columns"), option("Markups fiducial file version")) {
        (Some(columns), _) => columns.split(',').map(str::trim).collect(),
        (None, Some(_)) => vec!["id", "x", "y", "z", "ow", "ox", "oy", "oz", "vis", "sel", "lock", "label"],
        (None, None) => vec!["label", "x", "y", "z", "sel", "vis"],
    };
    let place = |name: &str| columns.iter().position(|c| *c == name).ok_or_else(|| format!("has no column {name}; save it again"));
    let [x, y, z, label] = [place("x")?, place("y")?, place("z")?, place("label")?];
    let rows = text.lines().enumerate().filter(|(_, line)| !(line.trim().is_empty() || line.starts_with('#')));
    let landmark = |(n, line): (usize, &str)| {
        let fields = fields(line);
        let field = |at: usize| fields.get(at).map_or("", |field| field.trim());
        let point = point([field(x), field(y), field(z)], &format!("line {}", n + 1))?;
        let name = if field(label).is_empty() { (n + 1).to_string() } else { field(label).to_owned() };
        Ok(Landmark { name, point_mm: point.map(|p| lps(p, is_ras)), scan: None })
    };
    rows.map(landmark).collect()
}

/// The fields of a line of CSV (RFC 4180).
fn fields(line: &str) -> Vec<String> {
    let (mut fields, mut is_quoted) = (vec![String::new()], false);
    let mut chars = line.trim_end_matches('\r').chars().peekable();
    while let Some(c) = chars.next() {
        // There always is a last field.
        let last = fields.len() - 1;
        match c {
            '"' if is_quoted && chars.peek() == Some(&'"') => fields[last].extend(chars.next()),
            '"' => is_quoted = !is_quoted,
            ',' if !is_quoted => fields.push(String::new()),
            c => fields[last].push(c),
        }
    }
    fields
}

fn csv(text: &str) -> Result<Vec<Landmark>, String> {
    let mut lines = text.lines().enumerate();
    let head = fields(lines.next().map_or("", |(_, line)| line));
    let column = |name: &str| head.iter().position(|c| c.trim() == name);
    let needed = ["name", "x_mm", "y_mm", "z_mm"].map(column);
    let [Some(name), Some(x), Some(y), Some(z)] = needed else {
        return Err("has no columns name, x_mm, y_mm and z_mm; write these in its first line".into());
    };
    let (kind, scan) = (column("kind"), column("scan"));
    let mut landmarks = vec![];
    for (n, line) in lines.filter(|(_, line)| !line.trim().is_empty()) {
        let fields = fields(line);
        let field = |at: usize| fields.get(at).map_or("", |field| field.trim());
        if kind.is_some_and(|kind| field(kind) != "landmark") {
            continue;
        }
        let point = point([field(x), field(y), field(z)], &format!("line {}", n + 1))?;
        let scan = scan.map(field).filter(|scan| !scan.is_empty()).map(str::to_owned);
        landmarks.push(Landmark { name: field(name).to_owned(), point_mm: point.map(DVec3::from), scan });
    }
    Ok(landmarks)
}

fn tps(text: &str) -> Result<Vec<Landmark>, String> {
    let (mut all, mut lines) = (vec![], text.lines().map(str::trim).enumerate().peekable());
    while let Some((n, line)) = lines.next() {
        let (key, count) = line.split_once('=').unwrap_or((line, ""));
        match key.to_uppercase().as_str() {
            "" => continue,
            "LM3" => {}
            "LM" => return Err(format!("line {}: its landmarks are two-dimensional; LM3= is needed", n + 1)),
            _ => return Err(format!("line {} is not LM3=, the number of landmarks; correct it", n + 1)),
        }
        let count: usize = count.trim().parse().map_err(|_| format!("line {}: LM3= is no number; correct it", n + 1))?;
        let mut specimen = vec![];
        for _ in 0..count.min(text.len()) {
            let (n, line) = lines.next().ok_or_else(|| format!("it ends before its {count} landmarks; save it again"))?;
            let words: Vec<&str> = line.split_whitespace().collect();
            let Ok(words) = <[&str; 3]>::try_from(words) else {
                return Err(format!("line {} has no three coordinates; correct it", n + 1));
            };
            let point = point(words, &format!("line {}", n + 1))?;
            specimen.push(Landmark { name: (specimen.len() + 1).to_string(), point_mm: point.map(DVec3::from), scan: None });
        }
        // What else is said of the specimen, up to the next one.
        while let Some((_, line)) = lines.next_if(|(_, line)| !line.to_uppercase().starts_with("LM")) {
            describe(&mut specimen, line)?;
        }
        all.extend(specimen);
    }
    Ok(all)
}

/// Takes a line behind the landmarks of a specimen: its scale, its name, or the names of its landmarks.
fn describe(specimen: &mut [Landmark], line: &str) -> Result<(), String> {
    let Some((key, value)) = line.split_once('=') else { return Ok(()) };
    let value = value.trim();
    match key.to_uppercase().as_str() {
        "SCALE" => {
            let scale: f64 = value.parse().ok().filter(|v: &f64| *v > 0.0).ok_or("its SCALE= is no positive number; correct it")?;
            specimen.iter_mut().filter_map(|l| l.point_mm.as_mut()).for_each(|p| *p *= scale);
        }
        "ID" if !value.is_empty() => specimen.iter_mut().for_each(|l| l.scan = Some(value.to_owned())),
        "COMMENT" => {
            let names = value.strip_prefix(TPS_NAMES).unwrap_or_default().split("; ");
            specimen.iter_mut().zip(names).filter(|(_, name)| !name.is_empty()).for_each(|(l, name)| l.name = name.to_owned());
        }
        _ => {}
    }
    Ok(())
}

fn morphologika(text: &str) -> Result<Vec<Landmark>, String> {
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    // The lines of a part, up to the next.
    let part = |name: &str| {
        let first = lines.iter().position(|line| line.eq_ignore_ascii_case(name)).map_or(lines.len(), |n| n + 1);
        lines.iter().enumerate().skip(first).take_while(|(_, line)| !line.starts_with('[')).filter(|(_, line)| !line.is_empty())
    };
    let number = |name: &str| part(name).next().and_then(|(_, line)| line.parse::<usize>().ok());
    if number("[dimensions]") != Some(3) {
        return Err("its [dimensions] are not 3; three-dimensional landmarks are needed".into());
    }
    let count = number("[landmarks]").filter(|n| *n > 0).ok_or("its [landmarks] are no number; correct it")?;
    let names: Vec<&str> = part("[names]").map(|(_, line)| *line).collect();
    let mut landmarks: Vec<Landmark> = vec![];
    for (n, line) in part("[rawpoints]").filter(|(_, line)| !line.starts_with('\'')) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let Ok(words) = <[&str; 3]>::try_from(words) else { return Err(format!("line {} has no three coordinates; correct it", n + 1)) };
        let point = point(words, &format!("line {}", n + 1))?;
        let scan = names.get(landmarks.len() / count).map(|name| (*name).to_owned());
        landmarks.push(Landmark { name: (landmarks.len() % count + 1).to_string(), point_mm: point.map(DVec3::from), scan });
    }
    Ok(landmarks)
}

#[cfg(test)]
mod tests {
    use super::super::write;
    use super::*;
    use crate::csv::Made;

    fn from(name: &str, text: &str) -> Result<Vec<Landmark>, String> {
        let file = std::env::temp_dir().join(format!("bregma-landmarks-{}-{name}", std::process::id()));
        std::fs::write(&file, text).unwrap();
        let found = read(&file);
        std::fs::remove_file(&file).unwrap();
        found.map_err(|e| e.to_string())
    }

    fn set() -> Vec<Landmark> {
        let of_a = |l: Landmark| Landmark { scan: Some("skull A".into()), ..l };
        let p = DVec3::new(1.25, -80.5, 40.125);
        vec![of_a(Landmark::at("nasion", p)), of_a(Landmark::missing("opisthion")), of_a(Landmark::at("zygion left", -p))]
    }

    #[test]
    fn what_is_written_is_read_again() {
        // Fails if writing and reading do not agree on axes, order, names, what is missing, or whose a landmark is.
        let set = set();
        assert_eq!(from("a.mrk.json", &write::markups(&set, &[]).to_string()).unwrap(), set);
        assert_eq!(from("a.csv", &write::csv(&set, &Made::default())).unwrap(), set);
        assert_eq!(from("a.tps", &write::tps(&set, "skull A", &["moved by a.tfm".into()])).unwrap(), set);
        let numbered = |(n, l): (usize, &Landmark)| Landmark { name: (n + 1).to_string(), ..l.clone() };
        let of_a = |l: Landmark| Landmark { scan: Some("skull_A".into()), ..l };
        let unnamed: Vec<Landmark> = set.iter().enumerate().map(numbered).map(of_a).collect();
        assert_eq!(from("a.txt", &write::morphologika(&set, "skull A")).unwrap(), unnamed);
        let of_none = |l: &Landmark| Landmark { scan: None, ..l.clone() };
        assert_eq!(from("a.fcsv", &write::fcsv(&set, &[])).unwrap(), [of_none(&set[0]), of_none(&set[2])]);
    }

    #[test]
    fn others_files_are_read_in_lps() {
        // Fails if RAS is taken for LPS, or an older form is not understood. The rows are as Slicer 4.5, 4.13 and 3 write them.
        let p = DVec3::new(1.0, 2.0, 3.0);
        let row = "vtkMRMLMarkupsFiducialNode_0,-1,-2,3,0,0,0,1,1,1,0,F-1,,\n";
        let head = |version: &str, system: &str| {
            format!(
                "# Markups fiducial file version = {version}\n# CoordinateSystem = {system}\n# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n"
            )
        };
        for (system, point) in [("0", p), ("RAS", p), ("1", DVec3::new(-1.0, -2.0, 3.0)), ("LPS", DVec3::new(-1.0, -2.0, 3.0))] {
            assert_eq!(from("b.fcsv", &(head("4.5", system) + row)).unwrap(), [Landmark::at("F-1", point)], "{system}");
        }
        assert_eq!(from("c.fcsv", "# name = F\nF-1,-1,-2,3,1,1\n").unwrap(), [Landmark::at("F-1", p)]);
        let markups = r#"{"markups": [{"type": "Line", "controlPoints": [{"position": [9, 9, 9]}]}, {"type": "Fiducial", "coordinateSystem": "RAS",
            "coordinateUnits": ["um", "UCUM", "micrometer"], "controlPoints": [{"label": "n", "position": [-1000, -2000, 3000]},
            {"label": "b", "position": [0, 0, 0], "positionStatus": "missing"}, {"label": "l"}]}]}"#;
        assert_eq!(from("d.mrk.json", markups).unwrap(), [Landmark::at("n", p), Landmark::missing("b"), Landmark::missing("l")]);
        let two = "LM3=1\r\n0.5 1 1.5\r\nIMAGE=a.png\r\nID=first\r\nSCALE=2\r\nLM3=1\r\nNA NA NA\r\nID=second\r\n";
        let named = |l: Landmark, scan: &str| Landmark { scan: Some(scan.into()), ..l };
        assert_eq!(from("e.tps", two).unwrap(), [named(Landmark::at("1", p), "first"), named(Landmark::missing("1"), "second")]);
        assert_eq!(from("f.csv", "\u{feff}name,x_mm,y_mm,z_mm\r\n\"a, b\",1,2,3\r\n").unwrap(), [Landmark::at("a, b", p)]);
    }

    #[test]
    fn damaged_files_never_panic() {
        // Fails if some byte that is missing, doubled or another one ends the program instead of the reading.
        let set = set();
        type Read = fn(&str) -> Result<Vec<Landmark>, String>;
        let forms: [(String, Read); 5] = [
            (write::morphologika(&set, "skull A"), morphologika),
            (write::markups(&set, &[]).to_string(), markups),
            (write::csv(&set, &Made::default()), csv),
            (write::tps(&set, "skull A", &["moved by a.tfm".into()]), tps),
            (write::fcsv(&set, &[]), fcsv),
        ];
        let (mut state, mut refused) = (7_u64, 0);
        let mut random = |count: usize| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as usize % count
        };
        for (text, read) in forms {
            for _ in 0..2000 {
                let mut bytes = text.clone().into_bytes();
                for _ in 0..=random(3) {
                    let at = random(bytes.len());
                    match random(3) {
                        0 => bytes.truncate(at.max(1)),
                        1 => bytes[at] = random(128) as u8,
                        _ => bytes.insert(at, b"\"=,#\n9"[random(6)]),
                    }
                }
                refused += usize::from(read(&String::from_utf8_lossy(&bytes)).is_err());
            }
        }
        assert!(refused > 1000, "{refused}");
    }

    #[test]
    fn what_is_wrong_is_one_sentence_that_names_the_file() {
        // Fails if a file that is none is taken for one, or panics.
        for (name, text, part) in [
            ("g.mrk.json", "{", "is not JSON"),
            ("h.mrk.json", "{}", "no `markups`"),
            ("i.mrk.json", r#"{"markups": [{"type": "Line"}]}"#, "no landmarks"),
            ("j.mrk.json", r#"{"markups": [{"type": "Fiducial", "controlPoints": [{"label": "n", "position": [1]}]}]}"#, "position of n"),
            ("k.mrk.json", r#"{"markups": [{"type": "Fiducial", "coordinateSystem": "IJK"}]}"#, "IJK"),
            ("l.fcsv", "# CoordinateSystem = 2\n", "coordinate system 2"),
            ("m.fcsv", "# CoordinateSystem = LPS\n# columns = id,x\n1,2\n", "column y"),
            ("n.fcsv", "a,1,x,3,1,1\n", "line 1"),
            ("o.tps", "LM=2\n1 2\n3 4\n", "two-dimensional"),
            ("p.tps", "LM3=99999999999\n1 2 3\n", "ends before"),
            ("q.tps", "LM3=1\n1 2\n", "line 2"),
            ("r.tps", "hello\n", "LM3="),
            ("s.tps", "LM3=1\n1 2 3\nSCALE=-1\n", "SCALE="),
            ("t.csv", "a,b\n1,2\n", "x_mm"),
            ("u.csv", "name,x_mm,y_mm,z_mm\nn,1,,3\n", "line 2"),
            ("v.csv", "", "x_mm"),
            ("w.txt", "[dimensions]\n2\n", "three-dimensional"),
            ("x.txt", "[dimensions]\n3\n[landmarks]\nmany\n", "[landmarks]"),
            ("y.txt", "[dimensions]\n3\n[landmarks]\n1\n[rawpoints]\n'#1\n1 2\n", "line 7"),
        ] {
            let said = from(name, text).unwrap_err();
            assert!(said.contains(name) && said.contains(part), "{said}");
        }
    }
}
