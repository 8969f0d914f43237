//! Cuts where the answer is known: what is left, what casts a shadow, and what their faces show.

use super::*;

#[test]
fn a_cut_shell_shows_two_circles_and_only_where_it_is_cut() {
    // Fails if a cap is missing, lies elsewhere, or a cut reaches another volume, the shadows, a pick or the probe.
    let (outer, inner) = (30.0, 22.0);
    let shell = shells(81, 1.0, |p| (outer - p.length()).min(p.length() - inner));
    let other = ball(81, 1.0, 12.0, DVec3::new(5.0, 0.0, 0.0));
    let volumes = [shell, other];
    let mut scene = scene_of(&volumes, Mode::Iso);
    scene.layers.iter_mut().for_each(|l| l.iso = 0.0);
    // From above, parallel: the plane z = 3.2 is seen as it is.
    let height_mm = 80.0;
    scene.camera = Camera {
        eye_mm: DVec3::new(0.0, 0.0, 200.0),
        target_mm: DVec3::ZERO,
        up: DVec3::Y,
        projection: Projection::Orthographic { height_mm },
    };
    let plane_mm = 3.2;
    let plane = Clip { layers: Some(vec![0]), ..Clip::all(Shape::Plane { normal: DVec3::Z, offset_mm: plane_mm }) };
    scene.clips = vec![plane];
    let size = 800;
    let px_per_mm = f64::from(size) / height_mm;
    let alone = {
        let mut scene = scene.clone();
        scene.layers[0].visible = false;
        CpuRenderer::default().render(&volumes, &scene, size, size).unwrap()
    };
    for renderer in [&mut CpuRenderer::default() as &mut dyn Renderer, &mut gpu()] {
        let picture = renderer.render(&volumes, &Scene { shadows: true, ..scene.clone() }, size, size).unwrap();
        // What lies at the plane is the section of the shell.
        let at_plane = |n: &usize| picture.volume_id[*n] == 1 && (f64::from(picture.depth_mm[*n]) - (200.0 - plane_mm)).abs() < 1e-3;
        let middle = (f64::from(size) - 1.0) / 2.0;
        let distance = |n: usize| DVec3::new((n % size as usize) as f64 - middle, (n / size as usize) as f64 - middle, 0.0).length();
        let all: Vec<usize> = (0..picture.rgba.len()).collect();
        // Areas average over a circle's pixels: that of the disc within the middle of the ring that is no section, and that of all within.
        let ring_middle = 26.0 * px_per_mm;
        let area_inner = all.iter().filter(|n| distance(**n) < ring_middle && !at_plane(n)).count() as f64;
        let area_outer = all.iter().filter(|n| distance(**n) < ring_middle).count() as f64
            + all.iter().filter(|n| distance(**n) >= ring_middle && at_plane(n)).count() as f64;
        let radius = |area: f64| (area / std::f64::consts::PI).sqrt();
        let expected = [inner, outer].map(|r: f64| (r * r - plane_mm * plane_mm).sqrt() * px_per_mm);
        // The interpolant's own radius: where it passes 0 along the plane, averaged over directions.
        let own = |near: f64| {
            let mean = (0..720).map(|n| {
                let angle = f64::from(n) * std::f64::consts::TAU / 720.0;
                let direction = DVec3::new(angle.cos(), angle.sin(), 0.0);
                let origin = WorldPoint(DVec3::new(0.0, 0.0, plane_mm));
                let layers = &scene.layers[..1];
                let found = bregma_measure::probe(&volumes[..1], layers, &Ray::new(origin, direction).unwrap()).unwrap();
                let crossings = &found.volumes[0].crossings;
                crossings.iter().map(|c| c.t_mm).min_by(|a, b| (a - near).abs().total_cmp(&(b - near).abs())).unwrap().powi(2)
            });
            (mean.sum::<f64>() / 720.0).sqrt() * px_per_mm
        };
        let found = [radius(area_inner), radius(area_outer)];
        let off = [0, 1].map(|n| (found[n] - own(expected[n] / px_per_mm)).abs());
        println!("{}: circles of {:.3} and {:.3} px, off by {:.3} and {:.3}", renderer.name(), found[0], found[1], off[0], off[1]);
        assert!(off.iter().all(|o| *o < 0.1), "{found:?} instead of {expected:?}");
        // The ball, in the opening, is drawn as if it were alone.
        let in_ball: Vec<usize> = all.iter().copied().filter(|&n| alone.volume_id[n] == 2).collect();
        let unlit_scene = renderer.render(&volumes, &scene, size, size).unwrap();
        assert!(in_ball.len() > 10_000 && in_ball.iter().all(|&n| unlit_scene.volume_id[n] == 2));
        assert!(in_ball.iter().all(|&n| color_difference(unlit_scene.rgba[n], alone.rgba[n]) <= 2), "a cut through A changes B");
    }
    // The half that is cut away casts no shadow: in the light of the camera's own shoulder the section lies in full light.
    let lamp = Light { toward: Vec3::new(0.0, 0.3, 1.0), ..scene.light };
    let lit = Scene { shadows: true, light: lamp, ..scene.clone() };
    let (with, without) = (
        CpuRenderer::default().render(&volumes, &lit, 200, 200).unwrap(),
        CpuRenderer::default().render(&volumes, &Scene { shadows: false, ..lit.clone() }, 200, 200).unwrap(),
    );
    let section: Vec<usize> = (0..with.rgba.len()).filter(|&n| (f64::from(with.depth_mm[n]) - (200.0 - plane_mm)).abs() < 1e-3).collect();
    assert!(section.len() > 3000 && section.iter().all(|&n| with.rgba[n] == without.rgba[n]), "what is cut away casts a shadow");
    // Pick and probe: a ray from above meets the shell at the plane, and the ball as ever.
    let down = Ray::new(WorldPoint(DVec3::new(0.0, -26.0, 200.0)), -DVec3::Z).unwrap();
    let (_, surface) = scene.surfaces(&volumes).unwrap().remove(0);
    let hit = bregma_field::crossings::first_entry(&surface, &down).unwrap();
    assert!((hit.t_mm - (200.0 - plane_mm)).abs() < 1e-9 && hit.clipped && hit.normal.abs_diff_eq(DVec3::Z, 1e-9));
    let probed = probe_cut(&volumes, &scene.layers, &scene.clips, &down).unwrap();
    let first = &probed.volumes[0].segments[0];
    assert!(first.clipped && (first.from_mm - (200.0 - plane_mm)).abs() < 1e-9);
    let whole = bregma_measure::probe(&volumes, &scene.layers, &down).unwrap();
    assert!(whole.volumes[0].segments[0].from_mm < first.from_mm && whole.volumes[1].segments == probed.volumes[1].segments);
}

