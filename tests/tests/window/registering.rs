//! One scan brought onto another by its panel: fitted, taken back, saved, and left alone where it was cancelled.

use super::*;
use bregma_session::{Landmark, Opened, Session, Source};
use bregma_synthetic::Which;
use glam::{DAffine3, DQuat, DVec3};
use std::path::PathBuf;

/// Where both scans lie: nothing must depend on one of them lying in its own world.
pub fn place() -> DAffine3 {
    DAffine3::from_rotation_translation(DQuat::from_axis_angle(DVec3::new(0.2, 1.0, 0.3).normalize(), 0.4), DVec3::new(30.0, -20.0, 11.0))
}

/// By how much the second one is off: 4 mm and 3 degrees.
fn off() -> DAffine3 {
    DAffine3::from_rotation_translation(DQuat::from_axis_angle(DVec3::new(1.0, -0.4, 0.5).normalize(), 0.052), DVec3::new(2.5, -2.0, 2.4))
}

/// Points of the face, in the skull's own world.
const POINTS: [(&str, DVec3); 6] = [
    ("nasion", DVec3::new(0.0, -88.0, -20.0)),
    ("bregma", DVec3::new(0.0, -15.0, 70.0)),
    ("lambda", DVec3::new(1.0, 80.0, 20.0)),
    ("porion left", DVec3::new(60.0, 8.0, -35.0)),
    ("porion right", DVec3::new(-60.0, 8.0, -35.0)),
    ("glabella", DVec3::new(0.0, -92.0, -5.0)),
];

/// A skull and the same again, moved off, with landmarks on both that are `errors_mm` off along x on the second.
pub fn twice(name: &str, errors_mm: [f64; 6]) -> (Window, PathBuf) {
    let sources: Vec<Source> = ["skull", "again"].map(|name| Source { called: Some(name.into()), ..Source::built_in(Which::A, 48) }).into();
    let volume = bregma_synthetic::skull(Which::A, 48, &Default::default()).unwrap();
    let volumes = sources.iter().map(|source| std::sync::Arc::new(volume.renamed(&source.name()))).collect();
    let mut opened = Opened::new(sources, volumes);
    (opened.scene.layers[0].transform, opened.scene.layers[1].transform) = (place(), place() * off());
    for (n, scan) in ["skull", "again"].into_iter().enumerate() {
        for ((name, point), error_mm) in POINTS.into_iter().zip(errors_mm) {
            let point = opened.scene.layers[n].transform.transform_point3(point + DVec3::X * error_mm * n as f64);
            opened.landmarks.push(Landmark { scan: Some(scan.into()), ..Landmark::at(name, point) });
        }
    }
    opened.first_look(1.0);
    let file = std::env::temp_dir().join(format!("bregma-window-{}-{name}.json", std::process::id()));
    Session::of(&opened, &std::env::temp_dir()).write(&file).unwrap();
    let mut window = open(Start::Files(vec![Source { file: file.clone(), ..Source::default() }]));
    wait(&mut window, "the session", |w| !w.is_loading());
    settle(&mut window);
    command(&mut window, "Register scans");
    (window, file)
}

pub fn pose(window: &Window) -> DAffine3 {
    window.state().scene().layers[1].transform
}

/// How far a pose is from the true one at the landmarks, at most, mm.
pub fn off_mm(pose: DAffine3) -> f64 {
    POINTS.iter().map(|(_, p)| pose.transform_point3(*p).distance(place().transform_point3(*p))).fold(0.0, f64::max)
}

/// Where the landmarks of the second scan are, against those of the first, at most, mm.
pub fn landmarks_off_mm(window: &Window) -> f64 {
    let points: Vec<DVec3> = window.state().landmarks().iter().map(|l| l.point_mm.unwrap()).collect();
    (0..6).map(|n| points[n].distance(points[6 + n])).fold(0.0, f64::max)
}

pub fn fit(window: &mut Window) {
    let before = pose(window);
    window.get_by_label("Fit").click();
    wait(window, "the fit", |w| w.scene().layers[1].transform != before);
    settle(window);
}

