//! How far a length, or a difference of two, may be from the truth: named parts, each half the width of an interval that holds it in 95 of 100
//! cases, and their total.
//!
//! Parts that vary at random are added as squares; what blur does is a shift of known size that is left uncorrected, and is added to that as
//! it is (JCGM 100:2008, "Guide to the expression of uncertainty in measurement", 5.1.2 and F.2.4.5).

use crate::edge::{Edge, spacing_along_mm};
use bregma_field::crossings::Crossing;
use bregma_field::interpolant::weighted;
use bregma_field::{Covariance, Ray, Surface, WorldPoint};
use glam::DVec3;
use serde::Serialize;
use std::f64::consts::PI;

/// The uncertainty of a length or of a difference of two, mm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Uncertainty {
    /// Brackets of the two roots.
    pub root_error_mm: f64,
    /// The isovalue may be another by its tolerance; it moves both ends at once. Infinite (null in JSON) where the value does not change
    /// along the ray.
    pub threshold_error_mm: f64,
    /// Noise of the samples around both ends.
    pub noise_error_mm: f64,
    /// Between samples the scan is not what interpolation makes of it: as far as an edge of this blur, seen along this ray, is off on
    /// average over all places that it may have between the samples.
    pub sampling_error_mm: f64,
    /// Slices lie elsewhere than the grid has them: as far as that moves the ends, each with its slice.
    pub slice_error_mm: f64,
    /// Shift of both ends by blur: toward the hollow side of a curved boundary, and into a wall whose other side is near.
    pub blur_error_mm: f64,
    /// The volume's registration: as far as moving the scan by its covariance, or by its residual, changes the length; null where neither is
    /// known, and infinite (null in JSON) where a motion that it left undetermined changes it.
    pub registration_error_mm: Option<f64>,
    /// Total.
    pub error_mm: f64,
}

/// An interval of so many standard deviations holds 95 of 100 values.
pub const IN_95_OF_100: f64 = 1.96;

/// One end of a length.
#[derive(Clone, Copy, Debug)]
pub struct End<'a> {
    /// Where it is.
    pub crossing: &'a Crossing,
    /// What the scan shows of the boundary there; `None` at a cut, or where it shows none.
    pub edge: Option<Edge>,
    /// Half the way to the nearest other end, along the ray.
    pub reach_mm: f64,
}

impl End<'_> {
    /// A boundary of bone, and not a cut of the scan or of the ray.
    pub fn is_boundary(&self) -> bool {
        !(self.crossing.clipped || self.crossing.at_origin)
    }

    /// Outward unit normal.
    pub fn normal(&self) -> DVec3 {
        self.edge.map_or(self.crossing.normal, |edge| edge.normal)
    }

    /// Angle between the ray and the normal, degrees, 0 to 90.
    pub fn obliquity_deg(&self, ray: &Ray) -> f64 {
        self.cosine(ray).acos().to_degrees()
    }

    /// Cosine of that angle.
    pub fn cosine(&self, ray: &Ray) -> f64 {
        self.normal().dot(ray.direction).abs().min(1.0)
    }

    /// The thinnest wall that can be measured, across it, mm: the width of the blur, or one and a half samples. Thinner ones never show their
    /// value, and may lie between the samples.
    pub fn resolution_mm(&self, surface: &Surface) -> f64 {
        let samples_mm = LEAST_SAMPLES_ACROSS * spacing_along_mm(surface, self.normal());
        self.edge.map_or(samples_mm, |edge| edge.blur_width_mm().max(samples_mm))
    }

    /// Change of the value along the ray per mm.
    fn slope(&self, surface: &Surface, iso: f64, ray: &Ray) -> f64 {
        let of_interpolant = (self.crossing.slope_per_mm * surface.volume.slope()).abs();
        self.edge.map_or(of_interpolant, |edge| {
            let z = edge.deviations_at(iso);
            (edge.inside - edge.outside).abs() * (-0.5 * z * z).exp() / ((2.0 * PI).sqrt() * edge.blur_mm) * self.cosine(ray)
        })
    }

    /// How far blur moves the end into the bone, across the wall, mm: a curved boundary of blur σ and curvatures κ by (σ² + h²/6)(κ₁ + κ₂)/2 (the
    /// mean of a Gaussian over a ball's rim, to second order, and of the interpolation between samples h apart along it, whose kernel has the
    /// variance h²/6), and one with another boundary `wall_mm` behind it by what that takes from its value.
    fn shift_mm(&self, surface: &Surface, wall_mm: f64) -> f64 {
        self.edge.map_or(0.0, |edge| {
            let other = (2.0 * PI).sqrt() * edge.blur_mm * 0.5 * libm::erfc(wall_mm / (edge.blur_mm * 2.0_f64.sqrt()));
            let steps = surface.grid.index_to_world().matrix3;
            let all: f64 =
                [steps.x_axis, steps.y_axis, steps.z_axis].map(|step| step.length_squared() - step.dot(edge.normal).powi(2)).iter().sum();
            (edge.blur_mm.powi(2) + all / 2.0 / 6.0) * edge.curvature / 2.0 + other
        })
    }
}

