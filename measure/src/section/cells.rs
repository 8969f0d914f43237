//! Where a plane meets a trilinear isosurface, cell by cell: where the curve enters a cell and where it leaves.
//!
//! ```text
//!      ┌───────────┐     the plane cuts a cell in a polygon; along each of its sides, which lies in a face of the
//!      │   ╱╲      │     cell, the interpolant is a quadratic, and its roots are where the curve passes into the
//!      │  ╱  ╲─────│     cell behind. Both cells have the same roots, so that no curve is lost between them
//!      └───────────┘
//! ```
//! A corner on the plane is on its normal's side, and a value that equals the isovalue is inside, so that each polygon and each curve goes
//! on. Curves that lie within one cell are not looked for: they are shorter than its own outline.

use super::plane::InPlane;
use super::trace::InCell;
use bregma_field::interpolant::corners;
use bregma_field::{Cancelled, Progress};
use glam::{DVec2, DVec3, USizeVec3};
use rayon::prelude::*;

/// Which root of which face of the grid: the face's axis, its lowest corner, and the root's number there.
pub(super) type Node = (u8, [u32; 3], u8);

/// The curve's way through a cell, with the bone at its left as the plane's normal points to the eye.
#[derive(Clone, Copy, Debug)]
pub(super) struct Link {
    pub cell: USizeVec3,
    pub nodes: [Node; 2],
    /// Where it enters and leaves.
    pub ends: [DVec2; 2],
}

/// Corners so near to the plane lie on it, voxels: positions of thousands of voxels are good to 1e-12, and a plane along a layer of samples
/// may lie on either side of each of them by that much.
const ON_PLANE_VOXEL: f64 = 1e-9;
/// Halvings until a root is as good as float64.
const HALVINGS: usize = 54;

/// All ways of the curves through cells. `progress` counts rows of columns of cells.
pub(super) fn links(plane: &InPlane<'_>, progress: &Progress) -> Result<Vec<Link>, Cancelled> {
    let cells = plane.surface.grid.cells();
    let axis = plane.steepest();
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    if plane.surface.grid.is_flat() {
        return Ok(vec![]);
    }
    progress.begin(cells[v] as u64);
    let row = |n: usize| -> Result<Vec<Link>, Cancelled> {
        progress.advance(1)?;
        let mut found = vec![];
        for m in 0..cells[u] {
            let height = |du: usize, dv: usize| {
                let mut at = DVec3::ZERO;
                (at[u], at[v]) = ((m + du) as f64, (n + dv) as f64);
                plane.height(at, axis)
            };
            let heights = [height(0, 0), height(1, 0), height(0, 1), height(1, 1)];
            let (low, high) = heights.into_iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), h| (low.min(h), high.max(h)));
            // A cell more on either side: corners on the plane belong to the normal's side.
            let (first, last) = (low.floor() - 1.0, high.floor() + 1.0);
            for k in first.max(0.0) as usize..(last + 1.0).clamp(0.0, cells[axis] as f64) as usize {
                let mut cell = USizeVec3::ZERO;
                (cell[axis], cell[u], cell[v]) = (k, m, n);
                in_cell(plane, cell, &mut found);
            }
        }
        Ok(found)
    };
    let rows = (0..cells[v]).into_par_iter().map(row).collect::<Result<Vec<_>, _>>()?;
    Ok(rows.into_iter().flatten().collect())
}

/// The curves' ways through one cell.
fn in_cell(plane: &InPlane<'_>, cell: USizeVec3, found: &mut Vec<Link>) {
    let corner = |c: usize| USizeVec3::new(c & 1, c >> 1 & 1, c >> 2);
    let sides: [f64; 8] = std::array::from_fn(|c| plane.side((cell + corner(c)).as_dvec3()));
    let above = sides.iter().filter(|s| **s >= -ON_PLANE_VOXEL).count();
    if matches!(above, 0 | 8) {
        return;
    }
    let f = corners(plane.surface, cell);
    if matches!(f.iter().filter(|v| **v >= 0.0).count(), 0 | 8) {
        return;
    }
    let (mut entries, mut exits) = (vec![], vec![]);
    for face in 0..6 {
        roots_of_face(
            plane,
            cell,
            face,
            &f,
            &sides,
            |node, at, is_entry| {
                if is_entry { entries.push((node, at)) } else { exits.push((node, at)) }
            },
        );
    }
    for (node, at) in entries {
        let places: Vec<DVec2> = exits.iter().map(|(_, place)| *place).collect();
        let Some(exit) = InCell::of(plane, cell).exit_of(at, &places) else { break };
        let (last, there) = exits.swap_remove(exit);
        found.push(Link { cell, nodes: [node, last], ends: [at, there] });
    }
}

