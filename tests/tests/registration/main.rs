//! Registrations against poses that are known: scans made again on other grids, the phantom pair, two individuals with landmarks, two scans of one
//! object; and what cannot be known must be said.
//!
//! `BREGMA_SEEDS=20` (200 for the intervals) makes as many of each as docs/registration.md states; a few are made where it is not set.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod intensities;
mod mirrored;
mod odd_pairs;
mod stopping;

use bregma_field::interpolant::depth_at;
use bregma_field::{Cancelled, Grid, IndexPoint, Progress, Registration, Samples, Surface, Volume, WorldPoint, formats, read_transform};
use bregma_measure::landmarks;
use bregma_register::Part;
use bregma_register::cloud::Cloud;
use bregma_session::register::{By, Order, RegisterError, Registered, SurfaceReport, register};
use bregma_session::{Opened, Source};
use bregma_synthetic::analytic::sampled;
use bregma_synthetic::{Which, skull};
use bregma_tests::{Random, data};
use glam::{DAffine3, DMat3, DQuat, DVec3};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// How many of each to make: as the environment says, else a few.
fn seeds(few: u64) -> u64 {
    std::env::var("BREGMA_SEEDS").ok().and_then(|n| n.parse().ok()).unwrap_or(few)
}

fn random(seed: u64) -> Random {
    let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x5bd1_e995);
    // Neighbouring seeds begin alike.
    for _ in 0..16 {
        random.unit();
    }
    random
}

fn direction(random: &mut Random) -> DVec3 {
    loop {
        let v = DVec3::new(random.unit(), random.unit(), random.unit()) * 2.0 - 1.0;
        if (0.01..=1.0).contains(&v.length_squared()) {
            return v.normalize();
        }
    }
}

/// A turn by `deg` about `middle` and a shift by `mm`, each in a random direction.
fn motion(random: &mut Random, middle: DVec3, deg: f64, mm: f64) -> DAffine3 {
    let turn = DQuat::from_axis_angle(direction(random), deg.to_radians());
    DAffine3::from_rotation_translation(turn, middle + mm * direction(random) - turn * middle)
}

fn middle(volume: &Volume) -> DVec3 {
    volume.grid().corners_mm().iter().sum::<DVec3>() / 8.0
}

/// What is open, of two volumes, at `isovalues`.
fn opened(volumes: [&Arc<Volume>; 2], isovalues: [f64; 2]) -> Opened {
    let mut opened = Opened::new(vec![Source::default(), Source::default()], volumes.map(Arc::clone).into());
    opened.scene.layers.iter_mut().zip(isovalues).for_each(|(layer, iso)| layer.iso = iso);
    opened
}

fn surfaces(volumes: [&Arc<Volume>; 2], isovalues: [f64; 2], start: Option<DAffine3>) -> Registered {
    brought_together(By::Surfaces, volumes, isovalues, start)
}

fn brought_together(by: By, volumes: [&Arc<Volume>; 2], isovalues: [f64; 2], start: Option<DAffine3>) -> Registered {
    let order = Order { by, start, ..Order::default() };
    register(&opened(volumes, isovalues), [0, 1], &order, &Progress::default()).unwrap()
}

fn report(registered: &Registered) -> &SurfaceReport {
    registered.report.surfaces.as_ref().unwrap()
}

fn notes(registered: &Registered) -> String {
    registered.report.notes.join("; ")
}

/// How a scan is made again.
struct Rescan {
    voxel_mm: f64,
    /// Standard deviation of the noise, values.
    noise: f64,
    /// Only what lies within this part of the surface's points along a random direction is left.
    keep: f64,
}

