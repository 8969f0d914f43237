//! Bone between painted parts: each sample of bone goes to the part that is nearest through bone.

use crate::error::PartsError;
use crate::growth::Growth;
use crate::labels::Labels;
use bregma_field::{Progress, Samples, Surface};
use glam::USizeVec3;
use rayon::prelude::*;

impl Labels {
    /// Lets two or more parts grow through the bone of a surface of the same grid until they meet; bone that none of them reaches stays nobody's. What has a
    /// number keeps it. It needs 10 bytes for each sample of the scan.
    pub fn grown_from_seeds(&self, bone: &Surface, progress: &Progress) -> Result<Self, PartsError> {
        let dims = self.grid().dims();
        let [nx, ny, _] = dims;
        let count = self.grid().len();
        let mut growth = Growth { dims, spacing_mm: self.grid().spacing_mm(), owner: vec![0; count], way_mm: vec![0.0; count] };
        let rows = growth.owner.par_chunks_mut(nx).zip(growth.way_mm.par_chunks_mut(nx)).enumerate();
        rows.for_each(|(row, (owner, way_mm))| {
            let [j, k] = [row % ny, row / ny];
            self.numbers().read(USizeVec3::new(0, j, k), owner);
            for (i, (owner, way_mm)) in owner.iter_mut().zip(way_mm).enumerate() {
                *way_mm = match (bone.holds([i, j, k]), *owner) {
                    (false, _) => -1.0,
                    (true, 0) => f32::INFINITY,
                    (true, _) => 0.0,
                };
                // Nothing grows from what is no bone.
                *owner = if *way_mm < 0.0 { 0 } else { *owner };
            }
        });
        let seeds = growth.owner.par_iter().copied().filter(|owner| *owner > 0);
        let two = seeds.map(|n| [n, n]).reduce(|| [u16::MAX, 0], |a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        if two[0] >= two[1] {
            return Err(PartsError::Seeds { scan: bone.volume.name().to_owned() });
        }
        growth.grow(progress)?;
        let rows = growth.owner.par_chunks_mut(nx).zip(growth.way_mm.par_chunks(nx)).enumerate();
        rows.for_each(|(row, (owner, way_mm))| {
            let mut was = vec![0; nx];
            self.numbers().read(USizeVec3::new(0, row % ny, row / ny), &mut was);
            owner.iter_mut().zip(way_mm).zip(was).filter(|((_, way_mm), _)| **way_mm < 0.0).for_each(|((owner, _), was)| *owner = was);
        });
        Self::new(self.grid().clone(), Samples::U16(growth.owner), self.parts().to_vec())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brush::Dab;
    use crate::labels::Part;
    use bregma_field::{Grid, IndexPoint};
    use bregma_synthetic::analytic::sampled;
    use glam::{DAffine3, DMat3, DVec3};
    use std::sync::Arc;

    #[test]
    fn seeds_share_a_bar_in_its_middle_and_leave_what_they_do_not_reach() {
        // Fails if the nearer seed does not get a sample, one grows over a gap, what was painted changes, or one seed alone is taken as two.
        let grid = Grid::new([60, 12, 12], DVec3::ONE, DVec3::ZERO, DMat3::IDENTITY).unwrap();
        let bar = |y: f64, p: DVec3| 2.2 - (p.y - y).abs().max((p.z - 5.0).abs());
        let volume = sampled("bars", &grid, |p| bar(2.0, p).max(if p.x < 20.0 { bar(8.5, p) } else { -1.0 }));
        let bone = Surface::new(&Arc::new(volume), 0.0, DAffine3::IDENTITY).unwrap();
        let dab = |x: f64, number| Dab { at: IndexPoint(DVec3::new(x, 2.0, 5.0)), radius_mm: 1.1, number };
        let mut labels = Labels::none(grid.clone());
        labels.paint(&bone, dab(4.0, 1), |_| true).unwrap();
        assert!(matches!(labels.grown_from_seeds(&bone, &Progress::default()), Err(PartsError::Seeds { .. })));
        labels.paint(&bone, dab(55.0, 5), |_| true).unwrap();
        let labels = labels.with(grid, vec![Part::new(1, "left".into()), Part::new(5, "right".into())]);
        let grown = labels.grown_from_seeds(&bone, &Progress::default()).unwrap();
        assert_eq!(grown.parts(), labels.parts());
        for x in 0..60 {
            // 4 and 55 are as far from 29.5.
            assert_eq!(grown.number([x, 2, 5]), if x < 30 { 1 } else { 5 }, "{x}");
            assert_eq!(grown.number([x, 8, 5]), 0);
            assert_eq!(grown.number([x, 11, 11]), 0);
        }
    }
}
