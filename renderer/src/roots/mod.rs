//! The solvers: ways to find where a ray first enters the bone. Each that works within one cell is one file here and one shader of
//! the same name (fixed steps are drawn by `cpu/steps.rs`, as they know no cells; the hardware's `filter` exists on the GPU only). What is
//! timed is the method and not the choice: the GPU's walk is compiled for each on its own, the CPU's chooses once for sixteen rays.
//!
//! The twin of `shaders/interpolant.wgsl`.

pub(crate) mod analytic;
pub(crate) mod bernstein;
pub(crate) mod cubic;
mod exact;
mod linear;
mod marmitt;
mod neubauer;
mod segment_steps;
pub(crate) mod spline;
pub(crate) mod voxels;

use crate::lanes::{Floats, Mask, Vecs, mix};
use fearless_simd::Simd;
use fearless_simd::prelude::*;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// How roots are found. [`Solver::Exact`] is the one to measure with; the others are what it is compared with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Solver {
    /// Bernstein coefficients, turning points, guarded Newton: every root, to what float32 resolves.
    #[default]
    Exact,
    /// One linear interpolation between entry and exit.
    Linear,
    /// Repeated linear interpolation (Neubauer and others 2002), this many steps.
    Neubauer(Steps),
    /// Extrema first, then repeated linear interpolation (Marmitt and others 2004), this many steps.
    Marmitt(Steps),
    /// A closed form (Blinn 2007).
    Analytic,
    /// Steps of fixed length through the brick, with linear interpolation where samples change sides.
    Step(PerVoxel),
    /// The hardware's trilinear filter at four points of a cell, and the cubic through them; on the GPU only.
    Filter,
}

/// Fixed steps in a voxel's length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PerVoxel {
    /// Steps of a voxel.
    One,
    /// Of half a voxel.
    Two,
    /// Of a quarter.
    Four,
    /// Of an eighth.
    Eight,
}

/// Steps of a repeated linear interpolation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Steps {
    /// 2.
    Two,
    /// 3, as published.
    Three,
    /// 4.
    Four,
}

impl PerVoxel {
    pub(crate) fn number(self) -> u32 {
        match self {
            Self::One => 1,
            Self::Two => 2,
            Self::Four => 4,
            Self::Eight => 8,
        }
    }
}

impl Steps {
    pub(crate) fn number(self) -> u32 {
        match self {
            Self::Two => 2,
            Self::Three => 3,
            Self::Four => 4,
        }
    }
}

impl Solver {
    /// Every solver.
    pub const ALL: [Self; 14] = [
        Self::Exact,
        Self::Linear,
        Self::Neubauer(Steps::Two),
        Self::Neubauer(Steps::Three),
        Self::Neubauer(Steps::Four),
        Self::Marmitt(Steps::Two),
        Self::Marmitt(Steps::Three),
        Self::Marmitt(Steps::Four),
        Self::Analytic,
        Self::Step(PerVoxel::One),
        Self::Step(PerVoxel::Two),
        Self::Step(PerVoxel::Four),
        Self::Step(PerVoxel::Eight),
        Self::Filter,
    ];

    /// Whether the CPU has it too. The GPU has all.
    pub fn on_cpu(self) -> bool {
        self != Self::Filter
    }
}

impl fmt::Display for Solver {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let stepped = |f: &mut fmt::Formatter<'_>, name: &str, steps: &Steps| match steps {
            Steps::Two => write!(f, "{name}:2"),
            Steps::Three => f.write_str(name),
            Steps::Four => write!(f, "{name}:4"),
        };
        match self {
            Self::Exact => f.write_str("exact"),
            Self::Linear => f.write_str("linear"),
            Self::Neubauer(steps) => stepped(f, "neubauer", steps),
            Self::Marmitt(steps) => stepped(f, "marmitt", steps),
            Self::Analytic => f.write_str("analytic"),
            Self::Step(PerVoxel::One) => f.write_str("step:1"),
            Self::Step(PerVoxel::Two) => f.write_str("step:0.5"),
            Self::Step(PerVoxel::Four) => f.write_str("step:0.25"),
            Self::Step(PerVoxel::Eight) => f.write_str("step:0.125"),
            Self::Filter => f.write_str("filter"),
        }
    }
}

impl FromStr for Solver {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let plain = text.strip_suffix(":3").unwrap_or(text);
        let names = || Self::ALL.map(|s| s.to_string()).join(", ");
        Self::ALL.into_iter().find(|s| s.to_string() == plain).ok_or_else(|| format!("no solver; there are {}", names()))
    }
}

impl TryFrom<String> for Solver {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<Solver> for String {
    fn from(solver: Solver) -> Self {
        solver.to_string()
    }
}

/// How surfaces are found within cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Method {
    /// Of the trilinear interpolant.
    Solver(Solver),
    /// Of the tricubic B-spline, of which the volume holds the coefficients.
    Spline,
    /// Of boxes around the samples.
    Voxels,
}

