//! Registration: rigid and affine transforms of the world (LPS mm), read from the files that other programs write, and written.

mod covariance;
mod hdf5;
mod write;

pub use covariance::Covariance;
pub use write::{TransformForm, write_transform};

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};
use serde::Deserialize;
use serde_json::Value;
use std::path::Path;
use thiserror::Error;

/// Why a transform cannot be read. Each names the file.
#[derive(Debug, Error)]
#[error("{file}: {reason}")]
pub struct TransformError {
    file: String,
    reason: String,
}

/// How a scan is moved onto another.
#[derive(Clone, Debug, PartialEq)]
pub struct Registration {
    /// World to world, mm.
    pub transform: DAffine3,
    /// Root mean square distance that it leaves between landmarks, mm, where the file says (`rms_mm` in JSON).
    pub residual_mm: Option<f64>,
    /// How sure it is, where the file says (`covariance` in JSON).
    pub covariance: Option<Covariance>,
}

impl Registration {
    /// One of which nothing more is known.
    pub fn of(transform: DAffine3) -> Self {
        Self { transform, residual_mm: None, covariance: None }
    }
}

/// Reads the registration that moves the volume called `moving` onto one of those called `fixed`, from
/// * JSON: 4×4 rows, or an object with `R` (3×3 rows) and `t`; or `pairs`, an object of such objects named `moving->fixed`
///   after the scans, of which `FILE#NAME` picks one by name;
/// * an ITK transform as text (`.tfm`) or HDF5 (`.h5`): affine, Euler or versor. ITK's map leads from the fixed to the moving image, as resampling
///   needs it, so the volume is moved by its inverse, as in 3D Slicer.
pub fn read_transform(path: &Path, moving: &str, fixed: &[&str]) -> Result<Registration, TransformError> {
    let text_path = path.to_string_lossy();
    // FILE#NAME, unless a file is really called so.
    let split = text_path.rsplit_once('#').filter(|_| !path.exists());
    let (file, pair) = split.map_or((path, None), |(file, pair)| (Path::new(file), Some(pair)));
    let fail = |reason: String| TransformError { file: file.display().to_string(), reason };
    let bytes = std::fs::read(file).map_err(|e| fail(format!("cannot be read ({e}); check the name and permissions")))?;
    let text = String::from_utf8_lossy(&bytes);
    let registration = if bytes.starts_with(hdf5::MAGIC) {
        hdf5::read(bytes).map(|t| Registration::of(t.inverse()))
    } else if text.trim_start().starts_with("#Insight Transform File") {
        itk(&text).map(|t| Registration::of(t.inverse()))
    } else {
        match serde_json::from_str::<Value>(&text) {
            Ok(value) => json(&value, moving, fixed, pair),
            Err(e) => Err(format!("is neither JSON ({e}) nor an ITK transform; give a 4×4 matrix, R and t, a .tfm or a .h5")),
        }
    };
    let registration = registration.map_err(fail)?;
    let Registration { transform, residual_mm, covariance } = &registration;
    if residual_mm.is_some_and(|mm| !(mm.is_finite() && mm >= 0.0)) {
        return Err(fail("has an rms_mm that is no distance; correct it".into()));
    }
    if covariance.as_ref().is_some_and(|c| !c.is_sound()) {
        return Err(fail("has a covariance that is none (six rows, symmetric, no negative variance); register again".into()));
    }
    if !transform.is_finite() || transform.matrix3.determinant() == 0.0 {
        return Err(fail("holds a transform that cannot be inverted; register again".into()));
    }
    Ok(registration)
}

fn numbers(value: &Value) -> Option<Vec<f64>> {
    match value {
        Value::Number(n) => Some(vec![n.as_f64()?]),
        Value::Array(items) => items.iter().map(numbers).collect::<Option<Vec<_>>>().map(|v| v.concat()),
        _ => None,
    }
}

