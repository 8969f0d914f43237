//! A scan's content as a number, by which it is known again whatever file it lies in.

use crate::{ReadSamples, Sample, Volume, with_samples};
use sha2::{Digest, Sha256};

impl Volume {
    /// SHA-256 of grid, scale and samples as lowercase hexadecimal: little-endian dims as u64, index to world (columns, then origin), slope
    /// and intercept as float64, samples as float32, which holds those of every type. Two files of one scan have the same content, however
    /// they store it.
    pub fn content(&self) -> String {
        let mut hash = Sha256::new();
        self.grid().dims().iter().for_each(|n| hash.update((*n as u64).to_le_bytes()));
        let map = self.grid().index_to_world().to_cols_array();
        map.iter().chain([self.slope(), self.intercept()].iter()).for_each(|v| hash.update(v.to_le_bytes()));
        with_samples!(self.samples(), samples => {
            let mut bytes = Vec::new();
            for chunk in samples.chunks(1 << 16) {
                bytes.clear();
                bytes.extend(chunk.iter().flat_map(|s| s.to_f32().to_le_bytes()));
                hash.update(&bytes);
            }
        });
        hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

#[cfg(test)]
mod tests {
    use crate::{Grid, Raster, Samples, Unit, Volume};
    use glam::{DMat3, DVec3};

    #[test]
    fn content_is_what_the_scan_says_and_not_how_it_is_stored() {
        // Fails if a sample, the grid or the scale is left out, or the type of the samples is not.
        let scan = |samples: Samples, spacing: f64, slope: f64| {
            let grid = Grid::new([2, 2, 2], DVec3::splat(spacing), DVec3::ZERO, DMat3::IDENTITY).unwrap();
            let raster = Raster { grid, samples, slope, intercept: 0.0, unit: Unit::Value, warnings: vec![] };
            Volume::new("scan".into(), "test", raster).unwrap().content()
        };
        let one = scan(Samples::U8((0..8).collect()), 1.0, 1.0);
        assert_eq!(one, scan(Samples::I16((0..8).collect()), 1.0, 1.0));
        assert_eq!(one.len(), 64);
        for other in [
            scan(Samples::U8((1..9).collect()), 1.0, 1.0),
            scan(Samples::U8((0..8).collect()), 1.1, 1.0),
            scan(Samples::U8((0..8).collect()), 1.0, 2.0),
        ] {
            assert_ne!(one, other);
        }
    }
}
