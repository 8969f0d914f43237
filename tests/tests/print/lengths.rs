//! What is as long on paper as it says.

use super::{ball, drawn, seen, sheet};
use bregma_renderer::Projection;
use bregma_session::print::marks::{Place, mm_per_mm};
use bregma_session::print::{Bar, Canvas, Panel, Print, PrintError, ratio};
use bregma_session::views::View;

/// How much of a row of pixels is not white, in pixels: each by how dark it is.
fn ink_px(canvas: &Canvas, row: usize, columns: std::ops::Range<usize>) -> f64 {
    let light = canvas.painted();
    columns.map(|x| f64::from(1.0 - light[row * canvas.size[0] as usize + x].x)).sum()
}

#[test]
fn a_bar_of_scale_has_its_length_in_pixels() {
    // Fails if dots, scale or the bar's own length are off by a pixel, or the bar hangs on the skull's size.
    for (dpi, scale, length_mm) in [(300.0, 2.0, 20.0), (600.0, 1.0, 15.0), (150.0, 3.3, 50.0), (72.0, 4.0, 100.0), (1200.0, 0.5, 3.0)] {
        let bar = Some(Bar { length_mm: Some(length_mm), at_target: false });
        let mut print = Print { scale: Some(scale), bar, ..sheet([40.0, 30.0], dpi) };
        // Cleared of all bone, so that nothing else is dark.
        let mut opened = ball();
        opened.scene.layers[0].visible = false;
        let canvas = drawn(&mut [seen(opened, View::Frontalis)], &mut print).unwrap();
        let bounds = canvas.marks[0].bounds();
        let row = ((bounds[0][1] + bounds[1][1]) / 2.0 * canvas.px_per_mm()) as usize;
        let found = ink_px(&canvas, row, 0..canvas.size[0] as usize);
        let wanted = length_mm / scale * dpi / 25.4;
        assert!((found - wanted).abs() < 1.0, "{dpi} dpi, {}: {found} px, {wanted} wanted", ratio(scale));
    }
}

#[test]
fn a_skull_is_as_large_on_paper_as_the_scale_says() {
    // Fails if the height of the view, the size of a cell or the strip below it change the scale.
    for (dpi, scale, caption) in [(300.0, 1.0, None), (254.0, 2.0, Some("Two lines of words. ".repeat(4))), (150.0, 0.7, None)] {
        let mut print = Print { scale: Some(scale), caption, samples: 16, ..sheet([70.0, 66.0], dpi) };
        let mut opened = ball();
        opened.scene.background = None;
        let canvas = drawn(&mut [seen(opened, View::LateralisDextra)], &mut print).unwrap();
        let (width, wanted) = (canvas.size[0] as usize, 40.0 / scale * dpi / 25.4);
        let covered = |row: usize| canvas.light[row * width..(row + 1) * width].iter().map(|light| f64::from(light.w)).sum::<f64>();
        let across = (0..canvas.size[1] as usize).map(covered).fold(0.0, f64::max);
        assert!((across - wanted).abs() < 1.0, "{dpi} dpi, {}: {across} px, {wanted} wanted", ratio(scale));
    }
}

#[test]
fn what_is_aimed_fills_its_room_and_lies_in_the_middle_of_it() {
    // Fails if marks lie on the skull, or it is smaller than it could be.
    let mut print = Print { letters: true, bar: Some(Bar { length_mm: None, at_target: false }), samples: 4, ..sheet([60.0, 60.0], 200.0) };
    let mut opened = ball();
    opened.scene.background = None;
    let canvas = drawn(&mut [seen(opened, View::Frontalis)], &mut print).unwrap();
    let [width, height] = canvas.size.map(|n| n as usize);
    let covers = |x: usize, y: usize| canvas.light[y * width + x].w > 0.5;
    let rows: Vec<usize> = (0..height).filter(|y| (0..width).any(|x| covers(x, *y))).collect();
    let columns: Vec<usize> = (0..width).filter(|x| (0..height).any(|y| covers(*x, y))).collect();
    let mm = |px: usize| px as f64 / canvas.px_per_mm();
    let [left, top, right, bottom] = print.insets_mm();
    // The height is what is short here: the bar takes more of it than letters take of the width. A small picture told where the bone is.
    let high = mm(rows[rows.len() - 1] + 1 - rows[0]);
    assert!((high - (60.0 - top - bottom)).abs() < 0.3, "{high}");
    assert!((mm(rows[0]) - top).abs() < 0.3);
    let margins = [mm(columns[0]) - left, 60.0 - right - mm(columns[columns.len() - 1] + 1)];
    assert!((margins[0] - margins[1]).abs() < 0.3, "{margins:?}");
}

