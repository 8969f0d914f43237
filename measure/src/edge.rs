//! What a scan shows of the boundary of bone at a point: the plateaus on both sides, the blur between them, and the noise.
//!
//! A step blurred by a Gaussian is fitted to the samples around (an edge spread function over all distances from the boundary, as in slanted
//! edge measurements: ISO 12233; Reichenbach and others 1991, Optical Engineering 30(2), 170–177). The boundary is a plane with a tilt and a
//! curvature of its own, so that neither is taken for blur.

use bregma_field::{IndexPoint, Sample, Store, Surface, WorldPoint, with_block};
use glam::DVec3;
use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// A fitted boundary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Value outside the bone.
    pub outside: f64,
    /// Value inside the bone.
    pub inside: f64,
    /// Standard deviation of all blur along the normal: the scanner's and the averaging over a voxel; mm.
    pub blur_mm: f64,
    /// Outward unit normal of the boundary.
    pub normal: DVec3,
    /// Distance of the boundary from the point along `normal`, mm. The boundary is where the value is halfway between the plateaus.
    pub offset_mm: f64,
    /// Sum of the two principal curvatures, per mm; positive where the bone is convex.
    pub curvature: f64,
    /// Standard deviation of the samples about the fit, in values.
    pub noise: f64,
}

/// Samples farther than this from the point are not looked at, in voxels along each axis: three show both plateaus of an edge as sharp as
/// scanners make them (blur of up to a voxel and a half), and little else.
const REACH_VOXEL: f64 = 3.0;
/// Fewer samples than thrice the parameters say nothing about noise.
const LEAST_SAMPLES: usize = 3 * PARAMETERS;
const PARAMETERS: usize = 9;
/// Steps of the fit; most end after six.
const MOST_STEPS: usize = 20;
/// A fit ends when the sum of squares changes by less than this part: its parameters are then far better known than the samples allow.
const CONVERGED: f64 = 1e-5;
/// A tilt of 0.5 and a curvature radius of two voxels are unlikely: as strong as samples that are off by `PRIOR_STEP` of the step.
const PRIOR_STEP: f64 = 0.2;
const PRIOR_TILT: f64 = 0.5;
const PRIOR_CURVATURE_VOXEL: f64 = 0.5;

/// A sample: distances from the point along the normal and along two directions across it, mm; and its value.
type Observed = [f64; 4];

impl Edge {
    /// The boundary of `surface` at `point` with outward unit `normal` there (world), from the samples between `inward_mm` and `outward_mm` of
    /// it, within which no other boundary should lie. `None` where there are too few, or no step in them.
    pub fn at(surface: &Surface, point: DVec3, normal: DVec3, inward_mm: f64, outward_mm: f64) -> Option<Self> {
        let (across, other) = normal.any_orthonormal_pair();
        let seen = observed(surface, point, [normal, across, other], [-inward_mm, outward_mm]);
        if seen.len() < LEAST_SAMPLES {
            return None;
        }
        let voxel_mm = spacing_along_mm(surface, normal);
        let edge = Fit::begin(&seen, voxel_mm)?.refined(&seen)?;
        let Fit { outside, inside, offset, tilt, curvature, log_blur, square, .. } = edge;
        // The tilted plane's distance from the point, along its own normal.
        let direction = normal + tilt[0] * across + tilt[1] * other;
        let size = direction.length();
        let step = inside - outside;
        let is_step = step.is_finite() && step != 0.0 && size.is_finite();
        is_step.then(|| Self {
            outside,
            inside,
            blur_mm: log_blur.exp() / size,
            normal: direction / size,
            offset_mm: -offset / size,
            curvature: (curvature[0] + curvature[1]) / size,
            noise: (square / (seen.len() - PARAMETERS) as f64).sqrt(),
        })
    }

    /// The model's value at a distance from the boundary, outward, mm.
    pub fn value(&self, distance_mm: f64) -> f64 {
        self.outside + (self.inside - self.outside) * inside_part(distance_mm / self.blur_mm)
    }

    /// The middle between the plateaus (the half-maximum height of Spoor, Zonneveld and Macho 1993, American Journal of Physical Anthropology
    /// 91, 469–484).
    pub fn middle(&self) -> f64 {
        (self.outside + self.inside) / 2.0
    }

