//! What the scans hold at a point: values, and where it is among their samples.

use crate::opened::Opened;
use bregma_field::{IndexPoint, Unit, WorldPoint, interpolant};
use glam::DVec3;

/// What a scan holds at a point.
#[derive(Clone, Debug, PartialEq)]
pub struct Held {
    /// The scan.
    pub scan: String,
    /// The value between its samples.
    pub value: f64,
    /// What that is.
    pub unit: Unit,
    /// Where the point is among the samples, counted from 0.
    pub index: IndexPoint,
}

impl Opened {
    /// What the visible scans hold at a point of the world, LPS mm; nothing of those that it lies outside of.
    pub fn held_at(&self, point_mm: DVec3) -> Vec<Held> {
        let surfaces = self.scene.surfaces(&self.volumes).unwrap_or_default();
        let held = |surface: &bregma_renderer::Surface| {
            let (inside, _) = interpolant::depth_at(surface, WorldPoint(point_mm))?;
            let volume = &surface.volume;
            let value = volume.value_of(surface.level + f64::from(surface.sign) * inside);
            let index = surface.grid.index(WorldPoint(point_mm));
            Some(Held { scan: volume.name().to_owned(), value, unit: volume.unit(), index })
        };
        surfaces.iter().filter_map(|(_, surface)| held(surface)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_is_held_where_it_lies() {
        // Fails if a value is another sample's, a registration is left out, or a scan is said to hold something beside its box.
        let mut opened = Opened::demo(16, &Default::default()).unwrap();
        opened.scene.layers[1].transform = glam::DAffine3::from_translation(DVec3::new(4.0, -3.0, 2.0));
        for n in 0..2 {
            let surface = &opened.scene.surfaces(&opened.volumes).unwrap()[n].1;
            let index = IndexPoint(DVec3::new(5.0, 7.0, 6.0));
            let held = opened.held_at(surface.grid.world(index).0);
            let own = held.iter().find(|held| held.scan == opened.volumes[n].name()).unwrap();
            let dims = surface.grid.dims();
            // What is inside the surface by nothing has the isovalue; the first corner of the cell is the sample itself.
            let corner = interpolant::corners(surface, glam::USizeVec3::new(5, 7, 6))[0];
            let sample = opened.volumes[n].value_of(surface.level + f64::from(surface.sign) * corner);
            assert!((own.value - sample).abs() < 1e-6 && (own.index.0 - index.0).length() < 1e-9, "{own:?} of {dims:?}: {sample}");
        }
        assert_eq!(opened.held_at(DVec3::splat(1e4)), vec![]);
        opened.scene.layers[0].visible = false;
        assert!(opened.held_at(opened.bounds().centre_mm).len() <= 1);
    }
}
