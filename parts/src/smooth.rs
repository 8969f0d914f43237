//! Parts with smooth borders: of each the space that is nearer to it than to others flows by its mean curvature, and each sample goes to the part in whose
//! space it then lies deepest. Bone stays bone: only borders between parts, and between parts and bone that is nobody's, move.

use crate::error::PartsError;
use crate::labels::Labels;
use crate::space::Meant;
use bregma_field::{Progress, Surface};
use glam::USizeVec3;
use rayon::prelude::*;

impl Labels {
    /// Smooths borders so far that what reaches `radius_mm` or less into another part is taken back; `bone` is a surface of the same grid. It needs four bytes for
    /// each sample, and 24 for each of bone that is nobody's. `progress` counts the steps of each part in turn.
    pub fn smoothed(&self, bone: &Surface, radius_mm: f64, progress: &Progress) -> Result<Self, PartsError> {
        if !(radius_mm.is_finite() && radius_mm > 0.0) {
            return Err(PartsError::Smooth(radius_mm));
        }
        let grid = self.grid();
        let (all, rest) = self.clone().with_part("")?;
        let all = all.with_rest(bone, rest);
        let border = all.bordering();
        // Of each sample how deep it lies in the space that it lies deepest in, and whose that is.
        let mut deepest: Vec<(i16, u16)> = vec![(i16::MIN, 0); grid.len()];
        let [nx, ny, _] = grid.dims();
        let mut borders = vec![false; 1 << 16];
        border.iter().for_each(|number| borders[usize::from(*number)] = true);
        for number in border {
            // Far enough from the bone for what ends there not to be felt.
            let meant = Meant { numbers: &[number], grow_mm: 2.0 * radius_mm, bone: None };
            let space = all.space_of(meant, progress)?.smoothed(grid, radius_mm, progress)?;
            deepest.par_iter_mut().enumerate().for_each(|(n, deepest)| {
                let depth = space.units_at([n % nx, n / nx % ny, n / (nx * ny)]);
                *deepest = (*deepest).max((depth, number));
            });
        }
        progress.advance(0)?;
        let mut smooth = self.clone();
        for (n, &(_, number)) in deepest.iter().enumerate() {
            let at = USizeVec3::new(n % nx, n / nx % ny, n / (nx * ny));
            // What touches nothing else stays, and what is in no part at all.
            if borders[usize::from(all.numbers().at(at))] {
                smooth.numbers_mut().set(at, if number == rest { 0 } else { number });
            }
        }
        Ok(smooth)
    }

    /// With bone of nobody as a part.
    fn with_rest(mut self, bone: &Surface, rest: u16) -> Self {
        let of = |(first, size, one): (USizeVec3, USizeVec3, Option<u16>)| {
            let all = (0..size.element_product()).map(|n| first + USizeVec3::new(n % size.x, n / size.x % size.y, n / (size.x * size.y)));
            let is_rest = |at: &USizeVec3| self.numbers().at(*at) == 0 && bone.holds(at.to_array());
            if one.is_some_and(|one| one > 0) { vec![] } else { all.filter(is_rest).collect::<Vec<_>>() }
        };
        let found: Vec<Vec<USizeVec3>> = self.numbers().tiles().map(of).collect();
        found.into_iter().flatten().for_each(|at| self.numbers_mut().set(at, rest));
        self
    }

    /// The numbers of parts that touch another one by a face of their voxels.
    fn bordering(&self) -> Vec<u16> {
        let dims = USizeVec3::from(self.grid().dims());
        let mut touches = vec![false; 1 << 16];
        let of = |(first, size, _): (USizeVec3, USizeVec3, Option<u16>)| {
            let mut pairs = vec![];
            for n in 0..size.element_product() {
                let at = first + USizeVec3::new(n % size.x, n / size.x % size.y, n / (size.x * size.y));
                let here = self.numbers().at(at);
                let behind = [USizeVec3::X, USizeVec3::Y, USizeVec3::Z].map(|step| at + step).into_iter().filter(|to| to.cmplt(dims).all());
                pairs.extend(
                    behind.map(|to| self.numbers().at(to)).filter(|&there| here > 0 && there > 0 && there != here).flat_map(|n| [here, n]),
                );
                pairs.dedup();
            }
            pairs
        };
        let pairs: Vec<Vec<u16>> = self.numbers().tiles().map(of).collect();
        pairs.into_iter().flatten().for_each(|n| touches[usize::from(n)] = true);
        (1..=u16::MAX).filter(|&n| touches[usize::from(n)]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::Part;
    use bregma_field::{Grid, Samples};
    use bregma_synthetic::Random;
    use bregma_synthetic::analytic::sampled;
    use glam::{DAffine3, DMat3, DVec3};
    use std::sync::Arc;

    #[test]
    fn a_ragged_border_becomes_straight_and_no_bone_is_lost() {
        // Fails if a border keeps its teeth, moves as a whole, bone loses its part or gains one that it does not touch, or what lies apart changes.
        let grid = Grid::new([48, 32, 24], DVec3::splat(0.5), DVec3::ZERO, DMat3::IDENTITY).unwrap();
        let volume = sampled("bar", &grid, |p| 4.0 - (p.y - 8.0).abs().max((p.z - 6.0).abs()));
        let bone = Surface::new(&Arc::new(volume), 0.0, DAffine3::IDENTITY).unwrap();
        let mut random = Random(9);
        let numbers: Vec<u8> = (0..grid.len())
            .map(|n| {
                let [x, y, z] = [n % 48, n / 48 % 32, n / (48 * 32)];
                let ragged = 23.5 + 4.0 * (random.unit() - 0.5);
                match (bone.holds([x, y, z]), (x as f64) < ragged, x < 40) {
                    (false, ..) => 0,
                    (_, true, _) => 1,
                    (_, _, true) => 2,
                    // Nobody's bone is somebody, too.
                    _ => 0,
                }
            })
            .collect();
        let parts = ["a", "b"].iter().zip(1..).map(|(name, n)| Part::new(n, (*name).to_owned())).collect();
        let labels = Labels::new(grid.clone(), Samples::U8(numbers), parts).unwrap();
        let smooth = labels.smoothed(&bone, 2.5, &Progress::default()).unwrap();
        let (mut ragged, mut off) = (0, 0);
        for n in 0..grid.len() {
            let at = [n % 48, n / 48 % 32, n / (48 * 32)];
            let expected = match (bone.holds(at), at[0]) {
                (false, _) | (_, 40..) => 0,
                (_, ..=23) => 1,
                _ => 2,
            };
            ragged += usize::from(labels.number(at) != expected);
            off += usize::from(smooth.number(at) != expected);
        }
        println!("{ragged} samples beside a straight border, {off} once it is smooth");
        assert!(ragged > 200 && off * 10 < ragged, "{off}");
        assert!(labels.smoothed(&bone, 0.0, &Progress::default()).is_err());
    }
}
