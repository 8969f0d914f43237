//! The difference ray against answers found another way.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use bregma_field::crossings::Kind;
use bregma_measure::{Meets, probe};
use bregma_renderer::{Clip, Layer, Ray, Shape};
use bregma_session::record::measure;
use bregma_synthetic::analytic::Shell;
use bregma_tests::Random;
use bregma_volume::{Grid, IndexPoint, Progress, ReadSamples, Volume, WorldPoint};
use glam::{DAffine3, DMat3, DVec3};
use std::sync::Arc;

/// The trilinear interpolant, from its definition.
fn interpolant(v: &Volume, p: WorldPoint) -> f64 {
    let IndexPoint(i) = v.grid().index(p);
    let dims = v.grid().dims();
    let cell: [usize; 3] = std::array::from_fn(|a| (i[a].max(0.0) as usize).min(dims[a] - 2));
    (0..8)
        .map(|c| {
            let at: [usize; 3] = std::array::from_fn(|a| cell[a] + (c >> a & 1));
            let weight: f64 = (0..3).map(|a| if c >> a & 1 == 1 { i[a] - cell[a] as f64 } else { 1.0 - (i[a] - cell[a] as f64) }).product();
            weight * v.samples().get_f64((at[2] * dims[1] + at[1]) * dims[0] + at[0])
        })
        .sum()
}

/// Where the interpolant changes sides of `iso` along the ray, by dense sampling and bisection; `None` when some extremum comes so
/// near 0 that sampling cannot tell.
fn sampled_crossings(v: &Volume, iso: f64, ray: &Ray, span: [f64; 2], step_mm: f64) -> Option<Vec<f64>> {
    let f = |t: f64| interpolant(v, ray.at(t)) - iso;
    let n = ((span[1] - span[0]) / step_mm) as usize + 2;
    let at = |i: usize| span[0] + (span[1] - span[0]) * i as f64 / n as f64;
    let mut crossings = Vec::new();
    for i in 0..n {
        let (mut low, mut high) = (at(i), at(i + 1));
        let (a, b) = (f(low), f(high));
        // A pair of roots hides within a step only where both its ends are near 0 and the slope is small.
        if (a >= 0.0) == (b >= 0.0) {
            if a.abs() + b.abs() < 0.2 * step_mm {
                return None;
            }
            continue;
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if (f(middle) >= 0.0) == (a >= 0.0) { low = middle } else { high = middle }
        }
        crossings.push(0.5 * (low + high));
    }
    Some(crossings)
}

fn grids() -> [(&'static str, Grid); 3] {
    let shear = DMat3::from_cols(DVec3::X, DVec3::new(0.1, 0.98, 0.0), DVec3::new(0.0, -0.317, 0.948));
    let turn = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, 2.0) / 3.0, 0.7);
    let new = |dims, spacing: [f64; 3], direction: DMat3| {
        let spacing = DVec3::from(spacing);
        let half = direction * (spacing * DVec3::from(<[usize; 3]>::map(dims, |n| (n - 1) as f64 / 2.0)));
        Grid::new(dims, spacing, -half, direction).unwrap()
    };
    [
        ("isotropic", new([81, 81, 81], [0.75; 3], DMat3::IDENTITY)),
        ("anisotropic and turned", new([121, 101, 41], [0.5, 0.6, 1.5], turn)),
        ("sheared", new([101, 101, 31], [0.6, 0.6, 2.0], shear)),
    ]
}

