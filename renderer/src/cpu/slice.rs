//! The nodes of a slice: values on its plane, and where contours cross the ways between neighbours.
//!
//! The twin of `shaders/slice.wgsl`.

use super::cuts::kept;
use super::faces::ON_FACE_VOXEL;
use super::line::Part;
use super::packets::{Pixels, packets};
use super::project::{Sought, Way, project};
use super::volume::{Field, line_of, world_line_of};
use crate::camera::PixelAffine;
use crate::frame::{Frame, FrameLayer};
use crate::lanes::{Doubles, Floats, Ints, LANES, Mask, axes, numbers};
use crate::picture::Picture;
use crate::roots::trilinear;
use crate::scene::Scene;
use crate::slice::{self, NO_CROSSING, NodeBand, Nodes};
use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch};

/// The picture of a slice.
pub(super) fn draw(level: Level, frame: &Frame, scene: &Scene, [width, height]: [u32; 2]) -> Picture {
    let across = width * frame.nodes_per_pixel;
    let sought = scene.slice.sought().map(|of| Sought { of, by_gradient: false, in_range: false });
    let begin = || vec![NodesOf::default(); frame.layers.len()];
    slice::draw(frame, scene, [width, height], begin, |all: &mut Vec<NodesOf>, first, rows, paint| {
        for (layer, nodes) in frame.layers.iter().zip(&mut *all) {
            nodes.begin((across as usize) * rows);
            dispatch!(level, simd => gather(simd, frame, layer, sought, across, first as u32, nodes));
        }
        let layers = all.iter().map(|nodes| Nodes { values: &nodes.values, crossings: &nodes.crossings, crossed: &nodes.crossed });
        paint(&NodeBand { width: across as usize, layers: layers.collect() });
    })
}

/// What a band of nodes knows of one layer: [`Nodes`].
#[derive(Clone, Default)]
struct NodesOf {
    values: Vec<f32>,
    crossings: Vec<[f32; 2]>,
    crossed: Vec<usize>,
}

impl NodesOf {
    /// Makes room for so many, and forgets what was known of those before; only what was crossed has to be cleared.
    fn begin(&mut self, count: usize) {
        self.crossed.drain(..).for_each(|n| self.crossings[n] = [NO_CROSSING; 2]);
        self.crossings.resize(count, [NO_CROSSING; 2]);
        self.values.resize(count, f32::NAN);
    }
}

/// Rows of nodes from row `first` on, `width` across.
#[inline(always)]
fn gather<S: Simd>(simd: S, frame: &Frame, layer: &FrameLayer, sought: Option<Sought>, width: u32, first: u32, nodes: &mut NodesOf) {
    if layer.placement.surface.grid.is_flat() {
        nodes.values.fill(f32::NAN);
        return;
    }
    let plane = Plane::of(frame, layer);
    let contour = layer.appearance.contour;
    let mut sides = Sides::new(width as usize);
    for (row, values) in (first..).zip(nodes.values.chunks_mut(width as usize)) {
        for (n, values) in values.chunks_mut(LANES).enumerate() {
            let (is, found) = plane.values(simd, &Pixels::in_row(simd, n * LANES, row, values.len()));
            sides.put(n, is.to_bitmask(), (found - contour).simd_ge(0.0).to_bitmask());
            values.copy_from_slice(&is.select(found, Floats::splat(simd, f32::NAN)).to_array()[..values.len()]);
        }
        sides.end_row();
    }
    plane.cross(simd, width as usize, first, &sides.ways, nodes);
    if let Some(sought) = sought {
        plane.project(simd, sought, width, first, &mut nodes.values);
    }
}

/// Finds neighbours on two sides of the contour: by a bit for each node, sixteen at a time.
struct Sides {
    width: usize,
    /// Of the row before and of the row at hand, for each group of nodes which have a value and which of these are inside.
    rows: [Vec<[u64; 2]>; 2],
    row: usize,
    /// Nodes whose right and whose lower neighbour is on the other side.
    ways: [Vec<usize>; 2],
}