fn json(value: &Value, moving: &str, fixed: &[&str], pair: Option<&str>) -> Result<Registration, String> {
    if let Some(pairs) = value.get("pairs").and_then(Value::as_object) {
        // "A->B" belongs to scans called A and B, or A and B with an ending: A.nii.gz, but not A2.
        let names = |name: &str, key: &str| name.strip_prefix(key).is_some_and(|rest| !rest.starts_with(char::is_alphanumeric));
        let leads =
            |key: &str| key.split_once("->").is_some_and(|(from, to)| names(moving, from) && fixed.iter().any(|name| names(name, to)));
        let mut fitting = pairs.iter().filter(|(key, _)| pair.map_or_else(|| leads(key), |name| name == *key));
        let all = || pairs.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
        let (Some((_, chosen)), None) = (fitting.next(), fitting.next()) else {
            return Err(format!("has no one pair that leads from {moving} to another scan; name one as FILE#NAME of: {}", all()));
        };
        return json(chosen, moving, fixed, None);
    }
    if let (Some(r), Some(t)) = (value.get("R").and_then(numbers), value.get("t").and_then(numbers)) {
        let (Ok(r), Ok(t)) = (<[f64; 9]>::try_from(r), <[f64; 3]>::try_from(t)) else {
            return Err("has R and t, but not of 9 and 3 numbers".into());
        };
        let transform = DAffine3::from_mat3_translation(DMat3::from_cols_array(&r).transpose(), DVec3::from(t));
        let covariance =
            value.get("covariance").map(|c| Covariance::deserialize(c).map_err(|e| format!("has a covariance that cannot be read ({e})")));
        return Ok(Registration {
            transform,
            residual_mm: value.get("rms_mm").and_then(Value::as_f64),
            covariance: covariance.transpose()?,
        });
    }
    let rows: Option<[f64; 16]> = numbers(value).and_then(|n| n.try_into().ok());
    let matrix = DMat4::from_cols_array(&rows.ok_or("holds neither a 4×4 matrix nor R and t")?).transpose();
    if matrix.row(3) != glam::DVec4::W {
        return Err("holds a 4×4 matrix whose last row is not 0 0 0 1; give the rows in order".into());
    }
    Ok(Registration::of(DAffine3::from_mat4(matrix)))
}

fn itk(text: &str) -> Result<DAffine3, String> {
    let field = |name: &str| text.lines().find_map(|l| l.strip_prefix(name)).map(str::trim);
    let list = |name: &str| -> Result<Vec<f64>, String> {
        let text = field(name).ok_or_else(|| format!("has no line {name:?}"))?;
        text.split_whitespace().map(|w| w.parse().map_err(|_| format!("has {w:?} where {name:?} needs a number"))).collect()
    };
    let kind = field("Transform:").ok_or("has no line \"Transform:\"")?;
    if text.lines().filter(|l| l.starts_with("Transform:")).count() > 1 {
        return Err("holds several transforms; combine them into one".into());
    }
    linear(kind, &list("Parameters:")?, &list("FixedParameters:")?)
}

