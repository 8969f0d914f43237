//! The nodes of a slice: values on its plane, and where contours cross the ways between neighbours.
//!
//! The twin of `shaders/slice.wgsl`, which reads every node; here one that another layer hides is passed over where bricks lie far from the contour.

use super::cuts::kept;
use super::faces::ON_FACE_VOXEL;
use super::line::Part;
use super::packets::{Pixels, packets};
use super::project::{Sought, Way, project};
use super::sides::Sides;
use super::volume::{Field, line_of, world_line_of};
use super::within::holds;
use crate::camera::PixelAffine;
use crate::frame::{Frame, FrameLayer};
use crate::lanes::{Doubles, Floats, Ints, LANES, Mask, Vecs, axes, numbers};
use crate::picture::Picture;
use crate::roots::trilinear;
use crate::scene::{CutFace, Scene};
use crate::slice::{self, NO_CROSSING, NodeBand, Nodes};
use bregma_field::BRICK;
use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch};
use std::ops::Range;

/// The picture of a slice.
pub(super) fn draw(level: Level, frame: &Frame, scene: &Scene, [width, height]: [u32; 2], spare: Option<Picture>) -> Picture {
    let across = width * frame.nodes_per_pixel;
    let sought = scene.slice.sought().map(|of| Sought { of, by_gradient: false, in_range: false });
    // Of a thick slice nothing is seen of the plane itself, and densities are seen of the first layer that has one.
    let hides = if sought.is_some() { Some(ALL) } else { (scene.slice.face == CutFace::Density).then_some(0) };
    let begin = || (vec![NodesOf::default(); frame.layers.len()], vec![]);
    let picture = Picture::blank(spare, [width, height], true);
    slice::draw(level, frame, scene, picture, begin, |(all, hidden): &mut (Vec<NodesOf>, Vec<u64>), first, rows, paint| {
        hidden.clear();
        hidden.resize((across as usize).div_ceil(LANES) * rows, hides.unwrap_or(0));
        for (layer, nodes) in frame.layers.iter().zip(&mut *all) {
            nodes.begin((across as usize) * rows);
            let band = Rows { width: across as usize, first: first as u32 };
            dispatch!(level, simd => gather(simd, frame, layer, sought, band, hidden, nodes));
            if hides.is_some() {
                hidden.iter_mut().zip(&nodes.there).for_each(|(hidden, there)| *hidden |= there);
            }
        }
        let layers = all.iter().map(|nodes| Nodes { values: &nodes.values, crossings: &nodes.crossings, crossed: &nodes.crossed });
        paint(&NodeBand { width: across as usize, layers: layers.collect() });
    })
}

/// Bits of all lanes.
const ALL: u64 = (1 << LANES) - 1;

/// Where a band of nodes lies.
#[derive(Clone, Copy)]
struct Rows {
    /// Nodes across.
    width: usize,
    /// The number of its first row.
    first: u32,
}

impl Rows {
    /// Columns and rows of nodes of the band, and which lanes have one.
    #[inline(always)]
    fn pixels<S: Simd>(&self, simd: S, nodes: &[usize]) -> Pixels<S> {
        let (mut x, mut y) = ([0.0; LANES], [0.0; LANES]);
        for (lane, &n) in nodes.iter().enumerate() {
            (x[lane], y[lane]) = ((n % self.width) as f32, (n / self.width + self.first as usize) as f32);
        }
        let doubles = |v| Doubles::of(Floats::load_array(simd, v));
        Pixels { x: doubles(x), y: doubles(y), inside: Mask::from_bitmask(simd, (1 << nodes.len()) - 1) }
    }
}

/// What a band of nodes knows of one layer: [`Nodes`].
#[derive(Clone, Default)]
struct NodesOf {
    /// Of nodes that are hidden, far from the contour, an infinite one says on which side of it they are.
    values: Vec<f32>,
    crossings: Vec<[f32; 2]>,
    crossed: Vec<usize>,
    /// For each sixteen nodes of a row which have a value.
    there: Vec<u64>,
}

impl NodesOf {
    /// Makes room for so many, and forgets what was known of those before; only what was crossed has to be cleared.
    fn begin(&mut self, count: usize) {
        self.crossed.drain(..).for_each(|n| self.crossings[n] = [NO_CROSSING; 2]);
        self.crossings.resize(count, [NO_CROSSING; 2]);
        self.values.resize(count, f32::NAN);
        self.there.clear();
    }
}