#[test]
fn perspective_has_no_scale_and_a_bar_only_where_it_says_so() {
    // Fails if a bar or a scale is drawn in perspective as if it held everywhere.
    let perspective = || Panel { aim: None, ..seen(ball(), View::Frontalis) };
    let mut print = Print { scale: Some(2.0), ..sheet([40.0, 40.0], 100.0) };
    let refused = drawn(&mut [perspective()], &mut print).unwrap_err();
    assert!(matches!(refused, PrintError::ScaleInPerspective), "{refused}");
    let mut print = Print { bar: Some(Bar { length_mm: Some(10.0), at_target: false }), ..sheet([40.0, 40.0], 100.0) };
    let refused = drawn(&mut [perspective()], &mut print).unwrap_err();
    assert!(refused.to_string().contains("--ortho") && refused.to_string().contains("--bar-at target"), "{refused}");
    print.bar = Some(Bar { length_mm: Some(10.0), at_target: true });
    let panel = perspective();
    let camera = panel.opened.scene.camera;
    let canvas = drawn(&mut [panel], &mut print).unwrap();
    assert!(canvas.marks.iter().any(|mark| mark.words == "10 mm at the distance of the target"));
    // As long as it is there: by the angle of the view.
    let Projection::Perspective { fov_deg } = camera.projection else { panic!("scenes open in perspective") };
    let high_mm = 2.0 * (fov_deg / 2.0).to_radians().tan() * camera.eye_mm.distance(camera.target_mm);
    let bounds = canvas.marks[0].bounds();
    let place = Place { at: [0.0; 2], size: canvas.size_mm() };
    assert!((bounds[1][0] - bounds[0][0] - 10.0 * canvas.size_mm()[1] / high_mm).abs() < 1e-6);
    assert!((mm_per_mm(&camera, place) - high_mm / canvas.size_mm()[1]).abs() < 1e-9);
    let long = PrintError::LongBar { length_mm: 5000.0, room_mm: 0.0 };
    let mut print = Print { bar: Some(Bar { length_mm: Some(5000.0), at_target: false }), ..sheet([40.0, 40.0], 100.0) };
    let refused = drawn(&mut [seen(ball(), View::Frontalis)], &mut print).unwrap_err();
    assert_eq!(std::mem::discriminant(&refused), std::mem::discriminant(&long));
}

#[test]
fn pictures_of_a_plate_have_one_scale_and_one_bar() {
    // Fails if a picture of a plate is drawn at a scale of its own, a label is given twice, or there are several bars.
    let bar = Some(Bar { length_mm: Some(20.0), at_target: false });
    let mut print = Print { bar, label: Some("A".into()), columns: Some(2), ..sheet([90.0, 100.0], 100.0) };
    let mut large = seen(ball(), View::Verticalis);
    // A larger thing sets the scale of all.
    large.opened.scene.layers[0].iso = -3.0;
    let mut panels = [seen(ball(), View::Frontalis), large, seen(ball(), View::Basilaris)];
    let canvas = drawn(&mut panels, &mut print).unwrap();
    let heights = panels.each_ref().map(|panel| match panel.opened.scene.camera.projection {
        Projection::Orthographic { height_mm } => height_mm,
        Projection::Perspective { .. } => f64::NAN,
    });
    assert!(heights.iter().all(|h| *h == heights[0]), "{heights:?}");
    let words: Vec<&str> = canvas.marks.iter().map(|mark| mark.words.as_str()).collect();
    assert_eq!(words.iter().filter(|w| ["A", "B", "C"].contains(w)).count(), 3, "{words:?}");
    assert_eq!(words.iter().filter(|w| **w == "20 mm").count(), 1);
    // Its bar holds for each of them.
    let at = words.iter().position(|w| w.starts_with("bar of scale")).unwrap();
    let bounds = canvas.marks[at].bounds();
    let cell_mm = f64::from(print.size_px[1] / 2) / canvas.px_per_mm();
    assert!((bounds[1][0] - bounds[0][0] - 20.0 * cell_mm / heights[0]).abs() < 1e-9);
    let mut in_perspective = [seen(ball(), View::Frontalis), Panel { aim: None, ..seen(ball(), View::Frontalis) }];
    assert!(matches!(drawn(&mut in_perspective, &mut print), Err(PrintError::PlateInPerspective)));
}

#[test]
fn sizes_that_cannot_be_are_sentences() {
    // Fails if a sheet of no pixels, or of more than fit, is drawn or panics.
    assert_eq!(Print::pixels([85.0, 100.0], 600.0), [2008, 2362]);
    assert_eq!([ratio(2.0), ratio(0.5), ratio(2.13), ratio(1.0)], ["1:2", "2:1", "1:2.13", "1:1"]);
    for (print, part) in [
        (sheet([1000.0, 1000.0], 1200.0), "16384"),
        (sheet([0.001, 1.0], 300.0), "cannot be drawn"),
        (Print { type_pt: f64::NAN, ..sheet([30.0, 30.0], 100.0) }, "not above 0"),
        (Print { caption: Some("words ".repeat(90)), ..sheet([30.0, 30.0], 100.0) }, "no room"),
    ] {
        let refused = drawn(&mut [seen(ball(), View::Frontalis)], &mut print.clone()).unwrap_err().to_string();
        assert!(refused.contains(part), "{refused}");
    }
}
