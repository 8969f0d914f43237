//! What OME-Zarr says of an image: its axes, its levels, and where the samples of the finest lie. In version 0.4 that stands in `.zattrs`, in 0.5
//! under `attributes.ome` of `zarr.json`. <https://ngff.openmicroscopy.org/0.5/>

use super::super::units::unit_mm;
use super::super::{ReadError, bad};
use crate::Unit;
use crate::volume::Metadata;
use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::ops::Range;
use std::path::Path;

/// An image of a store.
pub struct Image {
    /// The array of its finest level, from the folder that was named.
    pub path: String,
    /// Its axes.
    pub axes: Axes,
    scale: Option<Vec<f64>>,
    translation: Vec<f64>,
    /// What OME-Zarr has no place for.
    pub beside: Option<Beside>,
}

/// What OME-Zarr has no place for, as the attribute `bregma`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Beside {
    /// Of this attribute.
    pub version: u32,
    /// Sample indices (i, j, k) to LPS mm: columns, then the first sample.
    pub index_to_world: [f64; 12],
    /// Whether spacing is stated, or assumed.
    pub spacing_is_stated: bool,
    /// Value per sample unit.
    pub slope: f64,
    /// Value of sample 0.
    pub intercept: f64,
    /// What values are, where that is known.
    pub unit: Option<Unit>,
    /// What the scan's file said beside its samples.
    pub metadata: Metadata,
}

#[derive(Deserialize)]
struct Multiscales {
    axes: Option<Vec<Value>>,
    datasets: Vec<Dataset>,
    #[serde(default, rename = "coordinateTransformations")]
    transforms: Vec<Transform>,
}

#[derive(Deserialize)]
struct Dataset {
    path: String,
    #[serde(default, rename = "coordinateTransformations")]
    transforms: Vec<Transform>,
}

#[derive(Deserialize)]
struct Transform {
    #[serde(rename = "type")]
    kind: String,
    scale: Option<Vec<f64>>,
    translation: Option<Vec<f64>>,
}

/// Series in folders of their own, as `bioformats2raw` writes them: the first is read.
const SERIES: &str = "bioformats2raw.layout";

/// The image in the store at `folder`; `None` for an array by itself.
pub fn read(folder: &Path, warnings: &mut Vec<String>) -> Result<Option<Image>, ReadError> {
    let Some(attributes) = attributes(folder)? else { return Ok(None) };
    let ome = attributes.get("ome").unwrap_or(&attributes);
    if let Some(multiscales) = ome.get("multiscales") {
        let beside = match attributes.get("bregma") {
            Some(said) => Some(Beside::deserialize(said).map_err(|e| bad("attribute bregma", said, &e.to_string()))?),
            None => None,
        };
        return image(multiscales, beside, warnings).map(Some);
    }
    let has_series = ome.get(SERIES).is_some() || attributes.get(SERIES).is_some();
    if has_series && attributes_are_there(&folder.join("0")) {
        if attributes_are_there(&folder.join("1")) {
            warnings.push("it holds several images; the first is read; name the folder of another, 1 or the like, for that".to_owned());
        }
        let image = read(&folder.join("0"), warnings)?;
        return Ok(image.map(|image| Image { path: format!("0/{}", image.path), ..image }));
    }
    let is_array = folder.join(".zarray").is_file() || node_type(folder)? == Some("array".to_owned());
    if is_array {
        return Ok(None);
    }
    Err(ReadError::Unsupported("it is a group of Zarr that holds no image of OME-Zarr; name the folder of one of its arrays".to_owned()))
}

fn attributes_are_there(folder: &Path) -> bool {
    ["zarr.json", ".zattrs"].iter().any(|name| folder.join(name).is_file())
}

fn json(file: &Path) -> Result<Option<Value>, ReadError> {
    if !file.is_file() {
        return Ok(None);
    }
    let text = std::fs::read(file)?;
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    serde_json::from_slice(&text).map(Some).map_err(|e| ReadError::Damaged(format!("its {name} is no JSON, {e}")))
}

