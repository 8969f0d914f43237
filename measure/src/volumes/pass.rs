//! One pass over the cells of a solid.
//!
//! Along an axis of its own grid the interpolant of a cell is linear, so the part of a line in the bone has two ends that are known exactly:
//! only the integral over the cell's face is by quadrature (Gauss and Legendre, 3² points), along the axis that lies most across what bounds
//! the solid in the cell, so that flat sides along the grid are exact. The rule of 2² points says how sure the sum is. Cells with all corners
//! inside count as a whole at once; bricks that the surface does not pass are not looked into. Of a second solid the part of each such
//! line is taken that is in it, too: in its cells the interpolant along a line is a cubic, whose roots are isolated ([`part_inside`]).
//!
//! Integrals over the surface are made of the same points. A line along axis c that crosses the surface at a gradient g stands for dA =
//! |g|/|g_c| of the face's area; counted with the weight g_c²/|g|², which is 1 in sum over the axes, no place is divided by nearly nothing.
//!
//! [`part_inside`]: bregma_field::chord::part_inside

use super::other::{Other, Side, half_diagonal_mm, side_of, world};
use super::sums::{Skin, Sums};
use bregma_field::interpolant::{gradient, value};
use bregma_field::{BRICK, Block, Cancelled, Progress, Sample, Store, Surface, with_block};
use glam::{DMat3, DVec3};
use rayon::prelude::*;
use std::cmp::Ordering;

/// Gauss and Legendre's points on [0, 1] and their weights.
const FINE: [[f64; 2]; 3] = [[0.112_701_665_379_258_3, 5.0 / 18.0], [0.5, 8.0 / 18.0], [0.887_298_334_620_741_7, 5.0 / 18.0]];
/// Those of the coarser rule.
const COARSE: [[f64; 2]; 2] = [[0.211_324_865_405_187_1, 0.5], [0.788_675_134_594_812_9, 0.5]];

/// Of the hat function that interpolation smooths samples by along each axis, on average over all places between them; voxel².
const HAT_VARIANCE: f64 = 1.0 / 6.0;
/// In walls thinner than a voxel differences over several show hardly any gradient: no less than this part of the cell's own is taken.
const LEAST_STEEP: f64 = 0.25;

/// A further bound of the solid within one of its cells, as values at the corners: inside is not below 0.
pub trait Bound: Sync {
    /// Whether the samples count that are not below the level, or those that are below.
    const INSIDE_OUT: bool;

    /// Which part of the cell counts.
    fn side(&self, cell: [usize; 3], f: &[f64; 8]) -> Side;

    /// The further bound where [`Self::side`] says between: of one value at each corner.
    fn values(&self, cell: [usize; 3], f: &[f64; 8]) -> [f64; 8];
}

/// All of the bone.
#[derive(Debug)]
pub struct Whole;

impl Bound for Whole {
    const INSIDE_OUT: bool = false;

    fn side(&self, _: [usize; 3], _: &[f64; 8]) -> Side {
        Side::In
    }

    fn values(&self, _: [usize; 3], _: &[f64; 8]) -> [f64; 8] {
        [1.0; 8]
    }
}

/// Adds up what is inside of `surface`, within `bound`, and what of it is in `other`. `progress` counts layers of bricks.
pub fn pass<B: Bound>(surface: &Surface, other: Option<&Other<'_>>, bound: &B, progress: &Progress) -> Result<Sums, Cancelled> {
    let mut sums = Sums::default();
    if surface.grid.is_flat() {
        return Ok(sums);
    }
    let pass = Pass::new(surface, other, bound);
    let dims = surface.volume.bricks().dims();
    let rows: Vec<[usize; 2]> = (0..dims[2]).flat_map(|z| (0..dims[1]).map(move |y| [y, z])).collect();
    let row = |[y, z]: &[usize; 2]| -> Result<Sums, Cancelled> {
        let mut sums = Sums::default();
        let mut cuts = vec![];
        (0..dims[0]).for_each(|x| pass.brick([x, *y, *z], &mut sums, &mut cuts));
        progress.advance(1)?;
        Ok(sums)
    };
    // In order, so that the same scan gives the same digits on any number of cores.
    let found = rows.par_iter().map(row).collect::<Result<Vec<Sums>, Cancelled>>()?;
    found.into_iter().for_each(|row| sums += row);
    let cell_mm3 = surface.grid.index_to_world().matrix3.determinant().abs();
    for added in [&mut sums.own, &mut sums.shared, &mut sums.alone] {
        *added = added.scaled(cell_mm3);
    }
    Ok(sums)
}

