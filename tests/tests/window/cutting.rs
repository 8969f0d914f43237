//! Cuts, by numbers and by hand.

use super::*;

/// Normal and offset of a cut.
fn plane(window: &Window, n: usize) -> (glam::DVec3, f64) {
    match window.state().scene().clips[n].shape {
        bregma_renderer::Shape::Plane { normal, offset_mm } => (normal, offset_mm),
        ref other => panic!("no plane: {other:?}"),
    }
}

#[test]
fn cuts_are_added_moved_by_numbers_and_by_hand_and_undone() {
    // Fails if a cut does not cut, cuts what it should not, does not follow the mouse, cannot be undone as one step, or if what it cut away
    // can still be clicked on.
    let mut window = open(Start::Demo);
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    settle(&mut window);
    choose(&mut window, Role::RadioButton, "Isosurface");
    let whole = pixels(&window);
    let forehead = on_bone(&window) - egui::vec2(0.0, 60.0);
    window.get_by_label("Cuts").click();
    window.run_steps(8);
    assert!(window.get_by_label("Through three landmarks").accesskit_node().is_disabled());
    choose(&mut window, Role::Button, "Axial");
    let cut = pixels(&window);
    let ids = |window: &Window| window.state().picture().unwrap().volume_id.clone();
    assert!(changed(&whole, &cut) > 10_000, "the calvaria is gone");
    click(&mut window, forehead);
    assert!(window.state().difference_ray().is_none(), "what is cut away is not measured");
    let (normal, middle) = plane(&window, 0);
    assert_eq!(normal, glam::DVec3::Z);

    // By numbers, of one scan alone, from the other side.
    window.get_by_role_and_label(Role::Slider, "Offset of cut 1").set_value_accesskit(middle + 30.0);
    settle(&mut window);
    assert!((plane(&window, 0).1 - middle - 30.0).abs() < 1.0);
    undo(&mut window);
    assert_eq!(plane(&window, 0).1, middle);
    choose(&mut window, Role::CheckBox, "Cut 1 cuts skull B");
    assert_eq!(window.state().scene().clips[0].layers, Some(vec![0]));
    assert!(ids(&window).contains(&2) && changed(&cut, &pixels(&window)) > 10_000, "B is whole again");
    choose(&mut window, Role::CheckBox, "Cut 1 cuts skull B");
    assert_eq!(window.state().scene().clips[0].layers, None);
    choose(&mut window, Role::Button, "Flip cut 1");
    assert_eq!(plane(&window, 0), (-normal, -middle));
    undo(&mut window);
    choose(&mut window, Role::CheckBox, "Cut 1 cuts");
    assert_eq!(changed(&whole, &pixels(&window)), 0, "a cut that is off cuts nothing");
    undo(&mut window);

    // By hand: the arrow points up in the picture, so the plane rises with the mouse.
    let arrow = rect_of(&window, "Arrow of cut 1").center();
    let camera = window.state().scene().camera;
    drag(&mut window, arrow, arrow - egui::vec2(0.0, 40.0));
    let risen = plane(&window, 0).1 - middle;
    let mm_per_point = 2.0 * 15_f64.to_radians().tan() * camera.eye_mm.distance(camera.target_mm)
        / f64::from(window.state().picture_rect().unwrap().height());
    assert!((risen - 40.0 * mm_per_point).abs() < 0.2 * risen, "{risen} mm for {} points", 40.0);
    assert_eq!(window.state().scene().camera, camera, "the view stays");
    undo(&mut window);
    assert_eq!(plane(&window, 0), (normal, middle));
    let arrow = rect_of(&window, "Arrow of cut 1").center();
    drag_with(&mut window, arrow, arrow + egui::vec2(0.0, 70.0), Modifiers::SHIFT);
    let (turned, _) = plane(&window, 0);
    assert!(turned.z < 0.99 && turned.y < -0.1 && (turned.length() - 1.0).abs() < 1e-12, "toward the viewer: {turned}");
    settle(&mut window);
    screenshot(&mut window, "cut-turned.png");

    // What the cut shows.
    let bone = pixels(&window);
    choose(&mut window, Role::RadioButton, "Density");
    assert!(changed(&bone, &pixels(&window)) > 1000, "the face shows grey values");
    choose(&mut window, Role::CheckBox, "Automatic contrast");
    assert_eq!(window.state().scene().window, Some(bregma_renderer::Window { width: 1000.0, level: 400.0 }));
    for label in ["Blend", "Difference"] {
        let before = pixels(&window);
        choose(&mut window, Role::RadioButton, label);
        assert!(changed(&before, &pixels(&window)) > 1000, "{label}");
    }
    choose(&mut window, Role::Button, "Remove cut 1");
    assert!(window.state().scene().clips.is_empty());
    for (label, count) in [("Box", 1), ("Cylinder", 2)] {
        choose(&mut window, Role::Button, label);
        assert_eq!(window.state().scene().clips.len(), count);
    }
    let spin = |window: &mut Window, label: &str, value: f64| {
        window.get_by_role_and_label(Role::SpinButton, label).set_value_accesskit(value);
        settle(window);
    };
    let before = pixels(&window);
    spin(&mut window, "Radius of cut 2", 40.0);
    assert!(changed(&before, &pixels(&window)) > 1000, "a narrow cylinder leaves less");
    spin(&mut window, "x of the low corner of cut 1", 0.0);
    match window.state().scene().clips[0].shape {
        bregma_renderer::Shape::Box { low_mm, .. } => assert_eq!(low_mm.x, 0.0),
        ref other => panic!("no box: {other:?}"),
    }
    screenshot(&mut window, "cuts.png");
}

#[test]
fn a_plane_through_three_landmarks_and_the_slice_view() {
    // Fails if the plane misses a landmark, or the slice view does not show the density of a cut with the volume behind it.
    let mut window = open(Start::Demo);
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    settle(&mut window);
    let target = on_bone(&window);
    window.get_by_label("Landmark").click();
    window.run_steps(2);
    for shift in [egui::vec2(0.0, 0.0), egui::vec2(-30.0, -40.0), egui::vec2(25.0, -70.0)] {
        click(&mut window, target + shift);
    }
    window.get_by_label("Cuts").click();
    window.run_steps(8);
    choose(&mut window, Role::Button, "Through three landmarks");
    let (normal, offset_mm) = plane(&window, 0);
    for landmark in window.state().landmarks() {
        assert!((normal.dot(landmark.point_mm.unwrap()) - offset_mm).abs() < 1e-9);
    }
    choose(&mut window, Role::Button, "Remove cut 1");
    choose(&mut window, Role::Button, "Slice view");
    let scene = window.state().scene().clone();
    assert_eq!((scene.mode, scene.cut_face), (Mode::Dvr, bregma_renderer::CutFace::Density));
    assert_eq!(plane(&window, 0).0, glam::DVec3::Z);
    screenshot(&mut window, "slice-view.png");
    let slice = pixels(&window);
    choose(&mut window, Role::CheckBox, "Cut 1 cuts");
    assert!(changed(&slice, &pixels(&window)) > 10_000);
}
