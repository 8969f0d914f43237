//! What was measured, as sessions and exports keep it: with what it was measured on, so that anyone can measure it again.

use crate::difference_order::{RecordedHalf, Told};
use crate::section_order;
use crate::source::Source;
use crate::volumes_order::Order as VolumesOrder;
use bregma_field::WorldPoint;
use bregma_measure::DifferenceRay;
use bregma_renderer::{Clip, Color, Layer, Ray};
use glam::DVec3;
use serde::ser::Error;
use serde::{Deserialize, Serialize, Serializer};
use serde_json::{Map, Value, json};
use std::fmt;

/// Something that was measured.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum Measurement {
    /// A difference ray.
    Ray(Box<RecordedRay>),
    /// How two surfaces differ.
    Difference(Box<RecordedDifference>),
    /// Volumes of bone or of cavities.
    Volumes(Box<RecordedVolumes>),
    /// Thickness and differences along a curve.
    Section(Box<RecordedSection>),
    /// What this version does not know: it is kept as it was read.
    Other(Value),
}

/// A difference ray: of what it found, what is read again has fields of its own, and the rest is kept as it was written.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordedRay {
    /// What the person calls it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Its colour in the picture.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "hex")]
    pub color: Option<Color>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    as_cut: Option<bool>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    made_by: Option<MadeBy>,
    ray: Line,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    volumes: Option<Vec<RecordedVolume>>,
    #[serde(flatten)]
    rest: Map<String, Value>,
}

/// A difference as sessions and exports keep it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordedDifference {
    /// What was asked for and found.
    pub difference: Told,
    /// What it was made by and on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub made_by: Option<Origin>,
}

impl RecordedDifference {
    /// The numbers by which two records are compared: a name and millimetres, or mm².
    pub(crate) fn numbers(&self) -> Vec<(String, f64)> {
        let of = |half: &RecordedHalf| {
            let number = |key: &str| half.statistics.as_ref().and_then(|s| s[key].as_f64()).map(|v| (format!("{}: {key}", half.on), v));
            ["area_mm2", "without_mm2", "mean_mm", "mean_magnitude_mm", "rms_mm", "deviation_mm", "sure"]
                .into_iter()
                .filter_map(number)
                .collect::<Vec<_>>()
        };
        self.difference.halves.iter().flat_map(of).chain([("largest".to_owned(), self.difference.largest_mm)]).collect()
    }
}

/// Volumes as sessions and exports keep them: of what was found, the rest is kept as it was written.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordedVolumes {
    /// What was asked for.
    pub volumes_of: VolumesOrder,
    /// What it was made by and on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub made_by: Option<Origin>,
    /// What was found.
    #[serde(flatten)]
    pub(crate) found: Map<String, Value>,
}

impl RecordedVolumes {
    /// Each volume in order: of what, and mm³.
    pub fn volumes_mm3(&self) -> Vec<(String, f64)> {
        let list = |key: &str| self.found.get(key).and_then(Value::as_array).into_iter().flatten();
        let volume = |measure: &Value| Some((measure["what"].as_str()?.to_owned(), measure["volume_mm3"].as_f64()?));
        list("measures").chain(list("cavities").map(|cavity| &cavity["measure"])).filter_map(volume).collect()
    }
}

/// A section as sessions and exports keep it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordedSection {
    /// What was asked for and found.
    pub section: section_order::Told,
    /// What it was made by and on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub made_by: Option<Origin>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Line {
    origin_mm: DVec3,
    direction: DVec3,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct RecordedVolume {
    segments: Vec<RecordedSegment>,
    #[serde(flatten)]
    rest: Map<String, Value>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct RecordedSegment {
    length_mm: Option<f64>,
    #[serde(flatten)]
    rest: Map<String, Value>,
}

/// What is written of an [`Origin`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
enum MadeBy {
    Known(Origin),
    /// In a way that this version does not know: the ray can be shown, but not verified.
    Other(Value),
}

/// What measurements were made by and from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Origin {
    /// Program and version.
    pub program: String,
    /// When, RFC 3339, UTC; earlier versions did not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub date: Option<String>,
    /// One for each scan, in order.
    pub scans: Vec<MeasuredScan>,
    /// What was cut away, where only what that leaves was measured.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub clips: Vec<Clip>,
}

/// A scan as it was measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeasuredScan {
    /// Its file and what the person said about it.
    #[serde(flatten)]
    pub source: Source,
    /// SHA-256 of what it holds, see `Volume::content`.
    pub content: String,
    /// Isovalue and registration.
    pub layer: Layer,
}

impl Measurement {
    /// What a difference ray found, with its name and colour if it has them, and what it was made by.
    pub fn of_ray(found: &DifferenceRay, named: Option<(&str, Option<Color>)>, made_by: Option<&Origin>) -> Self {
        let found: RecordedRay = serde_json::from_value(json!(found)).expect("a difference ray has all that a recorded one has");
        let (name, color) = named.map_or((None, None), |(name, color)| (Some(name.to_owned()), color));
        // Cuts have no part in what was measured of the whole bone.
        let clips = |origin: &Origin| if found.as_cut == Some(true) { origin.clips.clone() } else { vec![] };
        let made_by = made_by.map(|origin| MadeBy::Known(Origin { clips: clips(origin), ..origin.clone() }));
        Self::Ray(Box::new(RecordedRay { name, color, made_by, ..found }))
    }

