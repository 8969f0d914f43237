//! The workstation's window, used as a person uses it: open, move a slider, click on bone, switch modes, undo.
//!
//! Run with egui_kittest rather than in a window of the desktop: it is the same application code, widgets are found by the
//! names that a screen reader speaks, input arrives in a fixed order, and pixels come from the real wgpu renderer on whatever
//! driver there is, software included. That the program starts under a display is tested where the commands are.
#![allow(clippy::unwrap_used, reason = "what a test cannot find, it fails on")]

use bregma::window::{Start, Workstation};
use bregma_renderer::Mode;
use egui::accesskit::Role;
use egui::{Event, Key, Modifiers, PointerButton, Pos2};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use std::time::{Duration, Instant};

type Window = Harness<'static, Workstation>;

fn open(start: Start) -> Window {
    Harness::builder().with_size([1280.0, 800.0]).wgpu().build_eframe(|cc| Workstation::new(cc, start))
}

/// Shows frames until `done`; threads load and draw meanwhile.
fn wait(window: &mut Window, what: &str, done: impl Fn(&Workstation) -> bool) {
    let begun = Instant::now();
    loop {
        window.step();
        if done(window.state()) {
            return;
        }
        assert!(begun.elapsed() < Duration::from_secs(120), "waited in vain for {what}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

fn settle(window: &mut Window) {
    // Two steps, so that the first has taken what was queued before anyone asks whether the picture is up to date.
    window.run_steps(2);
    wait(window, "the exact picture", Workstation::is_settled);
}

fn pixels(window: &Window) -> Vec<[u8; 4]> {
    window.state().picture().unwrap().rgba.clone()
}

fn changed(a: &[[u8; 4]], b: &[[u8; 4]]) -> usize {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).filter(|(a, b)| a != b).count()
}

/// A point of the window that shows bone of both volumes' frontal bone: the pixel nearest to the picture's centre, above it.
fn on_bone(window: &Window) -> Pos2 {
    let (picture, rect) = (window.state().picture().unwrap(), window.state().picture_rect().unwrap());
    let (w, h) = (picture.width as usize, picture.height as usize);
    let found = (0..h * 2 / 5).rev().map(|y| y * w + w / 2).find(|&at| picture.volume_id[at] != 0).expect("bone above the centre");
    rect.min + egui::vec2((found % w) as f32 + 0.5, (found / w) as f32 + 0.5)
}

fn press(window: &Window, at: Pos2, pressed: bool, button: PointerButton) {
    window.event(Event::PointerButton { pos: at, button, pressed, modifiers: Modifiers::NONE });
}

fn click(window: &mut Window, at: Pos2) {
    window.event(Event::PointerMoved(at));
    press(window, at, true, PointerButton::Primary);
    press(window, at, false, PointerButton::Primary);
    window.run_steps(2);
}

fn drag(window: &mut Window, from: Pos2, to: Pos2) {
    window.event(Event::PointerMoved(from));
    press(window, from, true, PointerButton::Primary);
    for n in 1..=4 {
        window.event(Event::PointerMoved(from.lerp(to, n as f32 / 4.0)));
    }
    press(window, to, false, PointerButton::Primary);
    window.run_steps(2);
}

fn screenshot(window: &mut Window, name: &str) {
    let shot = window.render().expect("the window is drawn by wgpu");
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("out");
    std::fs::create_dir_all(&folder).unwrap();
    let file = std::io::BufWriter::new(std::fs::File::create(folder.join(name)).unwrap());
    let mut encoder = png::Encoder::new(file, shot.width(), shot.height());
    encoder.set_color(png::ColorType::Rgba);
    encoder.write_header().unwrap().write_image_data(shot.as_raw()).unwrap();
}

#[test]
fn the_demo_pair_is_opened_changed_and_measured() {
    let mut window = open(Start::Demo);
    window.step();
    window.get_by_label("Cancel");
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    settle(&mut window);
    window.get_by_label("Isosurface").click();
    settle(&mut window);
    let first = pixels(&window);
    let bone = window.state().picture().unwrap().volume_id.iter().filter(|&&id| id != 0).count();
    assert!(bone > first.len() / 10, "the picture shows the skulls: {bone} of {} pixels", first.len());

    // The isovalue, through the slider's accessible name.
    assert_eq!(window.state().scene().layers[0].iso, 226.0);
    window.get_by_role_and_label(Role::Slider, "Isovalue of skull A").set_value_accesskit(700.0);
    settle(&mut window);
    assert!((window.state().scene().layers[0].iso - 700.0).abs() < 5.0, "{}", window.state().scene().layers[0].iso);
    assert!(changed(&first, &pixels(&window)) > 1000, "a higher isovalue changes the picture");
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    settle(&mut window);
    assert_eq!(window.state().scene().layers[0].iso, 226.0);
    assert_eq!(changed(&first, &pixels(&window)), 0, "undo brings the same picture back");

    // A click beside the skulls measures nothing; one on the forehead measures the frontal bone.
    let rect = window.state().picture_rect().unwrap();
    click(&mut window, rect.min + egui::vec2(30.0, 30.0));
    assert!(window.state().difference_ray().is_none());
    let target = on_bone(&window);
    click(&mut window, target);
    let ray = window.state().difference_ray().expect("the click cast a ray").clone();
    assert_eq!(ray.volumes.len(), 2);
    let frontal = ray.volumes[0].segments.first().expect("A has bone there");
    assert!((3.0..20.0).contains(&frontal.length_mm), "the frontal bone is {} mm thick", frontal.length_mm);
    assert!(frontal.uncertainty.error_mm > 0.0 && frontal.uncertainty.error_mm < 3.0, "± {} mm", frontal.uncertainty.error_mm);
    // The table shows what was measured.
    let cell = format!("{:.2}", frontal.length_mm);
    assert!(window.query_all_by_label(&cell).next().is_some(), "the table has a cell {cell}");
    window.get_by_label("Difference ray");

    // The ray stays in the world: its bone changes with the isovalue, and the view turns around it.
    settle(&mut window);
    let before = window.state().scene().camera;
    drag(&mut window, rect.center(), rect.center() + egui::vec2(-220.0, 40.0));
    assert_ne!(window.state().scene().camera, before);
    assert_eq!(window.state().difference_ray().unwrap().volumes, ray.volumes, "turning the view moves no measurement");
    window.get_by_role_and_label(Role::Slider, "Isovalue of skull A").set_value_accesskit(400.0);
    settle(&mut window);
    let thinner = window.state().difference_ray().unwrap().volumes[0].segments[0].length_mm;
    assert!(thinner < frontal.length_mm, "a higher isovalue leaves less bone: {thinner} of {} mm", frontal.length_mm);
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    settle(&mut window);
    assert_eq!(window.state().difference_ray().unwrap().volumes[0].segments[0].length_mm, frontal.length_mm);

    // Overlay, and undo once more.
    let isosurface = pixels(&window);
    window.get_by_label("Overlay").click();
    settle(&mut window);
    assert_eq!(window.state().scene().mode, Mode::Overlay);
    assert!(changed(&isosurface, &pixels(&window)) > 1000, "the overlay looks different");
    screenshot(&mut window, "window.png");
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    settle(&mut window);
    assert_eq!(window.state().scene().mode, Mode::Iso);
    assert_eq!(changed(&isosurface, &pixels(&window)), 0);
    window.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    settle(&mut window);
    assert_eq!(window.state().scene().mode, Mode::Overlay);
}

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
    window.get_by_label("Normal ray").click();
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
    window.get_by_label("Density along the ray");
    screenshot(&mut window, "measured.png");
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    window.run_steps(3);
    assert!(window.query_by_label("Name of L2").is_none() && window.query_by_label("Name of L1").is_some());
    window.get_by_label("Delete Ray 2").click();
    window.run_steps(3);
    assert!(window.query_by_label("Delete Ray 2").is_none() && window.query_by_label("Delete Ray 1").is_some());
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    window.run_steps(3);
    assert!(window.query_by_label("Delete Ray 2").is_some(), "undo brings the ray back");
}

#[test]
fn a_resting_window_asks_for_no_frames() {
    let mut window = open(Start::Files(vec![]));
    window.run();
    window.get_by_label_contains("Drop scans here");
}

#[test]
fn a_file_that_cannot_be_read_is_one_line_and_the_window_stays() {
    let file = std::env::temp_dir().join(format!("bregma-window-{}.nrrd", std::process::id()));
    std::fs::write(&file, b"NRRD0004\n").unwrap();
    let source = bregma::input::Source { file: file.clone(), ..Default::default() };
    let mut window = open(Start::Files(vec![source]));
    wait(&mut window, "the error", |w| !w.is_loading());
    window.run_steps(2);
    let name = file.file_name().unwrap().to_string_lossy().into_owned();
    window.get_by_label_contains(&name);
    window.get_by_label("Dismiss").click();
    window.run_steps(2);
    assert!(window.query_by_label_contains(&name).is_none());
    window.get_by_label_contains("Drop scans here");
    std::fs::remove_file(&file).unwrap();
}

/// A ball of 60 in 0, `n` samples across, as an NRRD file.
fn ball(name: &str, n: usize) -> std::path::PathBuf {
    let file = std::env::temp_dir().join(format!("bregma-window-{}-{name}.nrrd", std::process::id()));
    let mut bytes = format!("NRRD0004\ntype: uchar\ndimension: 3\nsizes: {n} {n} {n}\nspacings: 1 1 1\nencoding: raw\n\n").into_bytes();
    let middle = (n as f64 - 1.0) / 2.0;
    let square = |k: usize| (k as f64 - middle).powi(2);
    let radius = (middle * 0.8).powi(2);
    bytes.extend((0..n * n * n).map(|i| if square(i % n) + square(i / n % n) + square(i / n / n) < radius { 60 } else { 0 }));
    std::fs::write(&file, bytes).unwrap();
    file
}

#[derive(Debug)]
struct Dropped(std::path::PathBuf);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &std::path::Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        Err("scans are read from their path".into())
    }
}