#[test]
fn thickness_through_the_shell_is_the_interpolants_and_within_the_stated_error_of_the_spheres() {
    // Fails if a root is off, missed or doubled, if millimetres and cells are mixed, or if the stated error is too small.
    let shell = Shell { centre: DVec3::new(0.3, -0.2, 0.1), inner_mm: 17.0, outer_mm: 23.0 };
    for (name, grid) in grids() {
        let volume = Arc::new(shell.volume(&grid));
        // No float32 holds 0.1: the lengths are those of the isovalue that was asked for, not of a rounded one.
        let iso = 0.1;
        let layers = [Layer { iso, ..Layer::new(&volume, 0, 1) }];
        let truth = Shell { inner_mm: shell.inner_mm + iso, outer_mm: shell.outer_mm - iso, ..shell };
        let mut random = Random(5);
        let (mut compared, mut worst_interpolant, mut worst_sphere, mut undecided) = (0, 0.0_f64, 0.0_f64, 0);
        for _ in 0..1000 {
            let mut direction = || DVec3::new(random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.5).normalize();
            let (from, through) = (direction() * 60.0, direction() * 20.0 * 0.9);
            let ray = Ray::new(WorldPoint(from), through - from).unwrap();
            let found = probe(std::slice::from_ref(&volume), &layers, &ray).unwrap();
            let found = &found.volumes[0];
            let Some(span) = found.box_mm else { continue };
            let Some(crossings) = sampled_crossings(&volume, iso, &ray, span, 0.005) else {
                undecided += 1;
                continue;
            };
            assert_eq!(found.segments.len() * 2, crossings.len(), "{name}: {ray:?}");
            for (segment, ends) in found.segments.iter().zip(crossings.chunks(2)) {
                worst_interpolant = worst_interpolant.max((segment.length_mm - (ends[1] - ends[0])).abs());
                compared += 1;
            }
            // The sphere may be touched where the interpolant is missed, or the other way round: only equal counts compare.
            let truth = truth.segments_mm(from, ray.direction);
            if truth.len() == found.segments.len() {
                for (segment, [a, b]) in found.segments.iter().zip(truth) {
                    let off = (segment.length_mm - (b - a)).abs();
                    assert!(
                        off <= segment.uncertainty.error_mm,
                        "{name}: {off} mm off, ± {} mm stated: {ray:?}",
                        segment.uncertainty.error_mm
                    );
                    worst_sphere = worst_sphere.max(off);
                }
            }
        }
        println!(
            "{name}: {compared} walls, {undecided} rays undecided; off the interpolant's by at most {worst_interpolant:.1e} mm, off the sphere's by {worst_sphere:.3} mm"
        );
        assert!(compared > 1000 && undecided < 100 && worst_interpolant <= 1e-9);
    }
}

#[test]
fn the_ledger_covers_the_boxes_without_gap_or_overlap() {
    // Fails if a stretch is lost or counted twice, or a segment and the ledger disagree.
    let pair = bregma_session::Opened::demo(48, &Progress::default()).unwrap();
    let mut layers = pair.scene.layers.clone();
    layers[1].transform = DAffine3::from_translation(DVec3::new(4.0, 30.0, -9.0));
    let mut random = Random(9);
    let mut entries = 0;
    for _ in 0..2000 {
        let mut point = || DVec3::new(random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.5) * 400.0;
        let (from, to) = (point(), point() * 0.3);
        let d = probe(&pair.volumes, &layers, &Ray::new(WorldPoint(from), to - from).unwrap()).unwrap();
        let boxes: Vec<[f64; 2]> = d.volumes.iter().filter_map(|v| v.box_mm).collect();
        let Some((first, last)) = d.ledger.first().zip(d.ledger.last()) else {
            assert!(boxes.is_empty());
            continue;
        };
        assert_eq!(first.from_mm, boxes.iter().map(|b| b[0]).fold(f64::INFINITY, f64::min));
        assert_eq!(last.to_mm, boxes.iter().map(|b| b[1]).fold(0.0, f64::max));
        assert!(d.ledger.windows(2).all(|w| w[0].to_mm == w[1].from_mm) && d.ledger.iter().all(|e| e.length_mm > 0.0));
        for v in &d.volumes {
            let bone: f64 = v.segments.iter().map(|s| s.length_mm).sum();
            let listed: f64 = d.ledger.iter().filter(|e| e.inside.contains(&v.name)).map(|e| e.length_mm).sum();
            assert!((bone - listed).abs() < 1e-9, "{}: {bone} mm of bone, {listed} mm in the ledger", v.name);
            let kinds: Vec<_> = v.crossings.iter().map(|c| c.kind).filter(|k| *k != Kind::Touch).collect();
            assert!(kinds.chunks(2).all(|k| k == [Kind::Enter, Kind::Exit]));
            for c in v.crossings.iter().filter(|c| !c.clipped) {
                // Told apart by sides, checked against the gradient: an outward normal faces an entering ray.
                let facing = DVec3::from(c.normal).dot(DVec3::from(d.ray.direction));
                match c.kind {
                    Kind::Enter => assert!(facing <= 1e-6, "{c:?}"),
                    Kind::Exit => assert!(facing >= -1e-6, "{c:?}"),
                    Kind::Touch => {}
                }
            }
        }
        entries += d.ledger.len();
    }
    println!("{entries} ledger entries");
    assert!(entries > 5000);
}

