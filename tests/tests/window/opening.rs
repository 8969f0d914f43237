//! Scans that are opened, in whatever way, and what is asked or told about them.

use super::*;

#[test]
fn a_file_that_cannot_be_read_is_one_line_and_the_window_stays() {
    let file = std::env::temp_dir().join(format!("bregma-window-{}.nrrd", std::process::id()));
    std::fs::write(&file, b"NRRD0004\n").unwrap();
    let source = bregma_session::Source { file: file.clone(), ..Default::default() };
    let mut window = open(Start::Files(vec![source]));
    wait(&mut window, "the error", |w| !w.is_loading());
    window.run_steps(2);
    let name = file.file_name().unwrap().to_string_lossy().into_owned();
    window.get_by_label_contains(&name);
    // It goes by itself, and stays in the list of messages.
    window.run_steps(200);
    assert!(window.query_by_label_contains(&name).is_none());
    command(&mut window, "Messages");
    window.get_by_label_contains(&name);
    window.get_by_label_contains("Drop scans here");
    std::fs::remove_file(&file).unwrap();
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
    close_scan(&mut window, &name);
    assert_eq!(window.state().scene().layers.len(), 1);
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    settle(&mut window);
    assert_eq!(window.state().scene().layers.len(), 2);
    assert_eq!(changed(&both, &pixels(&window)), 0);
    files.iter().for_each(|f| std::fs::remove_file(f).unwrap());
}

