//! What of rays' ways through cells lies within the solid that a volume is cut by, and the faces that this leaves.
//!
//! The twin of `shaders/within.wgsl`.

use crate::lanes::{Floats, Ints, LANES, Mask, Vecs, numbers};
use crate::roots::bernstein::bernstein;
use crate::roots::cubic::{refine, turning_points, value};
use crate::roots::{inside, trilinear};
use bregma_field::Solid;
use bregma_field::solid::Side;
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// A way that begins less than so far within a solid begins at its face: half of what distances are kept to, in their units.
pub(crate) const AT_FACE_UNITS: f32 = 0.5;

/// Behind the end of any way.
pub(crate) const NO_PART: f32 = 2.0;

/// The parts of ways that lie within a solid: no more than two, from where to where in [0, 1]; a part that begins at [`NO_PART`] is none.
///
/// ```text
///   the solid's cubic   ──●────────●━━━━━━━━●──────●━━━━►     ● where it changes sides: at most three
///                         0     first[0] first[1]  second[0]
/// ```
pub(super) struct Parts<S: Simd> {
    first: [Floats<S>; 2],
    second: [Floats<S>; 2],
    /// Which begin at a face of the solid, and not where they come from a cell that lies in it.
    pub first_at_face: Mask<S>,
}

/// In units, how far within the solid the corners of cells are; and which of these are of bricks that its surface may pass.
#[inline(always)]
pub(super) fn corners<S: Simd>(simd: S, solid: &Solid, cell: &[Ints<S>; 3], of: Mask<S>) -> (Mask<S>, [Floats<S>; 8]) {
    let cell = cell.map(Ints::to_array);
    let (mut bits, mut units) = (0, [[0.0; LANES]; 8]);
    for lane in numbers(of) {
        let cell = [cell[0][lane], cell[1][lane], cell[2][lane]].map(|n| n as usize);
        if solid.side_at(cell) == Side::Both {
            bits |= 1 << lane;
            let at = solid.corners(cell);
            for corner in 0..8 {
                units[corner][lane] = at[corner];
            }
        }
    }
    let load = |c: usize| Floats::load_array(simd, units[c]);
    (Mask::from_bitmask(simd, bits), [load(0), load(1), load(2), load(3), load(4), load(5), load(6), load(7)])
}

/// The parts of the ways of `of` through cells, from start to end; none where the surface of the solid passes no cell of them.
#[inline(always)]
pub(super) fn parts<S: Simd>(simd: S, solid: &Solid, cell: &[Ints<S>; 3], ways: [&Vecs<S>; 2], of: Mask<S>) -> Option<Parts<S>> {
    // Compiled by itself and called.
    simd.vectorize(
        #[inline(always)]
        || parts_of(simd, solid, cell, ways, of),
    )
}

#[inline(always)]
fn parts_of<S: Simd>(simd: S, solid: &Solid, cell: &[Ints<S>; 3], [start, end]: [&Vecs<S>; 2], of: Mask<S>) -> Option<Parts<S>> {
    let (near, f) = corners(simd, solid, cell, of);
    if !near.any_true() {
        return None;
    }
    let [zero, one, none] = [0.0, 1.0, NO_PART].map(|v| Floats::splat(simd, v));
    let b = bernstein(&f, start, end);
    // Between two of these the cubic does not turn.
    let [low, high] = turning_points(simd, &b);
    let mut roots = [none; 3];
    let mut from = (zero, b[0]);
    for (n, to) in [(low, value(&b, low)), (high, value(&b, high)), (one, b[3])].into_iter().enumerate() {
        let (rises, falls) = (!inside(from.1) & inside(to.1), inside(from.1) & !inside(to.1));
        let changes = near & (rises | falls);
        if changes.any_true() {
            let side = falls.select(-one, one);
            let sided = b.map(
                #[inline(always)]
                |c| side * c,
            );
            roots[n] = changes.select(refine(&sided, from.0, side * from.1, to.0, side * to.1, changes), none);
        }
        from = to;
    }
    // In order, without gaps.
    let [r0, r1, r2] = roots;
    let is = |v: Floats<S>| v.simd_lt(none);
    let first = is(r0).select(r0, is(r1).select(r1, r2));
    let second = (is(r0) & is(r1)).select(r1, ((is(r0) | is(r1)) & is(r2)).select(r2, none));
    let third = (is(r0) & is(r1) & is(r2)).select(r2, none);
    let begins = inside(b[0]) | !near;
    Some(Parts {
        first: [begins.select(zero, first), begins.select(first, second).min(one)],
        second: [begins.select(second, third), begins.select(third, none).min(one)],
        first_at_face: near & (!begins | b[0].simd_lt(AT_FACE_UNITS)),
    })
}

impl<S: Simd> Parts<S> {
    /// From where to where the second part goes in the lanes of `is_second`, and the first in others.
    #[inline(always)]
    pub fn part(&self, is_second: Mask<S>) -> [Floats<S>; 2] {
        [is_second.select(self.second[0], self.first[0]), is_second.select(self.second[1], self.first[1])]
    }

    /// Which have a second part.
    #[inline(always)]
    pub fn have_second(&self) -> Mask<S> {
        self.second[0].simd_lt(NO_PART)
    }
}

/// Which points of cells lie within the solid, of those of `of`.
#[inline(always)]
pub(super) fn holds<S: Simd>(simd: S, solid: &Solid, cell: &[Ints<S>; 3], local: &Vecs<S>, of: Mask<S>) -> Mask<S> {
    let (near, f) = corners(simd, solid, cell, of);
    let cells = cell.map(Ints::to_array);
    let mut bits = 0;
    for lane in numbers(of & !near) {
        let cell = [cells[0][lane], cells[1][lane], cells[2][lane]].map(|n| n as usize);
        bits |= u64::from(solid.side_at(cell) == Side::Inside) << lane;
    }
    Mask::from_bitmask(simd, bits) | (near & inside(trilinear(&f, local)))
}
