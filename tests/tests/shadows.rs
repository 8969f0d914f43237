//! Hard shadows of both renderers against rays of the float64 reference from what each pixel shows toward the light.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use bregma_field::crossings;
use bregma_renderer::{
    Bounds, Camera, Clip, Color, CpuRenderer, GpuRenderer, Light, Mode, Normals, Picture, Projection, Ray, Renderer, Scene, Shape, Surface,
};
use bregma_synthetic::{Which, skull};
use bregma_tests::{color_difference, volume};
use bregma_volume::{Grid, Progress, Samples, Volume, WorldPoint};
use glam::{DAffine3, DMat3, DVec3};
use std::sync::Arc;

/// White surfaces under Lambert's law alone: what is lit is not black.
fn white(volumes: &[Arc<Volume>], azimuth_deg: f64, elevation_deg: f64) -> Scene {
    let mut scene = Scene::of(volumes);
    let bounds = Bounds::of(scene.surfaces(volumes).unwrap().iter().map(|(_, s)| &s.grid));
    scene.camera = Camera::orbit(&bounds, azimuth_deg, elevation_deg);
    scene.background = None;
    scene.light = Light { ambient: 0.0, diffuse: 1.0, specular: 0.0, shadow: 1.0, ..scene.light };
    scene.layers.iter_mut().for_each(|layer| layer.color = Color([1.0; 3]));
    scene
}

fn toward_light(scene: &Scene) -> DVec3 {
    let basis = scene.camera.basis();
    let l = scene.light.toward.as_dvec3();
    (l.x * basis.right + l.y * basis.up - l.z * basis.forward).normalize()
}

/// How far a point may lie from what a pixel shows, mm: ten times what float32 is off by.
const MOVED_MM: f64 = 1e-3;

/// Of the pixels that are lit in `plain`, the picture without shadows: how many the reference sees in shadow, how many in the light, and
/// how many `picture` shows otherwise. Not counted is where moving the point changes the reference's own answer.
fn judge(picture: &Picture, plain: &Picture, scene: &Scene, volumes: &[Arc<Volume>]) -> [usize; 3] {
    let surfaces: Vec<Surface> = scene.surfaces(volumes).unwrap().into_iter().map(|(_, s)| s).collect();
    let start_mm = 0.01 * surfaces.iter().map(|s| s.grid.spacing_mm().min_element()).fold(f64::INFINITY, f64::min);
    let toward = toward_light(scene);
    let (side, other) = toward.any_orthonormal_pair();
    let moves = [DVec3::ZERO, side, -side, other, -other, toward, -toward];
    let (mut dark, mut lit, mut wrong) = (0, 0, 0);
    for n in 0..plain.rgba.len() {
        let black = [0, 0, 0, 255];
        if plain.volume_id[n] == 0 || plain.rgba[n] == black {
            continue;
        }
        let (x, y) = (n as u32 % plain.width, n as u32 / plain.width);
        let seen = scene.camera.ray(f64::from(x), f64::from(y), plain.width, plain.height).at(f64::from(plain.depth_mm[n])).0;
        let answers = moves.map(|moved| {
            let ray = Ray::new(WorldPoint(seen + start_mm * toward + MOVED_MM * moved), toward).unwrap();
            surfaces.iter().any(|s| crossings::first_entry(s, &ray).is_some())
        });
        if answers.iter().any(|answer| *answer != answers[0]) {
            continue;
        }
        let expected = if answers[0] { black } else { plain.rgba[n] };
        wrong += usize::from(picture.rgba[n] != expected);
        *(if answers[0] { &mut dark } else { &mut lit }) += 1;
    }
    [dark, lit, wrong]
}

fn check(what: &str, volumes: &[Arc<Volume>], scene: &Scene) {
    let mut renderers: [Box<dyn Renderer>; 2] = [Box::new(CpuRenderer::default()), Box::new(GpuRenderer::new(true).unwrap())];
    let size = (240, 200);
    let drawn = renderers.each_mut().map(|renderer| {
        let plain = renderer.render(volumes, scene, size.0, size.1).unwrap();
        let shadows = Scene { shadows: true, ..scene.clone() };
        let picture = renderer.render(volumes, &shadows, size.0, size.1).unwrap();
        assert!(picture.volume_id == plain.volume_id, "{what}: shadows change which volume is seen");
        let [dark, lit, wrong] = judge(&picture, &plain, scene, volumes);
        println!("{what}, {}: {dark} in shadow, {lit} lit, {wrong} wrong", renderer.backend());
        assert!(wrong == 0 && dark > 300 && lit > 300, "{what}, {}: {wrong} wrong of {dark} in shadow and {lit} lit", renderer.backend());
        picture
    });
    let unlike = drawn[0].rgba.iter().zip(&drawn[1].rgba).filter(|(a, b)| color_difference(**a, **b) > 2).count();
    println!("{what}: {unlike} of {} pixels differ by more than 2/255", drawn[0].rgba.len());
    assert!(unlike * 10_000 <= drawn[0].rgba.len(), "{what}: {unlike} pixels differ between cpu and gpu");
}

