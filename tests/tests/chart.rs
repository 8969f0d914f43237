//! The chart of speed and accuracy, and the pictures of errors.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use bregma_renderer::accuracy::{Off, Truth, Verdict};
use bregma_renderer::{Backend, CpuRenderer, GpuRenderer, Renderer, Solver};
use bregma_session::chart::{Chart, Measure, Plan, errors, orbit, plot, table};
use bregma_session::{Opened, Source};
use bregma_volume::{IndexPoint, Progress};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Tests that time take turns.
static TURN: Mutex<()> = Mutex::new(());

fn turn() -> MutexGuard<'static, ()> {
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

fn machines() -> Vec<Box<dyn Renderer>> {
    let gpu = GpuRenderer::new(true).expect("a software Vulkan driver is installed by tests/run");
    vec![Box::new(CpuRenderer::default()), Box::new(gpu)]
}

fn skull() -> Opened {
    let mut opened = Opened::demo(96, &Progress::default()).unwrap();
    opened.volumes.truncate(1);
    opened.scene.layers.truncate(1);
    opened
}

/// Measurements before a front counts as measured: what else a computer does may fall on one solver's frames and not on another's.
const ATTEMPTS: usize = 3;

/// The chart of the scans, after a check that `exact` is right on each backend and on the front of both measures.
fn unbeaten(opened: &Opened, plan: &Plan) -> Chart {
    let measure = || Chart::measure(&opened.volumes, &opened.scene, plan, &mut machines(), &Progress::default()).unwrap();
    let on_fronts = |chart: &Chart| {
        let is_on = |&(backend, measure): &(Backend, Measure)| {
            let front: Vec<String> = chart.front(backend, measure).iter().map(|p| p.solver.to_string()).collect();
            println!("{}, {backend}, front by {measure:?}: {}", chart.scans, front.join(", "));
            front.contains(&"exact".into())
        };
        chart.backends().into_iter().flat_map(|b| Measure::ALL.map(|m| (b, m))).filter(is_on).count()
            == chart.backends().len() * Measure::ALL.len()
    };
    let mut chart = measure();
    for attempt in 1.. {
        for exact in chart.points.iter().filter(|p| p.solver == Solver::Exact) {
            assert!(exact.counts.hits > exact.counts.rays / 50, "a picture of nothing proves nothing");
            assert_eq!((exact.counts.missed, exact.counts.false_hits), (0, 0), "{}", exact.backend);
            assert!(exact.depth_voxel.unwrap().max <= 1e-3, "{}: {:?}", exact.backend, exact.depth_voxel);
        }
        if on_fronts(&chart) {
            break;
        }
        assert!(attempt < ATTEMPTS, "another solver beats exact, {ATTEMPTS} times measured");
        chart = measure();
    }
    chart
}

#[test]
fn every_solver_is_charted_and_exact_is_right() {
    // Fails if a solver is left out, if `exact` misses, invents or misplaces a surface, or if another solver is as right as `exact` in
    // every respect and faster by more than the noise of a busy machine.
    let _turn = turn();
    let opened = skull();
    let plan = Plan { cameras: orbit(&opened.bounds(), 2), size: [320, 256], rounds: 5 };
    let chart = unbeaten(&opened, &plan);
    print!("{}", table::text(&chart));
    assert_eq!(chart.points.len(), 2 * Solver::ALL.len() - 1, "every solver on both backends, and the hardware's filter on the GPU");
    for exact in chart.points.iter().filter(|p| p.solver == Solver::Exact) {
        let (s, backend) = (exact.split, exact.backend);
        println!("{backend}, exact: {s:?} of {:.2} ms", exact.ms_per_frame);
        // A part may be lost in noise, but not the sum: it is the fastest frame.
        let sum = s.walking_ms + s.fetching_ms + s.solving_ms + s.shading_ms;
        assert!(s.walking_ms > 0.0 && sum > 0.3 * exact.ms_per_frame, "{s:?}");
    }
    let linear = chart.points.iter().find(|p| p.solver == Solver::Linear).unwrap();
    let (depth, normal) = (linear.depth_voxel.unwrap(), linear.normal_deg.unwrap());
    assert!(depth.p999 > 0.05 && normal.p999 > 1.0, "too good to be linear: {depth:?} {normal:?}");
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
        let plan = Plan { cameras: orbit(&opened.bounds(), 3)[..1].to_vec(), size: [448, 448], rounds: 7 };
        unbeaten(&opened, &plan);
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
            let picture = machine.render(&opened.volumes, &opened.scene, w, h).unwrap();
            let verdicts = truth.judge(&picture);
            let offs: Vec<(usize, Off)> = verdicts
                .iter()
                .enumerate()
                .filter_map(|(n, v)| match v {
                    Verdict::Hit(off) => Some((n, *off)),
                    _ => None,
                })
                .collect();
            // Distance of the true hit from the nearest face of its cell, in voxels; within 0.02 a chord's line is near its cubic.
            let to_face = |n: usize| {
                let IndexPoint(p) = truth.surfaces()[0].grid.index(truth.ray(n).at(truth.depth_mm(n)));
                (p - p.round()).abs().min_element()
            };
            let mean = |near: bool| {
                let chosen: Vec<f64> =
                    offs.iter().filter(|(n, _)| (to_face(*n) < 0.02) == near).map(|(_, off)| f64::from(off.voxel.abs().min(1.0))).collect();
                chosen.iter().sum::<f64>() / chosen.len() as f64
            };
            let (at_faces, between, visible) = (mean(true), mean(false), offs.iter().filter(|(_, off)| off.voxel.abs() > 1e-3).count());
            println!(
                "{solver} on {}: mean |dt| {at_faces:.1e} voxel at faces, {between:.1e} between, {visible} of {} pixels beyond 1e-3",
                machine.backend(),
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
                    // Three times, where this was written; without a grid, once.
                    assert!(between > 2.0 * at_faces, "no grid: {at_faces} at faces, {between} between");
                }
            }
        }
    }
}
