//! Surfaces that a solid cuts: every ray of both renderers against the float64 reference, what cutting costs, what solids take, and how right their
//! distances are.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use bregma_field::{Bounds, Grid, IndexPoint, Progress, Solid, Volume};
use bregma_renderer::{Camera, CpuRenderer, GpuRenderer, Mode, Named, Reconstruction, Renderer, Scene, Within};
use bregma_synthetic::analytic::{Sphere, sampled};
use bregma_synthetic::{Random, Which, skull};
use bregma_tests::{Exactness, color_difference};
use glam::{DMat3, DVec3};
use std::sync::Arc;
use std::time::Instant;

/// Cells of different lengths, a sheared turn, and sizes that end within bricks.
fn grid() -> Grid {
    let shear = DMat3::from_cols(DVec3::new(0.96, 0.28, 0.0), DVec3::new(-0.28, 0.96, 0.0), DVec3::Z);
    Grid::new([37, 30, 27], DVec3::new(1.0, 0.8, 1.3), DVec3::new(-20.0, 5.0, 100.0), shear).unwrap()
}

fn middle(grid: &Grid) -> DVec3 {
    Bounds::of([grid]).centre_mm
}

/// How far within a box along the axes of the world.
fn within_box(p: DVec3, half: DVec3) -> f64 {
    let out = p.abs() - half;
    -(out.max(DVec3::ZERO).length() + out.max_element().min(0.0))
}

/// Solids of each kind on a grid, by name.
fn solids(grid: &Grid, seed: u64) -> Vec<(&'static str, Solid)> {
    let centre = middle(grid);
    let at = |p: IndexPoint| grid.world(p).0 - centre;
    let mut r = Random(seed);
    let count = grid.dims().iter().product::<usize>();
    let noise: Vec<f32> = (0..count).map(|_| (2.0 * r.unit() - 1.0) as f32).collect();
    let labels: Vec<f32> = (0..count).map(|_| if r.unit() < 0.5 { 0.5 } else { -0.5 }).collect();
    let half: Vec<f32> = (0..count).map(|n| if n % grid.dims()[0] < 20 { 0.5 } else { -0.5 }).collect();
    let [nx, ny, _] = grid.dims();
    let dense =
        |distances: &[f32]| Solid::of(grid, |IndexPoint(p)| f64::from(distances[(p.z as usize * ny + p.y as usize) * nx + p.x as usize]));
    vec![
        ("ball", Solid::of(grid, |p| 11.0 - at(p).length())),
        ("cube", Solid::of(grid, |p| within_box(at(p), DVec3::new(9.0, 8.0, 7.5)))),
        ("noise", dense(&noise)),
        ("labels", dense(&labels)),
        ("half", dense(&half)),
    ]
}

/// Volumes of each kind on a grid, with an isovalue.
fn bones(grid: &Grid) -> Vec<(&'static str, Volume, f64)> {
    let centre = middle(grid);
    let mut r = Random(7);
    let noise: Vec<f64> = (0..grid.dims().iter().product()).map(|_| (7.0 * r.unit()).floor()).collect();
    let [nx, ny, _] = grid.dims();
    let of_sample = |p: DVec3| {
        let i = grid.index(bregma_field::WorldPoint(p)).0.round().as_usizevec3();
        noise[(i.z * ny + i.y) * nx + i.x]
    };
    vec![
        ("ball", Sphere { centre, radius_mm: 10.0 }.volume(grid), 0.0),
        // Tangent to the ball of the solids from within, and all but the same as it: where both coincide to a ten-thousandth of a voxel, as far as
        // distances are kept, rounding decides.
        ("tangent ball", Sphere { centre: centre + DVec3::X * 3.0, radius_mm: 8.0 }.volume(grid), 0.0),
        ("nearly the same ball", Sphere { centre, radius_mm: 11.003 }.volume(grid), 0.0),
        // Many samples equal the isovalue.
        ("noise", sampled("noise", grid, of_sample), 4.0),
    ]
}

fn within(solid: Solid) -> Within {
    Within { part: "part".into(), keeps: true, grow_mm: 0.0, rim_mm: 0.0, measures: true, solid: Some(Arc::new(solid)) }
}

