//! Rays, landmarks and maps of thickness.

use super::*;

#[test]
fn rays_and_landmarks_are_many_named_and_undone() {
    // Fails if a tool does not do what it says, a measurement is lost when another is made, or undo forgets one.
    let mut window = open(Start::Demo);
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    settle(&mut window);
    // On the smooth of the forehead.
    let target = on_bone(&window) - egui::vec2(10.0, 45.0);
    click(&mut window, target);
    let along_view = window.state().difference_ray().unwrap().clone();
    window.get_by_label("Ray along the normal").click();
    window.run_steps(2);
    click(&mut window, target);
    let along_normal = window.state().difference_ray().unwrap().clone();
    let [view, normal] = [&along_view, &along_normal].map(|r| r.volumes[0].segments[0].uncertainty);
    assert!(view.error_mm > 0.0 && normal.error_mm > 0.0);
    let oblique = along_normal.volumes.iter().flat_map(|v| &v.segments).map(|s| s.obliquity_deg[0]).fold(f64::INFINITY, f64::min);
    assert!(oblique < 5.0, "a ray along the normal meets the surface straight, not at {oblique}°");
    window.get_by_label("Ray through two points").click();
    window.run_steps(2);
    let other = target + egui::vec2(12.0, 25.0);
    click(&mut window, target);
    window.get_by_label_contains("second point");
    click(&mut window, other);
    // Three rays: the last is selected and can be renamed; a click on another's name shows its numbers.
    window.get_by_label("Name of Ray 3");
    window.get_by_label("Ray 1").click();
    window.run_steps(2);
    assert_eq!(window.state().difference_ray().unwrap().volumes, along_view.volumes);
    window.get_by_label("Landmark").click();
    window.run_steps(2);
    click(&mut window, target);
    click(&mut window, other);
    window.get_by_label("Name of L1");
    window.get_by_label_contains("mm to L1");
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    window.run_steps(3);
    assert!(window.query_by_label("Name of L2").is_none() && window.query_by_label("Name of L1").is_some());
    window.get_by_label("Rays (3)").click();
    window.run_steps(3);
    window.get_by_label("Bone and density along the ray");
    screenshot(&mut window, "measured.png");
    window.get_by_label("Delete Ray 2").click();
    window.run_steps(3);
    assert!(window.query_by_label("Delete Ray 2").is_none() && window.query_by_label("Delete Ray 1").is_some());
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    window.run_steps(3);
    assert!(window.query_by_label("Delete Ray 2").is_some(), "undo brings the ray back");
}

#[test]
fn a_map_of_thickness_is_measured_painted_and_dropped() {
    // Fails if the map cannot be cancelled, is not painted, stays on a surface that it is not of, or if a patch is not smaller.
    let mut window = open(Start::Demo);
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    settle(&mut window);
    let before = pixels(&window);
    window.get_by_label("Measure").click();
    window.run_steps(2);
    window.get_by_label_contains("Thickness map").click();
    window.run_steps(3);
    window.get_by_label("Measure the thickness").click();
    window.run_steps(2);
    window.get_by_label("Cancel").click();
    window.run_steps(2);
    assert!(window.state().thickness().is_none(), "a cancelled measurement leaves nothing");
    window.get_by_label("Measure the thickness").click();
    wait(&mut window, "the map", |w| w.thickness().is_some());
    settle(&mut window);
    let whole = window.state().thickness().unwrap().clone();
    assert!((1.0..20.0).contains(&whole.mean_mm), "{whole:?}");
    let painted = pixels(&window);
    assert!(changed(&before, &painted) > 20_000);
    let ids = &window.state().picture().unwrap().volume_id;
    assert!(ids.contains(&1) && !ids.contains(&2), "the map is of skull A alone");
    window.get_by_label("Legend of the thickness");
    screenshot(&mut window, "thickness.png");
    // The same values, other colours.
    choose(&mut window, Role::RadioButton, "Cividis");
    assert!(changed(&painted, &pixels(&window)) > 20_000);
    choose(&mut window, Role::CheckBox, "Show on the surface");
    assert_eq!(changed(&before, &pixels(&window)), 0);
    choose(&mut window, Role::CheckBox, "Show on the surface");
    window.get_by_role_and_label(Role::Slider, "Isovalue of skull A").set_value_accesskit(400.0);
    settle(&mut window);
    window.get_by_label_contains("measure again");
    assert!(window.state().picture().unwrap().volume_id.contains(&2), "what is no longer true is not painted");
    undo(&mut window);

    let target = on_bone(&window);
    window.get_by_label("Landmark").click();
    window.run_steps(2);
    click(&mut window, target);
    command(&mut window, "Thickness map");
    window.get_by_role_and_label(Role::RadioButton, "Around a landmark").click();
    window.run_steps(2);
    window.get_by_label("Measure the thickness").click();
    window.run_steps(2);
    wait(&mut window, "the patch", |w| w.thickness().is_some_and(|t| t.area_mm2 != whole.area_mm2));
    settle(&mut window);
    let patch = window.state().thickness().unwrap().area_mm2;
    assert!((500.0..8000.0).contains(&patch), "{patch} mm²");
    screenshot(&mut window, "thickness-patch.png");
}

