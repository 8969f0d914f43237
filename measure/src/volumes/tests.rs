use super::cavity::{Cavity, CavityError, Disc, cavity};
use super::pass::{Whole, pass};
use super::*;
use bregma_field::{Clip, Grid, Measured, Progress, Raster, Samples, Shape, Surface, Unit, Volume};
use bregma_synthetic::Random;
use bregma_synthetic::analytic::{Plane, Shell, Sphere, sampled};
use glam::{DAffine3, DMat3, DQuat, DVec3};
use std::f64::consts::PI;
use std::sync::Arc;

fn measured(iso: f64) -> Measured {
    Measured { iso, transform: DAffine3::IDENTITY, residual_mm: None, covariance: None, visible: true, solid: None }
}

fn grid(size: usize, spacing: f64) -> Grid {
    Grid::new([size; 3], DVec3::splat(spacing), DVec3::splat(-0.5 * spacing * (size - 1) as f64), DMat3::IDENTITY).unwrap()
}

fn of(volumes: &[Volume], clips: Vec<Clip>, open: bool) -> Result<Volumes, VolumesError> {
    let scans: Vec<Arc<Volume>> = volumes.iter().map(|v| Arc::new(v.clone())).collect();
    let all = vec![measured(0.0); scans.len()];
    bone(&scans, &all, &Limits { clips, open }, &Progress::default())
}

fn ball(radius_mm: f64) -> f64 {
    4.0 / 3.0 * PI * radius_mm.powi(3)
}

/// Sheared, anisotropic, mirrored grids anywhere around a ball of 10 mm.
fn odd_grid(random: &mut Random, far_mm: f64) -> (Grid, DVec3) {
    let mut unit = || random.unit();
    let turn = DMat3::from_quat(DQuat::from_xyzw(unit() - 0.5, unit() - 0.5, unit() - 0.5, unit() - 0.5).normalize());
    let shear = DMat3::from_cols(DVec3::X, DVec3::new(0.3 * unit(), 1.0, 0.0), DVec3::new(0.2, -0.3 * unit(), 1.0));
    let mirror = DMat3::from_diagonal(DVec3::new(if unit() < 0.5 { -1.0 } else { 1.0 }, 1.0, 1.0));
    let spacing = DVec3::new(0.4 + 0.2 * unit(), 0.4 + 0.3 * unit(), 0.5 + 0.5 * unit());
    let matrix = turn * shear * mirror * DMat3::from_diagonal(spacing);
    let dims = [84, 80, 60];
    let centre = DVec3::splat(far_mm);
    let middle = matrix * DVec3::from(dims.map(|n| 0.5 * (n - 1) as f64));
    (Grid::from_affine(dims, DAffine3::from_mat3_translation(matrix, centre - middle)).unwrap(), centre)
}

#[test]
fn half_spaces_and_slabs_are_exact() {
    // A plane is linear: only the quadrature over its kinks at cells' faces is left. Fails if a weight, a root or the cells' size is wrong.
    let mut random = Random(4);
    for _ in 0..20 {
        let normal = DVec3::new(random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.5).normalize();
        let half = Plane { point: DVec3::splat(0.1), normal }.volume(&grid(17, 0.5));
        let other = Plane { point: DVec3::splat(0.1), normal: -normal }.volume(&grid(17, 0.5));
        let sum = |v: &Volume| of(std::slice::from_ref(v), vec![], true).unwrap().measures[0].volume_mm3;
        // Samples are float32.
        assert!((sum(&half) + sum(&other) - 512.0).abs() < 0.02, "{normal}: {} {}", sum(&half), sum(&other));
    }
    let flat = Plane { point: DVec3::Z * 1.05, normal: DVec3::Z }.volume(&grid(17, 0.5));
    let found = &of(&[flat], vec![], true).unwrap().measures[0];
    assert!((found.volume_mm3 - 64.0 * 5.05).abs() < 1e-4 && (found.area_mm2 - 64.0).abs() < 1e-6, "{found:?}");
    // A mm of isovalue moves it by a mm.
    assert!((found.per_isovalue_mm3 - 64.0).abs() < 1e-4);
}

