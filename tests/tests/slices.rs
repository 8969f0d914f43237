//! Slices against the float64 field: values, contours, thick slices, lines.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use bregma_field::interpolant::depth_at;
use bregma_field::{Surface, WorldPoint};
use bregma_renderer::{
    BodyPlane, Camera, CpuRenderer, CutFace, GpuRenderer, Mode, Named, Picture, Projection, Renderer, Scene, Slab, view_of_plane,
};
use bregma_tests::{Random, volume};
use bregma_volume::{Grid, Samples, Volume};
use glam::{DAffine3, DMat3, DVec3};
use std::sync::Arc;

const SIZE: [u32; 2] = [150, 110];

fn renderers() -> [Box<dyn Renderer>; 2] {
    [Box::new(CpuRenderer::default()), Box::new(GpuRenderer::new(true).expect("a software Vulkan driver is installed by tests/run"))]
}

/// Noise of a few voxels' size, so that contours are many, curved, and meet in saddles.
fn noise(seed: u64, grid: Grid, make: impl Fn(Vec<f64>) -> Samples) -> Arc<Volume> {
    let mut random = Random(seed);
    let waves: Vec<(DVec3, f64)> =
        (0..12).map(|_| (DVec3::from_array([0; 3].map(|_| 1.6 * random.unit() - 0.8)), 6.0 * random.unit())).collect();
    let [nx, ny, nz] = grid.dims();
    let at = |n: usize| {
        let p = DVec3::new((n % nx) as f64, (n / nx % ny) as f64, (n / (nx * ny)) as f64);
        waves.iter().map(|(k, phase)| (k.dot(p) + phase).sin()).sum::<f64>() / 24.0 + 0.5
    };
    let samples = make((0..nx * ny * nz).map(|n| (at(n) + 0.1 * random.unit()).clamp(0.0, 1.0)).collect());
    volume("noise", grid, samples)
}

/// Volumes of every sample type on grids of any shape, each with a registration.
fn volumes() -> Vec<(Arc<Volume>, DAffine3)> {
    let shear = DMat3::from_cols(DVec3::X, DVec3::new(0.2, 0.9, 0.0), DVec3::new(0.0, -0.32, 0.95));
    let moved = DAffine3::from_axis_angle(DVec3::new(1.0, 2.0, -1.0).normalize(), 0.4);
    let cube = Grid::new([31, 29, 33], DVec3::splat(0.9), DVec3::new(-14.0, -13.0, -12.0), DMat3::IDENTITY).unwrap();
    let flat = Grid::new([41, 37, 9], DVec3::new(0.6, 0.7, 3.0), DVec3::new(-12.0, -11.0, -12.0), DMat3::IDENTITY).unwrap();
    let sheared = Grid::new([30, 34, 25], DVec3::new(0.8, 0.7, 1.1), DVec3::new(-12.0, -12.0, -11.0), shear).unwrap();
    let far = Grid::new([30, 31, 32], DVec3::splat(0.8), DVec3::new(9.0, -12.0, 10.0), DMat3::from_diagonal(DVec3::new(-1.0, 1.0, -1.0)));
    vec![
        (noise(1, cube, |s| Samples::U8(s.iter().map(|v| (v * 255.0) as u8).collect())), DAffine3::IDENTITY),
        (noise(2, flat, |s| Samples::I16(s.iter().map(|v| (v * 4000.0 - 1000.0) as i16).collect())), moved),
        (noise(3, sheared, |s| Samples::U16(s.iter().map(|v| (v * 60_000.0) as u16).collect())), DAffine3::IDENTITY),
        (noise(4, far.unwrap(), |s| Samples::F32(s.iter().map(|v| *v as f32 * 1e-3).collect())), moved),
    ]
}

