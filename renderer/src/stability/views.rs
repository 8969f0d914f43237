//! Families of pictures: volumes and views of them that are hard for a renderer.

use super::random::Random;
use crate::camera::{Camera, Projection};
use crate::scene::Scene;
use bregma_field::{Bounds, Grid, Raster, Samples, Unit, Volume};
use glam::{DAffine3, DMat3, DVec3};
use std::sync::Arc;

/// Volumes and a scene of them.
pub(super) struct View {
    pub volumes: Vec<Arc<Volume>>,
    pub scene: Scene,
}

/// A family of hard views.
pub(super) struct Family {
    pub name: &'static str,
    /// What is hard about it.
    pub about: &'static str,
    pub views: fn() -> Vec<View>,
}

/// A grid of unit spacing around the origin.
fn cubic(n: usize) -> Grid {
    grid([n; 3], DMat3::IDENTITY)
}

/// A grid around the origin whose axes are the columns of `axes`, in mm.
fn grid(dims: [usize; 3], axes: DMat3) -> Grid {
    let middle = DVec3::from_array(dims.map(|n| (n - 1) as f64 / 2.0));
    Grid::from_affine(dims, DAffine3::from_mat3_translation(axes, -(axes * middle))).expect("the families' grids are regular")
}

/// Samples of a formula of the index.
fn sampled<T>(grid: &Grid, f: impl FnMut(DVec3) -> T) -> Vec<T> {
    let [nx, ny, _] = grid.dims();
    (0..grid.len()).map(|n| DVec3::new((n % nx) as f64, (n / nx % ny) as f64, (n / (nx * ny)) as f64)).map(f).collect()
}

fn volume(grid: Grid, samples: Samples) -> Arc<Volume> {
    let raster = Raster { grid, samples, slope: 1.0, intercept: 0.0, unit: Unit::Value, warnings: vec![] };
    Arc::new(Volume::new("hard".into(), "made", raster).expect("the families' volumes are whole"))
}

/// Noise of the integers below `levels`.
fn noise(seed: u64, levels: u32) -> impl FnMut(DVec3) -> f32 {
    let mut random = Random(seed);
    move |_| random.below(levels) as f32
}

/// Noise in bytes, every cell as rough as can be.
fn rough(seed: u64, grid: Grid, levels: u32) -> Arc<Volume> {
    let mut noise = noise(seed, levels);
    let samples = sampled(&grid, |p| noise(p) as u8);
    volume(grid, Samples::U8(samples))
}

/// Smooth sheets and tunnels a few voxels wide, between −1.5 and 1.5: the gyroid (Schoen 1970).
fn gyroid(p: DVec3) -> f32 {
    let p = 0.7 * p;
    (p.x.sin() * p.y.cos() + p.y.sin() * p.z.cos() + p.z.sin() * p.x.cos()) as f32
}

fn smooth(grid: Grid) -> Arc<Volume> {
    let samples = sampled(&grid, gyroid);
    volume(grid, Samples::F32(samples))
}

fn view(volume: &Arc<Volume>, iso: f64, camera: Camera) -> View {
    let volumes = vec![Arc::clone(volume)];
    let mut scene = Scene { camera, ..Scene::of(&volumes) };
    scene.layers[0].iso = iso;
    View { volumes, scene }
}

/// Two views of a volume from outside.
fn around(volume: &Arc<Volume>, iso: f64) -> Vec<View> {
    let bounds = Bounds::of([volume.grid()]);
    [(35.0, 25.0), (200.0, -50.0)].map(|(azimuth, elevation)| view(volume, iso, Camera::orbit(&bounds, azimuth, elevation))).into()
}

/// An eye at `distance_mm` from the middle, with a field of view that the volume fills.
fn eye(volume: &Arc<Volume>, iso: f64, distance_mm: f64) -> View {
    let fov_deg = 2.0 * (Bounds::of([volume.grid()]).radius_mm / distance_mm).atan().to_degrees();
    let eye_mm = distance_mm * DVec3::new(0.48, -0.6, 0.64);
    view(volume, iso, Camera { eye_mm, target_mm: DVec3::ZERO, up: DVec3::Z, projection: Projection::Perspective { fov_deg } })
}

fn eyes(distance_mm: f64) -> Vec<View> {
    vec![eye(&rough(1, cubic(33), 255), 240.0, distance_mm), eye(&smooth(cubic(33)), 0.6, distance_mm)]
}

