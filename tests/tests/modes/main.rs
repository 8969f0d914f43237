//! What the modes that look through the density draw: against quadratures written from the definitions, in float64; both backends against
//! each other; cuts where the answer is known; and by what surfaces are shaded.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod cuts;
mod shading;

use bregma_measure::probe_cut;
use bregma_renderer::{
    Bounds, Camera, Clip, Color, Control, CpuRenderer, CutFace, GpuRenderer, Integrator, Light, Mode, Picture, Point, Projection, Ray,
    Renderer, Scene, Shape, Shell, TransferFunction, Values, classify,
};
use bregma_session::{Opened, Source};
use bregma_tests::looks::looks;
use bregma_tests::{Random, color_difference, data, volume};
use bregma_volume::{Grid, IndexPoint, Progress, ReadSamples, Samples, Volume, WorldPoint};
use glam::{DAffine3, DMat3, DVec3, Vec3};
use std::path::Path;
use std::sync::Arc;

/// A ball of `radius_mm` around the middle of a grid, as a smooth ramp of 100 a mm through its surface at 0, which the interpolant follows but for
/// its bend.
fn ball(n: usize, spacing_mm: f64, radius_mm: f64, centre_mm: DVec3) -> Arc<Volume> {
    shells(n, spacing_mm, move |p| radius_mm - p.distance(centre_mm))
}

fn shells(n: usize, spacing_mm: f64, inside_mm: impl Fn(DVec3) -> f64) -> Arc<Volume> {
    let half = (n - 1) as f64 / 2.0 * spacing_mm;
    let grid = Grid::new([n; 3], DVec3::splat(spacing_mm), DVec3::splat(-half), DMat3::IDENTITY).unwrap();
    let at = |k: usize| {
        let p = DVec3::new((k % n) as f64, (k / n % n) as f64, (k / (n * n)) as f64) * spacing_mm - half;
        (100.0 * inside_mm(p)).clamp(-1000.0, 1000.0) as f32
    };
    volume("ball", grid, Samples::F32((0..n * n * n).map(at).collect()))
}

/// Noise over some voxels, on a sheared and turned grid: no symmetry helps.
fn rough(seed: u64) -> Arc<Volume> {
    let mut random = Random(seed);
    let dims = [37, 30, 41];
    let shear = DMat3::from_cols(DVec3::new(0.9, 0.1, 0.0), DVec3::new(-0.1, 1.1, 0.2), DVec3::new(0.15, 0.0, 1.4));
    let grid = Grid::from_affine(dims, DAffine3::from_mat3_translation(shear, DVec3::new(-15.0, -18.0, -25.0))).unwrap();
    let mut blobs: Vec<(DVec3, f64)> = vec![];
    for _ in 0..60 {
        let at = DVec3::new(random.unit(), random.unit(), random.unit()) * DVec3::from(dims.map(|n| n as f64));
        blobs.push((at, 400.0 * random.unit() - 100.0));
    }
    let value = |n: usize| {
        let p = DVec3::new((n % dims[0]) as f64, (n / dims[0] % dims[1]) as f64, (n / (dims[0] * dims[1])) as f64);
        blobs.iter().map(|(at, high)| high * (-0.04 * at.distance_squared(p)).exp()).sum::<f64>()
    };
    let samples = Samples::I16((0..grid.len()).map(|n| value(n) as i16).collect());
    volume("rough", grid, samples)
}

