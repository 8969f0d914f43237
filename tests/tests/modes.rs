//! What the modes that look through the density draw: against quadratures written from the definitions, in float64; both backends against
//! each other; and cuts where the answer is known.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

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
fn a_cut_shell_shows_two_circles_and_only_where_it_is_cut() {
    // Fails if a cap is missing, lies elsewhere, or a cut reaches another volume, the shadows, a pick or the probe.
    let (outer, inner) = (30.0, 22.0);
    let shell = shells(81, 1.0, |p| (outer - p.length()).min(p.length() - inner));
    let other = ball(81, 1.0, 12.0, DVec3::new(5.0, 0.0, 0.0));
    let volumes = [shell, other];
    let mut scene = scene_of(&volumes, Mode::Iso);
    scene.layers.iter_mut().for_each(|l| l.iso = 0.0);
    // From above, parallel: the plane z = 3.2 is seen as it is.
    let height_mm = 80.0;
    scene.camera = Camera {
        eye_mm: DVec3::new(0.0, 0.0, 200.0),
        target_mm: DVec3::ZERO,
        up: DVec3::Y,
        projection: Projection::Orthographic { height_mm },
    };
    let plane_mm = 3.2;
    let plane = Clip { layers: Some(vec![0]), ..Clip::all(Shape::Plane { normal: DVec3::Z, offset_mm: plane_mm }) };
    scene.clips = vec![plane];
    let size = 800;
    let px_per_mm = f64::from(size) / height_mm;
    let alone = {
        let mut scene = scene.clone();
        scene.layers[0].visible = false;
        CpuRenderer::default().render(&volumes, &scene, size, size).unwrap()
    };
    for renderer in [&mut CpuRenderer::default() as &mut dyn Renderer, &mut gpu()] {
        let picture = renderer.render(&volumes, &Scene { shadows: true, ..scene.clone() }, size, size).unwrap();
        // What lies at the plane is the section of the shell.
        let at_plane = |n: &usize| picture.volume_id[*n] == 1 && (f64::from(picture.depth_mm[*n]) - (200.0 - plane_mm)).abs() < 1e-3;
        let middle = (f64::from(size) - 1.0) / 2.0;
        let distance = |n: usize| DVec3::new((n % size as usize) as f64 - middle, (n / size as usize) as f64 - middle, 0.0).length();
        let all: Vec<usize> = (0..picture.rgba.len()).collect();
        // Areas average over a circle's pixels: that of the disc within the middle of the ring that is no section, and that of all within.
        let ring_middle = 26.0 * px_per_mm;
        let area_inner = all.iter().filter(|n| distance(**n) < ring_middle && !at_plane(n)).count() as f64;
        let area_outer = all.iter().filter(|n| distance(**n) < ring_middle).count() as f64
            + all.iter().filter(|n| distance(**n) >= ring_middle && at_plane(n)).count() as f64;
        let radius = |area: f64| (area / std::f64::consts::PI).sqrt();
        let expected = [inner, outer].map(|r: f64| (r * r - plane_mm * plane_mm).sqrt() * px_per_mm);
        // The interpolant's own radius: where it passes 0 along the plane, averaged over directions.
        let own = |near: f64| {
            let mean = (0..720).map(|n| {
                let angle = f64::from(n) * std::f64::consts::TAU / 720.0;
                let direction = DVec3::new(angle.cos(), angle.sin(), 0.0);
                let origin = WorldPoint(DVec3::new(0.0, 0.0, plane_mm));
                let layers = &scene.layers[..1];
                let found = bregma_measure::probe(&volumes[..1], layers, &Ray::new(origin, direction).unwrap()).unwrap();
                let crossings = &found.volumes[0].crossings;
                crossings.iter().map(|c| c.t_mm).min_by(|a, b| (a - near).abs().total_cmp(&(b - near).abs())).unwrap().powi(2)
            });
            (mean.sum::<f64>() / 720.0).sqrt() * px_per_mm
        };
        let found = [radius(area_inner), radius(area_outer)];
        let off = [0, 1].map(|n| (found[n] - own(expected[n] / px_per_mm)).abs());
        println!("{}: circles of {:.3} and {:.3} px, off by {:.3} and {:.3}", renderer.name(), found[0], found[1], off[0], off[1]);
        assert!(off.iter().all(|o| *o < 0.1), "{found:?} instead of {expected:?}");
        // The ball, in the opening, is drawn as if it were alone.
        let in_ball: Vec<usize> = all.iter().copied().filter(|&n| alone.volume_id[n] == 2).collect();
        let unlit_scene = renderer.render(&volumes, &scene, size, size).unwrap();
        assert!(in_ball.len() > 10_000 && in_ball.iter().all(|&n| unlit_scene.volume_id[n] == 2));
        assert!(in_ball.iter().all(|&n| color_difference(unlit_scene.rgba[n], alone.rgba[n]) <= 2), "a cut through A changes B");
    }
    // The half that is cut away casts no shadow: in the light of the camera's own shoulder the section lies in full light.
    let lamp = Light { toward: Vec3::new(0.0, 0.3, 1.0), ..scene.light };
    let lit = Scene { shadows: true, light: lamp, ..scene.clone() };
    let (with, without) = (
        CpuRenderer::default().render(&volumes, &lit, 200, 200).unwrap(),
        CpuRenderer::default().render(&volumes, &Scene { shadows: false, ..lit.clone() }, 200, 200).unwrap(),
    );
    let section: Vec<usize> = (0..with.rgba.len()).filter(|&n| (f64::from(with.depth_mm[n]) - (200.0 - plane_mm)).abs() < 1e-3).collect();
    assert!(section.len() > 3000 && section.iter().all(|&n| with.rgba[n] == without.rgba[n]), "what is cut away casts a shadow");
    // Pick and probe: a ray from above meets the shell at the plane, and the ball as ever.
    let down = Ray::new(WorldPoint(DVec3::new(0.0, -26.0, 200.0)), -DVec3::Z).unwrap();
    let (_, surface) = scene.surfaces(&volumes).unwrap().remove(0);
    let hit = bregma_field::crossings::first_entry(&surface, &down).unwrap();
    assert!((hit.t_mm - (200.0 - plane_mm)).abs() < 1e-9 && hit.clipped && hit.normal.abs_diff_eq(DVec3::Z, 1e-9));
    let probed = probe_cut(&volumes, &scene.layers, &scene.clips, &down).unwrap();
    let first = &probed.volumes[0].segments[0];
    assert!(first.clipped && (first.from_mm - (200.0 - plane_mm)).abs() < 1e-9);
    let whole = bregma_measure::probe(&volumes, &scene.layers, &down).unwrap();
    assert!(whole.volumes[0].segments[0].from_mm < first.from_mm && whole.volumes[1].segments == probed.volumes[1].segments);
}

