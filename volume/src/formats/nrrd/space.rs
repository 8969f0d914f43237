//! Where the samples lie: sizes, spacings, space directions, units and the names of spaces.

use super::super::units::unit_mm;
use super::super::{Hints, NO_SPACING, ReadError};
use super::header::Header;
use crate::{Grid, GridError};
use glam::{DAffine3, DMat3, DVec3};

/// The most axes a NRRD can have (`NRRD_DIM_MAX`).
const MOST_AXES: usize = 16;

/// Samples along each axis as the file counts axes, fastest first.
pub fn sizes(header: &Header) -> Result<Vec<usize>, ReadError> {
    header.required("dimension")?;
    header.required("sizes")?;
    let dimension = header.number("dimension")?.filter(|d| (1..=MOST_AXES).contains(d));
    let dimension = dimension.ok_or_else(|| header.bad("dimension", "it must be from 1 to 16"))?;
    let sizes: Vec<usize> = header.numbers("sizes", dimension)?.unwrap_or_default();
    if sizes.iter().try_fold(1_usize, |n, &size| n.checked_mul(size)).is_none() {
        return Err(header.bad("sizes", "this is more than any machine can address"));
    }
    Ok(sizes)
}

/// The axis along which a file of four lists images of the same grid, if it has one: the one of the kind `list`, or without a direction.
pub fn list_axis(header: &Header, sizes: &[usize]) -> Result<Option<usize>, ReadError> {
    let kinds = header.words("kinds").unwrap_or_default();
    let directions = header.vectors("space directions", sizes.len())?;
    let is_list = |a: &usize| kinds.get(*a) == Some(&"list") || directions.as_ref().is_some_and(|d| d[*a].is_none());
    Ok((0..sizes.len()).filter(|_| sizes.len() == 4).find(is_list))
}

/// The three axes of space among the file's: all of three, or of four all but `list` or one that has a single sample.
fn axes(header: &Header, sizes: &[usize], directions: Option<&[Option<DVec3>]>, list: Option<usize>) -> Result<[usize; 3], ReadError> {
    // The kinds of NRRD whose axis holds the parts of one sample (its definition of the field `kinds`).
    const PARTS: [&str; 7] = ["color", "vector", "complex", "matrix", "normal", "gradient", "quaternion"];
    let kinds = header.words("kinds").unwrap_or_default();
    let parts = |a: usize| kinds.get(a).is_some_and(|kind| PARTS.iter().any(|p| kind.to_lowercase().contains(p)));
    let spatial = |a: usize| !parts(a) && directions.is_none_or(|d| d[a].is_some());
    let dropped = match sizes.len() {
        3 if (0..3).all(spatial) => return Ok([0, 1, 2]),
        // An axis that has no direction is not one of space; without directions the last is the likely one (time).
        4 if list.is_some() => list,
        4 => (0..4).rev().filter(|&a| sizes[a] == 1).max_by_key(|&a| (!spatial(a), a)),
        _ => None,
    };
    let kept: Option<[usize; 3]> = dropped.and_then(|d| (0..sizes.len()).filter(|&a| a != d).collect::<Vec<_>>().try_into().ok());
    kept.filter(|kept| kept.iter().all(|&a| spatial(a))).ok_or_else(|| {
        let kinds = header.value("kinds").map_or(String::new(), |k| format!(" ({k})"));
        let text = format!("its sizes are {sizes:?}{kinds}; only images of three axes of space with one number a sample can be read");
        ReadError::Unsupported(text)
    })
}

/// What a named space is in LPS: the signs of its axes, and whether it is anatomical and therefore in mm.
fn frame(header: &Header, warnings: &mut Vec<String>) -> Result<(DVec3, bool), ReadError> {
    if let Some(n) = header.number::<usize>("space dimension")?.filter(|&n| n != 3) {
        return Err(ReadError::Unsupported(format!("its space has {n} dimensions; only 3 can be read")));
    }
    let name = header.value("space").unwrap_or_default();
    let assumed = "its axes are taken as left, posterior, superior";
    let (signs, anatomical) = match name.to_lowercase().as_str() {
        "left-posterior-superior" | "lps" => (DVec3::ONE, true),
        "right-anterior-superior" | "ras" => (DVec3::new(-1.0, -1.0, 1.0), true),
        "left-anterior-superior" | "las" => (DVec3::new(1.0, -1.0, 1.0), true),
        "scanner-xyz" => {
            warnings.push(format!("the file states its position in the scanner, not in the patient; {assumed}"));
            (DVec3::ONE, true)
        }
        "" | "3d-right-handed" => {
            warnings.push(format!("the file does not state how it lies in the patient; {assumed}"));
            (DVec3::ONE, false)
        }
        "3d-left-handed" => {
            warnings.push(format!("the file states a left-handed space without saying which; {assumed}, which may mirror it"));
            (DVec3::ONE, false)
        }
        _ => return Err(ReadError::Unsupported(format!("its space is {name:?}; only LPS, RAS, LAS and scanner-xyz can be read"))),
    };
    Ok((signs, anatomical))
}

