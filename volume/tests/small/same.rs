//! The scan of `small` as DICOM, however its files are written: what it has to be once it is read.

use super::*;
use bregma_volume::formats::{Hints, open};
use bregma_volume::{Progress, ReadSamples, Volume};
use glam::DVec3;

/// Opens files that it writes into a folder of their own.
pub fn read_all(folder: &Folder, name: &'static str, files: Vec<(String, Vec<u8>)>) -> Result<Volume, String> {
    let path = Small { name, files, open: "" }.write(folder);
    open(&path, &Hints::default(), &Progress::default()).map_err(|e| e.to_string())
}

/// The values of a scan.
pub fn values(volume: &Volume) -> Vec<f64> {
    (0..volume.samples().len()).map(|n| volume.value_of(volume.samples().get_f64(n))).collect()
}

/// The values of the scan, HU.
pub fn hu() -> Vec<f64> {
    let [nx, ny, nz] = DIMS;
    (0..nx * ny * nz).map(|n| f64::from(sample(n % nx, n / nx % ny, n / (nx * ny))) - 1024.0).collect()
}

/// The scan that all of these are.
pub fn is_the_scan(what: &str, read: Result<Volume, String>) -> Volume {
    let volume = read.unwrap_or_else(|e| panic!("{what}: {e}"));
    assert_eq!(values(&volume), hu(), "{what}");
    assert!((volume.grid().spacing_mm() - DVec3::from(SPACING_MM)).length() < 1e-9, "{what}: {:?}", volume.grid());
    assert_eq!(volume.grid().origin_mm(), DVec3::new(-10.0, 20.0, 30.0), "{what}");
    volume
}

/// The data set of slice k as `change` leaves its elements, behind the meta information of `syntax`.
pub fn rewritten(k: usize, syntax: &'static str, change: impl Fn((u16, u16), &str, &[u8]) -> Vec<u8>) -> Vec<u8> {
    let slice = Dicom::slice(k);
    let set: Vec<u8> = slice.elements.iter().flat_map(|(tag, (vr, value))| change(*tag, vr, value)).collect();
    let empty = Dicom { syntax, elements: Default::default(), fragments: None };
    [empty.bytes(), set].concat()
}

/// The files of all slices, in another order than theirs.
pub fn files(make: impl Fn(usize) -> Vec<u8>) -> Vec<(String, Vec<u8>)> {
    (0..DIMS[2]).map(|k| (format!("IM{}", (k * 3 + 1) % 4), make(k))).collect()
}
