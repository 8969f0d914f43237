//! The workstation's window, used as a person uses it: open, move a slider, click on bone, switch modes, undo.
//!
//! Run with egui_kittest rather than in a window of the desktop: it is the same application code, widgets are found by the
//! names that a screen reader speaks, input arrives in a fixed order, and pixels come from the real wgpu renderer on whatever
//! driver there is, software included. That the program starts under a display is tested where the commands are.
#![allow(clippy::unwrap_used, reason = "what a test cannot find, it fails on")]

mod by_hand;
mod chart;
mod compared_slices;
mod correcting;
mod cuts_by_hand;
mod cutting;
mod differing;
mod filming;
mod hand;
mod keeping;
mod kept_poses;
mod layout;
mod lighting;
mod looking;
mod looks;
mod measuring;
mod opening;
mod parting;
mod preferring;
mod printing;
mod registering;
mod sectioning;
mod sheet;
mod slices;
mod stage;
mod tasks;
mod volumes;

use bregma::window::{Preferences, Start, Workstation};
use bregma_renderer::Mode;
use egui::accesskit::Role;
use egui::{Event, Key, Modifiers, PointerButton, Pos2};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use std::time::{Duration, Instant};

type Window = Harness<'static, Workstation>;

fn open(start: Start) -> Window {
    Harness::builder().with_size([1280.0, 800.0]).wgpu().build_eframe(|cc| Workstation::new(cc, start, None).preferring(at_once()))
}

/// A picture at rest has one point of each pixel, so that it is done at once.
fn at_once() -> Preferences {
    Preferences { samples_at_rest: 1, ..Preferences::default() }
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
    rect.min + egui::vec2((found % w) as f32 + 0.5, (found / w) as f32 + 0.5) * (rect.width() / w as f32)
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
    window.get_by_label("Name of Ray 1");

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
fn a_resting_window_asks_for_no_frames() {
    let mut window = open(Start::Files(vec![]));
    window.run();
    window.get_by_label_contains("Drop scans here");
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

fn wait_for(window: &mut Window, label: &str) {
    let begun = Instant::now();
    while window.query_by_label_contains(label).is_none() {
        window.step();
        assert!(begun.elapsed() < Duration::from_secs(60), "waited in vain for {label:?}");
        std::thread::sleep(Duration::from_millis(10));
    }
    // What has just come takes a frame to find its place.
    window.run_steps(2);
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

/// Chooses a command by a part of its name, as from the list of commands.
fn command(window: &mut Window, name: &str) {
    window.key_press_modifiers(Modifiers::COMMAND, Key::K);
    window.run_steps(2);
    window.event(Event::Text(name.to_owned()));
    window.run_steps(2);
    window.key_press(Key::Enter);
    window.run_steps(3);
}

/// Opens a side of the window where it is folded or a drawer.
fn open_side(window: &mut Window, name: &str) {
    let label = format!("Show {}", name.to_lowercase());
    if let Some(strip) = window.query_all_by_label_contains(&label).next() {
        strip.click();
    }
    window.run_steps(3);
}

/// Closes a scan by its menu.
fn close_scan(window: &mut Window, name: &str) {
    window.get_by_label(&format!("More of {name}")).click();
    window.run_steps(4);
    window.get_by_label("Close the scan").click();
    settle(window);
}

/// Closes what lies over the picture.
fn close_drawers(window: &mut Window) {
    window.key_press(Key::Escape);
    window.run_steps(3);
}

fn choose(window: &mut Window, role: Role, label: &str) {
    // It may have to be scrolled to.
    window.get_by_role_and_label(role, label).scroll_to_me();
    window.run_steps(6);
    window.get_by_role_and_label(role, label).click();
    settle(window);
}

fn undo(window: &mut Window) {
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    settle(window);
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
