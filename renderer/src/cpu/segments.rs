//! Solvers on the CPU by themselves: what they make of many segments, for the stability table.
//!
//! The twin of `shaders/segments.wgsl`.

use super::CpuRenderer;
use crate::RenderError;
use crate::roots::{Analytic, Exact, FirstEntry, Linear, Marmitt, Neubauer, PerVoxel, SegmentSteps, Solver, Steps};
use crate::stability::{DECIDED_VOXEL, Segment, SolveSegments, Solved};
use glam::Vec3;
use rayon::prelude::*;

/// A cubic crosses zero three times, and a segment that starts inside is entered at its start.
const MOST_ROOTS: u32 = 4;

impl SolveSegments for CpuRenderer {
    fn solve(&mut self, solver: Solver, segments: &[Segment]) -> Result<Vec<Solved>, RenderError> {
        let first_entry = first_entry_with(solver)?;
        Ok(segments.par_iter().map(|s| solve(first_entry, s)).collect())
    }
}

type Solve = fn(&[f32; 8], Vec3, Vec3) -> Option<f32>;

fn first_entry_with(solver: Solver) -> Result<Solve, RenderError> {
    Ok(match solver {
        Solver::Exact => Exact::first_entry,
        Solver::Linear => Linear::first_entry,
        Solver::Neubauer(Steps::Two) => Neubauer::<2>::first_entry,
        Solver::Neubauer(Steps::Three) => Neubauer::<3>::first_entry,
        Solver::Neubauer(Steps::Four) => Neubauer::<4>::first_entry,
        Solver::Marmitt(Steps::Two) => Marmitt::<2>::first_entry,
        Solver::Marmitt(Steps::Three) => Marmitt::<3>::first_entry,
        Solver::Marmitt(Steps::Four) => Marmitt::<4>::first_entry,
        Solver::Analytic => Analytic::first_entry,
        Solver::Step(PerVoxel::One) => SegmentSteps::<1>::first_entry,
        Solver::Step(PerVoxel::Two) => SegmentSteps::<2>::first_entry,
        Solver::Step(PerVoxel::Four) => SegmentSteps::<4>::first_entry,
        Solver::Step(PerVoxel::Eight) => SegmentSteps::<8>::first_entry,
        Solver::Filter => return Err(RenderError::NeedsGpu(solver)),
    })
}

/// The first entry, and the number of entries: from just behind each root on, the next one is sought with the sign of the values turned.
/// Ties are then inside on both sides, which is of no account where a root and what is just behind it are told apart.
fn solve(first_entry: Solve, s: &Segment) -> Solved {
    let beyond = DECIDED_VOXEL as f32 / s.from.distance(s.to);
    let mut found = Solved { entry: None, entries: 0 };
    let (mut at, mut sign) = (0.0, 1.0);
    for root in 0..MOST_ROOTS {
        if at >= 1.0 {
            break;
        }
        let Some(part) = first_entry(&s.corners.map(|c| sign * c), s.from.lerp(s.to, at), s.to) else { break };
        let u = at + part * (1.0 - at);
        if root == 0 {
            found.entry = Some(u);
        }
        found.entries += u32::from(sign > 0.0);
        at = u + beyond;
        sign = -sign;
    }
    found
}
