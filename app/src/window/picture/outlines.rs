//! Lines that show where cuts and boxes lie: around them in the picture, and where they meet a slice.

use bregma_field::Grid;
use bregma_renderer::{Camera, Projection, Shape};
use glam::DVec3;
use std::f64::consts::TAU;

/// Points that follow each other on a line, LPS mm.
pub type Line = Vec<DVec3>;

/// So many sides of a polygon look round.
const SIDES: usize = 72;

/// A box along the world's axes around all of `grids`; none around nothing.
pub fn around(grids: &[Grid]) -> Option<[DVec3; 2]> {
    let corners = grids.iter().flat_map(Grid::corners_mm);
    corners.map(|corner| [corner; 2]).reduce(|[low, high], [a, b]| [low.min(a), high.max(b)])
}

/// The lines of a cut in a picture by `camera`; what is endless ends with the box `shown`.
pub fn of_cut(shape: &Shape, shown: [DVec3; 2], camera: &Camera) -> Vec<Line> {
    match *shape {
        Shape::Plane { normal, offset_mm } => vec![plane_in_box(normal, offset_mm, shown)],
        Shape::Box { low_mm, high_mm } => edges(&corners([low_mm, high_mm])).map(Line::from).into(),
        Shape::Cylinder { centre_mm, axis, radius_mm } => {
            let along = corners(shown).map(|corner| (corner - centre_mm).dot(axis));
            let ends = [along.into_iter().fold(f64::INFINITY, f64::min), along.into_iter().fold(f64::NEG_INFINITY, f64::max)];
            let (u, v) = axis.any_orthonormal_pair();
            let circles = ends.map(|end| circle(centre_mm + end * axis, radius_mm * u, radius_mm * v));
            // Its sides, as they are seen.
            let across = axis.cross(camera.basis().forward).try_normalize().unwrap_or(u);
            let sides = [-1.0, 1.0].map(|side| ends.map(|end| centre_mm + end * axis + side * radius_mm * across).into());
            circles.into_iter().chain(sides).collect()
        }
        Shape::Sphere { centre_mm, radius_mm } => {
            let [x, y, z] = DVec3::AXES.map(|axis| radius_mm * axis);
            [[x, y], [y, z], [z, x]].map(|[u, v]| circle(centre_mm, u, v)).into()
        }
    }
}

/// The lines on which the surface of a cut meets the plane through `at_mm` with the unit normal `normal`.
pub fn on_plane(shape: &Shape, normal: DVec3, at_mm: DVec3, reach_mm: f64) -> Vec<Line> {
    match *shape {
        // A plane's line is drawn, and held, by itself.
        Shape::Plane { .. } => vec![],
        Shape::Box { low_mm, high_mm } => vec![plane_in_box(normal, normal.dot(at_mm), [low_mm, high_mm])],
        Shape::Cylinder { centre_mm, axis, radius_mm } => of_cylinder(centre_mm, axis, radius_mm, normal, at_mm, reach_mm),
        Shape::Sphere { centre_mm, radius_mm } => {
            let away_mm = normal.dot(centre_mm - at_mm);
            let (u, v) = normal.any_orthonormal_pair();
            let radius_mm = (radius_mm * radius_mm - away_mm * away_mm).sqrt();
            if radius_mm > 0.0 { vec![circle(centre_mm - away_mm * normal, radius_mm * u, radius_mm * v)] } else { vec![] }
        }
    }
}

/// An ellipse; two lines as long as `reach_mm` on either side where the plane lies along the axis.
fn of_cylinder(centre_mm: DVec3, axis: DVec3, radius_mm: f64, normal: DVec3, at_mm: DVec3, reach_mm: f64) -> Vec<Line> {
    let slope = normal.dot(axis);
    let across = axis.cross(normal).normalize_or(axis.any_orthonormal_vector());
    // An ellipse a thousand times as long as wide is two lines within any view.
    if slope.abs() > 1e-3 {
        let middle = centre_mm + normal.dot(at_mm - centre_mm) / slope * axis;
        let long = (axis - slope * normal).normalize_or(normal.cross(across));
        return vec![circle(middle, radius_mm * across, radius_mm / slope * long)];
    }
    let away_mm = normal.dot(centre_mm - at_mm);
    let half = (radius_mm * radius_mm - away_mm * away_mm).sqrt();
    if half.is_nan() {
        return vec![];
    }
    let foot = centre_mm - away_mm * normal;
    let foot = foot + (at_mm - foot).dot(axis) * axis;
    [-half, half].map(|side| [-reach_mm, reach_mm].map(|end| foot + side * across + end * axis).into()).into()
}

