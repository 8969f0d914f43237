//! What the window remembers from one run of the program to the next: its size and place, what was opened, and what is preferred.

use super::preferences::Preferences;
use bregma_session::output::write_whole;
use egui::{Context, Pos2, Vec2, ViewportBuilder};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// As many as a menu shows without scrolling.
const MOST: usize = 12;

/// Size and place of the window, in points, what was opened, the newest first, and what the person prefers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Remembered {
    #[serde(default)]
    size: Option<[f32; 2]>,
    #[serde(default)]
    position: Option<[f32; 2]>,
    #[serde(default)]
    maximized: bool,
    /// What was opened together.
    #[serde(default)]
    recent: Vec<Vec<PathBuf>>,
    /// What the person prefers.
    #[serde(default)]
    pub preferences: Preferences,
    #[serde(skip)]
    file: Option<PathBuf>,
}

/// Where the program keeps what it can do without: `bregma` in the folder for states.
pub fn state_folder() -> Option<PathBuf> {
    let set = |name| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let states = set("XDG_STATE_HOME").or_else(|| set("LOCALAPPDATA")).or_else(|| set("HOME").map(|home| home.join(".local/state")));
    states.map(|folder| folder.join("bregma"))
}

impl Remembered {
    /// What was written to `folder`; nothing where there is none, or it cannot be read: it is no loss.
    pub fn read(folder: Option<&Path>) -> Self {
        let file = folder.map(|folder| folder.join("window.json"));
        let text = file.as_ref().and_then(|file| std::fs::read(file).ok());
        let read: Self = text.and_then(|text| serde_json::from_slice(&text).ok()).unwrap_or_default();
        Self { file, ..read }
    }

    /// A window of the size and at the place that it had.
    pub fn place(&self, mut window: ViewportBuilder, least: [f32; 2], usual: [f32; 2]) -> ViewportBuilder {
        let size = Vec2::from(self.size.unwrap_or(usual)).max(least.into());
        window = window.with_min_inner_size(least).with_inner_size(size).with_maximized(self.maximized);
        match self.position {
            Some(at) => window.with_position(Pos2::from(at)),
            None => window,
        }
    }

    /// What was opened, the newest first.
    pub fn recent(&self) -> &[Vec<PathBuf>] {
        &self.recent
    }

    /// These were opened together.
    pub fn opened(&mut self, paths: &[PathBuf]) {
        let paths: Vec<PathBuf> = paths.iter().map(|p| std::path::absolute(p).unwrap_or_else(|_| p.clone())).collect();
        if paths.is_empty() {
            return;
        }
        self.recent.retain(|known| *known != paths);
        self.recent.insert(0, paths);
        self.recent.truncate(MOST);
        self.write();
    }

    /// Takes note of where the window is; it is written when the program ends.
    pub fn look(&mut self, ctx: &Context) {
        let viewport = ctx.input(|i| i.viewport().clone());
        if viewport.fullscreen == Some(true) {
            return;
        }
        self.maximized = viewport.maximized.unwrap_or(false);
        if !self.maximized {
            self.size = viewport.inner_rect.map(|r| r.size().into()).or(self.size);
            self.position = viewport.outer_rect.map(|r| r.min.into()).or(self.position);
        }
    }

    /// Writes it, where there is a place; that this fails is no loss either.
    pub fn write(&self) {
        if let Some(file) = &self.file
            && let Ok(text) = serde_json::to_vec_pretty(self)
        {
            let _ = std::fs::create_dir_all(file.parent().unwrap_or(Path::new("")));
            let _ = write_whole(file, &text);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_opened_last_comes_first_and_once() {
        // Fails if a file is listed twice, the list grows for ever, or a damaged file is more than forgotten.
        let folder = std::env::temp_dir().join(format!("bregma-remembered-{}", std::process::id()));
        let mut remembered = Remembered::read(Some(&folder));
        for n in (0..30).chain([5]) {
            remembered.opened(&[PathBuf::from(format!("/scans/{n}.nrrd"))]);
        }
        let read = Remembered::read(Some(&folder));
        assert_eq!(read, remembered);
        assert_eq!((read.recent().len(), &read.recent()[0][0]), (MOST, &PathBuf::from("/scans/5.nrrd")));
        assert_eq!(read.recent().iter().filter(|r| **r == read.recent()[0]).count(), 1);
        std::fs::write(folder.join("window.json"), "{\"recent\": 3").unwrap();
        assert!(Remembered::read(Some(&folder)).recent().is_empty());
        std::fs::remove_dir_all(folder).unwrap();
    }
}
