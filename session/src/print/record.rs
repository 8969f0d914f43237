//! What a picture was drawn of, as its file holds it, and how it is drawn again.

use super::canvas::Canvas;
use super::encoding::{Encoding, FileError};
use super::form::Form;
use super::prepare::Panel;
use super::sheet::Print;
use super::{PrintError, draw, exr_file, jpeg_file, pdf, png_file, svg, tiff_file};
use crate::machine::Machine;
use crate::measurement::{MeasuredScan, Origin};
use crate::opened::Opened;
use crate::record::{VerifyError, open};
use crate::session_file::Session;
use bregma_field::{Progress, Volume};
use bregma_renderer::RenderError;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use thiserror::Error;

/// What a picture was drawn of and how.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Version of the form; 1.
    bregma_picture: u32,
    /// Program and version.
    program: String,
    /// What drew it.
    drawn_by: String,
    /// The sheet.
    print: Print,
    /// The file.
    #[serde(default)]
    encoding: Encoding,
    /// The pictures on it.
    panels: Vec<Recorded>,
}

/// A picture of a sheet.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Recorded {
    /// Scans and scene.
    session: Session,
    /// SHA-256 of what each scan holds, see `Volume::content`.
    contents: Vec<String>,
    /// The surface wears a map, which is measured and not drawn.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    wears_map: bool,
}

const PROGRAM: &str = concat!("bregma ", env!("CARGO_PKG_VERSION"));

impl Record {
    /// Of prepared pictures, with files named relative to `folder` where they lie below it; `None` where scans have no sources.
    pub fn of(panels: &[Panel], print: &Print, encoding: &Encoding, drawn_by: &str, folder: &Path) -> Option<Self> {
        let mut known: HashMap<*const Volume, String> = HashMap::new();
        let mut recorded = vec![];
        for panel in panels {
            if panel.opened.sources.len() != panel.opened.volumes.len() {
                return None;
            }
            let mut content = |volume: &Arc<Volume>| known.entry(Arc::as_ptr(volume)).or_insert_with(|| volume.content()).clone();
            let contents = panel.opened.volumes.iter().map(&mut content).collect();
            recorded.push(Recorded { session: Session::of(&panel.opened, folder), contents, wears_map: panel.coat.is_some() });
        }
        let (program, drawn_by) = (PROGRAM.to_owned(), drawn_by.to_owned());
        Some(Self { bregma_picture: 1, program, drawn_by, print: print.clone(), encoding: encoding.clone(), panels: recorded })
    }
}

impl std::fmt::Display for Record {
    /// One line of JSON.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&serde_json::to_string(self).map_err(|_| std::fmt::Error)?)
    }
}

