//! Light whose amount is known.

use super::path::{PIXELS, Ways};
use super::settings::{Follows, Ground, Lamp, Preset, Sky, Studio, Tone};
use super::{Exposed, Tracer};
use crate::color::Color;
use crate::scene::{Normals, Scene};
use crate::{Camera, CpuRenderer, Projection};
use bregma_field::{Bounds, Grid, Progress, Volume};
use bregma_synthetic::analytic::{Plane, Shell, Sphere};
use bregma_synthetic::{Which, skull};
use glam::{DMat3, DVec3};
use std::sync::Arc;

const WHITE: Color = Color([1.0; 3]);

fn plain(lamps: Vec<Lamp>, sky: Sky) -> Studio {
    Studio { lamps, sky, ground: Ground::None, gloss: 0.0, exposure_ev: 0.0, tone: Tone::Linear, smooth_voxel: 0.0, bounces: 1000 }
}

fn lamp(azimuth_deg: f64, elevation_deg: f64, distance: f64, size_deg: f64, strength: f32) -> Lamp {
    Lamp { azimuth_deg, elevation_deg, follows: Follows::Skull, distance, size_deg, color: WHITE, strength }
}

fn grid(count: usize, size_mm: f64) -> Grid {
    let spacing = size_mm / (count - 1) as f64;
    Grid::new([count; 3], DVec3::splat(spacing), DVec3::splat(-size_mm / 2.0), DMat3::IDENTITY).unwrap()
}

fn scene(volumes: &[Arc<Volume>], iso: f64, studio: Studio) -> Scene {
    let mut scene = Scene::of(volumes);
    scene.layers.iter_mut().for_each(|layer| (layer.iso, layer.color) = (iso, WHITE));
    scene.normals = Normals::Analytic;
    scene.background = None;
    scene.studio = Some(studio);
    scene
}

fn small_skull(studio: Studio) -> ([Arc<Volume>; 1], Scene) {
    let volumes = [Arc::new(skull(Which::A, 40, &Progress::default()).unwrap())];
    let mut scene = scene(&volumes, 226.0, studio);
    scene.camera = Camera::orbit(&Bounds::of(volumes.iter().map(|v| v.grid())), -35.0, 10.0);
    (volumes, scene)
}

/// The mean light of each pixel: red, green, blue and coverage.
fn exposed(tracer: &Tracer, size: [u32; 2], samples: u32) -> (Exposed, Vec<[f64; 4]>) {
    let mut exposed = Exposed::new(size);
    tracer.expose(&mut exposed, samples, None, &Progress::default()).unwrap();
    let pixel = |n: u32| {
        let (block, at) = exposed.at(n % size[0], n / size[0]);
        let sum = block.sum(at);
        std::array::from_fn(|c| f64::from(sum[c]) / f64::from(samples))
    };
    let means = (0..size[0] * size[1]).map(pixel).collect();
    (exposed, means)
}

/// The mean of all pixels' green in each of some pictures that differ by their seeds, as mean and standard error of the mean.
fn mean_of(make: impl Fn(u32) -> Tracer, size: [u32; 2], samples: u32, seeds: u32) -> [f64; 2] {
    let means: Vec<f64> = (0..seeds)
        .map(|seed| {
            let (_, pixels) = exposed(&make(seed), size, samples);
            pixels.iter().map(|p| p[1]).sum::<f64>() / pixels.len() as f64
        })
        .collect();
    let count = f64::from(seeds);
    let mean = means.iter().sum::<f64>() / count;
    let variance = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (count - 1.0);
    [mean, (variance / count).sqrt()]
}

/// Seen straight down, so many mm high.
fn from_above(height_mm: f64) -> Camera {
    Camera {
        eye_mm: DVec3::new(0.0, 0.0, 500.0),
        target_mm: DVec3::ZERO,
        up: DVec3::NEG_Y,
        projection: Projection::Orthographic { height_mm },
    }
}

