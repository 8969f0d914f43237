//! The picture of a map by both renderers.

use super::*;
use bregma_field::Progress;
use bregma_renderer::{CpuRenderer, GpuRenderer, Picture, Renderer};
use bregma_session::coat::Coat;
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
