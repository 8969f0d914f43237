//! A part that moved as a whole: the phantom's jaw, whose displacement is known, and parts of which no motion can be told.

use super::*;
use bregma_field::Progress;
use bregma_register::{Part, Parts};
use bregma_session::difference::{DifferenceError, Measured, measure};
use bregma_session::{DifferenceBy, DifferenceOrder, Opened, PartError, Source};
use bregma_synthetic::skull::MANDIBLE_SHIFT_MM;
use bregma_synthetic::{Which, skull};
use bregma_tests::volume;

fn of_part(a: &Arc<Volume>, b: &Arc<Volume>, iso: f64, only: Vec<Part>, reach_mm: Option<f64>) -> Result<Measured, DifferenceError> {
    let mut opened = Opened::new(vec![Source::default(), Source::default()], vec![Arc::clone(a), Arc::clone(b)]);
    opened.scene.layers.iter_mut().for_each(|layer| layer.iso = iso);
    let parts = Parts { only, but: vec![] };
    let order = DifferenceOrder { by: DifferenceBy::Displacement, pair: [0, 1], reach_mm, parts, clips: vec![] };
    measure(&opened, &order, &Progress::default())
}

/// Below the teeth, where only the jaw is.
const JAW: Part = Part::Box { low_mm: DVec3::new(-75.0, -105.0, -125.0), high_mm: DVec3::new(75.0, 15.0, -98.0) };

#[test]
fn the_jaw_moved_as_it_was_moved() {
    // Fails if the way is told backwards, the part's neighbours take part, or the ± is of something else.
    let [a, b] = [Which::A, Which::B].map(|which| Arc::new(skull(which, 128, &Progress::default()).unwrap()));
    let found = of_part(&a, &b, 226.0, vec![JAW], None).unwrap();
    let moved = found.moved.as_ref().unwrap();
    let off = moved.shift_mm - MANDIBLE_SHIFT_MM;
    println!("{}; off by {off:.3} mm", moved.told());
    assert!(off.abs().max_element() <= 0.1, "wanted within 0.1 mm: {off}");
    assert!(off.abs().cmple(moved.shift_error_mm).all(), "{off} beyond ± {}", moved.shift_error_mm);
    // B's scan is blurred more, and its samples lie farther apart: the jaw's lower border, which is thin and curved, lies higher in it.
    let without = moved.without_blur.transform_point3(moved.middle_mm) - moved.middle_mm - MANDIBLE_SHIFT_MM;
    println!("without blur off by {without:.3} mm");
    assert!(without.length() < 0.5 * off.length(), "{without}");
    assert!(moved.turn_deg < 0.5 && moved.shift_error_mm.max_element() < 1.0);
    for half in &found.halves {
        let s = half.statistics.as_ref().unwrap();
        let truth = MANDIBLE_SHIFT_MM.length();
        println!("on {}: mean {:.3} of {truth:.3} mm, {} points", half.name, s.mean_mm, s.count);
        assert!((s.mean_mm - truth).abs() < 0.1 && s.sure == 1.0 && s.without_mm2 == 0.0);
        // Partners are where the points have gone to, or come from.
        let sign = if std::ptr::eq(half, &found.halves[0]) { 1.0 } else { -1.0 };
        for n in (0..half.asked.len()).filter(|n| half.asked[*n]).step_by(97) {
            let way = half.map.partners_mm[n].as_dvec3() - half.mesh.vertices[n];
            assert!((way - sign * MANDIBLE_SHIFT_MM).length() < 0.4, "{way}");
        }
    }
    assert!(found.notes.iter().any(|note| note.contains("moved by")));
}

#[test]
fn what_did_not_move_is_not_called_moved() {
    // Fails if noise of a pose is told as a displacement: the cranial base of both skulls lies where it was.
    let [a, b] = [Which::A, Which::B].map(|which| Arc::new(skull(which, 96, &Progress::default()).unwrap()));
    let crown = Part::Ball { centre_mm: DVec3::new(0.0, 60.0, 30.0), radius_mm: 50.0 };
    let found = of_part(&a, &b, 226.0, vec![crown], None).unwrap();
    let moved = found.moved.as_ref().unwrap();
    println!("{}", moved.told());
    assert!(moved.shift_mm.abs().cmple(moved.shift_error_mm + 1e-9).all());
    found.halves.iter().for_each(|half| assert!(half.statistics.as_ref().unwrap().sure < 0.05, "{:?}", half.statistics));
}

#[test]
fn parts_without_an_answer_say_so() {
    // Fails if everything, nothing, or a ball's turn gets a number.
    let grid = Grid::new([40; 3], DVec3::ONE, DVec3::splat(-19.5), DMat3::IDENTITY).unwrap();
    let ball = |name: &str, centre: DVec3| {
        let at = |n: usize| DVec3::new((n % 40) as f64, (n / 40 % 40) as f64, (n / 1600) as f64) - 19.5;
        volume(name, grid.clone(), Samples::F32((0..grid.len()).map(|n| (10.0 - at(n).distance(centre)) as f32).collect()))
    };
    let (a, b) = (ball("a", DVec3::ZERO), ball("b", DVec3::new(1.5, 0.0, 0.0)));
    assert!(matches!(of_part(&a, &b, 0.0, vec![], None), Err(DifferenceError::Part(PartError::NoPart))));
    let air = Part::Ball { centre_mm: DVec3::splat(17.0), radius_mm: 2.0 };
    assert!(matches!(of_part(&a, &b, 0.0, vec![air], None), Err(DifferenceError::Part(PartError::NotFound { .. }))));
    let whole = Part::Ball { centre_mm: DVec3::ZERO, radius_mm: 15.0 };
    let found = of_part(&a, &b, 0.0, vec![whole], Some(5.0)).unwrap();
    let moved = found.moved.as_ref().unwrap();
    println!("{}", moved.told());
    assert!((moved.shift_mm - DVec3::new(1.5, 0.0, 0.0)).length() < 0.02, "{}", moved.shift_mm);
    assert!(!moved.covariance.undetermined.is_empty());
    // Where each point of a ball went to is not known, as it may have turned.
    found.halves.iter().for_each(|half| assert_eq!(half.statistics.as_ref().unwrap().sure, 0.0));
}
