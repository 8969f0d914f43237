//! The solver `neubauer`: linear interpolation, repeated (Neubauer, Mroz, Hauser and Wegenkittl 2002). As blind as `linear` to what
//! enters and leaves within a cell, and of three roots it may return the last.
//!
//! The twin of `shaders/neubauer.wgsl`.

use super::{FirstEntry, inside, trilinear};
use glam::Vec3;

pub(crate) struct Neubauer<const STEPS: u32>;

impl<const STEPS: u32> FirstEntry for Neubauer<STEPS> {
    fn first_entry(f: &[f32; 8], p: Vec3, q: Vec3) -> Option<f32> {
        let (mut f0, mut f1) = (trilinear(f, p), trilinear(f, q));
        if inside(f0) {
            return Some(0.0);
        }
        if !inside(f1) {
            return None;
        }
        let (mut u0, mut u1) = (0.0, 1.0);
        for _ in 0..STEPS {
            let u = u0 + (u1 - u0) * (f0 / (f0 - f1));
            let value = trilinear(f, p.lerp(q, u));
            if inside(value) {
                (u1, f1) = (u, value);
            } else {
                (u0, f0) = (u, value);
            }
        }
        Some(u0 + (u1 - u0) * (f0 / (f0 - f1)))
    }
}
