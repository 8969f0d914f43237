//! Within a brick: cell by cell, with one of the solvers of [`crate::roots`] in each.
//!
//! The twin of `shaders/cells.wgsl`.

use super::walk::{FAR, Field, Hit, InBrick, Met, Pace, WalkBrick};
use crate::roots::{FirstEntry, inside};
use bregma_volume::Sample;
use std::marker::PhantomData;

pub(crate) struct Cells<S>(PhantomData<S>);

impl<S: FirstEntry> WalkBrick for Cells<S> {
    fn walk<T: Sample>(field: &Field<'_, T>, pace: &Pace, at: &InBrick) -> Option<Hit> {
        let (mut t, mut p) = (at.t, at.p);
        let mut cell = p.floor().as_ivec3();
        for a in 0..3 {
            // On a face and moving down, the ray is in the cell below.
            let below = i32::from(!pace.forward(a) && pace.moves[a] && p[a] == cell[a] as f32);
            cell[a] = (cell[a] - below).clamp(0, at.size[a] - 1);
        }
        let first = cell;
        loop {
            let (mut t_next, mut axis) = (FAR, 0);
            for a in 0..3 {
                let face = cell[a] + i32::from(pace.forward(a));
                let t_face = pace.to_plane(a, face as f32, at.origin, FAR);
                if t_face < t_next {
                    (t_next, axis) = (t_face, a);
                }
            }
            t_next = t_next.max(t);
            let face = cell[axis] + i32::from(pace.forward(axis));
            let mut q = (at.origin + t_next * pace.direction).clamp(cell.as_vec3(), (cell + 1).as_vec3());
            q[axis] = face as f32;
            let f = field.corners(at.corner + cell);
            if f.iter().any(|&v| inside(v)) {
                let (from, to) = (p - cell.as_vec3(), q - cell.as_vec3());
                if let Some(u) = S::first_entry(&f, from, to) {
                    let met = if u == 0.0 && cell == first { field.met_at_entry(pace, at) } else { Met::Isosurface };
                    return Some(Hit { s: at.s + t + u * (t_next - t), cell: at.corner + cell, local: from.lerp(to, u), met });
                }
            }
            cell[axis] += if pace.forward(axis) { 1 } else { -1 };
            if cell[axis] < 0 || cell[axis] >= at.size[axis] || at.s + t_next > at.s_max {
                return None;
            }
            (t, p) = (t_next, q);
        }
    }
}
