//! That nothing is lost: unsaved work is asked about, kept, and offered again; undo brings back what was looked at and what was open.

use super::*;
use std::path::{Path, PathBuf};

/// A folder of its own for what the program keeps between runs.
fn state(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("bregma-state-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn open_keeping(start: Start, state: &Path) -> Window {
    let state = Some(state.to_owned());
    Harness::builder().with_size([1280.0, 800.0]).wgpu().build_eframe(|cc| Workstation::new(cc, start, state).preferring(at_once()))
}

fn source(file: &Path) -> bregma_session::Source {
    bregma_session::Source { file: file.to_owned(), ..Default::default() }
}

/// Lets the window go on until it is `done`, at its own pace.
fn go_on(window: &mut Window, what: &str, done: impl Fn() -> bool) {
    let begun = Instant::now();
    while !done() {
        window.step();
        assert!(begun.elapsed() < Duration::from_secs(20), "waited in vain for {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// The files of unsaved work in a folder of states.
fn kept(state: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(state.join("unsaved")).into_iter().flatten().flatten();
    entries.map(|entry| entry.path()).filter(|path| path.extension().is_some_and(|e| e == "json")).collect()
}

#[test]
fn work_that_was_not_saved_is_offered_again() {
    // Fails if a run that ends without a word loses its rays, offers them while it lives, or keeps offering what was discarded.
    let (state, file) = (state("left"), ball("left", 24));
    let mut first = open_keeping(Start::Files(vec![source(&file)]), &state);
    wait(&mut first, "the scan", |w| !w.is_loading());
    settle(&mut first);
    assert!(kept(&state).is_empty(), "what was only opened is no work");
    let middle = first.state().picture_rect().unwrap().center();
    click(&mut first, middle);
    go_on(&mut first, "the file", || !kept(&state).is_empty());
    let ray = first.state().difference_ray().unwrap().clone();
    // Another window does not take the work of one that lives.
    let mut second = open_keeping(Start::Files(vec![]), &state);
    second.run_steps(3);
    assert!(second.query_by_label_contains("was not saved").is_none());
    drop(second);
    // The process is killed: nothing runs that could tidy up, and its lock falls.
    drop(first);

    let mut again = open_keeping(Start::Files(vec![]), &state);
    again.run_steps(3);
    again.get_by_label("Work that was not saved");
    screenshot(&mut again, "left-behind.png");
    again.get_by_label("Open it").click();
    wait(&mut again, "the recovered scan", |w| !w.is_loading());
    again.run_steps(2);
    wait(&mut again, "the recovered scan", |w| !w.is_loading() && !w.scene().layers.is_empty());
    settle(&mut again);
    assert_eq!(again.state().difference_ray().map(|r| &r.volumes), Some(&ray.volumes));
    go_on(&mut again, "the new file", || kept(&state).len() == 1);
    // It is unsaved still: leaving asks.
    command(&mut again, "Open the demo");
    again.get_by_label("Save the work?");
    again.get_by_label("Cancel").click();
    again.run_steps(2);
    drop(again);

    let mut last = open_keeping(Start::Files(vec![]), &state);
    last.run_steps(3);
    last.get_by_label("Discard it").click();
    last.run_steps(3);
    assert!(last.query_by_label_contains("was not saved").is_none() && kept(&state).is_empty());
    std::fs::remove_dir_all(&state).unwrap();
    std::fs::remove_file(&file).unwrap();
}

#[test]
fn undo_brings_back_the_view_and_what_was_open() {
    // Fails if opening something else is final, or a turn of the view cannot be taken back.
    let files = [ball("before", 24), ball("after", 32)];
    let mut window = open(Start::Files(vec![source(&files[0])]));
    wait(&mut window, "the scan", |w| !w.is_loading());
    settle(&mut window);
    let first = pixels(&window);
    let rect = window.state().picture_rect().unwrap();
    drag(&mut window, rect.center(), rect.center() + egui::vec2(80.0, 20.0));
    settle(&mut window);
    let turned = pixels(&window);
    assert!(changed(&first, &turned) > 0);
    undo(&mut window);
    assert_eq!(changed(&first, &pixels(&window)), 0);
    window.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    settle(&mut window);
    assert_eq!(changed(&turned, &pixels(&window)), 0);
    drop_file(&mut window, &files[1]);
    assert_eq!(window.state().scene().layers.len(), 2);
    undo(&mut window);
    assert_eq!(window.state().scene().layers.len(), 1);
    assert_eq!(changed(&turned, &pixels(&window)), 0);
    files.iter().for_each(|file| std::fs::remove_file(file).unwrap());
}

#[test]
fn unsaved_work_is_asked_about_and_saved_in_its_place() {
    // Fails if other scans replace unsaved work without a question, if what is saved is asked about, or if the demo pair cannot be saved.
    let (state, folder) = (state("asked"), std::env::temp_dir().join(format!("bregma-asked-{}", std::process::id())));
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("pair.json");
    let opened = bregma_session::Opened::demo(48, &Default::default()).unwrap();
    bregma_session::Session::of(&opened, &folder).write(&file).unwrap();
    let mut window = open_keeping(Start::Files(vec![source(&file)]), &state);
    wait(&mut window, "the session", |w| !w.is_loading());
    settle(&mut window);
    assert_eq!(window.state().scene().layers.len(), 2, "the built-in pair is a session like any other");
    window.get_by_label("pair.json");
    let bone = on_bone(&window);
    click(&mut window, bone);
    window.get_by_label("pair.json •");
    command(&mut window, "Open the demo");
    window.get_by_label("pair.json has changes that are not saved.");
    window.get_by_label("Save").click();
    window.run_steps(2);
    window.get_by_label_contains("Saved");
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    let saved: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&file).unwrap()).unwrap();
    assert_eq!(saved["measurements"].as_array().map(Vec::len), Some(1));
    assert!(kept(&state).is_empty(), "what is saved is kept nowhere else");
    // Nothing was done since: nothing is asked.
    command(&mut window, "Open the demo");
    assert!(window.query_by_label("Save the work?").is_none());
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    // What was opened is listed.
    window.get_by_label("File").click();
    window.run_steps(3);
    window.get_by_label_contains("Open recent").click();
    window.run_steps(4);
    window.get_by_label("pair.json");
    std::fs::remove_dir_all(&state).unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
}
