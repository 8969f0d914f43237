//! The truth about a family's segments, and what a solver's answers are worth.

use super::faces::across;
use super::segments::{Family, Segment};
use super::{Counts, DECIDED_VOXEL, Faces, Of, Row, SolveSegments, Solved};
use crate::RenderError;
use crate::accuracy::Quantiles;
use crate::roots::Solver;
use rayon::prelude::*;

/// Segments of a family.
const SEGMENTS: usize = 20_000;
/// Cells of other segments behind each segment's face: enough for tens of thousands of faces to be judged.
const NEIGHBOURS: usize = 8;

/// What float64 says about a segment.
struct Truth {
    /// u and whether it enters, in order; first the entry, which is at 0 where it starts inside.
    crossings: Vec<(f64, bool)>,
    /// Voxels.
    length: f64,
    /// Float32 can tell the first entry.
    is_decidable: bool,
    /// Float32 can tell all crossings, and each from the next and from the ends.
    is_countable: bool,
}

impl Truth {
    fn of(s: &Segment) -> Self {
        let doubt = s.doubt();
        let length = f64::from(s.from.distance(s.to));
        let [crossings, raised, lowered] = [0.0, doubt, -doubt].map(|shift| s.crossings(shift));
        let near = |a: &(f64, bool), b: &(f64, bool), voxel: f64| (a.0 - b.0).abs() * length <= voxel;
        let same_entry = |moved: &Vec<(f64, bool)>| match (moved.first(), crossings.first()) {
            (Some(a), Some(b)) => near(a, b, DECIDED_VOXEL),
            (a, b) => a.is_none() && b.is_none(),
        };
        // The next root is sought from this far behind the last: half of it is left for float32 to be wrong about that.
        let same_all = |moved: &Vec<(f64, bool)>| {
            moved.len() == crossings.len() && moved.iter().zip(&crossings).all(|(a, b)| near(a, b, 0.5 * DECIDED_VOXEL))
        };
        let within = crossings.iter().map(|c| c.0).filter(|&u| u > 0.0);
        let stops: Vec<f64> = [0.0].into_iter().chain(within).chain([1.0]).collect();
        let are_apart = stops.windows(2).all(|w| (w[1] - w[0]) * length >= 2.0 * DECIDED_VOXEL);
        let is_decidable = same_entry(&raised) && same_entry(&lowered);
        // A cell of nothing but ties is on both sides everywhere.
        let is_countable = doubt > 0.0 && same_all(&raised) && same_all(&lowered) && are_apart;
        Self { is_countable, is_decidable, length, crossings }
    }

    fn entry(&self) -> Option<f64> {
        self.crossings.first().map(|c| c.0)
    }

    fn entries(&self) -> usize {
        self.crossings.iter().filter(|c| c.1).count()
    }
}

/// A family's segments, with the truth about each.
pub(super) struct Judge {
    /// The segments, then the first cells of the pairs across a face, then their second ones.
    segments: Vec<Segment>,
    truths: Vec<Truth>,
    pairs: usize,
}

impl Judge {
    /// Makes family number `number`.
    pub fn of(family: &Family, number: usize) -> Self {
        let mut segments: Vec<Segment> = (0..SEGMENTS).into_par_iter().map(|n| family.segment(number, n)).collect();
        let truths = segments.par_iter().map(Truth::of).collect();
        let pairs = |n: usize| (1..=NEIGHBOURS).filter_map(|next| across(&segments[n], &segments[(n + next) % SEGMENTS])).collect();
        let pairs = (0..SEGMENTS).into_par_iter().map(pairs).collect::<Vec<Vec<_>>>().concat();
        segments.extend(pairs.iter().map(|p| p[0]));
        segments.extend(pairs.iter().map(|p| p[1]));
        Self { segments, truths, pairs: pairs.len() }
    }

