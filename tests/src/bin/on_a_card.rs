//! What a graphics card draws, held to the CPU and to the float64 reference, and how fast: for a machine that has a card and nothing else. See
//! `tests/on-a-card`, which packs it.
//!
//!     on_a_card A.nrrd B.nrrd
//!
//! Writes on-a-card.json and on-a-card.md beside the scans; fails if the card draws something else than the CPU, or a ray is wrong.

use bregma_renderer::accuracy::Truth;
use bregma_renderer::{CpuRenderer, GpuRenderer, Integrator, Mode, Renderer, Scene};
use bregma_session::chart::{Chart, Plan, orbit, table};
use bregma_session::{Opened, Source};
use bregma_tests::looks::looks;
use bregma_tests::{Exactness, color_difference};
use bregma_volume::Progress;
use serde_json::{Value, json};
use std::error::Error;
use std::path::PathBuf;
use std::time::Instant;

/// Pixels along each side: of what is compared pixel by pixel, of what is judged by the reference, and of what is timed.
const PARITY_SIDE: u32 = 400;
const EXACT_SIDE: u32 = 384;
const TIMED_SIDES: [u32; 2] = [512, 1024];
/// Views all around.
const VIEWS: u32 = 8;

fn main() -> Result<(), Box<dyn Error>> {
    let files: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let [a, _] = files.as_slice() else { return Err("name two scans".into()) };
    let folder = a.parent().unwrap_or(a).to_owned();
    let sources: Vec<Source> = files.iter().map(|file| Source { file: file.clone(), ..Source::default() }).collect();
    let mut pair = Opened::read(&sources, &Progress::default())?;
    pair.scene.camera = orbit(&pair.bounds(), VIEWS)[0];
    let (mut cpu, mut gpu) = (CpuRenderer::default(), GpuRenderer::new(true)?);
    println!("{}, beside {}", gpu.name(), cpu.name());
    let parity = parity(&pair, &mut cpu, &mut gpu)?;
    let exactness = exactness(&pair, &mut gpu)?;
    let times = times(&pair, &mut cpu, &mut gpu)?;
    let names = [gpu.name(), cpu.name()];
    let mut machines: Vec<Box<dyn Renderer>> = vec![Box::new(cpu), Box::new(gpu)];
    let plan = Plan { cameras: orbit(&pair.bounds(), 2), size: [512; 2], rounds: 5 };
    let chart = Chart::measure(&pair.volumes, &pair.scene, &plan, &mut machines, &Progress::default())?;
    println!("{}", table::text(&chart));

    let wrong = parity.iter().chain(&exactness).filter(|row| row["is_right"] == false).count();
    let tables = [
        format!("# {}\n\nbeside {}; {} and {}\n", names[0], names[1], pair.volumes[0].name(), pair.volumes[1].name()),
        markdown("Pixels that differ from the CPU's by more than 2/255", &["look", "cuts", "pixels", "unlike"], &parity),
        markdown("Rays against the float64 reference", &["scans", "rays", "hits", "tangent", "wrong"], &exactness),
        markdown("ms a frame, median of the orbit", &["mode", "scans", "side", "gpu_ms", "cpu_ms"], &times),
        format!("## Solvers\n\n```\n{}```\n", table::text(&chart)),
    ];
    let record = json!({
        "adapter": names[0], "beside": names[1], "parity": parity, "exactness": exactness, "times": times,
        "chart_csv": table::csv(&chart),
    });
    std::fs::write(folder.join("on-a-card.json"), serde_json::to_string_pretty(&record)?)?;
    std::fs::write(folder.join("on-a-card.md"), tables.join("\n"))?;
    if wrong > 0 { Err(format!("{wrong} rows are wrong, see on-a-card.md").into()) } else { Ok(()) }
}

/// Every look on both backends.
fn parity(pair: &Opened, cpu: &mut CpuRenderer, gpu: &mut GpuRenderer) -> Result<Vec<Value>, Box<dyn Error>> {
    let mut rows = vec![];
    for (look, scene) in looks(&pair.scene) {
        let [a, b] = [
            cpu.render(&pair.volumes, &scene, PARITY_SIDE, PARITY_SIDE)?,
            gpu.render(&pair.volumes, &scene, PARITY_SIDE, PARITY_SIDE).map_err(|e| format!("{look}: {e}"))?,
        ];
        let unlike = a.rgba.iter().zip(&b.rgba).filter(|(p, q)| color_difference(**p, **q) > 2).count();
        let is_right = unlike * 10_000 <= a.rgba.len();
        println!("{look}, {} cuts: {unlike} of {} pixels", scene.clips.len(), a.rgba.len());
        rows.push(json!({
            "look": format!("{look}, {:?}", scene.mode), "cuts": scene.clips.len(), "pixels": a.rgba.len(), "unlike": unlike,
            "is_right": is_right,
        }));
    }
    Ok(rows)
}

