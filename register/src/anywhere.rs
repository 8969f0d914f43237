//! Two surfaces brought together from anywhere, whole or in parts.
//!
//! Rotations spread evenly over all, each with shifts that lay a point of one surface onto one of the other that faces the same way, are judged by
//! few points on coarse maps; the best are refined on more and more. The runner-up is told: what looks the same from two sides has no one pose.

use crate::cloud::Oriented;
use crate::coarse::Coarse;
use crate::motion::{solve, turn_deg};
use crate::surfaces::{Fit, Pair, row};
use bregma_field::{Cancelled, Progress};
use glam::{DAffine3, DQuat, DVec3};
use rayon::prelude::*;

/// What was found.
#[derive(Clone, Debug)]
pub struct Found {
    /// The best.
    pub fit: Fit,
    /// How much of the surfaces lies on the other and faces as it does, the part that agrees more and half of the other's: 1.5 at most.
    pub agreement: f64,
    /// The same of the best of the other poses, and how far that is turned against the best, degrees; none where nothing was searched.
    pub runner_up: Option<(f64, f64)>,
}

/// Less agreement may be chance: of two skulls, or a half and a whole, the right pose had 0.31 and more, and wrong ones 0.25 and less.
pub const LIKELY: f64 = 0.28;

/// Rotations that are tried, about 15° apart, and shifts for each of them.
const ROTATIONS: usize = 1_500;
const SHIFTS: usize = 60;

/// Poses that are refined on the maps, on the surfaces, and that are left at last.
const GOOD: usize = 400;
const BETTER: usize = 40;
const BEST: usize = 5;

/// Poses that differ by less are one, degrees and parts of the size: one may not have come to rest.
const SAME_DEG: f64 = 15.0;
const SAME_PART: f64 = 0.1;

/// Partners may be so far at first, in parts of the size: from where files put the scans, and from where the search does.
const REACH: f64 = 0.3;
const SEARCHED_REACH: f64 = 0.05;

type Judged = (f64, DAffine3);

/// Brings two surfaces with points together: from `start` where that leads to where they agree, else from anywhere.
pub fn from(pair: &Pair<'_>, start: Option<DAffine3>, progress: &Progress) -> Result<Found, Cancelled> {
    let search = Search::of(pair, progress)?;
    if let Some(start) = start {
        let fit = pair.fit(start, REACH * search.radius_mm, progress)?;
        let agreement = search.closely(&fit.pose);
        if agreement >= LIKELY {
            return Ok(Found { fit, agreement, runner_up: None });
        }
    }
    let best = search.best(progress)?;
    let turned_deg = |pose: &DAffine3| turn_between_deg(pose, &best[0].1);
    let runner_up = best.get(1).map(|(agreement, pose)| (*agreement, turned_deg(pose)));
    let fit = pair.fit(best[0].1, SEARCHED_REACH * search.radius_mm, progress)?;
    Ok(Found { agreement: search.closely(&fit.pose), fit, runner_up })
}

/// Two surfaces with their maps.
struct Search<'a> {
    pair: &'a Pair<'a>,
    moving: Coarse<'a>,
    fixed: Coarse<'a>,
    middle: DVec3,
    radius_mm: f64,
    /// A few cells of the maps.
    near_mm: f64,
}

impl<'a> Search<'a> {
    fn of(pair: &'a Pair<'a>, progress: &Progress) -> Result<Self, Cancelled> {
        let (moving, fixed) = (Coarse::of(pair.moving, progress)?, Coarse::of(pair.fixed, progress)?);
        let (middle, radius_mm) = (pair.moving.middle, pair.moving.radius_mm);
        let near_mm = 3.0 * moving.step_mm.max(fixed.step_mm);
        Ok(Self { pair, moving, fixed, middle, radius_mm, near_mm })
    }

