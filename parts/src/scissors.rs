//! Scissors: a line drawn around something in a picture cuts the bone that is seen within it, through and through or down to a depth.

use crate::brush::Span;
use crate::labels::Labels;
use bregma_field::{Cancelled, IndexPoint, Progress, Surface, WorldPoint};
use glam::{DVec2, USizeVec3};
use rayon::prelude::*;

/// Where a point is seen: in the picture, and how far along its ray, mm. `None` where it is behind the eye.
pub type Seen<'a> = &'a (dyn Fn(WorldPoint) -> Option<(DVec2, f64)> + Sync);

/// Bone is cut only as far as `mm` behind the surface that is met first.
#[derive(Clone, Copy)]
pub struct Depth<'a> {
    /// How far.
    pub mm: f64,
    /// How far along its ray through a point of the picture a surface is met first, mm.
    pub first_mm: &'a (dyn Fn(DVec2) -> Option<f64> + Sync),
}

/// What is cut.
#[derive(Clone, Copy)]
pub struct Lasso<'a> {
    /// The corners of the line in the picture; the last is joined to the first. Where it crosses itself, what it goes round an even number of times is outside.
    pub corners: &'a [DVec2],
    /// What lies within it is cut, else what lies outside.
    pub inside: bool,
    /// How the picture shows the surface's own grid, moved as the surface is.
    pub seen: Seen<'a>,
    /// How deep it cuts; through all when absent.
    pub depth: Option<Depth<'a>>,
    /// The numbers that are cut; others, such as those of parts that are not shown, stay.
    pub is_cut: &'a (dyn Fn(u16) -> bool + Sync),
}

impl Labels {
    /// Gives the bone that a lasso cuts another number; gives what changed, `None` where nothing did. `progress` counts tiles.
    pub fn cut(&mut self, bone: &Surface, lasso: &Lasso<'_>, number: u16, progress: &Progress) -> Result<Option<Span>, Cancelled> {
        let outline = Outline::of(lasso.corners);
        progress.begin(self.numbers().tiles().len() as u64);
        let tile = |(first, size, one): (USizeVec3, USizeVec3, Option<u16>)| {
            progress.advance(1)?;
            let is_kept = one.is_some_and(|one| one == number || !(lasso.is_cut)(one));
            if is_kept || (lasso.inside && is_beside(bone, lasso, &outline, first, size)) {
                return Ok(vec![]);
            }
            let all = (0..size.element_product()).map(|n| first + USizeVec3::new(n % size.x, n / size.x % size.y, n / (size.x * size.y)));
            let is_cut = |at: &USizeVec3| {
                let now = self.numbers().at(*at);
                now != number && (lasso.is_cut)(now) && bone.holds(at.to_array()) && lasso.takes(bone, &outline, *at)
            };
            Ok(all.filter(is_cut).collect())
        };
        let cut: Vec<Vec<USizeVec3>> = self.numbers().tiles().map(tile).collect::<Result<_, Cancelled>>()?;
        let mut changed: Option<Span> = None;
        for at in cut.into_iter().flatten() {
            self.numbers_mut().set(at, number);
            let one = Span { low: at, high: at };
            changed = Some(changed.map_or(one, |span| span.with(one)));
        }
        Ok(changed)
    }
}

impl Lasso<'_> {
    fn takes(&self, bone: &Surface, outline: &Outline, at: USizeVec3) -> bool {
        let Some((place, mm)) = (self.seen)(bone.grid.world(IndexPoint(at.as_dvec3()))) else { return false };
        let is_deep = |depth: Depth<'_>| (depth.first_mm)(place).is_none_or(|first| mm > first + depth.mm);
        outline.holds(place) == self.inside && !self.depth.is_some_and(is_deep)
    }
}

