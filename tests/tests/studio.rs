//! Studio light against plain path tracing in float64 by the crossings that measurements are taken from, and the command that draws it: stopped, gone on
//! with, refused.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use bregma_field::{Solid, crossings, interpolant};
use bregma_renderer::studio::{Exposed, Follows, Ground, Lamp, Preset, Sky, Studio, Tone, Tracer, TracerCache};
use bregma_renderer::{Bounds, Camera, Clip, Color, CpuRenderer, GpuRenderer, Mode, Named, Ray, Renderer, Scene, Shape, Surface, Within};
use bregma_session::studio::{Exposing, Stop, on_ground};
use bregma_synthetic::{Random, Which, skull};
use bregma_volume::{Progress, ReadSamples, Samples, Volume, WorldPoint};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

const ALBEDO: f32 = 0.7;

/// A lamp that lights half of the bone sharply, and a sky.
fn studio() -> Studio {
    let lamp = Lamp {
        azimuth_deg: 40.0,
        elevation_deg: 35.0,
        follows: Follows::Skull,
        distance: 2.5,
        size_deg: 24.0,
        color: Color([1.0; 3]),
        strength: 0.5,
    };
    Studio {
        lamps: vec![lamp],
        sky: Sky { above: Color([1.0; 3]), below: Color([0.2; 3]), strength: 0.3 },
        ground: Ground::None,
        gloss: 0.0,
        exposure_ev: 0.0,
        tone: Tone::Linear,
        smooth_voxel: 0.0,
        bounces: 1000,
    }
}

fn lit_skull(size: usize) -> ([Arc<Volume>; 1], Scene) {
    let volumes = [Arc::new(skull(Which::A, size, &Progress::default()).unwrap())];
    let mut scene = Scene::of(&volumes);
    scene.layers[0].iso = 226.0;
    scene.layers[0].color = Color::of_light(glam::Vec3::splat(ALBEDO));
    scene.background = None;
    scene.camera = Camera::orbit_with_fov(&Bounds::of(volumes.iter().map(|v| v.grid())), -35.0, 10.0, 18.0);
    scene.clips = vec![Clip::all(Shape::Plane { normal: DVec3::new(-0.6, 0.0, 0.8), offset_mm: 55.0 })];
    scene.studio = Some(studio());
    (volumes, scene)
}

/// The reference: nothing of it is the renderer's but the camera.
struct Plainly<'a> {
    scene: &'a Scene,
    surface: Surface,
    lamp_mm: DVec3,
    toward_bone: DVec3,
    lamp_radius_mm: f64,
    radiance: f64,
    size: [u32; 2],
}

impl<'a> Plainly<'a> {
    fn of(volume: &Arc<Volume>, scene: &'a Scene, size: [u32; 2]) -> Self {
        let (_, surface) = scene.surfaces(std::slice::from_ref(volume)).unwrap().remove(0);
        let studio = scene.studio.as_ref().unwrap();
        // The bone's bounds: the box of all cells with a corner inside.
        let Samples::I16(samples) = volume.samples() else { panic!("the phantom has samples of 16 bits") };
        let dims = volume.grid().dims();
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for (n, _) in samples.iter().enumerate().filter(|(_, v)| f64::from(**v) >= surface.level) {
            let at = DVec3::new((n % dims[0]) as f64, (n / dims[0] % dims[1]) as f64, (n / (dims[0] * dims[1])) as f64);
            let last = DVec3::from_array(dims.map(|n| (n - 1) as f64));
            (low, high) = (low.min((at - 1.0).max(DVec3::ZERO)), high.max((at + 1.0).min(last)));
        }
        let [low, high] = [low, high].map(|p| surface.grid.world(bregma_field::IndexPoint(p)).0);
        let (middle, radius) = ((low + high) / 2.0, (high - low).length() / 2.0);
        let lamp = &studio.lamps[0];
        let (azimuth, elevation) = (lamp.azimuth_deg.to_radians(), lamp.elevation_deg.to_radians());
        let toward = DVec3::new(elevation.cos() * azimuth.sin(), -elevation.cos() * azimuth.cos(), elevation.sin());
        let distance = lamp.distance * radius;
        let lamp_radius_mm = distance * (lamp.size_deg / 2.0).to_radians().tan();
        let radiance = f64::from(lamp.strength) * (lamp_radius_mm.powi(2) + distance.powi(2)) / lamp_radius_mm.powi(2);
        Self { scene, surface, lamp_mm: middle + distance * toward, toward_bone: -toward, lamp_radius_mm, radiance, size }
    }

