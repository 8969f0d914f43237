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

/// Where a point of the world is in the picture on the screen.
fn on_screen(window: &Window, p: [f64; 3]) -> Pos2 {
    let (picture, rect) = (window.state().picture().unwrap(), window.state().picture_rect().unwrap());
    let (x, y) = window.state().scene().camera.project(bregma_field::WorldPoint(p.into()), picture.width, picture.height).unwrap();
    rect.min + egui::vec2(x as f32 + 0.5, y as f32 + 0.5) * (rect.width() / picture.width as f32)
}

/// A drag through points, a frame for each.
fn stroke(window: &mut Window, points: &[Pos2]) {
    window.event(Event::PointerMoved(points[0]));
    window.step();
    press(window, points[0], true, PointerButton::Primary);
    window.step();
    for at in points {
        window.event(Event::PointerMoved(*at));
        window.step();
    }
    press(window, *points.last().unwrap(), false, PointerButton::Primary);
    window.run_steps(2);
}

/// The sizes of parts as the list has them, mm³ in whole numbers.
fn sizes(window: &Window) -> Vec<String> {
    let labels = window.query_all_by_role(Role::Label).filter_map(|node| node.accesskit_node().value());
    labels.filter(|text| text.contains(" mm³, ")).collect()
}

fn takes(window: &mut Window, tool: &str) {
    window.get_by_label(tool).click();
    window.run_steps(2);
}

