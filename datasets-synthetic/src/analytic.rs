//! Analytic volumes (float32, positive inside, isovalue 0 unless stated) and their true answers. Lengths are in world mm.

use crate::volume;
use bregma_volume::{Grid, Samples, Unit, Volume};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, TAU};

/// `value` at every sample of `grid`, as a volume.
pub fn sampled(name: &str, grid: &Grid, value: impl Fn(DVec3) -> f64 + Sync) -> Volume {
    let [nx, ny, _] = grid.dims();
    let map = grid.index_to_world();
    let at = |n: usize| {
        let index = [n % nx, n / nx % ny, n / nx / ny].map(|i| i as f64);
        value(map.transform_point3(index.into())) as f32
    };
    let samples = (0..grid.len()).into_par_iter().map(at).collect();
    volume(name, grid.clone(), Samples::F32(samples), Unit::Value)
}

/// The half-space `(p − point)·normal ≤ 0`: value −(p − point)·normal, `normal` unit. Linear, so that trilinear interpolation
/// is exact on any grid.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    /// A point on the plane.
    pub point: DVec3,
    /// Its unit outer normal.
    pub normal: DVec3,
}

impl Plane {
    /// The volume.
    pub fn volume(&self, grid: &Grid) -> Volume {
        sampled("plane", grid, |p| (self.point - p).dot(self.normal))
    }

    /// Where the ray `origin + t·direction` crosses, in units of `direction`; `None` along the plane.
    pub fn crossing(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        let t = (self.point - origin).dot(self.normal) / direction.dot(self.normal);
        t.is_finite().then_some(t)
    }
}

/// A ball: value `radius − |p − centre|`.
#[derive(Clone, Copy, Debug)]
pub struct Sphere {
    /// Its centre.
    pub centre: DVec3,
    /// Its radius.
    pub radius_mm: f64,
}

impl Sphere {
    /// The volume.
    pub fn volume(&self, grid: &Grid) -> Volume {
        sampled("sphere", grid, |p| self.radius_mm - p.distance(self.centre))
    }

    /// Where the line `origin + t·direction` (unit) enters and leaves; `None` where it passes by or only touches.
    pub fn chord_mm(&self, origin: DVec3, direction: DVec3) -> Option<[f64; 2]> {
        let v = self.centre - origin;
        let middle = v.dot(direction);
        // |v − middle·direction|² instead of |v|² − middle²: no cancellation for far origins.
        let half = self.radius_mm.powi(2) - (v - middle * direction).length_squared();
        (half > 0.0).then(|| [middle - half.sqrt(), middle + half.sqrt()])
    }
}

/// A spherical shell of constant thickness: value `(outer − inner)/2 − ||p − centre| − (outer + inner)/2|`.
#[derive(Clone, Copy, Debug)]
pub struct Shell {
    /// Its centre.
    pub centre: DVec3,
    /// Radius of its inner surface.
    pub inner_mm: f64,
    /// Radius of its outer surface.
    pub outer_mm: f64,
}

impl Shell {
    /// The volume.
    pub fn volume(&self, grid: &Grid) -> Volume {
        let (half, middle) = (0.5 * (self.outer_mm - self.inner_mm), 0.5 * (self.outer_mm + self.inner_mm));
        sampled("shell", grid, |p| half - (p.distance(self.centre) - middle).abs())
    }

    /// The stretches `[from, to]` of the line `origin + t·direction` (unit) inside the wall: none, one or two.
    pub fn segments_mm(&self, origin: DVec3, direction: DVec3) -> Vec<[f64; 2]> {
        let chord = |radius_mm| Sphere { centre: self.centre, radius_mm }.chord_mm(origin, direction);
        match (chord(self.outer_mm), chord(self.inner_mm)) {
            (None, _) => vec![],
            (Some(outer), None) => vec![outer],
            (Some(outer), Some(inner)) => vec![[outer[0], inner[0]], [inner[1], outer[1]]],
        }
    }
}

/// The hyperbolic paraboloid z = xy/scale about `centre`: value `xy/scale − z`. Trilinear in x, y, z, so that interpolation is
/// exact on grids along the world's axes; its contours through `centre` are the asymptotic decider's hard case.
#[derive(Clone, Copy, Debug)]
pub struct Saddle {
    /// Its saddle point.
    pub centre: DVec3,
    /// Length that sets its curvature.
    pub scale_mm: f64,
}

impl Saddle {
    /// The volume.
    pub fn volume(&self, grid: &Grid) -> Volume {
        sampled("saddle", grid, |p| self.value(p))
    }

    /// The value at `p`.
    pub fn value(&self, p: DVec3) -> f64 {
        let q = p - self.centre;
        q.x * q.y / self.scale_mm - q.z
    }

    /// Where the line `origin + t·direction` crosses, in order, in units of `direction`.
    pub fn crossings(&self, origin: DVec3, direction: DVec3) -> Vec<f64> {
        let (o, d) = (origin - self.centre, direction);
        let a = d.x * d.y / self.scale_mm;
        let b = (o.x * d.y + o.y * d.x) / self.scale_mm - d.z;
        let c = o.x * o.y / self.scale_mm - o.z;
        let discriminant = b * b - 4.0 * a * c;
        // Both roots from the sum that does not cancel; a line of the surface's rulings (a = 0) has one root, at c/q.
        let q = -0.5 * (b + b.signum() * discriminant.max(0.0).sqrt());
        let mut roots: Vec<f64> = [q / a, c / q].into_iter().filter(|t| discriminant > 0.0 && t.is_finite()).collect();
        roots.sort_by(f64::total_cmp);
        roots
    }
}

/// The test signal of Marschner and Lobb ("An evaluation of reconstruction filters for volume rendering", Visualization 1994,
/// eq. 1), α = 0.25, f_M = 6, on the cube of ±`half_side_mm` about `centre`. Values 0 to 1; the usual isovalue is 0.5. The
/// paper samples it with 41³ points.
#[derive(Clone, Copy, Debug)]
pub struct MarschnerLobb {
    /// Middle of the cube.
    pub centre: DVec3,
    /// Half its side: the paper's unit.
    pub half_side_mm: f64,
}

const ALPHA: f64 = 0.25;
const F_M: f64 = 6.0;

impl MarschnerLobb {
    /// The volume.
    pub fn volume(&self, grid: &Grid) -> Volume {
        sampled("Marschner–Lobb", grid, |p| self.value(p))
    }

    /// The value at `p`.
    pub fn value(&self, p: DVec3) -> f64 {
        let q = (p - self.centre) / self.half_side_mm;
        (1.0 - (FRAC_PI_2 * q.z).sin() + ALPHA * (1.0 + rho_r(q.truncate().length()))) / (2.0 * (1.0 + ALPHA))
    }

    /// Height z of the isosurface over (x, y), the paper's formula solved for z; `None` where it leaves the cube. The value
    /// falls with z: inside is below.
    pub fn height_mm(&self, xy_mm: DVec2, isovalue: f64) -> Option<f64> {
        let r = (xy_mm - self.centre.truncate()).length() / self.half_side_mm;
        let sine = 1.0 + ALPHA * (1.0 + rho_r(r)) - 2.0 * (1.0 + ALPHA) * isovalue;
        (sine.abs() <= 1.0).then(|| self.centre.z + self.half_side_mm * sine.asin() / FRAC_PI_2)
    }
}

fn rho_r(r: f64) -> f64 {
    (TAU * F_M * (FRAC_PI_2 * r).cos()).cos()
}
