//! The solids of face, base and jaws, left half: where they lie and how thick they are, mm. World as in `skull.rs`.

use crate::arch::{Arch, Bent};
use crate::sdf::{RoundCone, Shape};
use glam::{DMat3, DVec3, dvec3};

/// Middle of the orbit's opening.
pub const ORBIT_RIM: DVec3 = dvec3(33.5, -73.5, -27.0);
/// Outward normal of the opening: its lateral edge lies behind its medial one.
pub const ORBIT_OUT: DVec3 = dvec3(0.496, -0.868, 0.0);

/// What stands out of the vault.
pub fn cranium() -> Vec<Shape> {
    let mut bones = face();
    bones.extend(base());
    bones
}

fn face() -> Vec<Shape> {
    vec![
        orbit_rim(),
        // Glabella and brow ridge.
        Shape::tube(&[[0.0, -83.0, -6.0, 7.0], [12.0, -83.5, -5.5, 6.5], [25.0, -80.0, -3.0, 5.5], [38.0, -73.0, -5.0, 5.0]]),
        // Zygomatic process of the frontal bone and the temporal line above it.
        Shape::tube(&[[46.0, -66.0, -13.0, 5.0], [45.0, -60.0, -4.0, 5.0], [45.0, -52.0, 6.0, 4.0], [46.5, -44.0, 18.0, 3.0]]),
        // Nasal bones; frontal process of the maxilla; edge of the nasal aperture down to the spine.
        Shape::tube(&[[1.5, -82.0, -6.0, 5.5], [2.5, -87.0, -14.0, 4.0], [2.5, -91.0, -22.0, 3.6], [3.0, -96.0, -31.0, 2.8]]),
        Shape::tube(&[[7.0, -83.0, -9.0, 5.0], [9.0, -85.0, -20.0, 4.2], [11.5, -85.0, -32.0, 4.2], [15.5, -82.0, -46.0, 4.6]]),
        Shape::tube(&[[15.5, -82.0, -44.0, 4.5], [15.0, -82.0, -54.0, 4.5], [10.0, -84.0, -64.0, 4.5], [0.0, -85.5, -67.0, 4.0]]),
        // Zygomatic bone, its arch to the root above the ear, and its buttress to the first molar.
        Shape::tube(&[[47.0, -63.0, -40.0, 6.5], [46.0, -64.0, -47.0, 7.0], [38.0, -68.0, -51.0, 6.5], [27.0, -75.0, -51.0, 5.0]]),
        Shape::tube(&[
            [47.0, -63.0, -46.0, 6.5],
            [56.0, -54.0, -46.0, 5.0],
            [63.0, -40.0, -45.0, 4.0],
            [66.0, -24.0, -44.0, 3.6],
            [66.0, -10.0, -43.5, 3.6],
            [63.0, 3.0, -43.0, 4.2],
            [58.0, 14.0, -41.0, 5.5],
        ]),
        Shape::tube(&[[43.0, -64.0, -49.0, 6.5], [36.0, -59.0, -57.0, 5.5], [32.0, -55.0, -66.0, 5.0]]),
        // Maxilla: its wall along the arch of the teeth, and the palate.
        Shape::Bent(Bent::new(
            upper_arch(),
            &[
                [-8.0, -77.0],
                [20.0, -77.0],
                [45.0, -76.5],
                [62.0, -74.0],
                [63.0, -64.0],
                [60.0, -52.0],
                [40.0, -46.0],
                [20.0, -46.0],
                [-8.0, -50.0],
            ],
            [6.0, 6.5],
            [20.0, 50.0],
        )),
        block([0.0, -62.0, -66.0], DMat3::IDENTITY, [24.0, 19.0, 2.2], 2.2),
    ]
}

