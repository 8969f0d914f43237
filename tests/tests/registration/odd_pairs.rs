//! Pairs that are hard to tell: walls of a voxel, and bone that only one scan shows.

use super::*;

#[test]
fn walls_of_a_voxel_keep_front_and_back_apart() {
    // Fails if the front of a thin wall finds its partner on the wall's back: the pose would be off by a wall.
    let shell = |half_mm: f64| {
        solid(move |p| {
            let egg = (p / DVec3::new(1.0, 0.8, 0.65)).length() - 24.0 + 2.0 * (0.2 * p.x).sin() * (0.15 * p.y).cos();
            0.65 * egg.abs() - half_mm
        })
    };
    let thin = shell(0.5);
    for seed in 0..seeds(3) {
        let start = motion(&mut random(seed + 400), DVec3::ZERO, 4.0, 1.5);
        for by in [By::Surfaces, By::Intensities] {
            let found = brought_together(by, [&thin, &thin], [100.0; 2], Some(start));
            let off = apart(&thin.grid().corners_mm(), &found.registration.transform, &DAffine3::IDENTITY);
            println!("walls of 1 mm and a voxel, by {by:?}: {off:.5} mm, {:.0} % have partners", 100.0 * report(&found).matched);
            assert!(off < 0.02 && report(&found).matched > 0.8, "{by:?}: {off}");
        }
    }
}

#[test]
fn a_neck_in_one_scan_alone_moves_nothing() {
    // Fails if vertebrae that only one scan shows pull at the pose, or the other has no jaw.
    let skull = Arc::new(skull(Which::A, 96, &Progress::default()).unwrap());
    let surface = Surface::new(&skull, 226.0, DAffine3::IDENTITY).unwrap();
    let points: Vec<DVec3> = Cloud::of(&surface, 500, &Progress::default()).unwrap().points.iter().map(|p| p.point).collect();
    let [low, high] = points.iter().fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[l, h], p| [l.min(*p), h.max(*p)]);
    let line = low.z + 0.35 * (high.z - low.z);
    // Rings of bone behind the jaw, down to the end of the scan.
    let neck = |p: DVec3| {
        let ring = ((p.truncate() - glam::DVec2::new(0.0, 45.0)).length() - 22.0).abs() - 4.0;
        let disc = 9.0 - (p.z.rem_euclid(26.0) - 13.0).abs();
        (p.z < line - 10.0).then(|| 2_000.0 * (0.5 - ring.max(-disc) / 2.0).clamp(0.0, 1.0) - 1_000.0)
    };
    let with_neck = valued(&skull, DAffine3::IDENTITY, |p, value| neck(p).map_or(value, |of_neck| of_neck.max(value)));
    let crown = copied(&skull, DAffine3::IDENTITY, |p| p.z > line);
    let near = Some(motion(&mut random(8), middle(&skull), 10.0, 10.0));
    for (what, fixed, starts) in [("neck", &skull, &[near][..]), ("neck and no jaw", &crown, &[near, None])] {
        for (by, start) in starts.iter().flat_map(|start| [(By::Surfaces, *start), (By::Intensities, *start)]) {
            let found = brought_together(by, [&with_neck, fixed], [226.0; 2], start);
            let off = apart(&points, &found.registration.transform, &DAffine3::IDENTITY);
            println!(
                "{what} in one scan, by {by:?} from {}: {off:.4} mm, {:.0} % have partners",
                start.map_or("anywhere", |_| "near"),
                100.0 * report(&found).matched
            );
            // Values just beyond where a scan ends are blurred with air, of 2.2 mm: a fiftieth of a voxel.
            let most_mm = if by == By::Surfaces { 0.005 } else { 0.05 };
            assert!(off < most_mm, "{what}, {by:?}: {off}");
            assert!(report(&found).matched < 0.98, "the neck is there: {}", report(&found).matched);
        }
    }
}
