//! How sure a registration is.

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// How sure a pose is: the covariance of the small motion that would put it right, a turn about `centre_mm` (rotation vector, rad) and then a
/// shift (mm), in the world that the scan is moved into.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Covariance {
    /// What it turns about, LPS mm.
    pub centre_mm: DVec3,
    /// By rows: turn about x, y and z, shift along x, y and z; rad², rad·mm, mm².
    pub matrix: [[f64; 6]; 6],
    /// Motions that nothing held, as a ball's turns: how far each may go is not known. Turn (rad) and shift (mm), of which the larger moves the
    /// scan's points by about 1 mm.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub undetermined: Vec<[f64; 6]>,
}

/// What an undetermined motion moves by less than this part of what it moves elsewhere, it does not move: rounding, and the curvature of its path.
const STILL: f64 = 1e-3;

impl Covariance {
    /// The variance of the sum of all aᵢ·vᵢ, mm², where vᵢ is how far the motion moves a point xᵢ: given Σaᵢ and Σxᵢ×aᵢ. Infinite where an
    /// undetermined motion moves them.
    pub fn variance(&self, pull: DVec3, moment_mm: DVec3) -> f64 {
        // a·(ω×(x − c) + τ) = ω·((x − c)×a) + τ·a
        let turn = moment_mm - self.centre_mm.cross(pull);
        let row = [turn.x, turn.y, turn.z, pull.x, pull.y, pull.z];
        let dot = |other: &[f64; 6]| row.iter().zip(other).map(|(a, b)| a * b).sum::<f64>();
        if self.undetermined.iter().any(|motion| dot(motion).abs() > STILL * pull.length().max(1.0)) {
            return f64::INFINITY;
        }
        self.matrix.iter().zip(row).map(|(line, a)| a * dot(line)).sum::<f64>().max(0.0)
    }

    /// The variance of where the point x is along the unit vector `along`, mm².
    pub fn variance_at(&self, point_mm: DVec3, along: DVec3) -> f64 {
        self.variance(along, point_mm.cross(along))
    }

    /// All numbers are some, and no direction has a negative variance.
    pub(super) fn is_sound(&self) -> bool {
        let finite = |row: &[f64; 6]| row.iter().all(|v| v.is_finite());
        let positive = (0..6).all(|n| self.matrix[n][n] >= 0.0);
        let symmetric = (0..6).all(|i| (0..i).all(|j| self.matrix[i][j] == self.matrix[j][i]));
        self.centre_mm.is_finite() && self.matrix.iter().chain(&self.undetermined).all(finite) && positive && symmetric
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_moves_what_is_far_from_its_centre() {
        // Fails if the arm is taken from the wrong point, or turns about one axis move along it.
        let mut matrix = [[0.0; 6]; 6];
        matrix[2][2] = 0.01_f64.powi(2);
        let c = Covariance { centre_mm: DVec3::new(1e3, 0.0, 5.0), matrix, undetermined: vec![] };
        let at = |p: DVec3, along: DVec3| c.variance_at(p, along).sqrt();
        assert!((at(DVec3::new(1100.0, 0.0, -7.0), DVec3::Y) - 1.0).abs() < 1e-12);
        assert!(at(DVec3::new(1100.0, 0.0, 0.0), DVec3::X) < 1e-12 && at(DVec3::new(1100.0, 0.0, 0.0), DVec3::Z) < 1e-12);
        assert!(at(DVec3::new(1e3, 0.0, 300.0), DVec3::Y) < 1e-12);
        // Both ends of a length that are moved alike are not moved against each other.
        assert!(c.variance(DVec3::ZERO, DVec3::ZERO) < 1e-24);
    }

    #[test]
    fn what_nothing_held_is_not_known() {
        // Fails if an undetermined turn gets a number, or its axis does not stay where it is.
        let turn = [0.0, 0.0, 0.01, 0.0, 0.0, 0.0];
        let c = Covariance { centre_mm: DVec3::ZERO, matrix: [[0.0; 6]; 6], undetermined: vec![turn] };
        assert_eq!(c.variance_at(DVec3::X * 100.0, DVec3::Y), f64::INFINITY);
        assert_eq!(c.variance_at(DVec3::X * 100.0, DVec3::X), 0.0);
        assert_eq!(c.variance_at(DVec3::Z * 100.0, DVec3::Y), 0.0);
    }
}
