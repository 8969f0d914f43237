//! Stores of chunks: converted as they stream, opened as any scan, and honest about what was left out of them.

use super::*;

/// The numbers of a name, anywhere in a record, in order.
fn numbers(record: &Value, name: &str) -> Vec<f64> {
    match record {
        Value::Object(fields) => {
            let own = fields.get(name).and_then(Value::as_f64);
            own.into_iter().chain(fields.values().flat_map(|v| numbers(v, name))).collect()
        }
        Value::Array(all) => all.iter().flat_map(|v| numbers(v, name)).collect(),
        _ => vec![],
    }
}

/// Lengths through a scan, and their ±, mm.
fn lengths(d: &Path, scan: &str) -> [Vec<f64>; 2] {
    let line = format!("probe {scan} --iso 300 --origin 0,-150,40 --direction 0.1,1,-0.05 --format json");
    let record: Value = serde_json::from_str(&stdout(&ok(d, &line))).unwrap();
    ["length_mm", "threshold_error_mm"].map(|name| numbers(&record["volumes"], name))
}

#[test]
fn a_store_is_the_scan_and_says_what_it_has_not() {
    // Fails if a store draws or measures otherwise than its scan, if surfaces that were kept do, if one that was not is drawn, or if a length of
    // rounded samples hides that behind the ± of the scan's own.
    let d = folder("stores");
    ok(&d, "demo --size 64 --out .");
    let said = |store: &str, options: &str| stderr(&ok(&d, &format!("convert a.nrrd {store} {options}")));
    assert_eq!(said("a.ome.zarr", ""), "");
    said("bone.ome.zarr", "--surfaces 200..400");
    said("rounded.ome.zarr", "--error 20");
    let picture = |scan: &str, iso: f64| {
        ok(&d, &format!("render {scan} --backend cpu --iso {iso} --shadows --size 160x160 --out p.png"));
        pixels(&d.join("p.png"))
    };
    for iso in [200.0, 310.5, 400.0] {
        let whole = picture("a.nrrd", iso);
        assert!(picture("a.ome.zarr", iso) == whole && picture("bone.ome.zarr", iso) == whole, "at {iso}");
    }
    assert!(picture("rounded.ome.zarr", 300.0) != picture("a.nrrd", 300.0));
    for line in ["render bone.ome.zarr --iso 401 --out p.png", "probe bone.ome.zarr --iso 100 --origin 0,-150,40 --direction 0,1,0"] {
        fails(&d, line, &["bone.ome.zarr", "200..400 were kept"]);
    }
    let [[whole, of_whole], [same, _], [rounded, of_rounded]] =
        ["a.nrrd", "bone.ome.zarr", "rounded.ome.zarr"].map(|scan| lengths(&d, scan));
    assert!(whole.len() > 1 && whole == same, "{whole:?} and {same:?}");
    println!("lengths {whole:?} mm, of rounded samples {rounded:?}; ± by the isovalue {of_whole:?} and {of_rounded:?} mm");
    assert_eq!(of_whole.len(), of_rounded.len());
    // 50 HU of the scanner and 20 of rounding.
    for ((a, b), (c, d)) in whole.iter().zip(&rounded).zip(of_whole.iter().zip(&of_rounded)) {
        assert!((a - b).abs() < *d && *d > 1.2 * c, "{a} ± {c} became {b} ± {d}");
    }
    let about: Value = serde_json::from_str(&stdout(&ok(&d, "info --json rounded.ome.zarr"))).unwrap();
    assert_eq!(about["format"], "OME-Zarr");
    assert!(about["warnings"].to_string().contains("off by up to 20"), "{about}");
    // In whatever form it goes on.
    ok(&d, "convert bone.ome.zarr bone.nrrd");
    fails(&d, "render bone.nrrd --iso 100 --out p.png", &["200..400 were kept"]);
    ok(&d, "render bone.nrrd --size 32x32 --out p.png");
    let size = |store: &str| -> u64 { files(&d.join(store).join("0")).iter().map(|file| file.metadata().unwrap().len()).sum() };
    let samples = 2 * about["dims"].as_array().unwrap().iter().map(|n| n.as_u64().unwrap()).product::<u64>();
    println!(
        "of {samples} bytes: whole {}, surfaces 200..400 {}, error 20 {}",
        size("a.ome.zarr"),
        size("bone.ome.zarr"),
        size("rounded.ome.zarr")
    );
    assert!(size("bone.ome.zarr") < size("rounded.ome.zarr") && size("rounded.ome.zarr") < size("a.ome.zarr"));
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect()
}

#[test]
fn scans_in_no_file_stand_wherever_a_scan_does() {
    // Fails if one cannot be looked at, converted or reduced, or a name that is none is taken for one.
    let d = folder("procedural");
    let about: Value = serde_json::from_str(&stdout(&ok(&d, "info --json menger:81"))).unwrap();
    assert_eq!(about["dims"], serde_json::json!([81, 81, 81]));
    ok(&d, "convert marbles:70x60x90 marbles.zarr --surfaces 0..200");
    ok(&d, "render marbles.zarr --iso 100 --size 40x40 --out p.png");
    let about: Value = serde_json::from_str(&stdout(&ok(&d, "info --json skulls:90 --reduce 2"))).unwrap();
    assert_eq!(about["dims"], serde_json::json!([45, 45, 45]));
    fails(&d, "info sponge:81", &["sponge:81", "no such file"]);
    let usage = bregma(&d, "convert menger:9 m.nrrd --error 3");
    assert!(usage.status.code() == Some(2) && stderr(&usage).contains("are for stores"), "{}", stderr(&usage));
    fails(&d, "convert menger:9 m.zarr --error -3", &["must be 0 or more"]);
}
