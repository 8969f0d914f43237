//! Ready-made looks: transfer functions with further isosurfaces, each a small file. Those of the program are built in; users' own lie beside its
//! settings and go before them. A look is how a scan is seen, and never what is measured of it.

use crate::shelf::{Shelf, ShelfError};
use bregma_field::Volume;
use bregma_renderer::{Color, Layer, Shell, TransferFunction, Values};
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// An isosurface of a preset; its value is of the kind that the preset's points are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PresetSurface {
    /// Where.
    pub value: f64,
    /// `RRGGBB`.
    pub color: String,
    /// 0 to 1.
    pub opacity: f32,
}

/// A look.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Preset {
    /// Colour and opacity for direct volume rendering.
    #[serde(flatten)]
    pub transfer: TransferFunction,
    /// Isosurfaces, from the outside in; the last one stands for the layer's own, whose isovalue, colour and opacity are left to the person.
    #[serde(default)]
    pub surfaces: Vec<PresetSurface>,
}

/// Why there is no such preset.
#[derive(Debug, Error)]
pub enum PresetError {
    /// Neither a preset's name nor a file.
    #[error("{name}: no preset and no file; there are {known}, or write a file as docs/modes.md says{broken}")]
    Unknown {
        /// As it was asked for.
        name: String,
        /// The names.
        known: String,
        /// What is wrong with files that may have been meant.
        broken: String,
    },
    /// A file that is not what it should be.
    #[error("{}: {reason}", file.display())]
    Broken {
        /// The file.
        file: PathBuf,
        /// What is wrong and where.
        reason: String,
    },
}

const BUILT_IN: [&str; 5] = [
    include_str!("../presets/bone.json"),
    include_str!("../presets/skin-and-bone.json"),
    include_str!("../presets/dry-skull.json"),
    include_str!("../presets/mummy.json"),
    include_str!("../presets/micro-ct.json"),
];

/// Where users keep their own: `bregma/presets` in the folder for settings.
pub fn shelf() -> Option<Shelf> {
    Shelf::of("presets")
}

/// Users' own, with their files; those that cannot be read are left out.
pub fn own() -> Vec<(PathBuf, Preset)> {
    let files = shelf().map(|shelf| shelf.files()).unwrap_or_default();
    files.into_iter().filter_map(|file| read(&file).ok().map(|preset| (file, preset))).collect()
}

/// All presets by name, users' own first; files that cannot be read are left out, and reported.
pub fn all() -> (Vec<Preset>, Vec<PresetError>) {
    let (mut presets, mut errors) = (vec![], vec![]);
    for file in shelf().map(|shelf| shelf.files()).unwrap_or_default() {
        match read(&file) {
            Ok(preset) => presets.push(preset),
            Err(error) => errors.push(error),
        }
    }
    presets.extend(BUILT_IN.into_iter().filter_map(|text| parse(text, "").ok()));
    (presets, errors)
}

/// The preset of that name, or in that file.
pub fn find(name: &str) -> Result<Preset, PresetError> {
    let (presets, errors) = all();
    // The micro sign, the Greek letter, and what a keyboard without either has.
    let plain = |name: &str| name.to_lowercase().replace(' ', "-").replace(['µ', 'μ'], "u");
    let same = |preset: &Preset| plain(&preset.transfer.name) == plain(name);
    if let Some(preset) = presets.iter().find(|p| same(p)) {
        return Ok(preset.clone());
    }
    if Path::new(name).exists() {
        return read(Path::new(name));
    }
    let known = presets.iter().map(|p| p.transfer.name.as_str()).collect::<Vec<_>>().join(", ");
    let broken = errors.iter().map(|e| format!("; {e}")).collect();
    Err(PresetError::Unknown { name: name.into(), known, broken })
}

fn read(file: &Path) -> Result<Preset, PresetError> {
    let broken = |reason: String| PresetError::Broken { file: file.to_owned(), reason };
    let text = fs::read_to_string(file).map_err(|e| broken(format!("cannot be read ({e})")))?;
    let name = file.file_stem().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    parse(&text, &name).map_err(broken)
}

fn parse(text: &str, name: &str) -> Result<Preset, String> {
    let transfer = TransferFunction::read(text, name)?;
    let surfaces = if text.trim_start().starts_with('{') {
        let preset: Preset = serde_json::from_str(text).map_err(|e| format!("is no preset: {e}"))?;
        preset.surfaces
    } else {
        vec![]
    };
    match surfaces.iter().find(|s| Color::from_hex(&s.color).is_none() || !(0.0..=1.0).contains(&s.opacity)) {
        Some(s) => Err(format!("its surface at {} has no colour RRGGBB, or an opacity that is not between 0 and 1", s.value)),
        None => Ok(Preset { transfer, surfaces }),
    }
}

impl Preset {
    /// The look that a layer has.
    pub fn of(layer: &Layer, volume: &Volume) -> Self {
        let transfer = layer.transfer_function();
        let (low, own) = (volume.range()[0], layer.iso);
        let value = |iso: f64| match transfer.values {
            Values::Scan => iso,
            Values::Isovalue if own != low => (iso - low) / (own - low),
            Values::Isovalue => 1.0,
        };
        let surface = |iso: f64, color: Color, opacity: f32| PresetSurface { value: value(iso), color: color.hex(), opacity };
        let further = layer.shells.iter().map(|shell| surface(shell.iso, shell.color, shell.opacity));
        let surfaces = further.chain([surface(own, layer.color, layer.opacity)]).collect();
        Self { transfer, surfaces }
    }

