//! Within a brick: cell by cell, with one of the solvers of [`crate::roots`] in each that can hold the surface.
//!
//! The twin of `shaders/cells.wgsl`.

use super::walk::{FAR, Field, Hits, InBrick, Met, Method, Pace, least};
use crate::lanes::{Floats, Ints, Mask, Vecs, axes, lerp};
use crate::roots::{self, Entry};
use fearless_simd::Simd;
use fearless_simd::prelude::*;
use std::hint::black_box;

/// The first entries into the bone within bricks.
#[inline(always)]
pub(super) fn walk<S: Simd>(simd: S, field: &Field<'_>, method: Method, pace: &Pace<S>, at: &InBrick<S>) -> Hits<S> {
    let (zero, one, none) = (Floats::splat(simd, 0.0), Floats::splat(simd, 1.0), Mask::splat(simd, false));
    let mut cell = first_cell(pace, at);
    let first = cell;
    let ahead = axes!(a => pace.forward[a].select(one, zero));
    let step = axes!(a => pace.forward[a].select(one, -one));
    // Where a ray is that has left the brick.
    let beyond = axes!(a => pace.forward[a].select(at.size[a], -one));
    let (mut t, mut entry) = (at.t, [none; 3]);
    let mut hits = Hits::none(simd);
    let mut walking = at.rays;
    let mut solved = none;
    while walking.any_true() {
        // Step until each ray is in a cell that can hold the surface, and has not been looked at.
        let mut stepping = walking;
        loop {
            let ready = field.may_hold(simd, at, &cell, stepping & !solved);
            stepping &= !ready;
            if !stepping.any_true() {
                break;
            }
            solved &= !stepping;
            let (t_next, axis) = leave(pace, at, &axes!(a => cell[a] + ahead[a]), t);
            cell = axes!(a => (stepping & axis[a]).select(cell[a] + step[a], cell[a]));
            t = stepping.select(t_next, t);
            entry = axes!(a => (entry[a] & !stepping) | (axis[a] & stepping));
            let left = cell[0].simd_eq(beyond[0]) | cell[1].simd_eq(beyond[1]) | cell[2].simd_eq(beyond[2]);
            let gone = stepping & (left | (at.s + t).simd_gt(at.s_max));
            walking &= !gone;
            stepping &= !gone;
        }
        if !walking.any_true() {
            break;
        }
        let (t_next, axis) = leave(pace, at, &axes!(a => cell[a] + ahead[a]), t);
        let corner = axes!(a => at.corner[a] + cell[a].to_int::<Ints<S>>());
        let f = field.corners(simd, &corner, walking);
        // Where it enters is where it left the cell before, the same number.
        let p = axes!(a => (entry[0] | entry[1] | entry[2]).select(point(pace, at, t, &cell, a, entry[a], 1.0 - ahead[a]), at.p[a]));
        let q = axes!(a => point(pace, at, t_next, &cell, a, axis[a], ahead[a]));
        let (from, to) = (axes!(a => p[a] - cell[a]), axes!(a => q[a] - cell[a]));
        let Entry { found, u } = match method {
            Method::Solver(solver) => roots::first_entry(simd, solver, &f, &from, &to, walking),
            Method::Unsolved => {
                black_box(&f);
                Entry { found: none, u: zero }
            }
        };
        if found.any_true() {
            let at_entry = found & u.simd_eq(zero) & (cell[0].simd_eq(first[0]) & cell[1].simd_eq(first[1]) & cell[2].simd_eq(first[2]));
            let met = if at_entry.any_true() { field.met_at_entry(simd, pace, at).only(at_entry) } else { Met::isosurface(simd) };
            hits.add(&Hits { found, s: at.s + t + u * (t_next - t), cell: corner, local: lerp(&from, &to, u), met });
            walking &= !found;
        }
        solved = walking;
    }
    hits
}

/// The cells that rays are in behind their entry into a brick.
#[inline(always)]
fn first_cell<S: Simd>(pace: &Pace<S>, at: &InBrick<S>) -> Vecs<S> {
    axes!(a => {
        let cell = at.p[a].floor();
        // On a face and moving down, the ray is in the cell below.
        let below = !pace.forward[a] & pace.moves[a] & at.p[a].simd_eq(cell);
        below.select(cell - 1.0, cell).max(0.0).min(at.size[a] - 1.0)
    })
}

/// Where rays leave cells, of which `far` are the faces ahead, and across which axis; never before `t`.
#[inline(always)]
fn leave<S: Simd>(pace: &Pace<S>, at: &InBrick<S>, far: &Vecs<S>, t: Floats<S>) -> (Floats<S>, [Mask<S>; 3]) {
    let t_faces = axes!(a => pace.until_plane(a, far[a], at.origin[a], FAR));
    let (t_least, axis) = least(&t_faces);
    (t_least.max(t), axis)
}

/// A coordinate of where the ray is at t, on the face of a cell across `axis`.
#[inline(always)]
fn point<S: Simd>(pace: &Pace<S>, at: &InBrick<S>, t: Floats<S>, cell: &Vecs<S>, a: usize, is_axis: Mask<S>, face: Floats<S>) -> Floats<S> {
    is_axis.select(cell[a] + face, (at.origin[a] + t * pace.direction[a]).max(cell[a]).min(cell[a] + 1.0))
}
