//! Small rigid motions, and the motion that brings paired points of surfaces together.

use crate::symmetric::{self, Symmetric};
use glam::{DAffine3, DMat3, DQuat, DVec3};

/// A rotation (vector, rad) about a centre, then a shift (mm).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// What it turns about.
    pub centre: DVec3,
    /// Axis times angle.
    pub turn_rad: DVec3,
    /// Shift.
    pub shift_mm: DVec3,
}

impl Motion {
    /// As a map.
    pub fn map(&self) -> DAffine3 {
        let turn = DQuat::from_scaled_axis(self.turn_rad);
        DAffine3::from_rotation_translation(turn, self.centre + self.shift_mm - turn * self.centre)
    }

    /// As far as it moves a point at `radius_mm` from its centre, at most.
    pub fn reach_mm(&self, radius_mm: f64) -> f64 {
        self.turn_rad.length() * radius_mm + self.shift_mm.length()
    }
}

/// By how much a rotation turns, degrees: its trace is 1 + 2 cos.
pub fn turn_deg(turn: DMat3) -> f64 {
    ((turn.x_axis.x + turn.y_axis.y + turn.z_axis.z - 1.0) / 2.0).clamp(-1.0, 1.0).acos().to_degrees()
}

/// Two partners of a moving and a fixed surface: how far the moving one stands out over the other along a normal, and how that changes with
/// (turn·radius, shift, the offset that is subtracted).
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// The change of `off_mm` by each.
    pub row: [f64; 7],
    /// How far it stands out, mm.
    pub off_mm: f64,
    /// Where, on the fixed surface.
    pub at: DVec3,
}

/// What least squares make of rows.
#[derive(Clone, Copy, Debug)]
pub struct Solution {
    /// The motion.
    pub motion: Motion,
    /// How far the moving surface stands out over the fixed one everywhere, mm.
    pub offset_mm: f64,
    /// The rows' weighted normal matrix.
    pub normal: Symmetric<7>,
}

/// Least squares over weighted rows. Motions that the rows do not determine are not made.
pub fn solve(rows: &[Row], weights: &[f64], centre: DVec3, radius_mm: f64) -> Solution {
    let (mut normal, mut right) = ([[0.0; 7]; 7], [0.0; 7]);
    for (row, weight) in rows.iter().zip(weights).filter(|(_, w)| **w > 0.0) {
        symmetric::add_outer(&mut normal, &row.row, *weight);
        (0..7).for_each(|i| right[i] -= weight * row.row[i] * row.off_mm);
    }
    let trace: f64 = (0..7).map(|i| normal[i][i]).sum();
    let x = symmetric::times(&symmetric::inverse(&normal, FLAT * trace), &right);
    let motion = Motion { centre, turn_rad: DVec3::new(x[0], x[1], x[2]) / radius_mm, shift_mm: DVec3::new(x[3], x[4], x[5]) };
    Solution { motion, offset_mm: x[6], normal }
}

/// A motion whose rows are less than this part of all has nothing to hold it: a thousandth in length.
pub const FLAT: f64 = 1e-6;

/// The middle of numbers, and their spread about it as a standard deviation (1.4826 times the median deviation, as of a normal distribution).
pub fn middle_and_spread(numbers: impl Iterator<Item = f64>) -> (f64, f64) {
    let mut all: Vec<f64> = numbers.collect();
    let median = |all: &mut [f64]| {
        let half = all.len() / 2;
        if all.is_empty() { 0.0 } else { *all.select_nth_unstable_by(half, f64::total_cmp).1 }
    };
    let middle = median(&mut all);
    all.iter_mut().for_each(|n| *n = (*n - middle).abs());
    (middle, 1.4826 * median(&mut all))
}

/// Beyond so many standard deviations nothing counts: 95 % of the efficiency of least squares is kept.
pub const TUKEY: f64 = 4.685;

/// Tukey's biweight (Beaton and Tukey 1974).
pub fn tukey(off: f64, spread: f64) -> f64 {
    let part = off / (TUKEY * spread);
    (1.0 - part * part).max(0.0).powi(2)
}
