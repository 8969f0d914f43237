//! The program as scripts see it: agreed outputs, and one clear line for whatever is wrong.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A folder of its own for each test.
fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("bregma-cli-{}-{name}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn bregma(folder: &Path, line: &str) -> Output {
    // Tests lie in target/PROFILE/deps, the program two levels up.
    let program = std::env::current_exe().unwrap().parent().unwrap().parent().unwrap().join("bregma");
    assert!(program.exists(), "{} is not built: run tests/run, or cargo build --release", program.display());
    let words = line.split(' ').filter(|w| !w.is_empty());
    Command::new(program)
        .args(words)
        .current_dir(folder)
        .env("XDG_RUNTIME_DIR", folder)
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .output()
        .unwrap()
}

fn stdout(out: &Output) -> String {
    String::from_utf8(out.stdout.clone()).unwrap()
}

fn stderr(out: &Output) -> String {
    String::from_utf8(out.stderr.clone()).unwrap()
}

fn ok(folder: &Path, line: &str) -> Output {
    let out = bregma(folder, line);
    assert!(out.status.success(), "bregma {line}: {:?}\n{}", out.status, stderr(&out));
    out
}

/// Fails with status 1 and exactly one line that begins `error: ` and holds all of `parts`.
fn fails(folder: &Path, line: &str, parts: &[&str]) {
    let out = bregma(folder, line);
    let text = stderr(&out);
    let errors: Vec<&str> = text.lines().filter(|l| !l.starts_with("warning: ")).collect();
    assert_eq!(out.status.code(), Some(1), "bregma {line}: {text}");
    assert!(errors.len() == 1 && errors[0].starts_with("error: ") && !text.contains("panicked"), "bregma {line}: {text}");
    assert!(parts.iter().all(|p| errors[0].contains(p)), "bregma {line}: {text} lacks one of {parts:?}");
}

/// An attached NRRD of i16.
fn nrrd(file: &Path, header: &str, samples: &[i16]) {
    let mut bytes = format!("NRRD0004\n{header}\nendian: little\nencoding: raw\n\n").into_bytes();
    bytes.extend(samples.iter().flat_map(|s| s.to_le_bytes()));
    std::fs::write(file, bytes).unwrap();
}

const CUBE: &str = "type: short\ndimension: 3\nsizes: 16 16 16\nspace: left-posterior-superior\nspace directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)";

/// A ball of 1000 HU in air: value 1000 − 150·(distance from the centre), from −1000.
fn ball() -> Vec<i16> {
    (0..4096)
        .map(|n| {
            let [x, y, z] = [n % 16, n / 16 % 16, n / 256].map(|c| f64::from(c) - 7.5);
            (1000.0 - 250.0 * (x * x + y * y + z * z).sqrt()).max(-1000.0) as i16
        })
        .collect()
}

