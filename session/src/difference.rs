//! How two scans differ over their whole surfaces, or a scan from its own mirror image: what is asked for, and what came of it.

use crate::difference_order::{By, Order, RecordedHalf, Told};
use crate::displacement::{self, Moved, PartError, Scanned};
use crate::measurement::{Origin, RecordedDifference};
use crate::opened::Opened;
use bregma_field::{Bounds, Cancelled, Covariance, Progress, Region, Surface, SurfaceError, Volume};
use bregma_measure::difference::{self, Asked, PointErrors, Side, Statistics};
use bregma_measure::mesh::Mesh;
use bregma_measure::partner::Partners;
use bregma_measure::{Registered, corrections, iso_tolerance, mirrored, unlike_thresholds};
use bregma_register::Parts;
use bregma_register::orient::{OrientError, symmetry};
use bregma_renderer::Layer;
use glam::DAffine3;
use std::sync::Arc;
use thiserror::Error;

/// Why there is no difference.
#[derive(Debug, Error)]
pub enum DifferenceError {
    /// A registration that flattens a scan.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// Stopped by request.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// A pair that is not there.
    #[error("a difference is asked for of scan number {number}, and {open} are open; open the scans that it was made of")]
    NotOpen {
        /// The scan, from 1.
        number: usize,
        /// How many there are.
        open: usize,
    },
    /// A part whose motion is not known.
    #[error(transparent)]
    Part(#[from] PartError),
    /// No plane of symmetry.
    #[error(transparent)]
    Orient(#[from] OrientError),
    /// Nothing of one surface has a partner on the other.
    #[error(
        "{first} and {second}: nothing of the one surface lies within {reach_mm} mm of the other there; register them, or choose another place, a longer reach or other isovalues"
    )]
    Apart {
        /// The first scan.
        first: String,
        /// The second.
        second: String,
        /// As far as was looked.
        reach_mm: f64,
    },
}

/// One of the two surfaces with the differences at its points.
#[derive(Debug)]
pub struct Half {
    /// The scan, or what it is of it.
    pub name: String,
    /// Its bone.
    pub surface: Surface,
    /// Its points.
    pub mesh: Mesh,
    /// The differences.
    pub map: difference::Map,
    /// Its isovalue.
    pub iso: f64,
    /// Where its scan is put.
    pub transform: DAffine3,
    /// Which points are asked for.
    pub asked: Vec<bool>,
    /// They in short; `None` where there is none.
    pub statistics: Option<Statistics>,
}

/// What was measured.
#[derive(Debug)]
pub struct Measured {
    /// What was asked for.
    pub order: Order,
    /// As far as was looked, mm.
    pub reach_mm: f64,
    /// How the part moved, where that was asked for.
    pub moved: Option<Moved>,
    /// On the first surface, and on the second. Of an asymmetry, on the scan and on its mirror image.
    pub halves: [Half; 2],
    /// What the person should know.
    pub notes: Vec<String>,
}

/// Of the radius of a ball around the smaller scan: what lies farther apart is not the same part of a skull. Rounded up to one digit.
const REACH: f64 = 1.0 / 20.0;

/// As far as what belongs to a point is looked for where nobody says how far, mm.
pub fn reach_mm(volumes: [&Volume; 2]) -> f64 {
    let radius_mm = volumes.map(|v| Bounds::of([v.grid()]).radius_mm).into_iter().fold(f64::INFINITY, f64::min);
    let digit = 10.0_f64.powf((REACH * radius_mm).max(1e-6).log10().floor());
    if digit < 1.0 {
        // A whole number of parts, so that it is written as it is said.
        let parts = (1.0 / digit).round();
        return (REACH * radius_mm * parts).ceil() / parts;
    }
    (REACH * radius_mm / digit).ceil() * digit
}

/// A scan's bone where it is put.
pub(crate) struct Placed<'a> {
    pub name: String,
    pub volume: &'a Arc<Volume>,
    pub iso: f64,
    pub transform: DAffine3,
    residual_mm: Option<f64>,
    covariance: Option<&'a Covariance>,
    /// Its number among what is open, by which cuts know it.
    index: usize,
}

impl Placed<'_> {
    pub fn of<'a>(opened: &'a Opened, index: usize) -> Placed<'a> {
        let Layer { iso, transform, residual_mm, ref covariance, .. } = opened.scene.layers[index];
        let volume = &opened.volumes[index];
        Placed { name: volume.name().into(), volume, iso, transform, residual_mm, covariance: covariance.as_ref(), index }
    }

    pub fn registered(&self) -> Registered<'_> {
        Registered { residual_mm: self.residual_mm, covariance: self.covariance }
    }
}

