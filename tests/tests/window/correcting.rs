//! What is wrong about a scan, put right in its panel: spacing, how it lies, its name and its place.

use super::*;

/// Two balls of 1 mm samples, and the window that they are open in.
fn balls(name: &str) -> (Window, [std::path::PathBuf; 2]) {
    let files = ["a", "b"].map(|letter| ball(&format!("{name}-{letter}"), 24));
    let sources = files.iter().map(|file| bregma_session::Source { file: file.clone(), ..Default::default() }).collect();
    let mut window = open(Start::Files(sources));
    wait(&mut window, "the scans", |w| !w.is_loading());
    settle(&mut window);
    (window, files)
}

fn panel_of(window: &mut Window, n: usize) {
    let name = window.state().volumes()[n].name().to_owned();
    window.get_by_label(&format!("More of {name}")).click();
    window.run_steps(4);
    window.get_by_label("Name, spacing, turn…").click();
    window.run_steps(4);
}

fn press_button(window: &mut Window, label: &str) {
    window.get_by_label(label).scroll_to_me();
    window.run_steps(4);
    window.get_by_label(label).click();
    settle(window);
}

#[test]
fn a_wrong_spacing_is_corrected_and_told_with_every_length() {
    // Fails if a spacing cannot be put right where the file states a wrong one, if lengths do not follow or do not say so, or if undo, or the
    // file's own word, does not bring it back.
    let (mut window, files) = balls("spacing");
    let middle = window.state().picture_rect().unwrap().center();
    click(&mut window, middle);
    settle(&mut window);
    let length = |window: &Window| window.state().difference_ray().unwrap().volumes[1].segments[0].length_mm;
    let stated = length(&window);
    panel_of(&mut window, 1);
    assert!(window.get_by_label("Correct the spacing").accesskit_node().is_disabled(), "nothing is to be corrected yet");
    for axis in ["i", "j", "k"] {
        window.get_by_role_and_label(Role::SpinButton, &format!("Spacing along {axis}")).set_value_accesskit(1.5);
        window.run_steps(2);
    }
    press_button(&mut window, "Correct the spacing");
    let volumes = window.state().volumes();
    assert!(
        (volumes[1].grid().spacing_mm() - glam::DVec3::splat(1.5)).length() < 1e-12 && volumes[0].grid().spacing_mm() == glam::DVec3::ONE
    );
    let ray = window.state().difference_ray().unwrap();
    assert_eq!(ray.volumes[1].stated_spacing_mm, Some([1.0; 3]));
    assert!(ray.notes.iter().any(|note| note.contains("1 × 1 × 1 mm apart; 1.5 × 1.5 × 1.5 mm is taken")), "{:?}", ray.notes);
    assert!((length(&window) - stated).abs() > 1.0, "{} against {stated}", length(&window));
    screenshot(&mut window, "scan-panel.png");
    press_button(&mut window, "As the file states");
    assert_eq!(length(&window), stated);
    undo(&mut window);
    assert_eq!(window.state().volumes()[1].grid().spacing_mm().x, 1.5);
    undo(&mut window);
    assert_eq!((length(&window), window.state().volumes()[1].placing().notes().len()), (stated, 0));
    files.iter().for_each(|file| std::fs::remove_file(file).unwrap());
}

#[test]
fn a_scan_is_turned_at_once_and_mirrored_only_when_meant_twice() {
    // Fails if a turn does not turn, leaves the scan's landmarks behind or cannot be undone; or if one slip makes a mirror image.
    let (mut window, files) = balls("turn");
    let middle = window.state().picture_rect().unwrap().center();
    window.key_press(Key::L);
    window.run_steps(2);
    click(&mut window, middle);
    let landmark = |window: &Window| window.state().landmarks()[0].clone();
    let n = usize::from(landmark(&window).scan.as_deref() == Some(window.state().volumes()[1].name()));
    let (turn, place) =
        (|window: &Window| window.state().volumes()[n].placing().correction().turn.to_string(), landmark(&window).point_mm.unwrap());
    panel_of(&mut window, n);
    press_button(&mut window, "180° about up–down");
    assert_eq!(turn(&window), "RAS");
    let centre = glam::DVec3::splat(11.5);
    let turned = centre + (place - centre) * glam::DVec3::new(-1.0, -1.0, 1.0);
    assert!((landmark(&window).point_mm.unwrap() - turned).length() < 1e-9, "the landmark stays behind");
    press_button(&mut window, "Nod forward");
    assert_eq!(turn(&window), "RIA");
    undo(&mut window);
    undo(&mut window);
    assert_eq!((turn(&window).as_str(), landmark(&window).point_mm), ("LPS", Some(place)));

    for answers in [&["Leave it"][..], &["Mirror it all the same", "Leave it"], &["Mirror it all the same", "It is: mirror it"]] {
        assert_eq!(turn(&window), "LPS");
        press_button(&mut window, "Mirror…");
        for answer in answers {
            assert_eq!(turn(&window), "LPS", "before {answer}");
            press_button(&mut window, answer);
        }
    }
    assert_eq!(turn(&window), "RPS,mirror");
    assert!(window.query_by_label_contains("it is a mirror image of what its file states").is_some());
    screenshot(&mut window, "scan-mirrored.png");
    press_button(&mut window, "As the file lies");
    assert_eq!(turn(&window), "LPS");
    files.iter().for_each(|file| std::fs::remove_file(file).unwrap());
}

