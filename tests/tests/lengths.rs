//! Lengths along random rays through real scans against the interpolant's own, found another way: cell by cell from the planes that a ray
//! crosses, between the turning points of the cubic through four values, by bisection of the interpolant itself.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use bregma_field::crossings::{self, Kind};
use bregma_measure::probe;
use bregma_renderer::{Ray, Surface};
use bregma_session::{Opened, Source};
use bregma_tests::{Random, data};
use bregma_volume::{Progress, ReadSamples, Volume, WorldPoint};
use glam::DVec3;
use rayon::prelude::*;

fn corner_values(v: &Volume, cell: [usize; 3]) -> [f64; 8] {
    let [nx, ny, _] = v.grid().dims();
    std::array::from_fn(|c| v.samples().get_f64(((cell[2] + (c >> 2)) * ny + cell[1] + (c >> 1 & 1)) * nx + cell[0] + (c & 1)))
}

fn interpolant(f: &[f64; 8], p: DVec3) -> f64 {
    (0..8).map(|c| f[c] * (0..3).map(|a| if c >> a & 1 == 1 { p[a] } else { 1.0 - p[a] }).product::<f64>()).sum()
}

/// The turning points in (0, 1) of the cubic with these values at 0, ⅓, ⅔ and 1.
fn turning_points(v: [f64; 4]) -> Vec<f64> {
    let c1 = (-11.0 * v[0] + 18.0 * v[1] - 9.0 * v[2] + 2.0 * v[3]) / 2.0;
    let c2 = (18.0 * v[0] - 45.0 * v[1] + 36.0 * v[2] - 9.0 * v[3]) / 2.0;
    let c3 = (-9.0 * v[0] + 27.0 * v[1] - 27.0 * v[2] + 9.0 * v[3]) / 2.0;
    let (a, b, c) = (3.0 * c3, 2.0 * c2, c1);
    let root = (b * b - 4.0 * a * c).sqrt();
    let q = -0.5 * (b + b.signum() * root);
    let mut found: Vec<f64> = [q / a, c / q].into_iter().filter(|u| *u > 0.0 && *u < 1.0).collect();
    found.sort_by(f64::total_cmp);
    found
}

/// Where the interpolant changes sides of the level along the ray, mm; `None` where a turning point comes so near to the level that rounding
/// decides, or a crossing so near to a face between cells that it may lie on either side.
fn crossings(surface: &Surface, ray: &Ray) -> Option<Vec<f64>> {
    let v = &surface.volume;
    let [first, last] = crossings::box_span(surface, ray)?.t_mm;
    let map = surface.grid.world_to_index();
    let (origin, direction) = (map.transform_point3(ray.origin.0), map.transform_vector3(ray.direction));
    let dims = surface.grid.dims();
    let mut planes = vec![first, last];
    for a in 0..3 {
        if direction[a] != 0.0 {
            planes.extend((0..dims[a]).map(|n| (n as f64 - origin[a]) / direction[a]).filter(|t| *t > first && *t < last));
        }
    }
    planes.sort_by(f64::total_cmp);
    let mut found = vec![];
    for pair in planes.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        let middle = origin + 0.5 * (from + to) * direction;
        let cell: [usize; 3] = std::array::from_fn(|a| (middle[a].max(0.0) as usize).min(dims[a] - 2));
        let f = corner_values(v, cell).map(|s| s - surface.level);
        if to - from < 1e-12 || f.iter().all(|v| *v >= 0.0) || f.iter().all(|v| *v < 0.0) {
            continue;
        }
        let at = |u: f64| origin + (from + u * (to - from)) * direction - DVec3::from(cell.map(|n| n as f64));
        let value = |u: f64| interpolant(&f, at(u));
        let scale = f.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let mut ends = vec![0.0];
        ends.extend(turning_points([0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0].map(value)));
        ends.push(1.0);
        // Rounding of positions and values, a thousand times over.
        if ends.iter().any(|u| value(*u).abs() < 1e-10 * scale) {
            return None;
        }
        for pair in ends.windows(2) {
            let (mut low, mut high) = (pair[0], pair[1]);
            let begins_inside = value(low) >= 0.0;
            if (value(high) >= 0.0) == begins_inside {
                continue;
            }
            for _ in 0..60 {
                let half = 0.5 * (low + high);
                if (value(half) >= 0.0) == begins_inside { low = half } else { high = half }
            }
            found.push(from + 0.5 * (low + high) * (to - from));
        }
    }
    Some(found)
}

