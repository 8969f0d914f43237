//! Zarr, versions 2 and 3, and in it OME-Zarr, versions 0.4 and 0.5: folders of arrays in chunks; `pyramid` writes scans as these.
//!
//! Specifications: <https://zarr-specs.readthedocs.io>, <https://ngff.openmicroscopy.org>.

mod array;
mod keep;
mod ome;
mod pyramid;
mod ranges;
mod voxel;
mod write;

pub use write::{ConvertError, convert};

use self::array::Array;
use self::ome::{Axes, Image};
use super::decode::Encoding;
use super::{Format, Hints, NO_DIRECTIONS, NO_SPACING, ReadError, Scan, Storage, Writer, bad};
use crate::{Grid, Progress};
use glam::{DAffine3, DMat3, DVec3};
use std::path::{Path, PathBuf};

/// The row of the formats.
pub const FORMAT: Format = Format { name: "OME-Zarr", sniff, scan, write: Some(Writer { endings: &[".zarr"], write: write::volume }) };

/// What tells a folder that is a group or an array.
const MARKS: [&str; 4] = ["zarr.json", ".zattrs", ".zgroup", ".zarray"];

/// A slab of chunks as large as this is read at once; of larger ones parts are.
const SLAB_BYTES: u64 = 1 << 29;

fn sniff(path: &Path, _head: &[u8], _progress: &Progress) -> bool {
    folder_of(path).is_some()
}

/// The folder of the group or array: itself, or that of one of the files that tell it.
fn folder_of(path: &Path) -> Option<PathBuf> {
    let is_mark = || MARKS.iter().any(|mark| path.file_name().is_some_and(|name| name == *mark));
    let folder = if path.is_dir() { path.to_owned() } else { path.parent().filter(|_| is_mark())?.to_owned() };
    MARKS.iter().any(|mark| folder.join(mark).is_file()).then_some(folder)
}

fn scan(path: &Path, hints: &Hints, _progress: &Progress) -> Result<Scan, ReadError> {
    let folder = folder_of(path).ok_or(ReadError::Directory)?;
    let mut warnings = vec![];
    let image = ome::read(&folder, &mut warnings)?;
    let array_folder = folder.join(image.as_ref().map_or("", |image| &image.path));
    let is_ours = image.as_ref().is_some_and(|image| image.beside.is_some());
    let array = Array::open(&array_folder, is_ours)?;
    let names = array.names();
    let axes = image.as_ref().map_or_else(|| Axes::of(&names), |image| Ok(image.axes.clone()))?;
    let shape = array.shape().to_vec();
    if axes.len() != shape.len() {
        return Err(ReadError::Contradiction(format!("it names {} axes of an array that has {}", axes.len(), shape.len())));
    }
    if !axes.are_a_volume() {
        return Err(ReadError::Unsupported("it has not three axes in space; only volumes can be read".to_owned()));
    }
    warnings.extend(axes.chosen(&shape));
    // In memory the last axis is the fastest, which is i.
    let space = axes.space();
    let dims = [space[2], space[1], space[0]].map(|axis| usize::try_from(shape[axis]).unwrap_or(usize::MAX));
    let (grid, spacing_is_stated) = place(image.as_ref(), &axes, dims, hints, &mut warnings)?;
    let beside = image.and_then(|image| image.beside);
    let sample = array.sample_type()?;
    let bytes = (grid.len() as u64).saturating_mul(sample.bytes() as u64);
    let depth = array.depth(space[0], bytes / dims[2] as u64, SLAB_BYTES);
    check_length(&array_folder, bytes)?;
    let storage = Storage::Stream(Box::new(move |progress, take| {
        for from in (0..dims[2] as u64).step_by(depth as usize) {
            let until = (from + depth).min(dims[2] as u64);
            let slab = array.slab(&axes.one(&shape, from..until))?;
            progress.advance(slab.len() as u64)?;
            take(&slab)?;
        }
        Ok(vec![])
    }));
    let scan = Scan::new(grid, Encoding { sample, big_endian: cfg!(target_endian = "big") }, bytes, storage);
    let scan = Scan { spacing_is_stated, warnings, ..scan };
    Ok(match beside {
        Some(b) => Scan { slope: b.slope, intercept: b.intercept, unit: b.unit, metadata: b.metadata, ..scan },
        None => scan,
    })
}

/// Bytes of samples for each byte of files: chunks of one value pack that well, and missing ones need none, but a store of nothing is no scan.
const MOST_EXPANSION: u64 = 100_000;

/// Refuses an array of which next to nothing is there.
fn check_length(folder: &Path, wanted: u64) -> Result<(), ReadError> {
    let (mut there, mut folders) = (0_u64, vec![folder.to_owned()]);
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder)? {
            let entry = entry?;
            let is_link = entry.file_type()?.is_symlink();
            // Links to files are those of archives; those to folders may lead in circles.
            match std::fs::metadata(entry.path()) {
                Ok(data) if data.is_dir() => folders.extend((!is_link).then(|| entry.path())),
                Ok(data) => there = there.saturating_add(data.len()),
                Err(_) => {}
            }
            if there.saturating_mul(MOST_EXPANSION) >= wanted {
                return Ok(());
            }
        }
    }
    Err(ReadError::CannotHold { wanted: wanted.into(), compressed: there })
}

/// Where the samples lie, and whether the file says how far they are apart.
fn place(
    image: Option<&Image>,
    axes: &Axes,
    dims: [usize; 3],
    hints: &Hints,
    warnings: &mut Vec<String>,
) -> Result<(Grid, bool), ReadError> {
    if let Some(beside) = image.and_then(|image| image.beside.as_ref()) {
        let grid = Grid::from_affine(dims, DAffine3::from_cols_array(&beside.index_to_world))?;
        if !beside.spacing_is_stated && hints.spacing_mm.is_none() {
            warnings.push(NO_SPACING.to_owned());
        }
        return Ok((grid, beside.spacing_is_stated || hints.spacing_mm.is_some()));
    }
    if !axes.is_directed() {
        warnings.push(NO_DIRECTIONS.to_owned());
    }
    // The columns of i, j and k, each along the axis that its own name says.
    let stated = image.and_then(Image::placed_mm);
    let Some((scale_mm, origin_mm)) = stated else {
        if hints.spacing_mm.is_none() {
            warnings.push(NO_SPACING.to_owned());
        }
        let spacing_mm = hints.spacing_mm.unwrap_or(DVec3::ONE);
        return Ok((Grid::new(dims, spacing_mm, DVec3::ZERO, axes.directions())?, hints.spacing_mm.is_some()));
    };
    if scale_mm.min_element() <= 0.0 {
        return Err(bad("scale", scale_mm, "it must be positive"));
    }
    if image.is_some_and(|image| !image.axes.has_units()) {
        warnings.push("its axes state no unit; their scale is taken as mm".to_owned());
    }
    let directions = axes.directions();
    let matrix = directions * DMat3::from_diagonal(scale_mm);
    Ok((Grid::from_affine(dims, DAffine3::from_mat3_translation(matrix, directions * origin_mm))?, true))
}

#[cfg(test)]
mod tests;
