//! `--within` and `--without`: the part of a scan that is meant, in pictures and in what is measured.

use super::*;
use bregma_synthetic::Random;

/// Two balls three samples apart, in air that is noisy.
fn balls() -> Vec<i16> {
    let mut r = Random(3);
    let value = |n: i32, noise: f64| {
        let [x, y, z] = [n % 16, n / 16 % 16, n / 256].map(f64::from);
        let ball = |at: [f64; 3], radius: f64| radius - ((x - at[0]).powi(2) + (y - at[1]).powi(2) + (z - at[2]).powi(2)).sqrt();
        let (a, b) = (ball([4.0, 8.0, 8.0], 3.3), ball([12.5, 8.0, 8.0], 2.3));
        (1000.0 * a.max(b).clamp(-1.0, 1.0) + 20.0 * noise) as i16
    };
    (0..4096).map(|n| value(n, r.unit())).collect()
}

fn volume_mm3(d: &Path, line: &str) -> f64 {
    ok(d, &format!("{line} --out volumes.json"));
    let record: Value = serde_json::from_str(&std::fs::read_to_string(d.join("volumes.json")).unwrap()).unwrap();
    find(&record, "volume_mm3").unwrap_or_else(|| panic!("{record}"))
}

/// The first number of that name anywhere in a record.
fn find(record: &Value, name: &str) -> Option<f64> {
    match record {
        Value::Object(fields) => fields.get(name).and_then(Value::as_f64).or_else(|| fields.values().find_map(|v| find(v, name))),
        Value::Array(all) => all.iter().find_map(|v| find(v, name)),
        _ => None,
    }
}

#[test]
fn what_is_measured_within_a_part_is_that_part_alone_and_all_parts_together_are_the_whole() {
    // Fails if a part's surface is cut or another's bone counts, `--without` is not the rest, or the isovalue of the parts is not that of the command.
    let d = folder("within");
    nrrd(&d.join("two.nrrd"), CUBE, &balls());
    ok(&d, "parts two.nrrd --islands --iso 0 --out two.seg.nrrd");
    let whole = volume_mm3(&d, "volume two.nrrd --iso 0");
    let [a, b] = ["1", "2"].map(|n| volume_mm3(&d, &format!("volume two.nrrd --within two.seg.nrrd#{n} --iso 0")));
    println!("whole {whole} mm³, parts {a} and {b}");
    assert!((a + b - whole).abs() < 1e-9 * whole && a > 1.2 * b, "{a} + {b} is not {whole}");
    let rest = volume_mm3(&d, "volume two.nrrd --without two.seg.nrrd#1 --iso 0");
    assert!((rest - b).abs() < 1e-9 * whole, "{rest} is not {b}");
    // A part grown and shrunk: what is shrunk below the cells around it cuts its bone, and a record of it is made again.
    let [grown, shrunk] =
        ["1", "-3"].map(|mm| volume_mm3(&d, &format!("volume two.nrrd --within two.seg.nrrd#1 --grow {mm} --rim 0.5 --iso 0")));
    println!("grown {grown} mm³, shrunk {shrunk} mm³");
    assert!((grown - a).abs() < 1e-9 * whole && shrunk < 0.7 * a && shrunk > 0.0, "{shrunk} of {a}");
    assert_eq!(stdout(&ok(&d, "verify volumes.json")), "1 of 1 volumes hold\n");
    assert_eq!(bregma(&d, "volume two.nrrd --grow 1 --iso 0").status.code(), Some(2), "there is no part to grow");
    // A ray through both.
    let lengths = |part: &str| -> usize {
        let out = stdout(&ok(&d, &format!("probe two.nrrd {part} --iso 0 --origin -2,8,8 --direction 1,0,0 --format json")));
        let record: Value = serde_json::from_str(&out).unwrap();
        record.to_string().matches("\"length_mm\"").count()
    };
    let [all, one] = [lengths(""), lengths("--within two.seg.nrrd#1")];
    println!("a ray meets {all} lengths in all, {one} in one part");
    assert!(all > one && one > 0);
    // A record is measured again within the part, and says so where the label map is gone.
    let ray = ok(&d, "probe two.nrrd --within two.seg.nrrd#1 --iso 0 --origin -2,8,8 --direction 1,0,0 --format json");
    std::fs::write(d.join("ray.json"), &ray.stdout).unwrap();
    assert!(stdout(&ok(&d, "verify ray.json")).contains("1 of 1 lengths hold"), "a ray within a part is not measured again");
    ok(&d, "render two.nrrd --within two.seg.nrrd#2 --iso 0 --size 64x64 --out part.png");
    ok(&d, "render two.nrrd --iso 0 --size 64x64 --out whole.png");
    assert_ne!(std::fs::read(d.join("part.png")).unwrap(), std::fs::read(d.join("whole.png")).unwrap());
    fails(
        &d,
        "render two.nrrd --within two.seg.nrrd#3 --iso 0 --out none.png",
        &["two.seg.nrrd", "no part called 3", "Island 1, Island 2"],
    );
    std::fs::rename(d.join("two.seg.nrrd"), d.join("moved.seg.nrrd")).unwrap();
    fails(&d, "volume two.nrrd --within two.seg.nrrd#1 --iso 0", &["two.seg.nrrd", "there is no such file"]);
}
