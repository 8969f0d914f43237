//! What a difference ray found, as it is written down.

use crate::uncertainty::{EndError, Registered, Uncertainty};
use bregma_field::crossings::Kind;
use bregma_field::{Covariance, Turn, Unit};
use serde::Serialize;

/// The whole answer. Serialises to the agreed JSON (see the guide).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DifferenceRay {
    /// The ray that was cast.
    pub ray: RayRecord,
    /// Only what cuts left was measured; else the whole bone, whatever is cut to look at it.
    pub as_cut: bool,
    /// What a reader must know before comparing the scans' lengths, in sentences.
    pub notes: Vec<String>,
    /// How much more bone each later scan has than the first, mm.
    pub pairs: Vec<Pair>,
    /// One for each volume, in order.
    pub volumes: Vec<VolumeRecord>,
    /// Who is inside where, over the union of the boxes, without gaps or overlaps.
    pub ledger: Vec<LedgerEntry>,
}

/// A ray as it is written down.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RayRecord {
    /// LPS mm.
    pub origin_mm: [f64; 3],
    /// Unit.
    pub direction: [f64; 3],
}

/// What the ray meets in one volume.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VolumeRecord {
    /// Its name.
    pub name: String,
    /// How far its samples are apart, along i, j and k.
    pub spacing_mm: [f64; 3],
    /// How far its file states that they are, where the person put another spacing in its place.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stated_spacing_mm: Option<[f64; 3]>,
    /// How the person turned it, or mirrored it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub turn: Option<Turn>,
    /// Isovalue, in the volume's values.
    pub iso: f64,
    /// HU or value.
    pub unit: Unit,
    /// Change of the isovalue that the threshold error stands for, in values.
    pub iso_tolerance: f64,
    /// First and last t within the box of the scan, or what cuts leave of it; `None` where the ray misses that.
    pub box_mm: Option<[f64; 2]>,
    /// Whether there is bone on the ray, and if there is none, why.
    pub meets: Meets,
    /// In order.
    pub crossings: Vec<CrossingRecord>,
    /// Stretches of bone, in order.
    pub segments: Vec<Segment>,
    /// Its number among all volumes, the hidden ones too, from 0.
    #[serde(skip)]
    pub index: usize,
    /// How it is registered.
    #[serde(skip)]
    pub(crate) residual_mm: Option<f64>,
    #[serde(skip)]
    pub(crate) covariance: Option<Covariance>,
    #[serde(skip)]
    pub(crate) is_moved: bool,
}

impl VolumeRecord {
    /// What is known of how far its registration is off.
    pub(crate) fn registered(&self) -> Registered<'_> {
        Registered { residual_mm: self.residual_mm, covariance: self.covariance.as_ref() }
    }
}

/// What a ray meets in a volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Meets {
    /// Bone.
    #[serde(rename = "bone")]
    Bone,
    /// The scan, but no bone in it.
    #[serde(rename = "no bone")]
    NoBone,
    /// Bone, but cuts leave nothing of it.
    #[serde(rename = "cut away")]
    CutAway,
    /// Not even the scan's box.
    #[serde(rename = "nothing")]
    Nothing,
}

impl Meets {
    /// Why there is no bone, as a sentence; `None` where there is some.
    pub fn absence(self) -> Option<&'static str> {
        match self {
            Self::Bone => None,
            Self::NoBone => Some("the ray meets no bone in this scan"),
            Self::CutAway => Some("the bone that the ray meets in this scan is cut away"),
            Self::Nothing => Some("the ray misses this scan"),
        }
    }
}

