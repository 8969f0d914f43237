//! Curves through noise, where cells have every topology: held to marching squares on a fine grid in the plane, which knows nothing of
//! cells.

use super::curve::{Curve, chains};
use super::plane::{InPlane, Plane};
use bregma_field::interpolant::depth_at;
use bregma_field::{Grid, Progress, Raster, Samples, Surface, Unit, Volume, WorldPoint};
use bregma_synthetic::Random;
use glam::{DAffine3, DMat3, DVec2, DVec3};
use std::sync::Arc;

const SAMPLES: usize = 12;
/// Of the squares.
const STEP_MM: f64 = 0.02;

fn noise(random: &mut Random, axes: DMat3) -> Surface {
    let grid = Grid::new([SAMPLES; 3], DVec3::new(0.8, 1.0, 1.1), DVec3::ZERO, axes).unwrap();
    let samples = Samples::F32((0..grid.len()).map(|_| random.unit() as f32).collect());
    let raster = Raster { grid, samples, slope: 1.0, intercept: 0.0, unit: Unit::Value, warnings: vec![] };
    let volume = Arc::new(Volume::new("noise".into(), "test", raster).unwrap());
    Surface::new(&volume, 0.5, DAffine3::IDENTITY).unwrap()
}

/// The length of {f = 0} in a plane, by squares of `step` mm.
fn by_squares(plane: &InPlane<'_>, step: f64) -> f64 {
    let count = (20.0 / step) as i32;
    let value =
        |i: i32, j: i32| depth_at(plane.surface, WorldPoint(plane.world(step * DVec2::new(f64::from(i), f64::from(j))))).map(|(d, _)| d);
    let rows: Vec<Vec<Option<f64>>> = (-count..count).map(|j| (-count..count).map(|i| value(i, j)).collect()).collect();
    let mut length = 0.0;
    for pair in rows.windows(2) {
        for i in 1..pair[0].len() {
            let [Some(a), Some(b), Some(c), Some(d)] = [pair[0][i - 1], pair[0][i], pair[1][i], pair[1][i - 1]] else { continue };
            let corners = [(a, DVec2::ZERO), (b, DVec2::X), (c, DVec2::ONE), (d, DVec2::Y)];
            let crossing = |n: usize| {
                let ((a, p), (b, q)) = (corners[n], corners[(n + 1) % 4]);
                ((a >= 0.0) != (b >= 0.0)).then(|| p.lerp(q, a / (a - b)))
            };
            let crossings: Vec<DVec2> = (0..4).filter_map(crossing).collect();
            length += crossings.chunks_exact(2).map(|ends| step * ends[0].distance(ends[1])).sum::<f64>();
        }
    }
    length
}

#[test]
fn through_noise_no_curve_is_lost_and_none_jumps() {
    // Fails if a root of a face is missing from one of its cells, a curve ends within the scan, entries and exits of a cell are joined the
    // wrong way, or a piece leads from one branch to another; on planes along layers of samples and through rows of them, too.
    let mut random = Random(3);
    for n in 0..8 {
        let axes = if n % 2 == 0 { DMat3::IDENTITY } else { DMat3::from_axis_angle(DVec3::new(2.0, 1.0, -2.0) / 3.0, 0.9) };
        let surface = noise(&mut random, axes);
        let middle = surface.grid.world(bregma_field::IndexPoint(DVec3::splat(5.0))).0;
        let normal = match n {
            0 => DVec3::X,
            1 => axes * DVec3::Z,
            2 => DVec3::new(1.0 / 0.8, 1.0, 0.0),
            _ => DVec3::new(random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.5),
        };
        let plane = InPlane::new(&surface, Plane::new(middle, normal).unwrap());
        let chains = chains(&plane, &Progress::default()).unwrap();
        let (mut length, mut ends) = (0.0, 0);
        for chain in &chains {
            let [first, last] = [chain.links[0].ends[0], chain.links[chain.links.len() - 1].ends[1]];
            if chain.is_closed {
                assert!(first.distance(last) < 1e-9, "{first}, {last}");
            } else {
                // At a face of the box.
                let off = |at: DVec2| {
                    (plane.index(at) / (SAMPLES - 1) as f64)
                        .to_array()
                        .map(|u| u.abs().min((u - 1.0).abs()))
                        .into_iter()
                        .fold(1.0, f64::min)
                };
                assert!(off(first) < 1e-9 && off(last) < 1e-9, "{first}, {last}");
                ends += 2;
            }
            let curve = Curve::of(plane, chain);
            assert!(curve.longest_piece_mm() < 0.2, "a jump of {} mm", curve.longest_piece_mm());
            length += curve.length_mm;
        }
        let truth = by_squares(&plane, STEP_MM);
        println!("{n}: {} curves, {ends} ends, {length:.3} mm, by squares {truth:.3}", chains.len());
        // Curves within one cell are not looked for, and squares that the box cuts have no length.
        let cut = ends as f64 * STEP_MM;
        assert!(length > 0.998 * truth && length < 1.002 * truth + cut, "{length} and {truth}");
    }
}
