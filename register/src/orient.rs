//! How a skull is held: in the Frankfurt horizontal by its points, and about the plane that makes it most like its own mirror image.

use crate::anywhere::{self, Found};
use crate::cloud::{Cloud, LEAST_POINTS, POINTS};
use crate::motion::turn_deg;
use crate::part::Parts;
use crate::surfaces::Pair;
use crate::symmetric;
use bregma_field::{Cancelled, Progress, Surface, SurfaceError};
use bregma_measure::landmarks::Landmark;
use glam::{DAffine3, DMat3, DQuat, DVec3};
use thiserror::Error;

/// Why a skull cannot be held so.
#[derive(Debug, Error)]
pub enum OrientError {
    /// Points are not there.
    #[error("the Frankfurt horizontal needs porion left, porion right and orbitale left (po, or; L, R); set {}", .0.join(", "))]
    Missing(Vec<&'static str>),
    /// Points on a line.
    #[error("both poria and the orbitale lie on a line, which is no plane; look at them")]
    Flat,
    /// A scan without a surface.
    #[error("almost nothing of the scan has a surface at this isovalue; choose another isovalue")]
    NoSurface,
    /// A grid that cannot be.
    #[error("the transform of the scan cannot be used: {0}")]
    Surface(#[from] SurfaceError),
    /// Stopped by request.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// A skull in the Frankfurt horizontal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frankfurt {
    /// Turns it so about the middle of the poria: their line from right to left along x, the plane square to z.
    pub pose: DAffine3,
    /// Standard deviations of the turns about x, y and z, degrees, where each coordinate of a point is set to `pick_mm` (standard deviation).
    pub deviation_deg: DVec3,
    /// How far the right orbitale lies above the plane, mm, where it is set; it takes no part.
    pub right_orbitale_mm: Option<f64>,
}

/// A point of one side, by the usual names: "porion left", "po-L", "Or_r".
fn point(landmarks: &[Landmark], names: [&str; 2], side: [&str; 2]) -> Option<DVec3> {
    let is_it = |l: &&Landmark| {
        let lower = l.name.to_lowercase();
        let words: Vec<&str> = lower.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty()).collect();
        words.len() == 2 && words.iter().any(|w| names.contains(w)) && words.iter().any(|w| side.contains(w))
    };
    landmarks.iter().find(is_it)?.point_mm.filter(|p| p.is_finite())
}

const LEFT: [&str; 2] = ["left", "l"];
const RIGHT: [&str; 2] = ["right", "r"];
const PORION: [&str; 2] = ["porion", "po"];
const ORBITALE: [&str; 2] = ["orbitale", "or"];

/// The Frankfurt horizontal: the plane through both poria and the left orbitale (Frankfurter Verständigung, 1884).
///
/// ```text
///          or          front: −y        the plane lies in the page; z points to the reader
///          │ d
///  po ─────┴───── po   left: +x
///          w
/// ```
/// Each coordinate of a pick is off by `pick_mm`: the roll about the front by √2·pick/w, and the pitch about the poria by √1.5·pick/d.
pub fn frankfurt(landmarks: &[Landmark], pick_mm: f64) -> Result<Frankfurt, OrientError> {
    let found = [point(landmarks, PORION, LEFT), point(landmarks, PORION, RIGHT), point(landmarks, ORBITALE, LEFT)];
    let [Some(left), Some(right), Some(orbitale)] = found else {
        let names = ["porion left", "porion right", "orbitale left"];
        return Err(OrientError::Missing(names.into_iter().zip(found).filter(|(_, p)| p.is_none()).map(|(name, _)| name).collect()));
    };
    let middle = 0.5 * (left + right);
    let width_mm = left.distance(right);
    let x = (left - right).try_normalize().ok_or(OrientError::Flat)?;
    let ahead = (orbitale - middle).reject_from_normalized(x);
    // A thousandth of the width is what no one could pick.
    let y = -ahead.try_normalize().filter(|_| ahead.length() > 1e-3 * width_mm).ok_or(OrientError::Flat)?;
    let z = x.cross(y);
    // The rows are what becomes x, y and z.
    let turn = DMat3::from_cols(x, y, z).transpose();
    let pose = DAffine3::from_mat3_translation(turn, middle - turn * middle);
    let (pitch, roll) = (1.5_f64.sqrt() * pick_mm / ahead.length(), 2.0_f64.sqrt() * pick_mm / width_mm);
    Ok(Frankfurt {
        pose,
        deviation_deg: DVec3::new(pitch.to_degrees(), roll.to_degrees(), roll.to_degrees()),
        right_orbitale_mm: point(landmarks, ORBITALE, RIGHT).map(|p| z.dot(p - middle)),
    })
}

/// A plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// A point of it, LPS mm.
    pub point_mm: DVec3,
    /// Unit, toward the left where it is sagittal.
    pub normal: DVec3,
}

