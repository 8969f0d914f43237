//! The isosurface as a mesh, for values on the whole surface: a vertex for each cell that it passes and a quadrangle around each grid edge
//! that crosses it (the dual of marching cubes: Gibson 1998, "Constrained elastic surface nets", MICCAI, 888–898). Vertices lie on the
//! interpolant's surface.

use bregma_field::crossings::{self, Crossing};
use bregma_field::interpolant::{corners, smooth_normal, weighted};
use bregma_field::{Cancelled, IndexPoint, Progress, Ray, Sample, Store, Surface, WorldPoint, with_block};
use glam::{DVec3, USizeVec3};
use rayon::prelude::*;

/// A mesh of triangles.
///
/// ```
/// use bregma_field::{Grid, Surface};
/// use bregma_measure::mesh::Mesh;
/// use bregma_measure::thickness::{self, Method, Statistics};
/// use bregma_synthetic::analytic::Shell;
/// use glam::{DAffine3, DMat3, DVec3};
/// use std::sync::Arc;
///
/// // A hollow ball with a wall of 4 mm.
/// let grid = Grid::new([32; 3], DVec3::ONE, DVec3::splat(-15.5), DMat3::IDENTITY)?;
/// let ball = Shell { centre: DVec3::ZERO, inner_mm: 8.0, outer_mm: 12.0 }.volume(&grid);
/// let surface = Surface::new(&Arc::new(ball), 0.0, DAffine3::IDENTITY)?;
///
/// let mesh = Mesh::of(&surface, &Default::default())?;
/// let map_mm = thickness::map(&surface, &mesh, Method::Normal, &Default::default())?;
/// let statistics = Statistics::of(&mesh, &map_mm).expect("all of it has a thickness");
/// assert!((statistics.mean_mm - 4.0).abs() < 0.1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// LPS mm.
    pub vertices: Vec<DVec3>,
    /// Outward unit normals at the vertices: those that pictures are shaded by.
    pub normals: Vec<DVec3>,
    /// Numbers of three vertices, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// For each layer of cells, in order, the numbers of the cells in it that have a vertex, and the number of the first one's.
    layers: Vec<(Vec<u32>, u32)>,
    /// Cells in a row.
    across: usize,
}

impl Mesh {
    /// The mesh of `surface`. Nothing closes it where the scan's box cuts the bone. `progress` counts layers of cells, twice.
    pub fn of(surface: &Surface, progress: &Progress) -> Result<Self, Cancelled> {
        let [nx, ny, nz] = surface.grid.dims();
        let layers = nz.saturating_sub(1);
        progress.begin(2 * layers as u64);
        if surface.grid.is_flat() {
            return Ok(Self::default());
        }
        let found = |k: usize| -> Result<_, Cancelled> {
            progress.advance(1)?;
            let cells = passed(surface, k);
            let points: Vec<DVec3> = cells.iter().map(|cell| point_in(surface, *cell)).collect();
            Ok((cells.iter().map(|[i, j, _]| (j * (nx - 1) + i) as u32).collect::<Vec<_>>(), points))
        };
        let found = (0..layers).into_par_iter().map(found).collect::<Result<Vec<_>, _>>()?;
        let mut mesh = Self { across: nx - 1, ..Self::default() };
        for (cells, points) in found {
            mesh.layers.push((cells, mesh.vertices.len() as u32));
            mesh.vertices.extend(points);
        }
        let normal = |point: &DVec3| smooth_normal(surface, IndexPoint(*point)).unwrap_or(DVec3::Z);
        mesh.normals = mesh.vertices.par_iter().map(normal).collect();
        let map = surface.grid.index_to_world();
        mesh.vertices.par_iter_mut().for_each(|point| *point = map.transform_point3(*point));
        let is_mirrored = map.matrix3.determinant() < 0.0;
        let around = |k: usize| -> Result<_, Cancelled> {
            progress.advance(1)?;
            Ok(mesh.quadrangles(surface, k, [nx, ny, nz]))
        };
        let quadrangles = (0..layers).into_par_iter().map(around).collect::<Result<Vec<_>, _>>()?;
        let halves = |[a, b, c, d]: [u32; 4]| if is_mirrored { [[a, c, b], [a, d, c]] } else { [[a, b, c], [a, c, d]] };
        mesh.triangles = quadrangles.into_iter().flatten().flat_map(halves).collect();
        Ok(mesh)
    }

    /// The area that belongs to each vertex, a third of its triangles; mm².
    pub fn areas_mm2(&self) -> Vec<f64> {
        let mut areas = vec![0.0; self.vertices.len()];
        for triangle in &self.triangles {
            let [p, q, r] = triangle.map(|n| self.vertices[n as usize]);
            let third = (q - p).cross(r - p).length() / 6.0;
            triangle.iter().for_each(|n| areas[*n as usize] += third);
        }
        areas
    }

