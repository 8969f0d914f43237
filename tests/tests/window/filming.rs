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
    let eye = |window: &Window| window.state().shown().unwrap().camera.eye_mm;
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
    window.get_by_label("Preview").click();
    // The window's clock goes on by a quarter of a second with each step.
    let mut way = 0.0_f64;
    for _ in 0..12 {
        window.step();
        way = way.max(eye(&window).distance(first));
        assert_eq!(window.state().scene().camera.eye_mm, first, "the work stays as it is");
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

fn small(name: &str) -> Window {
    let mut window = open(Start::Files(vec![bregma_session::Source { file: ball(name, 40), ..Default::default() }]));
    wait(&mut window, "the scan", |w| !w.is_loading());
    settle(&mut window);
    command(&mut window, "Film…");
    window
}

#[test]
fn keys_stand_in_a_strip_and_belong_to_the_work() {
    // Fails if a key cannot be moved, timed or taken away, is no step of its own, or is lost in a session.
    let folder = std::env::temp_dir().join(format!("bregma-strip-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let mut window = small("strip");
    assert!(window.state().film().is_none(), "a panel that is only looked at changes nothing");
    choose(&mut window, Role::RadioButton, "Keys");
    let mut eyes = vec![];
    for key in [Key::Num1, Key::Num4, Key::Num7] {
        window.key_press(key);
        settle(&mut window);
        eyes.push(window.state().scene().camera.eye_mm);
        window.get_by_label("Add what is seen as a key").click();
        window.run_steps(3);
    }
    let seen = |window: &Window| -> Vec<(f64, glam::DVec3)> {
        window.state().film().unwrap().keys.iter().map(|key| (key.at_s, key.camera.unwrap().eye_mm)).collect()
    };
    assert_eq!(seen(&window), [(0.0, eyes[0]), (3.0, eyes[1]), (6.0, eyes[2])]);
    window.get_by_label("Bring key 3 forward").click();
    window.run_steps(3);
    assert_eq!(seen(&window), [(0.0, eyes[0]), (3.0, eyes[2]), (6.0, eyes[1])], "what they show, and not their times");
    window.get_by_label("Put key 1 back").click();
    window.run_steps(3);
    assert_eq!(seen(&window), [(0.0, eyes[2]), (3.0, eyes[0]), (6.0, eyes[1])]);
    window.get_by_label("Take key 2 away").click();
    window.run_steps(3);
    assert_eq!(seen(&window), [(0.0, eyes[2]), (6.0, eyes[1])]);
    assert_eq!(window.state().film().unwrap().seconds, 6.0);
    undo(&mut window);
    undo(&mut window);
    assert_eq!(seen(&window), [(0.0, eyes[0]), (3.0, eyes[2]), (6.0, eyes[1])], "each is a step");
    let film = window.state().film().cloned();
    window.key_press_modifiers(Modifiers::COMMAND, Key::S);
    window.run_steps(3);
    save_to(&mut window, &folder.join("film.json"));
    wait(&mut window, "the session", |_| folder.join("film.json").exists());
    let source = bregma_session::Source { file: folder.join("film.json"), ..Default::default() };
    let mut again = open(Start::Files(vec![source]));
    wait(&mut again, "the session", |w| !w.is_loading());
    assert_eq!(again.state().film(), film.as_ref());
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn what_is_recorded_is_replayed() {
    // Fails if a recorded drag goes another way when it is replayed, takes another time, or cannot be taken back.
    let mut window = small("recorded");
    window.get_by_label("Record").click();
    window.run_steps(1);
    let middle = window.state().picture_rect().unwrap().center() + egui::vec2(0.0, 220.0);
    window.event(Event::PointerMoved(middle));
    press(&window, middle, true, PointerButton::Primary);
    window.run_steps(1);
    let mut way = vec![];
    for n in 1..=12 {
        window.event(Event::PointerMoved(middle + egui::vec2(-14.0, -4.0) * n as f32));
        window.run_steps(1);
        way.push(window.state().scene().camera);
    }
    press(&window, middle + egui::vec2(-168.0, -48.0), false, PointerButton::Primary);
    window.run_steps(2);
    window.get_by_label_contains("Recording, ");
    window.get_by_label("Stop recording").click();
    window.run_steps(2);
    let film = window.state().film().unwrap().clone();
    // A frame of these tests is a quarter of a second; the drag began in the third.
    println!("{} keys of {:.1} s", film.keys.len(), film.seconds);
    assert!((3.0..5.0).contains(&film.seconds) && film.keys.len() < 36);
    let mut opened = bregma_session::Opened::new(vec![], window.state().volumes().to_vec());
    opened.scene = window.state().scene().clone();
    film.check(&opened).unwrap();
    let replayed = |at_s: f64| film.at(&opened, at_s).scene.camera;
    for camera in &way {
        // Wherever it was, the replayed camera comes there: noted at tenths of a second, within half a pixel.
        let off = (0..=400)
            .map(|n| replayed(film.seconds * f64::from(n) / 400.0))
            .map(|c| c.basis().forward.angle_between(camera.basis().forward));
        let off = off.fold(f64::INFINITY, f64::min);
        assert!(off < 0.002, "off by {off} rad");
    }
    assert!(replayed(film.seconds).eye_mm.distance(window.state().scene().camera.eye_mm) < 1e-6);
    assert!(replayed(0.0).eye_mm.distance(opened.scene.camera.eye_mm) > 10.0);
    // It plays so in the view.
    let work = window.state().scene().camera;
    window.get_by_label("Preview").click();
    window.run_steps(2);
    let begun = window.state().shown().unwrap().camera;
    window.run_steps(6);
    let on = window.state().shown().unwrap().camera;
    assert!(begun.eye_mm.distance(on.eye_mm) > 5.0 && window.state().scene().camera == work);
    window.get_by_label("Stop").click();
    window.run_steps(2);
    assert_eq!(window.state().shown().unwrap().camera, work);
    undo(&mut window);
    assert!(window.state().film().is_none());
}
