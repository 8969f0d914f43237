//! Both renderers against the float64 reference, and against each other, on volumes made to be hard.
//! `exactness.rs` does the same on real scans.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use bregma_renderer::{Bounds, Camera, CpuRenderer, GpuRenderer, Mode, Projection, Renderer, Scene};
use bregma_tests::{Exactness, Random, color_difference, volume};
use bregma_volume::{Grid, Samples, Volume};
use glam::{DAffine3, DMat3, DVec3};
use std::sync::Arc;

fn cubic_grid(n: usize) -> Grid {
    Grid::new([n; 3], DVec3::ONE, DVec3::ZERO, DMat3::IDENTITY).unwrap()
}

/// Integer noise: every cell is as rough as can be, and samples equal to the isovalue are common.
fn noise(seed: u64, grid: Grid, levels: f64, make: impl Fn(Vec<f64>) -> Samples) -> Arc<Volume> {
    let mut random = Random(seed);
    let samples = (0..grid.len()).map(|_| (random.unit() * levels).floor()).collect();
    volume("noise", grid, make(samples))
}

/// Noise smoothed into blobs a few voxels across.
fn blobs(seed: u64, grid: Grid) -> Arc<Volume> {
    let mut random = Random(seed);
    let centres: Vec<DVec3> = (0..40).map(|_| DVec3::new(random.unit(), random.unit(), random.unit())).collect();
    let [nx, ny, nz] = grid.dims();
    let size = DVec3::new(nx as f64, ny as f64, nz as f64);
    let at = |n: usize| {
        let p = DVec3::new((n % nx) as f64, (n / nx % ny) as f64, (n / (nx * ny)) as f64) / size;
        centres.iter().map(|c| (-80.0 * c.distance_squared(p)).exp()).sum::<f64>()
    };
    let samples = Samples::F32((0..grid.len()).map(|n| at(n) as f32).collect());
    volume("blobs", grid, samples)
}

fn check(what: &str, volumes: &[Arc<Volume>], scenes: &[Scene], size: (u32, u32)) {
    let (mut cpu, mut gpu) = (CpuRenderer::default(), GpuRenderer::new(true).expect("a software Vulkan driver is installed by tests/run"));
    let (mut cpu_off, mut gpu_off) = (Exactness::default(), Exactness::default());
    let (mut pixels, mut unlike) = (0_u64, 0_u64);
    for scene in scenes {
        let on_cpu = cpu.render(volumes, scene, size.0, size.1).unwrap();
        let on_gpu = gpu.render(volumes, scene, size.0, size.1).unwrap();
        cpu_off.compare(volumes, scene, &on_cpu);
        gpu_off.compare(volumes, scene, &on_gpu);
        pixels += on_cpu.rgba.len() as u64;
        unlike += on_cpu.rgba.iter().zip(&on_gpu.rgba).filter(|(a, b)| color_difference(**a, **b) > 2).count() as u64;
        let ids_differ = on_cpu.volume_id.iter().zip(&on_gpu.volume_id).filter(|(a, b)| a != b).count();
        assert!(ids_differ * 10_000 <= on_cpu.volume_id.len(), "{what}: {ids_differ} pixels show another volume on the gpu");
    }
    cpu_off.assert(&format!("{what}, cpu"));
    gpu_off.assert(&format!("{what}, gpu"));
    println!("{what}: {unlike} of {pixels} pixels differ by more than 2/255");
    assert!(unlike * 10_000 <= pixels, "{what}: {unlike} of {pixels} pixels differ by more than 2/255 between cpu and gpu");
    assert!(cpu_off.tally.counts.hits > cpu_off.tally.counts.rays / 20, "{what}: a picture of nothing proves nothing");
}

fn scene(volumes: &[Arc<Volume>], iso: f64, azimuth: f64, elevation: f64) -> Scene {
    let mut scene = Scene::of(volumes);
    for layer in &mut scene.layers {
        layer.iso = iso;
    }
    scene.camera = Camera::orbit(&Bounds::of(volumes.iter().map(|v| v.grid())), azimuth, elevation);
    scene
}

#[test]
fn every_sample_type_is_exact() {
    // Fails if a texture format, a widening or a corner order is wrong on either side.
    type Make = fn(Vec<f64>) -> Samples;
    let kinds: [(&str, Make); 4] = [
        ("u8", |s| Samples::U8(s.iter().map(|&v| v as u8).collect())),
        ("u16", |s| Samples::U16(s.iter().map(|&v| v as u16 * 250 + 5000).collect())),
        ("i16", |s| Samples::I16(s.iter().map(|&v| v as i16 * 250 - 32_000).collect())),
        ("f32", |s| Samples::F32(s.iter().map(|&v| v as f32 * 1e-3 - 0.1).collect())),
    ];
    for (name, make) in kinds {
        let v = noise(7, cubic_grid(40), 255.0, make);
        let [low, high] = v.range();
        // High enough that rays pass several cells first.
        let volumes = [v];
        let scenes: Vec<Scene> = [(20.0, 10.0), (200.0, -50.0)].map(|(a, e)| scene(&volumes, low + 0.93 * (high - low), a, e)).into();
        check(name, &volumes, &scenes, (256, 256));
    }
}