#[test]
fn a_ray_by_numbers_its_curve_and_a_selection_that_is_no_step() {
    // Fails if the ray is another than the one that was typed, the curve cannot be asked for, or undo stops at a click in the list.
    let file = ball("numbers", 24);
    let mut window = open(Start::Files(vec![bregma_session::Source { file: file.clone(), ..Default::default() }]));
    wait(&mut window, "the scan", |w| !w.is_loading());
    settle(&mut window);
    window.get_by_label("Measure").click();
    window.run_steps(2);
    window.get_by_label_contains("Ray by numbers").click();
    window.run_steps(3);
    let type_point = |window: &mut Window, of: &str, point: [f64; 3]| {
        for (axis, value) in ["x", "y", "z"].into_iter().zip(point) {
            window.get_by_role_and_label(Role::SpinButton, &format!("{axis} of the {of}")).set_value_accesskit(value);
            window.run_steps(1);
        }
    };
    type_point(&mut window, "origin of the ray", [11.5, -20.0, 11.5]);
    type_point(&mut window, "point that the ray goes toward", [11.5, -20.0, 11.5]);
    window.run_steps(2);
    assert!(window.get_by_label("Cast").accesskit_node().is_disabled(), "a ray without direction is none");
    type_point(&mut window, "point that the ray goes toward", [11.5, 0.0, 11.5]);
    window.run_steps(2);
    window.get_by_label("Cast").click();
    window.run_steps(3);
    let ray = window.state().difference_ray().expect("the ray").clone();
    assert_eq!((ray.ray.origin_mm, ray.ray.direction), ([11.5, -20.0, 11.5], [0.0, 1.0, 0.0]));
    let bone = &ray.volumes[0].segments[0];
    assert!((bone.length_mm - 18.4).abs() < 1.0, "{}", bone.length_mm);

    window.get_by_role_and_label(Role::RadioButton, "along").click();
    window.run_steps(2);
    type_point(&mut window, "direction of the ray", [0.0, 1.0, 0.2]);
    window.get_by_label("Cast").click();
    window.run_steps(3);
    assert_ne!(window.state().difference_ray().unwrap().volumes, ray.volumes);
    window.get_by_label("Close").click();
    window.run_steps(2);
    assert!(window.query_by_label("Cast").is_none());

    // A look at another ray is no step: undo takes back the second ray.
    window.get_by_label("Ray 1").click();
    window.run_steps(3);
    assert_eq!(window.state().difference_ray().unwrap().volumes, ray.volumes);
    window.get_by_label("Length against the isovalue").click();
    window.run_steps(3);
    window.get_by_label("Curve of length against isovalue");
    settle(&mut window);
    screenshot(&mut window, "curve.png");
    undo(&mut window);
    assert!(window.query_by_label("Delete Ray 2").is_none() && window.query_by_label("Delete Ray 1").is_some());
    assert_eq!(window.state().difference_ray().unwrap().volumes, ray.volumes);
    std::fs::remove_file(&file).unwrap();
}

