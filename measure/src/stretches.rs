//! Which stretches of bone of two volumes belong together, and how much longer the second's are.
//!
//! Two stretches are partners where each overlaps the other more than any other stretch of the other's volume. One that has no partner so, but
//! lies for more than half of its length in a stretch of the other volume, stands together with what that belongs to, as two tables of a vault
//! do that are one bone in the other scan. All others are without partner.

use crate::record::{Difference, Pair, Segment, Shift, VolumeRecord};
use crate::uncertainty::{EndError, Ends, Registered, of_difference};

/// The first volume against each later one.
pub fn pairs(volumes: &[VolumeRecord]) -> Vec<Pair> {
    (1..volumes.len()).map(|n| pair(volumes, [0, n])).collect()
}

/// What a ± lacks where nobody says how well two scans are registered.
const UNREGISTERED: &str = "the registration's error, which is not known";

fn pair(all: &[VolumeRecord], volumes: [usize; 2]) -> Pair {
    let [a, b] = volumes.map(|n| &all[n]);
    // A scan that was not moved is where the others were moved to.
    let [of_a, of_b] = [a, b].map(VolumeRecord::registered);
    let is_known = |v: &VolumeRecord| v.registered().is_known() || !v.is_moved;
    let is_registered = is_known(a) && is_known(b) && (of_a.is_known() || of_b.is_known());
    let registered = [of_a, of_b].map(|known| if is_registered { known } else { Registered::default() });
    let (groups, [only_a, only_b]) = belonging(&a.segments, &b.segments);
    let numbers = |group: &[usize]| group.iter().map(|n| n + 1).collect::<Vec<_>>();
    Pair {
        a: a.name.clone(),
        b: b.name.clone(),
        volumes,
        without: (!is_registered).then_some(UNREGISTERED),
        differences: groups
            .iter()
            .map(|[of_a, of_b]| {
                let stretches = [(a, of_a), (b, of_b)].map(|(v, group)| group.iter().map(|n| v.segments[*n]).collect::<Vec<_>>());
                Difference { a: numbers(of_a), b: numbers(of_b), ..difference(&stretches, registered) }
            })
            .collect(),
        only_a: numbers(&only_a),
        only_b: numbers(&only_b),
    }
}

/// Numbers, from 0, of stretches of A and of B.
type Group = [Vec<usize>; 2];

/// The stretches that belong together, in order, and those that are alone.
fn belonging(a: &[Segment], b: &[Segment]) -> (Vec<Group>, Group) {
    let overlap = |i: usize, j: usize| (a[i].to_mm.min(b[j].to_mm) - a[i].from_mm.max(b[j].from_mm)).max(0.0);
    // Of equal ones the first.
    let largest = |count: usize, with: &dyn Fn(usize) -> f64| {
        (0..count).filter(|n| with(*n) > 0.0).reduce(|best, n| if with(n) > with(best) { n } else { best })
    };
    let of_a: Vec<Option<usize>> = (0..a.len()).map(|i| largest(b.len(), &|j| overlap(i, j))).collect();
    let of_b: Vec<Option<usize>> = (0..b.len()).map(|j| largest(a.len(), &|i| overlap(i, j))).collect();
    let belong = |i: usize, j: usize| {
        let is_mutual = of_a[i] == Some(j) && of_b[j] == Some(i);
        let mostly = |best: Option<usize>, other: usize, s: &Segment| best == Some(other) && overlap(i, j) > 0.5 * s.length_mm;
        is_mutual || mostly(of_a[i], j, &a[i]) || mostly(of_b[j], i, &b[j])
    };
    // Each stretch is a group, and groups of what belongs together are joined; B's stretches follow A's.
    let mut group: Vec<usize> = (0..a.len() + b.len()).collect();
    for i in 0..a.len() {
        for j in (0..b.len()).filter(|j| belong(i, *j)) {
            let (kept, joined) = (group[i], group[a.len() + j]);
            group.iter_mut().filter(|g| **g == joined).for_each(|g| *g = kept);
        }
    }
    let members = |g: usize| -> Group {
        let all: Vec<usize> = (0..group.len()).filter(|n| group[*n] == g).collect();
        let (of_a, of_b): (Vec<usize>, Vec<usize>) = all.into_iter().partition(|n| *n < a.len());
        [of_a, of_b.into_iter().map(|n| n - a.len()).collect()]
    };
    let (mut groups, mut alone) = (vec![], [vec![], vec![]]);
    for g in 0..group.len() {
        match members(g) {
            [of_a, of_b] if of_b.is_empty() => alone[0].extend(of_a),
            [of_a, of_b] if of_a.is_empty() => alone[1].extend(of_b),
            both => groups.push(both),
        }
    }
    groups.sort_by_key(|[of_a, _]| of_a[0]);
    (groups, alone)
}

