//! The skulls hold what they promise: known walls, known differences, distances that bound.

use bregma_synthetic::ct::Field;
use bregma_synthetic::skull::*;
use bregma_synthetic::skull_grid;
use bregma_volume::IndexPoint;
use glam::{DVec3, dvec3};

/// Points spread evenly over the unit cube: R3, the Kronecker sequence of the plastic number's sibling (M. Roberts, 2018).
fn spread(n: usize) -> DVec3 {
    const G: f64 = 1.220_744_084_605_759_5;
    (n as f64 * dvec3(1.0 / G, 1.0 / (G * G), 1.0 / (G * G * G))).fract()
}

/// Bone between its inner and outer surface, by bisection along the inward normal from `p` on the outer vault.
fn wall_mm(skull: &Skull, p: DVec3, normal: DVec3, outside_mm: f64) -> f64 {
    let inside = |depth: f64| skull.material(p - depth * normal).distance_mm < 0.0;
    let root = |mut a: f64, mut b: f64| {
        let from = inside(a);
        assert_ne!(from, inside(b));
        for _ in 0..60 {
            let middle = 0.5 * (a + b);
            if inside(middle) == from { a = middle } else { b = middle }
        }
        a
    };
    // The middle of the thinnest wall that is asked for lies 0.7 mm above the inner surface.
    let middle = skull.vault_thickness_mm(normal) - 0.7;
    root(middle, middle + 4.0) - root(-outside_mm, middle)
}

/// Outer vault points of the upper skull with their normals, away from sutures and joined bones: the distance says so.
fn clear_vault(skull: &Skull) -> Vec<(DVec3, DVec3)> {
    let points = (0..4000).map(|n| {
        let p = (spread(n) - 0.5) * dvec3(200.0, 240.0, 200.0) + dvec3(0.0, 0.0, 40.0);
        let foot = skull.vault_foot(p);
        (foot.point, foot.normal)
    });
    points
        .filter(|(p, n)| {
            let as_far = |d: f64| (skull.material(*p + d * *n).distance_mm - d).abs() < 1e-9;
            p.z > 15.0 && as_far(0.5) && as_far(-0.5) && as_far(2.0)
        })
        .collect()
}

#[test]
fn walls_along_normals_are_as_thick_as_stated() {
    // Fails if the inner surface is offset from anything but the foot of the normal.
    let skull = Skull::new(Which::A);
    let clear = clear_vault(&skull);
    assert!(clear.len() > 500, "{}", clear.len());
    for (p, n) in clear {
        let (wall, stated) = (wall_mm(&skull, p, n, 1.0), skull.vault_thickness_mm(n));
        assert!((wall - stated).abs() < 1e-6, "{p}: {wall} {stated}");
    }
}

#[test]
fn bones_have_their_nominal_thickness() {
    // Fails if one bone's bell reaches into the middle of another by more than 0.05 mm.
    let (a, b) = (Skull::new(Which::A), Skull::new(Which::B));
    let at = |s: &Skull, n: DVec3| s.vault_thickness_mm(n.normalize());
    let close = |x: f64, y: f64| assert!((x - y).abs() < 0.05, "{x} {y}");
    close(at(&a, FRONTAL_NORMAL), FRONTAL_MM);
    close(at(&a, TEMPORAL_NORMAL), TEMPORAL_MM);
    close(at(&a, TEMPORAL_NORMAL * dvec3(-1.0, 1.0, 1.0)), TEMPORAL_MM);
    close(at(&a, OCCIPITAL_NORMAL), OCCIPITAL_MM);
    close(at(&a, DVec3::Z), PARIETAL_MM);
    close(at(&b, FRONTAL_NORMAL) - at(&a, FRONTAL_NORMAL), FRONTAL_GAIN_MM);
    close(at(&b, DVec3::Z), PARIETAL_MM);
}

#[test]
fn b_is_thicker_in_front_and_thin_under_the_burr_hole() {
    // Fails if the gain is outward, or the pit's floor does not follow the inner surface.
    let (a, b) = (Skull::new(Which::A), Skull::new(Which::B));
    let front = a.vault_foot(dvec3(5.0, -110.0, 42.0));
    let gain = wall_mm(&b, front.point, front.normal, 1.0) - wall_mm(&a, front.point, front.normal, 1.0);
    let stated = b.vault_thickness_mm(front.normal) - a.vault_thickness_mm(front.normal);
    assert!((gain - stated).abs() < 1e-6 && gain > 3.4, "{gain} {stated}");
    assert!(a.material(front.point).distance_mm.abs() < 1e-9 && b.material(front.point).distance_mm.abs() < 1e-9);
    let middle = a.vault_foot(a.vault_point(BURR_NORMAL.normalize()));
    for n in 0..200 {
        let foot = b.vault_foot(middle.point + (spread(n) - 0.5) * 5.0);
        let wall = wall_mm(&b, foot.point, foot.normal, 1.0);
        assert!((wall - BURR_WALL_MM).abs() < 1e-6, "{wall}");
    }
}

