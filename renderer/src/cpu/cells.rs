//! Within a brick: cell by cell, with one of the solvers of [`crate::roots`] in each that can hold the surface.
//!
//! The twin of `shaders/cells.wgsl`.

use super::walk::{FAR, Field, Hit, InBrick, Met, Pace, WalkBrick, least};
use crate::roots::FirstEntry;
use bregma_volume::Sample;
use glam::{IVec3, Vec3};
use std::marker::PhantomData;

pub(crate) struct Cells<S>(PhantomData<S>);

impl<S: FirstEntry> WalkBrick for Cells<S> {
    #[inline(always)]
    fn walk<T: Sample>(field: &Field<'_, T>, pace: &Pace, at: &InBrick<'_>) -> Option<Hit> {
        let mut cell = first_cell(pace, at);
        let first = cell;
        let origin = at.origin.to_array();
        let (ahead, step) = (pace.forward.map(i32::from), pace.forward.map(|f| if f { 1 } else { -1 }));
        let to_face = |a: usize, cell: i32| pace.to_plane(a, (cell + ahead[a]) as f32, origin[a], FAR);
        let mut t_faces: [f32; 3] = std::array::from_fn(|a| to_face(a, cell[a]));
        let (mut t, mut entry) = (at.t, None);
        loop {
            let axis = least(&t_faces);
            let t_next = t_faces[axis].max(t);
            if at.may_hold(cell) {
                let corner = IVec3::from_array(cell);
                let f = field.corners(at.corner + corner);
                // Where it enters is where it left the cell before, the same number.
                let p = entry.map_or(at.p, |a: usize| point(pace, at, t, corner, a, cell[a] + 1 - ahead[a]));
                let q = point(pace, at, t_next, corner, axis, cell[axis] + ahead[axis]);
                let (from, to) = (p - corner.as_vec3(), q - corner.as_vec3());
                if let Some(u) = S::first_entry(&f, from, to) {
                    let met = if u == 0.0 && cell == first { field.met_at_entry(pace, at) } else { Met::Isosurface };
                    return Some(Hit { s: at.s + t + u * (t_next - t), cell: at.corner + corner, local: from.lerp(to, u), met });
                }
            }
            cell[axis] += step[axis];
            if cell[axis] < 0 || cell[axis] >= at.size[axis] || at.s + t_next > at.s_max {
                return None;
            }
            t_faces[axis] = to_face(axis, cell[axis]);
            (t, entry) = (t_next, Some(axis));
        }
    }
}

/// The cell that a ray is in behind its entry into a brick.
#[inline(always)]
fn first_cell(pace: &Pace, at: &InBrick<'_>) -> [i32; 3] {
    let (p, cell) = (at.p.to_array(), at.p.as_ivec3().to_array());
    std::array::from_fn(|a| {
        // On a face and moving down, the ray is in the cell below.
        let below = i32::from(!pace.forward[a] && pace.moves[a] && p[a] == cell[a] as f32);
        (cell[a] - below).clamp(0, at.size[a] - 1)
    })
}

/// Where the ray is at t, on the face of a cell across `axis`.
#[inline(always)]
fn point(pace: &Pace, at: &InBrick<'_>, t: f32, cell: IVec3, axis: usize, face: i32) -> Vec3 {
    let mut p = (at.origin + t * pace.direction).clamp(cell.as_vec3(), (cell + 1).as_vec3());
    p[axis] = face as f32;
    p
}
