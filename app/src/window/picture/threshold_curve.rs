//! How the length of a bone depends on the isovalue that says where it ends.

use bregma_field::crossings::{self, Kind};
use bregma_renderer::{Ray, Surface};

/// Isovalues on each side of the chosen one.
const EACH_SIDE: i32 = 40;

/// Isovalue and length, mm, over half the step from air to bone to both sides of `iso`, of the bone that lies from `from_mm` to `to_mm` there;
/// a length of 0 where no bone is left. Nothing for a scan of one value.
pub fn curve(surface: &Surface, ray: &Ray, iso: f64, [from_mm, to_mm]: [f64; 2]) -> Vec<[f64; 2]> {
    let Some(step) = surface.volume.otsu_step() else { return vec![] };
    let length = |iso: f64| {
        let surface = Surface { level: surface.volume.sample_of(iso), ..surface.clone() };
        let ends: Vec<f64> = crossings::crossings(&surface, ray).iter().filter(|c| c.kind != Kind::Touch).map(|c| c.t_mm).collect();
        let common = |bone: &[f64]| bone[1].min(to_mm) - bone[0].max(from_mm);
        // Where it falls apart or grows into another, the part or the whole that has most of it.
        let same = ends.chunks_exact(2).filter(|bone| common(bone) > 0.0).max_by(|a, b| common(a).total_cmp(&common(b)));
        same.map_or(0.0, |bone| bone[1] - bone[0])
    };
    let isovalue = |n: i32| iso + 0.5 * step * f64::from(n) / f64::from(EACH_SIDE);
    (-EACH_SIDE..=EACH_SIDE).map(|n| [isovalue(n), length(isovalue(n))]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_field::{Grid, Raster, Samples, Unit, Volume, WorldPoint};
    use glam::{DAffine3, DMat3, DVec3};
    use std::sync::Arc;

    #[test]
    fn a_wall_of_known_profile_has_the_lengths_that_its_profile_says() {
        // Fails if the curve is of another bone of the ray, or its isovalues are not those that the lengths are of.
        let grid = Grid::new([41, 3, 3], DVec3::ONE, DVec3::ZERO, DMat3::IDENTITY).unwrap();
        // Two walls whose value falls by 1 for each mm from their middles, at 10 and 30 mm.
        let value = |n: usize| (6.0 - ((n % 41) as f32 - 10.0).abs()).max(5.0 - ((n % 41) as f32 - 30.0).abs()).max(-1.0);
        let samples = Samples::F32((0..369).map(value).collect());
        let raster = Raster { grid, samples, slope: 1.0, intercept: 0.0, unit: Unit::Value, warnings: vec![] };
        let volume = Arc::new(Volume::new("walls".into(), "test", raster).unwrap());
        let surface = Surface::new(&volume, 2.0, DAffine3::IDENTITY).unwrap();
        let ray = Ray::new(WorldPoint(DVec3::new(-5.0, 1.0, 1.0)), DVec3::X).unwrap();
        let step = volume.otsu_step().unwrap();
        for (middle, height) in [(10.0, 6.0), (30.0, 5.0)] {
            let bone = [middle + 5.0 - (height - 2.0), middle + 5.0 + (height - 2.0)];
            let curve = curve(&surface, &ray, 2.0, bone);
            assert!((curve[0][0] - (2.0 - step / 2.0)).abs() < 1e-9 && curve.len() == 81);
            for [iso, length] in curve.into_iter().filter(|[iso, _]| *iso > -0.9) {
                let expected = 2.0 * (height - iso).max(0.0);
                assert!((length - expected).abs() < 1e-6, "{length} for {expected} mm at {iso}");
            }
        }
    }
}
