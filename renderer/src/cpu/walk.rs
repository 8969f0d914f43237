//! Following sixteen rays to their first hits: leaps between range bricks, until each is in one that may hold the surface; what is done
//! there is `advance` and `solve` of `cells.rs`, or `steps.rs`.
//!
//! The twin of `shaders/walk.wgsl`. There, where no float64 exists, a line is a pair of float32 numbers; here it is float64.
//! In both, positions become float32 only relative to a brick's corner, where they are good to a millionth of a voxel:
//! a float32 position across a whole scan is not, and at grazing incidence a small error sideways is a large one in depth.

use super::cells::{self, Place};
use super::fetch::Source;
use super::steps;
use crate::lanes::{Doubles, Floats, Ints, LANES, Mask, Vecs, axes, numbers};
use crate::roots::{Method, Solver};
use crate::skip::{CellMasks, DistanceMap, WORDS};
use bregma_field::BRICK;
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// Rays of pixels in index space: `origin + s·direction`, s in mm of depth behind the picture's base plane.
#[derive(Clone, Copy)]
pub(crate) struct Lines<S: Simd> {
    pub origin: [Doubles<S>; 3],
    pub direction: [Doubles<S>; 3],
}

impl<S: Simd> Lines<S> {
    #[inline(always)]
    pub fn at(&self, s: Floats<S>) -> [Doubles<S>; 3] {
        let s = Doubles::of(s);
        axes!(a => self.origin[a] + s * self.direction[a])
    }
}

/// Which part of each line is asked for.
#[derive(Clone, Copy)]
pub(crate) struct Part<S: Simd> {
    /// Where the line begins: at the eye, a hit, or a cut.
    pub begin: Floats<S>,
    /// Before here nothing is.
    pub s_min: Floats<S>,
    /// After here nothing is asked for.
    pub s_max: Floats<S>,
}

/// Where rays first enter the bone.
#[derive(Clone, Copy)]
pub(crate) struct Hits<S: Simd> {
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

/// What rays meet at their hits: the isosurface, or one of these.
#[derive(Clone, Copy)]
pub(crate) struct Met<S: Simd> {
    /// The cut face of a bone that the scan's box cuts, across an axis.
    pub face: [Mask<S>; 3],
    /// Where the line begins: the viewer stands inside bone, or it is cut there.
    pub start: Mask<S>,
}

impl<S: Simd> Met<S> {
    #[inline(always)]
    pub fn isosurface(simd: S) -> Self {
        let none = Mask::splat(simd, false);
        Self { face: [none; 3], start: none }
    }

    #[inline(always)]
    pub fn only(self, of: Mask<S>) -> Self {
        Self { face: axes!(a => self.face[a] & of), start: self.start & of }
    }

    #[inline(always)]
    pub fn is_isosurface(self) -> Mask<S> {
        !(self.face[0] | self.face[1] | self.face[2] | self.start)
    }
}

impl<S: Simd> Hits<S> {
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
    }
}

/// One volume, ready to be walked.
#[derive(Clone, Copy)]
pub(crate) struct Field<'a> {
    pub source: Source<'a>,
    pub dims: [i32; 3],
    pub map: &'a DistanceMap,
    pub masks: &'a CellMasks,
    pub level: f32,
    pub sign: f32,
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
    fn new(simd: S, direction: Vecs<S>) -> Self {
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

/// Rays on their way from place to place where something must be solved.
pub(crate) struct Walk<'a, S: Simd> {
    pub rays: Walkers<'a, S>,
    pub at: InBrick<S>,
    pub place: Place<S>,
}

