//! ITK's transforms in HDF5 (`.h5`), as SimpleITK and ANTs keep them: a group `TransformGroup/0` with the name of its kind and two lists of numbers.

use super::linear;
use glam::DAffine3;
use hdf5_pure::{CharacterSet, Datatype, Error, File, FileBuilder, StringPadding, make_u8_type};

/// How such files begin.
pub(super) const MAGIC: &[u8] = b"\x89HDF\r\n\x1a\n";

const KIND: &str = "TransformType";
const PARAMETERS: &str = "TransformParameters";
const FIXED: &str = "TransformFixedParameters";

/// The one transform of a file, from the fixed to the moving image.
pub(super) fn read(bytes: Vec<u8>) -> Result<DAffine3, String> {
    let damaged = |e: Error| format!("is no ITK transform in HDF5 ({e}); write it again");
    let file = File::from_bytes(bytes).map_err(damaged)?;
    if file.group("TransformGroup").and_then(|group| group.groups()).map_err(damaged)?.len() > 1 {
        return Err("holds several transforms; combine them into one".into());
    }
    let dataset = |name: &str| file.dataset(&format!("TransformGroup/0/{name}"));
    let numbers = |name: &str| dataset(name).and_then(|list| list.read_f64()).map_err(damaged);
    let kinds = dataset(KIND).and_then(|kind| kind.read_string()).map_err(damaged)?;
    linear(kinds.first().ok_or("names no kind of transform; write it again")?, &numbers(PARAMETERS)?, &numbers(FIXED)?)
}

/// A file of an affine transform, from the fixed to the moving image.
pub(super) fn written(map: &DAffine3) -> Result<Vec<u8>, String> {
    let parameters = [&map.matrix3.transpose().to_cols_array()[..], &map.translation.to_array()].concat();
    let mut file = FileBuilder::new();
    let mut all = file.create_group("TransformGroup");
    let mut only = all.create_group("0");
    // ITK reads names as variable-length ASCII, and HDF5 makes no ASCII of UTF-8.
    let ascii = Datatype::VariableLength {
        is_string: true,
        padding: Some(StringPadding::NullTerminate),
        charset: Some(CharacterSet::Ascii),
        base_type: Box::new(make_u8_type()),
    };
    only.create_dataset(KIND).with_vlen_strings(&["AffineTransform_double_3_3"]).with_dtype(ascii);
    only.create_dataset(PARAMETERS).with_f64_data(&parameters);
    only.create_dataset(FIXED).with_f64_data(&[0.0; 3]);
    all.add_group(only.finish());
    file.add_group(all.finish());
    file.finish().map_err(|e| format!("cannot be made ({e})"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DVec3};

    #[test]
    fn what_simple_itk_writes_is_read() {
        // Fails if its kind, centre or angles are taken otherwise. Written by SimpleITK 2.5 (ITK 5.4):
        // WriteTransform(Euler3DTransform((1, 2, 3), 0.1, 0.2, 0.3, (4, 5, 6)), "euler.h5").
        let map = read(include_bytes!("euler.h5").to_vec()).unwrap();
        let (centre, turn) =
            (DVec3::new(1.0, 2.0, 3.0), DMat3::from_rotation_z(0.3) * DMat3::from_rotation_x(0.1) * DMat3::from_rotation_y(0.2));
        let p = DVec3::new(-7.0, 11.0, 5.0);
        assert!(map.transform_point3(p).distance(turn * (p - centre) + centre + DVec3::new(4.0, 5.0, 6.0)) < 1e-12, "{map:?}");
    }

    #[test]
    fn no_bytes_make_it_panic() {
        // Fails if a damaged file is anything but an error, or another transform that can be.
        let whole = include_bytes!("euler.h5");
        for n in (0..whole.len()).step_by(37) {
            assert!(read(whole[..n].to_vec()).is_err(), "cut at {n}");
            let mut damaged = whole.to_vec();
            damaged[n] ^= 0x5a;
            _ = read(damaged);
        }
    }
}