    /// The vertex of a cell, given by its lowest sample.
    pub fn vertex_of(&self, cell: [usize; 3]) -> Option<u32> {
        let (cells, first) = self.layers.get(cell[2])?;
        cells.binary_search(&((cell[1] * self.across + cell[0]) as u32)).ok().map(|n| first + n as u32)
    }

    /// Around the grid edges that begin in layer k at their lower end.
    fn quadrangles(&self, surface: &Surface, k: usize, dims: [usize; 3]) -> Vec<[u32; 4]> {
        let mut all = vec![];
        with_block!(Store::of(&surface.volume).whole(), block => {
            let is_inside = |at: [usize; 3]| inside(surface, block.at(at));
            for j in 0..dims[1] {
                for i in 0..dims[0] {
                    let at = [i, j, k];
                    let here = is_inside(at);
                    for axis in 0..3 {
                        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                        let mut next = at;
                        next[axis] += 1;
                        let has_cells = |a: usize| at[a] > 0 && at[a] + 1 < dims[a];
                        if next[axis] == dims[axis] || !has_cells(u) || !has_cells(v) || is_inside(next) == here {
                            continue;
                        }
                        let cell = |du: usize, dv: usize| {
                            let mut cell = at;
                            cell[u] -= du;
                            cell[v] -= dv;
                            self.vertex_of(cell)
                        };
                        // Each of the four cells has this edge, so a vertex. Seen from the upper end, they go round counter-clockwise.
                        if let (Some(a), Some(b), Some(c), Some(d)) = (cell(1, 1), cell(0, 1), cell(0, 0), cell(1, 0)) {
                            all.push(if here { [a, b, c, d] } else { [a, d, c, b] });
                        }
                    }
                }
            }
        });
        all
    }
}

fn inside<T: Sample>(surface: &Surface, sample: T) -> bool {
    f64::from(surface.sign) * (sample.to_f64() - surface.level) >= 0.0
}

/// The cells of layer k that the surface passes, in order.
pub fn passed(surface: &Surface, k: usize) -> Vec<[usize; 3]> {
    let [nx, ny, _] = surface.grid.dims();
    let mut cells = vec![];
    with_block!(Store::of(&surface.volume).whole(), block => {
        for j in 0..ny - 1 {
            let rows = [[0, j, k], [0, j + 1, k], [0, j, k + 1], [0, j + 1, k + 1]].map(|first| block.onward(first));
            let column = |i: usize| rows.iter().filter(|row| inside(surface, row[i])).count();
            let mut before = column(0);
            for i in 0..nx - 1 {
                let behind = column(i + 1);
                if !matches!(before + behind, 0 | 8) {
                    cells.push([i, j, k]);
                }
                before = behind;
            }
        }
    });
    cells
}

/// Halvings until a point lies on the surface: as many as float64 has digits.
const HALVINGS: usize = 52;

/// The point of the surface in a cell that it passes, in index space: on the line from the middle of its outer to that of its inner corners.
pub fn point_in(surface: &Surface, cell: [usize; 3]) -> DVec3 {
    let cell = USizeVec3::from(cell);
    let f = corners(surface, cell);
    let corner = |c: usize| DVec3::new((c & 1) as f64, (c >> 1 & 1) as f64, (c >> 2) as f64);
    // The mean of the crossings of the cell's edges is near the surface, and keeps the mesh even.
    let (mut sum, mut count) = (DVec3::ZERO, 0.0);
    for c in 0..8_usize {
        for axis in 0..3 {
            let other = c | 1 << axis;
            if other != c && (f[c] >= 0.0) != (f[other] >= 0.0) {
                sum += corner(c).lerp(corner(other), f[c] / (f[c] - f[other]));
                count += 1.0;
            }
        }
    }
    let middle = sum / count;
    // From there toward the corner that is farthest on the other side: between them the value changes sign.
    let is_in = weighted(&f, middle) >= 0.0;
    let extreme = (0..8).max_by(|a, b| if is_in { f[*b].total_cmp(&f[*a]) } else { f[*a].total_cmp(&f[*b]) });
    let (mut near, mut far) = (middle, extreme.map_or(middle, corner));
    for _ in 0..HALVINGS {
        let half = 0.5 * (near + far);
        if (weighted(&f, half) >= 0.0) == is_in { near = half } else { far = half }
    }
    cell.as_dvec3() + near
}

/// The point of the surface that is nearest to `point` along the smooth normal there, within `reach_mm`; `None` where there is none. It lies
/// on the interpolant's surface to float64 precision.
pub fn onto_surface(surface: &Surface, point: WorldPoint, reach_mm: f64) -> Option<Crossing> {
    let normal = smooth_normal(surface, surface.grid.index(point))?;
    let ray = Ray::new(WorldPoint(point.0 + reach_mm * normal), -normal)?;
    let crossings = crossings::crossings(surface, &ray).into_iter().filter(|c| c.t_mm <= 2.0 * reach_mm && !c.clipped && !c.at_origin);
    crossings.min_by(|a, b| (a.t_mm - reach_mm).abs().total_cmp(&(b.t_mm - reach_mm).abs()))
}