fn scene(volume: &Arc<Volume>, iso: f64, solid: Solid) -> Scene {
    let mut scene = Scene::of(std::slice::from_ref(volume));
    scene.layers[0].iso = iso;
    scene.layers[0].within = Some(within(solid));
    scene
}

#[test]
fn every_ray_meets_what_the_solid_leaves_of_the_bone() {
    // Fails if a root of the solid's cubic is missed, a part of a way through a cell is forgotten, bone outside is met, or a face within bone is
    // none.
    let grid = grid();
    let bounds = Bounds::of([&grid]);
    let (mut cpu, mut gpu) = (CpuRenderer::default(), GpuRenderer::new(true).expect("a software Vulkan driver is installed by tests/run"));
    for (bone, volume, iso) in bones(&grid) {
        let volume = Arc::new(volume);
        for (name, solid) in solids(&grid, 3) {
            let (mut on_cpu, mut on_gpu) = (Exactness::default(), Exactness::default());
            for (n, solid) in [solid.inverse(), solid].into_iter().enumerate() {
                let mut scene = scene(&volume, iso, solid);
                for view in 0..3 {
                    scene.camera = Camera::orbit(&bounds, 77.0 * f64::from(view) + 10.0 * n as f64, 20.0);
                    if view == 2 {
                        // From within.
                        scene.camera.eye_mm = middle(&grid) + DVec3::new(0.3, 1.7, -2.2);
                    }
                    let volumes = std::slice::from_ref(&volume);
                    let [a, b] = [cpu.render(volumes, &scene, 112, 112), gpu.render(volumes, &scene, 112, 112)].map(Result::unwrap);
                    on_cpu.compare(volumes, &scene, &a);
                    on_gpu.compare(volumes, &scene, &b);
                    let unlike = a.rgba.iter().zip(&b.rgba).filter(|(a, b)| color_difference(**a, **b) > 2).count();
                    assert!(unlike * 500 <= a.rgba.len(), "{bone} within {name}: {unlike} pixels differ between cpu and gpu");
                }
            }
            for (backend, off) in [("cpu", on_cpu), ("gpu", on_gpu)] {
                let (wrong, t) = (off.wrong.len(), &off.tally.counts);
                println!("{bone} within {name}, {backend}: {} rays, {} hits, {} tangent, {wrong} wrong", t.rays, t.hits, t.tangent);
                assert!(wrong == 0, "{bone} within {name}, {backend}: {wrong} rays are wrong, such as {:#?}", &off.wrong[..wrong.min(5)]);
                assert!(t.hits * 50 > t.rays, "a picture of nothing proves nothing");
            }
        }
    }
}

#[test]
fn distances_are_right_in_the_band_and_take_memory_by_area() {
    // Fails if a distance is rounded to more than a thousandth of a voxel, a block near the surface is left out, or one far from it is kept.
    let grid = Grid::new([128; 3], DVec3::splat(0.5), DVec3::ZERO, DMat3::IDENTITY).unwrap();
    let centre = DVec3::splat(63.2);
    let exact = |p: DVec3| 0.5 * (40.0 - p.distance(centre));
    let solid = Solid::of(&grid, |IndexPoint(p)| exact(p));
    let mut worst = 0.0_f64;
    for n in 0..128 * 128 * 128 {
        let at = [n % 128, n / 128 % 128, n / (128 * 128)];
        let mm = exact(DVec3::from(at.map(|i| i as f64)));
        if mm.abs() <= Solid::band_mm(&grid) {
            worst = worst.max((f64::from(solid.units_at(at)) * solid.unit_mm() - mm).abs() / 0.5);
        }
        assert_eq!(solid.units_at(at) >= 0, mm >= 0.0, "{at:?}");
    }
    println!("distances of a ball: worst {worst:.1e} voxel, {} kB", solid.bytes() / 1000);
    assert!(worst <= 1e-3);
    assert!(solid.bytes() * 4 < 128 * 128 * 128 * 2);
}