    fn sky(&self, direction: DVec3) -> f64 {
        let sky = &self.scene.studio.as_ref().unwrap().sky;
        let [above, below] = [sky.above, sky.below].map(|color| f64::from(color.linear().x * sky.strength));
        (above + below) / 2.0 + direction.z * (above - below) / 2.0
    }

    /// One sample of a pixel: light, and whether there is bone.
    fn sample(&self, [x, y]: [u32; 2], r: &mut Random) -> (f64, bool) {
        let tent = |r: &mut Random| r.unit() + r.unit() - 1.0;
        let (dx, dy) = (tent(r), tent(r));
        let mut ray = self.scene.camera.ray(f64::from(x) + dx, f64::from(y) + dy, self.size[0], self.size[1]);
        let (mut light, mut throughput) = (0.0, 1.0);
        for depth in 0.. {
            let Some(hit) = crossings::first_entry(&self.surface, &ray) else {
                return if depth == 0 { (0.0, false) } else { (light + throughput * self.sky(ray.direction), true) };
            };
            let at = crossings::world(&self.surface, &hit).0;
            let normal = hit.normal;
            let smooth = if hit.clipped { None } else { interpolant::smooth_normal(&self.surface, hit.point) };
            let shading = smooth.map_or(normal, |n| if n.dot(ray.direction) > 0.0 { -n } else { n });
            // A thousandth of a voxel, as far as the picture's rays start; the reference itself is good to 1e-9.
            let start = at + 1e-3 * self.surface.grid.spacing_mm().min_element() * normal;
            throughput *= f64::from(ALBEDO);
            light += throughput * self.lamp(start, normal, shading, r);
            // About the shading normal, by the cosine.
            let (turn, z) = (TAU * r.unit(), r.unit().sqrt());
            let (u, v) = shading.any_orthonormal_pair();
            let direction = (1.0 - z * z).sqrt() * (turn.cos() * u + turn.sin() * v) + z * shading;
            if direction.dot(normal) <= 0.0 {
                return (light, true);
            }
            // Every path ends at some time.
            if depth >= 4 {
                if r.unit() >= 0.6 {
                    return (light, true);
                }
                throughput /= 0.6;
            }
            ray = Ray::new(WorldPoint(start), direction).unwrap();
        }
        unreachable!()
    }

    /// What comes from an even point of the lamp, over π.
    fn lamp(&self, start: DVec3, normal: DVec3, shading: DVec3, r: &mut Random) -> f64 {
        let (turn, away) = (TAU * r.unit(), self.lamp_radius_mm * r.unit().sqrt());
        let (u, v) = self.toward_bone.any_orthonormal_pair();
        let way = self.lamp_mm + away * (turn.cos() * u + turn.sin() * v) - start;
        let (far, toward) = (way.length(), way.normalize());
        let (cosine, of_lamp) = (toward.dot(shading), -toward.dot(self.toward_bone));
        if toward.dot(normal) <= 0.0 || cosine <= 0.0 || of_lamp <= 0.0 {
            return 0.0;
        }
        let ray = Ray::new(WorldPoint(start), toward).unwrap();
        if crossings::first_entry(&self.surface, &ray).is_some_and(|hit| hit.t_mm < far) {
            return 0.0;
        }
        self.radiance * cosine * of_lamp * self.lamp_radius_mm.powi(2) / (far * far)
    }
}

/// Each block's mean and the variance of that.
type Blocks = Vec<[f64; 2]>;

