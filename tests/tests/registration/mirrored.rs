//! One side of a skull in place of the other.

use super::*;
use bregma_register::Parts;
use bregma_register::cloud::Oriented;
use bregma_register::orient::symmetry;

#[test]
fn the_mirror_image_stands_for_a_side_that_is_missing() {
    // Fails if what is missing pulls the plane to one side, or the image is laid elsewhere than the plane has it.
    let skull = Arc::new(skull(Which::A, 128, &Progress::default()).unwrap());
    let whole = Surface::new(&skull, 226.0, DAffine3::IDENTITY).unwrap();
    let all = Cloud::of(&whole, 20_000, &Progress::default()).unwrap();
    let mirror = DAffine3::from_mat3(DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)));
    let own = Surface::new(&skull, 226.0, mirror).unwrap();
    let own = Cloud::of(&own, 60_000, &Progress::default()).unwrap();
    for (what, front_mm) in [("left face", -10.0), ("left half below the vault", f64::INFINITY)] {
        let missing = |p: DVec3| p.x > 12.0 && p.y < front_mm && p.z < 30.0;
        let rest = copied(&skull, DAffine3::IDENTITY, |p| !missing(p));
        let surface = Surface::new(&rest, 226.0, DAffine3::IDENTITY).unwrap();
        let found = symmetry(&surface, &Parts::default(), &Progress::default()).unwrap();
        assert!(found.image.matrix3.determinant() < 0.0);
        let image = Surface::new(&rest, 226.0, found.image).unwrap();
        let image = Cloud::of(&image, 60_000, &Progress::default()).unwrap();
        // Well inside of what is missing.
        let gone: Vec<Oriented> = all.points.iter().filter(|p| missing(p.point + DVec3::new(-6.0, 6.0, 6.0))).copied().collect();
        let distances = |on: &Cloud<'_>| {
            let mut all: Vec<f64> = gone.iter().filter_map(|p| Some(on.root(*p, 3.0, 0.5)?.point.distance(p.point))).collect();
            all.sort_by(f64::total_cmp);
            (all.len() as f64 / gone.len() as f64, all[all.len() / 2], all[all.len() * 95 / 100])
        };
        let ((share, median, most), (_, own_median, own_most)) = (distances(&image), distances(&own));
        println!(
            "{what} by the mirror image: {:.0} % of it, half within {median:.3} mm, 95 % within {most:.3}; the phantom's own sides: {own_median:.3}, {own_most:.3}",
            100.0 * share
        );
        assert!(share > 0.95 && median < 0.1 && most < 0.3, "{what}: {share} {median} {most}");
    }
}