/// Whether all of a tile is seen beside the box around the line.
fn is_beside(bone: &Surface, lasso: &Lasso<'_>, outline: &Outline, first: USizeVec3, size: USizeVec3) -> bool {
    let corner = |c: usize| first + (size - 1) * USizeVec3::new(c & 1, c >> 1 & 1, c >> 2);
    let seen = (0..8).map(|c| (lasso.seen)(bone.grid.world(IndexPoint(corner(c).as_dvec3()))).map(|(place, _)| place));
    // What is behind the eye in part has no box.
    let Some(seen) = seen.collect::<Option<Vec<DVec2>>>() else { return false };
    let (low, high) = seen.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)));
    high.cmplt(outline.low).any() || low.cmpgt(outline.high).any()
}

/// Stripes of a picture that a line is sorted into: about as many as a line by hand has corners.
const STRIPES: usize = 256;

/// A closed line whose sides lie in stripes, so that a point is compared with few of them.
struct Outline {
    low: DVec2,
    high: DVec2,
    stripes: Vec<Vec<[DVec2; 2]>>,
}

impl Outline {
    fn of(corners: &[DVec2]) -> Self {
        let (low, high) = corners.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)));
        let mut outline = Self { low, high, stripes: vec![vec![]; STRIPES] };
        for (n, &b) in corners.iter().enumerate() {
            let a = corners[(n + corners.len() - 1) % corners.len()];
            for stripe in outline.stripe(a.y.min(b.y))..=outline.stripe(a.y.max(b.y)) {
                outline.stripes[stripe].push([a, b]);
            }
        }
        outline
    }

    fn stripe(&self, y: f64) -> usize {
        // A line without height has one.
        let part = (y - self.low.y) / (self.high.y - self.low.y).max(f64::MIN_POSITIVE);
        ((part * STRIPES as f64) as usize).min(STRIPES - 1)
    }

    /// Whether it goes round a point an odd number of times.
    fn holds(&self, p: DVec2) -> bool {
        if !(p.cmpge(self.low).all() && p.cmple(self.high).all()) {
            return false;
        }
        let crosses = |[a, b]: &&[DVec2; 2]| (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x);
        self.stripes[self.stripe(p.y)].iter().filter(crosses).count() % 2 == 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_field::Grid;
    use bregma_synthetic::Random;
    use bregma_synthetic::analytic::Sphere;
    use glam::{DAffine3, DMat3, DVec3};
    use std::f64::consts::TAU;
    use std::sync::Arc;

    fn grid() -> Grid {
        Grid::new([60, 50, 40], DVec3::new(0.5, 0.6, 0.7), DVec3::new(-15.0, -15.0, -14.0), DMat3::IDENTITY).unwrap()
    }

    fn ball(centre: DVec3, radius_mm: f64) -> Surface {
        Surface::new(&Arc::new(Sphere { centre, radius_mm }.volume(&grid())), 0.0, DAffine3::IDENTITY).unwrap()
    }

    fn places() -> impl Iterator<Item = (USizeVec3, DVec3)> {
        let grid = grid();
        let [nx, ny, nz] = grid.dims();
        (0..nx * ny * nz).map(move |n| {
            let at = USizeVec3::new(n % nx, n / nx % ny, n / (nx * ny));
            (at, grid.world(IndexPoint(at.as_dvec3())).0)
        })
    }

    fn circle(radius: f64) -> Vec<DVec2> {
        (0..720).map(|n| DVec2::from_angle(TAU * f64::from(n) / 720.0) * radius).collect()
    }

    /// Along parallel rays down z, and from an eye 60 mm above the middle.
    fn along(p: WorldPoint) -> Option<(DVec2, f64)> {
        Some((p.0.truncate(), 100.0 - p.0.z))
    }

    fn from_eye(p: WorldPoint) -> Option<(DVec2, f64)> {
        let way = DVec3::Z * 60.0 - p.0;
        (way.z > 0.0).then(|| (p.0.truncate() / way.z, way.length()))
    }

    #[test]
    fn a_circle_cuts_a_cylinder_or_a_cone_through_the_whole_scan_or_all_else() {
        // Fails if bone within the line stays, bone beside it or what is none is cut, parts that are not meant are, or rays of a perspective are taken as parallel.
        let bone = ball(DVec3::ZERO, 10.0);
        // Between samples, so that rounding decides nothing.
        for (name, seen, radius) in [("parallel", &along as Seen<'_>, 4.03), ("perspective", &from_eye, 0.0707)] {
            for inside in [true, false] {
                let mut labels = Labels::none(grid());
                let corners = circle(radius);
                places().filter(|(_, p)| p.x > 2.0).for_each(|(at, _)| labels.numbers_mut().set(at, 7));
                let lasso = Lasso { corners: &corners, inside, seen, depth: None, is_cut: &|n| n != 7 };
                let changed = labels.cut(&bone, &lasso, 1, &Progress::default()).unwrap();
                // A line of 720 corners is 1e-5 of its radius within the circle.
                let is_near_the_line =
                    |p: DVec3| seen(WorldPoint(p)).is_some_and(|(place, _)| (place.length() / radius - 1.0).abs() < 2e-5);
                let is_cut = |p: DVec3| p.x <= 2.0 && (seen(WorldPoint(p)).unwrap().0.length() < radius) == inside;
                let bony = places().filter(|(at, _)| bone.holds(at.to_array()) || labels.numbers().at(*at) == 1);
                let wrong = bony.filter(|(at, p)| (labels.numbers().at(*at) == 1) != is_cut(*p) && !is_near_the_line(*p));
                assert_eq!(wrong.count(), 0, "{name}, inside: {inside}");
                let changed = changed.unwrap();
                assert!(
                    places().all(|(at, _)| labels.numbers().at(at) != 1 || (at.cmpge(changed.low).all() && at.cmple(changed.high).all()))
                );
            }
        }
    }

    #[test]
    fn a_depth_cuts_from_the_first_surface_on_and_no_deeper() {
        // Fails if depth is counted from the eye, the picture or the middle in place of the surface, or what is hidden behind is cut.
        let bone = ball(DVec3::ZERO, 10.0);
        let first_mm = |place: DVec2| (place.length() < 10.1).then(|| 100.0 - (100.0 - place.length_squared()).max(0.0).sqrt());
        let corners = circle(20.0);
        let mut labels = Labels::none(grid());
        // Between samples, so that rounding decides nothing.
        let depth = Some(Depth { mm: 3.013, first_mm: &first_mm });
        labels
            .cut(&bone, &Lasso { corners: &corners, inside: true, seen: &along, depth, is_cut: &|_| true }, 1, &Progress::default())
            .unwrap();
        let is_cut = |p: DVec3| p.z >= (100.0 - p.truncate().length_squared()).max(0.0).sqrt() - 3.013;
        let (mut cut, mut wrong) = (0, 0);
        for (at, p) in places().filter(|(at, _)| bone.holds(at.to_array())) {
            cut += usize::from(is_cut(p));
            wrong += usize::from((labels.numbers().at(at) == 1) != is_cut(p));
        }
        println!("{cut} samples to a depth of 3 mm, {wrong} of them otherwise");
        assert!(cut > 1000 && wrong == 0);
    }

    #[test]
    fn an_outline_holds_what_it_goes_round_an_odd_number_of_times() {
        // Fails if a side is missing from a stripe that it passes, a corner counts twice, or a line without area holds something.
        let mut random = Random(5);
        for count in [3, 4, 5, 12, 300] {
            let corners: Vec<DVec2> =
                (0..count).map(|_| DVec2::new((8.0 * random.unit()).floor(), (8.0 * random.unit()).floor())).collect();
            let outline = Outline::of(&corners);
            for _ in 0..2000 {
                let p = DVec2::new(9.0 * random.unit() - 0.5, 9.0 * random.unit() - 0.5);
                let turn = |n: usize| {
                    let [a, b] = [corners[n] - p, corners[(n + 1) % count] - p];
                    a.perp_dot(b).atan2(a.dot(b))
                };
                let turns = ((0..count).map(turn).sum::<f64>() / TAU).round() as i64;
                let is_odd = turns.rem_euclid(2) == 1;
                assert_eq!(outline.holds(p), is_odd, "{count} corners, {p}");
            }
        }
        assert!(!Outline::of(&[DVec2::ZERO, DVec2::X]).holds(DVec2::new(0.5, 0.0)) && !Outline::of(&[]).holds(DVec2::ZERO));
    }
}