    /// How much of both surfaces lies on the other. Each of `count` points counts from 1, where it lies on the other surface and faces as that does,
    /// to 0 at `reach_mm` or square to it. Of a part and a whole, the part counts first.
    fn agreement(&self, pose: &DAffine3, count: usize, reach_mm: f64) -> f64 {
        let one_way = |points: &[Oriented], pose: &DAffine3, map: &Coarse<'_>| {
            let points = &points[..points.len().min(count)];
            let each = points.iter().map(|p| {
                let p = Oriented { point: pose.transform_point3(p.point), normal: pose.transform_vector3(p.normal) };
                let Some(q) = map.at(p.point) else { return 0.0 };
                (1.0 - p.point.distance_squared(q.point) / (reach_mm * reach_mm)).max(0.0) * p.normal.dot(q.normal).max(0.0)
            });
            each.sum::<f64>() / points.len().max(1) as f64
        };
        let forward = one_way(&self.pair.moving.points, pose, &self.fixed);
        let backward = one_way(&self.pair.fixed.points, &pose.inverse(), &self.moving);
        forward.max(backward) + 0.5 * forward.min(backward)
    }

    /// With many points, as near as the maps tell.
    fn closely(&self, pose: &DAffine3) -> f64 {
        self.agreement(pose, 2_000, 0.3 * self.near_mm)
    }

    /// Poses that look best, the best first; at least one.
    fn best(&self, progress: &Progress) -> Result<Vec<Judged>, Cancelled> {
        progress.begin((ROTATIONS + GOOD + BETTER) as u64);
        let rotations: Vec<DQuat> = rotations().collect();
        let tried = rotations.into_par_iter().map(|turn| {
            progress.advance(1)?;
            Ok(self.shifts(turn))
        });
        let tried = best_of(tried.collect::<Result<Vec<_>, _>>()?.concat(), GOOD);
        let refined = tried.par_iter().map(|(_, pose)| {
            progress.advance(1)?;
            let pose = (0..6).fold(*pose, |pose, _| self.nudged(pose));
            Ok((self.agreement(&pose, 600, 0.6 * self.near_mm), pose))
        });
        let refined = self.distinct(best_of(refined.collect::<Result<Vec<_>, _>>()?, GOOD), BETTER);
        let near = refined.par_iter().map(|(_, pose)| {
            progress.advance(1)?;
            let (pose, _) = self.pair.approach(*pose, 0.1 * self.radius_mm, 600, progress)?;
            Ok((self.closely(&pose), pose))
        });
        Ok(self.distinct(best_of(near.collect::<Result<Vec<_>, _>>()?, BETTER), BEST))
    }

    /// The two best poses of a rotation: the middles on each other, and points of one surface on points of the other.
    fn shifts(&self, turn: DQuat) -> Vec<Judged> {
        let (moving, fixed) = (&self.pair.moving.points, &self.pair.fixed.points);
        let shift = |n: usize| {
            if n == 0 {
                return Some(self.pair.fixed.middle - turn * self.middle);
            }
            // Points are in no order; steps by primes spread over them.
            let p = moving[(n * 7919) % moving.len()];
            let mut others = (0..32).map(|m| fixed[(m * 104_729 + n * 31) % fixed.len()]);
            let q = others.find(|q| q.normal.dot(turn * p.normal) > 0.9)?;
            Some(q.point - turn * p.point)
        };
        let poses = (0..SHIFTS).filter_map(shift).map(|shift| DAffine3::from_rotation_translation(turn, shift));
        best_of(poses.map(|pose| (self.agreement(&pose, 60, self.near_mm), pose)).collect(), 2)
    }

    /// A step of point-to-plane on the maps.
    fn nudged(&self, pose: DAffine3) -> DAffine3 {
        const POINTS: usize = 150;
        let reach_mm = 2.0 * self.near_mm;
        let centre = pose.transform_point3(self.middle);
        let back = pose.inverse();
        let of_moving = self.pair.moving.points.iter().take(POINTS).filter_map(|p| {
            let p = p.moved(&pose);
            Some((p, self.fixed.at(p.point)?))
        });
        let of_fixed = self
            .pair
            .fixed
            .points
            .iter()
            .take(POINTS)
            .filter_map(|q| Some((self.moving.at(back.transform_point3(q.point))?.moved(&pose), *q)));
        let mut weights = vec![];
        let rows = of_moving.chain(of_fixed).filter(|(p, q)| p.normal.dot(q.normal) > 0.5).filter_map(|(p, q)| {
            let part = p.point.distance_squared(q.point) / (reach_mm * reach_mm);
            (part < 1.0).then(|| {
                weights.push((1.0 - part).powi(2));
                row(p, q, q.normal, centre, self.radius_mm)
            })
        });
        let rows: Vec<_> = rows.collect();
        solve(&rows, &weights, centre, self.radius_mm).motion.map() * pose
    }

    /// The first of poses in order, each another.
    fn distinct(&self, poses: Vec<Judged>, count: usize) -> Vec<Judged> {
        let mut kept: Vec<Judged> = vec![];
        for (agreement, pose) in poses {
            let same = |(_, other): &Judged| {
                let shift_mm = pose.transform_point3(self.middle).distance(other.transform_point3(self.middle));
                turn_between_deg(&pose, other) < SAME_DEG && shift_mm < SAME_PART * self.radius_mm
            };
            if kept.len() < count && !kept.iter().any(same) {
                kept.push((agreement, pose));
            }
        }
        kept
    }
}

/// Evenly spread rotations: super-Fibonacci spirals (Alexa 2022, CVPR, algorithm 1).
fn rotations() -> impl Iterator<Item = DQuat> {
    // The positive root of ψ⁴ = ψ + 4.
    const PSI: f64 = 1.533_751_168_755_204_3;
    (0..ROTATIONS).map(|n| {
        let s = n as f64 + 0.5;
        let (t, d) = (s / ROTATIONS as f64, std::f64::consts::TAU * s);
        let (alpha, beta) = (d / std::f64::consts::SQRT_2, d / PSI);
        let (r, q) = (t.sqrt(), (1.0 - t).sqrt());
        DQuat::from_xyzw(r * alpha.sin(), r * alpha.cos(), q * beta.sin(), q * beta.cos())
    })
}

fn best_of(mut poses: Vec<Judged>, count: usize) -> Vec<Judged> {
    poses.sort_by(|a, b| b.0.total_cmp(&a.0));
    poses.truncate(count);
    poses
}

fn turn_between_deg(a: &DAffine3, b: &DAffine3) -> f64 {
    turn_deg(a.matrix3 * b.matrix3.transpose())
}
