//! What a session keeps, and what of it stays when it is opened beside other scans.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use bregma_renderer::studio::Preset;
use bregma_renderer::{Clip, Color, Mode, Shape, TransferFunction};
use bregma_session::Compare;
use bregma_session::film::{Film, Key};
use bregma_session::studio::ready_made;
use bregma_session::{Landmark, Made, Opened, Session, Source, save};
use bregma_volume::Progress;
use glam::{DAffine3, DVec3};
use std::path::{Path, PathBuf};

/// A folder of its own with two scans and a session of both.
fn folder(name: &str, change: impl FnOnce(&mut Opened)) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).unwrap();
    for file in ["a.nrrd", "b.nrrd"] {
        let header = "NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes: 3 3 3\nspace directions: (1,0,0) (0,1,0) \
            (0,0,1)\nspace origin: (0,0,0)\nencoding: raw\n\n";
        let samples: Vec<u8> = (0..27).map(|n| n * 9).collect();
        std::fs::write(folder.join(file), [header.as_bytes(), &samples].concat()).unwrap();
    }
    let mut opened = read(&folder, &["a.nrrd", "b.nrrd"]).unwrap();
    change(&mut opened);
    let text = serde_json::to_string(&Session::of(&opened, &folder)).unwrap();
    std::fs::write(folder.join("session.json"), text).unwrap();
    folder
}

fn read(folder: &Path, files: &[&str]) -> Result<Opened, String> {
    let sources: Vec<Source> = files.iter().map(|file| Source { file: folder.join(file), ..Source::default() }).collect();
    Opened::read(&sources, &Progress::default()).map_err(|e| e.to_string())
}

/// White, as files have a byte for each part of a colour.
fn look() -> TransferFunction {
    let mut look = TransferFunction::bone();
    look.points.iter_mut().for_each(|p| p.color = Color([1.0; 3]));
    look
}

fn cut() -> Clip {
    Clip::all(Shape::Plane { normal: DVec3::X, offset_mm: 1.0 })
}

fn ball() -> Clip {
    Clip::all(Shape::Sphere { centre_mm: DVec3::new(1.0, 2.0, 0.5), radius_mm: 1.5 })
}

#[test]
fn a_session_keeps_its_film_and_its_light_and_one_without_opens_as_ever() {
    // Fails if what moves or how it is lit is lost, a session of before has a film or is refused, or joining scans takes a film over.
    let film = Film {
        seconds: 2.0,
        fps: 24.0,
        turns: None,
        keys: vec![
            Key { at_s: 0.0, iso: Some(vec![1.0, 2.0]), ..Key::default() },
            Key { at_s: 2.0, orbit: Some([30.0, 10.0]), ..Key::default() },
        ],
    };
    let folder = folder("session-film", |opened| {
        opened.film = Some(film.clone().into());
        opened.scene.studio = Some(ready_made(Preset::Museum));
    });
    let again = read(&folder, &["session.json"]).unwrap();
    assert_eq!((again.film.as_deref(), again.scene.studio), (Some(&film), Some(ready_made(Preset::Museum))));
    let text = std::fs::read_to_string(folder.join("session.json")).unwrap();
    let mut old: serde_json::Value = serde_json::from_str(&text).unwrap();
    old.as_object_mut().unwrap().remove("film").unwrap();
    old["scene"].as_object_mut().unwrap().remove("studio").unwrap();
    std::fs::write(folder.join("old.json"), old.to_string()).unwrap();
    let before = read(&folder, &["old.json"]).unwrap();
    assert!(before.film.is_none() && before.scene.studio.is_none());
    assert!(!serde_json::to_string(&Session::of(&before, &folder)).unwrap().contains("\"film\""), "and is written as before");
    assert!(read(&folder, &["session.json", "a.nrrd"]).unwrap().film.is_none());
}

#[test]
fn a_session_keeps_cuts_looks_and_how_scans_are_compared() {
    // Fails if something that the window can set is not written, or not read again.
    let folder = folder("session-whole", |opened| {
        opened.scene.clips = vec![cut(), ball()];
        opened.boxes = true;
        opened.compare = Compare::Swipe { part: 0.25 };
        opened.scene.layers[1].transfer = Some(look());
    });
    let again = read(&folder, &["session.json"]).unwrap();
    assert_eq!((again.scene.clips, again.compare, again.boxes), (vec![cut(), ball()], Compare::Swipe { part: 0.25 }, true));
    assert_eq!(again.scene.layers[1].transfer, Some(look()));
}