impl Sides {
    fn new(width: usize) -> Self {
        // One group more, without nodes.
        let row = vec![[0; 2]; width.div_ceil(LANES) + 1];
        Self { width, rows: [row.clone(), row], row: 0, ways: [vec![], vec![]] }
    }

    fn put(&mut self, group: usize, there: u64, inside: u64) {
        self.rows[1][group] = [there, inside & there];
    }

    fn end_row(&mut self) {
        let [before, now] = &self.rows;
        let add = |ways: &mut Vec<usize>, row: usize, group: usize, mut bits: u64| {
            while bits != 0 {
                ways.push(row * self.width + group * LANES + bits.trailing_zeros() as usize);
                bits &= bits - 1;
            }
        };
        for (group, pair) in now.windows(2).enumerate() {
            let [[there, inside], [next_there, next_inside]] = [pair[0], pair[1]];
            let [right_there, right_inside] = [there >> 1 | next_there << (LANES - 1), inside >> 1 | next_inside << (LANES - 1)];
            let all = (1 << LANES) - 1;
            add(&mut self.ways[0], self.row, group, there & right_there & (inside ^ right_inside) & all);
            if self.row > 0 {
                let [above_there, above_inside] = before[group];
                add(&mut self.ways[1], self.row - 1, group, there & above_there & (inside ^ above_inside));
            }
        }
        self.rows.swap(0, 1);
        self.row += 1;
    }
}

/// Steps of a root's search, at most; it takes four or five, where a cell's face is between up to nine.
pub(crate) const MOST_SLICE_STEPS: u32 = 16;
/// A root is known to so much of the way between two nodes: a quarter of what is promised.
pub(crate) const KNOWN_TO: f32 = 1.0 / 4096.0;

/// A layer on the plane of a slice.
struct Plane<'a> {
    frame: &'a Frame,
    layer: &'a FrameLayer,
    field: Field<'a>,
    /// Its depth behind the base plane, mm.
    s: f32,
    /// Where it is seen by each pixel, in index space.
    place: PixelAffine,
}

/// Some ways between nodes, side by side.
struct Ways<'a> {
    /// Nodes that they begin at.
    at: &'a [usize],
    /// 0 to the right, 1 down.
    axis: usize,
    width: usize,
    first: u32,
}

impl<'a> Plane<'a> {
    fn of(frame: &'a Frame, layer: &'a FrameLayer) -> Self {
        let [near, far] = layer.skip.spans.at(0, 0);
        let s = 0.5 * (near + far);
        let rays = &layer.placement.rays;
        // Rays are parallel: their direction is that of the first.
        let place = PixelAffine { base: rays.origin.base + f64::from(s) * rays.direction.base, ..rays.origin };
        Self { frame, layer, field: Field::of(layer), s, place }
    }

    /// The values at nodes, and which have one.
    #[inline(always)]
    fn values<S: Simd>(&self, simd: S, pixels: &Pixels<S>) -> (Mask<S>, Floats<S>) {
        simd.vectorize(
            #[inline(always)]
            || {
                let s = Floats::splat(simd, self.s);
                let at = pixels.at(simd, &self.place);
                let p = axes!(a => at[a].to_floats());
                let dims = self.field.dims;
                let within = axes!(a => p[a].simd_ge(-ON_FACE_VOXEL) & p[a].simd_le((dims[a] - 1) as f32 + ON_FACE_VOXEL));
                let mut is = pixels.inside & within[0] & within[1] & within[2];
                let region = &self.layer.placement.surface.region;
                if !region.is_all() {
                    let kept = kept(simd, region, &world_line_of(simd, self.frame, pixels));
                    is &= kept.begin.simd_le(s) & kept.end.simd_ge(s);
                }
                if !is.any_true() {
                    return (is, s);
                }
                let cell = axes!(a => p[a].floor().to_int::<Ints<S>>().max(0).min(dims[a] - 2));
                let local = axes!(a => (at[a] - Doubles::of(cell[a].to_float())).to_floats().max(0.0).min(1.0));
                (is, trilinear(&self.field.corners(simd, &cell, is), &local))
            },
        )
    }

