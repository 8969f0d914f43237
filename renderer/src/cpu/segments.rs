//! Solvers on the CPU by themselves: what they make of many segments, for the stability table.
//!
//! The twin of `shaders/segments.wgsl`.

use super::CpuRenderer;
use crate::RenderError;
use crate::lanes::{Floats, LANES, Mask, axes, lerp};
use crate::roots::{Entry, Solver, first_entry};
use crate::stability::{DECIDED_VOXEL, Segment, SolveSegments, Solved};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, dispatch};
use rayon::prelude::*;

/// A cubic crosses zero three times, and a segment that starts inside is entered at its start.
pub(crate) const MOST_ROOTS: u32 = 4;

impl SolveSegments for CpuRenderer {
    fn solve(&mut self, solver: Solver, segments: &[Segment]) -> Result<Vec<Solved>, RenderError> {
        if !solver.on_cpu() {
            return Err(RenderError::NeedsGpu(solver));
        }
        let level = self.level;
        Ok(segments.par_chunks(LANES).flat_map_iter(|some| dispatch!(level, simd => solve(simd, solver, some))).collect())
    }
}

/// The first entry, and the number of entries: from just behind each root on, the next one is sought with the sign of the values turned.
/// Ties are then inside on both sides, which is of no account where a root and what is just behind it are told apart.
#[inline(always)]
fn solve<S: Simd>(simd: S, solver: Solver, segments: &[Segment]) -> Vec<Solved> {
    let lanes = |value: &dyn Fn(&Segment) -> f32| {
        let mut v = [0.0; LANES];
        segments.iter().zip(&mut v).for_each(|(s, v)| *v = value(s));
        Floats::load_array(simd, v)
    };
    let corners: [_; 8] = std::array::from_fn(|c| lanes(&|s| s.corners[c]));
    let (from, to) = (axes!(a => lanes(&|s| s.from[a])), axes!(a => lanes(&|s| s.to[a])));
    let beyond = lanes(&|s| DECIDED_VOXEL as f32 / s.from.distance(s.to));
    let mut solved = vec![Solved { entry: None, entries: 0 }; segments.len()];
    let (mut at, mut sign) = (Floats::splat(simd, 0.0), 1.0);
    let mut asked = Mask::from_bitmask(simd, (1 << segments.len()) - 1);
    for root in 0..MOST_ROOTS {
        asked &= at.simd_lt(1.0);
        let Entry { found, u } = first_entry(simd, solver, &corners.map(|c| sign * c), &lerp(&from, &to, at), &to, asked);
        asked = found;
        let u = at + u * (1.0 - at);
        for (lane, solved) in solved.iter_mut().enumerate().filter(|(lane, _)| found.test(*lane)) {
            if root == 0 {
                solved.entry = Some(u[lane]);
            }
            solved.entries += u32::from(sign > 0.0);
        }
        at = u + beyond;
        sign = -sign;
    }
    solved
}
