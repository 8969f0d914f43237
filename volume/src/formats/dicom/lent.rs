//! The place of a file that does not state it.

use glam::DVec3;

/// A place that a file does not state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lent {
    /// mm from the origin along the normal.
    pub offset_mm: f64,
    /// What it follows from.
    pub by: By,
}

/// What places follow from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum By {
    /// Their positions; it is directions that they do not state.
    Position,
    /// SliceLocation, which is in mm.
    Location,
    /// InstanceNumber, and how far apart by the attribute of that name.
    Number {
        /// From one to the next.
        mm: f64,
        /// Of the attribute.
        name: &'static str,
    },
}

impl Lent {
    /// Position and directions of the slice; `along` is what the file says of directions.
    pub fn place(self, position: Option<[f64; 3]>, along: Option<[f64; 6]>) -> ([f64; 3], [f64; 6]) {
        let along = along.unwrap_or([1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        let [a, b, c, d, e, f] = along;
        let normal = DVec3::new(a, b, c).cross(DVec3::new(d, e, f)).normalize_or_zero();
        let place = position.filter(|_| self.by == By::Position).map_or(normal * self.offset_mm, DVec3::from);
        (place.to_array(), along)
    }

    /// The sentence about it.
    pub fn warning(self) -> String {
        let by = match self.by {
            By::Position => {
                return "its images do not state their directions (ImageOrientationPatient); they are taken as left and posterior".into();
            }
            By::Location => "their SliceLocation".to_owned(),
            By::Number { mm, name } => format!("InstanceNumber, {mm} mm apart, which is their {name}"),
        };
        format!(
            "its images do not state where they lie (ImagePositionPatient); they are put in order by {by}: which way is up, and so whether it is a mirror image, is not known"
        )
    }
}