/// Measures how the second of a pair of what is open differs from the first.
pub fn measure(opened: &Opened, order: &Order, progress: &Progress) -> Result<Measured, DifferenceError> {
    let opened = &opened.measured();
    let [first, second] = order.pair;
    if let Some(number) = order.pair.into_iter().find(|n| *n >= opened.volumes.len()) {
        return Err(DifferenceError::NotOpen { number: number + 1, open: opened.volumes.len() });
    }
    let a = Placed::of(opened, first);
    let b = if order.by == By::Asymmetry { image(opened, first, progress)? } else { Placed::of(opened, second) };
    let placed = [&a, &b];
    let reach_mm = order.reach_mm.unwrap_or_else(|| reach_mm(placed.map(|p| &**p.volume)));
    let surfaces = [surface(&a)?, surface(&b)?];
    let meshes = [Mesh::of(&surfaces[0], progress)?, Mesh::of(&surfaces[1], progress)?];
    // A mirror image moves with its scan, wherever that is.
    let mut registered = placed.map(|p| if order.by == By::Asymmetry { Registered::default() } else { p.registered() });
    let on = [0, 1].map(|n| placed[n].index);
    let (moved, covariance);
    let scanned = |n: usize| Scanned { surface: &surfaces[n], iso: placed[n].iso, tolerance: iso_tolerance(placed[n].volume) };
    let (maps, asked) = if let Some(by) = order.by.of_points() {
        moved = None;
        let at = [0, 1].map(|n| asked(&meshes[n], order, on[n], &DAffine3::IDENTITY));
        let asked = at.each_ref().map(|at| Asked { by, reach_mm, at });
        (of_points(placed, &surfaces, &meshes, registered, asked, progress)?, at)
    } else {
        let found = displacement::moved([&scanned(0), &scanned(1)], &order.parts, reach_mm, progress)?;
        // The part errs beside whatever lays the scans onto each other.
        let scan = usize::from(registered[0].covariance.is_none() && registered[0].is_known());
        covariance = registered[scan].covariance.map_or(found.covariance.clone(), |own| own.and(&found.covariance));
        registered[scan] = Registered { residual_mm: None, covariance: Some(&covariance) };
        let ways = [[&found.motion, &found.without_blur], [&found.motion.inverse(), &found.without_blur.inverse()]];
        let asked = [asked(&meshes[0], order, on[0], &DAffine3::IDENTITY), asked(&meshes[1], order, on[1], ways[1][0])];
        let maps = [0, 1].map(|n| difference::displaced(&meshes[n], ways[n], &asked[n], n == 0, registered));
        moved = Some(found);
        (maps, asked)
    };
    let statistics = [0, 1].map(|n| Statistics::of(&meshes[n], &maps[n], registered, &asked[n]));
    if statistics.iter().all(Option::is_none) {
        return Err(DifferenceError::Apart { first: a.name, second: b.name, reach_mm });
    }
    let mut notes = notes(placed, order.by);
    notes.extend(moved.as_ref().map(Moved::told));
    let transforms = [(a.iso, a.transform), (b.iso, b.transform)];
    let names = [a.name, b.name];
    let mut halves = names.into_iter().zip(transforms).zip(surfaces).zip(meshes).zip(maps).zip(asked).zip(statistics).map(
        |((((((name, (iso, transform)), surface), mesh), map), asked), statistics)| Half {
            name,
            iso,
            transform,
            surface,
            mesh,
            map,
            asked,
            statistics,
        },
    );
    // There are two of each.
    let halves = std::array::from_fn(|_| halves.next().expect("there are two halves"));
    Ok(Measured { order: order.clone(), reach_mm, moved, halves, notes })
}

pub(crate) fn surface(placed: &Placed<'_>) -> Result<Surface, SurfaceError> {
    Surface::new(placed.volume, placed.iso, placed.transform)
}

/// The mirror image of a scan, laid onto the scan.
fn image<'a>(opened: &'a Opened, index: usize, progress: &Progress) -> Result<Placed<'a>, DifferenceError> {
    let own = Placed::of(opened, index);
    let found = symmetry(&surface(&own)?, &Parts::default(), progress)?;
    Ok(Placed {
        name: format!("{}, mirrored", own.name),
        transform: found.image * own.transform,
        residual_mm: None,
        covariance: None,
        ..own
    })
}

