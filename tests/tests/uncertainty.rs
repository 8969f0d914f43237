//! Lengths and their 95 % intervals against phantoms whose walls are known: shells, slabs and wedges in random poses, on random grids, with and
//! without blur and noise, at an isovalue that is off by its tolerance.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use bregma_measure::{Segment, iso_tolerance, probe};
use bregma_renderer::{Layer, Ray};
use bregma_session::{Opened, Source};
use bregma_synthetic::ct::{AIR_HU, Field, Material, Scanner};
use bregma_tests::{Random, data};
use bregma_volume::{Grid, Progress, Raster, Samples, Unit, Volume, WorldPoint};
use glam::{DAffine3, DMat3, DQuat, DVec3};
use std::sync::Arc;

const BONE_HU: f64 = 1200.0;
const POSES: usize = 1000;

/// A wall about the origin, across z, before it is turned.
#[derive(Clone, Copy, Debug)]
enum Shape {
    Slab,
    /// A part of a shell with this radius of its middle.
    Shell(f64),
    /// Two planes at this angle to each other.
    Wedge(f64),
}

#[derive(Clone, Copy, Debug)]
struct Wall {
    shape: Shape,
    thickness_mm: f64,
    turn: DQuat,
}

impl Wall {
    /// Outward normals of its two sides at the origin's, in the phantom's own axes.
    fn tilts(&self) -> [DVec3; 2] {
        let half = if let Shape::Wedge(angle) = self.shape { angle / 2.0 } else { 0.0 };
        [DVec3::new(half.sin(), 0.0, half.cos()), DVec3::new(half.sin(), 0.0, -half.cos())]
    }

    /// Signed distance, negative inside.
    fn distance(&self, p: DVec3) -> f64 {
        let (q, half) = (self.turn.conjugate() * p, self.thickness_mm / 2.0);
        match self.shape {
            Shape::Shell(radius) => (q.distance(DVec3::NEG_Z * radius) - radius).abs() - half,
            _ => self.tilts().map(|normal| (q - DVec3::Z * half * normal.z.signum()).dot(normal)).into_iter().fold(f64::MIN, f64::max),
        }
    }

    /// Where a ray is within the wall about the point at `inside`: outward in small steps, then by bisection.
    fn chord_mm(&self, ray: &Ray, inside: f64) -> [f64; 2] {
        let is_in = |t: f64| self.distance(ray.at(t).0) < 0.0;
        let end = |step: f64| {
            let (mut near, mut far) = (inside, inside + step);
            while is_in(far) {
                (near, far) = (far, far + step);
            }
            for _ in 0..60 {
                let middle = 0.5 * (near + far);
                if is_in(middle) { near = middle } else { far = middle }
            }
            near
        };
        let step = self.thickness_mm / 64.0;
        [end(-step), end(step)]
    }
}

impl Field for Wall {
    const LIPSCHITZ: f64 = 1.0;

    fn material(&self, p: DVec3) -> Material {
        Material { distance_mm: self.distance(p), inside_hu: BONE_HU }
    }
}

struct Pose {
    wall: Wall,
    grid: Grid,
    scanner: Scanner,
    ray: Ray,
    iso: f64,
    truth_mm: f64,
    /// Where the wall begins and ends, from the point of the ray that is nearest to the origin.
    ends_mm: [f64; 2],
    /// The thinnest wall that this scan can show along the ray, from what is known of the scanner.
    resolution_mm: f64,
}

fn normal(random: &mut Random) -> f64 {
    (-2.0 * (1.0 - random.unit()).ln()).sqrt() * (std::f64::consts::TAU * random.unit()).cos()
}

fn turn(random: &mut Random) -> DQuat {
    DQuat::from_xyzw(normal(random), normal(random), normal(random), normal(random)).normalize()
}

fn between(random: &mut Random, [low, high]: [f64; 2]) -> f64 {
    low * (high / low).powf(random.unit())
}

