//! Lengths in every form, and lengths measured again.

use super::*;

#[test]
fn probes_come_in_every_form() {
    let d = folder("probe");
    nrrd(&d.join("ball.nrrd"), CUBE, &ball());
    let cast = "probe ball.nrrd --iso 0 --origin 7.5,7.5,-20 --direction 0,0,1 --format";
    let json: Value = serde_json::from_str(&stdout(&ok(&d, &format!("{cast} json")))).unwrap();
    let segment = &json["volumes"][0]["segments"][0];
    assert!((segment["length_mm"].as_f64().unwrap() - 8.0).abs() < 0.15, "{json}");
    for key in ["from_mm", "to_mm", "length_mm", "error_mm", "clipped", "below_resolution"] {
        assert!(segment.get(key).is_some(), "{key}");
    }
    for key in ["t_mm", "kind", "cell", "point_mm", "normal", "error_mm"] {
        assert!(json["volumes"][0]["crossings"][0].get(key).is_some(), "{key}");
    }
    assert_eq!(json["ledger"][1]["inside"][0], "ball.nrrd");
    let csv = rows(&stdout(&ok(&d, &format!("{cast} csv"))));
    assert_eq!(column(&csv, "kind"), ["stretch", "ledger", "ledger", "ledger"]);
    assert!(column(&csv, "file")[0].ends_with("ball.nrrd") && column(&csv, "name")[0] == "ray 1" && column(&csv, "as_cut")[0] == "false");
    assert!(stdout(&ok(&d, &format!("{cast} table"))).contains("length mm"));
    let markups: Value = serde_json::from_str(&stdout(&ok(&d, &format!("{cast} markups")))).unwrap();
    let line = &markups["markups"][0];
    assert_eq!((line["type"].as_str(), line["coordinateSystem"].as_str()), (Some("Line"), Some("LPS")));
    for point in line["controlPoints"].as_array().unwrap() {
        assert!(point["position"].is_array() && point["positionStatus"] == "defined" && point["description"].is_string());
    }
    std::fs::write(d.join("rays.csv"), "ox,oy,oz,dx,dy,dz\n7.5,7.5,-20,0,0,1\n7.5,-20,7.5,0,2,0\n").unwrap();
    let lines = stdout(&ok(&d, "probe ball.nrrd --iso 0 --rays rays.csv --format json"));
    assert_eq!(
        lines
            .lines()
            .map(|l| serde_json::from_str::<Value>(l).unwrap()["volumes"][0]["segments"].as_array().unwrap().len())
            .collect::<Vec<_>>(),
        [1, 1]
    );
    let csv = rows(&stdout(&ok(&d, "probe ball.nrrd --iso 0 --rays rays.csv --format csv")));
    assert_eq!(column(&csv, "kind").iter().filter(|kind| *kind == "stretch").count(), 2);
    std::fs::write(d.join("named.csv"), "name,ox,oy,oz,dx,dy,dz\nfrontal left,7.5,7.5,-20,0,0,1\n\n,7.5,-20,7.5,0,2,0\n").unwrap();
    let csv = rows(&stdout(&ok(&d, "probe ball.nrrd --iso 0 --rays named.csv --format csv")));
    assert_eq!((column(&csv, "name")[0].as_str(), column(&csv, "name").last().unwrap().as_str()), ("frontal left", "ray 2"));
}

