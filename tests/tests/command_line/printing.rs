//! Prints as scripts ask for them.

use super::{CUBE, ball, bregma, fails, folder, nrrd, ok, stderr, stdout};

#[test]
fn prints_are_refused_in_words_and_written_as_asked_for() {
    // Fails if an option is taken for another, a wrong one writes a file, or a print is not what `verify` draws again.
    let d = folder("print");
    nrrd(&d.join("ball.nrrd"), CUBE, &ball());
    std::fs::write(d.join("points.fcsv"), "# Markups fiducial file version = 5.0\n# CoordinateSystem = LPS\n# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n1,12,9,7,0,0,0,1,1,1,0,po L,,\n2,3,9,7,0,0,0,1,1,1,0,po R,,\n3,9,4,7,0,0,0,1,1,1,0,or L,,\n").unwrap();
    for (options, parts) in [
        ("--out p.doc", &["p.doc", ".tif, .exr, .jpg, .pdf or .svg"][..]),
        ("--bar 5 --out p.png", &["--ortho", "--bar-at target"]),
        ("--scale 1:2 --out p.png", &["perspective", "--ortho"]),
        ("--view frontalis --fov 20 --scale 1:2 --out p.png", &["perspective"]),
        ("--view frontalis --frankfurt --out p.png", &["porion left"]),
        ("--view frontalis --frankfurt a,b,c --out p.png", &["no landmark a"]),
        ("--view frontalis --print 30x2 --caption some --out p.png", &["no room"]),
        ("--view frontalis --print 85 --dpi 10000 --out p.png", &["16384"]),
        ("--view frontalis --print 40 --for plos --out p.png", &["plos", "mm wide", "--print", "end its name in .tif"]),
        ("--view frontalis --bits 16 --out p.jpg", &["p.jpg", "--bits"]),
        ("--view frontalis --icc none.icc --out p.tif", &["none.icc"]),
        ("--view frontalis --ground clear --out p.jpg", &["--ground"]),
        ("--plate none.json --out p.png", &["none.json"]),
    ] {
        let scan = if options.starts_with("--plate") { "" } else { "ball.nrrd" };
        fails(&d, &format!("render {scan} --backend cpu {options}").replace("  ", " "), parts);
    }
    for options in [
        "--view sideways --out p.png",
        "--frankfurt --out p.png",
        "--print 0x5 --out p.png",
        "--bar-at target --out p.png",
        "--plate frontalis,up --out p.png",
        "--plate frontalis --view frontalis --out p.png",
    ] {
        let out = bregma(&d, &format!("render ball.nrrd --backend cpu {options}"));
        assert_eq!(out.status.code(), Some(2), "{options}: {}", stderr(&out));
    }
    assert!(!d.join("p.png").exists() && !d.join("p.doc").exists() && !d.join("p.jpg").exists());
    let held = "render ball.nrrd points.fcsv --backend cpu --view lateralis-dextra --frankfurt --print 44x60 --dpi 60 --samples 2";
    ok(&d, &format!("{held} --bar 5 --letters --label B --caption auto --marks --legend --out p.tif"));
    assert!(stdout(&ok(&d, "verify --all p.tif --backend cpu")).contains("byte for byte"));
    std::fs::write(
        d.join("plate.json"),
        r#"{"columns": 2, "pictures": [["ball.nrrd", "--view", "frontalis"], ["ball.nrrd", "--view", "verticalis", "--iso", "300"]]}"#,
    )
    .unwrap();
    ok(&d, "render --plate plate.json --backend cpu --print 50x40 --dpi 60 --samples 1 --bar auto --label A --out p.svg");
    assert!(stdout(&ok(&d, "verify p.svg --backend cpu")).contains("1 of 1 pictures hold"));
    // The scan is another one now.
    nrrd(&d.join("ball.nrrd"), CUBE, &[7; 4096]);
    fails(&d, "verify p.svg --backend cpu", &["content differs"]);
}