/// The interpolant in values, and its gradient in the world, from the definition.
fn interpolant(v: &Volume, transform: DAffine3, p: DVec3) -> Option<(f64, DVec3)> {
    let grid = v.grid().moved(transform).unwrap();
    let IndexPoint(i) = grid.index(WorldPoint(p));
    let [nx, ny, nz] = grid.dims();
    let last = DVec3::new((nx - 1) as f64, (ny - 1) as f64, (nz - 1) as f64);
    // Beside the box by rounding is on its face.
    if i.cmplt(DVec3::splat(-1e-9)).any() || i.cmpgt(last + 1e-9).any() {
        return None;
    }
    let cell = i.floor().clamp(DVec3::ZERO, last - 1.0);
    let local = i - cell;
    let (mut value, mut gradient) = (0.0, DVec3::ZERO);
    for corner in 0..8_usize {
        let offset = [corner & 1, corner >> 1 & 1, corner >> 2];
        let at: [usize; 3] = std::array::from_fn(|a| cell[a] as usize + offset[a]);
        let sample = v.value_of(v.samples().get_f64(at[0] + nx * (at[1] + ny * at[2])));
        let weight = |a: usize| if offset[a] == 1 { local[a] } else { 1.0 - local[a] };
        value += sample * weight(0) * weight(1) * weight(2);
        for a in 0..3 {
            let sign = if offset[a] == 1 { 1.0 } else { -1.0 };
            gradient[a] += sample * sign * weight((a + 1) % 3) * weight((a + 2) % 3);
        }
    }
    Some((value, grid.world_to_index().matrix3.transpose() * gradient))
}

/// Points evenly over the stretch of a ray in a volume's box, in the middles of so many parts of `part_mm` or less; with the part's length.
fn along(v: &Volume, transform: DAffine3, ray: &Ray, part_mm: f64) -> (Vec<f64>, f64) {
    let grid = v.grid().moved(transform).unwrap();
    let (o, d) = (grid.index(ray.origin).0, grid.world_to_index().transform_vector3(ray.direction));
    let (mut from, mut to) = (0.0_f64, f64::INFINITY);
    for a in 0..3 {
        let n = (grid.dims()[a] - 1) as f64;
        let (s, t) = ((0.0 - o[a]) / d[a], (n - o[a]) / d[a]);
        (from, to) = (from.max(s.min(t)), to.min(s.max(t)));
    }
    if from >= to {
        return (vec![], 0.0);
    }
    let count = ((to - from) / part_mm).ceil();
    let part = (to - from) / count;
    ((0..count as usize).map(|n| from + (n as f64 + 0.5) * part).collect(), part)
}

/// Where a ray passes from cell to cell.
fn faces(v: &Volume, transform: DAffine3, ray: &Ray) -> Vec<f64> {
    let grid = v.grid().moved(transform).unwrap();
    let (o, d) = (grid.index(ray.origin).0, grid.world_to_index().transform_vector3(ray.direction));
    (0..3).flat_map(|a| (0..grid.dims()[a]).map(move |n| (n as f64 - o[a]) / d[a])).filter(|t| t.is_finite()).collect()
}

/// Compares a projection's values with a quadrature at some pixels; the largest relative difference, and of the maximum that to the range.
fn check_projection(volumes: &[Arc<Volume>], scene: &Scene, renderer: &mut dyn Renderer, part_voxel: f64, pixels: usize) -> f64 {
    let (w, h) = (96, 80);
    let picture = renderer.render(volumes, scene, w, h).unwrap();
    let (v, layer) = (&volumes[0], &scene.layers[0]);
    let part_mm = part_voxel * v.grid().spacing_mm().min_element();
    let [low, high] = v.range();
    let mut random = Random(3);
    let (mut worst, mut compared) = (0.0_f64, 0);
    // Of a mean the size of the range counts where that is near 0.
    let scale = high - low;
    for _ in 0..pixels {
        let (x, y) = ((random.unit() * f64::from(w)) as u32, (random.unit() * f64::from(h)) as u32);
        let ray = scene.camera.ray(f64::from(x), f64::from(y), w, h);
        let (points, part) = along(v, layer.transform, &ray, part_mm);
        let found = f64::from(picture.values[(y * w + x) as usize]);
        // A ray that only touches the box may be missed.
        if points.len() < 20 {
            continue;
        }
        let of = |t: &f64| {
            let (value, gradient) = interpolant(v, layer.transform, ray.at(*t).0).unwrap_or((f64::NAN, DVec3::NAN));
            if scene.of_gradient { gradient.length() } else { value }
        };
        // An extreme may be a kink at a cell's face, which no even points meet.
        let faces = if matches!(scene.mode, Mode::Max | Mode::Min) { faces(v, layer.transform, &ray) } else { vec![] };
        let within = faces.iter().filter(|t| (points[0] - part..points[points.len() - 1] + part).contains(t));
        let values: Vec<f64> = points.iter().chain(within).map(of).filter(|v| !v.is_nan()).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let off = match scene.mode {
            Mode::Max => (values.iter().copied().fold(f64::MIN, f64::max) - found).abs() / scale,
            Mode::Min => (values.iter().copied().fold(f64::MAX, f64::min) - found).abs() / scale,
            Mode::Mean => (mean - found).abs() / mean.abs().max(0.01 * scale),
            _ => {
                let length = points.len() as f64 * part;
                (mean * length - found).abs() / (mean * length).abs().max(0.01 * scale * length)
            }
        };
        assert!(off.is_finite(), "pixel {x}, {y}: {found} where the quadrature gives {mean}");
        (worst, compared) = (worst.max(off), compared + 1);
    }
    assert!(compared > pixels / 10, "{compared} of {pixels} rays meet the volume");
    worst
}

