//! A sheet of pictures of the window, to be looked at in `tests/out/sheet`: every panel open once, at four sizes.

use super::*;

/// Sizes in points, and pixels of a point.
const SIZES: [([f32; 2], f32); 4] = [([720.0, 480.0], 1.0), ([1280.0, 800.0], 1.0), ([1920.0, 1080.0], 1.0), ([1280.0, 800.0], 2.0)];

/// What is done before the window is looked at, with a name for it; each goes on from the one before.
pub type Step = (&'static str, fn(&mut Window));

const STEPS: [Step; 15] = [
    ("opened", |_| {}),
    ("rays", |window| {
        for shift in [egui::vec2(0.0, 0.0), egui::vec2(-30.0, -25.0), egui::vec2(25.0, -45.0)] {
            let at = on_bone(window) + shift;
            click(window, at);
        }
        open_side(window, "Results");
    }),
    ("landmarks", |window| {
        close_drawers(window);
        window.key_press(Key::L);
        window.run_steps(2);
        for shift in
            [egui::vec2(0.0, 0.0), egui::vec2(-30.0, -25.0), egui::vec2(25.0, -45.0), egui::vec2(10.0, 12.0), egui::vec2(-22.0, 15.0)]
        {
            let at = on_bone(window) + shift;
            click(window, at);
        }
        open_side(window, "Results");
    }),
    ("thickness", |window| {
        command(window, "Thickness map");
        window.get_by_label("Measure the thickness").click();
        wait(window, "the map", |w| w.thickness().is_some());
    }),
    ("registered", |window| {
        window.get_by_label("Show on the surface").click_accesskit();
        command(window, "Register scans");
        window.get_by_label("Fit").click();
        wait_for(window, "Back to where it was");
    }),
    ("by hand", |window| {
        window.get_by_label("Keep this one").scroll_to_me();
        window.run_steps(6);
        window.get_by_label("Keep this one").click();
        window.run_steps(4);
        window.key_press(Key::M);
        window.run_steps(4);
        window.get_by_label("Shift to posterior, a step less").scroll_to_me();
        window.run_steps(6);
        window.get_by_label("Shift to posterior, a step less").click();
    }),
    ("scans", |window| {
        window.key_press(Key::Escape);
        window.run_steps(2);
        (0..3).for_each(|_| undo(window));
        close_drawers(window);
        open_side(window, "Scans");
    }),
    ("cuts", |window| {
        window.get_by_label("Cuts").click_accesskit();
        window.run_steps(8);
        window.get_by_label("Sagittal").click_accesskit();
    }),
    ("slices", |window| {
        command(window, "Picture and slices");
        window.get_by_label("Slices").click_accesskit();
        window.run_steps(8);
        settle(window);
    }),
    ("volume", |window| {
        command(window, "Picture alone");
        window.get_by_role_and_label(Role::RadioButton, "Volume").click_accesskit();
    }),
    ("swipe", |window| {
        window.get_by_role_and_label(Role::RadioButton, "Isosurface").click_accesskit();
        close_drawers(window);
        window.get_by_label("Compare").click();
        window.run_steps(3);
        window.get_by_label("Swipe").click();
    }),
    ("scan", |window| command(window, "Name, spacing")),
    ("picture", |window| command(window, "Save picture")),
    ("commands", |window| {
        // Closes it again.
        command(window, "Save picture");
        window.key_press_modifiers(Modifiers::COMMAND, Key::K);
        window.run_steps(3);
    }),
    ("unsaved", |window| {
        window.key_press(Key::Escape);
        window.run_steps(2);
        command(window, "Open the demo pair");
    }),
];

#[test]
fn sheet() {
    // Fails if a panel cannot be opened at one of the sizes, or a picture does not settle.
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("out/sheet");
    std::fs::create_dir_all(&folder).unwrap();
    for (size, density) in SIZES {
        let builder = Harness::builder().with_size(size).with_pixels_per_point(density).wgpu();
        let mut window: Window = builder.build_eframe(|cc| Workstation::new(cc, Start::Demo, None).preferring(at_once()));
        wait(&mut window, "the demo pair", |w| !w.is_loading());
        settle(&mut window);
        for (n, (name, step)) in STEPS.iter().enumerate() {
            step(&mut window);
            settle(&mut window);
            window.run_steps(3);
            screenshot(&mut window, &format!("sheet/{}x{}@{density}-{n}-{name}.png", size[0], size[1]));
        }
    }
}
