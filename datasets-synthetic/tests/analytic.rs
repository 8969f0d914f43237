//! The analytic volumes agree with their own answers.

use bregma_synthetic::analytic::{MarschnerLobb, Plane, Saddle, Shell, Sphere};
use bregma_volume::{Grid, ReadSamples, Volume};
use glam::{DMat3, DVec2, DVec3, dvec3};

fn grid() -> Grid {
    Grid::new([21; 3], DVec3::splat(0.5), DVec3::splat(-5.0), DMat3::IDENTITY).expect("a cube")
}

fn sample(volume: &Volume, [i, j, k]: [usize; 3]) -> f64 {
    volume.samples().get_f64((k * 21 + j) * 21 + i)
}

#[test]
fn shell_chords_are_those_of_circles() {
    // Fails if an inner crossing is lost or the far wall is measured from the near one.
    let shell = Shell { centre: dvec3(1.0, 2.0, 3.0), inner_mm: 3.0, outer_mm: 5.0 };
    let ray = |x: f64| shell.segments_mm(dvec3(1.0 + x, 2.0, -97.0), DVec3::Z);
    assert_eq!(ray(0.0), [[95.0, 97.0], [103.0, 105.0]]);
    assert_eq!(ray(4.0), [[97.0, 103.0]]);
    assert!(ray(5.1).is_empty());
    let [first, second] = ray(1.8)[..] else { panic!("two walls") };
    let length = (25.0 - 3.24_f64).sqrt() - 2.4;
    assert!((first[1] - first[0] - length).abs() < 1e-12 && (second[1] - second[0] - length).abs() < 1e-12);
}

#[test]
fn volumes_are_zero_on_their_surfaces_and_positive_inside() {
    // Fails if a sign is turned, or samples are written in another order than i fastest.
    let g = grid();
    let plane = Plane { point: dvec3(1.0, 0.0, 0.0), normal: DVec3::X };
    assert_eq!(sample(&plane.volume(&g), [12, 3, 4]), 0.0);
    assert_eq!(sample(&plane.volume(&g), [8, 3, 4]), 2.0);
    assert_eq!(plane.crossing(DVec3::ZERO, dvec3(0.5, 1.0, 0.0)), Some(2.0));
    assert_eq!(plane.crossing(DVec3::ZERO, DVec3::Y), None);
    let sphere = Sphere { centre: DVec3::ZERO, radius_mm: 4.0 };
    assert_eq!(sample(&sphere.volume(&g), [10, 18, 10]), 0.0);
    let shell = Shell { centre: DVec3::ZERO, inner_mm: 2.0, outer_mm: 4.0 }.volume(&g);
    assert_eq!([4, 6, 8].map(|d| sample(&shell, [10, 10, 10 + d])), [0.0, 1.0, 0.0]);
}

#[test]
fn saddle_crossings_are_roots_in_order() {
    // Fails if the quadratic loses a root or one to cancellation.
    let saddle = Saddle { centre: dvec3(0.1, 0.2, 0.3), scale_mm: 2.0 };
    let (o, d) = (dvec3(-4.0, -3.0, 1.0), dvec3(0.6, 0.5, 0.1));
    let roots = saddle.crossings(o, d);
    assert!(roots.len() == 2 && roots[0] < roots[1], "{roots:?}");
    assert!(roots.iter().all(|t| saddle.value(o + *t * d).abs() < 1e-12));
    assert_eq!(saddle.crossings(saddle.centre + DVec3::Z, DVec3::Z), [-1.0]);
    assert!(sample(&saddle.volume(&grid()), [10, 10, 0]) > 0.0);
}

#[test]
fn marschner_lobb_has_its_height() {
    // Fails if the formula or its inverse lost a factor; the centre's value is the paper's: (1 + α·2)/(2 + 2α) = 0.6.
    let signal = MarschnerLobb { centre: dvec3(1.0, 2.0, 3.0), half_side_mm: 20.0 };
    assert!((signal.value(signal.centre) - 0.6).abs() < 1e-12);
    for n in 0..100 {
        let xy = DVec2::new(1.0, 2.0) + 12.0 * DVec2::from_angle(n as f64);
        let z = signal.height_mm(xy + 0.05 * n as f64, 0.5).unwrap();
        assert!((signal.value((xy + 0.05 * n as f64).extend(z)) - 0.5).abs() < 1e-12);
    }
}
