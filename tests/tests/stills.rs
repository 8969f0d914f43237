//! Pictures of several points of each pixel: against the mean of their samples, and against pictures of many more pixels.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use bregma_renderer::{CpuRenderer, GpuRenderer, Integrator, Mode, Picture, Renderer, Scene, point_in_pixel};
use bregma_session::Opened;
use bregma_volume::Volume;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// One test at a time: one is timed, and another beside it would be timed with it.
fn alone() -> MutexGuard<'static, ()> {
    static ALONE: Mutex<()> = Mutex::new(());
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

fn renderers() -> [Box<dyn Renderer>; 2] {
    [Box::new(CpuRenderer::default()), Box::new(GpuRenderer::new(true).expect("a software Vulkan driver is installed by tests/run"))]
}

fn pair() -> (Vec<Arc<Volume>>, Scene) {
    let opened = Opened::demo(48, &Default::default()).unwrap();
    (opened.volumes, opened.scene)
}

/// The light of a pixel, premultiplied, from the definition of sRGB.
fn light(pixel: [u8; 4]) -> [f64; 4] {
    let alpha = f64::from(pixel[3]) / 255.0;
    let linear = |c: f64| if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) };
    [0, 1, 2, 3].map(|n| if n < 3 { linear(f64::from(pixel[n]) / 255.0) * alpha } else { alpha })
}

/// The bytes of such light, unrounded.
fn bytes(light: [f64; 4]) -> [f64; 4] {
    let alpha = light[3];
    let encoded = |c: f64| if c <= 0.0031308 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
    [0, 1, 2, 3].map(|n| {
        255.0
            * if n == 3 {
                alpha
            } else if alpha > 0.0 {
                encoded(light[n] / alpha)
            } else {
                0.0
            }
    })
}

fn mean(pixels: impl Iterator<Item = [u8; 4]>) -> [f64; 4] {
    let (mut sum, mut count) = ([0.0; 4], 0.0);
    for pixel in pixels {
        let light = light(pixel);
        (0..4).for_each(|n| sum[n] += light[n]);
        count += 1.0;
    }
    sum.map(|s| s / count)
}

#[test]
fn a_still_is_the_mean_of_its_samples_and_looks_through_even_points() {
    let _alone = alone();
    // Fails if light is averaged as bytes, a sample is left out or counted twice, alpha is forgotten, or all look through one point; or if depths
    // or volumes are no more those of the pixels' middles.
    let (volumes, base) = pair();
    let (w, h, count) = (96, 80, 16);
    let dvr = Scene { mode: Mode::Dvr, integrator: Integrator::Steps { per_voxel: 1.0, jitter: true }, ..base.clone() };
    let looks = [
        Scene { mode: Mode::Iso, background: None, ..base.clone() },
        Scene { mode: Mode::Overlay, shadows: true, ..base.clone() },
        Scene { mode: Mode::Transparent, background: None, ..base.clone() },
        Scene { mode: Mode::Xray, ..base.clone() },
        dvr,
    ];
    let mut farthest = 0.0_f64;
    for mut renderer in renderers() {
        for scene in &looks {
            let still = renderer.still(&volumes, scene, [w, h], count).unwrap();
            let samples: Vec<Picture> = (0..count).map(|n| renderer.sample(&volumes, scene, [w, h], n).unwrap()).collect();
            assert!(samples[0] == renderer.render(&volumes, scene, w, h).unwrap() || still.depth_mm.iter().any(|d| d.is_nan()));
            let equal = |a: &[f32], b: &[f32]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits());
            assert!(still.volume_id == samples[0].volume_id && equal(&still.depth_mm, &samples[0].depth_mm), "{:?}", scene.mode);
            assert!(equal(&still.values, &samples[0].values));
            for (n, pixel) in still.rgba.iter().enumerate() {
                let expected = bytes(mean(samples.iter().map(|sample| sample.rgba[n])));
                let off = (0..4).map(|c| (f64::from(pixel[c]) - expected[c]).abs()).fold(0.0, f64::max);
                farthest = farthest.max(off);
                assert!(off <= 1.0, "{} {:?}: pixel {n} is {pixel:?}, the mean {expected:?}", renderer.name(), scene.mode);
            }
            let moved = samples[1].rgba.iter().zip(&samples[0].rgba).filter(|(a, b)| a != b).count();
            assert!(moved > 100, "{:?}: only {moved} pixels differ from sample to sample", scene.mode);
        }
    }
    println!("at most {farthest:.2} of 255 from the mean of {count} exact samples");
}

