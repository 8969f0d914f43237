//! `bregma parts` and `bregma filter`.

use super::*;

/// Two balls that a neck of one sample joins, and a crumb.
fn dumbbell() -> Vec<i16> {
    let is_bone = |n: i32| {
        let [x, y, z] = [n % 16, n / 16 % 16, n / 256].map(f64::from);
        let ball = |at: f64, radius: f64| ((x - at).powi(2) + (y - 8.0).powi(2) + (z - 8.0).powi(2)).sqrt() <= radius;
        ball(4.0, 2.9) || ball(11.0, 2.9) || (y == 8.0 && z == 8.0 && (4.0..11.0).contains(&x)) || (x == 0.0 && y == 0.0 && z == 15.0)
    };
    (0..4096).map(|n| if is_bone(n) { 1000 } else { -1000 }).collect()
}

#[test]
fn parts_are_told_written_and_read_again() {
    // Fails if islands, necks or a click find another part, the table or the label map is not of them, or one is read as another.
    let d = folder("parts");
    nrrd(&d.join("two.nrrd"), CUBE, &dumbbell());
    let rows = |line: &str| -> Value { serde_json::from_str(&stdout(&ok(&d, line))).unwrap() };
    let samples =
        |record: &Value| -> Vec<u64> { record["parts"].as_array().unwrap().iter().map(|p| p["samples"].as_u64().unwrap()).collect() };
    let islands = rows("parts two.nrrd --islands --iso 0 --json");
    let all = islands["bone_samples"].as_u64().unwrap();
    assert_eq!(samples(&islands), [all - 1, 1]);
    assert_eq!(samples(&rows("parts two.nrrd --islands --iso 0 --larger-than 2 --json")), [all - 1]);
    assert_eq!(samples(&rows("parts two.nrrd --largest --iso 0 --json")), [all - 1]);
    assert_eq!(samples(&rows("parts two.nrrd --at 0.2,0,14.9 --iso 0 --json")), [1]);
    assert_eq!(samples(&rows("parts two.nrrd --keep-the-skull --iso 0 --json")), [all - 1]);
    let apart = rows("parts two.nrrd --separate 2.5 --iso 0 --larger-than 2 --out bones.seg.nrrd --json");
    assert!(samples(&apart).len() == 2 && samples(&apart).iter().sum::<u64>() == all - 1, "{apart}");
    assert_eq!(rows("parts two.nrrd --labels bones.seg.nrrd --iso 0 --json"), apart);
    ok(&d, "parts two.nrrd --labels bones.seg.nrrd --iso 0 --out bones.nii.gz");
    assert_eq!(samples(&rows("parts two.nrrd --labels bones.nii.gz --iso 0 --json")), samples(&apart));
    let table = stdout(&ok(&d, "parts two.nrrd --islands --iso 0"));
    assert!(table.contains("Island 2") && table.contains("0–0, 0–0, 15–15"), "{table}");
}

#[test]
fn parts_that_there_are_not_are_one_clear_line() {
    // Fails if any of these panics, passes, or leaves what was there damaged.
    let d = folder("no-parts");
    nrrd(&d.join("two.nrrd"), CUBE, &dumbbell());
    fails(&d, "parts two.nrrd --islands --iso 2000", &["two.nrrd", "none of its samples is bone"]);
    fails(&d, "parts two.nrrd --islands --iso 0 --larger-than 1e9", &["none of its parts is larger than 1000000000 mm³"]);
    fails(&d, "parts two.nrrd --labels two.nrrd --iso 0", &["not all whole numbers from 0 to 65535"]);
    fails(&d, "parts two.nrrd --labels gone.seg.nrrd --iso 0", &["gone.seg.nrrd", "there is no such file"]);
    std::fs::write(d.join("kept.seg.nrrd"), "kept").unwrap();
    fails(&d, "parts two.nrrd --islands --iso 2000 --out kept.seg.nrrd", &["none of its samples is bone"]);
    assert_eq!(std::fs::read_to_string(d.join("kept.seg.nrrd")).unwrap(), "kept");
    fails(&d, "parts two.nrrd --largest --iso 0 --out parts.xyz", &["end the name in one of"]);
    for line in
        ["parts two.nrrd", "parts two.nrrd --largest --islands", "parts two.nrrd --at 0,0,0 --iso 0", "parts two.nrrd two.nrrd --largest"]
    {
        assert_eq!(bregma(&d, line).status.code(), Some(2), "{line}");
    }
}

