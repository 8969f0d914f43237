//! Filters of a scan's samples, each making a scan of its own beside the old one. They are ITK's, to its boundary (beyond the grid stands the nearest
//! sample) and its constants, so that what was published with these can be made again; `benches/filters.py` holds them to SimpleITK.

mod diffusion;
mod gaussian;
mod median;

use crate::store::Store;
use crate::with_block;
use bregma_volume::{Cancelled, Progress, Samples, Volume};
use std::fmt;

/// What is done to samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Filter {
    /// Weighted means by the discrete Gaussian (Lindeberg 1990), as ITK's `DiscreteGaussian` with a maximum error of 10⁻⁵, of a standard deviation
    /// in mm. Samples become float32.
    Gaussian {
        /// Standard deviation.
        sigma_mm: f64,
    },
    /// The median of all samples within so many along each axis, as ITK's `Median`. Samples keep their type.
    Median {
        /// From 1 to [`MOST_RADIUS`].
        radius: usize,
    },
    /// Diffusion that stops at edges (Perona and Malik 1990), as ITK's `GradientAnisotropicDiffusion`. Samples become float32.
    Diffusion {
        /// Steps in time.
        iterations: usize,
        /// Edges that are this many times as steep as the scan's gradients are in the mean (root of the mean square) are hardly smoothed.
        conductance: f64,
        /// Length of a step; stable up to the shortest spacing in mm / 16.
        time_step: f64,
    },
}

/// A window of more samples than this radius spans has more than 16 bits count.
pub const MOST_RADIUS: usize = 15;

impl fmt::Display for Filter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Gaussian { sigma_mm } => write!(f, "Gaussian {sigma_mm} mm"),
            Self::Median { radius } => write!(f, "median {radius}"),
            Self::Diffusion { iterations, conductance, time_step } => {
                write!(f, "diffusion {iterations} × {time_step}, conductance {conductance}")
            }
        }
    }
}

/// Under this name metadata says which filters a scan went through, in their order.
const FILTERED: &str = "Filtered";

/// `volume` after a filter, under a name that says so. It needs memory for the samples that it makes, and a few slices more for each thread.
pub fn filtered(volume: &Volume, filter: Filter, progress: &Progress) -> Result<Volume, Cancelled> {
    let dims = volume.grid().dims();
    let samples = with_block!(Store::of(volume).whole(), b => {
        let samples = b.onward([0; 3]);
        match filter {
            Filter::Gaussian { sigma_mm } => {
                let variances = volume.grid().spacing_mm().to_array().map(|mm| (sigma_mm / mm).powi(2));
                Samples::F32(gaussian::smoothed(samples, dims, variances, progress)?)
            }
            Filter::Median { radius } => median::medians(samples, dims, radius.clamp(1, MOST_RADIUS), progress)?,
            Filter::Diffusion { iterations, conductance, time_step } => {
                let diffusion = diffusion::Diffusion { dims, spacing_mm: volume.grid().spacing_mm(), conductance, time_step };
                Samples::F32(diffusion.run(samples, iterations, progress)?)
            }
        }
    });
    let mut metadata = volume.metadata().clone();
    let before = metadata.get(FILTERED).map_or(String::new(), |before| format!("{before}; "));
    metadata.insert(FILTERED.to_owned(), format!("{before}{filter}"));
    // There is one for each sample, and none of them is farther out than the scan's.
    let made = volume.with_samples(samples).expect("means and medians of a volume's samples are a volume");
    Ok(made.with_metadata(metadata).called(format!("{} ({filter})", volume.name())))
}

#[cfg(test)]
mod tests;