impl Plane {
    /// Between two planes, degrees, 0 to 90.
    pub fn angle_deg(&self, other: &Self) -> f64 {
        self.normal.dot(other.normal).abs().min(1.0).acos().to_degrees()
    }

    /// Turns it by the shortest way so that it is square to x, about its point nearest to the world's origin.
    pub fn upright(&self) -> DAffine3 {
        let turn = DMat3::from_quat(DQuat::from_rotation_arc(self.normal, DVec3::X));
        let pivot = self.normal * self.normal.dot(self.point_mm);
        DAffine3::from_mat3_translation(turn, pivot - turn * pivot)
    }
}

/// The plane of least squares through points of the midline; none through fewer than three, or on a line.
pub fn midsagittal(points: &[DVec3]) -> Option<Plane> {
    let middle = points.iter().sum::<DVec3>() / points.len().max(1) as f64;
    let mut moments = [[0.0; 3]; 3];
    points.iter().for_each(|p| symmetric::add_outer(&mut moments, &(*p - middle).to_array(), 1.0));
    let (values, vectors) = symmetric::eigen(&moments);
    // On a line any plane through it is as good: a thousandth of the length beside it, squared, is none.
    let is_plane = points.len() >= 3 && values[1] > 1e-6 * values[2];
    is_plane.then(|| Plane { point_mm: middle, normal: leftward(DVec3::from(vectors[0])) })
}

fn leftward(normal: DVec3) -> DVec3 {
    if normal.x < 0.0 { -normal } else { normal }
}

/// The plane about which a surface is most like its mirror image.
#[derive(Clone, Debug)]
pub struct Symmetry {
    /// The plane.
    pub plane: Plane,
    /// Mirrors the scan and lays its image onto it: a reflection and what it turns beside.
    pub image: DAffine3,
    /// How the mirror image lies on the surface.
    pub found: Found,
    /// What the mirrored pose turns beside mirroring, degrees: 0 but for rounding and what is not symmetric.
    pub twist_deg: f64,
}

