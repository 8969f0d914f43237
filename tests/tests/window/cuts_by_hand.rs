//! Cuts moved, turned and sized in the picture, and the lines that show where they and the scans end.

use super::hand::{demo, on_screen, wheel};
use super::*;
use bregma_renderer::{BodyPlane, Shape as Cut};
use egui::epaint::Shape;
use egui::{Color32, vec2};
use glam::DVec3;

/// The colour of all that belongs to cuts.
const OF_CUTS: Color32 = Color32::from_rgb(255, 215, 80);

fn cut(window: &Window, n: usize) -> Cut {
    window.state().scene().clips[n].shape
}

fn plane(window: &Window) -> (DVec3, f64) {
    match cut(window, 0) {
        Cut::Plane { normal, offset_mm } => (normal, offset_mm),
        other => panic!("no plane: {other:?}"),
    }
}

/// With one cut of a kind, seen from before.
fn with_cut(kind: &str) -> Window {
    let mut window = demo();
    window.get_by_label("Cuts").click();
    window.run_steps(8);
    choose(&mut window, Role::Button, kind);
    window.key_press(Key::Num1);
    settle(&mut window);
    window
}

/// The ends of the lines of a colour that are on the screen.
fn ends(window: &Window, color: Color32) -> Vec<Pos2> {
    let mut found = vec![];
    for clipped in &window.output().shapes {
        if let Shape::LineSegment { points, stroke } = &clipped.shape
            && stroke.color == color
        {
            found.extend(points);
        }
    }
    found
}

fn has_end(ends: &[Pos2], at: Pos2) -> bool {
    ends.iter().any(|end| end.distance(at) < 0.5)
}

/// The box around the grids of both scans.
fn shown(window: &Window) -> [DVec3; 2] {
    let surfaces = window.state().scene().surfaces(window.state().volumes()).unwrap();
    let corners = surfaces.iter().flat_map(|(_, surface)| surface.grid.corners_mm());
    corners.map(|corner| [corner; 2]).reduce(|[low, high], [a, b]| [low.min(a), high.max(b)]).unwrap()
}

#[test]
fn ctrl_and_the_mouse_move_and_turn_the_cut_that_was_held_last() {
    // Fails if the wheel moves the cut by other than samples, a drag moves the view, another cut goes along, or one of them is not undone.
    let mut window = with_cut("Axial");
    let (normal, offset_mm) = plane(&window);
    let (camera, middle) = (window.state().scene().camera, window.state().picture_rect().unwrap().center());
    wheel(&mut window, middle, 3.0, Modifiers::COMMAND);
    let step_mm = window.state().volumes()[0].grid().spacing_mm().z;
    let deeper = offset_mm - plane(&window).1;
    assert!((deeper - 3.0 * step_mm).abs() < 0.02 * step_mm, "{deeper} mm for three samples of {step_mm}");
    assert_eq!(window.state().scene().camera, camera, "the view stays");
    wheel(&mut window, middle, -3.0, Modifiers::COMMAND);
    assert!((plane(&window).1 - offset_mm).abs() < 1e-3, "and back");

    settle(&mut window);
    let before = plane(&window);
    drag_with(&mut window, middle + vec2(30.0, 80.0), middle + vec2(30.0, 140.0), Modifiers::COMMAND);
    let (turned, there) = plane(&window);
    assert!(turned.z < 0.99 && turned.y < -0.1 && turned.x.abs() < 1e-9, "toward the viewer: {turned}");
    let [low, high] = shown(&window);
    let middle_mm = 0.5 * (low + high);
    let foot = middle_mm + (before.1 - normal.dot(middle_mm)) * normal;
    assert!((turned.dot(foot) - there).abs() < 1e-6, "about the point nearest to the middle");
    assert_eq!(window.state().scene().camera, camera);
    undo(&mut window);
    assert_eq!(plane(&window), before);

    // A second cut is the newest, until the first is held.
    choose(&mut window, Role::Button, "Sagittal");
    wheel(&mut window, middle, 1.0, Modifiers::COMMAND);
    assert_eq!(plane(&window), before);
    let arrow = rect_of(&window, "Arrow of cut 1").center();
    drag(&mut window, arrow, arrow - vec2(0.0, 20.0));
    let (second, held) = (cut(&window, 1), plane(&window));
    wheel(&mut window, middle, 1.0, Modifiers::COMMAND);
    assert!(cut(&window, 1) == second && plane(&window) != held);
    // With Alt, Ctrl rolls all the same.
    let (first, second) = (cut(&window, 0), cut(&window, 1));
    drag_with(&mut window, middle + vec2(100.0, 0.0), middle + vec2(90.0, 60.0), Modifiers::COMMAND | Modifiers::ALT);
    assert!(window.state().scene().camera.up.z < 0.99 && (cut(&window, 0), cut(&window, 1)) == (first, second));
    undo(&mut window);
    // Where nothing cuts, Ctrl rolls and zooms.
    for n in [2, 1] {
        choose(&mut window, Role::Button, &format!("Remove cut {n}"));
    }
    drag_with(&mut window, middle + vec2(100.0, 0.0), middle + vec2(90.0, 60.0), Modifiers::COMMAND);
    assert!(window.state().scene().camera.up.z < 0.99, "{:?}", window.state().scene().camera);
}

