//! That everything can be read, whatever the window's size, and that nothing moves between two clicks.

use super::sheet::Step;
use super::*;
use egui::epaint::{ClippedShape, Shape, TextShape};
use egui::{Rect, Vec2};

/// A text on the screen.
#[derive(Debug)]
struct Seen {
    text: String,
    /// All of it, and what of it is not cut off.
    whole: Rect,
    visible: Rect,
    is_elided: bool,
    /// It lies on the picture, where marks may meet.
    is_mark: bool,
}

/// What is opaque hides what was painted before it.
fn cover(shape: &Shape, clip: Rect, seen: &mut Vec<Seen>, picture: Rect) {
    match shape {
        Shape::Vec(shapes) => shapes.iter().for_each(|shape| cover(shape, clip, seen, picture)),
        Shape::Rect(rect) if rect.fill.is_opaque() => {
            let hides = rect.rect.intersect(clip);
            seen.retain(|text| !hides.expand(0.5).contains_rect(text.visible));
            // What is half hidden is seen as far as it is not: a mark, or whatever lies behind a panel over the window.
            let is_panel = rect.rect.width() > 200.0 && rect.rect.height() > 100.0;
            let is_behind = |text: &&mut Seen| (text.is_mark || is_panel) && hides.intersects(text.visible);
            seen.iter_mut().filter(is_behind).for_each(|text| text.visible = Rect::NOTHING);
        }
        Shape::Text(TextShape { pos, galley, angle, .. }) if *angle == 0.0 && !galley.text().trim().is_empty() => {
            let is_mark = picture.expand(1.0).contains_rect(clip) && picture.height() - clip.height() < 20.0;
            for row in &galley.rows {
                let (Some(first), Some(last)) = (row.glyphs.first(), row.glyphs.last()) else { continue };
                // A text that begins beside something else is indented in its first row.
                let x = row.pos.x + first.pos.x..=row.pos.x + last.pos.x + last.advance_width;
                let whole = Rect::from_x_y_ranges(x, row.rect().y_range()).translate(pos.to_vec2());
                let visible = whole.intersect(clip);
                // A text with a dark edge is painted several times.
                let text = row.text();
                let is_again = seen.iter().any(|s| s.text == text && s.whole.center().distance(whole.center()) < 3.0);
                if visible.is_positive() && !is_again {
                    seen.push(Seen { text, whole, visible, is_elided: galley.elided, is_mark });
                }
            }
        }
        _ => {}
    }
}

/// What is wrong with the texts of the frame on the screen.
fn faults(window: &Window) -> Vec<String> {
    // Where nothing is open yet there is none.
    let picture = window.state().picture_rect().unwrap_or(Rect::NOTHING);
    let mut seen = vec![];
    for ClippedShape { clip_rect, shape, .. } in &window.output().shapes {
        cover(shape, *clip_rect, &mut seen, picture);
    }
    assert!(seen.len() > 10, "{} texts", seen.len());
    let mut faults = vec![];
    for (n, a) in seen.iter().enumerate() {
        // Above and below, what scrolls is cut; left and right nothing is.
        if a.visible.is_positive() && !a.is_mark && a.visible.width() < a.whole.width() - 1.5 && !a.is_elided {
            faults.push(format!("{:?} is cut off: {:.0} of {:.0} points", a.text, a.visible.width(), a.whole.width()));
        }
        for b in &seen[n + 1..] {
            // Lines of one text may touch.
            let both = a.visible.shrink2(Vec2::new(1.0, 3.0)).intersect(b.visible.shrink2(Vec2::new(1.0, 3.0)));
            if both.is_positive() && !(a.is_mark && b.is_mark) {
                faults.push(format!("{:?} and {:?} lie over each other at {both:?}", a.text, b.text));
            }
        }
    }
    faults
}

const LONG: [&str; 2] = [
    "Homo sapiens, female, left temporal bone, second reconstruction 2023-04-17",
    "Pan troglodytes verus ZMB 83623 adult male, cranium and mandible",
];

fn scroll_and_click(window: &mut Window, label: &str) {
    window.get_by_label(label).scroll_to_me();
    window.run_steps(6);
    window.get_by_label(label).click();
    window.run_steps(6);
}