/// Visits the roots on one face of a cell (numbers 0 and 1 are its low and high faces across x, and so on), each with whether the curve
/// enters the cell there.
fn roots_of_face(
    plane: &InPlane<'_>,
    cell: USizeVec3,
    face: usize,
    f: &[f64; 8],
    sides: &[f64; 8],
    mut visit: impl FnMut(Node, DVec2, bool),
) {
    let (axis, is_high) = (face / 2, face % 2);
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let corner = |du: usize, dv: usize| is_high << axis | du << u | dv << v;
    // Where the plane crosses the face's edges, in the face's own coordinates: the same from both cells.
    let mut ends = [[0.0; 2]; 2];
    let mut count = 0;
    for (a, b) in [([0, 0], [1, 0]), ([0, 1], [1, 1]), ([0, 0], [0, 1]), ([1, 0], [1, 1])] {
        let [s, t] = [a, b].map(|[du, dv]: [usize; 2]| sides[corner(du, dv)]);
        if (s >= -ON_PLANE_VOXEL) == (t >= -ON_PLANE_VOXEL) {
            continue;
        }
        let part = (s / (s - t)).clamp(0.0, 1.0);
        if let Some(end) = ends.get_mut(count) {
            *end = [0, 1].map(|n| a[n] as f64 + part * (b[n] as f64 - a[n] as f64));
        }
        count += 1;
    }
    if count != 2 {
        return;
    }
    let g = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[du, dv]| f[corner(du, dv)]);
    let mut first = cell;
    first[axis] += is_high;
    let place = |s: f64| {
        let mut local = DVec3::ZERO;
        (local[u], local[v]) = (mix(ends[0][0], ends[1][0], s), mix(ends[0][1], ends[1][1], s));
        plane.foot_of_index(first.as_dvec3() + local)
    };
    let along = place(1.0) - place(0.0);
    // Into the cell, in the plane.
    let into = plane.along(DVec3::AXES[axis]) * if is_high == 1 { -1.0 } else { 1.0 };
    let is_left = along.perp_dot(into) > 0.0;
    for (n, (s, was_inside)) in roots(&g, ends).into_iter().flatten().enumerate() {
        // Bone is behind the root along the side; going in with the bone at the left, the cell lies at the side's left.
        visit((axis as u8, first.to_array().map(|n| n as u32), n as u8), place(s), was_inside == is_left);
    }
}

fn mix(a: f64, b: f64, s: f64) -> f64 {
    a * (1.0 - s) + b * s
}

/// Of a function that is linear along both sides of a square, with values `g` at (0, 0), (1, 0), (0, 1), (1, 1): where it changes its sign
/// on the way between two points, and whether it is inside before.
fn roots(g: &[f64; 4], [p, q]: [[f64; 2]; 2]) -> [Option<(f64, bool)>; 2] {
    let at = |x: f64, y: f64| mix(mix(g[0], g[1], x), mix(g[2], g[3], x), y);
    // The quadratic's Bernstein coefficients: its polar form at the ends.
    let (first, last) = (at(p[0], p[1]), at(q[0], q[1]));
    let middle = 0.5 * (at(p[0], q[1]) + at(q[0], p[1]));
    let value = |s: f64| mix(mix(first, middle, s), mix(middle, last, s), s);
    let between = |mut low: f64, mut high: f64| {
        let is_in = value(low) >= 0.0;
        for _ in 0..HALVINGS {
            let half = 0.5 * (low + high);
            if (value(half) >= 0.0) == is_in { low = half } else { high = half }
        }
        0.5 * (low + high)
    };
    let is_in = first >= 0.0;
    if is_in != (last >= 0.0) {
        return [Some((between(0.0, 1.0), is_in)), None];
    }
    // Both ends on one side: only where the quadratic turns on the other.
    let turn = (first - middle) / (first - 2.0 * middle + last);
    if is_in == (middle >= 0.0) || !(0.0..=1.0).contains(&turn) || (value(turn) >= 0.0) == is_in {
        return [None, None];
    }
    [Some((between(0.0, turn), is_in)), Some((between(turn, 1.0), !is_in))]
}