#[test]
fn kept_registrations_stay_in_the_session_and_older_sessions_have_none() {
    // Fails if a digit, the covariance or how it was made is lost, one that flattens a scan gets in, or a session without any is refused.
    let covariance = bregma_volume::Covariance { centre_mm: DVec3::Y, matrix: [[1.0 / 7.0; 6]; 6], undetermined: vec![[0.5; 6]] };
    let turned = DAffine3::from_rotation_x(0.1) * DAffine3::from_translation(DVec3::splat(1.0 / 3.0));
    let put = |opened: &mut Opened| {
        (opened.scene.layers[1].transform, opened.scene.layers[1].covariance) = (turned, Some(covariance.clone()));
        opened.keep([1, 0], &Made::ByHand);
    };
    let folder = folder("session-poses", put);
    let again = read(&folder, &["session.json"]).unwrap();
    let pose = &again.poses[0];
    assert_eq!((pose.name.as_str(), pose.transform, pose.covariance.as_ref()), ("By hand 1", turned, Some(&covariance)));
    assert!(again.stands(pose, [1, 0]) && pose.record["method"]["by"] == "hand");
    // Beside another scan they are still of the same pair.
    std::fs::copy(folder.join("a.nrrd"), folder.join("c.nrrd")).unwrap();
    assert_eq!(read(&folder, &["c.nrrd", "session.json"]).unwrap().poses_of([2, 1]), [0]);
    let older = self::folder("session-without-poses", |_| {});
    assert!(!std::fs::read_to_string(older.join("session.json")).unwrap().contains("poses"));
    assert!(read(&older, &["session.json"]).unwrap().poses.is_empty());
    let flat = self::folder("session-flat-pose", |opened| {
        put(opened);
        opened.poses[0].transform.matrix3 = glam::DMat3::ZERO;
    });
    assert!(read(&flat, &["session.json"]).unwrap_err().contains("By hand 1"));
}

#[test]
fn beside_other_scans_a_sessions_cuts_are_of_its_own_scans() {
    // Fails if a cut is lost, or cuts a scan that it was not made for.
    let folder = folder("session-beside", |opened| opened.scene.clips = vec![cut(), Clip { layers: Some(vec![1]), ..cut() }]);
    let layers = |opened: &Opened| opened.scene.clips.iter().map(|clip| clip.layers.clone()).collect::<Vec<_>>();
    std::fs::copy(folder.join("a.nrrd"), folder.join("c.nrrd")).unwrap();
    let opened = read(&folder, &["c.nrrd", "session.json"]).unwrap();
    assert_eq!((opened.volumes.len(), layers(&opened)), (3, vec![Some(vec![1, 2]), Some(vec![2])]));
    let mut first = read(&folder, &["c.nrrd"]).unwrap();
    first.add(read(&folder, &["session.json"]).unwrap());
    assert_eq!((first.volumes.len(), layers(&first)), (3, vec![Some(vec![1, 2]), Some(vec![2])]));
}

#[test]
fn a_session_that_cannot_be_drawn_is_refused_in_a_sentence() {
    // Fails if numbers that no renderer can use get past the reading.
    let folder = folder("session-broken", |opened| {
        opened.scene.layers[0].transfer = Some(TransferFunction { points: vec![], name: "empty".into(), ..TransferFunction::bone() });
    });
    let error = read(&folder, &["session.json"]).unwrap_err();
    assert!(error.contains("empty") && error.contains("no points"), "{error}");
    let folder = self::folder("session-flat-cut", |opened| {
        opened.scene.clips = vec![Clip::all(Shape::Plane { normal: DVec3::ZERO, offset_mm: 1.0 })];
    });
    let error = read(&folder, &["session.json"]).unwrap_err();
    assert!(error.contains("cuts"), "{error}");
}

#[test]
fn what_older_versions_and_people_wrote_is_mended_where_its_meaning_is_clear() {
    // Fails if a session is refused for a direction that is not unit, or for two points of a transfer function at one value.
    let folder = folder("session-mended", |opened| {
        opened.scene.clips = vec![Clip::all(Shape::Plane { normal: DVec3::new(0.0, 0.0, 5.0), offset_mm: 10.0 })];
        let mut twice = look();
        twice.points.insert(1, twice.points[0]);
        opened.scene.layers[0].transfer = Some(twice);
    });
    let again = read(&folder, &["session.json"]).unwrap();
    assert_eq!(again.scene.clips, [Clip::all(Shape::Plane { normal: DVec3::Z, offset_mm: 2.0 })]);
    assert_eq!(again.scene.layers[0].transfer, Some(look()));
}