/// A ball of `radius` voxels in the middle, or above it.
fn ball(grid: Grid, radius: f64, above: f64) -> Arc<Volume> {
    let [nx, ny, nz] = grid.dims();
    let centre = DVec3::new(nx as f64 - 1.0, ny as f64 - 1.0, nz as f64 - 1.0) / 2.0 + above * DVec3::Z;
    let at = |n: usize| DVec3::new((n % nx) as f64, (n / nx % ny) as f64, (n / (nx * ny)) as f64);
    volume("ball", grid.clone(), Samples::F32((0..grid.len()).map(|n| (radius - at(n).distance(centre)) as f32).collect()))
}

#[test]
fn a_skull_shades_itself_where_the_reference_says() {
    // Fails if a shadow ray begins in the wrong place or goes the wrong way, ends before it leaves the bone's blocks, or meets its own surface.
    let progress = Progress::default();
    let volumes = [Arc::new(skull(Which::A, 64, &progress).unwrap())];
    for (azimuth, elevation) in [(30.0, 15.0), (150.0, -40.0)] {
        check("skull", &volumes, &white(&volumes, azimuth, elevation));
    }
    // The eye within the volume's box, before the face, and the light beside it.
    let mut scene = white(&volumes, 0.0, 0.0);
    scene.camera.eye_mm = scene.camera.target_mm + DVec3::new(20.0, -95.0, -50.0);
    scene.camera.projection = Projection::Perspective { fov_deg: 70.0 };
    scene.light.toward = glam::Vec3::new(1.0, 1.0, 0.5);
    check("close to the face", &volumes, &scene);
}

#[test]
fn one_volume_shades_the_other_on_other_grids() {
    // Fails if a shadow does not fall from one volume onto the other, a transform is left out, or index space and world are mixed up.
    let shear = DMat3::from_cols(DVec3::X, DVec3::new(0.2, 0.9, 0.0), DVec3::new(0.0, -0.3, 1.4));
    let sheared = Grid::from_affine([40, 44, 30], DAffine3::from_mat3_translation(shear, DVec3::new(-20.0, -12.0, -20.0))).unwrap();
    let plain = Grid::new([30; 3], DVec3::new(0.5, 0.6, 0.7), DVec3::splat(-8.0), DMat3::IDENTITY).unwrap();
    let volumes = [ball(sheared, 12.0, 0.0), ball(plain, 9.0, 3.0)];
    let mut scene = white(&volumes, 40.0, 20.0);
    scene.layers.iter_mut().for_each(|layer| layer.iso = 0.0);
    let toward = toward_light(&scene);
    scene.layers[1].transform = DAffine3::from_translation(22.0 * toward + DVec3::X) * DAffine3::from_rotation_x(0.7);
    scene.camera = Camera::orbit(&Bounds::of(scene.surfaces(&volumes).unwrap().iter().map(|(_, s)| &s.grid)), 40.0, 20.0);
    scene.light.toward = {
        let basis = scene.camera.basis();
        DVec3::new(toward.dot(basis.right), toward.dot(basis.up), -toward.dot(basis.forward)).as_vec3()
    };
    check("two volumes", &volumes, &scene);
}

#[test]
fn both_surfaces_of_an_overlay_have_shadows() {
    // Fails if only the nearer surface is shaded, or the shadow of one is taken for the other's: then a transparent one of opacity 0
    // would not leave the picture of the other alone, with both volumes keeping the light from it.
    let grid = || Grid::new([32; 3], DVec3::ONE, DVec3::splat(-15.5), DMat3::IDENTITY).unwrap();
    let volumes = [ball(grid(), 8.0, 0.0), ball(grid(), 8.0, 0.0)];
    let mut scene = Scene { shadows: true, mode: Mode::Overlay, ..white(&volumes, 0.0, 0.0) };
    scene.layers.iter_mut().for_each(|layer| layer.iso = 0.0);
    // The second stands before the first, a little toward the light; its shadow falls on the first.
    let basis = scene.camera.basis();
    scene.layers[1].transform = DAffine3::from_translation(20.0 * toward_light(&scene) - 4.0 * basis.forward);
    scene.layers[1].opacity = 0.0;
    let iso = Scene { mode: Mode::Iso, shadows: false, ..scene.clone() };
    for mut renderer in [Box::new(CpuRenderer::default()) as Box<dyn Renderer>, Box::new(GpuRenderer::new(true).unwrap())] {
        let nearest = renderer.render(&volumes, &iso, 160, 160).unwrap();
        let through = renderer.render(&volumes, &scene, 160, 160).unwrap();
        let surfaces: Vec<Surface> = scene.surfaces(&volumes).unwrap().into_iter().map(|(_, s)| s).collect();
        let (mut behind, mut dark) = (0, 0);
        for n in (0..nearest.rgba.len()).filter(|n| nearest.volume_id[*n] == 2) {
            let ray = scene.camera.ray((n % 160) as f64, (n / 160) as f64, 160, 160);
            let Some(hit) = crossings::first_entry(&surfaces[0], &ray) else { continue };
            let toward = toward_light(&scene);
            let to_light = Ray::new(WorldPoint(ray.at(hit.t_mm).0 + 0.01 * toward), toward).unwrap();
            let is_dark = hit.normal.dot(toward) < 0.0 || surfaces.iter().any(|s| crossings::first_entry(s, &to_light).is_some());
            // At the rims the answers are a matter of rounding.
            if hit.normal.dot(toward).abs() > 0.05 {
                dark += usize::from(is_dark);
                assert_eq!(through.rgba[n] == [0, 0, 0, 255], is_dark, "{}: pixel {n}", renderer.backend());
            }
            behind += 1;
        }
        println!("{}: {behind} pixels through the transparent ball, {dark} of them on what lies in shadow", renderer.backend());
        assert!(dark > 100 && behind > dark, "{behind} {dark}");
    }
}