#[test]
fn a_ray_through_a_corner_equal_to_the_isovalue_only_touches() {
    // Fails if a point of contact becomes a wall of no thickness.
    let grid = Grid::new([3, 3, 3], DVec3::ONE, DVec3::ZERO, DMat3::IDENTITY).unwrap();
    let mut samples = vec![0_u8; 27];
    samples[13] = 5;
    let volume = bregma_tests::volume("corner", grid, bregma_volume::Samples::U8(samples));
    let layers = [Layer { iso: 5.0, ..Layer::new(&volume, 0, 1) }];
    let ray = Ray::new(WorldPoint(DVec3::new(-1.0, 1.0, 1.0)), DVec3::X).unwrap();
    let found = probe(&[volume], &layers, &ray).unwrap();
    let v = &found.volumes[0];
    assert!(v.segments.is_empty(), "{v:?}");
    assert_eq!(v.crossings.iter().map(|c| (c.t_mm, c.kind)).collect::<Vec<_>>(), [(2.0, Kind::Touch)]);
    assert_eq!(found.ledger.len(), 1);
}

#[test]
fn bone_cut_by_the_scans_edge_is_said_to_be() {
    // Fails if a wall that the scan cuts off passes for a whole one.
    let grid = Grid::new([4, 4, 4], DVec3::splat(2.0), DVec3::ZERO, DMat3::IDENTITY).unwrap();
    let volume =
        bregma_tests::volume("half", grid, bregma_volume::Samples::I16((0..64).map(|n| if n % 4 < 2 { 100 } else { -100 }).collect()));
    let layers = [Layer { iso: 0.0, ..Layer::new(&volume, 0, 1) }];
    let ray = Ray::new(WorldPoint(DVec3::new(-5.0, 3.0, 3.0)), DVec3::X).unwrap();
    let volumes = [volume];
    let segments = &probe(&volumes, &layers, &ray).unwrap().volumes[0].segments;
    assert_eq!(segments.len(), 1);
    let s = segments[0];
    // Begun at the face itself, as rays of a click are.
    let there = Ray { origin: ray.at(s.from_mm), ..ray };
    let again = probe(&volumes, &layers, &there).unwrap().volumes[0].segments[0];
    assert!(again.clipped && !again.from_origin && (again.length_mm - 3.0).abs() < 1e-12, "{again:?}");
    assert!(s.clipped && (s.from_mm - 5.0).abs() < 1e-12 && (s.length_mm - 3.0).abs() < 1e-12, "{s:?}");
}

#[test]
fn a_cut_is_a_way_of_looking_and_measured_only_where_asked() {
    // Fails if a cut changes what a ray measures, or what is cut away is said to be missed by the ray.
    let pair = bregma_session::Opened::demo(48, &Progress::default()).unwrap();
    let mut opened = pair.clone();
    let ray = Ray::new(WorldPoint(DVec3::new(0.0, -150.0, 40.0)), DVec3::Y).unwrap();
    let whole = measure(&opened, &ray, false).unwrap();
    assert!(!whole.as_cut && whole.volumes.iter().all(|v| v.meets == Meets::Bone && v.segments.iter().all(|s| !s.cut)));
    let plane = |normal: DVec3, offset_mm: f64| vec![Clip::all(Shape::Plane { normal, offset_mm })];
    // All that the ray passes is cut away; then all before the middle; then what lies beside the ray.
    let meets = |opened: &bregma_session::Opened, as_cut: bool| measure(opened, &ray, as_cut).unwrap();
    opened.scene.clips = plane(DVec3::Z, 0.0);
    assert_eq!(meets(&opened, false), whole);
    let gone = meets(&opened, true);
    assert!(gone.as_cut && gone.volumes.iter().all(|v| v.meets == Meets::CutAway && v.segments.is_empty()));
    let table = bregma_measure::export::table(&gone);
    assert!(table.contains("as cut") && table.contains("is cut away") && !table.contains("misses"), "{table}");
    opened.scene.clips = plane(DVec3::NEG_Y, 0.0);
    assert_eq!(meets(&opened, false), whole);
    let half = meets(&opened, true);
    assert!(half.volumes.iter().zip(&whole.volumes).all(|(h, w)| h.segments.len() < w.segments.len() && h.meets == Meets::Bone));
    let within = whole.volumes[0].segments[0];
    opened.scene.clips = plane(DVec3::NEG_Y, 150.0 - 0.5 * (within.from_mm + within.to_mm));
    let through = meets(&opened, true).volumes[0].segments[0];
    assert!(through.cut && through.clipped && (through.length_mm - 0.5 * within.length_mm).abs() < 1e-9, "{through:?}");
    opened.scene.clips = plane(DVec3::X, 30.0);
    let beside = meets(&opened, true);
    assert!(beside.volumes.iter().zip(&whole.volumes).all(|(b, w)| b.segments == w.segments));
    // What misses the scans, and what meets no bone in them, is neither.
    let along = |origin: DVec3| measure(&opened, &Ray::new(WorldPoint(origin), DVec3::Y).unwrap(), true).unwrap().volumes[0].meets;
    assert_eq!(along(DVec3::new(0.0, -150.0, 4000.0)), Meets::Nothing);
    let [low, high] = [0.0, 1.0].map(|part| {
        opened.volumes[0].grid().world(IndexPoint(part * DVec3::from(opened.volumes[0].grid().dims().map(|n| n as f64 - 1.0)))).0
    });
    assert_eq!(along(DVec3::new(low.x + 0.01, -1000.0, high.z - 0.01)), Meets::NoBone);
}

