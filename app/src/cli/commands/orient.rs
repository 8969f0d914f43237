//! `bregma orient`: one scan held by its points or by its symmetry.

use crate::cli::args::{OrientArgs, OrientBy};
use crate::cli::error::CommandError;
use crate::cli::opening::{open, require_spacing};
use crate::cli::terminal::{print, with_progress};
use bregma_field::{Registration, Surface, write_transform};
use bregma_measure::numbers::fixed;
use bregma_register::orient::{frankfurt, midsagittal, symmetry};
use bregma_register::{Parts, sureness};
use bregma_session::{CRANIOMETRIC, Opened};
use glam::{DAffine3, DVec3};
use serde_json::Map;
use std::path::Path;

/// Writes the pose that holds the scan so.
pub fn orient(args: &OrientArgs) -> Result<(), CommandError> {
    let opened = open(&args.sources.0, &args.isovalues)?;
    if opened.volumes.len() != 1 {
        return Err(CommandError::Usage(format!("{} scans are named; one is held", opened.volumes.len())));
    }
    require_spacing(&opened)?;
    if args.mirror_out.is_some() && args.by != OrientBy::Symmetry {
        return Err(CommandError::Usage("--mirror-out needs --by symmetry".into()));
    }
    let (pose, told) = match args.by {
        OrientBy::Frankfurt => by_points(&opened, args.pick_error)?,
        OrientBy::Symmetry => by_symmetry(&opened, args.mirror_out.as_deref())?,
    };
    write_transform(&args.out, None, &Registration::of(pose), Map::new())?;
    print(&format!("{}\n{told}{}\n", opened.volumes[0].name(), args.out.display()))
}

fn by_points(opened: &Opened, pick_mm: f64) -> Result<(DAffine3, String), CommandError> {
    let held = frankfurt(&opened.landmarks, pick_mm)?;
    let [x, y, z] = held.deviation_deg.to_array().map(|deg| fixed(deg, 2));
    let mut told =
        format!("  Frankfurt  sure to {x}° about x, {y}° about y and {z}° about z, where picks are to {} mm\n", fixed(pick_mm, 2));
    if let Some(mm) = held.right_orbitale_mm {
        told += &format!("  orbitale   the right one lies {} mm above the plane\n", fixed(mm, 2));
    }
    Ok((held.pose, told))
}

fn by_symmetry(opened: &Opened, image: Option<&Path>) -> Result<(DAffine3, String), CommandError> {
    let layer = &opened.scene.layers[0];
    let surface = Surface::new(&opened.measured().volumes[0], layer.iso, DAffine3::IDENTITY)?;
    let found = with_progress("mirroring", |progress| symmetry(&surface, &Parts::default(), progress))?;
    let DVec3 { x, y, z } = found.plane.normal;
    let mut told = format!(
        "  symmetry   normal ({}, {}, {}), {} mm from the world's origin; {} mm between the halves (median)\n  twist      {}° beside mirroring\n",
        fixed(x, 4),
        fixed(y, 4),
        fixed(z, 4),
        fixed(found.plane.normal.dot(found.plane.point_mm), 2),
        fixed(found.found.fit.median_mm(), 3),
        fixed(found.twist_deg, 2),
    );
    if let Some(plane) = midsagittal(&midline(opened)) {
        told += &format!("  midline    its points' plane is turned by {}° against this one\n", fixed(plane.angle_deg(&found.plane), 2));
    }
    if let Some(file) = image {
        let covariance = Some(sureness::covariance(&found.found.fit));
        let registration = Registration { transform: found.image, residual_mm: None, covariance };
        let record = Map::from_iter([("mirrored".to_owned(), true.into())]);
        write_transform(file, None, &registration, record)?;
        told += &format!("{}: the mirror image of {} on itself\n", file.display(), opened.volumes[0].name());
    }
    Ok((found.plane.upright(), told))
}

/// The usual points of the midline that are set, by their names or abbreviations.
fn midline(opened: &Opened) -> Vec<DVec3> {
    let is_of_midline = |name: &str| CRANIOMETRIC.iter().any(|d| !d.is_paired && [d.name, d.abbreviation].contains(&name));
    opened.landmarks.iter().filter(|l| is_of_midline(&l.name.to_lowercase())).filter_map(|l| l.point_mm).collect()
}
