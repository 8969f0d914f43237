//! What the frames are made of, timed by itself: `cargo bench -p bregma-tests` (name a part of a bench's path to run only that).

use bregma_renderer::stability::{Segment, SolveSegments};
use bregma_renderer::{CpuRenderer, DistanceMap, Renderer, Solver};
use bregma_session::Opened;
use bregma_tests::Random;
use bregma_volume::{Progress, RangeBricks, ReadSamples, with_samples};
use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use glam::Vec3;
use std::sync::LazyLock;

static PAIR: LazyLock<Opened> = LazyLock::new(|| Opened::demo(256, &Progress::default()).expect("the demo pair is made here"));

fn main() {
    // A core alone: what is compared are loops.
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().expect("nothing has used threads yet");
    divan::main();
}

/// Cells that a surface passes and a tenth of rough ones, as in a picture.
fn segments() -> Vec<Segment> {
    let mut random = Random(7);
    let mut unit = || random.unit() as f32;
    let mut some = || {
        let (normal, rough) = (Vec3::new(unit(), unit(), unit()) - 0.5, if unit() < 0.1 { 1.0 } else { 0.1 });
        let corners = std::array::from_fn(|c| {
            let at = Vec3::new((c & 1) as f32, (c >> 1 & 1) as f32, (c >> 2) as f32) - 0.5;
            normal.dot(at) + rough * (unit() - 0.5)
        });
        Segment { corners, from: Vec3::new(unit(), unit(), 0.0), to: Vec3::new(unit(), unit(), 1.0) }
    };
    (0..16 * 1024).map(|_| some()).collect()
}

/// The first entry of 16,384 segments.
#[divan::bench(args = Solver::ALL.into_iter().filter(|s| s.on_cpu()))]
fn solver(bencher: Bencher<'_, '_>, solver: Solver) {
    let (segments, mut renderer) = (segments(), CpuRenderer::default());
    bencher.counter(ItemsCount::new(segments.len())).bench_local(|| renderer.solve(solver, black_box(&segments)).expect("the CPU has it"));
}

/// The same by `exact` with each set of vector instructions, the best one first.
#[divan::bench(args = 0..CpuRenderer::instruction_sets().len())]
fn exact_by_instruction_set(bencher: Bencher<'_, '_>, number: usize) {
    let (segments, mut renderer) = (segments(), CpuRenderer::with_instructions(CpuRenderer::instruction_sets()[number]));
    bencher
        .counter(ItemsCount::new(segments.len()))
        .bench_local(|| renderer.solve(Solver::Exact, black_box(&segments)).expect("the CPU has it"));
}

/// A frame of skull A, 512×512, with each set of vector instructions.
#[divan::bench(args = 0..CpuRenderer::instruction_sets().len(), sample_count = 20)]
fn frame_by_instruction_set(bencher: Bencher<'_, '_>, number: usize) {
    let mut scene = PAIR.scene.clone();
    scene.layers[1].visible = false;
    let mut renderer = CpuRenderer::with_instructions(CpuRenderer::instruction_sets()[number]);
    bencher.bench_local(|| renderer.render(&PAIR.volumes, &scene, 512, 512).expect("the demo pair can be drawn"));
}

/// Both skulls of the built-in pair, by their samples along the longest side.
#[divan::bench(args = [96, 256], sample_count = 3, sample_size = 1)]
fn demo_pair(bencher: Bencher<'_, '_>, size: usize) {
    bencher.bench_local(|| Opened::demo(black_box(size), &Progress::default()).expect("the demo pair is made here"));
}

/// The ranges of the bricks of skull A: once for each volume.
#[divan::bench(sample_count = 20)]
fn range_bricks(bencher: Bencher<'_, '_>) {
    let volume = &PAIR.volumes[0];
    bencher.bench_local(|| with_samples!(volume.samples(), samples => RangeBricks::build(black_box(samples), volume.grid().dims())));
}

/// The distance map of skull A: for each new isovalue.
#[divan::bench]
fn distance_map(bencher: Bencher<'_, '_>) {
    let bricks = PAIR.volumes[0].bricks();
    bencher.bench_local(|| DistanceMap::build(black_box(bricks), 226.0, 1.0));
}
