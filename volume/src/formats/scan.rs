//! A scan on disk: what its headers say, and how its samples stream when they are asked for.

use super::ahead::ahead;
use super::archive::Archive;
use super::decode::{Collector, Encoding, Kept, SampleType, widen};
use super::part::{self, Part};
use super::{Hints, OpenError, ReadError, Reduce, fill, memory};
use crate::placing::{labelled, nth_sample};
use crate::volume::{self, BINS, Metadata};
use crate::{Correction, Grid, GridError, Histogram, Keep, Placing, Progress, Raster, Sample, Samples, Summary, Unit, Volume, VolumeError};
use rayon::prelude::*;
use std::path::PathBuf;
use std::sync::Arc;

/// Takes the next bytes of samples: whole ones, in the file's type and byte order, i fastest.
pub type Sink<'a> = dyn FnMut(&[u8]) -> Result<(), ReadError> + 'a;

/// Passes all samples on; gives warnings that only reading them brings up.
type Stream = dyn Fn(&Progress, &mut Sink<'_>) -> Result<Vec<String>, ReadError> + Send + Sync;

/// The samples of slice k. A buffer comes with the wish, that of an earlier slice where there was one: fresh memory costs as much as reading.
type Slice = dyn Fn(usize, Vec<u8>, &Progress) -> Result<Vec<u8>, ReadError> + Send + Sync;

/// A slice by its number, unpacked.
type Unpacked = (usize, Result<Vec<u8>, ReadError>);

/// Where the samples are.
pub enum Storage {
    /// In stretches of files.
    Parts(Vec<Part>),
    /// In one stream.
    Stream(Box<Stream>),
    /// In slices that are unpacked side by side.
    Slices(Box<Slice>),
}

/// Takes the next samples, in the type that they are kept in.
pub type Pieces<'a> = dyn FnMut(&mut Samples) -> Result<(), ReadError> + 'a;

/// What is known of a scan once its samples were passed on.
pub(super) struct Passed {
    /// What values are.
    pub unit: Unit,
    /// What is unusual, each a sentence for the person.
    pub warnings: Vec<String>,
}

/// A scan on disk. Its headers are read, its samples are not.
pub struct Scan {
    pub(super) file: PathBuf,
    pub(super) name: String,
    pub(super) format: &'static str,
    /// By what its file states.
    pub(super) grid: Grid,
    /// The same with what was corrected, and with those samples that are kept.
    pub(super) placing: Placing,
    pub(super) encoding: Encoding,
    pub(super) slope: f64,
    pub(super) intercept: f64,
    /// `None` where the file does not say.
    pub(super) unit: Option<Unit>,
    pub(super) spacing_is_stated: bool,
    pub(super) warnings: Vec<String>,
    pub(super) metadata: Metadata,
    /// The other files that it is read from, where naming any of them names it.
    pub(super) series: Vec<PathBuf>,
    /// Bytes that reading it passes.
    pub(super) file_bytes: u64,
    pub(super) storage: Storage,
    /// The archive that it is in.
    pub(super) archive: Option<Arc<Archive>>,
}

/// What is known of a scan once its samples have streamed by, none of them kept.
#[derive(Debug)]
pub struct Survey {
    /// How the values are spread.
    pub summary: Summary,
    /// The type that samples are kept in: `u8`, `i16`, `u16` or `f32`.
    pub type_name: &'static str,
    /// Bytes of the samples in that type.
    pub sample_bytes: u64,
    /// Memory that opening it needs.
    pub memory_bytes: u64,
    /// What is unusual, each a sentence for the person.
    pub warnings: Vec<String>,
}

impl Scan {
    /// A scan whose samples are its values, and whose file says no more.
    pub(super) fn new(grid: Grid, encoding: Encoding, file_bytes: u64, storage: Storage) -> Self {
        Self {
            file: PathBuf::new(),
            name: String::new(),
            format: "",
            placing: Placing::new(grid.clone(), true, 1),
            grid,
            encoding,
            slope: 1.0,
            intercept: 0.0,
            unit: None,
            spacing_is_stated: true,
            warnings: vec![],
            metadata: Metadata::new(),
            series: vec![],
            file_bytes,
            storage,
            archive: None,
        }
    }

    /// One that is in no file: `slice` gives the samples of slice k, i fastest. It is read as one in a file is.
    pub fn made(name: &str, grid: Grid, unit: Unit, slice: impl Fn(usize) -> Vec<i16> + Send + Sync + 'static) -> Self {
        let bytes = 2 * grid.len() as u64;
        let slices = grid.dims()[2] as u64;
        let storage = Storage::Slices(Box::new(move |k, mut bytes_of, progress| {
            bytes_of.clear();
            bytes_of.extend(slice(k).iter().flat_map(|s| s.to_le_bytes()));
            progress.advance(bytes / slices)?;
            Ok(bytes_of)
        }));
        let encoding = Encoding { sample: SampleType::I16, big_endian: false };
        Self { name: name.to_owned(), format: "made", unit: Some(unit), ..Self::new(grid, encoding, bytes, storage) }
    }

    /// The same placed as a person says, with every n-th sample.
    pub fn placed(mut self, hints: &Hints) -> Result<Self, GridError> {
        self.place(Correction { spacing_mm: hints.spacing_mm, turn: hints.turn }, hints.reduce.map_or(1, Reduce::step))?;
        Ok(self)
    }

    /// What the person calls it.
    pub fn name(&self) -> String {
        labelled(&self.name, self.placing.step())
    }

    /// The same under another name.
    pub fn renamed(self, name: &str) -> Self {
        Self { name: name.to_owned(), ..self }
    }

    /// Puts it where a person's `correction` has it, and keeps every step-th sample.
    fn place(&mut self, correction: Correction, step: usize) -> Result<(), GridError> {
        self.placing = Placing::new(self.grid.clone(), self.spacing_is_stated, step).corrected(correction)?;
        Ok(())
    }

    /// Where the samples that will be kept lie, and why.
    pub fn placing(&self) -> &Placing {
        &self.placing
    }

    /// The format it is in.
    pub fn format(&self) -> &'static str {
        self.format
    }

    /// Where the samples that will be kept lie.
    pub fn grid(&self) -> &Grid {
        self.placing.grid()
    }

    /// Whether the file, or the person, says how far samples are apart.
    pub fn spacing_is_stated(&self) -> bool {
        self.placing.spacing_is_stated()
    }

    /// The files that name the same scan: those of a DICOM series.
    pub fn series(&self) -> &[PathBuf] {
        &self.series
    }

    /// What the file says beside the samples.
    pub fn metadata(&self) -> &Metadata {
        &self.metadata
    }

    fn fails(&self, reason: ReadError) -> OpenError {
        OpenError { file: self.file.clone(), reason }
    }

    /// Memory that opening it needs, at every `step`-th sample.
    fn memory(&self, kept: Kept, step: usize) -> u64 {
        memory::needed(self.grid.dims().map(|n| n.div_ceil(step) as u128).iter().product(), kept.bytes())
    }

    /// Reads the samples into memory, if they fit. `progress` counts bytes of files, and slices.
    pub fn load(self, progress: &Progress) -> Result<Volume, OpenError> {
        self.collect(progress).map_err(|reason| self.fails(reason))
    }

    fn collect(&self, progress: &Progress) -> Result<Volume, ReadError> {
        Summary::check_scale(self.slope, self.intercept).map_err(VolumeError::from)?;
        let kept = self.kept(progress, 1)?;
        memory::check(self.placing.step(), |step| self.memory(kept, step))?;
        let grid = self.grid.every(self.placing.step());
        let (samples, warnings) = match &self.storage {
            Storage::Parts(parts) if self.placing.step() == 1 && fill::can_fill(parts, self.encoding, kept) => {
                let (samples, late) = fill::fill(parts, self.encoding, kept, grid.len(), progress)?;
                (samples, self.warnings(late, None))
            }
            _ => {
                let mut collector = Collector::new(self.encoding, kept, grid.len())?;
                let late = self.stream(progress, &mut |bytes| {
                    collector.push(bytes);
                    Ok(())
                })?;
                let warnings = self.warnings(late, collector.warning());
                (collector.samples, warnings)
            }
        };
        let (slope, intercept, unit) = (self.slope, self.intercept, self.unit.unwrap_or(Unit::Value));
        let raster = Raster { grid, samples, slope, intercept, unit, warnings };
        let volume = Volume::new(self.name(), self.format, raster)?;
        let unit = self.unit.unwrap_or_else(|| unit_of_range(volume.range()));
        Ok(volume.with_unit(unit).with_metadata(self.metadata.clone()).placed(self.placing.clone()))
    }

    /// Streams the samples for their range and histogram. `progress` counts bytes of files, and slices.
    pub fn survey(&self, progress: &Progress) -> Result<Survey, OpenError> {
        self.tally(progress).map_err(|reason| self.fails(reason))
    }

    fn tally(&self, progress: &Progress) -> Result<Survey, ReadError> {
        Summary::check_scale(self.slope, self.intercept).map_err(VolumeError::from)?;
        // Whole numbers are counted in one pass; floats need their range first.
        let kept = self.kept(progress, 1 + u64::from(self.encoding.sample.is_float()))?;
        let mut tally = Tally::new(kept);
        let mut warnings = self.pieces(kept, progress, &mut |samples| {
            tally.add(samples);
            Ok(())
        })?;
        let histogram = match tally {
            Tally::Whole { counts, lowest } => whole_histogram(&counts, lowest),
            Tally::Float { ends, odd } => {
                let ends = usual(ends)?;
                let mut counts = Histogram { range: ends.map(f64::from), counts: vec![0; BINS] };
                self.pieces(kept, progress, &mut |samples| {
                    if let Samples::F32(s) = samples {
                        s.iter().for_each(|&v| counts.add(volume::mend(v, ends).into(), 1));
                    }
                    Ok(())
                })?;
                warnings.extend(volume::mended(odd));
                counts
            }
        };
        let grid = self.grid();
        warnings.extend(volume::flat(grid));
        let [low, high] = histogram.range.map(|s| self.slope * s + self.intercept);
        let unit = self.unit.unwrap_or_else(|| unit_of_range([low.min(high), low.max(high)]));
        Ok(Survey {
            summary: Summary::new(self.slope, self.intercept, unit, histogram),
            type_name: kept.name(),
            sample_bytes: (grid.len() * kept.bytes()) as u64,
            memory_bytes: self.memory(kept, self.placing.step()),
            warnings: self.placing.warnings(&warnings),
        })
    }

    /// Passes all samples that are kept on, in pieces and as they would be in memory: floats are looked through for what is no number first.
    pub(super) fn pass(&self, progress: &Progress, take: &mut Pieces<'_>) -> Result<Passed, ReadError> {
        Summary::check_scale(self.slope, self.intercept).map_err(VolumeError::from)?;
        let is_float = self.encoding.sample.is_float();
        let kept = self.kept(progress, 1 + u64::from(is_float))?;
        let mut tally = Tally::new(kept);
        if is_float {
            self.pieces(kept, progress, &mut |samples| {
                tally.add(samples);
                Ok(())
            })?;
        }
        let (ends, odd) = match tally {
            Tally::Float { ends, odd } if is_float => (usual(ends)?, odd),
            _ => ([f32::MIN, f32::MAX], 0),
        };
        let mut range = [f64::MAX, f64::MIN];
        let mut warnings = self.pieces(kept, progress, &mut |samples| {
            if let Samples::F32(s) = &mut *samples {
                s.iter_mut().for_each(|v| *v = volume::mend(*v, ends));
            }
            let [low, high] = crate::with_samples!(&*samples, s => lowest_and_highest(s));
            range = [range[0].min(low), range[1].max(high)];
            take(samples)
        })?;
        warnings.extend(volume::mended(odd));
        warnings.extend(volume::flat(self.grid()));
        let [a, b] = range.map(|s| self.slope * s + self.intercept);
        let unit = self.unit.unwrap_or_else(|| unit_of_range([a.min(b), a.max(b)]));
        Ok(Passed { unit, warnings: self.placing.warnings(&warnings) })
    }

    /// Passes samples on in the type that they are kept in; gives warnings.
    fn pieces(&self, kept: Kept, progress: &Progress, take: &mut Pieces<'_>) -> Result<Vec<String>, ReadError> {
        let mut collector = Collector::new(self.encoding, kept, 0)?;
        let late = self.stream(progress, &mut |bytes| {
            collector.push(bytes);
            take(&mut collector.samples)?;
            crate::with_samples!(&mut collector.samples, s => s.clear());
            Ok(())
        })?;
        Ok(self.warnings(late, collector.warning()))
    }

    /// The type that samples are kept in. Wide integers are looked through for it.
    fn kept(&self, progress: &Progress, passes: u64) -> Result<Kept, ReadError> {
        let wide = self.encoding.sample.is_wide();
        progress.begin(self.file_bytes.saturating_mul(passes + u64::from(wide)));
        let mut ends = [i128::MAX, i128::MIN];
        if wide {
            self.stream(progress, &mut |bytes| {
                widen(self.encoding, bytes, &mut ends);
                Ok(())
            })?;
        }
        Ok(Kept::of(self.encoding.sample, ends))
    }

    fn warnings(&self, late: Vec<String>, rounded: Option<String>) -> Vec<String> {
        let kept = Keep::noted(&self.metadata).sentences();
        self.warnings.iter().cloned().chain(kept).chain(late).chain(rounded).chain(self.label()).collect()
    }

    /// The sentence about a preview.
    fn label(&self) -> Option<String> {
        let step = self.placing.step();
        (step > 1).then(|| format!("this is a preview of every {} along each axis: what is finer is not in it", nth_sample(step)))
    }

    /// Passes the samples that are kept on, in order; gives warnings.
    fn stream(&self, progress: &Progress, take: &mut Sink<'_>) -> Result<Vec<String>, ReadError> {
        let ([nx, ny, nz], size) = (self.grid.dims(), self.encoding.sample.bytes());
        let slice_bytes = nx as u64 * ny as u64 * size as u64;
        let (mut passed, mut thinned) = (0_u64, vec![]);
        let mut pass = |bytes: &[u8], at: u64| {
            progress.reached((at + bytes.len() as u64) / slice_bytes, nz as u64);
            if self.placing.step() == 1 {
                return take(bytes);
            }
            self.thin(bytes, at, &mut thinned);
            take(&thinned)
        };
        let mut in_turn = |bytes: &[u8]| {
            let at = passed;
            passed += bytes.len() as u64;
            pass(bytes, at)
        };
        match &self.storage {
            Storage::Parts(parts) => ahead(|take| part::stream_all(parts, progress, take), &mut in_turn),
            Storage::Stream(stream) => ahead(|take| stream(progress, take), &mut in_turn),
            Storage::Slices(slice) => {
                let wanted: Vec<usize> = (0..nz).step_by(self.placing.step()).collect();
                // Two batches are under way, one unpacked while the one before is passed on: a sixteenth of the samples at most, so that
                // memory stays near that of the samples.
                let batch = (nz / 32).clamp(1, 2 * rayon::current_num_threads());
                let unpack = |slices: &[usize], mut buffers: Vec<Vec<u8>>| -> Vec<Unpacked> {
                    buffers.resize(slices.len(), vec![]);
                    slices.par_iter().zip(buffers).map(|(&k, buffer)| (k, slice(k, buffer, progress))).collect()
                };
                let mut batches = wanted.chunks(batch);
                let mut ready = unpack(batches.next().unwrap_or_default(), vec![]);
                let mut buffers = vec![];
                while !ready.is_empty() {
                    let mut next = vec![];
                    let again = std::mem::take(&mut buffers);
                    rayon::in_place_scope(|scope| {
                        if let Some(slices) = batches.next() {
                            scope.spawn(|_| next = unpack(slices, again));
                        }
                        for (k, bytes) in std::mem::take(&mut ready) {
                            let bytes = bytes?;
                            if bytes.len() as u64 != slice_bytes {
                                return Err(ReadError::Truncated { wanted: slice_bytes.into(), there: bytes.len() as u64 });
                            }
                            pass(&bytes, k as u64 * slice_bytes)?;
                            buffers.push(bytes);
                        }
                        Ok(progress.advance(0)?)
                    })?;
                    ready = next;
                }
                Ok(vec![])
            }
        }
    }

    /// Every step-th sample along each axis of `bytes`, which begin `at` bytes into the samples.
    fn thin(&self, bytes: &[u8], at: u64, out: &mut Vec<u8>) {
        let ([nx, ny, _], size, step) = (self.grid.dims(), self.encoding.sample.bytes(), self.placing.step());
        out.clear();
        let first = (at / size as u64) as usize;
        let count = bytes.len() / size;
        let mut n = 0;
        while n < count {
            let (i, row) = ((first + n) % nx, (first + n) / nx);
            let run = (nx - i).min(count - n);
            if (row % ny).is_multiple_of(step) && (row / ny).is_multiple_of(step) {
                for m in (i.next_multiple_of(step) - i..run).step_by(step) {
                    out.extend_from_slice(&bytes[(n + m) * size..(n + m + 1) * size]);
                }
            }
            n += run;
        }
    }
}