/// A wall of `thick` voxels.
fn pose(random: &mut Random, shape: usize, thick: [f64; 2]) -> Pose {
    // From 0.1 to 2 mm, up to three times longer along one axis than along another; every second grid sheared.
    let finest = between(random, [0.1, 2.0 / 3.0]);
    let spacing = DVec3::new(finest, finest * between(random, [1.0, 3.0]), finest * between(random, [1.0, 3.0]));
    let lean = if random.unit() < 0.5 { 0.35 * (random.unit() - 0.5) * 2.0 } else { 0.0 };
    let shear = DMat3::from_cols(DVec3::X, DVec3::Y, DVec3::new(0.0, lean.sin(), lean.cos()));
    let axes = DMat3::from_quat(turn(random)) * shear;
    let wall_turn = turn(random);
    let across = wall_turn * DVec3::Z;
    let along = |direction: DVec3| 1.0 / (DMat3::from_diagonal(spacing.recip()) * axes.inverse() * direction).length();
    let thickness_mm = along(across) * between(random, thick);
    let shape = match shape {
        0 => Shape::Slab,
        1 => Shape::Shell((thickness_mm / 2.0 + 6.0 * spacing.max_element()) * between(random, [1.0, 5.0])),
        _ => Shape::Wedge(0.1 + 0.3 * random.unit()),
    };
    let wall = Wall { shape, thickness_mm, turn: wall_turn };
    // Up to 45° off the normal, and a little beside the middle.
    let lean = DQuat::from_axis_angle(
        wall_turn * DVec3::new((6.3 * random.unit()).cos(), (6.3 * random.unit()).sin(), 0.0).normalize(),
        0.8 * random.unit(),
    );
    let direction = lean * across;
    let beside = wall_turn * DVec3::new(random.unit() - 0.5, random.unit() - 0.5, 0.0) * spacing.min_element();
    let far_mm = 100.0 * spacing.max_element();
    let ray = Ray::new(WorldPoint(beside - far_mm * direction), direction).unwrap();
    let chord_mm = wall.chord_mm(&ray, far_mm);
    let truth_mm = chord_mm[1] - chord_mm[0];
    // Room for the whole wall and six voxels of air on both sides.
    let half = (DMat3::from_diagonal(spacing.recip()) * axes.inverse() * (0.5 * truth_mm * direction)).abs() + 7.0;
    let dims = (2.0 * half.ceil() + 1.0).as_usizevec3().to_array();
    let offset = DVec3::new(random.unit(), random.unit(), random.unit()) - half.ceil();
    let matrix = axes * DMat3::from_diagonal(spacing);
    let grid = Grid::from_affine(dims, DAffine3::from_mat3_translation(matrix, matrix * offset)).unwrap();
    let mean = spacing.element_product().cbrt();
    let psf_sigma_mm = if random.unit() < 0.4 { 0.0 } else { mean * between(random, [0.25, 1.0]) };
    let noise_hu = if random.unit() < 0.4 { 0.0 } else { between(random, [5.0, 60.0]) };
    let scanner = Scanner { psf_sigma_mm, noise_hu, seed: (random.unit() * 1e9) as u64 };
    let blur = |n: DVec3| {
        let psf: f64 = DVec3::AXES.iter().map(|a| (axes * *a).normalize().dot(n).powi(2)).sum::<f64>() * psf_sigma_mm.powi(2);
        (psf + (matrix.transpose() * n).length_squared() / 12.0).sqrt()
    };
    let resolution = |n: DVec3| (2.354_82 * blur(n)).max(1.5 * along(n)) / n.dot(direction).abs();
    let resolution_mm = wall.tilts().map(|n| resolution(wall_turn * n)).into_iter().fold(0.0, f64::max);
    Pose { wall, grid, scanner, ray, iso: 0.0, truth_mm, ends_mm: chord_mm.map(|t| t + ray.direction.dot(ray.origin.0)), resolution_mm }
}

