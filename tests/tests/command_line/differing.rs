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