    /// The same under another name.
    pub fn named(mut self, name: &str) -> Self {
        name.trim().clone_into(&mut self.transfer.name);
        self
    }

    /// Puts it on a shelf under its name.
    pub fn save(&self, shelf: &Shelf) -> Result<PathBuf, ShelfError> {
        shelf.save(&self.transfer.name, &self.text())
    }

    /// Gives it, kept in `file`, another name there.
    pub fn rename(&self, shelf: &Shelf, file: &Path, name: &str) -> Result<PathBuf, ShelfError> {
        let renamed = self.clone().named(name);
        shelf.rename(file, &renamed.transfer.name, &renamed.text())
    }

    fn text(&self) -> String {
        serde_json::to_string_pretty(self).expect("a preset has only numbers, texts and lists")
    }

    /// Gives a layer this look: its transfer function, and its further isosurfaces where it has any. What is measured stays as it is, and so do
    /// the colour and the opacity that tell scans apart: the last of the preset's surfaces stands for the layer's own.
    pub fn apply(&self, layer: &mut Layer, volume: &Volume) {
        let (low, own_iso) = (volume.range()[0], layer.iso);
        let value = |v: f64| match self.transfer.values {
            Values::Scan => v,
            Values::Isovalue => low + v * (own_iso - low),
        };
        layer.transfer = Some(self.transfer.clone());
        let shell = |s: &PresetSurface| Color::from_hex(&s.color).map(|color| Shell { iso: value(s.value), color, opacity: s.opacity });
        if let [further @ .., _] = &self.surfaces[..] {
            layer.shells = further.iter().filter_map(shell).collect();
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]
    use super::*;

    #[test]
    fn the_look_of_a_scan_is_put_on_a_shelf_and_taken_from_it() {
        // Fails if a transfer function, its overall opacity or a further surface is lost on the way, or comes to lie at another value.
        let folder = std::env::temp_dir().join(format!("bregma-presets-{}", std::process::id()));
        let shelf = Shelf::at(&folder);
        let opened = crate::Opened::demo(16, &Default::default()).unwrap();
        let (volume, mut layer) = (&opened.volumes[1], opened.scene.layers[1].clone());
        for values in [Values::Isovalue, Values::Scan] {
            let mut transfer = TransferFunction { values, overall: 2.5, ..TransferFunction::bone() };
            transfer.points.iter_mut().for_each(|p| p.color = Color::from_hex(&p.color.hex()).unwrap());
            layer.transfer = Some(transfer);
            layer.shells = vec![Shell { iso: -150.0, color: Color::from_hex("d9a184").unwrap(), opacity: 0.25 }];
            let file = Preset::of(&layer, volume).named("mine").save(&shelf).unwrap();
            let mut other = opened.scene.layers[1].clone();
            read(&file).unwrap().apply(&mut other, volume);
            let shell = other.shells[0];
            assert!((shell.iso + 150.0).abs() < 1e-9 && shell.color == layer.shells[0].color && shell.opacity == 0.25);
            let taken = other.transfer.unwrap();
            assert_eq!((taken.name.as_str(), taken.overall, &taken.points), ("mine", 2.5, &layer.transfer.as_ref().unwrap().points));
        }
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn every_built_in_preset_is_one() {
        // Fails if a file has a mistake: it would be missing from the list without a word.
        for text in BUILT_IN {
            let preset = parse(text, "").unwrap();
            assert!(!preset.transfer.name.is_empty() && !preset.surfaces.is_empty());
            assert_eq!(find(&preset.transfer.name).unwrap(), preset);
        }
        assert!(find("nonsense").unwrap_err().to_string().contains("skin and bone"));
    }

    #[test]
    fn a_look_moves_no_isovalue_and_no_identity() {
        // Fails if a look changes what is measured, or the colour or opacity by which a scan is known in a comparison.
        let opened = crate::Opened::demo(8, &Default::default()).unwrap();
        let mut tables = vec![parse("-200 0 0 0 0\n300 255 128 0 0.5\n", "table").unwrap()];
        tables.extend(BUILT_IN.iter().map(|text| parse(text, "").unwrap()));
        for preset in tables {
            let before = Layer { iso: 226.0, opacity: 0.4, ..opened.scene.layers[1].clone() };
            let mut after = before.clone();
            preset.apply(&mut after, &opened.volumes[1]);
            assert_eq!(after.transfer.as_ref(), Some(&preset.transfer));
            assert_eq!(after.shells.len(), preset.surfaces.len().saturating_sub(1), "{}", preset.transfer.name);
            assert_eq!(
                Layer { transfer: before.transfer.clone(), shells: before.shells.clone(), ..after },
                before,
                "{}",
                preset.transfer.name
            );
        }
    }

    #[test]
    fn tables_of_lines_are_read_and_their_mistakes_named() {
        // Fails if the older program's tables, or what is wrong with one, are not understood.
        let table = "# value r g b a\n-200 0 0 0 0\n300; 255; 128; 0; 0.5  # bone\n1000,255,255,255,1\n";
        let preset = parse(table, "old").unwrap();
        assert_eq!((preset.transfer.name.as_str(), preset.transfer.points.len()), ("old", 3));
        assert_eq!(preset.transfer.points[1].opacity, 0.5);
        for (broken, says) in [
            ("1 2 3\n", "line 1"),
            ("1 0 0 0 2\n", "between 0 and 1"),
            ("5 0 0 0 0\n4 0 0 0 0\n", "ascend"),
            ("", "no points"),
            ("{\"name\": 3}", "no transfer function"),
        ] {
            assert!(parse(broken, "x").unwrap_err().contains(says), "{broken}");
        }
    }
}
