//! A pair of dry human skulls as continuous distances, with a vault whose wall thickness is known everywhere.
//!
//! World is LPS mm: the face looks toward −y, +x is the skull's left. The outer vault is a round cone (small ball behind
//! the forehead, large ball in the back); its inner surface lies [`Skull::vault_thickness_mm`] below it along its normals, so
//! that this is the exact length of bone on a normal line, away from sutures and from what is joined to the vault.

use crate::ct::{Field, Material};
use crate::sdf::{Foot, Group, RoundCone, Shape, smooth_subtraction, smooth_union, zigzag};
use glam::{DMat3, DVec2, DVec3, dvec3};

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
/// Centres of the vault's two balls.
const VAULT_FRONT: DVec3 = dvec3(0.0, -31.0, 15.0);
const VAULT_BACK: DVec3 = dvec3(0.0, 22.0, 2.0);
/// Fillet between bones that grow together.
const FILLET_MM: f64 = 6.0;
/// Walls of the orbits and of the middle cranial fossae.
const THIN_WALL_MM: f64 = 3.0;
/// Depth at which compact bone begins to turn spongy, and where it has: the tables are about 1.6 mm thick.
const TABLE_MM: [f64; 2] = [1.2, 2.0];
/// Half the width of the ramp from bone to tooth, so that sampling sees no step inside bone.
const ROOT_RAMP_MM: f64 = 0.3;
/// Extent of the nasal cavity along y and of the foramen magnum along z, between the centres of their round ends.
const NASAL_Y_MM: [f64; 2] = [-115.0, -52.0];
const FORAMEN_Z_MM: [f64; 2] = [-95.0, -50.0];
/// Top of the orbits' walls, −27 + 19.5 + 3: all openings lie below it.
const OPENINGS_TOP_MM: f64 = -4.5;

/// One skull of the pair.
#[derive(Clone, Debug)]
pub struct Skull {
    which: Which,
    vault: RoundCone,
    solid: Group,
    fossa: Shape,
    orbit: RoundCone,
    nasal: RoundCone,
    foramen: RoundCone,
    canals: Group,
    inserts: Group,
    upper_teeth: Group,
    mandible: Group,
    lower_teeth: Group,
    mandible_shift_mm: DVec3,
}

impl Field for Skull {
    /// Walls grow by up to 0.12 mm per mm along the outer vault, 0.2 at the depth of the inner one: √(1 + 0.2²) = 1.02;
    /// the tests find no more than this.
    const LIPSCHITZ: f64 = 1.05;

    fn material(&self, p: DVec3) -> Material {
        let cranium = self.cranium(p);
        let shifted = p - self.mandible_shift_mm;
        let bone = cranium.min(detached(&self.mandible, shifted, cranium));
        let near = bone.max(ROOT_RAMP_MM);
        let teeth = detached(&self.upper_teeth, p, near).min(detached(&self.lower_teeth, shifted, near));
        let distance_mm = bone.min(teeth);
        let depth = ((-distance_mm - TABLE_MM[0]) / (TABLE_MM[1] - TABLE_MM[0])).clamp(0.0, 1.0);
        let bone_hu = CORTICAL_HU + (DIPLOE_HU - CORTICAL_HU) * depth * depth * (3.0 - 2.0 * depth);
        let tooth = (0.5 - 0.5 * teeth / ROOT_RAMP_MM).clamp(0.0, 1.0);
        Material { distance_mm, inside_hu: bone_hu + (TOOTH_HU - bone_hu) * tooth }
    }
}

impl Skull {
    /// The skull `which`.
    pub fn new(which: Which) -> Self {
        Self {
            which,
            vault: RoundCone::new(VAULT_FRONT, VAULT_BACK, [56.0, 70.0]),
            solid: Group::new(4.0, cranial_bones()),
            fossa: Shape::ball(dvec3(31.0, -10.0, -26.0), 27.0),
            orbit: RoundCone::new(dvec3(33.0, -86.0, -27.0), dvec3(14.0, -40.0, -26.0), [19.5, 5.0]),
            nasal: RoundCone::new(dvec3(0.0, 0.0, -34.0), dvec3(0.0, 0.0, -50.0), [4.5, 12.0]),
            foramen: RoundCone::new(dvec3(0.0, 24.0, 0.0), dvec3(0.0, 32.0, 0.0), [15.0, 14.0]),
            canals: Group::new(
                1.0,
                [
                    // External auditory meatus; infraorbital foramen.
                    cone([75.0, 11.0, -46.0], [46.0, 9.0, -45.0], [4.5, 3.5]),
                    cone([28.0, -90.0, -56.0], [27.0, -74.0, -52.0], [2.0, 2.0]),
                ],
            ),
            inserts: Group::new(
                1.0,
                [
                    // Nasal septum, anterior nasal spine.
                    plate([0.0, -76.0, -36.0], [0.0, -80.0, -62.0], [0.0, -48.0, -62.0], 0.9),
                    plate([0.0, -76.0, -36.0], [0.0, -48.0, -62.0], [0.0, -48.0, -44.0], 0.9),
                    cone([0.0, -82.0, -63.0], [0.0, -91.0, -61.5], [3.0, 1.2]),
                ],
            ),
            upper_teeth: Group::new(0.5, teeth(1.0, -77.5)),
            mandible: Group::new(2.5, mandible_bones()),
            lower_teeth: Group::new(0.5, teeth(0.95, -89.0)),
            mandible_shift_mm: if which == Which::B { MANDIBLE_SHIFT_MM } else { DVec3::ZERO },
        }
    }

