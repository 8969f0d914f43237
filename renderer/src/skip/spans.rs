//! Which part of its depth a picture must be looked at for a surface, block by block: from the nearest to the farthest cell that can hold
//! it and that the block's pixels can see, brick by brick. Rays begin and end there; blocks without such a brick have no rays at all.

use super::cell_masks::CellMasks;
use super::occupancy::DistanceMap;
use crate::camera::{Camera, Projection, Raster};
use bregma_field::{BRICK, Grid};
use glam::{DAffine3, DMat3, DVec3};
use rayon::prelude::*;

/// Pixels across and down a block: the workgroup of the GPU.
pub(crate) const BLOCK: u32 = 8;

/// Nearest and farthest depth of each block, behind the base plane in mm; the first is the larger where there is nothing.
#[derive(Debug)]
pub(crate) struct Spans {
    /// Blocks in a row.
    pub across: u32,
    /// Row by row.
    pub blocks: Vec<[f32; 2]>,
}

/// Where there is nothing.
const NOTHING: [f32; 2] = [f32::MAX, f32::MIN];

/// Bricks that a thread takes at once: a tenth of a millisecond's work.
const CHUNK: usize = 2048;

impl Spans {
    /// The spans of a surface whose volume lies in `grid`, in a picture with its base plane at `base_mm`; `is_cut` when rays may begin within the
    /// volume.
    pub fn of(map: &DistanceMap, masks: &CellMasks, grid: &Grid, camera: &Camera, base_mm: f64, raster: Raster, is_cut: bool) -> Self {
        let [width, height] = raster.size;
        let (across, down) = (width.div_ceil(BLOCK), height.div_ceil(BLOCK));
        let view = View::new(grid, camera, base_mm, raster);
        let empty = || vec![NOTHING; across as usize * down as usize];
        let add = |mut blocks: Vec<[f32; 2]>, bricks: &[u32]| {
            for &brick in bricks {
                let (s, x, y) = view.cells(map, masks, brick, across, down);
                for row in y[0]..y[1] {
                    for block in &mut blocks[row * across as usize..][x[0]..x[1]] {
                        *block = [block[0].min(s[0]), block[1].max(s[1])];
                    }
                }
            }
            blocks
        };
        let join = |a: Vec<[f32; 2]>, b: Vec<[f32; 2]>| a.into_iter().zip(b).map(|(a, b)| [a[0].min(b[0]), a[1].max(b[1])]).collect();
        // A ray that begins inside the volume may begin in any brick.
        let bricks = if is_cut || view.begins_inside { map.occupied() } else { masks.exposed().to_vec() };
        let blocks = bricks.par_chunks(CHUNK).fold(empty, add).reduce(empty, join);
        Self { across, blocks }
    }

    /// All depths up to `s_max` in every block.
    pub fn everywhere(s_max: f64, [width, height]: [u32; 2]) -> Self {
        let (across, down) = (width.div_ceil(BLOCK), height.div_ceil(BLOCK));
        Self { across, blocks: vec![[0.0, s_max as f32]; across as usize * down as usize] }
    }

    /// The span of the block with pixel (x, y).
    pub fn at(&self, x: u32, y: u32) -> [f32; 2] {
        self.blocks[(y / BLOCK * self.across + x / BLOCK) as usize]
    }
}

/// Whether the plane of the eye cuts a volume, or has it behind itself.
pub(super) fn begins_inside(grid: &Grid, camera: &Camera) -> bool {
    let forward = camera.basis().forward;
    grid.corners_mm().into_iter().any(|corner| (corner - camera.eye_mm).dot(forward) <= 0.0)
}

/// How bricks of a grid appear in a picture.
struct View {
    /// From index space to the right, up, and into the picture from the eye; mm.
    to_view: DAffine3,
    /// Half the size of a cell in that space, along its axes, for each axis of the grid.
    half: DMat3,
    perspective: bool,
    /// Pixels for a unit of slope (perspective) or for a mm.
    scale: f64,
    /// The middle of the picture in pixels, from the point of the first one that is looked through.
    middle: [f64; 2],
    base_mm: f64,
    /// The plane of the eye cuts the volume, or has it behind itself.
    begins_inside: bool,
}

/// Of a pixel: what rounding moves a projected corner by, many times over.
const PIXEL_MARGIN: f64 = 0.01;
/// Of a depth: what rounding to float32 moves it by, many times over.
const DEPTH_MARGIN: f64 = 1e-6;

impl View {
    fn new(grid: &Grid, camera: &Camera, base_mm: f64, Raster { size: [width, height], point_px: [x, y] }: Raster) -> Self {
        let basis = camera.basis();
        let from_world = DMat3::from_cols(basis.right, basis.up, basis.forward).transpose();
        let to_view = DAffine3::from_mat3_translation(from_world, -(from_world * camera.eye_mm)) * grid.index_to_world();
        let m = to_view.matrix3;
        let half = DMat3::from_cols(m.x_axis.abs() / 2.0, m.y_axis.abs() / 2.0, m.z_axis.abs() / 2.0);
        let middle = [(width, x), (height, y)].map(|(n, point)| f64::from(n) / 2.0 - 0.5 - point);
        let scale = f64::from(height) / (2.0 * camera.half_height());
        let perspective = matches!(camera.projection, Projection::Perspective { .. });
        Self { to_view, half, perspective, scale, middle, base_mm, begins_inside: begins_inside(grid, camera) }
    }

