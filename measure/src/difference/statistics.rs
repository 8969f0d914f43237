//! A map of differences in short, by the area of the surface.

use super::Map;
use crate::mesh::Mesh;
use crate::uncertainty::{Ends, Registered, Uncertainty, of_difference};
use glam::DVec3;
use serde::Serialize;

/// What the differences on one surface are like. Everything is by area.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Statistics {
    /// Vertices with a difference.
    pub count: usize,
    /// Area of the surface that has one, mm².
    pub area_mm2: f64,
    /// Area that was asked for and has none: without a partner, or outside the other scan; mm².
    pub without_mm2: f64,
    /// Mean.
    pub mean_mm: f64,
    /// How far the mean may be off: what all points have in common, the isovalues' tolerance, blur and registrations.
    pub mean_uncertainty: Uncertainty,
    /// Mean of the magnitudes.
    pub mean_magnitude_mm: f64,
    /// Root mean square.
    pub rms_mm: f64,
    /// Standard deviation.
    pub deviation_mm: f64,
    /// What 2.5, 5, 25, 50, 75, 95 and 97.5 % of the area are below.
    pub quantiles_mm: [f64; 7],
    /// The magnitude that 95 % of the area stay below.
    pub magnitude_95_mm: f64,
    /// The largest magnitude: the one-sided Hausdorff distance, where the difference is that of closest points.
    pub largest: Extreme,
    /// Part of the area whose difference is larger than its ±.
    pub sure: f64,
    /// Part whose difference is positive and larger than its ±.
    pub sure_positive: f64,
    /// The most positive and the most negative differences that are sure, each the largest of its surroundings.
    pub extremes: Vec<Extreme>,
    /// Area by difference, mm², in bins of equal width from the first to the last end.
    pub bins_mm2: Vec<f64>,
    /// Ends of the bins, mm: symmetric.
    pub bin_ends_mm: [f64; 2],
}

/// A place with a large difference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Extreme {
    /// The vertex.
    pub vertex: usize,
    /// LPS mm.
    pub at_mm: DVec3,
    /// Outward unit normal there.
    pub normal: DVec3,
    /// What belongs to it, LPS mm.
    pub partner_mm: DVec3,
    /// The difference, mm.
    pub difference_mm: f64,
    /// ± mm.
    pub error_mm: f64,
}

/// Bins of the histogram: odd, so that one holds no difference.
const BINS: usize = 81;
/// Extremes of each sign.
const EXTREMES: usize = 10;
/// Extremes lie as far apart as this part of the size of what is asked for, so that one place is not named ten times.
const APART: f64 = 0.05;