    /// The nearest point of the outer vault, sutures and all else left out, with its normal.
    pub fn vault_foot(&self, p: DVec3) -> Foot {
        self.vault.foot(p)
    }

    /// Length of bone on the vault's normal line with the unit outer `normal`, without sutures and burr hole.
    pub fn vault_thickness_mm(&self, normal: DVec3) -> f64 {
        let bell = |n: DVec3, towards: DVec3| ((n.dot(towards.normalize()) - 1.0) / BELL).exp();
        let frontal = FRONTAL_MM - PARIETAL_MM + if self.which == Which::B { FRONTAL_GAIN_MM } else { 0.0 };
        PARIETAL_MM
            + frontal * bell(normal, FRONTAL_NORMAL)
            + (OCCIPITAL_MM - PARIETAL_MM) * bell(normal, OCCIPITAL_NORMAL)
            + (TEMPORAL_MM - PARIETAL_MM) * bell(mirrored(normal), TEMPORAL_NORMAL)
    }

    /// Signed distance of the skull without mandible and teeth, at most [`Self::LIPSCHITZ`] mm per mm.
    pub fn cranium(&self, p: DVec3) -> f64 {
        let m = mirrored(p);
        let foot = self.vault.foot(p);
        let wall = self.vault_thickness_mm(foot.normal);
        let depth = -foot.distance_mm;
        // Zero at the inner vault. Deep inside, where normals meet and the wall is not continuous, the thickest wall bounds it.
        let cavity = (depth - wall).min(THICKEST_MM / 2.0).max(depth - THICKEST_MM).max(-THIN_WALL_MM - self.fossa.distance(m));
        let walled = if cavity >= 0.0 {
            cavity
        } else {
            let joined = smooth_union(foot.distance_mm, self.fossa.distance(m), FILLET_MM);
            let solid = self.solid.unite(joined, p);
            let solid = if self.which == Which::B { without_burr_hole(solid, p, depth, wall) } else { solid };
            solid.max(cavity)
        };
        // Grooves also cut what stands up to FILLET_MM above the vault. Nowhere is the cut deeper than on a suture itself.
        let at = |off_suture: f64| (0.5 * SUTURE_WIDTH_MM - off_suture).min(SUTURE_DEPTH_MM - depth).min(depth + FILLET_MM);
        let grooved = if at(0.0) > walled { walled.max(at(sutures(p))) } else { walled };
        self.inserts.unite(self.with_openings(grooved, p, depth), p)
    }

    /// Signed distance of the mandible without teeth.
    pub fn mandible(&self, p: DVec3) -> f64 {
        self.mandible.unite(f64::INFINITY, p - self.mandible_shift_mm)
    }

    /// Orbits (with walls of their own), nasal aperture, foramen magnum and canals.
    fn with_openings(&self, bone: f64, p: DVec3, depth: f64) -> f64 {
        // None is nearer than the plane z = OPENINGS_TOP_MM, and the fillet below is 2 mm.
        if p.z - OPENINGS_TOP_MM >= bone.abs() + 2.0 {
            return bone;
        }
        let m = mirrored(p);
        let orbit = self.orbit.distance(m);
        // The plane of the orbit's rim: its lateral edge lies behind its medial one.
        let rim = (m - dvec3(15.0, -84.0, 0.0)).dot(dvec3(0.496, -0.868, 0.0));
        let walled = smooth_union(bone, (orbit - THIN_WALL_MM).max(rim), 2.0);
        let nasal = self.nasal.distance(dvec3(p.x, p.y - p.y.clamp(NASAL_Y_MM[0], NASAL_Y_MM[1]), p.z));
        // The floor of the anterior fossa roofs the nose.
        let nasal = nasal.max(depth);
        let foramen = self.foramen.distance(dvec3(p.x, p.y, p.z - p.z.clamp(FORAMEN_Z_MM[0], FORAMEN_Z_MM[1])));
        let canals = self.canals.unite(f64::INFINITY, p);
        [orbit, nasal, foramen, canals].into_iter().fold(walled, |bone, hole| bone.max(-hole))
    }
}