impl Method {
    /// Whether steps of fixed length are taken through bricks, from no cell to another.
    pub fn is_stepping(self) -> bool {
        matches!(self, Self::Solver(Solver::Step(_)))
    }
}

/// Where segments first enter the inside, as far as a method sees it.
#[derive(Clone, Copy)]
pub(crate) struct Entry<S: Simd> {
    /// Which segments do.
    pub found: Mask<S>,
    /// Where, in [0, 1] of the segment.
    pub u: Floats<S>,
}

/// The first entries of the segments from `p` to `q` (local coordinates in [0, 1]³) into the inside of the trilinear interpolants of the
/// corner values `f`, for the lanes of `asked`. Corner x + 2y + 4z is at (x, y, z). The hardware's filter finds nothing here.
#[inline(always)]
pub(crate) fn first_entry<S: Simd>(simd: S, solver: Solver, f: &[Floats<S>; 8], p: &Vecs<S>, q: &Vecs<S>, asked: Mask<S>) -> Entry<S> {
    // Each is compiled by itself and called: one jump for sixteen segments.
    match solver {
        Solver::Exact => simd.vectorize(
            #[inline(always)]
            || exact::first_entry(simd, f, p, q, asked),
        ),
        Solver::Linear => simd.vectorize(
            #[inline(always)]
            || linear::first_entry(simd, f, p, q, asked),
        ),
        Solver::Neubauer(steps) => simd.vectorize(
            #[inline(always)]
            || neubauer::first_entry(simd, steps.number(), f, p, q, asked),
        ),
        Solver::Marmitt(steps) => simd.vectorize(
            #[inline(always)]
            || marmitt::first_entry(simd, steps.number(), f, p, q, asked),
        ),
        Solver::Analytic => simd.vectorize(
            #[inline(always)]
            || analytic::first_entry(simd, f, p, q, asked),
        ),
        Solver::Step(steps) => simd.vectorize(
            #[inline(always)]
            || segment_steps::first_entry(simd, steps.number(), f, p, q, asked),
        ),
        Solver::Filter => Entry { found: Mask::splat(simd, false), u: Floats::splat(simd, 0.0) },
    }
}

/// Inside bone: ties included, everywhere.
#[inline(always)]
pub(crate) fn inside<S: Simd>(v: Floats<S>) -> Mask<S> {
    v.simd_ge(0.0)
}

/// The trilinear interpolant at `p`.
#[inline(always)]
pub(crate) fn trilinear<S: Simd>(f: &[Floats<S>; 8], p: &Vecs<S>) -> Floats<S> {
    let (y0z0, y1z0) = (mix(f[0], f[1], p[0]), mix(f[2], f[3], p[0]));
    let (y0z1, y1z1) = (mix(f[4], f[5], p[0]), mix(f[6], f[7], p[0]));
    mix(mix(y0z0, y1z0, p[1]), mix(y0z1, y1z1, p[1]), p[2])
}

#[cfg(test)]
pub(crate) mod tests {
    use super::bernstein::bernstein;
    use super::*;
    use crate::lanes::axes;
    use fearless_simd::{Level, dispatch};
    use glam::Vec3;

    /// Of a solver, for one segment.
    pub fn first_entry_of(solver: Solver, f: &[f32; 8], p: Vec3, q: Vec3) -> Option<f32> {
        dispatch!(Level::new(), simd => {
            let (f, p, q) = (f.map(|v| Floats::splat(simd, v)), axes!(a => Floats::splat(simd, p[a])), axes!(a => Floats::splat(simd, q[a])));
            let entry = first_entry(simd, solver, &f, &p, &q, Mask::splat(simd, true));
            entry.found.test(0).then(|| entry.u[0])
        })
    }

    /// Of one segment.
    pub fn bernstein_of(f: &[f32; 8], p: Vec3, q: Vec3) -> [f32; 4] {
        dispatch!(Level::new(), simd => {
            let (f, p, q) = (f.map(|v| Floats::splat(simd, v)), axes!(a => Floats::splat(simd, p[a])), axes!(a => Floats::splat(simd, q[a])));
            bernstein(&f, &p, &q).map(|b| b[0])
        })
    }

    pub fn trilinear_f64(f: &[f32; 8], p: glam::DVec3) -> f64 {
        (0..8).map(|c| f64::from(f[c]) * (0..3).map(|a| if c >> a & 1 == 1 { p[a] } else { 1.0 - p[a] }).product::<f64>()).sum()
    }

    #[test]
    fn names_are_read_as_they_are_written() {
        for solver in Solver::ALL {
            assert_eq!(solver.to_string().parse(), Ok(solver));
        }
        assert_eq!("neubauer:3".parse(), Ok(Solver::Neubauer(Steps::Three)));
        assert!("newton".parse::<Solver>().unwrap_err().contains("marmitt:4"));
    }
}
