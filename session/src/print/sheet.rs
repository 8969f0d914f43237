//! What a sheet is asked to be, and how its room is divided: pictures above, then what their colours mean, then the caption.

use super::PrintError;
use super::text::{CAPITAL, LEADING, POINT_MM, wrapped};
use crate::studio::Exposure;
use crate::views::View;
use serde::{Deserialize, Serialize};

/// What a sheet is asked to be.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Print {
    /// Pixels across and down.
    pub size_px: [u32; 2],
    /// Pixels in an inch of paper; marks take 300 where nobody says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dpi: Option<f64>,
    /// Points of each pixel.
    pub samples: u32,
    /// How scenes with a studio are exposed, instead of that; as [`Exposure::default`] of so many samples where absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exposure: Option<Exposure>,
    /// Millimetres of skull on a millimetre of paper, along parallel rays.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scale: Option<f64>,
    /// A bar of scale.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bar: Option<Bar>,
    /// Which side of the body lies where, at the edges.
    #[serde(default)]
    pub letters: bool,
    /// In the upper left corner; of several pictures the first one's, and the next have those that follow it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub label: Option<String>,
    /// Below; [`AUTO`] until it is prepared.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub caption: Option<String>,
    /// What colours mean.
    #[serde(default)]
    pub legend: bool,
    /// Rays, landmarks and stretches.
    #[serde(default)]
    pub marks: bool,
    /// Size of the type, points.
    pub type_pt: f64,
    /// Pictures beside each other; a square's when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub columns: Option<u32>,
}

/// A bar of scale.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bar {
    /// Its length in the world; a round one when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub length_mm: Option<f64>,
    /// In perspective it holds at the distance of the camera's target, and says so.
    #[serde(default)]
    pub at_target: bool,
}

/// A caption that says by itself what is shown.
pub const AUTO: &str = "auto";
/// The most pixels along a side.
pub const MOST_PIXELS: u32 = 16_384;
/// What prints are drawn with where nobody says otherwise.
pub const PRINT_SAMPLES: u32 = 16;
/// Their dots in an inch.
pub const PRINT_DPI: f64 = 300.0;
/// The size of their type, points.
pub const TYPE_PT: f64 = 8.0;
/// Room between marks and the edges of their picture, mm.
pub const MARGIN_MM: f64 = 2.0;

impl Default for Print {
    fn default() -> Self {
        let (exposure, scale, bar, label, caption, columns) = (None, None, None, None, None, None);
        let (letters, legend, marks) = (false, false, false);
        Self {
            size_px: [512; 2],
            dpi: None,
            samples: 1,
            exposure,
            scale,
            bar,
            letters,
            label,
            caption,
            legend,
            marks,
            type_pt: TYPE_PT,
            columns,
        }
    }
}

impl Print {
    /// Pixels of a size on paper.
    pub fn pixels([width_mm, height_mm]: [f64; 2], dpi: f64) -> [u32; 2] {
        // Far beyond the most pixels the cast ends at the largest number.
        [width_mm, height_mm].map(|mm| (mm / 25.4 * dpi).round() as u32)
    }

    /// Pixels in a millimetre of paper.
    pub fn px_per_mm(&self) -> f64 {
        self.dpi.unwrap_or(PRINT_DPI) / 25.4
    }

    /// Its size on paper, mm.
    pub fn size_mm(&self) -> [f64; 2] {
        self.size_px.map(|px| f64::from(px) / self.px_per_mm())
    }

    /// Size of the type, mm.
    pub fn type_mm(&self) -> f64 {
        self.type_pt * POINT_MM
    }

    /// Whether its numbers can be used.
    pub fn check(&self) -> Result<(), PrintError> {
        let [width, height] = self.size_px;
        if !self.size_px.iter().all(|px| (1..=MOST_PIXELS).contains(px)) {
            return Err(PrintError::Size { width, height });
        }
        let positive = |v: f64| v > 0.0 && v.is_finite();
        let bar_mm = self.bar.and_then(|bar| bar.length_mm);
        if !self.dpi.into_iter().chain(self.scale).chain(bar_mm).chain([self.type_pt]).all(positive) || self.samples == 0 {
            return Err(PrintError::Numbers);
        }
        Ok(())
    }

