use super::*;
use bregma_field::{Raster, Unit, Volume};
use bregma_synthetic::Random;
use glam::{DAffine3, DMat3, DVec3};
use std::sync::Arc;

fn grid(dims: [usize; 3]) -> Grid {
    Grid::new(dims, DVec3::ONE, DVec3::ZERO, DMat3::IDENTITY).unwrap()
}

fn surface(dims: [usize; 3], samples: Samples, slope: f64, iso: f64) -> Surface {
    let raster = Raster { grid: grid(dims), samples, slope, intercept: 0.0, unit: Unit::Value, warnings: vec![] };
    Surface::new(&Arc::new(Volume::new("test".into(), "test", raster).unwrap()), iso, DAffine3::IDENTITY).unwrap()
}

fn islands(surface: &Surface) -> Islands {
    Islands::of_bone(surface, &Progress::default()).unwrap()
}

/// For each sample the number of its island from 1, by flood fill, the largest first.
fn flooded(dims: [usize; 3], inside: &[bool]) -> Vec<usize> {
    let [nx, ny, _] = dims;
    let at = |n: usize| [n % nx, n / nx % ny, n / (nx * ny)];
    let (mut found, mut sizes) = (vec![0; inside.len()], vec![]);
    for seed in 0..inside.len() {
        if !inside[seed] || found[seed] > 0 {
            continue;
        }
        let mut open = vec![seed];
        sizes.push(0);
        found[seed] = sizes.len();
        while let Some(n) = open.pop() {
            sizes[found[n] - 1] += 1;
            let near = |m: &usize| at(n).iter().zip(at(*m)).map(|(a, b)| a.abs_diff(b)).sum::<usize>() == 1;
            for m in (0..inside.len()).filter(near).filter(|&m| inside[m]) {
                if found[m] == 0 {
                    found[m] = found[n];
                    open.push(m);
                }
            }
        }
    }
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by_key(|&n| std::cmp::Reverse(sizes[n]));
    found.iter().map(|&n| order.iter().position(|&m| m + 1 == n).map_or(0, |place| place + 1)).collect()
}

fn numbers(islands: &Islands, dims: [usize; 3]) -> Vec<usize> {
    let chosen: Vec<(usize, String)> = (0..islands.sizes().len()).map(|n| (n, n.to_string())).collect();
    let labels = islands.labels(&grid(dims), &chosen).unwrap();
    let all = (0..dims.iter().product()).map(|n: usize| [n % dims[0], n / dims[0] % dims[1], n / (dims[0] * dims[1])]);
    all.map(|at| labels.number(at).into()).collect()
}

#[test]
fn islands_are_those_of_a_flood_fill_in_the_order_of_their_sizes() {
    // Fails if two runs that touch are not united, slabs are not joined, two that do not touch are, or sizes or their order are wrong. Grids of one
    // sample along an axis and of more slices than there are slabs are among these.
    let mut random = Random(3);
    for (dims, part) in
        [([7, 6, 5], 0.4), ([5, 4, 70], 0.3), ([1, 9, 8], 0.5), ([9, 1, 8], 0.5), ([30, 1, 1], 0.6), ([4, 5, 1], 0.6), ([6, 6, 6], 0.7)]
    {
        for _ in 0..5 {
            let samples: Vec<i16> = (0..dims.iter().product()).map(|_| (random.unit() * 1000.0) as i16).collect();
            let level = ((1.0 - part) * 1000.0_f64).round();
            let inside: Vec<bool> = samples.iter().map(|&s| f64::from(s) >= level).collect();
            let found = islands(&surface(dims, Samples::I16(samples), 1.0, level));
            let expected = flooded(dims, &inside);
            assert_eq!(numbers(&found, dims), expected, "{dims:?}");
            for (n, number) in expected.iter().enumerate() {
                let at = [n % dims[0], n / dims[0] % dims[1], n / (dims[0] * dims[1])];
                assert_eq!(found.at(at).map_or(0, |island| island + 1), *number);
            }
        }
    }
}

