//! Partners and closest points against all that can be tried, and their cost.

use super::brute::Brute;
use super::*;
use bregma_field::{Progress, WorldPoint, formats, read_transform};
use bregma_measure::mesh::Mesh;
use bregma_measure::partner::{Partner, Partners};
use bregma_synthetic::{Which, skull};
use bregma_tests::{data, volume};
use rayon::prelude::*;
use std::path::Path;
use std::time::Instant;

/// Two surfaces of which one's points are looked for on the other.
struct Pair {
    name: &'static str,
    a: Surface,
    b: Surface,
}

fn demo_pair(n: usize) -> Pair {
    let [a, b] = [Which::A, Which::B].map(|which| surface(&Arc::new(skull(which, n, &Progress::default()).unwrap()), 226.0));
    Pair { name: "demo pair", a, b }
}

/// Smooth noise of whole numbers on a grid that is sheared, anisotropic and mirrored: saddles, thin walls, values equal to the isovalue.
fn noise(seed: u64) -> Surface {
    let dims = [24, 22, 20];
    let axes = DMat3::from_cols(
        DVec3::new(-0.9, 0.1, 0.0).normalize(),
        DVec3::new(0.1, 0.9, 0.2).normalize(),
        DVec3::new(0.0, -0.35, 0.94).normalize(),
    );
    let grid = Grid::new(dims, DVec3::new(0.45, 0.6, 1.1), DVec3::new(5.0, -7.0, 3.0), axes).unwrap();
    let mut random = Random(seed);
    let waves: Vec<(DVec3, f64)> = (0..12).map(|_| (1.4 * (unit(&mut random) - 0.5), std::f64::consts::TAU * random.unit())).collect();
    let sample = |n: usize| {
        let at = DVec3::new((n % dims[0]) as f64, (n / dims[0] % dims[1]) as f64, (n / (dims[0] * dims[1])) as f64);
        let sum: f64 = waves.iter().map(|(k, phase)| (k.dot(at) + phase).sin()).sum();
        (128.0 + 12.0 * sum).round().clamp(0.0, 255.0) as u8
    };
    let samples = Samples::U8((0..grid.len()).map(sample).collect());
    surface(&volume("noise", grid, samples), 128.0)
}

/// What was found of how many, and how far it is off, voxels.
#[derive(Clone, Copy, Default)]
struct Found {
    points: usize,
    with_partner: usize,
    off_surface: f64,
    closest_off: f64,
    closest_missed: usize,
    partner_off: f64,
    partner_wrong: usize,
}

fn compare(pair: &Pair, count: usize) -> Found {
    let mesh = Mesh::of(&pair.a, &Progress::default()).unwrap();
    let partners = Partners::of(&pair.b, &Progress::default()).unwrap();
    let voxel_mm = pair.b.grid.spacing_mm().min_element();
    let reach_mm = 6.0 * pair.b.grid.spacing_mm().max_element();
    let step = (mesh.vertices.len() / count).max(1);
    let one = |n: usize| {
        let (point, normal) = (WorldPoint(mesh.vertices[n]), mesh.normals[n]);
        let brute = Brute::new(&pair.b, point);
        let mut found = Found { points: 1, ..Found::default() };
        let closest = partners.closest(point, reach_mm, None);
        let tried = brute.all_within(closest.map_or(reach_mm, |c| c.distance_mm + voxel_mm));
        match (closest, tried.first()) {
            (Some(closest), Some(first)) => {
                let near = tried.iter().take(40).map(|from| brute.descended(*from, 0.25).square).fold(first.square, f64::min).sqrt();
                found.closest_off = (closest.distance_mm - near).abs() / voxel_mm;
                if found.closest_off > 1e-6 {
                    println!("{}: point {n} at {point:?}: closest {closest:?}, tried {near}", pair.name);
                }
                let at = pair.b.grid.index(closest.point).0;
                let cell = at.floor().clamp(DVec3::ZERO, glam::USizeVec3::from(pair.b.grid.cells()).as_dvec3() - 1.0);
                let f = bregma_field::interpolant::corners(&pair.b, cell.as_usizevec3());
                let slope = bregma_field::interpolant::gradient(&f, at - cell).length();
                found.off_surface = bregma_field::interpolant::value(&f, at - cell).abs() / slope.max(1e-300);
            }
            (None, None) => {}
            _ => found.closest_missed = 1,
        }
        // The partner is a foot that faces the right way, since going downhill from it leads nowhere, and none that was tried is nearer.
        let partner = partners.facing(point, normal, reach_mm, None);
        let tried = brute.partner(normal, partner.map_or(reach_mm, |p| p.distance_mm)).map(|near| near.square.sqrt());
        if let Some(partner) = partner {
            let at = pair.b.grid.index(partner.point).0;
            let foot = brute.descended(brute.tried(at), 1e-3);
            found.with_partner = 1;
            found.partner_off = (partner.distance_mm - foot.square.sqrt()).abs() / voxel_mm;
            if found.partner_off > 1e-6 {
                println!("{:?} at {at} to {:?}: {} {}", partner, foot.point, foot.square.sqrt(), brute.faces(at, normal));
            }
            found.partner_wrong = usize::from(!brute.faces(at, normal) || brute.is_at_edge(at) || found.partner_off > 1e-6);
        }
        if tried.is_some_and(|near| partner.is_none_or(|p| p.distance_mm - near > 1e-6 * voxel_mm)) {
            found.partner_wrong = 1;
        }
        if found.partner_wrong > 0 {
            println!("{}: point {n} at {point:?}: partner {partner:?}, tried {tried:?}", pair.name);
        }
        found
    };
    let all = |a: Found, b: Found| Found {
        points: a.points + b.points,
        with_partner: a.with_partner + b.with_partner,
        off_surface: a.off_surface.max(b.off_surface),
        closest_off: a.closest_off.max(b.closest_off),
        closest_missed: a.closest_missed + b.closest_missed,
        partner_off: a.partner_off.max(b.partner_off),
        partner_wrong: a.partner_wrong + b.partner_wrong,
    };
    (0..mesh.vertices.len()).step_by(step).collect::<Vec<_>>().into_par_iter().map(one).reduce(Found::default, all)
}

