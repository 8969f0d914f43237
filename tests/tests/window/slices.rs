//! Slices beside the picture.

use super::hand::wheel;
use super::*;
use bregma_renderer::{BodyPlane, Named};
use bregma_session::Layout;

fn open_with_slices(layout: &str) -> Window {
    let mut window = open(Start::Demo);
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    command(&mut window, layout);
    settle(&mut window);
    window
}

fn rect(window: &Window, plane: BodyPlane) -> egui::Rect {
    window.state().slice(plane).unwrap().1
}

#[test]
fn a_key_leads_to_slices_and_another_back_and_the_session_keeps_them() {
    // Fails if slices cannot be reached by a key, are not all drawn, or are forgotten by undo or by the session.
    let mut window = open(Start::Demo);
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    window.key_press(Key::S);
    settle(&mut window);
    assert_eq!(window.state().slices().layout, Layout::All);
    for &plane in BodyPlane::ALL {
        let (picture, rect) = window.state().slice(plane).unwrap();
        assert_eq!([picture.width as f32, picture.height as f32], [rect.width(), rect.height()], "{plane:?}");
        let grey = picture.rgba.iter().filter(|c| c[0] == c[1] && c[1] == c[2]).count();
        let segments: usize = picture.contours.iter().map(|contour| contour.segments.len()).sum();
        assert!(grey > 10_000 && picture.contours.len() == 2 && segments > 500, "{plane:?}: {grey} grey, {segments} segments");
    }
    let rects: Vec<_> = BodyPlane::ALL.iter().map(|plane| rect(&window, *plane)).chain(window.state().picture_rect()).collect();
    for (n, a) in rects.iter().enumerate() {
        assert!(rects[..n].iter().all(|b| !a.intersects(*b)), "views lie over each other: {rects:?}");
    }
    window.key_press(Key::C);
    settle(&mut window);
    assert_eq!(window.state().slices().layout, Layout::Picture);
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    window.run_steps(3);
    assert_eq!(window.state().slices().layout, Layout::Picture, "looking is one step, which begins before it");
}

#[test]
fn the_hand_moves_the_cross_and_the_wheel_the_slice_and_all_views_follow() {
    // Fails if a view moves another way than its own, or the others do not follow.
    let mut window = open_with_slices("Picture and slices");
    let before = window.state().slices().at_mm;
    let axial = rect(&window, BodyPlane::Axial);
    // To the right is left, and down is posterior.
    drag(&mut window, axial.center(), axial.center() + egui::vec2(30.0, 20.0));
    let after = window.state().slices().at_mm;
    assert!(after.x > before.x + 1.0 && after.y > before.y + 1.0 && (after.z - before.z).abs() < 1e-9, "{before} {after}");
    settle(&mut window);
    let seen = |window: &Window, plane| window.state().slice(plane).unwrap().0.rgba.clone();
    let [coronal, own] = [BodyPlane::Coronal, BodyPlane::Axial].map(|plane| seen(&window, plane));
    wheel(&mut window, axial.center(), 3.0, Modifiers::NONE);
    settle(&mut window);
    let moved = window.state().slices().at_mm;
    assert!(moved.z > after.z + 0.1 && moved.x == after.x && moved.y == after.y, "the wheel goes toward the head: {after} {moved}");
    assert!(seen(&window, BodyPlane::Axial) != own && seen(&window, BodyPlane::Coronal) == coronal);
    window.event(Event::PointerMoved(axial.center()));
    window.key_press(Key::PageDown);
    window.run_steps(2);
    assert!(window.state().slices().at_mm.z < moved.z, "and so does a key");

    // Ctrl and the wheel zoom at the cursor.
    wheel(&mut window, axial.center() + egui::vec2(40.0, 0.0), 5.0, Modifiers::COMMAND);
    settle(&mut window);
    assert!(window.state().slices().frames[0].is_some() && window.state().slices().frames[1].is_none());
    assert_eq!(window.state().slices().at_mm.x, moved.x);
}

#[test]
fn right_drags_change_the_window_and_the_panel_shows_it() {
    // Fails if the window is the picture's, too, or the panel says another one.
    let mut window = open_with_slices("Axial slice alone");
    let at = rect(&window, BodyPlane::Axial).center();
    window.event(Event::PointerMoved(at));
    press(&window, at, true, PointerButton::Secondary);
    window.run_steps(2);
    for n in 1..=5 {
        window.event(Event::PointerMoved(at + egui::vec2(20.0, -10.0) * n as f32));
        window.run_steps(2);
    }
    press(&window, at + egui::vec2(100.0, -50.0), false, PointerButton::Secondary);
    settle(&mut window);
    let grey = window.state().slices().look.window.expect("a window of its own");
    assert!(grey.width > 1200.0 && grey.level < 300.0 && window.state().scene().window.is_none(), "{grey:?}");
    assert!(window.state().picture_rect().is_some());
}

#[test]
fn the_status_says_what_lies_under_the_mouse_in_every_view() {
    // Fails if a view says nothing, a side is the other one, or a scan is left out.
    let mut window = open_with_slices("Picture and slices");
    for &plane in BodyPlane::ALL {
        window.event(Event::PointerMoved(rect(&window, plane).center()));
        window.run_steps(2);
        let said = window.state().under();
        assert!(said.contains("skull A") && said.contains("skull B") && said.contains(" mm") && said.contains('('), "{plane:?}: {said}");
    }
    let bone = on_bone(&window);
    window.event(Event::PointerMoved(bone));
    window.run_steps(2);
    let said = window.state().under();
    assert!(said.contains(" HU"), "on the picture: {said}");
}

#[test]
fn rays_and_landmarks_are_set_in_slices() {
    // Fails if a click on a slice sets nothing, or a landmark beside the surface.
    let mut window = open_with_slices("Axial slice alone");
    let (picture, place) = window.state().slice(BodyPlane::Axial).map(|(p, r)| (p.clone(), r)).unwrap();
    // The contour's leftmost point.
    let [x, y] = picture.contours[0].segments.iter().map(|s| [s[0], s[1]]).min_by(|a, b| a[0].total_cmp(&b[0])).unwrap();
    let at = place.min + egui::vec2(x + 2.0, y + 0.5);
    window.key_press(Key::L);
    window.run_steps(2);
    click(&mut window, at);
    let landmark = window.state().landmarks()[0].point_mm.unwrap();
    let surface = window.state().scene().surfaces(window.state().volumes()).unwrap();
    let inside = surface.iter().filter_map(|(_, s)| bregma_field::interpolant::depth_at(s, bregma_field::WorldPoint(landmark)));
    assert!(inside.map(|(inside, slope)| (inside / slope.length()).abs()).fold(f64::INFINITY, f64::min) < 1e-3, "beside the surface");
    window.key_press(Key::T);
    window.run_steps(2);
    click(&mut window, at - egui::vec2(6.0, 0.0));
    click(&mut window, at + egui::vec2(60.0, 0.0));
    window.run_steps(2);
    let ray = window.state().difference_ray().expect("a ray through two points of the slice");
    assert!(ray.volumes[0].segments[0].length_mm > 0.5, "{:?}", ray.volumes[0].segments);
}
