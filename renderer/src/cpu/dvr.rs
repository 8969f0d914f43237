//! What both integrators of direct volume rendering share: light that volumes send and keep, by their transfer functions (Max 1995).
//!
//! The twin of `shaders/dvr.wgsl`.

use super::gradient::world_gradient;
use super::ray::Gathered;
use super::traveller::Traveller;
use crate::lanes::{Floats, LANES, Mask, Vecs, dot, numbers};
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// A picture's depth and volume are those at which half of the light behind is kept.
pub(crate) const SEEN: f32 = 0.5;

/// Adds light that is sent here, and the share of that from behind that is kept.
#[inline(always)]
pub(super) fn add<S: Simd>(all: &mut Gathered<S>, sent: &Vecs<S>, opacity: Floats<S>, s: Floats<S>, id: Floats<S>, of: Mask<S>) {
    let clear = 1.0 - all.color[3];
    let before = all.color[3];
    for a in 0..3 {
        all.color[a] = of.select(all.color[a] + clear * sent[a], all.color[a]);
    }
    all.color[3] = of.select(all.color[3] + clear * opacity, all.color[3]);
    let seen = of & before.simd_lt(SEEN) & all.color[3].simd_ge(SEEN);
    all.s = seen.select(s, all.s);
    all.id = seen.select(id, all.id);
}

/// The factor of the extinction by the gradient's magnitude.
#[inline(always)]
pub(super) fn gradient_factor<S: Simd>(simd: S, t: &Traveller<'_, S>, u: Floats<S>, of: Mask<S>) -> Floats<S> {
    let g = world_gradient(t.layer, &t.cell, u);
    let magnitude = dot(&g, &g).sqrt().to_array();
    let mut factor = [0.0; LANES];
    for lane in numbers(of) {
        factor[lane] = factor_at(&t.layer.appearance.gradient_factors, magnitude[lane]);
    }
    Floats::load_array(simd, factor)
}

fn factor_at(factors: &[[f32; 2]], magnitude: f32) -> f32 {
    let above = factors.partition_point(|f| f[0] <= magnitude);
    match (above.checked_sub(1), factors.get(above)) {
        (Some(a), Some([to, high])) => {
            let [from, low] = factors[a];
            low + (high - low) * ((magnitude - from) / (to - from))
        }
        (Some(a), None) => factors[a][1],
        (None, _) => factors[0][1],
    }
}