#[test]
fn a_frame_that_a_solid_cuts_costs_little_more_than_one_of_all() {
    // Fails if cutting costs more than half a frame.
    let size = std::env::var("BREGMA_SIZE").ok().and_then(|n| n.parse().ok()).unwrap_or(96);
    let volume = Arc::new(skull(Which::A, size, &Progress::default()).unwrap());
    let centre = middle(volume.grid());
    let grid = volume.grid().clone();
    let solid = Arc::new(Solid::of(&grid, |p| 70.0 - (grid.world(p).0 - centre).length()));
    println!("a ball of 70 mm on a skull of {size}³: {:.2} MB", solid.bytes() as f64 / 1e6);
    let volumes = std::slice::from_ref(&volume);
    let mut scene = Scene::of(volumes);
    let renderers: [(&str, Box<dyn Renderer>); 2] =
        [("cpu", Box::new(CpuRenderer::default())), ("gpu", Box::new(GpuRenderer::new(true).expect("a software Vulkan driver")))];
    for (name, mut renderer) in renderers {
        let mut ratios = vec![];
        for _ in 0..9 {
            let mut time = |cut: bool| {
                scene.layers[0].within = cut.then(|| Within { solid: Some(Arc::clone(&solid)), ..within((*solid).clone()) });
                renderer.render(volumes, &scene, 512, 512).unwrap();
                let begun = Instant::now();
                renderer.render(volumes, &scene, 512, 512).unwrap();
                begun.elapsed().as_secs_f64()
            };
            ratios.push(time(true) / time(false));
        }
        ratios.sort_by(f64::total_cmp);
        println!(
            "{name}: a frame within a solid takes {:.2} times one of all (median of 9, {:.2} to {:.2})",
            ratios[4], ratios[0], ratios[8]
        );
        assert!(ratios[4] <= 1.5, "{name}: {ratios:?}");
    }
}

#[test]
fn every_mode_is_cut_alike_on_both_renderers() {
    // Fails if a mode forgets the solid, or the twins cut it otherwise.
    let grid = grid();
    let volume = Arc::new(Sphere { centre: middle(&grid), radius_mm: 10.0 }.volume(&grid));
    let volumes = std::slice::from_ref(&volume);
    let (mut cpu, mut gpu) = (CpuRenderer::default(), GpuRenderer::new(true).expect("a software Vulkan driver is installed by tests/run"));
    let off = middle(&grid) + DVec3::new(4.0, -3.0, 2.0);
    let solid = Arc::new(Solid::of(&grid, |p| 8.0 - (grid.world(p).0 - off).length()));
    let modes = Mode::ALL.iter().map(|mode| (*mode, Reconstruction::Trilinear));
    for (mode, reconstruction) in modes.chain([(Mode::Iso, Reconstruction::Spline), (Mode::Iso, Reconstruction::Nearest)]) {
        for shadows in [false, true] {
            let mut scene = Scene { mode, shadows, reconstruction, ..Scene::of(volumes) };
            scene.layers[0].iso = 0.0;
            scene.camera = Camera::orbit(&Bounds::of([&grid]), 30.0, 20.0);
            let whole = cpu.render(volumes, &scene, 96, 96).unwrap();
            scene.layers[0].within = Some(Within { solid: Some(Arc::clone(&solid)), ..within((*solid).clone()) });
            let [a, b] = [cpu.render(volumes, &scene, 96, 96), gpu.render(volumes, &scene, 96, 96)].map(Result::unwrap);
            let unlike = |a: &[[u8; 4]], b: &[[u8; 4]]| a.iter().zip(b).filter(|(a, b)| color_difference(**a, **b) > 2).count();
            let (twins, cut) = (unlike(&a.rgba, &b.rgba), unlike(&a.rgba, &whole.rgba));
            println!("{mode:?}, {reconstruction:?}, shadows {shadows}: {twins} pixels differ between cpu and gpu, {cut} from the whole");
            assert!(twins * 200 <= a.rgba.len(), "{mode:?}: {twins} pixels differ");
            assert!(cut > 100, "{mode:?}: nothing is cut");
        }
    }
}