/// Rays on their way from brick to brick.
pub(crate) struct Walkers<'a, S: Simd> {
    lines: &'a Lines<S>,
    pub pace: Pace<S>,
    /// Where s is 0, as float32.
    origin: Vecs<S>,
    /// At or near the entry of each ray's brick.
    s: Floats<S>,
    /// Where they leave the box or what is asked for.
    s_out: Floats<S>,
    part: Part<S>,
    brick: [Ints<S>; 3],
    /// The brick's number, i fastest, and its distance.
    number: Ints<S>,
    distance: Ints<S>,
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
    fn nowhere(simd: S) -> Self {
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
    fn enter(&mut self, new: &Self) {
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

impl<'a> Field<'a> {
    /// The first entries into the bone along `part` of `lines`, of the rays of `asked`, or where that begins, or at the box's face, where
    /// that is inside. Without a method cells' corners are fetched and nothing is found, to time that.
    pub fn first_hits<S: Simd>(&self, simd: S, method: Option<Method>, lines: &Lines<S>, part: &Part<S>, asked: Mask<S>) -> Hits<S> {
        // Compiled by itself and called, for rays from the eye and for those to the light.
        simd.vectorize(
            #[inline(always)]
            || self.walk(simd, method, lines, part, asked),
        )
    }

    #[inline(always)]
    fn walk<S: Simd>(&self, simd: S, method: Option<Method>, lines: &Lines<S>, part: &Part<S>, asked: Mask<S>) -> Hits<S> {
        let mut hits = Hits::none(simd);
        let (mut walk, mut walking) = self.begin(simd, lines, part, asked);
        while walking.any_true() {
            let mut found_by_steps = Mask::splat(simd, false);
            walking = self.arrive(
                simd,
                &mut walk,
                walking,
                #[inline(always)]
                |walk, within| {
                    if let Some(Method::Solver(Solver::Step(steps))) = method {
                        let found = steps::walk(simd, self, steps.number(), &walk.rays.pace, &walk.at, within);
                        hits.add(&found);
                        found_by_steps |= found.found;
                        found.found
                    } else {
                        cells::advance(simd, self, &walk.rays.pace, &walk.at, &mut walk.place, within)
                    }
                },
            );
            walking &= !found_by_steps;
            if walking.any_true() {
                let found = cells::solve(simd, self, method, &walk.rays.pace, &walk.at, &mut walk.place, walking);
                hits.add(&found);
                walking &= !found.found;
            }
        }
        hits.found &= hits.s.simd_le(part.s_max);
        hits
    }

    /// Rays at the start of their way along the part of `lines` that is asked for, and which of `asked` have one.
    #[inline(always)]
    pub fn begin<'l, S: Simd>(&self, simd: S, lines: &'l Lines<S>, part: &Part<S>, asked: Mask<S>) -> (Walk<'l, S>, Mask<S>) {
        let bricks = self.map.dims().map(|n| n as i32);
        let pace = Pace::new(simd, axes!(a => lines.direction[a].to_floats()));
        let origin = axes!(a => lines.origin[a].to_floats());
        let (s, s_out) = self.clip_to_box(&origin, &pace, part);
        let there = bricks_of(lines.at(s));
        let brick = axes!(a => there[a].max(0).min(bricks[a] - 1));
        let zero = Ints::splat(simd, 0);
        let rays = Walkers { lines, pace, origin, s, s_out, part: *part, brick, number: zero, distance: zero };
        let walking = if bricks.contains(&0) { Mask::splat(simd, false) } else { asked & s.simd_le(s_out) };
        (Walk { rays, at: InBrick::nowhere(simd), place: Place::nowhere(simd) }, walking)
    }

    /// Takes the rays of `seeking` to the next place where something must be solved, be it bricks away, and says which of them get to one;
    /// the others have left the box, or what is asked for. `in_brick` says which of some rays within bricks have arrived.
    #[inline(always)]
    pub fn arrive<S: Simd>(
        &self,
        simd: S,
        walk: &mut Walk<'_, S>,
        mut seeking: Mask<S>,
        mut in_brick: impl FnMut(&mut Walk<'_, S>, Mask<S>) -> Mask<S>,
    ) -> Mask<S> {
        let none = Mask::splat(simd, false);
        let mut there = none;
        loop {
            let is_new = seeking & !walk.at.rays;
            if is_new.any_true() {
                self.look_up(simd, &mut walk.rays, is_new);
                let entering = is_new & walk.rays.distance.simd_eq(0);
                if entering.any_true() {
                    let (new, cells) = self.enter_brick(simd, &walk.rays, entering);
                    walk.at.enter(&new);
                    walk.place.enter(&walk.rays.pace, &new, &cells);
                }
            }
            let within = seeking & walk.at.rays;
            let arrived = if within.any_true() { in_brick(walk, within) } else { none };
            there |= arrived;
            seeking &= !arrived;
            if !seeking.any_true() {
                return there;
            }
            walk.at.rays &= !seeking;
            seeking &= self.leave(&mut walk.rays, seeking);
            if !seeking.any_true() {
                return there;
            }
        }
    }

    /// Takes the rays of `of` to the brick behind the block of bricks that are known to be empty, or behind their brick alone, and says
    /// which are still in the box and the span.
    #[inline(always)]
    fn leave<S: Simd>(&self, rays: &mut Walkers<'_, S>, of: Mask<S>) -> Mask<S> {
        let (pace, brick) = (&rays.pace, rays.brick);
        let bricks = self.map.dims().map(|n| n as i32);
        let reach = rays.distance.max(1) - 1;
        let low = axes!(a => brick[a] - reach);
        let high = axes!(a => brick[a] + reach);
        let s_planes = axes!(a => {
            let plane = pace.forward[a].select(high[a] + 1, low[a]) * BRICK as i32;
            pace.until_plane(a, plane.to_float(), rays.origin[a], FAR)
        });
        let (s_exit, axis) = least(&s_planes);
        rays.s = of.select(rays.s.max(s_exit), rays.s);
        // A ray never turns back: other axes stay between this brick and the block's far side.
        let there = bricks_of(rays.lines.at(rays.s));
        let next = axes!(a => {
            let stay = there[a].max(pace.forward[a].select(brick[a], low[a])).min(pace.forward[a].select(high[a], brick[a]));
            axis[a].select(pace.forward[a].select(high[a] + 1, low[a] - 1), stay.max(0).min(bricks[a] - 1))
        });
        let outside = axes!(a => next[a].simd_lt(0) | next[a].simd_ge(bricks[a]));
        let inside = of & s_exit.simd_lt(rays.s_out) & !(outside[0] | outside[1] | outside[2]);
        rays.brick = axes!(a => inside.select(next[a], brick[a]));
        inside
    }

    /// Looks up the bricks of the rays of `of`.
    #[inline(always)]
    fn look_up<S: Simd>(&self, simd: S, rays: &mut Walkers<'_, S>, of: Mask<S>) {
        let [nx, ny, _] = self.map.dims().map(|n| n as i32);
        let [x, y, z] = rays.brick;
        rays.number = of.select((z * ny + y) * nx + x, rays.number);
        let (number, mut distances) = (rays.number.to_array(), [0; LANES]);
        for lane in numbers(of) {
            distances[lane] = i32::from(self.map.distances()[number[lane] as usize]);
        }
        rays.distance = of.select(Ints::load_array(simd, distances), rays.distance);
    }

    /// First and last s within the box of the interpolant, and the span that is asked for; the first is the larger where it is missed.
    #[inline(always)]
    fn clip_to_box<S: Simd>(&self, origin: &Vecs<S>, pace: &Pace<S>, part: &Part<S>) -> (Floats<S>, Floats<S>) {
        let simd = part.begin.token();
        let zero = Floats::splat(simd, 0.0);
        let last = self.dims.map(|n| Floats::splat(simd, (n - 1) as f32));
        let beside = axes!(a => !pace.moves[a] & (origin[a].simd_lt(zero) | origin[a].simd_gt(last[a])));
        let near = axes!(a => pace.until_plane(a, pace.forward[a].select(zero, last[a]), origin[a], 0.0));
        let far = axes!(a => pace.until_plane(a, pace.forward[a].select(last[a], zero), origin[a], FAR));
        let s_in = part.s_min.max(part.begin).max(near[0]).max(near[1]).max(near[2]);
        let s_out = part.s_max.min(far[0]).min(far[1]).min(far[2]);
        (s_in, (beside[0] | beside[1] | beside[2]).select(Floats::splat(simd, -FAR), s_out))
    }

    /// Where the rays of `of` enter the box of the cells that can hold the surface, in a brick of which `s` is at or near the entry, and the
    /// first and last of these cells along each side; some miss it.
    #[inline(always)]
    fn enter_brick<S: Simd>(&self, simd: S, rays: &Walkers<'_, S>, of: Mask<S>) -> (InBrick<S>, [Vecs<S>; 2]) {
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

    /// What a ray meets that is inside where it enters a brick: the box's face, the line's start, or (within rounding of a
    /// face between two bricks) the isosurface.
    #[inline(always)]
    pub fn met_at_entry<S: Simd>(&self, simd: S, pace: &Pace<S>, at: &InBrick<S>) -> Met<S> {
        let face = axes!(a => {
            let outermost = pace.forward[a].select(Ints::splat(simd, 0), Ints::splat(simd, self.dims[a] - 1));
            at.entry[a] & (at.brick[a] * BRICK as i32 + at.p[a].to_int::<Ints<S>>()).simd_eq(outermost)
        });
        Met { face, start: !(at.entry[0] | at.entry[1] | at.entry[2]) }
    }

    /// Corner values of cells relative to the level, positive inside; corner x + 2y + 4z is at (x, y, z).
    #[inline(always)]
    pub fn corners<S: Simd>(&self, simd: S, cell: &[Ints<S>; 3], of: Mask<S>) -> [Floats<S>; 8] {
        let f = self.source.corners(simd, cell, of);
        let at = |c: usize| self.sign * (f[c] - self.level);
        [at(0), at(1), at(2), at(3), at(4), at(5), at(6), at(7)]
    }
}

/// The bricks of points.
#[inline(always)]
fn bricks_of<S: Simd>(p: [Doubles<S>; 3]) -> [Ints<S>; 3] {
    axes!(a => {
        let floats = p[a].to_floats();
        let scale = Doubles::splat(floats.token(), 1.0 / BRICK as f64);
        (p[a] * scale).floor().to_floats().to_int()
    })
}

/// The smallest value and its axis, the first of equal ones.
#[inline(always)]
pub(super) fn least<S: Simd>(v: &Vecs<S>) -> (Floats<S>, [Mask<S>; 3]) {
    let second = v[1].simd_lt(v[0]);
    let of_two = v[0].min(v[1]);
    let third = v[2].simd_lt(of_two);
    (of_two.min(v[2]), [!third & !second, !third & second, third])
}