    /// What `solver` makes of it on `machine`.
    pub fn row(&self, family: &'static str, machine: &mut dyn SolveSegments, solver: Solver) -> Result<Row, RenderError> {
        let answers = machine.solve(solver, &self.segments)?;
        let (single, paired) = answers.split_at(self.truths.len());
        let mut row = Row::new(family, machine.backend().name(), solver, Of::Segments);
        let mut counts = Counts { judged: 0, wrong: 0 };
        let mut errors = Vec::new();
        for (truth, answer) in self.truths.iter().zip(single) {
            if truth.is_countable {
                counts.judged += 1;
                counts.wrong += u32::from(answer.entries as usize != truth.entries());
            }
            if !truth.is_decidable {
                row.undecidable += 1;
                continue;
            }
            row.judged += 1;
            match (answer.entry.map(f64::from), truth.entry()) {
                (None, None) => {}
                (None, Some(_)) => row.missed += 1,
                (Some(_), None) => row.false_hits += 1,
                (Some(u), Some(entry)) => {
                    let off = (u - entry).abs();
                    row.wrong_root += u32::from(truth.crossings.iter().skip(1).any(|c| (u - c.0).abs() < off));
                    errors.push(off * truth.length);
                }
            }
        }
        row.error_voxel = Quantiles::of(errors);
        row.counts = Some(counts).filter(|c| c.judged > 0);
        row.faces = self.faces(paired);
        Ok(row)
    }

    fn faces(&self, paired: &[Solved]) -> Option<Faces> {
        let (first, second) = paired.split_at(self.pairs);
        let mut faces = Faces { passed: self.pairs as u32, cracks: 0, double_hits: 0 };
        for pair in first.iter().zip(second) {
            match (pair.0.entry, pair.1.entry) {
                (None, None) => faces.cracks += 1,
                (Some(_), Some(u)) => faces.double_hits += u32::from(u > 0.0),
                _ => {}
            }
        }
        Some(faces).filter(|f| f.passed > 0)
    }
}

#[cfg(test)]
mod tests {
    use super::super::segments::FAMILIES;
    use super::*;
    use crate::picture::Picture;
    use crate::scene::Scene;
    use crate::studio::Tracer;
    use crate::{Backend, Renderer, Split};
    use bregma_field::Volume;
    use std::sync::Arc;

    /// A machine with one answer to everything.
    struct Says(Solved);

    impl Renderer for Says {
        fn name(&self) -> String {
            "says".into()
        }

        fn backend(&self) -> Backend {
            Backend::Cpu
        }

        fn has(&self, _: Solver) -> bool {
            true
        }

        fn sample(&mut self, _: &[Arc<Volume>], scene: &Scene, _: [u32; 2], _: u32) -> Result<Picture, RenderError> {
            Err(RenderError::NeedsGpu(scene.solver))
        }

        fn tracer(&mut self, _: &[Arc<Volume>], scene: &Scene, _: [u32; 2], _: u32) -> Result<Tracer, RenderError> {
            Err(RenderError::NeedsGpu(scene.solver))
        }

        fn bytes(&self) -> usize {
            0
        }

        fn split(&mut self, _: &[Arc<Volume>], scene: &Scene, _: u32, _: u32) -> Result<Split, RenderError> {
            Err(RenderError::NeedsGpu(scene.solver))
        }
    }

    impl SolveSegments for Says {
        fn solve(&mut self, _: Solver, segments: &[Segment]) -> Result<Vec<Solved>, RenderError> {
            Ok(vec![self.0; segments.len()])
        }
    }

    #[test]
    fn who_never_or_always_enters_fails_in_every_column() {
        // Fails if a column cannot tell a bad answer.
        let judge = Judge::of(&FAMILIES[0], 0);
        let never = judge.row("rough", &mut Says(Solved { entry: None, entries: 0 }), Solver::Exact).unwrap();
        let always = judge.row("rough", &mut Says(Solved { entry: Some(0.5), entries: 4 }), Solver::Exact).unwrap();
        let (counts, faces) = (always.counts.unwrap(), always.faces.unwrap());
        assert!(counts.judged > 15_000 && counts.wrong == counts.judged);
        assert!(faces.passed > 15_000 && faces.double_hits == faces.passed && faces.cracks == 0);
        assert!(never.faces.unwrap().cracks == faces.passed && never.counts.unwrap().wrong > 0);
        assert!(never.missed > 0 && never.false_hits == 0 && never.error_voxel.is_none());
        assert!(always.missed == 0 && always.false_hits > 0 && always.wrong_root > 0);
        assert_eq!(never.missed + always.false_hits, always.judged);
    }
}