/// A band of nodes; those `hidden` show no value, and need one only beside the contour.
#[inline(always)]
fn gather<S: Simd>(simd: S, frame: &Frame, layer: &FrameLayer, sought: Option<Sought>, band: Rows, hidden: &[u64], nodes: &mut NodesOf) {
    if layer.placement.surface.grid.is_flat() {
        nodes.values.fill(f32::NAN);
        return;
    }
    let plane = Plane::of(frame, layer);
    let contour = layer.appearance.contour;
    let mut sides = Sides::new(band.width);
    for (row, values) in (band.first..).zip(nodes.values.chunks_mut(band.width)) {
        let reach = plane.reach(band.width, row);
        for (n, values) in values.chunks_mut(LANES).enumerate() {
            if n * LANES >= reach.end || n * LANES + LANES <= reach.start {
                sides.put(n, 0, 0);
                nodes.there.push(0);
                values.fill(f32::NAN);
                continue;
            }
            let pixels = Pixels::in_row(simd, n * LANES, row, values.len());
            let hidden = Mask::from_bitmask(simd, hidden[nodes.there.len()]);
            let (is, found) = simd.vectorize(
                #[inline(always)]
                || plane.values(simd, &pixels, hidden),
            );
            let there = is.to_bitmask();
            sides.put(n, there, (found - contour).simd_ge(0.0).to_bitmask());
            nodes.there.push(there);
            values.copy_from_slice(&is.select(found, Floats::splat(simd, f32::NAN)).to_array()[..values.len()]);
        }
        sides.end_row();
    }
    plane.cross(simd, band, &sides.ways, nodes);
    if let Some(sought) = sought {
        plane.project(simd, sought, band, &mut nodes.values);
    }
}

/// Steps of a root's search, at most; it takes four or five, where a cell's face is between up to nine.
pub(crate) const MOST_SLICE_STEPS: u32 = 16;
/// A root is known to so much of the way between two nodes: a quarter of what is promised.
pub(crate) const KNOWN_TO: f32 = 1.0 / 4096.0;

/// Farther outside than what counts as on a face, so that a row's reach takes in all of its nodes in the scan, whatever is rounded.
const REACH_VOXEL: f64 = 0.01;
const _: () = assert!(REACH_VOXEL > 2.0 * ON_FACE_VOXEL as f64);

/// What interpolating between numbers rounds, many times over: a share of the largest of them.
const VALUE_MARGIN: f32 = 1e-6;

/// A layer on the plane of a slice.
struct Plane<'a> {
    frame: &'a Frame,
    layer: &'a FrameLayer,
    field: Field<'a>,
    /// The ranges of its bricks, and how many of these lie along i and j.
    ranges: &'a [[f32; 2]],
    bricks: [i32; 2],
    /// Its depth behind the base plane, mm.
    s: f32,
    /// Where it is seen by each pixel, in index space.
    place: PixelAffine,
}

/// Points of the plane.
struct Points<S: Simd> {
    /// Which lie in the scan.
    is: Mask<S>,
    cell: [Ints<S>; 3],
    local: Vecs<S>,
}

/// Some ways between nodes, side by side.
struct Ways<'a> {
    /// Nodes that they begin at.
    at: &'a [usize],
    /// 0 to the right, 1 down.
    axis: usize,
    band: Rows,
}

impl<'a> Plane<'a> {
    fn of(frame: &'a Frame, layer: &'a FrameLayer) -> Self {
        let [near, far] = layer.skip.spans.at(0, 0);
        let s = 0.5 * (near + far);
        let rays = &layer.placement.rays;
        // Rays are parallel: their direction is that of the first.
        let place = PixelAffine { base: rays.origin.base + f64::from(s) * rays.direction.base, ..rays.origin };
        let bricks = layer.placement.surface.volume.bricks();
        let [bx, by, _] = bricks.dims();
        Self { frame, layer, field: Field::of(layer), ranges: bricks.ranges(), bricks: [bx as i32, by as i32], s, place }
    }

    /// The nodes of a row outside of which none lies in the scan.
    fn reach(&self, width: usize, row: u32) -> Range<usize> {
        let (mut first, mut end) = (0.0_f64, width as f64);
        let begin = self.place.base + f64::from(row) * self.place.per_y;
        for a in 0..3 {
            let (at, per_x) = (begin[a], self.place.per_x[a]);
            let (low, high) = (-REACH_VOXEL, f64::from(self.field.dims[a] - 1) + REACH_VOXEL);
            if per_x != 0.0 {
                let (low, high) = ((low - at) / per_x, (high - at) / per_x);
                (first, end) = (first.max(low.min(high)), end.min(low.max(high) + 1.0));
            } else if !(low..=high).contains(&at) {
                return 0..0;
            }
        }
        first as usize..end.max(0.0) as usize
    }