#[test]
fn in_an_even_sky_white_bone_is_as_bright_as_the_sky() {
    // The white furnace. Fails if a path loses or gains light: a cosine or a density that is another's, a start inside the bone, a surface that is
    // passed, roulette that is not made up for.
    let (volumes, mut scene) = small_skull(plain(vec![], Sky::even(WHITE, 1.0)));
    let size = [64, 64];
    let covered = |scene: &Scene, samples| -> Vec<f64> {
        let (_, pixels) = exposed(&Tracer::new(&volumes, scene, size, 3).unwrap(), size, samples);
        pixels.iter().filter(|p| p[3] > 0.0).map(|p| p[1] / p[3]).collect()
    };
    let found = covered(&scene, 16);
    let lost = found.iter().filter(|v| (**v - 1.0).abs() > 1e-5).count();
    let mean = found.iter().sum::<f64>() / found.len() as f64;
    println!("{} pixels, {lost} of which are not 1 to 1e-5, mean {mean:.6}", found.len());
    assert!(found.len() > 1000 && lost * 1000 <= found.len() && found.iter().all(|v| *v < 1.00001), "{lost} of {}", found.len());
    // Smooth normals lose what they send into the bone, the more the coarser it is sampled, and win nothing.
    scene.normals = Normals::Smooth;
    let smooth = covered(&scene, 16);
    let mean = smooth.iter().sum::<f64>() / smooth.len() as f64;
    println!("smooth normals: {mean:.4}");
    assert!((0.8..1.0).contains(&mean) && smooth.iter().all(|v| *v < 1.00001), "{mean}");
    // Varnish takes no light away: what the coat reflects and what comes through add up to 1. By chance no pixel is exactly so.
    scene.normals = Normals::Analytic;
    scene.studio.as_mut().unwrap().gloss = 1.0;
    let glossy = covered(&scene, 64);
    let mean = glossy.iter().sum::<f64>() / glossy.len() as f64;
    println!("varnished: {mean:.4}");
    // What the coat's single bounce between its facets loses is put below it; half vectors that send light into the surface lose less than 1 %.
    assert!((0.985..1.005).contains(&mean), "{mean}");
}

#[test]
fn a_disc_lights_a_plane_by_the_closed_form() {
    // Fails if a lamp's radiance, density, place or cosine is wrong: E = π L/2 · (1 − (a² + h² − r²) / √((a² + h² + r²)² − 4 a² r²)) at a distance a
    // beside the axis of a parallel disc (Howell, factor B-12). The plane is half of the box: all of it is seen from the lamp.
    let plane = Plane { point: DVec3::ZERO, normal: DVec3::Z };
    let volumes = [Arc::new(plane.volume(&grid(9, 40.0)))];
    let studio = plain(vec![lamp(0.0, 90.0, 2.0, 40.0, 1.0)], Sky::even(WHITE, 0.0));
    let mut scene = scene(&volumes, 0.0, studio);
    scene.camera = from_above(36.0);
    let size = [16, 16];
    let probe = Tracer::new(&volumes, &scene, size, 0).unwrap();
    let (middle, radius) = (probe.stage.bone.middle_mm, probe.stage.bone.radius_mm);
    assert!((middle.x.abs() + middle.y.abs()) < 1e-9);
    let (h, r) = (middle.z + 2.0 * radius, 2.0 * radius * 20.0_f64.to_radians().tan());
    let d = 2.0 * radius;
    let radiance = (r * r + d * d) / (r * r);
    for ways in [Ways::Both, Ways::Lamps, Ways::Surfaces] {
        const SEEDS: u32 = 6;
        let pictures: Vec<Vec<[f64; 4]>> = (0..SEEDS)
            .map(|seed| {
                let mut tracer = Tracer::new(&volumes, &scene, size, seed).unwrap();
                tracer.stage.ways = ways;
                exposed(&tracer, size, 256).1
            })
            .collect();
        let (mut off, mut squares) = (0.0, 0.0);
        for n in 0..256 {
            let mean = pictures.iter().map(|p| p[n][1]).sum::<f64>() / f64::from(SEEDS);
            let mm = |v: usize| (v as f64 - 7.5) * 36.0 / 16.0;
            let at = |dx: f64, dy: f64| {
                let a2 = (mm(n % 16) + dx).powi(2) + (mm(n / 16) + dy).powi(2);
                let sum = a2 + h * h;
                radiance / 2.0 * (1.0 - (sum - r * r) / ((sum + r * r).powi(2) - 4.0 * a2 * r * r).sqrt())
            };
            // A pixel's tent, whose variance is a sixth along each axis, by four points with the same.
            let d = (36.0 / 16.0) * (1.0_f64 / 6.0).sqrt();
            let e = (at(d, d) + at(d, -d) + at(-d, d) + at(-d, -d)) / 4.0;
            off += mean / e - 1.0;
            squares += (mean / e - 1.0).powi(2);
        }
        let (mean, rms) = (off / 256.0, (squares / 256.0_f64).sqrt());
        println!("{ways:?}: mean off by {mean:.5}, rms {rms:.4}");
        // A lamp that surfaces find by chance alone is noisy.
        let noise = if ways == Ways::Surfaces { 0.04 } else { 2e-3 };
        assert!(mean.abs() < noise / 10.0 && rms < noise, "{ways:?}: {mean} {rms}");
    }
}

