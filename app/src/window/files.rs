//! File dialogs, which run beside the window, and what is saved.

use super::history::Work;
use crate::input::Session;
use crate::output::write_whole;
use bregma_measure::{DifferenceRay, export};
use egui::Context;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// What a dialog asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ask {
    /// Files that take the place of what is open.
    Open,
    /// Files that join what is open.
    Add,
    /// Where to save the session.
    Session,
    /// Where to save the picture.
    Picture,
    /// Where to save the difference ray.
    Ray,
}

/// A dialog on the screen.
#[derive(Debug)]
pub struct Dialog {
    ask: Ask,
    since: Instant,
    answer: Receiver<Option<Vec<PathBuf>>>,
}

/// No person cancels a dialog so fast: it never appeared.
const TOO_FAST: Duration = Duration::from_millis(300);

impl Dialog {
    /// Opens it.
    pub fn open(ctx: &Context, ask: Ask) -> Self {
        let (send, answer) = channel();
        let ctx = ctx.clone();
        std::thread::spawn(move || {
            let dialog = rfd::FileDialog::new();
            let one = |path: Option<PathBuf>| path.map(|p| vec![p]);
            let picked = match ask {
                Ask::Open => dialog.set_title("Open scans or a session").pick_files(),
                Ask::Add => dialog.set_title("Add scans").pick_files(),
                Ask::Session => one(dialog.add_filter("Bregma session", &["json"]).set_file_name("session.json").save_file()),
                Ask::Picture => one(dialog.add_filter("PNG picture", &["png"]).set_file_name("picture.png").save_file()),
                Ask::Ray => one(dialog
                    .add_filter("CSV table", &["csv"])
                    .add_filter("JSON", &["json"])
                    .add_filter("3D Slicer markups", &["mrk.json"])
                    .set_file_name("difference-ray.csv")
                    .save_file()),
            };
            // The window may have closed meanwhile.
            let _ = send.send(picked);
            ctx.request_repaint();
        });
        Self { ask, since: Instant::now(), answer }
    }

    /// What was chosen: `None` while the dialog is open, no paths when it was cancelled; `Err` when it could not be shown.
    pub fn poll(&self) -> Option<Result<(Ask, Vec<PathBuf>), &'static str>> {
        let answer = match self.answer.try_recv() {
            Ok(answer) => answer,
            Err(std::sync::mpsc::TryRecvError::Empty) => return None,
            Err(std::sync::mpsc::TryRecvError::Disconnected) => None,
        };
        Some(match answer {
            None if self.since.elapsed() < TOO_FAST => Err(
                "This desktop shows no file dialog (it has no portal and no zenity): drop files on the window, or name them on the command line.",
            ),
            picked => Ok((self.ask, picked.unwrap_or_default())),
        })
    }
}

/// Saves scans and scene. Gives what to tell the person.
pub fn save_session(file: &Path, work: &Work) -> Result<String, String> {
    let folder = file.parent().unwrap_or(Path::new(""));
    let text = serde_json::to_string_pretty(&Session::of(&work.opened, folder)).map_err(|e| format!("{}: {e}", file.display()))?;
    save(file, text.as_bytes())
}

/// Saves the difference ray in the form that the file's name asks for.
pub fn save_ray(file: &Path, ray: &DifferenceRay) -> Result<String, String> {
    let name = file.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    let pretty = |value: serde_json::Result<String>| value.map_err(|e| format!("{}: {e}", file.display()));
    let text = if name.ends_with(".mrk.json") {
        pretty(serde_json::to_string_pretty(&export::markups(std::slice::from_ref(ray))))?
    } else if name.ends_with(".json") {
        pretty(serde_json::to_string_pretty(ray))?
    } else if name.ends_with(".csv") {
        format!("{}\n{}", export::CSV_HEADER, export::csv_rows(1, ray))
    } else if name.ends_with(".txt") {
        export::table(ray)
    } else {
        return Err(format!("{}: end the name in .csv, .json, .mrk.json or .txt, so that its form is known", file.display()));
    };
    save(file, text.as_bytes())
}

/// Saves the picture as it is shown.
pub fn save_picture(file: &Path, picture: &bregma_renderer::Picture) -> Result<String, String> {
    crate::output::write_png(file, picture).map(|()| saved(file)).map_err(|e| e.to_string())
}

fn save(file: &Path, bytes: &[u8]) -> Result<String, String> {
    write_whole(file, bytes).map(|()| saved(file)).map_err(|e| e.to_string())
}

fn saved(file: &Path) -> String {
    format!("Saved {}", file.display())
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_measure::probe;
    use bregma_renderer::Ray;
    use bregma_volume::WorldPoint;
    use glam::DVec3;

    #[test]
    fn the_name_decides_the_form() {
        let folder = std::env::temp_dir().join(format!("bregma-files-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let ray = probe(&[], &[], &Ray { origin: WorldPoint(DVec3::ZERO), direction: DVec3::Z }).unwrap();
        let written = |name: &str| {
            let file = folder.join(name);
            save_ray(&file, &ray).map(|_| std::fs::read_to_string(file).unwrap())
        };
        assert!(written("a.mrk.json").unwrap().contains("\"markups\""));
        assert!(written("a.json").unwrap().contains("\"ledger\""));
        assert!(written("a.CSV").unwrap().starts_with(export::CSV_HEADER));
        assert!(written("a.txt").unwrap().starts_with("ray from"));
        assert!(written("a.doc").unwrap_err().contains("a.doc: end the name in .csv"));
        std::fs::remove_dir_all(folder).unwrap();
    }
}