#[test]
fn every_difference_is_of_lengths_that_the_table_has() {
    // Fails if a pair is of wrong volumes or bones, a bone is lost or counted twice, or a difference has the wrong sign.
    let mut opened = bregma_session::Opened::demo(48, &Progress::default()).unwrap();
    opened.volumes.push(Arc::clone(&opened.volumes[1]));
    opened.scene.layers = opened.volumes.iter().enumerate().map(|(n, v)| Layer::new(v, n, 3)).collect();
    opened.scene.layers[2].transform = DAffine3::from_translation(DVec3::new(1.0, 2.0, -1.0));
    opened.scene.layers[1].residual_mm = Some(0.2);
    let mut random = Random(31);
    let (mut differences, mut alone) = (0, 0);
    for _ in 0..500 {
        let mut point = || DVec3::new(random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.5) * 400.0;
        let (from, to) = (point(), point() * 0.3);
        let found = measure(&opened, &Ray::new(WorldPoint(from), to - from).unwrap(), false).unwrap();
        assert_eq!(found.pairs.iter().map(|p| p.volumes).collect::<Vec<_>>(), [[0, 1], [0, 2]]);
        // The second is registered, and the third was moved without a word on how well.
        assert_eq!(found.pairs.iter().map(|p| p.without.is_some()).collect::<Vec<_>>(), [false, true]);
        for pair in &found.pairs {
            let [a, b] = pair.volumes.map(|v| &found.volumes[v].segments);
            let length = |of: &[bregma_measure::Segment], numbers: &[usize]| numbers.iter().map(|n| of[n - 1].length_mm).sum::<f64>();
            for d in &pair.differences {
                assert_eq!(d.difference_mm, length(b, &d.b) - length(a, &d.a));
                assert_eq!(d.uncertainty.registration_error_mm.is_some(), pair.without.is_none());
                assert_eq!(d.united, d.a.len() + d.b.len() > 2);
            }
            for (of, used, left) in [(a, 0, &pair.only_a), (b, 1, &pair.only_b)] {
                let in_pairs = pair.differences.iter().flat_map(|d| [&d.a, &d.b][used]);
                let mut all: Vec<usize> = in_pairs.chain(left).copied().collect();
                all.sort();
                assert_eq!(all, (1..=of.len()).collect::<Vec<_>>());
            }
            differences += pair.differences.len();
            alone += pair.only_a.len() + pair.only_b.len();
        }
    }
    println!("{differences} differences, {alone} stretches without a partner");
    assert!(differences > 500 && alone > 20);
}