    /// What it was made by and on.
    pub(crate) fn origin_mut(&mut self) -> Option<&mut Origin> {
        match self {
            Self::Ray(ray) => match ray.made_by.as_mut()? {
                MadeBy::Known(origin) => Some(origin),
                MadeBy::Other(_) => None,
            },
            Self::Difference(difference) => difference.made_by.as_mut(),
            Self::Volumes(volumes) => volumes.made_by.as_mut(),
            Self::Section(section) => section.made_by.as_mut(),
            Self::Other(_) => None,
        }
    }
}

impl RecordedRay {
    /// What it was measured by and on. The built-in pair has no files to name.
    pub fn made_by(&self) -> Option<&Origin> {
        match self.made_by.as_ref()? {
            MadeBy::Known(origin) => Some(origin),
            MadeBy::Other(_) => None,
        }
    }

    /// Only what cuts left was measured. Earlier versions did not say so: they measured what their cuts left.
    pub fn is_as_cut(&self) -> bool {
        let was_cut = || self.made_by().is_some_and(|origin| origin.clips.iter().any(|clip| clip.enabled));
        self.as_cut.unwrap_or_else(was_cut)
    }

    /// Where it lies; `None` where its numbers are none of a ray.
    pub fn ray(&self) -> Option<Ray> {
        // The direction is unit but for rounding, which normalising again would change.
        let ray = Ray { origin: WorldPoint(self.ray.origin_mm), direction: self.ray.direction };
        (ray.origin.0.is_finite() && (ray.direction.length() - 1.0).abs() < 1e-9).then_some(ray)
    }

    /// The length of each stretch of bone in each scan, mm; `None` where what was written is no number.
    pub(crate) fn lengths_mm(&self) -> Vec<Vec<Option<f64>>> {
        let lengths = |volume: &RecordedVolume| volume.segments.iter().map(|segment| segment.length_mm).collect();
        self.volumes.iter().flatten().map(lengths).collect()
    }
}

impl Serialize for Measurement {
    /// With the names of its fields in the order of the alphabet, at every depth.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Ray(ray) => serde_json::to_value(ray).map_err(Error::custom)?.serialize(serializer),
            Self::Difference(difference) => serde_json::to_value(difference).map_err(Error::custom)?.serialize(serializer),
            Self::Volumes(volumes) => serde_json::to_value(volumes).map_err(Error::custom)?.serialize(serializer),
            Self::Section(section) => serde_json::to_value(section).map_err(Error::custom)?.serialize(serializer),
            Self::Other(value) => value.serialize(serializer),
        }
    }
}

impl fmt::Display for Measurement {
    /// One line of JSON.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&serde_json::to_string(self).map_err(|_| fmt::Error)?)
    }
}

/// A colour as `rrggbb`; one that cannot be read is none.
mod hex {
    use bregma_renderer::Color;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(color: &Option<Color>, serializer: S) -> Result<S::Ok, S::Error> {
        color.map(Color::hex).serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Color>, D::Error> {
        Ok(Option::<String>::deserialize(deserializer)?.as_deref().and_then(Color::from_hex))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_written_is_written_again_to_the_last_digit() {
        // Fails if reading and writing a measurement loses, renames or rounds anything, whether this version knows it or not.
        let opened = crate::Opened::demo(8, &Default::default()).unwrap();
        let layer = json!(opened.scene.layers[0]);
        let ray = format!(
            r#"{{"color":"ffd64f","ledger":[{{"from_mm":0.1,"inside":[],"length_mm":0.30000000000000004,"to_mm":0.4}}],"made_by":{{"program":"bregma 0.0.9","scans":[{{"content":"ab","file":"a.raw","layer":{layer},"raw":"4x4x4, u8,skip=1","uneven":"resample"}}]}},"name":"Ray 1","ray":{{"direction":[0.0,0.6,0.8],"origin_mm":[1e-300,-0.1,123456789.12345679]}},"volumes":[{{"box_mm":null,"later":{{"b":1,"a":[2]}},"name":"a","segments":[{{"error_mm":1.5,"length_mm":2.2204460492503131e-16}},{{"length_mm":null}}]}}]}}"#
        );
        let read: Measurement = serde_json::from_str(&ray).unwrap();
        assert!(matches!(&read, Measurement::Ray(ray) if ray.ray().is_some() && ray.lengths_mm()[0].len() == 2));
        // Names may come in another order.
        let plain = |text: &str| -> Value { serde_json::from_str(text).unwrap() };
        assert_eq!(plain(&read.to_string()), plain(&ray));
        let odd = r#"{"made_by":"another program","ray":{"direction":[0.0,1.0,0.0],"origin_mm":[0.0,0.0,0.0]}}"#;
        let read: Measurement = serde_json::from_str(odd).unwrap();
        assert!(matches!(&read, Measurement::Ray(ray) if ray.ray().is_some() && ray.made_by().is_none()));
        assert_eq!(plain(&read.to_string()), plain(odd));
        for unknown in [r#"{"area_mm2":1.25,"kind":"islands"}"#, r#"{"name":"no ray","ray":{"origin_mm":[0.0,1.0]}}"#, "[1,\"x\"]"] {
            let read: Measurement = serde_json::from_str(unknown).unwrap();
            assert!(matches!(read, Measurement::Other(_)));
            assert_eq!(plain(&read.to_string()), plain(unknown));
        }
    }
}