    #[inline(always)]
    fn points<S: Simd>(&self, simd: S, pixels: &Pixels<S>) -> Points<S> {
        let at = pixels.at(simd, &self.place);
        let p = axes!(a => at[a].to_floats());
        let dims = self.field.dims;
        let within = axes!(a => p[a].simd_ge(-ON_FACE_VOXEL) & p[a].simd_le((dims[a] - 1) as f32 + ON_FACE_VOXEL));
        let mut is = pixels.inside & within[0] & within[1] & within[2];
        let region = &self.layer.placement.surface.region;
        if !region.is_all() {
            let s = Floats::splat(simd, self.s);
            let kept = kept(simd, region, &world_line_of(simd, self.frame, pixels));
            is &= kept.begin.simd_le(s) & kept.end.simd_ge(s);
        }
        let cell = axes!(a => p[a].floor().to_int::<Ints<S>>().max(0).min(dims[a] - 2));
        let local = axes!(a => (at[a] - Doubles::of(cell[a].to_float())).to_floats().max(0.0).min(1.0));
        if let Some(solid) = self.field.solid {
            is &= holds(simd, solid, &cell, &local, is);
        }
        Points { is, cell, local }
    }

    /// The values at nodes, and which have one; of those `hidden` and far from the contour an infinite one, by the side that they are on.
    #[inline(always)]
    fn values<S: Simd>(&self, simd: S, pixels: &Pixels<S>, hidden: Mask<S>) -> (Mask<S>, Floats<S>) {
        let Points { is, cell, local } = self.points(simd, pixels);
        let hidden = hidden & is;
        let mut far = Floats::splat(simd, 0.0);
        if hidden.any_true() {
            far = self.sides(simd, &cell, hidden);
        }
        let asked = is & far.simd_eq(0.0);
        if !asked.any_true() {
            return (is, far);
        }
        (is, asked.select(trilinear(&self.field.corners(simd, &cell, asked), &local), far))
    }

    /// Infinity where bricks lie inside of the contour, the negative where they lie outside, and 0 where it may pass through them.
    #[inline(always)]
    fn sides<S: Simd>(&self, simd: S, cell: &[Ints<S>; 3], of: Mask<S>) -> Floats<S> {
        let brick = axes!(a => cell[a] >> BRICK.trailing_zeros());
        let number = (brick[0] + brick[1] * self.bricks[0] + brick[2] * (self.bricks[0] * self.bricks[1])).to_array();
        let mut sides = [0.0; LANES];
        // Neighbours are mostly of one brick.
        let (mut last, mut side) = (-1, 0.0);
        for lane in numbers(of) {
            if number[lane] != last {
                last = number[lane];
                side = self.side(self.ranges[last as usize]);
            }
            sides[lane] = side;
        }
        Floats::load_array(simd, sides)
    }

    fn side(&self, range: [f32; 2]) -> f32 {
        let [a, b] = range.map(|v| self.field.sign * (v - self.field.level));
        let contour = self.layer.appearance.contour;
        let margin = VALUE_MARGIN * a.abs().max(b.abs());
        if a.min(b) - margin > contour {
            f32::INFINITY
        } else if a.max(b) + margin < contour {
            f32::NEG_INFINITY
        } else {
            0.0
        }
    }

    /// Finds where the contour crosses the ways between nodes that lie on its two sides.
    #[inline(always)]
    fn cross<S: Simd>(&self, simd: S, band: Rows, ways: &[Vec<usize>; 2], nodes: &mut NodesOf) {
        self.fill_ends(simd, band, ways, &mut nodes.values);
        for (axis, ways) in ways.iter().enumerate() {
            for at in ways.chunks(LANES) {
                let ways = Ways { at, axis, band };
                let shares = simd.vectorize(
                    #[inline(always)]
                    || self.roots(simd, &ways, &nodes.values),
                );
                at.iter().enumerate().for_each(|(lane, &n)| nodes.crossings[n][axis] = shares[lane]);
            }
            nodes.crossed.extend(ways);
        }
    }

    /// Reads the values at the ends of ways of which only the sides are known.
    #[inline(always)]
    fn fill_ends<S: Simd>(&self, simd: S, band: Rows, ways: &[Vec<usize>; 2], values: &mut [f32]) {
        let ends = ways.iter().zip([1, band.width]).flat_map(|(ways, step)| ways.iter().flat_map(move |n| [*n, n + step]));
        let ends: Vec<usize> = ends.filter(|n| values[*n].is_infinite()).collect();
        for at in ends.chunks(LANES) {
            let pixels = band.pixels(simd, at);
            let found = simd.vectorize(
                #[inline(always)]
                || self.values(simd, &pixels, Mask::splat(simd, false)).1,
            );
            at.iter().enumerate().for_each(|(lane, &n)| values[n] = found[lane]);
        }
    }

