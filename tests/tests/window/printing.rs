//! The picture saved as a file.

use super::*;

/// Types where to save, where there is no dialog of the system's.
pub fn save_to(window: &mut Window, file: &std::path::Path) {
    let begun = Instant::now();
    while window.query_by_label("Path").is_none() {
        window.step();
        assert!(begun.elapsed() < Duration::from_secs(20), "no line to type a path into");
        std::thread::sleep(Duration::from_millis(20));
    }
    window.key_press_modifiers(Modifiers::COMMAND, Key::A);
    window.run_steps(2);
    window.event(Event::Text(file.display().to_string()));
    window.run_steps(2);
    window.key_press(Key::Enter);
    window.run_steps(3);
}

#[test]
fn a_picture_is_saved_in_the_form_and_size_that_are_asked_for() {
    // Fails if the ending does not decide the form, the size on paper is another, what is told is not what is written, or saving holds the window up.
    let folder = std::env::temp_dir().join(format!("bregma-printing-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let mut window = open(Start::Files(vec![bregma_session::Source { file: ball("printing", 40), ..Default::default() }]));
    wait(&mut window, "the scan", |w| !w.is_loading());
    settle(&mut window);
    command(&mut window, "Save picture…");
    window.get_by_label_contains("1004 × 1181 pixels");
    window.get_by_label_contains("no one scale");
    window.key_press(Key::Num5);
    window.run_steps(3);
    window.get_by_label_contains("scale 1.73:1");
    for (name, value) in [("Width on paper", 40.0), ("Height on paper", 30.0), ("Dots in an inch", 127.0)] {
        window.get_by_role_and_label(Role::SpinButton, name).set_value_accesskit(value);
        window.run_steps(2);
    }
    window.get_by_label_contains("200 × 150 pixels, 0.1 MB");
    screenshot(&mut window, "picture.png");
    for (name, begins) in [("a.tif", &b"II*"[..]), ("b.png", b"\x89PNG"), ("c.pdf", b"%PDF"), ("d.svg", b"<svg")] {
        let file = folder.join(name);
        window.get_by_label("Save…").click();
        window.run_steps(2);
        save_to(&mut window, &file);
        wait(&mut window, name, |_| file.exists());
        wait(&mut window, "the button", |_| true);
        window.run_steps(3);
        assert!(std::fs::read(&file).unwrap().starts_with(begins), "{name}");
    }
    let header = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(folder.join("b.png")).unwrap())).read_info().unwrap();
    assert_eq!([header.info().width, header.info().height], [200, 150]);
    assert_eq!(header.info().pixel_dims.unwrap().xppu, 5000);
    let again = bregma_session::print::record::again(&folder.join("d.svg"), bregma_session::Machine::Auto, &Default::default()).unwrap();
    assert!(again.holds(), "{again:?}");
    window.get_by_label("Save…").click();
    save_to(&mut window, &folder.join("e.doc"));
    window.get_by_label_contains("is no picture by its name");
    assert!(!folder.join("e.doc").exists());
    std::fs::remove_dir_all(folder).unwrap();
}
