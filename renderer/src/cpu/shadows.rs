//! Which hits lie in shadow: those with bone between them and the light, hard.
//!
//! The twin of `shaders/shadows.wgsl`.

use super::line::Part;
use super::ray::View;
use super::to_light::{ToLight, to_light};
use super::volume::Field;
use crate::lanes::{Floats, Mask};
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// Which of the hits of `asked`, at depths `s`, have bone of any layer between them and the light.
#[inline(always)]
pub(super) fn shadowed<S: Simd>(simd: S, view: &View<'_, S>, s: Floats<S>, asked: Mask<S>) -> Mask<S> {
    let mut dark = Mask::splat(simd, false);
    for layer in &view.frame.layers {
        let ToLight { lines, kept, s_max } = to_light(simd, view, layer, s, asked);
        let asked = asked & !dark & s_max.simd_gt(kept.begin);
        if asked.any_true() {
            let part = Part { begin: kept.begin, s_min: Floats::splat(simd, 0.0), s_max };
            let field = Field::of(layer);
            dark |= field.first_hits(simd, Some(view.frame.method), &lines, &part, asked).found;
        }
    }
    dark
}