/// One crossing of the isosurface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CrossingRecord {
    /// Distance from the ray's origin.
    pub t_mm: f64,
    /// Enter, exit or touch.
    pub kind: Kind,
    /// Lowest sample of its cell.
    pub cell: [usize; 3],
    /// LPS mm.
    pub point_mm: [f64; 3],
    /// Outward unit normal, LPS.
    pub normal: [f64; 3],
    /// Bracket of the root.
    pub error_mm: f64,
    /// How far the crossing moves when the isovalue changes by the tolerance: δiso / |∂f/∂t|; 0 where bone is cut rather than
    /// bounded, infinite (null in JSON) where the value does not change along the ray.
    pub threshold_error_mm: f64,
    /// At a face of the volume rather than on the isosurface.
    pub clipped: bool,
    /// At the ray's origin, which lies in bone.
    pub at_origin: bool,
}

/// One stretch of bone.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Segment {
    /// Where it begins.
    pub from_mm: f64,
    /// Where it ends.
    pub to_mm: f64,
    /// Its length.
    pub length_mm: f64,
    /// How far that may be from the truth.
    #[serde(flatten)]
    pub uncertainty: Uncertainty,
    /// Angle between the ray and the normal at each end, degrees: at 60 a wall is measured at twice its thickness.
    pub obliquity_deg: [f64; 2],
    /// Its length between the places where the value is halfway between the plateaus beside each end; null where the scan shows none.
    pub half_maximum_mm: Option<f64>,
    /// The thinnest wall that this scan can show here, along the ray.
    pub resolution_mm: f64,
    /// It begins or ends at a face of the volume, or at a cut.
    pub clipped: bool,
    /// It begins or ends at a cut.
    pub cut: bool,
    /// It begins at the ray's origin, which lies in bone.
    pub from_origin: bool,
    /// Thinner than the resolution: a threshold cannot measure it.
    pub below_resolution: bool,
    /// What is known of the errors of its two ends.
    #[serde(skip)]
    pub(crate) ends: [EndError; 2],
}

/// A stretch of the ray and the volumes whose bone it is in.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LedgerEntry {
    /// Where it begins.
    pub from_mm: f64,
    /// Where it ends.
    pub to_mm: f64,
    /// Its length.
    pub length_mm: f64,
    /// Names of the volumes; empty in a gap.
    pub inside: Vec<String>,
}

/// Two volumes along the ray: how much more bone the second, B, has than the first, A.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Pair {
    /// The first volume.
    pub a: String,
    /// The second.
    pub b: String,
    /// Their numbers in [`DifferenceRay::volumes`], from 0.
    #[serde(skip)]
    pub volumes: [usize; 2],
    /// What the ± of its differences lacks, in words; `None` where nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub without: Option<&'static str>,
    /// One for each bone that both have, in order along the ray.
    pub differences: Vec<Difference>,
    /// Numbers, from 1, of the stretches of A that have no partner in B: no difference is known of them, not even one from nothing.
    pub only_a: Vec<usize>,
    /// And of those of B that have none in A.
    pub only_b: Vec<usize>,
}

/// One bone that both volumes of a pair have.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Numbers, from 1, of the stretches of A.
    pub a: Vec<usize>,
    /// Of B.
    pub b: Vec<usize>,
    /// The length of B's less that of A's.
    pub difference_mm: f64,
    /// How far that may be from the truth.
    #[serde(flatten)]
    pub uncertainty: Uncertainty,
    /// How far B's begins behind A's; null where either begins at a cut, or where the ray does.
    pub from_shift: Option<Shift>,
    /// How far B's ends behind A's; null where either ends at a cut.
    pub to_shift: Option<Shift>,
    /// Several stretches of a volume stand together, because they lie in one of the other: their lengths are added, without the gaps.
    pub united: bool,
    /// One of the stretches is cut by the scan's edge or by a cut, or begins where the ray does, in bone: a part of the bone is compared.
    pub partial: bool,
    /// One of the stretches is thinner than its scan resolves.
    pub below_resolution: bool,
}

/// How far one end of a bone lies behind the other's, along the ray.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Shift {
    /// As far.
    pub shift_mm: f64,
    /// Half the width of an interval that holds the truth in 95 of 100 cases. It has the registration's error where that is known.
    pub error_mm: f64,
}
