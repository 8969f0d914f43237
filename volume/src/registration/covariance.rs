//! How sure a registration is.

use glam::{DAffine3, DMat3, DVec3};
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

/// A motion whose axes are of length 1 and at right angles to this is rigid: files state matrices to six digits or more.
const RIGID: f64 = 1e-5;

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

    /// Of one motion after another that is sure by `other`, in one world: each errs by itself.
    pub fn and(&self, other: &Self) -> Self {
        // The other's turns about this centre: τ + ω × d.
        let d = self.centre_mm - other.centre_mm;
        let about = |v: &[f64; 6]| {
            let shift = DVec3::from_slice(&v[3..]) + DVec3::from_slice(&v[..3]).cross(d);
            [v[0], v[1], v[2], shift.x, shift.y, shift.z]
        };
        let rows = other.matrix.map(|row| about(&row));
        let columns: [[f64; 6]; 6] = std::array::from_fn(|n| about(&std::array::from_fn(|m| rows[m][n])));
        let mut matrix = self.matrix;
        for i in 0..6 {
            for j in 0..=i {
                // Rounding differs above and below the diagonal.
                matrix[i][j] += 0.5 * (columns[j][i] + columns[i][j]);
                matrix[j][i] = matrix[i][j];
            }
        }
        let undetermined = self.undetermined.iter().copied().chain(other.undetermined.iter().map(about)).collect();
        Self { centre_mm: self.centre_mm, matrix, undetermined }
    }

    /// The same where all of that world is moved by `motion`; none where that is not rigid, as a turn would then be none any more.
    pub fn moved(&self, motion: &DAffine3) -> Option<Self> {
        let turn = motion.matrix3;
        let off = turn.transpose() * turn - DMat3::IDENTITY;
        if off.to_cols_array().iter().any(|v| v.abs() > RIGID) {
            return None;
        }
        // A mirror image turns a turn's axis, and then the turn itself.
        let parts = [turn * turn.determinant(), turn];
        let row = |n: usize| parts[n / 3].row(n % 3);
        let mut matrix = [[0.0; 6]; 6];
        for i in 0..6 {
            for j in 0..=i {
                let (a, b) = (row(i), row(j));
                let pair = |m: usize, n: usize| a[m] * self.matrix[i / 3 * 3 + m][j / 3 * 3 + n] * b[n];
                matrix[i][j] = (0..3).map(|m| (0..3).map(|n| pair(m, n)).sum::<f64>()).sum();
                matrix[j][i] = matrix[i][j];
            }
        }
        let moved = |v: &[f64; 6]| std::array::from_fn(|n| row(n).dot(DVec3::from_slice(&v[n / 3 * 3..n / 3 * 3 + 3])));
        let undetermined = self.undetermined.iter().map(moved).collect();
        Some(Self { centre_mm: motion.transform_point3(self.centre_mm), matrix, undetermined })
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
    fn it_goes_along_with_the_world_that_it_is_in() {
        // Fails if the centre, a block of the matrix or what nothing held stays behind, also in a mirror image; or if a stretched world gets one.
        let mut matrix = [[0.0; 6]; 6];
        for i in 0..6 {
            for j in 0..6 {
                matrix[i][j] =
                    (0..6).map(|n| (((i * 7 + n * 3) % 5) as f64 - 2.0) * (((j * 7 + n * 3) % 5) as f64 - 2.0)).sum::<f64>() * 1e-3;
            }
        }
        let c = Covariance { centre_mm: DVec3::new(10.0, -20.0, 30.0), matrix, undetermined: vec![] };
        let held = Covariance { matrix: [[0.0; 6]; 6], undetermined: vec![[0.0, 0.0, 0.01, 0.0, 0.0, 0.0]], ..c.clone() };
        let turn = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.9);
        for linear in [turn, turn * DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0))] {
            let motion = DAffine3::from_mat3_translation(linear, DVec3::new(5.0, 6.0, -70.0));
            let (moved, held_moved) = (c.moved(&motion).unwrap(), held.moved(&motion).unwrap());
            assert!(moved.is_sound());
            for (point, along) in [(DVec3::new(80.0, 3.0, -9.0), DVec3::X), (DVec3::new(-7.0, 60.0, 55.0), DVec3::new(0.6, 0.0, 0.8))] {
                let (there, to) = (motion.transform_point3(point), linear * along);
                let [before, after] = [c.variance_at(point, along), moved.variance_at(there, to)];
                assert!(before > 0.0 && (before - after).abs() < 1e-12 * before.max(1.0), "{before} {after}");
                assert_eq!(held.variance_at(point, along), held_moved.variance_at(there, to));
            }
            // Along its axis a turn moves nothing.
            assert_eq!(held_moved.variance_at(motion.transform_point3(DVec3::new(80.0, 3.0, -9.0)), linear * DVec3::Z), 0.0);
        }
        assert_eq!(c.moved(&DAffine3::from_scale(DVec3::new(1.0, 1.0, 1.1))), None);
    }

    #[test]
    fn of_two_motions_both_count() {
        // Fails if the second's turns are taken about the first's centre as they are, or a motion that it left undetermined is forgotten.
        let of = |seed: usize, centre_mm: DVec3| {
            let factor = |i: usize, n: usize| (((i * 7 + n * (3 + seed)) % 5) as f64 - 2.0) * 0.03;
            let entry = |i: usize, j: usize| (0..6).map(|n| factor(i, n) * factor(j, n)).sum::<f64>();
            let matrix = std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)));
            Covariance { centre_mm, matrix, undetermined: vec![] }
        };
        let (a, b) = (of(0, DVec3::new(10.0, -20.0, 30.0)), of(1, DVec3::new(-70.0, 5.0, 0.0)));
        let both = a.and(&b);
        assert!(both.is_sound());
        for (point, along) in [(DVec3::new(80.0, 3.0, -9.0), DVec3::X), (DVec3::new(-7.0, 60.0, 55.0), DVec3::new(0.6, 0.0, 0.8))] {
            let sum = a.variance_at(point, along) + b.variance_at(point, along);
            assert!(sum > 0.0 && (both.variance_at(point, along) - sum).abs() < 1e-12 * sum);
        }
        let open = Covariance { matrix: [[0.0; 6]; 6], undetermined: vec![[0.0, 0.0, 0.01, 0.0, 0.0, 0.0]], ..b.clone() };
        let at_axis = b.centre_mm + DVec3::Z * 40.0;
        let both = a.and(&open);
        assert_eq!(both.variance_at(at_axis + DVec3::X, DVec3::Y), f64::INFINITY);
        assert!(both.variance_at(at_axis, DVec3::Y).is_finite());
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
