//! A pair of dry human skulls as continuous distances, with a vault whose wall thickness is known everywhere.
//!
//! World is LPS mm: the face looks toward −y, +x is the skull's left. The outer vault is an ovoid; its inner surface lies
//! [`Skull::vault_thickness_mm`] below it along its normals, so that this is the exact length of bone on a normal line, away from
//! sutures and from what is joined to the vault.

use crate::bones;
use crate::ct::{Field, Material};
use crate::ovoid::{Foot, Ovoid};
use crate::sdf::{Group, RoundCone, smooth_subtraction, smooth_union, zigzag};
use glam::{DVec2, DVec3, dvec3};

/// Which skull of the pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Which {
    /// The reference.
    A,
    /// A with a thicker frontal bone, a healed burr hole and a displaced mandible.
    B,
}

/// Wall of the frontal bone of A at [`FRONTAL_NORMAL`].
pub const FRONTAL_MM: f64 = 6.5;
/// Wall of the parietal bone, and of the vault wherever no other bone is near.
pub const PARIETAL_MM: f64 = 5.0;
/// Wall of the temporal bone at [`TEMPORAL_NORMAL`] and its mirror image.
pub const TEMPORAL_MM: f64 = 3.0;
/// Wall of the occipital bone at [`OCCIPITAL_NORMAL`].
pub const OCCIPITAL_MM: f64 = 8.0;
/// Outer normal in the middle of the frontal bone (not unit).
pub const FRONTAL_NORMAL: DVec3 = dvec3(0.0, -0.94, 0.34);
/// Outer normal in the middle of the left temporal bone (not unit).
pub const TEMPORAL_NORMAL: DVec3 = dvec3(0.95, -0.1, -0.2);
/// Outer normal in the middle of the occipital bone (not unit).
pub const OCCIPITAL_NORMAL: DVec3 = dvec3(0.0, 0.97, -0.1);
/// B: by how much its frontal bone is thicker at [`FRONTAL_NORMAL`], inward; falls off with the frontal bone's own profile.
pub const FRONTAL_GAIN_MM: f64 = 3.5;
/// B: outer normal at the middle of the burr hole, on the left parietal (not unit).
pub const BURR_NORMAL: DVec3 = dvec3(0.75, 0.25, 0.61);
/// B: radius of the burr hole.
pub const BURR_RADIUS_MM: f64 = 8.0;
/// B: wall that has grown over the burr hole, within `BURR_RADIUS_MM − BURR_RIM_MM` of its axis.
pub const BURR_WALL_MM: f64 = 1.5;
/// B: width of the rounding between the burr hole's floor and its side, and between its side and the vault.
pub const BURR_RIM_MM: f64 = 3.0;
/// B: displacement of the mandible: 3 mm to the left, 2 mm forward.
pub const MANDIBLE_SHIFT_MM: DVec3 = dvec3(3.0, -2.0, 0.0);
/// Width of a suture's groove.
pub const SUTURE_WIDTH_MM: f64 = 1.2;
/// Depth of a suture's groove below the outer vault.
pub const SUTURE_DEPTH_MM: f64 = 1.5;
/// Compact bone of the two tables.
pub const CORTICAL_HU: f64 = 1500.0;
/// Spongy bone between them.
pub const DIPLOE_HU: f64 = 700.0;
/// Teeth.
pub const TOOTH_HU: f64 = 2400.0;

/// exp(−(1 − cos angle)/0.12): a bell on the sphere of normals, about 0.35 rad wide, so 18 mm to 24 mm on the vault.
const BELL: f64 = 0.12;
/// More than the thickest wall: FRONTAL_MM + FRONTAL_GAIN_MM = 10 mm.
const THICKEST_MM: f64 = 12.0;
/// Outside of the vault by this much, no bone is so thick that its cavity matters.
const BEYOND_MM: f64 = 20.0;
/// Bone as near as the first to a ball that is as far from the vault as the second is not the vault's, nor does the vault's cavity cut it.
const NEAR_BONE_MM: f64 = 8.0;
const FAR_FROM_VAULT_MM: f64 = 40.0;
/// What stands for the vault's foot there.
const NO_FOOT: Foot = Foot { distance_mm: FAR_FROM_VAULT_MM, normal: DVec3::Z, point: DVec3::ZERO };
/// Fillet between the vault and the middle cranial fossae, and between bones that grow together.
const FOSSA_FILLET_MM: f64 = 8.0;
const FILLET_MM: f64 = 6.0;
/// Fillet between the orbits' walls and the face.
const ORBIT_FILLET_MM: f64 = 2.0;
/// Walls of the orbits and of the middle cranial fossae.
const THIN_WALL_MM: f64 = 3.0;
/// Depth at which compact bone begins to turn spongy, and where it has: the tables are about 1.6 mm thick.
const TABLE_MM: [f64; 2] = [1.2, 2.0];
/// Half the width of the ramp from bone to tooth, so that sampling sees no step inside bone.
const ROOT_RAMP_MM: f64 = 0.3;
/// Extent of the nasal cavity along y and of the foramen magnum along z, between the centres of their round ends.
const NASAL_Y_MM: [f64; 2] = [-115.0, -52.0];
const FORAMEN_Z_MM: [f64; 2] = [-95.0, -50.0];
/// The orbits' openings are as much wider and higher than a cone's.
const ORBIT_WIDER_MM: [f64; 2] = [4.0, 1.5];
/// From the burr hole's axis, and below its middle, where only the cavity is left to cut: the thickest wall and the rim fit well in between.
const BURR_REACH_MM: [f64; 2] = [30.0, 40.0];
/// Top of the orbits' walls: all openings lie below it.
const OPENINGS_TOP_MM: f64 = -3.0;