/// Both maps, each point with its own partner.
fn of_points(
    placed: [&Placed<'_>; 2],
    surfaces: &[Surface; 2],
    meshes: &[Mesh; 2],
    registered: [Registered<'_>; 2],
    asked: [Asked<'_>; 2],
    progress: &Progress,
) -> Result<[difference::Map; 2], Cancelled> {
    let partners = [Partners::of(&surfaces[0], progress)?, Partners::of(&surfaces[1], progress)?];
    let errors = |n: usize| PointErrors::of(&surfaces[n], &meshes[n], placed[n].iso, iso_tolerance(placed[n].volume), progress);
    let errors = [errors(0)?, errors(1)?];
    let side =
        |n: usize| Side { surface: &surfaces[n], mesh: &meshes[n], partners: &partners[n], errors: &errors[n], registered: registered[n] };
    let on = |n: usize| difference::map(side(0), side(1), n == 0, asked[n], progress);
    Ok([on(0)?, on(1)?])
}

/// Which points of a surface are asked for, of what they are at once `back` has moved them.
fn asked(mesh: &Mesh, order: &Order, index: usize, back: &DAffine3) -> Vec<bool> {
    let left = Region::of(&order.clips, index);
    mesh.vertices.iter().map(|point| order.parts.hold(back.transform_point3(*point)) && left.depth_mm(*point) >= 0.0).collect()
}

/// What the person should know of two scans that are compared.
pub(crate) fn notes([a, b]: [&Placed<'_>; 2], by: By) -> Vec<String> {
    let thresholds = [a, b].map(|p| (p.name.as_str(), p.iso, p.volume.unit()));
    let mut notes: Vec<String> = unlike_thresholds(&thresholds).into_iter().collect();
    notes.extend(corrections(a.volume));
    if by == By::Asymmetry {
        notes.push(
            "the plane of symmetry is found from the surface itself, and what is asymmetric biases it; its error is not in the ±".into(),
        );
        return notes;
    }
    notes.extend(corrections(b.volume));
    notes.extend([a, b].into_iter().filter_map(|p| mirrored(&p.name, &p.transform)));
    let is_known = [a, b].iter().any(|p| p.registered().is_known());
    if !is_known {
        notes.push("the registration's error is not known, and is not in the ±".into());
    }
    notes
}

impl Measured {
    /// Whether its scans are open, with the isovalues and where they were.
    pub fn is_of(&self, opened: &Opened) -> bool {
        let is_there = |(k, (half, n)): (usize, (&Half, &usize))| {
            let Some(layer) = opened.scene.layers.get(*n) else { return false };
            // A mirror image lies elsewhere than its scan.
            let is_placed = k == 1 && self.order.by == By::Asymmetry || half.transform == layer.transform;
            opened.is_measured(*n, &half.surface.volume) && half.iso == layer.iso && is_placed
        };
        self.halves.iter().zip(&self.order.pair).enumerate().all(is_there)
    }

    /// The larger of both one-sided distances, where it is that of closest points: the Hausdorff distance within the reach, mm.
    pub fn largest_mm(&self) -> f64 {
        self.halves.iter().filter_map(|h| h.statistics.as_ref()).map(|s| s.largest.difference_mm.abs()).fold(0.0, f64::max)
    }

    /// The end of a symmetric range of colours, mm: what 95 % of the areas stay below.
    pub fn range_mm(&self) -> f64 {
        self.halves.iter().filter_map(|h| h.statistics.as_ref()).map(|s| s.magnitude_95_mm).fold(0.0, f64::max)
    }

    /// What + means.
    pub fn legend(&self) -> String {
        self.order.by.legend([&self.halves[0].name, &self.halves[1].name])
    }

    /// What is kept of it.
    pub fn record(&self, made_by: Option<&Origin>) -> RecordedDifference {
        let half = |half: &Half| RecordedHalf { on: half.name.clone(), statistics: half.statistics.as_ref().map(|s| serde_json::json!(s)) };
        RecordedDifference {
            difference: Told {
                order: self.order.clone(),
                reach_mm: self.reach_mm,
                legend: self.legend(),
                moved: self.moved.clone(),
                largest_mm: self.largest_mm(),
                halves: self.halves.iter().map(half).collect(),
                notes: self.notes.clone(),
            },
            made_by: made_by.cloned(),
        }
    }
}