/// Distance of a group that is joined to nothing; infinite where it is not within `within_mm`.
fn detached(group: &Group, p: DVec3, within_mm: f64) -> f64 {
    if group.at_least(mirrored(p)) < within_mm { group.unite(f64::INFINITY, p) } else { f64::INFINITY }
}

/// Takes out a flat-floored pit that follows the vault: its floor lies BURR_WALL_MM above the inner surface.
fn without_burr_hole(solid: f64, p: DVec3, depth: f64, wall: f64) -> f64 {
    let axis = BURR_NORMAL.normalize();
    let v = p - VAULT_BACK;
    let along = v.dot(axis);
    if along <= 0.0 {
        return solid;
    }
    let within = BURR_RADIUS_MM - (v - along * axis).length();
    let pit = -smooth_union(wall - BURR_WALL_MM - depth, within, BURR_RIM_MM);
    smooth_subtraction(solid, pit, BURR_RIM_MM)
}

fn mirrored(p: DVec3) -> DVec3 {
    dvec3(p.x.abs(), p.y, p.z)
}

fn cone(a: [f64; 3], b: [f64; 3], radii_mm: [f64; 2]) -> Shape {
    Shape::RoundCone(RoundCone::new(a.into(), b.into(), radii_mm))
}

fn plate(a: [f64; 3], b: [f64; 3], c: [f64; 3], radius_mm: f64) -> Shape {
    Shape::Plate { corners: [a.into(), b.into(), c.into()], radius_mm }
}

/// What stands out of the vault, left half.
fn cranial_bones() -> Vec<Shape> {
    let mut bones = vec![
        // Brow ridge and lateral rim of the orbit, frontal to zygomatic.
        cone([5.0, -82.0, -7.0], [28.0, -80.0, -4.0], [6.0, 5.5]),
        cone([28.0, -80.0, -4.0], [47.0, -69.0, -10.0], [5.5, 5.0]),
        cone([47.0, -69.0, -10.0], [52.0, -63.0, -22.0], [5.0, 4.5]),
        cone([52.0, -63.0, -22.0], [52.0, -62.0, -40.0], [4.5, 5.0]),
        // Zygomatic bone and infraorbital rim.
        plate([52.0, -62.0, -38.0], [54.0, -58.0, -46.0], [38.0, -74.0, -50.0], 4.5),
        cone([50.0, -63.0, -47.0], [34.0, -73.0, -53.0], [6.5, 5.5]),
        cone([37.0, -75.0, -48.0], [17.0, -83.0, -47.0], [3.5, 3.5]),
        // Zygomatic arch to its root above the ear.
        cone([54.0, -60.0, -45.0], [64.0, -42.0, -45.0], [4.5, 3.3]),
        cone([64.0, -42.0, -45.0], [67.0, -18.0, -43.0], [3.3, 3.0]),
        cone([67.0, -18.0, -43.0], [64.0, 4.0, -42.0], [3.0, 3.3]),
        cone([64.0, 4.0, -42.0], [50.0, 14.0, -41.0], [3.3, 6.0]),
        // Nasal bone and frontal process of the maxilla.
        cone([2.5, -86.0, -10.0], [3.0, -95.0, -30.0], [4.5, 3.0]),
        cone([8.0, -85.0, -13.0], [15.0, -84.0, -46.0], [4.5, 4.5]),
        // Maxilla: front, side, palate.
        plate([14.0, -82.0, -49.0], [38.0, -69.0, -52.0], [27.0, -70.0, -70.0], 4.0),
        plate([14.0, -82.0, -49.0], [27.0, -70.0, -70.0], [8.0, -84.0, -70.0], 4.0),
        plate([37.0, -66.0, -52.0], [33.0, -44.0, -50.0], [29.0, -46.0, -70.0], 4.0),
        plate([37.0, -66.0, -52.0], [29.0, -46.0, -70.0], [27.0, -68.0, -70.0], 4.0),
        plate([0.0, -82.0, -66.0], [24.0, -64.0, -66.0], [25.0, -44.0, -66.0], 2.0),
        plate([0.0, -82.0, -66.0], [25.0, -44.0, -66.0], [0.0, -44.0, -66.0], 2.0),
        // Sphenoid and clivus, pterygoid plate.
        cone([0.0, 6.0, -58.0], [0.0, -38.0, -44.0], [10.0, 9.0]),
        plate([15.0, -34.0, -48.0], [18.0, -34.0, -72.0], [15.0, -42.0, -70.0], 1.8),
        // Mastoid and styloid process, occipital condyle, external protuberance.
        cone([51.0, 25.0, -42.0], [50.0, 19.0, -70.0], [12.0, 6.0]),
        cone([45.0, 12.0, -58.0], [40.0, 2.0, -82.0], [2.5, 1.0]),
        cone([13.0, 9.0, -67.0], [18.0, 22.0, -69.0], [4.5, 4.5]),
        Shape::ball(dvec3(0.0, 84.0, -14.0), 7.5),
    ];
    // Alveolar process along the dental arch.
    bones.extend((0..4).map(|i| {
        let at = |s: f64| arch(s, 1.0).0.extend(-71.0).to_array();
        cone(at(16.0 * f64::from(i)), at(16.0 * f64::from(i + 1)), [6.0, 6.0])
    }));
    bones
}