fn drop_file(window: &mut Window, file: &std::path::Path) {
    window.input_mut().dropped_files.push(std::sync::Arc::new(Dropped(file.to_owned())));
    window.step();
    wait(window, "the dropped file", |w| !w.is_loading());
    settle(window);
}

#[test]
fn dropped_scans_join_and_can_be_removed_and_brought_back() {
    let files = [ball("first", 24), ball("second", 32)];
    let mut window = open(Start::Files(vec![]));
    for (n, file) in files.iter().enumerate() {
        drop_file(&mut window, file);
        assert_eq!(window.state().scene().layers.len(), n + 1);
    }
    let name = files[0].file_name().unwrap().to_string_lossy().into_owned();
    let both = pixels(&window);
    window.get_by_label(&format!("Remove {name}")).click();
    settle(&mut window);
    assert_eq!(window.state().scene().layers.len(), 1);
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    settle(&mut window);
    assert_eq!(window.state().scene().layers.len(), 2);
    assert_eq!(changed(&both, &pixels(&window)), 0);
    files.iter().for_each(|f| std::fs::remove_file(f).unwrap());
}

#[test]
fn keys_and_mouse_move_the_view_as_in_slicer() {
    let file = ball("view", 24);
    let source = bregma::input::Source { file: file.clone(), ..Default::default() };
    // On a screen whose points are one and a half pixels wide.
    let builder = Harness::builder().with_size([1280.0, 800.0]).with_pixels_per_point(1.5).wgpu();
    let mut window: Window = builder.build_eframe(|cc| Workstation::new(cc, Start::Files(vec![source])));
    wait(&mut window, "the scan", |w| !w.is_loading());
    settle(&mut window);
    let (picture, rect) = (window.state().picture().unwrap(), window.state().picture_rect().unwrap());
    assert_eq!([picture.width as f32, picture.height as f32], [rect.width() * 1.5, rect.height() * 1.5]);
    let forward = |window: &Window| window.state().scene().camera.basis().forward;
    for (key, direction) in [(Key::Num3, -glam::DVec3::X), (Key::Num7, -glam::DVec3::Z), (Key::Num1, glam::DVec3::Y)] {
        window.key_press(key);
        window.run_steps(2);
        assert!(forward(&window).dot(direction) > 0.999_999, "{key:?}");
    }
    let front = window.state().scene().camera;
    window.key_press(Key::Num5);
    window.run_steps(2);
    assert!(matches!(window.state().scene().camera.projection, bregma_renderer::Projection::Orthographic { .. }));
    window.key_press(Key::Num5);
    window.run_steps(2);
    assert!((window.state().scene().camera.eye_mm - front.eye_mm).length() < 1e-9, "there and back");

    // Dragging to the right turns the near side to the right: the eye goes to the viewer's left, the patient's right.
    let centre = window.state().picture_rect().unwrap().center();
    drag(&mut window, centre, centre + egui::vec2(100.0, 0.0));
    assert!(window.state().scene().camera.eye_mm.x < front.eye_mm.x - 1.0);
    assert!(window.state().difference_ray().is_none(), "a drag casts no ray");
    window.event(Event::PointerMoved(centre));
    window.event(Event::MouseWheel {
        unit: egui::MouseWheelUnit::Line,
        delta: egui::vec2(0.0, 1.0),
        source: egui::MouseWheelSource::Wheel,
        phase: egui::TouchPhase::Move,
        modifiers: Modifiers::NONE,
    });
    window.run_steps(3);
    let camera = window.state().scene().camera;
    assert!(camera.eye_mm.distance(camera.target_mm) < front.eye_mm.distance(front.target_mm), "the wheel brings it nearer");
    // The ball is 18.4 mm across, and the picture's centre shows its middle.
    click(&mut window, centre);
    let length = window.state().difference_ray().expect("a ray through the ball").volumes[0].segments[0].length_mm;
    assert!((length - 18.4).abs() < 1.0, "{length}");
    std::fs::remove_file(&file).unwrap();
}

