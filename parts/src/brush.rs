//! A brush: a ball that gives the bone in it another number, as far as it hangs together there with the bone that was touched.
//!
//! So a wall on the other side of a gap that is narrower than the ball keeps its number, and so does all that is no bone. What it costs, and what a
//! step of undo keeps, grows with the ball and not with the scan.

use crate::labels::Labels;
use bregma_field::{IndexPoint, Surface};
use glam::{DVec3, USizeVec3};

/// A touch of the brush.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dab {
    /// Where the bone was touched: on its surface, or in it.
    pub at: IndexPoint,
    /// Radius of the ball, mm.
    pub radius_mm: f64,
    /// The number that samples get: a part's, or 0 to erase.
    pub number: u16,
}

/// Samples between two corners, both of them within.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    /// The first along each axis.
    pub low: USizeVec3,
    /// The last.
    pub high: USizeVec3,
}

impl Span {
    /// What holds both.
    pub fn with(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    fn size(self) -> USizeVec3 {
        self.high - self.low + 1
    }

    fn holds(self, at: USizeVec3) -> bool {
        at.cmpge(self.low).all() && at.cmple(self.high).all()
    }

    fn number(self, at: USizeVec3) -> usize {
        let (at, size) = (at - self.low, self.size());
        (at.z * size.y + at.y) * size.x + at.x
    }
}

impl Labels {
    /// Paints with the brush on the bone of a surface of the same grid; gives what may have changed, and `None` where nothing did: where no bone is touched, or
    /// all of it had the number. Samples whose number may not be `taken`, such as those of parts that are not shown, keep it.
    pub fn paint(&mut self, bone: &Surface, dab: Dab, taken: impl Fn(u16) -> bool) -> Option<Span> {
        let span = self.within_reach(dab)?;
        let matrix = self.grid().index_to_world().matrix3;
        let reaches = |at: USizeVec3| (matrix * (at.as_dvec3() - dab.at.0)).length_squared() <= dab.radius_mm * dab.radius_mm;
        let seed = self.touched(bone, dab.at.0)?;
        let mut was_seen = vec![false; span.size().element_product()];
        let mut waiting = vec![];
        // What is touched belongs to it however small the ball.
        if span.holds(seed) {
            was_seen[span.number(seed)] = true;
            waiting.push(seed);
        }
        let mut changed: Option<Span> = None;
        while let Some(at) = waiting.pop() {
            let number = self.numbers().at(at);
            if number != dab.number && taken(number) {
                self.numbers_mut().set(at, dab.number);
                let one = Span { low: at, high: at };
                changed = Some(changed.map_or(one, |span| span.with(one)));
            }
            for step in [USizeVec3::X, USizeVec3::Y, USizeVec3::Z] {
                for to in [at.wrapping_add(step), at.wrapping_sub(step)] {
                    if span.holds(to) && !was_seen[span.number(to)] && reaches(to) && bone.holds(to.to_array()) {
                        was_seen[span.number(to)] = true;
                        waiting.push(to);
                    }
                }
            }
        }
        changed
    }

    /// The samples around the ball, and around what it touches.
    fn within_reach(&self, dab: Dab) -> Option<Span> {
        let to_index = self.grid().world_to_index().matrix3;
        // The extent of an ellipsoid along an axis is the length of that row of its matrix.
        let reach = DVec3::new(to_index.row(0).length(), to_index.row(1).length(), to_index.row(2).length()) * dab.radius_mm;
        let last = USizeVec3::from(self.grid().dims()) - 1;
        let (low, high) = ((dab.at.0 - reach.max(DVec3::ONE)).floor(), (dab.at.0 + reach.max(DVec3::ONE)).ceil());
        let is_there = low.is_finite() && high.is_finite() && high.min_element() >= 0.0 && low.cmple(last.as_dvec3()).all();
        is_there.then(|| Span { low: low.max(DVec3::ZERO).as_usizevec3(), high: high.max(DVec3::ZERO).as_usizevec3().min(last) })
    }

