//! The planes that slices are seen on, and from where: by the radiologist's custom, the patient's left on the right and the front above or on the
//! left.

use crate::camera::{Camera, Projection};
use crate::named;
use bregma_field::Grid;
use glam::DVec3;

named! {
    /// The three planes of the body.
    #[derive(Default)]
    pub enum BodyPlane {
        /// Across the body, seen from below.
        #[default]
        Axial = "axial",
        /// Through left and right, seen from the front.
        Coronal = "coronal",
        /// Through front and back, seen from the left.
        Sagittal = "sagittal",
    }
}

impl BodyPlane {
    /// Into the picture, and up in it; LPS.
    pub fn axes(self) -> [DVec3; 2] {
        match self {
            Self::Axial => [DVec3::Z, DVec3::NEG_Y],
            Self::Coronal => [DVec3::Y, DVec3::Z],
            Self::Sagittal => [DVec3::NEG_X, DVec3::Z],
        }
    }

    /// The axis of the world across it: 0 is left, 1 posterior, 2 superior.
    pub fn axis(self) -> usize {
        match self {
            Self::Axial => 2,
            Self::Coronal => 1,
            Self::Sagittal => 0,
        }
    }
}

/// The view onto a plane through a point, along `forward` and with `up` above, that shows all of `grids` in a picture `aspect` times as wide as high.
pub fn view_of_plane([forward, up]: [DVec3; 2], through_mm: DVec3, grids: &[Grid], aspect: f64) -> Camera {
    let right = forward.cross(up);
    let reach = |axis: DVec3| {
        let along = grids.iter().flat_map(Grid::corners_mm).map(|corner| (corner - through_mm).dot(axis).abs());
        along.fold(0.0, f64::max)
    };
    // A rim of a twentieth; a view of nothing is of a mm.
    let height_mm = 2.1 * reach(up).max(reach(right) / aspect).max(0.5);
    let eye_mm = through_mm - forward * height_mm;
    Camera { eye_mm, target_mm: through_mm, up, projection: Projection::Orthographic { height_mm } }
}