    /// The lines of its caption.
    pub fn caption_lines(&self) -> Vec<String> {
        let width_mm = self.size_mm()[0] - 2.0 * MARGIN_MM;
        self.caption.as_deref().map_or(vec![], |caption| wrapped(caption, self.type_mm(), width_mm))
    }

    /// From the edges of a picture to where the skull shall lie, mm: left, top, right and bottom.
    pub fn insets_mm(&self) -> [f64; 4] {
        let row = CAPITAL * self.type_mm() + 1.0;
        let letters = if self.letters { row } else { 0.0 };
        // A bar has its number above it.
        let bar = if self.bar.is_some() { row + BAR_MM + 0.5 } else { 0.0 };
        [letters, letters, letters, letters.max(bar)].map(|mm| MARGIN_MM + mm)
    }
}

/// Height of a bar of scale, mm.
pub const BAR_MM: f64 = 0.6;

/// Where things are on a sheet.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    /// Of each picture: its upper left pixel, and its pixels across and down.
    pub cells: Vec<([u32; 2], [u32; 2])>,
    /// Pictures beside each other.
    pub columns: usize,
    /// The upper edge of what colours mean, mm.
    pub legend_mm: f64,
    /// The upper edge of the caption, mm.
    pub caption_mm: f64,
}

impl Layout {
    /// Of `count` pictures, with a legend of such a height.
    pub fn new(print: &Print, count: usize, legend_mm: f64) -> Result<Self, PrintError> {
        print.check()?;
        let lines = print.caption_lines().len() as f64;
        let caption_mm = if lines > 0.0 { MARGIN_MM + lines * LEADING * print.type_mm() } else { 0.0 };
        let [width, height] = print.size_px;
        let below = ((caption_mm + legend_mm) * print.px_per_mm()).ceil();
        let columns = print.columns.map_or((count as f64).sqrt().ceil() as usize, |n| n as usize).clamp(1, count.max(1));
        let rows = count.div_ceil(columns).max(1);
        let cell = [width / columns as u32, (f64::from(height) - below).max(0.0) as u32 / rows as u32];
        let [left, top, right, bottom] = print.insets_mm();
        let inner = [f64::from(cell[0]) - (left + right) * print.px_per_mm(), f64::from(cell[1]) - (top + bottom) * print.px_per_mm()];
        let has_marks = print.letters || print.bar.is_some() || below > 0.0 || count > 1;
        if count == 0 || has_marks && inner.iter().any(|px| *px < 8.0) || cell.contains(&0) {
            return Err(PrintError::NoRoom);
        }
        let at = |n: usize| [(n % columns) as u32 * cell[0], (n / columns) as u32 * cell[1]];
        let pictures_mm = f64::from(cell[1]) * rows as f64 / print.px_per_mm();
        let cells = (0..count).map(|n| (at(n), cell)).collect();
        Ok(Self { cells, columns, legend_mm: pictures_mm, caption_mm: pictures_mm + legend_mm })
    }
}

/// How a scale is written: `1:2` where the paper is half as large.
pub fn ratio(scale: f64) -> String {
    let short = |v: f64| {
        let text = format!("{v:.2}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    };
    if scale >= 1.0 { format!("1:{}", short(scale)) } else { format!("{}:1", short(1.0 / scale)) }
}

/// What a view is called in captions.
pub fn norma(view: View) -> &'static str {
    match view {
        View::Frontalis => "norma frontalis",
        View::LateralisSinistra => "norma lateralis sinistra",
        View::LateralisDextra => "norma lateralis dextra",
        View::Occipitalis => "norma occipitalis",
        View::Verticalis => "norma verticalis",
        View::Basilaris => "norma basilaris",
        View::Oblique => "oblique view",
    }
}