/// The scene of one volume on a plane, in pixels smaller than its voxels.
fn scene(volume: &Arc<Volume>, transform: DAffine3, random: &mut Random) -> Scene {
    let mut scene = Scene::of(std::slice::from_ref(volume));
    let [low, high] = volume.range();
    (scene.layers[0].iso, scene.layers[0].transform) = (low + (high - low) * (0.4 + 0.2 * random.unit()), transform);
    let forward = DVec3::from_array([0; 3].map(|_| 2.0 * random.unit() - 1.0)).normalize();
    let target_mm = DVec3::from_array([0; 3].map(|_| 4.0 * random.unit() - 2.0));
    let projection = Projection::Orthographic { height_mm: 12.0 + 8.0 * random.unit() };
    scene.camera = Camera { eye_mm: target_mm - 30.0 * forward, target_mm, up: DVec3::new(0.1, 0.3, 1.0), projection };
    scene.mode = Mode::Slice;
    scene
}

/// How far inside the surface the plane is at a pixel, in sample units, by the float64 field.
fn truth(scene: &Scene, volume: &Arc<Volume>) -> impl Fn(f64, f64) -> Option<f64> {
    let surface = Surface::new(volume, scene.layers[0].iso, scene.layers[0].transform).unwrap();
    let camera = scene.viewed_from();
    let depth = (camera.target_mm - camera.eye_mm).dot(camera.basis().forward);
    move |x, y| {
        let ray = camera.ray(x, y, SIZE[0], SIZE[1]);
        depth_at(&surface, WorldPoint(ray.origin.0 + depth * ray.direction)).map(|(inside, _)| inside)
    }
}

/// Ends of contours on the ways between nodes: the node, 0 for the way to the right and 1 for the one down, and the share of it.
fn ends(picture: &Picture) -> Vec<([i64; 2], usize, f64)> {
    let segments = picture.contours.iter().flat_map(|contour| &contour.segments);
    let ends = segments.flat_map(|&[x0, y0, x1, y1]| [[x0, y0], [x1, y1]]);
    let of = |[x, y]: [f32; 2]| {
        let [x, y] = [f64::from(x), f64::from(y)];
        // One of the two is a node's own, but for float32's rounding.
        if (y - y.round()).abs() < 1e-4 && (x - x.round()).abs() >= 1e-4 || (y - y.round()).abs() < (x - x.round()).abs() {
            ([x.floor() as i64, y.round() as i64], 0, x - x.floor())
        } else {
            ([x.round() as i64, y.floor() as i64], 1, y - y.floor())
        }
    };
    ends.map(of).collect()
}