/// The same object on another grid: its interpolant turned by 25°, with noise, as whole numbers of 8 bits; and the motion.
fn rescan(volume: &Arc<Volume>, how: &Rescan, random: &mut Random) -> (Arc<Volume>, DAffine3) {
    let truth = motion(random, middle(volume), 25.0, 0.3);
    let back = truth.inverse();
    let zero = Surface::new(volume, 0.0, DAffine3::IDENTITY).unwrap();
    let half = (volume.grid().corners_mm()[7] - middle(volume)) * 1.15;
    let dims = (2.0 * half / how.voxel_mm).ceil().to_array().map(|n| n as usize);
    let grid = Grid::new(dims, DVec3::splat(how.voxel_mm), middle(volume) - half, DMat3::IDENTITY).unwrap();
    let along = direction(random);
    let end = {
        let bone = Surface::new(volume, volume.default_isovalue().0, DAffine3::IDENTITY).unwrap();
        let mut depths: Vec<f64> =
            Cloud::of(&bone, 5_000, &Progress::default()).unwrap().points.iter().map(|p| p.point.dot(along)).collect();
        depths.sort_by(f64::total_cmp);
        if how.keep < 1.0 { depths[(how.keep * depths.len() as f64) as usize] } else { f64::INFINITY }
    };
    let samples = (0..grid.len()).map(|n| {
        let index = [n % dims[0], n / dims[0] % dims[1], n / (dims[0] * dims[1])].map(|i| i as f64);
        let point = back.transform_point3(grid.world(IndexPoint(index.into())).0);
        let inside = if point.dot(along) <= end { depth_at(&zero, WorldPoint(point)) } else { None };
        let noise = (0..12).map(|_| random.unit()).sum::<f64>() - 6.0;
        (inside.map_or(0.0, |(depth, _)| depth + zero.level) + how.noise * noise).round().clamp(0.0, 255.0) as u8
    });
    let samples = Samples::U8(samples.collect());
    (bregma_tests::volume("again", grid, samples), truth)
}

fn mouse(folder: &Path, name: &str) -> (Arc<Volume>, Vec<DVec3>) {
    let file = folder.join("mouse").join(format!("{name}.nii.gz"));
    let points = landmarks::read(&folder.join("mouse").join(format!("{name}.mrk.json"))).unwrap();
    (Arc::new(formats::open(&file, &Default::default(), &Progress::default()).unwrap()), points.iter().filter_map(|l| l.point_mm).collect())
}

/// Mean distance of points moved by two poses.
fn apart(points: &[DVec3], a: &DAffine3, b: &DAffine3) -> f64 {
    points.iter().map(|p| a.transform_point3(*p).distance(b.transform_point3(*p))).sum::<f64>() / points.len() as f64
}

/// Seconds of the processor that this process has had.
fn processor_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let ticks = |n: usize| stat.rsplit(')').next().and_then(|rest| rest.split_whitespace().nth(n)?.parse::<f64>().ok()).unwrap_or(0.0);
    (ticks(11) + ticks(12)) / 100.0
}

#[test]
fn a_scan_made_again_lands_where_it_was() {
    // Fails if the pose of one object on another grid is off by more than a hundredth of a voxel on average.
    let Some(folder) = data("a_scan_made_again_lands_where_it_was") else { return };
    let (volume, points) = mouse(&folder, "C57BL6_J_");
    let iso = volume.default_isovalue().0;
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    for by in [By::Surfaces, By::Intensities] {
        let (mut off_mm, mut seconds) = (vec![], vec![]);
        for seed in 0..seeds(4) {
            let mut random = random(seed);
            let (again, truth) = rescan(&volume, &Rescan { voxel_mm: 0.16, noise: 3.0, keep: 1.0 }, &mut random);
            let start = truth * motion(&mut random, middle(&volume), 10.0, 1.5);
            let before = processor_s();
            let found = brought_together(by, [&volume, &again], [iso, iso], Some(start));
            seconds.push(processor_s() - before);
            off_mm.push(apart(&points, &found.registration.transform, &truth));
            assert!(!report(&found).is_of_two);
        }
        println!(
            "made again, 25° and 0.16 mm, by {by:?}: mean error at 45 landmarks {:.5} mm (worst of {} seeds {:.5}), {:.2} s of the processor, other tests beside",
            mean(&off_mm),
            off_mm.len(),
            off_mm.iter().copied().fold(0.0, f64::max),
            mean(&seconds)
        );
        assert!(mean(&off_mm) <= 0.0016 && off_mm.iter().all(|mm| *mm <= 0.003), "{by:?}: {off_mm:?}");
    }
}