/// An orthographic view along `direction`, from `distance_mm` before `target_mm`, of 32 mm: a pixel is a quarter of a millimetre.
fn along(volume: &Arc<Volume>, iso: f64, direction: DVec3, target_mm: DVec3, distance_mm: f64) -> View {
    let up = if direction.z.abs() < direction.length() / 2.0 { DVec3::Z } else { DVec3::Y };
    let eye_mm = target_mm - distance_mm * direction;
    view(volume, iso, Camera { eye_mm, target_mm, up, projection: Projection::Orthographic { height_mm: 32.0 } })
}

/// Half a pixel: moves the rays of [`along`] onto the planes of the samples.
const ONTO_PLANES: DVec3 = DVec3::splat(0.125);

fn along_axes() -> Vec<View> {
    let volumes = [(rough(2, cubic(33), 3), 1.5), (rough(3, cubic(33), 3), 2.0), (smooth(cubic(33)), 0.6)];
    let directions = [DVec3::X, DVec3::NEG_Y, DVec3::Z];
    let views = volumes.iter().zip(directions).map(|((v, iso), d)| along(v, *iso, d, ONTO_PLANES, 100.0));
    views.chain([along(&volumes[0].0, 1.5, DVec3::NEG_X, ONTO_PLANES, 100.0)]).collect()
}

fn nearly_along_axes() -> Vec<View> {
    let volume = rough(4, cubic(33), 3);
    // Components that are −0, subnormal in float64 or float32, and about as small as counts as none.
    let directions = [
        DVec3::new(1.0, -0.0, -0.0),
        DVec3::new(1e-310, 1.0, -1e-310),
        DVec3::new(-1e-40, 1e-40, 1.0),
        DVec3::new(1.0, 1e-13, -1e-11),
        DVec3::new(1e-9, -1.0, 1e-7),
    ];
    // The target is the origin, or the difference of eye and target would round such components away.
    directions.map(|d| along(&volume, 1.5, d, DVec3::ZERO, 100.0)).into()
}

/// Grids sheared so that the world's y runs along the diagonal of faces, or of cells, while x and z stay index axes: with entries that
/// are whole numbers, rays along y pass exactly through edges and corners.
fn along_diagonals() -> Vec<View> {
    let of_faces = DMat3::from_cols(DVec3::X, DVec3::new(-1.0, 1.0, 0.0), DVec3::Z);
    let of_cells = DMat3::from_cols(DVec3::X, DVec3::new(-1.0, 1.0, -1.0), DVec3::Z);
    let volumes = [of_faces, of_cells].map(|axes| (rough(5, grid([33; 3], axes), 4), smooth(grid([33; 3], axes))));
    // Not 1.5: rays would touch the surface in saddles of cells, which float32 cannot decide though moving a ray sideways does not tell.
    let views = |(rough, smooth): &(Arc<Volume>, Arc<Volume>)| {
        [along(rough, 1.37, DVec3::Y, ONTO_PLANES, 100.0), along(smooth, 0.6, DVec3::NEG_Y, ONTO_PLANES, 100.0)]
    };
    volumes.iter().flat_map(views).collect()
}

fn starts_inside() -> Vec<View> {
    let volumes = [(rough(6, cubic(33), 255), 128.0), (smooth(cubic(33)), 0.3)];
    // Orthographic eyes on a plane through the middle, half of them in bone; and one in the midst of the bone.
    let planes = volumes.iter().flat_map(|(v, iso)| [DVec3::X, DVec3::new(0.6, 0.48, -0.64)].map(|d| along(v, *iso, d, d, 1.0)));
    planes.chain([eye(&smooth(cubic(33)), -1.6, 1.0)]).collect()
}

/// Surfaces in the borders between bricks of 8 cells, and a few units in the last place before and behind them.
fn brick_borders() -> Vec<View> {
    let ramp = |axis: usize| {
        let grid = grid([17, 18, 24], DMat3::IDENTITY);
        let samples = sampled(&grid, |p| p[axis] as f32);
        volume(grid, Samples::F32(samples))
    };
    let ulp = f64::from(f32::EPSILON) * 8.0;
    let isos = [8.0, 8.0 + 2.0 * ulp, 16.0 - 2.0 * ulp];
    (0..3).flat_map(|axis| around(&ramp(axis), isos[axis])).collect()
}

fn box_borders() -> Vec<View> {
    let grid = cubic(26);
    let mut noise = noise(7, 255);
    let walled = sampled(&grid, |p| if p.min_element() == 0.0 || p.max_element() == 25.0 { 255 } else { noise(p) as u8 });
    // Within the walls every ray ends at a face; where noise reaches the faces, in and beside their edges.
    [around(&volume(grid.clone(), Samples::U8(walled)), 128.0), around(&rough(7, grid, 255), 128.0)].into_iter().flatten().collect()
}

