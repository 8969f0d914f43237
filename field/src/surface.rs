//! An isosurface of a scan, where it lies in the world.

use crate::clip::{Clip, Region};
use crate::solid::Solid;
use crate::store::Store;
use crate::with_block;
use bregma_volume::{Covariance, Grid, GridError, Sample, Volume};
use glam::DAffine3;
use std::sync::Arc;
use thiserror::Error;

/// What is measured of a volume: nothing of it is only a way of looking.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// The isovalue, in the volume's values.
    pub iso: f64,
    /// Registration: moves the volume in the world (mm to mm), after its own grid.
    pub transform: DAffine3,
    /// Root mean square distance that the registration leaves between landmarks, mm, where it is known.
    pub residual_mm: Option<f64>,
    /// How sure the registration is, where it is known; it counts in place of the residual.
    pub covariance: Option<Covariance>,
    /// Whether it is measured at all.
    pub visible: bool,
    /// The part of it that is measured, on the volume's samples; all where there is none.
    pub solid: Option<Arc<Solid>>,
}

/// A volume and where it is put: what every tracer takes.
///
/// ```
/// use bregma_field::{Clip, Shape, Surface};
/// use glam::{DAffine3, DVec3};
/// use std::sync::Arc;
///
/// let skull = bregma_synthetic::skull(bregma_synthetic::Which::A, 16, &Default::default())?;
/// let whole = Surface::new(&Arc::new(skull), 226.0, DAffine3::IDENTITY)?;
/// // What is left of its midplane alone.
/// let half = whole.cut(&[Clip::all(Shape::Plane { normal: DVec3::X, offset_mm: 0.0 })], 0);
/// assert_eq!(half.region.halves.len(), 1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Surface {
    /// The scan.
    pub volume: Arc<Volume>,
    /// Its grid, moved by the layer's transform.
    pub grid: Grid,
    /// The isovalue in sample units. Pictures subtract it as float32, measurements as it is. A level outside the samples' range stays
    /// within a range's width of it, since where it lies there makes no difference, and numbers stay finite.
    pub level: f64,
    /// 1 when larger samples are inside the bone, −1 when a negative slope turns that round.
    pub sign: f32,
    /// What cuts leave of it; it is closed there.
    pub region: Region,
    /// Only what lies within it is there; it is closed there, too. On the volume's samples.
    pub solid: Option<Arc<Solid>>,
}

/// Why a scan has no such surface.
#[derive(Debug, Error, PartialEq)]
pub enum SurfaceError {
    /// It cannot be moved there.
    #[error("the transform of a volume cannot be used: {0}")]
    Grid(#[from] GridError),
    /// Its samples were left out when the scan was saved.
    #[error(
        "{name}: only its surfaces of isovalues {low}..{high} were kept, and {iso} is not one; choose one of these, or open the scan that it was saved from"
    )]
    NotKept {
        /// The scan.
        name: String,
        /// The isovalue.
        iso: f64,
        /// The lowest and
        low: f64,
        /// the highest that were kept.
        high: f64,
    },
}

impl Surface {
    /// The isosurface of `volume` at the value `iso`, moved by `transform`.
    pub fn new(volume: &Arc<Volume>, iso: f64, transform: DAffine3) -> Result<Self, SurfaceError> {
        if let Some([low, high]) = volume.kept().surfaces.filter(|_| !volume.kept().has_surface(iso)) {
            return Err(SurfaceError::NotKept { name: volume.name().to_owned(), iso, low, high });
        }
        let grid = volume.grid().moved(transform)?;
        let sign = if volume.slope() < 0.0 { -1.0 } else { 1.0 };
        let [low, high] = volume.histogram().range;
        let beyond = high - low + 1.0;
        let level = volume.sample_of(iso).clamp(low - beyond, high + beyond);
        Ok(Self { grid, level, sign, volume: Arc::clone(volume), region: Region::default(), solid: None })
    }

    /// What `clips` leave of it, as the layer of number `index`.
    pub fn cut(self, clips: &[Clip], index: usize) -> Self {
        Self { region: Region::of(clips, index), ..self }
    }

    /// What lies of it within a solid on its volume's samples; all where there is none.
    ///
    /// # Panics
    /// Where the solid was made for a grid of another size.
    pub fn within(self, solid: Option<Arc<Solid>>) -> Self {
        assert!(solid.as_ref().is_none_or(|solid| solid.dims() == self.volume.grid().dims()), "a solid on the samples of its scan");
        Self { solid, ..self }
    }

    /// Whether a sample is bone, ties included, whatever cuts leave of it.
    #[inline]
    pub fn holds(&self, at: [usize; 3]) -> bool {
        with_block!(Store::of(&self.volume).whole(), b => f64::from(self.sign) * (b.at(at).to_f64() - self.level) >= 0.0)
    }

    /// Whether all of it is there.
    pub fn is_whole(&self) -> bool {
        self.region.is_all() && self.solid.is_none()
    }
}
