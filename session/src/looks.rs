//! Whole looks: how a picture is made of scans, whichever they are. A look moves no isovalue, no scan, no cut and no view.

use crate::shelf::{Shelf, ShelfError};
use bregma_renderer::{Color, CutFace, Integrator, Layer, Light, Mode, Normals, Reconstruction, Scene, Shell, TransferFunction};
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// How one scan looks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScanLook {
    /// Of its surface.
    pub color: Color,
    /// Where it is transparent.
    pub opacity: f32,
    /// Of its surface seen from within.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inner_color: Option<Color>,
    /// Its further isosurfaces.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shells: Vec<Shell>,
    /// How its density is coloured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub transfer: Option<TransferFunction>,
}

/// How a picture is made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Look {
    /// What people call it.
    pub name: String,
    /// How the scans are put together.
    pub mode: Mode,
    /// What lies between samples.
    #[serde(default)]
    pub reconstruction: Reconstruction,
    /// The light.
    #[serde(default)]
    pub light: Light,
    /// Whether surfaces keep it from each other.
    #[serde(default)]
    pub shadows: bool,
    /// How much of the background the farthest takes on.
    #[serde(default)]
    pub depth_cue: f32,
    /// What cuts show.
    #[serde(default)]
    pub cut_face: CutFace,
    /// Whether numbers are of the gradient.
    #[serde(default)]
    pub of_gradient: bool,
    /// How density is integrated.
    #[serde(default)]
    pub integrator: Integrator,
    /// Which gradient shades.
    #[serde(default)]
    pub normals: Normals,
    /// Behind everything.
    #[serde(default)]
    pub background: Option<Color>,
    /// Of the scans, in their order.
    #[serde(default)]
    pub scans: Vec<ScanLook>,
}

/// Why there is no such look.
#[derive(Debug, Error)]
pub enum LookError {
    /// Neither a look's name nor a file.
    #[error("{0}: no look of that name and no file; save one in the window, or name its file")]
    Unknown(String),
    /// A file that is none.
    #[error("{}: is no look ({reason}); save it anew in the window", file.display())]
    Broken {
        /// The file.
        file: PathBuf,
        /// What is wrong and where.
        reason: String,
    },
}

/// Where they are kept: `bregma/looks` in the folder for settings.
pub fn shelf() -> Option<Shelf> {
    Shelf::of("looks")
}

/// All looks on a shelf with their files; files that cannot be read are left out, and reported.
pub fn all(shelf: &Shelf) -> (Vec<(PathBuf, Look)>, Vec<LookError>) {
    let (mut looks, mut errors) = (vec![], vec![]);
    for file in shelf.files() {
        match Look::read(&file) {
            Ok(look) => looks.push((file, look)),
            Err(error) => errors.push(error),
        }
    }
    (looks, errors)
}

/// The look of that name, or in that file.
pub fn find(name: &str) -> Result<Look, LookError> {
    let named = shelf().and_then(|shelf| all(&shelf).0.into_iter().find(|(_, look)| look.name == name));
    match named {
        Some((_, look)) => Ok(look),
        None if Path::new(name).is_file() => Look::read(Path::new(name)),
        None => Err(LookError::Unknown(name.into())),
    }
}

impl Look {
    /// Of a scene.
    pub fn of(scene: &Scene, name: &str) -> Self {
        let of = |layer: &Layer| ScanLook {
            color: layer.color,
            opacity: layer.opacity,
            inner_color: layer.inner_color,
            shells: layer.shells.clone(),
            transfer: layer.transfer.clone(),
        };
        Self {
            name: name.trim().into(),
            mode: scene.mode,
            reconstruction: scene.reconstruction,
            light: scene.light,
            shadows: scene.shadows,
            depth_cue: scene.depth_cue,
            cut_face: scene.cut_face,
            of_gradient: scene.of_gradient,
            integrator: scene.integrator,
            normals: scene.normals,
            background: scene.background,
            scans: scene.layers.iter().map(of).collect(),
        }
    }