fn node_type(folder: &Path) -> Result<Option<String>, ReadError> {
    let node = json(&folder.join("zarr.json"))?;
    Ok(node.and_then(|node| node.get("node_type")?.as_str().map(str::to_owned)))
}

/// `None` where nothing could have any.
fn attributes(folder: &Path) -> Result<Option<Value>, ReadError> {
    if let Some(mut node) = json(&folder.join("zarr.json"))? {
        return Ok(Some(node.get_mut("attributes").map(Value::take).unwrap_or_default()));
    }
    Ok(json(&folder.join(".zattrs"))?.or_else(|| folder.join(".zgroup").is_file().then_some(Value::Null)))
}

fn image(multiscales: &Value, beside: Option<Beside>, warnings: &mut Vec<String>) -> Result<Image, ReadError> {
    let all: Vec<Value> = Vec::deserialize(multiscales).map_err(|e| bad("multiscales", multiscales, &e.to_string()))?;
    let first = all.first().ok_or(ReadError::MissingField("multiscales"))?;
    if all.len() > 1 {
        warnings.push(format!("it holds {} images in one folder; the first is read", all.len()));
    }
    let Multiscales { axes, datasets, transforms } =
        Multiscales::deserialize(first).map_err(|e| bad("multiscales", first, &e.to_string()))?;
    let finest = datasets.into_iter().next().ok_or(ReadError::MissingField("datasets"))?;
    let axes = match axes {
        Some(axes) => Axes(axes.iter().map(Axis::read).collect::<Result<_, _>>()?),
        None => Axes(["t", "c", "z", "y", "x"].map(Axis::named).into()),
    };
    let (mut scale, mut translation) = (None::<Vec<f64>>, vec![0.0; axes.len()]);
    // First those of the level, then those of all levels.
    for Transform { kind, scale: by, translation: to } in finest.transforms.into_iter().chain(transforms) {
        let is_whole =
            |numbers: &Option<Vec<f64>>| numbers.as_ref().is_some_and(|n| n.len() == axes.len() && n.iter().all(|v| v.is_finite()));
        match kind.as_str() {
            "identity" => {}
            "scale" if is_whole(&by) => {
                let by = by.unwrap_or_default();
                translation.iter_mut().zip(&by).for_each(|(t, s)| *t *= s);
                let before = scale.unwrap_or_else(|| vec![1.0; axes.len()]);
                scale = Some(before.iter().zip(&by).map(|(a, b)| a * b).collect());
            }
            "translation" if is_whole(&to) => translation.iter_mut().zip(to.unwrap_or_default()).for_each(|(t, by)| *t += by),
            _ => return Err(bad("coordinateTransformations", kind, "it must be a scale or a translation with a number for each axis")),
        }
    }
    Ok(Image { path: finest.path, axes, scale, translation, beside })
}

impl Image {
    /// How far samples are apart along i, j and k, and where the first lies along them, mm; `None` where it does not say.
    pub fn placed_mm(&self) -> Option<(DVec3, DVec3)> {
        let scale = self.scale.as_ref()?;
        let [k, j, i] = self.axes.space();
        let of = |numbers: &[f64]| DVec3::from([i, j, k].map(|axis| numbers[axis] * self.axes.0[axis].mm));
        Some((of(scale), of(&self.translation)))
    }
}

/// The axes of an array, the fastest last.
#[derive(Clone, Debug)]
pub struct Axes(Vec<Axis>);

#[derive(Clone, Debug)]
struct Axis {
    name: String,
    is_space: bool,
    mm: f64,
    has_unit: bool,
    /// The world direction that its samples go along, where it is stated.
    stated: Option<DVec3>,
}

impl Axis {
    fn named(name: &str) -> Self {
        let is_space = ["x", "y", "z"].iter().any(|n| name.eq_ignore_ascii_case(n));
        Self { name: name.to_owned(), is_space, mm: 1.0, has_unit: false, stated: None }
    }