#[test]
fn the_difference_stands_first_in_every_form() {
    // Fails if B − A, its ±, what that lacks, or unlike thresholds are not told wherever lengths are; or a name breaks a table.
    let d = folder("difference");
    nrrd(&d.join("a,\"1\".nrrd"), CUBE, &ball());
    nrrd(&d.join("b.nrrd"), CUBE, &ball());
    let cast = "probe a,\"1\".nrrd b.nrrd --iso 0,250 --origin 7.5,7.5,-20 --direction 0,0,1 --format";
    let table = stdout(&ok(&d, &format!("{cast} table")));
    let place = |part: &str| table.find(part).unwrap_or_else(|| panic!("{part} is missing in {table}"));
    assert!(place("note: a,\"1\".nrrd is measured at 0 HU and b.nrrd at 250") < place("bone 1 − bone 1: -2.0"), "{table}");
    assert!(place("without the registration's error, which is not known") < place("isovalue 0 ± 50 HU"), "{table}");
    let json: Value = serde_json::from_str(&stdout(&ok(&d, &format!("{cast} json")))).unwrap();
    let pair = &json["pairs"][0];
    let difference = &pair["differences"][0];
    let length = |n: usize| json["volumes"][n]["segments"][0]["length_mm"].as_f64().unwrap();
    assert_eq!(difference["difference_mm"].as_f64(), Some(length(1) - length(0)));
    assert!(difference["error_mm"].as_f64().unwrap() > 0.0 && difference["from_shift"]["shift_mm"].as_f64().unwrap() > 0.5, "{json}");
    assert!(
        pair["without"].as_str().unwrap().contains("registration") && json["notes"][0].as_str().unwrap().contains("different surfaces")
    );
    let csv = rows(&stdout(&ok(&d, &format!("{cast} csv"))));
    assert_eq!(column(&csv, "kind")[..3], ["difference", "stretch", "stretch"]);
    let found: f64 = column(&csv, "difference_mm")[0].parse().unwrap();
    assert!((found - (length(1) - length(0))).abs() < 1e-6, "{found}");
    assert_eq!((column(&csv, "against")[0].as_str(), column(&csv, "volume")[1].as_str()), ("a,\"1\".nrrd", "a,\"1\".nrrd"));
    assert!(column(&csv, "program")[0].starts_with("bregma ") && column(&csv, "date")[0].ends_with('Z'));
    // Some row fills each column but that of names inside gaps.
    for head in &csv[0] {
        assert!(column(&csv, head).iter().any(|cell| !cell.is_empty()) || head == "registration_error_mm", "{head} is never filled");
    }
    assert!(column(&csv, "root_error_mm").iter().all(|cell| cell.len() < 10), "{csv:?}");
    let markups = stdout(&ok(&d, &format!("{cast} markups")));
    assert!(markups.contains("ray 1 b.nrrd bone 1") && markups.contains("bone 1 − bone 1: -2.0"), "{markups}");
}

#[test]
fn a_sessions_cuts_are_measured_only_where_asked() {
    // Fails if a cut changes a length without a word, or a record that is cut, of now or of before, cannot be made again.
    let d = folder("as-cut");
    nrrd(&d.join("ball.nrrd"), CUBE, &ball());
    let source = bregma_session::Source { file: d.join("ball.nrrd"), ..Default::default() };
    let mut opened = bregma_session::Opened::read(&[source], &Default::default()).unwrap();
    opened.scene.layers[0].iso = 0.0;
    opened.scene.clips = vec![bregma_renderer::Clip::all(bregma_renderer::Shape::Plane { normal: glam::DVec3::Z, offset_mm: 7.5 })];
    bregma_session::Session::of(&opened, &d).write(&d.join("session.json")).unwrap();
    let cast = "probe session.json --origin 7.5,7.5,-20 --direction 0,0,1 --format json";
    let length = |out: &Output| {
        let json: Value = serde_json::from_str(&stdout(out)).unwrap();
        (json["volumes"][0]["segments"][0]["length_mm"].as_f64().unwrap(), json)
    };
    let whole = ok(&d, cast);
    assert!(stderr(&whole).contains("--as-cut"), "{}", stderr(&whole));
    let cut = ok(&d, &format!("{cast} --as-cut"));
    let ((whole_mm, whole), (cut_mm, mut old)) = (length(&whole), length(&cut));
    assert!((whole_mm - 2.0 * cut_mm).abs() < 1e-6, "{whole_mm} {cut_mm}");
    // What was measured whole names no cuts, so that any version makes it again.
    assert!(whole["made_by"].get("clips").is_none() && whole["as_cut"] == false && old["as_cut"] == true);
    std::fs::write(d.join("whole.json"), whole.to_string()).unwrap();
    std::fs::write(d.join("cut.json"), stdout(&cut)).unwrap();
    old.as_object_mut().unwrap().remove("as_cut");
    std::fs::write(d.join("old.json"), old.to_string()).unwrap();
    for file in ["whole.json", "cut.json", "old.json"] {
        let said = stdout(&ok(&d, &format!("verify --all {file}")));
        let as_cut = if file == "whole.json" { "" } else { ", as cut" };
        assert_eq!(said, format!("ray 1, ball.nrrd, bone 1{as_cut}: holds\n1 of 1 lengths hold\n"), "{file}");
    }
    let map = |options: &str, out: &str| {
        ok(&d, &format!("thickness session.json --method sphere --size 32x32 --backend cpu --out {out} {options}"));
        let json: Value = serde_json::from_slice(&std::fs::read(d.join(out).join("thickness.json")).unwrap()).unwrap();
        (json["as_cut"].as_bool().unwrap(), json["statistics"]["area_mm2"].as_f64().unwrap())
    };
    let ((of_all, all_mm2), (of_left, left_mm2)) = (map("", "all"), map("--as-cut", "left"));
    assert!(!of_all && of_left && left_mm2 < 0.7 * all_mm2, "{all_mm2} {left_mm2}");
}

