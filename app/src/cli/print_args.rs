//! What options say of a picture on paper.

use super::camera_args::CameraArgs;
use super::error::CommandError;
use super::parsers::{number, one_of, positive};
use bregma_renderer::{Color, Named};
use bregma_session::Opened;
use bregma_session::print::journals::Journal;
use bregma_session::print::{Aim, Bar, Encoding, PRINT_DPI, PRINT_SAMPLES, Print, TYPE_PT};
use bregma_session::views::{View, held};
use clap::Args;
use std::path::PathBuf;

/// A picture on paper.
#[derive(Debug, Args)]
pub struct PrintArgs {
    /// Which way the skull is seen, as large as its room, along parallel rays unless --fov says otherwise
    #[arg(long, value_parser = one_of::<View>(), conflicts_with_all = ["orbit", "eye", "plane"])]
    pub view: Option<View>,
    /// Hold the skull in the Frankfurt horizontal by three landmarks, whose file stands among the scans [default: porion left, porion right and
    /// orbitale left by their usual names]
    #[arg(long, value_name = "POL,POR,ORL", num_args = 0..=1, value_parser = names)]
    pub frankfurt: Option<Option<Names>>,
    /// Size on paper, mm; of a width alone the height is as --size says, or three quarters of it
    #[arg(long, value_name = "WxH|W", value_parser = paper)]
    pub print: Option<Paper>,
    /// Pixels in an inch of paper [default: 300]
    #[arg(long, value_name = "N", value_parser = dots)]
    pub dpi: Option<f64>,
    /// Millimetres on paper to millimetres of skull, along parallel rays
    #[arg(long, value_name = "1:N", value_parser = scale)]
    pub scale: Option<f64>,
    /// A bar of so many mm of the skull, or of a round length
    #[arg(long, value_name = "MM|auto", value_parser = bar)]
    pub bar: Option<BarLength>,
    /// In perspective, the bar holds at the distance of the camera's target, and says so
    #[arg(long, value_name = "target", value_parser = ["target"], requires = "bar")]
    pub bar_at: Option<String>,
    /// Letters of the sides at the edges: L, R, A, P, S, I
    #[arg(long)]
    pub letters: bool,
    /// The figure's letter, in the upper left corner; of a plate the first one's
    #[arg(long, value_name = "TEXT")]
    pub label: Option<String>,
    /// A sentence below the picture; auto says what is shown
    #[arg(long, value_name = "TEXT|auto")]
    pub caption: Option<String>,
    /// What the colours mean, below the picture
    #[arg(long)]
    pub legend: bool,
    /// The session's rays with their lengths, and landmarks with their names: dashed or empty behind bone
    #[arg(long)]
    pub marks: bool,
    /// Size of the type, points [default: 8]
    #[arg(long, value_name = "PT", value_parser = positive)]
    pub type_size: Option<f64>,
    /// Bits of each channel, of PNG and TIFF [default: 8]
    #[arg(long, value_name = "8|16", value_parser = ["8", "16"])]
    pub bits: Option<String>,
    /// TIFF in a printer's inks (CMYK), by the printer's profile
    #[arg(long, value_name = "FILE.icc")]
    pub icc: Option<PathBuf>,
    /// Check the picture by what a publisher asks for
    #[arg(long = "for", value_name = "JOURNAL", value_parser = one_of::<Journal>())]
    pub journal: Option<Journal>,
    /// Several pictures on one sheet at one scale: views with commas between them, or a file that lists each one's scans and options
    #[arg(long, value_name = "VIEW,…|FILE.json", conflicts_with_all = ["view", "orbit", "eye", "plane"])]
    pub plate: Option<String>,
    /// Pictures of a plate beside each other
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=64), requires = "plate")]
    pub columns: Option<u32>,
}

/// Names of three landmarks.
#[derive(Clone, Debug, PartialEq)]
pub struct Names([String; 3]);

/// Across and, where it is said, down, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Paper {
    width_mm: f64,
    height_mm: Option<f64>,
}

/// The length of a bar, mm; a round one when absent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BarLength(Option<f64>);

fn names(text: &str) -> Result<Names, String> {
    let names: Vec<String> = text.split(',').map(|name| name.trim().to_owned()).filter(|name| !name.is_empty()).collect();
    names.try_into().map(Names).map_err(|_| "not three names with commas between them; without names, write it behind the scans".into())
}

