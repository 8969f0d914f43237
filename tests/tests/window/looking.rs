//! Views, modes and colours.

use super::*;

#[test]
fn keys_and_mouse_move_the_view_as_in_slicer() {
    let file = ball("view", 24);
    let source = bregma_session::Source { file: file.clone(), ..Default::default() };
    // On a screen whose points are one and a half pixels wide.
    let builder = Harness::builder().with_size([1280.0, 800.0]).with_pixels_per_point(1.5).wgpu();
    let mut window: Window = builder.build_eframe(|cc| Workstation::new(cc, Start::Files(vec![source]), None).preferring(at_once()));
    wait(&mut window, "the scan", |w| !w.is_loading());
    settle(&mut window);
    let (picture, rect) = (window.state().picture().unwrap(), window.state().picture_rect().unwrap());
    assert_eq!([picture.width as f32, picture.height as f32], [rect.width() * 1.5, rect.height() * 1.5]);
    let forward = |window: &Window| window.state().scene().camera.basis().forward;
    for (key, direction) in [(Key::Num3, -glam::DVec3::X), (Key::Num7, -glam::DVec3::Z), (Key::Num1, glam::DVec3::Y)] {
        window.key_press(key);
        window.run_steps(2);
        assert!(forward(&window).dot(direction) > 0.999_999, "{key:?}");
    }
    let front = window.state().scene().camera;
    window.key_press(Key::Num5);
    window.run_steps(2);
    assert!(matches!(window.state().scene().camera.projection, bregma_renderer::Projection::Orthographic { .. }));
    window.key_press(Key::Num5);
    window.run_steps(2);
    assert!((window.state().scene().camera.eye_mm - front.eye_mm).length() < 1e-9, "there and back");

    // Dragging to the right turns the near side to the right: the eye goes to the viewer's left, the patient's right.
    let centre = window.state().picture_rect().unwrap().center();
    drag(&mut window, centre, centre + egui::vec2(100.0, 0.0));
    assert!(window.state().scene().camera.eye_mm.x < front.eye_mm.x - 1.0);
    assert!(window.state().difference_ray().is_none(), "a drag casts no ray");
    window.event(Event::PointerMoved(centre));
    window.event(Event::MouseWheel {
        unit: egui::MouseWheelUnit::Line,
        delta: egui::vec2(0.0, 1.0),
        source: egui::MouseWheelSource::Wheel,
        phase: egui::TouchPhase::Move,
        modifiers: Modifiers::NONE,
    });
    window.run_steps(3);
    let camera = window.state().scene().camera;
    assert!(camera.eye_mm.distance(camera.target_mm) < front.eye_mm.distance(front.target_mm), "the wheel brings it nearer");
    // The ball is 18.4 mm across, and the picture's centre shows its middle.
    click(&mut window, centre);
    let length = window.state().difference_ray().expect("a ray through the ball").volumes[0].segments[0].length_mm;
    assert!((length - 18.4).abs() < 1.0, "{length}");
    std::fs::remove_file(&file).unwrap();
}

