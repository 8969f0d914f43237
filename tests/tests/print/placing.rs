//! Marks where they belong: letters by the sides of the body, views held by landmarks, points before and behind bone.

use super::{ball, drawn, seen, sheet};
use bregma_field::WorldPoint;
use bregma_renderer::{Basis, Color};
use bregma_session::Landmark;
use bregma_session::print::marks::{Place, Tint, letters};
use bregma_session::print::{Aim, Canvas, Panel, Print};
use bregma_session::views::{View, held};
use bregma_synthetic::Random;
use glam::{DAffine3, DQuat, DVec3};

/// What stands at the left, the right, the top and the bottom of a view: of one who looks at the patient.
const SIDES: [(View, [&str; 4]); 6] = [
    (View::Frontalis, ["R", "L", "S", "I"]),
    (View::Occipitalis, ["L", "R", "S", "I"]),
    (View::LateralisSinistra, ["A", "P", "S", "I"]),
    (View::LateralisDextra, ["P", "A", "S", "I"]),
    (View::Verticalis, ["L", "R", "A", "P"]),
    (View::Basilaris, ["R", "L", "A", "P"]),
];

/// Whether something is drawn in a box of the sheet, mm.
fn has_ink(canvas: &Canvas, [low, high]: [[f64; 2]; 2]) -> bool {
    let light = canvas.painted();
    let px = |mm: f64| (mm * canvas.px_per_mm()) as usize;
    (px(low[1])..=px(high[1])).any(|y| (px(low[0])..=px(high[0])).any(|x| light[y * canvas.size[0] as usize + x].x < 0.5))
}

#[test]
fn letters_stand_where_the_sides_of_the_body_are() {
    // Fails if left and right are exchanged in any view, the classic error of this field, or a letter is not drawn at its edge.
    for (view, sides) in SIDES {
        let mut print = Print { letters: true, ..sheet([50.0, 40.0], 200.0) };
        let mut panels = [seen(ball(), view)];
        let canvas = drawn(&mut panels, &mut print).unwrap();
        let camera = panels[0].opened.scene.camera;
        let place = Place { at: [0.0; 2], size: print.size_mm() };
        let marks = letters(&camera, place, &print, Tint::on(Some(Color([1.0; 3]))));
        assert_eq!(marks.iter().map(|mark| mark.words.as_str()).collect::<Vec<_>>(), sides, "{view:?}");
        assert!(marks.iter().all(|mark| canvas.marks.contains(mark)));
        let edges = marks.iter().map(|mark| mark.bounds()).collect::<Vec<_>>();
        assert!(edges[0][1][0] < 5.0 && edges[1][0][0] > 45.0 && edges[2][1][1] < 6.0 && edges[3][0][1] > 34.0, "{edges:?}");
        assert!(edges.iter().all(|bounds| has_ink(&canvas, *bounds)), "{view:?}");
        // By the geometry itself: what lies to the patient's left is where the L is.
        for (side, letter) in sides.into_iter().enumerate() {
            let body = match letter {
                "L" => DVec3::X,
                "R" => DVec3::NEG_X,
                "P" => DVec3::Y,
                "A" => DVec3::NEG_Y,
                "S" => DVec3::Z,
                _ => DVec3::NEG_Z,
            };
            let [w, h] = [500, 400];
            let at = |p: DVec3| camera.project(WorldPoint(p), w, h).unwrap();
            let (middle, moved) = (at(camera.target_mm), at(camera.target_mm + 5.0 * body));
            let toward = [middle.0 - moved.0, moved.0 - middle.0, middle.1 - moved.1, moved.1 - middle.1][side];
            assert!(toward > 1.0, "{view:?}: {letter}");
        }
    }
}