/// A middle cranial fossa, full.
#[derive(Clone, Copy, Debug)]
struct Ball {
    centre: DVec3,
    radius_mm: f64,
}

/// One skull of the pair.
#[derive(Clone, Debug)]
pub struct Skull {
    which: Which,
    vault: Ovoid,
    solid: Group,
    fossa: Ball,
    orbit: RoundCone,
    nasal: RoundCone,
    foramen: RoundCone,
    canals: Group,
    nose: Group,
    upper_teeth: Group,
    mandible: Group,
    lower_teeth: Group,
    mandible_shift_mm: DVec3,
    /// What [`Field::near`] may leave out: the whole cranium, or the vault.
    has_cranium: bool,
    has_vault: bool,
    /// Unit normals of [`FRONTAL_NORMAL`], [`OCCIPITAL_NORMAL`] and [`TEMPORAL_NORMAL`].
    normals: [DVec3; 3],
    /// Middle of the burr hole on the outer vault, and its axis.
    burr: [DVec3; 2],
}

impl Field for Skull {
    /// Walls grow by up to 0.12 mm per mm along the outer vault, 0.2 at the depth of the inner one: √(1 + 0.2²) = 1.02;
    /// the tests find no more than this.
    const LIPSCHITZ: f64 = 1.05;

    fn material(&self, p: DVec3) -> Material {
        let [_, bone, teeth] = self.distances(p);
        let distance_mm = bone.min(teeth);
        let depth = ((-distance_mm - TABLE_MM[0]) / (TABLE_MM[1] - TABLE_MM[0])).clamp(0.0, 1.0);
        let bone_hu = CORTICAL_HU + (DIPLOE_HU - CORTICAL_HU) * depth * depth * (3.0 - 2.0 * depth);
        let tooth = (0.5 - 0.5 * teeth / ROOT_RAMP_MM).clamp(0.0, 1.0);
        Material { distance_mm, inside_hu: bone_hu + (TOOTH_HU - bone_hu) * tooth }
    }

    fn near(&self, p: DVec3, radius_mm: f64) -> Option<Self> {
        let [cranium, bone, teeth] = self.distances(p);
        let shifted = p - self.mandible_shift_mm;
        // Teeth count as far as their ramp reaches, and what is filleted to the orbits' walls as far as that fillet does.
        let teeth = bone.min(teeth).max(ROOT_RAMP_MM);
        let hole = Self::LIPSCHITZ * radius_mm - cranium;
        Some(Self {
            solid: self.solid.near(cranium + ORBIT_FILLET_MM, p, radius_mm),
            nose: self.nose.near(cranium, p, radius_mm),
            canals: if self.canals.at_least(mirrored(p)) - radius_mm > hole { Group::new(1.0, []) } else { self.canals.clone() },
            mandible: self.mandible.near(bone, shifted, radius_mm),
            upper_teeth: self.upper_teeth.near(teeth, p, radius_mm),
            lower_teeth: self.lower_teeth.near(teeth, shifted, radius_mm),
            // Both sides of the comparison may change.
            has_cranium: cranium < teeth + 2.0 * Self::LIPSCHITZ * radius_mm,
            has_vault: self.has_vault && (cranium.abs() > NEAR_BONE_MM || self.vault.foot(p).distance_mm < FAR_FROM_VAULT_MM),
            ..*self
        })
    }
}

