//! Range bricks, and the ways of rays into them.
//!
//! The twin of `shaders/brick.wgsl`.

use super::line::{Line, Part};
use super::volume::Field;
use crate::lanes::{Doubles, Floats, Ints, LANES, Mask, Vecs, axes, numbers};
use crate::skip::WORDS;
use bregma_field::BRICK;
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// Where rays first enter the bone.
#[derive(Clone, Copy)]
pub(crate) struct Hit<S: Simd> {
    /// Which do.
    pub found: Mask<S>,
    /// Depth behind the base plane, mm.
    pub s: Floats<S>,
    /// The cell, by its lowest sample.
    pub cell: [Ints<S>; 3],
    /// Position in the cell, [0, 1]³.
    pub local: Vecs<S>,
    /// What was met.
    pub met: Met<S>,
}

impl<S: Simd> Hit<S> {
    #[inline(always)]
    pub fn none(simd: S) -> Self {
        let (zero, none) = (Floats::splat(simd, 0.0), Mask::splat(simd, false));
        Self { found: none, s: zero, cell: [Ints::splat(simd, 0); 3], local: [zero; 3], met: Met::isosurface(simd) }
    }

    /// Takes over those of `other`, which are none of these.
    #[inline(always)]
    pub fn add(&mut self, other: &Self) {
        let new = other.found;
        self.found |= new;
        self.s = new.select(other.s, self.s);
        self.cell = axes!(a => new.select(other.cell[a], self.cell[a]));
        self.local = axes!(a => new.select(other.local[a], self.local[a]));
        self.met.face = axes!(a => self.met.face[a] | other.met.face[a] & new);
        self.met.start |= other.met.start & new;
        self.met.solid |= other.met.solid & new;
    }
}

/// What rays meet at their hits: the isosurface, or one of these.
#[derive(Clone, Copy)]
pub(crate) struct Met<S: Simd> {
    /// The cut face of a bone that the scan's box cuts, across an axis.
    pub face: [Mask<S>; 3],
    /// Where the line begins: the viewer stands inside bone, or it is cut there.
    pub start: Mask<S>,
    /// The face that a solid cuts the bone with.
    pub solid: Mask<S>,
}

impl<S: Simd> Met<S> {
    #[inline(always)]
    pub fn isosurface(simd: S) -> Self {
        let none = Mask::splat(simd, false);
        Self { face: [none; 3], start: none, solid: none }
    }

    #[inline(always)]
    pub fn only(self, of: Mask<S>) -> Self {
        Self { face: axes!(a => self.face[a] & of), start: self.start & of, solid: self.solid & of }
    }

    #[inline(always)]
    pub fn is_isosurface(self) -> Mask<S> {
        !(self.face[0] | self.face[1] | self.face[2] | self.start | self.solid)
    }
}

/// Below this a direction component (voxels per mm of depth) counts as none: over the 10 m that a scene may be deep it
/// moves a ray by less than 1e-8 voxel, far below what a float32 position resolves.
pub(crate) const STILL: f32 = 1e-12;

/// Farther than any scene, and finite: shaders may not rely on infinities.
pub(crate) const FAR: f32 = 1e30;

/// Directions with what stepping along them needs.
#[derive(Clone, Copy)]
pub(crate) struct Pace<S: Simd> {
    pub direction: Vecs<S>,
    inverse: Vecs<S>,
    /// Whether they move along each axis, and upward.
    pub moves: [Mask<S>; 3],
    pub forward: [Mask<S>; 3],
}

impl<S: Simd> Pace<S> {
    #[inline(always)]
    pub fn new(simd: S, direction: Vecs<S>) -> Self {
        let zero = Floats::splat(simd, 0.0);
        let moves = axes!(a => direction[a].abs().simd_ge(STILL));
        let inverse = axes!(a => moves[a].select(1.0 / direction[a], zero));
        Self { direction, inverse, moves, forward: axes!(a => direction[a].simd_gt(0.0)) }
    }

    /// Distances from the coordinate `p` to `plane` along axis `a`; `other` where it is never reached.
    #[inline(always)]
    pub fn until_plane(&self, a: usize, plane: Floats<S>, p: Floats<S>, other: f32) -> Floats<S> {
        self.moves[a].select((plane - p) * self.inverse[a], Floats::splat(plane.token(), other))
    }
}