#[test]
fn values_and_contours_are_those_of_the_float64_field() {
    // Fails if a plane lies elsewhere, a cell's corner is another's, a crossing is missed or lies beside the surface: on both renderers, for
    // every sample type, on sheared, mirrored and flat voxels, registered.
    let mut renderers = renderers();
    let mut random = Random(5);
    let (mut worst_value, mut worst_pixel, mut crossings) = (0.0_f64, 0.0_f64, 0);
    for (volume, transform) in volumes() {
        let [low, high] = volume.range();
        for _ in 0..3 {
            let scene = scene(&volume, transform, &mut random);
            let truth = truth(&scene, &volume);
            let at = |x: i64, y: i64| truth(x as f64, y as f64);
            for renderer in &mut renderers {
                let picture = renderer.render(std::slice::from_ref(&volume), &scene, SIZE[0], SIZE[1]).unwrap();
                let found = ends(&picture);
                for y in 0..i64::from(SIZE[1]) {
                    for x in 0..i64::from(SIZE[0]) {
                        let value = f64::from(picture.values[(y * i64::from(SIZE[0]) + x) as usize]);
                        let Some(inside) = at(x, y) else { continue };
                        let expected = scene.layers[0].iso + volume.slope() * inside;
                        // On the box's own face one may see it and the other not.
                        if !value.is_nan() {
                            worst_value = worst_value.max((value - expected).abs() / (high - low));
                        } else {
                            assert!(at(x - 1, y).and(at(x + 1, y)).and(at(x, y - 1)).and(at(x, y + 1)).is_none(), "no value at {x} {y}");
                        }
                    }
                }
                for (node, axis, share) in &found {
                    let mut end = [node[0] as f64, node[1] as f64];
                    end[*axis] += share;
                    // The nearest change of sides around it along a row or a column, by steps of a 20,000th of a pixel.
                    let changes = |d: f64| {
                        let beside = |dx: f64, dy: f64| truth(end[0] + dx, end[1] + dy).map(|v| v >= 0.0);
                        beside(d, 0.0) != beside(-d, 0.0) || beside(0.0, d) != beside(0.0, -d)
                    };
                    let away = (1..=60).map(|n| f64::from(n) * 5e-5).find(|d| changes(*d));
                    worst_pixel =
                        worst_pixel.max(away.unwrap_or_else(|| panic!("{end:?} lies beside the surface: {:?}", truth(end[0], end[1]))));
                }
                // None is missed, and none is made up.
                for y in 0..i64::from(SIZE[1]) - 1 {
                    for x in 0..i64::from(SIZE[0]) - 1 {
                        let corners = [[x, y], [x + 1, y], [x, y + 1], [x + 1, y + 1]].map(|[x, y]| at(x, y));
                        let ([Some(here), Some(right), Some(_), Some(_)], true) = (corners, x > 0 && y > 0) else { continue };
                        // A sample that is the isovalue itself, or nearly, lies on either side for float32.
                        let clear = |v: f64| v.abs() > 1e-5 * (high - low) / volume.slope().abs();
                        if clear(here) && clear(right) {
                            let is_crossed = (here >= 0.0) != (right >= 0.0);
                            let has_end = found.iter().any(|(node, axis, _)| *node == [x, y] && *axis == 0);
                            assert!(!is_crossed || has_end, "the way from {x} {y} is crossed, and no contour says so");
                            crossings += usize::from(is_crossed);
                        }
                    }
                }
            }
        }
    }
    println!("{crossings} crossings: {worst_pixel:e} pixel off at most; values {worst_value:e} of the range");
    assert!(crossings > 3000 && worst_pixel <= 1e-3 && worst_value <= 1e-6, "{worst_pixel} pixel, {worst_value}");
}

#[test]
fn a_scan_that_another_hides_keeps_its_contours_and_where_it_is_not_hidden_its_values() {
    // Fails if bricks that hold the contour are passed over, a side is the other one, an end far from the contour has no value, or a value is missing
    // beside the first scan; or if a picture shows what lay in its memory before.
    let ball = |side: usize, radius: f64, seed: u64| {
        let mut random = Random(seed);
        let middle = (side - 1) as f64 / 2.0;
        let at = |n: usize| DVec3::new((n % side) as f64, (n / side % side) as f64, (n / side / side) as f64) - middle;
        let samples = (0..side.pow(3)).map(|n| (1000.0 * (radius - at(n).length()) + 300.0 * random.unit()) as i16).collect();
        let grid = Grid::new([side; 3], DVec3::ONE, DVec3::splat(-middle), DMat3::IDENTITY).unwrap();
        volume("ball", grid, Samples::I16(samples))
    };
    let volumes = [ball(41, 9.0, 1), ball(60, 21.0, 2)];
    let mut random = Random(3);
    let mut segments = 0;
    for n in 0..24 {
        let mut both = Scene::of(&volumes);
        both.layers.iter_mut().for_each(|layer| layer.iso = 120.0);
        both.layers[1].transform = DAffine3::from_axis_angle(DVec3::new(1.0, 2.0, -1.0).normalize(), random.unit());
        let forward = DVec3::from_array([0; 3].map(|_| 2.0 * random.unit() - 1.0)).normalize();
        let target_mm = DVec3::from_array([0; 3].map(|_| 8.0 * random.unit() - 4.0));
        let projection = Projection::Orthographic { height_mm: 90.0 };
        both.camera = Camera { eye_mm: target_mm - 60.0 * forward, target_mm, up: DVec3::new(0.1, 0.3, 1.0), projection };
        both.mode = Mode::Slice;
        both.slice.thickness_mm = [0.0, 3.0][n / 12];
        // Nodes closer than samples, several to a pixel, and farther apart than bricks are long.
        let [width, height] = [[150, 110], [40, 30], [2, 1]][n % 3];
        let mut alone = both.clone();
        alone.layers[0].visible = false;
        let mut renderer = CpuRenderer::default();
        let [both, alone, once_more] = [&both, &alone, &both].map(|scene| {
            let picture = renderer.render(&volumes, scene, width, height).unwrap();
            renderer.reuse(picture.clone());
            picture
        });
        assert_eq!(both.contours[1], alone.contours[0], "{n}");
        for at in 0..both.rgba.len() {
            let is_hidden = both.volume_id[at] == 1;
            assert!(is_hidden || both.values[at].to_bits() == alone.values[at].to_bits(), "{n}: pixel {at}");
            assert_eq!(both.values[at].to_bits(), once_more.values[at].to_bits());
            assert_eq!(both.depth_mm[at].to_bits(), once_more.depth_mm[at].to_bits());
        }
        assert!(both.rgba == once_more.rgba && both.volume_id == once_more.volume_id && both.contours == once_more.contours);
        segments += alone.contours[0].segments.len();
    }
    println!("{segments} segments of hidden contours");
    assert!(segments > 3000, "{segments}");
}