#[test]
fn balls_on_odd_grids_have_their_volume_and_area() {
    // Fails if shear, a mirror image or a far origin changes a volume, or its derivative, area or correction is not what it should be.
    let mut random = Random(7);
    for n in 0..12 {
        let (grid, centre) = odd_grid(&mut random, if n % 3 == 2 { 1e6 } else { 0.0 });
        let scan = Sphere { centre, radius_mm: 10.0 }.volume(&grid);
        let found = &of(&[scan], vec![], false).unwrap().measures[0];
        let part = |v: f64, truth: f64| v / truth - 1.0;
        assert!(part(found.volume_mm3, ball(10.0)) < 0.0 && part(found.volume_mm3, ball(10.0)) > -6e-3, "{found:?}");
        assert!(part(found.area_mm2, 400.0 * PI).abs() < 3e-3, "{found:?}");
        assert!(part(found.per_isovalue_mm3, 400.0 * PI).abs() < 3e-3, "{found:?}");
        assert!(found.uncertainty.sum_error_mm3 < 2e-4 * ball(10.0), "{found:?}");
    }
}

#[test]
fn what_interpolation_takes_from_a_ball_is_known() {
    // Fails if the correction has the wrong size or sign: without it balls are 0.2 % too small here.
    let surface = |grid: &Grid, centre: DVec3| {
        let scan = Arc::new(Sphere { centre, radius_mm: 10.0 }.volume(grid));
        let surface = Surface::new(&scan, 0.0, DAffine3::IDENTITY).unwrap();
        let sums = pass(&surface, None, &Whole, &Progress::default()).unwrap();
        (sums.own.volume_mm3, sums.skin)
    };
    let mut random = Random(8);
    for _ in 0..6 {
        let (grid, centre) = odd_grid(&mut random, 0.0);
        let (volume, skin) = surface(&grid, centre);
        let (before, after) = (volume / ball(10.0) - 1.0, (volume + skin.by_interpolation) / ball(10.0) - 1.0);
        assert!(before < -1e-3 && after.abs() < 0.1 * before.abs(), "{before} {after}");
        // ½(κ₁ + κ₂) = 1/r.
        assert!((skin.per_blur / (40.0 * PI) - 1.0).abs() < 0.02, "{}", skin.per_blur);
        assert!(skin.pull_mm2.length() < 0.5, "{}", skin.pull_mm2);
    }
}

#[test]
fn two_balls_share_their_lens() {
    // Fails if a scan is taken in another's place, a part is counted twice, or the parts do not add up.
    let lens = |d: f64, r: f64| PI * (4.0 * r + d) * (2.0 * r - d).powi(2) / 12.0;
    let mut random = Random(3);
    for n in 0..4 {
        let shift =
            DVec3::new(random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.5).normalize() * (3.0 + 4.0 * f64::from(n) / 3.0);
        let (odd, centre) = odd_grid(&mut random, 0.0);
        let a = Sphere { centre, radius_mm: 10.0 }.volume(&odd);
        let b = Sphere { centre: centre + shift, radius_mm: 10.0 }.volume(&grid(81, 0.45));
        let found = of(&[a, b], vec![], false).unwrap().measures;
        let [of_a, of_b, both, a_alone, b_alone] = &found[..] else { panic!("five volumes") };
        let truth = lens(shift.length(), 10.0);
        assert!((both.volume_mm3 / truth - 1.0).abs() < 8e-3, "{} {truth}", both.volume_mm3);
        assert!((of_a.volume_mm3 - both.volume_mm3 - a_alone.volume_mm3).abs() < 2e-4 * ball(10.0));
        assert!((of_b.volume_mm3 - both.volume_mm3 - b_alone.volume_mm3).abs() < 2e-4 * ball(10.0));
    }
}

#[test]
fn a_scan_without_itself_is_nothing_and_without_what_is_elsewhere_all() {
    // Fails if a scan's own rays and another's differ, or what lies beyond a box counts.
    let a = Sphere { centre: DVec3::ZERO, radius_mm: 10.0 }.volume(&grid(61, 0.45));
    let found = of(&[a.clone(), a.clone()], vec![], false).unwrap().measures;
    assert!(found[3].volume_mm3.abs() < 1e-6 && found[4].volume_mm3.abs() < 1e-6, "{found:?}");
    assert!((found[2].volume_mm3 - found[0].volume_mm3).abs() < 1e-6);
    let far = Grid::new([61; 3], DVec3::splat(0.45), DVec3::splat(100.0), DMat3::IDENTITY).unwrap();
    let b = Sphere { centre: DVec3::splat(113.5), radius_mm: 10.0 }.volume(&far);
    let found = of(&[a, b], vec![], false).unwrap().measures;
    assert_eq!((found[2].volume_mm3, found[3].volume_mm3), (0.0, found[0].volume_mm3));
}