/// Where a plane cuts a box along the world's axes: a closed polygon; nothing where it misses.
pub fn plane_in_box(normal: DVec3, offset_mm: f64, shown: [DVec3; 2]) -> Line {
    let crossing = |[a, b]: [DVec3; 2]| {
        let [below, above] = [a, b].map(|end| normal.dot(end) - offset_mm);
        ((below < 0.0) != (above < 0.0)).then(|| a + below / (below - above) * (b - a))
    };
    let mut points: Line = edges(&corners(shown)).into_iter().filter_map(crossing).collect();
    let middle = points.iter().sum::<DVec3>() / points.len().max(1) as f64;
    let (u, v) = normal.any_orthonormal_pair();
    let angle = |p: &DVec3| (*p - middle).dot(v).atan2((*p - middle).dot(u));
    points.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
    points.extend(points.first().copied());
    points
}

/// The corners of a box along the world's axes, as those of a grid are counted: x by the first bit, y by the second, z by the third.
fn corners([low, high]: [DVec3; 2]) -> [DVec3; 8] {
    std::array::from_fn(|c| DVec3::from_array(std::array::from_fn(|axis| if c >> axis & 1 == 1 { high[axis] } else { low[axis] })))
}

/// The ends of the twelve edges of a box with these corners.
pub fn edges(corners: &[DVec3; 8]) -> [[DVec3; 2]; 12] {
    std::array::from_fn(|n| edge(n).map(|c| corners[c]))
}

/// The corners of edge number `n`: four along each axis.
fn edge(n: usize) -> [usize; 2] {
    let (axis, k) = (n / 4, n % 4);
    let from = (k & 1) << ((axis + 1) % 3) | (k >> 1) << ((axis + 2) % 3);
    [from, from | 1 << axis]
}

/// The edges of the box of a scan with these corners, and whether each lies behind the box itself: both faces that meet there are turned away.
pub fn box_edges(corners: &[DVec3; 8], camera: &Camera) -> [([DVec3; 2], bool); 12] {
    let middle = corners.iter().sum::<DVec3>() / 8.0;
    let is_away = |axis: usize, is_high: bool| {
        let of_face = (0..8).filter(|c| (c >> axis & 1 == 1) == is_high);
        let on_face = of_face.map(|c| corners[c]).sum::<DVec3>() / 4.0;
        let [u, v] = [1, 2].map(|k| corners[1 << ((axis + k) % 3)] - corners[0]);
        let normal = u.cross(v);
        let outward = normal * (on_face - middle).dot(normal).signum();
        let view = match camera.projection {
            Projection::Perspective { .. } => on_face - camera.eye_mm,
            Projection::Orthographic { .. } => camera.basis().forward,
        };
        outward.dot(view) > 0.0
    };
    std::array::from_fn(|n| {
        let (axis, [from, to]) = (n / 4, edge(n));
        let hidden = [1, 2].map(|k| (axis + k) % 3).iter().all(|&across| is_away(across, from >> across & 1 == 1));
        ([corners[from], corners[to]], hidden)
    })
}

