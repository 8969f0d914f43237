//! How far a volume may be from the truth, in named parts, as [`crate::Uncertainty`] has them for lengths.

use super::sums::{Added, Skin};
use crate::edge::{Edge, spacing_along_mm};
use crate::uncertainty::IN_95_OF_100;
use bregma_field::crossings::crossings;
use bregma_field::{Measured, Ray, Surface, WorldPoint};
use glam::DVec3;
use serde::Serialize;

/// Places at which what the scan shows of the bone's edge is looked at: the median of so many is known to 5 % of the quartiles.
const PLACES: usize = 300;
/// Farther from a place than this many voxels, another boundary changes nothing that is fitted there.
const FAR_VOXEL: f64 = 12.0;
/// Blur that is wider than what an edge is fitted to is none: values change there as in a map of distances, not as at an edge.
const MOST_BLUR_VOXEL: f64 = 3.0;
/// The correction for blur is off by so much of itself where the isovalue is off by its tolerance, since differences between samples do not
/// quite part what bends along a boundary from what bends across it, and on small balls, since it is of first order. Chosen on balls and
/// shells; others hold the truth a little too rarely with it (docs/volumes.md).
const CORRECTION_OFF: f64 = 0.1;
/// ∫ hat² for a hat of one voxel to each side: a sample's weight squared, over all places that the surface may have between two (see
/// `noise_mm3`).
const HAT_SQUARED: f64 = 2.0 / 3.0;

/// How far a volume may be from the truth: each part half the width of an interval that holds it in 95 of 100 cases, mm³.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct VolumeUncertainty {
    /// Of adding up: a coarser rule of quadrature disagrees by so much.
    pub sum_error_mm3: f64,
    /// The isovalue may be another by its tolerance: tolerance·∮ dA/|∇f|.
    pub threshold_error_mm3: f64,
    /// Noise of the samples at the surface.
    pub noise_error_mm3: f64,
    /// Scans may lie elsewhere to each other, or to what cuts them, than their registrations say; null where nothing is known of that, and
    /// infinite (null in JSON) where a motion that is left undetermined changes the volume.
    pub registration_error_mm3: Option<f64>,
    /// What blur and interpolation between samples take from bone whose surface is convex, and give where it is hollow: it is not corrected in
    /// the volume of the surface.
    pub blur_error_mm3: f64,
    /// Total: the root of the sum of squares of the others, and that of blur added as it is (JCGM 100:2008, F.2.4.5).
    pub error_mm3: f64,
}

/// What a scan shows of the edge of its bone: medians over places of its surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Sharpness {
    /// Variance of all blur, mm².
    pub blur_mm2: f64,
    /// Half the distance between its quartiles.
    pub blur_spread_mm2: f64,
    /// Standard deviation of the samples about the edges that are fitted, in the scan's values.
    pub noise: f64,
}

impl Sharpness {
    /// At some of the `points` of `surface`, each with its outward normal; none where no edge can be fitted anywhere.
    pub fn of(surface: &Surface, points: &[(DVec3, DVec3)]) -> Option<Self> {
        let step = points.len().div_ceil(PLACES).max(1);
        let edges: Vec<Edge> = points.iter().step_by(step).filter_map(|(point, normal)| edge_at(surface, *point, *normal)).collect();
        let quartile = |part: f64, number: &dyn Fn(&Edge) -> f64| {
            let mut all: Vec<f64> = edges.iter().map(number).collect();
            all.sort_unstable_by(f64::total_cmp);
            all.get((part * all.len() as f64) as usize).copied()
        };
        let blur = |part: f64| quartile(part, &|edge| edge.blur_mm * edge.blur_mm);
        Some(Self { blur_mm2: blur(0.5)?, blur_spread_mm2: 0.5 * (blur(0.75)? - blur(0.25)?), noise: quartile(0.5, &|edge| edge.noise)? })
    }
}

/// The edge at a point of the surface, from the samples that belong to no other boundary.
fn edge_at(surface: &Surface, point: DVec3, normal: DVec3) -> Option<Edge> {
    let voxel_mm = spacing_along_mm(surface, normal);
    let far_mm = FAR_VOXEL * voxel_mm;
    let ray = Ray { origin: WorldPoint(point + far_mm * normal), direction: -normal };
    let met: Vec<f64> = crossings(surface, &ray).iter().map(|c| c.t_mm).collect();
    let own = (0..met.len()).min_by(|a, b| (met[*a] - far_mm).abs().total_cmp(&(met[*b] - far_mm).abs()))?;
    let half = |other: Option<&f64>| other.map_or(far_mm, |t| 0.5 * (t - met[own]).abs()).max(0.75 * voxel_mm);
    let edge = Edge::at(surface, point, normal, half(met.get(own + 1)), half(own.checked_sub(1).and_then(|n| met.get(n))))?;
    (edge.blur_mm <= MOST_BLUR_VOXEL * voxel_mm).then_some(edge)
}

/// What is known of one scan that bounds a volume.
#[derive(Clone, Copy, Debug)]
pub struct Known<'a> {
    pub surface: &'a Surface,
    pub measured: &'a Measured,
    /// Of the isovalue, in the scan's values.
    pub tolerance: f64,
    pub sharpness: Option<Sharpness>,
}

