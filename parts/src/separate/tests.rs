use super::*;
use bregma_field::{Grid, IndexPoint, Raster, Unit, Volume};
use bregma_synthetic::{Random, Skull, Which};
use glam::{DAffine3, DMat3};
use std::sync::Arc;

fn surface(volume: Volume, iso: f64) -> Surface {
    Surface::new(&Arc::new(volume), iso, DAffine3::IDENTITY).unwrap()
}

fn solid(dims: [usize; 3], spacing_mm: DVec3, is_inside: impl Fn([usize; 3]) -> bool) -> Surface {
    let grid = Grid::new(dims, spacing_mm, DVec3::ZERO, DMat3::IDENTITY).unwrap();
    let at = |n: usize| [n % dims[0], n / dims[0] % dims[1], n / (dims[0] * dims[1])];
    let samples = Samples::U8((0..grid.len()).map(|n| u8::from(is_inside(at(n)))).collect());
    let raster = Raster { grid, samples, slope: 1.0, intercept: 0.0, unit: Unit::Value, warnings: vec![] };
    surface(Volume::new("solid".into(), "test", raster).unwrap(), 1.0)
}

fn sizes(labels: &Labels) -> Vec<u64> {
    labels.statistics(&labels.volume()).iter().map(|s| s.samples).collect()
}

#[test]
fn the_jaw_comes_off_the_phantom() {
    // Fails if cores are those of straight lines, bone is lost, or more than 1 voxel of bone in 200 is on the wrong side. Which side a sample is on is
    // known from the phantom's own functions; the skull is the larger part, the jaw the other. Of B it is only told.
    for (which, size) in [(Which::A, 128), (Which::B, 128)] {
        let skull = Skull::new(which);
        let surface = surface(bregma_synthetic::skull(which, size, &Progress::default()).unwrap(), 226.0);
        for mm in [2.0, 3.0, 4.0, 5.0, 6.0] {
            let labels = separate(&surface, Neck { mm, least_mm3: None }, &Progress::default()).unwrap();
            let [nx, ny, nz] = labels.grid().dims();
            let [mut right, mut all] = [0; 2];
            for (k, j, i) in (0..nz).flat_map(|k| (0..ny).flat_map(move |j| (0..nx).map(move |i| (k, j, i)))) {
                let number = labels.number([i, j, k]);
                if number > 0 {
                    let p = labels.grid().world(IndexPoint(DVec3::new(i as f64, j as f64, k as f64))).0;
                    let is_jaw = skull.jaw(p) < skull.without_jaw(p);
                    all += 1;
                    right += usize::from(number == if is_jaw { 2 } else { 1 });
                }
            }
            let share = right as f64 / all as f64;
            println!(
                "skull {which:?} of {size} samples, necks up to {mm} mm: {:.3} % of {all} voxels right, parts {:?}",
                100.0 * share,
                sizes(&labels)
            );
            let bone = Islands::of_bone(&surface, &Progress::default()).unwrap().sizes().iter().sum::<u64>();
            assert!(all as f64 > 0.999 * bone as f64, "{all} of {bone}");
            assert!(which != Which::A || mm != JAW_MM || share >= 0.995, "{share}");
        }
    }
}

/// The neck at which the jaw of skull A comes off; B's, which stands forward and aside, is grown to its skull at these sizes.
const JAW_MM: f64 = 4.0;

#[test]
fn balls_that_touch_come_apart_and_plates_that_are_thick_do_not() {
    // Fails if a neck is not cut, a thick one is, spacing is taken for another axis's, or a sample of bone is lost.
    let ball = |at: [usize; 3], x: f64| (DVec3::new(at[0] as f64 - x, at[1] as f64 - 8.0, at[2] as f64 - 8.0)).length() <= 6.0;
    let two = solid([32, 17, 17], DVec3::ONE, |at| {
        ball(at, 8.0) || ball(at, 22.0) || (at[1].abs_diff(8) <= 1 && at[2].abs_diff(8) <= 1 && (8..22).contains(&at[0]))
    });
    let bone: u64 = Islands::of_bone(&two, &Progress::default()).unwrap().sizes().iter().sum();
    let apart = |mm| sizes(&separate(&two, Neck { mm, least_mm3: None }, &Progress::default()).unwrap());
    assert_eq!(apart(2.0), [bone]);
    let found = apart(4.0);
    assert!(found.len() == 2 && found[0].abs_diff(found[1]) <= 9 && found.iter().sum::<u64>() == bone, "{found:?} of {bone}");
    // A neck of 3 samples is 1.5 mm thick where they are 0.5 mm apart.
    let fine = solid([32, 9, 9], DVec3::new(1.0, 0.5, 0.5), |[i, j, k]| {
        i.abs_diff(8) < 6 || i.abs_diff(23) < 6 || (j.abs_diff(4) <= 1 && k.abs_diff(4) <= 1)
    });
    assert_eq!(sizes(&separate(&fine, Neck { mm: 1.0, least_mm3: None }, &Progress::default()).unwrap()).len(), 1);
    assert_eq!(sizes(&separate(&fine, Neck { mm: 2.5, least_mm3: None }, &Progress::default()).unwrap()).len(), 2);
}