#[test]
fn a_cuts_face_is_the_same_in_every_mode_where_something_is_visible() {
    // Fails if a face leaves out a volume that it cuts, stands where nothing is visible, or lets through what lies behind.
    let volumes = [rough(4), rough(9)];
    let plane = Clip::all(Shape::Plane { normal: DVec3::new(0.0, -1.0, 0.0), offset_mm: 2.0 });
    let mut scene = Scene { clips: vec![plane], ..scene_of(&volumes, Mode::Iso) };
    scene.layers.iter_mut().for_each(|l| (l.iso, l.opacity) = (60.0, 0.5));
    for cut_face in [CutFace::Density, CutFace::Blend, CutFace::Difference, CutFace::Transfer] {
        scene.cut_face = cut_face;
        for renderer in [&mut CpuRenderer::default() as &mut dyn Renderer, &mut gpu()] {
            let mut draw = |scene: Scene| renderer.render(&volumes, &scene, 120, 100).unwrap();
            let all = draw(Scene { mode: Mode::Iso, ..scene.clone() });
            for through in [Scene { mode: Mode::Transparent, ..scene.clone() }, Scene { mode: Mode::Dvr, ..scene.clone() }] {
                let picture = draw(through.clone());
                let lowest = |n: usize| match through.mode {
                    Mode::Dvr => through.layers[n].controls(&volumes[n]).iter().map(|c| c.value).fold(f64::INFINITY, f64::min),
                    _ => through.layers[n].iso,
                };
                let (mut same, mut beside) = (0, 0);
                for n in 0..picture.rgba.len() {
                    let ray = scene.camera.ray((n % 120) as f64, (n / 120) as f64, 120, 100);
                    let p = ray.origin.0 + ray.direction * ((-2.0 - ray.origin.0.y) / ray.direction.y);
                    let above = |n: usize| interpolant(&volumes[n], DAffine3::IDENTITY, p).map_or(f64::NEG_INFINITY, |v| v.0 - lowest(n));
                    let most = above(0).max(above(1));
                    // The density is that of the first volume that is visible.
                    let only_nearest = matches!(cut_face, CutFace::Density | CutFace::Transfer);
                    if (if only_nearest { above(0) } else { most }) > 0.01 {
                        same += 1;
                        assert!(color_difference(picture.rgba[n], all.rgba[n]) <= 1, "{cut_face:?} {:?} pixel {n}", through.mode);
                    } else if most < -0.01 && all.depth_mm[n].is_finite() {
                        // What is seen lies behind the plane, or nothing does.
                        let depth_mm = picture.depth_mm[n];
                        beside += usize::from(depth_mm.is_nan() || depth_mm >= all.depth_mm[n] + 1e-3);
                    }
                }
                assert!(same > 500 && beside > 100, "{cut_face:?} {:?}: {same} {beside}", through.mode);
            }
        }
    }
}

