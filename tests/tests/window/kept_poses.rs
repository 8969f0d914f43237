//! Registrations that are kept, compared and taken again; what they are made on; and a scan held upright.

use super::registering::{fit, landmarks_off_mm, off_mm, place, pose, twice};
use super::*;
use bregma_session::{Landmark, Opened, Session, Source};
use glam::DVec3;

fn press_button(window: &mut Window, label: &str) {
    window.get_by_label(label).scroll_to_me();
    window.run_steps(6);
    window.get_by_label(label).click();
    settle(window);
}

fn names(window: &Window) -> Vec<String> {
    window.state().poses().iter().map(|pose| pose.name.clone()).collect()
}

#[test]
fn two_registrations_are_kept_changed_for_each_other_and_compared_along_a_ray() {
    // Fails if one that is kept does not lead back to where it was, with its ± and its landmarks, a change is no step, its name cannot be changed, or
    // the lengths beside each other are not those that the ray has under each.
    let (mut window, file) = twice("kept", [0.0; 6]);
    let middle = window.state().picture_rect().unwrap().center();
    click(&mut window, middle - egui::vec2(0.0, 40.0));
    settle(&mut window);
    assert!(window.state().difference_ray().is_some());
    window.get_by_label_contains("Register").click();
    window.run_steps(3);
    let as_opened = pose(&window);
    press_button(&mut window, "Keep this one");
    fit(&mut window);
    press_button(&mut window, "Keep this one");
    let (fitted, sure) = (pose(&window), window.state().scene().layers[1].covariance.clone());
    let of_fitted = window.state().difference_ray().unwrap().clone();
    assert!(sure.is_some() && off_mm(fitted) < 0.05);
    press_button(&mut window, "Move by hand");
    window.get_by_role_and_label(Role::SpinButton, "Shift to left").set_value_accesskit(1.5);
    settle(&mut window);
    window.key_press(Key::Escape);
    window.run_steps(3);
    press_button(&mut window, "Keep this one");
    assert_eq!(names(&window), ["As it lay 1", "Surfaces 1", "By hand 1"]);
    let by_hand = &window.state().poses()[2];
    assert!(by_hand.record["method"]["by"] == "hand" && by_hand.covariance.is_none());
    assert_eq!(window.state().poses()[1].record["method"]["by"], "surfaces");
    let of_hand = window.state().difference_ray().unwrap().clone();

    press_button(&mut window, "Surfaces 1");
    let near = |a: glam::DAffine3, b: glam::DAffine3| a.abs_diff_eq(b, 1e-9);
    assert!(near(pose(&window), fitted) && window.state().scene().layers[1].covariance.is_some());
    assert!(landmarks_off_mm(&window) < 0.05, "its landmarks came along");
    undo(&mut window);
    assert!((pose(&window).translation - fitted.translation).length() > 1.0);
    press_button(&mut window, "As it lay 1");
    assert!(near(pose(&window), as_opened));

    // The two that are compared: "Surfaces 1" and "By hand 1", while a third one stands.
    for (column, name) in [("First registration", "Surfaces 1"), ("Second registration", "By hand 1")] {
        press_button(&mut window, column);
        window.get_all_by_label(name).last().unwrap().click();
        settle(&mut window);
    }
    for found in [&of_fitted, &of_hand] {
        let d = &found.pairs[0].differences[0];
        let text = format!(
            "{} ± {}",
            bregma_measure::numbers::signed(d.difference_mm, 2),
            bregma_measure::numbers::fixed(d.uncertainty.error_mm, 2)
        );
        assert!(window.query_all_by_label(&text).next().is_some(), "no cell {text}");
    }
    screenshot(&mut window, "register-kept.png");
    assert!(near(pose(&window), as_opened), "comparing moves nothing");

    press_button(&mut window, "Name of As it lay 1");
    window.key_press(Key::End);
    window.event(Event::Text("st".into()));
    window.key_press(Key::Enter);
    settle(&mut window);
    assert_eq!(names(&window)[0], "As it lay 1st");
    press_button(&mut window, "Delete Surfaces 1");
    assert_eq!(names(&window), ["As it lay 1st", "By hand 1"]);
    undo(&mut window);
    assert_eq!(names(&window).len(), 3);
    std::fs::remove_file(file).unwrap();
}

