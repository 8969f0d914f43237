//! The part of a scan that is meant, as a person or a session names it.

use crate::labelled::{Labelled, PartOfError, space};
use bregma_field::{Progress, Volume};
use bregma_parts::Labels;
use bregma_renderer::{Layer, Within};
use serde::{Deserialize, Serialize};
use std::collections::{HashMap, HashSet};
use std::convert::Infallible;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;

/// Parts of a scan as a person names them: `FILE#NAME`, of several `FILE#NAME,NAME`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PartOf {
    /// The label map; in a session relative to the session's folder.
    pub file: PathBuf,
    /// Names of parts in it, or their numbers, with commas between; all of them where it is empty.
    pub names: String,
    /// Whether they are kept, and not all that lies beside them.
    pub keeps: bool,
    /// All of the scan is meant: the label map only says what its parts are.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub whole: bool,
    /// The isovalue at which bone without a label is another part's; that of the scan's layer when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub iso: Option<f64>,
    /// How far it is grown, mm; shrunk where negative. What the scan's layer says of it goes before.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub grow_mm: f64,
    /// How far behind its face normals are blended, mm.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub rim_mm: f64,
}

fn is_zero(n: &f64) -> bool {
    *n == 0.0
}

impl FromStr for PartOf {
    type Err = Infallible;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let (file, names) = text.rsplit_once('#').unwrap_or((text, ""));
        Ok(Self { file: file.into(), names: names.into(), keeps: true, whole: false, iso: None, grow_mm: 0.0, rim_mm: 0.0 })
    }
}

impl PartOf {
    /// What of a label map in a file is kept, as a session names it.
    pub fn kept_of(labelled: &Labelled, file: PathBuf) -> Self {
        let mut uses = HashMap::new();
        labelled.parts().iter().for_each(|part| *uses.entry(part.name.as_str()).or_insert(0) += 1);
        // A name that several have, or that is read as several, is said by its number.
        let is_clear = |name: &str| uses[name] == 1 && !name.is_empty() && name.trim() == name && !name.contains(',');
        let names: Vec<String> =
            labelled.kept().map(|part| if is_clear(&part.name) { part.name.clone() } else { part.number.to_string() }).collect();
        let whole = labelled.left_out().is_empty();
        Self {
            file,
            names: if whole { String::new() } else { names.join(",") },
            keeps: true,
            whole,
            iso: Some(labelled.iso()),
            grow_mm: 0.0,
            rim_mm: 0.0,
        }
    }

    /// The label map, what of the scan of a layer is meant, looked at as the layer says if it does, and what there is to say of the map.
    pub(crate) fn find(&self, volume: &Arc<Volume>, layer: &Layer, progress: &Progress) -> Result<Found, PartOfError> {
        let iso = self.iso.unwrap_or(layer.iso);
        let (labels, notes) = bregma_parts::read(&self.file, volume, progress)?;
        if self.whole {
            return Ok((Labelled::new(labels, volume, iso), None, notes));
        }
        let numbers = self.numbers(&labels)?;
        let known = layer.within.clone().unwrap_or_else(|| Within {
            part: if self.names.is_empty() { "all parts".into() } else { self.names.clone() },
            keeps: self.keeps,
            grow_mm: self.grow_mm,
            rim_mm: self.rim_mm,
            measures: true,
            solid: None,
        });
        let solid = space(&labels, &numbers, known.grow_mm, (volume, iso), progress)?;
        let solid = if known.keeps { solid } else { solid.inverse() };
        let named: HashSet<u16> = numbers.into_iter().collect();
        let is_left_out = |number: &u16| named.contains(number) != known.keeps;
        let left_out = labels.parts().iter().map(|part| part.number).filter(is_left_out).collect();
        Ok((Labelled::new(labels, volume, iso).without(left_out), Some(Within { solid: Some(Arc::new(solid)), ..known }), notes))
    }

    fn numbers(&self, labels: &Labels) -> Result<Vec<u16>, PartOfError> {
        let parts = labels.parts();
        if parts.is_empty() {
            return Err(PartOfError::Empty(self.file.clone()));
        }
        if self.names.is_empty() {
            return Ok(parts.iter().map(|part| part.number).collect());
        }
        // A name may have a comma itself.
        let whole: Vec<u16> = parts.iter().filter(|part| part.name == self.names).map(|part| part.number).collect();
        if !whole.is_empty() {
            return Ok(whole);
        }
        // Of two parts of one name the first has it.
        let by_name: HashMap<&str, u16> = parts.iter().rev().map(|part| (part.name.as_str(), part.number)).collect();
        let by_number = |name: &str| name.parse().ok().filter(|number| parts.iter().any(|part| part.number == *number));
        let find = |name: &str| {
            let number = by_name.get(name).copied().or_else(|| by_number(name));
            number.ok_or_else(|| {
                let there = parts.iter().map(|part| part.name.as_str()).collect::<Vec<_>>().join(", ");
                PartOfError::NoPart { file: self.file.clone(), name: name.to_owned(), there }
            })
        };
        self.names.split(',').map(|name| find(name.trim())).collect()
    }

    /// The same named from the root on.
    pub fn absolute(&self) -> Self {
        Self { file: std::path::absolute(&self.file).unwrap_or_else(|_| self.file.clone()), ..self.clone() }
    }

    /// The same named relative to `folder` where it lies below it.
    pub fn below(&self, folder: &Path) -> Self {
        let whole = self.absolute();
        Self { file: whole.file.strip_prefix(folder).map(Path::to_owned).unwrap_or(whole.file.clone()), ..whole }
    }
}

/// A label map, what of its scan is kept, and what there is to say of the map.
type Found = (Labelled, Option<Within>, Vec<String>);
