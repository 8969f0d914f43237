//! Studio light in the view.

use super::printing::save_to;
use super::*;
use bregma_renderer::studio::{Ground, Preset};
use bregma_session::studio::ready_made;
use std::path::{Path, PathBuf};
use std::process::Command;

fn small(name: &str) -> Window {
    let source = bregma_session::Source { file: ball(name, 40), ..Default::default() };
    let builder = Harness::builder().with_size([720.0, 480.0]).wgpu();
    let mut window: Window = builder.build_eframe(|cc| Workstation::new(cc, Start::Files(vec![source]), None).preferring(at_once()));
    wait(&mut window, "the scan", |w| !w.is_loading());
    settle(&mut window);
    window
}

fn choose_light(window: &mut Window, name: &str) {
    if window.query_by_label("Save…").is_none() {
        window.key_press_modifiers(Modifiers::COMMAND, Key::P);
        window.run_steps(3);
    }
    window.get_by_role_and_label(Role::RadioButton, name).click();
    window.run_steps(2);
}

fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("bregma-lighting-{}-{name}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// The pixels that the command line draws of a session.
fn by_command(folder: &Path, line: &str) -> Vec<[u8; 3]> {
    // Tests lie in target/PROFILE/deps, the program two levels up.
    let program = std::env::current_exe().unwrap().parent().unwrap().parent().unwrap().join("bregma");
    let drawn = Command::new(program).args(line.split(' ')).current_dir(folder).output().unwrap();
    assert!(drawn.status.success(), "{}", String::from_utf8_lossy(&drawn.stderr));
    let mut reader = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(folder.join("lit.png")).unwrap())).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut bytes).unwrap();
    bytes.as_chunks().0.to_vec()
}

