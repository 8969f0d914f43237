//! When two surfaces are one, and how far apart they are when the picture says so in colours.

use crate::layer::Layer;
use crate::scene::Scene;
use bregma_field::{Bounds, Covariance, Volume};
use glam::DVec3;
use std::sync::Arc;

/// Of the size of what is seen (the radius of a ball around it): what lies farther apart is not the same part of a skull.
const FAR_APART: f64 = 1.0 / 40.0;

impl Scene {
    /// How near to each other surfaces count as one: as is said, or half a voxel of the coarser scan, or how sure a registration is if that is less:
    /// what lies nearer than that is no difference.
    pub fn agreement_mm(&self, volumes: &[Arc<Volume>]) -> f64 {
        let of = |(layer, volume): (&Layer, &Arc<Volume>)| {
            let voxel_mm = volume.grid().spacing_mm().element_product().cbrt();
            // Of one coordinate, at the middle of what was registered: the root of the mean variance, and what holds 95 %.
            let variance = |c: &Covariance| {
                [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| c.variance(axis, c.centre_mm.cross(axis))).iter().sum::<f64>() / 3.0
            };
            let sure_mm = layer.covariance.as_ref().map(|c| 1.96 * variance(c).sqrt()).filter(|mm| mm.is_finite());
            (0.5 * voxel_mm).max(sure_mm.or(layer.residual_mm).unwrap_or(0.0))
        };
        let visible = self.layers.iter().zip(volumes).filter(|(layer, _)| layer.visible);
        self.agree_within_mm.unwrap_or_else(|| visible.map(of).fold(0.0, f64::max))
    }

    /// How far apart along the ray surfaces lie at the ends of the colours of [`Mode::Depths`](crate::Mode::Depths), mm: as is said, or a round number
    /// of about a fortieth of the scans' size.
    pub fn depth_range_mm(&self, volumes: &[Arc<Volume>]) -> f64 {
        self.depths_within_mm.unwrap_or_else(|| round_up(FAR_APART * Bounds::of(volumes.iter().map(|v| v.grid())).radius_mm))
    }
}

/// The next of 1, 2 and 5 times a power of ten.
fn round_up(length_mm: f64) -> f64 {
    let ten = 10.0_f64.powf(length_mm.max(1e-6).log10().floor());
    [1.0, 2.0, 5.0, 10.0].map(|n| n * ten).into_iter().find(|round| *round >= length_mm).unwrap_or(10.0 * ten)
}
