//! Scans moved onto others, and held by themselves.

use super::*;

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
    let said = stdout(&ok(
        &d,
        "register pair/b.nrrd --transform off.json pair/a.nrrd --iso 300 --but 0,-80,-110,30 --but -30,-110,-140,30,-50,-80 --out s.json",
    ));
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
    ok(&d, "register pair/b.nrrd --transform off.json pair/a.nrrd --by intensities --only -90,90,-60,90,-90,90 --out i.json");
    assert!(pair("i.json")["t"][0].as_f64().unwrap().abs() < 0.2, "{}", pair("i.json")["t"]);
    assert_eq!(stdout(&ok(&d, "verify i.json")), "1 of 1 registrations hold\n");
    for wrong in [
        "register pair/b.nrrd pair/a.nrrd --only 0,0,0,5,0,9 --out n.json",
        "register pair/b.nrrd pair/a.nrrd --out n.mat",
        "register pair/b.nrrd pair/a.nrrd --by landmarks --out n.json",
    ] {
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
fn a_mirror_image_is_called_one_wherever_it_is_measured() {
    // Fails if the image is laid beside the scan, or a length on it passes for the scan's own.
    let d = folder("mirrored");
    ok(&d, "demo --size 48 --out pair");
    let said = stdout(&ok(&d, "orient pair/a.nrrd --by symmetry --out upright.json --mirror-out mirrored.json"));
    assert!(said.contains("mirrored.json: the mirror image of a.nrrd on itself"), "{said}");
    let written: Value = serde_json::from_str(&std::fs::read_to_string(d.join("mirrored.json")).unwrap()).unwrap();
    assert!(written["mirrored"] == true && written["covariance"]["matrix"].is_array(), "{written}");
    let line = "probe pair/a.nrrd pair/a.nrrd --transform mirrored.json --origin -200,-20,20 --direction 1,0,0 --format json";
    let out = ok(&d, line);
    assert!(stderr(&out).contains("mirror image of a.nrrd: is a mirror image"), "{}", stderr(&out));
    std::fs::write(d.join("ray.json"), stdout(&out)).unwrap();
    let ray: Value = serde_json::from_str(&stdout(&out)).unwrap();
    assert!(ray["notes"].to_string().contains("mirror image of a.nrrd") && ray["volumes"][1]["name"] == "mirror image of a.nrrd", "{ray}");
    // The phantom is nearly its own mirror image.
    let from = |n: usize| ray["volumes"][n]["segments"][0]["from_mm"].as_f64().unwrap();
    assert!((from(0) - from(1)).abs() < 0.5, "{} {}", from(0), from(1));
    ok(&d, "verify ray.json");
    ok(&d, "render pair/a.nrrd pair/a.nrrd --transform mirrored.json --mode overlay --size 32x32 --out both.png");
    assert_eq!(bregma(&d, "orient pair/a.nrrd --out n.json --mirror-out m.json").status.code(), Some(2));
}
