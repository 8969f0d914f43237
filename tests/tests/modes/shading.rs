//! By what surfaces are shaded, and samples that are drawn as they are.

use super::*;

#[test]
fn equal_samples_are_shaded_alike_on_both_backends() {
    // Fails if rounding makes a gradient where there is none: then a driver's noise shades the picture.
    let grid = Grid::new([12; 3], DVec3::ONE, DVec3::splat(-5.5), DMat3::IDENTITY).unwrap();
    let volumes = [volume("even", grid, Samples::I16(vec![100; 1728]))];
    let mut scene = scene_of(&volumes, Mode::Dvr);
    let transfer = TransferFunction { values: Values::Scan, overall: 1.0, over_mm: Some(10.0), ..TransferFunction::bone() };
    let point = |value: f64, opacity: f64| Point { value, color: Color([0.9, 0.6, 0.3]), opacity };
    scene.layers[0].transfer = Some(TransferFunction { points: vec![point(33.3, 0.0), point(77.7, 0.3)], ..transfer });
    let [a, b] = [&mut CpuRenderer::default() as &mut dyn Renderer, &mut gpu()].map(|r| r.render(&volumes, &scene, 80, 80).unwrap());
    let unlike = a.rgba.iter().zip(&b.rgba).filter(|(a, b)| color_difference(**a, **b) > 2).count();
    assert!(unlike == 0 && a.rgba.iter().any(|c| *c != a.rgba[0]), "{unlike} pixels differ");
}

#[test]
fn smooth_normals_are_central_differences() {
    // Fails if the gradient that shades smoothly is not what its name says. Central differences of the interpolant over a voxel to either side
    // of a point are the interpolated differences of the samples, so that these two are one method.
    let volumes = [rough(41)];
    let scene = scene_of(&volumes, Mode::Iso);
    let (_, surface) = scene.surfaces(&volumes).unwrap().remove(0);
    let mut compared = 0;
    for n in 0..60 * 60 {
        let ray = scene.camera.ray(f64::from(n % 60), f64::from(n / 60), 60, 60);
        let Some(hit) = bregma_field::crossings::first_entry(&surface, &ray) else { continue };
        let shading = bregma_field::interpolant::smooth_normal(&surface, hit.point).unwrap();
        let value = |o: DVec3| interpolant(&volumes[0], DAffine3::IDENTITY, volumes[0].grid().world(IndexPoint(hit.point.0 + o)).0);
        let differences = DVec3::AXES.map(|a| Some(value(a)?.0 - value(-a)?.0));
        if let [Some(x), Some(y), Some(z)] = differences {
            let central = surface.grid.world_to_index().matrix3.transpose() * -DVec3::new(x, y, z);
            assert!(central.normalize().abs_diff_eq(shading, 1e-6), "{central} is not {shading}");
            compared += 1;
        }
    }
    assert!(compared > 100, "{compared}");
}

#[test]
fn normals_against_the_phantoms_own() {
    // Fails if a shading gradient is turned, belongs to another point, or is not the same on both backends.
    let mut machines: Vec<Box<dyn Renderer>> = vec![Box::new(CpuRenderer::default()), Box::new(GpuRenderer::new(true).unwrap())];
    let points = bregma_session::chart::normals::measure(1, 256, &mut machines, &Progress::default()).unwrap();
    println!("{}", bregma_session::chart::normals::csv(&points));
    let (cpu, gpu) = points.split_at(points.len() / 2);
    for (a, b) in cpu.iter().zip(gpu) {
        assert!((a.half_deg - b.half_deg).abs() < 0.02 && a.name == b.name);
        assert!(a.pixels > 10_000 && a.half_deg < 7.0, "{a:?}");
    }
    assert!(cpu[1].half_deg < cpu[0].half_deg, "smooth normals are no better than the interpolant's own");
}

#[test]
fn samples_drawn_as_they_are_are_boxes() {
    // Fails if a sample's box is shifted by half a voxel, is larger or smaller than a voxel, or has no flat sides. One sample of a sheared grid's is
    // inside; the truth is the box in index space.
    let n = 9;
    let shear = DMat3::from_cols(DVec3::X, DVec3::new(0.2, 0.9, 0.0), DVec3::new(0.0, -0.3, 0.95));
    let grid = Grid::new([n, n, n], DVec3::new(1.0, 1.2, 0.8), DVec3::new(-4.0, -4.0, -3.0), shear).unwrap();
    let mut samples = vec![0_u8; n * n * n];
    samples[(4 * n + 3) * n + 5] = 200;
    let volumes = [volume("one sample", grid.clone(), Samples::U8(samples))];
    let mut scene = scene_of(&volumes, Mode::Iso);
    (scene.layers[0].iso, scene.reconstruction) = (100.0, bregma_renderer::Reconstruction::Nearest);
    let middle = grid.world(IndexPoint(DVec3::new(5.0, 3.0, 4.0))).0;
    let renderers: [Box<dyn Renderer>; 2] = [Box::new(CpuRenderer::default()), Box::new(gpu())];
    for mut renderer in renderers {
        let (mut hits, mut farthest) = (0, 0.0_f64);
        for direction in [DVec3::Y, DVec3::new(0.6, 0.7, -0.4), DVec3::new(-0.5, 0.3, 0.8)] {
            let eye_mm = middle - 30.0 * direction.normalize();
            scene.camera = Camera { eye_mm, target_mm: middle, up: DVec3::Z, projection: Projection::Orthographic { height_mm: 3.0 } };
            let picture = renderer.render(&volumes, &scene, 60, 60).unwrap();
            for (k, depth_mm) in picture.depth_mm.iter().enumerate() {
                let ray = scene.camera.ray((k % 60) as f64, (k / 60) as f64, 60, 60);
                let to_index = grid.world_to_index();
                let (p, d) =
                    (to_index.transform_point3(ray.origin.0) - DVec3::new(5.0, 3.0, 4.0), to_index.transform_vector3(ray.direction));
                let [a, b] = [-0.5, 0.5].map(|side| (DVec3::splat(side) - p) / d);
                let (near, far) = (a.min(b).max_element(), a.max(b).min_element());
                if (near - far).abs() < 1e-3 {
                    continue;
                }
                assert_eq!(depth_mm.is_finite(), near < far, "pixel {k} along {direction}");
                if near < far {
                    (hits, farthest) = (hits + 1, farthest.max((f64::from(*depth_mm) - near).abs()));
                }
            }
        }
        println!("{}: {hits} hits on a sample's box, at most {farthest:.1e} mm off", renderer.name());
        assert!(hits > 500 && farthest < 1e-4);
    }
}