/// The smallest value and its axis, the first of equal ones.
#[inline(always)]
pub(super) fn least<S: Simd>(v: &Vecs<S>) -> (Floats<S>, [Mask<S>; 3]) {
    let second = v[1].simd_lt(v[0]);
    let of_two = v[0].min(v[1]);
    let third = v[2].simd_lt(of_two);
    (of_two.min(v[2]), [!third & !second, !third & second, third])
}

/// The bricks of points.
#[inline(always)]
pub(super) fn brick_of<S: Simd>(p: [Doubles<S>; 3]) -> [Ints<S>; 3] {
    axes!(a => {
        let floats = p[a].to_floats();
        let scale = Doubles::splat(floats.token(), 1.0 / BRICK as f64);
        (p[a] * scale).floor().to_floats().to_int()
    })
}

/// Rays on their way from brick to brick.
pub(crate) struct Walkers<'a, S: Simd> {
    pub lines: &'a Line<S>,
    pub pace: Pace<S>,
    /// Where s is 0, as float32.
    pub origin: Vecs<S>,
    /// At or near the entry of each ray's brick.
    pub s: Floats<S>,
    /// Where they leave the box or what is asked for.
    pub s_out: Floats<S>,
    pub part: Part<S>,
    pub brick: [Ints<S>; 3],
    /// The brick's number, i fastest, and its distance.
    pub number: Ints<S>,
    pub distance: Ints<S>,
}

/// Rays in bricks. Positions are relative to the brick's corner, t to s.
#[derive(Clone, Copy)]
pub(crate) struct InBrick<S: Simd> {
    /// Which rays are in one.
    pub rays: Mask<S>,
    pub brick: [Ints<S>; 3],
    /// Where its mask begins.
    mask: Ints<S>,
    /// Depth behind the base plane where t is 0, mm.
    pub s: Floats<S>,
    /// Position where t is 0.
    pub origin: Vecs<S>,
    /// Where the line begins; in s.
    pub begin: Floats<S>,
    /// Where the ray enters and leaves.
    pub t: Floats<S>,
    pub t_out: Floats<S>,
    /// Where it leaves or nothing more is asked for.
    pub t_end: Floats<S>,
    /// Position where it enters; exact on the axis that it enters along.
    pub p: Vecs<S>,
    pub entry: [Mask<S>; 3],
}

impl<S: Simd> InBrick<S> {
    /// No ray is in a brick.
    #[inline(always)]
    pub fn nowhere(simd: S) -> Self {
        let (zero, number, none) = (Floats::splat(simd, 0.0), Ints::splat(simd, 0), Mask::splat(simd, false));
        let (at, nothing) = ([zero; 3], [none; 3]);
        Self {
            rays: none,
            brick: [number; 3],
            mask: number,
            s: zero,
            origin: at,
            begin: zero,
            t: zero,
            t_out: zero,
            t_end: zero,
            p: at,
            entry: nothing,
        }
    }

    /// Takes over those of `new`.
    #[inline(always)]
    pub fn enter(&mut self, new: &Self) {
        let is_new = new.rays;
        self.rays |= is_new;
        self.brick = axes!(a => is_new.select(new.brick[a], self.brick[a]));
        self.mask = is_new.select(new.mask, self.mask);
        self.s = is_new.select(new.s, self.s);
        self.origin = axes!(a => is_new.select(new.origin[a], self.origin[a]));
        self.begin = is_new.select(new.begin, self.begin);
        self.t = is_new.select(new.t, self.t);
        self.t_out = is_new.select(new.t_out, self.t_out);
        self.t_end = is_new.select(new.t_end, self.t_end);
        self.p = axes!(a => is_new.select(new.p[a], self.p[a]));
        self.entry = axes!(a => (self.entry[a] & !is_new) | (new.entry[a] & is_new));
    }

    /// First sample of the brick.
    #[inline(always)]
    pub fn corner(&self) -> [Ints<S>; 3] {
        axes!(a => self.brick[a] * BRICK as i32)
    }
}

