//! From hits to colours: Phong's reflection (Phong 1975) in linear light, and the overlay of two skulls.
//!
//! The twin of `shaders/shade.wgsl`.

use crate::lanes::{Floats, LANES, Mask, Vecs, axes, dot, numbers};
use crate::scene::{Light, Mode};
use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::{Vec3, Vec4};

/// Hits of one layer, shaded.
#[derive(Clone, Copy)]
pub(super) struct Shaded<S: Simd> {
    /// In which lanes there is one.
    pub found: Mask<S>,
    /// Depth behind the base plane, mm; the nearest is drawn first.
    pub s: Floats<S>,
    /// 0-based layer.
    pub layer: usize,
    /// Linear colour.
    pub color: Vecs<S>,
    /// Opacity where the mode draws it transparent.
    pub opacity: f32,
}

/// The linear colours of surfaces of `color` (linear) with outward `normal`, seen along `view` and lit from `toward_light`,
/// all unit vectors in the world. Both sides of a surface are lit.
#[inline(always)]
pub(super) fn phong<S: Simd>(
    simd: S,
    light: &Light,
    color: Vec3,
    normal: &Vecs<S>,
    view: &Vecs<S>,
    toward_light: Vec3,
    of: Mask<S>,
) -> Vecs<S> {
    let zero = Floats::splat(simd, 0.0);
    let toward = axes!(a => Floats::splat(simd, toward_light[a]));
    let away = dot(normal, view).simd_gt(zero);
    let n = axes!(a => away.select(-normal[a], normal[a]));
    let cosine = dot(&n, &toward);
    let lambert = cosine.max(zero);
    let mirrored = axes!(a => 2.0 * cosine * n[a] - toward[a]);
    let reflected = (-dot(&mirrored, view)).max(zero);
    let (base, mut highlight) = (reflected.to_array(), [0.0; LANES]);
    for lane in numbers(of & lambert.simd_gt(zero) & reflected.simd_gt(zero)) {
        highlight[lane] = base[lane].powf(light.shininess);
    }
    let highlight = light.specular * Floats::load_array(simd, highlight);
    axes!(a => color[a] * (light.ambient + light.diffuse * lambert) + highlight)
}

/// The picture's colour (linear) of the hits of all layers that are drawn.
#[derive(Clone, Copy)]
pub(super) struct Combined<S: Simd> {
    /// In which lanes there is one.
    pub found: Mask<S>,
    pub color: Vecs<S>,
    /// The depth of the nearest and its 1-based layer.
    pub s: Floats<S>,
    pub id: Floats<S>,
}

/// Of the hits of all layers, in the order of layers.
#[inline(always)]
pub(super) fn combine<S: Simd>(simd: S, mode: Mode, hits: &[Shaded<S>]) -> Combined<S> {
    let zero = Floats::splat(simd, 0.0);
    let first = nearest(simd, hits, zero);
    if mode != Mode::Overlay {
        return first;
    }
    let second = nearest(simd, hits, first.id);
    let mut opacity = Floats::splat(simd, 1.0);
    for hit in hits {
        let is_first = second.found & first.id.simd_eq((hit.layer + 1) as f32);
        opacity = is_first.select(Floats::splat(simd, hit.opacity), opacity);
    }
    let color = axes!(a => second.found.select(first.color[a] * opacity + second.color[a] * (1.0 - opacity), first.color[a]));
    Combined { color, ..first }
}

/// The nearest hit of each lane, leaving out that of the layer of number `skip`; of equal ones the first layer's.
#[inline(always)]
fn nearest<S: Simd>(simd: S, hits: &[Shaded<S>], skip: Floats<S>) -> Combined<S> {
    let zero = Floats::splat(simd, 0.0);
    let mut best = Combined { found: Mask::splat(simd, false), color: [zero; 3], s: zero, id: zero };
    for hit in hits {
        let id = Floats::splat(simd, (hit.layer + 1) as f32);
        let nearer = hit.found & id.simd_ne(skip) & (!best.found | hit.s.simd_lt(best.s));
        best.found |= nearer;
        best.s = nearer.select(hit.s, best.s);
        best.color = axes!(a => nearer.select(hit.color[a], best.color[a]));
        best.id = nearer.select(id, best.id);
    }
    best
}

/// A premultiplied linear colour over the background, as sRGB bytes with straight alpha.
pub(super) fn encode(color: Vec4, background: Vec4) -> [u8; 4] {
    let c = color + background * (1.0 - color.w);
    let straight = if c.w > 0.0 { c.truncate() / c.w } else { Vec3::ZERO };
    let [r, g, b] = straight.to_array().map(fast_srgb8::f32_to_srgb8);
    [r, g, b, (c.w.clamp(0.0, 1.0) * 255.0).round() as u8]
}