#[test]
fn scans_are_named_and_put_in_order() {
    // Fails if a name or the order does not reach what is measured, or cannot be undone, or if a scan's landmarks lose it.
    let (mut window, files) = balls("order");
    let middle = window.state().picture_rect().unwrap().center();
    window.key_press(Key::L);
    window.run_steps(2);
    click(&mut window, middle);
    let n = usize::from(window.state().landmarks()[0].scan.as_deref() == Some(window.state().volumes()[1].name()));
    let colors = [0, 1].map(|n| window.state().scene().layers[n].color);
    panel_of(&mut window, n);
    let field = |window: &mut Window| {
        window.get_by_label("Name of the scan").focus();
        window.run_steps(2);
    };
    field(&mut window);
    window.key_press_modifiers(Modifiers::COMMAND, Key::A);
    window.event(Event::Text("before".into()));
    window.run_steps(2);
    window.key_press(Key::Enter);
    settle(&mut window);
    assert_eq!(window.state().volumes()[n].name(), "before");
    assert_eq!(window.state().landmarks()[0].scan.as_deref(), Some("before"));
    press_button(&mut window, if n == 0 { "Later" } else { "Earlier" });
    assert_eq!(window.state().volumes()[1 - n].name(), "before");
    assert_eq!([1, 0].map(|n| window.state().scene().layers[n].color), colors, "a scan is known by its colour");
    window.key_press(Key::R);
    window.run_steps(2);
    click(&mut window, middle);
    settle(&mut window);
    let pair = &window.state().difference_ray().unwrap().pairs[0];
    assert_eq!(if n == 0 { &pair.b } else { &pair.a }, "before");
    // The ray, the order and the name, one after the other.
    for _ in 0..3 {
        undo(&mut window);
    }
    let first = files[n].file_name().unwrap().to_string_lossy().into_owned();
    assert_eq!((window.state().volumes()[n].name(), window.state().landmarks()[0].scan.as_ref()), (first.as_str(), Some(&first)));
    files.iter().for_each(|file| std::fs::remove_file(file).unwrap());
}

#[test]
fn scans_are_dragged_into_order() {
    // Fails if a scan does not go where it is dropped, up or down, passes another without taking its colour along, goes to where nothing is, or if
    // that is more than one step.
    let files = ["first", "second", "third"].map(|name| ball(name, 16));
    let names = files.each_ref().map(|file| file.file_name().unwrap().to_string_lossy().into_owned());
    let sources = files.iter().map(|file| bregma_session::Source { file: file.clone(), ..Default::default() });
    let mut window = open(Start::Files(sources.collect()));
    wait(&mut window, "the scans", |w| !w.is_loading());
    settle(&mut window);
    let order = |window: &Window| -> Vec<(usize, _)> {
        let of = |name: &str| names.iter().position(|n| n == name).unwrap();
        let layers = window.state().scene().layers.iter().map(|layer| layer.color);
        window.state().volumes().iter().map(|v| of(v.name())).zip(layers).collect()
    };
    let before = order(&window);
    let title = |window: &Window, n: usize| window.get_all_by_role_and_label(Role::Label, &names[n]).next().unwrap().rect().center();
    let expect = |n: [usize; 3]| n.map(|n| before[n]).to_vec();
    // Down, to above the third; then the third to the top.
    let (from, to) = (title(&window, 0), title(&window, 2));
    drag(&mut window, from, to);
    assert_eq!(order(&window), expect([1, 0, 2]));
    let (from, to) = (title(&window, 2), title(&window, 1));
    drag(&mut window, from, to);
    assert_eq!(order(&window), expect([2, 1, 0]));
    undo(&mut window);
    assert_eq!(order(&window), expect([1, 0, 2]));
    undo(&mut window);
    assert_eq!(order(&window), before);
    // Onto itself, and onto the picture.
    let (from, picture) = (title(&window, 1), window.state().picture_rect().unwrap().center());
    drag(&mut window, from, from + egui::vec2(30.0, 4.0));
    drag(&mut window, from, picture);
    assert_eq!(order(&window), before);
    files.iter().for_each(|file| std::fs::remove_file(file).unwrap());
}

#[test]
fn a_copy_is_saved_as_the_scan_lies_now_and_opens_as_that() {
    // Fails if a correction is lost in the copy, a store cannot be saved from the window, or a name of no form is not refused.
    let (mut window, _) = balls("copied");
    panel_of(&mut window, 0);
    window.get_by_role_and_label(Role::SpinButton, "Spacing along k").set_value_accesskit(1.25);
    window.run_steps(2);
    press_button(&mut window, "Correct the spacing");
    let folder = std::env::temp_dir().join(format!("bregma-copied-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    press_button(&mut window, "Save a copy…");
    printing::save_to(&mut window, &folder.join("copy.xyz"));
    settle(&mut window);
    assert!(window.query_by_label_contains(".zarr, ").is_some(), "no form is offered");
    press_button(&mut window, "Save a copy…");
    let store = folder.join("copy.ome.zarr");
    printing::save_to(&mut window, &store);
    wait(&mut window, "the copy", |_| store.exists());
    let copy = bregma_field::formats::open(&store, &Default::default(), &Default::default()).unwrap();
    let scan = &window.state().volumes()[0];
    assert_eq!((copy.content(), copy.grid().spacing_mm().z), (scan.content(), 1.25));
    std::fs::remove_dir_all(folder).unwrap();
}
