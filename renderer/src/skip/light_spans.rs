//! How far toward the light a shadow ray must be followed: to the nearest cell, as the light sees it, that can hold the surface.

use super::cell_masks::CellMasks;
use super::occupancy::DistanceMap;
use super::spans::{BLOCK, Spans};
use crate::camera::{Camera, Projection, Raster};
use bregma_field::{BRICK, Grid};
use glam::{DAffine3, DMat3, DVec3};

/// A surface as the light sees it, in blocks of half a brick's size.
///
/// ```text
///   light ☼ ──near──►┌──┐
///          ───near──────────►┌──┐   depth: a shadow ray from p is followed toward the light as far as depth(p) − near
///          ──────────────────────►  a block without cells: near is enormous
/// ```
#[derive(Debug, Default)]
pub(crate) struct LightSpans {
    /// Blocks across and down.
    pub size: [u32; 2],
    /// Depth in mm, from the light on, at which each block's nearest such cell lies, row by row; enormous where it has none.
    pub near: Vec<f32>,
    /// From index space to the column, the row and the depth.
    pub from_index: DAffine3,
}

/// Of a voxel: what rounding to float32 moves a hit by, many times over.
const DEPTH_MARGIN_VOXEL: f64 = 0.01;

impl LightSpans {
    /// Of a surface whose volume lies in `grid`, seen from where `toward_light` (unit) points.
    pub fn of(map: &DistanceMap, masks: &CellMasks, grid: &Grid, toward_light: DVec3) -> Self {
        let corners = grid.corners_mm();
        let centre = corners.into_iter().sum::<DVec3>() / 8.0;
        let radius_mm = corners.map(|c| c.distance(centre)).into_iter().fold(0.0, f64::max);
        let spacing_mm = grid.spacing_mm();
        let block_mm = spacing_mm.max_element() * BRICK as f64 / 2.0;
        let count = (2.0 * radius_mm / block_mm).ceil().max(1.0) as u32;
        let camera = Camera {
            // Farther than the box is large: nothing lies behind it.
            eye_mm: centre + 2.0 * radius_mm * toward_light,
            target_mm: centre,
            up: toward_light.any_orthonormal_vector(),
            projection: Projection::Orthographic { height_mm: f64::from(count) * block_mm },
        };
        let spans = Spans::of(map, masks, grid, &camera, 0.0, Raster::new([count * BLOCK; 2]), false);
        let basis = camera.basis();
        let to_view = DMat3::from_cols(basis.right / block_mm, -basis.up / block_mm, basis.forward).transpose();
        // A pixel's middle has whole coordinates, and the picture's middle lies between pixels.
        let middle = f64::from(count) / 2.0 - 0.5 / f64::from(BLOCK);
        let from_world = DAffine3::from_mat3_translation(to_view, DVec3::new(middle, middle, 0.0) - to_view * camera.eye_mm);
        let margin = (DEPTH_MARGIN_VOXEL * spacing_mm.max_element()) as f32;
        let near = spans.blocks.iter().map(|[near, _]| near - margin).collect();
        Self { size: [count; 2], near, from_index: from_world * grid.index_to_world() }
    }
}

#[cfg(test)]
mod tests {
    use super::super::cell_masks::tests::maps_of;
    use super::*;
    use crate::stability::Random;

    #[test]
    fn no_point_of_a_cell_that_can_hold_the_surface_lies_nearer_to_the_light_than_its_block_says() {
        // Fails if a block or a depth is left out: shadows would have holes.
        let mut random = Random(8);
        let dims = [40, 33, 20];
        let mut tested = 0;
        for _ in 0..100 {
            let samples: Vec<u8> = (0..dims.iter().product()).map(|_| u8::from(random.unit() < 0.003)).collect();
            let (map, masks) = maps_of(samples, dims);
            let mut point = || random.point().as_dvec3() - 0.5;
            let shear = DMat3::from_cols(DVec3::X + 0.4 * point(), DVec3::Y * 1.5 + 0.4 * point(), DVec3::Z * 0.3 + 0.4 * point());
            let grid = Grid::from_affine(dims, DAffine3::from_mat3_translation(shear, 30.0 * point())).unwrap();
            let light = LightSpans::of(&map, &masks, &grid, point().normalize());
            let [bx, by, _] = map.dims();
            for brick in masks.exposed() {
                let b = *brick as usize;
                let corner = DVec3::new((b % bx) as f64, (b / bx % by) as f64, (b / (bx * by)) as f64) * BRICK as f64;
                let [first, end] = masks.cells(*brick).map(|cell| DVec3::from(cell.map(f64::from)));
                for _ in 0..50 {
                    let seen = light.from_index.transform_point3(corner + first + random.point().as_dvec3() * (end - first));
                    let [x, y] = [seen.x, seen.y].map(|v| v.floor() as usize);
                    let near = light.near[y * light.size[0] as usize + x];
                    assert!(seen.z > f64::from(near), "{} before {near}", seen.z);
                    tested += 1;
                }
            }
        }
        assert!(tested > 50_000, "{tested}");
    }
}
