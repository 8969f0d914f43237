//! The tricubic B-spline's isosurface against a spline of its own: coefficients from the tridiagonal systems, in float64, and rays searched in
//! small steps.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use bregma_renderer::{Camera, Clip, CpuRenderer, CutFace, GpuRenderer, Mode, Picture, Ray, Reconstruction, Renderer, Scene, Shape};
use bregma_session::{Opened, Source};
use bregma_tests::{Random, color_difference, data, volume};
use bregma_volume::{Grid, Progress, ReadSamples, Samples, Volume};
use glam::{DAffine3, DMat3, DVec3};
use std::sync::Arc;

/// The spline through a volume's values, which repeat in reverse beyond the grid.
struct Spline {
    dims: [usize; 3],
    coefficients: Vec<f64>,
    to_index: DAffine3,
}

/// A search's step: crossings nearer to each other than this are passed over.
const STEP_VOXEL: f64 = 1.0 / 128.0;

impl Spline {
    fn of(v: &Volume) -> Self {
        let dims = v.grid().dims();
        let mut c: Vec<f64> = (0..v.samples().len()).map(|n| v.value_of(v.samples().get_f64(n))).collect();
        for axis in 0..3 {
            let stride: usize = dims[..axis].iter().product();
            for start in (0..c.len()).filter(|n| (n / stride).is_multiple_of(dims[axis])) {
                let line: Vec<f64> = (0..dims[axis]).map(|n| c[start + n * stride]).collect();
                coefficients_of(&line).into_iter().enumerate().for_each(|(n, v)| c[start + n * stride] = v);
            }
        }
        Self { dims, coefficients: c, to_index: v.grid().world_to_index() }
    }

    /// At a point in index space, within the box.
    fn value(&self, p: DVec3) -> f64 {
        let mut along = [[(0, 0.0); 4]; 3];
        for a in 0..3 {
            let cell = p[a].floor().clamp(0.0, self.dims[a] as f64 - 2.0);
            for (n, place) in along[a].iter_mut().enumerate() {
                let at = cell + n as f64 - 1.0;
                // The cubic B-spline around a sample, from its definition.
                let d = (p[a] - at).abs();
                let weight = if d < 1.0 { 2.0 / 3.0 - d * d + d * d * d / 2.0 } else { (2.0 - d).max(0.0).powi(3) / 6.0 };
                *place = (at.clamp(0.0, self.dims[a] as f64 - 1.0) as usize, weight);
            }
        }
        let mut sum = 0.0;
        for (z, wz) in along[2] {
            for (y, wy) in along[1] {
                let row = (z * self.dims[1] + y) * self.dims[0];
                sum += wz * wy * along[0].iter().map(|(x, wx)| wx * self.coefficients[row + x]).sum::<f64>();
            }
        }
        sum
    }

    /// Where a ray first meets what is at least `iso`, mm, and how far it is inside there, in voxels; and the largest value that it sees before,
    /// or at all.
    fn first(&self, ray: &Ray, iso: f64) -> Option<(f64, f64)> {
        let (o, d) = (self.to_index.transform_point3(ray.origin.0), self.to_index.transform_vector3(ray.direction));
        let last = DVec3::from(self.dims.map(|n| n as f64 - 1.0));
        let (a, b) = (-o / d, (last - o) / d);
        let (from, to) = (a.min(b).max_element().max(0.0), a.max(b).min_element());
        if from >= to {
            return None;
        }
        let at = |t: f64| self.value((o + t * d).clamp(DVec3::ZERO, last)) - iso;
        let steps = ((to - from) * d.length() / STEP_VOXEL).ceil() as usize;
        let place = |n: usize| from + (to - from) * n as f64 / steps as f64;
        let first = (0..=steps).find(|n| at(place(*n)) >= 0.0)?;
        let behind = (first..=steps).find(|n| at(place(*n)) < 0.0).unwrap_or(steps);
        let (mut low, mut high) = (place(first.saturating_sub(1)), place(first));
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if at(middle) >= 0.0 { high = middle } else { low = middle }
        }
        Some((if first == 0 { from } else { high }, (place(behind) - high) * d.length()))
    }

    /// How far before or behind a depth the ray is nearest to the isovalue, in voxels, as far as the slope there tells.
    fn off(&self, ray: &Ray, iso: f64, t: f64) -> f64 {
        let (o, d) = (self.to_index.transform_point3(ray.origin.0), self.to_index.transform_vector3(ray.direction));
        let step = 1e-4 / d.length();
        let at = |t: f64| self.value(o + t * d) - iso;
        (at(t) / ((at(t + step) - at(t - step)) / 2e-4)).abs()
    }
}

