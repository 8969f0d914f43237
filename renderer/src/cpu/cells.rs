//! Within a brick: from cell to cell that can hold the surface, with one of the solvers of [`crate::roots`] in them.
//!
//! The twin of `shaders/cells.wgsl`.

use super::brick::{FAR, Hit, InBrick, Met, Pace, least};
use super::volume::Field;
use super::within::{self, NO_PART, Parts};
use crate::lanes::{Floats, Ints, Mask, Vecs, axes, lerp};
use crate::roots::{self, Entry, Method, spline, voxels};
use fearless_simd::Simd;
use fearless_simd::prelude::*;
use std::hint::black_box;

/// Cells, the depths at which rays enter them, and the axes that they cross there; none where they enter the brick.
pub(crate) struct Place<S: Simd> {
    cell: Vecs<S>,
    pub t: Floats<S>,
    entry: [Mask<S>; 3],
    /// The first part of the cell's way within the solid is behind.
    is_second: Mask<S>,
}

impl<S: Simd> Place<S> {
    #[inline(always)]
    pub fn nowhere(simd: S) -> Self {
        let (zero, none) = (Floats::splat(simd, 0.0), Mask::splat(simd, false));
        Self { cell: [zero; 3], t: zero, entry: [none; 3], is_second: none }
    }

    /// The cells in which rays enter bricks, from the first to the last that can hold the surface along each side.
    #[inline(always)]
    pub fn enter(&mut self, pace: &Pace<S>, at: &InBrick<S>, [first, last]: &[Vecs<S>; 2]) {
        self.cell = axes!(a => {
            let cell = at.p[a].floor();
            // On a face and moving down, the ray is in the cell below.
            let below = !pace.forward[a] & pace.moves[a] & at.p[a].simd_eq(cell);
            let cell = below.select(cell - 1.0, cell).max(first[a]).min(last[a]);
            at.rays.select(cell, self.cell[a])
        });
        self.t = at.rays.select(at.t, self.t);
        self.entry = axes!(a => self.entry[a] & !at.rays);
        self.is_second &= !at.rays;
    }

    /// Takes the rays of `of` to the next cell.
    #[inline(always)]
    fn step(&mut self, pace: &Pace<S>, t: Floats<S>, axis: &[Mask<S>; 3], of: Mask<S>) {
        self.cell = axes!(a => {
            let next = pace.forward[a].select(self.cell[a] + 1.0, self.cell[a] - 1.0);
            (of & axis[a]).select(next, self.cell[a])
        });
        self.t = of.select(t, self.t);
        self.entry = axes!(a => (self.entry[a] & !of) | (axis[a] & of));
        self.is_second &= !of;
    }
}

/// The exits of rays from their cells: depth and axis.
#[inline(always)]
fn exit_of<S: Simd>(pace: &Pace<S>, at: &InBrick<S>, place: &Place<S>) -> (Floats<S>, [Mask<S>; 3]) {
    let t_faces = axes!(a => {
        let face = pace.forward[a].select(place.cell[a] + 1.0, place.cell[a]);
        pace.until_plane(a, face, at.origin[a], FAR)
    });
    let (t_least, axis) = least(&t_faces);
    (t_least.max(place.t), axis)
}

/// On to cells that can hold the surface, for the rays of `of` whose cell cannot; those that come to one.
#[inline(always)]
pub(super) fn advance<S: Simd>(simd: S, field: &Field<'_>, pace: &Pace<S>, at: &InBrick<S>, place: &mut Place<S>, of: Mask<S>) -> Mask<S> {
    // The last cell's exit is the brick's, the same number.
    let mut stepping = of & place.t.simd_lt(at.t_end);
    let mut arrived = Mask::splat(simd, false);
    loop {
        let ready = field.may_hold(simd, at, &place.cell, stepping);
        arrived |= ready;
        stepping &= !ready;
        if !stepping.any_true() {
            return arrived;
        }
        let (t, axis) = exit_of(pace, at, place);
        place.step(pace, t, &axis, stepping);
        stepping &= t.simd_lt(at.t_end);
    }
}