#[test]
fn a_wall_thinner_than_a_pixel_keeps_its_contour() {
    // Fails if pixels larger than voxels look at one point each: a wall of one voxel would come and go.
    let grid = Grid::new([200, 200, 5], DVec3::ONE, DVec3::new(-99.5, -99.5, -2.0), DMat3::IDENTITY).unwrap();
    // The wall stands in x at 80.3 mm, a slant of 1 in 10 along y.
    let inside = |i: usize, j: usize| (i as f64 - 80.3 - 0.1 * j as f64).abs() <= 1.0;
    let samples = (0..200 * 200 * 5).map(|n| 100 * u8::from(inside(n % 200, n / 200 % 200))).collect();
    let volumes = [volume("wall", grid, Samples::U8(samples))];
    let mut scene = Scene::of(&volumes);
    (scene.mode, scene.layers[0].iso) = (Mode::Slice, 50.0);
    // 180 mm on 45 pixels: 4 voxels a pixel.
    scene.camera = Camera {
        projection: Projection::Orthographic { height_mm: 180.0 },
        ..view_of_plane(BodyPlane::Axial.axes(), DVec3::ZERO, &[], 1.0)
    };
    for mut renderer in renderers() {
        let picture = renderer.render(&volumes, &scene, 45, 45).unwrap();
        let length: f32 = picture.contours[0].segments.iter().map(|[x0, y0, x1, y1]| (x1 - x0).hypot(y1 - y0)).sum();
        println!("{}: contours of {length} pixels; two sides of 45 rows each have 90", renderer.name());
        assert!((85.0..110.0).contains(&length), "{length}");
        let drawn = (0..45).filter(|y| (0..45).any(|x| picture.rgba[y * 45 + x][2] < picture.rgba[y * 45 + x][0])).count();
        assert!(drawn >= 44, "the line is seen in {drawn} of 45 rows");
    }
}

