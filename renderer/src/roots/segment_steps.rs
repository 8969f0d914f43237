//! Fixed steps along a segment of one cell: samples at multiples of the step from where the segment begins, and at its end, with one
//! linear interpolation where two lie on different sides. Pictures are drawn by `cpu/steps.rs`, which knows no cells; this is for the
//! stability table, and judges the method as if sampling began anew in each cell.
//!
//! The twin of `shaders/segment_steps.wgsl`.

use super::{FirstEntry, inside, trilinear};
use glam::Vec3;

pub(crate) struct SegmentSteps<const PER_VOXEL: u32>;

impl<const PER_VOXEL: u32> FirstEntry for SegmentSteps<PER_VOXEL> {
    fn first_entry(f: &[f32; 8], p: Vec3, q: Vec3) -> Option<f32> {
        let steps = PER_VOXEL as f32 * p.distance(q);
        let (mut n, mut u0, mut f0) = (0.0, 0.0, trilinear(f, p));
        if inside(f0) {
            return Some(0.0);
        }
        while n < steps {
            n += 1.0;
            let u1 = if n < steps { n / steps } else { 1.0 };
            let f1 = trilinear(f, p.lerp(q, u1));
            if inside(f1) {
                return Some(u0 + (u1 - u0) * (f0 / (f0 - f1)));
            }
            (u0, f0) = (u1, f1);
        }
        None
    }
}