impl Skull {
    /// The skull `which`.
    pub fn new(which: Which) -> Self {
        let vault = Ovoid::new(dvec3(0.0, -33.0, 10.0), dvec3(0.0, 27.0, -2.0), [54.0, 66.0], 9.0);
        let burr = BURR_NORMAL.normalize();
        Self {
            which,
            vault,
            solid: Group::new(FILLET_MM, bones::cranium()),
            fossa: Ball { centre: dvec3(32.0, -8.0, -24.0), radius_mm: 27.0 },
            orbit: bones::cone([35.0, -89.0, -27.0], [14.0, -40.0, -26.0], [17.5, 5.5]),
            nasal: bones::cone([0.0, 0.0, -34.0], [0.0, 0.0, -50.0], [4.5, 12.0]),
            foramen: bones::cone([0.0, 24.0, 0.0], [0.0, 32.0, 0.0], [15.0, 14.0]),
            canals: Group::new(1.0, bones::canals()),
            nose: Group::new(1.0, bones::nose()),
            upper_teeth: Group::new(0.5, bones::upper_teeth()),
            mandible: Group::new(FILLET_MM, bones::mandible()),
            lower_teeth: Group::new(0.5, bones::lower_teeth()),
            mandible_shift_mm: if which == Which::B { MANDIBLE_SHIFT_MM } else { DVec3::ZERO },
            has_cranium: true,
            has_vault: true,
            normals: [FRONTAL_NORMAL, OCCIPITAL_NORMAL, TEMPORAL_NORMAL].map(DVec3::normalize),
            burr: [vault.point(burr), burr],
        }
    }

    /// The nearest point of the outer vault, sutures and all else left out, with its normal.
    pub fn vault_foot(&self, p: DVec3) -> Foot {
        self.vault.foot(p)
    }

    /// The point of the outer vault whose unit outer normal is `normal`.
    pub fn vault_point(&self, normal: DVec3) -> DVec3 {
        self.vault.point(normal)
    }

    /// Length of bone on the vault's normal line with the unit outer `normal`, without sutures and burr hole.
    pub fn vault_thickness_mm(&self, normal: DVec3) -> f64 {
        let bell = |n: DVec3, towards: DVec3| ((n.dot(towards) - 1.0) / BELL).exp();
        let [frontal, occipital, temporal] = self.normals;
        let gain = if self.which == Which::B { FRONTAL_GAIN_MM } else { 0.0 };
        PARIETAL_MM
            + (FRONTAL_MM - PARIETAL_MM + gain) * bell(normal, frontal)
            + (OCCIPITAL_MM - PARIETAL_MM) * bell(normal, occipital)
            + (TEMPORAL_MM - PARIETAL_MM) * bell(mirrored(normal), temporal)
    }

    /// Signed distance of the skull without mandible and teeth, at most [`Self::LIPSCHITZ`] mm per mm.
    pub fn cranium(&self, p: DVec3) -> f64 {
        let fossa = mirrored(p).distance(self.fossa.centre) - self.fossa.radius_mm;
        let foot = if self.has_vault { self.vault.foot(p) } else { NO_FOOT };
        let depth = -foot.distance_mm;
        // Zero at the inner vault. Deep inside, where normals meet and the wall is not continuous, the thickest wall bounds it.
        let wall = if depth > -BEYOND_MM { self.vault_thickness_mm(foot.normal) } else { 0.0 };
        let cavity = (depth - wall).min(THICKEST_MM / 2.0).max(depth - THICKEST_MM).max(-THIN_WALL_MM - fossa);
        let walled = if cavity >= 0.0 {
            cavity
        } else {
            let solid = self.solid.unite(smooth_union(foot.distance_mm, fossa, FOSSA_FILLET_MM), p);
            let solid = if self.which == Which::B { self.without_burr_hole(solid, p, depth, wall) } else { solid };
            solid.max(cavity)
        };
        // Grooves also cut what stands up to FILLET_MM above the vault. Nowhere is the cut deeper than on a suture itself.
        let at = |off_suture: f64| (0.5 * SUTURE_WIDTH_MM - off_suture).min(SUTURE_DEPTH_MM - depth).min(depth + FILLET_MM);
        let grooved = if at(0.0) > walled { walled.max(at(sutures(p))) } else { walled };
        self.nose.unite(self.with_openings(grooved, p, depth), p)
    }

    /// Signed distance of the mandible without teeth.
    pub fn mandible(&self, p: DVec3) -> f64 {
        self.mandible.unite(f64::INFINITY, p - self.mandible_shift_mm)
    }

    /// Signed distance of the mandible with its teeth.
    pub fn jaw(&self, p: DVec3) -> f64 {
        self.mandible(p).min(self.lower_teeth.unite(f64::INFINITY, p - self.mandible_shift_mm))
    }

    /// Signed distance of the cranium with its teeth.
    pub fn without_jaw(&self, p: DVec3) -> f64 {
        self.cranium(p).min(self.upper_teeth.unite(f64::INFINITY, p))
    }