fn scene_of(volumes: &[Arc<Volume>], mode: Mode) -> Scene {
    let mut scene = Scene { mode, ..Scene::of(volumes) };
    scene.camera = Camera::orbit(&Bounds::of(volumes.iter().map(|v| v.grid())), 33.0, 21.0);
    scene
}

fn gpu() -> GpuRenderer {
    GpuRenderer::new(true).expect("a software Vulkan driver is installed by tests/run")
}

#[test]
fn projections_equal_a_quadrature() {
    // Fails if a cell is left out or counted twice, if a cubic is averaged wrongly, or if depth is taken for length.
    let volumes = [rough(4)];
    for of_gradient in [false, true] {
        for mode in [Mode::Max, Mode::Min, Mode::Mean, Mode::Xray] {
            let scene = Scene { of_gradient, ..scene_of(&volumes, mode) };
            let cpu_off = check_projection(&volumes, &scene, &mut CpuRenderer::default(), 0.002, 150);
            let gpu_off = check_projection(&volumes, &scene, &mut gpu(), 0.002, 150);
            println!("{mode:?}, gradient {of_gradient}: largest difference {cpu_off:.1e} on cpu, {gpu_off:.1e} on gpu");
            // A kink of the quadrature's own at a cell's face, where the gradient jumps, weighs as much as its part.
            let allowed = if matches!(mode, Mode::Max | Mode::Min) && !of_gradient { 1e-4 } else { 1e-3 };
            assert!(cpu_off < allowed && gpu_off < allowed);
        }
    }
}

#[test]
fn of_a_range_of_values_projections_equal_a_quadrature() {
    // Fails if a part of a cell beside the range counts, one within it does not, or the range's ends are taken for other values.
    let volumes = [rough(4)];
    let [low, high] = volumes[0].range();
    let (w, h) = (96, 80);
    for part in [[0.2, 0.4], [0.5, 2.0], [-1.0, 0.3]] {
        let range = part.map(|p| low + p * (high - low));
        for mode in [Mode::Max, Mode::Min, Mode::Mean, Mode::Xray] {
            let scene = Scene { value_range: Some(range), ..scene_of(&volumes, mode) };
            let pictures = [CpuRenderer::default().render(&volumes, &scene, w, h).unwrap(), gpu().render(&volumes, &scene, w, h).unwrap()];
            let (mut worst, mut compared, mut empty) = (0.0_f64, 0, 0);
            let mut random = Random(3);
            for _ in 0..500 {
                let (x, y) = ((random.unit() * f64::from(w)) as u32, (random.unit() * f64::from(h)) as u32);
                let ray = scene.camera.ray(f64::from(x), f64::from(y), w, h);
                let (points, part) = along(&volumes[0], DAffine3::IDENTITY, &ray, 0.002);
                let of = |t: &f64| interpolant(&volumes[0], DAffine3::IDENTITY, ray.at(*t).0).map(|(value, _)| value);
                let there: Vec<f64> = points.iter().filter_map(of).filter(|v| (range[0]..=range[1]).contains(v)).collect();
                let found = pictures.each_ref().map(|p| f64::from(p.values[(y * w + x) as usize]));
                // A ray that only touches the box, or the range, may be missed.
                if there.len() < 20 {
                    let is_beside = points.len() >= 20 && there.is_empty();
                    assert!(!is_beside || found.iter().all(|v| v.is_nan()), "pixel {x}, {y}: {found:?} where nothing is in the range");
                    empty += usize::from(is_beside);
                    continue;
                }
                let length = there.len() as f64 * part;
                let mean = there.iter().sum::<f64>() / there.len() as f64;
                let (expected, scale) = match mode {
                    Mode::Max => (there.iter().copied().fold(f64::MIN, f64::max), high - low),
                    Mode::Min => (there.iter().copied().fold(f64::MAX, f64::min), high - low),
                    Mode::Mean => (mean, high - low),
                    _ => (mean * length, (high - low) * length),
                };
                found.iter().for_each(|found| worst = worst.max((found - expected).abs() / scale));
                compared += 1;
            }
            println!("{mode:?} of {range:?}: largest difference {worst:.1e} of {compared} rays; {empty} meet nothing of it");
            assert!(worst < 5e-4 && compared > 10, "{mode:?} of {range:?}: {worst}");
        }
    }
}

