//! What lies within closed surfaces of triangles, as parts on a scan's samples.
//!
//! Along each line of samples the triangles that it passes are met in order, and how often they go round each sample is counted: the winding number, or
//! where triangles do not agree on which side is out, whether they were met an odd number of times. A line meets a triangle by its sides alone, each of
//! which is compared with it in the same order of its ends whatever triangle it is of: of two that share a side, a line that passes it meets exactly one.

use crate::error::PartsError;
use crate::labels::Labels;
use bregma_field::{Mesh, Progress, Volume};
use glam::{DVec3, USizeVec3};
use rayon::prelude::*;
use std::path::PathBuf;

/// A surface and the file that it is from.
#[derive(Clone, Debug)]
pub struct ClosedSurface {
    /// The file, for what is to be said of it; the part has its name.
    pub file: PathBuf,
    /// Its triangles, in the scan's own millimetres.
    pub mesh: Mesh,
}

impl Labels {
    /// Of each surface a part with the samples within it; a sample within several is of the last one. `progress` counts slices of each.
    pub fn of_surfaces(scan: &Volume, surfaces: &[ClosedSurface], progress: &Progress) -> Result<Self, PartsError> {
        let none = Self::none(scan.grid().clone());
        surfaces.iter().try_fold(none, |labels, surface| labels.with_surface(scan, surface, progress))
    }

    /// With the samples within a surface as a part of their own. `progress` counts slices.
    pub fn with_surface(self, scan: &Volume, surface: &ClosedSurface, progress: &Progress) -> Result<Self, PartsError> {
        let sides = Sides::of(&surface.mesh);
        if sides.open > 0 {
            return Err(PartsError::OpenSurface { file: surface.file.clone(), edges: sides.open });
        }
        let runs = runs(&surface.mesh, scan, sides.agree, progress)?;
        if runs.iter().all(Vec::is_empty) {
            return Err(PartsError::Elsewhere { file: surface.file.clone(), scan: scan.name().to_owned() });
        }
        let (mut labels, number) = self.with_part(&surface.file.file_stem().unwrap_or_default().to_string_lossy())?;
        for (k, (j, from, to)) in runs.iter().enumerate().flat_map(|(k, runs)| runs.iter().map(move |run| (k, *run))) {
            (from..to).for_each(|i| labels.numbers_mut().set(USizeVec3::new(i, j, k), number));
        }
        Ok(labels)
    }
}

/// How triangles share their sides.
struct Sides {
    /// Sides of an odd number of triangles.
    open: usize,
    /// Each side is passed in both directions as often: the triangles agree on which side is out.
    agree: bool,
}

impl Sides {
    fn of(mesh: &Mesh) -> Self {
        let all = mesh.triangles.par_iter().filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]);
        let mut sides: Vec<(u32, u32, i8)> =
            all.flat_map_iter(|&[a, b, c]| [(a, b), (b, c), (c, a)]).map(|(a, b)| if a < b { (a, b, 1) } else { (b, a, -1) }).collect();
        sides.par_sort_unstable();
        let groups = || sides.chunk_by(|p, q| (p.0, p.1) == (q.0, q.1));
        let agree = groups().all(|group| group.iter().map(|side| i64::from(side.2)).sum::<i64>() == 0);
        Self { open: groups().filter(|group| group.len() % 2 == 1).count(), agree }
    }
}

/// Samples of a row: its j, the first, and the one behind the last.
type Inside = (usize, usize, usize);

/// Of each slice what lies within.
fn runs(mesh: &Mesh, scan: &Volume, agree: bool, progress: &Progress) -> Result<Vec<Vec<Inside>>, PartsError> {
    let grid = scan.grid();
    let dims = grid.dims();
    let points: Vec<DVec3> = mesh.points_mm.par_iter().map(|p| grid.world_to_index().transform_point3(*p)).collect();
    let mut slices: Vec<Vec<[DVec3; 3]>> = vec![vec![]; dims[2]];
    for triangle in &mesh.triangles {
        let corners = triangle.map(|n| points[n as usize]);
        slices[spanned(corners.map(|p| p.z), dims[2])].iter_mut().for_each(|slice| slice.push(corners));
    }
    progress.begin(dims[2] as u64);
    let slice = |(k, triangles): (usize, Vec<[DVec3; 3]>)| {
        progress.advance(1)?;
        let mut rows: Vec<Vec<(f64, i32)>> = vec![vec![]; dims[1]];
        for corners in triangles {
            for j in spanned(corners.map(|p| p.y), dims[1]) {
                rows[j].extend(met(corners, j as f64, k as f64));
            }
        }
        let rows = rows.iter_mut().enumerate().filter(|(_, row)| !row.is_empty());
        Ok(rows.flat_map(|(j, row)| inside(row, agree, dims[0]).into_iter().map(move |[from, to]| (j, from, to))).collect())
    };
    slices.into_par_iter().enumerate().map(slice).collect()
}

