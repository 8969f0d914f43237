//! The program as scripts see it: agreed outputs, and one clear line for whatever is wrong.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod differing;
mod filming;
mod measuring;
mod parting;
mod printing;
mod registering;
mod sectioning;
mod stores;
mod volumes;
mod within;

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

/// The pixels of a PNG.
fn pixels(file: &Path) -> Vec<u8> {
    let mut reader = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(file).unwrap())).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    pixels
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
    fails(&d, "render good.nrrd --backend cpu --out .", &["no picture by its name", ".tif"]);
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
fn a_sphere_keeps_what_lies_within_its_radius() {
    // Fails if a sphere cuts at another place than its radius, on either backend, or one without a radius is taken.
    let d = folder("sphere");
    nrrd(&d.join("bone.nrrd"), CUBE, &[1000; 4096]);
    for backend in ["cpu", "gpu"] {
        let view = "--eye 7.5,-92.5,7.5 --target 7.5,7.5,7.5 --up 0,0,1 --ortho 16.5 --size 33x33";
        ok(&d, &format!("render bone.nrrd --iso 0 --backend {backend} --sphere 8.5,7.5,7.5,5 {view} --depth depth.npy --out p.png"));
        let npy = std::fs::read(d.join("depth.npy")).unwrap();
        let depths = npy[npy.len() - 33 * 33 * 4..].chunks(4).map(|b| f32::from_le_bytes(b.try_into().unwrap()));
        let mut seen = 0;
        for (n, depth) in depths.enumerate() {
            // A pixel is half a mm; at each, the sphere's near half lies so far before its middle.
            let (across, up) = (n as f64 % 33.0 * 0.5 - 8.0 - 1.0, 8.0 - (n / 33) as f64 * 0.5);
            let before = (25.0 - across * across - up * up).sqrt();
            assert!(depth.is_nan() == before.is_nan() || before < 0.2, "{backend}: {depth} at {across}, {up}");
            if before > 0.2 {
                seen += 1;
                assert!((f64::from(depth) - (100.0 - before)).abs() < 1e-3, "{backend}: {depth} at {across}, {up}");
            }
        }
        assert!(seen > 250, "{seen}");
    }
    let out = bregma(&d, "render bone.nrrd --sphere 8,7,7,0 --out p.png");
    assert!(out.status.code() == Some(2) && stderr(&out).contains("a sphere needs a positive radius"), "{}", stderr(&out));
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
fn a_preset_moves_no_isovalue() {
    // Fails if a look changes what is drawn as bone, or what a depth is measured to.
    let d = folder("preset");
    nrrd(&d.join("ball.nrrd"), CUBE, &ball());
    let depth = |options: &str| {
        ok(&d, &format!("render ball.nrrd --iso 226 {options} --backend cpu --size 48x48 --mode iso --depth d.npy --out p.png"));
        (std::fs::read(d.join("d.npy")).unwrap(), pixels(&d.join("p.png")))
    };
    assert!(depth("--preset dry-skull") == depth(""));
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
        "min_per_s",
        "mean_per_s",
        "max_per_s",
        "isovalue_change_ms",
        "rays_per_s",
        "memory_bytes",
    ] {
        assert!(json.get(key).is_some(), "{key}");
    }
    assert_eq!((json["threads"].as_u64(), json["backend"].as_str()), (Some(1), Some("cpu")));
    let rate = ["min_per_s", "mean_per_s", "max_per_s"].map(|key| json[key].as_f64().unwrap());
    assert!(0.0 < rate[0] && rate[0] <= rate[1] && rate[1] <= rate[2], "{rate:?}");
    let text = stdout(&ok(&d, "bench ball.nrrd --iso 0 --size 64 --frames 2 --backend cpu"));
    assert!(text.contains("at least") && text.contains("in the mean") && text.contains("at most"), "{text}");
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