fn plainly(volume: &Arc<Volume>, scene: &Scene, size: [u32; 2], samples: u32) -> Blocks {
    let plainly = Plainly::of(volume, scene, size);
    let across = size[0] / 8;
    let block = |n: u32| {
        let (mut sum, mut variance) = (0.0, 0.0);
        for pixel in 0..64 {
            let at = [n % across * 8 + pixel % 8, n / across * 8 + pixel / 8];
            let mut r = Random(u64::from(at[1] * size[0] + at[0]) * 7919 + 13);
            // The first numbers of neighbouring seeds are alike.
            r.unit();
            let values: Vec<f64> = (0..samples).map(|_| plainly.sample(at, &mut r).0).collect();
            let mean = values.iter().sum::<f64>() / f64::from(samples);
            sum += mean;
            variance += values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / f64::from(samples * (samples - 1));
        }
        [sum / 64.0, variance / 4096.0]
    };
    (0..across * (size[1] / 8)).into_par_iter().map(block).collect()
}

fn traced(
    renderer: &mut dyn Renderer,
    volumes: &[Arc<Volume>],
    scene: &Scene,
    size: [u32; 2],
    samples: u32,
    seeds: std::ops::Range<u32>,
) -> Blocks {
    let across = (size[0] / 8) as usize;
    let count = f64::from(seeds.end - seeds.start);
    let pictures: Vec<Vec<f64>> = seeds
        .map(|seed| {
            let tracer = renderer.tracer(volumes, scene, size, seed).unwrap();
            let mut exposed = Exposed::new(size);
            tracer.expose(&mut exposed, samples, None, &Progress::default()).unwrap();
            let light = tracer.light(&exposed, false);
            let mut sums = vec![0.0; across * (size[1] / 8) as usize];
            for (n, color) in light.iter().enumerate() {
                assert!(color.max_element() <= 1.0);
                let (x, y) = (n % size[0] as usize, n / size[0] as usize);
                sums[y / 8 * across + x / 8] += f64::from(color.x) / 64.0;
            }
            sums
        })
        .collect();
    (0..pictures[0].len())
        .map(|n| {
            let mean = pictures.iter().map(|p| p[n]).sum::<f64>() / count;
            let variance = pictures.iter().map(|p| (p[n] - mean).powi(2)).sum::<f64>() / (count - 1.0);
            [mean, variance / count]
        })
        .collect()
}

/// Compares the light of blocks with the reference's: the mean of all in its standard errors, and the root mean square of all blocks in theirs.
fn compared(size: [u32; 2], plain_samples: u32, samples: u32, seeds: u32) -> [f64; 2] {
    let (volumes, scene) = lit_skull(40);
    let reference = plainly(&volumes[0], &scene, size, plain_samples);
    let found = traced(&mut CpuRenderer::default(), &volumes, &scene, size, samples, 0..seeds);
    z_scores(&reference, &found)
}

/// The mean of all blocks in its standard errors, and the root mean square of all blocks in theirs.
fn z_scores(reference: &Blocks, found: &Blocks) -> [f64; 2] {
    let (mut off, mut variance, mut squares, mut count) = (0.0, 0.0, 0.0, 0.0);
    let mut means = [0.0; 2];
    for ([a, of_a], [b, of_b]) in reference.iter().zip(found).filter(|([a, _], _)| *a > 0.01) {
        (off, variance, count) = (off + b - a, variance + of_a + of_b, count + 1.0);
        squares += (b - a).powi(2) / (of_a + of_b);
        means = [means[0] + a, means[1] + b];
    }
    let (z, rms) = (off / variance.sqrt(), (squares / count).sqrt());
    println!("{count} blocks: means {:.5} and {:.5}, z {z:.2}, rms of z {rms:.3}", means[0] / count, means[1] / count);
    [z, rms]
}

#[test]
fn blocks_are_as_bright_as_plain_path_tracing_in_float64_says() {
    // Fails if light is lost or won anywhere between lamp, sky, bone, cut and eye: a wrong density or cosine is many standard errors.
    let [z, rms] = compared([48, 48], 24, 32, 8);
    assert!(z.abs() < 3.5 && (0.6..1.5).contains(&rms), "{z} {rms}");
}