#[test]
fn a_cuts_face_is_the_same_in_every_mode_where_something_is_visible() {
    // Fails if a face leaves out a volume that it cuts, stands where nothing is visible, or lets through what lies behind.
    let volumes = [rough(4), rough(9)];
    let plane = Clip::all(Shape::Plane { normal: DVec3::new(0.0, -1.0, 0.0), offset_mm: 2.0 });
    let mut scene = Scene { clips: vec![plane], ..scene_of(&volumes, Mode::Iso) };
    scene.layers.iter_mut().for_each(|l| (l.iso, l.opacity) = (60.0, 0.5));
    for cut_face in [CutFace::Density, CutFace::Blend, CutFace::Difference, CutFace::Transfer] {
        scene.cut_face = cut_face;
        for renderer in [&mut CpuRenderer::default() as &mut dyn Renderer, &mut gpu()] {
            let mut draw = |scene: Scene| renderer.render(&volumes, &scene, 120, 100).unwrap();
            let all = draw(Scene { mode: Mode::Iso, ..scene.clone() });
            for through in [Scene { mode: Mode::Transparent, ..scene.clone() }, Scene { mode: Mode::Dvr, ..scene.clone() }] {
                let picture = draw(through.clone());
                let lowest = |n: usize| match through.mode {
                    Mode::Dvr => through.layers[n].controls(&volumes[n]).iter().map(|c| c.value).fold(f64::INFINITY, f64::min),
                    _ => through.layers[n].iso,
                };
                let (mut same, mut beside) = (0, 0);
                for n in 0..picture.rgba.len() {
                    let ray = scene.camera.ray((n % 120) as f64, (n / 120) as f64, 120, 100);
                    let p = ray.origin.0 + ray.direction * ((-2.0 - ray.origin.0.y) / ray.direction.y);
                    let above = |n: usize| interpolant(&volumes[n], DAffine3::IDENTITY, p).map_or(f64::NEG_INFINITY, |v| v.0 - lowest(n));
                    let most = above(0).max(above(1));
                    // The density is that of the first volume that is visible.
                    let only_nearest = matches!(cut_face, CutFace::Density | CutFace::Transfer);
                    if (if only_nearest { above(0) } else { most }) > 0.01 {
                        same += 1;
                        assert!(color_difference(picture.rgba[n], all.rgba[n]) <= 1, "{cut_face:?} {:?} pixel {n}", through.mode);
                    } else if most < -0.01 && all.depth_mm[n].is_finite() {
                        // What is seen lies behind the plane, or nothing does.
                        let depth_mm = picture.depth_mm[n];
                        beside += usize::from(depth_mm.is_nan() || depth_mm >= all.depth_mm[n] + 1e-3);
                    }
                }
                assert!(same > 500 && beside > 100, "{cut_face:?} {:?}: {same} {beside}", through.mode);
            }
        }
    }
}