#[test]
fn rays_along_lattice_lines_tell_bone_from_gap_everywhere() {
    // Fails if a ray that runs through samples, edges and faces counts an entry twice, loses an exit, or takes a flat root for a
    // point of contact: then bone and gap change places. The values are those that make ties: 0, 1 and 2.
    let n = 12;
    let grid = Grid::new([n, n, n], DVec3::ONE, DVec3::ZERO, DMat3::IDENTITY).unwrap();
    let mut random = Random(3);
    let noise: Vec<u8> = (0..n * n * n).map(|_| (random.unit() * 3.0) as u8).collect();
    let block = vec![2; n * n * n];
    let (mut stretches, mut rays) = (0, 0);
    for (samples, isos) in [(noise, vec![0.5, 1.0, 1.5, 2.0]), (block, vec![1.0, 2.0])] {
        let volume = bregma_tests::volume("lattice", grid.clone(), bregma_volume::Samples::U8(samples));
        for iso in isos {
            let layers = [Layer { iso, ..Layer::new(&volume, 0, 1) }];
            for _ in 0..5000 {
                let mut step = |range: i32| f64::from((random.unit() * f64::from(range)) as i32);
                let direction = DVec3::new(step(5) - 2.0, step(5) - 2.0, step(5) - 2.0);
                // On half and whole samples, before the box or in it.
                let through = DVec3::new(step(23), step(23), step(23)) / 2.0;
                let Some(ray) = Ray::new(WorldPoint(through - 10.0 * step(3) * direction), direction) else { continue };
                let d = probe(std::slice::from_ref(&volume), &layers, &ray).unwrap();
                rays += 1;
                let kinds: Vec<_> = d.volumes[0].crossings.iter().map(|c| c.kind).filter(|k| *k != Kind::Touch).collect();
                assert!(kinds.len() % 2 == 0 && kinds.chunks(2).all(|k| k == [Kind::Enter, Kind::Exit]), "{ray:?}: {:#?}", d.volumes[0]);
                for entry in d.ledger.iter().filter(|e| e.length_mm > 1e-6) {
                    // Off the ends, where rounding has no say.
                    for part in [0.1, 0.5, 0.9] {
                        let value = interpolant(&volume, ray.at(entry.from_mm + part * entry.length_mm)) - iso;
                        if value.abs() > 1e-9 {
                            assert_eq!(value > 0.0, !entry.inside.is_empty(), "{ray:?} at iso {iso}: {entry:?} has {value}");
                            stretches += 1;
                        }
                    }
                }
            }
        }
    }
    println!("{rays} rays, {stretches} points told apart");
    assert!(rays > 20_000 && stretches > 100_000);
}

#[test]
fn a_flat_triple_root_is_a_wall_with_its_error() {
    // The checkerboard cell is ±(1 − 2u)³ along its diagonal: it enters at u = ½, where value, slope and curvature vanish, so that
    // rounding may move the root by the cube root of 1e-16, but by no more. Fails if that becomes a touch, or an error of nothing or
    // of kilometres.
    let grid = Grid::new([2, 2, 2], DVec3::ONE, DVec3::ZERO, DMat3::IDENTITY).unwrap();
    let signs = (0..8_u32).map(|c| if c.count_ones() % 2 == 0 { 1.0 } else { -1.0 }).collect();
    let volume = bregma_tests::volume("checkerboard", grid, bregma_volume::Samples::F32(signs));
    let layers = [Layer { iso: 0.0, ..Layer::new(&volume, 0, 1) }];
    let ray = Ray::new(WorldPoint(DVec3::NEG_ONE), DVec3::ONE).unwrap();
    let found = &probe(&[volume], &layers, &ray).unwrap().volumes[0];
    let half = 0.75_f64.sqrt();
    assert_eq!(found.segments.len(), 1, "{found:#?}");
    assert!((found.segments[0].length_mm - half).abs() < 1e-4, "{found:#?}");
    let error = found.segments[0].uncertainty.root_error_mm;
    assert!(error > 1e-7 && error < 1e-3, "{error}");
}

#[test]
fn a_ray_that_begins_in_bone_is_not_said_to_be_cut_by_the_scan() {
    let grid = Grid::new([4, 4, 4], DVec3::ONE, DVec3::ZERO, DMat3::IDENTITY).unwrap();
    let volume = bregma_tests::volume("inside", grid, bregma_volume::Samples::I16((0..64).map(|n| 100 - 80 * (n % 4)).collect()));
    let layers = [Layer { iso: 0.0, ..Layer::new(&volume, 0, 1) }];
    let ray = Ray::new(WorldPoint(DVec3::new(0.5, 1.5, 1.5)), DVec3::X).unwrap();
    let segments = &probe(std::slice::from_ref(&volume), &layers, &ray).unwrap().volumes[0].segments;
    assert!(segments.len() == 1 && segments[0].from_origin && !segments[0].clipped, "{segments:?}");
    // A hidden volume is not measured.
    let hidden = [Layer { visible: false, ..layers[0].clone() }];
    assert!(probe(&[volume], &hidden, &ray).unwrap().volumes.is_empty());
}