#[test]
fn every_mode_is_chosen_drawn_and_undone_with_only_its_own_controls() {
    // Fails if a mode cannot be chosen, draws what another one draws, shows another one's controls, or is forgotten by undo.
    let mut window = open(Start::Demo);
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    settle(&mut window);
    choose(&mut window, Role::RadioButton, "Isosurface");
    let mut seen = vec![pixels(&window)];
    for (label, mode, has, hasnt) in [
        ("Transparent", Mode::Transparent, "Inside in another colour", "Spline"),
        ("Overlay", Mode::Overlay, "Opacity of skull A", "Inside in another colour"),
        ("Volume", Mode::Dvr, "Transfer function of skull A", "Shadows"),
        ("Maximum", Mode::Max, "Of the gradient", "Depth cue"),
        ("Minimum", Mode::Min, "Automatic contrast", "Depth cue"),
        ("Mean", Mode::Mean, "Automatic contrast", "Transfer function of skull A"),
        ("X-ray", Mode::Xray, "Of the gradient", "Opacity of skull A"),
    ] {
        choose(&mut window, Role::RadioButton, label);
        assert_eq!(window.state().scene().mode, mode);
        assert!(window.query_all_by_label(has).next().is_some(), "{label} has {has}");
        assert!(window.query_all_by_label(hasnt).next().is_none(), "{label} has no {hasnt}");
        let now = pixels(&window);
        let least = seen.iter().map(|before| changed(before, &now)).min();
        assert!(least > Some(1000), "{label} looks different from all before");
        seen.push(now);
        screenshot(&mut window, &format!("mode-{}.png", label.to_lowercase()));
    }
    // Contrast by hand begins with what the picture shows and changes it when it is moved.
    choose(&mut window, Role::CheckBox, "Automatic contrast");
    let own = window.state().scene().window.expect("a window of its own");
    assert!(own.width > 0.0);
    window.get_by_role_and_label(Role::SpinButton, "Window width").set_value_accesskit(own.width * 0.5);
    settle(&mut window);
    assert!(changed(&seen[7], &pixels(&window)) > 1000);
    for expected in [Some(own), None] {
        undo(&mut window);
        assert_eq!(window.state().scene().window, expected);
    }
    choose(&mut window, Role::CheckBox, "Of the gradient");
    assert!(window.state().scene().of_gradient && changed(&seen[7], &pixels(&window)) > 1000);
    undo(&mut window);
    undo(&mut window);
    assert_eq!(window.state().scene().mode, Mode::Mean);
}

#[test]
fn transparent_surfaces_are_added_changed_and_removed() {
    // Fails if a further isosurface is not drawn, or one of its parts cannot be changed by its name.
    let mut window = open(Start::Demo);
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    settle(&mut window);
    choose(&mut window, Role::RadioButton, "Transparent");
    let plain = pixels(&window);
    choose(&mut window, Role::Button, "Add an isosurface to skull A");
    assert_eq!(window.state().scene().layers[0].shells.len(), 1);
    let with_skin = pixels(&window);
    assert!(changed(&plain, &with_skin) > 1000, "the further surface shows");
    window.get_by_role_and_label(Role::Slider, "Opacity of surface 2 of skull A").set_value_accesskit(0.9);
    window.get_by_role_and_label(Role::SpinButton, "Isovalue of surface 2 of skull A").set_value_accesskit(-500.0);
    settle(&mut window);
    let shell = window.state().scene().layers[0].shells[0];
    assert!((shell.opacity - 0.9).abs() < 0.01 && shell.iso == -500.0, "{shell:?}");
    assert!(changed(&with_skin, &pixels(&window)) > 1000);
    window.get_all_by_label("Inside in another colour").next().unwrap().click();
    settle(&mut window);
    assert!(window.state().scene().layers[0].inner_color.is_some());
    screenshot(&mut window, "shells.png");
    let left = window.state().picture_rect().unwrap().left();
    window.get_by_role_and_label(Role::Slider, "Opacity of skull A").set_value_accesskit(1.0);
    window.run_steps(10);
    assert_eq!(window.state().picture_rect().unwrap().left(), left, "the widest number widens no panel");
    undo(&mut window);
    choose(&mut window, Role::Button, "Remove surface 2 of skull A");
    assert!(window.state().scene().layers[0].shells.is_empty());
    undo(&mut window);
    assert_eq!(window.state().scene().layers[0].shells, [shell]);
}

