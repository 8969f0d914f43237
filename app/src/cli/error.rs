//! Why a command did not do its work.

use bregma_field::formats::WriteError;
use bregma_field::formats::zarr::ConvertError;
use bregma_field::{SurfaceError, TransformError};
use bregma_measure::volumes::VolumesError;
use bregma_parts::PartsError;
use bregma_register::orient::OrientError;
use bregma_renderer::RenderError;
use bregma_renderer::stability::StabilityError;
use bregma_session::InputError;
use bregma_session::chart::ChartError;
use bregma_session::difference::DifferenceError;
use bregma_session::film::FilmError;
use bregma_session::looks::LookError;
use bregma_session::output::{FolderError, OutputError};
use bregma_session::presets::PresetError;
use bregma_session::print::{FileError, PrintError, record};
use bregma_session::record::{RecordError, VerifyError};
use bregma_session::register::RegisterError;
use bregma_session::save::SaveError;
use bregma_session::section::SectionError;
use bregma_session::studio::StudioFileError;
use bregma_session::views::HoldError;
use std::io;
use std::path::PathBuf;
use thiserror::Error;

/// Why a command did not do its work: one sentence for the person.
#[derive(Debug, Error)]
pub enum CommandError {
    /// Something could not be opened.
    #[error(transparent)]
    Input(#[from] InputError),
    /// A scan could not be converted.
    #[error(transparent)]
    Convert(#[from] ConvertError),
    /// Something could not be drawn.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// Something could not be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A picture could not be written.
    #[error(transparent)]
    File(#[from] FileError),
    /// A print that cannot be.
    #[error(transparent)]
    Print(#[from] PrintError),
    /// A skull that cannot be held for a view.
    #[error(transparent)]
    Hold(#[from] HoldError),
    /// A picture that cannot be drawn again.
    #[error(transparent)]
    Redraw(#[from] record::AgainError),
    /// Pictures that are others now.
    #[error("{lost} of {all} pictures are not what is drawn of them now; draw them again")]
    LostPictures {
        /// Those that differ.
        lost: usize,
        /// All that were drawn again.
        all: usize,
    },
    /// A picture that a publisher would send back.
    #[error("the picture is not as {journal} asks for it: {}", faults.join("; "))]
    Journal {
        /// The publisher.
        journal: &'static str,
        /// What is wrong, and what to do.
        faults: Vec<String>,
    },
    /// A list of pictures that cannot be used.
    #[error("{}: {reason}", file.display())]
    Plate {
        /// The list.
        file: PathBuf,
        /// What is wrong with it, and what to do.
        reason: String,
    },
    /// A scan could not be written.
    #[error(transparent)]
    Scan(#[from] WriteError),
    /// The stability table.
    #[error(transparent)]
    Stability(#[from] StabilityError),
    /// The chart of speed and accuracy.
    #[error(transparent)]
    Chart(#[from] ChartError),
    /// A map that cannot be saved.
    #[error(transparent)]
    Save(#[from] SaveError),
    /// Two surfaces without a difference.
    #[error(transparent)]
    Difference(#[from] DifferenceError),
    /// A section that is not there.
    #[error(transparent)]
    Section(#[from] SectionError),
    /// A studio that is not there.
    #[error(transparent)]
    Studio(#[from] StudioFileError),
    /// A registration flattens a volume.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// A look that is not there.
    #[error(transparent)]
    Preset(#[from] PresetError),
    /// A look that there is not.
    #[error(transparent)]
    Look(#[from] LookError),
    /// Standard output broke.
    #[error("standard output cannot be written ({0})")]
    Stdout(io::Error),
    /// A list of rays that cannot be used.
    #[error("{}: {reason}", file.display())]
    Rays {
        /// The list.
        file: PathBuf,
        /// What is wrong with it, and what to do.
        reason: String,
    },
    /// A folder for outputs that cannot be made.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// A scan on which no length is known.
    #[error("{0}: it states no spacing, so no length on it is known in mm; pass --spacing X,Y,Z")]
    NoSpacing(String),
    /// A map of thickness of nothing.
    #[error("{0}: no thickness is known anywhere at this isovalue; choose another, or another patch")]
    NoThickness(String),
    /// A figure that cannot be drawn.
    #[error("{what} cannot be drawn ({reason})")]
    Figure {
        /// The figure.
        what: String,
        /// What went wrong.
        reason: Box<dyn std::error::Error>,
    },
    /// A registration.
    #[error(transparent)]
    Register(#[from] RegisterError),
    /// A scan that cannot be held so.
    #[error(transparent)]
    Orient(#[from] OrientError),
    /// A registration that cannot be written.
    #[error(transparent)]
    Transform(#[from] TransformError),
    /// A file of measurements that cannot be used.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A measurement that cannot be made again.
    #[error("{}: {reason}", file.display())]
    Verify {
        /// Where it is recorded.
        file: PathBuf,
        /// Why not.
        reason: Box<VerifyError>,
    },
    /// Volumes that are not known.
    #[error(transparent)]
    Volumes(#[from] VolumesError),
    /// Volumes that are others now.
    #[error("{lost} of {all} volumes do not hold; measure them again")]
    LostVolumes {
        /// Volumes that differ, or are gone.
        lost: usize,
        /// All that were recorded.
        all: usize,
    },
    /// Parts that are not there.
    #[error(transparent)]
    Parts(#[from] PartsError),
    /// A film.
    #[error(transparent)]
    Film(#[from] FilmError),
    /// A list of keys that cannot be used.
    #[error("{}: {reason}", file.display())]
    Keys {
        /// The list.
        file: PathBuf,
        /// What is wrong with it, and what to do.
        reason: String,
    },
    /// Pairs without a difference.
    #[error("{failed} of {all} pairs have no difference; the table says why")]
    SomePairs {
        /// Those without.
        failed: usize,
        /// All.
        all: usize,
    },
    /// A finished folder that cannot get its name.
    #[error("{}: cannot be renamed to {} ({reason}); rename it, or free the name and run again", from.display(), to.display())]
    Move {
        /// Where it is.
        from: PathBuf,
        /// Where it belongs.
        to: PathBuf,
        /// What the system says.
        reason: io::Error,
    },
    /// Lengths that are others now.
    #[error("{lost} of {all} lengths do not hold; measure them again")]
    Lost {
        /// Lengths that differ, or are gone.
        lost: usize,
        /// All that were recorded.
        all: usize,
    },
    /// Registrations that are others now.
    #[error("{moved} of {made} registrations do not hold; register again")]
    Moved {
        /// Those that differ.
        moved: usize,
        /// All that were recorded.
        made: usize,
    },
    /// Wrong usage that only shows once the scans are known; status 2.
    #[error("{0}")]
    Usage(String),
}