#[test]
fn the_phantom_pair_lands_from_any_start() {
    // Fails if a moved jaw, a thicker frontal bone or a start of 15° and 15 mm moves the pose, or the jaw's own pose is not found on it alone.
    let [a, b] = [Which::A, Which::B].map(|which| Arc::new(skull(which, 192, &Progress::default()).unwrap()));
    let surface = Surface::new(&b, 226.0, DAffine3::IDENTITY).unwrap();
    let points: Vec<DVec3> = Cloud::of(&surface, 500, &Progress::default()).unwrap().points.iter().map(|p| p.point).collect();
    let mut worst: f64 = 0.0;
    for seed in 0..seeds(3) {
        let start = motion(&mut random(seed), middle(&b), 15.0, 15.0);
        let found = surfaces([&b, &a], [226.0; 2], Some(start));
        worst = worst.max(apart(&points, &found.registration.transform, &DAffine3::IDENTITY));
        assert_eq!(report(&found).runner_up, None, "it went there without a search");
    }
    println!("phantom pair from 15° and 15 mm: at worst {worst:.4} mm");
    assert!(worst <= 0.015, "{worst}");
    // The jaw alone, below its teeth: B's was moved by (3, −2, 0) mm.
    let jaw = Part::Box { low_mm: DVec3::new(-75.0, -105.0, -125.0), high_mm: DVec3::new(75.0, 15.0, -98.0) };
    let order =
        Order { parts: bregma_register::Parts { only: vec![jaw], but: vec![] }, start: Some(DAffine3::IDENTITY), ..Order::default() };
    let found = register(&opened([&b, &a], [226.0; 2]), [0, 1], &order, &Progress::default()).unwrap();
    let chin = DVec3::new(0.0, -80.0, -90.0);
    let moved = found.registration.transform.inverse().transform_point3(chin) - chin;
    println!("the jaw's own displacement at the chin: {moved:.3} mm");
    assert!((moved - DVec3::new(3.0, -2.0, 0.0)).abs().max_element() <= 0.1, "{moved}");
}

#[test]
fn individuals_land_alike_in_both_directions() {
    // Fails if another pose than the others' is found between individuals, or it depends on which scan is first.
    let Some(folder) = data("individuals_land_alike_in_both_directions") else { return };
    let mice = ["C57BL6_J_", "DBA_2J_", "C57BL_6NJ_"].map(|name| mouse(&folder, name));
    for ([a, b], most_mm) in [([0, 1], 0.39), ([0, 2], 0.37), ([1, 2], 0.40)] {
        let [(va, pa), (vb, pb)] = [&mice[a], &mice[b]];
        let isovalues = [va, vb].map(|v| v.default_isovalue().0);
        let list = |points: &[DVec3], scan: &Arc<Volume>| -> Vec<bregma_session::Landmark> {
            let at = |(n, p): (usize, &DVec3)| bregma_session::Landmark {
                scan: Some(scan.name().to_owned()),
                ..bregma_session::Landmark::at(format!("{n}"), *p)
            };
            points.iter().enumerate().map(at).collect()
        };
        let mut both = opened([va, vb], isovalues);
        both.landmarks = [list(pa, va), list(pb, vb)].concat();
        let by_landmarks = register(&both, [0, 1], &Order { by: By::Landmarks, ..Order::default() }, &Progress::default()).unwrap();
        let floor = by_landmarks.registration.residual_mm.unwrap();
        let start = by_landmarks.registration.transform * motion(&mut random(7), middle(va), 10.0, 1.5);
        let there = surfaces([va, vb], isovalues, Some(start));
        let back = surfaces([vb, va], [isovalues[1], isovalues[0]], Some(start.inverse()));
        let pose = there.registration.transform;
        let rms = (pa.iter().zip(pb).map(|(p, q)| pose.transform_point3(*p).distance_squared(*q)).sum::<f64>() / pa.len() as f64).sqrt();
        let round = apart(pa, &(back.registration.transform * pose), &DAffine3::IDENTITY);
        println!(
            "{} onto {}: {rms:.3} mm to the landmarks (least squares over them {floor:.3}); there and back {round:.4} mm",
            va.name(),
            vb.name()
        );
        assert!(rms <= most_mm && round <= 0.01 && report(&there).is_of_two);
    }
}

