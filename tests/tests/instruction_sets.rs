//! Every set of vector instructions that the machine has: what is drawn does not depend on it.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use bregma_renderer::{Bounds, Camera, CpuRenderer, Mode, Picture, Projection, Renderer, Scene, Solver};
use bregma_session::Opened;
use bregma_tests::{Random, volume};
use bregma_volume::{Grid, Progress, Samples};
use glam::{DAffine3, DMat3, DVec3};

#[test]
fn every_set_of_vector_instructions_draws_the_same_picture_to_the_bit() {
    // Fails if an operation is fused, approximated or ordered otherwise in one of them.
    let mut renderers: Vec<CpuRenderer> = CpuRenderer::instruction_sets().into_iter().map(CpuRenderer::with_instructions).collect();
    println!("{}", renderers.iter().map(|r| r.name()).collect::<Vec<_>>().join("; "));
    if cfg!(target_arch = "x86_64") {
        assert!(renderers.len() > 1, "every x86-64 has SSE2 and something better");
    }
    let skulls = Opened::demo(96, &Progress::default()).unwrap();
    // Rough, cut by its box, on a sheared grid, with sides that are no multiples of a brick; seen from outside, from inside, and parallel.
    let mut random = Random(11);
    let dims = [45, 30, 23];
    let shear = DMat3::from_cols(DVec3::new(0.9, 0.1, 0.0), DVec3::new(0.2, 1.3, -0.1), DVec3::new(0.0, 0.3, 2.1));
    let grid = Grid::from_affine(dims, DAffine3::from_mat3_translation(shear, DVec3::new(5.0, -7.0, 11.0))).unwrap();
    let rough = vec![volume("rough", grid, Samples::F32((0..dims.iter().product()).map(|_| (random.unit() - 0.8) as f32).collect()))];
    let bounds = Bounds::of([rough[0].grid()]);
    let outside = Camera::orbit(&bounds, 30.0, 20.0);
    let cameras = [
        outside,
        Camera { eye_mm: bounds.centre_mm + DVec3::new(0.3, 0.2, 0.1), ..outside },
        Camera { projection: Projection::Orthographic { height_mm: 50.0 }, ..outside },
        Camera { eye_mm: bounds.centre_mm - 1e6 * DVec3::Y, projection: Projection::Perspective { fov_deg: 0.004 }, ..outside },
    ];
    let (mut pictures, mut hits) = (0, 0);
    for solver in Solver::ALL.into_iter().filter(|s| s.on_cpu()) {
        let overlay = Scene { solver, mode: Mode::Overlay, shadows: true, ..skulls.scene.clone() };
        let mut views = vec![(&skulls.volumes, overlay, 203, 157), (&skulls.volumes, Scene { solver, ..skulls.scene.clone() }, 64, 9)];
        for camera in cameras {
            let mut scene = Scene { solver, camera, ..Scene::of(&rough) };
            scene.layers[0].iso = 0.0;
            views.push((&rough, scene, 61, 90));
        }
        for (volumes, scene, width, height) in &views {
            let drawn: Vec<Picture> = renderers.iter_mut().map(|r| r.render(volumes, scene, *width, *height).unwrap()).collect();
            let bits = |p: &Picture| p.depth_mm.iter().map(|d| d.to_bits()).collect::<Vec<_>>();
            for (other, renderer) in drawn.iter().zip(&renderers).skip(1) {
                assert!(other.rgba == drawn[0].rgba && other.volume_id == drawn[0].volume_id, "{solver}: colours, {}", renderer.name());
                assert!(bits(other) == bits(&drawn[0]), "{solver}: depths, {}", renderer.name());
            }
            pictures += drawn.len();
            hits += drawn[0].volume_id.iter().filter(|id| **id > 0).count();
        }
    }
    println!("{pictures} pictures, {hits} hits in each set of them: equal to the bit");
    assert!(hits > 100_000);
}
