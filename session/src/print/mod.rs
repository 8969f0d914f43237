//! Pictures for paper: their size in millimetres, what is drawn over them, and the files that hold them.
//!
//! [`prepare`] aims the cameras of [`Panel`]s for a [`Print`], [`draw`] makes a [`Canvas`] of them, and [`write()`] a file, in the form that its name
//! asks for. Marks are shapes in millimetres of paper (`shapes`), painted as pixels, or kept as paths in SVG and PDF.

mod beside;
mod canvas;
mod draw;
mod encoding;
mod exr_file;
mod form;
mod inks;
pub mod journals;
mod jpeg_file;
mod legend;
pub mod marks;
mod measured;
mod pdf;
mod png_file;
mod prepare;
mod raster;
pub mod record;
pub mod shapes;
mod sheet;
mod svg;
mod text;
mod tiff_file;

pub use canvas::Canvas;
pub use draw::{Watch, draw, draw_watched};
pub use encoding::{ENDINGS, Encoding, FileError};
pub use form::{ENDING_LIST, Form, figure_png, write, write_figure, write_picture};
pub use inks::Inks;
pub use legend::Legend;
pub use prepare::{Aim, Panel, prepare, scale_of};
pub use sheet::{AUTO, Bar, Layout, MOST_PIXELS, PRINT_DPI, PRINT_SAMPLES, Print, TYPE_PT, ratio};

use crate::studio::ExposeError;
use bregma_field::Cancelled;
use bregma_renderer::RenderError;
use thiserror::Error;

/// Why there is no print.
#[derive(Debug, Error)]
pub enum PrintError {
    /// Too many pixels, or none.
    #[error("{width}×{height} pixels cannot be drawn; ask for 1 to {MOST_PIXELS} along each side by the size, or by fewer dots an inch")]
    Size {
        /// Across.
        width: u32,
        /// Down.
        height: u32,
    },
    /// Sizes that are none.
    #[error("a size, a scale or a number of samples of the print is not above 0; give another")]
    Numbers,
    /// Marks that fill the sheet.
    #[error("caption, legend and marks leave no room for the picture; make the sheet larger, or the type smaller")]
    NoRoom,
    /// No one length of bar.
    #[error("in perspective a bar of scale holds at one distance only; draw along parallel rays (--ortho), or say --bar-at target")]
    BarInPerspective,
    /// A bar that does not fit.
    #[error("a bar of {length_mm} mm is longer than the picture, which shows {room_mm:.1} mm; ask for a shorter one, or auto")]
    LongBar {
        /// The bar.
        length_mm: f64,
        /// What there is room for.
        room_mm: f64,
    },
    /// No one scale.
    #[error("a scale holds along parallel rays only, and this picture is in perspective; add --ortho or --view, and leave --fov out")]
    ScaleInPerspective,
    /// Pictures of several scales on a plate.
    #[error("pictures of one plate have one scale, and one of these is in perspective; draw them along parallel rays")]
    PlateInPerspective,
    /// Greys without numbers.
    #[error("what the greys mean is known only of a window; give --window and --level, or leave the legend out")]
    NoWindow,
    /// A picture that cannot be drawn.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A picture under studio light that cannot be drawn or kept.
    #[error(transparent)]
    Expose(#[from] ExposeError),
    /// Stopped by request.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