/// Rows of bricks of a surface: what [`pass`] advances by.
pub fn rows_of(surface: &Surface) -> u64 {
    let [_, y, z] = surface.volume.bricks().dims();
    (y * z) as u64
}

struct Pass<'a, B> {
    surface: &'a Surface,
    other: Option<&'a Other<'a>>,
    bound: &'a B,
    half_mm: f64,
    /// From gradients and second derivatives per voxel to those per mm.
    to_mm: DMat3,
    cell_mm3: f64,
}

/// A cell at work.
struct Cell<'a> {
    at: DVec3,
    f: &'a [f64; 8],
    /// Second derivatives, sample units per mm² and per voxel².
    hessian: DMat3,
    bends: DVec3,
    /// The gradient as far as second derivatives are smoothed, per mm.
    steepness: f64,
    bound: Option<[f64; 8]>,
    is_cut: bool,
    other: Side,
}

impl<'a, B: Bound> Pass<'a, B> {
    fn new(surface: &'a Surface, other: Option<&'a Other<'a>>, bound: &'a B) -> Self {
        let to_mm = surface.grid.world_to_index().matrix3.transpose();
        let cell_mm3 = surface.grid.index_to_world().matrix3.determinant().abs();
        Self { surface, other, bound, half_mm: half_diagonal_mm(surface), to_mm, cell_mm3 }
    }

    fn sign(&self) -> f64 {
        f64::from(self.surface.sign) * if B::INSIDE_OUT { -1.0 } else { 1.0 }
    }

    fn brick(&self, brick: [usize; 3], sums: &mut Sums, cuts: &mut Vec<f64>) {
        let bricks = self.surface.volume.bricks();
        let [bx, by, _] = bricks.dims();
        let ends = bricks.ranges()[brick[0] + bx * (brick[1] + by * brick[2])];
        let inside = ends.map(|v| self.sign() * (f64::from(v) - self.surface.level));
        if inside[0].max(inside[1]) < 0.0 {
            return;
        }
        let cells = self.surface.grid.cells();
        let first = brick.map(|n| n * BRICK);
        let end: [usize; 3] = std::array::from_fn(|a| (first[a] + BRICK).min(cells[a]));
        let before = sums.points.len();
        // A scan in memory has all its bricks.
        let Some(block) = Store::of(&self.surface.volume).block(brick) else { return };
        with_block!(block, block => {
            for k in first[2]..end[2] {
                for j in first[1]..end[1] {
                    for i in first[0]..end[0] {
                        let f = block.corners([i, j, k]).map(|s| self.sign() * (s.to_f64() - self.surface.level));
                        self.cell(&block, [i, j, k], &f, sums, cuts);
                    }
                }
            }
        });
        // One point of each brick is enough.
        sums.points.truncate(before + 1);
    }

    fn cell<T: Sample>(&self, block: &Block<'_, T>, index: [usize; 3], f: &[f64; 8], sums: &mut Sums, cuts: &mut Vec<f64>) {
        let count = f.iter().filter(|v| **v >= 0.0).count();
        let bound = if count == 0 { Side::Out } else { self.bound.side(index, f) };
        if bound == Side::Out {
            return;
        }
        let at = DVec3::from(index.map(|n| n as f64));
        let middle = at + 0.5;
        let is_all = self.surface.region.is_all();
        let middle_mm = if is_all && self.other.is_none() { DVec3::ZERO } else { world(self.surface, middle) };
        let region = if is_all { Side::In } else { side_of(self.surface.region.depth_mm(middle_mm), self.half_mm) };
        if region == Side::Out {
            return;
        }
        let other = self.other.map_or(Side::Out, |other| other.side(middle, middle_mm));
        if count == 8 && region == Side::In && bound == Side::In && other != Side::Between {
            sums.own.cell(1.0, 1.0);
            let part = f64::from(other == Side::In);
            sums.shared.cell(part, part);
            sums.alone.cell(1.0 - part, 1.0 - part);
            return;
        }
        let [bends, slopes] = if count < 8 { self.bends(block, index) } else { [DVec3::ZERO; 2] };
        let hessian = if count < 8 { self.to_mm * twists(f, bends) * self.to_mm.transpose() } else { DMat3::ZERO };
        let bound = (bound == Side::Between).then(|| self.bound.values(index, f));
        let cell = Cell { at, f, hessian, bends, steepness: (self.to_mm * slopes).length(), bound, is_cut: region == Side::Between, other };
        self.add(&cell, sums, cuts);
        if count < 8 {
            (0..3).for_each(|axis| self.crossings(&cell, axis, sums));
        }
    }