    /// Where along ways the contour is crossed: between a node on one side and a node on the other by the secant, where an end that stays twice
    /// counts half (the "Illinois" method: Dowell and Jarratt 1971).
    #[inline(always)]
    fn roots<S: Simd>(&self, simd: S, ways: &Ways<'_>, values: &[f32]) -> Floats<S> {
        let mut f = [[0.0; LANES]; 2];
        let contour = self.layer.appearance.contour;
        let step = if ways.axis == 0 { 1 } else { ways.band.width };
        for (lane, &n) in ways.at.iter().enumerate() {
            (f[0][lane], f[1][lane]) = (values[n] - contour, values[n + step] - contour);
        }
        let Pixels { x, y, inside: mut left } = ways.band.pixels(simd, ways.at);
        let [zero, one] = [0.0, 1.0].map(|v| Floats::splat(simd, v));
        let (mut low, mut high) = (zero, one);
        let [mut at_low, mut at_high] = f.map(|f| Floats::load_array(simd, f));
        let low_is_inside = at_low.simd_ge(zero);
        let mut last = zero;
        let mut known = Known::nothing(simd);
        for _ in 0..MOST_SLICE_STEPS {
            // So far from the ends that the root is between two near ones as soon as it is known.
            let least = Floats::splat(simd, 0.5 * KNOWN_TO).min((high - low) * 0.5);
            let share = (low + (high - low) * (at_low / (at_low - at_high))).max(low + least).min(high - least);
            let along = Doubles::of(share);
            let pixels = if ways.axis == 0 { Pixels { x: x + along, y, inside: left } } else { Pixels { x, y: y + along, inside: left } };
            let Points { cell, local, .. } = self.points(simd, &pixels);
            let value = trilinear(known.corners(simd, &self.field, &cell, left), &local) - contour;
            let is_low = left & !(value.simd_ge(zero) ^ low_is_inside);
            let is_high = left & !is_low;
            // The other end has stayed.
            at_high = (is_low & last.simd_lt(zero)).select(at_high * 0.5, at_high);
            at_low = (is_high & last.simd_gt(zero)).select(at_low * 0.5, at_low);
            (low, at_low) = (is_low.select(share, low), is_low.select(value, at_low));
            (high, at_high) = (is_high.select(share, high), is_high.select(value, at_high));
            last = is_low.select(-one, is_high.select(one, last));
            left &= (high - low).simd_gt(KNOWN_TO);
            if !left.any_true() {
                break;
            }
        }
        low + (high - low) * (at_low / (at_low - at_high))
    }

    /// Puts what a thick slice shows in the places of the plane's values.
    #[inline(always)]
    fn project<S: Simd>(&self, simd: S, sought: Sought, band: Rows, values: &mut [f32]) {
        values.fill(f32::NAN);
        let [near, far] = self.layer.skip.spans.at(0, 0);
        for packet in packets(band.width as u32, (values.len() / band.width) as u32) {
            let pixels = packet.pixels(simd, band.first);
            let kept = kept(simd, &self.layer.placement.surface.region, &world_line_of(simd, self.frame, &pixels));
            let part = Part { begin: kept.begin, s_min: Floats::splat(simd, near), s_max: Floats::splat(simd, far).min(kept.end) };
            let way = Way { lines: line_of(simd, self.layer, &pixels), part, asked: pixels.inside };
            let all = simd.vectorize(
                #[inline(always)]
                || project(simd, sought, self.layer, &self.field, &[way]),
            );
            let of = &all[0];
            for lane in numbers(of.found) {
                values[packet.index(lane, band.width as u32)] = sought.of.shown([of.value[lane], of.depth[lane]]);
            }
        }
    }
}

/// The cells that were read last, and their corners: a root is mostly in the cell that its first step leads to.
struct Known<S: Simd> {
    cell: [Ints<S>; 3],
    corners: [Floats<S>; 8],
}

impl<S: Simd> Known<S> {
    #[inline(always)]
    fn nothing(simd: S) -> Self {
        Self { cell: [Ints::splat(simd, -1); 3], corners: [Floats::splat(simd, 0.0); 8] }
    }

    /// Those of the cells, of which only the others are read.
    #[inline(always)]
    fn corners(&mut self, simd: S, field: &Field<'_>, cell: &[Ints<S>; 3], of: Mask<S>) -> &[Floats<S>; 8] {
        let known = axes!(a => cell[a].simd_eq(self.cell[a]));
        let new = of & !(known[0] & known[1] & known[2]);
        if new.any_true() {
            let read = field.corners(simd, cell, new);
            for (corner, read) in self.corners.iter_mut().zip(read) {
                *corner = new.select(read, *corner);
            }
            self.cell = axes!(a => new.select(cell[a], self.cell[a]));
        }
        &self.corners
    }
}
