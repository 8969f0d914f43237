//! Two scans of one object brought together by their values around its surface: normalised cross-correlation, by Gauss and Newton on the
//! interpolant's own gradient (Evangelidis and Psarakis 2008, IEEE PAMI 30, 1858–1865, in space, and in both directions).
//!
//! Samples of each scan, at places around its surface, are compared with what the other has there. Gain and offset that fit best are free, for each
//! direction, so that another kernel, threshold or scale of values moves nothing; what still stands out counts less by Tukey's weights, so that a
//! moved jaw pulls at nothing.
//!
//! ```text
//!   value                 ● what this scan has      off = (● − gain·○ − offset)/rise: mm that the moving scan stands out
//!     │  ●──○──╮          ○ what the other has
//!     │        ╰●─○──
//!     └──────────────── along the normal
//! ```
//! Unlike mutual information it takes values of one scan to rise with those of the other: all CT's do, whatever their kernel, window or unit.

use crate::cloud::{Cloud, Oriented};
use crate::motion::{Row, middle_and_spread, solve, tukey};
use crate::surfaces::{Fit, Pair};
use bregma_field::interpolant::depth_at;
use bregma_field::{Cancelled, Progress, WorldPoint};
use glam::{DAffine3, DVec3};
use rayon::prelude::*;

/// How two scans' values lie on each other.
#[derive(Clone, Debug)]
pub struct Alike {
    /// The pose, with what is left as a distance along the gradient.
    pub fit: Fit,
    /// Correlation of the values that count, −1 to 1: the mean of both directions.
    pub correlation: f64,
}

/// Samples in each direction; twice as many change the pose by less than the blur of another grid does.
const SAMPLES: usize = 20_000;

/// Samples lie so far inside and outside of the surface, at most, in voxels of the coarser scan: as far as an edge's blur reaches.
const AROUND: f64 = 1.5;

/// Each step leaves a tenth of what was off, or less; where surfaces led, four or five are enough.
const MOST_STEPS: usize = 30;

/// A place around a scan's own surface, in its own world, and its value.
#[derive(Clone, Copy, Debug)]
struct Sample {
    place: DVec3,
    value: f64,
}

/// A sample, moved into the fixed scan's world, against the other scan.
#[derive(Clone, Copy, Debug)]
struct Compared {
    at: DVec3,
    own: f64,
    other: f64,
    /// Outward, as the moving scan's surface stands out over the fixed one, values per mm.
    outward: DVec3,
    /// 1 where the other is the moving scan, −1 where it is the fixed one.
    sign: f64,
}

/// Brings two scans together by their values, from a pose that is off by about a voxel at most, as surfaces leave it.
pub fn refine(pair: &Pair<'_>, start: DAffine3, progress: &Progress) -> Result<Alike, Cancelled> {
    let voxel_mm = pair.voxel_mm();
    let samples = [around(pair.moving, voxel_mm), around(pair.fixed, voxel_mm)];
    let mut alike = step(pair, &samples, start);
    for _ in 0..MOST_STEPS {
        progress.advance(0)?;
        // A tenth of what the best registrations are good to.
        if alike.fit.next.motion.reach_mm(alike.fit.radius_mm) < 1e-3 * voxel_mm {
            break;
        }
        alike = step(pair, &samples, alike.fit.next.motion.map() * alike.fit.pose);
    }
    Ok(alike)
}

fn around(cloud: &Cloud<'_>, voxel_mm: f64) -> Vec<Sample> {
    // Multiples of the golden section lie evenly between 0 and 1, however many there are.
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let at = |(n, p): (usize, &Oriented)| {
        let place = p.point + AROUND * voxel_mm * (2.0 * (n as f64 * GOLDEN).fract() - 1.0) * p.normal;
        Some(Sample { place, value: depth_at(cloud.surface, WorldPoint(place))?.0 })
    };
    let points = &cloud.points[..cloud.points.len().min(SAMPLES)];
    points.par_iter().enumerate().filter_map(at).collect()
}