#[test]
#[ignore = "a minute: cargo test --release -p bregma-tests --test studio -- --ignored"]
fn blocks_are_as_bright_in_the_long_run() {
    // The same ten times as sharply: z-scores are those of a normal distribution.
    let [z, rms] = compared([96, 96], 600, 256, 16);
    assert!(z.abs() < 3.5 && (0.85..1.2).contains(&rms), "{z} {rms}");
}

#[test]
fn blocks_at_rest_get_no_more_samples() {
    // Fails if blocks that are good enough are drawn on, or others are not; or the noise that is told is not below what was asked for.
    let (volumes, scene) = lit_skull(40);
    let size = [64, 64];
    let tracer = Tracer::new(&volumes, &scene, size, 1).unwrap();
    let mut exposed = Exposed::new(size);
    let noise = 2.0;
    for until in [16, 32, 64, 128, 256, 512] {
        tracer.expose(&mut exposed, until, Some(noise), &Progress::default()).unwrap();
    }
    assert!(exposed.noise_of_blocks().iter().all(|told| *told <= noise), "{:?}", exposed.noise_of_blocks());
    let share = exposed.count() as f64 / (64.0 * 64.0 * f64::from(exposed.samples()));
    println!("{} samples, {share:.2} of them drawn, noise {:.2}", exposed.samples(), exposed.noise());
    assert!(exposed.noise() < f64::from(noise) && share < 0.8);
}

#[test]
fn what_is_denoised_is_nearer_to_the_truth() {
    // Fails if the filter blurs over edges, or darkens: then it would be farther off than the noise that it takes away.
    let (volumes, mut scene) = lit_skull(64);
    scene.studio = Some(Preset::Journal.studio());
    let size = [96, 96];
    let tracer = Tracer::new(&volumes, &scene, size, 1).unwrap();
    let light = |samples, denoise| {
        let mut exposed = Exposed::new(size);
        tracer.expose(&mut exposed, samples, None, &Progress::default()).unwrap();
        tracer.light(&exposed, denoise)
    };
    let truth = light(256, false);
    let off = |light: &[glam::Vec4]| {
        // Edges are left as they are.
        let within = light.iter().zip(&truth).filter(|(_, truth)| truth.w == 1.0);
        let squares: Vec<f64> = within.map(|(a, b)| f64::from((*a - *b).truncate().length_squared())).collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    };
    let (raw, denoised) = (off(&light(8, false)), off(&light(8, true)));
    println!("rms off the truth: {raw:.4} raw, {denoised:.4} denoised");
    assert!(denoised < 0.85 * raw, "{denoised} of {raw}");
}

