use super::*;
use bregma_synthetic::Random;
use bregma_volume::{Grid, Raster, ReadSamples, Unit};
use glam::{DMat3, DVec3};

fn volume(dims: [usize; 3], spacing_mm: DVec3, samples: Samples) -> Volume {
    let grid = Grid::new(dims, spacing_mm, DVec3::ZERO, DMat3::IDENTITY).unwrap();
    Volume::new("test".into(), "test", Raster { grid, samples, slope: 2.0, intercept: 5.0, unit: Unit::Value, warnings: vec![] }).unwrap()
}

fn floats(volume: &Volume) -> Vec<f32> {
    let Samples::F32(samples) = volume.samples() else { panic!("the samples are floats") };
    samples.clone()
}

/// A sample of a grid whose nearest one stands for those beyond it.
fn beyond<T: Copy>(samples: &[T], dims: [usize; 3], at: [isize; 3]) -> T {
    let [i, j, k] = [0, 1, 2].map(|a| at[a].clamp(0, dims[a] as isize - 1) as usize);
    samples[i + dims[0] * (j + dims[1] * k)]
}

fn place(n: usize, dims: [usize; 3]) -> [isize; 3] {
    [n % dims[0], n / dims[0] % dims[1], n / (dims[0] * dims[1])].map(|x| x as isize)
}

const GRIDS: [[usize; 3]; 5] = [[7, 6, 19], [5, 1, 4], [1, 1, 9], [2, 2, 2], [17, 3, 1]];

#[test]
fn the_kernel_has_its_variance_and_the_weights_of_bessel() {
    // Fails if the recurrence runs over, weights do not sum up to 1, or their variance is another: that of e⁻ᵗ·Iₙ(t) is t, whatever t.
    for variance in [1e-9, 0.01, 0.5, 1.0, 4.0, 100.0, 10_000.0] {
        let weights = gaussian::kernel(variance);
        let both = |power: i32| 2.0 * weights.iter().enumerate().skip(1).map(|(n, w)| f64::from(*w) * (n as f64).powi(power)).sum::<f64>();
        assert!((f64::from(weights[0]) + both(0) - 1.0).abs() < 1e-5, "{variance}");
        // What is cut off is a hundred-thousandth, at four and a half deviations.
        assert!((both(2) / variance - 1.0).abs() < 1e-3 || both(2) - variance < 1e-6, "{variance}: {}", both(2));
    }
    // e⁻¹·I₀(1), e⁻¹·I₁(1) and e⁻¹·I₂(1), from Abramowitz and Stegun's table 9.8.
    let one = gaussian::kernel(1.0);
    for (found, known) in one.iter().zip([0.465_759_6, 0.207_910_4, 0.049_938_8]) {
        assert!((found - known).abs() < 1e-5, "{one:?}");
    }
}

#[test]
fn means_are_those_of_the_kernel_in_three_axes() {
    // Fails if an axis, its spacing or the border is another's.
    let mut random = Random(1);
    for dims in GRIDS {
        let samples: Vec<i16> = (0..dims.iter().product()).map(|_| (random.unit() * 2000.0 - 1000.0) as i16).collect();
        let spacing_mm = DVec3::new(0.5, 1.0, 2.0);
        let smooth =
            filtered(&volume(dims, spacing_mm, Samples::I16(samples.clone())), Filter::Gaussian { sigma_mm: 0.8 }, &Progress::default())
                .unwrap();
        let kernels = spacing_mm.to_array().map(|mm| gaussian::kernel((0.8 / mm).powi(2)));
        let weight = |axis: usize, n: isize| kernels[axis].get(n.unsigned_abs()).map_or(0.0, |w| f64::from(*w));
        for (n, found) in floats(&smooth).iter().enumerate() {
            let at = place(n, dims);
            let mut mean = 0.0;
            let reach = kernels.each_ref().map(|kernel| kernel.len() as isize - 1);
            for (z, y, x) in (-reach[2]..=reach[2])
                .flat_map(|z| (-reach[1]..=reach[1]).flat_map(move |y| (-reach[0]..=reach[0]).map(move |x| (z, y, x))))
            {
                let value = beyond(&samples, dims, [at[0] + x, at[1] + y, at[2] + z]);
                mean += weight(0, x) * weight(1, y) * weight(2, z) * f64::from(value);
            }
            assert!((f64::from(*found) - mean).abs() < 2e-3, "{dims:?} {at:?}: {found} {mean}");
        }
        assert_eq!(
            (smooth.slope(), smooth.name(), smooth.metadata()["Filtered"].as_str()),
            (2.0, "test (Gaussian 0.8 mm)", "Gaussian 0.8 mm")
        );
    }
}

