//! The integral of the interpolant along rays: through all cells of a volume, whatever they hold, so that nothing is asked but where the next one
//! is, and all rays of a packet step at once.
//!
//! `shaders/project.wgsl` has it among the other projections, from brick to brick: there each ray reads for itself, and waits for no other.

use super::brick::{FAR, Pace, least};
use super::project::{Projected, TWO_POINTS, Way};
use super::samples::{Pairs, Source, rows_of_edges};
use super::volume::Field;
use super::walk::Walk;
use crate::lanes::{Doubles, Floats, Ints, Vecs, axes, numbers};
use bregma_field::{Block, with_block};
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// The integrals over depth along the rays of some packets, relative to the level, and these depths. Packets that lie together go on together: so they
/// pass through the same samples while these are in the cache nearest to the core.
#[inline(always)]
pub(super) fn integrals<S: Simd>(simd: S, field: &Field<'_>, packets: &[Way<S>]) -> Vec<Projected<S>> {
    match field.source {
        Source::Samples(samples) => with_block!(samples, block => of_samples(simd, &block, field, packets)),
        Source::Nothing => vec![],
    }
}

/// A packet on its way, and what has been gathered on it.
struct Traveller<S: Simd> {
    pace: Pace<S>,
    /// Depths.
    begin: Floats<S>,
    end: Floats<S>,
    sum: Doubles<S>,
}

impl<S: Simd> Traveller<S> {
    /// Its part between two depths.
    #[inline(always)]
    fn between(&self, from: f32, to: f32) -> [Floats<S>; 2] {
        [self.begin.max(from).min(self.end), self.end.min(to).max(self.begin)]
    }
}

/// So many cells along one axis are passed from one place where positions are taken from float64 to the next: few enough that float32 keeps them to a
/// millionth of a voxel, relative to there.
const CELLS: f32 = 8.0;

#[inline(always)]
fn of_samples<S: Simd, T: Pairs>(simd: S, block: &Block<'_, T>, field: &Field<'_>, packets: &[Way<S>]) -> Vec<Projected<S>> {
    let zero = Floats::splat(simd, 0.0);
    let (mut travellers, mut all) = (Vec::with_capacity(packets.len()), Vec::with_capacity(packets.len()));
    // From where to where any of them goes, and how far voxels are apart at most that they pass in a mm of depth.
    let (mut from, mut until, mut fastest) = (FAR, -FAR, 0.0_f32);
    for packet in packets {
        let (Walk { rays, .. }, walking) = field.begin(simd, &packet.lines, &packet.part, packet.asked);
        let found = walking & rays.s.simd_lt(rays.s_out);
        let (begin, end) = (found.select(rays.s, zero), found.select(rays.s_out, zero));
        for lane in numbers(found) {
            (from, until) = (from.min(begin[lane]), until.max(end[lane]));
            fastest = axes!(a => rays.pace.direction[a][lane].abs()).into_iter().fold(fastest, f32::max);
        }
        all.push(Projected { found, value: zero, depth: end - begin });
        travellers.push(Traveller { pace: rays.pace, begin, end, sum: Doubles::splat(simd, 0.0) });
    }
    let step = CELLS / fastest;
    while from < until {
        // Never so small that it would be lost in rounding.
        let to = (from + step).max(from.next_up());
        for (t, packet) in travellers.iter_mut().zip(packets) {
            let [begin, end] = t.between(from, to);
            if begin.simd_lt(end).any_true() {
                let at = packet.lines.at(begin);
                t.sum = t.sum + Doubles::of(through(simd, block, field, &t.pace, &at, end - begin));
            }
        }
        from = to;
    }
    all.iter_mut().zip(&travellers).for_each(|(one, t)| one.value = field.sign * t.sum.to_floats());
    all
}

/// The integral from `at` on, so far in depth.
#[inline(always)]
fn through<S: Simd, T: Pairs>(
    simd: S,
    block: &Block<'_, T>,
    field: &Field<'_>,
    pace: &Pace<S>,
    at: &[Doubles<S>; 3],
    left: Floats<S>,
) -> Floats<S> {
    let [mut here, mut next] = [T::Edges::default(); 2];
    let mut some = SomeCells::begin(simd, block, field, pace, at, left);
    some.read(&mut here);
    loop {
        if !some.cross(simd, &here, &mut next) || !some.cross(simd, &next, &mut here) {
            return 0.5 * some.sum;
        }
    }
}

/// Rays on their way through some cells, seen from where they began, in the cell of each that counts from there.
///
/// ```text
///   │   ×    │ ×  │  ×     ×  │      in each cell the cubic at two points is enough (Gauss and Legendre)
///   0 ─► t ───► exit         left
/// ```
struct SomeCells<'a, S: Simd, T: Pairs> {
    /// See [`rows_of_edges`].
    rows: [&'a [T]; 4],
    level: f32,
    pace: &'a Pace<S>,
    /// Where they began, relative to the lowest corners of the cells there.
    origin: Vecs<S>,
    /// How far they go.
    left: Floats<S>,
    /// Toward the next cells.
    side: Vecs<S>,
    stride: [Ints<S>; 3],
    /// The cells that they are in, by their lowest corners, and by the faces that they may leave through.
    corner: Vecs<S>,
    exit: Vecs<S>,
    number: Ints<S>,
    t: Floats<S>,
    /// Twice the integral up to there.
    sum: Floats<S>,
}

