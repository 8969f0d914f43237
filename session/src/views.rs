//! The views that the field knows by name, of the skull as it lies or as its Frankfurt horizontal holds it.

use bregma_measure::landmarks::Landmark;
use bregma_register::orient::{OrientError, frankfurt};
use bregma_renderer::{Basis, Bounds, Camera, Projection, named};
use glam::{DAffine3, DVec3};
use thiserror::Error;

named! {
    /// A view by its name.
    pub enum View {
        /// The face: norma frontalis.
        Frontalis = "frontalis",
        /// The patient's left: norma lateralis sinistra.
        LateralisSinistra = "lateralis-sinistra",
        /// The patient's right: norma lateralis dextra.
        LateralisDextra = "lateralis-dextra",
        /// The back of the head: norma occipitalis.
        Occipitalis = "occipitalis",
        /// From above, the face up: norma verticalis.
        Verticalis = "verticalis",
        /// From below, the face up: norma basilaris.
        Basilaris = "basilaris",
        /// The face and the left, a little from above: the view that scans open with.
        Oblique = "oblique",
    }
}

/// Why a skull cannot be held for a view.
#[derive(Debug, Error)]
pub enum HoldError {
    /// A landmark that is not there.
    #[error(
        "no landmark {0} is set; name the landmarks' file among the scans, and both poria, left first, and the left orbitale as it calls them"
    )]
    NoLandmark(String),
    /// No plane.
    #[error(transparent)]
    Orient(#[from] OrientError),
}

/// What turns the world into the Frankfurt horizontal: by the landmarks that are called so (porion left, porion right and orbitale left), or by the
/// usual names.
pub fn held(landmarks: &[Landmark], names: Option<&[String; 3]>) -> Result<DAffine3, HoldError> {
    let Some(names) = names else { return Ok(frankfurt(landmarks, 1.0)?.pose) };
    let usual = ["porion left", "porion right", "orbitale left"];
    let called = |(usual, name): (&str, &String)| {
        let point_mm = landmarks.iter().find(|landmark| landmark.name == *name).and_then(|landmark| landmark.point_mm);
        point_mm.map(|point_mm| Landmark::at(usual, point_mm)).ok_or_else(|| HoldError::NoLandmark(name.clone()))
    };
    let called = usual.into_iter().zip(names).map(called).collect::<Result<Vec<_>, _>>()?;
    Ok(frankfurt(&called, 1.0)?.pose)
}

/// What the face looks toward, in LPS.
const ANTERIOR: DVec3 = DVec3::NEG_Y;

impl View {
    /// Around the scans, degrees: azimuth and elevation as [`Camera::orbit`] takes them.
    pub fn orbit_deg(self) -> (f64, f64) {
        match self {
            Self::Frontalis => (0.0, 0.0),
            Self::LateralisSinistra => (90.0, 0.0),
            Self::LateralisDextra => (270.0, 0.0),
            Self::Occipitalis => (180.0, 0.0),
            Self::Verticalis => (0.0, 90.0),
            Self::Basilaris => (0.0, -90.0),
            Self::Oblique => (35.0, 10.0),
        }
    }

    /// Of `points`, in perspective of `fov_deg` that just holds them in a picture `aspect` times as wide as high, or along parallel rays from
    /// outside of `bounds`; `held` turns the world so that the skull is upright.
    pub fn camera(self, points: &[DVec3], bounds: &Bounds, fov_deg: Option<f64>, aspect: f64, held: &DAffine3) -> Camera {
        let (azimuth, elevation) = self.orbit_deg();
        let level = Camera::orbit(&Bounds { centre_mm: DVec3::ZERO, radius_mm: 1.0 }, azimuth, elevation);
        let back = held.matrix3.transpose();
        // Straight from above and below, the face is up.
        let up = if elevation.abs() == 90.0 { ANTERIOR } else { DVec3::Z };
        let middle = bounds.centre_mm;
        let toward = back * (level.eye_mm - level.target_mm).normalize();
        // Parallel rays begin outside of the scans, so that the eye cuts nothing off.
        let camera = Camera {
            eye_mm: middle + 3.0 * bounds.radius_mm * toward,
            target_mm: middle,
            up: back * up,
            projection: fov_deg
                .map_or(Projection::Orthographic { height_mm: 2.0 * bounds.radius_mm }, |fov_deg| Projection::Perspective { fov_deg }),
        };
        if fov_deg.is_some() { camera.framed(points, aspect) } else { filled(&camera, points, aspect) }
    }
}

/// A parallel camera whose picture `points` just fill.
fn filled(camera: &Camera, points: &[DVec3], aspect: f64) -> Camera {
    let Some([across, upward]) = extent_mm(camera, points) else { return *camera };
    let height_mm = (upward[1] - upward[0]).max((across[1] - across[0]) / aspect);
    looking_at(camera, [across, upward].map(|[low, high]| 0.5 * (low + high)), height_mm)
}

/// How far points reach to the right and up from a parallel camera's target, mm: the least and the most of each; `None` of none.
pub fn extent_mm(camera: &Camera, points: &[DVec3]) -> Option<[[f64; 2]; 2]> {
    let Basis { right, up, .. } = camera.basis();
    let reach = |axis: DVec3| {
        let along = points.iter().map(|p| (*p - camera.target_mm).dot(axis));
        along.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
    };
    (!points.is_empty()).then(|| [reach(right), reach(up)])
}

/// The parallel camera moved so many mm to the right and up, of such a height.
pub fn looking_at(camera: &Camera, [right_mm, up_mm]: [f64; 2], height_mm: f64) -> Camera {
    let basis = camera.basis();
    let shift = right_mm * basis.right + up_mm * basis.up;
    Camera {
        eye_mm: camera.eye_mm + shift,
        target_mm: camera.target_mm + shift,
        projection: Projection::Orthographic { height_mm },
        ..*camera
    }
}

/// The anatomical name of a direction in LPS: its main axes, the strongest first ("L", "LA", …).
pub fn anatomical(direction: DVec3) -> String {
    // Within 20° of an axis the direction goes by that axis alone.
    let weakest = 20_f64.to_radians().sin();
    let mut parts: Vec<(f64, [&str; 2])> = direction.to_array().into_iter().zip([["R", "L"], ["A", "P"], ["I", "S"]]).collect();
    parts.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()));
    parts.iter().filter(|(c, _)| c.abs() > weakest).map(|(c, names)| names[usize::from(*c > 0.0)]).collect()
}

/// The largest of 1, 2, 5, 10, … that is not above `x`: what bars of scale are as long as.
pub fn round_down(x: f64) -> f64 {
    let decade = 10_f64.powf(x.log10().floor());
    [5.0, 2.0, 1.0].into_iter().find(|m| m * decade <= x).unwrap_or(1.0) * decade
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_bars_have_round_lengths() {
        // Fails if a bar is longer than its room, or of a length that nobody reads off.
        assert_eq!([0.7, 1.0, 3.9, 5.1, 42.0, 230.0].map(round_down), [0.5, 1.0, 2.0, 5.0, 20.0, 200.0]);
    }

    #[test]
    fn directions_are_named_as_radiologists_do() {
        // Fails if a letter stands for the other side, or weak axes are named before strong ones.
        assert_eq!(anatomical(DVec3::X), "L");
        assert_eq!(anatomical(-DVec3::Y), "A");
        assert_eq!(anatomical(DVec3::new(0.1, 0.8, -0.5).normalize()), "PI");
    }
}