#[test]
fn any_pose_of_a_whole_or_a_part_is_found() {
    // Fails if the search misses a pose of one object or of two individuals, whole or with up to half missing.
    let Some(folder) = data("any_pose_of_a_whole_or_a_part_is_found") else { return };
    let (volume, points) = mouse(&folder, "C57BL6_J_");
    let iso = volume.default_isovalue().0;
    for (keep, least) in [(1.0, 1.0), (0.7, 0.95), (0.5, 0.9)] {
        let (mut found, all) = (0, seeds(2));
        let before = Instant::now();
        for seed in 0..all {
            let mut random = random(seed + 50);
            let (part, truth) = rescan(&volume, &Rescan { voxel_mm: 0.2, noise: 3.0, keep }, &mut random);
            // From anywhere: the moving scan as it lies, 25° off, and no start.
            let registered = surfaces([&volume, &part], [iso, iso], None);
            let off = apart(&points, &registered.registration.transform, &truth);
            found += u64::from(off < 0.3);
        }
        println!("anywhere, {:.0} % of it left: {found} of {all}, {:.1} s each", 100.0 * keep, before.elapsed().as_secs_f64() / all as f64);
        assert!(found as f64 >= least * all as f64);
    }
}

#[test]
fn intervals_of_the_pose_hold_the_truth() {
    // Fails if the covariance is the formal one, which is several times too small, or so wide that it says nothing.
    let Some(folder) = data("intervals_of_the_pose_hold_the_truth") else { return };
    let (volume, points) = mouse(&folder, "C57BL6_J_");
    let iso = volume.default_isovalue().0;
    let count = seeds(8);
    let mut held = [(By::Surfaces, 0), (By::Intensities, 0)];
    for seed in 0..count {
        let mut random = random(seed + 900);
        let how = Rescan { voxel_mm: 0.14 + 0.06 * random.unit(), noise: 3.0, keep: if seed % 2 == 0 { 1.0 } else { 0.8 } };
        let (again, truth) = rescan(&volume, &how, &mut random);
        let other_iso = iso + 10.0 * (random.unit() - 0.5);
        let start = truth * motion(&mut random, middle(&volume), 3.0, 0.3);
        for (by, held) in &mut held {
            let found = brought_together(*by, [&volume, &again], [iso, other_iso], Some(start)).registration;
            let covariance = found.covariance.as_ref().unwrap();
            for p in &points {
                let at = truth.transform_point3(*p);
                let off = found.transform.transform_point3(*p) - at;
                let is_within = |axis: &DVec3| off.dot(*axis).abs() <= 1.96 * covariance.variance_at(at, *axis).sqrt();
                *held += [DVec3::X, DVec3::Y, DVec3::Z].iter().filter(|axis| is_within(axis)).count();
            }
        }
    }
    for (by, held) in held {
        let all = 3 * points.len() * count as usize;
        let share = 100.0 * held as f64 / all as f64;
        println!(
            "{count} scans made again with another threshold, blur and crop, by {by:?}: 95 % intervals hold the truth in {share:.1} % of {all} coordinates of landmarks"
        );
        let bounds = if count >= 60 { 93.0..=97.0 } else { 80.0..=100.0 };
        assert!(bounds.contains(&share), "{by:?}: {share}");
    }
}

#[test]
fn one_object_scanned_twice_lands_on_itself() {
    // Fails if a sheared grid is taken for an orthonormal one, or the two scans of the phantom do not land on each other.
    let Some(folder) = data("one_object_scanned_twice_lands_on_itself") else { return };
    let phantom = |name: &str| {
        Arc::new(formats::open(&folder.join("phantom-philips").join(name), &Default::default(), &Progress::default()).unwrap())
    };
    let (straight, tilted) = (phantom("straight"), phantom("tilted"));
    let mut poses: Vec<DAffine3> = vec![];
    for (iso, most_mm) in [(226.0, 0.13), (-300.0, 0.10)] {
        let found = surfaces([&tilted, &straight], [iso; 2], Some(DAffine3::IDENTITY));
        let median = report(&found).median_mm;
        println!(
            "phantom at {iso} HU: median distance {median:.3} mm, shift at the middle {:.3}",
            found.registration.transform.transform_point3(middle(&tilted)) - middle(&tilted)
        );
        assert!(median <= most_mm, "{iso}: {median}");
        poses.push(found.registration.transform);
    }
    let points = straight.grid().corners_mm();
    println!("the two isovalues' poses differ by {:.3} mm at the corners", apart(&points, &poses[0], &poses[1]));
}

