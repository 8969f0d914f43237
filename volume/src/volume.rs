//! A scan in memory: samples on a grid, what their numbers mean, and the ranges that speed everything up.

use crate::grid::{Grid, GridError};
use crate::histogram::Histogram;
use crate::keep::Keep;
use crate::placing::{Correction, Placing, labelled};
use crate::ranges::RangeBricks;
use crate::samples::{Sample, Samples};
use crate::summary::{ScaleError, Summary, Unit};
use crate::with_samples;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;
use thiserror::Error;

/// What a file says, before it is checked and indexed.
#[derive(Debug)]
pub struct Raster {
    /// Where the samples lie.
    pub grid: Grid,
    /// The samples, `grid.len()` of them, i fastest.
    pub samples: Samples,
    /// Value per sample unit.
    pub slope: f64,
    /// Value of sample 0.
    pub intercept: f64,
    /// What a value is.
    pub unit: Unit,
    /// What was unusual, each a sentence for the person.
    pub warnings: Vec<String>,
}

/// What a file says beside its samples, as text by name, such as `Modality`.
pub type Metadata = BTreeMap<String, String>;

/// A scan, ready to be drawn and measured. `value = slope·sample + intercept`.
///
/// ```
/// use bregma_volume::{Grid, Raster, Samples, Unit, Volume};
/// use glam::{DMat3, DVec3};
///
/// let grid = Grid::new([2, 2, 2], DVec3::ONE, DVec3::ZERO, DMat3::IDENTITY)?;
/// let samples = Samples::U16(vec![0, 0, 0, 0, 2000, 2000, 2000, 3071]);
/// let raster = Raster { grid, samples, slope: 1.0, intercept: -1024.0, unit: Unit::Hounsfield, warnings: vec![] };
/// let volume = Volume::new("corner".into(), "made here", raster)?;
/// assert_eq!(volume.range(), [-1024.0, 2047.0]);
/// assert_eq!(volume.default_isovalue().0, 226.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// What is large is shared with those that are made of it by another name or in another place.
#[derive(Clone, Debug)]
pub struct Volume {
    name: String,
    format: &'static str,
    placing: Placing,
    samples: Arc<Samples>,
    bricks: Arc<RangeBricks>,
    summary: Summary,
    /// What was unusual about the file, whatever was corrected since.
    of_file: Vec<String>,
    warnings: Vec<String>,
    slice_position_mm: f64,
    kept: Keep,
    metadata: Metadata,
}

/// Where metadata says how far slices lie from where the grid has them. It is metadata so that every form that a scan is converted to keeps it.
const SLICES_OFF: &str = "SlicesOffEvenMm";

/// That slices lie at most `mm` from where the grid has them, as metadata; less than a nanometre is only how positions were written.
pub(crate) fn slices_off(mm: f64) -> Option<(String, String)> {
    (mm > 1e-6).then(|| (SLICES_OFF.to_owned(), format!("{mm:.6}")))
}

