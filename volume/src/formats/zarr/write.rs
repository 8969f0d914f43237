//! Writing a scan as OME-Zarr 0.5: a pyramid, with what OME-Zarr has no place for beside it.
//!
//! ```text
//! NAME.ome.zarr/zarr.json      axes, levels, where they lie; attribute "bregma": map of index to LPS mm, scale, unit, what is kept
//!   0/ 1/ …                    samples: chunks of 32³, in shards of 32 × 1024 × 1024
//!   bregma/ranges/L            the lowest and highest sample of each chunk of level L
//!   bregma/reach/L             the same, of all samples of the scan beneath it
//! ```

use super::super::scan::Scan;
use super::super::write::WriteError;
use super::super::{OpenError, ReadError};
use super::MARKS;
use super::keep::{Filter, Kept, Near};
use super::ome::Beside;
use super::pyramid::{Pyramid, levels};
use crate::volume::{Metadata, ReadSamples};
use crate::{Cancelled, Grid, Keep, KeepError, Progress, Samples, Unit, Volume, with_samples};
use serde_json::{Value, json};
use std::io;
use std::path::Path;
use thiserror::Error;

/// Why a scan was not converted.
#[derive(Debug, Error)]
pub enum ConvertError {
    /// It could not be read.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// The store could not be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// What should be kept of it is nothing.
    #[error(transparent)]
    Keep(#[from] KeepError),
}

/// Whether something at `path` is a store, which may be written over.
pub fn is_store(path: &Path) -> bool {
    path.is_dir() && MARKS.iter().any(|mark| path.join(mark).is_file())
}

/// Converts a scan as its samples stream, so that it need not fit into memory; gives a sentence for each thing that is unusual. What was at
/// `path` is replaced whole or not at all. `progress` counts bytes of the scan's files.
pub fn convert(scan: &Scan, path: &Path, keep: Keep, progress: &Progress) -> Result<Vec<String>, ConvertError> {
    let kept = keep.of(Keep::noted(&scan.metadata))?;
    let mut about = About {
        name: scan.name(),
        grid: scan.grid().clone(),
        spacing_is_stated: scan.spacing_is_stated(),
        scale: [scan.slope, scan.intercept],
        unit: scan.unit,
        metadata: scan.metadata.clone(),
        keep,
        kept,
    };
    // What stops the scan's stream is one or the other.
    let mut unwritten = None;
    whole(path, |folder| {
        let mut store: Option<Box<dyn Sink>> = None;
        let passed = scan.pass(progress, &mut |samples| {
            let mut take = || -> io::Result<()> {
                if store.is_none() {
                    store = Some(with_samples!(&*samples, s => Store::begin(folder, &about, s))?);
                }
                store.as_mut().map_or(Ok(()), |store| store.push(samples))
            };
            take().map_err(|e| {
                unwritten = Some(e);
                ReadError::Cancelled(Cancelled)
            })
        });
        if let Some(error) = unwritten.take() {
            return Err(ConvertError::from(failed(path, error)));
        }
        let passed = passed.map_err(|reason| OpenError { file: scan.file.clone(), reason })?;
        about.unit = Some(passed.unit);
        let finished = store.map_or(Ok(()), |store| store.finish(folder)).and_then(|()| about.describe(folder));
        finished.map(|()| passed.warnings).map_err(|error| failed(path, error).into())
    })
}

/// Writes a volume, all of it as it is. `progress` counts bytes of samples.
pub fn volume(path: &Path, volume: &Volume, progress: &Progress) -> Result<Vec<String>, WriteError> {
    progress.begin(volume.sample_bytes() as u64);
    let about = About {
        name: volume.name().to_owned(),
        grid: volume.grid().clone(),
        spacing_is_stated: volume.spacing_is_stated(),
        scale: [volume.slope(), volume.intercept()],
        unit: Some(volume.unit()),
        metadata: volume.metadata().clone(),
        keep: Keep::default(),
        kept: volume.kept(),
    };
    let fill = |folder: &Path| -> io::Result<()> {
        with_samples!(volume.samples(), samples => {
            let mut pyramid = Pyramid::begin(folder, volume.grid().dims(), false)?;
            for part in samples.chunks(PIECE) {
                pyramid.push(part)?;
                progress.advance(size_of_val(part) as u64).map_err(io::Error::other)?;
            }
            pyramid.finish(&folder.join(OURS))
        })?;
        about.describe(folder)
    };
    whole(path, |folder| fill(folder).map_err(|error| failed(path, error))).map(|()| vec![])
}

/// Samples that are passed on at once.
const PIECE: usize = 1 << 20;
/// The group of what OME-Zarr has no place for.
const OURS: &str = "bregma";

fn failed(path: &Path, error: io::Error) -> WriteError {
    match error.get_ref().is_some_and(|e| e.is::<Cancelled>()) {
        true => WriteError::Cancelled(Cancelled),
        false => WriteError::Io { file: path.to_owned(), error },
    }
}

/// Lets `fill` make a folder beside `path`, which then takes its place. What a killed one left the next puts right: the store that was there comes back
/// to its place, the unfinished one is removed. Folders that begin with `.bregma-` are nobody else's.
fn whole<T, E: From<WriteError>>(path: &Path, fill: impl FnOnce(&Path) -> Result<T, E>) -> Result<T, E> {
    let beside = |ending: &str| path.with_file_name(format!(".bregma-{}{ending}", path.file_name().unwrap_or_default().to_string_lossy()));
    let [part, old] = [".part", ".old"].map(beside);
    let fails = |error: io::Error| WriteError::Io { file: path.to_owned(), error };
    if old.exists() && !path.exists() {
        std::fs::rename(&old, path).map_err(fails)?;
    }
    if path.exists() && !is_store(path) {
        let what = format!("{} is no Zarr, and would be lost; name another", path.display());
        return Err(fails(io::Error::other(what)).into());
    }
    for left in [&part, &old].into_iter().filter(|left| left.exists()) {
        std::fs::remove_dir_all(left).map_err(fails)?;
    }
    std::fs::create_dir(&part).map_err(fails)?;
    let moved = fill(&part).and_then(|done| {
        let replace = || -> io::Result<()> {
            if path.exists() {
                std::fs::rename(path, &old)?;
            }
            // If it cannot take its place, the one that was there does.
            std::fs::rename(&part, path).inspect_err(|_| drop(std::fs::rename(&old, path)))
        };
        replace().map_err(fails)?;
        Ok(done)
    });
    // What cannot be removed any more is removed by the next one.
    drop(std::fs::remove_dir_all(if moved.is_ok() { &old } else { &part }));
    moved
}

/// A store that samples go into, whatever their type.
trait Sink {
    fn push(&mut self, samples: &Samples) -> io::Result<()>;
    fn finish(self: Box<Self>, folder: &Path) -> io::Result<()>;
}

struct Store<T> {
    filter: Option<Filter<T>>,
    pyramid: Pyramid<T>,
}

impl<T: Near> Store<T> {
    /// For samples of the type of these.
    fn begin(folder: &Path, about: &About, _of: &[T]) -> io::Result<Box<dyn Sink>> {
        let kept = Kept::<T>::of(about.keep, about.scale);
        let dims = about.grid.dims();
        let pyramid = Pyramid::begin(folder, dims, kept.is_some_and(|kept| kept.has_few_bits()))?;
        Ok(Box::new(Self { filter: kept.map(|kept| Filter::new(kept, dims)), pyramid }))
    }
}

impl<T: Near> Sink for Store<T> {
    fn push(&mut self, samples: &Samples) -> io::Result<()> {
        let samples = T::among(samples);
        match &mut self.filter {
            Some(filter) => self.pyramid.push(&filter.push(samples)),
            None => self.pyramid.push(samples),
        }
    }