/// Rays on their way through cells, or through what of these lies within a solid.
///
/// ```text
///   s[0] ┌────────────┐
///   ──►start          │     start and end in [0, 1]³ of the cell, on its faces; between them the interpolant is a cubic of u
///        │ u       end──►   u = 0 at start, 1 at end
///        └────────────┘ s[1]
/// ```
#[derive(Clone, Copy)]
pub(crate) struct CellPass<S: Simd> {
    /// The cells, by their lowest samples.
    pub cell: [Ints<S>; 3],
    /// Corner values relative to the level, positive inside; corner x + 2y + 4z is at (x, y, z).
    pub f: [Floats<S>; 8],
    /// Where the rays enter and leave, in [0, 1]³.
    pub start: Vecs<S>,
    pub end: Vecs<S>,
    /// The depths of that, behind the base plane, mm.
    pub s: [Floats<S>; 2],
    /// The same from the brick's s on.
    pub t: [Floats<S>; 2],
    /// Which cells are the first in their bricks.
    pub is_first: Mask<S>,
    /// Which ways begin at a face that the solid cuts.
    pub at_face: Mask<S>,
    /// Which have a part within the solid.
    pub there: Mask<S>,
}

impl<S: Simd> CellPass<S> {
    #[inline(always)]
    pub fn nowhere(simd: S) -> Self {
        let zero = Floats::splat(simd, 0.0);
        let (cell, none) = ([Ints::splat(simd, 0); 3], Mask::splat(simd, false));
        let both = [zero; 2];
        Self { cell, f: [zero; 8], start: [zero; 3], end: [zero; 3], s: both, t: both, is_first: none, at_face: none, there: none }
    }

    /// Takes over those of `new` in the lanes of `of`.
    #[inline(always)]
    pub fn take(&mut self, new: &Self, of: Mask<S>) {
        self.cell = axes!(a => of.select(new.cell[a], self.cell[a]));
        for corner in 0..8 {
            self.f[corner] = of.select(new.f[corner], self.f[corner]);
        }
        self.start = axes!(a => of.select(new.start[a], self.start[a]));
        self.end = axes!(a => of.select(new.end[a], self.end[a]));
        self.s = [of.select(new.s[0], self.s[0]), of.select(new.s[1], self.s[1])];
        self.t = [of.select(new.t[0], self.t[0]), of.select(new.t[1], self.t[1])];
        self.is_first = (self.is_first & !of) | (new.is_first & of);
        self.at_face = (self.at_face & !of) | (new.at_face & of);
        self.there = (self.there & !of) | (new.there & of);
    }

    /// What of it lies within a solid: the second of the parts in the lanes of `is_second`, and the first in others; and which have another behind it.
    #[inline(always)]
    fn within(mut self, parts: &Parts<S>, is_second: Mask<S>) -> (Self, Mask<S>) {
        let part = parts.part(is_second);
        let (begins_later, ends_sooner) = (part[0].simd_gt(0.0), part[1].simd_lt(1.0));
        let (start, end) = (lerp(&self.start, &self.end, part[0]), lerp(&self.start, &self.end, part[1]));
        let length = self.t[1] - self.t[0];
        let t = [self.t[0] + part[0] * length, self.t[0] + part[1] * length];
        let s = [self.s[0] + (t[0] - self.t[0]), self.s[1] - (self.t[1] - t[1])];
        self.start = axes!(a => begins_later.select(start[a], self.start[a]));
        self.end = axes!(a => ends_sooner.select(end[a], self.end[a]));
        self.t = [begins_later.select(t[0], self.t[0]), ends_sooner.select(t[1], self.t[1])];
        self.s = [begins_later.select(s[0], self.s[0]), ends_sooner.select(s[1], self.s[1])];
        self.s[1] = self.s[1].max(self.s[0]);
        self.is_first &= !begins_later;
        self.at_face = begins_later | (parts.first_at_face & !is_second);
        self.there &= part[0].simd_lt(NO_PART);
        let again = self.there & !is_second & parts.have_second();
        (self, again)
    }

    /// Ends where nothing more is asked for.
    #[inline(always)]
    pub fn until(mut self, s_max: Floats<S>) -> Self {
        let cut = self.s[1].simd_gt(s_max);
        if cut.any_true() {
            let u = ((s_max - self.s[0]) / (self.s[1] - self.s[0])).max(0.0);
            let end = lerp(&self.start, &self.end, u);
            self.end = axes!(a => cut.select(end[a], self.end[a]));
            self.s[1] = cut.select(s_max.max(self.s[0]), self.s[1]);
        }
        self
    }
}