/// Of solvers with a marker of their own colour in the chart the one that shows most of it, and the middle of that. Which markers and names lie
/// over each other is a matter of how long each solver took.
fn marker<'a>(window: &mut Window, solvers: &[(&'a str, [u8; 3])]) -> (&'a str, Pos2) {
    let shot = window.render().expect("the window is drawn by wgpu");
    // In the upper part of the window, where no row of the chart's table is.
    let shown = |color: [u8; 3]| -> Vec<(u32, u32)> {
        shot.enumerate_pixels().filter(|(_, y, p)| *y < 560 && p.0[..3] == color).map(|(x, y, _)| (x, y)).collect()
    };
    let (solver, found) = solvers.iter().map(|(solver, color)| (*solver, shown(*color))).max_by_key(|(_, f)| f.len()).unwrap();
    assert!(found.len() > 20, "no marker of {solver}: {} pixels", found.len());
    let mean = |v: fn(&(u32, u32)) -> u32| found.iter().map(v).sum::<u32>() as f32 / found.len() as f32;
    (solver, Pos2::new(mean(|p| p.0), mean(|p| p.1)))
}

#[test]
fn the_chart_is_measured_on_the_open_view_and_its_points_switch_the_picture() {
    // Fails if the chart cannot be measured or cancelled from the window, if a clicked point neither draws by its solver nor shows its
    // errors, or if the way back to the exact solver is lost.
    let file = ball("chart", 24);
    let source = bregma::input::Source { file: file.clone(), ..Default::default() };
    let mut window = open(Start::Files(vec![source]));
    wait(&mut window, "the scan", |w| !w.is_loading());
    settle(&mut window);
    let menu = |window: &mut Window, entry: &str| {
        window.get_by_label("View").click();
        window.run_steps(2);
        window.get_by_label_contains(entry).click();
        window.run_steps(3);
    };
    menu(&mut window, "Speed and accuracy");
    window.get_by_label("Measure this view").click();
    window.run_steps(2);
    window.get_by_label("Cancel").click();
    window.run_steps(2);
    assert!(window.state().chart().is_none(), "a cancelled measurement leaves nothing");
    window.get_by_label("Measure this view").click();
    wait(&mut window, "the chart", |w| w.chart().is_some());
    window.run_steps(3);
    let exact = pixels(&window);
    assert!(window.state().chart().unwrap().points.len() >= 13);
    window.get_by_label("linear on CPU").click();
    window.run_steps(3);
    settle(&mut window);
    assert_eq!(window.state().scene().solver.to_string(), "linear");
    assert_eq!(window.state().charted().unwrap().solver.to_string(), "linear");
    assert!(changed(&exact, &pixels(&window)) > 100, "linear interpolation looks different");
    window.get_by_label_contains("which is not exact");
    window.get_by_label("Error picture");
    screenshot(&mut window, "chart.png");
    // A click on a point of the plot does the same: of exact's row first, then on a marker of a colour that no other has.
    window.get_by_label("exact on CPU").click();
    window.run_steps(3);
    assert_eq!(window.state().charted().unwrap().solver.to_string(), "exact");
    let (solver, at) = marker(&mut window, &[("linear", [230, 159, 0]), ("analytic", [204, 121, 167])]);
    click(&mut window, at);
    window.run_steps(2);
    assert_eq!(window.state().charted().unwrap().solver.to_string(), solver);
    menu(&mut window, "Draw by the exact solver");
    settle(&mut window);
    assert_eq!(changed(&exact, &pixels(&window)), 0);
    std::fs::remove_file(&file).unwrap();
}

