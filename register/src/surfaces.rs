//! Two surfaces brought together: robust, symmetric point-to-plane (Chen and Medioni 1992, with the weights of Tukey).
//!
//! Points of each surface look for partners on the other that face the same way. Both directions stand in one system of equations, so that the
//! answer does not depend on which scan is first. One offset along all normals is estimated with the pose: unlike thresholds, or one skull's
//! thicker bone, move no pose.
//!
//! ```text
//!      p ●        off = n·(p − q)      far: q is the nearest point that faces as p does
//!        │ n                           near: q is where the line through p along its normal meets the interpolant's surface
//!   ─────● q ─────
//! ```

use crate::cloud::{Cloud, Oriented};
use crate::motion::{Row, Solution, TUKEY, middle_and_spread, solve, tukey};
use crate::part::Parts;
use bregma_field::{Cancelled, Progress};
use glam::{DAffine3, DVec3};
use rayon::prelude::*;

/// Two surfaces to be brought together.
#[derive(Debug)]
pub struct Pair<'a> {
    /// The scan that is moved.
    pub moving: &'a Cloud<'a>,
    /// The scan that stays.
    pub fixed: &'a Cloud<'a>,
    /// What of the fixed scan's world counts.
    pub parts: &'a Parts,
}

/// How two surfaces lie in a pose.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Moves the moving scan onto the fixed one.
    pub pose: DAffine3,
    /// What is left between partners along normals, in both directions.
    pub rows: Vec<Row>,
    /// Weights of the rows.
    pub weights: Vec<f64>,
    /// Spread of what is left, mm.
    pub spread_mm: f64,
    /// Points that looked for partners.
    pub asked: usize,
    /// The step from here.
    pub next: Solution,
    /// About what the step turns: the middle of what is moved.
    pub centre: DVec3,
    /// Root mean square distance of what is moved from there, mm.
    pub radius_mm: f64,
}

impl Fit {
    /// Median distance along normals of partners that count from the middle of all of them, mm.
    pub fn median_mm(&self) -> f64 {
        let counted = || self.rows.iter().zip(&self.weights).filter(|(_, w)| **w > 0.0).map(|(row, _)| row.off_mm);
        let (middle_mm, _) = middle_and_spread(counted());
        middle_and_spread(counted().map(|mm| (mm - middle_mm).abs())).0
    }

    /// The pose that would be found if each moving point lay farther out along its partner's normal by what `outward_mm` says of it and its
    /// partner. A few partners say it for all.
    pub fn if_moved(&self, outward_mm: impl Fn(Oriented, Oriented) -> f64 + Sync) -> DAffine3 {
        let step = self.rows.len() / FEW + 1;
        let (rows, weights): (Vec<Row>, Vec<f64>) = (0..self.rows.len())
            .into_par_iter()
            .step_by(step)
            .filter(|n| self.weights[*n] > 0.0)
            .map(|n| {
                let row = self.rows[n];
                let fixed = Oriented { point: row.at, normal: DVec3::from_slice(&row.row[3..6]) };
                let moving = Oriented { point: row.at + row.off_mm * fixed.normal, ..fixed };
                (Row { off_mm: outward_mm(moving, fixed), ..row }, self.weights[n])
            })
            .unzip();
        solve(&rows, &weights, self.centre, self.radius_mm).motion.map() * self.pose
    }

    /// The share of the points that have a partner which counts.
    pub fn matched(&self) -> f64 {
        self.weights.iter().filter(|w| **w > 0.0).count() as f64 / self.asked.max(1) as f64
    }
}

/// How partners are looked for.
#[derive(Clone, Copy, Debug)]
struct Search {
    reach_mm: f64,
    /// Of normals.
    cosine: f64,
    /// Points in each direction.
    count: usize,
}

/// Points in each direction while the pose is far off, and when it is near. More do not bring it nearer: what is left is not noise.
const FEW: usize = 1_500;
const MANY: usize = 20_000;

/// Normals of partners agree to 60° while the pose may be turned, and to 37° then: sides of a fold that has another form are no partners.
const FAR_COSINE: f64 = 0.5;
const NEAR_COSINE: f64 = 0.8;

/// Steps until partners stay the same; from 15° and a fifth of the size off it takes ten to thirty.
const MOST_STEPS: usize = 60;