/// Why a raster is not a volume.
#[derive(Debug, Error, PartialEq)]
pub enum VolumeError {
    /// Sample count and grid disagree.
    #[error("the grid has {grid} samples but the file holds {samples}")]
    Count {
        /// Samples that the grid asks for.
        grid: usize,
        /// Samples that are there.
        samples: usize,
    },
    /// A scale that maps all samples to one value, or to none.
    #[error(transparent)]
    Scale(#[from] ScaleError),
    /// Only NaN and infinities.
    #[error("no sample is a finite number")]
    NothingFinite,
}

/// Bins of a volume's histogram: fine enough that a bin of 4,096 HU is 4 HU wide.
pub(crate) const BINS: usize = 1024;

impl Volume {
    /// Checks `raster` and builds its ranges and histogram. NaN samples are taken as the lowest value of the scan and
    /// infinities, or what some programs write for them, as its ends, with a warning, since a surface needs an ordering.
    pub fn new(name: String, format: &'static str, raster: Raster) -> Result<Self, VolumeError> {
        let Raster { grid, mut samples, slope, intercept, unit, mut warnings } = raster;
        if grid.len() != samples.len() {
            return Err(VolumeError::Count { grid: grid.len(), samples: samples.len() });
        }
        Summary::check_scale(slope, intercept)?;
        if let Samples::F32(s) = &mut samples {
            warnings.extend(mended(make_finite(s)?));
        }
        warnings.extend(flat(&grid));
        let dims = grid.dims();
        let bricks = with_samples!(&samples, s => RangeBricks::build(s, dims));
        // The bricks cover all samples, unless the grid has no cells.
        let widest = |a: [f32; 2], b: [f32; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        let range = match bricks.ranges().iter().copied().reduce(widest) {
            Some(ends) => ends.map(f64::from),
            None => with_samples!(&samples, s => range(s)),
        };
        let histogram = Histogram::build(&samples, range, BINS);
        let summary = Summary::new(slope, intercept, unit, histogram);
        let (samples, bricks, placing) = (Arc::new(samples), Arc::new(bricks), Placing::new(grid, true, 1));
        let (of_file, slice_position_mm, kept, metadata) = (warnings.clone(), 0.0, Keep::default(), Metadata::new());
        Ok(Self { name, format, placing, samples, bricks, summary, of_file, warnings, slice_position_mm, kept, metadata })
    }

    /// The same with what a file says beside the samples, in the place of what was said.
    pub fn with_metadata(self, metadata: Metadata) -> Self {
        let said = metadata.get(SLICES_OFF).and_then(|mm| mm.parse().ok());
        // Anyone can write metadata: what is no length is none.
        let slice_position_mm = said.filter(|mm: &f64| mm.is_finite() && *mm > 0.0).unwrap_or(0.0);
        Self { slice_position_mm, kept: Keep::noted(&metadata), metadata, ..self }
    }

    /// The same whose slices lie at most so many mm from where the grid has them, see [`Self::slice_position_mm`].
    pub fn with_slices_off(self, mm: f64) -> Self {
        let metadata = self.metadata.clone().into_iter().chain(slices_off(mm)).collect();
        self.with_metadata(metadata)
    }

    /// A scan of other samples at the same places, in the same scale and unit, with what is known of this one. It fails where they are not as many,
    /// or none of them is a number.
    pub fn with_samples(&self, samples: Samples) -> Result<Self, VolumeError> {
        let (grid, slope, intercept, unit) = (self.grid().clone(), self.slope(), self.intercept(), self.unit());
        let raster = Raster { grid, samples, slope, intercept, unit, warnings: vec![] };
        let made = Self::new(self.name.clone(), self.format, raster)?;
        Ok(Self { samples: made.samples, bricks: made.bricks, summary: made.summary, ..self.clone() })
    }

    /// The same under a name that is not a file's.
    pub fn called(self, name: String) -> Self {
        Self { name, ..self }
    }

    /// The same where `placing` has it, which has a place for each of its samples.
    pub(crate) fn placed(self, placing: Placing) -> Self {
        let longer = placing.grid().spacing_mm().z / self.grid().spacing_mm().z;
        // Which slices are off by which part of a step is not what was corrected.
        let off_mm = self.slice_position_mm * longer;
        let warnings = placing.warnings(&self.of_file);
        Self { placing, warnings, ..self }.with_slices_off(off_mm)
    }

    /// The same samples where a person's `correction` has them, in the place of an earlier one. It fails where that is no grid.
    pub fn corrected(&self, correction: Correction) -> Result<Self, GridError> {
        Ok(self.clone().placed(self.placing.corrected(correction)?))
    }

    /// The same under another name.
    pub fn renamed(&self, name: &str) -> Self {
        Self { name: labelled(name, self.placing.step()), ..self.clone() }
    }

    /// Where its samples lie, and why.
    pub fn placing(&self) -> &Placing {
        &self.placing
    }

    /// By which those that share their samples are known.
    pub fn samples_id(&self) -> *const Samples {
        Arc::as_ptr(&self.samples)
    }

    /// The type of the samples: `u8`, `i16`, `u16` or `f32`.
    pub fn type_name(&self) -> &'static str {
        self.samples.type_name()
    }

    /// The same in another unit.
    pub(crate) fn with_unit(mut self, unit: Unit) -> Self {
        self.summary.unit = unit;
        self
    }

    /// What the person calls it: its file's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The format it was read from.
    pub fn format(&self) -> &'static str {
        self.format
    }

    /// Where the samples lie.
    pub fn grid(&self) -> &Grid {
        self.placing.grid()
    }

    /// Whether its file, or the person, says how far samples are apart. If not, 1 mm is assumed, and no length means anything.
    pub fn spacing_is_stated(&self) -> bool {
        self.placing.spacing_is_stated()
    }

    /// How far a slice (all samples of one k) lies from where the grid has it, at most, mm: what their positions are off the even steps that
    /// they were taken to have, or to have been written to. 0 where nothing is known of that.
    pub fn slice_position_mm(&self) -> f64 {
        self.slice_position_mm
    }

