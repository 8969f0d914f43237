//! The view by hand: standard views, zoom at the mouse, keys, the free ball.

use super::*;
use bregma_renderer::{Camera, Projection};
use glam::DVec3;

pub fn demo() -> Window {
    let mut window = open(Start::Demo);
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    settle(&mut window);
    window
}

fn camera(window: &Window) -> Camera {
    window.state().scene().camera
}

pub fn wheel(window: &mut Window, at: Pos2, lines: f32, modifiers: Modifiers) {
    window.event(Event::PointerMoved(at));
    let delta = egui::vec2(0.0, lines);
    let (unit, source, phase) = (egui::MouseWheelUnit::Line, egui::MouseWheelSource::Wheel, egui::TouchPhase::Move);
    window.event_modifiers(Event::MouseWheel { unit, delta, source, phase, modifiers }, modifiers);
    // The wheel's way is spread over some frames.
    window.run_steps(40);
}

/// Where a point of the world is on the screen.
pub fn on_screen(window: &Window, point_mm: DVec3) -> Pos2 {
    let rect = window.state().picture_rect().unwrap();
    let (w, h) = (rect.width(), rect.height());
    let (x, y) = camera(window).project(bregma_field::WorldPoint(point_mm), w as u32, h as u32).unwrap();
    rect.min + egui::vec2(x as f32 + 0.5, y as f32 + 0.5)
}

#[test]
fn six_norms_are_reached_by_keys_and_by_their_latin_names() {
    // Fails if a view looks from another side, is upside down or mirrored, or has no key or no name.
    let mut window = demo();
    let norms = [
        (Key::Num1, "norma frontalis", DVec3::Y, DVec3::Z),
        (Key::Num2, "norma occipitalis", DVec3::NEG_Y, DVec3::Z),
        (Key::Num3, "lateralis sinistra", DVec3::NEG_X, DVec3::Z),
        (Key::Num4, "lateralis dextra", DVec3::X, DVec3::Z),
        // From above and from below the face is up.
        (Key::Num7, "norma verticalis", DVec3::NEG_Z, DVec3::NEG_Y),
        (Key::Num8, "norma basilaris", DVec3::Z, DVec3::NEG_Y),
    ];
    let looks = |window: &Window, forward: DVec3, up: DVec3| {
        let basis = camera(window).basis();
        basis.forward.dot(forward) > 0.999_999 && basis.up.dot(up) > 0.999_999
    };
    let first = camera(&window);
    for (key, _, forward, up) in norms {
        window.key_press(key);
        window.run_steps(2);
        assert!(looks(&window, forward, up), "{key:?}: {:?}", camera(&window).basis());
    }
    undo(&mut window);
    assert_eq!(camera(&window), first, "looking around is one step");
    for (_, name, forward, up) in norms {
        command(&mut window, name);
        assert!(looks(&window, forward, up), "{name}");
    }
    // While a name is typed, digits are its.
    let before = camera(&window);
    window.key_press_modifiers(Modifiers::COMMAND, Key::K);
    window.run_steps(3);
    window.key_press(Key::Num1);
    window.key_press(Key::ArrowLeft);
    window.key_press(Key::Escape);
    window.run_steps(3);
    assert_eq!(camera(&window), before);
}

#[test]
fn the_wheel_zooms_at_the_bone_under_the_mouse() {
    // Fails if the bone under the mouse moves away from it, in either projection, or the wheel is not undone.
    let mut window = demo();
    window.key_press(Key::Num1);
    for key in [Key::Num1, Key::Num5] {
        window.key_press(key);
        window.run_steps(2);
        settle(&mut window);
        let at = on_bone(&window) + egui::vec2(40.0, -60.0);
        // What the click measures there begins at the bone.
        click(&mut window, at);
        let ray = window.state().difference_ray().expect("bone under the mouse").ray;
        undo(&mut window);
        let bone_mm = DVec3::from(ray.origin_mm) + 5.0 * DVec3::from(ray.direction);
        let (before, place) = (camera(&window), on_screen(&window, bone_mm));
        assert!(place.distance(at) < 1.0, "{place} {at}");
        wheel(&mut window, at, 3.0, Modifiers::NONE);
        settle(&mut window);
        let size = |camera: &Camera| match camera.projection {
            Projection::Perspective { .. } => camera.eye_mm.distance(camera.target_mm),
            Projection::Orthographic { height_mm } => height_mm,
        };
        assert!(size(&camera(&window)) < 0.8 * size(&before));
        assert!(on_screen(&window, bone_mm).distance(place) < 0.5, "{} {place}", on_screen(&window, bone_mm));
        assert!(camera(&window).target_mm.distance(before.target_mm) > 1.0, "not the middle");
    }
}