/// The part of a scan's surface that bounds a volume: outward of it, or turned round where it lies in the other and is taken away.
#[derive(Clone, Copy, Debug)]
pub struct Bounding<'a> {
    pub known: &'a Known<'a>,
    pub skin: Skin,
    /// 1, or −1 where the volume lies outside of the scan's bone.
    pub sign: f64,
    /// Whether the volume changes where the scan moves.
    pub moves: bool,
}

impl Bounding<'_> {
    fn per_value_mm3(&self) -> f64 {
        (self.skin.per_level / self.known.surface.volume.slope()).abs()
    }

    /// By how much blur and interpolation have made the volume smaller, mm³, and how unsure that is.
    fn blurred_mm3(&self) -> [f64; 2] {
        let sharp = self.known.sharpness.unwrap_or_default();
        let by_blur = self.skin.per_blur * sharp.blur_mm2;
        [self.sign * (by_blur + self.skin.by_interpolation), self.skin.per_blur * sharp.blur_spread_mm2]
    }

    /// Standard deviation by noise: sample i moves the volume by nᵢ·∮ φᵢ dA/|∇f|, φᵢ the hat that interpolation gives it. Where the surface
    /// is flat over a voxel that integral is h²·hat(d)/|∇f| with its distance d from the surface in voxels; squared and summed over samples,
    /// with the mean of hat² over all places: h²·⅔·∮ dA/|∇f|².
    fn noise_mm3(&self) -> f64 {
        let surface = self.known.surface;
        let noise = self.known.sharpness.unwrap_or_default().noise / surface.volume.slope().abs();
        let voxel_mm = surface.grid.index_to_world().matrix3.determinant().abs().cbrt();
        noise * voxel_mm * (HAT_SQUARED * self.skin.per_noise).sqrt()
    }

    /// Standard deviation by the registration; none where nothing is known of it.
    fn moved_mm3(&self) -> Option<f64> {
        let Measured { residual_mm, covariance, .. } = self.known.measured;
        if covariance.is_none() && residual_mm.is_none() {
            return None;
        }
        let (pull, moment) = (self.skin.pull_mm2, self.skin.moment_mm3);
        Some(match (covariance, self.moves) {
            (_, false) => 0.0,
            (Some(covariance), _) => covariance.variance(pull, moment).sqrt(),
            // A third of the residual's square lies along any one direction.
            (None, _) => pull.length() * residual_mm.unwrap_or(0.0) / 3.0_f64.sqrt(),
        })
    }
}

/// A measured volume.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Measure {
    /// Of what, in words.
    pub what: String,
    /// Of the solid that the interpolant bounds, mm³.
    pub volume_mm3: f64,
    /// How far that may be from the truth.
    pub uncertainty: VolumeUncertainty,
    /// The same without what blur and interpolation do to curved surfaces (to first order), mm³.
    pub unblurred_mm3: f64,
    /// Its ±.
    pub unblurred_error_mm3: f64,
    /// The surface of bone that bounds it, without flat sides of cuts, mm².
    pub area_mm2: f64,
    /// ∮ dA/|∇f|: by how much the volume changes for each unit of the isovalue, mm³.
    pub per_isovalue_mm3: f64,
}

impl Measure {
    /// Of sums, the mean of which is the volume, and of the surfaces that bound it.
    pub fn of(what: String, sums: &[Added], bounds: &[Bounding<'_>]) -> Self {
        let mean = |number: &dyn Fn(&Added) -> f64| sums.iter().map(number).sum::<f64>() / sums.len() as f64;
        let volume_mm3 = mean(&|added| added.volume_mm3);
        let sum_error_mm3 = mean(&Added::error_mm3);
        let together = |part: &dyn Fn(&Bounding<'_>) -> f64| bounds.iter().map(|b| part(b).powi(2)).sum::<f64>().sqrt();
        let threshold_error_mm3 = together(&|b| b.known.tolerance * b.per_value_mm3());
        let noise_error_mm3 = IN_95_OF_100 * together(&|b| b.noise_mm3());
        let is_registered = bounds.iter().any(|b| b.moved_mm3().is_some());
        let registration_error_mm3 = is_registered.then(|| IN_95_OF_100 * together(&|b| b.moved_mm3().unwrap_or(0.0)));
        let blurred_mm3: f64 = bounds.iter().map(|b| b.blurred_mm3()[0]).sum();
        let parts = [sum_error_mm3, threshold_error_mm3, noise_error_mm3, registration_error_mm3.unwrap_or(0.0)];
        let square: f64 = parts.iter().map(|part| part * part).sum();
        Self {
            what,
            volume_mm3,
            uncertainty: VolumeUncertainty {
                sum_error_mm3,
                threshold_error_mm3,
                noise_error_mm3,
                registration_error_mm3,
                blur_error_mm3: blurred_mm3.abs(),
                error_mm3: square.sqrt() + blurred_mm3.abs(),
            },
            unblurred_mm3: volume_mm3 + blurred_mm3,
            // The correction errs with the isovalue, so that both are added as they are.
            unblurred_error_mm3: square.sqrt().hypot(together(&|b| b.blurred_mm3()[1])) + CORRECTION_OFF * blurred_mm3.abs(),
            area_mm2: bounds.iter().map(|b| b.skin.area_mm2).sum(),
            per_isovalue_mm3: bounds.iter().map(Bounding::per_value_mm3).sum(),
        }
    }
}