#[test]
fn numbers_that_no_picture_has_are_refused() {
    // Fails if a session gets past the reading with what the command line refuses.
    type Change = fn(&mut Opened);
    let cases: [(&str, Change); 6] = [
        ("opacities", |o| o.scene.layers[0].opacity = 3.0),
        ("window", |o| o.scene.window = Some(bregma_renderer::Window { width: -1.0, level: 0.0 })),
        ("steps", |o| o.scene.integrator = bregma_renderer::Integrator::Steps { per_voxel: 1e30, jitter: false }),
        ("scan that it has not", |o| o.scene.clips = vec![Clip { layers: Some(vec![9]), ..cut() }]),
        ("no size", |o| o.scene.clips = vec![Clip::all(Shape::Box { low_mm: DVec3::ONE, high_mm: DVec3::ZERO })]),
        ("compares", |o| o.compare = Compare::Swipe { part: 9.0 }),
    ];
    for (n, (says, change)) in cases.into_iter().enumerate() {
        let folder = folder(&format!("session-odd-{n}"), change);
        let error = read(&folder, &["session.json"]).unwrap_err();
        assert!(error.contains(says), "{error}");
    }
}

/// A shift along x as ITK states it: from the fixed to the moving image.
const SHIFT: &str =
    "#Insight Transform File V1.0\nTransform: AffineTransform_double_3_3\nParameters: 1 0 0 0 1 0 0 0 1 -5 0 0\nFixedParameters: 0 0 0\n";

#[test]
fn landmarks_and_registrations_are_files_among_the_files() {
    // Fails if what was written cannot be opened, a registration moves another scan than it says or is taken for any, or a landmark loses whose
    // it is.
    let folder = folder("files", |_| ());
    std::fs::copy(folder.join("a.nrrd"), folder.join("c.nrrd")).unwrap();
    std::fs::write(folder.join("b.tfm"), SHIFT).unwrap();
    let pairs = r#"{"pairs": {"a->b": {"R": [[1,0,0],[0,1,0],[0,0,1]], "t": [0,7,0], "rms_mm": 0.5}}}"#;
    std::fs::write(folder.join("pairs.json"), pairs).unwrap();
    let of = |scan: &str, l: Landmark| Landmark { scan: Some(scan.into()), ..l };
    let set = [of("a.nrrd", Landmark::at("nasion", DVec3::new(1.0, 2.0, 3.0))), of("a.nrrd", Landmark::missing("basion"))];
    for file in ["points.mrk.json", "points.csv", "points.tps", "points.fcsv"] {
        save::landmarks(&folder.join(file), &set, "a.nrrd", &Default::default()).unwrap();
        let opened = read(&folder, &["a.nrrd", "b.nrrd", "b.tfm", file]).unwrap();
        let moved: Vec<DVec3> = opened.scene.layers.iter().map(|l| l.transform.translation).collect();
        assert_eq!(moved, [DVec3::ZERO, DVec3::X * 5.0], "{file}");
        if file == "points.fcsv" {
            // It has no words for either.
            assert_eq!(opened.landmarks, [Landmark::at("nasion", DVec3::new(1.0, 2.0, 3.0))]);
        } else {
            assert_eq!(opened.landmarks, set, "{file}");
        }
    }
    // A session keeps both kinds.
    let mut opened = read(&folder, &["a.nrrd", "b.nrrd", "points.csv"]).unwrap();
    Session::of(&opened, &folder).write(&folder.join("kept.json")).unwrap();
    assert_eq!(read(&folder, &["kept.json"]).unwrap().landmarks, set);
    opened.add(read(&folder, &["c.nrrd", "points.csv"]).unwrap());
    // There the scan that they name was not open.
    assert_eq!(opened.landmarks.iter().map(|l| l.scan.is_some()).collect::<Vec<_>>(), [true, true, false, false]);
    // What names its scan moves that.
    let opened = read(&folder, &["a.nrrd", "b.nrrd", "c.nrrd", "pairs.json"]).unwrap();
    let first = &opened.scene.layers[0];
    assert_eq!((first.transform.translation, first.residual_mm), (DVec3::Y * 7.0, Some(0.5)));
    let error = read(&folder, &["a.nrrd", "b.nrrd", "c.nrrd", "b.tfm"]).unwrap_err();
    assert!(error.contains("b.tfm") && error.contains("--transform"), "{error}");
    for alone in ["b.tfm", "points.csv"] {
        let error = read(&folder, &[alone]).unwrap_err();
        assert!(error.contains(alone) && error.contains("name the scan"), "{error}");
    }
}

