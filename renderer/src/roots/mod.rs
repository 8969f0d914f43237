//! The solvers: ways to find where a ray first enters the bone. Each that works within one cell is one file here and one shader of
//! the same name (fixed steps are drawn by `cpu/steps.rs`, as they know no cells; the hardware's `filter` exists on the GPU only); the
//! walk is compiled for each on its own, so that what is timed is the method and not a switch.

mod analytic;
mod bernstein;
mod cubic;
mod exact;
mod linear;
mod marmitt;
mod neubauer;
mod segment_steps;

pub(crate) use analytic::Analytic;
pub(crate) use exact::Exact;
pub(crate) use linear::Linear;
pub(crate) use marmitt::Marmitt;
pub(crate) use neubauer::Neubauer;
pub(crate) use segment_steps::SegmentSteps;

use glam::Vec3;
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

/// A solver that works within one cell.
pub(crate) trait FirstEntry: Sync {
    /// The first u in [0, 1] of the segment from `p` to `q` (local coordinates in [0, 1]³) where the trilinear interpolant of
    /// the corner values `f` enters the inside, as far as the method sees it. Corner x + 2y + 4z is at (x, y, z).
    fn first_entry(f: &[f32; 8], p: Vec3, q: Vec3) -> Option<f32>;
}

/// Inside bone: ties included, everywhere.
pub(crate) fn inside(v: f32) -> bool {
    v >= 0.0
}

/// a at w = 0 to b at w = 1. This form keeps the sign that a and b share, whatever is rounded; a + (b − a)·w does not.
fn mix(a: f32, b: f32, w: f32) -> f32 {
    a * (1.0 - w) + b * w
}

/// The trilinear interpolant at `p`.
pub(crate) fn trilinear(f: &[f32; 8], p: Vec3) -> f32 {
    let [y0z0, y1z0, y0z1, y1z1] = [0, 2, 4, 6].map(|c| mix(f[c], f[c + 1], p.x));
    mix(mix(y0z0, y1z0, p.y), mix(y0z1, y1z1, p.y), p.z)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

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
