//! What is saved in the form that its file's name asks for.

use crate::chart;
use crate::difference_picture::DifferenceCoat;
use crate::difference_report::html;
use crate::measurement::Measurement;
use crate::measurement::Origin;
use crate::output::{OutputError, write_whole};
use crate::print::{FileError, write_figure};
use crate::section::Measured;
use crate::thickness::ThicknessCoat;
use bregma_measure::corrections;
use bregma_measure::csv::{self, Made};
use bregma_measure::export::{self, Named};
use bregma_measure::landmarks::{self, Landmark};
use bregma_measure::table_style::{TableStyle, styled};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Why nothing was saved.
#[derive(Debug, Error)]
pub enum SaveError {
    /// The file cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// Its name says no form.
    #[error("{}: end the name in {forms}, so that its form is known", file.display())]
    Form {
        /// The file.
        file: PathBuf,
        /// The endings that say one.
        forms: &'static str,
    },
    /// A picture that cannot be written.
    #[error(transparent)]
    Picture(#[from] FileError),
    /// A chart that cannot be drawn.
    #[error("{}: the chart cannot be drawn ({reason}); save the table", file.display())]
    Chart {
        /// The file.
        file: PathBuf,
        /// What went wrong.
        reason: Box<dyn std::error::Error>,
    },
}

/// The name in small letters, whose end says the form.
fn lower_name(file: &Path) -> String {
    file.file_name().unwrap_or_default().to_string_lossy().to_lowercase()
}

/// Saves difference rays by their names, tables in a style; `made` is what they were made by, and `records` are the same with what they were made
/// from.
pub fn rays(
    file: &Path,
    rays: &[Named<'_>],
    made: &Made,
    style: TableStyle,
    records: impl FnOnce() -> Vec<Measurement>,
) -> Result<(), SaveError> {
    let name = lower_name(file);
    let text = if name.ends_with(".mrk.json") {
        format!("{:#}\n", export::markups(rays))
    } else if name.ends_with(".json") {
        // One record a line, as `bregma probe --rays` writes, so that `bregma verify` reads it.
        records().iter().map(|record| format!("{record}\n")).collect()
    } else if name.ends_with(".csv") {
        styled(&csv::rays(rays, made), style)
    } else if name.ends_with(".txt") {
        rays.iter().map(|ray| format!("{}: {}\n", ray.name, export::table(ray.found))).collect()
    } else {
        return Err(SaveError::Form { file: file.to_owned(), forms: ".csv, .json, .mrk.json or .txt" });
    };
    Ok(write_whole(file, text.as_bytes())?)
}

/// Saves landmarks of a specimen, with what they were set by; all forms are read again, so that tables have mm and points.
pub fn landmarks(file: &Path, points: &[Landmark], specimen: &str, made: &Made) -> Result<(), SaveError> {
    let name = lower_name(file);
    let text = if name.ends_with(".mrk.json") {
        format!("{:#}\n", landmarks::markups(points, &made.notes))
    } else if name.ends_with(".fcsv") {
        landmarks::fcsv(points, &made.notes)
    } else if name.ends_with(".tps") {
        landmarks::tps(points, specimen, &made.notes)
    } else if name.ends_with(".txt") {
        landmarks::morphologika(points, specimen)
    } else if name.ends_with(".csv") {
        landmarks::csv(points, made)
    } else {
        return Err(SaveError::Form { file: file.to_owned(), forms: ".csv, .mrk.json, .fcsv, .tps or .txt (morphologika)" });
    };
    Ok(write_whole(file, text.as_bytes())?)
}

/// Saves a map of thickness, as a table in a style.
pub fn map(file: &Path, ThicknessCoat { map, scale }: &ThicknessCoat, style: TableStyle) -> Result<(), SaveError> {
    let name = lower_name(file);
    if name.ends_with(".csv") {
        Ok(write_whole(file, styled(&export::map_csv(&map.mesh, &map.values), style).as_bytes())?)
    } else if name.ends_with(".ply") {
        Ok(write_whole(file, &export::map_ply(&map.mesh, &map.values, &corrections(&map.surface.volume), |mm| scale.color(mm)))?)
    } else {
        Err(SaveError::Form { file: file.to_owned(), forms: ".csv or .ply" })
    }
}

/// Saves a map of differences: the surface that is shown as a table in a style or as PLY, both as a report with these pictures (PNG, each with its
/// caption) or as a record.
pub fn difference(
    file: &Path,
    coat: &DifferenceCoat,
    figures: &[(String, Vec<u8>)],
    made_by: Option<&Origin>,
    style: TableStyle,
) -> Result<(), SaveError> {
    let (name, half, measured) = (lower_name(file), coat.half(), &coat.measured);
    let (values, errors) = (&half.map.values_mm, &half.map.errors_mm);
    if name.ends_with(".csv") {
        let table = export::difference_csv(&half.mesh, &half.map, &half.asked);
        Ok(write_whole(file, styled(&table, style).as_bytes())?)
    } else if name.ends_with(".ply") {
        let notes: Vec<String> = std::iter::once(measured.legend()).chain(measured.notes.iter().cloned()).collect();
        Ok(write_whole(
            file,
            &export::ply(&half.mesh, &notes, |n| coat.vertex_color(n), &[("difference_mm", values), ("error_mm", errors)]),
        )?)
    } else if name.ends_with(".html") {
        Ok(write_whole(file, html(measured, figures, made_by).as_bytes())?)
    } else if name.ends_with(".json") {
        let record = serde_json::to_string_pretty(&measured.record(made_by)).expect("a record has only numbers, texts and lists");
        Ok(write_whole(file, record.as_bytes())?)
    } else {
        Err(SaveError::Form { file: file.to_owned(), forms: ".csv, .ply, .html or .json" })
    }
}

/// Saves a section: its chart as PNG or SVG, its table in a style, or its record.
pub fn section(file: &Path, measured: &Measured, made: &Made, made_by: Option<&Origin>, style: TableStyle) -> Result<(), SaveError> {
    let name = lower_name(file);
    let unplotted = |reason| SaveError::Chart { file: file.to_owned(), reason };
    if name.ends_with(".png") {
        Ok(write_figure(file, &chart::section::pixels(&measured.told).map_err(unplotted)?)?)
    } else if name.ends_with(".svg") {
        Ok(write_whole(file, chart::section::svg(&measured.told).map_err(unplotted)?.as_bytes())?)
    } else if name.ends_with(".csv") {
        Ok(write_whole(file, styled(&measured.csv(made), style).as_bytes())?)
    } else if name.ends_with(".json") {
        let record = serde_json::to_string_pretty(&measured.record(made_by)).expect("a record has only numbers, texts and lists");
        Ok(write_whole(file, record.as_bytes())?)
    } else {
        Err(SaveError::Form { file: file.to_owned(), forms: ".png, .svg, .csv or .json" })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::opened::Opened;
    use crate::record::measure;
    use crate::thickness::Order;
    use crate::thickness_picture::{Colors, Scale};
    use bregma_field::{Progress, WorldPoint};
    use bregma_measure::thickness::Method;
    use bregma_renderer::{Color, Ray};
    use glam::DVec3;
    use std::fs;
    use std::sync::Arc;

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("bregma-{name}-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        folder
    }

    #[test]
    fn the_name_decides_the_form() {
        let folder = folder("save");
        let found = measure(&Opened::new(vec![], vec![]), &Ray { origin: WorldPoint(DVec3::ZERO), direction: DVec3::Z }, false).unwrap();
        let records = || vec![Measurement::of_ray(&found, Some(("Ray 1", Some(Color([1.0; 3])))), None)];
        let text = |name: &str| fs::read_to_string(folder.join(name)).unwrap();
        let rays = |name: &str| {
            rays(&folder.join(name), &[Named { name: "Ray 1", found: &found }], &Made::default(), TableStyle::default(), records)
                .map(|()| text(name))
        };
        assert!(rays("a.mrk.json").unwrap().contains("\"markups\""));
        assert!(rays("a.json").unwrap().contains("\"name\":\"Ray 1\""));
        assert!(rays("a.CSV").unwrap().starts_with("kind,ray,name,"));
        assert!(rays("a.txt").unwrap().starts_with("Ray 1: ray from"));
        assert!(rays("a.doc").unwrap_err().to_string().contains("a.doc: end the name in .csv"));
        let point = [Landmark::at("L1", DVec3::new(1.0, 2.0, 3.0))];
        let points = |name: &str| landmarks(&folder.join(name), &point, "skull", &Made::default()).map(|()| text(name));
        for (name, begins) in
            [("b.mrk.json", "{"), ("b.fcsv", "# Markups"), ("b.tps", "LM3=1"), ("b.txt", "[individuals]"), ("b.csv", "kind,name,")]
        {
            assert!(points(name).unwrap().starts_with(begins), "{name}");
        }
        assert!(points("b.doc").unwrap_err().to_string().contains("b.doc: end the name in .csv"));
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_saved_map_has_all_its_points() {
        let folder = folder("map");
        let opened = Opened::demo(24, &Progress::default()).unwrap();
        let order = Order::new(&opened.volumes[0], &opened.scene.layers[0], 0, Method::Normal, String::new());
        let whole = order.measure(&Progress::default()).unwrap();
        let (known, scale) = (whole.statistics.count, Scale { colors: Colors::Viridis, ends_mm: [0.0, 16.0] });
        let coat = ThicknessCoat { map: Arc::new(whole), scale };
        map(&folder.join("a.csv"), &coat, TableStyle::default()).unwrap();
        assert_eq!(fs::read_to_string(folder.join("a.csv")).unwrap().lines().count(), known + 1);
        map(&folder.join("a.PLY"), &coat, TableStyle::default()).unwrap();
        assert!(fs::read(folder.join("a.PLY")).unwrap().starts_with(b"ply\n"));
        assert!(map(&folder.join("a.stl"), &coat, TableStyle::default()).unwrap_err().to_string().contains(".csv or .ply"));
        fs::remove_dir_all(folder).unwrap();
    }
}