/// A solid by its signed distance, on a grid of 64³, 1 mm.
fn solid(distance: impl Fn(DVec3) -> f64 + Sync) -> Arc<Volume> {
    let grid = Grid::new([64; 3], DVec3::ONE, DVec3::splat(-31.5), DMat3::IDENTITY).unwrap();
    Arc::new(sampled("solid", &grid, move |p| 100.0 - 30.0 * distance(p)))
}

#[test]
fn what_cannot_be_known_is_said() {
    // Fails if a ball's turn, a plate's shift, a bar's shift along itself or which side of a cube is up is answered as if it were known.
    let ball = solid(|p| p.length() - 18.3);
    let found = surfaces([&ball, &ball], [100.0; 2], Some(DAffine3::from_translation(DVec3::X * 2.0)));
    let covariance = found.registration.covariance.as_ref().unwrap();
    assert_eq!((covariance.undetermined.len(), notes(&found).matches("a turn about").count()), (3, 3), "{}", notes(&found));
    assert_eq!(covariance.variance_at(DVec3::X * 18.0, DVec3::Y), f64::INFINITY);
    assert!(
        covariance.variance_at(covariance.centre_mm, DVec3::Y).sqrt() < 0.01
            && found.registration.transform.transform_point3(DVec3::ZERO).length() < 0.01
    );

    let plate = solid(|p| p.z.abs() - 3.2);
    let found = surfaces([&plate, &plate], [100.0; 2], Some(DAffine3::from_translation(DVec3::Z)));
    assert_eq!(notes(&found).matches("a shift along").count() + notes(&found).matches("a turn about").count(), 3, "{}", notes(&found));

    let bar = solid(|p| p.truncate().length() - 9.4);
    let found = surfaces([&bar, &bar], [100.0; 2], Some(DAffine3::IDENTITY));
    assert!(notes(&found).contains("a turn about") && notes(&found).contains("a shift along"), "{}", notes(&found));

    let cube = solid(|p| p.abs().max_element() - 14.3);
    let found = surfaces([&cube, &cube], [100.0; 2], None);
    assert!(notes(&found).contains("another pose, turned by"), "{}", notes(&found));
}

/// The samples of `volume` on its grid moved by `map`, with air where `keep` does not hold before that.
fn copied(volume: &Arc<Volume>, map: DAffine3, keep: impl Fn(DVec3) -> bool) -> Arc<Volume> {
    valued(volume, map, |p, value| if keep(p) { value } else { -1000.0 })
}

/// The samples of `volume` made anew of where they are and what they were, on its grid moved by `map`.
fn valued(volume: &Arc<Volume>, map: DAffine3, value: impl Fn(DVec3, f64) -> f64) -> Arc<Volume> {
    let surface = Surface::new(volume, 0.0, DAffine3::IDENTITY).unwrap();
    let (grid, dims) = (volume.grid(), volume.grid().dims());
    let at = |n: usize| {
        let index = [n % dims[0], n / dims[0] % dims[1], n / (dims[0] * dims[1])].map(|i| i as f64);
        let point = grid.world(IndexPoint(index.into()));
        value(point.0, depth_at(&surface, point).map_or(-1000.0, |(depth, _)| depth + surface.level)) as f32
    };
    let samples = Samples::F32((0..grid.len()).map(at).collect());
    bregma_tests::volume("copied", grid.moved(map).unwrap(), samples)
}

#[test]
fn parts_that_share_nothing_and_sizes_that_differ_are_said() {
    // Fails if the crown of a skull and its jaw, which have no bone in common, are laid together without a word, or a scan whose spacing is 3 % too small
    // is called the same object.
    let skull = Arc::new(skull(Which::A, 96, &Progress::default()).unwrap());
    let part = |keep: &dyn Fn(DVec3) -> bool| copied(&skull, DAffine3::IDENTITY, keep);
    let (crown, jaw) = (part(&|p| p.z > 35.0), part(&|p| p.z < -60.0));
    let found = surfaces([&crown, &jaw], [226.0; 2], Some(DAffine3::IDENTITY));
    println!("crown on jaw: agreement {:.2}; {}", report(&found).agreement, notes(&found));
    assert!(notes(&found).contains("little of the surfaces agrees") || notes(&found).contains("another pose"), "{}", notes(&found));
    let smaller = copied(&skull, DAffine3::from_scale(DVec3::splat(0.97)), |_| true);
    let found = surfaces([&smaller, &skull], [226.0; 2], Some(DAffine3::IDENTITY));
    println!("3 % smaller: spread {:.3} mm, offset {:.3} mm", report(&found).spread_mm, report(&found).offset_mm);
    assert!(report(&found).is_of_two && report(&found).agreement > 0.3, "{:?}", report(&found));
}

