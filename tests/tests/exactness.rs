//! Real scans over the 8-frame orbit at 512×512: both renderers against the float64 reference, and against each other.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use bregma_renderer::accuracy::Truth;
use bregma_renderer::{Camera, CpuRenderer, GpuRenderer, Renderer};
use bregma_session::{Opened, Source};
use bregma_tests::{Exactness, color_difference, data};
use bregma_volume::Progress;
use std::path::Path;

/// Opens scans (each with its registration) and checks the orbit. Fails if any ray of any frame that is not tangent misses what
/// the reference hits, hits what it misses, or is more than 1e-3 voxel off; or if the two backends look different.
fn check(what: &str, sources: &[Source], iso: Option<f64>) {
    let mut opened = Opened::read(sources, &Progress::default()).unwrap();
    if let Some(iso) = iso {
        opened.scene.layers.iter_mut().for_each(|layer| layer.iso = iso);
    }
    orbit(what, &mut opened);
}

fn orbit(what: &str, opened: &mut Opened) {
    let bounds = opened.bounds();
    let (mut cpu, mut gpu) = (CpuRenderer::default(), GpuRenderer::new(true).expect("a software Vulkan driver is installed by tests/run"));
    let (mut cpu_off, mut gpu_off) = (Exactness::default(), Exactness::default());
    let (mut pixels, mut unlike) = (0_usize, 0_usize);
    for frame in 0..8 {
        opened.scene.camera = Camera::orbit(&bounds, 45.0 * f64::from(frame), 15.0);
        let on_cpu = cpu.render(&opened.volumes, &opened.scene, 512, 512).unwrap();
        let on_gpu = gpu.render(&opened.volumes, &opened.scene, 512, 512).unwrap();
        pixels += on_cpu.rgba.len();
        unlike += on_cpu.rgba.iter().zip(&on_gpu.rgba).filter(|(a, b)| color_difference(**a, **b) > 2).count();
        let truth = Truth::of(&opened.volumes, &opened.scene, 512, 512, &Progress::default()).unwrap();
        cpu_off.judge(&truth, &on_cpu);
        gpu_off.judge(&truth, &on_gpu);
    }
    cpu_off.assert(&format!("{what}, cpu"));
    gpu_off.assert(&format!("{what}, gpu"));
    println!("{what}: {unlike} of {pixels} pixels differ by more than 2/255 between cpu and gpu");
    assert!(unlike * 10_000 <= pixels);
    assert!(cpu_off.tally.counts.hits * 50 > cpu_off.tally.counts.rays, "{what}: a picture of nothing proves nothing");
}

fn scan(folder: &Path, name: &str) -> Source {
    Source { file: folder.join(name), ..Source::default() }
}

#[test]
fn cthead() {
    let Some(d) = data("cthead") else { return };
    check("cthead", &[scan(&d, "cthead-unc/CThead.nhdr")], Some(1150.0));
}

#[test]
fn cranium() {
    let Some(d) = data("cranium") else { return };
    check("cranium", &[scan(&d, "cranium-invesalius/Cranium.nhdr")], None);
}

#[test]
fn mouse_pair() {
    let Some(d) = data("mouse pair") else { return };
    let moving = Source { transform: Some(d.join("mouse/rigid_from_landmarks.json")), ..scan(&d, "mouse/C57BL6_J_.nii.gz") };
    check("mouse pair", &[moving, scan(&d, "mouse/DBA_2J_.nii.gz")], None);
}

#[test]
fn bonsai() {
    let Some(d) = data("bonsai") else { return };
    check("bonsai", &[scan(&d, "classic/bonsai.nii.gz")], Some(40.0));
}

#[test]
fn engine() {
    let Some(d) = data("engine") else { return };
    check("engine", &[scan(&d, "classic/engine_256x256x110_uint8.raw")], Some(120.0));
}

#[test]
fn demo_pair() {
    orbit("demo pair", &mut Opened::demo(128, &Progress::default()).unwrap());
}