#[test]
fn projections_of_real_scans_equal_a_quadrature() {
    let Some(data) = data("projections of real scans") else { return };
    for file in ["cthead-unc/CThead.nhdr", "cranium-invesalius/Cranium.nhdr", "classic/bonsai.nii.gz"] {
        let source = Source { file: data.join(file), ..Source::default() };
        let opened = Opened::read(&[source], &Progress::default()).unwrap();
        for mode in [Mode::Max, Mode::Min, Mode::Mean, Mode::Xray] {
            let scene = scene_of(&opened.volumes, mode);
            let cpu_off = check_projection(&opened.volumes, &scene, &mut CpuRenderer::default(), 0.01, 100);
            let gpu_off = check_projection(&opened.volumes, &scene, &mut gpu(), 0.01, 100);
            let allowed = if matches!(mode, Mode::Max | Mode::Min) { 1e-4 } else { 1e-3 };
            println!("{file}, {mode:?}: largest difference {cpu_off:.1e} on cpu, {gpu_off:.1e} on gpu, {allowed:.0e} allowed");
            assert!(cpu_off < allowed && gpu_off < allowed, "{file} {mode:?}");
        }
    }
}

/// Only colour and opacity: no light, nothing behind.
fn unlit(mut scene: Scene) -> Scene {
    scene.light = Light { ambient: 1.0, diffuse: 0.0, specular: 0.0, ..Light::default() };
    scene.background = Some(Color([0.0; 3]));
    scene
}

/// The emission and absorption integral along a ray from the definition, in steps of a thousandth of a voxel: linear colour over black.
fn quadrature(volumes: &[Arc<Volume>], scene: &Scene, ray: &Ray) -> Vec3 {
    let step_mm = 0.001 * volumes.iter().map(|v| v.grid().spacing_mm().min_element()).fold(f64::INFINITY, f64::min);
    let controls: Vec<Vec<Control>> = scene.layers.iter().zip(volumes).map(|(l, v)| l.controls(v)).collect();
    let spans = volumes.iter().zip(&scene.layers).map(|(v, l)| along(v, l.transform, ray, step_mm).0);
    let ends: Vec<[f64; 2]> = spans.filter(|p| !p.is_empty()).map(|p| [p[0], p[p.len() - 1]]).collect();
    let (from, to) = (ends.iter().map(|e| e[0]).fold(f64::INFINITY, f64::min), ends.iter().map(|e| e[1]).fold(0.0, f64::max));
    let (mut color, mut clear) = (DVec3::ZERO, 1.0_f64);
    let mut t = from;
    while t < to && clear > 1e-7 {
        let p = ray.at(t + 0.5 * step_mm).0;
        let (mut extinction, mut sent) = (0.0_f64, DVec3::ZERO);
        for ((v, layer), controls) in volumes.iter().zip(&scene.layers).zip(&controls) {
            let Some((value, _)) = interpolant(v, layer.transform, p) else { continue };
            let paint = classify(controls, value).as_dvec4();
            extinction += paint.w;
            sent += paint.w * paint.truncate();
        }
        if extinction > 0.0 {
            let kept = (-extinction * step_mm).exp();
            color += clear * (1.0 - kept) * sent / extinction;
            clear *= kept;
        }
        t += step_mm;
    }
    color.as_vec3()
}