/// The whole numbers below `count` from the least to the greatest of three.
fn spanned(of: [f64; 3], count: usize) -> std::ops::Range<usize> {
    let (low, high) = (of[0].min(of[1]).min(of[2]), of[0].max(of[1]).max(of[2]));
    // Casts end at 0.
    let end = if high < 0.0 { 0 } else { (high.floor() as usize).saturating_add(1).min(count) };
    (low.ceil() as usize).min(end)..end
}

/// Where the line along i at (j, k) meets a triangle, and how its winding changes there.
fn met(corners: [DVec3; 3], j: f64, k: f64) -> Option<(f64, i32)> {
    let [a, b, c] = corners;
    let winding: i32 = [(a, b), (b, c), (c, a)].into_iter().map(|(a, b)| passed(a, b, j, k)).sum();
    let normal = (b - a).cross(c - a);
    let x = a.x - (normal.y * (j - a.y) + normal.z * (k - a.z)) / normal.x;
    let (low, high) = (a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x));
    // A triangle that the line all but lies in is met somewhere in it.
    (winding != 0).then(|| (if x.is_nan() { low } else { x.clamp(low, high) }, winding))
}

/// How the side from a to b passes the half line from (j, k) along j: up 1, down −1, not at all 0.
fn passed(a: DVec3, b: DVec3, j: f64, k: f64) -> i32 {
    if (a.z > k) == (b.z > k) {
        return 0;
    }
    // In one order of its ends, so that both triangles that have it find the same number.
    let (low, high) = if a.z < b.z { (a, b) } else { (b, a) };
    let at = low.y + (k - low.z) / (high.z - low.z) * (high.y - low.y);
    i32::from(j < at) * if a.z < b.z { 1 } else { -1 }
}

