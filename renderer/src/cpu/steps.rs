//! Within a brick: steps of fixed length, with one linear interpolation where two samples lie on different sides. This is what most
//! volume renderers do. Sample n lies at depth n·step behind the base plane, whatever bricks are skipped.
//!
//! The twin of `shaders/steps.wgsl`.

use super::walk::{Field, Hit, InBrick, Met, Pace, WalkBrick};
use crate::roots::{inside, trilinear};
use bregma_volume::Sample;
use glam::{IVec3, Vec3};

pub(crate) struct FixedSteps<const PER_VOXEL: u32>;

impl<const PER_VOXEL: u32> WalkBrick for FixedSteps<PER_VOXEL> {
    fn walk<T: Sample>(field: &Field<'_, T>, pace: &Pace, at: &InBrick<'_>) -> Option<Hit> {
        let step = 1.0 / (PER_VOXEL as f32 * pace.direction.length());
        // The last sample before the brick, but not before the box or the eye, where the first sample is taken.
        let mut n = ((at.s + at.t) / step).floor();
        let (mut t0, mut p0) = (n * step - at.s, Vec3::ZERO);
        if field.met_at_entry(pace, at) != Met::Isosurface || n * step < 0.0 {
            (t0, p0) = (at.t, at.p);
        } else {
            p0 += at.origin + t0 * pace.direction;
        }
        let mut f0 = value(field, at.corner, p0);
        if inside(f0) {
            return Some(hit(field, at, t0, p0, field.met_at_entry(pace, at)));
        }
        loop {
            n += 1.0;
            let t1 = n * step - at.s;
            if t1 > at.t_out || at.s + t0 > at.s_max {
                return None;
            }
            let p1 = at.origin + t1 * pace.direction;
            let f1 = value(field, at.corner, p1);
            if inside(f1) {
                let u = f0 / (f0 - f1);
                return Some(hit(field, at, t0 + u * (t1 - t0), p0.lerp(p1, u), Met::Isosurface));
            }
            (t0, p0, f0) = (t1, p1, f1);
        }
    }
}

/// The cell of a point, which may lie a step outside the brick, but is taken within the box.
fn cell_of<T: Sample>(field: &Field<'_, T>, corner: IVec3, p: Vec3) -> (IVec3, Vec3) {
    let last = IVec3::from_array(field.dims.map(|n| n as i32 - 2));
    let cell = (corner + p.floor().as_ivec3()).clamp(IVec3::ZERO, last);
    (cell, (p - (cell - corner).as_vec3()).clamp(Vec3::ZERO, Vec3::ONE))
}

fn value<T: Sample>(field: &Field<'_, T>, corner: IVec3, p: Vec3) -> f32 {
    let (cell, local) = cell_of(field, corner, p);
    trilinear(&field.corners(cell), local)
}

fn hit<T: Sample>(field: &Field<'_, T>, at: &InBrick<'_>, t: f32, p: Vec3, met: Met) -> Hit {
    let (cell, local) = cell_of(field, at.corner, p);
    Hit { s: at.s + t, cell, local, met }
}