#[test]
fn a_fit_is_made_on_a_ball_around_a_landmark_and_landmarks_may_stretch() {
    // Fails if a part is taken in the scene's world instead of the fixed scan's, or not at all, or the kind of a fit by landmarks is not the one chosen.
    let (mut window, file) = twice("parts", [0.0; 6]);
    press_button(&mut window, "Only a part…");
    window.get_by_role_and_label(Role::SpinButton, "Radius of part 1").set_value_accesskit(70.0);
    window.run_steps(3);
    press_button(&mut window, "Middle of part 1");
    window.get_by_label("bregma of skull").click();
    settle(&mut window);
    screenshot(&mut window, "register-parts.png");
    fit(&mut window);
    press_button(&mut window, "Keep this one");
    let ball = window.state().poses()[0].record["method"]["parts"]["only"][0]["ball"].clone();
    let centre: Vec<f64> = ball["centre_mm"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    assert!(DVec3::from_slice(&centre).distance(DVec3::new(0.0, -15.0, 70.0)) < 1e-6, "{ball}");
    assert_eq!(ball["radius_mm"], 70.0);
    window.get_by_role_and_label(Role::RadioButton, "By landmarks").click();
    window.run_steps(4);
    window.get_by_role_and_label(Role::RadioButton, "Similarity").click();
    window.run_steps(4);
    fit(&mut window);
    press_button(&mut window, "Keep this one");
    let pose = &window.state().poses()[1];
    assert_eq!((pose.name.as_str(), &pose.record["method"]["freedom"]), ("Landmarks 1", &serde_json::json!("similarity")));
    std::fs::remove_file(file).unwrap();
}

#[test]
fn a_scan_is_held_upright_by_its_points_or_by_its_symmetry() {
    // Fails if points that are missing are not named, or the skull does not stand upright, alone, with its landmarks, after it, or undo does not take
    // it back.
    let (mut window, file) = twice("upright", [0.0; 6]);
    let before = pose(&window);
    command(&mut window, "Hold upright");
    window.get_by_label_contains("set orbitale left");
    assert!(window.get_by_label("Hold it so").accesskit_node().is_disabled());
    window.get_by_role_and_label(Role::RadioButton, "By symmetry").click();
    window.run_steps(3);
    window.get_by_label("Find the plane").click();
    wait_for(&mut window, "± of the plane");
    screenshot(&mut window, "hold-upright.png");
    window.get_by_label("Hold it so").click();
    settle(&mut window);
    let held = window.state().scene().layers[0].transform;
    let leftward = held.matrix3 * DVec3::X;
    assert!(leftward.angle_between(DVec3::X).to_degrees() < 1.0, "{leftward}");
    assert_eq!(pose(&window), before, "the other scan stays");
    let nasion = window.state().landmarks()[0].point_mm.unwrap();
    assert!(nasion.distance(held.transform_point3(DVec3::new(0.0, -88.0, -20.0))) < 1e-9);
    undo(&mut window);
    assert_eq!(window.state().scene().layers[0].transform, place());
    std::fs::remove_file(file).unwrap();
}

#[test]
fn the_frankfurt_horizontal_is_taken_from_landmarks_in_the_scene() {
    // Fails if the points are taken in the scan's own world, or those of another scan.
    let sources = vec![Source::built_in(bregma_synthetic::Which::A, 32)];
    let volume = bregma_synthetic::skull(bregma_synthetic::Which::A, 32, &Default::default()).unwrap();
    let mut opened = Opened::new(sources.clone(), vec![std::sync::Arc::new(volume.renamed(&sources[0].name()))]);
    opened.scene.layers[0].transform = place();
    let points = [("po-l", [60.0, 0.0, 0.0]), ("po-r", [-60.0, 0.0, 0.0]), ("or-l", [35.0, -75.0, 0.0]), ("or-r", [-35.0, -75.0, 2.0])];
    for (name, p) in points {
        let point = place().transform_point3(p.into());
        opened.landmarks.push(Landmark { scan: Some(sources[0].name()), ..Landmark::at(name, point) });
    }
    opened.first_look(1.0);
    let file = std::env::temp_dir().join(format!("bregma-window-{}-frankfurt.json", std::process::id()));
    Session::of(&opened, &std::env::temp_dir()).write(&file).unwrap();
    let mut window = open(Start::Files(vec![Source { file: file.clone(), ..Source::default() }]));
    wait(&mut window, "the session", |w| !w.is_loading());
    settle(&mut window);
    command(&mut window, "Hold upright");
    window.get_by_label("2.00 mm above");
    // √1.5 · 1 mm at 75 mm.
    window.get_by_label("0.94°");
    window.get_by_label("Hold it so").click();
    settle(&mut window);
    let held: Vec<DVec3> = window.state().landmarks().iter().map(|l| l.point_mm.unwrap()).collect();
    assert!((held[0] - held[1]).distance(DVec3::X * 120.0) < 1e-9 && (held[2].z - held[0].z).abs() < 1e-9 && held[2].y < held[0].y);
    std::fs::remove_file(file).unwrap();
}