/// The difference of two lists of stretches that belong together; neither is empty.
fn difference(stretches: &[Vec<Segment>; 2], registered: [Registered<'_>; 2]) -> Difference {
    let error = |ends: [&[EndError]; 2]| {
        of_difference([Ends { of: ends[0], registered: registered[0] }, Ends { of: ends[1], registered: registered[1] }])
    };
    let [length_a, length_b] = stretches.each_ref().map(|list| list.iter().map(|s| s.length_mm).sum::<f64>());
    let ends = stretches.each_ref().map(|list| list.iter().flat_map(|s| s.ends).collect::<Vec<EndError>>());
    let shift = |at: [(f64, EndError); 2]| {
        let [(a_mm, a), (b_mm, b)] = at;
        let error_mm = error([&[a], &[b]]).error_mm;
        (a.is_boundary && b.is_boundary).then_some(Shift { shift_mm: b_mm - a_mm, error_mm })
    };
    let all = || stretches.iter().flatten();
    Difference {
        a: vec![],
        b: vec![],
        difference_mm: length_b - length_a,
        uncertainty: error([&ends[0], &ends[1]]),
        from_shift: shift(stretches.each_ref().map(|list| (list[0].from_mm, list[0].ends[0]))),
        to_shift: shift(stretches.each_ref().map(|list| (list[list.len() - 1].to_mm, list[list.len() - 1].ends[1]))),
        united: stretches.iter().any(|list| list.len() > 1),
        partial: all().any(|s| s.clipped || s.from_origin),
        below_resolution: all().any(|s| s.below_resolution),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::uncertainty::Uncertainty;

    fn stretches(ends: &[[f64; 2]]) -> Vec<Segment> {
        let stretch = |[from_mm, to_mm]: &[f64; 2]| Segment {
            from_mm: *from_mm,
            to_mm: *to_mm,
            length_mm: to_mm - from_mm,
            uncertainty: Uncertainty::default(),
            obliquity_deg: [0.0; 2],
            half_maximum_mm: None,
            resolution_mm: 0.0,
            clipped: false,
            cut: false,
            from_origin: false,
            below_resolution: false,
            ends: [EndError::default(); 2],
        };
        ends.iter().map(stretch).collect()
    }

    fn groups(a: &[[f64; 2]], b: &[[f64; 2]]) -> (Vec<Group>, Group) {
        belonging(&stretches(a), &stretches(b))
    }

    #[test]
    fn stretches_that_overlap_most_are_partners_and_the_rest_are_alone() {
        // Fails if bones are paired by their numbers, if one without a partner is compared with nothing, or if two that share a sliver are one.
        let one = |i, j| [vec![i], vec![j]];
        // B has a further bone before all others: numbers do not pair.
        assert_eq!(
            groups(&[[10.0, 15.0], [100.0, 106.0]], &[[0.0, 2.0], [11.0, 17.0], [101.0, 105.0]]),
            (vec![one(0, 1), one(1, 2)], [vec![], vec![0]])
        );
        // A shift that leaves less than half of either is still the same bone.
        assert_eq!(groups(&[[0.0, 5.0]], &[[3.0, 8.0]]), (vec![one(0, 0)], [vec![], vec![]]));
        // A sliver of the second bone is not what belongs to the first.
        assert_eq!(groups(&[[0.0, 5.0], [6.0, 16.0]], &[[0.0, 6.5]]), (vec![one(0, 0)], [vec![1], vec![]]));
        assert_eq!(groups(&[[0.0, 5.0]], &[[6.0, 8.0]]), (vec![], [vec![0], vec![0]]));
        assert_eq!(groups(&[], &[[6.0, 8.0]]), (vec![], [vec![], vec![0]]));
        // Ends that meet do not overlap.
        assert_eq!(groups(&[[0.0, 5.0]], &[[5.0, 8.0]]).0, Vec::<Group>::new());
    }

    #[test]
    fn two_tables_in_one_bone_stand_together() {
        // Fails if the diploë that one scan shows is counted as bone, or the inner table is dropped from the difference.
        let (a, b) = (stretches(&[[0.0, 3.0], [4.0, 6.0]]), stretches(&[[0.5, 6.5]]));
        assert_eq!(belonging(&a, &b), (vec![[vec![0, 1], vec![0]]], [vec![], vec![]]));
        assert_eq!(belonging(&b, &a), (vec![[vec![0], vec![0, 1]]], [vec![], vec![]]));
        let d = difference(&[a, b], [Registered::default(); 2]);
        assert!(d.united && d.difference_mm == 1.0, "{d:?}");
    }
}
