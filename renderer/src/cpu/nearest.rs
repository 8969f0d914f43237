//! What is drawn of each layer, and which of it is nearest.
//!
//! The twin of `shaders/nearest.wgsl`.

use crate::lanes::{Floats, Mask, Vecs, axes};
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// What is drawn of one layer, or the nearest of several.
#[derive(Clone, Copy)]
pub(super) struct Drawn<S: Simd> {
    /// In which lanes there is anything.
    pub found: Mask<S>,
    /// Depth behind the base plane, mm; the nearest is drawn first.
    pub s: Floats<S>,
    /// In the world, toward the viewer, unit; zero where there is none.
    pub normal: Vecs<S>,
    /// Linear colour.
    pub color: Vecs<S>,
    /// Opacity where the mode draws it transparent.
    pub opacity: Floats<S>,
    /// 1-based layer.
    pub id: Floats<S>,
    /// Where it is the face of a cut that shows values; these as brightness, not yet kept between 0 and 1.
    pub is_face: Mask<S>,
    pub brightness: Floats<S>,
}

/// The nearest of each lane, leaving out that of the layer of number `skip`; of equal ones the first layer's.
#[inline(always)]
pub(super) fn nearest<S: Simd>(simd: S, hits: &[Drawn<S>], skip: Floats<S>) -> Drawn<S> {
    let zero = Floats::splat(simd, 0.0);
    let mut best = Drawn {
        found: Mask::splat(simd, false),
        s: zero,
        normal: [zero; 3],
        color: [zero; 3],
        opacity: zero,
        id: zero,
        is_face: Mask::splat(simd, false),
        brightness: zero,
    };
    for hit in hits {
        let nearer = hit.found & hit.id.simd_ne(skip) & (!best.found | hit.s.simd_lt(best.s));
        best.found |= nearer;
        best.s = nearer.select(hit.s, best.s);
        best.normal = axes!(a => nearer.select(hit.normal[a], best.normal[a]));
        best.color = axes!(a => nearer.select(hit.color[a], best.color[a]));
        best.opacity = nearer.select(hit.opacity, best.opacity);
        best.id = nearer.select(hit.id, best.id);
        best.is_face = (best.is_face & !nearer) | (hit.is_face & nearer);
        best.brightness = nearer.select(hit.brightness, best.brightness);
    }
    best
}