#[test]
fn regions_cut_what_is_measured() {
    // A ball of 6 mm within a ball of 10, a box of 8 × 8 × 8 within, and half. Fails if a region is turned round or its cells are missed.
    let a = Sphere { centre: DVec3::ZERO, radius_mm: 10.0 }.volume(&grid(61, 0.45));
    let part = |shape: Shape| of(std::slice::from_ref(&a), vec![Clip::all(shape)], false).unwrap().measures[0].volume_mm3;
    let within = part(Shape::Sphere { centre_mm: DVec3::splat(1.0), radius_mm: 6.0 });
    assert!((within / ball(6.0) - 1.0).abs() < 2e-4, "{within}");
    // At a box's own edges the rule meets a corner, and says so.
    let within = part(Shape::Box { low_mm: DVec3::new(-4.1, -4.2, -3.0), high_mm: DVec3::new(3.9, 3.8, 5.0) });
    assert!((within - 512.0).abs() < 0.6, "{within}");
    let whole = of(std::slice::from_ref(&a), vec![], false).unwrap().measures[0].volume_mm3;
    let half = part(Shape::Plane { normal: DVec3::new(0.6, 0.0, 0.8), offset_mm: 0.0 });
    assert!((half / whole - 0.5).abs() < 2e-4, "{half} {whole}");
}

#[test]
fn a_scan_that_cuts_its_bone_is_refused_unless_told() {
    // Fails if a volume of half a bone is given without a word.
    let half = Sphere { centre: DVec3::X * 13.5, radius_mm: 8.0 }.volume(&grid(61, 0.45));
    let refused = of(std::slice::from_ref(&half), vec![], false).unwrap_err();
    assert!(refused.to_string().contains("the scan's box cuts the bone"), "{refused}");
    let opened = of(std::slice::from_ref(&half), vec![], true).unwrap();
    assert!((opened.measures[0].volume_mm3 / (0.5 * ball(8.0)) - 1.0).abs() < 5e-3 && !opened.notes.is_empty(), "{opened:?}");
    // Within a sphere that does not come to the box all of the bone is there.
    let clip = Clip::all(Shape::Sphere { centre_mm: DVec3::X * 7.0, radius_mm: 4.0 });
    assert!(of(&[half], vec![clip], false).is_ok());
}

#[test]
fn empty_and_full_scans_and_isovalues_outside_have_their_volumes() {
    // Fails if a scan without a surface is no number, or panics.
    let made = |value: f32, dims: [usize; 3]| {
        let grid = Grid::new(dims, DVec3::ONE, DVec3::ZERO, DMat3::IDENTITY).unwrap();
        let samples = Samples::F32(vec![value; dims.iter().product()]);
        Volume::new("even".into(), "test", Raster { grid, samples, slope: 1.0, intercept: 0.0, unit: Unit::Value, warnings: vec![] })
            .unwrap()
    };
    let empty = of(&[made(-1.0, [9; 3])], vec![], false).unwrap().measures.remove(0);
    assert_eq!((empty.volume_mm3, empty.uncertainty.error_mm3), (0.0, 0.0));
    assert!(matches!(of(&[made(1.0, [9; 3])], vec![], false), Err(VolumesError::CutByBox { .. })));
    assert_eq!(of(&[made(1.0, [9; 3])], vec![], true).unwrap().measures[0].volume_mm3, 512.0);
    // No cells, no volume.
    assert_eq!(of(&[made(1.0, [9, 9, 1])], vec![], true).unwrap().measures[0].volume_mm3, 0.0);
    let scan = Arc::new(Sphere { centre: DVec3::ZERO, radius_mm: 3.0 }.volume(&grid(21, 0.5)));
    let at = |iso: f64| bone(&[Arc::clone(&scan)], &[measured(iso)], &Limits { open: true, ..Limits::default() }, &Progress::default());
    assert_eq!(at(1e30).unwrap().measures[0].volume_mm3, 0.0);
    assert!((at(-1e30).unwrap().measures[0].volume_mm3 - 1000.0).abs() < 1e-9);
    assert!(matches!(bone(&[], &[], &Limits::default(), &Progress::default()), Err(VolumesError::Count(0))));
}

/// A shell of 8 to 11 mm, with a hole of `hole_mm` around +z if that is not 0.
fn shell(hole_mm: f64) -> Arc<Volume> {
    let wall = |p: DVec3| 1.5 - (p.length() - 9.5).abs();
    let hole = move |p: DVec3| if p.z > 0.0 { p.truncate().length() - hole_mm } else { f64::INFINITY };
    Arc::new(sampled("shell", &grid(65, 0.45), move |p| if hole_mm > 0.0 { wall(p).min(hole(p)) } else { wall(p) }))
}