#[test]
fn a_disc_lights_the_ground_by_the_same_form() {
    // Fails if the ground lies elsewhere, its normal or colour is another, or it keeps light from itself. Without bone it lies one radius below the middle, and both
    // are 1 mm and the origin.
    let plane = Plane { point: DVec3::ZERO, normal: DVec3::Z };
    let volumes = [Arc::new(plane.volume(&grid(9, 40.0)))];
    let ground = Ground::Sweep { color: Color([0.5; 3]) };
    let studio = Studio { ground, bounces: 0, ..plain(vec![lamp(0.0, 90.0, 2.0, 40.0, 0.8)], Sky::even(WHITE, 0.0)) };
    let mut scene = scene(&volumes, 0.0, studio);
    scene.layers[0].visible = false;
    scene.camera = Camera { up: DVec3::Z, eye_mm: DVec3::new(0.0, -3.0, 4.0), target_mm: DVec3::new(0.0, 0.0, -1.0), ..from_above(0.8) };
    let size = [8, 8];
    let tracer = Tracer::new(&volumes, &scene, size, 2).unwrap();
    let (_, pixels) = exposed(&tracer, size, 512);
    let (h, r, d) = (3.0, 2.0 * 20.0_f64.to_radians().tan(), 2.0);
    let radiance = 0.8 * (r * r + d * d) / (r * r);
    let mut off = 0.0;
    for n in 0..64 {
        let ray = scene.camera.ray(f64::from(n % 8), f64::from(n / 8), 8, 8);
        let (from, to) = (ray.at(0.0).0, ray.at(1.0).0);
        let p = from + (to - from) * ((-1.0 - from.z) / (to.z - from.z));
        let (a2, sum) = (p.truncate().length_squared(), p.truncate().length_squared() + h * h);
        let e = radiance / 2.0 * (1.0 - (sum - r * r) / ((sum + r * r).powi(2) - 4.0 * a2 * r * r).sqrt());
        let expected = e * f64::from(Color([0.5; 3]).linear().x);
        assert!((pixels[n as usize][1] / expected - 1.0).abs() < 0.02, "{n}: {} instead of {expected}", pixels[n as usize][1]);
        off += (pixels[n as usize][1] / expected - 1.0) / 64.0;
    }
    println!("off by {off:.5}");
    assert!(off.abs() < 2e-3, "{off}");
}

#[test]
fn a_plane_sees_half_of_the_sky() {
    // Fails if light comes from below a surface, or the sky is upside down: ∫ (1 ± cos)/2 cos dω / π is 5/6 for a plane that faces a sky that is
    // white above and black below, and 1/6 for one that is turned away.
    let plane = Plane { point: DVec3::ZERO, normal: DVec3::Z };
    let volumes = [Arc::new(plane.volume(&grid(9, 40.0)))];
    let sky = |above: f32, below: f32| plain(vec![], Sky { above: Color([above; 3]), below: Color([below; 3]), strength: 1.0 });
    for (above, below, expected) in [(1.0, 0.0, 5.0 / 6.0), (0.0, 1.0, 1.0 / 6.0)] {
        let mut scene = scene(&volumes, 0.0, sky(above, below));
        scene.camera = Camera { up: DVec3::Z, eye_mm: DVec3::new(0.0, -30.0, 500.0), ..from_above(10.0) };
        let [mean, error] = mean_of(|seed| Tracer::new(&volumes, &scene, [8, 8], seed).unwrap(), [8, 8], 64, 8);
        println!("{mean:.5} ± {error:.5}, expected {expected:.5}");
        assert!((mean - expected).abs() < 4.0 * error + 2e-4, "{mean} ± {error} instead of {expected}");
    }
}

