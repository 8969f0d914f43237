//! The volume of bone: of one scan, or of two and what they share.

use super::error::VolumesError;
use super::other::{Other, point_of};
use super::pass::{Whole, pass, rows_of};
use super::sums::{Skin, Sums};
use super::sureness::{Bounding, Known, Measure, Sharpness};
use crate::numbers::significant;
use crate::{corrections, iso_tolerance, mirrored, unlike_thresholds};
use bregma_field::{Cancelled, Clip, Measured, Progress, Sample, Store, Surface, SurfaceError, Unit, Volume, with_block};
use serde::Serialize;
use std::sync::Arc;

/// A scan whose bone was measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeasuredBone {
    /// Its name.
    pub name: String,
    /// Its isovalue, in its values, with the tolerance that its ± stands for.
    pub iso: f64,
    /// How far the isovalue may be off.
    pub iso_tolerance: f64,
    /// Of isovalue and tolerance.
    pub unit: Unit,
    /// What it shows of the edge of bone; null where it shows none.
    pub sharpness: Option<Sharpness>,
}

/// Volumes of bone.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Volumes {
    /// One for each scan.
    pub scans: Vec<MeasuredBone>,
    /// What is unusual, in sentences.
    pub notes: Vec<String>,
    /// Of the first scan; of the second, of both, and of each without the other, where there are two.
    pub measures: Vec<Measure>,
}

/// What bounds the measured part of the world.
#[derive(Clone, Debug, Default)]
pub struct Limits {
    /// Only what these leave.
    pub clips: Vec<Clip>,
    /// Bone that the scan's box cuts is closed there, instead of refused.
    pub open: bool,
}

/// The volumes of the bone of one of `volumes`, or of two, each as `measured` has it, within `limits`. `progress` counts rows of bricks.
///
/// ```
/// use bregma_field::{Grid, Measured};
/// use bregma_measure::volumes::{Limits, bone};
/// use bregma_synthetic::analytic::Sphere;
/// use glam::{DAffine3, DMat3, DVec3};
/// use std::sync::Arc;
///
/// let grid = Grid::new([64; 3], DVec3::splat(0.5), DVec3::splat(-15.75), DMat3::IDENTITY)?;
/// let ball = Sphere { centre: DVec3::ZERO, radius_mm: 12.0 }.volume(&grid);
/// let whole = Measured { iso: 0.0, transform: DAffine3::IDENTITY, residual_mm: None, covariance: None, visible: true, solid: None };
/// let found = bone(&[Arc::new(ball)], &[whole], &Limits::default(), &Default::default())?;
/// assert!((found.measures[0].volume_mm3 / 7238.2 - 1.0).abs() < 2e-3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn bone(volumes: &[Arc<Volume>], measured: &[Measured], limits: &Limits, progress: &Progress) -> Result<Volumes, VolumesError> {
    if !(1..=2).contains(&volumes.len()) || measured.len() != volumes.len() {
        return Err(VolumesError::Count(volumes.len()));
    }
    let surface = |n: usize| Ok(Surface::new(&volumes[n], measured[n].iso, measured[n].transform)?.cut(&limits.clips, n));
    let surfaces = (0..volumes.len()).map(surface).collect::<Result<Vec<_>, SurfaceError>>()?;
    if !limits.open {
        surfaces.iter().try_for_each(refuse_cut_by_box)?;
    }
    progress.begin(surfaces.iter().map(rows_of).sum());
    let sums = match &surfaces[..] {
        [a, b] => {
            let one = |own: &Surface, other: &Surface| pass(own, Other::of(other, own).as_ref(), &Whole, progress);
            vec![one(a, b)?, one(b, a)?]
        }
        all => all.iter().map(|own| pass(own, None, &Whole, progress)).collect::<Result<Vec<Sums>, Cancelled>>()?,
    };
    let known: Vec<Known<'_>> = (0..surfaces.len()).map(|n| known(&surfaces[n], &measured[n], &sums[n])).collect();
    let names: Vec<String> = match volumes {
        [a, b] if a.name() == b.name() => vec![a.name().to_owned(), format!("{} (2)", b.name())],
        all => all.iter().map(|v| v.name().to_owned()).collect(),
    };
    let scans = known.iter().zip(&names).map(|(known, name)| measured_bone(known, name)).collect();
    Ok(Volumes { scans, notes: notes(volumes, measured, limits), measures: measures(&names, &known, &sums) })
}

