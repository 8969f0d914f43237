//! How far a part lies from where the other scan has it: its own rigid motion, at each of its points.
//!
//! ```text
//!      p ●┄┄┄┄┄┄┄┄▶● q = motion · p      the difference is |q − p|, which has no sign
//! ```

use super::{Found, Map};
use crate::mesh::Mesh;
use crate::uncertainty::{EndError, Registered};
use glam::{DAffine3, DVec3};

/// Of a vector that errs alike in all directions, 95 of 100 lie in a ball of so many standard deviations along a line over 1.96: the roots of the
/// quantiles of χ² with three degrees of freedom, 7.815, and with one, 3.841.
const BALL: f64 = 1.4263;

/// The displacement of the points of a mesh that are asked for by `motion`, which lays them onto the other scan; on the second scan's surface that
/// is the way back. `without_blur` is the motion that the surfaces would have where blur moved neither: it is not taken, and how far it leads
/// elsewhere is added to the ±. Else the motion errs as both scans' registrations do, of which one has the motion's own covariance, too.
pub fn displaced(mesh: &Mesh, [motion, without_blur]: [&DAffine3; 2], at: &[bool], on_first: bool, registered: [Registered<'_>; 2]) -> Map {
    let areas = mesh.areas_mm2();
    let (mut map, mut area_mm2, mut ends) = (Map::default(), 0.0, [vec![], vec![]]);
    for (n, point) in mesh.vertices.iter().enumerate() {
        if !at[n] {
            map.push(None, registered);
            continue;
        }
        let there = motion.transform_point3(*point);
        // Where nothing moves, any direction is as good.
        let along = (there - point).normalize_or(DVec3::X);
        let own = [*point, there].map(|p| EndError::moved_along(p, along));
        let [first, second] = if on_first { own } else { [own[1], own[0]] };
        (0..2).for_each(|scan| ends[scan].push(([first, second][scan], areas[n])));
        area_mm2 += areas[n];
        map.push(Some(Found { mm: point.distance(there), partner: there, ends: [vec![first], vec![second]] }), registered);
        if let Some(mm) = map.errors_mm.last_mut() {
            *mm = BALL as f32 * *mm + without_blur.transform_point3(*point).distance(there) as f32;
        }
    }
    map.common = ends.map(|ends| EndError::common(ends.into_iter().map(|(end, area)| (end, area / area_mm2))));
    map
}