impl<'a, S: Simd, T: Pairs> SomeCells<'a, S, T> {
    #[inline(always)]
    fn begin(simd: S, block: &Block<'a, T>, field: &Field<'_>, pace: &'a Pace<S>, at: &[Doubles<S>; 3], left: Floats<S>) -> Self {
        let splat = |v: f32| Floats::splat(simd, v);
        let strides = [1, field.dims[0], field.dims[0] * field.dims[1]];
        let cell = axes!(a => at[a].floor().to_floats().to_int::<Ints<S>>().max(0).min(field.dims[a] - 2));
        let number = cell[0] + cell[1] * strides[1] + cell[2] * strides[2];
        Self {
            rows: rows_of_edges(block),
            level: field.level,
            pace,
            origin: axes!(a => (at[a] - Doubles::of(cell[a].to_float())).to_floats()),
            left,
            side: axes!(a => pace.forward[a].select(splat(1.0), splat(-1.0))),
            stride: axes!(a => pace.forward[a].select(Ints::splat(simd, strides[a]), Ints::splat(simd, -strides[a]))),
            corner: [splat(0.0); 3],
            exit: axes!(a => pace.forward[a].select(splat(1.0), splat(0.0))),
            number,
            t: splat(0.0),
            sum: splat(0.0),
        }
    }

    /// Reads the corners of the cells.
    #[inline(always)]
    fn read(&self, edges: &mut T::Edges) {
        // Rounding may lead behind the last cell, for a millionth of a voxel.
        let last = self.rows[0].len() as i32 - 2;
        let number = self.number.max(0).min(last).to_array();
        for (lane, n) in number.into_iter().enumerate() {
            T::read(edges, lane, &self.rows, n as usize);
        }
    }

    /// Takes all through their cells, whose corners are `here`, and reads those of the `next` before what is here is reckoned: reading waits for
    /// memory, and reckoning for nothing else. Says whether any goes on.
    #[inline(always)]
    fn cross(&mut self, simd: S, here: &T::Edges, next: &mut T::Edges) -> bool {
        let (pace, t) = (self.pace, self.t);
        let t_faces = axes!(a => pace.until_plane(a, self.exit[a], self.origin[a], FAR));
        let (t_exit, axis) = least(&t_faces);
        let to = t_exit.min(self.left).max(t);
        let going = t_exit.simd_lt(self.left);
        let at = axes!(a => self.origin[a] - self.corner[a]);
        let zero = Ints::splat(simd, 0);
        let step = axes!(a => (axis[a] & going).select(self.stride[a], zero));
        self.number = self.number + step[0] + step[1] + step[2];
        self.corner = axes!(a => (axis[a] & going).select(self.corner[a] + self.side[a], self.corner[a]));
        self.exit = axes!(a => (axis[a] & going).select(self.exit[a] + self.side[a], self.exit[a]));
        self.t = to;
        self.read(next);
        let length = to - t;
        let (middle, half) = ((t + to) * 0.5, length * TWO_POINTS);
        let at = axes!(a => at[a] + middle * pace.direction[a]);
        let reach = axes!(a => half * pace.direction[a]);
        let f = T::corners(simd, here);
        let both = at_both(&f, self.level, &axes!(a => at[a] - reach[a]), &axes!(a => at[a] + reach[a]));
        self.sum += both * length;
        going.any_true()
    }
}

/// The interpolant of corner values at two points, one added to the other, relative to a level.
#[inline(always)]
fn at_both<S: Simd>(f: &[Floats<S>; 8], level: f32, p: &Vecs<S>, q: &Vecs<S>) -> Floats<S> {
    // Differences along x are the same at both.
    let lower = [f[0] - level, f[2] - level, f[4] - level, f[6] - level];
    let along = [f[1] - f[0], f[3] - f[2], f[5] - f[4], f[7] - f[6]];
    on_edges(&lower, &along, p) + on_edges(&lower, &along, q)
}

/// The interpolant at a point, of the values at the lower ends of the edges along x and how they change along these.
#[inline(always)]
fn on_edges<S: Simd>(lower: &[Floats<S>; 4], along: &[Floats<S>; 4], [x, y, z]: &Vecs<S>) -> Floats<S> {
    let [a, b, c, d] = [lower[0] + *x * along[0], lower[1] + *x * along[1], lower[2] + *x * along[2], lower[3] + *x * along[3]];
    let [low, high] = [a + *y * (b - a), c + *y * (d - c)];
    low + *z * (high - low)
}
