//! Measurements with what they were made from, so that anyone can make them again.

use crate::input::{Opened, Source};
use bregma_field::{GridError, Progress, WorldPoint};
use bregma_measure::{DifferenceRay, probe_cut};
use bregma_renderer::{Clip, Color, Layer, Ray};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What measurements were made by and from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Origin {
    /// Program and version.
    pub program: String,
    /// One for each scan, in order.
    pub scans: Vec<Scan>,
    /// What was cut away.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub clips: Vec<Clip>,
}

/// A scan as it was measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scan {
    /// Its file and what the person said about it.
    #[serde(flatten)]
    pub source: Source,
    /// SHA-256 of what it holds, see `Volume::content`.
    pub content: String,
    /// Isovalue and registration.
    pub layer: Layer,
}

/// This program and its version.
pub const PROGRAM: &str = concat!("bregma ", env!("CARGO_PKG_VERSION"));

impl Origin {
    /// Of what is open, with files named from the root on. The built-in pair has no files.
    pub fn of(opened: &Opened) -> Option<Self> {
        if opened.sources.len() != opened.volumes.len() {
            return None;
        }
        let named = |s: &Source| Source { file: std::path::absolute(&s.file).unwrap_or_else(|_| s.file.clone()), ..s.clone() };
        let layers = opened.volumes.iter().zip(&opened.scene.layers);
        let scan = |(source, (volume, layer)): (&Source, (&Arc<bregma_field::Volume>, &Layer))| Scan {
            source: named(source),
            content: volume.content(),
            layer: layer.clone(),
        };
        let scans = opened.sources.iter().zip(layers).map(scan).collect();
        Some(Self { program: PROGRAM.into(), scans, clips: opened.scene.clips.clone() })
    }
}

/// A difference ray as it is written to JSON: the measurement, its name and colour if it has them, and `made_by`.
pub fn to_json(ray: &DifferenceRay, named: Option<(&str, Color)>, origin: Option<&Origin>) -> Value {
    let mut record = json!(ray);
    if let (Some((name, color)), Some(fields)) = (named, record.as_object_mut()) {
        fields.insert("name".into(), json!(name));
        fields.insert("color".into(), json!(color.hex()));
    }
    if let (Some(origin), Some(fields)) = (origin, record.as_object_mut()) {
        fields.insert("made_by".into(), json!(origin));
    }
    record
}

/// The records of a file: a session's, or one or more written one behind the other.
pub fn read(file: &Path) -> Result<Vec<Value>, String> {
    let fail = |reason: String| format!("{}: {reason}", file.display());
    let text = std::fs::read_to_string(file).map_err(|e| fail(format!("cannot be read ({e}); check its name and permissions")))?;
    let values: Result<Vec<Value>, _> = serde_json::Deserializer::from_str(&text).into_iter().collect();
    let mut values = values.map_err(|e| fail(format!("is not JSON ({e}); give a session, or what `bregma probe --format json` wrote")))?;
    if let [session] = values.as_slice()
        && session.get("bregma_session").is_some()
    {
        values = session.get("measurements").and_then(Value::as_array).cloned().unwrap_or_default();
    }
    if values.is_empty() {
        return Err(fail("holds no measurements; save the session again after measuring".into()));
    }
    Ok(values)
}

/// The ray of a record.
pub fn ray_of(record: &Value) -> Option<Ray> {
    let numbers = |key: &str| -> Option<DVec3> {
        let list: Vec<f64> = record.get("ray")?.get(key)?.as_array()?.iter().filter_map(Value::as_f64).collect();
        <[f64; 3]>::try_from(list).ok().map(DVec3::from)
    };
    // The direction is unit but for rounding, which normalising again would change.
    let ray = Ray { origin: WorldPoint(numbers("origin_mm")?), direction: numbers("direction")? };
    (ray.origin.0.is_finite() && (ray.direction.length() - 1.0).abs() < 1e-9).then_some(ray)
}

/// What became of a length when it was measured again.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// It is the same.
    Holds,
    /// It is another, mm.
    Differs {
        /// As recorded.
        was_mm: f64,
        /// Now.
        is_mm: f64,
    },
    /// There is no such bone any more, or there was none.
    Gone(&'static str),
}

/// A recorded length judged.
#[derive(Clone, Debug, PartialEq)]
pub struct Judged {
    /// Ray, scan and bone.
    pub what: String,
    /// The judgement.
    pub verdict: Verdict,
}

/// Lengths are the same to this, mm: the last digits depend on how a compiler orders sums.
const SAME_MM: f64 = 1e-9;

