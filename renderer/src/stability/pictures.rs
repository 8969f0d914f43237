//! Pictures of a family's views, judged ray by ray.

use super::views::{Family, View};
use super::{Of, Row, SolveSegments, StabilityError};
use crate::accuracy::{DEPTH_TOLERANCE_VOXEL, Tally, Truth, Verdict};
use crate::roots::Solver;
use crate::scene::Scene;
use bregma_field::{Progress, crossings};
use std::sync::OnceLock;

/// Pixels along a side of a picture.
const SIDE: u32 = 128;

/// A view with the truth about it.
struct Judge {
    view: View,
    truth: Truth,
    /// Depths of all crossings of a pixel's ray, mm; worked out when an answer is far from the first entry.
    crossings: Vec<OnceLock<Vec<f64>>>,
}

impl Judge {
    fn of(view: View) -> Result<Self, StabilityError> {
        let truth = Truth::of(&view.volumes, &view.scene, SIDE, SIDE, &Progress::default())?;
        Ok(Self { view, truth, crossings: vec![OnceLock::new(); (SIDE * SIDE) as usize] })
    }

    /// Whether the answer for pixel `n` is nearer to a later crossing than to the first entry.
    fn is_wrong_root(&self, n: usize, verdict: &Verdict) -> bool {
        let Verdict::Hit(off) = verdict else { return false };
        let mm = f64::from(off.mm);
        if f64::from(off.voxel.abs()) <= DEPTH_TOLERANCE_VOXEL {
            return false;
        }
        let entry_mm = self.truth.depth_mm(n);
        let of_ray = || {
            let ray = self.truth.ray(n);
            let crossings = self.truth.surfaces().iter().flat_map(|s| crossings::crossings(s, &ray));
            crossings.map(|c| c.t_mm).filter(|&t| t > entry_mm).collect()
        };
        self.crossings[n].get_or_init(of_ray).iter().any(|t| (entry_mm + mm - t).abs() < mm.abs())
    }
}

/// What each solver makes of the family on each machine that has it.
pub(super) fn rows(family: &Family, machines: &mut [&mut dyn SolveSegments]) -> Result<Vec<Row>, StabilityError> {
    let judges: Vec<Judge> = (family.views)().into_iter().map(Judge::of).collect::<Result<_, _>>()?;
    let mut rows = Vec::new();
    for solver in Solver::ALL {
        for machine in machines.iter_mut().filter(|m| m.has(solver)) {
            let mut row = Row::new(family.name, machine.backend().name(), solver, Of::Rays);
            let mut tally = Tally::default();
            for judge in &judges {
                let scene = Scene { solver, ..judge.view.scene.clone() };
                let verdicts = judge.truth.judge(&machine.render(&judge.view.volumes, &scene, SIDE, SIDE)?);
                row.wrong_root += verdicts.iter().enumerate().filter(|(n, v)| judge.is_wrong_root(*n, v)).count() as u32;
                tally.add(&verdicts);
            }
            row.undecidable = tally.counts.tangent as u32;
            row.judged = (tally.counts.rays - tally.counts.tangent) as u32;
            (row.missed, row.false_hits) = (tally.counts.missed as u32, tally.counts.false_hits as u32);
            row.error_voxel = tally.depth_voxel();
            rows.push(row);
        }
    }
    Ok(rows)
}