    /// Gives it to a scene, and to as many of its scans as it knows.
    pub fn apply(&self, scene: &mut Scene) {
        (scene.mode, scene.reconstruction, scene.light, scene.shadows) = (self.mode, self.reconstruction, self.light, self.shadows);
        (scene.depth_cue, scene.cut_face, scene.of_gradient) = (self.depth_cue, self.cut_face, self.of_gradient);
        (scene.integrator, scene.normals, scene.background) = (self.integrator, self.normals, self.background);
        for (layer, look) in scene.layers.iter_mut().zip(&self.scans) {
            (layer.color, layer.opacity, layer.inner_color) = (look.color, look.opacity, look.inner_color);
            (layer.shells, layer.transfer) = (look.shells.clone(), look.transfer.clone());
        }
    }

    /// From a file.
    pub fn read(file: &Path) -> Result<Self, LookError> {
        let broken = |reason: String| LookError::Broken { file: file.to_owned(), reason };
        let text = fs::read_to_string(file).map_err(|e| broken(e.to_string()))?;
        let look: Self = serde_json::from_str(&text).map_err(|e| broken(e.to_string()))?;
        for transfer in look.scans.iter().filter_map(|scan| scan.transfer.clone()) {
            transfer.checked().map_err(|reason| broken(format!("its transfer function {reason}")))?;
        }
        Ok(look)
    }

    /// Puts it on a shelf under its name.
    pub fn save(&self, shelf: &Shelf) -> Result<PathBuf, ShelfError> {
        shelf.save(&self.name, &self.text())
    }

    /// Gives it, kept in `file`, another name there.
    pub fn rename(&self, shelf: &Shelf, file: &Path, name: &str) -> Result<PathBuf, ShelfError> {
        let renamed = Self { name: name.trim().into(), ..self.clone() };
        shelf.rename(file, &renamed.name, &renamed.text())
    }

    fn text(&self) -> String {
        serde_json::to_string_pretty(self).expect("a look has only numbers, texts and lists")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Opened;

    #[test]
    fn a_look_is_kept_by_name_and_moves_nothing_that_is_measured() {
        // Fails if a look forgets a part of itself in its file, or takes an isovalue, a pose, a cut or the view with it.
        let folder = std::env::temp_dir().join(format!("bregma-looks-{}", std::process::id()));
        let shelf = Shelf::at(&folder);
        let mut styled = Opened::demo(16, &Default::default()).unwrap().scene;
        let plain = styled.clone();
        (styled.mode, styled.shadows, styled.depth_cue, styled.background) = (Mode::Dvr, true, 0.4, None);
        styled.layers[1].transfer = Some(TransferFunction { overall: 0.5, ..TransferFunction::bone_in(Color([0.2, 0.4, 0.6])) });
        styled.layers[0].iso += 300.0;
        let look = Look::of(&styled, " dark ");
        let file = look.save(&shelf).unwrap();
        let (kept, errors) = all(&shelf);
        assert!(errors.is_empty() && kept.len() == 1 && kept[0].1.name == "dark");
        let mut scene = plain.clone();
        kept[0].1.apply(&mut scene);
        assert_eq!((scene.mode, scene.shadows, scene.background, scene.camera), (Mode::Dvr, true, None, plain.camera));
        let transfer = scene.layers[1].transfer.as_ref().unwrap();
        // Files have colours of eight bits.
        assert_eq!(
            (transfer.overall, transfer.points[0].color.bytes()),
            (0.5, styled.layers[1].transfer.as_ref().unwrap().points[0].color.bytes())
        );
        assert!(
            scene.layers.iter().zip(&plain.layers).all(|(a, b)| a.iso == b.iso && a.transform == b.transform && a.visible == b.visible)
        );
        let renamed = look.rename(&shelf, &file, "light").unwrap();
        assert_eq!((all(&shelf).0[0].1.name.as_str(), all(&shelf).0.len()), ("light", 1));
        fs::write(&renamed, "{\"name\": 3}").unwrap();
        assert!(all(&shelf).1[0].to_string().contains("is no look"));
        fs::remove_dir_all(folder).unwrap();
    }
}