#[test]
fn filters_make_scans_of_their_own() {
    // Fails if a filter changes the scan that it is of, its geometry or type is lost, or what it was is not recorded.
    let d = folder("filters");
    nrrd(&d.join("two.nrrd"), CUBE, &dumbbell());
    let before = std::fs::read(d.join("two.nrrd")).unwrap();
    ok(&d, "filter two.nrrd --median 1 --out median.nrrd");
    ok(&d, "filter median.nrrd --gaussian 0.7 --out both.nii.gz");
    ok(&d, "filter two.nrrd --diffuse 2,1,0.05 --out diffused.mha");
    assert_eq!(std::fs::read(d.join("two.nrrd")).unwrap(), before);
    let info = |file: &str| -> Value { serde_json::from_str(&stdout(&ok(&d, &format!("info --json {file}")))).unwrap() };
    assert_eq!((info("median.nrrd")["type"].as_str(), info("both.nii.gz")["type"].as_str()), (Some("i16"), Some("f32")));
    assert_eq!(info("both.nii.gz")["metadata"]["Filtered"], "median 1; Gaussian 0.7 mm");
    assert_eq!(info("diffused.mha")["metadata"]["Filtered"], "diffusion 2 × 0.05, conductance 1");
    assert_eq!(info("diffused.mha")["to_world"], info("two.nrrd")["to_world"]);
    // The crumb is gone, and so is the neck.
    assert_eq!(stdout(&ok(&d, "parts median.nrrd --islands --iso 0")).matches("Island").count(), 2);
    for line in
        ["filter two.nrrd --out x.nrrd", "filter two.nrrd --diffuse 2,1,9 --out x.nrrd", "filter two.nrrd --diffuse 1.5 --out x.nrrd"]
    {
        assert_eq!(bregma(&d, line).status.code(), Some(2), "{line}");
    }
    assert!(!d.join("x.nrrd").exists());
}

#[test]
fn parts_grow_from_seeds_come_from_surfaces_and_are_smoothed() {
    // Fails if painted parts do not share the bone, a surface fills something else, an open one passes, or what is grown by --grow is not.
    let d = folder("parts-by-hand");
    nrrd(&d.join("two.nrrd"), CUBE, &dumbbell());
    let rows = |line: &str| -> Value { serde_json::from_str(&stdout(&ok(&d, line))).unwrap() };
    let samples =
        |record: &Value| -> Vec<u64> { record["parts"].as_array().unwrap().iter().map(|p| p["samples"].as_u64().unwrap()).collect() };
    let islands = rows("parts two.nrrd --largest --iso 0 --json");
    // One sample of each ball.
    let seeds: Vec<i16> =
        (0..4096).map(|n| if n == 4 + 8 * 16 + 8 * 256 { 1 } else { i16::from(n == 11 + 8 * 16 + 8 * 256) * 2 }).collect();
    nrrd(&d.join("seeds.nrrd"), CUBE, &seeds);
    let grown = rows("parts two.nrrd --seeds seeds.nrrd --iso 0 --out grown.seg.nrrd --json");
    assert!(samples(&grown).len() == 2 && samples(&grown).iter().sum::<u64>() == samples(&islands)[0], "{grown}");
    let smooth = rows("parts two.nrrd --labels grown.seg.nrrd --smooth 1.5 --iso 0 --json");
    assert_eq!(samples(&smooth).iter().sum::<u64>(), samples(&grown).iter().sum::<u64>());
    nrrd(&d.join("one.nrrd"), CUBE, &seeds.iter().map(|n| i16::from(*n == 1)).collect::<Vec<_>>());
    fails(&d, "parts two.nrrd --seeds one.nrrd --iso 0", &["two.nrrd", "paint another one"]);
    // A box of triangles around the first ball.
    let corner = |c: usize| [0, 1, 2].map(|a| if c >> a & 1 == 1 { [7.5, 12.5, 12.5][a] } else { [0.5, 3.5, 3.5][a] });
    let mut stl = "solid\n".to_owned();
    for [a, b, c, e] in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]] {
        for t in [[a, b, c], [a, c, e]] {
            let corners = t.map(|n| corner(n).map(|x| x.to_string()).join(" "));
            stl += &format!(
                "facet normal 0 0 1\nouter loop\nvertex {}\nvertex {}\nvertex {}\nendloop\nendfacet\n",
                corners[0], corners[1], corners[2]
            );
        }
    }
    std::fs::write(d.join("box.stl"), format!("{stl}endsolid\n")).unwrap();
    let filled = rows("parts two.nrrd --surface box.stl --iso 0 --out box.seg.nrrd --json");
    assert_eq!((samples(&filled), filled["parts"][0]["name"].as_str()), (vec![7 * 9 * 9], Some("box")));
    let open = stl.rsplitn(3, "facet normal").last().unwrap().to_owned();
    std::fs::write(d.join("open.stl"), open + "endsolid\n").unwrap();
    fails(&d, "parts two.nrrd --surface open.stl --iso 0", &["open.stl", "of its edges have no second triangle"]);
}