#[test]
fn lamps_add_up_and_less_albedo_is_never_brighter() {
    // Fails if a lamp is counted twice, hides another, or its share depends on how many there are.
    let lamps = [lamp(-40.0, 50.0, 4.0, 20.0, 1.0), lamp(60.0, 10.0, 3.0, 35.0, 0.7)];
    let mean = |lamps: &[Lamp], color: f32| {
        let (volumes, mut scene) = small_skull(plain(lamps.to_vec(), Sky::even(WHITE, 0.0)));
        scene.layers[0].color = Color([color; 3]);
        mean_of(move |seed| Tracer::new(&volumes, &scene, [32, 32], seed).unwrap(), [32, 32], 16, 8)
    };
    let ([a, a_error], [b, b_error], [both, error]) = (mean(&lamps[..1], 0.8), mean(&lamps[1..], 0.8), mean(&lamps, 0.8));
    let [darker, _] = mean(&lamps, 0.7);
    let expected = (a_error * a_error + b_error * b_error + error * error).sqrt();
    println!("{a:.5} + {b:.5} = {:.5}, together {both:.5} ± {expected:.5}; darker bone {darker:.5}", a + b);
    assert!(a > 0.01 && b > 0.01 && (a + b - both).abs() < 3.5 * expected, "{a} + {b} is not {both} ± {expected}");
    assert!(darker < both);
}

#[test]
fn ways_of_sampling_lamps_agree() {
    // Fails if a density is another's: what one way adds the other one does not leave out.
    let (volumes, mut scene) = small_skull(plain(vec![lamp(-40.0, 50.0, 3.0, 60.0, 1.0)], Sky::even(WHITE, 0.3)));
    scene.studio.as_mut().unwrap().ground = Ground::Sweep { color: Color([0.6; 3]) };
    for gloss in [0.0, 1.0] {
        scene.studio.as_mut().unwrap().gloss = gloss;
        let mean = |ways: Ways| {
            let make = |seed: u32| {
                let mut tracer = Tracer::new(&volumes, &scene, [32, 32], seed).unwrap();
                tracer.stage.ways = ways;
                tracer
            };
            mean_of(make, [32, 32], 32, 8)
        };
        let all = [Ways::Both, Ways::Lamps, Ways::Surfaces].map(mean);
        println!("gloss {gloss}: {all:.5?}");
        for [other, error] in &all[1..] {
            let expected = (error * error + all[0][1] * all[0][1]).sqrt();
            assert!((other - all[0][0]).abs() < 3.5 * expected, "{all:?}");
        }
        assert!(all[0][1] <= 1.2 * all[2][1], "both ways are noisier than the worse one: {all:?}");
    }
}

#[test]
fn a_scene_without_a_studio_is_not_drawn() {
    // Fails if light is made up where none was asked for.
    let (volumes, scene) = small_skull(Preset::Sky.studio());
    let found = Tracer::new(&volumes, &Scene { studio: None, ..scene }, [8, 8], 0);
    assert!(found.is_err_and(|error| error.to_string().contains("no studio light")));
}

#[test]
fn within_a_closed_ball_it_is_dark() {
    // Fails if light leaks through a surface: a ray that starts on its other side, or a crack between cells or bricks.
    let shell = Shell { centre: DVec3::ZERO, inner_mm: 12.0, outer_mm: 16.0 };
    let volumes = [Arc::new(shell.volume(&grid(40, 40.0)))];
    let mut scene = scene(&volumes, 0.0, plain(vec![lamp(-40.0, 50.0, 3.0, 60.0, 5.0)], Sky::even(WHITE, 1.0)));
    scene.camera = Camera {
        eye_mm: DVec3::new(1.0, 2.0, 3.0),
        target_mm: DVec3::Y,
        up: DVec3::Z,
        projection: Projection::Perspective { fov_deg: 100.0 },
    };
    // Chance ends no path in white walls.
    scene.studio.as_mut().unwrap().bounces = 20;
    let size = [40, 40];
    let (_, pixels) = exposed(&Tracer::new(&volumes, &scene, size, 1).unwrap(), size, 16);
    assert!(pixels.iter().all(|p| p[3] == 1.0), "the wall has holes");
    let bright = pixels.iter().filter(|p| p[1] > 0.0).count();
    assert_eq!(bright, 0, "light in a closed ball");
}