fn base() -> Vec<Shape> {
    vec![
        // Greater wing of the sphenoid, behind the orbit; body of the sphenoid and clivus; pterygoid plate.
        Shape::tube(&[[45.0, -62.0, -20.0, 5.0], [44.0, -46.0, -22.0, 5.0], [43.0, -30.0, -26.0, 6.0]]),
        Shape::tube(&[[0.0, 6.0, -58.0, 10.0], [0.0, -16.0, -51.0, 10.0], [0.0, -38.0, -44.0, 9.0]]),
        Shape::tube(&[[15.0, -36.0, -46.0, 3.5], [17.0, -37.0, -60.0, 3.0], [18.0, -38.0, -73.0, 2.6]]),
        // Petrous bone, roof of the jaw's joint and its tubercle.
        Shape::tube(&[[54.0, 12.0, -42.0, 7.5], [38.0, 10.0, -44.5, 7.5], [20.0, -2.0, -51.0, 7.0]]),
        Shape::tube(&[[62.0, -8.0, -44.0, 4.5], [52.0, -10.0, -45.5, 5.0], [42.0, -10.0, -44.0, 6.0]]),
        // Mastoid and styloid process; crest above them.
        Shape::tube(&[[53.0, 24.0, -38.0, 13.0], [53.0, 22.0, -52.0, 11.0], [51.0, 18.0, -64.0, 8.0], [49.0, 15.0, -73.0, 4.5]]),
        Shape::tube(&[[44.0, 15.0, -52.0, 4.0], [42.0, 11.0, -65.0, 2.2], [39.0, 6.0, -80.0, 1.5]]),
        Shape::tube(&[[58.0, 12.0, -41.0, 5.0], [60.0, 26.0, -35.0, 4.0], [57.0, 40.0, -27.0, 3.0]]),
        // Occipital condyle; external protuberance and nuchal line.
        Shape::tube(&[[12.0, 8.0, -66.0, 4.5], [16.0, 16.0, -69.5, 5.0], [18.0, 24.0, -68.0, 4.5]]),
        Shape::tube(&[[0.0, 86.5, -22.0, 5.0], [12.0, 84.0, -23.0, 3.6], [32.0, 73.0, -27.0, 3.2], [48.0, 56.0, -32.0, 3.0]]),
    ]
}

/// A ring around the orbit's opening, thicker above and at the side.
fn orbit_rim() -> Shape {
    let aside = dvec3(-ORBIT_OUT.y, ORBIT_OUT.x, 0.0);
    let at = |n: i32| {
        let angle = f64::from(n) * std::f64::consts::TAU / 16.0;
        let (sine, cosine) = angle.sin_cos();
        // Between an ellipse and a rectangle: powers of 2.6 sum to 1, and not squares.
        let square = |x: f64| x.abs().powf(2.0 / 2.6).copysign(x);
        let p = ORBIT_RIM + 22.0 * square(cosine) * aside + 19.8 * square(sine) * DVec3::Z;
        [p.x, p.y, p.z, 4.5 + 0.6 * sine + 0.8 * cosine]
    };
    // Once around, and the first span again: a Catmull–Rom line turns at its ends.
    Shape::tube(&(-1..=18).map(at).collect::<Vec<_>>())
}

/// Parts of the nose that stand within its opening: septum and anterior spine.
pub fn nose() -> Vec<Shape> {
    vec![
        plate([0.0, -76.0, -36.0], [0.0, -80.0, -62.0], [0.0, -48.0, -62.0], 0.9),
        plate([0.0, -76.0, -36.0], [0.0, -48.0, -62.0], [0.0, -48.0, -44.0], 0.9),
        Shape::tube(&[[0.0, -82.0, -64.0, 3.2], [0.0, -88.0, -63.5, 2.4], [0.0, -93.0, -62.0, 1.4]]),
    ]
}

/// Holes of vessels, nerves and the ear.
pub fn canals() -> Vec<Shape> {
    vec![
        // External auditory meatus; infraorbital foramen.
        Shape::tube(&[[78.0, 12.0, -48.0, 5.0], [58.0, 10.5, -47.0, 4.5], [46.0, 9.0, -46.0, 3.5]]),
        Shape::tube(&[[29.0, -92.0, -57.0, 2.0], [28.0, -76.0, -53.0, 2.0]]),
    ]
}

