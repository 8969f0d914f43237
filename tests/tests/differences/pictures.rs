//! The picture of a map by both renderers.

use super::*;
use bregma_field::Progress;
use bregma_renderer::{CpuRenderer, GpuRenderer, Picture, Renderer, view_of_plane};
use bregma_session::coat::{Coat, on_slice};
use bregma_session::difference::measure;
use bregma_session::difference_picture::{DifferenceCoat, Scale};
use bregma_session::{DifferenceOrder, Opened};
use bregma_tests::color_difference;

#[test]
fn both_backends_paint_a_map_alike() {
    // Fails if a backend's depths put pixels into other cells, or hatching and lines hang on what backends differ by.
    let opened = Opened::demo(96, &Progress::default()).unwrap();
    let order = DifferenceOrder { pair: [0, 1], ..DifferenceOrder::default() };
    let measured = Arc::new(measure(&opened, &order, &Progress::default()).unwrap());
    let scale = Scale { range_mm: 2.0, grey_within_error: true, isolines_mm: None };
    let gpu = GpuRenderer::new(true).expect("a software Vulkan driver is installed by tests/run");
    let mut renderers: [Box<dyn Renderer>; 2] = [Box::new(CpuRenderer::default()), Box::new(gpu)];
    let (mut far, mut seen) = (0, 0);
    for on in 0..2 {
        let coat = DifferenceCoat { measured: Arc::clone(&measured), on, scale };
        let scene = coat.scene(&opened.scene);
        let pictures: Vec<Picture> = renderers
            .iter_mut()
            .map(|renderer| {
                let mut picture = renderer.render(&opened.volumes, &scene, 500, 500).unwrap();
                coat.paint(&mut picture, &scene, [0.0; 2]);
                picture
            })
            .collect();
        let colored = |p: &[u8; 4]| p[0].abs_diff(p[2]) > 60;
        assert!(pictures[0].rgba.iter().filter(|p| colored(p)).count() > 2_000, "the jaw that was moved is coloured");
        seen += pictures[0].volume_id.iter().filter(|id| **id != 0).count();
        far += pictures[0].rgba.iter().zip(&pictures[1].rgba).filter(|(a, b)| color_difference(**a, **b) > 2).count();
    }
    println!("{far} of {seen} pixels beyond 2/255");
    assert!(far * 10_000 <= seen);
}

#[test]
fn contours_in_slices_wear_the_map() {
    // Fails if a slice's contour has other colours than the surface, another scan's contour gets them, or lines lie beside what they colour.
    let opened = Opened::demo(96, &Progress::default()).unwrap();
    let order = DifferenceOrder { pair: [0, 1], ..DifferenceOrder::default() };
    let measured = Arc::new(measure(&opened, &order, &Progress::default()).unwrap());
    let scale = Scale { range_mm: 2.0, grey_within_error: true, isolines_mm: None };
    let coat = DifferenceCoat { measured, on: 0, scale };
    // Through the jaw that was moved.
    let axes = [DVec3::NEG_Z, DVec3::Y];
    let camera = view_of_plane(axes, DVec3::new(0.0, -20.0, -105.0), &opened.grids(), 1.0);
    let scene = opened.slices.scene(&opened.scene, camera);
    let plain = CpuRenderer::default().render(&opened.volumes, &scene, 600, 600).unwrap();
    let mut worn = plain.clone();
    on_slice(&coat, 0, &mut worn, &scene);
    let pixel = |picture: &Picture, x: f32, y: f32| picture.rgba[y.round() as usize * 600 + x.round() as usize];
    let (mut right, mut all, mut vivid) = (0, 0, 0);
    for [x0, y0, x1, y1] in &plain.contours.iter().find(|c| c.volume_id == 1).unwrap().segments {
        let (x, y) = (0.5 * (x0 + x1), 0.5 * (y0 + y1));
        let ray = scene.camera.ray(f64::from(x), f64::from(y), 600, 600);
        let point = ray.at((scene.camera.target_mm - ray.origin.0).dot(ray.direction));
        let Some(color) = coat.color_at(point) else { continue };
        let seen = pixel(&worn, x, y);
        all += 1;
        right += usize::from(color_difference([color[0], color[1], color[2], 255], seen) <= 12);
        vivid += usize::from(color[0].abs_diff(color[2]) > 60);
    }
    println!("{right} of {all} places of the contour in the map's colour, {vivid} of them vivid");
    assert!(all > 500 && vivid > 100 && right as f64 > 0.9 * all as f64);
    // Far from the first scan's contour nothing has changed, the second's contour included.
    let near = |n: usize| {
        let (x, y) = ((n % 600) as f32, (n / 600) as f32);
        plain.contours[0].segments.iter().any(|s| (s[0] - x).abs() < 4.0 && (s[1] - y).abs() < 4.0)
    };
    let changed = (0..plain.rgba.len()).filter(|n| plain.rgba[*n] != worn.rgba[*n]);
    assert!(changed.into_iter().all(near));
}