#[test]
#[ignore = "timed, for a machine that does nothing else: cargo test --release -p bregma-tests --test studio -- --ignored the_view --nocapture"]
fn the_view_soon_has_a_good_picture() {
    // Fails if what the view shows first takes much longer than one sample and its filter. Prints how long each round takes to be there, and how far it is off
    // the truth as the view shows it, raw and filtered.
    let volumes = [Arc::new(skull(Which::A, 256, &Progress::default()).unwrap())];
    let mut scene = Scene::of(&volumes);
    scene.camera = Camera::orbit_with_fov(&Bounds::of(volumes.iter().map(|v| v.grid())), -35.0, 10.0, 25.0);
    let size = [512, 512];
    let shown = |light: Vec<glam::Vec4>, scene: &Scene| -> Vec<[f32; 3]> {
        on_ground(light, scene.background).iter().map(|light| Color::of_light(light.truncate()).0.map(|c| 255.0 * c)).collect()
    };
    for preset in [Preset::Journal, Preset::Museum] {
        scene.studio = Some(preset.studio());
        let stop = Stop { samples: Some(64), ..Stop::default() };
        let exposing = |cache: &mut TracerCache, seed, stop| {
            Exposing::of(Tracer::reusing(cache, &volumes, &scene, size, seed).unwrap(), Exposed::new(size), stop)
        };
        let mut cache = TracerCache::default();
        let begun = Instant::now();
        let mut best = exposing(&mut cache, 77, Stop { samples: Some(512), ..stop });
        println!("{preset:?}: made ready in {:.3} s, once for a scan and an isovalue", begun.elapsed().as_secs_f64());
        while best.go_on(&Progress::default()).unwrap().is_some() {}
        let truth = shown(best.light(false), &scene);
        let off = |light| {
            let squares =
                shown(light, &scene).iter().flatten().zip(truth.iter().flatten()).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>();
            (squares / (3.0 * truth.len() as f64)).sqrt()
        };
        // The scan is known: a view was turned.
        let begun = Instant::now();
        let mut view = exposing(&mut cache, 0, stop);
        let (mut spent, mut since) = (0.0, begun);
        println!("| samples | s | told | raw, off by | s of the filter | filtered, off by |\n|---|---|---|---|---|---|");
        let mut first = None;
        while let Some(told) = view.go_on(&Progress::default()).unwrap() {
            let raw = view.light(false);
            spent += since.elapsed().as_secs_f64();
            let begun = Instant::now();
            let filtered = view.light(true);
            let filter_s = begun.elapsed().as_secs_f64();
            first = first.or(Some(spent + filter_s));
            println!("| {} | {spent:.3} | {:.2} | {:.2} | {filter_s:.3} | {:.2} |", told.samples, told.noise, off(raw), off(filtered));
            since = Instant::now();
        }
        // One sample of 262,144 pixels is 0.1 s on two free cores, the filter less.
        assert!(first.unwrap() < 1.0, "{first:?} s");
    }
}

/// The light of a picture on what draws, and the seconds that it took.
fn light_by(renderer: &mut dyn Renderer, volumes: &[Arc<Volume>], scene: &Scene, size: [u32; 2], samples: u32) -> (Vec<glam::Vec4>, f64) {
    let tracer = renderer.tracer(volumes, scene, size, 5).unwrap();
    assert_eq!(tracer.backend(), renderer.backend());
    let mut exposed = Exposed::new(size);
    let begun = Instant::now();
    tracer.expose(&mut exposed, samples, None, &Progress::default()).unwrap();
    (tracer.light(&exposed, false), begun.elapsed().as_secs_f64())
}

fn gpu() -> GpuRenderer {
    GpuRenderer::new(true).expect("a software Vulkan driver is installed by tests/run")
}

/// Demo skulls of so many samples, seen as in `lit_skull`.
fn demo(size: usize, count: usize) -> (Vec<Arc<Volume>>, Scene) {
    let volumes: Vec<_> =
        [Which::A, Which::B].into_iter().take(count).map(|which| Arc::new(skull(which, size, &Progress::default()).unwrap())).collect();
    let mut scene = Scene::of(&volumes);
    scene.layers.iter_mut().for_each(|layer| layer.iso = 226.0);
    scene.camera = Camera::orbit_with_fov(&Bounds::of(volumes.iter().map(|v| v.grid())), -35.0, 10.0, 25.0);
    (volumes, scene)
}