fn told(name: &str, f: &Found) {
    println!(
        "{name}: {} points, {} with a partner; closest {:.1e} voxel off at most, {} missed; partners {:.1e}, {} others; {:.1e} off the surface",
        f.points, f.with_partner, f.closest_off, f.closest_missed, f.partner_off, f.partner_wrong, f.off_surface
    );
}

#[test]
fn partners_are_those_that_trying_everything_finds() {
    let mut pairs = vec![demo_pair(64), Pair { name: "noise, sheared grids", a: noise(1), b: noise(2) }];
    let mut random = Random(9);
    let Pair { a, b, .. } = demo_pair(64);
    let moved = Surface::new(&b.volume, 226.0, motion(&mut random, DVec3::ZERO, 3.0, 2.0)).unwrap();
    pairs.push(Pair { name: "demo pair, moved", a, b: moved });
    for pair in &pairs {
        let found = compare(pair, points(150));
        told(pair.name, &found);
        assert!(found.closest_missed == 0 && found.closest_off < 1e-6 && found.off_surface < 1e-9);
        assert!(found.partner_wrong == 0 && found.partner_off < 1e-6);
    }
}

fn scan(file: &Path) -> Arc<Volume> {
    Arc::new(formats::open(file, &Default::default(), &Progress::default()).unwrap())
}

/// Two mice by their landmarks.
fn mice(folder: &Path) -> Pair {
    let [a, b] = ["C57BL6_J_", "DBA_2J_"].map(|name| scan(&folder.join(format!("mouse/{name}.nii.gz"))));
    let pose = read_transform(&folder.join("mouse/rigid_from_landmarks.json"), "C57BL6_J_", &["DBA_2J_"]).unwrap().transform;
    Pair { name: "mice", a: Surface::new(&a, 70.0, pose).unwrap(), b: surface(&b, 70.0) }
}

#[test]
fn partners_on_real_scans_are_those_that_trying_everything_finds() {
    // As above, on what scanners and people leave: noise, unlike steps, sheared grids, another individual.
    let Some(folder) = data("partners on real scans") else { return };
    let mut random = Random(21);
    let mut moved = |name: &'static str, file: &str, iso: f64| {
        let volume = scan(&folder.join(file));
        let middle = volume.grid().corners_mm().iter().sum::<DVec3>() / 8.0;
        let pose = motion(&mut random, middle, 1.0, 1.0);
        Pair { name, a: Surface::new(&volume, iso, pose).unwrap(), b: surface(&volume, iso) }
    };
    let mut pairs = vec![moved("cranium", "cranium-invesalius/Cranium.nhdr", 300.0), moved("CThead", "cthead-unc/CThead.nhdr", 1300.0)];
    pairs.push(mice(&folder));
    let [straight, tilted] = ["straight", "tilted"].map(|name| scan(&folder.join("phantom-philips").join(name)));
    pairs.push(Pair { name: "phantom, straight on tilted", a: surface(&straight, 226.0), b: surface(&tilted, 226.0) });
    pairs.push(Pair { name: "phantom, tilted on straight", a: surface(&tilted, 226.0), b: surface(&straight, 226.0) });
    for pair in &pairs {
        let found = compare(pair, points(60));
        told(pair.name, &found);
        assert!(found.closest_missed == 0 && found.closest_off < 1e-6 && found.off_surface < 1e-9);
        assert!(found.partner_wrong == 0 && found.partner_off < 1e-6);
    }
}

fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap();
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap().split_whitespace().collect();
    (fields[11].parse::<f64>().unwrap() + fields[12].parse::<f64>().unwrap()) / 100.0
}

#[test]
fn partners_cost() {
    let pair = match data("partners of a mouse") {
        Some(folder) => mice(&folder),
        None => demo_pair(256),
    };
    let mesh = Mesh::of(&pair.a, &Progress::default()).unwrap();
    let (begun, cpu) = (Instant::now(), cpu_seconds());
    let partners = Partners::of(&pair.b, &Progress::default()).unwrap();
    let made = (begun.elapsed().as_secs_f64(), cpu_seconds() - cpu);
    for (what, reach_mm) in [("facing", 1.5), ("closest", 20.0)] {
        let (begun, cpu) = (Instant::now(), cpu_seconds());
        let found: usize = (0..mesh.vertices.len())
            .into_par_iter()
            .fold(
                || (0, None),
                |(count, before): (usize, Option<Partner>), n| {
                    let (point, normal) = (WorldPoint(mesh.vertices[n]), mesh.normals[n]);
                    let found = match what {
                        "closest" => partners.closest(point, reach_mm, before.as_ref()),
                        _ => partners.facing(point, normal, reach_mm, before.as_ref()),
                    };
                    (count + usize::from(found.is_some()), found.or(before))
                },
            )
            .map(|(count, _)| count)
            .sum();
        println!(
            "{}, {what}: {} points, {found} found, {:.2} s, {:.2} CPU s; made ready in {:.2} s, {:.2} CPU s",
            pair.name,
            mesh.vertices.len(),
            begun.elapsed().as_secs_f64(),
            cpu_seconds() - cpu,
            made.0,
            made.1
        );
    }
}
