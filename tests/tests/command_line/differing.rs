//! `bregma difference`, and its record verified.

use super::*;

#[test]
fn a_difference_is_written_told_and_verified() {
    // Fails if a file is missing, the jaw that was moved is not found, a place is not kept to, or a record is not measured again.
    let folder = folder("differing");
    ok(&folder, "demo --size 64 --out .");
    let told = stdout(&ok(&folder, "difference a.nrrd b.nrrd --out map --size 200x160 --range 3 --isolines 1"));
    assert!(told.contains("stands out over") && told.contains("have no number"), "{told}");
    let read = |name: &str| std::fs::read(folder.join("map").join(name)).unwrap();
    for name in ["first.png", "second.png", "first.ply", "second.ply"] {
        assert!(read(name).len() > 2_000, "{name}");
    }
    let table = String::from_utf8(read("first.csv")).unwrap();
    assert!(table.starts_with("x_mm,y_mm,z_mm,nx,ny,nz,difference_mm,error_mm,partner_x_mm,partner_y_mm,partner_z_mm\n"));
    assert!(table.lines().all(|line| line.matches(',').count() == 10));
    let report = String::from_utf8(read("report.html")).unwrap();
    assert!(report.matches("data:image/png;base64,").count() == 2 && report.contains("root mean square") && report.contains("SHA-256"));
    let record: Value = serde_json::from_slice(&read("difference.json")).unwrap();
    let mean = |half: usize| record["difference"]["halves"][half]["statistics"]["mean_magnitude_mm"].as_f64().unwrap();
    assert!(mean(0) > 0.1 && mean(1) > 0.1, "the jaw was moved by 3.6 mm");
    ok(&folder, "verify map/difference.json");
    // Another number is found out.
    let text = String::from_utf8(read("difference.json")).unwrap();
    let other = text.replacen(&format!("{}", mean(0)), &format!("{}", mean(0) + 0.001), 1);
    std::fs::write(folder.join("map/other.json"), other).unwrap();
    assert_eq!(bregma(&folder, "verify map/other.json").status.code(), Some(1));
    // A place where nothing differs, and one where nothing is.
    ok(&folder, "difference a.nrrd b.nrrd --out vault --size 80x60 --only 0,0,80,25");
    fails(&folder, "difference a.nrrd b.nrrd --out none --size 80x60 --only 500,0,0,5", &["nothing of the one surface", "another place"]);
    assert_eq!(bregma(&folder, "difference a.nrrd --out none").status.code(), Some(2));
    let sides = stdout(&ok(&folder, "difference a.nrrd --by asymmetry --out sides --size 80x60"));
    assert!(sides.contains("mirrored"), "{sides}");
    ok(&folder, "verify sides/difference.json");
}

#[test]
fn a_part_that_moved_is_told_and_verified() {
    // Fails if the motion is not in the record, is not measured again, or everything may be taken for a part.
    let folder = folder("displaced");
    ok(&folder, "demo --size 64 --out .");
    let told = stdout(&ok(&folder, "difference a.nrrd b.nrrd --by displacement --only -75,-105,-125,75,15,-98 --out jaw --size 80x60"));
    assert!(told.contains("without a sign"), "{told}");
    let record: Value = serde_json::from_slice(&std::fs::read(folder.join("jaw/difference.json")).unwrap()).unwrap();
    let shift: Vec<f64> = (0..3).map(|n| record["difference"]["moved"]["shift_mm"][n].as_f64().unwrap()).collect();
    assert!((shift[0] - 3.0).abs() < 0.1 && (shift[1] + 2.0).abs() < 0.1 && shift[2].abs() < 0.4, "{shift:?}");
    ok(&folder, "verify jaw/difference.json");
    fails(&folder, "difference a.nrrd b.nrrd --by displacement --out all", &["no part is named"]);
}

#[test]
fn many_scans_against_one_are_one_table_and_go_on_where_they_were() {
    // Fails if a pair is left out or measured twice, a stop leaves something half, one failure takes the others with it, or other orders are taken
    // for this one.
    let folder = folder("differences");
    ok(&folder, "demo --size 48 --out .");
    std::fs::copy(folder.join("b.nrrd"), folder.join("c.nrrd")).unwrap();
    std::fs::write(folder.join("broken.nrrd"), b"NRRD0004\n").unwrap();
    let all = "difference a.nrrd b.nrrd broken.nrrd c.nrrd --each --out all --size 120x100 --range 2";
    let stopped = bregma(&folder, all);
    assert_eq!(stopped.status.code(), Some(1));
    let table = || std::fs::read_to_string(folder.join("all/table.csv")).unwrap();
    let first = table();
    let column = |line: &str, name: &str| {
        let n = first.lines().next().unwrap().split(',').position(|c| c == name).unwrap();
        line.split(',').nth(n).unwrap().to_owned()
    };
    assert_eq!(first.lines().count(), 1 + 2 + 1 + 2, "{first}");
    assert!(first.lines().nth(3).unwrap().contains("broken.nrrd"), "{first}");
    // The same scan by another name differs as much.
    let mean = |n: usize| column(first.lines().nth(n).unwrap(), "mean_mm").parse::<f64>().unwrap();
    assert!(mean(1) != 0.0 && mean(1) == mean(4), "{first}");
    // Without what broke, and with one pair gone as if stopped: that alone is measured again.
    let folders: Vec<String> = [1, 4].map(|n| column(first.lines().nth(n).unwrap(), "folder")).to_vec();
    let record = |n: usize| folder.join("all").join(&folders[n]).join("difference.json");
    let times = [0, 1].map(|n| std::fs::metadata(record(n)).unwrap().modified().unwrap());
    std::fs::remove_file(record(1)).unwrap();
    ok(&folder, &all.replace("broken.nrrd ", ""));
    assert!(std::fs::metadata(record(0)).unwrap().modified().unwrap() == times[0] && record(1).exists());
    assert_eq!(table().lines().skip(1).map(|l| column(l, "mean_mm")).collect::<Vec<_>>().len(), 4);
    assert!(std::fs::read_dir(folder.join("all")).unwrap().all(|e| !e.unwrap().path().to_string_lossy().ends_with(".part")));
    let (_, width, height) = bregma_session::output::read_figure(&folder.join("all/sheet.png")).unwrap();
    assert!(width > 600 && height > 250);
    // Another order is another measurement, and all pairs are three.
    ok(&folder, "difference a.nrrd b.nrrd c.nrrd --all-pairs --by closest --out pairs --size 60x50");
    let pairs = std::fs::read_to_string(folder.join("pairs/table.csv")).unwrap();
    assert!(pairs.lines().count() == 7 && pairs.contains(",closest,"), "{pairs}");
    let three = bregma(&folder, "difference a.nrrd b.nrrd c.nrrd --out none");
    assert!(three.status.code() == Some(2) && String::from_utf8_lossy(&three.stderr).contains("--each"));
}