/// The scans that were opened last to measure again, so that a file of many rays opens them only once.
#[derive(Debug, Default)]
pub struct Verifier {
    opened: Option<(Vec<Scan>, Opened)>,
}

impl Verifier {
    /// Measures record number `n` (from 1) again. The answer holds one judgement for each length, and what else is to be said; an error is a
    /// sentence about why it cannot be measured, as where a scan is not what it was.
    pub fn verify(&mut self, n: usize, record: &Value, folder: &Path) -> Result<(Vec<Judged>, Vec<String>), String> {
        let name = record.get("name").and_then(Value::as_str).map_or(format!("ray {n}"), str::to_owned);
        let origin: Origin = record
            .get("made_by")
            .and_then(|v| Origin::deserialize(v).ok())
            .ok_or(format!("{name} does not say what it was made from; measure it again with this version"))?;
        let ray = ray_of(record).ok_or(format!("{name} has no ray; its origin_mm and direction are needed"))?;
        let opened = self.open(&origin, folder)?;
        let mut notes = vec![];
        if origin.program != PROGRAM {
            notes.push(format!("{name} was made by {}", origin.program));
        }
        let now = measure(opened, &ray).map_err(|e| format!("{name}: {e}"))?;
        let mut judged = vec![];
        let recorded = record.get("volumes").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
        for v in 0..recorded.len().max(now.volumes.len()) {
            let lengths: Vec<Option<f64>> = recorded
                .get(v)
                .and_then(|r| r.get("segments")?.as_array())
                .map_or(vec![], |segments| segments.iter().map(|s| s.get("length_mm")?.as_f64()).collect());
            let (scan, segments) =
                now.volumes.get(v).map_or(("a scan that is not there", &[][..]), |v| (v.name.as_str(), v.segments.as_slice()));
            for k in 0..lengths.len().max(segments.len()) {
                let verdict = match (lengths.get(k), segments.get(k)) {
                    (Some(Some(was)), Some(is)) if (was - is.length_mm).abs() <= SAME_MM => Verdict::Holds,
                    (Some(Some(was)), Some(is)) => Verdict::Differs { was_mm: *was, is_mm: is.length_mm },
                    (Some(Some(_)), None) => Verdict::Gone("there is no such bone now"),
                    (Some(None), _) => Verdict::Gone("its recorded length is no number"),
                    (None, _) => Verdict::Gone("this bone was not recorded"),
                };
                judged.push(Judged { what: format!("{name}, {scan}, bone {}", k + 1), verdict });
            }
        }
        Ok((judged, notes))
    }

    /// The scans of a record as they were measured.
    fn open(&mut self, origin: &Origin, folder: &Path) -> Result<&Opened, String> {
        let layers = origin.scans.iter().map(|scan| scan.layer.clone()).collect();
        let same = |(a, b): (&Scan, &Scan)| a.source == b.source && a.content == b.content;
        let is_open = |scans: &[Scan]| scans.len() == origin.scans.len() && scans.iter().zip(&origin.scans).all(same);
        let known = self.opened.take().filter(|(scans, _)| is_open(scans));
        let mut opened = match known {
            Some((_, opened)) => opened,
            None => {
                let beside = |scan: &Scan| Source { file: found(&scan.source.file, folder), ..scan.source.clone() };
                let sources: Vec<Source> = origin.scans.iter().map(beside).collect();
                let opened = Opened::read(&sources, &Progress::default()).map_err(|e| e.to_string())?;
                if opened.volumes.len() != origin.scans.len() {
                    return Err(format!("{} scans were measured, and {} are there", origin.scans.len(), opened.volumes.len()));
                }
                let changed = opened.volumes.iter().zip(&origin.scans).zip(&sources).find(|((v, scan), _)| v.content() != scan.content);
                if let Some((_, source)) = changed {
                    return Err(format!("{} is not the scan that was measured: its content differs", source.file.display()));
                }
                opened
            }
        };
        opened.scene.layers = layers;
        opened.scene.clips.clone_from(&origin.clips);
        Ok(&self.opened.insert((origin.scans.clone(), opened)).1)
    }
}

/// A recorded file: where it was, or in the folder of the record.
fn found(file: &Path, folder: &Path) -> PathBuf {
    let beside = folder.join(file.file_name().unwrap_or_default());
    let relative = folder.join(file);
    [relative, beside].into_iter().find(|f| f.exists()).unwrap_or_else(|| file.to_owned())
}

/// Casts a ray through what is open.
pub fn measure(opened: &Opened, ray: &Ray) -> Result<DifferenceRay, GridError> {
    probe_cut(&opened.volumes, &opened.scene.layers, &opened.scene.clips, ray)
}