/// What is drawn beside the presets: what paths could do otherwise than the walk does.
fn cases() -> Vec<(&'static str, Vec<Arc<Volume>>, Scene)> {
    let (volumes, plain) = demo(128, 1);
    let lit = |studio: Studio| Scene { studio: Some(studio), ..plain.clone() };
    let mut cases: Vec<_> = Preset::ALL.iter().map(|preset| (preset.name(), volumes.clone(), lit(preset.studio()))).collect();
    let glossy = Studio { gloss: 0.7, ground: Ground::Catcher, ..Preset::Journal.studio() };
    cases.push(("gloss on a catcher", volumes.clone(), lit(glossy)));
    let mut cut = lit(Preset::Journal.studio());
    let middle = Bounds::of(volumes.iter().map(|v| v.grid())).centre_mm;
    cut.clips = vec![
        Clip::all(Shape::Plane { normal: DVec3::new(-0.6, 0.0, 0.8), offset_mm: DVec3::new(-0.6, 0.0, 0.8).dot(middle) + 30.0 }),
        Clip::all(Shape::Box { low_mm: middle - 75.0, high_mm: middle + 75.0 }),
    ];
    let grid = volumes[0].grid();
    let mut within = cut.clone();
    let solid = Solid::of(grid, |p| 60.0 - (grid.world(p).0 - middle).length());
    let part = Within { part: "ball".into(), keeps: true, grow_mm: 0.0, rim_mm: 1.0, measures: true, solid: Some(Arc::new(solid)) };
    within.layers[0].within = Some(part);
    cases.extend([("cuts", volumes.clone(), cut), ("a solid", volumes, within)]);
    let (both, mut overlay) = demo(96, 2);
    (overlay.mode, overlay.studio) = (Mode::Overlay, Some(Preset::Museum.studio()));
    cases.push(("an overlay", both, overlay));
    cases
}

#[test]
fn one_sample_on_the_gpu_is_the_processors() {
    // Fails if a density, a cosine, a start off a surface, a cut or the order of random numbers is another's: paths part there.
    let (mut cpu, mut gpu) = (CpuRenderer::default(), gpu());
    let size = [128, 128];
    for (name, volumes, scene) in cases() {
        let [(a, _), (b, _)] = [&mut cpu as &mut dyn Renderer, &mut gpu].map(|renderer| light_by(renderer, &volumes, &scene, size, 1));
        let near = a.iter().zip(&b).filter(|(a, b)| (**a - **b).abs().max_element() <= 1e-3).count();
        let [mean, other] = [&a, &b].map(|all| all.iter().map(|v| f64::from(v.y)).sum::<f64>() / all.len() as f64);
        let share = near as f64 / a.len() as f64;
        println!("{name}: {:.2} % of pixels within 1e-3, means {mean:.5} and {other:.5}", 100.0 * share);
        assert!(mean > 0.01 && share >= 0.995, "{name}: {share}");
    }
}

#[test]
fn the_gpus_blocks_are_as_bright_as_the_processors() {
    // Fails if light is lost or won where paths part by rounding: 256 samples of either, of other seeds, differ by chance alone.
    let (volumes, scene) = lit_skull(40);
    let size = [64, 64];
    let by_cpu = traced(&mut CpuRenderer::default(), &volumes, &scene, size, 16, 0..16);
    let by_gpu = traced(&mut gpu(), &volumes, &scene, size, 16, 16..32);
    let [z, rms] = z_scores(&by_cpu, &by_gpu);
    assert!(z.abs() < 3.5 && (0.75..1.3).contains(&rms), "{z} {rms}");
}

#[test]
fn what_the_gpu_was_stopped_at_it_goes_on_with_to_the_same_bits() {
    // Fails if a round's samples depend on those before it, blocks at rest are drawn on, or a stopped round leaves half of itself.
    let (volumes, mut scene) = lit_skull(40);
    scene.studio = Some(Preset::Museum.studio());
    let (size, mut gpu) = ([45, 37], gpu());
    let tracer = gpu.tracer(&volumes, &scene, size, 9).unwrap();
    let draw = |rounds: &[u32]| {
        let mut exposed = Exposed::new(size);
        rounds.iter().for_each(|until| tracer.expose(&mut exposed, *until, None, &Progress::default()).unwrap());
        exposed
    };
    let whole = draw(&[12]);
    assert!(draw(&[1, 5, 12]) == whole, "what was drawn in parts is another picture");
    let stopped = Progress::default();
    stopped.cancel();
    let mut exposed = draw(&[5]);
    assert!(tracer.expose(&mut exposed, 12, None, &stopped).is_err() && exposed == draw(&[5]));
    tracer.expose(&mut exposed, 12, None, &Progress::default()).unwrap();
    assert!(exposed == whole, "what was stopped is another picture");
    tracer.expose(&mut exposed, 64, Some(f32::INFINITY), &Progress::default()).unwrap();
    assert!(exposed.samples() == 64, "blocks rest before they tell their noise");
    tracer.expose(&mut exposed, 96, Some(f32::INFINITY), &Progress::default()).unwrap();
    assert!(exposed.samples() == 64, "blocks at rest are drawn on");
}