#[test]
fn a_spacing_that_no_file_states_is_asked_for() {
    // Fails if a scan opens with made-up millimetres, or if the answer is not used.
    let folder = std::env::temp_dir().join(format!("bregma-asks-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("ball_16x16x16_uint8.raw");
    let ball = |n: usize| [n % 16, n / 16 % 16, n / 256].map(|c| (c as f64 - 7.5).powi(2)).iter().sum::<f64>().sqrt();
    std::fs::write(&file, (0..4096).map(|n| (250.0 - 25.0 * ball(n)).max(0.0) as u8).collect::<Vec<u8>>()).unwrap();
    let mut window = open(Start::Files(vec![bregma::input::Source { file, ..Default::default() }]));
    let begun = Instant::now();
    while window.query_by_label("Open").is_none() {
        window.step();
        assert!(begun.elapsed() < Duration::from_secs(60), "nothing is asked");
    }
    assert!(window.state().is_loading() && window.get_by_label("Open").accesskit_node().is_disabled());
    for (axis, mm) in [("i", 0.5), ("j", 0.5), ("k", 2.0)] {
        window.get_by_role_and_label(Role::SpinButton, axis).set_value_accesskit(mm);
        window.step();
    }
    window.get_by_label("Open").click();
    wait(&mut window, "the scan", |w| !w.is_loading());
    settle(&mut window);
    let picture = window.state().picture().unwrap();
    assert!(picture.volume_id.contains(&1), "the ball is drawn");
    std::fs::remove_dir_all(folder).unwrap();
}

/// A CT slice of a ball in the fewest elements that make one, explicit little-endian without a preamble.
fn ct_slice(series: &str, name: &str, z: i32) -> Vec<u8> {
    let ball = |n: usize| [n as i32 % 16 * 2 - 15, n as i32 / 16 * 2 - 15, z * 2 - 15].map(|c| f64::from(c * c)).iter().sum::<f64>().sqrt();
    let pixels = (0..256).flat_map(|n| ((2400.0 - 120.0 * ball(n)).max(0.0) as u16).to_le_bytes()).collect();
    let text = |text: &str| format!("{text}{}", if text.len() % 2 == 1 { " " } else { "" }).into_bytes();
    let number = |n: u16| n.to_le_bytes().to_vec();
    let elements: [([u16; 2], &str, Vec<u8>); 16] = [
        ([0x8, 0x8], "CS", text("ORIGINAL\\PRIMARY")),
        ([0x8, 0x60], "CS", text("CT")),
        ([0x8, 0x103e], "LO", text(name)),
        ([0x20, 0xe], "UI", text(&format!("1.2.{series}"))),
        ([0x20, 0x11], "IS", text(series)),
        ([0x20, 0x32], "DS", text(&format!("0\\0\\{z}"))),
        ([0x20, 0x37], "DS", text("1\\0\\0\\0\\1\\0")),
        ([0x28, 0x10], "US", number(16)),
        ([0x28, 0x11], "US", number(16)),
        ([0x28, 0x30], "DS", text("1\\1")),
        ([0x28, 0x100], "US", number(16)),
        ([0x28, 0x101], "US", number(16)),
        ([0x28, 0x102], "US", number(15)),
        ([0x28, 0x1052], "DS", text("-1000")),
        ([0x28, 0x1053], "DS", text("1")),
        ([0x7fe0, 0x10], "OW", pixels),
    ];
    let mut bytes = vec![];
    for ([group, element], vr, value) in elements {
        bytes.extend([group.to_le_bytes(), element.to_le_bytes()].concat());
        bytes.extend(vr.as_bytes());
        match vr {
            "OW" => bytes.extend([&[0, 0][..], &(value.len() as u32).to_le_bytes()].concat()),
            _ => bytes.extend((value.len() as u16).to_le_bytes()),
        }
        bytes.extend(value);
    }
    bytes
}

fn wait_for(window: &mut Window, label: &str) {
    let begun = Instant::now();
    while window.query_by_label_contains(label).is_none() {
        window.step();
        assert!(begun.elapsed() < Duration::from_secs(60), "waited in vain for {label:?}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

#[test]
fn a_series_is_chosen_and_gaps_are_filled_only_when_asked() {
    // Fails if the window reads the largest of several series without a word, reads another than the one that was chosen, or cannot open what
    // the command line can with --uneven resample.
    let folder = std::env::temp_dir().join(format!("bregma-study-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    for z in 0..16 {
        std::fs::write(folder.join(format!("whole{z}")), ct_slice("7", "The whole", z)).unwrap();
    }
    for z in [0, 1, 2, 3, 4, 5, 6, 8, 9, 10, 11, 12] {
        std::fs::write(folder.join(format!("gap{z}")), ct_slice("9", "With a gap", z)).unwrap();
    }
    let name = folder.file_name().unwrap().to_string_lossy().into_owned();
    let source = || bregma::input::Source { file: folder.clone(), ..Default::default() };

    // The largest is chosen beforehand.
    let mut window = open(Start::Files(vec![source()]));
    wait_for(&mut window, "holds several series");
    let whole = window.get_by_role_and_label(Role::RadioButton, "The whole  ·  series 7  ·  16 slices");
    assert_eq!(whole.accesskit_node().toggled(), Some(egui::accesskit::Toggled::True));
    window.get_by_label("Open").click();
    wait(&mut window, "the largest series", |w| !w.is_loading());
    settle(&mut window);
    window.get_by_label(&format!("Remove {name}#7"));
    assert!(window.state().picture().unwrap().volume_id.contains(&1), "the ball is drawn");

    // Another one joins it, once it was said what to do about its gap.
    window.input_mut().dropped_files.push(std::sync::Arc::new(Dropped(folder.clone())));
    window.step();
    wait_for(&mut window, "holds several series");
    window.get_by_role_and_label(Role::RadioButton, "With a gap  ·  series 9  ·  12 slices").click();
    window.step();
    screenshot(&mut window, "series.png");
    window.get_by_label("Open").click();
    wait_for(&mut window, "Most are 1 mm apart, but 2 mm between slices 7 and 8");
    assert_eq!(window.state().scene().layers.len(), 1);
    screenshot(&mut window, "uneven.png");
    window.get_by_label("Interpolate").click();
    wait(&mut window, "the other series", |w| !w.is_loading());
    settle(&mut window);
    assert_eq!(window.state().scene().layers.len(), 2);
    window.get_by_label(&format!("Remove {name}#9"));

    // Refusing is possible, too.
    let mut window =
        open(Start::Files(vec![bregma::input::Source { file: format!("{}#9", folder.display()).into(), ..Default::default() }]));
    wait_for(&mut window, "are not even");
    window.get_by_label("Cancel").click();
    wait(&mut window, "nothing", |w| !w.is_loading());
    window.run_steps(2);
    assert!(window.state().scene().layers.is_empty());
    std::fs::remove_dir_all(folder).unwrap();
}

/// Where the part of that name is.
fn rect_of(window: &Window, label: &str) -> egui::Rect {
    window.get_by_label(label).rect()
}

fn click_with(window: &mut Window, at: Pos2, button: PointerButton) {
    window.event(Event::PointerMoved(at));
    press(window, at, true, button);
    press(window, at, false, button);
    window.run_steps(2);
}

fn choose(window: &mut Window, role: Role, label: &str) {
    window.get_by_role_and_label(role, label).click();
    settle(window);
}

fn undo(window: &mut Window) {
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    settle(window);
}

#[test]
fn every_mode_is_chosen_drawn_and_undone_with_only_its_own_controls() {
    // Fails if a mode cannot be chosen, draws what another one draws, shows another one's controls, or is forgotten by undo.
    let mut window = open(Start::Demo);
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    settle(&mut window);
    choose(&mut window, Role::RadioButton, "Isosurface");
    let mut seen = vec![pixels(&window)];
    for (label, mode, has, hasnt) in [
        ("Overlay", Mode::Overlay, "Opacity of skull A", "Transparent"),
        ("Volume", Mode::Dvr, "Transfer function of skull A", "Shadows"),
        ("Maximum", Mode::Max, "Of the gradient", "Depth cue"),
        ("Mean", Mode::Mean, "Automatic contrast", "Transfer function of skull A"),
        ("X-ray", Mode::Xray, "Of the gradient", "Opacity of skull A"),
    ] {
        choose(&mut window, Role::RadioButton, label);
        assert_eq!(window.state().scene().mode, mode);
        assert!(window.query_all_by_label(has).next().is_some(), "{label} has {has}");
        assert!(window.query_all_by_label(hasnt).next().is_none(), "{label} has no {hasnt}");
        let now = pixels(&window);
        let least = seen.iter().map(|before| changed(before, &now)).min();
        assert!(least > Some(1000), "{label} looks different from all before");
        seen.push(now);
        screenshot(&mut window, &format!("mode-{}.png", label.to_lowercase()));
    }
    // Contrast by hand begins with what the picture shows and changes it when it is moved.
    choose(&mut window, Role::CheckBox, "Automatic contrast");
    let own = window.state().scene().window.expect("a window of its own");
    assert!(own.width > 0.0);
    window.get_by_role_and_label(Role::SpinButton, "Window width").set_value_accesskit(own.width * 0.5);
    settle(&mut window);
    assert!(changed(&seen[5], &pixels(&window)) > 1000);
    for expected in [Some(own), None] {
        undo(&mut window);
        assert_eq!(window.state().scene().window, expected);
    }
    choose(&mut window, Role::CheckBox, "Of the gradient");
    assert!(window.state().scene().of_gradient && changed(&seen[5], &pixels(&window)) > 1000);
    undo(&mut window);
    undo(&mut window);
    assert_eq!(window.state().scene().mode, Mode::Mean);
}

#[test]
fn transparent_surfaces_are_added_changed_and_removed() {
    // Fails if a further isosurface is not drawn, or one of its parts cannot be changed by its name.
    let mut window = open(Start::Demo);
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    settle(&mut window);
    choose(&mut window, Role::RadioButton, "Isosurface");
    choose(&mut window, Role::CheckBox, "Transparent");
    let plain = pixels(&window);
    choose(&mut window, Role::Button, "Add an isosurface to skull A");
    assert_eq!(window.state().scene().layers[0].shells.len(), 1);
    let with_skin = pixels(&window);
    assert!(changed(&plain, &with_skin) > 1000, "the further surface shows");
    window.get_by_role_and_label(Role::Slider, "Opacity of surface 2 of skull A").set_value_accesskit(0.9);
    window.get_by_role_and_label(Role::SpinButton, "Isovalue of surface 2 of skull A").set_value_accesskit(-500.0);
    settle(&mut window);
    let shell = window.state().scene().layers[0].shells[0];
    assert!((shell.opacity - 0.9).abs() < 0.01 && shell.iso == -500.0, "{shell:?}");
    assert!(changed(&with_skin, &pixels(&window)) > 1000);
    window.get_all_by_label("Inside in another colour").next().unwrap().click();
    settle(&mut window);
    assert!(window.state().scene().layers[0].inner_color.is_some());
    screenshot(&mut window, "shells.png");
    let left = window.state().picture_rect().unwrap().left();
    window.get_by_role_and_label(Role::Slider, "Opacity of skull A").set_value_accesskit(1.0);
    window.run_steps(10);
    assert_eq!(window.state().picture_rect().unwrap().left(), left, "the widest number widens no panel");
    undo(&mut window);
    choose(&mut window, Role::Button, "Remove surface 2 of skull A");
    assert!(window.state().scene().layers[0].shells.is_empty());
    undo(&mut window);
    assert_eq!(window.state().scene().layers[0].shells, [shell]);
}

#[test]
fn a_transfer_function_is_chosen_and_its_points_dragged_added_and_removed() {
    // Fails if a point does not follow the mouse, passes its neighbour, cannot be added or removed, or if a drag is more than one step.
    let file = ball("transfer", 24);
    let source = bregma::input::Source { file: file.clone(), ..Default::default() };
    // Frames follow each other fast enough for a double click.
    let builder = Harness::builder().with_size([1280.0, 800.0]).with_step_dt(0.02).wgpu();
    let mut window: Window = builder.build_eframe(|cc| Workstation::new(cc, Start::Files(vec![source])));
    wait(&mut window, "the scan", |w| !w.is_loading());
    settle(&mut window);
    let name = file.file_name().unwrap().to_string_lossy().into_owned();
    choose(&mut window, Role::RadioButton, "Volume");
    let by_default = pixels(&window);
    let function = |window: &Window| window.state().scene().layers[0].transfer.clone();
    assert!(function(&window).is_none());
    window.get_by_label(&format!("Look of {name}")).click();
    window.run_steps(2);
    assert!(window.get_by_label("mummy").accesskit_node().is_disabled(), "a look of HU fits no scan without them");
    window.get_by_label("µCT").click();
    settle(&mut window);
    assert_eq!(function(&window).unwrap().name, "µCT");
    undo(&mut window);
    assert!(function(&window).is_none() && changed(&by_default, &pixels(&window)) == 0);

    let field = rect_of(&window, &format!("Transfer function of {name}"));
    let first = rect_of(&window, &format!("Point 1 of {name}")).center();
    drag(&mut window, first, Pos2::new(field.left() + 20.0, field.top() + 12.0));
    settle(&mut window);
    let dragged = function(&window).expect("a function of its own");
    assert!(dragged.points[0].opacity > 0.85 && dragged.points[0].value < 10.0, "{:?}", dragged.points);
    assert!(changed(&by_default, &pixels(&window)) > 1000, "what was invisible is seen");
    // Farther to the right than its neighbour it does not go.
    let first = rect_of(&window, &format!("Point 1 of {name}")).center();
    drag(&mut window, first, field.right_center());
    let points = function(&window).unwrap().points;
    assert!(points[0].value < points[1].value && points[1] == dragged.points[1]);
    undo(&mut window);
    assert_eq!(function(&window), Some(dragged.clone()));

    let empty = Pos2::new(field.left() + field.width() * 0.25, field.center().y);
    for _ in 0..2 {
        click(&mut window, empty);
    }
    assert_eq!(function(&window).unwrap().points.len(), 4);
    screenshot(&mut window, "transfer.png");
    let added = rect_of(&window, &format!("Point 2 of {name}")).center();
    assert!((added - empty).length() < 3.0);
    click_with(&mut window, added, PointerButton::Secondary);
    assert_eq!(function(&window).unwrap().points, dragged.points);
    undo(&mut window);
    assert_eq!(function(&window).unwrap().points.len(), 4);
    undo(&mut window);
    undo(&mut window);
    assert!(function(&window).is_none() && changed(&by_default, &pixels(&window)) == 0);
    std::fs::remove_file(&file).unwrap();
}

fn drag_with(window: &mut Window, from: Pos2, to: Pos2, modifiers: Modifiers) {
    window.event(Event::PointerMoved(from));
    let button = |pos: Pos2, pressed| Event::PointerButton { pos, button: PointerButton::Primary, pressed, modifiers };
    window.event_modifiers(button(from, true), modifiers);
    for n in 1..=4 {
        window.event_modifiers(Event::PointerMoved(from.lerp(to, n as f32 / 4.0)), modifiers);
    }
    window.event_modifiers(button(to, false), modifiers);
    window.run_steps(2);
}

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
    choose(&mut window, Role::Button, "Dismiss");
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
        assert!((normal.dot(landmark.point_mm) - offset_mm).abs() < 1e-9);
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

fn compare_by(window: &mut Window, kind: &str) {
    window.get_by_label("Compare").click();
    window.run_steps(3);
    window.get_by_label(kind).click();
    window.run_steps(2);
    settle(window);
}

#[test]
fn two_scans_are_compared_side_by_side_by_swipe_checkerboard_and_flicker() {
    // Fails if a half of the picture shows the wrong scan, the line does not follow the mouse, a drag of it draws anew, or a click in the
    // right half of two measures elsewhere than where it points.
    let mut window = open(Start::Demo);
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    settle(&mut window);
    choose(&mut window, Role::RadioButton, "Isosurface");
    let together = pixels(&window);
    // Which scans are seen left and right of a column.
    let seen = |window: &Window, column: f32| {
        let picture = window.state().picture().unwrap();
        let line = (column * picture.width as f32) as usize;
        let ids = picture.volume_id.iter().enumerate().filter(|(_, id)| **id != 0);
        let mut sides = [std::collections::BTreeSet::new(), std::collections::BTreeSet::new()];
        ids.for_each(|(n, id)| _ = sides[usize::from(n % picture.width as usize >= line)].insert(*id));
        sides.map(|ids| ids.into_iter().collect::<Vec<_>>())
    };
    compare_by(&mut window, "Swipe");
    assert_eq!(seen(&window, 0.5), [vec![1], vec![2]]);
    let (line, rect) = (rect_of(&window, "Swipe line").center(), window.state().picture_rect().unwrap());
    drag(&mut window, line, line - egui::vec2(rect.width() * 0.06, 0.0));
    assert!(window.state().is_settled(), "moving the line draws nothing anew");
    assert!(matches!(window.state().compare(), bregma::compare::Compare::Swipe { part } if (part - 0.44).abs() < 0.01));
    window.run_steps(1);
    assert_eq!(seen(&window, 0.44), [vec![1], vec![2]]);
    screenshot(&mut window, "compare-swipe.png");

    compare_by(&mut window, "Checkerboard");
    let squares = seen(&window, 0.5);
    assert_eq!(squares, [vec![1, 2], vec![1, 2]]);
    screenshot(&mut window, "compare-checkerboard.png");

    compare_by(&mut window, "Flicker");
    let mut turns = std::collections::BTreeSet::new();
    for _ in 0..12 {
        window.run_steps(1);
        turns.insert(seen(&window, 0.0)[1].clone());
    }
    assert_eq!(turns.into_iter().collect::<Vec<_>>(), [vec![1], vec![2]], "each by turns");

    compare_by(&mut window, "Side by side");
    assert_eq!(seen(&window, 0.5), [vec![1], vec![2]]);
    // The same point of the forehead in both halves.
    let (picture, rect) = (window.state().picture().unwrap(), window.state().picture_rect().unwrap());
    let (w, h) = (picture.width as usize, picture.height as usize);
    let row = (0..h * 2 / 5).rev().find(|y| picture.volume_id[y * w + w / 4] != 0).expect("bone above the centre") as f32;
    let left = rect.min + egui::vec2(rect.width() / 4.0, row + 0.5);
    let right = left + egui::vec2(rect.width() / 2.0, 0.0);
    let mut rays = vec![];
    for at in [left, right] {
        click(&mut window, at);
        rays.push(window.state().difference_ray().expect("a ray").volumes[0].segments[0].length_mm);
        undo(&mut window);
    }
    assert!((rays[0] - rays[1]).abs() < 1e-6, "{rays:?}");
    click(&mut window, right);
    settle(&mut window);
    screenshot(&mut window, "compare-side.png");
    undo(&mut window);
    compare_by(&mut window, "Together");
    assert_eq!(changed(&together, &pixels(&window)), 0);
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
    let mut window = open(Start::Files(vec![bregma::input::Source { file: file.clone(), ..Default::default() }]));
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
    // The panel is pulled up, so that both plots are seen.
    let edge = window.state().picture_rect().unwrap().center_bottom();
    drag(&mut window, edge, edge - egui::vec2(0.0, 160.0));
    settle(&mut window);
    screenshot(&mut window, "curve.png");
    undo(&mut window);
    assert!(window.query_by_label("Delete Ray 2").is_none() && window.query_by_label("Delete Ray 1").is_some());
    assert_eq!(window.state().difference_ray().unwrap().volumes, ray.volumes);
    std::fs::remove_file(&file).unwrap();
}
