//! A scan moved by hand: by drags in the picture and in slices, and by numbers.

use super::registering::{pose, twice};
use super::*;
use bregma_field::WorldPoint;
use bregma_renderer::{BodyPlane, Camera};
use glam::{DAffine3, DQuat, DVec3};

/// The middle of the moved scan's box.
fn middle_mm(window: &Window) -> DVec3 {
    let own = window.state().volumes()[1].grid().corners_mm().into_iter().sum::<DVec3>() / 8.0;
    pose(window).transform_point3(own)
}

/// Where a point is in the picture, in points of the screen from its corner.
fn on_screen(window: &Window, camera: &Camera, p: DVec3) -> egui::Vec2 {
    let rect = window.state().picture_rect().unwrap();
    let (x, y) = camera.project(WorldPoint(p), rect.width() as u32, rect.height() as u32).unwrap();
    egui::vec2(x as f32, y as f32)
}

/// What turned the moved scan from there to how it lies now: the turn, and where its middle went.
fn motion(window: &Window, before: DAffine3) -> DAffine3 {
    pose(window) * before.inverse()
}

fn take(window: &mut Window) {
    window.get_by_label("Move by hand").click();
    window.run_steps(3);
}

#[test]
fn a_drag_in_the_picture_moves_the_scan_by_what_the_mouse_moves_and_undo_takes_it_back_to_the_bit() {
    // Fails if the scan does not stay under the mouse at its depth, leaves the view's plane, turns while it moves, moves the view, leaves its
    // landmarks behind or keeps a ± that it lost; or if a drag is more than one step.
    let (mut window, file) = twice("by-hand", [0.0; 6]);
    let (before, points, camera) = (pose(&window), window.state().landmarks().to_vec(), window.state().scene().camera);
    let was_mm = middle_mm(&window);
    take(&mut window);
    let from = window.state().picture_rect().unwrap().center();
    let by = egui::vec2(46.0, -31.0);
    drag(&mut window, from, from + by);
    settle(&mut window);
    assert_eq!(window.state().scene().camera, camera, "the view stays");
    let shift_mm = middle_mm(&window) - was_mm;
    let went = on_screen(&window, &camera, was_mm + shift_mm) - on_screen(&window, &camera, was_mm);
    assert!((went - by).length() < 0.05, "the mouse went {by:?}, the scan {went:?}");
    assert!(shift_mm.dot(camera.basis().forward).abs() < 1e-6 && shift_mm.length() > 3.0, "{shift_mm}");
    let moved = motion(&window, before);
    assert!(moved.matrix3.abs_diff_eq(glam::DMat3::IDENTITY, 1e-12));
    for (n, (was, is)) in points.iter().zip(window.state().landmarks()).enumerate() {
        let expected = was.point_mm.unwrap() + if n < 6 { DVec3::ZERO } else { shift_mm };
        assert!(is.point_mm.unwrap().distance(expected) < 1e-9, "{}", is.name);
    }
    undo(&mut window);
    assert_eq!((pose(&window), window.state().landmarks()), (before, &points[..]));

    // With Ctrl it turns about the view's axis through its middle, by the angle that the mouse goes around it.
    let rect = window.state().picture_rect().unwrap();
    let foot = rect.min + on_screen(&window, &camera, was_mm) + egui::vec2(0.5, 0.5);
    let [from, to] = [egui::vec2(90.0, 0.0), egui::vec2(0.0, 90.0)].map(|arm| foot + arm);
    drag_with(&mut window, from, to, Modifiers::COMMAND);
    settle(&mut window);
    assert!(middle_mm(&window).distance(was_mm) < 1e-6);
    let turn = DQuat::from_mat3(&motion(&window, before).matrix3).to_scaled_axis();
    assert!(turn.distance(std::f64::consts::FRAC_PI_2 * camera.basis().forward) < 1e-3, "{turn}, a quarter clockwise");
    undo(&mut window);
    assert_eq!(pose(&window), before);

    // The view turns all the same.
    drag_with(&mut window, foot, foot + by, Modifiers::ALT);
    assert_eq!(pose(&window), before);
    assert_ne!(window.state().scene().camera, camera);
    let camera = window.state().scene().camera;
    // Beside each other, it turns about its middle in the picture that the mouse is on.
    window.get_by_label("Compare").click();
    window.run_steps(3);
    window.get_by_label("Side by side").click();
    settle(&mut window);
    let pane = egui::Rect::from_min_max(egui::pos2(rect.center().x, rect.top()), rect.max);
    let at_middle = camera.project(WorldPoint(was_mm), pane.width() as u32, pane.height() as u32).unwrap();
    let foot = pane.min + egui::vec2(at_middle.0 as f32 + 0.5, at_middle.1 as f32 + 0.5);
    drag_with(&mut window, foot + egui::vec2(70.0, 0.0), foot + egui::vec2(0.0, 70.0), Modifiers::COMMAND);
    settle(&mut window);
    let turn = DQuat::from_mat3(&motion(&window, before).matrix3).to_scaled_axis();
    assert!(turn.distance(std::f64::consts::FRAC_PI_2 * camera.basis().forward) < 0.05, "{turn}, a quarter clockwise");
    undo(&mut window);
    let camera = window.state().scene().camera;
    // Escape ends it: the same drag turns the view.
    window.key_press(Key::Escape);
    window.run_steps(3);
    drag(&mut window, foot, foot + by);
    assert!(pose(&window) == before && window.state().scene().camera != camera);
    std::fs::remove_file(file).unwrap();
}

