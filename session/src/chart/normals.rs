//! What each gradient costs that shades a surface, and how far it is from the phantom's own normal.

use super::scatter::{Figure, Mark};
use super::{ChartError, orbit};
use bregma_field::{Progress, Volume};
use bregma_renderer::{Backend, Bounds, Color, Light, Mode, Normals, Picture, Reconstruction, Renderer, Scene};
use bregma_synthetic::{Skull, Which, ct::Field};
use glam::{DVec3, Vec3};
use std::sync::Arc;
use std::time::Instant;

/// One gradient on one backend.
#[derive(Clone, Debug)]
pub struct Point {
    /// `smooth`, `analytic` or `spline`.
    pub name: &'static str,
    /// What drew.
    pub backend: Backend,
    /// The fastest time of the first view's frame.
    pub ms_per_frame: f64,
    /// The angles to the phantom's normals that half of all pixels' are below.
    pub half_deg: f64,
    /// And 95 %.
    pub most_deg: f64,
    /// Pixels that were compared.
    pub pixels: usize,
}

/// The gradients, and the surfaces that they are of.
const GRADIENTS: [(&str, Normals, Reconstruction); 3] = [
    ("analytic", Normals::Analytic, Reconstruction::Trilinear),
    ("smooth", Normals::Smooth, Reconstruction::Trilinear),
    ("spline", Normals::Smooth, Reconstruction::Spline),
];

/// Samples along each side of the phantom's scan.
const PHANTOM: usize = 160;
/// Between air and bone.
const BONE_HU: f64 = 300.0;
/// Times that a frame is timed.
const ROUNDS: usize = 5;
/// So far to either side the phantom's slope is taken: well below its finest parts, and far above what float64 rounds.
const ASIDE_MM: f64 = 0.05;

/// Measures all gradients on all machines over `frames` views of `size` pixels across of the first phantom's scan, with its scanner's noise and
/// blur.
pub fn measure(frames: u32, size: u32, machines: &mut [Box<dyn Renderer>], progress: &Progress) -> Result<Vec<Point>, ChartError> {
    let volumes = [Arc::new(bregma_synthetic::skull(Which::A, PHANTOM, progress)?)];
    let field = Skull::new(Which::A);
    let mut scene = Scene { mode: Mode::Iso, ..Scene::of(&volumes) };
    scene.layers[0].iso = BONE_HU;
    scene.layers[0].color = Color([1.0; 3]);
    let cameras = orbit(&Bounds::of([volumes[0].grid()]), frames);
    progress.begin((machines.len() * GRADIENTS.len()) as u64);
    let mut points = vec![];
    for machine in machines {
        for (name, normals, reconstruction) in GRADIENTS {
            let scene = Scene { normals, reconstruction, ..scene.clone() };
            let mut off_deg = vec![];
            for camera in &cameras {
                off_deg.extend(off(&volumes, &Scene { camera: *camera, ..scene.clone() }, size, machine.as_mut(), &field)?);
            }
            let scene = Scene { camera: cameras[0], ..scene };
            let mut fastest = f64::INFINITY;
            for _ in 0..ROUNDS {
                let begun = Instant::now();
                machine.render(&volumes, &scene, size, size)?;
                fastest = fastest.min(begun.elapsed().as_secs_f64() * 1e3);
            }
            off_deg.sort_by(f64::total_cmp);
            let part = |part: f64| off_deg.get((off_deg.len().saturating_sub(1) as f64 * part) as usize).copied().unwrap_or(f64::NAN);
            let (half_deg, most_deg) = (part(0.5), part(0.95));
            points.push(Point { name, backend: machine.backend(), ms_per_frame: fastest, half_deg, most_deg, pixels: off_deg.len() });
            progress.advance(1)?;
        }
    }
    Ok(points)
}

/// The angles between the normals that a picture is shaded by and the phantom's own where it shows bone.
fn off(volumes: &[Arc<Volume>], scene: &Scene, size: u32, machine: &mut dyn Renderer, field: &Skull) -> Result<Vec<f64>, ChartError> {
    // Lambert's law alone: what five lamps make of a white surface is its normal, to the third of a degree that bytes resolve.
    let mut lit = |toward: Vec3| {
        let light = Light { toward, ambient: 0.0, diffuse: 1.0, specular: 0.0, shininess: 1.0, ..Light::default() };
        machine.render(volumes, &Scene { light, ..scene.clone() }, size, size)
    };
    let [right, left, up, down, back] = [lit(Vec3::X)?, lit(-Vec3::X)?, lit(Vec3::Y)?, lit(-Vec3::Y)?, lit(Vec3::Z)?];
    let basis = scene.camera.basis();
    let distance = |p: DVec3| field.material(p).distance_mm;
    let light = |picture: &Picture, n: usize| Color(std::array::from_fn(|c| f32::from(picture.rgba[n][c]) / 255.0)).linear().x;
    let angle = |n: usize| {
        let cosines = [light(&right, n) - light(&left, n), light(&up, n) - light(&down, n), light(&back, n)].map(f64::from);
        let normal = (cosines[0] * basis.right + cosines[1] * basis.up - cosines[2] * basis.forward).try_normalize()?;
        let ray = scene.camera.ray(f64::from(n as u32 % size), f64::from(n as u32 / size), size, size);
        let p = ray.origin.0 + f64::from(right.depth_mm[n]) * ray.direction;
        let slope = DVec3::from_array(DVec3::AXES.map(|a| distance(p + ASIDE_MM * a) - distance(p - ASIDE_MM * a)));
        Some(normal.dot(slope.try_normalize()?).clamp(-1.0, 1.0).acos().to_degrees())
    };
    Ok((0..right.rgba.len()).filter(|n| right.volume_id[*n] > 0).filter_map(angle).collect())
}

/// The numbers.
pub fn csv(points: &[Point]) -> String {
    let row = |p: &Point| format!("{},{},{:.3},{:.3},{:.3},{}\n", p.name, p.backend, p.ms_per_frame, p.half_deg, p.most_deg, p.pixels);
    let rows: String = points.iter().map(row).collect();
    format!("normals,backend,ms_per_frame,median_deg,percentile_95_deg,pixels\n{rows}")
}

/// The figure.
pub fn figure(points: &[Point]) -> Figure {
    let mark = |p: &Point| Mark {
        name: format!("{} {:.1}°", p.name, p.half_deg),
        backend: p.backend,
        ms_per_frame: p.ms_per_frame,
        off: p.half_deg,
        is_joined: false,
    };
    Figure {
        caption: "Normals against the phantom's own",
        off: "degrees off, in the middle",
        legend: "gradients",
        marks: points.iter().map(mark).collect(),
    }
}
