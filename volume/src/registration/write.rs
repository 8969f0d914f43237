//! Registrations as files.

use super::{Registration, TransformError, hdf5};
use crate::replace::replace_file;
use glam::DAffine3;
use serde_json::{Map, Value, json};
use std::path::Path;

/// The forms that a registration is written in, by the endings of their files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TransformForm {
    /// `.json`: R and t, how sure they are, and what they were made from.
    Json,
    /// `.tfm`, `.txt`: ITK's text, as 3D Slicer, ANTs and elastix read it; it holds the transform alone.
    Itk,
    /// `.h5`: the same in HDF5, as SimpleITK and ANTs read it.
    Hdf5,
}

impl TransformForm {
    /// By the ending of a file's name.
    pub fn of(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_str()?.to_ascii_lowercase();
        match ending.as_str() {
            "json" => Some(Self::Json),
            "tfm" | "txt" => Some(Self::Itk),
            "h5" => Some(Self::Hdf5),
            _ => None,
        }
    }
}

/// Writes the registration that moves the first of two scans of these names onto the second, or that of one scan alone, in the form that the
/// ending of its name asks for. `record` is what JSON says besides.
pub fn write_transform(
    path: &Path,
    names: Option<[&str; 2]>,
    registration: &Registration,
    record: Map<String, Value>,
) -> Result<(), TransformError> {
    let fail = |reason: String| TransformError { file: path.display().to_string(), reason };
    let bytes = match TransformForm::of(path) {
        Some(TransformForm::Json) => {
            let object = Value::Object(object(registration, record));
            format!("{:#}\n", names.map_or(object.clone(), |names| json!({ "pairs": { names.join("->"): object } }))).into_bytes()
        }
        Some(TransformForm::Itk) => itk(&registration.transform.inverse()).into_bytes(),
        Some(TransformForm::Hdf5) => hdf5::written(&registration.transform.inverse()).map_err(fail)?,
        None => return Err(fail("has an ending that no registration has; use .json, .tfm, .txt or .h5".into())),
    };
    replace_file(path, |to| std::fs::write(to, &bytes)).map_err(|e| fail(format!("cannot be written ({e}); choose another folder")))
}

/// A registration as JSON has it.
fn object(registration: &Registration, mut record: Map<String, Value>) -> Map<String, Value> {
    let DAffine3 { matrix3, translation } = registration.transform;
    record.insert("R".into(), json!(matrix3.transpose().to_cols_array_2d()));
    record.insert("t".into(), json!(translation.to_array()));
    if let Some(mm) = registration.residual_mm {
        record.insert("rms_mm".into(), json!(mm));
    }
    if let Some(covariance) = &registration.covariance {
        record.insert("covariance".into(), json!(covariance));
    }
    record
}

/// ITK's map leads from the fixed to the moving scan.
fn itk(map: &DAffine3) -> String {
    let numbers = map.matrix3.transpose().to_cols_array().into_iter().chain(map.translation.to_array());
    let parameters: Vec<String> = numbers.map(|n| n.to_string()).collect();
    let header = "#Insight Transform File V1.0\n#Transform 0\nTransform: AffineTransform_double_3_3";
    format!("{header}\nParameters: {}\nFixedParameters: 0 0 0\n", parameters.join(" "))
}

#[cfg(test)]
mod tests {
    use super::super::{Covariance, read_transform};
    use super::*;
    use glam::{DMat3, DVec3};

    #[test]
    fn what_is_written_is_read_back() {
        // Fails if rows and columns are exchanged, ITK's direction is not turned round, or a digit or the covariance is lost.
        let matrix = DMat3::from_rotation_x(0.3) * DMat3::from_rotation_z(-1.1) * DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0));
        let transform = DAffine3::from_mat3_translation(matrix, DVec3::new(1e3, -0.1, 1.0 / 3.0));
        let covariance = Covariance { centre_mm: DVec3::Y, matrix: [[1.0 / 7.0; 6]; 6], undetermined: vec![[0.5; 6]] };
        let written = Registration { transform, residual_mm: Some(0.1 + 0.2), covariance: Some(covariance) };
        for (name, names) in
            [("a.json", Some(["a", "b"])), ("alone.json", None), ("a.tfm", None), ("a.h5", None), ("a.txt", Some(["a", "b"]))]
        {
            let path = std::env::temp_dir().join(format!("bregma-registration-{}-{name}", std::process::id()));
            write_transform(&path, names, &written, Map::new()).unwrap();
            let read = read_transform(&path, "a", &["b"]).unwrap();
            std::fs::remove_file(&path).unwrap();
            if name.ends_with(".json") {
                assert_eq!(read, written);
            } else {
                assert!(read.transform.abs_diff_eq(transform, 1e-12), "{name}: {read:?}");
            }
        }
        let error = write_transform(Path::new("a.mat"), None, &written, Map::new()).unwrap_err().to_string();
        assert!(error.contains("a.mat") && error.contains(".tfm"), "{error}");
    }
}
