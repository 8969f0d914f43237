//! The scanner does what it states: edges, noise, and the same bytes for the same arguments.

use bregma_synthetic::ct::{AIR_HU, Field, Material, Scanner};
use bregma_synthetic::{Which, scanner, skull, skull_grid};
use bregma_volume::{Cancelled, Grid, Progress, ReadSamples, Samples};
use glam::{DMat3, DVec3, dvec3};

struct Solid<F>(F);

impl<F: Fn(DVec3) -> f64 + Sync> Field for Solid<F> {
    const LIPSCHITZ: f64 = 1.0;
    fn material(&self, p: DVec3) -> Material {
        Material { distance_mm: (self.0)(p), inside_hu: 1000.0 }
    }
}

fn grid(dims: [usize; 3], spacing_mm: DVec3) -> Grid {
    Grid::new(dims, spacing_mm, DVec3::ZERO, DMat3::IDENTITY).expect("positive sides")
}

/// Abramowitz & Stegun 7.1.26, to 1.5e-7.
fn erf(x: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.327_591_1 * x.abs());
    let poly = [1.061_405_429, -1.453_152_027, 1.421_413_741, -0.284_496_736, 0.254_829_592];
    (1.0 - poly.iter().fold(0.0, |sum, c| (sum + c) * t) * (-x * x).exp()) * x.signum()
}

#[test]
fn same_arguments_same_bytes() {
    // Fails if noise or sums depend on the order or the number of threads, or A and B share noise.
    let scan = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| skull(Which::A, 40, &Progress::default())).unwrap().samples().clone()
    };
    let one = scan(1);
    assert_eq!(one, scan(1));
    assert_eq!(one, scan(3));
    let Samples::I16(hu) = one else { panic!("CT is int16") };
    assert!(hu.iter().any(|v| *v > 1000), "no bone");
}

#[test]
fn an_edge_is_the_integral_of_the_point_spread() {
    // Fails if sigma is taken in samples instead of mm, along any of the axes, or an edge is shifted by part of a voxel.
    let scanner = Scanner { psf_sigma_mm: 0.9, noise_hu: 0.0, seed: 0 };
    for axis in 0..3 {
        let spacing = dvec3(0.4, 0.5, 0.6);
        let grid = grid([40; 3], spacing);
        let edge = 10.13;
        let hu = scanner.scan(&Solid(|p: DVec3| p[axis] - edge), &grid, &Progress::default()).unwrap();
        for n in 5..35 {
            let x = n as f64 * spacing[axis] - edge;
            // The box of one voxel widens the Gaussian by spacing²/12 (variances add). What the voxels of 0.6 mm
            // alias of a step into a point spread of 1.5 voxels is up to 7.7 HU, by summing both in float64; the rest is rounding.
            let sigma = (0.81 + spacing[axis].powi(2) / 12.0_f64).sqrt();
            let expected = AIR_HU + 1000.0 * (1.0 - erf(x / sigma / 2.0_f64.sqrt()));
            let mut index = [20; 3];
            index[axis] = n;
            let got = f64::from(hu[(index[2] * 40 + index[1]) * 40 + index[0]]);
            assert!((got - expected).abs() < 8.5, "axis {axis}, {x} mm: {got} {expected}");
        }
    }
}