/// What is open one after the other.
const STEPS: [Step; 17] = [
    ("rays", |window| open_side(window, "Results")),
    ("who is inside where", |window| window.get_by_label("Who is inside where").click_accesskit()),
    ("landmarks", |window| window.get_by_label_contains("Landmarks (").click()),
    ("thickness", |window| window.get_by_label("Thickness").click()),
    ("differences", |window| window.get_by_label("Differences").click()),
    ("register by landmarks", |window| {
        window.get_by_label("Register").click();
        window.run_steps(4);
        window.get_by_role_and_label(Role::RadioButton, "By landmarks").click();
    }),
    ("parts", |window| {
        window.get_by_role_and_label(Role::RadioButton, "By surfaces").click();
        window.run_steps(4);
        window.get_by_label("Only a part…").click();
    }),
    ("registered", |window| {
        window.get_by_label("Delete part 1").click();
        window.run_steps(4);
        window.get_by_label("Fit").click();
        wait_for(window, "Back to where it was");
    }),
    ("kept", |window| scroll_and_click(window, "Keep this one")),
    ("by hand", |window| {
        scroll_and_click(window, "Move by hand");
        scroll_and_click(window, "Shift to posterior, a step less");
    }),
    ("two registrations", |window| {
        scroll_and_click(window, "Keep this one");
        window.get_by_label("Second registration").scroll_to_me();
        window.run_steps(6);
        scroll_and_click(window, "Move by hand");
        window.get_by_label("Second registration").scroll_to_me();
    }),
    ("upright", |window| command(window, "Hold upright")),
    ("scans", |window| {
        window.get_by_label("Close window").click();
        close_drawers(window);
        open_side(window, "Scans");
        window.get_by_label("Light").click_accesskit();
    }),
    ("cuts", |window| {
        window.get_by_label("Cuts").click_accesskit();
        window.run_steps(8);
        for cut in ["Sagittal", "Box", "Cylinder"] {
            window.get_by_label(cut).click_accesskit();
            window.run_steps(2);
        }
    }),
    ("faces of cuts", |window| window.get_by_label("The cut shows").scroll_to_me()),
    ("volume", |window| window.get_by_role_and_label(Role::RadioButton, "Volume").click_accesskit()),
    ("a scan", |window| command(window, "Name, spacing")),
];

#[test]
fn no_text_lies_over_another_or_is_cut_off_at_any_size() {
    // Fails if a panel is too narrow for what it says, two texts share a place, or a long name pushes something out of sight.
    let files = LONG.map(|name| ball(name, 32));
    let mut all = vec![];
    for ([w, h], density) in [([720.0, 480.0], 1.0), ([1280.0, 800.0], 1.0), ([1920.0, 1080.0], 1.0), ([1280.0, 800.0], 2.0)] {
        let sources = files.iter().map(|file| bregma_session::Source { file: file.clone(), ..Default::default() }).collect();
        let builder = Harness::builder().with_size([w, h]).with_pixels_per_point(density).wgpu();
        let mut window: Window = builder.build_eframe(|cc| Workstation::new(cc, Start::Files(sources), None).preferring(at_once()));
        wait(&mut window, "the scans", |w| !w.is_loading());
        settle(&mut window);
        let middle = window.state().picture_rect().unwrap().center();
        for shift in [0.0, 12.0, 24.0] {
            click(&mut window, middle + egui::vec2(shift, 5.0));
        }
        window.key_press(Key::L);
        window.run_steps(2);
        for n in 0..5 {
            click(&mut window, middle + egui::vec2(14.0 * n as f32 - 28.0, -20.0));
        }
        assert_eq!(window.state().landmarks().len(), 5);
        // Those of the rays are what is shown first.
        window.key_press(Key::R);
        window.run_steps(2);
        for (name, step) in STEPS {
            step(&mut window);
            window.run_steps(8);
            all.extend(faults(&window).into_iter().map(|fault| format!("{w}×{h}@{density} {name}: {fault}")));
        }
    }
    files.iter().for_each(|file| std::fs::remove_file(file).unwrap());
    // Two heads, through both walls of which a ray goes: all columns have their longest numbers.
    let mut window = open(Start::Demo);
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    settle(&mut window);
    let bone = on_bone(&window) - egui::vec2(0.0, 60.0);
    click(&mut window, bone);
    window.run_steps(8);
    all.extend(faults(&window).into_iter().map(|fault| format!("two heads: {fault}")));
    assert!(all.is_empty(), "{} faults\n{}", all.len(), all.join("\n"));
}