/// Solves (c[n−1] + 4c[n] + c[n+1]) / 6 = f[n], where c[−1] = c[0] and c[n] = c[n−1] at the ends (Thomas's algorithm).
fn coefficients_of(f: &[f64]) -> Vec<f64> {
    let n = f.len();
    let diagonal = |k: usize| 4.0 + f64::from(u8::from(k == 0)) + f64::from(u8::from(k + 1 == n));
    let (mut upper, mut c) = (vec![0.0; n], vec![0.0; n]);
    for k in 0..n {
        let (u, v) = if k == 0 { (0.0, 0.0) } else { (upper[k - 1], c[k - 1]) };
        let pivot = diagonal(k) - u;
        upper[k] = 1.0 / pivot;
        c[k] = (6.0 * f[k] - v) / pivot;
    }
    for k in (0..n.saturating_sub(1)).rev() {
        c[k] -= upper[k] * c[k + 1];
    }
    c
}

#[derive(Default, Debug)]
struct Found {
    hits: usize,
    worst_voxel: f64,
    /// Passed over: what is thinner than the tolerance for two crossings.
    thin: usize,
    missed: usize,
    false_: usize,
}

/// Compares some pixels of a picture with the reference.
fn compare(v: &Volume, scene: &Scene, picture: &Picture, pixels: usize) -> Found {
    let (spline, iso) = (Spline::of(v), scene.layers[0].iso);
    let mut random = Random(17);
    let mut found = Found::default();
    for _ in 0..pixels {
        let (x, y) = ((random.unit() * f64::from(picture.width)) as u32, (random.unit() * f64::from(picture.height)) as u32);
        let ray = scene.camera.ray(f64::from(x), f64::from(y), picture.width, picture.height);
        let depth = f64::from(picture.depth_mm[(y * picture.width + x) as usize]);
        let voxels_per_mm = spline.to_index.transform_vector3(ray.direction).length();
        let off_voxel = |t: f64| (depth - t).abs() * voxels_per_mm;
        let of_kind = match spline.first(&ray, iso) {
            None if depth.is_nan() => continue,
            Some((t, _)) if off_voxel(t) < 1e-3 => {
                found.worst_voxel = found.worst_voxel.max(off_voxel(t));
                &mut found.hits
            }
            // What the reference does not see, or only behind.
            other if !depth.is_nan() && other.is_none_or(|(t, _)| depth < t) => {
                if spline.off(&ray, iso, depth) < 1e-3 {
                    &mut found.thin
                } else {
                    &mut found.false_
                }
            }
            Some((_, thickness)) if thickness < 2.0 * STEP_VOXEL => &mut found.thin,
            _ => &mut found.missed,
        };
        *of_kind += 1;
    }
    found
}

fn backends() -> Vec<Box<dyn Renderer>> {
    vec![Box::new(CpuRenderer::default()), Box::new(GpuRenderer::new(true).unwrap())]
}

fn scene_of(v: &Arc<Volume>, iso: f64, orbit: [f64; 2]) -> Scene {
    let mut scene = Scene::of(std::slice::from_ref(v));
    let bounds = bregma_renderer::Bounds::of([v.grid()]);
    (scene.layers[0].iso, scene.reconstruction) = (iso, Reconstruction::Spline);
    scene.camera = Camera::orbit(&bounds, orbit[0], orbit[1]);
    scene
}

fn check(v: &Arc<Volume>, iso: f64, pixels: usize) {
    for renderer in &mut backends() {
        for orbit in [[20.0, 10.0], [135.0, -40.0]] {
            let scene = scene_of(v, iso, orbit);
            let picture = renderer.render(std::slice::from_ref(v), &scene, 400, 320).unwrap();
            let found = compare(v, &scene, &picture, pixels);
            println!("{} by {}: {found:?}", v.name(), renderer.backend());
            assert!(found.hits > pixels / 20, "too little is seen to judge");
            assert_eq!((found.missed, found.false_), (0, 0));
            assert!(found.thin * 500 <= pixels, "more than 1 in 500 rays graze");
        }
    }
}

/// Noise from sample to sample, as fast as it can change.
fn noise() -> Arc<Volume> {
    let mut random = Random(23);
    let dims = [19, 22, 17];
    let shear = DMat3::from_cols(DVec3::new(0.9, 0.1, 0.0), DVec3::new(-0.1, 1.1, 0.2), DVec3::new(0.15, 0.0, 1.4));
    let grid = Grid::from_affine(dims, DAffine3::from_mat3(shear)).unwrap();
    let samples = (0..dims.iter().product()).map(|_| (1000.0 * random.unit()) as i16).collect();
    volume("noise", grid, Samples::I16(samples))
}

