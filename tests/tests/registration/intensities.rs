//! Scans of one object brought together by their values: unlike gains, kernels, windows and grids.

use super::*;

/// What a value becomes.
type Scale<'a> = &'a dyn Fn(f64) -> f64;

/// The phantom made again, moved by a motion that is given back: its values through `values` after a blur of `blur_mm`, on a sheared grid.
fn made_again(skull: &Arc<Volume>, blur_mm: f64, seed: u64, values: impl Fn(f64) -> f64) -> (Arc<Volume>, DAffine3) {
    let mut random = random(seed);
    let truth = motion(&mut random, middle(skull), 12.0, 4.0);
    let (dims, back) = (skull.grid().dims(), truth.inverse());
    let step = 1.04 * skull.grid().spacing_mm();
    let shear = DMat3::from_cols(DVec3::X, DVec3::Y, DVec3::new(0.1, -0.25, 0.97));
    let half = shear * (0.5 * step * DVec3::from(dims.map(|n| n as f64 - 1.0)));
    let straight = Grid::new(dims, step, DVec3::ZERO, DMat3::IDENTITY).unwrap();
    let grid = straight.moved(DAffine3::from_mat3_translation(shear, middle(skull) - half)).unwrap();
    let surface = Surface::new(skull, 0.0, DAffine3::IDENTITY).unwrap();
    let air = skull.range()[0];
    let around = [-1.0, 1.0].map(|x| [-1.0, 1.0].map(|y| [-1.0, 1.0].map(|z| blur_mm * DVec3::new(x, y, z))));
    let samples = (0..grid.len()).map(|n| {
        let index = [n % dims[0], n / dims[0] % dims[1], n / (dims[0] * dims[1])].map(|i| i as f64);
        let point = back.transform_point3(grid.world(IndexPoint(index.into())).0);
        let at = |off: &DVec3| depth_at(&surface, WorldPoint(point + *off)).map_or(air, |(depth, _)| depth + surface.level);
        let blurred = around.as_flattened().as_flattened().iter().map(at).sum::<f64>() / 8.0;
        let noise = (0..12).map(|_| random.unit()).sum::<f64>() - 6.0;
        values(blurred + 15.0 * noise) as f32
    });
    let samples = Samples::F32(samples.collect());
    (bregma_tests::volume("again", grid, samples), truth)
}

#[test]
fn values_of_another_scale_kernel_or_window_land_where_they_were() {
    // Fails if a gain, an offset, a blur, a window that cuts values off, an isovalue that is off or a sheared grid moves the pose.
    let skull = Arc::new(skull(Which::A, 96, &Progress::default()).unwrap());
    let spacing_mm = skull.grid().spacing_mm().x;
    let surface = Surface::new(&skull, 226.0, DAffine3::IDENTITY).unwrap();
    let points: Vec<DVec3> = Cloud::of(&surface, 500, &Progress::default()).unwrap().points.iter().map(|p| p.point).collect();
    let unlike = |v: f64| 0.031 * v + 77.0;
    let window = |v: f64| ((v + 150.0) * 255.0 / 1_000.0).clamp(0.0, 255.0).round();
    let turned = |v: f64| 900.0 * (v.max(-1000.0) / 1000.0 + 1.0).powf(0.7);
    let cases: [(&str, f64, Scale<'_>, f64); 4] = [
        ("gain and offset on a sheared grid", 0.0, &unlike, 0.01),
        ("gain, offset and another blur", 0.8, &unlike, 0.08),
        ("an 8-bit window", 0.5, &window, 0.03),
        ("a curved scale", 0.5, &turned, 0.05),
    ];
    for (what, blur, values, most_mm) in cases {
        let (again, truth) = made_again(&skull, blur * spacing_mm, 5, values);
        let start = truth * motion(&mut random(6), middle(&skull), 10.0, 10.0);
        let isovalues = [226.0, values(260.0)];
        let [(of_surfaces_mm, _), (off_mm, found)] = [By::Surfaces, By::Intensities].map(|by| {
            let found = brought_together(by, [&skull, &again], isovalues, Some(start));
            (apart(&points, &found.registration.transform, &truth), found)
        });
        let report = found.report.intensities.unwrap();
        let at = found.registration.covariance.as_ref().unwrap();
        println!(
            "{what}: {off_mm:.4} mm by values, {:.4} by surfaces, of {spacing_mm:.2} mm; correlation {:.4}, {:.0} % count, middle ± {:.4} mm",
            of_surfaces_mm,
            report.correlation,
            100.0 * report.matched,
            at.variance_at(at.centre_mm, DVec3::X).sqrt()
        );
        assert!(off_mm <= most_mm && report.correlation > 0.9, "{what}: {off_mm}");
    }
}

#[test]
fn a_moved_jaw_pulls_at_no_values() {
    // Fails if values that differ, as those of a moved jaw do, count as much as those that agree.
    let [a, b] = [Which::A, Which::B].map(|which| Arc::new(skull(which, 128, &Progress::default()).unwrap()));
    let surface = Surface::new(&b, 226.0, DAffine3::IDENTITY).unwrap();
    let points: Vec<DVec3> = Cloud::of(&surface, 500, &Progress::default()).unwrap().points.iter().map(|p| p.point).collect();
    let start = motion(&mut random(2), middle(&b), 15.0, 15.0);
    for by in [By::Surfaces, By::Intensities] {
        let found = brought_together(by, [&b, &a], [226.0; 2], Some(start));
        let off_mm = apart(&points, &found.registration.transform, &DAffine3::IDENTITY);
        println!("phantom pair of 128³ by {by:?}: {off_mm:.4} mm");
        assert!(off_mm <= 0.06, "{by:?}: {off_mm}");
    }
}

#[test]
fn two_series_of_one_phantom_land_alike() {
    // Told: a real pair of unlike slices; fails if values lead elsewhere than surfaces by more than the slices' own errors.
    let Some(folder) = data("two_series_of_one_phantom_land_alike") else { return };
    let phantom = |name: &str| {
        Arc::new(formats::open(&folder.join("phantom-philips").join(name), &Default::default(), &Progress::default()).unwrap())
    };
    let (straight, tilted) = (phantom("straight"), phantom("tilted"));
    let points = straight.grid().corners_mm();
    let mut poses = vec![];
    for iso in [226.0, -300.0] {
        let found = brought_together(By::Intensities, [&tilted, &straight], [iso; 2], Some(DAffine3::IDENTITY));
        let report = found.report.intensities.unwrap();
        println!(
            "phantom at {iso} HU by values: correlation {:.4}, {:.3} mm from where surfaces led, shift at the middle {:.3}",
            report.correlation,
            report.moved_mm,
            found.registration.transform.transform_point3(middle(&tilted)) - middle(&tilted)
        );
        assert!(report.correlation > 0.9 && report.moved_mm < 0.3, "{report:?}");
        poses.push(found.registration.transform);
    }
    println!("the two isovalues' poses differ by {:.3} mm at the corners", apart(&points, &poses[0], &poses[1]));
}
