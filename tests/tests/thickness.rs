//! Thickness across walls, by inscribed spheres, and the mesh that carries both, against shapes whose answers are known.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use bregma_measure::mesh::{Mesh, onto_surface};
use bregma_measure::thickness::{self, InscribedSpheres, Method};
use bregma_renderer::Surface;
use bregma_synthetic::analytic::{Shell, Sphere, sampled};
use bregma_synthetic::{Which, skull};
use bregma_tests::Random;
use bregma_volume::{Grid, IndexPoint, Progress, ReadSamples, Volume, WorldPoint};
use glam::{DAffine3, DMat3, DVec3};
use std::collections::HashMap;
use std::sync::Arc;
use std::time::Instant;

fn grid(dims: [usize; 3], spacing: [f64; 3], direction: DMat3) -> Grid {
    let spacing = DVec3::from(spacing);
    let half = direction * (spacing * DVec3::from(dims.map(|n| (n - 1) as f64 / 2.0)));
    Grid::new(dims, spacing, -half, direction).unwrap()
}

fn turned() -> DMat3 {
    DMat3::from_axis_angle(DVec3::new(1.0, 2.0, 2.0) / 3.0, 0.7)
}

fn surface(volume: Volume) -> Surface {
    Surface::new(&Arc::new(volume), 0.0, DAffine3::IDENTITY).unwrap()
}

fn value(surface: &Surface, p: DVec3) -> f64 {
    let IndexPoint(i) = surface.grid.index(WorldPoint(p));
    let dims = surface.grid.dims();
    let cell: [usize; 3] = std::array::from_fn(|a| (i[a].max(0.0) as usize).min(dims[a] - 2));
    (0..8)
        .map(|c| {
            let at: [usize; 3] = std::array::from_fn(|a| cell[a] + (c >> a & 1));
            let weight: f64 = (0..3).map(|a| if c >> a & 1 == 1 { i[a] - cell[a] as f64 } else { 1.0 - (i[a] - cell[a] as f64) }).product();
            weight * surface.volume.samples().get_f64((at[2] * dims[1] + at[1]) * dims[0] + at[0])
        })
        .sum()
}

#[test]
fn the_mesh_of_a_ball_is_closed_faces_outward_and_lies_on_the_surface() {
    // Fails if a quadrangle is left out, doubled or turned round, on a mirrored grid too, or a vertex lies beside the surface.
    let ball = Sphere { centre: DVec3::new(0.3, -0.2, 0.1), radius_mm: 11.0 };
    for direction in [DMat3::IDENTITY, turned(), DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0))] {
        let surface = surface(ball.volume(&grid([41, 37, 31], [0.7, 0.8, 0.9], direction)));
        let mesh = Mesh::of(&surface, &Progress::default()).unwrap();
        let mut edges: HashMap<[u32; 2], i32> = HashMap::new();
        let mut volume_mm3 = 0.0;
        for [a, b, c] in &mesh.triangles {
            for edge in [[*a, *b], [*b, *c], [*c, *a]] {
                *edges.entry(edge).or_default() += 1;
            }
            let [p, q, r] = [a, b, c].map(|n| mesh.vertices[*n as usize]);
            volume_mm3 += p.dot(q.cross(r)) / 6.0;
        }
        assert!(edges.iter().all(|([a, b], count)| *count == 1 && edges.get(&[*b, *a]) == Some(&1)), "an edge has not two sides");
        let truth = 4.0 / 3.0 * std::f64::consts::PI * 11.0_f64.powi(3);
        let (mut off, mut angle) = (0.0_f64, 0.0_f64);
        for (p, n) in mesh.vertices.iter().zip(&mesh.normals) {
            off = off.max(value(&surface, *p).abs());
            angle = angle.max(n.angle_between(*p - ball.centre).to_degrees());
        }
        println!(
            "{} vertices, {} triangles; off the surface by {off:.1e}, normals by {angle:.2}°, volume {:.4} of the ball's",
            mesh.vertices.len(),
            mesh.triangles.len(),
            volume_mm3 / truth
        );
        assert!(off < 1e-12 && angle < 3.0 && (volume_mm3 / truth - 1.0).abs() < 0.01);
    }
}

#[test]
fn a_picked_point_comes_to_lie_on_the_surface() {
    // Fails if a landmark is left where the picture's float32 put it.
    let surface = surface(Sphere { centre: DVec3::ZERO, radius_mm: 10.0 }.volume(&grid([32; 3], [0.8; 3], turned())));
    let mut random = Random(1);
    for _ in 0..1000 {
        let direction = DVec3::new(random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.5).normalize();
        let picked = direction * (10.0 + 0.2 * (random.unit() - 0.5));
        let found = onto_surface(&surface, WorldPoint(picked), 1.0).unwrap();
        let point = surface.grid.world(found.point).0;
        assert!(value(&surface, point).abs() < 1e-12 && point.distance(picked) < 0.15, "{picked} → {point}");
    }
}