/// How far a byte of a picture is from a linear colour, in bytes beyond rounding.
fn bytes_off(byte: u8, light: f32) -> f32 {
    let c = light.clamp(0.0, 1.0);
    let encoded = 255.0 * if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
    ((f32::from(byte) - encoded).abs() - 0.5).max(0.0)
}

#[test]
fn the_exact_integral_is_the_quadratures() {
    // Fails if a control point or a turn is passed over, or two volumes at one place are not mixed. The precision that is stated is a
    // twentieth of a display's step.
    let volumes = [rough(4), rough(9)];
    let mut scene = unlit(scene_of(&volumes, Mode::Dvr));
    scene.integrator = Integrator::Exact;
    for (n, layer) in scene.layers.iter_mut().enumerate() {
        let point = |value: f64, rgb: [f32; 3], opacity: f64| Point { value, color: Color(rgb), opacity };
        layer.transfer = Some(TransferFunction {
            name: "bands".into(),
            values: Values::Scan,
            overall: 1.0,
            over_mm: Some(1.0),
            points: vec![
                point(20.0, [1.0, 0.0, 0.2], 0.0),
                point(60.0, [0.9, 0.4, 0.1], 0.15),
                point(90.0, [0.1, 0.9, 0.3], 0.02),
                point(150.0, [0.2, 0.3, 1.0], 0.4 + 0.2 * n as f64),
            ],
            gradient: vec![],
        });
    }
    let (w, h) = (64, 48);
    let pictures = [CpuRenderer::default().render(&volumes, &scene, w, h).unwrap(), gpu().render(&volumes, &scene, w, h).unwrap()];
    let mut random = Random(1);
    let (mut worst, mut lit) = ([0.0_f32; 2], 0);
    for _ in 0..150 {
        let (x, y) = ((random.unit() * f64::from(w)) as u32, (random.unit() * f64::from(h)) as u32);
        let truth = quadrature(&volumes, &scene, &scene.camera.ray(f64::from(x), f64::from(y), w, h));
        lit += usize::from(truth.max_element() > 0.05);
        for (picture, worst) in pictures.iter().zip(&mut worst) {
            let rgba = picture.rgba[(y * w + x) as usize];
            (0..3).for_each(|a| *worst = worst.max(bytes_off(rgba[a], truth[a])));
        }
    }
    println!("exact integral: {lit} rays, off by {:.3} and {:.3} of a byte beyond rounding", worst[0], worst[1]);
    assert!(lit > 20 && worst.iter().all(|w| *w < 0.05));
    // And steps come to it as they grow shorter.
    let off = |per_voxel: f32| -> f64 {
        let steps = Scene { integrator: Integrator::Steps { per_voxel, jitter: false }, ..scene.clone() };
        let picture = CpuRenderer::default().render(&volumes, &steps, w, h).unwrap();
        let pairs = picture.rgba.iter().zip(&pictures[0].rgba);
        pairs.map(|(a, b)| f64::from(color_difference(*a, *b))).sum::<f64>() / picture.rgba.len() as f64
    };
    let errors = [0.5, 2.0, 8.0].map(off);
    println!("steps of 2, 1/2 and 1/8 voxel: off by {:.3}, {:.3} and {:.3} of 255", errors[0], errors[1], errors[2]);
    assert!(errors[0] > errors[1] && errors[1] > errors[2] && errors[2] < 1.0);
}

