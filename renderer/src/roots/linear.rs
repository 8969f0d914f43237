//! The solver `linear`: one interpolation between the values at entry and exit. Misses what enters and leaves within a cell.
//!
//! The twin of `shaders/linear.wgsl`.

use super::{FirstEntry, inside, trilinear};
use glam::Vec3;

pub(crate) struct Linear;

impl FirstEntry for Linear {
    fn first_entry(f: &[f32; 8], p: Vec3, q: Vec3) -> Option<f32> {
        let (f0, f1) = (trilinear(f, p), trilinear(f, q));
        if inside(f0) {
            return Some(0.0);
        }
        inside(f1).then(|| f0 / (f0 - f1))
    }
}