/// See [`End::resolution_mm`].
const LEAST_SAMPLES_ACROSS: f64 = 1.5;

impl Edge {
    /// Where the model has a value: deviations of its blur outward from the boundary. Values beyond its plateaus count as nearly there.
    fn deviations_at(&self, value: f64) -> f64 {
        let part = ((value - self.outside) / (self.inside - self.outside)).clamp(0.02, 0.98);
        // Bisection: the part inside falls from 1 to 0.
        let (mut low, mut high) = (-3.0, 3.0);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if (self.value(middle * self.blur_mm) - self.outside) / (self.inside - self.outside) > part {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }
}

/// What is known of how far one end is off, along the ray.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EndError {
    /// A boundary of bone, and not a cut of the scan or of the ray.
    pub is_boundary: bool,
    root_mm: f64,
    threshold_mm: f64,
    /// Standard deviations.
    noise_mm: f64,
    sampling_mm: f64,
    /// How far it moves into the bone when its slice is a standard deviation higher up than the grid has it, and where it lies among the slices.
    slice_mm: f64,
    slice: f64,
    /// How far blur moves it into the bone.
    blur_mm: f64,
    /// How far it moves into the bone for each mm that the scan moves. The ray's own origin stays.
    moved: DVec3,
    /// That about the world's origin: its place × `moved`.
    turned_mm: DVec3,
}

/// What is known of both ends of a stretch of `surface` along `ray`, at the isovalue `iso` with its `tolerance` (values).
pub fn of_ends(surface: &Surface, iso: f64, tolerance: f64, ray: &Ray, ends: [End<'_>; 2]) -> [EndError; 2] {
    let length_mm = ends[1].crossing.t_mm - ends[0].crossing.t_mm;
    let boundaries = || ends.iter().filter(|end| end.is_boundary());
    let wall_mm = length_mm * boundaries().map(|end| end.cosine(ray)).fold(1.0, f64::min);
    [(&ends[0], 1.0), (&ends[1], -1.0)].map(|(end, into)| of_end(surface, iso, tolerance, ray, wall_mm, end, into))
}

/// What is known of one end: where the ray goes `into` the bone (1) or out of it (−1) through a wall of `wall_mm`.
pub fn of_end(surface: &Surface, iso: f64, tolerance: f64, ray: &Ray, wall_mm: f64, end: &End<'_>, into: f64) -> EndError {
    // Moving the scan by v moves an end by v·n/(n·d).
    let moved = if end.crossing.at_origin { DVec3::ZERO } else { into * end.normal() / end.normal().dot(ray.direction) };
    let turned_mm = ray.at(end.crossing.t_mm).0.cross(moved);
    let (slice_mm, slice) = (moved.dot(slice_off_mm(surface)), end.crossing.point.0.z);
    let at_cut = EndError { root_mm: end.crossing.error_mm, slice_mm, slice, moved, turned_mm, ..EndError::default() };
    if !end.is_boundary() {
        return at_cut;
    }
    EndError {
        is_boundary: true,
        threshold_mm: tolerance / end.slope(surface, iso, ray),
        noise_mm: end.edge.map_or(0.0, |edge| noise_mm(end, edge, surface, iso, ray)),
        sampling_mm: sampling_mm(end, surface, iso, ray),
        blur_mm: end.shift_mm(surface, wall_mm) / end.cosine(ray),
        ..at_cut
    }
}

impl EndError {
    /// What is known of another place nearby, where this is of a ray against its own normal: where the ray of `direction` goes `into` the bone
    /// (1) or out of it (−1) at `point` with its outward `normal` (world).
    pub fn nearby(&self, surface: &Surface, point: DVec3, normal: DVec3, direction: DVec3, into: f64) -> Self {
        let along = normal.dot(direction);
        let moved = into * normal / along;
        let oblique = 1.0 / along.abs();
        Self {
            threshold_mm: self.threshold_mm * oblique,
            noise_mm: self.noise_mm * oblique,
            sampling_mm: self.sampling_mm * oblique,
            blur_mm: self.blur_mm * oblique,
            slice_mm: moved.dot(slice_off_mm(surface)),
            slice: surface.grid.index(WorldPoint(point)).0.z,
            moved,
            turned_mm: point.cross(moved),
            ..*self
        }
    }

    /// How far blur moves it into the bone, mm.
    pub fn blur_mm(&self) -> f64 {
        self.blur_mm
    }

    /// A place that errs by its scan's registration alone, along the unit vector `along`.
    pub fn moved_along(point: DVec3, along: DVec3) -> Self {
        Self { moved: along, turned_mm: point.cross(along), ..Self::default() }
    }

    /// The sum of what many have in common, each times its weight: noise and the places of the samples, by which each errs by itself, leave
    /// nothing in a mean.
    pub fn common(all: impl Iterator<Item = (Self, f64)>) -> Self {
        all.fold(Self { is_boundary: true, ..Self::default() }, |sum, (end, weight)| Self {
            threshold_mm: sum.threshold_mm + weight * end.threshold_mm,
            blur_mm: sum.blur_mm + weight * end.blur_mm,
            moved: sum.moved + weight * end.moved,
            turned_mm: sum.turned_mm + weight * end.turned_mm,
            ..sum
        })
    }
}

/// What is known of how far a scan's registration is off.
#[derive(Clone, Copy, Debug, Default)]
pub struct Registered<'a> {
    /// The residual that it leaves between landmarks, root mean square, mm.
    pub residual_mm: Option<f64>,
    /// Its covariance, which counts in place of the residual.
    pub covariance: Option<&'a Covariance>,
}