    /// Finds where the contour crosses the ways between nodes that lie on its two sides.
    #[inline(always)]
    fn cross<S: Simd>(&self, simd: S, width: usize, first: u32, ways: &[Vec<usize>; 2], nodes: &mut NodesOf) {
        for (axis, ways) in ways.iter().enumerate() {
            for at in ways.chunks(LANES) {
                let shares = self.roots(simd, &Ways { at, axis, width, first }, &nodes.values);
                at.iter().enumerate().for_each(|(lane, &n)| nodes.crossings[n][axis] = shares[lane]);
            }
            nodes.crossed.extend(ways);
        }
    }

    /// Where along ways the contour is crossed: between a node on one side and a node on the other by the secant, where an end that stays twice
    /// counts half (the "Illinois" method: Dowell and Jarratt 1971).
    #[inline(always)]
    fn roots<S: Simd>(&self, simd: S, ways: &Ways<'_>, values: &[f32]) -> Floats<S> {
        let (mut x, mut y, mut f) = ([0.0; LANES], [0.0; LANES], [[0.0; LANES]; 2]);
        let contour = self.layer.appearance.contour;
        for (lane, &n) in ways.at.iter().enumerate() {
            (x[lane], y[lane]) = ((n % ways.width) as f32, (n / ways.width + ways.first as usize) as f32);
            let step = if ways.axis == 0 { 1 } else { ways.width };
            (f[0][lane], f[1][lane]) = (values[n] - contour, values[n + step] - contour);
        }
        let all = Mask::from_bitmask(simd, (1_u64 << ways.at.len()) - 1);
        let (x, y) = (Doubles::of(Floats::load_array(simd, x)), Doubles::of(Floats::load_array(simd, y)));
        let [zero, one] = [0.0, 1.0].map(|v| Floats::splat(simd, v));
        let (mut low, mut high) = (zero, one);
        let [mut at_low, mut at_high] = f.map(|f| Floats::load_array(simd, f));
        let low_is_inside = at_low.simd_ge(zero);
        let (mut last, mut left) = (zero, all);
        for _ in 0..MOST_SLICE_STEPS {
            // So far from the ends that the root is between two near ones as soon as it is known.
            let least = Floats::splat(simd, 0.5 * KNOWN_TO).min((high - low) * 0.5);
            let share = (low + (high - low) * (at_low / (at_low - at_high))).max(low + least).min(high - least);
            let along = Doubles::of(share);
            let pixels = if ways.axis == 0 { Pixels { x: x + along, y, inside: left } } else { Pixels { x, y: y + along, inside: left } };
            let value = self.values(simd, &pixels).1 - contour;
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
    fn project<S: Simd>(&self, simd: S, sought: Sought, width: u32, first: u32, values: &mut [f32]) {
        values.fill(f32::NAN);
        let [near, far] = self.layer.skip.spans.at(0, 0);
        for packet in packets(width, values.len() as u32 / width) {
            let pixels = packet.pixels(simd, first);
            let kept = kept(simd, &self.layer.placement.surface.region, &world_line_of(simd, self.frame, &pixels));
            let part = Part { begin: kept.begin, s_min: Floats::splat(simd, near), s_max: Floats::splat(simd, far).min(kept.end) };
            let way = Way { lines: line_of(simd, self.layer, &pixels), part, asked: pixels.inside };
            let all = simd.vectorize(
                #[inline(always)]
                || project(simd, sought, self.layer, &self.field, &[way]),
            );
            let of = &all[0];
            for lane in numbers(of.found) {
                values[packet.index(lane, width)] = sought.of.shown([of.value[lane], of.depth[lane]]);
            }
        }
    }
}
