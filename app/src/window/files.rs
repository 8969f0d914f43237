//! File dialogs, which run beside the window, and what is saved.

use super::cast::Found;
use super::history::Work;
use super::thickness_panel::Coat;
use crate::input::Session;
use crate::output::write_whole;
use crate::record::{Origin, to_json};
use bregma_measure::{DifferenceRay, export, landmarks};
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
    /// Folders that take the place of what is open.
    OpenFolder,
    /// Folders that join what is open.
    AddFolder,
    /// Where to save the session.
    Session,
    /// Where to save the picture.
    Picture,
    /// Where to save the difference rays.
    Rays,
    /// Where to save the landmarks.
    Landmarks,
    /// Where to save the map of thickness.
    Map,
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
                Ask::OpenFolder => dialog.set_title("Open folders of slices").pick_folders(),
                Ask::AddFolder => dialog.set_title("Add folders of slices").pick_folders(),
                Ask::Session => one(dialog.add_filter("Bregma session", &["json"]).set_file_name("session.json").save_file()),
                Ask::Picture => one(dialog.add_filter("PNG picture", &["png"]).set_file_name("picture.png").save_file()),
                Ask::Landmarks => one(dialog
                    .add_filter("CSV table", &["csv"])
                    .add_filter("3D Slicer markups", &["mrk.json"])
                    .add_filter("3D Slicer fiducials", &["fcsv"])
                    .add_filter("TPS", &["tps"])
                    .add_filter("morphologika", &["txt"])
                    .set_file_name("landmarks.csv")
                    .save_file()),
                Ask::Map => one(dialog
                    .add_filter("CSV table", &["csv"])
                    .add_filter("PLY surface", &["ply"])
                    .set_file_name("thickness.csv")
                    .save_file()),
                Ask::Rays => one(dialog
                    .add_filter("CSV table", &["csv"])
                    .add_filter("JSON", &["json"])
                    .add_filter("3D Slicer markups", &["mrk.json"])
                    .set_file_name("difference-rays.csv")
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
pub fn save_session(file: &Path, work: &Work, found: &[Found]) -> Result<String, String> {
    let folder = file.parent().unwrap_or(Path::new(""));
    let rays: Vec<DifferenceRay> = found.iter().map(|f| f.ray.clone()).collect();
    let landmarks = work.measured.landmarks.clone();
    let session = Session { measurements: records(work, &rays), landmarks, ..Session::of(&work.opened, folder) };
    let text = serde_json::to_string_pretty(&session).map_err(|e| format!("{}: {e}", file.display()))?;
    save(file, text.as_bytes())
}

/// The name in small letters, whose end says the form.
fn lower_name(file: &Path) -> String {
    file.file_name().unwrap_or_default().to_string_lossy().to_lowercase()
}

/// Saves all difference rays in the form that the file's name asks for.
pub fn save_rays(file: &Path, work: &Work, found: &[Found]) -> Result<String, String> {
    let name = lower_name(file);
    let rays: Vec<DifferenceRay> = found.iter().map(|f| f.ray.clone()).collect();
    let text = if name.ends_with(".mrk.json") {
        format!("{:#}\n", export::markups(&rays))
    } else if name.ends_with(".json") {
        // One record a line, as `bregma probe --rays` writes, so that `bregma verify` reads it.
        records(work, &rays).iter().map(|record| format!("{record}\n")).collect()
    } else if name.ends_with(".csv") {
        let rows = rays.iter().enumerate().map(|(n, ray)| export::csv_rows(n + 1, ray));
        format!("{}\n{}", export::CSV_HEADER, rows.collect::<String>())
    } else if name.ends_with(".txt") {
        rays.iter().map(|ray| export::table(ray) + "\n").collect()
    } else {
        return Err(format!("{}: end the name in .csv, .json, .mrk.json or .txt, so that its form is known", file.display()));
    };
    save(file, text.as_bytes())
}

/// The rays with their names and what they were measured on.
fn records(work: &Work, rays: &[DifferenceRay]) -> Vec<serde_json::Value> {
    let origin = Origin::of(&work.opened);
    let named = work.measured.rays.iter().zip(rays);
    named.map(|(named, ray)| to_json(ray, Some((&named.name, named.color)), origin.as_ref())).collect()
}

/// Saves all landmarks in the form that the file's name asks for.
pub fn save_landmarks(file: &Path, work: &Work) -> Result<String, String> {
    let name = lower_name(file);
    let points: Vec<landmarks::Named<'_>> = work.measured.landmarks.iter().map(|l| (l.name.as_str(), l.point_mm)).collect();
    let specimen = work.opened.volumes.first().map_or("", |v| v.name());
    let text = if name.ends_with(".mrk.json") {
        format!("{:#}\n", landmarks::markups(&points))
    } else if name.ends_with(".fcsv") {
        landmarks::fcsv(&points)
    } else if name.ends_with(".tps") {
        landmarks::tps(&points, specimen)
    } else if name.ends_with(".txt") {
        landmarks::morphologika(&points, specimen)
    } else if name.ends_with(".csv") {
        landmarks::csv(&points)
    } else {
        return Err(format!(
            "{}: end the name in .csv, .mrk.json, .fcsv, .tps or .txt (morphologika), so that its form is known",
            file.display()
        ));
    };
    save(file, text.as_bytes())
}

/// Saves a map of thickness in the form that the file's name asks for.
pub fn save_map(file: &Path, coat: &Coat) -> Result<String, String> {
    let (name, map) = (lower_name(file), &coat.map);
    if name.ends_with(".csv") {
        save(file, export::map_csv(&map.mesh, &map.values).as_bytes())
    } else if name.ends_with(".ply") {
        save(file, &export::map_ply(&map.mesh, &map.values, |mm| coat.scale.color(mm)))
    } else {
        Err(format!("{}: end the name in .csv or .ply, so that its form is known", file.display()))
    }
}

/// Saves the picture as it is shown; one that is painted with a map, with its legend.
pub fn save_picture(file: &Path, picture: &bregma_renderer::Picture, coat: Option<&Coat>) -> Result<String, String> {
    let Some(Coat { map, scale }) = coat else {
        return crate::output::write_png(file, picture).map(|()| saved(file)).map_err(|e| e.to_string());
    };
    let figure = crate::thickness::figure(picture, &map.title, scale, &map.statistics)
        .map_err(|e| format!("{}: the legend cannot be drawn ({e}); hide the map and save the picture alone", file.display()))?;
    crate::output::write_figure(file, figure).map(|()| saved(file)).map_err(|e| e.to_string())
}

fn save(file: &Path, bytes: &[u8]) -> Result<String, String> {
    write_whole(file, bytes).map(|()| saved(file)).map_err(|e| e.to_string())
}

fn saved(file: &Path) -> String {
    format!("Saved {}", file.display())
}

#[cfg(test)]
mod tests {
    use super::super::measured::Measured;
    use super::*;
    use crate::input::Opened;
    use bregma_field::WorldPoint;
    use bregma_renderer::Ray;
    use glam::DVec3;

    #[test]
    fn the_name_decides_the_form() {
        let folder = std::env::temp_dir().join(format!("bregma-files-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let mut work = Work { opened: Opened::new(vec![], vec![]), measured: Measured::default() };
        work.measured.add_ray(Ray { origin: WorldPoint(DVec3::ZERO), direction: DVec3::Z });
        work.measured.add_landmark(DVec3::new(1.0, 2.0, 3.0));
        let found = Found::refresh(vec![], &work).unwrap();
        let text = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
        let rays = |name: &str| save_rays(&folder.join(name), &work, &found).map(|_| text(name));
        assert!(rays("a.mrk.json").unwrap().contains("\"markups\""));
        assert!(rays("a.json").unwrap().contains("\"name\":\"Ray 1\""));
        assert!(rays("a.CSV").unwrap().starts_with(export::CSV_HEADER));
        assert!(rays("a.txt").unwrap().starts_with("ray from"));
        assert!(rays("a.doc").unwrap_err().contains("a.doc: end the name in .csv"));
        let points = |name: &str| save_landmarks(&folder.join(name), &work).map(|_| text(name));
        for (name, begins) in
            [("b.mrk.json", "{"), ("b.fcsv", "# Markups"), ("b.tps", "LM3=1"), ("b.txt", "[individuals]"), ("b.csv", "name,")]
        {
            assert!(points(name).unwrap().starts_with(begins), "{name}");
        }
        assert!(points("b.doc").unwrap_err().contains("b.doc: end the name in .csv"));
        std::fs::remove_dir_all(folder).unwrap();
    }
}