#[test]
fn a_turn_of_the_wheel_is_one_step() {
    // Fails if undo takes back a frame of the wheel's way instead of all of it, or its step joins the one before.
    let mut window: Window =
        Harness::builder().with_size([1280.0, 800.0]).with_step_dt(0.02).wgpu().build_eframe(|cc| Workstation::new(cc, Start::Demo, None));
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    window.get_by_label("Cuts").click();
    window.run_steps(30);
    choose(&mut window, Role::Button, "Axial");
    let before = plane(&window);
    let middle = window.state().picture_rect().unwrap().center();
    wheel(&mut window, middle, 4.0, Modifiers::COMMAND);
    assert!(plane(&window).1 < before.1 - 1.0);
    undo(&mut window);
    assert_eq!(plane(&window), before);
    undo(&mut window);
    assert!(window.state().scene().clips.is_empty());
}

#[test]
fn the_outline_of_a_plane_is_drawn_to_the_ends_of_what_is_shown() {
    // Fails if the outline is not drawn, lies beside the plane, or stays when the cut is off.
    let mut window = with_cut("Axial");
    let [low, high] = shown(&window);
    let z = plane(&window).1;
    let corners = [[low.x, low.y], [high.x, low.y], [high.x, high.y], [low.x, high.y]].map(|[x, y]| DVec3::new(x, y, z));
    let drawn = ends(&window, OF_CUTS);
    for corner in corners {
        assert!(has_end(&drawn, on_screen(&window, corner)), "{corner} at {}: {drawn:?}", on_screen(&window, corner));
    }
    screenshot(&mut window, "cut-outline.png");
    choose(&mut window, Role::CheckBox, "Cut 1 cuts");
    assert!(ends(&window, OF_CUTS).is_empty());
}

#[test]
fn a_double_click_beside_the_skulls_shows_everything_and_one_on_bone_measures() {
    // Fails if a double click on bone moves the view, or one beside it does not.
    let mut window =
        Harness::builder().with_size([1280.0, 800.0]).with_step_dt(0.02).wgpu().build_eframe(|cc| Workstation::new(cc, Start::Demo, None));
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    window.key_press(Key::F);
    settle(&mut window);
    let whole = window.state().scene().camera;
    window.key_press(Key::Num1);
    settle(&mut window);
    let (bone, beside) = (on_bone(&window), window.state().picture_rect().unwrap().min + vec2(30.0, 30.0));
    let front = window.state().scene().camera;
    (0..2).for_each(|_| click(&mut window, bone));
    assert!(window.state().scene().camera == front && window.state().difference_ray().is_some());
    // What is clicked elsewhere a little later is no double click.
    window.run_steps(40);
    (0..2).for_each(|_| click(&mut window, beside));
    assert!(window.state().scene().camera.eye_mm.distance(whole.eye_mm) < 1e-6, "{:?} {whole:?}", window.state().scene().camera);
}

