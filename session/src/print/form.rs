//! The forms of picture files: the ending of a file's name decides, and what each of them can hold.

use super::canvas::Canvas;
use super::encoding::{Encoding, Failure, FileError};
use super::{exr_file, jpeg_file, pdf, png_file, svg, tiff_file};
use crate::output::write_whole;
use bregma_renderer::Picture;
use std::path::Path;

/// A form of picture files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// PNG.
    Png,
    /// TIFF.
    Tiff,
    /// OpenEXR.
    Exr,
    /// JPEG.
    Jpeg,
    /// PDF.
    Pdf,
    /// SVG.
    Svg,
}

/// The endings, for dialogs.
pub const ENDING_LIST: &[&str] = &["png", "tif", "tiff", "exr", "jpg", "jpeg", "pdf", "svg"];

impl Form {
    /// By the ending of a file's name, in any case.
    pub fn of(file: &Path) -> Result<Self, FileError> {
        let ending = file.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        match ending.as_str() {
            "png" => Ok(Self::Png),
            "tif" | "tiff" => Ok(Self::Tiff),
            "exr" => Ok(Self::Exr),
            "jpg" | "jpeg" => Ok(Self::Jpeg),
            "pdf" => Ok(Self::Pdf),
            "svg" => Ok(Self::Svg),
            _ => Err(FileError::Ending(file.to_owned())),
        }
    }

    /// Whether such a file can be encoded so; to be asked before anything is drawn.
    pub fn check(self, file: &Path, encoding: &Encoding, is_clear: bool) -> Result<(), FileError> {
        let cannot = |what: &str| Err(FileError::Cannot { file: file.to_owned(), what: what.into() });
        if encoding.is_deep && !matches!(self, Self::Png | Self::Tiff) {
            return cannot("16 bits are of PNG and TIFF; leave --bits out, or choose another ending (EXR holds floats)");
        }
        if encoding.icc.is_some() && self != Self::Tiff {
            return cannot("a printer's inks are of TIFF; leave --icc out, or end the name in .tif");
        }
        if is_clear && (self == Self::Jpeg || encoding.icc.is_some()) {
            return cannot("such a file has no clear ground; choose --ground white or a colour, or another form");
        }
        Ok(())
    }

    /// The bytes of such a file, with `record` in it, which is told again by `record::of`.
    pub fn encode(self, canvas: &Canvas, encoding: &Encoding, record: Option<&str>) -> Result<Vec<u8>, Failure> {
        match self {
            Self::Png => png_file::encode(canvas, encoding.is_deep, record),
            Self::Tiff => tiff_file::encode(canvas, encoding, record),
            Self::Exr => exr_file::encode(canvas, record),
            Self::Jpeg => jpeg_file::encode(canvas, record),
            Self::Pdf => pdf::encode(canvas, record),
            Self::Svg => svg::encode(canvas, record),
        }
    }
}

/// Writes a sheet in the form that its name asks for.
pub fn write(file: &Path, canvas: &Canvas, encoding: &Encoding, record: Option<&str>) -> Result<(), FileError> {
    let form = Form::of(file)?;
    form.check(file, encoding, canvas.is_clear)?;
    let bytes = form.encode(canvas, encoding, record).map_err(|reason| FileError::Encode { file: file.to_owned(), reason })?;
    Ok(write_whole(file, &bytes)?)
}

/// Writes a picture as it is in the form that its name asks for.
pub fn write_picture(file: &Path, picture: &Picture) -> Result<(), FileError> {
    write(file, &Canvas::of(picture), &Encoding::default(), None)
}

/// The same of a figure: RGB pixels, their width and their height.
pub fn write_figure(file: &Path, figure: &(Vec<u8>, u32, u32)) -> Result<(), FileError> {
    write(file, &Canvas::of_figure(figure), &Encoding::default(), None)
}

/// A figure as the bytes of a PNG.
pub fn figure_png(figure: &(Vec<u8>, u32, u32)) -> Result<Vec<u8>, Failure> {
    Form::Png.encode(&Canvas::of_figure(figure), &Encoding::default(), None)
}