#[test]
fn a_view_at_rest_comes_into_the_light_that_the_command_line_draws() {
    // Fails if the view's light is another than the command line's by a byte, is not in the session, or the window waits for it.
    let folder = folder("same");
    let mut window = small("lit");
    let ordinary = pixels(&window);
    choose_light(&mut window, "Journal");
    assert_eq!(window.state().scene().studio, Some(ready_made(Preset::Journal)));
    wait(&mut window, "the first light", |w| w.exposed().is_some());
    let first = window.state().exposed().unwrap();
    assert!(first.0 <= 16, "{first:?}");
    assert!(changed(&ordinary, &pixels(&window)) > 1000);
    wait(&mut window, "all light", Workstation::is_exposed);
    window.run_steps(2);
    let (samples, noise) = window.state().exposed().unwrap();
    println!("{samples} samples, noise {noise:.2} of 255, after {} at first", first.0);
    assert!(samples > 16 && noise <= 1.0);
    window.get_by_label_contains(&format!("studio light: {samples} samples, noise {noise:.1} of 255"));
    screenshot(&mut window, "studio-small.png");
    window.key_press_modifiers(Modifiers::COMMAND, Key::S);
    window.run_steps(3);
    save_to(&mut window, &folder.join("lit.json"));
    wait(&mut window, "the session", |_| folder.join("lit.json").exists());
    let picture = window.state().picture().unwrap();
    let size = format!("{}x{}", picture.width, picture.height);
    let drawn = by_command(&folder, &format!("render lit.json --studio journal --noise 1 --size {size} --out lit.png"));
    let shown: Vec<[u8; 3]> = picture.rgba.iter().map(|[r, g, b, _]| [*r, *g, *b]).collect();
    assert!(shown == drawn, "{} pixels differ", shown.iter().zip(&drawn).filter(|(a, b)| a != b).count());
    // What lies under the pixels is the scan, as before.
    assert!(picture.depth_mm.iter().any(|depth| depth.is_finite()));
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_change_stops_the_light_and_shows_the_ordinary_picture() {
    // Fails if light of a view that was left comes over the next one, or comes while something moves.
    let mut window = small("left");
    choose_light(&mut window, "Journal");
    for key in [Key::Num4, Key::Num3, Key::Num4, Key::Num1] {
        wait(&mut window, "light", |w| w.exposed().is_some());
        let before = pixels(&window);
        window.key_press(key);
        wait(&mut window, "another picture", |w| w.picture().is_some_and(|picture| picture.rgba != before));
        assert!(window.state().exposed().is_none(), "the ordinary picture comes first");
    }
    choose_light(&mut window, "No studio");
    settle(&mut window);
    window.run_steps(8);
    assert!(window.state().exposed().is_none());
}

#[test]
#[ignore = "timed, for a machine that does nothing else: cargo test --release -p bregma-tests --test window lighting -- --ignored --nocapture"]
fn a_change_in_the_midst_of_light_is_shown_within_a_frame_of_what_it_takes_else() {
    // Fails if the light keeps a moved view waiting.
    let mut window = small("timed");
    let mut medians = [0.0, 0.0];
    for (median, light) in medians.iter_mut().zip(["No studio", "Journal"]) {
        choose_light(&mut window, light);
        let mut times = vec![];
        // An even number: the next light begins with another view than this one ends with.
        for n in 0..20 {
            settle(&mut window);
            if light == "Journal" {
                wait(&mut window, "light", |w| w.exposed().is_some());
            }
            let before = pixels(&window);
            window.key_press([Key::Num4, Key::Num3][n % 2]);
            let begun = Instant::now();
            while window.state().picture().unwrap().rgba == before || window.state().exposed().is_some() {
                window.step();
                std::thread::sleep(Duration::from_millis(1));
            }
            times.push(begun.elapsed().as_secs_f64() * 1e3);
        }
        times.sort_by(f64::total_cmp);
        *median = times[times.len() / 2];
        println!("{light}: a moved view is shown after {median:.1} ms, at most {:.1} ms", times[times.len() - 1]);
    }
    assert!(medians[1] <= medians[0] + 1000.0 / 60.0, "{medians:?}");
}

#[test]
fn lights_are_chosen_changed_and_taken_back() {
    // Fails if a light, its key lamp, ground, gloss or smoothing is no step of its own, or what cannot be lit does not say so.
    let mut window = small("chosen");
    choose_light(&mut window, "Museum");
    let museum = ready_made(Preset::Museum);
    assert_eq!(window.state().scene().studio, Some(museum.clone()));
    window.run_steps(3);
    let at = window.get_by_role_and_label(Role::Slider, "Direction of the key light").rect().center();
    drag(&mut window, at, at + egui::vec2(24.0, 0.0));
    let key = window.state().scene().studio.as_ref().unwrap().lamps[0];
    assert!(key.azimuth_deg > 30.0 && key.azimuth_deg < 70.0 && key.elevation_deg.abs() < 5.0, "{key:?}");
    undo(&mut window);
    assert_eq!(window.state().scene().studio, Some(museum), "a drag is one step");
    window.get_by_role_and_label(Role::RadioButton, "Shadow").click();
    window.run_steps(2);
    window.get_by_role_and_label(Role::Slider, "Gloss").set_value_accesskit(0.5);
    window.run_steps(2);
    window.get_by_role_and_label(Role::SpinButton, "Smoothing of the samples").set_value_accesskit(0.0);
    window.run_steps(2);
    let studio = window.state().scene().studio.clone().unwrap();
    assert_eq!((studio.ground, studio.gloss, studio.smooth_voxel), (Ground::Catcher, 0.5, 0.0));
    for _ in 0..4 {
        undo(&mut window);
    }
    assert_eq!(window.state().scene().studio, None);
    choose_light(&mut window, "Relief");
    close_drawers(&mut window);
    open_side(&mut window, "Scans");
    window.get_by_role_and_label(Role::RadioButton, "X-ray").click_accesskit();
    window.run_steps(3);
    window.get_by_label_contains("studio light is for opaque surfaces: choose Isosurface or Overlay");
}

#[test]
fn the_sheet_of_studio_light() {
    // Fails if the panel cannot be reached in a small or a light window. Its pictures are to be looked at in tests/out.
    for (size, theme) in [([1280.0, 800.0], "dark"), ([720.0, 480.0], "light")] {
        let mut preferences = at_once();
        if theme == "light" {
            preferences.theme = bregma::window::ThemeChoice::Light;
        }
        let builder = Harness::builder().with_size(size).wgpu();
        let mut window: Window = builder.build_eframe(|cc| Workstation::new(cc, Start::Demo, None).preferring(preferences));
        wait(&mut window, "the demo pair", |w| !w.is_loading());
        settle(&mut window);
        choose_light(&mut window, "Museum");
        wait(&mut window, "light", |w| w.exposed().is_some_and(|(samples, _)| samples >= 4));
        window.run_steps(3);
        screenshot(&mut window, &format!("studio-{theme}-{}.png", size[0]));
        window.key_press_modifiers(Modifiers::COMMAND, Key::P);
        command(&mut window, "Film…");
        window.get_by_role_and_label(Role::RadioButton, "Keys").click();
        window.run_steps(2);
        for key in [Key::Num1, Key::Num4, Key::Num3] {
            window.key_press(key);
            window.run_steps(2);
            window.get_by_label("Add what is seen as a key").click();
            window.run_steps(3);
        }
        wait(&mut window, "light", |w| w.exposed().is_some());
        window.run_steps(3);
        screenshot(&mut window, &format!("strip-{theme}-{}.png", size[0]));
    }
}