#[test]
fn opaque_shells_are_the_isosurface_and_clear_ones_count_every_crossing() {
    // Fails if a crossing is lost or made of nothing: then a ray would gather more or less than its walls.
    let volumes = [rough(4)];
    let mut iso = scene_of(&volumes, Mode::Iso);
    iso.layers[0].iso = 70.0;
    let opaque =
        Scene { mode: Mode::Transparent, layers: vec![bregma_renderer::Layer { opacity: 1.0, ..iso.layers[0].clone() }], ..iso.clone() };
    for renderer in [&mut CpuRenderer::default() as &mut dyn Renderer, &mut gpu()] {
        let (a, b) = (renderer.render(&volumes, &iso, 200, 150).unwrap(), renderer.render(&volumes, &opaque, 200, 150).unwrap());
        let unlike = a.rgba.iter().zip(&b.rgba).filter(|(a, b)| color_difference(**a, **b) > 1).count();
        println!("{}: {unlike} of 30000 pixels of an opaque shell differ from the isosurface", renderer.name());
        assert!(unlike <= 3 && a.volume_id == b.volume_id);
    }
    // Two levels of the same opacity, and no light: what is gathered says how many were crossed.
    let mut clear = unlit(opaque);
    let opacity = 0.05;
    (clear.layers[0].color, clear.layers[0].opacity) = (Color([1.0; 3]), opacity);
    clear.layers[0].shells = vec![Shell { iso: 110.0, color: Color([1.0; 3]), opacity }];
    let picture = CpuRenderer::default().render(&volumes, &clear, 100, 80).unwrap();
    let mut seen = [0; 12];
    for (n, rgba) in picture.rgba.iter().enumerate() {
        let ray = clear.camera.ray((n % 100) as f64, (n / 100) as f64, 100, 80);
        let crossings = |iso: f64| {
            let layers = [bregma_renderer::Layer { iso, ..clear.layers[0].clone() }];
            let found = bregma_measure::probe(&volumes, &layers, &ray).unwrap();
            // The box's faces close surfaces where rays come in, and a touch is no crossing.
            let leaves =
                found.volumes[0].segments.last().is_some_and(|s| s.clipped && s.to_mm >= found.volumes[0].box_mm.unwrap()[1] - 1e-9);
            2 * found.volumes[0].segments.len() - usize::from(leaves)
        };
        let count = crossings(70.0) + crossings(110.0);
        seen[count.min(11)] += 1;
        let gathered = 1.0 - (1.0 - opacity).powi(count as i32);
        assert!(bytes_off(rgba[0], gathered) < 0.1, "pixel {n}: {rgba:?} for {count} crossings");
    }
    println!("pixels by crossings: {seen:?}");
    assert!(seen[4..].iter().sum::<i32>() > 100);
}

#[test]
fn a_driver_that_ends_long_rays_is_told_and_not_believed() {
    // Fails if a picture comes out wrong without a word: llvmpipe ends an invocation's loops after 65,535 rounds.
    let volumes = [rough(4)];
    let integrator = Integrator::Steps { per_voxel: 1000.0, jitter: false };
    let scene = Scene { integrator, ..scene_of(&volumes, Mode::Dvr) };
    let cpu = CpuRenderer::default().render(&volumes, &scene, 24, 16).unwrap();
    match gpu().render(&volumes, &scene, 24, 16) {
        Ok(picture) => assert!(picture.rgba.iter().zip(&cpu.rgba).all(|(a, b)| color_difference(*a, *b) <= 2)),
        Err(e) => {
            println!("{e}");
            assert!(e.to_string().contains("--backend cpu"), "{e}");
        }
    }
}

#[test]
fn both_backends_draw_every_mode_alike() {
    // Fails if a twin is changed without the other.
    let moved = DAffine3::from_translation(DVec3::new(3.0, -2.0, 1.0));
    let volumes = [rough(4), rough(9)];
    let (mut cpu, mut gpu) = (CpuRenderer::default(), gpu());
    let (w, h) = (160, 120);
    let (mut unlike, mut pixels) = (0, 0);
    let mut pair = scene_of(&volumes, Mode::Iso);
    pair.layers.iter_mut().for_each(|l| l.iso = 60.0);
    pair.layers[1].transform = moved;
    for (n, (name, scene)) in looks(&pair).into_iter().enumerate() {
        // Each look through another point of its pixels.
        let sample = n as u32 % 16;
        let [a, b] = [&mut cpu as &mut dyn Renderer, &mut gpu].map(|r| r.sample(&volumes, &scene, [w, h], sample).unwrap());
        let count = |picture: &Picture| picture.rgba.iter().zip(&a.rgba).filter(|(p, q)| color_difference(**p, **q) > 2).count();
        let differ = count(&b);
        (unlike, pixels) = (unlike + differ, pixels + a.rgba.len());
        let drawn = a.rgba.iter().filter(|c| **c != a.rgba[0]).count();
        println!("{name}, {} cuts, {:?}: {differ} of {} pixels differ, {drawn} drawn", scene.clips.len(), scene.mode, a.rgba.len());
        assert!(differ <= 4 && drawn > a.rgba.len() / 40, "{name}");
        let differs = |(a, b): &(&f32, &f32)| a.is_nan() != b.is_nan() || (**a - **b).abs() > 1e-3 * a.abs().max(1.0);
        let values = a.values.iter().zip(&b.values).filter(differs).count();
        let ids = a.volume_id.iter().zip(&b.volume_id).filter(|(a, b)| a != b).count();
        // Where half of the light is kept may be a step away, and volumes that meet may take turns.
        let depths = a.depth_mm.iter().zip(&b.depth_mm).filter(|(a, b)| a.is_nan() != b.is_nan() || (**a - **b).abs() > 0.5).count();
        assert!(ids <= 20 && depths <= 20, "{name}: {ids} volumes and {depths} depths differ");
        // A ray that only touches the edge of a box or of a cut may be taken for a miss by one of them.
        assert!(values <= 4 && a.values.len() == b.values.len(), "{name}: {values} values differ");
    }
    println!("{unlike} of {pixels} pixels differ by more than 2/255");
    assert!(unlike * 10_000 <= pixels);
}