/// A scan of the pose, whose isovalue is chosen.
fn scan(pose: &mut Pose, random: &mut Random) -> Arc<Volume> {
    let hu = pose.scanner.scan(&pose.wall, &pose.grid, &Progress::default()).unwrap();
    let raster =
        Raster { grid: pose.grid.clone(), samples: Samples::I16(hu), slope: 1.0, intercept: 0.0, unit: Unit::Hounsfield, warnings: vec![] };
    let volume = Arc::new(Volume::new("wall".into(), "test", raster).unwrap());
    // Its tolerance is half of the interval that holds the right isovalue 95 times of 100.
    pose.iso = (BONE_HU + AIR_HU) / 2.0 + iso_tolerance(&volume) / 1.96 * normal(random);
    volume
}

/// The bone about the origin that is found in a scan of the pose; `None` where there is none.
fn measure(pose: &mut Pose, random: &mut Random) -> Option<Segment> {
    let volume = scan(pose, random);
    let layers = [Layer { iso: pose.iso, ..Layer::new(&volume, 0, 1) }];
    let middle = pose.ray.direction.dot(-pose.ray.origin.0);
    let found = probe(&[volume], &layers, &pose.ray).unwrap();
    let segments = found.volumes[0].segments.iter().copied();
    let away = |s: &Segment| (0.5 * (s.from_mm + s.to_mm) - middle).abs();
    segments.filter(|s| away(s) < pose.truth_mm).min_by(|a, b| away(a).total_cmp(&away(b)))
}

#[test]
fn ninety_five_of_a_hundred_intervals_hold_the_true_thickness() {
    // Fails if a part is left out, is too large or too small, or mixes mm and voxels: on each shape the interval should hold the truth neither
    // too rarely nor always, and with or without blur and noise not much more rarely.
    let mut all = [0_usize; 2];
    for (n, name) in ["slab", "shell", "wedge"].iter().enumerate() {
        let mut random = Random(100 + n as u64);
        let (mut held, mut measured, mut missed, mut flagged) = (0, 0, 0, 0);
        let mut kinds = [[0_u32; 2]; 4];
        let (mut ratio, mut widths) = (vec![], vec![]);
        let mut parts = [0.0; 6];
        for _ in 0..POSES {
            let mut pose = pose(&mut random, n, [2.0, 12.0]);
            let Some(s) = measure(&mut pose, &mut random) else {
                missed += 1;
                continue;
            };
            if s.below_resolution {
                flagged += 1;
                continue;
            }
            measured += 1;
            let off = (s.length_mm - pose.truth_mm).abs();
            let is_held = off <= s.uncertainty.error_mm;
            held += usize::from(is_held);
            let kind = &mut kinds[usize::from(pose.scanner.psf_sigma_mm > 0.0) * 2 + usize::from(pose.scanner.noise_hu > 0.0)];
            kind[0] += u32::from(is_held);
            kind[1] += 1;
            ratio.push(off / s.uncertainty.error_mm);
            widths.push(s.uncertainty.error_mm / pose.grid.spacing_mm().element_product().cbrt());
            let u = s.uncertainty;
            for (sum, part) in
                parts.iter_mut().zip([u.threshold_error_mm, u.noise_error_mm, u.sampling_error_mm, u.blur_error_mm, u.error_mm, off])
            {
                *sum += part / pose.grid.spacing_mm().element_product().cbrt();
            }
        }
        ratio.sort_by(f64::total_cmp);
        widths.sort_by(f64::total_cmp);
        println!(
            "{name}: {held} of {measured} hold the truth ({:.1} %), {flagged} flagged, {missed} not found; half width {:.3} voxel; error/half width 50 % {:.2}, 95 % {:.2}",
            100.0 * held as f64 / measured as f64,
            widths[widths.len() / 2],
            ratio[ratio.len() / 2],
            ratio[ratio.len() * 95 / 100]
        );
        println!(
            "  mean parts, voxel: threshold, noise, sampling, blur, total, truly off: {:?}",
            parts.map(|p| (p / measured as f64 * 1e3).round() / 1e3)
        );
        println!("  sharp, noisy, blurred, both: {:?}", kinds.map(|[h, n]| format!("{:.1} % of {n}", 100.0 * f64::from(h) / f64::from(n))));
        all[0] += held;
        all[1] += measured;
        let share = held as f64 / measured as f64;
        assert!((0.93..=0.99).contains(&share), "{name}: {share}");
        // Of a few hundred each, a share varies by one or two of a hundred.
        assert!(kinds.iter().all(|[h, n]| *n > 100 && h * 100 >= n * 89), "{name}: {kinds:?}");
        assert!(measured > POSES / 2);
    }
    println!("all: {:.1} % of {}", 100.0 * all[0] as f64 / all[1] as f64, all[1]);
}