impl Statistics {
    /// Of the map on `mesh`, made at the vertices that are asked for; `registered` of the first and the second scan. `None` where there is no
    /// difference.
    pub fn of(mesh: &Mesh, map: &Map, registered: [Registered<'_>; 2], asked: &[bool]) -> Option<Self> {
        let areas = mesh.areas_mm2();
        let asked: Vec<usize> = (0..mesh.vertices.len()).filter(|n| asked[*n]).collect();
        let (known, without): (Vec<usize>, Vec<usize>) = asked.into_iter().partition(|n| !map.values_mm[*n].is_nan());
        let value = |n: usize| f64::from(map.values_mm[n]);
        let area_of = |list: &mut dyn Iterator<Item = usize>| list.map(|n| areas[n]).sum::<f64>() + 0.0;
        let area_mm2 = area_of(&mut known.iter().copied());
        if known.is_empty() || area_mm2 <= 0.0 {
            return None;
        }
        let mean_of = |f: &dyn Fn(f64) -> f64| known.iter().map(|n| areas[*n] * f(value(*n))).sum::<f64>() / area_mm2;
        let mean_mm = mean_of(&|v| v);
        let quantiles = |f: &dyn Fn(f64) -> f64, parts: &[f64]| {
            let mut sorted: Vec<(f64, f64)> = known.iter().map(|n| (f(value(*n)), areas[*n])).collect();
            sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mut below = 0.0;
            let sums: Vec<f64> = sorted
                .iter()
                .map(|(_, area)| {
                    below += area;
                    below
                })
                .collect();
            parts.iter().map(|part| sorted[sums.partition_point(|sum| *sum < part * area_mm2).min(sorted.len() - 1)].0).collect::<Vec<_>>()
        };
        let of_values = quantiles(&|v| v, &[0.025, 0.05, 0.25, 0.5, 0.75, 0.95, 0.975]);
        let magnitudes = quantiles(&f64::abs, &[0.95, 0.99]);
        let ends = map.common.map(|common| [common]);
        let extreme = |vertex: usize| Extreme {
            vertex,
            at_mm: mesh.vertices[vertex],
            normal: mesh.normals[vertex],
            partner_mm: map.partners_mm[vertex].as_dvec3(),
            difference_mm: value(vertex),
            error_mm: f64::from(map.errors_mm[vertex]),
        };
        // There is one: `known` is not empty.
        let largest = known.iter().copied().max_by(|a, b| value(*a).abs().total_cmp(&value(*b).abs()))?;
        let end = magnitudes[1].max(f64::MIN_POSITIVE);
        Some(Self {
            count: known.len(),
            area_mm2,
            without_mm2: area_of(&mut without.into_iter()),
            mean_mm,
            mean_uncertainty: of_difference([0, 1].map(|n| Ends { of: &ends[n], registered: registered[n] })),
            mean_magnitude_mm: mean_of(&f64::abs),
            rms_mm: mean_of(&|v| v * v).sqrt(),
            deviation_mm: mean_of(&|v| (v - mean_mm).powi(2)).sqrt(),
            quantiles_mm: std::array::from_fn(|n| of_values[n]),
            magnitude_95_mm: magnitudes[0],
            largest: extreme(largest),
            sure: area_of(&mut known.iter().copied().filter(|n| map.is_sure(*n))) / area_mm2,
            sure_positive: area_of(&mut known.iter().copied().filter(|n| map.is_sure(*n) && value(*n) > 0.0)) / area_mm2,
            extremes: extremes(mesh, map, &known).into_iter().map(extreme).collect(),
            bins_mm2: bins(&known, &areas, &value, end),
            bin_ends_mm: [-end, end],
        })
    }

    /// Part of the area that was asked for and has no difference.
    pub fn without(&self) -> f64 {
        self.without_mm2 / (self.area_mm2 + self.without_mm2)
    }
}

/// Area by difference; what lies beyond the ends is in the last bins.
fn bins(known: &[usize], areas: &[f64], value: &dyn Fn(usize) -> f64, end: f64) -> Vec<f64> {
    let mut bins = vec![0.0; BINS];
    for n in known {
        let bin = (value(*n) / end + 1.0) / 2.0 * BINS as f64;
        bins[(bin.max(0.0) as usize).min(BINS - 1)] += areas[*n];
    }
    bins
}

/// The vertices with the largest sure differences of each sign, apart from each other.
fn extremes(mesh: &Mesh, map: &Map, known: &[usize]) -> Vec<usize> {
    let ends = |n: &usize| (mesh.vertices[*n], mesh.vertices[*n]);
    let span = known.iter().map(ends).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
    let apart_mm = APART * span.map_or(0.0, |(low, high)| low.distance(high));
    let mut sorted: Vec<usize> = known.iter().copied().filter(|n| map.is_sure(*n)).collect();
    sorted.sort_by(|a, b| map.values_mm[*b].abs().total_cmp(&map.values_mm[*a].abs()));
    let mut chosen: Vec<usize> = vec![];
    for n in sorted {
        let is_positive = map.values_mm[n] > 0.0;
        let alike = || chosen.iter().filter(|c| (map.values_mm[**c] > 0.0) == is_positive);
        if alike().count() < EXTREMES && alike().all(|c| mesh.vertices[*c].distance(mesh.vertices[n]) >= apart_mm) {
            chosen.push(n);
        }
    }
    chosen
}