    fn finish(self: Box<Self>, folder: &Path) -> io::Result<()> {
        self.pyramid.finish(&folder.join(OURS))
    }
}

/// What is written of a scan beside its samples.
struct About {
    name: String,
    grid: Grid,
    spacing_is_stated: bool,
    scale: [f64; 2],
    unit: Option<Unit>,
    metadata: Metadata,
    /// What is left out now, and what of the scan is kept then.
    keep: Keep,
    kept: Keep,
}

impl About {
    /// Writes what the arrays in `folder` are, last of all: before, there is no store.
    fn describe(&self, folder: &Path) -> io::Result<()> {
        let [slope, intercept] = self.scale;
        let mut metadata = self.metadata.clone();
        self.kept.note(&mut metadata);
        let beside = Beside {
            version: 1,
            index_to_world: self.grid.index_to_world().to_cols_array(),
            spacing_is_stated: self.spacing_is_stated,
            slope,
            intercept,
            unit: self.unit,
            metadata,
        };
        for group in [OURS.to_owned(), format!("{OURS}/ranges"), format!("{OURS}/reach")] {
            let folder = folder.join(group);
            std::fs::create_dir_all(&folder)?;
            write_group(&folder, &json!({}))?;
        }
        let ome = json!({"version": "0.5", "multiscales": [self.multiscales()]});
        write_group(folder, &json!({"ome": ome, OURS: serde_json::to_value(beside)?}))
    }

    fn multiscales(&self) -> Value {
        let zyx = |v: glam::DVec3| json!([v.z, v.y, v.x]);
        let (spacing_mm, origin_mm) = (self.grid.spacing_mm(), self.grid.origin_mm());
        let level = |n: usize| {
            let step = f64::from(1_u32 << n);
            // The first mean lies in the middle of the 2³, 4³, … samples that it is of.
            let transforms = json!([
                {"type": "scale", "scale": zyx(step * spacing_mm)},
                {"type": "translation", "translation": zyx(origin_mm + (step - 1.0) / 2.0 * spacing_mm)},
            ]);
            json!({"path": n.to_string(), "coordinateTransformations": transforms})
        };
        let axis = |name: &str| match self.spacing_is_stated {
            true => json!({"name": name, "type": "space", "unit": "millimeter"}),
            false => json!({"name": name, "type": "space"}),
        };
        let datasets: Vec<Value> = (0..levels(self.grid.dims()).len()).map(level).collect();
        let axes = ["z", "y", "x"].map(axis);
        json!({"name": self.name, "axes": axes, "datasets": datasets, "type": "mean"})
    }
}

fn write_group(folder: &Path, attributes: &Value) -> io::Result<()> {
    let group = json!({"zarr_format": 3, "node_type": "group", "attributes": attributes});
    std::fs::write(folder.join("zarr.json"), serde_json::to_vec_pretty(&group)?)
}