/// The ends of what is usual in a scan of floats.
fn usual(ends: [f32; 2]) -> Result<[f32; 2], VolumeError> {
    if ends[0] > ends[1] { Err(VolumeError::NothingFinite) } else { Ok(ends) }
}

fn lowest_and_highest<T: Sample>(samples: &[T]) -> [f64; 2] {
    let Some(&first) = samples.first() else { return [f64::MAX, f64::MIN] };
    let narrower = |a: T, b: T| if b < a { b } else { a };
    let wider = |a: T, b: T| if b > a { b } else { a };
    // Side by side, so that vectors of samples are compared at once.
    let (mut lowest, mut highest) = ([first; 64], [first; 64]);
    for some in samples.chunks(64) {
        for ((low, high), &s) in lowest.iter_mut().zip(&mut highest).zip(some) {
            (*low, *high) = (narrower(*low, s), wider(*high, s));
        }
    }
    [lowest.into_iter().fold(first, narrower), highest.into_iter().fold(first, wider)].map(T::to_f64)
}

/// What is counted while samples stream by.
enum Tally {
    /// Of each whole number, from the lowest that the type has.
    Whole { counts: Vec<u64>, lowest: i32 },
    /// The range of what is usual, and how many are not.
    Float { ends: [f32; 2], odd: usize },
}

