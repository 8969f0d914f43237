//! Preferences, and help.

use super::*;

#[test]
fn preferences_are_chosen_and_shape_what_opens_next() {
    // Fails if a choice has no effect: a theme that stays dark, a background or an isovalue that new scans do not open with, or a preference that is
    // gone in the next run.
    let state = std::env::temp_dir().join(format!("bregma-preferring-{}", std::process::id()));
    let of_state = state.clone();
    let build = move |state: std::path::PathBuf| -> Window {
        Harness::builder().with_size([1280.0, 800.0]).wgpu().build_eframe(|cc| Workstation::new(cc, Start::Demo, Some(state)))
    };
    let mut window = build(of_state);
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    command(&mut window, "Preferences…");
    let is_dark = |window: &Window| window.ctx.theme() == egui::Theme::Dark;
    assert!(is_dark(&window));
    window.get_by_role_and_label(Role::RadioButton, "Light").click();
    window.run_steps(3);
    for name in ["µm", "1,5", "Found in the scan"] {
        window.get_by_label(name).click();
        window.run_steps(3);
    }
    window.get_by_label("Smooth edges").click();
    window.run_steps(3);
    assert!(!is_dark(&window));
    settle(&mut window);
    screenshot(&mut window, "light.png");
    drop(window);

    let mut window = build(state.clone());
    wait(&mut window, "the demo pair again", |w| !w.is_loading());
    settle(&mut window);
    assert!(!is_dark(&window), "the theme is forgotten");
    assert!(window.state().scene().layers.iter().all(|layer| layer.iso == 300.0), "new scans open with another isovalue");
    command(&mut window, "Preferences…");
    window.get_by_label("As at first").click();
    window.run_steps(3);
    assert!(is_dark(&window));
    drop(window);
    std::fs::remove_dir_all(state).unwrap();
}

#[test]
fn the_guide_and_all_keys_are_inside_the_program() {
    // Fails if the guide cannot be read without a browser, a link in it leads nowhere, or a command with a key is not on the page of keys.
    let mut window = open(Start::Files(vec![]));
    window.run_steps(3);
    window.key_press(Key::F1);
    window.run_steps(5);
    assert!(window.query_by_label("Measuring").is_some());
    screenshot(&mut window, "help-guide.png");
    window.get_by_label("Keys").click();
    window.run_steps(4);
    for name in ["Undo", "Save session", "Ray along the view", "Search the commands…"] {
        assert!(window.query_all_by_label(name).next().is_some(), "{name} is not on the page of keys");
    }
    screenshot(&mut window, "help-keys.png");
    window.key_press(Key::F1);
    window.run_steps(3);
    assert!(window.query_by_label("Keys").is_none());
}