    /// Full width at half maximum of the blur, mm.
    pub fn blur_width_mm(&self) -> f64 {
        // 2·√(2 ln 2) standard deviations.
        2.354_82 * self.blur_mm
    }
}

/// Distance of two samples that lie behind each other along `direction` (unit, world), mm.
pub fn spacing_along_mm(surface: &Surface, direction: DVec3) -> f64 {
    1.0 / surface.grid.world_to_index().matrix3.mul_vec3(direction).length()
}

/// Part of a blurred step that lies inside, at a distance outward in standard deviations: 1 − Φ.
fn inside_part(distance: f64) -> f64 {
    0.5 * libm::erfc(distance * FRAC_1_SQRT_2)
}

/// The samples around a point, within limits along the first of three axes.
fn observed(surface: &Surface, point: DVec3, axes: [DVec3; 3], [from_mm, to_mm]: [f64; 2]) -> Vec<Observed> {
    let IndexPoint(middle) = surface.grid.index(WorldPoint(point));
    let dims = surface.grid.dims();
    let ends = |a: usize| {
        let first = (middle[a] - REACH_VOXEL).ceil().max(0.0) as usize;
        first..((middle[a] + REACH_VOXEL).floor() + 1.0).clamp(0.0, dims[a] as f64) as usize
    };
    let mut seen = Vec::new();
    with_block!(Store::of(&surface.volume).whole(), block => {
        for k in ends(2) {
            for j in ends(1) {
                for i in ends(0) {
                    let index = DVec3::new(i as f64, j as f64, k as f64);
                    let away = surface.grid.world(IndexPoint(index)).0 - point;
                    let along = axes.map(|axis| away.dot(axis));
                    if index.distance(middle) <= REACH_VOXEL && (from_mm..=to_mm).contains(&along[0]) {
                        seen.push([along[0], along[1], along[2], surface.volume.value_of(block.at([i, j, k]).to_f64())]);
                    }
                }
            }
        }
    });
    seen
}

/// The parameters of a step, about which a sample of distance d along the first axis and u, v across it is
/// `outside + (inside − outside)·(1 − Φ(D/blur))`, D = d + offset + tilt·(u, v) + (c₀u² + c₁v²)/2 + c₂uv.
#[derive(Clone, Copy)]
struct Fit {
    outside: f64,
    inside: f64,
    offset: f64,
    log_blur: f64,
    tilt: [f64; 2],
    curvature: [f64; 3],
    /// Sum of the squared residuals.
    square: f64,
    voxel_mm: f64,
}

impl Fit {
    /// Plateaus at the means of the outer and the inner half, and a blur of half a voxel.
    fn begin(seen: &[Observed], voxel_mm: f64) -> Option<Self> {
        let mean = |outer: bool| {
            let (sum, count) = seen.iter().filter(|s| (s[0] > 0.0) == outer).fold((0.0, 0), |(sum, n), s| (sum + s[3], n + 1));
            (count > 0).then(|| sum / f64::from(count))
        };
        let (outside, inside) = (mean(true)?, mean(false)?);
        let fit = Self {
            outside,
            inside,
            offset: 0.0,
            log_blur: (0.5 * voxel_mm).ln(),
            tilt: [0.0; 2],
            curvature: [0.0; 3],
            square: 0.0,
            voxel_mm,
        };
        Some(Self { square: fit.square_of(seen), ..fit })
    }

    /// By Levenberg's and Marquardt's method (Marquardt 1963), with Marquardt's scaling.
    fn refined(self, seen: &[Observed]) -> Option<Self> {
        let mut fit = self;
        let mut damping = 1e-2;
        for _ in 0..MOST_STEPS {
            let (normal, right) = fit.equations(seen);
            let mut damped = normal;
            (0..PARAMETERS).for_each(|n| damped[n][n] *= 1.0 + damping);
            let Some(step) = solve(damped, right) else {
                damping *= 10.0;
                continue;
            };
            let next = fit.moved(&step, seen);
            let (before, after) = (fit.total(), next.total());
            if after.is_nan() || after > before {
                damping *= 10.0;
                continue;
            }
            fit = next;
            damping *= 0.2;
            if before - after <= CONVERGED * before {
                break;
            }
        }
        fit.square.is_finite().then_some(fit)
    }

    fn distance(&self, s: &Observed) -> f64 {
        let [d, u, v, _] = *s;
        let [a, b, c] = self.curvature;
        d + self.offset + self.tilt[0] * u + self.tilt[1] * v + 0.5 * (a * u * u + b * v * v) + c * u * v
    }