/// How far slice k is off.
type Jitter<'a> = &'a dyn Fn(usize, &mut Random) -> f64;

/// A slab across the slices of a grid, met within 45° by a ray, in a scan whose slices lie up to `off` steps from their even places.
fn jittered(random: &mut Random, off: f64, jitter: Jitter<'_>) -> (Segment, f64) {
    let mut pose = pose(random, 0, [3.0, 12.0]);
    let (dims, map) = (pose.grid.dims(), pose.grid.index_to_world());
    let moved: Vec<f64> = (0..dims[2]).map(|k| off * jitter(k, random)).collect();
    let mut hu = vec![];
    // Each slice by itself, from where it lies: the middle one of so many that blur reaches across.
    let beside = (4.0 * pose.scanner.psf_sigma_mm / pose.grid.spacing_mm().z).ceil() as usize;
    for (k, off) in moved.iter().enumerate() {
        let first = map.transform_point3(DVec3::new(0.0, 0.0, k as f64 + off - beside as f64));
        let grid = Grid::from_affine([dims[0], dims[1], 2 * beside + 2], DAffine3::from_mat3_translation(map.matrix3, first)).unwrap();
        let scanner = Scanner { seed: pose.scanner.seed + k as u64, ..pose.scanner };
        let stack = scanner.scan(&pose.wall, &grid, &Progress::default()).unwrap();
        hu.extend_from_slice(stack.chunks(dims[0] * dims[1]).nth(beside).unwrap());
    }
    let raster =
        Raster { grid: pose.grid.clone(), samples: Samples::I16(hu), slope: 1.0, intercept: 0.0, unit: Unit::Hounsfield, warnings: vec![] };
    let most_mm = moved.iter().fold(0.0_f64, |most, off| most.max(off.abs())) * pose.grid.spacing_mm().z;
    let volume = Arc::new(Volume::new("wall".into(), "test", raster).unwrap().with_slices_off(most_mm));
    pose.iso = (BONE_HU + AIR_HU) / 2.0 + iso_tolerance(&volume) / 1.96 * normal(random);
    let layers = [Layer { iso: pose.iso, ..Layer::new(&volume, 0, 1) }];
    let found = probe(&[volume], &layers, &pose.ray).unwrap();
    let longest = found.volumes[0].segments.iter().copied().max_by(|a, b| a.length_mm.total_cmp(&b.length_mm));
    (longest.unwrap(), pose.truth_mm)
}

