//! Measurements made again from what their records say.

use crate::date::now;
use crate::difference::{self, DifferenceError};
use crate::measurement::{MeasuredScan, Measurement, Origin, RecordedDifference, RecordedSection, RecordedVolumes};
use crate::opened::{InputError, Opened};
use crate::parts::PartOf;
use crate::section::{self, SectionError};
use crate::source::Source;
use crate::volumes;
use bregma_field::{Progress, SurfaceError};
use bregma_measure::csv::Made;
use bregma_measure::volumes::VolumesError;
use bregma_measure::{DifferenceRay, probe, probe_cut};
use bregma_renderer::Ray;
use serde::Deserialize;
use std::collections::HashMap;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// This program and its version.
const PROGRAM: &str = concat!("bregma ", env!("CARGO_PKG_VERSION"));

impl Origin {
    /// Of what is open, with files named from the root on; `None` where the scans of what is open have no sources.
    pub fn of(opened: &Opened) -> Option<Self> {
        if opened.sources.len() != opened.volumes.len() {
            return None;
        }
        let scans = opened.sources.iter().zip(&opened.volumes).zip(&opened.scene.layers).map(|((source, volume), layer)| MeasuredScan {
            source: source.absolute(),
            content: volume.content(),
            layer: layer.clone(),
        });
        Some(Self { program: PROGRAM.into(), date: Some(now()), scans: scans.collect(), clips: opened.scene.clips.clone() })
    }
}

/// What stands in every row of a table of what is measured now.
pub fn made(opened: &Opened) -> Made {
    let file = |source: &Source| source.absolute().file.display().to_string();
    let files = opened.sources.iter().map(file).collect();
    Made { program: PROGRAM.into(), date: now(), files, notes: opened.corrections() }
}

/// Why a file gives no measurements.
#[derive(Debug, Error)]
pub enum RecordError {
    /// It is not there, or not for this person.
    #[error("{}: cannot be read ({reason}); check its name and permissions", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// What the system says.
        reason: io::Error,
    },
    /// It is something else.
    #[error("{}: is not JSON ({reason}); give a session, or what `bregma probe --format json` wrote", file.display())]
    NotJson {
        /// The file.
        file: PathBuf,
        /// Where it stops being JSON.
        reason: serde_json::Error,
    },
    /// It has none.
    #[error("{}: holds no measurements; save the session again after measuring", .0.display())]
    Empty(PathBuf),
}

/// One of the values that a file of measurements consists of.
#[derive(Deserialize)]
#[serde(untagged)]
enum Recorded {
    Session {
        #[serde(rename = "bregma_session")]
        _version: serde::de::IgnoredAny,
        #[serde(default)]
        measurements: Vec<Measurement>,
    },
    One(Measurement),
}

/// The measurements of a file: a session's, or one or more written one behind the other.
pub fn read(file: &Path) -> Result<Vec<Measurement>, RecordError> {
    let text = std::fs::read_to_string(file).map_err(|reason| RecordError::Unreadable { file: file.to_owned(), reason })?;
    let values: Result<Vec<Recorded>, _> = serde_json::Deserializer::from_str(&text).into_iter().collect();
    let values = values.map_err(|reason| RecordError::NotJson { file: file.to_owned(), reason })?;
    let measurements: Vec<Measurement> = values
        .into_iter()
        .flat_map(|value| match value {
            Recorded::Session { measurements, .. } => measurements,
            Recorded::One(measurement) => vec![measurement],
        })
        .collect();
    if measurements.is_empty() { Err(RecordError::Empty(file.to_owned())) } else { Ok(measurements) }
}

/// What became of a length when it was measured again.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// It is the same.
    Holds,
    /// It is another.
    Differs {
        /// As recorded.
        was: f64,
        /// Now.
        is: f64,
    },
    /// There is no such bone any more, or there was none.
    Gone(&'static str),
}

/// What a recorded number is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// A length.
    Mm,
    /// A volume.
    Mm3,
}