#[test]
fn points_of_a_pixel_lie_evenly_from_the_first_on() {
    let _alone = alone();
    // Fails if the points leave half a pixel empty, lie twice at one place, or the first is not the middle.
    assert_eq!(point_in_pixel(0), [0.0; 2]);
    for count in [16, 64, 256] {
        let points: Vec<_> = (0..count).map(point_in_pixel).collect();
        assert!(points.iter().flatten().all(|v| (-0.5..=0.5).contains(v)));
        // The part of the points on one side of any line, against the part of the pixel there.
        let (mut worst, mut sum, fine) = (0.0_f64, 0.0, 64);
        for turn in 0..32 {
            let (sin, cos) = (f64::from(turn) * std::f64::consts::PI / 16.0).sin_cos();
            for step in -12..=12 {
                let offset = f64::from(step) / 20.0;
                let is_there = |[x, y]: [f64; 2]| cos * x + sin * y < offset;
                let middle = |n: i32| (f64::from(n) + 0.5) / f64::from(fine) - 0.5;
                let area =
                    (0..fine * fine).filter(|n| is_there([middle(n % fine), middle(n / fine)])).count() as f64 / f64::from(fine * fine);
                let part = points.iter().filter(|p| is_there(**p)).count() as f64 / f64::from(count);
                (worst, sum) = (worst.max((part - area).abs()), sum + (part - area).abs());
            }
        }
        let mean = sum / (32.0 * 25.0);
        println!("{count} points: a half plane's part is {worst:.3} off at most, {mean:.4} in the mean");
        // Half a row of 16 points lies beside a line along it: no set of them is better there by much. Points by chance would be 0.4/√n off in the mean.
        assert!(worst <= 0.25 * (16.0 / f64::from(count)).sqrt() && mean < 0.2 / f64::from(count).powf(0.6), "{count}: {worst} {mean}");
    }
}

#[test]
fn edges_become_what_many_pixels_show_of_them() {
    let _alone = alone();
    // Fails if the points are not where they are said to be: shifted by half a pixel, mirrored, or all in one row. The truth is a picture of 16 times
    // as many pixels across, each seen through its middle.
    let (volumes, base) = pair();
    let scene = Scene { mode: Mode::Iso, background: None, ..base };
    let (w, h, fine) = (60, 50, 16);
    for mut renderer in renderers() {
        let large = renderer.render(&volumes, &scene, w * fine, h * fine).unwrap();
        let covered = |n: u32| {
            let (x0, y0) = (n % w * fine, n / w * fine);
            let alphas = (0..fine * fine).map(|k| large.rgba[((y0 + k / fine) * w * fine + x0 + k % fine) as usize]);
            mean(alphas)[3]
        };
        let mut off = |samples: u32| {
            let still = renderer.still(&volumes, &scene, [w, h], samples).unwrap();
            let off: Vec<f64> = (0..w * h).map(|n| (f64::from(still.rgba[n as usize][3]) / 255.0 - covered(n)).abs()).collect();
            (off.iter().fold(0.0, |m: f64, v| m.max(*v)), off.iter().sum::<f64>() / off.len() as f64)
        };
        let (once, smooth, fine) = (off(1), off(16), off(64));
        println!(
            "{}: share of a pixel that is covered: 1 sample {once:.4?}, 16 {smooth:.4?}, 64 {fine:.4?} off (at most, mean)",
            renderer.name()
        );
        assert!(once.0 > 0.4 && smooth.0 < 0.26 && fine.0 < 0.1, "{once:?} {smooth:?} {fine:?}");
        assert!(smooth.1 < once.1 / 4.0 && fine.1 < smooth.1 / 1.5);
    }
}

#[test]
fn sixteen_samples_take_no_longer_than_sixteen_frames() {
    let _alone = alone();
    // Fails if something beside the samples costs. The size of the skull on a full screen is timed by the same code with BREGMA_LARGE=1.
    let is_large = std::env::var_os("BREGMA_LARGE").is_some();
    let (side, size) = if is_large { (256, [1600, 1200]) } else { (96, [800, 600]) };
    let opened = Opened::demo(side, &Default::default()).unwrap();
    let (volumes, mut scene) = (opened.volumes[..1].to_vec(), opened.scene);
    scene.layers.truncate(1);
    scene.mode = Mode::Iso;
    for mut renderer in renderers() {
        let mut time = |samples: u32| {
            let begun = Instant::now();
            renderer.still(&volumes, &scene, size, samples).unwrap();
            begun.elapsed().as_secs_f64() * 1e3
        };
        time(2);
        // In turn, so that what else the machine does weighs on both.
        let mut ratios: Vec<[f64; 2]> = (0..5).map(|_| [time(1), time(16)]).collect();
        ratios.sort_by(|a, b| (a[1] / a[0]).total_cmp(&(b[1] / b[0])));
        let [one, sixteen] = ratios[2];
        println!("{}: {size:?} of {side}³: one frame {one:.1} ms, 16 samples {sixteen:.1} ms, {:.1} times", renderer.name(), sixteen / one);
        // A quarter for what a machine with other work adds.
        assert!(sixteen / one <= 20.0, "{ratios:?}");
    }
}