    /// The sample of bone that is nearest to a point, among the corners of its cell and those beside: where a surface passes, one of them is bone.
    fn touched(&self, bone: &Surface, at: DVec3) -> Option<USizeVec3> {
        let last = USizeVec3::from(self.grid().dims()) - 1;
        let matrix = self.grid().index_to_world().matrix3;
        let near = (at.round() - 1.0).max(DVec3::ZERO).as_usizevec3();
        let all = (0..27).map(|n| near + USizeVec3::new(n % 3, n / 3 % 3, n / 9)).filter(|at| at.cmple(last).all());
        let far = |to: &USizeVec3| (matrix * (to.as_dvec3() - at)).length_squared();
        all.filter(|at| bone.holds(at.to_array())).min_by(|a, b| far(a).total_cmp(&far(b)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::islands::Islands;
    use bregma_field::{Grid, Progress};
    use bregma_synthetic::analytic::sampled;
    use glam::{DAffine3, DMat3};
    use std::sync::Arc;

    /// Two plates that lie 2 mm apart, each 3 mm thick, on cells of different lengths that are sheared.
    fn plates() -> Surface {
        let shear = DMat3::from_cols(DVec3::new(0.8, 0.6, 0.0), DVec3::new(-0.6, 0.8, 0.0), DVec3::Z);
        let grid = Grid::new([50, 44, 30], DVec3::new(0.5, 0.6, 0.7), DVec3::new(3.0, -8.0, 40.0), shear).unwrap();
        let middle = grid.world(IndexPoint(DVec3::new(24.5, 21.5, 14.5))).0.z;
        let volume = sampled("plates", &grid, |p| 1.5 - ((p.z - middle).abs() - 2.5).abs());
        Surface::new(&Arc::new(volume), 0.0, DAffine3::IDENTITY).unwrap()
    }

    fn places(labels: &Labels) -> impl Iterator<Item = USizeVec3> {
        let [nx, ny, nz] = labels.grid().dims();
        (0..nx * ny * nz).map(move |n| USizeVec3::new(n % nx, n / nx % ny, n / (nx * ny)))
    }

    fn counted(labels: &Labels, number: u16) -> usize {
        places(labels).filter(|at| labels.numbers().at(*at) == number).count()
    }

    #[test]
    fn a_dab_paints_the_bone_in_its_ball_and_nothing_behind_a_gap() {
        // Fails if a sample in the ball is missed, one beyond it or without bone is painted, the other plate is reached through the gap, or an axis's
        // length is another's. Balls at the grid's corners and outside of it are among these.
        let bone = plates();
        let grid = bone.volume.grid().clone();
        let middle = grid.world(IndexPoint(DVec3::new(24.5, 21.5, 14.5))).0;
        let is_upper = |at: USizeVec3| grid.world(IndexPoint(at.as_dvec3())).0.z > middle.z;
        for (across, radius_mm) in
            [(DVec3::ZERO, 4.0), (DVec3::new(1.3, -2.1, 0.0), 6.0), (DVec3::new(40.0, 3.0, 0.0), 5.0), (DVec3::X, 0.01)]
        {
            let mut labels = Labels::none(grid.clone());
            let touched = middle + across + DVec3::Z * 4.0;
            let found = labels.paint(&bone, Dab { at: grid.index(bregma_field::WorldPoint(touched)), radius_mm, number: 1 }, |_| true);
            let expected: Vec<USizeVec3> = places(&labels)
                .filter(|at| bone.holds(at.to_array()) && is_upper(*at))
                .filter(|at| grid.world(IndexPoint(at.as_dvec3())).0.distance(touched) <= radius_mm)
                .collect();
            let painted: Vec<USizeVec3> = places(&labels).filter(|at| labels.numbers().at(*at) == 1).collect();
            println!("a ball of {radius_mm} mm: {} samples", painted.len());
            match radius_mm < 0.1 {
                // It lies between samples: the one that was touched.
                true => assert_eq!(painted.len(), 1),
                false => assert_eq!(painted, expected),
            }
            let span = found.map(|span| (span.low, span.high));
            let bounds = |f: fn(USizeVec3, USizeVec3) -> USizeVec3| painted.iter().copied().reduce(f);
            assert_eq!(span, bounds(USizeVec3::min).zip(bounds(USizeVec3::max)));
        }
    }

    #[test]
    fn an_eraser_takes_what_it_is_told_to_and_a_step_back_is_what_was() {
        // Fails if erasing takes another part, reaches where nothing was painted, or a copy that was kept for undo changes or holds the whole scan.
        let bone = plates();
        let at = |x: f64| IndexPoint(DVec3::new(x, 21.5, 20.0));
        let mut labels = Labels::none(bone.volume.grid().clone());
        let dab = |x: f64, number| Dab { at: at(x), radius_mm: 3.0, number };
        labels.paint(&bone, dab(20.0, 1), |_| true).unwrap();
        labels.paint(&bone, dab(26.0, 2), |_| true).unwrap();
        let before = labels.clone();
        let [one, two] = [counted(&labels, 1), counted(&labels, 2)];
        assert!(one > 0 && two > one);
        labels.paint(&bone, dab(23.0, 0), |n| n == 1).unwrap();
        assert!(counted(&labels, 1) < one && counted(&labels, 2) == two);
        assert_eq!([counted(&before, 1), counted(&before, 2)], [one, two]);
        assert!(labels.paint(&bone, dab(23.0, 0), |n| n == 1).is_none(), "nothing is left to erase there");
        assert!(labels.paint(&bone, Dab { at: IndexPoint(DVec3::splat(-90.0)), radius_mm: 3.0, number: 1 }, |_| true).is_none());
        assert!(labels.paint(&bone, Dab { at: IndexPoint(DVec3::splat(f64::NAN)), radius_mm: 3.0, number: 1 }, |_| true).is_none());
        assert!(labels.bytes_beside(&before) <= 16 * 4096, "{} bytes", labels.bytes_beside(&before));
    }

    #[test]
    fn a_dab_costs_what_its_ball_holds() {
        // Fails if a dab looks at the whole scan, or undo keeps a copy of it. BREGMA_SIZE=512 for the figure.
        let size: usize = std::env::var("BREGMA_SIZE").ok().and_then(|n| n.parse().ok()).unwrap_or(128);
        let skull = Arc::new(bregma_synthetic::skull(bregma_synthetic::Which::A, size, &Progress::default()).unwrap());
        let bone = Surface::new(&skull, 226.0, DAffine3::IDENTITY).unwrap();
        let islands = Islands::of_bone(&bone, &Progress::default()).unwrap();
        let mut labels = islands.labels(skull.grid(), &[(0, "Skull".to_owned())]).unwrap();
        let before = labels.clone();
        let found: Vec<USizeVec3> = places(&labels).filter(|at| bone.holds(at.to_array())).step_by(9973).take(60).collect();
        let mut times = vec![];
        for (n, at) in found.iter().enumerate() {
            let begun = std::time::Instant::now();
            let dab = Dab { at: IndexPoint(at.as_dvec3()), radius_mm: 5.0, number: 2 + n as u16 % 2 };
            labels.paint(&bone, dab, |_| true);
            times.push(begun.elapsed().as_secs_f64() * 1e3);
        }
        times.sort_by(f64::total_cmp);
        let [median, worst] = [times[times.len() / 2], times[times.len() - 1]];
        let kept = labels.bytes_beside(&before) as f64 / 1e6;
        println!("{size}³: a dab of 5 mm takes {median:.2} ms, the slowest {worst:.2}; {} dabs keep {kept:.2} MB for undo", found.len());
        assert!(median < 20.0, "{median} ms");
    }
}
