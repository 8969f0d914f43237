//! The chart of speed and accuracy, and the pictures of errors.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use bregma::chart::{Chart, Machine, Measure, Plan, Point, errors, orbit, plot, table};
use bregma::input::{Opened, Source};
use bregma_renderer::accuracy::{Off, Truth, Verdict};
use bregma_renderer::{CpuRenderer, GpuRenderer, Solver};
use bregma_volume::{IndexPoint, Progress};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Tests that time take turns.
static TURN: Mutex<()> = Mutex::new(());

fn turn() -> MutexGuard<'static, ()> {
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

fn machines() -> Vec<Machine> {
    let gpu = GpuRenderer::new(true).expect("a software Vulkan driver is installed by tests/run");
    vec![Machine { backend: "cpu", renderer: Box::new(CpuRenderer::default()) }, Machine { backend: "gpu", renderer: Box::new(gpu) }]
}

fn skull() -> Opened {
    let mut opened = Opened::demo(96, &Progress::default()).unwrap();
    opened.volumes.truncate(1);
    opened.scene.layers.truncate(1);
    opened
}

/// `exact` on each backend, after a check that it is right, and that no other solver is as right and faster by more than the noise of a
/// busy machine.
fn unbeaten(chart: &Chart) -> Vec<&Point> {
    let exact = |backend: &&str| chart.points.iter().find(|p| p.backend == *backend && p.solver == Solver::Exact).unwrap();
    let all: Vec<&Point> = chart.backends().iter().map(exact).collect();
    for exact in &all {
        let backend = exact.backend;
        assert!(exact.tally.hits > exact.tally.rays / 50, "a picture of nothing proves nothing");
        assert_eq!((exact.tally.missed, exact.tally.false_hits), (0, 0), "{backend}");
        assert!(exact.depth_voxel.max <= 1e-3, "{backend}: {:?}", exact.depth_voxel);
        for measure in Measure::ALL {
            let front: Vec<String> = chart.front(backend, measure).iter().map(|p| p.solver.to_string()).collect();
            println!("{}, {backend}, front by {measure:?}: {}", chart.scans, front.join(", "));
            for p in chart.points.iter().filter(|p| p.backend == backend && measure.of(p) <= measure.of(exact)) {
                // Twice the noise that the front itself allows for: what else runs falls on one solver's frames and not on another's.
                assert!(p.ms_per_frame > 0.8 * exact.ms_per_frame, "{} beats exact on {backend} by {measure:?}: {p:?}", p.solver);
            }
        }
    }
    all
}

#[test]
fn every_solver_is_charted_and_exact_is_right() {
    // Fails if a solver is left out, if `exact` misses, invents or misplaces a surface, or if another solver is as right as `exact` in
    // every respect and faster by more than the noise of a busy machine.
    let _turn = turn();
    let opened = skull();
    let plan = Plan { cameras: orbit(&opened.bounds(), 2), size: [192, 160], rounds: 3 };
    let chart = Chart::measure(&opened.volumes, &opened.scene, &plan, &mut machines(), &Progress::default()).unwrap();
    print!("{}", table::text(&chart));
    assert_eq!(chart.left_out, Vec::<String>::new());
    assert_eq!(chart.points.len(), 2 * Solver::ALL.len() - 1, "every solver on both backends, and the hardware's filter on the GPU");
    for exact in unbeaten(&chart) {
        let (s, backend) = (exact.split, exact.backend);
        println!("{backend}, exact: {s:?} of {:.2} ms", exact.ms_per_frame);
        assert!(s.walking_ms > 0.0 && s.fetching_ms > 0.0 && s.shading_ms > 0.0, "{s:?}");
    }
    let linear = chart.points.iter().find(|p| p.solver == Solver::Linear).unwrap();
    assert!(linear.depth_voxel.p999 > 0.05 && linear.normal_deg.p999 > 1.0, "too good to be linear: {linear:?}");
    // The files: a row for each point, and figures that show every solver's name.
    assert_eq!(table::csv(&chart).lines().count(), chart.points.len() + 1);
    let svg = plot::svg(&chart).unwrap();
    assert!(Solver::ALL.iter().all(|solver| svg.contains(&format!("\n{solver}\n"))), "{svg}");
    let (rgb, width, height) = plot::pixels(&chart).unwrap();
    assert_eq!(rgb.len(), (width * height * 3) as usize);
    assert!(rgb.chunks(3).filter(|p| p.iter().all(|&v| v < 64)).count() > 2000, "text and lines are drawn");
}