#[test]
fn arrows_turn_by_five_degrees_shift_moves_and_plus_and_minus_zoom() {
    // Fails if a key turns by another angle, moves what it should turn, or a pair of keys does not lead back.
    let mut window = demo();
    window.key_press(Key::Num1);
    window.run_steps(2);
    let first = camera(&window);
    let same =
        |window: &Window| camera(window).eye_mm.distance(first.eye_mm) < 1e-6 && camera(window).target_mm.distance(first.target_mm) < 1e-6;
    for (there, back) in [(Key::ArrowLeft, Key::ArrowRight), (Key::ArrowUp, Key::ArrowDown)] {
        window.key_press(there);
        window.run_steps(2);
        let turned = camera(&window).basis().forward.angle_between(first.basis().forward).to_degrees();
        assert!((turned - 5.0).abs() < 1e-6 && camera(&window).target_mm == first.target_mm, "{there:?}: {turned}");
        window.key_press(back);
        window.run_steps(2);
        assert!(same(&window), "{back:?}");
        window.key_press_modifiers(Modifiers::SHIFT, there);
        window.run_steps(2);
        assert!(camera(&window).target_mm.distance(first.target_mm) > 1.0 && camera(&window).basis().forward.dot(DVec3::Y) > 0.999_999);
        window.key_press_modifiers(Modifiers::SHIFT, back);
        window.run_steps(2);
        assert!(same(&window));
    }
    window.key_press(Key::Plus);
    window.run_steps(2);
    let nearer = camera(&window).eye_mm.distance(first.target_mm);
    assert!(nearer < 0.95 * first.eye_mm.distance(first.target_mm));
    window.key_press(Key::Minus);
    window.run_steps(2);
    assert!(same(&window));
}

#[test]
fn the_free_ball_turns_over_the_poles_comes_back_and_is_remembered() {
    // Fails if a drag there and back leaves the view turned, a drag across the ball is another angle, it stops at a pole, or the choice is
    // forgotten by the next window.
    let folder = std::env::temp_dir().join(format!("bregma-hand-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let build = |folder: &std::path::Path| -> Window {
        let state = folder.to_owned();
        let builder = Harness::builder().with_size([1280.0, 800.0]).wgpu();
        let mut window: Window = builder.build_eframe(|cc| Workstation::new(cc, Start::Demo, Some(state)));
        wait(&mut window, "the demo pair", |w| !w.is_loading());
        settle(&mut window);
        window.key_press(Key::Num1);
        window.run_steps(2);
        window
    };
    let mut window = build(&folder);
    command(&mut window, "Turntable or free arcball");
    let (first, rect) = (camera(&window), window.state().picture_rect().unwrap());
    let radius = rect.shrink(window.ctx.global_style().interaction.resize_grab_radius_side).size().min_elem() / 2.0;
    let middle = rect.center();
    // There and back under one button.
    window.event(Event::PointerMoved(middle));
    press(&window, middle, true, PointerButton::Primary);
    for to in [egui::vec2(150.0, 40.0), egui::vec2(-90.0, 200.0), egui::vec2(30.0, -180.0), egui::Vec2::ZERO] {
        window.event(Event::PointerMoved(middle + to));
        window.run_steps(1);
    }
    press(&window, middle, false, PointerButton::Primary);
    window.run_steps(2);
    assert!(camera(&window).eye_mm.distance(first.eye_mm) < 1e-3, "{:?}", camera(&window));
    // From 45° before the middle to 45° behind it: half a turn, over the pole.
    let reach = egui::vec2(0.0, radius * 0.5_f32.sqrt());
    drag(&mut window, middle - reach, middle + reach);
    let basis = camera(&window).basis();
    assert!(basis.forward.dot(DVec3::NEG_Y) > 0.999 && basis.up.dot(DVec3::NEG_Z) > 0.999, "from behind, upside down: {basis:?}");
    undo(&mut window);
    drop(window);
    let mut window = build(&folder);
    drag(&mut window, middle - reach, middle + reach);
    assert!(camera(&window).basis().up.z < -0.999, "the choice is remembered");
    std::fs::remove_dir_all(folder).unwrap();
}