#[test]
fn a_ball_on_a_clear_ground_casts_the_shadow_of_the_closed_form() {
    // Fails if a catcher counts what does not reach it, or reflects: under an even sky a ball of radius R that touches a plane keeps from a point at
    // a distance x from where it touches R³ / (x² + R²)^1.5 of its light.
    let ball = Sphere { centre: DVec3::new(0.3, -0.2, 0.1), radius_mm: 14.0 };
    let volumes = [Arc::new(ball.volume(&grid(48, 40.0)))];
    let mut scene = scene(&volumes, 0.0, Studio { ground: Ground::Catcher, ..plain(vec![], Sky::even(WHITE, 1.0)) });
    let target_mm = DVec3::new(0.0, 0.0, -8.0);
    scene.camera = Camera {
        eye_mm: target_mm + 300.0 * DVec3::new(0.0, -0.9, 0.45),
        target_mm,
        up: DVec3::Z,
        projection: Projection::Orthographic { height_mm: 70.0 },
    };
    let size = [48, 48];
    let tracer = Tracer::new(&volumes, &scene, size, 5).unwrap();
    let mut exposed = Exposed::new(size);
    tracer.expose(&mut exposed, 256, None, &Progress::default()).unwrap();
    let light = tracer.light(&exposed, false);
    let floor_mm = ball.centre.z - ball.radius_mm;
    let (mut off, mut squares, mut count) = (0.0, 0.0, 0.0);
    for n in 0..size[0] * size[1] {
        let (x, y) = (n % size[0], n / size[0]);
        let ray = scene.camera.ray(f64::from(x), f64::from(y), size[0], size[1]);
        let (block, at) = exposed.at(x, y);
        if block.sum(at)[super::batch::COVERAGE] > 0.0 {
            continue;
        }
        let (from, along) = (ray.at(0.0).0, ray.at(1.0).0 - ray.at(0.0).0);
        let p = from + along * ((floor_mm - from.z) / along.z);
        let away2 = (p - ball.centre).truncate().length_squared();
        let r2 = ball.radius_mm * ball.radius_mm;
        // Nearest to the ball a pixel's mean is another than its middle's.
        if away2 < 0.3 * r2 {
            continue;
        }
        let expected = (r2 / (away2 + r2)).powf(1.5);
        let found = f64::from(light[n as usize].w);
        (off, squares, count) = (off + found - expected, squares + (found - expected).powi(2), count + 1.0);
    }
    let (mean, rms) = (off / count, (squares / count).sqrt());
    println!("{count} pixels: off by {mean:.5}, rms {rms:.4}");
    assert!(count > 500.0 && mean.abs() < 3e-3 && rms < 0.03, "{mean} {rms}");
}

fn kept(exposed: &Exposed) -> Vec<u8> {
    let mut bytes = vec![];
    exposed.write(&mut bytes).unwrap();
    bytes
}

#[test]
fn threads_instructions_and_interruptions_change_no_bit() {
    // Fails if a sum's order depends on who adds, a lane on its neighbours, or a kept state leaves something out.
    let (volumes, scene) = small_skull(Studio { smooth_voxel: 0.4, gloss: 0.5, ..Preset::Museum.studio() });
    let size = [45, 37];
    let draw = |level, rounds: &[u32]| {
        let tracer = Tracer::with_instructions(level, &volumes, &scene, size, 9).unwrap();
        let mut exposed = Exposed::new(size);
        for until in rounds {
            tracer.expose(&mut exposed, *until, None, &Progress::default()).unwrap();
            exposed = Exposed::read(size, &mut kept(&exposed).as_slice()).unwrap();
        }
        exposed
    };
    let levels = CpuRenderer::instruction_sets();
    let whole = draw(levels[0], &[4, 20]);
    for threads in [1, 2, 5] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert!(pool.install(|| draw(levels[0], &[20])) == whole, "{threads} threads draw another picture");
    }
    for level in &levels[1..] {
        assert!(draw(*level, &[20]) == whole, "{level:?} draws another picture");
    }
    assert!(draw(levels[0], &[3, 7, 20]) == whole, "what was interrupted is another picture");
    let bytes = kept(&whole);
    for (size, bytes) in
        [([44, 37], &bytes[..]), (size, &bytes[1..]), (size, &bytes[..bytes.len() - 1]), (size, &[&bytes[..], &[0; 4]].concat())]
    {
        assert!(Exposed::read(size, &mut &*bytes).is_err(), "what is broken is read");
    }
}