fn anisotropic() -> Vec<View> {
    let grid = grid([48, 40, 9], DMat3::from_diagonal(DVec3::new(0.1, 1.0, 10.0)));
    [around(&rough(8, grid.clone(), 255), 220.0), around(&smooth(grid), 0.6)].into_iter().flatten().collect()
}

fn sheared() -> Vec<View> {
    let axes = DMat3::from_cols(DVec3::new(0.8, 0.0, 0.0), DVec3::new(0.2, 0.6, 0.0), DVec3::new(0.0, -0.4, 1.3));
    let grid = grid([30, 41, 19], axes);
    [around(&rough(9, grid.clone(), 255), 220.0), around(&smooth(grid), 0.6)].into_iter().flatten().collect()
}

fn at_sample_values() -> Vec<View> {
    let volume = rough(10, cubic(33), 6);
    [3.0, 4.0].iter().flat_map(|&iso| around(&volume, iso)).collect()
}

fn extremes() -> Vec<View> {
    let grid = cubic(33);
    let mut noise = noise(11, 5);
    let samples = sampled(&grid, |p| [-32768, 32767, -1, 0, 1][noise(p) as usize]);
    let volume = volume(grid, Samples::I16(samples));
    [0.5, 0.0, 32766.5].iter().flat_map(|&iso| around(&volume, iso)).collect()
}

fn scaled(scale: f32) -> Vec<View> {
    let grid = cubic(33);
    let samples = sampled(&grid, |p| gyroid(p) * scale);
    around(&volume(grid, Samples::F32(samples)), f64::from(0.6 * scale))
}

fn mended() -> Vec<View> {
    let grid = cubic(33);
    let mut noise = noise(12, 40);
    let samples = sampled(&grid, |p| match noise(p) as u32 {
        0 => f32::NAN,
        1 => f32::INFINITY,
        2 => f32::NEG_INFINITY,
        3 => f32::MAX,
        _ => gyroid(p),
    });
    around(&volume(grid, Samples::F32(samples)), 0.6)
}

fn plateaus() -> Vec<View> {
    let grid = cubic(33);
    let samples = sampled(&grid, |p| (3.0 * gyroid(0.6 * p)).round() as i16);
    let volume = volume(grid, Samples::I16(samples));
    [1.0, 2.0].iter().flat_map(|&iso| around(&volume, iso)).collect()
}

/// Every family of pictures.
pub(super) const FAMILIES: &[Family] = &[
    Family { name: "eye at 1e1", about: "pictures from 10 voxels before the volume, noise and smooth", views: || eyes(26.5) },
    Family {
        name: "eye at 1e3",
        about: "from 1,000 voxels away; errors beyond the 3e-5 voxel that a float32 depth holds there",
        views: || eyes(1e3),
    },
    Family {
        name: "eye at 1e5",
        about: "from 100,000 voxels away; errors beyond the 4e-3 voxel that a float32 depth holds there",
        views: || eyes(1e5),
    },
    Family { name: "starts inside", about: "rays that begin within the volume, some of them in bone", views: starts_inside },
    Family { name: "axis rays", about: "rays along axes, in faces and edges of cells", views: along_axes },
    Family { name: "nearly axis rays", about: "directions with components of −0, subnormal, 1e-13 to 1e-7", views: nearly_along_axes },
    Family { name: "diagonal rays", about: "rays through edges and corners of cells", views: along_diagonals },
    Family { name: "brick borders", about: "planes at multiples of 8 voxels, and 2 units in the last place off", views: brick_borders },
    Family { name: "box borders", about: "bone at every face of the box, and noise cut by them", views: box_borders },
    Family { name: "anisotropic", about: "voxels of 0.1 × 1 × 10 mm", views: anisotropic },
    Family { name: "sheared", about: "grid axes that are not perpendicular", views: sheared },
    Family { name: "at sample values", about: "noise of 6 levels at an isovalue that samples have", views: at_sample_values },
    Family { name: "volume of 16-bit extremes", about: "samples of −32768, 32767 and −1 to 1", views: extremes },
    Family { name: "volume of 1e-30", about: "float32 samples of 1e-30", views: || scaled(1e-30) },
    Family { name: "volume of 1e30", about: "float32 samples of 1e30", views: || scaled(1e30) },
    Family { name: "not a number", about: "float32 samples with NaN and infinities, mended", views: mended },
    Family { name: "plateaus", about: "large flat regions at the isovalue", views: plateaus },
];