#[test]
fn overlay_draws_the_three_sectors_of_its_definition() {
    // Fails if another surface than the definition's is opaque, transparent, skipped or hidden (2008 thesis, figure 3.7): the nearer volume's
    // first surface transparent, its others skipped, the other volume's first opaque, what is behind hidden; alone it is opaque.
    let near = ball(61, 1.0, 12.0, DVec3::new(-6.0, -8.0, 0.0));
    let far = ball(61, 1.0, 12.0, DVec3::new(6.0, 8.0, 0.0));
    let volumes = [near, far];
    let mut scene = unlit(scene_of(&volumes, Mode::Overlay));
    // From the front: y grows away from the viewer.
    scene.camera = Camera {
        eye_mm: DVec3::new(0.0, -200.0, 0.0),
        target_mm: DVec3::ZERO,
        up: DVec3::Z,
        projection: Projection::Orthographic { height_mm: 60.0 },
    };
    scene.layers.iter_mut().for_each(|l| (l.iso, l.opacity) = (0.0, 0.25));
    scene.layers[0].color = Color([1.0, 0.0, 0.0]);
    scene.layers[1].color = Color([0.0, 0.0, 1.0]);
    let (w, h) = (120, 120);
    // LPS from the front: x grows to the right of the picture, or to the left of it; the camera says which.
    let pixel = |x_mm: f64| scene.camera.project(WorldPoint(DVec3::new(x_mm, 0.0, 0.0)), w, h).unwrap();
    for renderer in [&mut CpuRenderer::default() as &mut dyn Renderer, &mut gpu()] {
        let picture = renderer.render(&volumes, &scene, w, h).unwrap();
        let at = |x_mm: f64| {
            let (x, y) = pixel(x_mm);
            picture.rgba[(y.round() as u32 * w + x.round() as u32) as usize]
        };
        let light = |share: f32| (255.0 * (1.055 * share.powf(1.0 / 2.4) - 0.055)).round() as u8;
        // Only the near ball, both, only the far ball.
        assert_eq!(at(-14.0), [255, 0, 0, 255], "alone, the first surface is opaque");
        assert!(
            color_difference(at(0.0), [light(0.25), 0, light(0.75), 255]) <= 1,
            "{:?}: a quarter of the near, the far behind it",
            at(0.0)
        );
        assert_eq!(at(14.0), [0, 0, 255, 255], "alone, the other's is opaque");
        assert_eq!(at(25.0), [0, 0, 0, 255]);
    }
}

#[test]
fn presets_and_tables_that_cannot_be_are_refused_by_name() {
    // Fails if a look that is not there goes unnoticed.
    let error = bregma_session::presets::find("no-such-look").unwrap_err().to_string();
    assert!(error.contains("no-such-look") && error.contains("bone"), "{error}");
    assert!(bregma_session::presets::find(Path::new("skin-and-bone").to_str().unwrap()).is_ok());
}