/// Why a picture was not drawn again.
#[derive(Debug, Error)]
pub enum AgainError {
    /// The file is not there.
    #[error("{}: cannot be read ({reason}); check its name and permissions", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// What the system says.
        reason: std::io::Error,
    },
    /// Nothing says what it shows.
    #[error("{}: does not say what it was drawn of; only pictures of this program as it wrote them can be drawn again", .0.display())]
    Silent(PathBuf),
    /// What it says is not understood.
    #[error("{}: what it was drawn of is not understood ({reason})", file.display())]
    Unknown {
        /// The file.
        file: PathBuf,
        /// Why not.
        reason: String,
    },
    /// It shows a map.
    #[error("{}: shows a map, which is measured and not drawn; measure it again in its session", .0.display())]
    Map(PathBuf),
    /// Its scans.
    #[error("{}: {reason}", file.display())]
    Scans {
        /// The picture.
        file: PathBuf,
        /// What is wrong with them.
        reason: Box<VerifyError>,
    },
    /// Drawing it failed.
    #[error(transparent)]
    Print(#[from] PrintError),
    /// No renderer.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// Encoding it failed.
    #[error(transparent)]
    File(#[from] FileError),
}

/// How a picture compares with what is drawn of its record now.
#[derive(Clone, Debug, PartialEq)]
pub enum Likeness {
    /// Byte for byte.
    Same,
    /// Its pixels are, and the rest of the file is not.
    SamePixels,
    /// So many channels of pixels differ, by up to so much of the whole range.
    Differs {
        /// Channels that differ.
        count: usize,
        /// Of all.
        of: usize,
        /// The largest difference, 0 to 1.
        most: f32,
    },
    /// Of another size.
    OtherSize,
}

/// A picture that was drawn again.
#[derive(Clone, Debug, PartialEq)]
pub struct Again {
    /// How like it is.
    pub likeness: Likeness,
    /// Program and renderer that the file names.
    pub then: String,
    /// Those that drew it again.
    pub now: String,
}

/// The most that pictures of two renderers differ by.
pub const OTHER_RENDERER: f32 = 2.0 / 255.0;

impl Again {
    /// Whether the picture is what its record says: the same pixels, or as like as two renderers are where another drew it.
    pub fn holds(&self) -> bool {
        match self.likeness {
            Likeness::Same | Likeness::SamePixels => true,
            // Half a step of 8 bits for rounding.
            Likeness::Differs { most, .. } => self.then != self.now && most <= OTHER_RENDERER + 0.5 / 255.0,
            Likeness::OtherSize => false,
        }
    }
}

/// What a file of a picture says that it was drawn of; `None` of what is no picture of this program.
pub fn of(file: &Path) -> Option<String> {
    let form = Form::of(file).ok()?;
    let bytes = std::fs::read(file).ok()?;
    text(form, &bytes)
}

fn text(form: Form, bytes: &[u8]) -> Option<String> {
    match form {
        Form::Png => png_file::record(bytes),
        Form::Tiff => tiff_file::record(bytes),
        Form::Exr => exr_file::record(bytes),
        Form::Jpeg => jpeg_file::record(bytes),
        Form::Pdf => pdf::record(bytes),
        Form::Svg => svg::record(bytes),
    }
}

fn channels(form: Form, bytes: &[u8]) -> Option<Vec<f32>> {
    match form {
        Form::Png => png_file::channels(bytes),
        Form::Tiff => tiff_file::channels(bytes),
        Form::Exr => exr_file::channels(bytes),
        Form::Jpeg => jpeg_file::channels(bytes),
        Form::Pdf => pdf::channels(bytes),
        Form::Svg => svg::channels(bytes),
    }
}

/// Draws what a file was drawn of again, and compares.
pub fn again(file: &Path, machine: Machine, progress: &Progress) -> Result<Again, AgainError> {
    let form = Form::of(file)?;
    let bytes = std::fs::read(file).map_err(|reason| AgainError::Unreadable { file: file.to_owned(), reason })?;
    let text = text(form, &bytes).ok_or_else(|| AgainError::Silent(file.to_owned()))?;
    let unknown = |reason: String| AgainError::Unknown { file: file.to_owned(), reason };
    let record: Record = serde_json::from_str(&text).map_err(|e| unknown(e.to_string()))?;
    if record.bregma_picture != 1 {
        return Err(unknown(format!("its version is {}", record.bregma_picture)));
    }
    if record.panels.is_empty() {
        return Err(unknown("it has no pictures".into()));
    }
    if record.panels.iter().any(|panel| panel.wears_map) {
        return Err(AgainError::Map(file.to_owned()));
    }
    let folder = file.parent().unwrap_or(Path::new(""));
    let checked = |panel: Recorded| Ok(Recorded { session: panel.session.checked().map_err(unknown)?, ..panel });
    let record = Record { panels: record.panels.into_iter().map(checked).collect::<Result<_, AgainError>>()?, ..record };
    let mut panels: Vec<Panel> = vec![];
    for (n, recorded) in record.panels.iter().enumerate() {
        // The same scans are opened once.
        let same = record.panels[..n]
            .iter()
            .position(|before| before.session.volumes == recorded.session.volumes && before.contents == recorded.contents);
        let known = same.map(|k| panels[k].opened.clone());
        let opened = known.map_or_else(|| opened(recorded, &record.program, folder), Ok);
        let posed = opened.and_then(|opened| posed(opened, &recorded.session));
        let opened = posed.map_err(|reason| AgainError::Scans { file: file.to_owned(), reason: Box::new(reason) })?;
        panels.push(Panel { opened, aim: None, coat: None });
    }
    let mut renderer = machine.renderer()?;
    let now = format!("{PROGRAM}, {}", renderer.name());
    let canvas = draw(&panels, &record.print, renderer.as_mut(), progress)?;
    let likeness = compared(form, &bytes, &canvas, &record.encoding, &text, file)?;
    Ok(Again { likeness, then: format!("{}, {}", record.program, record.drawn_by), now })
}

fn compared(form: Form, bytes: &[u8], canvas: &Canvas, encoding: &Encoding, text: &str, file: &Path) -> Result<Likeness, FileError> {
    let made = form.encode(canvas, encoding, Some(text)).map_err(|reason| FileError::Encode { file: file.to_owned(), reason })?;
    if made == bytes {
        return Ok(Likeness::Same);
    }
    let (Some(was), Some(is)) = (channels(form, bytes), channels(form, &made)) else { return Ok(Likeness::OtherSize) };
    if was.len() != is.len() {
        return Ok(Likeness::OtherSize);
    }
    let off = was.iter().zip(&is).map(|(a, b)| (a - b).abs());
    let (count, most) = off.fold((0, 0.0_f32), |(count, most), off| (count + usize::from(off > 0.0), most.max(off)));
    Ok(if count == 0 { Likeness::SamePixels } else { Likeness::Differs { count, of: was.len(), most } })
}

/// The scans of a picture as they were. Fails if one is another scan now.
fn opened(recorded: &Recorded, program: &str, folder: &Path) -> Result<Opened, VerifyError> {
    let session = &recorded.session;
    let counts = [session.volumes.len(), session.scene.layers.len(), recorded.contents.len()];
    if counts.iter().any(|count| *count != counts[0]) {
        return Err(VerifyError::Count { measured: counts[2], there: counts[0] });
    }
    let scans = session.volumes.iter().zip(&session.scene.layers).zip(&recorded.contents);
    let scan = |((source, layer), content): ((&crate::Source, &_), &String)| {
        let layer: &bregma_renderer::Layer = layer;
        MeasuredScan { source: source.clone(), content: content.clone(), layer: layer.clone() }
    };
    open(&Origin { program: program.into(), date: None, scans: scans.map(scan).collect(), clips: vec![] }, folder)
}

fn posed(mut opened: Opened, session: &Session) -> Result<Opened, VerifyError> {
    opened.scene.clone_from(&session.scene);
    opened.find_parts(&Progress::default())?;
    opened.measurements.clone_from(&session.measurements);
    opened.landmarks.clone_from(&session.landmarks);
    (opened.compare, opened.pair) = (session.compare, session.pair);
    Ok(opened)
}