    fn read(said: &Value) -> Result<Self, ReadError> {
        // Before version 0.4, axes were only names.
        if let Some(name) = said.as_str() {
            return Ok(Self::named(name));
        }
        let text = |key: &str| said.get(key).and_then(Value::as_str);
        let name = text("name").ok_or_else(|| bad("axes", said, "each needs a name"))?;
        let is_space = text("type").map_or_else(|| Self::named(name).is_space, |kind| kind == "space");
        let unit = text("unit").filter(|_| is_space);
        let mm = unit.map_or(Ok(1.0), |u| unit_mm(u).ok_or_else(|| bad("axes", u, "it is no unit of length")))?;
        // <https://ngff.openmicroscopy.org/rfc/4/>
        let stated = said.get("orientation").and_then(|o| o.get("value").unwrap_or(o).as_str()).and_then(|to| match to {
            "right-to-left" => Some(DVec3::X),
            "left-to-right" => Some(-DVec3::X),
            "anterior-to-posterior" => Some(DVec3::Y),
            "posterior-to-anterior" => Some(-DVec3::Y),
            "inferior-to-superior" | "caudal-to-cranial" => Some(DVec3::Z),
            "superior-to-inferior" | "cranial-to-caudal" => Some(-DVec3::Z),
            _ => None,
        });
        Ok(Self { name: name.to_owned(), is_space, mm, has_unit: unit.is_some(), stated })
    }
}

impl Axes {
    /// Of an array by itself: as its names say; without these the last three are z, y, x.
    pub fn of(names: &[Option<String>]) -> Result<Self, ReadError> {
        let named: Option<Vec<Axis>> = names.iter().map(|name| name.as_deref().map(Axis::named)).collect();
        let named = named.filter(|axes| axes.iter().filter(|axis| axis.is_space).count() == 3);
        let others = names.len().checked_sub(3);
        match (named, others) {
            (Some(axes), _) => Ok(Self(axes)),
            (None, Some(others)) => {
                let before = (0..others).map(|n| Axis::named(&format!("number {}", n + 1)));
                Ok(Self(before.chain(["z", "y", "x"].map(Axis::named)).collect()))
            }
            (None, None) => Err(ReadError::Unsupported(format!("its array has {} axes; a scan has three", names.len()))),
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// The numbers of the three in space, the fastest last.
    pub fn space(&self) -> [usize; 3] {
        let mut space = (0..self.0.len()).filter(|axis| self.0[*axis].is_space);
        std::array::from_fn(|n| space.next().unwrap_or(n))
    }

    /// Whether all three say the direction in the body.
    pub fn is_directed(&self) -> bool {
        self.space().iter().all(|axis| self.0[*axis].stated.is_some())
    }

    /// Whether all three have units.
    pub fn has_units(&self) -> bool {
        self.space().iter().all(|axis| self.0[*axis].has_unit)
    }

    /// The world directions of i, j and k: as stated, else x to the left, y to the back, z to the top.
    pub fn directions(&self) -> DMat3 {
        let along = |axis: usize| {
            let Axis { name, stated, .. } = &self.0[axis];
            stated.unwrap_or(match name.to_lowercase().as_str() {
                "x" => DVec3::X,
                "y" => DVec3::Y,
                _ => DVec3::Z,
            })
        };
        let [k, j, i] = self.space().map(along);
        DMat3::from_cols(i, j, k)
    }

    /// A sentence for each axis of which only the first is read.
    pub fn chosen(&self, shape: &[u64]) -> Vec<String> {
        let others = self.0.iter().zip(shape).filter(|(axis, n)| !axis.is_space && **n > 1);
        others.map(|(axis, n)| format!("of the {n} along its axis {} the first is read", axis.name)).collect()
    }

    /// The box of these slices, of the first along axes that are not in space.
    pub fn one(&self, shape: &[u64], slices: Range<u64>) -> Vec<Range<u64>> {
        let slowest = self.space()[0];
        let along = |(axis, n): (usize, &u64)| match axis {
            _ if axis == slowest => slices.clone(),
            _ if self.0[axis].is_space => 0..*n,
            _ => 0..1,
        };
        shape.iter().enumerate().map(along).collect()
    }

    /// Whether three of them are in space.
    pub fn are_a_volume(&self) -> bool {
        self.0.iter().filter(|axis| axis.is_space).count() == 3
    }
}