#[test]
fn surfaces_bring_a_scan_back_and_one_step_undoes_all_of_it() {
    // Fails if the pose is taken for one in the fixed scan's own world, its landmarks stay behind, the panel does not say how well it lies, or
    // undo, redo and the way back do not take pose, sureness and landmarks together.
    let (mut window, file) = twice("surfaces", [0.0; 6]);
    let (before, points) = (pose(&window), window.state().landmarks().to_vec());
    assert!(off_mm(before) > 4.0);
    fit(&mut window);
    assert!(off_mm(pose(&window)) < 0.05, "{} mm off", off_mm(pose(&window)));
    assert!(landmarks_off_mm(&window) < 0.05);
    let covariance = window.state().scene().layers[1].covariance.clone().expect("how sure it is");
    let middle = place().transform_point3(DVec3::new(0.0, 0.0, -20.0));
    assert!(covariance.centre_mm.distance(middle) < 40.0, "{} is not in the scene's world, where {middle} is", covariance.centre_mm);
    for label in ["again onto skull", "distance", "with partners", "± of the middle", "Histogram of distances between the surfaces"] {
        window.get_by_label(label);
    }
    screenshot(&mut window, "register-surfaces.png");
    let fitted = pose(&window);
    undo(&mut window);
    assert_eq!((pose(&window), window.state().landmarks()), (before, &points[..]));
    assert_eq!(window.state().scene().layers[1].covariance, None);
    assert!(window.query_by_label("again onto skull").is_none(), "it does not lie so any more");
    window.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    settle(&mut window);
    assert_eq!((pose(&window), window.state().scene().layers[1].covariance.as_ref()), (fitted, Some(&covariance)));
    window.get_by_label("Back to where it was").scroll_to_me();
    window.run_steps(4);
    window.get_by_label("Back to where it was").click();
    settle(&mut window);
    assert_eq!((pose(&window), window.state().scene().layers[1].covariance.as_ref()), (before, None));
    let moved = window.state().landmarks().iter().zip(&points).map(|(a, b)| a.point_mm.unwrap().distance(b.point_mm.unwrap()));
    assert!(moved.fold(0.0, f64::max) < 1e-9);
    undo(&mut window);
    assert_eq!(pose(&window), fitted);
    std::fs::remove_file(file).unwrap();
}

#[test]
fn a_fit_that_is_cancelled_moves_nothing() {
    // Fails if a cancelled fit still puts the scan somewhere, or leaves the panel waiting.
    let (mut window, file) = twice("cancelled", [0.0; 6]);
    let before = pose(&window);
    window.get_by_role_and_label(Role::RadioButton, "Anywhere").click();
    window.run_steps(2);
    window.get_by_label("Fit").click();
    window.run_steps(2);
    window.get_by_label("Cancel").click();
    window.run_steps(2);
    // Whoever worked on has time to end.
    std::thread::sleep(Duration::from_millis(500));
    window.run_steps(4);
    assert_eq!(pose(&window), before);
    window.get_by_label("Fit");
    std::fs::remove_file(file).unwrap();
}

#[test]
fn landmarks_fit_without_the_one_that_is_another_point() {
    // Fails if an outlier is not marked, a tick does not leave it out, the residual is not what is left, or undo forgets it.
    let (mut window, file) = twice("landmarks", [0.02, -0.03, 0.01, 9.0, 0.03, -0.02]);
    let before = pose(&window);
    window.get_by_role_and_label(Role::RadioButton, "By landmarks").click();
    window.run_steps(3);
    window.get_by_role_and_label(Role::CheckBox, "Use porion left, which is far off").click();
    window.run_steps(3);
    window.get_by_role_and_label(Role::CheckBox, "Use porion left");
    screenshot(&mut window, "register-landmarks.png");
    fit(&mut window);
    assert!(off_mm(pose(&window)) < 0.1, "{} mm off", off_mm(pose(&window)));
    let layer = &window.state().scene().layers[1];
    assert!(layer.residual_mm.is_some_and(|mm| (0.001..0.05).contains(&mm)) && layer.covariance.is_some(), "{:?}", layer.residual_mm);
    screenshot(&mut window, "register-landmarks-fitted.png");
    undo(&mut window);
    assert_eq!((pose(&window), window.state().scene().layers[1].residual_mm), (before, None));
    // Two are too few: it says so, and there is nothing to press.
    for (name, _) in &POINTS[..3] {
        window.get_by_role_and_label(Role::CheckBox, &format!("Use {name}")).click();
        window.run_steps(2);
    }
    window.get_by_label_contains("3 are needed");
    assert!(window.get_by_label("Fit").accesskit_node().is_disabled());
    std::fs::remove_file(file).unwrap();
}

