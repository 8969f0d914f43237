//! Tasks as the guide lists them, with the clicks and keys that each takes.

use super::*;
use bregma_renderer::{BodyPlane, Reconstruction};
use bregma_session::{Compare, Layout};

/// A hand that is counted.
struct Hand {
    window: Window,
    clicks: u32,
    keys: u32,
}

impl Hand {
    fn key(&mut self, key: Key) {
        self.keys += 1;
        self.window.key_press(key);
        self.window.run_steps(3);
        settle(&mut self.window);
    }

    /// Opens something by typing a part of its name into the list of commands.
    fn named(&mut self, name: &str) {
        self.keys += 2 + name.len() as u32;
        command(&mut self.window, name);
    }

    fn click(&mut self, role: Role, label: &str) {
        self.clicks += 1;
        choose(&mut self.window, role, label);
    }

    fn click_at(&mut self, at: Pos2) {
        self.clicks += 1;
        click(&mut self.window, at);
        self.window.run_steps(3);
        settle(&mut self.window);
    }

    /// The task is done, by no more than the guide says.
    fn done(&mut self, number: u32, what: &str, is_done: bool, keys: u32, clicks: u32) {
        println!("task {number}, {what}: {} keys, {} clicks", self.keys, self.clicks);
        assert!(is_done, "task {number}: {what} is not done");
        assert!((self.keys, self.clicks) == (keys, clicks), "task {number} took {} keys and {} clicks", self.keys, self.clicks);
        (self.keys, self.clicks) = (0, 0);
    }
}

#[test]
fn tasks_take_as_many_clicks_as_the_guide_says() {
    // Fails if something that one does every day takes more steps than before, or cannot be done.
    let mut window = open(Start::Demo);
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    settle(&mut window);
    let mut hand = Hand { window, clicks: 0, keys: 0 };

    let mode = hand.window.state().scene().mode;
    hand.done(9, "what agrees", mode == Mode::Overlay && hand.window.state().scene().agree_within_mm.is_none(), 0, 0);
    hand.click(Role::RadioButton, "Depths");
    let mode = hand.window.state().scene().mode;
    hand.done(8, "how far apart", mode == Mode::Depths, 0, 1);
    hand.click(Role::CheckBox, "Shadows");
    let shadows = hand.window.state().scene().shadows;
    hand.done(15, "shadows", shadows, 0, 1);
    hand.click(Role::RadioButton, "Isosurface");
    hand.click(Role::CheckBox, "Samples");
    let reconstruction = hand.window.state().scene().reconstruction;
    hand.done(14, "voxels as they are", reconstruction == Reconstruction::Nearest, 0, 2);
    choose(&mut hand.window, Role::CheckBox, "Samples");
    choose(&mut hand.window, Role::CheckBox, "Shadows");
    choose(&mut hand.window, Role::RadioButton, "Overlay");

    let middle = hand.window.state().picture_rect().unwrap().center();
    hand.click_at(middle + egui::vec2(20.0, -140.0));
    let differs = hand
        .window
        .state()
        .difference_ray()
        .is_some_and(|ray| ray.pairs.iter().flat_map(|p| &p.differences).any(|d| d.uncertainty.error_mm > 0.0));
    hand.done(6, "how thick, and is it sure", differs, 0, 1);
    hand.key(Key::N);
    hand.click_at(middle + egui::vec2(20.0, -120.0));
    let rays = hand.window.query_all_by_label_contains("Ray 2").count();
    hand.done(7, "along the normal", rays > 0, 1, 1);

    hand.key(Key::Num4);
    let forward = hand.window.state().scene().camera.basis().forward;
    hand.done(1, "from the right", forward.x > 0.999, 1, 0);
    hand.key(Key::S);
    let layout = hand.window.state().slices().layout;
    hand.done(2, "three slices", layout == Layout::All, 1, 0);
    hand.key(Key::C);
    (hand.keys, hand.clicks) = (0, 0);
    hand.key(Key::S);
    // Right on the middle of the axial slice lies the midline of a skull that stands upright in its scan.
    let axial = hand.window.state().slice(BodyPlane::Axial).unwrap().1;
    hand.click_at(axial.center() + egui::vec2(0.0, 12.0));
    let (picture, _) = hand.window.state().slice(BodyPlane::Sagittal).unwrap();
    let contours = picture.contours.iter().filter(|contour| contour.segments.len() > 100).count();
    let is_middle = hand.window.state().slices().at_mm.x.abs() < 3.0;
    hand.done(3, "mid-sagittal contours of both", contours == 2 && is_middle, 1, 1);
    hand.window.event(Event::PointerMoved(axial.center()));
    hand.window.run_steps(3);
    let told = hand.window.state().under();
    hand.done(4, "the value of a place", told.contains("HU"), 0, 0);
    hand.key(Key::C);
    (hand.keys, hand.clicks) = (0, 0);
    hand.key(Key::F11);
    let rect = hand.window.state().picture_rect().unwrap();
    hand.done(20, "nothing but the picture", rect.size() == egui::vec2(1280.0, 800.0), 1, 0);
    hand.key(Key::F11);
    (hand.keys, hand.clicks) = (0, 2);
    hand.window.get_by_label("Compare").click();
    hand.window.run_steps(3);
    hand.window.get_by_label("Side by side").click();
    hand.window.run_steps(3);
    settle(&mut hand.window);
    let compare = hand.window.state().compare();
    hand.done(10, "beside each other", compare == Compare::SideBySide, 0, 2);
}