pub fn known<'a>(surface: &'a Surface, measured: &'a Measured, sums: &Sums) -> Known<'a> {
    Known { surface, measured, tolerance: iso_tolerance(&surface.volume), sharpness: Sharpness::of(surface, &sums.points) }
}

pub fn measured_bone(known: &Known<'_>, name: &str) -> MeasuredBone {
    let (iso, unit) = (known.measured.iso, known.surface.volume.unit());
    MeasuredBone { name: name.to_owned(), iso, iso_tolerance: known.tolerance, unit, sharpness: known.sharpness }
}

/// One volume, or five of two scans.
fn measures(names: &[String], known: &[Known<'_>], sums: &[Sums]) -> Vec<Measure> {
    let bounding = |n: usize, skin: Skin, sign: f64| {
        // A whole scan that moves alone keeps its volume.
        let moves = !known[n].surface.region.is_all() || known.len() == 2;
        Bounding { known: &known[n], skin, sign, moves }
    };
    let alone = |n: usize| {
        let moves = !known[n].surface.region.is_all();
        Measure::of(names[n].clone(), &[sums[n].own], &[Bounding { moves, ..bounding(n, sums[n].skin, 1.0) }])
    };
    let [a, b] = match sums {
        [a, b] => [a, b],
        _ => return (0..sums.len()).map(alone).collect(),
    };
    let both = [bounding(0, a.shared_skin, 1.0), bounding(1, b.shared_skin, 1.0)];
    let without = |own: usize, other: usize| {
        let [from, taken] = [&sums[own], &sums[other]];
        let bounds = [bounding(own, from.skin.without(from.shared_skin), 1.0), bounding(other, taken.shared_skin, -1.0)];
        Measure::of(format!("{} without {}", names[own], names[other]), &[from.alone], &bounds)
    };
    let shared = Measure::of(format!("{} and {}", names[0], names[1]), &[a.shared, b.shared], &both);
    vec![alone(0), alone(1), shared, without(0, 1), without(1, 0)]
}

fn notes(volumes: &[Arc<Volume>], measured: &[Measured], limits: &Limits) -> Vec<String> {
    let thresholds: Vec<(&str, f64, Unit)> = volumes.iter().zip(measured).map(|(v, m)| (v.name(), m.iso, v.unit())).collect();
    let mut notes: Vec<String> = unlike_thresholds(&thresholds).into_iter().collect();
    for (volume, measured) in volumes.iter().zip(measured) {
        notes.extend(corrections(volume).into_iter().chain(mirrored(volume.name(), &measured.transform)));
        let scale = measured.transform.matrix3.determinant().abs();
        // Files state matrices to six digits.
        if (scale - 1.0).abs() > 1e-5 {
            let times = significant(scale, 6);
            notes.push(format!("{}: its registration makes its volumes {times} times as large: they are not its own", volume.name()));
        }
    }
    if limits.open {
        notes.push("bone is closed at the scan's box where that cuts it".into());
    }
    notes
}

/// Refuses a scan whose box cuts the bone that is to be measured.
fn refuse_cut_by_box(surface: &Surface) -> Result<(), VolumesError> {
    let dims = surface.grid.dims();
    let is_bone = |at: [usize; 3]| {
        let sample = with_block!(Store::of(&surface.volume).whole(), block => block.at(at).to_f64());
        let within = || surface.region.is_all() || surface.region.depth_mm(point_of(surface, at)) >= 0.0;
        f64::from(surface.sign) * (sample - surface.level) >= 0.0 && within()
    };
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for end in [0, dims[axis] - 1] {
            let on_face = (0..dims[v]).flat_map(|y| (0..dims[u]).map(move |x| (x, y)));
            let place = |(x, y)| {
                let mut at = [end; 3];
                (at[u], at[v]) = (x, y);
                at
            };
            if let Some(at) = on_face.map(place).find(|at| is_bone(*at)) {
                return Err(VolumesError::CutByBox { scan: surface.volume.name().to_owned(), at_mm: point_of(surface, at) });
            }
        }
    }
    Ok(())
}