#[test]
fn a_transfer_function_is_chosen_and_its_points_dragged_added_and_removed() {
    // Fails if a point does not follow the mouse, passes its neighbour, cannot be added or removed, or if a drag is more than one step.
    let file = ball("transfer", 24);
    let source = bregma_session::Source { file: file.clone(), ..Default::default() };
    // Frames follow each other fast enough for a double click.
    let builder = Harness::builder().with_size([1280.0, 800.0]).with_step_dt(0.02).wgpu();
    let mut window: Window = builder.build_eframe(|cc| Workstation::new(cc, Start::Files(vec![source]), None).preferring(at_once()));
    wait(&mut window, "the scan", |w| !w.is_loading());
    settle(&mut window);
    let name = file.file_name().unwrap().to_string_lossy().into_owned();
    choose(&mut window, Role::RadioButton, "Volume");
    let by_default = pixels(&window);
    let function = |window: &Window| window.state().scene().layers[0].transfer.clone();
    assert!(function(&window).is_none());
    window.get_by_label(&format!("Look of {name}")).click();
    window.run_steps(2);
    assert!(window.get_by_label("mummy").accesskit_node().is_disabled(), "a look of HU fits no scan without them");
    window.get_by_label("µCT").click();
    settle(&mut window);
    assert_eq!(function(&window).unwrap().name, "µCT");
    undo(&mut window);
    assert!(function(&window).is_none() && changed(&by_default, &pixels(&window)) == 0);

    let field = rect_of(&window, &format!("Transfer function of {name}"));
    let first = rect_of(&window, &format!("Point 1 of {name}")).center();
    drag(&mut window, first, Pos2::new(field.left() + 20.0, field.top() + 12.0));
    settle(&mut window);
    let dragged = function(&window).expect("a function of its own");
    assert!(dragged.points[0].opacity > 0.85 && dragged.points[0].value < 10.0, "{:?}", dragged.points);
    assert!(changed(&by_default, &pixels(&window)) > 1000, "what was invisible is seen");
    // Farther to the right than its neighbour it does not go.
    let first = rect_of(&window, &format!("Point 1 of {name}")).center();
    drag(&mut window, first, field.right_center());
    let points = function(&window).unwrap().points;
    assert!(points[0].value < points[1].value && points[1] == dragged.points[1]);
    undo(&mut window);
    assert_eq!(function(&window), Some(dragged.clone()));

    let empty = Pos2::new(field.left() + field.width() * 0.25, field.center().y);
    for _ in 0..2 {
        click(&mut window, empty);
    }
    assert_eq!(function(&window).unwrap().points.len(), 4);
    screenshot(&mut window, "transfer.png");
    let added = rect_of(&window, &format!("Point 2 of {name}")).center();
    assert!((added - empty).length() < 3.0);
    click_with(&mut window, added, PointerButton::Secondary);
    assert_eq!(function(&window).unwrap().points, dragged.points);
    undo(&mut window);
    assert_eq!(function(&window).unwrap().points.len(), 4);
    undo(&mut window);
    undo(&mut window);
    assert!(function(&window).is_none() && changed(&by_default, &pixels(&window)) == 0);
    std::fs::remove_file(&file).unwrap();
}

pub fn compare_by(window: &mut Window, kind: &str) {
    window.get_by_label("Compare").click();
    window.run_steps(3);
    window.get_by_label(kind).click();
    window.run_steps(2);
    settle(window);
}