    fn square_of(&self, seen: &[Observed]) -> f64 {
        let blur = self.log_blur.exp();
        let part = |s: &Observed| self.outside + (self.inside - self.outside) * inside_part(self.distance(s) / blur) - s[3];
        seen.iter().map(|s| part(s).powi(2)).sum()
    }

    /// What is thought of tilts and curvatures before any sample: the weight of each, as a sum of squares.
    fn prior(&self) -> [f64; PARAMETERS] {
        let step = (PRIOR_STEP * (self.inside - self.outside)).powi(2);
        let (tilt, curvature) = (step / PRIOR_TILT.powi(2), step * (self.voxel_mm / PRIOR_CURVATURE_VOXEL).powi(2));
        [0.0, 0.0, 0.0, 0.0, tilt, tilt, curvature, curvature, curvature]
    }

    fn parameters(&self) -> [f64; PARAMETERS] {
        let ([t, u], [a, b, c]) = (self.tilt, self.curvature);
        [self.outside, self.inside, self.offset, self.log_blur, t, u, a, b, c]
    }

    /// What is made least: residuals and prior.
    fn total(&self) -> f64 {
        self.square + self.prior().iter().zip(self.parameters()).map(|(weight, p)| weight * p * p).sum::<f64>()
    }

    /// The normal equations about these parameters.
    fn equations(&self, seen: &[Observed]) -> ([[f64; PARAMETERS]; PARAMETERS], [f64; PARAMETERS]) {
        let (blur, step) = (self.log_blur.exp(), self.inside - self.outside);
        let (mut normal, mut right) = ([[0.0; PARAMETERS]; PARAMETERS], [0.0; PARAMETERS]);
        for s in seen {
            let z = self.distance(s) / blur;
            let part = inside_part(z);
            let density = (-0.5 * z * z).exp() / (2.0 * PI).sqrt();
            let (slope, [_, u, v, value]) = (-step * density / blur, *s);
            let row = [
                1.0 - part,
                part,
                slope,
                step * density * z,
                slope * u,
                slope * v,
                slope * 0.5 * u * u,
                slope * 0.5 * v * v,
                slope * u * v,
            ];
            let residual = value - (self.outside + step * part);
            for (n, a) in row.iter().enumerate() {
                right[n] += a * residual;
                normal[n].iter_mut().zip(&row).for_each(|(sum, b)| *sum += a * b);
            }
        }
        for (n, (weight, p)) in self.prior().iter().zip(self.parameters()).enumerate() {
            normal[n][n] += weight;
            right[n] -= weight * p;
        }
        (normal, right)
    }

    fn moved(&self, step: &[f64; PARAMETERS], seen: &[Observed]) -> Self {
        let p: [f64; PARAMETERS] = std::array::from_fn(|n| self.parameters()[n] + step[n]);
        // A blur beyond these is none that the samples could show.
        let log_blur = p[3].clamp((0.1 * self.voxel_mm).ln(), (REACH_VOXEL * self.voxel_mm).ln());
        let next = Self { outside: p[0], inside: p[1], offset: p[2], log_blur, tilt: [p[4], p[5]], curvature: [p[6], p[7], p[8]], ..*self };
        Self { square: next.square_of(seen), ..next }
    }
}

