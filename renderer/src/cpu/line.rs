//! Line that rays follow, in float64, and which part of them is asked for.
//!
//! The twin of `shaders/line.wgsl`, where a number is a pair of float32: a GPU has no float64.

use crate::lanes::{Doubles, Floats, axes};
use fearless_simd::Simd;

/// Rays of pixels in index space: `origin + s·direction`, s in mm of depth behind the picture's base plane.
#[derive(Clone, Copy)]
pub(crate) struct Line<S: Simd> {
    pub origin: [Doubles<S>; 3],
    pub direction: [Doubles<S>; 3],
}

impl<S: Simd> Line<S> {
    #[inline(always)]
    pub fn at(&self, s: Floats<S>) -> [Doubles<S>; 3] {
        let s = Doubles::of(s);
        axes!(a => self.origin[a] + s * self.direction[a])
    }
}

/// Which part of each line is asked for.
#[derive(Clone, Copy)]
pub(crate) struct Part<S: Simd> {
    /// Where the line begins: at the eye, a hit, or a cut.
    pub begin: Floats<S>,
    /// Before here nothing is.
    pub s_min: Floats<S>,
    /// After here nothing is asked for.
    pub s_max: Floats<S>,
}