#[test]
fn exact_is_on_the_front_of_real_scans() {
    // Fails if on a real scan `exact` is wrong anywhere, or another solver is as right and faster.
    let Some(folder) = bregma_tests::data("fronts of real scans") else { return };
    let _turn = turn();
    let scans = [("cthead-unc/CThead.nhdr", 1150.0), ("cranium-invesalius/Cranium.nhdr", 226.0), ("classic/bonsai.nii.gz", 40.0)];
    for (name, iso) in scans {
        let source = Source { file: folder.join(name), ..Source::default() };
        let mut opened = Opened::read(&[source], &Progress::default()).unwrap();
        opened.scene.layers[0].iso = iso;
        let plan = Plan { cameras: orbit(&opened.bounds(), 3)[..1].to_vec(), size: [256, 256], rounds: 3 };
        unbeaten(&Chart::measure(&opened.volumes, &opened.scene, &plan, &mut machines(), &Progress::default()).unwrap());
    }
}

#[test]
fn error_pictures_show_the_grid_for_linear_and_nothing_for_exact() {
    // Fails if `linear` shows no grid: it is right where a ray passes a face of a cell and wrong between faces, so that its errors trace
    // the cells; or if `exact` shows anything.
    let _turn = turn();
    let mut opened = skull();
    let (w, h) = (256, 256);
    let truth = Truth::of(&opened.volumes, &opened.scene, w, h, &Progress::default()).unwrap();
    for mut machine in machines() {
        for solver in [Solver::Exact, Solver::Linear] {
            opened.scene.solver = solver;
            let picture = machine.renderer.render(&opened.volumes, &opened.scene, w, h).unwrap();
            let verdicts = truth.judge(&picture);
            let offs: Vec<(usize, Off)> = verdicts
                .iter()
                .enumerate()
                .filter_map(|(n, v)| match v {
                    Verdict::Hit(off) => Some((n, *off)),
                    _ => None,
                })
                .collect();
            // Distance of the true hit from the nearest face of its cell, in voxels.
            let to_face = |n: usize| {
                let IndexPoint(p) = truth.surfaces()[0].grid.index(truth.ray(n).at(truth.depth_mm(n)));
                (p - p.round()).abs().min_element()
            };
            let mean = |near: bool| {
                let chosen: Vec<f64> =
                    offs.iter().filter(|(n, _)| (to_face(*n) < 0.02) == near).map(|(_, off)| off.voxel.abs().min(1.0)).collect();
                chosen.iter().sum::<f64>() / chosen.len() as f64
            };
            let (at_faces, between, visible) = (mean(true), mean(false), offs.iter().filter(|(_, off)| off.voxel.abs() > 1e-3).count());
            println!(
                "{solver} on {}: mean |dt| {at_faces:.1e} voxel at faces, {between:.1e} between, {visible} of {} pixels beyond 1e-3",
                machine.backend,
                offs.len()
            );
            let colors = errors::pixels(&verdicts);
            assert_eq!(colors.len(), (w * h) as usize);
            match solver {
                Solver::Exact => {
                    assert_eq!(visible, 0);
                    assert!(!colors.contains(&errors::MISSED) && !colors.contains(&errors::FALSE));
                }
                _ => {
                    assert!(visible * 4 > offs.len(), "linear errs in at least a quarter of the pixels");
                    assert!(between > 3.0 * at_faces, "no grid: {at_faces} at faces, {between} between");
                }
            }
        }
    }
}