#[test]
fn a_stroke_of_the_brush_paints_a_part_as_one_step() {
    // Fails if a drag turns the view or measures, a stroke is no step or several, nothing is seen of it before it is one, the eraser does not take it back, or
    // the part cannot be left out.
    let (folder, session) = folder("brush", 0.0);
    let mut window = opened(&session);
    window.get_by_label("Parts").click();
    window.run_steps(2);
    let (whole, camera) = (pixels(&window), window.state().scene().camera);
    takes(&mut window, "Brush");
    let middle = on_screen(&window, [8.0, 16.0, 16.0]);
    let before = window.render().unwrap();
    window.event(Event::PointerMoved(middle));
    window.step();
    press(&window, middle, true, PointerButton::Primary);
    window.run_steps(2);
    let seen = window.render().unwrap();
    let tinted = before.pixels().zip(seen.pixels()).filter(|(a, b)| a != b).count();
    println!("pixels of the window that a touch changed while the button was down: {tinted}");
    assert!(tinted > 100, "{tinted}");
    press(&window, middle, false, PointerButton::Primary);
    wait_for(&mut window, "Keep Part 1");
    settle(&mut window);
    assert_eq!(window.state().scene().camera, camera, "a brush turns nothing");
    assert!(window.state().difference_ray().is_none(), "a brush measures nothing");
    let touch = sizes(&window);
    stroke(&mut window, &[middle, middle + egui::vec2(10.0, 4.0), middle + egui::vec2(20.0, 8.0)]);
    wait(&mut window, "the stroke", |w| w.is_settled());
    let begun = Instant::now();
    while sizes(&window) == touch && begun.elapsed() < Duration::from_secs(20) {
        window.step();
    }
    let larger = sizes(&window);
    println!("a touch {touch:?}, a stroke {larger:?}");
    assert_ne!(touch, larger);
    screenshot(&mut window, "parts-brush.png");
    undo(&mut window);
    window.run_steps(3);
    assert_eq!(sizes(&window), touch, "a stroke is one step");
    undo(&mut window);
    assert_eq!(sizes(&window).len(), 0);
    window.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    settle(&mut window);
    assert_eq!(sizes(&window), touch);
    takes(&mut window, "Eraser");
    stroke(&mut window, &[middle]);
    let begun = Instant::now();
    while sizes(&window) == touch && begun.elapsed() < Duration::from_secs(20) {
        window.step();
    }
    assert!(sizes(&window)[0].starts_with("0 mm³"), "{:?}", sizes(&window));
    assert_eq!(changed(&whole, &pixels(&window)), 0, "all bone is shown");
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn scissors_cut_what_is_seen_within_a_line_and_parts_grow_from_seeds() {
    // Fails if a line around a ball misses it or takes the other, what is cut cannot be left out, or painted parts do not share the rest of the bone.
    let (folder, session) = folder("scissors", 0.0);
    let mut window = opened(&session);
    let whole = pixels(&window);
    window.get_by_label("Parts").click();
    window.run_steps(2);
    takes(&mut window, "Scissors");
    let middle = on_screen(&window, [23.0, 16.0, 16.0]);
    let rim = (on_screen(&window, [23.0, 16.0, 21.2]) - middle).length() * 1.25;
    let line: Vec<Pos2> = (0..=24).map(|n| middle + egui::Vec2::angled(n as f32 / 24.0 * std::f32::consts::TAU) * rim).collect();
    stroke(&mut window, &line);
    wait_for(&mut window, "Keep Part 1");
    settle(&mut window);
    let sphere = 4.0 / 3.0 * std::f64::consts::PI * RADII_MM[1].powi(3);
    let mm3: f64 = sizes(&window)[0].split(' ').next().unwrap().parse().unwrap();
    println!("scissors cut {mm3} mm³ of a ball of {sphere:.0} mm³");
    assert!((mm3 / sphere - 1.0).abs() < 0.1, "{mm3}");
    screenshot(&mut window, "parts-scissors.png");
    // Another part for the other ball.
    window.get_by_label("New part").click();
    window.run_steps(2);
    takes(&mut window, "Brush");
    let first = on_screen(&window, [8.0, 16.0, 16.0]);
    stroke(&mut window, &[first]);
    wait_for(&mut window, "Keep Part 2");
    settle(&mut window);
    window.get_by_label("Grow from painted parts").click();
    let large = |window: &Window| sizes(window).iter().filter_map(|s| s.split(' ').next()?.parse::<f64>().ok()).fold(0.0, f64::max);
    let begun = Instant::now();
    while large(&window) < 800.0 && begun.elapsed() < Duration::from_secs(20) {
        window.step();
    }
    println!("grown: {:?}", sizes(&window));
    let all: f64 = sizes(&window).iter().filter_map(|s| s.split(' ').next()?.parse::<f64>().ok()).sum();
    let balls: f64 = RADII_MM.iter().map(|radius| 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3)).sum();
    // Seen askew, the line goes round some of the other ball, too.
    assert!(large(&window) > 800.0 && (all / balls - 1.0).abs() < 0.05, "{all} of {balls}");
    tick(&mut window, "Part 1", true);
    assert!(changed(&whole, &pixels(&window)) > 500);
    window.key_press(Key::Escape);
    window.run_steps(2);
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_stroke_on_the_demo_is_seen_in_the_frame_of_each_touch() {
    // Fails if frames with a touch of the brush take long, or what was painted does not become a step. BREGMA_SIZE=512 for the figures.
    let size = std::env::var("BREGMA_SIZE").ok().and_then(|n| n.parse().ok()).unwrap_or(96);
    let folder = std::env::temp_dir().join(format!("bregma-parting-stroke-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("pair.json");
    let mut opened_pair = Opened::demo(size, &Default::default()).unwrap();
    opened_pair.scene.layers[1].visible = false;
    opened_pair.first_look(1.0);
    opened_pair.scene.mode = Mode::Iso;
    Session::of(&opened_pair, &folder).write(&file).unwrap();
    drop(opened_pair);
    let mut window = opened(&file);
    window.get_by_label("Parts").click();
    window.run_steps(2);
    window.get_by_label("Find islands").click();
    wait_for(&mut window, "Keep Island 1");
    takes(&mut window, "Brush");
    takes(&mut window, "New part");
    // Balls are five voxels in radius at first: of a fine scan some are not worth a figure.
    for _ in 0..if size > 256 { 7 } else { 1 } {
        window.key_press(Key::CloseBracket);
        window.step();
    }
    settle(&mut window);
    let first = on_bone(&window);
    window.event(Event::PointerMoved(first));
    window.run_steps(2);
    press(&window, first, true, PointerButton::Primary);
    window.step();
    let mut frames_ms = vec![];
    for n in 1..=12 {
        window.event(Event::PointerMoved(first + egui::vec2(4.0 * n as f32, 1.5 * n as f32)));
        let begun = Instant::now();
        window.step();
        frames_ms.push(begun.elapsed().as_secs_f64() * 1e3);
    }
    screenshot(&mut window, "parts-stroke.png");
    press(&window, first + egui::vec2(48.0, 18.0), false, PointerButton::Primary);
    let begun = Instant::now();
    window.run_steps(2);
    wait_for(&mut window, "Keep Part");
    let step_ms = begun.elapsed().as_secs_f64() * 1e3;
    frames_ms.sort_by(f64::total_cmp);
    println!(
        "{size}³: a frame with touches {:.1} ms, the slowest {:.1}; a step of undo after {step_ms:.0} ms",
        frames_ms[6], frames_ms[11]
    );
    assert!(frames_ms[6] < 500.0, "{frames_ms:?}");
    settle(&mut window);
    // With something left out, the part's space is cut anew where the stroke was.
    let part = window.query_all_by_label_contains("Keep Part").next().unwrap().accesskit_node().label().unwrap();
    tick(&mut window, part.trim_start_matches("Keep "), true);
    let without = pixels(&window);
    takes(&mut window, "Eraser");
    screenshot(&mut window, "parts-left-out.png");
    undo(&mut window);
    assert!(changed(&without, &pixels(&window)) > 20);
    std::fs::remove_dir_all(folder).unwrap();
}
