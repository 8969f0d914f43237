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

/// Rows of one direction, without what a gain and an offset of the values and a shift along all normals explain of them, so that these are solved
/// for unseen (Frisch and Waugh 1933).
fn one_way(compared: &[Compared], centre: DVec3, radius_mm: f64) -> OneWay {
    let column = |number: &dyn Fn(&Compared) -> f64| -> Vec<f64> { compared.iter().map(number).collect() };
    let (own, other) = (column(&|c| c.own), column(&|c| c.other));
    let free = [column(&|_| 1.0), own.clone(), column(&|c| c.outward.length())];
    let mut weights = vec![1.0; compared.len()];
    let mut basis = orthogonal(&free, &weights);
    // Weights by what is left with all, then with what these weigh.
    for _ in 0..2 {
        let left = without(other.clone(), &basis, &weights);
        let (middle, spread) = middle_and_spread(left.iter().copied());
        // Two scans of the same samples leave rounding only.
        let spread = spread.max(1e-9 * own.iter().fold(f64::MIN_POSITIVE, |most, v| most.max(v.abs())));
        weights = left.iter().map(|v| tukey(v - middle, spread)).collect();
        basis = orthogonal(&free, &weights);
    }
    let steepness = product(&free[2], &free[2], &weights) / weights.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    let per_mm = steepness.sqrt().max(f64::MIN_POSITIVE);
    let full = |c: &Compared| {
        let normal = c.outward / per_mm;
        let turn = ((c.at - centre) / radius_mm).cross(normal);
        [turn.x, turn.y, turn.z, normal.x, normal.y, normal.z, c.sign * c.other / per_mm]
    };
    let full: Vec<[f64; 7]> = compared.iter().map(full).collect();
    let left: [Vec<f64>; 7] = std::array::from_fn(|n| without(full.iter().map(|row| row[n]).collect(), &basis, &weights));
    let row = |n: usize| {
        let at = |column: usize| left[column][n];
        Row { row: std::array::from_fn(|column| if column < 6 { at(column) } else { -1.0 }), off_mm: at(6), at: compared[n].at }
    };
    let rows = (0..compared.len()).map(row).collect();
    let correlation = correlation(&own, &other, &weights);
    OneWay { rows, weights, correlation }
}

fn product(a: &[f64], b: &[f64], weights: &[f64]) -> f64 {
    a.iter().zip(b).zip(weights).map(|((a, b), w)| w * a * b).sum()
}

/// Columns, each without what those before it explain.
fn orthogonal(columns: &[Vec<f64>], weights: &[f64]) -> Vec<Vec<f64>> {
    columns.iter().fold(vec![], |mut basis, column| {
        let own = product(column, column, weights);
        let left = without(column.clone(), &basis, weights);
        // What is left of a column that others explain is rounding: a millionth in length.
        if product(&left, &left, weights) > 1e-12 * own {
            basis.push(left);
        }
        basis
    })
}

/// A column without what orthogonal ones explain of it.
fn without(column: Vec<f64>, basis: &[Vec<f64>], weights: &[f64]) -> Vec<f64> {
    basis.iter().fold(column, |mut left, other| {
        let part = product(&left, other, weights) / product(other, other, weights);
        left.iter_mut().zip(other).for_each(|(v, o)| *v -= part * o);
        left
    })
}

fn correlation(own: &[f64], other: &[f64], weights: &[f64]) -> f64 {
    let ones = orthogonal(&[vec![1.0; own.len()]], weights);
    let [x, y] = [own, other].map(|column| without(column.to_vec(), &ones, weights));
    let square = product(&x, &x, weights) * product(&y, &y, weights);
    if square > 0.0 { product(&x, &y, weights) / square.sqrt() } else { 0.0 }
}