/// Mirrors a surface and brings the image back onto it. The plane is biased by what is really asymmetric (Cheng and Leow 2012).
pub fn symmetry(surface: &Surface, parts: &Parts, progress: &Progress) -> Result<Symmetry, OrientError> {
    let cloud = Cloud::of(surface, POINTS, progress)?;
    if cloud.points.len() < LEAST_POINTS {
        return Err(OrientError::NoSurface);
    }
    // First mirrored about the sagittal plane through its middle.
    let middle = cloud.middle;
    let flip = DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0));
    let mirror = DAffine3::from_mat3_translation(flip, middle - flip * middle);
    let image = Surface { grid: surface.grid.moved(mirror).map_err(SurfaceError::from)?, ..surface.clone() };
    let image = Cloud::of(&image, POINTS, progress)?;
    let pair = Pair { moving: &image, fixed: &cloud, parts };
    // Where a side is missing, the scan's box may lie about its plane better than what is left.
    let of_box = (0.125 * surface.grid.corners_mm().into_iter().sum::<DVec3>() - middle).x;
    let starts = [0.0, of_box].map(|x_mm| DAffine3::from_translation(2.0 * x_mm * DVec3::X));
    let [of_points, of_box] = starts.map(|start| anywhere::from(&pair, Some(start), progress));
    let (of_points, of_box) = (of_points?, of_box?);
    let found = if of_box.agreement > of_points.agreement { of_box } else { of_points };
    let whole = found.fit.pose * mirror;
    // A reflection turns its normal round, and moves a point by twice its distance from the plane.
    let matrix = whole.matrix3;
    let even = 0.5 * (matrix + matrix.transpose());
    let rows = even.transpose().to_cols_array_2d();
    let (_, vectors) = symmetric::eigen(&rows);
    let normal = leftward(DVec3::from(vectors[0]));
    let point_mm = 0.5 * (middle + whole.transform_point3(middle));
    let twist_deg = 0.5 * turn_deg(matrix * matrix);
    Ok(Symmetry { plane: Plane { point_mm, normal }, image: whole, found, twist_deg })
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_synthetic::{Random, Which, skull};
    use std::sync::Arc;

    fn direction(random: &mut Random) -> DVec3 {
        (DVec3::new(random.unit(), random.unit(), random.unit()) - 0.5).normalize()
    }

    fn turn(random: &mut Random, deg: f64) -> DAffine3 {
        let turn = DQuat::from_axis_angle(direction(random), deg.to_radians());
        DAffine3::from_rotation_translation(turn, 30.0 * direction(random))
    }

    const HELD: [(&str, [f64; 3]); 4] = [
        ("porion left", [60.0, 0.0, 0.0]),
        ("Po_R", [-60.0, 0.0, 0.0]),
        ("or-L", [35.0, -75.0, 0.0]),
        ("orbitale r.", [-35.0, -76.0, 2.0]),
    ];

    fn landmarks(pose: &DAffine3) -> Vec<Landmark> {
        HELD.iter().map(|(name, p)| Landmark::at(*name, pose.transform_point3((*p).into()))).collect()
    }

    #[test]
    fn a_skull_in_any_pose_is_held_level_and_faces_forward() {
        // Fails if axes are exchanged, the skull hangs upside down or faces back, names are not found, or the right orbitale takes part.
        let mut random = Random(8);
        for n in 0..100 {
            let pose = turn(&mut random, 1.8 * f64::from(n));
            let points = landmarks(&pose);
            let found = frankfurt(&points, 1.0).unwrap();
            let middle = pose.transform_point3(DVec3::ZERO);
            for (l, (name, p)) in points.iter().zip(HELD) {
                let at = found.pose.transform_point3(l.point_mm.unwrap()) - middle;
                assert!(at.distance(p.into()) < 1e-9, "{name}: {at}");
            }
            assert!((found.right_orbitale_mm.unwrap() - 2.0).abs() < 1e-9);
        }
    }

    #[test]
    fn what_picks_leave_open_is_told() {
        // Fails if the pitch or the roll is not what points of that scatter make of it.
        let mut random = Random(9);
        let mut normal = || (-2.0 * (1.0 - random.unit()).ln()).sqrt() * (std::f64::consts::TAU * random.unit()).cos();
        let told = frankfurt(&landmarks(&DAffine3::IDENTITY), 1.0).unwrap().deviation_deg;
        let mut squares = DVec3::ZERO;
        let count = 4_000;
        for _ in 0..count {
            let mut points = landmarks(&DAffine3::IDENTITY);
            points.iter_mut().for_each(|l| *l.point_mm.as_mut().unwrap() += DVec3::new(normal(), normal(), normal()));
            let turned = DQuat::from_mat3(&frankfurt(&points, 1.0).unwrap().pose.matrix3).to_scaled_axis();
            squares += turned * turned;
        }
        let found = DVec3::from((squares / f64::from(count)).to_array().map(f64::sqrt)) * 180.0 / std::f64::consts::PI;
        println!("picks of 1 mm: turns by {found:.3}° about x, y and z; told {told:.3}°");
        assert!((found / told - 1.0).abs().max_element() < 0.05, "{found} {told}");
    }

    #[test]
    fn what_is_missing_or_flat_is_said() {
        // Fails if a plane is made of two points, of points on a line, or of one that was never set.
        let mut points = landmarks(&DAffine3::IDENTITY);
        points[2].point_mm = None;
        let said = frankfurt(&points, 1.0).unwrap_err().to_string();
        assert!(said.contains("orbitale left") && said.ends_with("set orbitale left"), "{said}");
        points[2].point_mm = Some(DVec3::X * 500.0);
        assert!(matches!(frankfurt(&points, 1.0), Err(OrientError::Flat)));
        assert_eq!(midsagittal(&[DVec3::Y, DVec3::Y * 2.0, DVec3::Y * 5.0]), None);
    }

    #[test]
    fn the_plane_of_a_turned_skull_is_found() {
        // Fails if the reflection's plane is taken for another, at a wrong place, or its twist is not told.
        let volume = Arc::new(skull(Which::A, 96, &Progress::default()).unwrap());
        let mut random = Random(10);
        for _ in 0..2 {
            let pose = turn(&mut random, 12.0);
            let surface = Surface::new(&volume, 226.0, pose).unwrap();
            let found = symmetry(&surface, &Parts::default(), &Progress::default()).unwrap();
            // The phantom is built about x = 0, but for its burr hole and noise.
            let truth = Plane { point_mm: pose.transform_point3(DVec3::ZERO), normal: pose.transform_vector3(DVec3::X) };
            let off_mm = (found.plane.point_mm - truth.point_mm).dot(truth.normal).abs();
            println!("plane off by {:.3}° and {off_mm:.3} mm, twist {:.4}°", found.plane.angle_deg(&truth), found.twist_deg);
            let point = pose.transform_point3(DVec3::new(40.0, -30.0, 12.0));
            let image = pose.transform_point3(DVec3::new(-40.0, -30.0, 12.0));
            assert!(found.image.transform_point3(point).distance(image) < 0.3, "the image of the left is the right");
            assert!(found.plane.angle_deg(&truth) < 0.1 && off_mm < 0.1 && found.twist_deg < 0.1);
            let held = found.plane.upright();
            assert!(held.transform_vector3(found.plane.normal).distance(DVec3::X) < 1e-12);
        }
        let points = [DVec3::new(0.1, 0.0, 0.0), DVec3::new(-0.1, 50.0, 0.0), DVec3::new(0.0, 0.0, 70.0), DVec3::new(0.0, 40.0, 60.0)];
        let plane = midsagittal(&points).unwrap();
        assert!(plane.angle_deg(&Plane { point_mm: DVec3::ZERO, normal: DVec3::X }) < 0.3);
    }
}