impl Pair<'_> {
    /// The coarser scan's mean step between samples, mm.
    pub fn voxel_mm(&self) -> f64 {
        self.moving.voxel_mm.max(self.fixed.voxel_mm)
    }

    /// Brings them together from a pose that is near enough: partners are looked for within `reach_mm` at first.
    pub fn fit(&self, start: DAffine3, reach_mm: f64, progress: &Progress) -> Result<Fit, Cancelled> {
        let (pose, reach_mm) = self.approach(start, reach_mm, FEW, progress)?;
        self.settle(pose, reach_mm, progress)
    }

    /// The first part of [`fit`](Self::fit), with few points: the pose, and how far partners are then.
    pub fn approach(&self, start: DAffine3, reach_mm: f64, count: usize, progress: &Progress) -> Result<(DAffine3, f64), Cancelled> {
        let voxel_mm = self.voxel_mm();
        let (mut pose, mut reach_mm) = (start, reach_mm.max(3.0 * voxel_mm));
        for _ in 0..MOST_STEPS {
            progress.advance(0)?;
            let fit = self.step(pose, Search { reach_mm, cosine: FAR_COSINE, count });
            pose = fit.next.motion.map() * pose;
            let tighter_mm = (TUKEY * fit.spread_mm).max(3.0 * voxel_mm).min(reach_mm);
            // A twentieth of a voxel is less than what so few points can tell.
            if fit.next.motion.reach_mm(fit.radius_mm) < 0.05 * voxel_mm && tighter_mm > 0.9 * reach_mm {
                break;
            }
            reach_mm = tighter_mm;
        }
        Ok((pose, reach_mm))
    }

    /// The second part: with many points, to rest.
    fn settle(&self, mut pose: DAffine3, mut reach_mm: f64, progress: &Progress) -> Result<Fit, Cancelled> {
        let voxel_mm = self.voxel_mm();
        for _ in 0..MOST_STEPS {
            progress.advance(0)?;
            let fit = self.step(pose, Search { reach_mm, cosine: NEAR_COSINE, count: MANY });
            // A tenth of what the best registrations are good to.
            if fit.next.motion.reach_mm(fit.radius_mm) < 1e-3 * voxel_mm {
                return Ok(fit);
            }
            pose = fit.next.motion.map() * pose;
            reach_mm = (TUKEY * fit.spread_mm).max(2.0 * voxel_mm).min(reach_mm);
        }
        Ok(self.step(pose, Search { reach_mm, cosine: NEAR_COSINE, count: MANY }))
    }

    /// Partners in a pose, their weights, and the motion that they ask for.
    fn step(&self, pose: DAffine3, search: Search) -> Fit {
        let radius_mm = self.moving.radius_mm;
        let centre = pose.transform_point3(self.moving.middle);
        let back = pose.inverse();
        let forward = |p: &Oriented| {
            let p = p.moved(&pose);
            let q = self.parts.hold(p.point).then(|| self.partner(self.fixed, p, search))??;
            Some(row(p, q, q.normal, centre, radius_mm))
        };
        let backward = |p: &Oriented| {
            let q = self.parts.hold(p.point).then(|| self.partner(self.moving, p.moved(&back), search))??.moved(&pose);
            Some(row(q, *p, q.normal, centre, radius_mm))
        };
        let some = |cloud: &Cloud<'_>| cloud.points.len().min(search.count);
        let (of_moving, of_fixed) = (some(self.moving), some(self.fixed));
        let mut rows: Vec<Row> = self.moving.points[..of_moving].par_iter().filter_map(forward).collect();
        rows.extend(self.fixed.points[..of_fixed].par_iter().filter_map(backward).collect::<Vec<_>>());
        let (middle_mm, spread_mm) = middle_and_spread(rows.iter().map(|r| r.off_mm));
        // Two scans of the same samples leave rounding only: a thousandth of a voxel is nothing.
        let spread_mm = spread_mm.max(1e-3 * self.voxel_mm());
        let weights: Vec<f64> = rows.iter().map(|r| tukey(r.off_mm - middle_mm, spread_mm)).collect();
        let next = solve(&rows, &weights, centre, radius_mm);
        Fit { pose, rows, weights, spread_mm, asked: of_moving + of_fixed, next, centre, radius_mm }
    }

    fn partner(&self, on: &Cloud<'_>, of: Oriented, search: Search) -> Option<Oriented> {
        let near_mm = self.voxel_mm().min(search.reach_mm);
        on.root(of, near_mm, search.cosine).or_else(|| on.nearest(of, search.reach_mm, search.cosine))
    }
}

/// How far the moving surface stands out over the fixed one at a pair of partners along a normal, and how a motion about `centre` changes that.
pub fn row(of_moving: Oriented, of_fixed: Oriented, normal: DVec3, centre: DVec3, radius_mm: f64) -> Row {
    let turn = ((of_moving.point - centre) / radius_mm).cross(normal);
    let off_mm = normal.dot(of_moving.point - of_fixed.point);
    Row { row: [turn.x, turn.y, turn.z, normal.x, normal.y, normal.z, -1.0], off_mm, at: of_fixed.point }
}