    /// The axis that lies most across what bounds the solid in a cell.
    fn across(&self, cell: &Cell<'_>) -> usize {
        const MIDDLE: DVec3 = DVec3::splat(0.5);
        let mut across = DVec3::ZERO;
        let mut count = |normal: DVec3| across += normal.normalize_or_zero().powf(2.0);
        if cell.f.iter().any(|v| *v < 0.0) {
            count(gradient(cell.f, MIDDLE));
        }
        cell.bound.iter().for_each(|values| count(gradient(values, MIDDLE)));
        let middle_mm = world(self.surface, cell.at + MIDDLE);
        if cell.is_cut {
            self.surface.region.nearest_normal(middle_mm).into_iter().for_each(|normal| count(self.to_mm.inverse() * normal));
        }
        if let (Side::Between, Some(other)) = (cell.other, self.other) {
            count(other.across(cell.at + MIDDLE));
        }
        across.max_position()
    }

    /// The cell's volume.
    fn add(&self, cell: &Cell<'_>, sums: &mut Sums, cuts: &mut Vec<f64>) {
        let axis = self.across(cell);
        let [mut own, mut shared] = [[0.0; 2]; 2];
        for (rule, points) in [&FINE[..], &COARSE].into_iter().enumerate() {
            for (foot, weight) in feet(axis, points) {
                let [length, within] = self.chords(cell, axis, foot, cuts);
                own[rule] += weight * length;
                shared[rule] += weight * within;
            }
        }
        sums.own.cell(own[0], own[1]);
        sums.shared.cell(shared[0], shared[1]);
        sums.alone.cell(own[0] - shared[0], own[1] - shared[1]);
    }

    /// Second differences along the axes, per voxel², and the gradient per voxel, both the mean of the cell's corners; where the grid ends,
    /// nothing bends.
    fn bends<T: Sample>(&self, block: &Block<'_, T>, index: [usize; 3]) -> [DVec3; 2] {
        let dims = self.surface.grid.dims();
        let (mut bends, mut slopes) = (DVec3::ZERO, DVec3::ZERO);
        for a in 0..3 {
            if index[a] == 0 || index[a] + 2 >= dims[a] {
                continue;
            }
            let (u, v) = ((a + 1) % 3, (a + 2) % 3);
            for corner in 0..4 {
                let mut at = index;
                at[u] += corner & 1;
                at[v] += corner >> 1;
                at[a] -= 1;
                let row = [0, 1, 2, 3].map(|n| {
                    at[a] = index[a] + n - 1;
                    self.sign() * block.at(at).to_f64()
                });
                // Four rows, and two differences in each.
                bends[a] += (row[0] - row[1] - row[2] + row[3]) / 8.0;
                // A third of the difference across the cell and two of those across it and its neighbours are smoothed along the axis as much
                // as the second difference is: by a variance of 5/12 voxel².
                slopes[a] += (row[2] - row[1]) / 12.0 + (row[3] + row[2] - row[1] - row[0]) / 24.0;
            }
        }
        [bends, slopes]
    }

    /// The part of a line through the point `foot` of the cell's face that is in the solid: from where to where, empty where it is not.
    fn span(&self, cell: &Cell<'_>, axis: usize, foot: DVec3) -> [f64; 2] {
        let along = DVec3::AXES[axis];
        let mut span = [0.0, 1.0];
        narrow(&mut span, ends(cell.f, axis, foot));
        cell.bound.iter().for_each(|values| narrow(&mut span, ends(values, axis, foot)));
        if cell.is_cut {
            let grid = self.surface.grid.index_to_world();
            let kept = self.surface.region.interval(grid.transform_point3(cell.at + foot), grid.transform_vector3(along), span);
            span = kept.map(|end| end.s);
        }
        span
    }

    /// How much of a line is in the solid, and how much of that in the other.
    fn chords(&self, cell: &Cell<'_>, axis: usize, foot: DVec3, cuts: &mut Vec<f64>) -> [f64; 2] {
        let span = self.span(cell, axis, foot);
        // Empty, or no number.
        if span[1].partial_cmp(&span[0]) != Some(Ordering::Greater) {
            return [0.0; 2];
        }
        let length = span[1] - span[0];
        let within = match (cell.other, self.other) {
            (Side::In, _) => length,
            (Side::Between, Some(other)) => other.chord(cell.at + foot, DVec3::AXES[axis], span, cuts),
            _ => 0.0,
        };
        [length, within]
    }