#[test]
fn what_is_no_pair_is_said() {
    // Fails if an empty surface, scans that do not agree, or an isovalue outside of what is there gives a pose without a word.
    let ball = solid(|p| p.length() - 18.3);
    let order = Order { start: Some(DAffine3::IDENTITY), ..Order::default() };
    for iso in [1e9, -1e9, f64::MAX] {
        let error = register(&opened([&ball, &ball], [100.0, iso]), [0, 1], &order, &Progress::default()).unwrap_err();
        assert!(matches!(error, RegisterError::NoSurface { .. }), "{error}");
    }
    let far = Order {
        parts: bregma_register::Parts { only: vec![Part::Ball { centre_mm: DVec3::splat(1e4), radius_mm: 1.0 }], but: vec![] },
        ..order
    };
    let error = register(&opened([&ball, &ball], [100.0; 2]), [0, 1], &far, &Progress::default()).unwrap_err();
    assert!(matches!(error, RegisterError::Apart), "{error}");
}

#[test]
fn a_scan_lies_exactly_on_itself() {
    // Fails if two identical scans leave anything but nothing, on a sheared, mirrored or far grid, or give −0 or no number.
    let skull = Arc::new(skull(Which::A, 64, &Progress::default()).unwrap());
    let shear = DMat3::from_cols(DVec3::X, DVec3::Y, DVec3::new(0.2, -0.3, 0.95));
    let mirror = DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0));
    for (what, map) in [("as it is", DMat3::IDENTITY), ("sheared", shear), ("mirrored", mirror)] {
        for far in [0.0, 1e6] {
            let scan = copied(&skull, DAffine3::from_mat3_translation(map, DVec3::splat(far)), |_| true);
            let found = surfaces([&scan, &scan], [226.0; 2], Some(DAffine3::IDENTITY));
            let off = apart(&scan.grid().corners_mm(), &found.registration.transform, &DAffine3::IDENTITY);
            // At 1e6 mm float64 has 1e-10 mm, and a turn's shift is a difference of such numbers.
            let tolerance = if far > 0.0 { 1e-4 } else { 1e-9 };
            assert!(off <= tolerance && report(&found).matched > 0.99, "{what} at {far}: {off}, {}", report(&found).matched);
        }
    }
}

#[test]
fn threads_and_cancelling_change_nothing() {
    // Fails if sums depend on how work is shared, or a cancelled fit gives a pose.
    let [a, b] = [Which::A, Which::B].map(|which| Arc::new(skull(which, 64, &Progress::default()).unwrap()));
    let open = opened([&b, &a], [226.0; 2]);
    for start in [Some(motion(&mut random(1), DVec3::ZERO, 8.0, 9.0)), None] {
        let order = Order { start, ..Order::default() };
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let found: Registration = pool.install(|| register(&open, [0, 1], &order, &Progress::default())).unwrap().registration;
            found
        };
        let one = with(1);
        assert!([2, 8].into_iter().all(|threads| with(threads) == one));
    }
    let progress = Progress::default();
    progress.cancel();
    let error = register(&open, [0, 1], &Order::default(), &progress).unwrap_err();
    assert!(matches!(error, RegisterError::Cancelled(Cancelled)));
}

#[test]
fn a_mirror_image_is_not_claimed_to_be_seen() {
    // Fails if surfaces of a mirrored skull are called anything but what they are: a fit, like any other. Names of sides tell it, see landmarks.
    let skull = Arc::new(skull(Which::A, 64, &Progress::default()).unwrap());
    let mirrored = copied(&skull, DAffine3::from_mat3(DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0))), |_| true);
    let found = surfaces([&mirrored, &skull], [226.0; 2], Some(DAffine3::IDENTITY));
    assert!(!notes(&found).contains("mirror"), "{}", notes(&found));
}

