//! `bregma bench`: how long the frames of the orbit take.

use crate::cli::args::BenchArgs;
use crate::cli::error::CommandError;
use crate::cli::opening::open;
use crate::cli::terminal::{print, warn};
use bregma_renderer::{Backend, Mode, Reconstruction, Renderer, Scene, Solver};
use bregma_session::chart::orbit;
use bregma_session::{FrameRate, Machine, Opened};
use serde::Serialize;
use std::time::Instant;

#[derive(Serialize)]
struct Dims {
    dims: [usize; 3],
}

#[derive(Serialize)]
struct Record {
    backend: Backend,
    adapter: String,
    threads: usize,
    mode: Mode,
    shadows: bool,
    reconstruction: Reconstruction,
    solver: Solver,
    size: u32,
    frames: u32,
    volumes: Vec<Dims>,
    first_frame_ms: f64,
    median_ms: f64,
    p95_ms: f64,
    #[serde(flatten)]
    rate: FrameRate,
    isovalue_change_ms: f64,
    rays_per_s: f64,
    memory_bytes: usize,
}

/// Times the orbit. A frame is timed from the request to the pixels in memory.
pub fn bench(args: &BenchArgs, machine: Machine) -> Result<(), CommandError> {
    let mut opened = open(&args.sources.0, &args.isovalues)?;
    args.look.apply(&mut opened, Some(args.mode))?;
    warn(&args.look.idle(&opened.scene));
    opened.scene.solver = args.solver;
    let record = measure(&opened, args, machine.renderer()?.as_mut())?;
    if args.json {
        return print(&(serde_json::to_string(&record).expect("the record has only numbers, texts and lists") + "\n"));
    }
    print(&format!(
        "{}\n  first frame      {:8.1} ms\n  median           {:8.1} ms of {} frames of {}×{}\n  95th percentile  {:8.1} ms\n  frames a second  {:8.1} at least, {:.1} in the mean, {:.1} at most\n  isovalue change  {:8.1} ms\n  rays             {:8.2} million a second\n  memory           {:8.1} MiB\n",
        record.adapter,
        record.first_frame_ms,
        record.median_ms,
        record.frames,
        record.size,
        record.size,
        record.p95_ms,
        record.rate.min_per_s,
        record.rate.mean_per_s,
        record.rate.max_per_s,
        record.isovalue_change_ms,
        record.rays_per_s / 1e6,
        record.memory_bytes as f64 / f64::from(1 << 20),
    ))
}

fn measure(opened: &Opened, args: &BenchArgs, renderer: &mut dyn Renderer) -> Result<Record, CommandError> {
    let (backend, adapter) = (renderer.backend(), renderer.name());
    let cameras = orbit(&opened.bounds(), args.frames);
    let mut timed = |scene: &Scene| -> Result<f64, CommandError> {
        let start = Instant::now();
        let picture = renderer.render(&opened.volumes, scene, args.size, args.size)?;
        let millis = start.elapsed().as_secs_f64() * 1e3;
        renderer.reuse(picture);
        Ok(millis)
    };
    let mut scene = opened.scene.clone();
    scene.camera = cameras[0];
    let first_frame_ms = timed(&scene)?;
    let mut frames = Vec::new();
    for camera in &cameras {
        scene.camera = *camera;
        frames.push(timed(&scene)?);
    }
    // The first exact frame of another surface: half a percent of the range away.
    for (layer, volume) in scene.layers.iter_mut().zip(&opened.volumes) {
        let [low, high] = volume.range();
        layer.iso += 0.005 * (high - low);
    }
    scene.camera = cameras[0];
    let isovalue_change_ms = timed(&scene)?;
    frames.sort_by(f64::total_cmp);
    let at = |part: f64| frames[((frames.len() - 1) as f64 * part).round() as usize];
    let median_ms = at(0.5);
    let rate = FrameRate::of(&frames).expect("the orbit has at least one frame");
    Ok(Record {
        backend,
        adapter,
        threads: rayon::current_num_threads(),
        mode: opened.scene.mode,
        shadows: opened.scene.shadows,
        reconstruction: opened.scene.reconstruction,
        solver: args.solver,
        size: args.size,
        frames: args.frames,
        volumes: opened.volumes.iter().map(|v| Dims { dims: v.grid().dims() }).collect(),
        first_frame_ms,
        median_ms,
        p95_ms: at(0.95),
        rate,
        isovalue_change_ms,
        rays_per_s: f64::from(args.size).powi(2) / (median_ms / 1e3),
        memory_bytes: opened.volumes.iter().map(|v| v.sample_bytes() + v.index_bytes()).sum::<usize>() + renderer.bytes(),
    })
}