/// The stretches of a row that lie within, of where surfaces are met.
fn inside(met: &mut [(f64, i32)], agree: bool, count: usize) -> Vec<[usize; 2]> {
    met.sort_by(|a, b| a.0.total_cmp(&b.0));
    let sample = |x: f64| if x <= 0.0 { 0 } else { (x.ceil() as usize).min(count) };
    let mut runs: Vec<[usize; 2]> = vec![];
    let mut winding = 0;
    for pair in met.windows(2) {
        winding += if agree { pair[0].1 } else { 1 };
        let [from, to] = [sample(pair[0].0), sample(pair[1].0)];
        if from < to && (if agree { winding != 0 } else { winding % 2 == 1 }) {
            runs.push([from, to]);
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_field::{Grid, IndexPoint, Raster, Samples, Unit};
    use glam::{DMat3, DVec2};
    use std::f64::consts::{PI, TAU};

    fn scan() -> Volume {
        let shear = DMat3::from_cols(DVec3::new(0.8, 0.6, 0.0), DVec3::new(-0.6, 0.8, 0.0), DVec3::Z);
        let grid = Grid::new([44, 40, 36], DVec3::new(0.5, 0.6, 0.7), DVec3::new(1.0, 2.0, 3.0), shear).unwrap();
        let samples = Samples::U8(vec![0; grid.len()]);
        Volume::new("scan".into(), "test", Raster { grid, samples, slope: 1.0, intercept: 0.0, unit: Unit::Value, warnings: vec![] })
            .unwrap()
    }

    fn inside_of(labels: &Labels) -> Vec<bool> {
        let [nx, ny, nz] = labels.grid().dims();
        (0..nx * ny * nz).map(|n| labels.number([n % nx, n / nx % ny, n / (nx * ny)]) > 0).collect()
    }

    fn found(scan: &Volume, mesh: Mesh) -> Result<Labels, PartsError> {
        Labels::of_surfaces(scan, &[ClosedSurface { file: "a/jaw.stl".into(), mesh }], &Progress::default())
    }

    /// A ball of triangles in index space, turned by the grid, and around which samples it goes by its own definition: rays in another direction.
    fn ball(scan: &Volume, centre: DVec3, radius: f64, rings: u32) -> Mesh {
        let point = |ring: u32, n: u32| {
            let (a, b) = (PI * f64::from(ring) / f64::from(rings), TAU * f64::from(n % (2 * rings)) / f64::from(2 * rings));
            let around = DVec2::from_angle(b) * if ring.is_multiple_of(rings) { 0.0 } else { a.sin() };
            scan.grid().world(IndexPoint(centre + radius * DVec3::new(around.x, around.y, a.cos()))).0
        };
        let mut mesh = Mesh { points_mm: vec![], triangles: vec![] };
        let mut number = |p: DVec3| match mesh.points_mm.iter().position(|q| *q == p) {
            Some(n) => n as u32,
            None => {
                mesh.points_mm.push(p);
                mesh.points_mm.len() as u32 - 1
            }
        };
        for (ring, n) in (0..rings).flat_map(|ring| (0..2 * rings).map(move |n| (ring, n))) {
            let [a, b, c, d] = [(ring, n), (ring + 1, n), (ring + 1, n + 1), (ring, n + 1)].map(|(ring, n)| number(point(ring, n)));
            mesh.triangles.extend([[a, b, c], [a, c, d]].into_iter().filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]));
        }
        mesh
    }

    /// A box whose sides lie in planes of samples, and whose edges and diagonals lie on lines of samples: all that parity fears.
    fn cube(scan: &Volume, low: DVec3, high: DVec3) -> Mesh {
        let corner = |c: u32| DVec3::new(f64::from(c & 1), f64::from(c >> 1 & 1), f64::from(c >> 2));
        let points_mm = (0..8).map(|c| scan.grid().world(IndexPoint(low + (high - low) * corner(c))).0).collect();
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        Mesh { points_mm, triangles: faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect() }
    }

    #[test]
    fn samples_within_a_ball_are_those_nearer_than_its_radius() {
        // Fails if a line slips through between two triangles, or counts their common side twice: a whole line would be inside or out.
        let scan = scan();
        // A centre at a sample, so that lines pass through corners, sides and poles.
        for (centre, rings) in [(DVec3::new(20.0, 18.0, 17.0), 40), (DVec3::new(20.3, 18.1, 17.4), 24)] {
            let (radius, mesh) = (12.37, ball(&scan, centre, 12.37, rings));
            let inside = inside_of(&found(&scan, mesh.clone()).unwrap());
            let flat = radius * (PI / f64::from(rings)).cos().powi(2);
            let [nx, ny, _] = scan.grid().dims();
            let mut near = 0;
            for (n, is_inside) in inside.iter().enumerate() {
                let far = DVec3::new((n % nx) as f64, (n / nx % ny) as f64, (n / (nx * ny)) as f64).distance(centre);
                near += usize::from(far > flat && far <= radius);
                assert!((far > flat || *is_inside) && (far <= radius || !is_inside), "{n}: {far}");
            }
            println!("{} samples inside, {near} where the triangles cut off the ball", inside.iter().filter(|i| **i).count());
            // Turned inside out, or with some triangles turned, it holds the same.
            let mut turned = mesh.clone();
            turned.triangles.iter_mut().for_each(|t| t.swap(0, 1));
            assert!(inside_of(&found(&scan, turned).unwrap()) == inside);
            let mut mixed = mesh;
            mixed.triangles.iter_mut().step_by(3).for_each(|t| t.swap(0, 1));
            assert!(inside_of(&found(&scan, mixed).unwrap()) == inside);
        }
    }

    #[test]
    fn a_box_on_the_samples_has_no_stray_lines_and_two_that_overlap_are_one() {
        // Fails if a side in a plane of samples makes a line of samples inside of nothing, or what two shells share counts as outside.
        let mut scan = scan();
        // Without shear, so that its corners are whole numbers of samples in floats, too.
        let grid = Grid::new([44, 40, 36], DVec3::ONE, DVec3::ZERO, DMat3::IDENTITY).unwrap();
        let samples = Samples::U8(vec![0; grid.len()]);
        scan =
            Volume::new("scan".into(), "test", Raster { grid, samples, slope: 1.0, intercept: 0.0, unit: scan.unit(), warnings: vec![] })
                .unwrap();
        let (low, high) = (DVec3::new(5.0, 6.0, 7.0), DVec3::new(15.0, 16.0, 17.0));
        let one = inside_of(&found(&scan, cube(&scan, low, high)).unwrap());
        let [nx, ny, _] = scan.grid().dims();
        for (n, is_inside) in one.iter().enumerate() {
            let p = DVec3::new((n % nx) as f64, (n / nx % ny) as f64, (n / (nx * ny)) as f64);
            let (is_in, is_out) = (p.cmpgt(low).all() && p.cmplt(high).all(), p.cmplt(low).any() || p.cmpgt(high).any());
            assert!((!is_in || *is_inside) && (!is_out || !is_inside), "{p}");
        }
        let count = |inside: &[bool]| inside.iter().filter(|i| **i).count();
        // One end of each side counts as inside.
        assert_eq!(count(&one), 1000);
        let (mut two, other) = (cube(&scan, low, high), cube(&scan, low + 5.0, high + 5.0));
        two.triangles.extend(other.triangles.iter().map(|t| t.map(|n| n + 8)));
        two.points_mm.extend(other.points_mm);
        assert_eq!(count(&inside_of(&found(&scan, two).unwrap())), 2000 - 125);
    }

    #[test]
    fn an_open_surface_and_one_elsewhere_are_told_in_a_sentence() {
        // Fails if a hole fills lines of samples, or its edges are miscounted.
        let scan = scan();
        let mut mesh = cube(&scan, DVec3::splat(3.2), DVec3::splat(9.7));
        mesh.triangles.pop();
        let told = found(&scan, mesh).unwrap_err().to_string();
        println!("{told}");
        assert!(told.contains("3 of its edges") && told.contains("jaw.stl"), "{told}");
        let far = cube(&scan, DVec3::splat(300.0), DVec3::splat(320.0));
        assert!(matches!(found(&scan, far), Err(PartsError::Elsewhere { .. })));
        assert_eq!(found(&scan, cube(&scan, DVec3::splat(3.2), DVec3::splat(9.7))).unwrap().parts()[0].name, "jaw");
    }
}
