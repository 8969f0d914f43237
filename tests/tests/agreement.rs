//! Where two surfaces of an overlay agree they are drawn as one.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use bregma_renderer::{Camera, CpuRenderer, GpuRenderer, Mode, Picture, Projection, Renderer, Scene};
use bregma_session::Opened;
use bregma_tests::{color_difference, data};

const SIZE: [u32; 2] = [800, 800];

/// Whether the colour of a pixel jumps: by more than 40/255 against the middle one of the nine around it, by brightness.
fn jumps_at(picture: &Picture, around: &[usize]) -> bool {
    let mut sorted: Vec<[u8; 4]> = around.iter().map(|n| picture.rgba[*n]).collect();
    sorted.sort_by_key(|c| c[..3].iter().map(|v| u32::from(*v)).sum::<u32>());
    color_difference(picture.rgba[around[4]], sorted[4]) > 40
}

/// Pixels where both scans' surfaces, each drawn alone, lie within half the tolerance of each other, in the pixel and all around it, and bend by
/// no more than a slope of 4: bone on which the two agree for certain. And how many of them have a colour that jumps, and that of neither scan
/// alone does, as on a crest or at the edge of a shadow.
fn jumps(picture: &Picture, alone: &[Picture; 2], agreement_mm: f64, pixel_mm: f64) -> [usize; 2] {
    let [w, h] = SIZE.map(|n| n as usize);
    let agrees = |n: usize| f64::from((alone[0].depth_mm[n] - alone[1].depth_mm[n]).abs()) <= agreement_mm / 2.0;
    let (mut certain, mut jumping) = (0, 0);
    for (x, y) in (1..h - 1).flat_map(|y| (1..w - 1).map(move |x| (x, y))) {
        let at = y * w + x;
        let around: Vec<usize> = (0..9).map(|n| (y + n / 3 - 1) * w + x + n % 3 - 1).collect();
        let is_smooth = around.iter().all(|n| f64::from((alone[0].depth_mm[*n] - alone[0].depth_mm[at]).abs()) <= 4.0 * pixel_mm);
        if !is_smooth || !around.iter().all(|n| agrees(*n)) {
            continue;
        }
        certain += 1;
        jumping += usize::from(jumps_at(picture, &around) && !alone.iter().any(|alone| jumps_at(alone, &around)));
    }
    [certain, jumping]
}

fn check(what: &str, opened: &Opened) {
    let renderers: [Box<dyn Renderer>; 2] =
        [Box::new(CpuRenderer::default()), Box::new(GpuRenderer::new(true).expect("a software Vulkan driver is installed by tests/run"))];
    for mut renderer in renderers {
        let (mut all, mut before) = ([0; 2], [0; 2]);
        for azimuth in [0.0, 60.0, 140.0] {
            let mut scene = Scene { mode: Mode::Overlay, shadows: true, ..opened.scene.clone() };
            scene.camera = Camera::framing(&opened.bone_points_mm(), azimuth, 20.0, 1.0);
            let mut draw = |scene: &Scene| renderer.render(&opened.volumes, scene, SIZE[0], SIZE[1]).unwrap();
            let alone = [0, 1].map(|n| {
                let mut scene = Scene { mode: Mode::Iso, ..scene.clone() };
                scene.layers[1 - n].visible = false;
                draw(&scene)
            });
            let Projection::Orthographic { height_mm } = scene.camera.parallel().projection else { unreachable!("rays are parallel") };
            let (agreement_mm, pixel_mm) = (scene.agreement_mm(&opened.volumes), height_mm / f64::from(SIZE[1]));
            let mut add = |scene: &Scene, to: &mut [usize; 2]| {
                let [certain, jumping] = jumps(&draw(scene), &alone, agreement_mm, pixel_mm);
                *to = [to[0] + certain, to[1] + jumping];
            };
            add(&scene, &mut all);
            scene.agree_within_mm = Some(0.0);
            add(&scene, &mut before);
        }
        println!("{what}, {}: {} of {} pixels jump ({} where nothing agrees)", renderer.name(), all[1], all[0], before[1]);
        assert!(all[0] > 15_000, "{what}: too few pixels agree to prove anything: {all:?}");
        assert!(all[1] * 1000 < all[0], "{what}: {} of {} pixels jump", all[1], all[0]);
        assert!(before[1] * 1000 > all[0], "{what}: the measure finds no speckle where there is some: {before:?}");
    }
}