#[test]
fn grids_of_any_shape_are_exact() {
    // Fails if index space and world are mixed up: anisotropic, sheared and mirrored grids, with sides that are no multiple of 8.
    let shear = DMat3::from_cols(DVec3::X, DVec3::new(0.2, 0.9, 0.0), DVec3::new(0.0, -0.32, 0.95));
    let grids = [
        ("anisotropic", Grid::new([61, 50, 9], DVec3::new(0.1, 1.0, 10.0), DVec3::new(-40.0, 3.0, 900.0), DMat3::IDENTITY).unwrap()),
        ("sheared", Grid::new([33, 47, 25], DVec3::new(0.8, 0.6, 1.3), DVec3::new(5.0, 0.0, -70.0), shear).unwrap()),
        ("mirrored", Grid::new([30, 31, 32], DVec3::splat(0.4), DVec3::ZERO, DMat3::from_diagonal(DVec3::new(-1.0, 1.0, -1.0))).unwrap()),
        ("thin", Grid::new([2, 64, 64], DVec3::ONE, DVec3::ZERO, DMat3::IDENTITY).unwrap()),
        // More slices than a graphics adapter has layers in a texture, mostly 2,048: read in another way there.
        ("tall", Grid::new([12, 11, 2100], DVec3::new(1.0, 1.0, 0.01), DVec3::ZERO, DMat3::IDENTITY).unwrap()),
    ];
    for (name, grid) in grids {
        let volumes = [blobs(21, grid)];
        let scenes: Vec<Scene> = [(35.0, 25.0), (290.0, -15.0)].map(|(a, e)| scene(&volumes, 0.5, a, e)).into();
        check(name, &volumes, &scenes, (256, 200));
    }
}

#[test]
fn rays_along_axes_in_faces_and_through_corners_are_exact() {
    // Fails if a zero direction component, a ray within a cell face or a hit on a corner is mishandled. The orthographic view
    // of 64 mm over 128 pixels puts every second ray, shifted by a quarter, exactly on sample planes.
    let volumes = [noise(11, cubic_grid(64), 3.0, |s| Samples::U8(s.iter().map(|&v| v as u8).collect()))];
    let mut scenes = Vec::new();
    for direction in [DVec3::X, DVec3::NEG_Y, DVec3::Z] {
        for shift in [0.0, 0.25, 0.5] {
            let mut s = scene(&volumes, 1.5, 0.0, 0.0);
            let centre = DVec3::splat(31.75 + shift);
            let up = if direction.z == 0.0 { DVec3::Z } else { DVec3::Y };
            s.camera = Camera {
                eye_mm: centre - 100.0 * direction,
                target_mm: centre,
                up,
                projection: Projection::Orthographic { height_mm: 64.0 },
            };
            scenes.push(s);
        }
    }
    check("axis rays", &volumes, &scenes, (128, 128));
    // Isovalues equal to samples: plateaus at the isovalue and ties at every corner. Ties are inside.
    for scene in &mut scenes {
        scene.layers[0].iso = 2.0;
    }
    check("axis rays on ties", &volumes, &scenes, (128, 128));
}

#[test]
fn eyes_near_far_and_inside_are_exact() {
    // Fails if float32 positions are taken from a far eye, or rays that start inside the box or the bone are lost.
    let volumes = [blobs(5, cubic_grid(72))];
    let mut scenes = Vec::new();
    for distance in [36.0, 10.0, 1e3, 1e5] {
        let mut s = scene(&volumes, 0.4, 0.0, 0.0);
        let centre = DVec3::splat(35.5);
        // Seen under an angle that shows the whole box, from wherever.
        let height_deg = (80.0_f64 / distance).atan().to_degrees().min(60.0);
        s.camera.eye_mm = centre + distance * DVec3::new(0.48, -0.6, 0.64);
        s.camera.target_mm = centre;
        s.camera.projection = Projection::Perspective { fov_deg: height_deg };
        scenes.push(s);
    }
    check("eyes", &volumes, &scenes, (256, 256));
}

#[test]
fn two_grids_and_a_registration_are_exact() {
    // Fails if depth means different things to the two volumes, or the transform is applied on the wrong side.
    let other = Grid::new([40, 40, 20], DVec3::new(1.5, 1.5, 3.0), DVec3::ZERO, DMat3::IDENTITY).unwrap();
    let volumes = [blobs(3, cubic_grid(64)), blobs(9, other)];
    let mut scenes: Vec<Scene> = [(30.0, 30.0), (170.0, -20.0)].map(|(a, e)| scene(&volumes, 0.5, a, e)).into();
    for s in &mut scenes {
        s.layers[1].transform = DAffine3::from_rotation_y(0.4) * DAffine3::from_translation(DVec3::new(3.0, -5.0, 2.0));
    }
    check("two volumes", &volumes, &scenes, (256, 256));
    let overlay: Vec<Scene> = scenes.iter().map(|s| Scene { mode: Mode::Overlay, ..s.clone() }).collect();
    check("overlay", &volumes, &overlay, (256, 256));
}