    /// What was kept of the scan when it was saved.
    pub fn kept(&self) -> Keep {
        self.kept
    }

    /// What the file says beside the samples.
    pub fn metadata(&self) -> &Metadata {
        &self.metadata
    }

    /// Whether the samples are whole numbers, and not float32.
    pub fn has_whole_samples(&self) -> bool {
        !matches!(*self.samples, Samples::F32(_))
    }

    /// Memory that the samples take.
    pub fn sample_bytes(&self) -> usize {
        self.samples.bytes()
    }

    /// Ranges of the bricks of 8³ cells, in sample units.
    pub fn bricks(&self) -> &RangeBricks {
        &self.bricks
    }

    /// What the samples mean and how they are spread.
    pub fn summary(&self) -> &Summary {
        &self.summary
    }

    /// The histogram in sample units.
    pub fn histogram(&self) -> &Histogram {
        &self.summary.histogram
    }

    /// Value per sample unit.
    pub fn slope(&self) -> f64 {
        self.summary.slope
    }

    /// Value of sample 0.
    pub fn intercept(&self) -> f64 {
        self.summary.intercept
    }

    /// What a value is.
    pub fn unit(&self) -> Unit {
        self.summary.unit
    }

    /// What was unusual about the file, each a sentence for the person.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// The value of a sample.
    pub fn value_of(&self, sample: f64) -> f64 {
        self.summary.value_of(sample)
    }

    /// The sample that has `value`, as a real number.
    pub fn sample_of(&self, value: f64) -> f64 {
        (value - self.summary.intercept) / self.summary.slope
    }

    /// Lowest and highest value.
    pub fn range(&self) -> [f64; 2] {
        self.summary.range()
    }

    /// Otsu's threshold as a value; `None` when all samples are equal.
    pub fn otsu(&self) -> Option<f64> {
        self.summary.otsu()
    }

    /// The step between Otsu's two classes (for a skull: bone minus air), in values.
    pub fn otsu_step(&self) -> Option<f64> {
        self.summary.otsu_step()
    }

    /// The isovalue to open with, and why; see [`Summary::default_isovalue`].
    pub fn default_isovalue(&self) -> (f64, &'static str) {
        match (self.summary.default_isovalue(), self.kept.surfaces) {
            ((iso, _), Some([low, high])) if !self.kept.has_surface(iso) => (iso.clamp(low, high), "the nearest whose surface was kept"),
            (usual, _) => usual,
        }
    }

    /// Memory beside the samples.
    pub fn index_bytes(&self) -> usize {
        self.bricks.bytes() + size_of_val(self.summary.histogram.counts.as_slice())
    }
}

/// Reading the samples of a volume: for what writes scans to files, and for `bregma-field`, which all that draws and measures is built on.
/// It is a trait, and `bregma-field` passes [`Volume`] on without it: only a package that depends on this one itself can name it.
pub trait ReadSamples {
    /// The samples, i fastest.
    fn samples(&self) -> &Samples;
}

impl ReadSamples for Volume {
    fn samples(&self) -> &Samples {
        &self.samples
    }
}

/// The sentence about samples that are no usable numbers.
pub(crate) fn mended(count: usize) -> Option<String> {
    (count > 0).then(|| {
        format!("{count} samples are NaN, infinite or beyond ±1e37; they are taken as the nearest other end of the scan, NaN as its lowest")
    })
}

/// The sentence about a grid without volume.
pub(crate) fn flat(grid: &Grid) -> Option<String> {
    let [nx, ny, nz] = grid.dims();
    grid.is_flat().then(|| {
        format!("the scan is {nx}×{ny}×{nz} samples: with a single sample along an axis it has no volume, so there is nothing to draw")
    })
}

fn range<T: Sample>(samples: &[T]) -> [f64; 2] {
    let ends = |part: &[T]| {
        let first = part[0];
        part.iter().fold((first, first), |(low, high), &s| (if s < low { s } else { low }, if s > high { s } else { high }))
    };
    let (low, high) = samples
        .par_chunks(1 << 20)
        .map(ends)
        .reduce_with(|a, b| (if b.0 < a.0 { b.0 } else { a.0 }, if b.1 > a.1 { b.1 } else { a.1 }))
        .expect("a grid has at least one sample, and the count was checked");
    [low.to_f64(), high.to_f64()]
}