#[test]
fn files_carry_how_sure_it_is() {
    // Fails if a length on a registered scan does not take its ± from the covariance in the file, or a search's record cannot be read again.
    let [a, b] = [Which::A, Which::B].map(|which| Arc::new(skull(which, 64, &Progress::default()).unwrap()));
    let open = opened([&b, &a], [226.0; 2]);
    let order = Order { start: Some(DAffine3::IDENTITY), ..Order::default() };
    let registered = register(&open, [0, 1], &order, &Progress::default()).unwrap();
    let file = std::env::temp_dir().join(format!("bregma-registered-{}.json", std::process::id()));
    bregma_session::register::write(&file, &open, [0, 1], &order, &registered).unwrap();
    let read = read_transform(&file, b.name(), &[a.name()]).unwrap();
    std::fs::remove_file(&file).unwrap();
    assert_eq!(read, registered.registration);
}

#[test]
fn a_chain_of_registrations_errs_as_all_of_it() {
    // Fails if a scan that is laid on a registered one is as sure in the scene as on that one, or the covariance is added at another place.
    let mut random = random(5);
    let covariance = |random: &mut Random, centre_mm: DVec3| {
        // Turns of a thousandth and shifts of a tenth of a mm, each by itself.
        let spread: [f64; 6] = std::array::from_fn(|n| if n < 3 { 1e-3 } else { 0.1 } * (0.5 + random.unit()));
        let matrix = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { spread[i] * spread[i] } else { 0.0 }));
        bregma_field::Covariance { centre_mm, matrix, undetermined: vec![] }
    };
    let draw = |random: &mut Random, c: &bregma_field::Covariance| {
        let mut normal = || (0..12).map(|_| random.unit()).sum::<f64>() - 6.0;
        let v: [f64; 6] = std::array::from_fn(|n| c.matrix[n][n].sqrt() * normal());
        let turn = DQuat::from_scaled_axis(DVec3::from_slice(&v[..3]));
        DAffine3::from_rotation_translation(turn, c.centre_mm + DVec3::from_slice(&v[3..]) - turn * c.centre_mm)
    };
    let ball = solid(|p| p.length() - 18.3);
    let b_to_a = motion(&mut random, DVec3::ZERO, 40.0, 30.0);
    let c_to_b = motion(&mut random, DVec3::ZERO, 25.0, 10.0);
    let of_b = covariance(&mut random, DVec3::new(5.0, -60.0, 20.0));
    let of_c = covariance(&mut random, DVec3::new(-40.0, 0.0, 8.0));
    let layer = bregma_renderer::Layer { transform: b_to_a, covariance: Some(of_b.clone()), ..bregma_renderer::Layer::new(&ball, 0, 2) };
    let registration = Registration { transform: c_to_b, residual_mm: None, covariance: Some(of_c.clone()) };
    let told = Registered { registration, report: Default::default() }.in_scene(&layer);
    let point = DVec3::new(30.0, 40.0, -50.0);
    let at = told.transform.transform_point3(point);
    let mut squares = DVec3::ZERO;
    const COUNT: usize = 20_000;
    for _ in 0..COUNT {
        let chain = draw(&mut random, &of_b) * b_to_a * draw(&mut random, &of_c) * c_to_b;
        let off = chain.transform_point3(point) - at;
        squares += off * off;
    }
    let found = (squares / COUNT as f64).map(f64::sqrt);
    let c = told.covariance.unwrap();
    let expected = DVec3::new(c.variance_at(at, DVec3::X), c.variance_at(at, DVec3::Y), c.variance_at(at, DVec3::Z)).map(f64::sqrt);
    println!("a chain of two registrations moves a point by {found:.4} mm; told {expected:.4}");
    assert!((found / expected - 1.0).abs().max_element() < 0.03, "{found} {expected}");
}