#[test]
fn intervals_hold_the_truth_where_slices_jitter() {
    // Fails if slices that lie elsewhere than the grid has them are left out of the ±, count in full for a wall along the slices, or twice where
    // both ends lie between the same two.
    let tenths = |k: usize, _: &mut Random| {
        let place = k as f64 * 0.625;
        ((place * 10.0).round() / 10.0 - place) / 0.625
    };
    let kinds: [(&str, f64, Jitter<'_>); 3] = [
        ("even, up to 0.3 step", 0.3, &|_, random| 2.0 * random.unit() - 1.0),
        ("Gaussian, σ 0.1 step", 0.1, &|_, random| normal(random).clamp(-4.0, 4.0)),
        ("0.625 mm rounded to tenths", 1.0, &tenths),
    ];
    for (n, (name, off, jitter)) in kinds.into_iter().enumerate() {
        let mut random = Random(700 + n as u64);
        let (mut held, mut without, mut all, mut widths, mut parts) = (0, 0, 0, vec![], vec![]);
        for _ in 0..POSES / 2 {
            let (s, truth_mm) = jittered(&mut random, off, jitter);
            if s.below_resolution {
                continue;
            }
            let (u, is_off) = (s.uncertainty, (s.length_mm - truth_mm).abs());
            all += 1;
            held += usize::from(is_off <= u.error_mm);
            let others = ((u.error_mm - u.blur_error_mm).powi(2) - u.slice_error_mm.powi(2)).max(0.0).sqrt() + u.blur_error_mm;
            without += usize::from(is_off <= others);
            widths.push(u.error_mm / truth_mm);
            parts.push(u.slice_error_mm / u.error_mm);
        }
        widths.sort_by(f64::total_cmp);
        parts.sort_by(f64::total_cmp);
        let share = |count: usize| 100.0 * count as f64 / all as f64;
        println!(
            "slices {name}: {:.1} % of {all} hold the truth, {:.1} % without the slices' part, which is {:.2} of the ± (median)",
            share(held),
            share(without),
            parts[parts.len() / 2]
        );
        assert!(all > POSES / 4 && (93.0..=99.5).contains(&share(held)), "{name}: {}", share(held));
    }
}

/// Two walls, each in a scan of its own, met by one ray: the second's is brought onto the first's, but for what a registration with this
/// residual leaves.
fn differences(residual_mm: f64, poses: usize, seed: u64) -> ([[usize; 2]; 3], Vec<f64>) {
    let mut random = Random(seed);
    // Held and all: of the difference, and of the shifts of both ends.
    let (mut counts, mut widths) = ([[0_usize; 2]; 3], vec![]);
    for n in 0..poses {
        let mut pair = [pose(&mut random, n % 3, [2.0, 12.0]), pose(&mut random, n / 3 % 3, [2.0, 12.0])];
        let volumes: Vec<_> = pair.iter_mut().map(|pose| scan(pose, &mut random)).collect();
        let [a, b] = &pair;
        let turn = DQuat::from_rotation_arc(b.ray.direction, a.ray.direction);
        let off = residual_mm / 3.0_f64.sqrt() * DVec3::new(normal(&mut random), normal(&mut random), normal(&mut random));
        // The points of both rays that are nearest to their origins come together.
        let middle = |pose: &Pose| pose.ray.at(pose.ray.direction.dot(-pose.ray.origin.0)).0;
        let transform = DAffine3::from_rotation_translation(turn, middle(a) - turn * middle(b) + off);
        let layer = |n: usize, pose: &Pose| Layer { iso: pose.iso, ..Layer::new(&volumes[n], n, 2) };
        let layers = [layer(0, a), Layer { transform, residual_mm: Some(residual_mm), ..layer(1, b) }];
        // From the first's outside of both.
        let found = probe(&volumes, &layers, &Ray { origin: a.ray.at(-300.0), ..a.ray }).unwrap();
        let about_middle = |t_mm: f64| t_mm - 300.0 - a.ray.direction.dot(-a.ray.origin.0);
        let [of_a, of_b] = [0, 1].map(|v| &found.volumes[v].segments);
        let whole = |d: &&bregma_measure::Difference| {
            let holds_middle = |s: &Segment| about_middle(s.from_mm) < 0.0 && about_middle(s.to_mm) > 0.0;
            !(d.united || d.partial || d.below_resolution) && holds_middle(&of_a[d.a[0] - 1]) && holds_middle(&of_b[d.b[0] - 1])
        };
        let Some(d) = found.pairs[0].differences.iter().find(whole) else { continue };
        assert_eq!(found.pairs[0].without, None);
        let mut count = |n: usize, found_mm: f64, truth_mm: f64, error_mm: f64| {
            counts[n][0] += usize::from((found_mm - truth_mm).abs() <= error_mm);
            counts[n][1] += 1;
        };
        count(0, d.difference_mm, b.truth_mm - a.truth_mm, d.uncertainty.error_mm);
        for (n, shift) in [d.from_shift, d.to_shift].into_iter().enumerate() {
            let shift = shift.unwrap();
            count(n + 1, shift.shift_mm, b.ends_mm[n] - a.ends_mm[n], shift.error_mm);
        }
        widths.push(d.uncertainty.error_mm / a.grid.spacing_mm().max(b.grid.spacing_mm()).element_product().cbrt());
    }
    widths.sort_by(f64::total_cmp);
    (counts, widths)
}

#[test]
fn ninety_five_of_a_hundred_intervals_hold_the_true_difference() {
    // Fails if a part of both scans' is left out of the ± of B − A, or counted where it cancels, or a registration moves ends without a word.
    for (residual_mm, seed) in [(0.0, 300), (0.3, 400)] {
        let (counts, widths) = differences(residual_mm, 3 * POSES, seed);
        for (what, [held, all]) in ["difference", "shift of the first end", "shift of the second end"].iter().zip(counts) {
            let share = held as f64 / all as f64;
            println!("residual {residual_mm} mm, {what}: {held} of {all} hold the truth ({:.1} %)", 100.0 * share);
            assert!(all > POSES, "only {all} pairs");
            assert!((0.93..=0.975).contains(&share), "{what}: {share}");
        }
        println!("  half width of the difference {:.3} voxel (median)", widths[widths.len() / 2]);
    }
}

#[test]
fn walls_below_the_resolution_are_flagged() {
    // Fails if thin walls are measured as if they were none; or if walls that are thick enough are flagged.
    let mut random = Random(7);
    let (mut below, mut flagged, mut thick, mut falsely, mut missed) = (0, 0, 0, 0, 0);
    for n in 0..3 * POSES {
        let mut pose = pose(&mut random, n % 3, [0.4, 6.0]);
        let is_below = pose.truth_mm < pose.resolution_mm;
        let Some(s) = measure(&mut pose, &mut random) else {
            missed += 1;
            continue;
        };
        if is_below {
            below += 1;
            flagged += usize::from(s.below_resolution);
        } else if pose.truth_mm > 1.5 * pose.resolution_mm {
            thick += 1;
            falsely += usize::from(s.below_resolution);
        }
    }
    println!(
        "{flagged} of {below} walls below the resolution are flagged ({:.1} %), {falsely} of {thick} that are half as thick again; {missed} not found",
        100.0 * flagged as f64 / below as f64
    );
    assert!(flagged * 100 >= below * 95 && falsely * 100 <= thick * 5 && below > 300 && thick > 300);
}

/// Of 1,000 rays through two scans of one object: walls that both show, how many have lengths that agree within their stated errors, and how
/// far apart these are, sorted, mm. Not compared are walls that a scan cannot show or cuts, and those met at over 60°, where a length is what the
/// ray makes of a rim.
fn compare(volumes: &[Arc<Volume>], layers: &[Layer], seed: u64) -> (usize, usize, Vec<f64>) {
    let bounds = bregma_renderer::Bounds::of([volumes[0].grid()]);
    let mut random = Random(seed);
    let (mut rays, mut held, mut off) = (0, 0, vec![]);
    while rays < 1000 {
        let mut direction = || DVec3::new(normal(&mut random), normal(&mut random), normal(&mut random)).normalize();
        let (from, through) =
            (bounds.centre_mm + 1.5 * bounds.radius_mm * direction(), bounds.centre_mm + 0.3 * bounds.radius_mm * direction());
        let found = probe(volumes, layers, &Ray::new(WorldPoint(from), through - from).unwrap()).unwrap();
        let is_straight = |s: &Segment| s.obliquity_deg.iter().all(|deg| *deg < 60.0);
        let usable = |s: &&Segment| !s.below_resolution && !s.clipped && is_straight(s);
        let mut is_compared = false;
        for a in found.volumes[0].segments.iter().filter(usable) {
            let overlap = |b: &Segment| (a.to_mm.min(b.to_mm) - a.from_mm.max(b.from_mm)).max(0.0) / a.length_mm.max(b.length_mm);
            let Some(b) = found.volumes[1].segments.iter().filter(usable).find(|b| overlap(b) > 0.5) else { continue };
            let stated = a.uncertainty.error_mm.hypot(b.uncertainty.error_mm);
            assert!(stated.is_finite());
            held += usize::from((a.length_mm - b.length_mm).abs() <= stated);
            off.push((a.length_mm - b.length_mm).abs());
            is_compared = true;
        }
        rays += usize::from(is_compared);
    }
    off.sort_by(f64::total_cmp);
    (off.len(), held, off)
}

fn tell(what: &str, (walls, held, off): &(usize, usize, Vec<f64>)) -> f64 {
    let share = *held as f64 / *walls as f64;
    let (median, most) = (off[off.len() / 2], off[off.len() * 95 / 100]);
    println!(
        "{what}: of {walls} walls {:.1} % agree within their stated errors; apart by {median:.3} mm (median), 95 % within {most:.3} mm",
        100.0 * share
    );
    share
}

fn open(folder: &std::path::Path, name: &str) -> Arc<Volume> {
    let source = Source { file: folder.join(name), ..Source::default() };
    Opened::read(&[source], &Progress::default()).unwrap().volumes.remove(0)
}

#[test]
fn a_template_and_itself_under_a_known_transform_agree_within_their_stated_errors() {
    // Fails if a stated error is too small on a real scan's samples, or a transform moves a length.
    let Some(d) = data("the mouse template against itself") else { return };
    let template = open(&d, "mouse/low_res_template_UCHAR.nii.gz");
    let layer = Layer::new(&template, 0, 2);
    let surface = bregma_renderer::Surface::new(&template, layer.iso, DAffine3::IDENTITY).unwrap();
    // Another scan of the same head: turned by 25° and shifted, with other voxels.
    let bounds = bregma_renderer::Bounds::of([template.grid()]);
    let turn = DQuat::from_axis_angle(DVec3::new(2.0, -1.0, 2.0) / 3.0, 25.0_f64.to_radians());
    let known = DAffine3::from_translation(bounds.centre_mm + DVec3::new(0.031, -0.047, 0.019)) * DAffine3::from_quat(turn);
    let spacing = template.grid().spacing_mm() * DVec3::new(0.9, 1.1, 1.0);
    let dims = (DVec3::splat(2.0 * bounds.radius_mm) / spacing).as_usizevec3().to_array();
    let grid = Grid::new(dims, spacing, -0.5 * spacing * DVec3::from(dims.map(|n| n as f64 - 1.0)), DMat3::IDENTITY).unwrap();
    let at = |n: usize| {
        let index = DVec3::new((n % dims[0]) as f64, (n / dims[0] % dims[1]) as f64, (n / dims[0] / dims[1]) as f64);
        let point = known.transform_point3(grid.index_to_world().transform_point3(index));
        let along = Ray { origin: WorldPoint(point), direction: DVec3::X };
        bregma_measure::profile(&surface, &along, [0.0, 0.0], 1).first().map_or(0, |[_, value]| value.round() as u8)
    };
    let samples = Samples::U8((0..grid.len()).map(at).collect());
    let other = bregma_tests::volume("again", grid.clone(), samples);
    let layers = [layer.clone(), Layer { transform: known, iso: layer.iso, ..Layer::new(&other, 1, 2) }];
    let share = tell("template", &compare(&[template, other], &layers, 5));
    assert!(share >= 0.93, "{share}");
}

#[test]
fn two_scans_of_one_phantom_agree_as_far_as_is_known() {
    // The phantom's straight and tilted series: slices of 1 and of 2.5 mm, a sheared grid. They lie 0.8 mm apart (`volume/tests/real_scans.rs`
    // fits the shift, which no header states), with 0.19 mm of residual. Only two thirds of the lengths agree within their stated errors, see
    // docs/measuring.md: this fails when it is fewer, and when it is 93 of 100 and ought to be asked for.
    let Some(d) = data("the phantom's two series") else { return };
    let volumes = [open(&d, "phantom-philips/straight"), open(&d, "phantom-philips/tilted")];
    let mut layers: Vec<Layer> = volumes.iter().enumerate().map(|(n, v)| Layer { iso: 300.0, ..Layer::new(v, n, 2) }).collect();
    layers[1].transform = DAffine3::from_translation(DVec3::new(-0.17, -0.75, 0.26));
    layers[1].residual_mm = Some(0.19);
    let share = tell("phantom", &compare(&volumes, &layers, 11));
    assert!((0.6..0.93).contains(&share), "{share}");
}