#[test]
fn whatever_is_wrong_with_a_scan_is_one_clear_line() {
    // Fails if any of these panics, passes, or leaves the person without what, where and what to do.
    let d = folder("wrong");
    let put = |name: &str, bytes: &[u8]| std::fs::write(d.join(name), bytes).unwrap();
    nrrd(&d.join("good.nrrd"), CUBE, &ball());
    let good = std::fs::read(d.join("good.nrrd")).unwrap();
    put("empty.nrrd", b"");
    put("truncated.nrrd", &good[..good.len() - 100]);
    put("garbage.bin", &[0xA5; 300]);
    put("noheader.raw", &[0; 64]);
    put("broken.json", b"{ \"bregma_session\": 1, ");
    put("noscans.json", br#"{"bregma_session":1,"volumes":[],"scene":{"layers":[],"camera":{"eye_mm":[0,0,0],"target_mm":[0,1,0],"up":[0,0,1],"projection":{"perspective":{"fov_deg":30}}},"mode":"iso","light":{"toward":[0,0,1],"ambient":0,"diffuse":1,"specular":0,"shininess":1},"background":null}}"#);
    put("other.json", b"{ \"pairs\": { \"x->y\": {} } }");
    put("rays.csv", b"ox,oy,oz,dx,dy,dz\n1,2,3,0,0,1\n1,2,3,0,0\n");
    put("norays.csv", b"a,b\n");
    nrrd(&d.join("sizes.nrrd"), &CUBE.replace("16 16 16", "16 0 16"), &ball());
    nrrd(&d.join("huge.nrrd"), &CUBE.replace("16 16 16", "40000 40000 4000"), &ball());
    nrrd(&d.join("singular.nrrd"), &CUBE.replace("(0,1,0)", "(1,0,0)"), &ball());
    nrrd(&d.join("zero.nrrd"), &CUBE.replace("(0,1,0)", "(0,0,0)"), &ball());
    nrrd(&d.join("nospacing.nrrd"), "type: short\ndimension: 3\nsizes: 16 16 16\nspacings: 1 0 1", &ball());
    let floats = |v: f32| {
        [
            b"NRRD0004\ntype: float\ndimension: 3\nsizes: 2 2 2\nspacings: 1 1 1\nendian: little\nencoding: raw\n\n".to_vec(),
            v.to_le_bytes().repeat(8),
        ]
        .concat()
    };
    put("nan.nrrd", &floats(f32::NAN));
    std::fs::create_dir_all(d.join("empty")).unwrap();
    put("before.png", b"what was here before");
    let render = |file: &str| format!("render {file} --out before.png --backend cpu");
    for (file, parts) in [
        ("missing.nrrd", &["missing.nrrd", "no such file"][..]),
        ("empty.nrrd", &["empty.nrrd", "empty"]),
        ("truncated.nrrd", &["truncated.nrrd", "8192", "8092"]),
        ("garbage.bin", &["garbage.bin", "none of the formats"]),
        ("noheader.raw", &["noheader.raw", "--raw"]),
        ("sizes.nrrd", &["sizes.nrrd", "sizes"]),
        ("huge.nrrd", &["huge.nrrd"]),
        ("singular.nrrd", &["singular.nrrd", "direction"]),
        ("zero.nrrd", &["zero.nrrd"]),
        ("nospacing.nrrd", &["nospacing.nrrd", "spacing"]),
        ("nan.nrrd", &["nan.nrrd", "finite"]),
        ("broken.json", &["broken.json", "session"]),
        ("noscans.json", &["noscans.json", "no scans"]),
        ("empty", &["empty", "folder"]),
        ("good.nrrd --raw 16x16x17,i16", &["good.nrrd", "too early"]),
        ("good.nrrd --raw 1x1x1,u8", &["good.nrrd", "--raw"]),
        ("good.nrrd --transform missing.tfm", &["missing.tfm"]),
        ("good.nrrd --transform other.json", &["other.json", "x->y"]),
    ] {
        fails(&d, &render(file), parts);
    }
    fails(&d, "info missing.nrrd", &["missing.nrrd"]);
    fails(&d, "info missing.nrrd --json", &["missing.nrrd"]);
    fails(&d, "probe good.nrrd --rays rays.csv", &["rays.csv", "line 3"]);
    fails(&d, "probe good.nrrd --rays norays.csv", &["norays.csv", "ox,oy,oz,dx,dy,dz"]);
    fails(&d, "render good.nrrd --backend cpu --out no/such/folder/p.png", &["no/such/folder/p.png", "cannot be written"]);
    fails(&d, "render good.nrrd --backend cpu --out .", &["cannot be written"]);
    fails(&d, "demo --size 8 --out good.nrrd/demo", &["good.nrrd"]);
    // No length in mm on a scan that nobody says the spacing of; a picture is none.
    put("flat_4x4x4_uint8.raw", &[7; 64]);
    fails(&d, "probe flat_4x4x4_uint8.raw --iso 5 --origin 0,0,-5 --direction 0,0,1", &["flat_4x4x4_uint8.raw", "--spacing"]);
    fails(&d, "render flat_4x4x4_uint8.raw --iso 5 --depth d.npy --out p.png --backend cpu", &["flat_4x4x4_uint8.raw", "--spacing"]);
    ok(&d, "probe flat_4x4x4_uint8.raw --spacing 1,1,2 --iso 5 --origin 0,0,-5 --direction 0,0,1");
    fails(&d, "convert truncated.nrrd out.mha", &["truncated.nrrd", "8092"]);
    fails(&d, "convert good.nrrd out.doc", &["out.doc", ".nrrd"]);
    fails(&d, "convert good.nrrd no/such/out.mha", &["no/such/out.mha", "cannot be written"]);
    fails(&d, "info good.nrrd#3", &["good.nrrd#3"]);
    fails(&d, "good.nrrd", &["no display", "bregma render"]);
    assert_eq!(std::fs::read(d.join("before.png")).unwrap(), b"what was here before");
    let left: Vec<_> =
        std::fs::read_dir(&d).unwrap().filter(|e| e.as_ref().unwrap().file_name().to_string_lossy().contains(".part")).collect();
    assert!(left.is_empty(), "part files are left: {left:?}");
}

#[test]
fn wrong_usage_is_status_2() {
    let d = folder("usage");
    nrrd(&d.join("good.nrrd"), CUBE, &ball());
    for line in [
        "render good.nrrd",
        "render --out p.png",
        "render good.nrrd --out p.png --size 0x5",
        "render good.nrrd --out p.png --iso high",
        "render good.nrrd --out p.png --iso 1,2",
        "render --transform t.json good.nrrd --out p.png",
        "render good.nrrd --out p.png --fov 180",
        "render good.nrrd --out p.png --spacing 1,0,1",
        "render good.nrrd --out p.png --raw 2x2,u8",
        "render good.nrrd --out p.png --mode sideways",
        "probe good.nrrd --origin 0,0,0",
        "probe good.nrrd --origin 0,0,0 --direction 0,0,0",
        "probe good.nrrd --origin 1,2,3 --toward 1,2,3",
        "render good.nrrd --out good.nrrd",
        "render good.nrrd --out q.png --depth q.png",
        "convert good.nrrd",
        "convert good.nrrd good.nrrd",
        "convert good.nrrd --transform t.json out.mha",
        "convert good.nrrd a.mha b.mha",
        "info good.nrrd --reduce 3",
        "info good.nrrd --uneven maybe",
        "good.nrrd render good.nrrd --out p.png",
        "--nonsense",
    ] {
        let out = bregma(&d, line);
        assert_eq!(out.status.code(), Some(2), "bregma {line}: {}", stderr(&out));
        assert!(stderr(&out).starts_with("error: ") && !d.join("p.png").exists(), "bregma {line}: {}", stderr(&out));
    }
    assert!(std::fs::read(d.join("good.nrrd")).unwrap().starts_with(b"NRRD"), "a scan was overwritten");
    ok(&d, "--threads 1 --backend cpu render good.nrrd --out before-command.png --size 16x16");
    for line in ["--help", "render --help", "convert --help", "probe --help", "info --help", "bench --help", "demo --help", "--version"] {
        assert!(!stdout(&ok(&d, line)).is_empty());
    }
}

#[test]
fn nothing_to_draw_is_an_empty_picture_and_a_warning() {
    // Fails if an isovalue outside the range or a scan without volume is an error, or passes in silence.
    let d = folder("nothing");
    nrrd(&d.join("good.nrrd"), CUBE, &ball());
    nrrd(&d.join("point.nrrd"), &CUBE.replace("16 16 16", "1 1 1"), &[5]);
    nrrd(&d.join("slice.nrrd"), &CUBE.replace("16 16 16", "16 16 1"), &ball()[..256]);
    nrrd(&d.join("flat.nrrd"), CUBE, &[7; 4096]);
    for (line, part) in [
        ("good.nrrd --iso 5000", "outside its range"),
        ("point.nrrd --iso 5", "no volume"),
        ("slice.nrrd --iso 5", "no volume"),
        ("flat.nrrd --iso 8", "outside its range"),
    ] {
        for backend in ["cpu", "gpu"] {
            let out = ok(&d, &format!("render {line} --backend {backend} --out p.png --volume-id id.npy --size 32x24"));
            assert!(stderr(&out).lines().any(|l| l.starts_with("warning: ") && l.contains(part)), "{line}: {}", stderr(&out));
            let id = std::fs::read(d.join("id.npy")).unwrap();
            assert!(id[id.len() - 32 * 24..].iter().all(|&v| v == 0), "{line} on {backend}");
        }
    }
    // All samples at the isovalue are bone: ties are inside, and the box closes it.
    ok(&d, "render flat.nrrd --iso 7 --backend cpu --out p.png --volume-id id.npy --size 32x24");
    let id = std::fs::read(d.join("id.npy")).unwrap();
    assert!(id[id.len() - 32 * 24..].contains(&1));
    // Below the range everything is bone, and the warning says that instead.
    for iso in ["-2000", "-1e300"] {
        for backend in ["cpu", "gpu"] {
            let out = ok(&d, &format!("render good.nrrd --iso {iso} --backend {backend} --out p.png --volume-id id.npy --size 32x24"));
            assert!(stderr(&out).contains("all of its box is bone"), "{}", stderr(&out));
            let id = std::fs::read(d.join("id.npy")).unwrap();
            assert!(id[id.len() - 32 * 24..].contains(&1), "{iso} on {backend}");
        }
    }
    let text = stdout(&ok(&d, "probe point.nrrd --iso 5 --origin 0,0,-5 --direction 0,0,1"));
    assert!(text.contains("misses"), "{text}");
}

#[test]
fn info_says_what_a_scan_is() {
    let d = folder("info");
    nrrd(&d.join("ball.nrrd"), CUBE, &ball());
    let record: Value = serde_json::from_str(&stdout(&ok(&d, "info ball.nrrd --json"))).unwrap();
    for key in [
        "format",
        "dims",
        "spacing_mm",
        "origin_mm",
        "direction",
        "to_world",
        "type",
        "slope",
        "intercept",
        "unit",
        "range",
        "otsu",
        "bytes",
        "warnings",
    ] {
        assert!(record.get(key).is_some(), "{key} is missing: {record}");
    }
    assert_eq!(record["unit"], "HU");
    assert_eq!(record["type"], "i16");
    assert_eq!(record["bytes"], 8192);
    let lines = stdout(&ok(&d, "info ball.nrrd ball.nrrd --json"));
    assert_eq!(lines.lines().count(), 2);
}

#[test]
fn all_files_of_a_series_are_one_scan() {
    // Fails if a person who selects every slice gets as many scans.
    let Some(data) = bregma_tests::data("all_files_of_a_series_are_one_scan") else { return };
    let folder = data.join("phantom-philips/tilted");
    let files: Vec<String> = std::fs::read_dir(&folder).unwrap().map(|e| e.unwrap().path().display().to_string()).collect();
    let lines = stdout(&ok(&folder, &format!("info --json {}", files.join(" "))));
    assert_eq!((files.len(), lines.lines().count()), (54, 54), "info says what each is that is named");
    let record: Value = serde_json::from_str(lines.lines().next().unwrap()).unwrap();
    assert_eq!(record["dims"].to_string(), "[512,512,54]");
    let line = format!("probe {} --iso 226 --origin 0,-300,750 --direction 0,1,0 --format json", files.join(" "));
    let record: Value = serde_json::from_str(&stdout(&ok(&folder, &line))).unwrap();
    assert_eq!(record["volumes"].as_array().unwrap().len(), 1);
}

#[test]
fn scans_are_converted_and_reduced() {
    // Fails if a converted scan is another one, if a preview is not labelled, or if one is written half.
    let d = folder("convert");
    nrrd(&d.join("ball.nrrd"), CUBE, &ball());
    let info = |file: &str| -> Value { serde_json::from_str(&stdout(&ok(&d, &format!("info {file} --json")))).unwrap() };
    let before = info("ball.nrrd");
    for name in ["a.nrrd", "a.nii", "a.nii.gz", "a.mha", "a.tif"] {
        ok(&d, &format!("convert ball.nrrd {name}"));
        let after = info(name);
        for key in ["dims", "spacing_mm", "origin_mm", "direction", "type", "unit", "range", "otsu", "slope"] {
            assert_eq!(before[key], after[key], "{key} of {name}");
        }
    }
    let half = info("ball.nrrd --reduce 2");
    assert_eq!((half["dims"].to_string(), half["spacing_mm"].to_string()), ("[8,8,8]".into(), "[2.0,2.0,2.0]".into()));
    assert!(half["file"].as_str().unwrap().contains("every 2nd") && half["warnings"].to_string().contains("preview"), "{half}");
    assert!(half["memory_bytes"].as_u64().unwrap() < before["memory_bytes"].as_u64().unwrap() / 7);
    // An option behind the output is about the scan, too.
    ok(&d, "convert ball.nrrd quarter.mha --reduce 4");
    assert_eq!(info("quarter.mha")["dims"].to_string(), "[4,4,4]");
    let left = std::fs::read_dir(&d).unwrap().filter(|e| e.as_ref().unwrap().file_name().to_string_lossy().contains(".part")).count();
    assert_eq!(left, 0);
}

#[test]
fn a_depth_image_measures_the_ball() {
    // Fails if depth is not along the unit pixel ray, in mm, or if the camera differs from its agreed formula.
    let d = folder("depth");
    nrrd(&d.join("ball.nrrd"), CUBE, &ball());
    for backend in ["cpu", "gpu"] {
        ok(
            &d,
            &format!(
                "render ball.nrrd --iso 0 --backend {backend} --eye 7.5,-92.5,7.5 --target 7.5,7.5,7.5 --fov 10 --size 65x65 --depth depth.npy --out p.png"
            ),
        );
        let npy = std::fs::read(d.join("depth.npy")).unwrap();
        assert!(npy.starts_with(b"\x93NUMPY\x01\x00"));
        let header_end = 10 + usize::from(u16::from_le_bytes([npy[8], npy[9]]));
        assert!(header_end.is_multiple_of(64) && String::from_utf8_lossy(&npy[10..header_end]).contains("'shape': (65, 65)"));
        let depth: Vec<f32> = npy[header_end..].chunks(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
        assert_eq!(depth.len(), 65 * 65);
        // The ball of 0 has radius 4. The ray runs half a voxel beside four rows of samples, where the distance to the centre
        // is 0.5/(2·4) longer.
        assert!((depth[32 * 65 + 32] - 96.0625).abs() < 0.005, "{}", depth[32 * 65 + 32]);
        assert!(depth[0].is_nan());
    }
    // The pixel's ray is what the guide says: probe along it, and find the same depth.
    let tan = (5.0_f64).to_radians().tan();
    let (u, v) = ((2.0 * 40.5 / 65.0 - 1.0) * tan, (1.0 - 2.0 * 28.5 / 65.0) * tan);
    let line = format!("probe ball.nrrd --iso 0 --origin 7.5,-92.5,7.5 --direction {u},1,{v} --format json");
    let record: Value = serde_json::from_str(&stdout(&ok(&d, &line))).unwrap();
    let npy = std::fs::read(d.join("depth.npy")).unwrap();
    let at = npy.len() - 65 * 65 * 4 + (28 * 65 + 40) * 4;
    let depth = f32::from_le_bytes(npy[at..at + 4].try_into().unwrap());
    let probed = record["volumes"][0]["crossings"][0]["t_mm"].as_f64().unwrap();
    assert!((f64::from(depth) - probed).abs() < 1e-4, "{depth} {probed}");
}

#[test]
fn two_scans_are_compared_in_one_picture() {
    // Fails if a comparison shows a scan on the side of the other, or draws something else where there is only one.
    let d = folder("compare");
    nrrd(&d.join("a.nrrd"), CUBE, &ball());
    nrrd(&d.join("b.nrrd"), CUBE, &ball());
    // Pixels of the ball, by row and column, and whose they are.
    for (compare, row, pixels) in [
        ("side", 16, [(16, 1), (48, 2)]),
        ("swipe:0.5", 16, [(31, 1), (32, 2)]),
        ("checker:4", 14, [(31, 1), (32, 2)]),
        ("checker:4", 17, [(31, 2), (32, 1)]),
    ] {
        ok(&d, &format!("render a.nrrd b.nrrd --iso 0 --backend cpu --out p.png --volume-id id.npy --size 64x32 --compare {compare}"));
        let npy = std::fs::read(d.join("id.npy")).unwrap();
        let ids = &npy[npy.len() - 64 * 32..][row * 64..][..64];
        assert_eq!(pixels.map(|(column, _)| ids[column]), pixels.map(|(_, id)| id), "{compare}, row {row}: {ids:?}");
    }
    let out = bregma(&d, "render a.nrrd --iso 0 --backend cpu --out p.png --compare side");
    assert!(out.status.code() == Some(2) && stderr(&out).contains("two scans"), "{}", stderr(&out));
}

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

/// The fields of a CSV table, read strictly (RFC 4180): as many in every row, quotes only around whole fields, no spaces at ends of fields.
fn rows(text: &str) -> Vec<Vec<String>> {
    assert!(!text.starts_with('\u{feff}') && text.ends_with('\n') && !text.contains(['\r', '\t']));
    let row = |line: &str| {
        let (mut fields, mut rest) = (vec![], Some(line));
        while let Some(now) = rest {
            let (field, next) = match now.strip_prefix('"') {
                None => now.split_once(',').map_or((now.to_owned(), None), |(field, rest)| (field.to_owned(), Some(rest))),
                Some(quoted) => {
                    let (mut field, mut chars) = (String::new(), quoted.char_indices().peekable());
                    let end = loop {
                        let (n, c) = chars.next().expect("a quote is closed");
                        match c {
                            '"' if chars.peek().is_some_and(|(_, c)| *c == '"') => field.extend(chars.next().map(|(_, c)| c)),
                            '"' => break n + 1,
                            c => field.push(c),
                        }
                    };
                    let after = &quoted[end..];
                    assert!(after.is_empty() || after.starts_with(','), "{line}");
                    (field, after.strip_prefix(','))
                }
            };
            assert!(field.trim() == field, "{line}");
            fields.push(field);
            rest = next;
        }
        fields
    };
    let rows: Vec<Vec<String>> = text.lines().map(row).collect();
    assert!(rows.iter().all(|r| r.len() == rows[0].len()));
    rows
}

/// One column of such a table, without its head.
fn column(rows: &[Vec<String>], name: &str) -> Vec<String> {
    let n = rows[0].iter().position(|head| head == name).unwrap_or_else(|| panic!("no column {name}"));
    rows[1..].iter().map(|row| row[n].clone()).collect()
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
fn a_preset_moves_no_isovalue() {
    // Fails if a look changes what is drawn as bone, or what a depth is measured to.
    let d = folder("preset");
    nrrd(&d.join("ball.nrrd"), CUBE, &ball());
    let depth = |options: &str| {
        ok(&d, &format!("render ball.nrrd --iso 226 {options} --backend cpu --size 48x48 --mode iso --depth d.npy --out p.png"));
        (std::fs::read(d.join("d.npy")).unwrap(), std::fs::read(d.join("p.png")).unwrap())
    };
    assert!(depth("--preset dry-skull") == depth(""));
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

#[test]
fn a_transform_moves_the_volume_before_it() {
    let d = folder("transform");
    nrrd(&d.join("ball.nrrd"), CUBE, &ball());
    std::fs::write(d.join("up.json"), r#"{"R": [[1,0,0],[0,1,0],[0,0,1]], "t": [0,0,100]}"#).unwrap();
    let line = "probe ball.nrrd --transform up.json ball.nrrd --iso 0 --origin 7.5,7.5,-20 --direction 0,0,1 --format json";
    let json: Value = serde_json::from_str(&stdout(&ok(&d, line))).unwrap();
    let from = |n: usize| json["volumes"][n]["segments"][0]["from_mm"].as_f64().unwrap();
    assert!((from(0) - from(1) - 100.0).abs() < 1e-9, "{json}");
    assert_ne!(json["volumes"][0]["name"], json["volumes"][1]["name"]);
}

#[test]
fn a_registration_is_made_kept_and_made_again() {
    // Fails if a pose is written the wrong way round, its record does not hold what it was made of (isovalue, landmarks, start, parts), or a scan, or a
    // pose that is another now passes for the one that was.
    let d = folder("register");
    ok(&d, "demo --size 48 --out pair");
    let marks = |name: &str, off: f64| {
        let at = [[30.0, 0.0, 0.0], [-30.0, 5.0, 0.0], [0.0, 60.0, 9.0], [0.0, -50.0, 40.0]];
        let row = |(n, [x, y, z]): (usize, [f64; 3])| format!("p{n},{},{},{}\n", x + off, y, z);
        let rows: String = at.into_iter().enumerate().map(row).collect();
        std::fs::write(d.join(name), format!("name,x_mm,y_mm,z_mm\n{rows}")).unwrap();
    };
    marks("a.csv", 0.0);
    marks("b.csv", 7.0);
    // B moved by (5, 0, 0) mm, from where it is looked for.
    std::fs::write(d.join("off.json"), "[[1,0,0,5],[0,1,0,0],[0,0,1,0],[0,0,0,1]]").unwrap();
    let said = stdout(&ok(&d, "register pair/b.nrrd --transform off.json pair/a.nrrd --iso 300 --but 0,-80,-110,30 --out s.json"));
    assert!(said.contains("% have partners") && said.contains("s.json"), "{said}");
    let said = stdout(&ok(&d, "register pair/b.nrrd pair/a.nrrd --landmarks b.csv a.csv --by landmarks --leave-out p3 --out l.json"));
    assert!(said.contains("residual  0.0000 mm") && said.contains("left out"), "{said}");
    ok(&d, "register pair/b.nrrd pair/a.nrrd --landmarks b.csv a.csv --by landmarks --out l.tfm");
    assert_eq!(stdout(&ok(&d, "verify s.json l.json")), "2 of 2 registrations hold\n");
    let pair = |name: &str| {
        let read: Value = serde_json::from_str(&std::fs::read_to_string(d.join(name)).unwrap()).unwrap();
        read["pairs"]["b.nrrd->a.nrrd"].clone()
    };
    assert!((pair("l.json")["t"][0].as_f64().unwrap() + 7.0).abs() < 1e-9, "{}", pair("l.json")["t"]);
    let of_surfaces = pair("s.json");
    assert!(of_surfaces["t"][0].as_f64().unwrap().abs() < 0.2 && of_surfaces["covariance"]["matrix"].is_array(), "{}", of_surfaces["t"]);
    // The same motion in both forms: the line of B that is moved meets what it met.
    let cast = |transform: &str| {
        stdout(&ok(&d, &format!("probe pair/b.nrrd --transform {transform} pair/a.nrrd --origin 0,-200,20 --direction 0,1,0 --format csv")))
    };
    let lengths = |text: &str| column(&rows(text), "length_mm");
    assert_eq!(lengths(&cast("l.json")), lengths(&cast("l.tfm")));
    let mut moved: Value = serde_json::from_str(&std::fs::read_to_string(d.join("s.json")).unwrap()).unwrap();
    moved["pairs"]["b.nrrd->a.nrrd"]["t"][2] = 1.0.into();
    std::fs::write(d.join("moved.json"), moved.to_string()).unwrap();
    fails(&d, "verify moved.json", &["1 of 1 registrations do not hold"]);
    fails(&d, "register pair/b.nrrd pair/a.nrrd --iso 99999 --out n.json", &["b.nrrd", "no", "isovalue"]);
    fails(
        &d,
        "register pair/b.nrrd pair/a.nrrd --landmarks b.csv a.csv --by landmarks --leave-out p3 --leave-out p2 --out n.json",
        &["2 landmarks"],
    );
    for wrong in ["register pair/b.nrrd pair/a.nrrd --out n.mat", "register pair/b.nrrd pair/a.nrrd --by landmarks --out n.json"] {
        assert_eq!(bregma(&d, wrong).status.code(), Some(2), "{wrong}");
    }
    assert!(!d.join("n.json").exists());
}

#[test]
fn a_skull_is_held_by_its_points_and_by_its_symmetry() {
    // Fails if the pose that is written does not hold the skull level, or what is missing for it is not named.
    let d = folder("orient");
    ok(&d, "demo --size 48 --out pair");
    let points = "name,x_mm,y_mm,z_mm\nporion left,60,3,-20\nporion right,-60,-3,-20\norbitale left,31,-75,-20\norbitale right,-31,-78,-18\nnasion,0,-90,5\nbasion,0,10,-40\nbregma,0,-10,80\n";
    std::fs::write(d.join("points.csv"), points).unwrap();
    let said = stdout(&ok(&d, "orient pair/a.nrrd points.csv --out level.json"));
    assert!(said.contains("Frankfurt  sure to") && said.contains("orbitale   the right one lies 2.00 mm above the plane"), "{said}");
    let level: Value = serde_json::from_str(&std::fs::read_to_string(d.join("level.json")).unwrap()).unwrap();
    let turn = 3.0_f64.atan2(60.0);
    assert!(
        (level["R"][0][0].as_f64().unwrap() - turn.cos()).abs() < 1e-9 && (level["R"][2][2].as_f64().unwrap() - 1.0).abs() < 1e-9,
        "{level}"
    );
    ok(&d, "render pair/a.nrrd --transform level.json --size 32x32 --out level.png");
    let said = stdout(&ok(&d, "orient pair/a.nrrd points.csv --by symmetry --out upright.tfm"));
    assert!(said.contains("symmetry   normal (1.0000, ") && said.contains("midline    its points' plane is turned by 0.0"), "{said}");
    std::fs::write(d.join("points.csv"), points.replace("orbitale left", "orbitale")).unwrap();
    fails(&d, "orient pair/a.nrrd points.csv --out n.json", &["set orbitale left"]);
    assert_eq!(bregma(&d, "orient pair/a.nrrd pair/b.nrrd --out n.json").status.code(), Some(2));
}

#[test]
fn bench_reports_what_is_agreed() {
    let d = folder("bench");
    nrrd(&d.join("ball.nrrd"), CUBE, &ball());
    let json: Value =
        serde_json::from_str(&stdout(&ok(&d, "bench ball.nrrd --iso 0 --size 64 --frames 2 --backend cpu --threads 1 --json"))).unwrap();
    for key in [
        "backend",
        "adapter",
        "threads",
        "mode",
        "solver",
        "size",
        "frames",
        "volumes",
        "first_frame_ms",
        "median_ms",
        "p95_ms",
        "isovalue_change_ms",
        "rays_per_s",
        "memory_bytes",
    ] {
        assert!(json.get(key).is_some(), "{key}");
    }
    assert_eq!((json["threads"].as_u64(), json["backend"].as_str()), (Some(1), Some("cpu")));
}

#[test]
fn without_a_display_the_demo_is_written_and_its_session_opens() {
    // Fails if the first command of the README does nothing on a machine without a display.
    let d = folder("demo");
    let out = ok(&d, "");
    assert!(stderr(&out).contains("no display") && stderr(&out).contains("bregma-demo"), "{}", stderr(&out));
    for file in ["a.nrrd", "b.nrrd", "session.json", "iso.png", "overlay.png", "probe.csv"] {
        assert!(d.join("bregma-demo").join(file).metadata().unwrap().len() > 0, "{file}");
    }
    ok(&d, "render bregma-demo/session.json --backend cpu --size 200x200 --out from-session.png --volume-id id.npy");
    let id = std::fs::read(d.join("id.npy")).unwrap();
    let ids = &id[id.len() - 40_000..];
    assert!(ids.contains(&1) && ids.contains(&2), "the session shows both skulls");
    // The session's own view, said again, changes nothing; beside another scan it still opens.
    ok(&d, "render bregma-demo/session.json --backend cpu --size 200x200 --fov 30 --out again.png");
    assert_eq!(std::fs::read(d.join("from-session.png")).unwrap(), std::fs::read(d.join("again.png")).unwrap());
    let lines = stdout(&ok(&d, "info bregma-demo/a.nrrd --json")) + &stdout(&ok(&d, "info bregma-demo/session.json --json"));
    assert_eq!(lines.lines().count(), 3);
    ok(&d, "render bregma-demo/a.nrrd bregma-demo/session.json --backend cpu --size 64x64 --out three.png --volume-id id.npy");
}