#[test]
fn a_falling_scale_turns_inside_out_nowhere() {
    // Fails if a negative slope flips the surface: `value ≥ iso` is inside whatever the samples do.
    let grid = cubic_grid(24);
    let samples = (0..grid.len()).map(|n| (n % 24) as i16).collect();
    let raster = bregma_volume::Raster {
        grid,
        samples: Samples::I16(samples),
        slope: -1.0,
        intercept: 0.0,
        unit: bregma_volume::Unit::Value,
        warnings: vec![],
    };
    let volumes = [Arc::new(Volume::new("falling".into(), "test", raster).unwrap())];
    let scenes = [scene(&volumes, -10.5, 50.0, 20.0)];
    check("falling scale", &volumes, &scenes, (128, 128));
    // Inside is x ≤ 10.5: the ray from +x meets it there.
    let surface = &scenes[0].surfaces(&volumes).unwrap()[0].1;
    let ray = bregma_renderer::Ray::new(bregma_volume::WorldPoint(DVec3::new(40.0, 12.2, 11.7)), DVec3::NEG_X).unwrap();
    let entry = bregma_field::crossings::first_entry(surface, &ray).unwrap();
    assert!((entry.t_mm - 29.5).abs() < 1e-9 && !entry.clipped, "{entry:?}");
}

#[test]
fn of_equal_surfaces_the_first_is_drawn_on_both() {
    // Fails if a tie in depth is resolved by the order of work.
    let v = blobs(4, cubic_grid(32));
    let volumes = [Arc::clone(&v), v];
    let scenes: Vec<Scene> = [Mode::Iso, Mode::Overlay].map(|mode| Scene { mode, ..scene(&volumes, 0.5, 20.0, 30.0) }).into();
    check("a volume twice", &volumes, &scenes, (128, 128));
    let ids = CpuRenderer::default().render(&volumes, &scenes[0], 128, 128).unwrap().volume_id;
    assert!(ids.contains(&1) && !ids.contains(&2));
}

#[test]
fn a_cut_face_is_flat_and_faces_outward() {
    // Fails if bone that the scan's edge cuts is shaded as anything but that face: here by Lambert's law alone, so that every pixel
    // of the face has the one colour of its angle to the light.
    let volumes = [volume("block", cubic_grid(20), Samples::I16(vec![500; 8000]))];
    for (direction, normal) in [(DVec3::Y, DVec3::NEG_Y), (DVec3::NEG_X, DVec3::X), (DVec3::NEG_Z, DVec3::Z)] {
        let mut s = scene(&volumes, 400.0, 0.0, 0.0);
        let centre = DVec3::splat(9.5);
        s.camera.eye_mm = centre - 29.5 * direction;
        s.camera.target_mm = centre;
        s.light = bregma_renderer::Light {
            toward: glam::Vec3::new(-0.3, 0.6, 1.0),
            ambient: 0.0,
            diffuse: 1.0,
            specular: 0.0,
            shininess: 1.0,
            shadow: 1.0,
        };
        s.layers[0].color = bregma_renderer::Color([1.0; 3]);
        let basis = s.camera.basis();
        let toward = (-0.3 * basis.right + 0.6 * basis.up - basis.forward).normalize();
        let linear = normal.dot(toward);
        let expected = ((1.055 * linear.powf(1.0 / 2.4) - 0.055) * 255.0).round() as u8;
        let mut renderers: [Box<dyn Renderer>; 2] = [Box::new(CpuRenderer::default()), Box::new(GpuRenderer::new(true).unwrap())];
        for renderer in &mut renderers {
            let picture = renderer.render(&volumes, &s, 64, 64).unwrap();
            let drawn: Vec<_> = picture.rgba.iter().zip(&picture.volume_id).filter(|(_, id)| **id == 1).map(|(c, _)| *c).collect();
            assert!(drawn.len() > 500);
            let off = drawn.iter().map(|c| color_difference(*c, [expected, expected, expected, 255])).max();
            assert!(off <= Some(1), "{} looking along {direction}: off by {off:?} from {expected}", renderer.name());
        }
    }
}

#[test]
fn a_lost_device_is_an_error_and_a_new_one_draws_the_same() {
    // Fails if a device that the driver took away ends the program, goes on with an empty picture, or is not known as lost.
    let opened = bregma_session::Opened::demo(48, &Default::default()).unwrap();
    let mut gpu = GpuRenderer::new(true).expect("a software Vulkan driver is installed by tests/run");
    let first = gpu.render(&opened.volumes, &opened.scene, 64, 48).unwrap();
    gpu.lose_device();
    let error = gpu.render(&opened.volumes, &opened.scene, 64, 48).unwrap_err();
    assert!(error.is_lost_device(), "{error}");
    assert!(gpu.render(&opened.volumes, &opened.scene, 96, 48).unwrap_err().is_lost_device(), "it stays lost");
    let again = GpuRenderer::new(true).unwrap().render(&opened.volumes, &opened.scene, 64, 48).unwrap();
    assert_eq!(again.rgba, first.rgba);
}
