//! Two scans compared in slices, by scans that are told apart by every value.

use super::looking::compare_by;
use super::*;
use bregma_renderer::{BodyPlane, Named, Picture};

/// A cube of 24 samples a side of the values `low` and `high` by turns in its layers, as an NRRD file.
fn cube(name: &str, [low, high]: [u8; 2]) -> std::path::PathBuf {
    let file = std::env::temp_dir().join(format!("bregma-compared-{}-{name}.nrrd", std::process::id()));
    let mut bytes = b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 24 24 24\nspacings: 1 1 1\nencoding: raw\n\n".to_vec();
    bytes.extend((0..24 * 24 * 24).map(|n| if n / 24 % 4 < 2 { low } else { high }));
    std::fs::write(&file, bytes).unwrap();
    file
}

/// Holds each value of a slice to the scan that `is_second` says is there. Gives how many of the first and the second were seen.
fn count(picture: &Picture, is_second: impl Fn(u32, u32) -> bool) -> [usize; 2] {
    let mut seen = [0; 2];
    assert_eq!(picture.values.len(), (picture.width * picture.height) as usize);
    for (n, value) in picture.values.iter().enumerate().filter(|(_, value)| value.is_finite()) {
        let (x, y) = (n as u32 % picture.width, n as u32 / picture.width);
        let second = is_second(x, y);
        // The first holds 0 to 60, the second 100 to 200.
        assert_eq!(*value >= 100.0, second, "{value} at {x}, {y}");
        // Rounding of what lies between equal samples.
        assert!(second || *value <= 60.001, "{value}");
        seen[usize::from(second)] += 1;
    }
    seen
}

#[test]
fn slices_compare_two_scans_as_the_picture_does() {
    // Fails if a side of the line, a square, a turn or a half holds the other scan's values, the line is not where the picture's is, a plane is left
    // out, or a click in the right half takes another place than one in the left.
    let files = [cube("a", [0, 60]), cube("b", [100, 200])];
    let sources = files.iter().map(|file| bregma_session::Source { file: file.clone(), ..Default::default() }).collect();
    let builder = Harness::builder().with_size([1280.0, 800.0]).wgpu();
    let mut window: Window = builder.build_eframe(|cc| Workstation::new(cc, Start::Files(sources), None));
    wait(&mut window, "the scans", |w| !w.is_loading());
    settle(&mut window);
    command(&mut window, "Picture and slices");
    compare_by(&mut window, "Swipe");
    let (line, rect) = (rect_of(&window, "Swipe line").center(), window.state().picture_rect().unwrap());
    drag(&mut window, line, line - egui::vec2(rect.width() * 0.1, 0.0));
    settle(&mut window);
    let bregma_session::Compare::Swipe { part } = window.state().compare() else { panic!("no swipe") };
    assert!((part - 0.4).abs() < 0.01, "{part}");
    for &plane in BodyPlane::ALL {
        let picture = window.state().slice(plane).unwrap().0;
        let line = (part * f64::from(picture.width)).round() as u32;
        let [first, second] = count(picture, |x, _| x >= line);
        assert!(first > 1000 && second > first, "{plane:?}: {first} {second}");
    }
    screenshot(&mut window, "slices-swipe.png");
    compare_by(&mut window, "Checkerboard");
    for &plane in BodyPlane::ALL {
        let picture = window.state().slice(plane).unwrap().0;
        let [first, second] = count(picture, |x, y| (x / 64 + y / 64) % 2 == 1);
        assert!(first > 1000 && second > 1000, "{plane:?}: {first} {second}");
    }
    compare_by(&mut window, "Flicker");
    for &plane in BodyPlane::ALL {
        let mut turns = [0; 2];
        for _ in 0..12 {
            window.run_steps(1);
            let picture = window.state().slice(plane).unwrap().0;
            let second = picture.values.iter().any(|value| *value >= 100.0);
            assert!(count(picture, |_, _| second)[usize::from(second)] > 1000);
            turns[usize::from(second)] += 1;
        }
        assert!(turns[0] > 0 && turns[1] > 0, "{plane:?}: each by turns, {turns:?}");
    }
    compare_by(&mut window, "Side by side");
    for &plane in BodyPlane::ALL {
        let picture = window.state().slice(plane).unwrap().0;
        let [first, second] = count(picture, |x, _| x >= picture.width / 2);
        assert!(first > 1000 && second > 1000, "{plane:?}: {first} {second}");
    }
    screenshot(&mut window, "slices-side.png");
    // The same place in both halves.
    let rect = window.state().slice(BodyPlane::Axial).unwrap().1;
    let mut places = vec![];
    for [x, y] in [[0.2, 0.4], [0.3, 0.6], [0.7, 0.4]] {
        click(&mut window, rect.min + egui::vec2(rect.width() * x, rect.height() * y));
        settle(&mut window);
        // Long enough that the next click is no double one.
        window.run_steps(20);
        places.push(window.state().slices().at_mm);
    }
    assert!(places[0].distance(places[2]) < 0.1 && places[0].distance(places[1]) > 1.0, "{places:?}");
    files.iter().for_each(|file| std::fs::remove_file(file).unwrap());
}
