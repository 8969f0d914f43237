//! Ways of looking at a pair that tests and `tests/on-a-card` draw on both backends.

use bregma_renderer::{
    Clip, Color, CutFace, GradientPoint, Integrator, Mode, Named, Normals, Reconstruction, Scene, Shape, Shell, Slab, Slice,
    TransferFunction,
};
use glam::DVec3;

/// All that a picture of a mode can have of a pair, uncut and with kinds of cuts through the middle of its world, for both backends.
pub fn looks(pair: &Scene) -> Vec<(&'static str, Scene)> {
    let base = |mode| {
        let mut scene = Scene { mode, ..pair.clone() };
        scene.depth_cue = 0.3;
        scene
    };
    let plane = Clip::all(Shape::Plane { normal: DVec3::new(0.6, -0.8, 0.0), offset_mm: 3.0 });
    let first = Clip { layers: Some(vec![0]), ..Clip::all(Shape::Plane { normal: DVec3::new(0.0, -0.6, 0.8), offset_mm: 2.0 }) };
    let tube = Clip::all(Shape::Cylinder { centre_mm: DVec3::new(1.0, 2.0, 0.0), axis: DVec3::new(0.0, 0.6, 0.8), radius_mm: 14.0 });
    let crop = Clip::all(Shape::Box { low_mm: DVec3::new(-12.0, -11.0, -20.0), high_mm: DVec3::new(13.0, 9.0, 18.0) });
    let ball = Clip::all(Shape::Sphere { centre_mm: DVec3::new(4.0, -3.0, 2.0), radius_mm: 15.0 });
    let cuts = [vec![], vec![plane.clone(), first], vec![tube, crop, ball]];
    let mut looks = vec![];
    for clips in cuts {
        let mut add = |name, scene: Scene| looks.push((name, Scene { clips: clips.clone(), ..scene }));
        add("iso, shadows", Scene { shadows: true, ..base(Mode::Iso) });
        add("iso, analytic normals", Scene { normals: Normals::Analytic, ..base(Mode::Iso) });
        add("overlay, shadows", Scene { shadows: true, ..base(Mode::Overlay) });
        add("depths, shadows", Scene { shadows: true, depths_within_mm: Some(6.0), ..base(Mode::Depths) });
        for face in [CutFace::Density, CutFace::Blend, CutFace::Difference, CutFace::Transfer] {
            add("iso, faces", Scene { cut_face: face, ..base(Mode::Iso) });
            add("overlay, faces", Scene { cut_face: face, ..base(Mode::Overlay) });
            add("depths, faces", Scene { cut_face: face, ..base(Mode::Depths) });
        }
        let mut clear = base(Mode::Transparent);
        clear.layers[0].shells = vec![Shell { iso: pair.layers[0].iso + 40.0, color: Color([0.9, 0.2, 0.2]), opacity: 0.3 }];
        clear.layers[1].inner_color = Some(Color([0.2, 0.3, 0.9]));
        add("shells, shadows", Scene { shadows: true, ..clear.clone() });
        for face in [CutFace::Density, CutFace::Blend, CutFace::Difference, CutFace::Transfer] {
            add("shells, faces", Scene { cut_face: face, ..clear.clone() });
            add("dvr, faces", Scene { cut_face: face, ..base(Mode::Dvr) });
        }
        add("shells", clear);
        add("spline, shadows", Scene { reconstruction: Reconstruction::Spline, shadows: true, ..base(Mode::Iso) });
        add("nearest, shadows", Scene { reconstruction: Reconstruction::Nearest, shadows: true, ..base(Mode::Overlay) });
        for integrator in [Integrator::Steps { per_voxel: 2.0, jitter: true }, Integrator::Exact] {
            add("dvr", Scene { integrator, ..base(Mode::Dvr) });
            let mut thin = Scene { integrator, background: None, ..base(Mode::Dvr) };
            for layer in &mut thin.layers {
                let mut transfer = TransferFunction::bone();
                transfer.points.iter_mut().for_each(|p| p.opacity *= 0.2);
                transfer.gradient = [(0.0, 0.1), (5.0, 0.5), (20.0, 1.0)].map(|(per_mm, factor)| GradientPoint { per_mm, factor }).into();
                layer.transfer = Some(transfer);
            }
            add("dvr, thin, by gradient", thin);
        }
        for mode in [Mode::Max, Mode::Min, Mode::Mean, Mode::Xray] {
            add("projection", base(mode));
            add("projection of the gradient", Scene { of_gradient: true, ..base(mode) });
            let value_range = Some([pair.layers[0].iso - 20.0, pair.layers[0].iso + 60.0]);
            add("projection of a range", Scene { value_range, ..base(mode) });
            add("projection of the gradient in a range", Scene { value_range, of_gradient: true, ..base(mode) });
        }
        for &face in CutFace::ALL {
            add("slice", Scene { slice: Slice { face, ..Slice::default() }, ..base(Mode::Slice) });
        }
        for &slab in Slab::ALL {
            let slice = Slice { thickness_mm: 4.0, slab, face: CutFace::Blend, window: None, contour_px: 3.0 };
            add("thick slice", Scene { slice, background: None, ..base(Mode::Slice) });
        }
    }
    looks
}