/// A recorded length, or volume, judged.
#[derive(Clone, Debug, PartialEq)]
pub struct Judged {
    /// Ray, scan and bone.
    pub what: String,
    /// Its unit.
    pub unit: Unit,
    /// The judgement.
    pub verdict: Verdict,
}

/// Why a measurement cannot be made again.
#[derive(Debug, Error)]
pub enum VerifyError {
    /// Nothing says what it is of.
    #[error("{0} does not say what it was made from; measure it again with this version")]
    NoOrigin(String),
    /// Its ray is missing or none.
    #[error("{0} has no ray; its origin_mm and direction are needed")]
    NoRay(String),
    /// A scan cannot be opened.
    #[error(transparent)]
    Input(#[from] InputError),
    /// A session stands where a scan was.
    #[error("{measured} scans were measured, and {there} are there")]
    Count {
        /// As recorded.
        measured: usize,
        /// Now.
        there: usize,
    },
    /// A scan is another one now.
    #[error("{} is not the scan that was measured: its content differs", .0.display())]
    Changed(PathBuf),
    /// A difference that cannot be measured any more.
    #[error(transparent)]
    Difference(#[from] DifferenceError),
    /// Volumes that are not known any more.
    #[error(transparent)]
    Volumes(#[from] VolumesError),
    /// A section that cannot be measured any more.
    #[error(transparent)]
    Section(#[from] SectionError),
    /// A registration that flattens a scan.
    #[error("{name}: {reason}")]
    Grid {
        /// The measurement.
        name: String,
        /// What is wrong with the registration.
        reason: SurfaceError,
    },
}

/// Lengths are the same to this, mm: the last digits depend on how a compiler orders sums.
const SAME_MM: f64 = 1e-9;
/// Numbers along a curve are the same to this, mm: a partner's place is settled to so much of a voxel.
const SAME_ALONG_MM: f64 = 1e-6;

/// Volumes are the same to this part of themselves, for the same reason.
const SAME_VOLUME: f64 = 1e-9;

/// The scans that were opened last to measure again, so that a file of many rays opens them only once.
#[derive(Debug, Default)]
pub struct Verifier {
    opened: Option<(Vec<MeasuredScan>, Opened)>,
}

impl Verifier {
    /// Measures number `n` (from 1) of the measurements in a file of `folder` again. The answer holds one judgement for each length, and what
    /// else is to be said.
    pub fn verify(&mut self, n: usize, measurement: &Measurement, folder: &Path) -> Result<(Vec<Judged>, Vec<String>), VerifyError> {
        let unnamed = || format!("ray {n}");
        let recorded = match measurement {
            Measurement::Ray(recorded) => recorded,
            Measurement::Difference(recorded) => return self.verify_difference(recorded, folder),
            Measurement::Volumes(recorded) => return self.verify_volumes(recorded, folder),
            Measurement::Section(recorded) => return self.verify_section(recorded, folder),
            Measurement::Other(_) => return Err(VerifyError::NoOrigin(unnamed())),
        };
        let name = recorded.name.clone().unwrap_or_else(unnamed);
        let origin = recorded.made_by().ok_or_else(|| VerifyError::NoOrigin(name.clone()))?;
        let ray = recorded.ray().ok_or_else(|| VerifyError::NoRay(name.clone()))?;
        let opened = self.open(origin, folder)?;
        let mut notes = vec![];
        if origin.program != PROGRAM {
            notes.push(format!("{name} was made by {}", origin.program));
        }
        let now = measure(opened, &ray, recorded.is_as_cut()).map_err(|reason| VerifyError::Grid { name: name.clone(), reason })?;
        Ok((judge(&name, &recorded.lengths_mm(), &now), notes))
    }

    /// Measures a difference of surfaces again: a judgement for each of its numbers.
    fn verify_difference(&mut self, recorded: &RecordedDifference, folder: &Path) -> Result<(Vec<Judged>, Vec<String>), VerifyError> {
        let name = "the difference of surfaces";
        let origin = recorded.made_by.as_ref().ok_or_else(|| VerifyError::NoOrigin(name.into()))?;
        let opened = self.open(origin, folder)?;
        let order = &recorded.difference.order;
        if order.pair.iter().any(|n| *n >= opened.volumes.len()) {
            return Err(VerifyError::Count { measured: order.pair[0].max(order.pair[1]) + 1, there: opened.volumes.len() });
        }
        let now = difference::measure(opened, order, &Progress::default())?.record(None);
        // Sums over as many areas as a surface has points are good to fewer digits than one length.
        let is_same = |was_mm: f64, is: f64| (was_mm - is).abs() <= SAME_MM * (1.0 + was_mm.abs());
        Ok((judge_numbers(name, recorded.numbers(), now.numbers(), is_same), vec![]))
    }

    /// Measures volumes again.
    fn verify_volumes(&mut self, recorded: &RecordedVolumes, folder: &Path) -> Result<(Vec<Judged>, Vec<String>), VerifyError> {
        let origin = recorded.made_by.as_ref().ok_or_else(|| VerifyError::NoOrigin("the record of volumes".into()))?;
        let opened = self.open(origin, folder)?;
        let found = volumes::measure(opened, &recorded.volumes_of, &Progress::default())?;
        let now = found.measures();
        let judged = recorded.volumes_mm3().into_iter().enumerate().map(|(n, (what, was))| {
            let verdict = match now.get(n).map(|(measure, _)| measure.volume_mm3) {
                // A volume of nothing is rounding: the cubic micrometre is far below what any scan shows.
                Some(is) if (is - was).abs() <= SAME_VOLUME * was.abs().max(1.0) => Verdict::Holds,
                Some(is) => Verdict::Differs { was, is },
                None => Verdict::Gone("there is no such volume now"),
            };
            Judged { what, unit: Unit::Mm3, verdict }
        });
        Ok((judged.collect(), vec![]))
    }

    /// Measures a section again: a judgement for its length and for each number at each of its stations.
    fn verify_section(&mut self, recorded: &RecordedSection, folder: &Path) -> Result<(Vec<Judged>, Vec<String>), VerifyError> {
        let name = "the section";
        let origin = recorded.made_by.as_ref().ok_or_else(|| VerifyError::NoOrigin(name.into()))?;
        let opened = self.open(origin, folder)?;
        let now = section::measure(opened, &recorded.section.order, &Progress::default())?.told;
        let is_same = |was_mm: f64, is: f64| (was_mm - is).abs() <= SAME_ALONG_MM;
        Ok((judge_numbers(name, recorded.section.numbers(), now.numbers(), is_same), vec![]))
    }

    /// The scans of a record as they were measured.
    fn open(&mut self, origin: &Origin, folder: &Path) -> Result<&Opened, VerifyError> {
        let same = |(a, b): (&MeasuredScan, &MeasuredScan)| a.source == b.source && a.content == b.content;
        let is_open = |scans: &[MeasuredScan]| scans.len() == origin.scans.len() && scans.iter().zip(&origin.scans).all(same);
        let known = self.opened.take().filter(|(scans, _)| is_open(scans));
        let mut opened = match known {
            Some((_, opened)) => opened,
            None => open(origin, folder)?,
        };
        opened.scene.layers = origin.scans.iter().map(|scan| scan.layer.clone()).collect();
        opened.scene.clips.clone_from(&origin.clips);
        // Layers say which part was measured, and the sources where it is.
        opened.find_parts(&Progress::default())?;
        Ok(&self.opened.insert((origin.scans.clone(), opened)).1)
    }
}

/// The scans that something was made from, with their isovalues; a file is where it was, or in `folder`. Fails if one is another scan now.
pub(crate) fn open(origin: &Origin, folder: &Path) -> Result<Opened, VerifyError> {
    let map = |part: &PartOf| PartOf { file: found(&part.file, folder), ..part.clone() };
    let beside = |scan: &MeasuredScan| {
        let source = &scan.source;
        Source { file: found(&source.file, folder), within: source.within.as_ref().map(map), ..source.clone() }
    };
    let sources: Vec<Source> = origin.scans.iter().map(beside).collect();
    let opened = Opened::read_whole(&sources, &Progress::default())?;
    if opened.volumes.len() != origin.scans.len() {
        return Err(VerifyError::Count { measured: origin.scans.len(), there: opened.volumes.len() });
    }
    let changed = opened.volumes.iter().zip(&origin.scans).zip(&sources).find(|((v, scan), _)| v.content() != scan.content);
    match changed {
        Some((_, source)) => Err(VerifyError::Changed(source.file.clone())),
        None => Ok(opened),
    }
}

/// Each number that was recorded, or is measured now, by its name.
fn judge_numbers(name: &str, was: Vec<(String, f64)>, is: Vec<(String, f64)>, is_same: impl Fn(f64, f64) -> bool) -> Vec<Judged> {
    let mut now: HashMap<String, f64> = is.into_iter().collect();
    let known = was.into_iter().map(|(what, was_mm)| {
        let verdict = match now.remove(&what) {
            Some(is_mm) if is_same(was_mm, is_mm) => Verdict::Holds,
            Some(is_mm) => Verdict::Differs { was: was_mm, is: is_mm },
            None => Verdict::Gone("there is no such number now"),
        };
        Judged { what: format!("{name}, {what}"), unit: Unit::Mm, verdict }
    });
    let mut judged: Vec<Judged> = known.collect();
    let mut others: Vec<String> = now.into_keys().collect();
    others.sort();
    judged.extend(others.into_iter().map(|what| Judged {
        what: format!("{name}, {what}"),
        unit: Unit::Mm,
        verdict: Verdict::Gone("it was not recorded"),
    }));
    judged
}

/// Each length that was recorded, or is measured now, in each scan.
fn judge(name: &str, recorded: &[Vec<Option<f64>>], now: &DifferenceRay) -> Vec<Judged> {
    let mut judged = vec![];
    let as_cut = if now.as_cut { ", as cut" } else { "" };
    for v in 0..recorded.len().max(now.volumes.len()) {
        let lengths = recorded.get(v).map_or(&[][..], Vec::as_slice);
        let (scan, segments) = now.volumes.get(v).map_or(("a scan that is not there", &[][..]), |v| (&v.name, &v.segments));
        for k in 0..lengths.len().max(segments.len()) {
            let verdict = match (lengths.get(k), segments.get(k)) {
                (Some(Some(was)), Some(is)) if (was - is.length_mm).abs() <= SAME_MM => Verdict::Holds,
                (Some(Some(was)), Some(is)) => Verdict::Differs { was: *was, is: is.length_mm },
                (Some(Some(_)), None) => Verdict::Gone("there is no such bone now"),
                (Some(None), _) => Verdict::Gone("its recorded length is no number"),
                (None, _) => Verdict::Gone("this bone was not recorded"),
            };
            judged.push(Judged { what: format!("{name}, {scan}, bone {}{as_cut}", k + 1), unit: Unit::Mm, verdict });
        }
    }
    judged
}

/// A recorded file: where it was, or in the folder of the record.
fn found(file: &Path, folder: &Path) -> PathBuf {
    let beside = folder.join(file.file_name().unwrap_or_default());
    let relative = folder.join(file);
    [relative, beside].into_iter().find(|f| f.exists()).unwrap_or_else(|| file.to_owned())
}

/// Casts a ray through the whole bone of what is open, or through what the cuts leave.
pub fn measure(opened: &Opened, ray: &Ray, as_cut: bool) -> Result<DifferenceRay, SurfaceError> {
    let (volumes, scene) = (&opened.volumes, &opened.scene);
    if as_cut { probe_cut(volumes, &scene.layers, &scene.clips, ray) } else { probe(volumes, &scene.layers, ray) }
}