    /// Depths of a brick's cells behind the base plane, and the blocks that may see them: first and last + 1 across and down.
    fn cells(&self, map: &DistanceMap, masks: &CellMasks, brick: u32, across: u32, down: u32) -> ([f32; 2], [usize; 2], [usize; 2]) {
        let [nx, ny, _] = map.dims();
        let n = brick as usize;
        let corner = DVec3::new((n % nx) as f64, (n / nx % ny) as f64, (n / (nx * ny)) as f64) * BRICK as f64;
        let [first, end] = masks.cells(brick).map(|cell| DVec3::from(cell.map(f64::from)));
        let centre = self.to_view.transform_point3(corner + (first + end) / 2.0);
        let half = self.half * (end - first);
        let (near, far) = (centre.z - half.z, centre.z + half.z);
        let margin = DEPTH_MARGIN * far.abs().max(near.abs());
        let s = [(near - margin - self.base_mm) as f32, (far + margin - self.base_mm) as f32];
        // What comes up to the eye may be seen anywhere.
        if self.perspective && near <= margin {
            return (s, [0, across as usize], [0, down as usize]);
        }
        let blocks = |axis: usize, sign: f64, count: u32| {
            let (low, high) = (centre[axis] - half[axis], centre[axis] + half[axis]);
            // The nearer end reaches farther out.
            let slope = |v: f64, outward: bool| if self.perspective { v / if outward { near } else { far } } else { v };
            let (low, high) = (slope(low, low < 0.0), slope(high, high > 0.0));
            let (a, b) = (self.middle[axis] + sign * self.scale * low, self.middle[axis] + sign * self.scale * high);
            let block = |pixel: f64| (pixel / f64::from(BLOCK)).clamp(0.0, f64::from(count)) as usize;
            let (first, last) =
                (block(a.min(b) - PIXEL_MARGIN), block((a.max(b) + PIXEL_MARGIN).max(-f64::from(BLOCK)) + f64::from(BLOCK)));
            [first, last.min(count as usize)]
        };
        (s, blocks(0, 1.0, across), blocks(1, -1.0, down))
    }
}

#[cfg(test)]
mod tests {
    use super::super::cell_masks::tests::maps_of;
    use super::*;
    use crate::camera::point_in_pixel;
    use crate::stability::Random;

    #[test]
    fn every_point_of_the_cells_that_can_hold_the_surface_lies_in_the_span_of_its_pixel() {
        // Fails if a projection, a margin or a rounding leaves out a block or a depth: a hole in the picture. Cameras all around, near,
        // far, and inside; parallel and perspective; sheared grids.
        let mut random = Random(5);
        let dims = [40, 33, 20];
        let mut tested = 0;
        for n in 0..200 {
            // Mostly empty, or mostly full: then many bricks lie among others whose cells are all occupied.
            let part = if n % 2 == 0 { 0.003 } else { 0.3 };
            let samples: Vec<u8> = (0..dims.iter().product()).map(|_| u8::from(random.unit() < part)).collect();
            let (map, masks) = maps_of(samples, dims);
            let mut point = || random.point().as_dvec3() - 0.5;
            let shear = DMat3::from_cols(DVec3::X + 0.4 * point(), DVec3::Y * 1.5 + 0.4 * point(), DVec3::Z + 0.4 * point());
            let grid = Grid::from_affine(dims, DAffine3::from_mat3_translation(shear, 30.0 * point())).unwrap();
            let distance = [20.0, 60.0, 300.0, 1e5][n % 4];
            let projection = if n % 3 == 0 {
                Projection::Orthographic { height_mm: 50.0 }
            } else {
                Projection::Perspective { fov_deg: [30.0, 80.0, 0.02][n / 4 % 3] }
            };
            let target_mm = 20.0 * point();
            let camera = Camera { eye_mm: target_mm + distance * point().normalize(), target_mm, up: DVec3::Z, projection };
            let (w, h) = (61, 90);
            let base_mm = if n % 2 == 0 { 0.0 } else { 3.0 };
            let sample = n as u32 % 5;
            let raster = Raster { size: [w, h], point_px: point_in_pixel(sample) };
            let spans = Spans::of(&map, &masks, &grid, &camera, base_mm, raster, false);
            let forward = camera.basis().forward;
            let [bx, by, _] = map.dims();
            for brick in map.occupied() {
                let b = brick as usize;
                let corner = DVec3::new((b % bx) as f64, (b / bx % by) as f64, (b / (bx * by)) as f64) * 8.0;
                let [first, end] = masks.cells(brick).map(|cell| DVec3::from(cell.map(f64::from)));
                for _ in 0..50 {
                    let index = corner + first + random.point().as_dvec3() * (end - first);
                    let p = grid.world(bregma_field::IndexPoint(index));
                    let Some((x, y)) = camera.project(p, w, h) else { continue };
                    // In pixels from the point of pixel (0, 0) that is looked through.
                    let [x, y] = [x - raster.point_px[0], y - raster.point_px[1]];
                    // Between the outermost pixels; a block begins at its first pixel and ends at the next block's.
                    let inside = (0.0..=f64::from(w - 1)).contains(&x) && (0.0..=f64::from(h - 1)).contains(&y);
                    if !inside {
                        continue;
                    }
                    let s = (p.0 - camera.eye_mm).dot(forward) - base_mm;
                    let [near, far] = spans.at(x as u32, y as u32);
                    let exposed = masks.exposed().contains(&brick);
                    // A brick among bricks lies behind an exposed one, but not behind the span's far end.
                    assert!(s <= f64::from(far) && (!exposed || s >= f64::from(near)), "{n}: {s} is not within {near}..{far}");
                    tested += 1;
                }
            }
        }
        println!("{tested} points");
        assert!(tested > 50_000, "{tested}");
    }
}