#[test]
fn a_skull_that_is_held_lies_level_in_every_view() {
    // Fails if the Frankfurt horizontal is tilted in a picture, upside down, or the wrong landmarks hold it.
    let mut random = Random(21);
    let points = [("po l", [60.0, 10.0, -40.0]), ("po r", [-58.0, 12.0, -38.0]), ("eye", [35.0, -72.0, -36.0])];
    let names = ["po l", "po r", "eye"].map(str::to_owned);
    for n in 0..20 {
        let axis = (DVec3::new(random.unit(), random.unit(), random.unit()) - 0.5).normalize();
        let pose = DAffine3::from_rotation_translation(DQuat::from_axis_angle(axis, 0.15 * f64::from(n)), 20.0 * axis);
        let landmarks: Vec<Landmark> = points.iter().map(|(name, p)| Landmark::at(*name, pose.transform_point3((*p).into()))).collect();
        let frankfurt = held(&landmarks, Some(&names)).unwrap();
        let at = |n: usize| landmarks[n].point_mm.unwrap();
        for view in [View::Frontalis, View::LateralisSinistra, View::LateralisDextra, View::Occipitalis] {
            let opened = ball();
            let camera = view.camera(&opened.bone_points_mm(), &opened.bounds(), None, 1.3, &frankfurt);
            let Basis { up, right, forward } = camera.basis();
            let heights = [0, 1, 2].map(|n| at(n).dot(up));
            assert!(heights.iter().all(|h| (h - heights[0]).abs() < 1e-6), "{view:?}: {heights:?}");
            // The face is where the view has it.
            let ahead = at(2) - 0.5 * (at(0) + at(1));
            let (side, depth) = (ahead.dot(right), ahead.dot(forward));
            match view {
                View::Frontalis => assert!(depth < -50.0 && (at(0) - at(1)).dot(right) > 100.0),
                View::Occipitalis => assert!(depth > 50.0),
                View::LateralisSinistra => assert!(side < -50.0),
                _ => assert!(side > 50.0),
            }
        }
        for (view, toward) in [(View::Verticalis, -1.0), (View::Basilaris, 1.0)] {
            let opened = ball();
            let basis = view.camera(&opened.bone_points_mm(), &opened.bounds(), None, 1.0, &frankfurt).basis();
            let normal = (at(0) - at(1)).cross(at(2) - at(1)).normalize();
            // The plane's normal is along the view, and the face up.
            assert!((basis.forward.dot(normal).abs() - 1.0).abs() < 1e-9 && (at(2) - at(0)).dot(basis.up) > 50.0);
            let upward = frankfurt.inverse().transform_vector3(DVec3::Z);
            assert!((basis.forward.dot(upward) - toward).abs() < 1e-9);
        }
    }
    let missing = held(&[Landmark::at("po l", DVec3::ZERO)], Some(&names)).unwrap_err().to_string();
    assert!(missing.contains("po r"), "{missing}");
}

#[test]
fn what_lies_behind_bone_is_an_empty_circle() {
    // Fails if a hidden landmark looks like one that is seen, stands in another place, or lies beside its point.
    let mut opened = ball();
    let middle = DVec3::new(3.0, -2.0, 5.0);
    opened.landmarks =
        [("front", DVec3::NEG_Y), ("back", DVec3::Y), ("crown", DVec3::Z)].map(|(name, to)| Landmark::at(name, middle + 20.0 * to)).into();
    let mut print = Print { marks: true, scale: Some(1.0), ..sheet([60.0, 60.0], 150.0) };
    let mut panels = [seen(opened, View::Frontalis)];
    let canvas = drawn(&mut panels, &mut print).unwrap();
    let of = |name: &str| canvas.marks.iter().find(|mark| mark.words == format!("landmark {name}")).unwrap();
    let is_filled = |name: &str| of(name).shapes.iter().any(|shape| shape.fill.is_some());
    assert!(is_filled("front") && !is_filled("back"));
    let centre = |name: &str| {
        let [low, high] = of(name).bounds();
        [0, 1].map(|n| (low[n] + high[n]) / 2.0)
    };
    // At 1:1 the crown is 20 mm above what lies before it.
    assert!((centre("front")[1] - centre("crown")[1] - 20.0).abs() < 0.01 && (centre("front")[0] - 30.0).abs() < 0.1);
    assert!(canvas.marks.iter().any(|mark| mark.words == "crown"));
    // From the other side it is the other way round.
    panels[0].aim = Some(Aim { view: View::Occipitalis, frankfurt: None, fov_deg: None });
    let canvas = drawn(&mut panels, &mut print).unwrap();
    let of = |name: &str| canvas.marks.iter().find(|mark| mark.words == format!("landmark {name}")).unwrap();
    assert!(of("back").shapes.iter().any(|shape| shape.fill.is_some()) && of("front").shapes.iter().all(|shape| shape.fill.is_none()));
}

#[test]
fn a_caption_says_what_is_shown_and_a_legend_what_colours_mean() {
    // Fails if a caption names another view, isovalue or scale, or a legend another range than the picture has.
    let mut print = Print { caption: Some("auto".into()), legend: true, scale: Some(2.0), ..sheet([85.0, 100.0], 60.0) };
    let mut opened = super::DEMO.clone();
    opened.scene.mode = bregma_renderer::Mode::Depths;
    opened.scene.depths_within_mm = Some(8.0);
    let panel = Panel { opened, ..seen(ball(), View::Basilaris) };
    let canvas = drawn(&mut [panel], &mut print).unwrap();
    let caption = print.caption.clone().unwrap();
    for part in ["skull A", "skull B", "HU", "norma basilaris", "along the scan's axes", "parallel projection at 1:2"] {
        assert!(caption.contains(part), "{caption}");
    }
    let words: Vec<&str> = canvas.marks.iter().map(|mark| mark.words.as_str()).collect();
    for number in ["−8", "−4", "0", "4", "8"] {
        assert!(words.contains(&number), "{words:?}");
    }
    // The picture ends where the legend begins: nothing lies over it.
    let lowest = canvas.marks.iter().map(|mark| mark.bounds()[1][1]).fold(0.0, f64::max);
    assert!(lowest < 100.0 && lowest > 90.0, "{lowest}");
}