/// Whether a sample is no measurement but a mark such as ±3.4e38 for "no data"; sums of a few larger than 1e37 would be infinite.
pub(crate) fn is_odd(sample: f32) -> bool {
    sample.is_nan() || sample.abs() > 1e37
}

/// What a sample that is odd is taken as, in a scan from `low` to `high`.
pub(crate) fn mend(sample: f32, [low, high]: [f32; 2]) -> f32 {
    match is_odd(sample) {
        false => sample,
        true if sample > 0.0 => high,
        true => low,
    }
}

fn make_finite(samples: &mut [f32]) -> Result<usize, VolumeError> {
    let usual = samples.par_iter().copied().filter(|&s| !is_odd(s));
    let ends = |a: [f32; 2], b: [f32; 2]| [a[0].min(b[0]), a[1].max(b[1])];
    let ends = usual.map(|s| [s, s]).reduce(|| [f32::MAX, f32::MIN], ends);
    if ends[0] > ends[1] {
        return Err(VolumeError::NothingFinite);
    }
    let mend = |s: &mut f32| {
        let odd = is_odd(*s);
        *s = mend(*s, ends);
        usize::from(odd)
    };
    Ok(samples.par_iter_mut().map(mend).sum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DVec3};

    fn raster(samples: Samples, dims: [usize; 3]) -> Raster {
        let grid = Grid::new(dims, DVec3::ONE, DVec3::ZERO, DMat3::IDENTITY).unwrap();
        Raster { grid, samples, slope: 2.0, intercept: -10.0, unit: Unit::Value, warnings: vec![] }
    }

    #[test]
    fn samples_that_are_no_numbers_are_named_and_mended() {
        let odd = Samples::F32(vec![1.0, f32::NAN, 5.0, f32::INFINITY, f32::NEG_INFINITY, 2.0, 2.0, 2.0]);
        let v = Volume::new("odd".into(), "test", raster(odd, [2, 2, 2])).unwrap();
        assert_eq!(v.samples(), &Samples::F32(vec![1.0, 1.0, 5.0, 5.0, 1.0, 2.0, 2.0, 2.0]));
        assert!(v.warnings()[0].starts_with("3 samples are NaN"), "{:?}", v.warnings());
        assert_eq!(v.range(), [-8.0, 0.0]);
        let none = Samples::F32(vec![f32::NAN]);
        assert_eq!(Volume::new("nan".into(), "test", raster(none, [1, 1, 1])).unwrap_err(), VolumeError::NothingFinite);
    }

    #[test]
    fn contradictions_are_refused() {
        let short = Volume::new("short".into(), "test", raster(Samples::U8(vec![0; 7]), [2, 2, 2]));
        assert_eq!(short.unwrap_err(), VolumeError::Count { grid: 8, samples: 7 });
        let mut flat = raster(Samples::U8(vec![0; 8]), [2, 2, 2]);
        flat.slope = 0.0;
        assert!(matches!(Volume::new("flat".into(), "test", flat).unwrap_err(), VolumeError::Scale { .. }));
    }

    #[test]
    fn what_is_made_of_a_scan_shares_its_samples_and_keeps_what_is_known() {
        // Fails if a correction copies samples, forgets the name or a warning, or leaves slices off by what they were before it.
        let v = Volume::new("a".into(), "test", raster(Samples::U8((0..8).collect()), [2, 2, 2])).unwrap().with_slices_off(0.2);
        let spacing_mm = Some(DVec3::new(1.0, 1.0, 2.0));
        let longer = v.renamed("b").corrected(Correction { spacing_mm, ..Correction::default() }).unwrap();
        assert_eq!((longer.name(), longer.samples_id(), longer.slice_position_mm()), ("b", v.samples_id(), 0.4));
        assert!(longer.warnings().last().is_some_and(|warning| warning.contains("1 × 1 × 2 mm is taken instead")));
        assert_eq!((v.slice_position_mm(), v.warnings().len()), (0.2, 0));
        let back = longer.corrected(Correction::default()).unwrap();
        assert_eq!((back.slice_position_mm(), back.grid(), back.warnings().len()), (0.2, v.grid(), 0));
    }

    #[test]
    fn a_falling_scale_keeps_its_range_in_order() {
        let mut r = raster(Samples::U8(vec![0, 1, 2, 3, 4, 5, 6, 7]), [2, 2, 2]);
        r.slope = -1.0;
        let v = Volume::new("falling".into(), "test", r).unwrap();
        assert_eq!(v.range(), [-17.0, -10.0]);
        assert_eq!(v.sample_of(v.value_of(3.5)), 3.5);
    }
}