fn fill(volume: &Arc<Volume>, seed_mm: DVec3, discs: Vec<Disc>, ball_mm: Option<f64>) -> Result<f64, VolumesError> {
    let order = Cavity { seed_mm, discs, ball_mm };
    cavity(volume, &measured(0.0), &order, &Limits::default(), 0, &Progress::default()).map(|found| found.measure.volume_mm3)
}

#[test]
fn a_closed_cavity_has_its_volume() {
    // Fails if the hollow and the bone are confused, or the outside counts.
    let volume = fill(&shell(0.0), DVec3::new(2.0, 1.0, 0.0), vec![], None).unwrap();
    assert!((volume / ball(8.0) - 1.0).abs() < 5e-3, "{volume}");
    let by_ball = fill(&shell(0.0), DVec3::new(2.0, 1.0, 0.0), vec![], Some(3.0)).unwrap();
    assert!((by_ball / volume - 1.0).abs() < 1e-4, "{by_ball} {volume}");
}

#[test]
fn an_open_cavity_leaks_and_says_where() {
    // Fails if the leak is not found, its place is another, or what closes it does not.
    let open = shell(2.0);
    let leak = fill(&open, DVec3::ZERO, vec![], None).unwrap_err();
    let VolumesError::Cavity(CavityError::Leak { way, .. }) = &leak else { panic!("{leak}") };
    assert!((way.radius_mm - 2.0).abs() < 0.3 && way.at_mm.truncate().length() < 0.7 && (7.5..11.5).contains(&way.at_mm.z), "{way:?}");
    assert!(way.along.z > 0.9 && leak.to_string().contains("--close"), "{leak}");
    // A ball of 1.5 mm goes through, one of 2.5 does not, and grown back it leaves a dent in the hole: a spherical cap.
    assert!(matches!(fill(&open, DVec3::ZERO, vec![], Some(1.5)), Err(VolumesError::Cavity(CavityError::Leak { .. }))));
    let closed = fill(&open, DVec3::ZERO, vec![], Some(2.6)).unwrap();
    assert!((closed / ball(8.0) - 1.0).abs() < 7e-3, "{closed}");
    // A lid at z = 9 mm: the ball, and the hole up to there.
    let lid = Disc { centre_mm: DVec3::Z * 9.0, normal: DVec3::Z, radius_mm: 3.0 };
    let lidded = fill(&open, DVec3::ZERO, vec![lid], None).unwrap();
    let cylinder: f64 = 4.0 * PI * (9.0 - 60.0_f64.sqrt());
    let cap = {
        let h = 8.0 - 60.0_f64.sqrt();
        PI * h * h * (24.0 - h) / 3.0
    };
    let truth = ball(8.0) + cylinder - cap;
    assert!((lidded / truth - 1.0).abs() < 5e-3, "{lidded} {truth}");
    // The same lid turned round.
    let turned = fill(&open, DVec3::ZERO, vec![Disc { normal: DVec3::NEG_Z, ..lid }], None).unwrap();
    assert!((turned - lidded).abs() < 1e-9);
}

#[test]
fn seeds_that_are_none_are_refused() {
    // Fails if a seed in bone or beyond the scan is moved in silence.
    let closed = shell(0.0);
    let refused = |seed: DVec3, ball: Option<f64>| fill(&closed, seed, vec![], ball).unwrap_err().to_string();
    assert!(refused(DVec3::X * 9.5, None).contains("lies in bone"));
    assert!(refused(DVec3::X * 900.0, None).contains("outside the scan"));
    assert!(refused(DVec3::splat(f64::NAN), None).contains("outside the scan"));
    assert!(refused(DVec3::X * 6.0, Some(4.0)).contains("does not fit"));
    assert!(refused(DVec3::X * 13.0, None).contains("leaks"));
}

#[test]
fn work_stops_when_asked() {
    // Fails if a cancelled measurement goes on.
    let progress = Progress::default();
    progress.cancel();
    let scan = Arc::new(Shell { centre: DVec3::ZERO, inner_mm: 3.0, outer_mm: 5.0 }.volume(&grid(33, 0.5)));
    let stopped = bone(&[Arc::clone(&scan)], &[measured(0.0)], &Limits::default(), &progress);
    assert!(matches!(stopped, Err(VolumesError::Cancelled(_))));
}