impl Field<'_> {
    /// Which of the rays of `of` are in cells that can hold the surface.
    #[inline(always)]
    pub fn may_hold<S: Simd>(&self, simd: S, at: &InBrick<S>, cell: &Vecs<S>, of: Mask<S>) -> Mask<S> {
        let bit = ((cell[2] * BRICK as f32 + cell[1]) * BRICK as f32 + cell[0]).to_int::<Ints<S>>();
        let (word, mut words) = ((at.mask + (bit >> 5)).to_array(), [0; LANES]);
        for lane in numbers(of) {
            words[lane] = self.masks.words()[word[lane] as u32 as usize] as i32;
        }
        let shifted = Ints::load_array(simd, words) >> (bit & 31);
        of & (shifted & 1).simd_eq(1)
    }

    /// (rays at or near the entries of bricks) → (where they enter the box of the cells that can hold the surface, the first and last of these
    /// cells along each side); `rays` leaves out those that miss it.
    ///
    /// ```text
    ///   brick ┌───────────────┐
    ///         │   ┌───────┐   │     t = 0 at s, which may lie a little before or behind the brick's face
    ///     s ──┼─► t cells t_out ──► t_end is t_out, or where nothing more is asked for
    ///         │   └───────┘   │     positions are relative to the brick's lowest corner
    ///         └───────────────┘
    /// ```
    #[inline(always)]
    pub fn enter_brick<S: Simd>(&self, simd: S, rays: &Walkers<'_, S>, of: Mask<S>) -> (InBrick<S>, [Vecs<S>; 2]) {
        let Walkers { ref pace, s, part, brick, .. } = *rays;
        let (mut mask, mut cells) = ([0; LANES], [0; LANES]);
        let number = rays.number.to_array();
        for lane in numbers(of) {
            let slot = self.masks.slots()[number[lane] as usize] as usize;
            (mask[lane], cells[lane]) = ((slot * WORDS) as i32, self.masks.boxes()[slot] as i32);
        }
        let (mask, cells) = (Ints::load_array(simd, mask), Ints::load_array(simd, cells));
        let first = axes!(a => ((cells >> (4 * a as u32)) & 15).to_float::<Floats<S>>());
        let end = axes!(a => ((cells >> (12 + 4 * a as u32)) & 15).to_float::<Floats<S>>());
        let corner = axes!(a => brick[a] * BRICK as i32);
        let from = rays.lines.at(s);
        let origin = axes!(a => (from[a] - Doubles::of(corner[a].to_float())).to_floats());
        // From here on t is relative to s: small numbers, small errors. Never before the line begins.
        let t_begin = part.begin - s;
        let near = axes!(a => pace.forward[a].select(first[a], end[a]));
        let far = axes!(a => pace.until_plane(a, pace.forward[a].select(end[a], first[a]), origin[a], FAR));
        let t_near = axes!(a => -pace.until_plane(a, near[a], origin[a], -FAR));
        let (t_entry, axis) = least(&t_near);
        let through_face = (-t_entry).simd_gt(t_begin);
        let t = through_face.select(-t_entry, t_begin);
        let t_out = far[0].min(far[1]).min(far[2]);
        let entry = axes!(a => axis[a] & through_face);
        let p = axes!(a => entry[a].select(near[a], (origin[a] + t * pace.direction[a]).max(first[a]).min(end[a])));
        let rays = of & t.simd_lt(t_out);
        (
            InBrick { rays, brick, mask, s, origin, t, t_out, t_end: t_out.min(part.s_max - s), begin: part.begin, p, entry },
            [first, axes!(a => end[a] - 1.0)],
        )
    }

    /// What a ray meets that is inside where it enters a brick: the box's face, the line's start, or (within rounding of a
    /// face between two bricks) the isosurface.
    #[inline(always)]
    pub fn met_at_entry<S: Simd>(&self, simd: S, pace: &Pace<S>, at: &InBrick<S>) -> Met<S> {
        let face = axes!(a => {
            let outermost = pace.forward[a].select(Ints::splat(simd, 0), Ints::splat(simd, self.dims[a] - 1));
            at.entry[a] & (at.brick[a] * BRICK as i32 + at.p[a].to_int::<Ints<S>>()).simd_eq(outermost)
        });
        Met { face, start: !(at.entry[0] | at.entry[1] | at.entry[2]), solid: Mask::splat(simd, false) }
    }
}