#[test]
#[ignore = "timed, for a machine that does nothing else: cargo test --release -p bregma-tests --test studio -- --ignored gpu_is_timed --nocapture"]
fn the_gpu_is_timed_beside_the_processor() {
    // Fails if the GPU has no picture. Prints wall time a sample of both, the least of three; a pass is compiled before.
    let (volumes, mut scene) = demo(256, 1);
    let (size, samples) = ([512, 512], 8);
    let (mut cpu, mut gpu) = (CpuRenderer::default(), gpu());
    println!("{} against {}", gpu.name(), cpu.name());
    for preset in Preset::ALL {
        scene.studio = Some(preset.studio());
        let [a, b] = [&mut cpu as &mut dyn Renderer, &mut gpu].map(|renderer| {
            light_by(renderer, &volumes, &scene, size, 1);
            let least = (0..3).map(|_| light_by(renderer, &volumes, &scene, size, samples).1).fold(f64::INFINITY, f64::min);
            1e6 * least / f64::from(size[0] * size[1] * samples)
        });
        println!("{}: CPU {a:.2} µs, GPU {b:.2} µs a sample, {:.2} times", preset.name(), b / a);
        assert!(b.is_finite());
    }
}

fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("bregma-studio-{}-{name}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn bregma(folder: &Path, line: &str) -> Child {
    // Tests lie in target/PROFILE/deps, the program two levels up.
    let program = std::env::current_exe().unwrap().parent().unwrap().parent().unwrap().join("bregma");
    assert!(program.exists(), "{} is not built: run tests/run, or cargo build --release", program.display());
    let words = line.split(' ').filter(|word| !word.is_empty());
    Command::new(program)
        .args(words)
        .current_dir(folder)
        .env("XDG_RUNTIME_DIR", folder)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn told(child: Child) -> (bool, String) {
    let out = child.wait_with_output().unwrap();
    (out.status.success(), String::from_utf8(out.stderr).unwrap())
}

#[test]
fn killed_at_any_moment_the_same_command_goes_on_to_the_same_bytes() {
    // Fails if a kept state is torn, of another picture, leaves something out, or is not used.
    let folder = folder("killed");
    assert!(told(bregma(&folder, "demo --out . --size 48")).0);
    let line = |out: &str, seed: u32| {
        format!("render a.nrrd --iso 226 --orbit=-35,10 --size 64x64 --studio journal --samples 512 --keep 0.02 --seed {seed} --out {out}")
    };
    let (is_whole, text) = told(bregma(&folder, &line("whole.png", 3)));
    assert!(is_whole && !text.contains("went on"), "{text}");
    assert!(!folder.join("whole.png.part").exists());
    let mut r = Random(5);
    let (mut kills, mut resumed) = (0, 0);
    for _ in 0..6 {
        let mut child = bregma(&folder, &line("killed.png", 3));
        // Once something is kept; however slow the machine is.
        while !folder.join("killed.png.part").exists() && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(2));
        }
        std::thread::sleep(Duration::from_millis((150.0 * r.unit()) as u64));
        // On Unix that is signal 9.
        kills += u32::from(child.kill().is_ok() && child.try_wait().unwrap().is_none_or(|status| !status.success()));
        let (is_done, text) = told(child);
        if is_done {
            assert_eq!(std::fs::read(folder.join("killed.png")).unwrap(), std::fs::read(folder.join("whole.png")).unwrap());
        }
        resumed += u32::from(text.contains("went on"));
    }
    // Of another seed it is another picture's, and nothing is gone on with.
    if folder.join("killed.png.part").exists() {
        std::fs::copy(folder.join("killed.png.part"), folder.join("other.png.part")).unwrap();
        let (is_done, text) = told(bregma(&folder, &line("other.png", 4)));
        assert!(is_done && !text.contains("went on"), "{text}");
        assert_ne!(std::fs::read(folder.join("other.png")).unwrap(), std::fs::read(folder.join("whole.png")).unwrap());
    }
    let (is_done, text) = told(bregma(&folder, &line("killed.png", 3)));
    resumed += u32::from(text.contains("went on"));
    println!("{kills} kills, {resumed} times gone on: {text}");
    assert!(is_done && kills > 0 && resumed > 0, "{kills} kills, {resumed} times gone on: {text}");
    assert_eq!(std::fs::read(folder.join("killed.png")).unwrap(), std::fs::read(folder.join("whole.png")).unwrap());
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn what_has_no_studio_light_says_so() {
    // Fails if a mode without surfaces is lit in silence, a name that is none is taken, or a broken file panics.
    let folder = folder("refused");
    assert!(told(bregma(&folder, "demo --out . --size 24")).0);
    std::fs::write(folder.join("broken.json"), "{\"lamps\": 3}").unwrap();
    let bright = serde_json::to_string(&Studio { gloss: 2.0, ..studio() }).unwrap();
    std::fs::write(folder.join("glossy.json"), bright).unwrap();
    let good = serde_json::to_string(&studio()).unwrap();
    std::fs::write(folder.join("good.json"), &good).unwrap();
    assert_eq!(serde_json::from_str::<Studio>(&good).unwrap(), studio());
    for (options, part) in [
        ("--studio museum --mode dvr", "opaque surfaces"),
        ("--studio museum --mode slice", "opaque surfaces"),
        ("--studio museum --reconstruction spline", "opaque surfaces"),
        ("--studio moonlight", "journal, museum, relief, sky"),
        ("--studio broken.json", "broken.json"),
        ("--studio glossy.json", "gloss"),
    ] {
        let (is_done, text) = told(bregma(&folder, &format!("render a.nrrd {options} --size 16x16 --samples 4 --out no.png")));
        let errors: Vec<&str> = text.lines().filter(|line| line.starts_with("error: ")).collect();
        assert!(!is_done && errors.len() == 1 && errors[0].contains(part) && !text.contains("panicked"), "{options}: {text}");
    }
    let lit = "render a.nrrd b.nrrd --mode overlay --studio good.json --lamp -30,40,0.3 --size 16x16 --samples 4 --denoise --out yes.png";
    let (is_done, text) = told(bregma(&folder, lit));
    assert!(is_done && text.contains("studio light on the measured surface: 4 samples, noise"), "{text}");
    // By the GPU it is the same light, and the file names what drew it.
    for (backend, out) in [("cpu", "by-cpu.png"), ("gpu", "by-gpu.png")] {
        let line = format!("render a.nrrd --backend {backend} --studio journal --size 24x24 --samples 4 --out {out}");
        let (is_done, text) = told(bregma(&folder, &line));
        assert!(is_done && text.contains("4 samples"), "{text}");
    }
    let pixels = |out: &str| -> Vec<u8> {
        let mut reader = png::Decoder::new(BufReader::new(std::fs::File::open(folder.join(out)).unwrap())).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut bytes).unwrap();
        bytes
    };
    let off: f64 = pixels("by-cpu.png").iter().zip(pixels("by-gpu.png")).map(|(a, b)| f64::from(a.abs_diff(b))).sum();
    assert!(off / (24.0 * 24.0 * 4.0) < 0.5, "pictures differ by {off} in all");
    assert!(bregma_session::print::record::of(&folder.join("by-gpu.png")).unwrap().contains(&gpu().name()));
    // The file says that it was denoised.
    let record = bregma_session::print::record::of(&folder.join("yes.png")).unwrap();
    assert!(record.contains("\"denoise\":true") && record.contains("\"lamps\":[{"), "the file does not say how it was made: {record}");
    std::fs::remove_dir_all(folder).unwrap();
}