#[test]
fn a_and_b_differ_only_where_stated() {
    // Fails if a change leaks beyond the frontal wall, the burr hole and the mandible, or to the right parietal.
    let (a, b) = (Skull::new(Which::A), Skull::new(Which::B));
    let burr = a.vault_point(BURR_NORMAL.normalize());
    for n in 0..200_000 {
        let p = (spread(n) - 0.5) * dvec3(160.0, 210.0, 210.0) + dvec3(0.0, -4.0, -26.0);
        let shifted = p + MANDIBLE_SHIFT_MM;
        assert!((a.mandible(p) - b.mandible(shifted)).abs() < 1e-9);
        let foot = a.vault_foot(p);
        let frontal = b.vault_thickness_mm(foot.normal) - a.vault_thickness_mm(foot.normal) > 1e-3;
        let v = p - burr;
        let from_axis = v.reject_from(BURR_NORMAL).length();
        // The rim ends BURR_RIM_MM from the side on the surface; inside the wall, distances to it reach as far again.
        let burr = v.dot(BURR_NORMAL) > -40.0 && from_axis < BURR_RADIUS_MM + 2.0 * BURR_RIM_MM;
        let (x, y) = (a.cranium(p), b.cranium(p));
        if !frontal && !burr && x.min(y) < 1.0 {
            assert!((x - y).abs() < 2e-3, "{p}: {x} {y}");
        }
    }
}

#[test]
fn distances_bound_and_the_jaws_do_not_touch() {
    // Fails if a group's bounds are too small, a blend is cut short or a primitive grows faster than distance.
    for which in [Which::A, Which::B] {
        let skull = Skull::new(which);
        let mut steepest = 0.0_f64;
        for n in 0..100_000 {
            let p = (spread(n) - 0.5) * dvec3(180.0, 230.0, 230.0) + dvec3(0.0, -4.0, -26.0);
            let step = (spread(7 * n + 3) - 0.5) * if n % 2 == 0 { 0.2 } else { 8.0 };
            let rise = skull.material(p + step).distance_mm - skull.material(p).distance_mm;
            steepest = steepest.max(rise.abs() / step.length());
            // A ball around p free of one bone and as large as its distance to the other: they are more than 0.8 mm apart.
            let apart = skull.cranium(p) + skull.mandible(p);
            assert!(apart > 0.8, "{which:?} {p}: {} {}", skull.cranium(p), skull.mandible(p));
        }
        assert!(steepest <= Skull::LIPSCHITZ, "{which:?}: {steepest}");
    }
}

#[test]
fn what_is_near_is_all_that_counts() {
    // Fails if a part of the skull is left out that still has a share within the ball, so that blocks of a scan would not meet.
    for which in [Which::A, Which::B] {
        let skull = Skull::new(which);
        for n in 0..20_000 {
            let p = (spread(n) - 0.5) * dvec3(150.0, 200.0, 200.0) + dvec3(0.0, -4.0, -26.0);
            if skull.material(p).distance_mm > 12.0 {
                continue;
            }
            let near = skull.near(p, 5.0).expect("skulls leave out what is far");
            for m in 0..8 {
                let q = p + (spread(8 * n + m) - 0.5).normalize() * 5.0 * spread(m).x;
                let (all, part) = (skull.material(q), near.material(q));
                assert!(
                    (all.distance_mm - part.distance_mm).abs() < 1e-12 && (all.inside_hu - part.inside_hu).abs() < 1e-9,
                    "{which:?} {q}"
                );
            }
        }
    }
}

#[test]
fn both_grids_hold_the_whole_skull() {
    // Fails if a field of view cuts bone.
    for which in [Which::A, Which::B] {
        let (skull, grid) = (Skull::new(which), skull_grid(which, 96));
        let last = DVec3::from(grid.dims().map(|n| (n - 1) as f64));
        for n in 0..60_000 {
            let mut q = spread(n) * last;
            q[n % 3] = if n % 2 == 0 { 0.0 } else { last[n % 3] };
            let p = grid.world(IndexPoint(q)).0;
            assert!(skull.material(p).distance_mm > 0.5, "{which:?} {p}");
        }
    }
}
