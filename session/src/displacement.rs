//! A part of a skull that moved as a whole, as a jaw does or a tooth: the rigid motion that lays it onto the other scan's.

use bregma_field::{Cancelled, Covariance, Progress, Surface};
use bregma_measure::IN_95_OF_100;
use bregma_measure::difference::end_at;
use bregma_measure::numbers::{fixed, signed};
use bregma_register::cloud::{Cloud, LEAST_POINTS, Oriented, POINTS};
use bregma_register::surfaces::Pair;
use bregma_register::{Part, Parts, sureness};
use glam::{DAffine3, DQuat, DVec3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Why a part's motion is not known.
#[derive(Debug, Error)]
pub enum PartError {
    /// A displacement of everything.
    #[error("a displacement is that of a part that moved as a whole, and no part is named: say which, as a ball or a box around it")]
    NoPart,
    /// A part that the other scan has not.
    #[error(
        "the part was not found on the other scan within {reach_mm} mm; choose a longer reach, another part of the surface or other isovalues"
    )]
    NotFound {
        /// As far as was looked.
        reach_mm: f64,
    },
    /// Stopped by request.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// How a part moved, from where the scans lie on each other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Moved {
    /// Lays the first scan's part onto the second's, in the world.
    pub motion: DAffine3,
    /// The same if blur, which moves curved and thin bone inward, moved neither: no better known, but it says how far blur may have led astray.
    pub without_blur: DAffine3,
    /// How sure the motion is beside that.
    pub covariance: Covariance,
    /// The middle of the part's surface, LPS mm.
    pub middle_mm: DVec3,
    /// How far the middle moved.
    pub shift_mm: DVec3,
    /// Half the width of the interval that holds it in 95 of 100 cases, along x, y and z.
    pub shift_error_mm: DVec3,
    /// By how much it turned.
    pub turn_deg: f64,
    /// About what, a unit vector.
    pub turn_axis: DVec3,
    /// Median distance that is left along normals where the part lies on the other's.
    pub left_mm: f64,
}

/// One of the two scans where it is put.
#[derive(Clone, Copy, Debug)]
pub struct Scanned<'a> {
    /// Its bone.
    pub surface: &'a Surface,
    /// Its isovalue.
    pub iso: f64,
    /// How far that may be off, values.
    pub tolerance: f64,
}

/// How the first surface's `parts` moved to where the second surface has them, which is looked for within `reach_mm`.
pub fn moved(sides: [&Scanned<'_>; 2], parts: &Parts, reach_mm: f64, progress: &Progress) -> Result<Moved, PartError> {
    if parts.is_all() {
        return Err(PartError::NoPart);
    }
    let around = Parts { only: parts.only.iter().map(|part: &Part| part.grown(reach_mm)).collect(), but: vec![] };
    let clouds =
        [Cloud::of_parts(sides[0].surface, parts, POINTS, progress)?, Cloud::of_parts(sides[1].surface, &around, POINTS, progress)?];
    let apart = || PartError::NotFound { reach_mm };
    if clouds.iter().any(|cloud| cloud.points.len() < LEAST_POINTS) {
        return Err(apart());
    }
    // The second's part is moved onto the first's, whose place says what counts.
    let fit = Pair { moving: &clouds[1], fixed: &clouds[0], parts }.fit(DAffine3::IDENTITY, reach_mm, progress)?;
    if fit.matched() == 0.0 {
        return Err(apart());
    }
    let motion = fit.pose.inverse();
    let blur_mm = |side: &Scanned<'_>, p: Oriented| end_at(side.surface, p.point, p.normal, side.iso, side.tolerance).blur_mm();
    let without_blur = fit.if_moved(|moving, fixed| blur_mm(sides[1], moving.moved(&motion)) - blur_mm(sides[0], fixed)).inverse();
    let back = sureness::covariance(&fit);
    // An error of the way back moves the part the other way, from where it has come to.
    let covariance = back.moved(&motion).unwrap_or(back);
    let middle_mm = clouds[0].middle;
    let there = motion.transform_point3(middle_mm);
    let by_blur_mm = without_blur.transform_point3(middle_mm) - there;
    let error_mm = |axis: DVec3| IN_95_OF_100 * covariance.variance_at(there, axis).sqrt() + by_blur_mm.dot(axis).abs();
    let (turn_axis, turn_rad) = DQuat::from_mat3(&motion.matrix3).to_axis_angle();
    Ok(Moved {
        motion,
        without_blur,
        middle_mm,
        shift_mm: there - middle_mm,
        shift_error_mm: DVec3::new(error_mm(DVec3::X), error_mm(DVec3::Y), error_mm(DVec3::Z)),
        turn_deg: turn_rad.to_degrees(),
        turn_axis,
        left_mm: fit.median_mm(),
        covariance,
    })
}

impl Moved {
    /// In a sentence.
    pub fn told(&self) -> String {
        let along = |n: usize| format!("{} ± {}", signed(self.shift_mm[n], 2), fixed(self.shift_error_mm[n], 2));
        format!(
            "the part's middle moved by ({}, {}, {}) mm to the left, back and up, and it turned by {}°; laid onto the other's, {} mm are left between them",
            along(0),
            along(1),
            along(2),
            fixed(self.turn_deg, 2),
            fixed(self.left_mm, 3)
        )
    }
}