#[test]
fn two_scans_are_compared_side_by_side_by_swipe_checkerboard_and_flicker() {
    // Fails if a half of the picture shows the wrong scan, the line does not follow the mouse, a drag of it draws anew, or a click in the
    // right half of two measures elsewhere than where it points.
    let mut window = open(Start::Demo);
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    settle(&mut window);
    choose(&mut window, Role::RadioButton, "Isosurface");
    let together = pixels(&window);
    // Which scans are seen left and right of a column.
    let seen = |window: &Window, column: f32| {
        let picture = window.state().picture().unwrap();
        let line = (column * picture.width as f32) as usize;
        let ids = picture.volume_id.iter().enumerate().filter(|(_, id)| **id != 0);
        let mut sides = [std::collections::BTreeSet::new(), std::collections::BTreeSet::new()];
        ids.for_each(|(n, id)| _ = sides[usize::from(n % picture.width as usize >= line)].insert(*id));
        sides.map(|ids| ids.into_iter().collect::<Vec<_>>())
    };
    compare_by(&mut window, "Swipe");
    assert_eq!(seen(&window, 0.5), [vec![1], vec![2]]);
    let (line, rect) = (rect_of(&window, "Swipe line").center(), window.state().picture_rect().unwrap());
    drag(&mut window, line, line - egui::vec2(rect.width() * 0.06, 0.0));
    assert!(window.state().is_settled(), "moving the line draws nothing anew");
    assert!(matches!(window.state().compare(), bregma_session::Compare::Swipe { part } if (part - 0.44).abs() < 0.01));
    window.run_steps(1);
    assert_eq!(seen(&window, 0.44), [vec![1], vec![2]]);
    screenshot(&mut window, "compare-swipe.png");

    compare_by(&mut window, "Checkerboard");
    let squares = seen(&window, 0.5);
    assert_eq!(squares, [vec![1, 2], vec![1, 2]]);
    screenshot(&mut window, "compare-checkerboard.png");

    compare_by(&mut window, "Flicker");
    let mut turns = std::collections::BTreeSet::new();
    for _ in 0..12 {
        window.run_steps(1);
        turns.insert(seen(&window, 0.0)[1].clone());
    }
    assert_eq!(turns.into_iter().collect::<Vec<_>>(), [vec![1], vec![2]], "each by turns");

    compare_by(&mut window, "Side by side");
    assert_eq!(seen(&window, 0.5), [vec![1], vec![2]]);
    // The same point of the forehead in both halves.
    let (picture, rect) = (window.state().picture().unwrap(), window.state().picture_rect().unwrap());
    let (w, h) = (picture.width as usize, picture.height as usize);
    let row = (0..h * 2 / 5).rev().find(|y| picture.volume_id[y * w + w / 4] != 0).expect("bone above the centre") as f32;
    let left = rect.min + egui::vec2(rect.width() / 4.0, row + 0.5);
    let right = left + egui::vec2(rect.width() / 2.0, 0.0);
    let mut rays = vec![];
    for at in [left, right] {
        click(&mut window, at);
        rays.push(window.state().difference_ray().expect("a ray").volumes[0].segments[0].length_mm);
        undo(&mut window);
    }
    assert!((rays[0] - rays[1]).abs() < 1e-6, "{rays:?}");
    click(&mut window, right);
    settle(&mut window);
    screenshot(&mut window, "compare-side.png");
    undo(&mut window);
    compare_by(&mut window, "Together");
    assert_eq!(changed(&together, &pixels(&window)), 0);
}

#[test]
fn opacity_by_the_gradient_is_switched_on_changed_and_taken_back() {
    // Fails if the factors do not reach the picture, or their points pass each other.
    let mut window = open(Start::Demo);
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    settle(&mut window);
    choose(&mut window, Role::RadioButton, "Volume");
    let plain = pixels(&window);
    window.get_all_by_role_and_label(Role::CheckBox, "By gradient").next().unwrap().click();
    settle(&mut window);
    let gradient = |window: &Window| window.state().scene().layers[0].transfer.clone().map_or(vec![], |t| t.gradient);
    assert!(gradient(&window).len() == 2 && changed(&plain, &pixels(&window)) > 1000);
    let ramp = pixels(&window);
    let second = gradient(&window)[1].per_mm;
    window.get_by_role_and_label(Role::SpinButton, "Gradient 1 of skull A").set_value_accesskit(2.0 * second);
    window.get_by_role_and_label(Role::SpinButton, "Factor 1 of skull A").set_value_accesskit(0.5);
    settle(&mut window);
    let points = gradient(&window);
    assert!(points[0].per_mm < points[1].per_mm && points[0].factor == 0.5, "{points:?}");
    assert!(changed(&ramp, &pixels(&window)) > 1000);
    screenshot(&mut window, "by-gradient.png");
    for _ in 0..3 {
        undo(&mut window);
    }
    assert!(gradient(&window).is_empty() && changed(&plain, &pixels(&window)) == 0);
}

#[test]
fn the_spline_is_drawn_and_named_as_another_surface() {
    // Fails if the surface that is not measured could be taken for the one that is.
    let mut window = open(Start::Demo);
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    settle(&mut window);
    let exact = |window: &Window| window.query_all_by_label_contains("B-spline, not the measured surface").next().is_none();
    let plain = pixels(&window);
    assert!(exact(&window));
    choose(&mut window, Role::CheckBox, "Spline");
    assert!(!exact(&window) && changed(&plain, &pixels(&window)) > 100);
    screenshot(&mut window, "spline.png");
    choose(&mut window, Role::RadioButton, "Volume");
    assert!(exact(&window), "other modes draw the interpolant");
    undo(&mut window);
    undo(&mut window);
    assert!(exact(&window) && changed(&plain, &pixels(&window)) == 0);
}

