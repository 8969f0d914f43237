//! Why volumes are not known.

use super::room::WayOut;
use crate::numbers::fixed;
use bregma_field::{Cancelled, SurfaceError};
use glam::DVec3;
use thiserror::Error;

/// Why a volume is not known.
#[derive(Debug, Error)]
pub enum VolumesError {
    /// More or fewer than one or two scans.
    #[error("{0} scans are named; volumes are of one scan or of two")]
    Count(usize),
    /// A registration that flattens a scan.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// Stopped by request.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The bone goes on where the scan ends.
    #[error(
        "{scan}: the scan's box cuts the bone, for one at {}, {}, {} mm, so that its volume is not known; measure a part of it within a box or a sphere, or pass --open to close it at the scan's box",
        fixed(at_mm.x, 1), fixed(at_mm.y, 1), fixed(at_mm.z, 1)
    )]
    CutByBox {
        /// Its name.
        scan: String,
        /// A place where it does, LPS mm.
        at_mm: DVec3,
    },
    /// What is said of a cavity.
    #[error(transparent)]
    Cavity(#[from] CavityError),
}

/// Why a cavity is not measured.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum CavityError {
    /// The seed is not in the scan.
    #[error("the seed of the cavity at {} lies outside the scan, or outside what is measured of it; give a point inside", told(*.0))]
    Outside(DVec3),
    /// The seed is in bone.
    #[error("the seed of the cavity at {} lies in bone; give a point in the cavity", told(*.0))]
    InBone(DVec3),
    /// The ball does not fit at the seed.
    #[error(
        "the ball of {} mm does not fit at the seed of the cavity at {}, where bone is {} mm away; give a point where it does, or a smaller ball",
        fixed(*ball_mm, 2), told(*seed_mm), fixed(*room_mm, 2)
    )]
    NoRoom {
        /// The seed.
        seed_mm: DVec3,
        /// The ball's radius.
        ball_mm: f64,
        /// How much there is.
        room_mm: f64,
    },
    /// The cavity is open.
    #[error(
        "the cavity at {} leaks to the outside: its widest way out is narrowest at {}, {} mm from bone; close it there with --close {},{},{},{},{},{},RADIUS, or let only a ball larger than that pass (--sphere-passes)",
        told(*seed_mm), told(way.at_mm), fixed(way.radius_mm, 2),
        fixed(way.at_mm.x, 1), fixed(way.at_mm.y, 1), fixed(way.at_mm.z, 1),
        fixed(way.along.x, 2), fixed(way.along.y, 2), fixed(way.along.z, 2)
    )]
    Leak {
        /// The seed.
        seed_mm: DVec3,
        /// The widest way out.
        way: WayOut,
    },
}

pub(super) fn told(p: DVec3) -> String {
    format!("{}, {}, {} mm", fixed(p.x, 1), fixed(p.y, 1), fixed(p.z, 1))
}