#[test]
fn one_bad_file_among_several_is_named_and_the_others_open() {
    // Fails if one file keeps the others from being opened where a person can see which, or where nobody looks passes without an error.
    let folder = folder("bad-file", |_| ());
    std::fs::write(folder.join("bad.nrrd"), "NRRD0004\n").unwrap();
    std::fs::write(folder.join("bad.fcsv"), "a,1,x,3\n").unwrap();
    std::fs::write(folder.join("bad.tfm"), "#Insight Transform File V1.0\n").unwrap();
    std::fs::write(folder.join("bad.json"), "{}").unwrap();
    std::fs::write(folder.join("good.fcsv"), "n,1,2,3,1,1\n").unwrap();
    let files = ["a.nrrd", "bad.nrrd", "bad.json", "b.nrrd", "bad.fcsv", "bad.tfm", "good.fcsv", "gone.nrrd"];
    let sources = |files: &[&str]| files.iter().map(|file| Source { file: folder.join(file), ..Source::default() }).collect::<Vec<_>>();
    let (opened, errors) = Opened::read_what_opens(&sources(&files), &Progress::default()).unwrap();
    assert_eq!((opened.volumes.len(), opened.landmarks.len()), (2, 1));
    let errors: Vec<String> = errors.iter().map(ToString::to_string).collect();
    for bad in ["bad.nrrd", "bad.json", "bad.fcsv", "bad.tfm", "gone.nrrd"] {
        assert_eq!(errors.iter().filter(|error| error.contains(bad)).count(), 1, "{bad}: {errors:?}");
        assert!(read(&folder, &["a.nrrd", bad]).unwrap_err().contains(bad));
    }
    assert_eq!(errors.len(), 5);
    // Alone, landmarks can be added to what is open; and nothing is an error.
    let (alone, _) = Opened::read_what_opens(&sources(&["good.fcsv"]), &Progress::default()).unwrap();
    assert!(alone.volumes.is_empty() && alone.landmarks.len() == 1);
    assert!(Opened::read_what_opens(&sources(&["bad.nrrd"]), &Progress::default()).is_err());
}

#[test]
fn sessions_of_earlier_versions_open_as_they_were_left() {
    // Fails if a session that version 0.1.0 wrote no longer opens, or opens with another view, mode, cut or measurement.
    let folder = folder("session-old", |_| ());
    let open = |name: &str| {
        let old = Path::new(env!("CARGO_MANIFEST_DIR")).join("sessions").join(name);
        std::fs::copy(old, folder.join(name)).unwrap();
        let opened = read(&folder, &[name]).unwrap();
        let again = folder.join(format!("again-{name}"));
        Session::of(&opened, &folder).write(&again).unwrap();
        let reopened = read(&folder, &[again.file_name().unwrap().to_str().unwrap()]).unwrap();
        assert_eq!((&reopened.scene, &reopened.landmarks, reopened.compare), (&opened.scene, &opened.landmarks, opened.compare));
        assert_eq!(serde_json::to_value(&reopened.measurements).unwrap(), serde_json::to_value(&opened.measurements).unwrap());
        opened
    };
    assert_eq!(open("overlay.json").scene.mode, Mode::Overlay);
    // Then transparent surfaces were no mode of their own.
    let transparent = open("transparent.json");
    assert_eq!(transparent.scene.mode, Mode::Transparent);
    assert!(transparent.scene.shadows && transparent.scene.layers[0].shells.len() == 1 && transparent.scene.clips == vec![cut()]);
    assert_eq!(transparent.compare, Compare::Swipe { part: 0.25 });
    let measured = open("measured.json");
    assert!(measured.scene.mode == Mode::Max && measured.scene.of_gradient);
    assert_eq!((measured.measurements.len(), measured.landmarks[0].name.as_str()), (1, "glabella"));
}
