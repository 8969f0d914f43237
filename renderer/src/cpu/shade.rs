//! From hits to colours: Phong's reflection (Phong 1975) in linear light, and the overlay of two skulls.
//!
//! The twin of `shaders/shade.wgsl`.

use crate::scene::{Light, Mode};
use glam::{Vec3, Vec4};

/// A hit of one layer, ready to be shaded.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shaded {
    /// Depth behind the base plane, mm; the nearest is drawn first.
    pub s: f32,
    /// 0-based layer.
    pub layer: usize,
    /// Linear colour.
    pub color: Vec3,
    /// Opacity where the mode draws it transparent.
    pub opacity: f32,
}

/// The linear colour of a surface of `color` (linear) with outward `normal`, seen along `view` and lit from `toward_light`,
/// all unit vectors in the world. Both sides of a surface are lit.
pub(crate) fn phong(light: &Light, color: Vec3, normal: Vec3, view: Vec3, toward_light: Vec3) -> Vec3 {
    let n = if normal.dot(view) > 0.0 { -normal } else { normal };
    let lambert = n.dot(toward_light).max(0.0);
    let mirrored = 2.0 * n.dot(toward_light) * n - toward_light;
    let highlight = if lambert > 0.0 { (-mirrored.dot(view)).max(0.0).powf(light.shininess) } else { 0.0 };
    color * (light.ambient + light.diffuse * lambert) + Vec3::splat(light.specular * highlight)
}

/// The picture's colour (linear, premultiplied, with alpha) of the first hits of all layers, and the hit that is drawn
/// nearest. `hits` may be in any order.
pub(crate) fn combine<'a>(mode: Mode, hits: impl Iterator<Item = &'a Shaded> + Clone) -> (Vec4, Option<Shaded>) {
    let nearest = |skip: Option<usize>| {
        let others = hits.clone().filter(|h| Some(h.layer) != skip);
        others.fold(None, |best: Option<&Shaded>, h| if best.is_none_or(|b| h.s < b.s) { Some(h) } else { best })
    };
    let Some(first) = nearest(None) else { return (Vec4::ZERO, None) };
    let behind = if mode == Mode::Overlay { nearest(Some(first.layer)) } else { None };
    let color = match behind {
        Some(second) => first.color * first.opacity + second.color * (1.0 - first.opacity),
        None => first.color,
    };
    (color.extend(1.0), Some(*first))
}

/// A premultiplied linear colour over the background, as sRGB bytes with straight alpha.
pub(crate) fn encode(color: Vec4, background: Vec4) -> [u8; 4] {
    let c = color + background * (1.0 - color.w);
    let straight = if c.w > 0.0 { c.truncate() / c.w } else { Vec3::ZERO };
    let srgb = straight.to_array().map(|c| if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 });
    let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0).round() as u8;
    [byte(srgb[0]), byte(srgb[1]), byte(srgb[2]), byte(c.w)]
}