/// Along random rays through two registered scans of one object: how many differences of walls that both show are within their ±, of how many, and
/// half of all differences are less than so many mm.
fn differences(volumes: [&Arc<Volume>; 2], isovalues: [f64; 2], registered: &Registration, wanted: usize) -> (usize, usize, f64) {
    let layer = |n: usize| bregma_renderer::Layer { iso: isovalues[n], ..bregma_renderer::Layer::new(volumes[n], n, 2) };
    let Registration { transform, covariance, .. } = registered.clone();
    let layers = [bregma_renderer::Layer { transform, covariance, ..layer(0) }, layer(1)];
    let bounds = bregma_renderer::Bounds::of([volumes[1].grid()]);
    let mut random = random(77);
    let (mut held, mut off) = (0, vec![]);
    while off.len() < wanted {
        let from = bounds.centre_mm + 1.5 * bounds.radius_mm * direction(&mut random);
        let through = bounds.centre_mm + 0.3 * bounds.radius_mm * direction(&mut random);
        let ray = bregma_field::Ray::new(WorldPoint(from), through - from).unwrap();
        let found = bregma_measure::probe(&volumes.map(Arc::clone), &layers, &ray).unwrap();
        let is_square = |v: usize, n: usize| found.volumes[v].segments[n - 1].obliquity_deg.iter().all(|deg| *deg < 60.0);
        for d in &found.pairs[0].differences {
            if d.united || d.partial || d.below_resolution || !is_square(0, d.a[0]) || !is_square(1, d.b[0]) {
                continue;
            }
            assert!(d.uncertainty.registration_error_mm.is_some());
            held += usize::from(d.difference_mm.abs() <= d.uncertainty.error_mm);
            off.push(d.difference_mm.abs());
        }
    }
    off.sort_by(f64::total_cmp);
    (held, off.len(), off[off.len() / 2])
}

#[test]
fn lengths_across_registered_scans_hold_the_truth() {
    // Fails if the ± of a difference across two registered scans lacks the registration, or the covariance is taken at another place.
    let Some(folder) = data("lengths_across_registered_scans_hold_the_truth") else { return };
    let (volume, _) = mouse(&folder, "C57BL6_J_");
    let iso = volume.default_isovalue().0;
    let (mut held, mut all) = (0, 0);
    for seed in 0..5 {
        let mut random = random(seed + 31);
        let mut again = || rescan(&volume, &Rescan { voxel_mm: 0.16, noise: 3.0, keep: 1.0 }, &mut random);
        let ((first, to_first), (second, to_second)) = (again(), again());
        // The ± holds an isovalue that is off by its tolerance in 95 of 100 cases; twelve uniform numbers are nearly normal.
        let mut off = |v: &Volume| ((0..12).map(|_| random.unit()).sum::<f64>() - 6.0) * bregma_measure::iso_tolerance(v) / 1.96;
        let isovalues = [iso + off(&first), iso + off(&second)];
        let found = surfaces([&first, &second], isovalues, Some(to_second * to_first.inverse()));
        let (of_seed, count, median) = differences([&first, &second], isovalues, &found.registration, 200);
        println!(
            "isovalues {isovalues:.1?}: {of_seed} of {count} differences, which are 0, are within their ±; half are less than {median:.3} mm"
        );
        (held, all) = (held + of_seed, all + count);
    }
    let share = 100.0 * held as f64 / all as f64;
    println!("made again and registered: {share:.1} % of {all}");
    assert!((93.0..=99.0).contains(&share), "{share}");
    // Two real series of one phantom, of 1 mm and of tilted slices of 2.5 mm: told, not claimed.
    let phantom = |name: &str| {
        Arc::new(formats::open(&folder.join("phantom-philips").join(name), &Default::default(), &Progress::default()).unwrap())
    };
    let (straight, tilted) = (phantom("straight"), phantom("tilted"));
    let found = surfaces([&tilted, &straight], [226.0; 2], Some(DAffine3::IDENTITY));
    let (held, all, median) = differences([&tilted, &straight], [226.0; 2], &found.registration, 1_000);
    println!(
        "phantom, registered: {:.1} % of {all} differences are within their ±; half are less than {median:.3} mm",
        100.0 * held as f64 / all as f64
    );
    let unregistered = Registration::of(DAffine3::IDENTITY);
    let (_, all, median_before) = differences_without(&tilted, &straight, &unregistered);
    println!("as the files say, half of {all} are less than {median_before:.3} mm");
    assert!(median < median_before);
}

/// The same of scans as their files put them, which nobody says the error of.
fn differences_without(moving: &Arc<Volume>, fixed: &Arc<Volume>, registered: &Registration) -> (usize, usize, f64) {
    let exact = bregma_field::Covariance { centre_mm: DVec3::ZERO, matrix: [[0.0; 6]; 6], undetermined: vec![] };
    differences([moving, fixed], [226.0; 2], &Registration { covariance: Some(exact), ..registered.clone() }, 1_000)
}
