//! The density along a ray.

use bregma_renderer::{Ray, Surface};
use bregma_volume::{IndexPoint, Sample, with_samples};
use glam::DVec3;

/// The scan's value, interpolated, at `count` points of `ray` from `from_mm` to `to_mm`, both ends among them: pairs of mm and value. Points
/// outside the scan are left out.
pub fn profile(surface: &Surface, ray: &Ray, [from_mm, to_mm]: [f64; 2], count: usize) -> Vec<[f64; 2]> {
    let at = |n: usize| from_mm + (to_mm - from_mm) * n as f64 / (count.max(2) - 1) as f64;
    (0..count).map(at).filter_map(|t_mm| Some([t_mm, value_at(surface, surface.grid.index(ray.at(t_mm)))?])).collect()
}

/// The scan's value at a point of index space; `None` outside.
fn value_at(surface: &Surface, IndexPoint(p): IndexPoint) -> Option<f64> {
    let [nx, ny, nz] = surface.grid.dims();
    let last = DVec3::new(nx as f64, ny as f64, nz as f64) - 1.0;
    if surface.grid.is_flat() || p.cmplt(DVec3::ZERO).any() || p.cmpgt(last).any() {
        return None;
    }
    let cell = p.floor().min(last - 1.0);
    let (local, base) = (p - cell, (cell.z as usize * ny + cell.y as usize) * nx + cell.x as usize);
    let sample = with_samples!(surface.volume.samples(), samples => {
        (0..8).map(|c| {
            let away = DVec3::new((c & 1) as f64, (c >> 1 & 1) as f64, (c >> 2) as f64) - local;
            let weight = (1.0 - away.abs()).element_product();
            weight * samples[base + (c & 1) + (c >> 1 & 1) * nx + (c >> 2) * nx * ny].to_f64()
        }).sum()
    });
    Some(surface.volume.value_of(sample))
}