#[test]
fn opaque_shells_have_the_shadows_of_an_isosurface() {
    // Fails if a crossing is forgotten, counted at its own start, or seen where cuts or the box close a surface.
    let volumes = [Arc::new(skull(Which::A, 64, &Progress::default()).unwrap())];
    // With the surface's own normals: where smooth ones face a light that the surface turns from, a ray to it begins inside the bone, and
    // whether a cut then lets it out is not what this compares.
    let mut scene = Scene { shadows: true, normals: Normals::Analytic, ..white(&volumes, 30.0, 15.0) };
    scene.layers[0].opacity = 1.0;
    let plane = Clip::all(Shape::Plane { normal: DVec3::new(0.6, 0.0, 0.8), offset_mm: 0.0 });
    for clips in [vec![], vec![plane]] {
        scene.clips = clips;
        for mut renderer in [Box::new(CpuRenderer::default()) as Box<dyn Renderer>, Box::new(GpuRenderer::new(true).unwrap())] {
            let iso = renderer.render(&volumes, &scene, 240, 200).unwrap();
            let shells = renderer.render(&volumes, &Scene { mode: Mode::Transparent, ..scene.clone() }, 240, 200).unwrap();
            let unlike = iso.rgba.iter().zip(&shells.rgba).filter(|(a, b)| color_difference(**a, **b) > 2).count();
            println!("{}: {unlike} of {} pixels differ by more than 2/255", renderer.backend(), iso.rgba.len());
            assert!(unlike * 10_000 <= iso.rgba.len());
        }
    }
}

#[test]
fn a_transparent_ball_lets_its_share_of_the_light_through() {
    // Fails if a surface keeps more or less of the light than of what lies behind it: 60 % come through each of two.
    let grid = || Grid::new([40; 3], DVec3::splat(0.5), DVec3::splat(-9.75), DMat3::IDENTITY).unwrap();
    let volumes = [ball(grid(), 16.0, 0.0), ball(grid(), 8.0, 0.0)];
    let mut scene = Scene { shadows: true, mode: Mode::Transparent, ..white(&volumes, 0.0, 0.0) };
    scene.layers.iter_mut().for_each(|layer| layer.iso = 0.0);
    scene.light.toward = glam::Vec3::new(-1.0, 0.3, 0.4);
    scene.layers[0].opacity = 1.0;
    scene.layers[1].transform = DAffine3::from_translation(14.0 * toward_light(&scene));
    scene.camera.projection = Projection::Orthographic { height_mm: 40.0 };
    let light = |picture: &Picture, n: usize| Color([f32::from(picture.rgba[n][0]) / 255.0; 3]).linear().x;
    for mut renderer in [Box::new(CpuRenderer::default()) as Box<dyn Renderer>, Box::new(GpuRenderer::new(true).unwrap())] {
        let mut with = |opacity| {
            scene.layers[1].opacity = opacity;
            renderer.render(&volumes, &scene, 200, 200).unwrap()
        };
        let [none, some, all] = [with(0.0), with(0.4), with(1.0)];
        let (mut shaded, mut lit) = (0, 0);
        // Of the first ball what is bright without the second one, and not seen through it.
        for n in (0..none.rgba.len()).filter(|n| all.volume_id[*n] == 1 && light(&none, *n) > 0.3) {
            let share = light(&some, n) / light(&none, n);
            let expected = if light(&all, n) == 0.0 { 0.36 } else { 1.0 };
            assert!((share - expected).abs() < 0.02, "{}: {share} instead of {expected} at {n}", renderer.backend());
            *(if expected < 1.0 { &mut shaded } else { &mut lit }) += 1;
        }
        println!("{}: {shaded} in the ball's shadow, {lit} beside it", renderer.backend());
        assert!(shaded > 100 && lit > 100);
    }
}