#[test]
fn a_cuts_face_by_transfer_function_has_its_colours() {
    // Fails if a face takes another volume's colours, or those of another value.
    let volumes = [rough(4)];
    let plane = Clip::all(Shape::Plane { normal: DVec3::new(0.0, -1.0, 0.0), offset_mm: 2.0 });
    let mut scene = Scene { clips: vec![plane], cut_face: CutFace::Transfer, ..scene_of(&volumes, Mode::Iso) };
    scene.layers[0].transfer = Some(TransferFunction {
        name: "red to blue".into(),
        values: Values::Scan,
        overall: 1.0,
        over_mm: Some(1.0),
        points: vec![
            Point { value: 0.0, color: Color([1.0, 0.0, 0.0]), opacity: 0.0 },
            Point { value: 150.0, color: Color([0.0, 0.0, 1.0]), opacity: 0.9 },
        ],
        gradient: vec![],
    });
    for renderer in [&mut CpuRenderer::default() as &mut dyn Renderer, &mut gpu()] {
        let picture = renderer.render(&volumes, &scene, 120, 100).unwrap();
        let mut compared = 0;
        for n in (0..picture.rgba.len()).filter(|n| picture.volume_id[*n] > 0) {
            let ray = scene.camera.ray((n % 120) as f64, (n / 120) as f64, 120, 100);
            let p = ray.origin.0 + ray.direction * ((-2.0 - ray.origin.0.y) / ray.direction.y);
            let Some((value, _)) = interpolant(&volumes[0], DAffine3::IDENTITY, p) else { continue };
            // By the definition: colour as light and extinction are linear in the value.
            let part = (value / 150.0).clamp(0.0, 1.0);
            let opacity = 1.0 - (1.0 - 0.9_f64).powf(part);
            let expected = Color::of_light(Vec3::new((1.0 - part) as f32, 0.0, part as f32) * opacity as f32).0.map(|c| (255.0 * c) as u8);
            let found = picture.rgba[n];
            let off = (0..3).map(|c| found[c].abs_diff(expected[c])).max().unwrap();
            assert!(off <= 3, "{value}: {found:?} instead of {expected:?}");
            compared += 1;
        }
        assert!(compared > 1000, "{compared}");
    }
}