#[test]
fn what_is_asked_about_a_headerless_file_can_be_read_at_any_size() {
    // Fails if the guesses, the fields or the sentence about what is wrong with them are cut off, or leave the window.
    let file = std::env::temp_dir().join(format!("{} {}.dat", LONG[0], std::process::id()));
    let away = |n: usize| {
        [(n % 100, 49.5), (n / 100 % 100, 49.5), (n / 10_000, 19.5)].map(|(c, m)| (c as f64 - m).powi(2)).iter().sum::<f64>().sqrt()
    };
    let header = [b' '; 512].into_iter();
    let samples = (0..400_000).flat_map(|n| ((1500.0 - 40.0 * away(n)).max(-1000.0) as f32).to_le_bytes());
    std::fs::write(&file, header.chain(samples).collect::<Vec<u8>>()).unwrap();
    let mut all = vec![];
    for ([w, h], density) in [([720.0, 480.0], 1.0), ([1280.0, 800.0], 1.0), ([1280.0, 800.0], 2.0)] {
        let sources = vec![bregma_session::Source { file: file.clone(), ..Default::default() }];
        let builder = Harness::builder().with_size([w, h]).with_pixels_per_point(density).wgpu();
        let mut window: Window = builder.build_eframe(|cc| Workstation::new(cc, Start::Files(sources), None).preferring(at_once()));
        wait_for(&mut window, "how do they lie?");
        for slices in [40.0, 41.0] {
            window.get_by_role_and_label(Role::SpinButton, "Slices").set_value_accesskit(slices);
            window.run_steps(4);
            let screen = Rect::from_min_size(Pos2::ZERO, egui::vec2(w, h));
            assert!(screen.contains_rect(rect_of(&window, "Open")) && screen.contains_rect(rect_of(&window, "Cancel")), "{w}×{h}");
            all.extend(faults(&window).into_iter().map(|fault| format!("{w}×{h}@{density} {slices}: {fault}")));
        }
        screenshot(&mut window, &format!("headerless-{w}x{h}@{density}.png"));
    }
    std::fs::remove_file(&file).unwrap();
    assert!(all.is_empty(), "{} faults\n{}", all.len(), all.join("\n"));
}

#[test]
fn the_picture_stays_where_it_is_whatever_is_measured_or_said() {
    // Fails if a ray, a message or a landmark moves the picture under the next click.
    let mut window = open(Start::Demo);
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    settle(&mut window);
    let rect = window.state().picture_rect().unwrap();
    let bone = on_bone(&window);
    // One that misses says so, one that meets bone fills the results.
    for at in [rect.min + egui::vec2(20.0, 20.0), bone] {
        click(&mut window, at);
        assert_eq!(window.state().picture_rect(), Some(rect));
    }
    window.get_by_label_contains("No bone there");
    window.key_press(Key::T);
    window.run_steps(2);
    for at in [bone, bone - egui::vec2(0.0, 30.0)] {
        click(&mut window, at);
        assert_eq!(window.state().picture_rect(), Some(rect));
    }
    // What it said goes by itself.
    window.run_steps(80);
    assert!(window.query_by_label_contains("No bone there").is_none());
}

#[test]
fn a_click_that_closes_a_menu_or_a_colour_casts_no_ray() {
    // Fails if the click beside a menu, a colour or a chooser over the bone also measures.
    let mut window = open(Start::Demo);
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    settle(&mut window);
    let bone = on_bone(&window);
    for opener in ["View", "Colour of skull A", "Compare", "More of skull A"] {
        window.get_by_label(opener).click();
        window.run_steps(4);
        click(&mut window, bone);
        assert!(window.state().difference_ray().is_none(), "{opener}");
        window.run_steps(2);
    }
    click(&mut window, bone);
    assert!(window.state().difference_ray().is_some());
}

#[test]
fn every_command_is_found_by_its_name_and_says_why_it_cannot_be_done() {
    // Fails if the list of commands does not search, is not left by Escape, or does something that is not allowed.
    let mut window = open(Start::Files(vec![]));
    window.run_steps(2);
    window.key_press_modifiers(Modifiers::COMMAND, Key::K);
    window.run_steps(3);
    window.event(Event::Text("SESSION save".into()));
    window.run_steps(3);
    assert!(window.query_by_label_contains("Save session as").is_some() && window.query_by_label_contains("Redo").is_none());
    let found: Vec<_> = window.query_all_by_label_contains("Save session").collect();
    assert!(found.len() == 2 && found.iter().all(|command| command.accesskit_node().is_disabled()));
    drop(found);
    window.key_press(Key::Enter);
    window.run_steps(3);
    assert!(window.query_by_label("Search the commands").is_some(), "what cannot be done is not done");
    window.key_press(Key::Escape);
    window.run_steps(3);
    assert!(window.query_by_label("Search the commands").is_none());
}