/// Each scan and the pair from all around.
fn exactness(pair: &Opened, gpu: &mut GpuRenderer) -> Result<Vec<Value>, Box<dyn Error>> {
    let mut rows = vec![];
    for shown in [[true, false], [true, true]] {
        let mut scene = pair.scene.clone();
        scene.layers.iter_mut().zip(shown).for_each(|(layer, visible)| layer.visible = visible);
        let mut off = Exactness::default();
        for camera in orbit(&pair.bounds(), 4) {
            scene.camera = camera;
            let truth = Truth::of(&pair.volumes, &scene, EXACT_SIDE, EXACT_SIDE, &Progress::default())?;
            off.judge(&truth, &gpu.render(&pair.volumes, &scene, EXACT_SIDE, EXACT_SIDE)?);
        }
        let (counts, wrong) = (&off.tally.counts, off.wrong.len());
        println!("{} rays, {wrong} wrong", counts.rays);
        rows.push(json!({
            "scans": shown.iter().filter(|shown| **shown).count(), "rays": counts.rays, "hits": counts.hits, "tangent": counts.tangent,
            "wrong": wrong, "is_right": wrong == 0,
        }));
    }
    Ok(rows)
}

/// Every mode by itself and in company, from the request to the pixels in memory.
fn times(pair: &Opened, cpu: &mut CpuRenderer, gpu: &mut GpuRenderer) -> Result<Vec<Value>, Box<dyn Error>> {
    let base = |mode| Scene { mode, ..pair.scene.clone() };
    let exact = Scene { integrator: Integrator::Exact, ..base(Mode::Dvr) };
    let clear = base(Mode::Transparent);
    let modes = [
        ("iso", base(Mode::Iso)),
        ("iso, shadows", Scene { shadows: true, ..base(Mode::Iso) }),
        ("overlay", base(Mode::Overlay)),
        ("overlay, shadows", Scene { shadows: true, ..base(Mode::Overlay) }),
        ("transparent", clear.clone()),
        ("transparent, shadows", Scene { shadows: true, ..clear }),
        ("dvr, steps", base(Mode::Dvr)),
        ("dvr, exact", exact),
        ("max", base(Mode::Max)),
        ("min", base(Mode::Min)),
        ("mean", base(Mode::Mean)),
        ("xray", base(Mode::Xray)),
    ];
    let mut rows = vec![];
    for (mode, mut scene) in modes {
        for scans in [1, 2] {
            scene.layers[1].visible = scans == 2;
            for side in TIMED_SIDES {
                let gpu_ms = median_ms(gpu, pair, &mut scene, side)?;
                let cpu_ms = median_ms(cpu, pair, &mut scene, side)?;
                println!("{mode}, {scans} scans, {side}²: gpu {gpu_ms:.2} ms, cpu {cpu_ms:.2} ms");
                let [gpu_ms, cpu_ms] = [gpu_ms, cpu_ms].map(|ms| (ms * 100.0).round() / 100.0);
                rows.push(json!({ "mode": mode, "scans": scans, "side": side, "gpu_ms": gpu_ms, "cpu_ms": cpu_ms }));
            }
        }
    }
    Ok(rows)
}

/// The first frame, which compiles and uploads, is not timed.
fn median_ms(renderer: &mut dyn Renderer, pair: &Opened, scene: &mut Scene, side: u32) -> Result<f64, Box<dyn Error>> {
    let cameras = orbit(&pair.bounds(), VIEWS);
    renderer.render(&pair.volumes, scene, side, side)?;
    let mut frames = vec![];
    for camera in cameras {
        scene.camera = camera;
        let begun = Instant::now();
        renderer.render(&pair.volumes, scene, side, side)?;
        frames.push(begun.elapsed().as_secs_f64() * 1e3);
    }
    frames.sort_by(f64::total_cmp);
    Ok(frames[frames.len() / 2])
}

/// Rows as a table.
fn markdown(title: &str, columns: &[&str], rows: &[Value]) -> String {
    let head = format!("## {title}\n\n| {} |\n|{}\n", columns.join(" | "), "---|".repeat(columns.len()));
    let cell = |value: &Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
    let row = |row: &Value| format!("| {} |\n", columns.iter().map(|column| cell(&row[*column])).collect::<Vec<_>>().join(" | "));
    head + &rows.iter().map(row).collect::<String>()
}
