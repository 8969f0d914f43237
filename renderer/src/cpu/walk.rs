//! Following sixteen rays to their first hits: leaps between range bricks, until each is in one that may hold the surface; what is done
//! there is `advance` and `solve` of `cells.rs`, or `steps.rs`.
//!
//! The twin of `shaders/walk.wgsl`. There, where no float64 exists, a line is a pair of float32 numbers; here it is float64.
//! In both, positions become float32 only relative to a brick's corner, where they are good to a millionth of a voxel:
//! a float32 position across a whole scan is not, and at grazing incidence a small error sideways is a large one in depth.

use super::brick::{FAR, Hit, InBrick, Pace, Walkers, brick_of, least};
use super::cells::{self, CellPass, Place};
use super::line::{Line, Part};
use super::steps;
use super::volume::Field;
use crate::lanes::{Floats, Ints, LANES, Mask, Vecs, axes, numbers};
use crate::roots::{Method, Solver};
use bregma_field::BRICK;
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// Rays on their way from place to place where something must be solved.
pub(crate) struct Walk<'a, S: Simd> {
    pub rays: Walkers<'a, S>,
    pub at: InBrick<S>,
    pub place: Place<S>,
}

impl<'a> Field<'a> {
    /// The first entries into the bone along `part` of `lines`, of the rays of `asked`, or where that begins, or at the box's face, where
    /// that is inside. Without a method cells' corners are fetched and nothing is found, to time that.
    pub fn first_hits<S: Simd>(&self, simd: S, method: Option<Method>, lines: &Line<S>, part: &Part<S>, asked: Mask<S>) -> Hit<S> {
        // Compiled by itself and called, for rays from the eye and for those to the light.
        simd.vectorize(
            #[inline(always)]
            || self.walk(simd, method, lines, part, asked),
        )
    }

    #[inline(always)]
    fn walk<S: Simd>(&self, simd: S, method: Option<Method>, lines: &Line<S>, part: &Part<S>, asked: Mask<S>) -> Hit<S> {
        let mut hits = Hit::none(simd);
        let (mut walk, mut walking) = self.begin(simd, lines, part, asked);
        while walking.any_true() {
            let mut found_by_steps = Mask::splat(simd, false);
            walking = self.arrive(
                simd,
                &mut walk,
                walking,
                every,
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
    pub fn begin<'l, S: Simd>(&self, simd: S, lines: &'l Line<S>, part: &Part<S>, asked: Mask<S>) -> (Walk<'l, S>, Mask<S>) {
        let bricks = self.map.dims().map(|n| n as i32);
        let pace = Pace::new(simd, axes!(a => lines.direction[a].to_floats()));
        let origin = axes!(a => lines.origin[a].to_floats());
        let (s, s_out) = self.clip_to_box(&origin, &pace, part);
        let there = brick_of(lines.at(s));
        let brick = axes!(a => there[a].max(0).min(bricks[a] - 1));
        let zero = Ints::splat(simd, 0);
        let rays = Walkers { lines, pace, origin, s, s_out, part: *part, brick, number: zero, distance: zero };
        let walking = if bricks.contains(&0) { Mask::splat(simd, false) } else { asked & s.simd_le(s_out) };
        (Walk { rays, at: InBrick::nowhere(simd), place: Place::nowhere(simd) }, walking)
    }

    /// (rays, which of them seek) → which have arrived: each at its next place where something must be solved. What seeks and does not arrive
    /// has left the box, or what is asked for. `enters`: (rays, which are at bricks that can hold the surface) → which of these look into them;
    /// `in_brick`: (rays, which are within bricks) → which of these have arrived.
    ///
    /// ```text
    ///   distance 3       2     1    0 (may hold the surface)
    ///   s ───────────────►─────►───►┌─►─►─►┐     leaps over empty bricks, then steps from cell to cell
    /// ```
    #[inline(always)]
    pub fn arrive<S: Simd>(
        &self,
        simd: S,
        walk: &mut Walk<'_, S>,
        mut seeking: Mask<S>,
        mut enters: impl FnMut(&Walkers<'_, S>, Mask<S>) -> Mask<S>,
        mut in_brick: impl FnMut(&mut Walk<'_, S>, Mask<S>) -> Mask<S>,
    ) -> Mask<S> {
        let none = Mask::splat(simd, false);
        let mut there = none;
        loop {
            let is_new = seeking & !walk.at.rays;
            if is_new.any_true() {
                self.look_up(simd, &mut walk.rays, is_new);
                let entering = enters(&walk.rays, is_new & walk.rays.distance.simd_eq(0));
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
    pub fn leave<S: Simd>(&self, rays: &mut Walkers<'_, S>, of: Mask<S>) -> Mask<S> {
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
        let there = brick_of(rays.lines.at(rays.s));
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
}

/// Looks into all bricks.
#[inline(always)]
fn every<S: Simd>(_: &Walkers<'_, S>, of: Mask<S>) -> Mask<S> {
    of
}

/// Takes the rays of `seeking` through the next cells that can hold something: which of them come to one, and their ways through it.
#[inline(always)]
pub(super) fn next_cell<S: Simd>(simd: S, field: &Field<'_>, walk: &mut Walk<'_, S>, seeking: Mask<S>) -> (Mask<S>, CellPass<S>) {
    // Compiled by itself and called, from each mode.
    simd.vectorize(
        #[inline(always)]
        || {
            let (arrived, mut pass) = cell_ahead(simd, field, walk, seeking);
            // Of some cells nothing lies within the solid.
            let (mut there, mut seeking) = (arrived & pass.there, arrived & !pass.there);
            while seeking.any_true() {
                let (arrived, next) = cell_ahead(simd, field, walk, seeking);
                pass.take(&next, arrived & next.there);
                there |= arrived & next.there;
                seeking = arrived & !next.there;
            }
            (there, pass)
        },
    )
}

/// The same, of which nothing may lie within a solid.
#[inline(always)]
fn cell_ahead<S: Simd>(simd: S, field: &Field<'_>, walk: &mut Walk<'_, S>, seeking: Mask<S>) -> (Mask<S>, CellPass<S>) {
    let arrived = field.arrive(
        simd,
        walk,
        seeking,
        every,
        #[inline(always)]
        |walk, within| cells::advance(simd, field, &walk.rays.pace, &walk.at, &mut walk.place, within),
    );
    (arrived, cells::cross_cell(simd, field, &walk.rays.pace, &walk.at, &mut walk.place, arrived))
}
