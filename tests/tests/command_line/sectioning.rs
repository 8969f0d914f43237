//! `bregma section`, and its record verified.

use super::*;

/// Points of the midline of the demo's skull A, to a tenth of a millimetre.
const MARKS: &str = "kind,name,x_mm,y_mm,z_mm\nlandmark,nasion,0,-86.3,5.7\nlandmark,bregma,0,-18.4,71.2\nlandmark,opisthion,0,51.3,-61.6\nlandmark,far,0,0,0\n";

#[test]
fn a_section_is_written_told_and_verified() {
    // Fails if a form is missing, a column is not as wide as its table, the thicker frontal bone of B is not found, or a record that was
    // tampered with is not found out.
    let folder = folder("sectioning");
    ok(&folder, "demo --size 64 --out .");
    std::fs::write(folder.join("marks.csv"), MARKS).unwrap();
    let through = "section a.nrrd b.nrrd marks.csv --iso 226 --through Nasion,bregma,opisthion";
    let told = stdout(&ok(&folder, &format!("{through} --out vault.png --out vault.svg --out vault.csv --out vault.json")));
    assert!(told.contains("nasion") && told.contains("stands out") && told.contains("thickness of"), "{told}");
    let read = |name: &str| std::fs::read(folder.join(name)).unwrap();
    assert!(read("vault.png").starts_with(b"\x89PNG"));
    let svg = String::from_utf8(read("vault.svg")).unwrap();
    assert!(svg.contains("mm along the curve") && svg.contains("bregma") && svg.contains("<polygon"));
    let table = String::from_utf8(read("vault.csv")).unwrap();
    let rows: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    let column = |name: &str| rows[0].iter().position(|c| *c == name).unwrap();
    let (kind, difference) = (column("kind"), column("thickness_difference_mm"));
    assert_eq!(rows.iter().filter(|row| row[kind] == "landmark").count(), 3);
    let record: Value = serde_json::from_slice(&read("vault.json")).unwrap();
    let stations = record["section"]["stations"].as_array().unwrap();
    assert_eq!(rows.iter().filter(|row| row[kind] == "station").count(), stations.len());
    // The middle of B's frontal bone is thicker by 3.6 mm.
    let is_frontal = |row: &&Vec<&str>| row[column("along_mm")].parse::<f64>().is_ok_and(|mm| mm < 60.0);
    let largest = rows.iter().filter(is_frontal).filter_map(|row| row[difference].parse::<f64>().ok()).fold(0.0, f64::max);
    assert!(largest > 2.5 && largest < 6.0, "{largest}");
    assert!(stdout(&ok(&folder, "verify vault.json")).contains("lengths hold"));
    // Another number, one that was left out, and a shorter way are found out.
    let text = String::from_utf8(read("vault.json")).unwrap();
    let mm = stations[3]["thickness"]["mm"].as_f64().unwrap();
    let tampered = |name: &str, value: Value| {
        std::fs::write(folder.join(name), value.to_string()).unwrap();
        assert_eq!(bregma(&folder, &format!("verify {name}")).status.code(), Some(1), "{name}");
    };
    tampered("other.json", serde_json::from_str(&text.replacen(&mm.to_string(), &(mm + 0.001).to_string(), 1)).unwrap());
    let mut without = record.clone();
    without["section"]["stations"][3]["thickness"] = Value::Null;
    tampered("without.json", without);
    let mut shorter = record.clone();
    shorter["section"]["path"]["landmarks"].as_array_mut().unwrap().pop();
    tampered("shorter.json", shorter);
    // A session with it is read, kept and verified.
    let mut session: Value = serde_json::from_slice(&read("session.json")).unwrap();
    session["measurements"] = serde_json::json!([record]);
    std::fs::write(folder.join("with.json"), session.to_string()).unwrap();
    ok(&folder, "verify with.json");
    let again = bregma_session::Opened::read(
        &[bregma_session::Source { file: folder.join("with.json"), ..Default::default() }],
        &Default::default(),
    )
    .unwrap();
    assert!(
        matches!(&again.measurements[..], [bregma_session::Measurement::Section(kept)] if kept.section.stations.len() == stations.len())
    );
    let kept = serde_json::to_value(&again.measurements[0]).unwrap();
    assert!(kept["section"] == record["section"], "a digit was lost");
}

#[test]
fn planes_and_single_scans_have_sections_and_wrong_ones_are_refused() {
    // Fails if a plane is not taken, a single scan waits for a second one, or a mistake is not said in a line that helps.
    let folder = folder("sectioning-planes");
    ok(&folder, "demo --size 64 --out .");
    std::fs::write(folder.join("marks.csv"), MARKS).unwrap();
    let ring = stdout(&ok(&folder, "section a.nrrd --iso 226 --plane-at 0,0,40 --normal 0,0,1 --step 2 --out ring.csv"));
    assert!(ring.contains("closed") && !ring.contains("stands out"), "{ring}");
    let midline = ok(&folder, "section a.nrrd --landmarks marks.csv --iso 226 --plane nasion,bregma,opisthion --seed bregma --out m.csv");
    assert!(stdout(&midline).contains("bregma       at 0.00 mm"), "{}", stdout(&midline));
    ok(&folder, "section a.nrrd marks.csv --iso 226 --through nasion,bregma,opisthion --one-plane --out p.svg");
    let none = "section a.nrrd marks.csv --iso 226 --out none.csv";
    fails(&folder, &format!("{none} --through nasion,inion"), &["inion", "nasion, bregma, opisthion"]);
    fails(&folder, &format!("{none} --through nasion,far"), &["far lies", "mm from the surface"]);
    fails(&folder, "section a.nrrd marks.csv --iso 226 --through nasion,bregma --out vault.doc", &["vault.doc", ".svg"]);
    fails(&folder, &format!("{none} --plane-at 0,500,0 --normal 0,1,0"), &["does not pass there"]);
    for wrong in ["", "--plane-at 0,0,0", "--through nasion,bregma --plane nasion,bregma,opisthion", "--plane-at 0,0,0 --normal 0,0,0"] {
        assert_eq!(bregma(&folder, &format!("{none} {wrong}")).status.code(), Some(2), "{wrong}");
    }
}