#[test]
fn recorded_lengths_are_verified() {
    // Fails if a record cannot be measured again, or a scan, an isovalue or a length that changed goes unnoticed.
    let dir = folder("verify");
    nrrd(&dir.join("ball.nrrd"), CUBE, &ball());
    std::fs::write(dir.join("rays.csv"), "ox,oy,oz,dx,dy,dz\n7.3,-20,7.6,0,1,0\n7,-20,7,0.01,1,0.02\n").unwrap();
    let json = stdout(&ok(&dir, "probe ball.nrrd --iso 0 --rays rays.csv --format json"));
    std::fs::write(dir.join("rays.json"), &json).unwrap();
    assert_eq!(stdout(&ok(&dir, "verify rays.json")), "2 of 2 lengths hold\n");
    assert!(stdout(&ok(&dir, "verify --all rays.json")).starts_with("ray 1, ball.nrrd, bone 1: holds\n"));
    // A length that was written down wrongly.
    let mut record: Value = serde_json::from_str(json.lines().next().unwrap()).unwrap();
    let length = &mut record["volumes"][0]["segments"][0]["length_mm"];
    *length = (length.as_f64().unwrap() + 1e-6).into();
    std::fs::write(dir.join("wrong.json"), record.to_string()).unwrap();
    fails(&dir, "verify wrong.json", &["1 of 1 lengths do not hold"]);
    // The scan moved along with its record, and then changed.
    let moved = folder("verify-moved");
    std::fs::copy(dir.join("ball.nrrd"), moved.join("ball.nrrd")).unwrap();
    std::fs::write(moved.join("rays.json"), json.replace(dir.to_str().unwrap(), "/nowhere")).unwrap();
    assert_eq!(stderr(&ok(&moved, "verify rays.json")), "");
    let mut other = ball();
    other[0] += 1;
    nrrd(&moved.join("ball.nrrd"), CUBE, &other);
    fails(&moved, "verify rays.json", &["ball.nrrd is not the scan that was measured"]);
    std::fs::remove_file(moved.join("ball.nrrd")).unwrap();
    fails(&moved, "verify rays.json", &["rays.json", "no such file"]);
    for (text, part) in [("{}", "does not say what it was made from"), ("", "holds no measurements"), ("{", "is not JSON")] {
        std::fs::write(dir.join("none.json"), text).unwrap();
        fails(&dir, "verify none.json", &["none.json", part]);
    }
}