#[test]
fn skulls_that_agree_are_one_without_speckle() {
    // Fails if agreeing surfaces take turns in being the nearer one, or cast shadows on each other.
    check("demo", &Opened::demo(128, &Default::default()).unwrap());
}

#[test]
fn mice_that_agree_are_one_without_speckle() {
    let Some(data) = data("agreement of mice") else { return };
    let file = |name: &str| bregma_session::Source { file: data.join("mouse").join(name), ..Default::default() };
    let mut moved = file("C57BL6_J_.nii.gz");
    moved.transform = Some(data.join("mouse/rigid_from_landmarks.json"));
    let mut opened = Opened::read(&[moved, file("DBA_2J_.nii.gz")], &Default::default()).unwrap();
    opened.scene.layers.iter_mut().for_each(|layer| layer.iso = 40.0);
    check("mice", &opened);
}

#[test]
fn depths_between_two_skulls_are_told_in_colours() {
    // Fails if a colour is not that of the depth between the first hits of both scans, its sign is turned round where the second one stands out, or
    // a part that only one scan has is coloured as if it agreed. The truth are the depths of each scan drawn alone.
    let [low, middle, high] = [[0.129, 0.400, 0.674], [0.93, 0.88, 0.77], [0.698, 0.094, 0.169_f32]];
    let opened = Opened::demo(64, &Default::default()).unwrap();
    let range_mm = 4.0;
    let light = bregma_renderer::Light { ambient: 1.0, diffuse: 0.0, specular: 0.0, ..Default::default() };
    let scene = Scene { mode: Mode::Depths, depths_within_mm: Some(range_mm), light, ..opened.scene.clone() };
    let renderers: [Box<dyn Renderer>; 2] =
        [Box::new(CpuRenderer::default()), Box::new(GpuRenderer::new(true).expect("a software Vulkan driver is installed by tests/run"))];
    for mut renderer in renderers {
        let mut draw = |scene: &Scene| renderer.render(&opened.volumes, scene, 300, 300).unwrap();
        let picture = draw(&scene);
        let alone = [0, 1].map(|n| {
            let mut scene = Scene { mode: Mode::Iso, ..scene.clone() };
            scene.layers[1 - n].visible = false;
            draw(&scene)
        });
        let (mut both, mut one, mut beyond) = (0, 0, 0);
        for (n, pixel) in picture.rgba.iter().enumerate() {
            let [a, b] = [&alone[0], &alone[1]].map(|alone| alone.depth_mm[n]);
            let expected = if a.is_finite() && b.is_finite() {
                (both, beyond) = (both + 1, beyond + usize::from((a - b).abs() > range_mm as f32));
                // The farther the first lies behind the second, the more the second stands out.
                let difference = ((a - b) / range_mm as f32).clamp(-1.0, 1.0);
                let end = if difference > 0.0 { high } else { low };
                let color = [0, 1, 2].map(|c| middle[c] + (end[c] - middle[c]) * difference.abs());
                [color[0], color[1], color[2], 1.0].map(|c: f32| (255.0 * c).round() as u8)
            } else if let Some(seen) = alone.iter().find(|alone| alone.depth_mm[n].is_finite()) {
                one += 1;
                seen.rgba[n]
            } else {
                continue;
            };
            assert!(color_difference(*pixel, expected) <= 1, "pixel {n}: {a} and {b} mm are {pixel:?} instead of {expected:?}");
        }
        println!("{}: {both} pixels with both surfaces, {beyond} of them beyond the range, {one} with one", renderer.name());
        assert!(both > 10_000 && beyond > 500 && one > 200);
    }
}