#[test]
fn a_picture_at_rest_grows_smooth_and_then_costs_nothing() {
    // Fails if a picture at rest keeps its steps, what is drawn on goes on for ever, or a move has to wait for it.
    let file = ball("smooth", 24);
    let source = bregma_session::Source { file: file.clone(), ..Default::default() };
    let builder = || Harness::builder().with_size([900.0, 600.0]).wgpu();
    // The picture of one sample is another window's: this one's may have more by the time that it is looked at.
    let start = Start::Files(vec![source.clone()]);
    let mut plain: Window = builder().build_eframe(|cc| Workstation::new(cc, start, None).preferring(at_once()));
    wait(&mut plain, "the scan", |w| !w.is_loading());
    settle(&mut plain);
    let once = pixels(&plain);
    let mut window: Window = builder().build_eframe(|cc| Workstation::new(cc, Start::Files(vec![source]), None));
    wait(&mut window, "the scan", |w| !w.is_loading());
    settle(&mut window);
    let shades = |pixels: &[[u8; 4]]| pixels.iter().collect::<std::collections::BTreeSet<_>>().len();
    let smooth = |window: &Window| window.query_by_label_contains("16 samples").is_some();
    let begun = Instant::now();
    while !smooth(&window) {
        window.step();
        assert!(begun.elapsed() < Duration::from_secs(60), "it never has 16 samples");
        std::thread::sleep(Duration::from_millis(5));
    }
    let rested = pixels(&window);
    assert!(shades(&rested) > shades(&once) && changed(&rested, &once) > 200, "its edge has as many steps as before");
    for _ in 0..20 {
        window.step();
        std::thread::sleep(Duration::from_millis(5));
    }
    assert_eq!(pixels(&window), rested, "it is drawn on");
    window.key_press(Key::Num3);
    window.run_steps(2);
    assert!(!smooth(&window) || !window.state().is_settled(), "what moves has one sample");
    settle(&mut window);
    std::fs::remove_file(file).unwrap();
}

#[test]
fn any_two_of_three_scans_are_compared() {
    // Fails if only the first two can be compared, a scan is compared with itself, or a closed scan leaves another in its place.
    let files = [20, 24, 28].map(|n| ball(&format!("pair{n}"), n));
    let sources = files.iter().map(|file| bregma_session::Source { file: file.clone(), ..Default::default() }).collect();
    let mut window = open(Start::Files(sources));
    wait(&mut window, "the scans", |w| !w.is_loading());
    settle(&mut window);
    choose(&mut window, Role::RadioButton, "Isosurface");
    compare_by(&mut window, "Side by side");
    let seen = |window: &Window| {
        let picture = window.state().picture().unwrap();
        let half = picture.width as usize / 2;
        [0, 1].map(|side| {
            let ids =
                picture.volume_id.iter().enumerate().filter(|(n, id)| **id > 0 && usize::from(n % picture.width as usize >= half) == side);
            ids.map(|(_, id)| *id).collect::<std::collections::BTreeSet<_>>().into_iter().collect::<Vec<_>>()
        })
    };
    assert_eq!(seen(&window), [[1], [2]]);
    let take = |window: &mut Window, side: &str, name: &str| {
        window.get_by_label(side).click();
        window.run_steps(3);
        // The list hangs on its chooser; the same name stands on the scan's card, too.
        let chooser = window.get_by_label(side).rect().center();
        let away = |entry: &egui_kittest::Node<'_>| entry.rect().center().distance(chooser);
        let entry = window.get_all_by_label(name).min_by(|a, b| away(a).total_cmp(&away(b))).unwrap();
        entry.click();
        window.run_steps(2);
        settle(window);
    };
    let name = |n: usize| files[n].file_name().unwrap().to_string_lossy().into_owned();
    take(&mut window, "Second scan compared", &name(2));
    assert_eq!(seen(&window), [[1], [3]]);
    // What stands on the other side changes places with it.
    take(&mut window, "First scan compared", &name(2));
    assert_eq!(seen(&window), [[3], [1]]);
    screenshot(&mut window, "compare-any-two.png");
    files.iter().for_each(|file| std::fs::remove_file(file).unwrap());
}