#[test]
fn a_cuts_face_by_transfer_function_has_its_colours() {
    // Fails if a face takes another volume's colours, or those of another value.
    let volumes = [rough(4)];
    let plane = Clip::all(Shape::Plane { normal: DVec3::new(0.0, -1.0, 0.0), offset_mm: 2.0 });
    let mut scene = Scene { clips: vec![plane], cut_face: CutFace::Transfer, ..scene_of(&volumes, Mode::Iso) };
    scene.layers[0].transfer = Some(TransferFunction {
        name: "red to blue".into(),
        values: Values::Scan,
        overall: 1.0,
        over_mm: Some(1.0),
        points: vec![
            Point { value: 0.0, color: Color([1.0, 0.0, 0.0]), opacity: 0.0 },
            Point { value: 150.0, color: Color([0.0, 0.0, 1.0]), opacity: 0.9 },
        ],
        gradient: vec![],
    });
    for renderer in [&mut CpuRenderer::default() as &mut dyn Renderer, &mut gpu()] {
        let picture = renderer.render(&volumes, &scene, 120, 100).unwrap();
        let mut compared = 0;
        for n in (0..picture.rgba.len()).filter(|n| picture.volume_id[*n] > 0) {
            let ray = scene.camera.ray((n % 120) as f64, (n / 120) as f64, 120, 100);
            let p = ray.origin.0 + ray.direction * ((-2.0 - ray.origin.0.y) / ray.direction.y);
            let Some((value, _)) = interpolant(&volumes[0], DAffine3::IDENTITY, p) else { continue };
            // By the definition: colour as light and extinction are linear in the value.
            let part = (value / 150.0).clamp(0.0, 1.0);
            let opacity = 1.0 - (1.0 - 0.9_f64).powf(part);
            let expected = Color::of_light(Vec3::new((1.0 - part) as f32, 0.0, part as f32) * opacity as f32).0.map(|c| (255.0 * c) as u8);
            let found = picture.rgba[n];
            let off = (0..3).map(|c| found[c].abs_diff(expected[c])).max().unwrap();
            assert!(off <= 3, "{value}: {found:?} instead of {expected:?}");
            compared += 1;
        }
        assert!(compared > 1000, "{compared}");
    }
}