impl Tally {
    fn new(kept: Kept) -> Self {
        match kept {
            Kept::U8 => Self::Whole { counts: vec![0; 1 << 8], lowest: 0 },
            Kept::U16 => Self::Whole { counts: vec![0; 1 << 16], lowest: 0 },
            Kept::I16 => Self::Whole { counts: vec![0; 1 << 16], lowest: i16::MIN.into() },
            Kept::F32 => Self::Float { ends: [f32::MAX, f32::MIN], odd: 0 },
        }
    }

    fn add(&mut self, samples: &Samples) {
        match (self, samples) {
            (Self::Whole { counts, .. }, Samples::U8(s)) => s.iter().for_each(|&v| counts[usize::from(v)] += 1),
            (Self::Whole { counts, .. }, Samples::U16(s)) => s.iter().for_each(|&v| counts[usize::from(v)] += 1),
            (Self::Whole { counts, lowest }, Samples::I16(s)) => s.iter().for_each(|&v| counts[(i32::from(v) - *lowest) as usize] += 1),
            (Self::Float { ends, odd }, Samples::F32(s)) => s.iter().for_each(|&v| match volume::is_odd(v) {
                true => *odd += 1,
                false => *ends = [ends[0].min(v), ends[1].max(v)],
            }),
            _ => unreachable!("the tally was made for the type that is kept"),
        }
    }
}

fn whole_histogram(counts: &[u64], lowest: i32) -> Histogram {
    let there = || counts.iter().enumerate().filter(|(_, c)| **c > 0).map(|(n, &c)| (f64::from(n as i32 + lowest), c));
    let low = there().next().map_or(0.0, |(v, _)| v);
    let high = there().next_back().map_or(0.0, |(v, _)| v);
    let mut histogram = Histogram { range: [low, high], counts: vec![0; BINS] };
    there().for_each(|(value, count)| histogram.add(value, count));
    histogram
}

/// Values from between −1100 and −900, or exactly −2000, −2048 or −3024 (what scanners write outside their field of view), up
/// to between 200 and 32767 are taken as Hounsfield units, as that is what CT exports look like; anything else as plain values.
fn unit_of_range([low, high]: [f64; 2]) -> Unit {
    let air = (-1100.0..=-900.0).contains(&low) || [-2000.0, -2048.0, -3024.0].contains(&low);
    if air && (200.0..=32767.0).contains(&high) { Unit::Hounsfield } else { Unit::Value }
}