fn circle(centre: DVec3, u: DVec3, v: DVec3) -> Line {
    let at = |n: usize| (TAU * n as f64 / SIDES as f64).sin_cos();
    (0..=SIDES).map(at).map(|(sin, cos)| centre + cos * u + sin * v).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_renderer::{Bounds, Clip};

    const SHOWN: [DVec3; 2] = [DVec3::new(-40.0, -60.0, -20.0), DVec3::new(50.0, 30.0, 70.0)];

    fn shapes() -> [Shape; 4] {
        let axis = DVec3::new(0.3, -0.5, 1.0).normalize();
        [
            Shape::Plane { normal: axis, offset_mm: 12.0 },
            Shape::Box { low_mm: DVec3::new(-10.0, -15.0, -5.0), high_mm: DVec3::new(20.0, 10.0, 30.0) },
            Shape::Cylinder { centre_mm: DVec3::new(3.0, 4.0, 5.0), axis, radius_mm: 17.0 },
            Shape::Sphere { centre_mm: DVec3::new(3.0, 4.0, 5.0), radius_mm: 17.0 },
        ]
    }

    /// How far a point is from the surface of a cut, mm.
    fn away(shape: Shape, p: DVec3) -> f64 {
        match shape {
            Shape::Plane { normal, offset_mm } => normal.dot(p) - offset_mm,
            Shape::Box { low_mm, high_mm } => (p - low_mm).min(high_mm - p).min_element(),
            Shape::Cylinder { centre_mm, axis, radius_mm } => (p - centre_mm).reject_from_normalized(axis).length() - radius_mm,
            Shape::Sphere { centre_mm, radius_mm } => p.distance(centre_mm) - radius_mm,
        }
    }

    #[test]
    fn lines_lie_on_the_surface_of_their_cut_and_on_the_slice() {
        // Fails if a line is drawn beside the cut that it shows, or an endless one beside what is shown.
        let camera = Camera::orbit(&Bounds { centre_mm: DVec3::ZERO, radius_mm: 100.0 }, 30.0, 20.0);
        for shape in shapes() {
            let lines = of_cut(&shape, SHOWN, &camera);
            assert!(!lines.is_empty() && lines.iter().all(|line| line.len() >= 2), "{shape:?}");
            for p in lines.iter().flatten() {
                assert!(away(shape, *p).abs() < 1e-9, "{shape:?}: {p} is {} mm off", away(shape, *p));
            }
            let normals = [DVec3::Z, DVec3::X, DVec3::new(1.0, 2.0, -0.5).normalize(), DVec3::new(1.0, 0.6, 0.0).normalize()];
            for (n, normal) in normals.into_iter().enumerate() {
                let at_mm = DVec3::new(5.0, 2.0, 9.0);
                let lines = on_plane(&shape, normal, at_mm, 100.0);
                assert_eq!(lines.is_empty(), matches!(shape, Shape::Plane { .. }), "{shape:?} {n}");
                for p in lines.iter().flatten() {
                    assert!(away(shape, *p).abs() < 1e-9 && normal.dot(*p - at_mm).abs() < 1e-9, "{shape:?} on {normal}: {p}");
                }
            }
            assert!(on_plane(&shape, DVec3::Z, DVec3::new(0.0, 0.0, 500.0), 100.0).iter().flatten().all(|p| away(shape, *p).abs() < 1e-9));
        }
        // Along the axis of a cylinder: two lines, or none beside it.
        let tube = Clip::all(Shape::Cylinder { centre_mm: DVec3::ZERO, axis: DVec3::Z, radius_mm: 10.0 }).shape;
        let lines = on_plane(&tube, DVec3::Y, DVec3::new(0.0, 6.0, 0.0), 50.0);
        assert_eq!(lines.iter().map(|line| line[0].x.abs()).collect::<Vec<_>>(), [8.0, 8.0]);
        assert!(on_plane(&tube, DVec3::Y, DVec3::new(0.0, 11.0, 0.0), 50.0).is_empty());
        assert!(on_plane(&shapes()[3], DVec3::Y, DVec3::new(0.0, 50.0, 0.0), 50.0).is_empty());
    }

    #[test]
    fn a_plane_through_a_box_is_a_closed_convex_polygon() {
        // Fails if a corner is missing or they are joined crosswise.
        for (normal, sides) in [(DVec3::Z, 4), (DVec3::ONE.normalize(), 6)] {
            let middle = 0.5 * (SHOWN[0] + SHOWN[1]);
            let polygon = plane_in_box(normal, normal.dot(middle), SHOWN);
            assert_eq!((polygon.len(), polygon.first()), (sides + 1, polygon.last()), "{polygon:?}");
            for n in 0..sides {
                let [a, b, c] = [0, 1, 2].map(|k| polygon[(n + k) % sides]);
                assert!((b - a).cross(c - b).dot(normal) > 0.0, "{polygon:?}");
            }
        }
        assert!(plane_in_box(DVec3::Z, 100.0, SHOWN).is_empty());
    }

    #[test]
    fn edges_are_hidden_where_both_their_faces_look_away() {
        // Fails if an edge that is seen is dim, or one behind the box is not: of all twelve three from a corner, and all but four from before a face.
        let corners = corners(SHOWN);
        for edge in edges(&corners) {
            assert_eq!((edge[1] - edge[0]).to_array().iter().filter(|d| **d > 0.0).count(), 1);
        }
        let bounds = Bounds { centre_mm: 0.5 * (SHOWN[0] + SHOWN[1]), radius_mm: 200.0 };
        for (azimuth_deg, elevation_deg, count) in [(30.0, 20.0, 3), (-60.0, -30.0, 3), (0.0, 0.0, 8)] {
            let camera = Camera::orbit(&bounds, azimuth_deg, elevation_deg);
            let hidden: Vec<_> = box_edges(&corners, &camera).into_iter().filter(|(_, hidden)| *hidden).map(|(edge, _)| edge).collect();
            assert_eq!(hidden.len(), count, "{azimuth_deg} {elevation_deg}");
            let depth = |p: DVec3| (p - camera.eye_mm).dot(camera.basis().forward);
            let farthest = corners.iter().map(|c| depth(*c)).fold(f64::NEG_INFINITY, f64::max);
            if count == 3 {
                assert!(hidden.iter().all(|edge| edge.iter().any(|p| depth(*p) == farthest)), "all three meet at the farthest corner");
            }
        }
    }
}
