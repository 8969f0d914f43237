//! The chart of speed and accuracy.

use super::*;

/// Of solvers with a marker of their own colour in the chart the one that shows most of it, and the middle of that. Which markers and names lie
/// over each other is a matter of how long each solver took.
fn marker<'a>(window: &mut Window, solvers: &[(&'a str, [u8; 3])]) -> (&'a str, Pos2) {
    let shot = window.render().expect("the window is drawn by wgpu");
    // In the upper part of the window, where no row of the chart's table is.
    let shown = |color: [u8; 3]| -> Vec<(u32, u32)> {
        shot.enumerate_pixels().filter(|(_, y, p)| *y < 560 && p.0[..3] == color).map(|(x, y, _)| (x, y)).collect()
    };
    let (solver, found) = solvers.iter().map(|(solver, color)| (*solver, shown(*color))).max_by_key(|(_, f)| f.len()).unwrap();
    assert!(found.len() > 20, "no marker of {solver}: {} pixels", found.len());
    let mean = |v: fn(&(u32, u32)) -> u32| found.iter().map(v).sum::<u32>() as f32 / found.len() as f32;
    (solver, Pos2::new(mean(|p| p.0), mean(|p| p.1)))
}

#[test]
fn the_chart_is_measured_on_the_open_view_and_its_points_switch_the_picture() {
    // Fails if the chart cannot be measured or cancelled from the window, if a clicked point neither draws by its solver nor shows its
    // errors, or if the way back to the exact solver is lost.
    let file = ball("chart", 24);
    let source = bregma_session::Source { file: file.clone(), ..Default::default() };
    let mut window = open(Start::Files(vec![source]));
    wait(&mut window, "the scan", |w| !w.is_loading());
    settle(&mut window);
    let menu = |window: &mut Window, entry: &str| {
        window.get_by_label("View").click();
        window.run_steps(2);
        window.get_by_label_contains(entry).click();
        window.run_steps(3);
    };
    menu(&mut window, "Speed and accuracy");
    window.get_by_label("Measure this view").click();
    window.run_steps(2);
    window.get_by_label("Cancel").click();
    window.run_steps(2);
    assert!(window.state().chart().is_none(), "a cancelled measurement leaves nothing");
    window.get_by_label("Measure this view").click();
    wait(&mut window, "the chart", |w| w.chart().is_some());
    window.run_steps(3);
    let exact = pixels(&window);
    assert!(window.state().chart().unwrap().points.len() >= 13);
    window.get_by_label("linear on CPU").click();
    window.run_steps(3);
    settle(&mut window);
    assert_eq!(window.state().scene().solver.to_string(), "linear");
    assert_eq!(window.state().charted().unwrap().solver.to_string(), "linear");
    assert!(changed(&exact, &pixels(&window)) > 100, "linear interpolation looks different");
    window.get_by_label_contains("which is not exact");
    window.get_by_label("Error picture");
    screenshot(&mut window, "chart.png");
    // A click on a point of the plot does the same: of exact's row first, then on a marker of a colour that no other has.
    window.get_by_label("exact on CPU").click();
    window.run_steps(3);
    assert_eq!(window.state().charted().unwrap().solver.to_string(), "exact");
    let (solver, at) = marker(&mut window, &[("linear", [230, 159, 0]), ("analytic", [204, 121, 167])]);
    click(&mut window, at);
    window.run_steps(2);
    assert_eq!(window.state().charted().unwrap().solver.to_string(), solver);
    menu(&mut window, "Draw by the exact solver");
    settle(&mut window);
    assert_eq!(changed(&exact, &pixels(&window)), 0);
    std::fs::remove_file(&file).unwrap();
}