/// What is left in a pose, and the motion that it asks for.
fn step(pair: &Pair<'_>, samples: &[Vec<Sample>; 2], pose: DAffine3) -> Alike {
    let radius_mm = pair.moving.radius_mm;
    let centre = pose.transform_point3(pair.moving.middle);
    let back = pose.inverse();
    let forward = |s: &Sample| {
        pair.parts.hold(s.place).then_some(())?;
        let (other, rise) = depth_at(pair.moving.surface, WorldPoint(back.transform_point3(s.place)))?;
        Some(Compared { at: s.place, own: s.value, other, outward: -pose.transform_vector3(rise), sign: 1.0 })
    };
    let backward = |s: &Sample| {
        let at = pose.transform_point3(s.place);
        pair.parts.hold(at).then_some(())?;
        let (other, rise) = depth_at(pair.fixed.surface, WorldPoint(at))?;
        Some(Compared { at, own: s.value, other, outward: -rise, sign: -1.0 })
    };
    let of_fixed: Vec<Compared> = samples[1].par_iter().filter_map(forward).collect();
    let of_moving: Vec<Compared> = samples[0].par_iter().filter_map(backward).collect();
    let (mut rows, mut weights, mut correlation) = (vec![], vec![], 0.0);
    for compared in [&of_fixed, &of_moving] {
        let one_way = one_way(compared, centre, radius_mm);
        correlation += 0.5 * one_way.correlation;
        rows.extend(one_way.rows);
        weights.extend(one_way.weights);
    }
    let (_, spread_mm) = middle_and_spread(rows.iter().map(|r| r.off_mm));
    let next = solve(&rows, &weights, centre, radius_mm);
    let asked = samples.iter().map(Vec::len).sum();
    Alike { fit: Fit { pose, rows, weights, spread_mm, asked, next, centre, radius_mm }, correlation }
}

struct OneWay {
    rows: Vec<Row>,
    weights: Vec<f64>,
    correlation: f64,
}

/// Rows of one direction, without what a gain and an offset of the values explain of them, so that these are solved for unseen (Frisch and
/// Waugh 1933).
fn one_way(compared: &[Compared], centre: DVec3, radius_mm: f64) -> OneWay {
    let mut weights = vec![1.0; compared.len()];
    let residuals = |line: [f64; 2]| compared.iter().map(move |c| c.other - line[0] - line[1] * c.own);
    // Weights by the line through all, then by the line that these weigh.
    for _ in 0..2 {
        let line = fitted(compared, &weights, |c| c.other);
        let (middle, spread) = middle_and_spread(residuals(line));
        // Two scans of the same samples leave rounding only.
        let spread = spread.max(1e-9 * compared.iter().map(|c| c.own.abs()).fold(f64::MIN_POSITIVE, f64::max));
        weights = residuals(line).map(|r| tukey(r - middle, spread)).collect();
    }
    let total = weights.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    let square = compared.iter().zip(&weights).map(|(c, w)| w * c.outward.length_squared()).sum::<f64>();
    let rise = (square / total).sqrt().max(f64::MIN_POSITIVE);
    let full = |c: &Compared| {
        let normal = c.outward / rise;
        let turn = ((c.at - centre) / radius_mm).cross(normal);
        [turn.x, turn.y, turn.z, normal.x, normal.y, normal.z, c.sign * c.other / rise]
    };
    let lines: [[f64; 2]; 7] = std::array::from_fn(|n| fitted(compared, &weights, |c| full(c)[n]));
    let row = |c: &Compared| {
        let left = full(c);
        let left: [f64; 7] = std::array::from_fn(|n| left[n] - lines[n][0] - lines[n][1] * c.own);
        let [a, b, c0, d, e, f, off_mm] = left;
        Row { row: [a, b, c0, d, e, f, -1.0], off_mm, at: c.at }
    };
    let correlation = correlation(compared, &weights);
    OneWay { rows: compared.iter().map(row).collect(), weights, correlation }
}

/// The line of weighted least squares through numbers over the samples' own values: where it begins, and how it rises.
fn fitted(compared: &[Compared], weights: &[f64], number: impl Fn(&Compared) -> f64) -> [f64; 2] {
    let mut sums = [0.0; 5];
    for (c, w) in compared.iter().zip(weights).filter(|(_, w)| **w > 0.0) {
        let (x, y) = (c.own, number(c));
        sums.iter_mut().zip([1.0, x, y, x * x, x * y]).for_each(|(sum, v)| *sum += w * v);
    }
    let [one, x, y, xx, xy] = sums;
    let spread = one * xx - x * x;
    // Values that are all the same have no slope: beyond rounding of the sums.
    let slope = if spread > 1e-12 * one * xx { (one * xy - x * y) / spread } else { 0.0 };
    [if one > 0.0 { (y - slope * x) / one } else { 0.0 }, slope]
}

fn correlation(compared: &[Compared], weights: &[f64]) -> f64 {
    let [_, slope] = fitted(compared, weights, |c| c.other);
    let swapped: Vec<Compared> = compared.iter().map(|c| Compared { own: c.other, other: c.own, ..*c }).collect();
    let [_, back] = fitted(&swapped, weights, |c| c.other);
    (slope * back).max(0.0).sqrt().copysign(slope)
}
