//! From hits to colours, and the faces of cuts among them.
//!
//! The twin of `shaders/shade.wgsl`.

use super::faces::face_color_at;
use super::light::{color_of_faces, grey, known_normal};
use super::nearest::Drawn;
use super::ray::View;
use super::shadows::shadowed;
use crate::color::Color;
use crate::frame::Frame;
use crate::lanes::{Floats, Vecs, axes, dot, numbers};
use crate::layer::AGREED;
use crate::scene::Scene;
use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::Vec3;

/// The colours of what is drawn, where there is anything, with these normals.
#[inline(always)]
pub(super) fn light<S: Simd>(simd: S, view: &View<'_, S>, drawn: &Drawn<S>, normal: &Vecs<S>) -> Vecs<S> {
    let (zero, one) = (Floats::splat(simd, 0.0), Floats::splat(simd, 1.0));
    let mut share = one;
    if view.scene.shadows {
        let own = known_normal(&drawn.normal, &view.direction);
        let toward = axes!(a => Floats::splat(simd, view.frame.toward_light[a]));
        let lit = drawn.found & !drawn.is_face & dot(&own, &toward).simd_gt(zero);
        if lit.any_true() {
            share = shadowed(simd, view, drawn.s, lit).select(zero, one);
        }
    }
    view.lit(simd, &drawn.color, normal, share, drawn.s)
}

/// Makes one of the nearest hits and the second ones of an overlay where they agree: bone-coloured and opaque. How far apart they are is taken
/// across the surface: along the ray, times the larger of the two cosines, so that what is seen from the side agrees as what is seen from the front.
/// Gives the normals that shade: of what agrees the mean of both, so that it does not matter which is the nearer one.
#[inline(always)]
pub(super) fn draw_agreed<S: Simd>(simd: S, view: &View<'_, S>, first: &mut Drawn<S>, second: &Drawn<S>) -> Vecs<S> {
    let [a, b] = [&first.normal, &second.normal].map(
        #[inline(always)]
        |normal| dot(normal, &view.direction).abs(),
    );
    let apart_mm = (second.s - first.s) * view.mm_per_depth * a.max(b);
    let agree = second.found & !first.is_face & !second.is_face & apart_mm.simd_le(view.frame.agreement_mm);
    let bone = AGREED.linear();
    first.color = axes!(a => agree.select(Floats::splat(simd, bone[a]), first.color[a]));
    first.opacity = agree.select(Floats::splat(simd, 1.0), first.opacity);
    let both = axes!(a => first.normal[a] + second.normal[a]);
    let length = dot(&both, &both).sqrt();
    let is_known = agree & length.simd_gt(0.0);
    axes!(a => is_known.select(both[a] / length, first.normal[a]))
}

/// Gives the nearest hits the colour for how far behind them the second ones lie: more than none where the second volume is the nearer one.
#[inline(always)]
pub(super) fn color_by_depth<S: Simd>(simd: S, view: &View<'_, S>, first: &mut Drawn<S>, second: &Drawn<S>) {
    let apart_mm = (second.s - first.s) * view.mm_per_depth;
    let difference = first.id.simd_gt(second.id).select(apart_mm, -apart_mm) / view.frame.depth_range_mm;
    let mut lanes = first.color.map(|c| c.to_array());
    for lane in numbers(first.found & second.found & !first.is_face & !second.is_face) {
        let color = Color::diverging(difference[lane]).linear();
        (0..3).for_each(|a| lanes[a][lane] = color[a]);
    }
    first.color = lanes.map(|c| Floats::load_array(simd, c));
}

/// Paints the faces of cuts among what is drawn first: with the values of all volumes that are cut there.
#[inline(always)]
pub(super) fn paint_faces<S: Simd>(simd: S, frame: &Frame, scene: &Scene, hits: &[Drawn<S>], first: &Drawn<S>, color: &mut Vecs<S>) {
    let faces = first.found & first.is_face;
    if !faces.any_true() {
        return;
    }
    let mut lanes = color.map(|c| c.to_array());
    for lane in numbers(faces) {
        // A plane's face is at the same depth in all of them.
        let there = hits.iter().filter(|h| h.is_face.test(lane) && (h.s[lane] == first.s[lane] || h.id[lane] == first.id[lane]));
        let cut: Vec<(f32, Vec3)> = there.map(|h| (h.brightness[lane], Vec3::from_array(axes!(a => h.color[a][lane])))).collect();
        let layer = frame.layers.iter().find(|l| l.placement.index + 1 == first.id[lane] as usize);
        let own = match layer {
            Some(layer) if !layer.appearance.face_colors.is_empty() => face_color_at(&layer.appearance.face_colors, first.brightness[lane]),
            _ => grey(first.brightness[lane]),
        };
        let painted = color_of_faces(scene.cut_face, own, &cut);
        (0..3).for_each(|a| lanes[a][lane] = painted[a]);
    }
    *color = lanes.map(|c| Floats::load_array(simd, c));
}
