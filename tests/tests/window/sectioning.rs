//! Thickness along a curve through landmarks.

use super::*;

#[test]
fn a_section_is_measured_drawn_and_charted() {
    // Fails if a section is measured without landmarks, the curve is not drawn, its order is not the list's, a station is not named under
    // the mouse, or it is not kept with what was measured.
    let mut window = open(Start::Demo);
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    settle(&mut window);
    command(&mut window, "Section");
    let measure = |window: &Window| window.get_by_label("Measure the section").accesskit_node().is_disabled();
    assert!(measure(&window), "there are no landmarks");
    // Two landmarks on the vault, one above the other in the middle of the picture.
    let target = on_bone(&window);
    window.key_press(Key::L);
    window.run_steps(2);
    click(&mut window, target);
    click(&mut window, target - egui::vec2(0.0, 60.0));
    settle(&mut window);
    command(&mut window, "Section");
    assert!(!measure(&window) && window.state().landmarks().len() == 2);
    window.get_by_label("L2 earlier").click();
    window.run_steps(2);
    let before = window.render().unwrap().into_raw();
    window.get_by_label("Measure the section").click();
    wait(&mut window, "the section", |w| w.section().is_some());
    settle(&mut window);
    let told = &window.state().section().unwrap().told;
    let (length, names) = (told.length_mm, told.marks.iter().map(|mark| mark.name.clone()).collect::<Vec<_>>());
    assert!(length > 5.0 && told.stations.len() == length as usize + 1 && told.scans.len() == 2, "{length} mm");
    assert_eq!(names, ["L2", "L1"]);
    assert!(told.stations.iter().filter(|s| s.thickness.is_some()).count() > 5);
    window.get_by_label_contains("mm along the curve");
    screenshot(&mut window, "section.png");
    let drawn = window.render().unwrap().into_raw();
    let magenta = |rgba: &[u8]| rgba.chunks(4).filter(|p| p[0] > 200 && p[1] < 110 && p[2] > 170).count();
    assert!(magenta(&before) < 20 && magenta(&drawn) > 60, "{} and {}", magenta(&before), magenta(&drawn));
    // The mouse in the chart names a station, which is marked in the picture.
    let head = window.get_by_label_contains("mm along the curve").rect();
    window.event(Event::PointerMoved(head.center_bottom() + egui::vec2(60.0, 130.0)));
    window.run_steps(4);
    let is_station = |text: String| text.starts_with("at ") && text.ends_with(" mm");
    assert!(window.get_all_by_role(Role::Label).any(|label| label.accesskit_node().value().is_some_and(is_station)));
    let hovered = window.render().unwrap().into_raw();
    let white = |rgba: &[u8]| rgba.chunks(4).filter(|p| p[..3] == [255; 3]).count();
    assert!(white(&hovered) > white(&drawn) + 30, "{} and {}", white(&hovered), white(&drawn));
    // Where the surface is another one the curve is none of it.
    choose(&mut window, Role::CheckBox, "Show the curve");
    assert!(magenta(window.render().unwrap().as_raw()) < 20);
    choose(&mut window, Role::CheckBox, "Show the curve");
    window.get_by_role_and_label(Role::Slider, "Isovalue of skull A").set_value_accesskit(400.0);
    settle(&mut window);
    window.get_by_label_contains("measure again");
    assert!(magenta(window.render().unwrap().as_raw()) < 20);
}