impl Registered<'_> {
    /// Anything.
    pub fn is_known(self) -> bool {
        self.residual_mm.is_some() || self.covariance.is_some()
    }

    /// Standard deviation of what it adds to a sum of ends, mm.
    fn deviation_mm(self, ends: &[EndError]) -> f64 {
        let moved: DVec3 = ends.iter().map(|end| end.moved).sum();
        match self.covariance {
            Some(covariance) => covariance.variance(moved, ends.iter().map(|end| end.turned_mm).sum()).sqrt(),
            // A third of the residual's square lies along any one direction.
            None => moved.length() * self.residual_mm.unwrap_or(0.0) / 3.0_f64.sqrt(),
        }
    }
}

/// Ends of one scan whose errors are added, and what is known of its registration.
#[derive(Clone, Copy, Debug)]
pub struct Ends<'a> {
    /// The ends.
    pub of: &'a [EndError],
    /// The registration.
    pub registered: Registered<'a>,
}

/// The uncertainty of what is measured between ends of one scan: a length between two, or the bone in several stretches.
pub fn of_length(ends: Ends<'_>) -> Uncertainty {
    of_difference([Ends { of: &[], registered: Registered::default() }, ends])
}

/// The uncertainty of how much larger the second scan's length is than the first's, or of how far its end lies behind the first's.
///
/// Within a scan the isovalue moves all ends at once, and so does a registration; between scans, that are calibrated and registered each by
/// itself, both are independent, as noise and the places of samples are of all ends. Blur moves the ends of both scans into the bone, and
/// what that takes from both is not in the difference.
pub fn of_difference(scans: [Ends<'_>; 2]) -> Uncertainty {
    let all = || scans.iter().flat_map(|scan| scan.of);
    let of_both = |part: &dyn Fn(Ends<'_>) -> f64| part(scans[0]).hypot(part(scans[1]));
    let root_error_mm = all().map(|end| end.root_mm).sum();
    let threshold_error_mm = of_both(&|scan| scan.of.iter().map(|end| end.threshold_mm).sum());
    let noise = all().map(|end| end.noise_mm.powi(2)).sum::<f64>().sqrt();
    let sampling = all().map(|end| end.sampling_mm.powi(2)).sum::<f64>().sqrt();
    let slice_error_mm = IN_95_OF_100 * of_both(&|scan| of_slices_mm(scan.of));
    let [first, second] = scans.map(|scan| scan.of.iter().map(|end| end.blur_mm).sum::<f64>());
    let blur_error_mm = (second - first).abs();
    let registered = |scan: Ends<'_>| scan.registered.deviation_mm(scan.of);
    let is_registered = scans.iter().any(|scan| scan.registered.is_known());
    let registration_error_mm = is_registered.then(|| IN_95_OF_100 * of_both(&registered));
    let (noise_error_mm, sampling_error_mm) = (IN_95_OF_100 * noise, IN_95_OF_100 * sampling);
    let registered_mm = registration_error_mm.unwrap_or(0.0);
    let parts = [root_error_mm, threshold_error_mm, noise_error_mm, sampling_error_mm, slice_error_mm, registered_mm];
    Uncertainty {
        root_error_mm,
        threshold_error_mm,
        noise_error_mm,
        sampling_error_mm,
        slice_error_mm,
        blur_error_mm,
        registration_error_mm,
        error_mm: parts.iter().map(|part| part * part).sum::<f64>().sqrt() + blur_error_mm,
    }
}

/// How far a slice is off, as a vector: one standard deviation. Of an error nothing is known but its largest size, so that all up to it are as
/// likely (JCGM 100:2008, 4.3.7).
fn slice_off_mm(surface: &Surface) -> DVec3 {
    let steps = surface.volume.slice_position_mm() / surface.volume.grid().spacing_mm().z;
    surface.grid.index_to_world().matrix3.z_axis * steps / 3.0_f64.sqrt()
}

/// Standard deviation of what ends of one scan are off together by where its slices lie. Slices are off each by itself, so that ends move
/// together as far as they lie between the same two.
fn of_slices_mm(ends: &[EndError]) -> f64 {
    let together = |a: &EndError, b: &EndError| (1.0 - (a.slice - b.slice).abs()).max(0.0);
    let square: f64 = ends.iter().flat_map(|a| ends.iter().map(move |b| a.slice_mm * b.slice_mm * together(a, b))).sum();
    // Rounding can leave less than nothing where the ends' shifts cancel.
    square.max(0.0).sqrt()
}

/// Standard deviation of an end along the ray by the samples' noise.
fn noise_mm(end: &End<'_>, edge: Edge, surface: &Surface, iso: f64, ray: &Ray) -> f64 {
    // Interpolation averages eight samples with these weights.
    let local = end.crossing.point.0 - end.crossing.cell.as_dvec3();
    let weight: f64 = local.to_array().map(|u| u * u + (1.0 - u) * (1.0 - u)).iter().product::<f64>().sqrt();
    weight * edge.noise / end.slope(surface, iso, ray)
}

/// Places of the samples that are tried: well spread in a cell (Halton 1960, bases 2, 3 and 5).
const PLACES: [[f64; 3]; 12] = [
    [0.5, 0.333, 0.2],
    [0.25, 0.667, 0.4],
    [0.75, 0.111, 0.6],
    [0.125, 0.444, 0.8],
    [0.625, 0.778, 0.04],
    [0.375, 0.222, 0.24],
    [0.875, 0.556, 0.44],
    [0.0625, 0.889, 0.64],
    [0.5625, 0.037, 0.84],
    [0.3125, 0.37, 0.08],
    [0.8125, 0.704, 0.28],
    [0.1875, 0.148, 0.48],
];

/// Standard deviation of an end along the ray by where the samples lie.
fn sampling_mm(end: &End<'_>, surface: &Surface, iso: f64, ray: &Ray) -> f64 {
    let to_index = surface.grid.world_to_index().matrix3;
    let Some(edge) = end.edge else {
        // Nothing is known of the edge: it lies anywhere between two samples.
        return spacing_along_mm(surface, ray.direction) / 12.0_f64.sqrt();
    };
    let direction = to_index * ray.direction;
    // Distance outward from the boundary per voxel along each axis.
    let rise = surface.grid.index_to_world().matrix3.transpose() * edge.normal;
    let outward = edge.deviations_at(iso) * edge.blur_mm;
    let level = edge.value(outward);
    let off = |place: &[f64; 3]| {
        let place = DVec3::from(*place);
        let value = |t: f64| {
            let p = place + t * direction;
            let cell = p.floor();
            let corner = |c: usize| {
                let at = DVec3::new((c & 1) as f64, (c >> 1 & 1) as f64, (c >> 2) as f64);
                edge.value(outward + rise.dot(cell + at - place))
            };
            weighted(&std::array::from_fn(corner), p - cell) - level
        };
        crossing_near_zero(value, spacing_along_mm(surface, ray.direction))
    };
    (PLACES.iter().map(|place| off(place).powi(2)).sum::<f64>() / PLACES.len() as f64).sqrt()
}

/// Where a function that falls or rises through 0 near 0 does so, within `reach` of it.
fn crossing_near_zero(value: impl Fn(f64) -> f64, reach: f64) -> f64 {
    let (mut low, mut high) = (-reach, reach);
    let rises = value(high) > value(low);
    // Twelve halvings: a four-thousandth of the reach, far below what is estimated.
    for _ in 0..12 {
        let middle = 0.5 * (low + high);
        if (value(middle) > 0.0) == rises { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}
