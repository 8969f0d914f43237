//! Sections along a curve of what is open: thickness of one scan or of two, and how they differ.

use crate::difference::{Placed, notes, reach_mm, surface};
use crate::difference_order::By;
use crate::measurement::{Origin, RecordedSection};
use crate::opened::Opened;
use crate::section_order::{Order, Told};
use bregma_field::{Cancelled, Progress, Surface, SurfaceError, Volume};
use bregma_measure::csv::Made;
use bregma_measure::difference::{PointErrors, Side};
use bregma_measure::mesh::Mesh;
use bregma_measure::partner::Partners;
use bregma_measure::section::{self, Line, Named, Plane, stations};
use bregma_measure::{corrections, iso_tolerance, mirrored};
use bregma_register::orient::midsagittal;
use glam::{DAffine3, DVec3};
use std::sync::Arc;
use thiserror::Error;

/// Why there is no section.
#[derive(Debug, Error)]
pub enum SectionError {
    /// A registration that flattens a scan.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// A scan that is not there.
    #[error("a section is asked for of scan number {number}, and {open} are open; open the scans that it was made of")]
    NotOpen {
        /// The scan, from 1.
        number: usize,
        /// How many there are.
        open: usize,
    },
    /// A curve that is not there.
    #[error(transparent)]
    Section(#[from] section::SectionError),
    /// A landmark that is not there.
    #[error("{name}: no landmark of that name is set; {}", if others.is_empty() { "none is".into() } else { format!("there are {}", others.join(", ")) })]
    NoLandmark {
        /// The name.
        name: String,
        /// Those that are set.
        others: Vec<String>,
    },
    /// Landmarks on a line.
    #[error("{0} span no plane: three or more that do not lie on a line do")]
    NoPlane(String),
}

impl From<Cancelled> for SectionError {
    fn from(cancelled: Cancelled) -> Self {
        Self::Section(cancelled.into())
    }
}

/// What was measured.
#[derive(Clone, Debug)]
pub struct Measured {
    /// What was asked for and found.
    pub told: Told,
    /// Each scan with its isovalue and place.
    scans: Vec<(Arc<Volume>, f64, DAffine3)>,
}

/// The landmark of a name, whatever the size of its letters: of several, one that belongs to the scan of number `on`, or to none, is the
/// first choice.
pub fn landmark(opened: &Opened, on: usize, name: &str) -> Result<Named, SectionError> {
    let set = || opened.landmarks.iter().filter_map(|l| Some((l, l.point_mm.filter(|p| p.is_finite())?)));
    let scan = opened.volumes.get(on).map(|volume| volume.name());
    let rank = |of: Option<&str>| if of == scan { 0 } else { 1 + usize::from(of.is_some()) };
    let same = set().filter(|(l, _)| l.name.to_lowercase() == name.to_lowercase());
    let found = same.min_by_key(|(l, _)| rank(l.scan.as_deref()));
    let none = || SectionError::NoLandmark { name: name.to_owned(), others: set().map(|(l, _)| l.name.clone()).collect() };
    found.map(|(l, point_mm)| Named { name: l.name.clone(), point_mm }).ok_or_else(none)
}

/// The plane of three landmarks, or of least squares through more.
pub fn plane_of(landmarks: &[Named]) -> Result<Plane, SectionError> {
    let points: Vec<DVec3> = landmarks.iter().map(|l| l.point_mm).collect();
    let names = || landmarks.iter().map(|l| l.name.as_str()).collect::<Vec<_>>().join(", ");
    let plane = midsagittal(&points).ok_or_else(|| SectionError::NoPlane(names()))?;
    Ok(Plane { point_mm: plane.point_mm, normal: plane.normal })
}

/// Measures a section of what is open.
pub fn measure(opened: &Opened, order: &Order, progress: &Progress) -> Result<Measured, SectionError> {
    let opened = &opened.measured();
    let numbers: Vec<usize> = std::iter::once(order.on).chain(order.against).collect();
    if let Some(number) = numbers.iter().find(|n| **n >= opened.volumes.len()) {
        return Err(SectionError::NotOpen { number: number + 1, open: opened.volumes.len() });
    }
    let placed: Vec<Placed<'_>> = numbers.iter().map(|n| Placed::of(opened, *n)).collect();
    let surfaces = placed.iter().map(surface).collect::<Result<Vec<Surface>, _>>()?;
    let partners = surfaces.iter().map(|s| Partners::of(s, progress)).collect::<Result<Vec<_>, _>>()?;
    // Along a curve there are few enough points for each to have its own edge read.
    let mesh = Mesh::default();
    let errors = surfaces
        .iter()
        .zip(&placed)
        .map(|(s, p)| PointErrors::of(s, &mesh, p.iso, iso_tolerance(p.volume), progress))
        .collect::<Result<Vec<_>, _>>()?;
    let side = |n: usize| Side {
        surface: &surfaces[n],
        mesh: &mesh,
        partners: &partners[n],
        errors: &errors[n],
        registered: placed[n].registered(),
    };
    let line = Line::of(&surfaces[0], &partners[0], &order.path, progress)?;
    let of_two = || order.reach_mm.unwrap_or_else(|| reach_mm([0, 1].map(|n| &**placed[n].volume)));
    let looked_mm = (placed.len() > 1).then(of_two);
    let stations = stations(&line, order.step_mm, side(0), looked_mm.map(|mm| (side(1), mm)), progress)?;
    let of_scans = match &placed[..] {
        [a, b] => notes([a, b], By::Partner),
        _ => placed.iter().flat_map(|p| corrections(p.volume).into_iter().chain(mirrored(&p.name, &p.transform))).collect(),
    };
    let told = Told {
        order: order.clone(),
        looked_mm,
        scans: placed.iter().map(|p| p.name.clone()).collect(),
        length_mm: line.length_mm(),
        is_closed: line.is_closed,
        notes: line.notes.iter().cloned().chain(of_scans).collect(),
        marks: line.marks,
        stations,
    };
    Ok(Measured { told, scans: placed.iter().map(|p| (Arc::clone(p.volume), p.iso, p.transform)).collect() })
}

impl Measured {
    /// Whether its scans are open, with the isovalues and where they were.
    pub fn is_of(&self, opened: &Opened) -> bool {
        let numbers = std::iter::once(self.told.order.on).chain(self.told.order.against);
        self.scans.iter().zip(numbers).all(|((volume, iso, transform), n)| {
            let Some(layer) = opened.scene.layers.get(n) else { return false };
            opened.is_measured(n, volume) && *iso == layer.iso && *transform == layer.transform
        })
    }

    /// What is kept of it.
    pub fn record(&self, made_by: Option<&Origin>) -> RecordedSection {
        RecordedSection { section: self.told.clone(), made_by: made_by.cloned() }
    }

    /// It as a table; see [`section::csv`].
    pub fn csv(&self, made: &Made) -> String {
        let Told { stations, marks, scans, notes, .. } = &self.told;
        section::csv(stations, marks, scans, notes, made)
    }
}
