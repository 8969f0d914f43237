//! `bregma probe`: the difference ray, one or many.

use crate::cli::args::{ProbeArgs, ProbeFormat};
use crate::cli::error::CommandError;
use crate::cli::opening::{open, require_spacing};
use crate::cli::terminal::{print, warn, with_progress};
use bregma_field::WorldPoint;
use bregma_measure::export::{self, Named};
use bregma_measure::{DifferenceRay, csv};
use bregma_renderer::Ray;
use bregma_session::record::{made, measure};
use bregma_session::{Measurement, Origin};
use glam::DVec3;
use rayon::prelude::*;
use std::path::Path;

/// Casts the rays and prints what they meet.
pub fn probe(args: &ProbeArgs) -> Result<(), CommandError> {
    let rays = match &args.rays {
        Some(file) => read_rays(file)?,
        None => vec![("ray 1".to_owned(), single_ray(args)?)],
    };
    let (names, rays): (Vec<String>, Vec<Ray>) = rays.into_iter().unzip();
    let opened = open(&args.sources.0, &args.isovalues)?;
    require_spacing(&opened)?;
    let is_cut = opened.scene.clips.iter().any(|clip| clip.enabled);
    if args.as_cut && !is_cut {
        warn(&["--as-cut: nothing is cut, so the whole bone is measured".into()]);
    } else if is_cut && !args.as_cut {
        warn(&["the session's cuts are ways of looking: the whole bone is measured; pass --as-cut to measure what they leave".into()]);
    }
    let cast = |ray: &Ray| measure(&opened, ray, args.as_cut);
    let found = with_progress("casting", |progress| {
        progress.begin(rays.len() as u64);
        // Nobody cancels here: the command is simply ended.
        let counted = |ray: &Ray| cast(ray).inspect(|_| progress.advance(1).unwrap_or_default());
        rays.par_iter().map(counted).collect::<Result<Vec<DifferenceRay>, _>>()
    })?;
    let origin = if args.format == ProbeFormat::Json { Origin::of(&opened) } else { None };
    let json = |(d, name): (&DifferenceRay, &String)| Measurement::of_ray(d, Some((name, None)), origin.as_ref()).to_string() + "\n";
    let named: Vec<Named<'_>> = names.iter().zip(&found).map(|(name, found)| Named { name, found }).collect();
    let text = match args.format {
        ProbeFormat::Table if args.rays.is_none() => found.iter().map(export::table).collect(),
        ProbeFormat::Table => export::table_of_rays(&named),
        ProbeFormat::Json => found.iter().zip(&names).map(json).collect(),
        ProbeFormat::Csv => csv::rays(&named, &made(&opened)),
        ProbeFormat::Markups => format!("{:#}\n", export::markups(&named)),
    };
    print(&text)
}

fn single_ray(args: &ProbeArgs) -> Result<Ray, CommandError> {
    let origin = args.origin.unwrap_or(DVec3::ZERO);
    let direction = args.direction.or(args.toward.map(|t| t - origin)).unwrap_or(DVec3::ZERO);
    let ray = Ray::new(WorldPoint(origin), direction);
    ray.ok_or_else(|| CommandError::Usage("the ray has no direction; give --direction, or --toward a point other than --origin".into()))
}

/// The columns of a list of rays; a column of names may stand before them.
const RAYS_HEADER: &str = "ox,oy,oz,dx,dy,dz";

/// Rays by their names, which are their numbers where the list has none.
fn read_rays(file: &Path) -> Result<Vec<(String, Ray)>, CommandError> {
    let fail = |reason: String| CommandError::Rays { file: file.to_owned(), reason };
    let text = std::fs::read_to_string(file).map_err(|e| fail(format!("cannot be read ({e}); check its name and permissions")))?;
    let mut lines = text.trim_start_matches('\u{feff}').lines().enumerate().filter(|(n, line)| *n == 0 || !line.trim().is_empty());
    let header = lines.next().map_or(String::new(), |(_, line)| line.replace(' ', ""));
    let is_named = header.strip_prefix("name,").is_some_and(|rest| rest == RAYS_HEADER);
    if !(is_named || header == RAYS_HEADER) {
        return Err(fail(format!("its first line is not {RAYS_HEADER}, or name,{RAYS_HEADER}; write that header, then one ray a line")));
    }
    let ray = |(count, (n, line)): (usize, (usize, &str))| {
        let (name, rest) = line.split_once(',').filter(|_| is_named).unwrap_or(("", line));
        let numbers: Option<Vec<f64>> = rest.split(',').map(|t| t.trim().parse().ok()).collect();
        let numbers: Option<[f64; 6]> = numbers.and_then(|v| v.try_into().ok());
        let ray = numbers.and_then(|[ox, oy, oz, dx, dy, dz]| Ray::new(WorldPoint(DVec3::new(ox, oy, oz)), DVec3::new(dx, dy, dz)));
        let ray = ray.ok_or_else(|| fail(format!("line {} is not six numbers with a direction other than 0,0,0; correct it", n + 1)))?;
        let name = name.trim().trim_matches('"');
        Ok((if name.is_empty() { format!("ray {}", count + 1) } else { name.to_owned() }, ray))
    };
    lines.enumerate().map(ray).collect()
}