#[test]
fn medians_are_the_middle_of_sorted_windows() {
    // Fails if a bit, a border or a type's order is wrong: the ends of each type, both zeros and negative floats are among the samples.
    let mut random = Random(2);
    for dims in GRIDS {
        for radius in [1, 2] {
            let raw: Vec<f32> = (0..dims.iter().product()).map(|_| (random.unit() * 65_536.0) as f32).collect();
            let types = [
                Samples::U8(raw.iter().map(|v| (v / 256.0) as u8).collect()),
                Samples::I16(raw.iter().map(|v| (v - 32_768.0) as i16).collect()),
                Samples::U16(raw.iter().map(|v| *v as u16).collect()),
                Samples::F32(raw.iter().map(|v| if *v < 3000.0 { -0.0 } else { (v - 32_768.0) * 1e-3 }).collect()),
            ];
            for samples in types {
                let found = filtered(&volume(dims, DVec3::ONE, samples.clone()), Filter::Median { radius }, &Progress::default()).unwrap();
                assert_eq!(found.type_name(), samples.type_name());
                let all: Vec<f64> = (0..samples.len()).map(|n| samples.get_f64(n)).collect();
                for n in 0..all.len() {
                    let (at, r) = (place(n, dims), radius as isize);
                    let near = (-r..=r).flat_map(|z| (-r..=r).flat_map(move |y| (-r..=r).map(move |x| [x, y, z])));
                    let mut window: Vec<f64> = near.map(|o| beyond(&all, dims, [0, 1, 2].map(|a| at[a] + o[a]))).collect();
                    window.sort_by(f64::total_cmp);
                    assert_eq!(found.samples().get_f64(n), window[window.len() / 2], "{dims:?} {radius} {}", samples.type_name());
                }
            }
        }
    }
}

/// A step of diffusion as its definition says it, sample by sample, in float64.
fn diffused(values: &[f64], dims: [usize; 3], spacing_mm: DVec3, conductance: f64, dt: f64) -> Vec<f64> {
    let at = |p: [isize; 3]| beyond(values, dims, p);
    let to = |p: [isize; 3], a: usize, by: isize| std::array::from_fn::<_, 3, _>(|x| p[x] + if x == a { by } else { 0 });
    let inside = |p: [isize; 3]| [0, 1, 2].map(|a| p[a].clamp(0, dims[a] as isize - 1));
    let central = |p: [isize; 3], a: usize| (at(to(p, a, 1)) - at(to(p, a, -1))) / 2.0 / spacing_mm[a];
    let squares: f64 = (0..values.len()).map(|n| (0..3).map(|a| central(place(n, dims), a).powi(2)).sum::<f64>()).sum();
    let steep = squares / values.len() as f64 * conductance * conductance;
    let flow = |p: [isize; 3], a: usize| {
        let q = inside(to(p, a, 1));
        let along = (at(q) - at(p)) / spacing_mm[a];
        let across: f64 = (0..3).filter(|&b| b != a).map(|b| (0.5 * (central(p, b) + central(q, b))).powi(2)).sum();
        if steep > 0.0 { along * (-(along * along + across) / (2.0 * steep)).exp() } else { 0.0 }
    };
    let one = |n: usize| {
        let p = place(n, dims);
        let before = |a: usize| if p[a] == 0 { 0.0 } else { flow(to(p, a, -1), a) };
        values[n] + dt * (0..3).map(|a| flow(p, a) - before(a)).sum::<f64>()
    };
    (0..values.len()).map(one).collect()
}

#[test]
fn diffusion_is_its_definition_and_loses_nothing() {
    // Fails if a flow is missed or counted twice, at borders of slabs above all, a gradient is another axis's, or all values together change.
    let mut random = Random(4);
    for dims in GRIDS {
        let samples: Vec<f32> = (0..dims.iter().product()).map(|_| (random.unit() * 100.0) as f32).collect();
        let spacing_mm = DVec3::new(0.8, 1.0, 1.3);
        let asked = Filter::Diffusion { iterations: 3, conductance: 1.3, time_step: 0.05 };
        let found = floats(&filtered(&volume(dims, spacing_mm, Samples::F32(samples.clone())), asked, &Progress::default()).unwrap());
        let mut expected: Vec<f64> = samples.iter().map(|&s| f64::from(s)).collect();
        for _ in 0..3 {
            expected = diffused(&expected, dims, spacing_mm, 1.3, 0.05);
        }
        for (n, (found, expected)) in found.iter().zip(&expected).enumerate() {
            assert!((f64::from(*found) - expected).abs() < 1e-3, "{dims:?} {n}: {found} {expected}");
        }
        let sum = |values: &[f32]| values.iter().map(|&v| f64::from(v)).sum::<f64>();
        assert!((sum(&found) / sum(&samples) - 1.0).abs() < 1e-5);
    }
    let flat = volume([4, 4, 4], DVec3::ONE, Samples::U8(vec![7; 64]));
    let still = filtered(&flat, Filter::Diffusion { iterations: 2, conductance: 1.0, time_step: 0.06 }, &Progress::default()).unwrap();
    assert_eq!(floats(&still), [7.0; 64]);
}

#[test]
fn threads_change_nothing() {
    // Fails if a sum, or a sample, depends on how many threads there are.
    let mut random = Random(6);
    let dims = [33, 20, 41];
    let samples = Samples::F32((0..dims.iter().product()).map(|_| random.unit() as f32).collect());
    let volume = volume(dims, DVec3::new(0.5, 0.6, 0.7), samples);
    for filter in [
        Filter::Gaussian { sigma_mm: 0.9 },
        Filter::Median { radius: 1 },
        Filter::Diffusion { iterations: 3, conductance: 1.0, time_step: 0.03 },
    ] {
        let by = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            floats(&pool.install(|| filtered(&volume, filter, &Progress::default())).unwrap())
        };
        assert_eq!(by(1), by(8), "{filter}");
    }
}