/// The mandible without teeth.
pub fn mandible() -> Vec<Shape> {
    let outline = [
        // Upper edge from the midline back, front edge of the ramus, coronoid process, notch, condyle.
        [-12.0, -93.5],
        [15.0, -93.5],
        [40.0, -93.0],
        [59.0, -91.0],
        [67.0, -86.0],
        [71.0, -76.0],
        [74.5, -65.0],
        [78.0, -57.0],
        [82.5, -54.5],
        [87.0, -58.5],
        [90.5, -66.0],
        [94.5, -68.0],
        [97.0, -64.0],
        [100.0, -57.5],
        [107.0, -57.5],
        // Back edge, angle, lower edge.
        [107.5, -65.0],
        [104.0, -78.0],
        [100.5, -91.0],
        [96.5, -102.5],
        [87.0, -108.5],
        [72.0, -109.5],
        [60.0, -112.5],
        [40.0, -117.0],
        [20.0, -120.0],
        [0.0, -119.0],
        [-12.0, -119.5],
    ];
    vec![
        Shape::Bent(Bent::new(Arch::new(-81.5, 24.0, 68.0), &outline, [5.6, 3.6], [50.0, 92.0])),
        // Chin; lower edge; oblique line from the body up to the ramus; condyle.
        Shape::tube(&[[0.0, -86.0, -113.0, 5.5], [9.0, -84.5, -114.5, 5.0], [17.0, -78.0, -115.0, 5.0]]),
        Shape::tube(&[[33.0, -50.0, -101.0, 6.0], [37.0, -38.0, -96.0, 5.0], [40.0, -31.0, -86.0, 4.0], [41.5, -28.0, -75.0, 3.0]]),
        Shape::tube(&[[44.5, -1.5, -60.5, 3.6], [50.5, 1.0, -59.0, 4.4], [57.0, 3.0, -59.5, 4.0]]),
    ]
}

/// Line through the middles of the upper teeth.
fn upper_arch() -> Arch {
    Arch::new(-84.5, 25.0, 76.0)
}

/// Mesiodistal and buccolingual breadths and heights of crowns of typical adults, from the central incisor back.
const UPPER_MM: [[f64; 3]; 8] = [
    [8.4, 6.4, 11.5],
    [6.6, 6.2, 10.5],
    [7.5, 7.8, 11.5],
    [6.9, 8.6, 10.0],
    [6.7, 8.6, 10.0],
    [10.0, 10.5, 10.0],
    [9.6, 10.5, 10.0],
    [8.4, 10.0, 9.5],
];
const LOWER_MM: [[f64; 3]; 8] = [
    [5.4, 5.8, 10.5],
    [5.9, 6.0, 10.5],
    [6.8, 7.4, 11.5],
    [7.0, 7.8, 10.5],
    [7.1, 8.0, 10.0],
    [11.0, 10.0, 9.5],
    [10.5, 10.0, 9.5],
    [9.8, 9.5, 9.0],
];

/// Eight upper teeth, which end at the plane in which the jaws close.
pub fn upper_teeth() -> Vec<Shape> {
    teeth(upper_arch(), &UPPER_MM, BITE_Z_MM + 0.5, 1.0)
}

/// Eight lower teeth.
pub fn lower_teeth() -> Vec<Shape> {
    teeth(Arch::new(-81.5, 23.5, 75.0), &LOWER_MM, BITE_Z_MM - 0.5, -1.0)
}

/// Where upper and lower teeth would touch.
const BITE_Z_MM: f64 = -83.5;
/// Between neighbouring crowns; and how far teeth reach into the jaw beneath the crown.
const GAP_MM: f64 = 0.4;
const ROOT_MM: f64 = 4.0;

/// Teeth of one side along `arch`, whose crowns begin at `edge_z` and go `up`.
fn teeth(arch: Arch, sizes_mm: &[[f64; 3]], edge_z: f64, up: f64) -> Vec<Shape> {
    let mut from = 0.0;
    let tooth = |[along, across, high]: &[f64; 3]| {
        let (centre, tangent) = arch.at(from + 0.5 * along);
        from += along;
        let t = tangent.extend(0.0);
        let half_mm = dvec3(0.5 * (along - GAP_MM), 0.5 * across, 0.5 * (high + ROOT_MM));
        let axes = DMat3::from_cols(t, DVec3::Z.cross(t), DVec3::Z);
        Shape::RoundBox { centre: centre.extend(edge_z + up * half_mm.z), axes, half_mm, edge_mm: 0.6 * half_mm.x.min(half_mm.y) }
    };
    sizes_mm.iter().map(tooth).collect()
}

/// A round cone between two balls.
pub fn cone(a: [f64; 3], b: [f64; 3], radii_mm: [f64; 2]) -> RoundCone {
    RoundCone::new(a.into(), b.into(), radii_mm)
}

fn plate(a: [f64; 3], b: [f64; 3], c: [f64; 3], radius_mm: f64) -> Shape {
    Shape::Plate { corners: [a.into(), b.into(), c.into()], radius_mm }
}

fn block(centre: [f64; 3], axes: DMat3, half_mm: [f64; 3], edge_mm: f64) -> Shape {
    Shape::RoundBox { centre: centre.into(), axes, half_mm: half_mm.into(), edge_mm }
}