#[test]
fn what_is_inside_is_what_the_surface_says() {
    // Fails if a tie is outside, a level between two floats or two whole numbers is rounded to the wrong side, a falling scale turns bone and air round,
    // or a sample that is no number counts as bone.
    let sizes = |samples, slope, iso| islands(&surface([4, 1, 1], samples, slope, iso)).sizes().to_vec();
    assert_eq!(sizes(Samples::U8(vec![1, 5, 4, 9]), 1.0, 5.0), [1, 1]);
    assert_eq!(sizes(Samples::U8(vec![1, 5, 4, 9]), 1.0, 4.000_000_000_1), [1, 1]);
    assert_eq!(sizes(Samples::U8(vec![1, 5, 4, 9]), -1.0, -4.0), [1, 1]);
    assert_eq!(sizes(Samples::I16(vec![-7, -6, -7, -5]), 1.0, -6.5), [1, 1]);
    let near = [1.0_f32, 1.0_f32.next_up(), 0.0, 1.0_f32.next_down()];
    assert_eq!(sizes(Samples::F32(near.into()), 1.0, 1.0), [2]);
    assert_eq!(sizes(Samples::F32(near.into()), 1.0, 1.0 + f64::EPSILON), [1]);
    assert_eq!(sizes(Samples::F32(vec![f32::NAN, 2.0, 3.0, f32::NAN]), 1.0, 2.5), [1]);
    assert_eq!(sizes(Samples::U8(vec![3; 4]), 1.0, 3.0), [4]);
    let none = Islands::of_bone(&surface([2, 2, 2], Samples::U8((0..8).collect()), 1.0, 100.0), &Progress::default());
    assert_eq!(none.unwrap_err().to_string(), "test: none of its samples is bone at this isovalue; choose another");
}

#[test]
fn faces_join_always_and_diagonals_where_the_decider_says_so() {
    // Fails if neighbours that share a face are not joined by the interpolant, or what is said of diagonals is not so: along the saddle of a face, the
    // interpolant between two inner corners stays inside just where the product of theirs is at least that of the outer two.
    let mut random = Random(8);
    for _ in 0..2000 {
        let [a, c] = [0; 2].map(|_| random.unit());
        let [b, d] = [0; 2].map(|_| -random.unit() - 1e-9);
        let on_edge = |t: f64| a + (c - a) * t;
        assert!((0..=64).all(|n| on_edge(f64::from(n) / 64.0) >= 0.0));
        // Corners a (0, 0), b (1, 0), c (1, 1), d (0, 1).
        let face = |u: f64, v: f64| a * (1.0 - u) * (1.0 - v) + b * u * (1.0 - v) + c * u * v + d * (1.0 - u) * v;
        let whole = a + c - b - d;
        let saddle = face((a - d) / whole, (a - b) / whole);
        assert!((saddle >= 0.0) == (a * c >= b * d) || saddle.abs() < 1e-12, "{a} {b} {c} {d}: {saddle}");
        let samples = Samples::F32([a, b, d, c].map(|v| v as f32).into());
        assert_eq!(islands(&surface([2, 2, 1], samples, 1.0, 0.0)).sizes(), [1, 1]);
    }
}

#[test]
fn numbers_take_the_bytes_that_they_need() {
    // Fails if 255 parts do not fit a byte, 256 do, or the last one is another's.
    for (count, kind) in [(255, "u8"), (256, "u16")] {
        let samples: Vec<u8> = (0..2 * count).map(|n| (n % 2) as u8).collect();
        let found = islands(&surface([2 * count, 1, 1], Samples::U8(samples), 1.0, 1.0));
        let chosen: Vec<(usize, String)> = (0..count).map(|n| (n, format!("{n}"))).collect();
        let labels = found.labels(&grid([2 * count, 1, 1]), &chosen).unwrap();
        assert_eq!((labels.volume().type_name(), labels.number([2 * count - 1, 0, 0])), (kind, count as u16));
        assert_eq!(labels.parts().len(), count);
    }
}