#[test]
fn a_spacing_and_a_turn_are_told_wherever_lengths_are() {
    // Fails if a stated spacing is overridden, or a scan turned or mirrored, without a word in info, in a warning, or beside a length in any form;
    // if a record of it cannot be measured again; or if a mirror image is made by a slip.
    let d = folder("corrected");
    nrrd(&d.join("ball.nrrd"), CUBE, &ball());
    let out = ok(&d, "info ball.nrrd --spacing 1,1,2 --turn LAI");
    assert!(
        stdout(&out).contains("1, 1, 2 mm instead of 1, 1, 1 mm")
            && stdout(&out).contains("LAI: left, posterior, superior are left, anterior, inferior")
    );
    assert!(
        stderr(&out).contains("its file states that samples are 1 × 1 × 1 mm apart; 1 × 1 × 2 mm is taken instead"),
        "{}",
        stderr(&out)
    );
    let record: Value = serde_json::from_str(&stdout(&ok(&d, "info ball.nrrd --json --spacing 1,1,2 --turn RPS,mirror"))).unwrap();
    assert_eq!((record["stated_spacing_mm"][2].as_f64(), record["spacing_mm"][2].as_f64()), (Some(1.0), Some(2.0)));
    assert_eq!((record["turn"].as_str(), record["direction"][0][0].as_f64()), (Some("RPS,mirror"), Some(-1.0)));
    // An equal one, or none, is nothing to tell.
    let plain: Value = serde_json::from_str(&stdout(&ok(&d, "info ball.nrrd --json --spacing 1,1,1 --turn LPS"))).unwrap();
    assert!(plain.get("stated_spacing_mm").is_none() && plain.get("turn").is_none() && plain["warnings"].as_array().unwrap().is_empty());
    let cast = "probe ball.nrrd --spacing 1,1,2 --turn RPS,mirror --iso 0 --origin 7.3,7.4,-20 --direction 0,0,1 --format";
    for form in ["table", "json", "csv", "markups"] {
        let text = stdout(&ok(&d, &format!("{cast} {form}")));
        assert!(text.contains("mirror image") && text.contains("1 × 1 × 2 mm is taken instead"), "{form}: {text}");
    }
    let json = stdout(&ok(&d, &format!("{cast} json")));
    let found: Value = serde_json::from_str(&json).unwrap();
    let volume = &found["volumes"][0];
    assert_eq!(
        (volume["stated_spacing_mm"][2].as_f64(), volume["spacing_mm"][2].as_f64(), volume["turn"].as_str()),
        (Some(1.0), Some(2.0), Some("RPS,mirror"))
    );
    let length = |line: &str| {
        let found: Value = serde_json::from_str(&stdout(&ok(&d, line))).unwrap();
        found["volumes"][0]["segments"][0]["length_mm"].as_f64().unwrap()
    };
    let stated = length("probe ball.nrrd --iso 0 --origin 7.7,7.4,-20 --direction 0,0,1 --format json");
    assert!((volume["segments"][0]["length_mm"].as_f64().unwrap() - 2.0 * stated).abs() < 1e-9, "{stated}");
    // A scan that lies on its side is stood up: what was along its rows is along the world's up, about its middle.
    let up = length("probe ball.nrrd --turn SPR --spacing 3,1,1 --iso 0 --origin 22.5,7.4,-90 --direction 0,0,1 --format json");
    assert!((up - 3.0 * length("probe ball.nrrd --iso 0 --origin -90,7.4,7.5 --direction 1,0,0 --format json")).abs() < 1e-9, "{up}");
    std::fs::write(d.join("ray.json"), &json).unwrap();
    assert_eq!(stdout(&ok(&d, "verify ray.json")), "1 of 1 lengths hold\n");
    std::fs::write(d.join("unturned.json"), json.replace("\"turn\":\"RPS,mirror\"", "\"turn\":\"LPS\"")).unwrap();
    fails(&d, "verify unturned.json", &["is not the scan that was measured"]);
    for (turn, part) in [("RPS", "write RPS,mirror"), ("RAS,mirror", "mirrors nothing"), ("LRS", "names no turn"), ("up", "names no turn")]
    {
        let out = bregma(&d, &format!("info ball.nrrd --turn {turn}"));
        assert!(out.status.code() == Some(2) && stderr(&out).contains(part), "{turn}: {}", stderr(&out));
    }
    ok(&d, "convert ball.nrrd --turn RAS turned.mha");
    let turned: Value = serde_json::from_str(&stdout(&ok(&d, "info turned.mha --json"))).unwrap();
    assert_eq!((turned["direction"][0][0].as_f64(), turned["origin_mm"][0].as_f64()), (Some(-1.0), Some(15.0)));
    ok(&d, "thickness ball.nrrd --turn RPS,mirror --iso 0 --out map --backend cpu");
    assert!(std::fs::read_to_string(d.join("map/thickness.json")).unwrap().contains("mirror image"));
    assert!(String::from_utf8_lossy(&std::fs::read(d.join("map/thickness.ply")).unwrap()[..900]).contains("mirror image"));
}
