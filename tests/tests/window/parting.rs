//! The parts of a scan in the window: found, ticked, named, kept with the session.

use super::printing::save_to;
use super::*;
use bregma_session::{Measurement, Opened, Session, Source, record};
use std::path::{Path, PathBuf};

const RADII_MM: [f64; 2] = [6.6, 5.2];

/// A folder of its own with a scan of two balls that do not touch, 32 samples of 1 mm across, and a session of it at an isovalue.
fn folder(name: &str, iso: f64) -> (PathBuf, PathBuf) {
    const N: usize = 32;
    let folder = std::env::temp_dir().join(format!("bregma-parting-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let mut bytes =
        format!("NRRD0004\ntype: float\ndimension: 3\nsizes: {N} {N} {N}\nspacings: 1 1 1\nencoding: raw\nendian: little\n\n").into_bytes();
    let distance = |n: usize, x: f64| ((n % N) as f64 - x).hypot((n / N % N) as f64 - 16.0).hypot((n / N / N) as f64 - 16.0);
    let value = |n: usize| (RADII_MM[0] - distance(n, 8.0)).max(RADII_MM[1] - distance(n, 23.0)).clamp(-2.0, 2.0);
    bytes.extend((0..N * N * N).flat_map(|n| (100.0 * value(n) as f32).to_le_bytes()));
    let scan = folder.join("balls.nrrd");
    std::fs::write(&scan, bytes).unwrap();
    let mut opened = Opened::read(&[Source { file: scan, ..Default::default() }], &Default::default()).unwrap();
    opened.scene.layers[0].iso = iso;
    opened.scene.mode = Mode::Iso;
    opened.first_look(1.0);
    let session = folder.join("two.json");
    Session::of(&opened, &folder).write(&session).unwrap();
    (folder, session)
}

fn opened(file: &Path) -> Window {
    let start = Start::Files(vec![Source { file: file.to_owned(), ..Default::default() }]);
    // Frames follow each other fast enough for a double click.
    let builder = Harness::builder().with_size([1280.0, 800.0]).with_step_dt(0.02).wgpu();
    let mut window: Window = builder.build_eframe(|cc| Workstation::new(cc, start, None).preferring(at_once()));
    wait(&mut window, "the session", |w| !w.is_loading());
    settle(&mut window);
    window
}

fn is_cut(w: &Workstation) -> bool {
    w.scene().layers[0].within.is_some()
}

fn tick(window: &mut Window, name: &str, cuts: bool) {
    window.get_by_label(&format!("Keep {name}")).click();
    wait(window, "the part", |w| is_cut(w) == cuts);
    settle(window);
}

fn measured_mm3(window: &mut Window) -> f64 {
    let count = window.state().measurements().len();
    command(window, "Volumes…");
    window.get_by_label("Measure the volume").click();
    wait(window, "the volume", |w| w.measurements().len() == count + 1);
    window.run_steps(2);
    match &window.state().measurements()[count] {
        Measurement::Volumes(volumes) => volumes.volumes_mm3()[0].1,
        other => panic!("{other:?}"),
    }
}

fn rows(window: &Window) -> usize {
    window.query_all_by_label_contains("Keep Island").count()
}

#[test]
fn islands_are_listed_ticked_measured_named_and_undone_one_by_one() {
    // Fails if an island is missing or twice, a tick does not cut picture and measurement, a deed is no step or more than one, or a name is lost.
    let (folder, session) = folder("islands", 0.0);
    let mut window = opened(&session);
    let whole = pixels(&window);
    window.get_by_label("Parts").click();
    window.run_steps(2);
    window.get_by_label("Find islands").click();
    wait_for(&mut window, "Keep Island 2");
    settle(&mut window);
    assert_eq!((rows(&window), changed(&whole, &pixels(&window))), (2, 0), "all islands are all of it");
    tick(&mut window, "Island 2", true);
    let one = pixels(&window);
    assert!(changed(&whole, &one) > 500, "{} pixels", changed(&whole, &one));
    screenshot(&mut window, "parts.png");
    let sphere = |radius: f64| 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
    let mm3 = measured_mm3(&mut window);
    println!("the larger ball alone: {mm3:.1} mm³ of {:.1}", sphere(RADII_MM[0]));
    assert!((mm3 / sphere(RADII_MM[0]) - 1.0).abs() < 0.03, "{mm3} of {}", sphere(RADII_MM[0]));
    // What is only seen is measured whole.
    window.get_by_label("Parts").click();
    window.run_steps(2);
    window.get_by_label("Also for what is measured").click();
    window.run_steps(3);
    let all_mm3 = measured_mm3(&mut window);
    assert!((all_mm3 / (sphere(RADII_MM[0]) + sphere(RADII_MM[1])) - 1.0).abs() < 0.03, "{all_mm3}");
    window.get_by_label("Parts").click();
    window.run_steps(3);
    // A third click in a row is no double one.
    window.run_steps(40);
    let name = rect_of(&window, "Island 1").center();
    click(&mut window, name);
    click(&mut window, name);
    window.run_steps(2);
    window.get_by_label("Name of Island 1");
    window.key_press_modifiers(Modifiers::COMMAND, Key::A);
    window.run_steps(2);
    window.event(Event::Text("Cranium".to_owned()));
    window.run_steps(2);
    window.key_press(Key::Enter);
    window.run_steps(4);
    window.get_by_label("Keep Cranium");
    // The name, the second volume, the switch, the first volume; then the tick, then the islands.
    (0..4).for_each(|_| undo(&mut window));
    assert!(is_cut(window.state()) && window.state().measurements().is_empty());
    assert_eq!((rows(&window), changed(&one, &pixels(&window))), (2, 0));
    undo(&mut window);
    assert_eq!((rows(&window), is_cut(window.state()), changed(&whole, &pixels(&window))), (2, false, 0));
    undo(&mut window);
    assert_eq!(rows(&window), 0);
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn the_skull_is_kept_by_two_clicks_and_stays_so_in_its_session() {
    // Fails if more is asked than the tab and the button, undo does not bring the rest back, or a session forgets the part, its map or a bit of its picture.
    let (folder, session) = folder("skull", 0.0);
    let mut window = opened(&session);
    let whole = pixels(&window);
    let mut clicks = 0;
    for label in ["Parts", "Keep the skull"] {
        window.get_by_label(label).click();
        window.run_steps(2);
        clicks += 1;
    }
    wait(&mut window, "the skull", is_cut);
    settle(&mut window);
    println!("clicks of Keep the skull: {clicks}");
    let skull = pixels(&window);
    assert!(changed(&whole, &skull) > 500);
    undo(&mut window);
    assert_eq!(changed(&whole, &pixels(&window)), 0);
    window.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    settle(&mut window);
    assert_eq!(changed(&skull, &pixels(&window)), 0);
    window.run_steps(2);
    let mm3 = measured_mm3(&mut window);
    command(&mut window, "Save session");
    window.run_steps(3);
    let map = folder.join("two.balls.nrrd.seg.nrrd");
    assert!(map.exists(), "{:?}", std::fs::read_dir(&folder).unwrap().map(|f| f.unwrap().file_name()).collect::<Vec<_>>());
    drop(window);
    let mut again = opened(&session);
    assert_eq!(changed(&skull, &pixels(&again)), 0, "the same picture to the byte");
    assert_eq!(measured_mm3(&mut again), mm3);
    again.get_by_label("Parts").click();
    again.run_steps(3);
    again.get_by_label("Keep Skull");
    again.get_by_label("Show all").click();
    wait(&mut again, "all", |w| !is_cut(w));
    settle(&mut again);
    assert_eq!(changed(&whole, &pixels(&again)), 0);
    // What was measured is measured again from its record.
    let recorded = record::read(&session).unwrap();
    let (judged, _) = record::Verifier::default().verify(1, &recorded[0], &folder).unwrap();
    assert!(!judged.is_empty() && judged.iter().all(|one| one.verdict == record::Verdict::Holds), "{judged:?}");
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_label_map_is_saved_and_opened_with_its_names() {
    // Fails if the panel writes something else than it lists, cannot read what it wrote, or says nothing where there is no bone.
    let (folder, session) = folder("map", 0.0);
    let mut window = opened(&session);
    window.get_by_label("Parts").click();
    window.run_steps(2);
    window.get_by_label("Separate at necks").click();
    wait_for(&mut window, "Keep Part 2");
    let map = folder.join("mine.seg.nrrd");
    window.get_by_label("Save label map…").click();
    window.run_steps(2);
    save_to(&mut window, &map);
    wait(&mut window, "the map", |_| map.exists());
    drop(window);
    let mut again = opened(&session);
    again.get_by_label("Parts").click();
    again.run_steps(2);
    again.get_by_label("Open label map…").click();
    again.run_steps(2);
    save_to(&mut again, &map);
    wait_for(&mut again, "Keep Part 2");
    tick(&mut again, "Part 1", true);
    std::fs::remove_dir_all(&folder).unwrap();
    let (folder, session) = self::folder("none", 5000.0);
    let mut window = opened(&session);
    window.get_by_label("Parts").click();
    window.run_steps(2);
    window.get_by_label("Find islands").click();
    wait_for(&mut window, "none of its samples is bone");
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn the_demo_keeps_its_skull() {
    // Fails if one of two scans cannot be chosen, or a skull that nothing hangs on loses bone.
    let folder = std::env::temp_dir().join(format!("bregma-parting-demo-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("pair.json");
    Session::of(&Opened::demo(64, &Default::default()).unwrap(), &folder).write(&file).unwrap();
    let mut window = opened(&file);
    let whole = pixels(&window);
    window.get_by_label("Parts").click();
    window.run_steps(2);
    window.get_by_label("Keep the skull").click();
    wait_for(&mut window, "Keep Skull");
    settle(&mut window);
    let lost = changed(&whole, &pixels(&window));
    println!("pixels that changed when the demo's skull was kept: {lost}");
    assert!(lost < whole.len() / 1000, "{lost}");
    screenshot(&mut window, "parts-demo.png");
    std::fs::remove_dir_all(folder).unwrap();
}