/// Millimetres in each of `count` units of a field; `None` when the file does not state them all.
fn units_mm(header: &Header, field: &str, count: usize, warnings: &mut Vec<String>) -> Option<Vec<f64>> {
    let words = header.words(field)?;
    let units: Option<Vec<f64>> = words.iter().map(|w| unit_mm(w)).collect();
    let units = units.filter(|u| u.len() == count);
    if units.is_none() && words.iter().any(|w| !w.trim().is_empty()) {
        warnings.push(format!("the file's {field} {words:?} are not all lengths and are ignored"));
    }
    units
}

/// The grid that the header describes, and whether its spacing is known. `hints` give the spacing of an axis where it has none, or has one without a unit.
pub fn grid(header: &Header, sizes: &[usize], hints: &Hints, warnings: &mut Vec<String>) -> Result<(Grid, bool), ReadError> {
    let directions = header.vectors("space directions", sizes.len())?;
    let list = if hints.layer.is_some() { list_axis(header, sizes)? } else { None };
    let axes = axes(header, sizes, directions.as_deref(), list)?;
    let (signs, anatomical) = frame(header, warnings)?;
    let space_units = units_mm(header, "space units", 3, warnings);
    let world_mm = signs * space_units.as_ref().map_or(DVec3::ONE, |u| DVec3::from_slice(u));
    let mut in_mm = anatomical || space_units.is_some();

    let mut columns = [DVec3::X, DVec3::Y, DVec3::Z];
    let mut known = [true; 3];
    let mut spacing_mm = DVec3::ONE;
    if let Some(directions) = &directions {
        columns = axes.map(|a| directions[a].map_or(DVec3::NAN, |d| world_mm * d));
    } else {
        let units = units_mm(header, "units", sizes.len(), warnings);
        in_mm |= units.is_some();
        let spacings: Vec<f64> = header.numbers("spacings", sizes.len())?.unwrap_or(vec![f64::NAN; sizes.len()]);
        for (axis, &a) in axes.iter().enumerate() {
            known[axis] = !spacings[a].is_nan();
            if known[axis] {
                spacing_mm[axis] = spacings[a] * units.as_ref().map_or(world_mm[axis].abs(), |u| u[a]);
                must_be_length(axis, spacing_mm[axis])?;
            }
            columns[axis] *= signs[axis] * spacing_mm[axis];
        }
    }
    match hints.spacing_mm {
        Some(mm) => {
            for axis in (0..3).filter(|&a| !(known[a] && in_mm)) {
                must_be_length(axis, mm[axis])?;
                columns[axis] = columns[axis].normalize() * mm[axis];
            }
        }
        None if known != [true; 3] => warnings.push(NO_SPACING.into()),
        None if !in_mm => {
            warnings.push("the file states spacings without a unit; mm are assumed; pass --spacing X,Y,Z if it is not so".into());
        }
        None => {}
    }

    let matrix = DMat3::from_cols(columns[0], columns[1], columns[2]);
    let origin_mm = match (header.vectors("space origin", 1)?, header.numbers::<f64>("axis mins", sizes.len())?) {
        (Some(origin), _) => world_mm * origin[0].unwrap_or(DVec3::NAN),
        (None, Some(mins)) if directions.is_none() => {
            let cell = |a: usize| header.words("centers").is_some_and(|c| c.get(a) == Some(&"cell"));
            // A minimum is that of the axis: for cells it lies half a spacing before the first sample.
            DVec3::from_array(std::array::from_fn(|axis| {
                let half = if cell(axes[axis]) { 0.5 } else { 0.0 };
                signs[axis] * (mins[axes[axis]] * world_mm[axis].abs() + half * columns[axis].length())
            }))
        }
        _ => DVec3::ZERO,
    };
    let origin_mm = if origin_mm.is_finite() { origin_mm } else { DVec3::ZERO };
    let grid = Grid::from_affine(axes.map(|a| sizes[a]), DAffine3::from_mat3_translation(matrix, origin_mm))?;
    Ok((grid, hints.spacing_mm.is_some() || known == [true; 3]))
}

fn must_be_length(axis: usize, mm: f64) -> Result<(), GridError> {
    if mm.is_finite() && mm > 0.0 { Ok(()) } else { Err(GridError::Spacing { axis, mm }) }
}