#[test]
fn across_a_shell_both_ways_agree_and_across_a_wedge_they_are_what_geometry_says() {
    // Fails if a normal is taken at the wrong end, the way back is left out, or lengths are not in mm.
    let shell = Shell { centre: DVec3::ZERO, inner_mm: 12.0, outer_mm: 16.5 };
    let surface = surface(shell.volume(&grid([61, 55, 49], [0.6, 0.65, 0.75], turned())));
    let mesh = Mesh::of(&surface, &Progress::default()).unwrap();
    let mut worst = [0.0_f64; 3];
    for (p, n) in mesh.vertices.iter().zip(&mesh.normals) {
        let wall = thickness::across(&surface, *p, *n).unwrap();
        worst[0] = worst[0].max((wall.there_mm - 4.5).abs());
        worst[1] = worst[1].max((wall.back_mm - wall.there_mm).abs());
        worst[2] = worst[2].max(wall.angle_deg);
    }
    println!("shell: {} points, off by {:.3} mm, ways differ by {:.3} mm and {:.2}°", mesh.vertices.len(), worst[0], worst[1], worst[2]);
    assert!(worst[0] < 0.06 && worst[1] < 0.06 && worst[2] < 6.0);
    // Two planes at 20°, the second at z = −(half + x·sin 20°)/cos 20°: what is d along the first's normal is d/cos 20° back along the second's.
    let (half, angle) = (3.0, 20.0_f64.to_radians());
    let normals = [DVec3::Z, DVec3::new(-angle.sin(), 0.0, -angle.cos())];
    let wedge = sampled("wedge", &grid([60, 20, 40], [0.5; 3], DMat3::IDENTITY), |p| {
        normals.iter().map(|n| half - p.dot(*n)).fold(f64::MAX, f64::min)
    });
    let wedge = self::surface(wedge);
    for x in [-2.0, 0.0, 1.5] {
        let wall = thickness::across(&wedge, DVec3::new(x, 0.3, half), DVec3::Z).unwrap();
        let there = half + (half + x * angle.sin()) / angle.cos();
        println!("wedge at {x}: {wall:?}, {there}");
        assert!((wall.there_mm - there).abs() < 1e-6 && (wall.back_mm - there / angle.cos()).abs() < 1e-6, "{wall:?}");
        assert!((wall.angle_deg - 20.0).abs() < 0.1 && !wall.clipped);
    }
}

#[test]
fn inscribed_spheres_measure_slabs_shells_and_balls() {
    // Fails if distances are to samples instead of the surface (half a voxel off), if voxels are taken as cubes, or a sphere is missed.
    let mut random = Random(4);
    for n in 0..6 {
        let thick = 2.5 + 5.0 * random.unit();
        let normal = DVec3::new(random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.5).normalize();
        let slab = surface(sampled("slab", &grid([48, 44, 40], [0.6, 0.65, 0.7], turned()), |p| thick / 2.0 - p.dot(normal).abs()));
        let mesh = Mesh::of(&slab, &Progress::default()).unwrap();
        let found = thickness::map(&slab, &mesh, Method::Sphere, &Progress::default()).unwrap();
        // Away from the scan's edge, where the slab is cut.
        let inner = mesh.vertices.iter().zip(&found).filter(|(p, _)| p.length() < 7.0).map(|(_, t)| f64::from(*t));
        let (low, high) = inner.fold((f64::MAX, f64::MIN), |(low, high), t| (low.min(t), high.max(t)));
        println!("slab {n} of {thick:.3} mm: {low:.3} to {high:.3}");
        assert!(low > thick - 0.2 && high < thick + 0.1, "{thick}: {low} to {high}");
    }
    let shell = Shell { centre: DVec3::ZERO, inner_mm: 9.0, outer_mm: 13.0 };
    let shell = surface(shell.volume(&grid([48; 3], [0.6; 3], turned())));
    let mesh = Mesh::of(&shell, &Progress::default()).unwrap();
    let found = thickness::map(&shell, &mesh, Method::Sphere, &Progress::default()).unwrap();
    let off = found.iter().map(|t| (f64::from(*t) - 4.0).abs()).fold(0.0, f64::max);
    println!("shell of 4 mm: off by at most {off:.3} mm");
    assert!(off < 0.3);
    // In a ball every point belongs to the ball itself.
    let ball = surface(Sphere { centre: DVec3::splat(0.1), radius_mm: 6.0 }.volume(&grid([30; 3], [0.5; 3], DMat3::IDENTITY)));
    let spheres = InscribedSpheres::of(&ball, &Progress::default()).unwrap();
    let points: Vec<DVec3> =
        (0..500).map(|_| 5.7 * DVec3::new(random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.5).normalize()).collect();
    let found = spheres.thickness_at(&points, &Progress::default()).unwrap();
    assert!(found.iter().all(|t| (t.unwrap() - 12.0).abs() < 0.15), "{found:?}");
}

#[test]
fn a_whole_skull_is_mapped_in_seconds() {
    // Fails if a map takes longer than a person waits: 10 s across the walls of a 256³ skull on two cores.
    let skull = Arc::new(skull(Which::A, 256, &Progress::default()).unwrap());
    let surface = Surface::new(&skull, 226.0, DAffine3::IDENTITY).unwrap();
    let begun = Instant::now();
    let mesh = Mesh::of(&surface, &Progress::default()).unwrap();
    let meshed = begun.elapsed().as_secs_f64();
    for (name, method, most_s) in [("normal", Method::Normal, 10.0), ("sphere", Method::Sphere, 60.0)] {
        let begun = Instant::now();
        let found = thickness::map(&surface, &mesh, method, &Progress::default()).unwrap();
        let taken = begun.elapsed().as_secs_f64();
        let known: Vec<f32> = found.iter().copied().filter(|t| !t.is_nan()).collect();
        println!("{name}: {} of {} vertices, mesh {meshed:.2} s, map {taken:.2} s", known.len(), found.len());
        assert!(meshed + taken < most_s && known.len() * 10 > found.len() * 9);
    }
    let progress = Progress::default();
    progress.cancel();
    assert!(thickness::map(&surface, &mesh, Method::Normal, &progress).is_err() && Mesh::of(&surface, &progress).is_err());
}