/// Balls on a coarse grid, with inverted values: what is inside is lower.
fn balls(sign: f32) -> Arc<Volume> {
    let n = 40;
    let grid = Grid::new([n; 3], DVec3::splat(0.5), DVec3::ZERO, DMat3::IDENTITY).unwrap();
    let value = |k: usize| {
        let p = DVec3::new((k % n) as f64, (k / n % n) as f64, (k / (n * n)) as f64);
        let near = [[12.0, 12.0, 15.0], [25.0, 20.0, 22.0], [28.0, 31.0, 12.0]].map(|c| p.distance(DVec3::from(c)));
        sign * (9.0 - near.into_iter().fold(f64::INFINITY, f64::min) as f32).clamp(-4.0, 4.0)
    };
    let samples = Samples::F32((0..n * n * n).map(value).collect());
    let raster = bregma_volume::Raster {
        grid,
        samples,
        slope: f64::from(sign) * 50.0,
        intercept: 7.0,
        unit: bregma_volume::Unit::Value,
        warnings: vec![],
    };
    Arc::new(Volume::new("balls".into(), "test", raster).unwrap())
}

#[test]
fn the_splines_surface_is_where_a_reference_in_float64_has_it() {
    // Fails if a coefficient, a border, the search for the first crossing or a shader's half of it is wrong, or a cell that the spline reaches
    // is left out. In noise half of all rays begin inside.
    check(&noise(), 780.0, 3000);
    check(&balls(1.0), 57.0, 1500);
    check(&balls(-1.0), 57.0, 1500);
}

#[test]
fn real_scans_have_the_splines_surface_too() {
    let Some(folder) = data("the spline on real scans") else { return };
    for (file, iso) in [("cranium-invesalius/Cranium.nhdr", 226.0), ("cthead-unc/CThead.nhdr", 1150.0)] {
        let source = Source { file: folder.join(file), ..Source::default() };
        let opened = Opened::read(&[source], &Progress::default()).unwrap();
        check(&opened.volumes[0], iso, 1000);
    }
}

#[test]
fn both_backends_draw_the_same_spline() {
    // Fails if shadows, normals, the section's face or the overlay take the interpolant, or something else, on one backend alone.
    let volumes = [noise(), balls(1.0)];
    let mut scene = Scene::of(&volumes);
    scene.reconstruction = Reconstruction::Spline;
    (scene.layers[0].iso, scene.layers[1].iso) = (900.0, 57.0);
    scene.camera = Camera::orbit(&bregma_renderer::Bounds::of(volumes.iter().map(|v| v.grid())), 30.0, 20.0);
    let [mut cpu, mut gpu] = <[_; 2]>::try_from(backends()).ok().unwrap();
    let plane = Clip::all(Shape::Plane { normal: DVec3::new(0.3, -0.8, 0.52).normalize(), offset_mm: -1.0 });
    let (mut differ, mut all) = (0, 0);
    for (mode, shadows, face) in
        [(Mode::Iso, true, CutFace::Bone), (Mode::Overlay, false, CutFace::Density), (Mode::Iso, false, CutFace::Blend)]
    {
        for clips in [vec![], vec![plane.clone()]] {
            (scene.mode, scene.shadows, scene.cut_face, scene.clips) = (mode, shadows, face, clips);
            let [a, b] = [&mut cpu, &mut gpu].map(|r| r.render(&volumes, &scene, 240, 200).unwrap());
            differ += a.rgba.iter().zip(&b.rgba).filter(|(a, b)| color_difference(**a, **b) > 2).count();
            all += a.rgba.len();
            assert!(a.volume_id.iter().filter(|id| **id > 0).count() > a.volume_id.len() / 20, "too little is seen");
        }
    }
    println!("{differ} of {all} pixels differ by more than 2/255");
    assert!(differ * 10_000 <= all);
}

#[test]
fn samples_too_large_for_a_spline_are_told() {
    // Fails if coefficients that float32 does not hold make another surface, or stop the program.
    let grid = Grid::new([6; 3], DVec3::ONE, DVec3::ZERO, DMat3::IDENTITY).unwrap();
    let volumes =
        [volume("huge", grid, Samples::F32((0..216).map(|n| if (n + n / 6 + n / 36) % 2 == 0 { 5e36 } else { -5e36 }).collect()))];
    let scene = scene_of(&volumes[0], 0.0, [20.0, 10.0]);
    let error = CpuRenderer::default().render(&volumes, &scene, 20, 20).unwrap_err().to_string();
    assert!(error.contains("huge") && error.contains("--reconstruction"), "{error}");
}
