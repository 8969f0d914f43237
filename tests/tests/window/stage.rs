//! The whole screen, the kiosk, and the frame rate.

use super::hand::demo;
use super::*;
use bregma_renderer::Camera;

/// How many seconds of the window pass in a frame of these tests.
const FRAME_S: f32 = 0.25;

fn camera(window: &Window) -> Camera {
    window.state().scene().camera
}

fn seconds(window: &mut Window, seconds: f32) {
    window.run_steps((seconds / FRAME_S).round() as usize);
}

/// How far the view was turned about the axis that is up, degrees.
fn turned_deg(a: &Camera, b: &Camera) -> f64 {
    let level = |camera: &Camera| (camera.eye_mm - camera.target_mm).reject_from(camera.up);
    level(a).angle_between(level(b)).to_degrees()
}

#[test]
fn a_key_fills_the_window_with_the_picture_and_escape_leads_back() {
    // Fails if anything but the picture keeps room, keys of commands are dead there, or it cannot be left.
    let mut window = demo();
    let before = window.state().picture_rect().unwrap();
    for back in [Key::Escape, Key::F11] {
        window.key_press(Key::F11);
        window.run_steps(3);
        let rect = window.state().picture_rect().unwrap();
        assert_eq!((rect.min, rect.size()), (Pos2::ZERO, egui::vec2(1280.0, 800.0)));
        assert!(window.query_by_label("View").is_none() && window.query_by_label("Landmark").is_none());
        window.key_press(Key::Num1);
        window.run_steps(3);
        assert!(camera(&window).basis().forward.y > 0.999_999);
        settle(&mut window);
        screenshot(&mut window, "full-screen.png");
        window.key_press(back);
        window.run_steps(3);
        assert_eq!(window.state().picture_rect(), Some(before));
        window.get_by_label("View");
    }
}

