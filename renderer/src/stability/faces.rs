//! From cell to cell: a segment, carried on into a neighbouring cell, with the surface where it passes the face between them.

use super::DECIDED_VOXEL;
use super::segments::Segment;
use glam::Vec3;

/// The segment `s` and its straight continuation through the cell behind the face where it leaves, whose other four corners are those
/// of `other`. All values are shifted, in float32, so that the surface passes within rounding of the point on the face; that point has
/// the same bits in both cells, as in a walk. `None` where it leaves through no face, or where it is not clear, whatever float32
/// rounds, that it begins outside, enters once and ends inside.
pub(super) fn across(s: &Segment, other: &Segment) -> Option<[Segment; 2]> {
    let direction = s.to - s.from;
    let ahead = |a: usize| if direction[a] > 0.0 { 1.0 } else { 0.0 };
    let axis = (0..3).find(|&a| direction[a] != 0.0 && s.to[a] == ahead(a))?;
    let level = s.value(1.0) as f32;
    let corners = std::array::from_fn(|c| {
        let is_shared = (c >> axis & 1) as f32 != ahead(axis);
        (if is_shared { s.corners[c ^ (1 << axis)] } else { other.corners[c] }) - level
    });
    let mut from = s.to;
    from[axis] = 1.0 - s.to[axis];
    let to_face = |a: usize| if direction[a] == 0.0 { f32::MAX } else { (ahead(a) - from[a]) / direction[a] };
    let exit = (0..3).fold(axis, |nearest, a| if to_face(a) < to_face(nearest) { a } else { nearest });
    let mut to = (from + to_face(exit) * direction).clamp(Vec3::ZERO, Vec3::ONE);
    to[exit] = ahead(exit);
    let cells = [Segment { corners: s.corners.map(|c| c - level), ..*s }, Segment { corners, from, to }];
    enters_once(&cells).then_some(cells)
}

fn enters_once([first, second]: &[Segment; 2]) -> bool {
    let doubt = first.doubt().max(second.doubt());
    let lengths = [first, second].map(|s| f64::from(s.from.distance(s.to)));
    // Voxels to the entry, where it is the only one; an entry at the second cell's beginning goes on with the first's.
    let only_entry = |shift: f64| {
        let (a, b) = (first.crossings(shift), second.crossings(shift));
        let goes_on = a.last().is_some_and(|c| c.1) && b.first().is_some_and(|c| c.0 == 0.0);
        let of_first = a.iter().filter(|c| c.1).map(|c| c.0 * lengths[0]);
        let of_second = b.iter().skip(usize::from(goes_on)).filter(|c| c.1).map(|c| lengths[0] + c.0 * lengths[1]);
        let entries: Vec<f64> = of_first.chain(of_second).collect();
        (entries.len() == 1).then(|| entries[0])
    };
    let [Some(entry), Some(raised), Some(lowered)] = [0.0, doubt, -doubt].map(only_entry) else { return false };
    let is_decidable = (raised - entry).abs().max((lowered - entry).abs()) <= DECIDED_VOXEL;
    is_decidable && first.value(0.0) < -doubt && second.value(1.0) > doubt
}

#[cfg(test)]
mod tests {
    use super::super::segments::FAMILIES;
    use super::*;

    #[test]
    fn the_two_cells_share_a_face_and_a_point_at_the_level() {
        // Fails if corners are taken across the wrong face, the ray is bent, or the surface does not pass the shared point.
        let mut tested = 0;
        for n in 0..2000 {
            let Some([first, second]) = across(&FAMILIES[0].segment(0, n), &FAMILIES[0].segment(0, n + 1)) else { continue };
            let axis = (0..3).find(|&a| first.to[a] != second.from[a]).unwrap();
            let side = first.to[axis];
            let mut beyond = first.to;
            beyond[axis] = 1.0 - side;
            assert_eq!(second.from, beyond);
            for c in (0..8).filter(|c| (c >> axis & 1) as f32 == side) {
                assert_eq!(first.corners[c], second.corners[c ^ (1 << axis)]);
            }
            assert_eq!(first.value(1.0), second.value(0.0));
            assert!(first.value(1.0).abs() <= first.doubt());
            let directions = [&first, &second].map(|s| (s.to - s.from).normalize());
            assert!(directions[0].distance(directions[1]) < 1e-4, "{directions:?}");
            tested += 1;
        }
        assert!(tested > 200, "{tested}");
    }
}
