//! A scan in memory: samples on a grid, what their numbers mean, and the ranges that speed everything up.

use crate::grid::Grid;
use crate::histogram::{Histogram, Otsu};
use crate::ranges::RangeBricks;
use crate::samples::{Sample, Samples};
use crate::with_samples;
use rayon::prelude::*;
use serde::Serialize;
use thiserror::Error;

/// What a value is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Unit {
    /// Hounsfield units: air −1000, water 0.
    #[serde(rename = "HU")]
    Hounsfield,
    /// A number whose scale the file does not state.
    #[serde(rename = "value")]
    Value,
}

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

/// A scan, ready to be drawn and measured. `value = slope·sample + intercept`.
#[derive(Debug)]
pub struct Volume {
    name: String,
    format: &'static str,
    raster: Raster,
    bricks: RangeBricks,
    histogram: Histogram,
    otsu: Option<Otsu>,
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
    /// A slope that maps all samples to one value, or to none.
    #[error("the value scale (slope {slope}, intercept {intercept}) is not usable; both must be finite and the slope not zero")]
    Scale {
        /// The slope as given.
        slope: f64,
        /// The intercept as given.
        intercept: f64,
    },
    /// Only NaN and infinities.
    #[error("no sample is a finite number")]
    NothingFinite,
}

/// Bins of a volume's histogram: fine enough that a bin of 4,096 HU is 4 HU wide.
const BINS: usize = 1024;

impl Volume {
    /// Checks `raster` and builds its ranges and histogram. NaN samples are taken as the lowest value of the scan and
    /// infinities, or what some programs write for them, as its ends, with a warning, since a surface needs an ordering.
    pub fn new(name: String, format: &'static str, mut raster: Raster) -> Result<Self, VolumeError> {
        let (grid, samples) = (raster.grid.len(), raster.samples.len());
        if grid != samples {
            return Err(VolumeError::Count { grid, samples });
        }
        let (slope, intercept) = (raster.slope, raster.intercept);
        if !(slope.is_finite() && intercept.is_finite() && slope != 0.0) {
            return Err(VolumeError::Scale { slope, intercept });
        }
        if let Samples::F32(s) = &mut raster.samples {
            let replaced = make_finite(s)?;
            if replaced > 0 {
                let text = format!(
                    "{replaced} samples are NaN, infinite or beyond ±1e37; they are taken as the nearest other end of the scan, NaN as its lowest"
                );
                raster.warnings.push(text);
            }
        }
        if raster.grid.is_flat() {
            let [nx, ny, nz] = raster.grid.dims();
            let text = format!(
                "the scan is {nx}×{ny}×{nz} samples: with a single sample along an axis it has no volume, so there is nothing to draw"
            );
            raster.warnings.push(text);
        }
        let dims = raster.grid.dims();
        let bricks = with_samples!(&raster.samples, s => RangeBricks::build(s, dims));
        let range = with_samples!(&raster.samples, s => range(s));
        let histogram = Histogram::build(&raster.samples, range, BINS);
        let otsu = histogram.otsu();
        Ok(Self { name, format, raster, bricks, histogram, otsu })
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
        &self.raster.grid
    }

    /// The samples, i fastest.
    pub fn samples(&self) -> &Samples {
        &self.raster.samples
    }

    /// Ranges of the bricks of 8³ cells, in sample units.
    pub fn bricks(&self) -> &RangeBricks {
        &self.bricks
    }

    /// The histogram in sample units.
    pub fn histogram(&self) -> &Histogram {
        &self.histogram
    }

    /// Value per sample unit.
    pub fn slope(&self) -> f64 {
        self.raster.slope
    }

    /// Value of sample 0.
    pub fn intercept(&self) -> f64 {
        self.raster.intercept
    }

    /// What a value is.
    pub fn unit(&self) -> Unit {
        self.raster.unit
    }

    /// What was unusual about the file, each a sentence for the person.
    pub fn warnings(&self) -> &[String] {
        &self.raster.warnings
    }

    /// The value of a sample.
    pub fn value_of(&self, sample: f64) -> f64 {
        self.raster.slope * sample + self.raster.intercept
    }

    /// The sample that has `value`, as a real number.
    pub fn sample_of(&self, value: f64) -> f64 {
        (value - self.raster.intercept) / self.raster.slope
    }

    /// Lowest and highest value.
    pub fn range(&self) -> [f64; 2] {
        let [a, b] = self.histogram.range.map(|s| self.value_of(s));
        [a.min(b), a.max(b)]
    }

    /// Otsu's threshold as a value; `None` when all samples are equal.
    pub fn otsu(&self) -> Option<f64> {
        self.otsu.map(|o| self.value_of(o.threshold))
    }

    /// The step between Otsu's two classes (for a skull: bone minus air), in values.
    pub fn otsu_step(&self) -> Option<f64> {
        self.otsu.map(|o| ((o.mean_above - o.mean_below) * self.raster.slope).abs())
    }

    /// The isovalue to open with, and why: 226 HU, InVesalius's threshold for bone, where values are HU and reach it;
    /// otherwise Otsu's; the middle of the range when there is nothing to split.
    pub fn default_isovalue(&self) -> (f64, &'static str) {
        const BONE_HU: f64 = 226.0;
        let [low, high] = self.range();
        match self.otsu() {
            _ if self.unit() == Unit::Hounsfield && low < BONE_HU && BONE_HU <= high => (BONE_HU, "bone, 226 HU"),
            Some(otsu) => (otsu, "Otsu's threshold"),
            None => ((low + high) / 2.0, "middle of the range"),
        }
    }

    /// Memory beside the samples.
    pub fn index_bytes(&self) -> usize {
        self.bricks.bytes() + size_of_val(self.histogram.counts.as_slice())
    }
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

/// Larger numbers are no measurements but marks such as ±3.4e38 for "no data"; and sums of a few would be infinite in float32.
const MOST: f32 = 1e37;

fn make_finite(samples: &mut [f32]) -> Result<usize, VolumeError> {
    let is_odd = |s: f32| s.is_nan() || s.abs() > MOST;
    let usual = samples.par_iter().copied().filter(|&s| !is_odd(s));
    let ends = |a: (f32, f32), b: (f32, f32)| (a.0.min(b.0), a.1.max(b.1));
    let (low, high) = usual.map(|s| (s, s)).reduce(|| (f32::MAX, f32::MIN), ends);
    if low > high {
        return Err(VolumeError::NothingFinite);
    }
    let mend = |s: &mut f32| {
        let odd = is_odd(*s);
        if odd {
            *s = if *s > 0.0 { high } else { low };
        }
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
    fn a_falling_scale_keeps_its_range_in_order() {
        let mut r = raster(Samples::U8(vec![0, 1, 2, 3, 4, 5, 6, 7]), [2, 2, 2]);
        r.slope = -1.0;
        let v = Volume::new("falling".into(), "test", r).unwrap();
        assert_eq!(v.range(), [-17.0, -10.0]);
        assert_eq!(v.sample_of(v.value_of(3.5)), 3.5);
    }
}