#[test]
fn the_noise_that_is_told_is_the_noise_that_there_is() {
    // Fails if halves share numbers, or the told noise is of one half or of light instead of what is shown: it would be off by √2 or more.
    let (volumes, scene) = small_skull(Preset::Journal.studio());
    let scene = Scene { background: Some(Color([0.5; 3])), ..scene };
    let size = [64, 64];
    let shown = |seed: u32, samples: u32| {
        let tracer = Tracer::new(&volumes, &scene, size, seed).unwrap();
        let mut exposed = Exposed::new(size);
        tracer.expose(&mut exposed, samples, None, &Progress::default()).unwrap();
        let background = Color([0.5; 3]).linear();
        let colors: Vec<[f32; 3]> = tracer
            .light(&exposed, false)
            .iter()
            .map(|c| Color::of_light(c.truncate() + background * (1.0 - c.w)).0.map(|v| 255.0 * v))
            .collect();
        (exposed.noise(), colors, exposed)
    };
    let (_, truth, _) = shown(77, 1024);
    let (mut told, mut real) = (0.0, 0.0);
    for seed in 0..4 {
        let (noise, colors, _) = shown(seed, 32);
        let squares: f64 = colors.iter().zip(&truth).map(|(a, b)| (0..3).map(|c| f64::from(a[c] - b[c]).powi(2)).sum::<f64>()).sum();
        told += noise * noise;
        real += squares / (3.0 * colors.len() as f64);
    }
    let [told, real] = [told, real].map(|v: f64| (v / 4.0).sqrt());
    println!("told {told:.3}, true {real:.3}");
    assert!((told / real - 1.0).abs() < 0.1, "told {told}, true {real}");
    let (_, _, exposed) = shown(0, 32);
    let blocks = exposed.noise_of_blocks().iter().filter(|v| v.is_finite()).map(|v| f64::from(*v).powi(2)).sum::<f64>();
    assert!((exposed.noise() - (blocks / (64.0 * 64.0) * PIXELS as f64).sqrt()).abs() < 1e-3);
}

#[test]
fn a_lamp_is_where_it_is_put() {
    // Fails if a hand that puts a lamp somewhere finds it elsewhere, turns it away from what it follows, or cannot put it above or below.
    let mut r = bregma_synthetic::Random(3);
    let bounds = Bounds { centre_mm: DVec3::ZERO, radius_mm: 90.0 };
    for follows in [Follows::Camera, Follows::Skull] {
        for n in 0..200 {
            let camera = Camera::orbit(&bounds, 360.0 * r.unit(), 178.0 * r.unit() - 89.0);
            let seen = match n {
                0 => DVec3::Y,
                1 => DVec3::NEG_Y,
                _ => DVec3::from_array(std::array::from_fn(|_| 2.0 * r.unit() - 1.0)).normalize(),
            };
            let mut lamp = Lamp { follows, ..lamp(0.0, 0.0, 5.0, 16.0, 1.0) };
            lamp.put(seen, &camera);
            assert!(lamp.seen_from(&camera).distance(seen) < 1e-7 && lamp.follows == follows, "{seen}: {:?}", lamp.seen_from(&camera));
        }
    }
}

#[test]
fn what_is_known_of_scans_changes_no_picture_and_a_stopped_one_goes_on() {
    // Fails if a cache gives what is of another isovalue or smoothing, or a round that was stopped loses or repeats a sample.
    let (volumes, mut scene) = small_skull(Preset::Museum.studio());
    let (size, mut cache) = ([40, 32], crate::studio::TracerCache::default());
    for (iso, smooth_voxel) in [(226.0, 0.6), (226.0, 0.0), (400.0, 0.6), (226.0, 0.6)] {
        scene.layers[0].iso = iso;
        scene.studio = Some(Studio { smooth_voxel, ..Preset::Museum.studio() });
        let alone = Tracer::new(&volumes, &scene, size, 4).unwrap();
        let by_cache = Tracer::reusing(&mut cache, &volumes, &scene, size, 4).unwrap();
        let (whole, _) = exposed(&alone, size, 24);
        let mut parts = Exposed::new(size);
        for n in 0..40 {
            let progress = Progress::default();
            rayon::scope(|scope| {
                scope.spawn(|_| {
                    std::thread::sleep(std::time::Duration::from_micros(37 * n));
                    progress.cancel();
                });
                let _ = by_cache.expose(&mut parts, 24, None, &progress);
            });
        }
        by_cache.expose(&mut parts, 24, None, &Progress::default()).unwrap();
        assert!(parts == whole, "isovalue {iso}, smoothed by {smooth_voxel}");
    }
}