#[test]
fn equal_samples_are_shaded_alike_on_both_backends() {
    // Fails if rounding makes a gradient where there is none: then a driver's noise shades the picture.
    let grid = Grid::new([12; 3], DVec3::ONE, DVec3::splat(-5.5), DMat3::IDENTITY).unwrap();
    let volumes = [volume("even", grid, Samples::I16(vec![100; 1728]))];
    let mut scene = scene_of(&volumes, Mode::Dvr);
    let transfer = TransferFunction { values: Values::Scan, overall: 1.0, over_mm: Some(10.0), ..TransferFunction::bone() };
    let point = |value: f64, opacity: f64| Point { value, color: Color([0.9, 0.6, 0.3]), opacity };
    scene.layers[0].transfer = Some(TransferFunction { points: vec![point(33.3, 0.0), point(77.7, 0.3)], ..transfer });
    let [a, b] = [&mut CpuRenderer::default() as &mut dyn Renderer, &mut gpu()].map(|r| r.render(&volumes, &scene, 80, 80).unwrap());
    let unlike = a.rgba.iter().zip(&b.rgba).filter(|(a, b)| color_difference(**a, **b) > 2).count();
    assert!(unlike == 0 && a.rgba.iter().any(|c| *c != a.rgba[0]), "{unlike} pixels differ");
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

#[test]
fn smooth_normals_are_central_differences() {
    // Fails if the gradient that shades smoothly is not what its name says. Central differences of the interpolant over a voxel to either side
    // of a point are the interpolated differences of the samples, so that these two are one method.
    let volumes = [rough(41)];
    let scene = scene_of(&volumes, Mode::Iso);
    let (_, surface) = scene.surfaces(&volumes).unwrap().remove(0);
    let mut compared = 0;
    for n in 0..60 * 60 {
        let ray = scene.camera.ray(f64::from(n % 60), f64::from(n / 60), 60, 60);
        let Some(hit) = bregma_field::crossings::first_entry(&surface, &ray) else { continue };
        let shading = bregma_field::interpolant::smooth_normal(&surface, hit.point).unwrap();
        let value = |o: DVec3| interpolant(&volumes[0], DAffine3::IDENTITY, volumes[0].grid().world(IndexPoint(hit.point.0 + o)).0);
        let differences = DVec3::AXES.map(|a| Some(value(a)?.0 - value(-a)?.0));
        if let [Some(x), Some(y), Some(z)] = differences {
            let central = surface.grid.world_to_index().matrix3.transpose() * -DVec3::new(x, y, z);
            assert!(central.normalize().abs_diff_eq(shading, 1e-6), "{central} is not {shading}");
            compared += 1;
        }
    }
    assert!(compared > 100, "{compared}");
}

#[test]
fn normals_against_the_phantoms_own() {
    // Fails if a shading gradient is turned, belongs to another point, or is not the same on both backends.
    let mut machines: Vec<Box<dyn Renderer>> = vec![Box::new(CpuRenderer::default()), Box::new(GpuRenderer::new(true).unwrap())];
    let points = bregma_session::chart::normals::measure(1, 256, &mut machines, &Progress::default()).unwrap();
    println!("{}", bregma_session::chart::normals::csv(&points));
    let (cpu, gpu) = points.split_at(points.len() / 2);
    for (a, b) in cpu.iter().zip(gpu) {
        assert!((a.half_deg - b.half_deg).abs() < 0.02 && a.name == b.name);
        assert!(a.pixels > 10_000 && a.half_deg < 7.0, "{a:?}");
    }
    assert!(cpu[1].half_deg < cpu[0].half_deg, "smooth normals are no better than the interpolant's own");
}

#[test]
fn samples_drawn_as_they_are_are_boxes() {
    // Fails if a sample's box is shifted by half a voxel, is larger or smaller than a voxel, or has no flat sides. One sample of a sheared grid's is
    // inside; the truth is the box in index space.
    let n = 9;
    let shear = DMat3::from_cols(DVec3::X, DVec3::new(0.2, 0.9, 0.0), DVec3::new(0.0, -0.3, 0.95));
    let grid = Grid::new([n, n, n], DVec3::new(1.0, 1.2, 0.8), DVec3::new(-4.0, -4.0, -3.0), shear).unwrap();
    let mut samples = vec![0_u8; n * n * n];
    samples[(4 * n + 3) * n + 5] = 200;
    let volumes = [volume("one sample", grid.clone(), Samples::U8(samples))];
    let mut scene = scene_of(&volumes, Mode::Iso);
    (scene.layers[0].iso, scene.reconstruction) = (100.0, bregma_renderer::Reconstruction::Nearest);
    let middle = grid.world(IndexPoint(DVec3::new(5.0, 3.0, 4.0))).0;
    let renderers: [Box<dyn Renderer>; 2] = [Box::new(CpuRenderer::default()), Box::new(gpu())];
    for mut renderer in renderers {
        let (mut hits, mut farthest) = (0, 0.0_f64);
        for direction in [DVec3::Y, DVec3::new(0.6, 0.7, -0.4), DVec3::new(-0.5, 0.3, 0.8)] {
            let eye_mm = middle - 30.0 * direction.normalize();
            scene.camera = Camera { eye_mm, target_mm: middle, up: DVec3::Z, projection: Projection::Orthographic { height_mm: 3.0 } };
            let picture = renderer.render(&volumes, &scene, 60, 60).unwrap();
            for (k, depth_mm) in picture.depth_mm.iter().enumerate() {
                let ray = scene.camera.ray((k % 60) as f64, (k / 60) as f64, 60, 60);
                let to_index = grid.world_to_index();
                let (p, d) =
                    (to_index.transform_point3(ray.origin.0) - DVec3::new(5.0, 3.0, 4.0), to_index.transform_vector3(ray.direction));
                let [a, b] = [-0.5, 0.5].map(|side| (DVec3::splat(side) - p) / d);
                let (near, far) = (a.min(b).max_element(), a.max(b).min_element());
                if (near - far).abs() < 1e-3 {
                    continue;
                }
                assert_eq!(depth_mm.is_finite(), near < far, "pixel {k} along {direction}");
                if near < far {
                    (hits, farthest) = (hits + 1, farthest.max((f64::from(*depth_mm) - near).abs()));
                }
            }
        }
        println!("{}: {hits} hits on a sample's box, at most {farthest:.1e} mm off", renderer.name());
        assert!(hits > 500 && farthest < 1e-4);
    }
}