    /// Signed distances of the cranium, of all bone and of the teeth; what does not count may be infinite.
    fn distances(&self, p: DVec3) -> [f64; 3] {
        let cranium = if self.has_cranium { self.cranium(p) } else { f64::INFINITY };
        let shifted = p - self.mandible_shift_mm;
        let bone = cranium.min(detached(&self.mandible, shifted, cranium));
        let near = bone.max(ROOT_RAMP_MM);
        [cranium, bone, detached(&self.upper_teeth, p, near).min(detached(&self.lower_teeth, shifted, near))]
    }

    /// Orbits (with walls of their own), nasal aperture, foramen magnum and canals.
    fn with_openings(&self, bone: f64, p: DVec3, depth: f64) -> f64 {
        // None is nearer than the plane z = OPENINGS_TOP_MM, and the fillet below is as wide.
        if p.z - OPENINGS_TOP_MM >= bone.abs() + ORBIT_FILLET_MM {
            return bone;
        }
        let m = mirrored(p);
        let out = bones::ORBIT_OUT;
        let from = m - bones::ORBIT_RIM;
        let aside = dvec3(-out.y, out.x, 0.0);
        let [wide, high] = ORBIT_WIDER_MM;
        let orbit = self.orbit.distance(m - from.dot(aside).clamp(-wide, wide) * aside - dvec3(0.0, 0.0, from.z.clamp(-high, high)));
        let walled = smooth_union(bone, (orbit - THIN_WALL_MM).max(from.dot(out)), ORBIT_FILLET_MM);
        let nasal = self.nasal.distance(dvec3(p.x, p.y - p.y.clamp(NASAL_Y_MM[0], NASAL_Y_MM[1]), p.z));
        // The floor of the anterior fossa roofs the nose.
        let nasal = nasal.max(depth);
        let foramen = self.foramen.distance(dvec3(p.x, p.y, p.z - p.z.clamp(FORAMEN_Z_MM[0], FORAMEN_Z_MM[1])));
        let canals = self.canals.unite(f64::INFINITY, p);
        [orbit, nasal, foramen, canals].into_iter().fold(walled, |bone, hole| bone.max(-hole))
    }

    /// Takes out a flat-floored pit that follows the vault: its floor lies BURR_WALL_MM above the inner surface.
    fn without_burr_hole(&self, solid: f64, p: DVec3, depth: f64, wall: f64) -> f64 {
        let [middle, axis] = self.burr;
        let v = p - middle;
        let along = v.dot(axis);
        let aside = (v - along * axis).length();
        // Below lies the other side of the head.
        if aside > BURR_REACH_MM[0] || along < -BURR_REACH_MM[1] {
            return solid;
        }
        let within = BURR_RADIUS_MM - aside;
        let pit = -smooth_union(wall - BURR_WALL_MM - depth, within, BURR_RIM_MM);
        smooth_subtraction(solid, pit, BURR_RIM_MM)
    }
}

/// Distance of a group that is joined to nothing; infinite where it is not within `within_mm`.
fn detached(group: &Group, p: DVec3, within_mm: f64) -> f64 {
    if group.at_least(mirrored(p)) < within_mm { group.unite(f64::INFINITY, p) } else { f64::INFINITY }
}

fn mirrored(p: DVec3) -> DVec3 {
    dvec3(p.x.abs(), p.y, p.z)
}

/// Distance to the nearest suture, measured along the outer vault (a curve there, a curtain through it in space).
fn sutures(p: DVec3) -> f64 {
    let line = |along: f64, across: f64| zigzag(DVec2::new(along, across), 6.0, 1.6);
    // Radians to mm by the shortest radius in reach of a groove, so that no direction counts more than once.
    let around = |y: f64, x: f64| 48.0 * y.atan2(x);
    // Coronal: the plane through bregma (0, −12, 71) and both pterions, to z = −4.
    let across = DVec2::new(0.951, -0.309);
    let yz = DVec2::new(p.y + 12.0, p.z - 71.0);
    let coronal = line(around(p.x.abs(), DVec2::new(0.309, 0.951).dot(yz) + 60.0), across.dot(yz)).max(-4.0 - p.z);
    // Lambdoid: from lambda (0, 76, 46) down and outward on the back.
    let down = DVec2::new(0.656, -0.755);
    let xz = DVec2::new(p.x.abs(), p.z - 46.0);
    let lambdoid = line(down.dot(xz), DVec2::new(0.755, 0.656).dot(xz)).max(30.0 - p.y).max(-18.0 - p.z);
    // Sagittal: the midline between the two.
    let sagittal = line(around(p.y - 10.0, p.z), p.x).max(-across.dot(yz)).max(46.0 - p.z);
    coronal.min(lambdoid).min(sagittal)
}