#[test]
fn a_spacing_that_no_file_states_is_asked_for() {
    // Fails if a scan opens with made-up millimetres, or if the answer is not used.
    let folder = std::env::temp_dir().join(format!("bregma-asks-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("ball_16x16x16_uint8.raw");
    let ball = |n: usize| [n % 16, n / 16 % 16, n / 256].map(|c| (c as f64 - 7.5).powi(2)).iter().sum::<f64>().sqrt();
    std::fs::write(&file, (0..4096).map(|n| (250.0 - 25.0 * ball(n)).max(0.0) as u8).collect::<Vec<u8>>()).unwrap();
    let mut window = open(Start::Files(vec![bregma_session::Source { file, ..Default::default() }]));
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

#[test]
fn a_file_without_a_header_is_asked_about_with_a_guess_and_a_picture() {
    // Fails if a headerless file cannot be opened by hand, if its guess is wrong, if what is wrong with the answers is not said, or if the result
    // is another than that of --raw.
    let file = std::env::temp_dir().join(format!("bregma-headerless-{}.dat", std::process::id()));
    let away =
        |n: usize| [(n % 32, 15.5), (n / 32 % 32, 15.5), (n / 1024, 11.5)].map(|(c, m)| (c as f64 - m).powi(2)).iter().sum::<f64>().sqrt();
    let value = |n: usize| (1500.0 - 120.0 * away(n)).max(-1000.0) as i16;
    std::fs::write(&file, (0..32 * 32 * 24).flat_map(|n| value(n).to_be_bytes()).collect::<Vec<u8>>()).unwrap();
    let mut window = open(Start::Files(vec![bregma_session::Source { file: file.clone(), ..Default::default() }]));
    wait_for(&mut window, "how do they lie?");
    assert!(!window.get_by_label("Open").accesskit_node().is_disabled(), "the guess fits");
    assert_eq!(
        window.get_by_role_and_label(Role::RadioButton, "16 bits, signed").accesskit_node().toggled(),
        Some(egui::accesskit::Toggled::True)
    );
    screenshot(&mut window, "headerless.png");
    window.get_by_role_and_label(Role::SpinButton, "Slices").set_value_accesskit(25.0);
    window.run_steps(3);
    window.get_by_label_contains("51200 bytes of samples are needed, 49152 are there");
    assert!(window.get_by_label("Open").accesskit_node().is_disabled());
    window.get_by_role_and_label(Role::SpinButton, "Slices").set_value_accesskit(24.0);
    window.run_steps(3);
    window.get_by_label("Open").click();
    wait_for(&mut window, "how far its samples are apart");
    for axis in ["i", "j", "k"] {
        window.get_by_role_and_label(Role::SpinButton, axis).set_value_accesskit(1.0);
        window.step();
    }
    window.get_by_label("Open").click();
    wait(&mut window, "the scan", |w| !w.is_loading());
    let raw = Some("32x32x24,i16,be".parse().unwrap());
    let source = bregma_session::Source { file: file.clone(), raw, spacing_mm: Some(glam::DVec3::ONE), ..Default::default() };
    let by_line = bregma_session::Opened::read(&[source], &Default::default()).unwrap();
    assert_eq!(window.state().volumes()[0].content(), by_line.volumes[0].content());
    std::fs::remove_file(&file).unwrap();
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
    let source = || bregma_session::Source { file: folder.clone(), ..Default::default() };

    // The largest is chosen beforehand.
    let mut window = open(Start::Files(vec![source()]));
    wait_for(&mut window, "holds several series");
    let whole = window.get_by_role_and_label(Role::RadioButton, "The whole  ·  series 7  ·  16 slices");
    assert_eq!(whole.accesskit_node().toggled(), Some(egui::accesskit::Toggled::True));
    window.get_by_label("Open").click();
    wait(&mut window, "the largest series", |w| !w.is_loading());
    settle(&mut window);
    window.get_by_label(&format!("More of {name}#7"));
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
    window.get_by_label(&format!("More of {name}#9"));

    // Refusing is possible, too.
    let mut window =
        open(Start::Files(vec![bregma_session::Source { file: format!("{}#9", folder.display()).into(), ..Default::default() }]));
    wait_for(&mut window, "are not even");
    window.get_by_label("Cancel").click();
    wait(&mut window, "nothing", |w| !w.is_loading());
    window.run_steps(2);
    assert!(window.state().scene().layers.is_empty());
    std::fs::remove_dir_all(folder).unwrap();
}

/// A landmark and a registration as 3D Slicer and ITK write them.
const MARKUPS: &str = r#"{"markups":[{"type":"Fiducial","coordinateSystem":"LPS","controlPoints":[{"label":"glabella","position":[1.0,2.0,3.0],"positionStatus":"defined"},{"label":"nasion","position":[0.0,0.0,0.0],"positionStatus":"undefined"}]}]}"#;
const TRANSFORM: &str = "#Insight Transform File V1.0\n#Transform 0\nTransform: AffineTransform_double_3_3\nParameters: 1 0 0 0 1 0 0 0 1 -5 0 0\nFixedParameters: 0 0 0\n";

#[test]
fn landmarks_and_registrations_are_files_among_the_files_and_one_bad_file_is_named() {
    // Fails if a file of landmarks or a registration cannot be dropped, or one bad file among several keeps the others out.
    let files = [ball("moving", 24), ball("fixed", 32)];
    let named = |name: &str, text: &str| {
        let file = std::env::temp_dir().join(format!("bregma-{}-{name}", std::process::id()));
        std::fs::write(&file, text).unwrap();
        file
    };
    let bad = named("bad.nrrd", "NRRD0004\n");
    let sources = [&files[0], &bad, &files[1]].map(|file| bregma_session::Source { file: file.clone(), ..Default::default() });
    let mut window = open(Start::Files(sources.into()));
    wait(&mut window, "the scans", |w| !w.is_loading());
    window.run_steps(2);
    assert_eq!(window.state().scene().layers.len(), 2);
    window.get_by_label_contains("bad.nrrd");
    assert_eq!(window.state().scene().mode, Mode::Overlay, "two scans open laid over each other");
    let (markups, transform) = (named("points.mrk.json", MARKUPS), named("move.tfm", TRANSFORM));
    drop_file(&mut window, &markups);
    let landmarks = window.state().landmarks();
    assert_eq!((landmarks.len(), landmarks[0].point_mm, landmarks[1].point_mm), (2, Some(glam::dvec3(1.0, 2.0, 3.0)), None));
    drop_file(&mut window, &transform);
    assert_ne!(window.state().scene().layers[1].transform, window.state().scene().layers[0].transform);
    window.get_by_label_contains("was moved as");
    undo(&mut window);
    assert_eq!(window.state().scene().layers[1].transform, window.state().scene().layers[0].transform);
    files.iter().chain([&bad, &markups, &transform]).for_each(|file| std::fs::remove_file(file).unwrap());
}

#[test]
fn the_first_view_fits_the_bone() {
    // Fails if what is seen first is small in its picture, or cut off.
    let mut window = open(Start::Demo);
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    settle(&mut window);
    let picture = window.state().picture().unwrap();
    let (w, h) = (picture.width as usize, picture.height as usize);
    let bone = |x: usize, y: usize| picture.volume_id[y * w + x] != 0;
    let columns: Vec<usize> = (0..w).filter(|x| (0..h).any(|y| bone(*x, y))).collect();
    let rows: Vec<usize> = (0..h).filter(|y| (0..w).any(|x| bone(x, *y))).collect();
    let [across, down] = [(&columns, w), (&rows, h)].map(|(seen, n)| (seen[seen.len() - 1] - seen[0]) as f64 / n as f64);
    println!("bone spans {:.0} % of the width and {:.0} % of the height", 100.0 * across, 100.0 * down);
    assert!(across.max(down) > 0.8 && columns[0] > 0 && rows[0] > 0 && columns[columns.len() - 1] < w - 1 && rows[rows.len() - 1] < h - 1);
}

#[test]
fn a_wide_screen_shows_two_scans_beside_each_other() {
    // Fails if the room of a wide screen is not used, or a session's own way of comparing is not kept.
    let files = [ball("wide-a", 24), ball("wide-b", 24)];
    let sources = files.iter().map(|file| bregma_session::Source { file: file.clone(), ..Default::default() }).collect();
    let builder = Harness::builder().with_size([2100.0, 900.0]).wgpu();
    let mut window: Window = builder.build_eframe(|cc| Workstation::new(cc, Start::Files(sources), None).preferring(at_once()));
    wait(&mut window, "the scans", |w| !w.is_loading());
    settle(&mut window);
    assert_eq!(window.state().compare(), bregma_session::Compare::SideBySide);
    let folder = files[0].parent().unwrap();
    let session = std::env::temp_dir().join(format!("bregma-wide-{}.json", std::process::id()));
    let sources: Vec<_> = files.iter().map(|file| bregma_session::Source { file: file.clone(), ..Default::default() }).collect();
    let opened = bregma_session::Opened::read(&sources, &Default::default()).unwrap();
    bregma_session::Session::of(&opened, folder).write(&session).unwrap();
    let source = bregma_session::Source { file: session.clone(), ..Default::default() };
    let builder = Harness::builder().with_size([2100.0, 900.0]).wgpu();
    let mut window: Window = builder.build_eframe(|cc| Workstation::new(cc, Start::Files(vec![source]), None).preferring(at_once()));
    wait(&mut window, "the session", |w| !w.is_loading());
    assert_eq!(window.state().compare(), bregma_session::Compare::Off);
    files.iter().chain([&session]).for_each(|file| std::fs::remove_file(file).unwrap());
}