#[test]
fn a_slanted_wall_shows_no_rings() {
    // Fails if the demo's point spreads are narrower than its samples resolve: what shades a wall then turns to and fro by degrees
    // from sample to sample (by 8 with 0.45 mm), which a vault shows as rings.
    for which in [Which::A, Which::B] {
        let grid = grid([40; 3], skull_grid(which, 256).spacing_mm());
        let middle = grid.index_to_world().transform_point3(DVec3::splat(19.5));
        let normal = dvec3(0.2, 0.25, 1.0).normalize();
        let scanner = Scanner { noise_hu: 0.0, ..scanner(which) };
        let hu = scanner.scan(&Solid(|p: DVec3| (p - middle).dot(normal)), &grid, &Progress::default()).unwrap();
        let at = |[i, j, k]: [usize; 3]| f64::from(hu[(k * 40 + j) * 40 + i]);
        // Central differences, interpolated, as pictures are shaded.
        let slope = |q: DVec3| {
            let base = q.floor();
            let corner = |c: usize| {
                let o = dvec3((c & 1) as f64, (c >> 1 & 1) as f64, (c >> 2) as f64);
                let n = (base + o).to_array().map(|x| x as usize);
                let along = |axis: usize| {
                    let (mut a, mut b) = (n, n);
                    (a[axis], b[axis]) = (n[axis] + 1, n[axis] - 1);
                    (at(b) - at(a)) / grid.spacing_mm()[axis]
                };
                let share = DVec3::ONE - (q - base - o).abs();
                DVec3::from_array([0, 1, 2].map(along)) * share.element_product()
            };
            (0..8).map(corner).sum::<DVec3>()
        };
        let (mut low, mut high) = (f64::INFINITY, 0.0_f64);
        for n in 0..400 {
            let aside = dvec3(f64::from(n % 20) * 0.31 - 3.0, f64::from(n / 20) * 0.31 - 3.0, 0.0);
            let p = middle + aside.reject_from(normal);
            let tilt = slope(grid.world_to_index().transform_point3(p)).angle_between(DVec3::Z).to_degrees();
            (low, high) = (low.min(tilt), high.max(tilt));
        }
        assert!(high - low < 2.0, "{which:?}: {low} to {high} degrees");
    }
}

#[test]
fn partial_volumes_add_up_to_the_solid() {
    // Fails if blocks are skipped that hold surface, or a voxel's share of the solid is biased.
    let scanner = Scanner { psf_sigma_mm: 0.0, noise_hu: 0.0, seed: 0 };
    let turn = DMat3::from_axis_angle(dvec3(1.0, 2.0, 3.0).normalize(), 0.3);
    let grid = Grid::new([60, 50, 61], dvec3(0.5, 0.6, 0.7), dvec3(1.0, 2.0, 3.0), turn).unwrap();
    let centre = grid.index_to_world().transform_point3(dvec3(30.3, 25.1, 30.7));
    let hu = scanner.scan(&Solid(|p: DVec3| p.distance(centre) - 10.0), &grid, &Progress::default()).unwrap();
    let volume = hu.iter().map(|v| (f64::from(*v) - AIR_HU) / 2000.0).sum::<f64>() * 0.5 * 0.6 * 0.7;
    let exact = 4.0 / 3.0 * std::f64::consts::PI * 1000.0;
    assert!((volume / exact - 1.0).abs() < 1e-3, "{volume} {exact}");
}

#[test]
fn noise_has_its_mean_and_deviation_and_no_memory() {
    // Fails if the hash repeats, neighbours or seeds correlate, or Box–Muller is wrong.
    let field = Solid(|_: DVec3| 1e9);
    let scan = |seed| {
        let scanner = Scanner { psf_sigma_mm: 0.5, noise_hu: 40.0, seed };
        scanner.scan(&field, &grid([100; 3], DVec3::ONE), &Progress::default()).unwrap()
    };
    let noise: Vec<f64> = scan(1).into_iter().map(|v| f64::from(v) - AIR_HU).collect();
    let other: Vec<f64> = scan(2).into_iter().map(|v| f64::from(v) - AIR_HU).collect();
    let mean = |f: &dyn Fn(usize) -> f64| (0..1_000_000).map(f).sum::<f64>() / 1e6;
    // Tolerances are five standard errors of a million samples: σ/1000 for the mean, σ²·√2/1000 for the variance.
    assert!(mean(&|i| noise[i]).abs() < 0.2);
    assert!((mean(&|i| noise[i].powi(2)) / 1600.0 - 1.0).abs() < 0.0071);
    assert!((mean(&|i| noise[i].powi(4)) / 1600.0_f64.powi(2) - 3.0).abs() < 0.05);
    for offset in [1, 2, 100, 10_000] {
        assert!((mean(&|i| noise[i] * noise[(i + offset) % 1_000_000]) / 1600.0).abs() < 0.005, "{offset}");
    }
    assert!((mean(&|i| noise[i] * other[i]) / 1600.0).abs() < 0.005);
}

#[test]
fn a_scan_counts_its_slabs_and_stops_on_request() {
    // Fails if progress ends short of 1, or a cancelled scan returns samples.
    let progress = Progress::default();
    skull(Which::B, 24, &progress).unwrap();
    assert_eq!(progress.fraction(), 1.0);
    progress.cancel();
    assert_eq!(skull(Which::B, 24, &progress).unwrap_err(), Cancelled);
}