#[test]
fn boxes_cylinders_and_spheres_have_dots_that_move_and_size_them() {
    // Fails if a dot has no name, moves another face or the view, or a drag is not one step.
    let mut window = with_cut("Box");
    let camera = window.state().scene().camera;
    let Cut::Box { low_mm, high_mm } = cut(&window, 0) else { panic!("no box") };
    let dot = |window: &Window, name: &str| rect_of(window, &format!("{name} dot of cut 1")).center();
    let at = dot(&window, "Left face");
    drag(&mut window, at, at - vec2(50.0, 0.0));
    let Cut::Box { low_mm: low, high_mm: high } = cut(&window, 0) else { panic!("no box") };
    assert!(low == low_mm && [high.y, high.z] == [high_mm.y, high_mm.z] && high.x < high_mm.x - 5.0, "{low} {high}");
    assert!(dot(&window, "Left face").distance(at - vec2(50.0, 0.0)) < 2.0, "the face follows the mouse");
    undo(&mut window);
    assert_eq!(cut(&window, 0), Cut::Box { low_mm, high_mm });
    // A click on a dot is meant for the bone under it.
    let at = dot(&window, "Superior face");
    let bone = on_bone(&window);
    drag(&mut window, at, bone);
    settle(&mut window);
    let at = dot(&window, "Superior face");
    click(&mut window, at + vec2(0.0, 3.0));
    assert!(window.state().difference_ray().is_some());
    undo(&mut window);
    undo(&mut window);
    assert_eq!(cut(&window, 0), Cut::Box { low_mm, high_mm });
    let at = dot(&window, "Centre");
    drag(&mut window, at, at + vec2(0.0, -40.0));
    let Cut::Box { low_mm: low, high_mm: high } = cut(&window, 0) else { panic!("no box") };
    assert!((low - low_mm).distance(high - high_mm) < 1e-9 && low.z > low_mm.z + 5.0, "{low} {high}");
    settle(&mut window);
    screenshot(&mut window, "cut-box.png");
    choose(&mut window, Role::Button, "Remove cut 1");
    assert_eq!(window.state().scene().camera, camera);
    // The cylinder is wider than the bone.
    (0..4).for_each(|_| window.key_press(Key::Minus));
    settle(&mut window);
    let farther = window.state().scene().camera;
    for kind in ["Cylinder", "Sphere"] {
        choose(&mut window, Role::Button, kind);
        let whole = pixels(&window);
        let radius = |window: &Window| match cut(window, 0) {
            Cut::Cylinder { radius_mm, .. } | Cut::Sphere { radius_mm, .. } => radius_mm,
            other => panic!("neither: {other:?}"),
        };
        let (before, at) = (radius(&window), dot(&window, "Radius"));
        drag(&mut window, at, at - vec2(80.0, 0.0));
        settle(&mut window);
        assert!(radius(&window) < before - 5.0 && changed(&whole, &pixels(&window)) > 1000, "{kind}: {}", radius(&window));
        let centre = dot(&window, "Centre");
        drag(&mut window, centre, centre + vec2(30.0, 0.0));
        assert!(dot(&window, "Centre").distance(centre + vec2(30.0, 0.0)) < 1.0);
        settle(&mut window);
        screenshot(&mut window, &format!("cut-{}.png", kind.to_lowercase()));
        choose(&mut window, Role::Button, "Remove cut 1");
    }
    assert_eq!(window.state().scene().camera, farther);
}

#[test]
fn slices_show_where_boxes_and_spheres_meet_them() {
    // Fails if a slice draws nothing of a cut, or draws it beside its place.
    let mut window = with_cut("Box");
    let Cut::Box { low_mm, high_mm } = cut(&window, 0) else { panic!("no box") };
    command(&mut window, "Axial slice alone");
    settle(&mut window);
    let (_, rect) = window.state().slice(BodyPlane::Axial).unwrap();
    let seen = |window: &Window| -> Vec<Pos2> { ends(window, OF_CUTS).into_iter().filter(|end| rect.contains(*end)).collect() };
    let drawn = seen(&window);
    assert_eq!(drawn.len(), 8, "four sides: {drawn:?}");
    let across = |points: &[Pos2]| {
        let x = points.iter().map(|p| p.x);
        x.clone().fold(f32::NEG_INFINITY, f32::max) - x.fold(f32::INFINITY, f32::min)
    };
    let mm_per_point = (high_mm.x - low_mm.x) / f64::from(across(&drawn));
    choose(&mut window, Role::Button, "Remove cut 1");
    assert!(seen(&window).is_empty());
    for kind in ["Sphere", "Cylinder"] {
        choose(&mut window, Role::Button, kind);
        let (Cut::Sphere { radius_mm, .. } | Cut::Cylinder { radius_mm, .. }) = cut(&window, 0) else { panic!("neither") };
        // Through its middle, as slices begin.
        let wide = f64::from(across(&ends(&window, OF_CUTS))) * mm_per_point;
        assert!((wide - 2.0 * radius_mm).abs() < 0.02 * radius_mm, "{kind}: {wide} mm for a radius of {radius_mm}");
        screenshot(&mut window, &format!("slice-{}.png", kind.to_lowercase()));
        choose(&mut window, Role::Button, "Remove cut 1");
    }
}

#[test]
fn the_boxes_of_the_scans_come_and_go_in_their_colours() {
    // Fails if a box is not that of its scan, an edge is missing, or it is not undone.
    let mut window = demo();
    let color = |window: &Window, n: usize| {
        let [r, g, b] = window.state().scene().layers[n].color.bytes();
        Color32::from_rgb(r, g, b)
    };
    // Along parallel rays the box is seen from one of its corners.
    window.key_press(Key::Num5);
    command(&mut window, "Bounding boxes");
    let surfaces = window.state().scene().surfaces(window.state().volumes()).unwrap();
    for (n, (_, surface)) in surfaces.iter().enumerate() {
        let own = color(&window, n);
        let [bright, dim] = [own, own.gamma_multiply(0.35)].map(|color| ends(&window, color));
        // From a corner three of the twelve lie behind.
        assert_eq!((bright.len() / 2, dim.len() / 2), (9, 3), "scan {n}");
        let all = [bright, dim].concat();
        assert!(surface.grid.corners_mm().iter().all(|corner| has_end(&all, on_screen(&window, *corner))), "scan {n}");
    }
    screenshot(&mut window, "bounding-boxes.png");
    undo(&mut window);
    assert!(ends(&window, color(&window, 0)).is_empty());
}