#[test]
fn owners_are_those_of_the_shortest_ways_through_bone() {
    // Fails if a way cuts a corner outside of bone, a sample goes to a core that is farther, or one that can be reached is nobody's: against relaxing all
    // steps until nothing changes.
    let mut random = Random(12);
    for dims in [[6, 5, 4], [9, 1, 5], [1, 1, 12]] {
        let count: usize = dims.iter().product();
        let spacing_mm = DVec3::new(0.6, 1.0, 1.7);
        let mut way_mm = vec![-1.0_f32; count];
        let mut owner = vec![0; count];
        for n in 0..count {
            let drawn = random.unit();
            if drawn < 0.7 {
                way_mm[n] = f32::INFINITY;
            }
            if drawn < 0.06 {
                (way_mm[n], owner[n]) = (0.0, 1 + (drawn * 50.0) as u16);
            }
        }
        let mut growth = Growth { dims, spacing_mm, owner: owner.clone(), way_mm: way_mm.clone() };
        growth.grow(&Progress::default()).unwrap();
        let at = |n: usize| [n % dims[0], n / dims[0] % dims[1], n / (dims[0] * dims[1])];
        let bone = |at: [usize; 3]| way_mm[at[0] + dims[0] * (at[1] + dims[1] * at[2])] >= 0.0;
        let joined = |a: [usize; 3], b: [usize; 3]| {
            let off: Vec<usize> = (0..3).filter(|&x| a[x] != b[x]).collect();
            let turn = |x: usize| bone(std::array::from_fn(|y| if y == x { b[y] } else { a[y] }));
            (0..3).all(|x| a[x].abs_diff(b[x]) <= 1) && (off.len() == 1 || (off.len() == 2 && off.iter().any(|&x| turn(x))))
        };
        let mut best = way_mm.clone();
        loop {
            let mut changed = false;
            for (a, b) in (0..count).flat_map(|a| (0..count).map(move |b| (a, b))) {
                if best[a] >= 0.0 && best[b] > 0.0 && joined(at(a), at(b)) {
                    let length = (0..3).map(|x| ((at(a)[x] as f64 - at(b)[x] as f64) * spacing_mm[x]).powi(2)).sum::<f64>().sqrt() as f32;
                    if best[a] + length < best[b] {
                        (best[b], changed) = (best[a] + length, true);
                    }
                }
            }
            if !changed {
                break;
            }
        }
        assert_eq!(growth.way_mm, best, "{dims:?}");
        assert!((0..count).all(|n| (growth.owner[n] > 0) == (best[n] >= 0.0 && best[n].is_finite())));
    }
}

#[test]
fn what_is_thin_all_over_all_bone_or_no_neck_is_one_part_or_a_sentence() {
    // Fails if bone that no ball reaches is lost, a scan of nothing but bone panics, or a neck of no length is taken.
    let thin = solid([9, 9, 9], DVec3::ONE, |[_, _, k]| k == 4);
    assert_eq!(sizes(&separate(&thin, Neck { mm: 5.0, least_mm3: None }, &Progress::default()).unwrap()), [81]);
    let full = solid([5, 4, 3], DVec3::ONE, |_| true);
    assert_eq!(sizes(&separate(&full, Neck { mm: 5.0, least_mm3: None }, &Progress::default()).unwrap()), [60]);
    let refused = |neck| separate(&full, neck, &Progress::default()).unwrap_err().to_string();
    assert_eq!(refused(Neck { mm: 0.0, least_mm3: None }), "a neck of 0 mm is none; it must be a positive number of millimetres");
    assert_eq!(refused(Neck { mm: 1.0, least_mm3: Some(61.0) }), "solid: none of its parts is larger than 61 mm³; ask for smaller ones");
}
