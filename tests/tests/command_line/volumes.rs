//! `bregma volume` and its records.

use super::*;

#[test]
fn volumes_are_told_written_and_made_again() {
    // Fails if a volume, its table or its record is another's, or a volume that is another now passes for the one that was.
    let d = folder("volumes");
    nrrd(&d.join("ball.nrrd"), CUBE, &ball());
    let said = stdout(&ok(&d, "volume ball.nrrd --iso 0 --out v.csv"));
    assert!(said.contains("ball.nrrd, isovalue 0") && said.contains("without blur"), "{said}");
    let table = std::fs::read_to_string(d.join("v.csv")).unwrap();
    let rows: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    assert!(rows.len() == 2 && rows[0].len() == rows[1].len() && rows[1][0] == "bone", "{table}");
    // A ball of 4 mm, but for what interpolation takes: 3 % at four voxels.
    let mm3: f64 = rows[1][2].parse().unwrap();
    assert!((mm3 / 268.1 - 0.97).abs() < 0.01, "{table}");
    ok(&d, "volume ball.nrrd ball.nrrd --iso 0 --out two.json");
    ok(&d, "volume ball.nrrd --iso 0 --sphere 7.5,7.5,7.5,2 --out part.json");
    assert_eq!(stdout(&ok(&d, "verify two.json part.json")), "6 of 6 volumes hold\n");
    let record = std::fs::read_to_string(d.join("two.json")).unwrap();
    let read: Value = serde_json::from_str(&record).unwrap();
    assert!(
        read["measures"][3]["volume_mm3"].as_f64().unwrap().abs() < 1e-6 && read["measures"][2]["what"].as_str().unwrap().contains(" and "),
        "{read}"
    );
    let was = read["measures"][0]["volume_mm3"].to_string();
    std::fs::write(d.join("two.json"), record.replacen(&was, "100.0", 1)).unwrap();
    fails(&d, "verify two.json", &["1 of 5 volumes do not hold"]);
}

#[test]
fn what_has_no_volume_is_one_clear_line() {
    // Fails if half a bone is measured in silence, or a cavity that is none.
    let d = folder("no-volume");
    nrrd(&d.join("ball.nrrd"), CUBE, &ball());
    nrrd(&d.join("full.nrrd"), CUBE, &[500; 4096]);
    fails(&d, "volume full.nrrd --iso 0", &["full.nrrd", "the scan's box cuts the bone", "--open"]);
    assert!(stdout(&ok(&d, "volume full.nrrd --iso 0 --open")).contains("3375.0"));
    fails(&d, "volume ball.nrrd --iso 0 --cavity 7.5,7.5,7.5", &["lies in bone"]);
    fails(&d, "volume ball.nrrd --iso 0 --cavity 1,1,1", &["leaks to the outside", "--close"]);
    fails(&d, "volume ball.nrrd --iso 0 --cavity 99,1,1", &["outside the scan"]);
    let unknown = bregma(&d, "volume ball.nrrd --iso 0 --cavity bregma");
    assert!(unknown.status.code() == Some(2) && stderr(&unknown).contains("nor a landmark"), "{unknown:?}");
    // A box around empty space closes it.
    let said = stdout(&ok(&d, "volume ball.nrrd --iso 0 --cavity 2,2,2 --box 1,1,1,3,3,3 --out cavity.json"));
    assert!(said.contains(" 8.0 "), "{said}");
    assert_eq!(stdout(&ok(&d, "verify cavity.json")), "1 of 1 volumes hold\n");
    let record = std::fs::read_to_string(d.join("cavity.json")).unwrap();
    std::fs::write(d.join("moved.json"), record.replace("\"seed_mm\":[2.0", "\"seed_mm\":[9.0")).unwrap();
    assert!(!bregma(&d, "verify moved.json").status.success(), "a seed outside of the box has no such volume");
    // The same around a landmark by its name.
    std::fs::write(d.join("seed.csv"), "kind,name,x_mm,y_mm,z_mm,scan\nlandmark,corner,2,2,2,ball.nrrd\n").unwrap();
    let named = stdout(&ok(&d, "volume ball.nrrd seed.csv --iso 0 --cavity corner --box 1,1,1,3,3,3"));
    assert!(named.contains(" 8.0 "), "{named}");
}