/// The way of the rays of `of` through the cells that they are in, each read and left for the next; of what lies within a solid one part after
/// the other.
#[inline(always)]
pub(super) fn cross_cell<S: Simd>(
    simd: S,
    field: &Field<'_>,
    pace: &Pace<S>,
    at: &InBrick<S>,
    place: &mut Place<S>,
    of: Mask<S>,
) -> CellPass<S> {
    let (t_exit, axis) = exit_of(pace, at, place);
    let (corner, cell, t) = (at.corner(), place.cell, place.t);
    let corner = axes!(a => corner[a] + cell[a].to_int::<Ints<S>>());
    let f = field.corners(simd, &corner, of);
    // Where it enters is where it left the cell before, the same number.
    let is_first = !(place.entry[0] | place.entry[1] | place.entry[2]);
    let p = axes!(a => {
        let face = pace.forward[a].select(cell[a], cell[a] + 1.0);
        is_first.select(at.p[a], point(pace, at, t, cell[a], a, place.entry[a], face))
    });
    let q = axes!(a => {
        let face = pace.forward[a].select(cell[a] + 1.0, cell[a]);
        point(pace, at, t_exit, cell[a], a, axis[a], face)
    });
    let (start, end) = (axes!(a => p[a] - cell[a]), axes!(a => q[a] - cell[a]));
    // Where the line begins is the same number for all volumes: cuts of several meet there.
    let begins = is_first & !(at.entry[0] | at.entry[1] | at.entry[2]);
    let s = [begins.select(at.begin, at.s + t), at.s + t_exit];
    let whole = CellPass { cell: corner, f, start, end, s, t: [t, t_exit], is_first, at_face: Mask::splat(simd, false), there: of };
    let Some(parts) = field.solid.and_then(
        #[inline(always)]
        |solid| within::parts(simd, solid, &whole.cell, [&whole.start, &whole.end], of),
    ) else {
        place.step(pace, t_exit, &axis, of);
        return whole;
    };
    let (part, again) = whole.within(&parts, place.is_second);
    place.step(pace, t_exit, &axis, of & !again);
    place.is_second |= of & again;
    part
}

/// The first entries within the cells of the rays of `of`; where there is none, the place is the next cell.
#[inline(always)]
pub(super) fn solve<S: Simd>(
    simd: S,
    field: &Field<'_>,
    method: Option<Method>,
    pace: &Pace<S>,
    at: &InBrick<S>,
    place: &mut Place<S>,
    of: Mask<S>,
) -> Hit<S> {
    let CellPass { cell, f, start, end, t, is_first, at_face, there, .. } = cross_cell(simd, field, pace, at, place, of);
    let of = of & there;
    let Entry { found, u } = match method {
        Some(Method::Solver(solver)) => roots::first_entry(simd, solver, &f, &start, &end, of),
        Some(Method::Spline) => {
            spline::first_entry(simd, &field.source.taps(field.dims, &cell, of), [field.level, field.sign], &start, &end, of)
        }
        Some(Method::Voxels) => voxels::first_entry(simd, &f, &start, &end, of),
        None => {
            black_box(&f);
            Entry { found: Mask::splat(simd, false), u: Floats::splat(simd, 0.0) }
        }
    };
    let at_entry = found & u.simd_eq(0.0) & is_first;
    let mut met = if at_entry.any_true() { field.met_at_entry(simd, pace, at).only(at_entry) } else { Met::isosurface(simd) };
    met.solid = found & u.simd_eq(0.0) & at_face & met.is_isosurface();
    let s = met.start.select(at.begin, at.s + t[0] + u * (t[1] - t[0]));
    Hit { found, s, cell, local: lerp(&start, &end, u), met }
}

/// A coordinate of where rays are at t, on the face of a cell across an axis.
#[inline(always)]
fn point<S: Simd>(
    pace: &Pace<S>,
    at: &InBrick<S>,
    t: Floats<S>,
    cell: Floats<S>,
    a: usize,
    is_axis: Mask<S>,
    face: Floats<S>,
) -> Floats<S> {
    is_axis.select(face, (at.origin[a] + t * pace.direction[a]).max(cell).min(cell + 1.0))
}