/// The solution of a symmetric, positive definite system, by Cholesky's decomposition; `None` where it is not.
fn solve(mut m: [[f64; PARAMETERS]; PARAMETERS], mut x: [f64; PARAMETERS]) -> Option<[f64; PARAMETERS]> {
    for n in 0..PARAMETERS {
        for k in 0..n {
            let dot: f64 = (0..k).map(|i| m[n][i] * m[k][i]).sum();
            m[n][k] = (m[n][k] - dot) / m[k][k];
        }
        let rest = m[n][n] - (0..n).map(|i| m[n][i].powi(2)).sum::<f64>();
        m[n][n] = (rest > 0.0).then(|| rest.sqrt())?;
        x[n] = (x[n] - (0..n).map(|i| m[n][i] * x[i]).sum::<f64>()) / m[n][n];
    }
    for n in (0..PARAMETERS).rev() {
        x[n] = (x[n] - (n + 1..PARAMETERS).map(|i| m[i][n] * x[i]).sum::<f64>()) / m[n][n];
    }
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_field::{Grid, Progress, Raster, Samples, Unit, Volume};
    use bregma_synthetic::ct::{AIR_HU, Field, Material, Scanner};
    use glam::{DAffine3, DMat3};
    use std::sync::Arc;

    const BONE_HU: f64 = 1200.0;

    struct Ball(f64);

    impl Field for Ball {
        const LIPSCHITZ: f64 = 1.0;

        fn material(&self, p: DVec3) -> Material {
            Material { distance_mm: p.length() - self.0, inside_hu: BONE_HU }
        }
    }

    #[test]
    fn blur_plateaus_curvature_and_noise_of_a_scanned_ball_are_found() {
        // Fails if a derivative is wrong (the fit then ends elsewhere), if the curvature is taken for blur, or mm for voxels.
        let direction = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, 2.0) / 3.0, 0.7);
        for (spacing, sigma_mm, noise_hu) in [([0.5, 0.5, 0.5], 0.35, 0.0), ([0.5, 0.6, 0.8], 0.45, 20.0), ([0.3, 0.3, 0.3], 0.3, 40.0)] {
            let (spacing, radius) = (DVec3::from(spacing), 12.0);
            let dims = (DVec3::splat(32.0) / spacing).as_usizevec3().to_array();
            let half = direction * (spacing * DVec3::from(dims.map(|n| (n - 1) as f64 / 2.0)));
            let grid = Grid::new(dims, spacing, -half, direction).unwrap();
            let hu = Scanner { psf_sigma_mm: sigma_mm, noise_hu, seed: 3 }.scan(&Ball(radius), &grid, &Progress::default()).unwrap();
            let raster = Raster { grid, samples: Samples::I16(hu), slope: 1.0, intercept: 0.0, unit: Unit::Hounsfield, warnings: vec![] };
            let volume = Arc::new(Volume::new("ball".into(), "test", raster).unwrap());
            let surface = Surface::new(&volume, 100.0, DAffine3::IDENTITY).unwrap();
            let (mut worst, mut blurs) = ([0.0_f64; 3], vec![]);
            for n in 0..200 {
                let turn = f64::from(n) * 2.4;
                let z = 1.0 - f64::from(n) / 100.0;
                let normal = DVec3::new((1.0 - z * z).max(0.0).sqrt() * turn.cos(), (1.0 - z * z).max(0.0).sqrt() * turn.sin(), z);
                // As a crossing is found: near the boundary, with a normal that is a little off.
                let off = normal.any_orthonormal_vector();
                let edge = Edge::at(&surface, (radius + 0.1) * normal, (normal + 0.1 * off).normalize(), 5.0, 5.0).unwrap();
                // The boundary is where the fit says, but for the curvature's own shift by blur²/radius.
                let boundary = radius + 0.1 + edge.offset_mm;
                worst[0] = worst[0].max((boundary - radius).abs());
                worst[1] = worst[1].max((edge.curvature - 2.0 / radius).abs() * radius / 2.0);
                worst[2] = worst[2].max(edge.normal.angle_between(normal).to_degrees());
                // Averaging over a voxel blurs by its extent along the normal, over the square root of 12.
                let voxel = (direction.transpose() * normal * spacing).length_squared() / 12.0;
                blurs.push(edge.blur_mm / (sigma_mm * sigma_mm + voxel).sqrt());
                let plateau = 3.0 * noise_hu + 60.0;
                assert!((edge.inside - BONE_HU).abs() < plateau && (edge.outside - AIR_HU).abs() < plateau, "{edge:?}");
                // A voxel is a box and no Gaussian: that much of the step stays unexplained.
                assert!((edge.noise - noise_hu).abs() < 0.35 * noise_hu + 0.015 * (BONE_HU - AIR_HU), "noise {noise_hu}: {edge:?}");
            }
            blurs.sort_by(f64::total_cmp);
            println!(
                "{spacing} σ {sigma_mm} noise {noise_hu}: boundary {:.4} mm, curvature {:.2}, normal {:.2}°, blur {:.3}–{:.3}",
                worst[0], worst[1], worst[2], blurs[10], blurs[189]
            );
            assert!(worst[0] < 0.1 && worst[1] < 0.9 && worst[2] < 6.0 && blurs[10] > 0.9 && blurs[189] < 1.1, "{worst:?} {blurs:?}");
        }
    }
}
