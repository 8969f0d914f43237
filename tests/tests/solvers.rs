//! Every solver on both backends: the two are twins, and each is as good and as bad as its method.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use bregma_field::crossings;
use bregma_renderer::{CpuRenderer, GpuRenderer, Picture, Renderer, Solver};
use bregma_session::Opened;
use bregma_volume::Progress;

/// What a solver made of a picture, against the reference.
#[derive(Debug, Default)]
struct Tally {
    hits: u32,
    missed: u32,
    false_hits: u32,
    /// Hits more than 0.05 voxel from the reference's.
    off: u32,
}

#[test]
fn solvers_are_twins_and_fail_as_their_methods_do() {
    // Fails if a solver differs between the languages, or does better or worse than its method should: linear interpolation
    // misses what enters and leaves within a cell, Marmitt finds it, and only `exact` is always right.
    let mut opened = Opened::demo(96, &Progress::default()).unwrap();
    opened.volumes.truncate(1);
    opened.scene.layers.truncate(1);
    let surface = opened.scene.surfaces(&opened.volumes).unwrap().remove(0).1;
    let (w, h) = (384, 384);
    let truth: Vec<f64> = (0..w * h)
        .map(|n| {
            let ray = opened.scene.camera.ray(f64::from(n % w), f64::from(n / w), w, h);
            crossings::first_entry(&surface, &ray).map_or(f64::NAN, |c| c.t_mm)
        })
        .collect();
    let voxel_mm = surface.grid.spacing_mm().min_element();
    let (mut cpu, mut gpu) = (CpuRenderer::default(), GpuRenderer::new(true).expect("a software Vulkan driver is installed by tests/run"));
    println!("{:<12} {:>6} {:>7} {:>6} {:>16}   of {} rays", "solver", "missed", "false", "off", "unlike on gpu", w * h);
    let tally_of = |picture: &Picture| {
        let mut tally = Tally::default();
        for (found, truth) in picture.depth_mm.iter().zip(&truth) {
            tally.hits += u32::from(!truth.is_nan());
            tally.missed += u32::from(found.is_nan() && !truth.is_nan());
            tally.false_hits += u32::from(!found.is_nan() && truth.is_nan());
            tally.off += u32::from((f64::from(*found) - truth).abs() > 0.05 * voxel_mm);
        }
        tally
    };
    for solver in Solver::ALL.into_iter().filter(|s| s.on_cpu()) {
        opened.scene.solver = solver;
        let on_cpu = cpu.render(&opened.volumes, &opened.scene, w, h).unwrap();
        let on_gpu = gpu.render(&opened.volumes, &opened.scene, w, h).unwrap();
        let tally = tally_of(&on_cpu);
        let differs = |(a, b): (&f32, &f32)| a.is_nan() != b.is_nan() || f64::from((a - b).abs()) > 1e-3 * voxel_mm;
        let unlike = on_cpu.depth_mm.iter().zip(&on_gpu.depth_mm).filter(|&(a, b)| differs((a, b))).count();
        println!("{:<12} {:>6} {:>7} {:>6} {:>16}", solver.to_string(), tally.missed, tally.false_hits, tally.off, unlike);
        // The closed form's functions (atan2, pow) differ between machines, and it is ill-conditioned: it may differ most.
        let allowed = if solver == Solver::Analytic { w * h / 1000 } else { w * h / 20_000 };
        assert!(unlike as u32 <= allowed, "{solver}: {unlike} pixels differ between cpu and gpu");
        match solver {
            Solver::Exact => assert_eq!((tally.missed, tally.false_hits, tally.off), (0, 0, 0)),
            Solver::Linear => assert!(tally.missed + tally.off > tally.hits / 1000, "too good to be linear: {tally:?}"),
            Solver::Marmitt(_) => assert!(tally.missed + tally.false_hits <= tally.hits / 2000, "{tally:?}"),
            Solver::Step(_) => assert!(tally.missed + tally.off > 0, "too good to be steps: {tally:?}"),
            Solver::Neubauer(_) | Solver::Analytic | Solver::Filter => {}
        }
    }
    // The hardware's filter has weights of a few bits on most cards; software drivers filter in float32.
    opened.scene.solver = Solver::Filter;
    let tally = tally_of(&gpu.render(&opened.volumes, &opened.scene, w, h).unwrap());
    println!("{:<12} {:>6} {:>7} {:>6}", "filter", tally.missed, tally.false_hits, tally.off);
    assert!(tally.missed + tally.false_hits + tally.off <= tally.hits / 100, "{tally:?}");
    let refused = cpu.render(&opened.volumes, &opened.scene, w, h).unwrap_err();
    assert!(refused.to_string().contains("--backend gpu"), "{refused}");
}