/// The mandible without teeth, left half.
fn mandible_bones() -> Vec<Shape> {
    let upper = [[0.0, -81.0, -98.0], [14.0, -77.0, -98.0], [25.0, -60.0, -97.0], [31.0, -34.0, -94.0]];
    let lower = [[0.0, -84.0, -116.0], [15.0, -81.0, -117.0], [32.0, -58.0, -114.0], [43.0, -26.0, -105.0]];
    let (gonion, notch, neck) = ([46.0, -12.0, -96.0], [48.0, -11.0, -68.0], [50.0, 1.0, -62.0]);
    let mut bones: Vec<Shape> =
        (0..3).flat_map(|i| [plate(upper[i], lower[i], lower[i + 1], 4.5), plate(upper[i], lower[i + 1], upper[i + 1], 4.5)]).collect();
    let (front, coronoid) = ([39.0, -34.0, -88.0], [47.0, -27.0, -56.0]);
    bones.extend([
        // Chin.
        cone([0.0, -88.0, -114.0], [9.0, -85.0, -115.0], [5.5, 5.0]),
        // Ramus with coronoid process, mandibular notch and condyle.
        plate(upper[3], lower[3], front, 4.0),
        plate(front, lower[3], gonion, 3.5),
        plate(front, gonion, neck, 3.0),
        plate(front, neck, notch, 3.0),
        plate(front, notch, coronoid, 2.5),
        cone([44.0, 2.0, -58.5], [56.0, 2.0, -58.5], [4.0, 4.0]),
    ]);
    bones
}

/// Eight teeth of one side, from the central incisor back; `scale` of the upper arch, middle of the crowns at `z_mm`.
fn teeth(scale: f64, z_mm: f64) -> Vec<Shape> {
    // Mesiodistal and buccolingual breadths of a typical adult's upper teeth.
    const BREADTHS_MM: [[f64; 2]; 8] = [[8.3, 5.5], [6.5, 5.5], [7.5, 7.5], [6.8, 8.5], [6.6, 8.5], [10.0, 10.5], [9.6, 10.5], [8.4, 10.0]];
    let mut from = 0.0;
    let tooth = |[along, across]: [f64; 2]| {
        let (centre, tangent) = arch(from + 0.5 * along, scale);
        from += along;
        let t = tangent.extend(0.0);
        // A gap of 0.5 mm keeps neighbours apart.
        let half_mm = dvec3(0.5 * along * scale - 0.25, 0.5 * across, 5.5);
        let axes = DMat3::from_cols(t, DVec3::Z.cross(t), DVec3::Z);
        Shape::RoundBox { centre: centre.extend(z_mm), axes, half_mm, edge_mm: 1.5 }
    };
    BREADTHS_MM.into_iter().map(tooth).collect()
}

/// Point and unit tangent of the dental arch, `s_mm` (before `scale`) from the midline: half an ellipse, then straight back.
fn arch(s_mm: f64, scale: f64) -> (DVec2, DVec2) {
    const STEPS: usize = 256;
    let (half_width, length, back) = (28.0, 40.0, -45.0);
    let at = |angle: f64| DVec2::new(half_width * angle.sin(), back - length * angle.cos());
    let mut left = s_mm;
    let mut p = at(0.0);
    for i in 1..=STEPS {
        let q = at(std::f64::consts::FRAC_PI_2 * i as f64 / STEPS as f64);
        let step = p.distance(q);
        if step >= left {
            return (anchored(p + (q - p) * (left / step), scale), (q - p) / step);
        }
        left -= step;
        p = q;
    }
    (anchored(p + left * DVec2::Y, scale), DVec2::Y)
}

/// Scales the arch about its back end, where upper and lower molars meet.
fn anchored(p: DVec2, scale: f64) -> DVec2 {
    let back = DVec2::new(0.0, -32.0);
    back + scale * (p - back)
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