#[test]
fn pictures_and_films_take_as_many_clicks_as_the_guide_says() {
    // Fails if light, a film of views, or one of what a hand does takes more steps than before, or cannot be had.
    let source = bregma_session::Source { file: ball("tasks", 40), ..Default::default() };
    let mut window = open(Start::Files(vec![source]));
    wait(&mut window, "the scan", |w| !w.is_loading());
    settle(&mut window);
    let mut hand = Hand { window, clicks: 0, keys: 0 };
    hand.keys += 1;
    hand.window.key_press_modifiers(Modifiers::COMMAND, Key::P);
    hand.window.run_steps(3);
    hand.click(Role::RadioButton, "Museum");
    wait(&mut hand.window, "light", |w| w.exposed().is_some());
    hand.done(22, "the view in museum light", true, 1, 1);
    choose(&mut hand.window, Role::RadioButton, "No studio");
    hand.window.key_press_modifiers(Modifiers::COMMAND, Key::P);
    hand.window.run_steps(3);

    hand.named("film");
    hand.click(Role::RadioButton, "Keys");
    hand.click(Role::Button, "Add what is seen as a key");
    hand.key(Key::Num4);
    hand.click(Role::Button, "Add what is seen as a key");
    let is_film = hand.window.state().film().is_some_and(|film| film.keys.len() == 2 && film.seconds > 0.0);
    hand.done(23, "a film from one view to another", is_film, 7, 3);
    hand.window.key_press(Key::Escape);
    command(&mut hand.window, "film");
    (hand.keys, hand.clicks) = (0, 0);

    hand.named("film");
    hand.click(Role::Button, "Record");
    let from = hand.window.state().picture_rect().unwrap().center() + egui::vec2(0.0, 240.0);
    hand.clicks += 1;
    drag(&mut hand.window, from, from + egui::vec2(120.0, 0.0));
    hand.click(Role::Button, "Stop recording");
    let is_film = hand.window.state().film().is_some_and(|film| film.turns.is_none() && film.keys.len() > 1);
    hand.done(24, "a film of what a hand does", is_film, 6, 3);
    hand.clicks += 1;
    // What plays does not settle.
    hand.window.get_by_label("Preview").click();
    hand.window.run_steps(3);
    let plays = hand.window.state().shown().unwrap().camera != hand.window.state().scene().camera;
    hand.done(25, "see it before it is saved", plays, 0, 1);
}

#[test]
fn whether_a_bone_is_thicker_is_answered_from_two_files() {
    // Fails if the answer takes more than the guide says, is another than the phantom's, or does not say how sure it is. The files are chosen in the
    // desktop's own dialog, by three clicks more.
    let begun = Instant::now();
    let mut window = open(Start::Files(differing::small_pair("thicker", 96)));
    wait(&mut window, "the pair", |w| !w.is_loading());
    settle(&mut window);
    let mut hand = Hand { window, clicks: 3, keys: 0 };
    hand.click(Role::Button, "Register");
    hand.clicks += 1;
    hand.window.get_by_label("Fit").click();
    let lie = |w: &Workstation| w.scene().layers.iter().map(|layer| layer.transform).collect::<Vec<_>>();
    let before = lie(hand.window.state());
    wait(&mut hand.window, "the fit", |w| lie(w) != before);
    settle(&mut hand.window);
    hand.key(Key::L);
    // The middle of the frontal bone.
    let (picture, rect) = (hand.window.state().picture().unwrap(), hand.window.state().picture_rect().unwrap());
    let at = hand.window.state().scene().camera.project(
        bregma_field::WorldPoint(glam::DVec3::new(0.0, -90.0, 20.0)),
        picture.width,
        picture.height,
    );
    let at = rect.min + egui::vec2(at.unwrap().0 as f32, at.unwrap().1 as f32);
    hand.click_at(at);
    hand.click(Role::Button, "Differences");
    hand.click(Role::RadioButton, "Thickness");
    hand.click(Role::RadioButton, "Around a landmark");
    hand.clicks += 1;
    hand.window.get_by_label("Measure the difference").click();
    wait(&mut hand.window, "the difference", |w| w.differences().is_some());
    settle(&mut hand.window);
    let half = &hand.window.state().differences().unwrap().halves[0];
    let s = half.statistics.as_ref().unwrap();
    println!(
        "thicker by {:.2} ± {:.2} mm, sure on {:.0} % of the place; {:.1} s",
        s.mean_mm,
        s.mean_uncertainty.error_mm,
        100.0 * s.sure,
        begun.elapsed().as_secs_f64()
    );
    // 3.5 mm in the middle of the bone, less around.
    let is_right = s.mean_mm > 1.5 && s.mean_mm < 3.6 && s.mean_mm > s.mean_uncertainty.error_mm && s.sure > 0.5 && !s.extremes.is_empty();
    screenshot(&mut hand.window, "thicker.png");
    hand.done(21, "is the frontal bone thicker", is_right, 1, 10);
    assert!(begun.elapsed() < Duration::from_secs(180));
}