/// ITK's rigid and affine transforms by their parameters.
fn linear(kind: &str, parameters: &[f64], fixed: &[f64]) -> Result<DAffine3, String> {
    let centre = fixed.get(..3).map_or(DVec3::ZERO, DVec3::from_slice);
    let count = |n: usize| {
        if parameters.len() == n { Ok(()) } else { Err(format!("has {} parameters where {kind} has {n}", parameters.len())) }
    };
    let name = kind.split('_').next().unwrap_or(kind);
    let (matrix, translation) = match name {
        "AffineTransform" | "MatrixOffsetTransformBase" => {
            count(12)?;
            (DMat3::from_cols_slice(&parameters[..9]).transpose(), DVec3::from_slice(&parameters[9..]))
        }
        "Euler3DTransform" => {
            count(6)?;
            // ITK's order is Rz·Rx·Ry, or Rz·Ry·Rx where the fourth fixed parameter, "ComputeZYX", is set.
            let [x, y, z] =
                [DMat3::from_rotation_x(parameters[0]), DMat3::from_rotation_y(parameters[1]), DMat3::from_rotation_z(parameters[2])];
            let zyx = fixed.get(3).is_some_and(|&flag| flag != 0.0);
            let m = if zyx { z * y * x } else { z * x * y };
            (m, DVec3::from_slice(&parameters[3..]))
        }
        "VersorRigid3DTransform" => {
            count(6)?;
            let v = DVec3::from_slice(&parameters[..3]);
            let w = (1.0 - v.length_squared()).max(0.0).sqrt();
            (DMat3::from_quat(DQuat::from_xyzw(v.x, v.y, v.z, w)), DVec3::from_slice(&parameters[3..]))
        }
        _ => return Err(format!("is a {name}, which does not move a volume rigidly or affinely; export a linear transform")),
    };
    Ok(DAffine3::from_mat3_translation(matrix, translation + centre - matrix * centre))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str, name: &str) -> Result<Registration, TransformError> {
        let path = std::env::temp_dir().join(format!("bregma-transform-{}-{name}", std::process::id()));
        std::fs::write(&path, text).unwrap();
        let read = read_transform(&path, "A_1.nii.gz", &["B_2.nrrd"]);
        std::fs::remove_file(path).unwrap();
        read
    }

    #[test]
    fn all_forms_move_the_same_point_to_the_same_place() {
        // Fails if rows and columns are swapped, or ITK's direction is not turned round.
        let p = DVec3::new(1.0, 2.0, 3.0);
        let expected = DVec3::new(-2.0 + 10.0, 1.0 + 20.0, 3.0 + 30.0); // a quarter turn about z, then a shift
        let r = "[[0,-1,0],[1,0,0],[0,0,1]]";
        let forms = [
            ("rt.json", format!(r#"{{"R": {r}, "t": [10,20,30]}}"#)),
            ("rows.json", "[[0,-1,0,10],[1,0,0,20],[0,0,1,30],[0,0,0,1]]".to_owned()),
            ("pairs.json", format!(r#"{{"pairs": {{"B->A": {{}}, "A_1->B_2": {{"R": {r}, "t": [10,20,30]}}}}}}"#)),
            // The inverse: turned back about z, t' = −Rᵀt.
            ("itk.tfm", "#Insight Transform File V1.0\n#Transform 0\nTransform: AffineTransform_double_3_3\nParameters: 0 1 0 -1 0 0 0 0 1 -20 10 -30\nFixedParameters: 0 0 0\n".to_owned()),
            ("euler.tfm", "#Insight Transform File V1.0\n#Transform 0\nTransform: Euler3DTransform_double_3_3\nParameters: 0 0 -1.5707963267948966 -20 10 -30\nFixedParameters: 0 0 0\n".to_owned()),
        ];
        for (name, text) in forms {
            let moved = read(&text, name).unwrap().transform.transform_point3(p);
            assert!((moved - expected).length() < 1e-12, "{name}: {moved}");
        }
    }

    #[test]
    fn a_residual_is_read_where_it_is_stated() {
        let text = |rms: &str| format!(r#"{{"pairs": {{"A_1->B_2": {{"R": [[1,0,0],[0,1,0],[0,0,1]], "t": [0,0,0]{rms}}}}}}}"#);
        assert_eq!(read(&text(r#", "rms_mm": 0.25"#), "rms.json").unwrap().residual_mm, Some(0.25));
        assert_eq!(read(&text(""), "no-rms.json").unwrap().residual_mm, None);
    }

    #[test]
    fn what_cannot_be_used_says_why() {
        for (name, text, part) in [
            ("empty", "", "neither JSON"),
            ("no-pair", r#"{"pairs": {"X->Y": {}}}"#, "X->Y"),
            ("singular", r#"{"R": [[0,0,0],[0,0,0],[0,0,0]], "t": [0,0,0]}"#, "inverted"),
            ("residual", r#"{"R": [[1,0,0],[0,1,0],[0,0,1]], "t": [0,0,0], "rms_mm": -1}"#, "rms_mm"),
            ("other-name", r#"{"pairs": {"A_->B_2": {}}}"#, "A_->B_2"),
            ("two-fit", r#"{"pairs": {"A_1->B_2": {}, "A_1.nii->B_2": {}}}"#, "FILE#NAME"),
            ("two", "#Insight Transform File V1.0\nTransform: A\nParameters: 0\nFixedParameters: 0\nTransform: A\n", "several"),
            ("short", "[1,2,3]", "4×4"),
            (
                "spline",
                "#Insight Transform File V1.0\nTransform: BSplineTransform_double_3_3\nParameters: 0\nFixedParameters: 0\n",
                "BSpline",
            ),
        ] {
            let message = read(text, name).unwrap_err().to_string();
            assert!(message.contains(part) && message.contains(name), "{message}");
        }
    }
}