fn paper(text: &str) -> Result<Paper, String> {
    let wanted = || "not a size in mm such as 85x100 or 85".to_owned();
    let (width, height) = text.split_once('x').map_or((text, None), |(width, height)| (width, Some(height)));
    let width_mm = positive(width).map_err(|_| wanted())?;
    let height_mm = height.map(|height| positive(height).map_err(|_| wanted())).transpose()?;
    Ok(Paper { width_mm, height_mm })
}

fn dots(text: &str) -> Result<f64, String> {
    number(text).ok().filter(|dpi| (1.0..=10_000.0).contains(dpi)).ok_or_else(|| "not a number of dots from 1 to 10000".into())
}

/// Millimetres of skull for each millimetre of paper.
fn scale(text: &str) -> Result<f64, String> {
    let parse = || {
        let (paper, skull) = text.split_once(':')?;
        Some(positive(skull).ok()? / positive(paper).ok()?)
    };
    parse().ok_or_else(|| "not a scale such as 1:2".into())
}

fn bar(text: &str) -> Result<BarLength, String> {
    if text == "auto" {
        Ok(BarLength(None))
    } else {
        positive(text).map(|mm| BarLength(Some(mm))).map_err(|e| format!("neither auto nor a length: {e}"))
    }
}

impl PrintArgs {
    /// The sheet, of `size` pixels and `samples` points of each where nothing is said of paper.
    pub fn sheet(&self, size: Option<(u32, u32)>, samples: Option<u32>) -> Print {
        let dpi = self.dpi.or(self.print.map(|_| PRINT_DPI));
        let size_px = match self.print {
            None => size.map_or(Print::default().size_px, |(width, height)| [width, height]),
            Some(Paper { width_mm, height_mm }) => {
                let aspect = size.map_or(4.0 / 3.0, |(width, height)| f64::from(width) / f64::from(height));
                Print::pixels([width_mm, height_mm.unwrap_or(width_mm / aspect)], dpi.unwrap_or(PRINT_DPI))
            }
        };
        Print {
            size_px,
            dpi,
            samples: samples.unwrap_or(if self.is_print() { PRINT_SAMPLES } else { 1 }),
            exposure: None,
            scale: self.scale,
            bar: self.bar.map(|BarLength(length_mm)| Bar { length_mm, at_target: self.bar_at.is_some() }),
            letters: self.letters,
            label: self.label.clone(),
            caption: self.caption.clone(),
            legend: self.legend,
            marks: self.marks,
            type_pt: self.type_size.unwrap_or(TYPE_PT),
            columns: self.columns,
        }
    }

    fn is_print(&self) -> bool {
        self.print.is_some() || self.plate.is_some()
    }

    /// The ground where nobody says one: white paper, or of a picture for the screen the scene's.
    pub fn ground(&self, of_scene: Option<Color>) -> Option<Color> {
        if self.is_print() { Some(Color([1.0; 3])) } else { of_scene }
    }

    /// How the file is encoded.
    pub fn encoding(&self) -> Encoding {
        Encoding { is_deep: self.bits.as_deref() == Some("16"), icc: self.icc.clone() }
    }

    /// How a view is aimed at.
    pub fn aim(&self, view: Option<View>, camera: &CameraArgs, opened: &Opened) -> Result<Option<Aim>, CommandError> {
        let Some(view) = view else {
            return match self.frankfurt {
                Some(_) => Err(CommandError::Usage("--frankfurt holds the skull for a view; say which by --view or --plate".into())),
                None => Ok(None),
            };
        };
        let names = self.frankfurt.as_ref().map(|names| names.as_ref().map(|Names(names)| names));
        let frankfurt = names.map(|names| held(&opened.landmarks, names)).transpose()?;
        Ok(Some(Aim { view, frankfurt, fov_deg: camera.fov }))
    }

    /// The views of a plate that is of one set of scans; `None` of one that a file lists.
    pub fn plate_views(&self) -> Result<Option<Vec<View>>, CommandError> {
        let Some(plate) = self.plate.as_deref().filter(|plate| !plate.ends_with(".json")) else { return Ok(None) };
        let of = |name: &str| View::named(name.trim());
        let views: Option<Vec<View>> = plate.split(',').map(of).collect();
        let known = View::ALL.iter().map(|view| view.name()).collect::<Vec<_>>().join(", ");
        views
            .map(Some)
            .ok_or_else(|| CommandError::Usage(format!("--plate {plate}: a view is one of {known}; a list of pictures ends in .json")))
    }
}