#[test]
fn onto_a_stretched_scan_it_is_told_that_lengths_do_not_know_how_sure_it_is() {
    // Fails if a covariance is turned into a stretched world, where a turn is none, or left out in silence.
    let (mut window, file) = twice("stretched", [0.0; 6]);
    let matrix = std::env::temp_dir().join(format!("bregma-window-{}-stretched-matrix.json", std::process::id()));
    std::fs::write(&matrix, r#"{"pairs": {"skull->again": {"R": [[1.02,0,0],[0,1,0],[0,0,1]], "t": [0,0,0]}}}"#).unwrap();
    drop_file(&mut window, &matrix);
    fit(&mut window);
    window.get_by_label_contains("is stretched by its own registration");
    assert_eq!(window.state().scene().layers[1].covariance, None);
    let stretch = DAffine3::from_scale(DVec3::new(1.02, 1.0, 1.0));
    assert!(POINTS.iter().all(|(_, p)| pose(&window).transform_point3(*p).distance(stretch.transform_point3(*p)) < 0.05));
    [&file, &matrix].iter().for_each(|file| std::fs::remove_file(file).unwrap());
}

#[test]
fn a_registration_from_a_file_takes_the_landmarks_along() {
    // Fails if a file moves a scan away from under the landmarks that were set on it.
    let (mut window, file) = twice("dropped", [0.0; 6]);
    let matrix = std::env::temp_dir().join(format!("bregma-window-{}-dropped-matrix.json", std::process::id()));
    std::fs::write(&matrix, "[[1,0,0,7],[0,1,0,0],[0,0,1,0],[0,0,0,1]]").unwrap();
    drop_file(&mut window, &matrix);
    assert_eq!(pose(&window), DAffine3::from_translation(DVec3::X * 7.0));
    for ((_, point), landmark) in POINTS.iter().zip(&window.state().landmarks()[6..]) {
        assert!(landmark.point_mm.unwrap().distance(*point + DVec3::X * 7.0) < 1e-9, "{landmark:?}");
    }
    [&file, &matrix].iter().for_each(|file| std::fs::remove_file(file).unwrap());
}

#[test]
fn scans_that_lie_apart_are_told_and_one_alone_is_not_registered() {
    // Fails if nobody is told why only one scan is seen, its button does not bring them together, or one scan has a panel that asks which of two.
    let files = ["apart-a", "apart-b"].map(|name| ball(name, 24));
    let matrix = std::env::temp_dir().join(format!("bregma-window-{}-apart.json", std::process::id()));
    std::fs::write(&matrix, "[[1,0,0,500],[0,1,0,0],[0,0,1,0],[0,0,0,1]]").unwrap();
    let source = |n: usize| Source { file: files[n].clone(), transform: (n == 1).then(|| matrix.clone()), ..Source::default() };
    let mut window = open(Start::Files(vec![source(0), source(1)]));
    wait(&mut window, "the scans", |w| !w.is_loading());
    settle(&mut window);
    window.get_by_label_contains("lie apart from each other");
    // The message has a button that helps.
    window.run_steps(3);
    screenshot(&mut window, "register-apart.png");
    window.get_by_label("Bring scans together").click();
    wait(&mut window, "the registration", |w| w.scene().layers[1].transform.translation.x < 400.0);
    settle(&mut window);
    let moved = window.state().scene().layers[1].transform.transform_point3(DVec3::splat(11.5));
    assert!(moved.distance(DVec3::splat(11.5)) < 0.1, "the middles lie on each other: {moved}");
    assert!(window.query_by_label_contains("lie apart from each other").is_none(), "it was heard");
    let name = window.state().volumes()[1].name().to_owned();
    close_scan(&mut window, &name);
    window.get_by_label("Register").click();
    window.run_steps(3);
    window.get_by_label_contains("open a second one");
    files.iter().chain([&matrix]).for_each(|file| std::fs::remove_file(file).unwrap());
}