#[test]
fn a_cut_or_a_look_moves_no_number() {
    // Fails if a cut empties the table of a ray, a ready-made look moves the isovalue, the colour or the opacity of a scan, or a ray measured as
    // cut is the same as one of the whole bone.
    let mut window = open(Start::Demo);
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    settle(&mut window);
    let target = on_bone(&window) - egui::vec2(0.0, 40.0);
    click(&mut window, target);
    let whole = window.state().difference_ray().unwrap().clone();
    // B − A with its ± stands on top, and says what it lacks.
    let difference = &whole.pairs[0].differences[0];
    let number = bregma_measure::numbers::signed(difference.difference_mm, 2);
    assert!(window.query_all_by_label(&number).next().is_some(), "{number}");
    let error = format!("± {} mm", bregma_measure::numbers::fixed(difference.uncertainty.error_mm, 2));
    assert!(window.query_all_by_label(&error).next().is_some(), "{error}");
    assert!(window.query_all_by_label_contains("without the registration's error").next().is_some());

    window.get_by_label("Cuts").click();
    window.run_steps(8);
    choose(&mut window, Role::Button, "Slice view");
    assert_eq!(window.state().difference_ray().unwrap().volumes, whole.volumes, "a cut is a way of looking");
    let layers = window.state().scene().layers.clone();
    window.get_by_label("Look of skull A").scroll_to_me();
    window.run_steps(4);
    window.get_by_label("Look of skull A").click();
    window.run_steps(4);
    window.get_by_label("dry skull").click();
    settle(&mut window);
    let after = &window.state().scene().layers;
    assert!(after[0].transfer.is_some() && after[0].transfer != layers[0].transfer, "the look is another");
    for (a, b) in after.iter().zip(&layers) {
        assert_eq!((a.iso, a.color, a.opacity), (b.iso, b.color, b.opacity));
    }
    assert_eq!(window.state().difference_ray().unwrap().volumes, whole.volumes);
    assert!(window.state().difference_ray().unwrap().notes.is_empty());

    // Who wants to measure what is left asks for it.
    choose(&mut window, Role::CheckBox, "As cut");
    let cut = window.state().difference_ray().unwrap();
    assert!(cut.as_cut && cut.volumes != whole.volumes);
    choose(&mut window, Role::CheckBox, "As cut");
    assert_eq!(window.state().difference_ray().unwrap().volumes, whole.volumes);

    // Unlike thresholds are said.
    window.get_by_role_and_label(Role::SpinButton, "Isovalue of skull A as a number").set_value_accesskit(400.0);
    settle(&mut window);
    let note = window.state().difference_ray().unwrap().notes.first().cloned().expect("a note");
    assert!(window.query_all_by_label(&note).next().is_some(), "{note}");
}

#[test]
fn landmarks_are_set_by_a_list_dragged_and_left_missing() {
    // Fails if a click sets another than the next of the list, a landmark cannot be corrected by hand, or leaves the surface.
    let mut window = open(Start::Demo);
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    settle(&mut window);
    window.key_press(Key::L);
    window.run_steps(2);
    window.get_by_label("Use a list").click();
    window.run_steps(4);
    window.get_by_label("Craniometric points of skull A").click();
    window.run_steps(4);
    let count = window.state().landmarks().len();
    assert!(count > 20 && window.state().landmarks().iter().all(|l| l.point_mm.is_none() && l.scan.as_deref() == Some("skull A")));
    // B alone is out of the way.
    window.get_by_label("Show skull B").click();
    settle(&mut window);
    let at = on_bone(&window) - egui::vec2(0.0, 40.0);
    for shift in [0.0, 14.0] {
        click(&mut window, at + egui::vec2(shift, 0.0));
    }
    let set: Vec<usize> = (0..count).filter(|n| window.state().landmarks()[*n].point_mm.is_some()).collect();
    assert_eq!((set, window.state().landmarks().len()), (vec![0, 1], count), "in the order of the list");
    window.get_all_by_label("missing").nth(2).unwrap().click();
    window.run_steps(3);
    click(&mut window, at + egui::vec2(-14.0, 0.0));
    assert!(window.state().landmarks()[4].point_mm.is_some() && window.state().landmarks()[2].point_mm.is_none());

    let before = window.state().landmarks()[0].point_mm.unwrap();
    let camera = window.state().scene().camera;
    drag(&mut window, at, at - egui::vec2(0.0, 25.0));
    let after = window.state().landmarks()[0].point_mm.unwrap();
    assert!(after.z > before.z + 2.0 && window.state().scene().camera == camera, "{before} {after}");
    undo(&mut window);
    assert_eq!(window.state().landmarks()[0].point_mm, Some(before), "a drag is one step");
    screenshot(&mut window, "template.png");
}