    /// The surface where lines along one axis cross it.
    fn crossings(&self, cell: &Cell<'_>, axis: usize, sums: &mut Sums) {
        for (foot, weight) in feet(axis, &FINE) {
            let [from, to] = ends(cell.f, axis, foot);
            let root = from / (from - to);
            // The end of the span is the same number where nothing else bounds it.
            if (from >= 0.0) != (to >= 0.0) && self.span(cell, axis, foot).contains(&root) {
                self.crossing(cell, axis, foot + root * DVec3::AXES[axis], weight, sums);
            }
        }
    }

    /// What a place counts where the line along `axis` crosses the surface.
    fn crossing(&self, cell: &Cell<'_>, axis: usize, local: DVec3, weight: f64, sums: &mut Sums) {
        let g = gradient(cell.f, local);
        let rise = self.to_mm * g;
        let slope = rise.length();
        // dA/|∇f| in the world is det·dA/|∇f| of index space.
        let per_level = weight * self.cell_mm3 * g[axis].abs() / g.length_squared();
        let area_mm2 = per_level * slope;
        let normal = -rise / slope;
        let point_mm = world(self.surface, cell.at + local);
        // What blur of a variance moves is half of it times the second derivatives without that along the normal, which on average over a
        // boundary is none, over the gradient; both as smooth as each other, since an edge is often narrower than differences reach.
        let along = normal.dot(cell.hessian * normal);
        let bent = cell.hessian.x_axis.x + cell.hessian.y_axis.y + cell.hessian.z_axis.z - along;
        let across = self.surface.grid.index_to_world().matrix3.transpose() * normal;
        let bent_voxel = cell.bends.element_sum() - along * across.length_squared();
        let half_area = -0.5 * area_mm2 / cell.steepness.max(LEAST_STEEP * slope);
        let skin = Skin {
            area_mm2,
            per_level,
            per_noise: per_level / slope,
            per_blur: half_area * bent,
            by_interpolation: half_area * bent_voxel * HAT_VARIANCE,
            pull_mm2: normal * area_mm2,
            moment_mm3: point_mm.cross(normal) * area_mm2,
        };
        if !skin.pull_mm2.is_finite() {
            return;
        }
        sums.skin += skin;
        sums.points.push((point_mm, normal));
        let is_shared = match (cell.other, self.other) {
            (Side::In, _) => true,
            (Side::Between, Some(other)) => other.has(cell.at + local, point_mm),
            _ => false,
        };
        if is_shared {
            sums.shared_skin += skin;
        }
    }
}

/// Values at both ends of a cell's line.
fn ends(values: &[f64; 8], axis: usize, foot: DVec3) -> [f64; 2] {
    [foot, foot + DVec3::AXES[axis]].map(|p| value(values, p))
}

/// The feet of a cell's lines along an axis, and their weights.
fn feet(axis: usize, points: &[[f64; 2]]) -> impl Iterator<Item = (DVec3, f64)> {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    points.iter().flat_map(move |[x, x_weight]| {
        points.iter().map(move |[y, y_weight]| (x * DVec3::AXES[u] + y * DVec3::AXES[v], x_weight * y_weight))
    })
}

/// What of a span lies where a linear function with these values at 0 and 1 is not below 0.
fn narrow(span: &mut [f64; 2], [from, to]: [f64; 2]) {
    match (from >= 0.0, to >= 0.0) {
        (true, true) => {}
        (false, false) => span[1] = f64::NEG_INFINITY,
        (true, false) => span[1] = span[1].min(from / (from - to)),
        (false, true) => span[0] = span[0].max(from / (from - to)),
    }
}

/// Second derivatives per voxel² at the middle of a cell: what bends along the axes, and the cell's own mixed ones.
fn twists(f: &[f64; 8], bends: DVec3) -> DMat3 {
    let mixed = |a: usize, b: usize| {
        let c = 3 - a - b;
        let at = |x: usize, y: usize| 0.5 * (f[x << a | y << b] + f[x << a | y << b | 1 << c]);
        at(1, 1) - at(1, 0) - at(0, 1) + at(0, 0)
    };
    let (xy, xz, yz) = (mixed(0, 1), mixed(0, 2), mixed(1, 2));
    DMat3::from_cols(DVec3::new(bends.x, xy, xz), DVec3::new(xy, bends.y, yz), DVec3::new(xz, yz, bends.z))
}
