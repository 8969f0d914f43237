//! How sure a fit of surfaces is, as a covariance of its pose.
//!
//! What is left between partners is no noise that is independent from point to point. Blur, thresholds and form move whole sides of bones: what faces
//! one way in one part of the skull moves together. So points that lie in one block of space and face one way count as one (the sandwich of Huber
//! 1967 and White 1980 by clusters: Liang and Zeger 1986, Biometrika 73, 13–22). Clusters by place alone see a third of it: in each, what moves two
//! opposite sides cancels.

use crate::motion::{Motion, Row, solve};
use crate::surfaces::Fit;
use crate::symmetric::{self, Symmetric};
use bregma_field::Covariance;
use glam::DVec3;
use std::collections::BTreeMap;

/// The side of a block, in parts of the size of what is moved; blocks begin at its middle. On rescans of a skull with another threshold, blur and
/// crop, intervals of larger blocks hold the truth too often, of smaller ones too seldom (docs/registration.md).
const BLOCK: f64 = 0.85;

/// A motion that changes partners by less than this part of what it moves them, squared, is held by nothing: normals of a noisy ball, which no turn
/// changes, are off by a few degrees.
const HELD: f64 = 0.004;

/// The covariance of the pose of a fit of surfaces that has come to rest.
pub fn covariance(fit: &Fit) -> Covariance {
    of_motions(fit, |held| sandwich(fit, held, BLOCK * fit.radius_mm))
}

/// The same of a fit of values: with what parts of space, left out in turn, move it. In values blur does not move sides of bones but whole regions
/// against each other, which blocks that face one way see half of (docs/registration.md).
pub fn of_values(fit: &Fit) -> Covariance {
    of_motions(fit, |held| {
        let (blocks, octants) = (sandwich(fit, held, BLOCK * fit.radius_mm), without_octants(fit));
        std::array::from_fn(|i| std::array::from_fn(|j| blocks[i][j] + octants[i][j]))
    })
}

fn of_motions(fit: &Fit, spread: impl Fn(&Symmetric<6>) -> Symmetric<6>) -> Covariance {
    let radius_mm = fit.radius_mm;
    let (held, open) = held(fit);
    let found = spread(&held);
    // From turns in mm at the radius to radians.
    let per = |n: usize| if n < 3 { 1.0 / radius_mm } else { 1.0 };
    let matrix = std::array::from_fn(|i| std::array::from_fn(|j| 0.5 * (found[i][j] + found[j][i]) * per(i) * per(j)));
    let undetermined = open.into_iter().map(|motion| std::array::from_fn(|n| motion[n] * per(n))).collect();
    Covariance { centre_mm: fit.centre, matrix, undetermined }
}

/// The inverse of the normal matrix of the pose, with what the offset takes from it, on the motions that are held; and the other motions.
fn held(fit: &Fit) -> (Symmetric<6>, Vec<[f64; 6]>) {
    let normal = &fit.next.normal;
    let total = normal[6][6];
    if total <= 0.0 {
        let all = std::array::from_fn::<_, 6, _>(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
        return ([[0.0; 6]; 6], all.to_vec());
    }
    let own: Symmetric<6> = std::array::from_fn(|i| std::array::from_fn(|j| normal[i][j] - normal[i][6] * normal[j][6] / total));
    let (values, vectors) = symmetric::eigen(&own);
    let mut inverse = [[0.0; 6]; 6];
    let mut open = vec![];
    for (value, vector) in values.iter().zip(vectors) {
        if *value > HELD * total {
            symmetric::add_outer(&mut inverse, &vector, 1.0 / value);
        } else {
            open.push(vector);
        }
    }
    (inverse, open)
}

fn sandwich(fit: &Fit, inverse: &Symmetric<6>, side_mm: f64) -> Symmetric<6> {
    let normal = &fit.next.normal;
    let mut blocks: BTreeMap<([i32; 3], usize), [f64; 6]> = BTreeMap::new();
    for (row, weight) in fit.rows.iter().zip(&fit.weights).filter(|(_, w)| **w > 0.0) {
        let block = ((row.at - fit.centre) / side_mm).floor().as_ivec3().to_array();
        let left = row.off_mm - fit.next.offset_mm;
        let pull = blocks.entry((block, facing(DVec3::from_slice(&row.row[3..6])))).or_default();
        // The row without what the offset explains of it.
        (0..6).for_each(|n| pull[n] += weight * left * (row.row[n] + normal[n][6] / normal[6][6]));
    }
    let mut middle = [[0.0; 6]; 6];
    blocks.values().for_each(|pull| symmetric::add_outer(&mut middle, pull, 1.0));
    let count = blocks.len().max(2) as f64;
    let times = |a: &Symmetric<6>, b: &Symmetric<6>| -> Symmetric<6> {
        std::array::from_fn(|i| std::array::from_fn(|j| (0..6).map(|k| a[i][k] * b[k][j]).sum()))
    };
    times(&times(inverse, &middle), inverse).map(|row| row.map(|v| v * count / (count - 1.0)))
}

/// How far the pose spreads where each of the eight octants about the middle is left out in turn (the jackknife: Efron and Stein
/// 1981, Ann. Statist. 9, 586–596).
fn without_octants(fit: &Fit) -> Symmetric<6> {
    const OCTANTS: u32 = 8;
    let moved: Vec<[f64; 6]> = (0..OCTANTS)
        .map(|octant| {
            let stays = |row: &Row| (row.at - fit.centre).cmpge(DVec3::ZERO).bitmask() != octant;
            let weights: Vec<f64> = fit.rows.iter().zip(&fit.weights).map(|(row, w)| if stays(row) { *w } else { 0.0 }).collect();
            let Motion { turn_rad, shift_mm, .. } = solve(&fit.rows, &weights, fit.centre, fit.radius_mm).motion;
            let turn_mm = turn_rad * fit.radius_mm;
            [turn_mm.x, turn_mm.y, turn_mm.z, shift_mm.x, shift_mm.y, shift_mm.z]
        })
        .collect();
    let count = f64::from(OCTANTS);
    let middle: [f64; 6] = std::array::from_fn(|n| moved.iter().map(|motion| motion[n]).sum::<f64>() / count);
    let mut spread = [[0.0; 6]; 6];
    for motion in &moved {
        symmetric::add_outer(&mut spread, &std::array::from_fn(|n| motion[n] - middle[n]), (count - 1.0) / count);
    }
    spread
}

/// Which of the six ways along the axes a normal is nearest to.
fn facing(normal: DVec3) -> usize {
    let axis = if normal.x.abs() >= normal.abs().max_element() { 0 } else { 1 + usize::from(normal.z.abs() > normal.y.abs()) };
    2 * axis + usize::from(normal[axis] < 0.0)
}