#[test]
fn thick_slices_are_the_means_and_extremes_of_their_thickness() {
    // Fails if the thickness lies on one side of the plane, or an extreme or a mean is not that of all between.
    let mut renderers = renderers();
    let mut random = Random(7);
    let mut worst = 0.0_f64;
    for (volume, transform) in volumes() {
        let [low, high] = volume.range();
        for &slab in Slab::ALL {
            let mut scene = scene(&volume, transform, &mut random);
            (scene.slice.thickness_mm, scene.slice.slab) = (2.5, slab);
            let surface = Surface::new(&volume, scene.layers[0].iso, transform).unwrap();
            let camera = scene.viewed_from();
            let plane = (camera.target_mm - camera.eye_mm).dot(camera.basis().forward);
            for renderer in &mut renderers {
                let picture = renderer.render(std::slice::from_ref(&volume), &scene, SIZE[0], SIZE[1]).unwrap();
                for _ in 0..150 {
                    let [x, y] = SIZE.map(|n| (random.unit() * f64::from(n)) as u32);
                    let ray = camera.ray(f64::from(x), f64::from(y), SIZE[0], SIZE[1]);
                    const POINTS: usize = 4000;
                    let points = (0..POINTS).map(|n| plane + 2.5 * ((n as f64 + 0.5) / POINTS as f64 - 0.5));
                    let values: Option<Vec<f64>> = points
                        .map(|t| depth_at(&surface, ray.at(t)).map(|(inside, _)| scene.layers[0].iso + volume.slope() * inside))
                        .collect();
                    // At the scan's border a part of it counts; that is tested by projections.
                    let Some(values) = values else { continue };
                    let expected = match slab {
                        Slab::Mean => values.iter().sum::<f64>() / POINTS as f64,
                        Slab::Max => values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
                        Slab::Min => values.iter().copied().fold(f64::INFINITY, f64::min),
                    };
                    let found = f64::from(picture.values[(y * SIZE[0] + x) as usize]);
                    worst = worst.max((found - expected).abs() / (high - low));
                }
            }
        }
    }
    println!("thick slices are off by {worst:e} of the range at most, where 4,000 points are compared with");
    assert!(worst < 1e-3, "{worst}");
}

#[test]
fn lines_are_as_wide_as_they_are_said_to_be() {
    // Fails if a line grows thin or fat at a slant, or at the border between two rows of blocks.
    let grid = Grid::new([60, 60, 3], DVec3::ONE, DVec3::new(-29.5, -29.5, -1.0), DMat3::IDENTITY).unwrap();
    for slant in [0.0, 0.3, 1.0, 2.2] {
        let ramp = |n: usize| (100.0 + 2.0 * ((n % 60) as f64 - 29.5 + slant * ((n / 60 % 60) as f64 - 29.5))) as f32;
        let volumes = [volume("ramp", grid.clone(), Samples::F32((0..60 * 60 * 3).map(ramp).collect()))];
        let mut scene = Scene::of(&volumes);
        (scene.mode, scene.layers[0].iso, scene.slice.face) = (Mode::Slice, 100.0, CutFace::Bone);
        scene.layers[0].color = bregma_renderer::Color([0.0; 3]);
        scene.background = None;
        let view = view_of_plane(BodyPlane::Axial.axes(), DVec3::ZERO, &[], 1.0);
        scene.camera = Camera { projection: Projection::Orthographic { height_mm: 20.0 }, ..view };
        for width in [1.0_f32, 1.5, 3.0] {
            scene.slice.contour_px = width;
            let [on, off] = [width, 0.0].map(|px| {
                scene.slice.contour_px = px;
                CpuRenderer::default().render(&volumes, &scene, 120, 120).unwrap()
            });
            // Over nothing alpha says by how much a pixel is covered, and over black bone the line's red light does.
            let red = |pixel: &[u8; 4]| f64::from(bregma_renderer::Color([f32::from(pixel[0]) / 255.0; 3]).linear().x);
            let full = on.rgba.iter().map(red).fold(0.0, f64::max);
            let cover = |(on, off): (&[u8; 4], &[u8; 4])| if off[3] == 0 { f64::from(on[3]) / 255.0 } else { red(on) / full };
            let covered: f64 = on.rgba.iter().zip(&off.rgba).map(cover).sum();
            let length: f32 = on.contours[0].segments.iter().map(|[x0, y0, x1, y1]| (x1 - x0).hypot(y1 - y0)).sum();
            let across = covered / f64::from(length);
            println!("slant {slant}, {width} wide: {across:.3}");
            // On the diagonal middles of pixels lie √½ apart across the line: its edges' ramps are met at few places.
            assert!((across - f64::from(width)).abs() < if slant == 1.0 { 0.15 } else { 0.05 }, "{across}");
        }
    }
}
