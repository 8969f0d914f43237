//! Films made in the window.

use super::printing::save_to;
use super::*;

#[test]
fn a_film_of_keys_is_played_and_saved() {
    // Fails if a key is not what was seen, playing leaves the view elsewhere, what is told is not what is written, or a film cannot be stopped.
    let folder = std::env::temp_dir().join(format!("bregma-filming-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let mut window = open(Start::Files(vec![bregma_session::Source { file: ball("filming", 40), ..Default::default() }]));
    wait(&mut window, "the scan", |w| !w.is_loading());
    settle(&mut window);
    command(&mut window, "Film…");
    window.get_by_label_contains("360 frames, 12 s");
    for (name, value) in [("Width of the film", 48.0), ("Height of the film", 32.0), ("Frames in a second", 10.0)] {
        window.get_by_role_and_label(Role::SpinButton, name).set_value_accesskit(value);
        window.run_steps(2);
    }
    choose(&mut window, Role::RadioButton, "Keys");
    window.get_by_label_contains("a film runs for a time above 0");
    let eye = |window: &Window| window.state().scene().camera.eye_mm;
    window.get_by_label("Add what is seen as a key").click();
    window.run_steps(2);
    let first = eye(&window);
    window.key_press(Key::Num4);
    settle(&mut window);
    let second = eye(&window);
    window.get_by_label("Add what is seen as a key").click();
    window.run_steps(2);
    window.get_by_role_and_label(Role::SpinButton, "Time of key 2").set_value_accesskit(1.0);
    window.run_steps(2);
    window.get_by_label_contains("10 frames, 1 s");
    window.get_by_label("Look at key 1").click();
    window.run_steps(2);
    assert!(first.distance(second) > 1.0 && eye(&window).distance(first) < 1e-9);
    window.get_by_label("Play").click();
    // The window's clock goes on by a quarter of a second with each step.
    let mut way = 0.0_f64;
    for _ in 0..12 {
        window.step();
        way = way.max(eye(&window).distance(first));
    }
    assert!(way > 1.0, "the camera goes its way");
    assert!(eye(&window).distance(first) < 1e-9, "and back");
    screenshot(&mut window, "film.png");
    let file = folder.join("a.mp4");
    window.get_by_label("Save film…").click();
    window.run_steps(2);
    save_to(&mut window, &file);
    wait(&mut window, "the film", |_| file.exists());
    window.run_steps(5);
    assert!(std::fs::read(&file).unwrap().windows(4).any(|four| four == b"avcC") && !folder.join("a.mp4.frames").exists());
    choose(&mut window, Role::RadioButton, "Turntable");
    window.get_by_label("Save film…").click();
    window.run_steps(2);
    save_to(&mut window, &folder.join("b.mp4"));
    window.get_by_label("Cancel").click();
    window.run_steps(3);
    window.get_by_label("Save film…");
    assert!(!folder.join("b.mp4").exists(), "a cancelled film is none");
    std::fs::remove_dir_all(folder).unwrap();
}
