//! Within a brick: steps of fixed length, with one linear interpolation where two samples lie on different sides. This is what most
//! volume renderers do. Sample n lies at depth n·step behind the base plane, whatever bricks are skipped.
//!
//! The twin of `shaders/steps.wgsl`.

use super::brick::{Hit, InBrick, Met, Pace};
use super::volume::Field;
use super::within::holds;
use crate::lanes::{Floats, Ints, Mask, Vecs, axes, dot, lerp};
use crate::roots::{inside, trilinear};
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// The first entries of the rays of `of` into the bone within bricks, as far as samples see them.
#[inline(always)]
pub(super) fn walk<S: Simd>(simd: S, field: &Field<'_>, per_voxel: u32, pace: &Pace<S>, at: &InBrick<S>, of: Mask<S>) -> Hit<S> {
    let step = 1.0 / (per_voxel as f32 * dot(&pace.direction, &pace.direction).sqrt());
    // The last sample before the brick, but not before the box or the line's start, where the first sample is taken.
    let n = ((at.s + at.t) / step).floor();
    let begin = n * step - at.s;
    let met = field.met_at_entry(simd, pace, at);
    let at_entry = !met.is_isosurface() | (n * step).simd_lt(at.begin);
    let mut t0 = at_entry.select(at.t, begin);
    let mut p0 = axes!(a => at_entry.select(at.p[a], at.origin[a] + t0 * pace.direction[a]));
    let mut f0 = value(simd, field, &at.corner(), &p0, of);
    let mut hits = Hit::none(simd);
    let begun = of & inside(f0);
    hits.add(&hit(field, at, t0, &p0, begun, met.only(begun)));
    let mut walking = of & !begun;
    // Counted from the brick on: a large number would not grow by 1.
    let mut count = 0.0;
    loop {
        count += 1.0;
        let t1 = begin + count * step;
        walking &= !(t1.simd_gt(at.t_out) | t0.simd_gt(at.t_end));
        if !walking.any_true() {
            return hits;
        }
        let p1 = axes!(a => at.origin[a] + t1 * pace.direction[a]);
        let f1 = value(simd, field, &at.corner(), &p1, walking);
        let found = walking & inside(f1);
        if found.any_true() {
            let u = f0 / (f0 - f1);
            hits.add(&hit(field, at, t0 + u * (t1 - t0), &lerp(&p0, &p1, u), found, Met::isosurface(simd)));
            walking &= !found;
        }
        (t0, p0, f0) = (t1, p1, f1);
    }
}

/// The cells of points, which may lie a step outside the brick, but are taken within the box.
#[inline(always)]
fn cell_of<S: Simd>(field: &Field<'_>, corner: &[Ints<S>; 3], p: &Vecs<S>) -> ([Ints<S>; 3], Vecs<S>) {
    let cell = axes!(a => (corner[a] + p[a].floor().to_int::<Ints<S>>()).max(0).min(field.dims[a] - 2));
    let local = axes!(a => (p[a] - (cell[a] - corner[a]).to_float::<Floats<S>>()).max(0.0).min(1.0));
    (cell, local)
}

/// Outside of a solid as far outside as it would be inside: its face is taken to lie in the middle of a step.
#[inline(always)]
fn value<S: Simd>(simd: S, field: &Field<'_>, corner: &[Ints<S>; 3], p: &Vecs<S>, of: Mask<S>) -> Floats<S> {
    let (cell, local) = cell_of(field, corner, p);
    let value = trilinear(&field.corners(simd, &cell, of), &local);
    let Some(solid) = field.solid else { return value };
    holds(simd, solid, &cell, &local, of).select(value, -value.abs().max(f32::MIN_POSITIVE))
}

#[inline(always)]
fn hit<S: Simd>(field: &Field<'_>, at: &InBrick<S>, t: Floats<S>, p: &Vecs<S>, found: Mask<S>, met: Met<S>) -> Hit<S> {
    let (cell, local) = cell_of(field, &at.corner(), p);
    Hit { found, s: at.s + t, cell, local, met }
}
