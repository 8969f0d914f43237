//! Where solvers fail: hard families of cells, and hard volumes and views, each solver's answers against float64.
//!
//! A family of segments is a way to make a cell and a ray through it; a family of pictures is volumes and views that need the whole
//! renderer. What they ask may be beyond float32 as such: where moving a cell's values by a few units in their last place, or a pixel's
//! ray sideways by a hundred-thousandth of a voxel, changes the reference's own answer. That is counted as undecidable and not judged.

mod faces;
mod judge;
mod pictures;
mod random;
mod segments;
mod table;
mod views;

#[cfg(test)]
pub(crate) use random::Random;
pub use segments::Segment;
pub use table::{csv, markdown};

use crate::accuracy::{Quantiles, TruthError};
use crate::roots::Solver;
use crate::{RenderError, Renderer};
use bregma_field::{Cancelled, Progress};
use judge::Judge;
use serde::Serialize;

/// Values are moved by this part of the largest to see what float32 can decide: 16 units in the last place, for the two dozen
/// roundings of an interpolation, of which a few add up.
const DOUBT: f64 = 16.0 * f32::EPSILON as f64;
/// Answers that move by more than this, in voxels, when values are moved by the doubt are not decidable. Behind a root the next one is
/// sought from this much farther on.
pub(crate) const DECIDED_VOXEL: f64 = 1e-3;

/// What a solver made of a family.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// The family.
    pub family: &'static str,
    /// `cpu` or `gpu`.
    pub backend: &'static str,
    /// The solver.
    pub solver: Solver,
    /// What the family is of.
    pub of: Of,
    /// Segments or rays judged.
    pub judged: u32,
    /// Those that float32 cannot decide; of rays, where the answer is not the reference's.
    pub undecidable: u32,
    /// Entries that were not found.
    pub missed: u32,
    /// Entries that are none.
    pub false_hits: u32,
    /// Answers nearer to a later crossing than to the first entry.
    pub wrong_root: u32,
    /// Entries along the whole segment; `None` for pictures, and where no segment can be judged.
    pub counts: Option<Counts>,
    /// The way from cell to cell; `None` for pictures, and where no face can be judged.
    pub faces: Option<Faces>,
    /// How far entries are from where they were found, in voxels, with those nearer to a later crossing; `None` where none was found.
    pub error_voxel: Option<Quantiles>,
}

/// What a family is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Of {
    /// Segments of single cells.
    Segments,
    /// Rays of pictures.
    Rays,
}

/// Whether a solver finds every entry of a segment and no more, going on from each root.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Counts {
    /// Segments whose crossings are all apart from each other and from the ends.
    pub judged: u32,
    /// Those with another number of entries.
    pub wrong: u32,
}

/// Whether a surface at the face between two cells is met once.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Faces {
    /// Faces passed.
    pub passed: u32,
    /// Neither cell has the entry.
    pub cracks: u32,
    /// The first cell has it, and the second has another one.
    pub double_hits: u32,
}

impl Row {
    fn new(family: &'static str, backend: &'static str, solver: Solver, of: Of) -> Self {
        Self {
            family,
            backend,
            solver,
            of,
            judged: 0,
            undecidable: 0,
            missed: 0,
            false_hits: 0,
            wrong_root: 0,
            counts: None,
            faces: None,
            error_voxel: None,
        }
    }

    /// Whether anything is wrong, an error of 1e-3 voxel not rare, or one of a voxel there.
    pub fn fails(&self) -> bool {
        self.loses() || self.is_off() || self.miscounts() || self.tears()
    }

    /// Entries are missed, invented or taken for one another.
    fn loses(&self) -> bool {
        self.missed + self.false_hits + self.wrong_root > 0
    }

    fn is_off(&self) -> bool {
        self.error_voxel.is_some_and(|e| e.p999 > DECIDED_VOXEL || e.max > 1.0)
    }

    fn miscounts(&self) -> bool {
        self.counts.is_some_and(|c| c.wrong > 0)
    }

    /// The way from cell to cell has cracks or double hits.
    fn tears(&self) -> bool {
        self.faces.is_some_and(|f| f.cracks + f.double_hits > 0)
    }
}

/// What a solver made of a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solved {
    /// u of the first entry.
    pub entry: Option<f32>,
    /// Entries along the segment, going on behind each root.
    pub entries: u32,
}

/// A renderer whose solvers can be asked about single cells.
pub trait SolveSegments: Renderer {
    /// What `solver` makes of each segment.
    fn solve(&mut self, solver: Solver, segments: &[Segment]) -> Result<Vec<Solved>, RenderError>;
}

/// Why there is no table.
#[derive(Debug, thiserror::Error)]
pub enum StabilityError {
    /// Stopped by request.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The GPU failed.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A view that has no truth.
    #[error(transparent)]
    Truth(#[from] TruthError),
}

/// Name of every family, and what is hard about it; in the order of the table.
pub fn families() -> impl Iterator<Item = (&'static str, &'static str)> {
    segments::FAMILIES.iter().map(|f| (f.name, f.about)).chain(views::FAMILIES.iter().map(|f| (f.name, f.about)))
}

/// Judges every solver over every family on each of `machines` that has it. Progress counts families.
pub fn run(machines: &mut [&mut dyn SolveSegments], progress: &Progress) -> Result<Vec<Row>, StabilityError> {
    progress.begin(families().count() as u64);
    let mut rows = Vec::new();
    for (number, family) in segments::FAMILIES.iter().enumerate() {
        let judge = Judge::of(family, number);
        for solver in Solver::ALL {
            for machine in machines.iter_mut().filter(|m| m.has(solver)) {
                rows.push(judge.row(family.name, &mut **machine, solver)?);
            }
        }
        progress.advance(1)?;
    }
    for family in views::FAMILIES {
        rows.extend(pictures::rows(family, machines)?);
        progress.advance(1)?;
    }
    Ok(rows)
}