#[test]
fn a_kiosk_left_alone_turns_by_itself_until_it_is_touched_and_leaves_no_step() {
    // Fails if it turns before its time, at another pace than a turn in 24 s, through a touch, or into what undo takes back; or if the time is forgotten.
    let folder = std::env::temp_dir().join(format!("bregma-kiosk-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let state = folder.clone();
    let builder = Harness::builder().with_size([1280.0, 800.0]).with_step_dt(FRAME_S).wgpu();
    let mut window: Window = builder.build_eframe(|cc| Workstation::new(cc, Start::Demo, Some(state)));
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    settle(&mut window);
    choose(&mut window, Role::RadioButton, "Isosurface");
    let first = camera(&window);
    command(&mut window, "Kiosk");
    window.get_by_role_and_label(Role::SpinButton, "Seconds until it turns").set_value_accesskit(5.0);
    window.run_steps(2);
    window.get_by_label("Begin").click();
    window.run_steps(2);
    assert!(window.query_by_label("View").is_none());
    seconds(&mut window, 4.0);
    assert_eq!(camera(&window), first, "not before its time");
    seconds(&mut window, 3.0);
    let begun = camera(&window);
    assert_ne!(begun, first);
    seconds(&mut window, 6.0);
    let turned = turned_deg(&begun, &camera(&window));
    assert!((turned - 90.0).abs() < 1e-6, "{turned}° in 6 s");
    assert!((camera(&window).eye_mm.z - first.eye_mm.z).abs() < 1e-6, "about the axis that is up");
    // A touch stops it where it is.
    let at = window.state().picture_rect().unwrap().center();
    window.event(Event::PointerMoved(at));
    window.run_steps(1);
    let touched = camera(&window);
    seconds(&mut window, 4.0);
    assert_eq!(camera(&window), touched);
    seconds(&mut window, 3.0);
    assert_ne!(camera(&window), touched, "left alone again");
    // Undo leads to what a person did: the mode.
    assert_eq!(window.state().scene().mode, Mode::Iso);
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    window.run_steps(2);
    assert_eq!((window.state().scene().mode, camera(&window)), (Mode::Overlay, first));
    window.key_press(Key::Escape);
    window.run_steps(2);
    window.get_by_label("View");
    let here = camera(&window);
    seconds(&mut window, 8.0);
    assert_eq!(camera(&window), here, "in the window nothing turns by itself");
    command(&mut window, "Kiosk");
    let kept = std::fs::read_to_string(folder.join("window.json")).unwrap();
    assert!(kept.contains("\"kiosk_after_s\": 5.0"), "{kept}");
    drop(window);
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_kiosk_of_a_session_with_a_film_plays_it_until_it_is_touched() {
    // Fails if a kiosk turns instead of playing its session's film, does not begin it anew, goes on under a hand, or makes a step of it.
    let folder = std::env::temp_dir().join(format!("bregma-kiosk-film-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let source = bregma_session::Source { file: ball("kiosk", 40), ..Default::default() };
    let mut opened = bregma_session::Opened::read(&[source], &Default::default()).unwrap();
    let key =
        |at_s, azimuth, iso| bregma_session::film::Key { at_s, orbit: Some([azimuth, 0.0]), iso: Some(vec![iso]), ..Default::default() };
    let keys = vec![key(0.0, 0.0, 30.0), key(2.0, 90.0, 40.0), key(4.0, 90.0, 50.0)];
    opened.film = Some(bregma_session::film::Film { seconds: 4.0, fps: 10.0, turns: None, keys }.into());
    bregma_session::Session::of(&opened, &folder).write(&folder.join("scenes.json")).unwrap();
    let start = Start::Files(vec![bregma_session::Source { file: folder.join("scenes.json"), ..Default::default() }]);
    let builder = Harness::builder().with_size([1280.0, 800.0]).with_step_dt(FRAME_S).wgpu();
    let mut window: Window = builder.build_eframe(|cc| {
        let mut window = Workstation::new(cc, start, None);
        window.begin_kiosk(&cc.egui_ctx, Some(5.0));
        window
    });
    wait(&mut window, "the session", |w| !w.is_loading());
    let first = camera(&window);
    let shown = |window: &Window| window.state().shown().unwrap().clone();
    let begun = Instant::now();
    while shown(&window).layers[0].iso == 0.0 || shown(&window).camera == first {
        window.step();
        assert!(begun.elapsed() < Duration::from_secs(60), "the film does not begin");
    }
    let mut isovalues = vec![];
    for _ in 0..36 {
        isovalues.push(shown(&window).layers[0].iso);
        window.step();
    }
    let most = isovalues.iter().position(|iso| *iso > 48.0).expect("it comes to its end");
    assert!(isovalues[most..].iter().any(|iso| *iso < 35.0), "and begins anew: {isovalues:?}");
    assert_eq!((camera(&window), window.state().scene().layers[0].iso), (first, opened.scene.layers[0].iso), "the work stays as it is");
    let at = window.state().picture_rect().unwrap().center();
    window.event(Event::PointerMoved(at));
    window.run_steps(1);
    let touched = shown(&window);
    assert_eq!(touched.layers[0].iso, opened.scene.layers[0].iso);
    seconds(&mut window, 4.0);
    assert_eq!(shown(&window).camera, touched.camera, "a hand has it");
    seconds(&mut window, 3.0);
    assert_ne!(shown(&window).layers[0].iso, touched.layers[0].iso, "left alone again");
    window.key_press(Key::Escape);
    window.run_steps(2);
    window.get_by_label("View");
    assert!(window.state().film().is_some() && !window.state().film().unwrap().keys.is_empty());
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn the_frame_rate_is_measured_beside_the_window_told_and_copied() {
    // Fails if the window waits for it, it cannot be cancelled, or a number or the machine is missing from what is copied.
    let mut window = demo();
    command(&mut window, "Frame rate");
    window.get_by_label("Measure one turn").click();
    window.run_steps(2);
    window.get_by_label("Progress");
    // The rest of the window goes on.
    window.key_press(Key::Num3);
    window.run_steps(2);
    assert!(camera(&window).basis().forward.x < -0.999_999);
    window.get_by_label("Cancel").click();
    window.run_steps(2);
    assert!(window.query_by_label("Progress").is_none() && window.query_by_label("Slowest").is_none());
    settle(&mut window);
    let (picture, before) = (window.state().picture().unwrap(), camera(&window));
    let size = format!("{} × {} pixels", picture.width, picture.height);
    window.get_by_label("Measure one turn").click();
    wait_for(&mut window, "Slowest");
    assert_eq!(camera(&window), before, "the picture stays as it is");
    screenshot(&mut window, "frame-rate.png");
    window.get_by_label("Copy as text").click();
    window.step();
    let commands = window.output().platform_output.commands.clone();
    let copied = commands.iter().find_map(|command| match command {
        egui::OutputCommand::CopyText(text) => Some(text.clone()),
        _ => None,
    });
    let copied = copied.expect("a text was copied");
    let rates: Vec<f64> = copied.lines().take(3).map(|line| line.split(['\t', ' ']).find_map(|word| word.parse().ok()).unwrap()).collect();
    assert!(0.0 < rates[0] && rates[0] <= rates[1] && rates[1] <= rates[2], "{copied}");
    // The machine stands in the last line, and is what the status says that draws.
    let machine = copied.lines().nth(4).unwrap().replacen("cpu", "CPU", 1);
    assert!(window.query_all_by_label_contains(&machine).next().is_some(), "{copied}");
    assert!(copied.contains("72 pictures") && copied.contains(&size), "{copied}");
}

#[test]
fn all_of_the_view_menu_is_in_the_smallest_window_and_norms_are_in_a_menu_of_their_own() {
    // Fails if a menu grows out of the window, or what stands in a menu within it cannot be chosen there.
    let mut window: Window = Harness::builder().with_size([720.0, 480.0]).wgpu().build_eframe(|cc| Workstation::new(cc, Start::Demo, None));
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    settle(&mut window);
    window.get_by_label("View").click();
    window.run_steps(4);
    let screen = egui::Rect::from_min_size(Pos2::ZERO, egui::vec2(720.0, 480.0));
    for entry in ["Look from", "Frame rate…", "Full screen", "Kiosk…"] {
        let rect = window.query_all_by_label_contains(entry).next().expect(entry).rect();
        assert!(screen.contains_rect(rect), "{entry} at {rect}");
    }
    screenshot(&mut window, "view-menu.png");
    window.query_all_by_label_contains("Look from").next().unwrap().click();
    window.run_steps(4);
    screenshot(&mut window, "view-menu-norms.png");
    window.query_all_by_label_contains("norma basilaris").next().expect("the norm").click();
    window.run_steps(4);
    assert!(camera(&window).basis().forward.z > 0.999_999);
}