fn check(what: &str, source: Source, iso: Option<f64>) {
    let mut opened = Opened::read(&[source], &Progress::default()).unwrap();
    if let Some(iso) = iso {
        opened.scene.layers[0].iso = iso;
    }
    let count = 100_000_u64;
    let surface = opened.scene.surfaces(&opened.volumes).unwrap().remove(0).1;
    let bounds = opened.bounds();
    // Of each ray: walls that were compared, whether it was undecided, and how far off the worst crossing is.
    let judge = |n: u64| {
        let mut random = Random(n * 7919 + 13);
        // Neighbouring seeds begin alike.
        for _ in 0..8 {
            random.unit();
        }
        let mut direction = || DVec3::new(random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.5).normalize();
        let (from, through) = (direction(), direction());
        let (from, through) =
            (bounds.centre_mm + 1.5 * bounds.radius_mm * from, bounds.centre_mm + 0.6 * bounds.radius_mm * random.unit() * through);
        let ray = Ray::new(WorldPoint(from), through - from).unwrap();
        let Some(truth) = crossings(&surface, &ray) else { return (0, 1, 0.0_f64) };
        // Ends at the scan's own faces are no crossings of the interpolant.
        let found: Vec<_> = crossings::crossings(&surface, &ray).into_iter().filter(|c| c.kind != Kind::Touch && !c.clipped).collect();
        assert_eq!(found.len(), truth.len(), "{what}: {ray:?}: {found:#?} {truth:?}");
        let off = |(c, t): (&crossings::Crossing, &f64)| ((c.t_mm - t).abs() - c.error_mm).max(0.0);
        let worst = found.iter().zip(&truth).map(off).fold(0.0, f64::max);
        if n.is_multiple_of(20) {
            ledger_covers(&opened, &ray);
        }
        (found.len() / 2, 0, worst)
    };
    let sum = |a: (usize, usize, f64), b: (usize, usize, f64)| (a.0 + b.0, a.1 + b.1, a.2.max(b.2));
    let (walls, undecided, worst) = (0..count).into_par_iter().map(judge).reduce(|| (0, 0, 0.0), sum);
    println!("{what}: {count} rays, {walls} walls, {undecided} undecided; off by at most {worst:.1e} mm beyond the stated bracket");
    assert!(worst <= 1e-9 && undecided * 30 <= count as usize && walls > count as usize / 10);
}

/// The ledger covers the box without gap or overlap, and its bone is the segments'.
fn ledger_covers(opened: &Opened, ray: &Ray) {
    let d = probe(&opened.volumes, &opened.scene.layers, ray).unwrap();
    let v = &d.volumes[0];
    let Some([first, last]) = v.box_mm else { return assert!(d.ledger.is_empty()) };
    assert!(d.ledger.first().unwrap().from_mm == first && d.ledger.last().unwrap().to_mm == last);
    assert!(d.ledger.windows(2).all(|w| w[0].to_mm == w[1].from_mm) && d.ledger.iter().all(|e| e.length_mm > 0.0));
    let listed: f64 = d.ledger.iter().filter(|e| !e.inside.is_empty()).map(|e| e.length_mm).sum();
    assert!((listed - v.segments.iter().map(|s| s.length_mm).sum::<f64>()).abs() < 1e-9);
}

#[test]
fn lengths_through_real_scans_are_the_interpolants() {
    // Fails if a crossing is missed, doubled or more than a millionth of a micrometre off.
    let Some(d) = data("lengths through real scans") else { return };
    let scan = |name: &str| Source { file: d.join(name), ..Source::default() };
    check("Cranium", scan("cranium-invesalius/Cranium.nhdr"), None);
    check("CThead", scan("cthead-unc/CThead.nhdr"), Some(1150.5));
    check("bonsai", scan("classic/bonsai.nii.gz"), Some(40.5));
    check("engine", scan("classic/engine_256x256x110_uint8.raw"), Some(120.5));
    check("mouse C57BL6", scan("mouse/C57BL6_J_.nii.gz"), Some(40.5));
    check("mouse DBA", scan("mouse/DBA_2J_.nii.gz"), Some(40.5));
}