#[test]
fn a_drag_on_a_slice_moves_the_scan_in_its_plane_and_turns_it_about_the_cross() {
    // Fails if the scan leaves the slice's plane, moves by another number of millimetres than the mouse, as where the view of all
    // scans follows it, turns about another point or axis, or the
    // cross moves instead.
    let (mut window, file) = twice("by-hand-slices", [0.0; 6]);
    command(&mut window, "Picture and slices");
    settle(&mut window);
    let (before, at_mm) = (pose(&window), window.state().slices().at_mm);
    take(&mut window);
    settle(&mut window);
    let (picture, rect) = window.state().slice(BodyPlane::Coronal).unwrap();
    let aspect = f64::from(picture.width) / f64::from(picture.height);
    let grids: Vec<_> =
        (0..2).map(|n| window.state().volumes()[n].grid().moved(window.state().scene().layers[n].transform).unwrap()).collect();
    let camera = window.state().slices().camera(BodyPlane::Coronal, &grids, aspect);
    let bregma_renderer::Projection::Orthographic { height_mm } = camera.projection else { panic!() };
    let mm_per_point = height_mm / f64::from(rect.height());
    drag(&mut window, rect.center(), rect.center() + egui::vec2(20.0, 0.0));
    settle(&mut window);
    let moved = motion(&window, before);
    let shift_mm = moved.translation;
    let expected_mm = 20.0 * mm_per_point * camera.basis().right;
    assert!(shift_mm.distance(expected_mm) < 1e-4 && shift_mm.length() > 2.0, "{shift_mm}, not {expected_mm}");
    assert!(moved.matrix3.abs_diff_eq(glam::DMat3::IDENTITY, 1e-12) && window.state().slices().at_mm == at_mm);
    undo(&mut window);
    assert_eq!(pose(&window), before);
    let (from, to) = (rect.center() + egui::vec2(60.0, 0.0), rect.center() + egui::vec2(52.0, 30.0));
    drag_with(&mut window, from, to, Modifiers::COMMAND);
    settle(&mut window);
    let moved = motion(&window, before);
    assert!(moved.transform_point3(at_mm).distance(at_mm) < 1e-6, "the cross stays on the scan");
    let turn = DQuat::from_mat3(&moved.matrix3).to_scaled_axis();
    let along = turn.dot(camera.basis().forward);
    assert!((0.2..1.0).contains(&along) && (turn - along * camera.basis().forward).length() < 1e-9, "{turn}");
    // Escape ends it where there is no picture, too: a drag moves the cross again.
    command(&mut window, "Three slices");
    settle(&mut window);
    window.key_press(Key::Escape);
    window.run_steps(3);
    let (turned, (_, rect)) = (pose(&window), window.state().slice(BodyPlane::Coronal).unwrap());
    drag(&mut window, rect.center(), rect.center() + egui::vec2(20.0, 0.0));
    settle(&mut window);
    assert!(pose(&window) == turned && window.state().slices().at_mm != at_mm);
    std::fs::remove_file(file).unwrap();
}

#[test]
fn numbers_move_the_scan_by_what_they_say() {
    // Fails if a number is of another axis or in other units, does not count from where the scan was taken, or a step goes another way.
    let (mut window, file) = twice("by-hand-numbers", [0.0; 6]);
    let (before, was_mm) = (pose(&window), middle_mm(&window));
    take(&mut window);
    window.get_by_role_and_label(Role::SpinButton, "Shift to posterior").set_value_accesskit(2.5);
    settle(&mut window);
    assert!((middle_mm(&window) - was_mm).distance(DVec3::Y * 2.5) < 1e-9);
    window.get_by_role_and_label(Role::SpinButton, "Turn about superior").set_value_accesskit(-10.0);
    settle(&mut window);
    assert!((middle_mm(&window) - was_mm).distance(DVec3::Y * 2.5) < 1e-9, "it turns about its middle");
    let turn = DQuat::from_mat3(&motion(&window, before).matrix3).to_scaled_axis();
    assert!(turn.distance(DVec3::Z * -10.0_f64.to_radians()) < 1e-9, "{turn}");
    window.get_by_label("Shift to left, a step more").click();
    settle(&mut window);
    assert!((middle_mm(&window) - was_mm).distance(DVec3::new(0.2, 2.5, 0.0)) < 1e-9);
    screenshot(&mut window, "register-by-hand.png");
    for _ in 0..3 {
        undo(&mut window);
    }
    assert_eq!(pose(&window), before);
    std::fs::remove_file(file).unwrap();
}
