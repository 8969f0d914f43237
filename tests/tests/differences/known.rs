//! Differences that were made: how often their ± holds the truth, and how much of one object scanned twice is called different.

use super::*;
use bregma_field::{Progress, Registration, WorldPoint};
use bregma_measure::difference::{Asked, By, Map, PointErrors, Side, Statistics, map};
use bregma_measure::mesh::Mesh;
use bregma_measure::partner::Partners;
use bregma_measure::{Registered, iso_tolerance};
use bregma_session::register::{Order, register};
use bregma_session::{Opened, Source};
use bregma_synthetic::{Which, skull};

use bregma_tests::scanned;

/// Both maps of two surfaces: at the first's vertices, at the second's.
struct Maps {
    everywhere: [Vec<bool>; 2],
    meshes: [Mesh; 2],
    maps: [Map; 2],
}

fn maps(surfaces: [&Surface; 2], iso: f64, by: By, reach_mm: f64, registered: [Registered<'_>; 2]) -> Maps {
    let progress = Progress::default();
    let meshes = surfaces.map(|s| Mesh::of(s, &progress).unwrap());
    let partners = surfaces.map(|s| Partners::of(s, &progress).unwrap());
    let errors: Vec<PointErrors<'_>> =
        (0..2).map(|n| PointErrors::of(surfaces[n], &meshes[n], iso, iso_tolerance(&surfaces[n].volume), &progress).unwrap()).collect();
    let side =
        |n: usize| Side { surface: surfaces[n], mesh: &meshes[n], partners: &partners[n], errors: &errors[n], registered: registered[n] };
    let everywhere = meshes.each_ref().map(|mesh| vec![true; mesh.vertices.len()]);
    let both = [true, false].map(|on_first| {
        let asked = Asked { by, reach_mm, at: &everywhere[usize::from(!on_first)] };
        map(side(0), side(1), on_first, asked, &progress).unwrap()
    });
    Maps { maps: both, everywhere, meshes }
}

#[test]
fn offsets_that_were_made_lie_within_their_error() {
    // Two balls about one centre, of which the second's surface stands out by a dent or a bump of known depth: the truth at a vertex of the first
    // is the radial gap. Fails if signs, sides or uncertainties are wrong.
    let count = points(400);
    let (mut held, mut all, mut sign) = (0, 0, 0);
    let mut random = Random(77);
    while all < count {
        let spacing = DVec3::new(0.5 + random.unit(), 0.5 + random.unit(), 0.5 + random.unit());
        let axes = DMat3::from_quat(DQuat::from_axis_angle(direction(&mut random), random.unit()));
        let sheared = axes * DMat3::from_cols(DVec3::X, DVec3::Y, (DVec3::Z + 0.25 * random.unit() * DVec3::Y).normalize());
        let mut grids = [axes, sheared].map(|axes| {
            let dims = [0, 1, 2].map(|a| (46.0 / spacing[a]) as usize);
            let corner = axes * (spacing * DVec3::from(dims.map(|n| n as f64 - 1.0)) / 2.0);
            Grid::new(dims, spacing, -corner, axes).unwrap()
        });
        if random.unit() < 0.5 {
            grids.swap(0, 1);
        }
        let (radius, gap) = (12.0 + 4.0 * random.unit(), 2.0 * (random.unit() - 0.5));
        let pole = direction(&mut random);
        // A bump or dent with a smooth rim on one side.
        let second = move |p: DVec3| {
            let from_pole = p.normalize_or_zero().dot(pole);
            let height = if from_pole > 0.5 { gap * (1.0 - ((1.0 - from_pole) / 0.5).powi(2)).powi(2) } else { 0.0 };
            radius + height
        };
        let seed = (random.unit() * 1e9) as u64;
        let a = scanned("a", &grids[0], seed, 15.0, |p| p.length() - radius);
        let b = scanned("b", &grids[1], seed + 1, 15.0, |p| p.length() - second(p));
        // Isovalues are off as their tolerance allows: 95 of 100 within it.
        let gauss = |random: &mut Random| (0..12).map(|_| random.unit()).sum::<f64>() - 6.0;
        let isovalues = [&a, &b].map(|v| 500.0 + iso_tolerance(v) / 1.96 * gauss(&mut random));
        let surfaces = [surface(&a, isovalues[0]), surface(&b, isovalues[1])];
        let found = maps([&surfaces[0], &surfaces[1]], 500.0, By::Normal, 5.0, [Registered::default(); 2]);
        for _ in 0..100 {
            let n = (random.unit() * found.meshes[0].vertices.len() as f64) as usize;
            let truth = second(found.meshes[0].vertices[n]) - radius;
            let (mm, error) = (f64::from(found.maps[0].values_mm[n]), f64::from(found.maps[0].errors_mm[n]));
            if mm.is_nan() {
                continue;
            }
            all += 1;
            held += usize::from((mm - truth).abs() <= error);
            sign += usize::from(truth.abs() > error && mm * truth < 0.0);
        }
    }
    println!(
        "{held} of {all} offsets ({:.1} %) within their ±; {sign} signs wrong of those larger than it",
        100.0 * held as f64 / all as f64
    );
    assert!(sign == 0);
    assert!((0.93..=0.985).contains(&(held as f64 / all as f64)) || all < 2000 && held as f64 > 0.9 * all as f64);
}

#[test]
fn a_scan_differs_from_itself_nowhere() {
    // Fails if a distance of nothing becomes −0, rounding or NaN.
    let a = surface(&Arc::new(skull(Which::A, 64, &Progress::default()).unwrap()), 226.0);
    for by in [By::Partner, By::Closest, By::Normal, By::Thickness] {
        let found = maps([&a, &a], 226.0, by, 5.0, [Registered::default(); 2]);
        for (n, (mesh, map)) in found.meshes.iter().zip(&found.maps).enumerate() {
            let statistics = Statistics::of(mesh, map, [Registered::default(); 2], &found.everywhere[n]).unwrap();
            let without = statistics.without_mm2 / (statistics.area_mm2 + statistics.without_mm2);
            println!(
                "{by:?}: {} points, largest {:.1e} mm, {:.2} % without",
                statistics.count,
                statistics.largest.difference_mm,
                100.0 * without
            );
            let none = if by == By::Partner || by == By::Closest { 0.0 } else { 1e-6 };
            assert!(map.values_mm.iter().all(|v| v.is_nan() || v.abs() <= none && v.to_bits() != (-0.0_f32).to_bits()));
            assert!(without < 0.02 && statistics.sure == 0.0);
        }
    }
}

#[test]
fn one_skull_scanned_twice_is_not_called_different() {
    // The phantom sampled again on another grid, with noise, and registered: the area whose difference is larger than its ±. Fails if the ± is too
    // small, or if a registration's covariance is left out.
    let a = Arc::new(skull(Which::A, 128, &Progress::default()).unwrap());
    let mut random = Random(5);
    let pose = motion(&mut random, DVec3::ZERO, 8.0, 6.0);
    let b = Arc::new(resampled(&a, pose, &mut random));
    let mut opened = Opened::new(vec![Source::default(), Source::default()], vec![Arc::clone(&a), Arc::clone(&b)]);
    opened.scene.layers.iter_mut().for_each(|layer| layer.iso = 226.0);
    let registered = register(&opened, [1, 0], &Order::default(), &Progress::default()).unwrap();
    let Registration { transform, covariance, .. } = registered.registration;
    let surfaces = [surface(&a, 226.0), Surface::new(&b, 226.0, transform).unwrap()];
    let sides = [Registered::default(), Registered { residual_mm: None, covariance: covariance.as_ref() }];
    let found = maps([&surfaces[0], &surfaces[1]], 226.0, By::Partner, 10.0, sides);
    for (n, name) in ["on the first", "on the second"].into_iter().enumerate() {
        let s = Statistics::of(&found.meshes[n], &found.maps[n], sides, &found.everywhere[n]).unwrap();
        println!(
            "{name}: {:.2} % of area called different, mean {:+.4} ± {:.4} mm, RMS {:.4}, {:.2} % without",
            100.0 * s.sure,
            s.mean_mm,
            s.mean_uncertainty.error_mm,
            s.rms_mm,
            100.0 * s.without_mm2 / (s.area_mm2 + s.without_mm2)
        );
        assert!(s.sure <= 0.05, "{name}: {}", s.sure);
    }
}

/// The scan sampled again, moved by `pose`, on a turned grid of other steps, with noise.
fn resampled(volume: &Arc<Volume>, pose: DAffine3, random: &mut Random) -> Volume {
    let whole = surface(volume, 226.0);
    let corners = volume.grid().corners_mm().map(|p| pose.transform_point3(p));
    let middle = corners.iter().sum::<DVec3>() / 8.0;
    let axes = DMat3::from_quat(DQuat::from_axis_angle(direction(random), 0.3));
    let spacing = 0.93 * volume.grid().spacing_mm();
    let dims = [150; 3];
    let grid = Grid::new(dims, spacing, middle - axes * (spacing * 149.0 / 2.0), axes).unwrap();
    let back = pose.inverse();
    let mut noise = Random(99);
    let value = |p: DVec3| {
        let here = bregma_field::interpolant::depth_at(&whole, WorldPoint(back.transform_point3(p))).map_or(-1226.0, |(depth, _)| depth);
        let gauss = (0..12).map(|_| noise.unit()).sum::<f64>() - 6.0;
        here + 226.0 + 20.0 * gauss
    };
    let mut value = value;
    let samples: Vec<i16> = (0..grid.len())
        .map(|n| {
            let at = DVec3::new((n % dims[0]) as f64, (n / dims[0] % dims[1]) as f64, (n / (dims[0] * dims[1])) as f64);
            value(grid.world(bregma_field::IndexPoint(at)).0).round().clamp(-32768.0, 32767.0) as i16
        })
        .collect();
    let raster = bregma_field_raster(grid, samples);
    Volume::new("again".into(), "test", raster).unwrap()
}

fn bregma_field_raster(grid: Grid, samples: Vec<i16>) -> bregma_field::Raster {
    bregma_field::Raster {
        grid,
        samples: Samples::I16(samples),
        slope: 1.0,
        intercept: 0.0,
        unit: bregma_field::Unit::Hounsfield,
        warnings: vec![],
    }
}
