//! The spacing of pictures, from the file that a scanner writes beside them: Bruker's `.log` (NRecon) and Nikon's `.xtekct`.

use super::super::entry::Entry;
use super::super::text::{decimal, settings};
use super::super::units::unit_mm;
use crate::Progress;
use glam::DVec3;

/// Such files have some kilobytes.
const MOST_BYTES: u64 = 1 << 20;

/// Spacing in mm that a file among `entries` states, and its name. Of several, the one whose name begins as that of `picture` does.
pub fn spacing_mm(entries: &[Entry], picture: &str, progress: &Progress) -> Option<(DVec3, String)> {
    let kind = |entry: &Entry| {
        let name = entry.name.to_lowercase();
        [(".log", log as fn(&str) -> Option<DVec3>), (".xtekct", xtekct)].into_iter().find(|(end, _)| name.ends_with(end)).map(|(_, f)| f)
    };
    let stated = |entry: &Entry| {
        let read = kind(entry).filter(|_| entry.bytes <= MOST_BYTES)?;
        let bytes = entry.read(progress).ok()?;
        let text: String = bytes.iter().map(|&b| char::from(b)).collect();
        Some((read(&text)?, entry.name.clone(), shared(&entry.name, picture)))
    };
    let found: Vec<(DVec3, String, usize)> = entries.iter().filter_map(stated).collect();
    let best = found.into_iter().rev().max_by_key(|(_, _, shared)| *shared)?;
    Some((best.0, best.1))
}

/// Letters that both names begin with.
fn shared(a: &str, b: &str) -> usize {
    a.chars().zip(b.chars()).take_while(|(a, b)| a == b).count()
}

fn positive(text: &str) -> Option<f64> {
    decimal(text).filter(|mm| *mm > 0.0)
}

/// `Pixel Size (um)` of the reconstruction, else `Image Pixel Size (um)` of the acquisition; cubes.
fn log(text: &str) -> Option<DVec3> {
    let size = |section: &str, name: &str| {
        let found = settings(text).filter(|(s, key, _)| s == section && key.starts_with(name)).last();
        let (_, key, value) = found?;
        // Micrometres, where the unit is not in the name or cannot be read.
        let unit = key.split_once('(').and_then(|(_, unit)| unit_mm(unit.trim_end_matches(')'))).unwrap_or(1e-3);
        Some(DVec3::splat(positive(value)? * unit))
    };
    size("reconstruction", "pixel size").or_else(|| size("acquisition", "image pixel size"))
}

/// `VoxelSizeX`, `Y` and `Z` in mm.
fn xtekct(text: &str) -> Option<DVec3> {
    let size = |axis: &str| settings(text).find(|(_, key, _)| *key == format!("voxelsize{axis}")).and_then(|(.., value)| positive(value));
    Some(DVec3::new(size("x")?, size("y")?, size("z")?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scanners_write_spacing_beside() {
        // Fails if the camera's pixel is taken for the image's, or if a unit or a decimal comma is misread.
        let bruker =
            "[Acquisition]\nCamera Pixel Size (um)=11.6\nImage Pixel Size (um)= 17,44\n[Reconstruction]\nReconstruction Program=NRecon\n";
        assert_eq!(log(bruker), Some(DVec3::splat(17.44 * 1e-3)));
        assert_eq!(log(&format!("{bruker}Pixel Size (\u{b5}m)=34.88")), Some(DVec3::splat(34.88 * 1e-3)));
        assert_eq!(log("[System]\nPixel Size (um)=0"), None);
        assert_eq!(
            xtekct("[XTekCT]\nVoxelsX=9\nVoxelSizeX=0.045\nVoxelSizeY=0.045\nVoxelSizeZ=0.05\n"),
            Some(DVec3::new(0.045, 0.045, 0.05))
        );
        assert_eq!(xtekct("[XTekCT]\nVoxelSizeX=0.045\n"), None);
    }
}
